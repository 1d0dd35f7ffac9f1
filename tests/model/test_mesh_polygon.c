/* Ear clipping: every triangle positive, areas add up, no side runs through a corner. */
#include "model/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#define assert_near(a, b, margin) assert_true(fabs((a) - (b)) <= (margin))

/* Puts a plane polygon into a tilted plane of space. */
static void tilt(const double (*p)[2], int n, double *v) {
    const double a[3] = {0.36, 0.48, 0.8}, b[3] = {-0.8, 0.6, 0};
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            v[3 * i + k] = 5 + p[i][0] * a[k] + p[i][1] * b[k];
}

static double area2(const double (*p)[2], int a, int b, int c) {
    return (p[b][0] - p[a][0]) * (p[c][1] - p[a][1]) - (p[b][1] - p[a][1]) * (p[c][0] - p[a][0]);
}

/* Triangulates; checks the tiling; returns the least doubled area of a triangle. */
static double tiled(const double (*p)[2], int n) {
    double *v = malloc(3 * (size_t)n * sizeof *v), total = 0, sum = 0, least = INFINITY;
    int *polygon = malloc((size_t)n * sizeof *polygon), *out = malloc(3 * (size_t)n * sizeof *out);
    assert_non_null(v);
    assert_non_null(polygon);
    assert_non_null(out);
    tilt(p, n, v);
    for (int i = 0; i < n; i++) {
        polygon[i] = i;
        total += p[i][0] * p[(i + 1) % n][1] - p[(i + 1) % n][0] * p[i][1];
    }
    assert_true(morph_triangulate(v, polygon, n, out));
    for (int i = 0; i < n - 2; i++) {
        const double a = area2(p, out[3 * i], out[3 * i + 1], out[3 * i + 2]);
        least = fmin(least, total > 0 ? a : -a);
        sum += a;
    }
    assert_near(sum, total, 1e-9 * fabs(total));
    assert_true(least > -1e-12 * fabs(total));
    free(v);
    free(polygon);
    free(out);
    return least;
}

static void convex_and_concave(void **state) {
    (void)state;
    const double square[][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const double arrow[][2] = {{0, 0}, {2, -1}, {0, 3}, {-2, -1}};
    const double ell[][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    const double comb[][2] = {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1}, {5, 3}, {4, 3},
                              {4, 1}, {3, 1}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
    assert_true(tiled(square, 4) > 0.9);
    assert_true(tiled(arrow, 4) > 0.1);
    assert_true(tiled(ell, 6) > 0.1);
    assert_true(tiled(comb, 16) > 0.1);
}

static void corners_on_a_side(void **state) {
    (void)state;
    /* Midpoints on all sides, as where a finer neighbour meets: no triangle may be without area. */
    const double square[][2] = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
    const double triangle[][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 3}};
    const double window[][2] = {{0, 0}, {4, 0}, {4, 1}, {4, 2}, {4, 4},
                                {2, 4}, {2, 2}, {2, 1}, {1, 1}, {0, 1}};
    assert_true(tiled(square, 8) > 0.1);
    assert_true(tiled(triangle, 5) > 0.1);
    assert_true(tiled(window, 10) > 0.1);
    /* The same in single precision: corners a little off the side. */
    const double off[][2] = {{0, 0}, {1, -5e-8},     {2, 0}, {2.00000005, 1},
                             {2, 2}, {1, 2.0000001}, {0, 2}, {0, 1}};
    assert_true(tiled(off, 8) > 0.1);
}

static void holes_by_a_bridge(void **state) {
    (void)state;
    /* A square with a square hole, joined by a bridge that is passed twice. */
    const double frame[][2] = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0},
                               {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}};
    assert_true(tiled(frame, 10) > 0.1);
}

static void stars_and_spirals(void **state) {
    (void)state;
    enum { STAR = 101, TURN = 120 };
    double star[2 * STAR][2], spiral[2 * TURN][2];
    for (int i = 0; i < 2 * STAR; i++) {
        const double a = M_PI * i / STAR, r = i % 2 ? 0.3 : 1;
        star[i][0] = r * cos(a);
        star[i][1] = r * sin(a);
    }
    assert_true(tiled((const double(*)[2])star, 2 * STAR) > 0);
    for (int i = 0; i < TURN; i++) {
        const double a = 0.15 * i, r = 1 + 0.1 * a;
        spiral[i][0] = r * cos(a);
        spiral[i][1] = r * sin(a);
        spiral[2 * TURN - 1 - i][0] = (r - 0.3) * cos(a);
        spiral[2 * TURN - 1 - i][1] = (r - 0.3) * sin(a);
    }
    assert_true(tiled((const double(*)[2])spiral, 2 * TURN) > 0);
}

/* Many random star-shaped polygons, both orientations. */
static void random_polygons(void **state) {
    (void)state;
    uint32_t seed = 7;
    for (int trial = 0; trial < 300; trial++) {
        double p[40][2];
        const int n = 3 + trial % 37;
        for (int i = 0; i < n; i++) {
            seed = seed * 1664525u + 1013904223u;
            const double a = 2 * M_PI * i / n * (trial % 2 ? 1 : -1), r = 0.1 + seed / 4294967296.0;
            p[i][0] = r * cos(a);
            p[i][1] = r * sin(a);
        }
        assert_true(tiled((const double(*)[2])p, n) >= 0);
    }
}

static void unusable_polygons(void **state) {
    (void)state;
    const double bow[][2] = {{0, 0}, {2, 2}, {2, 0}, {0, 1}}, line[][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}};
    const double pentagram[][2] = {
        {1, 0}, {-0.809, 0.588}, {0.309, -0.951}, {0.309, 0.951}, {-0.809, -0.588}};
    const double point[][2] = {{1, 1}, {1, 1}, {1, 1}};
    const int polygon[] = {0, 1, 2, 3, 4};
    double v[15];
    int out[9];
    tilt(bow, 4, v);
    assert_false(morph_triangulate(v, polygon, 4, out));
    tilt(line, 4, v);
    assert_false(morph_triangulate(v, polygon, 4, out));
    tilt(pentagram, 5, v);
    assert_false(morph_triangulate(v, polygon, 5, out));
    tilt(point, 3, v);
    assert_false(morph_triangulate(v, polygon, 3, out));
    assert_false(morph_triangulate(v, polygon, 2, out));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(convex_and_concave), cmocka_unit_test(corners_on_a_side),
        cmocka_unit_test(holes_by_a_bridge),  cmocka_unit_test(stars_and_spirals),
        cmocka_unit_test(random_polygons),    cmocka_unit_test(unusable_polygons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
