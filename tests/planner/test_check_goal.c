/* The goal's margin from a record alone: against hand figures, against model/cavity's measures, kept by
 * plan.h5, and seen when anything is tampered with. */
#include "model/cavity.h"
#include "planner/folder.h"
#include "tests/planner/test_check_fixture.h"

#include <unistd.h>

static morph_check_report with_goal(morph_record *r, double mean, double max, double coverage) {
    r->goal = (morph_goal){{mean, max, coverage}};
    return fixture_check(r);
}

/* A flat sheet at rest, `height` above the wide box under z = 0 (its top) all the time. */
static void flat_record(morph_record *r, double height) {
    fixture_record(r, 3, 11, 4);
    const size_t width = 3 * (size_t)r->joints;
    for (size_t i = 2; i < width; i += 3)
        r->schedule_joints[i] += height - 0.05;
    for (size_t k = 1; k < (size_t)r->samples; k++)
        memcpy(&r->schedule_joints[k * width], r->schedule_joints, width * sizeof(double));
    for (int k = 0; k < r->samples * r->links; k++) {
        r->length[k] = r->length[k % r->links];
        r->rate[k] = r->acceleration[k] = 0;
    }
}

static void hand_figures(void **state) {
    (void)state;
    morph_record r;
    flat_record(&r, 0.05);
    const double gap = 0.05 - r.link_radius[0];
    morph_check_report c = fixture_check(&r);
    assert_false(c.margin[MORPH_MARGIN_GOAL].tested);
    assert_true(c.feasible);
    c = with_goal(&r, gap + 0.002, 0, 0);
    assert_true(c.feasible);
    const morph_margin *m = &c.margin[MORPH_MARGIN_GOAL];
    assert_true(m->tested && fabs(m->worst - 0.002) < 1e-12 && m->time == r.time[r.samples - 1]);
    assert_string_equal(morph_margin_unit_of(m, MORPH_MARGIN_GOAL), "m");
    assert_non_null(strstr(m->element, "mean_gap 0.046 m, wanted 0.048 m"));
    /* The largest gap equals the mean here; missed by 1 mm, and it is the worst of the two. */
    c = with_goal(&r, gap + 0.002, gap - 0.001, 0);
    assert_false(c.feasible);
    assert_true(c.worst == MORPH_MARGIN_GOAL && fabs(m->worst + 0.001) < 1e-12);
    assert_true(strncmp(m->element, "max_gap 0.046 m at skin triangle ", 33) == 0);
    /* Rounding is no miss, a millionth is. */
    assert_true(with_goal(&r, gap * (1 - 1e-12), 0, 0).feasible);
    assert_false(with_goal(&r, gap * (1 - 1e-6), 0, 0).feasible);
    /* The box is 2 m wide, the sheet 0.2 m: a point counts within 0.025 + r of the skin, this high none. */
    c = with_goal(&r, 0, 0, 1e-6);
    assert_false(c.feasible);
    assert_string_equal(morph_margin_unit_of(m, MORPH_MARGIN_GOAL), "share");
    assert_true(strncmp(m->element, "coverage 0, wanted 1e-06", 24) == 0);
    morph_record_free(&r);
    /* 0.01 m above: all points under the sheet, and beyond its border as far as 0.029 reaches. */
    flat_record(&r, 0.01);
    const double reach = sqrt(0.029 * 0.029 - 0.01 * 0.01),
                 share = (0.2 * 0.2 + 4 * 0.2 * reach + M_PI * reach * reach) / 4;
    /* Lines stand 2/142 m apart: a border of that width, half of it on either side, may count or not. */
    c = with_goal(&r, 0, 0, share);
    if (!(fabs(c.margin[MORPH_MARGIN_GOAL].worst) < 0.5 * (0.8 + 2 * M_PI * reach) * (2.0 / 142) / 4))
        fail_msg("share %.6g, margin %.3g", share, c.margin[MORPH_MARGIN_GOAL].worst);
    /* With the base plane at the box's top the gap is to both alike; a base above it is nearer. */
    r.base = 0.005 - 1e-9;
    c = with_goal(&r, 0.01, 0, 0);
    assert_true(fabs(c.margin[MORPH_MARGIN_GOAL].worst - (0.01 - (0.005 - r.link_radius[0] + 1e-9))) < 1e-12);
    morph_record_free(&r);
}

/* The same numbers as model/cavity, by other code, on a bent sheet over a box that stands beside its middle
 * and where a rising target stands off its place. */
static void as_the_model_measures(void **state) {
    (void)state;
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    morph_record r;
    fixture_record(&r, 4, 21, 4);
    const double lo[3] = {-0.07, -0.06, -0.3}, hi[3] = {0.11, 0.09, 0.02};
    fixture_box(&r, lo, hi);
    r.base = 0.001;
    for (int lift = 0; lift < 2; lift++) {
        for (int k = 0; k < r.samples; k++)
            r.offset_schedule[3 * k + 2] = lift * 0.004;
        const morph_mesh mesh = {r.target_vertices, r.target_triangles, r.target_v, r.target_t};
        morph_distance *exact;
        morph_cavity *cavity;
        morph_measure m;
        double x[96];
        for (int i = 0; i < 3 * r.joints; i++)
            x[i] = r.schedule_joints[(r.samples - 1) * 3 * r.joints + i] - (i % 3 == 2 ? lift * 0.004 : 0);
        assert_int_equal(morph_distance_create(&mesh, true, &exact), MORPH_OK);
        assert_int_equal(morph_cavity_create(s, exact, r.base, &cavity), MORPH_OK);
        assert_int_equal(morph_cavity_measure(cavity, x, &m), MORPH_OK);
        assert_true(m.gap_max > 0.03 && m.gap_mean > 0.02 && m.coverage < 1);
        const double values[3] = {m.gap_mean, m.gap_max, m.coverage > 0 ? m.coverage : 0.5};
        for (int k = 0; k < 3; k++) {
            double ask[3] = {0, 0, 0};
            ask[k] = values[k];
            const morph_check_report c = with_goal(&r, ask[0], ask[1], ask[2]);
            const double expected = k == 2 ? m.coverage - values[2] : 0;
            if (!(fabs(c.margin[MORPH_MARGIN_GOAL].worst - expected) < 1e-12))
                fail_msg("lift %d, %s: %.17g", lift, c.margin[MORPH_MARGIN_GOAL].element,
                         c.margin[MORPH_MARGIN_GOAL].worst);
        }
        morph_cavity_destroy(cavity);
        morph_distance_destroy(exact);
    }
    morph_record_free(&r);
    morph_structure_destroy(s);
}

/* Anything that the goal depends on: a goal met with a millimetre to spare is lost. */
static void tampered(void **state) {
    (void)state;
    morph_record r;
    flat_record(&r, 0.05);
    assert_true(with_goal(&r, 0.047, 0, 0).feasible);
    const int last = (r.samples - 1) * 3 * r.joints;
    for (int i = 0; i < 3 * r.joints; i++)
        if (i % 3 == 2) r.schedule_joints[last + i] += 0.002;
    morph_check_report c = fixture_check(&r);
    assert_true(!c.feasible && c.margin[MORPH_MARGIN_GOAL].worst < -9e-4);
    for (int i = 0; i < 3 * r.joints; i++)
        if (i % 3 == 2) r.schedule_joints[last + i] -= 0.002;
    assert_true(fixture_check(&r).feasible);
    for (int v = 0; v < r.target_vertices; v++)
        r.target_v[3 * v + 2] -= 0.002;
    c = fixture_check(&r);
    assert_true(!c.feasible && c.worst == MORPH_MARGIN_GOAL);
    for (int v = 0; v < r.target_vertices; v++)
        r.target_v[3 * v + 2] += 0.002;
    r.goal.limit[MORPH_GOAL_MEAN_GAP] = 0.045;
    assert_false(fixture_check(&r).feasible);
    morph_record_free(&r);
}

static void kept_in_the_file(void **state) {
    (void)state;
    char file[] = "/tmp/test_check_goal_XXXXXX", message[256] = "";
    const int fd = mkstemp(file);
    assert_true(fd >= 0);
    close(fd);
    const morph_goal goals[3] = {{{0, 0, 0}}, {{0.0123, 0, 0.75}}, {{0, 1e-9, 1}}};
    for (int k = 0; k < 5; k++) {
        morph_record r, again;
        fixture_record(&r, 3, 11, 4);
        snprintf(r.program, sizeof r.program, "test");
        snprintf(r.outcome, sizeof r.outcome, "optimal");
        for (int i = 0; i < 64; i++)
            r.scene_sha256[i] = 'a';
        r.pose_width = 6 * r.posts;
        r.goal = goals[k < 3 ? k : 0];
        if (k == 3) r.goal.limit[MORPH_GOAL_COVERAGE] = 1.5;
        if (k == 4) r.goal.limit[MORPH_GOAL_MEAN_GAP] = INFINITY;
        unlink(file);
        if (morph_record_write_h5(&r, file, message, sizeof message) != MORPH_OK) fail_msg("%s", message);
        const morph_status status = morph_record_read_h5(file, &again, message, sizeof message);
        if (k < 3) {
            if (status != MORPH_OK) fail_msg("%s", message);
            assert_memory_equal(&r.goal, &again.goal, sizeof r.goal);
            morph_record_free(&again);
        } else {
            assert_int_equal(status, MORPH_ERR_INPUT);
            assert_non_null(strstr(message, k == 3 ? "attribute goal_coverage" : "attribute goal_mean_gap"));
        }
        morph_record_free(&r);
    }
    unlink(file);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hand_figures),
        cmocka_unit_test(as_the_model_measures),
        cmocka_unit_test(tampered),
        cmocka_unit_test(kept_in_the_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
