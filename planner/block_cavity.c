/* The cavity objective's two sums. */
#include "planner/blocks.h"

/* Gap at a skin point and its derivatives by the point, in spacings. With f the smooth distance to the target
 * and z the height above the base plane, min(f, z) is rounded to m = (f + z - s)/2, s = sqrt((f - z)^2 +
 * e^2): dm = (df (1 - c) + dz (1 + c))/2,  c = (f - z)/s d2m = (1 - c)/2 d2f - (1 - c^2)/(2s) (df - dz)(df -
 * dz)^T */
double morph_gap_at(const morph_gap_term *d, const double at[3], double g[3], double h[6]) {
    const double a = d->cavity->structure->spacing, r = d->cavity->structure->def.radius / a;
    const double world[3] = {a * at[0], a * at[1], a * at[2]};
    const double f = morph_sdf_eval(d->sdf, world, g, h) / a;
    if (h)
        for (int k = 0; k < 6; k++)
            h[k] *= a;
    if (isnan(d->cavity->base)) return f - r;
    const double z = at[2] - d->cavity->base / a;
    const double s = sqrt((f - z) * (f - z) + d->blend * d->blend), c = (f - z) / s;
    if (h) {
        static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
        const double e[3] = {g[0], g[1], g[2] - 1.0};
        for (int k = 0; k < 6; k++)
            h[k] = 0.5 * (1.0 - c) * h[k] - 0.5 * (1.0 - c * c) / s * e[row[k]] * e[column[k]];
    }
    if (g) {
        for (int k = 0; k < 3; k++)
            g[k] *= 0.5 * (1.0 - c);
        g[2] += 0.5 * (1.0 + c);
    }
    return 0.5 * (f + z - s) - r;
}

static void sample_at(const morph_skin_sample *q, const double *x, double at[3]) {
    for (int k = 0; k < 3; k++) {
        at[k] = 0.0;
        for (int a = 0; a < 3; a++)
            at[k] += q->weight[a] * x[3 * q->joint[a] + k];
    }
}

static double sample_scale(const morph_gap_term *d, const morph_skin_sample *q) {
    const double a = d->cavity->structure->spacing;
    return d->scale * q->area / (a * a);
}

static morph_status gap_value(void *data, const double *x, double *f) {
    const morph_gap_term *d = data;
    f[0] = 0.0;
    for (int q = 0; q < d->cavity->samples; q++) {
        double at[3];
        sample_at(&d->cavity->sample[q], x, at);
        const double gap = morph_gap_at(d, at, NULL, NULL);
        f[0] += sample_scale(d, &d->cavity->sample[q]) * gap * gap;
    }
    return MORPH_OK;
}

static morph_status gap_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_gap_term *d = data;
    static const int packed[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    const bool first = morph_sink_wants_jacobian(sink), second = morph_sink_wants_hessian(sink);
    for (int s = 0; s < d->cavity->samples; s++) {
        const morph_skin_sample *q = &d->cavity->sample[s];
        double at[3], g[3], h[6];
        sample_at(q, x, at);
        const double gap = morph_gap_at(d, at, g, second && !d->gauss_newton ? h : NULL),
                     scale = sample_scale(d, q);
        for (int a = 0; a < 3; a++)
            for (int k = 0; k < 3; k++) {
                if (first)
                    morph_sink_jacobian(sink, 0, 3 * q->joint[a] + k,
                                        2.0 * scale * gap * q->weight[a] * g[k]);
                for (int b = 0; b < 3 && second; b++)
                    for (int m = 0; m < 3; m++)
                        if (3 * q->joint[a] + k >= 3 * q->joint[b] + m)
                            morph_sink_hessian(
                                sink, 3 * q->joint[a] + k, 3 * q->joint[b] + m,
                                2.0 * weight[0] * scale * q->weight[a] * q->weight[b] *
                                    (g[k] * g[m] + (d->gauss_newton ? 0.0 : gap * h[packed[k][m]])));
            }
    }
    return MORPH_OK;
}

morph_block morph_block_gap(morph_gap_term *data, const int *unknown) {
    return (morph_block){.name = "gap",
                         .unknowns = 3 * data->cavity->structure->joints,
                         .unknown = unknown,
                         .data = data,
                         .value = gap_value,
                         .walk = gap_walk};
}

/* Offset e = W x - y of an exposed point, in spacings. */
static void cover_offset(const morph_cover_term *d, int y, const double *x, double e[3]) {
    for (int k = 0; k < 3; k++) {
        e[k] = -d->cavity->expose[y].point[k] / d->cavity->structure->spacing;
        for (int a = 0; a < 3; a++)
            e[k] += d->weight[y][a] * x[3 * d->joint[y][a] + k];
    }
}

static double cover_scale(const morph_cover_term *d, int y) {
    const double a = d->cavity->structure->spacing;
    return d->scale * d->cavity->expose[y].area / (a * a);
}

/* Rounding of |t|: a quarter of a link's radius at the default. */
#define PRESS_ROUND 0.01

/* t^2 + press (sqrt(t^2 + e^2) - e) and its first and second derivatives by t. */
static double along_cost(double t, double press, double d[2]) {
    const double root = sqrt(t * t + PRESS_ROUND * PRESS_ROUND);
    d[0] = 2.0 * t + press * t / root;
    d[1] = 2.0 + press * PRESS_ROUND * PRESS_ROUND / (root * root * root);
    return t * t + press * (root - PRESS_ROUND);
}

/* cost(n.e - r) + slide (|e|^2 - (n.e)^2) */
static morph_status cover_value(void *data, const double *x, double *f) {
    const morph_cover_term *d = data;
    const double r = d->cavity->structure->def.radius / d->cavity->structure->spacing;
    f[0] = 0.0;
    for (int y = 0; y < d->cavity->exposed; y++) {
        double e[3];
        cover_offset(d, y, x, e);
        const double along = morph_dot(d->cavity->expose[y].normal, e);
        double cost[2];
        f[0] += cover_scale(d, y) *
                (along_cost(along - r, d->press, cost) + d->slide * (morph_dot(e, e) - along * along));
    }
    return MORPH_OK;
}

static morph_status cover_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_cover_term *d = data;
    const double r = d->cavity->structure->def.radius / d->cavity->structure->spacing;
    const bool first = morph_sink_wants_jacobian(sink), second = morph_sink_wants_hessian(sink);
    for (int y = 0; y < d->cavity->exposed; y++) {
        const double *n = d->cavity->expose[y].normal, *w = d->weight[y], scale = cover_scale(d, y);
        const int *joint = d->joint[y];
        double e[3];
        cover_offset(d, y, x, e);
        const double along = morph_dot(n, e);
        double cost[2];
        along_cost(along - r, d->press, cost);
        for (int a = 0; a < 3; a++)
            for (int k = 0; k < 3; k++) {
                const double g = cost[0] * n[k] + 2.0 * d->slide * (e[k] - along * n[k]);
                if (first) morph_sink_jacobian(sink, 0, 3 * joint[a] + k, scale * w[a] * g);
                for (int b = 0; b < 3 && second; b++)
                    for (int m = 0; m < 3; m++)
                        if (3 * joint[a] + k >= 3 * joint[b] + m)
                            morph_sink_hessian(sink, 3 * joint[a] + k, 3 * joint[b] + m,
                                               weight[0] * scale * w[a] * w[b] *
                                                   ((cost[1] - 2.0 * d->slide) * n[k] * n[m] +
                                                    (k == m ? 2.0 * d->slide : 0.0)));
            }
    }
    return MORPH_OK;
}

morph_block morph_block_cover(morph_cover_term *data, const int *unknown) {
    return (morph_block){.name = "cover",
                         .unknowns = 3 * data->cavity->structure->joints,
                         .unknown = unknown,
                         .data = data,
                         .value = cover_value,
                         .walk = cover_walk};
}
