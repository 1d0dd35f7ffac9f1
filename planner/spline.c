#include "planner/spline.h"
#include "solvers/dense.h"

#include <stdlib.h>
#include <string.h>

static morph_status new_basis(int count, morph_basis *out) {
    *out = (morph_basis){0};
    if (count < MORPH_SPLINE_ORDER) return MORPH_ERR_INPUT;
    out->knot = morph_alloc((size_t)(count + MORPH_SPLINE_ORDER), sizeof(double));
    if (!out->knot) return MORPH_ERR_NOMEM;
    out->count = count;
    return MORPH_OK;
}

morph_status morph_basis_uniform(int count, morph_basis *out) {
    const morph_status status = new_basis(count, out);
    if (status != MORPH_OK) return status;
    const int inner = count - MORPH_SPLINE_ORDER;
    for (int i = 0; i < count + MORPH_SPLINE_ORDER; i++) {
        const double t = (double)(i - MORPH_SPLINE_DEGREE) / (inner + 1);
        out->knot[i] = fmin(1.0, fmax(0.0, t));
    }
    return MORPH_OK;
}

morph_status morph_basis_for_sites(const double *s, int count, morph_basis *out) {
    for (int i = 1; i < count; i++)
        if (!(s[i] > s[i - 1])) return MORPH_ERR_INPUT;
    const morph_status status = new_basis(count, out);
    if (status != MORPH_OK) return status;
    for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
        out->knot[i] = s[0];
        out->knot[count + i] = s[count - 1];
    }
    for (int j = 1; j < count - MORPH_SPLINE_DEGREE; j++) {
        double sum = 0.0;
        for (int i = j; i < j + MORPH_SPLINE_DEGREE; i++)
            sum += s[i];
        out->knot[MORPH_SPLINE_DEGREE + j] = sum / MORPH_SPLINE_DEGREE;
    }
    return MORPH_OK;
}

void morph_basis_free(morph_basis *basis) {
    free(basis->knot);
    *basis = (morph_basis){0};
}

static int find_span(const morph_basis *b, double s) {
    int lo = MORPH_SPLINE_DEGREE, hi = b->count;
    while (hi - lo > 1) {
        const int middle = (lo + hi) / 2;
        if (s < b->knot[middle])
            hi = middle;
        else
            lo = middle;
    }
    return lo;
}

/* Cox and de Boor's recurrence up to a degree: n[i] for control points span - degree + i. */
static void basis_values(const double *knot, int span, double s, int degree, double n[MORPH_SPLINE_ORDER]) {
    n[0] = 1.0;
    for (int p = 1; p <= degree; p++) {
        double carry = 0.0;
        for (int i = 0; i < p; i++) {
            const double left = knot[span - p + 1 + i], right = knot[span + 1 + i];
            const double ratio = n[i] / (right - left);
            n[i] = carry + (right - s) * ratio;
            carry = (s - left) * ratio;
        }
        n[p] = carry;
    }
}

/* The d-th derivative of a degree-p basis is a combination of degree p-d functions: differences of the
 * coefficients' unit vectors, taken d times. N'_{i,p} = p (N_{i,p-1} / (k_{i+p} - k_i) - N_{i+1,p-1} /
 * (k_{i+p+1} - k_{i+1})) */
static void raise_derivative(const double *knot, int span, int degree, const double *lower, double *upper) {
    for (int i = 0; i <= degree; i++) {
        const int at = span - degree + i;
        double v = 0.0;
        if (i > 0) v += lower[i - 1] / (knot[at + degree] - knot[at]);
        if (i < degree) v -= lower[i] / (knot[at + degree + 1] - knot[at + 1]);
        upper[i] = degree * v;
    }
}

int morph_basis_eval(const morph_basis *b, double s, int derivatives, double value[][MORPH_SPLINE_ORDER]) {
    s = fmin(b->knot[b->count], fmax(b->knot[0], s));
    const int span = find_span(b, s);
    for (int d = 0; d <= derivatives; d++) {
        /* Start from the functions of degree 5 - d and differentiate d times on the way up to degree 5. */
        double now[MORPH_SPLINE_ORDER], next[MORPH_SPLINE_ORDER];
        basis_values(b->knot, span, s, MORPH_SPLINE_DEGREE - d, now);
        for (int degree = MORPH_SPLINE_DEGREE - d + 1; degree <= MORPH_SPLINE_DEGREE; degree++) {
            raise_derivative(b->knot, span, degree, now, next);
            memcpy(now, next, sizeof now);
        }
        memcpy(value[d], now, sizeof now);
    }
    return span - MORPH_SPLINE_DEGREE;
}

morph_status morph_spline_fit(const double *s, const double *y, int count, int columns, morph_spline *out) {
    *out = (morph_spline){0};
    morph_status status = morph_basis_for_sites(s, count, &out->basis);
    if (status != MORPH_OK) return status;
    out->columns = columns;
    out->control = morph_alloc((size_t)count * (size_t)columns, sizeof(double));
    double *matrix = morph_alloc((size_t)count * (size_t)count, sizeof(double));
    if (out->control && matrix) {
        for (int k = 0; k < count; k++) {
            double value[1][MORPH_SPLINE_ORDER];
            const int first = morph_basis_eval(&out->basis, s[k], 0, value);
            memcpy(&matrix[(size_t)k * (size_t)count + (size_t)first], value[0], sizeof value[0]);
        }
        memcpy(out->control, y, (size_t)count * (size_t)columns * sizeof *y);
        status = morph_dense_solve(matrix, count, out->control, columns);
    } else {
        status = MORPH_ERR_NOMEM;
    }
    free(matrix);
    if (status != MORPH_OK) morph_spline_free(out);
    return status;
}

void morph_spline_free(morph_spline *spline) {
    morph_basis_free(&spline->basis);
    free(spline->control);
    *spline = (morph_spline){0};
}

void morph_spline_eval(const morph_spline *spline, double s, int derivatives, double *out) {
    double value[MORPH_SPLINE_ORDER][MORPH_SPLINE_ORDER];
    const int first = morph_basis_eval(&spline->basis, s, derivatives, value), n = spline->columns;
    for (int d = 0; d <= derivatives; d++)
        for (int c = 0; c < n; c++) {
            double sum = 0.0;
            for (int i = 0; i < MORPH_SPLINE_ORDER; i++)
                sum += value[d][i] * spline->control[(size_t)(first + i) * (size_t)n + (size_t)c];
            out[(size_t)d * (size_t)n + (size_t)c] = sum;
        }
}
