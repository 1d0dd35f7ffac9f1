#include "solvers/dense.h"

#include <lapacke.h>
#include <stdlib.h>

morph_status morph_singular_values(double *a, int rows, int columns, double *sigma) {
    const size_t total = (size_t)rows * (size_t)columns;
    for (size_t k = 0; k < total; k++)
        if (!isfinite(a[k])) return MORPH_ERR_NONFINITE;
    /* Read column by column the matrix is its transpose, which has the same singular values: no copy needed.
     */
    const lapack_int info =
        LAPACKE_dgesdd(LAPACK_COL_MAJOR, 'N', columns, rows, a, columns, sigma, NULL, columns, NULL, rows);
    if (info == LAPACK_WORK_MEMORY_ERROR || info == LAPACK_TRANSPOSE_MEMORY_ERROR) return MORPH_ERR_NOMEM;
    return info == 0 ? MORPH_OK : MORPH_ERR_BACKEND;
}

morph_status morph_dense_solve(double *a, int n, double *b, int m) {
    lapack_int *pivot = morph_alloc((size_t)n, sizeof *pivot);
    if (!pivot) return MORPH_ERR_NOMEM;
    const lapack_int info = LAPACKE_dgesv(LAPACK_ROW_MAJOR, n, m, a, n, pivot, b, m);
    free(pivot);
    if (info == LAPACK_WORK_MEMORY_ERROR || info == LAPACK_TRANSPOSE_MEMORY_ERROR) return MORPH_ERR_NOMEM;
    return info == 0 ? MORPH_OK : MORPH_ERR_BACKEND;
}

morph_status morph_symmetric_eigen(double *a, int n, double *w) {
    for (int k = 0; k < n * n; k++)
        if (!isfinite(a[k])) return MORPH_ERR_NONFINITE;
    /* Column by column a symmetric matrix is the same, and the eigenvectors come out as our rows. */
    return LAPACKE_dsyev(LAPACK_COL_MAJOR, 'V', 'U', n, a, n, w) == 0 ? MORPH_OK : MORPH_ERR_BACKEND;
}
