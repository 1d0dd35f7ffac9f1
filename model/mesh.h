/* Triangle meshes: the target's surface, and what can be said of it. */
#ifndef MORPH_MESH_H
#define MORPH_MESH_H

#include "solvers/base.h"

/* Owned arrays; a zeroed struct is empty and may be freed. */
typedef struct morph_mesh {
    int vertices, triangles;
    double *v; /* 3*vertices, m */
    int *t;    /* 3*triangles, outward orientation (counter-clockwise seen from outside) */
} morph_mesh;

void morph_mesh_free(morph_mesh *mesh); /* leaves it empty */
morph_status morph_mesh_copy(const morph_mesh *from, morph_mesh *to);

typedef struct morph_mesh_report {
    int vertices, triangles;   /* after welding and triangulation */
    int welded;                /* vertices merged away */
    int degenerate;            /* zero-area faces dropped */
    int boundary_edges;        /* edges with one face */
    int nonmanifold_edges;     /* edges with more than two faces */
    int flipped;               /* faces turned to make the orientation consistent */
    int orientation_conflicts; /* edges that stay inconsistent: the mesh cannot be mended */
    int components;
    int self_intersections; /* pairs of triangles that cross, no shared vertex */
    bool closed;
    double volume, area; /* of the mended mesh; volume signed by orientation, meaningless if open */
    double lo[3], hi[3];
} morph_mesh_report;

/* Examines a triangle mesh without changing it (vertices are taken as welded). */
morph_status morph_mesh_examine(const morph_mesh *mesh, morph_mesh_report *report);

/* Welds vertices closer than tolerance (m), drops degenerate faces and unused vertices, makes the orientation
 * consistent and outward where it can, then fills *report. mesh is changed in place. */
morph_status morph_mesh_mend(morph_mesh *mesh, double tolerance, morph_mesh_report *report);

/* Triangulates one planar-ish polygon of n >= 3 vertices (indices into v), convex or concave, by ear
 * clipping. out receives 3*(n-2) indices. False if the polygon has no area or crosses itself. */
bool morph_triangulate(const double *v, const int *polygon, int n, int *out);

/* Primitive solids, centred on their bounding box, axis z; closed, outward. Curved ones are tessellated so
 * that no chord is further than `error` (m) from the true surface. */
morph_status morph_mesh_box(const double size[3], morph_mesh *out);
morph_status morph_mesh_ellipsoid(const double radii[3], double error, morph_mesh *out);
morph_status morph_mesh_cylinder(double radius, double height, double error, morph_mesh *out);
morph_status morph_mesh_cone(double radius, double height, double error, morph_mesh *out);
morph_status morph_mesh_torus(double radius, double tube, double error, morph_mesh *out);
morph_status morph_mesh_capsule(double radius, double height, double error,
                                morph_mesh *out); /* height: whole length */
/* Closed solid under heights z[row*columns + column], samples `cell` apart, columns along x, rows along -y
 * (the first row is the far side, as an image); flat underside at `floor`. */
morph_status morph_mesh_heightmap(const double *z, int rows, int columns, double cell, double floor,
                                  morph_mesh *out);

#endif
