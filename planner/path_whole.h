/* All poses of a path moved together: the last step of the path, which makes its schedule shorter. */
#ifndef MORPH_PATH_WHOLE_H
#define MORPH_PATH_WHOLE_H

#include "planner/blocks.h"
#include "planner/path_parts.h"

/* Objective over MORPH_SWAY poses or fewer that follow each other: scale * sum over links of r^2 with
 *
 *     r = sum over poses k of coefficient_k * length_k / limit,
 *
 * lengths in spacings: a divided difference of a link's length by the path's parameter, over what the drive
 * allows. Local unknowns: the poses in a row, scaled. */
enum { MORPH_SWAY = 3 };
typedef struct morph_sway_term {
    const morph_structure *structure;
    int poses;                      /* at most MORPH_SWAY */
    double coefficient[MORPH_SWAY]; /* of each pose's lengths */
    const double *limit;            /* links, as in the structure: m/s, m/s2 or m/s3 */
    double scale;
} morph_sway_term;
morph_block morph_block_sway(morph_sway_term *data, const int *unknown);

/* Objective: scale * sum over coordinates of r^2, r = sum over poses of coefficient_k x_k. Local unknowns as
 * above. */
typedef struct morph_bend_term {
    int coordinates, poses;
    double coefficient[MORPH_SWAY];
    double scale;
} morph_bend_term;
morph_block morph_block_bend(morph_bend_term *data, const int *unknown);

/* Whether a path of this structure has few enough unknowns to be solved for. */
bool morph_path_whole_fits(const morph_pather *p);

/* Moves all poses between the ends of a path (p, drawn as *curve) by one program over all of them, draws and
 * examines anew, gives the curve room where it breaks limits. What comes out is kept if it holds its limits
 * and the path did not, or its schedule is shorter; else poses, parameters, curve and what the report says of
 * them stay as they were: so too after a stop, without time, where memory is refused and where a solver died
 * (report->deaths). A path that does not fit is left. Always MORPH_OK: there was a path before it. */
morph_status morph_path_whole(morph_pather *p, morph_curve **curve);

#endif
