/* Assembling blocks into one problem: validation, numbering, patterns. */
#include "solvers/nlp_internal.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where create writes its complaint. */
typedef struct complaint {
    char *text;
    size_t size;
} complaint;

static morph_status refuse(const complaint *c, const char *format, ...) {
    if (c->text && c->size > 0) {
        va_list args;
        va_start(args, format);
        vsnprintf(c->text, c->size, format, args);
        va_end(args);
    }
    return MORPH_ERR_INPUT;
}

morph_nlp_size morph_nlp_sizes(const morph_nlp *nlp) {
    return (morph_nlp_size){nlp->unknowns, nlp->rows, nlp->jacobian.count, nlp->hessian.count};
}

int morph_nlp_first_row(const morph_nlp *nlp, int block) {
    return block < 0 || block >= nlp->block_count ? -1 : nlp->blocks[block].first_row;
}

static void name_row(const morph_block *b, int row, char *text, size_t size) {
    char about[128] = "";
    if (b->describe) b->describe(b->data, row, about, sizeof about);
    if (about[0])
        snprintf(text, size, "%s: %s", b->name, about);
    else
        snprintf(text, size, "%s: row %d", b->name, row);
}

void morph_nlp_row_name(const morph_nlp *nlp, int row, char *text, size_t size) {
    if (size == 0) return;
    for (int k = 0; k < nlp->block_count; k++) {
        const morph_nlp_block *b = &nlp->blocks[k];
        if (b->first_row < 0 || row < b->first_row || row >= b->first_row + b->def.rows) continue;
        name_row(&b->def, row - b->first_row, text, size);
        return;
    }
    snprintf(text, size, row < 0 ? "a bound" : "no such row");
}

/* A lower bound of +infinity or an upper of -infinity leaves nothing, like lower > upper. */
static bool usable_bounds(double lower, double upper) {
    return !isnan(lower) && !isnan(upper) && lower <= upper && lower < INFINITY && upper > -INFINITY;
}

static morph_status check_unknowns(int unknowns, const double *x0, const double *lower, const double *upper,
                                   const complaint *c) {
    if (unknowns < 1 || !x0) return refuse(c, "a problem needs at least one unknown and a start point");
    for (int i = 0; i < unknowns; i++) {
        const double l = lower ? lower[i] : -INFINITY, u = upper ? upper[i] : INFINITY;
        if (!isfinite(x0[i])) return refuse(c, "unknown %d: the start value %g is not finite", i, x0[i]);
        if (!usable_bounds(l, u)) return refuse(c, "unknown %d: bounds [%g, %g] allow no value", i, l, u);
    }
    return MORPH_OK;
}

static morph_status check_block(const morph_block *b, int index, int unknowns, const complaint *c) {
    if (!b->name || !b->value || !b->walk)
        return refuse(c, "block %d: name, value and walk must be given", index);
    if (b->rows < 0 || b->unknowns < 0 || (b->rows > 0 && (!b->lower || !b->upper)))
        return refuse(c, "%s: %d rows, %d unknowns or missing row bounds", b->name, b->rows, b->unknowns);
    if (!b->unknown && b->unknowns > unknowns)
        return refuse(c, "%s: %d unknowns of %d", b->name, b->unknowns, unknowns);
    for (int i = 0; b->unknown && i < b->unknowns; i++)
        if (b->unknown[i] < 0 || b->unknown[i] >= unknowns)
            return refuse(c, "%s: local unknown %d is global %d, allowed is 0 to %d", b->name, i,
                          b->unknown[i], unknowns - 1);
    for (int r = 0; r < b->rows; r++) {
        if (usable_bounds(b->lower[r], b->upper[r])) continue;
        char row[192];
        name_row(b, r, row, sizeof row);
        return refuse(c, "%s: bounds [%g, %g] allow no value", row, b->lower[r], b->upper[r]);
    }
    return MORPH_OK;
}

static void *copy_of(const void *from, size_t n, size_t size) {
    void *to = morph_alloc(n, size);
    if (to && n > 0) memcpy(to, from, n * size);
    return to;
}

/* Copies the tables and numbers the rows. */
static morph_status adopt_blocks(morph_nlp *nlp, const morph_block *blocks, int count, const complaint *c) {
    nlp->blocks = morph_alloc((size_t)count, sizeof *nlp->blocks);
    if (!nlp->blocks) return MORPH_ERR_NOMEM;
    nlp->block_count = count;
    for (int k = 0; k < count; k++) {
        const morph_status status = check_block(&blocks[k], k, nlp->unknowns, c);
        if (status != MORPH_OK) return status;
        morph_nlp_block *b = &nlp->blocks[k];
        b->def = blocks[k];
        snprintf(b->name, sizeof b->name, "%s", blocks[k].name);
        b->def.name = b->name;
        b->def.lower = b->def.upper = NULL;
        if (blocks[k].unknown) {
            b->unknown = copy_of(blocks[k].unknown, (size_t)blocks[k].unknowns, sizeof *b->unknown);
            if (!b->unknown) return MORPH_ERR_NOMEM;
        }
        b->def.unknown = b->unknown;
        b->first_row = blocks[k].rows > 0 ? nlp->rows : -1;
        if (blocks[k].rows > INT_MAX - nlp->rows) return refuse(c, "%s: too many rows", blocks[k].name);
        nlp->rows += blocks[k].rows;
    }
    return MORPH_OK;
}

static morph_status allocate(morph_nlp *nlp, const double *xlower, const double *xupper,
                             const morph_block *blocks) {
    const size_t n = (size_t)nlp->unknowns, m = (size_t)nlp->rows, size = sizeof(double);
    size_t local = 1;
    for (int k = 0; k < nlp->block_count; k++)
        if ((size_t)blocks[k].unknowns > local) local = (size_t)blocks[k].unknowns;
    nlp->lower = morph_alloc(n, size);
    nlp->upper = morph_alloc(n, size);
    nlp->row_lower = morph_alloc(m, size);
    nlp->row_upper = morph_alloc(m, size);
    nlp->local = morph_alloc(local, size);
    nlp->ones = morph_alloc(m + 1, size);
    nlp->x = morph_alloc(n, size);
    nlp->row_value = morph_alloc(m, size);
    nlp->gradient = morph_alloc(n, size);
    if (!nlp->lower || !nlp->upper || !nlp->row_lower || !nlp->row_upper || !nlp->local || !nlp->ones ||
        !nlp->x || !nlp->row_value || !nlp->gradient)
        return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < n; i++) {
        nlp->lower[i] = xlower ? xlower[i] : -INFINITY;
        nlp->upper[i] = xupper ? xupper[i] : INFINITY;
    }
    for (size_t r = 0; r <= m; r++)
        nlp->ones[r] = 1.0;
    for (int k = 0; k < nlp->block_count; k++) {
        const int first = nlp->blocks[k].first_row;
        if (first < 0) continue;
        memcpy(nlp->row_lower + first, blocks[k].lower, (size_t)blocks[k].rows * size);
        memcpy(nlp->row_upper + first, blocks[k].upper, (size_t)blocks[k].rows * size);
    }
    return MORPH_OK;
}

/* Global positions of all entries of one kind, in the order of the walks. */
typedef struct positions {
    int *row, *column;
    size_t count, capacity;
} positions;

static bool append(positions *p, int row, int column) {
    if (p->count == p->capacity) {
        const size_t capacity = p->capacity > 0 ? 2 * p->capacity : 1024;
        int *rows = realloc(p->row, capacity * sizeof *rows);
        if (rows) p->row = rows;
        int *columns = realloc(p->column, capacity * sizeof *columns);
        if (columns) p->column = columns;
        if (!rows || !columns) return false;
        p->capacity = capacity;
    }
    p->row[p->count] = row;
    p->column[p->count++] = column;
    return true;
}

static int global(const morph_nlp_block *b, int local) {
    return b->unknown ? b->unknown[local] : local;
}

/* Keeps a block's recorded walk and appends the global positions of its entries. */
static morph_status keep_walk(morph_nlp_block *b, const morph_record *jacobian, const morph_record *hessian,
                              positions *jp, positions *hp) {
    if (jacobian->count > INT_MAX || hessian->count > INT_MAX) return MORPH_ERR_NOMEM;
    b->jacobian = morph_alloc(jacobian->count, sizeof *b->jacobian);
    b->hessian = morph_alloc(hessian->count, sizeof *b->hessian);
    if (!b->jacobian || !b->hessian) return MORPH_ERR_NOMEM;
    b->jacobian_count = (int)jacobian->count;
    b->hessian_count = (int)hessian->count;
    for (size_t k = 0; k < jacobian->count; k++) {
        const morph_record_entry *e = &jacobian->entries[k];
        /* An objective's derivatives go straight to the dense gradient. */
        b->jacobian[k] = (morph_entry){e->row, e->unknown, global(b, e->unknown)};
        if (b->first_row >= 0 && !append(jp, b->first_row + e->row, global(b, e->unknown)))
            return MORPH_ERR_NOMEM;
    }
    for (size_t k = 0; k < hessian->count; k++) {
        const morph_record_entry *e = &hessian->entries[k];
        const int i = global(b, e->row), j = global(b, e->unknown);
        b->hessian[k] = (morph_entry){e->row, e->unknown, 0};
        if (!append(hp, i > j ? i : j, i > j ? j : i)) return MORPH_ERR_NOMEM;
    }
    return MORPH_OK;
}

static morph_status name_bad_walk(morph_status status, const morph_block *b, const morph_sink *sink,
                                  const complaint *c) {
    if (sink->status == MORPH_ERR_INPUT)
        return refuse(c, "%s: derivative entry (%d, %d) is outside %d rows and %d unknowns", b->name,
                      sink->bad_row, sink->bad_unknown, sink->rows, b->unknowns);
    refuse(c, "%s: %s at the start point", b->name, morph_status_text(status));
    return status;
}

/* Walks every block once at x0 and checks that what it says is finite. */
static morph_status record_walks(morph_nlp *nlp, const double *x0, positions *jp, positions *hp,
                                 const complaint *c) {
    morph_record jacobian = {0}, hessian = {0};
    morph_status status = MORPH_OK;
    for (int k = 0; k < nlp->block_count && status == MORPH_OK; k++) {
        morph_nlp_block *b = &nlp->blocks[k];
        const double *x = x0;
        if (b->unknown) {
            for (int i = 0; i < b->def.unknowns; i++)
                nlp->local[i] = x0[b->unknown[i]];
            x = nlp->local;
        }
        morph_sink sink;
        status = morph_block_record(&b->def, x, nlp->ones, &jacobian, &hessian, &sink);
        if (status != MORPH_OK) {
            status = name_bad_walk(status, &b->def, &sink, c);
            break;
        }
        for (size_t e = 0; e < jacobian.count + hessian.count && status == MORPH_OK; e++) {
            const morph_record_entry *v =
                e < jacobian.count ? &jacobian.entries[e] : &hessian.entries[e - jacobian.count];
            if (!isfinite(v->value))
                status = refuse(c, "%s: derivative entry (%d, %d) is %g at the start point", b->name, v->row,
                                v->unknown, v->value);
        }
        if (status == MORPH_OK) status = keep_walk(b, &jacobian, &hessian, jp, hp);
    }
    free(jacobian.entries);
    free(hessian.entries);
    return status;
}

/* Turns merged slots into the blocks' entry -> slot maps. */
static void hand_out_slots(morph_nlp *nlp, const int *jacobian_slot, const int *hessian_slot) {
    size_t j = 0, h = 0;
    for (int k = 0; k < nlp->block_count; k++) {
        morph_nlp_block *b = &nlp->blocks[k];
        for (int e = 0; b->first_row >= 0 && e < b->jacobian_count; e++)
            b->jacobian[e].slot = jacobian_slot[j++];
        for (int e = 0; e < b->hessian_count; e++) {
            const int slot = hessian_slot[h++];
            const morph_entry *v = &b->hessian[e];
            const bool twice = v->row != v->unknown && global(b, v->row) == global(b, v->unknown);
            b->hessian[e].slot = twice ? ~slot : slot;
        }
    }
}

static morph_status record_patterns(morph_nlp *nlp, const double *x0, const complaint *c) {
    positions jp = {0}, hp = {0};
    int *jacobian_slot = NULL, *hessian_slot = NULL;
    morph_status status = record_walks(nlp, x0, &jp, &hp, c);
    if (status != MORPH_OK) goto done;
    status = MORPH_ERR_NOMEM;
    jacobian_slot = morph_alloc(jp.count, sizeof *jacobian_slot);
    hessian_slot = morph_alloc(hp.count, sizeof *hessian_slot);
    if (!jacobian_slot || !hessian_slot) goto done;
    status = morph_pattern_merge(jp.count, jp.row, jp.column, nlp->rows, nlp->unknowns, jacobian_slot,
                                 &nlp->jacobian);
    if (status == MORPH_OK)
        status = morph_pattern_merge(hp.count, hp.row, hp.column, nlp->unknowns, nlp->unknowns, hessian_slot,
                                     &nlp->hessian);
    if (status != MORPH_OK) goto done;
    hand_out_slots(nlp, jacobian_slot, hessian_slot);
    nlp->jacobian_value = morph_alloc((size_t)nlp->jacobian.count, sizeof(double));
    nlp->hessian_value = morph_alloc((size_t)nlp->hessian.count, sizeof(double));
    if (!nlp->jacobian_value || !nlp->hessian_value) status = MORPH_ERR_NOMEM;
done:
    free(jp.row);
    free(jp.column);
    free(hp.row);
    free(hp.column);
    free(jacobian_slot);
    free(hessian_slot);
    return status;
}

/* The objective and every row must be numbers at the start point. */
static morph_status check_first_values(morph_nlp *nlp, const double *x0, const complaint *c) {
    morph_status status = morph_nlp_objective_at(nlp, x0);
    if (status == MORPH_ERR_NONFINITE) return refuse(c, "the objective is not finite at the start point");
    if (status == MORPH_OK) status = morph_nlp_rows_at(nlp, x0);
    if (status == MORPH_ERR_NONFINITE) {
        for (int r = 0; r < nlp->rows; r++) {
            if (isfinite(nlp->row_value[r])) continue;
            char row[192];
            morph_nlp_row_name(nlp, r, row, sizeof row);
            return refuse(c, "%s: the value is %g at the start point", row, nlp->row_value[r]);
        }
        return refuse(c, "a row is not finite at the start point");
    }
    nlp->points = 0;
    return status;
}

morph_status morph_nlp_create(int unknowns, const double *x0, const double *xlower, const double *xupper,
                              const morph_block *blocks, int block_count, char *message, size_t message_size,
                              morph_nlp **out) {
    const complaint c = {message, message_size};
    *out = NULL;
    if (message && message_size > 0) message[0] = '\0';
    morph_status status = check_unknowns(unknowns, x0, xlower, xupper, &c);
    if (status != MORPH_OK) return status;
    if (block_count < 0 || (block_count > 0 && !blocks)) return refuse(&c, "no blocks");
    morph_nlp *nlp = morph_alloc(1, sizeof *nlp);
    if (!nlp) return MORPH_ERR_NOMEM;
    nlp->unknowns = unknowns;
    status = adopt_blocks(nlp, blocks, block_count, &c);
    if (status == MORPH_OK) status = allocate(nlp, xlower, xupper, blocks);
    if (status == MORPH_OK) status = record_patterns(nlp, x0, &c);
    if (status == MORPH_OK) status = check_first_values(nlp, x0, &c);
    if (status != MORPH_OK) {
        morph_nlp_destroy(nlp);
        return status;
    }
    *out = nlp;
    return MORPH_OK;
}

void morph_nlp_destroy(morph_nlp *nlp) {
    if (!nlp) return;
    for (int k = 0; nlp->blocks && k < nlp->block_count; k++) {
        free(nlp->blocks[k].unknown);
        free(nlp->blocks[k].jacobian);
        free(nlp->blocks[k].hessian);
    }
    free(nlp->blocks);
    free(nlp->lower);
    free(nlp->upper);
    free(nlp->row_lower);
    free(nlp->row_upper);
    free(nlp->jacobian.row);
    free(nlp->jacobian.column);
    free(nlp->hessian.row);
    free(nlp->hessian.column);
    free(nlp->local);
    free(nlp->ones);
    free(nlp->x);
    free(nlp->row_value);
    free(nlp->gradient);
    free(nlp->jacobian_value);
    free(nlp->hessian_value);
    free(nlp);
}
