/* Timing: s(t) along a fixed path, rest to rest, as fast as every link's rate, acceleration and jerk allow.
 *
 * For every link, primes of L by s and dots by time,
 *     |L' s.| <= rate,   |L'' s.^2 + L' s..| <= acceleration,   |L''' s.^3 + 3 L'' s. s.. + L' s...| <= jerk,
 * with s(0) = 0, s(T) = 1 and s. = s.. = 0 at both ends. A few rounds start from the quintic profile 10 x^3 -
 * 15 x^4 + 6 x^5: each takes the best profile so far as reference sigma(theta) and finds the fastest theta(t)
 * through w = (dtheta/dt)^2, a spline over theta, in which rates and accelerations are linear and jerks
 * nearly so (timing_rows.h), by an interior point method that stays feasible (timing_barrier.h). The result
 * becomes a quintic spline s(tau), tau = t / T; T is stretched by the exact worst ratio on a grid ten times
 * finer than the samples (timing_exact.h). */
#ifndef MORPH_TIMING_H
#define MORPH_TIMING_H

#include "planner/curve.h"
#include "solvers/nlp.h"

typedef struct morph_timing {
    morph_basis basis; /* of s(tau) */
    double *control;   /* basis.count */
    double duration;   /* T, s */
} morph_timing;
void morph_timing_free(morph_timing *timing);

typedef struct morph_timing_options {
    double duration; /* s; 0: the shortest */
    double sample;   /* s; the duration becomes a whole number of these */
    const morph_control *control;
} morph_timing_options;

typedef struct morph_timing_report {
    int iterations;                         /* of all rounds */
    int unknowns, rows_used, rows_possible; /* of the last round */
    double smooth_duration; /* of the quintic rest-to-rest profile on the same path, for comparison */
    double stretch;         /* factor of the exact final stretch */
    double needed; /* shortest duration of the profile found: a shorter one asked for is infeasible. Whole
                      samples where their distance is what decides */
    double worst_rate, worst_acceleration, worst_jerk; /* ratios to the limits at the end, <= 1 */
    double seconds, linear_seconds; /* the second is 0: no linear solver worth timing is in it */
    morph_outcome outcome;          /* of the last round: MORPH_OPTIMAL or MORPH_FEASIBLE */
} morph_timing_report;

/* MORPH_OK also when options->duration is too short: then *timing has the duration needed and report->needed
 * > duration asked. */
morph_status morph_timing_solve(const morph_curve *curve, const morph_timing_options *options,
                                morph_timing *timing, morph_timing_report *report);

/* s and its derivatives 0..3 by time at time t in [0, duration]. */
void morph_timing_eval(const morph_timing *timing, double t, double s[4]);

/* Lengths, rates, accelerations, jerks (4 x links) from length derivatives by s (at least 0..3, (order + 1) x
 * links) and s by time. */
void morph_timing_chain(int links, const double *by_s, const double s[4], double *by_t);

#endif
