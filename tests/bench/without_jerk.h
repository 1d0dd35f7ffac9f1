/* The shortest time along a path without jerk limits: for benches. */
#ifndef MORPH_BENCH_WITHOUT_JERK_H
#define MORPH_BENCH_WITHOUT_JERK_H

#include "planner/timing_rows.h"

#include <stdlib.h>

/* One grid point: x = v^2 at most `most`; |a x + b u| <= 1 for every link, u = acceleration of s. */
typedef struct station {
    double most;
    double (*row)[2];
} station;

/* The accelerations that links allow at x. False: none. */
static bool room(const station *at, int links, double x, double *lo, double *hi) {
    for (int l = 0; l < links; l++) {
        const double a = at->row[l][0] * x, b = at->row[l][1];
        if (fabs(b) < 1e-12) {
            if (fabs(a) > 1.0) return false;
            continue;
        }
        const double one = (1.0 - a) / b, other = (-1.0 - a) / b;
        *lo = fmax(*lo, fmin(one, other));
        *hi = fmin(*hi, fmax(one, other));
    }
    return *lo <= *hi;
}

/* Can x here be brought to some x in [0, next] at the next point, ds farther: x + 2 ds u? */
static bool leads_on(const station *at, int links, double x, double ds, double next) {
    double lo = -x / (2.0 * ds), hi = (next - x) / (2.0 * ds);
    return room(at, links, x, &lo, &hi);
}

/* Backward: the largest x at each point from where the end at rest can be reached. What can be is an interval
 * from 0, since the limits are convex in (x, u) and hold at rest: bisection. */
static void backward(const station *at, int points, int links, double *most) {
    const double ds = 1.0 / (points - 1);
    most[points - 1] = 0.0;
    for (int i = points - 2; i >= 0; i--) {
        double lo = 0.0, hi = at[i].most;
        if (!leads_on(&at[i], links, hi, ds, most[i + 1])) {
            for (int k = 0; k < 60; k++) {
                const double x = 0.5 * (lo + hi);
                if (leads_on(&at[i], links, x, ds, most[i + 1]))
                    lo = x;
                else
                    hi = x;
            }
            hi = lo;
        }
        most[i] = hi;
    }
}

/* Forward: as fast as links and the backward pass allow. x is linear in s between points, so an interval
 * takes 2 ds / (v + v+). */
static double forward(const station *at, int points, int links, const double *most) {
    const double ds = 1.0 / (points - 1);
    double x = 0.0, time = 0.0;
    for (int i = 0; i + 1 < points; i++) {
        double lo = -x / (2.0 * ds), hi = (most[i + 1] - x) / (2.0 * ds);
        if (!room(&at[i], links, x, &lo, &hi)) hi = lo;
        const double next = fmin(most[i + 1], fmax(0.0, x + 2.0 * ds * hi));
        time += 2.0 * ds / (sqrt(x) + sqrt(next));
        x = next;
    }
    return time;
}

/* On `points` even points of s; NAN without memory. */
static double without_jerk(morph_path_table *table, int points) {
    const morph_structure *s = table->curve->structure;
    const int links = s->links;
    station *at = morph_alloc((size_t)points, sizeof *at);
    double(*row)[2] = morph_alloc((size_t)points * (size_t)links, sizeof *row);
    double *most = morph_alloc((size_t)points, sizeof *most), time = NAN;
    for (int i = 0; i < points && at && row && most; i++) {
        at[i] = (station){1e9, &row[(size_t)i * (size_t)links]};
        morph_path_table_exact(table, (double)i / (points - 1), 2);
        for (int l = 0; l < links; l++) {
            const double one = table->exact[links + l], two = table->exact[2 * links + l];
            const double v = fabs(one) / s->rate_limit[l];
            at[i].most = fmin(at[i].most, 1.0 / (v * v + 1e-30));
            at[i].row[l][0] = two / s->acceleration_limit[l];
            at[i].row[l][1] = one / s->acceleration_limit[l];
        }
    }
    if (at && row && most) {
        backward(at, points, links, most);
        time = forward(at, points, links, most);
    }
    free(at);
    free(row);
    free(most);
    return time;
}

#endif
