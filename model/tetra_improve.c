/* After the stuffing: sharp edges and corners of the target, and better shapes. */
#include "model/spatial_hash.h"
#include "model/tetra_private.h"

#include <stdlib.h>
#include <string.h>

/* Cosine of the angle between two triangles' normals from which their edge is sharp: 40 degrees. Curved
 * primitives turn by less from facet to facet, boxes and rims by more. */
#define SHARP 0.766
/* How far (in cells) a vertex may be moved onto a feature, and the worst shape that may come of it. */
#define SNAP_REACH 0.7
#define CORNER_REACH 1.5
#define SNAP_QUALITY 0.15
#define PASSES 8

typedef struct edge {
    int a, b, triangle; /* a < b */
} edge;

/* A vertex of the tetrahedra that may go to a place on a feature. */
typedef struct snap {
    double distance;
    int vertex, feature;
    double place[3];
} snap;

typedef struct work {
    const morph_distance *target;
    morph_tetra *mesh;
    double cell;
    int *first, *list; /* incident tetrahedra */
    bool *surface, *fixed;
    edge *sharp;
    int sharps;
} work;

static int compare_edges(const void *p, const void *q) {
    const edge *a = p, *b = q;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    if (a->b != b->b) return a->b < b->b ? -1 : 1;
    return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}

static void normal_of(const morph_mesh *mesh, int t, double n[3]) {
    double a[3], b[3];
    morph_sub(&mesh->v[3 * mesh->t[3 * t + 1]], &mesh->v[3 * mesh->t[3 * t]], a);
    morph_sub(&mesh->v[3 * mesh->t[3 * t + 2]], &mesh->v[3 * mesh->t[3 * t]], b);
    morph_cross(a, b, n);
    const double norm = morph_norm(n);
    for (int k = 0; k < 3; k++)
        n[k] = norm > 0.0 ? n[k] / norm : 0.0;
}

static morph_status find_sharp(work *w) {
    const morph_mesh *mesh = morph_distance_mesh(w->target);
    w->sharp = morph_alloc((size_t)mesh->triangles, 3 * sizeof *w->sharp);
    if (!w->sharp) return MORPH_ERR_NOMEM;
    for (int i = 0; i < 3 * mesh->triangles; i++) {
        const int a = mesh->t[i], b = mesh->t[i % 3 == 2 ? i - 2 : i + 1];
        w->sharp[i] = (edge){a < b ? a : b, a < b ? b : a, i / 3};
    }
    qsort(w->sharp, (size_t)mesh->triangles * 3, sizeof *w->sharp, compare_edges);
    for (int i = 0; i + 1 < 3 * mesh->triangles; i++) {
        const edge *e = &w->sharp[i];
        double m[3], n[3];
        if (e->a != e[1].a || e->b != e[1].b) continue;
        normal_of(mesh, e->triangle, m);
        normal_of(mesh, e[1].triangle, n);
        if (morph_dot(m, n) < SHARP) w->sharp[w->sharps++] = *e;
    }
    return MORPH_OK;
}

static double least_around(const work *w, int vertex) {
    double least = INFINITY;
    for (int k = w->first[vertex]; k < w->first[vertex + 1]; k++)
        least = fmin(least, morph_tetra_quality(w->mesh->v, w->mesh->tet[w->list[k]]));
    return least;
}

/* Moves the vertex if the tetrahedra around it are then at least `quality`; says whether. */
static bool move(work *w, int vertex, const double place[3], double quality) {
    double *x = &w->mesh->v[3 * vertex], keep[3];
    memcpy(keep, x, sizeof keep);
    memcpy(x, place, sizeof keep);
    if (least_around(w, vertex) >= quality) return true;
    memcpy(x, keep, sizeof keep);
    return false;
}

static int compare_snaps(const void *p, const void *q) {
    const snap *a = p, *b = q;
    if (a->distance != b->distance) return a->distance < b->distance ? -1 : 1;
    if (a->vertex != b->vertex) return a->vertex < b->vertex ? -1 : 1;
    return (a->feature > b->feature) - (a->feature < b->feature);
}

/* Closest point of segment ab to p. */
static void closest_on(const double *a, const double *b, const double *p, double out[3]) {
    double d[3], e[3];
    morph_sub(b, a, d);
    morph_sub(p, a, e);
    const double square = morph_dot(d, d);
    const double t = square > 0.0 ? fmax(0.0, fmin(1.0, morph_dot(d, e) / square)) : 0.0;
    for (int k = 0; k < 3; k++)
        out[k] = a[k] + t * d[k];
}

/* Features are segments ends[2 i], ends[2 i + 1] (a corner: the same vertex twice). The nearest first; each
 * vertex moves once, `once`: each feature takes one. */
static morph_status snap_to(work *w, const int *ends, int features, bool once) {
    const morph_mesh *target = morph_distance_mesh(w->target);
    const morph_tetra *mesh = w->mesh;
    const double reach = (once ? CORNER_REACH : SNAP_REACH) * w->cell;
    const int n = mesh->surface_vertices;
    morph_box *box = morph_alloc((size_t)n + (size_t)features, sizeof *box);
    bool *taken = morph_alloc((size_t)features, sizeof *taken);
    morph_hash *hash = NULL;
    snap *s = NULL;
    const int(*pair)[2];
    int pairs = 0, snaps = 0;
    morph_status status = box && taken ? morph_hash_create(&hash) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (int i = 0; i < n; i++)
            box[i] = morph_box_of(mesh->v, &mesh->surface[i], 1, reach);
        for (int i = 0; i < features; i++)
            box[n + i] = morph_box_of(target->v, &ends[2 * i], 2, 0.0);
        status = morph_hash_between(hash, n, box, features, box + n, &pair, &pairs);
    }
    if (status == MORPH_OK && !(s = morph_alloc((size_t)pairs, sizeof *s))) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (int i = 0; i < pairs; i++) {
            snap *c = &s[snaps];
            c->vertex = mesh->surface[pair[i][0]];
            c->feature = pair[i][1];
            closest_on(&target->v[3 * ends[2 * c->feature]], &target->v[3 * ends[2 * c->feature + 1]],
                       &mesh->v[3 * c->vertex], c->place);
            c->distance = morph_dist(c->place, &mesh->v[3 * c->vertex]);
            if (c->distance <= reach) snaps++;
        }
        qsort(s, (size_t)snaps, sizeof *s, compare_snaps);
        for (int i = 0; i < snaps; i++) {
            if (w->fixed[s[i].vertex] || (once && taken[s[i].feature])) continue;
            if (!move(w, s[i].vertex, s[i].place, SNAP_QUALITY)) continue;
            w->fixed[s[i].vertex] = taken[s[i].feature] = true;
        }
    }
    morph_hash_destroy(hash);
    free(s);
    free(taken);
    free(box);
    return status;
}

/* Tips: vertices where no sharp edge ends but triangles lean away from their mean normal as far as at a sharp
 * edge (the point of a cone). Their degree is set to 1. */
static morph_status mark_tips(const work *w, int *degree) {
    const morph_mesh *mesh = morph_distance_mesh(w->target);
    double *mean = morph_alloc((size_t)mesh->vertices, 3 * sizeof *mean), n[3];
    bool *tip = morph_alloc((size_t)mesh->vertices, sizeof *tip);
    for (int pass = 0; pass < 2 && mean && tip; pass++)
        for (int i = 0; i < 3 * mesh->triangles; i++) {
            double *m = &mean[3 * mesh->t[i]];
            normal_of(mesh, i / 3, n);
            if (pass == 1 && morph_dot(m, n) < SHARP * morph_norm(m)) tip[mesh->t[i]] = true;
            for (int k = 0; k < 3 && pass == 0; k++)
                m[k] += n[k];
        }
    for (int i = 0; i < mesh->vertices && mean && tip; i++)
        if (tip[i] && degree[i] == 0) degree[i] = 1;
    const bool done = mean && tip;
    free(mean);
    free(tip);
    return done ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* Corners: where other than two sharp edges meet. */
static morph_status snap_features(work *w) {
    const int vertices = morph_distance_mesh(w->target)->vertices;
    int *degree = morph_alloc((size_t)vertices, sizeof *degree);
    int *ends = morph_alloc((size_t)w->sharps + (size_t)vertices, 2 * sizeof *ends);
    morph_status status = degree && ends ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        int corners = 0;
        for (int i = 0; i < w->sharps; i++) {
            degree[w->sharp[i].a]++;
            degree[w->sharp[i].b]++;
        }
        status = mark_tips(w, degree);
        for (int i = 0; i < vertices; i++)
            if (degree[i] != 0 && degree[i] != 2) {
                ends[2 * corners] = ends[2 * corners + 1] = i;
                corners++;
            }
        if (status == MORPH_OK && corners > 0) status = snap_to(w, ends, corners, true);
        for (int i = 0; i < w->sharps; i++) {
            ends[2 * i] = w->sharp[i].a;
            ends[2 * i + 1] = w->sharp[i].b;
        }
        if (status == MORPH_OK && w->sharps > 0) status = snap_to(w, ends, w->sharps, false);
    }
    free(degree);
    free(ends);
    return status;
}

/* Mean of the neighbours (of a surface vertex: those on the surface), as often as tetrahedra say. */
static void centre_around(const work *w, int vertex, double out[3]) {
    double sum[3] = {0.0, 0.0, 0.0};
    int count = 0;
    for (int k = w->first[vertex]; k < w->first[vertex + 1]; k++)
        for (int j = 0; j < 4; j++) {
            const int i = w->mesh->tet[w->list[k]][j];
            if (i == vertex || (w->surface[vertex] && !w->surface[i])) continue;
            for (int c = 0; c < 3; c++)
                sum[c] += w->mesh->v[3 * i + c];
            count++;
        }
    for (int c = 0; c < 3; c++)
        out[c] = count > 0 ? sum[c] / count : w->mesh->v[3 * vertex + c];
}

/* Towards the centre of its neighbours, by as much as makes the worst tetrahedron around better. */
static void smooth(work *w, int vertex) {
    const double now = least_around(w, vertex);
    const double *x = &w->mesh->v[3 * vertex];
    double centre[3], place[3];
    centre_around(w, vertex, centre);
    for (double part = 1.0; part > 0.1; part *= 0.5) {
        for (int k = 0; k < 3; k++)
            place[k] = x[k] + part * (centre[k] - x[k]);
        if (w->surface[vertex]) {
            morph_closest at;
            morph_distance_point(w->target, place, &at);
            memcpy(place, at.point, sizeof place);
        }
        /* By a little more than rounding, so that the passes end. */
        if (move(w, vertex, place, now + 1e-6)) return;
    }
}

morph_status morph_tetra_improve(const morph_distance *target, double cell, morph_tetra *mesh) {
    work w = {.target = target, .mesh = mesh, .cell = cell};
    w.surface = morph_alloc((size_t)mesh->vertices, sizeof *w.surface);
    w.fixed = morph_alloc((size_t)mesh->vertices, sizeof *w.fixed);
    morph_status status = w.surface && w.fixed ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK)
        status =
            morph_tetra_around(mesh->vertices, mesh->tets, (const int(*)[4])mesh->tet, &w.first, &w.list);
    if (status == MORPH_OK) status = find_sharp(&w);
    if (status == MORPH_OK) {
        for (int i = 0; i < mesh->surface_vertices; i++)
            w.surface[mesh->surface[i]] = true;
        status = snap_features(&w);
    }
    for (int pass = 0; pass < PASSES && status == MORPH_OK; pass++)
        for (int i = 0; i < mesh->vertices; i++)
            if (!w.fixed[i]) smooth(&w, i);
    free(w.surface);
    free(w.fixed);
    free(w.first);
    free(w.list);
    free(w.sharp);
    return status;
}
