/* Shapes from lengths: domes and saddles found again, what is free or fits no shape said; rigid alignment. */
#include "model/align.h"
#include "model/kinematics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define SPACING 0.1
enum { MOST = 3 * 128, MOST_LINKS = 500 };

/* Farthest joint after the best rigid motion of a onto b; moved (may be NULL or a): a after it. */
static double shape_distance(int joints, const double *a, const double *b, double *moved) {
    const size_t bytes = 3 * (size_t)joints * sizeof(double);
    double *x = malloc(bytes), most;
    assert_non_null(x);
    memcpy(x, a, bytes);
    assert_int_equal(morph_align(joints, x, b, NULL, &most), MORPH_OK);
    if (moved) memcpy(moved, x, bytes);
    free(x);
    return most;
}

static morph_structure *make(int n, morph_layout layout, morph_joint_type joints, morph_bracing bracing) {
    morph_structure_def def = morph_structure_defaults(SPACING);
    def.nodes[0] = def.nodes[1] = n;
    def.layout = layout;
    def.joints = joints;
    def.bracing = bracing;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    assert_true(3 * s->joints <= MOST && s->links <= MOST_LINKS);
    return s;
}

typedef enum shape { DOME, SADDLE } shape;

/* The middle surface bent to a sphere of radius R (its polar coordinates kept) or to z = (x^2 - y^2) / (2 R),
 * both layers on its normals: posts keep their length. */
static void bend(const morph_structure *s, shape f, double R, double *x) {
    for (int j = 0; j < s->joints; j++) {
        const double *p = &s->start[3 * j], up = p[2] - 0.5 * s->def.thickness, r = hypot(p[0], p[1]);
        double c[3], n[3];
        if (f == DOME) {
            const double shrink = r > 0.0 ? R * sin(r / R) / r : 1.0;
            c[0] = shrink * p[0], c[1] = shrink * p[1], c[2] = R * (cos(r / R) - 1.0);
            n[0] = c[0] / R, n[1] = c[1] / R, n[2] = 1.0 + c[2] / R;
        } else {
            c[0] = p[0], c[1] = p[1], c[2] = (p[0] * p[0] - p[1] * p[1]) / (2.0 * R);
            n[0] = -p[0] / R, n[1] = p[1] / R, n[2] = 1.0;
        }
        for (int k = 0; k < 3; k++)
            x[3 * j + k] = c[k] + up * n[k] / morph_norm(n);
    }
}

static double radius_for(int n) {
    return 0.8 * SPACING * (n - 1);
}

/* Fully braced: the exact shape, from flat, by lengths alone; none of them near its start. */
static void test_recovered(void **state) {
    (void)state;
    for (int n = 4; n <= 8; n += 4)
        for (int f = DOME; f <= SADDLE; f++) {
            morph_structure *s = make(n, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_FULL);
            double meant[MOST], found[MOST], lengths[MOST_LINKS];
            morph_shape_report report;
            bend(s, (shape)f, radius_for(n), meant);
            morph_link_lengths(s, meant, lengths);
            assert_true(shape_distance(s->joints, s->start, meant, NULL) > 0.2 * SPACING);
            assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
            assert_true(report.fits);
            assert_true(report.length <= 1e-12 * SPACING && report.post <= 1e-12);
            assert_int_equal(report.mobility.free, 0);
            const double off = shape_distance(s->joints, found, meant, NULL) / SPACING;
            assert_true(off < 1e-9);
            print_message("%d x %d %s, full: %.1e spacings off, %d iterations\n", n, n,
                          f == DOME ? "dome" : "saddle", off, report.iterations);
            morph_structure_destroy(s);
        }
}

/* Ball joints without bracing: lengths are met, the shape is another one, and the report says why. */
static void test_left_free(void **state) {
    (void)state;
    for (int n = 4; n <= 8; n += 4)
        for (int f = DOME; f <= SADDLE; f++) {
            morph_structure *s = make(n, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE);
            double meant[MOST], found[MOST], lengths[MOST_LINKS];
            morph_shape_report report;
            bend(s, (shape)f, radius_for(n), meant);
            morph_link_lengths(s, meant, lengths);
            assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
            assert_true(report.fits);
            assert_int_equal(report.mobility.free, n == 4 ? 26 : 90);
            const double off = shape_distance(s->joints, found, meant, NULL) / SPACING;
            assert_true(off > 0.1);
            print_message("%d x %d %s, ball: %.2f spacings off, %d motions free\n", n, n,
                          f == DOME ? "dome" : "saddle", off, report.mobility.free);
            morph_structure_destroy(s);
        }
}

/* An offset layout has no posts; its stiffness is small, so the shape is met less closely than the lengths.
 */
static void test_offset(void **state) {
    (void)state;
    morph_structure *s = make(6, MORPH_LAYOUT_OFFSET, MORPH_JOINTS_BALL, MORPH_BRACING_NONE);
    double meant[MOST], found[MOST], lengths[MOST_LINKS];
    morph_shape_report report;
    bend(s, DOME, radius_for(6), meant);
    morph_link_lengths(s, meant, lengths);
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
    assert_true(report.fits && report.post == 0.0 && report.panel == 0.0);
    assert_int_equal(report.mobility.free, 0);
    assert_true(shape_distance(s->joints, found, meant, NULL) < 1e-4 * SPACING);
    morph_structure_destroy(s);
}

/* A dome's panels are plane (its normals meet in a point), a saddle's are not: universal joints find the one
 * and cannot make the other. */
static void test_panels(void **state) {
    (void)state;
    morph_structure *s = make(4, MORPH_LAYOUT_POSTS, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_FULL);
    double meant[MOST], found[MOST], lengths[MOST_LINKS];
    morph_shape_report report;
    bend(s, DOME, radius_for(4), meant);
    morph_link_lengths(s, meant, lengths);
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
    assert_true(report.fits && report.panel < 1e-12);
    assert_true(shape_distance(s->joints, found, meant, NULL) < 1e-9 * SPACING);
    bend(s, SADDLE, radius_for(4), meant);
    morph_link_lengths(s, meant, lengths);
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
    assert_false(report.fits);
    assert_true(report.panel > 1e-4 || report.length > 1e-4 * SPACING);
    morph_structure_destroy(s);
}

/* Lengths that no shape has: a compromise, and the residual. */
static void test_misfit(void **state) {
    (void)state;
    morph_structure *s = make(4, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_FULL);
    double found[MOST], lengths[MOST_LINKS];
    morph_shape_report report;
    morph_link_lengths(s, s->start, lengths);
    lengths[5] *= 1.1;
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
    assert_false(report.fits);
    assert_true(report.length > 1e-4 * SPACING && report.length < 0.1 * SPACING);
    double worst = 0.0, made[MOST_LINKS];
    morph_link_lengths(s, found, made);
    for (int l = 0; l < s->links; l++)
        worst = fmax(worst, fabs(made[l] - lengths[l]));
    assert_true(fabs(worst - report.length) < 1e-15);
    morph_structure_destroy(s);
}

/* Least motion: where the start has the lengths nothing moves; a small change moves joints little although 26
 * motions are free; and held joints stay to the bit. */
static void test_least_motion(void **state) {
    (void)state;
    morph_structure *s = make(4, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE);
    double start[MOST], found[MOST], lengths[MOST_LINKS];
    morph_shape_report report;
    bend(s, SADDLE, radius_for(4), start);
    morph_link_lengths(s, start, lengths);
    assert_int_equal(morph_shape_from_lengths(s, lengths, start, found, &report), MORPH_OK);
    for (int k = 0; k < 3 * s->joints; k++)
        assert_true(fabs(found[k] - start[k]) < 1e-14);
    lengths[7] *= 1.001;
    assert_int_equal(morph_shape_from_lengths(s, lengths, start, start, &report), MORPH_OK); /* in place */
    assert_true(report.fits);
    double moved = 0.0;
    for (int k = 0; k < 3 * s->joints; k++)
        moved = fmax(moved, fabs(found[k] - start[k]));
    assert_true(moved > 1e-5 * SPACING && moved < 2e-3 * SPACING);
    morph_structure_destroy(s);

    morph_structure_def def = morph_structure_defaults(SPACING);
    def.nodes[0] = def.nodes[1] = 4;
    def.fixed = MORPH_FIXED_CORNERS;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    morph_link_lengths(s, s->start, lengths);
    for (int l = 0; l < s->links; l++)
        lengths[l] *= 1.05; /* corners stay: the grid has to bulge */
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, found, &report), MORPH_OK);
    for (int k = 0; k < s->fixed_joints; k++)
        assert_memory_equal(&found[3 * s->fixed_joint[k]], &s->start[3 * s->fixed_joint[k]],
                            3 * sizeof(double));
    assert_int_equal(report.mobility.rigid, 0);
    morph_structure_destroy(s);
}

static void test_refused(void **state) {
    (void)state;
    morph_structure *s = make(3, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_WEB);
    double found[MOST] = {0.0}, lengths[MOST_LINKS], start[MOST];
    memcpy(start, s->start, 3 * (size_t)s->joints * sizeof(double));
    morph_link_lengths(s, start, lengths);
    lengths[2] = 0.0;
    assert_int_equal(morph_shape_from_lengths(s, lengths, start, found, NULL), MORPH_ERR_INPUT);
    lengths[2] = NAN;
    assert_int_equal(morph_shape_from_lengths(s, lengths, start, found, NULL), MORPH_ERR_NONFINITE);
    lengths[2] = SPACING;
    start[4] = INFINITY;
    assert_int_equal(morph_shape_from_lengths(s, lengths, start, found, NULL), MORPH_ERR_NONFINITE);
    memcpy(start, s->start, sizeof(double[6]));
    memcpy(&start[3], start, 3 * sizeof(double)); /* a link without length */
    assert_int_equal(morph_shape_from_lengths(s, lengths, start, found, NULL), MORPH_ERR_NONFINITE);
    for (int k = 0; k < 3 * s->joints; k++)
        assert_true(found[k] == 0.0);
    morph_structure_destroy(s);
}

/* Same input, same bits. */
static void test_repeats(void **state) {
    (void)state;
    morph_structure *s = make(4, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_WEB);
    double meant[MOST], a[MOST], b[MOST], lengths[MOST_LINKS];
    bend(s, SADDLE, radius_for(4), meant);
    morph_link_lengths(s, meant, lengths);
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, a, NULL), MORPH_OK);
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, b, NULL), MORPH_OK);
    assert_memory_equal(a, b, 3 * (size_t)s->joints * sizeof(double));
    morph_structure_destroy(s);
}

static void test_alignment(void **state) {
    (void)state;
    morph_structure *s = make(4, MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE);
    double x[MOST], y[MOST], z[MOST];
    bend(s, SADDLE, radius_for(4), x);
    for (int turn = 0; turn < 8; turn++) {
        /* About z, then about x; half turns among them. */
        const double a = M_PI * turn / 4.0, b = M_PI * (turn % 3) / 2.0;
        for (int j = 0; j < s->joints; j++) {
            const double *p = &x[3 * j];
            const double u = cos(a) * p[0] - sin(a) * p[1], v = sin(a) * p[0] + cos(a) * p[1];
            y[3 * j] = u + 2.0;
            y[3 * j + 1] = cos(b) * v - sin(b) * p[2] - 1.0;
            y[3 * j + 2] = sin(b) * v + cos(b) * p[2];
        }
        assert_true(shape_distance(s->joints, y, x, z) < 1e-14);
        for (int k = 0; k < 3 * s->joints; k++)
            assert_true(fabs(z[k] - x[k]) < 1e-14);
    }
    /* One joint off by a known amount, and a mirror image, which no turn makes. */
    memcpy(y, x, sizeof x);
    y[4] += 0.01;
    const double off = shape_distance(s->joints, y, x, y);
    assert_true(off > 0.008 && off < 0.01);
    bend(s, DOME, radius_for(4), x);
    for (int j = 0; j < s->joints; j++)
        for (int k = 0; k < 3; k++)
            y[3 * j + k] = k == 2 ? -x[3 * j + k] : x[3 * j + k];
    assert_true(shape_distance(s->joints, y, x, NULL) > 0.1 * SPACING);
    /* All in one place: no direction, no turn, no fault. */
    const double one[6] = {1, 1, 1, 1, 1, 1}, two[6] = {2, 2, 2, 2, 2, 2};
    assert_true(shape_distance(2, one, two, NULL) < 1e-15);
    morph_structure_destroy(s);
}

int main(void) {
    morph_blas_threads(1); /* sums repeat bit for bit */
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_recovered), cmocka_unit_test(test_left_free),
        cmocka_unit_test(test_offset),    cmocka_unit_test(test_panels),
        cmocka_unit_test(test_misfit),    cmocka_unit_test(test_least_motion),
        cmocka_unit_test(test_refused),   cmocka_unit_test(test_repeats),
        cmocka_unit_test(test_alignment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
