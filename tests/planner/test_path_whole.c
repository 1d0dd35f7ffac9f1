/* All poses of a path moved together: derivatives of its terms, a schedule that gets shorter while every
 * limit holds recomputed from raw positions, and the path that there was where it may not, or cannot, be
 * moved. */
#include "test_pose_fixture.h"

#include "planner/path_parts.h"
#include "planner/path_whole.h"
#include "planner/refine.h"
#include "planner/timing.h"
#include "tests/support/planted_sign.h"

#include <string.h>

/* ------------------------------------------------------------------ terms */

static morph_structure *structure_of(int nodes) {
    morph_structure_def def = morph_structure_defaults(STEP);
    morph_structure *s = NULL;
    def.nodes[0] = nodes;
    def.nodes[1] = 2;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static double *poses_of(const morph_structure *s, int poses, uint64_t seed) {
    const int width = 3 * s->joints;
    double *x = morph_alloc((size_t)(poses * width), sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < poses * width; i++)
        x[i] = s->start[i % width] / s->spacing + 0.2 * noise(&seed);
    return x;
}

static void assert_derivatives(const morph_block *block, const double *x) {
    morph_derivative_check check;
    assert_int_equal(morph_check_derivatives(block, 1, x, block->unknowns, 1e-5, 1e-6, &check), MORPH_OK);
    if (!check.passed) fail_msg("%s", check.message);
    assert_int_equal(planted_signs_seen(block, x, block->unknowns), 2);
}

static const double uneven[MORPH_SWAY] = {3.0, -7.5, 4.5};

static void test_term_derivatives(void **state) {
    (void)state;
    morph_structure *s = structure_of(3);
    for (int poses = 1; poses <= MORPH_SWAY; poses++) {
        double *x = poses_of(s, poses, 11);
        morph_sway_term sway = {.structure = s, .poses = poses, .limit = s->rate_limit, .scale = 0.7};
        morph_bend_term bend = {.coordinates = 3 * s->joints, .poses = poses, .scale = 0.3};
        memcpy(sway.coefficient, uneven, sizeof uneven);
        memcpy(bend.coefficient, uneven, sizeof uneven);
        const morph_block blocks[2] = {morph_block_sway(&sway, NULL), morph_block_bend(&bend, NULL)};
        for (int b = 0; b < 2; b++)
            assert_derivatives(&blocks[b], x);
        free(x);
    }
    morph_structure_destroy(s);
}

/* The terms' values against sums written out. */
static void test_term_values(void **state) {
    (void)state;
    morph_structure *s = structure_of(2);
    const int width = 3 * s->joints;
    double *x = poses_of(s, 2, 5), f, sum = 0.0;
    morph_sway_term sway = {
        .structure = s, .poses = 2, .coefficient = {-4.0, 4.0}, .limit = s->rate_limit, .scale = 2.0};
    morph_block block = morph_block_sway(&sway, NULL);
    assert_int_equal(block.value(block.data, x, &f), MORPH_OK);
    for (int l = 0; l < s->links; l++) {
        const int i = 3 * s->link[l][0], j = 3 * s->link[l][1];
        const double change = STEP * (morph_dist(&x[width + j], &x[width + i]) - morph_dist(&x[j], &x[i]));
        sum += 2.0 * pow(4.0 * change / s->def.rate, 2.0);
    }
    assert_near(f, sum, 1e-12 * sum);
    morph_bend_term bend = {.coordinates = width, .poses = 2, .coefficient = {-4.0, 4.0}, .scale = 2.0};
    block = morph_block_bend(&bend, NULL);
    assert_int_equal(block.value(block.data, x, &f), MORPH_OK);
    sum = 0.0;
    for (int i = 0; i < width; i++)
        sum += 2.0 * pow(4.0 * (x[width + i] - x[i]), 2.0);
    assert_near(f, sum, 1e-12 * sum);
    free(x);
    morph_structure_destroy(s);
}

/* A term whose value leaves out a link fails the check that the true one passes. */
static morph_status short_value(void *data, const double *x, double *f) {
    morph_sway_term *d = data;
    morph_structure less = *d->structure;
    less.links--;
    const morph_structure *all = d->structure;
    d->structure = &less;
    const morph_block block = morph_block_sway(d, NULL);
    const morph_status status = block.value(d, x, f);
    d->structure = all;
    return status;
}

static void test_wrong_term_is_seen(void **state) {
    (void)state;
    morph_structure *s = structure_of(2);
    double *x = poses_of(s, 2, 3);
    morph_sway_term sway = {
        .structure = s, .poses = 2, .coefficient = {-4.0, 4.0}, .limit = s->rate_limit, .scale = 1.0};
    morph_block block = morph_block_sway(&sway, NULL);
    block.value = short_value;
    morph_derivative_check check;
    assert_int_equal(morph_check_derivatives(&block, 1, x, block.unknowns, 1e-5, 1e-5, &check), MORPH_OK);
    assert_false(check.passed);
    free(x);
    morph_structure_destroy(s);
}

/* ------------------------------------------------------------------ paths */

typedef struct journey {
    fixture f;
    double *start, *end; /* metres */
    morph_trajectory guide;
} journey;

static void prepare(journey *j, const morph_structure_def *def, const solid *body, double height) {
    fixture_make_def(&j->f, def, body, 0.0);
    const size_t n = (size_t)j->f.n;
    j->start = morph_alloc(n, sizeof(double));
    j->end = morph_alloc(n, sizeof(double));
    assert_true(j->start && j->end);
    for (size_t i = 0; i < n; i++)
        j->start[i] = j->f.s->start[i] + (i % 3 == 2 ? height : 0.0);
    const morph_blanket_def fall = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 1.0, .frame = 0.01, .base = 0.0};
    j->guide = (morph_trajectory){0};
    assert_int_equal(morph_blanket_run(j->f.s, j->f.sdf, j->f.exact, &fall, j->start, NULL, &j->guide, NULL),
                     MORPH_OK);
    memcpy(j->end, &j->guide.x[(size_t)(j->guide.frames - 1) * n], n * sizeof(double));
    morph_refine_options o = morph_refine_defaults();
    o.rounds = 2;
    morph_refine_report r;
    assert_int_equal(morph_refine(&j->f.world, &o, j->end, &r), MORPH_OK);
    morph_refine_report_free(&r);
    assert_true(r.feasible);
}

static morph_structure_def sheet(int nodes) {
    morph_structure_def def = morph_structure_defaults(STEP);
    def.nodes[0] = def.nodes[1] = nodes;
    def.stiffness = 20.0;
    return def;
}

static void finish(journey *j) {
    morph_trajectory_free(&j->guide);
    free(j->start);
    free(j->end);
    fixture_free(&j->f);
}

static morph_status plan(journey *j, const morph_path_options *o, morph_curve **c, morph_path_report *r) {
    return morph_path_plan(&j->f.world, &j->guide, j->start, j->end, o, c, r);
}

static double duration_of(const morph_curve *c) {
    const morph_timing_options o = {0.0, 1e-3, NULL};
    morph_timing t;
    morph_timing_report r;
    assert_int_equal(morph_timing_solve(c, &o, &t, &r), MORPH_OK);
    morph_timing_free(&t);
    return r.needed;
}

/* Every limit by the plain measure, at points that the path does not examine itself. */
static void assert_holds(journey *j, const morph_curve *c, double clearance) {
    fixture *f = &j->f;
    double *scratch = morph_alloc((size_t)morph_pose_width(f->s), sizeof *scratch);
    assert_non_null(scratch);
    for (int k = 0; k <= 90; k++) {
        brute b;
        morph_curve_joints(c, (k < 90 ? k + 0.37 : 90.0) / 90.0, 0, scratch, f->x);
        for (int n = 0; n < f->n; n++)
            f->x[n] /= f->s->spacing;
        brute_examine(f, f->x, &b);
        for (int m = 0; m < MORPH_LIMITS; m++)
            /* Between two points of the path's own grid a limit may be met by a hair: 1e-6. */
            if (b.amount[m] > (m == MORPH_LIMIT_CLEARANCE ? clearance : 1e-6))
                fail_msg("%s beyond by %.3g at point %d (%s)", morph_limit_name((morph_limit)m), b.amount[m],
                         k, b.element[m]);
    }
    free(scratch);
}

/* Joints at an end of a curve, or in between, metres; free(). */
static double *joints_at(const journey *j, const morph_curve *c, double s) {
    double *x = morph_alloc((size_t)j->f.n, sizeof *x),
           *scratch = morph_alloc((size_t)morph_pose_width(j->f.s), sizeof *scratch);
    assert_true(x && scratch);
    morph_curve_joints(c, s, 0, scratch, x);
    free(scratch);
    return x;
}

static void assert_ends(const journey *j, const morph_curve *c) {
    for (int end = 0; end < 2; end++) {
        double *x = joints_at(j, c, end);
        for (int i = 0; i < j->f.n; i++) /* posts of the end are rigid to 5e-7 */
            assert_near(x[i], (end ? j->end : j->start)[i], end ? 1e-6 * STEP : 1e-12);
        free(x);
    }
}

/* With and without the step: shorter by a third at least, and the report says what the timing finds. */
static void gets_shorter(const morph_structure_def *def, const solid *body, double height, double clearance) {
    journey j;
    prepare(&j, def, body, height);
    double duration[2];
    for (int whole = 0; whole < 2; whole++) {
        morph_path_options o = morph_path_defaults();
        morph_path_report r;
        morph_curve *c = NULL;
        o.whole = whole;
        o.unfold = true;
        assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
        assert_true(r.feasible);
        assert_int_equal(r.poses, c->poses);
        assert_int_equal(r.moved, whole);
        assert_ends(&j, c);
        if (whole) assert_holds(&j, c, clearance);
        duration[whole] = duration_of(c);
        /* The step compares at a coarser sample: durations are whole samples where that is what decides. */
        if (whole) assert_near(r.before, duration[0], 0.01 * duration[0]);
        if (whole) assert_near(r.after, duration[1], 0.01 * duration[1]);
        morph_curve_destroy(c);
    }
    if (duration[1] > 0.67 * duration[0])
        fail_msg("%.3f s, moved as a whole %.3f s", duration[0], duration[1]);
    finish(&j);
}

static void test_shorter_over_box(void **state) {
    (void)state;
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    const morph_structure_def def = sheet(3);
    gets_shorter(&def, &box, 0.12, 7e-4);
}

/* A ball rises through a sheet of which two corners are held, along a straight guide. */
static void prepare_rise(journey *j, double lift[2], double time[2]) {
    static const int node[2][2] = {{0, 0}, {2, 2}};
    const morph_inset inset = morph_path_defaults().end;
    const solid ball = {.ball = true, .centre = {0.0, 0.0, 0.07}, .radius = 0.06};
    morph_structure_def def = sheet(3);
    morph_effort effort = {0};
    morph_violation v;
    def.fixed = MORPH_FIXED_LIST;
    def.fixed_nodes = 2;
    def.fixed_node = node;
    fixture_make_def(&j->f, &def, &ball, NAN);
    fixture *f = &j->f;
    const size_t n = (size_t)f->n;
    j->guide = (morph_trajectory){.joints = f->s->joints, .frames = 2, .time = time, .lift = lift};
    j->start = morph_alloc(n, sizeof(double));
    j->end = morph_alloc(n, sizeof(double));
    j->guide.x = morph_alloc(2 * n, sizeof(double));
    assert_true(j->start && j->end && j->guide.x);
    fixture_flat(f, 0.12);
    for (size_t i = 0; i < n; i++)
        j->start[i] = j->guide.x[i] = STEP * f->x[i];
    assert_int_equal(morph_project(&f->world, &inset, 8, NULL, f->active, f->x, &v, &effort), MORPH_OK);
    assert_true(morph_violation_worst(&v, morph_pose_tolerance, NULL) <= 1.0);
    for (size_t i = 0; i < n; i++)
        j->end[i] = j->guide.x[n + i] = STEP * f->x[i];
}

/* Nodes that are held stay where they are at every parameter, and the sheet is clear of the target where that
 * then stands. */
static void test_held_and_rising(void **state) {
    (void)state;
    journey j;
    double lift[2] = {-0.06, 0.0}, time[2] = {0.0, 1.0}, duration[2];
    prepare_rise(&j, lift, time);
    const morph_structure *s = j.f.s;
    for (int whole = 0; whole < 2; whole++) {
        morph_path_options o = morph_path_defaults();
        morph_path_report r;
        morph_curve *c = NULL;
        o.whole = whole;
        o.unfold = true;
        assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
        assert_true(r.feasible);
        assert_int_equal(r.moved, whole);
        assert_near(morph_curve_lift(c, 0.0), -0.06, 0.0);
        assert_near(morph_curve_lift(c, 1.0), 0.0, 1e-15);
        for (int k = 0; k <= 60; k++) {
            double *x = joints_at(&j, c, k / 60.0);
            for (int i = 0; i < j.f.n; i++)
                if (s->joint_fixed[i / 3]) assert_near(x[i], j.start[i], 1e-15);
            for (int i = 2; i < j.f.n; i += 3)
                x[i] -= morph_curve_lift(c, k / 60.0);
            for (int t = 0; t < s->skin_triangles; t++) {
                const int *at = s->skin[t];
                const double d = element_distance(&j.f.solid, &x[3 * at[0]], &x[3 * at[1]], &x[3 * at[2]]);
                /* The mesh lies inside the ball by up to 0.0037 spacings. */
                if (d < s->def.radius - 4.5e-3 * STEP) fail_msg("%.3g m from the ball at point %d", d, k);
            }
            free(x);
        }
        duration[whole] = duration_of(c);
        morph_curve_destroy(c);
    }
    assert_true(duration[1] < duration[0]);
    free(j.start);
    free(j.end);
    free(j.guide.x);
    fixture_free(&j.f);
}

static bool same_curve(const morph_curve *a, const morph_curve *b) {
    const size_t width = (size_t)morph_pose_width(a->structure), poses = (size_t)a->poses;
    return a->poses == b->poses && memcmp(a->s, b->s, poses * sizeof *a->s) == 0 &&
           memcmp(a->pose, b->pose, poses * width * sizeof *a->pose) == 0;
}

/* Asks for a stop from a moment of the step on: its beginning, or the end of its first solve. How often a
 * solver asks depends on the clock: nothing is counted. */
typedef struct stopper {
    enum { NEVER, BEGINNING, FIRST_SOLVE } when;
    bool on;
} stopper;

static int is_on(void *user) {
    return ((const stopper *)user)->on;
}

static void see_progress(void *user, const char *stage, double fraction) {
    stopper *s = user;
    /* The poses by themselves end at 0.7. */
    if (s->when == BEGINNING && strcmp(stage, "path") == 0 && fraction > 0.75) s->on = true;
}

static void see_line(void *user, const char *line) {
    stopper *s = user;
    if (s->when == FIRST_SOLVE && strstr(line, "path: whole: 9 poses")) s->on = true;
}

/* A stop within the step leaves the path that there was, to the bit; the same run twice gives the same path.
 */
static void test_stop_leaves_the_path(void **state) {
    (void)state;
    journey j;
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    const morph_structure_def def = sheet(3);
    prepare(&j, &def, &box, 0.12);
    morph_curve *old = NULL, *moved = NULL;
    for (int k = 0; k < 5; k++) {
        stopper s = {.when = k == 1 ? BEGINNING : k == 2 ? FIRST_SOLVE : NEVER};
        const morph_control control = {is_on, see_progress, see_line, &s};
        morph_path_options o = morph_path_defaults();
        morph_path_report r;
        morph_curve *c = NULL;
        o.control = &control;
        o.whole = k > 0;
        assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
        assert_true(r.feasible);
        assert_int_equal(r.poses, c->poses);
        assert_int_equal(s.on, s.when != NEVER);
        assert_int_equal(r.moved, k > 2);
        if (k == 0)
            old = c;
        else if (k == 3)
            moved = c;
        else
            assert_true(same_curve(k == 4 ? moved : old, c));
        if (c != old && c != moved) morph_curve_destroy(c);
    }
    assert_false(same_curve(old, moved));
    morph_curve_destroy(old);
    morph_curve_destroy(moved);
    finish(&j);
}

/* A path that breaks a limit, and one that nothing was solved for, are not looked at; nor is any without
 * time.
 */
static void test_left_alone(void **state) {
    (void)state;
    journey j;
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    const morph_structure_def def = sheet(3);
    prepare(&j, &def, &box, 0.12);
    morph_path_options o = morph_path_defaults();
    morph_path_report r;
    morph_curve *c = NULL;
    o.seconds = 1e-6;
    o.unfold = true;
    assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
    assert_false(r.moved);
    assert_near(r.before, 0.0, 0.0);
    morph_curve_destroy(c);
    o = morph_path_defaults();
    o.refine = false;
    assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
    assert_false(r.moved);
    assert_int_equal(r.effort.solves, 0);
    morph_curve_destroy(c);
    /* The end stands in the target by a tenth of a spacing: no path to it holds. */
    for (int i = 2; i < j.f.n; i += 3)
        j.end[i] -= 0.1 * STEP;
    o = morph_path_defaults();
    assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
    assert_false(r.feasible);
    assert_false(r.moved);
    assert_near(r.before, 0.0, 0.0);
    morph_curve_destroy(c);
    finish(&j);
}

static void count_solve(void *user, const char *line) {
    int *solves = user;
    if (strstr(line, "path: whole: 9 poses")) ++*solves;
}

/* A path whose curve breaks a limit between its poses, with no pose to be put in, is left as it is unless it
 * may be moved nearly holding: then it holds. Where poses keep little distance from limits the curve breaks
 * one after the first solve too, and a second one gives it room there. */
static void test_nearly_holds(void **state) {
    (void)state;
    static const double share[] = {0.5, 0.16}; /* of the usual distance */
    journey j;
    const solid box = solid_box(0.1, 0.1, 0.2, 0.1);
    const morph_structure_def def = sheet(4);
    prepare(&j, &def, &box, 0.26);
    for (int k = 0; k < 4; k++) {
        morph_path_options o = morph_path_defaults();
        morph_path_report r;
        morph_curve *c = NULL;
        int solves = 0;
        const morph_control control = {.log = count_solve, .user = &solves};
        const double part = share[k / 2];
        o.unfold = true;
        o.intervals = 8;
        o.poses = o.intervals + 1;
        o.interior.length = o.end.length + part * (o.interior.length - o.end.length);
        o.interior.angle = o.end.angle + part * (o.interior.angle - o.end.angle);
        o.interior.clearance = o.end.clearance + part * (o.interior.clearance - o.end.clearance);
        o.nearly = k % 2;
        o.control = &control;
        assert_int_equal(plan(&j, &o, &c, &r), MORPH_OK);
        assert_int_equal(r.feasible, o.nearly);
        assert_int_equal(r.moved, o.nearly);
        assert_int_equal(solves, o.nearly ? 1 + k / 2 : 0);
        assert_near(r.before, 0.0, 0.0);
        assert_true(o.nearly == (r.after > 0.0));
        assert_ends(&j, c);
        if (o.nearly) assert_holds(&j, c, 7e-4);
        morph_curve_destroy(c);
    }
    finish(&j);
}

int main(void) {
    morph_blas_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_term_derivatives),   cmocka_unit_test(test_term_values),
        cmocka_unit_test(test_wrong_term_is_seen), cmocka_unit_test(test_shorter_over_box),
        cmocka_unit_test(test_held_and_rising),    cmocka_unit_test(test_stop_leaves_the_path),
        cmocka_unit_test(test_left_alone),         cmocka_unit_test(test_nearly_holds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
