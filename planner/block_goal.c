#include "planner/block_goal.h"

#include <stdio.h>

int morph_goal_rows_count(const morph_goal_rows *d) {
    return (d->mean ? 1 : 0) + d->samples + d->points;
}

int morph_goal_rows_slacks(const morph_goal_rows *d) {
    return (d->mean ? 1 : 0) + (d->samples ? 1 : 0) + d->points;
}

static int coordinates(const morph_goal_rows *d) {
    return 3 * d->gap.cavity->structure->joints;
}

/* Slack of a row. */
static int slack_of(const morph_goal_rows *d, int row) {
    const int first = coordinates(d), mean = d->mean ? 1 : 0;
    if (row < mean) return first;
    if (row < mean + d->samples) return first + mean;
    return first + mean + (d->samples ? 1 : 0) + (row - mean - d->samples);
}

static void sample_at(const morph_skin_sample *q, const double *x, double at[3]) {
    for (int k = 0; k < 3; k++) {
        at[k] = 0.0;
        for (int a = 0; a < 3; a++)
            at[k] += q->weight[a] * x[3 * q->joint[a] + k];
    }
}

/* s, s' and s'' of the rounded positive part. */
static double positive_part(double g, double round, double d[2]) {
    const double root = sqrt(g * g + round * round);
    d[0] = 0.5 * (1.0 + g / root);
    d[1] = 0.5 * round * round / (root * root * root);
    return 0.5 * (g + root);
}

static double share(const morph_goal_rows *d, int sample) {
    return d->gap.cavity->sample[sample].area / d->gap.cavity->start_area;
}

/* D: where a point of the target counts as covered. */
static double covered_at(const morph_goal_rows *d) {
    const morph_structure *s = d->gap.cavity->structure;
    return s->def.radius / s->spacing + d->limit[MORPH_GOAL_COVERAGE];
}

static void point_offset(const morph_goal_rows *d, int y, const double *x, double e[3]) {
    const morph_cavity *c = d->gap.cavity;
    for (int k = 0; k < 3; k++) {
        e[k] = -c->expose[y].point[k] / c->structure->spacing;
        for (int a = 0; a < 3; a++)
            e[k] += d->weight[y][a] * x[3 * d->joint[y][a] + k];
    }
}

static morph_status goal_value(void *data, const double *x, double *f) {
    const morph_goal_rows *d = data;
    const morph_cavity *c = d->gap.cavity;
    double at[3], unused[2];
    int row = 0;
    if (d->mean) {
        f[row] = d->mean_bias - x[slack_of(d, row)];
        for (int q = 0; q < c->samples; q++) {
            sample_at(&c->sample[q], x, at);
            f[row] += share(d, q) *
                      positive_part(morph_gap_at(&d->gap, at, NULL, NULL) + d->bias[q], d->round, unused);
        }
        row++;
    }
    for (int k = 0; k < d->samples; k++, row++) {
        sample_at(&c->sample[d->sample[k]], x, at);
        f[row] = morph_gap_at(&d->gap, at, NULL, NULL) + d->bias[d->sample[k]] - x[slack_of(d, row)];
    }
    for (int k = 0; k < d->points; k++, row++) {
        double e[3];
        point_offset(d, d->point[k], x, e);
        f[row] = morph_dot(e, e) / (2.0 * covered_at(d)) - x[slack_of(d, row)];
    }
    return MORPH_OK;
}

/* W^T H W of a point of three joints, weighted; H symmetric, packed xx xy xz yy yz zz. */
static void put_hessian(morph_sink *sink, const int joint[3], const double weight[3], const double h[6]) {
    static const int packed[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            for (int k = 0; k < 3; k++)
                for (int m = 0; m < 3; m++)
                    if (3 * joint[a] + k >= 3 * joint[b] + m)
                        morph_sink_hessian(sink, 3 * joint[a] + k, 3 * joint[b] + m,
                                           weight[a] * weight[b] * h[packed[k][m]]);
}

static void put_gradient(morph_sink *sink, int row, const int joint[3], const double weight[3],
                         const double g[3]) {
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++)
            morph_sink_jacobian(sink, row, 3 * joint[a] + k, weight[a] * g[k]);
}

/* A skin sample's part of a row: scale s(gap) with the rounded positive part, or scale gap without. Gradient
 * s' grad, Hessian s'' grad grad^T + s' hess; Gauss-Newton leaves hess out. */
static void walk_sample(const morph_goal_rows *d, int row, const double *x, int sample, bool rounded,
                        double scale, double weight, morph_sink *sink) {
    static const int first[6] = {0, 0, 0, 1, 1, 2}, second[6] = {0, 1, 2, 1, 2, 2};
    const morph_skin_sample *q = &d->gap.cavity->sample[sample];
    const bool wants = morph_sink_wants_hessian(sink), exact = wants && !d->gap.gauss_newton;
    double at[3], g[3], h[6] = {0.0}, s[2] = {1.0, 0.0};
    sample_at(q, x, at);
    const double gap = morph_gap_at(&d->gap, at, g, exact ? h : NULL) + d->bias[sample];
    if (rounded) positive_part(gap, d->round, s);
    if (wants) {
        for (int k = 0; k < 6; k++)
            h[k] = weight * scale * (s[0] * h[k] + s[1] * g[first[k]] * g[second[k]]);
        put_hessian(sink, q->joint, q->weight, h);
    }
    for (int k = 0; k < 3; k++)
        g[k] *= scale * s[0];
    if (morph_sink_wants_jacobian(sink)) put_gradient(sink, row, q->joint, q->weight, g);
}

/* |e|^2 / (2D): gradient e / D, Hessian I / D. */
static void walk_point(const morph_goal_rows *d, int row, const double *x, int y, double weight,
                       morph_sink *sink) {
    const double scale = 1.0 / covered_at(d);
    double e[3];
    point_offset(d, y, x, e);
    for (int k = 0; k < 3; k++)
        e[k] *= scale;
    if (morph_sink_wants_jacobian(sink)) put_gradient(sink, row, d->joint[y], d->weight[y], e);
    const double h[6] = {weight * scale, 0.0, 0.0, weight * scale, 0.0, weight * scale};
    if (morph_sink_wants_hessian(sink)) put_hessian(sink, d->joint[y], d->weight[y], h);
}

static morph_status goal_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_goal_rows *d = data;
    int row = 0;
    if (d->mean) {
        for (int q = 0; q < d->gap.cavity->samples; q++)
            walk_sample(d, row, x, q, true, share(d, q), weight[row], sink);
        row++;
    }
    for (int k = 0; k < d->samples; k++, row++)
        walk_sample(d, row, x, d->sample[k], false, 1.0, weight[row], sink);
    for (int k = 0; k < d->points; k++, row++)
        walk_point(d, row, x, d->point[k], weight[row], sink);
    for (int r = 0; r < row && morph_sink_wants_jacobian(sink); r++)
        morph_sink_jacobian(sink, r, slack_of(d, r), -1.0);
    return MORPH_OK;
}

static void goal_describe(void *data, int row, char *text, size_t size) {
    const morph_goal_rows *d = data;
    const int mean = d->mean ? 1 : 0;
    if (row < mean) {
        snprintf(text, size, "mean_gap");
    } else if (row < mean + d->samples) {
        const int q = d->sample[row - mean];
        const int *node = d->gap.cavity->structure->joint_node[d->gap.cavity->sample[q].joint[0]];
        snprintf(text, size, "max_gap of the skin at (%d,%d)", node[0], node[1]);
    } else {
        const double *y = d->gap.cavity->expose[d->point[row - mean - d->samples]].point;
        snprintf(text, size, "coverage of (%.4g, %.4g, %.4g)", y[0], y[1], y[2]);
    }
}

morph_block morph_block_goal(morph_goal_rows *data, const int *unknown, double *lower, double *upper) {
    const int rows = morph_goal_rows_count(data), mean = data->mean ? 1 : 0;
    for (int r = 0; r < rows; r++) {
        lower[r] = -INFINITY;
        upper[r] = r < mean                   ? data->limit[MORPH_GOAL_MEAN_GAP]
                   : r < mean + data->samples ? data->limit[MORPH_GOAL_MAX_GAP]
                                              : 0.5 * covered_at(data);
    }
    return (morph_block){.name = "goal",
                         .rows = rows,
                         .unknowns = coordinates(data) + morph_goal_rows_slacks(data),
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = goal_value,
                         .walk = goal_walk,
                         .describe = goal_describe};
}

static morph_status price_value(void *data, const double *x, double *f) {
    const morph_price_term *d = data;
    f[0] = 0.0;
    for (int k = 0; k < d->count; k++)
        f[0] += d->price[k] * x[d->first + k];
    return MORPH_OK;
}

static morph_status price_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_price_term *d = data;
    (void)x;
    (void)weight;
    for (int k = 0; k < d->count && morph_sink_wants_jacobian(sink); k++)
        morph_sink_jacobian(sink, 0, d->first + k, d->price[k]);
    return MORPH_OK;
}

morph_block morph_block_price(morph_price_term *data, const int *unknown) {
    return (morph_block){.name = "price of missing the goal",
                         .unknowns = data->unknowns,
                         .unknown = unknown,
                         .data = data,
                         .value = price_value,
                         .walk = price_walk};
}
