/* Inside the structure: counting its parts and placing them. For model/structure*.c only. */
#ifndef MORPH_STRUCTURE_BUILD_H
#define MORPH_STRUCTURE_BUILD_H

#include "model/structure.h"

/* All counts but those of fixed parts, from s->def. */
void morph_structure_count(morph_structure *s);

/* Fills every array but those of fixed parts. x_link[n], y_link[n] (joints): becomes the link that leaves
 * joint n towards larger x or y, -1 at the border. */
void morph_structure_place(morph_structure *s, int *x_link, int *y_link);

#endif
