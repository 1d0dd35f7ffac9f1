/* How near to the shortest a plan's duration is: bench_duration [--cells] FOLDER ... reads plan folders and
 * prints of each, for the path as recorded, rest to rest,
 *   - single: what the slowest link alone needs (closed form; no path at all does better);
 *   - no jerk: the shortest time without jerk limits, rates and accelerations only, by a backward and a
 *     forward pass over an even grid of s. Up to the grid this is the optimum of that problem, and so a bound
 *     from below for the one with jerk; given on two grids;
 *   - dense: the shortest time found with all three limits, by a search of its own (below), on ever finer
 *     grids from several starts: as it stands on its nodes, and, in parentheses, stretched by what a grid
 *     eight times finer shows, which makes it feasible. With --cells also from what a search over cells of
 *     states finds (cells.h; half a minute), to see that no start has missed a better valley;
 *   - plan: the recorded duration, and its ratio to the best of the feasible ones.
 *
 * The search: nodes s_0 = 0 .. s_n = 1 are fixed, so L', L'' and L''' there are numbers. Unknown are speed v
 * and acceleration a of s at the nodes, and time h and jerk j of every interval:
 *     minimise sum h   subject to   v h + a h^2/2 + j h^3/6 = ds,   v+ = v + a h + j h^2/2,   a+ = a + j h,
 *     |L' v| <= rate,  |L'' v^2 + L' a| <= acceleration,  |L''' v^3 + 3 L'' v a + L' j| <= jerk
 * at each node for every link, with the j of both its sides: a jerk that may jump at every node, where the
 * product's profile is a spline of some dozens of control points with a continuous jerk. Rows start with the
 * links that may bind and are added where they are broken. Solved by Ipopt; then nodes are moved to even
 * times of the result, twice as many, and so on.
 */
#include "cells.h"
#include "recorded.h"
#include "without_jerk.h"

#include "planner/timing_bound.h"
#include "planner/timing_rows.h"
#include "solvers/nlp.h"

/* ---- dense search ---- */

/* Pieces of the first level and so many levels; points to a piece for the stretch. */
enum { LEVELS = 3, COARSE = 75, FINER = 8 };

/* Nodes at even times of a function of time in [0, 1]: s and its first two derivatives by time. */
typedef void (*time_function)(const void *data, double tau, double s[3]);

static bool sampled(time_function f, const void *data, int n, double duration, profile *out) {
    if (!profile_create(n, out)) return false;
    for (int i = 0; i <= n; i++) {
        double s[3];
        f(data, (double)i / n, s);
        out->s[i] = i == n ? 1.0 : s[0];
        out->v[i] = s[1] / duration;
        out->a[i] = s[2] / (duration * duration);
        out->h[i] = duration / n;
    }
    for (int i = 0; i < n; i++)
        out->j[i] = (out->a[i + 1] - out->a[i]) / out->h[i];
    return true;
}

/* The quintic over a warped time g = t + k t (1 - t) + w sin(4 pi t) / (4 pi): early, late, uneven starts. */
typedef struct warp {
    double k, w;
} warp;
static void warped(const void *data, double t, double s[3]) {
    const warp *q = data;
    const double pi = acos(-1.0), c = 4.0 * pi * t;
    const double g = t + q->k * t * (1.0 - t) + q->w * sin(c) / (4.0 * pi);
    const double g1 = 1.0 + q->k * (1.0 - 2.0 * t) + q->w * cos(c);
    const double g2 = -2.0 * q->k - q->w * 4.0 * pi * sin(c);
    const double f1 = 30.0 * g * g * (1.0 - g) * (1.0 - g), f2 = 60.0 * g * (1.0 - g) * (1.0 - 2.0 * g);
    s[0] = g * g * g * (10.0 - 15.0 * g + 6.0 * g * g);
    s[1] = f1 * g1;
    s[2] = f2 * g1 * g1 + f1 * g2;
}

/* An earlier result, run anew. */
static void again(const void *data, double tau, double s[3]) {
    const profile *p = data;
    double t = tau * profile_time(p), out[4];
    const double T = profile_time(p);
    int i = 0;
    while (i + 1 < p->n && t > p->h[i])
        t -= p->h[i++];
    profile_at(p, i, fmin(t, p->h[i]), out);
    s[0] = out[0];
    s[1] = out[1] * T;
    s[2] = out[2] * T * T;
}

static void recorded_profile(const void *data, double tau, double s[3]) {
    const morph_timing *timing = data;
    double out[4];
    morph_timing_eval(timing, tau * timing->duration, out);
    s[0] = out[0];
    s[1] = out[1] * timing->duration;
    s[2] = out[2] * timing->duration * timing->duration;
}

/* A limit at a node, over the limit. kind 0: k0 v^2 + k1 a; 1, 2: k0 v^3 + 3 k1 v a + k2 j with the jerk
 * after or before the node. */
typedef struct limit {
    int node, link, kind;
    double k[3];
} limit;

typedef struct dense {
    const profile *p;
    double unit;   /* s: time is in units of the start's duration */
    double *scale; /* 4 (n + 1): v, a, h, j of each node and the piece after it */
    double *vmost; /* n + 1 */
    double *by_s;  /* (n + 1) x 3 x links: L', L'', L''' */
    int links;
    const morph_structure *structure;
    limit *row;
    int rows, capacity;
    bool *have; /* (n + 1) x 3 x links */
} dense;

static double at(const dense *d, const double *x, int i, int what) {
    return x[4 * i + what] * d->scale[4 * i + what];
}

static morph_status time_value(void *data, const double *x, double *f) {
    const dense *d = data;
    f[0] = 0.0;
    for (int i = 0; i < d->p->n; i++)
        f[0] += at(d, x, i, 2);
    return MORPH_OK;
}
static morph_status time_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const dense *d = data;
    (void)x;
    (void)weight;
    for (int i = 0; i < d->p->n; i++)
        morph_sink_jacobian(sink, 0, 4 * i + 2, d->scale[4 * i + 2]);
    return MORPH_OK;
}

/* What the three rows of a piece are divided by: distance, speed and acceleration of their own size. */
static void piece_size(const dense *d, int i, double size[3]) {
    size[0] = d->p->s[i + 1] - d->p->s[i];
    size[1] = fmax(d->scale[4 * i], d->scale[4 * i + 4]);
    size[2] = fmax(d->scale[4 * i + 1], d->scale[4 * i + 5]);
}

static morph_status motion_value(void *data, const double *x, double *f) {
    const dense *d = data;
    for (int i = 0; i < d->p->n; i++) {
        const double v = at(d, x, i, 0), a = at(d, x, i, 1), h = at(d, x, i, 2), j = at(d, x, i, 3);
        double size[3];
        piece_size(d, i, size);
        f[3 * i] = h * (v + h * (a / 2.0 + h * j / 6.0)) / size[0] - 1.0;
        f[3 * i + 1] = (v + h * (a + h * j / 2.0) - at(d, x, i + 1, 0)) / size[1];
        f[3 * i + 2] = (a + h * j - at(d, x, i + 1, 1)) / size[2];
    }
    return MORPH_OK;
}
static morph_status motion_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const dense *d = data;
    for (int i = 0; i < d->p->n; i++) {
        const double v = at(d, x, i, 0), a = at(d, x, i, 1), h = at(d, x, i, 2), j = at(d, x, i, 3);
        const double *c = &d->scale[4 * i];
        double size[3];
        piece_size(d, i, size);
        /* By v, a, h, j of the piece. */
        const double first[3][4] = {{h, h * h / 2.0, v + h * (a + h * j / 2.0), h * h * h / 6.0},
                                    {1.0, h, a + h * j, h * h / 2.0},
                                    {0.0, 1.0, j, h}};
        /* By hh, hv, ha, hj: all others vanish. */
        const double second[3][4] = {
            {a + h * j, 1.0, h, h * h / 2.0}, {j, 0.0, 1.0, h}, {0.0, 0.0, 0.0, 1.0}};
        for (int r = 0; r < 3; r++) {
            const int row = 3 * i + r;
            for (int k = 0; k < 4; k++)
                morph_sink_jacobian(sink, row, 4 * i + k, first[r][k] * c[k] / size[r]);
            if (r > 0) morph_sink_jacobian(sink, row, 4 * i + 3 + r, -c[3 + r] / size[r]);
            if (!morph_sink_wants_hessian(sink)) continue;
            static const int other[4] = {2, 0, 1, 3};
            for (int k = 0; k < 4; k++)
                morph_sink_hessian(sink, 4 * i + 2, 4 * i + other[k],
                                   weight[row] * second[r][k] * c[2] * c[other[k]] / size[r]);
        }
    }
    return MORPH_OK;
}

/* Where the jerk of a limit's row stands. */
static int jerk_piece(const limit *l) {
    return l->kind == 1 ? l->node : l->node - 1;
}

static double limit_value(const dense *d, const limit *l, const double *x) {
    const double v = at(d, x, l->node, 0), a = at(d, x, l->node, 1);
    if (l->kind == 0) return l->k[0] * v * v + l->k[1] * a;
    return l->k[0] * v * v * v + 3.0 * l->k[1] * v * a + l->k[2] * at(d, x, jerk_piece(l), 3);
}

static morph_status limits_value(void *data, const double *x, double *f) {
    const dense *d = data;
    for (int r = 0; r < d->rows; r++)
        f[r] = limit_value(d, &d->row[r], x);
    return MORPH_OK;
}
static morph_status limits_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const dense *d = data;
    for (int r = 0; r < d->rows; r++) {
        const limit *l = &d->row[r];
        const int n = 4 * l->node;
        const double v = at(d, x, l->node, 0), a = at(d, x, l->node, 1), cv = d->scale[n],
                     ca = d->scale[n + 1];
        if (l->kind == 0) {
            morph_sink_jacobian(sink, r, n, 2.0 * l->k[0] * v * cv);
            morph_sink_jacobian(sink, r, n + 1, l->k[1] * ca);
            if (morph_sink_wants_hessian(sink))
                morph_sink_hessian(sink, n, n, weight[r] * 2.0 * l->k[0] * cv * cv);
            continue;
        }
        const int j = 4 * jerk_piece(l) + 3;
        morph_sink_jacobian(sink, r, n, 3.0 * (l->k[0] * v * v + l->k[1] * a) * cv);
        morph_sink_jacobian(sink, r, n + 1, 3.0 * l->k[1] * v * ca);
        morph_sink_jacobian(sink, r, j, l->k[2] * d->scale[j]);
        if (!morph_sink_wants_hessian(sink)) continue;
        morph_sink_hessian(sink, n, n, weight[r] * 6.0 * l->k[0] * v * cv * cv);
        morph_sink_hessian(sink, n, n + 1, weight[r] * 3.0 * l->k[1] * cv * ca);
    }
    return MORPH_OK;
}

/* A link's limit at a node, in units of d->unit; false where there is no such row. */
static bool make_limit(const dense *d, int node, int link, int kind, limit *out) {
    if ((kind == 1 && node == d->p->n) || (kind == 2 && node == 0)) return false;
    const double *q = &d->by_s[(size_t)node * 3 * (size_t)d->links + (size_t)link];
    const double one = q[0], two = q[d->links], three = q[2 * d->links], u = d->unit;
    *out = (limit){.node = node, .link = link, .kind = kind};
    const double m = kind == 0 ? 1.0 / (u * u * d->structure->acceleration_limit[link])
                               : 1.0 / (u * u * u * d->structure->jerk_limit[link]);
    out->k[0] = m * (kind == 0 ? two : three);
    out->k[1] = m * (kind == 0 ? one : two);
    out->k[2] = m * one;
    return true;
}

static bool add_limit(dense *d, const limit *l) {
    bool *have = &d->have[((size_t)l->node * 3 + (size_t)l->kind) * (size_t)d->links + (size_t)l->link];
    if (*have) return true;
    if (d->rows == d->capacity) {
        const int capacity = 2 * d->capacity + 1024;
        limit *larger = realloc(d->row, (size_t)capacity * sizeof *larger);
        if (!larger) return false;
        d->row = larger;
        d->capacity = capacity;
    }
    d->row[d->rows++] = *l;
    *have = true;
    return true;
}

/* Rows that x breaks by more than a ten-thousandth. Returns how many, -1 without memory. */
static int add_broken(dense *d, const double *x) {
    const int before = d->rows;
    for (int i = 0; i <= d->p->n; i++)
        for (int kind = 0; kind < 3; kind++)
            for (int l = 0; l < d->links; l++) {
                limit row;
                if (!make_limit(d, i, l, kind, &row)) continue;
                if (fabs(limit_value(d, &row, x)) > 1.0 + 1e-4 && !add_limit(d, &row)) return -1;
            }
    return d->rows - before;
}

/* To begin with, of each kind and node the links whose coefficients are largest. */
static bool add_first(dense *d) {
    for (int i = 0; i <= d->p->n; i++)
        for (int kind = 0; kind < 3; kind++)
            for (int c = 0; c < (kind == 0 ? 2 : 3); c++) {
                limit best = {.node = -1}, row;
                for (int l = 0; l < d->links; l++)
                    if (make_limit(d, i, l, kind, &row) &&
                        (best.node < 0 || fabs(row.k[c]) > fabs(best.k[c])))
                        best = row;
                if (best.node >= 0 && !add_limit(d, &best)) return false;
            }
    return true;
}

/* Numbers of the nodes, and sizes of the unknowns: those of the start. Near rest v, a and j go with t^2, t
 * and 1, so a is measured by v over the time to the nearer end. */
static bool dense_create(morph_path_table *table, const profile *p, dense *d) {
    const morph_structure *s = table->curve->structure;
    const size_t nodes = (size_t)p->n + 1, links = (size_t)s->links;
    *d = (dense){.p = p, .unit = profile_time(p), .links = s->links, .structure = s};
    d->scale = morph_alloc(4 * nodes, sizeof(double));
    d->vmost = morph_alloc(nodes, sizeof(double));
    d->by_s = morph_alloc(nodes * 3 * links, sizeof(double));
    d->have = morph_alloc(nodes * 3 * links, sizeof(bool));
    if (!d->scale || !d->vmost || !d->by_s || !d->have) return false;
    double t = 0.0;
    for (int i = 0; i <= p->n; i++) {
        const int k = i == 0 ? 1 : i == p->n ? p->n - 1 : i;
        const double h = p->h[i < p->n ? i : p->n - 1] / d->unit, near = fmax(h, fmin(t, 1.0 - t));
        const double v = fmax(p->v[k] * d->unit, 1e-12);
        const double c[4] = {v, 2.0 * v / near, h, 2.0 * v / (near * near)};
        memcpy(&d->scale[4 * i], c, sizeof c);
        t += h;
        morph_path_table_exact(table, p->s[i], 3);
        memcpy(&d->by_s[(size_t)i * 3 * links], table->exact + links, 3 * links * sizeof(double));
        double worst = 1e-12;
        for (size_t l = 0; l < links; l++)
            worst = fmax(worst, fabs(table->exact[links + l]) / (d->unit * s->rate_limit[l]));
        d->vmost[i] = 1.0 / worst;
    }
    return add_first(d);
}

static void dense_free(dense *d) {
    free(d->scale);
    free(d->vmost);
    free(d->by_s);
    free(d->have);
    free(d->row);
}

/* Unknowns and their bounds from the start. Rest at both ends; the last node has no piece after it. */
static void unknowns(const dense *d, double *x, double *lower, double *upper) {
    const profile *p = d->p;
    const double u = d->unit;
    for (int i = 0; i <= p->n; i++) {
        const double value[4] = {p->v[i] * u, p->a[i] * u * u, p->h[i] / u, p->j[i] * u * u * u};
        const bool last = i == p->n, end = i == 0 || last;
        for (int k = 0; k < 4; k++) {
            const int m = 4 * i + k;
            const bool held = k < 2 ? end : last;
            x[m] = held ? 0.0 : value[k] / d->scale[m];
            lower[m] = held ? 0.0 : -INFINITY;
            upper[m] = held ? 0.0 : INFINITY;
        }
        if (!end) {
            lower[4 * i] = 0.0;
            upper[4 * i] = d->vmost[i] / d->scale[4 * i];
        }
        if (!last) {
            lower[4 * i + 2] = 0.02;
            upper[4 * i + 2] = 50.0;
        }
    }
}

/* Says so where a derivative is not that of its row. */
static void check_derivatives(const dense *d, const morph_block *blocks, const double *x) {
    morph_derivative_check check;
    /* Rows and unknowns are scaled to order 1: a step of 1e-5 leaves about 1e-9 of error. */
    if (morph_check_derivatives(blocks, 3, x, 4 * (d->p->n + 1), 1e-5, 1e-6, &check) != MORPH_OK ||
        !check.passed)
        fprintf(stderr, "dense search: wrong derivative: %s\n", check.message);
}

/* One solve with the rows at hand, from x to x. */
static bool dense_solve(dense *d, const double *lower, const double *upper, double *x, morph_outcome *outcome,
                        int *iterations) {
    const int n = 4 * (d->p->n + 1), equalities = 3 * d->p->n;
    double *zero = morph_alloc((size_t)equalities, sizeof *zero);
    double *low = morph_alloc((size_t)d->rows, sizeof *low),
           *high = morph_alloc((size_t)d->rows, sizeof *high);
    morph_nlp *nlp = NULL;
    morph_nlp_result r = {0};
    char message[256] = "";
    bool ok = zero && low && high;
    for (int i = 0; i < d->rows && ok; i++) {
        low[i] = -1.0;
        high[i] = 1.0;
    }
    const morph_block blocks[] = {
        {"time", 0, n, NULL, NULL, NULL, d, time_value, time_walk, NULL},
        {"motion", equalities, n, NULL, zero, zero, d, motion_value, motion_walk, NULL},
        {"limit", d->rows, n, NULL, low, high, d, limits_value, limits_walk, NULL}};
    ok = ok && morph_nlp_create(n, x, lower, upper, blocks, 3, message, sizeof message, &nlp) == MORPH_OK;
    if (ok && d->p->n == COARSE) check_derivatives(d, blocks, x);
    morph_nlp_options o = morph_nlp_defaults();
    o.tolerance = 1e-6;
    o.violation_tolerance = 1e-6;
    o.max_iterations = 400;
    ok = ok && morph_nlp_solve(nlp, x, &o, &r) == MORPH_OK;
    if (ok) {
        memcpy(x, r.x, (size_t)n * sizeof *x);
        *outcome = r.outcome;
        *iterations += r.iterations;
    } else {
        fprintf(stderr, "dense search: no result. %s\n", message);
    }
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
    free(zero);
    free(low);
    free(high);
    return ok;
}

/* The shortest time on p's nodes, from p, which it replaces. False where it fails or is not feasible on the
 * nodes. */
static bool shorten(morph_path_table *table, profile *p, int *iterations) {
    dense d;
    const size_t n = 4 * ((size_t)p->n + 1);
    bool ok = dense_create(table, p, &d);
    double *x = morph_alloc(3 * n, sizeof *x), *lower = x + n, *upper = x + 2 * n;
    morph_outcome outcome = MORPH_STOPPED;
    ok = ok && x;
    if (ok) unknowns(&d, x, lower, upper);
    for (int pass = 0, added = 1; pass < 12 && ok && added > 0; pass++) {
        ok = dense_solve(&d, lower, upper, x, &outcome, iterations);
        if (ok) added = add_broken(&d, x);
        ok = ok && added >= 0;
    }
    ok = ok && (outcome == MORPH_OPTIMAL || outcome == MORPH_FEASIBLE);
    for (int i = 0; i <= p->n && ok; i++) {
        const double u = d.unit;
        p->v[i] = at(&d, x, i, 0) / u;
        p->a[i] = at(&d, x, i, 1) / (u * u);
        p->h[i] = at(&d, x, i, 2) * u;
        if (i < p->n) p->j[i] = at(&d, x, i, 3) / (u * u * u);
    }
    free(x);
    dense_free(&d);
    return ok;
}

/* ---- what is printed ---- */

typedef struct found {
    double nodes, feasible; /* s: as solved, and stretched to hold every limit between nodes too */
} found;

/* From one start through all levels, each with twice the pieces at even times of the result before. */
static bool search(morph_path_table *table, time_function f, const void *data, int levels, found *out) {
    profile p, next;
    int iterations = 0;
    if (!sampled(f, data, COARSE, 1.0, &p)) return false;
    bool ok = true;
    for (int k = 0; k < levels && ok; k++) {
        if (k > 0) {
            ok = sampled(again, &p, 2 * p.n, profile_time(&p), &next);
            profile_free(&p);
            if (!ok) return false;
            p = next;
        }
        /* A twentieth slower: the start stands inside its limits. */
        slow_down(&p, 1.05 * stretch(table, &p, 1));
        ok = shorten(table, &p, &iterations);
        out[k] = (found){profile_time(&p), profile_time(&p) * stretch(table, &p, FINER)};
    }
    profile_free(&p);
    return ok;
}

/* Searches from one start; the shortest that is feasible, and the shortest on the finest nodes. */
static void try_start(morph_path_table *table, const char *name, time_function f, const void *data,
                      int levels, found *best) {
    found level[LEVELS];
    const bool ok = search(table, f, data, levels, level);
    printf("  dense from %s:", name);
    for (int n = 0; n < levels && ok; n++) {
        printf(" %d: %.4f (%.4f)", COARSE << n, level[n].nodes, level[n].feasible);
        best->feasible = fmin(best->feasible, level[n].feasible);
    }
    /* Coarse nodes leave much out between them. */
    if (ok && levels == LEVELS) best->nodes = fmin(best->nodes, level[LEVELS - 1].nodes);
    printf("%s\n", ok ? "" : " failed");
    fflush(stdout);
}

static void try_cells(morph_path_table *table, found *best) {
    profile p;
    double time = NAN;
    const double began = morph_seconds();
    const bool ok = search_cells(table, &p, &time);
    printf("  over cells: %.4f, as coarse as they are; took %.1f s\n", time, morph_seconds() - began);
    if (!ok) return;
    try_start(table, "the cells' way", again, &p, LEVELS - 1, best);
    profile_free(&p);
}

/* All starts to the second level; the plainest, and the plan's own, to the last. */
static found try_all(morph_path_table *table, const morph_timing *own, bool cells) {
    static const warp start[] = {{0.0, 0.0}, {0.6, 0.0}, {-0.6, 0.0}, {0.0, 0.7}};
    static const char *const name[] = {"a smooth profile", "an early one", "a late one", "an uneven one"};
    found best = {INFINITY, INFINITY};
    for (int k = 0; k < 4; k++)
        try_start(table, name[k], warped, &start[k], k == 0 ? LEVELS : LEVELS - 1, &best);
    if (cells) try_cells(table, &best);
    try_start(table, "the plan's profile", recorded_profile, own, LEVELS, &best);
    return best;
}

static int run(const char *folder, bool cells) {
    recorded r;
    morph_path_table table;
    if (!recorded_read(folder, &r)) return 1;
    double single = 0.0;
    int link = -1;
    const bool ok = morph_timing_single_link(r.curve, &single, &link) == MORPH_OK &&
                    morph_path_table_create(r.curve, &table) == MORPH_OK;
    if (ok) {
        const double began = morph_seconds(), T = r.timing.duration;
        const double bound[2] = {without_jerk(&table, 2001), without_jerk(&table, 8001)};
        printf("%s: %d links, plan %.3f s\n", folder, r.structure->links, T);
        printf("  single link %.4f s; without jerk %.4f s on 2001 points, %.4f s on 8001\n", single, bound[0],
               bound[1]);
        const found best = try_all(&table, &r.timing, cells);
        printf(
            "= %s single %.4f, no jerk %.4f, dense %.4f on nodes, %.4f, plan %.4f: ratio %.4f, to nodes "
            "%.4f, to single %.4f; %.1f s\n",
            folder, single, bound[1], best.nodes, best.feasible, T, T / best.feasible, T / best.nodes,
            T / single, morph_seconds() - began);
        morph_path_table_free(&table);
    }
    recorded_free(&r);
    return ok ? 0 : 1;
}

int main(int count, char **folders) {
    morph_blas_threads(1);
    const bool cells = count > 1 && strcmp(folders[1], "--cells") == 0;
    int failed = 0;
    if (count < (cells ? 3 : 2)) printf("bench_duration [--cells] FOLDER ...: plan folders\n");
    for (int k = cells ? 2 : 1; k < count; k++)
        failed |= run(folders[k], cells);
    return failed;
}
