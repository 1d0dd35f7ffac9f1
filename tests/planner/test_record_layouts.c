/* The record of every layout: panels and fixed parts as the structure has them, indices in range, and a check
 * that finds those that are not. */
#include "planner/check_parts.h"
#include "planner/plan.h"
#include "planner/record_h5.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static morph_structure *make(morph_layout layout, morph_joint_type joints, morph_bracing bracing,
                             morph_fixed fixed) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    def.layout = layout;
    def.joints = joints;
    def.bracing = bracing;
    def.fixed = fixed;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static void fill(const morph_structure *s, morph_record *r) {
    double v[9] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    int t[3] = {0, 1, 2};
    const morph_mesh target = {.vertices = 3, .triangles = 1, .v = v, .t = t};
    *r = (morph_record){0};
    assert_int_equal(morph_record_structure(r, s, &target, 0.0), MORPH_OK);
}

static bool sound(const morph_record *r) {
    morph_findings f = {0};
    return morph_check_structure(r, &f);
}

static void test_layouts(void **state) {
    (void)state;
    static const struct {
        morph_layout layout;
        morph_joint_type joints;
        morph_bracing bracing;
        morph_fixed fixed;
        int panels, held;
    } cases[] = {
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_FIXED_NONE, 0, 0},
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_WEB, MORPH_FIXED_CORNERS, 24, 4},
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_FULL, MORPH_FIXED_BORDER, 0, 12},
        {MORPH_LAYOUT_OFFSET, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_FIXED_BORDER, 0, 12},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        morph_structure *s = make(cases[k].layout, cases[k].joints, cases[k].bracing, cases[k].fixed);
        morph_record r;
        char message[160];
        fill(s, &r);
        assert_int_equal(r.panels, cases[k].panels);
        assert_int_equal(r.fixed_count, cases[k].held);
        assert_int_equal(r.links, s->links);
        assert_memory_equal(r.panel, s->panel, (size_t)s->panels * sizeof(int[2]));
        assert_memory_equal(r.fixed, s->fixed, (size_t)s->fixed_count * sizeof(int));
        assert_true(morph_record_indices_hold(&r, message, sizeof message));
        assert_true(sound(&r));
        /* Beyond the posts, or the joints where there are none. */
        if (r.fixed_count > 0) {
            r.fixed[0] = r.posts > 0 ? r.posts : r.joints;
            assert_false(sound(&r));
            r.fixed[0]--;
            assert_true(sound(&r));
        }
        if (r.panels > 0) {
            r.panel[3][1] = r.posts;
            assert_false(sound(&r));
        }
        morph_record_free(&r);
        morph_structure_destroy(s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layouts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
