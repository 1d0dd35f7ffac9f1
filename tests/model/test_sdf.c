/* Smooth distance: interpolation, derivatives inside and outside the grid, order of accuracy. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "model/sdf.h"

#define assert_near(a, b, eps) near_or_fail((a), (b), (eps), __LINE__)
static void near_or_fail(double a, double b, double eps, int line) {
    if (fabs(a - b) <= eps) return;
    print_error("line %d: %.17g is not %.17g to %g\n", line, a, b, eps);
    fail();
}

/* Of this process: other work on the machine counts less. */
static double cpu_seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

static uint64_t seed = 7;
static double uniform(double lo, double hi) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(seed >> 11) / 9007199254740992.0;
}

/* Sphere of radius 0.3 in `rings` rings: the smooth case. */
static morph_distance *sphere(int rings, bool open) {
    static double v[3 * 17000];
    static int t[3 * 33000];
    morph_mesh m = {.v = v, .t = t};
    const int around = 2 * rings;
    for (int i = 1; i < rings; i++)
        for (int j = 0; j < around; j++) {
            const double a = M_PI * i / rings, b = 2 * M_PI * j / around;
            double *p = v + 3 * m.vertices++;
            p[0] = 0.3 * sin(a) * cos(b);
            p[1] = 0.3 * sin(a) * sin(b);
            p[2] = 0.3 * cos(a);
        }
    const int top = m.vertices++, bottom = m.vertices++;
    memcpy(v + 3 * top, (double[3]){0, 0, 0.3}, 3 * sizeof *v);
    memcpy(v + 3 * bottom, (double[3]){0, 0, -0.3}, 3 * sizeof *v);
    for (int j = 0; j < around; j++) {
        const int k = (j + 1) % around, last = (rings - 2) * around;
        memcpy(t + 3 * m.triangles++, (int[3]){top, j, k}, 3 * sizeof *t);
        if (!open) memcpy(t + 3 * m.triangles++, (int[3]){bottom, last + k, last + j}, 3 * sizeof *t);
        for (int i = 0; i + 2 < rings; i++) {
            const int a = i * around + j, b = i * around + k, c = b + around, d = a + around;
            memcpy(t + 3 * m.triangles++, (int[3]){a, d, c}, 3 * sizeof *t);
            memcpy(t + 3 * m.triangles++, (int[3]){a, c, b}, 3 * sizeof *t);
        }
    }
    morph_distance *d;
    assert_int_equal(morph_distance_create(&m, !open, &d), MORPH_OK);
    return d;
}

static const double LO[3] = {-0.5, -0.45, -0.4}, HI[3] = {0.5, 0.47, 0.6};

static morph_sdf *grid(const morph_distance *d, double cell) {
    morph_sdf *s;
    assert_int_equal(morph_sdf_create(d, LO, HI, cell, NULL, &s), MORPH_OK);
    return s;
}

static void test_interpolates_nodes(void **state) {
    (void)state;
    morph_distance *d = sphere(12, false);
    morph_sdf *s = grid(d, 0.05);
    morph_sdf_accuracy a;
    morph_sdf_measure(s, d, 0.1, &a);
    assert_int_equal(a.nodes[0], 21);
    assert_int_equal(a.nodes[1], 20);
    assert_int_equal(a.nodes[2], 21);
    for (int i = 0; i < a.nodes[0]; i++)
        for (int j = 0; j < a.nodes[1]; j++)
            for (int k = 0; k < a.nodes[2]; k++) {
                const double p[3] = {LO[0] + (HI[0] - LO[0]) * i / (a.nodes[0] - 1),
                                     LO[1] + (HI[1] - LO[1]) * j / (a.nodes[1] - 1),
                                     LO[2] + (HI[2] - LO[2]) * k / (a.nodes[2] - 1)};
                morph_closest c;
                morph_distance_point(d, p, &c);
                assert_near(morph_sdf_eval(s, p, NULL, NULL), c.distance, 1e-13);
            }
    morph_sdf_destroy(s);
    morph_distance_destroy(d);
}

/* Gradient and Hessian at p against central differences; `corrupt` adds to one entry and must be noticed. */
static double derivative_error(const morph_sdf *s, const double p[3], double corrupt) {
    static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    const double e = 1e-6;
    double g[3], h[6], worst = 0;
    const double value = morph_sdf_eval(s, p, g, h);
    assert_near(morph_sdf_eval(s, p, NULL, NULL), value, 1e-12 * fmax(1, fabs(value)));
    h[4] += corrupt;
    for (int k = 0; k < 3; k++) {
        double lo[3], hi[3], glo[3], ghi[3];
        memcpy(lo, p, sizeof lo);
        memcpy(hi, p, sizeof hi);
        lo[k] -= e;
        hi[k] += e;
        const double flo = morph_sdf_eval(s, lo, glo, NULL), fhi = morph_sdf_eval(s, hi, ghi, NULL);
        worst = fmax(worst, fabs((fhi - flo) / (2 * e) - g[k]));
        for (int l = 0; l < 3; l++)
            worst = fmax(worst, 1e-2 * fabs((ghi[l] - glo[l]) / (2 * e) - h[at[k][l]]));
    }
    return worst;
}

static void test_derivatives(void **state) {
    (void)state;
    morph_distance *d = sphere(12, false);
    morph_sdf *s = grid(d, 0.05);
    for (int i = 0; i < 6000; i++) {
        double p[3];
        const double far = i % 3 == 0 ? 0 : i % 3 == 1 ? 0.2 : 3;
        for (int k = 0; k < 3; k++)
            p[k] = uniform(LO[k] - far, HI[k] + far);
        assert_true(derivative_error(s, p, 0) < 1e-6);
        assert_true(derivative_error(s, p, 0.01) > 1e-5);
    }
    /* On the border itself, and on its edges and corners: one-sided values meet. */
    for (int i = 0; i < 3000; i++) {
        double p[3];
        for (int k = 0; k < 3; k++) {
            const double r = uniform(0, 3);
            p[k] = r < 1 ? LO[k] : r < 2 ? HI[k] : uniform(LO[k], HI[k]);
        }
        assert_true(derivative_error(s, p, 0) < 1e-5);
    }
    morph_sdf_destroy(s);
    morph_distance_destroy(d);
}

static void test_outside_grows_like_distance(void **state) {
    (void)state;
    morph_distance *d = sphere(12, false);
    morph_sdf *s = grid(d, 0.05);
    for (int i = 0; i < 3000; i++) {
        const double far = pow(10, uniform(-3, 6));
        double p[3], g[3], h[6];
        for (int k = 0; k < 3; k++)
            p[k] = uniform(-far, far);
        const double value = morph_sdf_eval(s, p, g, h), radius = morph_norm(p);
        if (radius < 0.9) continue;
        /* Between the distance to the sphere less a cell and that plus the box's size. */
        assert_true(value > radius - 0.3 - 0.06 && value < radius + 1);
        assert_true(morph_norm(g) < 1.8);
    }
    const double extreme[3] = {1e300, -1e300, 0};
    double g[3], h[6];
    assert_true(isfinite(morph_sdf_eval(s, extreme, g, h)));
    for (int k = 0; k < 6; k++)
        assert_true(isfinite(h[k]) && isfinite(g[k % 3]));
    morph_sdf_destroy(s);
    morph_distance_destroy(d);
}

static void test_order_of_accuracy(void **state) {
    (void)state;
    morph_distance *d = sphere(90, false);
    double rms[3];
    for (int i = 0; i < 3; i++) {
        morph_sdf_accuracy a;
        morph_sdf *s = grid(d, 0.2 / (1 << i));
        morph_sdf_measure(s, d, 0.1, &a);
        print_message("cell %.4f (%d x %d x %d nodes): rms %.2e, max %.2e\n", a.cell, a.nodes[0], a.nodes[1],
                      a.nodes[2], a.rms, a.max);
        rms[i] = a.rms;
        assert_true(a.max >= a.rms && a.rms > 0);
        morph_sdf_destroy(s);
    }
    /* Fourth order on a smooth surface until its facets show. */
    assert_true(rms[0] > 8 * rms[1]);
    assert_true(rms[1] > 1.5 * rms[2]);
    morph_distance_destroy(d);
}

static int stop_now(void *user) {
    return ++*(int *)user > 3;
}

static void test_refusals_and_stop(void **state) {
    (void)state;
    morph_distance *d = sphere(6, false);
    morph_sdf *s;
    int calls = 0;
    const morph_control control = {.stop = stop_now, .user = &calls};
    assert_int_equal(morph_sdf_create(d, LO, HI, 0.05, &control, &s), MORPH_ERR_STOPPED);
    assert_null(s);
    assert_int_equal(morph_sdf_create(d, LO, HI, 0, NULL, &s), MORPH_ERR_INPUT);
    assert_int_equal(morph_sdf_create(d, HI, LO, 0.05, NULL, &s), MORPH_ERR_INPUT);
    assert_int_equal(morph_sdf_create(d, LO, HI, 1e-9, NULL, &s), MORPH_ERR_NOMEM);
    assert_null(s);
    morph_sdf_destroy(NULL);
    /* A grid of few cells still gets a spline. */
    s = grid(d, 10);
    const double p[3] = {0.4, 0.4, 0.4};
    assert_true(isfinite(morph_sdf_eval(s, p, NULL, NULL)));
    morph_sdf_destroy(s);
    morph_distance_destroy(d);
}

static void test_speed(void **state) {
    (void)state;
    morph_distance *d = sphere(23, false);
    const double began = cpu_seconds();
    morph_sdf *s = grid(d, 0.0125);
    const double built = cpu_seconds();
    morph_sdf_accuracy a;
    morph_sdf_measure(s, d, 0.05, &a);
    enum { POINTS = 200000 };
    double sum = 0;
    const double start = cpu_seconds();
    for (int i = 0; i < POINTS; i++) {
        double p[3], g[3], h[6];
        for (int k = 0; k < 3; k++)
            p[k] = uniform(LO[k], HI[k]);
        sum += morph_sdf_eval(s, p, g, h);
    }
    const double end = cpu_seconds();
    assert_true(isfinite(sum));
    print_message("%d triangles, %d x %d x %d nodes: built in %.2f s; value, gradient and Hessian %.0f ns\n",
                  morph_distance_mesh(d)->triangles, a.nodes[0], a.nodes[1], a.nodes[2], built - began,
                  (end - start) / POINTS * 1e9);
    morph_sdf_destroy(s);
    morph_distance_destroy(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_interpolates_nodes),          cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_outside_grows_like_distance), cmocka_unit_test(test_order_of_accuracy),
        cmocka_unit_test(test_refusals_and_stop),           cmocka_unit_test(test_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
