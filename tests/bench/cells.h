/* The shortest time along a path by search over cells of (s, speed, acceleration): for benches.
 *
 * From rest at s = 0, node by node: of all states that a sampled jerk, constant between two nodes, leads to
 * within every limit, each cell keeps the one reached first, as it is and not as the cell's centre. The same
 * from the end backwards, which is forwards along the reversed path; the two meet in the best pair that
 * shares a cell of some node between. What is found is a way through all of the states, whatever the
 * problem's shape; it is as coarse as its cells, and where the two halves meet it jumps by a cell's width at
 * most. */
#ifndef MORPH_BENCH_CELLS_H
#define MORPH_BENCH_CELLS_H

#include "profile.h"
#include "without_jerk.h"

#include <string.h>

enum { CELLS = 48, JERKS = 13, CELL_NODES = 80 };

/* A state, and how it was reached. */
typedef struct cell {
    double time, v, a, h, j; /* time INFINITY: empty; h, j: of the piece that led here */
    int from;                /* cell of the node before */
} cell;

/* One direction: nodes in its own order. */
typedef struct way {
    int links;
    const double *s;   /* CELL_NODES + 1 distances from its start */
    station *at;       /* CELL_NODES + 1: rows of accelerations */
    double (*row)[2];  /* behind at */
    double (*jerk)[3]; /* (CELL_NODES + 1) x links: of v^3, 3 v a, j */
    cell *cell;        /* (CELL_NODES + 1) x CELLS x CELLS */
} way;

static cell *cell_of(const way *w, int node, int which) {
    return &w->cell[(size_t)node * CELLS * CELLS + (size_t)which];
}

/* Largest x = v^2 that links allow with some acceleration. */
static double most_square(const station *at, int links) {
    double lo = 0.0, hi = at->most;
    for (int k = 0; k < 60; k++) {
        const double x = 0.5 * (lo + hi);
        double from = -INFINITY, to = INFINITY;
        if (room(at, links, x, &from, &to))
            lo = x;
        else
            hi = x;
    }
    return lo;
}

/* The cell of a state by shares of the largest speed and of the accelerations allowed at this speed; -1
 * outside the limits. */
static int which_cell(const way *w, int node, double v, double a) {
    const station *at = &w->at[node];
    double lo = -INFINITY, hi = INFINITY;
    if (v < 0.0 || v * v > at->most || !room(at, w->links, v * v, &lo, &hi) || a < lo || a > hi) return -1;
    const int i = (int)(CELLS * v / sqrt(at->most)), k = (int)(CELLS * (a - lo) / (hi - lo + 1e-300));
    return (i < CELLS ? i : CELLS - 1) * CELLS + (k < CELLS ? k : CELLS - 1);
}

/* Jerks allowed in a state. */
static bool jerk_room(const way *w, int node, double v, double a, double *lo, double *hi) {
    *lo = -INFINITY;
    *hi = INFINITY;
    for (int l = 0; l < w->links; l++) {
        const double *k = w->jerk[(size_t)node * (size_t)w->links + (size_t)l];
        const double c = k[0] * v * v * v + 3.0 * k[1] * v * a;
        if (fabs(k[2]) < 1e-12) {
            if (fabs(c) > 1.0) return false;
            continue;
        }
        *lo = fmax(*lo, fmin((1.0 - c) / k[2], (-1.0 - c) / k[2]));
        *hi = fmin(*hi, fmax((1.0 - c) / k[2], (-1.0 - c) / k[2]));
    }
    return *lo <= *hi;
}

/* The time over a distance, moving forward all along: the first root of v h + a h^2/2 + j h^3/6 = ds by
 * bisection up to where the speed would vanish. Negative: it turns back before. */
static double time_over(double v, double a, double j, double ds) {
    double h = 1e-9;
    /* Double until beyond, the speed watched at every step; then halve. */
    while (h * (v + h * (a / 2.0 + h * j / 6.0)) < ds) {
        if (v + h * (a + h * j / 2.0) <= 0.0 || h > 1e6) return -1.0;
        h *= 1.25;
    }
    double lo = h / 1.25, hi = h;
    for (int k = 0; k < 45; k++) {
        const double m = 0.5 * (lo + hi);
        if (m * (v + m * (a / 2.0 + m * j / 6.0)) < ds)
            lo = m;
        else
            hi = m;
    }
    return hi;
}

/* All ways on from one state. */
static void spread(const way *w, int node, int which) {
    const cell c = *cell_of(w, node, which);
    double lo, hi;
    if (!jerk_room(w, node, c.v, c.a, &lo, &hi)) return;
    for (int k = 0; k < JERKS; k++) {
        const double j = lo + (hi - lo) * k / (JERKS - 1),
                     h = time_over(c.v, c.a, j, w->s[node + 1] - w->s[node]);
        if (h < 0.0) continue;
        const double v = c.v + h * (c.a + h * j / 2.0), a = c.a + h * j;
        const int to = which_cell(w, node + 1, v, a);
        double from, until;
        if (to < 0 || c.time + h >= cell_of(w, node + 1, to)->time) continue;
        if (!jerk_room(w, node + 1, v, a, &from, &until) || j < from || j > until) continue;
        *cell_of(w, node + 1, to) = (cell){c.time + h, v, a, h, j, which};
    }
}

static void way_free(way *w) {
    free(w->at);
    free(w->row);
    free(w->jerk);
    free(w->cell);
}

/* Limits at the nodes; sign -1: along the reversed path, whose odd derivatives change their sign. */
static bool way_create(morph_path_table *table, const double *s, double sign, way *w) {
    const morph_structure *st = table->curve->structure;
    const size_t nodes = CELL_NODES + 1, links = (size_t)st->links;
    *w = (way){.links = st->links, .s = s};
    w->at = morph_alloc(nodes, sizeof *w->at);
    w->row = morph_alloc(nodes * links, sizeof *w->row);
    w->jerk = morph_alloc(nodes * links, sizeof *w->jerk);
    w->cell = morph_alloc(nodes * CELLS * CELLS, sizeof *w->cell);
    if (!w->at || !w->row || !w->jerk || !w->cell) return false;
    for (size_t i = 0; i < nodes; i++) {
        w->at[i] = (station){1e9, &w->row[i * links]};
        morph_path_table_exact(table, sign > 0.0 ? s[i] : 1.0 - s[i], 3);
        for (size_t l = 0; l < links; l++) {
            const double one = sign * table->exact[links + l], two = table->exact[2 * links + l],
                         three = sign * table->exact[3 * links + l], v = one / st->rate_limit[l];
            w->at[i].most = fmin(w->at[i].most, 1.0 / (v * v + 1e-30));
            w->at[i].row[l][0] = two / st->acceleration_limit[l];
            w->at[i].row[l][1] = one / st->acceleration_limit[l];
            double *k = w->jerk[i * links + l];
            k[0] = three / st->jerk_limit[l];
            k[1] = two / st->jerk_limit[l];
            k[2] = one / st->jerk_limit[l];
        }
        w->at[i].most = most_square(&w->at[i], w->links);
        for (int c = 0; c < CELLS * CELLS; c++)
            cell_of(w, (int)i, c)->time = INFINITY;
    }
    return true;
}

static void way_run(way *w) {
    const int first = which_cell(w, 0, 0.0, 0.0);
    if (first < 0) return;
    *cell_of(w, 0, first) = (cell){.from = -1};
    for (int i = 0; i + 1 < CELL_NODES; i++)
        for (int c = 0; c < CELLS * CELLS; c++)
            if (cell_of(w, i, c)->time < INFINITY) spread(w, i, c);
}

/* The pair of states, one of each way, in one cell of a node, that takes least in all. The other way's
 * accelerations have the opposite sign. */
static double meet(const way *w, const way *back, int *node, int *which, int *other) {
    double best = INFINITY;
    for (int i = CELL_NODES / 4; i <= 3 * CELL_NODES / 4; i++)
        for (int c = 0; c < CELLS * CELLS; c++) {
            const int mirror = c / CELLS * CELLS + CELLS - 1 - c % CELLS;
            const double time = cell_of(w, i, c)->time + cell_of(back, CELL_NODES - i, mirror)->time;
            if (!(time < best)) continue;
            best = time;
            *node = i;
            *which = c;
            *other = mirror;
        }
    return best;
}

/* Nodes at even times of the quintic from rest to rest: finer towards both ends. A state keeps the piece that
 * led to it; a profile's piece starts at its node. */
static bool search_cells(morph_path_table *table, profile *out, double *time) {
    double s[CELL_NODES + 1];
    for (int i = 0; i <= CELL_NODES; i++) {
        const double t = (double)i / CELL_NODES;
        s[i] = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
    }
    way w, back = {0};
    bool ok =
        way_create(table, s, 1.0, &w) && way_create(table, s, -1.0, &back) && profile_create(CELL_NODES, out);
    if (ok) {
        int node = 0, which = 0, other = 0;
        way_run(&w);
        way_run(&back);
        *time = meet(&w, &back, &node, &which, &other);
        ok = *time < INFINITY;
        memcpy(out->s, s, sizeof s);
        for (int i = node; i > 0 && ok; i--) {
            const cell *c = cell_of(&w, i, which), *before = cell_of(&w, i - 1, c->from);
            out->v[i - 1] = before->v;
            out->a[i - 1] = before->a;
            out->h[i - 1] = c->h;
            out->j[i - 1] = c->j;
            which = c->from;
        }
        for (int i = node; i < CELL_NODES && ok; i++) {
            const cell *c = cell_of(&back, CELL_NODES - i, other);
            out->v[i] = c->v;
            out->a[i] = -c->a;
            out->h[i] = c->h;
            out->j[i] = c->j;
            other = c->from;
        }
        out->v[CELL_NODES] = out->a[CELL_NODES] = 0.0;
        if (!ok) profile_free(out);
    }
    way_free(&w);
    way_free(&back);
    return ok;
}

#endif
