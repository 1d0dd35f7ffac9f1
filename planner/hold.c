/* With y(s) the spline's pose, the pose becomes
 *   Y(s) = y(s) + sum_i lambda_i(s) move_i(s),
 * move_i what changes equality i most (hold_rows.c), and lambda such that all of them hold. All are jets:
 * lambda_0 by Newton's method, and then, since coefficient k of the residuals is M lambda_k plus what the
 * lower ones make (M the Jacobian at order 0), each further step makes one more coefficient exact. */
#include "planner/hold_parts.h"

#include <stdlib.h>
#include <string.h>

struct morph_hold {
    int count, nodes;
    size_t width; /* numbers of a pose */
    morph_hold_row *row;
    morph_hold_node *node;
    double *lambda, *right; /* count x MORPH_JET */
    double *matrix;         /* count x count; factored in place */
    int *pivot;             /* count */
};

void morph_hold_destroy(morph_hold *h) {
    if (!h) return;
    free(h->row);
    free(h->node);
    free(h->lambda);
    free(h->right);
    free(h->matrix);
    free(h->pivot);
    free(h);
}

/* The node of a post, or of a joint where there are none, added if it is new. */
static int node_at(morph_hold *h, const morph_structure *s, int at) {
    const int width = s->posts > 0 ? 6 : 3;
    for (int n = 0; n < h->nodes; n++)
        if (h->node[n].offset == width * at) return n;
    morph_hold_node *fresh = &h->node[h->nodes];
    *fresh = (morph_hold_node){.offset = width * at, .width = width};
    if (s->posts > 0) fresh->half = 0.5 * s->post_length[at];
    for (int k = 0; k < s->fixed_count; k++)
        if (s->fixed[k] == at) fresh->fixed = true;
    return h->nodes++;
}

static int node_of(morph_hold *h, const morph_structure *s, int joint, double *side) {
    int at = joint;
    *side = 0.0;
    for (int p = 0; p < s->posts; p++)
        for (int k = 0; k < 2; k++)
            if (s->post[p][k] == joint) {
                at = p;
                *side = k ? 1.0 : -1.0;
            }
    return node_at(h, s, at);
}

/* Shares of a row that is set but for them; both ends held: nothing that could move, and no row. */
static void keep_row(morph_hold *h, morph_hold_row *r, double both) {
    const bool fixed[2] = {h->node[r->end[0]].fixed, h->node[r->end[1]].fixed};
    if (fixed[0] && fixed[1]) return;
    for (int e = 0; e < 2; e++)
        r->weight[e] = fixed[e] ? 0.0 : fixed[1 - e] ? 1.0 : both;
    h->count++;
}

static void add_link(morph_hold *h, const morph_structure *s, int l) {
    morph_hold_row *r = &h->row[h->count];
    *r = (morph_hold_row){.length = s->length_limit[l][0]};
    for (int e = 0; e < 2; e++)
        r->end[e] = node_of(h, s, s->link[l][e], &r->side[e]);
    keep_row(h, r, 0.5);
}

static void add_panel(morph_hold *h, const morph_structure *s, int q) {
    morph_hold_row *r = &h->row[h->count];
    *r = (morph_hold_row){.panel = true, .length = s->spacing};
    for (int e = 0; e < 2; e++)
        r->end[e] = node_at(h, s, s->panel[q][e]);
    keep_row(h, r, 1.0);
}

morph_status morph_hold_create(const morph_structure *s, morph_hold **out) {
    *out = NULL;
    size_t links = 0;
    for (int l = 0; l < s->links && s->length_limit; l++)
        links += s->length_limit[l][0] == s->length_limit[l][1];
    if (links > MORPH_HOLD_MOST) links = 0;
    const size_t n = links + (size_t)s->panels;
    if (n == 0) return MORPH_OK;
    morph_hold *h = calloc(1, sizeof *h);
    if (!h) return MORPH_ERR_NOMEM;
    h->row = morph_alloc(n, sizeof *h->row);
    h->node = morph_alloc(2 * n, sizeof *h->node);
    h->lambda = morph_alloc(n, MORPH_JET * sizeof(double));
    h->right = morph_alloc(n, MORPH_JET * sizeof(double));
    h->matrix = morph_alloc(n, n * sizeof(double));
    h->pivot = morph_alloc(n, sizeof *h->pivot);
    if (!h->row || !h->node || !h->lambda || !h->right || !h->matrix || !h->pivot) {
        morph_hold_destroy(h);
        return MORPH_ERR_NOMEM;
    }
    h->width = s->posts > 0 ? 6 * (size_t)s->posts : 3 * (size_t)s->joints;
    for (int l = 0; l < s->links && links > 0; l++)
        if (s->length_limit[l][0] == s->length_limit[l][1]) add_link(h, s, l);
    for (int q = 0; q < s->panels; q++)
        add_panel(h, s, q);
    *out = h;
    return MORPH_OK;
}

static void move_nodes(morph_hold *h, int order) {
    for (int n = 0; n < h->nodes; n++)
        memcpy(h->node[n].moved, h->node[n].y, sizeof h->node[n].y);
    for (int i = 0; i < h->count; i++) {
        const morph_hold_row *r = &h->row[i];
        const double *lambda = &h->lambda[i * MORPH_JET];
        for (int e = 0; e < 2; e++) {
            morph_hold_node *n = &h->node[r->end[e]];
            for (int c = 0; c < n->width; c++)
                for (int k = 0; k <= order; k++)
                    for (int j = 0; j <= k; j++)
                        n->moved[c][k] += lambda[j] * r->move[e][c][k - j];
        }
    }
}

/* Residuals of all orders into right; the largest of order 0, relative. */
static double residuals(morph_hold *h, int order) {
    double worst = 0.0;
    for (int i = 0; i < h->count; i++)
        worst =
            fmax(worst, morph_hold_residual(&h->row[i], h->node, order, &h->right[(size_t)i * MORPH_JET]));
    return worst;
}

/* matrix = the residuals' change with each lambda, order 0. */
static void assemble(morph_hold *h) {
    for (int i = 0; i < h->count; i++)
        morph_hold_set_slope(&h->row[i], h->node);
    for (int i = 0; i < h->count; i++)
        for (int j = 0; j < h->count; j++) {
            const morph_hold_row *a = &h->row[i], *b = &h->row[j];
            double sum = 0.0;
            for (int e = 0; e < 2; e++)
                for (int f = 0; f < 2; f++)
                    for (int c = 0; a->end[e] == b->end[f] && c < h->node[a->end[e]].width; c++)
                        sum += a->slope[e][c] * b->move[f][c][0];
            h->matrix[(size_t)i * (size_t)h->count + (size_t)j] = sum;
        }
}

static void swap_rows(double *a, double *b, int n) {
    for (int k = 0; k < n; k++) {
        const double keep = a[k];
        a[k] = b[k];
        b[k] = keep;
    }
}

/* LU with row pivoting in place; false where it is singular. Most entries are zero (rows share few nodes),
 * and those rows are passed over. */
static bool factor(morph_hold *h) {
    const int n = h->count;
    double *a = h->matrix;
    for (int c = 0; c < n; c++) {
        int best = c;
        for (int r = c + 1; r < n; r++)
            if (fabs(a[r * n + c]) > fabs(a[best * n + c])) best = r;
        /* A regular system has pivots of about a length; one this small means equalities that cannot be met
         * apart from each other. */
        if (!(fabs(a[best * n + c]) > 1e-6 * h->row[c].length)) return false;
        h->pivot[c] = best;
        if (best != c) swap_rows(&a[c * n], &a[best * n], n);
        for (int r = c + 1; r < n; r++) {
            if (a[r * n + c] == 0.0) continue;
            const double f = a[r * n + c] /= a[c * n + c];
            for (int k = c + 1; k < n; k++)
                a[r * n + k] -= f * a[c * n + k];
        }
    }
    return true;
}

/* right becomes the solution, all orders at once. */
static void solve(morph_hold *h, int order) {
    const int n = h->count;
    const double *a = h->matrix;
    double *b = h->right;
    for (int c = 0; c < n; c++)
        if (h->pivot[c] != c) swap_rows(&b[c * MORPH_JET], &b[h->pivot[c] * MORPH_JET], order + 1);
    for (int r = 0; r < n; r++)
        for (int c = 0; c < r; c++)
            for (int k = 0; a[r * n + c] != 0.0 && k <= order; k++)
                b[r * MORPH_JET + k] -= a[r * n + c] * b[c * MORPH_JET + k];
    for (int r = n - 1; r >= 0; r--)
        for (int k = 0; k <= order; k++) {
            double sum = b[r * MORPH_JET + k];
            for (int c = r + 1; c < n; c++)
                sum -= a[r * n + c] * b[c * MORPH_JET + k];
            b[r * MORPH_JET + k] = sum / a[r * n + r];
        }
}

static void load(morph_hold *h, int order, const double *pose) {
    for (int m = 0; m < h->nodes; m++) {
        morph_hold_node *n = &h->node[m];
        for (int i = 0; i < n->width; i++)
            for (int k = 0; k <= order; k++)
                n->y[i][k] = pose[(size_t)k * h->width + (size_t)(n->offset + i)] / morph_factorial[k];
    }
    for (int i = 0; i < h->count; i++)
        morph_hold_set_move(&h->row[i], h->node, order);
    memset(h->lambda, 0, (size_t)h->count * MORPH_JET * sizeof *h->lambda);
}

/* Newton's steps at order 0 end at rounding (a square of a sum of a few products: 1e-14 is some fifty units
 * in the last place); poses further off than these many steps mend are no poses of this structure. */
enum { STEPS = 10 };
static const double settled = 1e-14;

void morph_hold_apply(morph_hold *h, int order, double *pose) {
    if (!h || h->count == 0) return;
    load(h, order, pose);
    int since = -1;
    double worst = INFINITY;
    for (int n = 0; n < STEPS + order + 1; n++) {
        move_nodes(h, order);
        worst = residuals(h, order);
        if (since >= 0 && n > since + order) break;
        /* Once order 0 has settled the matrix stays. */
        if (since < 0) {
            assemble(h);
            if (!factor(h)) return;
        }
        if (since < 0 && worst <= settled) since = n;
        solve(h, order);
        for (int i = 0; i < h->count; i++)
            for (int k = 0; k <= order; k++)
                h->lambda[i * MORPH_JET + k] -= h->right[i * MORPH_JET + k];
    }
    if (!(worst <= 1e-12)) return;
    for (int m = 0; m < h->nodes; m++) {
        const morph_hold_node *n = &h->node[m];
        for (int i = 0; i < n->width; i++)
            for (int k = 0; k <= order; k++)
                pose[(size_t)k * h->width + (size_t)(n->offset + i)] = n->moved[i][k] * morph_factorial[k];
    }
}
