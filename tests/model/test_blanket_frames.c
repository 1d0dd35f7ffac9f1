/* Every recorded frame of whole scenes: at rest at the end, joints, links and skin no deeper in the target
 * than 1e-3 spacings, lengths within 1e-9, all by means of the test's own (frames.h). bench_frames shows
 * larger grids.
 */
#include "tests/model/frames.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <unistd.h>

#include <cmocka.h>

static void examine(const frames_scene *f, int nodes) {
    morph_scene *scene = frames_read(f, nodes, MORPH_SOURCE_DIR);
    morph_workspace work;
    assert_non_null(scene);
    assert_int_equal(morph_workspace_create(scene, NULL, &work), MORPH_OK);
    const morph_blanket_def def = morph_scene_blanket(scene, work.structure);
    morph_trajectory t;
    morph_blanket_report r;
    frames_measure m;
    assert_int_equal(morph_blanket_run(work.structure, work.sdf, work.exact, &def, work.start, NULL, &t, &r),
                     MORPH_OK);
    assert_true(frames_examine(work.structure, &scene->target, scene->base, &t, &m));
    print_message(
        "%s %d x %d: %d frames, joints %.2e, links %.2e, skin %.2e, base %.2e, length %.1e spacings\n",
        f->name, nodes, nodes, m.frames, m.joint, m.link, m.skin, m.base, m.length);
    assert_true(r.at_rest);
    assert_true(m.joint >= -1e-3 && m.link >= -1e-3 && m.skin >= -1e-3 && m.base >= -1e-3);
    assert_int_equal(m.joints_inside, 0);
    assert_true(m.length <= 1e-9);
    /* A rising target arrives: no limit stands against it in these scenes. */
    assert_false(r.held_up);
    assert_true(t.lift[t.frames - 1] == 0.0);
    /* The target is there: something touches it. */
    assert_true(fmin(fmin(m.joint, m.link), m.skin) < 1e-2);
    morph_trajectory_free(&t);
    morph_workspace_free(&work);
    morph_scene_destroy(scene);
}

static void test_scenes(void **state) {
    (void)state;
    for (int i = 0; i < FRAMES_SCENES; i++)
        if (!frames_scenes[i].shared) examine(&frames_scenes[i], i == 1 || i == 2 ? 8 : 6);
}

static void test_shared(void **state) {
    (void)state;
    if (access(MORPH_SHARED_DIR "/models/spot_low_resolution.obj", R_OK) != 0) {
        print_message("%s/models is missing: skipped\n", MORPH_SHARED_DIR);
        skip();
    }
    for (int i = 0; i < FRAMES_SCENES; i++)
        if (frames_scenes[i].shared) examine(&frames_scenes[i], 6);
}

/* The measure itself: a flat sheet a known height over a box, in it, and with a corner in it. */
static void test_measure(void **state) {
    (void)state;
    static const double size[3] = {0.6, 0.6, 0.2};
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    morph_structure *s;
    morph_mesh box;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    assert_int_equal(morph_mesh_box(size, &box), MORPH_OK);
    double *x = malloc(3 * (size_t)s->joints * sizeof *x), lift = 0.0, time = 0.0;
    assert_non_null(x);
    morph_trajectory t = {.frames = 1, .joints = s->joints, .time = &time, .x = x, .lift = &lift};
    frames_measure m;
    for (int at = 0; at < 4; at++) {
        /* above the top at 0.1; sunk a tenth of a radius; inside without touching; a joint through the top */
        static const double height[] = {0.12, 0.1 + 0.0036, -0.05, 0.11};
        for (int i = 0; i < 3 * s->joints; i++)
            x[i] = s->start[i] + (i % 3 == 2 ? height[at] : 0.0);
        if (at == 3) x[2] = 0.09;
        assert_true(frames_examine(s, &box, NAN, &t, &m));
        if (at < 2) {
            const double gap = (height[at] - 0.1 - def.radius) / s->spacing;
            assert_true(fabs(m.joint - gap) < 1e-12 && fabs(m.link - gap) < 1e-12 &&
                        fabs(m.skin - gap) < 1e-12);
            assert_int_equal(m.joints_inside, 0);
        } else if (at == 2)
            assert_int_equal(m.joints_inside, s->joints);
        else {
            assert_true(isinf(m.link) && isinf(m.skin));
            assert_int_equal(m.joints_inside, 1);
        }
    }
    x[0] -= 0.1; /* a link of a corner is too long now */
    assert_true(frames_examine(s, &box, NAN, &t, &m) && m.length > 0.1);
    free(x);
    morph_mesh_free(&box);
    morph_structure_destroy(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_scenes), cmocka_unit_test(test_shared),
                                       cmocka_unit_test(test_measure)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
