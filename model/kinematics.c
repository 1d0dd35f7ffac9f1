#include "model/kinematics.h"
#include "solvers/dense.h"

#include <stdlib.h>
#include <string.h>

/* One unit row per member: (d/|d|) at joint b, its negative at joint a, divided by sqrt(2) so that the row
 * has norm 1. */
static void member_row(const double *x, int a, int b, double *row) {
    double d[3];
    morph_sub(&x[3 * b], &x[3 * a], d);
    const double scale = 1.0 / (sqrt(2.0) * morph_norm(d));
    for (int k = 0; k < 3; k++) {
        row[3 * b + k] = scale * d[k];
        row[3 * a + k] = -scale * d[k];
    }
}

morph_status morph_mobility_at(const morph_structure *s, const double *x, morph_mobility *out) {
    const int columns = 3 * s->joints, rows = s->links + s->posts;
    const int least = rows < columns ? rows : columns;
    double *matrix = morph_alloc((size_t)rows, (size_t)columns * sizeof(double));
    double *sigma = morph_alloc((size_t)least, sizeof(double));
    morph_status status = matrix && sigma ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (int l = 0; l < s->links; l++)
            member_row(x, s->link[l][0], s->link[l][1], &matrix[(size_t)l * (size_t)columns]);
        for (int p = 0; p < s->posts; p++)
            member_row(x, s->post[p][0], s->post[p][1], &matrix[(size_t)(s->links + p) * (size_t)columns]);
        status = morph_singular_values(matrix, rows, columns, sigma);
    }
    if (status == MORPH_OK) {
        /* Unit rows give singular values up to about the root of the valence (6); rounding of the SVD is
         * about rows * 2e-16. 1e-9 stands far from both: a value beneath is a motion at first order. */
        const double zero = 1e-9;
        int rank = 0;
        while (rank < least && sigma[rank] > zero)
            rank++;
        out->rows = rows;
        out->rank = rank;
        out->redundant = rows - rank;
        /* Rigid motions lie in the kernel of every member row, so they need no projection: 6 of the columns.
         */
        out->free = columns - 6 - rank;
        out->sigma_min = out->free > 0 ? 0.0 : sigma[columns - 7];
    }
    free(matrix);
    free(sigma);
    return status;
}
