/* The timing stage against closed-form optima, independent differentiation and its own promises. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "planner/timing.h"
#include "planner/timing_barrier.h"
#include "planner/timing_exact.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { POSES = 25 };

/* cmocka's own comparison rounds to float. */
static void assert_near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.17g is not %.17g within %g", a, b, tolerance);
}

/* How far the grid's x and y directions are stretched at a parameter. */
typedef struct shape {
    double (*x)(double s), (*y)(double s);
} shape;

static double none(double s) {
    (void)s;
    return 0.0;
}
static double linear(double s) {
    return 0.2 * s;
}
static double third(double s) {
    return -0.07 * s;
}
/* One way only, ten times as fast at the start as at the end. */
static double slowing(double s) {
    return 0.2 * log(1.0 + 9.0 * s) / log(10.0);
}
/* A rounded corner of the path in the plane of (x, y): first x alone, then y alone; width 0.02 of the
 * parameter. */
static double ramp(double s) {
    const double width = 0.02;
    return s / width > 30.0 ? s : width * log1p(exp(s / width));
}
static double corner_x(double s) {
    return 0.2 * (s - ramp(s - 0.5));
}
static double corner_y(double s) {
    return 0.2 * ramp(s - 0.5);
}
static double wave(double s) {
    return 0.1 * sin(9.0 * s);
}
static double wave_late(double s) {
    return 0.08 * sin(7.0 * s * s + 1.0);
}

static morph_structure_def small_grid(double spacing) {
    morph_structure_def def = morph_structure_defaults(spacing);
    def.nodes[0] = def.nodes[1] = 3;
    return def;
}

typedef struct fixture {
    morph_structure *structure;
    morph_curve *curve;
} fixture;

/* Posts stand upright and move in the plane: x links have length spacing (1 + x(s)), y links likewise. */
static fixture make(const morph_structure_def *def, shape f) {
    fixture out = {0};
    assert_int_equal(morph_structure_create(def, &out.structure), MORPH_OK);
    const int width = 3 * out.structure->joints;
    double s[POSES], *x = calloc((size_t)(POSES * width), sizeof *x);
    assert_non_null(x);
    for (int k = 0; k < POSES; k++) {
        s[k] = k / (POSES - 1.0);
        for (int i = 0; i < width; i += 3) {
            const double *at = &out.structure->start[i];
            double *to = &x[k * width + i];
            to[0] = at[0] * (1.0 + f.x(s[k]));
            to[1] = at[1] * (1.0 + f.y(s[k]));
            to[2] = at[2] + s[k] * def->spacing;
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

/* Shortest time from rest to rest over a distance: up to speed v takes v/A + A/J with full acceleration
 * reached, else 2 sqrt(v/J), and covers half of v times that. */
static double ramp_time(double v, double a, double j) {
    return v >= a * a / j ? v / a + a / j : 2.0 * sqrt(v / j);
}

static double shortest(double distance, double v, double a, double j) {
    if (v * ramp_time(v, a, j) <= distance) return ramp_time(v, a, j) + distance / v;
    double lo = 0.0, hi = v;
    for (int k = 0; k < 200; k++) {
        const double middle = 0.5 * (lo + hi);
        if (middle * ramp_time(middle, a, j) < distance)
            lo = middle;
        else
            hi = middle;
    }
    return 2.0 * ramp_time(hi, a, j);
}

static double shortest_of(const morph_structure_def *d, double strain) {
    return shortest(strain * d->spacing, d->rate, d->acceleration, d->jerk);
}

/* Lengths at a time, straight from the joints. */
static void lengths_at(const fixture *f, const morph_timing *timing, double t, double *scratch, double *out) {
    double s[4];
    morph_timing_eval(timing, t, s);
    double *joints = scratch + 6 * f->structure->posts;
    morph_curve_joints(f->curve, s[0], 0, scratch, joints);
    morph_link_lengths(f->structure, joints, out);
}

/* Central differences of the lengths on a grid ten times finer than the samples. Their step is 1/2000 of the
 * duration: truncation and rounding stay beneath the allowance of one in a hundred (of five for the jerk,
 * which has corners). Returns the largest jerk ratio. */
static double hold_limits(const fixture *f, const morph_timing *timing, double sample) {
    const morph_structure *s = f->structure;
    const int links = s->links, steps = 10 * (int)lround(timing->duration / sample);
    double *scratch = calloc((size_t)(6 * s->posts + 3 * s->joints), sizeof *scratch);
    double *l = calloc((size_t)(5 * links), sizeof *l), worst[3] = {0};
    assert_non_null(scratch);
    assert_non_null(l);
    const double h = timing->duration / 2000.0;
    const int every = steps > 5000 ? steps / 5000 + 1 : 1; /* a second, not ten */
    for (int i = 0; i <= steps; i += every) {
        const double t = fmin(fmax(timing->duration * i / steps, 2.0 * h), timing->duration - 2.0 * h);
        for (int k = 0; k < 5; k++)
            lengths_at(f, timing, t + (k - 2) * h, scratch, l + k * links);
        for (int n = 0; n < links; n++) {
            const double *q = l + n, m2 = q[0], m1 = q[links], p1 = q[3 * links], p2 = q[4 * links];
            worst[0] = fmax(worst[0], fabs(p1 - m1) / (2.0 * h) / s->rate_limit[n]);
            worst[1] =
                fmax(worst[1], fabs(p1 - 2.0 * q[2 * links] + m1) / (h * h) / s->acceleration_limit[n]);
            worst[2] =
                fmax(worst[2], fabs(p2 - 2.0 * p1 + 2.0 * m1 - m2) / (2.0 * h * h * h) / s->jerk_limit[n]);
        }
    }
    assert_true(worst[0] <= 1.01);
    assert_true(worst[1] <= 1.01);
    assert_true(worst[2] <= 1.05);
    free(scratch);
    free(l);
    return worst[2];
}

/* By the chain rule, to rounding, on the same grid; and rest at both ends, and s rising. */
static void hold_exactly(const fixture *f, const morph_timing *timing, double sample) {
    morph_path_table table;
    const morph_structure *st = f->structure;
    assert_int_equal(morph_path_table_create(f->curve, &table), MORPH_OK);
    const int steps = 10 * (int)lround(timing->duration / sample);
    double before = -1.0;
    for (int i = 0; i <= steps; i++) {
        double s[4];
        morph_timing_eval(timing, timing->duration * i / steps, s);
        assert_true(s[0] > before || (i > 0 && s[0] == before));
        before = s[0];
        if (i == 0 || i == steps) {
            assert_near(s[0], i ? 1.0 : 0.0, 1e-12);
            assert_near(s[1] * timing->duration, 0.0, 1e-9);
            assert_near(s[2] * timing->duration * timing->duration, 0.0, 1e-6);
        }
        morph_path_table_exact(&table, s[0], 3);
        morph_timing_chain(st->links, table.exact, s, table.by_time);
        for (int n = 0; n < st->links; n++) {
            assert_true(fabs(table.by_time[st->links + n]) <= st->rate_limit[n] * (1.0 + 1e-9));
            assert_true(fabs(table.by_time[2 * st->links + n]) <= st->acceleration_limit[n] * (1.0 + 1e-9));
            assert_true(fabs(table.by_time[3 * st->links + n]) <= st->jerk_limit[n] * (1.0 + 1e-9));
        }
    }
    morph_path_table_free(&table);
}

static morph_timing solve(const fixture *f, double duration, double sample, morph_timing_report *report) {
    const morph_timing_options o = {duration, sample, NULL};
    morph_timing timing;
    assert_int_equal(morph_timing_solve(f->curve, &o, &timing, report), MORPH_OK);
    assert_near(timing.duration / sample, round(timing.duration / sample), 1e-6);
    assert_true(report->worst_rate <= 1.0 && report->worst_acceleration <= 1.0 && report->worst_jerk <= 1.0);
    return timing;
}

/* Solves and compares with the least possible time; prints the ratio. */
static double ratio_to(const char *name, const fixture *f, double least) {
    morph_timing_report report;
    morph_timing timing = solve(f, 0.0, 0.001, &report);
    const double ratio = timing.duration / least;
    print_message("%-28s %.4f s, at least %.4f s: ratio %.4f, %d iterations, %.3f s\n", name, timing.duration,
                  least, ratio, report.iterations, report.seconds);
    assert_true(ratio >= 1.0 - 1e-6);
    assert_true(timing.duration <= report.smooth_duration);
    hold_limits(f, &timing, 0.001);
    hold_exactly(f, &timing, 0.001);
    morph_timing_free(&timing);
    return ratio;
}

/* One direction, and several with proportional lengths (they bind no more than the one that moves most): the
 * optimum is the curve of seven segments, whatever the parameter does. 64 control points come to half a
 * percent of it. */
static void test_closed_form(void **state) {
    (void)state;
    static const struct {
        const char *name;
        double rate, acceleration, jerk; /* over the spacing */
    } regime[] = {{"jerk bound", 10.0, 10.0, 1.0},
                  {"acceleration bound", 10.0, 0.5, 20.0},
                  {"rate bound", 0.02, 2.0, 20.0},
                  {"all three", 0.1, 0.2, 1.0},
                  {"rate after jerk only", 0.1, 2.0, 1.0}};
    for (size_t k = 0; k < sizeof regime / sizeof *regime; k++) {
        morph_structure_def def = small_grid(0.1);
        def.rate = regime[k].rate * def.spacing;
        def.acceleration = regime[k].acceleration * def.spacing;
        def.jerk = regime[k].jerk * def.spacing;
        const shape shapes[] = {{linear, none}, {linear, third}, {slowing, none}};
        for (size_t n = 0; n < sizeof shapes / sizeof *shapes; n++) {
            fixture f = make(&def, shapes[n]);
            assert_true(ratio_to(regime[k].name, &f, shortest_of(&def, 0.2)) <= 1.02);
            drop(&f);
        }
    }
}

/* Around a sharp corner: no faster than the longer leg (0.1 of the spacing each), and no slower than to
 * stop in the corner. */
static void test_corner(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){corner_x, corner_y});
    const double leg = shortest_of(&def, 0.1);
    const double ratio = ratio_to("corner, to one leg", &f, leg);
    assert_true(ratio <= 2.0);
    drop(&f);
}

/* Lengths that turn back several times, by different amounts: at least the time of the widest single swing;
 * and the profile must beat the smooth one clearly. */
static void test_swings(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){wave, wave_late});
    morph_timing_report report;
    ratio_to("swings, to one swing", &f, shortest_of(&def, 0.2));
    morph_timing timing = solve(&f, 0.0, 0.001, &report);
    assert_true(timing.duration < 0.8 * report.smooth_duration);
    morph_timing_free(&timing);
    drop(&f);
}

static void test_given_duration(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){wave, third});
    morph_timing_report report;
    morph_timing timing = solve(&f, 25.0, 0.01, &report);
    assert_near(timing.duration, 25.0, 1e-12);
    assert_true(report.needed <= 25.0);
    hold_exactly(&f, &timing, 0.01);
    morph_timing_free(&timing);
    timing = solve(&f, 0.3, 0.01, &report);
    assert_true(report.needed > 0.3);
    assert_true(timing.duration >= report.needed - 1e-9 && timing.duration < report.needed + 0.0101);
    hold_exactly(&f, &timing, 0.01);
    /* What it says it needs is enough. */
    const double needed = timing.duration;
    morph_timing_free(&timing);
    timing = solve(&f, needed, 0.01, &report);
    assert_near(timing.duration, needed, 1e-9);
    assert_true(report.needed <= needed + 1e-9);
    morph_timing_free(&timing);
    drop(&f);
}

/* A rigid motion: lengths never change, one sample is enough; and nearly rigid, where only rounding moves. */
static void test_no_change(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){none, none});
    morph_timing_report report;
    morph_timing timing = solve(&f, 0.0, 0.01, &report);
    assert_true(timing.duration >= 0.01 - 1e-12 && timing.duration <= 0.5);
    double s[4];
    morph_timing_eval(&timing, timing.duration, s);
    assert_near(s[0], 1.0, 1e-12);
    morph_timing_free(&timing);
    timing = solve(&f, 2.0, 0.01, &report);
    assert_near(timing.duration, 2.0, 1e-12);
    morph_timing_free(&timing);
    drop(&f);
}

/* Limits scale with the spacing, so the duration does not depend on it. */
static void test_scales(void **state) {
    (void)state;
    double first = 0.0;
    static const double spacing[] = {0.1, 1e-4, 1e3};
    for (int k = 0; k < 3; k++) {
        const morph_structure_def def = small_grid(spacing[k]);
        fixture f = make(&def, (shape){wave, wave_late});
        morph_timing_report report;
        morph_timing timing = solve(&f, 0.0, 0.001, &report);
        if (k == 0) first = timing.duration;
        assert_near(timing.duration, first, 2.1e-3);
        morph_timing_free(&timing);
        drop(&f);
    }
}

/* Very slow and very fast drives: time scales as the limits say. */
static void test_limits_scale(void **state) {
    (void)state;
    double first = 0.0;
    static const double speed[] = {1.0, 1e-2, 1e2};
    for (int k = 0; k < 3; k++) {
        morph_structure_def def = small_grid(0.1);
        def.rate *= speed[k];
        def.acceleration *= speed[k] * speed[k];
        def.jerk *= speed[k] * speed[k] * speed[k];
        fixture f = make(&def, (shape){wave, wave_late});
        morph_timing_report report;
        morph_timing timing = solve(&f, 0.0, 1e-3 / speed[k], &report);
        if (k == 0) first = timing.duration;
        assert_near(timing.duration * speed[k], first, 2.1e-3);
        morph_timing_free(&timing);
        drop(&f);
    }
}

/* Samples so far apart that the curve through them differs from the plan's: it is slowed until that too keeps
 * the limits (by quintic Hermite interpolation, differentiated here by differences of its lengths). */
static void test_coarse_samples(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){wave, wave_late});
    const morph_structure *st = f.structure;
    morph_timing_report report;
    morph_timing timing = solve(&f, 0.0, 0.1, &report);
    morph_path_table table;
    assert_int_equal(morph_path_table_create(f.curve, &table), MORPH_OK);
    const double h = 0.1;
    double before[3] = {0};
    for (int i = 0; i <= (int)lround(timing.duration / h); i++) {
        double s[4];
        morph_timing_eval(&timing, i * h, s);
        morph_path_table_exact(&table, s[0], 3);
        morph_timing_chain(st->links, table.exact, s, table.by_time);
        const double now[3] = {table.by_time[0], table.by_time[st->links], table.by_time[2 * st->links]};
        /* The jerk of the Hermite quintic at the start, middle and end of the interval. */
        const double d = now[0] - before[0], a = h * before[1], b = h * h * before[2], c = h * now[1],
                     e = h * h * now[2];
        const double jerk[3] = {60 * d - 36 * a - 9 * b - 24 * c + 3 * e,
                                -30 * d + 15 * a + 1.5 * b + 15 * c - 1.5 * e,
                                60 * d - 24 * a - 3 * b - 36 * c + 9 * e};
        for (int k = 0; k < 3 && i > 0; k++)
            assert_true(fabs(jerk[k]) / (h * h * h) <= st->jerk_limit[0] * (1.0 + 1e-6));
        memcpy(before, now, sizeof before);
    }
    morph_path_table_free(&table);
    morph_timing_free(&timing);
    drop(&f);
}

static void test_repeats(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){corner_x, wave});
    morph_timing_report report[2];
    morph_timing a = solve(&f, 0.0, 0.001, &report[0]), b = solve(&f, 0.0, 0.001, &report[1]);
    assert_int_equal(a.basis.count, b.basis.count);
    assert_true(a.duration == b.duration);
    assert_memory_equal(a.control, b.control, (size_t)a.basis.count * sizeof *a.control);
    assert_memory_equal(a.basis.knot, b.basis.knot, (size_t)(a.basis.count + 6) * sizeof *a.basis.knot);
    assert_int_equal(report[0].iterations, report[1].iterations);
    morph_timing_free(&a);
    morph_timing_free(&b);
    drop(&f);
}

static int stop_after(void *user) {
    int *left = user;
    return (*left)-- <= 0;
}

/* Stopped anywhere, there is a profile within the limits, and more time never makes it slower. */
static void test_stop(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){wave, wave_late});
    double before = INFINITY;
    for (int n = 0; n <= 60; n += 15) {
        int left = n;
        const morph_control control = {.stop = stop_after, .user = &left};
        const morph_timing_options o = {0.0, 0.01, &control};
        morph_timing timing;
        morph_timing_report report;
        assert_int_equal(morph_timing_solve(f.curve, &o, &timing, &report), MORPH_OK);
        hold_exactly(&f, &timing, 0.01);
        assert_true(timing.duration <= before + 0.0101);
        before = timing.duration;
        morph_timing_free(&timing);
    }
    drop(&f);
}

/* The rows' formulas against the chain rule: with w(theta) = c0 + c1 theta + c2 theta^2 known, theta'' = w'/2
 * and theta''' = sqrt(w) w''/2, and M's derivatives follow from L and sigma. */
static void test_rows(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){wave, wave_late});
    morph_path_table table;
    morph_timing_report report;
    morph_timing reference = solve(&f, 3.0, 0.01, &report);
    assert_int_equal(morph_path_table_create(f.curve, &table), MORPH_OK);
    morph_timing_rows rows;
    assert_int_equal(morph_timing_rows_create(&table, &reference, 12, 3, &rows), MORPH_OK);
    const double c[3] = {0.8, 0.7, -0.4}, D = reference.duration;
    const morph_structure *st = f.structure;
    for (int g = 0; g < rows.points; g++) {
        const double th = rows.theta[g],
                     w[3] = {c[0] + c[1] * th + c[2] * th * th, c[1] + 2 * c[2] * th, 2 * c[2]};
        const double q[4] = {th, sqrt(w[0]) / D, 0.5 * w[1] / (D * D), 0.5 * sqrt(w[0]) * w[2] / (D * D * D)};
        double sigma[4], s[4];
        morph_timing_eval(&reference, th * D, sigma);
        for (int k = 0; k < 4; k++)
            sigma[k] *= pow(D, k);
        morph_timing_chain(1, sigma, q, s);
        morph_path_table_exact(&table, sigma[0], 3);
        morph_timing_chain(st->links, table.exact, s, table.by_time);
        double most[3] = {0}, row[3] = {sqrt(rows.rate[g] * w[0]), 0.0, 0.0};
        for (int n = 0; n < st->links; n++) {
            most[0] = fmax(most[0], fabs(table.by_time[st->links + n]) / st->rate_limit[n]);
            most[1] = fmax(most[1], fabs(table.by_time[2 * st->links + n]) / st->acceleration_limit[n]);
            most[2] = fmax(most[2], fabs(table.by_time[3 * st->links + n]) / st->jerk_limit[n]);
        }
        for (int n = rows.begin[g]; n < rows.begin[g + 1]; n++) {
            const double *k = rows.link[n];
            row[1] = fmax(row[1], fabs(k[0] * w[0] + k[1] * w[1]));
            row[2] = fmax(row[2], fabs(k[2] * w[0] + k[3] * w[1] + k[4] * w[2]) * sqrt(w[0]));
        }
        /* x and y links only: every corner is kept. */
        for (int k = 0; k < 3; k++)
            assert_near(row[k], most[k], 1e-9 * (1.0 + most[k]));
    }
    morph_timing_rows_free(&rows);
    morph_path_table_free(&table);
    morph_timing_free(&reference);
    drop(&f);
}

/* The merit's gradient against central differences, inside the rows and with a large mu, so that every row
 * counts; and INFINITY outside. */
static void test_merit(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    fixture f = make(&def, (shape){wave, wave_late});
    morph_path_table table;
    morph_timing_report report;
    morph_timing reference = solve(&f, 4.0, 0.01, &report);
    assert_int_equal(morph_path_table_create(f.curve, &table), MORPH_OK);
    morph_timing_rows rows;
    assert_int_equal(morph_timing_rows_create(&table, &reference, 12, 5, &rows), MORPH_OK);
    enum { N = 12 };
    double x[N], gradient[N], other[N], value, left, right;
    for (int i = 0; i < N; i++)
        x[i] = 1.0 + 0.02 * sin(1.7 * i);
    const double room = 0.8 * morph_timing_rows_room(&rows, x);
    for (int i = 0; i < N; i++)
        x[i] *= room;
    const double mu = 0.01, h = 1e-6;
    assert_int_equal(morph_timing_merit(&rows, mu, x, &value, gradient), MORPH_OK);
    assert_true(isfinite(value));
    for (int i = 0; i < N; i++) {
        const double at = x[i];
        x[i] = at - h;
        morph_timing_merit(&rows, mu, x, &left, other);
        x[i] = at + h;
        morph_timing_merit(&rows, mu, x, &right, other);
        x[i] = at;
        assert_near(gradient[i], (right - left) / (2.0 * h), 1e-6 * (1.0 + fabs(gradient[i])));
    }
    for (int i = 0; i < N; i++)
        x[i] /= 0.79;
    morph_timing_merit(&rows, mu, x, &value, gradient);
    assert_true(isinf(value));
    morph_timing_rows_free(&rows);
    morph_path_table_free(&table);
    morph_timing_free(&reference);
    drop(&f);
}

/* Posts that tilt and a grid that bends: many links with different lengths. At least one limit is used up all
 * but for the last sample: otherwise the schedule wastes time. */
static void test_bent(void **state) {
    (void)state;
    enum { BENT = 8 };
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    fixture f = {0};
    assert_int_equal(morph_structure_create(&def, &f.structure), MORPH_OK);
    const int width = 3 * f.structure->joints;
    double s[BENT], *x = calloc((size_t)(BENT * width), sizeof *x);
    assert_non_null(x);
    for (int k = 0; k < BENT; k++) {
        s[k] = k / (BENT - 1.0);
        for (int i = 0; i < width; i += 3) {
            const double *at = &f.structure->start[i];
            const double bend = 8.0 * s[k] * s[k] * (at[0] * at[0] - 0.5 * at[1] * at[0]);
            x[k * width + i] = at[0] * (1.0 + 0.1 * s[k]);
            x[k * width + i + 1] = at[1] - 0.2 * bend * s[k];
            x[k * width + i + 2] = at[2] - bend;
        }
    }
    assert_int_equal(morph_curve_create(f.structure, s, x, BENT, &f.curve), MORPH_OK);
    free(x);
    morph_timing_report report;
    morph_timing timing = solve(&f, 0.0, 0.001, &report);
    const double used = fmax(report.worst_rate, fmax(report.worst_acceleration, report.worst_jerk));
    assert_true(used > 0.99);
    assert_true(timing.duration < report.smooth_duration);
    hold_limits(&f, &timing, 0.001);
    hold_exactly(&f, &timing, 0.001);
    morph_timing_free(&timing);
    drop(&f);
}

/* The screened fine grid finds what the complete one finds, to the bit: its coarse times are fine ones too.
 */
static void test_fine_grid(void **state) {
    (void)state;
    const morph_structure_def def = small_grid(0.1);
    const shape shapes[] = {{wave, wave_late}, {corner_x, corner_y}, {linear, third}, {slowing, none}};
    for (size_t n = 0; n < sizeof shapes / sizeof *shapes; n++) {
        fixture f = make(&def, shapes[n]);
        morph_path_table table;
        morph_timing_report report;
        morph_timing timing = solve(&f, 0.0, 0.001, &report);
        assert_int_equal(morph_path_table_create(f.curve, &table), MORPH_OK);
        double screened[3], complete[3];
        for (int steps = 5000; steps <= 45000; steps += 20003) {
            assert_int_equal(morph_timing_fine(&table, &timing, steps, screened), MORPH_OK);
            morph_timing_even(&table, &timing, steps, complete);
            for (int k = 0; k < 3; k++)
                assert_true(screened[k] == complete[k]);
        }
        morph_path_table_free(&table);
        morph_timing_free(&timing);
        drop(&f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_form),  cmocka_unit_test(test_corner),
        cmocka_unit_test(test_swings),       cmocka_unit_test(test_given_duration),
        cmocka_unit_test(test_no_change),    cmocka_unit_test(test_scales),
        cmocka_unit_test(test_limits_scale), cmocka_unit_test(test_coarse_samples),
        cmocka_unit_test(test_repeats),      cmocka_unit_test(test_stop),
        cmocka_unit_test(test_rows),         cmocka_unit_test(test_merit),
        cmocka_unit_test(test_bent),         cmocka_unit_test(test_fine_grid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
