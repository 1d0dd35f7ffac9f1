/* Newton's method on the rows of balance.h: with lambda' = epsilon / c,
 *
 *     K u - A' sigma = -r(x, tau, lambda'),   A u = aim - e(x),                          (stiffness.h)
 *     dlambda = lambda' - lambda - (lambda / c) grad c . u
 *
 * A step goes as far as limits and their reactions stay positive and the rows' error falls. Where that ends
 * before the balance, an interior point method finds the shape, and Newton has the last word, because its
 * limits are the same for every shape. */
#include "planner/rest_follow.h"

#include "planner/stiffness.h"

#include <stdlib.h>
#include <string.h>

enum { STEPS = 40, HALVINGS = 10 };
#define BALANCED 1e-9      /* rows are of order 1; rounding leaves some 1e-12, more of stiff limits */
#define COMPLEMENTARY 1e-6 /* of epsilon */
#define KEEP 0.02          /* part of a limit's clearance, and of its reaction, that a step leaves */
#define FARTHEST 0.3       /* a step, spacings: about what the curvature of lengths and angles allows */

typedef struct follower {
    morph_balance *balance;
    double *z, *trial, *barrier; /* unknowns; barrier: with lambda' */
    double *rows, *u;            /* rows */
    double *equal, *sigma;       /* equalities */
    double *c, *dlambda;         /* limits */
    double *lower, *upper;       /* bounds that blocks write */
} follower;

static void release(follower *f) {
    free(f->z);
    free(f->trial);
    free(f->barrier);
    free(f->rows);
    free(f->u);
    free(f->equal);
    free(f->sigma);
    free(f->c);
    free(f->dlambda);
    free(f->lower);
    free(f->upper);
}

static bool prepare(follower *f, morph_balance *b) {
    const size_t n = (size_t)morph_balance_unknowns(b), rows = (size_t)b->rows, equal = (size_t)b->equalities,
                 limits = (size_t)b->limits.count;
    *f = (follower){.balance = b};
    f->z = morph_alloc(n, sizeof(double));
    f->trial = morph_alloc(n, sizeof(double));
    f->barrier = morph_alloc(n, sizeof(double));
    f->rows = morph_alloc(rows, sizeof(double));
    f->u = morph_alloc(rows, sizeof(double));
    f->equal = morph_alloc(equal, sizeof(double));
    f->sigma = morph_alloc(equal, sizeof(double));
    f->c = morph_alloc(limits, sizeof(double));
    f->dlambda = morph_alloc(limits, sizeof(double));
    f->lower = morph_alloc(rows + equal, sizeof(double));
    f->upper = morph_alloc(rows + equal, sizeof(double));
    return f->z && f->trial && f->barrier && f->rows && f->u && f->equal && f->sigma && f->c && f->dlambda &&
           f->lower && f->upper;
}

/* Fills c, the rows and the equalities' errors at z: *error is the sum of all their squares with those of
 * lambda c - epsilon, *worst the largest in parts of what is allowed. Infinite where a limit has no
 * clearance.
 */
static morph_status measure(follower *f, const double *z, double *error, double *worst) {
    morph_balance *b = f->balance;
    *error = *worst = INFINITY;
    double squares = 0.0, most = 0.0;
    for (int q = 0; q < b->limits.count; q++) {
        f->c[q] = morph_balance_limit_at(b, q, z);
        if (!(f->c[q] > 0.0)) return MORPH_OK;
        const double gap = z[morph_balance_lambda(b) + q] * f->c[q] - b->epsilon;
        squares += gap * gap;
        most = fmax(most, fabs(gap) / (COMPLEMENTARY * b->epsilon));
    }
    const morph_block rows = morph_block_balance(b, f->lower, f->upper);
    const morph_block equal = morph_block_equalities(b, f->lower, f->upper);
    morph_status status = rows.value(b, z, f->rows);
    if (status == MORPH_OK) status = equal.value(b, z, f->equal);
    if (status != MORPH_OK) return status;
    for (int i = 0; i < b->rows; i++) {
        squares += f->rows[i] * f->rows[i];
        most = fmax(most, fabs(f->rows[i]) / BALANCED);
    }
    for (int e = 0; e < b->equalities; e++) {
        squares += f->equal[e] * f->equal[e];
        most = fmax(most, fabs(f->equal[e]) / BALANCED);
    }
    if (!isfinite(squares)) return MORPH_OK;
    *error = squares;
    *worst = most;
    return MORPH_OK;
}

/* u, sigma, dlambda at z, of which c is known; *definite as of the stiffness. */
static morph_status direction(follower *f, bool *definite) {
    morph_balance *b = f->balance;
    const int first = morph_balance_lambda(b);
    memcpy(f->barrier, f->z, (size_t)morph_balance_unknowns(b) * sizeof *f->z);
    for (int q = 0; q < b->limits.count; q++)
        f->barrier[first + q] = b->epsilon / f->c[q];
    const morph_block rows = morph_block_balance(b, f->lower, f->upper);
    const morph_block equal = morph_block_equalities(b, f->lower, f->upper);
    morph_stiffness *k = NULL;
    morph_status status = rows.value(b, f->barrier, f->rows);
    if (status == MORPH_OK) status = equal.value(b, f->z, f->equal);
    if (status == MORPH_OK) status = morph_stiffness_create(b, f->z, &k, definite);
    for (int i = 0; i < b->rows; i++)
        f->rows[i] = -f->rows[i];
    for (int e = 0; e < b->equalities; e++)
        f->equal[e] = -f->equal[e];
    if (status == MORPH_OK && *definite)
        status = morph_stiffness_solve(k, f->rows, f->equal, f->u, f->sigma, NULL);
    morph_stiffness_destroy(k);
    for (int q = 0; q < b->limits.count && status == MORPH_OK && *definite; q++) {
        const morph_element *e = &b->limits.element[q];
        morph_jet jet;
        double toward = 0.0;
        morph_element_eval(e, b->world->sdf, b->world->structure->spacing, f->z, 1, NULL, &jet);
        for (int i = 0; i < 3 * morph_element_joints(e); i++) {
            const int row = b->row[3 * e->joint[i / 3] + i % 3];
            if (row >= 0) toward += b->limits.sign[q] * jet.g[i] * f->u[row];
        }
        const double lambda = f->z[first + q];
        f->dlambda[q] = b->epsilon / f->c[q] - lambda - lambda / f->c[q] * toward;
    }
    return status;
}

/* Part of the way that keeps every reaction positive. */
static double longest_reaction(const follower *f) {
    const morph_balance *b = f->balance;
    double part = 1.0;
    for (int q = 0; q < b->limits.count; q++)
        if (f->dlambda[q] < 0.0)
            part = fmin(part, -(1.0 - KEEP) * f->z[morph_balance_lambda(b) + q] / f->dlambda[q]);
    return part;
}

static void move(const follower *f, double part, double reaction, double *to) {
    const morph_balance *b = f->balance;
    memcpy(to, f->z, (size_t)morph_balance_unknowns(b) * sizeof *to);
    for (int i = 0; i < b->coordinates; i++)
        if (b->row[i] >= 0) to[i] += part * f->u[b->row[i]];
    for (int e = 0; e < b->equalities; e++)
        to[morph_balance_tau(b) + e] += part * f->sigma[e];
    for (int q = 0; q < b->limits.count; q++)
        to[morph_balance_lambda(b) + q] += reaction * f->dlambda[q];
}

/* Newton from f->z until it is in balance there; *solved false where it gets stuck. */
static morph_status newton(follower *f, const morph_control *control, morph_follow_effort *effort,
                           bool *solved) {
    morph_balance *b = f->balance;
    double error, worst;
    *solved = false;
    morph_status status = measure(f, f->z, &error, &worst);
    for (int k = 0; k < STEPS && status == MORPH_OK && isfinite(error); k++) {
        if (worst <= 1.0) {
            *solved = true;
            return MORPH_OK;
        }
        if (morph_stopped(control)) return MORPH_ERR_STOPPED;
        bool definite;
        effort->steps++;
        status = direction(f, &definite);
        if (status == MORPH_ERR_NONFINITE || (status == MORPH_OK && !definite)) return MORPH_OK;
        double farthest = 0.0, part = 1.0;
        for (int i = 0; i < b->rows; i++)
            farthest = fmax(farthest, fabs(f->u[i]));
        if (farthest > FARTHEST) part = FARTHEST / farthest;
        const double reaction = longest_reaction(f), before = error;
        int halving = 0;
        for (error = INFINITY; halving < HALVINGS && status == MORPH_OK; halving++, part *= 0.5) {
            double next;
            move(f, part, fmin(part, reaction), f->trial);
            status = measure(f, f->trial, &next, &worst);
            /* The rows' error need not fall by much: the last of the barrier's path is steep. */
            if (next < before * (1.0 - 1e-4 * part)) {
                error = next;
                break;
            }
        }
        if (status == MORPH_OK && isfinite(error)) {
            double *swap = f->z;
            f->z = f->trial;
            f->trial = swap;
        }
    }
    return status;
}

/* z of `from` with these centres; of limits that it does not know the barrier's reactions. */
static bool begin(follower *f, morph_balance *b, const morph_attractor *centre, const double *z, int known) {
    if (!prepare(f, b)) return false;
    const int first = morph_balance_lambda(b);
    memcpy(f->z, z, (size_t)(first + known) * sizeof *z);
    for (int m = 0; m < b->centres; m++) {
        memcpy(&f->z[morph_balance_centre(b) + 3 * m], centre[m].at, sizeof centre[m].at);
        f->z[morph_balance_strength(b) + m] = centre[m].strength;
    }
    for (int q = known; q < b->limits.count; q++)
        f->z[first + q] = b->epsilon / fmax(1e-3, morph_balance_limit_at(b, q, z));
    /* A reaction of zero would stay there. */
    for (int q = 0; q < known; q++)
        f->z[first + q] = fmax(f->z[first + q], 1e-3 * b->epsilon);
    return true;
}

/* The shape that the interior point method finds from z, in the same place: all its unknowns. */
static morph_status from_outside(morph_balance *b, const morph_attractor *centre, double until, double **z,
                                 const morph_control *control, morph_follow_effort *effort, bool *found) {
    morph_rest rest = {0};
    const double seconds = isfinite(until) ? until - morph_seconds() : 0.0;
    *found = false;
    if (isfinite(until) && seconds <= 0.0) return MORPH_OK;
    effort->solves++;
    const morph_status status =
        morph_rest_solve(b, centre, b->epsilon, *z, &(*z)[morph_balance_tau(b)], seconds, control, &rest);
    if (status == MORPH_ERR_NONFINITE || status == MORPH_ERR_BACKEND) return MORPH_OK;
    if (status != MORPH_OK) return status;
    *found = rest.solved;
    double *swap = *z;
    *z = rest.z;
    rest.z = swap;
    morph_rest_free(&rest);
    return MORPH_OK;
}

static double *copy_of(const double *from, size_t n) {
    double *to = morph_alloc(n, sizeof *to);
    if (to) memcpy(to, from, n * sizeof *to);
    return to;
}

/* Solves from outside end at their joints' bounds where a sheet snaps over, and shapes pass limits that they
 * did not know: each takes another pass. */
enum { PASSES = 5 };

morph_status morph_rest_follow(morph_balance *b, const morph_attractor *centre, const morph_rest *from,
                               double until, const morph_control *control, morph_rest *out,
                               morph_follow_effort *effort) {
    *out = (morph_rest){0};
    morph_status status = MORPH_OK;
    double *z = copy_of(from->z, (size_t)(morph_balance_lambda(b) + from->limits.count));
    int known = from->limits.count;
    bool solved = false, found = true;
    effort->rests++;
    if (!z) return MORPH_ERR_NOMEM;
    for (int pass = 0; pass < PASSES && status == MORPH_OK && !solved && found; pass++) {
        follower f;
        int added = 0;
        status = begin(&f, b, centre, z, known) ? MORPH_OK : MORPH_ERR_NOMEM;
        if (status == MORPH_OK) status = newton(&f, control, effort, &solved);
        if (status == MORPH_OK && solved)
            status = morph_balance_more_limits(b, f.z, &morph_rest_missed, 0.0, &added);
        if (status == MORPH_OK && solved && added == 0) {
            out->z = f.z;
            f.z = NULL;
        } else if (status == MORPH_OK) {
            if (solved) memcpy(z, f.z, (size_t)morph_balance_lambda(b) * sizeof *z);
            solved = false;
            if (pass < PASSES - 1) status = from_outside(b, centre, until, &z, control, effort, &found);
            known = b->limits.count;
        }
        release(&f);
    }
    free(z);
    out->solved = solved;
    effort->failures += status == MORPH_OK && !solved;
    if (status == MORPH_OK && solved) status = morph_limits_copy(&out->limits, &b->limits);
    if (status != MORPH_OK) morph_rest_free(out);
    return status;
}
