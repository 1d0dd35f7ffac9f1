#include "planner/timing_exact.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

/* Lengths and their derivatives by time at a time, into table->by_time. */
static void evaluate(morph_path_table *table, const morph_timing *timing, double t) {
    double s[4];
    morph_timing_eval(timing, t, s);
    morph_path_table_exact(table, s[0], 3);
    morph_timing_chain(table->curve->structure->links, table->exact, s, table->by_time);
}

static const double *limits(const morph_structure *s, int kind) {
    return kind == 0 ? s->rate_limit : kind == 1 ? s->acceleration_limit : s->jerk_limit;
}

/* Signed ratios of every link to its limits (3 x links). */
static void signed_ratios(morph_path_table *table, const morph_timing *timing, double t, double *out) {
    const morph_structure *s = table->curve->structure;
    evaluate(table, timing, t);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < s->links; l++)
            out[k * s->links + l] = table->by_time[(k + 1) * s->links + l] / limits(s, k)[l];
}

void morph_timing_ratios(morph_path_table *table, const morph_timing *timing, double t, double worst[3]) {
    const morph_structure *s = table->curve->structure;
    evaluate(table, timing, t);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < s->links; l++)
            worst[k] = fmax(worst[k], fabs(table->by_time[(k + 1) * s->links + l]) / limits(s, k)[l]);
}

double morph_timing_stretch(const double worst[3]) {
    return fmax(worst[0], fmax(sqrt(worst[1]), cbrt(worst[2])));
}

void morph_timing_even(morph_path_table *table, const morph_timing *timing, int steps, double worst[3]) {
    worst[0] = worst[1] = worst[2] = 0.0;
    for (int i = 0; i <= steps; i++)
        morph_timing_ratios(table, timing, timing->duration * i / steps, worst);
}

static double shortest_span(const morph_basis *b) {
    double least = INFINITY;
    for (int i = MORPH_SPLINE_DEGREE; i < b->count; i++)
        least = fmin(least, b->knot[i + 1] - b->knot[i]);
    return least;
}

/* Fine steps to a coarse one: a fifth of the shortest time between knots, of the profile or of the path, so
 * that every coarse interval meets one knot at most and its neighbours show both sides of it. */
static int coarse_stride(const morph_path_table *table, const morph_timing *timing, int steps) {
    const double fine = timing->duration / steps;
    double fastest = 0.0;
    for (int i = 0; i <= 1000; i++) {
        double s[4];
        morph_timing_eval(timing, timing->duration * i / 1000.0, s);
        fastest = fmax(fastest, s[1]);
    }
    const double profile = shortest_span(&timing->basis) * timing->duration;
    const double path = shortest_span(&table->curve->spline.basis) / fastest;
    return (int)fmin(100.0, fmax(1.0, floor(fmin(profile, path) / (5.0 * fine))));
}

/* Over an interval a smooth function exceeds its ends by an eighth of its second difference at most; half of
 * the larger of the two that reach the interval leaves a factor of four. q: ratios at four successive coarse
 * times. */
static void interval_bound(double *const q[4], int links, double bound[3]) {
    for (int k = 0; k < 3; k++) {
        bound[k] = 0.0;
        for (int n = k * links; n < (k + 1) * links; n++) {
            const double left = fabs(q[0][n] - 2.0 * q[1][n] + q[2][n]);
            const double right = fabs(q[1][n] - 2.0 * q[2][n] + q[3][n]);
            bound[k] = fmax(bound[k], fmax(fabs(q[1][n]), fabs(q[2][n])) + 0.5 * fmax(left, right));
        }
    }
}

/* The ring of ratios at coarse times i - 1 .. i + 2. Past an end another time of the window stands in: its
 * difference is of the first order, larger than the second, and the inner one is there too. */
typedef struct coarse {
    morph_path_table *table;
    const morph_timing *timing;
    int links, count; /* count: coarse intervals */
    int stride, steps;
    double *ring[4];
    double (*bound)[3]; /* count */
} coarse;

static void coarse_pass(coarse *c, double worst[3]) {
    for (int i = 0; i <= c->count; i++) {
        double *now = c->ring[i & 3];
        const int fine = i * c->stride < c->steps ? i * c->stride : c->steps;
        signed_ratios(c->table, c->timing, c->timing->duration * fine / c->steps, now);
        for (int k = 0; k < 3; k++)
            for (int n = k * c->links; n < (k + 1) * c->links; n++)
                worst[k] = fmax(worst[k], fabs(now[n]));
        if (i < 3) continue;
        double *const q[4] = {c->ring[(i - 3) & 3], c->ring[(i - 2) & 3], c->ring[(i - 1) & 3], now};
        interval_bound(q, c->links, c->bound[i - 2]);
        double *const first[4] = {q[2], q[0], q[1], q[2]}, *const last[4] = {q[1], q[2], q[3], q[1]};
        if (i == 3) interval_bound(first, c->links, c->bound[0]);
        if (i == c->count) interval_bound(last, c->links, c->bound[i - 1]);
    }
}

morph_status morph_timing_fine(morph_path_table *table, const morph_timing *timing, int steps,
                               double worst[3]) {
    const int stride = coarse_stride(table, timing, steps), count = (steps + stride - 1) / stride;
    worst[0] = worst[1] = worst[2] = 0.0;
    if (stride < 3 || count < 8) {
        morph_timing_even(table, timing, steps, worst);
        return MORPH_OK;
    }
    coarse c = {.table = table, .timing = timing, .links = table->curve->structure->links, .count = count};
    c.stride = stride;
    c.steps = steps;
    double *ring = morph_alloc(4 * 3 * (size_t)c.links, sizeof *ring);
    c.bound = morph_alloc((size_t)count, sizeof *c.bound);
    if (ring && c.bound) {
        for (int k = 0; k < 4; k++)
            c.ring[k] = ring + (size_t)k * 3 * (size_t)c.links;
        coarse_pass(&c, worst);
        for (int i = 0; i < count; i++)
            for (int j = i * stride + 1; j < (i + 1) * stride && j <= steps; j++) {
                const double *b = c.bound[i];
                /* The last coarse interval may be cut by the end: all of it is evaluated. */
                if (i + 1 < count && b[0] <= worst[0] && b[1] <= worst[1] && b[2] <= worst[2]) break;
                morph_timing_ratios(table, timing, timing->duration * j / steps, worst);
            }
    }
    const bool ok = ring && c.bound;
    free(ring);
    free(c.bound);
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* One link over one sample: L(u) = L0 + A u + B u^2/2 + c3 u^3 + c4 u^4 + c5 u^5 with u in [0, 1], D = L1 -
 * L0, A = h v0, B = h^2 a0, C = h v1, E = h^2 a1; c3 to c5 follow from D, C and E at u = 1. */
static void reader_interval(double h, const double from[3], const double to[3], double noise,
                            const double limit[3], double worst[3]) {
    const double D = to[0] - from[0], A = h * from[1], B = h * h * from[2], C = h * to[1], E = h * h * to[2];
    const double c3 = 10.0 * D - 6.0 * A - 4.0 * C - 1.5 * B + 0.5 * E;
    const double c4 = -15.0 * D + 8.0 * A + 7.0 * C + 1.5 * B - E;
    const double c5 = 6.0 * D - 3.0 * A - 3.0 * C - 0.5 * B + 0.5 * E;
    for (int i = 0; i <= MORPH_TIMING_FINE; i++) {
        const double u = (double)i / MORPH_TIMING_FINE;
        const double v = A + u * (B + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)));
        const double a = B + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5));
        const double j = 6.0 * c3 + u * (24.0 * c4 + u * 60.0 * c5);
        worst[0] = fmax(worst[0], fabs(v) / (h * limit[0]));
        worst[1] = fmax(worst[1], fabs(a) / (h * h * limit[1]));
        worst[2] = fmax(worst[2], (fabs(j) / (h * h * h) - noise) / limit[2]);
    }
}

morph_status morph_timing_reader(morph_path_table *table, const morph_timing *timing, int samples,
                                 double worst[3]) {
    const morph_structure *s = table->curve->structure;
    const size_t width = 3 * (size_t)s->links;
    const double h = timing->duration / samples;
    double *before = morph_alloc(width, sizeof *before);
    if (!before) return MORPH_ERR_NOMEM;
    worst[0] = worst[1] = worst[2] = 0.0;
    for (int i = 0; i <= samples; i++) {
        evaluate(table, timing, fmin(i * h, timing->duration));
        for (int l = 0; l < s->links && i > 0; l++) {
            const double limit[3] = {s->rate_limit[l], s->acceleration_limit[l], s->jerk_limit[l]};
            const double from[3] = {before[l], before[s->links + l], before[2 * s->links + l]};
            const double *now = table->by_time + l, to[3] = {now[0], now[s->links], now[2 * s->links]};
            /* Lengths carry a few units in the last place; 60 is the weight of their difference. */
            const double noise = 60.0 * 4.0 * DBL_EPSILON * fabs(to[0]) / (h * h * h);
            reader_interval(h, from, to, noise, limit, worst);
        }
        memcpy(before, table->by_time, width * sizeof *before);
    }
    free(before);
    return MORPH_OK;
}
