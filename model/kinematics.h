/* What lengths alone determine: rank and free motions of links (locked), posts and panels at a pose, and the
 * shape that given lengths lead to. Rows of posts, links and panels in all layouts; joints that are fixed do
 * not move. */
#ifndef MORPH_KINEMATICS_H
#define MORPH_KINEMATICS_H

#include "model/structure.h"

typedef struct morph_mobility {
    int rows, rank;
    int free;         /* motions left beyond the rigid ones */
    int redundant;    /* rows - rank */
    double sigma_min; /* least singular value of the unit-row matrix, rigid motions projected out; 0 when a
                         motion is free */
    int rigid; /* rigid motions of the whole: 6, fewer where joints are fixed (a single joint leaves 3, a
                  post or joints on one line 1, more none) */
} morph_mobility;

/* x: 3*joints. Rows have norm 1 over all joints; the columns of fixed joints are then left out, so that a row
 * between fixed joints alone is redundant. Dense SVD (LAPACK). MORPH_ERR_NONFINITE where x is not finite or a
 * row has no direction, MORPH_ERR_NOMEM, MORPH_ERR_BACKEND. */
morph_status morph_mobility_at(const morph_structure *s, const double *x, morph_mobility *out);

typedef struct morph_shape_report {
    double length, post, panel; /* worst |length - wanted| of links, m; of posts, relative; sine of panels */
    bool fits;                  /* all of them within 1e-9 (of the spacing, of the post, sine) */
    morph_mobility mobility;    /* at x_out: with free > 0 lengths alone do not fix this shape */
    int iterations, stages;     /* of the solver; of the way from the starting lengths to the given ones */
} morph_shape_report;

/* Joint positions x_out (3*joints) that have the given lengths (links), with posts of their length and panels
 * plane, reached from x_start (3*joints) by least motion: lengths go from those of x_start to the given ones
 * in stages, and each correction is the smallest one. Where no shape has the lengths, x_out is a
 * least-squares compromise and report->fits is false. Fixed joints stay where x_start has them. x_out may be
 * x_start. report may be NULL. MORPH_ERR_INPUT if a length is not positive, MORPH_ERR_NONFINITE if one or
 * x_start is not finite or links have no direction at x_start, MORPH_ERR_NOMEM, MORPH_ERR_BACKEND. Dense:
 * cost grows with joints^3 (8 x 8 nodes: a second; a few hundred joints are reasonable). */
morph_status morph_shape_from_lengths(const morph_structure *s, const double *lengths, const double *x_start,
                                      double *x_out, morph_shape_report *report);

#endif
