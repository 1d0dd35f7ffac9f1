/* Swept test: the moving polygon, its free times, the advance in the fast mode. */
#include "model/swept_internal.h"

#include "solvers/base.h"

/* A step of the fast mode below this part of the motion is no progress. Most contacts are approached by steps
 * that shrink quadratically; smaller numbers cost little, and gain nothing on near misses. */
static const double FAST_STEP = 1e-7;
/* Steps that shrink slower than this are those of a pair that slides or turns past each other: worth a
 * turning direction, but not before a plain step or two, which is all that most pairs need. */
static const double SLOW = 0.5;
enum { FAST_STEPS = 64, TURNING_AFTER = 2 };

morph_swept_options morph_swept_defaults(void) {
    return (morph_swept_options){.separation = 0, .strict = false};
}

/* Rounding: d = fl(D) has |d - D| <= u |d|, the sum of three products errs by 3u sum |w_k d_k|, and the three
 * subtractions below by u of the same sum each: 7u together, so that 8u covers the products of the u's as
 * well. |w| errs by 3u, its product with the separation by 2u more.
 * Lower bounds v0, v1 at both ends bound the linear function between them; where their signs differ it is
 * positive on one side of v0 / (v0 - v1), a quotient with 2u of error. */
morph_swept_span morph_swept_free(const morph_swept_polygon *p, const double w[3]) {
    morph_swept_span free = {-1, 2};
    const morph_swept_span none = {2, -1};
    const double u = MORPH_SWEPT_ROUND;
    const double gap = p->separation > 0 ? p->separation * morph_norm(w) * (1 + 8 * u) : 0;
    for (int j = 0; j < p->corners; j++) {
        double v[2];
        for (int e = 0; e < 2; e++) {
            const double *d = p->at[e][j];
            const double a = w[0] * d[0], b = w[1] * d[1], c = w[2] * d[2];
            v[e] = (a + b + c) - 8 * u * (fabs(a) + fabs(b) + fabs(c)) - gap - MORPH_SWEPT_TINY;
        }
        if (v[0] > 0 && v[1] > 0) continue;
        if (!(v[0] > 0) && !(v[1] > 0)) return none;
        const double root = v[0] / (v[0] - v[1]);
        if (v[0] > 0) {
            const double r = root * (1 - 4 * u);
            if (!(r >= free.hi)) free.hi = r;
        } else {
            const double r = root * (1 + 4 * u);
            if (!(r <= free.lo)) free.lo = r;
        }
    }
    return free;
}

/* Apart along a coordinate axis for the whole motion. Differences of doubles have the right sign, and their
 * relative error u is covered by the 4u. */
static bool boxes_apart(const morph_swept_polygon *p) {
    const double gap = p->separation * (1 + 4 * MORPH_SWEPT_ROUND);
    for (int k = 0; k < 3; k++) {
        double lo = p->at[0][0][k], hi = lo;
        for (int e = 0; e < 2; e++)
            for (int j = 0; j < p->corners; j++) {
                const double d = p->at[e][j][k];
                lo = d < lo ? d : lo;
                hi = d > hi ? d : hi;
            }
        if (lo > gap || hi < -gap) return true;
    }
    return false;
}

static void extend(const morph_swept_polygon *p, const double w[3], double t, double *until) {
    const morph_swept_span s = morph_swept_free(p, w);
    if (s.lo < t && s.hi > *until) *until = s.hi;
}

/* Tries both signs of every candidate. */
static void extend_further(const morph_swept_polygon *p, const double x[4][3], const double normal[3],
                           double t, double *until) {
    double w[MORPH_SWEPT_CANDIDATES][3];
    const int n = morph_swept_candidates(p->corners, x, normal, w);
    for (int i = 0; i < n; i++)
        for (int sign = 0; sign < 2; sign++) {
            extend(p, w[i], t, until);
            for (int k = 0; k < 3; k++)
                w[i][k] = -w[i][k];
        }
}

/* Turning direction: w(s) = (1-s) a + s b while t goes from lo to hi. With corner x(s), linear too, w . x is
 * the quadratic with Bernstein points a.x(lo), (a.x(hi) + b.x(lo)) / 2, b.x(hi), and |w| is at most the
 * longer of |a| and |b|: apart where all of these are above separation times that. Errors: 4u of the sum of
 * products, as in morph_swept_free, and 3u for each of the weights 1-t and t and their sum; 16u covers it. */
static bool turning_free(const morph_swept_polygon *p, const double a[3], const double b[3], double lo,
                         double hi) {
    const double u = MORPH_SWEPT_ROUND, *w[2] = {a, b}, time[2] = {lo, hi};
    const double gap = p->separation * fmax(morph_norm(a), morph_norm(b)) * (1 + 8 * u);
    for (int j = 0; j < p->corners; j++) {
        double value[2][2], products = 0;
        for (int i = 0; i < 2; i++) {
            double end[2];
            for (int e = 0; e < 2; e++) {
                const double *d = p->at[e][j];
                const double f = w[i][0] * d[0], g = w[i][1] * d[1], h = w[i][2] * d[2];
                const double sum = fabs(f) + fabs(g) + fabs(h);
                end[e] = f + g + h;
                products = sum > products ? sum : products;
            }
            for (int k = 0; k < 2; k++)
                value[i][k] = (1 - time[k]) * end[0] + time[k] * end[1];
        }
        const double least = 16 * u * products + gap + MORPH_SWEPT_TINY;
        if (!(value[0][0] > least && value[1][1] > least && 0.5 * (value[0][1] + value[1][0]) > least))
            return false;
    }
    return true;
}

/* A longer step than `until` by a turning direction. *reach: how far it is worth trying. */
static void extend_turning(const morph_swept_polygon *p, const double w[3], double t, double *reach,
                           double *until) {
    double x[4][3], next[3], normal[3];
    const double h = fmax(*reach, 8 * (*until - t)), hi = t + h < 1 ? t + h : 1;
    morph_swept_corners(p, hi, x);
    if (morph_swept_direction(p->corners, (const double(*)[3])x, next, normal) &&
        turning_free(p, w, next, t, hi)) {
        *until = hi < 1 ? hi : 2;
        *reach = 2 * h;
    } else {
        *reach = h / 4;
    }
}

/* Least step that counts as progress: `least` of the motion, or of the pair's own size where that is the
 * smaller; but never below what time itself resolves. */
static double least_step(const morph_swept_polygon *p, double least) {
    double travel = 0, size = p->separation;
    for (int j = 0; j < p->corners; j++) {
        const int next = j + 1 < p->corners ? j + 1 : 0;
        travel = fmax(travel, morph_dist(p->at[0][j], p->at[1][j]));
        for (int e = 0; e < 2; e++)
            size = fmax(size, morph_dist(p->at[e][j], p->at[e][next]));
    }
    return size < travel ? fmax(least * size / travel, 1e-15) : least;
}

bool morph_swept_advance(const morph_swept_polygon *p, double least, int steps, double *toi) {
    double t = *toi, reach = 0, last = 0;
    bool stuck = false;
    for (int i = 0; i < steps && !stuck; i++) {
        double x[4][3], w[3], normal[3], until = t;
        morph_swept_corners(p, t, x);
        const bool known = morph_swept_direction(p->corners, (const double(*)[3])x, w, normal);
        if (known) extend(p, w, t, &until);
        const double step = until - t;
        if (until <= 1 && known && i >= TURNING_AFTER && step > SLOW * last)
            extend_turning(p, w, t, &reach, &until);
        last = step;
        if (until <= 1 && until - t < least) {
            extend_further(p, (const double(*)[3])x, normal, t, &until);
            stuck = until - t < least && until - t < least_step(p, least);
        }
        if (until > 1) return false;
        t = until;
    }
    *toi = t;
    return true;
}

/* Brings sizes outside 2^-200 .. 2^200 near 1, by a power of two. What then underflows is far below
 * MORPH_SWEPT_TINY. A separation that underflows is rounded up; one beyond 16 times the size is beyond all
 * distances, whatever its value. */
static void rescale(morph_swept_polygon *p, double size) {
    (void)frexp(size, &p->exponent);
    for (int e = 0; e < 2; e++)
        for (int j = 0; j < p->corners; j++)
            for (int k = 0; k < 3; k++)
                p->at[e][j][k] = ldexp(p->at[e][j][k], -p->exponent);
    const double s = p->separation;
    if (s > 0) p->separation = s > 16 * size ? 16 : ldexp(s, -p->exponent) + MORPH_SWEPT_TINY;
}

/* Corners from the end points; false where a coordinate is not usable. */
static bool build(morph_swept_polygon *p, double *size) {
    bool usable = true;
    double most = 0;
    for (int e = 0; e < 2; e++)
        for (int j = 0; j < p->corners; j++)
            for (int k = 0; k < 3; k++) {
                const double a = p->plus[e][j][k], b = p->minus[e][j][k], d = a - b, m = fabs(d);
                usable &= fabs(a) <= 0x1p1000 && fabs(b) <= 0x1p1000;
                p->at[e][j][k] = d;
                most = m > most ? m : most;
            }
    *size = most;
    return usable;
}

static bool solve(morph_swept_polygon *p, const morph_swept_options *options, double *toi) {
    const morph_swept_options o = options ? *options : morph_swept_defaults();
    double ignored, size;
    if (!toi) toi = &ignored;
    *toi = 0;
    /* All corners at the origin: in contact throughout. */
    if (!build(p, &size) || !(o.separation < INFINITY) || size == 0) return true;
    p->separation = o.separation > 0 ? o.separation : 0;
    p->exponent = 0;
    if (!(size > 0x1p-200 && size < 0x1p200)) rescale(p, size);
    const bool hit = !boxes_apart(p) && morph_swept_advance(p, FAST_STEP, FAST_STEPS, toi) &&
                     (!o.strict || morph_swept_strict(p, toi));
    if (!hit) *toi = INFINITY;
    return hit;
}

bool morph_swept_vertex_triangle(const double p0[3], const double t0[3][3], const double p1[3],
                                 const double t1[3][3], const morph_swept_options *options, double *toi) {
    morph_swept_polygon p;
    p.corners = 3;
    for (int j = 0; j < 3; j++) {
        p.plus[0][j] = t0[j];
        p.plus[1][j] = t1[j];
        p.minus[0][j] = p0;
        p.minus[1][j] = p1;
    }
    return solve(&p, options, toi);
}

/* a(r) - b(s) over r, s in [0, 1] is a parallelogram; around it: a0-b0, a1-b0, a1-b1, a0-b1. */
bool morph_swept_edge_edge(const double a0[2][3], const double b0[2][3], const double a1[2][3],
                           const double b1[2][3], const morph_swept_options *options, double *toi) {
    morph_swept_polygon p;
    p.corners = 4;
    for (int j = 0; j < 4; j++) {
        const int i = j == 1 || j == 2, k = j >= 2;
        p.plus[0][j] = a0[i];
        p.plus[1][j] = a1[i];
        p.minus[0][j] = b0[k];
        p.minus[1][j] = b1[k];
    }
    return solve(&p, options, toi);
}
