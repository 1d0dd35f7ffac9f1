/* The FCL shim against a brute-force distance written here from the definition: the least over all edge pairs
 * and all vertices against faces, 0 where an edge passes through a face. */
#include "solvers/collision.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint64_t seed = 1;

static double uniform(void) { /* in (-1, 1) */
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) / 4503599627370496.0 - 1;
}

static double clamp01(double t) {
    return t < 0 ? 0 : t > 1 ? 1 : t;
}

static double point_segment(const double p[3], const double a[3], const double b[3]) {
    double d[3], r[3], x[3];
    morph_sub(b, a, d);
    morph_sub(p, a, r);
    const double dd = morph_dot(d, d), t = dd > 0 ? clamp01(morph_dot(d, r) / dd) : 0;
    for (int k = 0; k < 3; k++)
        x[k] = a[k] + t * d[k];
    return morph_dist(p, x);
}

/* Interior solution of the two lines if both parameters fall inside, else the least over the four ends. */
static double segment_segment(const double *a, const double *b, const double *c, const double *d) {
    double u[3], v[3], r[3];
    morph_sub(b, a, u);
    morph_sub(d, c, v);
    morph_sub(c, a, r);
    double best = fmin(fmin(point_segment(a, c, d), point_segment(b, c, d)),
                       fmin(point_segment(c, a, b), point_segment(d, a, b)));
    const double uu = morph_dot(u, u), vv = morph_dot(v, v), uv = morph_dot(u, v);
    const double det = uu * vv - uv * uv;
    if (det <= 1e-14 * uu * vv) return best;
    const double s = (morph_dot(u, r) * vv - morph_dot(v, r) * uv) / det;
    const double t = (morph_dot(u, r) * uv - morph_dot(v, r) * uu) / det;
    if (s <= 0 || s >= 1 || t <= 0 || t >= 1) return best;
    double p[3], q[3];
    for (int k = 0; k < 3; k++) {
        p[k] = a[k] + s * u[k];
        q[k] = c[k] + t * v[k];
    }
    return fmin(best, morph_dist(p, q));
}

/* Whether x, in the plane of t, lies inside it. */
static bool over_face(const double x[3], const double *t, const double n[3]) {
    for (int e = 0; e < 3; e++) {
        double edge[3], r[3], c[3];
        morph_sub(t + 3 * ((e + 1) % 3), t + 3 * e, edge);
        morph_sub(x, t + 3 * e, r);
        morph_cross(edge, r, c);
        if (morph_dot(c, n) < 0) return false;
    }
    return true;
}

static double face_distance(const double *a, const double *t, double best) {
    double u[3], v[3], n[3], height[3];
    morph_sub(t + 3, t, u);
    morph_sub(t + 6, t, v);
    morph_cross(u, v, n);
    const double length = morph_norm(n);
    if (length == 0) return best;
    for (int c = 0; c < 3; c++) {
        double r[3];
        morph_sub(a + 3 * c, t, r);
        height[c] = morph_dot(r, n) / length;
        if (fabs(height[c]) < best && over_face(a + 3 * c, t, n)) best = fabs(height[c]);
    }
    for (int c = 0; c < 3; c++) { /* an edge from one side to the other */
        const double *p = a + 3 * c, *q = a + 3 * ((c + 1) % 3);
        const double h = height[c], g = height[(c + 1) % 3];
        if ((h > 0) == (g > 0)) continue;
        double x[3];
        for (int k = 0; k < 3; k++)
            x[k] = p[k] + (q[k] - p[k]) * (h / (h - g));
        if (over_face(x, t, n)) return 0;
    }
    return best;
}

static double triangle_triangle(const double *a, const double *b) {
    double best = INFINITY;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            best = fmin(best,
                        segment_segment(a + 3 * i, a + 3 * ((i + 1) % 3), b + 3 * j, b + 3 * ((j + 1) % 3)));
    best = face_distance(a, b, best);
    return face_distance(b, a, best);
}

enum { SOUP = 60, LOOSE = 40 };

/* A soup of triangles of very different sizes, and queries of three kinds. */
static void random_case(double scale, double size, int kind, double *solid, double *loose) {
    for (int i = 0; i < SOUP; i++) {
        const double own = i % 3 == 0 ? size * 1e-3 : size;
        const double centre[3] = {uniform(), uniform(), uniform()};
        for (int c = 0; c < 9; c++)
            solid[9 * i + c] = scale * (centre[c % 3] + own * uniform());
    }
    for (int i = 0; i < LOOSE; i++) {
        double *q = loose + 9 * i;
        const double centre[3] = {1.5 * uniform(), 1.5 * uniform(), 1.5 * uniform()};
        for (int c = 0; c < 9; c++)
            q[c] = scale * (centre[c % 3] + 0.2 * uniform());
        if (kind == 1) memcpy(q + 6, q + 3, 3 * sizeof *q);
        if (kind == 2)
            for (int k = 0; k < 3; k++)
                q[6 + k] = 0.5 * (q[k] + q[3 + k]);
    }
}

static void compare_case(double scale, double size, int kind, double *worst) {
    double solid[9 * SOUP], loose[9 * LOOSE];
    int faces[3 * SOUP];
    random_case(scale, size, kind, solid, loose);
    for (int i = 0; i < 3 * SOUP; i++)
        faces[i] = i;
    morph_solid *s = NULL;
    assert_int_equal(morph_solid_create(solid, 3 * SOUP, faces, SOUP, &s), MORPH_OK);
    double least = INFINITY;
    int nearest = -1;
    for (int i = 0; i < LOOSE; i++) {
        double want = INFINITY, got = -1;
        int element = -1;
        double line[9];
        memcpy(line, loose + 9 * i, sizeof line);
        if (kind == 2) memcpy(line + 6, line + 3, 3 * sizeof *line); /* the exact form of the same link */
        for (int j = 0; j < SOUP; j++)
            want = fmin(want, triangle_triangle(line, solid + 9 * j));
        assert_int_equal(morph_solid_distance(s, loose + 9 * i, 1, &got, &element), MORPH_OK);
        assert_int_equal(element, 0);
        /* Both sides round relative to the coordinates, so distances below 1 % of the solid are held to an
         * absolute error of 1e-14 of it. */
        const double error = fabs(got - want) / fmax(want, 0.01 * scale);
        *worst = fmax(*worst, error);
        if (got < least) {
            least = got;
            nearest = i;
        }
    }
    double all = -1;
    int element = -1;
    assert_int_equal(morph_solid_distance(s, loose, LOOSE, &all, &element), MORPH_OK);
    assert_true(all == least);
    assert_int_equal(element, nearest);
    morph_solid_destroy(s);
}

static void separated_distance_is_exact(void **state) {
    (void)state;
    for (int kind = 0; kind < 3; kind++)
        for (int e = -6; e <= 6; e += 2)
            for (int k = 0; k < 8; k++) {
                double worst = 0;
                compare_case(pow(10, e), k % 2 ? 0.3 : 0.02, kind, &worst);
                if (worst > 1e-12) fail_msg("kind %d, scale 1e%d: relative error %.2e", kind, e, worst);
            }
}

/* A closed unit box about the origin. */
static const double box_v[24] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                 -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
static const int box_t[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                              1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};

static double box_distance(double scale, const double q[9]) {
    double v[24], t[9], d = -1;
    int element;
    for (int i = 0; i < 24; i++)
        v[i] = scale * box_v[i];
    for (int i = 0; i < 9; i++)
        t[i] = scale * q[i];
    morph_solid *s = NULL;
    assert_int_equal(morph_solid_create(v, 8, box_t, 12, &s), MORPH_OK);
    assert_int_equal(morph_solid_distance(s, t, 1, &d, &element), MORPH_OK);
    morph_solid_destroy(s);
    return d / scale;
}

static void touching_gives_zero(void **state) {
    (void)state;
    const double through[9] = {0.1, 0.2, 3, 0.1, 0.2, -3, 0.1, 0.2, -3};
    const double corner[9] = {1, 1, 1, 2, 2, 2, 3, 2, 2};
    const double flat[9] = {0, 0, 1, 0.5, 0, 1, 0, 0.5, 1};
    const double above[9] = {0, 0, 1.25, 0.5, 0, 1.25, 0, 0.5, 1.25};
    const double inside[9] = {0, 0, 0, 0.25, 0, 0, 0, 0.25, 0};
    for (int e = -6; e <= 6; e += 3) {
        const double scale = pow(10, e);
        assert_true(box_distance(scale, through) == 0);
        assert_true(box_distance(scale, corner) == 0);
        assert_true(box_distance(scale, flat) <= 1e-15);
        assert_true(fabs(box_distance(scale, above) - 0.25) < 1e-12);
        /* Inside without touching is not noticed: the distance to the surface. */
        assert_true(fabs(box_distance(scale, inside) - 0.75) < 1e-12);
    }
}

static void a_point_is_a_triangle(void **state) {
    (void)state;
    const double point[9] = {2, 3, 4, 2, 3, 4, 2, 3, 4};
    assert_true(fabs(box_distance(1, point) - sqrt(1 + 4 + 9)) < 1e-14);
    const double face[9] = {0, 0, 1.5, 0, 0, 1.5, 0, 0, 1.5};
    assert_true(fabs(box_distance(1, face) - 0.5) < 1e-15);
}

static void unusable_input_is_refused(void **state) {
    (void)state;
    morph_solid *s = NULL;
    double v[24];
    int t[36], element;
    memcpy(v, box_v, sizeof v);
    memcpy(t, box_t, sizeof t);
    v[7] = NAN;
    assert_int_equal(morph_solid_create(v, 8, t, 12, &s), MORPH_ERR_NONFINITE);
    assert_null(s);
    v[7] = INFINITY;
    assert_int_equal(morph_solid_create(v, 8, t, 12, &s), MORPH_ERR_NONFINITE);
    v[7] = box_v[7];
    t[5] = 8;
    assert_int_equal(morph_solid_create(v, 8, t, 12, &s), MORPH_ERR_INPUT);
    t[5] = -1;
    assert_int_equal(morph_solid_create(v, 8, t, 12, &s), MORPH_ERR_INPUT);
    assert_int_equal(morph_solid_create(v, 8, box_t, 0, &s), MORPH_ERR_INPUT);
    assert_int_equal(morph_solid_create(v, 8, box_t, 12, &s), MORPH_OK);
    double q[9] = {0}, d;
    assert_int_equal(morph_solid_distance(s, q, 0, &d, &element), MORPH_ERR_INPUT);
    q[4] = NAN;
    assert_int_equal(morph_solid_distance(s, q, 1, &d, &element), MORPH_ERR_NONFINITE);
    q[4] = 1e300; /* too large to square */
    q[0] = q[3] = q[6] = 1e300;
    assert_int_equal(morph_solid_distance(s, q, 1, &d, &element), MORPH_ERR_NONFINITE);
    morph_solid_destroy(s);
    morph_solid_destroy(NULL);
}

/* All corners in one place or on a line: no tree to speak of, and still an answer. */
static void degenerate_solids(void **state) {
    (void)state;
    const double v[9] = {1, 1, 1, 2, 1, 1, 3, 1, 1}, q[9] = {2.5, 2, 1, 2.5, 4, 1, 2.5, 4, 1};
    const int line[3] = {0, 1, 2}, point[6] = {0, 0, 0, 0, 0, 0};
    morph_solid *s = NULL;
    double d;
    int element;
    assert_int_equal(morph_solid_create(v, 3, line, 1, &s), MORPH_OK);
    assert_int_equal(morph_solid_distance(s, q, 1, &d, &element), MORPH_OK);
    assert_true(fabs(d - 1) < 1e-15);
    morph_solid_destroy(s);
    assert_int_equal(morph_solid_create(v, 1, point, 2, &s), MORPH_OK);
    assert_int_equal(morph_solid_distance(s, q, 1, &d, &element), MORPH_OK);
    assert_true(fabs(d - sqrt(1.5 * 1.5 + 1)) < 1e-14);
    morph_solid_destroy(s);
}

static void box_pairs_are_complete(void **state) {
    (void)state;
    enum { BOXES = 120 };
    double lo[3 * BOXES], hi[3 * BOXES];
    for (int i = 0; i < 3 * BOXES; i++) {
        lo[i] = floor(8 * uniform()); /* whole numbers: many boxes touch exactly */
        hi[i] = lo[i] + floor(2 + 2 * uniform());
    }
    int pairs[BOXES * BOXES][2], found = 0, want = 0;
    assert_int_equal(morph_box_pairs(lo, hi, BOXES, pairs, BOXES * BOXES, &found), MORPH_OK);
    for (int i = 0; i < BOXES; i++)
        for (int j = i + 1; j < BOXES; j++) {
            bool meet = true;
            for (int k = 0; k < 3; k++)
                meet = meet && lo[3 * i + k] <= hi[3 * j + k] && lo[3 * j + k] <= hi[3 * i + k];
            if (!meet) continue;
            assert_true(want < found);
            assert_int_equal(pairs[want][0], i);
            assert_int_equal(pairs[want][1], j);
            want++;
        }
    assert_int_equal(found, want);
    assert_true(want > 20);
    int few[3][2], again = 0;
    assert_int_equal(morph_box_pairs(lo, hi, BOXES, few, 3, &again), MORPH_OK);
    assert_int_equal(again, want);
    assert_memory_equal(few, pairs, sizeof few);
    lo[4] = NAN;
    assert_int_equal(morph_box_pairs(lo, hi, BOXES, few, 3, &again), MORPH_ERR_NONFINITE);
    assert_int_equal(morph_box_pairs(NULL, NULL, 0, NULL, 0, &again), MORPH_OK);
    assert_int_equal(again, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(separated_distance_is_exact), cmocka_unit_test(touching_gives_zero),
        cmocka_unit_test(a_point_is_a_triangle),       cmocka_unit_test(unusable_input_is_refused),
        cmocka_unit_test(degenerate_solids),           cmocka_unit_test(box_pairs_are_complete),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
