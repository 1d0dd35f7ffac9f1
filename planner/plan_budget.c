/** Time of a plan: whose stop ended a stage, what the stages may take of a budget, and the draft, a feasible
 * plan made early that stands until there is a better one. */
#include "planner/plan_internal.h"

#include "planner/schedule_file.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* After the caller's stop a path may still be solved for so long, s: what a person waits for who has asked
 * for the best so far, and the second signal does not wait. */
#define GRACE 3.0

/* Of the time that is left of a budget, what the stages may take until there is a draft to tell: the blanket,
 * the end moved inside its limits, the path, its timing. */
#define SHARE_NOMINAL 0.5
#define SHARE_PROJECT 0.25
#define SHARE_PATH 0.4
#define SHARE_TIMING 0.3

/* Of the time for a better plan, what centres of attraction may take: refining the end gains more. */
#define SHARE_PLACEMENT 0.35

/* The next path may be the second way or have more poses than the draft's, and its schedule may be longer. */
#define PATH_AGAIN 1.5
/* What a path gets at least of the time after the draft: a refined end without one is worth nothing. */
#define PATH_LEAST 0.3
#define TAIL_AGAIN 1.15

/* Less than this of the budget is not worth beginning a better plan. */
#define LEAST_SHARE 0.05

static bool past(const morph_planner *p) {
    return morph_seconds() > p->deadline;
}

static int timed_stop(void *user) {
    const morph_planner *p = user;
    return morph_stopped(p->options->control) || past(p);
}

static int quiet_stop(void *user) {
    return past(user);
}

static void pass_progress(void *user, const char *stage, double fraction) {
    morph_progress(((const morph_planner *)user)->options->control, stage, fraction);
}

static void pass_log(void *user, const char *line) {
    morph_log(((const morph_planner *)user)->options->control, "%s", line);
}

void morph_planner_listen(morph_planner *p) {
    p->deadline = INFINITY;
    p->timed = (morph_control){timed_stop, pass_progress, pass_log, p};
    p->quiet = (morph_control){quiet_stop, pass_progress, pass_log, p};
}

void morph_planner_warn(const morph_planner *p, const char *format, ...) {
    char clause[400], *text = p->plan->summary.warning;
    const size_t used = strlen(text), size = sizeof p->plan->summary.warning;
    va_list values;
    va_start(values, format);
    vsnprintf(clause, sizeof clause, format, values);
    va_end(values);
    if (strstr(text, clause)) return;
    snprintf(text + used, size - used, "%s%s", used > 0 ? "; " : "", clause);
}

morph_status morph_planner_ended(morph_planner *p, morph_status status, morph_stage stage) {
    const bool asked = morph_stopped(p->options->control);
    if (asked) p->stopped = true;
    if (status != MORPH_ERR_STOPPED) return status;
    if (!asked && !p->stopped) {
        p->late = true;
        morph_planner_warn(p, "the budget of %g s cut %s short", p->options->budget, morph_stage_name(stage));
    }
    return MORPH_OK;
}

morph_status morph_planner_survive(morph_planner *p, morph_status status, morph_stage stage) {
    if (status != MORPH_ERR_BACKEND && status != MORPH_ERR_NOMEM) return status;
    p->lost = true;
    morph_planner_warn(p, "%s: a solver ended without a result (%s): the best before it is kept",
                       morph_stage_name(stage), morph_status_text(status));
    return MORPH_OK;
}

/* With a draft its times tell; without, the shares. */
static double budget_deadline(const morph_planner *p, morph_stage stage) {
    const morph_draft *d = &p->draft;
    const double now = morph_seconds(), end = p->started + p->options->budget, left = fmax(0.0, end - now);
    const double timing = end - TAIL_AGAIN * d->tail_seconds,
                 path = timing - fmax(PATH_AGAIN * d->path_seconds, PATH_LEAST * (timing - d->made));
    switch (stage) {
    case MORPH_STAGE_NOMINAL:
        return now + SHARE_NOMINAL * left;
    case MORPH_STAGE_PLACEMENT:
        return now + SHARE_PLACEMENT * (path - now);
    case MORPH_STAGE_REFINE:
        return d->there ? path : now + SHARE_PROJECT * left;
    case MORPH_STAGE_PATH:
        return d->there ? timing : now + SHARE_PATH * left;
    case MORPH_STAGE_TIMING:
        return d->there ? end - 0.8 * d->tail_seconds : now + SHARE_TIMING * left;
    case MORPH_STAGE_REPLAY:
        return end - morph_planner_write_seconds(&p->plan->record);
    case MORPH_STAGE_TARGET:
    case MORPH_STAGE_MEASURE:
    case MORPH_STAGE_CHECK:
    case MORPH_STAGE_WRITE:
        break;
    }
    return INFINITY;
}

void morph_planner_limit(morph_planner *p, morph_stage stage) {
    p->deadline = INFINITY;
    if (p->options->budget > 0.0) p->deadline = budget_deadline(p, stage);
    if (p->stopped && (stage == MORPH_STAGE_PATH || stage == MORPH_STAGE_REFINE))
        p->deadline = fmin(p->deadline, morph_seconds() + GRACE);
}

bool morph_planner_has_time(const morph_planner *p) {
    if (!(p->options->budget > 0.0) || !p->draft.there) return !p->stopped;
    return !p->stopped && budget_deadline(p, MORPH_STAGE_REFINE) - morph_seconds() >
                              fmax(LEAST_SHARE * p->options->budget, 0.5 * p->draft.path_seconds);
}

bool morph_planner_drafts(const morph_planner *p) {
    return p->options->budget > 0.0 && !p->draft.there;
}

#define TAKE(field) (to->field = from->field, from->field = NULL)

static void take_schedule(morph_record *from, morph_record *to) {
    to->poses = from->poses;
    to->pose_width = from->pose_width;
    to->timing_knots = from->timing_knots;
    to->timing_controls = from->timing_controls;
    to->samples = from->samples;
    to->mobility_samples = from->mobility_samples;
    TAKE(path_s);
    TAKE(path_poses);
    TAKE(timing_knot);
    TAKE(timing_control);
    TAKE(timing_duration);
    TAKE(time);
    TAKE(schedule_joints);
    TAKE(length);
    TAKE(rate);
    TAKE(acceleration);
    TAKE(offset_schedule);
    TAKE(mobility_sample);
    TAKE(mobility_rank);
    TAKE(mobility_free);
    TAKE(mobility_redundant);
    TAKE(mobility_sigma_min);
    from->samples = from->poses = from->mobility_samples = from->timing_knots = from->timing_controls = 0;
}

void morph_planner_move_schedule(morph_record *from, morph_record *to) {
    morph_record old = {0};
    take_schedule(to, &old);
    morph_record_free(&old);
    take_schedule(from, to);
}

void morph_planner_keep_draft(morph_planner *p, double path_seconds, double tail_seconds) {
    morph_summary *s = &p->plan->summary;
    p->draft.there = true;
    p->draft.optimal = p->optimal;
    p->draft.late = p->late;
    p->draft.path_seconds = path_seconds;
    p->draft.tail_seconds = tail_seconds;
    p->draft.made = morph_seconds();
    p->draft.summary = *s;
    morph_planner_move_schedule(&p->plan->record, &p->draft.record);
    morph_curve_destroy(p->curve);
    p->curve = NULL;
    morph_timing_free(&p->timing);
    morph_refine_report_free(&p->refined);
    p->refined = (morph_refine_report){0};
    p->optimal = false;
    s->has_plan = s->feasible = false;
    s->reason[0] = '\0';
}

/* What belongs to the schedule; what was spent, and what the other stages found, stays. */
static void take_numbers(const morph_summary *from, morph_summary *to) {
    to->has_plan = from->has_plan;
    to->plan = from->plan;
    to->check = from->check;
    to->feasible = from->feasible;
    memcpy(to->reason, from->reason, sizeof to->reason);
    to->free_motions = from->free_motions;
    to->redundant = from->redundant;
    to->sigma_min = from->sigma_min;
    to->duration = from->duration;
    to->single_link_seconds = from->single_link_seconds;
    to->single_link = from->single_link;
}

void morph_planner_choose(morph_planner *p, morph_status *status) {
    morph_draft *d = &p->draft;
    morph_summary *s = &p->plan->summary;
    if (!d->there) return;
    const bool lost = *status == MORPH_ERR_NOMEM || *status == MORPH_ERR_BACKEND;
    if (*status != MORPH_OK && !((lost || *status == MORPH_ERR_STOPPED) && d->summary.feasible)) return;
    if (lost) morph_planner_survive(p, *status, MORPH_STAGE_REFINE);
    const bool better = d->summary.feasible != s->feasible ? d->summary.feasible
                                                           : d->summary.plan.objective < s->plan.objective;
    if (*status != MORPH_OK || !s->has_plan || better) {
        morph_planner_move_schedule(&d->record, &p->plan->record);
        take_numbers(&d->summary, s);
        p->optimal = d->optimal;
        p->late = p->late || d->late;
        if (d->summary.warning[0]) morph_planner_warn(p, "%s", d->summary.warning);
        morph_planner_warn(p, "the plan is the one made first, from the blanket's end");
    }
    *status = MORPH_OK;
}

/* Rows of schedule.csv that a trial writes. */
enum { TRIAL = 40 };

/* Numbers become text in schedule.csv, and the trial tells how long one takes here and now. The record goes
 * to the disk and is read for its checksum, at 50 MB/s where others are at work too. The report's pictures
 * take as long as so many numbers: 170 to 280 thousand from 4 x 4 to 8 x 8 nodes. */
double morph_planner_write_seconds(const morph_record *record) {
    const double pictures = 2.5e5;
    if (record->samples < 2 || !record->time) return 0.0;
    const double since = morph_seconds(), samples = record->samples;
    morph_record few = *record; /* borrows every array */
    few.samples = (int)fmin(TRIAL, samples);
    morph_text text;
    if (morph_schedule_csv(&few, &text) == MORPH_OK) morph_text_free(&text);
    const double row = (morph_seconds() - since) / few.samples, number = row / (record->links + 1);
    const double bytes = 8.0 * (samples * (3.0 * record->joints + 3.0 * record->links) +
                                record->nominal_frames * (3.0 * record->joints + record->links));
    return row * samples + bytes / 5e7 + pictures * number + 0.05;
}
