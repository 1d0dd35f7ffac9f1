/* Equalities of a pose solved together: rigid posts, plane panels, and those lengths that are prescribed or
 * lie beyond a limit. Sweeps converge slowly where equalities hang together; Newton's method does not. */
#include "model/blanket_internal.h"

#include "solvers/sparse.h"

#include <stdlib.h>
#include <string.h>

/* Added to the diagonal, in parts of a row's own entry: redundant rows (two links of a flat panel) make the
 * matrix singular, and where they agree this changes nothing that a second step does not mend. */
#define REGULAR 1e-10
/* Newton steps; quadratic from a pose that is nearly right. */
#define NEWTON_STEPS 8
/* A joint moves by no more in one of them, spacings: beyond, the rows' directions mean little. */
#define LONGEST_MOVE 0.2

typedef struct fix_row {
    int joint[4], joints;
    double grad[4][3];
    double residual; /* what the row has to lose, m */
    bool active;
} fix_row;

struct morph_blanket_fix {
    int rows, entries;
    fix_row *row;
    int *start, *index; /* lower triangle of J J', column by column */
    double *value, *right;
    morph_sparse *sparse;
};

static void set_joints(const morph_structure *s, int r, fix_row *row) {
    if (r < s->links + s->posts) {
        memcpy(row->joint, r < s->links ? s->link[r] : s->post[r - s->links], 2 * sizeof(int));
        row->joints = 2;
        return;
    }
    const int *panel = s->panel[r - s->links - s->posts];
    memcpy(row->joint, s->post[panel[0]], 2 * sizeof(int));
    memcpy(row->joint + 2, s->post[panel[1]], 2 * sizeof(int));
    row->joints = 4;
}

/* Rows at each joint, one list after the other: at[first[j]] .. at[first[j + 1] - 1], ascending. */
static morph_status list_rows(const morph_blanket_fix *f, int joints, int **first_out, int **at_out) {
    int *first = morph_alloc((size_t)joints + 2, sizeof(int)),
        *at = morph_alloc(4 * (size_t)f->rows, sizeof(int));
    *first_out = first;
    *at_out = at;
    if (!first || !at) return MORPH_ERR_NOMEM;
    for (int r = 0; r < f->rows; r++)
        for (int k = 0; k < f->row[r].joints; k++)
            first[f->row[r].joint[k] + 2]++;
    for (int j = 0; j < joints; j++)
        first[j + 2] += first[j + 1];
    for (int r = 0; r < f->rows; r++)
        for (int k = 0; k < f->row[r].joints; k++)
            at[first[f->row[r].joint[k] + 1]++] = r;
    return MORPH_OK;
}

static int compare(const void *a, const void *b) {
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

/* Column c holds the rows from c on that share a joint with it. */
static morph_status make_pattern(morph_blanket_fix *f, int joints) {
    int *first = NULL, *at = NULL;
    morph_status status = list_rows(f, joints, &first, &at);
    size_t room = 0;
    for (int r = 0; r < f->rows && status == MORPH_OK; r++)
        for (int k = 0; k < f->row[r].joints; k++)
            room += (size_t)(first[f->row[r].joint[k] + 1] - first[f->row[r].joint[k]]);
    f->start = morph_alloc((size_t)f->rows + 1, sizeof(int));
    f->index = morph_alloc(room + 1, sizeof(int));
    if (!f->start || !f->index) status = MORPH_ERR_NOMEM;
    for (int c = 0; c < f->rows && status == MORPH_OK; c++) {
        const int begin = f->start[c];
        int n = begin;
        for (int k = 0; k < f->row[c].joints; k++)
            for (int p = first[f->row[c].joint[k]]; p < first[f->row[c].joint[k] + 1]; p++)
                if (at[p] >= c) f->index[n++] = at[p];
        qsort(&f->index[begin], (size_t)(n - begin), sizeof(int), compare);
        int kept = begin;
        for (int p = begin; p < n; p++)
            if (p == begin || f->index[p] != f->index[p - 1]) f->index[kept++] = f->index[p];
        f->start[c + 1] = kept;
    }
    free(first);
    free(at);
    if (status != MORPH_OK) return status;
    f->entries = f->start[f->rows];
    f->value = morph_alloc((size_t)f->entries, sizeof(double));
    f->right = morph_alloc((size_t)f->rows, sizeof(double));
    return f->value && f->right ? MORPH_OK : MORPH_ERR_NOMEM;
}

morph_status morph_blanket_fix_create(const morph_structure *s, morph_blanket_fix **out) {
    *out = NULL;
    morph_blanket_fix *f = morph_alloc(1, sizeof *f);
    if (!f) return MORPH_ERR_NOMEM;
    f->rows = s->links + s->posts + s->panels;
    f->row = morph_alloc((size_t)f->rows, sizeof *f->row);
    morph_status status = f->row ? MORPH_OK : MORPH_ERR_NOMEM;
    for (int r = 0; r < f->rows && status == MORPH_OK; r++)
        set_joints(s, r, &f->row[r]);
    if (status == MORPH_OK) status = make_pattern(f, s->joints);
    if (status == MORPH_OK) status = morph_sparse_create(f->rows, f->start, f->index, &f->sparse);
    if (status != MORPH_OK) {
        morph_blanket_fix_destroy(f);
        return status;
    }
    *out = f;
    return MORPH_OK;
}

void morph_blanket_fix_destroy(morph_blanket_fix *f) {
    if (!f) return;
    morph_sparse_destroy(f->sparse);
    free(f->row);
    free(f->start);
    free(f->index);
    free(f->value);
    free(f->right);
    free(f);
}

/* |x_j - x_i| = length. */
static void length_row(const double *x, double length, fix_row *row) {
    double d[3];
    morph_sub(&x[3 * row->joint[1]], &x[3 * row->joint[0]], d);
    const double now = morph_norm(d);
    row->active = now > 0.0;
    row->residual = now - length;
    for (int k = 0; k < 3 && row->active; k++) {
        row->grad[1][k] = d[k] / now;
        row->grad[0][k] = -row->grad[1][k];
    }
}

static void set_row(const morph_blanket_state *b, int r, const double *x, fix_row *row) {
    const morph_structure *s = b->structure;
    if (r < s->links) {
        const double length = morph_dist(&x[3 * row->joint[1]], &x[3 * row->joint[0]]);
        const double *limit = b->limit[r], *bound = b->bound[r];
        row->active = false;
        if (length < bound[0] || limit[0] == limit[1])
            length_row(x, limit[0], row);
        else if (length > bound[1])
            length_row(x, limit[1], row);
    } else if (r < s->links + s->posts)
        length_row(x, s->post_length[r - s->links], row);
    else
        row->active = morph_blanket_panel_row(s, r - s->links - s->posts, x, &row->residual, row->grad);
}

static double times(const morph_blanket_state *b, const fix_row *a, const fix_row *c) {
    double sum = 0.0;
    for (int i = 0; i < a->joints; i++)
        for (int k = 0; k < c->joints; k++)
            if (a->joint[i] == c->joint[k]) sum += b->weight[a->joint[i]] * morph_dot(a->grad[i], c->grad[k]);
    return sum;
}

/* J J' with the rows that do not count as rows of the unit matrix: one pattern serves them all. */
static void assemble(const morph_blanket_state *b, morph_blanket_fix *f) {
    for (int c = 0; c < f->rows; c++) {
        const fix_row *col = &f->row[c];
        for (int p = f->start[c]; p < f->start[c + 1]; p++) {
            const fix_row *row = &f->row[f->index[p]];
            f->value[p] = col->active && row->active ? times(b, row, col) : 0.0;
        }
        double *diagonal = &f->value[f->start[c]];
        if (!(*diagonal > 0.0)) *diagonal = 1.0; /* inactive, or between held joints */
        *diagonal *= 1.0 + REGULAR;
        f->right[c] = col->active ? -col->residual : 0.0;
    }
}

static double largest_residual(const morph_blanket_state *b, morph_blanket_fix *f, const double *x) {
    double most = 0.0;
    for (int r = 0; r < f->rows; r++) {
        set_row(b, r, x, &f->row[r]);
        if (f->row[r].active) most = fmax(most, fabs(f->row[r].residual));
    }
    return most;
}

/* dx = W J' l with J W J' l = -c is the least motion that undoes c to first order. */
static bool newton_step(const morph_blanket_state *b, morph_blanket_fix *f, double *x, double *move) {
    int column;
    assemble(b, f);
    if (morph_sparse_factor(f->sparse, f->value, &column) != MORPH_OK || column >= 0) return false;
    if (morph_sparse_solve(f->sparse, f->right, f->right, NULL) != MORPH_OK) return false;
    memset(move, 0, 3 * (size_t)b->joints * sizeof *move);
    for (int r = 0; r < f->rows; r++)
        for (int k = 0; k < f->row[r].joints && f->row[r].active; k++) {
            const int joint = f->row[r].joint[k];
            for (int m = 0; m < 3; m++)
                move[3 * joint + m] += b->weight[joint] * f->right[r] * f->row[r].grad[k][m];
        }
    double most = 0.0;
    for (int k = 0; k < 3 * b->joints; k++)
        most = fmax(most, fabs(move[k]));
    const double longest = LONGEST_MOVE * b->structure->spacing;
    const double part = most > longest ? longest / most : 1.0;
    for (int k = 0; k < 3 * b->joints; k++)
        x[k] += part * move[k];
    return true;
}

void morph_blanket_fix_apply(morph_blanket_state *b, double *x) {
    morph_blanket_fix *f = b->fix;
    /* A tenth of what counts as held; rounding is a thousandth of it. */
    const double enough = 0.1 * MORPH_BLANKET_LENGTH_HELD * b->structure->spacing;
    for (int k = 0; k < NEWTON_STEPS; k++) {
        if (largest_residual(b, f, x) <= enough) return;
        if (!newton_step(b, f, x, b->spare_x)) return;
    }
}
