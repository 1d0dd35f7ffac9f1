/* The constraint and objective blocks of a pose. A pose is 3*joints coordinates in units of the grid spacing
 * ("scaled"), so every row is of order 1. Every block sees a whole pose as its local unknowns; in a path the
 * assembler shifts it to its own pose.
 *
 * A block's data is plain and owned by its user; make functions fill a morph_block that refers to that data,
 * to `unknown` (local -> global, NULL for identity) and to `lower`, `upper` (rows entries each, filled by the
 * make function). */
#ifndef MORPH_BLOCKS_H
#define MORPH_BLOCKS_H

#include "model/cavity.h"
#include "model/sdf.h"
#include "model/structure.h"
#include "solvers/nlp.h"

/* Rows between joints that are all held are left out everywhere: nothing in them could move. */

/* |p|^2 / h^2 = 1 for every post that is not held. */
typedef struct morph_post_rows {
    const morph_structure *structure;
} morph_post_rows;
morph_block morph_block_posts(morph_post_rows *data, const int *unknown, double *lower, double *upper);
int morph_post_row_count(const morph_structure *s);

/* det[p_a, p_b, d] / (h_a h_b) = 0 for every panel of two posts p_a, p_b (lengths h) with d from foot to
 * foot, in spacings: d is about one long, so the row is about the sine of the angle by which the panel is out
 * of plane. Panels between two posts that are held are left out. */
typedef struct morph_panel_rows {
    const morph_structure *structure;
} morph_panel_rows;
morph_block morph_block_panels(morph_panel_rows *data, const int *unknown, double *lower, double *upper);
int morph_panel_row_count(const morph_structure *s);
/* That sine at x (any unit), signed: of unit vectors along the posts and from foot to foot. And its name. */
double morph_panel_sine(const morph_structure *s, int panel, const double *x);
void morph_panel_name(const morph_structure *s, int panel, char *text, size_t size);

/* min <= length <= max of the listed links, as rows |d|^2 / a^2. margin: taken off both limits, in spacings.
 */
typedef struct morph_length_rows {
    const morph_structure *structure;
    int count;
    const int *link;
    double margin;
} morph_length_rows;
morph_block morph_block_lengths(morph_length_rows *data, const int *unknown, double *lower, double *upper);

/* Angle limits of the listed tuples as rows cos(angle): tuple t < link_posts is link to post t, else link to
 * link t - link_posts. margin: taken off both limits, radians. */
typedef struct morph_angle_rows {
    const morph_structure *structure;
    int count;
    const int *tuple;
    double margin;
} morph_angle_rows;
morph_block morph_block_angles(morph_angle_rows *data, const int *unknown, double *lower, double *upper);
/* Joints of the two directions of a tuple in that numbering, and its limits. */
void morph_angle_joints(const morph_structure *s, int tuple, int uj[2], int vj[2]);
const double *morph_angle_limit(const morph_structure *s, int tuple);
/* The angle at x (any unit), radians, and its element's name. */
double morph_angle_at(const morph_structure *s, int tuple, const double *x);
void morph_angle_name(const morph_structure *s, int tuple, char *text, size_t size);

/* Objective: scale * sum over link to post tuples of cos(angle)^2: posts upright on the links. */
typedef struct morph_upright_term {
    const morph_structure *structure;
    double scale;
} morph_upright_term;
morph_block morph_block_upright(morph_upright_term *data, const int *unknown);

/* A point of the structure: up to three joints with weights that sum to 1. */
typedef struct morph_point {
    int joint[3];
    double weight[3];
    int link;    /* the link that it lies on, or -1: a skin point */
    double bias; /* exact distance minus smooth distance where last measured, spacings */
} morph_point;
void morph_point_name(const morph_structure *s, const morph_point *p, char *text, size_t size);
void morph_point_at(const morph_point *p, const double *x, double out[3]);

/* Smooth distance + bias >= radius + margin at the listed points, in spacings. */
typedef struct morph_clearance_rows {
    const morph_structure *structure;
    const morph_sdf *sdf;
    int count;
    const morph_point *point;
    double margin;
    double lift; /* the target stands so far above where sdf has it, spacings */
} morph_clearance_rows;
morph_block morph_block_clearance(morph_clearance_rows *data, const int *unknown, double *lower,
                                  double *upper);

/* A feature of the target under an element of the structure (see block_feature.c), all in spacings. */
typedef struct morph_feature {
    int joint[3]; /* a, b, c; of a link a, b, b */
    bool is_edge;
    double point[3]; /* y, on the target */
    double edge[3];  /* its direction */
    double sign;     /* makes the distance positive on the outer side */
} morph_feature;
typedef struct morph_feature_rows {
    const morph_structure *structure;
    int count;
    const morph_feature *feature;
    double margin;
} morph_feature_rows;
morph_block morph_block_features(morph_feature_rows *data, const int *unknown, double *lower, double *upper);
double morph_feature_at(const morph_feature *feature, const double *x);

/* Ends of two axes (links or posts) kept apart along a fixed unit normal: n.(A - B) >= distance + margin.
 * With all four such rows and n along the line of the axes' closest points the axes are apart by that much,
 * and stay on their sides: they cannot pass through each other. */
typedef struct morph_pair {
    int joint[2]; /* an end of the one, an end of the other */
    double normal[3];
    double distance; /* least distance allowed between the axes, spacings */
    int axis[2];     /* link number, or links + post number */
} morph_pair;
typedef struct morph_separation_rows {
    const morph_structure *structure;
    int count;
    const morph_pair *pair;
    double margin;
} morph_separation_rows;
morph_block morph_block_separation(morph_separation_rows *data, const int *unknown, double *lower,
                                   double *upper);
void morph_axis_name(const morph_structure *s, int axis, char *text, size_t size);

/* Objective: sum A_q gap_q^2 over skin samples, gap = smooth min(distance, height above base) - radius, all
 * in spacings. The kink between target and base plane is rounded over `blend` spacings. */
typedef struct morph_gap_term {
    const morph_cavity *cavity;
    const morph_sdf *sdf;
    double blend;
    double scale;
    bool gauss_newton; /* leave the distance's second derivatives out of the Hessian: it is then positive
                          semidefinite */
} morph_gap_term;
morph_block morph_block_gap(morph_gap_term *data, const int *unknown);
/* That gap at a point and its derivatives by the point, in spacings; g, h (packed xx xy xz yy yz zz) may be
 * NULL, h only with g. */
double morph_gap_at(const morph_gap_term *data, const double at[3], double g[3], double h[6]);

/* Objective: sum over exposed points of A_y |W x - y|^2 split along the target's normal n and across it:
 * t^2 + press (sqrt(t^2 + 0.01^2) - 0.01) + slide |(I - n n^T)(W x - y)|^2 with t = n.(W x - y) - r. The
 * second part is about press |t|: squares alone leave many small gaps rather than contact. Closest skin
 * points W are fixed. */
typedef struct morph_cover_term {
    const morph_cavity *cavity;
    const int (*joint)[3]; /* exposed entries */
    const double (*weight)[3];
    double slide, press, scale;
} morph_cover_term;
morph_block morph_block_cover(morph_cover_term *data, const int *unknown);

/* Objective: scale * sum |x_i - reference_i|^2 over all coordinates; both scaled. */
typedef struct morph_near_term {
    int coordinates;
    const double *reference;
    double scale;
} morph_near_term;
morph_block morph_block_near(morph_near_term *data, const int *unknown);

/* Objective: scale * sum over links (|d|^2 - target^2)^2 / 4, about the squared deviation of the length from
 * `target` near length 1. */
typedef struct morph_stretch_term {
    const morph_structure *structure;
    const double *target; /* links, spacings */
    double scale;
} morph_stretch_term;
morph_block morph_block_stretch(morph_stretch_term *data, const int *unknown);

#endif
