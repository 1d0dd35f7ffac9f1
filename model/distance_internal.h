/* Inside of the exact distance, for distance*.c, sdf.c and cavity*.c alone.
 *
 * Tree: binary, axis-aligned boxes; a node holds the boxes of its two children, so one cache line pair
 * decides both. Triangles are reordered to tree order ("slots"); what a query reads of them is packed per
 * slot. */
#ifndef MORPH_DISTANCE_INTERNAL_H
#define MORPH_DISTANCE_INTERNAL_H

#include "model/distance.h"

/* Depth of the tree is bounded (see distance_tree.c), and a traversal keeps at most one entry per level. */
enum { MORPH_TREE_STACK = 96 };

typedef struct morph_tree_node {
    double lo[2][3], hi[2][3]; /* boxes of the children; an absent child has lo > hi */
    int child[2];              /* leaf: first slot, else node number */
    int count[2];              /* leaf: number of slots, else 0 */
} morph_tree_node;

/* Far field of a child for the winding number: sum of area vectors, their centre, radius about it. */
typedef struct morph_dipole {
    double area[3], centre[3], radius;
} morph_dipole;

/* Where on a triangle the closest point lies: face, edge k (corner k to k+1), corner k. */
enum { MORPH_ON_FACE = 0, MORPH_ON_EDGE = 1, MORPH_ON_CORNER = 4 };

typedef struct morph_facet {
    double corner[3][3];
    double normal[3];                           /* (b-a) x (c-a), not normalised */
    double inverse;                             /* 1/|normal|^2, 0 for a triangle without area */
    int triangle;                               /* in the mesh */
    unsigned char owns_edge[3], owns_corner[3]; /* each edge and vertex of the mesh belongs to one facet */
} morph_facet;

struct morph_distance {
    morph_mesh mesh;
    bool closed;
    double lo[3], hi[3];
    double reach; /* largest coordinate in absolute value: scale of rounding */
    int nodes;
    morph_tree_node *node;
    morph_dipole (*dipole)[2];  /* per node, per child */
    morph_facet *facet;         /* per slot */
    double (*edge_normal)[3];   /* 3*triangles: sum of the unit normals at edge k of a triangle */
    double (*corner_normal)[3]; /* per vertex, weighted by angle */
};

typedef struct morph_nearest {
    double squared; /* in: only closer than this counts; out: of the closest point */
    int slot;       /* -1: none closer */
    int feature;
    double point[3];
} morph_nearest;

/* Fills box, facet, node and dipole; arrays are the caller's to free, also on failure. */
morph_status morph_tree_build(morph_distance *d);
/* Pseudonormals (Baerentzen and Aanaes 2005). */
morph_status morph_pseudonormals_build(morph_distance *d);

/* Closest point, unsigned. best->squared is the bound on entry; `hint` is a slot to try first, or -1. */
void morph_tree_nearest(const morph_distance *d, const double p[3], int hint, morph_nearest *best);
/* Sign, unit gradient and triangle for a closest point found by morph_tree_nearest (slot >= 0). */
void morph_nearest_finish(const morph_distance *d, const double p[3], const morph_nearest *best,
                          morph_closest *out);
/* Sign of the inside alone by counting crossings above (closed) or the winding number (open). */
bool morph_inside_count(const morph_distance *d, const double p[3]);

/* Closest point of a facet: squared distance, feature, point. */
double morph_facet_nearest(const morph_facet *f, const double p[3], int *feature, double point[3]);

/* max(x, 0) without a branch: in the tree it would be a coin toss. */
static inline double morph_positive(double x) {
    return 0.5 * (x + fabs(x));
}
/* How far x lies outside [lo, hi]: one of the two parts is 0. */
static inline double morph_excess(double lo, double hi, double x) {
    return morph_positive(lo - x) + morph_positive(x - hi);
}
/* Squared distance from p to a box; 0 inside, infinite for an absent one. */
static inline double morph_box_squared(const double lo[3], const double hi[3], const double p[3]) {
    const double x = morph_excess(lo[0], hi[0], p[0]), y = morph_excess(lo[1], hi[1], p[1]),
                 z = morph_excess(lo[2], hi[2], p[2]);
    return x * x + y * y + z * z;
}

/* Least signed distance over a segment (corners 2) or triangle (corners 3) that touches or may enter the
 * mesh: branch and bound. `best` holds the best so far on entry, with its weights; improved in place. */
void morph_deepest(const morph_distance *d, const double corner[][3], int corners, double weight[3],
                   morph_closest *best);

#endif
