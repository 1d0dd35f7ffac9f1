/* The goal within the refinement: its rows for one round, and what stood against it. For planner/refine.c. */
#ifndef MORPH_REFINE_GOAL_H
#define MORPH_REFINE_GOAL_H

#include "planner/block_goal.h"
#include "planner/pose.h"

/* The goal's rows of one round with their storage. */
typedef struct morph_aim {
    const morph_world *world;
    morph_goal goal;
    morph_goal_rows rows;
    morph_price_term prices;
    int *sample, *point; /* cavity samples; exposed points */
    double *bias, *price, *lower, *upper, *distance;
    int (*joint)[3]; /* of every exposed point, as last measured */
    double (*weight)[3];
} morph_aim;

/* Most slack unknowns that a round can have. */
int morph_aim_slacks(const morph_world *world);
/* MORPH_ERR_NOMEM. */
morph_status morph_aim_create(const morph_world *world, const morph_goal *goal, morph_aim **out);
void morph_aim_destroy(morph_aim *aim); /* NULL allowed */

enum { MORPH_AIM_BLOCKS = 2 };
/* Measures x (3*joints, scaled; room for the slacks behind) exactly and chooses rows for moves of up to
 * `reach` spacings: the mean; samples that may pass the largest gap; of the exposed points those nearest to
 * the skin whose areas add up to the coverage asked for, as far as they are not safely covered. Sets the
 * slacks behind x so that every row holds, fills out[2] and *slacks. hard: what share of the gaps that are
 * allowed the rows allow. */
morph_status morph_aim_rows(morph_aim *aim, double *x, double reach, double hard,
                            morph_block out[MORPH_AIM_BLOCKS], int *slacks);

/* Names the limits that stood against a goal, by the multipliers of a solve that minimised the miss alone:
 * each multiplier is how much less would be missed (in spacings, by all prices) per unit of its row; with the
 * row's slope and what the limit is let give way (a tenth of a spacing or of a radian; a stuck link as far as
 * its layer's limits go) it becomes what that would save. Limits that hang on one number of the scene
 * are one cause; target and base plane are one too. First the strongest limit of each of the three causes
 * whose sum is largest, then, where there are fewer, the next strongest. blocks, count: as
 * given to morph_nlp_create, base: lower bounds of coordinates from the base plane. "" if nothing stood
 * against it. MORPH_ERR_NOMEM. */
morph_status morph_limits_against(const morph_structure *s, const morph_nlp *nlp, const morph_block *blocks,
                                  int count, const morph_nlp_result *result, const double *base, char *text,
                                  size_t size);

#endif
