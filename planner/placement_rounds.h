/* What a round of placement asks of a method: a proposal, which the blanket then judges. */
#ifndef MORPH_PLACEMENT_ROUNDS_H
#define MORPH_PLACEMENT_ROUNDS_H

#include "planner/placement.h"

/* Centres and the shape at rest under them, from `rest`, of which *b holds the limits: z (free it) is a point
 * of balance with the limits that *b has then. moves: centres may go twice as far, spacings; joints as far
 * where the method bounds them. seconds: wall, <= 0: none. *result says how it ended (outcome, solver_text,
 * iterations, evaluations, unknowns, seconds); of its arrays there may be none. Nothing is left behind on
 * failure. */
typedef morph_status (*morph_proposal)(const morph_workspace *w, morph_balance *b,
                                       const morph_placement_options *options, double moves, double seconds,
                                       const morph_rest *rest, double **z, morph_nlp_result *result);

/* The options' own. */
morph_proposal morph_proposal_of(const morph_placement_options *options);

/* By NLopt, without gradients and with them (placement_search.c). */
morph_status morph_propose_free(const morph_workspace *w, morph_balance *b,
                                const morph_placement_options *options, double moves, double seconds,
                                const morph_rest *rest, double **z, morph_nlp_result *result);
morph_status morph_propose_gradient(const morph_workspace *w, morph_balance *b,
                                    const morph_placement_options *options, double moves, double seconds,
                                    const morph_rest *rest, double **z, morph_nlp_result *result);

#endif
