/* The spline and the curve of poses: interpolation, knots, derivatives, rigid posts, order of convergence. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "planner/curve.h"

#include <stdlib.h>
#include <string.h>

enum { POSES = 14 };

/* cmocka's own comparison rounds to float. */
static void assert_near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.17g is not %.17g within %g", a, b, tolerance);
}

/* Uneven, rising, from 0 to 1. */
static void uneven_sites(int count, double *s) {
    for (int k = 0; k < count; k++) {
        const double u = k / (count - 1.0);
        s[k] = u + 0.08 * sin(6.283185307179586 * u);
    }
    s[count - 1] = 1.0;
}

static void test_uniform_knots(void **state) {
    (void)state;
    morph_basis b;
    assert_int_equal(morph_basis_uniform(9, &b), MORPH_OK);
    for (int i = 0; i < 15; i++)
        assert_near(b.knot[i], i < 6 ? 0.0 : i > 8 ? 1.0 : (i - 5) / 4.0, 1e-15);
    morph_basis_free(&b);
    assert_int_equal(morph_basis_uniform(5, &b), MORPH_ERR_INPUT);
    assert_null(b.knot);
}

/* Each site lies strictly within its function's support (Schoenberg and Whitney), ends are clamped. */
static void test_site_knots(void **state) {
    (void)state;
    for (int count = 6; count <= 40; count++) {
        double s[40];
        morph_basis b;
        uneven_sites(count, s);
        assert_int_equal(morph_basis_for_sites(s, count, &b), MORPH_OK);
        for (int i = 0; i < 6; i++)
            assert_true(b.knot[i] == s[0] && b.knot[count + i] == s[count - 1]);
        for (int i = 1; i < count + 6; i++)
            assert_true(b.knot[i] >= b.knot[i - 1]);
        for (int i = 1; i + 1 < count; i++)
            assert_true(b.knot[i] < s[i] && s[i] < b.knot[i + 6]);
        morph_basis_free(&b);
    }
    double bad[6] = {0.0, 0.1, 0.1, 0.5, 0.8, 1.0};
    morph_basis b;
    morph_spline f;
    assert_int_equal(morph_basis_for_sites(bad, 6, &b), MORPH_ERR_INPUT);
    bad[2] = NAN;
    assert_int_equal(morph_basis_for_sites(bad, 6, &b), MORPH_ERR_INPUT);
    assert_int_equal(morph_spline_fit(bad, bad, 5, 1, &f), MORPH_ERR_INPUT);
    assert_null(f.control);
}

/* Sums of values are 1, of derivatives 0; values are not negative; each derivative is the difference quotient
 * of the one before. */
static void test_basis(void **state) {
    (void)state;
    double s[12];
    morph_basis b;
    uneven_sites(12, s);
    assert_int_equal(morph_basis_for_sites(s, 12, &b), MORPH_OK);
    for (int k = 0; k <= 200; k++) {
        double v[6][MORPH_SPLINE_ORDER], left[6][MORPH_SPLINE_ORDER], right[6][MORPH_SPLINE_ORDER];
        const double at = k / 200.0, h = 1e-6;
        const int first = morph_basis_eval(&b, at, 5, v);
        assert_true(first >= 0 && first + 6 <= b.count);
        for (int d = 0; d < 6; d++) {
            double sum = 0.0, size = 0.0;
            for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
                sum += v[d][i];
                size += fabs(v[d][i]);
                if (d == 0) assert_true(v[d][i] >= 0.0);
            }
            assert_near(sum, d == 0 ? 1.0 : 0.0, 1e-12 * size);
        }
        /* Only where the span stays the same do the six functions too. */
        if (morph_basis_eval(&b, at - h, 5, left) != first || morph_basis_eval(&b, at + h, 5, right) != first)
            continue;
        for (int d = 1; d < 6 && k > 0 && k < 200; d++)
            for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
                const double numeric = (right[d - 1][i] - left[d - 1][i]) / (2.0 * h);
                assert_near(v[d][i], numeric, 1e-5 * (1.0 + fabs(v[d][i]) + fabs(v[d - 1][i])));
            }
    }
    morph_basis_free(&b);
}

/* A quintic is its own interpolant, with all its derivatives. */
static void test_exact_for_quintics(void **state) {
    (void)state;
    double s[11], y[22];
    uneven_sites(11, s);
    for (int k = 0; k < 11; k++) {
        y[2 * k] = 1.0 + s[k] * (2.0 + s[k] * s[k] * (3.0 - s[k] * s[k]));
        y[2 * k + 1] = -s[k];
    }
    morph_spline f;
    assert_int_equal(morph_spline_fit(s, y, 11, 2, &f), MORPH_OK);
    for (int k = 0; k <= 50; k++) {
        const double x = k / 50.0;
        double v[12];
        morph_spline_eval(&f, x, 5, v);
        const double expected[6] = {1.0 + 2.0 * x + 3.0 * x * x * x - pow(x, 5.0),
                                    2.0 + 9.0 * x * x - 5.0 * pow(x, 4.0),
                                    18.0 * x - 20.0 * pow(x, 3.0),
                                    18.0 - 60.0 * x * x,
                                    -120.0 * x,
                                    -120.0};
        /* Differences of order d lose a factor of about 20 each. */
        for (int d = 0; d < 6; d++) {
            assert_near(v[2 * d], expected[d], 1e-12 * pow(30.0, d));
            assert_near(v[2 * d + 1], d == 0 ? -x : d == 1 ? -1.0 : 0.0, 1e-12 * pow(30.0, d));
        }
    }
    morph_spline_free(&f);
}

static double worst_error(int count, int derivative) {
    double *s = calloc((size_t)count, sizeof *s), *y = calloc((size_t)count, sizeof *y), worst = 0.0;
    assert_non_null(s);
    assert_non_null(y);
    for (int k = 0; k < count; k++) {
        s[k] = k / (count - 1.0);
        y[k] = sin(5.0 * s[k]);
    }
    morph_spline f;
    assert_int_equal(morph_spline_fit(s, y, count, 1, &f), MORPH_OK);
    for (int k = 0; k <= 997; k++) {
        const double x = k / 997.0;
        double v[6];
        morph_spline_eval(&f, x, derivative, v);
        const double expected = pow(5.0, derivative) * sin(5.0 * x + derivative * 1.5707963267948966);
        worst = fmax(worst, fabs(v[derivative] - expected));
    }
    morph_spline_free(&f);
    free(s);
    free(y);
    return worst;
}

/* Half the spacing: the error of the d-th derivative falls by 2^(6 - d). */
static void test_convergence(void **state) {
    (void)state;
    for (int d = 0; d <= 3; d++) {
        const double coarse = worst_error(21, d), fine = worst_error(41, d), order = log2(coarse / fine);
        print_message("derivative %d: error %.2e, then %.2e: order %.2f\n", d, coarse, fine, order);
        assert_true(order > 6 - d - 0.7 && order < 6 - d + 1.2);
    }
}

typedef struct fixture {
    morph_structure *structure;
    morph_curve *curve;
    double s[POSES];
    double *joints, *scratch, *at;
} fixture;

/* Posts that wander and tilt, each its own way. */
static int setup(void **state) {
    static fixture f;
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = 3;
    def.nodes[1] = 4;
    if (morph_structure_create(&def, &f.structure) != MORPH_OK) return 1;
    const morph_structure *st = f.structure;
    const size_t width = 3 * (size_t)st->joints;
    f.joints = calloc(POSES * width, sizeof(double));
    f.scratch = calloc(MORPH_JET * 6 * (size_t)st->posts, sizeof(double));
    f.at = calloc(MORPH_JET * width, sizeof(double));
    if (!f.joints || !f.scratch || !f.at) return 1;
    uneven_sites(POSES, f.s);
    for (int k = 0; k < POSES; k++)
        for (int p = 0; p < st->posts; p++) {
            const double u = f.s[k], *b = &st->start[3 * st->post[p][0]];
            const double q[3] = {0.4 * sin(3.0 * u + p), 0.4 * cos(2.0 * u - 0.7 * p), 1.0};
            const double move[3] = {0.02 * sin(2.0 * u + 1.3 * p), 0.03 * u * u, 0.02 * cos(4.0 * u + p)};
            for (int c = 0; c < 3; c++) {
                double *x = &f.joints[(size_t)k * width];
                const double centre = b[c] + move[c], half = 0.5 * st->post_length[p] * q[c] / morph_norm(q);
                x[3 * st->post[p][0] + c] = centre - half;
                x[3 * st->post[p][1] + c] = centre + half;
            }
        }
    *state = &f;
    return morph_curve_create(st, f.s, f.joints, POSES, &f.curve) == MORPH_OK ? 0 : 1;
}

static int teardown(void **state) {
    fixture *f = *state;
    morph_curve_destroy(f->curve);
    morph_structure_destroy(f->structure);
    free(f->joints);
    free(f->scratch);
    free(f->at);
    return 0;
}

static void test_interpolation(void **state) {
    fixture *f = *state;
    const int width = 3 * f->structure->joints;
    for (int k = 0; k < POSES; k++) {
        morph_curve_joints(f->curve, f->s[k], 0, f->scratch, f->at);
        for (int i = 0; i < width; i++)
            assert_near(f->at[i], f->joints[k * width + i], 1e-14);
    }
}

/* Post lengths at any parameter, and the five derivatives of their squares: zero. */
static void test_rigid_posts(void **state) {
    fixture *f = *state;
    const morph_structure *st = f->structure;
    const int width = 3 * st->joints;
    for (int k = 0; k <= 300; k++) {
        morph_curve_joints(f->curve, k / 300.0, 5, f->scratch, f->at);
        for (int p = 0; p < st->posts; p++) {
            const int b = 3 * st->post[p][0], t = 3 * st->post[p][1];
            assert_near(morph_dist(&f->at[b], &f->at[t]), st->post_length[p], 1e-15);
            for (int d = 1; d <= 5; d++) {
                double sum = 0.0, size = 0.0, binomial = 1.0; /* Leibniz: (q.q)^(d) */
                for (int i = 0; i <= d; i++, binomial *= (double)(d - i + 1) / i)
                    for (int c = 0; c < 3; c++) {
                        const double u = f->at[i * width + t + c] - f->at[i * width + b + c];
                        const double v = f->at[(d - i) * width + t + c] - f->at[(d - i) * width + b + c];
                        sum += binomial * u * v;
                        size += fabs(binomial * u * v);
                    }
                assert_near(sum, 0.0, 1e-11 * size + 1e-14);
            }
        }
    }
}

/* Each derivative of joints and lengths against central differences of the one before, away from knots. */
static void test_derivatives(void **state) {
    fixture *f = *state;
    const morph_structure *st = f->structure;
    const size_t width = 3 * (size_t)st->joints, links = (size_t)st->links;
    double *x = calloc(3 * MORPH_JET * width, sizeof *x), *l = calloc(3 * MORPH_JET * links, sizeof *l);
    assert_non_null(x);
    assert_non_null(l);
    const double h = 1e-5;
    int tested = 0;
    for (int k = 1; k < 60; k++) {
        const double s = k / 60.0;
        bool knot = false;
        for (int i = 0; i < f->curve->spline.basis.count + 6; i++)
            knot = knot || fabs(f->curve->spline.basis.knot[i] - s) < 2.0 * h;
        if (knot) continue;
        tested++;
        for (int side = 0; side < 3; side++) {
            morph_curve_joints(f->curve, s + (side - 1) * h, 5, f->scratch,
                               x + (size_t)side * MORPH_JET * width);
            morph_curve_lengths(st, x + (size_t)side * MORPH_JET * width, 5,
                                l + (size_t)side * MORPH_JET * links);
        }
        for (size_t d = 1; d < MORPH_JET; d++) {
            /* Truncation h^2 and rounding eps / h, in units that grow by about ten with each derivative. */
            const double tolerance = 1e-8 * pow(20.0, (double)d);
            const double *xl = x + (d - 1) * width, *xr = xl + 2 * MORPH_JET * width;
            const double *ll = l + (d - 1) * links, *lr = ll + 2 * MORPH_JET * links;
            for (size_t i = 0; i < width; i++)
                assert_near(x[(MORPH_JET + d) * width + i], (xr[i] - xl[i]) / (2.0 * h), tolerance);
            for (size_t i = 0; i < links; i++)
                assert_near(l[(MORPH_JET + d) * links + i], (lr[i] - ll[i]) / (2.0 * h), tolerance);
        }
    }
    assert_true(tested > 50);
    free(x);
    free(l);
}

/* Lower orders are the same numbers; lengths are those of the joints. */
static void test_orders_agree(void **state) {
    fixture *f = *state;
    const morph_structure *st = f->structure;
    const size_t width = 3 * (size_t)st->joints, links = (size_t)st->links;
    double *x = calloc(MORPH_JET * width, sizeof *x), *l = calloc((MORPH_JET + 1) * links, sizeof *l);
    assert_non_null(x);
    assert_non_null(l);
    for (int order = 0; order < MORPH_JET; order++) {
        morph_curve_joints(f->curve, 0.37, 5, f->scratch, f->at);
        morph_curve_joints(f->curve, 0.37, order, f->scratch, x);
        for (size_t i = 0; i < (size_t)(order + 1) * width; i++)
            assert_near(x[i], f->at[i], 1e-15 * fabs(x[i]));
        morph_curve_lengths(st, x, order, l);
        morph_link_lengths(st, x, l + MORPH_JET * links);
        for (size_t i = 0; i < links; i++)
            assert_near(l[i], l[MORPH_JET * links + i], 1e-15);
    }
    free(x);
    free(l);
}

/* Five poses are not enough, and parameters must rise; nothing is left behind. */
static void test_bad_input(void **state) {
    fixture *f = *state;
    morph_curve *curve = f->curve;
    assert_int_equal(morph_curve_create(f->structure, f->s, f->joints, 5, &curve), MORPH_ERR_INPUT);
    assert_null(curve);
    double s[POSES];
    memcpy(s, f->s, sizeof s);
    s[3] = s[2];
    assert_int_equal(morph_curve_create(f->structure, s, f->joints, POSES, &curve), MORPH_ERR_INPUT);
    assert_null(curve);
    morph_curve_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform_knots), cmocka_unit_test(test_site_knots),
        cmocka_unit_test(test_basis),         cmocka_unit_test(test_exact_for_quintics),
        cmocka_unit_test(test_convergence),   cmocka_unit_test(test_interpolation),
        cmocka_unit_test(test_rigid_posts),   cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_orders_agree),  cmocka_unit_test(test_bad_input),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
