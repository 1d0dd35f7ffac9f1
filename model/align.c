#include "model/align.h"

#include "solvers/dense.h"

static void mean_of(int n, const double *x, double mean[3]) {
    for (int k = 0; k < 3; k++)
        mean[k] = 0.0;
    for (int i = 0; i < 3 * n; i++)
        mean[i % 3] += x[i] / n;
}

/* Horn's symmetric 4 x 4 matrix of the covariance s[a][b] = sum from_a to_b: its largest eigenvector is the
 * quaternion (w, x, y, z) of the rotation. */
static void quaternion_matrix(double s[3][3], double m[16]) {
    const double full[4][4] = {
        {s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
        {s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
        {s[2][0] - s[0][2], s[0][1] + s[1][0], -s[0][0] + s[1][1] - s[2][2], s[1][2] + s[2][1]},
        {s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], -s[0][0] - s[1][1] + s[2][2]}};
    for (int k = 0; k < 16; k++)
        m[k] = full[k / 4][k % 4];
}

static void rotation_of(const double q[4], double r[3][3]) {
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double full[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
                               {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
                               {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
    for (int k = 0; k < 9; k++)
        r[k / 3][k % 3] = full[k / 3][k % 3];
}

morph_status morph_align(int n, double *from, const double *to, double *rms, double *most) {
    double a[3], b[3], s[3][3] = {{0.0}}, m[16], w[4], r[3][3];
    if (rms) *rms = 0.0;
    if (most) *most = 0.0;
    if (n < 1) return MORPH_OK;
    mean_of(n, from, a);
    mean_of(n, to, b);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 9; k++)
            s[k / 3][k % 3] += (from[3 * i + k / 3] - a[k / 3]) * (to[3 * i + k % 3] - b[k % 3]);
    quaternion_matrix(s, m);
    const morph_status status = morph_symmetric_eigen(m, 4, w);
    if (status != MORPH_OK) return status;
    rotation_of(&m[12], r); /* the last row: the largest eigenvalue's */
    double sum = 0.0, worst = 0.0;
    for (int i = 0; i < n; i++) {
        double d[3];
        morph_sub(&from[3 * i], a, d);
        for (int k = 0; k < 3; k++)
            from[3 * i + k] = b[k] + morph_dot(r[k], d);
        const double left = morph_dist(&from[3 * i], &to[3 * i]);
        sum += left * left;
        worst = fmax(worst, left);
    }
    if (rms) *rms = sqrt(sum / n);
    if (most) *most = worst;
    return MORPH_OK;
}
