/* Which limits make a schedule as long as it is. */
#ifndef MORPH_TIMING_AGAINST_H
#define MORPH_TIMING_AGAINST_H

#include "planner/timing.h"

/* Names the limits that stood against `asked` seconds (positive), by what the profile found (timing, longer
 * than that) runs at: of each kind (rate, acceleration, jerk) the link that the time hangs on most, kinds
 * with the largest share of the time first, those with little left out:
 *     "rate of link 17 (2,1)-(3,1) bottom at 3.210 s (0.0138 m/s beyond 0.01 m/s in 1 s)"
 * where the amount is how far the same profile, run in `asked`, would pass the limit there. "" if nothing
 * moves. size: 1 at least. MORPH_ERR_NOMEM. */
morph_status morph_timing_against(const morph_curve *curve, const morph_timing *timing, double asked,
                                  char *text, size_t size);

#endif
