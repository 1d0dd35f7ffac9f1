/* Swept test of vertex against triangle and of edge against edge, all four vertices moving along straight
 * chords over the time [0, 1]: can the two come within a separation of each other, and from when on?
 *
 * Conservative: a pair that truly meets is never missed, whatever the rounding, and the time given is never
 * later than the true one. The price is false alarms: pairs that only nearly touch, for the fast mode nearer
 * than about 1e-15 of their size or of the way they go relative to each other (whichever is more), for the
 * strict mode about 1e-25; with a separation, 1e-15 of it for both; and pairs that slide or turn along each
 * other so near that the steps run out.
 *
 * Method (directional conservative advancement). Relative to the vertex, the triangle is a moving triangle
 * and must not reach the origin; the differences of two edges' points likewise fill a moving parallelogram.
 * Its corners x_j(t) are linear in t, so the times at which one fixed direction w has w . x_j(t) > separation
 * |w| for all corners form one interval, found in closed form. Starting at t = 0 with the direction of the
 * nearest point, each step goes to the end of that interval, a step that is conservative whatever w is. */
#ifndef MORPH_SWEPT_H
#define MORPH_SWEPT_H

#include <stdbool.h>

typedef struct morph_swept_options {
    double separation; /* m; a distance up to and including this is a hit. Negative counts as 0. */
    bool strict;       /* fewer false alarms, for more time where something nearly touches */
} morph_swept_options;

/* Separation 0, fast. */
morph_swept_options morph_swept_defaults(void);

/* Can vertex p (p0 at t = 0, p1 at t = 1) and the triangle (3 corners in any order) come within the
 * separation? True: yes or cannot be excluded, and *toi in [0, 1] is a time not after the first contact (0:
 * they are in contact at the start). False: proven apart at every time in [0, 1]; *toi is INFINITY. toi may
 * be NULL; options NULL stands for the defaults. Any lengths, any unit: triangles and edges without area or
 * length, pairs that stand still, and speeds of any size are fine. A coordinate or separation that is NaN or
 * infinite, or a coordinate beyond 2^1000 m, excludes nothing: true at time 0. Scaling all by a power of two
 * changes nothing. Does not allocate; no state. */
bool morph_swept_vertex_triangle(const double p0[3], const double t0[3][3], const double p1[3],
                                 const double t1[3][3], const morph_swept_options *options, double *toi);

/* The same for two edges (2 ends each, in any order). */
bool morph_swept_edge_edge(const double a0[2][3], const double b0[2][3], const double a1[2][3],
                           const double b1[2][3], const morph_swept_options *options, double *toi);

#endif
