/* Smooth signed distance: tensor product cubic B-spline.
 *
 * Interpolation: along each axis the coefficients c of the uniform cubic B-spline obey
 *     (c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i],
 * with natural ends (second derivative 0): c[0] = f[0], c[-1] = 2 c[0] - c[1], likewise at the other end. A
 * distance is nearly linear away from its surface, so the natural end costs little; and a natural spline goes
 * on straight with continuous second derivatives, which the extension below needs.
 *
 * Outside the box: with r the signed excess of a coordinate over the box and
 *     u(r) = r^3 / (r^2 + w^2),      w = 2 cells,
 * the point is pulled back by u to within one cell of the box, and the length pulled is added:
 *     phi(p) = spline(p - u) + |u|.
 * u and its first two derivatives are 0 at the box, so phi is C2 across the border and everywhere else; far
 * away u(r) - r -> 0 and phi grows like the distance to the box. Since |u| never exceeds the way back to the
 * box by more than one cell, phi overestimates the distance by at most (about) the triangle inequality's
 * slack. */
#include "model/sdf.h"

#include "model/distance_internal.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

struct morph_sdf {
    int n[3];                     /* nodes */
    double lo[3], hi[3], cell[3]; /* cell: exact spacing per axis */
    double inverse[3];            /* 1 / cell */
    double width;                 /* w above */
    size_t stride[2];             /* of x and y in `c`; z is 1 */
    double *c;                    /* (n[0]+2)(n[1]+2)(n[2]+2) coefficients, one beyond each end */
};

/* A grid needs 4 nodes for its spline; beyond 2^30 nodes (8 GiB) the request is a mistake. */
enum { MIN_NODES = 4 };
static const double MAX_NODES = 1073741824.0;

void morph_sdf_destroy(morph_sdf *sdf) {
    if (!sdf) return;
    free(sdf->c);
    free(sdf);
}

static size_t node_index(const morph_sdf *s, int i, int j, int k) {
    return (size_t)(i + 1) * s->stride[0] + (size_t)(j + 1) * s->stride[1] + (size_t)(k + 1);
}

/* Far from the surface the distance is smooth but for its ridges, and nobody needs it to the last digit:
 * nodes further than NEAR cells are interpolated between exact ones STRIDE cells apart. The search from a far
 * node costs most (many triangles are almost equally near), so this takes most of the time away. The error is
 * about (STRIDE cell)^2 / 8 times the field's curvature, 1/(NEAR cell) at most: a quarter of a cell. */
enum { STRIDE = 4, NEAR = 8 };

typedef struct sampler {
    morph_sdf *s;
    const morph_distance *exact;
    int hint; /* the closest triangle of one node starts the search of the next with a bound only a cell too
                 large */
} sampler;

static morph_status sample_node(sampler *w, int i, int j, int k) {
    morph_sdf *s = w->s;
    double *at = &s->c[node_index(s, i, j, k)];
    if (!isnan(*at)) return MORPH_OK;
    const double p[3] = {s->lo[0] + i * s->cell[0], s->lo[1] + j * s->cell[1], s->lo[2] + k * s->cell[2]};
    morph_nearest nearest = {.squared = INFINITY};
    morph_closest c;
    morph_tree_nearest(w->exact, p, w->hint, &nearest);
    if (nearest.slot < 0) return MORPH_ERR_NONFINITE;
    morph_nearest_finish(w->exact, p, &nearest, &c);
    w->hint = nearest.slot;
    *at = c.distance;
    return MORPH_OK;
}

static int coarse_count(int n) {
    return (n - 2) / STRIDE + 2;
}

/* Node of a coarse index: every STRIDE-th, and the last. */
static int coarse_node(int index, int n) {
    const int node = index * STRIDE;
    return node < n ? node : n - 1;
}

static morph_status sample_coarse(sampler *w, const morph_control *control) {
    const int *n = w->s->n, m[3] = {coarse_count(n[0]), coarse_count(n[1]), coarse_count(n[2])};
    for (int i = 0; i < m[0]; i++)
        for (int jj = 0; jj < m[1]; jj++) {
            const int j = i % 2 ? m[1] - 1 - jj : jj;
            if (morph_stopped(control)) return MORPH_ERR_STOPPED;
            for (int kk = 0; kk < m[2]; kk++) {
                const int k = (i * m[1] + jj) % 2 ? m[2] - 1 - kk : kk;
                const morph_status status =
                    sample_node(w, coarse_node(i, n[0]), coarse_node(j, n[1]), coarse_node(k, n[2]));
                if (status != MORPH_OK) return status;
            }
        }
    return MORPH_OK;
}

/* One coarse block between nodes lo and hi: exact inside where the surface may come near, else (fill)
 * interpolated. */
static morph_status sample_block(sampler *w, const int lo[3], const int hi[3], bool fill) {
    morph_sdf *s = w->s;
    double corner[8], least = INFINITY, diagonal = 0.0;
    for (int c = 0; c < 8; c++) {
        corner[c] = s->c[node_index(s, c & 1 ? hi[0] : lo[0], c & 2 ? hi[1] : lo[1], c & 4 ? hi[2] : lo[2])];
        least = fmin(least, fabs(corner[c]));
    }
    for (int k = 0; k < 3; k++)
        diagonal += pow((hi[k] - lo[k]) * s->cell[k], 2.0);
    const double cell = fmax(s->cell[0], fmax(s->cell[1], s->cell[2]));
    const bool near = least < NEAR * cell + 0.5 * sqrt(diagonal);
    if (near == fill) return MORPH_OK;
    for (int i = lo[0]; i <= hi[0]; i++)
        for (int j = lo[1]; j <= hi[1]; j++)
            for (int k = lo[2]; k <= hi[2]; k++) {
                double *at = &s->c[node_index(s, i, j, k)];
                if (near) {
                    const morph_status status = sample_node(w, i, j, k);
                    if (status != MORPH_OK) return status;
                } else if (isnan(*at)) {
                    const double t[3] = {(double)(i - lo[0]) / (hi[0] - lo[0]),
                                         (double)(j - lo[1]) / (hi[1] - lo[1]),
                                         (double)(k - lo[2]) / (hi[2] - lo[2])};
                    double sum = 0.0;
                    for (int c = 0; c < 8; c++)
                        sum += corner[c] * (c & 1 ? t[0] : 1.0 - t[0]) * (c & 2 ? t[1] : 1.0 - t[1]) *
                               (c & 4 ? t[2] : 1.0 - t[2]);
                    *at = sum;
                }
            }
    return MORPH_OK;
}

static morph_status sample(morph_sdf *s, const morph_distance *exact, const morph_control *control) {
    sampler w = {s, exact, -1};
    for (int i = 0; i < s->n[0]; i++)
        for (int j = 0; j < s->n[1]; j++)
            for (int k = 0; k < s->n[2]; k++)
                s->c[node_index(s, i, j, k)] = NAN; /* not there yet */
    morph_status status = sample_coarse(&w, control);
    const int m[3] = {coarse_count(s->n[0]), coarse_count(s->n[1]), coarse_count(s->n[2])};
    /* Near blocks first, so that a node shared with a far block is exact. */
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i + 1 < m[0] && status == MORPH_OK; i++) {
            for (int j = 0; j + 1 < m[1] && status == MORPH_OK; j++)
                for (int k = 0; k + 1 < m[2] && status == MORPH_OK; k++) {
                    const int lo[3] = {coarse_node(i, s->n[0]), coarse_node(j, s->n[1]),
                                       coarse_node(k, s->n[2])};
                    const int hi[3] = {coarse_node(i + 1, s->n[0]), coarse_node(j + 1, s->n[1]),
                                       coarse_node(k + 1, s->n[2])};
                    status = sample_block(&w, lo, hi, pass == 1);
                }
            if (morph_stopped(control)) return MORPH_ERR_STOPPED;
            morph_progress(control, "distance grid", 0.5 * (pass + (double)(i + 1) / m[0]));
        }
    return status;
}

/* Solves the tridiagonal system above in place for one line of n values (Thomas algorithm: diagonally
 * dominant, no pivoting) and fills the two coefficients beyond its ends. factor: n numbers, see factors. */
static void filter_line(double *c, size_t step, int n, const double *factor) {
    /* Forward: c[i] = (6 f[i] - c[i-1]) m[i], m[i] = 1/(4 - m[i-1]), m[0] = 0 as c[0] = f[0]. */
    for (int i = 1; i + 1 < n; i++)
        c[(size_t)i * step] = (6 * c[(size_t)i * step] - c[(size_t)(i - 1) * step]) * factor[i];
    for (int i = n - 2; i > 0; i--)
        c[(size_t)i * step] -= factor[i] * c[(size_t)(i + 1) * step];
    c[-(ptrdiff_t)step] = 2 * c[0] - c[step];
    c[(size_t)n * step] = 2 * c[(size_t)(n - 1) * step] - c[(size_t)(n - 2) * step];
}

static morph_status prefilter(morph_sdf *s) {
    int longest = s->n[0];
    for (int k = 1; k < 3; k++)
        longest = s->n[k] > longest ? s->n[k] : longest;
    double *factor = morph_alloc((size_t)longest, sizeof *factor);
    if (!factor) return MORPH_ERR_NOMEM;
    for (int i = 1; i < longest; i++)
        factor[i] = 1 / (4 - factor[i - 1]);
    /* Later axes also filter the coefficients that earlier ones put beyond the ends. */
    for (int i = 0; i < s->n[0]; i++)
        for (int j = 0; j < s->n[1]; j++)
            filter_line(s->c + node_index(s, i, j, 0), 1, s->n[2], factor);
    for (int i = 0; i < s->n[0]; i++)
        for (int k = -1; k <= s->n[2]; k++)
            filter_line(s->c + node_index(s, i, 0, k), s->stride[1], s->n[1], factor);
    for (int j = -1; j <= s->n[1]; j++)
        for (int k = -1; k <= s->n[2]; k++)
            filter_line(s->c + node_index(s, 0, j, k), s->stride[0], s->n[0], factor);
    free(factor);
    return MORPH_OK;
}

static morph_status build(morph_sdf *s, const morph_distance *exact, const double lo[3], const double hi[3],
                          double cell, const morph_control *control) {
    double total = 1;
    for (int k = 0; k < 3; k++) {
        const double cells = ceil((hi[k] - lo[k]) / cell * (1 - 4 * DBL_EPSILON));
        total *= fmax(cells, MIN_NODES - 1) + 3;
        if (!(total < MAX_NODES)) return MORPH_ERR_NOMEM;
        s->n[k] = (int)fmax(cells, MIN_NODES - 1) + 1;
        s->cell[k] = (hi[k] - lo[k]) / (s->n[k] - 1);
        s->inverse[k] = 1 / s->cell[k];
        s->lo[k] = lo[k];
        s->hi[k] = hi[k];
        s->width = fmax(s->width, 2 * s->cell[k]);
    }
    s->stride[1] = (size_t)s->n[2] + 2;
    s->stride[0] = s->stride[1] * ((size_t)s->n[1] + 2);
    s->c = morph_alloc(s->stride[0] * ((size_t)s->n[0] + 2), sizeof *s->c);
    if (!s->c) return MORPH_ERR_NOMEM;
    const morph_status status = sample(s, exact, control);
    return status == MORPH_OK ? prefilter(s) : status;
}

morph_status morph_sdf_create(const morph_distance *exact, const double lo[3], const double hi[3],
                              double cell, const morph_control *control, morph_sdf **out) {
    *out = NULL;
    if (!(cell > 0) || !isfinite(cell)) return MORPH_ERR_INPUT;
    for (int k = 0; k < 3; k++)
        if (!(hi[k] > lo[k]) || !isfinite(hi[k]) || !isfinite(lo[k])) return MORPH_ERR_INPUT;
    morph_sdf *s = calloc(1, sizeof *s);
    if (!s) return MORPH_ERR_NOMEM;
    const morph_status status = build(s, exact, lo, hi, cell, control);
    if (status != MORPH_OK) {
        morph_sdf_destroy(s);
        return status;
    }
    *out = s;
    return MORPH_OK;
}

/* Two numbers side by side, each with the same operations as alone. */
typedef double two __attribute__((vector_size(16)));

/* Where coordinate x lies on an axis: u cells from the second of 4 neighbouring coefficients, of which the
 * first's index is returned. Sets their weights for the value and its derivative. *beyond: past the ends. */
static inline size_t axis_cell(const morph_sdf *s, int axis, double x, double *at, double *beyond,
                               double w[2][4]) {
    const double inverse = s->inverse[axis];
    const double t = (x - s->lo[axis]) * inverse, last = s->n[axis] - 1;
    const double inside = t < 0 ? 0 : t > last ? last : t;
    int i = (int)inside;
    if (i > s->n[axis] - 2) i = s->n[axis] - 2;
    const double u = inside - i, v = 1 - u;
    const two vu = {v, u}, outer = vu * vu * vu / 6, inner = (4 + vu * vu * (3 * vu - 6)) / 6;
    *at = u;
    *beyond = t - inside;
    w[0][0] = outer[0];
    w[0][1] = inner[1];
    w[0][2] = inner[0];
    w[0][3] = outer[1];
    w[1][0] = -v * v / 2;
    w[1][1] = u * (1.5 * u - 2);
    w[1][2] = -v * (1.5 * v - 2);
    w[1][3] = u * u / 2;
    return (size_t)i;
}

/* Inside the box. */
static inline size_t slope_weights(const morph_sdf *s, int axis, double x, double w[2][4]) {
    double at, beyond;
    const size_t i = axis_cell(s, axis, x, &at, &beyond, w);
    for (int m = 0; m < 4; m++)
        w[1][m] *= s->inverse[axis];
    return i;
}

/* Also beyond it, straight on, and with the second derivative, which is 0 there. */
static size_t axis_weights(const morph_sdf *s, int axis, double x, double w[3][4]) {
    const double inverse = s->inverse[axis];
    double u, beyond;
    const size_t i = axis_cell(s, axis, x, &u, &beyond, w);
    w[2][0] = 1 - u;
    w[2][1] = 3 * u - 2;
    w[2][2] = 3 * (1 - u) - 2;
    w[2][3] = u;
    for (int m = 0; m < 4; m++) {
        if (beyond != 0) {
            w[0][m] += beyond * w[1][m];
            w[2][m] = 0;
        }
        w[1][m] *= inverse;
        w[2][m] *= inverse * inverse;
    }
    return i;
}

/* The spline at p, straight on beyond the box: contracted along z, then y, then x; each step keeps the
 * derivatives that the result needs. out: value, x, y, z, xx, xy, xz, yy, yz, zz. */
static void spline(const morph_sdf *s, const double p[3], double out[10]) {
    double wx[3][4], wy[3][4], wz[3][4];
    const size_t ix = axis_weights(s, 0, p[0], wx), iy = axis_weights(s, 1, p[1], wy),
                 iz = axis_weights(s, 2, p[2], wz);
    const double *c = s->c + ix * s->stride[0] + iy * s->stride[1] + iz;
    memset(out, 0, 10 * sizeof *out);
    for (int a = 0; a < 4; a++) {
        double f = 0, fy = 0, fz = 0, fyy = 0, fyz = 0, fzz = 0;
        const double *plane = c + (size_t)a * s->stride[0];
        for (int b = 0; b < 4; b++) {
            const double *q = plane + (size_t)b * s->stride[1];
            const double v = wz[0][0] * q[0] + wz[0][1] * q[1] + wz[0][2] * q[2] + wz[0][3] * q[3];
            const double vz = wz[1][0] * q[0] + wz[1][1] * q[1] + wz[1][2] * q[2] + wz[1][3] * q[3];
            const double vzz = wz[2][0] * q[0] + wz[2][1] * q[1] + wz[2][2] * q[2] + wz[2][3] * q[3];
            f += wy[0][b] * v;
            fy += wy[1][b] * v;
            fyy += wy[2][b] * v;
            fz += wy[0][b] * vz;
            fyz += wy[1][b] * vz;
            fzz += wy[0][b] * vzz;
        }
        out[0] += wx[0][a] * f;
        out[1] += wx[1][a] * f;
        out[2] += wx[0][a] * fy;
        out[3] += wx[0][a] * fz;
        out[4] += wx[2][a] * f;
        out[5] += wx[1][a] * fy;
        out[6] += wx[1][a] * fz;
        out[7] += wx[0][a] * fyy;
        out[8] += wx[0][a] * fyz;
        out[9] += wx[0][a] * fzz;
    }
}

/* Coefficients k of two rows side by side. */
static inline two of_rows(const double *q, const double *r, int k) {
    return (two){q[k], r[k]};
}

/* Along z, for rows q and r. */
static inline two along(const double w[4], const two c[4]) {
    return w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3];
}

/* The value alone, inside the box. */
static double spline_value(const morph_sdf *s, const double p[3]) {
    double wx[2][4], wy[2][4], wz[2][4], sum = 0, at, beyond;
    const size_t ix = axis_cell(s, 0, p[0], &at, &beyond, wx), iy = axis_cell(s, 1, p[1], &at, &beyond, wy),
                 iz = axis_cell(s, 2, p[2], &at, &beyond, wz);
    const double *q = s->c + ix * s->stride[0] + iy * s->stride[1] + iz;
    const size_t row = s->stride[1];
    for (int a = 0; a < 4; a++, q += s->stride[0]) {
        double f = 0;
#pragma GCC unroll 2
        for (int b = 0; b < 4; b += 2) {
            const double *r = q + (size_t)b * row;
            const two c[4] = {of_rows(r, r + row, 0), of_rows(r, r + row, 1), of_rows(r, r + row, 2),
                              of_rows(r, r + row, 3)};
            const two v = along(wz[0], c);
            f += wy[0][b] * v[0];
            f += wy[0][b + 1] * v[1];
        }
        sum += wx[0][a] * f;
    }
    return sum;
}

/* Value and gradient alone, inside the box: half the work. out: value, x, y, z. */
static void spline_gradient(const morph_sdf *s, const double p[3], double out[4]) {
    double wx[2][4], wy[2][4], wz[2][4];
    const size_t ix = slope_weights(s, 0, p[0], wx), iy = slope_weights(s, 1, p[1], wy),
                 iz = slope_weights(s, 2, p[2], wz);
    const double *q = s->c + ix * s->stride[0] + iy * s->stride[1] + iz;
    const size_t row = s->stride[1];
    double value = 0, gx = 0, gy = 0, gz = 0;
    for (int a = 0; a < 4; a++, q += s->stride[0]) {
        double f = 0, fy = 0, fz = 0;
#pragma GCC unroll 2
        for (int b = 0; b < 4; b += 2) {
            const double *r = q + (size_t)b * row;
            const two c[4] = {of_rows(r, r + row, 0), of_rows(r, r + row, 1), of_rows(r, r + row, 2),
                              of_rows(r, r + row, 3)};
            const two v = along(wz[0], c), vz = along(wz[1], c);
            f += wy[0][b] * v[0];
            fy += wy[1][b] * v[0];
            fz += wy[0][b] * vz[0];
            f += wy[0][b + 1] * v[1];
            fy += wy[1][b + 1] * v[1];
            fz += wy[0][b + 1] * vz[1];
        }
        value += wx[0][a] * f;
        gx += wx[1][a] * f;
        gy += wx[0][a] * fy;
        gz += wx[0][a] * fz;
    }
    out[0] = value;
    out[1] = gx;
    out[2] = gy;
    out[3] = gz;
}

/* u(r) = r^3/(r^2 + w^2) = r - w^2 r/q, q = r^2 + w^2:
 *     u' = 1 - w^2 (w^2 - r^2)/q^2,    u'' = 2 w^2 r (3 w^2 - r^2)/q^3.
 * In units of w. Beyond 1e6 widths u = r to 12 digits, and r^2 could overflow. */
static void pull(double r, double width, double u[3]) {
    const double rho = r / width;
    if (!(fabs(rho) < 1e6)) {
        u[0] = r;
        u[1] = 1;
        u[2] = 0;
        return;
    }
    const double square = rho * rho, q = square + 1;
    u[0] = width * rho * square / q;
    u[1] = 1 - (1 - square) / (q * q);
    u[2] = 2 * rho * (3 - square) / (q * q * q) / width;
}

/* Outside the box, with v = p - u, U = |u|:
 *     phi_k  = s_k (1 - u_k') + u_k u_k'/U
 *     phi_kl = s_kl (1 - u_k')(1 - u_l') - d_kl s_k u_k''
 *              + [d_kl (u_k'^2 + u_k u_k'') - (u_k u_k')(u_l u_l')/U^2] / U. */
static double extended(const morph_sdf *s, const double p[3], double *g, double *h) {
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    double u[3][3], q[3], f[10], scale = 0, sum = 0;
    for (int k = 0; k < 3; k++) {
        const double r = p[k] < s->lo[k] ? p[k] - s->lo[k] : p[k] > s->hi[k] ? p[k] - s->hi[k] : 0;
        const double border = p[k] < s->lo[k] ? s->lo[k] : s->hi[k];
        pull(r, s->width, u[k]);
        q[k] = r != 0 ? border + (r - u[k][0]) : p[k];
        scale = fmax(scale, fabs(u[k][0]));
    }
    spline(s, q, f);
    /* Scaled, so that tiny excesses do not underflow and huge ones do not overflow. */
    for (int k = 0; scale > 0 && k < 3; k++)
        sum += u[k][0] / scale * (u[k][0] / scale);
    const double length = scale * sqrt(sum);
    double unit[3] = {0};
    for (int k = 0; k < 3; k++)
        if (length > 0) unit[k] = u[k][0] / length;
    for (int k = 0; g && k < 3; k++)
        g[k] = f[1 + k] * (1 - u[k][1]) + unit[k] * u[k][1];
    for (int m = 0; h && m < 6; m++) {
        const int k = row[m], l = column[m];
        h[m] = f[4 + m] * (1 - u[k][1]) * (1 - u[l][1]);
        if (length > 0) h[m] -= unit[k] * u[k][1] * (unit[l] * u[l][1]) / length;
        if (k != l) continue;
        h[m] += (unit[k] - f[1 + k]) * u[k][2];
        if (length > 0) h[m] += u[k][1] * (u[k][1] / length);
    }
    return f[0] + length;
}

double morph_sdf_eval(const morph_sdf *sdf, const double p[3], double *g, double *h) {
    for (int k = 0; k < 3; k++)
        if (!(p[k] >= sdf->lo[k] && p[k] <= sdf->hi[k])) return extended(sdf, p, g, h);
    if (!g && !h) return spline_value(sdf, p);
    double f[10];
    if (!h) {
        spline_gradient(sdf, p, f);
        memcpy(g, f + 1, 3 * sizeof *g);
        return f[0];
    }
    spline(sdf, p, f);
    if (g) memcpy(g, f + 1, 3 * sizeof *g);
    if (h) memcpy(h, f + 4, 6 * sizeof *h);
    return f[0];
}

/* Knuth's 64-bit linear congruential generator: the same points on every machine. */
static double next_random(unsigned long long *state) {
    *state = *state * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*state >> 11) / 9007199254740992.0;
}

/* A point within `band` above a random triangle, by area where triangles differ moderately (rejection, at
 * most 32 tries, so that a single huge triangle cannot stall it). */
static void random_near(const morph_distance *exact, double largest, double band, unsigned long long *state,
                        double p[3]) {
    const morph_facet *f = NULL;
    for (int tries = 0; tries < 32; tries++) {
        f = &exact->facet[(int)(next_random(state) * exact->mesh.triangles)];
        if (morph_norm(f->normal) >= largest * next_random(state)) break;
    }
    double a = next_random(state), b = next_random(state);
    if (a + b > 1) {
        a = 1 - a;
        b = 1 - b;
    }
    const double height = band * next_random(state), norm = morph_norm(f->normal);
    for (int k = 0; k < 3; k++) {
        p[k] = (1 - a - b) * f->corner[0][k] + a * f->corner[1][k] + b * f->corner[2][k];
        if (norm > 0) p[k] += height * f->normal[k] / norm;
    }
}

void morph_sdf_measure(const morph_sdf *sdf, const morph_distance *exact, double band,
                       morph_sdf_accuracy *out) {
    enum { POINTS = 10000, TRIES = 20 * POINTS };
    unsigned long long state = 20240229;
    double largest = 0, sum = 0;
    *out = (morph_sdf_accuracy){.cell = sdf->width / 2, .band = band};
    memcpy(out->nodes, sdf->n, sizeof out->nodes);
    for (int i = 0; i < exact->mesh.triangles; i++)
        largest = fmax(largest, morph_norm(exact->facet[i].normal));
    int points = 0;
    for (int tries = 0; tries < TRIES && points < POINTS; tries++) {
        double p[3];
        morph_closest c;
        random_near(exact, largest, band, &state, p);
        if (morph_box_squared(sdf->lo, sdf->hi, p) > 0) continue;
        morph_distance_point(exact, p, &c);
        if (!(c.distance >= 0 && c.distance <= band)) continue;
        const double error = fabs(morph_sdf_eval(sdf, p, NULL, NULL) - c.distance);
        out->max = fmax(out->max, error);
        sum += error * error;
        points++;
    }
    if (points > 0) out->rms = sqrt(sum / points);
}
