/* A path put aside, and taken up again. */
#include "planner/path_parts.h"

#include <stdlib.h>
#include <string.h>

void morph_kept_free(morph_kept *k) {
    free(k->s);
    free(k->x);
    free(k->inset);
    free(k->lift);
    morph_curve_destroy(k->curve);
    *k = (morph_kept){0};
}

static double *copy(const double *from, size_t count) {
    double *to = morph_alloc(count, sizeof *to);
    if (to) memcpy(to, from, count * sizeof *to);
    return to;
}

morph_status morph_keep(const morph_pather *p, morph_curve **curve, double duration, morph_kept *k) {
    const size_t count = (size_t)p->count;
    morph_kept next = {.count = p->count,
                       .s = copy(p->s, count),
                       .x = copy(p->x, count * (size_t)p->coordinates),
                       .inset = copy(p->inset, count),
                       .lift = copy(p->lift, count),
                       .duration = duration,
                       .feasible = p->report->feasible,
                       .violation = p->report->violation};
    if (!next.s || !next.x || !next.inset || !next.lift) {
        morph_kept_free(&next);
        return MORPH_ERR_NOMEM;
    }
    memcpy(next.where, p->report->where, sizeof next.where);
    next.curve = *curve;
    *curve = NULL;
    morph_kept_free(k);
    *k = next;
    return MORPH_OK;
}

void morph_put_back(morph_kept *k, morph_pather *p, morph_curve **curve) {
    const size_t count = (size_t)k->count;
    p->count = k->count;
    memcpy(p->s, k->s, count * sizeof *p->s);
    memcpy(p->x, k->x, count * (size_t)p->coordinates * sizeof *p->x);
    memcpy(p->inset, k->inset, count * sizeof *p->inset);
    memcpy(p->lift, k->lift, count * sizeof *p->lift);
    p->report->feasible = k->feasible;
    p->report->violation = k->violation;
    memcpy(p->report->where, k->where, sizeof k->where);
    morph_curve_destroy(*curve);
    *curve = k->curve;
    k->curve = NULL;
}
