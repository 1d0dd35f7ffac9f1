/* Exact distance of points against brute force, winding numbers, vertical lines. */
#include "tests/model/solids.h"

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

/* A real mesh: pseudonormals and winding number, independent of each other, must agree everywhere. */
static void test_real_mesh(void **state) {
    (void)state;
    FILE *file = fopen(MORPH_SHARED_DIR "/models/spot_low_resolution.obj", "r");
    if (!file) {
        print_message("skipped: no " MORPH_SHARED_DIR "/models/spot_low_resolution.obj\n");
        skip();
    }
    char line[256];
    made.nv = made.nt = 0;
    while (fgets(line, sizeof line, file)) {
        double p[3];
        int t[3];
        if (sscanf(line, "v %lf %lf %lf", p, p + 1, p + 2) == 3) vertex(p[0], p[1], p[2]);
        if (sscanf(line, "f %d%*[^ ] %d%*[^ ] %d", t, t + 1, t + 2) == 3 ||
            sscanf(line, "f %d %d %d", t, t + 1, t + 2) == 3)
            triangle(t[0] - 1, t[1] - 1, t[2] - 1);
    }
    fclose(file);
    assert_int_equal(made.nt, 1654);
    morph_distance *d = finish(true);
    int inside = 0;
    for (int i = 0; i < 2000; i++) {
        double p[3];
        random_point(-1, 1, p);
        morph_closest c;
        morph_distance_point(d, p, &c);
        assert_near(c.distance, brute(morph_distance_mesh(d), p), 1e-13);
        inside += c.distance < 0;
        double z[64];
        int sign[64];
        assert_int_equal(morph_vertical_hits(d, p[0], p[1], z, sign, 64) % 2, 0);
    }
    assert_true(inside > 50);
    morph_distance_destroy(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_against_brute_force),
        cmocka_unit_test(test_normal_is_gradient),
        cmocka_unit_test(test_on_surface),
        cmocka_unit_test(test_scales),
        cmocka_unit_test(test_lipschitz),
        cmocka_unit_test(test_vertical_hits_always_pair),
        cmocka_unit_test(test_winding),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_odd_meshes),
        cmocka_unit_test(test_real_mesh),
        cmocka_unit_test(test_speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
