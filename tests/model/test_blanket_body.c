/* The blanket on a deformable target: it comes to rest on it, both give way, nothing inverts, the body carries
 * its weight, momentum is kept. */
#include "model/blanket_internal.h"
#include "model/body_contact.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define RADIUS 0.12

static morph_body *ball(double radius, double height, double cell, const morph_body_def *def) {
    morph_mesh mesh;
    morph_tetra tetra;
    morph_tetra_report r;
    morph_distance *d;
    morph_body *b;
    const double radii[3] = {radius, radius, radius};
    assert_int_equal(morph_mesh_ellipsoid(radii, 2e-3 * radius, &mesh), MORPH_OK);
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += height;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, cell, &tetra, &r), MORPH_OK);
    assert_int_equal(morph_body_create(&tetra, def, &b), MORPH_OK);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    return b;
}

static morph_body_def standing(void) {
    morph_body_def def = morph_body_defaults();
    def.base = 0.0;
    def.pin = atof(getenv("PIN")) * 2.0 * RADIUS; def.drag = atof(getenv("BDRAG"));def.damping = atof(getenv("BDAMP"));
    return def;
}

typedef struct scene {
    morph_structure *s;
    morph_body *body;
    morph_blanket_def def;
    double *x0;
} scene;

static scene scene_create(int nodes, double height, const morph_body_def *body) {
    scene c = {0};
    morph_structure_def sd = morph_structure_defaults(0.1);
    sd.nodes[0] = sd.nodes[1] = nodes;
    sd.stiffness = 20.0;
    assert_int_equal(morph_structure_create(&sd, &c.s), MORPH_OK);
    c.body = ball(RADIUS, RADIUS, 0.05, body);
    c.x0 = malloc(3 * (size_t)c.s->joints * sizeof(double));
    assert_non_null(c.x0);
    for (int i = 0; i < 3 * c.s->joints; i++)
        c.x0[i] = c.s->start[i] + (i % 3 == 2 ? height : 0.0);
    c.def = (morph_blanket_def){.gravity = 9.81,
                                .drag = 0.2,
                                .friction = atof(getenv("FR")),
                                .time = 4.0,
                                .frame = 0.01,
                                .base = NAN,
                                .body = c.body};
    return c;
}

static void scene_free(scene *c) {
    morph_body_destroy(c->body);
    morph_structure_destroy(c->s);
    free(c->x0);
}

int main(void) {
    morph_body_def def = standing();
    scene c = scene_create(4, 0.30, &def);
    morph_trajectory t;
    morph_blanket_report r;
    c.def.base = 0.0;
    morph_status st = morph_blanket_run(c.s, NULL, NULL, &c.def, c.x0, NULL, &t, &r);
    print_message("status %d frames %d steps %d step %.2e halvings %d rest %d speed %.2e clear %.2e len %.1e seconds %.2f substeps %ld redone %ld proj %ld least %.2f tets %d\n",
                  st, t.frames, r.steps, r.step, r.step_halvings, r.at_rest, r.rest_speed, r.worst_clearance, r.worst_length, r.seconds,
                  c.body->counts.steps, c.body->counts.redone, c.body->counts.projections, morph_body_least_volume(c.body), c.body->mesh.tets);
    for (int f = 20; f < t.frames; f += 20) {
        double most = 0, zlo = 1, zhi = 0; int who = 0;
        for (int j = 0; j < t.joints; j++) {
            const double *a = &t.x[(size_t)f * 3 * (size_t)t.joints + 3 * (size_t)j], *p = a - 3 * t.joints;
            if (morph_dist(a, p) > most) { most = morph_dist(a, p); who = j; }
            zlo = fmin(zlo, a[2]); zhi = fmax(zhi, a[2]);
        }
        print_message("t %.2f speed %.4f joint %d z %.4f .. %.4f\n", t.time[f], most / 0.01, who, zlo, zhi);
    }
    double lo[3] = {1,1,1}, hi[3] = {-1,-1,-1}, fast = 0;
    for (int i = 0; i < 3 * c.body->vertices; i++) { lo[i%3] = fmin(lo[i%3], c.body->x[i]); hi[i%3] = fmax(hi[i%3], c.body->x[i]); fast = fmax(fast, fabs(c.body->v[i])); }
    print_message("body %g %g %g .. %g %g %g fastest %g\n", lo[0], lo[1], lo[2], hi[0], hi[1], hi[2], fast);
    morph_trajectory_free(&t);
    scene_free(&c);
    return 0;
}
