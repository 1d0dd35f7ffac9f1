/* Cholesky factorisation of sparse symmetric positive definite matrices (CHOLMOD, simplicial).
 *
 * One analysis (minimum degree ordering) per pattern, any number of numerical factorisations after it. The
 * same input gives the same bits. Not for use by two threads at once; several objects are independent. */
#ifndef MORPH_SPARSE_H
#define MORPH_SPARSE_H

#include "solvers/base.h"

typedef struct morph_sparse morph_sparse;

typedef struct morph_sparse_size {
    int n, nonzeros;                      /* of the lower triangle given */
    double factor_nonzeros;               /* of the factor, by the analysis */
    double flops;                         /* of one factorisation */
    int analyses, factorisations, solves; /* so far; those that found the matrix indefinite count too */
} morph_sparse_size;

/* Pattern of the lower triangle with its whole diagonal, column by column: column c holds rows
 * row[start[c]] .. row[start[c + 1] - 1], ascending, the first being c. start: n + 1 entries. Both are
 * copied. MORPH_ERR_INPUT for a pattern that is not so, MORPH_ERR_NOMEM also where it is too large for 32-bit
 * indices. */
morph_status morph_sparse_create(int n, const int *start, const int *row, morph_sparse **out);
void morph_sparse_destroy(morph_sparse *s); /* NULL allowed */
morph_sparse_size morph_sparse_sizes(const morph_sparse *s);

/* value: one number per entry of the pattern, in its order; copied. *column is -1, or, with MORPH_OK, the
 * column (in the caller's numbering) at which the matrix turned out not to be positive definite: there is no
 * factor then. MORPH_ERR_NONFINITE if a value is not finite. */
morph_status morph_sparse_factor(morph_sparse *s, const double *value, int *column);

/* Solves A x = b with the last factor; x may be b. residual (may be NULL): |b - A x| / (|A| |x| + |b|) in the
 * largest norm. MORPH_ERR_INPUT without a factor, MORPH_ERR_NONFINITE if b or x is not finite (x is then
 * undefined). */
morph_status morph_sparse_solve(morph_sparse *s, const double *b, double *x, double *residual);

/* out = A x for any values on the pattern; out must not be x. */
void morph_sparse_times(const morph_sparse *s, const double *value, const double *x, double *out);

#endif
