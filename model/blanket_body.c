/* The deformable target under the blanket. The body makes its own step (model/body_step.c) beside the
 * blanket's drift; then contact between the two goes through the blanket's sweeps, where every correction
 * moves both, and what it moved becomes velocity on both sides. */
#include "model/blanket_internal.h"
#include "model/body_contact.h"

#include <stdlib.h>
#include <string.h>

/* Contacts aim this much outside, as those with a rigid target do (blanket_contact.c). */
#define CONTACT_MARGIN 1e-3 /* spacings */
/* A frame of more substeps of the body than this would take minutes: beyond it a run is not meant. */
#define MOST_SUBSTEPS 1e6
/* Part of the last step's forces that contacts go on pushing with: as with a rigid target (blanket_force.c,
 * WARM). Corners tremble with none and, where contacts change places, with all. */
#define CARRIED 0.7

struct morph_blanket_soft {
    morph_body *body; /* the caller's */
    morph_body_contacts *contacts;
    /* By source, what contacts held with in the step before; the forces are pushed with all through the
     * coming step, kg m. */
    morph_hold *hold;
    double *push, step; /* 3 * vertices: of the body, N; s: of the step before */
    int sources;
    double *keep; /* 12 * vertices: x, v, start, predicted as the frame started */
    double *rest; /* 3 * vertices: where the ball of rest has its middle */
    double base;  /* height of the body's base plane in the target's place */
    bool holding; /* a frame is being polished */
    morph_distance *surface;
    morph_status status;
};

/* ---- making it ---- */

static void add_place(morph_body_place *p, const int *joint, int corners, const double *weight,
                      double radius) {
    *p = (morph_body_place){.corners = corners, .radius = radius};
    for (int k = 0; k < corners; k++) {
        p->joint[k] = joint[k];
        p->weight[k] = weight[k];
    }
}

/* The fixed places that the blanket has for rigid targets: joints, three on a link, four on a triangle. What
 * lies between them the body's own vertices find. */
static int list_places(const morph_structure *s, morph_body_place *place) {
    static const double along[3][2] = {{0.75, 0.25}, {0.5, 0.5}, {0.25, 0.75}};
    static const double within[4][3] = {{4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0},
                                        {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0},
                                        {1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0},
                                        {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}};
    static const double whole = 1.0;
    int n = 0;
    for (int j = 0; j < s->joints; j++)
        add_place(&place[n++], &j, 1, &whole, s->def.radius);
    for (int l = 0; l < s->links; l++)
        for (int k = 0; k < 3; k++)
            add_place(&place[n++], s->link[l], 2, along[k], s->link_radius[l]);
    for (int t = 0; t < s->skin_triangles; t++)
        for (int k = 0; k < 4; k++)
            add_place(&place[n++], s->skin[t], 3, within[k], s->def.radius);
    return n;
}

static morph_status create_contacts(const morph_blanket_state *b, morph_blanket_soft *soft) {
    const morph_structure *s = b->structure;
    const size_t most = (size_t)s->joints + 3 * (size_t)s->links + 4 * (size_t)s->skin_triangles;
    double *inverse = morph_alloc((size_t)s->joints, sizeof *inverse);
    morph_body_place *place = morph_alloc(most, sizeof *place);
    morph_status status = inverse && place ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (int j = 0; j < s->joints; j++)
            inverse[j] = b->weight[j] / s->def.mass;
        const morph_body_sheet sheet = {.joints = s->joints,
                                        .places = list_places(s, place),
                                        .triangles = s->skin_triangles,
                                        .inverse = inverse,
                                        .place = place,
                                        .triangle = (const int(*)[3])s->skin,
                                        .radius = s->def.radius,
                                        .margin = CONTACT_MARGIN * s->spacing};
        soft->sources = sheet.places + soft->body->mesh.surface_vertices;
        status = morph_body_contacts_create(soft->body, &sheet, &soft->contacts);
    }
    free(inverse);
    free(place);
    return status;
}

/* Puts the body `lift` above its place. */
static void lift_body(morph_blanket_soft *soft, double lift) {
    morph_body *body = soft->body;
    soft->base = body->def.base;
    body->def.base += lift;
    for (int i = 0; i < body->vertices; i++) {
        body->x[3 * i + 2] += lift;
        body->start[3 * i + 2] = body->predicted[3 * i + 2] = body->x[3 * i + 2];
    }
}

morph_status morph_blanket_soft_create(morph_blanket_state *b) {
    morph_body *body = b->def.body;
    if (!body) return MORPH_OK;
    if (!(b->def.frame / morph_body_stable_step(body) <= MOST_SUBSTEPS)) return MORPH_ERR_INPUT;
    morph_blanket_soft *soft = b->soft = morph_alloc(1, sizeof *soft);
    if (!soft) return MORPH_ERR_NOMEM;
    soft->body = body;
    soft->keep = morph_alloc((size_t)body->vertices, 12 * sizeof *soft->keep);
    morph_status status = soft->keep ? create_contacts(b, soft) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK && !(soft->hold = morph_alloc((size_t)soft->sources, sizeof *soft->hold)))
        status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK && !(soft->push = morph_alloc((size_t)body->vertices, 3 * sizeof *soft->push)))
        status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK && !(soft->rest = morph_alloc((size_t)body->vertices, 3 * sizeof *soft->rest)))
        status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) lift_body(soft, morph_blanket_lift(&b->def, 0.0));
    return status;
}

void morph_blanket_soft_destroy(morph_blanket_soft *soft) {
    if (!soft) return;
    morph_body_contacts_destroy(soft->contacts);
    morph_distance_destroy(soft->surface);
    free(soft->hold);
    free(soft->push);
    free(soft->rest);
    free(soft->keep);
    free(soft);
}

morph_status morph_blanket_soft_status(const morph_blanket_state *b) {
    return b->soft->status;
}

/* ---- a step ---- */

static double whole_energy(const morph_body *body) {
    double kinetic, spring, height;
    morph_body_energies(body, &kinetic, &spring, &height);
    return kinetic + spring + height;
}

/* The contacts of the step before push on: a light vertex swings several times within a step, and would leap
 * off and be set back in every one if contact were only there at its end. What it gets the joints get the
 * other way. No more than `most`, kg m, as for other contacts (morph_blanket_project_start). */
void morph_blanket_soft_push(morph_blanket_state *b, double most) {
    morph_blanket_soft *soft = b->soft;
    const morph_structure *s = b->structure;
    const int n = morph_body_contacts_count(soft->contacts);
    const morph_body_touch *touch = morph_body_contacts_list(soft->contacts);
    const double h = b->step, force = 1.0 / (h * h), ratio = soft->step > 0.0 ? h / soft->step : 0.0;
    memset(soft->push, 0, 3 * (size_t)soft->body->vertices * sizeof *soft->push);
    for (int k = 0; k < n; k++) {
        const morph_body_touch *t = &touch[k];
        morph_hold *hold = &soft->hold[t->source];
        if (hold->push == 0.0) continue;
        const double carry = CARRIED * ratio * ratio, part = fmin(carry, most / hold->push);
        hold->push *= part;
        for (int i = 0; i < 3; i++) {
            hold->drag[i] *= part;
            const double change = hold->push * t->normal[i] + hold->drag[i];
            for (int j = 0; j < 3; j++) {
                b->v[3 * t->joint[j] + i] += t->weight[j] * b->weight[t->joint[j]] / s->def.mass * change / h;
                soft->push[3 * t->vertex[j] + i] -= t->body_weight[j] * force * change;
            }
        }
    }
    soft->step = h;
}

/* Pinned vertices and the plane below move with the lift; what the body's energy gains by that is work from
 * outside. */
bool morph_blanket_soft_step(morph_blanket_state *b) {
    morph_blanket_soft *soft = b->soft;
    morph_body *body = soft->body;
    const double rise = b->lift_to - b->lift;
    const bool moves = b->def.rise > 0.0;
    const double energy = moves ? whole_energy(body) : 0.0;
    for (int i = 0; i < body->vertices && moves; i++)
        if (body->inverse[i] == 0.0) body->v[3 * i + 2] = rise / b->step;
    if (moves) body->def.base = soft->base + b->lift_to;
    if (!morph_body_step(body, b->step, soft->push)) return false;
    /* Drag is not for what the lift carries. */
    for (int i = 0; i < body->vertices && moves; i++)
        if (body->inverse[i] == 0.0)
            body->x[3 * i + 2] = body->predicted[3 * i + 2] = body->start[3 * i + 2] + rise;
    if (moves) b->work += fmax(0.0, whole_energy(body) - energy);
    return true;
}

void morph_blanket_soft_moved(morph_blanket_state *b) {
    morph_body_moved(b->soft->body, b->step);
}

static double body_move(const morph_body *body) {
    double most = 0.0;
    for (int i = 0; i < body->vertices; i++) {
        double move[3];
        morph_sub(&body->x[3 * i], &body->start[3 * i], move);
        most = fmax(most, morph_dot(move, move));
    }
    return sqrt(most);
}

void morph_blanket_soft_find(morph_blanket_state *b, const double *x, double near) {
    morph_blanket_soft *soft = b->soft;
    if (soft->holding) return;
    const morph_status status =
        morph_body_contacts_find(soft->contacts, x, b->before, near + body_move(soft->body));
    /* What is not finite any more the step itself finds, and the frame is done again. */
    if (status == MORPH_ERR_NOMEM) soft->status = status;
}

/* What the contacts already pushed with they may take back. */
void morph_blanket_soft_start(morph_blanket_state *b) {
    morph_blanket_soft *soft = b->soft;
    if (soft->holding) return;
    const int n = morph_body_contacts_count(soft->contacts);
    morph_body_touch *touch = morph_body_contacts_list(soft->contacts);
    for (int k = 0; k < n; k++) {
        const morph_hold *hold = &soft->hold[touch[k].source];
        touch[k].push = hold->push;
        memcpy(touch[k].drag, hold->drag, sizeof hold->drag);
    }
}

/* Half way through the sweeps: tetrahedra that contact has crushed push back while contact can still answer.
 */
void morph_blanket_soft_renew(morph_blanket_state *b) {
    if (!b->soft->holding) morph_body_sweep(b->soft->body);
}

void morph_blanket_soft_sweep(morph_blanket_state *b, double *x, bool backward, double friction) {
    morph_blanket_soft *soft = b->soft;
    if (soft->holding) return;
    const int n = morph_body_contacts_count(soft->contacts);
    for (int k = 0; k < n; k++)
        morph_body_contact_project(soft->contacts, backward ? n - 1 - k : k, x, soft->body, friction);
}

void morph_blanket_soft_keep(morph_blanket_state *b) {
    morph_blanket_soft *soft = b->soft;
    const int n = morph_body_contacts_count(soft->contacts);
    const morph_body_touch *touch = morph_body_contacts_list(soft->contacts);
    memset(soft->hold, 0, (size_t)soft->sources * sizeof *soft->hold);
    for (int k = 0; k < n; k++) {
        morph_hold *hold = &soft->hold[touch[k].source];
        hold->push = touch[k].push;
        memcpy(hold->drag, touch[k].drag, sizeof hold->drag);
    }
}

void morph_blanket_soft_forget(morph_blanket_state *b) {
    memset(b->soft->hold, 0, (size_t)b->soft->sources * sizeof *b->soft->hold);
}

int morph_blanket_soft_contacts(const morph_blanket_state *b) {
    return morph_body_contacts_count(b->soft->contacts);
}

void morph_blanket_soft_force(const morph_blanket_state *b, double force[3]) {
    morph_body_contacts_force(b->soft->contacts, b->step, force);
}

/* ---- a frame ---- */

/* The exact distance to the surface as it is now. Pseudonormals decide the inside: tetrahedra never invert,
 * so the surface stays that of a solid. */
void morph_blanket_soft_hold(morph_blanket_state *b) {
    morph_blanket_soft *soft = b->soft;
    morph_mesh mesh;
    soft->holding = true;
    morph_distance_destroy(soft->surface);
    soft->surface = NULL;
    morph_status status = morph_tetra_surface(&soft->body->mesh, soft->body->x, &mesh);
    if (status == MORPH_OK) status = morph_distance_create(&mesh, true, &soft->surface);
    morph_mesh_free(&mesh);
    if (status != MORPH_OK) soft->status = status;
    b->exact = soft->surface;
    const size_t elements = (size_t)b->structure->links + (size_t)b->structure->skin_triangles;
    memset(b->memo, 0, elements * sizeof *b->memo); /* distances to another surface */
}

void morph_blanket_soft_release(morph_blanket_state *b) {
    b->soft->holding = false;
}

/* The four arrays that a step reads and writes. */
static void body_arrays(morph_body *body, double *array[4]) {
    array[0] = body->x;
    array[1] = body->v;
    array[2] = body->start;
    array[3] = body->predicted;
}

void morph_blanket_soft_keep_frame(morph_blanket_state *b) {
    const size_t width = 3 * (size_t)b->soft->body->vertices;
    double *array[4];
    body_arrays(b->soft->body, array);
    for (size_t k = 0; k < 4; k++)
        memcpy(b->soft->keep + k * width, array[k], width * sizeof(double));
}

void morph_blanket_soft_rewind_frame(morph_blanket_state *b) {
    const size_t width = 3 * (size_t)b->soft->body->vertices;
    double *array[4];
    body_arrays(b->soft->body, array);
    for (size_t k = 0; k < 4; k++)
        memcpy(array[k], b->soft->keep + k * width, width * sizeof(double));
    b->soft->body->def.base = b->soft->base + b->lift;
}

void morph_blanket_soft_stop(morph_blanket_state *b) {
    memset(b->soft->body->v, 0, 3 * (size_t)b->soft->body->vertices * sizeof(double));
}

static double farthest(const morph_body *body, const double *from) {
    double most = 0.0;
    for (int i = 0; i < body->vertices; i++)
        most = fmax(most, morph_dist(&body->x[3 * i], &from[3 * i]));
    return most;
}

double morph_blanket_soft_frame_move(const morph_blanket_state *b) {
    return farthest(b->soft->body, b->soft->keep);
}

void morph_blanket_soft_rest_here(morph_blanket_state *b) {
    memcpy(b->soft->rest, b->soft->body->x, 3 * (size_t)b->soft->body->vertices * sizeof(double));
}

double morph_blanket_soft_from_rest(const morph_blanket_state *b) {
    return farthest(b->soft->body, b->soft->rest);
}

/* ---- energy ---- */

void morph_blanket_soft_energies(const morph_blanket_state *b, double *kinetic, double *spring,
                                 double *height) {
    double k = 0.0, s = 0.0, h = 0.0;
    morph_body_energies(b->soft->body, kinetic ? &k : NULL, spring ? &s : NULL, height ? &h : NULL);
    if (kinetic) *kinetic += k;
    if (spring) *spring += s;
    if (height) *height += h;
}
