#include "solvers/search.h"

#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

const char *morph_search_name(morph_search_method method) {
    static const char *const names[] = {"COBYLA", "BOBYQA", "Sbplx", "SLSQP", "MMA", "L-BFGS"};
    return names[method];
}

bool morph_search_asks_gradient(morph_search_method method) {
    return method >= MORPH_SEARCH_SLSQP;
}

const char *morph_search_end_text(morph_search_end end) {
    static const char *const texts[] = {"converged", "evaluations or time spent", "stopped", "stalled",
                                        "the start cannot be evaluated"};
    return texts[end];
}

morph_search_options morph_search_defaults(morph_search_method method) {
    /* A thousandth of the box and of the value: finer than what the models searched with are good for. */
    return (morph_search_options){.method = method,
                                  .max_evaluations = 100,
                                  .max_seconds = 60.0,
                                  .step = 0.25,
                                  .step_least = 1e-3,
                                  .gain_least = 1e-4};
}

void morph_search_result_free(morph_search_result *r) {
    if (!r) return;
    free(r->x);
    *r = (morph_search_result){0};
}

/* One search. Its unknowns are u in [0, 1]: x = lower + u (upper - lower), held ones left out. */
typedef struct searcher {
    const morph_search_problem *problem;
    const morph_search_options *options;
    morph_search_result *out;
    nlopt_opt library;
    int free_count;
    int *free_unknown;
    double *x, *gradient, *best_gradient; /* unknowns */
    double worst;                         /* finite value seen */
    double started;
    bool spent, halted, has_gradient;
    morph_status status; /* of the evaluation that ended the search */
} searcher;

static double width(const searcher *s, int unknown) {
    return s->problem->upper[unknown] - s->problem->lower[unknown];
}

static void end_search(searcher *s) {
    /* Its only failure is a missing object: at the first evaluation, which is ours. */
    nlopt_force_stop(s->library);
}

/* Kept where u, and so x, is inside: the library may leave the box by rounding, SLSQP by more. */
static void place(searcher *s, const double *u) {
    for (int k = 0; k < s->free_count; k++) {
        const int i = s->free_unknown[k];
        const double part = u[k] > 0.0 ? fmin(u[k], 1.0) : 0.0; /* NaN: 0 */
        s->x[i] = part == 1.0 ? s->problem->upper[i] : s->problem->lower[i] + part * width(s, i);
    }
}

static bool finite_all(const double *v, int n) {
    for (int i = 0; i < n; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

/* What the library hears of a point that cannot be evaluated: worse than all others by as much as they
 * differ, so that its models bend away from there but keep their scale. */
static double deterrent(const searcher *s) {
    return s->worst + fmax(s->worst - s->out->value, 0.1 * fabs(s->worst));
}

static void keep_best(searcher *s, double f, bool has_gradient) {
    morph_search_result *out = s->out;
    s->worst = out->evaluations == 1 ? f : fmax(s->worst, f);
    if (out->evaluations == 1) out->start = f;
    if (out->evaluations > 1 && !(f < out->value)) return;
    const size_t n = (size_t)s->problem->unknowns;
    out->value = f;
    memcpy(out->x, s->x, n * sizeof *out->x);
    s->has_gradient = has_gradient;
    if (has_gradient) memcpy(s->best_gradient, s->gradient, n * sizeof *s->gradient);
}

/* The best point again: its value is known, and its gradient, if that was asked. */
static bool recall(const searcher *s, double *gradient) {
    if (s->out->evaluations == 0 || (gradient && !s->has_gradient) ||
        memcmp(s->x, s->out->x, (size_t)s->problem->unknowns * sizeof *s->x) != 0)
        return false;
    for (int k = 0; k < s->free_count && gradient; k++)
        gradient[k] = s->best_gradient[s->free_unknown[k]] * width(s, s->free_unknown[k]);
    return true;
}

static double evaluate(unsigned n, const double *u, double *gradient, void *data) {
    searcher *s = data;
    morph_search_result *out = s->out;
    for (unsigned k = 0; k < n && gradient; k++)
        gradient[k] = 0.0;
    if (s->spent || s->halted || s->status != MORPH_OK) return deterrent(s); /* it asks on regardless */
    if (morph_stopped(s->options->control)) s->halted = true;
    if (out->evaluations >= s->options->max_evaluations ||
        (out->evaluations > 0 && morph_seconds() - s->started > s->options->max_seconds))
        s->spent = true;
    if (s->halted || s->spent) {
        end_search(s);
        return out->evaluations > 0 ? deterrent(s) : 0.0;
    }
    double f = NAN;
    place(s, u);
    if (recall(s, gradient)) return out->value;
    out->evaluations++;
    out->gradients += gradient != NULL;
    const morph_status status = s->problem->value(s->problem->data, s->x, &f, gradient ? s->gradient : NULL);
    const bool usable =
        status == MORPH_OK && isfinite(f) && (!gradient || finite_all(s->gradient, s->problem->unknowns));
    if (usable) {
        keep_best(s, f, gradient != NULL);
        for (unsigned k = 0; k < n && gradient; k++)
            gradient[k] = s->gradient[s->free_unknown[k]] * width(s, s->free_unknown[k]);
        return f;
    }
    if (status == MORPH_ERR_STOPPED)
        s->halted = true;
    else if (status != MORPH_OK && status != MORPH_ERR_NONFINITE && status != MORPH_ERR_BACKEND)
        s->status = status;
    out->failures += !s->halted && s->status == MORPH_OK;
    if (s->halted || s->status != MORPH_OK || out->evaluations == 1) {
        end_search(s);
        return 0.0;
    }
    return deterrent(s);
}

static nlopt_algorithm algorithm_of(morph_search_method method) {
    switch (method) {
    case MORPH_SEARCH_COBYLA:
        return NLOPT_LN_COBYLA;
    case MORPH_SEARCH_BOBYQA:
        return NLOPT_LN_BOBYQA;
    case MORPH_SEARCH_SBPLX:
        return NLOPT_LN_SBPLX;
    case MORPH_SEARCH_SLSQP:
        return NLOPT_LD_SLSQP;
    case MORPH_SEARCH_MMA:
        return NLOPT_LD_MMA;
    case MORPH_SEARCH_LBFGS:
        return NLOPT_LD_LBFGS;
    }
    return NLOPT_NUM_ALGORITHMS;
}

/* Every setter says whether it was heard. Bounds only: BOBYQA and L-BFGS refuse constraints and then go on
 * without them. Both limits always: MMA knows no other end. */
static morph_status configure(searcher *s) {
    const morph_search_options *o = s->options;
    s->library = nlopt_create(algorithm_of(o->method), (unsigned)s->free_count);
    if (!s->library) return MORPH_ERR_NOMEM;
    bool ok = nlopt_set_min_objective(s->library, evaluate, s) == NLOPT_SUCCESS;
    ok = ok && nlopt_set_lower_bounds1(s->library, 0.0) == NLOPT_SUCCESS;
    ok = ok && nlopt_set_upper_bounds1(s->library, 1.0) == NLOPT_SUCCESS;
    ok = ok && nlopt_set_maxeval(s->library, o->max_evaluations) == NLOPT_SUCCESS;
    ok = ok && nlopt_set_maxtime(s->library, o->max_seconds) == NLOPT_SUCCESS;
    ok = ok && nlopt_set_xtol_abs1(s->library, o->step_least) == NLOPT_SUCCESS;
    ok = ok && nlopt_set_ftol_rel(s->library, o->gain_least) == NLOPT_SUCCESS;
    if (!morph_search_asks_gradient(o->method))
        ok = ok && nlopt_set_initial_step1(s->library, o->step) == NLOPT_SUCCESS;
    return ok ? MORPH_OK : MORPH_ERR_BACKEND;
}

/* Largest entry of the gradient by u, without those that press against the box: at a minimum 0. */
static double projected_slope(const searcher *s) {
    double most = 0.0;
    if (!s->has_gradient) return NAN;
    for (int k = 0; k < s->free_count; k++) {
        const int i = s->free_unknown[k];
        const double g = s->best_gradient[i] * width(s, i);
        const bool pressed = (g > 0.0 && s->out->x[i] <= s->problem->lower[i]) ||
                             (g < 0.0 && s->out->x[i] >= s->problem->upper[i]);
        if (!pressed) most = fmax(most, fabs(g));
    }
    return most;
}

/* A gradient that promises a hundredth of the value across the box, and nothing gained. */
static bool stalled(const searcher *s) {
    return s->has_gradient && !(s->out->value < s->out->start) &&
           s->out->slope > 0.01 * fmax(fabs(s->out->value), 1e-12);
}

/* What the library's code means; the point is judged apart from it. */
static morph_status conclude(searcher *s, nlopt_result code) {
    morph_search_result *out = s->out;
    out->code = (int)code;
    out->slope = projected_slope(s);
    if (s->status != MORPH_OK) return s->status;
    if (out->evaluations == out->failures) {
        out->end = s->halted ? MORPH_SEARCH_HALTED : MORPH_SEARCH_NO_START;
        out->value = out->start = NAN;
        return MORPH_OK;
    }
    switch (code) {
    case NLOPT_SUCCESS:
    case NLOPT_STOPVAL_REACHED:
    case NLOPT_FTOL_REACHED:
    case NLOPT_XTOL_REACHED:
    case NLOPT_ROUNDOFF_LIMITED: /* usually at a good point */
    case NLOPT_FAILURE:          /* L-BFGS's line search, like rounding */
        out->end = stalled(s) ? MORPH_SEARCH_STALLED : MORPH_SEARCH_CONVERGED;
        break;
    case NLOPT_MAXEVAL_REACHED:
    case NLOPT_MAXTIME_REACHED:
        out->end = MORPH_SEARCH_SPENT;
        break;
    case NLOPT_FORCED_STOP:
        out->end = MORPH_SEARCH_SPENT; /* ours, or the caller's below */
        break;
    case NLOPT_OUT_OF_MEMORY:
        return MORPH_ERR_NOMEM;
    default: /* invalid arguments: our own bug */
        return MORPH_ERR_INTERNAL;
    }
    if (s->halted)
        out->end = MORPH_SEARCH_HALTED;
    else if (s->spent)
        out->end = MORPH_SEARCH_SPENT;
    return MORPH_OK;
}

static bool usable(const morph_search_problem *p, const double *x0, const morph_search_options *o) {
    if (p->unknowns < 1 || !p->value || !p->lower || !p->upper || !x0) return false;
    if (o->max_evaluations < 1 || !(o->max_seconds > 0.0) || !(o->step > 0.0 && o->step <= 1.0) ||
        !(o->step_least >= 0.0) || !(o->gain_least >= 0.0) || o->method > MORPH_SEARCH_LBFGS)
        return false;
    for (int i = 0; i < p->unknowns; i++)
        if (!isfinite(p->lower[i]) || !isfinite(p->upper[i]) || p->lower[i] > p->upper[i] || !isfinite(x0[i]))
            return false;
    return true;
}

static morph_status run(searcher *s, const double *x0, double *u, double *slope) {
    const morph_search_problem *p = s->problem;
    for (int i = 0; i < p->unknowns; i++) {
        s->x[i] = fmin(fmax(x0[i], p->lower[i]), p->upper[i]);
        s->out->x[i] = s->x[i];
        if (p->lower[i] == p->upper[i]) continue;
        u[s->free_count] = (s->x[i] - p->lower[i]) / width(s, i);
        s->free_unknown[s->free_count++] = i;
    }
    /* The start first: BOBYQA would begin elsewhere if that is near a bound. */
    evaluate((unsigned)s->free_count, u, morph_search_asks_gradient(s->options->method) ? slope : NULL, s);
    const bool known = s->status == MORPH_OK && !s->halted && s->out->failures == 0;
    if (s->free_count == 0 || !known) return conclude(s, NLOPT_SUCCESS);
    morph_status status = configure(s);
    if (status != MORPH_OK) return status;
    double value = 0.0;
    const nlopt_result code = nlopt_optimize(s->library, u, &value);
    return conclude(s, code);
}

morph_status morph_search(const morph_search_problem *problem, const double *x0,
                          const morph_search_options *options, morph_search_result *out) {
    *out = (morph_search_result){0};
    if (!usable(problem, x0, options)) return MORPH_ERR_INPUT;
    const size_t n = (size_t)problem->unknowns;
    searcher s = {.problem = problem, .options = options, .out = out, .started = morph_seconds()};
    double *u = morph_alloc(2 * n, sizeof *u);
    s.free_unknown = morph_alloc(n, sizeof *s.free_unknown);
    s.x = morph_alloc(n, sizeof *s.x);
    s.gradient = morph_alloc(n, sizeof *s.gradient);
    s.best_gradient = morph_alloc(n, sizeof *s.best_gradient);
    out->x = morph_alloc(n, sizeof *out->x);
    morph_status status = MORPH_ERR_NOMEM;
    if (u && s.free_unknown && s.x && s.gradient && s.best_gradient && out->x) status = run(&s, x0, u, u + n);
    nlopt_destroy(s.library);
    free(u);
    free(s.free_unknown);
    free(s.x);
    free(s.gradient);
    free(s.best_gradient);
    out->seconds = morph_seconds() - s.started;
    if (status != MORPH_OK) morph_search_result_free(out);
    return status;
}
