#include "planner/placement_search.h"

#include "planner/cavity_objective.h"
#include "planner/stiffness.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A search moves centres by up to 0.8 spacings and joints by about half of that: limits this near are likely
 * to be met. Those farther away would weigh next to nothing, and cost time. */
static const morph_nearness search_nearness = {.length = 0.2, .angle = 0.4, .clearance = 0.5, .self = 0.12};

struct morph_rest_cavity {
    morph_balance *b;
    morph_control quiet; /* the caller's without its log: the solver's own lines are too many */
    morph_cavity_objective objective;
    morph_nlp *nlp;       /* the objective alone */
    double *y, *slope;    /* the objective's unknowns, and its gradient by them */
    double *rows, *sigma; /* rows, equalities */
    morph_rest best;
    double best_value, until;
    morph_follow_effort effort;
    double adjoint_residual;
};

static bool allocate(morph_rest_cavity *c) {
    const size_t n = (size_t)(c->b->coordinates + c->b->centres);
    c->y = morph_alloc(n, sizeof *c->y);
    c->slope = morph_alloc(n, sizeof *c->slope);
    c->rows = morph_alloc((size_t)c->b->rows, sizeof *c->rows);
    c->sigma = morph_alloc((size_t)c->b->equalities, sizeof *c->sigma);
    return c->y && c->slope && c->rows && c->sigma;
}

/* Its unknowns are the coordinates and then the strengths. */
static morph_status build_objective(morph_rest_cavity *c, const morph_workspace *w,
                                    const morph_placement_options *o) {
    const int n = c->b->coordinates, centres = c->b->centres;
    char message[256];
    morph_block blocks[MORPH_CAVITY_BLOCKS];
    morph_status status = morph_cavity_objective_create(w, o, c->y, centres, n, &c->objective);
    if (status != MORPH_OK) return status;
    morph_cavity_objective_blocks(&c->objective, blocks);
    status = morph_nlp_create(n + centres, c->y, NULL, NULL, blocks, MORPH_CAVITY_BLOCKS, message,
                              sizeof message, &c->nlp);
    if (status != MORPH_OK) morph_log(o->control, "placement: %s", message);
    return status;
}

/* J at a point of balance; c->slope if asked. */
static morph_status objective_at(morph_rest_cavity *c, const double *z, double *f, bool slope) {
    const morph_balance *b = c->b;
    memcpy(c->y, z, (size_t)b->coordinates * sizeof *z);
    memcpy(c->y + b->coordinates, &z[morph_balance_strength(b)], (size_t)b->centres * sizeof *z);
    return morph_nlp_objective(c->nlp, c->y, f, slope ? c->slope : NULL);
}

static void centres_of(const morph_balance *b, const double *p, morph_attractor *centre) {
    for (int m = 0; m < b->centres; m++)
        centre[m] = (morph_attractor){{p[4 * m], p[4 * m + 1], p[4 * m + 2]}, p[4 * m + 3]};
}

static void unknowns_of(const morph_balance *b, const double *z, double *p) {
    for (int m = 0; m < b->centres; m++) {
        memcpy(&p[4 * m], &z[morph_balance_centre(b) + 3 * m], 3 * sizeof *p);
        p[4 * m + 3] = z[morph_balance_strength(b) + m];
    }
}

/* Clearance of a limit that is not yet in force, spacings: what stands nearer and is not among the limits is
 * there already, at places of the same two axes that were closest before. */
#define CLEAR 1e-3

/* Adds the limits within `nearness` that z is clear of. */
static morph_status widen(morph_balance *b, const double *z, const morph_nearness *nearness) {
    morph_limits *l = &b->limits;
    const int before = l->count;
    const morph_status status = morph_balance_more_limits(b, z, nearness, 0.0, NULL);
    if (status != MORPH_OK) return status;
    int kept = before;
    for (int q = before; q < l->count; q++) {
        if (morph_balance_limit_at(b, q, z) < CLEAR) continue;
        l->element[kept] = l->element[q];
        l->sign[kept] = l->sign[q];
        l->edge[kept++] = l->edge[q];
    }
    l->count = kept;
    return MORPH_OK;
}

morph_status morph_rest_cavity_create(const morph_workspace *w, morph_balance *b,
                                      const morph_placement_options *options, const morph_rest *rest,
                                      const morph_nearness *nearness, double seconds,
                                      morph_rest_cavity **out) {
    *out = NULL;
    morph_rest_cavity *c = morph_alloc(1, sizeof *c);
    if (!c) return MORPH_ERR_NOMEM;
    *c = (morph_rest_cavity){.b = b, .best_value = INFINITY};
    c->until = seconds > 0.0 ? morph_seconds() + seconds : INFINITY;
    if (options->control) {
        c->quiet.stop = options->control->stop;
        c->quiet.user = options->control->user;
    }
    double p[4 * MORPH_MOST_CENTRES];
    morph_attractor centre[MORPH_MOST_CENTRES];
    morph_status status = allocate(c) ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        memcpy(c->y, rest->z, (size_t)b->coordinates * sizeof *c->y);
        status = build_objective(c, w, options);
    }
    bool definite = true;
    if (status == MORPH_OK) status = morph_stiffness_raise_hold(b, rest->z, &definite);
    if (status == MORPH_OK && !definite) status = MORPH_ERR_BACKEND;
    if (status == MORPH_OK) status = widen(b, rest->z, nearness ? nearness : &search_nearness);
    if (status == MORPH_OK) {
        unknowns_of(b, rest->z, p);
        centres_of(b, p, centre);
        status = morph_rest_follow(b, centre, rest, c->until, &c->quiet, &c->best, &c->effort);
        if (status == MORPH_OK && !c->best.solved) status = MORPH_ERR_BACKEND;
    }
    if (status == MORPH_OK) status = objective_at(c, c->best.z, &c->best_value, false);
    if (status != MORPH_OK) {
        morph_rest_cavity_destroy(c);
        return status;
    }
    *out = c;
    return MORPH_OK;
}

void morph_rest_cavity_destroy(morph_rest_cavity *c) {
    if (!c) return;
    morph_nlp_destroy(c->nlp);
    morph_cavity_objective_free(&c->objective);
    free(c->y);
    free(c->slope);
    free(c->rows);
    free(c->sigma);
    morph_rest_free(&c->best);
    free(c);
}

/* r = ... - s grad_d pull(a - x): by a -s hess, by s -grad, summed over the free joints. */
static void put_gradient(const morph_rest_cavity *c, const double *z, const double *u, double *gradient) {
    const morph_balance *b = c->b;
    for (int m = 0; m < b->centres; m++) {
        const double *at = &z[morph_balance_centre(b) + 3 * m], s = z[morph_balance_strength(b) + m];
        double *g = &gradient[4 * m];
        g[0] = g[1] = g[2] = 0.0;
        g[3] = c->slope[b->coordinates + m];
        for (int j = 0; j < b->coordinates / 3; j++) {
            if (b->row[3 * j] < 0) continue;
            const double *uj = &u[b->row[3 * j]]; /* rows of a joint follow each other */
            double d[3];
            morph_pull_jet pull;
            morph_sub(at, &z[3 * j], d);
            morph_pull_eval(d, b->softening, NULL, &pull);
            for (int k = 0; k < 3; k++)
                g[k] += s * morph_dot(pull.h[k], uj);
            g[3] += morph_dot(pull.g, uj);
        }
    }
}

static morph_status adjoint(morph_rest_cavity *c, const double *z, double *gradient) {
    morph_balance *b = c->b;
    morph_stiffness *k;
    bool definite;
    double residual;
    morph_status status = morph_stiffness_create(b, z, &k, &definite);
    if (status != MORPH_OK) return status;
    if (!definite) status = MORPH_ERR_NONFINITE;
    for (int i = 0; i < b->coordinates; i++)
        if (b->row[i] >= 0) c->rows[b->row[i]] = c->slope[i];
    if (status == MORPH_OK) status = morph_stiffness_solve(k, c->rows, NULL, c->rows, c->sigma, &residual);
    if (status == MORPH_OK) {
        c->adjoint_residual = fmax(c->adjoint_residual, residual);
        put_gradient(c, z, c->rows, gradient);
    }
    morph_stiffness_destroy(k);
    return status;
}

morph_status morph_rest_cavity_value(morph_rest_cavity *c, const double *p, double *f, double *gradient) {
    morph_attractor centre[MORPH_MOST_CENTRES];
    morph_rest rest;
    centres_of(c->b, p, centre);
    morph_status status = morph_rest_follow(c->b, centre, &c->best, c->until, &c->quiet, &rest, &c->effort);
    if (status == MORPH_OK && !rest.solved) status = MORPH_ERR_NONFINITE;
    if (status == MORPH_OK) status = objective_at(c, rest.z, f, gradient != NULL);
    if (status == MORPH_OK && gradient) status = adjoint(c, rest.z, gradient);
    if (status == MORPH_OK && *f < c->best_value) {
        morph_rest_free(&c->best);
        c->best = rest;
        c->best_value = *f;
    } else {
        morph_rest_free(&rest);
    }
    return status;
}

const morph_rest *morph_rest_cavity_best(const morph_rest_cavity *c) {
    return &c->best;
}

morph_follow_effort morph_rest_cavity_effort(const morph_rest_cavity *c) {
    return c->effort;
}

double morph_rest_cavity_adjoint_residual(const morph_rest_cavity *c) {
    return c->adjoint_residual;
}

static morph_status value(void *data, const double *p, double *f, double *gradient) {
    return morph_rest_cavity_value(data, p, f, gradient);
}

/* As the program's bounds: centres within twice the reach, strengths within a factor of two. */
static void set_box(const double *p, int centres, double moves, double strongest, double *lower,
                    double *upper) {
    for (int m = 0; m < centres; m++) {
        for (int k = 4 * m; k < 4 * m + 3; k++) {
            lower[k] = p[k] - 2.0 * moves;
            upper[k] = p[k] + 2.0 * moves;
        }
        lower[4 * m + 3] = 0.5 * p[4 * m + 3];
        upper[4 * m + 3] = fmin(strongest, 2.0 * p[4 * m + 3] + 1.0);
        upper[4 * m + 3] = fmax(upper[4 * m + 3], lower[4 * m + 3]);
    }
}

/* The end as the rounds know it. Every point of a search is a shape at rest: feasible at least. */
static void tell(const morph_rest_cavity *c, morph_search_method method, const morph_search_result *found,
                 morph_nlp_result *result) {
    result->outcome = found->end == MORPH_SEARCH_CONVERGED ? MORPH_OPTIMAL : MORPH_FEASIBLE;
    result->solver_code = found->code;
    snprintf(result->solver_text, sizeof result->solver_text, "%s: %s, %d failed", morph_search_name(method),
             morph_search_end_text(found->end), found->failures);
    result->iterations = c->effort.steps;
    result->evaluations = found->evaluations;
    result->objective = c->best_value;
    result->worst_row = -1;
    result->unknowns = 4 * c->b->centres;
    result->seconds = found->seconds;
}

/* A limit of time for searches that have none: the library is never run without one. */
#define LONGEST 3600.0

static morph_status search(morph_rest_cavity *c, const morph_placement_options *o, morph_search_method method,
                           double moves, double seconds, morph_nlp_result *result) {
    const int n = 4 * c->b->centres;
    double start[4 * MORPH_MOST_CENTRES], lower[4 * MORPH_MOST_CENTRES], upper[4 * MORPH_MOST_CENTRES];
    unknowns_of(c->b, c->best.z, start);
    set_box(start, c->b->centres, moves, o->strongest, lower, upper);
    const morph_search_problem problem = {
        .unknowns = n, .lower = lower, .upper = upper, .data = c, .value = value};
    morph_search_options s = morph_search_defaults(method);
    s.max_evaluations = o->evaluations;
    s.max_seconds = seconds > 0.0 ? fmax(1e-3, c->until - morph_seconds()) : LONGEST;
    s.control = o->control;
    morph_search_result found;
    const morph_status status = morph_search(&problem, start, &s, &found);
    if (status != MORPH_OK) return status;
    tell(c, method, &found, result);
    morph_log(o->control,
              "placement: %s: %d evaluations, %d failed, %d Newton steps, %d searches from outside, %d "
              "limits, hold %.0f; "
              "objective %.5g to %.5g, slope %.2g, adjoint %.1e",
              morph_search_name(method), found.evaluations, found.failures, c->effort.steps, c->effort.solves,
              c->b->limits.count, c->b->hold, found.start, c->best_value, found.slope, c->adjoint_residual);
    const bool halted = found.end == MORPH_SEARCH_HALTED;
    morph_search_result_free(&found);
    return halted ? MORPH_ERR_STOPPED : MORPH_OK;
}

/* Where the shape with the search's limits is not found, the centres stay where they are. */
static morph_status no_proposal(morph_balance *b, const morph_rest *rest, double **z,
                                morph_nlp_result *result) {
    b->limits.count = rest->limits.count;
    const size_t n = (size_t)morph_balance_unknowns(b);
    *z = morph_alloc(n, sizeof **z);
    if (!*z) return MORPH_ERR_NOMEM;
    memcpy(*z, rest->z, n * sizeof **z);
    result->outcome = MORPH_FEASIBLE;
    result->worst_row = -1;
    snprintf(result->solver_text, sizeof result->solver_text, "no shape at rest to search from");
    return MORPH_OK;
}

morph_status morph_placement_search(const morph_workspace *w, morph_balance *b,
                                    const morph_placement_options *options, morph_search_method method,
                                    double moves, double seconds, const morph_rest *rest, double **z,
                                    morph_nlp_result *result) {
    morph_rest_cavity *c = NULL;
    *z = NULL;
    *result = (morph_nlp_result){0};
    morph_status status = morph_rest_cavity_create(w, b, options, rest, NULL, seconds, &c);
    if (status == MORPH_ERR_BACKEND) return no_proposal(b, rest, z, result);
    if (status == MORPH_OK) status = search(c, options, method, moves, seconds, result);
    if (status == MORPH_OK) {
        /* Limits only ever grow at their end: those of the best shape are the first of them. */
        b->limits.count = c->best.limits.count;
        *z = c->best.z;
        c->best.z = NULL;
    }
    morph_rest_cavity_destroy(c);
    return status;
}

/* By measurement (bench_placement_search). Of those without gradients BOBYQA takes fewest evaluations, but is
 * misled where the sheet snaps over, and Sbplx takes twice as many as COBYLA. Those with gradients reach the
 * same values; L-BFGS and MMA with a quarter fewer evaluations than SLSQP, L-BFGS with the least slope left.
 */
morph_status morph_propose_free(const morph_workspace *w, morph_balance *b,
                                const morph_placement_options *options, double moves, double seconds,
                                const morph_rest *rest, double **z, morph_nlp_result *result) {
    return morph_placement_search(w, b, options, MORPH_SEARCH_COBYLA, moves, seconds, rest, z, result);
}

morph_status morph_propose_gradient(const morph_workspace *w, morph_balance *b,
                                    const morph_placement_options *options, double moves, double seconds,
                                    const morph_rest *rest, double **z, morph_nlp_result *result) {
    return morph_placement_search(w, b, options, MORPH_SEARCH_LBFGS, moves, seconds, rest, z, result);
}
