/* Quintic (C4) spline curves in many dimensions: interpolating ones through given points, and bare bases for
 * unknown ones. */
#ifndef MORPH_SPLINE_H
#define MORPH_SPLINE_H

#include "solvers/base.h"

enum { MORPH_SPLINE_DEGREE = 5, MORPH_SPLINE_ORDER = 6 };

/* A clamped knot vector. knot: count + 6 entries, the first six equal, the last six equal. */
typedef struct morph_basis {
    int count; /* control points, at least 6 */
    double *knot;
} morph_basis;

/* count >= 6 control points with evenly spaced knots over [0, 1]. */
morph_status morph_basis_uniform(int count, morph_basis *out);
/* Knots for interpolation at sites s[0] < ... < s[count-1] (count >= 6) by de Boor's averages, which keep the
 * collocation matrix regular (Schoenberg and Whitney's condition). */
morph_status morph_basis_for_sites(const double *s, int count, morph_basis *out);
void morph_basis_free(morph_basis *basis);

/* Values and derivatives 0..derivatives (at most 5) of the six basis functions that do not vanish at s
 * (clamped to the knots' range): value[d][i] belongs to control point first + i. Returns first. */
int morph_basis_eval(const morph_basis *basis, double s, int derivatives, double value[][MORPH_SPLINE_ORDER]);

typedef struct morph_spline {
    morph_basis basis;
    int columns;
    double *control; /* count x columns */
} morph_spline;

/* Through y (count x columns) at s (count, strictly increasing). Fewer than 6 points are not enough:
 * MORPH_ERR_INPUT. */
morph_status morph_spline_fit(const double *s, const double *y, int count, int columns, morph_spline *out);
void morph_spline_free(morph_spline *spline); /* leaves it empty */

/* out: (derivatives + 1) x columns, derivative by derivative. */
void morph_spline_eval(const morph_spline *spline, double s, int derivatives, double *out);

#endif
