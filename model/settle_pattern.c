/* The pattern of settle's Hessian, in blocks of 3 x 3 per pair of joints. */
#include "model/settle_internal.h"

#include <stdlib.h>
#include <string.h>

typedef struct pair_list {
    long *key; /* column * joints + row, row >= column */
    size_t count;
    long joints;
} pair_list;

static void add_pairs(pair_list *p, const int *joint, int n) {
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (joint[i] >= joint[j]) p->key[p->count++] = joint[j] * p->joints + joint[i];
}

static int compare(const void *a, const void *b) {
    const long x = *(const long *)a, y = *(const long *)b;
    return (x > y) - (x < y);
}

/* All pairs of joints that an element joins, sorted, each once. An element of n joints gives at most
 * n (n + 1) / 2. */
static morph_status list_pairs(const morph_settle *s, pair_list *p) {
    const morph_structure *st = s->structure;
    const size_t most = (size_t)s->joints + 3 * (size_t)(st->links + st->posts) + 10 * (size_t)s->angles +
                        6 * (size_t)st->skin_triangles;
    *p = (pair_list){.key = morph_alloc(most, sizeof(long)), .joints = s->joints};
    if (!p->key) return MORPH_ERR_NOMEM;
    for (int j = 0; j < s->joints; j++)
        add_pairs(p, &j, 1);
    for (int l = 0; l < st->links; l++)
        add_pairs(p, st->link[l], 2);
    for (int k = 0; k < st->posts; k++)
        add_pairs(p, st->post[k], 2);
    for (int t = 0; t < s->angles; t++)
        add_pairs(p, s->angle[t].joint, s->angle[t].joints);
    for (int t = 0; t < st->skin_triangles; t++)
        add_pairs(p, st->skin[t], 3);
    qsort(p->key, p->count, sizeof(long), compare);
    size_t n = 0;
    for (size_t k = 0; k < p->count; k++)
        if (k == 0 || p->key[k] != p->key[k - 1]) p->key[n++] = p->key[k];
    p->count = n;
    return MORPH_OK;
}

/* Block column j begins with its diagonal block, of which scalar column c keeps rows c to 2; then come the
 * blocks below, 3 rows each. */
static void fill(morph_settle *s, const pair_list *p) {
    int at = 0;
    size_t k = 0;
    for (int j = 0; j < s->joints; j++) {
        size_t end = k;
        while (end < p->count && p->key[end] / p->joints == j)
            end++;
        for (int c = 0; c < 3; c++) {
            s->start[3 * j + c] = at;
            for (size_t m = k; m < end; m++)
                for (int r = m == k ? c : 0; r < 3; r++)
                    s->row[at++] = 3 * (int)(p->key[m] % p->joints) + r;
        }
        k = end;
    }
    s->start[3 * s->joints] = at;
}

morph_status morph_settle_pattern_create(morph_settle *s) {
    pair_list p;
    morph_status status = list_pairs(s, &p);
    if (status != MORPH_OK) return status;
    const size_t n = 3 * (size_t)s->joints, nonzeros = 9 * p.count - 3 * (size_t)s->joints;
    s->start = morph_alloc(n + 1, sizeof(int));
    s->row = morph_alloc(nonzeros, sizeof(int));
    s->value = morph_alloc(nonzeros, sizeof(double));
    s->spare = morph_alloc(nonzeros, sizeof(double));
    if (s->start && s->row && s->value && s->spare)
        fill(s, &p);
    else
        status = MORPH_ERR_NOMEM;
    free(p.key);
    if (status == MORPH_OK) status = morph_sparse_create((int)n, s->start, s->row, &s->sparse);
    return status;
}

/* Offset of block (i, j), i > j, in the scalar columns of j beyond their diagonal parts. */
static int block_offset(const morph_settle *s, int i, int j) {
    const int *row = &s->row[s->start[3 * j] + 3];
    int lo = 0, hi = (s->start[3 * j + 1] - s->start[3 * j]) / 3 - 2;
    while (lo < hi) {
        const int mid = (lo + hi) / 2;
        if (row[3 * mid] < 3 * i)
            lo = mid + 1;
        else
            hi = mid;
    }
    return 3 * lo;
}

void morph_settle_add(morph_settle *s, int i, int j, const double b[3][3]) {
    if (s->fixed[i] || s->fixed[j]) return;
    if (i == j) {
        for (int c = 0; c < 3; c++)
            for (int r = c; r < 3; r++)
                s->value[s->start[3 * j + c] + r - c] += b[r][c];
        return;
    }
    const bool below = i > j;
    const int high = below ? i : j, low = below ? j : i, offset = block_offset(s, high, low);
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            s->value[s->start[3 * low + c] + 3 - c + offset + r] += below ? b[r][c] : b[c][r];
}

void morph_settle_hold_fixed(morph_settle *s) {
    for (int j = 0; j < s->joints; j++)
        for (int c = 0; c < 3 && s->fixed[j]; c++)
            s->value[s->start[3 * j + c]] = 1.0;
}
