/* What holds at a resting shape: its stability, and how it follows the centres.
 *
 * At rest, with J the gradients of the limits that carry a force and H the Hessian of the Lagrangian, the
 * shape is a strict minimum if H is positive definite on J dx = 0, which for a large enough r is when
 * H + r J'J is (Debreu 1952). The same factor serves the adjoint: the saddle system
 *     H y + J' v = b,  J y = 0
 * is solved by its own method of multipliers, (H + r J'J) y+ = b - J'v, v+ = v + r J y+: as r J'J y equals
 * the right side less H y, the next right side is simply H y. Each turn takes the error down by about the
 * curvature over r. */
#include "model/settle_internal.h"

#include <stdlib.h>
#include <string.h>

/* r over the penalty that was enough to hold the limits: a turn of the adjoint gains three digits or more,
 * and the factor keeps 9 of 16. */
#define FIRMER 1e3
/* Motions softer than this (load per spacing) count as free. */
#define LEAST_STIFFNESS 1e-6
/* Turns of the adjoint, and the change that ends them. */
enum { TURNS = 30 };
#define ADJOINT_TOLERANCE 1e-12

static void plain_hessian(morph_settle *s, double firmer) {
    const double keep[3] = {s->stiff, s->stiff_length, s->stiff_angle}, drag = s->drag;
    s->form = MORPH_SETTLE_PLAIN;
    s->drag = 0.0;
    s->stiff *= firmer;
    s->stiff_length *= firmer;
    s->stiff_angle *= firmer;
    morph_settle_evaluate(s, s->x, MORPH_SETTLE_EXACT);
    s->form = MORPH_SETTLE_AUGMENTED;
    s->stiff = keep[0];
    s->stiff_length = keep[1];
    s->stiff_angle = keep[2];
    s->drag = drag;
}

static void soften(morph_settle *s, double by) {
    for (int k = 0; k < 3 * s->joints; k++)
        if (!s->fixed[k / 3]) s->value[s->start[k]] -= by;
}

morph_status morph_settle_examine(morph_settle *s, bool *stable) {
    const double since = morph_seconds();
    int column;
    *stable = s->factored = false;
    plain_hessian(s, 0.0);
    memcpy(s->spare, s->value, (size_t)s->start[3 * s->joints] * sizeof *s->spare);
    plain_hessian(s, FIRMER);
    soften(s, LEAST_STIFFNESS);
    morph_status status = morph_sparse_factor(s->sparse, s->value, &column);
    if (status == MORPH_OK && column < 0) {
        soften(s, -LEAST_STIFFNESS);
        status = morph_sparse_factor(s->sparse, s->value, &column);
        *stable = s->factored = status == MORPH_OK && column < 0;
    }
    s->linear_seconds += morph_seconds() - since;
    return status;
}

/* y of the saddle system above; b is overwritten. */
static morph_status solve(morph_settle *s, double *b, double *y) {
    const int n = 3 * s->joints;
    double last = INFINITY;
    for (int turn = 0; turn < TURNS; turn++) {
        double change = 0.0, size = 0.0;
        const morph_status status = morph_sparse_solve(s->sparse, b, s->trial, NULL);
        if (status != MORPH_OK) return status;
        for (int k = 0; k < n; k++) {
            change = fmax(change, fabs(s->trial[k] - y[k]));
            size = fmax(size, fabs(s->trial[k]));
        }
        /* Once rounding takes over, changes grow again. */
        if (turn > 1 && change >= last) break;
        memcpy(y, s->trial, (size_t)n * sizeof *y);
        if (change <= ADJOINT_TOLERANCE * size) break;
        last = change;
        morph_sparse_times(s->sparse, s->spare, y, b);
        for (int k = 0; k < n; k++)
            if (s->fixed[k / 3]) b[k] = 0.0;
    }
    return MORPH_OK;
}

/* With g = grad of the energy and y from above, df/dp = -y'dg/dp. A centre's pull depends on a - x alone:
 * dg/da = -d2U/dx2; and dg/ds = -F/s. */
static void centre_slopes(const morph_settle *s, const double *y, int m, double at[3], double *strength) {
    const morph_attractor unit = {{s->attractor[m].at[0], s->attractor[m].at[1], s->attractor[m].at[2]}, 1.0};
    at[0] = at[1] = at[2] = *strength = 0.0;
    for (int j = 0; j < s->joints; j++) {
        double force[3] = {0, 0, 0}, h[3][3] = {{0}};
        morph_attraction(&unit, s->softening, &s->x[3 * j], force, h);
        *strength += morph_dot(force, &y[3 * j]);
        for (int k = 0; k < 3; k++)
            at[k] += s->attractor[m].strength * morph_dot(h[k], &y[3 * j]);
    }
}

morph_status morph_settle_adjoint(morph_settle *s, const double *slope, double (*at)[3], double *strength) {
    if (!s->factored) return MORPH_ERR_INPUT;
    double *b = s->g, *y = s->d;
    for (int k = 0; k < 3 * s->joints; k++) {
        b[k] = s->fixed[k / 3] ? 0.0 : slope[k] * s->length_unit;
        y[k] = 0.0;
    }
    const morph_status status = solve(s, b, y);
    if (status != MORPH_OK) return status;
    for (int m = 0; m < s->attractors; m++) {
        double place[3], power;
        centre_slopes(s, y, m, place, &power);
        for (int k = 0; at && k < 3; k++)
            at[m][k] = place[k] / s->length_unit;
        if (strength) strength[m] = power / (s->load * s->length_unit * s->length_unit);
    }
    return MORPH_OK;
}
