/* The stiffness of a sheet in balance, factorised: how its shape at rest answers forces.
 *
 * At rest (balance.h) with lambda c = epsilon kept on the way, a small change of the balance rows by -f and
 * of the equalities' values by g moves the free joints by u and the posts' and panels' reactions by sigma:
 *
 *     K u - A' sigma = f        K = hess E + hold - sum tau hess e - sum lambda hess c
 *           A u      = g            + sum (lambda / c) grad c grad c'
 *
 * A: gradients of the equalities. K need not be positive definite, only so where A u = 0; so K + STIFF A'A is
 * factorised, and the system is solved with that by the method of multipliers, each step on the residual of
 * both rows. Lengths in spacings, forces in the balance's units. */
#ifndef MORPH_STIFFNESS_H
#define MORPH_STIFFNESS_H

#include "planner/balance.h"

typedef struct morph_stiffness morph_stiffness;

/* At z (unknowns of the balance). *definite: the factor exists; otherwise the shape is not a strict minimum
 * and the object cannot solve. Limits without clearance at z count as if it were 1e-12. */
morph_status morph_stiffness_create(const morph_balance *b, const double *z, morph_stiffness **out,
                                    bool *definite);
/* A blanket that friction holds may lie where without friction there is no minimum. Doubles the balance's
 * hold, which stands for friction, until the shape at z is a strict minimum, and once more if it had to, for
 * shapes near it. *definite: whether it is one now; the hold ends at 100 units per spacing, with which a
 * shape is adopted (rest.h). */
morph_status morph_stiffness_raise_hold(morph_balance *b, const double *z, bool *definite);
void morph_stiffness_destroy(morph_stiffness *k); /* NULL allowed */

/* f, u: rows of the balance; g (NULL: zero), sigma: equalities. u may be f, sigma may be g. *residual (may be
 * NULL): the largest entry of f - K u + A' sigma and g - A u over the largest of |f|, |g| and |K u|: at most
 * 1e-10, unless rounding in a very stiff balance ends the steps before. MORPH_ERR_INPUT without a factor,
 * MORPH_ERR_NONFINITE if something is not finite. */
morph_status morph_stiffness_solve(morph_stiffness *k, const double *f, const double *g, double *u,
                                   double *sigma, double *residual);

#endif
