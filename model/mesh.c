#include "model/mesh.h"
#include "model/mesh_private.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

void morph_mesh_free(morph_mesh *mesh) {
    if (!mesh) return;
    free(mesh->v);
    free(mesh->t);
    *mesh = (morph_mesh){0};
}

morph_status morph_mesh_copy(const morph_mesh *from, morph_mesh *to) {
    *to = (morph_mesh){0};
    const size_t nv = 3 * (size_t)from->vertices, nt = 3 * (size_t)from->triangles;
    double *v = morph_alloc(nv, sizeof *v);
    int *t = morph_alloc(nt, sizeof *t);
    if (!v || !t) {
        free(v);
        free(t);
        return MORPH_ERR_NOMEM;
    }
    if (nv > 0) memcpy(v, from->v, nv * sizeof *v);
    if (nt > 0) memcpy(t, from->t, nt * sizeof *t);
    *to = (morph_mesh){.vertices = from->vertices, .triangles = from->triangles, .v = v, .t = t};
    return MORPH_OK;
}

morph_status morph_mesh_valid(const morph_mesh *mesh) {
    if (mesh->vertices < 0 || mesh->triangles < 0 || mesh->triangles > INT_MAX / 3 ||
        mesh->vertices > INT_MAX / 3)
        return MORPH_ERR_INPUT;
    for (int i = 0; i < 3 * mesh->triangles; i++)
        if (mesh->t[i] < 0 || mesh->t[i] >= mesh->vertices) return MORPH_ERR_INPUT;
    for (int i = 0; i < 3 * mesh->vertices; i++)
        if (!isfinite(mesh->v[i])) return MORPH_ERR_NONFINITE;
    return MORPH_OK;
}

void morph_mesh_bounds(const morph_mesh *mesh, double lo[3], double hi[3]) {
    for (int k = 0; k < 3; k++) {
        lo[k] = mesh->triangles > 0 ? INFINITY : 0;
        hi[k] = mesh->triangles > 0 ? -INFINITY : 0;
    }
    for (int i = 0; i < 3 * mesh->triangles; i++) {
        const double *p = mesh->v + 3 * mesh->t[i];
        for (int k = 0; k < 3; k++) {
            lo[k] = fmin(lo[k], p[k]);
            hi[k] = fmax(hi[k], p[k]);
        }
    }
}

void morph_mesh_normal(const morph_mesh *mesh, int f, double n[3]) {
    const int *t = mesh->t + 3 * f;
    double a[3], b[3];
    morph_sub(mesh->v + 3 * t[1], mesh->v + 3 * t[0], a);
    morph_sub(mesh->v + 3 * t[2], mesh->v + 3 * t[0], b);
    morph_cross(a, b, n);
}

bool morph_mesh_flat(const morph_mesh *mesh, int f, double height) {
    const int *t = mesh->t + 3 * f;
    double n[3], longest = 0;
    morph_mesh_normal(mesh, f, n);
    for (int k = 0; k < 3; k++)
        longest = fmax(longest, morph_dist(mesh->v + 3 * t[k], mesh->v + 3 * t[(k + 1) % 3]));
    return morph_norm(n) <= fmax(height, 1e-12 * longest) * longest;
}

/* ---- edges ---- */

typedef struct spoke {
    int other, half; /* the edge's higher vertex; half edge */
} spoke;

static int by_other(const void *a, const void *b) {
    const spoke *p = a, *q = b;
    if (p->other != q->other) return p->other < q->other ? -1 : 1;
    return (p->half > q->half) - (p->half < q->half);
}

static bool repeats(const int *t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

void morph_mesh_edges_free(morph_mesh_edges *edges) {
    free(edges->vertex);
    free(edges->first);
    free(edges->half);
    free(edges->of);
    *edges = (morph_mesh_edges){0};
}

/* Buckets the half edges by their lower vertex (a counting sort), start has vertices + 1 entries. */
static void bucket_edges(const morph_mesh *mesh, int *start, spoke *spokes) {
    const int *t = mesh->t;
    for (int h = 0; h < 3 * mesh->triangles; h++) {
        if (repeats(t + h - h % 3)) continue;
        const int a = morph_half_from(t, h), b = morph_half_to(t, h);
        start[a < b ? a : b]++;
    }
    int sum = 0;
    for (int v = 0; v <= mesh->vertices; v++) {
        const int here = start[v];
        start[v] = sum;
        sum += here;
    }
    for (int h = 0; h < 3 * mesh->triangles; h++) {
        if (repeats(t + h - h % 3)) continue;
        const int a = morph_half_from(t, h), b = morph_half_to(t, h);
        spokes[start[a < b ? a : b]++] = (spoke){a < b ? b : a, h};
    }
    /* Filling moved every start to its bucket's end: the next one's start. */
    for (int v = mesh->vertices; v > 0; v--)
        start[v] = start[v - 1];
    start[0] = 0;
}

morph_status morph_mesh_edges_build(const morph_mesh *mesh, morph_mesh_edges *out) {
    *out = (morph_mesh_edges){0};
    const size_t halves = 3 * (size_t)mesh->triangles;
    morph_mesh_edges e = {0};
    int *start = morph_alloc((size_t)mesh->vertices + 1, sizeof *start);
    spoke *spokes = morph_alloc(halves, sizeof *spokes);
    e.vertex = morph_alloc(halves, sizeof *e.vertex);
    e.first = morph_alloc(halves + 1, sizeof *e.first);
    e.half = morph_alloc(halves, sizeof *e.half);
    e.of = morph_alloc(halves, sizeof *e.of);
    if (!start || !spokes || !e.vertex || !e.first || !e.half || !e.of) {
        free(start);
        free(spokes);
        morph_mesh_edges_free(&e);
        return MORPH_ERR_NOMEM;
    }
    for (size_t h = 0; h < halves; h++)
        e.of[h] = -1;
    bucket_edges(mesh, start, spokes);
    for (int v = 0; v < mesh->vertices; v++) {
        const int b = start[v], n = start[v + 1] - b;
        if (n > 1) qsort(spokes + b, (size_t)n, sizeof *spokes, by_other);
        for (int i = b; i < b + n; i++) {
            if (i == b || spokes[i].other != spokes[i - 1].other) {
                e.vertex[e.count][0] = v;
                e.vertex[e.count][1] = spokes[i].other;
                e.first[e.count++] = i;
            }
            e.half[i] = spokes[i].half;
            e.of[spokes[i].half] = e.count - 1;
        }
    }
    e.first[e.count] = start[mesh->vertices];
    free(start);
    free(spokes);
    *out = e;
    return MORPH_OK;
}

morph_status morph_mesh_parts(const morph_mesh *mesh, const morph_mesh_edges *edges, int *label, int *parts) {
    int *stack = morph_alloc((size_t)mesh->triangles, sizeof *stack);
    if (!stack) return MORPH_ERR_NOMEM;
    *parts = 0;
    for (int f = 0; f < mesh->triangles; f++)
        label[f] = -1;
    for (int seed = 0; seed < mesh->triangles; seed++) {
        if (label[seed] >= 0 || edges->of[3 * seed] < 0) continue;
        int top = 0;
        stack[top++] = seed;
        label[seed] = *parts;
        while (top > 0) {
            const int f = stack[--top];
            for (int h = 3 * f; h < 3 * f + 3; h++)
                for (int i = edges->first[edges->of[h]]; i < edges->first[edges->of[h] + 1]; i++) {
                    const int g = edges->half[i] / 3;
                    if (label[g] >= 0) continue;
                    label[g] = *parts;
                    stack[top++] = g;
                }
        }
        (*parts)++;
    }
    free(stack);
    return MORPH_OK;
}

/* ---- report ---- */

static void measure_edges(const morph_mesh *mesh, const morph_mesh_edges *edges, morph_mesh_report *r) {
    for (int e = 0; e < edges->count; e++) {
        const int *h = edges->half + edges->first[e], n = edges->first[e + 1] - edges->first[e];
        if (n == 1) r->boundary_edges++;
        if (n > 2) r->nonmanifold_edges++;
        /* Two outward neighbours run along their common edge in opposite directions. */
        if (n == 2 && morph_half_from(mesh->t, h[0]) == morph_half_from(mesh->t, h[1]))
            r->orientation_conflicts++;
    }
}

/* Divergence theorem over the triangles: V = sum (a - c) . ((b - c) x (d - c)) / 6. The reference c, free for
 * a closed mesh, is the box's centre: it keeps the summands small. */
static void measure_size(const morph_mesh *mesh, morph_mesh_report *r) {
    double c[3];
    morph_mesh_bounds(mesh, r->lo, r->hi);
    for (int k = 0; k < 3; k++)
        c[k] = 0.5 * (r->lo[k] + r->hi[k]);
    for (int f = 0; f < mesh->triangles; f++) {
        double n[3], a[3];
        morph_mesh_normal(mesh, f, n);
        morph_sub(mesh->v + 3 * mesh->t[3 * f], c, a);
        r->area += 0.5 * morph_norm(n);
        r->volume += morph_dot(a, n) / 6;
        if (morph_mesh_flat(mesh, f, 0)) r->degenerate++;
    }
}

morph_status morph_mesh_measure(const morph_mesh *mesh, const morph_mesh_edges *edges, morph_mesh_report *r) {
    *r = (morph_mesh_report){.vertices = mesh->vertices, .triangles = mesh->triangles};
    int *label = morph_alloc((size_t)mesh->triangles, sizeof *label);
    if (!label) return MORPH_ERR_NOMEM;
    const morph_status status = morph_mesh_parts(mesh, edges, label, &r->components);
    free(label);
    if (status != MORPH_OK) return status;
    measure_edges(mesh, edges, r);
    measure_size(mesh, r);
    r->closed = edges->count > 0 && r->boundary_edges == 0 && r->nonmanifold_edges == 0 &&
                r->orientation_conflicts == 0;
    return MORPH_OK;
}

morph_status morph_mesh_examine(const morph_mesh *mesh, morph_mesh_report *report) {
    *report = (morph_mesh_report){0};
    morph_mesh_edges edges = {0};
    morph_mesh_tree tree = {0};
    morph_mesh_report r = {0};
    morph_status status = morph_mesh_valid(mesh);
    if (status == MORPH_OK) status = morph_mesh_edges_build(mesh, &edges);
    if (status == MORPH_OK) status = morph_mesh_measure(mesh, &edges, &r);
    if (status == MORPH_OK) status = morph_mesh_tree_build(mesh, &tree);
    if (status == MORPH_OK) {
        r.self_intersections = morph_mesh_crossings(mesh, &tree, NULL, NULL);
        *report = r;
    }
    morph_mesh_tree_free(&tree);
    morph_mesh_edges_free(&edges);
    return status;
}
