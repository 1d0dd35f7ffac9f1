/* Links of one length on a curve: held at every parameter with all derivatives, posts rigid, the rest smooth.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "planner/curve.h"

#include <stdlib.h>
#include <string.h>

enum { POSES = 12 };

static void assert_near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.17g is not %.17g within %g", a, b, tolerance);
}

/* Links of both layers: a pair over each other, two at one joint, two that follow each other, one alone. */
static const int stuck[] = {0, 12, 3, 1, 6, 21};
enum { STUCK = sizeof stuck / sizeof *stuck };

static morph_structure *make(bool offset, bool held) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    if (offset) def.layout = MORPH_LAYOUT_OFFSET;
    if (held) {
        def.stuck_links = STUCK;
        def.stuck_link = stuck;
    }
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

/* Poses that wander by a tenth of a spacing: the held lengths are off by up to that. */
static morph_curve *draw(const morph_structure *st) {
    const size_t width = 3 * (size_t)st->joints;
    double s[POSES], *x = calloc(POSES * width, sizeof *x);
    assert_non_null(x);
    for (int k = 0; k < POSES; k++) {
        s[k] = k / (POSES - 1.0);
        for (int j = 0; j < st->joints; j++) {
            const int p = st->posts > 0 ? j % st->posts : j;
            const double move[3] = {0.01 * sin(2.0 * s[k] + 1.3 * p), 0.01 * s[k] * cos(p),
                                    0.01 * cos(4.0 * s[k] + p)};
            for (int c = 0; c < 3; c++)
                x[(size_t)k * width + 3 * (size_t)j + (size_t)c] = st->start[3 * j + c] + move[c];
            /* posts lean */
            if (st->posts > 0 && j >= st->posts) {
                const double lean = 0.3 * sin(3.0 * s[k] + p);
                x[(size_t)k * width + 3 * (size_t)j] += 0.05 * sin(lean);
                x[(size_t)k * width + 3 * (size_t)j + 2] += 0.05 * (cos(lean) - 1.0);
            }
        }
    }
    morph_curve *c;
    assert_int_equal(morph_curve_create(st, s, x, POSES, &c), MORPH_OK);
    free(x);
    return c;
}

static double *room(size_t n) {
    double *x = calloc(n, sizeof *x);
    assert_non_null(x);
    return x;
}

static void check_held(bool offset) {
    morph_structure *st = make(offset, true), *loose = make(offset, false);
    morph_curve *c = draw(st), *free_curve = draw(loose);
    const size_t width = 3 * (size_t)st->joints, links = (size_t)st->links;
    double *scratch = room(MORPH_JET * (size_t)morph_pose_width(st));
    double *x = room(3 * MORPH_JET * width), *l = room(MORPH_JET * links), astray = 0.0;
    for (int k = 0; k <= 200; k++) {
        morph_curve_joints(c, k / 200.0, 5, scratch, x);
        morph_curve_lengths(st, x, 5, l);
        for (int i = 0; i < STUCK; i++) {
            assert_near(l[stuck[i]], st->start_length[stuck[i]], 1e-15);
            for (size_t d = 1; d < MORPH_JET; d++) /* the curve's own grow by about ten with each */
                assert_near(l[d * links + (size_t)stuck[i]], 0.0, 1e-13 * pow(20.0, (double)d));
        }
        for (int p = 0; p < st->posts; p++)
            assert_near(morph_dist(&x[3 * st->post[p][0]], &x[3 * st->post[p][1]]), st->post_length[p],
                        1e-15);
        morph_curve_joints(free_curve, k / 200.0, 0, scratch, x);
        morph_link_lengths(loose, x, l);
        for (int i = 0; i < STUCK; i++)
            astray = fmax(astray, fabs(l[stuck[i]] - st->start_length[stuck[i]]));
    }
    assert_true(astray > 1e-3); /* without it they are not held */
    free(scratch);
    free(x);
    free(l);
    morph_curve_destroy(c);
    morph_curve_destroy(free_curve);
    morph_structure_destroy(st);
    morph_structure_destroy(loose);
}

static void test_posts(void **state) {
    (void)state;
    check_held(false);
}

static void test_offset(void **state) {
    (void)state;
    check_held(true);
}

/* Each derivative of all joints against central differences of the one before, away from knots. */
static void check_derivatives(morph_structure *st, morph_curve *c) {
    const size_t width = 3 * (size_t)st->joints;
    double *scratch = room(MORPH_JET * (size_t)morph_pose_width(st)), *x = room(3 * MORPH_JET * width);
    const double h = 1e-5;
    int tested = 0;
    for (int k = 1; k < 40; k++) {
        const double s = k / 40.0 + 1e-3;
        bool knot = false;
        for (int i = 0; i < c->spline.basis.count + 6; i++)
            knot = knot || fabs(c->spline.basis.knot[i] - s) < 2.0 * h;
        if (knot) continue;
        tested++;
        for (int side = 0; side < 3; side++)
            morph_curve_joints(c, s + (side - 1) * h, 5, scratch, x + (size_t)side * MORPH_JET * width);
        for (size_t d = 1; d < MORPH_JET; d++) {
            const double *left = x + (d - 1) * width, *right = left + 2 * MORPH_JET * width;
            for (size_t i = 0; i < width; i++)
                assert_near(x[(MORPH_JET + d) * width + i], (right[i] - left[i]) / (2.0 * h),
                            1e-8 * pow(20.0, (double)d));
        }
    }
    assert_true(tested > 30);
    free(scratch);
    free(x);
    morph_curve_destroy(c);
    morph_structure_destroy(st);
}

static void test_derivatives(void **state) {
    (void)state;
    morph_structure *st = make(false, true);
    check_derivatives(st, draw(st));
}

/* Posts that lean by up to 0.05, each its own way: panels out of plane by as much. With held = true also the
 * links above, of one length. */
static morph_curve *draw_panels(bool plane, bool held, const int (*fixed)[2], morph_structure **out) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    if (plane) def.joints = MORPH_JOINTS_UNIVERSAL;
    if (held) {
        def.stuck_links = 2;
        def.stuck_link = stuck;
    }
    if (fixed) {
        def.fixed = MORPH_FIXED_LIST;
        def.fixed_nodes = 1;
        def.fixed_node = fixed;
    }
    assert_int_equal(morph_structure_create(&def, out), MORPH_OK);
    const morph_structure *st = *out;
    const size_t width = 3 * (size_t)st->joints;
    double s[POSES], *x = room(POSES * width);
    for (int k = 0; k < POSES; k++) {
        s[k] = k / (POSES - 1.0);
        for (int p = 0; p < st->posts; p++) {
            const double lean[3] = {0.05 * s[k] * sin(2.0 * p + s[k]), 0.05 * s[k] * cos(3.0 * p - s[k]),
                                    1.0};
            for (size_t c = 0; c < 3; c++) {
                const double foot = st->start[3 * p + (int)c] + 0.004 * s[k] * sin(p + 2.0 * (double)c);
                x[(size_t)k * width + 3 * (size_t)p + c] = foot;
                x[(size_t)k * width + 3 * (size_t)(st->posts + p) + c] =
                    foot + 0.05 * lean[c] / morph_norm(lean);
            }
        }
    }
    morph_curve *c;
    assert_int_equal(morph_curve_create(st, s, x, POSES, &c), MORPH_OK);
    free(x);
    return c;
}

/* As the check has it: unit vectors along the posts and from foot to foot. */
static double sine(const morph_structure *st, int q, const double *x) {
    const int *a = st->post[st->panel[q][0]], *b = st->post[st->panel[q][1]];
    double u[3], v[3], d[3], c[3];
    morph_sub(&x[3 * a[1]], &x[3 * a[0]], u);
    morph_sub(&x[3 * b[1]], &x[3 * b[0]], v);
    morph_sub(&x[3 * b[0]], &x[3 * a[0]], d);
    morph_cross(u, v, c);
    return morph_dot(c, d) / (morph_norm(u) * morph_norm(v) * morph_norm(d));
}

static void check_panels(bool held, const int (*fixed)[2]) {
    morph_structure *st, *loose;
    morph_curve *c = draw_panels(true, held, fixed, &st), *other = draw_panels(false, false, NULL, &loose);
    const size_t width = 3 * (size_t)st->joints;
    double *scratch = room((size_t)morph_pose_width(st)), *x = room(width), *y = room(width), astray = 0.0,
           moved = 0.0;
    for (int k = 0; k <= 150; k++) {
        morph_curve_joints(c, k / 150.0, 0, scratch, x);
        morph_curve_joints(other, k / 150.0, 0, scratch, y);
        for (int q = 0; q < st->panels; q++) {
            assert_near(sine(st, q, x), 0.0, 1e-14);
            astray = fmax(astray, fabs(sine(st, q, y)));
        }
        for (int p = 0; p < st->posts; p++)
            assert_near(morph_dist(&x[3 * st->post[p][0]], &x[3 * st->post[p][1]]), st->post_length[p],
                        1e-15);
        for (int i = 0; held && i < 2; i++)
            assert_near(morph_dist(&x[3 * st->link[stuck[i]][0]], &x[3 * st->link[stuck[i]][1]]), 0.1, 1e-14);
        for (size_t i = 0; i < width; i++) {
            moved = fmax(moved, fabs(x[i] - y[i]));
            if (st->joint_fixed[i / 3]) assert_near(x[i], y[i], 0.0);
        }
    }
    assert_true(astray > 1e-2); /* without it they are not plane */
    assert_true(moved < 0.01);  /* about what the posts lean, not more */
    free(scratch);
    free(x);
    free(y);
    morph_curve_destroy(c);
    morph_curve_destroy(other);
    morph_structure_destroy(st);
    morph_structure_destroy(loose);
}

static void test_panels(void **state) {
    (void)state;
    const int node[1][2] = {{1, 0}};
    check_panels(false, NULL);
    check_panels(true, NULL);
    check_panels(false, node);
    morph_structure *st;
    morph_curve *c = draw_panels(true, true, NULL, &st);
    check_derivatives(st, c);
}

/* A post that is held stays where it is; its neighbour makes the whole move. */
static void test_fixed(void **state) {
    (void)state;
    const int node[1][2] = {{0, 0}};
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    def.stuck_links = 1;
    def.stuck_link = stuck;
    def.fixed = MORPH_FIXED_LIST;
    def.fixed_nodes = 1;
    def.fixed_node = node;
    morph_structure *st, *loose = make(false, false);
    assert_int_equal(morph_structure_create(&def, &st), MORPH_OK);
    morph_curve *c = draw(st), *other = draw(loose);
    const size_t width = 3 * (size_t)st->joints;
    double *scratch = room((size_t)morph_pose_width(st)), *x = room(width), *y = room(width);
    for (int k = 0; k <= 20; k++) {
        morph_curve_joints(c, k / 20.0, 0, scratch, x);
        morph_curve_joints(other, k / 20.0, 0, scratch, y);
        for (int i = 0; i < 3; i++) {
            assert_near(x[i], y[i], 0.0);
            assert_near(x[27 + i], y[27 + i], 0.0);
        }
        assert_near(morph_dist(&x[0], &x[3]), 0.1, 1e-15);
    }
    free(scratch);
    free(x);
    free(y);
    morph_curve_destroy(c);
    morph_curve_destroy(other);
    morph_structure_destroy(st);
    morph_structure_destroy(loose);
}

/* More than it may hold, or none: nothing is held; a pose that cannot be put right stays as it is. */
static void test_refusals(void **state) {
    (void)state;
    morph_hold *h;
    morph_structure *st = make(false, false);
    assert_int_equal(morph_hold_create(st, &h), MORPH_OK);
    assert_null(h);
    morph_hold_apply(NULL, 3, NULL);
    morph_hold_destroy(NULL);
    morph_structure_destroy(st);

    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 6;
    def.length[0][0] = def.length[0][1] = def.length[1][0] = def.length[1][1] = 0.1;
    assert_int_equal(morph_structure_create(&def, &st), MORPH_OK);
    assert_true(st->links > MORPH_HOLD_MOST);
    assert_int_equal(morph_hold_create(st, &h), MORPH_OK);
    assert_null(h);
    morph_structure_destroy(st);

    st = make(true, true);
    assert_int_equal(morph_hold_create(st, &h), MORPH_OK);
    assert_non_null(h);
    double *pose = room(3 * (size_t)st->joints), *before = room(3 * (size_t)st->joints);
    memcpy(before, st->start, 3 * (size_t)st->joints * sizeof *before);
    before[3 * st->link[0][1]] = NAN;
    memcpy(pose, before, 3 * (size_t)st->joints * sizeof *before);
    morph_hold_apply(h, 0, pose);
    assert_memory_equal(pose, before, 3 * (size_t)st->joints * sizeof *before);
    free(pose);
    free(before);
    morph_hold_destroy(h);
    morph_structure_destroy(st);
}

/* Numbers beyond the links, and a list that is not there. */
static void test_structure(void **state) {
    (void)state;
    const int bad[] = {0, 24};
    morph_structure_def def = morph_structure_defaults(0.1);
    morph_structure *s;
    def.nodes[0] = def.nodes[1] = 3;
    def.stuck_links = 2;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_ERR_INPUT);
    def.stuck_link = bad;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_ERR_INPUT);
    assert_null(s);
    def.stuck_links = 1;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    assert_true(s->length_limit[0][0] == s->start_length[0] && s->length_limit[0][1] == s->start_length[0]);
    assert_true(s->length_limit[1][0] < s->length_limit[1][1]);
    morph_structure_destroy(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_posts),       cmocka_unit_test(test_offset),
                                       cmocka_unit_test(test_derivatives), cmocka_unit_test(test_fixed),
                                       cmocka_unit_test(test_panels),      cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_structure)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
