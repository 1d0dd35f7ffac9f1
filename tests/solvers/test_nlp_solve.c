/* Solutions and outcomes: known optima, infeasible, unbounded, degenerate shapes, limits, warm starts. */
#include "test_nlp_problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static morph_nlp *create(int unknowns, const double *x0, const double *lower, const double *upper,
                         const morph_block *blocks, int count) {
    char message[256];
    morph_nlp *nlp = NULL;
    if (morph_nlp_create(unknowns, x0, lower, upper, blocks, count, message, sizeof message, &nlp) !=
        MORPH_OK)
        fail_msg("create: %s", message);
    return nlp;
}

static morph_nlp_result solve(morph_nlp *nlp, const double *x0, const morph_nlp_options *options) {
    morph_nlp_result result = {0};
    assert_int_equal(morph_nlp_solve(nlp, x0, options, &result), MORPH_OK);
    return result;
}

static void hs71(void **state) {
    (void)state;
    morph_block blocks[2];
    hs71_blocks(blocks);
    morph_nlp *nlp = create(4, hs71_x0, hs71_xlower, hs71_xupper, blocks, 2);
    for (int isolated = 0; isolated < 2; isolated++) {
        morph_nlp_options o = morph_nlp_defaults();
        o.isolated = isolated;
        morph_nlp_result r = solve(nlp, hs71_x0, &o);
        assert_int_equal(r.outcome, MORPH_OPTIMAL);
        assert_int_equal(r.solver_code, 0);
        assert_string_equal(r.solver_text, "solved");
        assert_near(r.objective, 17.0140173, 1e-6);
        for (int i = 0; i < 4; i++)
            assert_near(r.x[i], hs71_x[i], 1e-6);
        assert_true(r.violation <= 1e-7);
        /* Stationarity of the Lagrangian from the returned multipliers: grad f + J' y - zl + zu = 0. */
        const double *x = r.x, sum = x[0] + x[1] + x[2];
        const double gradient[4] = {x[3] * (x[0] + sum), x[0] * x[3], x[0] * x[3] + 1, x[0] * sum};
        for (int i = 0; i < 4; i++) {
            double others = 1;
            for (int k = 0; k < 4; k++)
                if (k != i) others *= x[k];
            assert_near(gradient[i] + others * r.row_multiplier[0] + 2 * x[i] * r.row_multiplier[1] -
                            r.lower_multiplier[i] + r.upper_multiplier[i],
                        0, 1e-6);
        }
        assert_true(r.evaluations > r.iterations && r.iterations > 3);
        assert_true(r.seconds > 0 && r.linear_seconds > 0 && r.linear_seconds < r.seconds);
        assert_true(r.callback_seconds > 0 && r.callback_seconds < r.seconds);
        morph_nlp_result_free(&r);
    }
    morph_nlp_destroy(nlp);
}

/* Fixed ends stay fixed; the shape is symmetric; the force in each link has the same horizontal part, H = 2 y
 * dx / L^2, which is what a hanging chain is. */
static void chain_hangs(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 60, blocks);
    morph_nlp *nlp = create(122, c.x0, c.lower, c.upper, blocks, 2);
    morph_nlp_result r = solve(nlp, c.x0, NULL);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_true(r.x[0] == 0 && r.x[1] == 0 && r.x[120] == 1 && r.x[121] == 0);
    for (int i = 0; i <= 60; i++) {
        assert_near(r.x[2 * i], 1 - r.x[2 * (60 - i)], 1e-5);
        assert_near(r.x[2 * i + 1], r.x[2 * (60 - i) + 1], 1e-5);
    }
    const double h0 = r.row_multiplier[0] * (r.x[2] - r.x[0]);
    for (int i = 1; i < 60; i++)
        assert_near(r.row_multiplier[i] * (r.x[2 * i + 2] - r.x[2 * i]), h0, 1e-6 * fabs(h0));
    /* Violation as found by our own loop. */
    double rows[60], worst = 0;
    assert_int_equal(chain_length(&c, r.x, rows), MORPH_OK);
    for (int i = 0; i < 60; i++)
        worst = fmax(worst, fabs(rows[i] - 1));
    assert_true(worst <= 1e-7 && worst == r.violation);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

/* x + y >= 2 and x + y <= 0, and x - y free: the least possible worst violation is 1. */
static void infeasible_pair(void **state) {
    (void)state;
    quadratic rows = {.rows = 2, .unknowns = 2, .a = {{1, 1}, {1, 1}}}, cost = {.unknowns = 2, .b = {1}};
    const double lower[2] = {2, -INFINITY}, upper[2] = {INFINITY, 0}, x0[2] = {5, 3};
    const morph_block blocks[2] = {quadratic_block(&rows, lower, upper), quadratic_block(&cost, NULL, NULL)};
    morph_nlp *nlp = create(2, x0, NULL, NULL, blocks, 2);
    morph_nlp_result r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_INFEASIBLE);
    const double sum = r.x[0] + r.x[1], violation = fmax(fmax(2 - sum, sum), 0);
    assert_near(r.violation, violation, 1e-12);
    assert_true(r.violation >= 1 - 1e-9 && r.violation <= 1.05);
    assert_int_equal(r.worst_row, 2 - sum > sum ? 0 : 1);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

static void unbounded(void **state) {
    (void)state;
    quadratic cost = {.unknowns = 2, .a = {{1, -1}}};
    const double x0[2] = {0, 0};
    const morph_block block = quadratic_block(&cost, NULL, NULL);
    morph_nlp *nlp = create(2, x0, NULL, NULL, &block, 1);
    morph_nlp_result r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_FEASIBLE); /* certainly not optimal */
    assert_true(r.objective < -1e6);
    assert_near(r.objective, r.x[0] - r.x[1], 1e-9 * fabs(r.objective));
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

static void without_rows(void **state) {
    (void)state;
    quadratic cost = {.unknowns = 3, .a = {{1, -2, 4}}, .b = {2}};
    const double x0[3] = {1, 1, 1}, lower[3] = {0, 0, 0};
    const morph_block block = quadratic_block(&cost, NULL, NULL);
    morph_nlp *nlp = create(3, x0, lower, NULL, &block, 1);
    morph_nlp_result r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_near(r.x[0], 0, 1e-6);
    assert_near(r.x[1], 1, 1e-6);
    assert_near(r.x[2], 0, 1e-6);
    assert_true(r.x[0] >= 0 && r.x[2] >= 0); /* bounds are not relaxed */
    assert_int_equal(r.worst_row, -1);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

/* No objective at all, and rows that depend on nothing. */
static void empty_parts(void **state) {
    (void)state;
    quadratic rows = {.rows = 1, .unknowns = 2, .a = {{1, 1}}};
    quadratic nothing = {.rows = 2, .unknowns = 0};
    const double one[2] = {1, 1}, zero[2] = {0, 0}, x0[2] = {5, 5};
    morph_block block = quadratic_block(&rows, one, one);
    morph_nlp *nlp = create(2, x0, NULL, NULL, &block, 1);
    morph_nlp_result r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_near(r.x[0] + r.x[1], 1, 1e-7);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);

    const double minus[2] = {-1, -1};
    block = quadratic_block(&nothing, minus, one); /* 0 within [-1, 1] */
    nlp = create(2, x0, NULL, NULL, &block, 1);
    assert_int_equal(morph_nlp_sizes(nlp).jacobian_nonzeros, 0);
    r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);

    nlp = create(2, x0, NULL, NULL, NULL, 0); /* no blocks */
    r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);

    nlp = create(2, x0, zero, zero, NULL, 0); /* everything fixed */
    r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_string_equal(r.solver_text, "every unknown is fixed");
    assert_true(r.x[0] == 0 && r.x[1] == 0);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);

    block = quadratic_block(&rows, one, one); /* everything fixed where the row fails */
    nlp = create(2, x0, zero, zero, &block, 1);
    r = solve(nlp, x0, NULL);
    assert_int_equal(r.outcome, MORPH_INFEASIBLE);
    assert_near(r.violation, 1, 1e-15);
    assert_int_equal(r.worst_row, 0);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

/* Three equalities, two unknowns: consistent (x = 1, y = 2) at the start or away from it, and inconsistent.
 */
static void more_equalities_than_unknowns(void **state) {
    (void)state;
    quadratic rows = {.rows = 3, .unknowns = 2, .a = {{1, 0}, {0, 1}, {1, 1}}};
    double target[3] = {1, 2, 3};
    const double there[2] = {1, 2}, away[2] = {7, 7};
    const morph_block block = quadratic_block(&rows, target, target);
    morph_nlp *nlp = create(2, away, NULL, NULL, &block, 1);
    morph_nlp_result r = solve(nlp, there, NULL);
    assert_int_equal(r.outcome, MORPH_FEASIBLE);
    assert_string_equal(r.solver_text, "more equalities than free unknowns");
    morph_nlp_result_free(&r);
    r = solve(nlp, away, NULL);
    assert_int_equal(r.outcome, MORPH_INFEASIBLE);
    assert_string_equal(r.solver_text, "more equalities than free unknowns");
    assert_near(r.violation, 11, 1e-12);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

static void warm_start_is_short(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 100, blocks);
    /* A floor that cuts the lowest part off: bound multipliers matter. */
    for (int i = 1; i < 100; i++)
        c.lower[2 * i + 1] = -0.25;
    morph_nlp *nlp = create(202, c.x0, c.lower, c.upper, blocks, 2);
    for (int adaptive = 0; adaptive < 2; adaptive++) {
        morph_nlp_options o = morph_nlp_defaults();
        o.adaptive_mu = adaptive;
        morph_nlp_result r = solve(nlp, c.x0, &o);
        assert_int_equal(r.outcome, MORPH_OPTIMAL);
        const int cold = r.iterations;
        const double objective = r.objective;
        morph_nlp_result cheap = solve(nlp, r.x, &o); /* x alone */
        o.warm = true;
        assert_int_equal(morph_nlp_solve(nlp, NULL, &o, &r), MORPH_OK);
        assert_int_equal(r.outcome, MORPH_OPTIMAL);
        print_message("adaptive %d: cold %d, from x alone %d, warm %d iterations\n", adaptive, cold,
                      cheap.iterations, r.iterations);
        assert_true(r.iterations <= 2 && cold >= 8);
        assert_near(r.objective, objective, 1e-8);
        morph_nlp_result_free(&cheap);
        morph_nlp_result_free(&r);
    }
    /* A warm start of another shape, or of nothing, is refused. */
    morph_nlp_options o = morph_nlp_defaults();
    o.warm = true;
    morph_nlp_result empty = {0};
    assert_int_equal(morph_nlp_solve(nlp, c.x0, &o, &empty), MORPH_ERR_INPUT);
    morph_nlp_destroy(nlp);
}

static void refuses_bad_options(void **state) {
    (void)state;
    morph_block blocks[2];
    hs71_blocks(blocks);
    morph_nlp *nlp = create(4, hs71_x0, hs71_xlower, hs71_xupper, blocks, 2);
    morph_nlp_result r = {0};
    morph_nlp_options o = morph_nlp_defaults();
    o.tolerance = NAN;
    assert_int_equal(morph_nlp_solve(nlp, hs71_x0, &o, &r), MORPH_ERR_INPUT);
    o = morph_nlp_defaults();
    o.violation_tolerance = 0;
    assert_int_equal(morph_nlp_solve(nlp, hs71_x0, &o, &r), MORPH_ERR_INPUT);
    o = morph_nlp_defaults();
    o.max_iterations = -1;
    assert_int_equal(morph_nlp_solve(nlp, hs71_x0, &o, &r), MORPH_ERR_INPUT);
    assert_int_equal(morph_nlp_solve(nlp, NULL, NULL, &r), MORPH_ERR_INPUT);
    const double x0[4] = {1, NAN, 1, 1};
    assert_int_equal(morph_nlp_solve(nlp, x0, NULL, &r), MORPH_ERR_INPUT);
    assert_null(r.x);
    morph_nlp_destroy(nlp);
}

static void iteration_limit(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 60, blocks);
    morph_nlp *nlp = create(122, c.x0, c.lower, c.upper, blocks, 2);
    morph_nlp_options o = morph_nlp_defaults();
    o.max_iterations = 2;
    morph_nlp_result r = solve(nlp, c.x0, &o);
    assert_int_equal(r.outcome, MORPH_STOPPED); /* equalities are not met so soon */
    assert_string_equal(r.solver_text, "iteration limit");
    assert_int_equal(r.iterations, 2);
    assert_true(r.violation > 1e-7);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

int main(void) {
    morph_blas_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hs71),
        cmocka_unit_test(chain_hangs),
        cmocka_unit_test(infeasible_pair),
        cmocka_unit_test(unbounded),
        cmocka_unit_test(without_rows),
        cmocka_unit_test(empty_parts),
        cmocka_unit_test(more_equalities_than_unknowns),
        cmocka_unit_test(warm_start_is_short),
        cmocka_unit_test(refuses_bad_options),
        cmocka_unit_test(iteration_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
