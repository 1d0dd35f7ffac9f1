/* What a deformable target costs, and that a rigid one does not pay for it: counts and time per step of the
 * same blanket falling on a rigid ball and on balls of tetrahedra of several sizes. */
#include "model/blanket_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define RADIUS 0.15
#define STEP 0.002
#define STEPS 600

static double cpu_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void row(const char *name, const morph_structure *s, const morph_sdf *sdf, morph_body *body) {
    morph_blanket_def def = {.gravity = 9.81,
                             .drag = 0.2,
                             .friction = 0.4,
                             .time = 1.0,
                             .frame = 0.01,
                             .step = STEP,
                             .base = 0.0,
                             .body = body};
    double *x = morph_alloc(3 * (size_t)s->joints, sizeof *x);
    morph_blanket_state *b = NULL;
    for (int i = 0; x && i < 3 * s->joints; i++)
        x[i] = s->start[i] + (i % 3 == 2 ? 2.0 * RADIUS + 0.05 : 0.0);
    if (!x || morph_blanket_state_create(s, sdf, &def, x, &b) != MORPH_OK) {
        printf("%-24s failed\n", name);
        free(x);
        return;
    }
    long contacts = 0, soft = 0;
    const double since = cpu_seconds();
    for (int k = 0; k < STEPS && morph_blanket_step(b); k++) {
        contacts += b->contacts;
        if (b->soft) soft += morph_blanket_soft_contacts(b);
    }
    const double each = (cpu_seconds() - since) / STEPS;
    printf("%-24s %9d %11.1f %9d %10.1f %10.1f %11.1f %9.1f\n", name, b->touches, (double)contacts / STEPS,
           body ? body->mesh.tets : 0, body ? (double)body->counts.steps / STEPS : 0.0,
           body ? (double)body->springs * (double)body->counts.steps / STEPS : 0.0, (double)soft / STEPS,
           1e6 * each);
    morph_blanket_state_destroy(b);
    free(x);
}

static void soft_row(const char *name, const morph_structure *s, const morph_distance *exact, double cell) {
    morph_tetra tetra;
    morph_tetra_report r;
    morph_body *body = NULL;
    morph_body_def def = morph_body_defaults();
    def.base = 0.0;
    def.pin = 0.2 * RADIUS;
    if (morph_tetra_fill(exact, cell, &tetra, &r) == MORPH_OK &&
        morph_body_create(&tetra, &def, &body) == MORPH_OK)
        row(name, s, NULL, body);
    morph_tetra_free(&tetra);
    morph_body_destroy(body);
}

int main(void) {
    const double radii[3] = {RADIUS, RADIUS, RADIUS}, lo[3] = {-0.5, -0.5, -0.1}, hi[3] = {0.5, 0.5, 0.6};
    morph_structure_def sd = morph_structure_defaults(0.1);
    morph_structure *s = NULL;
    morph_mesh mesh = {0};
    morph_distance *exact = NULL;
    morph_sdf *sdf = NULL;
    sd.nodes[0] = sd.nodes[1] = 6;
    sd.stiffness = 20.0;
    if (morph_structure_create(&sd, &s) != MORPH_OK || morph_mesh_ellipsoid(radii, 2e-4, &mesh) != MORPH_OK)
        return 1;
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += RADIUS;
    if (morph_distance_create(&mesh, true, &exact) != MORPH_OK ||
        morph_sdf_create(exact, lo, hi, 0.1 / 16, NULL, &sdf) != MORPH_OK)
        return 1;
    printf("6 x 6 blanket, %d steps of %g s on a ball of %g m; per step where not a size\n", STEPS, STEP,
           RADIUS);
    printf("%-24s %9s %11s %9s %10s %10s %11s %9s\n", "target", "places", "contacts", "tets", "substeps",
           "springs", "soft", "us");
    row("none", s, NULL, NULL);
    row("rigid", s, sdf, NULL);
    soft_row("soft, cell of 1 spacing", s, exact, 0.1);
    soft_row("soft, cell of 1/2", s, exact, 0.05);
    soft_row("soft, cell of 1/4", s, exact, 0.025);
    morph_sdf_destroy(sdf);
    morph_distance_destroy(exact);
    morph_mesh_free(&mesh);
    morph_structure_destroy(s);
    return 0;
}
