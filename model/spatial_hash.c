/* Spatial hashing in grids a factor of four apart. */
#include "model/spatial_hash.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Products of larger coordinates overflow elsewhere (distance.h has the same bound). */
#define MOST_COORDINATE 1e60
/* Cells no narrower than 2^-50 of the largest coordinate: their numbers stay below 2^52, where doubles and
 * their floors are exact. From there up to twice that coordinate, two octaves a level: 27 levels. */
#define FINEST_CELL (-50)
#define LEVELS 28
#define MOST_BOXES (1 << 27)
#define MOST_PAIRS (1 << 30)

struct morph_hash {
    int *start;     /* table + 1: first entry of each bucket */
    int *entry;     /* box numbers, bucket by bucket */
    uint8_t *level; /* of each box */
    int (*pair)[2];
    size_t table_room, entry_room, level_room, pair_room;
    uint32_t mask; /* buckets - 1 */
    int pairs;
    double inverse[LEVELS]; /* 1 / cell, powers of two */
    bool used[2][LEVELS];   /* per set */
};

/* The boxes of one call: those of the first set, then those of the second. */
typedef struct input {
    const morph_box *box[2];
    int n[2];
} input;

typedef struct cells {
    int64_t lo[3], hi[3]; /* hi - lo is 0 or 1 */
} cells;

morph_status morph_hash_create(morph_hash **out) {
    *out = morph_alloc(1, sizeof **out);
    return *out ? MORPH_OK : MORPH_ERR_NOMEM;
}

void morph_hash_destroy(morph_hash *hash) {
    if (!hash) return;
    free(hash->start);
    free(hash->entry);
    free(hash->level);
    free(hash->pair);
    free(hash);
}

size_t morph_hash_bytes(const morph_hash *hash) {
    return hash->table_room * sizeof *hash->start + hash->entry_room * sizeof *hash->entry +
           hash->level_room * sizeof *hash->level + hash->pair_room * sizeof *hash->pair;
}

/* Room for n items, old contents dropped unless `keep`; grows by half so that repeats soon ask for nothing.
 */
static bool grow(void **array, size_t *room, size_t n, size_t size, bool keep) {
    if (n <= *room) return true;
    const size_t more = n + n / 2 + 16;
    void *memory;
    if (keep)
        memory = realloc(*array, more * size);
    else {
        memory = morph_alloc(more, size);
        if (memory) free(*array);
    }
    if (!memory) return false;
    *array = memory;
    *room = more;
    return true;
}

static const morph_box *box_of(const input *in, int i) {
    return i < in->n[0] ? &in->box[0][i] : &in->box[1][i - in->n[0]];
}

static double extent_of(const morph_box *box) {
    double most = box->hi[0] - box->lo[0];
    for (int k = 1; k < 3; k++)
        if (box->hi[k] - box->lo[k] > most) most = box->hi[k] - box->lo[k];
    return most;
}

static morph_status validate(const input *in, double *largest) {
    *largest = 0.0;
    for (int i = 0; i < in->n[0] + in->n[1]; i++) {
        const morph_box *box = box_of(in, i);
        for (int k = 0; k < 3; k++) {
            const double lo = fabs(box->lo[k]), hi = fabs(box->hi[k]), far = lo > hi ? lo : hi;
            if (!(lo <= MOST_COORDINATE) || !(hi <= MOST_COORDINATE)) return MORPH_ERR_NONFINITE;
            if (box->lo[k] > box->hi[k]) return MORPH_ERR_INPUT;
            if (far > *largest) *largest = far;
        }
    }
    return MORPH_OK;
}

/* Least power of two, as an exponent, that is no smaller than a positive size. */
static int exponent_of(double size) {
    int e;
    const double mantissa = frexp(size, &e); /* in [1/2, 1) */
    return mantissa == 0.5 ? e - 1 : e;
}

/* Levels such that one of them has cells of the boxes' geometric mean, rounded up to a power of two; boxes
 * without extent count as the finest. */
static void set_cells(morph_hash *h, const input *in, double largest) {
    const int finest = largest > 0.0 ? exponent_of(largest) + FINEST_CELL : 0;
    int64_t sum = 0, count = 0;
    for (int i = 0; i < in->n[0] + in->n[1]; i++) {
        const double extent = extent_of(box_of(in, i));
        if (!(extent > 0.0)) continue;
        const int e = exponent_of(extent);
        sum += e > finest ? e : finest;
        count++;
    }
    /* Rounded up: most boxes of about one size then fit the level, not the next one. */
    const int64_t mean = count > 0 ? finest + (sum - finest * count + count - 1) / count : finest;
    const int first = finest + (int)((mean - finest) & 1);
    for (int l = 0; l < LEVELS; l++)
        h->inverse[l] = ldexp(1.0, -(first + 2 * l));
}

/* Exact: the cell is a power of two, and the product stays below 2^52. */
static int64_t cell_at(double x, double inverse) {
    return (int64_t)floor(x * inverse);
}

static void cells_at(const morph_hash *h, const morph_box *box, int level, cells *c) {
    for (int k = 0; k < 3; k++) {
        c->lo[k] = cell_at(box->lo[k], h->inverse[level]);
        c->hi[k] = cell_at(box->hi[k], h->inverse[level]);
    }
}

/* Whether the box covers at most two cells a side. */
static bool fits(const morph_hash *h, const morph_box *box, int level) {
    cells c;
    cells_at(h, box, level, &c);
    return c.hi[0] - c.lo[0] <= 1 && c.hi[1] - c.lo[1] <= 1 && c.hi[2] - c.lo[2] <= 1;
}

/* A box without extent belongs to the finest level in use: a search by size would put it in cells that no
 * other box is small enough to need. */
static void set_levels(morph_hash *h, const input *in) {
    const int all = in->n[0] + in->n[1], first = -ilogb(h->inverse[0]);
    int least = LEVELS - 1;
    memset(h->used, 0, sizeof h->used);
    for (int i = 0; i < all; i++) {
        const morph_box *box = box_of(in, i);
        const double extent = extent_of(box);
        h->level[i] = 0;
        if (!(extent > 0.0)) continue;
        const int e = exponent_of(extent) - first;
        int level = e <= 0 ? 0 : (e + 1) / 2;
        /* The extent was rounded: cells decide. */
        while (level < LEVELS - 1 && !fits(h, box, level))
            level++;
        h->level[i] = (uint8_t)level;
        if (level < least) least = level;
    }
    if (least == LEVELS - 1) least = 0;
    for (int i = 0; i < all; i++) {
        if (!(extent_of(box_of(in, i)) > 0.0)) h->level[i] = (uint8_t)least;
        h->used[i >= in->n[0]][h->level[i]] = true;
    }
}

/* Two coordinates are mixed by multiplication (the 64-bit golden ratio and one of Teschner's primes) and
 * shifts, so that lattices of cells spread over the buckets; the third is added, so that a column of cells
 * lies side by side in memory. */
static uint32_t bucket_of(const morph_hash *h, int64_t i, int64_t j, int64_t k, int level, int set) {
    uint64_t key = (uint64_t)i * 73856093u ^ (uint64_t)j * 0x9E3779B97F4A7C15u;
    key += (uint64_t)(2 * level + set) * 0xD1B54A32D192ED03u;
    key ^= key >> 29;
    key *= 0xBF58476D1CE4E5B9u;
    key ^= key >> 32;
    return (uint32_t)(key + (uint64_t)k) & h->mask;
}

/* Buckets of a box's cells, each once even where two cells share one. Returns the count, 8 at most. */
static int buckets_of(const morph_hash *h, const morph_box *box, int level, int set, uint32_t bucket[8]) {
    cells c;
    cells_at(h, box, level, &c);
    int n = 0;
    for (int64_t i = c.lo[0]; i <= c.hi[0]; i++)
        for (int64_t j = c.lo[1]; j <= c.hi[1]; j++)
            for (int64_t k = c.lo[2]; k <= c.hi[2]; k++) {
                const uint32_t b = bucket_of(h, i, j, k, level, set);
                int at = 0;
                while (at < n && bucket[at] != b)
                    at++;
                if (at == n) bucket[n++] = b;
            }
    return n;
}

/* Counting sort of box numbers by bucket. Filling backwards turns the ends of the buckets into their starts
 * and leaves each bucket in ascending order. */
static morph_status fill(morph_hash *h, const input *in) {
    const int all = in->n[0] + in->n[1];
    uint32_t bucket[8];
    uint32_t buckets = 16;
    while (buckets < 4u * (uint32_t)all)
        buckets *= 2;
    h->mask = buckets - 1;
    if (!grow((void **)&h->start, &h->table_room, (size_t)buckets + 1, sizeof *h->start, false))
        return MORPH_ERR_NOMEM;
    memset(h->start, 0, ((size_t)buckets + 1) * sizeof *h->start);
    for (int i = 0; i < all; i++) {
        const int n = buckets_of(h, box_of(in, i), h->level[i], i >= in->n[0], bucket);
        for (int k = 0; k < n; k++)
            h->start[bucket[k]]++;
    }
    int sum = 0; /* at most 8 * 2^27 */
    for (uint32_t b = 0; b <= buckets; b++) {
        sum += h->start[b];
        h->start[b] = sum;
    }
    if (!grow((void **)&h->entry, &h->entry_room, (size_t)sum, sizeof *h->entry, false))
        return MORPH_ERR_NOMEM;
    for (int i = all - 1; i >= 0; i--) {
        const int n = buckets_of(h, box_of(in, i), h->level[i], i >= in->n[0], bucket);
        for (int k = 0; k < n; k++)
            h->entry[--h->start[bucket[k]]] = i;
    }
    return MORPH_OK;
}

static morph_status add_pair(morph_hash *h, int i, int j) {
    if ((size_t)h->pairs == h->pair_room) {
        if (h->pairs >= MOST_PAIRS) return MORPH_ERR_NOMEM;
        if (!grow((void **)&h->pair, &h->pair_room, (size_t)h->pairs + 1, sizeof *h->pair, true))
            return MORPH_ERR_NOMEM;
    }
    h->pair[h->pairs][0] = i < j ? i : j;
    h->pair[h->pairs][1] = i < j ? j : i;
    h->pairs++;
    return MORPH_OK;
}

/* Whether the low corner of the overlap of a and b lies in cell `at` of a level: it lies in exactly one, and
 * both boxes cover it, so a pair met in several cells is taken in that one. */
static bool meets_here(const morph_hash *h, const morph_box *a, const morph_box *b, int level,
                       const int64_t at[3]) {
    for (int k = 0; k < 3; k++)
        if (cell_at(a->lo[k] > b->lo[k] ? a->lo[k] : b->lo[k], h->inverse[level]) != at[k]) return false;
    return true;
}

/* Box i against the boxes of `set` stored at `level` in one cell. Where both are of the same set and level
 * the smaller number asks. */
static morph_status scan(morph_hash *h, const input *in, int i, int set, int level, const int64_t at[3]) {
    const morph_box *box = box_of(in, i);
    const uint32_t b = bucket_of(h, at[0], at[1], at[2], level, set);
    const bool twins = set == (i >= in->n[0]) && level == h->level[i];
    for (int e = h->start[b]; e < h->start[b + 1]; e++) {
        const int j = h->entry[e];
        if (h->level[j] != level || (j >= in->n[0]) != set || (twins && j <= i)) continue;
        const morph_box *other = box_of(in, j);
        if (!morph_box_overlap(box, other) || !meets_here(h, box, other, level, at)) continue;
        const morph_status status = add_pair(h, i, j);
        if (status != MORPH_OK) return status;
    }
    return MORPH_OK;
}

/* Of two boxes the one in the finer grid asks: it covers 8 cells at most in every coarser one. */
static morph_status ask(morph_hash *h, const input *in, int i, int set, int from) {
    const morph_box *box = box_of(in, i);
    for (int level = from; level < LEVELS; level++) {
        if (!h->used[set][level]) continue;
        cells c;
        cells_at(h, box, level, &c);
        int64_t at[3];
        for (at[0] = c.lo[0]; at[0] <= c.hi[0]; at[0]++)
            for (at[1] = c.lo[1]; at[1] <= c.hi[1]; at[1]++)
                for (at[2] = c.lo[2]; at[2] <= c.hi[2]; at[2]++) {
                    const morph_status status = scan(h, in, i, set, level, at);
                    if (status != MORPH_OK) return status;
                }
    }
    return MORPH_OK;
}

static morph_status run(morph_hash *h, const input *in) {
    double largest;
    h->pairs = 0;
    if (in->n[0] < 0 || in->n[1] < 0) return MORPH_ERR_INPUT;
    if (in->n[0] > MOST_BOXES || in->n[1] > MOST_BOXES - in->n[0]) return MORPH_ERR_NOMEM;
    morph_status status = validate(in, &largest);
    if (status != MORPH_OK) return status;
    const int all = in->n[0] + in->n[1];
    if (!grow((void **)&h->level, &h->level_room, (size_t)all, sizeof *h->level, false))
        return MORPH_ERR_NOMEM;
    set_cells(h, in, largest);
    set_levels(h, in);
    return fill(h, in);
}

morph_status morph_hash_self(morph_hash *h, int n, const morph_box *box, const int (**pair)[2], int *pairs) {
    const input in = {{box, NULL}, {n, 0}};
    *pair = NULL;
    *pairs = 0;
    morph_status status = run(h, &in);
    for (int i = 0; i < n && status == MORPH_OK; i++)
        status = ask(h, &in, i, 0, h->level[i]);
    if (status != MORPH_OK) return status;
    *pair = (const int(*)[2])h->pair;
    *pairs = h->pairs;
    return MORPH_OK;
}

/* Pairs of equal levels are asked for by the first set, the others by the finer box. */
morph_status morph_hash_between(morph_hash *h, int n, const morph_box *a, int m, const morph_box *b,
                                const int (**pair)[2], int *pairs) {
    const input in = {{a, b}, {n, m}};
    *pair = NULL;
    *pairs = 0;
    morph_status status = run(h, &in);
    for (int i = 0; i < n && status == MORPH_OK; i++)
        status = ask(h, &in, i, 1, h->level[i]);
    for (int j = n; j < n + m && status == MORPH_OK; j++)
        status = ask(h, &in, j, 0, h->level[j] + 1);
    if (status != MORPH_OK) return status;
    for (int k = 0; k < h->pairs; k++)
        h->pair[k][1] -= n;
    *pair = (const int(*)[2])h->pair;
    *pairs = h->pairs;
    return MORPH_OK;
}
