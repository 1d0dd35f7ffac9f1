/* Candidate pairs of overlapping boxes by spatial hashing, after Teschner et al. 2003 ("Optimized spatial
 * hashing for collision detection of deformable objects"), with two changes. The table is one array filled by
 * a counting sort (count, prefix sum, fill), so there are no lists per cell and nothing to clear but counts.
 * And each box is stored in a grid whose cells are at least as wide as the box, so in 8 cells at most: grids
 * are a factor of four apart, anchored at the geometric mean of the box sizes, and one crowd of equal boxes
 * uses one grid. A box of another size then costs what every box costs, where a single grid would enter it in
 * any number of cells.
 *
 * Time O(n + pairs) for boxes that do not crowd more than their sizes ask, times the number of grids in use
 * (28 at most, for sizes over the whole range of double). */
#ifndef MORPH_SPATIAL_HASH_H
#define MORPH_SPATIAL_HASH_H

#include "solvers/base.h"

typedef struct morph_hash morph_hash; /* scratch memory only; one per thread */

typedef struct morph_box {
    double lo[3], hi[3]; /* m, lo <= hi; both ends belong to the box */
} morph_box;

morph_status morph_hash_create(morph_hash **out);
void morph_hash_destroy(morph_hash *hash); /* NULL allowed */

/* All pairs i < j of boxes that overlap or touch, each once. *pair is owned by the hash and valid until its
 * next call; the order depends on the boxes alone. Memory grows as needed and is kept: equal numbers of
 * boxes, cells and pairs ask for none. MORPH_ERR_NONFINITE for coordinates that are not finite or beyond 1e60
 * m, MORPH_ERR_INPUT where lo > hi, MORPH_ERR_NOMEM also beyond 2^27 boxes or 2^30 pairs; *pairs is 0
 * then. */
morph_status morph_hash_self(morph_hash *hash, int n, const morph_box *box, const int (**pair)[2],
                             int *pairs);

/* The same between two sets: pairs (i in a, j in b). */
morph_status morph_hash_between(morph_hash *hash, int n, const morph_box *a, int m, const morph_box *b,
                                const int (**pair)[2], int *pairs);

/* Bytes held: unchanged over calls that asked for no memory. */
size_t morph_hash_bytes(const morph_hash *hash);

static inline bool morph_box_overlap(const morph_box *a, const morph_box *b) {
    return a->lo[0] <= b->hi[0] && b->lo[0] <= a->hi[0] && a->lo[1] <= b->hi[1] && b->lo[1] <= a->hi[1] &&
           a->lo[2] <= b->hi[2] && b->lo[2] <= a->hi[2];
}

/* The box of n points p[0..n-1] (numbers into x, 3 per point), grown by `margin` on all sides. */
static inline morph_box morph_box_of(const double *x, const int *p, int n, double margin) {
    morph_box box;
    for (int k = 0; k < 3; k++) {
        double lo = x[3 * p[0] + k], hi = lo;
        for (int i = 1; i < n; i++) {
            const double at = x[3 * p[i] + k];
            lo = at < lo ? at : lo;
            hi = at > hi ? at : hi;
        }
        box.lo[k] = lo - margin;
        box.hi[k] = hi + margin;
    }
    return box;
}

#endif
