/* Samples of skin and target, and the measures between them. */
#include "model/cavity_internal.h"
#include "model/distance_internal.h"

#include <stdlib.h>
#include <string.h>

enum { PER_TRIANGLE = 9, LEAST_ALONG = 8 };
static const double MAX_EXPOSED = 20000;

void morph_cavity_destroy(morph_cavity *cavity) {
    if (!cavity) return;
    free(cavity->sample);
    free(cavity->expose);
    free(cavity);
}

/* Centroids of the 9 congruent triangles that a triangle falls into when its sides are cut in three: equal
 * areas, so equal weights. In ninths. */
static const int PATTERN[PER_TRIANGLE][3] = {{7, 1, 1}, {4, 4, 1}, {1, 7, 1}, {4, 1, 4}, {1, 4, 4},
                                             {1, 1, 7}, {5, 2, 2}, {2, 5, 2}, {2, 2, 5}};

static morph_status make_samples(morph_cavity *c) {
    const morph_structure *s = c->structure;
    c->sample = morph_alloc((size_t)s->skin_triangles, PER_TRIANGLE * sizeof *c->sample);
    if (!c->sample) return MORPH_ERR_NOMEM;
    for (int i = 0; i < s->skin_triangles; i++) {
        double u[3], v[3], n[3];
        const double *a = s->start + 3 * (size_t)s->skin[i][0];
        morph_sub(s->start + 3 * (size_t)s->skin[i][1], a, u);
        morph_sub(s->start + 3 * (size_t)s->skin[i][2], a, v);
        morph_cross(u, v, n);
        const double area = morph_norm(n) / 2;
        if (!isfinite(area)) return MORPH_ERR_NONFINITE;
        c->start_area += area;
        for (int q = 0; q < PER_TRIANGLE; q++) {
            morph_skin_sample *sample = &c->sample[c->samples++];
            sample->area = area / PER_TRIANGLE;
            for (int j = 0; j < 3; j++) {
                sample->joint[j] = s->skin[i][j];
                sample->weight[j] = PATTERN[q][j] / 9.0;
            }
        }
    }
    return MORPH_OK;
}

/* Top crossing of each cell-centred vertical line over the target's box, where it lies above the base. */
static morph_status make_exposed(morph_cavity *c) {
    const morph_distance *t = c->target;
    const double wx = t->hi[0] - t->lo[0], wy = t->hi[1] - t->lo[1];
    const double cell = fmax(c->structure->spacing / 8, sqrt(wx / MAX_EXPOSED * wy));
    const int nx = (int)fmin(fmax(LEAST_ALONG, ceil(wx / cell)), MAX_EXPOSED);
    const int ny = (int)fmin(fmax(LEAST_ALONG, ceil(wy / cell)), MAX_EXPOSED);
    c->expose = morph_alloc((size_t)nx * (size_t)ny, sizeof *c->expose);
    if (!c->expose) return MORPH_ERR_NOMEM;
    morph_hits hits = {0};
    morph_status status = MORPH_OK;
    for (int i = 0; i < nx && status == MORPH_OK; i++)
        for (int j = 0; j < ny; j++) {
            const double x = t->lo[0] + (i + 0.5) * (wx / nx), y = t->lo[1] + (j + 0.5) * (wy / ny);
            status = morph_hits_find(t, x, y, &hits);
            if (status != MORPH_OK) break;
            if (hits.count == 0 || hits.z[hits.count - 1] < c->base) continue;
            morph_exposed *e = &c->expose[c->exposed++];
            *e = (morph_exposed){.point = {x, y, hits.z[hits.count - 1]}, .area = wx / nx * (wy / ny)};
            morph_closest closest;
            morph_distance_point(t, e->point, &closest);
            memcpy(e->normal, closest.normal, sizeof e->normal);
        }
    morph_hits_free(&hits);
    return status;
}

morph_status morph_cavity_create(const morph_structure *structure, const morph_distance *target, double base,
                                 morph_cavity **out) {
    *out = NULL;
    if (!structure || !target || structure->skin_triangles < 1 || !(structure->spacing > 0) || isinf(base))
        return MORPH_ERR_INPUT;
    morph_cavity *c = calloc(1, sizeof *c);
    if (!c) return MORPH_ERR_NOMEM;
    c->structure = structure;
    c->target = target;
    c->base = base;
    morph_status status = make_samples(c);
    if (status == MORPH_OK) status = make_exposed(c);
    if (status != MORPH_OK) {
        morph_cavity_destroy(c);
        return status;
    }
    *out = c;
    return MORPH_OK;
}

/* Distance of a skin sample to target or base plane, less the skin's half-thickness; not below 0. */
static double sample_gap(const morph_cavity *c, const morph_skin_sample *sample, const double *x) {
    double p[3] = {0};
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++)
            p[k] += sample->weight[j] * x[3 * (size_t)sample->joint[j] + (size_t)k];
    const double radius = c->structure->def.radius;
    double distance = INFINITY;
    if (isfinite(c->base)) distance = p[2] - c->base;
    if (distance <= radius) return 0;
    /* Only a target nearer than the base plane matters. */
    morph_closest closest;
    morph_distance_point_bounded(c->target, p, distance, &closest);
    return fmax(0, closest.distance - radius);
}

typedef struct weighted {
    double value, weight;
} weighted;

static int compare_weighted(const void *pa, const void *pb) {
    const weighted *a = pa, *b = pb;
    if (a->value != b->value) return a->value < b->value ? -1 : 1;
    return (a->weight > b->weight) - (a->weight < b->weight);
}

static morph_status measure_skin(const morph_cavity *c, const double *x, morph_measure *out) {
    weighted *gap = morph_alloc((size_t)c->samples, sizeof *gap);
    if (!gap) return MORPH_ERR_NOMEM;
    double whole = 0, sum = 0, squares = 0;
    for (int q = 0; q < c->samples; q++) {
        gap[q] = (weighted){sample_gap(c, &c->sample[q], x), c->sample[q].area};
        whole += gap[q].weight;
        sum += gap[q].weight * gap[q].value;
        squares += gap[q].weight * gap[q].value * gap[q].value;
    }
    qsort(gap, (size_t)c->samples, sizeof *gap, compare_weighted);
    out->gap_max = out->gap_p95 = gap[c->samples - 1].value;
    double below = 0;
    for (int q = 0; q < c->samples; q++) {
        below += gap[q].weight;
        if (below < 0.95 * whole) continue;
        out->gap_p95 = gap[q].value;
        break;
    }
    out->gap_mean = whole > 0 ? sum / whole : 0;
    out->objective += squares;
    free(gap);
    return MORPH_OK;
}

static void measure_target(const morph_cavity *c, const morph_distance *skin, morph_measure *out) {
    const double radius = c->structure->def.radius, near = c->structure->spacing / 4;
    double whole = 0, sum = 0, squares = 0, covered = 0;
    for (int i = 0; i < c->exposed; i++) {
        const morph_exposed *e = &c->expose[i];
        morph_nearest nearest = {.squared = INFINITY};
        morph_tree_nearest(skin, e->point, -1, &nearest);
        const double gap = fmax(0, sqrt(nearest.squared) - radius);
        whole += e->area;
        sum += e->area * gap;
        squares += e->area * gap * gap;
        if (gap <= near) covered += e->area;
    }
    out->gap_target = whole > 0 ? sum / whole : 0;
    out->coverage = whole > 0 ? covered / whole : 1;
    out->objective += MORPH_COVER_WEIGHT * squares;
}

morph_status morph_cavity_measure(const morph_cavity *cavity, const double *x, morph_measure *out) {
    *out = (morph_measure){0};
    morph_distance *skin;
    morph_status status = morph_skin_surface(cavity->structure, x, false, &skin);
    if (status != MORPH_OK) return status;
    measure_target(cavity, skin, out);
    morph_distance_destroy(skin);
    status = measure_skin(cavity, x, out);
    if (status != MORPH_OK) return status;
    return morph_cavity_volume(cavity, x, cavity->structure->spacing / 16, &out->volume);
}

morph_status morph_cavity_closest(const morph_cavity *cavity, const double *x, int (*joint)[3],
                                  double (*weight)[3], double *distance) {
    morph_distance *skin;
    const morph_status status = morph_skin_surface(cavity->structure, x, false, &skin);
    if (status != MORPH_OK) return status;
    for (int i = 0; i < cavity->exposed; i++) {
        morph_nearest nearest = {.squared = INFINITY};
        morph_tree_nearest(skin, cavity->expose[i].point, -1, &nearest);
        if (distance) distance[i] = sqrt(nearest.squared);
        const morph_facet *f = &skin->facet[nearest.slot];
        if (joint) memcpy(joint[i], skin->mesh.t + 3 * (size_t)f->triangle, sizeof joint[i]);
        if (!weight) continue;
        morph_point_triangle(cavity->expose[i].point, f->corner[0], f->corner[1], f->corner[2], weight[i]);
    }
    morph_distance_destroy(skin);
    return MORPH_OK;
}
