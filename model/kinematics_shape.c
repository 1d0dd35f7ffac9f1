/* The shape from lengths: damped Gauss-Newton on the rows of links, posts and panels, the lengths led from
 * those of the start to the given ones.
 *
 * With residuals r and their gradients J (lengths in spacings) each correction solves
 *     (J^T J + m I) dx = -J^T r,
 * which lies in the span of J's rows: of all corrections that do as much it is the shortest, so motions that
 * no length controls stay where they are (least motion), and redundant rows need no choice. */
#include "model/kinematics.h"
#include "model/kinematics_rows.h"
#include "solvers/dense.h"

#include <stdlib.h>
#include <string.h>

/* The largest relative change of a length in one stage. A stage is one motion followed to first order and
 * corrected: 5 % turns members by some hundredths of a radian, far from where shapes snap through. */
#define STAGE_STRAIN 0.05
/* Where the first way does not end in a fitting shape, finer ones are tried: 4 and 16 times the stages. */
enum { WAYS = 3, STAGE_ITERATIONS = 4, LAST_ITERATIONS = 60 };
/* Damping, against 1 for unit rows: from far away, and at least (rounding of the normal matrix is 1e-15: the
 * rigid motions and free ones, where it is singular, are then damped out and not divided by noise). */
#define DAMPING_FIRST 1e-4
#define DAMPING_LEAST 1e-11
#define DAMPING_MOST 1e6
/* Residuals that count as met: 1e-9 is what a shape is judged by; the solver goes on to rounding. */
#define FITS 1e-9
#define ROUNDING 1e-14

typedef struct solver {
    const morph_structure *s;
    int rows, columns;
    int *column;            /* joints */
    double *x;              /* 3*joints, now */
    double *trial;          /* 3*joints */
    double *first, *wanted; /* links: lengths at the start, and at this stage */
    double *normal, *step;  /* columns x columns; columns */
    double *kept;           /* J^T r of the point x */
    double *gram;           /* J^T J of the point x */
    double damping;
    int iterations;
} solver;

static void solver_free(solver *v) {
    free(v->column);
    free(v->x);
    free(v->trial);
    free(v->first);
    free(v->wanted);
    free(v->normal);
    free(v->step);
    free(v->kept);
    free(v->gram);
}

static morph_status solver_create(const morph_structure *s, solver *v) {
    const size_t n = 3 * (size_t)s->joints;
    *v = (solver){.s = s, .rows = morph_row_count(s), .damping = DAMPING_FIRST};
    v->column = morph_alloc((size_t)s->joints, sizeof(int));
    if (!v->column) return MORPH_ERR_NOMEM;
    v->columns = morph_free_columns(s, v->column);
    const size_t m = (size_t)v->columns;
    v->x = morph_alloc(n, sizeof(double));
    v->trial = morph_alloc(n, sizeof(double));
    v->first = morph_alloc((size_t)s->links, sizeof(double));
    v->wanted = morph_alloc((size_t)s->links, sizeof(double));
    v->normal = morph_alloc(m, m * sizeof(double));
    v->gram = morph_alloc(m, m * sizeof(double));
    v->step = morph_alloc(m, sizeof(double));
    v->kept = morph_alloc(m, sizeof(double));
    const bool ok = v->x && v->trial && v->first && v->wanted && v->normal && v->gram && v->step && v->kept;
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* Residual of a row and the factor that turns its gradient by x/spacing into that of the residual: lengths in
 * spacings; det[p, q, d] of panels over post length times spacing squared, near the panel's sine. */
static double residual(const solver *v, const double *x, int r, morph_row *row, double *factor) {
    const morph_structure *s = v->s;
    const double unit = s->spacing, value = morph_row_at(s, x, r, row);
    *factor = 1.0;
    if (r < s->links) return (value - v->wanted[r]) / unit;
    if (r < s->links + s->posts) return (value - s->post_length[r - s->links]) / unit;
    const double h = s->post_length[s->panel[r - s->links - s->posts][0]];
    *factor = 1.0 / (h * unit);
    return value / (h * unit * unit);
}

static double cost(const solver *v, const double *x) {
    double sum = 0.0;
    for (int r = 0; r < v->rows; r++) {
        morph_row row;
        double factor;
        const double c = residual(v, x, r, &row, &factor);
        sum += c * c;
    }
    return 0.5 * sum;
}

/* J^T J and J^T r at x. Returns the cost. */
static double assemble(solver *v) {
    const size_t n = (size_t)v->columns;
    double sum = 0.0;
    memset(v->gram, 0, n * n * sizeof(double));
    memset(v->kept, 0, n * sizeof(double));
    for (int r = 0; r < v->rows; r++) {
        morph_row row;
        double factor;
        const double c = residual(v, v->x, r, &row, &factor);
        sum += c * c;
        for (int a = 0; a < row.joints; a++) {
            const int ca = v->column[row.joint[a]];
            for (int k = 0; k < 3 && ca >= 0; k++) {
                const double g = factor * row.gradient[a][k];
                v->kept[ca + k] += g * c;
                for (int b = 0; b < row.joints; b++) {
                    const int cb = v->column[row.joint[b]];
                    for (int m = 0; m < 3 && cb >= 0; m++)
                        v->gram[(size_t)(ca + k) * n + (size_t)(cb + m)] += g * factor * row.gradient[b][m];
                }
            }
        }
    }
    return 0.5 * sum;
}

/* trial = x + dx at the present damping; size: the largest entry of dx. */
static morph_status try_step(solver *v, double *size) {
    const size_t n = (size_t)v->columns;
    memcpy(v->normal, v->gram, n * n * sizeof(double));
    for (size_t k = 0; k < n; k++) {
        v->normal[k * n + k] += v->damping;
        v->step[k] = -v->kept[k];
    }
    const morph_status status = morph_dense_solve(v->normal, v->columns, v->step, 1);
    if (status != MORPH_OK) return status;
    *size = 0.0;
    memcpy(v->trial, v->x, 3 * (size_t)v->s->joints * sizeof(double));
    for (int j = 0; j < v->s->joints; j++)
        for (int k = 0; k < 3 && v->column[j] >= 0; k++) {
            const double d = v->step[v->column[j] + k];
            v->trial[3 * j + k] += v->s->spacing * d;
            *size = fmax(*size, fabs(d));
        }
    return isfinite(*size) ? MORPH_OK : MORPH_ERR_NONFINITE;
}

/* Towards the lengths of this stage; a trial that does not lower the cost raises the damping. */
static morph_status descend(solver *v, int most) {
    double now = assemble(v), size = 1.0;
    for (int k = 0; k < most && sqrt(2.0 * now) > ROUNDING && v->damping < DAMPING_MOST; k++) {
        const morph_status status = try_step(v, &size);
        if (status != MORPH_OK) return status;
        v->iterations++;
        const double then = cost(v, v->trial);
        if (!(then < now)) {
            if (size < ROUNDING) break; /* nothing left but rounding */
            v->damping = fmin(10.0 * v->damping, DAMPING_MOST);
            continue;
        }
        double *swap = v->x;
        v->x = v->trial;
        v->trial = swap;
        v->damping = fmax(0.1 * v->damping, DAMPING_LEAST);
        now = assemble(v);
    }
    v->damping = fmin(v->damping, DAMPING_FIRST);
    return MORPH_OK;
}

static void set_wanted(solver *v, const double *lengths, double share) {
    for (int l = 0; l < v->s->links; l++)
        v->wanted[l] = share < 1.0 ? v->first[l] * pow(lengths[l] / v->first[l], share) : lengths[l];
}

static double misfit(const morph_structure *s, const morph_shape_report *report) {
    return fmax(report->length / s->spacing, fmax(report->post, report->panel));
}

/* Worst residuals at x, in the report's units. */
static void measure(const morph_structure *s, const double *lengths, const double *x,
                    morph_shape_report *out) {
    out->length = out->post = out->panel = 0.0;
    for (int r = 0; r < morph_row_count(s); r++) {
        morph_row row;
        const double value = morph_row_at(s, x, r, &row);
        if (r < s->links) {
            out->length = fmax(out->length, fabs(value - lengths[r]));
        } else if (r < s->links + s->posts) {
            out->post = fmax(out->post, fabs(value / s->post_length[r - s->links] - 1.0));
        } else {
            const int *p = s->panel[r - s->links - s->posts], *a = s->post[p[0]], *b = s->post[p[1]];
            const double size = morph_dist(&x[3 * a[0]], &x[3 * a[1]]) *
                                morph_dist(&x[3 * b[0]], &x[3 * b[1]]) *
                                morph_dist(&x[3 * a[0]], &x[3 * b[0]]);
            out->panel = fmax(out->panel, size > 0.0 ? fabs(value) / size : 0.0);
        }
    }
    out->fits = misfit(s, out) <= FITS;
}

static morph_status follow(solver *v, const double *lengths, const double *x_start, int stages) {
    memcpy(v->x, x_start, 3 * (size_t)v->s->joints * sizeof(double));
    v->damping = DAMPING_FIRST;
    morph_status status = MORPH_OK;
    for (int k = 1; k <= stages && status == MORPH_OK; k++) {
        set_wanted(v, lengths, (double)k / stages);
        status = descend(v, k < stages ? STAGE_ITERATIONS : LAST_ITERATIONS);
    }
    return status;
}

/* Stages for the largest change; MORPH_ERR_INPUT, MORPH_ERR_NONFINITE for unusable lengths. */
static morph_status plan_stages(const solver *v, const double *lengths, const double *x_start, int *stages) {
    double most = 0.0;
    for (int k = 0; k < 3 * v->s->joints; k++)
        if (!isfinite(x_start[k])) return MORPH_ERR_NONFINITE;
    morph_link_lengths(v->s, x_start, v->first);
    for (int l = 0; l < v->s->links; l++) {
        if (!isfinite(lengths[l]) || !(v->first[l] > 0.0)) return MORPH_ERR_NONFINITE;
        if (!(lengths[l] > 0.0)) return MORPH_ERR_INPUT;
        most = fmax(most, fabs(log(lengths[l] / v->first[l])));
    }
    /* Beyond 100 stages lengths are a thousand times off: no plan is. */
    *stages = (int)fmin(fmax(1.0, ceil(most / STAGE_STRAIN)), 100.0);
    return MORPH_OK;
}

morph_status morph_shape_from_lengths(const morph_structure *s, const double *lengths, const double *x_start,
                                      double *x_out, morph_shape_report *report) {
    const size_t bytes = 3 * (size_t)s->joints * sizeof(double);
    solver v;
    int stages = 1, tried = 0;
    double *best = morph_alloc(1, bytes);
    morph_shape_report found = {.length = INFINITY};
    morph_status status = solver_create(s, &v);
    if (!best) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = plan_stages(&v, lengths, x_start, &stages);
    for (int way = 0; way < WAYS && status == MORPH_OK && !found.fits; way++, stages *= 4) {
        morph_shape_report now = {.stages = stages};
        status = follow(&v, lengths, x_start, stages);
        if (status != MORPH_OK) break;
        measure(s, lengths, v.x, &now);
        tried = v.iterations;
        if (!(misfit(s, &now) < misfit(s, &found))) continue;
        found = now;
        memcpy(best, v.x, bytes);
    }
    if (status == MORPH_OK) {
        memcpy(x_out, best, bytes);
        found.iterations = tried;
        if (report) status = morph_mobility_at(s, x_out, &found.mobility);
        if (report && status == MORPH_OK) *report = found;
    }
    free(best);
    solver_free(&v);
    return status;
}
