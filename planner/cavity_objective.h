/* What placement minimises: the cavity that a shape leaves, and a little thrift of strengths. The closest
 * points of the target on the skin are looked up once, at the shape that a program or a search starts from.
 */
#ifndef MORPH_CAVITY_OBJECTIVE_H
#define MORPH_CAVITY_OBJECTIVE_H

#include "planner/placement.h"

enum { MORPH_CAVITY_BLOCKS = 3 };

/* Filled by morph_cavity_objective_create; must not move while blocks of it are in use. Zeroed is empty. */
typedef struct morph_cavity_objective {
    int (*cover_joint)[3];
    double (*cover_weight)[3];
    double *zero;  /* centres: what thrift draws strengths to */
    int *strength; /* centres: numbers of the strengths among the unknowns */
    morph_gap_term gap;
    morph_cover_term cover;
    morph_near_term thrift;
} morph_cavity_objective;

/* x: coordinates (spacings) at the start; they are the first unknowns, and the strengths of the centres are
 * those from `strength` on. MORPH_ERR_NOMEM. */
morph_status morph_cavity_objective_create(const morph_workspace *w, const morph_placement_options *options,
                                           const double *x, int centres, int strength,
                                           morph_cavity_objective *out);
void morph_cavity_objective_free(morph_cavity_objective *o);

/* The objective blocks of a program: MORPH_CAVITY_BLOCKS of them; they borrow *o. */
void morph_cavity_objective_blocks(morph_cavity_objective *o, morph_block *blocks);

#endif
