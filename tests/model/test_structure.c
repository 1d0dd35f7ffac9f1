/* Structure: counts, numbering, angle tuples, mobility. */
#include "model/kinematics.h"
#include "model/structure.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static morph_structure *make(int nx, int ny) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = nx;
    def.nodes[1] = ny;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static void counts_of_the_prototype(void **state) {
    (void)state;
    morph_structure *s = make(4, 4);
    assert_int_equal(s->joints, 32);
    assert_int_equal(s->links, 48);
    assert_int_equal(s->posts, 16);
    assert_int_equal(s->link_posts, 96);
    assert_int_equal(s->link_links, 72);
    assert_int_equal(s->skin_triangles, 18);
    morph_structure_destroy(s);
}

static void numbering_follows_the_contract(void **state) {
    (void)state;
    morph_structure *s = make(3, 2);
    /* Bottom joints 0..5 (x fastest); joint 0 has its x link before its y link, joint 2 only a y link. */
    const int expected[7][2] = {{0, 1}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {4, 5}};
    assert_int_equal(s->links, 14);
    for (int l = 0; l < 7; l++)
        for (int k = 0; k < 2; k++) {
            assert_int_equal(s->link[l][k], expected[l][k]);
            assert_int_equal(s->link[l + 7][k], expected[l][k] + 6);
        }
    char text[64];
    morph_link_name(s, 7, text, sizeof text);
    assert_string_equal(text, "link 7 (0,0)-(1,0) top");
    morph_joint_name(s, 11, text, sizeof text);
    assert_string_equal(text, "joint (2,1) top");
    morph_structure_destroy(s);
}

static double angle(const double *x, const int uj[2], const int vj[2]) {
    double u[3], v[3];
    morph_sub(&x[3 * uj[1]], &x[3 * uj[0]], u);
    morph_sub(&x[3 * vj[1]], &x[3 * vj[0]], v);
    return acos(morph_dot(u, v) / (morph_norm(u) * morph_norm(v)));
}

static void flat_angles_are_right_and_tuples_distinct(void **state) {
    (void)state;
    morph_structure *s = make(5, 4);
    const double right = acos(0.0);
    for (int t = 0; t < s->link_posts; t++) {
        int uj[2], vj[2];
        morph_link_post_joints(s, t, uj, vj);
        assert_true(uj[0] == vj[0] || uj[0] == vj[1]);
        assert_true(fabs(angle(s->start, uj, vj) - right) < 1e-12);
    }
    for (int t = 0; t < s->link_links; t++) {
        int uj[2], vj[2];
        morph_link_link_joints(s, t, uj, vj);
        assert_int_equal(uj[0], vj[0]);
        assert_true(fabs(angle(s->start, uj, vj) - right) < 1e-12);
        for (int o = 0; o < t; o++)
            assert_false(s->link_link[o][0] == s->link_link[t][0] &&
                         s->link_link[o][1] == s->link_link[t][1] &&
                         s->link_link_joint[o] == s->link_link_joint[t]);
    }
    morph_structure_destroy(s);
}

static void skin_covers_the_grid_facing_up(void **state) {
    (void)state;
    morph_structure *s = make(4, 6);
    double area = 0.0;
    for (int t = 0; t < s->skin_triangles; t++) {
        double u[3], v[3], n[3];
        morph_sub(&s->start[3 * s->skin[t][1]], &s->start[3 * s->skin[t][0]], u);
        morph_sub(&s->start[3 * s->skin[t][2]], &s->start[3 * s->skin[t][0]], v);
        morph_cross(u, v, n);
        assert_true(n[2] > 0.0);
        area += 0.5 * n[2];
    }
    assert_true(fabs(area - 0.3 * 0.5) < 1e-12);
    morph_structure_destroy(s);
}

static void mobility_of_the_prototype(void **state) {
    (void)state;
    morph_structure *s = make(4, 4);
    morph_mobility m;
    assert_int_equal(morph_mobility_at(s, s->start, &m), MORPH_OK);
    /* 74 shape freedoms, 48 lengths, all rows independent: 26 motions that nobody controls. */
    assert_int_equal(m.rows, 64);
    assert_int_equal(m.rank, 64);
    assert_int_equal(m.free, 26);
    assert_int_equal(m.redundant, 0);
    assert_true(m.sigma_min == 0.0);
    s->start[5] = NAN;
    assert_int_equal(morph_mobility_at(s, s->start, &m), MORPH_ERR_NONFINITE);
    morph_structure_destroy(s);
}

static void bad_defs_are_refused(void **state) {
    (void)state;
    morph_structure *s;
    morph_structure_def def = morph_structure_defaults(0.1);
    assert_int_equal(morph_structure_create(&def, &s), MORPH_ERR_INPUT); /* no nodes */
    assert_null(s);
    def.nodes[0] = def.nodes[1] = 4;
    def.length[0][0] = 0.2;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_ERR_INPUT); /* inverted pair */
    def = morph_structure_defaults(NAN);
    def.nodes[0] = def.nodes[1] = 4;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_ERR_INPUT);
    morph_structure_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_of_the_prototype),
        cmocka_unit_test(numbering_follows_the_contract),
        cmocka_unit_test(flat_angles_are_right_and_tuples_distinct),
        cmocka_unit_test(skin_covers_the_grid_facing_up),
        cmocka_unit_test(mobility_of_the_prototype),
        cmocka_unit_test(bad_defs_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
