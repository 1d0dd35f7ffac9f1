/* The rigid motion that brings one set of joints closest to another: Horn's unit quaternion (J. Opt. Soc. Am.
 * A 4, 1987), the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix made of the correlations.
 */
#include "model/kinematics.h"

/* Cyclic Jacobi: turns by the angle that makes a[p][q] zero until all are; the columns of v become the
 * eigenvectors. A 4 x 4 matrix needs about 6 sweeps (convergence is quadratic); 30 are never reached. */
static void eigenvectors(double a[4][4], double v[4][4]) {
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            v[i][j] = i == j ? 1.0 : 0.0;
    for (int sweep = 0; sweep < 30; sweep++)
        for (int p = 0; p < 3; p++)
            for (int q = p + 1; q < 4; q++) {
                if (a[p][q] == 0.0) continue;
                const double theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
                const double t = (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + hypot(theta, 1.0));
                const double c = 1.0 / hypot(t, 1.0), s = t * c;
                for (int k = 0; k < 4; k++) {
                    const double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 4; k++) {
                    const double x = a[p][k], y = a[q][k], m = v[k][p], n = v[k][q];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                    v[k][p] = c * m - s * n;
                    v[k][q] = s * m + c * n;
                }
                a[p][q] = a[q][p] = 0.0;
            }
}

static void centroid(int joints, const double *x, double out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = 0.0;
        for (int j = 0; j < joints; j++)
            out[k] += x[3 * j + k] / joints;
    }
}

/* turn: rows of the rotation that takes a - ca closest to b - cb. */
static void rotation(int joints, const double *a, const double *b, const double ca[3], const double cb[3],
                     double turn[3][3]) {
    double m[3][3] = {{0.0}}, size = 0.0;
    for (int j = 0; j < joints; j++)
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                m[r][c] += (a[3 * j + r] - ca[r]) * (b[3 * j + c] - cb[c]);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            size = fmax(size, fabs(m[r][c]));
    for (int r = 0; r < 3 && size > 0.0; r++)
        for (int c = 0; c < 3; c++)
            m[r][c] /= size;
    double n[4][4] = {{m[0][0] + m[1][1] + m[2][2], m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0]},
                      {m[1][2] - m[2][1], m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[2][0] + m[0][2]},
                      {m[2][0] - m[0][2], m[0][1] + m[1][0], m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1]},
                      {m[0][1] - m[1][0], m[2][0] + m[0][2], m[1][2] + m[2][1], m[2][2] - m[0][0] - m[1][1]}};
    double v[4][4];
    eigenvectors(n, v);
    int top = 0;
    for (int k = 1; k < 4; k++)
        if (n[k][k] > n[top][top]) top = k;
    const double w = v[0][top], x = v[1][top], y = v[2][top], z = v[3][top];
    const double q[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
                            {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
                            {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            turn[r][c] = q[r][c];
}

double morph_shape_distance(int joints, const double *a, const double *b, double *moved) {
    double ca[3], cb[3], turn[3][3], worst = 0.0;
    centroid(joints, a, ca);
    centroid(joints, b, cb);
    rotation(joints, a, b, ca, cb, turn);
    for (int j = 0; j < joints; j++) {
        double d[3], at[3];
        morph_sub(&a[3 * j], ca, d);
        for (int k = 0; k < 3; k++)
            at[k] = cb[k] + morph_dot(turn[k], d);
        worst = fmax(worst, morph_dist(at, &b[3 * j]));
        for (int k = 0; k < 3 && moved; k++)
            moved[3 * j + k] = at[k];
    }
    return worst;
}
