/* The reach check on targets whose numbers are known: lengths, slopes, holes, bumps, overhangs, held lines;
 * and that each limit, moved, changes the verdict. */
#include "model/reach.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define CLOSE 0.02 /* relative: the grid's cells are an eighth of the spacing */

static morph_structure_def sheet(void) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 8;
    return def;
}

static void move(morph_mesh *mesh, double x, double y, double z) {
    for (int i = 0; i < mesh->vertices; i++) {
        mesh->v[3 * i] += x;
        mesh->v[3 * i + 1] += y;
        mesh->v[3 * i + 2] += z;
    }
}

/* mesh is freed. */
static morph_reach check_at(const morph_structure_def *def, morph_mesh *mesh, double base, double frame) {
    morph_structure *s;
    morph_distance *d;
    morph_reach reach;
    assert_int_equal(morph_structure_create(def, &s), MORPH_OK);
    assert_int_equal(morph_distance_create(mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_reach_check(s, d, base, frame, &reach), MORPH_OK);
    morph_distance_destroy(d);
    morph_structure_destroy(s);
    morph_mesh_free(mesh);
    return reach;
}

static morph_mesh box(double x, double y, double z) {
    morph_mesh mesh;
    assert_int_equal(morph_mesh_box((double[3]){x, y, z}, &mesh), MORPH_OK);
    move(&mesh, 0, 0, 0.5 * z);
    return mesh;
}

static morph_mesh cone(double radius, double height) {
    morph_mesh mesh;
    assert_int_equal(morph_mesh_cone(radius, height, 1e-4, &mesh), MORPH_OK);
    move(&mesh, 0, 0, 0.5 * height);
    return mesh;
}

static morph_reach check(morph_mesh mesh) {
    const morph_structure_def def = sheet();
    return check_at(&def, &mesh, 0.0, 1.0);
}

static void assert_near(double value, double wanted, double relative) {
    if (!(fabs(value - wanted) <= relative * fabs(wanted))) fail_msg("%.6g instead of %.6g", value, wanted);
}

static void test_box(void **state) {
    (void)state;
    const morph_reach r = check(box(0.35, 0.3, 0.3));
    assert_true(r.within);
    assert_true(r.coverage == 1.0);
    assert_near(r.item[MORPH_REACH_LENGTH].number, 0.35, 1e-9);
    assert_near(r.item[MORPH_REACH_LENGTH].limit, 7 * 0.135, 1e-12);
    assert_false(r.item[MORPH_REACH_LENGTH].along_y);
    assert_near(r.item[MORPH_REACH_STRETCH].number, 1.0, 1e-9);
    assert_near(r.item[MORPH_REACH_STRETCH].limit, 1.8, 1e-12);
    assert_true(r.item[MORPH_REACH_HOLE].number == 0.0 && r.item[MORPH_REACH_BUMP].number == 0.0);
    assert_true(r.item[MORPH_REACH_BEND].number < 1e-9); /* the rim is no ridge */
    assert_near(r.item[MORPH_REACH_BEND].limit, 70.0 * acos(-1.0) / 180.0, 1e-12);
    assert_int_equal(r.item[MORPH_REACH_HELD].verdict, MORPH_REACH_UNTESTED);
    assert_true(r.item[MORPH_REACH_HIDDEN].number == 0.0);
    /* The longer way is the one along y once the box is turned. */
    const morph_reach turned = check(box(0.3, 0.35, 0.2));
    assert_true(turned.item[MORPH_REACH_LENGTH].along_y);
    assert_near(turned.item[MORPH_REACH_LENGTH].number, 0.35, 1e-9);
}

/* Flat and larger than the sheet: at most 0.945 / 1.2 of it along a line, 0.945^2 / 1.2^2 in all. */
static void test_too_large(void **state) {
    (void)state;
    const morph_reach r = check(box(1.2, 1.2, 0.05));
    assert_false(r.within);
    assert_int_equal(r.item[MORPH_REACH_LENGTH].verdict, MORPH_REACH_OUT);
    assert_int_equal(r.item[MORPH_REACH_AREA].verdict, MORPH_REACH_OUT);
    assert_near(1.0 - r.item[MORPH_REACH_LENGTH].lost, 0.945 / 1.2, CLOSE);
    assert_near(r.coverage, 0.945 * 0.945 / 1.44, CLOSE);
    /* A little smaller than the stretched sheet it is within. */
    assert_true(check(box(0.94, 0.94, 0.05)).within);
    assert_false(check(box(1.1, 0.5, 0.05)).within);
    /* What is beyond by less than the estimate knows is a note. */
    const morph_reach hardly = check(box(0.96, 0.5, 0.05));
    assert_true(hardly.within);
    assert_int_equal(hardly.item[MORPH_REACH_LENGTH].verdict, MORPH_REACH_NOTE);
}

/* A cone as steep as s asks for sqrt(1 + s^2) times its plan; the links give lambda = 1.8, at s = 1.497. */
static void test_slopes(void **state) {
    (void)state;
    const morph_reach flat = check(cone(0.2, 0.2)), steep = check(cone(0.2, 0.5));
    assert_true(flat.within);
    assert_near(flat.item[MORPH_REACH_STRETCH].number, sqrt(2.0), CLOSE);
    assert_int_equal(flat.item[MORPH_REACH_STRETCH].verdict, MORPH_REACH_WITHIN);
    /* Tip and rim fall between lines: half a cell at each. */
    assert_near(flat.item[MORPH_REACH_LENGTH].number, 0.4 * sqrt(2.0), 0.05);
    assert_false(steep.within);
    assert_near(steep.item[MORPH_REACH_STRETCH].number, sqrt(1.0 + 6.25), CLOSE);
    assert_int_equal(steep.item[MORPH_REACH_STRETCH].verdict, MORPH_REACH_OUT);
    assert_true(steep.item[MORPH_REACH_STRETCH].lost > MORPH_REACH_LOST);
    assert_near(steep.coverage, 1.0 - steep.item[MORPH_REACH_STRETCH].lost, 1e-12);
    assert_true(check(cone(0.2, 0.7)).coverage < steep.coverage);
    /* Links that hardly change follow no slope: sqrt(1.05^2 - 1) = 0.32 is less than 1. */
    morph_structure_def def = sheet();
    for (int k = 0; k < 2; k++) {
        def.length[k][0] = 0.1;
        def.length[k][1] = 0.105;
    }
    morph_mesh mesh = cone(0.2, 0.2);
    const morph_reach stiff = check_at(&def, &mesh, 0.0, 1.0);
    assert_false(stiff.within);
    assert_near(stiff.item[MORPH_REACH_STRETCH].limit, 1.05, 1e-9);
    /* A tip bends by both slopes, 90 degrees, but for the cell that it falls between. */
    assert_near(flat.item[MORPH_REACH_BEND].number, acos(0.0), 0.1);
    assert_int_equal(flat.item[MORPH_REACH_BEND].verdict, MORPH_REACH_NOTE);
    /* A tip is narrower than two spacings over as much height as it rises in one. */
    assert_near(flat.item[MORPH_REACH_BUMP].number, 0.1, 0.15);
    assert_int_equal(flat.item[MORPH_REACH_BUMP].verdict, MORPH_REACH_NOTE);
}

/* A block of heights, 0.5 m wide, with a square pit (depth above 0) or post (below 0) of a width in its
 * middle. */
static morph_mesh pitted(double width, double depth) {
    enum { N = 101 };
    static double z[N * N];
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            const double x = (i - N / 2) * 0.005, y = (j - N / 2) * 0.005;
            z[j * N + i] = 0.25 - (fmax(fabs(x), fabs(y)) < 0.5 * width ? depth : 0.0);
        }
    morph_mesh mesh;
    assert_int_equal(morph_mesh_heightmap(z, N, N, 0.005, 0.0, &mesh), MORPH_OK);
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < 3 * mesh.vertices; i++) {
        lo[i % 3] = fmin(lo[i % 3], mesh.v[i]);
        hi[i % 3] = fmax(hi[i % 3], mesh.v[i]);
    }
    move(&mesh, -0.5 * (lo[0] + hi[0]), -0.5 * (lo[1] + hi[1]), -lo[2]);
    return mesh;
}

static void test_holes(void **state) {
    (void)state;
    const morph_reach narrow = check(pitted(0.15, 0.15)), wide = check(pitted(0.3, 0.02));
    const morph_reach_item *hole = &narrow.item[MORPH_REACH_HOLE];
    assert_false(narrow.within);
    assert_int_equal(hole->verdict, MORPH_REACH_OUT);
    /* A ball of 0.915 spacings' radius over a hole 1.5 wide hangs in by 0.039 m; its bottom is far below. */
    assert_true(hole->number > 0.1 && hole->number < 0.15);
    assert_true(fabs(hole->at[0]) < 0.075 && fabs(hole->at[1]) < 0.075);
    assert_near(hole->at[2], 0.1, 0.2);
    assert_near(hole->lost, 0.15 * 0.15 / 0.25, 0.2);
    assert_true(wide.within);
    assert_true(wide.item[MORPH_REACH_HOLE].number < 0.025);
    /* A sheet of half the spacing sinks in. */
    morph_structure_def def = morph_structure_defaults(0.05);
    def.nodes[0] = def.nodes[1] = 15;
    morph_mesh mesh = pitted(0.3, 0.15);
    assert_true(check_at(&def, &mesh, 0.0, 1.0).item[MORPH_REACH_HOLE].lost <
                check(pitted(0.3, 0.15)).item[MORPH_REACH_HOLE].lost);
}

static void test_bumps(void **state) {
    (void)state;
    const morph_reach post = check(pitted(0.1, -0.1)), plateau = check(pitted(0.3, -0.1));
    assert_near(post.item[MORPH_REACH_BUMP].number, 0.1, 1e-6);
    assert_int_equal(post.item[MORPH_REACH_BUMP].verdict, MORPH_REACH_NOTE);
    assert_true(plateau.item[MORPH_REACH_BUMP].number < 1e-9);
    assert_int_equal(plateau.item[MORPH_REACH_BUMP].verdict, MORPH_REACH_WITHIN);
}

static void test_hidden(void **state) {
    (void)state;
    morph_mesh ball;
    assert_int_equal(morph_mesh_ellipsoid((double[3]){0.2, 0.2, 0.2}, 1e-3, &ball), MORPH_OK);
    move(&ball, 0, 0, 0.2);
    const morph_reach r = check(ball);
    assert_near(r.item[MORPH_REACH_HIDDEN].number, 0.5, CLOSE);
    assert_true(r.within); /* coverage asks for what is seen alone */
}

static void test_held(void **state) {
    (void)state;
    morph_structure_def def = sheet();
    def.fixed = MORPH_FIXED_BORDER;
    /* From the frame at 0 over a box 0.3 wide and h high: 0.3 + 2 hypot(0.2, h) against 0.945. */
    morph_mesh low = box(0.3, 0.3, 0.2), high = box(0.3, 0.3, 0.3);
    const morph_reach within = check_at(&def, &low, 0.0, 0.0), out = check_at(&def, &high, 0.0, 0.0);
    assert_near(within.item[MORPH_REACH_HELD].number, 0.3 + 2.0 * hypot(0.2, 0.2), CLOSE);
    assert_int_equal(within.item[MORPH_REACH_HELD].verdict, MORPH_REACH_WITHIN);
    assert_near(out.item[MORPH_REACH_HELD].number, 0.3 + 2.0 * hypot(0.2, 0.3), CLOSE);
    assert_int_equal(out.item[MORPH_REACH_HELD].verdict, MORPH_REACH_OUT);
    assert_true(within.within && !out.within);
    /* Held corners hold no line across the box. */
    def.fixed = MORPH_FIXED_CORNERS;
    morph_mesh again = box(0.3, 0.3, 0.3);
    assert_int_equal(check_at(&def, &again, 0.0, 0.0).item[MORPH_REACH_HELD].verdict, MORPH_REACH_UNTESTED);
}

static void test_edges(void **state) {
    (void)state;
    const morph_structure_def def = sheet();
    /* Nothing above the table: nothing asked. */
    morph_mesh sunk = box(0.3, 0.3, 0.2);
    const morph_reach nothing = check_at(&def, &sunk, 0.3, 1.0);
    assert_true(nothing.within && nothing.coverage == 1.0);
    for (int k = 0; k < MORPH_REACH_KINDS; k++)
        assert_int_equal(nothing.item[k].verdict, MORPH_REACH_UNTESTED);
    /* No table, a long strip, a speck: numbers stay finite. */
    morph_mesh hung = box(0.3, 0.3, 0.2), strip = box(50.0, 1e-4, 0.1), speck = box(1e-5, 1e-5, 1e-5);
    assert_true(check_at(&def, &hung, NAN, 1.0).within);
    const morph_reach odd[2] = {check_at(&def, &strip, 0.0, 1.0), check_at(&def, &speck, 0.0, 1.0)};
    for (int t = 0; t < 2; t++)
        for (int k = 0; k < MORPH_REACH_KINDS; k++) {
            assert_true(isfinite(odd[t].item[k].number));
            assert_true(odd[t].item[k].lost >= 0.0 && odd[t].item[k].lost <= 1.0);
        }
    assert_false(odd[0].within);
    assert_near(odd[0].coverage, 0.945 / 50.0, 0.1);
    assert_true(odd[1].within);
}

/* Layout offset has no posts: no limit of bends. Rigid links neither stretch nor follow slopes. */
static void test_structures(void **state) {
    (void)state;
    morph_structure_def def = sheet();
    def.layout = MORPH_LAYOUT_OFFSET;
    morph_mesh a = box(0.3, 0.3, 0.2), b = cone(0.2, 0.2);
    const morph_reach r = check_at(&def, &a, 0.0, 1.0);
    assert_int_equal(r.item[MORPH_REACH_BEND].verdict, MORPH_REACH_UNTESTED);
    assert_near(r.item[MORPH_REACH_LENGTH].limit, 6 * 0.135, 1e-12); /* the bottom layer is a node smaller */
    def = sheet();
    for (int k = 0; k < 2; k++)
        def.length[k][0] = def.length[k][1] = 0.1;
    const morph_reach rigid = check_at(&def, &b, 0.0, 1.0);
    assert_false(rigid.within);
    assert_near(rigid.item[MORPH_REACH_STRETCH].limit, 1.0, 1e-12);
}

static void test_repeats(void **state) {
    (void)state;
    const morph_reach a = check(pitted(0.15, 0.15)), b = check(pitted(0.15, 0.15));
    for (int k = 0; k < MORPH_REACH_KINDS; k++) {
        const morph_reach_item *x = &a.item[k], *y = &b.item[k];
        assert_memory_equal(&x->number, &y->number, sizeof x->number);
        assert_memory_equal(x->at, y->at, sizeof x->at);
        assert_memory_equal(&x->lost, &y->lost, sizeof x->lost);
        assert_true(x->verdict == y->verdict && x->line == y->line);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_box),    cmocka_unit_test(test_too_large),
                                       cmocka_unit_test(test_slopes), cmocka_unit_test(test_holes),
                                       cmocka_unit_test(test_bumps),  cmocka_unit_test(test_hidden),
                                       cmocka_unit_test(test_held),   cmocka_unit_test(test_structures),
                                       cmocka_unit_test(test_edges),  cmocka_unit_test(test_repeats)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
