/* The sink: recording a walk, replaying it into merged values, and the merging itself. */
#include "solvers/nlp_internal.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>

bool morph_sink_wants_hessian(const morph_sink *s) {
    return s->wants_hessian;
}

bool morph_sink_wants_jacobian(const morph_sink *s) {
    return s->wants_jacobian;
}

static void record(morph_sink *s, morph_record *list, int row, int unknown, int rows, double value) {
    if (s->status != MORPH_OK) return;
    if (row < 0 || row >= rows || unknown < 0 || unknown >= s->unknowns) {
        s->status = MORPH_ERR_INPUT;
        s->bad_row = row;
        s->bad_unknown = unknown;
        return;
    }
    if (list->count == list->capacity) {
        const size_t capacity = list->capacity > 0 ? 2 * list->capacity : 256;
        morph_record_entry *grown = NULL;
        if (capacity <= SIZE_MAX / sizeof *grown) grown = realloc(list->entries, capacity * sizeof *grown);
        if (!grown) {
            s->status = MORPH_ERR_NOMEM;
            return;
        }
        list->entries = grown;
        list->capacity = capacity;
    }
    list->entries[list->count++] = (morph_record_entry){row, unknown, value};
}

void morph_sink_jacobian(morph_sink *s, int row, int unknown, double value) {
    if (!s->wants_jacobian) return;
    if (s->jacobian_record) {
        record(s, s->jacobian_record, row, unknown, s->rows, value);
        return;
    }
    if (s->jacobian_next >= s->jacobian_count) {
        s->mismatch = true;
        return;
    }
    const morph_entry *e = &s->jacobian[s->jacobian_next++];
    s->mismatch |= (e->row != row) | (e->unknown != unknown);
    s->jacobian_value[e->slot] += value;
}

void morph_sink_hessian(morph_sink *s, int i, int j, double value) {
    if (!s->wants_hessian) return;
    if (s->hessian_record) {
        record(s, s->hessian_record, i, j, s->unknowns, value);
        return;
    }
    if (s->hessian_next >= s->hessian_count) {
        s->mismatch = true;
        return;
    }
    const morph_entry *e = &s->hessian[s->hessian_next++];
    s->mismatch |= (e->row != i) | (e->unknown != j);
    if (e->slot >= 0)
        s->hessian_value[e->slot] += value;
    else
        s->hessian_value[~e->slot] += 2 * value;
}

morph_status morph_block_record(const morph_block *block, const double *x, const double *weight,
                                morph_record *jacobian, morph_record *hessian, morph_sink *sink) {
    *sink = (morph_sink){
        .wants_jacobian = true,
        .wants_hessian = true,
        .rows = block->rows > 0 ? block->rows : 1,
        .unknowns = block->unknowns,
        .jacobian_record = jacobian,
        .hessian_record = hessian,
    };
    jacobian->count = hessian->count = 0;
    const morph_status status = block->walk(block->data, x, weight, sink);
    return sink->status != MORPH_OK ? sink->status : status;
}

/* order[] of 0..count-1, stably sorted by key (0 <= key < keys); start is scratch of keys + 1. */
static void sort_by(size_t count, const int *from, int *order, const int *key, int keys, size_t *start) {
    for (int k = 0; k <= keys; k++)
        start[k] = 0;
    for (size_t i = 0; i < count; i++)
        start[key[i] + 1]++;
    for (int k = 0; k < keys; k++)
        start[k + 1] += start[k];
    for (size_t i = 0; i < count; i++) {
        const int e = from ? from[i] : (int)i;
        order[start[key[e]]++] = e;
    }
}

/* Two stable counting sorts, by column and then by row, put equal positions side by side in linear time; one
 * sweep then gives every run of equal positions one slot. */
morph_status morph_pattern_merge(size_t count, const int *row, const int *column, int rows, int columns,
                                 int *slot, morph_pattern *out) {
    *out = (morph_pattern){0};
    if (count > INT_MAX) return MORPH_ERR_NOMEM;
    const int keys = rows > columns ? rows : columns;
    int *by_column = morph_alloc(count, sizeof *by_column);
    int *order = morph_alloc(count, sizeof *order);
    size_t *start = morph_alloc((size_t)keys + 1, sizeof *start);
    morph_status status = MORPH_ERR_NOMEM;
    if (!by_column || !order || !start) goto done;
    sort_by(count, NULL, by_column, column, columns, start);
    sort_by(count, by_column, order, row, rows, start);

    int merged = 0;
    for (size_t i = 0; i < count; i++) {
        const int e = order[i];
        if (i == 0 || row[e] != row[order[i - 1]] || column[e] != column[order[i - 1]]) merged++;
        slot[e] = merged - 1;
    }
    out->row = morph_alloc((size_t)merged, sizeof *out->row);
    out->column = morph_alloc((size_t)merged, sizeof *out->column);
    if (!out->row || !out->column) goto done;
    out->count = merged;
    for (size_t i = 0; i < count; i++) {
        out->row[slot[i]] = row[i];
        out->column[slot[i]] = column[i];
    }
    status = MORPH_OK;
done:
    free(by_column);
    free(order);
    free(start);
    if (status != MORPH_OK) {
        free(out->row);
        free(out->column);
        *out = (morph_pattern){0};
    }
    return status;
}
