/* Orientation: neighbours made to agree, then whole parts turned outward. */
#include "model/mesh_private.h"

#include <stdlib.h>

static void turn(morph_mesh *mesh, int f, bool *turned) {
    int *t = mesh->t + 3 * f;
    const int swap = t[1];
    t[1] = t[2];
    t[2] = swap;
    turned[f] = !turned[f];
}

/* Which triangles must turn, walking from `seed` over its part: the walk only decides, so that the half edges
 * stay as they were built. mark: 0 unseen, 1 stays, 2 turns. Returns the part's size, listed in stack. */
static int walk(const morph_mesh *mesh, const morph_mesh_edges *edges, int seed, char *mark, int *list,
                int *turns) {
    int size = 0;
    *turns = 0;
    list[size++] = seed;
    mark[seed] = 1;
    for (int i = 0; i < size; i++) {
        const int f = list[i];
        for (int h = 3 * f; h < 3 * f + 3; h++) {
            const int e = edges->of[h];
            if (e < 0 || edges->first[e + 1] - edges->first[e] != 2) continue;
            const int *pair = edges->half + edges->first[e], other = pair[0] == h ? pair[1] : pair[0];
            const int g = other / 3;
            if (mark[g]) continue;
            /* Agreeing neighbours run along the edge in opposite directions. */
            const bool agree = morph_half_from(mesh->t, h) != morph_half_from(mesh->t, other);
            mark[g] = agree ? mark[f] : (char)(3 - mark[f]);
            *turns += mark[g] == 2;
            list[size++] = g;
        }
    }
    return size;
}

morph_status morph_mesh_agree(morph_mesh *mesh, const morph_mesh_edges *edges, bool *turned) {
    char *mark = morph_alloc((size_t)mesh->triangles, sizeof *mark);
    int *list = morph_alloc((size_t)mesh->triangles, sizeof *list);
    if (!mark || !list) {
        free(mark);
        free(list);
        return MORPH_ERR_NOMEM;
    }
    for (int seed = 0; seed < mesh->triangles; seed++) {
        if (mark[seed]) continue;
        int turns = 0;
        const int size = walk(mesh, edges, seed, mark, list, &turns);
        if (2 * turns > size)
            for (int i = 0; i < size; i++)
                mark[list[i]] = (char)(3 - mark[list[i]]);
    }
    for (int f = 0; f < mesh->triangles; f++)
        if (mark[f] == 2) turn(mesh, f, turned);
    free(mark);
    free(list);
    return MORPH_OK;
}

/* ---- outward ---- */

typedef struct part {
    int first;      /* a triangle of it */
    int open;       /* boundary edges */
    double hole[3]; /* sum of the boundary edges' midpoints */
    double vector[3];
    double area, volume; /* volume about the boundary's centre (closed: about any point) */
    bool broken;         /* more than two faces at an edge, or neighbours that cannot agree */
    bool inward;
} part;

static void part_edges(const morph_mesh *mesh, const morph_mesh_edges *edges, const int *label, part *parts) {
    for (int e = 0; e < edges->count; e++) {
        const int *h = edges->half + edges->first[e], n = edges->first[e + 1] - edges->first[e];
        part *p = parts + label[h[0] / 3];
        const int a = morph_half_from(mesh->t, h[0]), b = morph_half_to(mesh->t, h[0]);
        if (n > 2 || (n == 2 && morph_half_from(mesh->t, h[1]) == a)) p->broken = true;
        if (n != 1) continue;
        p->open++;
        for (int k = 0; k < 3; k++)
            p->hole[k] += 0.5 * (mesh->v[3 * a + k] + mesh->v[3 * b + k]);
    }
}

/* Volume of the cone of triangles over the reference point. With the centre of the boundary as reference, a
 * fan from there closes the hole and adds nothing: this is the volume of the part with its hole closed. */
static void part_sizes(const morph_mesh *mesh, const int *label, part *parts) {
    for (int f = 0; f < mesh->triangles; f++) {
        if (label[f] < 0) continue;
        part *p = parts + label[f];
        double n[3], r[3];
        morph_mesh_normal(mesh, f, n);
        for (int k = 0; k < 3; k++) {
            const double c = p->open > 0 ? p->hole[k] / p->open : mesh->v[3 * mesh->t[3 * p->first] + k];
            r[k] = mesh->v[3 * mesh->t[3 * f] + k] - c;
            p->vector[k] += 0.5 * n[k];
        }
        p->area += 0.5 * morph_norm(n);
        p->volume += morph_dot(r, n) / 6;
    }
}

/* Is a point of the part inside an odd number of the other closed parts?  The majority of three rays: one
 * may pass through an edge by bad luck. The directions are arbitrary, no two coordinates related. */
static bool nested(const morph_mesh *mesh, const morph_mesh_tree *tree, const int *label, const bool *closed,
                   int which, int triangle) {
    static const double way[3][3] = {{0.3713906, 0.2278112, 0.9001149},
                                     {-0.5350412, 0.7990871, -0.2743353},
                                     {0.6815773, -0.5563071, 0.4754519}};
    double p[3] = {0, 0, 0};
    int odd = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            p[k] += mesh->v[3 * mesh->t[3 * triangle + i] + k] / 3;
    for (int i = 0; i < 3; i++)
        odd += morph_mesh_ray(mesh, tree, p, way[i], label, closed, which) % 2;
    return odd >= 2;
}

/* Closed parts: outward, or inward where they bound a hollow of another part. Open ones are turned only where
 * the answer is clear: the hole is small (the area vector, which a cap would cancel, stays below 0.3 of the
 * area; a half sphere has 0.5, a terrain about 1) and the capped volume is not near zero. */
static bool points_inward(const part *p, bool in_other) {
    if (p->broken) return false;
    if (p->open == 0) return in_other ? p->volume > 0 : p->volume < 0;
    return morph_norm(p->vector) < 0.3 * p->area && p->volume < -1e-3 * p->area * sqrt(p->area);
}

static morph_status outward_parts(morph_mesh *mesh, const morph_mesh_edges *edges, const int *label,
                                  int count, bool *turned, int *crossings) {
    part *parts = morph_alloc((size_t)count, sizeof *parts);
    bool *crossed = morph_alloc((size_t)count, sizeof *crossed);
    bool *closed = morph_alloc((size_t)count, sizeof *closed);
    morph_mesh_tree tree = {0};
    morph_status status = parts && crossed && closed ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = morph_mesh_tree_build(mesh, &tree);
    if (status == MORPH_OK) {
        for (int f = mesh->triangles - 1; f >= 0; f--)
            if (label[f] >= 0) parts[label[f]].first = f;
        part_edges(mesh, edges, label, parts);
        part_sizes(mesh, label, parts);
        *crossings = morph_mesh_crossings(mesh, &tree, label, crossed);
        for (int i = 0; i < count; i++)
            closed[i] = parts[i].open == 0 && !parts[i].broken;
        for (int i = 0; i < count; i++) {
            /* A part that crosses others is no hollow, even where the point tried lies inside. */
            const bool in_other = count > 1 && closed[i] && !crossed[i] &&
                                  nested(mesh, &tree, label, closed, i, parts[i].first);
            parts[i].inward = points_inward(parts + i, in_other);
        }
        for (int f = 0; f < mesh->triangles; f++)
            if (label[f] >= 0 && parts[label[f]].inward) turn(mesh, f, turned);
    }
    morph_mesh_tree_free(&tree);
    free(parts);
    free(crossed);
    free(closed);
    return status;
}

morph_status morph_mesh_outward(morph_mesh *mesh, const morph_mesh_edges *edges, bool *turned,
                                int *crossings) {
    int *label = morph_alloc((size_t)mesh->triangles, sizeof *label), count = 0;
    if (!label) return MORPH_ERR_NOMEM;
    morph_status status = morph_mesh_parts(mesh, edges, label, &count);
    if (status == MORPH_OK) status = outward_parts(mesh, edges, label, count, turned, crossings);
    free(label);
    return status;
}
