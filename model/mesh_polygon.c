/* Ear clipping of one polygon. */
#include "model/mesh.h"

#include <stdlib.h>
#include <string.h>

/* A polygon in its own plane, as a ring of corners. */
typedef struct ring {
    double (*p)[2]; /* n */
    int *prev, *next;
    int n, left;
    double size;     /* largest extent */
    double *quality; /* of the ear at a corner, negative: none */
} ring;

static double cross2(const double a[2], const double b[2], const double c[2]) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static double dist2(const double a[2], const double b[2]) {
    return hypot(a[0] - b[0], a[1] - b[1]);
}

/* Newell's normal: N = sum p_i x p_(i+1) relative to the first corner; its length is twice the area, and it
 * is the best plane's normal also where the corners are slightly off a plane. Then coordinates in an
 * orthonormal basis of that plane, counter-clockwise. False without area. */
static bool project(const double *v, const int *polygon, ring *r) {
    double n[3] = {0, 0, 0}, far = 0;
    const double *o = v + 3 * polygon[0];
    for (int i = 1; i + 1 < r->n; i++) {
        double a[3], b[3], c[3];
        morph_sub(v + 3 * polygon[i], o, a);
        morph_sub(v + 3 * polygon[i + 1], o, b);
        morph_cross(a, b, c);
        for (int k = 0; k < 3; k++)
            n[k] += c[k];
        far = fmax(far, fmax(morph_norm(a), morph_norm(b)));
    }
    r->size = far;
    const double length = morph_norm(n);
    /* Rounding of the cross products is about 1e-16 of the squared size a corner. */
    if (!(length > 1e-14 * r->n * far * far)) return false;
    int least = 0;
    for (int k = 0; k < 3; k++) {
        n[k] /= length;
        if (fabs(n[k]) < fabs(n[least])) least = k;
    }
    double axis[3] = {0, 0, 0}, e1[3], e2[3];
    axis[least] = 1;
    morph_cross(axis, n, e1);
    const double l1 = morph_norm(e1);
    for (int k = 0; k < 3; k++)
        e1[k] /= l1;
    morph_cross(n, e1, e2);
    for (int i = 0; i < r->n; i++) {
        double a[3];
        morph_sub(v + 3 * polygon[i], o, a);
        r->p[i][0] = morph_dot(e1, a);
        r->p[i][1] = morph_dot(e2, a);
        r->prev[i] = (i + r->n - 1) % r->n;
        r->next[i] = (i + 1) % r->n;
    }
    return true;
}

/* ---- does it cross itself? ---- */

typedef struct span {
    double lo, hi;
    int edge;
} span;

static int by_lo(const void *a, const void *b) {
    const span *p = a, *q = b;
    if (p->lo != q->lo) return p->lo < q->lo ? -1 : 1;
    return (p->edge > q->edge) - (p->edge < q->edge);
}

/* Two edges cross where each has its ends strictly on both sides of the other. Touching (a hole joined by a
 * bridge runs along itself) is allowed: the margin, a distance, is single precision's. */
static bool edges_cross(const ring *r, int i, int j) {
    const double *a = r->p[i], *b = r->p[r->next[i]], *c = r->p[j], *d = r->p[r->next[j]];
    const double margin = 1e-6 * r->size, ei = margin * dist2(a, b), ej = margin * dist2(c, d);
    const double c1 = cross2(a, b, c), c2 = cross2(a, b, d), c3 = cross2(c, d, a), c4 = cross2(c, d, b);
    return ((c1 > ei && c2 < -ei) || (c1 < -ei && c2 > ei)) &&
           ((c3 > ej && c4 < -ej) || (c3 < -ej && c4 > ej));
}

/* Sweeps over the edges in order of their left ends. */
static bool crosses_itself(const ring *r, span *spans) {
    for (int i = 0; i < r->n; i++) {
        const double a = r->p[i][0], b = r->p[r->next[i]][0];
        spans[i] = (span){fmin(a, b), fmax(a, b), i};
    }
    qsort(spans, (size_t)r->n, sizeof *spans, by_lo);
    for (int i = 0; i < r->n; i++)
        for (int j = i + 1; j < r->n && spans[j].lo <= spans[i].hi; j++)
            if (edges_cross(r, spans[i].edge, spans[j].edge)) return true;
    return false;
}

/* ---- ears ---- */

/* How careful to be. NEAR keeps corners that lie on an ear's sides (within single precision) out of it: its
 * diagonal would run through them, and a triangle without area would be left over. EXACT trusts the
 * coordinates; ANY takes an ear without area, as a corner named twice needs. */
typedef enum care { CARE_NEAR, CARE_EXACT, CARE_ANY } care;

static bool same(const double a[2], const double b[2]) {
    return a[0] == b[0] && a[1] == b[1];
}

static bool blocks(const ring *r, int at, int i, double margin) {
    const double *a = r->p[r->prev[i]], *b = r->p[i], *c = r->p[r->next[i]], *q = r->p[at];
    /* The other end of a bridge stands on a corner of the ear and does not block it. */
    if (same(q, a) || same(q, b) || same(q, c)) return false;
    return cross2(a, b, q) > -margin * dist2(a, b) && cross2(b, c, q) > -margin * dist2(b, c) &&
           cross2(c, a, q) > -margin * dist2(c, a);
}

/* Quality of the ear at corner i: doubled area over the sum of squared sides (0 needle, 0.29 equilateral);
 * -1 if it is none. */
static double ear(const ring *r, int i, care how) {
    const double *a = r->p[r->prev[i]], *b = r->p[i], *c = r->p[r->next[i]];
    const double margin = how == CARE_NEAR ? 1e-6 * r->size : 0;
    const double ab = dist2(a, b), bc = dist2(b, c), ca = dist2(c, a), area = cross2(a, b, c);
    const double longest = fmax(ab, fmax(bc, ca)), rounding = 1e-14 * r->size * r->size;
    if (how == CARE_ANY ? area < -rounding : area <= fmax(margin * longest, rounding)) return -1;
    if (!(how == CARE_ANY && area <= rounding))
        for (int at = r->next[r->next[i]]; at != r->prev[i]; at = r->next[at])
            if (blocks(r, at, i, margin)) return -1;
    const double sides = ab * ab + bc * bc + ca * ca;
    return sides > 0 ? fmax(area, 0) / sides : 0;
}

static int best_ear(const ring *r, int from, care how) {
    int best = -1;
    double quality = -1;
    for (int k = 0, i = from; k < r->left; k++, i = r->next[i]) {
        const double q = how == CARE_NEAR ? r->quality[i] : ear(r, i, how);
        if (q > quality) {
            quality = q;
            best = i;
        }
    }
    return best;
}

static int refresh(ring *r, int from) {
    for (int k = 0, i = from; k < r->left; k++, i = r->next[i])
        r->quality[i] = ear(r, i, CARE_NEAR);
    return best_ear(r, from, CARE_NEAR);
}

/* Clips the best ear, again and again. The signed areas of the ears add up to the polygon's whatever is
 * clipped; as no ear is negative and the polygon does not cross itself, they tile it. */
static bool clip(ring *r, const int *polygon, int *out) {
    int from = 0;
    for (int i = 0; i < r->n; i++)
        r->quality[i] = ear(r, i, CARE_NEAR);
    for (r->left = r->n; r->left > 3; r->left--) {
        int i = -1;
        for (care how = CARE_NEAR; how <= CARE_ANY && i < 0; how++) {
            i = best_ear(r, from, how);
            /* A corner clipped since may have freed ears that it blocked. */
            if (i < 0 && how == CARE_NEAR) i = refresh(r, from);
        }
        if (i < 0) return false;
        const int p = r->prev[i], q = r->next[i];
        *out++ = polygon[p];
        *out++ = polygon[i];
        *out++ = polygon[q];
        r->next[p] = q;
        r->prev[q] = p;
        from = p;
        r->quality[p] = ear(r, p, CARE_NEAR);
        r->quality[q] = ear(r, q, CARE_NEAR);
    }
    const int a = r->prev[from], c = r->next[from];
    *out++ = polygon[a];
    *out++ = polygon[from];
    *out++ = polygon[c];
    return cross2(r->p[a], r->p[from], r->p[c]) >= -1e-14 * r->size * r->size;
}

bool morph_triangulate(const double *v, const int *polygon, int n, int *out) {
    if (n < 3) return false;
    ring r = {.n = n, .left = n};
    const size_t m = (size_t)n;
    r.p = morph_alloc(m, sizeof *r.p);
    r.prev = morph_alloc(m, sizeof *r.prev);
    r.next = morph_alloc(m, sizeof *r.next);
    r.quality = morph_alloc(m, sizeof *r.quality);
    span *spans = morph_alloc(m, sizeof *spans);
    const bool ok = r.p && r.prev && r.next && r.quality && spans && project(v, polygon, &r) &&
                    !crosses_itself(&r, spans) && clip(&r, polygon, out);
    free(r.p);
    free(r.prev);
    free(r.next);
    free(r.quality);
    free(spans);
    return ok;
}
