/* Mobility of every layout at 4 x 4, flat and bent, with panels and with fixed joints; the rows' gradients.
 */
#include "model/kinematics.h"
#include "model/kinematics_rows.h"

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
    return s;
}

static double noise(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int64_t)(*seed >> 11) / 4503599627370496.0 - 1.0;
}

static morph_mobility mobility(const morph_structure *s, const double *x) {
    morph_mobility m;
    assert_int_equal(morph_mobility_at(s, x, &m), MORPH_OK);
    assert_int_equal(m.rows, s->links + s->posts + s->panels);
    assert_int_equal(m.redundant, m.rows - m.rank);
    assert_int_equal(m.rank + m.free + m.rigid, 3 * (s->joints - s->fixed_joints));
    assert_true(m.free >= 0 && m.redundant >= 0);
    return m;
}

typedef struct layout_case {
    morph_layout layout;
    morph_joint_type joints;
    morph_bracing bracing;
    int flat, bent;         /* free motions */
    double least, greatest; /* singular value of a rigid one */
} layout_case;

/* The published counts: ball 26 free; universal 20 flat, 2 in a generic pose; web 6, 2; full rigid. */
static const layout_case layouts[] = {
    {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, 26, 26, 0.0, 0.0},
    {MORPH_LAYOUT_POSTS, MORPH_JOINTS_UNIVERSAL, MORPH_BRACING_NONE, 20, 2, 0.0, 0.0},
    {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_WEB, 6, 2, 0.0, 0.0},
    {MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_FULL, 0, 0, 0.08, 0.12},
    /* 25 joints: 69 shape freedoms for 72 links; flat, one motion changes no length at first order. */
    {MORPH_LAYOUT_OFFSET, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, 1, 0, 1e-4, 0.03},
};

static void test_counts(void **state) {
    (void)state;
    for (size_t k = 0; k < sizeof layouts / sizeof *layouts; k++) {
        const layout_case *c = &layouts[k];
        morph_structure_def def = def_of(4, 4);
        def.layout = c->layout;
        def.joints = c->joints;
        def.bracing = c->bracing;
        morph_structure *s = make(&def);
        morph_mobility m = mobility(s, s->start);
        assert_int_equal(m.rigid, 6);
        assert_int_equal(m.free, c->flat);
        assert_true(c->flat > 0 ? m.sigma_min == 0.0 : m.sigma_min > c->least && m.sigma_min < c->greatest);
        uint64_t seed = 5 + k;
        for (int round = 0; round < 5; round++) {
            double x[96];
            for (int i = 0; i < 3 * s->joints; i++)
                x[i] = s->start[i] + 0.01 * noise(&seed);
            m = mobility(s, x);
            if (c->bent == 0) print_message("%d links, bent: %.4f\n", s->links, m.sigma_min);
            assert_int_equal(m.free, c->bent);
            assert_true(c->bent > 0 ? m.sigma_min == 0.0
                                    : m.sigma_min > c->least && m.sigma_min < c->greatest);
        }
        morph_structure_destroy(s);
    }
}

/* Rigid motions of the whole are no motions of the shape: shift and turn change nothing, nor does the scale.
 */
static void test_invariant(void **state) {
    (void)state;
    morph_structure_def def = def_of(3, 3);
    def.joints = MORPH_JOINTS_UNIVERSAL;
    def.bracing = MORPH_BRACING_FULL;
    morph_structure *s = make(&def);
    double x[54], y[54];
    uint64_t seed = 23;
    const double c = cos(0.8), d = sin(0.8);
    for (int j = 0; j < s->joints; j++) {
        double *p = &x[3 * j];
        for (int k = 0; k < 3; k++)
            p[k] = s->start[3 * j + k] + 0.01 * noise(&seed);
        y[3 * j] = 50.0 * p[0] - 3.0;
        y[3 * j + 1] = 50.0 * (c * p[1] - d * p[2]) + 100.0;
        y[3 * j + 2] = 50.0 * (d * p[1] + c * p[2]);
    }
    const morph_mobility a = mobility(s, x), b = mobility(s, y);
    assert_int_equal(a.free, 0);
    assert_int_equal(b.free, 0);
    assert_true(fabs(a.sigma_min - b.sigma_min) < 1e-9);
    morph_structure_destroy(s);
}

/* What holding joints leaves of the rigid motions, and of the free ones. */
static void test_fixed(void **state) {
    (void)state;
    const int one[1][2] = {{1, 2}}, two[2][2] = {{0, 0}, {3, 3}}, line[3][2] = {{0, 1}, {1, 1}, {3, 1}};
    static const struct {
        morph_layout layout;
        int nodes, rigid;
    } cases[] = {{MORPH_LAYOUT_POSTS, 1, 1},  {MORPH_LAYOUT_POSTS, 2, 0},  {MORPH_LAYOUT_OFFSET, 1, 3},
                 {MORPH_LAYOUT_OFFSET, 2, 1}, {MORPH_LAYOUT_OFFSET, 3, 1}, {MORPH_LAYOUT_POSTS, 3, 0}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        morph_structure_def def = def_of(4, 4);
        def.layout = cases[k].layout;
        if (def.layout == MORPH_LAYOUT_POSTS) def.bracing = MORPH_BRACING_FULL;
        def.fixed = MORPH_FIXED_LIST;
        def.fixed_nodes = cases[k].nodes;
        def.fixed_node = cases[k].nodes == 1 ? one : cases[k].nodes == 2 ? two : line;
        morph_structure *s = make(&def);
        const morph_mobility m = mobility(s, s->start);
        assert_int_equal(m.rigid, cases[k].rigid);
        if (def.layout == MORPH_LAYOUT_POSTS) assert_int_equal(m.free, 0);
        morph_structure_destroy(s);
    }
    /* The border held in a frame: of ball joints 4 posts in the middle move, 2 x 2 x 6 unknowns; their 2 (4 +
     * 8) links, 4 posts. Links and posts of the border alone are redundant. */
    morph_structure_def def = def_of(4, 4);
    def.fixed = MORPH_FIXED_BORDER;
    morph_structure *s = make(&def);
    morph_mobility m = mobility(s, s->start);
    assert_int_equal(m.rigid, 0);
    assert_true(m.redundant >= 24 + 12);
    assert_int_equal(m.rank + m.free, 24);
    morph_structure_destroy(s);
    /* Everything held. */
    def = def_of(2, 2);
    def.fixed = MORPH_FIXED_BORDER;
    s = make(&def);
    m = mobility(s, s->start);
    assert_int_equal(m.rank, 0);
    assert_int_equal(m.redundant, 12);
    assert_int_equal(m.free, 0);
    morph_structure_destroy(s);
}

/* Gradients of all rows against central differences: the largest error, relative to the row's. */
static double gradient_error(const morph_structure *s, double *x, bool corrupt) {
    double worst = 0.0;
    for (int r = 0; r < morph_row_count(s); r++) {
        morph_row row, unused;
        morph_row_at(s, x, r, &row);
        if (corrupt && r == morph_row_count(s) - 1) row.gradient[2][1] *= 1.001;
        double size = 0.0, error = 0.0;
        for (int e = 0; e < row.joints; e++)
            for (int k = 0; k < 3; k++) {
                double *at = &x[3 * row.joint[e] + k];
                const double before = *at, h = 1e-6; /* of 0.1: truncation 1e-10, rounding 1e-11 */
                *at = before + h;
                const double up = morph_row_at(s, x, r, &unused);
                *at = before - h;
                const double down = morph_row_at(s, x, r, &unused);
                *at = before;
                error = fmax(error, fabs((up - down) / (2.0 * h) - row.gradient[e][k]));
                size = fmax(size, fabs(row.gradient[e][k]));
            }
        worst = fmax(worst, error / size);
    }
    return worst;
}

static void test_gradients(void **state) {
    (void)state;
    morph_structure_def def = def_of(3, 4);
    def.joints = MORPH_JOINTS_UNIVERSAL;
    def.bracing = MORPH_BRACING_FULL;
    morph_structure *s = make(&def);
    uint64_t seed = 31;
    for (int i = 0; i < 3 * s->joints; i++)
        s->start[i] += 0.015 * noise(&seed);
    assert_true(gradient_error(s, s->start, false) < 1e-7);
    assert_true(gradient_error(s, s->start, true) > 1e-5);
    morph_structure_destroy(s);
}

static void test_bad(void **state) {
    (void)state;
    morph_structure_def def = def_of(3, 3);
    def.joints = MORPH_JOINTS_UNIVERSAL;
    morph_structure *s = make(&def);
    morph_mobility m;
    /* A link without length has no direction. */
    memcpy(&s->start[3], &s->start[0], 3 * sizeof(double));
    assert_int_equal(morph_mobility_at(s, s->start, &m), MORPH_ERR_NONFINITE);
    s->start[7] = INFINITY;
    assert_int_equal(morph_mobility_at(s, s->start, &m), MORPH_ERR_NONFINITE);
    morph_structure_destroy(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts),    cmocka_unit_test(test_invariant), cmocka_unit_test(test_fixed),
        cmocka_unit_test(test_gradients), cmocka_unit_test(test_bad),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
