/* A vertical cut through target, skin and cavity, exact: where the plane meets the triangles. */
#ifndef MORPH_CAVITY_SECTION_H
#define MORPH_CAVITY_SECTION_H

#include "model/cavity.h"

/* Between u[0] < u[1]; from height lo[k] to height hi[k] at u[k], straight in between. */
typedef struct morph_trapezoid {
    double u[2], lo[2], hi[2];
} morph_trapezoid;

/* In the plane u is x (axis 0, plane y = at) or y (axis 1, plane x = at); heights are z. All in m. Owned
 * arrays. */
typedef struct morph_cavity_section {
    int axis;
    double at;
    int cavities, solids;
    morph_trapezoid *cavity, *solid; /* air by the definition of the cavity volume; inside of the target */
    double area;                     /* of the cavity, m2 */
    int lines, outlines;
    double (*line)[2][2], (*outline)[2][2]; /* of skin and of target: (u, z) of both ends, in no order */
} morph_cavity_section;

/* x: 3*joints. A corner of a triangle that lies in the plane counts as beyond it. MORPH_ERR_INPUT,
 * MORPH_ERR_NONFINITE, MORPH_ERR_NOMEM: *out is empty then. */
morph_status morph_cavity_section_cut(const morph_cavity *cavity, const double *x, int axis, double at,
                                      morph_cavity_section *out);
void morph_cavity_section_free(morph_cavity_section *section); /* leaves it empty */

#endif
