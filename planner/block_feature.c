/* Rows that keep a sharp feature of the target on its side of an element: a point y of the target below the
 * plane of a skin triangle (a, b, c), or an edge of the target through y along e below a link (a, b). Both
 * are the signed distance f = (u x v).(a - y) / |u x v|,   u = b - a,  v = c - a or v = e exact also while
 * the feature slides along the element, where a row at a fixed point of the element would lose it. */
#include "planner/blocks.h"

#include <stdio.h>
#include <string.h>

/* Value, gradient and Hessian (lower triangle) by the element's nine coordinates. */
enum { VARIABLES = 9 };
typedef struct dual {
    double v, g[VARIABLES], h[VARIABLES][VARIABLES];
} dual;

static void set_constant(dual *a, double v) {
    memset(a, 0, sizeof *a);
    a->v = v;
}

/* out += s * a * b; out must not alias. */
static void add_product(dual *out, double s, const dual *a, const dual *b) {
    out->v += s * a->v * b->v;
    for (int i = 0; i < VARIABLES; i++) {
        out->g[i] += s * (a->v * b->g[i] + b->v * a->g[i]);
        for (int j = 0; j <= i; j++)
            out->h[i][j] +=
                s * (a->v * b->h[i][j] + b->v * a->h[i][j] + a->g[i] * b->g[j] + b->g[i] * a->g[j]);
    }
}

/* out = q(a) given q and its first and second derivatives at a. */
static void apply(dual *out, const dual *a, double q, double q1, double q2) {
    out->v = q;
    for (int i = 0; i < VARIABLES; i++) {
        out->g[i] = q1 * a->g[i];
        for (int j = 0; j <= i; j++)
            out->h[i][j] = q1 * a->h[i][j] + q2 * a->g[i] * a->g[j];
    }
}

/* Difference of coordinate k of two of the three points (from < 0: of a constant). */
static void set_difference(dual *d, const double p[3][3], int to, int from, double constant, int k) {
    set_constant(d, p[to][k] - (from < 0 ? constant : p[from][k]));
    d->g[3 * to + k] += 1.0;
    if (from >= 0) d->g[3 * from + k] -= 1.0;
}

static void feature_dual(const morph_feature *f, const double *x, dual *out) {
    double p[3][3];
    for (int i = 0; i < 3; i++)
        memcpy(p[i], &x[3 * f->joint[i]], sizeof p[i]);
    dual u[3], v[3], w[3], normal[3], square, top, inverse;
    for (int k = 0; k < 3; k++) {
        set_difference(&u[k], (const double(*)[3])p, 1, 0, 0.0, k);
        set_difference(&w[k], (const double(*)[3])p, 0, -1, f->point[k], k);
        if (f->is_edge)
            set_constant(&v[k], f->edge[k]);
        else
            set_difference(&v[k], (const double(*)[3])p, 2, 0, 0.0, k);
    }
    set_constant(&square, 0.0);
    set_constant(&top, 0.0);
    for (int k = 0; k < 3; k++) {
        set_constant(&normal[k], 0.0);
        add_product(&normal[k], 1.0, &u[(k + 1) % 3], &v[(k + 2) % 3]);
        add_product(&normal[k], -1.0, &u[(k + 2) % 3], &v[(k + 1) % 3]);
        add_product(&square, 1.0, &normal[k], &normal[k]);
        add_product(&top, f->sign, &normal[k], &w[k]);
    }
    /* 1 / sqrt(q): derivatives -q^-3/2 / 2 and 3 q^-5/2 / 4. */
    const double q = sqrt(square.v);
    apply(&inverse, &square, 1.0 / q, -0.5 / (q * square.v), 0.75 / (q * square.v * square.v));
    set_constant(out, 0.0);
    add_product(out, 1.0, &top, &inverse);
}

double morph_feature_at(const morph_feature *f, const double *x) {
    double u[3], v[3], w[3], n[3];
    const double *a = &x[3 * f->joint[0]];
    morph_sub(&x[3 * f->joint[1]], a, u);
    if (f->is_edge)
        memcpy(v, f->edge, sizeof v);
    else
        morph_sub(&x[3 * f->joint[2]], a, v);
    morph_sub(a, f->point, w);
    morph_cross(u, v, n);
    return f->sign * morph_dot(n, w) / morph_norm(n);
}

static morph_status features_value(void *data, const double *x, double *f) {
    const morph_feature_rows *d = data;
    for (int r = 0; r < d->count; r++)
        f[r] = morph_feature_at(&d->feature[r], x);
    return MORPH_OK;
}

static morph_status features_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_feature_rows *d = data;
    for (int r = 0; r < d->count; r++) {
        const morph_feature *f = &d->feature[r];
        const int used = f->is_edge ? 6 : 9;
        dual value;
        feature_dual(f, x, &value);
        for (int i = 0; i < used; i++) {
            const int gi = 3 * f->joint[i / 3] + i % 3;
            if (morph_sink_wants_jacobian(sink)) morph_sink_jacobian(sink, r, gi, value.g[i]);
            for (int j = 0; j <= i && morph_sink_wants_hessian(sink); j++)
                morph_sink_hessian(sink, gi, 3 * f->joint[j / 3] + j % 3, weight[r] * value.h[i][j]);
        }
    }
    return MORPH_OK;
}

static void features_describe(void *data, int row, char *text, size_t size) {
    const morph_feature_rows *d = data;
    const morph_feature *f = &d->feature[row];
    const int *a = d->structure->joint_node[f->joint[0]], *b = d->structure->joint_node[f->joint[1]];
    snprintf(text, size, "%s (%d,%d)-(%d,%d)", f->is_edge ? "link" : "skin triangle", a[0], a[1], b[0], b[1]);
}

morph_block morph_block_features(morph_feature_rows *data, const int *unknown, double *lower, double *upper) {
    for (int r = 0; r < data->count; r++) {
        lower[r] = data->structure->def.radius / data->structure->spacing + data->margin;
        upper[r] = INFINITY;
    }
    return (morph_block){.name = "clearance of features",
                         .rows = data->count,
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = features_value,
                         .walk = features_walk,
                         .describe = features_describe};
}
