#include "planner/timing_barrier.h"

#include <stdlib.h>
#include <string.h>

enum { BAND = MORPH_SPLINE_DEGREE, MOST_ITERATIONS = 80 };

/* Share of the way to the nearest row that a step may take: the rest keeps the iterates off the rows. */
static const double to_boundary = 0.99;

typedef struct barrier {
    const morph_timing_rows *rows;
    int n;
    double mu;
    double *x, *step, *trial, *gradient, *lagrangian;
    double (*band)[BAND + 1]; /* n: row i holds columns i - BAND .. i of the symmetric matrix */
    double *rate;             /* points: multipliers */
    double (*link)[4];        /* rows: multipliers of acceleration <= 1, >= -1, jerk <=, >= */
    double (*bound)[2];       /* n: of the control points' bounds */
    double complementarity;   /* largest |c z - mu| */
} barrier;

static void release(barrier *b) {
    free(b->x);
    free(b->step);
    free(b->trial);
    free(b->gradient);
    free(b->lagrangian);
    free(b->band);
    free(b->rate);
    free(b->link);
    free(b->bound);
}

static morph_status allocate(const morph_timing_rows *r, barrier *b) {
    const size_t n = (size_t)r->basis.count, points = (size_t)r->points;
    *b = (barrier){.rows = r, .n = r->basis.count};
    b->x = morph_alloc(n, sizeof(double));
    b->step = morph_alloc(n, sizeof(double));
    b->trial = morph_alloc(n, sizeof(double));
    b->gradient = morph_alloc(n, sizeof(double));
    b->lagrangian = morph_alloc(n, sizeof(double));
    b->band = morph_alloc(n, sizeof *b->band);
    b->rate = morph_alloc(points, sizeof(double));
    b->link = morph_alloc((size_t)r->begin[r->points], sizeof *b->link);
    b->bound = morph_alloc(n, sizeof *b->bound);
    const bool ok = b->x && b->step && b->trial && b->gradient && b->lagrangian && b->band && b->rate &&
                    b->link && b->bound;
    if (!ok) release(b);
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* c of the four rows of a link at (w, w', w''). */
static void link_rows(const double k[5], const double w[3], double root, double c[4]) {
    const double a = k[0] * w[0] + k[1] * w[1], j = k[2] * w[0] + k[3] * w[1] + k[4] * w[2];
    c[0] = 1.0 - a;
    c[1] = 1.0 + a;
    c[2] = root - j;
    c[3] = root + j;
}

/* Sums logarithms as the logarithm of products, which are kept within range: one call in many factors. */
typedef struct log_sum {
    double sum, product;
} log_sum;

static void add_log(log_sum *s, double factor) {
    s->product *= factor;
    if (s->product > 1e-100 && s->product < 1e100) return;
    s->sum += log(s->product);
    s->product = 1.0;
}

/* Time minus mu times the sum of the rows' logarithms; INFINITY where a row does not hold. */
static double merit(const barrier *b, const double *x) {
    const morph_timing_rows *r = b->rows;
    log_sum logs = {0.0, 1.0};
    double time = 0.0;
    for (int i = 0; i < b->n; i++) {
        if (!(x[i] > r->lower && x[i] < r->upper)) return INFINITY;
        add_log(&logs, (x[i] - r->lower) * (r->upper - x[i]));
    }
    for (int g = 0; g < r->points; g++) {
        double w[3], c[4];
        morph_timing_rows_at(r, g, x, w);
        const double root = 1.0 / sqrt(w[0]), rate = 1.0 - r->rate[g] * w[0];
        if (!(rate > 0.0)) return INFINITY;
        add_log(&logs, rate);
        time += r->share[g] * root;
        for (int n = r->begin[g]; n < r->begin[g + 1]; n++) {
            link_rows(r->link[n], w, root, c);
            /* Of two opposite rows at most one can fail, so products of pairs tell all. */
            const double acceleration = c[0] * c[1], jerk = c[2] * c[3];
            if (!(acceleration > 0.0 && jerk > 0.0)) return INFINITY;
            add_log(&logs, acceleration * jerk);
        }
    }
    return time - b->mu * (logs.sum + log(logs.product));
}

static void start_multipliers(barrier *b) {
    const morph_timing_rows *r = b->rows;
    for (int i = 0; i < b->n; i++) {
        b->bound[i][0] = b->mu / (b->x[i] - r->lower);
        b->bound[i][1] = b->mu / (r->upper - b->x[i]);
    }
    for (int g = 0; g < r->points; g++) {
        double w[3], c[4];
        morph_timing_rows_at(r, g, b->x, w);
        b->rate[g] = b->mu / (1.0 - r->rate[g] * w[0]);
        for (int n = r->begin[g]; n < r->begin[g + 1]; n++) {
            link_rows(r->link[n], w, 1.0 / sqrt(w[0]), c);
            for (int k = 0; k < 4; k++)
                b->link[n][k] = b->mu / c[k];
        }
    }
}

/* What the rows of one grid point add, by (w, w', w''): gradient of the merit, gradient of the Lagrangian,
 * lower triangle of the matrix. */
typedef struct local {
    double merit[3], lagrangian[3], h00, h10, h11, h20, h21, h22, jerk_multipliers;
} local;

/* A row with gradient a: -mu/c a, -z a and z/c a a'. */
static void add_row(barrier *b, local *o, double c, double z, double a0, double a1, double a2) {
    const double inverse = 1.0 / c, m = b->mu * inverse, h = z * inverse;
    o->merit[0] -= m * a0;
    o->merit[1] -= m * a1;
    o->merit[2] -= m * a2;
    o->lagrangian[0] -= z * a0;
    o->lagrangian[1] -= z * a1;
    o->lagrangian[2] -= z * a2;
    o->h00 += h * a0 * a0;
    o->h10 += h * a0 * a1;
    o->h11 += h * a1 * a1;
    o->h20 += h * a0 * a2;
    o->h21 += h * a1 * a2;
    o->h22 += h * a2 * a2;
    b->complementarity = fmax(b->complementarity, fabs(c * z - b->mu));
}

static local point_terms(barrier *b, int g, const double w[3]) {
    const morph_timing_rows *r = b->rows;
    local o = {0};
    const double root = 1.0 / sqrt(w[0]), slope = -0.5 * root / w[0], curvature = -1.5 * slope / w[0];
    for (int n = r->begin[g]; n < r->begin[g + 1]; n++) {
        const double *k = r->link[n], *z = b->link[n];
        double c[4];
        link_rows(k, w, root, c);
        add_row(b, &o, c[0], z[0], -k[0], -k[1], 0.0);
        add_row(b, &o, c[1], z[1], k[0], k[1], 0.0);
        add_row(b, &o, c[2], z[2], slope - k[2], -k[3], -k[4]);
        add_row(b, &o, c[3], z[3], slope + k[2], k[3], k[4]);
        o.jerk_multipliers += z[2] + z[3];
    }
    add_row(b, &o, 1.0 - r->rate[g] * w[0], b->rate[g], -r->rate[g], 0.0, 0.0);
    o.merit[0] += r->share[g] * slope;
    o.lagrangian[0] += r->share[g] * slope;
    /* The objective bends by share * curvature, the jerk rows by their multipliers the other way; a tenth of
     * the first always stays, so that the matrix is positive definite and the step leads down. */
    o.h00 += curvature * fmax(0.1 * r->share[g], r->share[g] - o.jerk_multipliers);
    return o;
}

static void assemble(barrier *b) {
    const morph_timing_rows *r = b->rows;
    memset(b->band, 0, (size_t)b->n * sizeof *b->band);
    b->complementarity = 0.0;
    for (int i = 0; i < b->n; i++) {
        const double lo = b->x[i] - r->lower, hi = r->upper - b->x[i], *z = b->bound[i];
        b->gradient[i] = b->mu / hi - b->mu / lo;
        b->lagrangian[i] = z[1] - z[0];
        b->band[i][BAND] = z[0] / lo + z[1] / hi;
        b->complementarity = fmax(b->complementarity, fmax(fabs(lo * z[0] - b->mu), fabs(hi * z[1] - b->mu)));
    }
    for (int g = 0; g < r->points; g++) {
        double w[3];
        morph_timing_rows_at(r, g, b->x, w);
        const local o = point_terms(b, g, w);
        const double(*v)[MORPH_SPLINE_ORDER] = (const double(*)[MORPH_SPLINE_ORDER])r->value[g];
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
            const int row = r->first[g] + i;
            for (int d = 0; d < 3; d++) {
                b->gradient[row] += v[d][i] * o.merit[d];
                b->lagrangian[row] += v[d][i] * o.lagrangian[d];
            }
            const double t0 = o.h00 * v[0][i] + o.h10 * v[1][i] + o.h20 * v[2][i];
            const double t1 = o.h10 * v[0][i] + o.h11 * v[1][i] + o.h21 * v[2][i];
            const double t2 = o.h20 * v[0][i] + o.h21 * v[1][i] + o.h22 * v[2][i];
            for (int j = 0; j <= i; j++)
                b->band[row][BAND - i + j] += t0 * v[0][j] + t1 * v[1][j] + t2 * v[2][j];
        }
    }
}

/* Banded Cholesky in place; false where a pivot is not positive. */
static bool factorise(barrier *b) {
    for (int i = 0; i < b->n; i++)
        for (int j = i - BAND < 0 ? 0 : i - BAND; j <= i; j++) {
            double sum = b->band[i][BAND + j - i];
            for (int k = i - BAND < 0 ? 0 : i - BAND; k < j; k++)
                sum -= b->band[i][BAND + k - i] * b->band[j][BAND + k - j];
            if (j < i) {
                b->band[i][BAND + j - i] = sum / b->band[j][BAND];
            } else {
                if (!(sum > 0.0)) return false;
                b->band[i][BAND] = sqrt(sum);
            }
        }
    return true;
}

static void solve_step(barrier *b) {
    double *y = b->step;
    for (int i = 0; i < b->n; i++) {
        double sum = -b->gradient[i];
        for (int k = i - BAND < 0 ? 0 : i - BAND; k < i; k++)
            sum -= b->band[i][BAND + k - i] * y[k];
        y[i] = sum / b->band[i][BAND];
    }
    for (int i = b->n - 1; i >= 0; i--) {
        double sum = y[i];
        for (int k = i + 1; k < b->n && k <= i + BAND; k++)
            sum -= b->band[k][BAND + i - k] * y[k];
        y[i] = sum / b->band[i][BAND];
    }
}

/* Longest step along which c stays positive by its tangent (slope: change of c over the full step). */
static double ratio(double longest, double c, double slope) {
    return longest * -slope > to_boundary * c ? to_boundary * c / -slope : longest;
}

/* One visit to every row along the step: finds the longest primal and dual steps, or (move) moves the
 * multipliers by the dual one. */
typedef struct visit {
    bool move;
    double mu, primal, dual;
} visit;

static void visit_row(visit *v, double c, double slope, double *z) {
    const double change = v->mu / c - *z - *z / c * slope;
    if (v->move) {
        *z += v->dual * change;
        return;
    }
    v->primal = ratio(v->primal, c, slope);
    v->dual = ratio(v->dual, *z, change);
}

static void visit_rows(barrier *b, visit *v) {
    const morph_timing_rows *r = b->rows;
    for (int i = 0; i < b->n; i++) {
        visit_row(v, b->x[i] - r->lower, b->step[i], &b->bound[i][0]);
        visit_row(v, r->upper - b->x[i], -b->step[i], &b->bound[i][1]);
    }
    for (int g = 0; g < r->points; g++) {
        double w[3], dw[3];
        morph_timing_rows_at(r, g, b->x, w);
        morph_timing_rows_at(r, g, b->step, dw);
        const double root = 1.0 / sqrt(w[0]), slope = -0.5 * root / w[0] * dw[0];
        visit_row(v, 1.0 - r->rate[g] * w[0], -r->rate[g] * dw[0], &b->rate[g]);
        for (int n = r->begin[g]; n < r->begin[g + 1]; n++) {
            const double *k = r->link[n];
            double c[4], *z = b->link[n];
            link_rows(k, w, root, c);
            const double a = k[0] * dw[0] + k[1] * dw[1], j = k[2] * dw[0] + k[3] * dw[1] + k[4] * dw[2];
            visit_row(v, c[0], -a, &z[0]);
            visit_row(v, c[1], a, &z[1]);
            visit_row(v, c[2], slope - j, &z[2]);
            visit_row(v, c[3], slope + j, &z[3]);
        }
    }
}

/* Moves x and the multipliers; false where no step leads down any more. */
static bool advance(barrier *b) {
    visit v = {.mu = b->mu, .primal = 1.0, .dual = 1.0};
    visit_rows(b, &v);
    double descent = 0.0;
    for (int i = 0; i < b->n; i++)
        descent += b->gradient[i] * b->step[i];
    const double here = merit(b, b->x);
    double alpha = v.primal;
    bool found = false;
    /* Armijo's rule with the usual 1e-4; after 20 halvings the step is rounding. The slack of 1e-12 is the
     * rounding of the merit itself (of order 1). */
    for (int k = 0; k < 20 && !found; k++) {
        for (int i = 0; i < b->n; i++)
            b->trial[i] = b->x[i] + alpha * b->step[i];
        found = merit(b, b->trial) <= here + 1e-4 * alpha * descent + 1e-12;
        if (!found) alpha *= 0.5;
    }
    if (!found) return false;
    v.move = true;
    visit_rows(b, &v);
    memcpy(b->x, b->trial, (size_t)b->n * sizeof *b->x);
    return true;
}

static double largest(const double *x, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* All rows together then cost 1e-4 of the duration at most (1e-8 times some ten thousand of them; those that
 * matter are some hundreds). */
static const double last_mu = 1e-8;

morph_status morph_timing_barrier(const morph_timing_rows *rows, double mu, const morph_control *control,
                                  double *x, int *iterations, bool *converged) {
    barrier b;
    morph_status status = allocate(rows, &b);
    *converged = false;
    if (status != MORPH_OK) return status;
    memcpy(b.x, x, (size_t)b.n * sizeof *x);
    b.mu = mu;
    start_multipliers(&b);
    /* A start outside has no logarithms to lower: it stays as it is. */
    const bool inside = isfinite(merit(&b, b.x));
    for (int k = 0; k < MOST_ITERATIONS && inside && !*converged; k++) {
        if (morph_stopped(control)) {
            status = MORPH_ERR_STOPPED;
            break;
        }
        assemble(&b);
        /* Errors of ten times mu are close enough to go on with a smaller one (superlinearly in the end). */
        while (fmax(largest(b.lagrangian, b.n), b.complementarity) <= 10.0 * b.mu && b.mu > last_mu) {
            b.mu = fmax(last_mu, fmin(0.2 * b.mu, pow(b.mu, 1.5)));
            assemble(&b);
        }
        *converged = b.mu <= last_mu && fmax(largest(b.lagrangian, b.n), b.complementarity) <= 10.0 * b.mu;
        if (*converged || !factorise(&b)) break;
        solve_step(&b);
        ++*iterations;
        if (!advance(&b)) break;
    }
    memcpy(x, b.x, (size_t)b.n * sizeof *x);
    release(&b);
    return status;
}

morph_status morph_timing_merit(const morph_timing_rows *rows, double mu, const double *x, double *value,
                                double *gradient) {
    barrier b;
    const morph_status status = allocate(rows, &b);
    if (status != MORPH_OK) return status;
    memcpy(b.x, x, (size_t)b.n * sizeof *x);
    b.mu = mu;
    start_multipliers(&b);
    assemble(&b);
    *value = merit(&b, x);
    memcpy(gradient, b.gradient, (size_t)b.n * sizeof *gradient);
    release(&b);
    return MORPH_OK;
}
