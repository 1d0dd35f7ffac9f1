/* Dampers of the blanket: one along each link and one between the far ends of each angle's arms. */
#include "model/blanket_internal.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Strength of an angle's damper in parts of a link's. Enough to end the swinging of the free motions within 2
 * to 3 s (with 0.1 it goes on, and with 1 leaning posts take seconds to sink). */
#define ANGLE_DAMPING 0.3

/* Dampers between the same two joints that are taken as one: both diagonals of a panel or a cell belong to
 * two angles each. */
enum { MOST_TIMES = 4 };
/* Groups of dampers without a common joint. */
enum { GROUPS = 64 };

static int sign(int difference) {
    return (difference > 0) - (difference < 0);
}

static int by_joints(const void *a, const void *b) {
    const morph_damper *x = a, *y = b;
    if ((x->angles > 0) != (y->angles > 0)) return sign(x->angles - y->angles);
    if (x->joint[0] != y->joint[0]) return sign(x->joint[0] - y->joint[0]);
    return x->joint[1] != y->joint[1] ? sign(x->joint[1] - y->joint[1]) : sign(x->number - y->number);
}

static int by_number(const void *a, const void *b) {
    return sign(((const morph_damper *)a)->number - ((const morph_damper *)b)->number);
}

static void add_damper(morph_blanket_state *b, const int ends[2], int angles) {
    if (b->weight[ends[0]] + b->weight[ends[1]] == 0.0) return;
    morph_damper *d = &b->damper[b->dampers++];
    d->joint[0] = ends[0] < ends[1] ? ends[0] : ends[1];
    d->joint[1] = ends[0] < ends[1] ? ends[1] : ends[0];
    d->angles = angles;
    d->number = b->dampers;
}

/* One for all angles' dampers between the same joints, where the first of them was: both layers of the sheet
 * keep the same order, so that what is alike in both stays so. */
static void merge(morph_blanket_state *b) {
    int kept = 0;
    qsort(b->damper, (size_t)b->dampers, sizeof *b->damper, by_joints);
    for (int n = 0; n < b->dampers; n++) {
        const morph_damper *d = &b->damper[n];
        morph_damper *last = kept > 0 ? &b->damper[kept - 1] : NULL;
        if (last && d->angles > 0 && last->angles > 0 && last->angles < MOST_TIMES &&
            memcmp(d->joint, last->joint, sizeof d->joint) == 0)
            last->angles++;
        else
            b->damper[kept++] = *d;
    }
    b->dampers = kept;
    qsort(b->damper, (size_t)b->dampers, sizeof *b->damper, by_number);
}

/* Each damper goes to the first group that has none at its joints, links' apart from angles'; what finds none
 * goes to the last group. Then they are ordered by groups. A damper changes its joints' velocities: within a
 * group none has to wait for the one before it, which more than halves the time. */
static morph_status group(morph_blanket_state *b) {
    uint64_t *taken = morph_alloc(2 * (size_t)b->joints, sizeof *taken);
    int *of = morph_alloc((size_t)b->dampers + 1, sizeof *of), start[2 * GROUPS + 1] = {0};
    morph_damper *sorted = morph_alloc((size_t)b->dampers + 1, sizeof *sorted);
    if (!taken || !of || !sorted) {
        free(taken);
        free(of);
        free(sorted);
        return MORPH_ERR_NOMEM;
    }
    for (int n = 0; n < b->dampers; n++) {
        const morph_damper *d = &b->damper[n];
        const int side = d->angles > 0;
        uint64_t *p = &taken[2 * d->joint[0] + side], *q = &taken[2 * d->joint[1] + side];
        int k = 0;
        while (k < GROUPS - 1 && ((*p | *q) >> k & 1) != 0)
            k++;
        *p |= (uint64_t)1 << k;
        *q |= (uint64_t)1 << k;
        of[n] = side * GROUPS + k;
        start[of[n] + 1]++;
    }
    for (int k = 0; k < 2 * GROUPS; k++)
        start[k + 1] += start[k];
    for (int n = 0; n < b->dampers; n++)
        sorted[start[of[n]]++] = b->damper[n];
    free(b->damper);
    free(taken);
    free(of);
    b->damper = sorted;
    return MORPH_OK;
}

morph_status morph_blanket_dampers_create(morph_blanket_state *b) {
    b->damper = morph_alloc((size_t)b->links + (size_t)b->angles + 1, sizeof *b->damper);
    if (!b->damper) return MORPH_ERR_NOMEM;
    b->dampers = 0;
    for (int l = 0; l < b->links; l++)
        add_damper(b, b->structure->link[l], 0);
    for (int t = 0; t < b->angles; t++)
        add_damper(b, b->angle_far[t], 1);
    merge(b);
    return group(b);
}

/* One damper alone: the speed w at which its ends part obeys w' = -(2 c / m) w, their mean stays. */
static void damp_pair(morph_blanket_state *b, const int ends[2], double factor) {
    double *vi = &b->v[3 * ends[0]], *vj = &b->v[3 * ends[1]], d[3], w[3];
    morph_sub(&b->x[3 * ends[1]], &b->x[3 * ends[0]], d);
    morph_sub(vj, vi, w);
    const double square = morph_dot(d, d);
    if (!(square > 0.0)) return;
    const double wi = b->weight[ends[0]], wj = b->weight[ends[1]];
    const double change = (1.0 - factor) / (square * (wi + wj)) * morph_dot(w, d);
    for (int k = 0; k < 3; k++) {
        vi[k] += wi * change * d[k];
        vj[k] -= wj * change * d[k];
    }
}

/* Dampers over a time h, one after the other: each is exact to second order and takes energy away at any
 * step. The order is turned round in a step's second half, which makes the composition symmetric and so of
 * second order. Beside the links' dampers, every angle has one between the far ends of its arms: the free
 * motions, which change no length (all cells shear, posts lean), would swing on for many seconds otherwise.
 */
void morph_blanket_damp(morph_blanket_state *b, double h, bool backward) {
    const double beta = b->structure->def.damping / b->structure->def.mass * h;
    double factor[MOST_TIMES + 1];
    if (beta == 0.0) return;
    factor[0] = morph_blanket_decay(beta);
    factor[1] = morph_blanket_decay(ANGLE_DAMPING * beta);
    for (int k = 2; k <= MOST_TIMES; k++)
        factor[k] = factor[k - 1] * factor[1];
    for (int n = 0; n < b->dampers; n++) {
        const morph_damper *d = &b->damper[backward ? b->dampers - 1 - n : n];
        damp_pair(b, d->joint, factor[d->angles]);
    }
}
