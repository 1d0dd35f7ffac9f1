/* Recorded frames of whole scenes, measured by means the blanket itself does not use: distances are FCL's,
 * inside is told by a sum of solid angles over every triangle, lengths are taken from the joints. */
#ifndef MORPH_TEST_FRAMES_H
#define MORPH_TEST_FRAMES_H

#include "planner/plan.h"
#include "planner/scene_parts.h"
#include "solvers/collision.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Scenes for a grid of n x n nodes at 0.1 m; targets grow with it (drawn for 8 x 8). %d: n; %g: lengths.
 *
 * A run ends when the blanket is at rest; the time is what it may take. The saddle has twice what it needs:
 * the sheet leaves its symmetry slowly, against its dampers, and corners buckle late. How long that takes
 * hangs on the smallest things (12 x 12: from 5.7 to 10.2 s for friction between 0.39 and 0.41). */
typedef struct frames_scene {
    const char *name, *target, *motion;
    double size[3];
    bool shared; /* needs the folder of test models */
} frames_scene;

static const frames_scene frames_scenes[] = {
    {"sphere_attract", "shape: sphere, radius: %.6g", "friction: 0.4, time: 8.0", {0.21, 0, 0}, false},
    {"sphere_rise",
     "shape: sphere, radius: %.6g",
     "mode: rise, friction: 0.4, time: 8.0",
     {0.25, 0, 0},
     false},
    {"saddle",
     "shape: heightmap, file: ../examples/scenes/saddle.csv, cell: 0.02, scale: %.6g",
     "friction: 0.4, time: 20.0",
     {1.0, 0, 0},
     false},
    {"torus", "shape: torus, radius: %.6g, tube: %.6g", "friction: 0.4, time: 8.0", {0.16, 0.06, 0}, false},
    {"spot",
     "shape: mesh, file: ../../shared/models/spot_low_resolution.obj, rotate: [90, 0, 0], "
     "fit: [%.6g, %.6g, %.6g]",
     "friction: 0.4, time: 12.0",
     {0.42, 0.42, 0.42},
     true},
    {"volcano",
     "shape: heightmap, file: ../../shared/models/volcano_maunga_whau_87x61.csv, cell: 5, "
     "fit: [%.6g, %.6g, %.6g]",
     "friction: 0.4, time: 12.0",
     {0.56, 0.56, 0.2},
     true}};
enum { FRAMES_SCENES = sizeof frames_scenes / sizeof *frames_scenes };

/* Files are looked for from the folder `tests` of the source folder `root`. NULL if it cannot be read. */
static inline morph_scene *frames_read(const frames_scene *f, int nodes, const char *root) {
    char path[4096], text[2048], target[512], more[512] = "", height[64] = "";
    const double k = (nodes - 1) / 7.0;
    snprintf(target, sizeof target, f->target, k * f->size[0], k * f->size[1], k * f->size[2]);
    const bool rises = strstr(f->motion, "rise") != NULL;
    if (rises) { /* the ball comes up by 0.2 m of 8 x 8 */
        snprintf(more, sizeof more, ", at: [0, 0, %.6g]", -0.1 * k);
        snprintf(height, sizeof height, ", height: %.6g", 0.2 * k);
    }
    int used = snprintf(text, sizeof text,
                        "morphplan: 1\nstructure: {nodes: [%d, %d], spacing: 0.1, link: {stiffness: 20}%s}\n"
                        "target: {%s%s}\nmotion: {%s%s}\nbase: 0.0\n",
                        nodes, nodes, rises ? ", fixed: border, support: frame" : "", target, more, f->motion,
                        height);
    if (strstr(f->name, "attract"))
        used += snprintf(text + used, sizeof text - (size_t)used,
                         "attractors:\n  - {at: [0, 0, %.6g], strength: %.6g}\n", 0.1 * k, 0.03 * k * k);
    snprintf(path, sizeof path, "%s/tests/%s.yaml", root, f->name);
    morph_scene *scene = NULL;
    return morph_scene_parse(path, text, (size_t)used, NULL, NULL, NULL, &scene) == MORPH_OK ? scene : NULL;
}

/* Least clearances and worst limits over every recorded frame, in spacings; clearance: distance less the
 * radius, minus infinity where something crosses the target. */
typedef struct frames_measure {
    double joint, link, skin, base, length;
    int frames, joints_inside;
} frames_measure;

/* Solid angle of the whole mesh seen from q over 4 pi (van Oosterom and Strackee 1983): 1 inside, 0 outside
 * of a closed mesh turned outwards. */
static inline double frames_winding(const morph_mesh *m, const double q[3]) {
    double sum = 0.0;
    for (int t = 0; t < m->triangles; t++) {
        double e[3][3], n[3], l[3];
        for (int c = 0; c < 3; c++) {
            morph_sub(&m->v[3 * m->t[3 * t + c]], q, e[c]);
            l[c] = morph_norm(e[c]);
        }
        morph_cross(e[1], e[2], n);
        sum +=
            2.0 * atan2(morph_dot(e[0], n), l[0] * l[1] * l[2] + morph_dot(e[0], e[1]) * l[2] +
                                                morph_dot(e[1], e[2]) * l[0] + morph_dot(e[2], e[0]) * l[1]);
    }
    return sum / (4.0 * acos(-1.0));
}

/* Clearance of `count` elements of `corners` joints each, of one radius, at x shifted down by `lift`. FCL
 * takes them as triangles, a point and a segment with repeated corners. */
static inline double frames_clearance(const morph_solid *solid, const int *corner, int corners, int count,
                                      double radius, const double *x, double lift, double *room) {
    double distance = 0.0;
    int nearest;
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            const int j = corner[corners * i + (c < corners ? c : corners - 1)];
            for (int k = 0; k < 3; k++)
                room[9 * i + 3 * c + k] = x[3 * j + k] - (k == 2 ? lift : 0.0);
        }
    if (morph_solid_distance(solid, room, count, &distance, &nearest) != MORPH_OK) return NAN;
    return distance > 0.0 ? distance - radius : -INFINITY;
}

/* What does not touch the surface lies on one side of it with all its joints, and FCL says in every frame
 * whether anything touches: one frame in ten is looked at, and the last. */
static inline int frames_inside(const morph_mesh *m, const double *x, int joints, double lift) {
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    int inside = 0;
    for (int i = 0; i < 3 * m->vertices; i++) {
        lo[i % 3] = fmin(lo[i % 3], m->v[i]);
        hi[i % 3] = fmax(hi[i % 3], m->v[i]);
    }
    for (int j = 0; j < joints; j++) {
        const double q[3] = {x[3 * j], x[3 * j + 1], x[3 * j + 2] - lift};
        bool near = true;
        for (int k = 0; k < 3; k++)
            near = near && q[k] >= lo[k] && q[k] <= hi[k];
        inside += near && frames_winding(m, q) > 0.5;
    }
    return inside;
}

static inline void frames_limits(const morph_structure *s, double base, const double *x, frames_measure *f) {
    for (int l = 0; l < s->links; l++) {
        const double *a = &x[3 * s->link[l][0]], *b = &x[3 * s->link[l][1]];
        const double size = sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                                 (a[2] - b[2]) * (a[2] - b[2]));
        f->length = fmax(f->length, fmax(s->length_limit[l][0] - size, size - s->length_limit[l][1]));
    }
    for (int j = 0; j < s->joints && !isnan(base); j++)
        f->base = fmin(f->base, x[3 * j + 2] - s->def.radius - base);
}

/* All links have the structure's radius here. False without memory or where FCL fails. */
static inline bool frames_examine(const morph_structure *s, const morph_mesh *target, double base,
                                  const morph_trajectory *t, frames_measure *f) {
    *f = (frames_measure){INFINITY, INFINITY, INFINITY, INFINITY, -INFINITY, t->frames, 0};
    morph_solid *solid = NULL;
    const int most = s->joints + s->links + s->skin_triangles;
    double *room = morph_alloc((size_t)most, 9 * sizeof *room);
    int *own = morph_alloc((size_t)s->joints, sizeof *own);
    bool good =
        room && own &&
        morph_solid_create(target->v, target->vertices, target->t, target->triangles, &solid) == MORPH_OK;
    for (int j = 0; good && j < s->joints; j++)
        own[j] = j;
    for (int k = 0; good && k < t->frames; k++) {
        const double *x = &t->x[(size_t)k * 3 * (size_t)t->joints], lift = t->lift[k];
        const double c[3] = {
            frames_clearance(solid, own, 1, s->joints, s->def.radius, x, lift, room),
            frames_clearance(solid, &s->link[0][0], 2, s->links, s->def.radius, x, lift, room),
            frames_clearance(solid, &s->skin[0][0], 3, s->skin_triangles, s->def.radius, x, lift, room)};
        good = !isnan(c[0]) && !isnan(c[1]) && !isnan(c[2]);
        f->joint = fmin(f->joint, c[0]);
        f->link = fmin(f->link, c[1]);
        f->skin = fmin(f->skin, c[2]);
        if (k % 10 == 0 || k == t->frames - 1) f->joints_inside += frames_inside(target, x, s->joints, lift);
        frames_limits(s, base, x, f);
    }
    double *const figure[] = {&f->joint, &f->link, &f->skin, &f->base, &f->length};
    for (int i = 0; i < 5; i++)
        *figure[i] /= s->spacing;
    morph_solid_destroy(solid);
    free(room);
    free(own);
    return good;
}

#endif
