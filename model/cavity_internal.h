/* Shared by cavity*.c alone. */
#ifndef MORPH_CAVITY_INTERNAL_H
#define MORPH_CAVITY_INTERNAL_H

#include "model/cavity.h"

/* The skin at x as an open surface with its tree; with `fan` closed by a fan from the centroid of its border
 * (vertex number `joints`). Vertex numbers are joint numbers. The caller destroys *out. */
morph_status morph_skin_surface(const morph_structure *structure, const double *x, bool fan,
                                morph_distance **out);

/* All crossings of a vertical line; grows as needed. */
typedef struct morph_hits {
    double *z;
    int *sign;
    int count, capacity;
} morph_hits;
void morph_hits_free(morph_hits *hits);
morph_status morph_hits_find(const morph_distance *d, double x, double y, morph_hits *hits);

#endif
