/* Refinement: never worse than a feasible start, better where there is room, every limit kept by plain
 * measure. */
#include "test_pose_fixture.h"

#include "model/blanket.h"
#include "planner/refine.h"

#include <string.h>

/* The blanket after a short fall onto the target: metres, from `height`. */
static double *draped(const fixture *f, double height) {
    double *x = morph_alloc((size_t)f->n, sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < f->n; i++)
        x[i] = f->s->start[i] + (i % 3 == 2 ? height : 0.0);
    const morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 0.6, .frame = 0.02, .base = f->world.base};
    morph_trajectory t = {0};
    assert_int_equal(morph_blanket_run(f->s, f->sdf, f->exact, &def, x, NULL, &t, NULL), MORPH_OK);
    memcpy(x, &t.x[(size_t)(t.frames - 1) * (size_t)f->n], (size_t)f->n * sizeof *x);
    morph_trajectory_free(&t);
    return x;
}

static double objective(const fixture *f, const double *x) {
    morph_measure m;
    assert_int_equal(morph_cavity_measure(f->cavity, x, &m), MORPH_OK);
    return m.objective;
}

static void assert_metres_within(fixture *f, const double *x, double slack) {
    double *scaled = morph_alloc((size_t)f->n, sizeof *scaled);
    assert_non_null(scaled);
    for (int i = 0; i < f->n; i++)
        scaled[i] = x[i] / f->s->spacing;
    assert_within(f, scaled, slack);
    free(scaled);
}

static void soft_grid(fixture *f, const solid *body) {
    morph_structure_def def = morph_structure_defaults(STEP);
    def.nodes[0] = def.nodes[1] = 4;
    def.stiffness = 20.0;
    fixture_make_def(f, &def, body, 0.0);
}

static morph_refine_options brief(int rounds) {
    morph_refine_options o = morph_refine_defaults();
    o.rounds = rounds;
    return o;
}

static void lowers(const solid *body, double top, double gain, double slack) {
    fixture f;
    soft_grid(&f, body);
    double *x = draped(&f, top + 0.05);
    const double before = objective(&f, x);
    const morph_refine_options o = brief(4);
    morph_refine_report r = {0};
    morph_refine_report_free(&r);
    assert_int_equal(morph_refine(&f.world, &o, x, &r), MORPH_OK);
    assert_true(r.feasible && r.rounds >= 1 && r.effort.solves >= r.rounds);
    assert_true(r.effort.jacobian_nonzeros > 0 && r.effort.hessian_nonzeros > 0 &&
                r.rows_possible == morph_possible_rows(f.s));
    assert_metres_within(&f, x, slack);
    const double after = objective(&f, x);
    if (after > gain * before) fail_msg("objective %.4g from %.4g", after, before);

    /* Again from the result: feasible, so never worse, to the bit where nothing is gained. */
    const morph_refine_options again = brief(2);
    morph_refine_report_free(&r);
    assert_int_equal(morph_refine(&f.world, &again, x, &r), MORPH_OK);
    assert_true(r.feasible);
    assert_metres_within(&f, x, slack);
    if (objective(&f, x) > after * (1.0 + 1e-3))
        fail_msg("objective %.8g from a feasible %.8g", objective(&f, x), after);
    free(x);
    morph_refine_report_free(&r);
    fixture_free(&f);
}

static void test_on_box(void **state) {
    (void)state;
    const solid box = solid_box(0.15, 0.15, 0.09, 0.045);
    lowers(&box, 0.09, 0.8, 1.3);
}

static void test_on_sphere(void **state) {
    (void)state;
    const solid ball = {.ball = true, .centre = {0.0, 0.0, 0.06}, .radius = 0.08};
    /* The mesh lies inside the ball: by radius (1 - cos(pi / 40)) each way, 0.005 spacings in all: ten
     * tolerances. */
    lowers(&ball, 0.14, 0.8, 11.3);
}

/* From a flat pose, feasible but far from its best: the first round may be too bold, the second is not. */
static void test_flat_start(void **state) {
    (void)state;
    fixture f;
    const solid box = solid_box(0.15, 0.15, 0.09, 0.045);
    soft_grid(&f, &box);
    double *x = morph_alloc((size_t)f.n, sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < f.n; i++)
        x[i] = f.s->start[i] + (i % 3 == 2 ? 0.1 : 0.0);
    const double before = objective(&f, x);
    const morph_refine_options o = brief(2);
    morph_refine_report r = {0};
    morph_refine_report_free(&r);
    assert_int_equal(morph_refine(&f.world, &o, x, &r), MORPH_OK);
    if (!r.feasible || r.rounds != 2 || objective(&f, x) > 0.7 * before)
        fail_msg("feasible %d after %d rounds, objective %.6g from %.6g", r.feasible, r.rounds,
                 objective(&f, x), before);
    assert_metres_within(&f, x, 1.3);
    free(x);
    morph_refine_report_free(&r);
    fixture_free(&f);
}

typedef struct counter {
    int asked, most;
} counter;

static int after_most(void *user) {
    counter *c = user;
    return ++c->asked > c->most;
}

/* Stopped at any moment: the best so far, as good as a feasible start and as feasible. */
static void test_stop(void **state) {
    (void)state;
    fixture f;
    const solid box = solid_box(0.15, 0.15, 0.09, 0.045);
    soft_grid(&f, &box);
    double *start = draped(&f, 0.14), *x = morph_alloc((size_t)f.n, sizeof *x);
    assert_non_null(x);
    morph_refine_report r = {0};
    const morph_refine_options none = brief(0);
    assert_int_equal(morph_refine(&f.world, &none, start, &r), MORPH_OK);
    assert_true(r.feasible);
    const double before = objective(&f, start);
    const int moments[4] = {0, 1, 20, 90};
    for (int k = 0; k < 4; k++) {
        counter c = {.most = moments[k]};
        const morph_control control = {.stop = after_most, .user = &c};
        morph_refine_options o = brief(6);
        o.control = &control;
        memcpy(x, start, (size_t)f.n * sizeof *x);
        morph_refine_report_free(&r);
        assert_int_equal(morph_refine(&f.world, &o, x, &r), MORPH_ERR_STOPPED);
        assert_true(c.asked > c.most);
        if (c.asked > c.most + 60) fail_msg("asked %d times more after the first yes", c.asked - c.most);
        assert_true(r.feasible);
        assert_metres_within(&f, x, 1.3);
        if (objective(&f, x) > before * (1.0 + 1e-3))
            fail_msg("stopped at %.8g from %.8g", objective(&f, x), before);
    }
    free(start);
    free(x);
    morph_refine_report_free(&r);
    fixture_free(&f);
}

static void test_seconds_and_faults(void **state) {
    (void)state;
    fixture f;
    const solid box = solid_box(0.15, 0.15, 0.09, 0.045);
    soft_grid(&f, &box);
    double *x = draped(&f, 0.14);
    morph_refine_options o = brief(50);
    o.least_reach = 0.0;
    o.seconds = 0.2;
    morph_refine_report r = {0};
    const double began = morph_seconds();
    morph_refine_report_free(&r);
    const morph_status status = morph_refine(&f.world, &o, x, &r);
    assert_true(status == MORPH_OK);
    assert_true(r.rounds < 50 && morph_seconds() - began < 120.0);
    x[4] = NAN;
    morph_refine_report_free(&r);
    assert_int_equal(morph_refine(&f.world, &o, x, &r), MORPH_ERR_NONFINITE);
    free(x);
    morph_refine_report_free(&r);
    fixture_free(&f);
}

/* Two runs, the same bits. */
static void test_repeats(void **state) {
    (void)state;
    fixture f;
    const solid box = solid_box(0.15, 0.15, 0.09, 0.045);
    soft_grid(&f, &box);
    double *x = draped(&f, 0.14), *y = morph_alloc((size_t)f.n, sizeof *y);
    assert_non_null(y);
    memcpy(y, x, (size_t)f.n * sizeof *y);
    const morph_refine_options o = brief(2);
    morph_refine_report r = {0};
    morph_refine_report_free(&r);
    assert_int_equal(morph_refine(&f.world, &o, x, &r), MORPH_OK);
    morph_refine_report_free(&r);
    assert_int_equal(morph_refine(&f.world, &o, y, &r), MORPH_OK);
    assert_memory_equal(x, y, (size_t)f.n * sizeof *y);
    free(x);
    free(y);
    morph_refine_report_free(&r);
    fixture_free(&f);
}

int main(void) {
    morph_blas_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_on_box),
        cmocka_unit_test(test_on_sphere),
        cmocka_unit_test(test_flat_start),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_seconds_and_faults),
        cmocka_unit_test(test_repeats),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
