#include "planner/timing.h"
#include "planner/timing_rows.h"

#include <stdlib.h>
#include <string.h>

enum { CONTROLS = 30, GRID = 120 };

void morph_timing_free(morph_timing *t) {
    morph_basis_free(&t->basis);
    free(t->control);
    *t = (morph_timing){0};
}

void morph_timing_eval(const morph_timing *timing, double t, double s[4]) {
    double value[4][MORPH_SPLINE_ORDER];
    const int first = morph_basis_eval(&timing->basis, t / timing->duration, 3, value);
    double scale = 1.0;
    for (int d = 0; d < 4; d++, scale /= timing->duration) {
        s[d] = 0.0;
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++)
            s[d] += value[d][i] * timing->control[first + i];
        s[d] *= scale;
    }
}

void morph_timing_chain(int links, const double *by_s, const double s[4], double *by_t) {
    const double *l0 = by_s, *l1 = by_s + links, *l2 = by_s + 2 * links, *l3 = by_s + 3 * links;
    for (int l = 0; l < links; l++) {
        by_t[l] = l0[l];
        by_t[links + l] = l1[l] * s[1];
        by_t[2 * links + l] = l2[l] * s[1] * s[1] + l1[l] * s[2];
        by_t[3 * links + l] = l3[l] * s[1] * s[1] * s[1] + 3.0 * l2[l] * s[1] * s[2] + l1[l] * s[3];
    }
}

/* Worst ratios of rate, acceleration and jerk to their limits at one time, with the timing's duration. */
static void ratios_at(morph_path_table *table, const morph_timing *timing, double t, double worst[3]) {
    double s[4];
    const morph_structure *st = table->curve->structure;
    morph_timing_eval(timing, t, s);
    morph_path_table_exact(table, s[0], 3);
    morph_timing_chain(st->links, table->exact, s, table->by_time);
    const double *limit[3] = {st->rate_limit, st->acceleration_limit, st->jerk_limit};
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < st->links; l++)
            worst[k] = fmax(worst[k], fabs(table->by_time[(k + 1) * st->links + l]) / limit[k][l]);
}

static double needed_stretch(const double worst[3]) {
    return fmax(worst[0], fmax(sqrt(worst[1]), cbrt(worst[2])));
}

static double stretch_on_grid(morph_path_table *table, const morph_timing *timing, int steps,
                              double worst[3]) {
    worst[0] = worst[1] = worst[2] = 0.0;
    for (int i = 0; i <= steps; i++)
        ratios_at(table, timing, timing->duration * i / steps, worst);
    return needed_stretch(worst);
}

/* Control points of the quintic rest-to-rest profile 10 x^3 - 15 x^4 + 6 x^5: a quintic, so the spline holds
 * it exactly; its control points are its blossom at five successive inner knots, and the blossom of x^p is
 * the elementary symmetric polynomial of degree p over C(5, p). */
static void smooth_controls(const morph_basis *b, double *control) {
    for (int j = 0; j < b->count; j++) {
        double e[MORPH_SPLINE_ORDER] = {1.0};
        for (int k = 1; k <= MORPH_SPLINE_DEGREE; k++)
            for (int p = k; p > 0; p--)
                e[p] += e[p - 1] * b->knot[j + k];
        control[j] = 10.0 * e[3] / 10.0 - 15.0 * e[4] / 5.0 + 6.0 * e[5];
    }
}

static morph_status start_profile(morph_path_table *table, morph_timing *timing, double *smooth) {
    morph_status status = morph_basis_uniform(CONTROLS, &timing->basis);
    if (status != MORPH_OK) return status;
    timing->control = morph_alloc(CONTROLS, sizeof(double));
    if (!timing->control) return MORPH_ERR_NOMEM;
    smooth_controls(&timing->basis, timing->control);
    timing->duration = 1.0;
    double worst[3];
    timing->duration = stretch_on_grid(table, timing, 4 * GRID, worst);
    /* A path on which no length changes needs no time: one second keeps the division finite. */
    if (!(timing->duration > 0.0)) timing->duration = 1e-3;
    *smooth = timing->duration;
    return MORPH_OK;
}

/* One NLP over control points and u with the rows that stand near their limits at the present profile. */
static morph_status improve(morph_path_table *table, const morph_timing_options *o, morph_timing *timing,
                            morph_timing_report *report) {
    morph_timing_rows rows;
    morph_status status = morph_timing_rows_create(table, timing, GRID, &rows);
    double *x = morph_alloc((size_t)CONTROLS + 1, sizeof(double));
    double *lower = morph_alloc((size_t)CONTROLS + 1, sizeof(double));
    double *upper = morph_alloc((size_t)CONTROLS + 1, sizeof(double));
    if (status == MORPH_OK && (!x || !lower || !upper)) status = MORPH_ERR_NOMEM;
    morph_nlp *nlp = NULL;
    morph_nlp_result result = {0};
    if (status == MORPH_OK) {
        for (int j = 0; j < CONTROLS; j++) {
            x[j] = timing->control[j];
            /* s = s' = s'' = 0 at an end of a clamped spline: its three outer control points are equal. */
            lower[j] = j >= CONTROLS - 3 ? 1.0 : 0.0;
            upper[j] = j < 3 ? 0.0 : 1.0;
        }
        x[CONTROLS] = 1.0; /* u in units of the present one */
        lower[CONTROLS] = 0.1;
        upper[CONTROLS] = 100.0;
        char message[256] = "";
        morph_block blocks[3];
        const int count = morph_timing_rows_blocks(&rows, blocks);
        status =
            morph_nlp_create(CONTROLS + 1, x, lower, upper, blocks, count, message, sizeof message, &nlp);
    }
    if (status == MORPH_OK) {
        morph_nlp_options n = morph_nlp_defaults();
        /* 1e-5 of the duration is far beneath a sample. */
        n.tolerance = 1e-5;
        n.max_iterations = 200;
        n.control = o->control;
        status = morph_nlp_solve(nlp, x, &n, &result);
    }
    if (status == MORPH_OK) {
        report->iterations += result.iterations;
        report->unknowns = result.unknowns;
        report->rows_used = result.rows;
        report->linear_seconds += result.linear_seconds;
        report->outcome = result.outcome;
        memcpy(timing->control, result.x, CONTROLS * sizeof *x);
        timing->duration /= result.x[CONTROLS];
    }
    morph_nlp_result_free(&result);
    morph_nlp_destroy(nlp);
    morph_timing_rows_free(&rows);
    free(x);
    free(lower);
    free(upper);
    return status;
}

/* Rounds: rows are chosen at the profile of the round before; the best profile (after its own exact stretch)
 * is kept. */
static morph_status rounds(morph_path_table *table, const morph_timing_options *o, morph_timing *timing,
                           morph_timing_report *report) {
    double *best = morph_alloc(CONTROLS, sizeof(double));
    if (!best) return MORPH_ERR_NOMEM;
    memcpy(best, timing->control, CONTROLS * sizeof *best);
    double shortest = timing->duration;
    morph_status status = MORPH_OK;
    for (int round = 0; round < 6 && status == MORPH_OK; round++) {
        const double before = timing->duration;
        status = improve(table, o, timing, report);
        if (status != MORPH_OK) break;
        double worst[3];
        const double stretch = stretch_on_grid(table, timing, 4 * GRID, worst);
        timing->duration *= stretch;
        morph_log(o->control, "timing: round %d: %s, %.4f s (stretch %.6f, rows %d)", round + 1,
                  morph_outcome_text(report->outcome), timing->duration, stretch, report->rows_used);
        const bool gained = timing->duration < (1.0 - 1e-3) * shortest;
        if (timing->duration < shortest) {
            shortest = timing->duration;
            memcpy(best, timing->control, CONTROLS * sizeof *best);
        }
        if (!gained && timing->duration < 1.02 * before) break;
        if (morph_stopped(o->control)) break;
    }
    memcpy(timing->control, best, CONTROLS * sizeof *best);
    timing->duration = shortest;
    free(best);
    return status;
}

/* The exact stretch on a grid 10 times finer than the samples, then up to a whole number of samples. The
 * reader of a schedule rebuilds the curve from samples of length, rate and acceleration: its third derivative
 * differs from ours by the sampling error, of order sample^2 times the fifth derivative; a thousandth of the
 * jerk limit (a three-thousandth of the duration) covers it. */
static void finish(morph_path_table *table, const morph_timing_options *o, morph_timing *timing,
                   morph_timing_report *report) {
    const double safety = 1.0 + 5e-4;
    double worst[3];
    const double estimate = fmax(timing->duration, o->duration) / o->sample;
    /* Beyond 200,000 points the spacing is far beneath anything the spline can hide. */
    const int steps = (int)fmin(200000.0, fmax(1000.0, 10.0 * ceil(estimate)));
    report->stretch = stretch_on_grid(table, timing, steps, worst) * safety;
    report->needed = timing->duration * report->stretch;
    const double wanted = fmax(report->needed, o->duration);
    const double samples = fmax(1.0, ceil(wanted / o->sample - 1e-9));
    /* Stretching by f divides rates by f, accelerations by f^2, jerks by f^3 at the same points: no second
     * pass. */
    const double f = samples * o->sample / timing->duration;
    timing->duration = samples * o->sample;
    report->worst_rate = worst[0] / f;
    report->worst_acceleration = worst[1] / (f * f);
    report->worst_jerk = worst[2] / (f * f * f);
}

morph_status morph_timing_solve(const morph_curve *curve, const morph_timing_options *options,
                                morph_timing *timing, morph_timing_report *report) {
    const double started = morph_seconds();
    *timing = (morph_timing){0};
    *report = (morph_timing_report){.rows_possible = 3 * curve->structure->links * (GRID + 1)};
    morph_path_table table;
    morph_status status = morph_path_table_create(curve, &table);
    if (status == MORPH_OK) status = start_profile(&table, timing, &report->smooth_duration);
    if (status == MORPH_OK) status = rounds(&table, options, timing, report);
    if (status == MORPH_OK) finish(&table, options, timing, report);
    morph_path_table_free(&table);
    if (status != MORPH_OK) morph_timing_free(timing);
    report->seconds = morph_seconds() - started;
    return status;
}
