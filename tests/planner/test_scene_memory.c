/* Every allocation of reading and writing a scene fails in turn: MORPH_ERR_NOMEM, nothing left, no crash.
 * The C library's allocator is wrapped, so this is skipped where a sanitizer has its own. */
#include "planner/scene_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/refused_memory.h"

#if CAN_REFUSE
static const char good[] =
    "morphplan: 1\ntitle: x\nstructure: {nodes: [4, 4], spacing: 0.1, fixed: [[0, 0], [3, 1]]}\n"
    "target: {shape: box, size: [0.15, 0.15, 0.1], at: [0, 3, 0.1]}\n"
    "motion: {touch: [{node: [1, 2], layer: top, force: [0, 0, -2], from: 1.0, to: 1.5}]}\n"
    "attractors: [{at: [0, 0, 0.25], strength: 1.5}]\n";
static const char bad[] =
    "morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1, thikness: 1}\nstart: x\n"
    "target: {shape: mesh, file: missing.obj, fit: [0.1, 0.1, -0.1]}\nbase: [1]\n";

static void count_line(void *user, const char *line) {
    (void)line;
    ++*(int *)user;
}

static int lost;

/* One read with allocation n refused; false once n is beyond the last one. */
static bool read_refused(const char *text, morph_status otherwise, long n) {
    morph_scene *scene = NULL;
    int lines = 0;
    const long before = live;
    countdown = n;
    const morph_status status =
        morph_scene_parse("dir/s.yaml", text, strlen(text), count_line, count_line, &lines, &scene);
    const bool reached = was_refused();
    countdown = -1;
    if (status == MORPH_OK) {
        assert_non_null(scene);
        morph_scene_destroy(scene);
    } else {
        assert_null(scene);
    }
    if (!reached || status != MORPH_ERR_NOMEM) assert_int_equal(status, otherwise);
    if (status == MORPH_ERR_NOMEM) assert_int_equal(lines, 0);
    /* libyaml 0.2.5 itself loses one text when its loader cannot queue a token. */
    assert_true(live == before || (status == MORPH_ERR_NOMEM && live == before + 1));
    lost += live != before;
    return reached;
}

static void test_read(void **state) {
    (void)state;
    for (int mode = 0; mode < 2; mode++) {
        dry = mode == 1;
        long n = 0;
        while (read_refused(good, MORPH_OK, n))
            n++;
        assert_true(n > 20);
        assert_true(lost <= 2 * (mode + 1));
        for (n = 0; read_refused(bad, MORPH_ERR_INPUT, n);)
            n++;
        assert_true(n > 20);
    }
}

static void test_write(void **state) {
    (void)state;
    morph_scene *scene;
    dry = false;
    assert_int_equal(morph_scene_parse("s.yaml", good, strlen(good), NULL, NULL, NULL, &scene), MORPH_OK);
    int refused = 0;
    for (long n = 0; n < 100; n++) {
        char *text;
        countdown = n;
        const morph_status status = morph_scene_to_yaml(scene, NULL, &text);
        const bool reached = was_refused();
        countdown = -1;
        if (!reached) {
            assert_int_equal(status, MORPH_OK);
            free(text);
            break;
        }
        assert_int_equal(status, MORPH_ERR_NOMEM);
        assert_null(text);
        refused++;
    }
    assert_true(refused > 0);
    morph_scene_destroy(scene);
}
#else
static void test_read(void **state) {
    (void)state;
    print_message("the sanitizer has an allocator of its own: skipped\n");
    skip();
}
static void test_write(void **state) {
    (void)state;
    skip();
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_read),
        cmocka_unit_test(test_write),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
