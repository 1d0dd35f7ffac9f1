/* s over time as cubic pieces: for benches of timing. */
#ifndef MORPH_BENCH_PROFILE_H
#define MORPH_BENCH_PROFILE_H

#include "planner/timing_rows.h"

#include <stdlib.h>

/* A profile: cubic pieces of s between nodes, with the time of each. */
typedef struct profile {
    int n;                 /* pieces */
    double *s, *v, *a, *h; /* n + 1 each; h: n, s */
    double *j;             /* n */
} profile;

static bool profile_create(int n, profile *p) {
    const size_t m = (size_t)n + 1;
    double *all = morph_alloc(5 * m, sizeof *all);
    *p = (profile){.n = n};
    if (!all) return false;
    p->s = all;
    p->v = all + m;
    p->a = all + 2 * m;
    p->h = all + 3 * m;
    p->j = all + 4 * m;
    return true;
}

static void profile_free(profile *p) {
    free(p->s);
    *p = (profile){0};
}

static double profile_time(const profile *p) {
    double sum = 0.0;
    for (int i = 0; i < p->n; i++)
        sum += p->h[i];
    return sum;
}

/* s, v, a, j inside piece i, t after its start. */
static void profile_at(const profile *p, int i, double t, double out[4]) {
    const double j = p->j[i];
    out[0] = p->s[i] + t * (p->v[i] + t * (p->a[i] / 2.0 + t * j / 6.0));
    out[1] = p->v[i] + t * (p->a[i] + t * j / 2.0);
    out[2] = p->a[i] + t * j;
    out[3] = j;
}

/* The factor by which time must be stretched for all limits to hold on a grid of `per` points a piece. */
static double stretch(morph_path_table *table, const profile *p, int per) {
    const morph_structure *st = table->curve->structure;
    double worst = 0.0;
    for (int i = 0; i < p->n; i++)
        for (int k = 0; k <= per; k++) {
            double s[4];
            profile_at(p, i, p->h[i] * k / per, s);
            morph_path_table_exact(table, fmin(1.0, fmax(0.0, s[0])), 3);
            morph_timing_chain(st->links, table->exact, s, table->by_time);
            const double *q = table->by_time + st->links;
            for (int l = 0; l < st->links; l++) {
                worst = fmax(worst, fabs(q[l]) / st->rate_limit[l]);
                worst = fmax(worst, sqrt(fabs(q[st->links + l]) / st->acceleration_limit[l]));
                worst = fmax(worst, cbrt(fabs(q[2 * st->links + l]) / st->jerk_limit[l]));
            }
        }
    return worst;
}

static void slow_down(profile *p, double f) {
    for (int i = 0; i <= p->n; i++) {
        p->v[i] /= f;
        p->a[i] /= f * f;
        if (i == p->n) break;
        p->h[i] *= f;
        p->j[i] /= f * f * f;
    }
}

#endif
