/* The surface of tetrahedra as a mesh of its own. */
#include "model/tetra.h"

#include <stdlib.h>
#include <string.h>

/* Place of a vertex in the ascending list; every corner of a surface triangle is there. */
static int place_in(const int *list, int n, int vertex) {
    int lo = 0, hi = n - 1;
    while (lo < hi) {
        const int middle = lo + (hi - lo) / 2;
        if (list[middle] < vertex)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

morph_status morph_tetra_surface(const morph_tetra *mesh, const double *x, morph_mesh *out) {
    *out = (morph_mesh){0};
    double *v = morph_alloc((size_t)mesh->surface_vertices, 3 * sizeof *v);
    int *t = morph_alloc((size_t)mesh->triangles, 3 * sizeof *t);
    if (!v || !t) {
        free(v);
        free(t);
        return MORPH_ERR_NOMEM;
    }
    for (int i = 0; i < mesh->surface_vertices; i++)
        memcpy(&v[3 * i], &x[3 * mesh->surface[i]], 3 * sizeof *v);
    for (int i = 0; i < 3 * mesh->triangles; i++)
        t[i] = place_in(mesh->surface, mesh->surface_vertices, mesh->triangle[i / 3][i % 3]);
    *out = (morph_mesh){mesh->surface_vertices, mesh->triangles, v, t};
    return MORPH_OK;
}
