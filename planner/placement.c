#include "planner/placement.h"

#include "planner/guide.h"
#include "planner/placement_trial.h"

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
                                     .least_gain = 0.03,
                                     .least_growth = 0.05,
                                     .strongest = 60.0,
                                     .thrift = 1e-7,
                                     .hold = 10.0,
                                     .last_reach = 0.003,
                                     .epsilon = 1e-3,
                                     .last_epsilon = 9e-7,
                                     .iterations = 50,
                                     .last_iterations = 120,
                                     .rounds = 6,
                                     .most_centres = 3};
}

void morph_placement_free(morph_placement *p) {
    morph_trajectory_free(&p->guided);
    *p = (morph_placement){0};
}

static morph_status run_seeds(morph_placer *p) {
    morph_placement *out = p->out;
    memcpy(out->centre, out->seed, sizeof out->centre);
    out->centres = out->seeds;
    morph_status status =
        morph_guided_run(p->w, p->scene, NULL, out->seed, out->seeds, &p->quiet, &out->guided, NULL);
    if (status == MORPH_OK) morph_placer_stand(p, morph_placer_end(p, &out->guided));
    if (status == MORPH_OK) status = morph_cavity_measure(p->w->cavity, p->x, &out->seeded);
    out->reached = out->seeded;
    p->objective = morph_placer_objective(p, &out->seeded);
    return status;
}

static morph_status propose_program(const morph_workspace *w, morph_balance *b,
                                    const morph_placement_options *options, double moves, double seconds,
                                    const morph_rest *rest, double **z, morph_nlp_result *result) {
    (void)seconds; /* its iterations are limited */
    return morph_placement_program(w, b, options, moves, rest, z, result);
}

morph_proposal morph_proposal_of(const morph_placement_options *options) {
    static const morph_proposal by[MORPH_PLACE_METHODS] = {propose_program, morph_propose_free,
                                                           morph_propose_gradient};
    return by[options->method];
}

/* One round from where the blanket rests: *gain is what the blanket gained, 0 if nothing; *hope what the
 * program promised. */
static morph_status round_of(morph_placer *p, const morph_attractor *centre, int centres, double *gain,
                             double *hope) {
    morph_balance *b = NULL;
    morph_rest rest;
    morph_nlp_result result = {0};
    double *z = NULL;
    morph_trial t = {0};
    *gain = *hope = 0.0;
    morph_status status = morph_placer_adopt(p, centre, centres, p->options->epsilon, &b, &rest);
    if (status == MORPH_OK)
        status = morph_proposal_of(p->options)(p->w, b, p->options, p->reach, morph_placer_left(p), &rest, &z,
                                               &result);
    if (status == MORPH_OK) {
        morph_effort_add(&p->out->effort, &result);
        status = morph_trial_judge(p, b, z, &t);
    }
    if (status == MORPH_OK) {
        const double reached = morph_placer_objective(p, &t.measure);
        morph_log(
            p->options->control,
            "placement: %d centre%s, reach %.2f: %s, %d iterations, %d unknowns, %.1f s; objective %.4g, "
            "predicted %.4g, reached %.4g, %.3f spacings apart",
            centres, centres == 1 ? "" : "s", p->reach, result.solver_text, result.iterations,
            result.unknowns, result.seconds, p->objective, t.predicted, reached, t.difference);
        *hope = p->objective - t.predicted;
        if (p->bold) status = morph_trial_along(p, centre, &t);
    }
    if (status == MORPH_OK) {
        const double reached = morph_placer_objective(p, &t.measure);
        if (reached < p->objective) {
            *gain = p->objective - reached;
            status = morph_trial_accept(p, &t);
            p->out->accepted++;
        }
    }
    /* A solver that dies, or a motion that cannot be followed, is a round without a gain. */
    if (status == MORPH_ERR_BACKEND || status == MORPH_ERR_NONFINITE || status == MORPH_ERR_MOTION) {
        morph_log(p->options->control, "placement: a round is lost: %s", morph_status_text(status));
        status = MORPH_OK;
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

/* Fewer lead nowhere: the long steps leave as many over for the cautious way. */
enum { FEWEST_ROUNDS = 2 };

static bool rounds_left(const morph_placer *p) {
    const int kept = p->bold && p->leapt ? FEWEST_ROUNDS : 0;
    return p->out->rounds < p->options->rounds - kept;
}

/* Rounds with a number of centres until they gain little. The first starts from `centre`. */
static morph_status rounds(morph_placer *p, const morph_attractor *centre, int centres) {
    morph_status status = MORPH_OK;
    morph_attractor from[MORPH_MOST_CENTRES];
    memcpy(from, centre, sizeof from);
    p->reach = p->options->reach;
    while (status == MORPH_OK && rounds_left(p) && p->reach > LEAST_REACH) {
        const double before = p->objective;
        double gain, hope;
        status = round_of(p, from, centres, &gain, &hope);
        if (morph_stopped(p->options->control)) return MORPH_ERR_STOPPED;
        morph_progress(p->options->control, "placement", p->out->rounds / (double)p->options->rounds);
        if (morph_placer_late(p)) break;
        /* Little won; or nothing, and little to be hoped for from a shorter step. */
        if ((gain > 0.0 ? gain : 0.5 * hope) < p->options->least_gain * before) break;
        p->reach *= gain > 0.0 ? 1.25 : 0.5;
        p->reach = fmin(p->reach, 0.4);
        if (gain > 0.0) memcpy(from, p->out->centre, sizeof from);
    }
    return status;
}

/* A further centre beneath the largest cavity that is left, weak at first: as long as that pays. */
static morph_status grow(morph_placer *p) {
    morph_status status = MORPH_OK;
    const double a = p->w->structure->spacing;
    while (status == MORPH_OK && p->out->centres < p->options->most_centres && !morph_placer_late(p) &&
           rounds_left(p)) {
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

/* The first way found stands while another is tried. */
typedef struct stand {
    morph_placement placement; /* owns its frames */
    double objective;
} stand;

static stand put_by(morph_placer *p) {
    const stand s = {*p->out, p->objective};
    p->out->guided = (morph_trajectory){0};
    return s;
}

/* Back to the way that was put by; what it cost to try the other counts. */
static void take_back(morph_placer *p, const stand *s) {
    const morph_placement tried = *p->out;
    morph_trajectory_free(&p->out->guided);
    *p->out = s->placement;
    p->out->rounds = tried.rounds;
    p->out->accepted = tried.accepted;
    p->out->effort = tried.effort;
    p->objective = s->objective;
    morph_placer_stand(p, morph_placer_end(p, &p->out->guided));
}

/* Long steps are quick and may end where friction lets no other follow: the rounds that they left over go
 * from where the first was made, with the programs' own steps. */
static morph_status cautiously(morph_placer *p) {
    if (!p->leapt || p->options->rounds - p->out->rounds < FEWEST_ROUNDS || morph_placer_late(p))
        return MORPH_OK;
    stand first = put_by(p);
    p->bold = false;
    morph_status status = morph_trial_branch(p);
    const morph_placement *out = p->out;
    if (status == MORPH_OK) status = rounds(p, out->centre, out->centres);
    if (status == MORPH_OK) status = grow(p);
    if (p->out->guided.frames > 0 && p->objective < first.objective)
        morph_trajectory_free(&first.placement.guided);
    else
        take_back(p, &first);
    p->bold = true;
    return status;
}

/* From the start, under the centres found: less friction may lie on that way. Where it is better, rounds go
 * on from there. */
static morph_status again(morph_placer *p) {
    const double before = p->objective;
    morph_attractor centre[MORPH_MOST_CENTRES];
    morph_status status = morph_trial_afresh(p);
    if (status != MORPH_OK || !(p->objective < before)) return status;
    memcpy(centre, p->out->centre, sizeof centre);
    return rounds(p, centre, p->out->centres);
}

static morph_status place(morph_placer *p, const double *x0) {
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
    if (status == MORPH_OK && p->bold) status = cautiously(p);
    if (status == MORPH_OK && p->bold) status = again(p);
    if (status == MORPH_OK) status = morph_placement_last(p);
    return status;
}

morph_status morph_placement_run(const morph_workspace *w, const morph_scene *scene, const double *x0,
                                 const morph_placement_options *options, morph_placement *out) {
    *out = (morph_placement){0};
    morph_placer p = {.w = w, .scene = scene, .options = options, .out = out, .started = morph_seconds()};
    p.bold = options->method == MORPH_PLACE_IPOPT;
    p.unit = morph_balance_unit(&scene->structure, scene->motion.gravity);
    const size_t width = 3 * (size_t)w->structure->joints;
    if (options->control) {
        p.quiet.stop = options->control->stop;
        p.quiet.user = options->control->user;
    }
    p.x = morph_alloc(width, sizeof *p.x);
    p.scaled = morph_alloc(width, sizeof *p.scaled);
    const morph_status status = p.x && p.scaled ? place(&p, x0) : MORPH_ERR_NOMEM;
    free(p.x);
    free(p.scaled);
    morph_branch_free(&p.branch);
    out->seconds = morph_seconds() - p.started;
    if (status != MORPH_OK && status != MORPH_ERR_STOPPED) morph_placement_free(out);
    return status;
}
