/* Contact of the blanket with itself: links and posts that share no joint keep their radii apart. Candidate
 * pairs are those whose boxes, grown by a margin, meet; they stay good until a joint has moved half of it
 * otherwise than another. They are found by a tree of boxes over the flat sheet, whose shape stays while the
 * boxes follow the sheet: neighbours stay neighbours. A pair is not looked at before its bars have moved by
 * what they were apart, and then a plane between them is tried before their distance is taken. */
#include "model/blanket_internal.h"

#include "model/spatial_hash.h" /* boxes */

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

/* Pairs of a bar and a later one: those of bar p are first[p] .. first[p + 1] - 1, ascending by partner. */
typedef struct pair_list {
    int *first, *partner;
    double *wake;        /* sum of both bars' paths before which the pair cannot meet */
    double (*normal)[3]; /* from the partner to the bar, when last measured; 0: never */
    int pairs, room;
} pair_list;

/* Bars are numbered so that those of every node of the tree follow each other. */
struct morph_blanket_self {
    int bars, contacts, room;
    int (*bar)[2], *span; /* joints; the span of the blanket's paths */
    double *radius;
    morph_box *box;
    int leaves;      /* a power of 2; the children of node k are 2 k and 2 k + 1, its leaves the last ones */
    morph_box *node; /* 2 leaves, the first unused */
    pair_list list, last;
    double *come, *path; /* bars: path at the step's end with half of what is listed; at its start */
    self_contact *contact;
    double *found; /* joints where the pairs were found */
    bool known;
};

/* Bars of a leaf. */
enum { LEAF = 4 };

/* ---- making it ---- */

typedef struct middle {
    double at[3], key;
    int number;
} middle;

static int by_key(const void *a, const void *b) {
    const middle *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return (x->number > y->number) - (x->number < y->number);
}

/* Orders n bars for a node of so many leaves: halved along the axis where their middles spread most. The left
 * half fills its leaves. */
static void order(middle *m, int n, int leaves) {
    double most = -1.0;
    int axis = 0;
    if (leaves == 1 || n == 0) return;
    for (int k = 0; k < 3; k++) {
        double lo = m[0].at[k], hi = lo;
        for (int i = 1; i < n; i++) {
            lo = fmin(lo, m[i].at[k]);
            hi = fmax(hi, m[i].at[k]);
        }
        if (!(hi - lo > most)) continue;
        most = hi - lo;
        axis = k;
    }
    for (int i = 0; i < n; i++)
        m[i].key = m[i].at[axis];
    qsort(m, (size_t)n, sizeof *m, by_key);
    const int left = LEAF * (leaves / 2) < n ? LEAF * (leaves / 2) : n;
    order(m, left, leaves / 2);
    order(m + left, n - left, leaves / 2);
}

/* Links, then posts, in the tree's order. */
static morph_status list_bars(const morph_structure *s, morph_blanket_self *c) {
    middle *m = morph_alloc((size_t)c->bars, sizeof *m);
    if (!m) return MORPH_ERR_NOMEM;
    for (int n = 0; n < c->bars; n++) {
        const int *joint = n < s->links ? s->link[n] : s->post[n - s->links];
        m[n].number = n;
        for (int k = 0; k < 3 && s->start; k++)
            m[n].at[k] = 0.5 * (s->start[3 * joint[0] + k] + s->start[3 * joint[1] + k]);
    }
    order(m, c->bars, c->leaves);
    for (int n = 0; n < c->bars; n++) {
        const int number = m[n].number;
        const bool link = number < s->links;
        memcpy(c->bar[n], link ? s->link[number] : s->post[number - s->links], sizeof *c->bar);
        c->radius[n] = link ? s->link_radius[number] : s->def.radius;
        c->span[n] = s->joints + number + (link ? 0 : s->skin_triangles);
    }
    free(m);
    return MORPH_OK;
}

morph_status morph_blanket_self_create(const morph_structure *s, morph_blanket_self **out) {
    *out = NULL;
    morph_blanket_self *c = morph_alloc(1, sizeof *c);
    if (!c) return MORPH_ERR_NOMEM;
    const size_t bars = (size_t)s->links + (size_t)s->posts;
    c->bars = (int)bars;
    for (c->leaves = 1; LEAF * c->leaves < c->bars;)
        c->leaves *= 2;
    c->bar = morph_alloc(bars, sizeof *c->bar);
    c->span = morph_alloc(bars, sizeof *c->span);
    c->radius = morph_alloc(bars, sizeof *c->radius);
    c->box = morph_alloc(bars, sizeof *c->box);
    c->node = morph_alloc(2 * (size_t)c->leaves, sizeof *c->node);
    c->come = morph_alloc(bars, sizeof *c->come);
    c->path = morph_alloc(bars, sizeof *c->path);
    c->list.first = morph_alloc(bars + 1, sizeof *c->list.first);
    c->last.first = morph_alloc(bars + 1, sizeof *c->last.first);
    c->found = morph_alloc(3 * (size_t)s->joints, sizeof *c->found);
    const bool good = c->bar && c->span && c->radius && c->box && c->node && c->come && c->path &&
                      c->list.first && c->last.first && c->found;
    const morph_status status = good ? list_bars(s, c) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK)
        *out = c;
    else
        morph_blanket_self_destroy(c);
    return status;
}

static void list_free(pair_list *l) {
    free(l->partner);
    free(l->wake);
    free(l->normal);
    l->partner = NULL;
    l->wake = NULL;
    l->normal = NULL;
    l->room = l->pairs = 0;
}

void morph_blanket_self_destroy(morph_blanket_self *c) {
    if (!c) return;
    list_free(&c->list);
    list_free(&c->last);
    free(c->list.first);
    free(c->last.first);
    free(c->bar);
    free(c->span);
    free(c->radius);
    free(c->box);
    free(c->node);
    free(c->come);
    free(c->path);
    free(c->contact);
    free(c->found);
    free(c);
}

void morph_blanket_self_forget(morph_blanket_self *c) {
    c->known = false;
    c->contacts = c->list.pairs = 0;
    memset(c->list.first, 0, ((size_t)c->bars + 1) * sizeof *c->list.first);
}

/* ---- finding pairs ---- */

static bool apart(const int a[2], const int b[2]) {
    return a[0] != b[0] && a[0] != b[1] && a[1] != b[0] && a[1] != b[1];
}

static void join(morph_box *box, const morph_box *other) {
    for (int k = 0; k < 3; k++) {
        if (other->lo[k] < box->lo[k]) box->lo[k] = other->lo[k];
        if (other->hi[k] > box->hi[k]) box->hi[k] = other->hi[k];
    }
}

static void set_boxes(morph_blanket_self *c, const double *x, double margin) {
    static const morph_box empty = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (int n = 0; n < c->bars; n++)
        c->box[n] = morph_box_of(x, c->bar[n], 2, c->radius[n] + margin);
    for (int k = 2 * c->leaves - 1; k > 0; k--) {
        c->node[k] = empty;
        if (k < c->leaves) {
            join(&c->node[k], &c->node[2 * k]);
            join(&c->node[k], &c->node[2 * k + 1]);
            continue;
        }
        const int from = LEAF * (k - c->leaves), to = from + LEAF < c->bars ? from + LEAF : c->bars;
        for (int n = from; n < to; n++)
            join(&c->node[k], &c->box[n]);
    }
}

/* Room for so many pairs more; what is there stays. */
static morph_status reserve(pair_list *l, int more) {
    if (l->pairs + more <= l->room) return MORPH_OK;
    const int room = 2 * (l->pairs + more) + 64;
    pair_list wide = {.partner = morph_alloc((size_t)room, sizeof *wide.partner),
                      .wake = morph_alloc((size_t)room, sizeof *wide.wake),
                      .normal = morph_alloc((size_t)room, sizeof *wide.normal)};
    if (!wide.partner || !wide.wake || !wide.normal) {
        list_free(&wide);
        return MORPH_ERR_NOMEM;
    }
    const size_t pairs = (size_t)l->pairs;
    if (pairs > 0) memcpy(wide.partner, l->partner, pairs * sizeof *wide.partner);
    wide.first = l->first;
    wide.pairs = l->pairs;
    wide.room = room;
    free(l->partner);
    free(l->wake);
    free(l->normal);
    *l = wide;
    return MORPH_OK;
}

/* Adds the partners of bar p among the node's bars, which are those of so many leaves from the first. */
static morph_status add_partners(morph_blanket_self *c, int p, int node, int first, int leaves) {
    if (LEAF * (first + leaves) <= p + 1 || !morph_box_overlap(&c->box[p], &c->node[node])) return MORPH_OK;
    if (leaves > 1) {
        const int half = leaves / 2;
        const morph_status status = add_partners(c, p, 2 * node, first, half);
        return status == MORPH_OK ? add_partners(c, p, 2 * node + 1, first + half, half) : status;
    }
    pair_list *l = &c->list;
    if (reserve(l, LEAF) != MORPH_OK) return MORPH_ERR_NOMEM;
    const int from = LEAF * first > p ? LEAF * first : p + 1;
    const int to = LEAF * (first + 1) < c->bars ? LEAF * (first + 1) : c->bars;
    for (int q = from; q < to; q++)
        if (morph_box_overlap(&c->box[p], &c->box[q]) && apart(c->bar[p], c->bar[q]))
            l->partner[l->pairs++] = q;
    return MORPH_OK;
}

/* What was known of the pairs that were listed before; both lists ascend. */
static void take_over(morph_blanket_self *c) {
    pair_list *now = &c->list;
    const pair_list *old = &c->last;
    for (int p = 0; p < c->bars; p++) {
        int at = old->first[p];
        for (int k = now->first[p]; k < now->first[p + 1]; k++) {
            while (at < old->first[p + 1] && old->partner[at] < now->partner[k])
                at++;
            const bool same = at < old->first[p + 1] && old->partner[at] == now->partner[k];
            now->wake[k] = same ? old->wake[at] : 0.0;
            for (int m = 0; m < 3; m++)
                now->normal[k][m] = same ? old->normal[at][m] : 0.0;
        }
    }
}

/* Pairs whose grown boxes meet; what is left out is at least twice the margin beyond touching. */
static morph_status find_pairs(morph_blanket_state *b, const double *x) {
    morph_blanket_self *c = b->self;
    const pair_list swap = c->last;
    set_boxes(c, x, MARGIN * b->structure->spacing);
    c->last = c->list;
    c->list = swap;
    c->list.pairs = 0;
    c->known = false;
    for (int p = 0; p < c->bars; p++) {
        c->list.first[p] = c->list.pairs;
        if (add_partners(c, p, 1, 0, c->leaves) != MORPH_OK) {
            morph_blanket_self_forget(c);
            return MORPH_ERR_NOMEM;
        }
    }
    c->list.first[c->bars] = c->list.pairs;
    take_over(c);
    if (c->list.pairs > c->room) {
        free(c->contact);
        c->room = 0;
        c->contact = morph_alloc((size_t)c->list.room, sizeof *c->contact);
        if (!c->contact) return MORPH_ERR_NOMEM;
        c->room = c->list.room;
    }
    memcpy(c->found, x, 3 * (size_t)b->joints * sizeof *x);
    c->known = true;
    return MORPH_OK;
}

/* ---- contacts of a step ---- */

/* The pair as a half space: with the bars' closest places and the direction between them at the step's start,
 * when they had not passed through each other, wherever they are now. Axes that met have no direction but
 * their common normal. */
static bool set_contact(const morph_blanket_state *b, int bar, int partner, double near, double *apart_by,
                        self_contact *out) {
    const morph_blanket_self *c = b->self;
    const int *p = c->bar[bar], *q = c->bar[partner];
    const double *a0 = &b->before[3 * p[0]], *a1 = &b->before[3 * p[1]];
    const double *b0 = &b->before[3 * q[0]], *b1 = &b->before[3 * q[1]];
    double s, t, normal[3];
    const double least = c->radius[bar] + c->radius[partner] + AIM * b->structure->spacing;
    const double distance = morph_segment_segment(a0, a1, b0, b1, &s, &t);
    *apart_by = distance - least;
    for (int k = 0; k < 3 && distance > 1e-6 * least; k++)
        out->normal[k] = normal[k] = (a0[k] + s * (a1[k] - a0[k]) - b0[k] - t * (b1[k] - b0[k])) / distance;
    if (distance > least + near) return false;
    if (!(distance > 1e-6 * least)) {
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

/* How far a pair is apart beyond its radii, at least: by the slab between two planes square to its last
 * normal. */
static double slab(const morph_blanket_state *b, int bar, int partner, const double normal[3]) {
    const morph_blanket_self *c = b->self;
    const int *p = c->bar[bar], *q = c->bar[partner];
    const double p0 = morph_dot(normal, &b->before[3 * p[0]]), p1 = morph_dot(normal, &b->before[3 * p[1]]);
    const double q0 = morph_dot(normal, &b->before[3 * q[0]]), q1 = morph_dot(normal, &b->before[3 * q[1]]);
    const double low = p0 < p1 ? p0 : p1, high = q0 > q1 ? q0 : q1;
    return low - high - (c->radius[bar] + c->radius[partner] + AIM * b->structure->spacing);
}

/* Pair k, of bar p, is to be looked at. */
static void look(morph_blanket_state *b, int p, int k) {
    morph_blanket_self *c = b->self;
    const int q = c->list.partner[k];
    double *normal = c->list.normal[k], by = slab(b, p, q, normal);
    const double near = b->move[c->span[p]] + b->move[c->span[q]] + LISTED * b->structure->spacing;
    if (!(by > near)) {
        self_contact *out = &c->contact[c->contacts];
        if (set_contact(b, p, q, near, &by, out)) c->contacts++;
        memcpy(normal, out->normal, sizeof out->normal);
    }
    c->list.wake[k] = c->path[p] + c->path[q] + by;
}

morph_status morph_blanket_find_self(morph_blanket_state *b) {
    morph_blanket_self *c = b->self;
    c->contacts = 0;
    if (outdated(b)) {
        const morph_status status = find_pairs(b, b->before);
        if (status != MORPH_OK) return status;
    }
    const double still = 0.5 * LISTED * b->structure->spacing;
    for (int p = 0; p < c->bars; p++) {
        c->path[p] = b->path[c->span[p]];
        c->come[p] = c->path[p] + b->move[c->span[p]] + still;
    }
    for (int p = 0; p < c->bars; p++)
        for (int k = c->list.first[p]; k < c->list.first[p + 1]; k++)
            if (!(c->come[p] + c->come[c->list.partner[k]] < c->list.wake[k])) look(b, p, k);
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
