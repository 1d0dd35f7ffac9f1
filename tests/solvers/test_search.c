/* Searches within bounds: minima that are known, and everything that the library does wrong. */
#include "solvers/search.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { METHODS = MORPH_SEARCH_LBFGS + 1 };

/* (1 - x)^2 + 10 (y - x^2)^2 + (w - 3)^2: least 0 at (1, 1, 3). */
typedef struct valley {
    int calls, fail_from, fail_each; /* 0: never */
    double fail_value;
    morph_status fail_status;
    double turn; /* of the gradient: 1 right */
    double lowest, highest;
    int stop_after; /* calls; 0: never */
} valley;

static morph_status valley_value(void *data, const double *x, double *f, double *g) {
    valley *v = data;
    v->calls++;
    for (int i = 0; i < 3; i++) {
        v->lowest = fmin(v->lowest, x[i]);
        v->highest = fmax(v->highest, x[i]);
    }
    if ((v->fail_from && v->calls >= v->fail_from) || (v->fail_each && v->calls % v->fail_each == 0)) {
        *f = v->fail_value;
        return v->fail_status;
    }
    const double a = 1.0 - x[0], b = x[1] - x[0] * x[0], c = x[2] - 3.0;
    *f = a * a + 10.0 * b * b + c * c;
    if (g) {
        g[0] = v->turn * (-2.0 * a - 40.0 * b * x[0]);
        g[1] = v->turn * 20.0 * b;
        g[2] = v->turn * 2.0 * c;
    }
    return MORPH_OK;
}

static const double low[3] = {-2.0, -2.0, -1.0}, high[3] = {2.0, 2.0, 4.0}, begin[3] = {-0.5, 1.5, 0.0};

static morph_search_problem problem_of(valley *v) {
    return (morph_search_problem){
        .unknowns = 3, .lower = low, .upper = high, .data = v, .value = valley_value};
}

static morph_search_options fine(morph_search_method method) {
    morph_search_options o = morph_search_defaults(method);
    o.max_evaluations = 3000;
    o.step_least = 1e-9;
    o.gain_least = 0.0;
    return o;
}

static void every_method_finds_the_minimum(void **state) {
    (void)state;
    for (int m = 0; m < METHODS; m++) {
        valley v = {.turn = 1.0, .lowest = INFINITY, .highest = -INFINITY};
        const morph_search_problem p = problem_of(&v);
        const morph_search_options o = fine((morph_search_method)m);
        morph_search_result r;
        assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
        assert_true(r.end == MORPH_SEARCH_CONVERGED || r.end == MORPH_SEARCH_SPENT);
        /* The simplices crawl along the valley; the others are there to rounding of their steps. */
        assert_true(r.value < 1e-4);
        assert_true(fabs(r.x[0] - 1.0) < 0.02 && fabs(r.x[1] - 1.0) < 0.03 && fabs(r.x[2] - 3.0) < 0.02);
        assert_true(v.lowest >= -2.0 && v.highest <= 4.0);
        assert_int_equal(r.evaluations, v.calls);
        assert_int_equal(r.failures, 0);
        const bool asks = morph_search_asks_gradient((morph_search_method)m);
        assert_true(asks ? r.gradients > 0 && r.slope < 0.1 : r.gradients == 0 && isnan(r.slope));
        morph_search_result_free(&r);
    }
}

/* The minimum without bounds lies outside: it is at x = 0.5 on the edge, w held at 1. */
static void bounds_hold(void **state) {
    (void)state;
    const double lo[3] = {-2.0, -2.0, 1.0}, hi[3] = {0.5, 2.0, 1.0}, far[3] = {9.0, -9.0, 0.0};
    for (int m = 0; m < METHODS; m++) {
        valley v = {.turn = 1.0, .lowest = INFINITY, .highest = -INFINITY};
        morph_search_problem p = problem_of(&v);
        p.lower = lo;
        p.upper = hi;
        const morph_search_options o = fine((morph_search_method)m);
        morph_search_result r;
        assert_int_equal(morph_search(&p, far, &o, &r), MORPH_OK);
        assert_true(v.lowest >= -2.0 && v.highest <= 2.0);
        assert_true(r.value < 4.25 + 1e-3); /* (1 - 0.5)^2 + 0 + 2^2 */
        assert_true(r.x[0] <= 0.5 && r.x[0] > 0.49 && r.x[2] == 1.0);
        morph_search_result_free(&r);
    }
}

static void all_held(void **state) {
    (void)state;
    valley v = {.turn = 1.0};
    morph_search_problem p = problem_of(&v);
    p.lower = p.upper = begin;
    const morph_search_options o = fine(MORPH_SEARCH_BOBYQA);
    morph_search_result r;
    assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
    assert_int_equal(r.end, MORPH_SEARCH_CONVERGED);
    assert_int_equal(r.evaluations, 1);
    assert_true(r.value > 1.0);
    morph_search_result_free(&r);
}

/* The library reports success with NaN as its value; and a model spoilt by one bad point goes astray. */
static void points_that_fail(void **state) {
    (void)state;
    const double values[3] = {NAN, INFINITY, 1.0};
    const morph_status statuses[3] = {MORPH_OK, MORPH_OK, MORPH_ERR_NONFINITE};
    for (int m = 0; m < METHODS; m++)
        for (int k = 0; k < 3; k++) {
            valley v = {.turn = 1.0, .fail_each = 7, .fail_value = values[k], .fail_status = statuses[k]};
            const morph_search_problem p = problem_of(&v);
            const morph_search_options o = fine((morph_search_method)m);
            morph_search_result r;
            assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
            assert_int_equal(r.failures, v.calls / 7);
            assert_true(isfinite(r.value) && r.value < r.start);
            morph_search_result_free(&r);
            /* From the second on all fail: the start is what remains. */
            v = (valley){.turn = 1.0, .fail_from = 2, .fail_value = values[k], .fail_status = statuses[k]};
            assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
            assert_true(r.value == r.start);
            for (int i = 0; i < 3; i++) /* by way of the unit box */
                assert_true(fabs(r.x[i] - begin[i]) < 1e-14);
            assert_int_equal(r.failures, r.evaluations - 1);
            morph_search_result_free(&r);
            v = (valley){.turn = 1.0, .fail_from = 1, .fail_value = values[k], .fail_status = statuses[k]};
            assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
            assert_int_equal(r.end, MORPH_SEARCH_NO_START);
            assert_int_equal(v.calls, 1);
            assert_true(isnan(r.value));
            morph_search_result_free(&r);
        }
}

static void failures_of_ours_end_it(void **state) {
    (void)state;
    for (int m = 0; m < METHODS; m++) {
        valley v = {.turn = 1.0, .fail_from = 3, .fail_status = MORPH_ERR_NOMEM};
        const morph_search_problem p = problem_of(&v);
        const morph_search_options o = fine((morph_search_method)m);
        morph_search_result r;
        assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_ERR_NOMEM);
        assert_int_equal(v.calls, 3);
        assert_null(r.x);
    }
}

/* SLSQP and MMA say that they succeeded. */
static void wrong_gradient_is_told(void **state) {
    (void)state;
    for (int m = MORPH_SEARCH_SLSQP; m < METHODS; m++) {
        valley v = {.turn = -1.0};
        const morph_search_problem p = problem_of(&v);
        morph_search_options o = morph_search_defaults((morph_search_method)m);
        const double near[3] = {0.9, 0.8, 2.9}; /* uphill there is no gain */
        morph_search_result r;
        o.max_evaluations = 300;
        assert_int_equal(morph_search(&p, near, &o, &r), MORPH_OK);
        assert_int_not_equal(r.end, MORPH_SEARCH_CONVERGED);
        morph_search_result_free(&r);
    }
}

static void evaluations_are_counted(void **state) {
    (void)state;
    for (int m = 0; m < METHODS; m++)
        for (int most = 1; most < 12; most += 5) {
            valley v = {.turn = 1.0};
            const morph_search_problem p = problem_of(&v);
            morph_search_options o = fine((morph_search_method)m);
            morph_search_result r;
            o.max_evaluations = most;
            assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
            assert_int_equal(r.end, MORPH_SEARCH_SPENT);
            assert_true(v.calls <= most && v.calls == r.evaluations);
            assert_true(r.value <= r.start);
            morph_search_result_free(&r);
        }
}

static morph_status slow_value(void *data, const double *x, double *f, double *g) {
    const double until = morph_seconds() + 0.005;
    while (morph_seconds() < until)
        ;
    return valley_value(data, x, f, g);
}

static void time_is_limited(void **state) {
    (void)state;
    for (int m = 0; m < METHODS; m++) {
        valley v = {.turn = 1.0};
        morph_search_problem p = problem_of(&v);
        morph_search_options o = fine((morph_search_method)m);
        morph_search_result r;
        p.value = slow_value;
        o.max_seconds = 0.03;
        assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
        assert_int_equal(r.end, MORPH_SEARCH_SPENT);
        assert_true(v.calls <= 7);
        morph_search_result_free(&r);
    }
}

static int stop_at(void *user) {
    const valley *v = user;
    return v->stop_after && v->calls >= v->stop_after;
}

static void stop_keeps_the_best(void **state) {
    (void)state;
    for (int m = 0; m < METHODS; m++)
        for (int by_status = 0; by_status < 2; by_status++) {
            valley v = {.turn = 1.0, .stop_after = by_status ? 0 : 5};
            if (by_status) {
                v.fail_from = 6;
                v.fail_status = MORPH_ERR_STOPPED;
            }
            const morph_control control = {.stop = stop_at, .user = &v};
            const morph_search_problem p = problem_of(&v);
            morph_search_options o = fine((morph_search_method)m);
            morph_search_result r;
            o.control = &control;
            assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
            assert_int_equal(r.end, MORPH_SEARCH_HALTED);
            assert_int_equal(v.calls, by_status ? 6 : 5);
            assert_true(r.value <= r.start && isfinite(r.value));
            morph_search_result_free(&r);
        }
}

static void same_bits_twice(void **state) {
    (void)state;
    for (int m = 0; m < METHODS; m++) {
        valley v = {.turn = 1.0};
        const morph_search_problem p = problem_of(&v);
        const morph_search_options o = morph_search_defaults((morph_search_method)m);
        morph_search_result r, s;
        assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_OK);
        assert_int_equal(morph_search(&p, begin, &o, &s), MORPH_OK);
        assert_int_equal(r.evaluations, s.evaluations);
        assert_memory_equal(r.x, s.x, 3 * sizeof *r.x);
        morph_search_result_free(&r);
        morph_search_result_free(&s);
    }
}

static void bad_input_is_refused(void **state) {
    (void)state;
    valley v = {.turn = 1.0};
    const morph_search_problem good = problem_of(&v);
    const morph_search_options o = morph_search_defaults(MORPH_SEARCH_SLSQP);
    const double nan3[3] = {0.0, NAN, 0.0}, inf3[3] = {1.0, INFINITY, 1.0};
    morph_search_result r;
    morph_search_problem p = good;
    morph_search_options bad = o;
    assert_int_equal(morph_search(&good, nan3, &o, &r), MORPH_ERR_INPUT);
    p.upper = inf3;
    assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_ERR_INPUT);
    p.upper = low;
    p.lower = high;
    assert_int_equal(morph_search(&p, begin, &o, &r), MORPH_ERR_INPUT);
    bad.max_evaluations = 0;
    assert_int_equal(morph_search(&good, begin, &bad, &r), MORPH_ERR_INPUT);
    bad = o;
    bad.max_seconds = NAN;
    assert_int_equal(morph_search(&good, begin, &bad, &r), MORPH_ERR_INPUT);
    bad = o;
    bad.step = 0.0;
    assert_int_equal(morph_search(&good, begin, &bad, &r), MORPH_ERR_INPUT);
    assert_int_equal(v.calls, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_method_finds_the_minimum),
        cmocka_unit_test(bounds_hold),
        cmocka_unit_test(all_held),
        cmocka_unit_test(points_that_fail),
        cmocka_unit_test(failures_of_ours_end_it),
        cmocka_unit_test(wrong_gradient_is_told),
        cmocka_unit_test(evaluations_are_counted),
        cmocka_unit_test(time_is_limited),
        cmocka_unit_test(stop_keeps_the_best),
        cmocka_unit_test(same_bits_twice),
        cmocka_unit_test(bad_input_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
