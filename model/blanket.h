/* The blanket: the structure as masses, springs and dampers that falls over the target, or that the target
 * rises into (the paper's section 4). Kick-drift-kick leapfrog; length limits, rigid posts and plane panels
 * held by projection, angle limits too; contact of joints, links and skin with Coulomb friction, swept.
 * With lengths prescribed over time the same dynamics tells what a schedule does to the structure.
 * Deterministic: same input, same bits. */
#ifndef MORPH_BLANKET_H
#define MORPH_BLANKET_H

#include "model/attraction.h"
#include "model/body.h"
#include "model/distance.h"
#include "model/sdf.h"
#include "model/structure.h"

/* The user's hand: a force on one joint over a time window. */
typedef struct morph_hand {
    int joint;
    double force[3]; /* N */
    double from, to; /* s */
} morph_hand;

/* Lengths that the actuators hold, linear between samples, the last for ever. Borrowed. */
typedef struct morph_drive {
    int samples;
    double step;          /* s between samples */
    const double *length; /* samples x links, m */
} morph_drive;

/* Arrays are borrowed for the run; zeroed members are off. */
typedef struct morph_blanket_def {
    double gravity;  /* m/s2, downward */
    double drag;     /* 1/s: force = -drag * mass * velocity */
    double friction; /* Coulomb coefficient */
    double time;     /* s, at most; stops earlier when at rest */
    double frame;    /* s between recorded frames */
    double step;     /* s; 0: from the stiffest spring */
    double base;     /* height of the base plane, NaN for none */
    const morph_attractor *attractors;
    int attractor_count;
    /* Springs that hold posts square to their links (the paper's rectangular angles): energy stiffness/2
     * cos^2 of every angle between a link and its post, N m. 0: posts lean freely between their limits. */
    double square;
    double softening; /* of the attraction, m; 0: one spacing */
    const morph_hand *hands;
    int hand_count;
    const int *fixed; /* joints held where they start */
    int fixed_count;
    /* The target starts this much below its place and rises with the time to it, smoothly (a polynomial of
     * degree 5, at rest with no acceleration at both ends). Where the blanket's limits do not let it follow,
     * the target stays where it is. 0: the target stands. */
    double rise, rise_time;
    double velocity[3];       /* of all free joints at the start, m/s */
    const morph_drive *drive; /* links hold these lengths instead of being springs */
    /* A deformable target in its place, or NULL; the run needs sdf and exact to be NULL then. It is moved
     * with the blanket and left as the last frame has it. Contact is both ways; recorded frames are polished
     * against its surface of that moment. */
    morph_body *body;
    bool unguarded; /* no swept guard after long steps: for comparison */
} morph_blanket_def;

/* Owned arrays; zeroed is empty. */
typedef struct morph_trajectory {
    int frames, joints;
    double *time; /* frames */
    double *x;    /* frames x 3*joints */
    double *lift; /* frames: how far the target stands above its place, m (<= 0) */
} morph_trajectory;
void morph_trajectory_free(morph_trajectory *t);

typedef enum morph_blanket_limit {
    MORPH_BLANKET_LENGTH,
    MORPH_BLANKET_ANGLE,
    MORPH_BLANKET_POST,
    MORPH_BLANKET_PANEL,
    MORPH_BLANKET_CLEARANCE
} morph_blanket_limit;

typedef struct morph_blanket_report {
    int steps, step_halvings;
    int guarded, crossings; /* steps that the swept guard looked at; those that it refused */
    double step;            /* s */
    /* The run was refused: at this time this element, a link or (from `links` on) skin triangle, would have
     * come through the target, however short the steps. */
    bool came_through;
    int through_element;
    double through_time;
    bool at_rest;
    double rest_speed; /* m/s, fastest joint at the end */
    /* Worst violation over the recorded frames (m, relative, sine, m); 0 if none. */
    double worst_length, worst_post, worst_panel, worst_clearance;
    /* Rise only: the target stopped `short_of` below its place, because a limit of this element would have
     * given way. */
    bool held_up;
    double held_time, short_of;
    morph_blanket_limit held_by;
    int held_element; /* link or angle tuple (link-post first, then link-link); -1: none */
    double seconds;
} morph_blanket_report;

/* Runs from x0 (3*joints, at rest; first brought within limits where it is not). Contact uses `sdf` (NULL: no
 * target). `exact` may be NULL or is used to polish recorded frames, to measure worst_clearance, and to tell
 * the motion where between its places parts of the target come through. report may be NULL. On
 * MORPH_ERR_STOPPED the frames so far are in *out; on any other failure *out is empty. MORPH_ERR_NONFINITE if
 * x0 is not finite, or the motion cannot be kept from growing without cause; MORPH_ERR_MOTION if it cannot be
 * kept from coming through the target (report->came_through); MORPH_ERR_INPUT for a negative or non-finite
 * def, a joint that does not exist, or more than 1e6 frames or steps a frame (of the blanket or of the body),
 * a body beside a rigid target. */
morph_status morph_blanket_run(const morph_structure *structure, const morph_sdf *sdf,
                               const morph_distance *exact, const morph_blanket_def *def, const double *x0,
                               const morph_control *control, morph_trajectory *out,
                               morph_blanket_report *report);

#endif
