/* The fastest w(theta) within the rows of timing_rows.h, by a primal-dual interior point method that never
 * leaves the feasible set.
 *
 * Every row is c(w) >= 0 with c = 1 -+ (linear), 1 - rate w, or w^(-1/2) -+ (linear) for jerk. The last is
 * convex in w, so its tangent lies beneath it: a step that stays within the linearised rows stays within the
 * rows. The objective is convex, the unknowns are some dozens with a band of five, so a step costs one pass
 * over all rows and a banded Cholesky factorisation. */
#ifndef MORPH_TIMING_BARRIER_H
#define MORPH_TIMING_BARRIER_H

#include "planner/timing_rows.h"

/* x (rows->basis.count): start, strictly within all rows (one outside is left as it is), and result: the
 * start or a faster one, within all rows on the grid. *iterations is added to. MORPH_ERR_STOPPED after the
 * control's stop, with x usable. mu: the first barrier parameter. */
morph_status morph_timing_barrier(const morph_timing_rows *rows, double mu, const morph_control *control,
                                  double *x, int *iterations, bool *converged);

/* The merit that its steps lower, time - mu * sum of log c, and its gradient (rows->basis.count): for tests
 * of the formulas. INFINITY outside the rows. */
morph_status morph_timing_merit(const morph_timing_rows *rows, double mu, const double *x, double *merit,
                                double *gradient);

#endif
