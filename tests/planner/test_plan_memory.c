/* Allocations of the stages fail in turn: no memory is said, nothing is left behind, nothing crashes.
 * The C library's allocator is wrapped; a sanitizer brings its own, so there the tests are skipped. */
#include "model/blanket.h"
#include "planner/check.h"
#include "planner/path.h"
#include "planner/plan.h"
#include "planner/refine.h"
#include "planner/timing.h"
#include "test_pose_fixture.h"

#include <limits.h>

#include "tests/support/refused_memory.h"

#if CAN_REFUSE
static fixture world;
static morph_mesh mesh;
static morph_curve *curve;
static morph_trajectory guide;
static morph_timing timing;
static double *flat;

/* Each job does one call and gives back all that it got. */
static morph_status job_structure(void) {
    morph_structure *s;
    const morph_status status = morph_structure_create(&world.s->def, &s);
    assert_true((status == MORPH_OK) == (s != NULL));
    morph_structure_destroy(s);
    return status;
}

static morph_status job_distance(void) {
    morph_distance *d;
    const morph_status status = morph_distance_create(&mesh, true, &d);
    assert_true((status == MORPH_OK) == (d != NULL));
    morph_distance_destroy(d);
    return status;
}

static morph_status job_sdf(void) {
    const double lo[3] = {-0.1, -0.1, -0.1}, hi[3] = {0.1, 0.1, 0.2};
    morph_sdf *d;
    const morph_status status = morph_sdf_create(world.exact, lo, hi, 0.03, NULL, &d);
    assert_true((status == MORPH_OK) == (d != NULL));
    morph_sdf_destroy(d);
    return status;
}

static morph_status job_cavity(void) {
    morph_cavity *c;
    const morph_status status = morph_cavity_create(world.s, world.exact, 0.0, &c);
    assert_true((status == MORPH_OK) == (c != NULL));
    morph_cavity_destroy(c);
    return status;
}

static morph_status job_measure(void) {
    morph_measure m;
    return morph_cavity_measure(world.cavity, flat, &m);
}

static morph_status job_active(void) {
    morph_active *a;
    const morph_status status = morph_active_create(world.s, &a);
    assert_true((status == MORPH_OK) == (a != NULL));
    morph_active_destroy(a);
    return status;
}

/* With growing rows and blocks, into an active set of its own. */
static morph_status job_examine(void) {
    const morph_inset inset = {0};
    const morph_nearness near = {1.0, 1.0, 1.0, 1.0};
    morph_active *a;
    morph_violation v;
    morph_block blocks[MORPH_POSE_BLOCKS];
    morph_status status = morph_active_create(world.s, &a);
    if (status == MORPH_OK) status = morph_pose_examine(&world.world, world.x, &inset, &near, a, NULL, &v);
    if (status == MORPH_OK && morph_active_blocks(a, &world.world, NULL, &inset, blocks) < 0)
        status = MORPH_ERR_NOMEM;
    morph_active_destroy(a);
    return status;
}

static morph_status job_curve(void) {
    double s[8], *x = morph_alloc(8, (size_t)world.n * sizeof *x);
    if (!x) return MORPH_ERR_NOMEM;
    for (int k = 0; k < 8; k++) {
        s[k] = k / 7.0;
        for (int i = 0; i < world.n; i++)
            x[k * world.n + i] = flat[i] + (i % 3 == 2 ? 0.01 * k : 0.0);
    }
    morph_curve *c;
    const morph_status status = morph_curve_create(world.s, s, x, 8, &c);
    assert_true((status == MORPH_OK) == (c != NULL));
    morph_curve_destroy(c);
    free(x);
    return status;
}

static morph_status job_timing(void) {
    const morph_timing_options o = {0.0, 0.05, NULL};
    morph_timing t = {0};
    morph_timing_report r;
    const morph_status status = morph_timing_solve(curve, &o, &t, &r);
    morph_timing_free(&t);
    return status;
}

static morph_status job_blanket(void) {
    const morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 0.02, .frame = 0.01, .base = 0.0};
    morph_trajectory t = {0};
    const morph_status status =
        morph_blanket_run(world.s, world.sdf, world.exact, &def, flat, NULL, &t, NULL);
    morph_trajectory_free(&t);
    return status;
}

static morph_status job_path(void) {
    morph_path_options o = morph_path_defaults();
    o.refine = false;
    morph_path_report r;
    morph_curve *c = NULL;
    const double *end = &guide.x[(size_t)(guide.frames - 1) * (size_t)world.n];
    const morph_status status = morph_path_plan(&world.world, &guide, guide.x, end, &o, &c, &r);
    morph_curve_destroy(c);
    return status;
}

static morph_status job_record(void) {
    morph_record r = {0};
    morph_status status = morph_record_structure(&r, world.s, &mesh, 0.0);
    if (status == MORPH_OK) status = morph_record_nominal(&r, world.s, &guide);
    if (status == MORPH_OK) status = morph_record_schedule(&r, curve, &timing, 0.05);
    if (status == MORPH_OK) status = morph_record_mobility(&r, world.s);
    morph_check_report check;
    if (status == MORPH_OK) status = morph_check_record(&r, NULL, &check);
    morph_record_free(&r);
    return status;
}

/* Fails one allocation after another, `step` apart, up to the number `most`; libraries' own statuses may
 * stand for no memory. */
static void fail_in_turn(const char *what, morph_status (*job)(void), long step, long most, bool library) {
    assert_int_equal(job(), MORPH_OK); /* libraries keep what they need once */
    int refused = 0;
    for (long at = 0; at <= most; at += step) {
        const long before = live;
        countdown = at;
        const morph_status status = job();
        const bool reached = was_refused();
        countdown = -1;
        if (live != before) fail_msg("%s: %ld blocks left after failure %ld", what, live - before, at);
        if (!reached) {
            assert_int_equal(status, MORPH_OK);
            break;
        }
        refused += status != MORPH_OK;
        if (status != MORPH_OK && status != MORPH_ERR_NOMEM &&
            !(library && (status == MORPH_ERR_BACKEND || status == MORPH_ERR_NONFINITE)))
            fail_msg("%s: %s after failure %ld", what, morph_status_text(status), at);
    }
    if (!refused) fail_msg("%s: no failure was told", what);
}

static void prepare(void) {
    const solid box = solid_box(0.05, 0.05, 0.04, 0.02);
    morph_blas_threads(1);
    fixture_make(&world, 2, 2, &box, 0.0);
    solid_mesh(&box, &mesh);
    fixture_flat(&world, 0.05);
    flat = morph_alloc((size_t)world.n, sizeof *flat);
    assert_non_null(flat);
    for (int i = 0; i < world.n; i++)
        flat[i] = world.x[i] * STEP;
    const morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 0.1, .frame = 0.01, .base = 0.0};
    assert_int_equal(morph_blanket_run(world.s, world.sdf, world.exact, &def, flat, NULL, &guide, NULL),
                     MORPH_OK);
    double s[8], x[8 * 24];
    assert_int_equal(world.n, 24);
    for (int k = 0; k < 8; k++) {
        s[k] = k / 7.0;
        for (int i = 0; i < 24; i++)
            x[24 * k + i] = flat[i] * (i % 3 == 0 ? 1.0 + 0.02 * k : 1.0) + (i % 3 == 2 ? 0.01 * k : 0.0);
    }
    assert_int_equal(morph_curve_create(world.s, s, x, 8, &curve), MORPH_OK);
    const morph_timing_options o = {0.0, 0.05, NULL};
    morph_timing_report report;
    assert_int_equal(morph_timing_solve(curve, &o, &timing, &report), MORPH_OK);
}

static void test_model(void **state) {
    (void)state;
    fail_in_turn("structure", job_structure, 1, LONG_MAX, false);
    fail_in_turn("distance", job_distance, 1, LONG_MAX, false);
    fail_in_turn("distance grid", job_sdf, 1, LONG_MAX, false);
    fail_in_turn("cavity", job_cavity, 1, LONG_MAX, false);
    fail_in_turn("measure", job_measure, 1, LONG_MAX, false);
    fail_in_turn("blanket", job_blanket, 1, LONG_MAX, false);
}

static void test_planner(void **state) {
    (void)state;
    fail_in_turn("active rows", job_active, 1, LONG_MAX, false);
    fail_in_turn("examination", job_examine, 1, LONG_MAX, false);
    fail_in_turn("curve", job_curve, 1, LONG_MAX, false);
    fail_in_turn("path", job_path, 7, LONG_MAX, false);
    /* Beyond these the solver runs, whose own allocations may end a process (see the solver's tests). */
    fail_in_turn("timing", job_timing, 1, 30, false);
    fail_in_turn("record and check", job_record, 5, LONG_MAX, true);
}
#endif

#if CAN_REFUSE
int main(void) {
    prepare();
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_model), cmocka_unit_test(test_planner)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    morph_timing_free(&timing);
    morph_curve_destroy(curve);
    morph_trajectory_free(&guide);
    morph_mesh_free(&mesh);
    free(flat);
    fixture_free(&world);
    return failed;
}
#else
int main(void) {
    puts("the sanitizer has an allocator of its own: skipped");
    return 77;
}
#endif
