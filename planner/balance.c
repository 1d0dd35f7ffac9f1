#include "planner/balance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int morph_balance_tau(const morph_balance *b) {
    return b->coordinates;
}

int morph_balance_centre(const morph_balance *b) {
    return b->coordinates + b->equalities;
}

int morph_balance_strength(const morph_balance *b) {
    return morph_balance_centre(b) + 3 * b->centres;
}

int morph_balance_lambda(const morph_balance *b) {
    return morph_balance_strength(b) + b->centres;
}

int morph_balance_unknowns(const morph_balance *b) {
    return morph_balance_lambda(b) + b->limits.count;
}

morph_attractor morph_balance_scaled(const morph_balance *b, const morph_attractor *c) {
    const double a = b->world->structure->spacing;
    return (morph_attractor){{c->at[0] / a, c->at[1] / a, c->at[2] / a}, c->strength / (b->unit * a * a)};
}

morph_attractor morph_balance_physical(const morph_balance *b, const morph_attractor *c) {
    const double a = b->world->structure->spacing;
    return (morph_attractor){{c->at[0] * a, c->at[1] * a, c->at[2] * a}, c->strength * (b->unit * a * a)};
}

static morph_element angle_element(const morph_structure *s, morph_element_kind kind, int tuple) {
    morph_element e = {.kind = kind};
    morph_angle_joints(s, tuple, &e.joint[0], &e.joint[2]);
    return e;
}

static void fill_energies(morph_balance *b) {
    const morph_structure *s = b->world->structure;
    const double a = s->spacing;
    for (int l = 0; l < s->links; l++)
        b->energy[b->energies++] = (morph_element){.kind = MORPH_ELEMENT_SPRING,
                                                   .joint = {s->link[l][0], s->link[l][1]},
                                                   .stiffness = s->def.stiffness * a / b->unit,
                                                   .rest = s->start_length[l] / a};
    for (int t = 0; t < s->link_posts && s->def.square > 0.0; t++) {
        b->energy[b->energies] = angle_element(s, MORPH_ELEMENT_SQUARE, t);
        b->energy[b->energies++].stiffness = s->def.square / (b->unit * a);
    }
    for (int t = 0; t < s->link_posts + s->link_links && s->def.angle_stiffness > 0.0; t++) {
        const double *limit = morph_angle_limit(s, t);
        morph_element *e = &b->energy[b->energies++];
        *e = angle_element(s, MORPH_ELEMENT_SLACK, t);
        e->stiffness = s->def.angle_stiffness / (b->unit * a);
        e->lower = limit[0] + s->def.angle_soft;
        e->upper = limit[1] - s->def.angle_soft;
    }
}

static void fill_equalities(morph_balance *b) {
    const morph_structure *s = b->world->structure;
    const double a = s->spacing;
    for (int p = 0; p < s->posts; p++) {
        b->aim[b->equalities] = s->post_length[p] * s->post_length[p] / (a * a);
        b->equality[b->equalities++] =
            (morph_element){.kind = MORPH_ELEMENT_DISTANCE, .joint = {s->post[p][0], s->post[p][1]}};
    }
    for (int q = 0; q < s->panels; q++) {
        const int *one = s->post[s->panel[q][0]], *other = s->post[s->panel[q][1]];
        b->equality[b->equalities++] =
            (morph_element){.kind = MORPH_ELEMENT_PANEL, .joint = {one[0], one[1], other[0], other[1]}};
    }
}

double morph_balance_unit(const morph_structure_def *structure, double gravity) {
    return gravity > 0.0 ? structure->mass * gravity : structure->stiffness * structure->spacing;
}

morph_status morph_balance_create(const morph_world *world, const morph_balance_load *load, int centres,
                                  morph_balance **out) {
    *out = NULL;
    const morph_structure *s = world->structure;
    morph_balance *b = calloc(1, sizeof *b);
    if (!b) return MORPH_ERR_NOMEM;
    *b = (morph_balance){.world = world, .centres = centres, .coordinates = 3 * s->joints};
    b->weight = load->gravity > 0.0 ? 1.0 : 0.0;
    b->unit = morph_balance_unit(&s->def, load->gravity);
    b->softening = load->softening > 0.0 ? load->softening / s->spacing : 1.0;
    b->energy = morph_alloc((size_t)(s->links + 2 * s->link_posts + s->link_links), sizeof *b->energy);
    b->equality = morph_alloc((size_t)(s->posts + s->panels), sizeof *b->equality);
    b->aim = morph_alloc((size_t)(s->posts + s->panels), sizeof *b->aim);
    b->row = morph_alloc((size_t)b->coordinates, sizeof *b->row);
    b->anchor = morph_alloc((size_t)b->coordinates, sizeof *b->anchor);
    b->force = morph_alloc((size_t)b->coordinates, sizeof *b->force);
    b->along = morph_alloc((size_t)b->coordinates, sizeof *b->along);
    if (!b->energy || !b->equality || !b->aim || !b->row || !b->along || !b->anchor || !b->force) {
        morph_balance_destroy(b);
        return MORPH_ERR_NOMEM;
    }
    for (int i = 0; i < b->coordinates; i++)
        b->row[i] = s->joint_fixed[i / 3] ? -1 : b->rows++;
    fill_energies(b);
    fill_equalities(b);
    *out = b;
    return MORPH_OK;
}

void morph_balance_destroy(morph_balance *b) {
    if (!b) return;
    free(b->energy);
    free(b->equality);
    free(b->aim);
    morph_limits_free(&b->limits);
    free(b->row);
    free(b->along);
    free(b->anchor);
    free(b->force);
    free(b);
}

void morph_limits_free(morph_limits *l) {
    free(l->element);
    free(l->sign);
    free(l->edge);
    *l = (morph_limits){0};
}

static bool reserve(morph_limits *l, int count) {
    if (count <= l->capacity) return true;
    const int more = 2 * count > 256 ? 2 * count : 256;
    morph_element *element = realloc(l->element, (size_t)more * sizeof *element);
    if (element) l->element = element;
    double *sign = realloc(l->sign, (size_t)more * sizeof *sign);
    if (sign) l->sign = sign;
    double *edge = realloc(l->edge, (size_t)more * sizeof *edge);
    if (edge) l->edge = edge;
    if (!element || !sign || !edge) return false;
    l->capacity = more;
    return true;
}

morph_status morph_limits_copy(morph_limits *to, const morph_limits *from) {
    if (!reserve(to, from->count)) return MORPH_ERR_NOMEM;
    const size_t n = (size_t)from->count;
    to->count = from->count;
    if (n > 0) {
        memcpy(to->element, from->element, n * sizeof *to->element);
        memcpy(to->sign, from->sign, n * sizeof *to->sign);
        memcpy(to->edge, from->edge, n * sizeof *to->edge);
    }
    return MORPH_OK;
}

static bool add_limit(morph_balance *b, const morph_element *e, double sign, double edge) {
    morph_limits *l = &b->limits;
    if (!reserve(l, l->count + 1)) return false;
    l->element[l->count] = *e;
    l->sign[l->count] = sign;
    l->edge[l->count++] = edge;
    return true;
}

static bool add_members(morph_balance *b, const double *x, const morph_nearness *near) {
    const morph_structure *s = b->world->structure;
    const double a = s->spacing;
    bool ok = true;
    for (int l = 0; l < s->links && ok; l++) {
        const morph_element e = {.kind = MORPH_ELEMENT_DISTANCE, .joint = {s->link[l][0], s->link[l][1]}};
        const double length = morph_dist(&x[3 * e.joint[0]], &x[3 * e.joint[1]]);
        const double lo = s->length_limit[l][0] / a, hi = s->length_limit[l][1] / a;
        if (length - lo < near->length) ok = add_limit(b, &e, 1.0, lo * lo);
        if (ok && hi - length < near->length) ok = add_limit(b, &e, -1.0, hi * hi);
    }
    for (int t = 0; t < s->link_posts + s->link_links && ok; t++) {
        const double *limit = morph_angle_limit(s, t), angle = morph_angle_at(s, t, x);
        const morph_element e = angle_element(s, MORPH_ELEMENT_COSINE, t);
        if (angle - limit[0] < near->angle) ok = add_limit(b, &e, -1.0, cos(limit[0]));
        if (ok && limit[1] - angle < near->angle) ok = add_limit(b, &e, 1.0, cos(limit[1]));
    }
    for (int j = 0; j < s->joints && ok && !isnan(b->world->base); j++) {
        const morph_element e = {.kind = MORPH_ELEMENT_HEIGHT, .joint = {j}};
        const double least = (b->world->base + s->def.radius) / a;
        if (x[3 * j + 2] - least < near->clearance) ok = add_limit(b, &e, 1.0, least);
    }
    return ok;
}

/* The place sum_i weight_i x_i, if the smooth distance says that it is near; false only if memory is refused.
 * Its bias corrects the smooth distance to the exact one where it stands now. */
static bool add_place(morph_balance *b, const double *x, const int joint[3], const double weight[3],
                      double near) {
    const morph_structure *s = b->world->structure;
    const double a = s->spacing, r = s->def.radius / a;
    morph_element e = {.kind = MORPH_ELEMENT_CONTACT};
    memcpy(e.joint, joint, 3 * sizeof *joint);
    memcpy(e.weight, weight, 3 * sizeof *weight);
    morph_jet jet;
    morph_element_eval(&e, b->world->sdf, a, x, 0, NULL, &jet);
    if (jet.value - r >= near + 0.1) return true;
    double at[3] = {0.0, 0.0, 0.0};
    morph_closest closest;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            at[k] += a * weight[i] * x[3 * joint[i] + k];
    morph_distance_point(b->world->exact, at, &closest);
    e.bias = closest.distance / a - jet.value;
    return closest.distance / a - r >= near || add_limit(b, &e, 1.0, r);
}

/* Thirds of each edge and the middle of each triangle: places stand a third of a spacing apart. The second
 * grid's joints and links likewise. */
static bool add_contacts(morph_balance *b, const double *x, double near) {
    const morph_structure *s = b->world->structure;
    bool ok = true;
    for (int j = 0; j < s->joints && ok; j++)
        ok = add_place(b, x, (const int[3]){j, j, j}, (const double[3]){1.0, 0.0, 0.0}, near);
    for (int l = 0; l < s->links && ok; l++)
        for (int k = 1; k < 3 && ok; k++)
            ok = add_place(b, x, (const int[3]){s->link[l][0], s->link[l][1], s->link[l][1]},
                           (const double[3]){k / 3.0, 1.0 - k / 3.0, 0.0}, near);
    for (int t = 0; t < s->skin_triangles && ok; t++) {
        const int *c = s->skin[t];
        ok = add_place(b, x, c, (const double[3]){1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}, near);
        /* A cell's diagonal belongs to two triangles: the one with the lower number has its places. */
        for (int e = 0; e < 3 && ok; e++) {
            const int p = c[e], q = c[(e + 1) % 3];
            bool link = false, before = false;
            for (int l = 0; l < s->links && !link; l++)
                link =
                    (s->link[l][0] == p && s->link[l][1] == q) || (s->link[l][0] == q && s->link[l][1] == p);
            for (int u = t - 1; u >= 0 && u >= t - 1 && !link && !before; u--)
                before = (s->skin[u][0] == p || s->skin[u][1] == p || s->skin[u][2] == p) &&
                         (s->skin[u][0] == q || s->skin[u][1] == q || s->skin[u][2] == q);
            for (int k = 1; k < 3 && ok && !link && !before; k++)
                ok = add_place(b, x, (const int[3]){p, q, q}, (const double[3]){k / 3.0, 1.0 - k / 3.0, 0.0},
                               near);
        }
    }
    return ok;
}

static const int *axis_of(const morph_structure *s, int axis) {
    return axis < s->links ? s->link[axis] : s->post[axis - s->links];
}

/* Two axes that share no joint, kept apart by both radii where they are closest now. */
static bool add_pair(morph_balance *b, const double *x, const int p[2], const int q[2], double near) {
    const morph_structure *s = b->world->structure;
    const double apart = 2.0 * s->def.radius / s->spacing;
    double u, v;
    const double d = morph_segment_segment(&x[3 * p[0]], &x[3 * p[1]], &x[3 * q[0]], &x[3 * q[1]], &u, &v);
    if (d - apart >= near) return true;
    const morph_element e = {
        .kind = MORPH_ELEMENT_APART, .joint = {p[0], p[1], q[0], q[1]}, .weight = {1.0 - u, u, v - 1.0, -v}};
    return add_limit(b, &e, 1.0, apart * apart);
}

static bool add_pairs(morph_balance *b, const double *x, double near) {
    const morph_structure *s = b->world->structure;
    const double reach = 2.0 * s->def.radius / s->spacing + near;
    for (int i = 0; i < s->links + s->posts; i++) {
        const int *p = axis_of(s, i);
        for (int j = i + 1; j < s->links + s->posts; j++) {
            const int *q = axis_of(s, j);
            bool off = p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1];
            for (int k = 0; k < 3 && !off; k++)
                off =
                    fmin(x[3 * p[0] + k], x[3 * p[1] + k]) > fmax(x[3 * q[0] + k], x[3 * q[1] + k]) + reach ||
                    fmin(x[3 * q[0] + k], x[3 * q[1] + k]) > fmax(x[3 * p[0] + k], x[3 * p[1] + k]) + reach;
            if (!off && !add_pair(b, x, p, q, near)) return false;
        }
    }
    return true;
}

morph_status morph_balance_limits(morph_balance *b, const double *x, const morph_nearness *near) {
    b->limits.count = 0;
    if (!add_members(b, x, near) || !add_pairs(b, x, near->self)) return MORPH_ERR_NOMEM;
    return add_contacts(b, x, near->clearance) ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* The same element and side. */
static bool same(const morph_limits *l, int p, const morph_limits *m, int q) {
    return l->sign[p] == m->sign[q] && l->edge[p] == m->edge[q] && l->element[p].kind == m->element[q].kind &&
           memcmp(l->element[p].joint, m->element[q].joint, sizeof l->element[p].joint) == 0 &&
           memcmp(l->element[p].weight, m->element[q].weight, sizeof l->element[p].weight) == 0;
}

/* The pair of limit q of m has one among the first n of l already, and its axes are no nearer than `slid` to
 * touching (negative: overlapping). */
static bool slid_only(const morph_balance *b, int n, const morph_limits *m, int q, const double *x,
                      double slid) {
    const morph_element *e = &m->element[q];
    bool listed = false;
    for (int p = 0; p < n && !listed && e->kind == MORPH_ELEMENT_APART; p++)
        listed = b->limits.element[p].kind == e->kind &&
                 memcmp(b->limits.element[p].joint, e->joint, sizeof e->joint) == 0;
    if (!listed) return false;
    double u, v;
    const double d = morph_segment_segment(&x[3 * e->joint[0]], &x[3 * e->joint[1]], &x[3 * e->joint[2]],
                                           &x[3 * e->joint[3]], &u, &v);
    return d - sqrt(m->edge[q]) > slid;
}

morph_status morph_balance_more_limits(morph_balance *b, const double *x, const morph_nearness *near,
                                       double slid, int *added) {
    morph_limits old = b->limits;
    b->limits = (morph_limits){0};
    morph_status status = morph_balance_limits(b, x, near);
    morph_limits found = b->limits;
    b->limits = old;
    const int before = old.count;
    for (int q = 0; q < found.count && status == MORPH_OK; q++) {
        bool known = slid_only(b, before, &found, q, x, slid);
        for (int p = 0; p < before && !known; p++)
            known = same(&b->limits, p, &found, q);
        if (!known && !add_limit(b, &found.element[q], found.sign[q], found.edge[q]))
            status = MORPH_ERR_NOMEM;
    }
    morph_limits_free(&found);
    if (added) *added = b->limits.count - before;
    return status;
}

double morph_balance_limit_at(const morph_balance *b, int q, const double *x) {
    morph_jet jet;
    morph_element_eval(&b->limits.element[q], b->world->sdf, b->world->structure->spacing, x, 0, NULL, &jet);
    return b->limits.sign[q] * (jet.value - b->limits.edge[q]);
}

void morph_balance_limit_name(const morph_balance *b, int q, char *text, size_t size) {
    static const char *const kinds[] = {"spring", "length",  "angle", "square", "slack",
                                        "panel",  "contact", "self",  "height", "pull"};
    const morph_element *e = &b->limits.element[q];
    char joint[96];
    morph_joint_name(b->world->structure, e->joint[0], joint, sizeof joint);
    snprintf(text, size, "%s %s at %s", b->limits.sign[q] > 0.0 ? "lower" : "upper", kinds[e->kind], joint);
}
