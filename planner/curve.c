#include "planner/curve.h"

#include "planner/jet.h"

#include <stdlib.h>
#include <string.h>

int morph_pose_width(const morph_structure *s) {
    return s->posts > 0 ? 6 * s->posts : 3 * s->joints;
}

/* x: 3*joints; y: a pose. */
static void set_pose(const morph_structure *s, const double *x, double *y) {
    if (s->posts == 0) memcpy(y, x, 3 * (size_t)s->joints * sizeof *y);
    for (int p = 0; p < s->posts; p++, y += 6) {
        const double *b = &x[3 * s->post[p][0]], *t = &x[3 * s->post[p][1]], h = morph_dist(b, t);
        for (int m = 0; m < 3; m++) {
            y[m] = 0.5 * (b[m] + t[m]);
            y[3 + m] = (t[m] - b[m]) / h;
        }
    }
}

morph_status morph_curve_create(const morph_structure *s, const double *parameter, const double *joints,
                                int poses, morph_curve **out) {
    *out = NULL;
    morph_curve *c = calloc(1, sizeof *c);
    if (!c) return MORPH_ERR_NOMEM;
    const int width = morph_pose_width(s);
    c->structure = s;
    c->poses = poses;
    c->s = morph_alloc((size_t)poses, sizeof(double));
    c->pose = morph_alloc((size_t)poses * (size_t)width, sizeof(double));
    morph_status status = c->s && c->pose ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = morph_hold_create(s, &c->hold);
    if (status == MORPH_OK) {
        memcpy(c->s, parameter, (size_t)poses * sizeof *c->s);
        for (int k = 0; k < poses; k++)
            set_pose(s, &joints[(size_t)k * 3 * (size_t)s->joints], &c->pose[(size_t)k * (size_t)width]);
        status = morph_spline_fit(c->s, c->pose, poses, width, &c->spline);
    }
    if (status != MORPH_OK) {
        morph_curve_destroy(c);
        return status;
    }
    *out = c;
    return MORPH_OK;
}

void morph_curve_destroy(morph_curve *c) {
    if (!c) return;
    free(c->s);
    free(c->pose);
    free(c->lift);
    morph_spline_free(&c->spline);
    morph_hold_destroy(c->hold);
    free(c);
}

double morph_curve_lift(const morph_curve *c, double s) {
    int k = 0;
    if (!c->lift) return 0.0;
    while (k + 2 < c->poses && s > c->s[k + 1])
        k++;
    const double t = fmax(0.0, fmin(1.0, (s - c->s[k]) / (c->s[k + 1] - c->s[k])));
    return c->lift[k] + t * (c->lift[k + 1] - c->lift[k]);
}

void morph_curve_joints(const morph_curve *curve, double s, int order, double *scratch, double *out) {
    const morph_structure *st = curve->structure;
    const size_t width = (size_t)morph_pose_width(st), coordinates = 3 * (size_t)st->joints;
    if (st->posts == 0) {
        morph_spline_eval(&curve->spline, s, order, out);
        morph_hold_apply(curve->hold, order, out);
        return;
    }
    morph_spline_eval(&curve->spline, s, order, scratch);
    morph_hold_apply(curve->hold, order, scratch);
    for (int p = 0; p < st->posts; p++) {
        double q[3][MORPH_JET], square[MORPH_JET], norm[MORPH_JET];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k <= order; k++)
                q[c][k] = scratch[(size_t)k * width + 6 * (size_t)p + 3 + (size_t)c] / morph_factorial[k];
        morph_jet_dot((const double(*)[MORPH_JET])q, (const double(*)[MORPH_JET])q, order, square);
        morph_jet_sqrt(square, order, norm);
        const size_t b = 3 * (size_t)st->post[p][0], t = 3 * (size_t)st->post[p][1];
        for (size_t c = 0; c < 3; c++) {
            morph_jet_divide(q[c], norm, order, q[c]);
            for (int k = 0; k <= order; k++) {
                const double centre = scratch[(size_t)k * width + 6 * (size_t)p + c];
                const double half = 0.5 * st->post_length[p] * q[c][k] * morph_factorial[k];
                out[(size_t)k * coordinates + b + c] = centre - half;
                out[(size_t)k * coordinates + t + c] = centre + half;
            }
        }
    }
}

void morph_curve_lengths(const morph_structure *st, const double *joints, int order, double *out) {
    const size_t coordinates = 3 * (size_t)st->joints;
    for (int l = 0; l < st->links; l++) {
        double d[3][MORPH_JET], square[MORPH_JET], length[MORPH_JET];
        const size_t a = 3 * (size_t)st->link[l][0], b = 3 * (size_t)st->link[l][1];
        for (size_t c = 0; c < 3; c++)
            for (int k = 0; k <= order; k++)
                d[c][k] =
                    (joints[(size_t)k * coordinates + b + c] - joints[(size_t)k * coordinates + a + c]) /
                    morph_factorial[k];
        morph_jet_dot((const double(*)[MORPH_JET])d, (const double(*)[MORPH_JET])d, order, square);
        morph_jet_sqrt(square, order, length);
        for (int k = 0; k <= order; k++)
            out[(size_t)k * (size_t)st->links + (size_t)l] = length[k] * morph_factorial[k];
    }
}
