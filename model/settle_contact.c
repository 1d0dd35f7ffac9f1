/* Contact of settle: joints, links and skin triangles with the target and the base plane, and friction.
 *
 * Each element is held at fixed places, and at places of its own choice: wherever the search finds it deeper
 * than these know, one of its seekers is put there.
 *
 * A seeker is a half space within a step: where an element slides over an edge its deepest point stays at the
 * edge and moves along the element, and the normal, which is the element's own, does not turn. A point of the
 * element that kept to the curved distance would be turned over the edge instead, with a negative stiffness
 * of force over the edge's radius that is not there. */
#include "model/settle_internal.h"

#include <string.h>

/* Places within this of touching take part in a step, which moves no joint further than half of it (the
 * distance's slope is below 2). */
#define NEAR 1.0
/* Search: lattice of this many parts along an edge, then a compass search down to this stride. */
enum { LATTICE = 4 };
#define LEAST_STRIDE 1e-4
/* A seeker this close in weight to a new deepest point moves there and takes its force along. */
#define SAME_PLACE 1e-3

/* Weights below this are on the element's border, curvatures below that (per spacing) are flat. */
#define EDGE 1e-3
#define FLAT 1e-3
/* Seekers without a force and further off than this are free again. */
#define FORGET 0.05
/* A sliding contact drags the place where its friction spring hangs along, this far behind (spacings). */
#define ROPE 0.02
/* What stands no further off keeps that place: contacts that share a load pass it to and fro. */
#define LOOSE 1e-3

/* Friction's most force follows the contact's, but not its last changes: while it lies between least_cone and
 * all of what Coulomb's law allows it stays. Where friction itself presses a contact on, following at once is
 * a feedback that need not settle; any force within the cone holds at rest. */
static void set_cone(const morph_settle *s, morph_settle_place *p) {
    const double most = s->friction * p->push * p->slope;
    if (!(p->cone <= most && p->cone >= s->least_cone * most)) p->cone = 0.5 * (1.0 + s->least_cone) * most;
}

static void add_place(morph_settle *s, const int *joint, int corners, const double *weight, double radius) {
    morph_settle_place *p = &s->place[s->places++];
    memset(p, 0, sizeof *p);
    p->corners = corners;
    p->radius = radius / s->length_unit;
    p->used = weight != NULL;
    for (int k = 0; k < corners; k++) {
        p->joint[k] = joint[k];
        if (weight) p->weight[k] = weight[k];
    }
}

static void add_element(morph_settle *s, const int *joint, int corners, double radius) {
    morph_settle_element *e = &s->element[s->elements++];
    memset(e, 0, sizeof *e);
    e->corners = corners;
    e->radius = radius / s->length_unit;
    e->first = s->places;
    memcpy(e->joint, joint, (size_t)corners * sizeof *joint);
    for (int k = 0; k < MORPH_SETTLE_SEEKERS; k++) {
        add_place(s, joint, corners, NULL, radius);
        s->place[s->places - 1].seeks = true;
    }
}

/* The blanket's fixed places: joints, three on a link, four on a triangle. Links of the skin's layer are
 * edges of its triangles, so the search leaves them out. */
static void add_target_places(morph_settle *s) {
    static const double along[3][2] = {{0.75, 0.25}, {0.5, 0.5}, {0.25, 0.75}};
    static const double within[4][3] = {{4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0},
                                        {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0},
                                        {1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0},
                                        {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}};
    const morph_structure *st = s->structure;
    const double whole = 1.0;
    for (int j = 0; j < s->joints; j++)
        add_place(s, &j, 1, &whole, st->def.radius);
    for (int l = 0; l < st->links; l++)
        for (int k = 0; k < 3; k++)
            add_place(s, st->link[l], 2, along[k], st->link_radius[l]);
    for (int t = 0; t < st->skin_triangles; t++)
        for (int k = 0; k < 4; k++)
            add_place(s, st->skin[t], 3, within[k], st->def.radius);
    for (int l = 0; l < st->links; l++)
        if (st->link_kind[l] != MORPH_LINK_BOTTOM) add_element(s, st->link[l], 2, st->link_radius[l]);
    for (int t = 0; t < st->skin_triangles; t++)
        add_element(s, st->skin[t], 3, st->def.radius);
}

morph_status morph_settle_places_create(morph_settle *s) {
    const morph_structure *st = s->structure;
    const size_t elements = (size_t)(st->links + st->skin_triangles);
    const size_t most = 2 * (size_t)s->joints + 3 * (size_t)st->links + 4 * (size_t)st->skin_triangles +
                        MORPH_SETTLE_SEEKERS * elements;
    const double whole = 1.0;
    s->place = morph_alloc(most, sizeof *s->place);
    s->element = morph_alloc(elements, sizeof *s->element);
    if (!s->place || !s->element) return MORPH_ERR_NOMEM;
    if (s->sdf) add_target_places(s);
    /* Links and skin lie above the plane wherever their joints do. */
    for (int j = 0; j < s->joints && !isnan(s->base); j++) {
        add_place(s, &j, 1, &whole, st->def.radius);
        s->place[s->places - 1].plane = true;
    }
    return MORPH_OK;
}

static void place_of(const double *x, const int *joint, int corners, const double *weight, double q[3]) {
    for (int k = 0; k < 3; k++) {
        q[k] = 0.0;
        for (int j = 0; j < corners; j++)
            q[k] += weight[j] * x[3 * joint[j] + k];
    }
}

/* The smooth distance in spacings. */
static double distance(const morph_settle *s, const double q[3], double *g, double *h) {
    double p[3];
    for (int k = 0; k < 3; k++)
        p[k] = q[k] * s->length_unit;
    const double phi = morph_sdf_eval(s->sdf, p, g, h) / s->length_unit;
    for (int k = 0; h && k < 6; k++)
        h[k] *= s->length_unit;
    return phi;
}

static double exact_distance(const morph_settle *s, const double q[3], double *g) {
    double p[3];
    morph_closest at;
    for (int k = 0; k < 3; k++)
        p[k] = q[k] * s->length_unit;
    morph_distance_point(s->exact, p, &at);
    if (g) memcpy(g, at.normal, sizeof at.normal);
    return at.distance / s->length_unit;
}

static double true_gap(const morph_settle *s, const morph_settle_place *p, const double q[3], double *g) {
    if (p->seeks && s->exact) return exact_distance(s, q, g) - p->radius;
    if (!p->plane) return distance(s, q, g, NULL) - p->radius;
    if (g) g[0] = g[1] = 0.0, g[2] = 1.0;
    return q[2] - s->base - p->radius;
}

static double gap_of(const morph_settle *s, const morph_settle_place *p, const double q[3], double *g,
                     double *h) {
    double way[3];
    if (h && (p->plane || p->seeks)) memset(h, 0, 6 * sizeof *h);
    if (p->plane) return true_gap(s, p, q, g);
    if (!p->seeks) return distance(s, q, g, h) - p->radius;
    for (int k = 0; g && k < 3; k++)
        g[k] = p->slope * p->normal[k];
    morph_sub(q, p->at, way);
    return p->gap + p->slope * morph_dot(p->normal, way);
}

/* Whether a place without a force stays clear of the target at q: the distance's slope is below 2. */
static bool clear(const morph_settle_place *p, const double q[3]) {
    return !p->plane && !p->seeks && p->push == 0.0 && p->gap > 2.0 * morph_dist(q, p->at);
}

static void spread(morph_settle *s, const morph_settle_place *p, const double force[3]) {
    for (int j = 0; j < p->corners; j++)
        for (int k = 0; k < 3; k++)
            s->g[3 * p->joint[j] + k] -= p->weight[j] * force[k];
}

static void spread_hessian(morph_settle *s, const morph_settle_place *p, const double h[3][3]) {
    for (int i = 0; i < p->corners; i++)
        for (int j = 0; j <= i; j++) {
            double b[3][3];
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    b[r][c] = p->weight[i] * p->weight[j] * h[r][c];
            morph_settle_add(s, p->joint[i], p->joint[j], (const double(*)[3])b);
        }
}

/* Spring of stiffness k on the tangential way u from the anchor, sliding at force m (the cone):
 *     k u^2 / 2 up to u = m / k, then m u - m^2 / (2 k): once differentiable and convex. */
static double friction(const morph_settle *s, const morph_settle_place *p, const double q[3], double force[3],
                       double h[3][3]) {
    double u[3];
    morph_sub(q, p->anchor, u);
    const double off = morph_dot(u, p->normal);
    for (int k = 0; k < 3; k++)
        u[k] -= off * p->normal[k];
    const double way = morph_norm(u), k = s->grip, m = p->cone;
    const bool slides = k * way > m;
    const double pull = slides ? m / way : k;
    for (int r = 0; r < 3; r++) {
        force[r] -= pull * u[r];
        for (int c = 0; h && c < 3; c++) {
            h[r][c] += pull * ((r == c ? 1.0 : 0.0) - p->normal[r] * p->normal[c]);
            if (slides) h[r][c] -= pull * u[r] * u[c] / (way * way);
        }
    }
    return slides ? m * way - m * m / (2.0 * k) : 0.5 * k * way * way;
}

/* What the moving of its place adds to a seeker's curvature where stability and derivatives are asked for.
 * With c(x) = min over w of phi(sum w_j x_j), and E a basis of the weight changes that keep their sum and do
 * not leave the element, grad2 c = (w w') H - M K^-1 M',   M_j = w_j H X E + grad phi E_j,   K = E'X'H X E;
 * a direction without curvature in K (flat on flat) keeps its place. Adds -t grad2 c. */
static void rolling(morph_settle *s, const morph_settle_place *p, const double *x, const double q[3],
                    double t) {
    static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    double g[3], h[6], e[2][3] = {{0}}, way[2][3], m[2][3][3], k[2][2] = {{0}}, inverse[2][2] = {{0}};
    int inner[3], count = 0, n = 0;
    distance(s, q, g, h);
    for (int j = 0; j < p->corners; j++)
        if (p->weight[j] > EDGE) inner[count++] = j;
    for (; n + 1 < count; n++) {
        e[n][inner[0]] = -1.0;
        e[n][inner[n + 1]] = 1.0;
        morph_sub(&x[3 * p->joint[inner[n + 1]]], &x[3 * p->joint[inner[0]]], way[n]);
    }
    for (int a = 0; a < n; a++)
        for (int r = 0; r < 3; r++) {
            double hx = 0.0;
            for (int c = 0; c < 3; c++)
                hx += h[at[r][c]] * way[a][c];
            for (int j = 0; j < p->corners; j++)
                m[a][j][r] = p->weight[j] * hx + e[a][j] * g[r];
            for (int b = 0; b < n; b++)
                k[a][b] += hx * way[b][r];
        }
    const double det = k[0][0] * k[1][1] - k[0][1] * k[1][0];
    const int large = k[1][1] > k[0][0];
    if (k[large][large] > FLAT && det > FLAT * k[large][large]) {
        inverse[0][0] = k[1][1] / det;
        inverse[1][1] = k[0][0] / det;
        inverse[0][1] = inverse[1][0] = -k[0][1] / det;
    } else if (k[large][large] > FLAT)
        inverse[large][large] = 1.0 / k[large][large];
    for (int i = 0; i < p->corners; i++)
        for (int j = 0; j <= i; j++) {
            double b[3][3];
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++) {
                    b[r][c] = -t * p->weight[i] * p->weight[j] * h[at[r][c]];
                    for (int u = 0; u < n; u++)
                        for (int v = 0; v < n; v++)
                            b[r][c] += t * m[u][i][r] * inverse[u][v] * m[v][j][c];
                }
            morph_settle_add(s, p->joint[i], p->joint[j], (const double(*)[3])b);
        }
}

/* One place; see settle_energy.c for the limit's energy. */
static double contact(morph_settle *s, const morph_settle_place *p, const double *x,
                      morph_settle_order order) {
    const bool plain = s->form == MORPH_SETTLE_PLAIN, hessian = order >= MORPH_SETTLE_EXACT;
    double q[3], g[3], second[6], force[3] = {0, 0, 0}, h[3][3] = {{0}};
    place_of(x, p->joint, p->corners, p->weight, q);
    if (clear(p, q)) return 0.0;
    const double gap = gap_of(s, p, q, NULL, NULL);
    const double t = plain ? p->push : fmax(0.0, p->push - s->stiff * gap);
    double energy = plain ? -p->push * gap : (t - p->push) * (t + p->push) / (2.0 * s->stiff);
    if (p->cone > 0.0) energy += friction(s, p, q, force, hessian ? h : NULL);
    if (t > 0.0 && order >= MORPH_SETTLE_GRADIENT) {
        gap_of(s, p, q, g, hessian ? second : NULL);
        for (int k = 0; k < 3; k++)
            force[k] += t * g[k];
    }
    if (order >= MORPH_SETTLE_GRADIENT) spread(s, p, force);
    if (t > 0.0 && hessian) {
        static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        const double along = plain && p->push <= MORPH_SETTLE_LEAST_PUSH ? 0.0 : s->stiff;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) {
                h[r][c] += along * g[r] * g[c];
                if (order == MORPH_SETTLE_EXACT) h[r][c] -= t * second[at[r][c]];
            }
        if (plain && p->seeks && order == MORPH_SETTLE_EXACT) rolling(s, p, x, q, t);
    }
    if (hessian && (t > 0.0 || p->cone > 0.0)) spread_hessian(s, p, (const double(*)[3])h);
    return energy;
}

double morph_settle_contacts(morph_settle *s, const double *x, morph_settle_order order) {
    double energy = 0.0;
    for (int n = 0; n < s->places; n++)
        if (s->place[n].near) energy += contact(s, &s->place[n], x, order);
    return energy;
}

void morph_settle_begin(morph_settle *s, const double *x) {
    for (int n = 0; n < s->places; n++) {
        morph_settle_place *p = &s->place[n];
        double g[3];
        p->near = false;
        if (!p->used) {
            p->cone = 0.0;
            continue;
        }
        place_of(x, p->joint, p->corners, p->weight, p->at);
        p->gap = true_gap(s, p, p->at, g);
        p->near = p->push > 0.0 || p->gap < NEAR;
        p->slope = morph_norm(g);
        for (int k = 0; k < 3; k++) /* on a ridge there is no direction: no force either */
            p->normal[k] = p->slope > 0.0 ? g[k] / p->slope : 0.0;
        const double off = morph_dot(p->slip, p->normal);
        for (int k = 0; k < 3; k++)
            p->anchor[k] = p->at[k] - (p->slip[k] - off * p->normal[k]);
        set_cone(s, p);
    }
}

static void new_slip(const morph_settle *s, morph_settle_place *p, const double q[3]) {
    double u[3];
    morph_sub(q, p->anchor, u);
    const double off = morph_dot(u, p->normal);
    for (int k = 0; k < 3; k++)
        u[k] -= off * p->normal[k];
    const double way = morph_norm(u), most = fmax(p->cone / s->grip, ROPE);
    for (int k = 0; k < 3; k++)
        p->slip[k] = way > most ? u[k] * most / way : u[k];
}

void morph_settle_slide(morph_settle *s, const double *x) {
    for (int n = 0; n < s->places; n++) {
        morph_settle_place *p = &s->place[n];
        double q[3];
        place_of(x, p->joint, p->corners, p->weight, q);
        if (p->near && (p->cone > 0.0 || gap_of(s, p, q, NULL, NULL) < LOOSE))
            new_slip(s, p, q);
        else
            memset(p->slip, 0, sizeof p->slip);
    }
}

/* With the forces the cones follow. */
double morph_settle_update_contacts(morph_settle *s, const double *x) {
    double worst = 0.0;
    for (int n = 0; n < s->places; n++) {
        morph_settle_place *p = &s->place[n];
        if (!p->near) continue;
        double q[3];
        place_of(x, p->joint, p->corners, p->weight, q);
        if (clear(p, q)) continue;
        const double gap = gap_of(s, p, q, NULL, NULL);
        p->push = fmax(0.0, p->push - s->stiff * gap);
        set_cone(s, p);
        worst = fmax(worst, -gap);
    }
    return worst;
}

/* Least distance over the element: the best of a lattice, then towards and away from the corners. */
static double deepest(const morph_settle *s, const morph_settle_element *e, const double *x,
                      double weight[3]) {
    static const double middle[2][3] = {{0.5, 0.5, 0.0}, {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}};
    double least, q[3], reach = 0.0;
    place_of(x, e->joint, e->corners, middle[e->corners == 3], q);
    for (int j = 0; j < e->corners; j++)
        reach = fmax(reach, morph_dist(q, &x[3 * e->joint[j]]));
    least = distance(s, q, NULL, NULL);
    if (least - e->radius > 2.0 * reach) return least;
    least = INFINITY;
    for (int i = 0; i <= LATTICE; i++)
        for (int j = 0; j <= (e->corners == 3 ? LATTICE - i : 0); j++) {
            const double w[3] = {(double)i / LATTICE,
                                 e->corners == 3 ? (double)j / LATTICE : 1.0 - (double)i / LATTICE,
                                 e->corners == 3 ? (double)(LATTICE - i - j) / LATTICE : 0.0};
            place_of(x, e->joint, e->corners, w, q);
            const double here = distance(s, q, NULL, NULL);
            if (here < least) {
                least = here;
                memcpy(weight, w, sizeof w);
            }
        }
    if (least - e->radius > 0.5 / LATTICE) return least;
    for (double stride = 0.5 / LATTICE; stride > LEAST_STRIDE;) {
        bool moved = false;
        for (int way = 0; way < e->corners * (e->corners - 1); way++) {
            const int from = way % e->corners, to = (from + 1 + way / e->corners) % e->corners;
            const double step = fmin(stride, weight[from]);
            double w[3];
            if (!(step > 0.0)) continue;
            memcpy(w, weight, sizeof w);
            w[from] -= step;
            w[to] += step;
            place_of(x, e->joint, e->corners, w, q);
            const double here = distance(s, q, NULL, NULL);
            if (!(here < least)) continue;
            least = here;
            memcpy(weight, w, sizeof w);
            moved = true;
        }
        if (!moved) stride *= 0.5;
    }
    return least;
}

static double deepest_exact(const morph_settle *s, const morph_settle_element *e, const double *x,
                            double weight[3]) {
    double v[3][3];
    morph_closest at;
    for (int j = 0; j < e->corners; j++) {
        weight[j] = 1.0 / e->corners;
        for (int k = 0; k < 3; k++)
            v[j][k] = x[3 * e->joint[j] + k] * s->length_unit;
    }
    morph_distance_element(s->exact, (const double(*)[3])v, e->corners, e->radius * s->length_unit, weight,
                           &at);
    return at.distance / s->length_unit;
}

/* The seeker to put at `weight`: one close by, else a free one, else the one that carries least. */
static morph_settle_place *seeker_for(morph_settle *s, const morph_settle_element *e,
                                      const double weight[3]) {
    morph_settle_place *best = NULL;
    double score = INFINITY;
    for (int k = 0; k < MORPH_SETTLE_SEEKERS; k++) {
        morph_settle_place *p = &s->place[e->first + k];
        double apart = 0.0;
        for (int j = 0; j < e->corners; j++)
            apart = fmax(apart, fabs(p->weight[j] - weight[j]));
        if (p->used && apart < SAME_PLACE) return p;
        const double here = p->used ? p->push : -1.0;
        if (here < score) {
            score = here;
            best = p;
        }
    }
    best->push = 0.0;
    memset(best->slip, 0, sizeof best->slip);
    return best;
}

double morph_settle_seek(morph_settle *s, const double *x, double tolerance) {
    double worst = 0.0;
    for (int n = 0; n < s->elements; n++) {
        const morph_settle_element *e = &s->element[n];
        double weight[3] = {0, 0, 0};
        for (int k = 0; k < MORPH_SETTLE_SEEKERS; k++) {
            morph_settle_place *p = &s->place[e->first + k];
            if (p->push == 0.0 && p->gap > FORGET) p->used = false;
        }
        const double depth =
            e->radius - (s->exact ? deepest_exact(s, e, x, weight) : deepest(s, e, x, weight));
        worst = fmax(worst, depth);
        if (!(depth > tolerance)) continue;
        morph_settle_place *p = seeker_for(s, e, weight);
        memcpy(p->weight, weight, sizeof weight);
        p->used = true;
    }
    return worst;
}
