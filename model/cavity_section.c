/* Cuts by slabs.
 *
 * The plane meets the triangles in line segments. Between two neighbouring values of u at which a segment
 * ends or two of them cross, the segments lie above each other in one order, so every slab falls into
 * trapezoids, and what is true on its middle line is true of the whole slab. On that line winding and inside
 * are counted as on a column of the cavity volume (cavity_volume.c). Vertical segments enclose nothing in any
 * slab. */
#include "model/cavity_section.h"

#include "model/cavity_internal.h"
#include "model/distance_internal.h"

#include <stdlib.h>
#include <string.h>

enum { SKIN, TARGET, BASE };

typedef struct segment {
    double u[2], z[2]; /* u[0] < u[1] */
    int kind, sign;    /* +1: outward, or away from the target, is up */
} segment;

typedef struct cutter {
    const morph_cavity *cavity;
    int axis;
    double at;
    morph_cavity_section *out;
    segment *segment; /* by u[0] */
    int segments, room;
    double *stop; /* ends and crossings */
    int stops, stop_room;
    double (*order)[2]; /* of the segments of a slab: height at its middle, number */
    int solid_room, cavity_room, line_room, outline_room;
} cutter;

/* Room for one entry more; doubles. */
static bool reserve(void **array, int count, int *room, size_t size) {
    if (count < *room) return true;
    const int more = 2 * *room + 64;
    void *larger = realloc(*array, (size_t)more * size);
    if (!larger) return false;
    *array = larger;
    *room = more;
    return true;
}

/* Where edge (i, j) meets the plane: the same bits from either of its triangles. */
static void edge_point(const cutter *c, const morph_mesh *m, int i, int j, double p[2]) {
    const double *a = m->v + 3 * (size_t)(i < j ? i : j), *b = m->v + 3 * (size_t)(i < j ? j : i);
    const int across = 1 - c->axis;
    const double f = (c->at - a[across]) / (b[across] - a[across]);
    p[0] = a[c->axis] + f * (b[c->axis] - a[c->axis]);
    p[1] = a[2] + f * (b[2] - a[2]);
}

static morph_status add_segment(cutter *c, segment s) {
    if (s.u[0] == s.u[1]) return MORPH_OK;
    if (s.u[0] > s.u[1]) {
        const segment t = s;
        for (int k = 0; k < 2; k++) {
            s.u[k] = t.u[1 - k];
            s.z[k] = t.z[1 - k];
        }
    }
    if (!reserve((void **)&c->segment, c->segments, &c->room, sizeof *c->segment)) return MORPH_ERR_NOMEM;
    c->segment[c->segments++] = s;
    return MORPH_OK;
}

static morph_status add_line(cutter *c, int kind, double p[2][2]) {
    morph_cavity_section *out = c->out;
    double(**lines)[2][2] = kind == SKIN ? &out->line : &out->outline;
    int *count = kind == SKIN ? &out->lines : &out->outlines;
    if (!reserve((void **)lines, *count, kind == SKIN ? &c->line_room : &c->outline_room, sizeof **lines))
        return MORPH_ERR_NOMEM;
    memcpy((*lines)[(*count)++], p, 2 * sizeof *p);
    return MORPH_OK;
}

/* A triangle is met along the line from the edge that goes through the plane towards larger coordinates to
 * the edge that comes back. With u = x and the normal up that line runs towards smaller u (a triangle
 * (0,-1), (1,1), (-1,1) goes through y = 0 at x = 1/2 and comes back at -1/2); with u = y the hand changes.
 * `shown`: triangles before this one are lines of the picture, the others (the fan) only shut it off. */
static morph_status cut_mesh(cutter *c, const morph_mesh *m, int kind, int shown) {
    morph_status status = MORPH_OK;
    for (int t = 0; t < m->triangles && status == MORPH_OK; t++) {
        const int *v = m->t + 3 * (size_t)t;
        bool beyond[3];
        for (int k = 0; k < 3; k++)
            beyond[k] = m->v[3 * (size_t)v[k] + (size_t)(1 - c->axis)] >= c->at;
        if (beyond[0] == beyond[1] && beyond[1] == beyond[2]) continue;
        double p[2][2];
        for (int k = 0; k < 3; k++) {
            const int l = (k + 1) % 3;
            if (beyond[k] != beyond[l]) edge_point(c, m, v[k], v[l], p[beyond[k] ? 1 : 0]);
        }
        const bool back = p[1][0] < p[0][0];
        if (t < shown) status = add_line(c, kind, p);
        if (status == MORPH_OK)
            status = add_segment(
                c, (segment){{p[0][0], p[1][0]}, {p[0][1], p[1][1]}, kind, back == (c->axis == 0) ? 1 : -1});
    }
    return status;
}

static int by_left(const void *a, const void *b) {
    const segment *p = a, *q = b;
    if (p->u[0] != q->u[0]) return p->u[0] < q->u[0] ? -1 : 1;
    if (p->u[1] != q->u[1]) return p->u[1] < q->u[1] ? -1 : 1;
    if (p->z[0] != q->z[0]) return p->z[0] < q->z[0] ? -1 : 1;
    if (p->z[1] != q->z[1]) return p->z[1] < q->z[1] ? -1 : 1;
    return p->kind != q->kind ? p->kind - q->kind : p->sign - q->sign;
}

static int by_value(const void *a, const void *b) {
    const double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

static int by_height(const void *a, const void *b) {
    const double *p = a, *q = b;
    if (p[0] != q[0]) return p[0] < q[0] ? -1 : 1;
    return (p[1] > q[1]) - (p[1] < q[1]);
}

static double height_at(const segment *s, double u) {
    if (u <= s->u[0]) return s->z[0];
    if (u >= s->u[1]) return s->z[1];
    return s->z[0] + (u - s->u[0]) / (s->u[1] - s->u[0]) * (s->z[1] - s->z[0]);
}

static morph_status add_stop(cutter *c, double u) {
    if (!reserve((void **)&c->stop, c->stops, &c->stop_room, sizeof *c->stop)) return MORPH_ERR_NOMEM;
    c->stop[c->stops++] = u;
    return MORPH_OK;
}

/* Over the part of u that both have, two straight lines cross where their difference changes its sign. */
static morph_status add_crossing(cutter *c, const segment *p, const segment *q) {
    const double from = fmax(p->u[0], q->u[0]), to = fmin(p->u[1], q->u[1]);
    const double d0 = height_at(p, from) - height_at(q, from), d1 = height_at(p, to) - height_at(q, to);
    if (!(from < to) || !((d0 < 0 && d1 > 0) || (d0 > 0 && d1 < 0))) return MORPH_OK;
    return add_stop(c, from + d0 / (d0 - d1) * (to - from));
}

/* The base plane is one more segment, as long as everything together. */
static morph_status find_stops(cutter *c) {
    double lo = INFINITY, hi = -INFINITY;
    for (int k = 0; k < c->segments; k++) {
        lo = fmin(lo, c->segment[k].u[0]);
        hi = fmax(hi, c->segment[k].u[1]);
    }
    const double base = c->cavity->base;
    morph_status status = MORPH_OK;
    if (isfinite(base) && lo < hi) status = add_segment(c, (segment){{lo, hi}, {base, base}, BASE, 0});
    if (c->segments > 0) qsort(c->segment, (size_t)c->segments, sizeof *c->segment, by_left);
    for (int k = 0; k < c->segments && status == MORPH_OK; k++) {
        const segment *s = &c->segment[k];
        status = add_stop(c, s->u[0]);
        if (status == MORPH_OK) status = add_stop(c, s->u[1]);
        for (int l = k + 1; l < c->segments && c->segment[l].u[0] < s->u[1] && status == MORPH_OK; l++)
            status = add_crossing(c, s, &c->segment[l]);
    }
    if (c->stops > 0) qsort(c->stop, (size_t)c->stops, sizeof *c->stop, by_value);
    return status;
}

static morph_status add_trapezoid(cutter *c, bool solid, const double u[2], const segment *below,
                                  const segment *above) {
    morph_cavity_section *out = c->out;
    morph_trapezoid **list = solid ? &out->solid : &out->cavity, t;
    int *count = solid ? &out->solids : &out->cavities;
    if (!reserve((void **)list, *count, solid ? &c->solid_room : &c->cavity_room, sizeof **list))
        return MORPH_ERR_NOMEM;
    for (int k = 0; k < 2; k++) {
        t.u[k] = u[k];
        t.lo[k] = height_at(below, u[k]);
        t.hi[k] = height_at(above, u[k]);
    }
    if (!solid) out->area += 0.5 * (u[1] - u[0]) * (t.hi[0] - t.lo[0] + t.hi[1] - t.lo[1]);
    (*list)[(*count)++] = t;
    return MORPH_OK;
}

static bool in_target(const cutter *c, int crossings, double u, double z) {
    if (c->cavity->target->closed) return crossings >= 1;
    double p[3] = {0, 0, z};
    p[c->axis] = u;
    p[1 - c->axis] = c->at;
    return morph_inside(c->cavity->target, p);
}

/* The first n of c->order are the segments over the slab. */
static morph_status fill_slab(cutter *c, const double u[2], int n) {
    const double middle = 0.5 * u[0] + 0.5 * u[1];
    int winding = 0, inside = 0;
    bool above = !isfinite(c->cavity->base);
    for (int k = 0; k < n; k++) {
        const segment *s = &c->segment[(int)c->order[k][1]];
        c->order[k][0] = height_at(s, middle);
        if (s->kind == SKIN) winding += s->sign;
        if (s->kind == TARGET) inside += s->sign;
    }
    if (n > 0) qsort(c->order, (size_t)n, sizeof *c->order, by_height);
    morph_status status = MORPH_OK;
    for (int k = 0; k + 1 < n && status == MORPH_OK; k++) {
        const segment *s = &c->segment[(int)c->order[k][1]];
        if (s->kind == SKIN) winding -= s->sign;
        if (s->kind == TARGET) inside -= s->sign;
        if (s->kind == BASE) above = true;
        if (!(c->order[k][0] < c->order[k + 1][0])) continue;
        const bool solid = in_target(c, inside, middle, 0.5 * (c->order[k][0] + c->order[k + 1][0]));
        if (solid || (winding >= 1 && above))
            status = add_trapezoid(c, solid, u, s, &c->segment[(int)c->order[k + 1][1]]);
    }
    return status;
}

static morph_status fill_slabs(cutter *c) {
    c->order = morph_alloc((size_t)c->segments, sizeof *c->order);
    int *active = morph_alloc((size_t)c->segments, sizeof *active);
    morph_status status = c->order && active ? MORPH_OK : MORPH_ERR_NOMEM;
    int next = 0, count = 0;
    for (int k = 0; k + 1 < c->stops && status == MORPH_OK; k++) {
        const double u[2] = {c->stop[k], c->stop[k + 1]};
        if (!(u[0] < u[1])) continue;
        while (next < c->segments && c->segment[next].u[0] <= u[0])
            active[count++] = next++;
        int kept = 0;
        for (int i = 0; i < count; i++)
            if (c->segment[active[i]].u[1] >= u[1]) active[kept++] = active[i];
        count = kept;
        for (int i = 0; i < count; i++)
            c->order[i][1] = active[i];
        status = fill_slab(c, u, count);
    }
    free(active);
    return status;
}

morph_status morph_cavity_section_cut(const morph_cavity *cavity, const double *x, int axis, double at,
                                      morph_cavity_section *out) {
    *out = (morph_cavity_section){.axis = axis, .at = at};
    if ((axis != 0 && axis != 1) || !isfinite(at)) return MORPH_ERR_INPUT;
    morph_distance *skin;
    morph_status status = morph_skin_surface(cavity->structure, x, !isfinite(cavity->base), &skin);
    if (status != MORPH_OK) return status;
    cutter c = {.cavity = cavity, .axis = axis, .at = at, .out = out};
    const morph_mesh *target = morph_distance_mesh(cavity->target);
    status = cut_mesh(&c, morph_distance_mesh(skin), SKIN, cavity->structure->skin_triangles);
    if (status == MORPH_OK) status = cut_mesh(&c, target, TARGET, target->triangles);
    if (status == MORPH_OK) status = find_stops(&c);
    if (status == MORPH_OK) status = fill_slabs(&c);
    morph_distance_destroy(skin);
    free(c.segment);
    free(c.stop);
    free(c.order);
    if (status != MORPH_OK) morph_cavity_section_free(out);
    return status;
}

void morph_cavity_section_free(morph_cavity_section *section) {
    free(section->cavity);
    free(section->solid);
    free(section->line);
    free(section->outline);
    *section = (morph_cavity_section){0};
}
