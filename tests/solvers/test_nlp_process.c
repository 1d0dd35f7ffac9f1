/* The solver among processes and threads: a process that dies inside it, two solves at once. */
#include "test_nlp_solving.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

/* ------------------------------------------------------------------ the child process */

typedef enum death { SEGFAULT, ABORT, EXIT_0, EXIT_1, HANG, NO_MEMORY } death;

typedef struct mortal {
    chain chain;
    death how;
    int at;
    pid_t parent;
} mortal;

static morph_status mortal_length(void *data, const double *x, double *f) {
    mortal *m = data;
    if (m->chain.values >= m->at && getpid() != m->parent) {
        struct rlimit none = {0, 0};
        switch (m->how) {
        case SEGFAULT:
            setrlimit(RLIMIT_CORE, &none);
            signal(SIGSEGV, SIG_DFL);
            raise(SIGSEGV);
            break;
        case ABORT:
            setrlimit(RLIMIT_CORE, &none);
            abort();
        case EXIT_0:
            _exit(0);
        case EXIT_1:
            _exit(1);
        case HANG:
            sleep(60);
            break;
        case NO_MEMORY:
            none.rlim_cur = none.rlim_max = 1 << 20; /* less than is mapped: nothing more is given */
            setrlimit(RLIMIT_AS, &none);
            break;
        }
    }
    return chain_length(&m->chain, x, f);
}

static morph_status solve_mortal(death how, int at, const morph_control *control, double max_seconds,
                                 morph_nlp_result *r) {
    static mortal m;
    morph_block blocks[2];
    chain_init(&m.chain, CHAIN_MOST, blocks);
    m.how = how;
    m.at = at;
    m.parent = getpid();
    blocks[1].data = &m;
    blocks[1].value = mortal_length;
    blocks[1].walk = chain_length_walk; /* chain is the first member */
    const int n = 2 * CHAIN_MOST + 2;
    morph_nlp *nlp = create(n, m.chain.x0, m.chain.lower, m.chain.upper, blocks, 2);
    morph_nlp_options o = morph_nlp_defaults();
    o.isolated = true;
    o.control = control;
    o.max_seconds = max_seconds;
    const morph_status status = morph_nlp_solve(nlp, m.chain.x0, &o, r);
    morph_nlp_destroy(nlp);
    return status;
}

/* However the process ends inside the solver, the caller lives and hears of it. */
static void death_in_the_solver_is_a_status(void **state) {
    (void)state;
    for (death how = SEGFAULT; how <= EXIT_1; how++)
        for (int at = 1; at <= 5; at += 4) {
            morph_nlp_result r = {0};
            assert_int_equal(solve_mortal(how, at, NULL, 0, &r), MORPH_ERR_BACKEND);
            assert_null(r.x);
        }
}

static void no_memory_in_the_solver_is_a_status(void **state) {
    (void)state;
#if defined(__SANITIZE_ADDRESS__)
    skip(); /* the sanitizer maps terabytes of its own */
#endif
    for (int at = 1; at <= 9; at += 2) {
        morph_nlp_result r = {0};
        const morph_status status = solve_mortal(NO_MEMORY, at, NULL, 0, &r);
        /* The heap may hold enough for what is left to do. */
        assert_true(status == MORPH_OK || status == MORPH_ERR_NOMEM || status == MORPH_ERR_BACKEND);
        morph_nlp_result_free(&r);
    }
}

/* A process that does not come back from one evaluation is ended, and its best point is used. */
static void hanging_solver_is_ended(void **state) {
    (void)state;
    morph_nlp_result r = {0};
    double begin = morph_seconds();
    assert_int_equal(solve_mortal(HANG, 4, NULL, 0.3, &r), MORPH_OK);
    assert_int_equal(r.outcome, MORPH_STOPPED);
    assert_string_equal(r.solver_text, "wall limit");
    assert_true(morph_seconds() - begin < 60 && r.violation < 1);
    morph_nlp_result_free(&r);

    watch w = {.stop_at = 3};
    const morph_control control = {watch_stop, watch_progress, watch_log, &w};
    begin = morph_seconds();
    assert_int_equal(solve_mortal(HANG, 4, &control, 0, &r), MORPH_OK);
    assert_string_equal(r.solver_text, "stopped by the caller");
    assert_true(morph_seconds() - begin < 60);
    morph_nlp_result_free(&r);
}

/* Progress and log of a child arrive here, in this process, on this thread. */
static void isolated_control(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 40, blocks);
    morph_nlp *nlp = create(82, c.x0, c.lower, c.upper, blocks, 2);
    watch w = {0};
    const morph_control control = {watch_stop, watch_progress, watch_log, &w};
    morph_nlp_options o = morph_nlp_defaults();
    o.isolated = true;
    o.control = &control;
    morph_nlp_result r = {0};
    assert_int_equal(morph_nlp_solve(nlp, c.x0, &o, &r), MORPH_OK);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_int_equal(w.progress, r.iterations + 1);
    assert_true(w.lines >= 2);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
}

/* ------------------------------------------------------------------ threads */

typedef struct worker {
    chain chain;
    morph_nlp_result result;
    morph_status status;
    bool isolated;
} worker;

static void *work(void *argument) {
    worker *w = argument;
    morph_block blocks[2];
    chain_init(&w->chain, 40, blocks);
    for (int k = 0; k < 8 && w->status == MORPH_OK; k++) {
        morph_nlp *nlp = NULL;
        w->status =
            morph_nlp_create(82, w->chain.x0, w->chain.lower, w->chain.upper, blocks, 2, NULL, 0, &nlp);
        morph_nlp_options o = morph_nlp_defaults();
        o.isolated = w->isolated && k % 2 == 0;
        if (w->status == MORPH_OK) w->status = morph_nlp_solve(nlp, w->chain.x0, &o, &w->result);
        morph_nlp_destroy(nlp);
    }
    return NULL;
}

static void two_threads_at_once(void **state) {
    (void)state;
    static chain c;
    static worker workers[2];
    morph_nlp_result alone = solve_chain(&c, 40, false);
    pthread_t threads[2];
    workers[1].isolated = true;
    for (int k = 0; k < 2; k++)
        assert_int_equal(pthread_create(&threads[k], NULL, work, &workers[k]), 0);
    for (int k = 0; k < 2; k++)
        assert_int_equal(pthread_join(threads[k], NULL), 0);
    for (int k = 0; k < 2; k++) {
        assert_int_equal(workers[k].status, MORPH_OK);
        assert_same(&alone, &workers[k].result);
        morph_nlp_result_free(&workers[k].result);
    }
    morph_nlp_result_free(&alone);
}

/* A solve that waits for another one can be stopped. Solves from within a stop callback: the turn is taken.
 */
typedef struct nested {
    morph_nlp *nlp;
    const double *x0;
    morph_status status;
    bool done;
} nested;

static int stop_at_once(void *user) {
    (void)user;
    return 1;
}

static void *solve_and_stop(void *argument) {
    nested *n = argument;
    const morph_control control = {.stop = stop_at_once};
    morph_nlp_options o = morph_nlp_defaults();
    o.control = &control;
    morph_nlp_result r = {0};
    n->status = morph_nlp_solve(n->nlp, n->x0, &o, &r);
    morph_nlp_result_free(&r);
    return NULL;
}

static int solve_inside(void *user) {
    nested *n = user;
    pthread_t thread;
    if (n->done || pthread_create(&thread, NULL, solve_and_stop, n) != 0) return 0;
    pthread_join(thread, NULL);
    n->done = true;
    return 0;
}

static void waiting_can_be_stopped(void **state) {
    (void)state;
    small s, other;
    small_init(&s);
    small_init(&other);
    nested n = {create(3, feasible_start, NULL, NULL, other.blocks, 2), feasible_start, MORPH_OK, false};
    const morph_control control = {.stop = solve_inside, .user = &n};
    morph_nlp_options o = morph_nlp_defaults();
    o.control = &control;
    morph_nlp *nlp = create(3, feasible_start, NULL, NULL, s.blocks, 2);
    morph_nlp_result r = {0};
    assert_int_equal(morph_nlp_solve(nlp, feasible_start, &o, &r), MORPH_OK);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    assert_true(n.done);
    assert_int_equal(n.status, MORPH_ERR_STOPPED);
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
    morph_nlp_destroy(n.nlp);
}

int main(void) {
    morph_blas_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(death_in_the_solver_is_a_status),
        cmocka_unit_test(no_memory_in_the_solver_is_a_status),
        cmocka_unit_test(hanging_solver_is_ended),
        cmocka_unit_test(isolated_control),
        cmocka_unit_test(two_threads_at_once),
        cmocka_unit_test(waiting_can_be_stopped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
