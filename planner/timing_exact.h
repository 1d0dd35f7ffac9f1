/* What a timing comes to on a grid finer than its samples: as a curve, and as a reader rebuilds it from the
 * samples. */
#ifndef MORPH_TIMING_EXACT_H
#define MORPH_TIMING_EXACT_H

#include "planner/timing_rows.h"

/* Fine grid points to a sample. */
enum { MORPH_TIMING_FINE = 10 };

/* Worst ratios of rate, acceleration and jerk to their limits at one time; worst is raised, not set. */
void morph_timing_ratios(morph_path_table *table, const morph_timing *timing, double t, double worst[3]);

/* The factor by which time must be stretched for ratios to become 1 at most: f divides rates by f,
 * accelerations by f^2, jerks by f^3. */
double morph_timing_stretch(const double worst[3]);

/* Worst ratios over steps + 1 even times, every one evaluated. */
void morph_timing_even(morph_path_table *table, const morph_timing *timing, int steps, double worst[3]);

/* The same result for a fine grid at less cost: a coarse grid of a fraction of the knots' spacing first, and
 * the fine one where a link's second differences leave room for more than the coarse one's worst. */
morph_status morph_timing_fine(morph_path_table *table, const morph_timing *timing, int steps,
                               double worst[3]);

/* Worst ratios, at MORPH_TIMING_FINE points to a sample, of the quintic Hermite curves through lengths, rates
 * and accelerations at `samples` + 1 even times: the curve that the checker and a drive make of a schedule.
 * The jerk's ratio leaves out what rounding of the lengths does to it. */
morph_status morph_timing_reader(morph_path_table *table, const morph_timing *timing, int samples,
                                 double worst[3]);

#endif
