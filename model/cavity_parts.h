/* The connected cavities under a skin: each piece of air that the skin shuts off, with place and volume.
 *
 * The columns of the cavity volume (model/cavity.h) are cut into vertical pieces, exactly. Two pieces of
 * columns side by side belong to the same cavity where their heights overlap: air above a shelf and air
 * beneath it are one cavity only where a way leads round the shelf. */
#ifndef MORPH_CAVITY_PARTS_H
#define MORPH_CAVITY_PARTS_H

#include "model/cavity.h"

typedef struct morph_cavity_part {
    double volume;       /* m3 */
    double at[3];        /* centroid, m; may lie outside: in the middle of a ring */
    double height;       /* of its highest piece, m */
    double lo[3], hi[3]; /* the box that it fills, m: in plan of whole columns */
    int columns;         /* it stands over so many columns, */
    double area;         /* that is over so much of the plan, m2 */
} morph_cavity_part;

/* volume = sum over all parts + film + small, to rounding. */
typedef struct morph_cavity_parts {
    double volume; /* of everything: that of morph_cavity_volume at the same `cell`, m3 */
    double film;   /* in pieces no higher than `least`, m3 */
    double small;  /* in cavities below `share`, m3 */
    double cell;   /* area of a column, m2 */
    int count;
    morph_cavity_part *part; /* count, largest first; owned */
} morph_cavity_parts;

/* Where a sheet lies on a target, its half-thickness stays between them, and on a round target its flat
 * triangles leave a little more: pieces up to radius + 0.05 spacing high count as a film, not as a way from
 * one cavity to the next. The seeds of placement look for gaps from the same height on (planner/guide.c). */
double morph_cavity_film(const morph_structure *structure);

/* The cavities at x (3*joints, m) by columns `cell` wide (m; wider where there would be more than 400,000).
 * least: pieces up to this height (m, 0 or more; 0: none) join nothing and are summed as film. share:
 * cavities with less than this share of the whole volume are summed as `small` (0: none). MORPH_ERR_INPUT,
 * MORPH_ERR_NONFINITE, MORPH_ERR_NOMEM: *out is empty then. */
morph_status morph_cavity_parts_find(const morph_cavity *cavity, const double *x, double cell, double least,
                                     double share, morph_cavity_parts *out);
void morph_cavity_parts_free(morph_cavity_parts *parts); /* leaves it empty */

#endif
