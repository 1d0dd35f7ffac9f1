/* Reach: what a target asks of a structure against what its links and posts can give, from the geometry
 * alone and before anything is solved.
 *
 * The target is seen as its upper surface H(x, y), heights of the first hits from above on a grid of cells,
 * the base plane elsewhere. Over it lies the least surface that the sheet could take:
 *   1. holes, grooves and concave edges are closed by a ball as small as two layers can bend inwards;
 *   2. where a side is steeper than links can follow, the sheet leaves it: along x and along y it falls by at
 *      most sqrt(lambda^2 - 1) D + longest cos(least angle of neighbouring links) over a plan distance D,
 *      lambda = longest / shortest length of a link. (Beside a line that climbs lies one that does not: its
 *      nodes are a >= shortest apart, those of the first a sec <= longest; the rest is shear.)
 * What is seen from above and lies farther than a quarter of the spacing below that surface cannot be
 * covered, by the same rule that measures coverage. The border is free: nodes slide inwards, so a line may
 * spend all its links on the target, but no more. All of it is an estimate for sheets whose grid lines stay
 * near vertical planes, and on the generous side; dynamics and folds can fall short of it. */
#ifndef MORPH_REACH_H
#define MORPH_REACH_H

#include "model/distance.h"
#include "model/structure.h"

typedef enum morph_reach_kind {
    MORPH_REACH_LENGTH,  /* longest way across the target along a grid line, m; most that its links reach */
    MORPH_REACH_AREA,    /* area of the target seen from above, m2; largest of the sheet */
    MORPH_REACH_STRETCH, /* arc over plan length of the steepest piece as long as a shortest link; lambda */
    MORPH_REACH_HOLE,    /* deepest place under the ball, m; a quarter of the spacing */
    MORPH_REACH_BUMP,    /* height of what is narrower than two spacings, m; half a spacing */
    MORPH_REACH_BEND,    /* sharpest ridge from link to link, radians; what the angle limits leave */
    MORPH_REACH_HELD,    /* way from held border to held border over the target, m; most that links reach */
    MORPH_REACH_HIDDEN,  /* share of the surface under overhangs, which no sheet from above touches; none */
    MORPH_REACH_KINDS
} morph_reach_kind;

typedef enum morph_reach_verdict {
    MORPH_REACH_UNTESTED, /* does not apply: nothing held, nothing exposed, no posts */
    MORPH_REACH_WITHIN,
    MORPH_REACH_NOTE, /* beyond its limit, but what is lost of the coverage is below MORPH_REACH_LOST */
    MORPH_REACH_OUT
} morph_reach_verdict;

/* One finding each. */
typedef struct morph_reach_item {
    morph_reach_verdict verdict;
    double number, limit; /* units above; limit NaN: none */
    bool along_y;         /* the line runs along y (LENGTH, STRETCH, BEND, HELD) */
    int line;     /* number of the grid line next to the worst place: j for lines along x, i along y */
    double at[3]; /* worst place, m */
    double lost;  /* share of the exposed area that this alone leaves uncovered, 0..1 */
} morph_reach_item;

typedef struct morph_reach {
    bool within; /* no item is out */
    morph_reach_item item[MORPH_REACH_KINDS];
    /* No sheet covers a larger share of the exposed area, 0..1: length, area, holes and slopes together. */
    double coverage;
    double reach[2]; /* most that a line along x, along y reaches, m */
    double cell;     /* of the height grid, m: the larger side */
    int cells;
} morph_reach;

/* Below a twentieth of the exposed area, what cannot be covered does not put a target out of reach: the
 * surface above is known no better than that (calibrated on plans: README of examples/suite). */
#define MORPH_REACH_LOST 0.05

/* base: NaN for none. frame: height at which held joints of the bottom layer stay, m; not looked at where
 * nothing is held. A target with nothing exposed is within reach. Takes milliseconds: at most 20,000 lines.
 * MORPH_ERR_NOMEM, MORPH_ERR_NONFINITE if the target has no finite box. */
morph_status morph_reach_check(const morph_structure *structure, const morph_distance *target, double base,
                               double frame, morph_reach *out);

/* "length", "area", "stretch", ... */
const char *morph_reach_name(morph_reach_kind kind);

#endif
