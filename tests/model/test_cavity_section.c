/* Cuts through sheets and solids: areas in closed form, and their sum over all cuts is the volume. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "model/cavity_section.h"
#include "tests/support/cavity_sheet.h"

static morph_cavity *over_mesh(const sheet *h, morph_mesh *mesh, bool closed, double up, double base,
                               morph_distance **d) {
    morph_cavity *c;
    for (int i = 0; i < mesh->vertices; i++)
        mesh->v[3 * i + 2] += up;
    assert_int_equal(morph_distance_create(mesh, closed, d), MORPH_OK);
    assert_int_equal(morph_cavity_create(&h->s, *d, base, &c), MORPH_OK);
    morph_mesh_free(mesh);
    return c;
}

static morph_cavity_section cut(const morph_cavity *c, const sheet *h, int axis, double at) {
    morph_cavity_section s;
    assert_int_equal(morph_cavity_section_cut(c, h->x, axis, at, &s), MORPH_OK);
    double area = 0;
    for (int k = 0; k < s.cavities; k++) {
        const morph_trapezoid *t = &s.cavity[k];
        assert_true(t->u[0] < t->u[1]);
        for (int e = 0; e < 2; e++)
            assert_true(t->lo[e] <= t->hi[e] + 1e-15);
        area += 0.5 * (t->u[1] - t->u[0]) * (t->hi[0] - t->lo[0] + t->hi[1] - t->lo[1]);
    }
    assert_near(area, s.area, 1e-15);
    return s;
}

static double solid_area(const morph_cavity_section *s) {
    double area = 0;
    for (int k = 0; k < s->solids; k++) {
        const morph_trapezoid *t = &s->solid[k];
        area += 0.5 * (t->u[1] - t->u[0]) * (t->hi[0] - t->lo[0] + t->hi[1] - t->lo[1]);
    }
    return area;
}

/* A flat sheet over a box: through the box, beside it, and in the plane of its side. Closed and open meshes
 * say the same. */
static void test_box(void **state) {
    (void)state;
    sheet *h = sheet_make(0.25);
    for (int open = 0; open < 2; open++) {
        morph_mesh mesh;
        morph_distance *d;
        assert_int_equal(morph_mesh_box((double[3]){0.2, 0.3, 0.1}, &mesh), MORPH_OK);
        morph_cavity *c = over_mesh(h, &mesh, !open, 0.05, 0, &d);
        const double at[2][4] = {{0, 0.149, -0.151, 0.3}, {0.03, -0.099, 0.101, -0.3}};
        for (int axis = 0; axis < 2; axis++)
            for (int k = 0; k < 4; k++) {
                morph_cavity_section s = cut(c, h, axis, at[axis][k]);
                const double box = k < 2 ? (axis ? 0.3 : 0.2) * 0.1 : 0;
                assert_near(s.area, 0.8 * 0.25 - box, 1e-14);
                assert_near(solid_area(&s), box, 1e-14);
                double length = 0;
                for (int l = 0; l < s.lines; l++) {
                    length += fabs(s.line[l][1][0] - s.line[l][0][0]);
                    assert_true(s.line[l][0][1] == 0.25);
                }
                assert_near(length, 0.8, 1e-14);
                assert_true((s.outlines > 0) == (k < 2));
                morph_cavity_section_free(&s);
            }
        morph_cavity_destroy(c);
        morph_distance_destroy(d);
    }
    free(h);
}

/* In the plane of a side of the box, and through corners of triangles: one of the two neighbours, whole. */
static void test_planes_through_corners(void **state) {
    (void)state;
    sheet *h = sheet_make(0.25);
    morph_mesh mesh;
    morph_distance *d;
    assert_int_equal(morph_mesh_box((double[3]){0.2, 0.2, 0.1}, &mesh), MORPH_OK);
    morph_cavity *c = over_mesh(h, &mesh, true, 0.05, 0, &d);
    for (int k = 0; k < 5; k++) {
        morph_cavity_section s = cut(c, h, k % 2, h->x[3 * (k + 2)]);
        const double box = solid_area(&s);
        assert_true(fabs(box) < 1e-14 || fabs(box - 0.02) < 1e-14);
        assert_near(s.area + box, 0.2, 1e-14);
        morph_cavity_section_free(&s);
    }
    /* The border itself: the one side has all of it, the other nothing. */
    morph_cavity_section s = cut(c, h, 0, h->x[1]), t = cut(c, h, 0, h->x[3 * JOINTS - 2]);
    assert_near(s.area + t.area, 0.2, 1e-14);
    assert_true(s.area == 0 || t.area == 0);
    morph_cavity_section_free(&s);
    morph_cavity_section_free(&t);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

/* A ball that reaches through the sheet: the cut is a disc less its cap above the sheet. The ball's facets
 * are within 1e-6 of it. */
static void test_ball(void **state) {
    (void)state;
    sheet *h = sheet_make(0.3);
    morph_mesh mesh;
    morph_distance *d;
    const double r = 0.2, y = 0.05, disc = r * r - y * y, cap = acos(0.1 / sqrt(disc));
    assert_int_equal(morph_mesh_ellipsoid((double[3]){r, r, r}, 1e-6, &mesh), MORPH_OK);
    morph_cavity *c = over_mesh(h, &mesh, true, 0.2, 0, &d);
    for (int axis = 0; axis < 2; axis++) {
        morph_cavity_section s = cut(c, h, axis, y);
        const double below = disc * (M_PI - cap) + 0.1 * sqrt(disc - 0.01);
        assert_near(solid_area(&s), M_PI * disc, 2e-6);
        assert_near(s.area, 0.8 * 0.3 - below, 2e-6);
        morph_cavity_section_free(&s);
    }
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

/* A crumpled sheet, in and out of a ball, with a base and shut off by a fan: cut after cut, the areas sum to
 * the cavity volume. Both sums stand in the same places across; along the cut the columns are the coarser
 * ones, and their error falls. */
static void test_sum_is_volume(void **state) {
    (void)state;
    sheet *h = sheet_make(0);
    for (int i = 0; i < JOINTS; i++) {
        double *p = h->x + 3 * i;
        p[2] = 0.22 + 0.1 * sin(9.0 * p[0] + i) * cos(7.0 * p[1]);
        p[0] += 0.08 * sin(5.0 * i); /* folds over itself in places */
        p[1] += 0.03 * cos(3.0 * i);
    }
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < JOINTS; i++)
        for (int k = 0; k < 2; k++) {
            lo[k] = fmin(lo[k], h->x[3 * i + k]);
            hi[k] = fmax(hi[k], h->x[3 * i + k]);
        }
    for (int variant = 0; variant < 4; variant++) {
        const int axis = variant % 2;
        morph_mesh mesh;
        morph_distance *d;
        assert_int_equal(morph_mesh_ellipsoid((double[3]){0.2, 0.25, 0.15}, 1e-3, &mesh), MORPH_OK);
        morph_cavity *c = over_mesh(h, &mesh, true, 0.15, variant < 2 ? 0.02 : NAN, &d);
        const double cell = 0.1 / 16, wide = hi[1 - axis] - lo[1 - axis];
        const int n = (int)ceil(wide / cell);
        double sum = 0, volume;
        for (int k = 0; k < n; k++) {
            morph_cavity_section s = cut(c, h, axis, lo[1 - axis] + (k + 0.5) * wide / n);
            sum += s.area * wide / n;
            morph_cavity_section_free(&s);
        }
        assert_int_equal(morph_cavity_volume(c, h->x, cell, &volume), MORPH_OK);
        print_message("along %c, %s: cuts %.6f, columns %.6f m3\n", axis ? 'y' : 'x',
                      variant < 2 ? "base" : "fan", sum, volume);
        assert_true(volume > 0.005);
        assert_near(sum, volume, 2e-3 * volume);
        morph_cavity_destroy(c);
        morph_distance_destroy(d);
    }
    free(h);
}

static void test_refusals(void **state) {
    (void)state;
    sheet *h = sheet_make(0.25);
    morph_mesh mesh;
    morph_distance *d;
    morph_cavity_section s;
    assert_int_equal(morph_mesh_box((double[3]){0.2, 0.2, 0.1}, &mesh), MORPH_OK);
    morph_cavity *c = over_mesh(h, &mesh, true, 0.05, 0, &d);
    assert_int_equal(morph_cavity_section_cut(c, h->x, 2, 0, &s), MORPH_ERR_INPUT);
    assert_int_equal(morph_cavity_section_cut(c, h->x, 0, NAN, &s), MORPH_ERR_INPUT);
    /* Beside everything: nothing is cut. */
    assert_int_equal(morph_cavity_section_cut(c, h->x, 0, 5, &s), MORPH_OK);
    assert_true(s.cavities == 0 && s.solids == 0 && s.lines == 0 && s.outlines == 0 && s.area == 0);
    morph_cavity_section_free(&s);
    h->x[4] = INFINITY;
    assert_int_equal(morph_cavity_section_cut(c, h->x, 0, 0, &s), MORPH_ERR_NONFINITE);
    assert_null(s.cavity);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box),      cmocka_unit_test(test_planes_through_corners),
        cmocka_unit_test(test_ball),     cmocka_unit_test(test_sum_is_volume),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
