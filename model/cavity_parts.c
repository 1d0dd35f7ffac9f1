/* Connected cavities: union of overlapping pieces of neighbouring columns. */
#include "model/cavity_parts.h"

#include "model/cavity_internal.h"

#include <stdlib.h>

/* Flat triangles of a sheet on a round target: see the header. */
#define FILM_SPACINGS 0.05

double morph_cavity_film(const morph_structure *structure) {
    return structure->def.radius + FILM_SPACINGS * structure->spacing;
}

typedef struct piece {
    double z[2];
    int i, j; /* its column */
    int root; /* union-find: the piece that stands for all that are joined; a smaller or the same number */
} piece;

/* All pieces in the order of the sweep, those of a column upward. */
typedef struct gathering {
    double least, film; /* film as a sum of heights, m */
    double heights;     /* of everything, m */
    morph_columns columns;
    piece *piece;
    int count, capacity;
} gathering;

static int root_of(piece *p, int k) {
    while (p[k].root != k) {
        p[k].root = p[p[k].root].root;
        k = p[k].root;
    }
    return k;
}

static void join(piece *p, int a, int b) {
    const int ra = root_of(p, a), rb = root_of(p, b);
    if (ra < rb)
        p[rb].root = ra;
    else
        p[ra].root = rb;
}

static morph_status grow(gathering *g, int by) {
    if (g->count + by <= g->capacity) return MORPH_OK;
    const int capacity = 2 * (g->count + by) + 1000;
    piece *larger = realloc(g->piece, (size_t)capacity * sizeof *larger);
    if (!larger) return MORPH_ERR_NOMEM;
    g->piece = larger;
    g->capacity = capacity;
    return MORPH_OK;
}

/* Pieces that meet (the skin crosses itself there, say) are one. */
static morph_status add_pieces(void *data, int i, int j, const morph_pieces *pieces) {
    gathering *g = data;
    const morph_status status = grow(g, pieces->count);
    if (status != MORPH_OK) return status;
    double height = 0;
    for (int k = 0; k < pieces->count;) {
        const double from = pieces->z[k][0];
        double to = from;
        do {
            height += pieces->z[k][1] - pieces->z[k][0];
            to = pieces->z[k++][1];
        } while (k < pieces->count && pieces->z[k][0] <= to);
        if (to - from <= g->least) {
            g->film += to - from;
            continue;
        }
        g->piece[g->count] = (piece){{from, to}, i, j, g->count};
        g->count++;
    }
    g->heights += height;
    return MORPH_OK;
}

/* Joins the pieces [a, a_end) and [b, b_end) of two columns where their heights overlap: both go upward, so
 * the lower of two goes on. */
static void join_columns(piece *p, int a, int a_end, int b, int b_end) {
    while (a < a_end && b < b_end) {
        if (fmax(p[a].z[0], p[b].z[0]) < fmin(p[a].z[1], p[b].z[1])) join(p, a, b);
        if (p[a].z[1] < p[b].z[1])
            a++;
        else
            b++;
    }
}

static int column_end(const gathering *g, int from) {
    int k = from;
    while (k < g->count && g->piece[k].i == g->piece[from].i && g->piece[k].j == g->piece[from].j)
        k++;
    return k;
}

/* Columns come with j fastest: of two neighbours in i the earlier one is found by a second finger that
 * follows a row behind. */
static void join_all(gathering *g) {
    piece *p = g->piece;
    int behind = 0;
    for (int k = 0, end; k < g->count; k = end) {
        end = column_end(g, k);
        if (end < g->count && p[end].i == p[k].i && p[end].j == p[k].j + 1)
            join_columns(p, k, end, end, column_end(g, end));
        while (behind < k &&
               (p[behind].i < p[k].i - 1 || (p[behind].i == p[k].i - 1 && p[behind].j < p[k].j)))
            behind++;
        if (behind < k && p[behind].i == p[k].i - 1 && p[behind].j == p[k].j)
            join_columns(p, behind, column_end(g, behind), k, end);
    }
}

typedef struct sum {
    morph_cavity_part part;
    int last, first; /* pieces: the last one added, and the one that stands for all */
} sum;

static void add_piece(const gathering *g, int k, sum *into) {
    const piece *p = &g->piece[k];
    const morph_columns *c = &g->columns;
    morph_cavity_part *part = &into->part;
    const double height = p->z[1] - p->z[0];
    const double corner[2] = {c->lo[0] + p->i * c->width[0], c->lo[1] + p->j * c->width[1]};
    const bool fresh = part->columns == 0;
    for (int d = 0; d < 3; d++) {
        const double lo = d < 2 ? corner[d] : p->z[0], hi = d < 2 ? corner[d] + c->width[d] : p->z[1];
        part->lo[d] = fresh ? lo : fmin(part->lo[d], lo);
        part->hi[d] = fresh ? hi : fmax(part->hi[d], hi);
        part->at[d] += height * (0.5 * lo + 0.5 * hi);
    }
    part->volume += height;
    part->height = fmax(part->height, height);
    const piece *before = &g->piece[into->last];
    if (fresh || before->i != p->i || before->j != p->j) part->columns++;
    into->last = k;
}

static int by_volume(const void *a, const void *b) {
    const sum *p = a, *q = b;
    if (p->part.volume != q->part.volume) return p->part.volume > q->part.volume ? -1 : 1;
    return (p->first > q->first) - (p->first < q->first);
}

/* Sums up, one entry per cavity in list; returns how many. Heights become volumes. */
static int sum_up(gathering *g, sum *list) {
    const double cell = g->columns.width[0] * g->columns.width[1];
    int found = 0;
    for (int k = 0; k < g->count; k++) {
        const int root = root_of(g->piece, k);
        list[root].first = root;
        add_piece(g, k, &list[root]);
    }
    for (int k = 0; k < g->count; k++) {
        if (g->piece[k].root != k) continue;
        list[found] = list[k];
        morph_cavity_part *part = &list[found++].part;
        for (int d = 0; d < 3; d++)
            part->at[d] /= part->volume;
        part->volume *= cell;
        part->area = part->columns * cell;
    }
    qsort(list, (size_t)found, sizeof *list, by_volume);
    return found;
}

static morph_status list_parts(gathering *g, double share, morph_cavity_parts *out) {
    sum *list = morph_alloc((size_t)g->count, sizeof *list);
    if (!list) return MORPH_ERR_NOMEM;
    const int found = sum_up(g, list);
    out->cell = g->columns.width[0] * g->columns.width[1];
    out->volume = g->heights * out->cell;
    out->film = g->film * out->cell;
    int large = 0;
    while (large < found && list[large].part.volume >= share * out->volume)
        large++;
    for (int k = large; k < found; k++)
        out->small += list[k].part.volume;
    out->part = morph_alloc((size_t)large, sizeof *out->part);
    for (int k = 0; out->part && k < large; k++)
        out->part[k] = list[k].part;
    out->count = out->part ? large : 0;
    free(list);
    return out->part ? MORPH_OK : MORPH_ERR_NOMEM;
}

morph_status morph_cavity_parts_find(const morph_cavity *cavity, const double *x, double cell, double least,
                                     double share, morph_cavity_parts *out) {
    *out = (morph_cavity_parts){0};
    if (!(least >= 0) || !(share >= 0)) return MORPH_ERR_INPUT;
    gathering g = {.least = least};
    morph_status status = morph_cavity_sweep(cavity, x, cell, &g.columns, add_pieces, &g);
    if (status == MORPH_OK) {
        join_all(&g);
        status = list_parts(&g, share, out);
    }
    free(g.piece);
    if (status != MORPH_OK) *out = (morph_cavity_parts){0};
    return status;
}

void morph_cavity_parts_free(morph_cavity_parts *parts) {
    free(parts->part);
    *parts = (morph_cavity_parts){0};
}
