/* The swept queries with ground truth, and random ones, for test and benchmark. */
#ifndef SWEPT_QUERIES_H
#define SWEPT_QUERIES_H

#include "model/swept.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { SWEPT_QUERIES = 4324, SWEPT_COLLIDING = 426 };

/* Vertex, then triangle; or edge a, then edge b; 4 points at t = 0, 4 at t = 1. */
typedef struct swept_query {
    bool edges, truth;
    double x[2][4][3];
} swept_query;

static inline bool swept_run(const swept_query *q, const morph_swept_options *options, double *toi) {
    const double(*a)[3] = (const double(*)[3])q->x[0], (*b)[3] = (const double(*)[3])q->x[1];
    return q->edges ? morph_swept_edge_edge(a, a + 2, b, b + 2, options, toi)
                    : morph_swept_vertex_triangle(a[0], a + 1, b[0], b + 1, options, toi);
}

/* Lines of type,id,24 coordinates,truth. Returns how many were read, -1 where the file cannot be read. */
static inline int swept_read(const char *path, swept_query *q, int capacity) {
    FILE *file = fopen(path, "r");
    if (!file) return -1;
    char line[2048];
    int n = 0;
    while (n < capacity && fgets(line, sizeof line, file)) {
        if (line[0] != 'V' && line[0] != 'E') continue;
        int comma = 0, i = 0;
        while (line[i] && comma < 2)
            comma += line[i++] == ',';
        char *at = line + i, *end = at;
        double *x = &q[n].x[0][0][0];
        for (i = 0; i < 24; i++, at = end + 1) {
            x[i] = strtod(at, &end);
            if (end == at || *end != ',') break;
        }
        if (i < 24) break;
        q[n].edges = line[0] == 'E';
        q[n++].truth = *at == '1';
    }
    fclose(file);
    return n;
}

static inline double swept_uniform(uint64_t *seed, double lo, double hi) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(*seed >> 11) / 9007199254740992.0;
}

/* All 8 points in the unit box: about a sixth meet. */
static inline swept_query swept_random(uint64_t *seed, bool edges) {
    swept_query q = {.edges = edges, .truth = false};
    double *x = &q.x[0][0][0];
    for (int i = 0; i < 24; i++)
        x[i] = swept_uniform(seed, 0, 1);
    return q;
}

#endif
