/* Smooth signed distance: an interpolating cubic B-spline (C2) through exact distances at the nodes of a
 * regular grid. */
#ifndef MORPH_SDF_H
#define MORPH_SDF_H

#include "model/distance.h"

typedef struct morph_sdf morph_sdf; /* immutable after create: may be shared by threads */

/* Grid over [lo, hi] with cells of at most `cell` (m), at least 4 nodes along each side. MORPH_ERR_STOPPED on
 * request, MORPH_ERR_INPUT for an empty box or cell, MORPH_ERR_NOMEM also beyond 2^30 nodes. With an open
 * mesh the distance jumps across its holes, and the spline is as steep there as a cell allows. */
morph_status morph_sdf_create(const morph_distance *exact, const double lo[3], const double hi[3],
                              double cell, const morph_control *control, morph_sdf **out);
void morph_sdf_destroy(morph_sdf *sdf);

/* Value at p [m]; gradient g[3] and second derivatives h[6] (xx, xy, xz, yy, yz, zz) where not NULL. Finite
 * and C1 everywhere, also outside the grid. Does not allocate. */
double morph_sdf_eval(const morph_sdf *sdf, const double p[3], double *g, double *h);

typedef struct morph_sdf_accuracy {
    double cell;
    int nodes[3];
    double rms, max; /* |spline - exact| over random points within `band` of the surface, outside */
    double band;
} morph_sdf_accuracy;
/* Measured at 10,000 points of a fixed pseudo-random sequence. */
void morph_sdf_measure(const morph_sdf *sdf, const morph_distance *exact, double band,
                       morph_sdf_accuracy *out);

#endif
