/* The path: from the flat start to the refined shape, guided by the blanket's trajectory, every limit held
 * also between its poses. */
#ifndef MORPH_PATH_H
#define MORPH_PATH_H

#include "model/blanket.h"
#include "planner/curve.h"
#include "planner/project.h"

typedef struct morph_path_options {
    morph_inset end;      /* the inset that the end pose was solved with */
    morph_inset interior; /* the inset of poses far from the end: room for the spline between them */
    int intervals;        /* to begin with, at least 8 */
    int poses;            /* at most, after all insertions */
    int stations; /* poses on the way from the guide's end to the end, the end among them as the last; 0: none
                   */
    const double *station; /* stations x 3*joints, metres */
    bool unfold;           /* poses stepped back from the end instead of taken from the guide */
    int sweeps;            /* of smoothing and moving inside the limits */
    double smoothness;     /* weight of second differences of poses beside the distance to the guide */
    double seconds;        /* wall; <= 0: none */
    bool refine;           /* false: the guide's poses as they are, nothing solved (the pure blanket) */
    int fine;              /* points examined per interval */
    bool bent;             /* the start is a shape of its own, not where the guide begins */
    bool in_place;         /* at the end the target stands in its place, wherever the guide left it */
    bool smooth;           /* with refine false: smoothed, which takes no solve either */
    bool whole;            /* a path that holds is moved as a whole, and kept where its schedule is shorter */
    bool nearly;           /* with whole: so is one that nearly holds, in case it then does */
    const morph_control *control;
} morph_path_options;
morph_path_options morph_path_defaults(void);

typedef struct morph_path_report {
    int poses, inserted, rows_possible;
    bool moved;           /* as a whole */
    double before, after; /* durations of the path found and of the one moved as a whole, s; 0: not looked at,
                           * or it does not hold */
    int deaths;           /* solves of poses that ended without a result: the poses stayed as they were */
    morph_effort effort;
    double seconds;
    bool feasible;              /* on the fine grid, by exact examination */
    morph_violation violation;  /* worst over the fine grid */
    double where[MORPH_LIMITS]; /* parameter of each */
} morph_path_report;

/* guide: the nominal trajectory; start, end: 3*joints, metres. end must be rigid in its posts and plane in
 * its panels. The curve is returned also where it is not feasible; report says where it breaks. Joints that
 * are held stay where start has them; where the guide's target is lifted the curve's is, and poses are held
 * clear of it where it then stands. */
morph_status morph_path_plan(const morph_world *world, const morph_trajectory *guide, const double *start,
                             const double *end, const morph_path_options *options, morph_curve **out,
                             morph_path_report *report);

#endif
