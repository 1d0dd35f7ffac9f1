/* Inside the path: what path.c, path_kept.c and path_whole.c share. Not for others. */
#ifndef MORPH_PATH_PARTS_H
#define MORPH_PATH_PARTS_H

#include "planner/path.h"

/* A path in the making: its poses with their parameters. */
typedef struct morph_pather {
    const morph_world *world; /* here */
    morph_world here;         /* the world with the target where it stands at the pose in hand */
    const morph_path_options *options;
    morph_path_report *report;
    int coordinates, count, capacity;
    double *s;      /* capacity: parameter */
    double *x;      /* capacity x coordinates, scaled */
    double *inset;  /* capacity: extra factor on the inset of a pose */
    double *metres; /* capacity x coordinates */
    double *lift;   /* capacity: the target above its place, m */
    bool rises;
    bool end_breaks; /* a limit: no pose inserted before it helps */
    morph_active *active;
    double started;
} morph_pather;

/* The inset of a pose at parameter s with its own factor. */
morph_inset morph_path_inset(const morph_pather *p, double s, double factor);

/* Whether the caller wants an end, or the seconds are used up. */
bool morph_path_out_of_time(const morph_pather *p);

/* Draws the curve through the poses, examines it, and inserts poses until it holds its limits or no more of
 * them help; the curve that comes nearest is returned with its poses, and the report is of it. */
morph_status morph_path_mend(morph_pather *p, morph_curve **curve);

/* Draws the curve through the poses and examines it. Where it breaks a limit between two poses by little,
 * these are to keep twice their distance from limits; where by more, or with poses, a pose of the curve
 * itself comes between them. *more: the poses are to be moved anew. */
morph_status morph_path_give_room(morph_pather *p, morph_curve **curve, bool poses, bool *more);

/* A path put aside: its poses, its curve and what there is to say of it. */
typedef struct morph_kept {
    int count;
    double *s, *x, *inset, *lift; /* owned */
    morph_curve *curve;           /* owned */
    double duration;
    bool feasible;
    morph_violation violation;
    double where[MORPH_LIMITS];
} morph_kept;
void morph_kept_free(morph_kept *k); /* empty after it */

/* Takes the curve over (there may be none), and the place of what was put aside before. MORPH_ERR_NOMEM: both
 * stay. */
morph_status morph_keep(const morph_pather *p, morph_curve **curve, double duration, morph_kept *k);

/* The path in hand is again the one that was put aside; its curve takes the place of *curve. There is room: a
 * path in the making never shrinks its memory. */
void morph_put_back(morph_kept *k, morph_pather *p, morph_curve **curve);

#endif
