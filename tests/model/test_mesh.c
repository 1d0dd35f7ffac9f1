/* Welding, mending and examining of triangle meshes. */
#include "model/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define assert_near(a, b, margin) assert_true(fabs((a) - (b)) <= (margin))

static morph_mesh make(const double *v, int vertices, const int *t, int triangles) {
    const morph_mesh view = {vertices, triangles, (double *)v, (int *)t};
    morph_mesh m;
    assert_int_equal(morph_mesh_copy(&view, &m), MORPH_OK);
    return m;
}

/* Joins meshes into one, the second shifted. */
static morph_mesh join(const morph_mesh *a, const morph_mesh *b, double x, double y, double z) {
    const double shift[3] = {x, y, z};
    morph_mesh m = {a->vertices + b->vertices, a->triangles + b->triangles, NULL, NULL};
    m.v = morph_alloc(3 * (size_t)m.vertices, sizeof *m.v);
    m.t = morph_alloc(3 * (size_t)m.triangles, sizeof *m.t);
    assert_non_null(m.v);
    assert_non_null(m.t);
    memcpy(m.v, a->v, 3 * (size_t)a->vertices * sizeof *m.v);
    memcpy(m.t, a->t, 3 * (size_t)a->triangles * sizeof *m.t);
    for (int i = 0; i < 3 * b->vertices; i++)
        m.v[3 * a->vertices + i] = b->v[i] + shift[i % 3];
    for (int i = 0; i < 3 * b->triangles; i++)
        m.t[3 * a->triangles + i] = b->t[i] + a->vertices;
    return m;
}

/* Every triangle with vertices of its own, as an STL file has them, each moved by up to `noise`. */
static morph_mesh soup(const morph_mesh *from, double noise) {
    morph_mesh m = {3 * from->triangles, from->triangles, NULL, NULL};
    m.v = morph_alloc(3 * (size_t)m.vertices, sizeof *m.v);
    m.t = morph_alloc(3 * (size_t)m.triangles, sizeof *m.t);
    assert_non_null(m.v);
    assert_non_null(m.t);
    uint32_t seed = 1;
    for (int i = 0; i < m.vertices; i++) {
        m.t[i] = i;
        for (int k = 0; k < 3; k++) {
            seed = seed * 1664525u + 1013904223u;
            m.v[3 * i + k] = from->v[3 * from->t[i] + k] + noise * (seed / 4294967296.0 - 0.5);
        }
    }
    return m;
}

static void reverse(morph_mesh *m, int f) {
    const int swap = m->t[3 * f];
    m->t[3 * f] = m->t[3 * f + 1];
    m->t[3 * f + 1] = swap;
}

static morph_mesh box(double x, double y, double z) {
    const double size[3] = {x, y, z};
    morph_mesh m;
    assert_int_equal(morph_mesh_box(size, &m), MORPH_OK);
    return m;
}

static morph_mesh ball(double r, double error) {
    const double radii[3] = {r, r, r};
    morph_mesh m;
    assert_int_equal(morph_mesh_ellipsoid(radii, error, &m), MORPH_OK);
    return m;
}

static void soup_is_welded(void **state) {
    (void)state;
    morph_mesh b = ball(1, 1e-2), m = soup(&b, 1e-7);
    morph_mesh_report r;
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_OK);
    assert_false(r.closed);
    assert_int_equal(r.boundary_edges, 3 * b.triangles);
    assert_int_equal(r.components, b.triangles);
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_true(r.closed);
    assert_int_equal(r.vertices, b.vertices);
    assert_int_equal(m.vertices, b.vertices);
    assert_int_equal(r.triangles, b.triangles);
    assert_int_equal(r.welded, 3 * b.triangles - b.vertices);
    assert_int_equal(r.flipped, 0);
    assert_int_equal(r.degenerate, 0);
    assert_int_equal(r.components, 1);
    morph_mesh_free(&m);
    /* Too small a tolerance does not do it. */
    m = soup(&b, 1e-5);
    assert_int_equal(morph_mesh_mend(&m, 1e-7, &r), MORPH_OK);
    assert_false(r.closed);
    morph_mesh_free(&m);
    /* None merges what is exactly equal. */
    m = soup(&b, 0);
    assert_int_equal(morph_mesh_mend(&m, 0, &r), MORPH_OK);
    assert_true(r.closed);
    morph_mesh_free(&m);
    morph_mesh_free(&b);
}

static void orientation_is_mended(void **state) {
    (void)state;
    morph_mesh b = ball(1, 1e-2), m;
    morph_mesh_report r, good;
    assert_int_equal(morph_mesh_examine(&b, &good), MORPH_OK);
    assert_int_equal(morph_mesh_copy(&b, &m), MORPH_OK);
    for (int f = 0; f < m.triangles; f += 7)
        reverse(&m, f);
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_OK);
    assert_true(r.orientation_conflicts > 0);
    assert_false(r.closed);
    assert_int_equal(morph_mesh_mend(&m, 0, &r), MORPH_OK);
    assert_true(r.closed);
    assert_int_equal(r.flipped, (m.triangles + 6) / 7);
    assert_near(r.volume, good.volume, 1e-12);
    /* All of it inside out. */
    for (int f = 0; f < m.triangles; f++)
        reverse(&m, f);
    assert_int_equal(morph_mesh_mend(&m, 0, &r), MORPH_OK);
    assert_int_equal(r.flipped, m.triangles);
    assert_near(r.volume, good.volume, 1e-12);
    morph_mesh_free(&m);
    morph_mesh_free(&b);
}

static void parts_point_outward_each(void **state) {
    (void)state;
    morph_mesh a = box(1, 1, 1), b = box(0.5, 0.5, 0.5);
    for (int f = 0; f < b.triangles; f++)
        reverse(&b, f);
    morph_mesh_report r;
    /* Beside each other: the inward one is turned. */
    morph_mesh m = join(&a, &b, 2, 0, 0);
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_int_equal(r.components, 2);
    assert_int_equal(r.flipped, 12);
    assert_near(r.volume, 1.125, 1e-12);
    morph_mesh_free(&m);
    /* One in the other: a hollow, which stays inward. */
    m = join(&a, &b, 0.1, 0.1, 0.1);
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_true(r.closed);
    assert_int_equal(r.flipped, 0);
    assert_int_equal(r.self_intersections, 0);
    assert_near(r.volume, 0.875, 1e-12);
    morph_mesh_free(&m);
    /* Overlapping: both outward although corners of one lie inside the other; the crossing is reported. */
    m = join(&a, &b, 0.45, 0.41, 0.43);
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_true(r.self_intersections > 0);
    assert_near(r.volume, 1.125, 1e-12);
    morph_mesh_free(&m);
    morph_mesh_free(&a);
    morph_mesh_free(&b);
}

/* A band with half a twist: no orientation is consistent. */
static void moebius_strip_cannot_be_mended(void **state) {
    (void)state;
    enum { N = 24 };
    double v[6 * N];
    int t[6 * N];
    for (int i = 0; i < N; i++)
        for (int s = 0; s < 2; s++) {
            const double a = 2 * M_PI * i / N, w = s ? 0.3 : -0.3;
            v[6 * i + 3 * s] = (1 + w * cos(a / 2)) * cos(a);
            v[6 * i + 3 * s + 1] = (1 + w * cos(a / 2)) * sin(a);
            v[6 * i + 3 * s + 2] = w * sin(a / 2);
        }
    for (int i = 0; i < N; i++) {
        const int a = 2 * i, b = 2 * i + 1;
        const int c = i + 1 < N ? a + 2 : 1, d = i + 1 < N ? b + 2 : 0;
        const int quad[6] = {a, c, d, a, d, b};
        memcpy(t + 6 * i, quad, sizeof quad);
    }
    morph_mesh m = make(v, 2 * N, t, 2 * N);
    morph_mesh_report r;
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_true(r.orientation_conflicts > 0);
    assert_false(r.closed);
    assert_int_equal(r.boundary_edges, 2 * N);
    morph_mesh_free(&m);
}

static void two_solids_on_one_edge(void **state) {
    (void)state;
    morph_mesh a = box(1, 1, 1), m = join(&a, &a, 1, 1, 0);
    morph_mesh_report r;
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_int_equal(r.nonmanifold_edges, 1);
    assert_int_equal(r.welded, 2);
    assert_false(r.closed);
    morph_mesh_free(&m);
    /* On one corner: fine. */
    m = join(&a, &a, 1, 1, 1);
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_true(r.closed);
    assert_int_equal(r.components, 2);
    assert_near(r.volume, 2, 1e-12);
    morph_mesh_free(&m);
    morph_mesh_free(&a);
}

static void degenerate_triangles_go(void **state) {
    (void)state;
    /* A tetrahedron whose edge 0-1 has a further vertex 4 in one of its two faces only: the slit between is
     * covered by a triangle without area (0 4 1). Beside it a triangle that names a vertex twice, one with
     * two equal points, and a vertex that nothing uses. */
    const double v[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5, 0, 0, 1e-9, 0, 0, 9, 9, 9};
    const int t[] = {0, 2, 1, 0, 4, 3, 4, 1, 3, 0, 1, 4, 1, 2, 3, 0, 3, 2, 1, 1, 2, 0, 5, 2};
    morph_mesh m = make(v, 7, t, 8);
    morph_mesh_report r;
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_int_equal(r.degenerate, 3);
    assert_int_equal(r.vertices, 5);
    assert_int_equal(r.triangles, 6);
    assert_true(r.closed);
    assert_near(r.volume, 1.0 / 6, 1e-12);
    assert_near(r.hi[0], 1, 0);
    morph_mesh_free(&m);
}

/* A row of flat triangles over one edge: taken in one after the other. */
static void flat_fans_are_absorbed(void **state) {
    (void)state;
    enum { N = 9 };
    /* Tetrahedron 0 1 2 3; points on 0-1; face towards 3 uses them, face towards 2 does not. */
    double v[3 * (4 + N)] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    int t[3 * (4 + 2 * N)] = {0, 2, 1, 1, 2, 3, 0, 3, 2}, n = 3;
    for (int i = 0; i < N; i++)
        v[3 * (4 + i)] = (i + 1.0) / (N + 1);
    for (int i = 0; i <= N; i++) {
        const int a = i == 0 ? 0 : 3 + i, b = i == N ? 1 : 4 + i;
        const int face[3] = {a, b, 3}, flat[3] = {0, b, a};
        memcpy(t + 3 * n++, face, sizeof face);
        if (i > 0) memcpy(t + 3 * n++, flat, sizeof flat);
    }
    morph_mesh m = make(v, 4 + N, t, n);
    morph_mesh_report r;
    assert_int_equal(morph_mesh_mend(&m, 1e-9, &r), MORPH_OK);
    assert_true(r.closed);
    assert_int_equal(r.vertices, 4 + N);
    assert_true(r.degenerate >= N);
    assert_near(r.volume, 1.0 / 6, 1e-12);
    morph_mesh_free(&m);
}

static void open_meshes_are_counted(void **state) {
    (void)state;
    morph_mesh m = ball(1, 1e-2);
    morph_mesh_report r;
    m.triangles -= 2; /* two neighbours of the last belt */
    for (int f = 0; f < m.triangles; f++)
        reverse(&m, f);
    const int before = m.triangles;
    assert_int_equal(morph_mesh_mend(&m, 0, &r), MORPH_OK);
    assert_false(r.closed);
    assert_true(r.boundary_edges == 4 || r.boundary_edges == 6);
    /* Nearly closed, so outward is clear, and it is turned. */
    assert_int_equal(r.flipped, before);
    assert_true(r.volume > 0);
    morph_mesh_free(&m);
    /* A single square has no inside: it stays as it is. */
    const double v[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const int t[] = {0, 2, 1, 0, 3, 2};
    m = make(v, 4, t, 2);
    assert_int_equal(morph_mesh_mend(&m, 1e-6, &r), MORPH_OK);
    assert_int_equal(r.flipped, 0);
    assert_int_equal(r.boundary_edges, 4);
    assert_near(r.area, 1, 1e-15);
    morph_mesh_free(&m);
}

/* Crossings against all pairs: two interlocked tori, and a count that is known. */
static void crossings_are_counted(void **state) {
    (void)state;
    /* A needle through one triangle of a sheet of two: the needle's three long faces, of which each is cut
     * by that triangle. */
    const double v[] = {0,   0,   0,  1,    0,   0,  1,   1,    0,  0,   1,   0,
                        0.7, 0.2, -1, 0.75, 0.2, -1, 0.7, 0.25, -1, 0.7, 0.2, 1};
    const int t[] = {0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 5, 7, 5, 6, 7, 6, 4, 7};
    morph_mesh m = make(v, 8, t, 6);
    morph_mesh_report r;
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_OK);
    assert_int_equal(r.self_intersections, 3);
    morph_mesh_free(&m);
    /* Touching is no crossing: boxes face to face (not welded), and one on top of the other, shifted. */
    morph_mesh a = box(1, 1, 1);
    m = join(&a, &a, 1, 0, 0);
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_OK);
    assert_int_equal(r.self_intersections, 0);
    morph_mesh_free(&m);
    m = join(&a, &a, 0.3, 0.2, 1);
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_OK);
    assert_int_equal(r.self_intersections, 0);
    morph_mesh_free(&m);
    /* Linked rings do not cross; pushed together they do. */
    morph_mesh ring, turned;
    assert_int_equal(morph_mesh_torus(1, 0.2, 1e-2, &ring), MORPH_OK);
    assert_int_equal(morph_mesh_copy(&ring, &turned), MORPH_OK);
    for (int i = 0; i < turned.vertices; i++) {
        const double y = turned.v[3 * i + 1];
        turned.v[3 * i + 1] = -turned.v[3 * i + 2];
        turned.v[3 * i + 2] = y;
    }
    m = join(&ring, &turned, 1, 0, 0);
    assert_int_equal(morph_mesh_mend(&m, 1e-9, &r), MORPH_OK);
    assert_int_equal(r.self_intersections, 0);
    assert_int_equal(r.flipped, 0);
    morph_mesh_free(&m);
    m = join(&ring, &turned, 0.1, 0, 0);
    assert_int_equal(morph_mesh_mend(&m, 1e-9, &r), MORPH_OK);
    assert_true(r.self_intersections > 50);
    assert_int_equal(r.flipped, 0);
    morph_mesh_free(&m);
    morph_mesh_free(&ring);
    morph_mesh_free(&turned);
    morph_mesh_free(&a);
}

static void bad_meshes_are_refused(void **state) {
    (void)state;
    morph_mesh m = box(1, 1, 1);
    morph_mesh_report r;
    m.t[4] = 8;
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_ERR_INPUT);
    assert_int_equal(morph_mesh_mend(&m, 0, &r), MORPH_ERR_INPUT);
    m.t[4] = -1;
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_ERR_INPUT);
    m.t[4] = 0;
    assert_int_equal(morph_mesh_mend(&m, -1, &r), MORPH_ERR_INPUT);
    assert_int_equal(morph_mesh_mend(&m, NAN, &r), MORPH_ERR_INPUT);
    m.v[5] = NAN;
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_ERR_NONFINITE);
    assert_int_equal(morph_mesh_mend(&m, 0, &r), MORPH_ERR_NONFINITE);
    morph_mesh_free(&m);
    /* Nothing at all is no error, and no solid. */
    assert_int_equal(morph_mesh_examine(&m, &r), MORPH_OK);
    assert_false(r.closed);
    assert_int_equal(morph_mesh_mend(&m, 1, &r), MORPH_OK);
    assert_int_equal(r.components, 0);
    morph_mesh_free(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(soup_is_welded),           cmocka_unit_test(orientation_is_mended),
        cmocka_unit_test(parts_point_outward_each), cmocka_unit_test(moebius_strip_cannot_be_mended),
        cmocka_unit_test(two_solids_on_one_edge),   cmocka_unit_test(degenerate_triangles_go),
        cmocka_unit_test(flat_fans_are_absorbed),   cmocka_unit_test(open_meshes_are_counted),
        cmocka_unit_test(crossings_are_counted),    cmocka_unit_test(bad_meshes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
