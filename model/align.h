/* The rigid motion that brings one shape nearest to another: lengths alone fix a shape only up to it. */
#ifndef MORPH_ALIGN_H
#define MORPH_ALIGN_H

#include "solvers/base.h"

/* Moves from[3*n] by the rotation and translation with the least sum of squared distances to to[3*n] (Horn
 * 1987, unit quaternions; no mirroring), in place. rms and most: what distance is left, m; either may be
 * NULL. MORPH_ERR_NONFINITE if a coordinate is not finite. */
morph_status morph_align(int n, double *from, const double *to, double *rms, double *most);

#endif
