/* Small meshes for tests that must not depend on the import layer. */
#ifndef TEST_SHAPES_H
#define TEST_SHAPES_H

#include "model/mesh.h"

#include <stdlib.h>
#include <string.h>

/* A box of size (x, y, z), centred in x and y, its middle at height zc. */
static inline bool test_box(morph_mesh *mesh, double x, double y, double z, double zc) {
    static const int faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                  2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    mesh->vertices = 8;
    mesh->triangles = 12;
    mesh->v = malloc(24 * sizeof *mesh->v);
    mesh->t = malloc(sizeof faces);
    if (!mesh->v || !mesh->t) return false;
    for (int k = 0; k < 8; k++) {
        mesh->v[3 * k] = (k & 1 ? 0.5 : -0.5) * x;
        mesh->v[3 * k + 1] = (k & 2 ? 0.5 : -0.5) * y;
        mesh->v[3 * k + 2] = zc + (k & 4 ? 0.5 : -0.5) * z;
    }
    memcpy(mesh->t, faces, sizeof faces);
    return true;
}

#endif
