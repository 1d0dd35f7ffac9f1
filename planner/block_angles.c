/* Angle limits as rows c = cos(angle) = u.v / (|u||v|) of two joint differences. With unit vectors U, V:
 *   dc/du = (V - c U)/|u|
 *   d2c/du2 = -(V U^T + U V^T + c I - 3c U U^T)/|u|^2
 *   d2c/dudv = (I - U U^T)(I - V V^T)/(|u||v|)
 * and the same with u and v exchanged. */
#include "planner/blocks.h"

#include <stdio.h>

void morph_angle_joints(const morph_structure *s, int tuple, int uj[2], int vj[2]) {
    if (tuple < s->link_posts)
        morph_link_post_joints(s, tuple, uj, vj);
    else
        morph_link_link_joints(s, tuple - s->link_posts, uj, vj);
}

const double *morph_angle_limit(const morph_structure *s, int tuple) {
    return tuple < s->link_posts ? s->link_post_limit[tuple] : s->link_link_limit[tuple - s->link_posts];
}

typedef struct directions {
    double u[3], v[3]; /* unit */
    double nu, nv;     /* norms */
    double c;
} directions;

static directions directions_at(const double *x, const int uj[2], const int vj[2]) {
    directions d;
    morph_sub(&x[3 * uj[1]], &x[3 * uj[0]], d.u);
    morph_sub(&x[3 * vj[1]], &x[3 * vj[0]], d.v);
    d.nu = morph_norm(d.u);
    d.nv = morph_norm(d.v);
    for (int k = 0; k < 3; k++) {
        d.u[k] /= d.nu;
        d.v[k] /= d.nv;
    }
    d.c = morph_dot(d.u, d.v);
    return d;
}

double morph_angle_at(const morph_structure *s, int tuple, const double *x) {
    int uj[2], vj[2];
    morph_angle_joints(s, tuple, uj, vj);
    const directions d = directions_at(x, uj, vj);
    double w[3];
    morph_cross(d.u, d.v, w);
    return atan2(morph_norm(w), d.c);
}

void morph_angle_name(const morph_structure *s, int tuple, char *text, size_t size) {
    char a[64], b[64];
    if (tuple < s->link_posts) {
        morph_link_name(s, s->link_post[tuple][0], a, sizeof a);
        morph_post_name(s, s->link_post[tuple][1], b, sizeof b);
    } else {
        morph_link_name(s, s->link_link[tuple - s->link_posts][0], a, sizeof a);
        morph_link_name(s, s->link_link[tuple - s->link_posts][1], b, sizeof b);
    }
    snprintf(text, size, "%s / %s", a, b);
}

static morph_status angles_value(void *data, const double *x, double *f) {
    const morph_angle_rows *d = data;
    for (int r = 0; r < d->count; r++) {
        int uj[2], vj[2];
        morph_angle_joints(d->structure, d->tuple[r], uj, vj);
        f[r] = directions_at(x, uj, vj).c;
    }
    return MORPH_OK;
}

static void put_gradient(morph_sink *sink, int row, const directions *d, const int uj[2], const int vj[2],
                         double scale) {
    for (int k = 0; k < 3; k++) {
        const double gu = scale * (d->v[k] - d->c * d->u[k]) / d->nu;
        const double gv = scale * (d->u[k] - d->c * d->v[k]) / d->nv;
        morph_sink_jacobian(sink, row, 3 * uj[1] + k, gu);
        morph_sink_jacobian(sink, row, 3 * uj[0] + k, -gu);
        morph_sink_jacobian(sink, row, 3 * vj[1] + k, gv);
        morph_sink_jacobian(sink, row, 3 * vj[0] + k, -gv);
    }
}

/* Second derivatives by (u, v) as a symmetric 6 x 6. */
static void hessian_uv(const directions *d, double h[6][6]) {
    double across[3][3];
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++) {
            const double i = k == m ? 1.0 : 0.0, both = d->v[k] * d->u[m] + d->u[k] * d->v[m];
            h[k][m] = -(both + d->c * (i - 3.0 * d->u[k] * d->u[m])) / (d->nu * d->nu);
            h[3 + k][3 + m] = -(both + d->c * (i - 3.0 * d->v[k] * d->v[m])) / (d->nv * d->nv);
            /* (I - UU^T)(I - VV^T) = I - UU^T - VV^T + c U V^T */
            across[k][m] =
                (i - d->u[k] * d->u[m] - d->v[k] * d->v[m] + d->c * d->u[k] * d->v[m]) / (d->nu * d->nv);
        }
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++)
            h[k][3 + m] = h[3 + m][k] = across[k][m];
}

/* u and v are signed differences of joints: every ordered pair of their coordinates is visited and the lower
 * triangle kept, so that joints shared by u and v add up rightly. */
static void put_signed_hessian(morph_sink *sink, const double h[6][6], const int uj[2], const int vj[2],
                               double weight) {
    const int joint[4] = {uj[0], uj[1], vj[0], vj[1]};
    const double sign[4] = {-1.0, 1.0, -1.0, 1.0};
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < 4; b++)
            for (int k = 0; k < 3; k++)
                for (int m = 0; m < 3; m++) {
                    const int i = 3 * joint[a] + k, j = 3 * joint[b] + m;
                    if (i >= j)
                        morph_sink_hessian(sink, i, j,
                                           weight * sign[a] * sign[b] * h[3 * (a / 2) + k][3 * (b / 2) + m]);
                }
}

static void put_hessian(morph_sink *sink, const directions *d, const int uj[2], const int vj[2],
                        double weight) {
    double h[6][6];
    hessian_uv(d, h);
    put_signed_hessian(sink, (const double(*)[6])h, uj, vj, weight);
}

static morph_status angles_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_angle_rows *rows = data;
    for (int r = 0; r < rows->count; r++) {
        int uj[2], vj[2];
        morph_angle_joints(rows->structure, rows->tuple[r], uj, vj);
        const directions d = directions_at(x, uj, vj);
        if (morph_sink_wants_jacobian(sink)) put_gradient(sink, r, &d, uj, vj, 1.0);
        if (morph_sink_wants_hessian(sink)) put_hessian(sink, &d, uj, vj, weight[r]);
    }
    return MORPH_OK;
}

static void angles_describe(void *data, int row, char *text, size_t size) {
    const morph_angle_rows *d = data;
    morph_angle_name(d->structure, d->tuple[row], text, size);
}

morph_block morph_block_angles(morph_angle_rows *data, const int *unknown, double *lower, double *upper) {
    for (int r = 0; r < data->count; r++) {
        const double *limit = morph_angle_limit(data->structure, data->tuple[r]);
        double lo = limit[0] + data->margin, hi = limit[1] - data->margin;
        if (lo > hi) lo = hi = 0.5 * (lo + hi);
        lower[r] = cos(hi);
        upper[r] = cos(lo);
    }
    return (morph_block){.name = "angle",
                         .rows = data->count,
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .lower = lower,
                         .upper = upper,
                         .data = data,
                         .value = angles_value,
                         .walk = angles_walk,
                         .describe = angles_describe};
}

static morph_status upright_value(void *data, const double *x, double *f) {
    const morph_upright_term *d = data;
    f[0] = 0.0;
    for (int t = 0; t < d->structure->link_posts; t++) {
        int uj[2], vj[2];
        morph_link_post_joints(d->structure, t, uj, vj);
        const double c = directions_at(x, uj, vj).c;
        f[0] += d->scale * c * c;
    }
    return MORPH_OK;
}

/* c^2: gradient 2c grad c, Hessian 2c hess c + 2 grad c grad c^T; by (u, v), then through the signed joints.
 */
static void put_square_hessian(morph_sink *sink, const directions *d, const int uj[2], const int vj[2],
                               double weight) {
    double h[6][6], g[6];
    hessian_uv(d, h);
    for (int k = 0; k < 3; k++) {
        g[k] = (d->v[k] - d->c * d->u[k]) / d->nu;
        g[3 + k] = (d->u[k] - d->c * d->v[k]) / d->nv;
    }
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            h[i][j] = 2.0 * (d->c * h[i][j] + g[i] * g[j]);
    put_signed_hessian(sink, (const double(*)[6])h, uj, vj, weight);
}

static morph_status upright_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_upright_term *term = data;
    for (int t = 0; t < term->structure->link_posts; t++) {
        int uj[2], vj[2];
        morph_link_post_joints(term->structure, t, uj, vj);
        const directions d = directions_at(x, uj, vj);
        if (morph_sink_wants_jacobian(sink)) put_gradient(sink, 0, &d, uj, vj, 2.0 * term->scale * d.c);
        if (morph_sink_wants_hessian(sink)) put_square_hessian(sink, &d, uj, vj, weight[0] * term->scale);
    }
    return MORPH_OK;
}

morph_block morph_block_upright(morph_upright_term *data, const int *unknown) {
    return (morph_block){.name = "upright posts",
                         .unknowns = 3 * data->structure->joints,
                         .unknown = unknown,
                         .data = data,
                         .value = upright_value,
                         .walk = upright_walk};
}
