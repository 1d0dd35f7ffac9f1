/* Pseudonormals of edges and vertices: the sign of (p - closest point) . pseudonormal tells inside from
 * outside exactly for a closed mesh (Baerentzen and Aanaes 2005): at an edge the sum of the two unit normals,
 * at a vertex the sum of the unit normals weighted by the angles at it. */
#include "model/distance_internal.h"

#include <stdlib.h>
#include <string.h>

typedef struct half_edge {
    int low, high; /* vertices */
    int at;        /* 3*triangle + edge */
} half_edge;

static int compare_half_edges(const void *pa, const void *pb) {
    const half_edge *a = pa, *b = pb;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return (a->at > b->at) - (a->at < b->at);
}

/* Unit normal; zero for a triangle without area. */
static void unit_normal(const morph_facet *f, double out[3]) {
    const double scale = sqrt(f->inverse);
    for (int k = 0; k < 3; k++)
        out[k] = f->normal[k] * scale;
}

static void add_corner_normals(morph_distance *d, const morph_facet *f, const double normal[3]) {
    for (int j = 0; j < 3; j++) {
        double u[3], v[3], cross[3];
        morph_sub(f->corner[(j + 1) % 3], f->corner[j], u);
        morph_sub(f->corner[(j + 2) % 3], f->corner[j], v);
        morph_cross(u, v, cross);
        const double angle = atan2(morph_norm(cross), morph_dot(u, v));
        double *sum = d->corner_normal[d->mesh.t[3 * (size_t)f->triangle + (size_t)j]];
        for (int k = 0; k < 3; k++)
            sum[k] += angle * normal[k];
    }
}

/* Gives every edge and vertex to one facet. owner: 3*triangles flags for edges, then zeros per vertex. */
static void share_out(morph_distance *d, unsigned char *owner) {
    unsigned char *taken = owner + 3 * (size_t)d->mesh.triangles;
    for (int i = 0; i < d->mesh.triangles; i++) {
        morph_facet *f = &d->facet[i];
        for (int j = 0; j < 3; j++) {
            const size_t at = 3 * (size_t)f->triangle + (size_t)j;
            const int vertex = d->mesh.t[at];
            f->owns_edge[j] = owner[at];
            f->owns_corner[j] = !taken[vertex];
            taken[vertex] = 1;
        }
    }
}

morph_status morph_pseudonormals_build(morph_distance *d) {
    const size_t n = (size_t)d->mesh.triangles;
    double(*face)[3] = morph_alloc(n, sizeof *face);
    half_edge *edge = morph_alloc(3 * n, sizeof *edge);
    unsigned char *owner = morph_alloc(3 * n + (size_t)d->mesh.vertices, sizeof *owner);
    d->edge_normal = morph_alloc(3 * n, sizeof *d->edge_normal);
    d->corner_normal = morph_alloc((size_t)d->mesh.vertices, sizeof *d->corner_normal);
    if (!face || !edge || !owner || !d->edge_normal || !d->corner_normal) {
        free(face);
        free(edge);
        free(owner);
        return MORPH_ERR_NOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        const morph_facet *f = &d->facet[i];
        unit_normal(f, face[f->triangle]);
        add_corner_normals(d, f, face[f->triangle]);
    }
    for (size_t i = 0; i < 3 * n; i++) {
        const int a = d->mesh.t[i], b = d->mesh.t[i - i % 3 + (i + 1) % 3];
        edge[i] = (half_edge){a < b ? a : b, a < b ? b : a, (int)i};
    }
    qsort(edge, 3 * n, sizeof *edge, compare_half_edges);
    for (size_t i = 0, j; i < 3 * n; i = j) {
        double sum[3] = {0};
        for (j = i; j < 3 * n && edge[j].low == edge[i].low && edge[j].high == edge[i].high; j++)
            for (int k = 0; k < 3; k++)
                sum[k] += face[edge[j].at / 3][k];
        for (size_t m = i; m < j; m++)
            memcpy(d->edge_normal[edge[m].at], sum, sizeof sum);
        owner[edge[i].at] = 1;
    }
    share_out(d, owner);
    free(owner);
    free(face);
    free(edge);
    return MORPH_OK;
}
