/* For tests of settle: a target on the plane z = 0 under a grid of posts. */
#ifndef MORPH_TEST_SETTLE_SCENE_H
#define MORPH_TEST_SETTLE_SCENE_H

#include "model/settle_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef struct scene {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf;
    double *start, *x; /* flat, a spacing above the target; scratch */
    size_t bytes;
    int n;
} scene;

static inline morph_structure_def scene_structure(int nodes, double stiffness) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = nodes;
    def.stiffness = stiffness;
    return def;
}

/* Stands `mesh`, which is freed, on the plane and the grid a spacing above its `height`. */
static inline void scene_place(scene *s, const morph_structure_def *def, morph_mesh *mesh, double height) {
    *s = (scene){0};
    assert_int_equal(morph_structure_create(def, &s->structure), MORPH_OK);
    const double a = def->spacing, half = 0.5 * a * (def->nodes[0] - 1) + a;
    double low = INFINITY;
    for (int i = 0; i < mesh->vertices; i++)
        low = fmin(low, mesh->v[3 * i + 2]);
    for (int i = 0; i < mesh->vertices; i++)
        mesh->v[3 * i + 2] -= low;
    assert_int_equal(morph_distance_create(mesh, true, &s->exact), MORPH_OK);
    morph_mesh_free(mesh);
    s->n = 3 * s->structure->joints;
    s->bytes = (size_t)s->n * sizeof(double);
    s->start = malloc(s->bytes);
    s->x = malloc(s->bytes);
    assert_true(s->start && s->x);
    const double lo[3] = {-half, -half, -0.5 * a}, hi[3] = {half, half, height + 2.5 * a};
    for (int i = 0; i < s->n; i++)
        s->start[i] = s->x[i] = s->structure->start[i] + (i % 3 == 2 ? height + a : 0.0);
    assert_int_equal(morph_sdf_create(s->exact, lo, hi, a / 16.0, NULL, &s->sdf), MORPH_OK);
}

/* Sizes as in examples/scenes: a box half as wide as the grid, a sphere of 0.6 of its width. */
static inline void scene_make(scene *s, const morph_structure_def *def, bool sphere) {
    const double width = def->spacing * (def->nodes[0] - 1), r = 0.3 * width;
    const double size[3] = {0.5 * width, 0.5 * width, 0.3 * width}, radii[3] = {r, r, r};
    morph_mesh mesh;
    assert_int_equal(sphere ? morph_mesh_ellipsoid(radii, 0.002 * def->spacing, &mesh)
                            : morph_mesh_box(size, &mesh),
                     MORPH_OK);
    scene_place(s, def, &mesh, sphere ? 2.0 * r : size[2]);
}

/* A saddle z = h (x^2 - y^2) / w^2 over a block 0.7 of the grid wide. */
static inline void scene_saddle(scene *s, const morph_structure_def *def) {
    enum { ROWS = 33 };
    const double width = def->spacing * (def->nodes[0] - 1), half = 0.35 * width, rise = 0.12 * width;
    double *z = malloc(ROWS * ROWS * sizeof *z);
    assert_non_null(z);
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < ROWS; c++) {
            const double x = 2.0 * c / (ROWS - 1) - 1.0, y = 2.0 * r / (ROWS - 1) - 1.0;
            z[r * ROWS + c] = 2.0 * rise + rise * (x * x - y * y);
        }
    morph_mesh mesh;
    assert_int_equal(morph_mesh_heightmap(z, ROWS, ROWS, 2.0 * half / (ROWS - 1), 0.0, &mesh), MORPH_OK);
    free(z);
    scene_place(s, def, &mesh, 3.0 * rise);
}

static inline void scene_free(scene *s) {
    morph_sdf_destroy(s->sdf);
    morph_distance_destroy(s->exact);
    morph_structure_destroy(s->structure);
    free(s->start);
    free(s->x);
}

static inline morph_settle *scene_settle(const scene *s, const morph_settle_def *def) {
    morph_settle *settle;
    assert_int_equal(morph_settle_create(s->structure, s->sdf, def, &settle), MORPH_OK);
    return settle;
}

#endif
