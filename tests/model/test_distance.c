/* Exact distance against brute force, analytic solids and its own guarantees. */
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
static void near_or_fail(double a, double b, double eps, int line) {
    if (fabs(a - b) <= eps) return;
    print_error("line %d: %.17g is not %.17g to %g\n", line, a, b, eps);
    fail();
}

/* Of this process: other work on the machine counts less. */
static double cpu_seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

static uint64_t seed = 1;
static double uniform(double lo, double hi) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(seed >> 11) / 9007199254740992.0;
}
static void random_point(double lo, double hi, double p[3]) {
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

static int vertex(double x, double y, double z) {
    double *v = made.v + 3 * made.nv;
    v[0] = x, v[1] = y, v[2] = z;
    return made.nv++;
}
static void triangle(int a, int b, int c) {
    int *t = made.t + 3 * made.nt++;
    t[0] = a, t[1] = b, t[2] = c;
}
static void quad(int a, int b, int c, int d) {
    triangle(a, b, c);
    triangle(a, c, d);
}

/* Prism over a counter-clockwise polygon, given triangles of the polygon. */
static void prism(const double (*xy)[2], int n, const int (*cap)[3], int caps, double z0, double z1) {
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
static void make_box(double x, double y, double z) {
    const double xy[4][2] = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
    const int cap[2][3] = {{0, 1, 2}, {0, 2, 3}};
    prism(xy, 4, cap, 2, -z, z);
}
/* [-1,1]^2 less the quadrant x, y > 0, height 1: concave edge on the z axis. */
static void make_ell(void) {
    const double xy[6][2] = {{-1, -1}, {1, -1}, {1, 0}, {0, 0}, {0, 1}, {-1, 1}};
    const int cap[4][3] = {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}};
    prism(xy, 6, cap, 4, -0.5, 0.5);
}
static void make_torus(int m, int n) {
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
static int midpoint(int a, int b) {
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
static void make_sphere(int levels) {
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

static morph_distance *finish(bool closed) {
    const morph_mesh mesh = {made.nv, made.nt, made.v, made.t};
    morph_distance *d;
    assert_int_equal(morph_distance_create(&mesh, closed, &d), MORPH_OK);
    assert_non_null(d);
    return d;
}
enum { SOLIDS = 5 };
static morph_distance *solid(int which) {
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

static double clamp01(double t) {
    return t < 0 ? 0 : t > 1 ? 1 : t;
}
static double brute_segment(const double p[3], const double *a, const double *b) {
    double ab[3], ap[3], at[3];
    morph_sub(b, a, ab);
    morph_sub(p, a, ap);
    const double t = clamp01(morph_dot(ap, ab) / morph_dot(ab, ab));
    for (int k = 0; k < 3; k++)
        at[k] = a[k] + t * ab[k];
    return morph_dist(p, at);
}
static double brute_triangle(const double p[3], const double *a, const double *b, const double *c) {
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
static double brute_winding(const morph_mesh *m, const double p[3]) {
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
static double brute(const morph_mesh *m, const double p[3]) {
    double best = INFINITY;
    for (int i = 0; i < m->triangles; i++)
        best = fmin(best, brute_triangle(p, m->v + 3 * m->t[3 * i], m->v + 3 * m->t[3 * i + 1],
                                         m->v + 3 * m->t[3 * i + 2]));
    return brute_winding(m, p) > 0.5 ? -best : best;
}

/* --- tests ------------------------------------------------------------------------------------------------
 */

static void test_points_against_brute_force(void **state) {
    (void)state;
    for (int which = 0; which < SOLIDS; which++) {
        morph_distance *d = solid(which);
        int inside = 0;
        for (int i = 0; i < 1500; i++) {
            double p[3];
            random_point(-1.6, 1.6, p);
            if (which == 4) p[2] *= i % 2 ? 1e-5 : 1;
            morph_closest c;
            morph_distance_point(d, p, &c);
            const double want = brute(morph_distance_mesh(d), p);
            assert_near(c.distance, want, 1e-13);
            assert_near(morph_dist(p, c.point), fabs(want), 1e-13);
            assert_near(morph_norm(c.normal), 1, 1e-12);
            assert_true(c.triangle >= 0 && c.triangle < morph_distance_mesh(d)->triangles);
            inside += want < 0;
            assert_int_equal(morph_inside(d, p), want < 0);
            /* Bounded: same answer within, the signed bound beyond. */
            morph_closest b;
            const double bound = uniform(0.01, 0.5);
            morph_distance_point_bounded(d, p, bound, &b);
            if (fabs(want) < bound * (1 - 1e-9)) {
                assert_near(b.distance, want, 1e-13);
            } else if (fabs(want) > bound * (1 + 1e-9)) {
                assert_int_equal(b.triangle, -1);
                assert_true(b.distance == (want < 0 ? -bound : bound));
            }
        }
        assert_true(inside > 20);
        morph_distance_destroy(d);
    }
}

/* The normal is the gradient: central differences where the closest point does not jump. */
static void test_normal_is_gradient(void **state) {
    (void)state;
    for (int which = 0; which < SOLIDS - 1; which++) {
        morph_distance *d = solid(which);
        int compared = 0;
        for (int i = 0; i < 500; i++) {
            double p[3], fd[3];
            random_point(-1.5, 1.5, p);
            morph_closest c, lo, hi;
            morph_distance_point(d, p, &c);
            bool smooth = true;
            for (int k = 0; k < 3; k++) {
                double q[3];
                memcpy(q, p, sizeof q);
                q[k] = p[k] - 1e-6;
                morph_distance_point(d, q, &lo);
                q[k] = p[k] + 1e-6;
                morph_distance_point(d, q, &hi);
                fd[k] = (hi.distance - lo.distance) / 2e-6;
                smooth = smooth && morph_dist(lo.point, hi.point) < 1e-4;
            }
            if (!smooth || fabs(c.distance) < 1e-2) continue;
            compared++;
            assert_true(morph_dist(fd, c.normal) < 1e-4);
        }
        assert_true(compared > 300);
        morph_distance_destroy(d);
    }
}

/* Exactly on faces, edges and vertices: distance 0 and the pseudonormal. */
static void test_on_surface(void **state) {
    (void)state;
    make_box(1, 1, 1);
    morph_distance *d = finish(true);
    const double at[4][3] = {{0.2, 0.3, 1}, {1, 0.25, 1}, {1, 1, 1}, {-1, -1, -1}};
    const double want[4][3] = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {-1, -1, -1}};
    for (int i = 0; i < 4; i++) {
        morph_closest c;
        morph_distance_point(d, at[i], &c);
        assert_true(c.distance == 0);
        assert_near(morph_dot(c.normal, want[i]), morph_norm(want[i]), 1e-12);
    }
    morph_distance_destroy(d);
}

static void test_scales(void **state) {
    (void)state;
    for (int power = -6; power <= 6; power += 3) {
        const double scale = pow(10, power);
        make_ell();
        for (int i = 0; i < 3 * made.nv; i++)
            made.v[i] *= scale;
        morph_distance *d = finish(true);
        for (int i = 0; i < 300; i++) {
            double p[3], w[3], corner[3][3];
            random_point(-2 * scale, 2 * scale, p);
            morph_closest c;
            morph_distance_point(d, p, &c);
            assert_near(c.distance / scale, brute(morph_distance_mesh(d), p) / scale, 1e-13);
            /* An element around an inside point must be seen at every scale. */
            if (c.distance > -1e-3 * scale) continue;
            for (int k = 0; k < 3; k++) {
                corner[0][k] = p[k] + uniform(-scale, scale);
                corner[1][k] = p[k] + uniform(-scale, scale);
                corner[2][k] = 3 * p[k] - corner[0][k] - corner[1][k];
            }
            morph_closest e;
            morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &e);
            assert_true(e.distance <= c.distance + 1e-5 * scale);
        }
        morph_distance_destroy(d);
    }
}

static void test_lipschitz(void **state) {
    (void)state;
    for (int which = 0; which < SOLIDS; which++) {
        morph_distance *d = solid(which);
        for (int i = 0; i < 3000; i++) {
            double p[3], q[3];
            random_point(-1.5, 1.5, p);
            const double step = pow(10, uniform(-6, 0));
            for (int k = 0; k < 3; k++)
                q[k] = p[k] + uniform(-step, step);
            morph_closest a, b;
            morph_distance_point(d, p, &a);
            morph_distance_point(d, q, &b);
            assert_true(fabs(a.distance - b.distance) <= morph_dist(p, q) + 1e-13);
        }
        morph_distance_destroy(d);
    }
}

static void blend(double corner[][3], int n, const double *w, double p[3]) {
    for (int k = 0; k < 3; k++) {
        p[k] = 0;
        for (int j = 0; j < n; j++)
            p[k] += w[j] * corner[j][k];
    }
}
/* Least distance over a fine pattern on the element: never below the true least, and above it by at most the
 * pattern's spacing. */
static double sampled(const morph_distance *d, double corner[][3], int n, int fine) {
    double best = INFINITY;
    for (int i = 0; i <= fine; i++)
        for (int j = 0; i + j <= fine; j++) {
            if (n == 2 && i + j < fine) continue;
            const double w[3] = {(double)i / fine, (double)j / fine, (double)(fine - i - j) / fine};
            double p[3];
            blend(corner, n, w, p);
            morph_closest c;
            morph_distance_point(d, p, &c);
            best = fmin(best, c.distance);
        }
    return best;
}
/* Exact least distance of an element that does not touch, over all triangles. */
static double brute_element(const morph_mesh *m, double corner[][3], int n) {
    double best = INFINITY, s, t, w[3];
    for (int i = 0; i < m->triangles; i++)
        for (int j = 0; j < 3; j++) {
            const double *a = m->v + 3 * m->t[3 * i + j], *b = m->v + 3 * m->t[3 * i + (j + 1) % 3];
            for (int e = 0; e < (n == 3 ? 3 : 1); e++)
                best = fmin(best, morph_segment_segment(a, b, corner[e], corner[(e + 1) % n], &s, &t));
            if (n == 3) best = fmin(best, morph_point_triangle(a, corner[0], corner[1], corner[2], w));
        }
    for (int e = 0; e < n; e++)
        best = fmin(best, fabs(brute(m, corner[e])));
    return best;
}

static void check_element(const morph_distance *d, double corner[][3], int n, int count[3]) {
    double w[3] = {0}, p[3], sum = 0, size = 0;
    morph_closest c, at;
    if (n == 2)
        morph_distance_segment(d, corner[0], corner[1], w, &c);
    else
        morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &c);
    for (int j = 0; j < n; j++) {
        assert_true(w[j] >= -1e-12 && w[j] <= 1 + 1e-12);
        sum += w[j];
        size = fmax(size, morph_dist(corner[j], corner[(j + 1) % n]));
    }
    assert_near(sum, 1, 1e-12);
    blend(corner, n, w, p);
    morph_distance_point(d, p, &at);
    assert_near(at.distance, c.distance, 1e-12);
    const int fine = n == 2 ? 300 : 30;
    const double least = sampled(d, corner, n, fine);
    assert_true(c.distance <= least + 2e-6 * size);
    assert_true(c.distance >= least - size / fine);
    if (c.distance > 0)
        assert_near(c.distance, brute_element(morph_distance_mesh(d), corner, n), 1e-12);
    else
        assert_true(least <= size / fine);
    count[c.distance > 0 ? 0 : least > 0 ? 1 : 2]++;
}

static void test_elements_against_brute_force(void **state) {
    (void)state;
    for (int which = 0; which < SOLIDS; which++) {
        morph_distance *d = solid(which);
        for (int n = 2; n <= 3; n++) {
            int count[3] = {0};
            for (int i = 0; i < 120; i++) {
                double corner[3][3], centre[3];
                const double size = uniform(0.05, 1.2);
                random_point(-1.4, 1.4, centre);
                for (int j = 0; j < 3; j++)
                    for (int k = 0; k < 3; k++)
                        corner[j][k] = centre[k] + uniform(-size, size);
                check_element(d, corner, n, count);
            }
            /* Few random triangles clear or cross the thin plate; all kinds must occur. */
            assert_true(count[0] >= 5 && count[1] + count[2] >= 5);
        }
        morph_distance_destroy(d);
    }
}

/* An element through a point known to be inside can never be clear: at least that deep. */
static void test_no_crossing_is_missed(void **state) {
    (void)state;
    int found = 0;
    for (int which = 0; which < SOLIDS; which++) {
        morph_distance *d = solid(which);
        for (int i = 0; i < 4000; i++) {
            double p[3], corner[3][3], w[3];
            random_point(-1.3, 1.3, p);
            if (which == 4) p[2] *= 7e-6;
            morph_closest c, e;
            morph_distance_point(d, p, &c);
            if (c.distance >= 0) continue;
            found++;
            const double size = pow(10, uniform(-1, 1)), share = uniform(0.05, 0.95);
            for (int k = 0; k < 3; k++) {
                corner[0][k] = p[k] + uniform(-size, size);
                corner[1][k] = p[k] - (corner[0][k] - p[k]) * share / (1 - share);
            }
            morph_distance_segment(d, corner[0], corner[1], w, &e);
            assert_true(e.distance < 0);
            assert_true(e.distance <= c.distance + 4e-6 * morph_dist(corner[0], corner[1]));
            for (int k = 0; k < 3; k++) {
                corner[1][k] = p[k] + uniform(-size, size);
                corner[2][k] = 3 * p[k] - corner[0][k] - corner[1][k];
            }
            morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &e);
            assert_true(e.distance < 0);
            assert_true(e.distance <= c.distance + 1e-4 * 4 * size);
        }
        morph_distance_destroy(d);
    }
    assert_true(found > 3000);
}

/* Large triangles lying across single vertices and edges that poke through by little. */
static void test_pierced_by_vertices_and_edges(void **state) {
    (void)state;
    for (int i = 0; i < 3000; i++) {
        const double poke = pow(10, uniform(-9, -2)), turn = uniform(0, 7);
        double corner[3][3], w[3];
        morph_closest e;
        make_sphere(1);
        if (i % 50 == 0) seed += 12345;
        static morph_distance *d;
        if (i == 0) d = finish(true);
        /* Octahedron-like tip at (0,0,1); the triangle's plane is z = 1 - poke. */
        for (int j = 0; j < 3; j++) {
            corner[j][0] = 5 * cos(turn + 2 * M_PI * j / 3) + 0.3;
            corner[j][1] = 5 * sin(turn + 2 * M_PI * j / 3);
            corner[j][2] = 1 - poke;
        }
        morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &e);
        assert_true(e.distance < 0);
        for (int j = 0; j < 3; j++)
            corner[j][2] = 1 + poke;
        morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &e);
        assert_near(e.distance, poke, 1e-14);
        if (i == 2999) morph_distance_destroy(d);
    }
}

/* Coordinates on a lattice: everything passes exactly through vertices, edges and planes. */
static void test_lattice_degeneracies(void **state) {
    (void)state;
    make_ell();
    for (int i = 0; i < 3 * made.nv; i++)
        made.v[i] *= 2; /* corners at even and odd integers */
    morph_distance *d = finish(true);
    for (int i = 0; i < 6000; i++) {
        double corner[3][3], w[3];
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                corner[j][k] = floor(uniform(-4, 5));
        morph_closest e;
        const int n = 2 + i % 2;
        if (n == 2)
            morph_distance_segment(d, corner[0], corner[1], w, &e);
        else
            morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &e);
        assert_true(isfinite(e.distance));
        const double least = sampled(d, corner, n, 24);
        /* Ridges of equal depth exhaust the search: 1e-4 of the size is left then. */
        assert_true(e.distance <= least + 1e-3);
        if (e.distance > 0) assert_near(e.distance, brute_element(morph_distance_mesh(d), corner, n), 1e-12);
    }
    morph_distance_destroy(d);
}

static void test_element_wholly_inside(void **state) {
    (void)state;
    make_box(1, 1, 1);
    morph_distance *d = finish(true);
    const double a[3] = {-0.2, 0, 0.5}, b[3] = {0.3, 0.1, -0.5}, c[3] = {0, -0.4, 0.1};
    double w[3];
    morph_closest e;
    morph_distance_segment(d, a, b, w, &e);
    /* Along ab the nearest face is z = +-1 until |z| <= max(|x|, |y|): deepest where |z| = |x| or 0.97... */
    double corner[2][3];
    memcpy(corner[0], a, sizeof a);
    memcpy(corner[1], b, sizeof b);
    assert_near(e.distance, sampled(d, corner, 2, 20000), 1e-4);
    morph_distance_triangle(d, a, b, c, w, &e);
    assert_true(e.distance < -0.9);
    morph_distance_destroy(d);
}

static void test_vertical_hits_always_pair(void **state) {
    (void)state;
    for (int which = 0; which < SOLIDS; which++) {
        morph_distance *d = solid(which);
        const morph_mesh *m = morph_distance_mesh(d);
        for (int i = 0; i < 6000; i++) {
            double x = uniform(-1.5, 1.5), y = uniform(-1.5, 1.5), z[64];
            int sign[64], sum = 0;
            /* Exactly through vertices, or through the coordinates of two of them. */
            if (i % 3) x = m->v[3 * ((int)uniform(0, m->vertices))];
            if (i % 3) y = m->v[3 * ((int)uniform(0, m->vertices)) + 1];
            if (i % 3 == 2) {
                const int v = (int)uniform(0, m->vertices);
                x = m->v[3 * v], y = m->v[3 * v + 1];
            }
            const int hits = morph_vertical_hits(d, x, y, z, sign, 64);
            assert_true(hits <= 64 && hits % 2 == 0);
            for (int k = 0; k < hits; k++) {
                sum += sign[k];
                /* Between hits the line is either inside or outside; hits on one point come in any order. */
                if (k + 1 == hits || z[k + 1] > z[k] + 1e-9) assert_true(sum == 0 || sum == -1);
                assert_true(k == 0 || z[k] >= z[k - 1]);
                const double p[3] = {x, y, z[k]};
                morph_closest c;
                morph_distance_point(d, p, &c);
                assert_near(c.distance, 0, 1e-12);
            }
            assert_int_equal(sum, 0);
            if (hits > 0) {
                double few[1];
                int one[1];
                assert_int_equal(morph_vertical_hits(d, x, y, few, one, 1), hits);
                assert_true(few[0] == z[0] && one[0] == sign[0]);
                assert_int_equal(morph_vertical_hits(d, x, y, NULL, NULL, 0), hits);
            }
        }
        morph_distance_destroy(d);
    }
}

static void test_winding(void **state) {
    (void)state;
    make_torus(60, 30);
    made.nt -= 200; /* a hole */
    morph_distance *d = finish(false);
    double worst = 0;
    int inside = 0;
    for (int i = 0; i < 1500; i++) {
        double p[3];
        random_point(-1.6, 1.6, p);
        const double want = brute_winding(morph_distance_mesh(d), p);
        worst = fmax(worst, fabs(morph_winding(d, p) - want));
        morph_closest c;
        morph_distance_point(d, p, &c);
        if (fabs(want - 0.5) > 0.02) {
            assert_int_equal(c.distance<0, want> 0.5);
            assert_int_equal(morph_inside(d, p), want > 0.5);
        }
        inside += c.distance < 0;
    }
    print_message("winding number: worst error %.2g\n", worst);
    assert_true(worst < 0.01);
    assert_true(inside > 50);
    /* A crossed open sheet touches; beside it is clear. */
    const double a[3] = {-1, 0, -1}, b[3] = {-1, 0, 1}, far[3] = {-1, 0, 3};
    double w[2];
    morph_closest e;
    morph_distance_segment(d, a, b, w, &e);
    assert_true(e.distance <= 0);
    morph_distance_segment(d, b, far, w, &e);
    assert_near(e.distance, 0.6, 1e-2);
    morph_distance_destroy(d);
}

static void test_segment_pairs(void **state) {
    (void)state;
    for (int i = 0; i < 20000; i++) {
        double p[4][3], s, t, best = INFINITY;
        for (int j = 0; j < 4; j++)
            random_point(-1, 1, p[j]);
        if (i % 4 == 1) /* nearly parallel */
            for (int k = 0; k < 3; k++)
                p[3][k] = p[2][k] + (p[1][k] - p[0][k]) * 0.8 + uniform(-1e-8, 1e-8);
        if (i % 4 == 2) /* crossing at a point */
            for (int k = 0; k < 3; k++)
                p[3][k] = p[0][k] + p[1][k] - p[2][k];
        const double d = morph_segment_segment(p[0], p[1], p[2], p[3], &s, &t);
        assert_true(s >= 0 && s <= 1 && t >= 0 && t <= 1);
        double a[3], b[3];
        for (int k = 0; k < 3; k++) {
            a[k] = p[0][k] + s * (p[1][k] - p[0][k]);
            b[k] = p[2][k] + t * (p[3][k] - p[2][k]);
        }
        assert_near(morph_dist(a, b), d, 1e-14);
        if (i % 4 == 2) assert_true(d < 1e-14);
        for (int j = 0; j <= 200; j++) {
            for (int k = 0; k < 3; k++)
                a[k] = p[0][k] + j / 200.0 * (p[1][k] - p[0][k]);
            best = fmin(best, brute_segment(a, p[2], p[3]));
        }
        assert_true(d <= best + 1e-14 && d >= best - 0.01 * morph_dist(p[0], p[1]));
    }
}

static void test_refusals(void **state) {
    (void)state;
    morph_distance *d;
    make_box(1, 1, 1);
    morph_mesh mesh = {made.nv, made.nt, made.v, made.t};
    made.v[4] = NAN;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_ERR_NONFINITE);
    assert_null(d);
    made.v[4] = 0;
    made.t[5] = made.nv;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_ERR_INPUT);
    mesh.triangles = 0;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_ERR_INPUT);
    morph_distance_destroy(NULL);
}

/* One triangle, a sliver, and a mesh of coincident triangles: no special case may fall over. */
static void test_odd_meshes(void **state) {
    (void)state;
    double v[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    int t[3 * 100];
    for (int i = 0; i < 300; i++)
        t[i] = i % 3;
    morph_mesh mesh = {3, 1, v, t};
    const double p[3] = {0.25, 0.25, 2}, q[3] = {0.25, 0.25, -1};
    for (int n = 1; n <= 100; n += 99) {
        morph_distance *d;
        mesh.triangles = n;
        assert_int_equal(morph_distance_create(&mesh, false, &d), MORPH_OK);
        morph_closest c;
        double w[2];
        morph_distance_point(d, p, &c);
        assert_near(c.distance, 2, 1e-15);
        morph_distance_segment(d, p, q, w, &c);
        assert_true(c.distance <= 0);
        assert_int_equal(morph_vertical_hits(d, 0.25, 0.25, NULL, NULL, 0), n);
        morph_distance_destroy(d);
    }
    v[7] = 1e-17;
    v[6] = 0.5;
    mesh.triangles = 1;
    morph_distance *d;
    assert_int_equal(morph_distance_create(&mesh, false, &d), MORPH_OK);
    morph_closest c;
    morph_distance_point(d, p, &c);
    assert_near(fabs(c.distance), sqrt(4 + 0.0625), 1e-14);
    morph_distance_destroy(d);
}

static void test_speed(void **state) {
    (void)state;
    make_torus(50, 20);
    morph_distance *d = finish(true);
    enum { QUERIES = 20000 };
    double sum = 0;
    const double began = cpu_seconds();
    for (int i = 0; i < QUERIES; i++) {
        double p[3];
        morph_closest c;
        random_point(-1.5, 1.5, p);
        morph_distance_point_bounded(d, p, 0.2, &c);
        sum += c.distance;
    }
    const double bounded = cpu_seconds();
    for (int i = 0; i < QUERIES; i++) {
        double p[3];
        morph_closest c;
        random_point(-1.5, 1.5, p);
        morph_distance_point(d, p, &c);
        sum += c.distance;
    }
    const double full = cpu_seconds();
    for (int i = 0; i < QUERIES / 10; i++) {
        double p[3], q[3][3], w[3];
        morph_closest c;
        random_point(-1.5, 1.5, p);
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                q[j][k] = p[k] + uniform(-0.1, 0.1);
        morph_distance_triangle(d, q[0], q[1], q[2], w, &c);
        sum += c.distance;
    }
    const double triangles = cpu_seconds();
    assert_true(isfinite(sum));
    print_message("2000 triangles: point within 0.2 %.2f us, point %.2f us, triangle %.1f us\n",
                  (bounded - began) / QUERIES * 1e6, (full - bounded) / QUERIES * 1e6,
                  (triangles - full) / (QUERIES / 10) * 1e6);
    morph_distance_destroy(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_against_brute_force),
        cmocka_unit_test(test_normal_is_gradient),
        cmocka_unit_test(test_on_surface),
        cmocka_unit_test(test_scales),
        cmocka_unit_test(test_lipschitz),
        cmocka_unit_test(test_elements_against_brute_force),
        cmocka_unit_test(test_no_crossing_is_missed),
        cmocka_unit_test(test_pierced_by_vertices_and_edges),
        cmocka_unit_test(test_lattice_degeneracies),
        cmocka_unit_test(test_element_wholly_inside),
        cmocka_unit_test(test_vertical_hits_always_pair),
        cmocka_unit_test(test_winding),
        cmocka_unit_test(test_segment_pairs),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_odd_meshes),
        cmocka_unit_test(test_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
