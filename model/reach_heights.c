/* Heights of a target seen from above, and what a sheet with limits makes of them. */
#include "model/cavity_internal.h"
#include "model/reach_internal.h"

#include <stdlib.h>
#include <string.h>

/* As many vertical lines as coverage is measured with, at most: their cost is most of the check's. */
static const double MOST_LINES = 20000.0;
/* Cells are an eighth of the spacing as there, finer for small targets, but not below a sixteenth: the ball
 * is then a few hundred cells, and the check stays within milliseconds. */
enum { PER_SPACING = 8, FINEST = 16, LEAST = 8 };

void morph_heights_free(morph_heights *r) {
    free(r->top);
    free(r->seen);
    free(r->closed);
    free(r->over);
    *r = (morph_heights){0};
}

static void lay_grid(const morph_mesh *m, double spacing, double margin, double lo[3], double hi[3],
                     morph_heights *r) {
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    for (int i = 0; i < 3 * m->vertices; i++) {
        lo[i % 3] = fmin(lo[i % 3], m->v[i]);
        hi[i % 3] = fmax(hi[i % 3], m->v[i]);
    }
    const double wide = sqrt((hi[0] - lo[0]) / MOST_LINES * (hi[1] - lo[1]));
    for (int k = 0; k < 2; k++) {
        const double size = fmax(hi[k] - lo[k], 1e-9 * spacing); /* a wall seen on edge is one line wide */
        const double fine = fmax(fmin(spacing / PER_SPACING, size / LEAST), spacing / FINEST);
        /* Of a long strip no more lines than there may be in all. */
        const double count = fmin(fmax(1.0, ceil(size / fmax(fine, wide))), MOST_LINES);
        r->cell[k] = size / count;
        r->pad[k] = (int)fmin(ceil(margin / r->cell[k]), 64.0) + 1;
        r->n[k] = (int)count + 2 * r->pad[k];
        r->lo[k] = lo[k] + (0.5 - r->pad[k]) * r->cell[k];
    }
}

/* Surface below the first hit: crossings above the floor, whichever way they look. What stands on the floor
 * is no overhang; a hundredth of the spacing is far below what a sheet could enter. */
static int hidden_hits(const morph_hits *hits, double floor, double spacing) {
    int n = 0;
    for (int k = 0; k + 1 < hits->count; k++)
        n += hits->z[k] > floor + 0.01 * spacing;
    return n;
}

static morph_status look_down(const morph_distance *d, double spacing, morph_heights *r) {
    morph_hits hits = {0};
    morph_status status = MORPH_OK;
    double below = 0.0;
    for (int j = 0; j < r->n[1] && status == MORPH_OK; j++)
        for (int i = 0; i < r->n[0] && status == MORPH_OK; i++) {
            const size_t at = morph_heights_at(r, i, j);
            r->top[at] = r->floor;
            if (i < r->pad[0] || i >= r->n[0] - r->pad[0] || j < r->pad[1] || j >= r->n[1] - r->pad[1])
                continue;
            status = morph_hits_find(d, r->lo[0] + i * r->cell[0], r->lo[1] + j * r->cell[1], &hits);
            if (status != MORPH_OK || hits.count == 0 || hits.z[hits.count - 1] <= r->floor) continue;
            r->top[at] = hits.z[hits.count - 1];
            r->seen[at] = true;
            r->exposed++;
            below += hidden_hits(&hits, r->floor, spacing);
        }
    morph_hits_free(&hits);
    r->hidden = r->exposed > 0 ? below / (below + r->exposed) : 0.0;
    return status;
}

/* A structuring element: heights b(o) over the cells o within `radius`; flat disc or upper half of a ball. */
typedef struct element {
    int reach[2];
    int count;
    int (*offset)[2];
    double *height;
} element;

static void element_free(element *e) {
    free(e->offset);
    free(e->height);
}

static morph_status element_create(const morph_heights *r, double radius, bool ball, element *e) {
    size_t room = 1;
    *e = (element){0};
    for (int k = 0; k < 2; k++) {
        e->reach[k] = (int)fmin(floor(radius / r->cell[k]), r->n[k] - 1);
        room *= 2 * (size_t)e->reach[k] + 1;
    }
    e->offset = morph_alloc(room, sizeof *e->offset);
    e->height = morph_alloc(room, sizeof *e->height);
    if (!e->offset || !e->height) {
        element_free(e);
        return MORPH_ERR_NOMEM;
    }
    for (int j = -e->reach[1]; j <= e->reach[1]; j++)
        for (int i = -e->reach[0]; i <= e->reach[0]; i++) {
            const double x = i * r->cell[0], y = j * r->cell[1], rest = radius * radius - x * x - y * y;
            if (rest < 0.0) continue;
            e->offset[e->count][0] = i;
            e->offset[e->count][1] = j;
            e->height[e->count++] = ball ? sqrt(rest) : 0.0;
        }
    return MORPH_OK;
}

/* sign +1, dilation: out(p) = max over o of in(p + o) + b(o). sign -1, erosion: out(p) = min over o of
 * in(p + o) - b(o). Beyond the grid there is what stands at its border: the floor. Offset by offset over
 * whole rows, which is several times faster than cell by cell. */
static void morphology(const morph_heights *r, const element *e, double sign, const double *in, double *out) {
    const int nx = r->n[0], ny = r->n[1];
    for (size_t k = 0; k < (size_t)nx * (size_t)ny; k++)
        out[k] = -INFINITY;
    for (int k = 0; k < e->count; k++) {
        const int dx = e->offset[k][0], dy = e->offset[k][1];
        const int first = dx < 0 ? -dx : 0, last = dx > 0 ? nx - dx : nx;
        for (int j = dy < 0 ? -dy : 0; j < (dy > 0 ? ny - dy : ny); j++) {
            double *to = out + (ptrdiff_t)j * nx;
            const double *from = in + (ptrdiff_t)(j + dy) * nx + dx;
            for (int i = first; i < last; i++) {
                const double value = sign * from[i] + e->height[k];
                to[i] = value > to[i] ? value : to[i];
            }
        }
    }
    for (size_t k = 0; k < (size_t)nx * (size_t)ny; k++)
        out[k] *= sign;
}

/* The centres of a ball that touches the surface from above form its dilation; what the lowest of those
 * balls leave open below them is the closing. */
static morph_status close_by_ball(morph_heights *r, double radius, double *scratch) {
    element e;
    const morph_status status = element_create(r, radius, true, &e);
    if (status != MORPH_OK) return status;
    morphology(r, &e, 1.0, r->top, scratch);
    morphology(r, &e, -1.0, scratch, r->closed);
    element_free(&e);
    /* Rounding of sums and differences of the radius aside, a closing is never below. */
    for (size_t k = 0; k < (size_t)r->n[0] * (size_t)r->n[1]; k++)
        r->closed[k] = fmax(r->closed[k], r->top[k]);
    return MORPH_OK;
}

/* Least function above `closed` whose slope along each axis is at most `slope`: the upper envelope of cones
 * |dx| + |dy| over all cells, exact by one sweep to and fro along each axis. A line of arc lambda D + shear
 * over the plan D falls by sqrt((lambda D + shear)^2 - D^2), which is no less than slope D + shear: the
 * envelope is lowered by that, but not below `closed`. */
static void limit_slope(morph_heights *r, const morph_heights_limits *limits) {
    const int nx = r->n[0], ny = r->n[1];
    const double fall[2] = {limits->slope * r->cell[0], limits->slope * r->cell[1]};
    double *z = r->over;
    memcpy(z, r->closed, (size_t)nx * (size_t)ny * sizeof *z);
    for (int j = 0; j < ny; j++) {
        double *row = z + (size_t)j * (size_t)nx;
        for (int i = 1; i < nx; i++)
            row[i] = fmax(row[i], row[i - 1] - fall[0]);
        for (int i = nx - 1; i-- > 0;)
            row[i] = fmax(row[i], row[i + 1] - fall[0]);
    }
    for (int i = 0; i < nx; i++) {
        for (int j = 1; j < ny; j++)
            z[morph_heights_at(r, i, j)] =
                fmax(z[morph_heights_at(r, i, j)], z[morph_heights_at(r, i, j - 1)] - fall[1]);
        for (int j = ny - 1; j-- > 0;)
            z[morph_heights_at(r, i, j)] =
                fmax(z[morph_heights_at(r, i, j)], z[morph_heights_at(r, i, j + 1)] - fall[1]);
    }
    for (size_t k = 0; k < (size_t)nx * (size_t)ny; k++)
        z[k] = fmax(z[k] - limits->shear, r->closed[k]);
}

morph_status morph_heights_create(const morph_distance *target, double base, double spacing,
                                  const morph_heights_limits *limits, morph_heights *r) {
    double lo[3], hi[3];
    *r = (morph_heights){0};
    lay_grid(morph_distance_mesh(target), spacing, fmax(limits->ball, spacing), lo, hi, r);
    if (!isfinite(lo[2]) || !isfinite(hi[2] - lo[2])) return MORPH_ERR_NONFINITE;
    r->floor = isnan(base) ? lo[2] : base;
    const size_t cells = (size_t)r->n[0] * (size_t)r->n[1];
    r->top = morph_alloc(cells, sizeof *r->top);
    r->seen = morph_alloc(cells, sizeof *r->seen);
    r->closed = morph_alloc(cells, sizeof *r->closed);
    r->over = morph_alloc(cells, sizeof *r->over);
    morph_status status = r->top && r->seen && r->closed && r->over ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = look_down(target, spacing, r);
    if (status == MORPH_OK) status = close_by_ball(r, limits->ball, r->over);
    if (status == MORPH_OK)
        limit_slope(r, limits);
    else
        morph_heights_free(r);
    return status;
}

/* Spreads the opened heights under the top until nothing grows: each level part that a disc fits into comes
 * back whole, corners too. Sweeps to and fro take values along straight ways at once. */
static void reconstruct(const morph_heights *r, double *z) {
    const int nx = r->n[0], ny = r->n[1];
    for (bool grew = true; grew;) {
        grew = false;
        for (int pass = 0; pass < 2; pass++)
            for (int at = 0; at < nx * ny; at++) {
                const int k = pass ? nx * ny - 1 - at : at, i = k % nx, j = k / nx, back = pass ? 1 : -1;
                double most = z[k];
                if (i + back >= 0 && i + back < nx) most = fmax(most, z[k + back]);
                if (j + back >= 0 && j + back < ny) most = fmax(most, z[k + back * nx]);
                most = fmin(most, r->top[k]);
                if (most <= z[k]) continue;
                z[k] = most;
                grew = true;
            }
    }
}

morph_status morph_heights_open(const morph_heights *r, double radius, double *out) {
    element e;
    double *worn = morph_alloc((size_t)r->n[0] * (size_t)r->n[1], sizeof *worn);
    morph_status status = worn ? element_create(r, radius, false, &e) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        morphology(r, &e, -1.0, r->top, worn);
        memcpy(out, worn, (size_t)r->n[0] * (size_t)r->n[1] * sizeof *out);
        element_free(&e);
        reconstruct(r, out);
    }
    free(worn);
    return status;
}
