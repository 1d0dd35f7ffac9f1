/* Exact signed distance to a triangle mesh (our own bounding volume tree). Negative inside. For closed meshes
 * the inside is decided by angle-weighted pseudonormals (Baerentzen and Aanaes 2005); for open ones by the
 * generalised winding number (Jacobson et al. 2013), far parts of the mesh taken as dipoles: error below
 * 0.01. A closed mesh that crosses itself or holds one part inside another belongs with the open ones:
 * pseudonormals see only the nearest sheet. Across the holes of an open mesh the sign changes where the
 * distance is not 0. */
#ifndef MORPH_DISTANCE_H
#define MORPH_DISTANCE_H

#include "model/mesh.h"

typedef struct morph_distance morph_distance; /* immutable after create: may be shared by threads */

typedef struct morph_closest {
    double distance;  /* signed, m */
    double point[3];  /* on the mesh */
    double normal[3]; /* unit gradient of the signed distance at the query (away from the mesh outside) */
    int triangle;
} morph_closest;

/* The mesh is copied. MORPH_ERR_INPUT without triangles or with a vertex number out of range,
 * MORPH_ERR_NONFINITE for coordinates that are not finite or beyond 1e60 m (their products overflow). */
morph_status morph_distance_create(const morph_mesh *mesh, bool closed, morph_distance **out);
void morph_distance_destroy(morph_distance *d);
const morph_mesh *morph_distance_mesh(const morph_distance *d);

void morph_distance_point(const morph_distance *d, const double p[3], morph_closest *out);
/* Only |distance| up to `bound` matters: returns as soon as the distance is known to exceed it (out->triangle
 * = -1, out->distance = +-bound). */
void morph_distance_point_bounded(const morph_distance *d, const double p[3], double bound,
                                  morph_closest *out);

/* Least signed distance over a segment or a triangle. Exact (to rounding) where the element is clear of the
 * mesh; where it touches or enters, the deepest point found: negative or 0, to 1e-6 of the element's size,
 * where many places are equally deep to about 1e-4. Closer than rounding (4e-15 of the coordinates) is
 * touching. With an open mesh, a part inside that the mesh's surface does not cut off is looked for at a
 * pattern of 21 points. weight: barycentric weights of that point on the element. */
void morph_distance_segment(const morph_distance *d, const double a[3], const double b[3], double weight[2],
                            morph_closest *out);
void morph_distance_triangle(const morph_distance *d, const double a[3], const double b[3], const double c[3],
                             double weight[3], morph_closest *out);

/* Triangles whose boxes meet the box lo .. hi, in the tree's order. Returns the count; the first `capacity`
 * of them are written. */
int morph_distance_box(const morph_distance *d, const double lo[3], const double hi[3], int *triangle,
                       int capacity);

/* Whether the mesh is closed and no vertex lies above the plane of a triangle by more than rounding (1e-9 of
 * the largest coordinate): the target is then all on one side of the plane through the closest point of
 * anything outside, square to the way there. Takes some microseconds a triangle. */
bool morph_distance_convex(const morph_distance *d);

/* The same for an element of 2 or 3 corners with a hint: weight holds on entry the weights of a place on it
 * that may be near the nearest one (3 numbers, the unused 0). Where the least distance is beyond `enough` (m)
 * it may only be bounded: out->triangle is -1 then, out->distance a lower bound of at least `enough`, and the
 * weights are the hint's. */
void morph_distance_element(const morph_distance *d, const double corner[][3], int corners, double enough,
                            double weight[3], morph_closest *out);

/* Generalised winding number at p. */
double morph_winding(const morph_distance *d, const double p[3]);
bool morph_inside(const morph_distance *d, const double p[3]);

/* All crossings of the vertical line through (x, y) with the mesh: heights ascending, sign +1 where the
 * surface's outward normal points up. Returns the count; the lowest `capacity` of them are written. A line
 * through vertices, edges or faces on edge is taken as if it stood at (x + e, y + e^2): over a closed mesh
 * the signs always add up to 0. */
int morph_vertical_hits(const morph_distance *d, double x, double y, double *z, int *sign, int capacity);

/* Closest points of two segments: parameters s, t in [0,1]; returns the distance. */
double morph_segment_segment(const double a0[3], const double a1[3], const double b0[3], const double b1[3],
                             double *s, double *t);
/* Closest point of triangle abc to p: weights; returns the distance. */
double morph_point_triangle(const double p[3], const double a[3], const double b[3], const double c[3],
                            double weight[3]);

#endif
