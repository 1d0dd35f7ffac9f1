/* Energies and limits of a few joints with their derivatives up to the third along one direction: what
 * equilibrium conditions and their Lagrangians are made of. Scaled: lengths in grid spacings, forces in an
 * agreed unit. */
#ifndef MORPH_ELEMENT_H
#define MORPH_ELEMENT_H

#include "model/sdf.h"

typedef enum morph_element_kind {
    MORPH_ELEMENT_SPRING,   /* stiffness/2 (|d| - rest)^2 of joints 0, 1: d = x1 - x0 */
    MORPH_ELEMENT_DISTANCE, /* |d|^2 */
    MORPH_ELEMENT_COSINE,   /* of the angle between x1 - x0 and x3 - x2; joints may be the same */
    MORPH_ELEMENT_SQUARE,   /* stiffness/2 cosine^2 of that angle */
    MORPH_ELEMENT_SLACK,    /* one-sided spring of that angle, see below */
    MORPH_ELEMENT_PANEL,    /* det[x1 - x0, x3 - x2, x2 - x0]: 0 where four joints lie in a plane */
    MORPH_ELEMENT_CONTACT,  /* smooth distance of the point sum_i weight_i x_i (3 joints), plus bias */
    MORPH_ELEMENT_APART,    /* |sum_i weight_i x_i|^2 of 4 joints: places on two axes from each other */
    MORPH_ELEMENT_HEIGHT,   /* z of joint 0 */
    MORPH_ELEMENT_PULL      /* -strength / sqrt(|a - x|^2 + softening^2): joint 0 is x; a, strength below */
} morph_element_kind;

enum { MORPH_ELEMENT_WIDTH = 12 };

typedef struct morph_element {
    morph_element_kind kind;
    int joint[4];
    double weight[4];       /* contact, apart */
    double stiffness, rest; /* spring, square, slack */
    double lower, upper;    /* slack: stiffness/2 (lower - angle)^2 below, (angle - upper)^2 above, radians */
    double bias;            /* contact: added to the smooth distance */
    int centre;             /* pull: which centre */
} morph_element;

/* Joints of an element: 1, 2, 3 or 4. */
int morph_element_joints(const morph_element *e);

/* A value with gradient and Hessian by the coordinates of the element's joints (3 a + k for its joint a) and
 * the change of the Hessian along `along`, the third derivative contracted once. */
typedef struct morph_jet {
    double value;
    double g[MORPH_ELEMENT_WIDTH];
    double h[MORPH_ELEMENT_WIDTH][MORPH_ELEMENT_WIDTH];
    double t[MORPH_ELEMENT_WIDTH][MORPH_ELEMENT_WIDTH];
} morph_jet;

/* order: 0 value, 1 and gradient, 2 and Hessian, 3 and t (then `along`, 3 entries for each joint of the
 * element, is read). x: all joints, scaled. Not for MORPH_ELEMENT_PULL. Of a contact, t is 0: the distance
 * field's third derivatives are piecewise constant and left out. Lines of no length have cosine 0 and no
 * slope. sdf (metres) and spacing are used by contacts only. */
void morph_element_eval(const morph_element *e, const morph_sdf *sdf, double spacing, const double *x,
                        int order, const double *along, morph_jet *jet);

/* A pull's potential by d = a - x: value, gradient, Hessian and its change along `along`, for unit strength
 * (3 of each). */
typedef struct morph_pull_jet {
    double value, g[3], h[3][3], t[3][3];
} morph_pull_jet;
void morph_pull_eval(const double d[3], double softening, const double along[3], morph_pull_jet *jet);

#endif
