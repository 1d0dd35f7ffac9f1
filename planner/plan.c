#include "planner/plan.h"

#include "planner/placement.h"
#include "planner/reach_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

typedef struct planner {
    const morph_scene *scene;
    const morph_plan_options *options;
    morph_plan *plan;
    morph_workspace work;
    morph_trajectory nominal;
    double *end; /* 3*joints: the shape to reach */
    morph_refine_report refined;
    morph_curve *curve;
    morph_timing timing;
    bool stopped;
    bool guided; /* the end is that of the blanket under attraction */
    bool optimal;
    morph_control quiet; /* the caller's control without its stop: after a stop the rest is done cheaply, not
                            cut short */
} planner;

/* After a stop the stages go on with what there is. */
static const morph_control *control_of(const planner *p) {
    return p->stopped ? &p->quiet : p->options->control;
}

static void note_time(planner *p, morph_stage stage, double since) {
    p->plan->summary.seconds[stage] += morph_seconds() - since;
}

static void note_accuracy(planner *p) {
    morph_summary *s = &p->plan->summary;
    s->sdf_cell = p->work.accuracy.cell;
    s->sdf_rms = p->work.accuracy.rms;
    s->sdf_max = p->work.accuracy.max;
}

/* Findings of the reach check, one line each; a ridge that the sheet rounds off is left to `info`. */
static void note_reach(const planner *p) {
    char line[400];
    for (int k = 0; k < MORPH_REACH_KINDS && p->options->warn; k++) {
        if (k == MORPH_REACH_BEND) continue;
        morph_reach_sentence(&p->plan->summary.reach, (morph_reach_kind)k, line, sizeof line);
        if (line[0]) p->options->warn(p->options->control ? p->options->control->user : NULL, line);
    }
}

static morph_status stage_target(planner *p) {
    const double since = morph_seconds();
    morph_progress(control_of(p), "target", 0.0);
    morph_status status = morph_workspace_create(p->scene, control_of(p), &p->work);
    if (status == MORPH_OK)
        status = morph_scene_reach(p->scene, p->work.structure, p->work.exact, &p->plan->summary.reach);
    if (status == MORPH_OK) {
        note_reach(p);
        note_accuracy(p);
        status =
            morph_record_structure(&p->plan->record, p->work.structure, &p->scene->target, p->scene->base);
        p->plan->record.goal = p->scene->goal;
    }
    note_time(p, MORPH_STAGE_TARGET, since);
    return status;
}

/* Measures where the target stands: the pose is seen from there. */
static morph_status measure_lifted(const planner *p, const double *x, double lift, morph_measure *out) {
    const int n = 3 * p->work.structure->joints;
    double *seen = morph_alloc((size_t)n, sizeof(double));
    if (!seen) return MORPH_ERR_NOMEM;
    for (int i = 0; i < n; i++)
        seen[i] = x[i] - (i % 3 == 2 ? lift : 0.0);
    const morph_status status = morph_cavity_measure(p->work.cavity, seen, out);
    free(seen);
    return status;
}

/* Whether the blanket's lengths jump: the largest second difference from frame to frame. */
static void note_jumps(planner *p) {
    const morph_record *r = &p->plan->record;
    morph_summary *s = &p->plan->summary;
    const size_t links = (size_t)r->links;
    for (int f = 1; f + 1 < r->nominal_frames; f++)
        for (size_t l = 0; l < links; l++) {
            const double *at = &r->nominal_lengths[(size_t)f * links + l];
            const double jump = fabs(at[links] - 2.0 * at[0] + *(at - links));
            if (jump <= s->largest_jump) continue;
            s->largest_jump = jump;
            s->jump_link = (int)l;
            s->jump_time = r->nominal_time[f];
        }
}

/* Says what stood against a rising target. */
static void note_held_up(planner *p) {
    static const char *const limits[] = {"length", "angle", "post", "panel", "clearance"};
    const morph_structure *st = p->work.structure;
    const morph_blanket_report *r = &p->plan->summary.blanket_report;
    char element[96] = "", *text = p->plan->summary.warning;
    if (r->held_by == MORPH_BLANKET_LENGTH && r->held_element >= 0) {
        snprintf(element, sizeof element, " of ");
        morph_link_name(st, r->held_element, element + 4, sizeof element - 4);
    } else if (r->held_by == MORPH_BLANKET_ANGLE && r->held_element >= 0) {
        const bool post = r->held_element < st->link_posts;
        const int tuple = post ? r->held_element : r->held_element - st->link_posts;
        snprintf(element, sizeof element, " %s of ", post ? "to the post" : "to its neighbour");
        const size_t used = strlen(element);
        morph_link_name(st, post ? st->link_post[tuple][0] : st->link_link[tuple][0], element + used,
                        sizeof element - used);
    }
    snprintf(
        text, sizeof p->plan->summary.warning,
        "the target stopped rising at %.2f s, %.4g m short of its place: the %s limit%s stood against it",
        r->held_time, r->short_of, limits[r->held_by], element);
    morph_log(control_of(p), "nominal: %s", text);
}

/* What the blanket has made of the target: later stages see that, as a rigid one. */
static morph_status press(planner *p, const morph_body *body) {
    morph_summary *s = &p->plan->summary;
    const double lift = p->nominal.lift[p->nominal.frames - 1];
    morph_mesh surface;
    morph_status status = morph_tetra_surface(&body->mesh, body->x, &surface);
    for (int i = 0; i < surface.vertices; i++)
        surface.v[3 * i + 2] -= lift; /* to the target's place, as the target's own vertices stand */
    if (status == MORPH_OK) status = morph_record_deformed(&p->plan->record, &surface);
    if (status == MORPH_OK) status = morph_workspace_press(&p->work, p->scene, &surface, &p->quiet);
    morph_mesh_free(&surface);
    note_accuracy(p);
    s->deformable.pressed = morph_target_pressed(body, lift);
    s->deformable.least_volume = morph_body_least_volume(body);
    s->deformable.worst_depth = s->blanket_report.worst_clearance;
    return status;
}

/* Beside what else there is to say. */
static void note_deformable(planner *p) {
    morph_summary *s = &p->plan->summary;
    const size_t used = strlen(s->warning);
    snprintf(s->warning + used, sizeof s->warning - used,
             "%sthe target is deformable: it is pressed by up to %.3g m; gap, cavity and coverage are to its "
             "pressed surface, clearance is to that and at the end only, as it gives way before",
             used > 0 ? "; " : "", s->deformable.pressed);
}

/* The pure blanket on a deformable target: both move. */
static morph_status run_deformable(planner *p, morph_blanket_def def) {
    char message[512];
    morph_summary *s = &p->plan->summary;
    morph_status status =
        morph_target_body(p->scene, p->work.exact, &def.body, &s->deformable, message, sizeof message);
    if (message[0]) morph_log(control_of(p), "target.deformable: %s", message);
    if (status != MORPH_OK) return status;
    status = morph_blanket_run(p->work.structure, NULL, NULL, &def, p->work.start, control_of(p), &p->nominal,
                               &s->blanket_report);
    const morph_status pressed = (status == MORPH_OK || status == MORPH_ERR_STOPPED) && p->nominal.frames > 0
                                     ? press(p, def.body)
                                     : MORPH_OK;
    morph_body_destroy(def.body);
    return pressed == MORPH_OK ? status : pressed;
}

static morph_status stage_nominal(planner *p) {
    const double since = morph_seconds();
    const morph_blanket_def def = morph_scene_blanket(p->scene, p->work.structure);
    morph_summary *s = &p->plan->summary;
    morph_status status =
        p->scene->target_def.has_deformable
            ? run_deformable(p, def)
            : morph_blanket_run(p->work.structure, p->work.sdf, p->work.exact, &def, p->work.start,
                                control_of(p), &p->nominal, &s->blanket_report);
    const morph_structure *st = p->work.structure;
    if (status == MORPH_ERR_STOPPED && p->nominal.frames > 0) {
        p->stopped = true;
        status = MORPH_OK;
    }
    if (status == MORPH_OK) status = morph_record_nominal(&p->plan->record, st, &p->nominal);
    if (status == MORPH_OK) {
        const size_t width = 3 * (size_t)st->joints;
        const double *last = &p->nominal.x[(size_t)(p->nominal.frames - 1) * width];
        p->end = morph_alloc(width, sizeof(double));
        if (!p->end) return MORPH_ERR_NOMEM;
        memcpy(p->end, last, width * sizeof *last);
        status = measure_lifted(p, last, p->nominal.lift[p->nominal.frames - 1], &s->blanket);
        s->has_blanket = status == MORPH_OK;
    }
    if (status == MORPH_OK) note_jumps(p);
    if (status == MORPH_OK && s->blanket_report.held_up) note_held_up(p);
    if (status == MORPH_OK && s->deformable.used) note_deformable(p);
    note_time(p, MORPH_STAGE_NOMINAL, since);
    return status;
}

/* The blanket does not feel itself: where its axes pass through each other no path can follow. Its frames
 * count up to the one before the first such; the refinement starts there and closes the rest itself. */
static morph_status cut_tangle(planner *p) {
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
        morph_log(control_of(p),
                  "refine: the blanket passes through itself after %.2f s: going on from there",
                  p->nominal.time[clean - 1]);
        p->nominal.frames = clean;
        memcpy(p->end, &p->nominal.x[(size_t)(clean - 1) * width], width * sizeof *p->end);
    }
    return status;
}

/* From here on the blanket is that one: a path that has to go along its frames goes along these. */
static morph_status follow(planner *p, const morph_trajectory *guided) {
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
    morph_trajectory_free(&p->nominal);
    p->nominal = copy;
    return MORPH_OK;
}

/* Where the blanket under attraction ends, if it lies closer and can be refined from: its axes are not in
 * each other. */
static morph_status start_guided(planner *p, const morph_placement *placed, bool *taken) {
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
static morph_status stage_placement(planner *p) {
    if (p->options->method == MORPH_METHOD_BLANKET || p->stopped ||
        p->scene->attractors != MORPH_ATTRACT_AUTO)
        return MORPH_OK;
    const double since = morph_seconds();
    morph_placement own = {0};
    const morph_placement *placed = p->options->placement;
    morph_status status = MORPH_OK;
    if (!placed) {
        morph_placement_options o = morph_placement_defaults();
        o.control = control_of(p);
        if (p->options->method == MORPH_METHOD_NLOPT) o.method = MORPH_PLACE_NLOPT_GRADIENT;
        morph_progress(o.control, "placement", 0.0);
        status = morph_placement_run(&p->work, p->scene, p->end, &o, &own);
        placed = &own;
    }
    if (status == MORPH_ERR_STOPPED) {
        p->stopped = true;
        status = MORPH_OK;
    } else if (status == MORPH_ERR_NONFINITE || status == MORPH_ERR_BACKEND) {
        morph_log(control_of(p), "placement: left out: %s", morph_status_text(status));
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
    note_time(p, MORPH_STAGE_PLACEMENT, since);
    return status;
}

static morph_status stage_refine(planner *p) {
    if (p->options->method != MORPH_METHOD_IPOPT || p->stopped) return MORPH_OK;
    const double since = morph_seconds();
    morph_refine_options o = morph_refine_defaults();
    o.control = control_of(p);
    o.goal = p->scene->goal;
    morph_status status = p->guided ? MORPH_OK : cut_tangle(p);
    if (status == MORPH_OK) status = morph_refine(&p->work.world, &o, p->end, &p->refined);
    const morph_refine_report r = p->refined;
    if (status == MORPH_ERR_STOPPED) {
        p->stopped = true;
        status = MORPH_OK;
    }
    morph_summary *s = &p->plan->summary;
    s->iterations_refine = r.effort.iterations;
    s->unknowns_refine = r.effort.unknowns;
    s->rows_refine_used = r.effort.rows;
    s->rows_refine_possible = r.rows_possible;
    s->linear_seconds += r.effort.linear_seconds;
    s->callback_seconds += r.effort.callback_seconds;
    p->optimal = r.last == MORPH_OPTIMAL;
    note_time(p, MORPH_STAGE_REFINE, since);
    return status;
}

/* One way to a path; kept if it is feasible or breaks its limits less than the one before. */
static morph_status try_path(planner *p, bool unfold, bool stations, int intervals, double *least) {
    morph_path_options o = morph_path_defaults();
    o.control = control_of(p);
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
        morph_path_plan(&p->work.world, &p->nominal, p->work.start, p->end, &o, &curve, &r);
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
static morph_status stage_path(planner *p) {
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
    note_time(p, MORPH_STAGE_PATH, since);
    return status;
}

/* A path that breaks its limits can ask for hours: its record is sampled more coarsely rather than filling
 * the memory, and is not feasible. */
static double sample_step(planner *p) {
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

static morph_status stage_timing(planner *p) {
    const double since = morph_seconds();
    const morph_timing_options o = {p->scene->duration, p->scene->sample, control_of(p)};
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
    note_time(p, MORPH_STAGE_TIMING, since);
    return status;
}

static morph_status stage_measure(planner *p) {
    const double since = morph_seconds();
    morph_record *r = &p->plan->record;
    morph_summary *s = &p->plan->summary;
    const size_t width = 3 * (size_t)p->work.structure->joints;
    morph_progress(control_of(p), "measure", 0.0);
    morph_status status = measure_lifted(p, &r->schedule_joints[(size_t)(r->samples - 1) * width],
                                         r->offset_schedule[3 * (size_t)(r->samples - 1) + 2], &s->plan);
    s->has_plan = status == MORPH_OK;
    if (status == MORPH_OK) status = morph_record_mobility(r, p->work.structure);
    if (status == MORPH_OK) {
        const int last = r->mobility_samples - 1;
        s->free_motions = r->mobility_free[last];
        s->redundant = r->mobility_redundant[last];
        s->sigma_min = r->mobility_sigma_min[last];
    }
    note_time(p, MORPH_STAGE_MEASURE, since);
    return status;
}

/* What lasts longer than this is no morph that anybody waits for, and its replay would take minutes. */
#define LONGEST_REPLAY 120.0 /* s */

/* What the lengths alone do: once as the scene says the structure is carried, once over the target as a solid
 * core. */
static morph_status stage_replay(planner *p) {
    morph_summary *s = &p->plan->summary;
    morph_record *r = &p->plan->record;
    if (p->stopped) return MORPH_OK;
    if (s->duration > LONGEST_REPLAY) {
        morph_log(control_of(p), "replay: left out, a schedule of %.0f s is too long", s->duration);
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
        status = morph_replay_run(&in, control_of(p), &t, core && !on_target ? &s->replay_core : &s->replay);
        if (status == MORPH_OK && core && !on_target)
            morph_record_replay(&t, &r->core_frames, &r->core_time, &r->core_joints);
        else if (status == MORPH_OK)
            morph_record_replay(&t, &r->replay_frames, &r->replay_time, &r->replay_joints);
    }
    if (status == MORPH_ERR_STOPPED) {
        p->stopped = true;
        status = MORPH_OK;
    }
    /* A schedule that throws the structure about until no number is left is a finding, not our failure. */
    if (status == MORPH_ERR_NONFINITE) {
        morph_log(control_of(p), "replay: the lengths throw the structure about without bound");
        status = MORPH_OK;
    }
    note_time(p, MORPH_STAGE_REPLAY, since);
    return status;
}

/* "goal: mean_gap 0.0123 m, wanted 0.01 m, at 2.110 s (missed by 0.0023 m): against it stood: ..." */
static void say_missed(planner *p) {
    morph_summary *s = &p->plan->summary;
    const morph_margin *m = &s->check.margin[MORPH_MARGIN_GOAL];
    const char *against = p->refined.against;
    snprintf(s->reason, sizeof s->reason, "goal: %s, at %.3f s (missed by %.3g%s)", m->element, m->time,
             -m->worst, m->unit[0] == 'm' ? " m" : "");
    const size_t used = strlen(s->reason);
    if (against[0]) snprintf(s->reason + used, sizeof s->reason - used, ": against it stood: %s", against);
}

/* The check alone decides; a duration that cannot be met makes the plan infeasible too. */
static morph_status stage_check(planner *p) {
    const double since = morph_seconds();
    morph_summary *s = &p->plan->summary;
    morph_progress(control_of(p), "check", 0.0);
    const morph_status status = morph_check_record(&p->plan->record, &p->quiet, &s->check);
    note_time(p, MORPH_STAGE_CHECK, since);
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
    const morph_outcome outcome = p->stopped     ? MORPH_STOPPED
                                  : !s->feasible ? MORPH_INFEASIBLE
                                  : p->optimal   ? MORPH_OPTIMAL
                                                 : MORPH_FEASIBLE;
    snprintf(s->outcome, sizeof s->outcome, "%s", morph_outcome_text(outcome));
    snprintf(p->plan->record.outcome, sizeof p->plan->record.outcome, "%s", s->outcome);
    return MORPH_OK;
}

static void describe(planner *p) {
    morph_summary *s = &p->plan->summary;
    morph_record *r = &p->plan->record;
    snprintf(s->title, sizeof s->title, "%s", p->scene->title ? p->scene->title : "");
    snprintf(s->scene, sizeof s->scene, "%s", p->scene->file ? p->scene->file : "");
    snprintf(s->method, sizeof s->method, "%s",
             p->options->method == MORPH_METHOD_BLANKET ? "blanket"
             : p->options->method == MORPH_METHOD_NLOPT ? "nlopt"
                                                        : "ipopt");
    snprintf(s->level, sizeof s->level, "standard");
    s->target_volume = p->scene->target_report.volume;
    s->spacing = p->scene->structure.spacing;
    snprintf(s->blas, sizeof s->blas, "%s", morph_blas_name());
    snprintf(r->program, sizeof r->program, "morphplan %s", MORPH_VERSION);
    memcpy(r->scene_sha256, p->scene->sha256, sizeof r->scene_sha256);
}

static morph_status run_stages(planner *p) {
    static morph_status (*const stages[])(planner *) = {stage_target,  stage_nominal, stage_placement,
                                                        stage_refine,  stage_path,    stage_timing,
                                                        stage_measure, stage_replay,  stage_check};
    morph_status status = MORPH_OK;
    for (size_t k = 0; k < sizeof stages / sizeof *stages && status == MORPH_OK; k++) {
        status = stages[k](p);
        if (status == MORPH_OK && morph_stopped(p->options->control)) p->stopped = true;
    }
    return status;
}

morph_status morph_plan_run(const morph_scene *scene, const morph_plan_options *options, morph_plan **out) {
    *out = NULL;
    const double since = morph_seconds();
    /* One BLAS thread: sums then repeat bit for bit. */
    morph_blas_threads(1);
    planner p = {.scene = scene, .options = options};
    if (options->control) p.quiet = *options->control;
    p.quiet.stop = NULL;
    p.plan = calloc(1, sizeof *p.plan);
    if (!p.plan) return MORPH_ERR_NOMEM;
    describe(&p);
    const morph_status status = run_stages(&p);
    morph_timing_free(&p.timing);
    morph_curve_destroy(p.curve);
    morph_refine_report_free(&p.refined);
    morph_trajectory_free(&p.nominal);
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
