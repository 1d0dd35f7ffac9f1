/* Blocks of a path as one problem: smoothness over poses, lengths as unknowns, and motion limits over unknown
 * durations. For bench_formulations.c only.
 *
 * Unknowns: (intervals + 1) poses of 3*joints coordinates in spacings, then, if lengths are unknowns, as many
 * times all links in spacings, then, if durations are, one per interval (or one for all) in units of `unit`
 * seconds. The first and the last pose are fixed by their bounds. */
#ifndef MORPH_BENCH_FORMULATION_BLOCKS_H
#define MORPH_BENCH_FORMULATION_BLOCKS_H

#include "planner/blocks.h"

#include <stdio.h>
#include <string.h>

typedef struct form_layout {
    const morph_structure *structure;
    int intervals;
    bool lengths, durations;
    bool even;   /* one duration for all intervals */
    double unit; /* s */
} form_layout;

static int form_width(const form_layout *l) {
    return 3 * l->structure->joints;
}
static int form_length_at(const form_layout *l, int pose) {
    return (l->intervals + 1) * form_width(l) + pose * l->structure->links;
}
static int form_duration_at(const form_layout *l) {
    return form_length_at(l, l->lengths ? l->intervals + 1 : 0);
}
static int form_durations(const form_layout *l) {
    return !l->durations ? 0 : l->even ? 1 : l->intervals;
}
static int form_unknowns(const form_layout *l) {
    return form_duration_at(l) + form_durations(l);
}
/* The unknown of an interval's duration; beyond the ends the end's. */
static int form_duration_of(const form_layout *l, int k) {
    const int last = form_durations(l) - 1;
    return form_duration_at(l) + (k < 0 ? 0 : k > last ? last : k);
}

/* Objective: weight * sum |x_{k-1} - 2 x_k + x_{k+1}|^2 over inner poses. */
typedef struct form_smooth {
    const form_layout *layout;
    double weight;
} form_smooth;

static const double form_second[3] = {1.0, -2.0, 1.0};

static double form_bend(const form_layout *l, const double *x, int pose, int i) {
    double sum = 0.0;
    for (int m = 0; m < 3; m++)
        sum += form_second[m] * x[(pose - 1 + m) * form_width(l) + i];
    return sum;
}

static morph_status form_smooth_value(void *data, const double *x, double *f) {
    const form_smooth *d = data;
    f[0] = 0.0;
    for (int k = 1; k < d->layout->intervals; k++)
        for (int i = 0; i < form_width(d->layout); i++) {
            const double b = form_bend(d->layout, x, k, i);
            f[0] += d->weight * b * b;
        }
    return MORPH_OK;
}

static morph_status form_smooth_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const form_smooth *d = data;
    const int width = form_width(d->layout);
    for (int k = 1; k < d->layout->intervals; k++)
        for (int i = 0; i < width; i++) {
            const double b = form_bend(d->layout, x, k, i);
            for (int m = 0; m < 3; m++) {
                const int u = (k - 1 + m) * width + i;
                if (morph_sink_wants_jacobian(sink))
                    morph_sink_jacobian(sink, 0, u, 2.0 * d->weight * form_second[m] * b);
                for (int n = 0; n <= m && morph_sink_wants_hessian(sink); n++)
                    morph_sink_hessian(sink, u, (k - 1 + n) * width + i,
                                       2.0 * weight[0] * d->weight * form_second[m] * form_second[n]);
            }
        }
    return MORPH_OK;
}

static morph_block form_block_smooth(form_smooth *data) {
    return (morph_block){.name = "smoothness",
                         .unknowns = (data->layout->intervals + 1) * form_width(data->layout),
                         .data = data,
                         .value = form_smooth_value,
                         .walk = form_smooth_walk};
}

/* |x_j - x_i|^2 - l^2 = 0 of every link of one pose. Local unknowns: the pose, then its lengths. lower and
 * upper hold links zeros. */
static morph_status form_links_value(void *data, const double *x, double *f) {
    const morph_structure *s = data;
    for (int l = 0; l < s->links; l++) {
        double d[3];
        morph_sub(&x[3 * s->link[l][1]], &x[3 * s->link[l][0]], d);
        f[l] = morph_dot(d, d) - x[3 * s->joints + l] * x[3 * s->joints + l];
    }
    return MORPH_OK;
}

static morph_status form_links_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_structure *s = data;
    for (int l = 0; l < s->links; l++) {
        const int i = 3 * s->link[l][0], j = 3 * s->link[l][1], u = 3 * s->joints + l;
        if (morph_sink_wants_jacobian(sink)) {
            for (int k = 0; k < 3; k++) {
                const double d = x[j + k] - x[i + k];
                morph_sink_jacobian(sink, l, j + k, 2.0 * d);
                morph_sink_jacobian(sink, l, i + k, -2.0 * d);
            }
            morph_sink_jacobian(sink, l, u, -2.0 * x[u]);
        }
        if (!morph_sink_wants_hessian(sink)) continue;
        for (int k = 0; k < 3; k++) {
            morph_sink_hessian(sink, j + k, j + k, 2.0 * weight[l]);
            morph_sink_hessian(sink, i + k, i + k, 2.0 * weight[l]);
            morph_sink_hessian(sink, j + k, i + k, -2.0 * weight[l]);
        }
        morph_sink_hessian(sink, u, u, -2.0 * weight[l]);
    }
    return MORPH_OK;
}

static void form_links_describe(void *data, int row, char *text, size_t size) {
    morph_link_name(data, row, text, size);
}

static morph_block form_block_links(const morph_structure *s, const int *unknown, const double *zeros) {
    return (morph_block){.name = "length of",
                         .rows = s->links,
                         .unknowns = 3 * s->joints + s->links,
                         .unknown = unknown,
                         .lower = zeros,
                         .upper = zeros,
                         .data = (void *)s,
                         .value = form_links_value,
                         .walk = form_links_walk,
                         .describe = form_links_describe};
}

/* Objective: weight * mean duration. */
typedef struct form_time {
    const form_layout *layout;
    double weight;
} form_time;

static morph_status form_time_value(void *data, const double *x, double *f) {
    const form_time *d = data;
    f[0] = 0.0;
    for (int k = 0; k < form_durations(d->layout); k++)
        f[0] += d->weight / form_durations(d->layout) * x[form_duration_of(d->layout, k)];
    return MORPH_OK;
}

static morph_status form_time_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const form_time *d = data;
    (void)x;
    (void)weight;
    for (int k = 0; k < form_durations(d->layout) && morph_sink_wants_jacobian(sink); k++)
        morph_sink_jacobian(sink, 0, form_duration_of(d->layout, k), d->weight / form_durations(d->layout));
    return MORPH_OK;
}

static morph_block form_block_time(form_time *data) {
    return (morph_block){.name = "time",
                         .unknowns = form_unknowns(data->layout),
                         .data = data,
                         .value = form_time_value,
                         .walk = form_time_walk};
}

/* Motion limits by finite differences of lengths L over durations h, each over its limit, so within -1 .. 1:
 *     r_k = (L_{k+1} - L_k) / h_k                              rate, intervals rows a link
 *     a_k = 2 (r_k - r_{k-1}) / (h_{k-1} + h_k)                acceleration at poses, intervals + 1
 *     j_k = (a_{k+1} - a_k) / h_k                              jerk, intervals + 2
 * At rest before and after: indices beyond the ends stand for the end, whose interval repeats. A row needs
 * L at 2, 3 or 4 poses on end and h of 1, 2 or 3 intervals: its variables, lengths first. */
enum { FORM_MOST = 7, FORM_SLOTS = 27 };

/* A value with its first two derivatives by n variables. */
typedef struct form_jet {
    int n;
    double v, g[FORM_MOST], h[FORM_MOST][FORM_MOST];
} form_jet;

static form_jet form_variable(double v, int which, int n) {
    form_jet a = {.n = n, .v = v};
    if (n > 0) a.g[which] = 1.0;
    return a;
}

/* p a + q b */
static form_jet form_combine(double p, const form_jet *a, double q, const form_jet *b) {
    form_jet c = {.n = a->n, .v = p * a->v + q * b->v};
    for (int i = 0; i < c.n; i++) {
        c.g[i] = p * a->g[i] + q * b->g[i];
        for (int j = 0; j < c.n; j++)
            c.h[i][j] = p * a->h[i][j] + q * b->h[i][j];
    }
    return c;
}

/* c = a / b: from a = c b, a' = c' b + c b', a'' = c'' b + c' b' + b' c' + c b''. */
static form_jet form_divide(const form_jet *a, const form_jet *b) {
    form_jet c = {.n = a->n, .v = a->v / b->v};
    for (int i = 0; i < c.n; i++)
        c.g[i] = (a->g[i] - c.v * b->g[i]) / b->v;
    for (int i = 0; i < c.n; i++)
        for (int j = 0; j < c.n; j++)
            c.h[i][j] = (a->h[i][j] - c.g[i] * b->g[j] - b->g[i] * c.g[j] - c.v * b->h[i][j]) / b->v;
    return c;
}

/* order 1, 2, 3: rate, acceleration, jerk from order + 1 lengths L and order durations h. */
static form_jet form_difference(int order, const form_jet *L, const form_jet *h) {
    if (order == 1) {
        const form_jet d = form_combine(1.0, &L[1], -1.0, &L[0]);
        return form_divide(&d, &h[0]);
    }
    const form_jet before = form_difference(order - 1, L, h),
                   after = form_difference(order - 1, L + 1, h + 1);
    const form_jet d = form_combine(1.0, &after, -1.0, &before);
    if (order == 3) return form_divide(&d, &h[1]);
    const form_jet middle = form_combine(0.5, &h[0], 0.5, &h[1]);
    return form_divide(&d, &middle);
}

typedef struct form_row {
    int order, link, first; /* first pose of its window; may lie beyond an end */
    double scale;           /* 1 over the limit */
} form_row;

static int form_motion_rows(const form_layout *l) {
    return 3 * (l->intervals + 1) * l->structure->links;
}

/* Rows: link by link, rates, then accelerations, then jerks. */
static form_row form_row_of(const form_layout *l, int row) {
    const morph_structure *s = l->structure;
    const int each = 3 * (l->intervals + 1), link = row / each, k = row % each, K = l->intervals;
    const double a = s->spacing, u = l->unit;
    if (k < K) return (form_row){1, link, k, a / (s->rate_limit[link] * u)};
    if (k < 2 * K + 1) return (form_row){2, link, k - K - 1, a / (s->acceleration_limit[link] * u * u)};
    return (form_row){3, link, k - 2 * K - 1 - 2, a / (s->jerk_limit[link] * u * u * u)};
}

static int form_clamp(int k, int last) {
    return k < 0 ? 0 : k > last ? last : k;
}

static double form_length(const form_layout *l, const double *x, int pose, int link) {
    const int *ends = l->structure->link[link];
    if (l->lengths) return x[form_length_at(l, pose) + link];
    const double *at = &x[pose * form_width(l)];
    return morph_dist(&at[3 * ends[0]], &at[3 * ends[1]]);
}

/* The row at x; derivatives by its own variables if wanted. */
static form_jet form_row_jet(const form_layout *l, const form_row *r, const double *x, bool derivatives) {
    form_jet L[4], h[3];
    const int n = derivatives ? 2 * r->order + 1 : 0;
    for (int m = 0; m <= r->order; m++)
        L[m] = form_variable(form_length(l, x, form_clamp(r->first + m, l->intervals), r->link), m, n);
    for (int m = 0; m < r->order; m++)
        h[m] = form_variable(x[form_duration_of(l, r->first + m)], r->order + 1 + m, n);
    const form_jet f = form_difference(r->order, L, h);
    return form_combine(r->scale, &f, 0.0, &f);
}

/* The rows in use. */
typedef struct form_motion {
    const form_layout *layout;
    int count;
    const int *row;
} form_motion;

static morph_status form_motion_value(void *data, const double *x, double *f) {
    const form_motion *d = data;
    for (int k = 0; k < d->count; k++) {
        const form_row r = form_row_of(d->layout, d->row[k]);
        f[k] = form_row_jet(d->layout, &r, x, false).v;
    }
    return MORPH_OK;
}

/* The unknowns behind a row's variables: one of a length or duration, six of a length from joints. */
typedef struct form_slots {
    int count;
    int unknown[FORM_SLOTS], variable[FORM_SLOTS];
    double slope[FORM_SLOTS]; /* of the variable by the unknown */
    double d[4][3], length[4];
} form_slots;

static void form_put_slot(form_slots *s, int unknown, int variable, double slope) {
    s->unknown[s->count] = unknown;
    s->variable[s->count] = variable;
    s->slope[s->count++] = slope;
}

static void form_fill_slots(const form_layout *l, const form_row *r, const double *x, form_slots *s) {
    const int *ends = l->structure->link[r->link];
    s->count = 0;
    for (int m = 0; m <= r->order; m++) {
        const int pose = form_clamp(r->first + m, l->intervals), at = pose * form_width(l);
        if (l->lengths) {
            form_put_slot(s, form_length_at(l, pose) + r->link, m, 1.0);
            continue;
        }
        morph_sub(&x[at + 3 * ends[1]], &x[at + 3 * ends[0]], s->d[m]);
        s->length[m] = morph_norm(s->d[m]);
        for (int e = 0; e < 2; e++)
            for (int k = 0; k < 3; k++)
                form_put_slot(s, at + 3 * ends[e] + k, m, (e ? 1.0 : -1.0) * s->d[m][k] / s->length[m]);
    }
    for (int m = 0; m < r->order; m++)
        form_put_slot(s, form_duration_of(l, r->first + m), r->order + 1 + m, 1.0);
}

/* Second derivative of a length |d| by two of its own six coordinates: +-(I - d d^T / |d|^2) / |d|. */
static double form_length_second(const form_slots *s, int p, int q, int first) {
    const int a = p - first, b = q - first, m = s->variable[p];
    const double sign = (a / 3 == b / 3) ? 1.0 : -1.0, L = s->length[m];
    return sign * ((a % 3 == b % 3 ? 1.0 : 0.0) - s->d[m][a % 3] * s->d[m][b % 3] / (L * L)) / L;
}

/* Every ordered pair of slots is visited and the lower triangle kept, so that slots of one unknown add up. */
static void form_put_hessian(const form_layout *l, const form_row *r, const form_slots *s, const form_jet *f,
                             double weight, morph_sink *sink) {
    for (int p = 0; p < s->count; p++)
        for (int q = 0; q < s->count; q++) {
            if (s->unknown[p] < s->unknown[q]) continue;
            const int v = s->variable[p], w = s->variable[q];
            double h = f->h[v][w] * s->slope[p] * s->slope[q];
            if (!l->lengths && v == w && v <= r->order) h += f->g[v] * form_length_second(s, p, q, 6 * v);
            morph_sink_hessian(sink, s->unknown[p], s->unknown[q], weight * h);
        }
}

static morph_status form_motion_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const form_motion *d = data;
    for (int k = 0; k < d->count; k++) {
        const form_row r = form_row_of(d->layout, d->row[k]);
        const form_jet f = form_row_jet(d->layout, &r, x, true);
        form_slots s;
        form_fill_slots(d->layout, &r, x, &s);
        for (int p = 0; p < s.count && morph_sink_wants_jacobian(sink); p++)
            morph_sink_jacobian(sink, k, s.unknown[p], f.g[s.variable[p]] * s.slope[p]);
        if (morph_sink_wants_hessian(sink)) form_put_hessian(d->layout, &r, &s, &f, weight[k], sink);
    }
    return MORPH_OK;
}

static void form_motion_describe(void *data, int row, char *text, size_t size) {
    const form_motion *d = data;
    static const char *const kind[] = {"", "rate of ", "acceleration of ", "jerk of "};
    const form_row r = form_row_of(d->layout, d->row[row]);
    snprintf(text, size, "%s", kind[r.order]);
    const size_t used = strlen(text);
    morph_link_name(d->layout->structure, r.link, text + used, size - used);
}

/* lower, upper: count entries, filled. */
static morph_block form_block_motion(form_motion *data, double *lower, double *upper) {
    for (int k = 0; k < data->count; k++) {
        lower[k] = -1.0;
        upper[k] = 1.0;
    }
    return (morph_block){.name = "motion",
                         .rows = data->count,
                         .unknowns = form_unknowns(data->layout),
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = form_motion_value,
                         .walk = form_motion_walk,
                         .describe = form_motion_describe};
}

#endif
