/* The blanket far from its usual numbers: stiffness, mass, size, step. Each run is short, and every recorded
 * frame keeps lengths, posts and clearance. */
#include "tests/extremes/extreme_scene.h"

/* A ball of 0.9 spacings whose top is at z = 0, under a sheet a fiftieth of a spacing above its link's radius
 * that is on its way down. */
static void ball_world(world *w, const morph_structure_def *def) {
    make_sphere(2);
    scale_made(0.9 * def->spacing, -0.9 * def->spacing);
    make_world(w, def, true, 0.06, 0.125);
    w->def.velocity[2] = -0.5 * sqrt(9.81 * def->spacing);
}

/* Stretches the start by a twentieth: the springs let go of what they store. */
static void strain(world *w) {
    for (int i = 0; i < 3 * w->s->joints; i++)
        if (i % 3 != 2) w->start[i] *= 1.05;
}

/* Short: some hundred swings of the stiffest mode, or what falling four spacings takes, whichever is less. */
static void set_time(world *w) {
    const morph_structure_def *d = &w->s->def;
    const double fall = sqrt(d->spacing / 9.81), stiff = sqrt(d->mass / (12.0 * d->stiffness));
    w->def.time = fmin(4.0 * fall, 1000.0 * stiff);
    w->def.frame = w->def.time / 20.0;
}

static void test_stiffness(void **state) {
    (void)state;
    for (int e = 0; e <= 8; e++)
        for (int strained = 0; strained < 2; strained++) {
            morph_structure_def def = morph_structure_defaults(0.1);
            def.stiffness = pow(10.0, e);
            world w;
            ball_world(&w, &def);
            set_time(&w);
            if (strained) strain(&w);
            char name[64];
            snprintf(name, sizeof name, "stiffness 1e%d N/m%s", e, strained ? ", strained" : "");
            const figures f = run_world(&w, name);
            expect_within(&f);
            free_world(&w);
        }
}

static void test_mass(void **state) {
    (void)state;
    for (int e = -6; e <= 3; e++) {
        morph_structure_def def = morph_structure_defaults(0.1);
        def.mass = pow(10.0, e);
        world w;
        ball_world(&w, &def);
        set_time(&w);
        strain(&w);
        char name[64];
        snprintf(name, sizeof name, "mass 1e%d kg", e);
        const figures f = run_world(&w, name);
        expect_within(&f);
        free_world(&w);
    }
}

/* Everything is scaled with the spacing and time with its square root: the strain under the own weight stays
 * (stiffness as 1 / spacing), and the trajectory is the same picture. */
static void test_spacing(void **state) {
    (void)state;
    for (int e = -6; e <= 3; e++)
        for (int scaled = 0; scaled < 2; scaled++) {
            const double a = pow(10.0, e);
            morph_structure_def def = morph_structure_defaults(a);
            if (scaled) {
                def.stiffness *= 0.1 / a;
                def.damping *= sqrt(0.1 / a);
            }
            world w;
            ball_world(&w, &def);
            set_time(&w);
            if (scaled) w.def.drag *= sqrt(0.1 / a);
            char name[64];
            snprintf(name, sizeof name, "spacing 1e%d m%s", e, scaled ? ", springs scaled" : "");
            const figures f = run_world(&w, name);
            expect_within(&f);
            free_world(&w);
        }
}

/* From far below what is stable to far above: too long a step is cut. */
static void test_steps(void **state) {
    (void)state;
    static const double steps[] = {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 100.0};
    for (int n = 0; n < 9; n++) {
        const morph_structure_def def = morph_structure_defaults(0.1);
        world w;
        ball_world(&w, &def);
        strain(&w);
        w.def.step = steps[n];
        w.def.time = fmin(0.5, 4e3 * steps[n]);
        w.def.frame = w.def.time / 10.0;
        char name[64];
        snprintf(name, sizeof name, "step %.0e s", steps[n]);
        const figures f = run_world(&w, name);
        expect_within(&f);
        /* What 5 % strain and a fall of half a second can give. */
        assert_true(f.fastest < 10.0);
        free_world(&w);
    }
}

/* More than a million steps a frame is a mistake, said at once. */
static void test_steps_refused(void **state) {
    (void)state;
    morph_structure_def def = morph_structure_defaults(0.1);
    def.stiffness = 1e8;
    def.mass = 1e-6;
    world w;
    ball_world(&w, &def);
    w.def.time = w.def.frame = 0.1;
    morph_trajectory t;
    assert_int_equal(morph_blanket_run(w.s, w.sdf, w.exact, &w.def, w.start, NULL, &t, NULL),
                     MORPH_ERR_INPUT);
    assert_null(t.x);
    free_world(&w);
    def = morph_structure_defaults(0.1);
    ball_world(&w, &def);
    w.def.step = 1e-9;
    assert_int_equal(morph_blanket_run(w.s, w.sdf, w.exact, &w.def, w.start, NULL, &t, NULL),
                     MORPH_ERR_INPUT);
    assert_null(t.x);
    free_world(&w);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stiffness),     cmocka_unit_test(test_mass),
        cmocka_unit_test(test_spacing),       cmocka_unit_test(test_steps),
        cmocka_unit_test(test_steps_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
