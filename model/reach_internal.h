/* Shared by reach*.c alone: the height grid of a target seen from above, and morphology on it. */
#ifndef MORPH_REACH_INTERNAL_H
#define MORPH_REACH_INTERNAL_H

#include "model/reach.h"

/* Cells i along x, j along y, at [j * n[0] + i]; the target's box in the middle, `pad` cells around it. */
typedef struct morph_heights {
    int n[2], pad[2];
    double cell[2], lo[2]; /* middle of cell (i, j) is lo + (i, j) * cell */
    double floor;          /* base plane, or the target's lowest point */
    double *top;           /* first hit from above, the floor elsewhere */
    bool *seen;            /* exposed: the first hit is above the floor */
    double *closed;        /* what a ball rolling over the top leaves open, filled */
    double *over;          /* least surface of the sheet */
    int exposed;
    double hidden; /* share of the surface below other surface */
} morph_heights;

typedef struct morph_heights_limits {
    double ball;  /* radius of the ball that closes, m */
    double slope; /* largest along x and y */
    double shear; /* what a line may fall beyond that, m */
} morph_heights_limits;
morph_status morph_heights_create(const morph_distance *target, double base, double spacing,
                                  const morph_heights_limits *limits, morph_heights *out);
void morph_heights_free(morph_heights *r);

/* What is left of the top once level parts in which no disc of this radius fits are taken away; `out`: one
 * value per cell. */
morph_status morph_heights_open(const morph_heights *r, double radius, double *out);

static inline size_t morph_heights_at(const morph_heights *r, int i, int j) {
    return (size_t)j * (size_t)r->n[0] + (size_t)i;
}
/* Place of a cell on the top surface. */
static inline void morph_heights_point(const morph_heights *r, int i, int j, double out[3]) {
    out[0] = r->lo[0] + i * r->cell[0];
    out[1] = r->lo[1] + j * r->cell[1];
    out[2] = r->top[morph_heights_at(r, i, j)];
}

#endif
