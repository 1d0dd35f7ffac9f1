/* Isosurface stuffing (Labelle and Shewchuk 2007): a body-centred cubic lattice whose points near the surface
 * are moved onto it, and whose tetrahedra across it are cut.
 *
 * The lattice in doubled coordinates: points whose three coordinates are all even or all odd. Edges are long
 * (2,0,0) and its like, or short (+-1,+-1,+-1). A tetrahedron is made of two odd neighbours, across an axis,
 * and one side of the square of even points between them. */
#include "model/tetra_private.h"

#include <stdlib.h>
#include <string.h>

#define MOST_POINTS 4e6
/* A cut this near an end of its edge (part of the edge) moves that end onto the surface instead: the paper's
 * values for its bound on the angles. */
#define NEAR_LONG 0.24999
#define NEAR_SHORT 0.41189
/* Distances below this part of the cell are on the surface: far above rounding, far below anything seen. */
#define ON_SURFACE 1e-9

enum { DIRECTIONS = 7 };
static const int DIRECTION[DIRECTIONS][3] = {{2, 0, 0},  {0, 2, 0},  {0, 0, 2},  {1, 1, 1},
                                             {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};

typedef struct lattice {
    const morph_distance *target;
    double origin[3], step[3]; /* of the doubled coordinates, m */
    double cell;
    int n[3];               /* cells */
    int evens, points;      /* even points come first */
    double *x;              /* 3 * points */
    double *f;              /* points: signed distance, negative inside, 0 on the surface */
    int (*cut)[DIRECTIONS]; /* points: number of the cut on the edge from here, -1: none */
    double *c;              /* 3 * cuts */
    int cuts, cut_room;
    int (*tet)[4]; /* vertices: lattice points, then points + cut */
    int tets, tet_room;
} lattice;

static int point_at(const lattice *l, const int p[3]) {
    for (int k = 0; k < 3; k++)
        if (p[k] < 0 || p[k] > 2 * l->n[k]) return -1;
    if (p[0] & 1) return l->evens + p[0] / 2 + l->n[0] * (p[1] / 2 + l->n[1] * (p[2] / 2));
    return p[0] / 2 + (l->n[0] + 1) * (p[1] / 2 + (l->n[1] + 1) * (p[2] / 2));
}

static void place_of(const lattice *l, int point, int p[3]) {
    const int odd = point >= l->evens;
    const int nx = l->n[0] + !odd, ny = l->n[1] + !odd, i = point - (odd ? l->evens : 0);
    p[0] = 2 * (i % nx) + odd;
    p[1] = 2 * (i / nx % ny) + odd;
    p[2] = 2 * (i / nx / ny) + odd;
}

static int neighbour(const lattice *l, int point, int direction, int sign) {
    int p[3];
    place_of(l, point, p);
    for (int k = 0; k < 3; k++)
        p[k] += sign * DIRECTION[direction][k];
    return point_at(l, p);
}

/* The bounding box is a whole number of cells, so that faces along the axes fall on lattice planes and come
 * out exact; one cell more on every side. */
static morph_status lay(lattice *l) {
    const morph_mesh *mesh = morph_distance_mesh(l->target);
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, most = 1.0;
    for (int i = 0; i < 3 * mesh->triangles; i++)
        for (int k = 0; k < 3; k++) {
            lo[k] = fmin(lo[k], mesh->v[3 * mesh->t[i] + k]);
            hi[k] = fmax(hi[k], mesh->v[3 * mesh->t[i] + k]);
        }
    for (int k = 0; k < 3; k++) {
        const double cells = fmax(1.0, ceil((hi[k] - lo[k]) / l->cell - 1e-9));
        most *= cells + 3.0;
        if (!(2.0 * most <= MOST_POINTS)) return MORPH_ERR_INPUT;
        l->n[k] = (int)cells + 2;
        const double step = hi[k] > lo[k] ? (hi[k] - lo[k]) / cells : l->cell;
        l->step[k] = 0.5 * step;
        l->origin[k] = lo[k] - step;
    }
    l->evens = (l->n[0] + 1) * (l->n[1] + 1) * (l->n[2] + 1);
    l->points = l->evens + l->n[0] * l->n[1] * l->n[2];
    l->x = morph_alloc((size_t)l->points, 3 * sizeof *l->x);
    l->f = morph_alloc((size_t)l->points, sizeof *l->f);
    l->cut = morph_alloc((size_t)l->points, sizeof *l->cut);
    return l->x && l->f && l->cut ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* Beyond two cells only the sign counts. */
static void evaluate(lattice *l) {
    for (int i = 0; i < l->points; i++) {
        int p[3];
        morph_closest at;
        place_of(l, i, p);
        for (int k = 0; k < 3; k++)
            l->x[3 * i + k] = l->origin[k] + p[k] * l->step[k];
        morph_distance_point_bounded(l->target, &l->x[3 * i], 2.0 * l->cell, &at);
        l->f[i] = fabs(at.distance) <= ON_SURFACE * l->cell ? 0.0 : at.distance;
    }
}

/* Where the distance is 0 between a (fa < 0) and b (fb > 0): false position, the value of an end that stays
 * is halved (Illinois), so that it converges from both sides. */
static void find_root(const lattice *l, const double *a, double fa, const double *b, double fb,
                      double out[3]) {
    double s = 0.0, t = 1.0;
    int side = 0;
    for (int round = 0; round < 60; round++) {
        morph_closest at;
        const double r = (s * fb - t * fa) / (fb - fa);
        for (int k = 0; k < 3; k++)
            out[k] = a[k] + r * (b[k] - a[k]);
        morph_distance_point(l->target, out, &at);
        if (fabs(at.distance) <= 0.1 * ON_SURFACE * l->cell) return;
        if (at.distance < 0.0) {
            s = r;
            fa = at.distance;
            if (side == -1) fb *= 0.5;
            side = -1;
        } else {
            t = r;
            fb = at.distance;
            if (side == 1) fa *= 0.5;
            side = 1;
        }
    }
}

static morph_status add_cut(lattice *l, int from, int direction, int to) {
    if (l->cuts == l->cut_room) {
        const int room = 2 * l->cut_room + 256;
        double *c = realloc(l->c, 3 * (size_t)room * sizeof *c);
        if (!c) return MORPH_ERR_NOMEM;
        l->c = c;
        l->cut_room = room;
    }
    const int in = l->f[from] < 0.0 ? from : to, out = l->f[from] < 0.0 ? to : from;
    find_root(l, &l->x[3 * in], l->f[in], &l->x[3 * out], l->f[out], &l->c[3 * l->cuts]);
    l->cut[from][direction] = l->cuts++;
    return MORPH_OK;
}

static morph_status cut_edges(lattice *l) {
    for (int i = 0; i < l->points; i++)
        for (int d = 0; d < DIRECTIONS; d++) {
            l->cut[i][d] = -1;
            const int j = neighbour(l, i, d, 1);
            if (j < 0 || !(l->f[i] * l->f[j] < 0.0)) continue;
            const morph_status status = add_cut(l, i, d, j);
            if (status != MORPH_OK) return status;
        }
    return MORPH_OK;
}

/* Moves a point onto its nearest cut where that is near; its edges are cut no more. */
static void warp(lattice *l, int i) {
    double least = 1.0;
    int best = -1;
    for (int e = 0; e < 2 * DIRECTIONS; e++) {
        const int d = e >> 1, j = neighbour(l, i, d, e & 1 ? -1 : 1);
        if (j < 0) continue;
        const int c = e & 1 ? l->cut[j][d] : l->cut[i][d];
        if (c < 0) continue;
        const double part = morph_dist(&l->c[3 * c], &l->x[3 * i]) / morph_dist(&l->x[3 * j], &l->x[3 * i]);
        const double measure = part / (d < 3 ? NEAR_LONG : NEAR_SHORT);
        if (measure >= least) continue;
        least = measure;
        best = c;
    }
    if (best < 0) return;
    memcpy(&l->x[3 * i], &l->c[3 * best], 3 * sizeof *l->x);
    l->f[i] = 0.0;
    for (int d = 0; d < DIRECTIONS; d++) {
        l->cut[i][d] = -1;
        const int j = neighbour(l, i, d, -1);
        if (j >= 0) l->cut[j][d] = -1;
    }
}

/* Vertex number of the cut between two lattice points, which is there. */
static int cut_between(const lattice *l, int a, int b) {
    for (int d = 0; d < DIRECTIONS; d++) {
        if (l->cut[a][d] >= 0 && neighbour(l, a, d, 1) == b) return l->points + l->cut[a][d];
        if (l->cut[b][d] >= 0 && neighbour(l, b, d, 1) == a) return l->points + l->cut[b][d];
    }
    return -1;
}

static morph_status add_tet(lattice *l, int a, int b, int c, int d) {
    if (a < 0 || b < 0 || c < 0 || d < 0) return MORPH_ERR_INTERNAL;
    if (l->tets == l->tet_room) {
        const int room = 2 * l->tet_room + 256;
        int(*tet)[4] = realloc(l->tet, (size_t)room * sizeof *tet);
        if (!tet) return MORPH_ERR_NOMEM;
        l->tet = tet;
        l->tet_room = room;
    }
    int *t = l->tet[l->tets++];
    t[0] = a, t[1] = b, t[2] = c, t[3] = d;
    return MORPH_OK;
}

/* Pyramid over the quadrilateral q: its diagonal starts at the smallest number, which both tetrahedra at a
 * face see alike. */
static morph_status add_pyramid(lattice *l, const int q[4], int apex) {
    int least = 0;
    for (int k = 1; k < 4; k++)
        if (q[k] < q[least]) least = k;
    const int a = q[least], b = q[(least + 1) & 3], c = q[(least + 2) & 3], d = q[(least + 3) & 3];
    const morph_status status = add_tet(l, a, b, c, apex);
    return status == MORPH_OK ? add_tet(l, a, c, d, apex) : status;
}

/* Prism with edges p[k] - q[k]: the diagonals of its three quadrilaterals start at their smallest number
 * (Dompierre et al. 1999); the two at the smallest of all then meet there, which makes a tetrahedron and a
 * pyramid. */
static morph_status add_prism(lattice *l, const int p[3], const int q[3]) {
    const int *near = p, *far = q;
    int least = 0;
    for (int k = 0; k < 3; k++) {
        if (p[k] < near[least]) near = p, far = q, least = k;
        if (q[k] < near[least]) near = q, far = p, least = k;
    }
    const int b = (least + 1) % 3, c = (least + 2) % 3;
    const int quad[4] = {near[b], near[c], far[c], far[b]};
    const morph_status status = add_tet(l, near[least], far[0], far[1], far[2]);
    return status == MORPH_OK ? add_pyramid(l, quad, near[least]) : status;
}

/* What of a lattice tetrahedron is inside: corners inside stay, corners on the surface stay, edges across
 * are cut. */
static morph_status clip(lattice *l, const int corner[4]) {
    int in[4], on[4], out[4], ins = 0, ons = 0, outs = 0;
    for (int k = 0; k < 4; k++) {
        const double f = l->f[corner[k]];
        if (f < 0.0)
            in[ins++] = corner[k];
        else if (f > 0.0)
            out[outs++] = corner[k];
        else
            on[ons++] = corner[k];
    }
    if (ins == 0) return MORPH_OK;
    if (outs == 0) return add_tet(l, corner[0], corner[1], corner[2], corner[3]);
    if (ins == 1) {
        for (int k = 0; k < outs; k++)
            on[ons++] = cut_between(l, in[0], out[k]);
        return add_tet(l, in[0], on[0], on[1], on[2]);
    }
    int cut[4][4];
    for (int i = 0; i < ins; i++)
        for (int k = 0; k < outs; k++)
            cut[i][k] = cut_between(l, in[i], out[k]);
    if (ins == 3) return add_prism(l, in, (const int[3]){cut[0][0], cut[1][0], cut[2][0]});
    if (outs == 1) return add_pyramid(l, (const int[4]){in[0], in[1], cut[1][0], cut[0][0]}, on[0]);
    return add_prism(l, (const int[3]){in[0], cut[0][0], cut[0][1]},
                     (const int[3]){in[1], cut[1][0], cut[1][1]});
}

/* All tetrahedra about the long edge from an odd point along an axis. */
static morph_status clip_around(lattice *l, int odd, int axis) {
    const int other = neighbour(l, odd, axis, 1), u = (axis + 1) % 3, w = (axis + 2) % 3;
    static const int round[5][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, -1}};
    if (other < 0) return MORPH_OK;
    int square[5];
    for (int k = 0; k < 5; k++) {
        int p[3];
        place_of(l, odd, p);
        p[axis] += 1;
        p[u] += round[k][0];
        p[w] += round[k][1];
        square[k] = point_at(l, p);
    }
    for (int k = 0; k < 4; k++) {
        const int corner[4] = {odd, other, square[k], square[k + 1]};
        const morph_status status = clip(l, corner);
        if (status != MORPH_OK) return status;
    }
    return MORPH_OK;
}

static morph_status stuff(lattice *l) {
    evaluate(l);
    morph_status status = cut_edges(l);
    for (int i = 0; i < l->points && status == MORPH_OK; i++)
        warp(l, i);
    for (int i = l->evens; i < l->points && status == MORPH_OK; i++)
        for (int axis = 0; axis < 3 && status == MORPH_OK; axis++)
            status = clip_around(l, i, axis);
    return status;
}

/* Lattice points and cuts as one list of vertices. */
static morph_status collect(lattice *l, morph_tetra *out, morph_tetra_report *report) {
    const int n = l->points + l->cuts;
    double *v = realloc(l->x, 3 * (size_t)n * sizeof *v);
    if (!v) return MORPH_ERR_NOMEM;
    l->x = v;
    if (l->cuts > 0) memcpy(&v[3 * l->points], l->c, 3 * (size_t)l->cuts * sizeof *v);
    return morph_tetra_create(n, v, l->tets, (const int(*)[4])l->tet, out, report);
}

morph_status morph_tetra_fill(const morph_distance *target, double cell, morph_tetra *out,
                              morph_tetra_report *report) {
    lattice l = {.target = target, .cell = cell};
    morph_tetra rough = {0};
    *out = rough;
    *report = (morph_tetra_report){.fault = MORPH_TETRA_COARSE};
    if (!(cell > 0.0) || !isfinite(cell)) return MORPH_ERR_INPUT;
    morph_status status = lay(&l);
    if (status == MORPH_OK) status = stuff(&l);
    if (status == MORPH_OK && l.tets == 0) status = MORPH_ERR_INPUT;
    if (status == MORPH_OK) status = collect(&l, &rough, report);
    if (status == MORPH_OK) status = morph_tetra_improve(target, cell, &rough);
    /* Once more: quality and volume have changed. */
    if (status == MORPH_OK)
        status =
            morph_tetra_create(rough.vertices, rough.v, rough.tets, (const int(*)[4])rough.tet, out, report);
    if (status == MORPH_OK) report->unused = report->flipped = 0; /* of the lattice, not of interest */
    morph_tetra_free(&rough);
    free(l.x);
    free(l.f);
    free(l.cut);
    free(l.c);
    free(l.tet);
    return status;
}
