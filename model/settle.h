/* The blanket's resting shape without its motion: quasi-static Newton on the blanket's own energy and limits.
 *
 *     minimise  gravity + link springs + attraction + friction's part
 *     subject to  posts rigid, lengths and angles within their limits, joints, links and skin outside the
 *                 target by their radius, joints above the base plane by theirs, fixed joints where they
 * start
 *
 * in implicit steps of a motion without mass (each joint resists being moved by an equal viscous force), the
 * step growing without bound as the shape comes to rest: the sheet falls, touches and drapes as the blanket
 * does, only without swinging. Limits are held by multipliers (augmented Lagrangian); Newton's steps use the
 * exact Hessian as far as it is positive definite. Friction is Coulomb's law in increments: every contact has
 * a tangential spring that slides on the cone of its normal force, anchored where contact began; what slides
 * drags the anchor along. Without inertia it is not the same sliding as in the blanket: with friction there
 * are many resting shapes. Without friction and without anything to hold it a sheet may have none: the report
 * says so.
 *
 * Deterministic: the same calls give the same bits. Objects are independent; one serves one thread at a time.
 */
#ifndef MORPH_SETTLE_H
#define MORPH_SETTLE_H

#include "model/attraction.h"
#include "model/distance.h"
#include "model/sdf.h"
#include "model/structure.h"

typedef struct morph_settle_def {
    double gravity;                   /* m/s2, downward */
    double friction;                  /* Coulomb coefficient; 0: none */
    double base;                      /* height of the base plane, NaN for none */
    const morph_attractor *attractor; /* copied */
    int attractors;
    double softening; /* of all centres, m; 0: one spacing */
    const int *fixed; /* joint numbers, copied */
    int fixed_joints;
    /* Of the same target, or NULL: the deepest places of links and skin are then found and held by exact
     * distances, where the smooth ones round its edges. Must outlive the object. */
    const morph_distance *exact;
    double
        tolerance; /* residual force on a joint, in its weights (but at least 1e-3 of it in loads, below) */
    int most_steps;
} morph_settle_def;

/* gravity 9.81, no friction, no base, no centres, tolerance 1e-6, 1000 steps. */
morph_settle_def morph_settle_defaults(void);

typedef enum morph_settle_outcome {
    MORPH_SETTLE_RESTS, /* residual and limits within their tolerances */
    MORPH_SETTLE_FALLS, /* no rest exists: it lost the target and falls with nothing beneath */
    MORPH_SETTLE_MOVES, /* most_steps done, and it still slides or falls */
    MORPH_SETTLE_STALLS /* most_steps done, forces left over that do not move it: contacts change to and fro
                         */
} morph_settle_outcome;
/* In words, for messages. */
const char *morph_settle_outcome_text(morph_settle_outcome outcome);

typedef struct morph_settle_report {
    morph_settle_outcome outcome;
    bool converged;               /* outcome is MORPH_SETTLE_RESTS */
    bool stable;                  /* converged, and the reduced tangent stiffness is positive definite */
    int steps;                    /* implicit steps */
    int iterations;               /* Newton iterations */
    int factorisations, analyses; /* by this object since it was made */
    int saddles;                  /* balanced shapes that were not stable and were left again */
    int contacts;                 /* places that carry a force */
    double residual; /* largest force on a joint left over, in a joint's weights (m g; without gravity in
                        units of the load) */
    double load;     /* m g plus the centres' largest possible pull on a joint, N; without either k spacing */
    /* Violations measured at the shape itself, >= 0. */
    double worst_length;    /* m */
    double worst_post;      /* relative */
    double worst_angle;     /* in cosine */
    double worst_clearance; /* m, over whole links and triangles (by the exact distance if given), and the
                               base plane */
    double energy;          /* gravity, springs, attraction, J */
    double seconds, linear_seconds;
} morph_settle_report;

typedef struct morph_settle morph_settle;

/* structure and sdf (NULL: no target) must outlive the object. One symbolic analysis: every contact couples
 * joints of one cell, which the angle limits couple already. MORPH_ERR_INPUT for an unusable def,
 * MORPH_ERR_NOMEM. */
morph_status morph_settle_create(const morph_structure *structure, const morph_sdf *sdf,
                                 const morph_settle_def *def, morph_settle **out);
void morph_settle_destroy(morph_settle *s); /* NULL allowed */

/* Other centres from the next run on: as many as at create. MORPH_ERR_NONFINITE if one is not finite. */
morph_status morph_settle_attract(morph_settle *s, const morph_attractor *attractor);

/* x (3*joints, m): the pose to start from, replaced by the shape at rest (or the best reached, see
 * report->converged). warm: contact forces and multipliers of the last run are kept, for a start near its
 * end. report may be NULL. MORPH_ERR_NONFINITE if x is not finite (x is kept), MORPH_ERR_STOPPED (x is the
 * shape so far), MORPH_ERR_BACKEND, MORPH_ERR_NOMEM. Allocates nothing of its own. */
morph_status morph_settle_run(morph_settle *s, double *x, bool warm, const morph_control *control,
                              morph_settle_report *report);

/* Energy at x in J: gravity, link springs, attraction. */
double morph_settle_energy(const morph_settle *s, const double *x);

/* After a run that ended stable: for a function f of the resting shape with slope df/dx (3*joints), the
 * derivatives of f by the centres' positions (attractors x 3) and strengths (attractors); either may be NULL.
 * One factor, made by the run. Active limits and contacts are taken to stay so; friction's cones stay as they
 * are. MORPH_ERR_INPUT if the last run did not end stable. */
morph_status morph_settle_adjoint(morph_settle *s, const double *slope, double (*at)[3], double *strength);

#endif
