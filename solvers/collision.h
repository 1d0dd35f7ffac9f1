/* Exact distances between separated meshes by FCL, for verification. The implementation is the only C++ file;
 * no exception leaves it. */
#ifndef MORPH_COLLISION_H
#define MORPH_COLLISION_H

#include "solvers/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The shim throws nothing: said to the C++ compiler too. */
#ifdef __cplusplus
#define MORPH_NOEXCEPT noexcept
#else
#define MORPH_NOEXCEPT
#endif

typedef struct morph_solid morph_solid; /* a target as a bounding volume hierarchy (OBBRSS); immutable */

/* v: 3*vertices, t: 3*triangles; copied. Non-finite vertices are refused (MORPH_ERR_NONFINITE): FCL would
 * lose contacts silently. */
morph_status morph_solid_create(const double *v, int vertices, const int *t, int triangles,
                                morph_solid **out) MORPH_NOEXCEPT;
void morph_solid_destroy(morph_solid *solid) MORPH_NOEXCEPT; /* NULL allowed */

/* Least distance between the solid's surface and a set of loose triangles (9 doubles each; a link is given as
 * a triangle with a repeated or middle vertex). *distance is 0 when any pair touches or crosses; *element is
 * the number of the nearest loose triangle. A set inside the solid without touching the surface is not
 * noticed: the caller asks an inside test of its own. Relative error about 1e-15 of the coordinates' size,
 * whatever the scale. Non-finite numbers are refused. */
morph_status morph_solid_distance(const morph_solid *solid, const double *triangles, int count,
                                  double *distance, int *element) MORPH_NOEXCEPT;

/* Pairs of boxes that overlap (broad phase): lo, hi 3*count each; pairs receives up to capacity (i < j);
 * *found the true count. Touching boxes overlap; pairs are sorted. */
morph_status morph_box_pairs(const double *lo, const double *hi, int count, int (*pairs)[2], int capacity,
                             int *found) MORPH_NOEXCEPT;

#ifdef __cplusplus
}
#endif
#endif
