/* Exact signed distance of points: creation, closest point, sign. */
#include "model/distance_internal.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

void morph_distance_destroy(morph_distance *d) {
    if (!d) return;
    free(d->mesh.v);
    free(d->mesh.t);
    free(d->node);
    free(d->dipole);
    free(d->facet);
    free(d->edge_normal);
    free(d->corner_normal);
    free(d);
}

/* Squared normals grow with the fourth power of lengths: 1e240 still stands. */
static const double LARGEST = 1e60;

static morph_status mesh_usable(const morph_mesh *mesh) {
    if (!mesh || mesh->vertices < 3 || mesh->triangles < 1 || !mesh->v || !mesh->t) return MORPH_ERR_INPUT;
    for (size_t i = 0; i < 3 * (size_t)mesh->vertices; i++)
        if (!(fabs(mesh->v[i]) <= LARGEST)) return MORPH_ERR_NONFINITE;
    for (size_t i = 0; i < 3 * (size_t)mesh->triangles; i++)
        if (mesh->t[i] < 0 || mesh->t[i] >= mesh->vertices) return MORPH_ERR_INPUT;
    return MORPH_OK;
}

static morph_status build(morph_distance *d, const morph_mesh *mesh) {
    const size_t nv = 3 * (size_t)mesh->vertices, nt = 3 * (size_t)mesh->triangles;
    d->mesh.v = morph_alloc(nv, sizeof *d->mesh.v);
    d->mesh.t = morph_alloc(nt, sizeof *d->mesh.t);
    if (!d->mesh.v || !d->mesh.t) return MORPH_ERR_NOMEM;
    d->mesh.vertices = mesh->vertices;
    d->mesh.triangles = mesh->triangles;
    memcpy(d->mesh.v, mesh->v, nv * sizeof *d->mesh.v);
    memcpy(d->mesh.t, mesh->t, nt * sizeof *d->mesh.t);
    const morph_status status = morph_tree_build(d);
    return status == MORPH_OK ? morph_pseudonormals_build(d) : status;
}

morph_status morph_distance_create(const morph_mesh *mesh, bool closed, morph_distance **out) {
    *out = NULL;
    morph_status status = mesh_usable(mesh);
    if (status != MORPH_OK) return status;
    morph_distance *d = calloc(1, sizeof *d);
    if (!d) return MORPH_ERR_NOMEM;
    d->closed = closed;
    status = build(d, mesh);
    if (status != MORPH_OK) {
        morph_distance_destroy(d);
        return status;
    }
    *out = d;
    return MORPH_OK;
}

const morph_mesh *morph_distance_mesh(const morph_distance *d) {
    return &d->mesh;
}

static inline void leaf_nearest(const morph_distance *d, const double p[3], int first, int count,
                                morph_nearest *best) {
    for (int i = first; i < first + count; i++) {
        const morph_facet *f = &d->facet[i];
        double ap[3];
        morph_sub(p, f->corner[0], ap);
        /* The plane is never further than the triangle. */
        const double height = morph_dot(ap, f->normal);
        if (height * height * f->inverse >= best->squared) continue;
        int feature;
        double point[3];
        const double squared = morph_facet_nearest(f, p, &feature, point);
        if (squared < best->squared) {
            best->squared = squared;
            best->slot = i;
            best->feature = feature;
            memcpy(best->point, point, sizeof point);
        }
    }
}

void morph_tree_nearest(const morph_distance *d, const double p[3], int hint, morph_nearest *best) {
    best->slot = -1;
    if (hint >= 0) leaf_nearest(d, p, hint, 1, best);
    struct {
        double squared;
        int node;
    } stack[MORPH_TREE_STACK];
    int top = 0, at = 0;
    for (;;) {
        const morph_tree_node *n = &d->node[at];
        double squared[2];
        for (int side = 0; side < 2; side++)
            squared[side] = morph_box_squared(n->lo[side], n->hi[side], p);
        const int near = squared[1] < squared[0];
        int next = -1;
        for (int turn = 0; turn < 2; turn++) {
            const int side = turn == 0 ? near : !near;
            if (!(squared[side] < best->squared)) continue;
            if (n->count[side] > 0) {
                leaf_nearest(d, p, n->child[side], n->count[side], best);
            } else if (next < 0) {
                next = n->child[side];
            } else {
                stack[top].squared = squared[side];
                stack[top++].node = n->child[side];
            }
        }
        while (next < 0 && top > 0)
            if (stack[--top].squared < best->squared) next = stack[top].node;
        if (next < 0) return;
        at = next;
    }
}

/* Pseudonormal of the feature a closest point lies on; its sign tells the side wherever that point is the
 * closest of the mesh. Not normalised. */
static const double *feature_normal(const morph_distance *d, const morph_nearest *best) {
    const morph_facet *f = &d->facet[best->slot];
    const size_t triangle = (size_t)f->triangle;
    if (best->feature == MORPH_ON_FACE) return f->normal;
    if (best->feature < MORPH_ON_CORNER)
        return d->edge_normal[3 * triangle + (size_t)(best->feature - MORPH_ON_EDGE)];
    return d->corner_normal[d->mesh.t[3 * triangle + (size_t)(best->feature - MORPH_ON_CORNER)]];
}

static void set_unit(const double v[3], double scale, double out[3]) {
    const double norm = morph_norm(v);
    for (int k = 0; k < 3; k++)
        out[k] = norm > 0 ? scale * v[k] / norm : k == 2;
}

void morph_nearest_finish(const morph_distance *d, const double p[3], const morph_nearest *best,
                          morph_closest *out) {
    const double *normal = feature_normal(d, best);
    double away[3];
    morph_sub(p, best->point, away);
    const double distance = sqrt(best->squared);
    const bool inside = d->closed ? morph_dot(away, normal) < 0 : morph_inside_count(d, p);
    const double sign = inside ? -1 : 1;
    out->distance = sign * distance;
    out->triangle = d->facet[best->slot].triangle;
    memcpy(out->point, best->point, sizeof out->point);
    /* The difference p - point carries the rounding of its terms, 1e-16 of the coordinates: nearer than 1e-12
     * of them its direction is no better than 1e-4, and the pseudonormal stands in. Over a face the normal is
     * the gradient on both sides. */
    const bool over_face = best->feature == MORPH_ON_FACE && d->closed;
    if (over_face || distance <= 1e-12 * d->reach)
        set_unit(normal, 1, out->normal);
    else
        set_unit(away, sign, out->normal);
}

void morph_distance_point_bounded(const morph_distance *d, const double p[3], double bound,
                                  morph_closest *out) {
    /* Squares of denormal or huge bounds lose the comparison; a distance equal to the bound still counts. */
    morph_nearest best = {.squared = bound < 1e150 ? bound * bound * (1 + 4 * DBL_EPSILON) : INFINITY};
    morph_tree_nearest(d, p, -1, &best);
    if (best.slot >= 0) {
        morph_nearest_finish(d, p, &best, out);
        return;
    }
    *out = (morph_closest){.distance = morph_inside_count(d, p) ? -bound : bound, .triangle = -1};
}

void morph_distance_point(const morph_distance *d, const double p[3], morph_closest *out) {
    morph_distance_point_bounded(d, p, INFINITY, out);
}

bool morph_inside(const morph_distance *d, const double p[3]) {
    if (!d->closed) return morph_inside_count(d, p);
    if (morph_box_squared(d->lo, d->hi, p) > 0) return false;
    morph_closest c;
    morph_distance_point(d, p, &c);
    return c.distance < 0;
}
