/* Equalities on a curve of poses: links of one length (both limits the same: stuck, or rigid) and panels that
 * stay plane. A spline through poses that hold them does not hold them between; a small move of the two posts
 * (or joints) of each puts them right at every parameter, with its derivatives, so that the curve stays
 * smooth and they hold to rounding. */
#ifndef MORPH_HOLD_H
#define MORPH_HOLD_H

#include "model/structure.h"

/* Links that a curve holds at most: each evaluation solves a dense system of them. Where a structure has more
 * of one length the curve holds none. */
enum { MORPH_HOLD_MOST = 64 };

typedef struct morph_hold morph_hold;

/* Of `structure`: links, posts, length_limit, panel, fixed. *out is NULL where nothing is held; it owns its
 * memory and keeps nothing of the structure. MORPH_ERR_NOMEM. */
morph_status morph_hold_create(const morph_structure *structure, morph_hold **out);
void morph_hold_destroy(morph_hold *hold); /* NULL allowed */

/* Corrects a pose and its derivatives 0..order (less than MORPH_JET) in place: (order + 1) x the pose's width
 * (curve.h). NULL holds nothing. A pose that cannot be put right (links in one line, panels that
 * leave each other no choice, or too far off) stays as
 * it is. Does not allocate; uses memory of *hold. */
void morph_hold_apply(morph_hold *hold, int order, double *pose);

#endif
