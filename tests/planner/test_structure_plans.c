/* Whole plans of the examples of every kind of structure: their equalities measured again from the recorded
 * positions. */
#include "test_pose_fixture.h"

#include "planner/plan.h"

#include <stdlib.h>
#include <string.h>

/* As the check has it. */
static double sine(const int a[2], const int b[2], const double *x) {
    double u[3], v[3], d[3], c[3];
    morph_sub(&x[3 * a[1]], &x[3 * a[0]], u);
    morph_sub(&x[3 * b[1]], &x[3 * b[0]], v);
    morph_sub(&x[3 * b[0]], &x[3 * a[0]], d);
    morph_cross(u, v, c);
    return fabs(morph_dot(c, d)) / (morph_norm(u) * morph_norm(v) * morph_norm(d));
}

static void keep_line(void *user, const char *line) {
    snprintf(user, 512, "%s", line);
}

static morph_record *plan_example(const char *name, morph_plan **plan, morph_scene **scene) {
    char path[512], line[512] = "";
    snprintf(path, sizeof path, "%s/examples/scenes/%s.yaml", MORPH_SOURCE_DIR, name);
    if (morph_scene_read(path, keep_line, NULL, line, scene) != MORPH_OK) fail_msg("%s", line);
    (*scene)->sample = 0.01;
    (*scene)->attractors = MORPH_ATTRACT_NONE; /* placing centres takes longer than all the rest */
    const morph_plan_options o = {.method = MORPH_METHOD_IPOPT};
    assert_int_equal(morph_plan_run(*scene, &o, plan), MORPH_OK);
    if (!(*plan)->summary.feasible) fail_msg("%s: %s", name, (*plan)->summary.reason);
    return &(*plan)->record;
}

/* Equalities of a record, from its positions: posts, panels, held nodes, lengths that fit. */
static void assert_equalities(const morph_record *r) {
    const size_t n = 3 * (size_t)r->joints;
    for (int k = 0; k < r->samples; k++) {
        const double *x = &r->schedule_joints[(size_t)k * n], *first = r->schedule_joints;
        for (int p = 0; p < r->posts; p++)
            assert_near(morph_dist(&x[3 * r->post[p][0]], &x[3 * r->post[p][1]]), r->post_length[p], 1e-14);
        for (int q = 0; q < r->panels; q++)
            assert_near(sine(r->post[r->panel[q][0]], r->post[r->panel[q][1]], x), 0.0, 1e-12);
        for (int l = 0; l < r->links; l++) {
            const double length = morph_dist(&x[3 * r->link[l][0]], &x[3 * r->link[l][1]]);
            assert_near(r->length[(size_t)k * (size_t)r->links + (size_t)l], length, 1e-14);
            assert_true(beyond_range(length, r->length_limit[l]) <= 1e-9 * r->spacing);
        }
        for (int i = 0; i < r->fixed_count; i++)
            for (int e = 0; e < 2; e++) {
                const int joint = r->posts > 0 ? r->post[r->fixed[i]][e] : r->fixed[i];
                for (int m = 0; m < 3; m++)
                    assert_near(x[3 * joint + m], first[3 * joint + m], 1e-14);
            }
    }
}

static void check_example(const char *name, int links, int panels, int fixed) {
    morph_plan *plan;
    morph_scene *scene;
    const morph_record *r = plan_example(name, &plan, &scene);
    assert_int_equal(r->links, links);
    assert_int_equal(r->panels, panels);
    assert_int_equal(r->fixed_count, fixed);
    assert_true(r->samples > 20);
    assert_equalities(r);
    /* Better than the blanket, and by its own word at the end. */
    assert_true(plan->summary.plan.objective < plan->summary.blanket.objective);
    const double *offset = &r->offset_schedule[3 * (size_t)(r->samples - 1)];
    assert_near(offset[2], 0.0, 1e-15);
    const bool rises = scene->motion.mode == MORPH_MODE_RISE;
    assert_near(r->offset_schedule[2], rises ? -scene->motion.height : 0.0, 1e-12);
    morph_plan_destroy(plan);
    morph_scene_destroy(scene);
}

static void test_universal(void **state) {
    (void)state;
    check_example("box_universal", 48, 24, 0);
}

static void test_rise(void **state) {
    (void)state;
    check_example("rise_5", 80, 0, 16);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_universal), cmocka_unit_test(test_rise)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
