/* Still pictures of a record, from one drawing routine: SVG or PNG by cairo. */
#ifndef MORPH_PICTURE_H
#define MORPH_PICTURE_H

#include "planner/record.h"

/* Draws: structure, skin and target at four moments of the schedule; the length of one link near the middle
 * over time (with its limits); all lengths over time. The file's ending decides (.svg or .png). Written
 * beside and renamed. MORPH_ERR_INPUT for another ending. */
morph_status morph_picture_write(const morph_record *record, const char *title, const char *file,
                                 char *message, size_t size);

/* The same as SVG text for embedding in a page (free()): panel 0..3 the moments, 4 one link's length, 5 all
 * lengths, 6 nominal blanket's end, 7 plan's end. */
morph_status morph_picture_svg(const morph_record *record, int panel, double width, double height,
                               char **text);

#endif
