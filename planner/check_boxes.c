/* A target's triangles in a tree of boxes, and elements of the structure swept past them. */
#include "planner/check_parts.h"

#include "model/swept.h"

#include <stdlib.h>
#include <string.h>

/* Triangles in a leaf at most: what is tested costs more than a box does. */
enum { LEAF = 4 };
/* More than these near an element, and a proof costs more than the halving that it would spare. */
enum { MOST_NEAR = 48 };
/* Halving by count is never deeper than the 31 bits of an int. */
enum { DEPTH = 64 };

typedef struct node {
    double lo[3], hi[3];
    int first, count; /* triangles, of a leaf */
    int right;        /* the left child follows its parent; 0: a leaf */
} node;

struct morph_boxes {
    const double *v;
    const int *t;
    int *order; /* triangles by leaf */
    double *middle;
    node *nodes;
    int used;
};

static void bound_triangles(const morph_boxes *b, node *n) {
    for (int k = 0; k < 3; k++) {
        n->lo[k] = INFINITY;
        n->hi[k] = -INFINITY;
    }
    for (int i = n->first; i < n->first + n->count; i++)
        for (int c = 0; c < 3; c++) {
            const double *p = &b->v[3 * (size_t)b->t[3 * (size_t)b->order[i] + (size_t)c]];
            for (int k = 0; k < 3; k++) {
                n->lo[k] = fmin(n->lo[k], p[k]);
                n->hi[k] = fmax(n->hi[k], p[k]);
            }
        }
}

/* Puts the `half` triangles with the lowest middles along the axis first (selection by partition). */
static void part(const morph_boxes *b, int first, int count, int half, int axis) {
    int lo = first, hi = first + count - 1;
    const int aim = first + half;
    while (lo < hi) {
        const double pivot = b->middle[3 * (size_t)b->order[lo + (hi - lo) / 2] + (size_t)axis];
        int i = lo, j = hi;
        while (i <= j) {
            while (b->middle[3 * (size_t)b->order[i] + (size_t)axis] < pivot)
                i++;
            while (b->middle[3 * (size_t)b->order[j] + (size_t)axis] > pivot)
                j--;
            if (i > j) break;
            const int other = b->order[i];
            b->order[i++] = b->order[j];
            b->order[j--] = other;
        }
        if (aim <= j)
            hi = j;
        else if (aim >= i)
            lo = i;
        else
            return;
    }
}

/* Halves by count across the longest side. */
static void build(morph_boxes *b, int first, int count) {
    node *n = &b->nodes[b->used++];
    *n = (node){.first = first, .count = count};
    bound_triangles(b, n);
    if (count <= LEAF) return;
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (n->hi[k] - n->lo[k] > n->hi[axis] - n->lo[axis]) axis = k;
    part(b, first, count, count / 2, axis);
    build(b, first, count / 2);
    n->right = b->used;
    build(b, first + count / 2, count - count / 2);
}

morph_status morph_boxes_create(const double *v, const int *t, int triangles, morph_boxes **out) {
    *out = NULL;
    morph_boxes *b = morph_alloc(1, sizeof *b);
    if (!b) return MORPH_ERR_NOMEM;
    *b = (morph_boxes){.v = v, .t = t};
    const size_t n = (size_t)triangles;
    b->order = morph_alloc(n, sizeof *b->order);
    b->middle = morph_alloc(n, 3 * sizeof *b->middle);
    b->nodes = morph_alloc(2 * n, sizeof *b->nodes);
    if (!b->order || !b->middle || !b->nodes) {
        morph_boxes_destroy(b);
        return MORPH_ERR_NOMEM;
    }
    for (int i = 0; i < triangles; i++) {
        b->order[i] = i;
        for (size_t k = 0; k < 3; k++)
            b->middle[3 * (size_t)i + k] = v[3 * (size_t)t[3 * i] + k] + v[3 * (size_t)t[3 * i + 1] + k] +
                                           v[3 * (size_t)t[3 * i + 2] + k];
    }
    if (triangles > 0) build(b, 0, triangles);
    *out = b;
    return MORPH_OK;
}

void morph_boxes_destroy(morph_boxes *b) {
    if (!b) return;
    free(b->order);
    free(b->middle);
    free(b->nodes);
    free(b);
}

/* Two edges of the element and of a triangle; the link has one. */
static bool edges_meet(const morph_swept_element *e, const double tri[3][3],
                       const morph_swept_options *options) {
    for (int i = 0; i < (e->corners == 3 ? 3 : 1); i++) {
        const int j = (i + 1) % e->corners;
        double a[2][2][3];
        for (int end = 0; end < 2; end++) {
            memcpy(a[end][0], e->at[end][i], sizeof a[end][0]);
            memcpy(a[end][1], e->at[end][j], sizeof a[end][1]);
        }
        for (int k = 0; k < 3; k++) {
            double b[2][3];
            memcpy(b[0], tri[k], sizeof b[0]);
            memcpy(b[1], tri[(k + 1) % 3], sizeof b[1]);
            if (morph_swept_edge_edge((const double(*)[3])a[0], (const double(*)[3])b,
                                      (const double(*)[3])a[1], (const double(*)[3])b, options, NULL))
                return true;
        }
    }
    return false;
}

/* The least distance of two triangles that do not cross is that of a vertex and a triangle or of two edges;
 * before they cross, one of these is 0. */
static bool meets(const morph_swept_element *e, const double tri[3][3], const morph_swept_options *options) {
    for (int i = 0; i < e->corners; i++)
        if (morph_swept_vertex_triangle(e->at[0][i], tri, e->at[1][i], tri, options, NULL)) return true;
    if (e->corners == 1) return false;
    for (int k = 0; k < 3 && e->corners == 3; k++)
        if (morph_swept_vertex_triangle(tri[k], (const double(*)[3])e->at[0], tri[k],
                                        (const double(*)[3])e->at[1], options, NULL))
            return true;
    return edges_meet(e, tri, options);
}

bool morph_boxes_apart(const morph_boxes *b, const morph_swept_element *e, double distance) {
    const morph_swept_options options = {distance, true};
    double lo[3], hi[3];
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
        for (int i = 0; i < 2 * e->corners; i++) {
            lo[k] = fmin(lo[k], e->at[i & 1][i / 2][k] - distance);
            hi[k] = fmax(hi[k], e->at[i & 1][i / 2][k] + distance);
        }
    }
    int stack[DEPTH], top = 0, near = 0;
    if (b->used > 0) stack[top++] = 0;
    while (top > 0) {
        const int at = stack[--top];
        const node *n = &b->nodes[at];
        bool overlap = true;
        for (int k = 0; k < 3; k++)
            overlap = overlap && n->lo[k] <= hi[k] && n->hi[k] >= lo[k];
        if (!overlap) continue;
        if (n->right > 0) {
            stack[top++] = n->right;
            stack[top++] = at + 1;
            continue;
        }
        if ((near += n->count) > MOST_NEAR) return false;
        for (int i = n->first; i < n->first + n->count; i++) {
            double tri[3][3];
            for (int c = 0; c < 3; c++)
                memcpy(tri[c], &b->v[3 * (size_t)b->t[3 * (size_t)b->order[i] + (size_t)c]], sizeof tri[c]);
            if (meets(e, (const double(*)[3])tri, &options)) return false;
        }
    }
    return true;
}
