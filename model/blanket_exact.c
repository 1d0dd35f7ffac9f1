/* The blanket by exact distances: over whole links and triangles, for the frames that are recorded. Over a
 * convex target most of them are known to be clear without a search: by a plane that has all of the target
 * behind it. */
#include "model/blanket_internal.h"

#include <stdlib.h>
#include <string.h>

/* Contacts aim this much outside, as those of the motion do (blanket_contact.c). */
#define CONTACT_MARGIN 1e-3 /* spacings */
/* Elements further away than this, spacings, are not looked at. */
#define NEAR 0.05
/* A seeking place moves to where the exact distance is deepest if that is deeper by this, spacings: places at
 * rest stay where they are. */
#define SEEK_GAIN 5e-3
/* An element's place whose distance exceeds a lower bound for the whole element by no more than this,
 * spacings, is its deepest: a thousandth of what counts as held. */
#define TIGHT 1e-6

/* Height over a plane, spacings, with which an element is taken to be clear of it whatever the rounding. */
#define LEAST_HEIGHT 1e-6
/* Neighbours of a vertex up to which the climb over a convex target is worth its while. */
enum { MOST_NEIGHBOURS = 64 };

/* Vertices of a convex target with their neighbours: next[start[i]] .. next[start[i + 1] - 1]. */
struct morph_blanket_hull {
    const morph_mesh *mesh; /* the target's */
    int *start, *next;
    int first; /* a vertex that has neighbours */
};

static bool is_next(const morph_blanket_hull *h, int from, int to) {
    for (int k = h->start[from]; k < h->start[from + 1]; k++)
        if (h->next[k] == to) return true;
    return false;
}

/* Every edge must be there both ways and no vertex have too many: a climb would stop at the border of patches
 * whose vertices were not welded. */
static bool usable(const morph_blanket_hull *h) {
    for (int i = 0; i < h->mesh->vertices; i++) {
        if (h->start[i + 1] - h->start[i] > MOST_NEIGHBOURS) return false;
        for (int k = h->start[i]; k < h->start[i + 1]; k++)
            if (!is_next(h, h->next[k], i)) return false;
    }
    return true;
}

void morph_blanket_hull_destroy(morph_blanket_hull *h) {
    if (!h) return;
    free(h->start);
    free(h->next);
    free(h);
}

morph_status morph_blanket_hull_create(const morph_mesh *mesh, morph_blanket_hull **out) {
    *out = NULL;
    morph_blanket_hull *h = morph_alloc(1, sizeof *h);
    if (!h) return MORPH_ERR_NOMEM;
    const size_t edges = 3 * (size_t)mesh->triangles;
    h->mesh = mesh;
    h->first = mesh->t[0];
    h->start = morph_alloc((size_t)mesh->vertices + 2, sizeof *h->start);
    h->next = morph_alloc(edges, sizeof *h->next);
    if (!h->start || !h->next) {
        morph_blanket_hull_destroy(h);
        return MORPH_ERR_NOMEM;
    }
    for (size_t k = 0; k < edges; k++)
        h->start[mesh->t[k] + 2]++;
    for (int i = 0; i < mesh->vertices; i++)
        h->start[i + 2] += h->start[i + 1];
    for (size_t k = 0; k < edges; k++)
        h->next[h->start[mesh->t[k] + 1]++] = mesh->t[k % 3 == 2 ? k - 2 : k + 1];
    if (usable(h))
        *out = h;
    else
        morph_blanket_hull_destroy(h);
    return MORPH_OK;
}

/* The vertex furthest along d. On a convex solid a vertex that is not the furthest has a neighbour that is
 * further. */
static int climb(const morph_blanket_hull *h, const double d[3], int from) {
    const double *v = h->mesh->v;
    double most = morph_dot(d, &v[3 * from]);
    for (int at = -1; at != from;) {
        at = from;
        for (int k = h->start[at]; k < h->start[at + 1]; k++) {
            const double height = morph_dot(d, &v[3 * h->next[k]]);
            if (!(height > most)) continue;
            most = height;
            from = h->next[k];
        }
    }
    return from;
}

/* Corners of an element as the target sees them. */
static void place_element(const morph_blanket_state *b, const double *x, const int *joint, int corners,
                          double v[3][3]) {
    for (int k = 0; k < corners; k++) {
        memcpy(v[k], &x[3 * joint[k]], sizeof v[k]);
        v[k][2] -= b->lift_to;
    }
}

/* Elements that may touch: skin triangles and the links that are no edges of them. */
typedef struct element {
    const int *joint;
    int corners;
    double radius;
    bool tested;
} element;

static element element_of(const morph_structure *s, int n) {
    if (n >= s->links) return (element){s->skin[n - s->links], 3, s->def.radius, true};
    return (element){s->link[n], 2, s->link_radius[n], s->link_kind[n] != MORPH_LINK_BOTTOM};
}

/* The element's path so far. Its corners v may be those of a frame that is polished: what they are off the
 * motion by counts as a way. */
static double been_at(const morph_blanket_state *b, const element *e, int n, const double v[3][3]) {
    double now[3][3], off = 0.0;
    place_element(b, b->x, e->joint, e->corners, now);
    for (int k = 0; k < e->corners; k++)
        off = fmax(off, morph_dist(v[k], now[k]));
    return b->path[b->joints + n] + b->lift_path - off;
}

bool morph_blanket_is_far(const morph_blanket_state *b, int n, double reach) {
    const morph_memo *memo = &b->memo[n];
    const double radius = n < b->links ? b->structure->link_radius[n] : b->structure->def.radius;
    const double come = b->path[b->joints + n] + b->lift_path - memo->been;
    return memo->known && memo->gap + radius - come > reach;
}

/* Exact distance of an element from where its deepest place was last time. Beyond NEAR nobody asks how far.
 */
static void measure(const morph_blanket_state *b, const element *e, const double v[3][3], morph_memo *memo) {
    const double enough = e->radius + 1.01 * NEAR * b->structure->spacing;
    double sum = 0.0, weight[3];
    morph_closest at;
    for (int k = 0; k < e->corners; k++)
        sum += memo->weight[k];
    for (int k = 0; k < 3; k++)
        weight[k] = k >= e->corners ? 0.0 : sum > 0.5 ? memo->weight[k] : 1.0 / e->corners;
    morph_distance_element(b->exact, v, e->corners, enough, weight, &at);
    memcpy(memo->weight, weight, sizeof weight);
    memcpy(memo->normal, at.normal, sizeof memo->normal);
    memcpy(memo->point, at.point, sizeof memo->point);
    memcpy(memo->corner, v, sizeof memo->corner);
    memo->gap = at.distance - e->radius;
    memo->bounded = at.triangle < 0;
    memo->planar = false;
    memo->known = memo->fresh = true;
}

/* Height of the lowest corner over the plane through the memo's closest point. */
static double height_over(const morph_memo *memo, const double v[3][3], int corners) {
    double least = INFINITY;
    for (int k = 0; k < corners; k++) {
        double d[3];
        morph_sub(v[k], memo->point, d);
        const double height = morph_dot(memo->normal, d);
        if (height < least) least = height;
    }
    return least;
}

/* The direction square to an element that is nearest to `along`, of length 1. False where it has none. */
static bool square_to(const double v[3][3], int corners, const double along[3], double d[3]) {
    double u[3], w[3];
    morph_sub(v[1], v[0], u);
    if (corners == 3) {
        morph_sub(v[2], v[0], w);
        morph_cross(u, w, d);
    } else {
        const double square = morph_dot(u, u), part = square > 0.0 ? morph_dot(along, u) / square : 0.0;
        for (int k = 0; k < 3; k++)
            d[k] = along[k] - part * u[k];
    }
    const double size = morph_norm(d);
    if (!(size > 0.0)) return false;
    const double scale = (morph_dot(d, along) < 0.0 ? -1.0 : 1.0) / size;
    for (int k = 0; k < 3; k++)
        d[k] *= scale;
    return true;
}

/* The target lies behind the plane through its vertex furthest along a direction: where that is square to an
 * element lying on it, the element's height over the plane is all of its distance. Notes the plane and that
 * height if it is at least `enough`. */
static bool clear_of_plane(const morph_blanket_state *b, const element *e, const double v[3][3],
                           double enough, morph_memo *memo) {
    morph_memo now = *memo;
    if (!b->hull || !square_to(v, e->corners, memo->normal, now.normal)) return false;
    const int from = memo->vertex > 0 ? memo->vertex - 1 : b->hull->first;
    memo->vertex = now.vertex = 1 + climb(b->hull, now.normal, from);
    memcpy(now.point, &b->hull->mesh->v[3 * (now.vertex - 1)], sizeof now.point);
    const double height = height_over(&now, v, e->corners);
    if (!(height >= enough)) return false;
    now.gap = height - e->radius;
    now.bounded = now.planar = true;
    now.fresh = false;
    *memo = now;
    memcpy(memo->corner, v, sizeof memo->corner);
    return true;
}

/* Whether the motion feels what is this far from an element: else its deepest place has to be found, so that
 * the seeking place can go there (morph_blanket_seek_deepest). */
static bool felt(const morph_blanket_state *b, const element *e, const double v[3][3],
                 const morph_memo *memo) {
    static const int corner[3] = {0, 1, 2};
    const double spacing = b->structure->spacing;
    double q[3];
    if (!b->sdf || memo->gap > NEAR * spacing) return true;
    morph_blanket_place(v[0], corner, e->corners, b->touch[memo->touch].weight, q);
    return memo->gap > morph_sdf_eval(b->sdf, q, NULL, NULL) - e->radius - SEEK_GAIN * spacing;
}

/* Over a convex target one point's distance may be enough: the target lies behind the plane through the point
 * closest to a place outside, so that no point of the element is nearer than its lowest corner's height over
 * that plane. Where that is the place's own distance the place is the deepest; where it is outside nobody
 * asks for more. False, with the memo as it was, where the element must be measured. */
static bool measure_convex(const morph_blanket_state *b, const element *e, const double v[3][3],
                           morph_memo *memo) {
    static const int corner[3] = {0, 1, 2};
    const double spacing = b->structure->spacing;
    morph_memo now = *memo;
    morph_closest at;
    double q[3];
    if (!b->convex || !memo->known) return false;
    const double enough = e->radius - 0.5 * MORPH_BLANKET_CLEARANCE_HELD * spacing;
    if (clear_of_plane(b, e, v, enough, &now)) {
        if (!felt(b, e, v, &now)) return false;
        *memo = now;
        return true;
    }
    morph_blanket_place(v[0], corner, e->corners, memo->weight, q);
    morph_distance_point(b->exact, q, &at);
    if (!(at.distance > TIGHT * spacing)) return false;
    memcpy(now.normal, at.normal, sizeof now.normal);
    memcpy(now.point, at.point, sizeof now.point);
    const double height = height_over(&now, v, e->corners);
    now.bounded = at.distance - height > TIGHT * spacing;
    if (now.bounded && height < enough) return false;
    now.gap = height - e->radius;
    now.planar = true;
    now.fresh = !now.bounded;
    if (now.bounded && !felt(b, e, v, &now)) return false;
    *memo = now;
    memcpy(memo->corner, v, sizeof memo->corner);
    return true;
}

static double moved_since(const morph_memo *memo, const double v[3][3], int corners) {
    double moved = 0.0;
    for (int k = 0; k < corners; k++)
        moved = fmax(moved, morph_dist(v[k], memo->corner[k]));
    return moved;
}

/* What moved has come nearer by no more than it moved. A convex target lies wholly behind the plane through
 * the closest point: an element that slides along it stays clear however far. */
double morph_blanket_gap_bound(const morph_blanket_state *b, int n, const double v[3][3]) {
    const morph_memo *memo = &b->memo[n];
    const element e = element_of(b->structure, n);
    if (!memo->known) return -INFINITY;
    const double bound = memo->gap - moved_since(memo, v, e.corners);
    if (!b->convex || (memo->bounded && !memo->planar) || !(memo->gap + e.radius > 0.0)) return bound;
    return fmax(bound, height_over(memo, v, e.corners) - e.radius);
}

void morph_blanket_renew_planes(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    if (!b->hull) return;
    const double move = morph_blanket_moved(b, b->x) + fabs(b->lift_to - b->lift);
    for (int n = 0; n < s->links + s->skin_triangles; n++) {
        if (morph_blanket_is_far(b, n, move)) continue;
        const element e = element_of(s, n);
        double v[3][3] = {{0.0}};
        if (!e.tested || !b->memo[n].known) continue;
        place_element(b, b->x, e.joint, e.corners, v);
        if (morph_blanket_gap_bound(b, n, (const double(*)[3])v) > -e.radius) continue;
        if (clear_of_plane(b, &e, (const double(*)[3])v, LEAST_HEIGHT * s->spacing, &b->memo[n]))
            b->memo[n].been = b->path[b->joints + n] + b->lift_path; /* this step's way counts once more */
    }
}

double morph_blanket_depth_exact(morph_blanket_state *b, const double *x) {
    const morph_structure *s = b->structure;
    const double allowed = 0.5 * MORPH_BLANKET_CLEARANCE_HELD * s->spacing;
    double depth = morph_blanket_base_depth(b, x), off = 0.0;
    for (int j = 0; j < b->joints; j++)
        off = fmax(off, morph_dist(&x[3 * j], &b->x[3 * j]));
    for (int n = 0; n < s->links + s->skin_triangles; n++) {
        const double radius = n < s->links ? s->link_radius[n] : s->def.radius;
        if (morph_blanket_is_far(b, n, radius + off)) continue;
        const element e = element_of(s, n);
        if (!e.tested) continue;
        morph_memo *memo = &b->memo[n];
        double v[3][3] = {{0.0}};
        place_element(b, x, e.joint, e.corners, v);
        const double bound = morph_blanket_gap_bound(b, n, (const double(*)[3])v);
        depth = fmax(depth, bound >= -allowed ? -bound : 0.0);
        if (bound >= -allowed) continue;
        if (!measure_convex(b, &e, (const double(*)[3])v, memo)) measure(b, &e, (const double(*)[3])v, memo);
        memo->been = been_at(b, &e, n, (const double(*)[3])v);
        depth = fmax(depth, -memo->gap);
    }
    return depth;
}

void morph_blanket_seek_deepest(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    for (int n = 0; n < s->links + s->skin_triangles; n++) {
        morph_memo *memo = &b->memo[n];
        if (!memo->fresh) continue;
        memo->fresh = false;
        if (memo->bounded || memo->gap > NEAR * s->spacing) continue;
        morph_touch *t = &b->touch[memo->touch];
        double q[3];
        morph_blanket_place(b->x, t->joint, t->corners, t->weight, q);
        const double here = morph_blanket_distance_at(b, q, NULL) - t->radius;
        if (memo->gap >= -MORPH_BLANKET_CLEARANCE_HELD * s->spacing &&
            memo->gap > here - SEEK_GAIN * s->spacing)
            continue;
        memcpy(t->weight, memo->weight, sizeof t->weight);
        t->stride = MORPH_BLANKET_SHORTEST_STRIDE;
        b->touch_wake[memo->touch] = b->span_wake[t->span] = 0.0;
    }
}

/* One contact at the deepest place of an element, as it was found when the element was last measured: what
 * has moved since far enough to matter has just been measured again. */
static void find_deepest(morph_blanket_state *b, const double *x, int n) {
    const element e = element_of(b->structure, n);
    const morph_memo *memo = &b->memo[n];
    double v[3][3];
    if (!e.tested || !memo->known || (memo->bounded && !memo->planar)) return;
    place_element(b, x, e.joint, e.corners, v);
    if (memo->gap - moved_since(memo, (const double(*)[3])v, e.corners) > NEAR * b->structure->spacing)
        return;
    morph_contact *c = morph_blanket_add_contact(b, e.joint, e.corners, memo->weight, 0);
    memcpy(c->normal, memo->normal, sizeof c->normal);
    c->level = morph_dot(c->normal, memo->point) + c->normal[2] * b->lift_to + e.radius +
               CONTACT_MARGIN * b->structure->spacing;
    c->radius = -1.0; /* the plane stays */
    b->contacts++;
}

void morph_blanket_find_exact(morph_blanket_state *b, const double *x) {
    b->contacts = 0;
    for (int n = 0; n < b->structure->links + b->structure->skin_triangles; n++)
        find_deepest(b, x, n);
    if (!isnan(b->def.base)) morph_blanket_find_base(b, x, 0.0);
}
