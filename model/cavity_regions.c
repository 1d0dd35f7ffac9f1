/* Connected regions of the gap: where a sheet leaves the target alone. */
#include "model/cavity_internal.h"

#include <stdlib.h>
#include <string.h>

/* Per skin triangle: what its samples say. */
typedef struct patch {
    double volume, area, at[3]; /* sum A gap, sum A, sum A gap * middle of the gap */
    int root;
} patch;

static int root_of(patch *p, int t) {
    while (p[t].root != t) {
        p[t].root = p[p[t].root].root;
        t = p[t].root;
    }
    return t;
}

/* Adds a sample: its gap reaches from the skin to the target or the base plane, whichever is nearer. */
static void add_sample(const morph_cavity *c, const morph_skin_sample *s, const double *x, patch *into) {
    double p[3] = {0.0, 0.0, 0.0}, to[3];
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++)
            p[k] += s->weight[j] * x[3 * (size_t)s->joint[j] + (size_t)k];
    const double radius = c->structure->def.radius;
    const double height = isfinite(c->base) ? p[2] - c->base : INFINITY;
    morph_closest closest;
    morph_distance_point_bounded(c->target, p, height, &closest);
    const bool base = closest.triangle < 0 || height < closest.distance;
    const double gap = fmax(0.0, fmin(height, closest.distance) - radius);
    memcpy(to, closest.point, sizeof to);
    if (base) {
        memcpy(to, p, sizeof to);
        to[2] = c->base;
    }
    into->volume += s->area * gap;
    into->area += s->area;
    for (int k = 0; k < 3; k++)
        into->at[k] += s->area * gap * 0.5 * (p[k] + to[k]);
}

static bool neighbours(const int a[3], const int b[3]) {
    int common = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            common += a[i] == b[j];
    return common >= 2;
}

static int by_volume(const void *a, const void *b) {
    const morph_cavity_region *p = a, *q = b;
    if (p->volume != q->volume) return p->volume > q->volume ? -1 : 1;
    return p->triangle - q->triangle;
}

morph_status morph_cavity_regions(const morph_cavity *c, const double *x, double threshold, int capacity,
                                  morph_cavity_region *region, int *count) {
    const morph_structure *s = c->structure;
    *count = 0;
    for (int i = 0; i < 3 * s->joints; i++)
        if (!isfinite(x[i])) return MORPH_ERR_NONFINITE;
    patch *p = morph_alloc((size_t)s->skin_triangles, sizeof *p);
    morph_cavity_region *all = morph_alloc((size_t)s->skin_triangles, sizeof *all);
    if (!p || !all) {
        free(p);
        free(all);
        return MORPH_ERR_NOMEM;
    }
    const int per = c->samples / s->skin_triangles;
    for (int q = 0; q < c->samples; q++)
        add_sample(c, &c->sample[q], x, &p[q / per]);
    for (int t = 0; t < s->skin_triangles; t++) {
        p[t].root = t;
        if (p[t].volume <= threshold * p[t].area) continue;
        for (int u = 0; u < t; u++)
            if (p[u].volume > threshold * p[u].area && neighbours(s->skin[t], s->skin[u]))
                p[root_of(p, u)].root = root_of(p, t);
    }
    for (int t = 0; t < s->skin_triangles; t++) {
        if (p[t].volume <= threshold * p[t].area) continue;
        morph_cavity_region *r = &all[root_of(p, t)];
        r->volume += p[t].volume;
        r->area += p[t].area;
        for (int k = 0; k < 3; k++)
            r->at[k] += p[t].at[k];
        r->triangle = root_of(p, t);
    }
    int found = 0;
    for (int t = 0; t < s->skin_triangles; t++)
        if (all[t].volume > 0.0) all[found++] = all[t];
    for (int r = 0; r < found; r++)
        for (int k = 0; k < 3; k++)
            all[r].at[k] /= all[r].volume;
    qsort(all, (size_t)found, sizeof *all, by_volume);
    *count = found;
    for (int r = 0; r < found && r < capacity; r++)
        region[r] = all[r];
    free(p);
    free(all);
    return MORPH_OK;
}
