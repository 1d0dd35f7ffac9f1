/* Inside the kinematics: the rows of links, posts and panels, in this order. For model/kinematics*.c only. */
#ifndef MORPH_KINEMATICS_ROWS_H
#define MORPH_KINEMATICS_ROWS_H

#include "model/structure.h"

/* A row: the gradient of one quantity by the joints that it depends on. */
typedef struct morph_row {
    int joints, joint[4];
    double gradient[4][3];
} morph_row;

int morph_row_count(const morph_structure *s);

/* Row `index` at x. Returns the quantity: the length of a link or post (m, gradient without unit), or
 * det[p_a, p_b, d] of a panel with posts p_a, p_b and d from foot to foot (m3, gradient m2). Joints of a row
 * are distinct. */
double morph_row_at(const morph_structure *s, const double *x, int index, morph_row *row);

/* column (joints): where a joint's three unknowns begin, -1 for fixed joints. Returns the number of unknowns.
 */
int morph_free_columns(const morph_structure *s, int *column);

#endif
