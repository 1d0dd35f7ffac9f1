/* Bracing, offset layout, universal joints and fixed nodes: counts, numbering, geometry. */
#include "model/structure.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static morph_structure_def def_of(int nx, int ny) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = nx;
    def.nodes[1] = ny;
    return def;
}

static morph_structure *make(const morph_structure_def *def) {
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(def, &s), MORPH_OK);
    assert_int_equal(s->links, morph_link_count(def));
    return s;
}

static morph_structure *braced(int nx, int ny, morph_bracing bracing) {
    morph_structure_def def = def_of(nx, ny);
    def.bracing = bracing;
    return make(&def);
}

static morph_structure *offset(int nx, int ny) {
    morph_structure_def def = def_of(nx, ny);
    def.layout = MORPH_LAYOUT_OFFSET;
    return make(&def);
}

/* The link between two joints, either way round; -1 if there is none. */
static int link_between(const morph_structure *s, int a, int b) {
    int found = -1;
    for (int l = 0; l < s->links; l++)
        if ((s->link[l][0] == a && s->link[l][1] == b) || (s->link[l][0] == b && s->link[l][1] == a)) {
            assert_int_equal(found, -1); /* no two links on the same joints */
            found = l;
        }
    return found;
}

static void test_counts(void **state) {
    (void)state;
    static const struct {
        morph_layout layout;
        morph_joint_type joints;
        morph_bracing bracing;
        int count[7]; /* joints, links, posts, link_posts, link_links, skin, panels */
    } cases[] = {
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, {32, 48, 16, 96, 72, 18, 0}},
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_NONE, {32, 48, 16, 96, 72, 18, 24}},
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_WEB, {32, 72, 16, 96, 72, 18, 0}},
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_FULL, {32, 90, 16, 96, 72, 18, 0}},
        {MORPH_LAYOUT_POSTS, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_FULL, {32, 90, 16, 96, 72, 18, 24}},
        {MORPH_LAYOUT_OFFSET, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, {25, 72, 0, 0, 52, 8, 0}},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        morph_structure_def def = def_of(4, 4);
        def.layout = cases[k].layout;
        def.joints = cases[k].joints;
        def.bracing = cases[k].bracing;
        morph_structure *s = make(&def);
        const int count[7] = {s->joints,     s->links,          s->posts, s->link_posts,
                              s->link_links, s->skin_triangles, s->panels};
        for (int i = 0; i < 7; i++)
            assert_int_equal(count[i], cases[k].count[i]);
        morph_structure_destroy(s);
    }
}

static int kind_count(const morph_structure *s, int kind) {
    int n = 0;
    for (int l = 0; l < s->links; l++)
        n += s->link_kind[l] == kind;
    return n;
}

/* Braces come last, with limits that are factors of their start length, and have no angles. */
static void check_braces(const morph_structure *s) {
    const int first = s->links - kind_count(s, MORPH_LINK_BRACE);
    for (int l = 0; l < s->links; l++) {
        assert_int_equal(s->link_kind[l] == MORPH_LINK_BRACE, l >= first);
        const double length = morph_dist(&s->start[3 * s->link[l][0]], &s->start[3 * s->link[l][1]]);
        assert_true(s->start_length[l] == length);
        if (l < first) continue;
        assert_true(fabs(s->length_limit[l][0] - 0.75 * length) < 1e-15);
        assert_true(fabs(s->length_limit[l][1] - 1.35 * length) < 1e-15);
        assert_true(s->rate_limit[l] == s->def.rate && s->link_radius[l] == s->def.radius);
    }
    for (int t = 0; t < s->link_posts; t++)
        assert_true(s->link_post[t][0] < first);
    for (int t = 0; t < s->link_links; t++)
        assert_true(s->link_link[t][0] < first && s->link_link[t][1] < first);
}

/* One diagonal per side panel, in the order of the panels, alternating along each grid line. */
static void test_web(void **state) {
    (void)state;
    morph_structure *s = braced(5, 3, MORPH_BRACING_WEB);
    check_braces(s);
    const int panels = kind_count(s, MORPH_LINK_BOTTOM);
    assert_int_equal(kind_count(s, MORPH_LINK_BRACE), panels);
    for (int p = 0; p < panels; p++) {
        const int *posts = s->link[p], *ends = s->link[2 * panels + p];
        assert_true(ends[0] < s->posts && ends[1] >= s->posts);
        assert_true((ends[0] == posts[0] && ends[1] - s->posts == posts[1]) ||
                    (ends[0] == posts[1] && ends[1] - s->posts == posts[0]));
        assert_true(fabs(s->start_length[2 * panels + p] - hypot(0.1, 0.05)) < 1e-15);
        /* Two panels in line share a post: one brace ends at its top where the other ends, or both at its
         * foot.
         */
        for (int q = 0; q < p; q++) {
            const int *before = s->link[q];
            const bool in_line = before[1] == posts[0] && before[1] - before[0] == posts[1] - posts[0];
            if (!in_line) continue;
            const int *other = s->link[2 * panels + q];
            assert_true(other[0] == ends[0] || other[1] == ends[1]);
        }
    }
    morph_structure_destroy(s);
}

/* Web, then one diagonal per cell of the bottom layer, then of the top: the skin's own. */
static void test_full(void **state) {
    (void)state;
    static const int sizes[][2] = {{2, 2}, {4, 4}, {3, 6}, {5, 4}, {8, 8}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const int nx = sizes[k][0], ny = sizes[k][1], cells = (nx - 1) * (ny - 1);
        morph_structure *s = braced(nx, ny, MORPH_BRACING_FULL);
        check_braces(s);
        for (int t = 0; t < s->skin_triangles; t++)
            for (int e = 0; e < 3; e++) {
                const int a = s->skin[t][e], b = s->skin[t][(e + 1) % 3];
                assert_true(link_between(s, a, b) >= 0);
                assert_true(link_between(s, a + s->posts, b + s->posts) >= 0);
            }
        for (int c = 0; c < cells; c++)
            for (int layer = 0; layer < 2; layer++) {
                const int l = s->links - (2 - layer) * cells + c;
                const int i = c % (nx - 1), j = c / (nx - 1);
                const int *a = s->joint_node[s->link[l][0]], *b = s->joint_node[s->link[l][1]];
                for (int e = 0; e < 2; e++)
                    assert_int_equal(s->joint_layer[s->link[l][e]], layer);
                assert_int_equal(a[1], j);
                assert_int_equal(b[1], j + 1);
                assert_int_equal(a[0] + b[0], 2 * i + 1);
            }
        morph_structure_destroy(s);
    }
}

static void test_panels(void **state) {
    (void)state;
    morph_structure_def def = def_of(4, 3);
    def.joints = MORPH_JOINTS_UNIVERSAL;
    morph_structure *s = make(&def);
    assert_int_equal(s->panels, 17);
    for (int q = 0; q < s->panels; q++) {
        const int *a = s->joint_node[s->panel[q][0]], *b = s->joint_node[s->panel[q][1]];
        assert_int_equal(b[0] - a[0] + b[1] - a[1], 1);
        assert_true(link_between(s, s->panel[q][0], s->panel[q][1]) == q);
    }
    morph_structure_destroy(s);
}

/* The bottom grid is one smaller and lies under the middles of the top cells; four equal links from each of
 * its joints, in the documented order. */
static void test_offset(void **state) {
    (void)state;
    morph_structure *s = offset(5, 4);
    const int bottom = 4 * 3;
    assert_int_equal(s->joints, bottom + 20);
    assert_int_equal(s->links, (2 * 12 - 7) + (2 * 20 - 9) + 4 * bottom);
    assert_int_equal(s->layer_nodes[0][0], 4);
    assert_int_equal(s->layer_nodes[0][1], 3);
    assert_int_equal(s->layer_nodes[1][0], 5);
    check_braces(s);
    for (int a = 0; a < bottom; a++) {
        const int i = a % 4, j = a / 4;
        assert_int_equal(s->joint_layer[a], 0);
        assert_int_equal(s->joint_node[a][0], i);
        assert_int_equal(s->joint_node[a][1], j);
        double middle[2] = {0.0, 0.0};
        for (int c = 0; c < 4; c++) {
            const int l = s->links - 4 * bottom + 4 * a + c, t = bottom + (j + c / 2) * 5 + i + c % 2;
            assert_int_equal(s->link[l][0], a);
            assert_int_equal(s->link[l][1], t);
            assert_true(fabs(s->start_length[l] - sqrt(0.005 + 0.0025)) < 1e-15);
            for (int k = 0; k < 2; k++)
                middle[k] += 0.25 * s->start[3 * t + k];
        }
        for (int k = 0; k < 2; k++)
            assert_true(fabs(s->start[3 * a + k] - middle[k]) < 1e-15);
        assert_true(s->start[3 * a + 2] == 0.0);
    }
    /* Links of a layer join neighbours of it, a spacing apart. */
    for (int l = 0; l < s->links - 4 * bottom; l++) {
        for (int e = 0; e < 2; e++)
            assert_int_equal(s->joint_layer[s->link[l][e]], s->link_kind[l]);
        assert_true(fabs(s->start_length[l] - 0.1) < 1e-15);
    }
    char text[64];
    morph_link_name(s, s->links - 1, text, sizeof text);
    assert_string_equal(text, "link 95 (3,2)-(4,3) brace");
    morph_structure_destroy(s);
}

/* Angles, skin and joints of an offset layout agree with its grid. */
static void test_offset_angles_and_skin(void **state) {
    (void)state;
    morph_structure *s = offset(4, 6);
    assert_int_equal(s->link_links, 4 * (2 * 4 + 3 * 5));
    for (int t = 0; t < s->link_links; t++) {
        int uj[2], vj[2];
        double u[3], v[3];
        morph_link_link_joints(s, t, uj, vj);
        assert_int_equal(uj[0], vj[0]);
        morph_sub(&s->start[3 * uj[1]], &s->start[3 * uj[0]], u);
        morph_sub(&s->start[3 * vj[1]], &s->start[3 * vj[0]], v);
        assert_true(fabs(morph_dot(u, v)) < 1e-15);
        assert_true(fabs(morph_norm(u) - 0.1) < 1e-15 && fabs(morph_norm(v) - 0.1) < 1e-15);
    }
    double area = 0.0;
    for (int t = 0; t < s->skin_triangles; t++) {
        double u[3], v[3], n[3];
        for (int e = 0; e < 3; e++)
            assert_int_equal(s->joint_layer[s->skin[t][e]], 0);
        morph_sub(&s->start[3 * s->skin[t][1]], &s->start[3 * s->skin[t][0]], u);
        morph_sub(&s->start[3 * s->skin[t][2]], &s->start[3 * s->skin[t][0]], v);
        morph_cross(u, v, n);
        assert_true(n[2] > 0.0);
        area += 0.5 * n[2];
    }
    assert_true(fabs(area - 0.2 * 0.4) < 1e-14);
    morph_structure_destroy(s);
}

static void test_joint_numbers(void **state) {
    (void)state;
    for (int layout = 0; layout < 2; layout++) {
        morph_structure_def def = def_of(3, 5);
        def.layout = (morph_layout)layout;
        morph_structure *s = make(&def);
        for (int a = 0; a < s->joints; a++) {
            int layer, node[2];
            morph_joint_place(&def, a, &layer, node);
            assert_int_equal(layer, s->joint_layer[a]);
            assert_memory_equal(node, s->joint_node[a], sizeof node);
            assert_int_equal(morph_node_joint(&def, layer, node[0], node[1]), a);
        }
        assert_int_equal(morph_node_joint(&def, 0, 2, 4), layout ? -1 : 14);
        assert_int_equal(morph_node_joint(&def, 1, 3, 0), -1);
        assert_int_equal(morph_node_joint(&def, 1, 0, 5), -1);
        assert_int_equal(morph_node_joint(&def, 1, -1, 0), -1);
        morph_structure_destroy(s);
    }
}

/* What is held, in all forms and both layouts: `at` says whether node (i, j) should be. */
static void check_fixed(const morph_structure *s, bool (*at)(int nx, int ny, int i, int j)) {
    int held = 0, joints = 0;
    for (int a = 0; a < s->joints; a++) {
        const int i = s->joint_node[a][0], j = s->joint_node[a][1];
        const bool layer = s->posts > 0 || s->joint_layer[a] == 1;
        const bool expected = layer && at(s->nx, s->ny, i, j);
        assert_int_equal(s->joint_fixed[a], expected);
        if (!expected) continue;
        assert_int_equal(s->fixed_joint[joints++], a);
        if (s->posts == 0 || a < s->posts) assert_int_equal(s->fixed[held++], a);
    }
    assert_int_equal(s->fixed_count, held);
    assert_int_equal(s->fixed_joints, joints);
    assert_int_equal(joints, s->posts > 0 ? 2 * held : held);
}

static bool nowhere(int nx, int ny, int i, int j) {
    (void)nx, (void)ny, (void)i, (void)j;
    return false;
}
static bool on_border(int nx, int ny, int i, int j) {
    return i == 0 || j == 0 || i == nx - 1 || j == ny - 1;
}
static bool at_corner(int nx, int ny, int i, int j) {
    return (i == 0 || i == nx - 1) && (j == 0 || j == ny - 1);
}
static bool in_list(int nx, int ny, int i, int j) {
    (void)nx, (void)ny;
    return (i == 2 && j == 1) || (i == 0 && j == 3);
}

static void test_fixed(void **state) {
    (void)state;
    static bool (*const at[4])(int, int, int, int) = {nowhere, on_border, at_corner, in_list};
    static const int counts[4] = {0, 12, 4, 2};
    const int list[3][2] = {{2, 1}, {0, 3}, {2, 1}}; /* a repeat counts once */
    for (int layout = 0; layout < 2; layout++)
        for (int f = 0; f < 4; f++) {
            morph_structure_def def = def_of(4, 4);
            def.layout = (morph_layout)layout;
            def.fixed = (morph_fixed)f;
            def.fixed_nodes = 3; /* not looked at but for a list */
            def.fixed_node = f == MORPH_FIXED_LIST ? list : NULL;
            morph_structure *s = make(&def);
            assert_int_equal(s->fixed_count, counts[f]);
            check_fixed(s, at[f]);
            if (f == MORPH_FIXED_LIST) {
                /* A copy, that the structure's own def points to. */
                assert_true(s->def.fixed_node != def.fixed_node);
                assert_memory_equal(s->def.fixed_node, list, sizeof list);
            }
            morph_structure_destroy(s);
        }
}

static void test_bad(void **state) {
    (void)state;
    const int outside[1][2] = {{3, 4}};
    morph_structure_def bad[6];
    for (int k = 0; k < 6; k++)
        bad[k] = def_of(4, 4);
    for (int k = 0; k < 3; k++)
        bad[k].layout = MORPH_LAYOUT_OFFSET;
    bad[0].joints = MORPH_JOINTS_UNIVERSAL;
    bad[1].bracing = MORPH_BRACING_WEB;
    bad[2].nodes[1] = 2;
    bad[3].fixed = bad[4].fixed = bad[5].fixed = MORPH_FIXED_LIST;
    bad[3].fixed_nodes = 1;
    bad[3].fixed_node = outside;
    bad[4].fixed_nodes = 1; /* no list */
    bad[5].fixed_nodes = -1;
    for (int k = 0; k < 6; k++) {
        morph_structure *s;
        assert_int_equal(morph_structure_create(&bad[k], &s), MORPH_ERR_INPUT);
        assert_null(s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts),        cmocka_unit_test(test_web),
        cmocka_unit_test(test_full),          cmocka_unit_test(test_panels),
        cmocka_unit_test(test_offset),        cmocka_unit_test(test_offset_angles_and_skin),
        cmocka_unit_test(test_joint_numbers), cmocka_unit_test(test_fixed),
        cmocka_unit_test(test_bad),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
