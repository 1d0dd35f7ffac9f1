/* What a point of balance is worth, from the point alone. */
#include "planner/balance.h"

#include "planner/stiffness.h"

#include <stdlib.h>

morph_status morph_balance_examine(morph_balance *b, const double *z, morph_balance_report *out) {
    *out = (morph_balance_report){0};
    const int most = b->rows > b->equalities ? b->rows : b->equalities;
    double *f = morph_alloc((size_t)most, sizeof *f), *lower = morph_alloc((size_t)most, sizeof *lower),
           *upper = morph_alloc((size_t)most, sizeof *upper);
    morph_status status = f && lower && upper ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        const morph_block rows = morph_block_balance(b, lower, upper);
        status = rows.value(b, z, f);
        for (int i = 0; i < b->rows; i++)
            out->residual = fmax(out->residual, fabs(f[i]));
    }
    if (status == MORPH_OK) {
        const morph_block equal = morph_block_equalities(b, lower, upper);
        status = equal.value(b, z, f);
        for (int i = 0; i < b->equalities; i++)
            out->equality = fmax(out->equality, fabs(f[i]));
    }
    for (int q = 0; q < b->limits.count && status == MORPH_OK; q++) {
        const double c = morph_balance_limit_at(b, q, z);
        out->penetration = fmax(out->penetration, -c);
        out->complementarity = fmax(out->complementarity, fabs(z[morph_balance_lambda(b) + q] * c));
    }
    free(f);
    free(lower);
    free(upper);
    if (status != MORPH_OK) return status;
    morph_stiffness *stiffness;
    status = morph_stiffness_create(b, z, &stiffness, &out->stable);
    morph_stiffness_destroy(stiffness);
    return status;
}
