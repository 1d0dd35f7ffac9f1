/* Rows of the timing NLP and the length derivatives along the path that they need. */
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

/* One row: kind 0 rate, 1 acceleration, 2 jerk of a link at a grid time. */
typedef struct morph_timing_row {
    int point, link, kind;
} morph_timing_row;

typedef struct morph_timing_rows {
    morph_path_table *table;
    const morph_basis *basis;
    double duration; /* of u = 1 */
    int points;
    int *first;                             /* points: first control point */
    double (*value)[4][MORPH_SPLINE_ORDER]; /* points: basis values and derivatives */
    int count;
    morph_timing_row *row;
    double *lower, *upper;           /* count */
    double *step_lower, *step_upper; /* controls - 1 */
    double *lengths;                 /* points x 6 x links: derivatives at the last x */
    double *at;                      /* points: parameter where lengths stand */
    int controls;
} morph_timing_rows;

/* Rows near their limits (within `0.7` of them) at the present profile on grid + 1 evenly spaced times. */
morph_status morph_timing_rows_create(morph_path_table *table, const morph_timing *timing, int grid,
                                      morph_timing_rows *out);
void morph_timing_rows_free(morph_timing_rows *rows);
/* Limits, monotony of the control points, and the objective -u. Returns the number of blocks (2 or 3). */
int morph_timing_rows_blocks(morph_timing_rows *rows, morph_block out[3]);

#endif
