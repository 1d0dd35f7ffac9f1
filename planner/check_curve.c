/* Lengths over time. Between two samples a length is the quintic Hermite polynomial through (length, rate,
 * acceleration) at both: one C2 curve over the whole schedule, and what a drive with position, velocity and
 * acceleration feed-forward makes of the record. */
#include "planner/check_parts.h"

#include <float.h>

/* With u in [0,1], step h, D = L1 - L0, A = h v0, B = h^2 a0, C = h v1, E = h^2 a1:
 *   L = L0 + D (10u^3 - 15u^4 + 6u^5) + A (u - 6u^3 + 8u^4 - 3u^5) + B (u^2 - 3u^3 + 3u^4 - u^5) / 2
 *     + C (-4u^3 + 7u^4 - 3u^5) + E (u^3 - 2u^4 + u^5) / 2.
 * The difference D instead of two lengths keeps the derivatives' rounding small. Rows: order of derivative
 * 0..3; columns D, A, B, C, E. */
static void weights(double u, double w[4][5]) {
    const double u2 = u * u, u3 = u2 * u, u4 = u3 * u, u5 = u4 * u;
    const double rows[4][5] = {
        {10 * u3 - 15 * u4 + 6 * u5, u - 6 * u3 + 8 * u4 - 3 * u5, 0.5 * (u2 - 3 * u3 + 3 * u4 - u5),
         -4 * u3 + 7 * u4 - 3 * u5, 0.5 * (u3 - 2 * u4 + u5)},
        {30 * u2 - 60 * u3 + 30 * u4, 1 - 18 * u2 + 32 * u3 - 15 * u4,
         0.5 * (2 * u - 9 * u2 + 12 * u3 - 5 * u4), -12 * u2 + 28 * u3 - 15 * u4,
         0.5 * (3 * u2 - 8 * u3 + 5 * u4)},
        {60 * u - 180 * u2 + 120 * u3, -36 * u + 96 * u2 - 60 * u3, 0.5 * (2 - 18 * u + 36 * u2 - 20 * u3),
         -24 * u + 84 * u2 - 60 * u3, 0.5 * (6 * u - 24 * u2 + 20 * u3)},
        {60 - 360 * u + 360 * u2, -36 + 192 * u - 180 * u2, 0.5 * (-18 + 72 * u - 60 * u2),
         -24 + 168 * u - 180 * u2, 0.5 * (6 - 48 * u + 60 * u2)}};
    for (int d = 0; d < 4; d++)
        for (int c = 0; c < 5; c++)
            w[d][c] = rows[d][c];
}

static void data_of(const morph_record *r, int link, int k, double h, double *start, double c[5]) {
    const size_t now = (size_t)k * (size_t)r->links + (size_t)link, next = now + (size_t)r->links;
    *start = r->length[now];
    c[0] = r->length[next] - r->length[now];
    c[1] = h * r->rate[now];
    c[2] = h * h * r->acceleration[now];
    c[3] = h * r->rate[next];
    c[4] = h * h * r->acceleration[next];
}

static double row(const double w[5], const double c[5]) {
    return w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3] + w[4] * c[4];
}

void morph_check_curve_lengths(const morph_record *r, int k, double u, double *length) {
    const double h = morph_check_step(r->time, r->samples);
    double w[4][5], c[5], start;
    weights(u, w);
    for (int link = 0; link < r->links; link++) {
        data_of(r, link, k, h, &start, c);
        length[link] = start + row(w[0], c);
    }
}

static double largest(const double *x, int n) {
    double most = 0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* Tolerances are rounding only. Lengths: 1e-9 of the spacing, a tenth of a nanometre. Rates and so on: 1e-9
 * of the largest limit, plus what rounding of the samples does to the derivative: every length carries an
 * error of a few eps L from the square root and sums it came from, and the weights of D are at
 * most 1.9/h, 5.8/h^2 and 60/h^3 (twice that for two lengths; 4 eps L each). */
static void begin(const morph_record *r, double h, morph_findings *f) {
    double longest = 0;
    for (int i = 0; i < r->links; i++)
        longest = fmax(longest, fabs(r->length_limit[i][1]));
    const double eps = 8 * DBL_EPSILON * longest;
    morph_finding *m = f->kind;
    morph_finding_begin(&m[MORPH_MARGIN_LENGTH], 1e-9 * r->spacing, r->spacing);
    const double v = largest(r->rate_limit, r->links), a = largest(r->acceleration_limit, r->links),
                 j = largest(r->jerk_limit, r->links);
    morph_finding_begin(&m[MORPH_MARGIN_RATE], 1e-9 * v + 1.9 * eps / h, v);
    morph_finding_begin(&m[MORPH_MARGIN_ACCELERATION], 1e-9 * a + 5.8 * eps / (h * h), a);
    morph_finding_begin(&m[MORPH_MARGIN_JERK], 1e-9 * j + 60 * eps / (h * h * h), j);
}

static void test_interval(const morph_record *r, int k, double h, double (*w)[4][5], morph_findings *f) {
    morph_finding *m = f->kind;
    const morph_element none = morph_no_element();
    for (int link = 0; link < r->links; link++) {
        double c[5], start;
        data_of(r, link, k, h, &start, c);
        const double *limit = r->length_limit[link];
        const morph_element e = morph_element_of(MORPH_ELEMENT_LINK, link);
        for (int i = 0; i <= MORPH_CHECK_FINE; i++) {
            const double t = h * (k + (double)i / MORPH_CHECK_FINE);
            const double length = start + row(w[i][0], c), rate = row(w[i][1], c) / h;
            const double acceleration = row(w[i][2], c) / (h * h), jerk = row(w[i][3], c) / (h * h * h);
            morph_finding_note(&m[MORPH_MARGIN_LENGTH], fmin(length - limit[0], limit[1] - length), t, e,
                               none);
            morph_finding_note(&m[MORPH_MARGIN_RATE], r->rate_limit[link] - fabs(rate), t, e, none);
            morph_finding_note(&m[MORPH_MARGIN_ACCELERATION],
                               r->acceleration_limit[link] - fabs(acceleration), t, e, none);
            morph_finding_note(&m[MORPH_MARGIN_JERK], r->jerk_limit[link] - fabs(jerk), t, e, none);
        }
    }
}

/* Rest to 1e-6 of the limits: a step in velocity that no drive can tell from none. */
static void test_rest(const morph_record *r, morph_findings *f) {
    for (int end = 0; end < 2; end++)
        for (int link = 0; link < r->links; link++) {
            const size_t at = (size_t)(end ? r->samples - 1 : 0) * (size_t)r->links + (size_t)link;
            const double v = fabs(r->rate[at]) / r->rate_limit[link];
            const double a = fabs(r->acceleration[at]) / r->acceleration_limit[link];
            if (v <= 1e-6 && a <= 1e-6) continue;
            char name[96];
            morph_record_link_name(r, link, name, sizeof name);
            morph_findings_defect(f, "%s is not at rest at the %s: rate %.3g m/s, acceleration %.3g m/s2",
                                  name, end ? "end" : "start", r->rate[at], r->acceleration[at]);
            return;
        }
}

/* Third difference of the lengths around sample k over h^3, largest of the two that reach it: the jerk that
 * the lengths themselves show, whatever the other columns say. */
static double jerk_seen(const morph_record *r, int link, int k, double h) {
    double most = 0;
    for (int first = k - 2; first <= k - 1; first++) {
        if (first < 0 || first + 3 >= r->samples) continue;
        double l[4];
        for (int i = 0; i < 4; i++)
            l[i] = r->length[(size_t)(first + i) * (size_t)r->links + (size_t)link];
        most = fmax(most, fabs(l[3] - 3 * l[2] + 3 * l[1] - l[0]) / (h * h * h));
    }
    return most;
}

/* Are rate and acceleration the derivatives of the length? With |L'''| <= J around sample k, Taylor with
 * remainder gives
 *   |(L+ - L-) / 2h - v| <= J h^2 / 6,      |(L+ - 2 L + L-) / h^2 - a| <= J h / 3.
 * J is taken from the limit or, where larger, twice the third differences (a curve that breaks its jerk limit
 * is the jerk margin's business); the last term is rounding of the lengths, 4 eps L each. */
static void test_consistency(const morph_record *r, double h, morph_findings *f) {
    const size_t stride = (size_t)r->links;
    for (int k = 1; k + 1 < r->samples; k++)
        for (int link = 0; link < r->links; link++) {
            const size_t at = (size_t)k * stride + (size_t)link;
            const double *l = r->length + at, before = l[-(ptrdiff_t)stride], after = l[stride];
            const double v = (after - before) / (2 * h), a = (after - 2 * l[0] + before) / (h * h);
            const double J = fmax(r->jerk_limit[link], 2 * jerk_seen(r, link, k, h));
            const double round = 4 * DBL_EPSILON * fmax(fabs(l[0]), fmax(fabs(before), fabs(after)));
            const double dv = fabs(r->rate[at] - v), da = fabs(r->acceleration[at] - a);
            const bool rate_wrong = dv > J * h * h / 6 + round / h + 1e-9 * r->rate_limit[link];
            const bool wrong =
                rate_wrong || da > J * h / 3 + 4 * round / (h * h) + 1e-9 * r->acceleration_limit[link];
            if (!wrong) continue;
            char name[96];
            morph_record_link_name(r, link, name, sizeof name);
            morph_findings_defect(f, "%s of %s at %.9g s is %.9g, but its lengths give %.9g",
                                  rate_wrong ? "schedule/rate" : "schedule/acceleration", name, k * h,
                                  rate_wrong ? r->rate[at] : r->acceleration[at], rate_wrong ? v : a);
            return;
        }
}

void morph_check_curves(const morph_record *r, morph_findings *f) {
    const double h = morph_check_step(r->time, r->samples);
    double w[MORPH_CHECK_FINE + 1][4][5];
    for (int i = 0; i <= MORPH_CHECK_FINE; i++)
        weights((double)i / MORPH_CHECK_FINE, w[i]);
    begin(r, h, f);
    for (int k = 0; k + 1 < r->samples; k++)
        test_interval(r, k, h, w, f);
    test_rest(r, f);
    test_consistency(r, h, f);
}
