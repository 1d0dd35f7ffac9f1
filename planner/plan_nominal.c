/** The pure blanket of a plan, on a rigid or on a deformable target. */
#include "planner/plan_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Whether the blanket's lengths jump: the largest second difference from frame to frame. */
static void note_jumps(morph_planner *p) {
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
static void note_held_up(morph_planner *p) {
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
    morph_log(morph_planner_control(p), "nominal: %s", text);
}

/* Says where and when the motion would have come through the target: there is no plan then to say it in. */
static void tell_came_through(const morph_planner *p) {
    const morph_structure *st = p->work.structure;
    const morph_blanket_report *r = &p->plan->summary.blanket_report;
    char element[96];
    if (!p->options->message) return;
    if (r->through_element < st->links)
        morph_link_name(st, r->through_element, element, sizeof element);
    else
        snprintf(element, sizeof element, "skin triangle %d", r->through_element - st->links);
    snprintf(
        p->options->message, p->options->message_size,
        "clearance: %s would come through the target at %.4g s, however short the steps: a lower height or "
        "gravity, or more radius, would let it be held",
        element, r->through_time);
}

/* What the blanket has made of the target: later stages see that, as a rigid one. */
static morph_status press(morph_planner *p, const morph_body *body) {
    morph_summary *s = &p->plan->summary;
    const double lift = p->nominal.lift[p->nominal.frames - 1];
    morph_mesh surface;
    morph_status status = morph_tetra_surface(&body->mesh, body->x, &surface);
    for (int i = 0; i < surface.vertices; i++)
        surface.v[3 * i + 2] -= lift; /* to the target's place, as the target's own vertices stand */
    if (status == MORPH_OK) status = morph_record_deformed(&p->plan->record, &surface);
    if (status == MORPH_OK) status = morph_workspace_press(&p->work, p->scene, &surface, &p->quiet);
    morph_mesh_free(&surface);
    morph_planner_accuracy(p);
    s->deformable.pressed = morph_target_pressed(body, lift);
    s->deformable.least_volume = morph_body_least_volume(body);
    s->deformable.worst_depth = s->blanket_report.worst_clearance;
    return status;
}

/* Beside what else there is to say. */
static void note_deformable(morph_planner *p) {
    morph_summary *s = &p->plan->summary;
    const size_t used = strlen(s->warning);
    snprintf(s->warning + used, sizeof s->warning - used,
             "%sthe target is deformable: it is pressed by up to %.3g m; gap, cavity and coverage are to its "
             "pressed surface, clearance is to that and at the end only, as it gives way before",
             used > 0 ? "; " : "", s->deformable.pressed);
}

/* The pure blanket on a deformable target: both move. */
static morph_status run_deformable(morph_planner *p, morph_blanket_def def) {
    char message[512];
    morph_summary *s = &p->plan->summary;
    morph_status status =
        morph_target_body(p->scene, p->work.exact, &def.body, &s->deformable, message, sizeof message);
    if (message[0]) morph_log(morph_planner_control(p), "target.deformable: %s", message);
    if (status != MORPH_OK) return status;
    status = morph_blanket_run(p->work.structure, NULL, NULL, &def, p->work.start, morph_planner_control(p),
                               &p->nominal, &s->blanket_report);
    const morph_status pressed = (status == MORPH_OK || status == MORPH_ERR_STOPPED) && p->nominal.frames > 0
                                     ? press(p, def.body)
                                     : MORPH_OK;
    morph_body_destroy(def.body);
    return pressed == MORPH_OK ? status : pressed;
}

morph_status morph_stage_nominal(morph_planner *p) {
    const double since = morph_seconds();
    const morph_blanket_def def = morph_scene_blanket(p->scene, p->work.structure);
    morph_summary *s = &p->plan->summary;
    morph_planner_limit(p, MORPH_STAGE_NOMINAL);
    morph_status status =
        p->scene->target_def.has_deformable
            ? run_deformable(p, def)
            : morph_blanket_run(p->work.structure, p->work.sdf, p->work.exact, &def, p->work.start,
                                morph_planner_control(p), &p->nominal, &s->blanket_report);
    const morph_structure *st = p->work.structure;
    if (status == MORPH_ERR_MOTION) tell_came_through(p);
    if (p->nominal.frames > 0) status = morph_planner_ended(p, status, MORPH_STAGE_NOMINAL);
    if (status == MORPH_OK) status = morph_record_nominal(&p->plan->record, st, &p->nominal);
    if (status == MORPH_OK) {
        const size_t width = 3 * (size_t)st->joints;
        const double *last = &p->nominal.x[(size_t)(p->nominal.frames - 1) * width];
        p->end = morph_alloc(width, sizeof(double));
        if (!p->end) return MORPH_ERR_NOMEM;
        memcpy(p->end, last, width * sizeof *last);
        const double lift = p->nominal.lift[p->nominal.frames - 1];
        status = morph_planner_measure(p, last, lift, &s->blanket);
        s->has_blanket = status == MORPH_OK;
        if (status == MORPH_OK) status = morph_planner_cavities(p, last, lift, &s->cavities_blanket);
    }
    if (status == MORPH_OK) note_jumps(p);
    if (status == MORPH_OK && s->blanket_report.held_up) note_held_up(p);
    if (status == MORPH_OK && s->deformable.used) note_deformable(p);
    morph_planner_time(p, MORPH_STAGE_NOMINAL, since);
    return status;
}
