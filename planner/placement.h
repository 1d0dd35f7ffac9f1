/* Where to put centres of attraction: those under which the blanket comes to rest with the least cavity.
 *
 * Rounds: the blanket rests under its centres; a nonlinear program over centres, strengths, joints and all
 * reactions, with the balance of forces as rows (balance.h), says which centres promise less cavity and which
 * shape; the blanket then goes on from where it lies under the new centres, and what it reaches decides. */
#ifndef MORPH_PLACEMENT_H
#define MORPH_PLACEMENT_H

#include "planner/plan.h"
#include "planner/rest.h"

enum { MORPH_MOST_CENTRES = 8 };

/* Who proposes centres in each round. */
typedef enum morph_placement_method {
    MORPH_PLACE_IPOPT,          /* one program over centres, joints and reactions */
    MORPH_PLACE_NLOPT_FREE,     /* search over the centres, without gradients */
    MORPH_PLACE_NLOPT_GRADIENT, /* with the adjoint's gradient */
    MORPH_PLACE_METHODS
} morph_placement_method;

typedef struct morph_placement_options {
    morph_placement_method method;
    int evaluations;            /* searches: shapes at rest in one round at most */
    double cover_weight, slide; /* of the objective, as in morph_refine_options */
    double reach;               /* how far joints may move in one round, spacings; centres twice as far */
    double least_gain;          /* a round that gains less than this part is the last with these centres */
    double least_growth;        /* a further centre that gains less than this part is not kept */
    double strongest;           /* of a centre, unit times spacing^2 */
    double thrift;              /* weight of the strengths' squares */
    double hold;                /* of friction that a move would meet, units per spacing */
    double last_reach;          /* and in the last solve, which is to say what the blanket does */
    double epsilon;             /* of complementarity in the rounds, unit times spacing */
    double last_epsilon;        /* and in the last solve */
    int rounds, most_centres;
    double seconds; /* wall, looked at between solves; <= 0: none */
    const morph_control *control;
} morph_placement_options;
morph_placement_options morph_placement_defaults(void);

typedef struct morph_placement {
    int seeds, centres;
    morph_attractor seed[MORPH_MOST_CENTRES], centre[MORPH_MOST_CENTRES]; /* metres, N m2 */
    morph_trajectory guided;       /* under the seeds from the start, then under each round's centres */
    morph_measure seeded, reached; /* of the blanket under the seeds, and at the end of guided */
    int rounds, accepted;
    morph_effort effort;
    /* The last program, at last_epsilon: how it ended, what was recomputed from its point alone (units: a
     * joint's weight, spacings), and how far its shape is from the one that the blanket then reaches (rms
     * over the joints, spacings). */
    bool solved;
    morph_balance_report balance;
    double predicted_objective; /* exact, spacings^4 */
    double difference;
    double largest_force; /* of friction and the like that the last balance takes as it is */
    double seconds;
    char reason[160]; /* why it ended, or what the last program did not reach */
} morph_placement;
void morph_placement_free(morph_placement *p);

/* x0 (3*joints, m): where the pure blanket ends; seeds go beneath its cavities. Without a cavity there are no
 * centres and *out is empty but for the reason. MORPH_ERR_STOPPED leaves what there is in *out. */
morph_status morph_placement_run(const morph_workspace *w, const morph_scene *scene, const double *x0,
                                 const morph_placement_options *options, morph_placement *out);

/* One program from `rest`, of which *b holds the limits: z (free it) is its point, with the limits that *b
 * has then. moves: how far joints may go, spacings. For benchmarks and tests too. */
morph_status morph_placement_program(const morph_workspace *w, morph_balance *b,
                                     const morph_placement_options *options, double moves,
                                     const morph_rest *rest, double **z, morph_nlp_result *result);

#endif
