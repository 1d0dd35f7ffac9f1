/** From the blanket's end to a schedule: refinement, path and timing of a plan. */
#include "planner/plan_internal.h"
#include "planner/timing_against.h"
#include "planner/timing_bound.h"

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

/* Refines p->end into *report; rounds 0 only moves it inside its limits. */
static morph_status refine(morph_planner *p, int rounds, morph_refine_report *report) {
    morph_refine_options o = morph_refine_defaults();
    o.control = morph_planner_control(p);
    if (rounds > 0) o.goal = p->scene->goal;
    o.rounds = rounds;
    morph_status status = morph_planner_raise(p);
    if (status == MORPH_OK) status = morph_refine(&p->work.world, &o, p->end, report);
    status = morph_planner_ended(p, status, MORPH_STAGE_REFINE);
    status = morph_planner_survive(p, report->deaths > 0 && status == MORPH_OK ? MORPH_ERR_BACKEND : status,
                                   MORPH_STAGE_REFINE);
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
    if (status == MORPH_OK) status = refine(p, morph_refine_defaults().rounds, &other);
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

static void note_refined(morph_planner *p, double since) {
    morph_summary *s = &p->plan->summary;
    s->unknowns_refine = p->refined.effort.unknowns;
    s->rows_refine_used = p->refined.effort.rows;
    s->rows_refine_possible = p->refined.rows_possible;
    p->optimal = p->refined.last == MORPH_OPTIMAL && p->refined.rounds > 0 && !p->lost && !p->late;
    morph_planner_time(p, MORPH_STAGE_REFINE, since);
}

morph_status morph_stage_refine(morph_planner *p) {
    if (p->options->method != MORPH_METHOD_IPOPT) return MORPH_OK;
    if (p->stopped) return morph_stage_project(p);
    const double since = morph_seconds();
    const int rounds = morph_refine_defaults().rounds;
    morph_planner_limit(p, MORPH_STAGE_REFINE);
    morph_status status = p->guided ? MORPH_OK : cut_tangle(p);
    if (status == MORPH_OK) status = refine(p, rounds, &p->refined);
    if (status == MORPH_OK && p->guided && p->refined.miss > 0.0 && !p->stopped && !p->late)
        status = refine_nominal(p);
    note_refined(p, since);
    return status;
}

/* The frames on the way are nothing to it: none are cut. */
morph_status morph_stage_project(morph_planner *p) {
    const double since = morph_seconds();
    morph_planner_limit(p, MORPH_STAGE_REFINE);
    const morph_status status = refine(p, 0, &p->refined);
    note_refined(p, since);
    return status;
}

typedef struct way {
    bool unfold, stations, nearly; /* as of morph_path_options; stations: through those of the refinement */
    int intervals;
} way;

/* One way to a path; kept if it is feasible or breaks its limits less than the one before. */
static morph_status try_path(morph_planner *p, bool solve, way w, double *least) {
    morph_path_options o = morph_path_defaults();
    o.control = morph_planner_control(p);
    o.refine = solve;
    if (!solve && p->options->method == MORPH_METHOD_IPOPT) o.fine = 2; /* only to choose what to trim */
    o.smooth = p->options->method == MORPH_METHOD_IPOPT;
    o.unfold = w.unfold;
    o.nearly = w.nearly;
    o.whole = solve && !p->stopped && !morph_planner_drafts(p); /* drafts and what a stop leaves are cheap */
    if (w.stations && p->refined.stations > 0) {
        o.stations = p->refined.stations;
        o.station = p->refined.station;
        o.smoothness = 1.0; /* the stations are small steps already: little smoothing keeps them inside */
    }
    o.intervals = w.intervals;
    morph_curve *curve = NULL;
    morph_path_report r;
    /* The other methods' ways are the blanket's, which falls from flat. */
    o.in_place = p->options->method == MORPH_METHOD_IPOPT;
    o.bent = p->scene->start.pose && p->options->method == MORPH_METHOD_IPOPT;
    const morph_status status = morph_path_plan(
        &p->work.world, p->way, o.bent ? p->work.begin : p->work.start, p->end, &o, &curve, &r);
    morph_summary *s = &p->plan->summary;
    s->iterations_path += r.effort.iterations;
    s->linear_seconds += r.effort.linear_seconds;
    s->callback_seconds += r.effort.callback_seconds;
    const double worst = morph_violation_worst(&r.violation, morph_pose_tolerance, NULL);
    if (r.deaths > 0) morph_planner_survive(p, MORPH_ERR_BACKEND, MORPH_STAGE_PATH);
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

/* Poses without a solve, the quickest that there is. The pure blanket's way is that of its own. */
static morph_status plain_path(morph_planner *p, double *least) {
    p->deadline = INFINITY;
    morph_status status = try_path(p, false, (way){.intervals = 24}, least);
    if (status == MORPH_OK && p->refined.stations > 0 && *least > 1.0)
        status = try_path(p, false, (way){.stations = true, .intervals = 24}, least);
    return status;
}

/* The beginning that holds of the path in hand, where no better one could be had. */
static morph_status trim_path(morph_planner *p) {
    morph_curve *piece;
    double kept;
    p->deadline = INFINITY;
    const morph_status status = morph_planner_trim(p, p->curve, &piece, &kept);
    if (status != MORPH_OK || !piece) return status;
    if (kept >= 1.0) { /* all of it holds as it is */
        morph_curve_destroy(piece);
        return MORPH_OK;
    }
    morph_curve_destroy(p->curve);
    p->curve = piece;
    p->optimal = false;
    morph_planner_warn(p, "the path ends after %.1f %% of its way: beyond, it broke a limit", 100.0 * kept);
    return MORPH_OK;
}

/* First stepped back from the end; then so in more poses; last along the blanket's own way and the poses that
 * the refinement went through: the first that holds is taken. The last two are moved as a whole also where
 * they nearly hold. The pure blanket gets its poses without a solve. So does what is left of a path that was
 * cut short, by a stop, a budget or a solver's death: of that, what holds is kept. */
morph_status morph_stage_path(morph_planner *p) {
    /* The wider the sheet the further its joints go from pose to pose. */
    const int *nodes = p->work.structure->def.nodes;
    const bool wide = nodes[0] > 10 || nodes[1] > 10;
    const way ways[] = {{.unfold = true, .intervals = wide ? 24 : 12},
                        {.unfold = true, .intervals = wide ? 48 : 24, .nearly = true},
                        {.stations = true, .intervals = 24, .nearly = true}};
    const double since = morph_seconds();
    const bool solve = p->options->method == MORPH_METHOD_IPOPT;
    double least = INFINITY;
    morph_status status = MORPH_OK;
    bool cut = p->stopped || morph_planner_drafts(p);
    morph_planner_limit(p, MORPH_STAGE_PATH);
    for (size_t k = 0; k < sizeof ways / sizeof *ways && status == MORPH_OK && solve;) {
        const bool before = p->stopped;
        status = try_path(p, true, ways[k], &least);
        cut = cut || status != MORPH_OK;
        status = morph_planner_ended(p, status, MORPH_STAGE_PATH);
        status = morph_planner_survive(p, status, MORPH_STAGE_PATH);
        /* No way leads inside its limits to an end that is not. */
        if (p->curve && (least <= 1.0 || !p->refined.feasible)) break;
        cut = cut || p->stopped || p->lost || morph_seconds() > p->deadline;
        if (!before && p->stopped) {
            morph_planner_limit(p, MORPH_STAGE_PATH); /* the same way again, in the time that a stop leaves */
            continue;
        }
        /* After a stop, without time, or for a draft one way is all there is. */
        if (p->stopped || morph_planner_drafts(p) || morph_seconds() > p->deadline) break;
        k++;
    }
    /* With a plan in hand nothing is patched up for want of time. */
    if (status == MORPH_OK && !p->curve && !p->stopped && p->draft.there && p->draft.summary.feasible)
        status = MORPH_ERR_STOPPED;
    const bool plain = !p->curve || (solve && cut && least > 1.0 && !p->draft.there);
    if (status == MORPH_OK && plain) status = plain_path(p, &least);
    if (status == MORPH_OK && solve && cut && (plain || least > 1.0)) status = trim_path(p);
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

/* The limits that a duration leaves too little time for. */
static morph_status say_too_short(morph_planner *p, double needed) {
    morph_summary *s = &p->plan->summary;
    char against[400];
    const morph_status status =
        morph_timing_against(p->curve, &p->timing, p->scene->duration, against, sizeof against);
    if (status != MORPH_OK) return status;
    snprintf(s->reason, sizeof s->reason,
             "schedule.duration: %.6g s is too short: this path needs %.6g s%s%s", p->scene->duration, needed,
             against[0] ? ": against it stood: " : "", against);
    return MORPH_OK;
}

morph_status morph_stage_timing(morph_planner *p) {
    const double since = morph_seconds();
    morph_planner_limit(p, MORPH_STAGE_TIMING);
    const morph_timing_options o = {p->scene->duration, p->scene->sample, morph_planner_control(p)};
    morph_timing_report r;
    morph_progress(o.control, "timing", 0.0);
    morph_status status = morph_timing_solve(p->curve, &o, &p->timing, &r);
    morph_summary *s = &p->plan->summary;
    s->iterations_timing = r.iterations;
    s->linear_seconds += r.linear_seconds;
    s->duration = p->timing.duration;
    if (status == MORPH_OK)
        status = morph_timing_single_link(p->curve, &s->single_link_seconds, &s->single_link);
    if (status == MORPH_OK && p->scene->duration > 0.0 && r.needed > p->scene->duration)
        status = say_too_short(p, r.needed);
    if (status == MORPH_OK)
        status = morph_record_schedule(&p->plan->record, p->curve, &p->timing, sample_step(p));
    morph_planner_time(p, MORPH_STAGE_TIMING, since);
    return status;
}
