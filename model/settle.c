/* Settle's run: implicit steps, Newton's iteration within one, the end. */
#include "model/settle_internal.h"

#include <string.h>

/* Drag of the first step in loads per spacing: free fall then moves a quarter of a spacing. */
#define FIRST_DRAG 4.0
#define LEAST_DRAG 1e-3
/* The least drag itself is raised to at most this, where shorter steps are wanted near rest. */
#define MOST_LEAST_DRAG 1.0
/* A joint moves this far in a Newton step and in an implicit step, at most (spacings): contacts within twice
 * the second are listed. */
#define MOST_NEWTON 0.2
#define MOST_MOVE 0.4
/* Newton stops once the gradient is this part of the step's first: the multipliers are renewed after it. */
#define FORCING 0.1
enum { MOST_ROUNDS = 4, MOST_NEWTONS = 10, MOST_HALVINGS = 12, MOST_SADDLES = 4, PATIENCE = 8, FALLING = 40 };
/* Violation of limits that counts as held, in spacings: what lengths are checked to elsewhere. */
#define HELD 1e-9
/* Forces of the load balance to about this. */
#define ROUNDING 1e-10
/* Depth of a whole element that counts as clear, in spacings: a tenth of what is allowed elsewhere. The
 * smooth distance's own error is some 1e-3 and more at edges; a new place for less would only stir the
 * contacts up again (at 1e-5 the forces left over went on jumping by 1e-2 of a weight). */
#define CLEAR 1e-4
/* Least part of the Hessian's indefinite part that is tried. */
#define LEAST_SHARE 0.25
/* Penalties grow where an update leaves more than a quarter of a violation, to at most the first; near rest,
 * in steps shorter than CLOSE (spacings), to at most the second. */
#define MOST_PENALTY 4e3
#define LAST_PENALTY 1e6
#define CLOSE 1e-3
/* Friction is held between this part and all of what Coulomb's law allows, from the first to the last: where
 * shorter steps find no rest, the contacts' forces and the friction they allow drive each other to and fro,
 * and the wider the range the less friction follows. */
#define FIRST_CONE 0.9
#define LAST_CONE 0.5
#define CALMER 0.8
/* Forces that grow by less than this in a step do not keep the next step from growing: a part that falls
 * freely, or swings down, has the same force left over all the way, give or take a little. */
#define STEADY 1.02
/* Kick that leaves a balanced but unstable shape, in spacings. */
#define KICK 2e-3

const char *morph_settle_outcome_text(morph_settle_outcome outcome) {
    static const char *const text[] = {"at rest",
                                       "no rest: it has left the target and falls, nothing is beneath it",
                                       "not at rest: it still slides or falls after the most steps allowed",
                                       "not at rest: contacts or limits change to and fro, forces are left "
                                       "over after the most steps allowed"};
    return outcome >= MORPH_SETTLE_RESTS && outcome <= MORPH_SETTLE_STALLS ? text[outcome] : "unknown";
}

static double largest_force(const morph_settle *s) {
    double most = 0.0;
    for (int j = 0; j < s->joints; j++)
        most = fmax(most, morph_norm(&s->g[3 * j]));
    return most;
}

static double largest_move(const morph_settle *s, const double *to) {
    double most = 0.0;
    for (int j = 0; j < s->joints; j++)
        most = fmax(most, morph_dist(&to[3 * j], &s->before[3 * j]));
    return most;
}

/* Factors SAFE + share (EXACT - SAFE) at x with the first share of 1, 1/2, 1/4, 0 at which it is positive
 * definite (drag sees to it at 0), beginning one above that of the last time: failed tries cost as much as
 * good ones. */
static morph_status factor(morph_settle *s, double *energy) {
    const size_t nonzeros = (size_t)s->start[3 * s->joints];
    *energy = morph_settle_evaluate(s, s->x, MORPH_SETTLE_SAFE);
    if (!isfinite(*energy)) return MORPH_ERR_NONFINITE;
    memcpy(s->spare, s->value, nonzeros * sizeof *s->spare);
    morph_settle_evaluate(s, s->x, MORPH_SETTLE_EXACT);
    double share = 1.0, next = fmin(1.0, s->share > 0.0 ? 2.0 * s->share : LEAST_SHARE);
    for (int column = 0;; next = next > LEAST_SHARE ? 0.5 * next : 0.0) {
        for (size_t k = 0; k < nonzeros && next < share; k++)
            s->value[k] = s->spare[k] + next / share * (s->value[k] - s->spare[k]);
        share = next;
        const double since = morph_seconds();
        const morph_status status = morph_sparse_factor(s->sparse, s->value, &column);
        s->linear_seconds += morph_seconds() - since;
        if (status != MORPH_OK) return status;
        s->share = share;
        if (column < 0) return MORPH_OK;
        if (share == 0.0) return MORPH_ERR_NONFINITE;
    }
}

/* Armijo's rule by halving; energies closer than rounding count as equal. */
static bool search(morph_settle *s, double energy, double slope, double scale) {
    const double noise = 1e-13 * (1.0 + fabs(energy));
    for (int k = 0; k < MOST_HALVINGS; k++, scale *= 0.5) {
        for (int i = 0; i < 3 * s->joints; i++)
            s->trial[i] = s->x[i] - scale * s->d[i];
        const double there = morph_settle_evaluate(s, s->trial, MORPH_SETTLE_VALUE);
        if (!(there <= energy - 1e-4 * scale * slope + noise)) continue;
        memcpy(s->x, s->trial, 3 * (size_t)s->joints * sizeof(double));
        return true;
    }
    return false;
}

/* Minimises the step's energy from s->x. *good: the gradient fell as far as asked. Where Newton's step is far
 * too long or finds no lower energy, the drag is raised: along motions that nothing resists, curved limits
 * allow short steps only. */
static morph_status newton(morph_settle *s, double target, bool *good) {
    *good = false;
    for (int k = 0;; k++) {
        double energy, most = 0.0, slope = 0.0;
        morph_settle_evaluate(s, s->x, MORPH_SETTLE_GRADIENT);
        *good = largest_force(s) <= target;
        if (*good || k == MOST_NEWTONS || largest_move(s, s->x) > MOST_MOVE) return MORPH_OK;
        morph_status status = factor(s, &energy);
        if (status != MORPH_OK) return status;
        const double since = morph_seconds();
        status = morph_sparse_solve(s->sparse, s->g, s->d, NULL);
        s->linear_seconds += morph_seconds() - since;
        if (status != MORPH_OK) return status;
        s->iterations++;
        for (int j = 0; j < s->joints; j++) {
            slope += morph_dot(&s->g[3 * j], &s->d[3 * j]);
            most = fmax(most, morph_norm(&s->d[3 * j]));
        }
        const bool found = search(s, energy, slope, most > MOST_NEWTON ? MOST_NEWTON / most : 1.0);
        if (!found || most > 10.0 * MOST_NEWTON) s->drag = fmin(4.0 * s->drag, 1e6);
    }
}

/* Forces left over with the multipliers as they are, without drag. */
static double residual(morph_settle *s) {
    const double drag = s->drag;
    s->form = MORPH_SETTLE_PLAIN;
    s->drag = 0.0;
    morph_settle_evaluate(s, s->x, MORPH_SETTLE_GRADIENT);
    s->form = MORPH_SETTLE_AUGMENTED;
    s->drag = drag;
    return largest_force(s);
}

/* In weights where there is weight, as far as rounding beside the centres' pull lets forces balance. */
static double enough(const morph_settle *s) {
    const double part = s->weight > 0.0 ? fmin(1.0, fmax(s->weight, 1e-3)) : 1.0;
    return fmax(s->tolerance * part, fmin(s->tolerance, ROUNDING));
}

static void penalties(morph_settle *s, double factor) {
    s->stiff *= factor;
    s->stiff_length *= factor;
    s->stiff_angle *= factor;
}

/* Knuth's generator: the same kick on every machine. */
static void kick(morph_settle *s, int saddle) {
    unsigned long long state = 88172645463325252ull + (unsigned long long)saddle;
    for (int i = 0; i < 3 * s->joints; i++) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        const double share = (double)(state >> 11) / 9007199254740992.0;
        if (!s->fixed[i / 3]) s->x[i] += KICK * (2.0 * share - 1.0);
    }
    s->drag = FIRST_DRAG;
}

/* One implicit step: Newton, multipliers and cones anew, until they hold well enough that friction has acted
 * on the step's own motion (a contact made in this step holds from its second round on). Returns in *worst
 * the violation left. */
static morph_status step(morph_settle *s, double residual, double *worst, bool *good) {
    const double target = fmax(FORCING * residual, 0.1 * enough(s));
    for (int round = 0; round < MOST_ROUNDS; round++) {
        const morph_status status = newton(s, target, good);
        if (status != MORPH_OK) return status;
        const double last = *worst;
        if (*good || round == 0) *worst = morph_settle_update(s, s->x);
        if (!*good) break;
        morph_settle_evaluate(s, s->x, MORPH_SETTLE_GRADIENT);
        if (largest_force(s) <= 3.0 * target) break;
        if (round > 0 && *worst > 0.25 * last && *worst > HELD && s->stiff < MOST_PENALTY) penalties(s, 4.0);
    }
    morph_settle_slide(s, s->x);
    return MORPH_OK;
}

/* Steps grow as the forces left over fall, and shrink where Newton cannot follow. */
static void next_drag(morph_settle *s, bool good, double move, double residual, double last) {
    if (!good || move > 0.75 * MOST_MOVE || residual > 4.0 * last)
        s->drag *= 2.0;
    else if (residual < 0.5 * last && move < 0.25 * MOST_MOVE)
        s->drag = fmax(s->least_drag, s->drag / 8.0);
    else if ((residual <= last && move < 0.5 * MOST_MOVE) ||
             (residual <= STEADY * last && move < 0.25 * MOST_MOVE))
        s->drag = fmax(s->least_drag, s->drag / 2.0);
}

/* Near rest, where multipliers converge too slowly, penalties grow; they fall again where the shape still has
 * to move along its curved limits, which stiff ones forbid to Newton, and limits are held well. */
static void next_penalty(morph_settle *s, bool good, double move, double residual, double last,
                         double worst) {
    const double force = s->stiff * worst;
    if (good && move < CLOSE && residual > 0.5 * last && force > 0.3 * residual &&
        s->drag * move < 0.3 * residual && s->stiff < LAST_PENALTY)
        penalties(s, 4.0);
    else if (s->stiff > MOST_PENALTY && (move > 10.0 * CLOSE || s->drag * move > 0.3 * residual))
        penalties(s, fmax(0.25, MOST_PENALTY / s->stiff));
}

/* Where the forces left over find no new low for PATIENCE steps, the steps are too long for the contacts,
 * which are planes within one: the least drag goes up until they do. */
static void watch_progress(morph_settle *s, double residual) {
    if (residual < 0.8 * s->best) {
        s->best = residual;
        s->best_age = 0;
        s->least_drag = fmax(LEAST_DRAG, s->least_drag / 4.0);
    } else if (++s->best_age >= PATIENCE) {
        s->best = residual;
        s->best_age = 0;
        s->least_drag = fmin(MOST_LEAST_DRAG, 4.0 * s->least_drag);
        s->drag = fmax(s->drag, s->least_drag);
        if (s->least_drag >= MOST_LEAST_DRAG) s->least_cone = fmax(LAST_CONE, CALMER * s->least_cone);
    }
}

/* Nothing that could end a fall: no centre, no held joint, no plane, no contact, and, for as many steps as
 * count, the target further away after each (a free step goes a quarter of a spacing down). */
static bool falls(morph_settle *s) {
    double near = INFINITY;
    if (s->attractors > 0 || !isnan(s->base) || !(s->weight > 0.0)) return false;
    for (int j = 0; j < s->joints; j++)
        if (s->fixed[j]) return false;
    bool held = false;
    for (int n = 0; n < s->places; n++)
        held = held || s->place[n].push > 0.0;
    for (int j = 0; j < s->joints && s->sdf; j++) {
        double p[3];
        for (int k = 0; k < 3; k++)
            p[k] = s->x[3 * j + k] * s->length_unit;
        near = fmin(near, morph_sdf_eval(s->sdf, p, NULL, NULL));
    }
    s->falling = !held && !(near < s->nearest) ? s->falling + 1 : 0;
    s->nearest = near;
    return s->falling >= (s->sdf ? FALLING : 1);
}

static void start_run(morph_settle *s) {
    s->drag = FIRST_DRAG;
    s->share = 1.0;
    s->least_drag = LEAST_DRAG;
    s->best = INFINITY;
    s->best_age = 0;
    s->least_cone = FIRST_CONE;
    s->falling = 0;
    s->nearest = INFINITY;
}

static morph_status run(morph_settle *s, const morph_control *control, morph_settle_report *r) {
    double worst = INFINITY, move = INFINITY, last = INFINITY;
    bool good = true;
    start_run(s);
    for (r->steps = 0; r->steps < s->most_steps; r->steps++) {
        if (morph_stopped(control)) return MORPH_ERR_STOPPED;
        const double deep = morph_settle_seek(s, s->x, fmax(0.5 * CLEAR, fmin(1e-3, 0.1 * move)));
        morph_settle_begin(s, s->x);
        memcpy(s->before, s->x, 3 * (size_t)s->joints * sizeof(double));
        r->residual = residual(s);
        if (r->residual <= enough(s) && worst <= HELD && deep <= CLEAR) {
            r->outcome = MORPH_SETTLE_RESTS;
            const morph_status status = morph_settle_examine(s, &r->stable);
            if (status != MORPH_OK || r->stable || r->saddles == MOST_SADDLES) return status;
            kick(s, r->saddles++);
        }
        r->outcome = falls(s)                             ? MORPH_SETTLE_FALLS
                     : s->drag * move > 0.3 * r->residual ? MORPH_SETTLE_MOVES
                                                          : MORPH_SETTLE_STALLS;
        if (r->outcome == MORPH_SETTLE_FALLS) return MORPH_OK;
        if (r->steps > 0) {
            next_penalty(s, good, move, r->residual, last, worst);
            next_drag(s, good, move, r->residual, last);
            watch_progress(s, r->residual);
        } else /* a start close to rest, as a warm one, need not creep there */
            s->drag = fmin(FIRST_DRAG, fmax(LEAST_DRAG, FIRST_DRAG * r->residual));
        last = r->residual;
        const morph_status status = step(s, fmax(last, worst < 1.0 ? worst : 0.0), &worst, &good);
        if (status != MORPH_OK) return status;
        move = largest_move(s, s->x);
    }
    return MORPH_OK;
}

double morph_settle_energy(const morph_settle *s, const double *x) {
    const morph_structure *st = s->structure;
    double energy = 0.0;
    for (int j = 0; j < s->joints; j++) {
        double at[3];
        for (int k = 0; k < 3; k++)
            at[k] = x[3 * j + k] / s->length_unit;
        energy += s->weight * at[2];
        for (int m = 0; m < s->attractors; m++)
            energy += morph_attraction(&s->attractor[m], s->softening, at, NULL, NULL);
    }
    for (int l = 0; l < st->links; l++) {
        const double stretch =
            (morph_dist(&x[3 * st->link[l][0]], &x[3 * st->link[l][1]]) - st->start_length[l]) /
            s->length_unit;
        energy += 0.5 * s->spring * stretch * stretch;
    }
    return energy * s->load * s->length_unit;
}

/* By the shape alone: the solver's own figures do not enter. */
static void measure(morph_settle *s, const double *x, morph_settle_report *r) {
    const morph_structure *st = s->structure;
    for (int l = 0; l < st->links; l++) {
        const double length = morph_dist(&x[3 * st->link[l][0]], &x[3 * st->link[l][1]]);
        r->worst_length =
            fmax(r->worst_length, fmax(st->length_limit[l][0] - length, length - st->length_limit[l][1]));
    }
    for (int p = 0; p < st->posts; p++) {
        const double length = morph_dist(&x[3 * st->post[p][0]], &x[3 * st->post[p][1]]);
        r->worst_post = fmax(r->worst_post, fabs(length / st->post_length[p] - 1.0));
    }
    for (int t = 0; t < s->angles; t++) {
        const double c = morph_settle_angle_value(&s->angle[t], x);
        r->worst_angle = fmax(r->worst_angle, fmax(s->angle[t].floor - c, c - s->angle[t].ceiling));
    }
    r->worst_clearance = s->length_unit * morph_settle_seek(s, s->x, INFINITY);
    for (int j = 0; j < s->joints && !isnan(s->base); j++)
        r->worst_clearance =
            fmax(r->worst_clearance, s->base * s->length_unit + st->def.radius - x[3 * j + 2]);
    for (int n = 0; n < s->places; n++)
        r->contacts += s->place[n].push > MORPH_SETTLE_LEAST_PUSH;
    r->energy = morph_settle_energy(s, x);
    r->load = s->load;
    if (s->weight > 0.0) r->residual /= s->weight;
    r->converged = r->outcome == MORPH_SETTLE_RESTS;
}

morph_status morph_settle_run(morph_settle *s, double *x, bool warm, const morph_control *control,
                              morph_settle_report *report) {
    const double since = morph_seconds();
    morph_settle_report r = {.outcome = MORPH_SETTLE_STALLS};
    for (int k = 0; k < 3 * s->joints; k++)
        if (!isfinite(x[k])) return MORPH_ERR_NONFINITE;
    for (int k = 0; k < 3 * s->joints; k++)
        s->x[k] = x[k] / s->length_unit;
    s->factored = false;
    s->iterations = 0;
    s->linear_seconds = 0.0;
    if (!warm) morph_settle_forget(s);
    morph_settle_penalties(s);
    const morph_status status = run(s, control, &r);
    if (status == MORPH_OK || status == MORPH_ERR_STOPPED) {
        for (int k = 0; k < 3 * s->joints; k++)
            x[k] = s->x[k] * s->length_unit;
        measure(s, x, &r);
    }
    const morph_sparse_size size = morph_sparse_sizes(s->sparse);
    r.iterations = s->iterations;
    r.factorisations = size.factorisations;
    r.analyses = size.analyses;
    r.linear_seconds = s->linear_seconds;
    r.seconds = morph_seconds() - since;
    if (report) *report = r;
    return status;
}
