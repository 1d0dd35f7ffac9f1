/* Triangles of a mesh near a box. */
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
