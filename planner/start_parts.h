/* Pieces of a start: its CSV files, its shape from lengths. Internal. Files are read in the "C" locale,
 * whatever the caller's. */
#ifndef MORPH_START_PARTS_H
#define MORPH_START_PARTS_H

#include "model/structure.h"

/* Does the header begin with "joint"? MORPH_ERR_INPUT where the file cannot be read, MORPH_ERR_NOMEM. */
morph_status morph_start_is_pose(const char *file, bool *pose, char *message, size_t size);

/* "joint,x_m,y_m,z_m" and a row per joint, in order: x is 3*joints. MORPH_ERR_INPUT as "FILE:LINE: column N:
 * ...", MORPH_ERR_NOMEM. */
morph_status morph_start_read_pose(const char *file, int joints, double *x, char *message, size_t size);

/* The last row of a file like schedule.csv: *length has `links` numbers, free(). Errors as above. */
morph_status morph_start_read_lengths(const char *file, int links, double **length, char *message,
                                      size_t size);

/* A pose (3*joints, m) with links of `length` (m, to the solver's 1e-8 of a spacing), rigid posts, angles
 * within their limits and links apart, followed from flat. *holds: false where none was found, or where
 * joints are not of the kind that poses are solved for; pose is then untouched. MORPH_ERR_NOMEM. */
morph_status morph_start_shape(const morph_structure_def *def, const double *length, double *pose,
                               bool *holds);

#endif
