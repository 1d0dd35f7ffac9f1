/* Replay: what a schedule of lengths does to the structure. The blanket's own dynamics with the lengths
 * prescribed, gravity and the scene's support on, attraction off. */
#ifndef MORPH_REPLAY_H
#define MORPH_REPLAY_H

#include "model/blanket.h"
#include "model/cavity.h"
#include "planner/scene.h"

typedef struct morph_replay_report {
    bool done;
    bool at_rest;
    bool floating;         /* nothing carries the structure: replayed without gravity */
    double seconds_of_run; /* simulated, s */
    double length;         /* worst difference of a length from its schedule in any frame, m */
    /* Distance of the joints from the plan's end, rigid motion removed: rigid motion is not actuated. */
    double rms, most;      /* m */
    morph_measure measure; /* of where it ends, laid over the plan's end by that rigid motion */
    double seconds;
} morph_replay_report;

/* What is replayed: `samples` poses and lengths `step` seconds apart. Borrowed. */
typedef struct morph_replay_input {
    const morph_structure *structure;
    const morph_scene *scene; /* gravity, drag, friction, base, support */
    const morph_cavity *cavity;
    const morph_sdf *core; /* the target as a solid, or NULL: the display is empty */
    int samples;
    double step;
    const double *joints, *length; /* samples x 3*joints, samples x links */
} morph_replay_input;

/* Starts from the first pose: on the base plane where that carries it, with the border held for support
 * `frame`, where the schedule has it when the core is there. Ends at rest, or motion.time after the schedule.
 * out: the frames (free with morph_trajectory_free); empty on failure. */
morph_status morph_replay_run(const morph_replay_input *in, const morph_control *control,
                              morph_trajectory *out, morph_replay_report *report);

#endif
