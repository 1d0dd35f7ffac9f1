/* Derivative checker: central differences against every entry of every block.
 *
 * Jacobian:  d f_r / d x_j  ~  (f_r(x + h e_j) - f_r(x - h e_j)) / 2h, all rows of one unknown at a time.
 * Hessian:   with g_i(x) = sum_r w_r J_ri(x),  sum_r w_r d2 f_r / dx_i dx_j  ~  (g_i(x + h e_j) - g_i(x - h
 * e_j)) / 2h. Entries that a block does not emit count as zero, so a wrong index fails twice over. */
#include "solvers/nlp_internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct checker {
    const morph_block *block;
    int rows; /* 1 for an objective */
    double step, tolerance;
    morph_derivative_check *out;
    double *x, *weight;             /* local unknowns; rows */
    double *plus, *minus;           /* max(rows, unknowns): values or weighted gradients at x +- h e_j */
    double *analytic, *row_scale;   /* max(rows, unknowns): one dense column; largest entry per row */
    morph_record jacobian, hessian; /* at x, with weight */
    morph_record moved[2], only;    /* Jacobians at x + h e_j and x - h e_j; scratch */
} checker;

static void fail(checker *c, const char *format, ...) {
    if (!c->out->passed) return;
    c->out->passed = false;
    va_list args;
    va_start(args, format);
    vsnprintf(c->out->message, sizeof c->out->message, format, args);
    va_end(args);
}

static int global(const morph_block *b, int local) {
    return b->unknown ? b->unknown[local] : local;
}

/* " (link 17 ...)" or nothing. */
static void about_row(const morph_block *b, int row, char text[144]) {
    char about[128] = "";
    if (b->describe && b->rows > 0) b->describe(b->data, row, about, sizeof about);
    snprintf(text, 144, about[0] ? " (%s)" : "%s", about);
}

/* A walk that asks for one kind only must say exactly what the full walk said. */
static bool same(const morph_record *a, const morph_record *b, bool values) {
    if (a->count != b->count) return false;
    for (size_t k = 0; k < a->count; k++) {
        const morph_record_entry *p = &a->entries[k], *q = &b->entries[k];
        if (p->row != q->row || p->unknown != q->unknown || (values && p->value != q->value)) return false;
    }
    return true;
}

/* Jacobian-only or Hessian-only walk at c->x into record. */
static morph_status walk_only(checker *c, bool jacobian, const double *weight, morph_record *record) {
    morph_sink sink = {.wants_jacobian = jacobian,
                       .wants_hessian = !jacobian,
                       .rows = c->rows,
                       .unknowns = c->block->unknowns,
                       .jacobian_record = record,
                       .hessian_record = record};
    record->count = 0;
    const morph_status status = c->block->walk(c->block->data, c->x, weight, &sink);
    return sink.status != MORPH_OK ? sink.status : status;
}

/* Moves unknown j by +-h and gives the true distance of the two points. */
static double move(checker *c, int j, double x, double sign, double other) {
    const double h = c->step * fmax(1.0, fabs(x));
    c->x[j] = x + sign * h;
    return fabs(c->x[j] - other);
}

/* Books one comparison; true if it is within the tolerance. NaN is not. */
static bool agrees(const checker *c, double analytic, double numeric, double scale, double *worst) {
    const double error = fabs(analytic - numeric) / fmax(1.0, fmax(fabs(analytic), scale));
    if (!(error <= *worst)) *worst = error;
    return error <= c->tolerance;
}

static void scatter(double *dense, int n, const morph_entry *entries, int count, const double *value) {
    memset(dense, 0, (size_t)n * sizeof *dense);
    for (int k = 0; k < count; k++)
        dense[entries[k].row] += value[entries[k].slot];
}

/* Column lists of a record: entries of column j are list[start[j]] .. list[start[j + 1] - 1], row and slot
 * (the entry's number) filled. symmetric: (i, j) with i != j also stands for (j, i). */
typedef struct columns {
    morph_entry *list;
    int *start;
    double *value;
} columns;

static void columns_free(columns *c) {
    free(c->list);
    free(c->start);
    free(c->value);
    *c = (columns){0};
}

static morph_status columns_of(const morph_record *r, int unknowns, bool symmetric, columns *out) {
    const size_t copies = symmetric ? 2 : 1;
    *out = (columns){morph_alloc(copies * r->count, sizeof *out->list),
                     morph_alloc((size_t)unknowns + 2, sizeof *out->start),
                     morph_alloc(r->count, sizeof *out->value)};
    if (!out->list || !out->start || !out->value) {
        columns_free(out);
        return MORPH_ERR_NOMEM;
    }
    int *next = out->start + 1; /* becomes start after filling */
    for (size_t k = 0; k < r->count; k++) {
        const morph_record_entry *e = &r->entries[k];
        out->value[k] = e->value;
        next[e->unknown + 1]++;
        if (symmetric && e->row != e->unknown) next[e->row + 1]++;
    }
    for (int j = 0; j < unknowns; j++)
        next[j + 1] += next[j];
    for (size_t k = 0; k < r->count; k++) {
        const morph_record_entry *e = &r->entries[k];
        out->list[next[e->unknown]++] = (morph_entry){e->row, e->unknown, (int)k};
        if (symmetric && e->row != e->unknown)
            out->list[next[e->row]++] = (morph_entry){e->unknown, e->row, (int)k};
    }
    return MORPH_OK;
}

/* Largest magnitude in each row. */
static void scale_rows(checker *c, const morph_record *r, bool symmetric, int rows) {
    memset(c->row_scale, 0, (size_t)rows * sizeof *c->row_scale);
    for (size_t k = 0; k < r->count; k++) {
        const morph_record_entry *e = &r->entries[k];
        c->row_scale[e->row] = fmax(c->row_scale[e->row], fabs(e->value));
        if (symmetric) c->row_scale[e->unknown] = fmax(c->row_scale[e->unknown], fabs(e->value));
    }
}

static morph_status check_jacobian(checker *c) {
    const morph_block *b = c->block;
    columns cols;
    morph_status status = columns_of(&c->jacobian, b->unknowns, false, &cols);
    if (status != MORPH_OK) return status;
    scale_rows(c, &c->jacobian, false, c->rows);
    for (int j = 0; j < b->unknowns && status == MORPH_OK; j++) {
        const double x = c->x[j];
        move(c, j, x, 1, x);
        const double forward = c->x[j];
        status = b->value(b->data, c->x, c->plus);
        const double distance = move(c, j, x, -1, forward);
        if (status == MORPH_OK) status = b->value(b->data, c->x, c->minus);
        c->x[j] = x;
        if (status != MORPH_OK) break;
        scatter(c->analytic, c->rows, cols.list + cols.start[j], cols.start[j + 1] - cols.start[j],
                cols.value);
        for (int r = 0; r < c->rows; r++) {
            const double numeric = (c->plus[r] - c->minus[r]) / distance;
            if (agrees(c, c->analytic[r], numeric, c->row_scale[r], &c->out->worst_jacobian)) continue;
            char about[144];
            about_row(b, r, about);
            fail(c, "%s: row %d%s, unknown %d: analytic %.9g, numeric %.9g", b->name, r, about, global(b, j),
                 c->analytic[r], numeric);
        }
    }
    columns_free(&cols);
    return status;
}

/* g_i = sum over rows of weight_r J_ri from a recorded Jacobian. */
static void weighted_gradient(const checker *c, const morph_record *r, double *g) {
    memset(g, 0, (size_t)c->block->unknowns * sizeof *g);
    for (size_t k = 0; k < r->count; k++)
        g[r->entries[k].unknown] += c->weight[r->entries[k].row] * r->entries[k].value;
}

static double entry_sum(const morph_record *r, int row, int unknown) {
    double sum = 0;
    for (size_t k = 0; k < r->count; k++)
        if (r->entries[k].row == row && r->entries[k].unknown == unknown) sum += r->entries[k].value;
    return sum;
}

/* A wrong Hessian entry (i, j) was found in the weighted sum: asks row by row, with a weight of 1 on that row
 * alone, which one it comes from, and names the worst. The Jacobians at x +- h e_j are in moved. */
static morph_status blame_hessian(checker *c, int i, int j, double distance) {
    const morph_block *b = c->block;
    double worst = -1, worst_analytic = 0, worst_numeric = 0;
    int row = 0;
    for (int r = 0; r < c->rows; r++) {
        memset(c->analytic, 0, (size_t)c->rows * sizeof *c->analytic);
        c->analytic[r] = 1;
        const morph_status status = walk_only(c, false, c->analytic, &c->only);
        if (status != MORPH_OK) return status;
        const double analytic = entry_sum(&c->only, i, j) + (i != j ? entry_sum(&c->only, j, i) : 0);
        const double numeric = (entry_sum(&c->moved[0], r, i) - entry_sum(&c->moved[1], r, i)) / distance;
        const double error = fabs(analytic - numeric);
        if (error <= worst) continue;
        worst = error;
        worst_analytic = analytic;
        worst_numeric = numeric;
        row = r;
        if (isnan(error)) break;
    }
    char about[144];
    about_row(b, row, about);
    fail(c, "%s: row %d%s, Hessian of unknowns %d and %d: analytic %.9g, numeric %.9g", b->name, row, about,
         global(b, i), global(b, j), worst_analytic, worst_numeric);
    return MORPH_OK;
}

static morph_status moved_gradient(checker *c, morph_record *record, double *g) {
    const morph_status status = walk_only(c, true, c->weight, record);
    if (status != MORPH_OK) return status;
    if (!same(record, &c->jacobian, false))
        fail(c, "%s: a walk for first derivatives emits other entries at another point", c->block->name);
    weighted_gradient(c, record, g);
    return MORPH_OK;
}

static morph_status check_hessian(checker *c) {
    const morph_block *b = c->block;
    columns cols;
    morph_status status = columns_of(&c->hessian, b->unknowns, true, &cols);
    if (status != MORPH_OK) return status;
    scale_rows(c, &c->hessian, true, b->unknowns);
    for (int j = 0; j < b->unknowns && status == MORPH_OK && c->out->passed; j++) {
        const double x = c->x[j];
        move(c, j, x, 1, x);
        const double forward = c->x[j];
        status = moved_gradient(c, &c->moved[0], c->plus);
        const double distance = move(c, j, x, -1, forward);
        if (status == MORPH_OK) status = moved_gradient(c, &c->moved[1], c->minus);
        c->x[j] = x;
        if (status != MORPH_OK) break;
        scatter(c->analytic, b->unknowns, cols.list + cols.start[j], cols.start[j + 1] - cols.start[j],
                cols.value);
        for (int i = 0; i < b->unknowns && status == MORPH_OK; i++) {
            const double numeric = (c->plus[i] - c->minus[i]) / distance;
            if (agrees(c, c->analytic[i], numeric, c->row_scale[i], &c->out->worst_hessian)) continue;
            status = blame_hessian(c, i, j, distance);
            break;
        }
    }
    columns_free(&cols);
    return status;
}

/* Walks for one kind only must agree with the full walk at the same point. */
static morph_status check_partial_walks(checker *c) {
    morph_status status = walk_only(c, true, c->weight, &c->only);
    if (status != MORPH_OK) return status;
    if (!same(&c->only, &c->jacobian, true))
        fail(c, "%s: a walk for first derivatives alone emits other entries", c->block->name);
    status = walk_only(c, false, c->weight, &c->only);
    if (status != MORPH_OK) return status;
    if (!same(&c->only, &c->hessian, true))
        fail(c, "%s: a walk for the Hessian alone emits other entries", c->block->name);
    return MORPH_OK;
}

static morph_status check_block(checker *c, const double *x) {
    const morph_block *b = c->block;
    for (int i = 0; i < b->unknowns; i++)
        c->x[i] = x[global(b, i)];
    /* Weights of both signs and different sizes, so that rows cannot stand in for each other. */
    unsigned state = 12345;
    for (int r = 0; r < c->rows; r++) {
        state = 1664525u * state + 1013904223u;
        c->weight[r] = (0.5 + (double)(state >> 8) / 16777216.0) * (r % 2 ? -1 : 1);
    }
    morph_sink sink;
    morph_status status = morph_block_record(b, c->x, c->weight, &c->jacobian, &c->hessian, &sink);
    if (sink.status == MORPH_ERR_INPUT) {
        fail(c, "%s: derivative entry (%d, %d) is outside %d rows and %d unknowns", b->name, sink.bad_row,
             sink.bad_unknown, c->rows, b->unknowns);
        return MORPH_OK;
    }
    if (status == MORPH_OK) status = check_partial_walks(c);
    if (status == MORPH_OK && c->out->passed) status = check_jacobian(c);
    if (status == MORPH_OK && c->out->passed) status = check_hessian(c);
    return status;
}

static morph_status run_block(checker *c, const double *x) {
    const size_t rows = (size_t)c->rows, unknowns = (size_t)c->block->unknowns;
    const size_t most = rows > unknowns ? rows : unknowns, size = sizeof(double);
    c->x = morph_alloc(unknowns, size);
    c->weight = morph_alloc(rows, size);
    c->plus = morph_alloc(most, size);
    c->minus = morph_alloc(most, size);
    c->analytic = morph_alloc(most, size);
    c->row_scale = morph_alloc(most, size);
    morph_status status = MORPH_ERR_NOMEM;
    if (c->x && c->weight && c->plus && c->minus && c->analytic && c->row_scale) status = check_block(c, x);
    free(c->x);
    free(c->weight);
    free(c->plus);
    free(c->minus);
    free(c->analytic);
    free(c->row_scale);
    free(c->jacobian.entries);
    free(c->hessian.entries);
    free(c->moved[0].entries);
    free(c->moved[1].entries);
    free(c->only.entries);
    return status;
}

morph_status morph_check_derivatives(const morph_block *blocks, int block_count, const double *x,
                                     int unknowns, double step, double tolerance,
                                     morph_derivative_check *out) {
    *out = (morph_derivative_check){.passed = true};
    if (!(step > 0) || !(tolerance > 0)) return MORPH_ERR_INPUT;
    for (int k = 0; k < block_count; k++) {
        const morph_block *b = &blocks[k];
        for (int i = 0; i < b->unknowns; i++)
            if (global(b, i) < 0 || global(b, i) >= unknowns) return MORPH_ERR_INPUT;
        checker c = {
            .block = b, .rows = b->rows > 0 ? b->rows : 1, .step = step, .tolerance = tolerance, .out = out};
        const morph_status status = run_block(&c, x);
        if (status != MORPH_OK) {
            fail(&c, "%s: %s", b->name, morph_status_text(status));
            return status;
        }
        if (!out->passed) return MORPH_OK;
    }
    return MORPH_OK;
}
