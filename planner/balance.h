/* A sheet in balance: gravity, springs and centres of attraction against reactions of posts and panels,
 * limits and contacts. Scaled: lengths in spacings, forces in units of `unit` newtons, so that every row is
 * of order 1.
 *
 *     grad E(x) - sum_m s_m grad pull(x; a_m) - sum_e tau_e grad e(x) - sum_q lambda_q grad c_q(x) = 0
 *     e(x) = 0          posts of their length, panels plane
 *     c_q(x) >= 0, lambda_q >= 0, lambda_q c_q(x) = epsilon
 *
 * with one row of balance for each coordinate of a free joint. With epsilon > 0 these are the conditions of a
 * minimum of E minus epsilon sum log c_q: a smooth function of centres and strengths wherever that minimum is
 * a strict one. With friction the rest shape is not unique: a blanket's rest shape is in balance with forces
 * of friction that its contacts happen to have. These are taken as they are (`force`), and springs (`hold`)
 * from where the blanket lies stand for the friction that a move would meet. */
#ifndef MORPH_BALANCE_H
#define MORPH_BALANCE_H

#include "model/attraction.h"
#include "model/element.h"
#include "planner/pose.h"

/* The unit of force, N: the weight of a joint, or without gravity its springs' stiffness times the spacing.
 */
double morph_balance_unit(const morph_structure_def *structure, double gravity);

/* What the sheet is under. */
typedef struct morph_balance_load {
    double gravity;   /* m/s2 */
    double softening; /* of centres, m; 0: one spacing */
} morph_balance_load;

/* One-sided limits: c = sign (value of element - edge) >= 0. Owned arrays; zeroed is empty. */
typedef struct morph_limits {
    int count, capacity;
    morph_element *element;
    double *sign, *edge;
} morph_limits;
void morph_limits_free(morph_limits *l);
morph_status morph_limits_copy(morph_limits *to, const morph_limits *from);

/* Unknowns in this order: joints' coordinates, tau of posts then panels, centres, strengths (unit: newton
 * square metres over unit and spacing squared), lambda of limits: those before do not move when limits
 * change. */
typedef struct morph_balance {
    const morph_world *world;
    double unit;      /* morph_balance_unit() */
    double weight;    /* of a joint, in units: 1 or 0 */
    double softening; /* spacings */
    double hold;      /* stiffness of springs from every joint to `anchor`, units per spacing */
    double *anchor;   /* coordinates */
    double *force;    /* on the coordinates, units: what else holds the sheet (friction), constant */
    double epsilon;   /* of complementarity: unit times spacing */
    int energies, equalities, centres;
    morph_element *energy, *equality;
    double *aim; /* equalities: their value */
    morph_limits limits;
    int *row; /* 3*joints: row of a coordinate, -1 for a fixed joint */
    int rows, coordinates;
    double *along; /* scratch: coordinates */
} morph_balance;

/* Energies and equalities; no limits yet. */
morph_status morph_balance_create(const morph_world *world, const morph_balance_load *load, int centres,
                                  morph_balance **out);
void morph_balance_destroy(morph_balance *b); /* NULL allowed */

/* Limits that pose x (scaled) stands near: lengths, angles, heights above the base plane, and contact at
 * joints, at a pattern of places on links and skin triangles and where each of them is deepest. Those of
 * before are forgotten. */
morph_status morph_balance_limits(morph_balance *b, const double *x, const morph_nearness *near);

/* Adds the limits that x stands within `near` of and that are not among them yet; *added may be NULL. Closest
 * points slide along a pair of axes: one that is listed with others is added again only where the axes
 * overlap by `slid` or deeper (spacings, <= 0; 0: always). */
morph_status morph_balance_more_limits(morph_balance *b, const double *x, const morph_nearness *near,
                                       double slid, int *added);

/* Number of the first unknown of each kind. */
int morph_balance_tau(const morph_balance *b);
int morph_balance_lambda(const morph_balance *b);
int morph_balance_centre(const morph_balance *b);
int morph_balance_strength(const morph_balance *b);
int morph_balance_unknowns(const morph_balance *b);

/* c of limit q at x; names it. */
double morph_balance_limit_at(const morph_balance *b, int q, const double *x);
void morph_balance_limit_name(const morph_balance *b, int q, char *text, size_t size);

/* Blocks over all unknowns. Bounds are the caller's: rows of them each. */
morph_block morph_block_balance(morph_balance *b, double *lower, double *upper);
morph_block morph_block_complementarity(morph_balance *b, double *lower, double *upper);
/* Posts and panels, over the coordinates. */
morph_block morph_block_equalities(morph_balance *b, double *lower, double *upper);
/* For the shape at rest alone: c >= 0, and the energy with centres held, over the coordinates. */
morph_block morph_block_limits(morph_balance *b, double *lower, double *upper);
typedef struct morph_rest_energy {
    morph_balance *balance;
    const morph_attractor *centre; /* scaled */
} morph_rest_energy;
morph_block morph_block_rest_energy(morph_rest_energy *e);

/* Centres between metres and newtons, and spacings and units. */
morph_attractor morph_balance_scaled(const morph_balance *b, const morph_attractor *centre);
morph_attractor morph_balance_physical(const morph_balance *b, const morph_attractor *centre);

/* Of a point z (unknowns): the largest entry of the balance rows (units), of
 * lambda c, of -c and of the equalities, and whether the shape is stable: the Hessian of the energy with the
 * limits' barrier, on the directions that the equalities leave, is positive definite (a Cholesky
 * factorisation). */
typedef struct morph_balance_report {
    double residual, complementarity, penetration, equality;
    bool stable;
} morph_balance_report;
morph_status morph_balance_examine(morph_balance *b, const double *z, morph_balance_report *out);

#endif
