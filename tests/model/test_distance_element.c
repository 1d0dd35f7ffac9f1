/* Distance of segments and triangles: exact when clear, no crossing missed. */
#include "tests/model/solids.h"

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
    /* 1e-6 of the size, or what is left where the search ends early. */
    assert_true(c.distance <= least + 2e-4 * size);
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

/* With any hint: the same distance where it is no more than asked for, else a true lower bound beyond that.
 */
static void test_hinted_elements(void **state) {
    (void)state;
    const double radii[3] = {0.7, 0.5, 0.3}, enough = 0.15;
    int bounded = 0, found = 0, inside = 0;
    morph_mesh mesh = {0};
    morph_distance *d;
    assert_int_equal(morph_mesh_ellipsoid(radii, 0.01, &mesh), MORPH_OK);
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    for (int trial = 0; trial < 1200; trial++) {
        double corner[3][3], middle[3], w[3] = {0.0}, hint[3] = {0.0};
        const int n = 2 + trial % 2;
        morph_closest exact, hinted;
        random_point(-0.9, 0.9, middle);
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                corner[j][k] = middle[k] + uniform(-0.1, 0.1);
        hint[trial % n] = 0.75;
        hint[(trial + 1) % n] = 0.25;
        if (n == 2)
            morph_distance_segment(d, corner[0], corner[1], w, &exact);
        else
            morph_distance_triangle(d, corner[0], corner[1], corner[2], w, &exact);
        morph_distance_element(d, (const double(*)[3])corner, n, enough, hint, &hinted);
        if (hinted.triangle < 0) {
            assert_true(hinted.distance >= enough && hinted.distance <= exact.distance + 1e-12);
            bounded++;
        } else {
            assert_true(fabs(hinted.distance - exact.distance) <= 1e-12);
            found++;
        }
        inside += exact.distance < 0.0;
    }
    assert_true(bounded > 20 && found > 20 && inside > 20);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
}

/* A ball is convex, as an open surface it is not, nor with one vertex pushed in. */
static void test_convex(void **state) {
    (void)state;
    const double radii[3] = {1.0, 0.7, 0.5};
    morph_mesh mesh;
    morph_distance *d;
    assert_int_equal(morph_mesh_ellipsoid(radii, 0.01, &mesh), MORPH_OK);
    for (int round = 0; round < 3; round++) {
        for (int k = 0; k < 3 && round == 2; k++)
            mesh.v[3 * (mesh.vertices / 2) + k] *= 0.95;
        assert_int_equal(morph_distance_create(&mesh, round != 1, &d), MORPH_OK);
        assert_int_equal(morph_distance_convex(d), round == 0);
        morph_distance_destroy(d);
    }
    morph_mesh_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_elements_against_brute_force),
        cmocka_unit_test(test_no_crossing_is_missed),
        cmocka_unit_test(test_pierced_by_vertices_and_edges),
        cmocka_unit_test(test_lattice_degeneracies),
        cmocka_unit_test(test_element_wholly_inside),
        cmocka_unit_test(test_segment_pairs),
        cmocka_unit_test(test_hinted_elements),
        cmocka_unit_test(test_convex),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
