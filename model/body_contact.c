/* Contact between a deformable body and a sheet: finding pairs, and the contacts they make. */
#include "model/body_contact.h"
#include "model/spatial_hash.h"

#include <stdlib.h>
#include <string.h>

/* Nearer than this part of the body's size, the direction between two points is rounding. */
#define TOUCHING 1e-12
/* Vertices that have poked through are looked for this part of the skin's mean edge behind it. */
#define BEHIND 0.25

struct morph_body_contacts {
    const morph_body *body;
    morph_body_sheet sheet; /* its arrays are owned here */
    double *inverse;
    morph_body_place *place;
    int (*triangle)[3];
    double most_radius, size;
    int *first, *around; /* tetrahedra around every vertex */
    morph_hash *hash;
    morph_box *box_a, *box_b; /* room for every box of a step */
    int *listed;              /* numbers of the places or vertices whose boxes are in box_a */
    int *row;                 /* and of those in box_b */
    /* Of each listed place: the tetrahedron it is in (-1: outside), the nearest triangle, how near. Of each
     * listed vertex: the nearest skin triangle. */
    int *inside, *nearest;
    double *distance;
    double (*weight)[3];
    double depth;
    int touches;
    morph_body_touch *touch; /* places + surface vertices */
};

static int larger(int a, int b) {
    return a > b ? a : b;
}

static morph_status check_sheet(const morph_body_sheet *s) {
    if (s->joints < 1 || s->places < 0 || s->triangles < 0) return MORPH_ERR_INPUT;
    if (!(s->radius >= 0.0) || !isfinite(s->radius) || !(s->margin >= 0.0) || !isfinite(s->margin))
        return MORPH_ERR_INPUT;
    for (int j = 0; j < s->joints; j++)
        if (!(s->inverse[j] >= 0.0) || !isfinite(s->inverse[j])) return MORPH_ERR_INPUT;
    for (int p = 0; p < s->places; p++) {
        const morph_body_place *place = &s->place[p];
        if (place->corners < 1 || place->corners > 3 || !(place->radius >= 0.0) || !isfinite(place->radius))
            return MORPH_ERR_INPUT;
        for (int k = 0; k < place->corners; k++)
            if (place->joint[k] < 0 || place->joint[k] >= s->joints || !isfinite(place->weight[k]))
                return MORPH_ERR_INPUT;
    }
    for (int t = 0; t < s->triangles; t++)
        for (int k = 0; k < 3; k++)
            if (s->triangle[t][k] < 0 || s->triangle[t][k] >= s->joints) return MORPH_ERR_INPUT;
    return MORPH_OK;
}

static morph_status copy_sheet(morph_body_contacts *c, const morph_body_sheet *s) {
    c->sheet = *s;
    c->inverse = morph_alloc((size_t)s->joints, sizeof *c->inverse);
    c->place = morph_alloc((size_t)s->places, sizeof *c->place);
    c->triangle = morph_alloc((size_t)s->triangles, sizeof *c->triangle);
    if (!c->inverse || !c->place || !c->triangle) return MORPH_ERR_NOMEM;
    memcpy(c->inverse, s->inverse, (size_t)s->joints * sizeof *c->inverse);
    if (s->triangles > 0) memcpy(c->triangle, s->triangle, (size_t)s->triangles * sizeof *c->triangle);
    c->most_radius = s->radius;
    for (int p = 0; p < s->places; p++) {
        c->place[p] = s->place[p];
        for (int k = s->place[p].corners; k < 3; k++) {
            c->place[p].joint[k] = 0;
            c->place[p].weight[k] = 0.0;
        }
        c->most_radius = fmax(c->most_radius, s->place[p].radius);
    }
    c->sheet.inverse = c->inverse;
    c->sheet.place = c->place;
    c->sheet.triangle = (const int(*)[3])c->triangle;
    return MORPH_OK;
}

static morph_status build(morph_body_contacts *c, const morph_body_sheet *s) {
    const morph_tetra *mesh = &c->body->mesh;
    morph_status status = copy_sheet(c, s);
    if (status == MORPH_OK)
        status =
            morph_tetra_around(mesh->vertices, mesh->tets, (const int(*)[4])mesh->tet, &c->first, &c->around);
    if (status == MORPH_OK) status = morph_hash_create(&c->hash);
    if (status != MORPH_OK) return status;
    const size_t a = (size_t)larger(s->places, mesh->surface_vertices);
    const size_t b = (size_t)larger(mesh->tets, larger(mesh->triangles, s->triangles));
    c->box_a = morph_alloc(a, sizeof *c->box_a);
    c->box_b = morph_alloc(b, sizeof *c->box_b);
    c->listed = morph_alloc(a, sizeof *c->listed);
    c->row = morph_alloc(b, sizeof *c->row);
    c->inside = morph_alloc(a, sizeof *c->inside);
    c->nearest = morph_alloc(a, sizeof *c->nearest);
    c->distance = morph_alloc(a, sizeof *c->distance);
    c->weight = morph_alloc(a, sizeof *c->weight);
    c->touch = morph_alloc((size_t)s->places + (size_t)mesh->surface_vertices, sizeof *c->touch);
    const bool done = c->box_a && c->box_b && c->listed && c->row && c->inside && c->nearest && c->distance &&
                      c->weight && c->touch;
    return done ? MORPH_OK : MORPH_ERR_NOMEM;
}

morph_status morph_body_contacts_create(const morph_body *body, const morph_body_sheet *sheet,
                                        morph_body_contacts **out) {
    *out = NULL;
    morph_status status = check_sheet(sheet);
    if (status != MORPH_OK) return status;
    morph_body_contacts *c = morph_alloc(1, sizeof *c);
    if (!c) return MORPH_ERR_NOMEM;
    c->body = body;
    status = build(c, sheet);
    if (status != MORPH_OK)
        morph_body_contacts_destroy(c);
    else
        *out = c;
    return status;
}

void morph_body_contacts_destroy(morph_body_contacts *c) {
    if (!c) return;
    free(c->inverse);
    free(c->place);
    free(c->triangle);
    free(c->first);
    free(c->around);
    morph_hash_destroy(c->hash);
    free(c->box_a);
    free(c->box_b);
    free(c->listed);
    free(c->row);
    free(c->inside);
    free(c->nearest);
    free(c->distance);
    free(c->weight);
    free(c->touch);
    free(c);
}

size_t morph_body_contacts_bytes(const morph_body_contacts *c) {
    return morph_hash_bytes(c->hash);
}

int morph_body_contacts_count(const morph_body_contacts *c) {
    return c->touches;
}

morph_body_touch *morph_body_contacts_list(morph_body_contacts *c) {
    return c->touch;
}

double morph_body_contacts_depth(const morph_body_contacts *c) {
    return c->depth;
}

static void place_of(const double *x, const int corner[3], const double weight[3], double q[3]) {
    for (int k = 0; k < 3; k++)
        q[k] = weight[0] * x[3 * corner[0] + k] + weight[1] * x[3 * corner[1] + k] +
               weight[2] * x[3 * corner[2] + k];
}

static bool all_finite(const double *x, int n) {
    for (int i = 0; i < n; i++)
        if (!isfinite(x[i])) return false;
    return true;
}

static morph_box box_around(const double *x, int n, double margin) {
    morph_box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const double lo = x[3 * i + k] - margin, hi = x[3 * i + k] + margin;
            box.lo[k] = lo < box.lo[k] ? lo : box.lo[k];
            box.hi[k] = hi > box.hi[k] ? hi : box.hi[k];
        }
    return box;
}

/* A place on the common face of two tetrahedra must be in one of them, whichever way rounding goes. */
#define IN_TET 1e-9

/* Inside or on the tetrahedron: its barycentric weights, the volumes with the point in place of a corner, are
 * not negative. */
static bool in_tet(const double *y, const int t[4], const double p[3]) {
    static const int face[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    double a[4][3], n[3], volume[4], sum = 0.0;
    for (int k = 0; k < 4; k++)
        morph_sub(&y[3 * t[k]], p, a[k]);
    for (int k = 0; k < 4; k++) {
        morph_cross(a[face[k][0]], a[face[k][1]], n);
        volume[k] = morph_dot(n, a[face[k][2]]);
        sum += volume[k];
    }
    return fmin(fmin(volume[0], volume[1]), fmin(volume[2], volume[3])) >= -IN_TET * sum;
}

static void normal_of(const double *x, const int t[3], double n[3]) {
    double a[3], b[3];
    morph_sub(&x[3 * t[1]], &x[3 * t[0]], a);
    morph_sub(&x[3 * t[2]], &x[3 * t[0]], b);
    morph_cross(a, b, n);
    const double norm = morph_norm(n);
    for (int k = 0; k < 3; k++)
        n[k] = norm > 0.0 ? n[k] / norm : 0.0;
}

/* Half space along the unit normal; gap: the distance now, negative where one is in the other. */
static void add_touch(morph_body_contacts *c, const double *x, const double *before, const int joint[3],
                      const double weight[3], const int vertex[3], const double body_weight[3],
                      const double normal[3], double gap, double radius, int source) {
    const morph_body *b = c->body;
    morph_body_touch *t = &c->touch[c->touches];
    *t = (morph_body_touch){.source = source};
    double sum = 0.0, q[3], s[3];
    for (int k = 0; k < 3; k++) {
        t->joint[k] = joint[k];
        t->weight[k] = weight[k];
        t->vertex[k] = vertex[k];
        t->body_weight[k] = body_weight[k];
        t->normal[k] = normal[k];
        sum += weight[k] * weight[k] * c->inverse[joint[k]] +
               body_weight[k] * body_weight[k] * b->inverse[vertex[k]];
    }
    c->depth = fmax(c->depth, radius - gap);
    if (!(sum > 0.0)) return; /* both held: nothing can move */
    t->inverse = 1.0 / sum;
    place_of(x, joint, weight, q);
    place_of(b->x, vertex, body_weight, s);
    t->level = morph_dot(normal, q) - morph_dot(normal, s) - gap + radius + c->sheet.margin;
    place_of(before, joint, weight, q);
    place_of(b->start, vertex, body_weight, s);
    morph_sub(q, s, t->before);
    c->touches++;
}

/* ---- places of the sheet against the body ---- */

/* Those near the body's box; returns the count. */
static int list_places(morph_body_contacts *c, const double *x, const morph_box *body) {
    int n = 0;
    for (int p = 0; p < c->sheet.places; p++) {
        const morph_body_place *place = &c->place[p];
        double q[3];
        place_of(x, place->joint, place->weight, q);
        morph_box *box = &c->box_a[n];
        memcpy(box->lo, q, sizeof q);
        memcpy(box->hi, q, sizeof q);
        if (!morph_box_overlap(box, body)) continue;
        c->inside[n] = c->nearest[n] = -1;
        c->distance[n] = INFINITY;
        c->listed[n++] = p;
    }
    return n;
}

static void nearer(morph_body_contacts *c, int at, const double p[3], const double *x, const int t[3],
                   int number) {
    double weight[3];
    const double d = morph_point_triangle(p, &x[3 * t[0]], &x[3 * t[1]], &x[3 * t[2]], weight);
    /* Of equally near ones the smallest number, whatever the order of the pairs. */
    if (!(d < c->distance[at] || (d == c->distance[at] && number < c->nearest[at]))) return;
    c->distance[at] = d;
    c->nearest[at] = number;
    memcpy(c->weight[at], weight, sizeof weight);
}

/* Tetrahedra and surface triangles whose boxes meet `region`, in box_b, numbers in row; returns the count. */
static int list_tets(morph_body_contacts *c, const morph_box *region) {
    const morph_tetra *mesh = &c->body->mesh;
    int n = 0;
    for (int t = 0; t < mesh->tets; t++) {
        c->box_b[n] = morph_box_of(c->body->x, mesh->tet[t], 4, 0.0);
        if (morph_box_overlap(&c->box_b[n], region)) c->row[n++] = t;
    }
    return n;
}

static int list_triangles(morph_body_contacts *c, const double *x, const int (*triangle)[3], int triangles,
                          const morph_box *region) {
    int n = 0;
    for (int t = 0; t < triangles; t++) {
        c->box_b[n] = morph_box_of(x, triangle[t], 3, 0.0);
        if (morph_box_overlap(&c->box_b[n], region)) c->row[n++] = t;
    }
    return n;
}

static morph_status find_inside(morph_body_contacts *c, int places, const morph_box *region) {
    const int(*pair)[2];
    int pairs;
    const int tets = list_tets(c, region);
    const morph_status status = morph_hash_between(c->hash, places, c->box_a, tets, c->box_b, &pair, &pairs);
    for (int k = 0; k < pairs && status == MORPH_OK; k++) {
        const int at = pair[k][0], t = c->row[pair[k][1]];
        if (c->inside[at] >= 0 && c->inside[at] < t) continue;
        if (in_tet(c->body->x, c->body->mesh.tet[t], c->box_a[at].lo)) c->inside[at] = t;
    }
    return status;
}

/* The nearest triangle of the surface up to `reach` away, and however far for a place inside: that deep, all
 * triangles are looked at. */
static morph_status find_surface(morph_body_contacts *c, int places, const morph_box *region, double reach) {
    const morph_tetra *mesh = &c->body->mesh;
    const int(*triangle)[3] = (const int(*)[3])mesh->triangle;
    const int(*pair)[2];
    int pairs;
    const int near = list_triangles(c, c->body->x, triangle, mesh->triangles, region);
    for (int i = 0; i < places; i++)
        for (int k = 0; k < 3; k++) {
            c->box_a[i].lo[k] -= reach;
            c->box_a[i].hi[k] += reach;
        }
    const morph_status status = morph_hash_between(c->hash, places, c->box_a, near, c->box_b, &pair, &pairs);
    if (status != MORPH_OK) return status;
    for (int k = 0; k < pairs; k++) {
        const morph_box *box = &c->box_a[pair[k][0]];
        const int t = c->row[pair[k][1]];
        const double p[3] = {0.5 * (box->lo[0] + box->hi[0]), 0.5 * (box->lo[1] + box->hi[1]),
                             0.5 * (box->lo[2] + box->hi[2])};
        nearer(c, pair[k][0], p, c->body->x, triangle[t], t);
    }
    for (int i = 0; i < places; i++) {
        const morph_box *box = &c->box_a[i];
        if (c->inside[i] < 0 || c->distance[i] <= reach) continue;
        const double p[3] = {0.5 * (box->lo[0] + box->hi[0]), 0.5 * (box->lo[1] + box->hi[1]),
                             0.5 * (box->lo[2] + box->hi[2])};
        for (int t = 0; t < mesh->triangles; t++)
            nearer(c, i, p, c->body->x, triangle[t], t);
    }
    return MORPH_OK;
}

static void touch_place(morph_body_contacts *c, int at, const double *x, const double *before, double near) {
    const morph_body *b = c->body;
    const int p = c->listed[at];
    const morph_body_place *place = &c->place[p];
    if (c->nearest[at] < 0) return;
    const int *t = b->mesh.triangle[c->nearest[at]];
    const double d = c->distance[at], gap = c->inside[at] >= 0 ? -d : d;
    if (gap - place->radius > near) return;
    double q[3], s[3], n[3];
    place_of(x, place->joint, place->weight, q);
    place_of(b->x, t, c->weight[at], s);
    if (d > TOUCHING * c->size)
        for (int k = 0; k < 3; k++)
            n[k] = (q[k] - s[k]) / gap;
    else
        normal_of(b->x, t, n);
    add_touch(c, x, before, place->joint, place->weight, t, c->weight[at], n, gap, place->radius, p);
}

static morph_status find_places(morph_body_contacts *c, const double *x, const double *before, double near) {
    const double reach = c->most_radius + near;
    const morph_box body = box_around(c->body->x, c->body->vertices, reach);
    const int places = list_places(c, x, &body);
    if (places == 0) return MORPH_OK;
    /* Where the listed places are: only there tetrahedra and triangles matter. */
    morph_box region = c->box_a[0];
    for (int i = 1; i < places; i++)
        for (int k = 0; k < 3; k++) {
            region.lo[k] = fmin(region.lo[k], c->box_a[i].lo[k]);
            region.hi[k] = fmax(region.hi[k], c->box_a[i].hi[k]);
        }
    morph_status status = find_inside(c, places, &region);
    for (int k = 0; k < 3; k++) {
        region.lo[k] -= reach;
        region.hi[k] += reach;
    }
    if (status == MORPH_OK) status = find_surface(c, places, &region, reach);
    for (int i = 0; i < places && status == MORPH_OK; i++)
        touch_place(c, i, x, before, near);
    return status;
}

/* ---- vertices of the body against the skin ---- */

/* A vertex on the skin's under side keeps the skin's radius. One on the upper side has poked through if the
 * skin at its foot is inside the body, and has to go back; otherwise it is another part of the body, that
 * the skin lies under, and keeps the radius from there. */
static void touch_vertex(morph_body_contacts *c, int at, const double *x, const double *before, double near) {
    const morph_body *b = c->body;
    const int v = b->mesh.surface[c->listed[at]];
    if (c->nearest[at] < 0) return;
    const int *t = c->triangle[c->nearest[at]];
    const double *w = c->weight[at], one[3] = {1.0, 0.0, 0.0}, d = c->distance[at];
    const int vertex[3] = {v, 0, 0};
    double q[3], away[3], n[3];
    place_of(x, t, w, q);
    normal_of(x, t, n);
    morph_sub(q, &b->x[3 * v], away);
    bool through = false;
    if (morph_dot(n, away) < 0.0 && w[0] > 0.0 && w[1] > 0.0 && w[2] > 0.0)
        for (int k = c->first[v]; k < c->first[v + 1] && !through; k++)
            through = in_tet(b->x, b->mesh.tet[c->around[k]], q);
    const double gap = through ? -d : d;
    if (gap - c->sheet.radius > near) return;
    if (!through && d > TOUCHING * c->size)
        for (int k = 0; k < 3; k++)
            n[k] = away[k] / d;
    add_touch(c, x, before, t, w, vertex, one, n, gap, c->sheet.radius, c->sheet.places + c->listed[at]);
}

static double mean_edge(const morph_body_contacts *c, const double *x) {
    double sum = 0.0;
    for (int t = 0; t < c->sheet.triangles; t++)
        for (int k = 0; k < 3; k++)
            sum += morph_dist(&x[3 * c->triangle[t][k]], &x[3 * c->triangle[t][(k + 1) % 3]]);
    return sum / (3.0 * c->sheet.triangles);
}

static morph_status find_vertices(morph_body_contacts *c, const double *x, const double *before,
                                  double near) {
    const morph_tetra *mesh = &c->body->mesh;
    if (c->sheet.triangles == 0) return MORPH_OK;
    const double reach = c->sheet.radius + near + BEHIND * mean_edge(c, x);
    const morph_box sheet = box_around(x, c->sheet.joints, reach);
    int n = 0;
    for (int i = 0; i < mesh->surface_vertices; i++) {
        c->box_a[n] = morph_box_of(c->body->x, &mesh->surface[i], 1, reach);
        if (!morph_box_overlap(&c->box_a[n], &sheet)) continue;
        c->nearest[n] = -1;
        c->distance[n] = INFINITY;
        c->listed[n++] = i;
    }
    if (n == 0) return MORPH_OK;
    const morph_box body = box_around(c->body->x, c->body->vertices, reach);
    const int(*pair)[2], m = list_triangles(c, x, c->sheet.triangle, c->sheet.triangles, &body);
    int pairs;
    const morph_status status = morph_hash_between(c->hash, n, c->box_a, m, c->box_b, &pair, &pairs);
    if (status != MORPH_OK) return status;
    for (int k = 0; k < pairs; k++) {
        const int at = pair[k][0], t = c->row[pair[k][1]];
        nearer(c, at, &c->body->x[3 * mesh->surface[c->listed[at]]], x, c->triangle[t], t);
    }
    for (int i = 0; i < n; i++)
        touch_vertex(c, i, x, before, near);
    return MORPH_OK;
}

morph_status morph_body_contacts_find(morph_body_contacts *c, const double *x, const double *before,
                                      double near) {
    c->touches = 0;
    c->depth = 0.0;
    if (!all_finite(x, 3 * c->sheet.joints) || !all_finite(c->body->x, 3 * c->body->vertices))
        return MORPH_ERR_NONFINITE;
    const morph_box box = box_around(c->body->x, c->body->vertices, 0.0);
    c->size = fmax(box.hi[0] - box.lo[0], fmax(box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]));
    const morph_status status = find_places(c, x, before, near);
    return status == MORPH_OK ? find_vertices(c, x, before, near) : status;
}

/* ---- corrections ---- */

/* Friction towards `want` without its normal part, cut to the cone; its change is added to `change`. */
static void set_drag(morph_body_touch *t, const double want[3], double friction, double change[3]) {
    const double along = morph_dot(want, t->normal), most = friction * t->push;
    double drag[3];
    for (int k = 0; k < 3; k++)
        drag[k] = want[k] - along * t->normal[k];
    const double size = morph_norm(drag), keep = size > most ? most / size : 1.0;
    for (int k = 0; k < 3; k++) {
        change[k] += keep * drag[k] - t->drag[k];
        t->drag[k] = keep * drag[k];
    }
}

static void move_both(const morph_body_contacts *c, const morph_body_touch *t, double *x, morph_body *body,
                      const double change[3]) {
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++) {
            x[3 * t->joint[j] + i] += t->weight[j] * c->inverse[t->joint[j]] * change[i];
            body->x[3 * t->vertex[j] + i] -= t->body_weight[j] * body->inverse[t->vertex[j]] * change[i];
        }
}

void morph_body_contact_start(morph_body_contacts *c, int k, double push, const double drag[3], double *x,
                              morph_body *body, double friction) {
    morph_body_touch *t = &c->touch[k];
    double change[3];
    t->push = push;
    for (int i = 0; i < 3; i++)
        change[i] = push * t->normal[i];
    set_drag(t, drag, friction, change);
    move_both(c, t, x, body, change);
}

/* q - s moves by push / inverse: sum w (w / m) + sum u (u / m). */
void morph_body_contact_project(morph_body_contacts *c, int k, double *x, morph_body *body, double friction) {
    morph_body_touch *t = &c->touch[k];
    double q[3], s[3], d[3], change[3], want[3];
    place_of(x, t->joint, t->weight, q);
    place_of(body->x, t->vertex, t->body_weight, s);
    morph_sub(q, s, d);
    const double old = t->push;
    t->push = fmax(0.0, old - (morph_dot(t->normal, d) - t->level) * t->inverse);
    if (t->push == 0.0 && old == 0.0) return;
    for (int i = 0; i < 3; i++) {
        change[i] = (t->push - old) * t->normal[i];
        want[i] = t->drag[i] - (d[i] - t->before[i]) * t->inverse;
    }
    if (friction > 0.0) set_drag(t, want, friction, change);
    move_both(c, t, x, body, change);
}

void morph_body_contacts_force(const morph_body_contacts *c, double h, double force[3]) {
    for (int i = 0; i < 3; i++) {
        force[i] = 0.0;
        for (int k = 0; k < c->touches; k++)
            force[i] += (c->touch[k].push * c->touch[k].normal[i] + c->touch[k].drag[i]) / (h * h);
    }
}
