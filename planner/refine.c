/* Rounds of one NLP: minimise the cavity objective over the joints under the rows that stand near their
 * limits; then measure the result exactly, add the rows it breaks, correct the smooth distance's bias, renew
 * the closest points, and solve again from there. */
#include "planner/refine.h"

#include "planner/refine_goal.h"

#include <stdlib.h>
#include <string.h>

morph_refine_options morph_refine_defaults(void) {
    /* The insets leave room for the path's spline to approach the end from inside: a thousandth of a spacing,
     * and of a radian, changes the reachable shape by less than the links' radius. */
    return (morph_refine_options){.inset = {.length = 1e-3, .angle = 2e-3, .clearance = 0.0, .self = 1e-3},
                                  .cover_weight = MORPH_COVER_WEIGHT,
                                  .slide = 0.01,
                                  .press = 0.5,
                                  .blend = 0.1,
                                  .reach = 0.3,
                                  .least_reach = 0.03,
                                  .hold = 1e-3,
                                  .upright = 2e-4,
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
    morph_aim *aim;   /* NULL without a goal */
    double best_miss; /* of the goal */
    double share;     /* of the objective beside the goal: 1, less while it is missed, 0 at last */
    bool chase;       /* the goal counts: off until the objective alone has gone as far as it can */
    bool weigh;       /* name what stands against the goal after this solve */
} refiner;

static morph_status allocate(refiner *r) {
    const size_t n = 3 * (size_t)r->world->structure->joints, y = (size_t)r->world->cavity->exposed;
    const bool goal = morph_goal_any(&r->options->goal);
    const size_t wide = n + (goal ? (size_t)morph_aim_slacks(r->world) : 0);
    r->x = morph_alloc(wide, sizeof(double));
    r->best = morph_alloc(n, sizeof(double));
    r->metres = morph_alloc(n, sizeof(double));
    r->base = morph_alloc(n, sizeof(double));
    r->anchor = morph_alloc(n, sizeof(double));
    r->lower = morph_alloc(wide, sizeof(double));
    r->upper = morph_alloc(wide, sizeof(double));
    r->cover_joint = morph_alloc(y, sizeof(int[3]));
    r->cover_weight = morph_alloc(y, sizeof(double[3]));
    if (!r->x || !r->best || !r->metres || !r->base || !r->anchor || !r->lower || !r->upper ||
        !r->cover_joint || !r->cover_weight)
        return MORPH_ERR_NOMEM;
    const morph_status status = goal ? morph_aim_create(r->world, &r->options->goal, &r->aim) : MORPH_OK;
    return status == MORPH_OK ? morph_active_create(r->world->structure, &r->active) : status;
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
    morph_aim_destroy(r->aim);
}

static void to_metres(const refiner *r, const double *x) {
    const morph_structure *s = r->world->structure;
    for (int i = 0; i < 3 * s->joints; i++)
        r->metres[i] = x[i] * s->spacing;
}

/* Keeps x if it is the best seen: feasible before infeasible, then what it misses of the goal, then the
 * objective (exact distances), else the violation. */
static morph_status consider(refiner *r, const double *x, const morph_violation *v, double *objective) {
    morph_measure m;
    to_metres(r, x);
    const morph_status status = morph_cavity_measure(r->world->cavity, r->metres, &m);
    if (status != MORPH_OK) return status;
    *objective = m.objective;
    const double worst = morph_violation_worst(v, morph_pose_tolerance, NULL);
    const bool feasible = worst <= 1.0;
    const double values[MORPH_GOAL_KINDS] = {m.gap_mean, m.gap_max, m.coverage};
    const double miss = morph_goal_miss(&r->options->goal, values, r->world->structure->spacing);
    const bool closer =
        r->chase && miss != r->best_miss ? miss < r->best_miss : m.objective < r->best_objective;
    const bool better = !r->have_best || (feasible && !r->best_feasible) ||
                        (feasible == r->best_feasible && (feasible ? closer : worst < r->best_violation));
    if (better) {
        memcpy(r->best, x, 3 * (size_t)r->world->structure->joints * sizeof *x);
        r->have_best = true;
        if (feasible) {
            const size_t n = 3 * (size_t)r->world->structure->joints;
            memcpy(&r->report->station[(size_t)r->report->stations * n], r->metres, n * sizeof *x);
            r->report->stations++;
        }
        r->best_feasible = feasible;
        r->best_objective = m.objective;
        r->best_miss = miss;
        r->best_violation = worst;
        r->report->violation = *v;
    }
    return MORPH_OK;
}

/* While the goal is missed its rows allow this much of its gaps: a problem whose rows hold already asks for
 * nothing more, and where a round falls short of them it should fall short of less than the goal. */
#define PRESS 0.5

/* A goal is met to a thousandth of itself, so its rows must be solved further than steering asks; and a miss
 * alone is weighed by multipliers, which come last. */
static void aim_options(const refiner *r, morph_nlp_options *o) {
    o->tolerance = r->weigh ? 1e-7 : fmin(o->tolerance, 1e-5);
    o->max_iterations = r->weigh ? 200 : 100;
    o->violation_tolerance = 1e-4;
}

static morph_status solve_round(refiner *r, int round, morph_nlp_result *result) {
    const morph_structure *s = r->world->structure;
    const int n = 3 * s->joints;
    to_metres(r, r->x);
    morph_status status =
        morph_cavity_closest(r->world->cavity, r->metres, r->cover_joint, r->cover_weight, NULL);
    if (status != MORPH_OK) return status;
    morph_block blocks[MORPH_POSE_BLOCKS + 4 + MORPH_AIM_BLOCKS];
    int count = morph_active_blocks(r->active, r->world, NULL, &r->options->inset, blocks);
    if (count < 0) return MORPH_ERR_NOMEM;
    /* The kink between target and base plane is rounded over a tenth of a spacing: the width of a link and
     * its gap. */
    morph_gap_term gap = {r->world->cavity, r->world->sdf, r->options->blend, 1.0, true};
    morph_cover_term cover = {r->world->cavity,
                              (const int(*)[3])r->cover_joint,
                              (const double(*)[3])r->cover_weight,
                              r->options->slide,
                              r->options->press,
                              r->options->cover_weight};
    /* Half of the joints are in no term of the objective: held weakly where they stand, they take the
     * shortest way, and the Hessian is regular. The weight is small against the gap's (1 per spacing^2 of
     * skin), and the pull vanishes as the rounds settle. */
    morph_near_term near = {n, r->anchor, r->options->hold};
    blocks[count++] = morph_block_near(&near, NULL);
    /* Of the many shapes with the same cavity (lengths leave motions free) the one with upright posts is
     * wanted: the other layer then follows the skin and does not crumple. */
    morph_upright_term upright = {s, r->options->upright};
    blocks[count++] = morph_block_upright(&upright, NULL);
    blocks[count++] = morph_block_gap(&gap, NULL);
    blocks[count++] = morph_block_cover(&cover, NULL);
    int slacks = 0;
    if (r->chase) {
        gap.scale *= r->share;
        cover.scale *= r->share;
        upright.scale *= r->share;
        status =
            morph_aim_rows(r->aim, r->x, r->reach, r->best_miss > 0.0 ? PRESS : 1.0, &blocks[count], &slacks);
        if (status != MORPH_OK) return status;
        count += MORPH_AIM_BLOCKS;
    }
    char message[256] = "";
    morph_nlp *nlp = NULL;
    morph_pose_box(r->world, r->base, r->anchor, r->reach, r->lower, r->upper);
    for (int i = n; i < n + slacks; i++) {
        r->lower[i] = 0.0;
        r->upper[i] = INFINITY;
    }
    status =
        morph_nlp_create(n + slacks, r->x, r->lower, r->upper, blocks, count, message, sizeof message, &nlp);
    if (status != MORPH_OK) {
        morph_log(r->options->control, "refine: %s", message);
        return status;
    }
    morph_nlp_options o = morph_nlp_defaults();
    /* Early rounds only steer: they are solved again with more rows. The objective is of order 1 (spacings^2
     * of area times gap^2), so 1e-5 in its gradient moves the gap by far less than a thousandth of a spacing.
     */
    o.tolerance = round < 2 ? 1e-4 : 1e-5;
    o.max_iterations = 60; /* a round that wants more goes on in the next, from a feasible point */
    /* The start is feasible and near: a large barrier would first drive it away from every limit. */
    o.adaptive_mu = false;
    o.mu_init = 1e-3;
    /* The result is moved inside its limits afterwards: of the points seen, one that gains much and breaks a
     * row by a hundredth is wanted rather than the start. */
    o.violation_tolerance = 1e-2;

    o.isolated = true;
    o.control = &r->quiet;
    if (r->options->seconds > 0.0)
        o.max_seconds = fmax(0.1, r->options->seconds - (morph_seconds() - r->started));
    if (r->chase) aim_options(r, &o);
    status = morph_nlp_solve(nlp, r->x, &o, result);
    if (status == MORPH_OK && r->weigh)
        status = morph_limits_against(s, nlp, blocks, count, result, r->base, r->report->against,
                                      sizeof r->report->against);
    morph_nlp_destroy(nlp);
    return status;
}

/* Rows for a solve: all that a move of `reach` is likely to bring to their limits; what is missed shows in
 * the examination after it. */
static morph_status choose_rows(refiner *r, morph_violation *v) {
    const double m = r->reach;
    const morph_nearness near = {.length = 2.0 * m, .angle = 2.5 * m, .clearance = 1.2 * m, .self = 0.6 * m};
    morph_active_clear(r->active, r->world->structure);
    return morph_pose_examine(r->world, r->x, &r->options->inset, &near, r->active, NULL, v);
}

/* Whether axes pass through each other on the straight way from the best pose to x: no path could follow.
 * Seven poses between see it: within a round ends move apart by at most twice the reach, so from one to the
 * next by less than two radii. */
static morph_status passes_through(const refiner *r, const double *x, bool *through) {
    const int n = 3 * r->world->structure->joints;
    const double half = r->world->structure->def.radius / r->world->structure->spacing;
    double *between = morph_alloc((size_t)n, sizeof(double));
    morph_status status = between ? MORPH_OK : MORPH_ERR_NOMEM;
    *through = false;
    for (int step = 1; step < 8 && status == MORPH_OK && !*through; step++) {
        morph_violation v;
        for (int i = 0; i < n; i++)
            between[i] = r->best[i] + step / 8.0 * (x[i] - r->best[i]);
        status = morph_pose_examine(r->world, between, NULL, NULL, NULL, NULL, &v);
        *through = v.amount[MORPH_LIMIT_SELF] > half;
    }
    free(between);
    return status;
}

/* Rows that the solve did not have and broke. For the objective alone the projection deals with them; it
 * knows nothing of the goal, and of a goal that is nearly met the nearest pose within the limits would lose
 * most. */
static morph_status add_missed(refiner *r, morph_violation *v, bool *broken) {
    const morph_nearness near = {.length = 0.1, .angle = 0.15, .clearance = 0.15, .self = 0.1};
    const morph_status status =
        morph_pose_examine(r->world, r->x, &r->options->inset, &near, r->active, NULL, v);
    *broken = status == MORPH_OK && morph_violation_worst(v, morph_pose_tolerance, NULL) > 1.0;
    return status;
}

/* One round from the feasible r->x: a solve within reach, its result moved inside the limits, and kept if it
 * is better. */
static morph_status improve(refiner *r, int round, double *objective) {
    const size_t bytes = 3 * (size_t)r->world->structure->joints * sizeof *r->x;
    morph_violation v;
    morph_nlp_result result = {0};
    memcpy(r->anchor, r->x, bytes);
    morph_status status = choose_rows(r, &v);
    if (status == MORPH_OK) status = solve_round(r, round, &result);
    for (int again = 0; status == MORPH_OK; again++) {
        bool broken = false;
        morph_effort_add(&r->report->effort, &result);
        r->report->last = result.outcome;
        memcpy(r->x, result.x, bytes);
        if (r->chase && again < 4) status = add_missed(r, &v, &broken);
        if (!broken || status != MORPH_OK) break;
        morph_nlp_result_free(&result);
        status = solve_round(r, round, &result);
    }
    if (status != MORPH_OK) {
        morph_nlp_result_free(&result);
        return status;
    }
    /* A solve that was cut short is not worth moving inside the limits: the best so far is. */
    status = morph_stopped(r->options->control)
                 ? MORPH_ERR_STOPPED
                 : morph_project(r->world, &r->options->inset, 4, r->options->control, r->active, r->x, &v,
                                 &r->report->effort);
    if (status == MORPH_ERR_STOPPED) {
        morph_nlp_result_free(&result);
        return status;
    }
    bool through = false;
    *objective = INFINITY;
    if (status == MORPH_OK && r->best_feasible) status = passes_through(r, r->x, &through);
    if (status == MORPH_OK && !through) status = consider(r, r->x, &v, objective);
    morph_limit which = MORPH_LIMIT_POST;
    morph_violation_worst(&v, morph_pose_tolerance, &which);
    morph_log(
        r->options->control,
        "refine: round %d: reach %.2f, %s, %d iterations, %d rows, %.2f s; objective %.5g, worst %s %.2g",
        round + 1, r->reach, morph_outcome_text(result.outcome), result.iterations, result.rows,
        result.seconds, *objective, morph_limit_name(which), v.amount[which]);
    if (r->chase)
        morph_log(r->options->control, "refine: goal missed by %.4g spacings at best, %.2g of the objective",
                  r->best_miss, r->share);
    morph_nlp_result_free(&result);
    return status;
}

/* Where the rounds would end with the goal missed they go on with the miss alone, once; false: they end. */
static bool press_on(refiner *r, int *small_gains) {
    if (!r->chase || !(r->best_miss > 0.0) || r->share == 0.0) return false;
    r->share = 0.0;
    r->reach = r->options->reach;
    *small_gains = 0;
    return true;
}

/* A solver that dies (it runs in a process of its own) ends its round, not the refinement. */
static bool died(morph_status status) {
    return status == MORPH_ERR_BACKEND || status == MORPH_ERR_NOMEM;
}

/* Up to `most` rounds from the best so far, until they gain little. */
static morph_status run_rounds(refiner *r, int most) {
    const morph_refine_options *o = r->options;
    const size_t bytes = 3 * (size_t)r->world->structure->joints * sizeof *r->x;
    morph_status status = MORPH_OK;
    double objective;
    int small_gains = 0, deaths = 0;
    r->reach = o->reach;
    for (int n = 0; n < most && status == MORPH_OK; n++) {
        if ((small_gains >= 2 || !(r->reach > o->least_reach)) && !press_on(r, &small_gains)) break;
        const bool was_feasible = r->best_feasible, missed = r->chase && r->best_miss > 0.0;
        const double before = missed ? r->best_miss : r->best_objective;
        status = improve(r, r->report->rounds, &objective);
        r->report->rounds++;
        deaths = died(status) ? deaths + 1 : 0;
        if (died(status)) {
            r->report->deaths++;
            if (deaths < 2) status = MORPH_OK;
        }
        const double after = missed ? r->best_miss : r->best_objective;
        const double gain = was_feasible ? before - after : r->best_feasible ? before : 0.0;
        /* Trust region: a round that did not help was too bold. */
        r->reach *= gain > 0.0 ? 1.25 : 0.5;
        r->reach = fmin(r->reach, o->reach);
        /* A round cut short by its iterations says nothing of how near the best is. */
        small_gains =
            gain > 0.01 * before || r->report->last == MORPH_STOPPED ? 0 : small_gains + (gain > 0.0);
        /* What the objective asks for may stand against the goal: less of it while the goal is missed. */
        r->share = r->chase && r->best_miss > 0.0 ? 0.3 * r->share : 1.0;
        memcpy(r->x, r->best, bytes);
        morph_progress(o->control, "refine", fmin(1.0, (double)r->report->rounds / most));
        if (morph_stopped(o->control)) status = MORPH_ERR_STOPPED;
        if (o->seconds > 0.0 && morph_seconds() - r->started > o->seconds) break;
    }
    return status;
}

/* One more round for the miss alone, from the final shape: its multipliers say what stands against less. What
 * it gains is kept; where that is much, it was not yet the final shape. */
static morph_status weigh_limits(refiner *r) {
    const size_t bytes = 3 * (size_t)r->world->structure->joints * sizeof *r->x;
    morph_status status = MORPH_OK;
    double before = INFINITY, objective;
    r->share = 0.0;
    r->weigh = true;
    for (int k = 0; k < 3 && status == MORPH_OK && r->best_miss > 0.0 && r->best_miss < 0.99 * before; k++) {
        before = r->best_miss;
        r->reach = r->options->reach;
        memcpy(r->x, r->best, bytes);
        status = improve(r, r->report->rounds++, &objective);
    }
    r->weigh = false;
    if (r->best_miss <= 0.0) r->report->against[0] = '\0';
    return status;
}

static morph_status rounds(refiner *r) {
    const morph_refine_options *o = r->options;
    morph_violation v;
    double objective;
    /* The start as it is, where it holds; else moved inside the limits. */
    morph_status first = morph_pose_examine(r->world, r->x, NULL, NULL, NULL, NULL, &v);
    if (first == MORPH_OK) first = consider(r, r->x, &v, &objective);
    if (first != MORPH_OK) return first;
    morph_status status =
        morph_project(r->world, &o->inset, 8, o->control, r->active, r->x, &v, &r->report->effort);
    if (died(status)) {
        r->report->deaths++;
        memcpy(r->x, r->best, 3 * (size_t)r->world->structure->joints * sizeof *r->x);
        status = MORPH_OK;
    }
    if (status == MORPH_OK) status = consider(r, r->x, &v, &objective);
    r->share = 1.0;
    if (status == MORPH_OK) status = run_rounds(r, o->rounds);
    /* The goal comes second: from the shape with the least objective it is reached more often, and a goal
     * that this shape meets costs nothing and changes nothing. */
    r->chase = r->aim && r->best_miss > 0.0;
    if (status == MORPH_OK && r->chase) status = run_rounds(r, 2 * o->rounds);
    if (status == MORPH_OK && r->chase && r->best_feasible && r->best_miss > 0.0) status = weigh_limits(r);
    return status;
}

void morph_refine_report_free(morph_refine_report *report) {
    free(report->station);
    report->station = NULL;
    report->stations = 0;
}

morph_status morph_refine(const morph_world *world, const morph_refine_options *options, double *x,
                          morph_refine_report *report) {
    const morph_structure *s = world->structure;
    const int n = 3 * s->joints;
    refiner r = {.world = world, .options = options, .report = report, .started = morph_seconds()};
    *report = (morph_refine_report){.rows_possible = morph_possible_rows(s)};
    morph_status status = allocate(&r);
    /* The start, the same moved inside its limits, and one pose a round; with a goal three times as many
     * rounds and up to three to weigh. */
    const int most = morph_goal_any(&options->goal) ? 3 * options->rounds + 5 : options->rounds + 2;
    report->station = morph_alloc((size_t)most, (size_t)n * sizeof(double));
    if (!report->station) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (int i = 0; i < n; i++)
            r.x[i] = x[i] / s->spacing;
        morph_pose_bounds(world, options->inset.clearance, r.base);
        if (options->control) r.quiet = *options->control;
        r.quiet.log = NULL;
        r.quiet.progress = NULL;
        status = rounds(&r);
    }
    if (r.have_best) {
        for (int i = 0; i < n; i++)
            x[i] = r.best[i] * s->spacing;
        report->feasible = r.best_feasible;
        report->miss = r.best_miss;
    }
    release(&r);
    report->seconds = morph_seconds() - r.started;
    return status;
}
