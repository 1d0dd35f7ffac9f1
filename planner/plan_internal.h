#ifndef MORPH_PLANNER_PLAN_INTERNAL_H
#define MORPH_PLANNER_PLAN_INTERNAL_H
/** What the stages of a plan (plan.c, plan_nominal.c, plan_placement.c, plan_schedule.c) share. Not for
 * others. */

#include "planner/placement.h"
#include "planner/plan.h"

/** What a plan that is in hand already is worth: the schedule's part of a record, and its numbers. Zeroed:
 * none.
 */
typedef struct morph_draft {
    bool there, optimal, late;
    morph_record record; /**< path/, timing/, schedule/ and mobility/ only; owned */
    morph_summary summary;
    double made; /**< when: morph_seconds() */
    double path_seconds,
        tail_seconds; /**< what such a path takes, and all that follows it, writing included */
} morph_draft;

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
    bool late;           /* the budget cut something short */
    bool lost;           /* a solver died, or was refused memory: what there was before it is kept */
    double started;      /* morph_seconds() */
    double deadline;     /* of the stage in hand, morph_seconds(); INFINITY: none */
    morph_control timed; /* the caller's control, its stop joined by the deadline; user is this planner */
    morph_control quiet; /* without the caller's stop: after a stop the rest is done cheaply, not cut short */
    morph_draft draft;   /* with a budget: a plan made early, at little cost */
} morph_planner;

/** The caller's control, or after a stop the one without its stop: the stages go on with what there is. Both
 * stop at the deadline. */
const morph_control *morph_planner_control(const morph_planner *p);

/** Fills timed and quiet; *p must not move afterwards. */
void morph_planner_listen(morph_planner *p);

/** After MORPH_ERR_STOPPED of a stage: whose stop it was, the caller's (stopped) or the deadline's (late,
 * noted once for `stage` in the summary's warning). Other statuses are returned as they are, this one as
 * MORPH_OK. */
morph_status morph_planner_ended(morph_planner *p, morph_status status, morph_stage stage);

/** A solver's death is an outcome: MORPH_ERR_BACKEND and MORPH_ERR_NOMEM become MORPH_OK, with a note. */
morph_status morph_planner_survive(morph_planner *p, morph_status status, morph_stage stage);

/** One more clause of the summary's warning; told to the caller at the end. */
void morph_planner_warn(const morph_planner *p, const char *format, ...);

/** With a budget: the deadline of a stage from what the draft took. Without: none, but after a stop a few
 * seconds to move the end inside its limits, and for the path. */
void morph_planner_limit(morph_planner *p, morph_stage stage);

/** Whether the plan in hand is the draft of a budget. */
bool morph_planner_drafts(const morph_planner *p);

/** Shows whether there is time for better than the draft. */
bool morph_planner_has_time(const morph_planner *p);

/** Moves what the schedule is from one record to another, whose own is freed. */
void morph_planner_move_schedule(morph_record *from, morph_record *to);

/** Puts the plan in hand aside as the draft, and forgets it. */
void morph_planner_keep_draft(morph_planner *p, double path_seconds, double tail_seconds);

/** Takes the draft in the place of the plan in hand if it is better, or if there is none (status): then
 * *status becomes MORPH_OK. */
void morph_planner_choose(morph_planner *p, morph_status *status);

/** The seconds that writing the record will take, by a trial of its slowest part. */
double morph_planner_write_seconds(const morph_record *record);

/** The piece of a curve from its start to where it first breaks a limit, as a curve of its own; *out NULL
 * where no piece holds. *kept: the share of the way. Fails with MORPH_ERR_NOMEM. */
morph_status morph_planner_trim(const morph_planner *p, const morph_curve *curve, morph_curve **out,
                                double *kept);

/** Moves the end on under the target's rise where the way's last frame has it short of its place: as far as
 *  limits are held. Fails as morph_project does; the end is then the last pose that held. */
morph_status morph_planner_raise(morph_planner *p);

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
/** Only moves the end inside its limits. */
morph_status morph_stage_project(morph_planner *p);
morph_status morph_stage_path(morph_planner *p);
morph_status morph_stage_timing(morph_planner *p);

#endif
