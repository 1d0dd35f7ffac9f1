/* Projections of the blanket: rigid posts, length limits, angle limits. */
#include "model/blanket_internal.h"

#include <string.h>

/* The sweeps converge towards the limits from outside, so they aim a little inside: what is left after them
 * then still holds the true limits. Small against what a limit means (a link of 1 spacing has a range of 0.6,
 * an angle one of 80 degrees). */
#define LENGTH_MARGIN 1e-3 /* spacings */
#define ANGLE_MARGIN 0.01  /* radians */

/* Rows closer to their limits than this are looked at in every sweep: what a sweep moves. */
#define HOT_LENGTH 0.005 /* spacings */
#define HOT_COSINE 0.01
/* Rows whose correction moves no joint further than this, spacings, are left alone until the next complete
 * sweep: a hundredth of the limits' margins. */
#define STILL 1e-5
/* Relative error of a post's squared length that is taken for rounding; a projection leaves some 4e-16. */
#define POST_RIGHT 2e-15
/* Every so many sweeps one is complete. */
#define COMPLETE 6

static double squared(double x) {
    return x * x;
}

/* Weights of joints that one correction is taken to carry at rest, at most. */
#define MOST_CARRIED 16.0

/* Joints of a tuple with their parts in u and v. */
static void set_angle(morph_angle *a, morph_turn *t, int far[2], const int uj[2], const int vj[2],
                      const double limit[2]) {
    a->joints = 0;
    for (int k = 0; k < 2; k++) {
        t->u[k] = uj[k];
        t->v[k] = vj[k];
    }
    for (int k = 0; k < 4; k++) {
        const int joint = k < 2 ? uj[k] : vj[k - 2];
        int at = 0;
        while (at < a->joints && a->joint[at] != joint)
            at++;
        if (at == a->joints) {
            a->joint[a->joints++] = joint;
            a->su[at] = a->sv[at] = 0.0;
        }
        *(k < 2 ? &a->su[at] : &a->sv[at]) += (k & 1) ? 1.0 : -1.0;
    }
    /* The joint in both arms is the corner, the others their far ends. */
    int ends = 0;
    for (int k = 0; k < a->joints; k++)
        if ((a->su[k] == 0.0) != (a->sv[k] == 0.0) && ends < 2) far[ends++] = a->joint[k];
    const double margin = fmin(ANGLE_MARGIN, 0.25 * (limit[1] - limit[0]));
    a->highest = cos(limit[0]);
    a->lowest = cos(limit[1]);
    t->ceiling = cos(limit[0] + margin);
    t->floor = cos(limit[1] - margin);
}

morph_status morph_blanket_limits_create(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    b->bound = morph_alloc((size_t)b->links, sizeof *b->bound);
    b->limit = morph_alloc((size_t)b->links, sizeof *b->limit);
    b->push = morph_alloc((size_t)b->links, sizeof *b->push);
    b->angle = morph_alloc((size_t)b->angles, sizeof *b->angle);
    b->spare_push = morph_alloc((size_t)b->links, sizeof *b->spare_push);
    b->spare_angle = morph_alloc((size_t)b->angles, sizeof *b->spare_angle);
    b->angle_far = morph_alloc((size_t)b->angles, sizeof *b->angle_far);
    b->turn = morph_alloc((size_t)b->angles, sizeof *b->turn);
    b->come = morph_alloc((size_t)b->joints, sizeof *b->come);
    b->link_wake = morph_alloc((size_t)b->links, sizeof *b->link_wake);
    b->near_link = morph_alloc((size_t)b->links, sizeof *b->near_link);
    b->near_angle = morph_alloc((size_t)b->angles, sizeof *b->near_angle);
    b->angle_wake = morph_alloc((size_t)b->angles, sizeof *b->angle_wake);
    b->hot_link = morph_alloc((size_t)b->links, sizeof *b->hot_link);
    b->hot_angle = morph_alloc((size_t)b->angles, sizeof *b->hot_angle);
    b->calm = morph_alloc((size_t)b->angles, sizeof *b->calm);
    b->listed_x = morph_alloc(3 * (size_t)b->joints, sizeof *b->listed_x);
    b->strayed = morph_alloc((size_t)b->joints, sizeof *b->strayed);
    if (!b->calm || !b->listed_x || !b->strayed) return MORPH_ERR_NOMEM;
    if (!b->angle_far || !b->turn || !b->come || !b->link_wake || !b->near_link || !b->near_angle ||
        !b->angle_wake || !b->hot_link || !b->hot_angle)
        return MORPH_ERR_NOMEM;
    if (!b->bound || !b->limit || !b->push || !b->angle || !b->spare_push || !b->spare_angle)
        return MORPH_ERR_NOMEM;
    for (int l = 0; l < b->links; l++) {
        const double lo = s->length_limit[l][0], hi = s->length_limit[l][1];
        const double margin = fmin(LENGTH_MARGIN * s->spacing, 0.25 * (hi - lo));
        b->bound[l][0] = lo;
        b->bound[l][1] = hi;
        b->limit[l][0] = lo + margin;
        b->limit[l][1] = hi - margin;
    }
    int n = 0, uj[2], vj[2];
    for (int t = 0; t < s->link_posts; t++) {
        morph_link_post_joints(s, t, uj, vj);
        set_angle(&b->angle[n], &b->turn[n], b->angle_far[n], uj, vj, s->link_post_limit[t]);
        n++;
    }
    for (int t = 0; t < s->link_links; t++) {
        morph_link_link_joints(s, t, uj, vj);
        set_angle(&b->angle[n], &b->turn[n], b->angle_far[n], uj, vj, s->link_link_limit[t]);
        n++;
    }
    for (int t = 0; t < n; t++)
        for (int k = 0; k < b->angle[t].joints; k++)
            b->angle[t].weight[k] = b->weight[b->angle[t].joint[k]];
    return MORPH_OK;
}

static void note(morph_blanket_state *b, double motion) {
    const double size = fabs(motion);
    if (size > b->changed) b->changed = size;
}

/* Moves two joints apart by q d, each by its weight's share; two held ones stay. */
static inline void part(const morph_blanket_state *b, const int ends[2], double *xi, double *xj,
                        const double d[3], double q) {
    const double wi = b->weight[ends[0]], wj = b->weight[ends[1]];
    double qi = 0.5 * q, qj = qi;
    if (wi != 1.0 || wj != 1.0) {
        if (wi + wj == 0.0) return;
        qi = q * (wi / (wi + wj));
        qj = q * (wj / (wi + wj));
    }
    for (int k = 0; k < 3; k++) {
        xi[k] -= qi * d[k];
        xj[k] += qj * d[k];
    }
}

/* With e the post before the step and d after the drift, the ends move by -+ q e / 2 so that |d + q e| = h:
 * q^2 e.e + 2 q d.e + d.d - h^2 = 0. Correcting along the old direction (SHAKE) keeps the leapfrog symmetric
 * in time, so that rigid posts alone do not consume energy. */
void morph_blanket_project_posts_along(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    for (int p = 0; p < b->posts; p++) {
        double *xb = &b->x[3 * s->post[p][0]], *xt = &b->x[3 * s->post[p][1]], d[3], e[3];
        morph_sub(xt, xb, d);
        morph_sub(&b->before[3 * s->post[p][1]], &b->before[3 * s->post[p][0]], e);
        const double ee = morph_dot(e, e), de = morph_dot(d, e);
        const double c = morph_dot(d, d) - s->post_length[p] * s->post_length[p];
        const double root = de * de - ee * c;
        if (!(de > 0.0 && root >= 0.0)) continue; /* turned too far in one step: left to the sweeps */
        const double q = -c / (de + sqrt(root));  /* the root near 0, without cancellation */
        part(b, s->post[p], xb, xt, e, q);
    }
}

/* Posts share no joint, so this one is exact. What no sweep has moved since is still right, to rounding. */
static void project_posts(morph_blanket_state *b, double *x) {
    const morph_structure *s = b->structure;
    for (int p = 0; p < b->posts; p++) {
        double *xb = &x[3 * s->post[p][0]], *xt = &x[3 * s->post[p][1]], d[3];
        morph_sub(xt, xb, d);
        const double square = morph_dot(d, d), wanted = s->post_length[p];
        if (fabs(square - wanted * wanted) <= POST_RIGHT * square || !(square > 0.0)) continue;
        const double length = sqrt(square);
        note(b, wanted - length);
        part(b, s->post[p], xb, xt, d, wanted / length - 1.0);
    }
}

/* An inequality's correction: grows as far as needed, shrinks again when a neighbour has relieved it, never
 * below zero (projected Gauss-Seidel). `gap` < 0 is a violation; returns the change. */
static double unilateral(double *push, double gap) {
    const double old = *push, now = old - gap;
    *push = now > 0.0 ? now : 0.0;
    return *push - old;
}

/* True if the next sweeps must look at it too. */
static bool project_length(morph_blanket_state *b, int l, double *x, double *motion) {
    const int *ends = b->structure->link[l];
    const double *limit = b->limit[l];
    double *xi = &x[3 * ends[0]], *xj = &x[3 * ends[1]], *push = b->push[l], d[3];
    morph_sub(xj, xi, d);
    const double square = morph_dot(d, d);
    const double hot = HOT_LENGTH * b->structure->spacing;
    *motion = 0.0;
    if (push[0] == 0.0 && push[1] == 0.0 && square > squared(limit[0]) && square < squared(limit[1]))
        return square < squared(limit[0] + hot) || (limit[1] > hot && square > squared(limit[1] - hot)) ||
               !(limit[1] > hot);
    const double length = sqrt(square);
    if (!(length > 0.0)) return true;
    double grow = unilateral(&push[0], length - limit[0]);
    if (push[0] == 0.0) grow -= unilateral(&push[1], limit[1] - length);
    note(b, grow);
    *motion = grow;
    if (grow != 0.0) part(b, ends, xi, xj, d, grow / length);
    return true;
}

static void start_length(morph_blanket_state *b, int l, double *x, double warm, double most) {
    const int *ends = b->structure->link[l];
    double *push = b->push[l], d[3];
    push[0] = fmin(warm * push[0], most);
    push[1] = fmin(warm * push[1], most);
    if (push[0] == push[1]) return;
    morph_sub(&x[3 * ends[1]], &x[3 * ends[0]], d);
    const double length = morph_norm(d);
    if (length > 0.0) part(b, ends, &x[3 * ends[0]], &x[3 * ends[1]], d, (push[0] - push[1]) / length);
}

static inline void arms(const morph_turn *a, const double *x, double u[3], double v[3]) {
    morph_sub(&x[3 * a->u[1]], &x[3 * a->u[0]], u);
    morph_sub(&x[3 * a->v[1]], &x[3 * a->v[0]], v);
}

static inline void add_gradient(const morph_angle *a, int j, const double gu[3], const double gv[3],
                                double (*grad)[3], double *square) {
    const double w = a->weight[j], su = a->su[j], sv = a->sv[j];
    for (int k = 0; k < 3; k++)
        grad[j][k] = w * (su * gu[k] + sv * gv[k]);
    *square += morph_dot(grad[j], grad[j]);
}

/* c = cos(u, v) = u.v / (|u||v|);  dc/du = (v/|v| - c u/|u|) / |u|, dc/dv likewise; a joint's gradient is
 * su dc/du + sv dc/dv, times its weight. Returns the sum of the gradients' squares; 0 where the arms are
 * parallel, which the limits keep far from, or all joints are held. arm: the shorter arm's length. grad may
 * be NULL, then so may arm, and 0 is returned. */
static double cosine(const morph_turn *t, const morph_angle *a, const double *x, double *c, double (*grad)[3],
                     double *arm) {
    double u[3], v[3];
    arms(t, x, u, v);
    const double uu = morph_dot(u, u), vv = morph_dot(v, v), scale = sqrt(uu * vv);
    *c = scale > 0.0 ? morph_dot(u, v) / scale : 0.0;
    if (!grad || !(scale > 0.0)) return 0.0;
    *arm = sqrt(fmin(uu, vv));
    const double one = 1.0 / scale, cu = *c / uu, cv = *c / vv;
    double square = 0.0, gu[3], gv[3];
    for (int k = 0; k < 3; k++) {
        gu[k] = v[k] * one - cu * u[k];
        gv[k] = u[k] * one - cv * v[k];
    }
    add_gradient(a, 0, gu, gv, grad, &square);
    add_gradient(a, 1, gu, gv, grad, &square);
    add_gradient(a, 2, gu, gv, grad, &square);
    if (a->joints > 3) add_gradient(a, 3, gu, gv, grad, &square);
    return square * scale > 1e-12 ? square : 0.0;
}

double morph_blanket_cosine(const morph_blanket_state *b, int angle, const double *x) {
    double c;
    cosine(&b->turn[angle], &b->angle[angle], x, &c, NULL, NULL);
    return c;
}

/* A length changes by at most what its two ends move. Both what they moved by in this step and what sweeps
 * may add counts against it. */
static bool link_near(morph_blanket_state *b, int l, const double *x, double near, double path, bool note) {
    const int *ends = b->structure->link[l];
    const double length = morph_dist(&x[3 * ends[0]], &x[3 * ends[1]]);
    const double low = length - b->limit[l][0], high = b->limit[l][1] - length;
    const double spare = (low < high ? low : high) - near;
    if (note && spare > 0.0) b->link_wake[l] = path + spare;
    return !(spare > 0.0);
}

/* With the ends of an arm of length a moving by m in all, it turns by at most m / (a - m); the cosine changes
 * by at most the sum of both turns: with m for both it keeps a distance g where m <= g a / (1 + g). */
static bool angle_near(const morph_blanket_state *b, const morph_turn *a, const double *x, double near,
                       double path, bool note, double *calm) {
    double u[3], v[3];
    arms(a, x, u, v);
    const double uu = morph_dot(u, u), vv = morph_dot(v, v), scale = sqrt(uu * vv);
    *calm = 0.0;
    if (!(scale > 0.0)) return true;
    const double c = morph_dot(u, v) / scale, high = a->ceiling - c, low = c - a->floor;
    const double gap = high < low ? high : low;
    if (!(gap > 0.0)) return true;
    const double arm = sqrt(uu < vv ? uu : vv), cool = gap - HOT_COSINE;
    const double spare = gap * arm / (1.0 + gap) - near;
    if (cool > 0.0) *calm = cool * arm / (1.0 + cool);
    if (note && spare > 0.0) b->angle_wake[a - b->turn] = path + spare;
    return !(spare > 0.0);
}

static void list_links(morph_blanket_state *b, const double *x, double add, bool all) {
    b->near_links = 0;
    for (int l = 0; l < b->links; l++) {
        const int *e = b->structure->link[l];
        const double come = b->come[e[0]] + b->come[e[1]];
        if (!all && come + 2.0 * add < b->link_wake[l]) continue;
        const double own = all ? 0.0 : b->move[e[0]] + b->move[e[1]];
        if (b->def.drive || link_near(b, l, x, 2.0 * add + own, come - own, !all))
            b->near_link[b->near_links++] = l;
        else
            b->push[l][0] = b->push[l][1] = 0.0;
    }
}

void morph_blanket_list_limits(morph_blanket_state *b, const double *x, bool all) {
    const double add = b->added, *move = b->move;
    memcpy(b->listed_x, x, 3 * (size_t)b->joints * sizeof *x);
    for (int j = 0; j < b->joints; j++)
        b->come[j] = b->path[j] + move[j];
    list_links(b, x, add, all);
    b->near_angles = 0;
    for (int t = 0; t < b->angles; t++) {
        morph_turn *a = &b->turn[t];
        const double come = b->come[a->u[0]] + b->come[a->u[1]] + b->come[a->v[0]] + b->come[a->v[1]];
        if (!all && come + 4.0 * add < b->angle_wake[t]) continue;
        const double own = all ? 0.0 : move[a->u[0]] + move[a->u[1]] + move[a->v[0]] + move[a->v[1]];
        if (angle_near(b, a, x, 4.0 * add + own, come - own, !all, &b->calm[b->near_angles]))
            b->near_angle[b->near_angles++] = t;
        else
            a->push[0] = a->push[1] = 0.0;
    }
}

bool morph_blanket_cosine_gradient(const morph_blanket_state *b, int angle, const double *x, double *c,
                                   double grad[4][3]) {
    double arm;
    return cosine(&b->turn[angle], &b->angle[angle], x, c, grad, &arm) > 0.0;
}

static double clip(double value, double most) {
    return value > most ? most : value < -most ? -most : value;
}

static inline void move(double *x, const double d[3], double by) {
    x[0] += by * d[0];
    x[1] += by * d[1];
    x[2] += by * d[2];
}

/* An angle has at least three joints. */
static inline void turn(const morph_angle *a, double *x, const double (*grad)[3], double change) {
    move(&x[3 * a->joint[0]], grad[0], change);
    move(&x[3 * a->joint[1]], grad[1], change);
    move(&x[3 * a->joint[2]], grad[2], change);
    if (a->joints > 3) move(&x[3 * a->joint[3]], grad[3], change);
}

/* Whether floor < cos(u, v) < ceiling, without root or division; false where it cannot be told so. */
static bool cosine_within(const double u[3], const double v[3], double floor, double ceiling) {
    const double dot = morph_dot(u, v), side = dot > 0.0 ? ceiling : floor;
    if (!(ceiling > 0.0 && floor < 0.0)) return false;
    return dot * dot < side * side * (morph_dot(u, u) * morph_dot(v, v));
}

static bool at_work(const morph_turn *a) {
    return a->push[0] != 0.0 || a->push[1] != 0.0;
}

/* Moves the joints by what an angle of cosine c asks for; longest motion by the correction. */
static double correct_angle(morph_turn *t, const morph_angle *a, double *x, double c) {
    double change = unilateral(&t->push[0], clip((c - t->floor) * a->inverse, a->most));
    if (t->push[0] == 0.0) change -= unilateral(&t->push[1], clip((t->ceiling - c) * a->inverse, a->most));
    if (change != 0.0) turn(a, x, (const double(*)[3])a->grad, change);
    return change * a->size;
}

/* Sum of the gradients times the joints. */
static inline double along(const morph_angle *a, const double *x) {
    double sum = morph_dot(a->grad[0], &x[3 * a->joint[0]]) + morph_dot(a->grad[1], &x[3 * a->joint[1]]) +
                 morph_dot(a->grad[2], &x[3 * a->joint[2]]);
    if (a->joints > 3) sum += morph_dot(a->grad[3], &x[3 * a->joint[3]]);
    return sum;
}

/* Between complete sweeps the cosine is taken as linear: joints move by fractions of HOT_LENGTH (or all
 * sweeps are complete), over which its second derivatives, at most 4 / arm^2, change it by less than 1e-4. */
static double linear_angle(morph_turn *t, const morph_angle *a, double *x) {
    const double c = a->level + along(a, x);
    return at_work(t) || c < t->floor || c > t->ceiling ? correct_angle(t, a, x, c) : 0.0;
}

/* Near parallel arms the gradient is small and its step far too long: none moves the joints by more than half
 * the shorter arm. *motion: longest by the correction. True if the next sweeps must look at it too. */
static bool project_angle(morph_turn *t, morph_angle *a, double *x, double *motion) {
    double c, arm, u[3], v[3];
    *motion = 0.0;
    if (!at_work(t)) {
        arms(t, x, u, v);
        if (cosine_within(u, v, t->floor + HOT_COSINE, t->ceiling - HOT_COSINE)) return false;
        a->linear = false;
        if (cosine_within(u, v, t->floor, t->ceiling)) return true;
    }
    a->linear = false;
    const double square = cosine(t, a, x, &c, a->grad, &arm);
    if (square == 0.0) return true;
    a->size = sqrt(square);
    a->inverse = 1.0 / square;
    a->most = 0.5 * arm / a->size;
    a->linear = true;
    a->level = c - along(a, x);
    *motion = correct_angle(t, a, x, c);
    return true;
}

static void start_angle(morph_turn *t, const morph_angle *a, double *x, double warm, double most) {
    double c, arm, grad[4][3];
    if (t->push[0] == t->push[1]) return;
    const double square = cosine(t, a, x, &c, grad, &arm);
    const double limit = square > 0.0 ? most / sqrt(square) : 0.0;
    t->push[0] = fmin(warm * t->push[0], limit);
    t->push[1] = fmin(warm * t->push[1], limit);
    if (square > 0.0) turn(a, x, (const double(*)[3])grad, t->push[0] - t->push[1]);
}

/* What carries weight moves joints by a few times its acceleration times step^2 every step. An impact's
 * corrections are far larger and must not come again in the next step: they would feed the motion. Posts come
 * last: their corrections are not kept, and contacts must not answer before they have. */
double morph_blanket_most_carried(const morph_blanket_state *b) {
    return MOST_CARRIED * b->pull * b->step * b->step;
}

void morph_blanket_project_start(morph_blanket_state *b, double *x, double warm) {
    const double most = morph_blanket_most_carried(b);
    for (int t = 0; t < b->near_angles; t++)
        start_angle(&b->turn[b->near_angle[t]], &b->angle[b->near_angle[t]], x, warm, most);
    for (int l = 0; l < b->near_links; l++)
        start_length(b, b->near_link[l], x, warm, most);
    morph_blanket_start_contacts(b, x, warm, most);
    project_posts(b, x);
}

/* How far every joint is from where the limits were listed. */
static void note_strayed(morph_blanket_state *b, const double *x) {
    for (int j = 0; j < b->joints; j++)
        b->strayed[j] = morph_dist(&x[3 * j], &b->listed_x[3 * j]);
}

/* Nothing pushes at the angle and its ends have not moved enough to bring it near a limit. */
static bool is_calm(const morph_blanket_state *b, const morph_turn *a, double calm) {
    const double *moved = b->strayed;
    return moved[a->u[0]] + moved[a->u[1]] + moved[a->v[0]] + moved[a->v[1]] < calm && !at_work(a);
}

/* All listed rows that are not calm; lists those that are hot. */
static void sweep_complete(morph_blanket_state *b, double *x, bool backward) {
    double motion;
    b->hot_angles = b->hot_links = b->hot_contacts = 0;
    note_strayed(b, x);
    for (int t = 0; t < b->near_angles; t++) {
        const int at = backward ? b->near_angles - 1 - t : t, angle = b->near_angle[at];
        if (is_calm(b, &b->turn[angle], b->calm[at])) continue;
        if (project_angle(&b->turn[angle], &b->angle[angle], x, &motion))
            b->hot_angle[b->hot_angles++] = angle;
        note(b, motion);
    }
    for (int l = 0; l < b->near_links; l++) {
        const int link = b->near_link[backward ? b->near_links - 1 - l : l];
        if (project_length(b, link, x, &motion)) b->hot_link[b->hot_links++] = link;
    }
}

/* Keeps the order of a list when its rows were looked at from the end. */
static int close_up(int *list, int length, int kept, bool backward) {
    if (backward && kept < length) memmove(list, list + length - kept, (size_t)kept * sizeof *list);
    return kept;
}

/* Lists made in a backward sweep run the other way. What a row's correction no longer moves by more than
 * `still` is done until the next complete sweep. */
static void sweep_hot(morph_blanket_state *b, double *x, bool backward) {
    const double still = STILL * b->structure->spacing;
    int kept = 0;
    for (int t = 0; t < b->hot_angles; t++) {
        const int at = backward ? b->hot_angles - 1 - t : t, angle = b->hot_angle[at];
        morph_angle *a = &b->angle[angle];
        double motion;
        if (a->linear)
            motion = linear_angle(&b->turn[angle], a, x);
        else
            project_angle(&b->turn[angle], a, x, &motion);
        note(b, motion);
        if (fabs(motion) > still) b->hot_angle[backward ? b->hot_angles - 1 - kept++ : kept++] = angle;
    }
    b->hot_angles = close_up(b->hot_angle, b->hot_angles, kept, backward);
    kept = 0;
    for (int l = 0; l < b->hot_links; l++) {
        const int at = backward ? b->hot_links - 1 - l : l, link = b->hot_link[at];
        double motion;
        project_length(b, link, x, &motion);
        if (fabs(motion) > still) b->hot_link[backward ? b->hot_links - 1 - kept++ : kept++] = link;
    }
    b->hot_links = close_up(b->hot_link, b->hot_links, kept, backward);
}

/* Nothing pushes at the contact and its corners have not moved enough to bring it near. */
static bool is_clear(const morph_blanket_state *b, const morph_contact *c, double hot) {
    double moved = 0.0;
    for (int k = 0; k < c->corners; k++)
        if (b->strayed[c->joint[k]] > moved) moved = b->strayed[c->joint[k]];
    return moved < c->spare - hot && c->push == 0.0;
}

static void sweep_contacts(morph_blanket_state *b, double *x, bool complete, bool backward, double friction) {
    const double hot = HOT_LENGTH * b->structure->spacing, still = STILL * b->structure->spacing;
    for (int n = 0; n < b->contacts && complete; n++) {
        double gap;
        const int contact = backward ? b->contacts - 1 - n : n;
        if (is_clear(b, &b->contact[contact], hot)) continue;
        note(b, morph_blanket_project_contact(&b->contact[contact], x, friction, &gap));
        if (gap < hot || b->contact[contact].push > 0.0) b->hot_contact[b->hot_contacts++] = contact;
    }
    if (complete) return;
    int kept = 0;
    for (int n = 0; n < b->hot_contacts; n++) {
        const int contact = b->hot_contact[backward ? b->hot_contacts - 1 - n : n];
        const double motion = morph_blanket_project_contact(&b->contact[contact], x, friction, NULL);
        note(b, motion);
        if (motion > still) b->hot_contact[backward ? b->hot_contacts - 1 - kept++ : kept++] = contact;
    }
    b->hot_contacts = close_up(b->hot_contact, b->hot_contacts, kept, backward);
}

/* Angles first and posts last: what comes last holds best. Posts are exact, contacts and lengths must hold,
 * angles yield where all cannot hold at once. */
void morph_blanket_sweep(morph_blanket_state *b, double *x, int sweep, double friction) {
    const bool stirred = b->stirred > HOT_LENGTH * b->structure->spacing;
    const bool backward = (sweep & 1) != 0, complete = sweep % COMPLETE == 0 || stirred;
    b->changed = 0.0;
    if (complete) {
        sweep_complete(b, x, backward);
        b->hot_backward = backward;
    } else
        sweep_hot(b, x, backward != b->hot_backward);
    const int panels = b->structure->panels;
    for (int p = 0; p < panels; p++)
        morph_blanket_project_panel(b, backward ? panels - 1 - p : p, x);
    note(b, morph_blanket_project_self(b, x, backward));
    sweep_contacts(b, x, complete, complete ? backward : backward != b->hot_backward, friction);
    if (b->soft) morph_blanket_soft_sweep(b, x, backward, friction);
    project_posts(b, x);
    b->stirred = b->changed;
    /* Panels hang together and a deformable target has sweeps of its own: neither is done early. */
    if (panels > 0 || b->soft) b->changed = INFINITY;
}

/* Most sweeps over lengths and posts alone, and after how many it is asked whether they are done. */
#define LENGTH_SWEEPS 48
#define LENGTH_ASKED 4

static bool within_bounds(const morph_blanket_state *b, int l, const double *x) {
    const int *ends = b->structure->link[l];
    const double length = morph_dist(&x[3 * ends[0]], &x[3 * ends[1]]);
    return length >= b->bound[l][0] && length <= b->bound[l][1];
}

static bool lengths_hold(const morph_blanket_state *b, const double *x) {
    for (int l = 0; l < b->links; l++)
        if (!within_bounds(b, l, x)) return false;
    return true;
}

/* Links that these sweeps may push: those at work and those no further inside than sweeps move them. */
static void list_lengths(morph_blanket_state *b, const double *x) {
    const double hot = HOT_LENGTH * b->structure->spacing;
    b->near_links = 0;
    for (int l = 0; l < b->links; l++) {
        const int *ends = b->structure->link[l];
        const double length = morph_dist(&x[3 * ends[0]], &x[3 * ends[1]]);
        const bool near = length < b->limit[l][0] + hot || length > b->limit[l][1] - hot;
        if (near || b->push[l][0] > 0.0 || b->push[l][1] > 0.0) b->near_link[b->near_links++] = l;
    }
}

bool morph_blanket_sweep_lengths(morph_blanket_state *b, double *x) {
    if (b->structure->panels > 0 || b->def.drive) return false;
    memset(b->push, 0, (size_t)b->links * sizeof *b->push);
    project_posts(b, x);
    for (int sweep = 0; sweep < LENGTH_SWEEPS; sweep++) {
        if (sweep % LENGTH_ASKED == 0) {
            if (lengths_hold(b, x)) return true;
            list_lengths(b, x);
        }
        for (int l = 0; l < b->near_links; l++) {
            double motion;
            project_length(b, b->near_link[sweep & 1 ? b->near_links - 1 - l : l], x, &motion);
        }
        project_posts(b, x);
    }
    return lengths_hold(b, x);
}
