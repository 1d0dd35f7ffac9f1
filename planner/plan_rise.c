/** The rest of a target's rise: where the blanket stopped it short of its place, the end is moved on by small
 * lifts, each pose the least motion from the one before that its limits ask with the target there. */
#include "planner/plan_internal.h"

#include <stdlib.h>
#include <string.h>

/* Lifts in spacings. A tenth: half of what rows are chosen to be near for, so that a solve sees what the lift
 * brings about. Least: a quarter of a link's radius; where that is too much, limits stand against the rise.
 * Trials: some ten spacings' worth of rise, or a few dozen halvings. */
#define MOST_LIFT 0.1
#define LEAST_LIFT 0.01
enum { TRIALS = 150 };

typedef struct riser {
    morph_world world; /* with the target where it stands at the pose in hand */
    morph_active *active;
    double *x, *good; /* 3*joints, scaled: a trial, the last that held */
    double lift;      /* of the last that held, m */
    morph_effort effort;
} riser;

/* One lift by `step` (m); false where no pose near holds it. */
static morph_status lift_by(const morph_planner *p, riser *r, double step, bool *held) {
    const morph_inset inset = morph_refine_defaults().inset;
    const size_t bytes = 3 * (size_t)r->world.structure->joints * sizeof *r->x;
    morph_violation v;
    memcpy(r->x, r->good, bytes);
    r->world.lift = fmin(0.0, r->lift + step);
    const morph_status status =
        morph_project(&r->world, &inset, 4, morph_planner_control(p), r->active, r->x, &v, &r->effort);
    *held = status == MORPH_OK && morph_violation_worst(&v, morph_pose_tolerance, NULL) <= 1.0;
    if (*held) {
        memcpy(r->good, r->x, bytes);
        r->lift = r->world.lift;
    }
    return status;
}

static morph_status raise(morph_planner *p, riser *r) {
    const double a = r->world.structure->spacing, short_of = -r->lift;
    double step = 0.0; /* first inside its limits where it is */
    morph_status status = MORPH_OK;
    for (int k = 0; k < TRIALS && r->lift < 0.0 && status == MORPH_OK; k++) {
        bool held;
        status = lift_by(p, r, step, &held);
        if (step == 0.0 && status == MORPH_OK)
            step = MOST_LIFT * a; /* also where it did not hold: it may with the target elsewhere */
        else if (step < LEAST_LIFT * a && !held)
            break;
        else
            step = held ? fmin(MOST_LIFT * a, 1.5 * step) : 0.5 * step;
        morph_progress(morph_planner_control(p), "refine", 0.0);
        if (morph_stopped(morph_planner_control(p))) break;
    }
    morph_log(morph_planner_control(p),
              "refine: the target was %.4g m short of its place, raised by %.4g m in %d solves", short_of,
              short_of + r->lift, r->effort.solves);
    p->plan->summary.iterations_refine += r->effort.iterations;
    return status;
}

morph_status morph_planner_raise(morph_planner *p) {
    const morph_trajectory *way = p->way;
    const double lift = way->lift ? way->lift[way->frames - 1] : 0.0;
    if (!(lift < 0.0)) return MORPH_OK;
    const size_t n = 3 * (size_t)p->work.structure->joints;
    const double a = p->work.structure->spacing;
    riser r = {.world = p->work.world, .lift = lift};
    r.x = morph_alloc(n, sizeof *r.x);
    r.good = morph_alloc(n, sizeof *r.good);
    morph_status status = r.x && r.good ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = morph_active_create(p->work.structure, &r.active);
    if (status == MORPH_OK) {
        for (size_t i = 0; i < n; i++)
            r.good[i] = p->end[i] / a;
        status = raise(p, &r);
        for (size_t i = 0; i < n; i++)
            p->end[i] = r.good[i] * a;
    }
    morph_active_destroy(r.active);
    free(r.x);
    free(r.good);
    return status;
}
