/* The path as a curve: one spline through poses, each pose a centre and a direction per post, so that posts
 * are rigid at every parameter and lengths, being distances of joints, fit a shape at every parameter.
 * Without posts (layout offset) a pose is the joints themselves. */
#ifndef MORPH_CURVE_H
#define MORPH_CURVE_H

#include "model/structure.h"
#include "planner/hold.h"
#include "planner/jet.h"
#include "planner/spline.h"

typedef struct morph_curve {
    const morph_structure *structure;
    int poses;
    double *s;    /* poses; from 0 to 1 */
    double *pose; /* poses x width: centre (3), direction (3) per post; or 3*joints */
    double *lift; /* poses: how far the target stands above its place, m; NULL: it stands still */
    morph_spline spline;
    morph_hold *hold; /* links of one length and plane panels, held between poses too; NULL: none */
} morph_curve;

/* Numbers of a pose: 6*posts, or 3*joints without posts. */
int morph_pose_width(const morph_structure *structure);

/* Joints (poses x 3*joints, metres) at parameters s. Directions are those of the posts, unit length.
 * Six poses at least. */
morph_status morph_curve_create(const morph_structure *structure, const double *s, const double *joints,
                                int poses, morph_curve **out);
void morph_curve_destroy(morph_curve *curve);

/* The target's lift at s, linear between poses, m. */
double morph_curve_lift(const morph_curve *curve, double s);

/* Joints at s and their derivatives 0..order (<= 5, less than MORPH_JET): out is (order + 1) x 3*joints.
 * scratch: (order + 1) x the pose's width. Not from two threads at once on one curve where anything is held.
 */
void morph_curve_joints(const morph_curve *curve, double s, int order, double *scratch, double *out);

/* Lengths from joint derivatives as above: out is (order + 1) x links. */
void morph_curve_lengths(const morph_structure *structure, const double *joints, int order, double *out);

#endif
