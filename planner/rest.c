#include "planner/rest.h"

#include <stdlib.h>
#include <string.h>

const morph_nearness morph_rest_nearness = {.length = 0.1, .angle = 0.25, .clearance = 0.35, .self = 0.08};
const morph_nearness morph_rest_missed = {.length = -1e-3, .angle = -2e-3, .clearance = -1e-3, .self = -1e-3};

/* On the path of the barrier every limit has lambda c = epsilon: near a shape at rest that is the start. tau
 * as from where x comes. */
static morph_status start_warm(const morph_balance *b, double epsilon, const double *x, const double *tau,
                               morph_nlp_result *r) {
    const morph_status status =
        morph_nlp_result_create(x, b->coordinates, b->equalities + b->limits.count, r);
    for (int e = 0; e < b->equalities && status == MORPH_OK; e++)
        r->row_multiplier[e] = -tau[e];
    for (int q = 0; q < b->limits.count && status == MORPH_OK; q++)
        r->row_multiplier[b->equalities + q] = -epsilon / fmax(morph_balance_limit_at(b, q, x), 1e-3);
    return status;
}

void morph_rest_free(morph_rest *rest) {
    free(rest->z);
    morph_limits_free(&rest->limits);
    *rest = (morph_rest){0};
}

static morph_status solve_rest(morph_balance *b, morph_rest_energy *energy, double epsilon, const double *x,
                               const double *tau, bool bounded, double seconds, const morph_control *control,
                               morph_nlp_result *result) {
    const int n = b->coordinates, rows = b->equalities + b->limits.count;
    double *lower = morph_alloc((size_t)(n + rows), sizeof *lower),
           *upper = morph_alloc((size_t)(n + rows), sizeof *upper);
    morph_nlp *nlp = NULL;
    morph_status status = lower && upper ? MORPH_OK : MORPH_ERR_NOMEM;
    char message[256] = "";
    if (status == MORPH_OK) {
        double *rl = lower + n, *ru = upper + n;
        const morph_block blocks[3] = {morph_block_rest_energy(energy), morph_block_equalities(b, rl, ru),
                                       morph_block_limits(b, rl + b->equalities, ru + b->equalities)};
        for (int i = 0; i < n; i++) {
            const bool held = b->row[i] < 0;
            lower[i] = held ? x[i] : bounded ? x[i] - MORPH_REST_REACH : -INFINITY;
            upper[i] = held ? x[i] : bounded ? x[i] + MORPH_REST_REACH : INFINITY;
        }
        status = morph_nlp_create(n, x, lower, upper, blocks, b->limits.count > 0 ? 3 : 2, message,
                                  sizeof message, &nlp);
        if (status != MORPH_OK) morph_log(control, "rest: %s", message);
    }
    if (status == MORPH_OK) {
        morph_nlp_options o = morph_nlp_defaults();
        o.tolerance = fmin(1e-8, 1e-3 * epsilon);
        o.violation_tolerance = 1e-9;
        o.adaptive_mu = false;
        o.mu_init = tau ? epsilon : fmax(1e-2, epsilon);
        o.warm = tau != NULL;
        o.mu_target = epsilon;
        o.max_iterations = 200;
        o.max_seconds = seconds;
        o.control = control;
        o.isolated = true;
        if (tau) status = start_warm(b, epsilon, x, tau, result);
        if (status == MORPH_OK) status = morph_nlp_solve(nlp, x, &o, result);
    }
    morph_nlp_destroy(nlp);
    free(lower);
    free(upper);
    return status;
}

/* Ipopt's Lagrangian is f + y.rows; ours E - tau e - lambda c. */
static double *assemble(const morph_balance *b, const morph_attractor *centre,
                        const morph_nlp_result *result) {
    double *z = morph_alloc((size_t)morph_balance_unknowns(b), sizeof *z);
    if (!z) return NULL;
    memcpy(z, result->x, (size_t)b->coordinates * sizeof *z);
    for (int e = 0; e < b->equalities; e++)
        z[morph_balance_tau(b) + e] = -result->row_multiplier[e];
    for (int q = 0; q < b->limits.count; q++)
        z[morph_balance_lambda(b) + q] = fmax(0.0, -result->row_multiplier[b->equalities + q]);
    for (int m = 0; m < b->centres; m++) {
        memcpy(&z[morph_balance_centre(b) + 3 * m], centre[m].at, sizeof centre[m].at);
        z[morph_balance_strength(b) + m] = centre[m].strength;
    }
    return z;
}

morph_status morph_rest_solve(morph_balance *b, const morph_attractor *centre, double epsilon,
                              const double *x, const double *tau, double seconds,
                              const morph_control *control, morph_rest *out) {
    morph_rest_energy energy = {b, centre};
    morph_nlp_result result = {0};
    *out = (morph_rest){.solves = 1};
    morph_status status = solve_rest(b, &energy, epsilon, x, tau, true, seconds, control, &result);
    if (status == MORPH_OK) {
        out->iterations = result.iterations;
        out->solved = result.outcome == MORPH_OPTIMAL;
        out->z = assemble(b, centre, &result);
        status = out->z ? morph_limits_copy(&out->limits, &b->limits) : MORPH_ERR_NOMEM;
    }
    b->epsilon = epsilon;
    morph_nlp_result_free(&result);
    if (status != MORPH_OK) morph_rest_free(out);
    return status;
}

enum { PASSES = 3 }; /* of adding missed limits */

static morph_status find(morph_balance *b, const morph_attractor *centre, double epsilon, const double *x,
                         const double *tau, int rounds, double slid, const morph_control *control,
                         morph_rest *out) {
    *out = (morph_rest){0};
    const size_t n = (size_t)b->coordinates;
    morph_rest_energy energy = {b, centre};
    double *at = morph_alloc(n, sizeof *at), *from = morph_alloc(n, sizeof *from);
    morph_status status = at && from ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        memcpy(at, x, n * sizeof *at);
    }
    /* Bounds keep a search near its limits; their barrier is a force, so the last round has none, and the one
     * of an adoption, whose springs do as much. */
    bool bounded = rounds > 1;
    for (int round = 0; round < rounds && status == MORPH_OK; round++) {
        double moved = 0.0;
        status = morph_balance_limits(b, at, &morph_rest_nearness);
        if (status == MORPH_OK) memcpy(from, at, n * sizeof *at);
        for (int added = 1, pass = 0; added > 0 && pass < PASSES && status == MORPH_OK; pass++) {
            morph_nlp_result result = {0};
            status = solve_rest(b, &energy, epsilon, from, out->z ? &out->z[b->coordinates] : tau, bounded,
                                0.0, control, &result);
            if (status != MORPH_OK) break;
            out->solves++;
            out->iterations += result.iterations;
            out->solved = result.outcome == MORPH_OPTIMAL;
            status = morph_balance_more_limits(b, result.x, &morph_rest_missed, slid, &added);
            if (status == MORPH_OK && added > 0 && pass < PASSES - 1) {
                /* What came in a little is pushed out from where it is; what came in far, from before. */
                double deepest = 0.0;
                for (int q = b->limits.count - added; q < b->limits.count; q++)
                    deepest = fmax(deepest, -morph_balance_limit_at(b, q, result.x));
                if (deepest < 0.05) memcpy(from, result.x, n * sizeof *from);
                morph_nlp_result_free(&result);
                continue;
            }
            moved = 0.0;
            for (size_t i = 0; i < n; i++)
                moved = fmax(moved, fabs(result.x[i] - at[i]));
            memcpy(at, result.x, n * sizeof *at);
            free(out->z);
            b->limits.count -= added;
            out->z = assemble(b, centre, &result);
            if (!out->z) status = MORPH_ERR_NOMEM;
            morph_log(control, "rest: %d.%d: %s, %d iterations, %d limits, moved %.3f", round, pass,
                      result.solver_text, result.iterations, b->limits.count, moved);
            morph_nlp_result_free(&result);
        }
        if (moved < 0.1 && round > 0 && !bounded) break;
        bounded = !(moved < 0.1);
    }
    b->epsilon = epsilon;
    free(at);
    free(from);
    if (status == MORPH_OK) status = morph_limits_copy(&out->limits, &b->limits);
    if (status == MORPH_OK) status = morph_balance_examine(b, out->z, &out->report);
    if (status != MORPH_OK) morph_rest_free(out);
    return status;
}

enum { FIND_ROUNDS = 12 };

morph_status morph_rest_find(morph_balance *b, const morph_attractor *centre, double epsilon, const double *x,
                             const double *tau, const morph_control *control, morph_rest *out) {
    return find(b, centre, epsilon, x, tau, FIND_ROUNDS, 0.0, control, out);
}

/* Springs this stiff move no joint by more than about a hundredth of a spacing where the blanket's forces are
 * a few weights off balance. */
#define ADOPT_HOLD 100.0

morph_status morph_rest_adopt(morph_balance *b, const morph_attractor *centre, double epsilon,
                              const double *x, const morph_control *control, morph_rest *out) {
    const double hold = b->hold;
    const size_t n = (size_t)b->coordinates;
    b->hold = ADOPT_HOLD;
    memset(b->force, 0, n * sizeof *b->force);
    memcpy(b->anchor, x, n * sizeof *x);
    /* One round: the limits near x are those near the shape too, as the springs let it go nowhere. Rounds of
     * listing them anew went on for as long as two sets of limits took turns. */
    const morph_status status = find(b, centre, epsilon, x, NULL, 1, MORPH_REST_SLID, control, out);
    b->hold = hold;
    if (status != MORPH_OK) return status;
    for (size_t i = 0; i < n; i++)
        b->force[i] = -ADOPT_HOLD * (out->z[i] - b->anchor[i]);
    memcpy(b->anchor, out->z, n * sizeof *x);
    return MORPH_OK;
}
