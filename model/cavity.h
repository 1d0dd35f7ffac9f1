/* How well a skin lies on a target: cavity volume, gap, target gap, coverage, objective (definitions:
 * README). */
#ifndef MORPH_CAVITY_H
#define MORPH_CAVITY_H

#include "model/distance.h"
#include "model/structure.h"

/* A skin sample: barycentric point of a skin triangle, with its share of the skin's area at the start. */
typedef struct morph_skin_sample {
    int joint[3];
    double weight[3];
    double area; /* m2, fixed at the start pose */
} morph_skin_sample;

/* An exposed point of the target: first hit of a vertical line from above. */
typedef struct morph_exposed {
    double point[3], normal[3];
    double area; /* projected, m2 */
} morph_exposed;

typedef struct morph_cavity {
    const morph_structure *structure;
    const morph_distance *target;
    double base; /* height of the base plane, NaN for none */
    int samples, exposed;
    morph_skin_sample *sample;
    morph_exposed *expose;
    double start_area;
} morph_cavity;

/* Keeps pointers to structure and target: both must outlive the cavity. 9 samples of equal area per skin
 * triangle. Exposed points stand at most an eighth of the spacing apart (further only where a target is so
 * large that this would be more than 20,000), at least 8 along each side of the target; hits below the base
 * plane do not count. A target may have no exposed point at all (all of it below the base plane). */
morph_status morph_cavity_create(const morph_structure *structure, const morph_distance *target, double base,
                                 morph_cavity **out);
void morph_cavity_destroy(morph_cavity *cavity);

typedef struct morph_measure {
    double volume;                                 /* cavity volume, m3 */
    double gap_mean, gap_p95, gap_max, gap_target; /* m */
    double coverage;                               /* 0..1 */
    double objective;                              /* m4: sum A_q gap^2 + w_c sum A_y dist^2 */
} morph_measure;

/* Weight w_c of the target's term in the objective. */
#define MORPH_COVER_WEIGHT 5.0

/* x: 3*joints. Exact distances throughout. Without exposed points gap_target is 0 and coverage 1.
 * MORPH_ERR_NONFINITE if x is not finite. */
morph_status morph_cavity_measure(const morph_cavity *cavity, const double *x, morph_measure *out);

/* Cavity volume alone, with columns `cell` wide (m) instead of the usual sixteenth of the spacing. Exact
 * along each column; wider columns are taken where there would be more than 400,000. */
morph_status morph_cavity_volume(const morph_cavity *cavity, const double *x, double cell, double *volume);

/* A connected region of skin triangles whose gap is on average above a threshold. */
typedef struct morph_cavity_region {
    double at[3];        /* centroid of the space between skin and target (or base plane), m */
    double volume, area; /* sum of A gap over its samples, m3; start area of its skin, m2 */
    int triangle;        /* one of its skin triangles */
} morph_cavity_region;

/* The regions at x with gaps above `threshold` (m), largest first: the first `capacity` of them in region,
 * all counted. Triangles that share an edge are connected. MORPH_ERR_NONFINITE, MORPH_ERR_NOMEM. */
morph_status morph_cavity_regions(const morph_cavity *cavity, const double *x, double threshold, int capacity,
                                  morph_cavity_region *region, int *count);

/* For each exposed point the closest skin point: joints and weights (exposed entries each), distance. Arrays
 * are the caller's; any may be NULL. */
morph_status morph_cavity_closest(const morph_cavity *cavity, const double *x, int (*joint)[3],
                                  double (*weight)[3], double *distance);

#endif
