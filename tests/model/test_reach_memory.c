/* Every allocation of the reach check fails in turn: MORPH_ERR_NOMEM, nothing left. The C library's allocator
 * is wrapped, so this is skipped where a sanitizer has its own. */
#include "model/reach.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/refused_memory.h"

#if CAN_REFUSE
static void test_refused(void **state) {
    (void)state;
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    morph_structure *s;
    morph_mesh mesh;
    morph_distance *d;
    morph_reach reach;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    assert_int_equal(morph_mesh_cone(0.1, 0.1, 1e-3, &mesh), MORPH_OK);
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    const long before = live;
    long at = 0;
    morph_status status = MORPH_ERR_NOMEM;
    for (; status != MORPH_OK && at < 100; at++) {
        countdown = at;
        status = morph_reach_check(s, d, -0.05, 1.0, &reach);
        countdown = -1;
        if (live != before) fail_msg("allocation %ld refused: %ld blocks left", at, live - before);
        if (status != MORPH_OK && status != MORPH_ERR_NOMEM) fail_msg("status %d", (int)status);
    }
    assert_int_equal(status, MORPH_OK);
    assert_true(at > 8); /* so many it makes: the heights, their scratch, two elements */
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    morph_structure_destroy(s);
}
#else
static void test_refused(void **state) {
    (void)state;
    skip();
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
