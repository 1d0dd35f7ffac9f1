/* Rounds of one NLP: minimise the cavity objective over the joints under the rows that stand near their
 * limits; then measure the result exactly, add the rows it breaks, correct the smooth distance's bias, renew
 * the closest points, and solve again from there. */
#include "planner/refine.h"

#include <stdlib.h>
#include <string.h>

/* Posts: the check allows 1e-6. Length, angle, base: the check allows rounding only, so no more than Ipopt's
 * own convergence (1e-8 in scaled rows) may be spent of the inset. Clearance: the check allows 1e-3 spacing.
 */
const double morph_pose_tolerance[MORPH_LIMITS] = {
    [MORPH_LIMIT_POST] = 5e-7,      [MORPH_LIMIT_LENGTH] = 1e-9, [MORPH_LIMIT_ANGLE] = 1e-9,
    [MORPH_LIMIT_CLEARANCE] = 5e-4, [MORPH_LIMIT_BASE] = 1e-9,   [MORPH_LIMIT_SELF] = 1e-9};

morph_refine_options morph_refine_defaults(void) {
    /* The insets leave room for the path's spline to approach the end from inside: a thousandth of a spacing,
     * and of a radian, changes the reachable shape by less than the links' radius. */
    return (morph_refine_options){.inset = {.length = 1e-3, .angle = 2e-3, .clearance = 1e-3, .self = 1e-3},
                                  .cover_weight = MORPH_COVER_WEIGHT,
                                  .slide = 0.1,
                                  .reach = 0.4,
                                  .hold = 1e-3,
                                  .rounds = 12};
}

typedef struct refiner {
    const morph_world *world;
    const morph_refine_options *options;
    morph_refine_report *report;
    morph_active *active;
    int (*cover_joint)[3];
    double (*cover_weight)[3];
    double *x, *best, *metres, *base, *anchor, *lower, *upper; /* coordinates each; all but metres scaled */
    morph_control quiet; /* the caller's control without its log: the solver's own lines are too many */
    double best_objective;
    double best_violation;
    bool best_feasible, have_best;
    double reach;
    double started;
} refiner;

static morph_status allocate(refiner *r) {
    const size_t n = 3 * (size_t)r->world->structure->joints, y = (size_t)r->world->cavity->exposed;
    r->x = morph_alloc(n, sizeof(double));
    r->best = morph_alloc(n, sizeof(double));
    r->metres = morph_alloc(n, sizeof(double));
    r->base = morph_alloc(n, sizeof(double));
    r->anchor = morph_alloc(n, sizeof(double));
    r->lower = morph_alloc(n, sizeof(double));
    r->upper = morph_alloc(n, sizeof(double));
    r->cover_joint = morph_alloc(y, sizeof(int[3]));
    r->cover_weight = morph_alloc(y, sizeof(double[3]));
    if (!r->x || !r->best || !r->metres || !r->base || !r->anchor || !r->lower || !r->upper ||
        !r->cover_joint || !r->cover_weight)
        return MORPH_ERR_NOMEM;
    return morph_active_create(r->world->structure, &r->active);
}

static void release(refiner *r) {
    free(r->x);
    free(r->best);
    free(r->metres);
    free(r->base);
    free(r->anchor);
    free(r->lower);
    free(r->upper);
    free(r->cover_joint);
    free(r->cover_weight);
    morph_active_destroy(r->active);
}

static void to_metres(const refiner *r, const double *x) {
    const morph_structure *s = r->world->structure;
    for (int i = 0; i < 3 * s->joints; i++)
        r->metres[i] = x[i] * s->spacing;
}

/* Keeps x if it is the best seen: feasible before infeasible, then the objective (exact distances), else the
 * violation. */
static morph_status consider(refiner *r, const double *x, const morph_violation *v, double *objective) {
    morph_measure m;
    to_metres(r, x);
    const morph_status status = morph_cavity_measure(r->world->cavity, r->metres, &m);
    if (status != MORPH_OK) return status;
    *objective = m.objective;
    const double worst = morph_violation_worst(v, morph_pose_tolerance, NULL);
    const bool feasible = worst <= 1.0;
    const bool better = !r->have_best || (feasible && !r->best_feasible) ||
                        (feasible == r->best_feasible &&
                         (feasible ? m.objective < r->best_objective : worst < r->best_violation));
    if (better) {
        memcpy(r->best, x, 3 * (size_t)r->world->structure->joints * sizeof *x);
        r->have_best = true;
        r->best_feasible = feasible;
        r->best_objective = m.objective;
        r->best_violation = worst;
        r->report->violation = *v;
    }
    return MORPH_OK;
}

static morph_status solve_round(refiner *r, int round, morph_nlp_result *result) {
    const morph_structure *s = r->world->structure;
    const int n = 3 * s->joints;
    to_metres(r, r->x);
    morph_status status =
        morph_cavity_closest(r->world->cavity, r->metres, r->cover_joint, r->cover_weight, NULL);
    if (status != MORPH_OK) return status;
    morph_block blocks[MORPH_POSE_BLOCKS + 3];
    int count = morph_active_blocks(r->active, r->world, NULL, &r->options->inset, blocks);
    if (count < 0) return MORPH_ERR_NOMEM;
    /* The kink between target and base plane is rounded over a tenth of a spacing: the width of a link and
     * its gap. */
    morph_gap_term gap = {r->world->cavity, r->world->sdf, 0.1, 1.0, getenv("GN") != NULL};
    morph_cover_term cover = {r->world->cavity, (const int(*)[3])r->cover_joint,
                              (const double(*)[3])r->cover_weight, r->options->slide,
                              r->options->cover_weight};
    /* Half of the joints are in no term of the objective: held weakly where they stand, they take the
     * shortest way, and the Hessian is regular. The weight is small against the gap's (1 per spacing^2 of
     * skin), and the pull vanishes as the rounds settle. */
    memcpy(r->anchor, r->x, (size_t)n * sizeof *r->x);
    morph_near_term near = {n, r->anchor, r->options->hold};
    blocks[count++] = morph_block_near(&near, NULL);
    blocks[count++] = morph_block_gap(&gap, NULL);
    blocks[count++] = morph_block_cover(&cover, NULL);
    char message[256] = "";
    morph_nlp *nlp = NULL;
    for (int i = 0; i < n; i++) {
        r->lower[i] = fmax(r->base[i], r->x[i] - r->reach);
        r->upper[i] = fmax(r->lower[i], r->x[i]) + r->reach;
    }
    status = morph_nlp_create(n, r->x, r->lower, r->upper, blocks, count, message, sizeof message, &nlp);
    if (status != MORPH_OK) {
        morph_log(r->options->control, "refine: %s", message);
        return status;
    }
    const morph_nlp_size size = morph_nlp_sizes(nlp);
    r->report->jacobian_nonzeros = size.jacobian_nonzeros;
    r->report->hessian_nonzeros = size.hessian_nonzeros;
    morph_nlp_options o = morph_nlp_defaults();
    /* Early rounds only steer: they are solved again with more rows. The objective is of order 1 (spacings^2
     * of area times gap^2), so 1e-5 in its gradient moves the gap by far less than a thousandth of a spacing.
     */
    o.tolerance = round < 2 ? 1e-4 : 1e-5;
    o.max_iterations = getenv("MAXIT") ? atoi(getenv("MAXIT")) : 150;
    if (getenv("MONO")) {
        o.adaptive_mu = false;
        o.mu_init = atof(getenv("MONO"));
    }
    o.mu_init = round == 0 ? 1e-2 : 1e-4;
    o.control = &r->quiet;
    if (r->options->seconds > 0.0)
        o.max_seconds = fmax(0.1, r->options->seconds - (morph_seconds() - r->started));
    status = morph_nlp_solve(nlp, r->x, &o, result);
    morph_nlp_destroy(nlp);
    return status;
}

static void tally(refiner *r, const morph_nlp_result *result) {
    morph_refine_report *p = r->report;
    p->rounds++;
    p->iterations += result->iterations;
    p->unknowns = result->unknowns;
    p->rows_used = morph_active_rows(r->active, r->world->structure);
    p->linear_seconds += result->linear_seconds;
    p->callback_seconds += result->callback_seconds;
    p->last = result->outcome;
}

/* Rows for a round: all that a move of `reach` can bring to their limits. Two ends move apart by up to twice
 * that, an angle turns by that over a length; most moves are far smaller, and what is missed shows in the
 * next examination. */
static morph_status examine(refiner *r, morph_violation *v) {
    const morph_nearness near = {.length = 2.0 * r->reach,
                                 .angle = 2.5 * r->reach,
                                 .clearance = 1.2 * r->reach,
                                 .self = 2.0 * r->reach};
    morph_active_clear(r->active, r->world->structure);
    return morph_pose_examine(r->world, r->x, &r->options->inset, &near, r->active, NULL, v);
}

static morph_status rounds(refiner *r) {
    const morph_refine_options *o = r->options;
    morph_violation v;
    double objective, before = INFINITY;
    r->reach = o->reach;
    morph_status status = examine(r, &v);
    if (status == MORPH_OK) status = consider(r, r->x, &v, &objective);
    for (int round = 0; round < o->rounds && status == MORPH_OK; round++) {
        morph_nlp_result result = {0};
        status = solve_round(r, round, &result);
        if (status != MORPH_OK) break;
        tally(r, &result);
        memcpy(r->x, result.x, 3 * (size_t)r->world->structure->joints * sizeof *r->x);
        r->reach = fmax(0.75 * r->reach, 0.05);
        status = examine(r, &v);
        if (status == MORPH_OK) status = consider(r, r->x, &v, &objective);
        morph_limit which = MORPH_LIMIT_POST;
        const double worst = morph_violation_worst(&v, morph_pose_tolerance, &which);
        morph_log(o->control,
                  "refine: round %d: %s after %d iterations (%s), %.2f s, objective %.6g, worst %s %.3g "
                  "(%s), %d rows",
                  round + 1, morph_outcome_text(result.outcome), result.iterations, result.solver_text,
                  result.seconds, objective, morph_limit_name(which), v.amount[which], v.element[which],
                  result.rows);
        morph_nlp_result_free(&result);
        morph_progress(o->control, "refine", (round + 1.0) / o->rounds);
        if (morph_stopped(o->control)) status = MORPH_ERR_STOPPED;
        if (o->seconds > 0.0 && morph_seconds() - r->started > o->seconds) break;
        /* Settled: inside every limit, and a round gained less than a per cent. */
        if (worst <= 1.0 && objective > 0.99 * before) break;
        before = objective;
    }
    return status;
}

morph_status morph_refine(const morph_world *world, const morph_refine_options *options, double *x,
                          morph_refine_report *report) {
    const morph_structure *s = world->structure;
    const int n = 3 * s->joints;
    refiner r = {.world = world, .options = options, .report = report, .started = morph_seconds()};
    *report = (morph_refine_report){.rows_possible = morph_possible_rows(s)};
    morph_status status = allocate(&r);
    if (status == MORPH_OK) {
        for (int i = 0; i < n; i++)
            r.x[i] = x[i] / s->spacing;
        morph_pose_bounds(world, options->inset.clearance, r.base);
        if (options->control) r.quiet = *options->control;
        r.quiet.log = NULL;
        status = rounds(&r);
    }
    if (r.have_best) {
        for (int i = 0; i < n; i++)
            x[i] = r.best[i] * s->spacing;
        report->feasible = r.best_feasible;
    }
    release(&r);
    report->seconds = morph_seconds() - r.started;
    return status;
}
