/* A schedule of lengths alone, as a CSV holds it: decimal numbers of some digits, no derivatives.
 *
 * Divided differences of the samples are weighted means of the derivative over the samples they span:
 *   (L1 - L0) / H, (L2 - 2 L1 + L0) / H^2, (L3 - 3 L2 + 3 L1 - L0) / H^3    for any spacing H = m h.
 * A mean is never above the largest value, so there is no truncation error to allow for: a difference beyond
 * its limit proves that the limit is broken. Rounding of the samples by at most q each adds 2 q / H, 4 q /
 * H^2 and 8 q / H^3: at nine digits and a step of 1 ms the third would drown every jerk limit, so differences
 * are also taken over m = 2, 4, 8 ... steps, where rounding fades quickly and the mean is over a longer time.
 * A margin is judged at the m that says most: where the excess over limit and rounding is largest. What short
 * breaches this cannot see is below rounding in the table itself. */
#include "planner/check_parts.h"

#include <float.h>
#include <stdlib.h>

typedef struct table {
    const morph_record *r;
    const double *length;
    int samples;
    double h, rounding; /* s, m */
} table;

/* Largest rounding error of the samples: half a unit of the last decimal place that the table uses, found as
 * the least number of places (from nine digits on) that reproduces every number to double precision. A table
 * written with fewer digits than the nine of the contract gets the allowance of nine, not more. */
static double rounding_of(const double *length, size_t n) {
    double longest = 0;
    for (size_t i = 0; i < n; i++)
        longest = fmax(longest, fabs(length[i]));
    const double floor_of = 4 * DBL_EPSILON * longest; /* of lengths computed from positions */
    if (longest == 0) return 0;
    const int nine = 8 - (int)floor(log10(longest)); /* places of the ninth digit of the longest */
    for (int places = nine; places < nine + 8; places++) {
        const double unit = pow(10, -places);
        bool all = true;
        for (size_t i = 0; i < n && all; i++)
            all = fabs(length[i] - unit * round(length[i] / unit)) <= floor_of;
        if (all) return 0.5 * unit + floor_of;
    }
    return floor_of;
}

static double at(const table *t, int k, int link) {
    return t->length[(size_t)k * (size_t)t->r->links + (size_t)link];
}

/* The difference of given order over steps of m samples from sample k, divided by H^order. */
static double difference(const table *t, int order, int m, int k, int link) {
    const double l0 = at(t, k, link), l1 = at(t, k + m, link), H = m * t->h;
    if (order == 1) return (l1 - l0) / H;
    const double l2 = at(t, k + 2 * m, link);
    if (order == 2) return (l2 - 2 * l1 + l0) / (H * H);
    return (at(t, k + 3 * m, link) - 3 * l2 + 3 * l1 - l0) / (H * H * H);
}

/* Of all m the one with the least margin after its rounding counts; `worst` is then without the rounding, and
 * the rounding is the tolerance. */
static void test_order(const table *t, int order, const double *limit, morph_finding *out) {
    double least = INFINITY;
    for (int m = 1; order * m < t->samples && m <= 1024; m *= 2) {
        const double H = m * t->h;
        const double rounding = ldexp(t->rounding, order) / pow(H, order);
        morph_finding f;
        morph_finding_begin(&f, rounding, 1);
        for (int k = 0; k + order * m < t->samples; k++)
            for (int link = 0; link < t->r->links; link++)
                morph_finding_note(&f, limit[link] - fabs(difference(t, order, m, k, link)),
                                   t->h * (k + 0.5 * order * m), morph_element_of(MORPH_ELEMENT_LINK, link),
                                   morph_no_element());
        /* 1e-9 of the limit: the rounding of the division and of even times. */
        f.tolerance += 1e-9 * limit[f.a.index];
        f.scale = limit[f.a.index];
        if (f.worst + f.tolerance >= least) continue;
        least = f.worst + f.tolerance;
        *out = f;
    }
}

/* At the samples; between them a length can go on by at most acceleration h^2 / 8, 25 nm at the default
 * limits and 1 ms, which a table without derivatives cannot show. */
static void test_lengths(const table *t, morph_finding *f) {
    morph_finding_begin(f, t->rounding + 1e-9 * t->r->spacing, t->r->spacing);
    for (int k = 0; k < t->samples; k++)
        for (int link = 0; link < t->r->links; link++) {
            const double length = at(t, k, link), *limit = t->r->length_limit[link];
            morph_finding_note(f, fmin(length - limit[0], limit[1] - length), t->h * k,
                               morph_element_of(MORPH_ELEMENT_LINK, link), morph_no_element());
        }
}

/* From rest, |L(h) - L(0)| <= jerk h^3 / 6; and likewise at the end. 2 q for the rounding of both. */
static void test_rest(const table *t, morph_findings *f) {
    for (int end = 0; end < 2; end++)
        for (int link = 0; link < t->r->links; link++) {
            const int k = end ? t->samples - 2 : 0;
            const double moved = fabs(at(t, k + 1, link) - at(t, k, link)), h = t->h;
            if (moved <= t->r->jerk_limit[link] * h * h * h / 6 + 2 * t->rounding) continue;
            char name[96];
            morph_record_link_name(t->r, link, name, sizeof name);
            morph_findings_defect(f, "%s is not at rest at the %s: it moves %.3g m in the %s step", name,
                                  end ? "end" : "start", moved, end ? "last" : "first");
            return;
        }
}

/* Lengths of the record at time t (links): from its joints at a sample, along its curves between samples, at
 * rest before and after. Times within `near` of a sample are that sample. */
static void record_lengths(const morph_record *r, double t, double near, double *length) {
    const double h = morph_check_step(r->time, r->samples);
    const int last = r->samples - 1;
    int k = t <= 0 ? 0 : t / h >= last ? last : (int)(t / h);
    double u = fmin(fmax(t / h - k, 0), 1);
    if (u * h <= near) u = 0;
    if (k < last && (1 - u) * h <= near) {
        k++;
        u = 0;
    }
    if (k < last && u > 0) {
        morph_check_curve_lengths(r, k, u, length);
        return;
    }
    const double *x = r->schedule_joints + 3 * (size_t)k * (size_t)r->joints;
    for (int i = 0; i < r->links; i++)
        length[i] = morph_dist(x + 3 * (size_t)r->link[i][0], x + 3 * (size_t)r->link[i][1]);
}

static void compare_row(const table *t, int k, const double *own, morph_finding *m) {
    for (int link = 0; link < t->r->links; link++)
        morph_finding_note(m, -fabs(at(t, k, link) - own[link]), t->h * k,
                           morph_element_of(MORPH_ELEMENT_LINK, link), morph_no_element());
}

/* Every row against the record at the row's time, whatever the table's own step; and its last row against the
 * record's end, or a table that never moves would do. Between samples the curves are the plan's to far below
 * the tolerance. `near` is what times are known to: that much, at the fastest, is allowed for. */
static morph_status test_compatibility(const table *t, double near, morph_findings *f) {
    const morph_record *r = t->r;
    morph_findings own = *f;
    own.defect[0] = 0;
    if (!morph_check_schedule(r, &own)) return MORPH_OK;
    double *length = morph_alloc((size_t)r->links, sizeof(double)), fastest = 0;
    if (!length) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < (size_t)r->samples * (size_t)r->links; i++)
        fastest = fmax(fastest, fabs(r->rate[i]));
    morph_finding *m = &f->kind[MORPH_MARGIN_COMPATIBILITY];
    morph_finding_begin(m, 1e-6 * r->spacing + t->rounding + near * fastest, r->spacing);
    for (int k = 0; k < t->samples; k++) {
        record_lengths(r, t->h * k, near, length);
        compare_row(t, k, length, m);
    }
    record_lengths(r, r->time[r->samples - 1], near, length);
    compare_row(t, t->samples - 1, length, m);
    free(length);
    return MORPH_OK;
}

/* Times written with nine digits are off by up to 5e-9 of the last; never more than a hundredth of a step. */
static double time_rounding(const double *time, int samples) {
    const double h = morph_check_step(time, samples);
    return fmin(1e-8 * fabs(time[samples - 1]) + 1e-6 * h, 1e-2 * h);
}

static bool usable_table(const morph_record *r, const double *time, const double *length, int samples,
                         morph_findings *f) {
    if (!time || !length || samples < 2) {
        morph_findings_defect(f, "the schedule has fewer than two samples");
        return false;
    }
    for (int k = 0; k < samples; k++) {
        if (!(fabs(time[k]) <= 1e30)) {
            morph_findings_defect(f, "the time of sample %d is not finite", k);
            return false;
        }
        for (int i = 0; i < r->links; i++) {
            /* As for a record: a million spacings is no length. */
            if (fabs(length[(size_t)k * (size_t)r->links + (size_t)i]) <= 1e6 * r->spacing) continue;
            char name[96];
            morph_record_link_name(r, i, name, sizeof name);
            morph_findings_defect(f, "the length of %s at %.9g s is not usable", name, time[k]);
            return false;
        }
    }
    if (!(morph_check_step(time, samples) >= 1e-30)) {
        morph_findings_defect(f, "time does not increase");
        return false;
    }
    const int bad = morph_check_even(time, samples, time_rounding(time, samples));
    if (bad >= 0) morph_findings_defect(f, "time is not even from 0: sample %d is at %.9g s", bad, time[bad]);
    return bad < 0;
}

morph_status morph_check_table(const morph_record *r, const double *time, const double *length, int samples,
                               morph_findings *f) {
    if (!usable_table(r, time, length, samples, f)) return MORPH_OK;
    const table t = {r, length, samples, morph_check_step(time, samples),
                     rounding_of(length, (size_t)samples * (size_t)r->links)};
    test_lengths(&t, &f->kind[MORPH_MARGIN_LENGTH]);
    test_order(&t, 1, r->rate_limit, &f->kind[MORPH_MARGIN_RATE]);
    test_order(&t, 2, r->acceleration_limit, &f->kind[MORPH_MARGIN_ACCELERATION]);
    test_order(&t, 3, r->jerk_limit, &f->kind[MORPH_MARGIN_JERK]);
    test_rest(&t, f);
    return test_compatibility(&t, time_rounding(time, samples), f);
}
