/* Every allocation of building a structure, its mobility and a shape from lengths fails in turn:
 * MORPH_ERR_NOMEM, nothing left. The C library's allocator is wrapped, so this is skipped where a sanitizer
 * has its own. */
#include "model/kinematics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/refused_memory.h"

#if CAN_REFUSE
static const int held[2][2] = {{0, 0}, {1, 2}};

static morph_structure_def def_of(void) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    def.joints = MORPH_JOINTS_UNIVERSAL;
    def.bracing = MORPH_BRACING_FULL;
    def.fixed = MORPH_FIXED_LIST;
    def.fixed_nodes = 2;
    def.fixed_node = held;
    return def;
}

static void test_create(void **state) {
    (void)state;
    const morph_structure_def def = def_of();
    int refused = 0;
    for (long n = 0;; n++) {
        morph_structure *s;
        const long before = live;
        countdown = n;
        const morph_status status = morph_structure_create(&def, &s);
        const bool reached = was_refused();
        countdown = -1;
        if (!reached) assert_int_equal(status, MORPH_OK);
        if (reached) assert_int_equal(status, MORPH_ERR_NOMEM);
        morph_structure_destroy(s);
        assert_int_equal(live, before);
        if (!reached) break;
        refused++;
    }
    assert_true(refused > 20);
}

static void test_shape(void **state) {
    (void)state;
    const morph_structure_def def = def_of();
    morph_structure *s;
    double lengths[100], x[54];
    morph_shape_report report;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    morph_link_lengths(s, s->start, lengths);
    morph_blas_threads(1);
    /* One use first: what the libraries keep for themselves is then there. */
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, x, &report), MORPH_OK);
    for (int l = 0; l < s->links; l++)
        lengths[l] *= 1.02;
    int refused = 0;
    for (long n = 0;; n++) {
        const long before = live;
        countdown = n;
        const morph_status status = morph_shape_from_lengths(s, lengths, s->start, x, &report);
        const bool reached = was_refused();
        countdown = -1;
        assert_int_equal(live, before);
        assert_int_equal(status, reached ? MORPH_ERR_NOMEM : MORPH_OK);
        if (!reached) break;
        refused++;
    }
    assert_true(refused > 12);
    morph_structure_destroy(s);
}
#else
static void test_create(void **state) {
    (void)state;
    print_message("the sanitizer has an allocator of its own: skipped\n");
    skip();
}
static void test_shape(void **state) {
    (void)state;
    skip();
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create),
        cmocka_unit_test(test_shape),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
