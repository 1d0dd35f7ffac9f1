/* Where a placement stands, and trials: centres that the blanket is run under to see whether they are better.
 */
#ifndef MORPH_PLACEMENT_TRIAL_H
#define MORPH_PLACEMENT_TRIAL_H

#include "planner/placement_rounds.h"

/* The blanket run under `centres` centres (metres, N m2), and what was measured where it ends. */
typedef struct morph_trial {
    int centres;
    morph_attractor centre[MORPH_MOST_CENTRES];
    morph_trajectory way; /* owned */
    morph_measure measure;
    /* Of a program's point: rms distance of its joints from where the blanket ends, spacings, and its
     * objective, spacings^4. */
    double difference, predicted;
} morph_trial;

/* A program's own step that was not taken, as the blanket was better farther along it. */
typedef struct morph_branch {
    morph_placement before; /* as it stood, with its own frames */
    double objective;       /* there, spacings^4 */
    morph_trial step;
} morph_branch;
void morph_branch_free(morph_branch *branch);

/* Borrows all it points to but what the branch holds. */
typedef struct morph_placer {
    const morph_workspace *w;
    const morph_scene *scene;
    const morph_placement_options *options;
    morph_placement *out;
    double unit;         /* a joint's weight, N */
    double reach;        /* of the next round, spacings */
    bool bold;           /* the blanket is asked along a program's way too */
    bool leapt;          /* and was better farther along it */
    morph_branch branch; /* where that was first so */
    double *x, *scaled;  /* 3*joints: where the blanket rests, m, and in spacings */
    double objective;    /* there, spacings^4 */
    morph_control quiet;
    double started; /* morph_seconds() */
} morph_placer;

bool morph_placer_late(const morph_placer *p);
/* Of the options' time, what is left, s; 0: no limit. */
double morph_placer_left(const morph_placer *p);
/* The blanket rests at x (3*joints, m) from now on. */
void morph_placer_stand(morph_placer *p, const double *x);
double morph_placer_objective(const morph_placer *p, const morph_measure *m);
/* The last frame's joints. */
const double *morph_placer_end(const morph_placer *p, const morph_trajectory *t);
/* Root mean square distance of joints, spacings; x, y in metres. */
double morph_placer_apart(const morph_placer *p, const double *x, const double *y);

/* A balance *b in which the blanket rests where it lies, under these centres. */
morph_status morph_placer_adopt(morph_placer *p, const morph_attractor *centre, int centres, double epsilon,
                                morph_balance **b, morph_rest *rest);

/* Runs the blanket on under the centres of z, a point of b, and compares where it ends with the shape in z.
 */
morph_status morph_trial_judge(morph_placer *p, const morph_balance *b, const double *z, morph_trial *t);
/* Asks the blanket along the way from the centres `from` to those of *best, which was judged: farther while
 * that is better, nearer where *best is worse than where the placement stands. *best is the best of them. */
morph_status morph_trial_along(morph_placer *p, const morph_attractor *from, morph_trial *best);
/* Takes a trial's centres over; its way goes on from the placement's. */
morph_status morph_trial_accept(morph_placer *p, morph_trial *t);
/* Back to the branch, and on by the step that was not taken there; what was spent since counts. What stands
 * now must be put by before. */
morph_status morph_trial_branch(morph_placer *p);
/* The placement's centres from the start, at other strengths too: takes over what is better, in place of the
 * way on which they were found. */
morph_status morph_trial_afresh(morph_placer *p);

/* The last program, with contacts as hard as they are: what the rounds' smoothing left is shown here, and
 * said in the placement. Its centres are kept if the blanket agrees. */
morph_status morph_placement_last(morph_placer *p);

#endif
