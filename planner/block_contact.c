/* Rows that keep things apart: points of the structure from the target, axes from each other. */
#include "planner/blocks.h"

#include <stdio.h>

void morph_point_at(const morph_point *p, const double *x, double out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = 0.0;
        for (int a = 0; a < 3; a++)
            out[k] += p->weight[a] * x[3 * p->joint[a] + k];
    }
}

void morph_point_name(const morph_structure *s, const morph_point *p, char *text, size_t size) {
    if (p->link >= 0) {
        morph_link_name(s, p->link, text, size);
        return;
    }
    for (int a = 0; a < 3; a++)
        if (p->weight[a] == 1.0) {
            morph_joint_name(s, p->joint[a], text, size);
            return;
        }
    const int *n = s->joint_node[p->joint[0]];
    snprintf(text, size, "skin at (%d,%d)", n[0], n[1]);
}

static double clearance(const morph_clearance_rows *d, const morph_point *p, const double *x, double *g,
                        double *h) {
    const double a = d->structure->spacing;
    double at[3];
    morph_point_at(p, x, at);
    at[2] -= d->lift;
    for (int k = 0; k < 3; k++)
        at[k] *= a;
    return morph_sdf_eval(d->sdf, at, g, h) / a + p->bias;
}

static morph_status clearance_value(void *data, const double *x, double *f) {
    const morph_clearance_rows *d = data;
    for (int r = 0; r < d->count; r++)
        f[r] = clearance(d, &d->point[r], x, NULL, NULL);
    return MORPH_OK;
}

/* phi(W x): gradient W^T grad, Hessian W^T hess W. In spacings the gradient keeps its value and the Hessian
 * grows by the spacing. */
static morph_status clearance_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_clearance_rows *d = data;
    static const int packed[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    const bool second = morph_sink_wants_hessian(sink);
    for (int r = 0; r < d->count; r++) {
        const morph_point *p = &d->point[r];
        double g[3], h[6];
        clearance(d, p, x, g, second ? h : NULL);
        if (morph_sink_wants_jacobian(sink))
            for (int a = 0; a < 3; a++)
                for (int k = 0; k < 3; k++)
                    morph_sink_jacobian(sink, r, 3 * p->joint[a] + k, p->weight[a] * g[k]);
        for (int a = 0; second && a < 3; a++)
            for (int b = 0; b < 3; b++)
                for (int k = 0; k < 3; k++)
                    for (int m = 0; m < 3; m++)
                        if (3 * p->joint[a] + k >= 3 * p->joint[b] + m)
                            morph_sink_hessian(sink, 3 * p->joint[a] + k, 3 * p->joint[b] + m,
                                               weight[r] * d->structure->spacing * p->weight[a] *
                                                   p->weight[b] * h[packed[k][m]]);
    }
    return MORPH_OK;
}

static void clearance_describe(void *data, int row, char *text, size_t size) {
    const morph_clearance_rows *d = data;
    morph_point_name(d->structure, &d->point[row], text, size);
}

morph_block morph_block_clearance(morph_clearance_rows *data, const int *unknown, double *lower,
                                  double *upper) {
    for (int r = 0; r < data->count; r++) {
        lower[r] = data->structure->def.radius / data->structure->spacing + data->margin;
        upper[r] = INFINITY;
    }
    return (morph_block){.name = "clearance",
                         .rows = data->count,
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = clearance_value,
                         .walk = clearance_walk,
                         .describe = clearance_describe};
}

static morph_status separation_value(void *data, const double *x, double *f) {
    const morph_separation_rows *rows = data;
    for (int r = 0; r < rows->count; r++) {
        const morph_pair *p = &rows->pair[r];
        f[r] = morph_dot(p->normal, &x[3 * p->joint[0]]) - morph_dot(p->normal, &x[3 * p->joint[1]]);
    }
    return MORPH_OK;
}

/* Linear: no second derivatives. */
static morph_status separation_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_separation_rows *rows = data;
    (void)x;
    (void)weight;
    for (int r = 0; r < rows->count && morph_sink_wants_jacobian(sink); r++) {
        const morph_pair *p = &rows->pair[r];
        for (int k = 0; k < 3; k++) {
            morph_sink_jacobian(sink, r, 3 * p->joint[0] + k, p->normal[k]);
            morph_sink_jacobian(sink, r, 3 * p->joint[1] + k, -p->normal[k]);
        }
    }
    return MORPH_OK;
}

void morph_axis_name(const morph_structure *s, int axis, char *text, size_t size) {
    if (axis < s->links)
        morph_link_name(s, axis, text, size);
    else
        morph_post_name(s, axis - s->links, text, size);
}

static void separation_describe(void *data, int row, char *text, size_t size) {
    const morph_separation_rows *d = data;
    char a[64], b[64];
    morph_axis_name(d->structure, d->pair[row].axis[0], a, sizeof a);
    morph_axis_name(d->structure, d->pair[row].axis[1], b, sizeof b);
    snprintf(text, size, "%s / %s", a, b);
}

morph_block morph_block_separation(morph_separation_rows *data, const int *unknown, double *lower,
                                   double *upper) {
    for (int r = 0; r < data->count; r++) {
        lower[r] = data->pair[r].distance + data->margin;
        upper[r] = INFINITY;
    }
    return (morph_block){.name = "self clearance",
                         .rows = data->count,
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = separation_value,
                         .walk = separation_walk,
                         .describe = separation_describe};
}
