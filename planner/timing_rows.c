/* Each row is u^k R_k(z) / limit with z = (s, s', s'', s''') linear in the control points and R_k a sum of
 * monomials whose factor is a derivative of L at s: R_1 = L1 s1,   R_2 = L2 s1^2 + L1 s2,   R_3 = L3 s1^3 + 3
 * L2 s1 s2 + L1 s3 so every derivative by z is again such a sum, with L's order raised for each derivative by
 * s. */
#include "planner/timing_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

morph_status morph_path_table_create(const morph_curve *curve, morph_path_table *out) {
    const morph_structure *s = curve->structure;
    *out = (morph_path_table){.curve = curve};
    out->scratch = morph_alloc(MORPH_JET * 6 * (size_t)s->posts, sizeof(double));
    out->joints = morph_alloc(MORPH_JET * 3 * (size_t)s->joints, sizeof(double));
    out->exact = morph_alloc(MORPH_JET * (size_t)s->links, sizeof(double));
    out->by_time = morph_alloc(4 * (size_t)s->links, sizeof(double));
    if (out->scratch && out->joints && out->exact && out->by_time) return MORPH_OK;
    morph_path_table_free(out);
    return MORPH_ERR_NOMEM;
}

void morph_path_table_free(morph_path_table *t) {
    free(t->scratch);
    free(t->joints);
    free(t->exact);
    free(t->by_time);
    *t = (morph_path_table){0};
}

void morph_path_table_exact(morph_path_table *t, double s, int order) {
    morph_curve_joints(t->curve, s, order, t->scratch, t->joints);
    morph_curve_lengths(t->curve->structure, t->joints, order, t->exact);
}

typedef struct monomial {
    double factor;
    int length;   /* order of the derivative of L */
    int power[3]; /* of s1, s2, s3 */
} monomial;
static const monomial terms[3][3] = {{{1.0, 1, {1, 0, 0}}},
                                     {{1.0, 2, {2, 0, 0}}, {1.0, 1, {0, 1, 0}}},
                                     {{1.0, 3, {3, 0, 0}}, {3.0, 2, {1, 1, 0}}, {1.0, 1, {0, 0, 1}}}};
static const int term_count[3] = {1, 2, 3};

static double falling_power(double x, int power, int times) {
    double v = 1.0;
    for (int i = 0; i < times; i++)
        v *= power - i;
    for (int i = 0; i < power - times; i++)
        v *= x;
    return times > power ? 0.0 : v;
}

/* d^(n0+n1+n2+n3) R_kind / ds^n0 ds1^n1 ds2^n2 ds3^n3; l: derivatives of L, spaced by `stride`. */
static double partial(int kind, const double *l, int stride, const double z[4], const int n[4]) {
    double sum = 0.0;
    for (int t = 0; t < term_count[kind]; t++) {
        const monomial *m = &terms[kind][t];
        double v = m->factor * l[(m->length + n[0]) * stride];
        for (int i = 0; i < 3; i++)
            v *= falling_power(z[i + 1], m->power[i], n[i + 1]);
        sum += v;
    }
    return sum;
}

static double limit_of(const morph_timing_rows *r, int kind, int link) {
    const morph_structure *s = r->table->curve->structure;
    const double limit = kind == 0   ? s->rate_limit[link]
                         : kind == 1 ? s->acceleration_limit[link]
                                     : s->jerk_limit[link];
    return limit * pow(r->duration, kind + 1);
}

static void profile_at(const morph_timing_rows *r, int point, const double *x, double z[4]) {
    for (int d = 0; d < 4; d++) {
        z[d] = 0.0;
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++)
            z[d] += r->value[point][d][i] * x[r->first[point] + i];
    }
}

/* Length derivatives at a point's present s, computed once per x. */
static const double *lengths_at(morph_timing_rows *r, int point, double s) {
    const size_t block = MORPH_JET * (size_t)r->table->curve->structure->links;
    double *own = &r->lengths[(size_t)point * block];
    if (r->at[point] != s) {
        morph_path_table_exact(r->table, s, MORPH_JET - 1);
        memcpy(own, r->table->exact, block * sizeof *own);
        r->at[point] = s;
    }
    return own;
}

static morph_status limits_value(void *data, const double *x, double *f) {
    morph_timing_rows *r = data;
    const double u = x[r->controls];
    static const int none[4];
    for (int n = 0; n < r->count; n++) {
        const morph_timing_row *row = &r->row[n];
        double z[4];
        profile_at(r, row->point, x, z);
        const double *l = lengths_at(r, row->point, z[0]) + row->link;
        f[n] = pow(u, row->kind + 1) * partial(row->kind, l, r->table->curve->structure->links, z, none) /
               limit_of(r, row->kind, row->link);
    }
    return MORPH_OK;
}

/* First and second derivatives of one row by (s, s', s'', s''', u). */
static void row_derivatives(const morph_timing_rows *r, const morph_timing_row *row, const double *l,
                            const double z[4], double u, double g[5], double h[5][5]) {
    const int stride = r->table->curve->structure->links, k = row->kind + 1;
    const double scale = 1.0 / limit_of(r, row->kind, row->link), uk = pow(u, k);
    const int none[4] = {0};
    const double value = partial(row->kind, l, stride, z, none);
    for (int a = 0; a < 4; a++) {
        int n[4] = {0};
        n[a] = 1;
        const double first = partial(row->kind, l, stride, z, n);
        g[a] = scale * uk * first;
        h[a][4] = h[4][a] = scale * k * pow(u, k - 1) * first;
        for (int b = 0; b < 4; b++) {
            int m[4] = {0};
            m[a]++;
            m[b]++;
            h[a][b] = scale * uk * partial(row->kind, l, stride, z, m);
        }
    }
    g[4] = scale * k * pow(u, k - 1) * value;
    h[4][4] = scale * k * (k - 1) * pow(u, k - 2) * value;
}

static morph_status limits_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    morph_timing_rows *r = data;
    const double u = x[r->controls];
    enum { LOCAL = MORPH_SPLINE_ORDER + 1 };
    for (int n = 0; n < r->count; n++) {
        const morph_timing_row *row = &r->row[n];
        double z[4], g[5], h[5][5], map[5][LOCAL] = {{0.0}};
        int index[LOCAL];
        profile_at(r, row->point, x, z);
        row_derivatives(r, row, lengths_at(r, row->point, z[0]) + row->link, z, u, g, h);
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
            index[i] = r->first[row->point] + i;
            for (int d = 0; d < 4; d++)
                map[d][i] = r->value[row->point][d][i];
        }
        index[LOCAL - 1] = r->controls;
        map[4][LOCAL - 1] = 1.0;
        for (int i = 0; i < LOCAL; i++) {
            double first = 0.0;
            for (int d = 0; d < 5; d++)
                first += map[d][i] * g[d];
            if (morph_sink_wants_jacobian(sink)) morph_sink_jacobian(sink, n, index[i], first);
            for (int j = 0; j <= i && morph_sink_wants_hessian(sink); j++) {
                double second = 0.0;
                for (int d = 0; d < 5; d++)
                    for (int e = 0; e < 5; e++)
                        second += map[d][i] * map[e][j] * h[d][e];
                morph_sink_hessian(sink, index[i], index[j], weight[n] * second);
            }
        }
    }
    return MORPH_OK;
}

static void limits_describe(void *data, int row, char *text, size_t size) {
    const morph_timing_rows *r = data;
    static const char *const kind[3] = {"rate", "acceleration", "jerk"};
    char link[64];
    morph_link_name(r->table->curve->structure, r->row[row].link, link, sizeof link);
    snprintf(text, size, "%s of %s at %.3f of the duration", kind[r->row[row].kind], link,
             (double)r->row[row].point / (r->points - 1));
}

/* Rising control points make s rise. */
static morph_status steps_value(void *data, const double *x, double *f) {
    const morph_timing_rows *r = data;
    for (int j = 0; j + 1 < r->controls; j++)
        f[j] = x[j + 1] - x[j];
    return MORPH_OK;
}

static morph_status steps_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    (void)x;
    (void)weight;
    const morph_timing_rows *r = data;
    for (int j = 0; j + 1 < r->controls && morph_sink_wants_jacobian(sink); j++) {
        morph_sink_jacobian(sink, j, j + 1, 1.0);
        morph_sink_jacobian(sink, j, j, -1.0);
    }
    return MORPH_OK;
}

static morph_status speed_value(void *data, const double *x, double *f) {
    f[0] = -x[((const morph_timing_rows *)data)->controls];
    return MORPH_OK;
}

static morph_status speed_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    (void)x;
    (void)weight;
    if (morph_sink_wants_jacobian(sink))
        morph_sink_jacobian(sink, 0, ((const morph_timing_rows *)data)->controls, -1.0);
    return MORPH_OK;
}

/* At each time and for each kind: every link whose ratio is at least 0.7 of the worst allowed, which is 1 at
 * the tightest place. */
static morph_status choose(morph_timing_rows *r, const double *control) {
    const int links = r->table->curve->structure->links;
    double *x = morph_alloc((size_t)r->controls, sizeof(double));
    if (!x) return MORPH_ERR_NOMEM;
    memcpy(x, control, (size_t)r->controls * sizeof *x);
    static const int none[4];
    int capacity = 0;
    for (int pass = 0; pass < 2; pass++) {
        r->count = 0;
        for (int i = 0; i < r->points; i++)
            for (int kind = 0; kind < 3; kind++) {
                /* The tightest link of each time and kind is always there: another profile may load it fully.
                 */
                int tightest = -1;
                double most = 0.0;
                double z[4];
                profile_at(r, i, x, z);
                const double *l = lengths_at(r, i, z[0]);
                for (int n = 0; n < links; n++) {
                    const double ratio = fabs(partial(kind, l + n, links, z, none)) / limit_of(r, kind, n);
                    if (ratio > most) {
                        most = ratio;
                        tightest = n;
                    }
                }
                for (int n = 0; n < links; n++) {
                    const double ratio = fabs(partial(kind, l + n, links, z, none)) / limit_of(r, kind, n);
                    if (n != tightest && ratio < 0.7) continue;
                    if (pass) r->row[r->count] = (morph_timing_row){i, n, kind};
                    r->count++;
                }
            }
        if (!pass) {
            capacity = r->count;
            r->row = morph_alloc((size_t)capacity, sizeof *r->row);
            if (!r->row) break;
        }
    }
    free(x);
    return r->row ? MORPH_OK : MORPH_ERR_NOMEM;
}

static morph_status allocate(morph_timing_rows *r) {
    const size_t points = (size_t)r->points, links = (size_t)r->table->curve->structure->links;
    r->first = morph_alloc(points, sizeof *r->first);
    r->value = morph_alloc(points, sizeof *r->value);
    r->lengths = morph_alloc(points * MORPH_JET, links * sizeof(double));
    r->at = morph_alloc(points, sizeof(double));
    r->step_lower = morph_alloc((size_t)r->controls, sizeof(double));
    r->step_upper = morph_alloc((size_t)r->controls, sizeof(double));
    return r->first && r->value && r->lengths && r->at && r->step_lower && r->step_upper ? MORPH_OK
                                                                                         : MORPH_ERR_NOMEM;
}

morph_status morph_timing_rows_create(morph_path_table *table, const morph_timing *timing, int grid,
                                      morph_timing_rows *out) {
    *out = (morph_timing_rows){.table = table,
                               .basis = &timing->basis,
                               .duration = timing->duration,
                               .points = grid + 1,
                               .controls = timing->basis.count};
    morph_status status = allocate(out);
    if (status == MORPH_OK) {
        for (int i = 0; i < out->points; i++) {
            out->first[i] = morph_basis_eval(&timing->basis, (double)i / grid, 3, out->value[i]);
            out->at[i] = -1.0; /* no parameter: lengths are not there yet */
        }
        for (int j = 0; j + 1 < out->controls; j++)
            out->step_upper[j] = INFINITY;
        status = choose(out, timing->control);
    }
    if (status == MORPH_OK) {
        out->lower = morph_alloc((size_t)out->count, sizeof(double));
        out->upper = morph_alloc((size_t)out->count, sizeof(double));
        if (!out->lower || !out->upper) status = MORPH_ERR_NOMEM;
    }
    if (status != MORPH_OK) {
        morph_timing_rows_free(out);
        return status;
    }
    for (int n = 0; n < out->count; n++) {
        out->lower[n] = -1.0;
        out->upper[n] = 1.0;
    }
    return MORPH_OK;
}

void morph_timing_rows_free(morph_timing_rows *r) {
    free(r->first);
    free(r->value);
    free(r->row);
    free(r->lower);
    free(r->upper);
    free(r->step_lower);
    free(r->step_upper);
    free(r->lengths);
    free(r->at);
    *r = (morph_timing_rows){0};
}

int morph_timing_rows_blocks(morph_timing_rows *r, morph_block out[3]) {
    int n = 0;
    const morph_block common = {.unknowns = r->controls + 1, .data = r};
    out[n] = common;
    out[n].name = "speed";
    out[n].value = speed_value;
    out[n++].walk = speed_walk;
    out[n] = common;
    out[n].name = "rising parameter";
    out[n].rows = r->controls - 1;
    out[n].lower = r->step_lower;
    out[n].upper = r->step_upper;
    out[n].value = steps_value;
    out[n++].walk = steps_walk;
    if (r->count == 0) return n;
    out[n] = common;
    out[n].name = "timing";
    out[n].rows = r->count;
    out[n].lower = r->lower;
    out[n].upper = r->upper;
    out[n].value = limits_value;
    out[n].walk = limits_walk;
    out[n++].describe = limits_describe;
    return n;
}
