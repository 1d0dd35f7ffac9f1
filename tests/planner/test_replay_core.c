/* What a blanket's own lengths do to the structure: with the target as a solid core the sheet stays outside
 * of it in every frame, by FCL's distances and solid angles; without, the same lengths let it sink where the
 * target was. A rising target that a limit stops is named in the plan.
 */
#include "tests/model/frames.h"

#include "planner/replay.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static morph_scene *scene_of(const char *text) {
    morph_scene *scene = NULL;
    assert_int_equal(morph_scene_parse("scene.yaml", text, strlen(text), NULL, NULL, NULL, &scene), MORPH_OK);
    return scene;
}

static void test_core(void **state) {
    (void)state;
    morph_scene *scene = scene_of(
        "morphplan: 1\nstructure: {nodes: [5, 5], spacing: 0.1, link: {stiffness: 20}}\n"
        "target: {shape: box, size: [0.16, 0.16, 0.12]}\nmotion: {friction: 0.4, time: 4.0}\n"
        "attractors: none\nbase: 0.0\n");
    morph_workspace work;
    morph_trajectory t, again;
    assert_int_equal(morph_workspace_create(scene, NULL, &work), MORPH_OK);
    const morph_structure *s = work.structure;
    const morph_blanket_def def = morph_scene_blanket(scene, s);
    assert_int_equal(morph_blanket_run(s, work.sdf, work.exact, &def, work.start, NULL, &t, NULL), MORPH_OK);
    double *length = malloc((size_t)t.frames * (size_t)s->links * sizeof *length);
    assert_non_null(length);
    for (int k = 0; k < t.frames; k++)
        morph_link_lengths(s, &t.x[(size_t)k * 3 * (size_t)s->joints], &length[(size_t)k * (size_t)s->links]);
    for (int core = 0; core < 2; core++) {
        morph_replay_report r;
        frames_measure m;
        const morph_replay_input in = {.structure = s,
                                       .scene = scene,
                                       .cavity = work.cavity,
                                       .core = core ? work.sdf : NULL,
                                       .samples = t.frames,
                                       .step = def.frame,
                                       .joints = t.x,
                                       .length = length};
        assert_int_equal(morph_replay_run(&in, NULL, &again, &r), MORPH_OK);
        assert_true(frames_examine(s, &scene->target, scene->base, &again, &m));
        print_message(
            "%s: joints %.2e, links %.2e, skin %.2e, base %.2e spacings, %d joints inside; ends %.2f "
            "spacings "
            "from the blanket's end, lengths kept to %.1e m\n",
            core ? "with the core" : "without", m.joint, m.link, m.skin, m.base, m.joints_inside,
            r.most / s->spacing, r.length);
        assert_true(r.done && r.length <= 1e-9 * s->spacing && !r.floating);
        assert_true(m.base >= (core ? -0.02 : -0.1));
        if (core) {
            /* Frames are not polished by exact distances here: half a radius. */
            assert_true(fmin(fmin(m.joint, m.link), m.skin) >= -0.02);
            assert_int_equal(m.joints_inside, 0);
        } else
            assert_true(isinf(m.skin) || m.joints_inside > 0);
        morph_trajectory_free(&again);
    }
    free(length);
    morph_trajectory_free(&t);
    morph_workspace_free(&work);
    morph_scene_destroy(scene);
}

/* The fact, the limit and the link are named, and the target's way is recorded as far as it came. */
static void test_stopped_target(void **state) {
    (void)state;
    for (int high = 0; high < 2; high++) {
        char text[512];
        snprintf(
            text, sizeof text,
            "morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1, fixed: border, support: frame, link: "
            "{stiffness: 20}}\ntarget: {shape: sphere, radius: 0.08, at: [0, 0, %g]}\n"
            "motion: {mode: rise, height: %g, friction: 0.4, time: 2.0}\nschedule: {sample: 0.01}\n"
            "attractors: none\n",
            high ? 0.17 : -0.02, high ? 0.25 : 0.06);
        morph_scene *scene = scene_of(text);
        const morph_plan_options o = {.method = MORPH_METHOD_BLANKET};
        morph_plan *plan = NULL;
        assert_int_equal(morph_plan_run(scene, &o, &plan), MORPH_OK);
        const morph_blanket_report *b = &plan->summary.blanket_report;
        const morph_record *r = &plan->record;
        const double end = r->offset_nominal[3 * (size_t)(r->nominal_frames - 1) + 2];
        print_message("%s\n", plan->summary.warning[0] ? plan->summary.warning : "no warning");
        assert_true(b->held_up == (high == 1));
        assert_true(end == -b->short_of);
        if (high) {
            assert_non_null(strstr(plan->summary.warning, "the target stopped rising at "));
            assert_non_null(strstr(plan->summary.warning, "the length limit of link "));
            assert_true(b->short_of > 0.05 && b->short_of < 0.25);
        } else {
            assert_null(strstr(plan->summary.warning, "stopped rising"));
            assert_true(b->short_of == 0.0);
        }
        morph_plan_destroy(plan);
        morph_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_core), cmocka_unit_test(test_stopped_target)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
