/* Cavity, gap, target gap and coverage of sheets and solids whose measures are known. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "model/cavity.h"

#define assert_near(a, b, eps) near_or_fail((a), (b), (eps), __LINE__)
static void near_or_fail(double a, double b, double eps, int line) {
    if (fabs(a - b) <= eps) return;
    print_error("line %d: %.17g is not %.17g to %g\n", line, a, b, eps);
    fail();
}

/* A square sheet of n x n joints: only what the cavity reads of a structure. */
enum { MOST = 41 };
typedef struct sheet {
    morph_structure s;
    double start[3 * MOST * MOST], x[3 * MOST * MOST];
    int skin[2 * MOST * MOST][3];
} sheet;

static sheet *sheet_make(int n, double spacing, double radius) {
    sheet *h = calloc(1, sizeof *h);
    assert_non_null(h);
    h->s.nx = h->s.ny = n;
    h->s.joints = n * n;
    h->s.spacing = h->s.def.spacing = spacing;
    h->s.def.radius = radius;
    h->s.skin = h->skin;
    h->s.start = h->start;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double *p = h->start + 3 * (j * n + i);
            p[0] = (i - (n - 1) / 2.0) * spacing;
            p[1] = (j - (n - 1) / 2.0) * spacing;
            if (i + 1 == n || j + 1 == n) continue;
            const int a = j * n + i, b = a + 1, c = a + n + 1, d = a + n;
            memcpy(h->skin[h->s.skin_triangles++], (int[3]){a, b, c}, sizeof h->skin[0]);
            memcpy(h->skin[h->s.skin_triangles++], (int[3]){a, c, d}, sizeof h->skin[0]);
        }
    memcpy(h->x, h->start, sizeof h->x);
    return h;
}
static void sheet_raise(sheet *h, double z) {
    for (int i = 0; i < h->s.joints; i++)
        h->x[3 * i + 2] = z;
}

static morph_distance *box(const double lo[3], const double hi[3]) {
    static const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    double v[24];
    int t[36];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            v[3 * i + k] = i >> k & 1 ? hi[k] : lo[k];
    memcpy(t, faces, sizeof t);
    const morph_mesh mesh = {8, 12, v, t};
    morph_distance *d;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    return d;
}

static morph_cavity *cavity_of(const sheet *h, const morph_distance *target, double base) {
    morph_cavity *c;
    assert_int_equal(morph_cavity_create(&h->s, target, base, &c), MORPH_OK);
    return c;
}
static morph_measure measure(const morph_cavity *c, const sheet *h) {
    morph_measure m;
    assert_int_equal(morph_cavity_measure(c, h->x, &m), MORPH_OK);
    return m;
}

static void test_samples(void **state) {
    (void)state;
    sheet *h = sheet_make(5, 0.1, 0);
    morph_distance *d = box((double[3]){-0.1, -0.1, 0}, (double[3]){0.1, 0.1, 0.1});
    morph_cavity *c = cavity_of(h, d, 0);
    assert_near(c->start_area, 0.16, 1e-15);
    assert_true(c->samples >= 6 * h->s.skin_triangles);
    double area = 0, first[2] = {0}, second = 0;
    for (int q = 0; q < c->samples; q++) {
        double p[3] = {0}, sum = 0;
        for (int j = 0; j < 3; j++) {
            sum += c->sample[q].weight[j];
            for (int k = 0; k < 3; k++)
                p[k] += c->sample[q].weight[j] * h->x[3 * c->sample[q].joint[j] + k];
        }
        assert_near(sum, 1, 1e-15);
        area += c->sample[q].area;
        for (int k = 0; k < 2; k++)
            first[k] += c->sample[q].area * p[k];
        second += c->sample[q].area * p[0] * p[0];
    }
    /* Area and moments of the square: the last to the pattern's accuracy. */
    assert_near(area, 0.16, 1e-15);
    assert_near(first[0], 0, 1e-16);
    assert_near(first[1], 0, 1e-16);
    assert_near(second, 0.16 * 0.16 / 12, 0.02 * 0.16 * 0.16 / 12);
    /* Exposed: the top face, all of it, normals up. */
    double exposed = 0;
    for (int i = 0; i < c->exposed; i++) {
        exposed += c->expose[i].area;
        assert_near(c->expose[i].point[2], 0.1, 1e-15);
        assert_near(c->expose[i].normal[2], 1, 1e-15);
    }
    assert_near(exposed, 0.04, 1e-15);
    assert_true(c->exposed >= 256);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

/* A flat sheet at height z over a box that stands on the base. */
static void test_hovering_sheet(void **state) {
    (void)state;
    sheet *h = sheet_make(5, 0.1, 0.01);
    morph_distance *d = box((double[3]){-0.1, -0.1, 0}, (double[3]){0.1, 0.1, 0.1});
    morph_cavity *c = cavity_of(h, d, 0);
    sheet_raise(h, 0.25);
    morph_measure m = measure(c, h);
    /* Columns and box edges fall together at a sixteenth of the spacing: exact. */
    assert_near(m.volume, 0.16 * 0.25 - 0.04 * 0.1, 1e-12);
    assert_near(m.gap_target, 0.15 - 0.01, 1e-12);
    assert_true(m.coverage == 0);
    assert_true(m.gap_max <= 0.24 + 1e-12 && m.gap_max > 0.15);
    assert_true(m.gap_mean > 0.14 && m.gap_mean < m.gap_p95 && m.gap_p95 <= m.gap_max);
    /* Three box heights up from the base, the plane counts too: base at 0.2 makes the gap 0.04 at most. */
    morph_cavity_destroy(c);
    c = cavity_of(h, d, 0.2);
    m = measure(c, h);
    assert_near(m.volume, 0.16 * 0.05, 1e-12);
    assert_near(m.gap_mean, 0.04, 1e-12);
    assert_int_equal(c->exposed, 0);
    assert_true(m.coverage == 1 && m.gap_target == 0);
    morph_cavity_destroy(c);
    /* Just on top: covered, no gap over the box. */
    c = cavity_of(h, d, 0);
    sheet_raise(h, 0.11);
    m = measure(c, h);
    assert_near(m.gap_target, 0, 1e-12);
    assert_true(m.coverage == 1);
    sheet_raise(h, 0.11 + 0.025 + 1e-9);
    assert_true(measure(c, h).coverage == 0);
    sheet_raise(h, 0.11 + 0.025 - 1e-9);
    assert_true(measure(c, h).coverage == 1);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

/* Lying on the plane beside the target: gap and cavity say nothing, target gap and coverage do. */
static void test_sheet_beside_target(void **state) {
    (void)state;
    sheet *h = sheet_make(5, 0.1, 0.004);
    morph_distance *d = box((double[3]){0.6, -0.1, 0}, (double[3]){0.8, 0.1, 0.1});
    morph_cavity *c = cavity_of(h, d, 0);
    sheet_raise(h, 0.004);
    const morph_measure m = measure(c, h);
    assert_near(m.gap_max, 0, 1e-15);
    assert_near(m.volume, 0.16 * 0.004, 1e-15);
    assert_true(m.gap_target > 0.4);
    assert_true(m.coverage == 0);
    assert_true(m.objective > 0.04 * 0.4 * 0.4);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

/* z = H (1 - (x/a)^2)(1 - (y/a)^2) over [-a,a]^2: volume H (4a/3)^2. The sheet is piecewise linear, its own
 * volume is exact by prisms: the columns must converge to it. */
static double prism_volume(const sheet *h) {
    double sum = 0;
    for (int i = 0; i < h->s.skin_triangles; i++) {
        const double *a = h->x + 3 * h->skin[i][0], *b = h->x + 3 * h->skin[i][1],
                     *c = h->x + 3 * h->skin[i][2];
        sum += ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2 * (a[2] + b[2] + c[2]) / 3;
    }
    return sum;
}
static void test_dome_converges(void **state) {
    (void)state;
    sheet *h = sheet_make(9, 0.1, 0);
    const double a = 0.4, tall = 0.3;
    for (int i = 0; i < h->s.joints; i++) {
        double *p = h->x + 3 * i;
        p[2] = tall * (1 - p[0] * p[0] / (a * a)) * (1 - p[1] * p[1] / (a * a));
    }
    morph_distance *d = box((double[3]){-0.05, -0.05, 0}, (double[3]){0.05, 0.05, 0.1});
    for (int fan = 0; fan < 2; fan++) {
        /* With the border on the plane, skirt and fan enclose the same; turned by 0.3 the columns do not line
         * up with the joints. */
        morph_cavity *c = cavity_of(h, d, fan ? NAN : 0);
        sheet *turned = sheet_make(9, 0.1, 0);
        for (int i = 0; i < h->s.joints; i++) {
            const double *p = h->x + 3 * i;
            double *q = turned->x + 3 * i;
            q[0] = cos(0.3) * p[0] - sin(0.3) * p[1];
            q[1] = sin(0.3) * p[0] + cos(0.3) * p[1];
            q[2] = p[2];
        }
        const double want = prism_volume(turned) - 0.001;
        double error[4];
        for (int i = 0; i < 4; i++) {
            double volume;
            assert_int_equal(morph_cavity_volume(c, turned->x, 0.1 / (2 << 2 * i), &volume), MORPH_OK);
            error[i] = fabs(volume / want - 1);
        }
        print_message("dome, columns 1/2, 1/8, 1/32, 1/128 of the spacing: %.1e %.1e %.1e %.1e\n", error[0],
                      error[1], error[2], error[3]);
        assert_true(error[2] < 1e-3 && error[3] < 1e-4);
        assert_true(error[3] < error[0] / 20);
        assert_near(want, tall * (4 * a / 3) * (4 * a / 3) - 0.001, 0.04 * want);
        morph_cavity_destroy(c);
        free(turned);
    }
    morph_distance_destroy(d);
    free(h);
}

/* Turned inside out the winding is negative: no cavity. Folded double: the part under two layers counts once.
 */
static void test_folded_skins(void **state) {
    (void)state;
    sheet *h = sheet_make(5, 0.1, 0);
    morph_distance *d = box((double[3]){-0.05, -0.05, -1}, (double[3]){0.05, 0.05, -0.9});
    morph_cavity *c = cavity_of(h, d, 0);
    sheet_raise(h, 0.2);
    for (int i = 0; i < h->s.joints; i++)
        h->x[3 * i] = -h->start[3 * i];
    assert_true(measure(c, h).volume == 0);
    /* An S in x: 4 cells: forward 2, back 1 above, forward 1 above that. Winding under all three is 1. */
    const double x[5] = {0, 0.1, 0.2, 0.1, 0.2}, z[5] = {0.2, 0.2, 0.2, 0.3, 0.4};
    for (int i = 0; i < h->s.joints; i++) {
        h->x[3 * i] = x[i % 5];
        h->x[3 * i + 2] = z[i % 5];
    }
    /* Over [0, 0.1]: 0.2. Over [0.1, 0.2]: below the first layer 0.2; between first and second the winding is
     * 1 - 1 = 0; between second and third 1: heights 0.3 + s .. 0.4 and so on, triangle areas. */
    const double second = 0.25, third = 0.35; /* mean heights over [0.1, 0.2] */
    assert_near(measure(c, h).volume, 0.4 * (0.1 * 0.2 + 0.1 * (0.2 + third - second)), 1e-12);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

/* A hole in the target's middle (open mesh) and a target that reaches through the skin. */
static void test_target_through_skin(void **state) {
    (void)state;
    sheet *h = sheet_make(5, 0.1, 0);
    morph_distance *d = box((double[3]){-0.1, -0.1, -0.1}, (double[3]){0.1, 0.1, 0.3});
    for (int open = 0; open < 2; open++) {
        morph_distance *target = d;
        morph_mesh mesh = *morph_distance_mesh(d);
        if (open) assert_int_equal(morph_distance_create(&mesh, false, &target), MORPH_OK);
        morph_cavity *c = cavity_of(h, target, 0);
        sheet_raise(h, 0.2);
        assert_near(measure(c, h).volume, 0.12 * 0.2, 1e-12);
        morph_cavity_destroy(c);
        if (open) morph_distance_destroy(target);
    }
    morph_distance_destroy(d);
    free(h);
}

static void test_closest_points(void **state) {
    (void)state;
    sheet *h = sheet_make(9, 0.1, 0.004);
    morph_distance *d = box((double[3]){-0.15, -0.15, 0}, (double[3]){0.15, 0.15, 0.1});
    morph_cavity *c = cavity_of(h, d, 0);
    for (int i = 0; i < h->s.joints; i++)
        h->x[3 * i + 2] = 0.2 + 0.05 * sin(7.0 * i);
    int(*joint)[3] = calloc((size_t)c->exposed, sizeof *joint);
    double(*weight)[3] = calloc((size_t)c->exposed, sizeof *weight);
    double *distance = calloc((size_t)c->exposed, sizeof *distance);
    assert_true(joint && weight && distance);
    assert_int_equal(morph_cavity_closest(c, h->x, joint, weight, distance), MORPH_OK);
    double sum = 0, squares = 0, area = 0;
    for (int i = 0; i < c->exposed; i++) {
        double p[3] = {0}, best = INFINITY, w[3];
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                p[k] += weight[i][j] * h->x[3 * joint[i][j] + k];
        assert_near(morph_dist(p, c->expose[i].point), distance[i], 1e-14);
        for (int t = 0; t < h->s.skin_triangles; t++)
            best = fmin(best, morph_point_triangle(c->expose[i].point, h->x + 3 * h->skin[t][0],
                                                   h->x + 3 * h->skin[t][1], h->x + 3 * h->skin[t][2], w));
        assert_near(distance[i], best, 1e-14);
        sum += c->expose[i].area * (best - 0.004);
        squares += MORPH_COVER_WEIGHT * c->expose[i].area * (best - 0.004) * (best - 0.004);
        area += c->expose[i].area;
    }
    assert_int_equal(morph_cavity_closest(c, h->x, NULL, NULL, NULL), MORPH_OK);
    /* The objective is the sum of both terms, recomputed from the points. */
    const morph_measure m = measure(c, h);
    assert_near(m.gap_target, sum / area, 1e-14);
    for (int q = 0; q < c->samples; q++) {
        double p[3] = {0};
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                p[k] += c->sample[q].weight[j] * h->x[3 * c->sample[q].joint[j] + k];
        morph_closest e;
        morph_distance_point(d, p, &e);
        const double gap = fmax(0, fmin(e.distance, p[2]) - 0.004);
        squares += c->sample[q].area * gap * gap;
    }
    assert_near(m.objective, squares, 1e-14);
    free(joint);
    free(weight);
    free(distance);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

static void test_limits_and_refusals(void **state) {
    (void)state;
    sheet *h = sheet_make(3, 0.01, 0);
    morph_distance *d = box((double[3]){-5, -5, 0}, (double[3]){5, 5, 0.1});
    morph_cavity *c = cavity_of(h, d, 0);
    assert_true(c->exposed > 15000 && c->exposed < 21000);
    morph_measure m;
    h->x[5] = NAN;
    assert_int_equal(morph_cavity_measure(c, h->x, &m), MORPH_ERR_NONFINITE);
    h->x[5] = 0;
    double volume;
    assert_int_equal(morph_cavity_volume(c, h->x, 0, &volume), MORPH_ERR_INPUT);
    assert_int_equal(morph_cavity_volume(c, h->x, 1e-12, &volume), MORPH_OK);
    morph_cavity_destroy(c);
    assert_int_equal(morph_cavity_create(&h->s, d, INFINITY, &c), MORPH_ERR_INPUT);
    assert_null(c);
    h->s.skin_triangles = 0;
    assert_int_equal(morph_cavity_create(&h->s, d, 0, &c), MORPH_ERR_INPUT);
    morph_cavity_destroy(NULL);
    morph_distance_destroy(d);
    free(h);
}

static void test_speed(void **state) {
    (void)state;
    sheet *h = sheet_make(8, 0.1, 0.004);
    morph_distance *d = box((double[3]){-0.2, -0.2, 0}, (double[3]){0.2, 0.2, 0.1});
    morph_cavity *c = cavity_of(h, d, 0);
    sheet_raise(h, 0.15);
    const clock_t began = clock();
    for (int i = 0; i < 10; i++)
        measure(c, h);
    print_message("8 x 8: %d samples, %d exposed points, %.1f ms per measure\n", c->samples, c->exposed,
                  (double)(clock() - began) / CLOCKS_PER_SEC * 100);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_samples),
        cmocka_unit_test(test_hovering_sheet),
        cmocka_unit_test(test_sheet_beside_target),
        cmocka_unit_test(test_dome_converges),
        cmocka_unit_test(test_folded_skins),
        cmocka_unit_test(test_target_through_skin),
        cmocka_unit_test(test_closest_points),
        cmocka_unit_test(test_limits_and_refusals),
        cmocka_unit_test(test_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
