/* The time that each link alone would need: a bound from below for every schedule of a path. */
#ifndef MORPH_TIMING_BOUND_H
#define MORPH_TIMING_BOUND_H

#include "planner/curve.h"

/* Shortest time in which a length may change by `distance` (m, either sign) from rest to rest, with its rate,
 * acceleration and jerk within limits (m/s, m/s2, m/s3; positive): the profile of up to seven segments of
 * constant jerk, in closed form. 0 for no distance. */
double morph_timing_alone(double distance, double rate, double acceleration, double jerk);

/* The largest such time over all links, each with its change from the curve's start to its end: no schedule
 * along any path between the two shapes is shorter. *link: whose it is; -1 where nothing changes.
 * MORPH_ERR_NOMEM. */
morph_status morph_timing_single_link(const morph_curve *curve, double *seconds, int *link);

#endif
