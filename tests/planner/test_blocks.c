/* Every block of a pose against central differences, at random poses and where contacts, limits and kinks are
 * near. */
#include "planner/blocks.h"
#include "tests/support/shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/planted_sign.h" /* asserts */

enum { NX = 4, NY = 3 };

typedef struct fixture {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf;
    morph_cavity *cavity;
    int n;
    double *x; /* scaled */
} fixture;

static unsigned long long random_state;

static double uniform(void) {
    random_state = random_state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

/* A bent, shaken pose over a box: links short and long, angles far from right, skin beside and above the box.
 */
static void shake(fixture *f, unsigned long long seed, double amount) {
    random_state = seed;
    for (int j = 0; j < f->structure->joints; j++)
        for (int k = 0; k < 3; k++) {
            double at = f->structure->start[3 * j + k] / f->structure->spacing + amount * (uniform() - 0.5);
            if (k == 2) at += 1.0;
            f->x[3 * j + k] = at;
        }
}

static int setup(void **state) {
    fixture *f = calloc(1, sizeof *f);
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = NX;
    def.nodes[1] = NY;
    morph_mesh mesh = {0};
    if (!f || morph_structure_create(&def, &f->structure) != MORPH_OK ||
        !test_box(&mesh, 0.13, 0.11, 0.09, 0.045))
        return -1;
    const double lo[3] = {-0.3, -0.3, -0.05}, hi[3] = {0.3, 0.3, 0.3};
    f->n = 3 * f->structure->joints;
    f->x = calloc((size_t)f->n, sizeof(double));
    const bool ok = f->x && morph_distance_create(&mesh, true, &f->exact) == MORPH_OK &&
                    morph_sdf_create(f->exact, lo, hi, 0.1 / 8.0, NULL, &f->sdf) == MORPH_OK &&
                    morph_cavity_create(f->structure, f->exact, 0.0, &f->cavity) == MORPH_OK;
    morph_mesh_free(&mesh);
    *state = f;
    return ok ? 0 : -1;
}

static int teardown(void **state) {
    fixture *f = *state;
    morph_cavity_destroy(f->cavity);
    morph_sdf_destroy(f->sdf);
    morph_distance_destroy(f->exact);
    morph_structure_destroy(f->structure);
    free(f->x);
    free(f);
    return 0;
}

/* Step 1e-5 spacings: truncation is about step^2 times the fourth derivative, rounding 1e-16 / step; both
 * leave the 1e-6 asked for well alone for functions of order 1. */
static void expect_right(const fixture *f, const morph_block *block) {
    morph_derivative_check check;
    assert_int_equal(morph_check_derivatives(block, 1, f->x, f->n, 1e-5, 1e-6, &check), MORPH_OK);
    if (!check.passed) print_error("%s\n", check.message);
    assert_true(check.passed);
    assert_true(planted_signs_seen(block, f->x, f->n) > 0);
}

static void members(void **state) {
    fixture *f = *state;
    double lower[400], upper[400];
    int link[100];
    for (int l = 0; l < f->structure->links; l++)
        link[l] = l;
    double target[100];
    for (int l = 0; l < f->structure->links; l++)
        target[l] = 0.8 + 0.01 * l;
    for (unsigned seed = 1; seed <= 3; seed++) {
        shake(f, seed, 0.6);
        morph_post_rows posts = {f->structure};
        morph_length_rows lengths = {f->structure, f->structure->links, link, 0.01};
        morph_stretch_term stretch = {f->structure, target, 0.7};
        morph_near_term near = {f->n, f->structure->start, 0.3};
        morph_upright_term upright = {f->structure, 0.6};
        const morph_block blocks[5] = {
            morph_block_upright(&upright, NULL), morph_block_posts(&posts, NULL, lower, upper),
            morph_block_lengths(&lengths, NULL, lower + f->structure->posts, upper + f->structure->posts),
            morph_block_stretch(&stretch, NULL), morph_block_near(&near, NULL)};
        for (int b = 0; b < 5; b++)
            expect_right(f, &blocks[b]);
    }
}

/* Of a structure of its own kind: rows of panels, and what held nodes leave of posts and panels. */
static void panels(void **state) {
    (void)state;
    const int node[2][2] = {{0, 0}, {1, 0}};
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = NX;
    def.nodes[1] = NY;
    def.joints = MORPH_JOINTS_UNIVERSAL;
    for (int held = 0; held < 2; held++) {
        fixture f = {0};
        double lower[64], upper[64], value[64];
        if (held) {
            def.fixed = MORPH_FIXED_LIST;
            def.fixed_nodes = 2;
            def.fixed_node = node;
        }
        assert_int_equal(morph_structure_create(&def, &f.structure), MORPH_OK);
        const morph_structure *s = f.structure;
        f.n = 3 * s->joints;
        f.x = calloc((size_t)f.n, sizeof(double));
        assert_non_null(f.x);
        morph_panel_rows rows = {s};
        morph_post_rows posts = {s};
        for (unsigned seed = 1; seed <= 3; seed++) {
            shake(&f, seed, 0.6);
            const morph_block block = morph_block_panels(&rows, NULL, lower, upper),
                              post = morph_block_posts(&posts, NULL, lower + 32, upper + 32);
            assert_int_equal(block.rows, s->panels - held);
            assert_int_equal(post.rows, s->posts - 2 * held);
            expect_right(&f, &block);
            expect_right(&f, &post);
            block.value(block.data, f.x, value);
            for (int q = held; q < s->panels; q++) {
                /* The row is the sine times the lengths over those of the flat start. The held panel is the
                 * first. */
                const int *a = s->post[s->panel[q][0]], *b = s->post[s->panel[q][1]];
                const double sizes = morph_dist(&f.x[3 * a[0]], &f.x[3 * a[1]]) *
                                     morph_dist(&f.x[3 * b[0]], &f.x[3 * b[1]]) *
                                     morph_dist(&f.x[3 * a[0]], &f.x[3 * b[0]]) / 0.25;
                assert_true(fabs(value[q - held] - sizes * morph_panel_sine(s, q, f.x)) < 1e-12);
                char name[96], wanted[96];
                block.describe(block.data, q - held, name, sizeof name);
                morph_panel_name(s, q, wanted, sizeof wanted);
                assert_string_equal(name, wanted);
            }
            char name[96];
            post.describe(post.data, 0, name, sizeof name);
            assert_string_equal(name, held ? "post (2,0)" : "post (0,0)");
        }
        shake(&f, 1, 0.0);
        for (int q = 0; q < s->panels; q++)
            assert_true(fabs(morph_panel_sine(s, q, f.x)) < 1e-15);
        free(f.x);
        morph_structure_destroy(f.structure);
    }
}

static void angles(void **state) {
    fixture *f = *state;
    double lower[400], upper[400];
    int tuple[400];
    const int count = f->structure->link_posts + f->structure->link_links;
    assert_true(count <= 400);
    for (int t = 0; t < count; t++)
        tuple[t] = t;
    for (unsigned seed = 1; seed <= 3; seed++) {
        shake(f, seed, 0.5);
        morph_angle_rows rows = {f->structure, count, tuple, 0.02};
        const morph_block block = morph_block_angles(&rows, NULL, lower, upper);
        expect_right(f, &block);
        /* The row is the cosine of the angle, and its bounds those of the limits. */
        double value[400];
        block.value(block.data, f->x, value);
        for (int t = 0; t < count; t++)
            assert_true(fabs(value[t] - cos(morph_angle_at(f->structure, t, f->x))) < 1e-12);
        assert_true(fabs(lower[0] - cos(f->structure->link_post_limit[0][1] - 0.02)) < 1e-15);
    }
}

static void contact(void **state) {
    fixture *f = *state;
    double lower[64], upper[64];
    for (unsigned seed = 1; seed <= 3; seed++) {
        shake(f, seed, 0.4);
        morph_point point[40];
        for (int k = 0; k < 40; k++) {
            const int *t = f->structure->skin[k % f->structure->skin_triangles];
            const double u = uniform(), v = (1.0 - u) * uniform();
            point[k] = (morph_point){{t[0], t[1], t[2]}, {1.0 - u - v, u, v}, -1, 0.01};
        }
        /* A joint as a point: the other two weights are 0 and the joints repeat. */
        point[0] = (morph_point){{5, 5, 5}, {1.0, 0.0, 0.0}, -1, 0.0};
        morph_clearance_rows rows = {f->structure, f->sdf, 40, point, 0.01, 0.1 * (seed - 1.0)};
        const morph_block block = morph_block_clearance(&rows, NULL, lower, upper);
        expect_right(f, &block);
        /* A target that stands higher is a pose that hangs lower. */
        double raised[40], lowered[40];
        block.value(block.data, f->x, raised);
        for (int i = 2; i < f->n; i += 3)
            f->x[i] -= rows.lift;
        rows.lift = 0.0;
        block.value(block.data, f->x, lowered);
        for (int k = 0; k < 40; k++)
            assert_true(fabs(raised[k] - lowered[k]) < 1e-12);
        const morph_feature feature[2] = {{{0, 1, 5}, false, {0.2, 0.1, 0.3}, {0.0, 0.0, 0.0}, 1.0},
                                          {{6, 7, 7}, true, {-0.2, 0.1, 0.4}, {0.3, -0.9, 0.1}, -1.0}};
        morph_feature_rows features = {f->structure, 2, feature, 0.0};
        const morph_block sharp = morph_block_features(&features, NULL, lower, upper);
        expect_right(f, &sharp);
        morph_pair pair[2] = {{{0, 7}, {0.6, 0.0, 0.8}, 0.08, {0, 8}},
                              {{2, 9}, {0.0, 1.0, 0.0}, 0.08, {40, 3}}};
        morph_separation_rows apart = {f->structure, 2, pair, 0.0};
        const morph_block separation = morph_block_separation(&apart, NULL, lower, upper);
        expect_right(f, &separation);
    }
}

static void cavity_terms(void **state) {
    fixture *f = *state;
    const size_t y = (size_t)f->cavity->exposed;
    int(*joint)[3] = calloc(y, sizeof *joint);
    double(*weight)[3] = calloc(y, sizeof *weight);
    double *metres = calloc((size_t)f->n, sizeof(double));
    assert_true(joint && weight && metres);
    for (unsigned seed = 1; seed <= 3; seed++) {
        shake(f, seed, 0.4);
        for (int i = 0; i < f->n; i++) {
            f->x[i] -= i % 3 == 2 ? 0.8 : 0.0; /* down to the kink between box and base plane */
            metres[i] = f->x[i] * f->structure->spacing;
        }
        morph_gap_term gap = {f->cavity, f->sdf, 0.1, 0.9, false};
        const morph_block block = morph_block_gap(&gap, NULL);
        expect_right(f, &block);
        assert_int_equal(morph_cavity_closest(f->cavity, metres, joint, weight, NULL), MORPH_OK);
        morph_cover_term cover = {f->cavity, (const int(*)[3])joint, (const double(*)[3])weight, 0.1, 0.2,
                                  1.1};
        const morph_block block2 = morph_block_cover(&cover, NULL);
        expect_right(f, &block2);
    }
    free(joint);
    free(weight);
    free(metres);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(members, setup, teardown),
        cmocka_unit_test(panels),
        cmocka_unit_test_setup_teardown(angles, setup, teardown),
        cmocka_unit_test_setup_teardown(contact, setup, teardown),
        cmocka_unit_test_setup_teardown(cavity_terms, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
