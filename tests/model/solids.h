/* For tests of distances: random numbers, small closed solids, brute force. */
#ifndef MORPH_TEST_SOLIDS_H
#define MORPH_TEST_SOLIDS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "model/distance.h"

/* cmocka compares floats; this is for doubles. */
#define assert_near(a, b, eps) near_or_fail((a), (b), (eps), __LINE__)
static inline void near_or_fail(double a, double b, double eps, int line) {
    if (fabs(a - b) <= eps) return;
    print_error("line %d: %.17g is not %.17g to %g\n", line, a, b, eps);
    fail();
}

/* Of this process: other work on the machine counts less. */
static inline double cpu_seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

static uint64_t seed = 1;
static inline double uniform(double lo, double hi) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(seed >> 11) / 9007199254740992.0;
}
static inline void random_point(double lo, double hi, double p[3]) {
    for (int k = 0; k < 3; k++)
        p[k] = uniform(lo, hi);
}

/* --- small generators; all closed and outward -------------------------------------------------------------
 */

typedef struct maker {
    double v[3 * 12000];
    int t[3 * 24000];
    int nv, nt;
} maker;
static maker made;

static inline int vertex(double x, double y, double z) {
    double *v = made.v + 3 * made.nv;
    v[0] = x, v[1] = y, v[2] = z;
    return made.nv++;
}
static inline void triangle(int a, int b, int c) {
    int *t = made.t + 3 * made.nt++;
    t[0] = a, t[1] = b, t[2] = c;
}
static inline void quad(int a, int b, int c, int d) {
    triangle(a, b, c);
    triangle(a, c, d);
}

/* Prism over a counter-clockwise polygon, given triangles of the polygon. */
static inline void prism(const double (*xy)[2], int n, const int (*cap)[3], int caps, double z0, double z1) {
    made.nv = made.nt = 0;
    for (int i = 0; i < n; i++)
        vertex(xy[i][0], xy[i][1], z0);
    for (int i = 0; i < n; i++)
        vertex(xy[i][0], xy[i][1], z1);
    for (int i = 0; i < caps; i++) {
        triangle(cap[i][0], cap[i][2], cap[i][1]);
        triangle(n + cap[i][0], n + cap[i][1], n + cap[i][2]);
    }
    for (int i = 0; i < n; i++)
        quad(i, (i + 1) % n, n + (i + 1) % n, n + i);
}
static inline void make_box(double x, double y, double z) {
    const double xy[4][2] = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
    const int cap[2][3] = {{0, 1, 2}, {0, 2, 3}};
    prism(xy, 4, cap, 2, -z, z);
}
/* [-1,1]^2 less the quadrant x, y > 0, height 1: concave edge on the z axis. */
static inline void make_ell(void) {
    const double xy[6][2] = {{-1, -1}, {1, -1}, {1, 0}, {0, 0}, {0, 1}, {-1, 1}};
    const int cap[4][3] = {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}};
    prism(xy, 6, cap, 4, -0.5, 0.5);
}
static inline void make_torus(int m, int n) {
    made.nv = made.nt = 0;
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            const double a = 2 * M_PI * i / m, b = 2 * M_PI * j / n;
            vertex((1 + 0.4 * cos(b)) * cos(a), (1 + 0.4 * cos(b)) * sin(a), 0.4 * sin(b));
        }
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++)
            quad(i * n + j, (i + 1) % m * n + j, (i + 1) % m * n + (j + 1) % n, i * n + (j + 1) % n);
}
/* Octahedron refined `levels` times and pushed to the unit sphere; vertices are welded by search. */
static inline int midpoint(int a, int b) {
    double p[3];
    for (int k = 0; k < 3; k++)
        p[k] = made.v[3 * a + k] + made.v[3 * b + k];
    const double norm = morph_norm(p);
    for (int k = 0; k < 3; k++)
        p[k] /= norm;
    for (int i = made.nv - 1; i >= 6; i--)
        if (morph_dist(p, made.v + 3 * i) < 1e-9) return i;
    return vertex(p[0], p[1], p[2]);
}
static inline void make_sphere(int levels) {
    made.nv = made.nt = 0;
    for (int k = 0; k < 3; k++)
        for (int s = 1; s >= -1; s -= 2)
            vertex(k == 0 ? s : 0, k == 1 ? s : 0, k == 2 ? s : 0);
    for (int o = 0; o < 8; o++) {
        const int x = o & 1, y = 2 + (o >> 1 & 1), z = 4 + (o >> 2 & 1);
        if (((o & 1) ^ (o >> 1 & 1) ^ (o >> 2 & 1)) == 0)
            triangle(x, y, z);
        else
            triangle(x, z, y);
    }
    for (int level = 0; level < levels; level++) {
        const int n = made.nt;
        for (int i = 0; i < n; i++) {
            const int a = made.t[3 * i], b = made.t[3 * i + 1], c = made.t[3 * i + 2];
            const int ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
            int *t = made.t + 3 * i;
            t[0] = ab, t[1] = bc, t[2] = ca;
            triangle(a, ab, ca);
            triangle(b, bc, ab);
            triangle(c, ca, bc);
        }
    }
}

static inline morph_distance *finish(bool closed) {
    const morph_mesh mesh = {made.nv, made.nt, made.v, made.t};
    morph_distance *d;
    assert_int_equal(morph_distance_create(&mesh, closed, &d), MORPH_OK);
    assert_non_null(d);
    return d;
}
enum { SOLIDS = 5 };
static inline morph_distance *solid(int which) {
    switch (which) {
    case 0:
        make_box(1, 0.7, 0.5);
        break;
    case 1:
        make_sphere(3);
        break;
    case 2:
        make_torus(24, 12);
        break;
    case 3:
        make_ell();
        break;
    default:
        make_box(1, 1, 1e-5);
    }
    return finish(true);
}

/* --- brute force: distance by region of the two parameters, sign by the exact winding number --------------
 */

static inline double clamp01(double t) {
    return t < 0 ? 0 : t > 1 ? 1 : t;
}
static inline double brute_segment(const double p[3], const double *a, const double *b) {
    double ab[3], ap[3], at[3];
    morph_sub(b, a, ab);
    morph_sub(p, a, ap);
    const double t = clamp01(morph_dot(ap, ab) / morph_dot(ab, ab));
    for (int k = 0; k < 3; k++)
        at[k] = a[k] + t * ab[k];
    return morph_dist(p, at);
}
static inline double brute_triangle(const double p[3], const double *a, const double *b, const double *c) {
    double best = fmin(brute_segment(p, a, b), fmin(brute_segment(p, b, c), brute_segment(p, c, a)));
    double u[3], v[3], n[3], q[3], foot[3];
    morph_sub(b, a, u);
    morph_sub(c, a, v);
    morph_cross(u, v, n);
    const double norm = morph_norm(n);
    morph_sub(p, a, q);
    const double height = morph_dot(q, n) / norm;
    for (int k = 0; k < 3; k++)
        foot[k] = p[k] - height * n[k] / norm;
    const double *corner[3] = {a, b, c};
    for (int e = 0; e < 3; e++) {
        double side[3], r[3], cross[3];
        morph_sub(corner[(e + 1) % 3], corner[e], side);
        morph_sub(foot, corner[e], r);
        morph_cross(side, r, cross);
        if (morph_dot(cross, n) < 0) return best;
    }
    return fmin(best, fabs(height));
}
static inline double brute_winding(const morph_mesh *m, const double p[3]) {
    double sum = 0;
    for (int i = 0; i < m->triangles; i++) {
        double a[3], b[3], c[3], bc[3];
        morph_sub(m->v + 3 * m->t[3 * i], p, a);
        morph_sub(m->v + 3 * m->t[3 * i + 1], p, b);
        morph_sub(m->v + 3 * m->t[3 * i + 2], p, c);
        morph_cross(b, c, bc);
        const double la = morph_norm(a), lb = morph_norm(b), lc = morph_norm(c);
        sum += 2 * atan2(morph_dot(a, bc),
                         la * lb * lc + morph_dot(a, b) * lc + morph_dot(b, c) * la + morph_dot(c, a) * lb);
    }
    return sum / (4 * M_PI);
}
static inline double brute(const morph_mesh *m, const double p[3]) {
    double best = INFINITY;
    for (int i = 0; i < m->triangles; i++)
        best = fmin(best, brute_triangle(p, m->v + 3 * m->t[3 * i], m->v + 3 * m->t[3 * i + 1],
                                         m->v + 3 * m->t[3 * i + 2]));
    return brute_winding(m, p) > 0.5 ? -best : best;
}

#endif
