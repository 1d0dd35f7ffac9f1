/* What is known to go wrong with Ipopt and MUMPS, provoked: option files, output, numbers that are not
 * finite, relaxed bounds, stops and limits, repeats. */
#include "test_nlp_grid.h"
#include "test_nlp_solving.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* ------------------------------------------------------------------ option file and output */

static long file_size(const char *path) {
    struct stat s;
    return stat(path, &s) == 0 ? (long)s.st_size : -1;
}

static void option_file_changes_nothing(void **state) {
    (void)state;
    static chain c;
    morph_nlp_result plain = solve_chain(&c, 20, false);

    char folder[] = "/tmp/morph-nlp-XXXXXX", back[4096];
    assert_non_null(getcwd(back, sizeof back));
    assert_non_null(mkdtemp(folder));
    assert_int_equal(chdir(folder), 0);
    FILE *f = fopen("ipopt.opt", "w");
    assert_non_null(f);
    fputs(
        "max_iter 1\nprint_level 8\noutput_file spy.txt\nbound_relax_factor 0.1\nmu_strategy monotone\n"
        "print_options_documentation yes\n",
        f);
    fclose(f);
    /* Whatever is printed on either stream lands in a file; it must stay empty. */
    fflush(stdout);
    fflush(stderr);
    const int out = dup(1), err = dup(2), spy = open("printed", O_CREAT | O_WRONLY, 0600);
    assert_true(out >= 0 && err >= 0 && spy >= 0);
    dup2(spy, 1);
    dup2(spy, 2);
    morph_nlp_result hostile = solve_chain(&c, 20, false);
    morph_nlp_result isolated = solve_chain(&c, 20, true);
    fflush(stdout);
    fflush(stderr);
    dup2(out, 1);
    dup2(err, 2);
    close(out);
    close(err);
    close(spy);
    const long printed = file_size("printed"), spied = file_size("spy.txt");
    unlink("ipopt.opt");
    unlink("printed");
    unlink("spy.txt");
    assert_int_equal(chdir(back), 0);
    rmdir(folder);
    assert_int_equal(printed, 0);
    assert_int_equal(spied, -1);
    assert_same(&plain, &hostile);
    assert_same(&plain, &isolated);
    morph_nlp_result_free(&plain);
    morph_nlp_result_free(&hostile);
    morph_nlp_result_free(&isolated);
}

static void repeats_are_bit_identical(void **state) {
    (void)state;
    static chain c;
    morph_nlp_result first = solve_chain(&c, 150, false);
    for (int k = 0; k < 2; k++) {
        morph_nlp_result again = solve_chain(&c, 150, k == 1);
        assert_same(&first, &again);
        morph_nlp_result_free(&again);
    }
    morph_nlp_result_free(&first);
}

/* Large enough for orderings that draw random numbers, which then differ from one solve to the next within a
 * process. A few iterations show it. */
static void large_repeats_are_bit_identical(void **state) {
    (void)state;
    grid g;
    morph_block blocks[2];
    assert_true(grid_init(&g, 32));
    grid_blocks(&g, blocks);
    morph_nlp_options o = morph_nlp_defaults();
    o.max_iterations = 3;
    morph_nlp_result r[2] = {{0}};
    for (int k = 0; k < 2; k++) {
        morph_nlp *nlp = create(3 * g.points, g.x0, NULL, NULL, blocks, 2);
        assert_int_equal(morph_nlp_solve(nlp, g.x0, &o, &r[k]), MORPH_OK);
        assert_int_equal(r[k].iterations, 3);
        morph_nlp_destroy(nlp);
        if (k > 0) assert_same(&r[0], &r[k]);
    }
    for (int k = 0; k < 2; k++)
        morph_nlp_result_free(&r[k]);
    grid_free(&g);
}

/* ------------------------------------------------------------------ numbers */

static const double infeasible_start[3] = {-1, -1, -1};

static morph_status solve_small(small *s, const double *x0, morph_nlp_result *r) {
    morph_nlp *nlp = create(3, x0, NULL, NULL, s->blocks, 2);
    const morph_status status = morph_nlp_solve(nlp, x0, NULL, r);
    morph_nlp_destroy(nlp);
    return status;
}

static void nan_in_derivatives(void **state) {
    (void)state;
    for (int feasible = 0; feasible < 2; feasible++) {
        small s;
        small_init(&s);
        s.rows.nan_walk = 2; /* the one at create is the first */
        morph_nlp_result r = {0};
        const morph_status status = solve_small(&s, feasible ? feasible_start : infeasible_start, &r);
        if (!feasible) {
            assert_int_equal(status, MORPH_ERR_NONFINITE);
            assert_null(r.x);
            continue;
        }
        /* The feasible start is kept, with values of its own and not Ipopt's zeros. */
        assert_int_equal(status, MORPH_OK);
        assert_int_equal(r.outcome, MORPH_FEASIBLE);
        assert_int_equal(r.solver_code, -13);
        assert_memory_equal(r.x, feasible_start, sizeof feasible_start);
        assert_near(r.objective, 5 + 8 + 9 + 25, 1e-12);
        assert_true(r.violation == 0);
        for (int i = 0; i < 3; i++)
            assert_true(isfinite(r.lower_multiplier[i]) && isfinite(r.upper_multiplier[i]));
        morph_nlp_result_free(&r);
    }
}

/* Values that are NaN from some evaluation on: never a crash, never a NaN handed back, never "optimal" for a
 * point that is not. */
static void nan_in_values(void **state) {
    (void)state;
    for (int at = 2; at <= 9; at++)
        for (int which = 0; which < 2; which++) {
            small s;
            small_init(&s);
            (which ? &s.rows : &s.cost)->nan_value = at;
            morph_nlp_result r = {0};
            const morph_status status = solve_small(&s, feasible_start, &r);
            assert_true(status == MORPH_OK || status == MORPH_ERR_NONFINITE);
            if (status != MORPH_OK) assert_null(r.x);
            if (status == MORPH_OK) {
                assert_true(isfinite(r.objective) && r.violation <= 1e-7);
                assert_true(isfinite(r.x[0]) && isfinite(r.x[1]) && isfinite(r.x[2]));
            }
            morph_nlp_result_free(&r);
        }
}

/* A logarithm that a full step would leave: Ipopt hears "no" and shortens the step. */
static morph_status log_value(void *data, const double *x, double *f) {
    (void)data;
    f[0] = x[0] > 0 ? x[0] - log(x[0]) : NAN;
    return MORPH_OK;
}

static morph_status log_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    (void)data;
    morph_sink_jacobian(s, 0, 0, 1 - 1 / x[0]);
    morph_sink_hessian(s, 0, 0, weight[0] / (x[0] * x[0]));
    return MORPH_OK;
}

static void nan_outside_a_domain(void **state) {
    (void)state;
    const double x0 = 5;
    const morph_block block = {.name = "log", .unknowns = 1, .value = log_value, .walk = log_walk};
    morph_nlp *nlp = create(1, &x0, NULL, NULL, &block, 1);
    morph_nlp_result r = {0};
    assert_int_equal(morph_nlp_solve(nlp, &x0, NULL, &r), MORPH_OK);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_near(r.x[0], 1, 1e-6);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

static void failing_block(void **state) {
    (void)state;
    static const morph_status fails[] = {MORPH_ERR_BACKEND, MORPH_ERR_NOMEM, MORPH_ERR_INTERNAL};
    for (size_t k = 0; k < sizeof fails / sizeof *fails; k++) {
        small s;
        small_init(&s);
        s.rows.nan_value = 4;
        s.rows.fail = fails[k];
        morph_nlp_result r = {0};
        assert_int_equal(solve_small(&s, feasible_start, &r), fails[k]);
        assert_null(r.x);
    }
}

/* ------------------------------------------------------------------ bounds are kept */

/* x = 1 is the best within x >= 1, and no solution may lie below it, not by 1e-8 either. */
static void bounds_are_not_relaxed(void **state) {
    (void)state;
    quadratic cost = {.unknowns = 2, .a = {{1, 1}}}, rows = {.rows = 1, .unknowns = 2, .a = {{1, 2}}};
    const double x0[2] = {3, 3}, lower[2] = {1, -INFINITY}, least = 3, most = INFINITY;
    const morph_block blocks[2] = {quadratic_block(&cost, NULL, NULL), quadratic_block(&rows, &least, &most)};
    morph_nlp *nlp = create(2, x0, lower, NULL, blocks, 2);
    morph_nlp_result r = {0};
    assert_int_equal(morph_nlp_solve(nlp, x0, NULL, &r), MORPH_OK);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_true(r.x[0] >= 1 && r.x[0] < 1 + 1e-6);
    assert_true(r.x[0] + 2 * r.x[1] >= 3 - 1e-9);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

/* A row in units of 1e-6 and an objective of 1e6: scaling by gradients would call a violation of the row's
 * whole range small. */
static void scaling_hides_nothing(void **state) {
    (void)state;
    quadratic cost = {.unknowns = 1, .a = {{1e6}}}, rows = {.rows = 1, .unknowns = 1, .a = {{1e4}}};
    const double x0 = 7, least = 2e4, most = INFINITY;
    const morph_block blocks[2] = {quadratic_block(&cost, NULL, NULL), quadratic_block(&rows, &least, &most)};
    morph_nlp *nlp = create(1, &x0, NULL, NULL, blocks, 2);
    morph_nlp_result r = {0};
    assert_int_equal(morph_nlp_solve(nlp, &x0, NULL, &r), MORPH_OK);
    assert_true(1e4 * r.x[0] >= 2e4 - 1e-7);
    assert_near(r.violation, fmax(0, 2e4 - 1e4 * r.x[0]), 1e-15);
    assert_near(r.x[0], 2, 1e-9);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

/* ------------------------------------------------------------------ stops and limits */

/* The least objective among the feasible points ever evaluated. */
static double best_seen;
static small *watched;

static morph_status watched_rows(void *data, const double *x, double *f) {
    const morph_status status = quadratic_value(data, x, f);
    double objective;
    quadratic copy = watched->cost;
    quadratic_value(&copy, x, &objective);
    if (f[0] >= 1 - 1e-7) best_seen = fmin(best_seen, objective);
    return status;
}

static void stop_keeps_the_best_point(void **state) {
    (void)state;
    for (int stop_at = 1; stop_at <= 4; stop_at++) {
        small s;
        small_init(&s);
        s.blocks[1].value = watched_rows;
        watched = &s;
        watch w = {.stop_at = stop_at};
        const morph_control control = {watch_stop, watch_progress, watch_log, &w};
        morph_nlp_options o = morph_nlp_defaults();
        o.control = &control;
        best_seen = INFINITY;
        morph_nlp *nlp = create(3, feasible_start, NULL, NULL, s.blocks, 2);
        morph_nlp_result r = {0};
        assert_int_equal(morph_nlp_solve(nlp, feasible_start, &o, &r), MORPH_OK);
        assert_int_equal(r.outcome, MORPH_FEASIBLE);
        assert_string_equal(r.solver_text, "stopped by the caller");
        assert_int_equal(w.asked, stop_at);
        assert_int_equal(r.iterations, stop_at - 1);
        assert_true(r.violation <= 1e-7 && r.objective <= 47);
        assert_near(r.objective, best_seen, 1e-6);
        assert_true(w.progress == stop_at && w.lines >= 1);
        morph_nlp_result_free(&r);
        morph_nlp_destroy(nlp);
    }
}

/* minimise x + 2 y + 3 z within the unit ball, from inside: Newton steps leave the ball and come back, so at
 * some stops the last iterate is outside and only a point kept earlier is feasible. */
static morph_status ball_rows(void *data, const double *x, double *f) {
    const morph_status status = quadratic_value(data, x, f);
    if (f[0] <= 1 + 1e-7) best_seen = fmin(best_seen, x[0] + 2 * x[1] + 3 * x[2]);
    return status;
}

static void stop_outside_returns_the_point_inside(void **state) {
    (void)state;
    const double lower = -INFINITY, upper = 1, x0[3] = {0.1, 0.2, -0.1};
    for (int stop_at = 1; stop_at <= 8; stop_at++) {
        quadratic cost = {.unknowns = 3, .a = {{1, 2, 3}}}, rows = {.rows = 1, .unknowns = 3, .b = {2}};
        morph_block blocks[2] = {quadratic_block(&cost, NULL, NULL), quadratic_block(&rows, &lower, &upper)};
        blocks[1].value = ball_rows;
        best_seen = INFINITY;
        morph_nlp *nlp = create(3, x0, NULL, NULL, blocks, 2);
        watch w = {.stop_at = stop_at};
        const morph_control control = {.stop = watch_stop, .user = &w};
        morph_nlp_options o = morph_nlp_defaults();
        o.control = &control;
        morph_nlp_result r = {0};
        assert_int_equal(morph_nlp_solve(nlp, x0, &o, &r), MORPH_OK);
        assert_true(r.outcome == MORPH_FEASIBLE || r.outcome == MORPH_OPTIMAL);
        assert_true(r.x[0] * r.x[0] + r.x[1] * r.x[1] + r.x[2] * r.x[2] <= 1 + 1e-7);
        /* Up to what the violation tolerance can buy. */
        assert_near(r.objective, best_seen, 2e-6);
        morph_nlp_result_free(&r);
        morph_nlp_destroy(nlp);
    }
}

static void wall_limit(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 40, blocks);
    morph_nlp *nlp = create(82, c.x0, c.lower, c.upper, blocks, 2);
    c.seconds_a_value = 0.03;
    morph_nlp_options o = morph_nlp_defaults();
    o.max_seconds = 0.2;
    morph_nlp_result r = {0};
    assert_int_equal(morph_nlp_solve(nlp, c.x0, &o, &r), MORPH_OK);
    assert_string_equal(r.solver_text, "wall limit");
    assert_int_equal(r.outcome, MORPH_STOPPED);
    assert_true(r.seconds >= 0.2 && r.seconds < 2); /* one iteration late; generous for a loaded machine */
    morph_nlp_destroy(nlp);
    morph_nlp_result_free(&r);
}

int main(void) {
    morph_blas_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(option_file_changes_nothing),
        cmocka_unit_test(repeats_are_bit_identical),
        cmocka_unit_test(large_repeats_are_bit_identical),
        cmocka_unit_test(nan_in_derivatives),
        cmocka_unit_test(nan_in_values),
        cmocka_unit_test(nan_outside_a_domain),
        cmocka_unit_test(failing_block),
        cmocka_unit_test(bounds_are_not_relaxed),
        cmocka_unit_test(scaling_hides_nothing),
        cmocka_unit_test(stop_keeps_the_best_point),
        cmocka_unit_test(stop_outside_returns_the_point_inside),
        cmocka_unit_test(wall_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
