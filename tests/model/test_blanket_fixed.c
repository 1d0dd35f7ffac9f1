/* Every kind of fixed joints, dropped and with a target rising: what is fixed does not move by a bit, what is
 * not does; limits and clearance hold in every frame, by distances of the test's own.
 */
#include "tests/model/frames.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static morph_scene *scene_of(const char *fixed, bool rises, const char *joints) {
    char text[1024];
    morph_scene *scene = NULL;
    snprintf(text, sizeof text,
             "morphplan: 1\n"
             "structure: {nodes: [5, 6], spacing: 0.1, fixed: %s, joints: %s, link: {stiffness: 20}%s}\n"
             "target: {shape: sphere, radius: 0.12%s}\nmotion: {%s, friction: 0.4, time: 1.5}\n"
             "attractors: none\nbase: 0.0\n",
             fixed, joints, rises ? ", support: frame" : "", rises ? ", at: [0, 0, -0.05]" : "",
             rises ? "mode: rise, height: 0.09" : "mode: drop, height: 0.02");
    assert_int_equal(morph_scene_parse("scene.yaml", text, strlen(text), NULL, NULL, NULL, &scene), MORPH_OK);
    return scene;
}

static bool is_fixed(const morph_structure *s, int joint) {
    for (int k = 0; k < s->fixed_joints; k++)
        if (s->fixed_joint[k] == joint) return true;
    return false;
}

static void hold(const char *fixed, int least, bool rises, const char *joints) {
    morph_scene *scene = scene_of(fixed, rises, joints);
    morph_workspace work;
    morph_trajectory t;
    morph_blanket_report r;
    frames_measure m;
    assert_int_equal(morph_workspace_create(scene, NULL, &work), MORPH_OK);
    const morph_structure *s = work.structure;
    const morph_blanket_def def = morph_scene_blanket(scene, s);
    assert_int_equal(morph_blanket_run(s, work.sdf, work.exact, &def, work.start, NULL, &t, &r), MORPH_OK);
    assert_true(frames_examine(s, &scene->target, scene->base, &t, &m));
    assert_true(s->fixed_joints >= least && s->fixed_joints < s->joints);
    double moved = 0.0;
    for (int k = 0; k < t.frames; k++)
        for (int j = 0; j < s->joints; j++) {
            const double *x = &t.x[3 * ((size_t)k * (size_t)s->joints + (size_t)j)];
            if (is_fixed(s, j))
                assert_memory_equal(x, &work.start[3 * j], 3 * sizeof(double));
            else
                moved = fmax(moved, morph_dist(x, &work.start[3 * j]));
        }
    print_message(
        "%s, %s, %s: %d of %d joints held, others moved by up to %.2f spacings; links %.1e, skin "
        "%.1e, length %.1e, panels %.1e, posts %.1e%s\n",
        rises ? "rise" : "drop", fixed, joints, s->fixed_joints, s->joints, moved / s->spacing, m.link,
        m.skin, m.length, r.worst_panel, r.worst_post, r.held_up ? ", held up" : "");
    assert_true(fmin(fmin(m.joint, m.link), m.skin) >= -1e-3 && m.base >= -1e-3);
    assert_int_equal(m.joints_inside, 0);
    assert_true(m.length <= 1e-9 && r.worst_post <= 1e-9 && r.worst_panel <= 1e-6);
    assert_true(moved > 0.1 * s->spacing);
    /* No limit stands against these rises: the ball arrives. */
    assert_true(!r.held_up && t.lift[t.frames - 1] == 0.0);
    morph_trajectory_free(&t);
    morph_workspace_free(&work);
    morph_scene_destroy(scene);
}

static void test_fixed(void **state) {
    (void)state;
    for (int rises = 0; rises < 2; rises++) {
        hold("border", 2 * 18, rises == 1, "ball");
        hold("corners", 2 * 4, rises == 1, "ball");
        hold("[[0, 0], [4, 2], [1, 5]]", 2 * 3, rises == 1, "ball");
        hold("border", 2 * 18, rises == 1, "universal");
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_fixed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
