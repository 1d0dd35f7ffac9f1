/* Least signed distance over a segment or a triangle ("element").
 *
 * Clear of the mesh, the least distance is that of an element corner to the mesh, of a mesh vertex to the
 * element, or of an element edge to a mesh edge: all are tried, pruned by the tree. Crossings are found by
 * line tests whose sign is exactly opposite for the two triangles of an edge, so nothing slips between them.
 */
#include "model/distance_internal.h"

#include <float.h>
#include <string.h>

enum {
    CROSSINGS = 24, /* kept as starting points for the depth; finding more changes nothing but the start */
    INTERVALS = 8,  /* pieces of a line inside the element that are tried around a crossing */
    OPEN_GRID = 5   /* see open_inside */
};

typedef struct crossing {
    double weight[3];
    int slot;
} crossing;

typedef struct search {
    const morph_distance *d;
    const double (*corner)[3];
    int corners, axes;
    double lo[3], hi[3];
    double axis[2][3], offset[2]; /* unit axes along which the element has no extent, and where it lies */
    morph_facet facet;            /* of a triangle element */
    double best, weight[3];       /* least distance so far and where */
    crossing crossing[CROSSINGS];
    int crossings;
} search;

static void blend(const double corner[][3], int corners, const double *weight, double out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = 0;
        for (int j = 0; j < corners; j++)
            out[k] += weight[j] * corner[j][k];
    }
}

/* Directions square to the element: the normal of a triangle, two of a segment. */
static void set_axes(search *s) {
    s->axes = 0;
    if (s->corners == 3) {
        if (!(s->facet.inverse > 0)) return;
        const double scale = sqrt(s->facet.inverse);
        for (int k = 0; k < 3; k++)
            s->axis[0][k] = s->facet.normal[k] * scale;
        s->axes = 1;
    } else {
        double u[3], e[3] = {0};
        morph_sub(s->corner[1], s->corner[0], u);
        const double length = morph_norm(u);
        if (!(length > 0)) return;
        int least = 0;
        for (int k = 0; k < 3; k++) {
            u[k] /= length;
            if (fabs(u[k]) < fabs(u[least])) least = k;
        }
        e[least] = 1;
        morph_cross(u, e, s->axis[0]);
        const double norm = morph_norm(s->axis[0]);
        for (int k = 0; k < 3; k++)
            s->axis[0][k] /= norm;
        morph_cross(u, s->axis[0], s->axis[1]);
        s->axes = 2;
    }
    for (int i = 0; i < s->axes; i++)
        s->offset[i] = morph_dot(s->axis[i], s->corner[0]);
}

/* Lower bound of the distance between the element and a box, squared: the larger of what the coordinate axes
 * and what the element's own axes say. */
static double box_bound(const search *s, const double lo[3], const double hi[3]) {
    double sum = 0, own = 0;
    for (int k = 0; k < 3; k++) {
        const double out = fmax(lo[k] - s->hi[k], s->lo[k] - hi[k]);
        if (out > 0) sum += out * out;
    }
    for (int i = 0; i < s->axes; i++) {
        double at = -s->offset[i], extent = 0;
        for (int k = 0; k < 3; k++) {
            at += s->axis[i][k] * (lo[k] + hi[k]) / 2;
            extent += fabs(s->axis[i][k]) * (hi[k] - lo[k]) / 2;
        }
        /* Rounding of the projection must not prune a touching box. */
        const double out = fabs(at) - extent - 16 * DBL_EPSILON * s->d->reach;
        if (out > 0) own += out * out;
    }
    return fmax(sum, own);
}

/* Does segment ab meet the triangle?  With D = b - a and corners relative to a, the line passes edge uv on
 * the side of sign D.(u x v), exactly opposite for vu; all three alike (zero counts as both): it meets the
 * face. *t: where on ab. weight: on the triangle, proportional to the value of the opposite edge. */
static bool pierce(const double a[3], const double b[3], const morph_facet *f, double *t, double weight[3]) {
    double r[3][3], dir[3], cross[3], side[3];
    morph_sub(b, a, dir);
    for (int j = 0; j < 3; j++)
        morph_sub(f->corner[j], a, r[j]);
    for (int j = 0; j < 3; j++) {
        morph_cross(r[(j + 1) % 3], r[(j + 2) % 3], cross);
        side[j] = morph_dot(dir, cross);
    }
    const bool up = side[0] >= 0 && side[1] >= 0 && side[2] >= 0;
    const bool down = side[0] <= 0 && side[1] <= 0 && side[2] <= 0;
    const double sum = side[0] + side[1] + side[2];
    if (!(up || down) || !(fabs(sum) > 0)) return false;
    double to_b[3];
    morph_sub(f->corner[0], b, to_b);
    const double ha = morph_dot(f->normal, r[0]), hb = morph_dot(f->normal, to_b);
    if ((ha > 0 && hb > 0) || (ha < 0 && hb < 0) || !(fabs(ha - hb) > 0)) return false;
    *t = ha / (ha - hb);
    for (int j = 0; j < 3; j++)
        weight[j] = side[j] / sum;
    return true;
}

static void note_crossing(search *s, const double weight[3], int slot) {
    if (s->crossings < CROSSINGS) {
        crossing *c = &s->crossing[s->crossings++];
        memcpy(c->weight, weight, sizeof c->weight);
        c->slot = slot;
    }
    if (s->best > 0) {
        s->best = 0;
        memcpy(s->weight, weight, sizeof s->weight);
    }
}

static void note_distance(search *s, double distance, const double weight[3]) {
    if (!(distance < s->best)) return;
    s->best = distance;
    memcpy(s->weight, weight, sizeof s->weight);
}

/* True if the element's corners stand on one side of the facet's plane, further than the best. */
static bool beyond_plane(const double corner[][3], int corners, const morph_facet *f, double best) {
    double least = INFINITY, most = -INFINITY;
    for (int j = 0; j < corners; j++) {
        double r[3];
        morph_sub(corner[j], f->corner[0], r);
        const double height = morph_dot(r, f->normal);
        least = fmin(least, height);
        most = fmax(most, height);
    }
    const double out = fmax(least, -most);
    return out > 0 && out * out * f->inverse > best * best;
}

/* Edge `e` of the element (a segment has one) against the facet and its own edges. */
static void try_edge(search *s, int e, int slot) {
    const morph_facet *f = &s->d->facet[slot];
    const int from = e, to = (e + 1) % s->corners;
    const double *a = s->corner[from], *b = s->corner[to];
    double t, u, w[3], weight[3] = {0};
    if (pierce(a, b, f, &t, w)) {
        weight[from] = 1 - t;
        weight[to] = t;
        note_crossing(s, weight, slot);
    }
    if (s->best <= 0) return;
    for (int j = 0; j < 3; j++) {
        if (!f->owns_edge[j]) continue;
        const double distance = morph_segment_segment(a, b, f->corner[j], f->corner[(j + 1) % 3], &t, &u);
        weight[from] = 1 - t;
        weight[to] = t;
        note_distance(s, distance, weight);
    }
}

static void try_facet(search *s, int slot) {
    const morph_facet *f = &s->d->facet[slot];
    if (beyond_plane(s->corner, s->corners, f, s->best)) return;
    if (s->corners == 3 && beyond_plane(f->corner, 3, &s->facet, s->best)) return;
    const int edges = s->corners == 3 ? 3 : 1;
    for (int e = 0; e < edges; e++)
        try_edge(s, e, slot);
    for (int j = 0; s->corners == 3 && j < 3; j++) {
        double t, weight[3];
        if (f->owns_edge[j] && pierce(f->corner[j], f->corner[(j + 1) % 3], &s->facet, &t, weight))
            note_crossing(s, weight, slot);
        if (s->best <= 0 || !f->owns_corner[j]) continue;
        const double distance =
            morph_point_triangle(f->corner[j], s->corner[0], s->corner[1], s->corner[2], weight);
        note_distance(s, distance, weight);
    }
}

/* Boxes at the distance of the best are still entered: at 0 that collects the crossings. */
static void traverse(search *s) {
    struct {
        double bound;
        int node;
    } stack[MORPH_TREE_STACK];
    int top = 0;
    stack[top].bound = 0;
    stack[top++].node = 0;
    while (top > 0) {
        top--;
        if (stack[top].bound > s->best * s->best || s->crossings == CROSSINGS) continue;
        const morph_tree_node *n = &s->d->node[stack[top].node];
        double bound[2];
        for (int side = 0; side < 2; side++)
            bound[side] = n->lo[side][0] > n->hi[side][0] ? INFINITY : box_bound(s, n->lo[side], n->hi[side]);
        const int near = bound[1] < bound[0];
        for (int turn = 0; turn < 2; turn++) {
            const int side = turn == 0 ? near : !near;
            if (bound[side] > s->best * s->best || bound[side] == INFINITY) continue;
            for (int i = 0; i < n->count[side]; i++)
                try_facet(s, n->child[side] + i);
        }
        /* The nearer child is pushed last, so it is taken first. */
        for (int turn = 0; turn < 2; turn++) {
            const int side = turn == 0 ? !near : near;
            if (n->count[side] > 0 || bound[side] > s->best * s->best || bound[side] == INFINITY) continue;
            stack[top].bound = bound[side];
            stack[top++].node = n->child[side];
        }
    }
}

static void start(search *s, const morph_distance *d, const double corner[][3], int corners) {
    *s = (search){.d = d, .corner = corner, .corners = corners, .best = INFINITY};
    for (int k = 0; k < 3; k++) {
        s->lo[k] = s->hi[k] = corner[0][k];
        for (int j = 1; j < corners; j++) {
            s->lo[k] = fmin(s->lo[k], corner[j][k]);
            s->hi[k] = fmax(s->hi[k], corner[j][k]);
        }
    }
    if (corners == 3) {
        double u[3], v[3];
        memcpy(s->facet.corner, corner, sizeof s->facet.corner);
        morph_sub(corner[1], corner[0], u);
        morph_sub(corner[2], corner[0], v);
        morph_cross(u, v, s->facet.normal);
        const double squared = morph_dot(s->facet.normal, s->facet.normal);
        /* As for the mesh's facets: an area below rounding has no normal. */
        const bool flat = !(squared > 1e-28 * morph_dot(u, u) * morph_dot(v, v)) || !isfinite(1 / squared);
        s->facet.inverse = flat ? 0 : 1 / squared;
    }
    set_axes(s);
}

/* Evaluates the element's point with these weights and keeps it if it lies deeper. */
static void try_point(const search *s, const double *point_weight, double weight[3], morph_closest *best) {
    double p[3];
    morph_closest c;
    blend(s->corner, s->corners, point_weight, p);
    morph_distance_point(s->d, p, &c);
    if (!(c.distance < best->distance)) return;
    *best = c;
    memcpy(weight, point_weight, 3 * sizeof *weight);
}

/* The part of the element's line through crossing c that points into the solid: from c against the facet's
 * normal up to the element's border, as weights of its two ends. False if there is none. */
static bool inward_line(const search *s, const crossing *c, double end[3]) {
    double rate[3] = {0};
    const double *n = s->d->facet[c->slot].normal;
    double u[3], v[3];
    morph_sub(s->corner[1], s->corner[0], u);
    if (s->corners == 2) {
        rate[1] = -morph_dot(u, n);
    } else {
        /* Steepest descent of n.x within the triangle: solve the 2 x 2 normal equations for u, v. */
        morph_sub(s->corner[2], s->corner[0], v);
        const double uu = morph_dot(u, u), uv = morph_dot(u, v), vv = morph_dot(v, v);
        const double nu = -morph_dot(n, u), nv = -morph_dot(n, v);
        rate[1] = vv * nu - uv * nv;
        rate[2] = uu * nv - uv * nu;
    }
    rate[0] = -rate[1] - rate[2];
    double reach = INFINITY;
    for (int j = 0; j < s->corners; j++)
        if (rate[j] < 0) reach = fmin(reach, -c->weight[j] / rate[j]);
    if (!(reach > 0) || !isfinite(reach)) return false;
    for (int j = 0; j < 3; j++)
        end[j] = fmax(0, c->weight[j] + reach * rate[j]);
    return true;
}

/* Middles of the first pieces between the crossings of the line from c into the solid: however thin the solid
 * is there, one of them lies inside. */
static void try_line(const search *s, const crossing *c, double weight[3], morph_closest *best) {
    double end[3], line[2][3], cut[CROSSINGS + 2];
    if (!inward_line(s, c, end)) return;
    blend(s->corner, s->corners, c->weight, line[0]);
    blend(s->corner, s->corners, end, line[1]);
    search along;
    start(&along, s->d, (const double(*)[3])line, 2);
    along.best = 0; /* crossings only */
    traverse(&along);
    int cuts = 0;
    cut[cuts++] = 0;
    cut[cuts++] = 1;
    for (int i = 0; i < along.crossings; i++) {
        int j = cuts++;
        for (; j > 0 && cut[j - 1] > along.crossing[i].weight[1]; j--)
            cut[j] = cut[j - 1];
        cut[j] = along.crossing[i].weight[1];
    }
    for (int i = 0, tried = 0; i + 1 < cuts && tried < INTERVALS; i++) {
        if (!(cut[i + 1] > cut[i])) continue;
        const double t = (cut[i] + cut[i + 1]) / 2;
        double w[3];
        for (int j = 0; j < 3; j++)
            w[j] = (1 - t) * c->weight[j] + t * end[j];
        try_point(s, w, weight, best);
        tried++;
    }
}

static void touching(search *s, double weight[3], morph_closest *best) {
    double mean[3] = {0};
    try_point(s, s->weight, weight, best);
    for (int i = 0; i < s->crossings; i++)
        for (int j = 0; j < 3; j++)
            mean[j] += s->crossing[i].weight[j] / s->crossings;
    if (s->crossings > 0) try_point(s, mean, weight, best);
    for (int i = 0; i < s->crossings; i++) {
        /* Enough once one is inside: the rest is left to the search for the deepest. */
        if (i >= 4 && best->distance < 0) break;
        try_line(s, &s->crossing[i], weight, best);
    }
    morph_deepest(s->d, s->corner, s->corners, weight, best);
    /* It touches, whatever rounding says. */
    if (best->distance > 0) best->distance = 0;
}

/* An open mesh may hold a part of the element without touching it, through a hole: looked for at the points
 * of a fixed pattern, within the mesh's box. */
static bool open_inside(const search *s, double weight[3], morph_closest *best) {
    for (int k = 0; k < 3; k++)
        if (s->lo[k] > s->d->hi[k] || s->hi[k] < s->d->lo[k]) return false;
    for (int i = 0; i <= OPEN_GRID; i++)
        for (int j = 0; i + j <= OPEN_GRID; j++) {
            const double third = (double)(OPEN_GRID - i - j) / OPEN_GRID;
            if (s->corners == 2 && i + j < OPEN_GRID) continue;
            const double w[3] = {(double)i / OPEN_GRID, (double)j / OPEN_GRID, third};
            try_point(s, w, weight, best);
        }
    return best->distance < 0;
}

static void element_distance(const morph_distance *d, const double corner[][3], int corners, double weight[3],
                             morph_closest *out) {
    search s;
    start(&s, d, corner, corners);
    *out = (morph_closest){.distance = INFINITY, .triangle = -1};
    for (int j = 0; j < corners; j++) {
        const double w[3] = {j == 0, j == 1, j == 2};
        try_point(&s, w, weight, out);
    }
    if (out->distance < 0) {
        morph_deepest(d, corner, corners, weight, out);
        return;
    }
    s.best = out->distance;
    memcpy(s.weight, weight, sizeof s.weight);
    traverse(&s);
    double reach = d->reach;
    for (int k = 0; k < 3; k++)
        reach = fmax(reach, fmax(fabs(s.lo[k]), fabs(s.hi[k])));
    /* Closer than the rounding of the differences of coordinates: clear or not cannot be told, so it touches.
     */
    if (s.crossings > 0 || s.best <= 16 * DBL_EPSILON * reach) {
        touching(&s, weight, out);
        return;
    }
    if (!d->closed && open_inside(&s, weight, out)) {
        morph_deepest(d, corner, corners, weight, out);
        return;
    }
    double p[3];
    memcpy(weight, s.weight, sizeof s.weight);
    blend(corner, corners, weight, p);
    morph_distance_point(d, p, out);
}

void morph_distance_segment(const morph_distance *d, const double a[3], const double b[3], double weight[2],
                            morph_closest *out) {
    double corner[2][3], w[3] = {0};
    memcpy(corner[0], a, sizeof corner[0]);
    memcpy(corner[1], b, sizeof corner[1]);
    element_distance(d, (const double(*)[3])corner, 2, w, out);
    memcpy(weight, w, 2 * sizeof *weight);
}

void morph_distance_triangle(const morph_distance *d, const double a[3], const double b[3], const double c[3],
                             double weight[3], morph_closest *out) {
    double corner[3][3], w[3] = {0};
    memcpy(corner[0], a, sizeof corner[0]);
    memcpy(corner[1], b, sizeof corner[1]);
    memcpy(corner[2], c, sizeof corner[2]);
    element_distance(d, (const double(*)[3])corner, 3, w, out);
    memcpy(weight, w, sizeof w);
}

/* The element's nearest place is a corner, or what traverse finds: corners first, each no further than the
 * best so far. False where one of them is inside. */
static bool corners_clear(search *s) {
    for (int j = 0; j < s->corners; j++) {
        morph_nearest nearest = {.squared = s->best * s->best};
        morph_closest c;
        morph_tree_nearest(s->d, s->corner[j], -1, &nearest);
        if (nearest.slot < 0) continue;
        morph_nearest_finish(s->d, s->corner[j], &nearest, &c);
        if (c.distance < 0) return false;
        const double weight[3] = {j == 0, j == 1, j == 2};
        note_distance(s, c.distance, weight);
    }
    return true;
}

/* Where one place of the element is outside a closed mesh and nothing crosses it, all of it is outside: the
 * hint's distance bounds the search, and what is further than `enough` need not be found at all. Everything
 * else is left to the search without a hint. */
void morph_distance_element(const morph_distance *d, const double corner[][3], int corners, double enough,
                            double weight[3], morph_closest *out) {
    search s;
    double hint[3], p[3];
    memcpy(hint, weight, sizeof hint);
    blend(corner, corners, hint, p);
    morph_distance_point(d, p, out);
    if (d->closed && out->distance > 0) {
        const double bound = fmax(enough, 0.5 * out->distance);
        start(&s, d, corner, corners);
        s.best = fmin(bound, out->distance);
        memcpy(s.weight, hint, sizeof hint);
        const double from = s.best;
        double reach = d->reach;
        for (int k = 0; k < 3; k++)
            reach = fmax(reach, fmax(fabs(s.lo[k]), fabs(s.hi[k])));
        if (corners_clear(&s)) {
            traverse(&s);
            if (s.crossings == 0 && s.best > 16 * DBL_EPSILON * reach) {
                memcpy(weight, s.weight, sizeof hint);
                if (s.best < from) {
                    blend(corner, corners, weight, p);
                    morph_distance_point(d, p, out);
                } else if (from < out->distance) {
                    out->distance = from;
                    out->triangle = -1;
                }
                return;
            }
        }
    }
    memset(weight, 0, 3 * sizeof *weight);
    element_distance(d, corner, corners, weight, out);
}
