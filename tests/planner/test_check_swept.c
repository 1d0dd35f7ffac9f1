/* What happens between samples: the target's and the structure's own clearance. */
#include "tests/planner/test_check_fixture.h"

#include "model/distance.h"

/* A plate 0.4 mm thick, crossed by everything at up to 4 mm a sample, thinner than the 10 times finer grid's
 * 0.4 mm steps: no sample and no point of that grid lies in it for the joint of interest. */
static void thin_plate_crossed_between_two_samples(void **state) {
    (void)state;
    for (int which = 0; which < 2; which++) {
        morph_record r;
        fixture_record(&r, 3, 51, 4);
        for (int i = 0; i < r.links; i++)
            r.link_radius[i] = 1e-6;
        const int joint = 4, k = 25;
        const double *x = r.schedule_joints + 3 * (size_t)(k * r.joints + joint), *y = x + 3 * r.joints;
        /* Over one cell about the joint, or beside it, where only links and skin pass. */
        const double aside = which ? 0.05 : 0, mid = 0.5 * (x[2] + y[2]);
        assert_true(y[2] - x[2] > 1.0e-3);
        const double lo[3] = {x[0] - 0.01 + aside, x[1] - 0.01, mid - 2e-4};
        const double hi[3] = {x[0] + 0.01 + aside, x[1] + 0.01, mid + 2e-4};
        fixture_box(&r, lo, hi);
        const morph_check_report c = fixture_check(&r);
        if (which == 0) {
            const double t0 = r.time[k], t1 = r.time[k + 1];
            fixture_expect(&c, MORPH_MARGIN_CLEARANCE, -2e-4 - 1e-6, 2e-6, "joint (1,1) bottom", t0, t1);
        } else {
            const morph_margin *m = &c.margin[MORPH_MARGIN_CLEARANCE];
            assert_false(c.feasible);
            assert_true(m->worst < -1.5e-4);
            assert_true(strncmp(m->element, "joint", 5) != 0);
        }
        assert_true(c.clearance_resolution < 0.1 * (r.time[1] - r.time[0]));
        morph_record_free(&r);
    }
}

static void penetrating_joint(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    /* A column under post (2,1) that reaches 3 mm above its bottom joint at the start, where nothing has
     * moved: less the radius, that is the depth; a column too wide for a shorter way out. */
    const double *x = r.schedule_joints + 3 * 5;
    const double lo[3] = {x[0] - 0.04, x[1] - 0.04, -0.3}, hi[3] = {x[0] + 0.04, x[1] + 0.04, x[2] + 0.003};
    fixture_box(&r, lo, hi);
    const morph_check_report c = fixture_check(&r);
    /* The joint is no deeper than the links and skin around it: the joint is named. */
    fixture_expect(&c, MORPH_MARGIN_CLEARANCE, -0.003 - r.link_radius[0], 1e-6, "joint (2,1) bottom", 0, 1);
    morph_record_free(&r);
}

/* Inside a closed box without touching it: FCL sees 0.5 m of clearance. */
static void inside_without_touching(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 51, 4);
    const double lo[3] = {-0.7, -0.7, -0.7}, hi[3] = {0.7, 0.7, 0.7};
    fixture_box(&r, lo, hi);
    const morph_check_report c = fixture_check(&r);
    assert_false(c.feasible);
    assert_true(c.margin[MORPH_MARGIN_CLEARANCE].worst < -0.5);
    morph_record_free(&r);
}

/* The structure stands, the target comes up: the same clearance as the other way round. */
static void moving_target(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    const size_t n = 3 * (size_t)r.joints;
    for (int k = 1; k < r.samples; k++) {
        memcpy(r.schedule_joints + (size_t)k * n, r.schedule_joints, n * sizeof(double));
        memcpy(r.length + k * r.links, r.length, (size_t)r.links * sizeof(double));
        memset(r.rate + k * r.links, 0, (size_t)r.links * sizeof(double));
        memset(r.acceleration + k * r.links, 0, (size_t)r.links * sizeof(double));
        const double u = k / 200.0;
        r.offset_schedule[3 * k + 2] = 0.06 * sin(M_PI * u);
    }
    const morph_check_report c = fixture_check(&r);
    const morph_margin *m = &c.margin[MORPH_MARGIN_CLEARANCE];
    assert_true(fabs(m->worst - (0.05 - 0.06 - r.link_radius[0])) < 1e-8);
    assert_true(fabs(m->time - 2) < 1e-3);
    for (int k = 0; k < 3 * r.samples; k++)
        r.offset_schedule[k] *= 0.5;
    assert_true(fabs(fixture_check(&r).margin[MORPH_MARGIN_CLEARANCE].worst - (0.02 - r.link_radius[0])) <
                1e-8);
    free(r.offset_schedule);
    r.offset_schedule = NULL;
    assert_true(fabs(fixture_check(&r).margin[MORPH_MARGIN_CLEARANCE].worst - (0.05 - r.link_radius[0])) <
                1e-9);
    morph_record_free(&r);
}

/* The search against a plain scan at 200 points per sample of every joint, link and skin triangle, distances
 * by the other library. A sphere-like target near the bulge's underside. */
static void search_finds_what_a_scan_finds(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 26, 4);
    enum { A = 12, B = 7 };
    double v[3 * A * B];
    int t[6 * A * (B - 1) + 6 * A], count = 0;
    for (int i = 0; i < B; i++)
        for (int j = 0; j < A; j++) {
            const double th = M_PI * (i + 0.5) / B, ph = 2 * M_PI * j / A;
            v[3 * (i * A + j)] = 0.03 + 0.04 * sin(th) * cos(ph);
            v[3 * (i * A + j) + 1] = -0.02 + 0.04 * sin(th) * sin(ph);
            v[3 * (i * A + j) + 2] = 0.005 - 0.04 * cos(th);
        }
    for (int i = 0; i + 1 < B; i++)
        for (int j = 0; j < A; j++) {
            const int a = i * A + j, b = i * A + (j + 1) % A;
            const int two[6] = {a, b, b + A, a, b + A, a + A};
            memcpy(t + 3 * count, two, sizeof two);
            count += 2;
        }
    for (int j = 1; j + 1 < A; j++) {
        const int caps[6] = {0, j + 1, j, (B - 1) * A, (B - 1) * A + j, (B - 1) * A + j + 1};
        memcpy(t + 3 * count, caps, sizeof caps);
        count += 2;
    }
    free(r.target_v);
    free(r.target_t);
    r.target_v = fixture_copy(v, sizeof v);
    r.target_t = fixture_copy(t, 3 * (size_t)count * sizeof *t);
    r.target_vertices = A * B;
    r.target_triangles = count;
    const morph_mesh mesh = {r.target_vertices, r.target_triangles, r.target_v, r.target_t};
    morph_distance *d = NULL;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    double least = INFINITY;
    const size_t n = 3 * (size_t)r.joints;
    double *x = malloc(n * sizeof *x);
    for (int k = 0; k + 1 < r.samples; k++)
        for (int i = 0; i < 200; i++) {
            /* Straight between samples: curvature over a sample is far below the tolerance of the test. */
            const double u = i / 200.0;
            for (size_t c = 0; c < n; c++)
                x[c] = (1 - u) * r.schedule_joints[(size_t)k * n + c] +
                       u * r.schedule_joints[(size_t)(k + 1) * n + c];
            morph_closest at;
            double w[3];
            for (int c = 0; c < r.skin_triangles; c++) {
                morph_distance_triangle(d, x + 3 * r.skin[c][0], x + 3 * r.skin[c][1], x + 3 * r.skin[c][2],
                                        w, &at);
                least = fmin(least, at.distance);
            }
        }
    free(x);
    morph_distance_destroy(d);
    const morph_check_report c = fixture_check(&r);
    assert_true(fabs(c.margin[MORPH_MARGIN_CLEARANCE].worst - (least - r.link_radius[0])) < 2e-5);
    morph_record_free(&r);
}

/* Two bars and a strip of skin: bar 0 stands along x, bar 1 along y falls through it between two samples. */
static void bars_record(morph_record *r, int samples, double step, double drop) {
    static const int layer[7] = {0}, node[7][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {6, 0}};
    static const int link[2][2] = {{0, 1}, {2, 3}}, kind[2] = {0, 1}, skin[1][3] = {{4, 5, 6}};
    static const double limit[2][2] = {{0.05, 0.2}, {0.05, 0.2}}, large[2] = {9, 9},
                        radius[2] = {0.004, 0.003};
    static const double start[7][3] = {{-0.05, 0, 0.1}, {0.05, 0, 0.1}, {0.01, -0.05, 0}, {0.01, 0.05, 0},
                                       {1, 1, 0.1},     {1.1, 1, 0.1},  {1, 1.1, 0.1}};
    double move[7][3] = {{0}}, from[7][3];
    memset(r, 0, sizeof *r);
    memcpy(from, start, sizeof from);
    from[2][2] = from[3][2] = 0.1 + 0.5 * drop;
    move[2][2] = move[3][2] = -drop;
    r->base = NAN;
    r->spacing = 0.1;
    r->joints = 7;
    r->links = 2;
    r->skin_triangles = 1;
    r->joint_layer = fixture_copy(layer, sizeof layer);
    r->joint_node = fixture_copy(node, sizeof node);
    r->link = fixture_copy(link, sizeof link);
    r->link_kind = fixture_copy(kind, sizeof kind);
    r->length_limit = fixture_copy(limit, sizeof limit);
    r->rate_limit = fixture_copy(large, sizeof large);
    r->acceleration_limit = fixture_copy(large, sizeof large);
    r->jerk_limit = fixture_copy(large, sizeof large);
    r->link_radius = fixture_copy(radius, sizeof radius);
    r->skin = fixture_copy(skin, sizeof skin);
    fixture_schedule(r, start[0], move[0], samples, step * (samples - 1));
    for (int k = 0; k < samples; k++) /* the bar's height over time starts at from */
        for (int j = 2; j < 4; j++)
            r->schedule_joints[3 * (7 * k + j) + 2] += from[j][2] - start[j][2];
    const double lo[3] = {-1, -1, -2}, hi[3] = {1, 1, -1};
    fixture_box(r, lo, hi);
}

static void links_cross_between_two_samples(void **state) {
    (void)state;
    morph_record r;
    /* 0.6 m in 20 samples: 57 mm per sample in the middle, bars of 7 mm together. */
    bars_record(&r, 20, 0.01, 0.6);
    const morph_check_report c = fixture_check(&r);
    const double h = 0.01;
    fixture_expect(&c, MORPH_MARGIN_SELF_CLEARANCE, -0.007, 1e-9,
                   "link 0 (0,0)-(1,0) bottom / link 1 (2,0)-(3,0) top", 9 * h, 10 * h);
    assert_true(fabs(c.margin[MORPH_MARGIN_SELF_CLEARANCE].time - 9.5 * h) < 1e-6);
    morph_record_free(&r);
    bars_record(&r, 20, 0.01, 0); /* stay touching with their axes: no motion, no search */
    assert_true(fabs(fixture_check(&r).margin[MORPH_MARGIN_SELF_CLEARANCE].worst + 0.007) < 1e-12);
    morph_record_free(&r);
}

/* Links of one joint are never tested against each other. */
static void shared_joints_are_exempt(void **state) {
    (void)state;
    morph_record r;
    bars_record(&r, 20, 0.01, 0.6);
    r.link[1][0] = 1;
    for (int k = 0; k < r.samples * r.links; k++)
        r.length[k] = r.rate[k] = r.acceleration[k] = 0; /* of no interest here */
    const morph_check_report c = fixture_check(&r);
    assert_false(c.margin[MORPH_MARGIN_SELF_CLEARANCE].tested);
    morph_record_free(&r);
}

static void thick_links_meet_each_other(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    r.link_radius[0] = 0.03; /* bottom, and its partner in the top layer, 0.05 above */
    r.link_radius[r.links / 2] = 0.03;
    free(r.target_t);
    free(r.target_v);
    r.target_t = NULL;
    r.target_v = NULL;
    const double lo[3] = {-1, -1, -2}, hi[3] = {1, 1, -1};
    fixture_box(&r, lo, hi);
    const morph_check_report c = fixture_check(&r);
    assert_false(c.feasible);
    const morph_margin *m = &c.margin[MORPH_MARGIN_SELF_CLEARANCE];
    assert_true(m->worst < -0.01 && m->worst > -0.03);
    assert_true(strstr(m->element, " / ") != NULL);
    morph_record_free(&r);
}

static int stop_now(void *user) {
    ++*(int *)user;
    return 1;
}

static void stops_when_asked(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 201, 4);
    int asked = 0;
    const morph_control control = {.stop = stop_now, .user = &asked};
    morph_check_report c;
    assert_int_equal(morph_check_record(&r, &control, &c), MORPH_ERR_STOPPED);
    assert_int_equal(asked, 1);
    assert_false(c.feasible);
    morph_record_free(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thin_plate_crossed_between_two_samples),
        cmocka_unit_test(penetrating_joint),
        cmocka_unit_test(inside_without_touching),
        cmocka_unit_test(moving_target),
        cmocka_unit_test(search_finds_what_a_scan_finds),
        cmocka_unit_test(links_cross_between_two_samples),
        cmocka_unit_test(shared_joints_are_exempt),
        cmocka_unit_test(thick_links_meet_each_other),
        cmocka_unit_test(stops_when_asked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
