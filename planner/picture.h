/* Still pictures of a record, from one drawing routine: SVG or PNG by cairo. */
#ifndef MORPH_PICTURE_H
#define MORPH_PICTURE_H

#include "planner/record.h"

enum { MORPH_PICTURE_MOTIONS = 4 };
extern const char *const morph_picture_motions[MORPH_PICTURE_MOTIONS]; /* schedule, blanket, replay, core */

/* Makes `motion` the one that a picture of the record shows, by dropping the others from it: the schedule,
 * the pure blanket, what the lengths alone lead to, the same with the target as a solid core. MORPH_ERR_INPUT
 * with a message for another name or where the record has no such motion, MORPH_ERR_NOMEM. */
morph_status morph_picture_select(morph_record *record, const char *motion, char *message, size_t size);

/* Draws: structure, skin and target at four moments of the schedule; the length of one link near the middle
 * over time (with its limits); all lengths over time. The file's ending decides (.svg or .png). Written
 * beside and renamed. MORPH_ERR_INPUT for another ending. */
morph_status morph_picture_write(const morph_record *record, const char *title, const char *file,
                                 char *message, size_t size);

/* Draws the cavities of the pure blanket's end (left) and of the plan's end (right): the skin coloured by its
 * gap, two exact vertical cuts through the blanket's largest cavity, volumes and mean gaps. MORPH_ERR_INPUT
 * with a message where the plan lacks one of the two, a skin or a target. */
morph_status morph_picture_cavity(const morph_record *record, const char *file, char *message, size_t size);

/* Parts of morph_picture_write as SVG text for embedding in a page (free()): panel 0..3 the moments, 4 one
 * link's length, 5 all lengths, 6 nominal blanket's end, 7 plan's end. */
morph_status morph_picture_svg(const morph_record *record, int panel, double width, double height,
                               char **text);

#endif
