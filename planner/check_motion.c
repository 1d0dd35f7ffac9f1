/* Motion between samples, and the search for the least value of a function along it. */
#include "planner/check_parts.h"

#include <stdlib.h>
#include <string.h>

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

/* At a sample the weights are 0 and 1: the same without them. */
void morph_motion_point(const morph_motion *m, int point, double tau, double out[3]) {
    double w[4];
    int n;
    if (tau == floor(tau) && tau >= 0 && tau < m->samples) {
        memcpy(out, m->x + 3 * ((size_t)tau * (size_t)m->points + (size_t)point), 3 * sizeof *out);
        return;
    }
    const int first = morph_motion_weights(m->samples, tau, w, &n);
    weighted(m, point, first, w, n, out);
}

/* Bernstein points by samples: over u in [0,1] the motion is a cubic, whose points b0..b3 follow from its
 * values at 0, 1/3, 2/3, 1, which are sums of samples. Returns the first of them. */
static int bernstein_of(int samples, int interval, double by[4][4], int *n) {
    static const double of_value[4][4] = {{6, 0, 0, 0}, {-5, 18, -9, 2}, {2, -9, 18, -5}, {0, 0, 0, 6}};
    double w[4][4] = {{0}};
    int first = 0;
    for (int i = 0; i < 3; i++)
        first = morph_motion_weights(samples, interval + i / 3.0, w[i], n);
    w[3][interval + 1 - first] = 1;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            by[i][j] = 0;
            for (int k = 0; k < 4; k++)
                by[i][j] += of_value[i][k] * w[k][j] / 6;
        }
    return first;
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

/* The derivative is the quadratic with Bernstein points 3 (b1 - b0), 3 (b2 - b1), 3 (b3 - b2), and a Bezier
 * curve stays within the hull of its points: no speed is above the largest of their norms. The second
 * derivative likewise has the points 6 (b0 - 2 b1 + b2) and 6 (b1 - 2 b2 + b3), with the largest norm A; over
 * a part of width w the motion departs from its chord by at most A w^2 / 8. *bend: A / 8. */
static double speed_bound(const double *x, size_t stride, const double by[4][4], int n, double *bend) {
    double b[4][3] = {{0}}, fastest = 0, sharpest = 0;
    for (int j = 0; j < n; j++, x += stride)
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 3; k++)
                b[i][k] += by[i][j] * x[k];
    for (int i = 0; i < 3; i++) {
        double d[3];
        morph_sub(b[i + 1], b[i], d);
        fastest = larger(fastest, morph_dot(d, d));
    }
    for (int i = 0; i < 2; i++) {
        double turn[3];
        for (int k = 0; k < 3; k++)
            turn[k] = b[i][k] - 2 * b[i + 1][k] + b[i + 2][k];
        sharpest = larger(sharpest, morph_dot(turn, turn));
    }
    *bend = 0.75 * sqrt(sharpest);
    return 3 * sqrt(fastest);
}

morph_status morph_motion_create(const double *x, int samples, int points, morph_motion *out) {
    morph_motion m = {.samples = samples, .points = points, .x = x};
    const size_t width = (size_t)points;
    m.travel = morph_alloc((size_t)samples, width * sizeof(double));
    m.bend = morph_alloc((size_t)samples, width * sizeof(double));
    if (!m.travel || !m.bend) {
        morph_motion_free(&m);
        return MORPH_ERR_NOMEM;
    }
    double by[4][4];
    for (int k = 0; k + 1 < samples; k++) {
        int n = 0;
        const size_t first = (size_t)bernstein_of(samples, k, by, &n), at = (size_t)k * width;
        for (size_t j = 0; j < width; j++)
            m.travel[at + width + j] =
                m.travel[at + j] + speed_bound(x + 3 * (first * width + j), 3 * width, (const double(*)[4])by,
                                               n, &m.bend[at + j]);
    }
    *out = m;
    return MORPH_OK;
}

void morph_motion_free(morph_motion *m) {
    free(m->travel);
    free(m->bend);
    m->travel = m->bend = NULL;
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

/* Within one interval the bound falls with the square of the part. Over several, the samples between give the
 * corners of a polygon, from which the motion departs by the bend of its intervals; and the polygon departs
 * from the chord most at a corner. */
double morph_motion_bend(const morph_motion *m, int point, double from, double to) {
    const size_t points = (size_t)m->points;
    int k = (int)floor(from);
    if (k > m->samples - 2) k = m->samples - 2;
    const double *bend = m->bend + (size_t)k * points + (size_t)point, width = to - from;
    if (to <= k + 1) return width * width * *bend;
    double a[3], b[3], corner = 0, most = 0;
    morph_motion_point(m, point, from, a);
    morph_motion_point(m, point, to, b);
    for (; k < to; k++, bend += points) {
        most = larger(most, *bend);
        if (k <= from) continue;
        const double *x = m->x + 3 * ((size_t)k * points + (size_t)point), u = (k - from) / width;
        double d[3];
        for (int i = 0; i < 3; i++)
            d[i] = x[i] - (1 - u) * a[i] - u * b[i];
        corner = larger(corner, morph_dot(d, d));
    }
    return sqrt(corner) + most;
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
 * least, D <= 2 slack always ends it. Such a bound knows nothing of directions: two bars that pass side by
 * side, or skin that slides along the target, need a great many short spans. There the swept test is asked
 * before halving. */
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
        const double bound = s->least - allowed(s), over = p.from_value + p.to_value - 2 * bound;
        if (over >= travel) continue;
        if (s->apart && travel > s->worth * over &&
            s->apart(s->data, p.from, p.to, bound, larger(0, fmin(p.from_value, p.to_value) - bound))) {
            s->proofs++;
            continue;
        }
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
