/* Placement on small scenes: seeds stand beneath cavities, the blanket under the placed centres lies closer
 * than under the seeds, and what the last program says of its point holds when it is measured anew. */
#include "planner/guide.h"
#include "planner/placement.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef struct fixture {
    morph_scene *scene;
    morph_workspace work;
    morph_trajectory nominal;
    const double *end;
} fixture;

static void open_scene(fixture *f, const char *name) {
    char path[512];
    snprintf(path, sizeof path, "%s/examples/scenes/%s", MORPH_SOURCE_DIR, name);
    *f = (fixture){0};
    assert_int_equal(morph_scene_read(path, NULL, NULL, NULL, &f->scene), MORPH_OK);
    /* Posts held square: fewer soft motions, a quicker rest. */
    f->scene->structure.square = 0.02;
    assert_int_equal(morph_workspace_create(f->scene, NULL, &f->work), MORPH_OK);
    const morph_blanket_def def = morph_scene_blanket(f->scene, f->work.structure);
    assert_int_equal(morph_blanket_run(f->work.structure, f->work.sdf, f->work.exact, &def, f->work.start,
                                       NULL, &f->nominal, NULL),
                     MORPH_OK);
    f->end = &f->nominal.x[(size_t)(f->nominal.frames - 1) * 3 * (size_t)f->work.structure->joints];
}

static void close_scene(fixture *f) {
    morph_trajectory_free(&f->nominal);
    morph_workspace_free(&f->work);
    morph_scene_destroy(f->scene);
}

static double unit_of(const fixture *f) {
    return f->scene->structure.mass * f->scene->motion.gravity;
}

/* Seeds stand under the sheet, over the base plane, beneath what is left open: nearer to the base than the
 * region itself. */
static void seed_beneath(void **state) {
    (void)state;
    fixture f;
    open_scene(&f, "sphere_4.yaml");
    morph_attractor seed[4];
    morph_cavity_region region[4];
    int count = 0, regions = 0;
    assert_int_equal(morph_seed_centres(&f.work, f.end, unit_of(&f), 4, seed, &count), MORPH_OK);
    assert_int_equal(morph_cavity_regions(f.work.cavity, f.end, 0.005, 4, region, &regions), MORPH_OK);
    assert_true(count >= 1 && count <= regions);
    for (int k = 0; k < count; k++) {
        assert_true(seed[k].at[2] >= 0.0 && seed[k].at[2] < region[k].at[2]);
        assert_true(fabs(seed[k].at[0] - region[k].at[0]) < 1e-12);
        assert_true(fabs(seed[k].at[1] - region[k].at[1]) < 1e-12);
        assert_true(fabs(seed[k].strength - MORPH_SEED_STRENGTH * unit_of(&f) * 0.01) < 1e-12);
        assert_true(k == 0 || region[k].volume <= region[k - 1].volume);
    }
    close_scene(&f);
}

/* A flat sheet on a plate has no cavity: no seed. */
static void no_cavity_no_seed(void **state) {
    (void)state;
    fixture f;
    open_scene(&f, "box_4.yaml");
    double *x = morph_alloc(3 * (size_t)f.work.structure->joints, sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < 3 * f.work.structure->joints; i++)
        x[i] = f.work.structure->start[i] + (i % 3 == 2 ? f.scene->base + f.scene->structure.radius : 0.0);
    morph_attractor seed[4];
    int count = -1;
    /* Where the target stands there is no cavity either: the sheet is inside it. */
    assert_int_equal(morph_seed_centres(&f.work, x, unit_of(&f), 4, seed, &count), MORPH_OK);
    assert_int_equal(count, 0);
    free(x);
    close_scene(&f);
}

/* Rest shape adopted from the blanket: in balance, where the blanket lies, and stable. */
static void adopts_the_blanket(void **state) {
    (void)state;
    fixture f;
    open_scene(&f, "sphere_4.yaml");
    const int n = 3 * f.work.structure->joints;
    const double a = f.work.structure->spacing;
    const morph_balance_load load = {f.scene->motion.gravity, 0.0};
    const morph_attractor centre = {{0.0, 0.0, 0.5}, 3.0};
    morph_balance *b = NULL;
    morph_rest rest;
    double *x = morph_alloc((size_t)n, sizeof *x), furthest = 0.0;
    assert_non_null(x);
    for (int i = 0; i < n; i++)
        x[i] = f.end[i] / a;
    assert_int_equal(morph_balance_create(&f.work.world, &load, 1, &b), MORPH_OK);
    b->hold = 10.0;
    assert_int_equal(morph_rest_adopt(b, &centre, 1e-3, x, NULL, &rest), MORPH_OK);
    for (int i = 0; i < n; i++)
        furthest = fmax(furthest, fabs(rest.z[i] - x[i]));
    assert_true(furthest < 0.1);
    /* Its force makes it a point of balance with the springs of `hold` at rest. */
    morph_balance_report r;
    assert_int_equal(morph_balance_examine(b, rest.z, &r), MORPH_OK);
    assert_true(r.residual < 1e-6);
    assert_true(r.penetration < 1e-6);
    assert_true(fabs(r.complementarity - 1e-3) < 1e-6);
    assert_true(r.stable);
    /* A force turned round is seen. */
    b->force[2] += 0.01;
    assert_int_equal(morph_balance_examine(b, rest.z, &r), MORPH_OK);
    assert_true(r.residual > 5e-3);
    morph_rest_free(&rest);
    morph_balance_destroy(b);
    free(x);
    close_scene(&f);
}

static void expect_lower(const char *scene) {
    fixture f;
    open_scene(&f, scene);
    morph_placement_options o = morph_placement_defaults();
    o.rounds = 3;
    o.most_centres = 1;
    morph_placement p;
    assert_int_equal(morph_placement_run(&f.work, f.scene, f.end, &o, &p), MORPH_OK);
    morph_measure blanket, end;
    assert_int_equal(morph_cavity_measure(f.work.cavity, f.end, &blanket), MORPH_OK);
    const size_t width = 3 * (size_t)f.work.structure->joints;
    assert_int_equal(
        morph_cavity_measure(f.work.cavity, &p.guided.x[(size_t)(p.guided.frames - 1) * width], &end),
        MORPH_OK);
    print_message("%s: blanket %.4g, seeds %.4g, placed %.4g\n", scene, 1e4 * blanket.objective,
                  1e4 * p.seeded.objective, 1e4 * p.reached.objective);
    /* What is reported is what the recorded run ends with. */
    assert_true(fabs(end.objective - p.reached.objective) <= 1e-12 * end.objective);
    assert_true(p.reached.objective < p.seeded.objective);
    assert_true(p.accepted >= 1);
    assert_true(p.balance.residual < 1e-6);
    assert_true(p.balance.complementarity < 1e-6);
    assert_true(p.difference < 0.3);
    for (int i = 1; i < p.guided.frames; i++)
        assert_true(p.guided.time[i] > p.guided.time[i - 1]);
    morph_placement_free(&p);
    close_scene(&f);
}

static void box_is_closed(void **state) {
    (void)state;
    expect_lower("box_4.yaml");
}

static void sphere_is_closed(void **state) {
    (void)state;
    expect_lower("sphere_4.yaml");
}

static int stop_at_once(void *user) {
    (void)user;
    return 1;
}

static void stops(void **state) {
    (void)state;
    fixture f;
    open_scene(&f, "box_4.yaml");
    morph_placement_options o = morph_placement_defaults();
    const morph_control control = {.stop = stop_at_once};
    morph_placement p;
    o.control = &control;
    assert_int_equal(morph_placement_run(&f.work, f.scene, f.end, &o, &p), MORPH_ERR_STOPPED);
    morph_placement_free(&p);
    close_scene(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(seed_beneath),       cmocka_unit_test(no_cavity_no_seed),
        cmocka_unit_test(adopts_the_blanket), cmocka_unit_test(box_is_closed),
        cmocka_unit_test(sphere_is_closed),   cmocka_unit_test(stops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
