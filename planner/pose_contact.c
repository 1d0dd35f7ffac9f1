/* Where a pose comes near the target, the base plane and itself: exact measures, and the rows for what is
 * near. */
#include "planner/pose_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool grow(void **array, int *capacity, int need, size_t size) {
    if (need <= *capacity) return true;
    int next = *capacity ? 2 * *capacity : 64;
    while (next < need)
        next *= 2;
    void *p = realloc(*array, (size_t)next * size);
    if (!p) return false;
    *array = p;
    *capacity = next;
    return true;
}

/* A point is new when no row stands within `apart` of its weights on the same joints. */
static bool is_new_point(const morph_active *a, const morph_point *p, double apart) {
    for (int n = 0; n < a->points; n++) {
        const morph_point *q = &a->point[n];
        if (memcmp(p->joint, q->joint, sizeof p->joint) != 0) continue;
        double far = 0.0;
        for (int k = 0; k < 3; k++)
            far = fmax(far, fabs(p->weight[k] - q->weight[k]));
        if (far < apart) return false;
    }
    return true;
}

/* Zero weights are dropped and joints ordered, so that a point has one name whatever element found it. */
static morph_point canonical(const morph_structure *s, const int *joint, const double *weight, int n) {
    morph_point p = {.joint = {0, 0, 0}, .weight = {0.0, 0.0, 0.0}, .link = -1};
    int kept = 0;
    for (int a = 0; a < n; a++) {
        if (weight[a] < 1e-9) continue;
        int at = kept++;
        for (; at > 0 && p.joint[at - 1] > joint[a]; at--) {
            p.joint[at] = p.joint[at - 1];
            p.weight[at] = p.weight[at - 1];
        }
        p.joint[at] = joint[a];
        p.weight[at] = weight[a];
    }
    for (int a = kept; a < 3; a++)
        p.joint[a] = p.joint[0];
    for (int l = 0; kept == 2 && l < s->links; l++)
        if (s->link[l][0] == p.joint[0] && s->link[l][1] == p.joint[1]) p.link = l;
    return p;
}

static void add_point(morph_examiner *e, const int *joint, const double *weight, int n, double apart) {
    morph_active *a = e->active;
    const morph_point p = canonical(e->world->structure, joint, weight, n);
    if (!is_new_point(a, &p, apart) || morph_all_fixed(e->world->structure, p.joint, 3)) return;
    if (!grow((void **)&a->point, &a->point_capacity, a->points + 1, sizeof *a->point)) {
        e->status = MORPH_ERR_NOMEM;
        return;
    }
    a->point[a->points++] = p;
    e->added++;
}

/* Points of a triangle where the target comes closer than its corners tell (an edge or a corner of the target
 * beneath it): between them the element could move into the target unseen within one solve. Nine points leave
 * no more than a quarter of the triangle unseen. */
static void add_samples(morph_examiner *e, const int *joint, double reach) {
    static const double weights[9][3] = {{0.5, 0.5, 0.0},   {0.0, 0.5, 0.5},   {0.5, 0.0, 0.5},
                                         {0.6, 0.2, 0.2},   {0.2, 0.6, 0.2},   {0.2, 0.2, 0.6},
                                         {0.75, 0.25, 0.0}, {0.0, 0.75, 0.25}, {0.25, 0.0, 0.75}};
    const double a = e->world->structure->spacing;
    double corner[3];
    for (int i = 0; i < 3; i++)
        corner[i] = morph_sdf_eval(e->world->sdf, &e->metres[3 * joint[i]], NULL, NULL) / a;
    for (int q = 0; q < 9; q++) {
        double at[3] = {0.0, 0.0, 0.0}, even = 0.0;
        for (int i = 0; i < 3; i++) {
            even += weights[q][i] * corner[i];
            for (int k = 0; k < 3; k++)
                at[k] += weights[q][i] * e->metres[3 * joint[i] + k];
        }
        const double distance = morph_sdf_eval(e->world->sdf, at, NULL, NULL) / a;
        /* A fiftieth of a spacing: half a link's radius. */
        if (distance < reach && distance < even - 0.02) add_point(e, joint, weights[q], 3, 0.05);
    }
}

/* On which feature of its triangle a point of the target lies: the number of corners that carry it (1 vertex,
 * 2 edge, 3 face); for an edge also its direction. */
static int target_feature(const morph_distance *exact, const morph_closest *c, double edge[3]) {
    const morph_mesh *mesh = morph_distance_mesh(exact);
    const int *t = &mesh->t[3 * c->triangle];
    double w[3];
    morph_point_triangle(c->point, &mesh->v[3 * t[0]], &mesh->v[3 * t[1]], &mesh->v[3 * t[2]], w);
    int carried = 0, on[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        if (w[i] > 1e-6) on[carried++] = t[i];
    if (carried == 2) morph_sub(&mesh->v[3 * on[1]], &mesh->v[3 * on[0]], edge);
    return carried;
}

/* The vertex of the target that pokes furthest through a triangle; false if none does. Metres. */
static bool poking_vertex(const morph_examiner *e, const int *joint, double point[3]) {
    const morph_mesh *mesh = morph_distance_mesh(e->world->exact);
    const double *a = &e->metres[3 * joint[0]], *b = &e->metres[3 * joint[1]], *c = &e->metres[3 * joint[2]];
    double u[3], v[3], n[3], furthest = 0.0;
    morph_sub(b, a, u);
    morph_sub(c, a, v);
    morph_cross(u, v, n);
    const double norm = morph_norm(n);
    for (int k = 0; k < mesh->vertices; k++) {
        double w[3], weight[3], to[3];
        morph_sub(&mesh->v[3 * k], a, to);
        const double height = morph_dot(n, to) / norm;
        /* Beyond half a spacing it is another part of the target. */
        if (height <= furthest || height > 0.5 * e->world->structure->spacing) continue;
        for (int m = 0; m < 3; m++)
            w[m] = mesh->v[3 * k + m] - height * n[m] / norm;
        if (morph_point_triangle(w, a, b, c, weight) > 1e-9 * e->world->structure->spacing) continue;
        furthest = height;
        memcpy(point, &mesh->v[3 * k], 3 * sizeof *point);
    }
    return furthest > 0.0;
}

static bool set_feature(const morph_examiner *e, morph_feature *f, const double point[3],
                        const double outward[3]) {
    const double a = e->world->structure->spacing;
    for (int k = 0; k < 3; k++)
        f->point[k] = (point[k] + (k == 2 ? e->world->lift : 0.0)) / a;
    double u[3], v[3], n[3];
    morph_sub(&e->x[3 * f->joint[1]], &e->x[3 * f->joint[0]], u);
    if (f->is_edge)
        memcpy(v, f->edge, sizeof v);
    else
        morph_sub(&e->x[3 * f->joint[2]], &e->x[3 * f->joint[0]], v);
    morph_cross(u, v, n);
    f->sign = morph_dot(n, outward) >= 0.0 ? 1.0 : -1.0;
    /* Nearly parallel lines have no plane between them. */
    return morph_norm(n) > 0.05 * morph_norm(u) * morph_norm(v);
}

static void add_feature(morph_examiner *e, const morph_feature *f) {
    morph_active *a = e->active;
    if (morph_all_fixed(e->world->structure, f->joint, 3)) return;
    for (int k = 0; k < a->features; k++)
        if (memcmp(a->feature[k].joint, f->joint, sizeof f->joint) == 0 &&
            a->feature[k].is_edge == f->is_edge && morph_dist(a->feature[k].point, f->point) < 1e-6)
            return;
    if (!grow((void **)&a->feature, &a->feature_capacity, a->features + 1, sizeof *f)) {
        e->status = MORPH_ERR_NOMEM;
        return;
    }
    a->feature[a->features++] = *f;
    e->added++;
}

/* The row for an element's closest pair with the target: of the feature where the element's inside is
 * closest, of the point otherwise. */
static void add_closest(morph_examiner *e, const int *joint, const double *weight, int n,
                        const morph_closest *c) {
    morph_feature f = {.joint = {joint[0], joint[1], joint[n - 1]}};
    int kept[3], count = 0;
    for (int i = 0; i < n; i++)
        if (weight[i] > 1e-6) kept[count++] = i;
    double point[3];
    memcpy(point, c->point, sizeof point);
    bool use = count > 1;
    if (count == 2) {
        const int carried = target_feature(e->world->exact, c, f.edge);
        f.is_edge = true;
        f.joint[0] = joint[kept[0]];
        f.joint[1] = f.joint[2] = joint[kept[1]];
        if (carried == 1) { /* a link over a vertex: as over an edge across it */
            double u[3];
            morph_sub(&e->x[3 * f.joint[1]], &e->x[3 * f.joint[0]], u);
            morph_cross(c->normal, u, f.edge);
        }
        use = carried < 3 && c->distance > 0.0;
    } else if (count == 3 && c->distance <= 0.0) {
        use = poking_vertex(e, joint, point);
    }
    if (use && set_feature(e, &f, point, c->normal))
        add_feature(e, &f);
    else
        add_point(e, joint, weight, n, 0.02);
}

static void skin_name(const morph_structure *s, int t, char *text, size_t size) {
    const int *n = s->joint_node[s->skin[t][0]];
    snprintf(text, size, "skin triangle %d at (%d,%d)", t, n[0], n[1]);
}

/* One element (n = 2: link, 3: skin triangle): exact least distance; rows at its joints and at its deepest
 * point where near. */
static void examine_element(morph_examiner *e, const int *joint, int n, int element) {
    const morph_structure *s = e->world->structure;
    const double a = s->spacing, r = s->def.radius / a;
    const double reach = r + e->inset->clearance + (e->near ? e->near->clearance : 0.0);
    /* The smooth distance at the middle bounds the element's from below: 1-Lipschitz, and off by less than a
     * tenth of a spacing where the grid covers it; a further half spacing makes sure. */
    double middle[3] = {0.0, 0.0, 0.0}, extent = 0.0;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            middle[k] += e->metres[3 * joint[i] + k] / n;
    for (int i = 0; i < n; i++)
        extent = fmax(extent, morph_dist(middle, &e->metres[3 * joint[i]]));
    if ((morph_sdf_eval(e->world->sdf, middle, NULL, NULL) - extent) / a > fmax(reach, r) + 0.5) return;
    double weight[3] = {0.0, 0.0, 0.0};
    morph_closest c;
    if (n == 2)
        morph_distance_segment(e->world->exact, &e->metres[3 * joint[0]], &e->metres[3 * joint[1]], weight,
                               &c);
    else
        morph_distance_triangle(e->world->exact, &e->metres[3 * joint[0]], &e->metres[3 * joint[1]],
                                &e->metres[3 * joint[2]], weight, &c);
    const double distance = c.distance / a;
    morph_examine_note(e, MORPH_LIMIT_CLEARANCE, r - distance, n == 2 ? morph_link_name : skin_name, element);
    if (!e->active || distance > reach) return;
    for (int i = 0; i < n; i++) {
        const double one = 1.0;
        morph_closest v;
        morph_distance_point_bounded(e->world->exact, &e->metres[3 * joint[i]], reach * a, &v);
        if (v.distance < reach * a) add_point(e, &joint[i], &one, 1, 0.5);
    }
    if (n == 3) add_samples(e, joint, reach);
    add_closest(e, joint, weight, n, &c);
}

static void renew_bias(morph_examiner *e) {
    const double a = e->world->structure->spacing;
    for (int n = 0; n < e->active->points; n++) {
        morph_point *p = &e->active->point[n];
        double at[3];
        morph_closest c;
        morph_point_at(p, e->metres, at);
        const double smooth = morph_sdf_eval(e->world->sdf, at, NULL, NULL);
        morph_distance_point_bounded(e->world->exact, at, 2.0 * a, &c);
        /* Far points need no correction: their rows are idle. */
        p->bias = fabs(c.distance) < a ? (c.distance - smooth) / a : 0.0;
    }
}

void morph_examine_clearance(morph_examiner *e) {
    const morph_structure *s = e->world->structure;
    for (int t = 0; t < s->skin_triangles; t++)
        examine_element(e, s->skin[t], 3, t);
    /* Links of the layer that carries the skin are edges of its triangles. */
    for (int l = 0; l < s->links; l++)
        if (s->link_kind[l] != MORPH_LINK_BOTTOM) examine_element(e, s->link[l], 2, l);
    if (e->active) renew_bias(e);
    for (int j = 0; j < s->joints && !isnan(e->world->base); j++)
        morph_examine_note(e, MORPH_LIMIT_BASE, e->world->base / s->spacing - e->x[3 * j + 2],
                           morph_joint_name, j);
}

static void axis_ends(const morph_structure *s, int axis, int ends[2]) {
    const int *pair = axis < s->links ? s->link[axis] : s->post[axis - s->links];
    ends[0] = pair[0];
    ends[1] = pair[1];
}

static void pair_name(morph_examiner *e, int a, int b, double amount) {
    morph_violation *v = e->violation;
    if (amount <= v->amount[MORPH_LIMIT_SELF]) return;
    char first[48], second[48];
    v->amount[MORPH_LIMIT_SELF] = amount;
    morph_axis_name(e->world->structure, a, first, sizeof first);
    morph_axis_name(e->world->structure, b, second, sizeof second);
    snprintf(v->element[MORPH_LIMIT_SELF], sizeof v->element[MORPH_LIMIT_SELF], "%s / %s", first, second);
}

static void add_pair(morph_examiner *e, const morph_pair *pair) {
    morph_active *a = e->active;
    if (morph_all_fixed(e->world->structure, pair->joint, 2)) return;
    if (!grow((void **)&a->pair, &a->pair_capacity, a->pairs + 1, sizeof *pair)) {
        e->status = MORPH_ERR_NOMEM;
        return;
    }
    a->pair[a->pairs++] = *pair;
    e->added++;
}

static void examine_pair(morph_examiner *e, int a, int b) {
    const morph_structure *s = e->world->structure;
    int p[2], q[2];
    axis_ends(s, a, p);
    axis_ends(s, b, q);
    if (p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1]) return;
    /* Posts are taken as thick as links. */
    const double apart = 2.0 * s->def.radius / s->spacing;
    double u, v;
    const double d =
        morph_segment_segment(&e->x[3 * p[0]], &e->x[3 * p[1]], &e->x[3 * q[0]], &e->x[3 * q[1]], &u, &v);
    pair_name(e, a, b, apart - d);
    if (!e->active || d > apart + e->inset->self + e->near->self) return;
    /* Axes that cross have no side: the rows would be made of rounding. The examination names them. */
    if (d < 1e-6) return;
    double normal[3];
    for (int k = 0; k < 3; k++)
        normal[k] = ((1.0 - u) * e->x[3 * p[0] + k] + u * e->x[3 * p[1] + k] -
                     (1.0 - v) * e->x[3 * q[0] + k] - v * e->x[3 * q[1] + k]) /
                    d;
    /* Two convex bodies are apart by d along the line of their closest points if all their corners are: one
     * row for each two ends. */
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            add_pair(e, &(morph_pair){.joint = {p[i], q[j]},
                                      .distance = apart,
                                      .axis = {a, b},
                                      .normal = {normal[0], normal[1], normal[2]}});
}

typedef struct span {
    double lo, hi;
    int axis;
} span;

static int by_lo(const void *a, const void *b) {
    const span *p = a, *q = b;
    return p->lo < q->lo ? -1 : p->lo > q->lo ? 1 : p->axis - q->axis;
}

/* Sweep along x; pairs whose boxes are apart in y or z are dropped before the exact distance. */
void morph_examine_self(morph_examiner *e) {
    const morph_structure *s = e->world->structure;
    const int axes = s->links + s->posts;
    const double reach =
        2.0 * s->def.radius / s->spacing + (e->active ? e->inset->self + e->near->self : 0.0);
    span *spans = morph_alloc((size_t)axes, sizeof *spans);
    if (!spans) {
        e->status = MORPH_ERR_NOMEM;
        return;
    }
    for (int n = 0; n < axes; n++) {
        int p[2];
        axis_ends(s, n, p);
        spans[n] = (span){fmin(e->x[3 * p[0]], e->x[3 * p[1]]), fmax(e->x[3 * p[0]], e->x[3 * p[1]]), n};
    }
    qsort(spans, (size_t)axes, sizeof *spans, by_lo);
    for (int i = 0; i < axes && e->status == MORPH_OK; i++)
        for (int j = i + 1; j < axes && spans[j].lo <= spans[i].hi + reach; j++) {
            int p[2], q[2];
            axis_ends(s, spans[i].axis, p);
            axis_ends(s, spans[j].axis, q);
            bool apart = false;
            for (int k = 1; k < 3 && !apart; k++) {
                const double *x = e->x + k;
                apart = fmin(x[3 * p[0]], x[3 * p[1]]) > fmax(x[3 * q[0]], x[3 * q[1]]) + reach ||
                        fmin(x[3 * q[0]], x[3 * q[1]]) > fmax(x[3 * p[0]], x[3 * p[1]]) + reach;
            }
            const int a = spans[i].axis, b = spans[j].axis;
            if (!apart) examine_pair(e, a < b ? a : b, a < b ? b : a);
        }
    free(spans);
}
