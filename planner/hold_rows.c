/* A link's length: |d|^2 = L^2 with d between points of two posts, c + side half q/|q|. A plane panel:
 * det[q_a, q_b, d] = 0 with d from foot to foot; what of d lies along q_a or q_b drops out, so d may as well
 * go from centre to centre, and the lengths of q_a and q_b do not matter. */
#include "planner/hold_parts.h"

#include <string.h>

typedef double jet3[3][MORPH_JET];

static void cross(const double (*u)[MORPH_JET], const double (*v)[MORPH_JET], int order, jet3 out) {
    for (int c = 0; c < 3; c++) {
        const double *u1 = u[(c + 1) % 3], *u2 = u[(c + 2) % 3], *v1 = v[(c + 1) % 3], *v2 = v[(c + 2) % 3];
        for (int k = 0; k <= order; k++) {
            out[c][k] = 0.0;
            for (int j = 0; j <= k; j++)
                out[c][k] += u1[j] * v2[k - j] - u2[j] * v1[k - j];
        }
    }
}

/* Joint at one side of a node, from its jets. */
static void joint_jet(const morph_hold_node *n, const double (*y)[MORPH_JET], double side, int order,
                      jet3 x) {
    double square[MORPH_JET], norm[MORPH_JET], q[MORPH_JET];
    memcpy(x, y, 3 * sizeof *x);
    if (n->width == 3) return;
    morph_jet_dot(y + 3, y + 3, order, square);
    morph_jet_sqrt(square, order, norm);
    for (int c = 0; c < 3; c++) {
        morph_jet_divide(y[3 + c], norm, order, q);
        for (int k = 0; k <= order; k++)
            x[c][k] += side * n->half * q[k];
    }
}

static const double (*numbers(const morph_hold_node *n, bool moved))[MORPH_JET] {
    return (const double(*)[MORPH_JET])(moved ? n->moved : n->y);
}

/* From the first end to the second: of a link between its joints, of a panel between centres. */
static void between(const morph_hold_row *r, const morph_hold_node *nodes, bool moved, int order, jet3 d) {
    double x[2][3][MORPH_JET];
    for (int e = 0; e < 2; e++) {
        const morph_hold_node *n = &nodes[r->end[e]];
        if (r->panel)
            memcpy(x[e], numbers(n, moved), sizeof x[e]);
        else
            joint_jet(n, numbers(n, moved), r->side[e], order, x[e]);
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k <= order; k++)
            d[c][k] = x[1][c][k] - x[0][c][k];
}

/* lambda = 1 moves the ends apart by one along the link: half of each share by the post's centre, half by its
 * turn, so that the joint moves by its share and the post's other joint, to first order, not at all. */
static void set_link_move(morph_hold_row *r, const morph_hold_node *nodes, int order, jet3 d) {
    double square[MORPH_JET], norm[MORPH_JET];
    morph_jet_dot((const double(*)[MORPH_JET])d, (const double(*)[MORPH_JET])d, order, square);
    morph_jet_sqrt(square, order, norm);
    for (int c = 0; c < 3; c++) {
        morph_jet_divide(d[c], norm, order, d[c]);
        for (int e = 0; e < 2; e++) {
            const morph_hold_node *n = &nodes[r->end[e]];
            const double move = (e ? 1.0 : -1.0) * r->weight[e];
            const double centre = n->width == 3 ? move : 0.5 * move;
            const double turn = n->width == 3 ? 0.0 : 0.5 * move * r->side[e] / n->half;
            for (int k = 0; k <= order; k++) {
                r->move[e][c][k] = centre * d[c][k];
                r->move[e][3 + c][k] = turn * d[c][k];
            }
        }
    }
}

/* Along the residual's slopes, in the measure of how far joints go: a direction's change by the half post
 * squared; over length and half post squared, so that lambda has no unit. */
static void set_panel_move(morph_hold_row *r, const morph_hold_node *nodes, int order, jet3 d) {
    const morph_hold_node *a = &nodes[r->end[0]], *b = &nodes[r->end[1]];
    const double(*qa)[MORPH_JET] = numbers(a, false) + 3, (*qb)[MORPH_JET] = numbers(b, false) + 3;
    const double(*dc)[MORPH_JET] = (const double(*)[MORPH_JET])d;
    jet3 by[2], centre;
    cross(qb, dc, order, by[0]);
    cross(dc, qa, order, by[1]);
    cross(qa, qb, order, centre);
    for (int e = 0; e < 2; e++) {
        const double half = nodes[r->end[e]].half, scale = r->weight[e] / r->length;
        for (int c = 0; c < 3; c++)
            for (int k = 0; k <= order; k++) {
                r->move[e][3 + c][k] = scale * by[e][c][k];
                r->move[e][c][k] = (e ? 1.0 : -1.0) * scale * half * half * centre[c][k];
            }
    }
}

void morph_hold_set_move(morph_hold_row *r, const morph_hold_node *nodes, int order) {
    jet3 d;
    between(r, nodes, false, order, d);
    if (r->panel)
        set_panel_move(r, nodes, order, d);
    else
        set_link_move(r, nodes, order, d);
}

double morph_hold_residual(const morph_hold_row *r, const morph_hold_node *nodes, int order,
                           double out[MORPH_JET]) {
    jet3 d;
    between(r, nodes, true, order, d);
    const double(*dc)[MORPH_JET] = (const double(*)[MORPH_JET])d;
    if (r->panel) {
        jet3 n;
        cross(numbers(&nodes[r->end[0]], true) + 3, numbers(&nodes[r->end[1]], true) + 3, order, n);
        morph_jet_dot((const double(*)[MORPH_JET])n, dc, order, out);
        return fabs(out[0]) / r->length;
    }
    morph_jet_dot(dc, dc, order, out);
    out[0] -= r->length * r->length;
    return fabs(out[0]) / (r->length * r->length);
}

/* |d|^2: 2d by the second joint, and by q that across q, times side half / |q|. */
static void set_link_slope(morph_hold_row *r, const morph_hold_node *nodes, jet3 d) {
    for (int e = 0; e < 2; e++) {
        const morph_hold_node *n = &nodes[r->end[e]];
        double q[3] = {0.0, 0.0, 0.0}, norm = 1.0, along = 0.0;
        if (n->width == 6) {
            norm = sqrt(n->moved[3][0] * n->moved[3][0] + n->moved[4][0] * n->moved[4][0] +
                        n->moved[5][0] * n->moved[5][0]);
            for (int c = 0; c < 3; c++)
                q[c] = n->moved[3 + c][0] / norm;
        }
        for (int c = 0; c < 3; c++)
            along += q[c] * d[c][0];
        for (int c = 0; c < 3; c++) {
            const double sign = e ? 2.0 : -2.0;
            r->slope[e][c] = sign * d[c][0];
            r->slope[e][3 + c] = sign * r->side[e] * n->half / norm * (d[c][0] - along * q[c]);
        }
    }
}

/* det[q_a, q_b, d]: q_b x d, d x q_a, and q_a x q_b by the second centre. */
static void set_panel_slope(morph_hold_row *r, const morph_hold_node *nodes, jet3 d) {
    const double(*qa)[MORPH_JET] = numbers(&nodes[r->end[0]], true) + 3,
          (*qb)[MORPH_JET] = numbers(&nodes[r->end[1]], true) + 3;
    const double(*dc)[MORPH_JET] = (const double(*)[MORPH_JET])d;
    jet3 by[2], centre;
    cross(qb, dc, 0, by[0]);
    cross(dc, qa, 0, by[1]);
    cross(qa, qb, 0, centre);
    for (int e = 0; e < 2; e++)
        for (int c = 0; c < 3; c++) {
            r->slope[e][c] = (e ? 1.0 : -1.0) * centre[c][0];
            r->slope[e][3 + c] = by[e][c][0];
        }
}

void morph_hold_set_slope(morph_hold_row *r, const morph_hold_node *nodes) {
    jet3 d;
    between(r, nodes, true, 0, d);
    if (r->panel)
        set_panel_slope(r, nodes, d);
    else
        set_link_slope(r, nodes, d);
}
