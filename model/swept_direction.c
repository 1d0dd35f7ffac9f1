/* Directions for the swept test. None of this needs to be exact: a poor direction costs steps, never a miss.
 */
#include "model/swept_internal.h"

#include "solvers/base.h"

#include <string.h>

void morph_swept_corners(const morph_swept_polygon *p, double t, double x[4][3]) {
    for (int j = 0; j < p->corners; j++)
        for (int k = 0; k < 3; k++)
            x[j][k] = (1 - t) * p->at[0][j][k] + t * p->at[1][j][k];
}

bool morph_swept_normalise(double w[3]) {
    const double size = fmax(fabs(w[0]), fmax(fabs(w[1]), fabs(w[2])));
    /* Beyond these the quotients could round to something else than a direction. */
    if (!(size > 1e-280 && size < 1e280)) return false;
    for (int k = 0; k < 3; k++)
        w[k] /= size;
    return true;
}

/* With n = (x1 - x0) x (x_last - x0), the origin lies on the inner side of the edge e from a if
 * n . (e x (0 - a)) > 0. Inside all edges the nearest point is the foot of the normal; else it lies on an
 * edge that has the origin on its outer side. */
bool morph_swept_direction(int corners, const double x[4][3], double w[3], double normal[3]) {
    double e[3], f[3], nearest = INFINITY;
    morph_sub(x[1], x[0], e);
    morph_sub(x[corners - 1], x[0], f);
    morph_cross(e, f, normal);
    bool inside = morph_dot(normal, normal) > 0;
    for (int j = 0; j < corners; j++) {
        const double *a = x[j], *b = x[j + 1 < corners ? j + 1 : 0];
        morph_sub(b, a, e);
        morph_cross(e, a, f);
        if (morph_dot(normal, f) < 0) continue;
        inside = false;
        const double ee = morph_dot(e, e), ae = -morph_dot(a, e);
        const double s = ae <= 0 ? 0 : ae >= ee ? 1 : ae / ee;
        double q[3];
        for (int k = 0; k < 3; k++)
            q[k] = a[k] + s * e[k];
        const double d = morph_dot(q, q);
        if (!(d < nearest)) continue;
        nearest = d;
        memcpy(w, q, sizeof q);
    }
    if (inside) {
        const double sign = morph_dot(normal, x[0]) < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++)
            w[k] = sign * normal[k];
    } else if (!(nearest < INFINITY)) {
        return false;
    }
    return morph_swept_normalise(w);
}

/* Nearly in contact, the nearest point is rounding, while these are still known: the axes (many a scene is
 * laid along them, and products with them are exact), the normal, the normals of the edges within the plane,
 * and the corners. */
int morph_swept_candidates(int corners, const double x[4][3], const double normal[3],
                           double w[MORPH_SWEPT_CANDIDATES][3]) {
    int n = 0;
    for (int k = 0; k < 3; k++, n++) {
        w[n][0] = w[n][1] = w[n][2] = 0;
        w[n][k] = 1;
    }
    memcpy(w[n], normal, 3 * sizeof(double));
    if (morph_swept_normalise(w[n])) {
        const double *unit = w[n++];
        for (int j = 0; j < corners; j++) {
            double e[3];
            morph_sub(x[j + 1 < corners ? j + 1 : 0], x[j], e);
            morph_cross(unit, e, w[n]);
            n += morph_swept_normalise(w[n]);
        }
    }
    for (int j = 0; j < corners; j++) {
        memcpy(w[n], x[j], 3 * sizeof(double));
        n += morph_swept_normalise(w[n]);
    }
    return n;
}
