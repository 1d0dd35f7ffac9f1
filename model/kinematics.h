/* What lengths alone determine: rank and free motions of links (locked), posts and panels at a pose. */
#ifndef MORPH_KINEMATICS_H
#define MORPH_KINEMATICS_H

#include "model/structure.h"

typedef struct morph_mobility {
    int rows, rank;
    int free;         /* motions left beyond the 6 rigid ones */
    int redundant;    /* rows - rank */
    double sigma_min; /* least singular value of the unit-row matrix, rigid motions projected out; 0 when a
                         motion is free */
} morph_mobility;

/* x: 3*joints. Dense SVD (LAPACK). */
morph_status morph_mobility_at(const morph_structure *s, const double *x, morph_mobility *out);

#endif
