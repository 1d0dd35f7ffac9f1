/* The path: every limit also between its poses, on a grid finer than its own; ends as given; stop and time.
 */
#include "test_pose_fixture.h"

#include "planner/path.h"
#include "planner/refine.h"

#include <string.h>

typedef struct journey {
    fixture f;
    double *start, *end; /* metres */
    morph_trajectory guide;
} journey;

static void prepare(journey *j, const solid *body, double height, int rounds) {
    morph_structure_def def = morph_structure_defaults(STEP);
    def.nodes[0] = def.nodes[1] = 3;
    def.stiffness = 20.0;
    fixture_make_def(&j->f, &def, body, 0.0);
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
    o.rounds = rounds;
    morph_refine_report r;
    assert_int_equal(morph_refine(&j->f.world, &o, j->end, &r), MORPH_OK);
    morph_refine_report_free(&r);
    assert_true(r.feasible);
}

static void finish(journey *j) {
    morph_trajectory_free(&j->guide);
    free(j->start);
    free(j->end);
    fixture_free(&j->f);
}

static void joints_at(const journey *j, const morph_curve *c, double s, double *x) {
    double *scratch = morph_alloc((size_t)(6 * j->f.s->posts), sizeof *scratch);
    assert_non_null(scratch);
    morph_curve_joints(c, s, 0, scratch, x);
    free(scratch);
}

/* The plain measure `steps` times an interval; worst by limit. Clearance by samples is slow: every third. */
static void sweep(journey *j, const morph_curve *c, int steps, brute *worst) {
    fixture *f = &j->f;
    for (int k = 0; k < MORPH_LIMITS; k++)
        worst->amount[k] = -INFINITY;
    for (int k = 0; k + 1 < c->poses; k++)
        for (int i = 0; i < steps; i++) {
            brute b;
            joints_at(j, c, c->s[k] + (c->s[k + 1] - c->s[k]) * (i + 0.37) / steps, f->x);
            for (int n = 0; n < f->n; n++)
                f->x[n] /= f->s->spacing;
            brute_examine(f, f->x, &b);
            for (int m = 0; m < MORPH_LIMITS; m++)
                if (b.amount[m] > worst->amount[m]) {
                    worst->amount[m] = b.amount[m];
                    memcpy(worst->element[m], b.element[m], sizeof b.element[m]);
                }
        }
}

static void assert_ends(const journey *j, const morph_curve *c) {
    double *x = morph_alloc((size_t)j->f.n, sizeof *x);
    assert_non_null(x);
    for (int end = 0; end < 2; end++) {
        joints_at(j, c, end, x);
        const double *given = end ? j->end : j->start;
        for (int i = 0; i < j->f.n; i++)
            /* Posts of the end are rigid to 5e-7; the curve makes them so exactly. */
            assert_near(x[i], given[i], end ? 1e-6 * STEP : 1e-12);
    }
    assert_near(c->s[0], 0.0, 0.0);
    assert_near(c->s[c->poses - 1], 1.0, 0.0);
    for (int k = 0; k + 1 < c->poses; k++)
        assert_true(c->s[k] < c->s[k + 1]);
    free(x);
}

static void holds_between(const solid *body, double height, double slack) {
    journey j;
    prepare(&j, body, height, 3);
    const morph_path_options o = morph_path_defaults();
    morph_path_report r;
    morph_curve *c = NULL;
    assert_int_equal(morph_path_plan(&j.f.world, &j.guide, j.start, j.end, &o, &c, &r), MORPH_OK);
    assert_non_null(c);
    assert_int_equal(c->poses, r.poses);
    assert_ends(&j, c);
    if (!r.feasible) {
        morph_limit which = MORPH_LIMIT_POST;
        morph_violation_worst(&r.violation, morph_pose_tolerance, &which);
        fail_msg("%s beyond by %.3g at %.3f (%s)", morph_limit_name(which), r.violation.amount[which],
                 r.where[which], r.violation.element[which]);
    }
    brute worst;
    sweep(&j, c, 17, &worst);
    for (int k = 0; k < MORPH_LIMITS; k++) {
        /* Between two points of the path's own grid a limit may be met by a hair: 1e-6. */
        const double allowed = k == MORPH_LIMIT_CLEARANCE ? slack : 1e-6;
        if (worst.amount[k] > allowed)
            fail_msg("%s beyond by %.3g at %s", morph_limit_name((morph_limit)k), worst.amount[k],
                     worst.element[k]);
    }
    morph_curve_destroy(c);
    finish(&j);
}

static void test_over_box(void **state) {
    (void)state;
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    holds_between(&box, 0.12, 7e-4);
}

static void test_over_ball(void **state) {
    (void)state;
    const solid ball = {.ball = true, .centre = {0.0, 0.0, 0.05}, .radius = 0.06};
    /* The mesh lies inside the ball by up to 0.0037 spacings. */
    holds_between(&ball, 0.16, 4.5e-3);
}

/* A guide that runs through the target: what comes out says so or holds. */
static void test_reports_truly(void **state) {
    (void)state;
    journey j;
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    prepare(&j, &box, 0.12, 0);
    const size_t n = (size_t)j.f.n;
    for (int f = 1; f + 1 < j.guide.frames; f++) {
        const double bump = sin(acos(-1.0) * f / (j.guide.frames - 1));
        for (size_t i = 0; i < n; i++)
            j.guide.x[(size_t)f * n + i] -= i % 3 == 2 ? 0.03 * bump : 0.0;
    }
    for (int refine = 0; refine < 2; refine++) {
        morph_path_options o = morph_path_defaults();
        o.refine = refine == 1;
        o.poses = 20;
        morph_path_report r;
        morph_curve *c = NULL;
        assert_int_equal(morph_path_plan(&j.f.world, &j.guide, j.start, j.end, &o, &c, &r), MORPH_OK);
        assert_non_null(c);
        assert_ends(&j, c);
        brute worst;
        sweep(&j, c, 5, &worst);
        bool within = true;
        for (int k = 0; k < MORPH_LIMITS; k++) {
            within &= worst.amount[k] <= (k == MORPH_LIMIT_CLEARANCE ? 7e-4 : 1e-6);
            /* The report's worst is no smaller than what other points show, but for the curve between points.
             */
            if (r.violation.amount[k] < worst.amount[k] - 0.03 && worst.amount[k] > 0.0)
                fail_msg("%s: %.3g reported, %.3g found", morph_limit_name((morph_limit)k),
                         r.violation.amount[k], worst.amount[k]);
        }
        assert_true(!r.feasible || within);
        if (!refine) assert_false(r.feasible);
        if (!refine) assert_int_equal(r.effort.solves, 0);
        assert_true(c->poses <= 20);
        morph_curve_destroy(c);
    }
    finish(&j);
}

typedef struct counter {
    int asked, most;
} counter;

static int after_most(void *user) {
    counter *c = user;
    return ++c->asked > c->most;
}

static void test_stop_and_seconds(void **state) {
    (void)state;
    journey j;
    const solid box = solid_box(0.1, 0.1, 0.06, 0.03);
    prepare(&j, &box, 0.12, 1);
    const int moments[3] = {0, 3, 40};
    for (int k = 0; k < 3; k++) {
        counter count = {.most = moments[k]};
        const morph_control control = {.stop = after_most, .user = &count};
        morph_path_options o = morph_path_defaults();
        o.control = &control;
        morph_path_report r;
        morph_curve *c = NULL;
        assert_int_equal(morph_path_plan(&j.f.world, &j.guide, j.start, j.end, &o, &c, &r),
                         MORPH_ERR_STOPPED);
        assert_true(count.asked > count.most && count.asked < count.most + 60);
        morph_curve_destroy(c);
    }
    /* Out of time at once: poses are solved, none is inserted. */
    morph_path_options o = morph_path_defaults();
    o.seconds = 1e-6;
    morph_path_report r;
    morph_curve *c = NULL;
    assert_int_equal(morph_path_plan(&j.f.world, &j.guide, j.start, j.end, &o, &c, &r), MORPH_OK);
    assert_non_null(c);
    assert_int_equal(r.inserted, 0);
    assert_ends(&j, c);
    morph_curve_destroy(c);
    finish(&j);
}

int main(void) {
    morph_blas_threads(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_over_box),
        cmocka_unit_test(test_over_ball),
        cmocka_unit_test(test_reports_truly),
        cmocka_unit_test(test_stop_and_seconds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
