/* What the mesh files share: edges with their faces, a bounding volume tree over the triangles. */
#ifndef MORPH_MESH_PRIVATE_H
#define MORPH_MESH_PRIVATE_H

#include "model/mesh.h"

/* Undirected edges. Half edge h = 3 * triangle + corner runs from that corner to the next one; half edges
 * are grouped by edge: edge e owns half[first[e]] .. half[first[e + 1] - 1], ascending. Triangles that name a
 * vertex twice have no edges (of = -1). */
typedef struct morph_mesh_edges {
    int count;
    int (*vertex)[2]; /* count: lower and higher vertex; edges stand in this order */
    int *first;       /* count + 1 */
    int *half;        /* first[count] */
    int *of;          /* 3 * triangles: edge of a half edge */
} morph_mesh_edges;

morph_status morph_mesh_edges_build(const morph_mesh *mesh, morph_mesh_edges *out);
void morph_mesh_edges_free(morph_mesh_edges *edges);

static inline int morph_half_from(const int *t, int h) {
    return t[h];
}
static inline int morph_half_to(const int *t, int h) {
    return t[h - h % 3 + (h + 1) % 3];
}

/* Labels triangles by part (joined through edges of any number of faces): 0 .. *parts - 1 in the order of
 * their first triangle; triangles without edges get -1. label has one entry a triangle. */
morph_status morph_mesh_parts(const morph_mesh *mesh, const morph_mesh_edges *edges, int *label, int *parts);

/* Finite vertices (else MORPH_ERR_NONFINITE) and indices in range (else MORPH_ERR_INPUT). */
morph_status morph_mesh_valid(const morph_mesh *mesh);

/* Box over the vertices that triangles use; zeros for a mesh without triangles. */
void morph_mesh_bounds(const morph_mesh *mesh, double lo[3], double hi[3]);

/* Twice the area vector of triangle f: its length is twice the area, its direction outward. */
void morph_mesh_normal(const morph_mesh *mesh, int f, double n[3]);

/* True where triangle f is flatter than `height` (m): its least height, the doubled area over its longest
 * edge, is not above it. Rounding alone (1e-12 of that edge) always counts as flat. */
bool morph_mesh_flat(const morph_mesh *mesh, int f, double height);

/* Everything of the report but self_intersections. */
morph_status morph_mesh_measure(const morph_mesh *mesh, const morph_mesh_edges *edges,
                                morph_mesh_report *report);

/* Turns triangles so that neighbours agree (across edges with two faces), part by part with the fewest turns.
 * turned: one flag a triangle, toggled for each turn. */
morph_status morph_mesh_agree(morph_mesh *mesh, const morph_mesh_edges *edges, bool *turned);

/* Turns whole parts outward; counts the pairs of triangles that cross on the way (one tree for both). */
morph_status morph_mesh_outward(morph_mesh *mesh, const morph_mesh_edges *edges, bool *turned,
                                int *crossings);

/* Tree over the triangles in Morton order; leaves hold up to four. */
typedef struct morph_mesh_tree {
    int nodes;
    double (*box)[6]; /* lo, hi */
    int (*span)[2];   /* range in order */
    int (*child)[2];  /* -1, -1 for leaves */
    int *order;       /* triangles */
} morph_mesh_tree;

morph_status morph_mesh_tree_build(const morph_mesh *mesh, morph_mesh_tree *out);
void morph_mesh_tree_free(morph_mesh_tree *tree);

/* Number of pairs of triangles without a common vertex that cross deeper than 1e-6 of the mesh's size (single
 * precision files round by 6e-8). A count that reaches a million, or work beyond 4e8 box tests (hopelessly
 * tangled), ends the search: the count is then a lower bound. label, crossed: where not NULL, crossed[part]
 * is set for both parts of a crossing pair of different parts. */
int morph_mesh_crossings(const morph_mesh *mesh, const morph_mesh_tree *tree, const int *label,
                         bool *crossed);

/* Number of triangles, of parts other than `skip` and with wanted[part], that the ray from p along d meets.
 */
int morph_mesh_ray(const morph_mesh *mesh, const morph_mesh_tree *tree, const double p[3], const double d[3],
                   const int *label, const bool *wanted, int skip);

#endif
