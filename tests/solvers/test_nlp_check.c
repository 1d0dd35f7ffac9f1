/* The derivative checker: passes what is right, and names what is wrong. */
#include "test_nlp_problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

/* Rows |p_k+1 - p_k|^2 of three points in the plane, with one fault to choose. */
typedef enum fault {
    NONE,
    JACOBIAN_VALUE,
    JACOBIAN_SIGN,
    JACOBIAN_INDEX,
    HESSIAN_VALUE,
    HESSIAN_SIGN,
    HESSIAN_INDEX,
    HESSIAN_ROW,
    HESSIAN_TWICE,
    OUT_OF_RANGE,
    SKIPS_WHEN_ALONE,
    CHANGES_WITH_X
} fault;

static morph_status value(void *data, const double *x, double *f) {
    (void)data;
    for (int r = 0; r < 2; r++) {
        const double dx = x[2 * r + 2] - x[2 * r], dy = x[2 * r + 3] - x[2 * r + 1];
        f[r] = dx * dx + dy * dy;
    }
    return MORPH_OK;
}

static morph_status walk(void *data, const double *x, const double *w, morph_sink *s) {
    const fault bad = *(const fault *)data;
    for (int r = 0; r < 2; r++)
        for (int axis = 0; axis < 2; axis++) {
            const bool here = r == 1 && axis == 0;
            const int a = 2 * r + axis, b = a + 2;
            const double d = x[b] - x[a];
            double value = 2 * d;
            if (here && bad == JACOBIAN_VALUE) value *= 1.001;
            if (here && bad == JACOBIAN_SIGN) value = -value;
            if (here && bad == SKIPS_WHEN_ALONE && !morph_sink_wants_hessian(s)) continue;
            if (here && bad == CHANGES_WITH_X && x[0] != 0.3) continue;
            morph_sink_jacobian(s, r, a, -2 * d);
            morph_sink_jacobian(s, r,
                                here && bad == JACOBIAN_INDEX ? b + 1
                                : here && bad == OUT_OF_RANGE ? 6
                                                              : b,
                                value);
            const double weight = here && bad == HESSIAN_ROW ? w[0] : w[r];
            double second = 2 * weight;
            if (here && bad == HESSIAN_VALUE) second *= 1.01;
            if (here && bad == HESSIAN_SIGN) second = -second;
            morph_sink_hessian(s, a, a, 2 * weight);
            morph_sink_hessian(s, b, b, second);
            morph_sink_hessian(s, a, here && bad == HESSIAN_INDEX ? b + 1 : b, -2 * weight);
            if (here && bad == HESSIAN_TWICE) morph_sink_hessian(s, b, a, -2 * weight);
        }
    return MORPH_OK;
}

static void describe(void *data, int row, char *text, size_t size) {
    (void)data;
    snprintf(text, size, "link %c", 'a' + row);
}

static morph_derivative_check check(fault bad) {
    static const double zero[2] = {0};
    /* Local 0..5 are global 7..2. */
    static const int map[6] = {7, 6, 5, 4, 3, 2};
    static const double x[8] = {9, 9, 1.7, -0.4, 0.6, 0.8, 0.1, 0.3};
    const morph_block block = {"length", 2, 6, map, zero, zero, &bad, value, walk, describe};
    morph_derivative_check out;
    assert_int_equal(morph_check_derivatives(&block, 1, x, 8, 1e-5, 1e-7, &out), MORPH_OK);
    return out;
}

static void rejected(fault bad, const char *words) {
    const morph_derivative_check out = check(bad);
    if (out.passed) fail_msg("fault %d passed", bad);
    if (!strstr(out.message, words))
        fail_msg("fault %d: \"%s\" does not say \"%s\"", bad, out.message, words);
}

static void right_derivatives_pass(void **state) {
    (void)state;
    morph_derivative_check out = check(NONE);
    assert_true(out.passed);
    assert_string_equal(out.message, "");
    assert_true(out.worst_jacobian < 1e-9);
    assert_true(out.worst_hessian < 1e-9);
    morph_block blocks[2];
    hs71_blocks(blocks);
    assert_int_equal(morph_check_derivatives(blocks, 2, hs71_x, 4, 1e-5, 1e-7, &out), MORPH_OK);
    assert_true(out.passed);
    assert_true(out.worst_jacobian > 0);
    static chain c;
    chain_init(&c, 12, blocks);
    assert_int_equal(morph_check_derivatives(blocks, 2, c.x0, 26, 1e-5, 1e-7, &out), MORPH_OK);
    assert_true(out.passed);
}

/* The faulty entry is row 1, link b, local unknowns 2 and 4, that is 5 and 3 globally. */
static void wrong_jacobian_is_named(void **state) {
    (void)state;
    rejected(JACOBIAN_VALUE, "length: row 1 (link b), unknown 3: analytic");
    rejected(JACOBIAN_SIGN, "length: row 1 (link b), unknown 3: analytic");
    /* Misplaced to local 5: local 4 comes first and is empty there. */
    rejected(JACOBIAN_INDEX, "length: row 1 (link b), unknown 3: analytic 0, numeric");
    rejected(OUT_OF_RANGE, "length: derivative entry (1, 6) is outside 2 rows and 6 unknowns");
}

static void wrong_hessian_is_named(void **state) {
    (void)state;
    rejected(HESSIAN_VALUE, "length: row 1 (link b), Hessian of unknowns 3 and 3: analytic 2.02, numeric 2");
    rejected(HESSIAN_SIGN, "length: row 1 (link b), Hessian of unknowns 3 and 3: analytic -2, numeric");
    rejected(HESSIAN_INDEX, "length: row 1 (link b), Hessian of unknowns 3 and 5: analytic 0, numeric -2");
    rejected(HESSIAN_ROW, "Hessian of unknowns 5 and 5");
    rejected(HESSIAN_TWICE, "length: row 1 (link b), Hessian of unknowns 3 and 5: analytic -4, numeric -2");
}

static void changing_walks_are_named(void **state) {
    (void)state;
    rejected(SKIPS_WHEN_ALONE, "first derivatives alone");
    rejected(CHANGES_WITH_X, "at another point");
}

static void bad_arguments(void **state) {
    (void)state;
    morph_block blocks[2];
    hs71_blocks(blocks);
    morph_derivative_check out;
    assert_int_equal(morph_check_derivatives(blocks, 2, hs71_x, 3, 1e-5, 1e-7, &out), MORPH_ERR_INPUT);
    assert_int_equal(morph_check_derivatives(blocks, 2, hs71_x, 4, 0, 1e-7, &out), MORPH_ERR_INPUT);
    assert_int_equal(morph_check_derivatives(blocks, 2, hs71_x, 4, 1e-5, NAN, &out), MORPH_ERR_INPUT);
    /* NaN in a value is a difference, not agreement. */
    quadratic q = {.unknowns = 4, .nan_value = 3};
    const morph_block b = quadratic_block(&q, NULL, NULL);
    assert_int_equal(morph_check_derivatives(&b, 1, hs71_x, 4, 1e-5, 1e-7, &out), MORPH_OK);
    assert_false(out.passed);
    assert_non_null(strstr(out.message, "objective: row 0, unknown 1"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(right_derivatives_pass), cmocka_unit_test(wrong_jacobian_is_named),
        cmocka_unit_test(wrong_hessian_is_named), cmocka_unit_test(changing_walks_are_named),
        cmocka_unit_test(bad_arguments),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
