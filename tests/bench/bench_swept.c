/* The swept test against a plain floating-point root finder of the coplanarity cubic, same queries in memory,
 * same run: bench_swept FILE with the queries of known truth. */
#include "model/swept.h"
#include "solvers/base.h"
#include "tests/support/swept_queries.h"

#include <string.h>

/* Where the cubic's solution counts as inside: rounding of the weights of well-shaped triangles and edges. */
static const double INSIDE = 1e-9;

static double determinant(const double a[3], const double b[3], const double c[3]) {
    double n[3];
    morph_cross(a, b, n);
    return morph_dot(n, c);
}

/* det(a + t da, b + t db, c + t dc) = k[0] + k[1] t + k[2] t^2 + k[3] t^3. */
static void coplanarity(const double e[2][3][3], double k[4]) {
    double d[3][3];
    for (int i = 0; i < 3; i++)
        morph_sub(e[1][i], e[0][i], d[i]);
    k[0] = determinant(e[0][0], e[0][1], e[0][2]);
    k[1] = determinant(d[0], e[0][1], e[0][2]) + determinant(e[0][0], d[1], e[0][2]) +
           determinant(e[0][0], e[0][1], d[2]);
    k[2] = determinant(d[0], d[1], e[0][2]) + determinant(d[0], e[0][1], d[2]) +
           determinant(e[0][0], d[1], d[2]);
    k[3] = determinant(d[0], d[1], d[2]);
}

static double cubic(const double k[4], double t) {
    return ((k[3] * t + k[2]) * t + k[1]) * t + k[0];
}

/* Newton's method kept in a bracket; f(lo) and f(hi) differ in sign. */
static double polish(const double k[4], double lo, double hi) {
    const bool rising = cubic(k, lo) < cubic(k, hi);
    double t = 0.5 * (lo + hi);
    for (int i = 0; i < 60 && hi - lo > 1e-15; i++) {
        const double f = cubic(k, t), slope = (3 * k[3] * t + 2 * k[2]) * t + k[1];
        if ((f < 0) == rising)
            lo = t;
        else
            hi = t;
        double next = t - f / slope;
        if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
        if (fabs(next - t) < 1e-15) return next;
        t = next;
    }
    return t;
}

/* Roots in [0, 1], ascending: between the extremes the cubic is monotone. */
static int roots(const double k[4], double root[3]) {
    double cut[4] = {0};
    int cuts = 1, n = 0;
    const double a = 3 * k[3], b = k[2], c = k[1], disc = b * b - a * c;
    if (disc > 0) {
        /* The two roots of a t^2 + 2 b t + c without cancellation. */
        const double q = -(b + (b < 0 ? -sqrt(disc) : sqrt(disc)));
        double r = a != 0 ? q / a : -1, s = q != 0 ? c / q : -1;
        if (r > s) {
            const double swap = r;
            r = s;
            s = swap;
        }
        if (r > 0 && r < 1) cut[cuts++] = r;
        if (s > 0 && s < 1) cut[cuts++] = s;
    }
    cut[cuts++] = 1;
    double f = cubic(k, 0);
    for (int i = 0; i + 1 < cuts; i++) {
        const double g = cubic(k, cut[i + 1]);
        if (f == 0)
            root[n++] = cut[i];
        else if ((f < 0) != (g < 0))
            root[n++] = polish(k, cut[i], cut[i + 1]);
        f = g;
    }
    return n;
}

static void at_time(const swept_query *q, double t, double x[4][3]) {
    for (int i = 0; i < 4; i++)
        for (int c = 0; c < 3; c++)
            x[i][c] = q->x[0][i][c] + t * (q->x[1][i][c] - q->x[0][i][c]);
}

/* Weights of the foot of r on the plane of u and v, by the normal equations. */
static bool weights(const double u[3], const double v[3], const double r[3], double *a, double *b) {
    const double uu = morph_dot(u, u), vv = morph_dot(v, v), uv = morph_dot(u, v);
    const double ur = morph_dot(u, r), vr = morph_dot(v, r), det = uu * vv - uv * uv;
    *a = (ur * vv - vr * uv) / det;
    *b = (vr * uu - ur * uv) / det;
    return det > 0;
}

static bool inside(const swept_query *q, double t) {
    double x[4][3], u[3], v[3], r[3], a, b;
    at_time(q, t, x);
    if (q->edges) {
        morph_sub(x[1], x[0], u);
        morph_sub(x[2], x[3], v);
        morph_sub(x[2], x[0], r);
        return weights(u, v, r, &a, &b) && a >= -INSIDE && a <= 1 + INSIDE && b >= -INSIDE && b <= 1 + INSIDE;
    }
    morph_sub(x[2], x[1], u);
    morph_sub(x[3], x[1], v);
    morph_sub(x[0], x[1], r);
    return weights(u, v, r, &a, &b) && a >= -INSIDE && b >= -INSIDE && a + b <= 1 + INSIDE;
}

static bool cubic_test(const swept_query *q, double *toi) {
    double e[2][3][3], k[4], root[3];
    for (int s = 0; s < 2; s++)
        for (int i = 0; i < 3; i++)
            morph_sub(q->x[s][i + 1], q->x[s][0], e[s][i]);
    coplanarity((const double(*)[3][3])e, k);
    const int n = roots(k, root);
    for (int i = 0; i < n; i++)
        if (inside(q, root[i])) {
            *toi = root[i];
            return true;
        }
    *toi = INFINITY;
    return false;
}

/* The same behind a box test, as the swept test has one. */
static bool boxed_test(const swept_query *q, double *toi) {
    const int first = q->edges ? 2 : 1;
    *toi = INFINITY;
    for (int k = 0; k < 3; k++) {
        double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
        for (int s = 0; s < 2; s++)
            for (int i = 0; i < 4; i++) {
                const double c = q->x[s][i][k];
                const int side = i >= first;
                lo[side] = c < lo[side] ? c : lo[side];
                hi[side] = c > hi[side] ? c : hi[side];
            }
        if (lo[0] > hi[1] || lo[1] > hi[0]) return false;
    }
    return cubic_test(q, toi);
}

static bool fast_test(const swept_query *q, double *toi) {
    const morph_swept_options o = {.separation = 0, .strict = false};
    return swept_run(q, &o, toi);
}

static bool strict_test(const swept_query *q, double *toi) {
    const morph_swept_options o = {.separation = 0, .strict = true};
    return swept_run(q, &o, toi);
}

/* Degenerate are: apart by less than 1e-6 of the size; or meeting without passing through each other's plane,
 * or at a border: then triangle or edges shrunk by 1e-6 do not meet. The cubic can only be held to the
 * others. */
static bool clear_cut(const swept_query *q) {
    double e[2][3][3], k[4], size = 0;
    for (int s = 0; s < 2; s++)
        for (int i = 0; i < 3; i++) {
            morph_sub(q->x[s][i + 1], q->x[s][0], e[s][i]);
            size = fmax(size, morph_norm(e[s][i]));
        }
    if (!q->truth) {
        const morph_swept_options o = {.separation = 1e-6 * size, .strict = true};
        return !swept_run(q, &o, NULL);
    }
    coplanarity((const double(*)[3][3])e, k);
    const double least = 1e-9 * size * size * size, last = k[0] + k[1] + k[2] + k[3];
    if (fabs(k[0]) < least || fabs(last) < least || (k[0] < 0) == (last < 0)) return false;
    swept_query shrunk = *q;
    for (int s = 0; s < 2; s++)
        for (int first = q->edges ? 0 : 1; first < 4; first += q->edges ? 2 : 3) {
            const int n = q->edges ? 2 : 3;
            for (int c = 0; c < 3; c++) {
                double middle = 0;
                for (int i = first; i < first + n; i++)
                    middle += q->x[s][i][c] / n;
                for (int i = first; i < first + n; i++)
                    shrunk.x[s][i][c] += 1e-6 * (middle - q->x[s][i][c]);
            }
        }
    const morph_swept_options o = {.separation = 0, .strict = true};
    return swept_run(&shrunk, &o, NULL);
}

typedef struct method {
    const char *name;
    bool (*test)(const swept_query *, double *);
} method;

/* Best of several passes: other work on the machine only adds. */
static double nanoseconds(const method *m, const swept_query *q, int n, double *sum) {
    double least = INFINITY;
    for (int pass = 0; pass < 12; pass++) {
        const double begin = morph_seconds();
        for (int i = 0; i < n; i++) {
            double toi;
            *sum += m->test(&q[i], &toi);
        }
        least = fmin(least, morph_seconds() - begin);
    }
    return 1e9 * least / n;
}

static void compare(const char *title, const swept_query *q, int n) {
    const method methods[] = {
        {"cubic", cubic_test}, {"cubic, boxes", boxed_test}, {"fast", fast_test}, {"strict", strict_test}};
    int colliding = 0;
    for (int i = 0; i < n; i++)
        colliding += q[i].truth;
    printf("%s: %d queries, %d colliding\n", title, n, colliding);
    printf("%-14s %8s %13s %10s %10s\n", "method", "misses", "false alarms", "mean ns", "ratio");
    double base = 0, sum = 0;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        int misses = 0, alarms = 0;
        for (int i = 0; i < n; i++) {
            double toi;
            const bool hit = methods[m].test(&q[i], &toi);
            misses += q[i].truth && !hit;
            alarms += !q[i].truth && hit;
        }
        const double ns = nanoseconds(&methods[m], q, n, &sum);
        if (m == 0) base = ns;
        printf("%-14s %8d %13d %10.0f %10.2f\n", methods[m].name, misses, alarms, ns, ns / base);
    }
    printf("(hits counted while timing: %.0f)\n\n", sum);
}

int main(int argc, char **argv) {
    const char *path = argc > 1 ? argv[1] : "../shared/models/ccd_queries_ground_truth.csv";
    enum { RANDOM = 20000 };
    swept_query *q = morph_alloc(RANDOM, sizeof *q);
    if (!q) return 1;
    const int n = swept_read(path, q, RANDOM);
    if (n > 0) {
        compare("known truth", q, n);
        int kept = 0;
        for (int i = 0; i < n; i++)
            if (clear_cut(&q[i])) q[kept++] = q[i];
        compare("known truth, the degenerate left out", q, kept);
    } else
        printf("%s cannot be read: known truth left out\n", path);
    /* Random ones are not degenerate: two methods with nothing in common agree on them. */
    uint64_t seed = 1;
    for (int i = 0; i < RANDOM; i++) {
        double toi;
        q[i] = swept_random(&seed, i % 2);
        q[i].truth = cubic_test(&q[i], &toi);
    }
    compare("random, truth from the cubic", q, RANDOM);
    free(q);
    return 0;
}
