#include "planner/plan.h"

#include "planner/start.h"

#include <stdlib.h>
#include <string.h>

/* Box of everything the distance field must know: the flat structure with room to swing, the target, the base
 * plane. */
static void field_box(const morph_scene *scene, const morph_structure *s, const morph_workspace *w,
                      double lo[3], double hi[3]) {
    const morph_mesh_report *t = &scene->target_report;
    const double a = s->spacing;
    for (int k = 0; k < 3; k++) {
        lo[k] = hi[k] = w->start[k];
        for (int j = 0; j < s->joints; j++) {
            lo[k] = fmin(lo[k], fmin(w->start[3 * j + k], w->begin[3 * j + k]));
            hi[k] = fmax(hi[k], fmax(w->start[3 * j + k], w->begin[3 * j + k]));
        }
        lo[k] = fmin(lo[k], t->lo[k]) - a;
        hi[k] = fmax(hi[k], t->hi[k]) + a;
    }
    if (!isnan(scene->base)) lo[2] = fmax(lo[2], scene->base - 0.5 * a);
}

/* Dropped, it starts above the target, and never in the base plane: with a target below
 * that the plane counts as the top. Where the target rises, it starts in the frame that holds it: on the base
 * plane, or without one where the target's top begins, by a radius and a contact's margin above either. */
double morph_scene_start_height(const morph_scene *scene) {
    const double top = scene->target_report.hi[2], base = isnan(scene->base) ? -INFINITY : scene->base;
    if (scene->motion.mode == MORPH_MODE_DROP) return fmax(top, base) + scene->motion.height;
    return fmax(top - scene->motion.height, base) + scene->structure.radius + 2e-3 * scene->structure.spacing;
}

/* Where the path begins; stuck links then hold the length that they have there. */
static morph_status place_begin(const morph_scene *scene, morph_workspace *w) {
    const size_t n = 3 * (size_t)w->structure->joints;
    w->begin = morph_alloc(n, sizeof *w->begin);
    if (!w->begin) return MORPH_ERR_NOMEM;
    memcpy(w->begin, w->start, n * sizeof *w->begin);
    if (!scene->start.pose) return MORPH_OK;
    morph_start_hold(&scene->start, w->structure);
    return morph_start_place(&scene->start, w->start, w->begin);
}

morph_status morph_workspace_create(const morph_scene *scene, const morph_control *control,
                                    morph_workspace *w) {
    *w = (morph_workspace){0};
    morph_status status = morph_structure_create(&scene->structure, &w->structure);
    if (status == MORPH_OK)
        status = morph_distance_create(&scene->target, scene->target_report.closed, &w->exact);
    const morph_structure *s = w->structure;
    if (status == MORPH_OK && !(w->start = morph_alloc(3 * (size_t)s->joints, sizeof(double))))
        status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        const double height = morph_scene_start_height(scene);
        for (int i = 0; i < 3 * s->joints; i++)
            w->start[i] = s->start[i] + (i % 3 == 2 ? height : 0.0);
        status = place_begin(scene, w);
    }
    if (status == MORPH_OK && !scene->target_def.has_deformable) {
        double lo[3], hi[3];
        field_box(scene, s, w, lo, hi);
        /* A sixteenth of the spacing is about the links' radius; beyond 2.5 million nodes memory and time
         * outgrow the gain: the rows' bias makes up for what a coarser field misses. */
        const double volume = (hi[0] - lo[0]) * (hi[1] - lo[1]) * (hi[2] - lo[2]);
        const double cell = fmax(s->spacing / 16.0, cbrt(volume / 2.5e6));
        status = morph_sdf_create(w->exact, lo, hi, cell, control, &w->sdf);
    }
    if (status == MORPH_OK) {
        if (w->sdf) morph_sdf_measure(w->sdf, w->exact, s->spacing, &w->accuracy);
        status = morph_cavity_create(s, w->exact, scene->base, &w->cavity);
    }
    if (status != MORPH_OK) {
        morph_workspace_free(w);
        return status;
    }
    w->world = (morph_world){s, w->exact, w->sdf, w->cavity, scene->base, 0.0};
    return MORPH_OK;
}

morph_status morph_workspace_press(morph_workspace *w, const morph_scene *scene, const morph_mesh *surface,
                                   const morph_control *control) {
    morph_scene pressed = *scene; /* borrows; only its target differs */
    morph_workspace fresh;
    pressed.target = *surface;
    pressed.target_def.has_deformable = false;
    morph_status status = morph_mesh_examine(surface, &pressed.target_report);
    if (status == MORPH_OK) status = morph_workspace_create(&pressed, control, &fresh);
    if (status != MORPH_OK) return status;
    double *start = fresh.start, *begin = fresh.begin;
    fresh.start = w->start;
    fresh.begin = w->begin;
    w->start = start;
    w->begin = begin;
    morph_workspace_free(w);
    *w = fresh;
    return MORPH_OK;
}

void morph_workspace_free(morph_workspace *w) {
    morph_cavity_destroy(w->cavity);
    morph_sdf_destroy(w->sdf);
    morph_distance_destroy(w->exact);
    morph_structure_destroy(w->structure);
    free(w->start);
    free(w->begin);
    *w = (morph_workspace){0};
}

/* Part of the time that the target's rise takes; the rest is for coming to rest. */
#define RISE_TIME 0.6

morph_blanket_def morph_scene_blanket(const morph_scene *scene, const morph_structure *structure) {
    const bool rises = scene->motion.mode == MORPH_MODE_RISE;
    return (morph_blanket_def){.gravity = scene->motion.gravity,
                               .drag = scene->motion.drag,
                               .friction = scene->motion.friction,
                               .time = scene->motion.time,
                               .frame = 0.01,
                               .base = scene->base,
                               .attractors = scene->centre,
                               .attractor_count =
                                   scene->attractors == MORPH_ATTRACT_LIST ? scene->centres : 0,
                               .hands = scene->touch,
                               .hand_count = scene->touches,
                               .fixed = structure->fixed_joint,
                               .fixed_count = structure->fixed_joints,
                               .rise = rises ? scene->motion.height : 0.0,
                               .rise_time = RISE_TIME * scene->motion.time};
}
