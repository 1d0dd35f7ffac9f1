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

/* The pieces of a vertical line that are cavity: bottom and top, upward; one may begin where another ends. */
typedef struct morph_pieces {
    double (*z)[2];
    int count, capacity;
} morph_pieces;

/* Columns over the box of the skin: column (i, j) stands at lo + (i + 1/2, j + 1/2) width. */
typedef struct morph_columns {
    int nx, ny;
    double lo[2], width[2];
} morph_columns;

/* Called for every column that holds cavity, j fastest. Another result than MORPH_OK ends the sweep. */
typedef morph_status (*morph_piece_visit)(void *data, int i, int j, const morph_pieces *pieces);

/* All columns at x, `cell` wide (m) or wider. *columns is set before the first visit. */
morph_status morph_cavity_sweep(const morph_cavity *cavity, const double *x, double cell,
                                morph_columns *columns, morph_piece_visit visit, void *data);

#endif
