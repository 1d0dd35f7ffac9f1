/* Contact of the blanket with the target and the base plane. */
#include "model/blanket_internal.h"

#include <string.h>

/* Contacts aim this much outside, as the other limits do (blanket_project.c). */
#define CONTACT_MARGIN 1e-3 /* spacings */
/* Joints that no step brings closer to the base plane than this, spacings, are not looked at. */
#define NEAR 0.05
/* The smooth distance has a slope near 1, less where edges are rounded; a flatter gradient than this is no
 * direction to trust with a full correction. */
#define LEAST_SLOPE 0.3
/* Slope that the smooth distance does not exceed: 1 but for the spline's overshoot beside edges. */
#define MOST_SLOPE 2.0
/* Search for the deepest place: strides in barycentric weight. */
#define LONGEST_STRIDE 0.25

/* Following a place along its step: from which motion on and how near counts as there, in radii; strides grow
 * at least by SWEPT_CLOSE radii / MOST_SLOPE, and the last one counts as there. */
#define SWEPT_FROM 0.5
#define SWEPT_CLOSE 0.05
#define SWEPT_STRIDES 64

/* A place's distance is taken anew when it has moved further than this, spacings. */
#define KEEP_PLANE 4e-3
/* Nor than by this part of its radius: targets as thin as that turn their distance within it. */
#define KEEP_RADIUS 0.1

static morph_touch *add_touch(morph_blanket_state *b, int span, const int *joint, int corners,
                              const double *weight, double radius) {
    morph_touch *t = &b->touch[b->touches++];
    memset(t, 0, sizeof *t);
    t->span = span;
    b->first_touch[span + 1] = b->touches;
    t->corners = corners;
    t->radius = radius;
    for (int k = 0; k < corners; k++) {
        t->joint[k] = joint[k];
        t->weight[k] = weight[k];
    }
    return t;
}

/* Links: three fixed places. Skin triangles: four fixed places and one that seeks the deepest; as the links
 * of the skin's layer are edges of its triangles, only the other links have a seeking place of their own. */
morph_status morph_blanket_touches_create(morph_blanket_state *b) {
    static const double along[3][2] = {{0.75, 0.25}, {0.5, 0.5}, {0.25, 0.75}};
    static const double within[4][3] = {{4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0},
                                        {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0},
                                        {1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0},
                                        {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}};
    const morph_structure *s = b->structure;
    const double whole = 1.0;
    const size_t most = (size_t)s->joints + 4 * (size_t)s->links + 5 * (size_t)s->skin_triangles;
    b->touch = morph_alloc(most, sizeof *b->touch);
    b->contact = morph_alloc(most + (size_t)s->joints, sizeof *b->contact);
    b->hold = morph_alloc(most + (size_t)s->joints, sizeof *b->hold);
    b->spare_touch = morph_alloc(most, sizeof *b->spare_touch);
    b->memo = morph_alloc((size_t)(s->links + s->skin_triangles), sizeof *b->memo);
    b->touch_wake = morph_alloc(most, sizeof *b->touch_wake);
    b->hot_contact = morph_alloc(most + (size_t)s->joints, sizeof *b->hot_contact);
    b->held = morph_alloc(most + (size_t)s->joints, sizeof *b->held);
    const size_t spans = (size_t)(s->joints + s->links + s->skin_triangles);
    b->spare_wake = morph_alloc(most + spans, sizeof *b->spare_wake);
    b->span_wake = morph_alloc(spans, sizeof *b->span_wake);
    b->first_touch = morph_alloc(spans + 1, sizeof *b->first_touch);
    if (!b->span_wake || !b->first_touch || !b->touch_wake || !b->hot_contact || !b->held || !b->spare_wake)
        return MORPH_ERR_NOMEM;
    if (!b->touch || !b->contact || !b->hold || !b->spare_touch || !b->memo) return MORPH_ERR_NOMEM;
    if (!b->sdf) return MORPH_OK;
    for (int j = 0; j < s->joints; j++)
        add_touch(b, j, &j, 1, &whole, s->def.radius);
    for (int l = 0; l < s->links; l++) {
        for (int k = 0; k < 3; k++)
            add_touch(b, b->joints + l, s->link[l], 2, along[k], s->link_radius[l]);
        if (s->link_kind[l] == MORPH_LINK_BOTTOM) continue;
        b->memo[l].touch = b->touches;
        add_touch(b, b->joints + l, s->link[l], 2, along[1], s->link_radius[l])->stride = LONGEST_STRIDE;
    }
    for (int t = 0; t < s->skin_triangles; t++) {
        for (int k = 0; k < 4; k++)
            add_touch(b, b->joints + b->links + t, s->skin[t], 3, within[k], s->def.radius);
        b->memo[s->links + t].touch = b->touches;
        add_touch(b, b->joints + b->links + t, s->skin[t], 3, within[3], s->def.radius)->stride =
            LONGEST_STRIDE;
    }
    return MORPH_OK;
}

/* A place as the target sees it: the target's lift taken off. */
double morph_blanket_distance_at(const morph_blanket_state *b, const double q[3], double *g) {
    const double p[3] = {q[0], q[1], q[2] - b->lift_to};
    return morph_sdf_eval(b->sdf, p, g, NULL);
}

/* The same by the plane through the last value of this place while it has hardly moved: with a radius of
 * curvature of a spacing the plane is then off by KEEP_PLANE^2 / 2 spacings. */
static bool has_moved(const morph_blanket_state *b, const morph_touch *t, const double q[3]) {
    const double d[3] = {q[0] - t->at[0], q[1] - t->at[1], q[2] - b->lift_to - t->at[2]};
    const double keep = fmin(KEEP_PLANE * b->structure->spacing, KEEP_RADIUS * t->radius);
    return !t->known || morph_dot(d, d) > keep * keep;
}

static double distance_of(const morph_blanket_state *b, morph_touch *t, const double q[3], double *g) {
    const double p[3] = {q[0], q[1], q[2] - b->lift_to};
    double d[3];
    morph_sub(p, t->at, d);
    if (has_moved(b, t, q)) {
        memcpy(t->at, p, sizeof t->at);
        t->phi = morph_sdf_eval(b->sdf, p, t->gradient, NULL);
        t->known = true;
        d[0] = d[1] = d[2] = 0.0;
    }
    if (g) memcpy(g, t->gradient, sizeof t->gradient);
    return t->phi + morph_dot(t->gradient, d);
}

/* One round of a compass search in the weights: the place moves a stride towards the corner that brings it
 * deepest, or the stride shrinks. Kept from step to step, it follows the deepest place of the element. */
static double seek(const morph_blanket_state *b, morph_touch *t, const double *x, const double at[3],
                   double value) {
    double best[3], lowest = value;
    for (int j = 0; j < t->corners; j++) {
        double weight[3], q[3];
        morph_sub(&x[3 * t->joint[j]], at, q);
        if (morph_dot(t->gradient, q) > 0.0) continue; /* the distance grows that way */
        for (int k = 0; k < t->corners; k++)
            weight[k] = (1.0 - t->stride) * t->weight[k] + (k == j ? t->stride : 0.0);
        morph_blanket_place(x, t->joint, t->corners, weight, q);
        const double here = morph_blanket_distance_at(b, q, NULL);
        if (here < lowest) {
            lowest = here;
            memcpy(best, weight, sizeof best);
        }
    }
    if (lowest < value) {
        memcpy(t->weight, best, sizeof best);
        t->stride = fmin(1.5 * t->stride, LONGEST_STRIDE);
    } else
        t->stride = fmax(0.5 * t->stride, MORPH_BLANKET_SHORTEST_STRIDE);
    return lowest;
}

/* Half space of the smooth distance about the contact's place: phi + g.(q - q0) >= radius, divided by |g|. */
static bool set_plane(const morph_blanket_state *b, morph_contact *c, const double *x, double radius) {
    double q[3], g[3];
    morph_blanket_place(x, c->joint, c->corners, c->weight, q);
    const double phi = distance_of(b, &b->touch[c->source], q, g);
    const double slope = morph_norm(g);
    if (!(slope > 1e-6)) return false; /* a ridge inside the target: neighbours will lead out */
    for (int k = 0; k < 3; k++)
        c->normal[k] = g[k] / slope;
    const double aim = radius + CONTACT_MARGIN * b->structure->spacing;
    c->level = morph_dot(c->normal, q) - (phi - aim) / fmax(slope, LEAST_SLOPE);
    /* What was inside before this step comes out at the speed of a fall of half a spacing at most: the depth
     * of a place found anew, over a short step, would be a blow. What is faster must be stopped at once. */
    const double depth = c->level - morph_dot(c->normal, c->before);
    const double fall = b->pull > 0.0 ? sqrt(b->pull * b->structure->spacing) * b->step : INFINITY;
    const double most = b->moved > 5.0 * fall ? INFINITY : fall;
    if (depth > most) c->level -= depth - most;
    c->spare = morph_dot(c->normal, q) - c->level;
    c->radius = radius;
    return true;
}

morph_contact *morph_blanket_add_contact(morph_blanket_state *b, const int *joint, int corners,
                                         const double *weight, int source) {
    morph_contact *c = &b->contact[b->contacts];
    memset(c, 0, sizeof *c);
    c->corners = corners;
    c->source = source;
    double sum = 0.0;
    for (int k = 0; k < corners; k++) {
        c->joint[k] = joint[k];
        c->weight[k] = weight[k];
        c->share[k] = weight[k] * b->weight[joint[k]];
        sum += weight[k] * c->share[k];
    }
    c->inverse = sum > 0.0 ? 1.0 / sum : 0.0; /* all held: nothing to correct */
    morph_blanket_place(b->before, c->joint, c->corners, c->weight, c->before);
    if (source < b->touches) c->before[2] += b->lift_to - b->lift; /* friction holds to the target */
    return c;
}

/* A place that moves far in a step is followed along its way, in strides that the distance's slope makes
 * safe: where it first comes near the target, the half space stands there, on the side it came from. What
 * moves less than its radius cannot pass the middle of even the thinnest target. `end`: the gap where it
 * ends; nothing is nearer in between where the distance could not fall and rise again on what is left of the
 * way. */
static bool swept(const morph_blanket_state *b, morph_contact *c, const double *x, double radius,
                  double end) {
    double q0[3], q1[3], way[3], g[3], t = 0.0;
    memcpy(q0, c->before, sizeof q0);
    morph_blanket_place(x, c->joint, c->corners, c->weight, q1);
    morph_sub(q1, q0, way);
    const double length = morph_norm(way), close = SWEPT_CLOSE * radius;
    if (!(length > SWEPT_FROM * radius)) return false;
    for (int k = 0; k < SWEPT_STRIDES; k++) {
        const double q[3] = {q0[0] + t * way[0], q0[1] + t * way[1], q0[2] + t * way[2]};
        const double gap = morph_blanket_distance_at(b, q, NULL) - radius;
        if (gap <= close || k + 1 == SWEPT_STRIDES) {
            morph_blanket_distance_at(b, q, g);
            const double slope = morph_norm(g);
            if (!(slope > 1e-6) || morph_dot(g, way) >= 0.0) return false; /* leaves: the end decides */
            for (int m = 0; m < 3; m++)
                c->normal[m] = g[m] / slope;
            c->level = morph_dot(c->normal, q) - fmax(gap, 0.0) / fmax(slope, LEAST_SLOPE) +
                       CONTACT_MARGIN * b->structure->spacing;
            c->radius = -1.0; /* the plane stays */
            return true;
        }
        if (gap + end > MOST_SLOPE * (1.0 - t) * length + 2.0 * close) return false;
        t += gap / (MOST_SLOPE * length);
        if (t >= 1.0) return false;
    }
    return false;
}

/* How far the place is from contact, at least: by its last distance and what it has moved since, `by`;
 * negative where that cannot tell. */
static double spare_since(const morph_blanket_state *b, const morph_touch *t, const double q[3], double *by) {
    const double p[3] = {q[0], q[1], q[2] - b->lift_to};
    *by = t->known ? morph_dist(p, t->at) : INFINITY;
    return (t->phi - t->radius) / MOST_SLOPE - *by;
}

bool morph_blanket_sleeps(const morph_blanket_state *b, int touch) {
    return b->path[b->touch[touch].span] + b->lift_path < b->touch_wake[touch];
}

/* What a place must keep from contact, by its span's move in this step, so as not to be looked at: it could
 * come back by the move, and is listed from this far. */
static double reach_of(const morph_blanket_state *b, int span) {
    return 2.0 * (b->move[span] + fabs(b->lift_to - b->lift)) + b->added;
}

/* A seeking place looks around when its span has moved by an eighth of its distance: what comes nearer to
 * its element than to it has come no further than to a quarter of that, by the distance's slope. */
static void find_target(morph_blanket_state *b, morph_touch *t, const double *x, double been, double reach) {
    const double listed = b->added, lift = fabs(b->lift_to - b->lift);
    double q[3], from[3], *wake = &b->touch_wake[t - b->touch];
    morph_blanket_place(x, t->joint, t->corners, t->weight, q);
    if (t->stride == 0.0) {
        double by;
        const double spare = spare_since(b, t, q, &by);
        if (spare > reach) {
            *wake = been + spare - b->move[t->span] - lift;
            return;
        }
        /* Not while a new distance would let it sleep. No place moves further than its span. */
        if (spare > (listed + b->move[t->span] + lift) / MOST_SLOPE && spare + by < reach) return;
    }
    morph_blanket_place(b->before, t->joint, t->corners, t->weight, from);
    const double own = listed + morph_dist(q, from) + lift;
    const bool moved = has_moved(b, t, q);
    double gap = distance_of(b, t, q, NULL) - t->radius;
    if (t->stride == 0.0 && gap / MOST_SLOPE > reach) {
        *wake = been + gap / MOST_SLOPE - b->move[t->span] - lift;
        return;
    }
    /* What rests has found its deepest place; exact distances look after it from frame to frame. */
    if (t->stride > MORPH_BLANKET_SHORTEST_STRIDE || (t->stride > 0.0 && moved))
        gap = seek(b, t, x, q, gap + t->radius) - t->radius;
    if (gap > own) {
        if (t->stride > 0.0) *wake = been + (gap - listed) / 8.0;
        return;
    }
    morph_contact *c = morph_blanket_add_contact(b, t->joint, t->corners, t->weight, (int)(t - b->touch));
    if (swept(b, c, x, t->radius, gap) || set_plane(b, c, x, t->radius)) b->contacts++;
}

/* The places of a span that may touch in this step. */
static void find_span(morph_blanket_state *b, int span, const double *x) {
    const double been = b->path[span] + b->lift_path, reach = reach_of(b, span);
    double first = INFINITY;
    for (int t = b->first_touch[span]; t < b->first_touch[span + 1]; t++) {
        if (!(been + reach < b->touch_wake[t])) find_target(b, &b->touch[t], x, been, reach);
        first = fmin(first, b->touch_wake[t]);
    }
    b->span_wake[span] = first;
}

/* Links and skin lie above the plane wherever their joints do. */
void morph_blanket_find_base(morph_blanket_state *b, const double *x, double move) {
    static const double whole = 1.0;
    const double radius = b->structure->def.radius, near = NEAR * b->structure->spacing + move;
    for (int j = 0; j < b->joints; j++) {
        if (x[3 * j + 2] > b->def.base + radius + near) continue;
        morph_contact *c = morph_blanket_add_contact(b, &j, 1, &whole, b->touches + j);
        c->normal[2] = 1.0;
        c->level = b->def.base + radius + CONTACT_MARGIN * b->structure->spacing;
        c->radius = -1.0;
        b->contacts++;
    }
}

void morph_blanket_forget(morph_blanket_state *b) {
    for (int t = 0; t < b->angles; t++)
        b->turn[t].push[0] = b->turn[t].push[1] = 0.0;
    memset(b->touch_wake, 0, (size_t)b->touches * sizeof *b->touch_wake);
    memset(b->span_wake, 0,
           (size_t)(b->joints + b->links + b->structure->skin_triangles) * sizeof *b->span_wake);
    memset(b->angle_wake, 0, (size_t)b->angles * sizeof *b->angle_wake);
    memset(b->link_wake, 0, (size_t)b->links * sizeof *b->link_wake);
    memset(b->push, 0, (size_t)b->links * sizeof *b->push);
    memset(b->hold, 0, (size_t)(b->touches + b->joints) * sizeof *b->hold);
    b->holds = 0;
    for (int n = 0; n < b->links + b->structure->skin_triangles; n++)
        b->memo[n].been = -INFINITY;
    morph_blanket_self_forget(b->self);
    if (b->soft) morph_blanket_soft_forget(b);
}

double morph_blanket_moved(const morph_blanket_state *b, const double *x) {
    double fastest = 0.0;
    for (int j = 0; j < b->joints; j++) {
        double move[3];
        morph_sub(&x[3 * j], &b->before[3 * j], move);
        fastest = fmax(fastest, morph_dot(move, move));
    }
    return sqrt(fastest);
}

void morph_blanket_find_contacts(morph_blanket_state *b, const double *x) {
    b->moved = morph_blanket_note_moves(b, x);
    const double move = b->moved + fabs(b->lift_to - b->lift);
    b->contacts = 0;
    const int spans = b->touches > 0 ? b->joints + b->links + b->structure->skin_triangles : 0;
    for (int n = 0; n < spans; n++)
        if (!(b->path[n] + b->lift_path + reach_of(b, n) < b->span_wake[n])) find_span(b, n, x);
    if (!isnan(b->def.base)) morph_blanket_find_base(b, x, move);
    if (b->soft) morph_blanket_soft_find(b, x, NEAR * b->structure->spacing + move);
}

void morph_blanket_renew_contacts(morph_blanket_state *b, const double *x) {
    if (b->soft) morph_blanket_soft_renew(b);
    for (int k = 0; k < b->contacts; k++) {
        morph_contact *c = &b->contact[k];
        if (!(c->radius >= 0.0 && c->push > 0.0)) continue;
        set_plane(b, c, x, c->radius);
        c->spare = 0.0; /* x is not where the limits were listed */
    }
}

static double move_corners(const morph_contact *c, double *x, const double change[3]) {
    for (int j = 0; j < c->corners; j++)
        for (int k = 0; k < 3; k++)
            x[3 * c->joint[j] + k] += c->share[j] * change[k];
    return morph_norm(change);
}

/* Sets the friction to `want` without its normal part, cut to the cone; returns the change in `change`. */
static void set_drag(morph_contact *c, const double want[3], double friction, double change[3]) {
    const double along = morph_dot(want, c->normal), most = friction * c->push;
    double drag[3];
    for (int k = 0; k < 3; k++)
        drag[k] = want[k] - along * c->normal[k];
    const double size = morph_norm(drag), keep = size > most ? most / size : 1.0;
    for (int k = 0; k < 3; k++) {
        change[k] += keep * drag[k] - c->drag[k];
        c->drag[k] = keep * drag[k];
    }
}

/* The place's centre q moves by weight_j times what joint j moves; joints move by weight_j times push, so q
 * by push / inverse. Normal: unilateral. Friction: undo the tangential motion since the step's start, by at
 * most friction times the normal push (Coulomb; sticking inside the cone, sliding on it). */
double morph_blanket_project_contact(morph_contact *c, double *x, double friction, double *gap_out) {
    double q[3], change[3], want[3];
    morph_blanket_place(x, c->joint, c->corners, c->weight, q);
    const double gap = morph_dot(c->normal, q) - c->level;
    const double old = c->push;
    if (gap_out) *gap_out = gap;
    const double push = old - gap * c->inverse;
    c->push = push > 0.0 ? push : 0.0;
    if (c->push == 0.0 && old == 0.0) return 0.0;
    for (int k = 0; k < 3; k++) {
        change[k] = (c->push - old) * c->normal[k];
        want[k] = c->drag[k] - (q[k] - c->before[k]) * c->inverse;
    }
    if (friction > 0.0) set_drag(c, want, friction, change);
    return move_corners(c, x, change);
}

void morph_blanket_start_contacts(morph_blanket_state *b, double *x, double warm, double most) {
    for (int n = 0; n < b->contacts && warm > 0.0; n++) {
        morph_contact *c = &b->contact[n];
        const morph_hold *hold = &b->hold[c->source];
        if (hold->push == 0.0) continue;
        double change[3], want[3];
        c->push = fmin(warm * hold->push, most);
        for (int k = 0; k < 3; k++) {
            change[k] = c->push * c->normal[k];
            want[k] = warm * hold->drag[k];
        }
        set_drag(c, want, b->def.friction, change);
        move_corners(c, x, change);
    }
    if (b->soft && warm > 0.0) morph_blanket_soft_start(b);
}

void morph_blanket_keep_contacts(morph_blanket_state *b) {
    for (int k = 0; k < b->holds; k++)
        b->hold[b->held[k]] = (morph_hold){0};
    b->holds = 0;
    for (int n = 0; n < b->contacts; n++) {
        const morph_contact *c = &b->contact[n];
        if (c->push == 0.0) continue;
        b->held[b->holds++] = c->source;
        b->hold[c->source].push = c->push;
        memcpy(b->hold[c->source].drag, c->drag, sizeof c->drag);
    }
    if (b->soft) morph_blanket_soft_keep(b);
}

double morph_blanket_base_depth(const morph_blanket_state *b, const double *x) {
    double depth = 0.0;
    for (int j = 0; j < b->joints && !isnan(b->def.base); j++)
        depth = fmax(depth, b->def.base + b->structure->def.radius - x[3 * j + 2]);
    return depth;
}

double morph_blanket_depth(const morph_blanket_state *b, const double *x) {
    double depth = morph_blanket_base_depth(b, x);
    for (int k = 0; k < b->touches; k++) {
        const morph_touch *t = &b->touch[k];
        if (morph_blanket_sleeps(b, k)) continue;
        double q[3];
        morph_blanket_place(x, t->joint, t->corners, t->weight, q);
        depth = fmax(depth, t->radius - morph_blanket_distance_at(b, q, NULL));
    }
    return depth;
}
