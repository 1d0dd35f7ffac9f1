/* Closest points of the elementary pairs: point and triangle, segment and segment. */
#include "model/distance_internal.h"

#include <string.h>

/* Closest point of segment ab to p: squared distance; 0 <= *t <= 1. The ends are taken as they are, so that
 * neighbours that share them agree bit for bit. */
static double point_segment(const double p[3], const double a[3], const double b[3], double *t,
                            double point[3]) {
    double ab[3], ap[3];
    morph_sub(b, a, ab);
    morph_sub(p, a, ap);
    const double along = morph_dot(ap, ab), whole = morph_dot(ab, ab);
    if (!(along > 0)) {
        *t = 0;
        memcpy(point, a, 3 * sizeof *a);
    } else if (along >= whole) {
        *t = 1;
        memcpy(point, b, 3 * sizeof *b);
    } else {
        *t = along / whole;
        for (int k = 0; k < 3; k++)
            point[k] = a[k] + *t * ab[k];
    }
    double off[3];
    morph_sub(p, point, off);
    return morph_dot(off, off);
}

/* With n = ab x ac, the projection of p on the plane has the weights
 *     w_c = n . (ab x ap) / n^2,   w_b = n . (ap x ac) / n^2,   w_a = 1 - w_b - w_c.
 * All positive: the closest point lies in the face, at distance |n . ap| / |n|. Else it lies on an edge whose
 * opposite weight is not: a path to any other point of the triangle crosses such an edge. */
double morph_facet_nearest(const morph_facet *f, const double p[3], int *feature, double point[3]) {
    const double *a = f->corner[0], *b = f->corner[1], *c = f->corner[2], *n = f->normal;
    double ab[3], ac[3], ap[3], cross[3];
    morph_sub(b, a, ab);
    morph_sub(c, a, ac);
    morph_sub(p, a, ap);
    morph_cross(ab, ap, cross);
    const double wc = morph_dot(n, cross) * f->inverse;
    morph_cross(ap, ac, cross);
    const double wb = morph_dot(n, cross) * f->inverse, wa = 1 - wb - wc;
    const bool flat = !(f->inverse > 0);
    if (!flat && wa > 0 && wb > 0 && wc > 0) {
        const double height = morph_dot(n, ap);
        for (int k = 0; k < 3; k++)
            point[k] = p[k] - height * f->inverse * n[k];
        *feature = MORPH_ON_FACE;
        return height * height * f->inverse;
    }
    const bool beyond[3] = {flat || wc <= 0, flat || wa <= 0, flat || wb <= 0};
    double best = INFINITY;
    for (int e = 0; e < 3; e++) {
        if (!beyond[e]) continue;
        double t, at[3];
        const double squared = point_segment(p, f->corner[e], f->corner[(e + 1) % 3], &t, at);
        if (squared < best) {
            best = squared;
            memcpy(point, at, sizeof at);
            *feature = !(t > 0) ? MORPH_ON_CORNER + e
                       : t >= 1 ? MORPH_ON_CORNER + (e + 1) % 3
                                : MORPH_ON_EDGE + e;
        }
    }
    return best;
}

double morph_point_triangle(const double p[3], const double a[3], const double b[3], const double c[3],
                            double weight[3]) {
    const double *corner[3] = {a, b, c};
    double ab[3], ac[3], ap[3], n[3], cross[3];
    morph_sub(b, a, ab);
    morph_sub(c, a, ac);
    morph_sub(p, a, ap);
    morph_cross(ab, ac, n);
    const double n2 = morph_dot(n, n);
    /* As for facets: an area below rounding is none. */
    const bool flat = !(n2 > 1e-28 * morph_dot(ab, ab) * morph_dot(ac, ac));
    if (!flat) {
        morph_cross(ab, ap, cross);
        weight[2] = morph_dot(n, cross) / n2;
        morph_cross(ap, ac, cross);
        weight[1] = morph_dot(n, cross) / n2;
        weight[0] = 1 - weight[1] - weight[2];
        if (weight[0] >= 0 && weight[1] >= 0 && weight[2] >= 0) return fabs(morph_dot(n, ap)) / sqrt(n2);
    }
    const bool beyond[3] = {flat || weight[2] < 0, flat || weight[0] < 0, flat || weight[1] < 0};
    double best = INFINITY;
    for (int e = 0; e < 3; e++) {
        if (!beyond[e]) continue;
        double t, at[3];
        const double squared = point_segment(p, corner[e], corner[(e + 1) % 3], &t, at);
        if (squared < best) {
            best = squared;
            weight[e] = 1 - t;
            weight[(e + 1) % 3] = t;
            weight[(e + 2) % 3] = 0;
        }
    }
    return sqrt(best);
}

/* Inner stationary point of |r + s u - t v|^2 with r = a0 - b0:
 *     [ u.u  -u.v ] [s]   [ -u.r ]
 *     [ -u.v  v.v ] [t] = [  v.r ],
 * solved twice, the second time for the correction: nearly parallel segments lose digits in the determinant.
 * False if parallel or if the point lies outside the unit square. */
static bool inner_pair(const double a0[3], const double u[3], const double b0[3], const double v[3],
                       double *s, double *t) {
    const double uu = morph_dot(u, u), uv = morph_dot(u, v), vv = morph_dot(v, v);
    double cross[3];
    morph_cross(u, v, cross);
    const double det = morph_dot(cross, cross);
    if (!(det > 0)) return false;
    *s = *t = 0;
    for (int turn = 0; turn < 2; turn++) {
        double r[3];
        for (int k = 0; k < 3; k++)
            r[k] = (a0[k] - b0[k]) + *s * u[k] - *t * v[k];
        const double ur = morph_dot(u, r), vr = morph_dot(v, r);
        *s += (uv * vr - vv * ur) / det;
        *t += (uu * vr - uv * ur) / det;
    }
    return *s >= 0 && *s <= 1 && *t >= 0 && *t <= 1;
}

double morph_segment_segment(const double a0[3], const double a1[3], const double b0[3], const double b1[3],
                             double *s, double *t) {
    double u[3], v[3], at[3], best = INFINITY;
    morph_sub(a1, a0, u);
    morph_sub(b1, b0, v);
    /* Either an inner pair, or an end of one against the other: the least of all five is right also where
     * rounding puts the inner pair a little outside. */
    for (int end = 0; end < 4; end++) {
        double along;
        const double *p = end == 0 ? a0 : end == 1 ? a1 : end == 2 ? b0 : b1;
        const double squared =
            end < 2 ? point_segment(p, b0, b1, &along, at) : point_segment(p, a0, a1, &along, at);
        if (!(squared < best)) continue;
        best = squared;
        *s = end < 2 ? end : along;
        *t = end < 2 ? along : end - 2;
    }
    double si, ti;
    if (inner_pair(a0, u, b0, v, &si, &ti)) {
        double r[3];
        for (int k = 0; k < 3; k++)
            r[k] = (a0[k] - b0[k]) + si * u[k] - ti * v[k];
        const double squared = morph_dot(r, r);
        if (squared < best) {
            best = squared;
            *s = si;
            *t = ti;
        }
    }
    return sqrt(best);
}
