/* Timing: s(t) along a fixed path, rest to rest, as fast as every link's rate, acceleration and jerk allow.
 *
 * With t = T tau, s(tau) a quintic spline with s(0) = 0, s(1) = 1 and s' = s'' = 0 at both ends, and u = 1/T,
 * for every link |L' s'| u <= rate,  |L'' s'^2 + L' s''| u^2 <= acceleration,  |L''' s'^3 + 3 L'' s' s'' + L'
 * s'''| u^3 <= jerk (primes of L by s, of s by tau). The NLP maximises u over the spline's control points at
 * a grid of tau, with rows only for the links near their limits; then T is stretched by the exact worst ratio
 * on a grid as fine as asked. */
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
    int iterations, unknowns, rows_used, rows_possible;
    double smooth_duration; /* of the quintic rest-to-rest profile on the same path, for comparison */
    double stretch;         /* factor of the exact final stretch */
    double needed; /* shortest duration of the profile found: a shorter one asked for is infeasible */
    double worst_rate, worst_acceleration, worst_jerk; /* ratios to the limits at the end, <= 1 */
    double seconds, linear_seconds;
    morph_outcome outcome;
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
