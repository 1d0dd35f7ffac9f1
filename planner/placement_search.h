/* Placement as a search over centres and strengths alone: the shape at rest is computed inside. */
#ifndef MORPH_PLACEMENT_SEARCH_H
#define MORPH_PLACEMENT_SEARCH_H

#include "planner/placement_rounds.h"
#include "planner/rest_follow.h"
#include "solvers/search.h"

/* Cavity of the shape at rest as a function of the centres, from one shape at rest on: closest points of the
 * target and limits are those near it. Four unknowns a centre: x, y, z (spacings), strength (unit times
 * spacing^2). */
typedef struct morph_rest_cavity morph_rest_cavity;

/* b: as morph_rest_adopt leaves it, with its limits those of `rest`, which is at rest. Limits within
 * `nearness` (NULL: as far as a search is likely to go) are added to *b, and later those that a shape passes.
 * Keeps w, b and options; copies rest. seconds (<= 0: none):
 * wall from now, after which only short ways to a shape are tried. MORPH_ERR_BACKEND if the shape with all
 * these limits is not found. */
morph_status morph_rest_cavity_create(const morph_workspace *w, morph_balance *b,
                                      const morph_placement_options *options, const morph_rest *rest,
                                      const morph_nearness *nearness, double seconds,
                                      morph_rest_cavity **out);
void morph_rest_cavity_destroy(morph_rest_cavity *c); /* NULL allowed */

/* The program's objective (gap, cover, thrift) at rest under centres p (4*centres), and where gradient is not
 * NULL its gradient by the adjoint: with K u - A' sigma = dJ/dx, A u = 0 (stiffness.h),
 *
 *     dJ/dp = (direct) - u . dr/dp
 *
 * MORPH_ERR_NONFINITE if there is no such shape, or for a gradient, if it is no strict minimum. The shape is
 * followed from that of the least value so far. */
morph_status morph_rest_cavity_value(morph_rest_cavity *c, const double *p, double *f, double *gradient);

/* The shape of the least value so far; stands until the next call. */
const morph_rest *morph_rest_cavity_best(const morph_rest_cavity *c);
morph_follow_effort morph_rest_cavity_effort(const morph_rest_cavity *c);
/* Largest residual of an adjoint solve so far. */
double morph_rest_cavity_adjoint_residual(const morph_rest_cavity *c);

/* A proposal (placement_rounds.h) by this method. */
morph_status morph_placement_search(const morph_workspace *w, morph_balance *b,
                                    const morph_placement_options *options, morph_search_method method,
                                    double moves, double seconds, const morph_rest *rest, double **z,
                                    morph_nlp_result *result);

#endif
