#include "planner/placement_trial.h"

#include "planner/guide.h"
#include "planner/stiffness.h"

#include <stdlib.h>
#include <string.h>

static size_t width(const morph_placer *p) {
    return 3 * (size_t)p->w->structure->joints;
}

bool morph_placer_late(const morph_placer *p) {
    return p->options->seconds > 0.0 && morph_seconds() - p->started > p->options->seconds;
}

double morph_placer_left(const morph_placer *p) {
    if (p->options->seconds <= 0.0) return 0.0;
    return fmax(0.01, p->options->seconds - (morph_seconds() - p->started));
}

void morph_placer_stand(morph_placer *p, const double *x) {
    for (size_t i = 0; i < width(p); i++) {
        p->x[i] = x[i];
        p->scaled[i] = x[i] / p->w->structure->spacing;
    }
}

double morph_placer_objective(const morph_placer *p, const morph_measure *m) {
    const double a = p->w->structure->spacing;
    return m->objective / (a * a * a * a);
}

const double *morph_placer_end(const morph_placer *p, const morph_trajectory *t) {
    return &t->x[(size_t)(t->frames - 1) * width(p)];
}

double morph_placer_apart(const morph_placer *p, const double *x, const double *y) {
    double squares = 0.0;
    for (size_t i = 0; i < width(p); i++)
        squares += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(3.0 * squares / (double)width(p)) / p->w->structure->spacing;
}

morph_status morph_placer_adopt(morph_placer *p, const morph_attractor *centre, int centres, double epsilon,
                                morph_balance **b, morph_rest *rest) {
    const morph_balance_load load = {p->scene->motion.gravity, 0.0};
    morph_attractor scaled[MORPH_MOST_CENTRES];
    *rest = (morph_rest){0};
    morph_status status = morph_balance_create(&p->w->world, &load, centres, b);
    if (status != MORPH_OK) return status;
    (*b)->hold = p->options->hold;
    for (int m = 0; m < centres; m++)
        scaled[m] = morph_balance_scaled(*b, &centre[m]);
    status = morph_rest_adopt(*b, scaled, epsilon, p->scaled, &p->quiet, rest);
    /* Where there is no minimum the program would leave for anywhere; where no hold makes one it may try. */
    bool definite;
    if (status == MORPH_OK) status = morph_stiffness_raise_hold(*b, rest->z, &definite);
    p->out->largest_force = 0.0;
    for (size_t i = 0; i < width(p) && status == MORPH_OK; i++)
        p->out->largest_force = fmax(p->out->largest_force, fabs((*b)->force[i]));
    return status;
}

/* Runs the blanket under the trial's centres, from x (m), or from the start where x is NULL. */
static morph_status ask(morph_placer *p, const double *x, morph_trial *t) {
    morph_status status =
        morph_guided_run(p->w, p->scene, x, t->centre, t->centres, &p->quiet, &t->way, NULL);
    if (status == MORPH_OK)
        status = morph_cavity_measure(p->w->cavity, morph_placer_end(p, &t->way), &t->measure);
    return status;
}

morph_status morph_trial_judge(morph_placer *p, const morph_balance *b, const double *z, morph_trial *t) {
    const double a = p->w->structure->spacing;
    t->centres = b->centres;
    for (int m = 0; m < b->centres; m++) {
        morph_attractor c = {.strength = z[morph_balance_strength(b) + m]};
        memcpy(c.at, &z[morph_balance_centre(b) + 3 * m], sizeof c.at);
        t->centre[m] = morph_balance_physical(b, &c);
    }
    double *shape = morph_alloc(width(p), sizeof *shape);
    if (!shape) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < width(p); i++)
        shape[i] = a * z[i];
    morph_measure predicted;
    morph_status status = morph_cavity_measure(p->w->cavity, shape, &predicted);
    t->predicted = morph_placer_objective(p, &predicted);
    if (status == MORPH_OK) status = ask(p, p->x, t);
    if (status == MORPH_OK) t->difference = morph_placer_apart(p, morph_placer_end(p, &t->way), shape);
    free(shape);
    return status;
}

morph_status morph_trial_accept(morph_placer *p, morph_trial *t) {
    morph_placement *out = p->out;
    memcpy(out->centre, t->centre, sizeof out->centre);
    out->centres = t->centres;
    out->reached = t->measure;
    p->objective = morph_placer_objective(p, &t->measure);
    morph_placer_stand(p, morph_placer_end(p, &t->way));
    return morph_trajectory_append(&out->guided, &t->way);
}

/* The same where a run that cannot be followed says no more than that these centres are none: *good. */
static morph_status try_one(morph_placer *p, const double *x, morph_trial *t, bool *good) {
    const morph_status status = ask(p, x, t);
    *good = status == MORPH_OK;
    if (!*good) morph_trajectory_free(&t->way);
    return status == MORPH_ERR_NONFINITE || status == MORPH_ERR_MOTION ? MORPH_OK : status;
}

/* How far along a program's way the blanket is asked at most, and by which factor a strength may change: four
 * times as far tore sheets off more often than it helped where the strength went along freely. */
#define FARTHEST 4.0
#define MOST_STRONGER 4.0
/* A run of the blanket costs about as much as a program: another is made for a gain above this part. */
#define WORTH 0.03

/* Centres `factor` times as far from `from` as `to` is; strengths by that power of their ratio. */
static void set_along(const morph_placer *p, const morph_attractor *from, const morph_attractor *to,
                      double factor, morph_trial *t) {
    const double a = p->w->structure->spacing, most = p->options->strongest * p->unit * a * a;
    for (int m = 0; m < t->centres; m++) {
        const double ratio = pow(to[m].strength / from[m].strength, factor);
        for (int k = 0; k < 3; k++)
            t->centre[m].at[k] = from[m].at[k] + factor * (to[m].at[k] - from[m].at[k]);
        t->centre[m].strength =
            fmin(most, from[m].strength * fmin(MOST_STRONGER, fmax(1.0 / MOST_STRONGER, ratio)));
    }
}

void morph_branch_free(morph_branch *branch) {
    morph_trajectory_free(&branch->before.guided);
    morph_trajectory_free(&branch->step.way);
    *branch = (morph_branch){0};
}

static morph_status copy_trajectory(const morph_trajectory *t, morph_trajectory *out) {
    const size_t frames = (size_t)t->frames, all = 3 * (size_t)t->joints * frames;
    *out = (morph_trajectory){.frames = t->frames, .joints = t->joints};
    out->time = morph_alloc(frames, sizeof *out->time);
    out->x = morph_alloc(all, sizeof *out->x);
    out->lift = morph_alloc(frames, sizeof *out->lift);
    if (!out->time || !out->x || !out->lift) {
        morph_trajectory_free(out);
        return MORPH_ERR_NOMEM;
    }
    memcpy(out->time, t->time, frames * sizeof *out->time);
    memcpy(out->x, t->x, all * sizeof *out->x);
    memcpy(out->lift, t->lift, frames * sizeof *out->lift);
    return MORPH_OK;
}

/* Before the first leap: how the placement stands, and the step, whose frames become the branch's. */
static morph_status keep_branch(morph_placer *p, morph_trial *step) {
    morph_branch *b = &p->branch;
    b->before = *p->out;
    b->objective = p->objective;
    const morph_status status = copy_trajectory(&p->out->guided, &b->before.guided);
    b->step = *step;
    step->way = (morph_trajectory){0};
    return status;
}

morph_status morph_trial_branch(morph_placer *p) {
    const morph_placement spent = *p->out;
    *p->out = p->branch.before;
    p->branch.before.guided = (morph_trajectory){0};
    p->out->rounds = spent.rounds;
    p->out->accepted = spent.accepted;
    p->out->effort = spent.effort;
    p->objective = p->branch.objective;
    morph_placer_stand(p, morph_placer_end(p, &p->out->guided));
    return morph_trial_accept(p, &p->branch.step);
}

/* The program sees as far as springs say true of friction: what it holds back may slide on. */
morph_status morph_trial_along(morph_placer *p, const morph_attractor *from, morph_trial *best) {
    morph_attractor to[MORPH_MOST_CENTRES];
    const double reached = morph_placer_objective(p, &best->measure);
    const bool farther = reached < p->objective;
    bool again = (farther ? reached : best->predicted) < (1.0 - WORTH) * p->objective;
    morph_status status = MORPH_OK;
    memcpy(to, best->centre, sizeof to);
    for (double factor = farther ? 2.0 : 0.5; again && factor <= FARTHEST && !morph_placer_late(p);
         factor *= 2.0) {
        morph_trial t = {.centres = best->centres};
        set_along(p, from, to, factor, &t);
        bool good;
        status = try_one(p, p->x, &t, &good);
        again = false;
        if (!good) break;
        morph_log(p->options->control, "placement: %g times as far: %.4g", factor,
                  morph_placer_objective(p, &t.measure));
        again = farther && t.measure.objective < (1.0 - WORTH) * best->measure.objective;
        if (t.measure.objective < best->measure.objective) {
            if (farther && !p->leapt) status = keep_branch(p, best);
            morph_trajectory_free(&best->way);
            *best = t;
            p->leapt |= farther;
            if (status != MORPH_OK) break;
        } else {
            morph_trajectory_free(&t.way);
        }
    }
    return status;
}

/* The trial takes the place of the way on which its centres were found. */
static void replace(morph_placer *p, morph_trial *t) {
    morph_placement *out = p->out;
    morph_trajectory_free(&out->guided);
    out->guided = t->way;
    t->way = (morph_trajectory){0};
    memcpy(out->centre, t->centre, sizeof out->centre);
    out->reached = t->measure;
    p->objective = morph_placer_objective(p, &t->measure);
    morph_placer_stand(p, morph_placer_end(p, &out->guided));
}

morph_status morph_trial_afresh(morph_placer *p) {
    static const double stronger[] = {1.0, 0.5};
    morph_status status = MORPH_OK;
    bool better = false;
    for (int k = 0; k < 2 && !better && status == MORPH_OK && !morph_placer_late(p); k++) {
        morph_trial t = {.centres = p->out->centres};
        memcpy(t.centre, p->out->centre, sizeof t.centre);
        for (int m = 0; m < t.centres; m++)
            t.centre[m].strength *= stronger[k];
        bool good;
        status = try_one(p, NULL, &t, &good);
        if (!good) continue;
        const double reached = morph_placer_objective(p, &t.measure);
        morph_log(p->options->control,
                  "placement: from the start, %g times as strong: objective %.4g, reached %.4g", stronger[k],
                  p->objective, reached);
        better = reached < p->objective;
        if (better) replace(p, &t);
        morph_trajectory_free(&t.way);
    }
    return status;
}
