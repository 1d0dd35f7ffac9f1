/* Tetrahedral meshes: orientation, surface, faults, and filling of solids. */
#include "model/tetra.h"
#include "solids.h"

static const double CUBE[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
/* Five tetrahedra; the second and the last are given inside out. */
static const int FIVE[5][4] = {{0, 1, 2, 5}, {0, 3, 2, 7}, {0, 5, 7, 4}, {2, 7, 5, 6}, {0, 5, 2, 7}};

static double surface_volume(const morph_tetra *m) {
    double sum = 0.0;
    for (int t = 0; t < m->triangles; t++) {
        double n[3];
        morph_cross(&m->v[3 * m->triangle[t][0]], &m->v[3 * m->triangle[t][1]], n);
        sum += morph_dot(n, &m->v[3 * m->triangle[t][2]]) / 6.0;
    }
    return sum;
}

/* Closed: every directed edge of the surface has its opposite; all volumes positive; the surface encloses the
 * sum of the tetrahedra. */
static void assert_sound(const morph_tetra *m, const morph_tetra_report *r) {
    assert_int_equal(r->fault, MORPH_TETRA_SOUND);
    double sum = 0.0;
    for (int t = 0; t < m->tets; t++) {
        assert_true(morph_tetra_volume(m->v, m->tet[t]) > 0.0);
        sum += morph_tetra_volume(m->v, m->tet[t]);
    }
    assert_near(sum, r->volume, 1e-12 * sum);
    assert_near(surface_volume(m), sum, 1e-9 * sum);
    long balance = 0;
    for (int t = 0; t < m->triangles; t++)
        for (int k = 0; k < 3; k++) {
            const long a = m->triangle[t][k], b = m->triangle[t][(k + 1) % 3];
            balance += (a * 7919 + b * 104729) * (a < b ? 1 : 0) - (b * 7919 + a * 104729) * (a < b ? 0 : 1);
        }
    assert_int_equal(balance, 0);
    for (int i = 1; i < m->surface_vertices; i++)
        assert_true(m->surface[i] > m->surface[i - 1]);
    for (int t = 0; t < m->triangles; t++) {
        int found = 0;
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 4; j++)
                found += m->tet[m->behind[t]][j] == m->triangle[t][k];
        assert_int_equal(found, 3);
    }
}

static void test_create(void **state) {
    (void)state;
    morph_tetra m;
    morph_tetra_report r;
    double v[10][3];
    memcpy(v, CUBE, sizeof CUBE);
    memcpy(v[8], CUBE[0], sizeof v[8]); /* of no tetrahedron */
    memcpy(v[9], CUBE[1], sizeof v[9]);
    assert_int_equal(morph_tetra_create(10, v[0], 5, FIVE, &m, &r), MORPH_OK);
    assert_sound(&m, &r);
    assert_int_equal(r.unused, 2);
    assert_true(r.flipped >= 1 && r.flipped < 5);
    assert_int_equal(m.vertices, 8);
    assert_int_equal(m.triangles, 12);
    assert_int_equal(m.surface_vertices, 8);
    assert_near(r.volume, 1.0, 1e-15);
    /* The middle one is regular, the others right-angled corners. */
    assert_near(r.least_angle, atan(sqrt(2.0)), 1e-12);
    assert_near(r.most_angle, 0.5 * M_PI, 1e-12);
    assert_near(morph_tetra_quality(m.v, m.tet[4]), 1.0, 1e-12);
    assert_near(r.least_quality, 12 * pow(0.5, 2.0 / 3.0) / 9, 1e-12);
    morph_tetra_free(&m);
    morph_tetra_free(&m);
}

static void refused(int n, const double *v, int m, const int (*tet)[4], morph_tetra_fault fault, int where) {
    morph_tetra mesh;
    morph_tetra_report r;
    assert_int_equal(morph_tetra_create(n, v, m, tet, &mesh, &r), MORPH_ERR_INPUT);
    assert_int_equal(r.fault, fault);
    assert_int_equal(r.where, where);
    assert_null(mesh.v);
    assert_null(mesh.tet);
    assert_null(mesh.triangle);
}

static void test_refused(void **state) {
    (void)state;
    double v[8][3];
    int tet[6][4];
    memcpy(v, CUBE, sizeof v);
    memcpy(tet, FIVE, sizeof FIVE);
    refused(3, v[0], 1, (const int(*)[4])tet, MORPH_TETRA_EMPTY, 0);
    refused(8, v[0], 0, (const int(*)[4])tet, MORPH_TETRA_EMPTY, 0);
    tet[3][2] = 8;
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_RANGE, 3);
    tet[3][2] = -1;
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_RANGE, 3);
    tet[3][2] = tet[3][0];
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_RANGE, 3);
    memcpy(tet, FIVE, sizeof FIVE);
    v[6][1] = NAN;
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_NONFINITE, 6);
    v[6][1] = 1e70;
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_NONFINITE, 6);
    memcpy(v, CUBE, sizeof v);
    memcpy(v[3], v[0], sizeof v[3]);
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_FLAT, 1);
    memcpy(v, CUBE, sizeof v);
    v[4][0] = 0.5, v[4][1] = 0.5, v[4][2] = 0.5; /* the corner beyond 0 5 7 folded inwards */
    refused(8, v[0], 5, (const int(*)[4])tet, MORPH_TETRA_OVERLAP, 2);
    memcpy(v, CUBE, sizeof v);
    memcpy(tet[5], tet[4], sizeof tet[5]);
    tet[5][3] = 6;
    refused(8, v[0], 6, (const int(*)[4])tet, MORPH_TETRA_CROWDED, 0);
}

static void fill(const char *name, const morph_mesh *mesh, double cell, double volume, double within,
                 double quality) {
    morph_distance *d;
    morph_tetra m, again;
    morph_tetra_report r, s;
    assert_int_equal(morph_distance_create(mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, cell, &m, &r), MORPH_OK);
    print_message(
        "%-10s cell %.3f: %5d vertices %6d tets, volume %+.2f %%, quality %.2f least %.2f mean, "
        "angles %.0f to %.0f\n",
        name, cell, m.vertices, m.tets, 100 * (r.volume / volume - 1), r.least_quality, r.mean_quality,
        r.least_angle * 180 / M_PI, r.most_angle * 180 / M_PI);
    assert_sound(&m, &r);
    assert_true(r.least_quality > quality);
    assert_near(r.volume, volume, within * volume);
    for (int i = 0; i < m.surface_vertices; i++) {
        morph_closest at;
        morph_distance_point(d, &m.v[3 * m.surface[i]], &at);
        assert_near(at.distance, 0.0, 1e-8 * cell);
    }
    /* The same bits again. */
    assert_int_equal(morph_tetra_fill(d, cell, &again, &s), MORPH_OK);
    assert_int_equal(again.vertices, m.vertices);
    assert_memory_equal(again.v, m.v, 3 * (size_t)m.vertices * sizeof *m.v);
    assert_memory_equal(again.tet, m.tet, (size_t)m.tets * sizeof *m.tet);
    morph_tetra_free(&again);
    morph_tetra_free(&m);
    morph_distance_destroy(d);
}

static void test_primitives(void **state) {
    (void)state;
    morph_mesh mesh;
    const double size[3] = {1.0, 0.7, 0.5}, ball[3] = {0.5, 0.5, 0.5}, egg[3] = {0.6, 0.4, 0.3};
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    fill("box", &mesh, 0.12, 0.35, 1e-12, 0.3);
    fill("box", &mesh, 0.5, 0.35, 1e-12, 0.3);
    morph_mesh_free(&mesh);
    assert_int_equal(morph_mesh_ellipsoid(ball, 1e-4, &mesh), MORPH_OK);
    fill("sphere", &mesh, 0.15, M_PI / 6, 0.05, 0.3);
    fill("sphere", &mesh, 0.06, M_PI / 6, 0.01, 0.3);
    morph_mesh_free(&mesh);
    assert_int_equal(morph_mesh_ellipsoid(egg, 1e-4, &mesh), MORPH_OK);
    fill("ellipsoid", &mesh, 0.12, 4.0 / 3 * M_PI * 0.072, 0.05, 0.3);
    morph_mesh_free(&mesh);
    assert_int_equal(morph_mesh_cylinder(0.5, 1.0, 1e-3, &mesh), MORPH_OK);
    fill("cylinder", &mesh, 0.15, M_PI * 0.25, 0.05, 0.1);
    morph_mesh_free(&mesh);
    assert_int_equal(morph_mesh_cone(0.5, 1.0, 1e-3, &mesh), MORPH_OK);
    fill("cone", &mesh, 0.12, M_PI * 0.25 / 3, 0.05, 0.1);
    morph_mesh_free(&mesh);
    assert_int_equal(morph_mesh_torus(0.5, 0.2, 1e-3, &mesh), MORPH_OK);
    fill("torus", &mesh, 0.12, 2 * M_PI * M_PI * 0.5 * 0.04, 0.06, 0.25);
    morph_mesh_free(&mesh);
    assert_int_equal(morph_mesh_capsule(0.3, 1.2, 1e-3, &mesh), MORPH_OK);
    fill("capsule", &mesh, 0.12, M_PI * 0.09 * 0.6 + 4.0 / 3 * M_PI * 0.027, 0.05, 0.25);
    morph_mesh_free(&mesh);
}

/* A box turned out of the lattice: its edges are snapped to. */
static void test_turned_box(void **state) {
    (void)state;
    morph_mesh mesh;
    const double size[3] = {1.0, 0.7, 0.5}, c = cos(0.5), s = sin(0.5);
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    for (int i = 0; i < mesh.vertices; i++) {
        double *p = &mesh.v[3 * i];
        const double x = c * p[0] - s * p[1], y = s * p[0] + c * p[1];
        p[0] = x, p[1] = c * y - s * p[2], p[2] = s * y + c * p[2];
    }
    fill("turned", &mesh, 0.1, 0.35, 0.03, 0.1);
    morph_mesh_free(&mesh);
}

static void test_fill_refused(void **state) {
    (void)state;
    morph_mesh mesh;
    morph_distance *d;
    morph_tetra m;
    morph_tetra_report r;
    const double size[3] = {1.0, 1.0, 1.0};
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    const double bad[] = {0.0, -1.0, NAN, INFINITY, 1e-3, 1e-300};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(morph_tetra_fill(d, bad[i], &m, &r), MORPH_ERR_INPUT);
        assert_int_equal(r.fault, MORPH_TETRA_COARSE);
        assert_null(m.v);
    }
    /* One cell for all of it is enough. */
    assert_int_equal(morph_tetra_fill(d, 5.0, &m, &r), MORPH_OK);
    assert_near(r.volume, 1.0, 1e-12);
    morph_tetra_free(&m);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_create), cmocka_unit_test(test_refused),
                                       cmocka_unit_test(test_primitives), cmocka_unit_test(test_turned_box),
                                       cmocka_unit_test(test_fill_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
