#include "planner/timing.h"
#include "planner/timing_barrier.h"
#include "planner/timing_exact.h"
#include "planner/timing_rows.h"
#include "solvers/dense.h"

#include <stdlib.h>
#include <string.h>

/* Grid points to a knot interval of w: peaks between them then stand out by a thousandth. Every third of them
 * is a site of the spline in time, whose error is then beneath that. */
enum { DENSITY = 12, EVERY = 3 };

/* Beyond so many samples a reader's curve is ours to rounding. */
static const double reader_samples = 200000.0;

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

/* The quintic rest-to-rest profile 10 x^3 - 15 x^4 + 6 x^5 in Bernstein's form: its control points are 0, 0,
 * 0, 1, 1, 1. */
static morph_status smooth_profile(morph_timing *out) {
    *out = (morph_timing){.duration = 1.0};
    const morph_status status = morph_basis_uniform(MORPH_SPLINE_ORDER, &out->basis);
    if (status != MORPH_OK) return status;
    out->control = morph_alloc(MORPH_SPLINE_ORDER, sizeof(double));
    if (!out->control) {
        morph_timing_free(out);
        return MORPH_ERR_NOMEM;
    }
    for (int i = MORPH_SPLINE_ORDER / 2; i < MORPH_SPLINE_ORDER; i++)
        out->control[i] = 1.0;
    return MORPH_OK;
}

/* w at any theta. */
static double w_at(const morph_timing_rows *rows, const double *x, double theta) {
    double value[1][MORPH_SPLINE_ORDER], w = 0.0;
    const int first = morph_basis_eval(&rows->basis, theta, 0, value);
    for (int i = 0; i < MORPH_SPLINE_ORDER; i++)
        w += value[0][i] * x[first + i];
    return w;
}

/* Time at each grid point, in units of the reference's duration: the integral of w^(-1/2) by Gauss's rule of
 * four points on every interval. */
static void integrate_time(const morph_timing_rows *rows, const double *x, double *time) {
    static const double node[2] = {0.33998104358485626, 0.86113631159405258},
                        weight[2] = {0.65214515486254614, 0.34785484513745386};
    time[0] = 0.0;
    for (int g = 0; g + 1 < rows->points; g++) {
        const double half = 0.5 * (rows->theta[g + 1] - rows->theta[g]), middle = rows->theta[g] + half;
        double sum = 0.0;
        for (int k = 0; k < 2; k++)
            for (int sign = -1; sign <= 1; sign += 2)
                sum += weight[k] / sqrt(w_at(rows, x, middle + sign * node[k] * half));
        time[g + 1] = time[g] + half * sum;
    }
}

/* Knots for s(tau) through the inner sites tau[1..count-2] with s, s', s'' given at both ends: de Boor's
 * averages of the sites with each end counted three times, as for any Hermite data. */
static void profile_knots(const double *tau, int count, morph_basis *basis) {
    const int n = basis->count;
    for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
        basis->knot[i] = 0.0;
        basis->knot[n + i] = 1.0;
    }
    for (int j = 1; j < n - MORPH_SPLINE_DEGREE; j++) {
        double sum = 0.0;
        for (int i = j; i < j + MORPH_SPLINE_DEGREE; i++)
            sum += i < 3 ? 0.0 : i - 2 >= count - 1 ? 1.0 : tau[i - 2];
        basis->knot[MORPH_SPLINE_DEGREE + j] = sum / MORPH_SPLINE_DEGREE;
    }
}

/* Control points 3 .. n - 4 by interpolation; those before are 0 and those after 1. s' = s'' = 0 at a clamped
 * end is three equal control points. */
static morph_status interpolate(const double *tau, const double *s, int count, morph_timing *out) {
    const int inner = count - 2, n = inner + 6;
    morph_status status = morph_basis_uniform(n, &out->basis);
    if (status != MORPH_OK) return status;
    profile_knots(tau, count, &out->basis);
    out->control = morph_alloc((size_t)n, sizeof(double));
    double *matrix = morph_alloc((size_t)inner * (size_t)inner, sizeof(double));
    if (!out->control || !matrix) {
        free(matrix);
        return MORPH_ERR_NOMEM;
    }
    for (int k = 0; k < inner; k++) {
        double value[1][MORPH_SPLINE_ORDER], rest = s[k + 1];
        const int first = morph_basis_eval(&out->basis, tau[k + 1], 0, value);
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
            const int unknown = first + i - 3;
            if (unknown >= inner) rest -= value[0][i];
            if (unknown >= 0 && unknown < inner)
                matrix[(size_t)k * (size_t)inner + (size_t)unknown] = value[0][i];
        }
        out->control[k + 3] = rest;
    }
    status = morph_dense_solve(matrix, inner, out->control + 3, 1);
    for (int i = 0; i < 3; i++)
        out->control[n - 1 - i] = 1.0;
    free(matrix);
    return status;
}

/* The profile of w over a reference as a spline in time; its duration is not yet stretched. */
static morph_status profile_of(const morph_timing_rows *rows, const morph_timing *reference, const double *x,
                               morph_timing *out) {
    const int count = (rows->points - 1) / EVERY + 1;
    *out = (morph_timing){0};
    double *tau = morph_alloc((size_t)rows->points, sizeof(double)),
           *s = morph_alloc((size_t)count, sizeof(double));
    morph_status status = tau && s ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        integrate_time(rows, x, tau);
        const double total = tau[rows->points - 1];
        for (int g = 0; g < count; g++) {
            double at[4];
            tau[g] = tau[g * EVERY] / total;
            morph_timing_eval(reference, rows->theta[g * EVERY] * reference->duration, at);
            s[g] = at[0];
        }
        status = interpolate(tau, s, count, out);
        out->duration = reference->duration * total;
    }
    free(tau);
    free(s);
    if (status != MORPH_OK) morph_timing_free(out);
    return status;
}

/* Solves with the rows at hand, takes in those that the result breaks, and so on: few are missing. x starts
 * and ends strictly within every limit on the grid. */
static morph_status fastest(morph_path_table *table, const morph_timing *reference, morph_timing_rows *rows,
                            const morph_control *control, double *x, morph_timing_report *report) {
    morph_status status = MORPH_OK;
    const int n = rows->basis.count;
    double mu = 1e-4;
    for (int pass = 0; pass < 6; pass++) {
        bool converged;
        int added;
        /* A tenth off every limit: the start must stand inside. */
        const double room = 0.9 * morph_timing_rows_room(rows, x);
        for (int j = 0; j < n; j++)
            x[j] = fmin(0.99 * rows->upper, fmax(1.01 * rows->lower, room * x[j]));
        status = morph_timing_barrier(rows, mu, control, x, &report->iterations, &converged);
        report->outcome = converged ? MORPH_OPTIMAL : MORPH_FEASIBLE;
        if (status != MORPH_OK) break;
        status = morph_timing_rows_extend(table, reference, rows, x, &added);
        if (status != MORPH_OK || added == 0) break;
        mu = 1e-5;
    }
    return status;
}

/* One round: the fastest w over the present profile as reference, back to a spline in time, stretched by what
 * stands between grid points. */
static morph_status improve(morph_path_table *table, const morph_timing_options *o, int controls,
                            const morph_timing *reference, morph_timing *out, morph_timing_report *report) {
    morph_timing_rows rows;
    *out = (morph_timing){0};
    morph_status status = morph_timing_rows_create(table, reference, controls, DENSITY, &rows);
    if (status != MORPH_OK) return status;
    double *x = morph_alloc((size_t)controls, sizeof(double));
    if (!x) status = MORPH_ERR_NOMEM;
    for (int j = 0; j < controls && x; j++)
        x[j] = 1.0;
    if (status == MORPH_OK) status = fastest(table, reference, &rows, o->control, x, report);
    /* After a stop x is still a profile, faster than the start as a rule. */
    if (status == MORPH_OK || status == MORPH_ERR_STOPPED) status = profile_of(&rows, reference, x, out);
    if (status == MORPH_OK) {
        double worst[3];
        morph_timing_even(table, out, 2 * rows.points, worst);
        const double planned = out->duration, stretch = morph_timing_stretch(worst);
        out->duration *= stretch;
        report->unknowns = controls;
        report->rows_used = 2 * controls + rows.points + 4 * rows.begin[rows.points];
        report->rows_possible = 2 * controls + rows.points + 4 * rows.points * rows.links;
        morph_log(o->control, "timing: %d control points, %d rows, %s: %.4f s, stretched by %.6f", controls,
                  report->rows_used, morph_outcome_text(report->outcome), planned, stretch);
    }
    morph_timing_rows_free(&rows);
    free(x);
    return status;
}

/* Each round has the best profile so far as reference; the first, coarse one only brings the knots to where
 * time is spent. A profile that is not faster is dropped. */
static morph_status rounds(morph_path_table *table, const morph_timing_options *o, morph_timing *timing,
                           morph_timing_report *report) {
    static const int controls[] = {32, 64, 64, 64};
    for (size_t k = 0; k < sizeof controls / sizeof *controls && !morph_stopped(o->control); k++) {
        morph_timing next;
        morph_progress(o->control, "timing", (double)(k + 1) / 6.0);
        const morph_status status = improve(table, o, controls[k], timing, &next, report);
        if (status != MORPH_OK) return status;
        const double gain = 1.0 - next.duration / timing->duration;
        if (gain > 0.0) {
            morph_timing_free(timing);
            *timing = next;
        } else {
            morph_timing_free(&next);
        }
        /* On a reference that is this close already, another round has gained a thousandth at most. */
        if (k > 0 && gain < 0.06) break;
    }
    return MORPH_OK;
}

/* Fine grid points to a duration: beyond 200,000 their spacing is far beneath anything the spline can hide.
 */
static int fine_steps(double samples) {
    return (int)fmin(200000.0, fmax(1000.0, MORPH_TIMING_FINE * samples));
}

/* Whole samples, at least so many; the sum of rounding in the division is far beneath 1e-9. */
static double whole_samples(double duration, double sample) {
    return fmax(1.0, ceil(duration / sample - 1e-9));
}

/* The exact stretch on a grid 10 times finer than the samples, then up to a whole number of samples; then as
 * much longer as the curve asks that a reader rebuilds from the samples. Its derivatives differ from ours by
 * the sampling error, which falls with a power of sample / duration: a few steps settle it. */
static morph_status finish(morph_path_table *table, const morph_timing_options *o, morph_timing *timing,
                           morph_timing_report *report) {
    const double planned = timing->duration;
    double worst[3], read[3];
    const int steps = fine_steps(ceil(fmax(planned, o->duration) / o->sample));
    morph_status status = morph_timing_fine(table, timing, steps, worst);
    if (status != MORPH_OK) return status;
    /* A millionth over the exact stretch: rounding of the third derivatives. */
    report->stretch = morph_timing_stretch(worst) * (1.0 + 1e-6);
    report->needed = planned * report->stretch;
    double samples = whole_samples(fmax(report->needed, o->duration), o->sample);
    for (int k = 0; k < 40; k++) {
        timing->duration = samples * o->sample;
        if (samples > reader_samples) break;
        status = morph_timing_reader(table, timing, (int)samples, read);
        const double more = morph_timing_stretch(read);
        if (status != MORPH_OK || more <= 1.0) break;
        samples = fmax(samples + 1.0, ceil(samples * fmin(2.0, more)));
        report->needed = samples * o->sample;
    }
    const double f = timing->duration / planned;
    report->worst_rate = worst[0] / f;
    report->worst_acceleration = worst[1] / (f * f);
    report->worst_jerk = worst[2] / (f * f * f);
    return status;
}

/* The quintic profile, as fast as it may be. */
static morph_status start_profile(morph_path_table *table, morph_timing *timing,
                                  morph_timing_report *report) {
    const morph_status status = smooth_profile(timing);
    if (status != MORPH_OK) return status;
    double worst[3];
    morph_timing_even(table, timing, 480, worst);
    timing->duration = morph_timing_stretch(worst);
    report->smooth_duration = timing->duration;
    report->outcome = MORPH_FEASIBLE;
    return MORPH_OK;
}

morph_status morph_timing_solve(const morph_curve *curve, const morph_timing_options *options,
                                morph_timing *timing, morph_timing_report *report) {
    const double started = morph_seconds();
    *timing = (morph_timing){0};
    *report = (morph_timing_report){0};
    morph_path_table table;
    morph_status status = morph_path_table_create(curve, &table);
    if (status == MORPH_OK) status = start_profile(&table, timing, report);
    if (status == MORPH_OK) {
        if (timing->duration > 0.0) {
            status = rounds(&table, options, timing, report);
        } else {
            /* No length changes: a thousandth of a second keeps the division finite. */
            timing->duration = 1e-3;
        }
    }
    if (status == MORPH_OK) status = finish(&table, options, timing, report);
    morph_path_table_free(&table);
    if (status != MORPH_OK) morph_timing_free(timing);
    report->seconds = morph_seconds() - started;
    return status;
}
