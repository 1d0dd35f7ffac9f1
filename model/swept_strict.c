/* The strict mode of the swept test: where the steps in double get stuck, one in twice the precision. */
#include "model/swept_internal.h"

#include "solvers/base.h"

#include <string.h>

/* The sum of two doubles, |lo| <= ulp(hi) / 2. Error of each sum and product below: a few 2^-106 of the sum
 * of the operands' sizes or of the product (Dekker 1971). */
typedef struct twice {
    double hi, lo;
} twice;

/* A step below this part of the motion is no progress: contact. */
static const double STRICT_STEP = 1e-12;
enum {
    STRICT_STEPS = 128, /* in double, each round */
    ROUNDS = 16,        /* exact steps; sliding contacts take 1 or 2 */
    POINTS = 8          /* corners at two times */
};

static twice renormalise(double a, double b) {
    const double s = a + b;
    return (twice){s, b - (s - a)};
}

static twice add(twice a, twice b) {
    const double s = a.hi + b.hi, z = s - a.hi;
    return renormalise(s, ((a.hi - (s - z)) + (b.hi - z)) + (a.lo + b.lo));
}

static twice negative(twice a) {
    return (twice){-a.hi, -a.lo};
}

static twice times(twice a, twice b) {
    const double p = a.hi * b.hi;
    return renormalise(p, fma(a.hi, b.hi, -p) + (a.hi * b.lo + a.lo * b.hi));
}

/* *size: sum of the products' sizes. */
static twice dot(const twice a[3], const twice b[3], double *size) {
    twice sum = {0, 0};
    *size = 0;
    for (int k = 0; k < 3; k++) {
        const twice p = times(a[k], b[k]);
        *size += fabs(p.hi);
        sum = add(sum, p);
    }
    return sum;
}

/* Exact corner: the difference of two doubles is one of these, but for underflow (MORPH_SWEPT_TINY). */
static void exact_corners(const morph_swept_polygon *p, twice d[2][4][3]) {
    for (int e = 0; e < 2; e++)
        for (int j = 0; j < p->corners; j++)
            for (int k = 0; k < 3; k++) {
                const double a = p->plus[e][j][k], b = p->minus[e][j][k], s = a - b, z = s - a;
                const double low = (a - (s - z)) - (b + z);
                d[e][j][k] = (twice){ldexp(s, -p->exponent), ldexp(low, -p->exponent)};
            }
}

/* Proven free times of w (largest component about 1), as morph_swept_free. A dot product errs by less than
 * 30 times 2^-106 of its products: 2^-100 covers it. The bounds v are then rounded to double: 2u more at the
 * root.
 */
static morph_swept_span exact_free(const morph_swept_polygon *p, twice d[2][4][3], const twice w[3]) {
    morph_swept_span free = {-1, 2};
    const morph_swept_span none = {2, -1};
    const double u = MORPH_SWEPT_ROUND, plain[3] = {w[0].hi, w[1].hi, w[2].hi};
    const double gap = p->separation > 0 ? p->separation * morph_norm(plain) * (1 + 16 * u) : 0;
    for (int j = 0; j < p->corners; j++) {
        double v[2];
        for (int e = 0; e < 2; e++) {
            double size;
            const twice value = dot(w, d[e][j], &size);
            v[e] = add(value, (twice){-(0x1p-100 * size + MORPH_SWEPT_TINY) - gap * (1 + u), 0}).hi;
        }
        if (v[0] > 0 && v[1] > 0) continue;
        if (!(v[0] > 0) && !(v[1] > 0)) return none;
        const double root = v[0] / (v[0] - v[1]);
        if (v[0] > 0) {
            const double r = root * (1 - 8 * u);
            if (!(r >= free.hi)) free.hi = r;
        } else {
            const double r = root * (1 + 8 * u);
            if (!(r <= free.lo)) free.lo = r;
        }
    }
    return free;
}

/* Corners at time t, each scaled to size 1: only their directions matter. False if one is at the origin. */
static bool directions_at(const morph_swept_polygon *p, twice d[2][4][3], double t, twice x[][3]) {
    const twice before = {1 - t, 0}, after = {t, 0};
    for (int j = 0; j < p->corners; j++) {
        double size = 0;
        for (int k = 0; k < 3; k++) {
            x[j][k] = add(times(before, d[0][j][k]), times(after, d[1][j][k]));
            size = fmax(size, fabs(x[j][k].hi));
        }
        if (!(size > 1e-280)) return false;
        for (int k = 0; k < 3; k++)
            x[j][k] = times(x[j][k], (twice){1 / size, 0});
    }
    return true;
}

/* +1 or -1 if that times r has no point on its negative side, 0 if neither; FLAT if all points are on its
 * plane. Of directions of size 1: 2^-90 is above the rounding of two cross products and of this. */
enum { FLAT = 2 };
static int side(const twice r[3], twice x[][3], int points) {
    int above = 0, below = 0;
    for (int i = 0; i < points; i++) {
        double size;
        const double v = dot(r, x[i], &size).hi;
        above += v > 0x1p-90;
        below += v < -0x1p-90;
        if (above && below) return 0;
    }
    return above ? 1 : below ? -1 : FLAT;
}

/* r = a x b, divided by its size. False if that is rounding. */
static bool unit_cross(const twice a[3], const twice b[3], twice r[3]) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        r[k] = add(times(a[i], b[j]), negative(times(a[j], b[i])));
        size = fmax(size, fabs(r[k].hi));
    }
    if (!(size > 0x1p-80)) return false;
    for (int k = 0; k < 3; k++)
        r[k] = times(r[k], (twice){1 / size, 0});
    return true;
}

static void gather(twice w[3], const twice r[3], int sign) {
    for (int k = 0; k < 3; k++)
        w[k] = sign < 0 ? add(w[k], negative(r[k])) : add(w[k], r[k]);
}

/* The directions w with w . x > 0 for all points are a cone, and its edges are cross products of two of the
 * points: the sum of those that no point is below lies within the cone, if there is one. Points in a plane
 * through the origin have a wedge instead, its edges perpendicular to two of the points in that plane. */
static bool cone_direction(twice x[][3], int points, twice w[3]) {
    bool line = true;
    memset(w, 0, 3 * sizeof *w);
    for (int i = 0; i < points; i++)
        for (int j = i + 1; j < points; j++) {
            twice r[3], q[3];
            if (!unit_cross(x[i], x[j], r)) continue;
            line = false;
            const int sign = side(r, x, points);
            if (sign != FLAT) {
                if (sign) gather(w, r, sign);
                continue;
            }
            for (int e = 0; e < 2; e++) {
                if (!unit_cross(r, x[e ? j : i], q)) continue;
                const int within = side(q, x, points);
                if (within && within != FLAT) gather(w, q, within);
            }
        }
    if (line) memcpy(w, x[0], 3 * sizeof *w);
    const double size = fmax(fabs(w[0].hi), fmax(fabs(w[1].hi), fabs(w[2].hi)));
    if (!(size > 0x1p-90)) return false;
    for (int k = 0; k < 3; k++)
        w[k] = times(w[k], (twice){1 / size, 0});
    return true;
}

/* Longest step found from t: shortens it eightfold until the corners at both ends leave a direction. Returns
 * the end of what is free, t if nothing is. */
static double exact_step(const morph_swept_polygon *p, twice d[2][4][3], double t) {
    twice x[POINTS][3], w[3];
    if (!directions_at(p, d, t, x)) return t;
    for (double h = fmax(1 - t, 2 * STRICT_STEP); h > STRICT_STEP; h /= 8) {
        if (!directions_at(p, d, t + h < 1 ? t + h : 1, x + p->corners)) continue;
        if (!cone_direction(x, 2 * p->corners, w)) continue;
        const morph_swept_span s = exact_free(p, d, w);
        if (s.lo < t && s.hi > t + STRICT_STEP) return s.hi;
    }
    return t;
}

/* Finer steps in double first: they follow what turns, the exact ones pass what nearly touches. */
bool morph_swept_strict(const morph_swept_polygon *p, double *toi) {
    twice d[2][4][3];
    exact_corners(p, d);
    double t = *toi;
    for (int i = 0; i < ROUNDS; i++) {
        if (!morph_swept_advance(p, STRICT_STEP, STRICT_STEPS, &t)) return false;
        const double until = exact_step(p, d, t);
        if (until > 1) return false;
        if (!(until > t)) break;
        t = until;
    }
    *toi = t;
    return true;
}
