/* The last program of placement, and whether the blanket ends where it says. */
#include "planner/guide.h"
#include "planner/placement_trial.h"

#include <stdio.h>
#include <stdlib.h>

/* Friction lets a sheet creep that has come to rest as far as frames tell. Under the same centres it goes on
 * until that moves it by less than this, rms over the joints, spacings: what a program then says can be held
 * against it. */
#define CREEP 0.01
enum { MOST_CREEPS = 6 };

/* *way: the frames of that, from where the rounds ended. */
static morph_status settle_down(morph_placer *p, morph_trajectory *way) {
    const morph_placement *out = p->out;
    double moved = INFINITY;
    morph_status status = MORPH_OK;
    for (int k = 0; k < MOST_CREEPS && moved > CREEP && !morph_placer_late(p) && status == MORPH_OK; k++) {
        morph_trajectory more = {0};
        status = morph_guided_run(p->w, p->scene, p->x, out->centre, out->centres, &p->quiet, &more, NULL);
        if (status == MORPH_OK) {
            moved = morph_placer_apart(p, morph_placer_end(p, &more), p->x);
            morph_placer_stand(p, morph_placer_end(p, &more));
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

/* So little reach may leave contacts no room to close: then three times as much. Where iterations ran out,
 * more room would not help. */
static morph_status solve(morph_placer *p, morph_balance *b, const morph_rest *rest, double **z,
                          morph_nlp_result *result) {
    morph_placement *out = p->out;
    morph_placement_options o = *p->options;
    morph_status status = MORPH_OK;
    o.epsilon = o.last_epsilon;
    o.iterations = o.last_iterations;
    for (int k = 0; k < 2 && status == MORPH_OK && !out->solved; k++, o.last_reach *= 3.0) {
        free(*z);
        *z = NULL;
        morph_nlp_result_free(result);
        status = morph_proposal_of(&o)(p->w, b, &o, o.last_reach, morph_placer_left(p), rest, z, result);
        if (status != MORPH_OK) break;
        morph_effort_add(&out->effort, result);
        out->solved = result->outcome == MORPH_OPTIMAL;
        if (result->iterations >= o.iterations) break;
    }
    return status;
}

static void say(const morph_placer *p, const morph_nlp_result *result, const morph_trial *t) {
    morph_placement *out = p->out;
    out->predicted_objective = t->predicted;
    out->difference = t->difference;
    morph_log(p->options->control,
              "placement: last: %s, %d iterations; residual %.1e, complementarity %.1e, %s; objective %.4g, "
              "predicted %.4g, reached %.4g, %.3f spacings apart",
              result->solver_text, result->iterations, out->balance.residual, out->balance.complementarity,
              out->balance.stable ? "stable" : "not stable", p->objective, t->predicted,
              morph_placer_objective(p, &t->measure), t->difference);
    if (!out->solved)
        snprintf(out->reason, sizeof out->reason, "the last program: %s", result->solver_text);
    else if (!out->balance.stable)
        snprintf(out->reason, sizeof out->reason, "the last program ended at a saddle");
}

morph_status morph_placement_last(morph_placer *p) {
    morph_placement *out = p->out;
    morph_balance *b = NULL;
    morph_rest rest = {0};
    morph_nlp_result result = {0};
    double *z = NULL;
    morph_trial t = {0};
    morph_trajectory still = {0};
    morph_status status = settle_down(p, &still);
    if (status == MORPH_OK)
        status = morph_placer_adopt(p, out->centre, out->centres, p->options->last_epsilon, &b, &rest);
    if (status == MORPH_OK) status = solve(p, b, &rest, &z, &result);
    if (status == MORPH_OK) status = morph_balance_examine(b, z, &out->balance);
    if (status == MORPH_OK) status = morph_trial_judge(p, b, z, &t);
    if (status == MORPH_OK) {
        say(p, &result, &t);
        if (morph_placer_objective(p, &t.measure) < p->objective) {
            if (still.frames > 0) status = morph_trajectory_append(&out->guided, &still);
            if (status == MORPH_OK) status = morph_trial_accept(p, &t);
        }
    }
    if (status == MORPH_ERR_BACKEND || status == MORPH_ERR_NONFINITE || status == MORPH_ERR_MOTION) {
        snprintf(out->reason, sizeof out->reason, "the last program: %s", morph_status_text(status));
        status = MORPH_OK;
    }
    morph_trajectory_free(&still);
    morph_trajectory_free(&t.way);
    morph_nlp_result_free(&result);
    morph_rest_free(&rest);
    morph_balance_destroy(b);
    free(z);
    return status;
}
