/* Forces and limits at their extremes: attraction of a million weights, no gravity, huge drag, limits that
 * leave no room, skins of a thousandth of the spacing; and what is refused. */
#include "tests/extremes/extreme_scene.h"

static void ball_world(world *w, const morph_structure_def *def, double gap) {
    make_sphere(3);
    scale_made(0.9 * def->spacing, -0.9 * def->spacing);
    make_world(w, def, true, gap, 0.0);
}

/* The pull is largest at e / sqrt 2 from a centre, 2 / (3 sqrt 3) s / e^2. */
static void test_attraction(void **state) {
    (void)state;
    static const double parts[] = {1.0, 1e3, 1e6};
    for (int n = 0; n < 6; n++) {
        const morph_structure_def def = morph_structure_defaults(0.1);
        const double weight = def.mass * 9.81, a = def.spacing;
        const morph_attractor centre = {{0.0, 0.0, n < 3 ? -0.9 * a : 0.9 * a},
                                        parts[n % 3] * weight * a * a * 1.5 * sqrt(3.0)};
        world w;
        ball_world(&w, &def, 0.06);
        w.def.attractors = &centre;
        w.def.attractor_count = 1;
        w.def.time = 3.0 * sqrt(a / 9.81 / parts[n % 3]);
        w.def.frame = w.def.time / 30.0;
        char name[64];
        snprintf(name, sizeof name, "attraction of %.0e weights, %s", parts[n % 3], n < 3 ? "in" : "above");
        const figures f = run_world(&w, name);
        expect_within(&f);
        free_world(&w);
    }
}

static void test_quiet(void **state) {
    (void)state;
    const morph_structure_def def = morph_structure_defaults(0.1);
    world w;
    ball_world(&w, &def, 0.1);
    w.def.gravity = 0.0;
    figures f = run_world(&w, "no gravity");
    expect_within(&f);
    assert_true(f.fastest < 1e-12);
    w.def.velocity[2] = -2.0;
    f = run_world(&w, "no gravity, thrown");
    expect_within(&f);
    assert_true(f.fastest > 0.5 && f.fastest < 6.0);
    free_world(&w);
    static const double drags[] = {1e3, 1e6, 1e12, 1e300};
    for (int n = 0; n < 4; n++) {
        ball_world(&w, &def, 0.1);
        w.def.drag = drags[n];
        w.def.velocity[2] = -2.0;
        char name[64];
        snprintf(name, sizeof name, "drag %.0e 1/s", drags[n]);
        f = run_world(&w, name);
        expect_within(&f);
        assert_true(f.fastest < 2.0);
        free_world(&w);
    }
}

static void test_friction(void **state) {
    (void)state;
    static const double frictions[] = {0.0, 1e3, 1e12};
    for (int n = 0; n < 3; n++) {
        const morph_structure_def def = morph_structure_defaults(0.1);
        world w;
        ball_world(&w, &def, 0.1);
        w.def.friction = frictions[n];
        w.def.time = 0.5;
        char name[64];
        snprintf(name, sizeof name, "friction %.0e", frictions[n]);
        const figures f = run_world(&w, name);
        expect_within(&f);
        assert_true(f.fastest < 6.0);
        free_world(&w);
    }
}

/* Lengths with no range at all, then angles too. The sheet may still shear; over a ball it can bend only as
 * a surface that keeps its lengths does. */
static void test_no_range(void **state) {
    (void)state;
    for (int n = 0; n < 4; n++) {
        morph_structure_def def = morph_structure_defaults(0.1);
        if (n % 2 == 1) {
            def.link_post[0] = def.link_post[1] = def.link_link[0] = def.link_link[1] = 0.5 * acos(-1.0);
        }
        for (int k = 0; k < 2; k++)
            def.length[k][0] = def.length[k][1] = def.spacing;
        if (n >= 2) def.bracing = MORPH_BRACING_WEB;
        world w;
        ball_world(&w, &def, 0.1);
        w.def.time = 0.5;
        char name[64];
        snprintf(name, sizeof name, "lengths%s fixed%s", n % 2 ? " and angles" : "",
                 n >= 2 ? ", braced" : "");
        const figures f = run_world(&w, name);
        expect_within(&f);
        assert_true(f.fastest < 6.0);
        free_world(&w);
    }
}

/* Layers a thousandth of the spacing apart, and skins of that thickness. */
static void test_thin(void **state) {
    (void)state;
    for (int n = 0; n < 3; n++) {
        morph_structure_def def = morph_structure_defaults(0.1);
        if (n != 1) def.thickness = 1e-3 * def.spacing;
        if (n != 0) def.radius = 0.5e-3 * def.spacing;
        world w;
        ball_world(&w, &def, 0.1);
        w.def.time = 0.5;
        char name[64];
        snprintf(name, sizeof name, "%s%s thin", n != 1 ? "posts" : "", n != 0 ? " skin" : "");
        figures f = run_world(&w, name);
        /* With posts as short as the margins that sweeps aim inside by, angles to them are not held any
         * better than this. */
        if (n != 1) {
            assert_true(f.angle <= 10.0);
            f.angle = 0.0;
        }
        expect_within(&f);
        assert_true(f.fastest < 6.0);
        free_world(&w);
    }
}

static morph_status tried(const world *w, const morph_blanket_def *def) {
    morph_trajectory t;
    const morph_status status = morph_blanket_run(w->s, w->sdf, NULL, def, w->start, NULL, &t, NULL);
    if (status != MORPH_OK) {
        assert_null(t.x);
        assert_null(t.time);
        assert_int_equal(t.frames, 0);
    }
    morph_trajectory_free(&t);
    return status;
}

/* Every number of the def: not a number, infinite, negative. */
static void test_refused(void **state) {
    (void)state;
    const morph_structure_def sd = morph_structure_defaults(0.1);
    world w;
    ball_world(&w, &sd, 0.1);
    w.def.time = 0.02;
    assert_int_equal(tried(&w, &w.def), MORPH_OK);
    static const double bad[] = {NAN, INFINITY, -1.0};
    for (int k = 0; k < 3; k++) {
        morph_blanket_def d[16];
        for (int n = 0; n < 16; n++)
            d[n] = w.def;
        d[0].gravity = d[1].drag = d[2].friction = d[3].time = d[4].step = d[5].rise = bad[k];
        d[6].softening = d[7].frame = d[8].rise_time = bad[k];
        d[9].velocity[1] = bad[k] < 0.0 ? NAN : bad[k];
        d[10].base = bad[k] == INFINITY ? -INFINITY : INFINITY;
        d[11].frame = 0.0;
        const morph_hand push = {0, {bad[k] < 0.0 ? NAN : bad[k], 0.0, 0.0}, 0.0, 1.0},
                         nobody = {-1, {0}, 0, 1}, window = {0, {0}, 1.0, bad[k] == INFINITY ? 0.5 : bad[k]};
        d[12].hands = &push;
        d[13].hands = &nobody;
        d[14].hands = &window;
        d[12].hand_count = d[13].hand_count = d[14].hand_count = 1;
        const morph_attractor pull = {{0.0, 0.0, 0.0}, bad[k] < 0.0 ? NAN : bad[k]};
        d[15].attractors = &pull;
        d[15].attractor_count = 1;
        for (int n = 0; n < 16; n++)
            if (tried(&w, &d[n]) != MORPH_ERR_INPUT) fail_msg("def %d with %g was taken", n, bad[k]);
        w.start[4] = bad[k];
        if (!isfinite(bad[k])) assert_int_equal(tried(&w, &w.def), MORPH_ERR_NONFINITE);
        w.start[4] = w.start[1];
    }
    free_world(&w);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_attraction), cmocka_unit_test(test_quiet), cmocka_unit_test(test_friction),
        cmocka_unit_test(test_no_range),   cmocka_unit_test(test_thin),  cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
