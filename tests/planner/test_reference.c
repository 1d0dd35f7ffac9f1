/* The reference: what it may do and what it must keep, never above a start that holds; named failures. */
#include "test_pose_fixture.h"

#include "planner/reference.h"

#include <string.h>

/* The fixture's parts as a workspace, which borrows them. */
static morph_workspace borrowed(const fixture *f) {
    return (morph_workspace){
        .structure = f->s, .exact = f->exact, .sdf = f->sdf, .cavity = f->cavity, .world = f->world};
}

static double *flat(const fixture *f, double height) {
    double *x = morph_alloc((size_t)f->n, sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < f->n; i++)
        x[i] = f->s->start[i] + (i % 3 == 2 ? height : 0.0);
    return x;
}

static double objective(const fixture *f, const double *x) {
    morph_measure m;
    assert_int_equal(morph_cavity_measure(f->cavity, x, &m), MORPH_OK);
    return m.objective;
}

static void grid(fixture *f, int nx, int ny) {
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    morph_structure_def def = morph_structure_defaults(STEP);
    def.nodes[0] = nx;
    def.nodes[1] = ny;
    fixture_make_def(f, &def, &box, 0.0);
}

static void test_structure(void **state) {
    (void)state;
    fixture f;
    grid(&f, 3, 3);
    morph_structure *wide;
    assert_int_equal(morph_reference_structure(f.s, &wide), MORPH_OK);
    assert_int_equal(wide->links, f.s->links);
    for (int l = 0; l < wide->links; l++) {
        assert_near(wide->length_limit[l][0], 0.05 * STEP, 1e-12);
        assert_near(wide->length_limit[l][1], 20.0 * STEP, 1e-12);
        assert_near(wide->start_length[l], f.s->start_length[l], 0.0);
    }
    for (int t = 0; t < wide->link_posts; t++)
        assert_true(wide->link_post_limit[t][0] < 0.03 && wide->link_post_limit[t][1] > 3.11);
    for (int t = 0; t < wide->link_links; t++)
        assert_true(wide->link_link_limit[t][0] < 0.03 && wide->link_link_limit[t][1] > 3.11);
    for (int p = 0; p < wide->posts; p++)
        assert_near(wide->post_length[p], f.s->post_length[p], 0.0);
    morph_structure_destroy(wide);

    /* What a scene allows beyond that it keeps. */
    morph_structure_def def = f.s->def;
    def.length[0][0] = 0.01 * STEP;
    def.length[1][1] = 30.0 * STEP;
    morph_structure *own, *wider;
    assert_int_equal(morph_structure_create(&def, &own), MORPH_OK);
    assert_int_equal(morph_reference_structure(own, &wider), MORPH_OK);
    assert_near(wider->def.length[0][0], 0.01 * STEP, 0.0);
    assert_near(wider->def.length[1][1], 30.0 * STEP, 0.0);
    morph_structure_destroy(own);
    morph_structure_destroy(wider);
    fixture_free(&f);
}

/* Posts, contact, base and self by the plain measures of this test, not by the solver's. */
static void assert_held(const fixture *f, const double *x) {
    for (int p = 0; p < f->s->posts; p++) {
        const double length = morph_dist(&x[3 * f->s->post[p][0]], &x[3 * f->s->post[p][1]]);
        assert_near(length, f->s->post_length[p], 1e-6 * f->s->post_length[p]);
    }
    const double radius = f->s->def.radius;
    for (int q = 0; q < f->cavity->samples; q++) {
        const morph_skin_sample *sample = &f->cavity->sample[q];
        double at[3] = {0.0, 0.0, 0.0};
        for (int a = 0; a < 3; a++)
            for (int k = 0; k < 3; k++)
                at[k] += sample->weight[a] * x[3 * sample->joint[a] + k];
        assert_true(solid_distance(&f->solid, at) >= radius - 1.01e-3 * STEP);
    }
    for (int j = 0; j < f->s->joints; j++)
        assert_true(x[3 * j + 2] >= f->world.base - 1e-6);
}

/* From a flat sheet high above: it lies far nearer, with limits broken, and again from its own result it is
 * no worse. */
static void test_solves(void **state) {
    (void)state;
    fixture f;
    grid(&f, 3, 2);
    const morph_workspace w = borrowed(&f);
    double *high = flat(&f, 0.12), *x = morph_alloc((size_t)f.n, sizeof *x);
    assert_non_null(x);
    const double *start[1] = {high};
    morph_measure m;
    morph_reference_report r;
    assert_int_equal(morph_reference_solve(&w, start, 1, NULL, x, &m, &r), MORPH_OK);
    assert_true(r.feasible && r.starts == 2 && r.best >= 0 && r.effort.solves > 2);
    assert_held(&f, x);
    assert_near(m.objective, objective(&f, x), 0.0);
    assert_true(m.objective < 0.5 * objective(&f, high));
    /* Limits are what it does without. */
    double *lengths = morph_alloc((size_t)f.s->links, sizeof *lengths);
    assert_non_null(lengths);
    morph_link_lengths(f.s, x, lengths);
    int beyond = 0;
    for (int l = 0; l < f.s->links; l++)
        beyond += lengths[l] < f.s->length_limit[l][0] - 1e-6 || lengths[l] > f.s->length_limit[l][1] + 1e-6;
    double scaled[3 * 12];
    morph_violation v;
    for (int i = 0; i < f.n; i++)
        scaled[i] = x[i] / STEP;
    assert_int_equal(morph_pose_examine(&f.world, scaled, NULL, NULL, NULL, NULL, &v), MORPH_OK);
    assert_true(beyond > 0 || v.amount[MORPH_LIMIT_ANGLE] > 1e-3);

    double *again = morph_alloc((size_t)f.n, sizeof *again);
    assert_non_null(again);
    const double *better[1] = {x};
    morph_measure second;
    assert_int_equal(morph_reference_solve(&w, better, 1, NULL, again, &second, &r), MORPH_OK);
    assert_true(second.objective <= m.objective && r.starts == 2);
    free(again);
    free(lengths);
    free(high);
    free(x);
    fixture_free(&f);
}

static int at_once(void *user) {
    (void)user;
    return 1;
}

/* A start that holds is a result itself, whatever the solver makes of it: here it may do nothing. */
static void test_start_counts(void **state) {
    (void)state;
    fixture f;
    grid(&f, 3, 2);
    const morph_workspace w = borrowed(&f);
    double *low = flat(&f, 0.065), *x = morph_alloc((size_t)f.n, sizeof *x);
    assert_non_null(x);
    const double *start[1] = {low};
    const morph_control control = {.stop = at_once};
    morph_measure m;
    morph_reference_report r;
    assert_int_equal(morph_reference_solve(&w, start, 1, &control, x, &m, &r), MORPH_ERR_STOPPED);
    assert_true(r.best == 0 && r.feasible);
    assert_true(m.objective <= objective(&f, low));
    assert_near(m.objective, objective(&f, x), 0.0);

    /* One that lies in the target does not hold: what comes of it does. */
    for (int i = 2; i < f.n; i += 3)
        low[i] -= 0.05;
    assert_int_equal(morph_reference_solve(&w, start, 1, NULL, x, &m, &r), MORPH_OK);
    assert_true(r.feasible);
    assert_held(&f, x);
    assert_true(memcmp(x, low, (size_t)f.n * sizeof *x) != 0);
    free(low);
    free(x);
    fixture_free(&f);
}

static void test_refuses(void **state) {
    (void)state;
    fixture f;
    grid(&f, 3, 2);
    morph_workspace w = borrowed(&f);
    double *x = flat(&f, 0.12);
    const double *start[1] = {x};
    morph_measure m;
    morph_reference_report r;
    w.sdf = NULL;
    assert_int_equal(morph_reference_solve(&w, start, 1, NULL, x, &m, &r), MORPH_ERR_INPUT);
    assert_int_equal(r.best, -1);
    free(x);
    fixture_free(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_structure),
        cmocka_unit_test(test_solves),
        cmocka_unit_test(test_start_counts),
        cmocka_unit_test(test_refuses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
