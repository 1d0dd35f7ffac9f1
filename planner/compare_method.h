/* The methods of a comparison, one function each. Internal.
 *
 * A method is added by writing its function in compare_method.c (or a file of its own) and naming it in
 * `morph_compare_entries`; table, JSON, page and medians follow. */
#ifndef MORPH_COMPARE_METHOD_H
#define MORPH_COMPARE_METHOD_H

#include "planner/compare.h"
#include "planner/folder_text.h"

/* What the methods of one scene share, filled by those that ran before. */
typedef struct morph_compare_shared {
    const morph_scene *scene;
    morph_workspace work; /* a deformable target: pressed by the pure blanket, once that has run */
    const morph_control *control;
    morph_trajectory nominal; /* of the pure blanket; no frames without it */
    /* Where each method ended, seen with the target at its place: 3*joints, m; NULL: it did not. Owned. */
    double *end[MORPH_COMPARE_METHODS];
    struct morph_placement *placement; /* of the guided blanket; owned, NULL without it */
    morph_compare_row *row;            /* of all methods */
} morph_compare_shared;

typedef struct morph_compare_entry {
    const char *name, *meaning;
    const char *settings; /* members of a JSON object, what the method is run with; "" for none */
    /* Fills *row: measure, outcome, reason; seconds are the caller's. May set shared->end[method]. A status
     * other than MORPH_OK is the caller's to put into words; row->reason goes before them if it is set. NULL:
     * there is no such method yet. */
    morph_status (*run)(morph_compare_shared *shared, morph_compare_row *row);
    bool places; /* centres of its own: not run where the scene wants none */
} morph_compare_entry;

extern const morph_compare_entry morph_compare_entries[MORPH_COMPARE_METHODS];

void morph_compare_shared_free(morph_compare_shared *shared);

/* For methods whose result is a shape: keeps x, seen `lift` above the target's place, as the method's end,
 * measures it, and judges it by every limit of a pose ("feasible", or "infeasible" with the worst). */
morph_status morph_compare_take(morph_compare_shared *shared, morph_compare_method method, const double *x,
                                double lift, morph_compare_row *row);

#endif
