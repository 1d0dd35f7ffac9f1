/* Connected cavities of sheets and solids whose air is known in closed form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "model/cavity_parts.h"
#include "tests/support/cavity_sheet.h"

/* Boxes that do not touch, as one closed mesh. */
static morph_distance *boxes(const double (*lo)[3], const double (*hi)[3], int n) {
    static const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    double v[24 * 4];
    int t[36 * 4];
    assert_true(n <= 4);
    for (int b = 0; b < n; b++) {
        for (int i = 0; i < 8; i++)
            for (int k = 0; k < 3; k++)
                v[24 * b + 3 * i + k] = i >> k & 1 ? hi[b][k] : lo[b][k];
        for (int i = 0; i < 36; i++)
            t[36 * b + i] = faces[i / 3][i % 3] + 8 * b;
    }
    const morph_mesh mesh = {8 * n, 12 * n, v, t};
    morph_distance *d;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    return d;
}

static morph_distance *solid(morph_mesh *mesh, double up) {
    for (int i = 0; i < mesh->vertices; i++)
        mesh->v[3 * i + 2] += up;
    morph_distance *d;
    assert_int_equal(morph_distance_create(mesh, true, &d), MORPH_OK);
    return d;
}

static morph_cavity_parts find(const sheet *h, const morph_distance *target, double base, double cell,
                               double least, double share) {
    morph_cavity *c;
    morph_cavity_parts parts;
    double volume;
    assert_int_equal(morph_cavity_create(&h->s, target, base, &c), MORPH_OK);
    assert_int_equal(morph_cavity_parts_find(c, h->x, cell, least, share, &parts), MORPH_OK);
    assert_int_equal(morph_cavity_volume(c, h->x, cell, &volume), MORPH_OK);
    morph_cavity_destroy(c);
    /* Always: the parts make the whole, and the whole is the cavity volume; largest first. */
    double sum = parts.film + parts.small;
    for (int k = 0; k < parts.count; k++) {
        sum += parts.part[k].volume;
        if (k > 0) assert_true(parts.part[k].volume <= parts.part[k - 1].volume);
    }
    assert_near(parts.volume, volume, 1e-14 * volume);
    assert_near(sum, volume, 1e-12 * volume);
    return parts;
}

/* A wall through the sheet, off the middle: a box of air on either side. */
static void test_two_boxes(void **state) {
    (void)state;
    sheet *h = sheet_make(0.2);
    morph_distance *d = boxes(&(double[3]){0.1, -1, -0.1}, &(double[3]){0.15, 1, 0.5}, 1);
    morph_cavity_parts p = find(h, d, 0, SPACING / 16, 0, 0);
    assert_int_equal(p.count, 2);
    const double width[2] = {0.5, 0.25}, middle[2] = {-0.15, 0.275}, from[2] = {-0.4, 0.15};
    for (int k = 0; k < 2; k++) {
        const morph_cavity_part *a = &p.part[k];
        assert_near(a->volume, width[k] * 0.8 * 0.2, 1e-13);
        assert_near(a->at[0], middle[k], 1e-13);
        assert_near(a->at[1], 0, 1e-13);
        assert_near(a->at[2], 0.1, 1e-13);
        assert_near(a->height, 0.2, 1e-15);
        assert_near(a->area, width[k] * 0.8, 1e-13);
        assert_int_equal(a->columns, lround(width[k] * 160 * 128));
        assert_near(a->lo[0], from[k], 1e-13);
        assert_near(a->hi[0], from[k] + width[k], 1e-13);
        assert_near(a->lo[1], -0.4, 1e-13);
        assert_near(a->hi[2], 0.2, 1e-13);
    }
    assert_true(p.film == 0 && p.small == 0);
    morph_cavity_parts_free(&p);
    /* The smaller one has a third of the air. */
    p = find(h, d, 0, SPACING / 16, 0, 0.34);
    assert_int_equal(p.count, 1);
    assert_near(p.small, 0.25 * 0.8 * 0.2, 1e-13);
    morph_cavity_parts_free(&p);
    morph_distance_destroy(d);
    free(h);
}

/* Air round a cylinder that reaches through the sheet is one ring; its centroid is in the cylinder. The
 * error of volume and height of the centroid falls with the columns. */
static void test_ring(void **state) {
    (void)state;
    sheet *h = sheet_make(0.2);
    morph_mesh mesh;
    assert_int_equal(morph_mesh_cylinder(0.23, 0.6, 1e-6, &mesh), MORPH_OK);
    morph_distance *d = solid(&mesh, 0.25);
    const double want = 0.2 * (0.64 - M_PI * 0.23 * 0.23);
    double error[3];
    for (int i = 0; i < 3; i++) {
        morph_cavity_parts p = find(h, d, 0, SPACING / (4 << 2 * i), 0, 0);
        assert_int_equal(p.count, 1);
        error[i] = fabs(p.part[0].volume / want - 1);
        for (int k = 0; k < 2; k++)
            assert_near(p.part[0].at[k], 0, 1e-12);
        assert_near(p.part[0].at[2], 0.1, 1e-12);
        morph_cavity_parts_free(&p);
    }
    print_message("ring, columns 1/4, 1/16, 1/64 of the spacing: %.1e %.1e %.1e\n", error[0], error[1],
                  error[2]);
    assert_true(error[1] < 3e-3 && error[2] < 3e-4);
    /* Cut by two walls from the cylinder to beyond the border, it is two halves. */
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    d = boxes((const double[3][3]){{-0.2, -0.2, -0.1}, {0.21, -0.1, -0.1}, {-0.9, -0.1, -0.1}},
              (const double[3][3]){{0.2, 0.2, 0.4}, {0.9, 0.1, 0.4}, {-0.21, 0.1, 0.4}}, 3);
    morph_cavity_parts p = find(h, d, 0, SPACING / 16, 0, 0);
    assert_int_equal(p.count, 1); /* a slit a hundredth wide stays open beside each wall */
    morph_cavity_parts_free(&p);
    p = find(h, d, 0, SPACING / 4.0, 0, 0);
    assert_int_equal(p.count, 2); /* which columns 0.025 wide do not see */
    assert_near(p.part[0].at[1], -p.part[1].at[1], 1e-12);
    morph_cavity_parts_free(&p);
    morph_distance_destroy(d);
    free(h);
}

/* A sheet that lies on two bumps across its width: the film of its half-thickness over them joins the air
 * of three cavities, unless films are told apart. */
static void test_two_bumps(void **state) {
    (void)state;
    sheet *h = sheet_make(0.154);
    morph_distance *d = boxes((const double[2][3]){{-0.2, -1, -0.1}, {0.1, -1, -0.1}},
                              (const double[2][3]){{-0.1, 1, 0.15}, {0.2, 1, 0.15}}, 2);
    morph_cavity_parts p = find(h, d, 0, SPACING / 16, 0, 0);
    assert_int_equal(p.count, 1);
    assert_near(p.part[0].volume, 0.8 * (0.6 * 0.154 + 0.2 * 0.004), 1e-13);
    morph_cavity_parts_free(&p);
    assert_near(morph_cavity_film(&h->s), 0.009, 1e-15);
    p = find(h, d, 0, SPACING / 16, morph_cavity_film(&h->s), 0);
    assert_int_equal(p.count, 3);
    assert_near(p.film, 0.8 * 0.2 * 0.004, 1e-13);
    double middle = 0;
    for (int k = 0; k < 3; k++) {
        assert_near(p.part[k].volume, 0.8 * 0.2 * 0.154, 1e-13);
        middle += fabs(p.part[k].at[0]);
    }
    assert_near(middle, 0.6, 1e-12); /* -0.3, 0, 0.3 */
    morph_cavity_parts_free(&p);
    /* The film is just not high enough to be left out. */
    p = find(h, d, 0, SPACING / 16, 0.004 - 1e-9, 0);
    assert_int_equal(p.count, 1);
    morph_cavity_parts_free(&p);
    morph_distance_destroy(d);
    free(h);
}

/* A shelf: the same columns hold air above and beneath it. One cavity where it ends under the sheet, two
 * where it does not, and no way leads from one to the other in plan alone. */
static void test_shelf(void **state) {
    (void)state;
    sheet *h = sheet_make(0.3);
    for (int wide = 0; wide < 2; wide++) {
        const double end = wide ? 1 : 0.2;
        morph_distance *d = boxes(&(double[3]){-1, -1, 0.1}, &(double[3]){end, 1, 0.15}, 1);
        morph_cavity_parts p = find(h, d, 0, SPACING / 16, 0, 0);
        assert_int_equal(p.count, wide ? 2 : 1);
        if (wide) {
            assert_near(p.part[0].volume, 0.64 * 0.15, 1e-13);
            assert_near(p.part[0].at[2], 0.225, 1e-13);
            assert_near(p.part[1].volume, 0.64 * 0.1, 1e-13);
            assert_near(p.part[1].at[2], 0.05, 1e-13);
        } else {
            assert_near(p.part[0].volume, 0.64 * 0.3 - 0.8 * 0.6 * 0.05, 1e-13);
            assert_int_equal(p.part[0].columns, 128 * 128); /* not twice where there are two pieces */
            assert_near(p.part[0].height, 0.3, 1e-15);
        }
        morph_cavity_parts_free(&p);
        morph_distance_destroy(d);
    }
    free(h);
}

/* Two peaks of the sheet itself and a valley between them that goes below the border, no base: the fan shuts
 * the peaks off at the border's height, and the valley is outside. Turned, so that
 * nothing lines up; each peak's volume is that of its prisms. */
static void test_peaks_converge(void **state) {
    (void)state;
    sheet *h = sheet_make(0);
    double want[2] = {0};
    for (int i = 0; i < JOINTS; i++) {
        const double *s = h->start + 3 * i;
        double *p = h->x + 3 * i;
        const double v = fabs(s[1]) / HALF, along = fabs(s[0]);
        const double tall = along < 0.05 ? -0.05 : fabs(along - 0.2) > 0.05 ? 0 : s[0] < 0 ? 0.2 : 0.1;
        p[2] = tall * (1 - v * v);
        p[0] = cos(0.3) * s[0] - sin(0.3) * s[1];
        p[1] = sin(0.3) * s[0] + cos(0.3) * s[1];
    }
    for (int t = 0; t < h->s.skin_triangles; t++) {
        double z = 0, x = 0;
        for (int k = 0; k < 3; k++) {
            z += h->x[3 * h->skin[t][k] + 2] / 3;
            x += h->start[3 * h->skin[t][k]];
        }
        if (z > 0) want[x > 0] += z * SPACING * SPACING / 2;
    }
    morph_distance *d = boxes(&(double[3]){-0.1, -0.1, -0.9}, &(double[3]){0.1, 0.1, -0.8}, 1);
    double error[3];
    for (int i = 0; i < 3; i++) {
        morph_cavity_parts p = find(h, d, NAN, SPACING / (4 << 2 * i), 0, 0.01);
        assert_int_equal(p.count, 2);
        error[i] = fmax(fabs(p.part[0].volume / want[0] - 1), fabs(p.part[1].volume / want[1] - 1));
        assert_true(p.part[0].at[0] < -0.15 && p.part[1].at[0] > 0.15);
        morph_cavity_parts_free(&p);
    }
    print_message("two peaks, columns 1/4, 1/16, 1/64 of the spacing: %.1e %.1e %.1e\n", error[0], error[1],
                  error[2]);
    assert_true(error[1] < 3e-3 && error[2] < 3e-4 && error[2] < error[0] / 10);
    morph_distance_destroy(d);
    free(h);
}

/* What cannot be: and where there is no air, there is no cavity. */
static void test_refusals(void **state) {
    (void)state;
    sheet *h = sheet_make(0.2);
    morph_distance *d = boxes(&(double[3]){-1, -1, -1}, &(double[3]){1, 1, 1}, 1);
    morph_cavity *c;
    morph_cavity_parts p;
    assert_int_equal(morph_cavity_create(&h->s, d, 0, &c), MORPH_OK);
    assert_int_equal(morph_cavity_parts_find(c, h->x, 0.01, 0, 0, &p), MORPH_OK);
    assert_int_equal(p.count, 0);
    assert_true(p.volume == 0);
    morph_cavity_parts_free(&p);
    const double bad[3][3] = {{0, 0, 0}, {0.01, -1, 0}, {0.01, 0, NAN}};
    for (int k = 0; k < 3; k++)
        assert_int_equal(morph_cavity_parts_find(c, h->x, bad[k][0], bad[k][1], bad[k][2], &p),
                         MORPH_ERR_INPUT);
    h->x[7] = NAN;
    assert_int_equal(morph_cavity_parts_find(c, h->x, 0.01, 0, 0, &p), MORPH_ERR_NONFINITE);
    assert_null(p.part);
    morph_cavity_destroy(c);
    morph_distance_destroy(d);
    free(h);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_boxes),      cmocka_unit_test(test_ring),
        cmocka_unit_test(test_two_bumps),      cmocka_unit_test(test_shelf),
        cmocka_unit_test(test_peaks_converge), cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
