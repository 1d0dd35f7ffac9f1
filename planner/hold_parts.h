/* Inside the equalities that a curve holds: what hold.c and hold_rows.c share. Not for others. */
#ifndef MORPH_HOLD_PARTS_H
#define MORPH_HOLD_PARTS_H

#include "planner/hold.h"
#include "planner/jet.h"

/* A post, or a joint where there are none: its numbers in a pose. */
typedef struct morph_hold_node {
    int offset; /* in a pose */
    int width;  /* 6: centre and direction; 3 */
    double half;
    bool fixed;
    double y[6][MORPH_JET], moved[6][MORPH_JET]; /* as given; corrected */
} morph_hold_node;

/* One equality between two nodes: a link's length or a plane panel. */
typedef struct morph_hold_row {
    bool panel;
    int end[2];                   /* nodes */
    double side[2];               /* link: which end of the post: -1 bottom, 1 top */
    double weight[2];             /* share of the move: 0 where held itself; of a link they sum to 1 */
    double length;                /* of the link; of a panel, the distance of its posts at the start */
    double move[2][6][MORPH_JET]; /* what lambda = 1 adds to each node */
    double slope[2][6];           /* of the residual by each node's numbers, order 0 */
} morph_hold_row;

/* Sets the row's moves from its nodes' numbers as given. */
void morph_hold_set_move(morph_hold_row *row, const morph_hold_node *nodes, int order);

/* The residual of the corrected nodes, all orders: of a link the square of its length less what it should be,
 * m2; of a panel det[q_a, q_b, c_b - c_a] of directions and centres, m. Returns its size at order 0, relative
 * to length squared or length. */
double morph_hold_residual(const morph_hold_row *row, const morph_hold_node *nodes, int order,
                           double out[MORPH_JET]);

/* Sets the row's slope at the corrected nodes. */
void morph_hold_set_slope(morph_hold_row *row, const morph_hold_node *nodes);

#endif
