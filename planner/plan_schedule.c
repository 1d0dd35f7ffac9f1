/** From the blanket's end to a schedule: refinement, path and timing of a plan. */
#include "planner/plan_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The blanket does not feel itself: where its axes pass through each other no path can follow. Its frames
 * count up to the one before the first such; the refinement starts there and closes the rest itself. */
static morph_status cut_tangle(morph_planner *p) {
    const morph_structure *st = p->work.structure;
    const size_t width = 3 * (size_t)st->joints;
    /* Axes nearer than three quarters of their radii's sum are about to pass: from frame to frame they move
     * less than that. */
    const double close = 0.5 * st->def.radius / st->spacing;
    double *x = morph_alloc(width, sizeof(double));
    morph_status status = x ? MORPH_OK : MORPH_ERR_NOMEM;
    int clean = 0;
    for (; clean < p->nominal.frames && status == MORPH_OK; clean++) {
        morph_violation v;
        for (size_t i = 0; i < width; i++)
            x[i] = p->nominal.x[(size_t)clean * width + i] / st->spacing;
        status = morph_pose_examine(&p->work.world, x, NULL, NULL, NULL, NULL, &v);
        if (v.amount[MORPH_LIMIT_SELF] > close) break;
    }
    free(x);
    if (status == MORPH_OK && clean > 1 && clean < p->nominal.frames) {
        morph_log(morph_planner_control(p),
                  "refine: the blanket passes through itself after %.2f s: going on from there",
                  p->nominal.time[clean - 1]);
        p->nominal.frames = clean;
        memcpy(p->end, &p->nominal.x[(size_t)(clean - 1) * width], width * sizeof *p->end);
    }
    return status;
}

/* Refines p->end into *report. */
static morph_status refine(morph_planner *p, morph_refine_report *report) {
    morph_refine_options o = morph_refine_defaults();
    o.control = morph_planner_control(p);
    o.goal = p->scene->goal;
    morph_status status = morph_refine(&p->work.world, &o, p->end, report);
    if (status == MORPH_ERR_STOPPED) {
        p->stopped = true;
        status = MORPH_OK;
    }
    morph_summary *s = &p->plan->summary;
    s->iterations_refine += report->effort.iterations;
    s->linear_seconds += report->effort.linear_seconds;
    s->callback_seconds += report->effort.callback_seconds;
    return status;
}

/* A goal that was missed from where attraction led may be in reach from where the pure blanket lay: the shape
 * that misses it by less is kept. */
static morph_status refine_nominal(morph_planner *p) {
    const size_t width = 3 * (size_t)p->work.structure->joints;
    double *end = morph_alloc(width, sizeof *end);
    if (!end) return MORPH_ERR_NOMEM;
    memcpy(end, p->end, width * sizeof *end);
    memcpy(p->end, &p->nominal.x[(size_t)(p->nominal.frames - 1) * width], width * sizeof *p->end);
    morph_log(morph_planner_control(p),
              "refine: the goal is missed from the guided blanket's end: from the pure one's");
    morph_refine_report other = {0};
    morph_status status = cut_tangle(p);
    if (status == MORPH_OK) status = refine(p, &other);
    if (status == MORPH_OK && other.feasible && other.miss < p->refined.miss) {
        const morph_refine_report worse = p->refined;
        p->refined = other;
        other = worse;
        p->way = &p->nominal;
    } else {
        memcpy(p->end, end, width * sizeof *end);
    }
    morph_refine_report_free(&other);
    free(end);
    return status;
}

morph_status morph_stage_refine(morph_planner *p) {
    if (p->options->method != MORPH_METHOD_IPOPT || p->stopped) return MORPH_OK;
    const double since = morph_seconds();
    morph_status status = p->guided ? MORPH_OK : cut_tangle(p);
    if (status == MORPH_OK) status = refine(p, &p->refined);
    if (status == MORPH_OK && p->guided && p->refined.miss > 0.0 && !p->stopped) status = refine_nominal(p);
    morph_summary *s = &p->plan->summary;
    s->unknowns_refine = p->refined.effort.unknowns;
    s->rows_refine_used = p->refined.effort.rows;
    s->rows_refine_possible = p->refined.rows_possible;
    p->optimal = p->refined.last == MORPH_OPTIMAL;
    morph_planner_time(p, MORPH_STAGE_REFINE, since);
    return status;
}

/* One way to a path; kept if it is feasible or breaks its limits less than the one before. */
static morph_status try_path(morph_planner *p, bool unfold, bool stations, int intervals, double *least) {
    morph_path_options o = morph_path_defaults();
    o.control = morph_planner_control(p);
    o.refine = p->options->method == MORPH_METHOD_IPOPT && !p->stopped;
    o.unfold = unfold;
    if (stations) {
        o.stations = p->refined.stations;
        o.station = p->refined.station;
        o.smoothness = 1.0; /* the stations are small steps already: little smoothing keeps them inside */
    }
    o.intervals = intervals;
    morph_curve *curve = NULL;
    morph_path_report r;
    const morph_status status =
        morph_path_plan(&p->work.world, p->way, p->work.start, p->end, &o, &curve, &r);
    morph_summary *s = &p->plan->summary;
    s->iterations_path += r.effort.iterations;
    s->linear_seconds += r.effort.linear_seconds;
    s->callback_seconds += r.effort.callback_seconds;
    const double worst = morph_violation_worst(&r.violation, morph_pose_tolerance, NULL);
    if (status == MORPH_OK && curve && (!p->curve || worst < *least)) {
        morph_curve_destroy(p->curve);
        p->curve = curve;
        *least = worst;
        s->unknowns_path = r.effort.unknowns;
        s->rows_path_used = r.effort.rows;
        s->rows_path_possible = r.rows_possible;
    } else {
        morph_curve_destroy(curve);
    }
    return status;
}

/* First stepped back from the end; then along the blanket's own way and the poses that the refinement went
 * through; last stepped back in more poses: the first that holds is taken. The pure blanket, and what is left
 * after a stop, get their poses without a solve. */
morph_status morph_stage_path(morph_planner *p) {
    static const struct {
        bool unfold, stations;
        int intervals;
    } ways[] = {{true, false, 12}, {false, true, 24}, {true, false, 24}};
    const double since = morph_seconds();
    double least = INFINITY;
    morph_status status = MORPH_OK;
    for (size_t k = 0; k < sizeof ways / sizeof *ways && status == MORPH_OK; k++) {
        if (p->options->method != MORPH_METHOD_IPOPT || p->stopped) break;
        status = try_path(p, ways[k].unfold, ways[k].stations, ways[k].intervals, &least);
        if (status == MORPH_ERR_STOPPED || morph_stopped(p->options->control)) {
            p->stopped = true;
            status = MORPH_OK;
        }
        if (p->curve && least <= 1.0) break;
    }
    if (status == MORPH_OK && !p->curve) status = try_path(p, false, false, 24, &least);
    morph_planner_time(p, MORPH_STAGE_PATH, since);
    return status;
}

/* A path that breaks its limits can ask for hours: its record is sampled more coarsely rather than filling
 * the memory, and is not feasible. */
static double sample_step(morph_planner *p) {
    const double most = MORPH_SCENE_SAMPLES, samples = p->timing.duration / p->scene->sample;
    morph_summary *s = &p->plan->summary;
    if (samples < most + 0.5) return p->scene->sample; /* whole but for rounding */
    if (!s->reason[0])
        snprintf(s->reason, sizeof s->reason,
                 "schedule.sample: %.6g s would make %.0f samples of a schedule of %.6g s, at most %.0f are "
                 "written",
                 p->scene->sample, samples, p->timing.duration, most);
    return p->timing.duration / most;
}

morph_status morph_stage_timing(morph_planner *p) {
    const double since = morph_seconds();
    const morph_timing_options o = {p->scene->duration, p->scene->sample, morph_planner_control(p)};
    morph_timing_report r;
    morph_progress(o.control, "timing", 0.0);
    morph_status status = morph_timing_solve(p->curve, &o, &p->timing, &r);
    morph_summary *s = &p->plan->summary;
    s->iterations_timing = r.iterations;
    s->linear_seconds += r.linear_seconds;
    s->duration = p->timing.duration;
    if (status == MORPH_OK && p->scene->duration > 0.0 && r.needed > p->scene->duration)
        snprintf(s->reason, sizeof s->reason,
                 "schedule.duration: %.6g s is too short: this path needs %.6g s", p->scene->duration,
                 r.needed);
    if (status == MORPH_OK)
        status = morph_record_schedule(&p->plan->record, p->curve, &p->timing, sample_step(p));
    morph_planner_time(p, MORPH_STAGE_TIMING, since);
    return status;
}
