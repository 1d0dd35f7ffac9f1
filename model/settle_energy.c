/* Energy of settle with its gradient and Hessian, one traversal for all three.
 *
 * A limit c(x) >= 0 with multiplier p >= 0 and penalty r adds (augmented Lagrangian)
 *     (max(0, t)^2 - p^2) / (2 r),   t = p - r c,
 * with gradient -t grad c and Hessian r grad c grad c' - t grad2 c where t > 0, nothing where not. The
 * multiplier's update is p = max(0, t): then the gradient at x is that of the Lagrangian itself. */
#include "model/settle_internal.h"

#include <string.h>

static bool wants_gradient(morph_settle_order order) {
    return order >= MORPH_SETTLE_GRADIENT;
}

static bool wants_hessian(morph_settle_order order) {
    return order >= MORPH_SETTLE_EXACT;
}

/* Force t of a limit at value c; *along becomes its stiffness along the gradient; adds its energy. */
static double limit_force(const morph_settle *s, double c, double push, double stiff, double *along,
                          double *energy) {
    *along = 0.0;
    if (s->form == MORPH_SETTLE_PLAIN) {
        if (push > MORPH_SETTLE_LEAST_PUSH) *along = stiff;
        *energy -= push * c;
        return push;
    }
    const double t = push - stiff * c;
    if (t <= 0.0) {
        *energy -= push * push / (2.0 * stiff);
        return 0.0;
    }
    *energy += (t - push) * (t + push) / (2.0 * stiff);
    *along = stiff;
    return t;
}

/* An energy of the distance L of two joints with slope T (tension) and second derivative A. With n the unit
 * direction: gradient T n at the far end, Hessian A n n' + (T/L)(I - n n'), which is positive semidefinite
 * without the second part where T < 0 (push). */
static void add_axial(morph_settle *s, const int ends[2], const double d[3], double length, double tension,
                      double stiffness, morph_settle_order order) {
    for (int k = 0; k < 3 && wants_gradient(order); k++) {
        s->g[3 * ends[0] + k] -= tension * d[k] / length;
        s->g[3 * ends[1] + k] += tension * d[k] / length;
    }
    if (!wants_hessian(order)) return;
    const double across = (order == MORPH_SETTLE_SAFE ? fmax(tension, 0.0) : tension) / length;
    const double along = (order == MORPH_SETTLE_SAFE ? fmax(stiffness, 0.0) : stiffness) - across;
    double b[3][3], minus[3][3];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            b[r][c] = along * d[r] * d[c] / (length * length) + (r == c ? across : 0.0);
            minus[r][c] = -b[r][c];
        }
    morph_settle_add(s, ends[0], ends[0], (const double(*)[3])b);
    morph_settle_add(s, ends[1], ends[1], (const double(*)[3])b);
    morph_settle_add(s, ends[0], ends[1], (const double(*)[3])minus);
}

/* Springs and length limits: the tension is k (L - L0) + t_max - t_min. */
static double links(morph_settle *s, const double *x, morph_settle_order order) {
    const morph_structure *st = s->structure;
    double energy = 0.0;
    for (int l = 0; l < st->links; l++) {
        const int *ends = st->link[l];
        double d[3], along[2];
        morph_sub(&x[3 * ends[1]], &x[3 * ends[0]], d);
        const double length = morph_norm(d), stretch = length - st->start_length[l] / s->length_unit;
        const double lo = st->length_limit[l][0] / s->length_unit,
                     hi = st->length_limit[l][1] / s->length_unit;
        const double least =
            limit_force(s, length - lo, s->link_push[l][0], s->stiff_length, &along[0], &energy);
        const double most =
            limit_force(s, hi - length, s->link_push[l][1], s->stiff_length, &along[1], &energy);
        energy += 0.5 * s->spring * stretch * stretch;
        if (length > 0.0)
            add_axial(s, ends, d, length, s->spring * stretch + most - least, s->spring + along[0] + along[1],
                      order);
    }
    return energy;
}

/* Equality |d| = h: p c + r c^2 / 2. */
static double posts(morph_settle *s, const double *x, morph_settle_order order) {
    const morph_structure *st = s->structure;
    const bool plain = s->form == MORPH_SETTLE_PLAIN;
    double energy = 0.0;
    for (int p = 0; p < st->posts; p++) {
        double d[3];
        morph_sub(&x[3 * st->post[p][1]], &x[3 * st->post[p][0]], d);
        const double length = morph_norm(d), c = length - st->post_length[p] / s->length_unit;
        const double stiff = plain ? 0.0 : s->stiff;
        energy += (s->post_push[p] + 0.5 * stiff * c) * c;
        if (length > 0.0) add_axial(s, st->post[p], d, length, s->post_push[p] + stiff * c, s->stiff, order);
    }
    return energy;
}

typedef struct arms {
    double u[3], v[3]; /* unit */
    double p[3], q[3]; /* dc/du |u|, dc/dv |v| */
    double a, b;       /* 1/|u|, 1/|v| */
    double c;
} arms;

/* c = u.v / (|u||v|). With unit u, v: p = v - c u, q = u - c v, dc/du = p/|u|, dc/dv = q/|v|. */
static bool arms_at(const morph_settle_angle *t, const double *x, arms *m) {
    double u[3] = {0, 0, 0}, v[3] = {0, 0, 0};
    for (int j = 0; j < t->joints; j++)
        for (int k = 0; k < 3; k++) {
            u[k] += t->su[j] * x[3 * t->joint[j] + k];
            v[k] += t->sv[j] * x[3 * t->joint[j] + k];
        }
    const double uu = morph_norm(u), vv = morph_norm(v);
    m->c = 0.0;
    if (!(uu > 0.0 && vv > 0.0)) return false;
    m->a = 1.0 / uu;
    m->b = 1.0 / vv;
    for (int k = 0; k < 3; k++) {
        m->u[k] = u[k] * m->a;
        m->v[k] = v[k] * m->b;
    }
    m->c = morph_dot(m->u, m->v);
    for (int k = 0; k < 3; k++) {
        m->p[k] = m->v[k] - m->c * m->u[k];
        m->q[k] = m->u[k] - m->c * m->v[k];
    }
    return true;
}

double morph_settle_angle_value(const morph_settle_angle *a, const double *x) {
    arms m;
    arms_at(a, x, &m);
    return m.c;
}

/* Hessian of an energy of c with slope w and second derivative e:  e grad c grad c' + w grad2 c, where
 *     d2c/du2  = -(u p' + p u' + c (I - u u')) / |u|^2,
 *     d2c/dudv = (I - v v' - u q') / (|u||v|). */
static void add_angle_hessian(morph_settle *s, const morph_settle_angle *t, const arms *m, double w,
                              double e) {
    double uu[3][3], vv[3][3], uv[3][3];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const double one = r == c ? 1.0 : 0.0;
            uu[r][c] = m->a * m->a *
                       (e * m->p[r] * m->p[c] -
                        w * (m->u[r] * m->p[c] + m->p[r] * m->u[c] + m->c * (one - m->u[r] * m->u[c])));
            vv[r][c] = m->b * m->b *
                       (e * m->q[r] * m->q[c] -
                        w * (m->v[r] * m->q[c] + m->q[r] * m->v[c] + m->c * (one - m->v[r] * m->v[c])));
            uv[r][c] =
                m->a * m->b * (e * m->p[r] * m->q[c] + w * (one - m->v[r] * m->v[c] - m->u[r] * m->q[c]));
        }
    for (int i = 0; i < t->joints; i++)
        for (int j = 0; j <= i; j++) {
            double b[3][3];
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    b[r][c] = t->su[i] * t->su[j] * uu[r][c] + t->sv[i] * t->sv[j] * vv[r][c] +
                              t->su[i] * t->sv[j] * uv[r][c] + t->sv[i] * t->su[j] * uv[c][r];
            morph_settle_add(s, t->joint[i], t->joint[j], (const double(*)[3])b);
        }
}

static double angles(morph_settle *s, const double *x, morph_settle_order order) {
    double energy = 0.0;
    for (int n = 0; n < s->angles; n++) {
        const morph_settle_angle *t = &s->angle[n];
        arms m;
        double along[2];
        if (!arms_at(t, x, &m)) continue;
        const double low = limit_force(s, m.c - t->floor, t->push[0], s->stiff_angle, &along[0], &energy);
        const double high = limit_force(s, t->ceiling - m.c, t->push[1], s->stiff_angle, &along[1], &energy);
        const double slope = high - low;
        if (low == 0.0 && high == 0.0) continue;
        for (int j = 0; j < t->joints && wants_gradient(order); j++)
            for (int k = 0; k < 3; k++)
                s->g[3 * t->joint[j] + k] += slope * (t->su[j] * m.a * m.p[k] + t->sv[j] * m.b * m.q[k]);
        if (wants_hessian(order))
            add_angle_hessian(s, t, &m, order == MORPH_SETTLE_EXACT ? slope : 0.0, along[0] + along[1]);
    }
    return energy;
}

/* The pull's safe part: s > 0 draws together along the way to the centre only near it (|r|^2 < e^2 / 2); far
 * from it that direction softens, s < 0 the other way round. */
static void safe_attraction(const double r[3], double softening, double strength, double h[3][3]) {
    const double rr = morph_dot(r, r), square = rr + softening * softening;
    const double pull = strength / (square * sqrt(square)), along = pull * (1.0 - 3.0 * rr / square);
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 3; m++) {
            const double ray = rr > 0.0 ? r[k] * r[m] / rr : 0.0;
            h[k][m] += fmax(pull, 0.0) * ((k == m ? 1.0 : 0.0) - ray) + fmax(along, 0.0) * ray;
        }
}

static double joint_forces(morph_settle *s, const double *x, morph_settle_order order) {
    double energy = 0.0;
    for (int j = 0; j < s->joints; j++) {
        double force[3] = {0, 0, -s->weight}, h[3][3] = {{0}}, away[3];
        energy += s->weight * x[3 * j + 2];
        for (int m = 0; m < s->attractors; m++) {
            const morph_attractor *a = &s->attractor[m];
            energy +=
                morph_attraction(a, s->softening, &x[3 * j], force, order == MORPH_SETTLE_EXACT ? h : NULL);
            morph_sub(a->at, &x[3 * j], away);
            if (order == MORPH_SETTLE_SAFE) safe_attraction(away, s->softening, a->strength, h);
        }
        morph_sub(&x[3 * j], &s->before[3 * j], away);
        energy += 0.5 * s->drag * morph_dot(away, away);
        for (int k = 0; k < 3; k++) {
            if (wants_gradient(order)) s->g[3 * j + k] += s->drag * away[k] - force[k];
            h[k][k] += s->drag;
        }
        if (wants_hessian(order)) morph_settle_add(s, j, j, (const double(*)[3])h);
    }
    return energy;
}

double morph_settle_evaluate(morph_settle *s, const double *x, morph_settle_order order) {
    if (wants_gradient(order)) memset(s->g, 0, 3 * (size_t)s->joints * sizeof *s->g);
    if (wants_hessian(order)) memset(s->value, 0, (size_t)s->start[3 * s->joints] * sizeof *s->value);
    double energy = joint_forces(s, x, order) + links(s, x, order);
    energy += posts(s, x, order);
    energy += angles(s, x, order);
    energy += morph_settle_contacts(s, x, order);
    for (int j = 0; j < s->joints && wants_gradient(order); j++)
        for (int k = 0; k < 3 && s->fixed[j]; k++)
            s->g[3 * j + k] = 0.0;
    if (wants_hessian(order)) morph_settle_hold_fixed(s);
    return energy;
}

static double new_push(double *push, double stiff, double c) {
    *push = fmax(0.0, *push - stiff * c);
    return fmax(0.0, -c);
}

double morph_settle_update(morph_settle *s, const double *x) {
    const morph_structure *st = s->structure;
    double worst = 0.0;
    for (int l = 0; l < st->links; l++) {
        const double length = morph_dist(&x[3 * st->link[l][0]], &x[3 * st->link[l][1]]);
        worst = fmax(worst, new_push(&s->link_push[l][0], s->stiff_length,
                                     length - st->length_limit[l][0] / s->length_unit));
        worst = fmax(worst, new_push(&s->link_push[l][1], s->stiff_length,
                                     st->length_limit[l][1] / s->length_unit - length));
    }
    for (int p = 0; p < st->posts; p++) {
        const double height = st->post_length[p] / s->length_unit;
        const double c = morph_dist(&x[3 * st->post[p][0]], &x[3 * st->post[p][1]]) - height;
        s->post_push[p] += s->stiff * c;
        worst = fmax(worst, fabs(c) / height);
    }
    for (int n = 0; n < s->angles; n++) {
        morph_settle_angle *t = &s->angle[n];
        const double c = morph_settle_angle_value(t, x);
        worst = fmax(worst, new_push(&t->push[0], s->stiff_angle, c - t->floor));
        worst = fmax(worst, new_push(&t->push[1], s->stiff_angle, t->ceiling - c));
    }
    return fmax(worst, morph_settle_update_contacts(s, x));
}

void morph_settle_forget(morph_settle *s) {
    memset(s->post_push, 0, (size_t)s->structure->posts * sizeof *s->post_push);
    memset(s->link_push, 0, (size_t)s->structure->links * sizeof *s->link_push);
    for (int n = 0; n < s->angles; n++)
        s->angle[n].push[0] = s->angle[n].push[1] = 0.0;
    for (int n = 0; n < s->places; n++) {
        morph_settle_place *p = &s->place[n];
        p->push = p->cone = 0.0;
        memset(p->slip, 0, sizeof p->slip);
    }
    for (int n = 0; n < s->elements; n++)
        for (int k = 0; k < MORPH_SETTLE_SEEKERS; k++)
            s->place[s->element[n].first + k].used = false;
}
