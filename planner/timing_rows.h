/* The limits of every link along the path as rows in one unknown function, and the length derivatives they
 * need.
 *
 * A reference profile s = sigma(theta), theta in [0, 1], runs from rest to rest with s growing like theta^3
 * at both ends. Every other profile is theta(t), and its unknown is w = (dtheta/dt)^2 over theta, in units of
 * 1 / D^2 (D: the reference's duration), so that w = 1 is the reference itself. With M(theta) = L(sigma(
 * theta)), primes by theta, theta'' = w'/2 and theta''' = sqrt(w) w''/2 (of time):
 *     rate          |M'| sqrt(w)                                   <= V D
 *     acceleration  |M'' w + M' w'/2|                              <= A D^2       linear in w
 *     jerk          |M''' w + 3/2 M'' w' + 1/2 M' w''| sqrt(w)     <= J D^3
 * and the time is D times the integral of w^(-1/2). All of M is known beforehand, on a fixed grid. Because
 * sigma takes the cubic start, w is positive and smooth at rest too (as a function of s it would not be). */
#ifndef MORPH_TIMING_ROWS_H
#define MORPH_TIMING_ROWS_H

#include "planner/timing.h"

/* Evaluates length derivatives along a curve; holds scratch. */
typedef struct morph_path_table {
    const morph_curve *curve;
    double *scratch, *joints;
    double *exact;   /* 6 x links: length derivatives 0..5 by s at the last parameter asked */
    double *by_time; /* 4 x links */
} morph_path_table;
morph_status morph_path_table_create(const morph_curve *curve, morph_path_table *out);
void morph_path_table_free(morph_path_table *table);
/* Fills table->exact at s with derivatives 0..order (at most 5). */
void morph_path_table_exact(morph_path_table *table, double s, int order);

typedef struct morph_timing_rows {
    morph_basis basis; /* of w(theta) */
    int points, links;
    double *theta;                          /* points: even from 0 to 1 */
    double *share;                          /* points: weights of the integral, sum 1 */
    int *first;                             /* points: first control point */
    double (*value)[3][MORPH_SPLINE_ORDER]; /* points: basis values and first two derivatives */
    double *rate;        /* points: square of the worst link's |M'| / (V D): w times this is at most 1 */
    bool *kept;          /* points x links: whose rows are in use */
    int *begin;          /* points + 1: each point's span of `link` rows */
    double (*link)[5];   /* rows: acceleration by (w, w'), jerk by (w, w', w''), over their limits */
    int capacity;        /* of link */
    double (*all)[5];    /* links: scratch, the rows of one point */
    double lower, upper; /* of w's control points */
} morph_timing_rows;

/* Rows around a reference profile with `controls` (>= 6) control points for w and `density` grid points to
 * each of its knot intervals. */
morph_status morph_timing_rows_create(morph_path_table *table, const morph_timing *reference, int controls,
                                      int density, morph_timing_rows *out);
/* Evaluates every link at every grid point again and takes in those that break their limits at x by more than
 * a thousandth (x NULL: the corners in some directions); *added counts them. */
morph_status morph_timing_rows_extend(morph_path_table *table, const morph_timing *reference,
                                      morph_timing_rows *rows, const double *x, int *added);
void morph_timing_rows_free(morph_timing_rows *rows);

/* w, w', w'' at a grid point from control points x. */
void morph_timing_rows_at(const morph_timing_rows *rows, int point, const double *x, double w[3]);

/* The largest factor that w may be multiplied by with every row on the grid still held: rate and acceleration
 * grow with it, jerk with its power 3/2. */
double morph_timing_rows_room(const morph_timing_rows *rows, const double *x);

#endif
