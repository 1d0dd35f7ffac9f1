/* Plane panels of the blanket: the four joints of two posts beside each other in one plane. */
#include "model/blanket_internal.h"

/* Volume of a panel's four corners, six times: det[p, r, d] with the posts p and r and d between their feet.
 * By a's bottom and top, then b's: grad = -(r x d) - p x r, r x d, -(d x p) + p x r, d x p. */
static double panel_volume(const morph_structure *s, int panel, const double *x, const double *corner[4],
                           double grad[4][3]) {
    const int *a = s->post[s->panel[panel][0]], *b = s->post[s->panel[panel][1]];
    const int joint[4] = {a[0], a[1], b[0], b[1]};
    double p[3], r[3], d[3], pr[3], rd[3], dp[3];
    for (int k = 0; k < 4; k++)
        corner[k] = &x[3 * joint[k]];
    morph_sub(corner[1], corner[0], p);
    morph_sub(corner[3], corner[2], r);
    morph_sub(corner[2], corner[0], d);
    morph_cross(p, r, pr);
    morph_cross(r, d, rd);
    morph_cross(d, p, dp);
    for (int k = 0; k < 3; k++) {
        grad[0][k] = -rd[k] - pr[k];
        grad[1][k] = rd[k];
        grad[2][k] = -dp[k] + pr[k];
        grad[3][k] = dp[k];
    }
    return morph_dot(pr, d);
}

/* Sine of the angle by which a panel is out of plane. */
double morph_blanket_panel_sine(const morph_structure *s, int panel, const double *x) {
    const double *corner[4];
    double grad[4][3];
    const double volume = panel_volume(s, panel, x, corner, grad);
    const double scale = morph_dist(corner[0], corner[1]) * morph_dist(corner[2], corner[3]) *
                         morph_dist(corner[0], corner[2]);
    return scale > 0.0 ? volume / scale : 0.0;
}

bool morph_blanket_panel_row(const morph_structure *s, int panel, const double *x, double *residual,
                             double grad[4][3]) {
    const double *corner[4];
    const double volume = panel_volume(s, panel, x, corner, grad);
    double square = 0.0;
    for (int k = 0; k < 4; k++)
        square += morph_dot(grad[k], grad[k]);
    const double size = sqrt(square);
    *residual = size > 0.0 ? volume / size : 0.0;
    for (int k = 0; k < 12 && size > 0.0; k++)
        grad[k / 3][k % 3] /= size;
    return size > 0.0;
}

void morph_blanket_project_panel(const morph_blanket_state *b, int panel, double *x) {
    const morph_structure *s = b->structure;
    const double *corner[4];
    double grad[4][3], square = 0.0;
    const double volume = panel_volume(s, panel, x, corner, grad);
    for (int k = 0; k < 4; k++)
        square += b->weight[(corner[k] - x) / 3] * morph_dot(grad[k], grad[k]);
    if (!(square > 0.0)) return;
    for (int k = 0; k < 4; k++) {
        const ptrdiff_t joint = (corner[k] - x) / 3;
        for (int m = 0; m < 3; m++)
            x[3 * joint + m] -= volume / square * b->weight[joint] * grad[k][m];
    }
}
