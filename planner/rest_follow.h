/* The shape at rest followed from one set of centres to another near it, with the same limits throughout: a
 * smooth function of the centres, wherever the way is short. */
#ifndef MORPH_REST_FOLLOW_H
#define MORPH_REST_FOLLOW_H

#include "planner/rest.h"

typedef struct morph_follow_effort {
    int rests, failures; /* all; those without a shape */
    int steps;           /* Newton's, one factorisation each */
    int solves;          /* where those did not end: solves from outside (morph_rest_solve) */
} morph_follow_effort;

/* From `from`, at rest under other centres with limits that are the first of those of *b, to the shape at
 * rest under `centre` (b->centres, scaled), by Newton's method on the balance with lambda c = b->epsilon.
 * Limits that the shape turns out to pass are added to those of *b, behind them. The result has no report;
 * *effort is added to. out->solved: residual and equalities within 1e-9, lambda c within a millionth of
 * epsilon, no limit passed; else out->z is NULL. until (of morph_seconds;
 * INFINITY: none): no solve from outside goes on after it. */
morph_status morph_rest_follow(morph_balance *b, const morph_attractor *centre, const morph_rest *from,
                               double until, const morph_control *control, morph_rest *out,
                               morph_follow_effort *effort);

#endif
