/* The blanket: the structure as masses, springs and dampers that falls over the target (the paper's section
 * 4). Kick-drift-kick leapfrog; length limits and rigid posts held by projection, angle limits too; contact
 * of joints, links and skin with Coulomb friction. Deterministic: same input, same bits. */
#ifndef MORPH_BLANKET_H
#define MORPH_BLANKET_H

#include "model/distance.h"
#include "model/sdf.h"
#include "model/structure.h"

typedef struct morph_blanket_def {
    double gravity;  /* m/s2, downward */
    double drag;     /* 1/s: force = -drag * mass * velocity */
    double friction; /* Coulomb coefficient */
    double time;     /* s, at most; stops earlier when at rest */
    double frame;    /* s between recorded frames */
    double step;     /* s; 0: from the stiffest spring */
    double base;     /* height of the base plane, NaN for none */
} morph_blanket_def;

/* Owned arrays; zeroed is empty. */
typedef struct morph_trajectory {
    int frames, joints;
    double *time; /* frames */
    double *x;    /* frames x 3*joints */
} morph_trajectory;
void morph_trajectory_free(morph_trajectory *t);

typedef struct morph_blanket_report {
    int steps, step_halvings;
    double step; /* s */
    bool at_rest;
    double rest_speed; /* m/s, fastest joint at the end */
    double worst_length, worst_post,
        worst_clearance; /* worst violation over the recorded frames (m, relative, m); 0 if none */
    double seconds;
} morph_blanket_report;

/* Runs from x0 (3*joints, at rest; first brought within limits where it is not). Contact uses `sdf` (NULL: no
 * target). `exact` may be NULL or is used to polish recorded frames, and then to measure worst_clearance; it
 * does not change the motion. report may be NULL. On MORPH_ERR_STOPPED the frames so far are in *out; on any
 * other failure *out is empty. MORPH_ERR_NONFINITE if x0 is not finite or the motion cannot be kept from
 * growing without cause; MORPH_ERR_INPUT for a negative or non-finite def, or more than 1e6 frames or steps a
 * frame. */
morph_status morph_blanket_run(const morph_structure *structure, const morph_sdf *sdf,
                               const morph_distance *exact, const morph_blanket_def *def, const double *x0,
                               const morph_control *control, morph_trajectory *out,
                               morph_blanket_report *report);

#endif
