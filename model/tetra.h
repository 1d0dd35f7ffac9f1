/* Tetrahedral meshes: the inside of a deformable target. */
#ifndef MORPH_TETRA_H
#define MORPH_TETRA_H

#include "model/distance.h"

/* Owned arrays; a zeroed struct is empty and may be freed. Every tetrahedron has positive volume
 * (b - a) x (c - a) . (d - a) / 6. Every vertex belongs to one. */
typedef struct morph_tetra {
    int vertices, tets, triangles, surface_vertices;
    double *v;          /* 3 * vertices, m */
    int (*tet)[4];      /* tets */
    int (*triangle)[3]; /* the surface: vertex numbers, counter-clockwise seen from outside */
    int *behind;        /* triangles: the tetrahedron that has it as a face */
    int *surface;       /* surface_vertices: numbers of the vertices on the surface, ascending */
} morph_tetra;

void morph_tetra_free(morph_tetra *mesh); /* leaves it empty */

typedef enum morph_tetra_fault {
    MORPH_TETRA_SOUND = 0,
    MORPH_TETRA_EMPTY,     /* no tetrahedron */
    MORPH_TETRA_NONFINITE, /* vertex `where` is not finite or beyond 1e60 m */
    MORPH_TETRA_RANGE,     /* tetrahedron `where` names a vertex that does not exist, or one twice */
    MORPH_TETRA_FLAT,      /* tetrahedron `where` has no volume */
    MORPH_TETRA_CROWDED,   /* tetrahedra `where` and `other` share a face with a third */
    MORPH_TETRA_OVERLAP,   /* tetrahedra `where` and `other` lie on the same side of a face they share */
    MORPH_TETRA_COARSE     /* morph_tetra_fill: no lattice point inside, or too many tetrahedra */
} morph_tetra_fault;

typedef struct morph_tetra_report {
    morph_tetra_fault fault;
    int where, other; /* numbers, from 0 */
    int flipped;      /* tetrahedra that were turned to have positive volume */
    int unused;       /* vertices of no tetrahedron, dropped */
    double volume;    /* m3 */
    /* 12 (3 V)^(2/3) / sum of the squared edges: 1 for the regular tetrahedron, 0 for a flat one (Liu and
     * Joe 1994). */
    double least_quality, mean_quality;
    double least_angle, most_angle; /* dihedral, radians */
} morph_tetra_report;

/* Makes a mesh of n vertices and m tetrahedra (both copied): turns negative ones, drops unused vertices (the
 * others keep their order), finds the surface. MORPH_ERR_INPUT with the fault named in *report (which must
 * not be NULL), MORPH_ERR_NOMEM. *out is empty on failure. */
morph_status morph_tetra_create(int n, const double *v, int m, const int (*tet)[4], morph_tetra *out,
                                morph_tetra_report *report);

/* Fills a closed surface with tetrahedra of about `cell` (m): isosurface stuffing (Labelle and Shewchuk 2007)
 * of a body-centred cubic lattice fitted to the bounding box, sharp edges and corners then snapped to, then
 * smoothed. Vertices of the result's surface lie on the given one (to 1e-9 of the cell). A feature thinner
 * than the cell may be lost: compare report->volume. MORPH_ERR_INPUT with the fault MORPH_TETRA_COARSE if
 * nothing is left of it or the lattice would have over 4e6 points, or for a cell that is not positive. */
morph_status morph_tetra_fill(const morph_distance *target, double cell, morph_tetra *out,
                              morph_tetra_report *report);

/* The surface with the mesh's vertices at x (3 * vertices; mesh->v for the shape as it is): the vertices of
 * mesh->surface in their order, the triangles by numbers in that order. Owned by the caller. */
morph_status morph_tetra_surface(const morph_tetra *mesh, const double *x, morph_mesh *out);

/* Volumes and shape of one tetrahedron of a mesh with vertices at x. */
static inline double morph_tetra_volume(const double *x, const int tet[4]) {
    double a[3], b[3], c[3], n[3];
    morph_sub(&x[3 * tet[1]], &x[3 * tet[0]], a);
    morph_sub(&x[3 * tet[2]], &x[3 * tet[0]], b);
    morph_sub(&x[3 * tet[3]], &x[3 * tet[0]], c);
    morph_cross(a, b, n);
    return morph_dot(n, c) / 6.0;
}
double morph_tetra_quality(const double *x, const int tet[4]);

/* Incident tetrahedra of every vertex: those of vertex i are list[first[i]] .. list[first[i + 1] - 1],
 * ascending. Both arrays are the caller's to free(). */
morph_status morph_tetra_around(int vertices, int tets, const int (*tet)[4], int **first, int **list);

#endif
