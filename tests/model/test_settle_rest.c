/* Settle comes to rest: with friction over box, sphere and saddle, without where there is a rest; a named
 * reason where there is none. */
#include "settle_check.h"

static void with_friction(void **state) {
    (void)state;
    for (int target = BOX; target <= SADDLE; target++) {
        rest(4, target, 0.4, NULL, 0);
        /* Under sanitizers a minute, and the same code. */
        if (!getenv("MORPH_SANITIZE")) rest(8, target, 0.4, NULL, 0);
    }
}

/* On the box lies a part of the sheet; off the sphere it slides, to rest on the plane. */
static void without_friction(void **state) {
    (void)state;
    const double strength = 0.02 * 9.81 * 0.01 * 1.5 * sqrt(3.0); /* pulls a joint by its weight at most */
    const morph_attractor centre[2] = {{{-0.045, 0.02, 0.015}, strength}, {{0.06, -0.03, 0.015}, strength}};
    rest(4, BOX, 0.0, NULL, 0);
    if (!getenv("MORPH_SANITIZE")) rest(8, BOX, 0.0, NULL, 0);
    rest(4, SPHERE, 0.0, NULL, 0);
    rest(4, BOX, 0.0, centre, 2);
    rest(4, SPHERE, 0.0, centre, 2);
}

/* Off a sphere, or with nothing beneath at all, it falls for ever: said, long before the last step. */
static void no_rest(void **state) {
    (void)state;
    for (int target = 0; target < 2; target++) {
        scene s;
        make(&s, 4, SPHERE);
        morph_settle_def def = morph_settle_defaults();
        morph_settle *t;
        morph_settle_report r;
        assert_int_equal(morph_settle_create(s.structure, target ? s.sdf : NULL, &def, &t), MORPH_OK);
        assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
        print_message("no rest: %s, %d steps\n", morph_settle_outcome_text(r.outcome), r.steps);
        assert_int_equal(r.outcome, MORPH_SETTLE_FALLS);
        assert_true(!r.converged && !r.stable && r.steps < 300);
        morph_settle_destroy(t);
        /* The same with friction rests, and started far above it is not given up in the fall. */
        def.friction = 0.4;
        t = scene_settle(&s, &def);
        for (int i = 0; i < s.n; i++)
            s.x[i] = s.start[i] + (i % 3 == 2 ? 2.0 : 0.0);
        assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
        assert_int_equal(r.outcome, MORPH_SETTLE_RESTS);
        morph_settle_destroy(t);
        scene_free(&s);
    }
}

/* Too few steps: it still comes down. */
static void too_few_steps(void **state) {
    (void)state;
    scene s;
    make(&s, 4, SPHERE);
    morph_settle_def def = morph_settle_defaults();
    def.friction = 0.4;
    def.most_steps = 3;
    morph_settle *t = scene_settle(&s, &def);
    morph_settle_report r;
    assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
    assert_int_equal(r.outcome, MORPH_SETTLE_MOVES);
    assert_false(r.converged);
    morph_settle_destroy(t);
    scene_free(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(with_friction), cmocka_unit_test(without_friction),
                                       cmocka_unit_test(no_rest), cmocka_unit_test(too_few_steps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
