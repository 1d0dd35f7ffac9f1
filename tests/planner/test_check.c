/* One fault at a time, planted in a sound record: exactly its margin must fail, by the right amount, naming
 * the right element and time. */
#include "tests/planner/test_check_fixture.h"

static void link_text(const morph_record *r, int link, char text[96]) {
    morph_record_link_name(r, link, text, 96);
}

/* Sound record: everything tested holds, and the figures are those of the geometry. */
static void sound_record_is_feasible(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    r.base = 0.02;
    const morph_check_report c = fixture_check(&r);
    assert_string_equal(c.defect, "");
    assert_true(c.feasible);
    for (int k = 0; k < MORPH_MARGIN_KINDS; k++)
        assert_int_equal(c.margin[k].tested, k != MORPH_MARGIN_PANEL && k != MORPH_MARGIN_GOAL);
    const double radius = r.link_radius[0];
    /* Links rise from a flat start 0.05 above the target, but one corner of the bulge goes down a little. */
    double lowest = INFINITY;
    for (int i = 0; i < r.samples * r.joints; i++)
        lowest = fmin(lowest, r.schedule_joints[3 * i + 2]);
    assert_true(fabs(c.margin[MORPH_MARGIN_CLEARANCE].worst - (lowest - radius)) < 1e-9);
    assert_true(fabs(c.margin[MORPH_MARGIN_BASE].worst - (lowest - 0.02)) < 1e-12);
    assert_true(strncmp(c.margin[MORPH_MARGIN_CLEARANCE].element, "joint (", 7) == 0);
    /* Links over each other, a post length apart (less where sloping). */
    const double self = c.margin[MORPH_MARGIN_SELF_CLEARANCE].worst;
    assert_true(self < 0.05 - 2 * radius + 1e-12 && self > 0.045 - 2 * radius);
    assert_true(c.margin[MORPH_MARGIN_COMPATIBILITY].worst > -1e-9);
    assert_true(c.margin[MORPH_MARGIN_POST_LENGTH].worst > -1e-12);
    assert_true(c.clearance_resolution > 0);
    morph_record_free(&r);
    assert_null(r.link);
}

static void length_beyond_its_limit(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    char name[96];
    for (int link = 0; link < r.links; link += 5) {
        double longest = 0;
        int at = 0;
        for (int k = 0; k < r.samples; k++)
            if (r.length[k * r.links + link] > longest) {
                longest = r.length[k * r.links + link];
                at = k;
            }
        const double kept = r.length_limit[link][1];
        r.length_limit[link][1] = longest - 1e-6;
        const morph_check_report c = fixture_check(&r);
        link_text(&r, link, name);
        fixture_expect(&c, MORPH_MARGIN_LENGTH, -1e-6, 1e-9, name, r.time[at] - 0.021, r.time[at] + 0.021);
        r.length_limit[link][1] = kept;
    }
    morph_record_free(&r);
}

/* Even number of samples: the fastest moment, u = 1/2, lies between two of them. */
static void rate_beyond_between_samples_only(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 60, 4);
    const int link = 7;
    double seen = 0;
    for (int k = 0; k < r.samples; k++)
        seen = fmax(seen, fabs(r.rate[k * r.links + link]));
    r.rate_limit[link] = seen * (1 + 1e-4);
    const morph_check_report c = fixture_check(&r);
    char name[96];
    link_text(&r, link, name);
    const double t = c.margin[MORPH_MARGIN_RATE].time;
    fixture_expect(&c, MORPH_MARGIN_RATE, -4e-4 * seen, 4e-4 * seen, name, 1.9, 2.1);
    for (int k = 0; k < r.samples; k++)
        assert_true(fabs(t - r.time[k]) > 1e-3);
    morph_record_free(&r);
}

static void acceleration_beyond_its_limit(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    const int link = 11;
    double seen = 0, at = 0;
    for (int k = 0; k < r.samples; k++) {
        const double a = fabs(r.acceleration[k * r.links + link]);
        if (a > seen) {
            seen = a;
            at = r.time[k];
        }
    }
    r.acceleration_limit[link] = 0.99 * seen;
    const morph_check_report c = fixture_check(&r);
    char name[96];
    link_text(&r, link, name);
    fixture_expect(&c, MORPH_MARGIN_ACCELERATION, -0.01 * seen, 1e-4 * seen, name, at - 0.011, at + 0.011);
    morph_record_free(&r);
}

/* An acceleration sample off by 3 mm/s2 stays within every other limit, but takes 9 da / h of jerk. */
static void jerk_spike(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    const int link = 13, k = 170;
    r.acceleration[k * r.links + link] += 0.003;
    const morph_check_report c = fixture_check(&r);
    char name[96];
    link_text(&r, link, name);
    fixture_expect(&c, MORPH_MARGIN_JERK, r.jerk_limit[link] - 9 * 0.003 / 0.01, 0.05, name,
                   r.time[k] - 0.011, r.time[k] + 0.011);
    morph_record_free(&r);
}

/* 2e-7 m up: 4e-6 of a post of 0.05 m, and below the tolerance of compatibility for links that lie flat. */
static void bent_post(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    const int k = 123, post = 4;
    r.schedule_joints[3 * (k * r.joints + r.post[post][1]) + 2] += 2e-7;
    const morph_check_report c = fixture_check(&r);
    fixture_expect(&c, MORPH_MARGIN_POST_LENGTH, -4e-6, 1e-8, "post (1,1)", r.time[k] - 1e-9,
                   r.time[k] + 1e-9);
    morph_record_free(&r);
}

/* Eight samples of the whole motion: the cubic through joints is off by more than lengths may be at samples,
 * which is no fault of the record. */
static void coarse_samples(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 8, 4);
    morph_check_report c = fixture_check(&r);
    assert_string_equal(c.defect, "");
    assert_true(c.feasible);
    assert_true(c.interpolation > 1e-6 && c.interpolation < 1e-3);
    assert_false(c.coarse);
    assert_string_equal(morph_check_hint(&c), "");
    /* The base plane touched at a sample: between samples the cubic goes through it, and the hint says why.
     */
    r.base = INFINITY;
    for (int i = 0; i < r.samples * r.joints; i++)
        r.base = fmin(r.base, r.schedule_joints[3 * i + 2]);
    c = fixture_check(&r);
    assert_false(c.feasible);
    assert_int_equal(c.worst, MORPH_MARGIN_BASE);
    assert_true(c.margin[MORPH_MARGIN_BASE].worst < -1e-6);
    assert_true(c.coarse);
    assert_non_null(strstr(morph_check_hint(&c), "schedule.sample"));
    /* A millimetre is more than the interpolation can explain. */
    r.base += 1e-3;
    c = fixture_check(&r);
    assert_int_equal(c.worst, MORPH_MARGIN_BASE);
    assert_false(c.feasible || c.coarse);
    morph_record_free(&r);
    /* Fine samples: nothing is to be blamed on them. */
    fixture_record(&r, 3, 401, 4);
    r.base = INFINITY;
    for (int i = 0; i < r.samples * r.joints; i++)
        r.base = fmin(r.base, r.schedule_joints[3 * i + 2] + 2e-6);
    c = fixture_check(&r);
    assert_int_equal(c.worst, MORPH_MARGIN_BASE);
    assert_false(c.feasible || c.coarse);
    morph_record_free(&r);
}

/* A fault of the data is seen at coarse samples as well. */
static void coarse_samples_hide_no_fault(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 8, 4);
    const int k = 5, post = 4;
    r.schedule_joints[3 * (k * r.joints + r.post[post][1]) + 2] += 2e-7;
    const morph_check_report c = fixture_check(&r);
    fixture_expect(&c, MORPH_MARGIN_POST_LENGTH, -4e-6, 1e-8, "post (1,1)", r.time[k] - 1e-9,
                   r.time[k] + 1e-9);
    assert_false(c.coarse);
    morph_record_free(&r);
}

static void length_that_fits_no_shape(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    const int link = 3;
    for (int k = 0; k < r.samples; k++)
        r.length[k * r.links + link] += 5e-7;
    const morph_check_report c = fixture_check(&r);
    char name[96];
    link_text(&r, link, name);
    fixture_expect(&c, MORPH_MARGIN_COMPATIBILITY, -5e-7, 1e-9, name, 0, 4);
    morph_record_free(&r);
}

static double link_post_angle(const morph_record *r, int tuple, int sample) {
    const int *t = r->link_post[tuple], *link = r->link[t[0]], *post = r->post[t[1]];
    const double *x = r->schedule_joints + (size_t)sample * 3 * (size_t)r->joints;
    const bool first = link[0] == post[0] || link[0] == post[1];
    double u[3], v[3];
    morph_sub(x + 3 * link[first ? 1 : 0], x + 3 * link[first ? 0 : 1], u);
    morph_sub(x + 3 * post[1], x + 3 * post[0], v);
    return acos(morph_dot(u, v) / (morph_norm(u) * morph_norm(v)));
}

static void angle_beyond_its_limit(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    for (int tuple = 0; tuple < r.link_posts; tuple += 7) {
        const double angle = link_post_angle(&r, tuple, r.samples - 1);
        const int side = angle > M_PI / 2 ? 1 : 0;
        const double kept = r.link_post_limit[tuple][side];
        r.link_post_limit[tuple][side] = angle + (side ? -1e-6 : 1e-6);
        const morph_check_report c = fixture_check(&r);
        char name[256], link[96];
        const int *node = r.joint_node[r.post[r.link_post[tuple][1]][0]];
        link_text(&r, r.link_post[tuple][0], link);
        snprintf(name, sizeof name, "%s / post (%d,%d)", link, node[0], node[1]);
        fixture_expect(&c, MORPH_MARGIN_LINK_POST, -1e-6, 1e-9, name, 3.9, 4);
        r.link_post_limit[tuple][side] = kept;
    }
    const int tuple = 9;
    r.link_link_limit[tuple][0] = r.link_link_limit[tuple][1] =
        M_PI / 2; /* flat start: exactly a right angle */
    const morph_check_report c = fixture_check(&r);
    assert_true(c.margin[MORPH_MARGIN_LINK_LINK].worst < -1e-4);
    char first[96], second[96], name[256];
    link_text(&r, r.link_link[tuple][0], first);
    link_text(&r, r.link_link[tuple][1], second);
    snprintf(name, sizeof name, "%s / %s", first, second);
    fixture_expect(&c, MORPH_MARGIN_LINK_LINK, c.margin[MORPH_MARGIN_LINK_LINK].worst, 0, name, 3.9, 4);
    morph_record_free(&r);
}

/* The base is raised to 1e-5 above the lowest joint. */
static void base_dip(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    double lowest = INFINITY;
    int where = 0;
    for (int i = 0; i < r.samples * r.joints; i++)
        if (r.schedule_joints[3 * i + 2] < lowest) {
            lowest = r.schedule_joints[3 * i + 2];
            where = i;
        }
    r.base = lowest + 1e-5;
    const morph_check_report c = fixture_check(&r);
    char name[96];
    morph_record_joint_name(&r, where % r.joints, name, sizeof name);
    /* Between samples the cubic overshoots the end by parts of h^4. */
    fixture_expect(&c, MORPH_MARGIN_BASE, -1e-5, 1e-10, name, 3.9, 4);
    r.base = lowest + 5e-7; /* within the tolerance of 1e-6 m */
    assert_true(fixture_check(&r).feasible);
    morph_record_free(&r);
}

/* The top of one post aside, across the plane of its panel. */
static void bent_panel(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 101, 4);
    int panels[2][2] = {{0, 1}, {4, 5}};
    r.panels = 2;
    r.panel = fixture_copy(panels, sizeof panels);
    assert_true(fixture_check(&r).margin[MORPH_MARGIN_PANEL].tested);
    assert_true(fixture_check(&r).feasible);
    /* Top of post 4 aside along y by 1e-5 across the panel's plane. */
    const int k = 50;
    r.schedule_joints[3 * (k * r.joints + r.post[4][1]) + 1] += 1e-5;
    const morph_check_report c = fixture_check(&r);
    const morph_margin *m = &c.margin[MORPH_MARGIN_PANEL];
    assert_true(fabs(m->worst + 1e-5 / 0.05) < 1e-5);
    assert_string_equal(m->element, "post (1,1) / post (2,1)");
    assert_true(fabs(m->time - r.time[k]) < 1e-9);
    assert_false(c.feasible);
    morph_record_free(&r);
}

static void wrong_columns_are_found(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    const int at = 150 * r.links + 5;
    const double rate = r.rate[at], acceleration = r.acceleration[at];
    r.rate[at] += 1e-4; /* 0.2 % of the limit, at one sample */
    morph_check_report c = fixture_check(&r);
    assert_false(c.feasible);
    assert_non_null(strstr(c.defect, "schedule/rate of link 5 "));
    assert_non_null(strstr(c.defect, "at 1.5 s"));
    r.rate[at] = rate;
    r.acceleration[at] += 0.02;
    c = fixture_check(&r);
    assert_false(c.feasible);
    assert_non_null(strstr(c.defect, "schedule/acceleration of link 5 "));
    r.acceleration[at] = acceleration;
    for (int i = 0; i < r.samples * r.links; i++)
        r.rate[i] = 0; /* a column left empty */
    c = fixture_check(&r);
    assert_non_null(strstr(c.defect, "schedule/rate of link "));
    morph_record_free(&r);
}

static void ends_must_be_at_rest(void **state) {
    (void)state;
    morph_record r, half;
    fixture_record(&r, 3, 401, 4);
    fixture_record(&half, 3, 401, 4);
    half.samples = 201; /* cut where it moves fastest */
    morph_check_report c = fixture_check(&half);
    assert_false(c.feasible);
    assert_non_null(strstr(c.defect, "not at rest at the end"));
    r.acceleration[5] = 0.01;
    c = fixture_check(&r);
    assert_non_null(strstr(c.defect, "link 5 "));
    assert_non_null(strstr(c.defect, "not at rest at the start"));
    morph_record_free(&r);
    morph_record_free(&half);
}

static void held_posts_must_not_move(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    const int held[1] = {2};
    r.fixed_count = 1;
    r.fixed = fixture_copy(held, sizeof held);
    const morph_check_report c = fixture_check(&r);
    assert_false(c.feasible);
    assert_non_null(strstr(c.defect, "post (2,0) is held"));
    morph_record_free(&r);
}

static void names_are_those_of_the_contract(void **state) {
    (void)state;
    static const char *const names[] = {
        "length",    "rate",      "acceleration", "jerk",           "post_length",   "panel", "link_post",
        "link_link", "clearance", "base",         "self_clearance", "compatibility", "goal"};
    for (int k = 0; k < MORPH_MARGIN_KINDS; k++) {
        assert_string_equal(morph_margin_name((morph_margin_kind)k), names[k]);
        assert_true(strlen(morph_margin_unit((morph_margin_kind)k)) > 0);
    }
    morph_record r;
    fixture_record(&r, 3, 11, 4);
    char text[96], tiny[8];
    morph_record_link_name(&r, 0, text, sizeof text);
    assert_string_equal(text, "link 0 (0,0)-(1,0) bottom");
    morph_record_joint_name(&r, 9 + 5, text, sizeof text);
    assert_string_equal(text, "joint (2,1) top");
    morph_record_link_name(&r, 0, tiny, sizeof tiny);
    assert_string_equal(tiny, "link 0 ");
    morph_record_free(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_record_is_feasible),
        cmocka_unit_test(length_beyond_its_limit),
        cmocka_unit_test(rate_beyond_between_samples_only),
        cmocka_unit_test(acceleration_beyond_its_limit),
        cmocka_unit_test(jerk_spike),
        cmocka_unit_test(bent_post),
        cmocka_unit_test(coarse_samples),
        cmocka_unit_test(coarse_samples_hide_no_fault),
        cmocka_unit_test(length_that_fits_no_shape),
        cmocka_unit_test(angle_beyond_its_limit),
        cmocka_unit_test(base_dip),
        cmocka_unit_test(bent_panel),
        cmocka_unit_test(wrong_columns_are_found),
        cmocka_unit_test(ends_must_be_at_rest),
        cmocka_unit_test(held_posts_must_not_move),
        cmocka_unit_test(names_are_those_of_the_contract),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
