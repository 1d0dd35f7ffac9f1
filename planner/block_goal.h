/* Rows of a scene's goal over one pose, made elastic: each row may be passed by a slack unknown t >= 0, which
 * has a price. The start usually misses its goal, and a goal may be out of reach: the problem then still has
 * feasible points, and its solution says how near one comes. */
#ifndef MORPH_BLOCK_GOAL_H
#define MORPH_BLOCK_GOAL_H

#include "planner/blocks.h"
#include "planner/goal.h"

/* All lengths in spacings. Rows, in this order, each with a slack t of its own but for the samples, which
 * share one (the largest gap counts):
 *
 *   mean      sum A_q s(g_q) / sum A_q + mean_bias - t  <=  limit[0]
 *   samples   g_q - t                                   <=  limit[1]
 *   points    |W x - y|^2 / (2 D) - t                   <=  D / 2,      D = r + limit[2]
 *
 * g_q is the smooth gap of morph_gap_term at the sample plus its bias, s(g) = (g + sqrt(g^2 + round^2)) / 2 a
 * rounded positive part: where links touch the gap is 0. A bias is exact minus smooth where last measured.
 * The third is |W x - y| <= D as a quadratic whose slope at the limit is 1; W is the skin point closest to y,
 * fixed, so the exact distance is never larger than the row's. */
typedef struct morph_goal_rows {
    morph_gap_term gap; /* its scale is not used */
    double limit[MORPH_GOAL_KINDS];
    double round;
    bool mean; /* has the first row */
    double mean_bias;
    int samples;
    const int *sample;  /* skin samples of the cavity */
    const double *bias; /* of every skin sample */
    int points;
    const int *point;      /* exposed points of the cavity */
    const int (*joint)[3]; /* of every exposed point */
    const double (*weight)[3];
} morph_goal_rows;

int morph_goal_rows_count(const morph_goal_rows *rows);
/* Slack unknowns; they stand behind the pose's coordinates. */
int morph_goal_rows_slacks(const morph_goal_rows *rows);
/* unknown, lower, upper as in blocks.h. */
morph_block morph_block_goal(morph_goal_rows *data, const int *unknown, double *lower, double *upper);

/* Objective: sum of price_k x[first + k], count of them; `unknowns` in all. */
typedef struct morph_price_term {
    int unknowns, first, count;
    const double *price;
} morph_price_term;
morph_block morph_block_price(morph_price_term *data, const int *unknown);

#endif
