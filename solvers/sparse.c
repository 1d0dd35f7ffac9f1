#include "solvers/sparse.h"

#include <cholmod.h>
#include <stdlib.h>
#include <string.h>

struct morph_sparse {
    cholmod_common common;
    bool started, factored;
    cholmod_sparse *a; /* lower triangle with the last values */
    cholmod_factor *factor;
    cholmod_dense *b, *x, *y, *e; /* right side, and what the solver keeps between solves */
    double *residual;             /* n */
    morph_sparse_size size;
};

/* CHOLMOD's functions return 1 whatever happened: only common.status tells. */
static morph_status status_of(const morph_sparse *s) {
    switch (s->common.status) {
    case CHOLMOD_OK:
    case CHOLMOD_NOT_POSDEF: /* told by the factor's minor */
        return MORPH_OK;
    case CHOLMOD_OUT_OF_MEMORY:
    case CHOLMOD_TOO_LARGE:
        return MORPH_ERR_NOMEM;
    default:
        return MORPH_ERR_BACKEND;
    }
}

static bool pattern_ok(int n, const int *start, const int *row) {
    if (n < 1 || start[0] != 0) return false;
    for (int c = 0; c < n; c++) {
        if (start[c + 1] <= start[c] || row[start[c]] != c) return false;
        for (int k = start[c] + 1; k < start[c + 1]; k++)
            if (row[k] <= row[k - 1] || row[k] >= n) return false;
    }
    return true;
}

/* Simplicial and LL': the supernodal code has another licence, and L D L' would go on past a negative pivot.
 * One ordering, so that the factor depends on the pattern alone. Messages are off. */
static void configure(cholmod_common *c) {
    cholmod_start(c);
    c->supernodal = CHOLMOD_SIMPLICIAL;
    c->final_asis = 0;
    c->final_ll = 1;
    c->nmethods = 1;
    c->method[0].ordering = CHOLMOD_AMD;
    c->postorder = 1;
    c->print = 0;
    c->try_catch = 1;
    c->error_handler = NULL;
}

static morph_status build(morph_sparse *s, int n, const int *start, const int *row) {
    const int nonzeros = start[n];
    configure(&s->common);
    s->started = true;
    s->a =
        cholmod_allocate_sparse((size_t)n, (size_t)n, (size_t)nonzeros, 1, 1, -1, CHOLMOD_REAL, &s->common);
    s->b = cholmod_zeros((size_t)n, 1, CHOLMOD_REAL, &s->common);
    s->residual = morph_alloc((size_t)n, sizeof(double));
    if (!s->a || !s->b || !s->residual) return MORPH_ERR_NOMEM;
    memcpy(s->a->p, start, ((size_t)n + 1) * sizeof(int));
    memcpy(s->a->i, row, (size_t)nonzeros * sizeof(int));
    memset(s->a->x, 0, (size_t)nonzeros * sizeof(double));
    s->factor = cholmod_analyze(s->a, &s->common);
    const morph_status status = status_of(s);
    if (status != MORPH_OK) return status;
    if (!s->factor) return MORPH_ERR_BACKEND;
    s->size = (morph_sparse_size){
        .n = n, .nonzeros = nonzeros, .factor_nonzeros = s->common.lnz, .flops = s->common.fl, .analyses = 1};
    return MORPH_OK;
}

morph_status morph_sparse_create(int n, const int *start, const int *row, morph_sparse **out) {
    *out = NULL;
    if (!pattern_ok(n, start, row)) return MORPH_ERR_INPUT;
    morph_sparse *s = morph_alloc(1, sizeof *s);
    if (!s) return MORPH_ERR_NOMEM;
    const morph_status status = build(s, n, start, row);
    if (status != MORPH_OK) {
        morph_sparse_destroy(s);
        return status;
    }
    *out = s;
    return MORPH_OK;
}

void morph_sparse_destroy(morph_sparse *s) {
    if (!s) return;
    if (s->started) {
        cholmod_free_sparse(&s->a, &s->common);
        cholmod_free_factor(&s->factor, &s->common);
        cholmod_free_dense(&s->b, &s->common);
        cholmod_free_dense(&s->x, &s->common);
        cholmod_free_dense(&s->y, &s->common);
        cholmod_free_dense(&s->e, &s->common);
        cholmod_finish(&s->common);
    }
    free(s->residual);
    free(s);
}

morph_sparse_size morph_sparse_sizes(const morph_sparse *s) {
    return s->size;
}

morph_status morph_sparse_factor(morph_sparse *s, const double *value, int *column) {
    *column = -1;
    s->factored = false;
    for (int k = 0; k < s->size.nonzeros; k++)
        if (!isfinite(value[k])) return MORPH_ERR_NONFINITE;
    memcpy(s->a->x, value, (size_t)s->size.nonzeros * sizeof *value);
    cholmod_factorize(s->a, s->factor, &s->common);
    s->size.factorisations++;
    const morph_status status = status_of(s);
    if (status != MORPH_OK) return status;
    if (s->factor->minor < (size_t)s->size.n) {
        /* The failed column's place in the ordering; a natural ordering may be kept as none. */
        const int *order = s->factor->Perm;
        *column = order ? order[s->factor->minor] : (int)s->factor->minor;
        return MORPH_OK;
    }
    if (!s->factor->is_ll) return MORPH_ERR_BACKEND;
    s->factored = true;
    return MORPH_OK;
}

void morph_sparse_times(const morph_sparse *s, const double *value, const double *x, double *out) {
    const int *start = s->a->p, *row = s->a->i, n = s->size.n;
    memset(out, 0, (size_t)n * sizeof *out);
    for (int c = 0; c < n; c++) {
        out[c] += value[start[c]] * x[c];
        for (int k = start[c] + 1; k < start[c + 1]; k++) {
            out[row[k]] += value[k] * x[c];
            out[c] += value[k] * x[row[k]];
        }
    }
}

static double largest(const double *v, int n) {
    double most = 0.0;
    for (int k = 0; k < n; k++)
        most = fmax(most, fabs(v[k]));
    return most;
}

/* |A| as the largest column sum of absolute values of the whole matrix. */
static double matrix_norm(const morph_sparse *s, double *sum) {
    const int *start = s->a->p, *row = s->a->i, n = s->size.n;
    const double *value = s->a->x;
    memset(sum, 0, (size_t)n * sizeof *sum);
    for (int c = 0; c < n; c++)
        for (int k = start[c]; k < start[c + 1]; k++) {
            sum[c] += fabs(value[k]);
            if (row[k] != c) sum[row[k]] += fabs(value[k]);
        }
    return largest(sum, n);
}

morph_status morph_sparse_solve(morph_sparse *s, const double *b, double *x, double *residual) {
    const int n = s->size.n;
    if (!s->factored) return MORPH_ERR_INPUT;
    double *right = s->b->x;
    for (int k = 0; k < n; k++)
        if (!isfinite(b[k])) return MORPH_ERR_NONFINITE;
    memcpy(right, b, (size_t)n * sizeof *b);
    cholmod_solve2(CHOLMOD_A, s->factor, s->b, NULL, &s->x, NULL, &s->y, &s->e, &s->common);
    s->size.solves++;
    const morph_status status = status_of(s);
    if (status != MORPH_OK) return status;
    if (!s->x) return MORPH_ERR_BACKEND;
    memcpy(x, s->x->x, (size_t)n * sizeof *x);
    for (int k = 0; k < n; k++)
        if (!isfinite(x[k])) return MORPH_ERR_NONFINITE;
    if (residual) {
        const double norm = matrix_norm(s, s->residual);
        morph_sparse_times(s, s->a->x, x, s->residual);
        for (int k = 0; k < n; k++)
            s->residual[k] -= right[k];
        const double scale = norm * largest(x, n) + largest(right, n);
        *residual = scale > 0.0 ? largest(s->residual, n) / scale : 0.0;
    }
    return MORPH_OK;
}
