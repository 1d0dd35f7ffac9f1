#include "planner/cavity_objective.h"

#include <stdlib.h>

static morph_status look(morph_cavity_objective *o, const morph_workspace *w, const double *x) {
    const size_t n = 3 * (size_t)w->structure->joints;
    double *metres = morph_alloc(n, sizeof *metres);
    if (!metres) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < n; i++)
        metres[i] = w->structure->spacing * x[i];
    const morph_status status =
        morph_cavity_closest(w->cavity, metres, o->cover_joint, o->cover_weight, NULL);
    free(metres);
    return status;
}

morph_status morph_cavity_objective_create(const morph_workspace *w, const morph_placement_options *options,
                                           const double *x, int centres, int strength,
                                           morph_cavity_objective *out) {
    const size_t exposed = (size_t)w->cavity->exposed;
    morph_cavity_objective o = {.cover_joint = morph_alloc(exposed, sizeof *o.cover_joint),
                                .cover_weight = morph_alloc(exposed, sizeof *o.cover_weight),
                                .zero = morph_alloc((size_t)centres, sizeof *o.zero),
                                .strength = morph_alloc((size_t)centres, sizeof *o.strength)};
    const bool room = o.cover_joint && o.cover_weight && o.zero && o.strength;
    const morph_status status = room ? look(&o, w, x) : MORPH_ERR_NOMEM;
    if (status != MORPH_OK) {
        morph_cavity_objective_free(&o);
        return status;
    }
    for (int m = 0; m < centres; m++)
        o.strength[m] = strength + m;
    /* Rounded over a tenth of a spacing, as in the refinement. */
    o.gap = (morph_gap_term){w->cavity, w->sdf, 0.1, 1.0, true};
    o.cover = (morph_cover_term){
        w->cavity, (const int(*)[3])o.cover_joint, (const double(*)[3])o.cover_weight, options->slide,
        0.0,       options->cover_weight};
    o.thrift = (morph_near_term){centres, o.zero, options->thrift};
    *out = o;
    return MORPH_OK;
}

void morph_cavity_objective_free(morph_cavity_objective *o) {
    free(o->cover_joint);
    free(o->cover_weight);
    free(o->zero);
    free(o->strength);
    *o = (morph_cavity_objective){0};
}

void morph_cavity_objective_blocks(morph_cavity_objective *o, morph_block *blocks) {
    blocks[0] = morph_block_gap(&o->gap, NULL);
    blocks[1] = morph_block_cover(&o->cover, NULL);
    blocks[2] = morph_block_near(&o->thrift, o->strength);
}
