/* Records that nobody meant: every one must end as a defect, none in a crash or as feasible. */
#include "tests/planner/test_check_fixture.h"

static void expect_defect(const morph_record *r, const char *part) {
    const morph_check_report c = fixture_check(r);
    assert_false(c.feasible);
    if (!strstr(c.defect, part)) fail_msg("\"%s\" does not say \"%s\"", c.defect, part);
}

/* Puts a bad value into each entry in turn and expects a defect; back to the old value after. */
static void spoil_int(const morph_record *r, int *x, int n, int bad) {
    for (int i = 0; i < n; i++) {
        const int kept = x[i];
        x[i] = bad;
        expect_defect(r, "");
        assert_true(fixture_check(r).defect[0] != 0);
        x[i] = kept;
    }
}

static void spoil_double(const morph_record *r, double *x, size_t n, double bad) {
    /* First, last and some between. */
    for (size_t i = 0; i < n; i += n / 5 + 1) {
        const double kept = x[i];
        x[i] = bad;
        assert_true(fixture_check(r).defect[0] != 0);
        x[i] = kept;
    }
    const double kept = x[n - 1];
    x[n - 1] = bad;
    assert_true(fixture_check(r).defect[0] != 0);
    x[n - 1] = kept;
}

static void indices_out_of_range(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 11, 4);
    static const int bad[] = {-1, 1 << 30, INT32_MIN};
    for (size_t b = 0; b < sizeof bad / sizeof *bad; b++) {
        spoil_int(&r, r.link[0], 2 * r.links, bad[b]);
        spoil_int(&r, r.post[0], 2 * r.posts, bad[b]);
        spoil_int(&r, r.link_post[0], 2 * r.link_posts, bad[b]);
        spoil_int(&r, r.link_link[0], 2 * r.link_links, bad[b]);
        spoil_int(&r, r.skin[0], 3 * r.skin_triangles, bad[b]);
        spoil_int(&r, r.target_t, 3 * r.target_triangles, bad[b]);
        spoil_int(&r, r.joint_layer, r.joints, bad[b]);
        spoil_int(&r, r.link_kind, r.links, bad[b]);
    }
    int panel[1][2] = {{0, 9}}, fixed[1] = {9};
    r.panels = 1;
    r.panel = fixture_copy(panel, sizeof panel);
    expect_defect(&r, "panels");
    r.panels = 0;
    r.fixed_count = 1;
    r.fixed = fixture_copy(fixed, sizeof fixed);
    expect_defect(&r, "fixed");
    r.fixed_count = 0;
    r.link[2][1] = r.link[2][0];
    expect_defect(&r, "itself");
    morph_record_free(&r);
}

static void numbers_that_are_none(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 11, 4);
    static const double bad[] = {NAN, INFINITY, -INFINITY, 1e300};
    const size_t S = (size_t)r.samples, M = (size_t)r.links;
    for (size_t b = 0; b < sizeof bad / sizeof *bad; b++) {
        spoil_double(&r, r.schedule_joints, S * 3 * (size_t)r.joints, bad[b]);
        spoil_double(&r, r.length, S * M, bad[b]);
        spoil_double(&r, r.rate, S * M, bad[b]);
        spoil_double(&r, r.acceleration, S * M, bad[b]);
        spoil_double(&r, r.time, S, bad[b]);
        spoil_double(&r, r.offset_schedule, 3 * S, bad[b]);
        spoil_double(&r, r.target_v, 3 * (size_t)r.target_vertices, bad[b]);
        spoil_double(&r, r.length_limit[0], 2 * M, bad[b]);
        spoil_double(&r, r.rate_limit, M, bad[b]);
        spoil_double(&r, r.acceleration_limit, M, bad[b]);
        spoil_double(&r, r.jerk_limit, M, bad[b]);
        spoil_double(&r, r.link_radius, M, bad[b]);
        spoil_double(&r, r.post_length, (size_t)r.posts, bad[b]);
        spoil_double(&r, r.link_post_limit[0], 2 * (size_t)r.link_posts, bad[b]);
        spoil_double(&r, r.link_link_limit[0], 2 * (size_t)r.link_links, bad[b]);
        spoil_double(&r, &r.spacing, 1, bad[b]);
    }
    r.schedule_joints[3 * (2 * r.joints + 14)] = NAN;
    expect_defect(&r, "schedule/joints of joint (2,1) top at 0.8 s is not finite");
    morph_record_free(&r);
}

static void counts_and_absent_arrays(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 11, 4);
    int *const counts[] = {
        &r.joints, &r.links,       &r.posts,           &r.link_posts,       &r.link_links, &r.skin_triangles,
        &r.panels, &r.fixed_count, &r.target_vertices, &r.target_triangles, &r.samples};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        const int kept = *counts[i];
        *counts[i] = -1;
        assert_true(fixture_check(&r).defect[0] != 0);
        *counts[i] = kept;
    }
    r.samples = 1;
    expect_defect(&r, "two samples");
    r.samples = 11;
    morph_record copy = r;
    void **const arrays[] = {(void **)&copy.joint_layer,
                             (void **)&copy.joint_node,
                             (void **)&copy.link,
                             (void **)&copy.link_kind,
                             (void **)&copy.length_limit,
                             (void **)&copy.rate_limit,
                             (void **)&copy.acceleration_limit,
                             (void **)&copy.jerk_limit,
                             (void **)&copy.link_radius,
                             (void **)&copy.post,
                             (void **)&copy.post_length,
                             (void **)&copy.link_post,
                             (void **)&copy.link_post_limit,
                             (void **)&copy.link_link,
                             (void **)&copy.link_link_limit,
                             (void **)&copy.skin,
                             (void **)&copy.target_v,
                             (void **)&copy.target_t,
                             (void **)&copy.time,
                             (void **)&copy.schedule_joints,
                             (void **)&copy.length,
                             (void **)&copy.rate,
                             (void **)&copy.acceleration};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i] = NULL;
        assert_true(fixture_check(&copy).defect[0] != 0);
        copy = r;
    }
    morph_record empty;
    memset(&empty, 0, sizeof empty);
    expect_defect(&empty, "no joints");
    morph_record_free(&empty);
    morph_record_free(NULL);
    morph_record_free(&r);
}

static void time_must_be_even_from_zero(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 101, 4);
    r.time[40] += 1e-6;
    expect_defect(&r, "not even from 0: sample 40");
    r.time[40] -= 1e-6;
    for (int k = 0; k < r.samples; k++)
        r.time[k] += 0.1;
    expect_defect(&r, "not even from 0");
    for (int k = 0; k < r.samples; k++)
        r.time[k] = 0;
    expect_defect(&r, "does not increase");
    morph_record_free(&r);
}

/* Tuples that name a link which is not at its post, or two links apart. */
static void tuples_that_do_not_meet(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 11, 4);
    const int kept = r.link_post[0][1];
    r.link_post[0][1] = 8;
    expect_defect(&r, "does not end at its post");
    r.link_post[0][1] = kept;
    r.link_link[3][1] = r.link_link[3][0];
    expect_defect(&r, "share no joint");
    morph_record_free(&r);
}

/* Joints that leap about: an answer in bounded time, whatever it says. */
static void wild_motion_ends(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 101, 4);
    uint64_t seed = 7;
    for (int i = 3 * r.joints; i < r.samples * 3 * r.joints; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        r.schedule_joints[i] = (double)(seed >> 11) / 9007199254740992.0 * (i % 7 ? 1 : 1e4);
    }
    const double start = morph_seconds();
    assert_false(fixture_check(&r).feasible);
    /* That it ends is the point, not how fast: a hang would be minutes. */
    assert_true(morph_seconds() - start < 500);
    /* All joints in one point: no directions, no lengths. */
    for (int i = 0; i < r.samples * 3 * r.joints; i++)
        r.schedule_joints[i] = 0.5;
    assert_false(fixture_check(&r).feasible);
    morph_record_free(&r);
}

/* A target of degenerate triangles, and one that is open. */
static void odd_targets(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 21, 4);
    r.target_triangles = 10; /* without two of its sides */
    morph_check_report c = fixture_check(&r);
    assert_true(c.margin[MORPH_MARGIN_CLEARANCE].tested);
    for (int i = 0; i < 3 * r.target_vertices; i++)
        r.target_v[i] = 0.25;
    c = fixture_check(&r);
    assert_true(isfinite(c.margin[MORPH_MARGIN_CLEARANCE].worst));
    morph_record_free(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(indices_out_of_range),
        cmocka_unit_test(numbers_that_are_none),
        cmocka_unit_test(counts_and_absent_arrays),
        cmocka_unit_test(time_must_be_even_from_zero),
        cmocka_unit_test(tuples_that_do_not_meet),
        cmocka_unit_test(wild_motion_ends),
        cmocka_unit_test(odd_targets),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
