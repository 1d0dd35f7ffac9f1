#include "planner/placement.h"

#include "planner/guide.h"
#include "planner/placement_rounds.h"
#include "planner/stiffness.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

morph_placement_options morph_placement_defaults(void) {
    /* hold: a joint's friction at the default coefficient, about half its weight, is spent within a twentieth
     * of a spacing; softer springs (2) left rounds at saddles, and were slower. epsilon: a limit a tenth of a
     * spacing away carries a hundredth of a weight.
     * The last program's epsilon is below a millionth, as what is left counts as no force at a distance; its
     * reach is what springs say true of friction for, and near enough to start with contacts that hard. */
    return (morph_placement_options){.evaluations = 60,
                                     .cover_weight = MORPH_COVER_WEIGHT,
                                     .slide = 0.1,
                                     .reach = 0.3,
                                     .least_gain = 0.02,
                                     .least_growth = 0.05,
                                     .strongest = 60.0,
                                     .thrift = 1e-7,
                                     .hold = 10.0,
                                     .last_reach = 0.003,
                                     .epsilon = 1e-3,
                                     .last_epsilon = 9e-7,
                                     .iterations = 60,
                                     .last_iterations = 250,
                                     .rounds = 8,
                                     .most_centres = 3};
}

void morph_placement_free(morph_placement *p) {
    morph_trajectory_free(&p->guided);
    *p = (morph_placement){0};
}

typedef struct placer {
    const morph_workspace *w;
    const morph_scene *scene;
    const morph_placement_options *options;
    morph_placement *out;
    double unit, reach;
    double *x, *scaled; /* coordinates: where the blanket rests, m, and in spacings */
    double objective;   /* there */
    morph_control quiet;
    double started;
} placer;

static size_t width(const placer *p) {
    return 3 * (size_t)p->w->structure->joints;
}

static double scaled_objective(const placer *p, const morph_measure *m) {
    const double a = p->w->structure->spacing;
    return m->objective / (a * a * a * a);
}

static void stand_at(placer *p, const double *x) {
    for (size_t i = 0; i < width(p); i++) {
        p->x[i] = x[i];
        p->scaled[i] = x[i] / p->w->structure->spacing;
    }
}

static const double *last_of(const placer *p, const morph_trajectory *t) {
    return &t->x[(size_t)(t->frames - 1) * width(p)];
}

/* Root mean square distance of joints, spacings; x, y in metres. */
static double apart(const placer *p, const double *x, const double *y) {
    double squares = 0.0;
    for (size_t i = 0; i < width(p); i++)
        squares += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(3.0 * squares / (double)width(p)) / p->w->structure->spacing;
}

static bool late(const placer *p) {
    return p->options->seconds > 0.0 && morph_seconds() - p->started > p->options->seconds;
}

static morph_status run_seeds(placer *p) {
    morph_placement *out = p->out;
    memcpy(out->centre, out->seed, sizeof out->centre);
    out->centres = out->seeds;
    morph_status status =
        morph_guided_run(p->w, p->scene, NULL, out->seed, out->seeds, &p->quiet, &out->guided, NULL);
    if (status == MORPH_OK) stand_at(p, last_of(p, &out->guided));
    if (status == MORPH_OK) status = morph_cavity_measure(p->w->cavity, p->x, &out->seeded);
    out->reached = out->seeded;
    p->objective = scaled_objective(p, &out->seeded);
    return status;
}

/* A balance in which the blanket rests where it lies, under these centres. */
static morph_status adopt(placer *p, const morph_attractor *centre, int centres, double epsilon,
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

static morph_status propose_program(const morph_workspace *w, morph_balance *b,
                                    const morph_placement_options *options, double moves, double seconds,
                                    const morph_rest *rest, double **z, morph_nlp_result *result) {
    (void)seconds; /* its iterations are limited */
    return morph_placement_program(w, b, options, moves, rest, z, result);
}

static morph_proposal proposal_of(const morph_placement_options *o) {
    static const morph_proposal by[MORPH_PLACE_METHODS] = {propose_program, morph_propose_free,
                                                           morph_propose_gradient};
    return by[o->method];
}

/* Of the options' time, what is left; 0: no limit. */
static double time_left(const placer *p) {
    if (p->options->seconds <= 0.0) return 0.0;
    return fmax(0.01, p->options->seconds - (morph_seconds() - p->started));
}

/* What a program found, judged by the blanket. */
typedef struct trial {
    int centres;
    morph_attractor centre[MORPH_MOST_CENTRES];
    morph_trajectory way;
    morph_measure measure;
    double difference, predicted;
} trial;

/* Runs the blanket on under the centres of z, and compares where it ends with the shape in z. */
static morph_status judge(placer *p, const morph_balance *b, const double *z, trial *t) {
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
    t->predicted = scaled_objective(p, &predicted);
    if (status == MORPH_OK)
        status = morph_guided_run(p->w, p->scene, p->x, t->centre, t->centres, &p->quiet, &t->way, NULL);
    if (status == MORPH_OK) {
        const double *end = last_of(p, &t->way);
        t->difference = apart(p, end, shape);
        status = morph_cavity_measure(p->w->cavity, end, &t->measure);
    }
    free(shape);
    return status;
}

static morph_status accept(placer *p, trial *t) {
    morph_placement *out = p->out;
    memcpy(out->centre, t->centre, sizeof out->centre);
    out->centres = t->centres;
    out->reached = t->measure;
    p->objective = scaled_objective(p, &t->measure);
    stand_at(p, last_of(p, &t->way));
    return morph_trajectory_append(&out->guided, &t->way);
}

/* One round from where the blanket rests: *gain is what the blanket gained, 0 if nothing. */
static morph_status round_of(placer *p, const morph_attractor *centre, int centres, double *gain) {
    morph_balance *b = NULL;
    morph_rest rest;
    morph_nlp_result result = {0};
    double *z = NULL;
    trial t = {0};
    *gain = 0.0;
    morph_status status = adopt(p, centre, centres, p->options->epsilon, &b, &rest);
    if (status == MORPH_OK)
        status = proposal_of(p->options)(p->w, b, p->options, p->reach, time_left(p), &rest, &z, &result);
    if (status == MORPH_OK) {
        morph_effort_add(&p->out->effort, &result);
        status = judge(p, b, z, &t);
    }
    if (status == MORPH_OK) {
        const double reached = scaled_objective(p, &t.measure);
        morph_log(
            p->options->control,
            "placement: %d centre%s, reach %.2f: %s, %d iterations, %d unknowns, %.1f s; objective %.4g, "
            "predicted %.4g, reached %.4g, %.3f spacings apart",
            centres, centres == 1 ? "" : "s", p->reach, result.solver_text, result.iterations,
            result.unknowns, result.seconds, p->objective, t.predicted, reached, t.difference);
        if (reached < p->objective) {
            *gain = p->objective - reached;
            status = accept(p, &t);
            p->out->accepted++;
        }
    }
    p->out->rounds++;
    morph_trajectory_free(&t.way);
    morph_nlp_result_free(&result);
    morph_rest_free(&rest);
    morph_balance_destroy(b);
    free(z);
    return status;
}

/* A round that had no success with this has no other to hope for: steps as short as friction holds. */
#define LEAST_REACH 0.15

/* Rounds with a number of centres until they gain little. The first starts from `centre`. */
static morph_status rounds(placer *p, const morph_attractor *centre, int centres) {
    morph_status status = MORPH_OK;
    morph_attractor from[MORPH_MOST_CENTRES];
    memcpy(from, centre, sizeof from);
    p->reach = p->options->reach;
    while (status == MORPH_OK && p->out->rounds < p->options->rounds && p->reach > LEAST_REACH) {
        const double before = p->objective;
        double gain;
        status = round_of(p, from, centres, &gain);
        if (morph_stopped(p->options->control)) return MORPH_ERR_STOPPED;
        morph_progress(p->options->control, "placement", p->out->rounds / (double)p->options->rounds);
        if (late(p)) break;
        if (gain > 0.0 && gain < p->options->least_gain * before) break;
        p->reach *= gain > 0.0 ? 1.25 : 0.5;
        p->reach = fmin(p->reach, 0.4);
        if (gain > 0.0) memcpy(from, p->out->centre, sizeof from);
    }
    return status;
}

/* A further centre beneath the largest cavity that is left, weak at first: as long as that pays. */
static morph_status grow(placer *p) {
    morph_status status = MORPH_OK;
    const double a = p->w->structure->spacing;
    while (status == MORPH_OK && p->out->centres < p->options->most_centres && !late(p) &&
           p->out->rounds < p->options->rounds) {
        morph_attractor centre[MORPH_MOST_CENTRES], more[1];
        const double before = p->objective;
        int found = 0;
        memcpy(centre, p->out->centre, sizeof centre);
        status = morph_seed_centres(p->w, p->x, p->unit, 1, more, &found);
        if (status != MORPH_OK || found == 0) break;
        more[0].strength = p->unit * a * a;
        centre[p->out->centres] = more[0];
        status = rounds(p, centre, p->out->centres + 1);
        if (before - p->objective < p->options->least_growth * before) break;
    }
    return status;
}

/* Friction lets a sheet creep that has come to rest as far as frames tell. Under the same centres it goes on
 * until that moves it by less than this, rms over the joints, spacings: what a program then says can be held
 * against it. */
#define CREEP 0.01
enum { MOST_CREEPS = 6 };

/* *way: the frames of that, from where the rounds ended. */
static morph_status settle_down(placer *p, morph_trajectory *way) {
    const morph_placement *out = p->out;
    double moved = INFINITY;
    morph_status status = MORPH_OK;
    for (int k = 0; k < MOST_CREEPS && moved > CREEP && !late(p) && status == MORPH_OK; k++) {
        morph_trajectory more = {0};
        status = morph_guided_run(p->w, p->scene, p->x, out->centre, out->centres, &p->quiet, &more, NULL);
        if (status == MORPH_OK) {
            moved = apart(p, last_of(p, &more), p->x);
            stand_at(p, last_of(p, &more));
            if (k > 0) status = morph_trajectory_append(way, &more);
        }
        if (k == 0 && status == MORPH_OK)
            *way = more;
        else
            morph_trajectory_free(&more);
    }
    morph_log(p->options->control, "placement: at rest but for %.3f spacings", moved);
    return status;
}

/* The last program, with contacts as hard as they are: what the rounds' smoothing left is shown here. Its
 * centres are kept if the blanket agrees. */
static morph_status conclude(placer *p) {
    morph_placement *out = p->out;
    morph_balance *b = NULL;
    morph_rest rest = {0};
    morph_nlp_result result = {0};
    double *z = NULL;
    trial t = {0};
    morph_placement_options o = *p->options;
    o.epsilon = o.last_epsilon;
    o.iterations = o.last_iterations;
    morph_trajectory still = {0};
    morph_status status = settle_down(p, &still);
    if (status == MORPH_OK) status = adopt(p, out->centre, out->centres, o.epsilon, &b, &rest);
    /* So little reach may leave contacts no room to close: then a little more. */
    for (int k = 0; k < 2 && status == MORPH_OK && !out->solved; k++, o.last_reach *= 3.0) {
        free(z);
        morph_nlp_result_free(&result);
        status = proposal_of(&o)(p->w, b, &o, o.last_reach, time_left(p), &rest, &z, &result);
        if (status != MORPH_OK) break;
        morph_effort_add(&out->effort, &result);
        out->solved = result.outcome == MORPH_OPTIMAL;
    }
    if (status == MORPH_OK) status = morph_balance_examine(b, z, &out->balance);
    if (status == MORPH_OK) status = judge(p, b, z, &t);
    if (status == MORPH_OK) {
        out->predicted_objective = t.predicted;
        out->difference = t.difference;
        morph_log(
            p->options->control,
            "placement: last: %s, %d iterations; residual %.1e, complementarity %.1e, %s; objective %.4g, "
            "predicted %.4g, reached %.4g, %.3f spacings apart",
            result.solver_text, result.iterations, out->balance.residual, out->balance.complementarity,
            out->balance.stable ? "stable" : "not stable", p->objective, t.predicted,
            scaled_objective(p, &t.measure), t.difference);
        if (!out->solved)
            snprintf(out->reason, sizeof out->reason, "the last program: %s", result.solver_text);
        else if (!out->balance.stable)
            snprintf(out->reason, sizeof out->reason, "the last program ended at a saddle");
        if (scaled_objective(p, &t.measure) < p->objective) {
            if (still.frames > 0) status = morph_trajectory_append(&out->guided, &still);
            if (status == MORPH_OK) status = accept(p, &t);
        }
    }
    morph_trajectory_free(&still);
    morph_trajectory_free(&t.way);
    morph_nlp_result_free(&result);
    morph_rest_free(&rest);
    morph_balance_destroy(b);
    free(z);
    return status;
}

static morph_status place(placer *p, const double *x0) {
    morph_placement *out = p->out;
    morph_status status = morph_seed_centres(p->w, x0, p->unit, 1, out->seed, &out->seeds);
    if (status != MORPH_OK) return status;
    if (out->seeds == 0) {
        snprintf(out->reason, sizeof out->reason, "the blanket leaves no cavity");
        return MORPH_OK;
    }
    status = run_seeds(p);
    if (status == MORPH_OK) status = rounds(p, out->seed, out->seeds);
    if (status == MORPH_OK) status = grow(p);
    if (status == MORPH_OK) status = conclude(p);
    return status;
}

morph_status morph_placement_run(const morph_workspace *w, const morph_scene *scene, const double *x0,
                                 const morph_placement_options *options, morph_placement *out) {
    *out = (morph_placement){0};
    placer p = {.w = w, .scene = scene, .options = options, .out = out, .started = morph_seconds()};
    p.unit = morph_balance_unit(&scene->structure, scene->motion.gravity);
    if (options->control) {
        p.quiet.stop = options->control->stop;
        p.quiet.user = options->control->user;
    }
    p.x = morph_alloc(width(&p), sizeof *p.x);
    p.scaled = morph_alloc(width(&p), sizeof *p.scaled);
    const morph_status status = p.x && p.scaled ? place(&p, x0) : MORPH_ERR_NOMEM;
    free(p.x);
    free(p.scaled);
    out->seconds = morph_seconds() - p.started;
    if (status != MORPH_OK && status != MORPH_ERR_STOPPED) morph_placement_free(out);
    return status;
}
