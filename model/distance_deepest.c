/* Deepest point of a segment or triangle in the mesh: branch and bound over pieces of the element.
 *
 * For a piece with centre c and radius r, both are lower bounds of the signed distance phi over it:
 *     phi(c) - r                          phi is 1-Lipschitz (closed meshes only),
 *     - max over corners v of dist(v, T)  for any one triangle T of the mesh: where phi is negative,
 *                                         -phi(q) = dist(q, mesh) <= dist(q, T), convex in q.
 * With T the closest to c the second is exact for a piece whose closest triangle is one plane, so flat
 * contacts end at once. */
#include "model/distance_internal.h"

#include <string.h>

enum {
    PIECES = 400, /* point queries of the search: about half a millisecond */
    POLISH = 240  /* and of the descent after it, where the search ended early */
};

/* Depth is wanted to this share of the element's size: far below the 1e-3 spacings that a check forgives.
 * Along ridges of equal depth the pieces run out first; what the descent then leaves is about 1e-4. */
static const double DEPTH_TOLERANCE = 1e-6;

typedef struct piece {
    double weight[3][3]; /* of each corner, on the element */
    double bound;
} piece;

typedef struct descent {
    const morph_distance *d;
    const double (*corner)[3];
    int corners;
    double *weight;
    morph_closest *best;
    piece heap[PIECES];
    int size, queries;
} descent;

static void locate(const descent *s, const double weight[3], double out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = 0;
        for (int j = 0; j < s->corners; j++)
            out[k] += weight[j] * s->corner[j][k];
    }
}

static void push(descent *s, const piece *p) {
    int i = s->size++;
    for (; i > 0 && s->heap[(i - 1) / 2].bound > p->bound; i = (i - 1) / 2)
        s->heap[i] = s->heap[(i - 1) / 2];
    s->heap[i] = *p;
}

static piece pop(descent *s) {
    const piece least = s->heap[0], last = s->heap[--s->size];
    int i = 0;
    for (;;) {
        int child = 2 * i + 1;
        if (child >= s->size) break;
        if (child + 1 < s->size && s->heap[child + 1].bound < s->heap[child].bound) child++;
        if (last.bound <= s->heap[child].bound) break;
        s->heap[i] = s->heap[child];
        i = child;
    }
    s->heap[i] = last;
    return least;
}

/* Evaluates the centre, updates the best, sets the bound (never below the parent's). */
static void examine(descent *s, piece *p, double parent) {
    double at[3][3], weight[3], centre[3], radius = 0;
    for (int j = 0; j < 3; j++) {
        weight[j] = 0;
        for (int m = 0; m < s->corners; m++)
            weight[j] += p->weight[m][j] / s->corners;
    }
    locate(s, weight, centre);
    morph_nearest nearest = {.squared = INFINITY};
    morph_closest c;
    morph_tree_nearest(s->d, centre, -1, &nearest);
    morph_nearest_finish(s->d, centre, &nearest, &c);
    s->queries++;
    if (c.distance < s->best->distance) {
        *s->best = c;
        memcpy(s->weight, weight, sizeof weight);
    }
    double deepest = 0;
    for (int m = 0; m < s->corners; m++) {
        int feature;
        double point[3];
        locate(s, p->weight[m], at[m]);
        radius = fmax(radius, morph_dist(at[m], centre));
        deepest = fmax(deepest, morph_facet_nearest(&s->d->facet[nearest.slot], at[m], &feature, point));
    }
    p->bound = fmax(parent, -sqrt(deepest));
    if (s->d->closed) p->bound = fmax(p->bound, c.distance - radius);
}

/* Halves p across its longest edge. */
static void halve(const descent *s, const piece *p, piece half[2]) {
    int from = 0, to = 1;
    double longest = -1;
    const int edges = s->corners == 3 ? 3 : 1;
    for (int e = 0; e < edges; e++) {
        double a[3], b[3];
        locate(s, p->weight[e], a);
        locate(s, p->weight[(e + 1) % 3], b);
        if (morph_dist(a, b) > longest) {
            longest = morph_dist(a, b);
            from = e;
            to = (e + 1) % 3;
        }
    }
    half[0] = half[1] = *p;
    for (int j = 0; j < 3; j++)
        half[0].weight[to][j] = half[1].weight[from][j] = (p->weight[from][j] + p->weight[to][j]) / 2;
}

/* Descent from the best point along the element's edge directions, halving the step: only where the search
 * ran out of pieces, as along a shallow, long contact. */
static void polish(descent *s) {
    static const int give[6] = {0, 1, 0, 2, 1, 2}, take[6] = {1, 0, 2, 0, 2, 1};
    const int directions = s->corners == 3 ? 6 : 2;
    double step = 1.0 / 16; /* about the size of the pieces left */
    for (int queries = 0; step > DEPTH_TOLERANCE && queries < POLISH;) {
        bool moved = false;
        for (int m = 0; m < directions; m++) {
            double weight[3], p[3];
            memcpy(weight, s->weight, sizeof weight);
            const double move = fmin(step, weight[give[m]]);
            if (!(move > 0)) continue;
            weight[give[m]] -= move;
            weight[take[m]] += move;
            morph_closest c;
            locate(s, weight, p);
            morph_distance_point(s->d, p, &c);
            queries++;
            if (!(c.distance < s->best->distance)) continue;
            *s->best = c;
            memcpy(s->weight, weight, sizeof weight);
            moved = true;
        }
        if (!moved) step /= 2;
    }
}

void morph_deepest(const morph_distance *d, const double corner[][3], int corners, double weight[3],
                   morph_closest *best) {
    descent s = {.d = d, .corner = corner, .corners = corners, .weight = weight, .best = best};
    double size = 0;
    for (int j = 1; j < corners; j++)
        size = fmax(size, morph_dist(corner[j], corner[0]));
    piece root = {.weight = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    examine(&s, &root, -INFINITY);
    push(&s, &root);
    while (s.size > 0 && s.queries + 2 <= PIECES && s.size + 2 <= PIECES) {
        const piece p = pop(&s);
        if (!(p.bound < best->distance - DEPTH_TOLERANCE * size)) return;
        piece half[2];
        halve(&s, &p, half);
        for (int i = 0; i < 2; i++) {
            examine(&s, &half[i], p.bound);
            if (half[i].bound < best->distance - DEPTH_TOLERANCE * size) push(&s, &half[i]);
        }
    }
    if (s.size > 0) polish(&s);
}
