/* What a recorded frame is held to: the violations left, and the sweeps that remove them. */
#include "model/blanket_internal.h"

#include <stdlib.h>
#include <string.h>

#define MOST_SWEEPS 400

static double cosine(const morph_angle *a, const double *x) {
    double u[3] = {0, 0, 0}, v[3] = {0, 0, 0};
    for (int j = 0; j < a->joints; j++)
        for (int k = 0; k < 3; k++) {
            u[k] += a->su[j] * x[3 * a->joint[j] + k];
            v[k] += a->sv[j] * x[3 * a->joint[j] + k];
        }
    const double scale = sqrt(morph_dot(u, u) * morph_dot(v, v));
    return scale > 0.0 ? morph_dot(u, v) / scale : 0.0;
}

morph_violation morph_blanket_violation(const morph_blanket_state *b, const double *x) {
    const morph_structure *s = b->structure;
    morph_violation worst = {0};
    for (int l = 0; l < b->links; l++) {
        const double length = morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]);
        worst.length = fmax(worst.length, s->length_limit[l][0] - length);
        worst.length = fmax(worst.length, length - s->length_limit[l][1]);
    }
    for (int p = 0; p < b->posts; p++) {
        const double length = morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]);
        worst.post = fmax(worst.post, fabs(length / s->post_length[p] - 1.0));
    }
    for (int t = 0; t < b->angles; t++) {
        const morph_angle *a = &b->angle[t];
        const double c = cosine(a, x);
        worst.angle = fmax(worst.angle, fmax(a->lowest - c, c - a->highest));
    }
    worst.clearance = morph_blanket_depth(b, x);
    return worst;
}

void morph_blanket_polish(morph_blanket_state *b, double *x) {
    memcpy(b->before, x, 3 * (size_t)b->joints * sizeof(double));
    const double length = 1e-7 * b->structure->spacing, clear = 1e-3 * b->structure->spacing;
    for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
        if (sweep % 8 == 0) {
            const morph_violation v = morph_blanket_violation(b, x);
            if (v.length <= length && v.clearance <= clear && v.post < 1e-12) break;
            morph_blanket_find_contacts(b, x);
            morph_blanket_project_start(b);
        }
        morph_blanket_sweep(b, x, (sweep & 1) != 0, 0.0);
    }
}
