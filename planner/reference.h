/* The reference: how closely the sheet could lie on the target if its links had no limits of length and
 * angle. Posts keep their length; joints, links and skin stay out of target and base plane; links and posts
 * stay out of each other. Solved locally from several starts: not a proven bound. What a plan's objective
 * exceeds it by is what the structure's limits cost. */
#ifndef MORPH_REFERENCE_H
#define MORPH_REFERENCE_H

#include "planner/plan.h"

/* The limits that stand in for none: of lengths in spacings (of braces in start lengths), of angles in
 * radians. A scene's own count where they are wider still. A link cannot vanish and an angle cannot close,
 * as its direction would be lost. */
#define MORPH_REFERENCE_SHORTEST 0.05
#define MORPH_REFERENCE_LONGEST 20.0
#define MORPH_REFERENCE_ANGLE 0.02

typedef struct morph_reference_report {
    bool feasible;
    morph_violation violation; /* of the result */
    int starts;                /* that were solved from, the flat sheet included */
    int best;                  /* the one that led to the result: number of a start, `count` for the flat
                                  sheet; -1: none */
    morph_outcome last;        /* what the last solve of that one concluded */
    morph_effort effort;       /* of all */
    double seconds;
} morph_reference_report;

/* start: `count` poses (3*joints of the workspace's structure each, m, the target at its place); a flat
 * sheet laid on the target's top is a start of its own. x (3*joints) receives the shape with the least
 * objective, *measure what is measured of it. A start that breaks nothing but lengths and angles, by the
 * check's own tolerances, is a result itself: so the reference is never above the objective of a feasible
 * plan whose end is among the starts. Without any feasible shape: the least violating. MORPH_ERR_STOPPED
 * leaves the best so far (x is finite and report->best >= 0 if there is one). MORPH_ERR_INPUT for a
 * workspace without a smooth distance or a structure without posts. */
morph_status morph_reference_solve(const morph_workspace *w, const double *const *start, int count,
                                   const morph_control *control, double *x, morph_measure *measure,
                                   morph_reference_report *report);

/* How far a pose may be beyond its limits for the check to accept it, in the terms of morph_violation. */
void morph_reference_tolerance(const morph_structure *s, double tolerance[MORPH_LIMITS]);

/* The same structure with those limits. */
morph_status morph_reference_structure(const morph_structure *s, morph_structure **out);

#endif
