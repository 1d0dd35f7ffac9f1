/* Inside settle: its state and pieces. For model/settle*.c and their tests.
 *
 * Units inside: the spacing for lengths and the load for forces (morph_settle_report), so that every
 * tolerance is a pure number. */
#ifndef MORPH_SETTLE_INTERNAL_H
#define MORPH_SETTLE_INTERNAL_H

#include "model/settle.h"
#include "solvers/sparse.h"

/* Angle between u and v as floor <= cos <= ceiling; joint[k] enters u with su[k] and v with sv[k]. */
typedef struct morph_settle_angle {
    int joint[4], joints;
    double su[4], sv[4];
    double floor, ceiling;
    double push[2]; /* multipliers at floor, ceiling */
} morph_settle_angle;

/* A place on a joint (1 corner), link (2) or skin triangle (3) that may touch the target or the plane. */
typedef struct morph_settle_place {
    int joint[3], corners;
    double weight[3]; /* barycentric */
    double radius;
    bool plane;        /* touches the base plane */
    bool used;         /* a place that looks for the deepest point may have nothing to hold */
    bool near;         /* within reach of this step */
    bool seeks;        /* stands at an element's deepest point */
    double push;       /* multiplier, >= 0 */
    double slip[3];    /* stretch of the friction spring */
    double normal[3];  /* at the step's start */
    double slope;      /* of the distance there */
    double at[3], gap; /* place and gap there */
    double anchor[3];  /* where the friction spring hangs in this step */
    double cone;       /* most friction in this step */
} morph_settle_place;

/* Places per element that look for its deepest points. */
enum { MORPH_SETTLE_SEEKERS = 6 };

/* An element that is searched for its deepest point: a triangle or a link that is no edge of one. */
typedef struct morph_settle_element {
    int joint[3], corners;
    double radius;
    int first; /* of its seekers among the places */
} morph_settle_element;

typedef enum morph_settle_order {
    MORPH_SETTLE_VALUE,
    MORPH_SETTLE_GRADIENT,
    MORPH_SETTLE_EXACT, /* and the Hessian */
    MORPH_SETTLE_SAFE   /* and its part that is positive semidefinite element by element */
} morph_settle_order;

typedef enum morph_settle_form {
    MORPH_SETTLE_AUGMENTED, /* limits by multipliers and penalties */
    MORPH_SETTLE_PLAIN      /* limits by their multipliers alone; the Hessian gets `stiff` along the gradient
                               of each one that has a multiplier */
} morph_settle_form;

struct morph_settle {
    const morph_structure *structure;
    const morph_sdf *sdf;
    const morph_distance *exact; /* or NULL */
    int joints, angles, places, elements, attractors;
    double length_unit, load; /* m, N */
    double weight;            /* of a joint */
    double spring;            /* link stiffness */
    double friction, base, softening, tolerance;
    int most_steps;
    morph_attractor *attractor;
    bool *fixed; /* joints */

    double *post_push;      /* posts, any sign */
    double (*link_push)[2]; /* links: at the least and the greatest length */
    morph_settle_angle *angle;
    morph_settle_place *place; /* joints, links, triangles, seekers, base plane */
    morph_settle_element *element;

    /* What the energy is made of. */
    morph_settle_form form;
    double stiff;        /* penalty per length^2 */
    double stiff_length; /* of length limits: at least the springs' own */
    double stiff_angle;  /* per cosine^2 */
    double grip;         /* of the friction springs */
    double drag;         /* 1 / implicit step: 0.5 drag |x - before|^2 */
    double least_drag;   /* that steps may come down to now */
    double best;         /* least force left over lately */
    int best_age;        /* steps since */
    double least_cone;   /* part of Coulomb's most friction that a contact may be held to now */
    double nearest;      /* joint to the target, m, while nothing is held */
    int falling;         /* steps away from it without contact */
    double *before;      /* 3*joints */

    double *x, *trial, *g, *d; /* 3*joints */
    int *start, *row;          /* pattern of the Hessian's lower triangle */
    double *value, *spare;     /* its entries */
    morph_sparse *sparse;
    bool factored; /* sparse holds the factor of the resting shape, spare its Hessian without penalties */

    double share; /* of the Hessian's indefinite part in the last factor */
    int iterations;
    double linear_seconds;
};

/* A multiplier below this share of the load is taken as none where active limits are asked for. */
#define MORPH_SETTLE_LEAST_PUSH 1e-9

/* settle_state.c */
/* Load, centres and penalties for these centres; multipliers keep their newtons. */
void morph_settle_scale(morph_settle *s, const morph_attractor *attractor);
void morph_settle_penalties(morph_settle *s); /* those that a run starts with */

/* settle_pattern.c */
morph_status morph_settle_pattern_create(morph_settle *s);
/* Adds the 3 x 3 block b at joints i, j (and its transpose at j, i) to value; i == j: b is symmetric. Blocks
 * of fixed joints are dropped. */
void morph_settle_add(morph_settle *s, int i, int j, const double b[3][3]);
/* Puts 1 on the diagonal of fixed joints. */
void morph_settle_hold_fixed(morph_settle *s);

/* settle_energy.c: energy at x; gradient into s->g and Hessian into s->value as the order says. */
double morph_settle_evaluate(morph_settle *s, const double *x, morph_settle_order order);
/* New multipliers from the limits at x. Returns the largest violation on the way (posts relative, angles in
 * cosine, the rest in spacings). */
double morph_settle_update(morph_settle *s, const double *x);
void morph_settle_forget(morph_settle *s);
double morph_settle_angle_value(const morph_settle_angle *a, const double *x);

/* settle_contact.c */
morph_status morph_settle_places_create(morph_settle *s);
double morph_settle_contacts(morph_settle *s, const double *x, morph_settle_order order);
/* Lists what is near, and hangs up the friction springs, for a step from x. */
void morph_settle_begin(morph_settle *s, const double *x);
double morph_settle_update_contacts(morph_settle *s, const double *x);
/* Ends a step at x: friction springs keep the stretch that their cones allow. */
void morph_settle_slide(morph_settle *s, const double *x);
/* Moves or adds places where an element is deeper than `tolerance`; returns the deepest violation found. */
double morph_settle_seek(morph_settle *s, const double *x, double tolerance);

/* settle_adjoint.c: factors the reduced stiffness at s->x; *stable says whether it is positive definite. */
morph_status morph_settle_examine(morph_settle *s, bool *stable);

#endif
