/* The shape at rest under given centres, and the centres whose shape at rest leaves the least cavity. */
#ifndef MORPH_REST_H
#define MORPH_REST_H

#include "planner/balance.h"
#include "planner/project.h"

/* How near to its limit a row must stand to be in a balance, and how far a joint may move before the rows are
 * chosen anew. Spacings, radians. */
extern const morph_nearness morph_rest_nearness;
/* A limit broken by no more than this counts as seen: those that are not are added, and the solve repeated.
 */
extern const morph_nearness morph_rest_missed;
#define MORPH_REST_REACH 0.4
/* Of a pair of axes that has a limit already, more than this is a further limit for the program and where a
 * blanket is adopted. Two rows for one pair made programs that nothing solved: forces of thousands of weights
 * between the rows. What sliding hides stays below what the blanket's end tells from the program's shape
 * (0.02 to 0.05 spacings), and the blanket judges. */
#define MORPH_REST_SLID (-0.01)

/* A point of balance. Owned: morph_rest_free. */
typedef struct morph_rest {
    double *z;           /* unknowns of the balance with these limits */
    morph_limits limits; /* its own copy */
    morph_balance_report report;
    int solves, iterations;
    bool solved; /* the solver ended at an optimum */
} morph_rest;
void morph_rest_free(morph_rest *rest);

/* Minimises the energy with the barrier's parameter epsilon from x (3*joints, scaled), with the limits that x
 * stands near; goes on from where it ends until joints move less than their reach. Leaves the limits of the
 * last solve in *b. centre: b->centres of them, scaled. tau (equalities; may be NULL): of a balance near x:
 * the solve starts warm from there. */
morph_status morph_rest_find(morph_balance *b, const morph_attractor *centre, double epsilon, const double *x,
                             const double *tau, const morph_control *control, morph_rest *out);

/* The same with the limits that *b has, whatever x stands near, in one solve that keeps joints within
 * MORPH_REST_REACH of x (of a shape nearer than about half of that the bounds change little). seconds: wall,
 * <= 0: none. No report. */
morph_status morph_rest_solve(morph_balance *b, const morph_attractor *centre, double epsilon,
                              const double *x, const double *tau, double seconds,
                              const morph_control *control, morph_rest *out);

/* Makes x, where a blanket rests under these centres, a point of balance: what its limits and contacts cannot
 * carry there becomes b->force, and b->anchor is x; b->hold is left as it is. */
morph_status morph_rest_adopt(morph_balance *b, const morph_attractor *centre, double epsilon,
                              const double *x, const morph_control *control, morph_rest *out);

#endif
