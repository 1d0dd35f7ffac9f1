/* The moving polygon of the swept test; for model/swept*.c only. */
#ifndef MORPH_SWEPT_INTERNAL_H
#define MORPH_SWEPT_INTERNAL_H

#include "model/swept.h"

/* Unit roundoff of double, 2^-53. */
#define MORPH_SWEPT_ROUND 0x1p-53
/* Added to every error bound: more than all products together can lose to underflow, while the polygon is
 * kept near size 1 (within 2^-200 .. 2^200). */
#define MORPH_SWEPT_TINY 1e-300

/* Corners relative to the origin, in order around the polygon, at t = 0 and t = 1: plus - minus, rounded,
 * times 2^-exponent. */
typedef struct morph_swept_polygon {
    int corners;                            /* 3, or 4 for a parallelogram */
    int exponent;                           /* 0 unless the size is out of the way */
    double separation;                      /* scaled likewise */
    double at[2][4][3];                     /* corners */
    const double *plus[2][4], *minus[2][4]; /* what they are differences of; not owned */
} morph_swept_polygon;

/* Times lo < t < hi are free of contact; none if lo >= hi. lo < 0 includes 0, hi > 1 includes 1. */
typedef struct morph_swept_span {
    double lo, hi;
} morph_swept_span;

/* Proven free times of direction w, |w_k| <= 1 (any w is safe, NaN included). */
morph_swept_span morph_swept_free(const morph_swept_polygon *p, const double w[3]);

/* Corners at time t (rounded). */
void morph_swept_corners(const morph_swept_polygon *p, double t, double x[4][3]);

/* Direction from the origin to the nearest point of the flat polygon x, and its normal (not of unit length).
 * False where it is too near to have one. */
bool morph_swept_direction(int corners, const double x[4][3], double w[3], double normal[3]);

/* Divides w by its largest component. False where that is 0 or not finite. */
bool morph_swept_normalise(double w[3]);

/* Directions worth trying where the nearest point's is lost in rounding; returns the count. */
enum { MORPH_SWEPT_CANDIDATES = 12 };
int morph_swept_candidates(int corners, const double x[4][3], const double normal[3],
                           double w[MORPH_SWEPT_CANDIDATES][3]);

/* Advances *t, before which all is proven free, in double: at most `steps` steps, until one is below `least`
 * (part of the motion, or of the pair's size if that is smaller). False: free up to and including 1. True:
 * stuck at *t. */
bool morph_swept_advance(const morph_swept_polygon *p, double least, int steps, double *t);

/* Continues at *t, before which all is proven free, with exact directions. True: hit, *t the time. */
bool morph_swept_strict(const morph_swept_polygon *p, double *t);

#endif
