/* Plane side panels as rows v = s det[p, q, d] of three joint differences: the posts p = top - foot and q,
 * and d from the first foot to the second; s = 1/(h_p h_q). The determinant is linear in each of them: dv/dp
 * = s q x d,   dv/dq = s d x p,   dv/dd = s p x q, d2v/dp_i dq_j = s e_ijk d_k,   d2v/dq_i dd_j = s e_ijk
 * p_k,   d2v/dd_i dp_j = s e_ijk q_k, with e the sign of the permutation; second derivatives by one vector
 * twice are zero. */
#include "planner/blocks.h"

#include <stdio.h>

/* First and last joint of p, q and d. */
typedef struct sides {
    int from[3], to[3];
    double v[3][3];
    double scale;
} sides;

static sides sides_at(const morph_structure *s, int panel, const double *x) {
    const int a = s->panel[panel][0], b = s->panel[panel][1], *p = s->post[a], *q = s->post[b];
    sides out = {.from = {p[0], q[0], p[0]}, .to = {p[1], q[1], q[0]}};
    for (int k = 0; k < 3; k++)
        morph_sub(&x[3 * out.to[k]], &x[3 * out.from[k]], out.v[k]);
    out.scale = s->spacing * s->spacing / (s->post_length[a] * s->post_length[b]);
    return out;
}

static double volume(const sides *o) {
    double c[3];
    morph_cross(o->v[0], o->v[1], c);
    return morph_dot(c, o->v[2]);
}

double morph_panel_sine(const morph_structure *s, int panel, const double *x) {
    const sides o = sides_at(s, panel, x);
    const double size = morph_norm(o.v[0]) * morph_norm(o.v[1]) * morph_norm(o.v[2]);
    return size > 0.0 ? volume(&o) / size : 0.0;
}

void morph_panel_name(const morph_structure *s, int panel, char *text, size_t size) {
    char a[48], b[48];
    morph_post_name(s, s->panel[panel][0], a, sizeof a);
    morph_post_name(s, s->panel[panel][1], b, sizeof b);
    snprintf(text, size, "%s / %s", a, b);
}

static bool panel_held(const morph_structure *s, int panel) {
    return s->fixed_joints > 0 && s->joint_fixed[s->post[s->panel[panel][0]][0]] &&
           s->joint_fixed[s->post[s->panel[panel][1]][0]];
}

int morph_panel_row_count(const morph_structure *s) {
    int rows = 0;
    for (int q = 0; q < s->panels; q++)
        rows += !panel_held(s, q);
    return rows;
}

static morph_status panels_value(void *data, const double *x, double *f) {
    const morph_structure *s = ((const morph_panel_rows *)data)->structure;
    for (int q = 0; q < s->panels; q++) {
        if (panel_held(s, q)) continue;
        const sides o = sides_at(s, q, x);
        *f++ = o.scale * volume(&o);
    }
    return MORPH_OK;
}

/* Each vector's derivative goes to its last joint and, negative, to its first. */
static void put_gradient(morph_sink *sink, int row, const sides *o) {
    for (int a = 0; a < 3; a++) {
        double g[3];
        morph_cross(o->v[(a + 1) % 3], o->v[(a + 2) % 3], g);
        for (int k = 0; k < 3; k++) {
            morph_sink_jacobian(sink, row, 3 * o->to[a] + k, o->scale * g[k]);
            morph_sink_jacobian(sink, row, 3 * o->from[a] + k, -o->scale * g[k]);
        }
    }
}

/* One vector's coordinate i, another's j, which differ: each is the difference of two joints, so four pairs
 * of unknowns, none of them one unknown with itself. */
static void put_entry(morph_sink *sink, const sides *o, int a, int i, int b, int j, double value) {
    const int u[2] = {3 * o->from[a] + i, 3 * o->to[a] + i}, w[2] = {3 * o->from[b] + j, 3 * o->to[b] + j};
    for (int m = 0; m < 2; m++)
        for (int n = 0; n < 2; n++)
            morph_sink_hessian(sink, u[m], w[n], m == n ? value : -value);
}

static void put_hessian(morph_sink *sink, const sides *o, double weight) {
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3; /* e_ijk = 1, e_ikj = -1 */
            put_entry(sink, o, a, i, b, j, weight * o->scale * o->v[c][k]);
            put_entry(sink, o, a, i, b, k, -weight * o->scale * o->v[c][j]);
        }
    }
}

static morph_status panels_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_structure *s = ((const morph_panel_rows *)data)->structure;
    for (int q = 0, row = 0; q < s->panels; q++) {
        if (panel_held(s, q)) continue;
        const sides o = sides_at(s, q, x);
        if (morph_sink_wants_jacobian(sink)) put_gradient(sink, row, &o);
        if (morph_sink_wants_hessian(sink)) put_hessian(sink, &o, weight[row]);
        row++;
    }
    return MORPH_OK;
}

static void panels_describe(void *data, int row, char *text, size_t size) {
    const morph_structure *s = ((const morph_panel_rows *)data)->structure;
    for (int q = 0; q < s->panels; q++)
        if (!panel_held(s, q) && row-- == 0) morph_panel_name(s, q, text, size);
}

morph_block morph_block_panels(morph_panel_rows *data, const int *unknown, double *lower, double *upper) {
    const int rows = morph_panel_row_count(data->structure);
    for (int r = 0; r < rows; r++)
        lower[r] = upper[r] = 0.0;
    return (morph_block){.name = "panel",
                         .rows = rows,
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = panels_value,
                         .walk = panels_walk,
                         .describe = panels_describe};
}
