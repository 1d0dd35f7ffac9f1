/* Cavity volume: vertical columns, exact in z.
 *
 * Along a vertical line the winding number of the closed skin at height z is the sum of the signs of the
 * crossings above z (a crossing whose normal points up counts +1): the skirt is vertical and no line in
 * general position meets it, the floor lies below. So over each column the heights of all crossings cut the
 * line into pieces of constant winding, and the pieces with w >= 1, outside the target and above the base
 * plane are added up. Folded and doubly covered places need no care. */
#include "model/cavity_internal.h"
#include "model/distance_internal.h"

#include <stdlib.h>
#include <string.h>

static const double MAX_COLUMNS = 400000;

void morph_hits_free(morph_hits *hits) {
    free(hits->z);
    free(hits->sign);
    *hits = (morph_hits){0};
}

morph_status morph_hits_find(const morph_distance *d, double x, double y, morph_hits *hits) {
    hits->count = morph_vertical_hits(d, x, y, hits->z, hits->sign, hits->capacity);
    if (hits->count <= hits->capacity) return MORPH_OK;
    const int wanted = 2 * hits->count;
    morph_hits_free(hits);
    hits->z = morph_alloc((size_t)wanted, sizeof *hits->z);
    hits->sign = morph_alloc((size_t)wanted, sizeof *hits->sign);
    if (!hits->z || !hits->sign) {
        morph_hits_free(hits);
        return MORPH_ERR_NOMEM;
    }
    hits->capacity = wanted;
    hits->count = morph_vertical_hits(d, x, y, hits->z, hits->sign, hits->capacity);
    return MORPH_OK;
}

typedef struct border_edge {
    int low, high, from, to;
} border_edge;

static int compare_edges(const void *pa, const void *pb) {
    const border_edge *a = pa, *b = pb;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return (a->from > b->from) - (a->from < b->from);
}

/* Edges of one triangle only, in that triangle's direction. edge: 3*skin_triangles entries; returns how many.
 */
static int find_border(const morph_structure *s, border_edge *edge) {
    const int n = 3 * s->skin_triangles;
    for (int i = 0; i < n; i++) {
        const int a = s->skin[i / 3][i % 3], b = s->skin[i / 3][(i + 1) % 3];
        edge[i] = (border_edge){a < b ? a : b, a < b ? b : a, a, b};
    }
    qsort(edge, (size_t)n, sizeof *edge, compare_edges);
    int border = 0;
    for (int i = 0, j; i < n; i = j) {
        for (j = i + 1; j < n && edge[j].low == edge[i].low && edge[j].high == edge[i].high; j++)
            ;
        if (j == i + 1) edge[border++] = edge[i];
    }
    return border;
}

/* Triangles (to, from, apex) close the border; the apex is the centroid of the border as a curve. */
static int add_fan(const morph_structure *s, const double *x, const border_edge *edge, int border,
                   morph_mesh *mesh) {
    double *apex = mesh->v + 3 * (size_t)s->joints, whole = 0;
    memcpy(apex, x + 3 * (size_t)s->skin[0][0], 3 * sizeof *apex);
    double sum[3] = {0};
    for (int i = 0; i < border; i++) {
        const double *a = x + 3 * (size_t)edge[i].from, *b = x + 3 * (size_t)edge[i].to;
        const double length = morph_dist(a, b);
        whole += length;
        for (int k = 0; k < 3; k++)
            sum[k] += length * (a[k] + b[k]) / 2;
        int *t = mesh->t + 3 * (size_t)(s->skin_triangles + i);
        t[0] = edge[i].to;
        t[1] = edge[i].from;
        t[2] = s->joints;
    }
    for (int k = 0; whole > 0 && k < 3; k++)
        apex[k] = sum[k] / whole;
    return border;
}

static morph_status fill_surface(const morph_structure *s, const double *x, bool fan, morph_mesh *mesh,
                                 border_edge **edge) {
    const size_t triangles = (size_t)s->skin_triangles;
    mesh->v = morph_alloc(3 * ((size_t)s->joints + 1), sizeof *mesh->v);
    mesh->t = morph_alloc(12 * triangles, sizeof *mesh->t); /* each edge may be border */
    *edge = morph_alloc(3 * triangles, sizeof **edge);
    if (!mesh->v || !mesh->t || !*edge) return MORPH_ERR_NOMEM;
    memcpy(mesh->v, x, 3 * (size_t)s->joints * sizeof *x);
    memcpy(mesh->t, s->skin, 3 * triangles * sizeof *mesh->t);
    mesh->vertices = s->joints;
    mesh->triangles = s->skin_triangles;
    if (fan) {
        mesh->triangles += add_fan(s, x, *edge, find_border(s, *edge), mesh);
        mesh->vertices++;
    }
    return MORPH_OK;
}

morph_status morph_skin_surface(const morph_structure *structure, const double *x, bool fan,
                                morph_distance **out) {
    morph_mesh mesh = {0};
    border_edge *edge = NULL;
    *out = NULL;
    morph_status status = fill_surface(structure, x, fan, &mesh, &edge);
    if (status == MORPH_OK) status = morph_distance_create(&mesh, false, out);
    free(mesh.v);
    free(mesh.t);
    free(edge);
    return status;
}

typedef struct column {
    const morph_cavity *cavity;
    const morph_distance *skin;
    double x, y, floor;
    morph_hits on_skin, on_target;
} column;

/* Is the piece from z0 to z1 of the column inside the target?  Closed targets: by the crossings above it. */
static bool piece_inside(const column *c, int target_winding, double z0, double z1) {
    if (c->cavity->target->closed) return target_winding >= 1;
    return morph_inside(c->cavity->target, (double[3]){c->x, c->y, z0 + (z1 - z0) / 2});
}

/* The pieces of one column that are cavity, upward. Grows as needed. */
static morph_status column_pieces(const column *c, morph_pieces *out) {
    const int most = c->on_skin.count + c->on_target.count;
    out->count = 0;
    if (most > out->capacity) {
        free(out->z);
        out->z = morph_alloc((size_t)(2 * most), sizeof *out->z);
        out->capacity = out->z ? 2 * most : 0;
        if (!out->z) return MORPH_ERR_NOMEM;
    }
    int winding = 0, inside = 0, i = 0, j = 0;
    for (int k = 0; k < c->on_skin.count; k++)
        winding += c->on_skin.sign[k];
    for (int k = 0; k < c->on_target.count; k++)
        inside += c->on_target.sign[k];
    double from = c->floor;
    while (i < c->on_skin.count) {
        const bool skin_next = j >= c->on_target.count || c->on_skin.z[i] <= c->on_target.z[j];
        const double z = skin_next ? c->on_skin.z[i] : c->on_target.z[j];
        if (z > from) {
            /* Without a floor the winding below the lowest crossing is 0: nothing infinite is kept. */
            if (winding >= 1 && isfinite(from) && !piece_inside(c, inside, from, z)) {
                out->z[out->count][0] = from;
                out->z[out->count++][1] = z;
            }
            from = z;
        }
        if (skin_next)
            winding -= c->on_skin.sign[i++];
        else
            inside -= c->on_target.sign[j++];
    }
    return MORPH_OK;
}

morph_status morph_cavity_sweep(const morph_cavity *cavity, const double *x, double cell,
                                morph_columns *columns, morph_piece_visit visit, void *data) {
    *columns = (morph_columns){0};
    if (!(cell > 0)) return MORPH_ERR_INPUT;
    const bool fan = !isfinite(cavity->base);
    morph_distance *skin;
    morph_status status = morph_skin_surface(cavity->structure, x, fan, &skin);
    if (status != MORPH_OK) return status;
    column c = {.cavity = cavity, .skin = skin, .floor = fan ? -INFINITY : cavity->base};
    const double wx = skin->hi[0] - skin->lo[0], wy = skin->hi[1] - skin->lo[1];
    const double wide = fmax(cell, sqrt(wx / MAX_COLUMNS * wy));
    /* A sheet on edge is one row of columns of no width. */
    const int nx = (int)fmin(fmax(1, ceil(wx / wide)), MAX_COLUMNS);
    const int ny = (int)fmin(fmax(1, ceil(wy / wide)), MAX_COLUMNS);
    *columns = (morph_columns){nx, ny, {skin->lo[0], skin->lo[1]}, {wx / nx, wy / ny}};
    morph_pieces pieces = {0};
    for (int i = 0; i < nx && status == MORPH_OK; i++)
        for (int j = 0; j < ny && status == MORPH_OK; j++) {
            c.x = skin->lo[0] + (i + 0.5) * (wx / nx);
            c.y = skin->lo[1] + (j + 0.5) * (wy / ny);
            status = morph_hits_find(skin, c.x, c.y, &c.on_skin);
            if (status != MORPH_OK || c.on_skin.count == 0) continue;
            status = morph_hits_find(cavity->target, c.x, c.y, &c.on_target);
            if (status == MORPH_OK) status = column_pieces(&c, &pieces);
            if (status == MORPH_OK && pieces.count > 0) status = visit(data, i, j, &pieces);
        }
    free(pieces.z);
    morph_hits_free(&c.on_skin);
    morph_hits_free(&c.on_target);
    morph_distance_destroy(skin);
    return status;
}

static morph_status add_column(void *data, int i, int j, const morph_pieces *pieces) {
    (void)i;
    (void)j;
    double height = 0, *sum = data;
    for (int k = 0; k < pieces->count; k++)
        height += pieces->z[k][1] - pieces->z[k][0];
    *sum += height;
    return MORPH_OK;
}

morph_status morph_cavity_volume(const morph_cavity *cavity, const double *x, double cell, double *volume) {
    morph_columns columns;
    double sum = 0;
    const morph_status status = morph_cavity_sweep(cavity, x, cell, &columns, add_column, &sum);
    *volume = sum * columns.width[0] * columns.width[1];
    return status;
}
