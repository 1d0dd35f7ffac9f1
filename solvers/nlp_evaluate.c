/* Values and derivatives at a point, cached by comparing the point with a stored copy. */
#include "solvers/nlp_internal.h"

#include <string.h>

/* Moves the cache to x; what was known of another point is forgotten. */
static void move_to(morph_nlp *nlp, const double *x) {
    const size_t bytes = (size_t)nlp->unknowns * sizeof *x;
    if (nlp->at_x && memcmp(nlp->x, x, bytes) == 0) return;
    memcpy(nlp->x, x, bytes);
    nlp->at_x = true;
    nlp->has_objective = nlp->has_rows = nlp->has_gradient = nlp->has_jacobian = false;
    nlp->points++;
}

/* The block's own unknowns, gathered from the cached point. */
static const double *local_x(const morph_nlp *nlp, const morph_nlp_block *b) {
    if (!b->unknown) return nlp->x;
    for (int i = 0; i < b->def.unknowns; i++)
        nlp->local[i] = nlp->x[b->unknown[i]];
    return nlp->local;
}

/* 0 * v is 0 for a finite v and NaN for the others, so one sum tells. */
static bool all_finite(const double *v, int n) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += 0.0 * v[i];
    return sum == 0.0;
}

/* v may be NULL when there is nothing to fill, as in a problem without second derivatives. */
static void fill_zero(double *v, int n) {
    for (int i = 0; i < n; i++)
        v[i] = 0;
}

morph_status morph_nlp_objective_at(morph_nlp *nlp, const double *x) {
    move_to(nlp, x);
    if (nlp->has_objective) return MORPH_OK;
    double sum = 0;
    for (int k = 0; k < nlp->block_count; k++) {
        const morph_nlp_block *b = &nlp->blocks[k];
        if (b->first_row >= 0) continue;
        double f = 0;
        const morph_status status = b->def.value(b->def.data, local_x(nlp, b), &f);
        if (status != MORPH_OK) return status;
        sum += f;
    }
    if (!isfinite(sum)) return MORPH_ERR_NONFINITE;
    nlp->objective = sum;
    nlp->has_objective = true;
    return MORPH_OK;
}

morph_status morph_nlp_rows_at(morph_nlp *nlp, const double *x) {
    move_to(nlp, x);
    if (nlp->has_rows) return MORPH_OK;
    for (int k = 0; k < nlp->block_count; k++) {
        const morph_nlp_block *b = &nlp->blocks[k];
        if (b->first_row < 0) continue;
        const morph_status status = b->def.value(b->def.data, local_x(nlp, b), nlp->row_value + b->first_row);
        if (status != MORPH_OK) return status;
    }
    if (!all_finite(nlp->row_value, nlp->rows)) return MORPH_ERR_NONFINITE;
    nlp->has_rows = true;
    return MORPH_OK;
}

/* One walk of one block at the cached point. Values are added; NULL: not asked. */
static morph_status walk(morph_nlp *nlp, const morph_nlp_block *b, const double *weight, double *jacobian,
                         double *hessian) {
    morph_sink sink = {
        .wants_jacobian = jacobian != NULL,
        .wants_hessian = hessian != NULL,
        .rows = b->def.rows > 0 ? b->def.rows : 1,
        .unknowns = b->def.unknowns,
        .jacobian = b->jacobian,
        .hessian = b->hessian,
        .jacobian_count = b->jacobian_count,
        .hessian_count = b->hessian_count,
        .jacobian_value = jacobian,
        .hessian_value = hessian,
    };
    const morph_status status = b->def.walk(b->def.data, local_x(nlp, b), weight, &sink);
    if (status != MORPH_OK) return status;
    if (sink.mismatch || (jacobian && sink.jacobian_next != sink.jacobian_count) ||
        (hessian && sink.hessian_next != sink.hessian_count))
        return MORPH_ERR_INTERNAL;
    return MORPH_OK;
}

morph_status morph_nlp_gradient_at(morph_nlp *nlp, const double *x) {
    move_to(nlp, x);
    if (nlp->has_gradient) return MORPH_OK;
    fill_zero(nlp->gradient, nlp->unknowns);
    for (int k = 0; k < nlp->block_count; k++) {
        const morph_nlp_block *b = &nlp->blocks[k];
        if (b->first_row >= 0) continue;
        const morph_status status = walk(nlp, b, nlp->ones, nlp->gradient, NULL);
        if (status != MORPH_OK) return status;
    }
    if (!all_finite(nlp->gradient, nlp->unknowns)) return MORPH_ERR_NONFINITE;
    nlp->has_gradient = true;
    return MORPH_OK;
}

morph_status morph_nlp_jacobian_at(morph_nlp *nlp, const double *x) {
    move_to(nlp, x);
    if (nlp->has_jacobian) return MORPH_OK;
    fill_zero(nlp->jacobian_value, nlp->jacobian.count);
    for (int k = 0; k < nlp->block_count; k++) {
        const morph_nlp_block *b = &nlp->blocks[k];
        if (b->first_row < 0) continue;
        const morph_status status = walk(nlp, b, nlp->ones, nlp->jacobian_value, NULL);
        if (status != MORPH_OK) return status;
    }
    if (!all_finite(nlp->jacobian_value, nlp->jacobian.count)) return MORPH_ERR_NONFINITE;
    nlp->has_jacobian = true;
    return MORPH_OK;
}

static bool all_zero(const double *v, int n) {
    for (int i = 0; i < n; i++)
        if (v[i] != 0.0) return false;
    return true;
}

morph_status morph_nlp_hessian_at(morph_nlp *nlp, const double *x, double factor, const double *multiplier,
                                  double *values) {
    move_to(nlp, x);
    fill_zero(values, nlp->hessian.count);
    for (int k = 0; k < nlp->block_count; k++) {
        const morph_nlp_block *b = &nlp->blocks[k];
        const double *weight = b->first_row < 0 ? &factor : multiplier + b->first_row;
        /* Nothing is added for weights of zero: restoration asks with factor 0, resting rows have none. */
        if (b->hessian_count == 0 || all_zero(weight, b->first_row < 0 ? 1 : b->def.rows)) continue;
        const morph_status status = walk(nlp, b, weight, NULL, values);
        if (status != MORPH_OK) return status;
    }
    return all_finite(values, nlp->hessian.count) ? MORPH_OK : MORPH_ERR_NONFINITE;
}

/* How far v is outside [lower, upper]; infinite for NaN. */
static double outside(double v, double lower, double upper) {
    if (isnan(v)) return INFINITY;
    return fmax(0.0, fmax(lower - v, v - upper));
}

double morph_nlp_violation(const morph_nlp *nlp, const double *x, const double *rows, int *worst_row) {
    double worst = 0;
    int where = -1;
    for (int r = 0; r < nlp->rows; r++) {
        const double v = outside(rows[r], nlp->row_lower[r], nlp->row_upper[r]);
        if (v > worst) {
            worst = v;
            where = r;
        }
    }
    for (int i = 0; i < nlp->unknowns; i++) {
        const double v = outside(x[i], nlp->lower[i], nlp->upper[i]);
        if (v > worst) {
            worst = v;
            where = -1;
        }
    }
    if (worst_row) *worst_row = where;
    return worst;
}

morph_status morph_nlp_evaluate(morph_nlp *nlp, const double *x, double *objective, double *rows) {
    nlp->at_x = false; /* everything anew: this is what benchmarks time */
    morph_status status = morph_nlp_objective_at(nlp, x);
    if (status == MORPH_OK) status = morph_nlp_rows_at(nlp, x);
    if (status == MORPH_OK) status = morph_nlp_gradient_at(nlp, x);
    if (status == MORPH_OK) status = morph_nlp_jacobian_at(nlp, x);
    if (status == MORPH_OK) status = morph_nlp_hessian_at(nlp, x, 1.0, nlp->ones, nlp->hessian_value);
    if (status != MORPH_OK) return status;
    if (objective) *objective = nlp->objective;
    if (rows) memcpy(rows, nlp->row_value, (size_t)nlp->rows * sizeof *rows);
    return MORPH_OK;
}

morph_status morph_nlp_objective(morph_nlp *nlp, const double *x, double *objective, double *gradient) {
    morph_status status = morph_nlp_objective_at(nlp, x);
    if (status == MORPH_OK && gradient) status = morph_nlp_gradient_at(nlp, x);
    if (status != MORPH_OK) return status;
    *objective = nlp->objective;
    if (gradient) memcpy(gradient, nlp->gradient, (size_t)nlp->unknowns * sizeof *gradient);
    return MORPH_OK;
}
