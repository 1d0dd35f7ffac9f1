/* Small dense linear algebra over LAPACK. */
#ifndef MORPH_DENSE_H
#define MORPH_DENSE_H

#include "solvers/base.h"

/* Singular values of a (rows x columns, row by row; overwritten), descending, into sigma[min(rows, columns)].
 * MORPH_ERR_NONFINITE for a NaN in a, MORPH_ERR_BACKEND if the iteration fails. */
morph_status morph_singular_values(double *a, int rows, int columns, double *sigma);

/* Solves a X = b by LU with partial pivoting: a (n x n, row by row) is overwritten, b (n x m, row by row)
 * becomes X. MORPH_ERR_BACKEND if a is singular. */
morph_status morph_dense_solve(double *a, int n, double *b, int m);

/* Eigenvalues w[n], ascending, of a symmetric a (n x n, row by row); a's rows become the eigenvectors.
 * MORPH_ERR_NONFINITE for a NaN in a, MORPH_ERR_BACKEND if the iteration fails. */
morph_status morph_symmetric_eigen(double *a, int n, double *w);

#endif
