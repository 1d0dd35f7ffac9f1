/* The blanket of every layout, bracing and joint over a ball: limits, posts, panels and clearance in every
 * recorded frame, measured anew. */
#include "model/blanket.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/model/solids.h"

#define RADIUS 0.12

typedef struct figures {
    double length, post, panel, clearance;
    int frames;
    bool rest;
} figures;

static double over(double lo, double value, double hi) {
    return fmax(lo - value, value - hi);
}

/* Sine by which the four corners of a panel leave a plane. */
static double panel_sine(const morph_structure *s, int panel, const double *x) {
    const int *a = s->post[s->panel[panel][0]], *b = s->post[s->panel[panel][1]];
    double p[3], q[3], d[3], n[3];
    morph_sub(&x[3 * a[1]], &x[3 * a[0]], p);
    morph_sub(&x[3 * b[1]], &x[3 * b[0]], q);
    morph_sub(&x[3 * b[0]], &x[3 * a[0]], d);
    morph_cross(p, q, n);
    return fabs(morph_dot(n, d)) / (morph_norm(p) * morph_norm(q) * morph_norm(d));
}

static void measure(const morph_structure *s, const morph_distance *exact, const double *x, figures *f) {
    double weight[3];
    morph_closest at;
    for (int l = 0; l < s->links; l++) {
        const double *a = &x[3 * s->link[l][0]], *b = &x[3 * s->link[l][1]];
        f->length = fmax(f->length, over(s->length_limit[l][0], morph_dist(a, b), s->length_limit[l][1]));
        morph_distance_segment(exact, a, b, weight, &at);
        f->clearance = fmin(f->clearance, at.distance - s->link_radius[l]);
    }
    for (int t = 0; t < s->skin_triangles; t++) {
        const int *v = s->skin[t];
        morph_distance_triangle(exact, &x[3 * v[0]], &x[3 * v[1]], &x[3 * v[2]], weight, &at);
        f->clearance = fmin(f->clearance, at.distance - s->def.radius);
    }
    for (int p = 0; p < s->posts; p++) {
        const double length = morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]);
        f->post = fmax(f->post, fabs(length / s->post_length[p] - 1.0));
    }
    for (int p = 0; p < s->panels; p++)
        f->panel = fmax(f->panel, panel_sine(s, p, x));
}

static figures drape(morph_layout layout, morph_bracing bracing, morph_joint_type joints, morph_fixed fixed) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 5;
    def.layout = layout;
    def.bracing = bracing;
    def.joints = joints;
    def.fixed = fixed;
    def.stiffness = 20.0;
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    make_sphere(4);
    for (int i = 0; i < 3 * made.nv; i++)
        made.v[i] = RADIUS * (made.v[i] + (i % 3 == 2 ? 1.0 : 0.0));
    morph_distance *exact = finish(true);
    morph_sdf *sdf;
    const double lo[3] = {-0.4, -0.4, -0.05}, hi[3] = {0.4, 0.4, 0.4};
    assert_int_equal(morph_sdf_create(exact, lo, hi, 0.1 / 12, NULL, &sdf), MORPH_OK);
    double *x = malloc(3 * (size_t)s->joints * sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < 3 * s->joints; i++)
        x[i] = s->start[i] + (i % 3 == 2 ? 2.0 * RADIUS + 0.03 : 0.0);
    const morph_blanket_def run = {.gravity = 9.81,
                                   .drag = 0.2,
                                   .friction = 0.6,
                                   .time = 2.0,
                                   .frame = 0.01,
                                   .base = 0.0,
                                   .fixed = s->fixed_joint,
                                   .fixed_count = s->fixed_joints};
    morph_trajectory t;
    morph_blanket_report report;
    assert_int_equal(morph_blanket_run(s, sdf, exact, &run, x, NULL, &t, &report), MORPH_OK);
    figures f = {.clearance = INFINITY, .frames = t.frames, .rest = report.at_rest};
    for (int k = 0; k < t.frames; k++)
        measure(s, exact, &t.x[(size_t)k * 3 * (size_t)s->joints], &f);
    morph_trajectory_free(&t);
    morph_sdf_destroy(sdf);
    morph_distance_destroy(exact);
    morph_structure_destroy(s);
    free(x);
    return f;
}

static void test_layouts(void **state) {
    (void)state;
    static const struct {
        const char *name;
        morph_layout layout;
        morph_bracing bracing;
        morph_joint_type joints;
        morph_fixed fixed;
    } all[] = {
        {"posts, ball", MORPH_LAYOUT_POSTS, MORPH_BRACING_NONE, MORPH_JOINTS_BALL, MORPH_FIXED_NONE},
        {"posts, web", MORPH_LAYOUT_POSTS, MORPH_BRACING_WEB, MORPH_JOINTS_BALL, MORPH_FIXED_NONE},
        {"posts, full", MORPH_LAYOUT_POSTS, MORPH_BRACING_FULL, MORPH_JOINTS_BALL, MORPH_FIXED_NONE},
        {"posts, universal", MORPH_LAYOUT_POSTS, MORPH_BRACING_NONE, MORPH_JOINTS_UNIVERSAL,
         MORPH_FIXED_NONE},
        {"posts, universal, web", MORPH_LAYOUT_POSTS, MORPH_BRACING_WEB, MORPH_JOINTS_UNIVERSAL,
         MORPH_FIXED_NONE},
        {"posts, corners held", MORPH_LAYOUT_POSTS, MORPH_BRACING_NONE, MORPH_JOINTS_BALL,
         MORPH_FIXED_CORNERS},
        {"offset", MORPH_LAYOUT_OFFSET, MORPH_BRACING_NONE, MORPH_JOINTS_BALL, MORPH_FIXED_NONE},
    };
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        const figures f = drape(all[k].layout, all[k].bracing, all[k].joints, all[k].fixed);
        print_message(
            "%-22s length over by %.1e m, posts %.1e, panels %.1e, clearance %.1e m, %d frames, rest %d\n",
            all[k].name, f.length, f.post, f.panel, f.clearance, f.frames, f.rest);
        assert_true(f.length <= 1e-9 * 0.1);
        assert_true(f.post <= 1e-9);
        assert_true(f.panel <= 1e-6);
        assert_true(f.clearance >= -1e-3 * 0.1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_layouts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
