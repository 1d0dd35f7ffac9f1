/* Replay: lengths alone lead a rigid structure to the planned shape, and a loose one elsewhere. */
#include "planner/replay.h"

#include "model/align.h"
#include "model/kinematics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/model/solids.h"

enum { SAMPLES = 1001 };

typedef struct stage {
    morph_structure *s;
    morph_scene scene;
    morph_distance *exact;
    morph_cavity *cavity;
    double *joints, *length;
} stage;

/* Heights of a dome or a saddle over the grid, in spacings. */
static double height(int shape, double x, double y) {
    return shape == 0 ? 0.08 * (4.5 - x * x - y * y) : 0.10 * (x * x - y * y);
}

/* Pose at t in 0..1: posts stand on the surface along its normal. */
static void set_pose(const morph_structure *s, int shape, double t, double *x) {
    const double a = s->spacing, h = 1e-5;
    for (int p = 0; p < s->posts; p++) {
        const double *flat = &s->start[3 * s->post[p][0]], u = flat[0] / a, v = flat[1] / a;
        const double du = (height(shape, u + h, v) - height(shape, u - h, v)) / (2.0 * h);
        const double dv = (height(shape, u, v + h) - height(shape, u, v - h)) / (2.0 * h);
        double normal[3] = {-t * du, -t * dv, 1.0};
        const double size = morph_norm(normal);
        for (int k = 0; k < 3; k++) {
            const double foot = k == 2 ? 0.1 + t * a * height(shape, u, v) : flat[k];
            x[3 * s->post[p][0] + k] = foot;
            x[3 * s->post[p][1] + k] = foot + s->post_length[p] * normal[k] / size;
        }
    }
}

static void make_stage(stage *g, morph_bracing bracing, int shape) {
    memset(g, 0, sizeof *g);
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    def.bracing = bracing;
    assert_int_equal(morph_structure_create(&def, &g->s), MORPH_OK);
    g->scene.motion = (morph_motion_def){.gravity = 9.81, .drag = 0.2, .friction = 0.6, .time = 1.5};
    make_box(0.05, 0.05, 0.02);
    g->exact = finish(true);
    assert_int_equal(morph_cavity_create(g->s, g->exact, 0.0, &g->cavity), MORPH_OK);
    const size_t width = 3 * (size_t)g->s->joints;
    g->joints = malloc(SAMPLES * width * sizeof(double));
    g->length = malloc(SAMPLES * (size_t)g->s->links * sizeof(double));
    assert_true(g->joints && g->length);
    for (int k = 0; k < SAMPLES; k++) {
        const double t = (double)k / (SAMPLES - 1), smooth = t * t * t * (10.0 + t * (6.0 * t - 15.0));
        set_pose(g->s, shape, smooth, &g->joints[(size_t)k * width]);
        morph_link_lengths(g->s, &g->joints[(size_t)k * width], &g->length[(size_t)k * (size_t)g->s->links]);
    }
}

static void free_stage(stage *g) {
    morph_cavity_destroy(g->cavity);
    morph_distance_destroy(g->exact);
    morph_structure_destroy(g->s);
    free(g->joints);
    free(g->length);
}

static morph_replay_report play(stage *g, double base, morph_support support) {
    morph_trajectory t;
    morph_replay_report r;
    g->scene.base = base;
    g->s->def.support = support;
    const morph_replay_input in = {.structure = g->s,
                                   .scene = &g->scene,
                                   .cavity = g->cavity,
                                   .samples = SAMPLES,
                                   .step = 0.002,
                                   .joints = g->joints,
                                   .length = g->length};
    assert_int_equal(morph_replay_run(&in, NULL, &t, &r), MORPH_OK);
    assert_true(r.done && t.frames > 200 && t.joints == g->s->joints);
    morph_trajectory_free(&t);
    return r;
}

static void test_rigid(void **state) {
    (void)state;
    for (int shape = 0; shape < 2; shape++) {
        stage g;
        make_stage(&g, MORPH_BRACING_FULL, shape);
        const morph_replay_report r = play(&g, 0.0, MORPH_SUPPORT_BASE),
                                  floating = play(&g, NAN, MORPH_SUPPORT_BASE);
        print_message(
            "%s, full bracing: ends %.1e spacings off on its base, %.1e floating; lengths kept to %.1e m\n",
            shape ? "saddle" : "dome", r.most / 0.1, floating.most / 0.1, r.length);
        assert_true(r.most <= 1e-3 * 0.1 && r.rms <= r.most && floating.most <= 1e-3 * 0.1);
        assert_true(floating.floating && !r.floating);
        assert_true(r.length <= 1e-9 * 0.1);
        free_stage(&g);
    }
}

static void test_loose(void **state) {
    (void)state;
    for (int shape = 0; shape < 2; shape++) {
        stage g;
        make_stage(&g, MORPH_BRACING_NONE, shape);
        const morph_replay_report r = play(&g, 0.0, MORPH_SUPPORT_BASE);
        morph_mobility m;
        assert_int_equal(
            morph_mobility_at(g.s, &g.joints[(size_t)(SAMPLES - 1) * 3 * (size_t)g.s->joints], &m), MORPH_OK);
        print_message("%s, ball joints without bracing: ends %.2f spacings off, %d free motions\n",
                      shape ? "saddle" : "dome", r.most / 0.1, m.free);
        assert_true(m.free > 0 && r.most > 0.05 * 0.1);
        assert_true(r.length <= 1e-9 * 0.1);
        free_stage(&g);
    }
}

/* Held by its border, the frame does not move. */
static void test_frame(void **state) {
    (void)state;
    stage g;
    make_stage(&g, MORPH_BRACING_NONE, 0);
    /* The lengths of the flat sheet, all along: it can only stay. */
    for (int k = 1; k < SAMPLES; k++) {
        memcpy(&g.length[(size_t)k * (size_t)g.s->links], g.length, (size_t)g.s->links * sizeof(double));
        memcpy(&g.joints[(size_t)k * 3 * (size_t)g.s->joints], g.joints,
               3 * (size_t)g.s->joints * sizeof(double));
    }
    const morph_replay_report r = play(&g, NAN, MORPH_SUPPORT_FRAME);
    assert_false(r.floating);
    assert_true(r.most <= 0.05 * 0.1);
    free_stage(&g);
}

/* A rotated and shifted copy comes back; a mirrored one does not. */
static void test_align(void **state) {
    (void)state;
    double x[3 * 20], y[3 * 20], rms, most;
    for (int i = 0; i < 60; i++)
        x[i] = uniform(-1.0, 1.0);
    for (int i = 0; i < 20; i++) {
        const double c = cos(2.5), s = sin(2.5), *p = &x[3 * i];
        y[3 * i] = c * p[0] - s * p[1] + 3.0;
        y[3 * i + 1] = p[2] - 1.0;
        y[3 * i + 2] = -(s * p[0] + c * p[1]);
    }
    assert_int_equal(morph_align(20, y, x, &rms, &most), MORPH_OK);
    assert_true(most < 1e-14 && rms <= most);
    for (int i = 0; i < 60; i++)
        y[i] = i % 3 == 0 ? -x[i] : x[i];
    assert_int_equal(morph_align(20, y, x, &rms, &most), MORPH_OK);
    assert_true(rms > 0.1);
    y[7] = NAN;
    assert_int_equal(morph_align(20, y, x, &rms, &most), MORPH_ERR_NONFINITE);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_rigid), cmocka_unit_test(test_loose),
                                       cmocka_unit_test(test_frame), cmocka_unit_test(test_align)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
