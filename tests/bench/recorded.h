/* A plan folder's path and timing, rebuilt from its record: for benches. */
#ifndef MORPH_BENCH_RECORDED_H
#define MORPH_BENCH_RECORDED_H

#include "planner/folder.h"
#include "planner/timing.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct recorded {
    morph_structure *structure;
    morph_curve *curve;
    morph_timing timing;
} recorded;

/* The curve through the recorded poses: joints are centre -+ half a post along its direction, or (without
 * posts) the poses themselves. */
static morph_curve *recorded_curve(const morph_record *r, const morph_structure *s) {
    const size_t width = 3 * (size_t)s->joints;
    double *joints = morph_alloc((size_t)r->poses * width, sizeof(double));
    morph_curve *curve = NULL;
    if (joints && s->posts == 0) memcpy(joints, r->path_poses, (size_t)r->poses * width * sizeof *joints);
    for (int k = 0; k < r->poses && joints; k++)
        for (int p = 0; p < s->posts; p++) {
            const double *y = &r->path_poses[((size_t)k * (size_t)s->posts + (size_t)p) * 6];
            for (int c = 0; c < 3; c++) {
                const double half = 0.5 * s->post_length[p] * y[3 + c];
                joints[(size_t)k * width + 3 * (size_t)s->post[p][0] + (size_t)c] = y[c] - half;
                joints[(size_t)k * width + 3 * (size_t)s->post[p][1] + (size_t)c] = y[c] + half;
            }
        }
    if (joints && morph_curve_create(s, r->path_s, joints, r->poses, &curve) != MORPH_OK) curve = NULL;
    free(joints);
    return curve;
}

static bool recorded_timing(const morph_record *r, morph_timing *t) {
    if (morph_basis_uniform(r->timing_controls, &t->basis) != MORPH_OK) return false;
    t->control = morph_alloc((size_t)r->timing_controls, sizeof(double));
    if (!t->control) return false;
    memcpy(t->basis.knot, r->timing_knot, (size_t)r->timing_knots * sizeof(double));
    memcpy(t->control, r->timing_control, (size_t)r->timing_controls * sizeof(double));
    t->duration = *r->timing_duration;
    return true;
}

static void recorded_free(recorded *out) {
    morph_timing_free(&out->timing);
    morph_curve_destroy(out->curve);
    morph_structure_destroy(out->structure);
    *out = (recorded){0};
}

/* False, with a line on stderr, where the folder is not a plan with a schedule. */
static bool recorded_read(const char *folder, recorded *out) {
    char file[4096], message[512] = "";
    snprintf(file, sizeof file, "%s/scene.yaml", folder);
    morph_scene *scene = NULL;
    morph_record record = {0};
    *out = (recorded){0};
    const bool there = morph_scene_read(file, NULL, NULL, NULL, &scene) == MORPH_OK &&
                       morph_folder_read(folder, &record, message, sizeof message) == MORPH_OK &&
                       record.timing_duration && record.poses > 0 &&
                       morph_structure_create(&scene->structure, &out->structure) == MORPH_OK;
    if (there) out->curve = recorded_curve(&record, out->structure);
    const bool ok = out->curve && recorded_timing(&record, &out->timing);
    if (!ok) {
        fprintf(stderr, "%s: not a plan folder with a schedule. %s\n", folder, message);
        recorded_free(out);
    }
    morph_record_free(&record);
    morph_scene_destroy(scene);
    return ok;
}

#endif
