/* Contact of the blanket with itself: links and posts that share no joint keep their radii apart. Candidate
 * pairs come from spatial hashing over boxes grown by a margin, and stay good until a joint has moved half of
 * it; a sheet that cannot reach itself so costs one comparison a step. */
#include "model/blanket_internal.h"

#include "model/spatial_hash.h"

#include <stdlib.h>
#include <string.h>

/* How much the boxes are grown, spacings: far pairs cost next to nothing. */
#define MARGIN 0.3
/* Pairs closer than this beyond what a step moves them are listed: what sweeps may add, spacings. */
#define LISTED 0.05
/* Aimed at beyond the sum of the radii, spacings, as the other limits aim inside. */
#define AIM 1e-3

/* Two bars, at their closest places when the step began: sum share-weighted joints along `normal`. */
typedef struct self_contact {
    int joint[4];
    double weight[4]; /* signed: the first bar's places count up, the second's down */
    double normal[3];
    double least, inverse, push;
} self_contact;

struct morph_blanket_self {
    morph_hash *hash;
    int bars, pairs, contacts, room;
    int (*bar)[2];
    double *radius;
    morph_box *box;
    int (*pair)[2];
    double *pair_wake; /* sum of both bars' paths before which the pair cannot meet */
    self_contact *contact;
    double *found; /* joints where the pairs were found */
    bool known;
};

morph_status morph_blanket_self_create(const morph_structure *s, morph_blanket_self **out) {
    *out = NULL;
    morph_blanket_self *c = morph_alloc(1, sizeof *c);
    if (!c) return MORPH_ERR_NOMEM;
    c->bars = s->links + s->posts;
    c->bar = morph_alloc((size_t)c->bars, sizeof *c->bar);
    c->radius = morph_alloc((size_t)c->bars, sizeof *c->radius);
    c->box = morph_alloc((size_t)c->bars, sizeof *c->box);
    c->found = morph_alloc(3 * (size_t)s->joints, sizeof *c->found);
    if (!c->bar || !c->radius || !c->box || !c->found || morph_hash_create(&c->hash) != MORPH_OK) {
        morph_blanket_self_destroy(c);
        return MORPH_ERR_NOMEM;
    }
    for (int n = 0; n < c->bars; n++) {
        memcpy(c->bar[n], n < s->links ? s->link[n] : s->post[n - s->links], sizeof *c->bar);
        c->radius[n] = n < s->links ? s->link_radius[n] : s->def.radius;
    }
    *out = c;
    return MORPH_OK;
}

void morph_blanket_self_destroy(morph_blanket_self *c) {
    if (!c) return;
    morph_hash_destroy(c->hash);
    free(c->bar);
    free(c->radius);
    free(c->box);
    free(c->pair);
    free(c->pair_wake);
    free(c->contact);
    free(c->found);
    free(c);
}

void morph_blanket_self_forget(morph_blanket_self *c) {
    c->known = false;
    c->contacts = 0;
}

static bool apart(const int a[2], const int b[2]) {
    return a[0] != b[0] && a[0] != b[1] && a[1] != b[0] && a[1] != b[1];
}

static morph_status reserve(morph_blanket_self *c, int pairs) {
    if (pairs <= c->room) return MORPH_OK;
    free(c->pair);
    free(c->pair_wake);
    free(c->contact);
    c->pair = morph_alloc((size_t)pairs * 2, sizeof *c->pair);
    c->pair_wake = morph_alloc((size_t)pairs * 2, sizeof *c->pair_wake);
    c->contact = morph_alloc((size_t)pairs * 2, sizeof *c->contact);
    c->room = c->pair && c->pair_wake && c->contact ? 2 * pairs : 0;
    c->contacts = c->pairs = 0;
    return c->room > 0 ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* Pairs whose grown boxes meet; what is left out is at least twice the margin beyond touching. */
static morph_status find_pairs(morph_blanket_state *b, const double *x) {
    morph_blanket_self *c = b->self;
    const double margin = MARGIN * b->structure->spacing;
    const int(*found)[2];
    int count = 0;
    for (int n = 0; n < c->bars; n++)
        c->box[n] = morph_box_of(x, c->bar[n], 2, c->radius[n] + margin);
    morph_status status = morph_hash_self(c->hash, c->bars, c->box, &found, &count);
    if (status == MORPH_OK) status = reserve(c, count);
    if (status != MORPH_OK) return status;
    c->pairs = 0;
    for (int k = 0; k < count; k++)
        if (apart(c->bar[found[k][0]], c->bar[found[k][1]])) {
            c->pair_wake[c->pairs] = 0.0;
            memcpy(c->pair[c->pairs++], found[k], sizeof *c->pair);
        }
    memcpy(c->found, x, 3 * (size_t)b->joints * sizeof *x);
    c->known = true;
    return MORPH_OK;
}

/* The pair as a half space: with the bars' closest places and the direction between them at the step's start,
 * when they had not passed through each other, wherever they are now. Axes that met have no direction but
 * their common normal. */
static bool set_contact(const morph_blanket_state *b, const int pair[2], double near, double *apart_by,
                        self_contact *out) {
    const morph_blanket_self *c = b->self;
    const int *p = c->bar[pair[0]], *q = c->bar[pair[1]];
    const double *a0 = &b->before[3 * p[0]], *a1 = &b->before[3 * p[1]];
    const double *b0 = &b->before[3 * q[0]], *b1 = &b->before[3 * q[1]];
    double s, t, normal[3];
    const double least = c->radius[pair[0]] + c->radius[pair[1]] + AIM * b->structure->spacing;
    const double distance = morph_segment_segment(a0, a1, b0, b1, &s, &t);
    *apart_by = distance - least;
    if (distance > least + near) return false;
    if (distance > 1e-6 * least) {
        for (int k = 0; k < 3; k++)
            normal[k] = (a0[k] + s * (a1[k] - a0[k]) - b0[k] - t * (b1[k] - b0[k])) / distance;
    } else {
        double u[3], v[3];
        morph_sub(a1, a0, u);
        morph_sub(b1, b0, v);
        morph_cross(u, v, normal);
        const double size = morph_norm(normal);
        if (!(size > 0.0)) return false;
        for (int k = 0; k < 3; k++)
            normal[k] /= size;
    }
    const double weight[4] = {1.0 - s, s, t - 1.0, -t};
    double sum = 0.0;
    for (int k = 0; k < 4; k++) {
        out->joint[k] = k < 2 ? p[k] : q[k - 2];
        out->weight[k] = weight[k];
        sum += weight[k] * weight[k] * b->weight[out->joint[k]];
    }
    if (!(sum > 0.0)) return false;
    memcpy(out->normal, normal, sizeof normal);
    out->least = least;
    out->inverse = 1.0 / sum;
    out->push = 0.0;
    return true;
}

/* What was left out stood apart along one axis by more than twice the margin: it meets only where two joints
 * have moved otherwise by as much along an axis. */
static bool outdated(const morph_blanket_state *b) {
    const morph_blanket_self *c = b->self;
    if (!c->known) return true;
    double least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int j = 0; j < b->joints; j++)
        for (int k = 0; k < 3; k++) {
            const double d = b->before[3 * j + k] - c->found[3 * j + k];
            if (d - b->move[j] < least[k]) least[k] = d - b->move[j];
            if (d + b->move[j] > most[k]) most[k] = d + b->move[j];
        }
    for (int k = 0; k < 3; k++)
        if (!(most[k] - least[k] < (2.0 * MARGIN - LISTED) * b->structure->spacing)) return true;
    return false;
}

static int span_of(const morph_blanket_state *b, int bar) {
    const int skin = b->structure->skin_triangles;
    return b->joints + bar + (bar < b->links ? 0 : skin);
}

morph_status morph_blanket_find_self(morph_blanket_state *b) {
    morph_blanket_self *c = b->self;
    c->contacts = 0;
    if (outdated(b)) {
        const morph_status status = find_pairs(b, b->before);
        if (status != MORPH_OK) return status;
    }
    const double still = LISTED * b->structure->spacing;
    for (int k = 0; k < c->pairs; k++) {
        const int p = span_of(b, c->pair[k][0]), q = span_of(b, c->pair[k][1]);
        const double been = b->path[p] + b->path[q], near = b->move[p] + b->move[q] + still;
        double by = 0.0;
        if (been + near < c->pair_wake[k]) continue;
        if (set_contact(b, c->pair[k], near, &by, &c->contact[c->contacts])) c->contacts++;
        c->pair_wake[k] = been + by;
    }
    return MORPH_OK;
}

double morph_blanket_project_self(morph_blanket_state *b, double *x, bool backward) {
    morph_blanket_self *c = b->self;
    double most = 0.0;
    for (int n = 0; n < c->contacts; n++) {
        self_contact *t = &c->contact[backward ? c->contacts - 1 - n : n];
        double gap = -t->least;
        for (int k = 0; k < 4; k++)
            gap += t->weight[k] * morph_dot(t->normal, &x[3 * t->joint[k]]);
        const double old = t->push;
        t->push = fmax(0.0, old - gap * t->inverse);
        const double change = t->push - old;
        most = fmax(most, fabs(change));
        for (int k = 0; k < 4 && change != 0.0; k++)
            for (int m = 0; m < 3; m++)
                x[3 * t->joint[k] + m] += change * t->weight[k] * b->weight[t->joint[k]] * t->normal[m];
    }
    return most;
}

int morph_blanket_self_count(const morph_blanket_state *b) {
    return b->self->contacts;
}
