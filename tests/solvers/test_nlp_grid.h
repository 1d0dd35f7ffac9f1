/* n x n points in space, each linked to its right, lower and two diagonal neighbours; rows |d|^2 / L^2 in
 * [0.8^2, 1.25^2]; minimise the squared distance of the heights to a dome that the lengths do not quite
 * allow. */
#ifndef TEST_NLP_GRID_H
#define TEST_NLP_GRID_H

#include "solvers/nlp.h"

#include <stdlib.h>

typedef struct grid {
    int n, points, links;
    int (*link)[2];
    double *length2; /* squared rest lengths */
    double *x0, *lower, *upper, *target;
} grid;

static inline morph_status grid_length(void *data, const double *x, double *f) {
    const grid *g = data;
    for (int k = 0; k < g->links; k++) {
        const double *a = x + 3 * g->link[k][0], *b = x + 3 * g->link[k][1];
        double d[3];
        morph_sub(b, a, d);
        f[k] = morph_dot(d, d) / g->length2[k];
    }
    return MORPH_OK;
}

static inline morph_status grid_length_walk(void *data, const double *x, const double *weight,
                                            morph_sink *s) {
    const grid *g = data;
    const bool first = morph_sink_wants_jacobian(s), second = morph_sink_wants_hessian(s);
    for (int k = 0; k < g->links; k++)
        for (int axis = 0; axis < 3; axis++) {
            const int a = 3 * g->link[k][0] + axis, b = 3 * g->link[k][1] + axis;
            const double c = 2 / g->length2[k];
            if (first) {
                morph_sink_jacobian(s, k, a, -c * (x[b] - x[a]));
                morph_sink_jacobian(s, k, b, c * (x[b] - x[a]));
            }
            if (second) {
                morph_sink_hessian(s, a, a, c * weight[k]);
                morph_sink_hessian(s, b, b, c * weight[k]);
                morph_sink_hessian(s, b, a, -c * weight[k]);
            }
        }
    return MORPH_OK;
}

static inline morph_status grid_height(void *data, const double *x, double *f) {
    const grid *g = data;
    f[0] = 0;
    for (int p = 0; p < g->points; p++)
        f[0] += 0.5 * (x[3 * p + 2] - g->target[p]) * (x[3 * p + 2] - g->target[p]);
    return MORPH_OK;
}

static inline morph_status grid_height_walk(void *data, const double *x, const double *weight,
                                            morph_sink *s) {
    const grid *g = data;
    for (int p = 0; p < g->points; p++) {
        morph_sink_jacobian(s, 0, 3 * p + 2, x[3 * p + 2] - g->target[p]);
        morph_sink_hessian(s, 3 * p + 2, 3 * p + 2, weight[0]);
    }
    return MORPH_OK;
}

static inline void grid_free(grid *g) {
    free(g->link);
    free(g->length2);
    free(g->x0);
    free(g->lower);
    free(g->upper);
    free(g->target);
}

static inline void link_up(grid *g, int a, int b, double length2) {
    g->link[g->links][0] = a;
    g->link[g->links][1] = b;
    g->length2[g->links] = length2;
    g->lower[g->links] = 0.8 * 0.8;
    g->upper[g->links] = 1.25 * 1.25;
    g->links++;
}

static inline bool grid_init(grid *g, int n) {
    *g = (grid){.n = n, .points = n * n};
    const size_t most = 4 * (size_t)g->points, size = sizeof(double);
    g->link = morph_alloc(most, sizeof *g->link);
    g->length2 = morph_alloc(most, size);
    g->lower = morph_alloc(most, size);
    g->upper = morph_alloc(most, size);
    g->x0 = morph_alloc(3 * (size_t)g->points, size);
    g->target = morph_alloc((size_t)g->points, size);
    if (!g->link || !g->length2 || !g->lower || !g->upper || !g->x0 || !g->target) return false;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int p = j * n + i;
            const double u = 2.0 * i / (n - 1) - 1, v = 2.0 * j / (n - 1) - 1;
            g->x0[3 * p] = i;
            g->x0[3 * p + 1] = j;
            g->target[p] = 0.5 * n * (1 - u * u) * (1 - v * v);
            if (i + 1 < n) link_up(g, p, p + 1, 1);
            if (j + 1 < n) link_up(g, p, p + n, 1);
            if (i + 1 < n && j + 1 < n) link_up(g, p, p + n + 1, 2);
            if (i > 0 && j + 1 < n) link_up(g, p, p + n - 1, 2);
        }
    return true;
}

static inline void grid_blocks(grid *g, morph_block blocks[2]) {
    const int unknowns = 3 * g->points;
    blocks[0] = (morph_block){
        .name = "height", .unknowns = unknowns, .data = g, .value = grid_height, .walk = grid_height_walk};
    blocks[1] = (morph_block){.name = "length",
                              .rows = g->links,
                              .unknowns = unknowns,
                              .lower = g->lower,
                              .upper = g->upper,
                              .data = g,
                              .value = grid_length,
                              .walk = grid_length_walk};
}

#endif
