/* Minimises a costly function of a few unknowns within bounds (NLopt behind this header), with or without
 * its gradient.
 *
 * The library is not trusted: it works on the unit box, every value it sees is finite and every point inside,
 * the best point is kept here from all evaluations, and how a search ended is judged by that point. Where the
 * function cannot be evaluated the library is told a value above all others seen. */
#ifndef MORPH_SEARCH_H
#define MORPH_SEARCH_H

#include "solvers/base.h"

typedef enum morph_search_method {
    MORPH_SEARCH_COBYLA, /* linear models on a simplex */
    MORPH_SEARCH_BOBYQA, /* quadratic models */
    MORPH_SEARCH_SBPLX,  /* simplices on subspaces */
    MORPH_SEARCH_SLSQP,  /* these ask for gradients: quadratic subproblems */
    MORPH_SEARCH_MMA,    /* moving asymptotes */
    MORPH_SEARCH_LBFGS
} morph_search_method;
const char *morph_search_name(morph_search_method method);
bool morph_search_asks_gradient(morph_search_method method);

typedef struct morph_search_problem {
    int unknowns;
    const double *lower, *upper; /* finite, lower <= upper; equal ones are held there */
    void *data;
    /* Value at x (unknowns), and where gradient is not NULL the gradient by all unknowns.
     * MORPH_ERR_NONFINITE or MORPH_ERR_BACKEND, or a number that is not finite: a point that cannot be
     * evaluated, counted; MORPH_ERR_STOPPED ends the search like control->stop; any other status ends it as a
     * failure. */
    morph_status (*value)(void *data, const double *x, double *f, double *gradient);
} morph_search_problem;

typedef struct morph_search_options {
    morph_search_method method;
    int max_evaluations; /* >= 1; held exactly */
    double max_seconds;  /* wall, > 0; held to within one evaluation */
    double step;         /* first step of methods without gradients, part of the box's width */
    double step_least;   /* converged when steps are shorter than this part of the box's width */
    double gain_least;   /* or gain less than this part of the value */
    const morph_control *control;
} morph_search_options;
morph_search_options morph_search_defaults(morph_search_method method);

typedef enum morph_search_end {
    MORPH_SEARCH_CONVERGED, /* steps or gains became small, or rounding ended it, at a point better than the
                               start or with little slope */
    MORPH_SEARCH_SPENT,     /* evaluations or time */
    MORPH_SEARCH_HALTED,    /* the caller's stop */
    MORPH_SEARCH_STALLED,   /* ended at the start where the gradient says that it should not: a gradient that
                               is wrong, or a function that is not smooth */
    MORPH_SEARCH_NO_START   /* the start cannot be evaluated */
} morph_search_end;
const char *morph_search_end_text(morph_search_end end);

/* Owned: morph_search_result_free. Zeroed is empty. */
typedef struct morph_search_result {
    morph_search_end end;
    int code;     /* the library's, for the log */
    double *x;    /* unknowns: the best point seen; of NO_START the start */
    double value; /* there; of NO_START NaN */
    double start; /* value at the start */
    double slope; /* largest entry of the projected gradient there by parts of the box; NaN: none was asked */
    int evaluations; /* of which gradients were asked, and which failed: */
    int gradients, failures;
    double seconds;
} morph_search_result;
void morph_search_result_free(morph_search_result *r);

/* From x0 (unknowns; moved into the box first). *out is released on failure. MORPH_ERR_INPUT: options or
 * bounds that cannot be used. Several searches at once are independent. */
morph_status morph_search(const morph_search_problem *problem, const double *x0,
                          const morph_search_options *options, morph_search_result *out);

#endif
