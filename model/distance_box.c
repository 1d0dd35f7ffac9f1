/* Triangles of a mesh near a box, and whether all of it lies beneath each of them. */
#include "model/distance_internal.h"

static bool overlap(const double alo[3], const double ahi[3], const double blo[3], const double bhi[3]) {
    for (int k = 0; k < 3; k++)
        if (!(alo[k] <= bhi[k] && blo[k] <= ahi[k])) return false;
    return true;
}

static bool facet_overlaps(const morph_facet *f, const double lo[3], const double hi[3]) {
    for (int k = 0; k < 3; k++) {
        const double a = f->corner[0][k], b = f->corner[1][k], c = f->corner[2][k];
        if ((a < lo[k] && b < lo[k] && c < lo[k]) || (a > hi[k] && b > hi[k] && c > hi[k])) return false;
    }
    return true;
}

int morph_distance_box(const morph_distance *d, const double lo[3], const double hi[3], int *triangle,
                       int capacity) {
    int stack[MORPH_TREE_STACK], top = 0, found = 0;
    if (!overlap(d->lo, d->hi, lo, hi)) return 0;
    stack[top++] = 0;
    while (top > 0) {
        const morph_tree_node *n = &d->node[stack[--top]];
        for (int side = 0; side < 2; side++) {
            if (!overlap(n->lo[side], n->hi[side], lo, hi)) continue;
            if (n->count[side] == 0) {
                stack[top++] = n->child[side];
                continue;
            }
            for (int k = 0; k < n->count[side]; k++) {
                const morph_facet *f = &d->facet[n->child[side] + k];
                if (!facet_overlaps(f, lo, hi)) continue;
                if (found < capacity) triangle[found] = f->triangle;
                found++;
            }
        }
    }
    return found;
}

/* Rounding of coordinates that facets of one plane may differ by, of the largest. */
#define FLAT 1e-9

/* Does a part of the mesh rise above the facet's plane? Boxes whose highest corner does not are passed over.
 */
static bool rises_above(const morph_distance *d, const morph_facet *f) {
    const double norm = morph_norm(f->normal);
    if (!(norm > 0)) return false;
    const double level = morph_dot(f->normal, f->corner[0]) + FLAT * d->reach * norm;
    int stack[MORPH_TREE_STACK], top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const morph_tree_node *n = &d->node[stack[--top]];
        for (int side = 0; side < 2; side++) {
            double highest = 0;
            if (n->lo[side][0] > n->hi[side][0]) continue;
            for (int k = 0; k < 3; k++)
                highest += f->normal[k] * (f->normal[k] > 0 ? n->hi[side][k] : n->lo[side][k]);
            if (!(highest > level)) continue;
            if (n->count[side] == 0) {
                stack[top++] = n->child[side];
                continue;
            }
            for (int k = 0; k < 3 * n->count[side]; k++)
                if (morph_dot(f->normal, d->facet[n->child[side] + k / 3].corner[k % 3]) > level) return true;
        }
    }
    return false;
}

bool morph_distance_convex(const morph_distance *d) {
    if (!d->closed) return false;
    for (int i = 0; i < d->mesh.triangles; i++)
        if (rises_above(d, &d->facet[i])) return false;
    return true;
}
