/* Rows and terms of single members: posts, link lengths, stretch towards given lengths. All are quadratics
 * (or squares of them) in the end joints. */
#include "planner/blocks.h"

#include <stdio.h>

static double squared(const double *x, const int ends[2]) {
    double d[3];
    morph_sub(&x[3 * ends[1]], &x[3 * ends[0]], d);
    return morph_dot(d, d);
}

/* d|d|^2 by the ends is -+2d. */
static void put_squared_gradient(morph_sink *s, int row, const double *x, const int ends[2], double scale) {
    for (int k = 0; k < 3; k++) {
        const double g = 2.0 * scale * (x[3 * ends[1] + k] - x[3 * ends[0] + k]);
        morph_sink_jacobian(s, row, 3 * ends[1] + k, g);
        morph_sink_jacobian(s, row, 3 * ends[0] + k, -g);
    }
}

/* Hessian of |d|^2: 2I on each end, -2I between them. */
static void put_squared_hessian(morph_sink *s, const int ends[2], double scale) {
    for (int k = 0; k < 3; k++) {
        morph_sink_hessian(s, 3 * ends[1] + k, 3 * ends[1] + k, 2.0 * scale);
        morph_sink_hessian(s, 3 * ends[0] + k, 3 * ends[0] + k, 2.0 * scale);
        morph_sink_hessian(s, 3 * ends[1] + k, 3 * ends[0] + k, -2.0 * scale);
    }
}

static double post_scale(const morph_structure *s, int post) {
    const double h = s->post_length[post] / s->spacing;
    return 1.0 / (h * h);
}

/* A post that is held has no row. */
static bool post_held(const morph_structure *s, int post) {
    return s->fixed_joints > 0 && s->joint_fixed[s->post[post][0]] && s->joint_fixed[s->post[post][1]];
}

int morph_post_row_count(const morph_structure *s) {
    int rows = 0;
    for (int p = 0; p < s->posts; p++)
        rows += !post_held(s, p);
    return rows;
}

static morph_status posts_value(void *data, const double *x, double *f) {
    const morph_structure *s = ((const morph_post_rows *)data)->structure;
    for (int p = 0; p < s->posts; p++)
        if (!post_held(s, p)) *f++ = post_scale(s, p) * squared(x, s->post[p]);
    return MORPH_OK;
}

static morph_status posts_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_structure *s = ((const morph_post_rows *)data)->structure;
    for (int p = 0, row = 0; p < s->posts; p++) {
        if (post_held(s, p)) continue;
        if (morph_sink_wants_jacobian(sink)) put_squared_gradient(sink, row, x, s->post[p], post_scale(s, p));
        if (morph_sink_wants_hessian(sink))
            put_squared_hessian(sink, s->post[p], weight[row] * post_scale(s, p));
        row++;
    }
    return MORPH_OK;
}

static void posts_describe(void *data, int row, char *text, size_t size) {
    const morph_structure *s = ((const morph_post_rows *)data)->structure;
    for (int p = 0; p < s->posts; p++)
        if (!post_held(s, p) && row-- == 0) morph_post_name(s, p, text, size);
}

morph_block morph_block_posts(morph_post_rows *data, const int *unknown, double *lower, double *upper) {
    const morph_structure *s = data->structure;
    const int rows = morph_post_row_count(s);
    for (int r = 0; r < rows; r++)
        lower[r] = upper[r] = 1.0;
    return (morph_block){.name = "post length",
                         .rows = rows,
                         .unknowns = 3 * s->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = posts_value,
                         .walk = posts_walk,
                         .describe = posts_describe};
}

static morph_status lengths_value(void *data, const double *x, double *f) {
    const morph_length_rows *d = data;
    for (int r = 0; r < d->count; r++)
        f[r] = squared(x, d->structure->link[d->link[r]]);
    return MORPH_OK;
}

static morph_status lengths_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_length_rows *d = data;
    for (int r = 0; r < d->count; r++) {
        const int *ends = d->structure->link[d->link[r]];
        if (morph_sink_wants_jacobian(sink)) put_squared_gradient(sink, r, x, ends, 1.0);
        if (morph_sink_wants_hessian(sink)) put_squared_hessian(sink, ends, weight[r]);
    }
    return MORPH_OK;
}

static void lengths_describe(void *data, int row, char *text, size_t size) {
    const morph_length_rows *d = data;
    morph_link_name(d->structure, d->link[row], text, size);
}

morph_block morph_block_lengths(morph_length_rows *data, const int *unknown, double *lower, double *upper) {
    const morph_structure *s = data->structure;
    for (int r = 0; r < data->count; r++) {
        const double *limit = s->length_limit[data->link[r]];
        double lo = limit[0] / s->spacing + data->margin, hi = limit[1] / s->spacing - data->margin;
        if (lo > hi) /* limits closer than two margins: hold the middle */
            lo = hi = 0.5 * (lo + hi);
        lower[r] = lo * lo;
        upper[r] = hi * hi;
    }
    return (morph_block){.name = "length",
                         .rows = data->count,
                         .unknowns = 3 * s->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = lengths_value,
                         .walk = lengths_walk,
                         .describe = lengths_describe};
}

/* (q - t)^2 / 4 with q = |d|^2, t = target^2: gradient (q - t)/2 * grad q; Hessian (q - t)/2 * hess q + grad
 * q grad q^T / 2. */
static morph_status stretch_value(void *data, const double *x, double *f) {
    const morph_stretch_term *d = data;
    f[0] = 0.0;
    for (int l = 0; l < d->structure->links; l++) {
        const double e = squared(x, d->structure->link[l]) - d->target[l] * d->target[l];
        f[0] += 0.25 * d->scale * e * e;
    }
    return MORPH_OK;
}

static void stretch_hessian(morph_sink *sink, const double *x, const int ends[2], double e, double w) {
    double d[3];
    morph_sub(&x[3 * ends[1]], &x[3 * ends[0]], d);
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++) {
            const double h = w * (2.0 * d[k] * d[m] + (k == m ? e : 0.0));
            if (m <= k) {
                morph_sink_hessian(sink, 3 * ends[0] + k, 3 * ends[0] + m, h);
                morph_sink_hessian(sink, 3 * ends[1] + k, 3 * ends[1] + m, h);
            }
            morph_sink_hessian(sink, 3 * ends[1] + k, 3 * ends[0] + m, -h);
        }
}

static morph_status stretch_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_stretch_term *d = data;
    for (int l = 0; l < d->structure->links; l++) {
        const int *ends = d->structure->link[l];
        const double e = squared(x, ends) - d->target[l] * d->target[l];
        if (morph_sink_wants_jacobian(sink)) put_squared_gradient(sink, 0, x, ends, 0.5 * d->scale * e);
        if (morph_sink_wants_hessian(sink)) stretch_hessian(sink, x, ends, e, weight[0] * d->scale);
    }
    return MORPH_OK;
}

morph_block morph_block_stretch(morph_stretch_term *data, const int *unknown) {
    return (morph_block){.name = "stretch",
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .data = data,
                         .value = stretch_value,
                         .walk = stretch_walk};
}

static morph_status near_value(void *data, const double *x, double *f) {
    const morph_near_term *d = data;
    f[0] = 0.0;
    for (int i = 0; i < d->coordinates; i++)
        f[0] += d->scale * (x[i] - d->reference[i]) * (x[i] - d->reference[i]);
    return MORPH_OK;
}

static morph_status near_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_near_term *d = data;
    for (int i = 0; i < d->coordinates; i++) {
        if (morph_sink_wants_jacobian(sink))
            morph_sink_jacobian(sink, 0, i, 2.0 * d->scale * (x[i] - d->reference[i]));
        if (morph_sink_wants_hessian(sink)) morph_sink_hessian(sink, i, i, 2.0 * d->scale * weight[0]);
    }
    return MORPH_OK;
}

morph_block morph_block_near(morph_near_term *data, const int *unknown) {
    return (morph_block){.name = "nearness",
                         .unknowns = data->coordinates,
                         .unknown = unknown,
                         .data = data,
                         .value = near_value,
                         .walk = near_walk};
}
