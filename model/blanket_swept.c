/* A swept guard over the blanket's contact. Contact follows single places of links and skin along their way
 * through a smooth distance field; what is thinner than the distance between places or than the field's
 * cells, a needle or an edge, or a deformable target that is fast itself, may pass between them. So after a
 * step that was long enough for that, axes of links and the skin's middle are swept against the target's
 * triangles (vertex against triangle and edge against edge), and a step in which they pass through a triangle
 * is refused: the frame is done again with shorter steps, and the elements that were crossed are watched:
 * they keep off the target by exact distances.
 *
 * An axis keeps its radius from the target where contact holds, so that it cannot reach the surface in a step
 * in which neither joints nor target move further than the least radius: no such step is looked at, and in
 * ordinary scenes that is nearly every one. Only where the field stands further than that off some part of
 * the target, so that contact does not feel it, or where impacts are very fast, shorter steps count too. */
#include "model/blanket_internal.h"
#include "model/swept.h"

#include <string.h>

/* Times that the steps of one frame are refused, each time halved. What is crossed even so ends the run:
 * where the motion cannot be resolved, no one can say on which side of the target the sheet would come out.
 */
#define MOST_REFUSED 6
/* Triangles near one element, at most; meshes so fine have their places closer together than that. */
enum { MOST_NEAR = 256 };
/* Part of the least radius that a step may move where contact cannot be relied on: the field does not feel
 * all of the target, or the motion is so fast (blanket.c, FAST) that impacts push what is in contact through.
 */
#define SHORT_MOVE 0.1
#define FAST 0.175 /* spacings in the step that forces ask for */
/* Elements are watched while they are nearer than this, spacings: what is further cannot reach the target in
 * a step (blanket.c, MOST_MOVE). */
#define WATCH 0.5
/* Contacts aim this much outside, as others do (blanket_contact.c). */
#define CONTACT_MARGIN 1e-3 /* spacings */

/* A link's axis (2 corners) or skin triangle (3) in the target's frame, at the step's start and end. */
typedef struct element {
    int number; /* in memo: links, then skin triangles */
    int corners;
    double at[2][3][3];
} element;

typedef struct moving_triangle {
    double at[2][3][3];
} moving_triangle;

static double least_radius(const morph_structure *s) {
    double least = s->def.radius;
    for (int l = 0; l < s->links; l++)
        least = fmin(least, s->link_radius[l]);
    return least;
}

static double body_move(const morph_body *body) {
    double most = 0.0;
    for (int k = 0; k < body->mesh.surface_vertices; k++) {
        const int i = 3 * body->mesh.surface[k];
        double d[3];
        morph_sub(&body->x[i], &body->start[i], d);
        most = fmax(most, morph_dot(d, d));
    }
    return sqrt(most);
}

/* Where the field is beyond a radius at a point of the target's surface, an axis may touch it there and no
 * place feels it. */
static bool is_blind(const morph_blanket_state *b) {
    const morph_mesh *mesh = morph_distance_mesh(b->exact);
    const double least = least_radius(b->structure);
    for (int i = 0; i < mesh->vertices; i++)
        if (morph_sdf_eval(b->sdf, &mesh->v[3 * (size_t)i], NULL, NULL) > least) return true;
    return false;
}

/* Could an axis have come through in this step? */
static bool far_enough(morph_blanket_state *b) {
    if (!b->guard.known && !b->soft) b->guard.blind = is_blind(b);
    b->guard.known = true;
    double move = morph_blanket_moved(b, b->x);
    move += b->soft ? body_move(b->def.body) : fabs(b->lift_to - b->lift);
    const bool fast = move * b->good_step > FAST * b->structure->spacing * b->step;
    return move > (b->guard.blind || fast ? SHORT_MOVE : 1.0) * least_radius(b->structure);
}

/* False where the element needs no test: the links of the skin's layer are edges of its triangles. */
static bool set_element(const morph_blanket_state *b, int n, element *e) {
    const morph_structure *s = b->structure;
    const bool link = n < s->links;
    if (link && s->link_kind[n] == MORPH_LINK_BOTTOM) return false;
    const int *joint = link ? s->link[n] : s->skin[n - s->links];
    e->number = n;
    e->corners = link ? 2 : 3;
    for (int k = 0; k < e->corners; k++) {
        memcpy(e->at[0][k], &b->before[3 * joint[k]], sizeof e->at[0][k]);
        memcpy(e->at[1][k], &b->x[3 * joint[k]], sizeof e->at[1][k]);
        if (b->soft) continue;
        e->at[0][k][2] -= b->lift;
        e->at[1][k][2] -= b->lift_to;
    }
    return true;
}

static void box_of(const element *e, double lo[3], double hi[3]) {
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
        for (int i = 0; i < 2 * e->corners; i++) {
            lo[k] = fmin(lo[k], e->at[i & 1][i / 2][k]);
            hi[k] = fmax(hi[k], e->at[i & 1][i / 2][k]);
        }
    }
}

static void edge_of(const double corner[3][3], int from, int to, double edge[2][3]) {
    memcpy(edge[0], corner[from], sizeof edge[0]);
    memcpy(edge[1], corner[to], sizeof edge[1]);
}

/* Time of the first contact in units of the step, at the latest; INFINITY: none. Times of pairs without
 * contact are infinite too. */
static double first_contact(const element *e, const moving_triangle *t) {
    const double(*e0)[3] = (const double(*)[3])e->at[0], (*e1)[3] = (const double(*)[3])e->at[1];
    const double(*t0)[3] = (const double(*)[3])t->at[0], (*t1)[3] = (const double(*)[3])t->at[1];
    double time = INFINITY, toi;
    for (int i = 0; i < e->corners; i++) {
        morph_swept_vertex_triangle(e0[i], t0, e1[i], t1, NULL, &toi);
        time = fmin(time, toi);
    }
    for (int k = 0; k < 3 && e->corners == 3; k++) {
        morph_swept_vertex_triangle(t0[k], e0, t1[k], e1, NULL, &toi);
        time = fmin(time, toi);
    }
    for (int i = 0; i < (e->corners == 3 ? 3 : 1); i++)
        for (int k = 0; k < 3; k++) {
            double a0[2][3], a1[2][3], b0[2][3], b1[2][3];
            edge_of(e0, i, (i + 1) % e->corners, a0);
            edge_of(e1, i, (i + 1) % e->corners, a1);
            edge_of(t0, k, (k + 1) % 3, b0);
            edge_of(t1, k, (k + 1) % 3, b1);
            morph_swept_edge_edge((const double(*)[3])a0, (const double(*)[3])b0, (const double(*)[3])a1,
                                  (const double(*)[3])b1, NULL, &toi);
            time = fmin(time, toi);
        }
    return time;
}

static void exact_of(const morph_blanket_state *b, const double v[3][3], int corners, double weight[3],
                     morph_closest *at) {
    if (corners == 2)
        morph_distance_segment(b->exact, v[0], v[1], weight, at);
    else
        morph_distance_triangle(b->exact, v[0], v[1], v[2], weight, at);
}

static void watch(morph_blanket_state *b, int number) {
    morph_guard *g = &b->guard;
    for (int k = 0; k < g->watched; k++)
        if (g->watch[k] == number) return;
    if (g->watched < MORPH_BLANKET_WATCHED) g->watch[g->watched++] = number;
}

/* The half space of an element's nearest place at the step's start: as long as the nearest stays the nearest,
 * which short steps see to, the element does not cross. */
static void add_contact(morph_blanket_state *b, const element *e, const double weight[3],
                        const morph_closest *at, double radius) {
    const int *joint =
        e->number < b->links ? b->structure->link[e->number] : b->structure->skin[e->number - b->links];
    morph_contact *c = &b->contact[b->contacts++];
    memset(c, 0, sizeof *c);
    c->corners = e->corners;
    c->source = b->memo[e->number].touch;
    double sum = 0.0;
    for (int i = 0; i < e->corners; i++) {
        c->joint[i] = joint[i];
        c->weight[i] = weight[i];
        c->share[i] = weight[i] * b->weight[joint[i]];
        sum += weight[i] * c->share[i];
        for (int k = 0; k < 3; k++)
            c->before[k] += weight[i] * (e->at[0][i][k] + (k == 2 ? b->lift_to : 0.0));
    }
    c->inverse = sum > 0.0 ? 1.0 / sum : 0.0;
    memcpy(c->normal, at->normal, sizeof c->normal);
    c->level =
        morph_dot(c->normal, c->before) - at->distance + radius + CONTACT_MARGIN * b->structure->spacing;
    c->radius = -1.0; /* the plane stays */
}

void morph_blanket_guard_contacts(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    morph_guard *g = &b->guard;
    int kept = 0;
    for (int k = 0; k < g->watched; k++) {
        element e;
        double weight[3] = {0.0};
        morph_closest at;
        if (!set_element(b, g->watch[k], &e)) continue;
        exact_of(b, (const double(*)[3])e.at[0], e.corners, weight, &at);
        const double radius = e.number < b->links ? s->link_radius[e.number] : s->def.radius;
        if (at.distance > radius + WATCH * s->spacing) continue;
        g->watch[kept++] = e.number;
        if (b->contacts < b->touches + b->joints) add_contact(b, &e, weight, &at, radius);
    }
    g->watched = kept;
}

/* No point of the element moves further than its corners, and the distance changes by no more than that: what
 * was further from the target at the step's start, as its last exact distance tells, cannot have reached it;
 * nor can what was on the outer side of a convex one's plane before and after. Failing that, the same by the
 * distance of its middle now. */
static bool out_of_reach(const morph_blanket_state *b, const element *e) {
    const morph_structure *s = b->structure;
    const double radius = e->number < b->links ? s->link_radius[e->number] : s->def.radius;
    double move = 0.0, wide = 0.0, middle[3] = {0.0};
    for (int i = 0; i < e->corners; i++) {
        move = fmax(move, morph_dist(e->at[1][i], e->at[0][i]));
        for (int k = 0; k < 3; k++)
            middle[k] += e->at[0][i][k] / e->corners;
    }
    const double start = radius + morph_blanket_gap_bound(b, e->number, (const double(*)[3])e->at[0]);
    if (start > move) return true;
    if (b->convex && start > 0.0 &&
        radius + morph_blanket_gap_bound(b, e->number, (const double(*)[3])e->at[1]) > 0.0)
        return true;
    for (int i = 0; i < e->corners; i++)
        wide = fmax(wide, morph_dist(e->at[0][i], middle));
    morph_closest at;
    morph_distance_point_bounded(b->exact, middle, wide + move, &at);
    return fabs(at.distance) >= wide + move;
}

/* What touches or is inside before the step is not for this guard: it may come out. */
static bool crosses_rigid(morph_blanket_state *b, const element *e) {
    int near[MOST_NEAR];
    double lo[3], hi[3], first = INFINITY, weight[3];
    if (out_of_reach(b, e)) return false;
    box_of(e, lo, hi);
    int found = morph_distance_box(b->exact, lo, hi, near, MOST_NEAR);
    if (found > MOST_NEAR) found = MOST_NEAR;
    const morph_mesh *mesh = morph_distance_mesh(b->exact);
    for (int n = 0; n < found; n++) {
        moving_triangle t;
        for (int c = 0; c < 3; c++)
            for (int end = 0; end < 2; end++)
                memcpy(t.at[end][c], &mesh->v[3 * mesh->t[3 * near[n] + c]], sizeof t.at[end][c]);
        first = fmin(first, first_contact(e, &t));
    }
    if (first == INFINITY) return false;
    morph_closest at;
    exact_of(b, (const double(*)[3])e->at[0], e->corners, weight, &at);
    if (at.distance <= 0.0) return false;
    watch(b, e->number);
    return true;
}

static bool boxes_apart(const moving_triangle *t, const double lo[3], const double hi[3]) {
    for (int k = 0; k < 3; k++) {
        double least = INFINITY, most = -INFINITY;
        for (int c = 0; c < 6; c++) {
            least = fmin(least, t->at[c & 1][c / 2][k]);
            most = fmax(most, t->at[c & 1][c / 2][k]);
        }
        if (least > hi[k] || most < lo[k]) return true;
    }
    return false;
}

/* The first contact with the body's surface, both moving straight over the step; or, `still`, at its start
 * alone. */
static double soft_contact(const morph_body *body, const element *e, bool still) {
    double lo[3], hi[3], first = INFINITY;
    box_of(e, lo, hi);
    for (int n = 0; n < body->mesh.triangles; n++) {
        moving_triangle t;
        for (int c = 0; c < 3; c++) {
            const int i = 3 * body->mesh.triangle[n][c];
            memcpy(t.at[0][c], &body->start[i], sizeof t.at[0][c]);
            memcpy(t.at[1][c], still ? &body->start[i] : &body->x[i], sizeof t.at[1][c]);
        }
        if (!boxes_apart(&t, lo, hi)) first = fmin(first, first_contact(e, &t));
    }
    return first;
}

/* An element that touches the surface before the step is left out. */
static bool crosses_soft(const morph_blanket_state *b, const element *e) {
    if (soft_contact(b->def.body, e, false) == INFINITY) return false;
    element rest = *e;
    memcpy(rest.at[1], rest.at[0], sizeof rest.at[1]);
    return soft_contact(b->def.body, &rest, true) == INFINITY;
}

bool morph_blanket_guard(morph_blanket_state *b) {
    if (b->def.unguarded) return true;
    if (!b->soft && (!b->sdf || !b->exact)) return true;
    if (!far_enough(b)) return true;
    const morph_structure *s = b->structure;
    int crossed = 0;
    b->guard.steps++;
    const double move = morph_blanket_moved(b, b->x) + fabs(b->lift_to - b->lift);
    /* All of them: each is watched from now on. */
    for (int n = 0; n < s->links + s->skin_triangles; n++) {
        element e;
        if (!b->soft && morph_blanket_is_far(b, n, move)) continue;
        if (!set_element(b, n, &e)) continue;
        if (b->soft ? crosses_soft(b, &e) : crosses_rigid(b, &e)) crossed = n + 1;
    }
    if (crossed == 0) return true;
    b->guard.crossings++;
    if (++b->guard.refused > MOST_REFUSED || !isfinite(b->most_move)) {
        b->guard.through = crossed;
        b->status = MORPH_ERR_MOTION;
    }
    return false;
}
