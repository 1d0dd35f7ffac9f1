/* The nonlinear program of placement. */
#include "planner/cavity_objective.h"

#include <stdlib.h>
#include <string.h>

/* A round's reach changes strengths by a factor of two at most, a shorter one by less in proportion. */
#define FULL_REACH 0.3

/* Joints within reach of where they are in z, centres within twice that, strengths within a factor. */
static void set_bounds(const morph_balance *b, double reach, double strongest, const double *z, double *lower,
                       double *upper) {
    const double change = fmin(1.0, reach / FULL_REACH);
    for (int i = 0; i < morph_balance_unknowns(b); i++) {
        lower[i] = -INFINITY;
        upper[i] = INFINITY;
    }
    for (int i = 0; i < b->coordinates; i++) {
        lower[i] = b->row[i] < 0 ? z[i] : z[i] - reach;
        upper[i] = b->row[i] < 0 ? z[i] : z[i] + reach;
    }
    for (int q = 0; q < b->limits.count; q++)
        lower[morph_balance_lambda(b) + q] = 0.0;
    for (int m = 0; m < b->centres; m++) {
        for (int k = 0; k < 3; k++) {
            const int i = morph_balance_centre(b) + 3 * m + k;
            lower[i] = z[i] - 2.0 * reach;
            upper[i] = z[i] + 2.0 * reach;
        }
        const int s = morph_balance_strength(b) + m;
        lower[s] = z[s] / (1.0 + change);
        upper[s] = fmin(strongest, (1.0 + change) * z[s] + change);
    }
}

/* Multipliers of a start that has none: the barrier's own for bounds, nothing for rows. */
static morph_status start_warm(int n, const double *z, const double *lower, const double *upper, int rows,
                               double mu, morph_nlp_result *r) {
    const morph_status status = morph_nlp_result_create(z, n, rows, r);
    for (int i = 0; i < n && status == MORPH_OK; i++) {
        if (isfinite(lower[i]) && lower[i] < upper[i])
            r->lower_multiplier[i] = mu / fmax(z[i] - lower[i], mu);
        if (isfinite(upper[i]) && lower[i] < upper[i])
            r->upper_multiplier[i] = mu / fmax(upper[i] - z[i], mu);
    }
    return status;
}

/* What a program borrows while it is solved. */
typedef struct program {
    morph_balance *balance;
    const morph_placement_options *options;
    double *lower, *upper;
    morph_cavity_objective objective;
    morph_control quiet; /* the caller's without its log: the program's iterations are too many lines */
} program;

static void release(program *p) {
    free(p->lower);
    free(p->upper);
    morph_cavity_objective_free(&p->objective);
}

static int fill_blocks(program *p, int n, morph_block *blocks) {
    morph_balance *b = p->balance;
    double *lo = p->lower + n, *hi = p->upper + n;
    int count = 0;
    blocks[count++] = morph_block_balance(b, lo, hi);
    lo += b->rows, hi += b->rows;
    if (b->equalities) blocks[count++] = morph_block_equalities(b, lo, hi);
    lo += b->equalities, hi += b->equalities;
    if (b->limits.count) {
        blocks[count++] = morph_block_complementarity(b, lo, hi);
        lo += b->limits.count, hi += b->limits.count;
        /* lambda c = epsilon alone would let a step pass to the side where both are negative. */
        blocks[count++] = morph_block_limits(b, lo, hi);
    }
    morph_cavity_objective_blocks(&p->objective, &blocks[count]);
    return count + MORPH_CAVITY_BLOCKS;
}

/* The start is a point of the barrier's path already: a barrier far above that would drive it away. */
#define FIRST_MU 1e-4

/* From z, with bounds about where the blanket rests. */
static morph_status solve(program *p, double moves, const morph_rest *rest, double *z,
                          morph_nlp_result *result) {
    morph_balance *b = p->balance;
    const int n = morph_balance_unknowns(b), rows = b->rows + 2 * b->limits.count + b->equalities;
    morph_block blocks[4 + MORPH_CAVITY_BLOCKS];
    morph_nlp *nlp = NULL;
    char message[256] = "";
    free(p->lower);
    free(p->upper);
    p->lower = morph_alloc((size_t)n + (size_t)rows, sizeof *p->lower);
    p->upper = morph_alloc((size_t)n + (size_t)rows, sizeof *p->upper);
    if (!p->lower || !p->upper) return MORPH_ERR_NOMEM;
    const int count = fill_blocks(p, n, blocks);
    set_bounds(b, moves, p->options->strongest, rest->z, p->lower, p->upper);
    morph_status status =
        morph_nlp_create(n, z, p->lower, p->upper, blocks, count, message, sizeof message, &nlp);
    if (status != MORPH_OK) morph_log(p->options->control, "placement: %s", message);
    if (status == MORPH_OK)
        status = start_warm(n, z, p->lower, p->upper, rows, fmin(FIRST_MU, b->epsilon), result);
    if (status == MORPH_OK) {
        morph_nlp_options o = morph_nlp_defaults();
        /* The objective is of order 1: as in the refinement's later rounds. What balance and complementarity
         * are worth hangs on the rows' own tolerance. */
        o.tolerance = 1e-4;
        o.violation_tolerance = fmin(1e-6, 0.1 * b->epsilon);
        o.adaptive_mu = false;
        o.warm = true;
        o.mu_init = fmin(FIRST_MU, b->epsilon);
        o.max_iterations = p->options->iterations;
        o.control = &p->quiet;
        o.isolated = true;
        status = morph_nlp_solve(nlp, NULL, &o, result);
    }
    if (status == MORPH_OK) memcpy(z, result->x, (size_t)n * sizeof *z);
    morph_nlp_destroy(nlp);
    return status;
}

/* A point with all limits of the balance: those that it does not know yet, beyond the first `known`, have
 * the barrier's force. */
static double *start_point(const morph_balance *b, const double *from, int known) {
    double *z = morph_alloc((size_t)morph_balance_unknowns(b), sizeof *z);
    if (!z) return NULL;
    memcpy(z, from, (size_t)(morph_balance_lambda(b) + known) * sizeof *z);
    for (int q = known; q < b->limits.count; q++)
        z[morph_balance_lambda(b) + q] = b->epsilon / fmax(1e-3, morph_balance_limit_at(b, q, z));
    return z;
}

enum { PASSES = 3 }; /* of adding limits that a solve went through */

morph_status morph_placement_program(const morph_workspace *w, morph_balance *b,
                                     const morph_placement_options *options, double moves,
                                     const morph_rest *rest, double **z, morph_nlp_result *result) {
    program p = {.balance = b, .options = options};
    int iterations = 0;
    *z = NULL;
    *result = (morph_nlp_result){0};
    if (options->control) {
        p.quiet.stop = options->control->stop;
        p.quiet.user = options->control->user;
    }
    morph_status status = morph_cavity_objective_create(w, options, rest->z, b->centres,
                                                        morph_balance_strength(b), &p.objective);
    int known = rest->limits.count;
    for (int added = 1, pass = 0; added > 0 && pass < PASSES && status == MORPH_OK; pass++) {
        morph_nlp_result_free(result);
        double *start = start_point(b, *z ? *z : rest->z, known);
        free(*z);
        *z = start;
        known = b->limits.count;
        status = *z ? solve(&p, moves, rest, *z, result) : MORPH_ERR_NOMEM;
        if (status != MORPH_OK) break;
        iterations += result->iterations;
        /* What is not solved says too little about which limits are missing to be solved once more. */
        morph_log(options->control, "placement: program %d: %s, %d iterations, %d limits, %d unknowns",
                  pass + 1, result->solver_text, result->iterations, b->limits.count, result->unknowns);
        if (result->outcome != MORPH_OPTIMAL) break;
        status = morph_balance_more_limits(b, *z, &morph_rest_missed, MORPH_REST_SLID, &added);
        if (status == MORPH_OK && pass == PASSES - 1) b->limits.count -= added;
    }
    result->iterations = iterations;
    release(&p);
    if (status != MORPH_OK) {
        morph_nlp_result_free(result);
        free(*z);
        *z = NULL;
    }
    return status;
}
