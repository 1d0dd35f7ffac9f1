/* Memory: callbacks allocate nothing, and every allocation that fails is survived without a leak.
 * The C library's allocator is wrapped; the sanitizer brings its own, so there the tests are skipped. */
#include "solvers/nlp_internal.h"
#include "test_nlp_problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/refused_memory.h"

static chain c;
static morph_block blocks[2];

static morph_status create(morph_nlp **nlp) {
    return morph_nlp_create(42, c.x0, c.lower, c.upper, blocks, 2, NULL, 0, nlp);
}

static void callbacks_do_not_allocate(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    morph_nlp *nlp;
    assert_int_equal(create(&nlp), MORPH_OK);
    double x[42], multiplier[20], values[500];
    memcpy(x, c.x0, sizeof x);
    for (int r = 0; r < 20; r++)
        multiplier[r] = r;
    assert_true(nlp->hessian.count <= 500);
    const long before = allocations;
    for (int k = 0; k < 10; k++) {
        x[3] += 0.1;
        if (morph_nlp_objective_at(nlp, x) || morph_nlp_rows_at(nlp, x) || morph_nlp_gradient_at(nlp, x) ||
            morph_nlp_jacobian_at(nlp, x) || morph_nlp_hessian_at(nlp, x, 1, multiplier, values))
            fail();
    }
    assert_true(before > 0);
    assert_int_equal(allocations, before);
    morph_nlp_destroy(nlp);
}

static void every_failing_allocation_in_create(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    int failures = 0;
    for (long k = 1;; k++) {
        const long before = live;
        morph_nlp *nlp = NULL;
        countdown = k - 1;
        const morph_status status = create(&nlp);
        const bool reached = was_refused();
        countdown = -1;
        if (status != MORPH_OK) assert_null(nlp);
        morph_nlp_destroy(nlp);
        assert_int_equal(live, before);
        if (!reached) {
            assert_int_equal(status, MORPH_OK);
            break;
        }
        assert_int_equal(status, MORPH_ERR_NOMEM);
        failures++;
    }
    assert_true(failures > 20);
}

static void every_failing_allocation_in_the_checker(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    int failures = 0;
    for (long k = 1;; k++) {
        const long before = live;
        morph_derivative_check out;
        countdown = k - 1;
        const morph_status status = morph_check_derivatives(blocks, 2, c.x0, 42, 1e-5, 1e-7, &out);
        const bool reached = was_refused();
        countdown = -1;
        assert_int_equal(live, before);
        if (!reached) break;
        assert_int_equal(status, MORPH_ERR_NOMEM);
        assert_false(out.passed);
        failures++;
    }
    assert_true(failures > 15);
}

/* Inside Ipopt a refused allocation may end in an exception or in the end of the process; with the solver in
 * a child process each is a status. Every allocation up to the 30th, then ever sparser. */
static void failing_allocations_in_the_solver(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    morph_nlp *nlp;
    assert_int_equal(create(&nlp), MORPH_OK);
    morph_nlp_options o = morph_nlp_defaults();
    o.isolated = true;
    int seen[MORPH_ERR_INTERNAL + 1] = {0};
    for (long k = 1; k < 40000; k += 1 + (k > 30 ? k / 8 : 0)) {
        const long before = live;
        morph_nlp_result r = {0};
        countdown = k - 1;
        const morph_status status = morph_nlp_solve(nlp, c.x0, &o, &r);
        countdown = -1;
        seen[status]++;
        if (status != MORPH_OK) assert_null(r.x);
        assert_true(status == MORPH_OK || status == MORPH_ERR_NOMEM || status == MORPH_ERR_BACKEND);
        morph_nlp_result_free(&r);
        assert_int_equal(live, before);
    }
    print_message("%d solved, %d out of memory, %d ended otherwise\n", seen[MORPH_OK], seen[MORPH_ERR_NOMEM],
                  seen[MORPH_ERR_BACKEND]);
    assert_true(seen[MORPH_ERR_NOMEM] > 0 && seen[MORPH_ERR_BACKEND] > 0);
    morph_nlp_destroy(nlp);
}

int main(void) {
    morph_blas_threads(1);
    chain_init(&c, 20, blocks);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(callbacks_do_not_allocate),
        cmocka_unit_test(every_failing_allocation_in_create),
        cmocka_unit_test(every_failing_allocation_in_the_checker),
        cmocka_unit_test(failing_allocations_in_the_solver),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
