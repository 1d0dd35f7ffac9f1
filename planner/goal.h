/* What a scene asks of the end shape as a hard limit: the least that counts as reached. */
#ifndef MORPH_GOAL_H
#define MORPH_GOAL_H

#include "solvers/base.h"

typedef enum morph_goal_kind {
    MORPH_GOAL_MEAN_GAP, /* m, at most */
    MORPH_GOAL_MAX_GAP,  /* m, at most */
    MORPH_GOAL_COVERAGE, /* share of the exposed points, at least */
    MORPH_GOAL_KINDS
} morph_goal_kind;
/* "mean_gap", "max_gap", "coverage", as in the scene */
const char *morph_goal_name(morph_goal_kind kind);
const char *morph_goal_unit(morph_goal_kind kind); /* "m", "share" */

/* 0: not asked for. So a zeroed goal asks for nothing. */
typedef struct morph_goal {
    double limit[MORPH_GOAL_KINDS];
} morph_goal;

bool morph_goal_any(const morph_goal *goal);

/* How far inside its limit a measured value is, in its own unit; negative: missed. */
double morph_goal_margin(const morph_goal *goal, morph_goal_kind kind, double value);

/* What of a miss is rounding: 1e-9 of the limit. Values are sums of exact distances, which repeat to about
 * 1e-15 of their size wherever they are computed; anything beyond that is a shape that falls short, and what
 * was asked for is a hard limit. */
double morph_goal_tolerance(const morph_goal *goal, morph_goal_kind kind);

/* The sum of all that is missed, gaps in spacings: 0 where nothing is. value: MORPH_GOAL_KINDS, m and share.
 */
double morph_goal_miss(const morph_goal *goal, const double value[MORPH_GOAL_KINDS], double spacing);

#endif
