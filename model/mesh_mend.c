/* Mending: weld, drop degenerate triangles, make the orientation consistent and outward. */
#include "model/mesh_private.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- weld ---- */

typedef struct weld_table {
    double lo[3], cell, tolerance;
    size_t mask;
    int *head; /* mask + 1: first representative of a bucket, -1 */
    int *next; /* vertices */
} weld_table;

static size_t bucket(const weld_table *w, const int64_t c[3]) {
    uint64_t h = (uint64_t)c[0] * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 29)) + (uint64_t)c[1] * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 31)) + (uint64_t)c[2] * 0x94d049bb133111ebu;
    h ^= h >> 32;
    return (size_t)h & w->mask;
}

/* The lowest representative within the tolerance of p, or -1. Cells are twice the tolerance wide, so the
 * ball around p meets at most two along each axis. */
static int find_near(const weld_table *w, const double *v, const double *p) {
    int64_t from[3], to[3], c[3];
    int best = -1;
    for (int k = 0; k < 3; k++) {
        from[k] = (int64_t)floor((p[k] - w->tolerance - w->lo[k]) / w->cell);
        to[k] = (int64_t)floor((p[k] + w->tolerance - w->lo[k]) / w->cell);
    }
    for (c[0] = from[0]; c[0] <= to[0]; c[0]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
                for (int i = w->head[bucket(w, c)]; i >= 0; i = w->next[i])
                    if ((best < 0 || i < best) && morph_dist(v + 3 * i, p) <= w->tolerance) best = i;
    return best;
}

/* to[i]: the vertex that i becomes (itself, or an earlier one). Unused vertices become -1. Returns the number
 * merged away. */
static int weld_all(weld_table *w, const double *v, int vertices, const bool *used, int *to) {
    int merged = 0;
    for (int i = 0; i < vertices; i++) {
        to[i] = -1;
        if (!used[i]) continue;
        to[i] = find_near(w, v, v + 3 * i);
        if (to[i] >= 0) {
            merged++;
            continue;
        }
        int64_t c[3];
        for (int k = 0; k < 3; k++)
            c[k] = (int64_t)floor((v[3 * i + k] - w->lo[k]) / w->cell);
        const size_t b = bucket(w, c);
        to[i] = i;
        w->next[i] = w->head[b];
        w->head[b] = i;
    }
    return merged;
}

static morph_status weld(morph_mesh *mesh, double tolerance, int *merged) {
    const size_t n = (size_t)mesh->vertices;
    weld_table w = {.tolerance = tolerance, .mask = 1};
    while (w.mask < n)
        w.mask *= 2;
    w.head = morph_alloc(w.mask, sizeof *w.head);
    w.next = morph_alloc(n, sizeof *w.next);
    bool *used = morph_alloc(n, sizeof *used);
    int *to = morph_alloc(n, sizeof *to);
    const bool ok = w.head && w.next && used && to;
    if (ok) {
        double hi[3];
        morph_mesh_bounds(mesh, w.lo, hi);
        const double size = morph_dist(w.lo, hi);
        /* Cells finer than 1e-15 of the size would overflow their integers and tell nothing apart. */
        w.cell = fmax(2 * tolerance, 1e-15 * size);
        if (!(w.cell > 0)) w.cell = 1;
        for (size_t i = 0; i < w.mask; i++)
            w.head[i] = -1;
        w.mask--;
        for (int i = 0; i < 3 * mesh->triangles; i++)
            used[mesh->t[i]] = true;
        *merged = weld_all(&w, mesh->v, mesh->vertices, used, to);
        for (int i = 0; i < 3 * mesh->triangles; i++)
            mesh->t[i] = to[mesh->t[i]];
    }
    free(w.head);
    free(w.next);
    free(used);
    free(to);
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* ---- degenerate triangles ---- */

/* Drops triangles: those with drop[f], or with drop NULL those that name a vertex twice. Flags in `turned`
 * move along. Returns how many went. */
static int drop_triangles(morph_mesh *mesh, const bool *drop, bool *turned) {
    int kept = 0;
    for (int f = 0; f < mesh->triangles; f++) {
        const int *t = mesh->t + 3 * f;
        if (drop ? drop[f] : t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        memmove(mesh->t + 3 * kept, t, 3 * sizeof *t);
        if (turned) turned[kept] = turned[f];
        kept++;
    }
    const int gone = mesh->triangles - kept;
    mesh->triangles = kept;
    return gone;
}

/* Did an edge between p and q exist when the edges were built?  They stand in order of their lower, then
 * their higher vertex. */
static bool joined(const morph_mesh_edges *edges, int p, int q) {
    const int lower = p < q ? p : q, higher = p < q ? q : p;
    int b = 0, e = edges->count;
    while (b < e) {
        const int mid = b + (e - b) / 2, *v = edges->vertex[mid];
        if (v[0] == lower && v[1] == higher) return true;
        if (v[0] < lower || (v[0] == lower && v[1] < higher))
            b = mid + 1;
        else
            e = mid;
    }
    return false;
}

static int longest_half(const morph_mesh *mesh, int f) {
    const int *t = mesh->t;
    double length = -1;
    int best = 3 * f;
    for (int h = 3 * f; h < 3 * f + 3; h++) {
        const double l = morph_dist(mesh->v + 3 * morph_half_from(t, h), mesh->v + 3 * morph_half_to(t, h));
        if (l > length) {
            length = l;
            best = h;
        }
    }
    return best;
}

/* A flat triangle whose three corners stand apart has one corner c on its longest edge ab. Dropping it would
 * open a slit; instead the edge is turned: with its neighbour (b, a, d) it becomes (a, d, c) and (d, b, c),
 * the same surface with c properly joined. False where there is no single agreeing neighbour, or c and d are
 * joined already. busy: triangles changed since the edges were built; touched: vertices that got an edge. */
static bool absorb(morph_mesh *mesh, const morph_mesh_edges *edges, int f, bool *busy, bool *touched) {
    int *t = mesh->t;
    const int h = longest_half(mesh, f), e = edges->of[h];
    if (e < 0 || edges->first[e + 1] - edges->first[e] != 2) return false;
    const int *pair = edges->half + edges->first[e], other = pair[0] == h ? pair[1] : pair[0], g = other / 3;
    if (busy[g] || morph_half_from(t, other) == morph_half_from(t, h)) return false;
    const int a = t[h], b = morph_half_to(t, h), c = t[3 * f + (h % 3 + 2) % 3];
    const int d = t[3 * g + (other % 3 + 2) % 3];
    /* An edge that is there already, or comes up twice in one round, would get more than two faces. */
    if (d == c || (touched[c] && touched[d]) || joined(edges, c, d)) return false;
    const int one[3] = {a, d, c}, two[3] = {d, b, c};
    memcpy(t + 3 * f, one, sizeof one);
    memcpy(t + 3 * g, two, sizeof two);
    busy[f] = busy[g] = touched[c] = touched[d] = true;
    return true;
}

static morph_status absorb_round(morph_mesh *mesh, double tolerance, bool *busy, bool *touched, int *done) {
    morph_mesh_edges edges;
    const morph_status status = morph_mesh_edges_build(mesh, &edges);
    if (status != MORPH_OK) return status;
    memset(busy, 0, (size_t)mesh->triangles * sizeof *busy);
    memset(touched, 0, (size_t)mesh->vertices * sizeof *touched);
    for (int f = 0; f < mesh->triangles; f++)
        if (!busy[f] && morph_mesh_flat(mesh, f, tolerance)) *done += absorb(mesh, &edges, f, busy, touched);
    morph_mesh_edges_free(&edges);
    return MORPH_OK;
}

/* Rounds of absorption (each changes a triangle once, so the edges stay valid), then what is left goes. */
static morph_status remove_flat(morph_mesh *mesh, double tolerance, bool *turned, int *removed) {
    enum { ROUNDS = 64 }; /* a flat fan of k triangles takes at most k rounds, usually a few */
    bool *busy = morph_alloc((size_t)mesh->triangles, sizeof *busy);
    bool *touched = morph_alloc((size_t)mesh->vertices, sizeof *touched);
    morph_status status = busy && touched ? MORPH_OK : MORPH_ERR_NOMEM;
    for (int round = 0; status == MORPH_OK && round < ROUNDS; round++) {
        int flat = 0, done = 0;
        for (int f = 0; f < mesh->triangles; f++)
            flat += morph_mesh_flat(mesh, f, tolerance);
        if (flat > 0) status = absorb_round(mesh, tolerance, busy, touched, &done);
        *removed += done;
        if (done == 0) break;
    }
    if (status == MORPH_OK) {
        for (int f = 0; f < mesh->triangles; f++)
            busy[f] = morph_mesh_flat(mesh, f, tolerance);
        *removed += drop_triangles(mesh, busy, turned);
    }
    free(busy);
    free(touched);
    return status;
}

/* ---- the whole ---- */

/* Drops vertices that no triangle uses; the others keep their order. */
static morph_status compact(morph_mesh *mesh) {
    int *to = morph_alloc((size_t)mesh->vertices, sizeof *to), kept = 0;
    if (!to) return MORPH_ERR_NOMEM;
    for (int i = 0; i < 3 * mesh->triangles; i++)
        to[mesh->t[i]] = 1;
    for (int i = 0; i < mesh->vertices; i++) {
        if (!to[i]) continue;
        memmove(mesh->v + 3 * kept, mesh->v + 3 * i, 3 * sizeof *mesh->v);
        to[i] = kept++;
    }
    for (int i = 0; i < 3 * mesh->triangles; i++)
        mesh->t[i] = to[mesh->t[i]];
    mesh->vertices = kept;
    free(to);
    return MORPH_OK;
}

static morph_status agree(morph_mesh *mesh, bool *turned) {
    morph_mesh_edges edges;
    morph_status status = morph_mesh_edges_build(mesh, &edges);
    if (status == MORPH_OK) status = morph_mesh_agree(mesh, &edges, turned);
    morph_mesh_edges_free(&edges);
    return status;
}

/* After turning, half edges run the other way: the report needs them built anew. */
static morph_status finish(morph_mesh *mesh, bool *turned, morph_mesh_report *r) {
    morph_mesh_edges edges = {0};
    int crossings = 0;
    morph_status status = morph_mesh_edges_build(mesh, &edges);
    if (status == MORPH_OK) status = morph_mesh_outward(mesh, &edges, turned, &crossings);
    morph_mesh_edges_free(&edges);
    if (status == MORPH_OK) status = morph_mesh_edges_build(mesh, &edges);
    if (status == MORPH_OK) status = morph_mesh_measure(mesh, &edges, r);
    morph_mesh_edges_free(&edges);
    r->self_intersections = crossings;
    return status;
}

morph_status morph_mesh_mend(morph_mesh *mesh, double tolerance, morph_mesh_report *report) {
    *report = (morph_mesh_report){0};
    if (!(tolerance >= 0) || !isfinite(tolerance)) return MORPH_ERR_INPUT;
    morph_status status = morph_mesh_valid(mesh);
    if (status != MORPH_OK) return status;
    morph_mesh_report r = {0};
    int welded = 0, degenerate = 0, flipped = 0;
    bool *turned = morph_alloc((size_t)mesh->triangles, sizeof *turned);
    if (!turned) return MORPH_ERR_NOMEM;
    status = weld(mesh, tolerance, &welded);
    if (status == MORPH_OK) {
        degenerate = drop_triangles(mesh, NULL, NULL);
        status = agree(mesh, turned);
    }
    if (status == MORPH_OK) status = remove_flat(mesh, tolerance, turned, &degenerate);
    if (status == MORPH_OK) status = compact(mesh);
    if (status == MORPH_OK) status = finish(mesh, turned, &r);
    for (int f = 0; f < mesh->triangles; f++)
        flipped += turned[f];
    free(turned);
    if (status != MORPH_OK) return status;
    *report = r;
    report->welded = welded;
    report->degenerate = degenerate;
    report->flipped = flipped;
    return MORPH_OK;
}
