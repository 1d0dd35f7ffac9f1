#ifndef MORPH_PLANNER_PLAN_INTERNAL_H
#define MORPH_PLANNER_PLAN_INTERNAL_H
/** What the stages of a plan (plan.c, plan_nominal.c, plan_placement.c, plan_schedule.c) share. Not for
 * others. */

#include "planner/placement.h"
#include "planner/plan.h"

/** State of a plan in work. Owned by morph_plan_run(). */
typedef struct morph_planner {
    const morph_scene *scene;
    const morph_plan_options *options;
    morph_plan *plan;
    morph_workspace work;
    morph_trajectory nominal, attracted;
    const morph_trajectory
        *way;    /* of the two, the one whose end is refined and whose frames a path may follow */
    double *end; /* 3*joints: the shape to reach */
    morph_refine_report refined;
    morph_curve *curve;
    morph_timing timing;
    bool stopped;
    bool guided; /* the end is that of the blanket under attraction */
    bool optimal;
    morph_control quiet; /* the caller's control without its stop: after a stop the rest is done cheaply, not
                            cut short */
} morph_planner;

/** The caller's control, or after a stop the one without its stop: the stages go on with what there is. */
const morph_control *morph_planner_control(const morph_planner *p);

/** Adds the seconds since `since` to a stage of the summary. */
void morph_planner_time(morph_planner *p, morph_stage stage, double since);

/** Notes in the summary how exact the distance field is. */
void morph_planner_accuracy(morph_planner *p);

/** Measures joints x (3*joints, m) against the target raised by `lift` (m): the pose is seen from there.
 *  Fails with MORPH_ERR_NOMEM. */
morph_status morph_planner_measure(const morph_planner *p, const double *x, double lift, morph_measure *out);

/** The connected cavities of the same pose; places are the pose's own, not the raised target's. */
morph_status morph_planner_cavities(const morph_planner *p, const double *x, double lift,
                                    morph_cavity_list *out);

/** The stages, in their order in the plan. Each notes its seconds and effort in the summary, turns a stop
 * into `stopped`, and returns an error only where nothing can go on. */
morph_status morph_stage_nominal(morph_planner *p);
morph_status morph_stage_placement(morph_planner *p);
morph_status morph_stage_refine(morph_planner *p);
morph_status morph_stage_path(morph_planner *p);
morph_status morph_stage_timing(morph_planner *p);

#endif
