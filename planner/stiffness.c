#include "planner/stiffness.h"

#include "solvers/sparse.h"

#include <stdlib.h>
#include <string.h>

/* Entry of the lower triangle: of K, and what the equalities' penalty adds to it. */
typedef struct entry {
    int column, row;
    double stiffness, penalty;
} entry;

/* Row of A: as many entries as its element has coordinates; of fixed joints row -1. */
typedef struct gradient {
    int count, row[MORPH_ELEMENT_WIDTH];
    double value[MORPH_ELEMENT_WIDTH];
} gradient;

struct morph_stiffness {
    int rows, equalities;
    gradient *equality;
    double *stiffness; /* values of K on the factor's pattern */
    morph_sparse *factor;
    double *f, *u, *g; /* scratch: rows, rows, equalities */
};

typedef struct assembly {
    const morph_balance *balance;
    morph_stiffness *out;
    entry *entries;
    size_t count, capacity;
    bool refused;
} assembly;

static void add(assembly *m, int i, int j, double stiffness, double penalty) {
    if (i < j || m->refused) return;
    if (m->count == m->capacity) {
        const size_t more = m->capacity ? 2 * m->capacity : 16384;
        entry *e = realloc(m->entries, more * sizeof *e);
        if (!e) {
            m->refused = true;
            return;
        }
        m->entries = e;
        m->capacity = more;
    }
    m->entries[m->count++] = (entry){j, i, stiffness, penalty};
}

/* hessian * h + outer * g g' on the free coordinates; penalty * g g' apart. */
static void add_element(assembly *m, const morph_element *e, const double *x, double hessian, double outer,
                        double penalty, gradient *slope) {
    const morph_balance *b = m->balance;
    morph_jet jet;
    morph_element_eval(e, b->world->sdf, b->world->structure->spacing, x, 2, NULL, &jet);
    const int n = 3 * morph_element_joints(e);
    for (int i = 0; i < n; i++) {
        const int r = b->row[3 * e->joint[i / 3] + i % 3];
        if (slope) {
            slope->row[i] = r;
            slope->value[i] = jet.g[i];
        }
        for (int j = 0; j < n && r >= 0; j++) {
            const int c = b->row[3 * e->joint[j / 3] + j % 3];
            const double square = jet.g[i] * jet.g[j];
            if (c >= 0) add(m, r, c, hessian * jet.h[i][j] + outer * square, penalty * square);
        }
    }
    if (slope) slope->count = n;
}

/* Penalty of the equalities against stiffnesses of order 1 to 100: the curvature left along them is then
 * positive, and each step of the method of multipliers leaves about a thousandth of their error. */
#define STIFF 1e5

static void assemble(assembly *m, const double *z) {
    const morph_balance *b = m->balance;
    for (int i = 0; i < b->rows; i++)
        add(m, i, i, b->hold, 0.0);
    for (int e = 0; e < b->energies; e++)
        add_element(m, &b->energy[e], z, 1.0, 0.0, 0.0, NULL);
    for (int e = 0; e < b->equalities; e++)
        add_element(m, &b->equality[e], z, -z[morph_balance_tau(b) + e], 0.0, STIFF, &m->out->equality[e]);
    for (int q = 0; q < b->limits.count; q++) {
        const double force = z[morph_balance_lambda(b) + q], c = morph_balance_limit_at(b, q, z);
        add_element(m, &b->limits.element[q], z, -b->limits.sign[q] * force, force / fmax(c, 1e-12), 0.0,
                    NULL);
    }
    for (int c = 0; c < b->centres; c++)
        for (int j = 0; j < b->coordinates / 3; j++) {
            morph_pull_jet pull;
            double d[3];
            if (b->row[3 * j] < 0) continue;
            morph_sub(&z[morph_balance_centre(b) + 3 * c], &z[3 * j], d);
            morph_pull_eval(d, b->softening, NULL, &pull);
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++)
                    add(m, b->row[3 * j + k], b->row[3 * j + l],
                        z[morph_balance_strength(b) + c] * pull.h[k][l], 0.0);
        }
}

/* The entries by columns, those of one place summed in the order in which they came. */
typedef struct columns {
    int *start, *row, *slot; /* slot: of a row in the column at hand, -1 elsewhere */
    double *stiffness, *sum;
    size_t *first;
    entry *sorted;
} columns;

static int ascending(const void *a, const void *b) {
    const int p = *(const int *)a, q = *(const int *)b;
    return (p > q) - (p < q);
}

static void gather(const assembly *m, columns *c) {
    const int n = m->balance->rows;
    for (size_t k = 0; k < m->count; k++)
        c->first[m->entries[k].column + 1]++;
    for (int j = 0; j < n; j++)
        c->first[j + 1] += c->first[j];
    for (size_t k = 0; k < m->count; k++)
        c->sorted[c->first[m->entries[k].column]++] = m->entries[k];
    int used = 0;
    for (int j = 0; j < n; j++) { /* first[j] is now where column j + 1 begins */
        const int begin = used;
        const size_t from = j > 0 ? c->first[j - 1] : 0;
        for (size_t k = from; k < c->first[j]; k++) {
            const int row = c->sorted[k].row;
            if (c->slot[row] < 0) {
                c->slot[row] = used;
                c->row[used++] = row;
            }
        }
        qsort(&c->row[begin], (size_t)(used - begin), sizeof *c->row, ascending);
        for (int i = begin; i < used; i++)
            c->slot[c->row[i]] = i;
        for (size_t k = from; k < c->first[j]; k++) {
            const int at = c->slot[c->sorted[k].row];
            c->stiffness[at] += c->sorted[k].stiffness;
            c->sum[at] += c->sorted[k].stiffness + c->sorted[k].penalty;
        }
        for (int i = begin; i < used; i++)
            c->slot[c->row[i]] = -1;
        c->start[j + 1] = used;
    }
}

/* Sums and factorises what was assembled. */
static morph_status factorise(assembly *m, bool *definite) {
    morph_stiffness *k = m->out;
    const size_t n = (size_t)k->rows;
    columns c = {.start = morph_alloc(n + 1, sizeof(int)),
                 .row = morph_alloc(m->count, sizeof(int)),
                 .slot = morph_alloc(n, sizeof(int)),
                 .stiffness = morph_alloc(m->count, sizeof(double)),
                 .sum = morph_alloc(m->count, sizeof(double)),
                 .first = morph_alloc(n + 1, sizeof(size_t)),
                 .sorted = morph_alloc(m->count, sizeof(entry))};
    morph_status status =
        !m->refused && c.start && c.row && c.slot && c.stiffness && c.sum && c.first && c.sorted
            ? MORPH_OK
            : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (size_t i = 0; i < n; i++)
            c.slot[i] = -1;
        gather(m, &c);
        status = morph_sparse_create(k->rows, c.start, c.row, &k->factor);
    }
    int column = -1;
    if (status == MORPH_OK) status = morph_sparse_factor(k->factor, c.sum, &column);
    *definite = status == MORPH_OK && column < 0;
    k->stiffness = c.stiffness;
    free(c.start);
    free(c.row);
    free(c.slot);
    free(c.sum);
    free(c.first);
    free(c.sorted);
    return status;
}

morph_status morph_stiffness_create(const morph_balance *b, const double *z, morph_stiffness **out,
                                    bool *definite) {
    *out = NULL;
    *definite = false;
    morph_stiffness *k = morph_alloc(1, sizeof *k);
    if (!k) return MORPH_ERR_NOMEM;
    *k = (morph_stiffness){.rows = b->rows, .equalities = b->equalities};
    k->equality = morph_alloc((size_t)b->equalities, sizeof *k->equality);
    k->f = morph_alloc((size_t)b->rows, sizeof *k->f);
    k->u = morph_alloc((size_t)b->rows, sizeof *k->u);
    k->g = morph_alloc((size_t)b->equalities, sizeof *k->g);
    morph_status status = k->equality && k->f && k->u && k->g ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        assembly m = {.balance = b, .out = k};
        assemble(&m, z);
        status = factorise(&m, definite);
        free(m.entries);
    }
    if (status != MORPH_OK) {
        morph_stiffness_destroy(k);
        return status;
    }
    *out = k;
    return MORPH_OK;
}

#define MOST_HOLD 100.0

morph_status morph_stiffness_raise_hold(morph_balance *b, const double *z, bool *definite) {
    for (bool weak = false;; weak = true) {
        morph_stiffness *k;
        const morph_status status = morph_stiffness_create(b, z, &k, definite);
        morph_stiffness_destroy(k);
        if (status != MORPH_OK || (*definite && !weak)) return status;
        if (b->hold >= MOST_HOLD) return MORPH_OK;
        b->hold = fmin(MOST_HOLD, fmax(1.0, 2.0 * b->hold));
        if (*definite) return MORPH_OK;
    }
}

void morph_stiffness_destroy(morph_stiffness *k) {
    if (!k) return;
    free(k->equality);
    free(k->stiffness);
    morph_sparse_destroy(k->factor);
    free(k->f);
    free(k->u);
    free(k->g);
    free(k);
}

static double across(const gradient *a, const double *u) {
    double sum = 0.0;
    for (int i = 0; i < a->count; i++)
        if (a->row[i] >= 0) sum += a->value[i] * u[a->row[i]];
    return sum;
}

static void add_along(const gradient *a, double factor, double *f) {
    for (int i = 0; i < a->count; i++)
        if (a->row[i] >= 0) f[a->row[i]] += factor * a->value[i];
}

static double largest(const double *v, int n, double most) {
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(v[i]));
    return most;
}

/* k->f = f - K u + A' sigma, k->g = g - A u; returns their largest entry relative to the terms. */
static double rest_of(morph_stiffness *k, const double *f, const double *g, const double *u,
                      const double *sigma) {
    morph_sparse_times(k->factor, k->stiffness, u, k->f);
    double scale = largest(k->f, k->rows, largest(f, k->rows, 0.0));
    if (g) scale = largest(g, k->equalities, scale);
    for (int i = 0; i < k->rows; i++)
        k->f[i] = f[i] - k->f[i];
    for (int e = 0; e < k->equalities; e++) {
        add_along(&k->equality[e], sigma[e], k->f);
        k->g[e] = (g ? g[e] : 0.0) - across(&k->equality[e], u);
    }
    const double worst = largest(k->g, k->equalities, largest(k->f, k->rows, 0.0));
    return scale > 0.0 ? worst / scale : 0.0;
}

/* Wanted of a solve, and steps at most: a few are usual; where contacts are as stiff as the penalty a step
 * leaves half of the error. */
#define ENOUGH 1e-10
enum { STEPS = 40 };

/* With what is left, f and g: (K + STIFF A'A) du = f + STIFF A' g, dsigma = STIFF (g - A du). Then K du -
 * A' dsigma = f holds, and of g there is dsigma / STIFF left. */
static morph_status step(morph_stiffness *k, double *u, double *sigma) {
    for (int e = 0; e < k->equalities; e++)
        add_along(&k->equality[e], STIFF * k->g[e], k->f);
    const morph_status status = morph_sparse_solve(k->factor, k->f, k->u, NULL);
    if (status != MORPH_OK) return status;
    for (int e = 0; e < k->equalities; e++)
        sigma[e] += STIFF * (k->g[e] - across(&k->equality[e], k->u));
    for (int i = 0; i < k->rows; i++)
        u[i] += k->u[i];
    return MORPH_OK;
}

morph_status morph_stiffness_solve(morph_stiffness *k, const double *f, const double *g, double *u,
                                   double *sigma, double *residual) {
    const size_t rows = (size_t)k->rows, equal = (size_t)k->equalities;
    double *own = morph_alloc(2 * rows + 2 * equal, sizeof *own);
    if (!own) return MORPH_ERR_NOMEM;
    double *at = own, *reaction = own + rows, *right = reaction + equal, *aim = right + rows;
    memcpy(right, f, rows * sizeof *f);
    if (g && equal > 0) memcpy(aim, g, equal * sizeof *g);
    morph_status status = MORPH_OK;
    double left = rest_of(k, right, aim, at, reaction), best = INFINITY;
    memset(u, 0, rows * sizeof *u);
    memset(sigma, 0, equal * sizeof *sigma);
    for (int i = 0, worse = 0; i < STEPS && status == MORPH_OK; i++) {
        status = step(k, at, reaction);
        if (status != MORPH_OK) break;
        left = rest_of(k, right, aim, at, reaction);
        if (!isfinite(left)) status = MORPH_ERR_NONFINITE;
        /* Rounding: what two steps do not improve is as good as it gets. */
        worse = left < best ? 0 : worse + 1;
        if (left < best) {
            best = left;
            memcpy(u, at, rows * sizeof *u);
            if (equal > 0) memcpy(sigma, reaction, equal * sizeof *sigma);
        }
        if (left <= 0.1 * ENOUGH || worse >= 2) break;
    }
    if (residual) *residual = best;
    free(own);
    return status;
}
