/* The final shape: from the blanket at rest to the pose that lies closest on the target within every limit.
 */
#ifndef MORPH_REFINE_H
#define MORPH_REFINE_H

#include "planner/goal.h"
#include "planner/project.h"

typedef struct morph_refine_options {
    morph_inset inset;
    double cover_weight; /* w_c */
    double slide;        /* pull across the target's normal, relative to along it */
    double press;        /* weight of |gap| beside gap^2 at the target's points */
    double blend;        /* width over which the kink between target and base plane is rounded, spacings */
    double reach;        /* how far a joint may move in one round, spacings: rows are chosen for that reach */
    double upright;      /* weight of cos^2 between posts and their links */
    double least_reach;  /* below this it is settled */
    double hold;         /* weight that keeps free joints where they stand */
    int rounds;          /* solves, at most */
    double seconds;      /* wall; <= 0: none */
    morph_goal goal;     /* hard; while it is missed, up to three times as many rounds */
    const morph_control *control;
} morph_refine_options;
morph_refine_options morph_refine_defaults(void);

typedef struct morph_refine_report {
    int rounds, rows_possible;
    int deaths; /* solves that ended without a result (MORPH_ERR_BACKEND, MORPH_ERR_NOMEM): the best before is
                   kept, and the second in a row ends the rounds */
    morph_effort effort; /* of all solves */
    double seconds;
    bool feasible;             /* by the exact examination of the returned pose, inset not counted */
    morph_violation violation; /* of the returned pose */
    int stations;              /* poses that were kept on the way, the first inside its limits first */
    double *station;           /* stations x 3*joints, metres; owned: morph_refine_report_free */
    morph_outcome last;        /* what the last solve concluded */
    double miss;               /* of the goal, by exact measures, see morph_goal_miss; 0: reached, or none */
    char against[400];         /* where it is missed by a feasible pose: the limits that stood against it */
} morph_refine_report;

void morph_refine_report_free(morph_refine_report *report);

/* x (3*joints, metres) is start and result: the feasible pose with the least cavity objective that was found,
 * the start included; where none is feasible, the least violating one. With a goal a pose that misses it by
 * less goes before one with less objective. MORPH_ERR_STOPPED leaves the best so
 * far in x. */
morph_status morph_refine(const morph_world *world, const morph_refine_options *options, double *x,
                          morph_refine_report *report);

#endif
