/* Motion between samples, and the search for the least value of a function along it. */
#include "planner/check_parts.h"

#include <stdlib.h>

/* Lagrange's cubic through the 4 samples around tau (fewer if the record has fewer). With nodes 0..n-1 and
 * local x: w_i = prod_{j != i} (x - j) / (i - j). The error against a smooth motion is of fourth order in the
 * sample time. */
int morph_motion_weights(int samples, double tau, double weight[4], int *count) {
    const int n = samples < 4 ? samples : 4;
    int first = (int)floor(tau) - 1;
    if (first > samples - n) first = samples - n;
    if (first < 0) first = 0;
    const double x = tau - first;
    for (int i = 0; i < n; i++) {
        weight[i] = 1;
        for (int j = 0; j < n; j++)
            if (j != i) weight[i] *= (x - j) / (i - j);
    }
    *count = n;
    return first;
}

static void weighted(const morph_motion *m, int point, int first, const double w[4], int n, double out[3]) {
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < n; i++) {
        const double *x = m->x + 3 * ((size_t)(first + i) * (size_t)m->points + (size_t)point);
        for (int k = 0; k < 3; k++)
            out[k] += w[i] * x[k];
    }
}

void morph_motion_point(const morph_motion *m, int point, double tau, double out[3]) {
    double w[4];
    int n;
    const int first = morph_motion_weights(m->samples, tau, w, &n);
    weighted(m, point, first, w, n, out);
}

/* Speed bound over one interval. Over u in [0,1] the motion is a cubic; its Bernstein points b0..b3 follow
 * from the values at 0, 1/3, 2/3, 1, the derivative is the quadratic with Bernstein points 3 (b1 - b0),
 * 3 (b2 - b1), 3 (b3 - b2), and a Bezier curve stays within the hull of its points: no speed is above the
 * largest of their norms. */
static double speed_bound(const double p[4][3]) {
    double b[4][3], fastest = 0;
    for (int k = 0; k < 3; k++) {
        b[0][k] = p[0][k];
        b[1][k] = (-5 * p[0][k] + 18 * p[1][k] - 9 * p[2][k] + 2 * p[3][k]) / 6;
        b[2][k] = (2 * p[0][k] - 9 * p[1][k] + 18 * p[2][k] - 5 * p[3][k]) / 6;
        b[3][k] = p[3][k];
    }
    for (int i = 0; i < 3; i++)
        fastest = fmax(fastest, 3 * morph_dist(b[i + 1], b[i]));
    return fastest;
}

morph_status morph_motion_create(const double *x, int samples, int points, morph_motion *out) {
    const morph_motion m = {samples, points, x,
                            morph_alloc((size_t)samples, (size_t)points * sizeof(double))};
    if (!m.travel) return MORPH_ERR_NOMEM;
    for (int k = 0; k + 1 < samples; k++) {
        const double *now = m.travel + (size_t)k * (size_t)points;
        double *next = m.travel + (size_t)(k + 1) * (size_t)points;
        double w[4][4];
        int first[4], n = 0;
        for (int i = 0; i < 4; i++)
            first[i] = morph_motion_weights(samples, i < 3 ? k + i / 3.0 : k + 1.0, w[i], &n);
        for (int j = 0; j < points; j++) {
            double p[4][3];
            for (int i = 0; i < 4; i++)
                weighted(&m, j, first[i], w[i], n, p[i]);
            next[j] = now[j] + speed_bound((const double(*)[3])p);
        }
    }
    *out = m;
    return MORPH_OK;
}

void morph_motion_free(morph_motion *m) {
    free(m->travel);
    m->travel = NULL;
}

/* The speed bound is constant within an interval, so the bound is linear there. */
static double travel_until(const morph_motion *m, int point, double tau) {
    int k = (int)floor(tau);
    if (k > m->samples - 2) k = m->samples - 2;
    const double *t = m->travel + (size_t)k * (size_t)m->points + (size_t)point;
    return t[0] + (tau - k) * (t[m->points] - t[0]);
}

double morph_motion_travel(const morph_motion *m, int point, double from, double to) {
    return travel_until(m, point, to) - travel_until(m, point, from);
}

static double evaluate(morph_sweep *s, double tau) {
    s->evaluations++;
    const double value = s->value(s->data, tau);
    if (isnan(value)) s->failed = true;
    return value;
}

/* Golden section about a new least value: the search knows the minimum to its slack only, and a sharper
 * number names the same time whatever element is asked first. */
static void refine(morph_sweep *s, double from, double to) {
    const double golden = 0.6180339887498949;
    double a = from, b = to, x = b - golden * (b - a), y = a + golden * (b - a);
    double fx = evaluate(s, x), fy = evaluate(s, y);
    /* 40 steps shrink a fine step to 1e-9 of it. */
    for (int i = 0; i < 40 && !s->failed; i++) {
        const double f = fmin(fx, fy);
        if (f < s->least) {
            s->least = f;
            s->at = fx < fy ? x : y;
        }
        if (fx < fy) {
            b = y;
            y = x;
            fy = fx;
            x = b - golden * (b - a);
            fx = evaluate(s, x);
        } else {
            a = x;
            x = y;
            fx = fy;
            y = a + golden * (b - a);
            fy = evaluate(s, y);
        }
    }
}

typedef struct span {
    double from, from_value, to, to_value;
} span;

/* A margin far from its limit, on either side, needs no more than two digits; near it the slack alone counts.
 * Without this, deep inside a target where many elements are equally deep, the search would not end soon. */
static double allowed(const morph_sweep *s) {
    return s->slack + 0.01 * fabs(s->least);
}

/* On [a, b] with travel D, |f(t) - f(a)| + |f(t) - f(b)| <= D, hence f(t) >= (f(a) + f(b) - D) / 2: a span
 * whose bound is not below least - slack needs no look inside, any other is halved. Since f(a), f(b) >=
 * least, D <= 2 slack always ends it. */
bool morph_sweep_run(morph_sweep *s, double from, double from_value, double to, double to_value) {
    /* Depth: spans are halved down to 1e-9 of a sample at most, 62 halvings of the longest record. */
    enum { DEPTH = 96 };
    span stack[DEPTH];
    int top = 0;
    const double before = s->least;
    double left = from, right = to;
    if (to_value < s->least - s->tie) {
        s->least = to_value;
        s->at = left = right = to;
    }
    if (from_value < s->least - s->tie) {
        s->least = from_value;
        s->at = left = right = from;
    }
    stack[top++] = (span){from, from_value, to, to_value};
    while (top > 0 && !s->failed) {
        const span p = stack[--top];
        const double travel = s->travel(s->data, p.from, p.to);
        if (0.5 * (p.from_value + p.to_value - travel) >= s->least - allowed(s)) continue;
        const double width = p.to - p.from, middle = p.from + 0.5 * width;
        if (width < 1e-9 || top + 2 > DEPTH || s->evaluations >= s->budget) {
            s->exhausted = true;
            break;
        }
        const double value = evaluate(s, middle);
        s->finest = fmin(s->finest, 0.5 * width);
        if (value < s->least - s->tie) {
            s->least = value;
            s->at = middle;
            left = p.from;
            right = p.to;
        }
        stack[top++] = (span){middle, value, p.to, p.to_value};
        stack[top++] = (span){p.from, p.from_value, middle, value};
    }
    if (s->least < before && right > left && !s->failed) refine(s, left, right);
    return s->least < before;
}
