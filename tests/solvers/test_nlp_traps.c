/* What is known to go wrong with Ipopt and MUMPS, provoked: option files, numbers that are not finite, stops
 * and limits, repeats, threads, a process that dies inside the solver. */
#include "test_nlp_grid.h"
#include "test_nlp_problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static morph_nlp *create(int unknowns, const double *x0, const double *lower, const double *upper,
                         const morph_block *blocks, int count) {
    char message[256];
    morph_nlp *nlp = NULL;
    if (morph_nlp_create(unknowns, x0, lower, upper, blocks, count, message, sizeof message, &nlp) !=
        MORPH_OK)
        fail_msg("create: %s", message);
    return nlp;
}

/* The same bits in everything that does not measure time. */
static void assert_same(const morph_nlp_result *a, const morph_nlp_result *b) {
    assert_int_equal(a->outcome, b->outcome);
    assert_int_equal(a->iterations, b->iterations);
    assert_int_equal(a->evaluations, b->evaluations);
    const size_t n = (size_t)a->unknowns * sizeof(double), m = (size_t)a->rows * sizeof(double);
    assert_memory_equal(a->x, b->x, n);
    assert_memory_equal(a->row_multiplier, b->row_multiplier, m);
    assert_memory_equal(a->lower_multiplier, b->lower_multiplier, n);
    assert_memory_equal(a->upper_multiplier, b->upper_multiplier, n);
    assert_memory_equal(&a->objective, &b->objective, sizeof a->objective);
}

static morph_nlp_result solve_chain(chain *c, int links, bool isolated) {
    morph_block blocks[2];
    chain_init(c, links, blocks);
    morph_nlp *nlp = create(2 * links + 2, c->x0, c->lower, c->upper, blocks, 2);
    morph_nlp_options o = morph_nlp_defaults();
    o.isolated = isolated;
    morph_nlp_result r = {0};
    const morph_status status = morph_nlp_solve(nlp, c->x0, &o, &r);
    morph_nlp_destroy(nlp);
    assert_int_equal(status, MORPH_OK);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    return r;
}

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
    o.max_iterations = 4;
    morph_nlp_result r[3] = {{0}};
    for (int k = 0; k < 3; k++) {
        morph_nlp *nlp = create(3 * g.points, g.x0, NULL, NULL, blocks, 2);
        assert_int_equal(morph_nlp_solve(nlp, g.x0, &o, &r[k]), MORPH_OK);
        assert_int_equal(r[k].iterations, 4);
        morph_nlp_destroy(nlp);
        if (k > 0) assert_same(&r[0], &r[k]);
    }
    for (int k = 0; k < 3; k++)
        morph_nlp_result_free(&r[k]);
    grid_free(&g);
}

/* ------------------------------------------------------------------ numbers */

/* minimise sum x + |x|^2 / 2 with x0 + x1 + x2 >= 1 from a feasible or an infeasible start. */
typedef struct small {
    quadratic cost, rows;
    double lower, upper;
    morph_block blocks[2];
} small;

static void small_init(small *s) {
    *s = (small){.cost = {.unknowns = 3, .a = {{1, 2, 3}}, .b = {1}},
                 .rows = {.rows = 1, .unknowns = 3, .a = {{1, 1, 1}}, .b = {0.25}},
                 .lower = 1,
                 .upper = INFINITY};
    s->blocks[0] = quadratic_block(&s->cost, NULL, NULL);
    s->blocks[1] = quadratic_block(&s->rows, &s->lower, &s->upper);
}

static const double feasible_start[3] = {5, 4, 3}, infeasible_start[3] = {-1, -1, -1};

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

typedef struct watch {
    int asked, stop_at;
    int progress, lines;
    double last_fraction;
} watch;

static int watch_stop(void *user) {
    watch *w = user;
    return ++w->asked >= w->stop_at && w->stop_at > 0;
}

static void watch_progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    w->progress += strcmp(stage, "solve") == 0;
    w->last_fraction = fraction;
}

static void watch_log(void *user, const char *line) {
    ((watch *)user)->lines += strchr(line, '\n') == NULL;
}

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
    assert_true(morph_seconds() - begin < 5 && r.violation < 1);
    morph_nlp_result_free(&r);

    watch w = {.stop_at = 3};
    const morph_control control = {watch_stop, watch_progress, watch_log, &w};
    begin = morph_seconds();
    assert_int_equal(solve_mortal(HANG, 4, &control, 0, &r), MORPH_OK);
    assert_string_equal(r.solver_text, "stopped by the caller");
    assert_true(morph_seconds() - begin < 5);
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
        cmocka_unit_test(wall_limit),
        cmocka_unit_test(death_in_the_solver_is_a_status),
        cmocka_unit_test(no_memory_in_the_solver_is_a_status),
        cmocka_unit_test(hanging_solver_is_ended),
        cmocka_unit_test(isolated_control),
        cmocka_unit_test(two_threads_at_once),
        cmocka_unit_test(waiting_can_be_stopped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
