/* The single-link bound against the profile that it stands for, integrated, and in what a plan reports. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "planner/folder.h"
#include "planner/timing.h"
#include "planner/timing_bound.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* cmocka's own comparison rounds to float. */
static void assert_near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.17g is not %.17g within %g", a, b, tolerance);
}

/* How far a length gets in T seconds from rest to rest with three limits, by steps of jerk: up with full jerk
 * while acceleration and what is left of the rate allow it, the second half mirrored. A search of its own,
 * over the time t1 of rising jerk and t2 of constant acceleration: 2 t1 + t2 <= T/2, the rest at constant
 * rate. */
static double farthest(double T, double rate, double acceleration, double jerk) {
    enum { STEPS = 1000 };
    double best = 0.0;
    for (int i = 0; i <= STEPS; i++) {
        const double t1 = fmin(T / 4.0, acceleration / jerk) * i / STEPS;
        for (int k = 0; k <= STEPS; k++) {
            const double t2 = (T / 2.0 - 2.0 * t1) * k / STEPS, peak = jerk * t1 * (t1 + t2);
            if (peak > rate * (1.0 + 1e-12)) break;
            /* Two ramps of mean rate peak/2, and the time between them at the peak. */
            best = fmax(best, peak * (2.0 * t1 + t2) + peak * (T - 2.0 * (2.0 * t1 + t2)));
        }
    }
    return best;
}

/* In the time that the formula gives the best profile on a grid gets to the distance, but for the grid, and
 * never beyond; in one percent less it gets clearly less far. */
static void test_against_search(void **state) {
    (void)state;
    static const double limit[][3] = {
        {10.0, 10.0, 1.0}, {10.0, 0.5, 20.0}, {0.02, 2.0, 20.0}, {0.1, 0.2, 1.0}, {0.1, 2.0, 1.0}};
    static const double distance[] = {1e-6, 0.001, 0.02, 0.3, 5.0};
    for (size_t k = 0; k < sizeof limit / sizeof *limit; k++)
        for (size_t n = 0; n < sizeof distance / sizeof *distance; n++) {
            const double *l = limit[k], d = distance[n];
            const double T = morph_timing_alone(d, l[0], l[1], l[2]);
            const double far = farthest(T, l[0], l[1], l[2]);
            /* Grids of a thousandth: the best lies within a step or two of each. */
            if (!(far <= d * (1.0 + 1e-9) && far >= 0.99 * d))
                fail_msg("limits %zu, distance %g: %g s, in which %g is the farthest", k, d, T, far);
            assert_true(farthest(0.98 * T, l[0], l[1], l[2]) < 0.99 * d);
            assert_true(T == morph_timing_alone(-d, l[0], l[1], l[2]));
        }
}

/* The cases meet: at the distance where one ends, the next begins with the same time. */
static void test_cases_meet(void **state) {
    (void)state;
    const double V = 0.3, A = 0.2, J = 1.0;
    const double first = 2.0 * A * A * A / (J * J), second = V * (V / A + A / J);
    assert_true(first < second);
    for (int k = 0; k < 2; k++) {
        const double d = k ? second : first, below = morph_timing_alone(d * (1.0 - 1e-12), V, A, J),
                     above = morph_timing_alone(d * (1.0 + 1e-12), V, A, J);
        assert_near(below, above, 1e-10);
        assert_true(below <= above);
    }
    assert_near(morph_timing_alone(0.0, V, A, J), 0.0, 0.0);
    /* Jerk alone: d = J T^3 / 32. Rate alone, far: d / V and the ramps. */
    assert_near(morph_timing_alone(0.5, 1e6, 1e6, 2.0), cbrt(8.0), 1e-12);
    assert_near(morph_timing_alone(1e6, V, A, J), 1e6 / V + V / A + A / J, 1e-6);
}

enum { POSES = 12 };

typedef struct fixture {
    morph_structure *structure;
    morph_curve *curve;
} fixture;

/* Upright posts; the columns of nodes are drawn apart along x, the last ones most. `detour`: how far beyond
 * (in the share of the change) the way goes. */
static fixture make(double strain, double detour) {
    fixture out = {0};
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    assert_int_equal(morph_structure_create(&def, &out.structure), MORPH_OK);
    const int width = 3 * out.structure->joints;
    double s[POSES], *x = calloc((size_t)(POSES * width), sizeof *x);
    assert_non_null(x);
    for (int k = 0; k < POSES; k++) {
        s[k] = k / (POSES - 1.0);
        const double much = strain * (s[k] + detour * sin(acos(-1.0) * s[k]));
        for (int i = 0; i < width; i += 3) {
            memcpy(&x[k * width + i], &out.structure->start[i], 3 * sizeof *x);
            if (x[k * width + i] > 0.05) x[k * width + i] += much * def.spacing;
        }
    }
    assert_int_equal(morph_curve_create(out.structure, s, x, POSES, &out.curve), MORPH_OK);
    free(x);
    return out;
}

static void drop(fixture *f) {
    morph_curve_destroy(f->curve);
    morph_structure_destroy(f->structure);
}

/* The time of the link that changes most, whatever the way; no schedule is shorter, a straight one hardly
 * longer, one with a detour clearly. */
static void test_path(void **state) {
    (void)state;
    double seconds[2], duration[2];
    for (int k = 0; k < 2; k++) {
        fixture f = make(0.25, 0.4 * k);
        const morph_structure *s = f.structure;
        int link = -1;
        assert_int_equal(morph_timing_single_link(f.curve, &seconds[k], &link), MORPH_OK);
        assert_true(link >= 0 && link < s->links);
        assert_near(f.structure->start[3 * s->link[link][0] + 1],
                    f.structure->start[3 * s->link[link][1] + 1], 1e-12);
        assert_near(seconds[k],
                    morph_timing_alone(0.025, s->rate_limit[0], s->acceleration_limit[0], s->jerk_limit[0]),
                    1e-9);
        const morph_timing_options o = {0.0, 0.001, NULL};
        morph_timing timing;
        morph_timing_report report;
        assert_int_equal(morph_timing_solve(f.curve, &o, &timing, &report), MORPH_OK);
        duration[k] = timing.duration;
        morph_timing_free(&timing);
        drop(&f);
    }
    assert_near(seconds[0], seconds[1], 1e-9);
    assert_true(duration[0] >= seconds[0] && duration[0] < 1.02 * seconds[0]);
    assert_true(duration[1] > 1.1 * seconds[1]);
}

static void test_nothing_moves(void **state) {
    (void)state;
    fixture f = make(0.0, 0.0);
    double seconds = -1.0;
    int link = 7;
    assert_int_equal(morph_timing_single_link(f.curve, &seconds, &link), MORPH_OK);
    assert_true(seconds < 1e-3); /* rounding of lengths: 1e-17 m take some microseconds */
    assert_true(link >= -1 && link < f.structure->links);
    drop(&f);
}

/* Two lines after "duration_bounds" of summary.json, blanks taken out. */
static void reported(const morph_summary *s, char *text, size_t size) {
    char *json = NULL;
    size_t n = 0;
    assert_int_equal(morph_summary_to_json(s, &json), MORPH_OK);
    const char *at = strstr(json, "\"duration_bounds\":");
    assert_non_null(at);
    for (; *at && *at != '}' && n + 1 < size; at++)
        if (*at != ' ' && *at != '\t' && *at != '\n') text[n++] = *at;
    text[n] = '\0';
    free(json);
}

static void test_summary(void **state) {
    (void)state;
    char text[200];
    morph_summary s = {.has_plan = true, .duration = 2.0, .single_link_seconds = 1.5, .single_link = 17};
    reported(&s, text, sizeof text);
    assert_string_equal(text, "\"duration_bounds\":{\"single_link\":1.5,\"link\":17");
    s.single_link = -1;
    s.single_link_seconds = 0.0;
    reported(&s, text, sizeof text);
    assert_string_equal(text, "\"duration_bounds\":{\"single_link\":0,\"link\":null");
    s.has_plan = false;
    reported(&s, text, sizeof text);
    assert_string_equal(text, "\"duration_bounds\":{\"single_link\":null,\"link\":null");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_against_search),
                                       cmocka_unit_test(test_cases_meet), cmocka_unit_test(test_path),
                                       cmocka_unit_test(test_nothing_moves), cmocka_unit_test(test_summary)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
