/* What the readers of tetrahedral meshes share. */
#ifndef MORPH_IMPORT_TETRA_PRIVATE_H
#define MORPH_IMPORT_TETRA_PRIVATE_H

#include "model/tetra.h"
#include "planner/import_private.h"

/* Text being read; a zero byte stands at `end`. */
typedef struct morph_scan {
    const char *p, *end;
    bool comments; /* '#' to the end of the line is passed over */
    const morph_sentence *sentence;
} morph_scan;

/* What a file says, before it is looked at as a mesh. */
typedef struct morph_raw_tetra {
    int vertices, tets;
    double *v;     /* 3 * vertices */
    int (*tet)[4]; /* numbers of vertices, from 0 */
} morph_raw_tetra;

void morph_raw_tetra_free(morph_raw_tetra *raw);

void morph_scan_blank(morph_scan *s);     /* to the next word */
void morph_scan_next_line(morph_scan *s); /* behind the next end of a line */
bool morph_scan_line_ends(morph_scan *s); /* no word more in this line */
bool morph_scan_whole(morph_scan *s, long long *value);
bool morph_scan_number(morph_scan *s, double *value); /* NaN and infinities are numbers here */
/* A count that the remaining bytes can hold at two bytes each. `what` for the sentence. */
morph_status morph_scan_count(morph_scan *s, const char *what, long long *count);
/* Three finite coordinates; number: of the vertex, for the sentence. */
morph_status morph_scan_place(morph_scan *s, long long number, double v[3]);

morph_status morph_read_msh(morph_scan *s, morph_raw_tetra *out);
/* tetgen: vertices and tetrahedra come from two files. */
morph_status morph_read_node(morph_scan *s, int *base, morph_raw_tetra *out);
morph_status morph_read_ele(morph_scan *s, int base, morph_raw_tetra *out);

#endif
