#include "planner/plan_internal.h"

#include "planner/reach_text.h"
#include "planner/start.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

/* After a stop the stages go on with what there is. */
const morph_control *morph_planner_control(const morph_planner *p) {
    return p->stopped ? &p->quiet : &p->timed;
}

void morph_planner_time(morph_planner *p, morph_stage stage, double since) {
    p->plan->summary.seconds[stage] += morph_seconds() - since;
}

void morph_planner_accuracy(morph_planner *p) {
    morph_summary *s = &p->plan->summary;
    s->sdf_cell = p->work.accuracy.cell;
    s->sdf_rms = p->work.accuracy.rms;
    s->sdf_max = p->work.accuracy.max;
}

/* The pose as it is seen from a target raised by `lift`; free(). NULL: memory refused. */
static double *seen_from_target(const morph_planner *p, const double *x, double lift) {
    const int n = 3 * p->work.structure->joints;
    double *seen = morph_alloc((size_t)n, sizeof(double));
    for (int i = 0; seen && i < n; i++)
        seen[i] = x[i] - (i % 3 == 2 ? lift : 0.0);
    return seen;
}

/* Measures where the target stands: the pose is seen from there. */
morph_status morph_planner_measure(const morph_planner *p, const double *x, double lift, morph_measure *out) {
    double *seen = seen_from_target(p, x, lift);
    if (!seen) return MORPH_ERR_NOMEM;
    const morph_status status = morph_cavity_measure(p->work.cavity, seen, out);
    free(seen);
    return status;
}

morph_status morph_planner_cavities(const morph_planner *p, const double *x, double lift,
                                    morph_cavity_list *out) {
    const morph_structure *st = p->work.structure;
    *out = (morph_cavity_list){0};
    double *seen = seen_from_target(p, x, lift);
    if (!seen) return MORPH_ERR_NOMEM;
    morph_cavity_parts parts;
    const morph_status status =
        morph_cavity_parts_find(p->work.cavity, seen, st->spacing / MORPH_CAVITY_COLUMNS,
                                morph_cavity_film(st), MORPH_CAVITY_SHARE, &parts);
    free(seen);
    if (status != MORPH_OK) return status;
    out->volume = parts.volume;
    out->film = parts.film;
    for (; out->count < parts.count && out->count < MORPH_CAVITIES; out->count++) {
        morph_cavity_part *part = &out->part[out->count];
        *part = parts.part[out->count];
        part->at[2] += lift;
        part->lo[2] += lift;
        part->hi[2] += lift;
    }
    morph_cavity_parts_free(&parts);
    return MORPH_OK;
}

/* Findings of the reach check, one line each; a ridge that the sheet rounds off is left to `info`. */
static void note_reach(const morph_planner *p) {
    char line[400];
    for (int k = 0; k < MORPH_REACH_KINDS && p->options->warn; k++) {
        if (k == MORPH_REACH_BEND) continue;
        morph_reach_sentence(&p->plan->summary.reach, (morph_reach_kind)k, line, sizeof line);
        if (line[0]) p->options->warn(p->options->control ? p->options->control->user : NULL, line);
    }
}

static morph_status stage_target(morph_planner *p) {
    const double since = morph_seconds();
    morph_progress(morph_planner_control(p), "target", 0.0);
    morph_status status = morph_workspace_create(p->scene, morph_planner_control(p), &p->work);
    if (status == MORPH_OK)
        status = morph_scene_reach(p->scene, p->work.structure, p->work.exact, &p->plan->summary.reach);
    if (status == MORPH_OK) {
        note_reach(p);
        morph_planner_accuracy(p);
        status =
            morph_record_structure(&p->plan->record, p->work.structure, &p->scene->target, p->scene->base);
        p->plan->record.goal = p->scene->goal;
    }
    morph_planner_time(p, MORPH_STAGE_TARGET, since);
    return status;
}

static morph_status stage_measure(morph_planner *p) {
    const double since = morph_seconds();
    morph_record *r = &p->plan->record;
    morph_summary *s = &p->plan->summary;
    const size_t width = 3 * (size_t)p->work.structure->joints;
    morph_progress(morph_planner_control(p), "measure", 0.0);
    const double *end = &r->schedule_joints[(size_t)(r->samples - 1) * width];
    const double lift = r->offset_schedule[3 * (size_t)(r->samples - 1) + 2];
    morph_status status = morph_planner_measure(p, end, lift, &s->plan);
    s->has_plan = status == MORPH_OK;
    if (status == MORPH_OK) status = morph_planner_cavities(p, end, lift, &s->cavities_plan);
    if (status == MORPH_OK) status = morph_record_mobility(r, p->work.structure);
    if (status == MORPH_OK) {
        const int last = r->mobility_samples - 1;
        s->free_motions = r->mobility_free[last];
        s->redundant = r->mobility_redundant[last];
        s->sigma_min = r->mobility_sigma_min[last];
    }
    morph_planner_time(p, MORPH_STAGE_MEASURE, since);
    return status;
}

/* What lasts longer than this is no morph that anybody waits for, and its replay would take minutes; where
 * limits are broken anyway, sheets that crumple make it hours. */
#define LONGEST_REPLAY 120.0           /* s */
#define LONGEST_INFEASIBLE_REPLAY 10.0 /* s */

/* What the lengths alone do: once as the scene says the structure is carried, once over the target as a solid
 * core. */
static morph_status stage_replay(morph_planner *p) {
    morph_summary *s = &p->plan->summary;
    morph_record *r = &p->plan->record;
    if (p->stopped) return MORPH_OK;
    morph_planner_limit(p, MORPH_STAGE_REPLAY);
    if (s->duration > (s->feasible ? LONGEST_REPLAY : LONGEST_INFEASIBLE_REPLAY)) {
        morph_log(morph_planner_control(p), "replay: left out, a schedule of %.0f s is too long",
                  s->duration);
        return MORPH_OK;
    }
    const double since = morph_seconds();
    const bool on_target = p->work.structure->def.support == MORPH_SUPPORT_TARGET;
    morph_replay_input in = {.structure = p->work.structure,
                             .scene = p->scene,
                             .cavity = p->work.cavity,
                             .samples = r->samples,
                             .joints = r->schedule_joints,
                             .length = r->length};
    in.step = r->samples > 1 ? r->time[1] - r->time[0] : p->scene->sample;
    morph_status status = MORPH_OK;
    for (int core = on_target ? 1 : 0; core < 2 && status == MORPH_OK; core++) {
        morph_trajectory t;
        in.core = core ? p->work.sdf : NULL;
        status = morph_replay_run(&in, morph_planner_control(p), &t,
                                  core && !on_target ? &s->replay_core : &s->replay);
        if (status == MORPH_OK && core && !on_target)
            morph_record_replay(&t, &r->core_frames, &r->core_time, &r->core_joints);
        else if (status == MORPH_OK)
            morph_record_replay(&t, &r->replay_frames, &r->replay_time, &r->replay_joints);
    }
    status = morph_planner_ended(p, status, MORPH_STAGE_REPLAY);
    p->deadline = INFINITY;
    /* A schedule that throws the structure about until no number is left is a finding, not our failure. */
    if (status == MORPH_ERR_NONFINITE) {
        morph_log(morph_planner_control(p), "replay: the lengths throw the structure about without bound");
        status = MORPH_OK;
    } else if (status == MORPH_ERR_MOTION) {
        morph_log(morph_planner_control(p), "replay: the lengths throw the structure through the target");
        status = MORPH_OK;
    }
    morph_planner_time(p, MORPH_STAGE_REPLAY, since);
    return status;
}

/* "goal: mean_gap 0.0123 m, wanted 0.01 m, at 2.110 s (missed by 0.0023 m): against it stood: ..." */
static void say_missed(morph_planner *p) {
    morph_summary *s = &p->plan->summary;
    const morph_margin *m = &s->check.margin[MORPH_MARGIN_GOAL];
    const char *against = p->refined.against;
    snprintf(s->reason, sizeof s->reason, "goal: %s, at %.3f s (missed by %.3g%s)", m->element, m->time,
             -m->worst, m->unit[0] == 'm' ? " m" : "");
    const size_t used = strlen(s->reason);
    if (against[0]) snprintf(s->reason + used, sizeof s->reason - used, ": against it stood: %s", against);
}

/* The check alone decides; a duration that cannot be met makes the plan infeasible too. */
static morph_status stage_check(morph_planner *p) {
    const double since = morph_seconds();
    morph_summary *s = &p->plan->summary;
    p->deadline = INFINITY;
    morph_progress(morph_planner_control(p), "check", 0.0);
    const morph_status status = morph_check_record(&p->plan->record, &p->quiet, &s->check);
    morph_planner_time(p, MORPH_STAGE_CHECK, since);
    if (status != MORPH_OK) return status;
    s->feasible = s->check.feasible && s->reason[0] == '\0';
    if (!s->check.feasible && s->check.defect[0])
        snprintf(s->reason, sizeof s->reason, "the schedule is unusable: %s", s->check.defect);
    else if (!s->check.feasible && s->check.worst == MORPH_MARGIN_GOAL)
        say_missed(p);
    else if (!s->check.feasible) {
        const morph_margin *m = &s->check.margin[s->check.worst];
        snprintf(s->reason, sizeof s->reason, "%s: %s at %.3f s: beyond by %.3g %s%s",
                 morph_margin_name(s->check.worst), m->element, m->time, -m->worst,
                 morph_margin_unit(s->check.worst), morph_check_hint(&s->check));
    }
    return MORPH_OK;
}

/* A budget that ran out is no fault where the plan holds. */
static void conclude(morph_planner *p) {
    morph_summary *s = &p->plan->summary;
    const morph_outcome outcome = p->stopped || (p->late && !s->feasible) ? MORPH_STOPPED
                                  : !s->feasible                          ? MORPH_INFEASIBLE
                                  : p->optimal                            ? MORPH_OPTIMAL
                                                                          : MORPH_FEASIBLE;
    s->budget_ran_out = p->late;
    if ((p->late || p->lost || p->stopped) && s->warning[0] && p->options->warn)
        p->options->warn(p->options->control ? p->options->control->user : NULL, s->warning);
    snprintf(s->outcome, sizeof s->outcome, "%s", morph_outcome_text(outcome));
    snprintf(p->plan->record.outcome, sizeof p->plan->record.outcome, "%s", s->outcome);
}

static void describe(morph_planner *p) {
    morph_summary *s = &p->plan->summary;
    morph_record *r = &p->plan->record;
    snprintf(s->title, sizeof s->title, "%s", p->scene->title ? p->scene->title : "");
    snprintf(s->scene, sizeof s->scene, "%s", p->scene->file ? p->scene->file : "");
    snprintf(s->method, sizeof s->method, "%s",
             p->options->method == MORPH_METHOD_BLANKET ? "blanket"
             : p->options->method == MORPH_METHOD_NLOPT ? "nlopt"
                                                        : "ipopt");
    snprintf(s->level, sizeof s->level, "standard");
    const morph_start *start = &p->scene->start;
    snprintf(s->start.kind, sizeof s->start.kind, "%s", morph_start_name(start->kind));
    s->start.residual = start->residual;
    s->start.doubt = start->doubt;
    s->start.free_motions = start->free_motions;
    s->target_volume = p->scene->target_report.volume;
    s->spacing = p->scene->structure.spacing;
    snprintf(s->blas, sizeof s->blas, "%s", morph_blas_name());
    snprintf(r->program, sizeof r->program, "morphplan %s", MORPH_VERSION);
    memcpy(r->scene_sha256, p->scene->sha256, sizeof r->scene_sha256);
}

typedef morph_status stage_call(morph_planner *);

static morph_status run_in_turn(morph_planner *p, stage_call *const *stages, size_t count) {
    morph_status status = MORPH_OK;
    for (size_t k = 0; k < count && status == MORPH_OK; k++) {
        status = stages[k](p);
        p->deadline = INFINITY;
        if (status == MORPH_OK && morph_stopped(p->options->control)) p->stopped = true;
    }
    return status;
}

#define RUN(p, stages) run_in_turn(p, stages, sizeof(stages) / sizeof *(stages))

/* With a budget: from where the blanket ends, moved inside its limits, by the first path to a plan that
 * stands until there is a better one, and that tells what a plan takes. The end and the blanket stay as they
 * are for the stages that come. */
static morph_status make_draft(morph_planner *p) {
    static stage_call *const to_path[] = {morph_stage_project, morph_stage_path};
    static stage_call *const from_path[] = {morph_stage_timing, stage_measure, stage_check};
    if (!(p->options->budget > 0.0) || p->options->method != MORPH_METHOD_IPOPT || p->stopped)
        return MORPH_OK;
    const size_t bytes = 3 * (size_t)p->work.structure->joints * sizeof(double);
    const int frames = p->nominal.frames;
    double *end = morph_alloc(bytes, 1);
    if (!end) return MORPH_ERR_NOMEM;
    memcpy(end, p->end, bytes);
    const double before = p->plan->summary.seconds[MORPH_STAGE_PATH];
    const bool late = p->late;
    char warning[sizeof p->plan->summary.warning];
    memcpy(warning, p->plan->summary.warning, sizeof warning);
    p->late = false;
    p->plan->summary.warning[0] = '\0';
    morph_status status = RUN(p, to_path);
    const double path = p->plan->summary.seconds[MORPH_STAGE_PATH] - before, since = morph_seconds();
    if (status == MORPH_OK) status = RUN(p, from_path);
    if (status == MORPH_OK)
        morph_planner_keep_draft(p, path,
                                 morph_seconds() - since + morph_planner_write_seconds(&p->plan->record));
    memcpy(p->end, end, bytes);
    memcpy(p->plan->summary.warning, warning, sizeof warning);
    p->late = late;
    p->nominal.frames = frames;
    free(end);
    return status;
}

static morph_status run_stages(morph_planner *p) {
    static stage_call *const first[] = {stage_target, morph_stage_nominal};
    static stage_call *const second[] = {morph_stage_placement, morph_stage_refine, morph_stage_path,
                                         morph_stage_timing,    stage_measure,      stage_check};
    morph_status status = RUN(p, first);
    if (status == MORPH_OK) status = make_draft(p);
    if (status != MORPH_OK) return status;
    if (!p->draft.there || morph_planner_has_time(p)) {
        status = RUN(p, second);
    } else if (!p->stopped) {
        p->late = true;
        morph_planner_warn(p, "the budget of %g s left no time for a better plan", p->options->budget);
    }
    morph_planner_choose(p, &status);
    if (status == MORPH_OK) status = stage_replay(p);
    if (status == MORPH_OK && morph_stopped(p->options->control)) p->stopped = true;
    if (status == MORPH_OK) conclude(p);
    return status;
}

morph_status morph_plan_run(const morph_scene *scene, const morph_plan_options *options, morph_plan **out) {
    *out = NULL;
    const double since = morph_seconds();
    /* One BLAS thread: sums then repeat bit for bit. */
    morph_blas_threads(1);
    if (morph_blas_claim() != MORPH_OK) return MORPH_ERR_NOMEM;
    morph_planner p = {.scene = scene, .options = options, .started = since};
    p.way = &p.nominal;
    morph_planner_listen(&p);
    p.plan = calloc(1, sizeof *p.plan);
    if (!p.plan) return MORPH_ERR_NOMEM;
    describe(&p);
    p.plan->summary.budget = options->budget;
    const morph_status status = run_stages(&p);
    morph_record_free(&p.draft.record);
    morph_timing_free(&p.timing);
    morph_curve_destroy(p.curve);
    morph_refine_report_free(&p.refined);
    morph_trajectory_free(&p.nominal);
    morph_trajectory_free(&p.attracted);
    morph_workspace_free(&p.work);
    free(p.end);
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) == 0) p.plan->summary.peak_memory_bytes = usage.ru_maxrss * 1024L;
    p.plan->summary.total_seconds = morph_seconds() - since;
    if (status != MORPH_OK) {
        morph_plan_destroy(p.plan);
        return status;
    }
    *out = p.plan;
    return MORPH_OK;
}

void morph_plan_destroy(morph_plan *plan) {
    if (!plan) return;
    morph_record_free(&plan->record);
    free(plan);
}
