/** Centres of attraction of a plan, and the blanket that they guide. */
#include "planner/plan_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* From here on the blanket is that one. */
static morph_status follow(morph_planner *p, const morph_trajectory *guided) {
    morph_trajectory copy = {.joints = guided->joints};
    const size_t frames = (size_t)guided->frames, width = 3 * (size_t)guided->joints;
    copy.time = morph_alloc(frames, sizeof(double));
    copy.x = morph_alloc(frames, width * sizeof(double));
    copy.lift = morph_alloc(frames, sizeof(double));
    if (!copy.time || !copy.x || !copy.lift) {
        morph_trajectory_free(&copy);
        return MORPH_ERR_NOMEM;
    }
    copy.frames = guided->frames;
    memcpy(copy.time, guided->time, frames * sizeof(double));
    memcpy(copy.x, guided->x, frames * width * sizeof(double));
    memcpy(p->end, &copy.x[(frames - 1) * width], width * sizeof *p->end);
    p->attracted = copy;
    p->way = &p->attracted;
    return MORPH_OK;
}

/* Where the blanket under attraction ends, if it lies closer and can be refined from: its axes are not in
 * each other. */
static morph_status start_guided(morph_planner *p, const morph_placement *placed, bool *taken) {
    const morph_structure *st = p->work.structure;
    const size_t width = 3 * (size_t)st->joints;
    const double *end = &placed->guided.x[(size_t)(placed->guided.frames - 1) * width];
    *taken = false;
    if (!(placed->reached.objective < p->plan->summary.blanket.objective)) return MORPH_OK;
    double *x = morph_alloc(width, sizeof(double));
    if (!x) return MORPH_ERR_NOMEM;
    morph_violation v;
    for (size_t i = 0; i < width; i++)
        x[i] = end[i] / st->spacing;
    const morph_status status = morph_pose_examine(&p->work.world, x, NULL, NULL, NULL, NULL, &v);
    free(x);
    *taken = status == MORPH_OK && v.amount[MORPH_LIMIT_SELF] <= 0.5 * st->def.radius / st->spacing;
    if (!*taken) return status;
    return follow(p, &placed->guided);
}

static void note_placement(morph_summary *s, const morph_placement *p) {
    s->has_guided = true;
    s->seeded = p->seeded;
    s->guided = p->reached;
    s->placement = (morph_placement_summary){.seeds = p->seeds,
                                             .centres = p->centres,
                                             .rounds = p->rounds,
                                             .accepted = p->accepted,
                                             .iterations = p->effort.iterations,
                                             .unknowns = p->effort.unknowns,
                                             .rows = p->effort.rows,
                                             .solved = p->solved,
                                             .stable = p->balance.stable,
                                             .residual = p->balance.residual,
                                             .complementarity = p->balance.complementarity,
                                             .difference = p->difference,
                                             .largest_force = p->largest_force};
    memcpy(s->placement.reason, p->reason, sizeof s->placement.reason);
}

/* Centres of attraction for scenes that leave them to the plan. What they guide the blanket to is another
 * start for the refinement; a placement that fails is a finding. */
morph_status morph_stage_placement(morph_planner *p) {
    if (p->options->method == MORPH_METHOD_BLANKET || p->stopped ||
        p->scene->attractors != MORPH_ATTRACT_AUTO)
        return MORPH_OK;
    char beyond[160];
    if (morph_scene_unplaceable(p->scene, beyond, sizeof beyond)) {
        morph_log(morph_planner_control(p), "placement: left out: %s", beyond);
        return MORPH_OK;
    }
    const double since = morph_seconds();
    morph_placement own = {0};
    const morph_placement *placed = p->options->placement;
    morph_status status = MORPH_OK;
    if (!placed) {
        morph_placement_options o = morph_placement_defaults();
        o.control = morph_planner_control(p);
        if (p->options->method == MORPH_METHOD_NLOPT) o.method = MORPH_PLACE_NLOPT_GRADIENT;
        morph_planner_limit(p, MORPH_STAGE_PLACEMENT);
        morph_progress(o.control, "placement", 0.0);
        status = morph_placement_run(&p->work, p->scene, p->end, &o, &own);
        placed = &own;
    }
    status = morph_planner_ended(p, status, MORPH_STAGE_PLACEMENT);
    if (status == MORPH_ERR_NONFINITE || status == MORPH_ERR_MOTION || status == MORPH_ERR_BACKEND) {
        morph_log(morph_planner_control(p), "placement: left out: %s", morph_status_text(status));
        status = MORPH_OK;
    }
    if (status == MORPH_OK && placed->guided.frames > 0) {
        note_placement(&p->plan->summary, placed);
        status = morph_record_guided(&p->plan->record, p->work.structure, placed);
        if (status == MORPH_OK && p->options->method == MORPH_METHOD_NLOPT)
            status = follow(p, &placed->guided);
        else if (status == MORPH_OK)
            status = start_guided(p, placed, &p->guided);
    }
    morph_placement_free(&own);
    morph_planner_time(p, MORPH_STAGE_PLACEMENT, since);
    return status;
}
