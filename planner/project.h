/* The nearest pose within all limits. */
#ifndef MORPH_PROJECT_H
#define MORPH_PROJECT_H

#include "planner/pose.h"

/* How far a pose may be beyond its limits and still count as inside: relative (posts), spacings, radians. The
 * check's own tolerances, or tighter. */
extern const double morph_pose_tolerance[MORPH_LIMITS];

/* Running totals of solves; add to what is there. */
typedef struct morph_effort {
    int solves, iterations;
    int unknowns, rows, jacobian_nonzeros, hessian_nonzeros; /* of the largest solve */
    double linear_seconds, callback_seconds;
} morph_effort;
void morph_effort_add(morph_effort *effort, const morph_nlp_result *result);

/* Moves x (3*joints, scaled) the least, in the sum of squares, that its limits with `inset` ask: solves,
 * examines exactly, adds the rows that were missed, up to `rounds` times. *violation is that of the result,
 * without inset. `active` is the caller's, used as scratch and left with the last rows. */
morph_status morph_project(const morph_world *world, const morph_inset *inset, int rounds,
                           const morph_control *control, morph_active *active, double *x,
                           morph_violation *violation, morph_effort *effort);

#endif
