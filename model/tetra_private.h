/* What the files that fill a surface with tetrahedra share. */
#ifndef MORPH_TETRA_PRIVATE_H
#define MORPH_TETRA_PRIVATE_H

#include "model/tetra.h"

/* Moves surface vertices near sharp edges and corners of the target onto them where no tetrahedron suffers
 * much, then improves all by smoothing; surface vertices stay on the target's surface. cell: the size of the
 * tetrahedra, m. */
morph_status morph_tetra_improve(const morph_distance *target, double cell, morph_tetra *mesh);

#endif
