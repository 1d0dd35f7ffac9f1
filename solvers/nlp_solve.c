/* A solve from the outside: options, the start, who runs it, and the conclusion drawn from a recomputed
 * point. */
#include "solvers/nlp_internal.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

/* Ipopt with MUMPS is not re-entrant: Fortran common data crashed two threads solving at once. The one
 * mutable global of the library, because what it guards is global to the process. */
static pthread_mutex_t one_solve = PTHREAD_MUTEX_INITIALIZER;

const char *morph_outcome_text(morph_outcome outcome) {
    switch (outcome) {
    case MORPH_OPTIMAL:
        return "optimal";
    case MORPH_FEASIBLE:
        return "feasible";
    case MORPH_INFEASIBLE:
        return "infeasible";
    case MORPH_STOPPED:
        return "stopped";
    }
    return "unknown";
}

morph_nlp_options morph_nlp_defaults(void) {
    return (morph_nlp_options){
        /* Rows are of order 1: 1e-7 is 1e-7 of a spacing, a tenth of the finest margin that a check asks for.
         */
        .tolerance = 1e-7,
        .violation_tolerance = 1e-7,
        .max_iterations = 300,
        .adaptive_mu = true,
    };
}

morph_status morph_nlp_result_create(const double *x, int unknowns, int rows, morph_nlp_result *out) {
    const size_t n = (size_t)unknowns;
    morph_nlp_result r = {.unknowns = unknowns, .rows = rows, .worst_row = -1};
    r.x = morph_alloc(n, sizeof(double));
    r.row_multiplier = morph_alloc((size_t)rows, sizeof(double));
    r.lower_multiplier = morph_alloc(n, sizeof(double));
    r.upper_multiplier = morph_alloc(n, sizeof(double));
    *out = (morph_nlp_result){0};
    if (!r.x || !r.row_multiplier || !r.lower_multiplier || !r.upper_multiplier) {
        morph_nlp_result_free(&r);
        return MORPH_ERR_NOMEM;
    }
    memcpy(r.x, x, n * sizeof *x);
    *out = r;
    return MORPH_OK;
}

void morph_nlp_result_free(morph_nlp_result *result) {
    if (!result) return;
    free(result->x);
    free(result->row_multiplier);
    free(result->lower_multiplier);
    free(result->upper_multiplier);
    *result = (morph_nlp_result){0};
}

/* ------------------------------------------------------------------ the run's memory */

/* best_x twice, x, lower and upper multipliers: unknowns each; row multipliers: rows. */
static size_t run_values(int unknowns, int rows) {
    return 5 * (size_t)unknowns + (size_t)rows;
}

size_t morph_run_bytes(int unknowns, int rows) {
    return sizeof(morph_run) + run_values(unknowns, rows) * sizeof(double);
}

void morph_run_layout(morph_run *run, int unknowns, int rows) {
    const size_t n = (size_t)unknowns;
    run->unknowns = unknowns;
    run->rows = rows;
    run->best_x[0] = 0;
    run->best_x[1] = n;
    run->x = 2 * n;
    run->lower_multiplier = 3 * n;
    run->upper_multiplier = 4 * n;
    run->row_multiplier = 5 * n;
    run->best_current = -1;
    run->code = -199; /* until the solver says better */
}

static morph_status start_run(const morph_nlp *nlp, const double *x0, const morph_nlp_options *o,
                              const morph_nlp_result *from, morph_run *run) {
    const size_t n = (size_t)nlp->unknowns, m = (size_t)nlp->rows, size = sizeof(double);
    morph_run_layout(run, nlp->unknowns, nlp->rows);
    const double *x = o->warm ? from->x : x0;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i])) return MORPH_ERR_INPUT;
    memcpy(morph_run_array(run, run->x), x, n * size);
    if (!o->warm) return MORPH_OK;
    memcpy(morph_run_array(run, run->row_multiplier), from->row_multiplier, m * size);
    memcpy(morph_run_array(run, run->lower_multiplier), from->lower_multiplier, n * size);
    memcpy(morph_run_array(run, run->upper_multiplier), from->upper_multiplier, n * size);
    return MORPH_OK;
}

/* ------------------------------------------------------------------ conclusion */

/* A point with what was recomputed of it. */
typedef struct candidate {
    const double *x; /* NULL: none */
    double objective, violation;
    bool feasible;
} candidate;

static candidate recompute(morph_nlp *nlp, const double *x, double tolerance) {
    candidate c = {0};
    for (int i = 0; i < nlp->unknowns; i++)
        if (!isfinite(x[i])) return c;
    if (morph_nlp_rows_at(nlp, x) != MORPH_OK || morph_nlp_objective_at(nlp, x) != MORPH_OK) return c;
    c.x = x;
    c.objective = nlp->objective;
    c.violation = morph_nlp_violation(nlp, x, nlp->row_value, NULL);
    c.feasible = c.violation <= tolerance;
    return c;
}

static bool finite_array(const double *v, int n) {
    for (int i = 0; i < n; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

/* How much lower an objective may be without being better: the optimality tolerance, and what a violation v
 * within its tolerance can buy, sum |multiplier| v to first order. */
static double bought(const morph_run *run, const morph_nlp_options *o, double objective) {
    const double *multiplier = run->values + run->row_multiplier;
    double sum = 0;
    for (int r = 0; r < run->rows; r++)
        sum += fabs(multiplier[r]);
    return o->tolerance * fmax(1.0, fabs(objective)) + (isfinite(sum) ? sum : 0) * o->violation_tolerance;
}

/* The last iterate, unless a kept point is feasible where it is not, clearly lower, or less violating. */
static candidate choose(morph_nlp *nlp, const morph_nlp_options *o, morph_run *run, bool *last_chosen) {
    const candidate last = recompute(nlp, morph_run_array(run, run->x), o->violation_tolerance);
    candidate kept = {0};
    if (run->best_current >= 0)
        kept = recompute(nlp, morph_run_array(run, run->best_x[run->best_current]), o->violation_tolerance);
    bool take_last = last.x != NULL;
    if (last.x && kept.x && !(o->mu_target > 0)) {
        if (last.feasible != kept.feasible)
            take_last = last.feasible;
        else if (last.feasible)
            take_last = last.objective <= kept.objective + bought(run, o, last.objective);
        else
            take_last = last.violation <= kept.violation;
    }
    *last_chosen = take_last;
    return take_last ? last : kept;
}

static morph_status copy_arrays(const morph_run *run, const double *x, morph_nlp_result *out) {
    const size_t n = (size_t)run->unknowns, m = (size_t)run->rows, size = sizeof(double);
    out->x = morph_alloc(n, size);
    out->row_multiplier = morph_alloc(m, size);
    out->lower_multiplier = morph_alloc(n, size);
    out->upper_multiplier = morph_alloc(n, size);
    if (!out->x || !out->row_multiplier || !out->lower_multiplier || !out->upper_multiplier)
        return MORPH_ERR_NOMEM;
    memcpy(out->x, x, n * size);
    const double *row = run->values + run->row_multiplier, *lower = run->values + run->lower_multiplier,
                 *upper = run->values + run->upper_multiplier;
    /* After some failures Ipopt leaves NaN: zeros are a usable start, NaN is not. */
    if (!finite_array(row, run->rows) || !finite_array(lower, run->unknowns) ||
        !finite_array(upper, run->unknowns))
        return MORPH_OK;
    memcpy(out->row_multiplier, row, m * size);
    memcpy(out->lower_multiplier, lower, n * size);
    memcpy(out->upper_multiplier, upper, n * size);
    return MORPH_OK;
}

/* The one place where codes become statuses: those that say nothing about the problem. */
static morph_status status_of(const morph_run *run, morph_code_kind kind, bool any_feasible) {
    if (run->status != MORPH_OK) return run->status;
    if (kind == MORPH_CODE_NOMEM) return MORPH_ERR_NOMEM;
    if (kind == MORPH_CODE_FAILED) return MORPH_ERR_BACKEND;
    if (kind == MORPH_CODE_NUMBER && !any_feasible && !run->stopped) return MORPH_ERR_NONFINITE;
    return MORPH_OK;
}

static morph_status conclude(morph_nlp *nlp, const morph_nlp_options *o, morph_run *run,
                             morph_nlp_result *out) {
    const char *text;
    morph_code_kind kind = morph_ipopt_code(run->code, &text);
    if (run->stopped || run->limit) {
        text = run->stopped ? "stopped by the caller" : "wall limit";
        if (kind != MORPH_CODE_SOLVED) kind = MORPH_CODE_LIMIT;
    }
    if (run->fixed) text = "every unknown is fixed";
    bool last_chosen = false;
    candidate best = {0};
    if (run->status == MORPH_OK) best = choose(nlp, o, run, &last_chosen);
    const morph_status status = status_of(run, kind, best.feasible);
    if (status != MORPH_OK) {
        morph_log(o->control, "solver: %s (%s)", text, morph_status_text(status));
        return status;
    }
    if (!best.x) return MORPH_ERR_NONFINITE;
    if (kind == MORPH_CODE_SOLVED && last_chosen && best.feasible)
        out->outcome = MORPH_OPTIMAL;
    else if (best.feasible)
        out->outcome = MORPH_FEASIBLE;
    else
        out->outcome = kind == MORPH_CODE_LIMIT ? MORPH_STOPPED : MORPH_INFEASIBLE;
    out->solver_code = run->code;
    snprintf(out->solver_text, sizeof out->solver_text, "%s", text);
    out->iterations = run->iterations;
    out->evaluations = run->evaluations;
    out->linear_seconds = run->linear_seconds;
    out->callback_seconds = run->callback_seconds;
    out->unknowns = run->unknowns;
    out->rows = run->rows;
    out->objective = best.objective;
    const morph_status rows = morph_nlp_rows_at(nlp, best.x);
    if (rows != MORPH_OK) return rows;
    out->violation = morph_nlp_violation(nlp, best.x, nlp->row_value, &out->worst_row);
    return copy_arrays(run, best.x, out);
}

/* ------------------------------------------------------------------ the solve */

static bool usable_options(const morph_nlp *nlp, const double *x0, const morph_nlp_options *o,
                           const morph_nlp_result *result) {
    if (!(o->tolerance > 0) || !isfinite(o->tolerance) || !(o->violation_tolerance > 0) ||
        !isfinite(o->violation_tolerance) || o->max_iterations < 0 || isnan(o->max_seconds) ||
        isnan(o->mu_init) || isinf(o->mu_init) || isnan(o->mu_target) || isinf(o->mu_target))
        return false;
    if (!o->warm) return x0 != NULL;
    return result->x && result->row_multiplier && result->lower_multiplier && result->upper_multiplier &&
           result->unknowns == nlp->unknowns && result->rows == nlp->rows;
}

/* Waits for the mutex, asking for a stop 20 times a second. */
static bool take_turn(const morph_control *control) {
    for (;;) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += 50000000;
        if (until.tv_nsec >= 1000000000) {
            until.tv_nsec -= 1000000000;
            until.tv_sec++;
        }
        if (pthread_mutex_timedlock(&one_solve, &until) == 0) return true;
        if (morph_stopped(control)) return false;
    }
}

static bool all_fixed(const morph_nlp *nlp) {
    for (int i = 0; i < nlp->unknowns; i++)
        if (nlp->lower[i] < nlp->upper[i]) return false;
    return true;
}

/* Nothing to decide: the only point is the answer, and Ipopt would refuse the problem. */
static void run_fixed(const morph_nlp *nlp, morph_run *run) {
    memcpy(morph_run_array(run, run->x), nlp->lower, (size_t)nlp->unknowns * sizeof *nlp->lower);
    run->code = 0;
    run->fixed = run->finished = true;
}

static morph_status run_one(morph_nlp *nlp, const morph_nlp_options *o, morph_run *run) {
    if (all_fixed(nlp)) {
        run_fixed(nlp, run);
        return MORPH_OK;
    }
    if (!take_turn(o->control)) return MORPH_ERR_STOPPED;
    if (o->isolated)
        morph_run_isolated(nlp, o, run);
    else
        morph_run_ipopt(nlp, o, run);
    pthread_mutex_unlock(&one_solve);
    return MORPH_OK;
}

morph_status morph_nlp_solve(morph_nlp *nlp, const double *x0, const morph_nlp_options *options,
                             morph_nlp_result *result) {
    const morph_nlp_options o = options ? *options : morph_nlp_defaults();
    morph_nlp_result out = {0};
    morph_status status = MORPH_ERR_INPUT;
    const size_t bytes = morph_run_bytes(nlp->unknowns, nlp->rows);
    void *memory = MAP_FAILED;
    const double start = morph_seconds();
    if (!usable_options(nlp, x0, &o, result)) goto done;
    /* Zeroed, and visible to a child process as well. */
    memory = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    status = MORPH_ERR_NOMEM;
    if (memory == MAP_FAILED) goto done;
    morph_run *run = memory;
    status = start_run(nlp, x0, &o, result, run);
    if (status == MORPH_OK) status = run_one(nlp, &o, run);
    if (status == MORPH_OK) status = conclude(nlp, &o, run, &out);
    if (status == MORPH_OK) {
        out.seconds = morph_seconds() - start;
        morph_log(
            o.control, "solver: %s, %d iterations, %d evaluations, objective %.6g, violation %.2e, %.2f s",
            out.solver_text, out.iterations, out.evaluations, out.objective, out.violation, out.seconds);
    }
done:
    if (memory != MAP_FAILED) munmap(memory, bytes);
    morph_nlp_result_free(result);
    if (status == MORPH_OK)
        *result = out;
    else
        morph_nlp_result_free(&out);
    return status;
}
