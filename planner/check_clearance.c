/* Distance of joints, link axes and skin to the target, less the link radius, over the whole motion. A
 * deformable target gives way on the way: against it, its surface as pressed, at the end alone.
 * Separated distances are FCL's; where an element touches the mesh or lies inside it, its depth is our own.
 */
#include "planner/check_parts.h"

#include "model/distance.h"
#include "solvers/collision.h"

#include <stdlib.h>

/* The swept test of an element against what is near costs as much as a few distances. */
#define WORTH 4.0

typedef struct clearance {
    const morph_record *r;
    morph_mesh target;           /* the record's arrays */
    morph_motion joints, offset; /* offset.x is NULL when the target stands still */
    morph_solid *solid;
    morph_distance *exact;
    morph_boxes *boxes;
    double lo[3], hi[3]; /* of the target at offset 0 */
    double *joint_radius;
    double skin_radius;
    morph_status status;
    morph_sweep *sweep; /* the search that asks */
    /* the element at hand */
    morph_element element;
    const int *corner;
    int corners;
    double radius;
} clearance;

typedef struct edge {
    int a, b, forward;
} edge;

static int compare_edges(const void *p, const void *q) {
    const edge *a = p, *b = q;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    if (a->b != b->b) return a->b < b->b ? -1 : 1;
    return a->forward - b->forward;
}

/* Every edge is used exactly twice, once in each direction. */
morph_status morph_check_closed(const morph_mesh *m, bool *closed) {
    const size_t n = 3 * (size_t)m->triangles;
    edge *e = morph_alloc(n, sizeof *e);
    if (!e) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < n; i++) {
        const int a = m->t[i], b = m->t[i % 3 == 2 ? i - 2 : i + 1];
        e[i] = a < b ? (edge){a, b, 1} : (edge){b, a, 0};
    }
    qsort(e, n, sizeof *e, compare_edges);
    *closed = n % 2 == 0;
    for (size_t i = 0; i + 1 < n && *closed; i += 2) {
        const bool pair = e[i].a == e[i + 1].a && e[i].b == e[i + 1].b && e[i].forward != e[i + 1].forward;
        const bool alone = i + 2 >= n || e[i + 2].a != e[i].a || e[i + 2].b != e[i].b;
        *closed = pair && alone;
    }
    free(e);
    return MORPH_OK;
}

static morph_status target_create(clearance *c) {
    const morph_mesh *m = &c->target;
    for (int k = 0; k < 3; k++) {
        c->lo[k] = INFINITY;
        c->hi[k] = -INFINITY;
        for (int i = 0; i < m->vertices; i++) {
            c->lo[k] = fmin(c->lo[k], m->v[3 * (size_t)i + (size_t)k]);
            c->hi[k] = fmax(c->hi[k], m->v[3 * (size_t)i + (size_t)k]);
        }
    }
    bool closed = false;
    morph_status status = morph_check_closed(m, &closed);
    if (status == MORPH_OK) status = morph_solid_create(m->v, m->vertices, m->t, m->triangles, &c->solid);
    if (status == MORPH_OK) status = morph_distance_create(m, closed, &c->exact);
    if (status == MORPH_OK) status = morph_boxes_create(m->v, m->t, m->triangles, &c->boxes);
    return status;
}

static morph_status clearance_create(const morph_record *r, clearance *c) {
    *c = (clearance){.r = r, .skin_radius = morph_check_radius(r)};
    c->target = r->deformed_v
                    ? (morph_mesh){r->deformed_vertices, r->deformed_triangles, r->deformed_v, r->deformed_t}
                    : (morph_mesh){r->target_vertices, r->target_triangles, r->target_v, r->target_t};
    c->joint_radius = morph_alloc((size_t)r->joints, sizeof(double));
    if (!c->joint_radius) return MORPH_ERR_NOMEM;
    for (int i = 0; i < r->links; i++)
        for (int e = 0; e < 2; e++) {
            double *radius = &c->joint_radius[r->link[i][e]];
            *radius = fmax(*radius, r->link_radius[i]);
        }
    morph_status status = target_create(c);
    if (status == MORPH_OK)
        status = morph_motion_create(r->schedule_joints, r->samples, r->joints, &c->joints);
    if (status == MORPH_OK && r->offset_schedule)
        status = morph_motion_create(r->offset_schedule, r->samples, 1, &c->offset);
    return status;
}

static void clearance_free(clearance *c) {
    morph_motion_free(&c->joints);
    morph_motion_free(&c->offset);
    morph_solid_destroy(c->solid);
    morph_distance_destroy(c->exact);
    morph_boxes_destroy(c->boxes);
    free(c->joint_radius);
}

static bool in_box(const clearance *c, const double p[3]) {
    for (int k = 0; k < 3; k++)
        if (p[k] < c->lo[k] || p[k] > c->hi[k]) return false;
    return true;
}

/* A depth costs as much as some 15 distances, and the search's budget is meant as time. */
static double depth(clearance *c, const double q[9]) {
    c->sweep->evaluations += 15;
    morph_closest at;
    double weight[3];
    if (c->corners == 1)
        morph_distance_point(c->exact, q, &at);
    else if (c->corners == 2)
        morph_distance_segment(c->exact, q, q + 3, weight, &at);
    else
        morph_distance_triangle(c->exact, q, q + 3, q + 6, weight, &at);
    return at.distance;
}

/* Signed distance less the radius. An element that does not touch the surface lies on one side of it, so one
 * corner tells whether it is inside. */
static double clearance_value(void *data, double tau) {
    clearance *c = data;
    double q[9], shift[3] = {0, 0, 0}, distance = 0;
    if (c->offset.x) morph_motion_point(&c->offset, 0, tau, shift);
    for (int i = 0; i < 3; i++) {
        const int corner = i < c->corners ? i : c->corners - 1;
        if (i == corner) {
            morph_motion_point(&c->joints, c->corner[i], tau, q + 3 * i);
            for (int k = 0; k < 3; k++)
                q[3 * i + k] -= shift[k];
        } else {
            for (int k = 0; k < 3; k++)
                q[3 * i + k] = q[3 * corner + k];
        }
    }
    int nearest;
    c->status = morph_solid_distance(c->solid, q, 1, &distance, &nearest);
    if (c->status != MORPH_OK) return NAN;
    if (distance == 0) return fmin(depth(c, q), 0) - c->radius;
    if (in_box(c, q) && morph_inside(c->exact, q)) return fmin(depth(c, q), -distance) - c->radius;
    return distance - c->radius;
}

/* No point of a segment or triangle moves further than its fastest corner, and the target moves by its
 * offset. */
static double clearance_travel(void *data, double from, double to) {
    const clearance *c = data;
    double most = 0;
    for (int i = 0; i < c->corners; i++)
        most = fmax(most, morph_motion_travel(&c->joints, c->corner[i], from, to));
    return most + (c->offset.x ? morph_motion_travel(&c->offset, 0, from, to) : 0);
}

/* By the swept test of every vertex and triangle and every two edges of the element and what is near of the
 * target, straight from end to end of the span in the target's frame, with what both bend on the way added.
 * At the span's ends the signed distance is larger than `distance`, so the element is outside there, and what
 * never comes near the surface stays outside. */
static bool clearance_apart(void *data, double from, double to, double least, double spare) {
    const clearance *c = data;
    const double distance = least + c->radius;
    if (!(distance > 0)) return false;
    const double time[2] = {from, to};
    morph_swept_element e = {.corners = c->corners};
    double bend = 0;
    for (int i = 0; i < c->corners; i++)
        bend = fmax(bend, morph_motion_bend(&c->joints, c->corner[i], from, to));
    if (c->offset.x) bend += morph_motion_bend(&c->offset, 0, from, to);
    if (bend > spare) return false;
    for (int end = 0; end < 2; end++) {
        double shift[3] = {0, 0, 0};
        if (c->offset.x) morph_motion_point(&c->offset, 0, time[end], shift);
        for (int i = 0; i < c->corners; i++) {
            morph_motion_point(&c->joints, c->corner[i], time[end], e.at[end][i]);
            for (int k = 0; k < 3; k++)
                e.at[end][i][k] -= shift[k];
        }
    }
    return morph_boxes_apart(c->boxes, &e, distance + bend);
}

/* Joints first, then links, then skin: of equals the first is named, and a joint says more than its links. */
static int element_count(const morph_record *r) {
    return r->joints + r->links + r->skin_triangles;
}

static void select_element(clearance *c, int i, int *joint) {
    const morph_record *r = c->r;
    if (i < r->joints) {
        *joint = i;
        c->element = morph_element_of(MORPH_ELEMENT_JOINT, i);
        c->corner = joint;
        c->corners = 1;
        c->radius = c->joint_radius[i];
    } else if ((i -= r->joints) < r->links) {
        c->element = morph_element_of(MORPH_ELEMENT_LINK, i);
        c->corner = r->link[i];
        c->corners = 2;
        c->radius = r->link_radius[i];
    } else {
        i -= r->links;
        c->element = morph_element_of(MORPH_ELEMENT_SKIN, i);
        c->corner = r->skin[i];
        c->corners = 3;
        c->radius = c->skin_radius;
    }
}

/* Values at both ends of the schedule: the final pose is where clearance is usually least, and a good least
 * value early spares most of the search. */
static void ends(clearance *c, morph_sweep *s, double *value, morph_finding *m) {
    const double last = c->r->samples - 1;
    int joint;
    for (int i = 0; i < element_count(c->r) && !s->failed; i++) {
        select_element(c, i, &joint);
        for (int e = c->r->deformed_v ? 1 : 0; e < 2; e++) {
            const double v = clearance_value(c, e ? last : 0);
            value[2 * i + e] = v;
            if (isnan(v)) s->failed = true;
            if (!(v < s->least - s->tie)) continue;
            s->least = v;
            s->at = e ? last : 0;
            m->a = c->element;
        }
    }
}

static morph_status search(clearance *c, const morph_control *control, double h, double *value,
                           morph_findings *f) {
    const morph_record *r = c->r;
    morph_finding *m = &f->kind[MORPH_MARGIN_CLEARANCE];
    const int n = element_count(r);
    /* Slack: a tenth of the tolerance, so that no depth beyond 1.1e-3 spacings passes unseen. Budget: a
     * sheet that slides over a plane a spacing far with everything in contact takes half of it, a usual plan
     * a thousandth; only a record that races along the surface runs out. */
    morph_sweep s = {.value = clearance_value,
                     .travel = clearance_travel,
                     .apart = f->plain ? NULL : clearance_apart,
                     .worth = WORTH,
                     .data = c,
                     .slack = 1e-4 * r->spacing,
                     .tie = 1e-9 * r->spacing,
                     .least = INFINITY,
                     .finest = r->samples,
                     .budget = 1000000 + 10000L * n};
    c->sweep = &s;
    ends(c, &s, value, m);
    int joint;
    for (int i = 0; i < n && !s.failed && !s.exhausted && !r->deformed_v; i++) {
        select_element(c, i, &joint);
        if (morph_sweep_run(&s, 0, value[2 * i], r->samples - 1, value[2 * i + 1])) m->a = c->element;
        if (morph_stopped(control)) return MORPH_ERR_STOPPED;
        morph_progress(control, "check", 0.3 + 0.4 * (i + 1) / n);
    }
    if (s.failed) return c->status == MORPH_OK ? MORPH_ERR_NONFINITE : c->status;
    f->evaluations += s.evaluations;
    f->proofs += s.proofs;
    m->worst = s.least;
    m->time = s.at * h;
    f->clearance_resolution = r->deformed_v ? 0 : s.finest * h;
    if (s.exhausted) {
        char name[96];
        morph_element_name(r, c->element, name, sizeof name);
        morph_findings_defect(f, "clearance cannot be verified: %s moves too fast between samples", name);
    }
    return MORPH_OK;
}

morph_status morph_check_clearance(const morph_record *r, const morph_control *control, morph_findings *f) {
    morph_finding_begin(&f->kind[MORPH_MARGIN_CLEARANCE], 1e-3 * r->spacing, r->spacing);
    clearance c;
    morph_status status = clearance_create(r, &c);
    double *value = morph_alloc((size_t)element_count(r), 2 * sizeof(double));
    if (status == MORPH_OK && !value) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = search(&c, control, morph_check_step(r->time, r->samples), value, f);
    free(value);
    clearance_free(&c);
    return status;
}
