/* Small problems that the tests of the NLP layer share. */
#ifndef TEST_NLP_PROBLEMS_H
#define TEST_NLP_PROBLEMS_H

#include "solvers/nlp.h"

#include <stdio.h>
#include <string.h>

/* For use after cmocka.h: |a - b| <= tolerance, false for NaN, both numbers told. */
#define assert_near(a, b, tolerance)                                                                         \
    do {                                                                                                     \
        const double near_a = (a), near_b = (b);                                                             \
        if (!(fabs(near_a - near_b) <= (tolerance)))                                                         \
            fail_msg("%s = %.17g, not %.17g within %g", #a, near_a, near_b, (double)(tolerance));            \
    } while (0)

/* ---- problem 71 of Hock and Schittkowski: optimum 17.0140173 at (1, 4.743, 3.8211, 1.3794) */

static inline morph_status hs71_value(void *data, const double *x, double *f) {
    (void)data;
    f[0] = x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
    return MORPH_OK;
}

static inline morph_status hs71_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    (void)data;
    morph_sink_jacobian(s, 0, 0, x[3] * (2 * x[0] + x[1] + x[2]));
    morph_sink_jacobian(s, 0, 1, x[0] * x[3]);
    morph_sink_jacobian(s, 0, 2, x[0] * x[3]);
    morph_sink_jacobian(s, 0, 2, 1); /* repeated entries add up */
    morph_sink_jacobian(s, 0, 3, x[0] * (x[0] + x[1] + x[2]));
    if (!morph_sink_wants_hessian(s)) return MORPH_OK;
    const double w = weight[0];
    morph_sink_hessian(s, 0, 0, w * 2 * x[3]);
    morph_sink_hessian(s, 0, 1, w * x[3]);
    morph_sink_hessian(s, 2, 0, w * x[3]);
    morph_sink_hessian(s, 0, 3, w * (2 * x[0] + x[1] + x[2]));
    morph_sink_hessian(s, 1, 3, w * x[0]);
    morph_sink_hessian(s, 3, 2, w * x[0]);
    return MORPH_OK;
}

static inline morph_status hs71_row_value(void *data, const double *x, double *f) {
    (void)data;
    f[0] = x[0] * x[1] * x[2] * x[3];
    f[1] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3];
    return MORPH_OK;
}

static inline morph_status hs71_row_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    (void)data;
    for (int i = 0; i < 4; i++) {
        double others = 1;
        for (int k = 0; k < 4; k++)
            if (k != i) others *= x[k];
        morph_sink_jacobian(s, 0, i, others);
        morph_sink_jacobian(s, 1, i, 2 * x[i]);
    }
    if (!morph_sink_wants_hessian(s)) return MORPH_OK;
    for (int i = 0; i < 4; i++) {
        morph_sink_hessian(s, i, i, 2 * weight[1]);
        for (int j = 0; j < i; j++) {
            double others = 1;
            for (int k = 0; k < 4; k++)
                if (k != i && k != j) others *= x[k];
            morph_sink_hessian(s, i, j, weight[0] * others);
        }
    }
    return MORPH_OK;
}

static const double hs71_lower[2] = {25, 40}, hs71_upper[2] = {INFINITY, 40};
static const double hs71_x0[4] = {1, 5, 5, 1};
static const double hs71_xlower[4] = {1, 1, 1, 1}, hs71_xupper[4] = {5, 5, 5, 5};
static const double hs71_x[4] = {1, 4.74299963, 3.82114998, 1.37940829}; /* published, to 9 digits */

static inline void hs71_blocks(morph_block blocks[2]) {
    blocks[0] = (morph_block){.name = "cost", .unknowns = 4, .value = hs71_value, .walk = hs71_walk};
    blocks[1] = (morph_block){.name = "product",
                              .rows = 2,
                              .unknowns = 4,
                              .lower = hs71_lower,
                              .upper = hs71_upper,
                              .value = hs71_row_value,
                              .walk = hs71_row_walk};
}

/* ---- linear rows and quadratic objectives: f_r = sum_k a[r][k] x[k] + b[r] |x|^2 / 2 over up to 4 unknowns.
 * nan_at: after so many evaluations the value (nan_value) or the derivatives (nan_walk) are NaN. */

typedef struct quadratic {
    int rows, unknowns;
    double a[3][4], b[3];
    int values, walks;
    int nan_value, nan_walk; /* > 0: from the so-many-th on */
    morph_status fail;       /* what value returns from the nan_value-th on, if not MORPH_OK */
} quadratic;

static inline morph_status quadratic_value(void *data, const double *x, double *f) {
    quadratic *q = data;
    const bool bad = ++q->values >= q->nan_value && q->nan_value > 0;
    if (bad && q->fail != MORPH_OK) return q->fail;
    for (int r = 0; r < (q->rows > 0 ? q->rows : 1); r++) {
        f[r] = bad ? NAN : 0;
        for (int k = 0; k < q->unknowns; k++)
            f[r] += q->a[r][k] * x[k] + 0.5 * q->b[r] * x[k] * x[k];
    }
    return MORPH_OK;
}

static inline morph_status quadratic_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    quadratic *q = data;
    const bool bad = ++q->walks >= q->nan_walk && q->nan_walk > 0;
    for (int r = 0; r < (q->rows > 0 ? q->rows : 1); r++)
        for (int k = 0; k < q->unknowns; k++) {
            morph_sink_jacobian(s, r, k, bad ? NAN : q->a[r][k] + q->b[r] * x[k]);
            morph_sink_hessian(s, k, k, q->b[r] * weight[r]);
        }
    return MORPH_OK;
}

static inline morph_block quadratic_block(quadratic *q, const double *lower, const double *upper) {
    return (morph_block){.name = q->rows > 0 ? "rows" : "objective",
                         .rows = q->rows,
                         .unknowns = q->unknowns,
                         .lower = lower,
                         .upper = upper,
                         .data = q,
                         .value = quadratic_value,
                         .walk = quadratic_walk};
}

/* ---- minimise sum x + |x|^2 / 2 with x0 + x1 + x2 >= 1 from a feasible or an infeasible start. */
typedef struct small {
    quadratic cost, rows;
    double lower, upper;
    morph_block blocks[2];
} small;

static inline void small_init(small *s) {
    *s = (small){.cost = {.unknowns = 3, .a = {{1, 2, 3}}, .b = {1}},
                 .rows = {.rows = 1, .unknowns = 3, .a = {{1, 1, 1}}, .b = {0.25}},
                 .lower = 1,
                 .upper = INFINITY};
    s->blocks[0] = quadratic_block(&s->cost, NULL, NULL);
    s->blocks[1] = quadratic_block(&s->rows, &s->lower, &s->upper);
}

static const double feasible_start[3] = {5, 4, 3};

/* ---- a chain of points hanging between two fixed ends: minimise sum of heights, every link's
 * |d|^2 / L^2 = 1. Unknowns x_0 y_0 x_1 y_1 ...; the ends are fixed by equal bounds. */

enum { CHAIN_MOST = 400 };

typedef struct chain {
    int links;
    double length;
    double x0[2 * CHAIN_MOST + 2], lower[2 * CHAIN_MOST + 2], upper[2 * CHAIN_MOST + 2];
    double one[CHAIN_MOST];
    int values, walks;
    double seconds_a_value; /* busy waiting, for the wall limit */
} chain;

static inline morph_status chain_height(void *data, const double *x, double *f) {
    const chain *c = data;
    f[0] = 0;
    for (int i = 0; i <= c->links; i++)
        f[0] += x[2 * i + 1] / c->links;
    return MORPH_OK;
}

static inline morph_status chain_height_walk(void *data, const double *x, const double *weight,
                                             morph_sink *s) {
    const chain *c = data;
    (void)x;
    (void)weight;
    for (int i = 0; i <= c->links; i++)
        morph_sink_jacobian(s, 0, 2 * i + 1, 1.0 / c->links);
    return MORPH_OK;
}

static inline morph_status chain_length(void *data, const double *x, double *f) {
    chain *c = data;
    c->values++;
    const double begin = morph_seconds();
    while (c->seconds_a_value > 0 && morph_seconds() - begin < c->seconds_a_value)
        ;
    for (int i = 0; i < c->links; i++) {
        const double dx = x[2 * i + 2] - x[2 * i], dy = x[2 * i + 3] - x[2 * i + 1];
        f[i] = (dx * dx + dy * dy) / (c->length * c->length);
    }
    return MORPH_OK;
}

static inline morph_status chain_length_walk(void *data, const double *x, const double *weight,
                                             morph_sink *s) {
    chain *c = data;
    c->walks++;
    const double k = 2 / (c->length * c->length);
    for (int i = 0; i < c->links; i++)
        for (int axis = 0; axis < 2; axis++) {
            const int a = 2 * i + axis, b = a + 2;
            const double d = x[b] - x[a];
            morph_sink_jacobian(s, i, a, -k * d);
            morph_sink_jacobian(s, i, b, k * d);
            if (!morph_sink_wants_hessian(s)) continue;
            morph_sink_hessian(s, a, a, k * weight[i]);
            morph_sink_hessian(s, b, b, k * weight[i]);
            morph_sink_hessian(s, a, b, -k * weight[i]);
        }
    return MORPH_OK;
}

static inline void chain_describe(void *data, int row, char *text, size_t size) {
    (void)data;
    snprintf(text, size, "link %d-%d", row, row + 1);
}

/* Ends 1 apart, chain 1.25 long, start slightly sagging. */
static inline void chain_init(chain *c, int links, morph_block blocks[2]) {
    memset(c, 0, sizeof *c);
    c->links = links;
    c->length = 1.25 / links;
    for (int i = 0; i <= links; i++) {
        const double t = (double)i / links;
        c->x0[2 * i] = t;
        c->x0[2 * i + 1] = -0.4 * t * (1 - t);
        const bool end = i == 0 || i == links;
        for (int axis = 0; axis < 2; axis++) {
            c->lower[2 * i + axis] = end ? c->x0[2 * i + axis] : -INFINITY;
            c->upper[2 * i + axis] = end ? c->x0[2 * i + axis] : INFINITY;
        }
        if (i < links) c->one[i] = 1;
    }
    blocks[0] = (morph_block){.name = "height",
                              .unknowns = 2 * links + 2,
                              .data = c,
                              .value = chain_height,
                              .walk = chain_height_walk};
    blocks[1] = (morph_block){.name = "length",
                              .rows = links,
                              .unknowns = 2 * links + 2,
                              .lower = c->one,
                              .upper = c->one,
                              .data = c,
                              .value = chain_length,
                              .walk = chain_length_walk,
                              .describe = chain_describe};
}

#endif
