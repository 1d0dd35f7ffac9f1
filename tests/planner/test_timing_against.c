/* Which limits a schedule's length is laid to, on motions whose fastest profile is known. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "planner/timing_against.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { POSES = 9, NODES = 3 };

typedef struct motion {
    double x, y; /* stretch of all x links and of all y links along the path */
} motion;

/* The text for a duration of `share` of the shortest. limits: rate, acceleration, jerk over the spacing. */
static void explain(motion m, const double limits[3], double share, char *text, size_t size,
                    double *duration) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = NODES;
    def.rate = limits[0] * def.spacing;
    def.acceleration = limits[1] * def.spacing;
    def.jerk = limits[2] * def.spacing;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    const int width = 3 * s->joints;
    double parameter[POSES], *x = calloc((size_t)(POSES * width), sizeof *x);
    assert_non_null(x);
    for (int k = 0; k < POSES; k++) {
        parameter[k] = k / (POSES - 1.0);
        for (int i = 0; i < width; i++)
            x[k * width + i] = s->start[i] * (1.0 + parameter[k] * (i % 3 == 0   ? m.x
                                                                    : i % 3 == 1 ? m.y
                                                                                 : 0.0));
    }
    morph_curve *curve = NULL;
    assert_int_equal(morph_curve_create(s, parameter, x, POSES, &curve), MORPH_OK);
    const morph_timing_options o = {0.0, 0.01, NULL};
    morph_timing timing;
    morph_timing_report report;
    assert_int_equal(morph_timing_solve(curve, &o, &timing, &report), MORPH_OK);
    *duration = timing.duration;
    assert_int_equal(morph_timing_against(curve, &timing, share * timing.duration, text, size), MORPH_OK);
    morph_timing_free(&timing);
    morph_curve_destroy(curve);
    morph_structure_destroy(s);
    free(x);
}

static void has(const char *text, const char *what) {
    if (!strstr(text, what)) fail_msg("\"%s\" is not in \"%s\"", what, text);
}
static void lacks(const char *text, const char *what) {
    if (strstr(text, what)) fail_msg("\"%s\" is in \"%s\"", what, text);
}

/* One limit far below what the others would ask for: it alone is named. Run twice as fast its value is 2, 4
 * or 8 times the limit that it stands at, so 1, 3 or 7 times the limit too much. */
static void test_one_limit(void **state) {
    (void)state;
    static const struct {
        double limits[3], beyond; /* of the limit */
        const char *kind, *others[2];
    } each[3] = {{{0.02, 20.0, 2000.0}, 1.0, "rate of link ", {"acceleration", "jerk"}},
                 {{10.0, 0.02, 200.0}, 3.0, "acceleration of link ", {"rate", "jerk"}},
                 {{10.0, 10.0, 0.02}, 7.0, "jerk of link ", {"rate", "acceleration"}}};
    for (int k = 0; k < 3; k++) {
        char text[400], *amount;
        double duration, beyond, at;
        explain((motion){0.2, 0.0}, each[k].limits, 0.5, text, sizeof text, &duration);
        assert_ptr_equal(strstr(text, each[k].kind), text);
        lacks(text, each[k].others[0]);
        lacks(text, each[k].others[1]);
        amount = strstr(text, " at ");
        assert_non_null(amount);
        assert_int_equal(sscanf(amount, " at %lf s (%lf", &at, &beyond), 2);
        assert_true(at > 0.0 && at < duration);
        /* Three digits are printed; 64 control points reach their limit to a hundredth. */
        const double limit = each[k].limits[k] * 0.1;
        assert_true(fabs(beyond / limit - each[k].beyond) < 0.05 * each[k].beyond);
    }
}

/* The link that has the longest way holds up all the others. */
static void test_element(void **state) {
    (void)state;
    static const double limits[3] = {0.02, 20.0, 2000.0};
    char text[400];
    double duration;
    explain((motion){0.1, 0.2}, limits, 0.9, text, sizeof text, &duration);
    has(text, "rate of link 1 (0,0)-(0,1) bottom");
    explain((motion){0.2, 0.1}, limits, 0.9, text, sizeof text, &duration);
    has(text, "rate of link 0 (0,0)-(1,0) bottom");
}

/* Where two limits share the time both are named, the one with more of it first: at rate V for a way D, with
 * ramps of V / A each, T = D / V + V / A (jerk is no limit): t_V = D / V - V / A, t_A = V / A. */
static void test_order(void **state) {
    (void)state;
    /* In spacings: D = 0.2, V = 0.2: D / V = 1 s; A = 0.3 leaves t_V = 0.33, t_A = 0.67 and A = 0.8 t_V =
     * 0.75, t_A = 0.25. */
    static const double gentle[3] = {0.2, 0.3, 300.0}, brisk[3] = {0.2, 0.8, 800.0};
    char text[400];
    double duration;
    explain((motion){0.2, 0.0}, gentle, 0.9, text, sizeof text, &duration);
    assert_ptr_equal(strstr(text, "acceleration of link "), text);
    has(text, ", rate of link ");
    explain((motion){0.2, 0.0}, brisk, 0.9, text, sizeof text, &duration);
    assert_ptr_equal(strstr(text, "rate of link "), text);
    has(text, ", acceleration of link ");
}

/* Nothing moves: nothing stands against it. A small buffer is cut, not overrun. */
static void test_ends(void **state) {
    (void)state;
    static const double limits[3] = {0.02, 20.0, 2000.0};
    char text[400], small[12];
    double duration;
    memset(text, 'x', sizeof text - 1);
    explain((motion){0.0, 0.0}, limits, 0.5, text, sizeof text, &duration);
    assert_string_equal(text, "");
    explain((motion){0.2, 0.0}, limits, 0.5, small, sizeof small, &duration);
    assert_string_equal(small, "rate of lin");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_one_limit), cmocka_unit_test(test_element),
                                       cmocka_unit_test(test_order), cmocka_unit_test(test_ends)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
