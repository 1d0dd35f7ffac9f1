/* Projection: any pose to a near one within all limits; a pose within stays where it is. */
#include "test_pose_fixture.h"

#include <string.h>

static const morph_inset small_inset = {.length = 1e-3, .angle = 2e-3, .clearance = 0.0, .self = 1e-3};

/* Projects f->x; returns how far it moved, as the root of the sum of squares of all joints (spacings). */
static double project(fixture *f, const morph_inset *inset, morph_violation *v) {
    double *before = morph_alloc((size_t)f->n, sizeof *before), sum = 0.0;
    assert_non_null(before);
    memcpy(before, f->x, (size_t)f->n * sizeof *before);
    morph_effort effort = {0};
    assert_int_equal(morph_project(&f->world, inset, 8, NULL, f->active, f->x, v, &effort), MORPH_OK);
    assert_true(effort.solves >= 1 && effort.unknowns == f->n && effort.rows >= f->s->posts);
    for (int i = 0; i < f->n; i++)
        sum += (f->x[i] - before[i]) * (f->x[i] - before[i]);
    free(before);
    return sqrt(sum);
}

/* The result holds by the function's own word and by plain measure. */
static void assert_projected(fixture *f, const morph_violation *v) {
    morph_limit which = MORPH_LIMIT_POST;
    if (morph_violation_worst(v, morph_pose_tolerance, &which) > 1.0)
        fail_msg("left with %s beyond by %.3g at %s", morph_limit_name(which), v->amount[which],
                 v->element[which]);
    /* Clearance by samples differs by 1e-4. */
    assert_within(f, f->x, 1.3);
}

static void test_stays(void **state) {
    (void)state;
    fixture f;
    morph_violation v;
    const solid box = solid_box(0.12, 0.12, 0.08, 0.04);
    fixture_make(&f, 4, 4, &box, 0.0);
    const double heights[3] = {0.2, 0.09, 0.0845};
    for (int k = 0; k < 3; k++) {
        fixture_flat(&f, heights[k]);
        const double moved = project(&f, &small_inset, &v);
        assert_projected(&f, &v);
        /* A hundredth of a link's radius, a joint. */
        if (moved > 4e-4 * sqrt(f.s->joints))
            fail_msg("a pose within its limits moved by %.3g spacings", moved);
    }
    fixture_free(&f);
}

/* From a feasible pose disturbed: the way back is one way, so a projection is no longer than that. */
static void test_disturbed(void **state) {
    (void)state;
    uint64_t seed = 7;
    fixture f;
    const solid box = solid_box(0.12, 0.12, 0.08, 0.04);
    fixture_make(&f, 3, 3, &box, 0.0);
    for (int k = 0; k < 6; k++) {
        morph_violation v;
        fixture_flat(&f, 0.087);
        double sum = 0.0;
        for (int i = 0; i < f.n; i++) {
            const double d = (0.05 + 0.05 * k) * noise(&seed);
            f.x[i] += d;
            sum += d * d;
        }
        const double moved = project(&f, &small_inset, &v);
        assert_projected(&f, &v);
        if (moved > 1.02 * sqrt(sum) + 1e-3)
            fail_msg("disturbance %.2f: moved by %.4g, a pose at %.4g holds everything", 0.05 + 0.05 * k,
                     moved, sqrt(sum));
    }
    fixture_free(&f);
}

/* Each limit alone. */
static void test_single(void **state) {
    (void)state;
    fixture f;
    morph_violation v;
    const solid box = solid_box(0.12, 0.12, 0.08, 0.04);
    fixture_make(&f, 4, 4, &box, 0.0);
    const struct {
        const char *what;
        int joint;
        double d[3], most;
    } plants[] = {{"post", 16 + 5, {0.0, 0.0, 0.1}, 0.12},    {"length", 0, {-0.5, 0.0, 0.0}, 0.52},
                  {"angle", 16 + 15, {0.45, 0.0, 0.0}, 0.47}, {"base", 12, {0.0, 0.0, -1.2}, 1.21},
                  {"clearance", 5, {0.0, 0.0, -0.3}, 0.35},   {"self", 5, {0.0, -0.5, 0.45}, 0.75}};
    for (size_t k = 0; k < sizeof plants / sizeof *plants; k++) {
        fixture_flat(&f, 0.087);
        for (int c = 0; c < 3; c++)
            f.x[3 * plants[k].joint + c] += plants[k].d[c];
        const double moved = project(&f, &small_inset, &v);
        assert_projected(&f, &v);
        if (moved > plants[k].most) fail_msg("%s: moved by %.4g", plants[k].what, moved);
    }
    fixture_free(&f);
}

/* An inset is kept too: the result is inside by it. */
static void test_inset(void **state) {
    (void)state;
    const morph_inset wide = {.length = 0.02, .angle = 0.03, .clearance = 0.06, .self = 0.02};
    fixture f;
    brute b;
    morph_violation v;
    uint64_t seed = 11;
    const solid box = solid_box(0.12, 0.12, 0.08, 0.04);
    fixture_make(&f, 4, 4, &box, 0.0);
    fixture_flat(&f, 0.085);
    for (int i = 0; i < f.n; i++)
        f.x[i] += 0.2 * noise(&seed);
    project(&f, &wide, &v);
    assert_projected(&f, &v);
    brute_examine(&f, f.x, &b);
    /* Rows missed by the last solve may take a little of the inset, never half. */
    assert_true(b.amount[MORPH_LIMIT_LENGTH] < -0.01 && b.amount[MORPH_LIMIT_ANGLE] < -0.015);
    assert_true(b.amount[MORPH_LIMIT_CLEARANCE] < -0.03 && b.amount[MORPH_LIMIT_SELF] < -0.01);
    fixture_free(&f);
}

/* A box standing on a corner under the middle of a skin triangle: pierced by `deep` spacings. */
static void test_corner(void **state) {
    (void)state;
    const double pi = acos(-1.0);
    for (int k = 0; k < 3; k++) {
        const double deep = 0.03 + 0.06 * k, half = 0.04;
        solid b = {.half = {half, half, half}};
        /* Rows: three axes at right angles, all equally steep. */
        for (int i = 0; i < 3; i++) {
            const double turn = 2.0 * pi * i / 3.0 + 0.3;
            b.turn[i][0] = sqrt(2.0 / 3.0) * cos(turn);
            b.turn[i][1] = sqrt(2.0 / 3.0) * sin(turn);
            b.turn[i][2] = sqrt(1.0 / 3.0);
        }
        /* The middle of the first triangle of a 3 x 3 grid's cell (0,0): joints at -0.1, -0.1 to 0, 0. */
        b.centre[0] = -0.035;
        b.centre[1] = -0.066;
        b.centre[2] = 0.1;
        fixture f;
        morph_violation v;
        brute before;
        fixture_make(&f, 3, 3, &b, NAN);
        fixture_flat(&f, 0.1 + half * sqrt(3.0) - deep * STEP);
        brute_examine(&f, f.x, &before);
        assert_true(before.amount[MORPH_LIMIT_CLEARANCE] > 0.04 + 0.3 * deep);
        const double moved = project(&f, &small_inset, &v);
        assert_projected(&f, &v);
        /* Lifting the whole grid is one way out. */
        const double lift = (deep + 0.04) * sqrt(f.s->joints);
        if (moved > lift) fail_msg("corner %.2f deep: moved by %.4g, lifting takes %.4g", deep, moved, lift);
        fixture_free(&f);
    }
}

/* A roof's edge across the links along x, between the nodes: no joint and no corner of it is near. */
static void test_edge(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        const double deep = 0.03 + 0.06 * k, half = 0.05, c = sqrt(0.5);
        const solid b = {.centre = {0.053, 0.0, 0.1},
                         .half = {half, 0.4, half},
                         .turn = {{c, 0.0, c}, {0.0, 1.0, 0.0}, {-c, 0.0, c}}};
        fixture f;
        morph_violation v;
        fixture_make(&f, 3, 3, &b, NAN);
        fixture_flat(&f, 0.1 + half * sqrt(2.0) - deep * STEP);
        brute before;
        brute_examine(&f, f.x, &before);
        assert_true(before.amount[MORPH_LIMIT_CLEARANCE] > 0.04 + 0.3 * deep);
        const double moved = project(&f, &small_inset, &v);
        assert_projected(&f, &v);
        const double lift = (deep + 0.04) * sqrt(f.s->joints);
        if (moved > lift) fail_msg("edge %.2f deep: moved by %.4g, lifting takes %.4g", deep, moved, lift);
        fixture_free(&f);
    }
}

static int at_once(void *user) {
    ++*(int *)user;
    return 1;
}

static void test_stop(void **state) {
    (void)state;
    fixture f;
    morph_violation v;
    morph_effort effort = {0};
    int asked = 0;
    uint64_t seed = 13;
    const morph_control control = {.stop = at_once, .user = &asked};
    const solid box = solid_box(0.12, 0.12, 0.08, 0.04);
    fixture_make(&f, 4, 4, &box, 0.0);
    fixture_flat(&f, 0.05);
    for (int i = 0; i < f.n; i++)
        f.x[i] += 0.3 * noise(&seed);
    const morph_status status =
        morph_project(&f.world, &small_inset, 8, &control, f.active, f.x, &v, &effort);
    assert_true(status == MORPH_OK || status == MORPH_ERR_STOPPED);
    assert_true(asked > 0 && effort.solves <= 1);
    for (int i = 0; i < f.n; i++)
        assert_true(isfinite(f.x[i]));
    f.x[0] = INFINITY;
    assert_int_equal(morph_project(&f.world, &small_inset, 8, NULL, f.active, f.x, &v, &effort),
                     MORPH_ERR_NONFINITE);
    fixture_free(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stays), cmocka_unit_test(test_disturbed), cmocka_unit_test(test_single),
        cmocka_unit_test(test_inset), cmocka_unit_test(test_corner),    cmocka_unit_test(test_edge),
        cmocka_unit_test(test_stop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
