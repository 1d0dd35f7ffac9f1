#include "planner/target_body.h"

#include "planner/import_tetra.h"

#include <stdio.h>

/* Held by the lowest tenth of its height: round targets would roll from under the blanket otherwise (with a
 * twentieth, a ball still leans until the blanket slides off). */
#define FOOT 0.1
/* The volume that tetrahedra may miss before they are made finer, and how often. */
#define VOLUME_LOST 0.05
#define FINER 3
/* Cells in the target's volume to start with, at most; some ten tetrahedra each. With 10,000 of them a run
 * takes half a minute. */
#define MOST_CELLS 1000.0
/* Of the body in a frame of the blanket; beyond, the run would take hours. */
#define MOST_SUBSTEPS 1e6
#define FRAME 0.01 /* of the blanket, s */

static morph_status too_thin(double cell, char *message, size_t size) {
    snprintf(
        message, size,
        "the target's inside cannot be filled with tetrahedra of %.3g m: it must be thicker, or a file of "
        "tetrahedra (.msh, .node with .ele); without deformable it is rigid",
        cell);
    return MORPH_ERR_INPUT;
}

/* Keeps the finest try that gave anything. */
static morph_status fill(const morph_scene *scene, const morph_distance *exact, morph_tetra *out,
                         char *message, size_t size) {
    const double volume = scene->target_report.volume;
    double cell = fmax(0.5 * scene->structure.spacing, cbrt(volume / MOST_CELLS));
    for (int k = 0; k < 3; k++)
        cell = fmin(cell, scene->target_report.hi[k] - scene->target_report.lo[k]);
    *out = (morph_tetra){0};
    for (int round = 0; round <= FINER; round++, cell *= 0.5) {
        morph_tetra tetra;
        morph_tetra_report report;
        const morph_status status = morph_tetra_fill(exact, cell, &tetra, &report);
        if (status == MORPH_ERR_INPUT) continue;
        if (status != MORPH_OK) {
            morph_tetra_free(out);
            return status;
        }
        morph_tetra_free(out);
        *out = tetra;
        if (fabs(report.volume - volume) <= VOLUME_LOST * volume) return MORPH_OK;
    }
    return out->tets > 0 ? MORPH_OK : too_thin(2.0 * cell, message, size);
}

static morph_body_def body_def(const morph_scene *scene) {
    const morph_mesh_report *t = &scene->target_report;
    morph_body_def def = morph_body_defaults();
    def.young = scene->target_def.young;
    def.density = scene->target_def.density;
    def.drag = scene->motion.drag;
    def.gravity = scene->motion.gravity;
    def.friction = scene->motion.friction;
    def.base = t->lo[2]; /* it stands where it is placed, also above the base plane */
    def.pin = FOOT * (t->hi[2] - t->lo[2]);
    return def;
}

morph_status morph_target_body(const morph_scene *scene, const morph_distance *exact, morph_body **out,
                               morph_deformable_report *report, char *message, size_t message_size) {
    const morph_target_def *target = &scene->target_def;
    morph_tetra tetra;
    *out = NULL;
    *report = (morph_deformable_report){0};
    if (message_size > 0) message[0] = '\0';
    const bool file = target->file && morph_is_tetra_file(target->file);
    morph_status status = file ? morph_target_tetra(target, &tetra, message, message_size)
                               : fill(scene, exact, &tetra, message, message_size);
    if (status != MORPH_OK) return status;
    const morph_body_def def = body_def(scene);
    status = morph_body_create(&tetra, &def, out);
    *report = (morph_deformable_report){
        .used = true, .vertices = tetra.vertices, .tetrahedra = tetra.tets, .least_volume = 1.0};
    for (int t = 0; t < tetra.tets; t++)
        report->volume += morph_tetra_volume(tetra.v, tetra.tet[t]);
    morph_tetra_free(&tetra);
    if (status != MORPH_OK) return status;
    const double substeps = FRAME / morph_body_stable_step(*out);
    if (substeps <= MOST_SUBSTEPS) return MORPH_OK;
    snprintf(
        message, message_size,
        "a young of %.3g Pa at a density of %.3g kg/m3 asks for %.1g steps in each frame of the blanket, "
        "allowed: %.0g; without deformable the target is rigid",
        def.young, def.density, substeps, MOST_SUBSTEPS);
    morph_body_destroy(*out);
    *out = NULL;
    return MORPH_ERR_INPUT;
}

double morph_target_pressed(const morph_body *body, double lift) {
    double most = 0.0;
    for (int k = 0; k < body->mesh.surface_vertices; k++) {
        const int i = body->mesh.surface[k];
        const double at[3] = {body->x[3 * i], body->x[3 * i + 1], body->x[3 * i + 2] - lift};
        most = fmax(most, morph_dist(at, &body->mesh.v[3 * i]));
    }
    return most;
}
