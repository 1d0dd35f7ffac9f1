/* Structures of every kind: what a pose, a projection and a path make of held nodes, plane panels, braces and
 * a target that rises. */
#include "test_pose_fixture.h"

#include "planner/path.h"

#include <stdlib.h>
#include <string.h>

enum { FRAMES = 40 };
static const morph_inset inset = {.length = 1e-3, .angle = 2e-3, .clearance = 0.0, .self = 1e-3};

static void make(fixture *f, morph_joint_type joints, morph_bracing bracing, morph_layout layout,
                 morph_fixed fixed, int nodes) {
    morph_structure_def def = morph_structure_defaults(STEP);
    const solid ball = {.ball = true, .centre = {0.0, 0.0, 0.0}, .radius = 0.1};
    def.nodes[0] = def.nodes[1] = nodes;
    def.joints = joints;
    def.bracing = bracing;
    def.layout = layout;
    def.fixed = fixed;
    fixture_make_def(f, &def, &ball, -0.2);
}

/* As the check has it. */
static double sine(const int a[2], const int b[2], const double *x) {
    double u[3], v[3], d[3], c[3];
    morph_sub(&x[3 * a[1]], &x[3 * a[0]], u);
    morph_sub(&x[3 * b[1]], &x[3 * b[0]], v);
    morph_sub(&x[3 * b[0]], &x[3 * a[0]], d);
    morph_cross(u, v, c);
    return fabs(morph_dot(c, d)) / (morph_norm(u) * morph_norm(v) * morph_norm(d));
}

/* A pose over the ball, bent and shaken; held joints are left alone. */
static void shake(fixture *f, double height, double amount, uint64_t *seed) {
    fixture_flat(f, height);
    for (int i = 0; i < f->n; i++) {
        if (f->s->joint_fixed[i / 3]) continue;
        f->x[i] += amount * noise(seed);
    }
}

/* With the target above its place by as much as the pose is above it, everything but the base is the same. */
static void test_lift(void **state) {
    (void)state;
    fixture f;
    uint64_t seed = 3;
    make(&f, MORPH_JOINTS_BALL, MORPH_BRACING_WEB, MORPH_LAYOUT_POSTS, MORPH_FIXED_NONE, 4);
    double *low = morph_alloc((size_t)f.n, sizeof *low);
    assert_non_null(low);
    for (int k = 0; k < 5; k++) {
        morph_violation a, b;
        shake(&f, 0.12 + 0.01 * k, 0.1, &seed);
        memcpy(low, f.x, (size_t)f.n * sizeof *low);
        f.world.lift = 0.0;
        assert_int_equal(morph_pose_examine(&f.world, low, NULL, NULL, NULL, NULL, &a), MORPH_OK);
        f.world.lift = 0.03;
        for (int i = 2; i < f.n; i += 3)
            f.x[i] += 0.03 / STEP;
        assert_int_equal(morph_pose_examine(&f.world, f.x, NULL, NULL, NULL, NULL, &b), MORPH_OK);
        for (int m = 0; m < MORPH_LIMITS; m++)
            if (m == MORPH_LIMIT_BASE)
                assert_near(b.amount[m], a.amount[m] - 0.3, 1e-12);
            else if (a.amount[m] > -INFINITY)
                assert_near(b.amount[m], a.amount[m], 1e-12);
    }
    free(low);
    fixture_free(&f);
}

/* Projects; the pose is then within its limits, held joints are where they were to the bit, panels plane. */
static void check_projected(fixture *f, int trials, double height, double amount) {
    uint64_t seed = 11;
    double *before = morph_alloc((size_t)f->n, sizeof *before);
    assert_non_null(before);
    for (int k = 0; k < trials; k++) {
        morph_violation v;
        morph_effort effort = {0};
        morph_limit which = MORPH_LIMIT_POST;
        shake(f, height, amount, &seed);
        memcpy(before, f->x, (size_t)f->n * sizeof *before);
        assert_int_equal(morph_project(&f->world, &inset, 8, NULL, f->active, f->x, &v, &effort), MORPH_OK);
        if (morph_violation_worst(&v, morph_pose_tolerance, &which) > 1.0)
            fail_msg("%s beyond by %.3g at %s", morph_limit_name(which), v.amount[which], v.element[which]);
        for (int i = 0; i < f->n; i++)
            if (f->s->joint_fixed[i / 3] && f->x[i] != before[i]) fail_msg("held joint %d moved", i / 3);
        for (int q = 0; q < f->s->panels; q++)
            assert_true(sine(f->s->post[f->s->panel[q][0]], f->s->post[f->s->panel[q][1]], f->x) <= 5e-7);
        for (int l = 0; l < f->s->links; l++) {
            const double length = STEP * morph_dist(&f->x[3 * f->s->link[l][0]], &f->x[3 * f->s->link[l][1]]);
            assert_true(beyond_range(length, f->s->length_limit[l]) <= 1e-9 * STEP);
        }
    }
    free(before);
    fixture_free(f);
}

static void test_projection(void **state) {
    (void)state;
    fixture f;
    make(&f, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_NONE, MORPH_LAYOUT_POSTS, MORPH_FIXED_NONE, 4);
    check_projected(&f, 4, 0.11, 0.15);
    make(&f, MORPH_JOINTS_BALL, MORPH_BRACING_FULL, MORPH_LAYOUT_POSTS, MORPH_FIXED_NONE, 4);
    check_projected(&f, 4, 0.11, 0.15);
    make(&f, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_LAYOUT_OFFSET, MORPH_FIXED_NONE, 4);
    check_projected(&f, 4, 0.11, 0.15);
    /* The ball stands a little higher than the flat sheet. */
    make(&f, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_LAYOUT_POSTS, MORPH_FIXED_BORDER, 5);
    check_projected(&f, 4, 0.09, 0.1);
    make(&f, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_WEB, MORPH_LAYOUT_POSTS, MORPH_FIXED_CORNERS, 4);
    check_projected(&f, 2, 0.11, 0.1);
}

/* Nothing that hangs on held joints alone has a row: with all of them held there are none at all. */
static void test_held_rows(void **state) {
    (void)state;
    static const morph_nearness wide = {1.0, 2.0, 1.0, 1.0};
    fixture f;
    make(&f, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_NONE, MORPH_LAYOUT_POSTS, MORPH_FIXED_BORDER, 2);
    assert_int_equal(f.s->fixed_joints, f.s->joints);
    fixture_flat(&f, 0.1);
    assert_int_equal(morph_pose_examine(&f.world, f.x, &inset, &wide, f.active, NULL, NULL), MORPH_OK);
    assert_int_equal(morph_active_rows(f.active, f.s), 0);
    morph_block blocks[MORPH_POSE_BLOCKS];
    assert_int_equal(morph_active_blocks(f.active, &f.world, NULL, &inset, blocks), 0);
    fixture_free(&f);
    make(&f, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_NONE, MORPH_LAYOUT_POSTS, MORPH_FIXED_BORDER, 3);
    fixture_flat(&f, 0.1);
    assert_int_equal(morph_pose_examine(&f.world, f.x, &inset, &wide, f.active, NULL, NULL), MORPH_OK);
    /* The middle post alone is free: with four panels, eight links. */
    const int count = morph_active_blocks(f.active, &f.world, NULL, &inset, blocks);
    assert_true(count >= 3);
    assert_int_equal(blocks[0].rows, 1);
    assert_int_equal(blocks[1].rows, 4);
    assert_string_equal(blocks[2].name, "length");
    assert_int_equal(blocks[2].rows, 8);
    fixture_free(&f);
}

/* The sheet lies in its frame, the ball comes up through it: at every parameter the held joints stand, posts
 * are rigid, and the sheet is clear of the ball where that is then. */
static void test_rising_path(void **state) {
    (void)state;
    fixture f;
    make(&f, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_LAYOUT_POSTS, MORPH_FIXED_BORDER, 5);
    f.world.base = NAN;
    const size_t n = (size_t)f.n;
    double *start = morph_alloc(n, sizeof *start), *end = morph_alloc(n, sizeof *end),
           *x = morph_alloc(n, sizeof *x), time[FRAMES], lift[FRAMES];
    double *scratch = morph_alloc((size_t)morph_pose_width(f.s), sizeof *scratch);
    morph_trajectory guide = {.joints = f.s->joints, .frames = FRAMES, .time = time, .lift = lift};
    guide.x = morph_alloc(FRAMES * n, sizeof *guide.x);
    assert_true(start && end && x && scratch && guide.x);
    morph_violation v;
    morph_effort effort = {0};
    fixture_flat(&f, 0.09);
    for (size_t i = 0; i < n; i++)
        start[i] = STEP * f.x[i];
    assert_int_equal(morph_project(&f.world, &inset, 8, NULL, f.active, f.x, &v, &effort), MORPH_OK);
    for (size_t i = 0; i < n; i++)
        end[i] = STEP * f.x[i];
    /* Straight, and short of the ball's place. */
    for (size_t k = 0; k < FRAMES; k++) {
        time[k] = (double)k / (FRAMES - 1);
        lift[k] = -0.05 + 0.03 * time[k];
        for (size_t i = 0; i < n; i++)
            guide.x[k * n + i] = start[i] + time[k] * (end[i] - start[i]);
    }
    for (int unfold = 0; unfold < 2; unfold++) {
        morph_path_options o = morph_path_defaults();
        morph_path_report r;
        morph_curve *c = NULL;
        o.in_place = true;
        o.unfold = unfold == 1;
        assert_int_equal(morph_path_plan(&f.world, &guide, start, end, &o, &c, &r), MORPH_OK);
        assert_true(r.feasible);
        assert_near(morph_curve_lift(c, 0.0), -0.05, 0.0);
        assert_near(morph_curve_lift(c, 1.0), 0.0, 1e-15);
        for (int k = 0; k <= 100; k++) {
            const double s = k / 100.0, raised = morph_curve_lift(c, s);
            morph_curve_joints(c, s, 0, scratch, x);
            for (size_t i = 0; i < n; i++)
                if (f.s->joint_fixed[i / 3]) assert_near(x[i], start[i], 1e-15);
            for (int t = 0; t < f.s->skin_triangles; t++) {
                double at[3][3], d;
                for (int a = 0; a < 3; a++)
                    for (int m = 0; m < 3; m++)
                        at[a][m] = x[3 * f.s->skin[t][a] + m] - (m == 2 ? raised : 0.0);
                d = element_distance(&f.solid, at[0], at[1], at[2]);
                /* The check's thousandth of a spacing, and what the mesh lies inside the ball: R (1 - cos) of
                 * half a facet's angle, twice. */
                if (d < f.s->def.radius - 1e-3 * STEP - 7e-4)
                    fail_msg("skin triangle %d is %.3g m from the ball at %.3f", t, d, s);
            }
        }
        morph_curve_destroy(c);
    }
    free(start);
    free(end);
    free(x);
    free(scratch);
    free(guide.x);
    fixture_free(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lift), cmocka_unit_test(test_projection),
                                       cmocka_unit_test(test_held_rows), cmocka_unit_test(test_rising_path)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
