/* Rows of balance.h. With y the multipliers of the balance rows spread over the coordinates (0 where a joint
 * is fixed), the rows' Lagrangian sum_i y_i r_i has by x the second derivative "third derivative of every
 * term along y", by x and a multiplier minus the limit's Hessian times y. A pull is a function of d = a - x:
 * by x its derivatives change sign with their order, by a they do not. */
#include "planner/balance.h"

#include <string.h>

static void jet_of(const morph_balance *b, const morph_element *e, const double *x, int order,
                   const double *y, morph_jet *jet) {
    double along[MORPH_ELEMENT_WIDTH] = {0.0};
    for (int a = 0; a < morph_element_joints(e) && y; a++)
        memcpy(&along[3 * a], &y[3 * e->joint[a]], 3 * sizeof *y);
    morph_element_eval(e, b->world->sdf, b->world->structure->spacing, x, order, along, jet);
}

/* scale m of an element to the Lagrangian's Hessian: every ordered pair of its coordinates is visited and the
 * lower triangle kept, so that joints that occur twice add up rightly. */
static void put_hessian(morph_sink *sink, const morph_element *e,
                        const double m[MORPH_ELEMENT_WIDTH][MORPH_ELEMENT_WIDTH], double scale) {
    const int n = morph_element_joints(e);
    for (int a = 0; a < n; a++)
        for (int c = 0; c < n; c++)
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++) {
                    const int i = 3 * e->joint[a] + k, j = 3 * e->joint[c] + l;
                    if (i >= j) morph_sink_hessian(sink, i, j, scale * m[3 * a + k][3 * c + l]);
                }
}

/* The gradient of scale times an element as rows of balance: their derivatives by x. */
static void put_rows(morph_sink *sink, const morph_balance *b, const morph_element *e, const morph_jet *jet,
                     double scale) {
    const int n = morph_element_joints(e);
    for (int a = 0; a < n; a++)
        for (int k = 0; k < 3; k++) {
            const int row = b->row[3 * e->joint[a] + k];
            for (int c = 0; c < n && row >= 0; c++)
                for (int l = 0; l < 3; l++)
                    morph_sink_jacobian(sink, row, 3 * e->joint[c] + l, scale * jet->h[3 * a + k][3 * c + l]);
        }
}

static void add_gradient(const morph_balance *b, const morph_element *e, const morph_jet *jet, double scale,
                         double *f) {
    for (int a = 0; a < morph_element_joints(e); a++)
        for (int k = 0; k < 3; k++) {
            const int row = b->row[3 * e->joint[a] + k];
            if (row >= 0) f[row] += scale * jet->g[3 * a + k];
        }
}

static morph_status balance_value(void *data, const double *z, double *f) {
    const morph_balance *b = data;
    morph_jet jet;
    for (int i = 0; i < b->coordinates; i++)
        if (b->row[i] >= 0)
            f[b->row[i]] = (i % 3 == 2 ? b->weight : 0.0) - b->force[i] + b->hold * (z[i] - b->anchor[i]);
    for (int e = 0; e < b->energies; e++) {
        jet_of(b, &b->energy[e], z, 1, NULL, &jet);
        add_gradient(b, &b->energy[e], &jet, 1.0, f);
    }
    for (int e = 0; e < b->equalities; e++) {
        jet_of(b, &b->equality[e], z, 1, NULL, &jet);
        add_gradient(b, &b->equality[e], &jet, -z[morph_balance_tau(b) + e], f);
    }
    for (int q = 0; q < b->limits.count; q++) {
        jet_of(b, &b->limits.element[q], z, 1, NULL, &jet);
        add_gradient(b, &b->limits.element[q], &jet, -b->limits.sign[q] * z[morph_balance_lambda(b) + q], f);
    }
    for (int m = 0; m < b->centres; m++) {
        const double *at = &z[morph_balance_centre(b) + 3 * m], s = z[morph_balance_strength(b) + m];
        for (int j = 0; j < b->coordinates / 3; j++) {
            if (b->row[3 * j] < 0) continue;
            double d[3];
            morph_pull_jet pull;
            morph_sub(at, &z[3 * j], d);
            morph_pull_eval(d, b->softening, NULL, &pull);
            for (int k = 0; k < 3; k++)
                f[b->row[3 * j + k]] -= s * pull.g[k];
        }
    }
    return MORPH_OK;
}

/* Terms with a multiplier each: equalities or limits. */
static void walk_reactions(const morph_balance *b, const double *z, const double *y, const morph_element *e,
                           int count, const double *sign, int first, morph_sink *sink) {
    const bool jacobian = morph_sink_wants_jacobian(sink), hessian = morph_sink_wants_hessian(sink);
    for (int q = 0; q < count; q++) {
        morph_jet jet;
        const double side = sign ? sign[q] : 1.0, force = side * z[first + q];
        const int n = 3 * morph_element_joints(&e[q]);
        jet_of(b, &e[q], z, hessian ? 3 : 2, y, &jet);
        if (jacobian) put_rows(sink, b, &e[q], &jet, -force);
        for (int i = 0; i < n && jacobian; i++) {
            const int row = b->row[3 * e[q].joint[i / 3] + i % 3];
            if (row >= 0) morph_sink_jacobian(sink, row, first + q, -side * jet.g[i]);
        }
        if (hessian) put_hessian(sink, &e[q], (const double(*)[MORPH_ELEMENT_WIDTH])jet.t, -force);
        for (int i = 0; i < n && hessian; i++) {
            double hy = 0.0;
            for (int j = 0; j < n; j++)
                hy += jet.h[i][j] * y[3 * e[q].joint[j / 3] + j % 3];
            morph_sink_hessian(sink, first + q, 3 * e[q].joint[i / 3] + i % 3, -side * hy);
        }
    }
}

static void walk_pull(const morph_balance *b, const double *z, const double *y, int m, int j,
                      morph_sink *sink) {
    const int at = morph_balance_centre(b) + 3 * m, strength = morph_balance_strength(b) + m;
    const double s = z[strength];
    double d[3];
    morph_pull_jet pull;
    morph_sub(&z[at], &z[3 * j], d);
    morph_pull_eval(d, b->softening, y ? &y[3 * j] : NULL, &pull);
    for (int k = 0; k < 3 && morph_sink_wants_jacobian(sink); k++) {
        const int row = b->row[3 * j + k];
        for (int l = 0; l < 3; l++) {
            morph_sink_jacobian(sink, row, 3 * j + l, s * pull.h[k][l]);
            morph_sink_jacobian(sink, row, at + l, -s * pull.h[k][l]);
        }
        morph_sink_jacobian(sink, row, strength, -pull.g[k]);
    }
    for (int k = 0; k < 3 && morph_sink_wants_hessian(sink); k++) {
        double hy = 0.0;
        for (int l = 0; l < 3; l++) {
            hy += pull.h[k][l] * y[3 * j + l];
            morph_sink_hessian(sink, at + k, 3 * j + l, s * pull.t[k][l]);
            if (k < l) continue;
            morph_sink_hessian(sink, 3 * j + k, 3 * j + l, -s * pull.t[k][l]);
            morph_sink_hessian(sink, at + k, at + l, -s * pull.t[k][l]);
        }
        morph_sink_hessian(sink, strength, 3 * j + k, hy);
        morph_sink_hessian(sink, strength, at + k, -hy);
    }
}

static morph_status balance_walk(void *data, const double *z, const double *weight, morph_sink *sink) {
    const morph_balance *b = data;
    const bool hessian = morph_sink_wants_hessian(sink);
    double *y = NULL;
    if (hessian) {
        y = b->along;
        for (int i = 0; i < b->coordinates; i++)
            y[i] = b->row[i] >= 0 ? weight[b->row[i]] : 0.0;
    }
    for (int e = 0; e < b->energies; e++) {
        morph_jet jet;
        jet_of(b, &b->energy[e], z, hessian ? 3 : 2, y, &jet);
        if (morph_sink_wants_jacobian(sink)) put_rows(sink, b, &b->energy[e], &jet, 1.0);
        if (hessian) put_hessian(sink, &b->energy[e], (const double(*)[MORPH_ELEMENT_WIDTH])jet.t, 1.0);
    }
    for (int i = 0; i < b->coordinates && morph_sink_wants_jacobian(sink); i++)
        if (b->row[i] >= 0) morph_sink_jacobian(sink, b->row[i], i, b->hold);
    walk_reactions(b, z, y, b->equality, b->equalities, NULL, morph_balance_tau(b), sink);
    walk_reactions(b, z, y, b->limits.element, b->limits.count, b->limits.sign, morph_balance_lambda(b),
                   sink);
    for (int m = 0; m < b->centres; m++)
        for (int j = 0; j < b->coordinates / 3; j++)
            if (b->row[3 * j] >= 0) walk_pull(b, z, y, m, j, sink);
    return MORPH_OK;
}

static void balance_describe(void *data, int row, char *text, size_t size) {
    const morph_balance *b = data;
    for (int i = 0; i < b->coordinates; i++)
        if (b->row[i] == row) morph_joint_name(b->world->structure, i / 3, text, size);
}

morph_block morph_block_balance(morph_balance *b, double *lower, double *upper) {
    memset(lower, 0, (size_t)b->rows * sizeof *lower);
    memset(upper, 0, (size_t)b->rows * sizeof *upper);
    return (morph_block){.name = "balance",
                         .rows = b->rows,
                         .unknowns = morph_balance_unknowns(b),
                         .lower = lower,
                         .upper = upper,
                         .data = b,
                         .value = balance_value,
                         .walk = balance_walk,
                         .describe = balance_describe};
}

static morph_status complementarity_value(void *data, const double *z, double *f) {
    const morph_balance *b = data;
    for (int q = 0; q < b->limits.count; q++)
        f[q] = z[morph_balance_lambda(b) + q] * morph_balance_limit_at(b, q, z) - b->epsilon;
    return MORPH_OK;
}

/* lambda c: by lambda c, by x lambda grad c; second lambda hess c and grad c across. */
static morph_status complementarity_walk(void *data, const double *z, const double *weight,
                                         morph_sink *sink) {
    const morph_balance *b = data;
    const bool jacobian = morph_sink_wants_jacobian(sink), hessian = morph_sink_wants_hessian(sink);
    for (int q = 0; q < b->limits.count; q++) {
        morph_jet jet;
        const morph_element *e = &b->limits.element[q];
        const int mine = morph_balance_lambda(b) + q;
        const double side = b->limits.sign[q];
        jet_of(b, e, z, hessian ? 2 : 1, NULL, &jet);
        if (jacobian) morph_sink_jacobian(sink, q, mine, side * (jet.value - b->limits.edge[q]));
        for (int i = 0; i < 3 * morph_element_joints(e); i++) {
            const int at = 3 * e->joint[i / 3] + i % 3;
            if (jacobian) morph_sink_jacobian(sink, q, at, z[mine] * side * jet.g[i]);
            if (hessian) morph_sink_hessian(sink, mine, at, weight[q] * side * jet.g[i]);
        }
        if (hessian)
            put_hessian(sink, e, (const double(*)[MORPH_ELEMENT_WIDTH])jet.h, weight[q] * side * z[mine]);
    }
    return MORPH_OK;
}

static void limit_describe(void *data, int row, char *text, size_t size) {
    morph_balance_limit_name(data, row, text, size);
}

morph_block morph_block_complementarity(morph_balance *b, double *lower, double *upper) {
    memset(lower, 0, (size_t)b->limits.count * sizeof *lower);
    memset(upper, 0, (size_t)b->limits.count * sizeof *upper);
    return (morph_block){.name = "complementarity",
                         .rows = b->limits.count,
                         .unknowns = morph_balance_unknowns(b),
                         .lower = lower,
                         .upper = upper,
                         .data = b,
                         .value = complementarity_value,
                         .walk = complementarity_walk,
                         .describe = limit_describe};
}

/* Values of elements as rows: side (value - edge). */
static void rows_value(const morph_balance *b, const morph_element *e, const double *sign, const double *edge,
                       int count, const double *x, double *f) {
    for (int q = 0; q < count; q++) {
        morph_jet jet;
        jet_of(b, &e[q], x, 0, NULL, &jet);
        f[q] = (sign ? sign[q] : 1.0) * (jet.value - edge[q]);
    }
}

static void rows_walk(const morph_balance *b, const morph_element *e, const double *sign, int count,
                      const double *x, const double *weight, morph_sink *sink) {
    for (int q = 0; q < count; q++) {
        morph_jet jet;
        const double side = sign ? sign[q] : 1.0;
        jet_of(b, &e[q], x, morph_sink_wants_hessian(sink) ? 2 : 1, NULL, &jet);
        for (int i = 0; i < 3 * morph_element_joints(&e[q]) && morph_sink_wants_jacobian(sink); i++)
            morph_sink_jacobian(sink, q, 3 * e[q].joint[i / 3] + i % 3, side * jet.g[i]);
        if (morph_sink_wants_hessian(sink))
            put_hessian(sink, &e[q], (const double(*)[MORPH_ELEMENT_WIDTH])jet.h, weight[q] * side);
    }
}

static morph_status equalities_value(void *data, const double *x, double *f) {
    const morph_balance *b = data;
    rows_value(b, b->equality, NULL, b->aim, b->equalities, x, f);
    return MORPH_OK;
}

static morph_status equalities_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_balance *b = data;
    rows_walk(b, b->equality, NULL, b->equalities, x, weight, sink);
    return MORPH_OK;
}

static void equality_describe(void *data, int row, char *text, size_t size) {
    const morph_balance *b = data;
    morph_joint_name(b->world->structure, b->equality[row].joint[0], text, size);
}

morph_block morph_block_equalities(morph_balance *b, double *lower, double *upper) {
    memset(lower, 0, (size_t)b->equalities * sizeof *lower);
    memset(upper, 0, (size_t)b->equalities * sizeof *upper);
    return (morph_block){.name = "post or panel",
                         .rows = b->equalities,
                         .unknowns = b->coordinates,
                         .lower = lower,
                         .upper = upper,
                         .data = b,
                         .value = equalities_value,
                         .walk = equalities_walk,
                         .describe = equality_describe};
}

static morph_status limits_value(void *data, const double *x, double *f) {
    const morph_balance *b = data;
    rows_value(b, b->limits.element, b->limits.sign, b->limits.edge, b->limits.count, x, f);
    return MORPH_OK;
}

static morph_status limits_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_balance *b = data;
    rows_walk(b, b->limits.element, b->limits.sign, b->limits.count, x, weight, sink);
    return MORPH_OK;
}

morph_block morph_block_limits(morph_balance *b, double *lower, double *upper) {
    for (int q = 0; q < b->limits.count; q++) {
        lower[q] = 0.0;
        upper[q] = INFINITY;
    }
    return (morph_block){.name = "limit",
                         .rows = b->limits.count,
                         .unknowns = b->coordinates,
                         .lower = lower,
                         .upper = upper,
                         .data = b,
                         .value = limits_value,
                         .walk = limits_walk,
                         .describe = limit_describe};
}

static morph_status energy_value(void *data, const double *x, double *f) {
    const morph_rest_energy *r = data;
    const morph_balance *b = r->balance;
    f[0] = 0.0;
    for (int j = 0; j < b->coordinates / 3; j++)
        f[0] += b->weight * x[3 * j + 2];
    for (int i = 0; i < b->coordinates; i++)
        f[0] += 0.5 * b->hold * (x[i] - b->anchor[i]) * (x[i] - b->anchor[i]) - b->force[i] * x[i];
    for (int e = 0; e < b->energies; e++) {
        morph_jet jet;
        jet_of(b, &b->energy[e], x, 0, NULL, &jet);
        f[0] += jet.value;
    }
    for (int m = 0; m < b->centres; m++)
        for (int j = 0; j < b->coordinates / 3; j++)
            f[0] += morph_attraction(&r->centre[m], b->softening, &x[3 * j], NULL, NULL);
    return MORPH_OK;
}

static morph_status energy_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_rest_energy *r = data;
    const morph_balance *b = r->balance;
    const bool jacobian = morph_sink_wants_jacobian(sink), hessian = morph_sink_wants_hessian(sink);
    for (int e = 0; e < b->energies; e++) {
        const morph_element *el = &b->energy[e];
        morph_jet jet;
        jet_of(b, el, x, hessian ? 2 : 1, NULL, &jet);
        for (int i = 0; i < 3 * morph_element_joints(el) && jacobian; i++)
            morph_sink_jacobian(sink, 0, 3 * el->joint[i / 3] + i % 3, jet.g[i]);
        if (hessian) put_hessian(sink, el, (const double(*)[MORPH_ELEMENT_WIDTH])jet.h, weight[0]);
    }
    for (int j = 0; j < b->coordinates / 3; j++) {
        double force[3] = {0.0, 0.0, -b->weight}, stiffness[3][3] = {{0.0}};
        for (int m = 0; m < b->centres; m++)
            morph_attraction(&r->centre[m], b->softening, &x[3 * j], force, stiffness);
        for (int k = 0; k < 3; k++) {
            const int i = 3 * j + k;
            if (jacobian)
                morph_sink_jacobian(sink, 0, i, b->hold * (x[i] - b->anchor[i]) - b->force[i] - force[k]);
            for (int l = 0; l <= k && hessian; l++)
                morph_sink_hessian(sink, 3 * j + k, 3 * j + l,
                                   weight[0] * (stiffness[k][l] + (k == l ? b->hold : 0.0)));
        }
    }
    return MORPH_OK;
}

morph_block morph_block_rest_energy(morph_rest_energy *e) {
    return (morph_block){.name = "energy",
                         .unknowns = e->balance->coordinates,
                         .data = e,
                         .value = energy_value,
                         .walk = energy_walk};
}
