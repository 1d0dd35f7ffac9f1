/* With y(s) the spline's pose and e_i(s) the unit directions of the held links in it, the pose becomes
 *   Y(s) = y(s) + sum_i lambda_i(s) (move of link i's ends apart along e_i),
 * with lambda such that |d_i(Y)|^2 = L_i^2 for all held links. All are jets: lambda_0 by Newton's method, and
 * then, since coefficient k of the left side is M lambda_k plus what the lower ones make (M the Jacobian at
 * order 0), each further step makes one more coefficient exact. */
#include "planner/hold.h"

#include "planner/jet.h"

#include <stdlib.h>
#include <string.h>

/* A post, or a joint where there are none: its numbers in a pose. */
typedef struct node {
    int offset; /* in a pose */
    int width;  /* 6: centre and direction; 3 */
    double half;
    bool fixed;
    double y[6][MORPH_JET], moved[6][MORPH_JET]; /* as given; corrected */
} node;

typedef struct held {
    int end[2];       /* nodes */
    double side[2];   /* which end of the post: -1 bottom, 1 top */
    double weight[2]; /* share of the move: 0 where held itself, else they sum to 1 */
    double length;
    double along[3][MORPH_JET], d[3][MORPH_JET];
} held;

struct morph_hold {
    int count, nodes;
    size_t width; /* numbers of a pose */
    held *link;
    node *node;
    double *lambda, *right; /* count x MORPH_JET */
    double *matrix;         /* count x count */
};

void morph_hold_destroy(morph_hold *h) {
    if (!h) return;
    free(h->link);
    free(h->node);
    free(h->lambda);
    free(h->right);
    free(h->matrix);
    free(h);
}

/* The node of a joint, added if it is new. */
static int node_of(morph_hold *h, const morph_structure *s, int joint, double *side) {
    int at = joint;
    *side = 0.0;
    for (int p = 0; p < s->posts; p++)
        for (int k = 0; k < 2; k++)
            if (s->post[p][k] == joint) {
                at = p;
                *side = k ? 1.0 : -1.0;
            }
    const int width = s->posts > 0 ? 6 : 3;
    for (int n = 0; n < h->nodes; n++)
        if (h->node[n].offset == width * at) return n;
    node *fresh = &h->node[h->nodes];
    *fresh = (node){.offset = width * at, .width = width};
    if (s->posts > 0) fresh->half = 0.5 * s->post_length[at];
    for (int k = 0; k < s->fixed_count; k++)
        if (s->fixed[k] == at) fresh->fixed = true;
    return h->nodes++;
}

static void add_link(morph_hold *h, const morph_structure *s, int l) {
    held *k = &h->link[h->count];
    bool fixed[2];
    *k = (held){.length = s->length_limit[l][0]};
    for (int e = 0; e < 2; e++) {
        k->end[e] = node_of(h, s, s->link[l][e], &k->side[e]);
        fixed[e] = h->node[k->end[e]].fixed;
    }
    if (fixed[0] && fixed[1]) return; /* nothing that could move */
    for (int e = 0; e < 2; e++)
        k->weight[e] = fixed[e] ? 0.0 : fixed[1 - e] ? 1.0 : 0.5;
    h->count++;
}

morph_status morph_hold_create(const morph_structure *s, morph_hold **out) {
    *out = NULL;
    size_t n = 0;
    for (int l = 0; l < s->links && s->length_limit; l++)
        n += s->length_limit[l][0] == s->length_limit[l][1];
    if (n == 0 || n > MORPH_HOLD_MOST) return MORPH_OK;
    morph_hold *h = calloc(1, sizeof *h);
    if (!h) return MORPH_ERR_NOMEM;
    h->link = morph_alloc(n, sizeof *h->link);
    h->node = morph_alloc(2 * n, sizeof *h->node);
    h->lambda = morph_alloc(n, MORPH_JET * sizeof(double));
    h->right = morph_alloc(n, MORPH_JET * sizeof(double));
    h->matrix = morph_alloc(n, n * sizeof(double));
    if (!h->link || !h->node || !h->lambda || !h->right || !h->matrix) {
        morph_hold_destroy(h);
        return MORPH_ERR_NOMEM;
    }
    h->width = s->posts > 0 ? 6 * (size_t)s->posts : 3 * (size_t)s->joints;
    for (int l = 0; l < s->links; l++)
        if (s->length_limit[l][0] == s->length_limit[l][1]) add_link(h, s, l);
    *out = h;
    return MORPH_OK;
}

/* Joint at one side of a node, from its jets. */
static void joint_jet(const node *n, const double (*y)[MORPH_JET], double side, int order,
                      double x[3][MORPH_JET]) {
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

/* The link's vector from its first end to its second. */
static void link_jet(const morph_hold *h, const held *l, bool moved, int order, double d[3][MORPH_JET]) {
    double x[2][3][MORPH_JET];
    for (int e = 0; e < 2; e++) {
        const node *n = &h->node[l->end[e]];
        joint_jet(n, (const double(*)[MORPH_JET])(moved ? n->moved : n->y), l->side[e], order, x[e]);
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k <= order; k++)
            d[c][k] = x[1][c][k] - x[0][c][k];
}

/* What end e of a link adds to its node by lambda = 1 along a: half of the move by the post's centre, half by
 * its turn, so that the joint moves by its share and the post's other joint, to first order, not at all. */
static void share(const held *l, int e, const node *n, double *centre, double *direction) {
    const double move = (e ? 1.0 : -1.0) * l->weight[e];
    *centre = n->width == 3 ? move : 0.5 * move;
    *direction = n->width == 3 ? 0.0 : 0.5 * move * l->side[e] / n->half;
}

static void move_nodes(morph_hold *h, int order) {
    for (int n = 0; n < h->nodes; n++)
        memcpy(h->node[n].moved, h->node[n].y, sizeof h->node[n].y);
    for (int i = 0; i < h->count; i++) {
        const held *l = &h->link[i];
        const double *lambda = &h->lambda[i * MORPH_JET];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k <= order; k++) {
                double product = 0.0;
                for (int j = 0; j <= k; j++)
                    product += lambda[j] * l->along[c][k - j];
                for (int e = 0; e < 2; e++) {
                    node *n = &h->node[l->end[e]];
                    double centre, direction;
                    share(l, e, n, &centre, &direction);
                    n->moved[c][k] += centre * product;
                    if (n->width == 6) n->moved[3 + c][k] += direction * product;
                }
            }
    }
}

/* Change of link i's vector, order 0, with lambda_j. */
static void slope(const morph_hold *h, const held *i, const held *j, double out[3]) {
    out[0] = out[1] = out[2] = 0.0;
    for (int e = 0; e < 2; e++)
        for (int f = 0; f < 2; f++) {
            if (i->end[e] != j->end[f]) continue;
            const node *n = &h->node[i->end[e]];
            double centre, direction, q[3] = {0.0, 0.0, 0.0}, norm = 1.0, along = 0.0;
            share(j, f, n, &centre, &direction);
            if (n->width == 6) {
                norm = sqrt(n->moved[3][0] * n->moved[3][0] + n->moved[4][0] * n->moved[4][0] +
                            n->moved[5][0] * n->moved[5][0]);
                for (int c = 0; c < 3; c++)
                    q[c] = n->moved[3 + c][0] / norm;
            }
            for (int c = 0; c < 3; c++)
                along += q[c] * j->along[c][0];
            for (int c = 0; c < 3; c++)
                out[c] +=
                    (e ? 1.0 : -1.0) * (centre * j->along[c][0] + i->side[e] * n->half * direction / norm *
                                                                      (j->along[c][0] - along * q[c]));
        }
}

/* Residuals of all orders into right; the largest of order 0, relative. */
static double residuals(morph_hold *h, int order) {
    double worst = 0.0;
    for (int i = 0; i < h->count; i++) {
        held *l = &h->link[i];
        double *r = &h->right[i * MORPH_JET];
        link_jet(h, l, true, order, l->d);
        morph_jet_dot((const double(*)[MORPH_JET])l->d, (const double(*)[MORPH_JET])l->d, order, r);
        r[0] -= l->length * l->length;
        worst = fmax(worst, fabs(r[0]) / (l->length * l->length));
    }
    return worst;
}

/* Solves matrix X = right by elimination with row pivoting, all orders at once; false where it is singular.
 */
static bool solve(morph_hold *h, int order) {
    const int n = h->count;
    double *a = h->matrix, *b = h->right;
    for (int c = 0; c < n; c++) {
        int best = c;
        for (int r = c + 1; r < n; r++)
            if (fabs(a[r * n + c]) > fabs(a[best * n + c])) best = r;
        /* A regular system has pivots of about a length; one this small means links that cannot be moved
         * apart from each other. */
        if (!(fabs(a[best * n + c]) > 1e-6 * h->link[c].length)) return false;
        for (int k = 0; k < n && best != c; k++) {
            const double keep = a[c * n + k];
            a[c * n + k] = a[best * n + k];
            a[best * n + k] = keep;
        }
        for (int k = 0; k <= order && best != c; k++) {
            const double keep = b[c * MORPH_JET + k];
            b[c * MORPH_JET + k] = b[best * MORPH_JET + k];
            b[best * MORPH_JET + k] = keep;
        }
        for (int r = c + 1; r < n; r++) {
            const double f = a[r * n + c] / a[c * n + c];
            if (f == 0.0) continue;
            for (int k = c; k < n; k++)
                a[r * n + k] -= f * a[c * n + k];
            for (int k = 0; k <= order; k++)
                b[r * MORPH_JET + k] -= f * b[c * MORPH_JET + k];
        }
    }
    for (int r = n - 1; r >= 0; r--)
        for (int k = 0; k <= order; k++) {
            double sum = b[r * MORPH_JET + k];
            for (int c = r + 1; c < n; c++)
                sum -= a[r * n + c] * b[c * MORPH_JET + k];
            b[r * MORPH_JET + k] = sum / a[r * n + r];
        }
    return true;
}

static bool step(morph_hold *h, int order) {
    for (int i = 0; i < h->count; i++)
        for (int j = 0; j < h->count; j++) {
            double move[3];
            slope(h, &h->link[i], &h->link[j], move);
            double sum = 0.0;
            for (int c = 0; c < 3; c++)
                sum += 2.0 * h->link[i].d[c][0] * move[c];
            h->matrix[i * h->count + j] = sum;
        }
    if (!solve(h, order)) return false;
    for (int i = 0; i < h->count; i++)
        for (int k = 0; k <= order; k++)
            h->lambda[i * MORPH_JET + k] -= h->right[i * MORPH_JET + k];
    return true;
}

static void load(morph_hold *h, int order, const double *pose, size_t width) {
    for (int m = 0; m < h->nodes; m++) {
        node *n = &h->node[m];
        for (int i = 0; i < n->width; i++)
            for (int k = 0; k <= order; k++)
                n->y[i][k] = pose[(size_t)k * width + (size_t)(n->offset + i)] / morph_factorial[k];
    }
    for (int i = 0; i < h->count; i++) {
        held *l = &h->link[i];
        double square[MORPH_JET], norm[MORPH_JET];
        link_jet(h, l, false, order, l->along);
        morph_jet_dot((const double(*)[MORPH_JET])l->along, (const double(*)[MORPH_JET])l->along, order,
                      square);
        morph_jet_sqrt(square, order, norm);
        for (int c = 0; c < 3; c++)
            morph_jet_divide(l->along[c], norm, order, l->along[c]);
    }
    memset(h->lambda, 0, (size_t)h->count * MORPH_JET * sizeof *h->lambda);
}

/* Newton's steps at order 0 end at rounding (a square of a sum of a few products: 1e-14 is some fifty units
 * in the last place); poses further off than these many steps mend are no poses of this structure. */
enum { STEPS = 10 };
static const double settled = 1e-14;

void morph_hold_apply(morph_hold *h, int order, double *pose) {
    if (!h || h->count == 0) return;
    const size_t width = h->width;
    load(h, order, pose, width);
    int since = -1;
    double worst = INFINITY;
    for (int n = 0; n < STEPS + order + 1; n++) {
        move_nodes(h, order);
        worst = residuals(h, order);
        if (since < 0 && worst <= settled) since = n;
        if (since >= 0 && n > since + order) break;
        if (!step(h, order)) return;
    }
    if (!(worst <= 1e-12)) return;
    for (int m = 0; m < h->nodes; m++) {
        const node *n = &h->node[m];
        for (int i = 0; i < n->width; i++)
            for (int k = 0; k <= order; k++)
                pose[(size_t)k * width + (size_t)(n->offset + i)] = n->moved[i][k] * morph_factorial[k];
    }
}
