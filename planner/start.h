/* Where a plan starts: flat, at another plan's end pose, or at the pose that measured lengths lead to. */
#ifndef MORPH_START_H
#define MORPH_START_H

#include "planner/scene.h"

/* "flat", "plan", "lengths", "pose" */
const char *morph_start_name(morph_start_kind kind);

/* Reads start->file, which must be set, and fills the rest: a folder is a plan of the same structure
 * (numbering, spacing and all limits, but for links stuck in either), whose last sample counts; a file is
 * told by its header: that of schedule.csv (any number of rows, the last counts), or "joint,x_m,y_m,z_m" with
 * a row per joint. The pose has rigid posts; it must hold the limits of length and angle of `def`, whose
 * stuck links hold the length that they have in it. MORPH_ERR_INPUT with a one-line message, naming file,
 * line and column of a CSV; MORPH_ERR_IO, MORPH_ERR_NOMEM, MORPH_ERR_BACKEND. On failure nothing is kept but
 * file and as_written. */
morph_status morph_start_read(const morph_structure_def *def, morph_start *start, char *message, size_t size);

/* Frees everything and zeroes *start. */
void morph_start_free(morph_start *start);

/* The text of the CSV that gives the same start (a plan folder keeps it): measured lengths as one row of a
 * schedule, else the pose. free(). MORPH_ERR_NOMEM. */
morph_status morph_start_to_csv(const morph_start *start, char **text);

/* Stuck links of a structure hold the length that they have at the start: nothing changes where that is flat.
 */
void morph_start_hold(const morph_start *start, morph_structure *structure);

/* Rigid motion is not actuated, so the pose goes where the flat start would be: nearest to `flat` (3*joints,
 * m) and then with its lowest joint as high as that has its own. out (3*joints) must not alias flat.
 * MORPH_ERR_NONFINITE. */
morph_status morph_start_place(const morph_start *start, const double *flat, double *out);

#endif
