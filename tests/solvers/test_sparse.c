/* Sparse Cholesky: against known solutions, an indefinite matrix named by its column, repeats, refusals of
 * memory. The C library's allocator is wrapped; the sanitizer brings its own, so there that test is skipped.
 */
#include "solvers/sparse.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/refused_memory.h"

enum { SIDE = 12, N = SIDE * SIDE, MOST = 3 * N };

/* Five-point Laplacian of a square grid, ends held, plus `shift` on the diagonal. */
typedef struct grid {
    int start[N + 1], row[MOST];
    double value[MOST];
} grid;

static void make(grid *g, double shift) {
    int at = 0;
    for (int c = 0; c < N; c++) {
        g->start[c] = at;
        g->row[at] = c;
        g->value[at++] = 4.0 + shift;
        if (c % SIDE + 1 < SIDE) {
            g->row[at] = c + 1;
            g->value[at++] = -1.0;
        }
        if (c + SIDE < N) {
            g->row[at] = c + SIDE;
            g->value[at++] = -1.0;
        }
    }
    g->start[N] = at;
}

/* The grid's modes are sin sin with eigenvalue 4 - 2 cos a - 2 cos b. */
static void mode(int p, int q, double *x, double *eigenvalue) {
    const double a = acos(-1.0) * p / (SIDE + 1), b = acos(-1.0) * q / (SIDE + 1);
    for (int c = 0; c < N; c++)
        x[c] = sin(a * (c % SIDE + 1)) * sin(b * (c / SIDE + 1));
    *eigenvalue = 4.0 - 2.0 * cos(a) - 2.0 * cos(b);
}

static void solves_modes(void **state) {
    (void)state;
    grid g;
    make(&g, 0.0);
    morph_sparse *s;
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_OK);
    int column;
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    assert_int_equal(column, -1);
    for (int p = 1; p < SIDE; p += 3)
        for (int q = 1; q < SIDE; q += 4) {
            double b[N], x[N], eigenvalue, residual, product[N];
            mode(p, q, b, &eigenvalue);
            assert_int_equal(morph_sparse_solve(s, b, x, &residual), MORPH_OK);
            morph_sparse_times(s, g.value, x, product);
            assert_true(residual < 1e-15);
            for (int c = 0; c < N; c++) {
                /* Condition 70: a few hundred roundings. */
                assert_true(fabs(x[c] - b[c] / eigenvalue) < 1e-13);
                assert_true(fabs(product[c] - b[c]) < 1e-13);
            }
            /* In place. */
            assert_int_equal(morph_sparse_solve(s, b, b, NULL), MORPH_OK);
            assert_memory_equal(b, x, sizeof b);
        }
    const morph_sparse_size size = morph_sparse_sizes(s);
    assert_int_equal(size.analyses, 1);
    assert_int_equal(size.factorisations, 1);
    assert_true(size.factor_nonzeros >= size.nonzeros);
    morph_sparse_destroy(s);
}

/* One negative pivot: the column named is one where a leading block turns indefinite. With a diagonal matrix
 * it can only be the column itself. */
static void names_the_column(void **state) {
    (void)state;
    grid g;
    make(&g, 0.0);
    int start[N + 1], row[N], column;
    double value[N], b[N] = {1.0};
    for (int c = 0; c <= N; c++) {
        start[c] = c;
        if (c < N) {
            row[c] = c;
            value[c] = 2.0;
        }
    }
    morph_sparse *s;
    assert_int_equal(morph_sparse_create(N, start, row, &s), MORPH_OK);
    for (int bad = 0; bad < N; bad += 29)
        for (int zero = 0; zero < 2; zero++) {
            value[bad] = zero ? 0.0 : -1.0;
            assert_int_equal(morph_sparse_factor(s, value, &column), MORPH_OK);
            assert_int_equal(column, bad);
            assert_int_equal(morph_sparse_solve(s, b, b, NULL), MORPH_ERR_INPUT);
            value[bad] = 2.0;
        }
    assert_int_equal(morph_sparse_factor(s, value, &column), MORPH_OK);
    assert_int_equal(column, -1);
    morph_sparse_destroy(s);
    /* Least eigenvalue 0.116: positive definite just above minus that, not just below. */
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_OK);
    double x[N], least;
    mode(1, 1, x, &least);
    make(&g, -0.999 * least);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    assert_int_equal(column, -1);
    make(&g, -1.001 * least);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    assert_true(column >= 0 && column < N);
    morph_sparse_destroy(s);
}

static void repeats_bit_for_bit(void **state) {
    (void)state;
    grid g;
    make(&g, 0.0);
    double first[N], again[N], b[N];
    int column;
    for (int c = 0; c < N; c++)
        b[c] = cos(3.0 * c);
    morph_sparse *s, *t;
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_OK);
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &t), MORPH_OK);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    assert_int_equal(morph_sparse_solve(s, b, first, NULL), MORPH_OK);
    make(&g, 5.0);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    make(&g, -5.0);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    assert_true(column >= 0);
    make(&g, 0.0);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    assert_int_equal(morph_sparse_solve(s, b, again, NULL), MORPH_OK);
    assert_memory_equal(first, again, sizeof first);
    assert_int_equal(morph_sparse_factor(t, g.value, &column), MORPH_OK);
    assert_int_equal(morph_sparse_solve(t, b, again, NULL), MORPH_OK);
    assert_memory_equal(first, again, sizeof first);
    morph_sparse_destroy(s);
    morph_sparse_destroy(t);
}

static void refuses_bad_input(void **state) {
    (void)state;
    grid g;
    make(&g, 0.0);
    morph_sparse *s;
    const int keep = g.row[5];
    g.row[5] = g.row[4];
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_ERR_INPUT);
    assert_null(s);
    g.row[5] = N;
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_ERR_INPUT);
    g.row[5] = keep;
    g.start[3] = g.start[2];
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_ERR_INPUT);
    make(&g, 0.0);
    assert_int_equal(morph_sparse_create(0, g.start, g.row, &s), MORPH_ERR_INPUT);
    assert_int_equal(morph_sparse_create(N, g.start, g.row, &s), MORPH_OK);
    int column;
    double b[N] = {0};
    assert_int_equal(morph_sparse_solve(s, b, b, NULL), MORPH_ERR_INPUT);
    g.value[7] = NAN;
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_ERR_NONFINITE);
    g.value[7] = INFINITY;
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_ERR_NONFINITE);
    make(&g, 0.0);
    assert_int_equal(morph_sparse_factor(s, g.value, &column), MORPH_OK);
    b[3] = NAN;
    assert_int_equal(morph_sparse_solve(s, b, b, NULL), MORPH_ERR_NONFINITE);
    morph_sparse_destroy(s);
    morph_sparse_destroy(NULL);
}

static morph_status whole(const grid *g) {
    morph_sparse *s;
    double b[N] = {1.0};
    int column;
    morph_status status = morph_sparse_create(N, g->start, g->row, &s);
    if (status != MORPH_OK) return status;
    status = morph_sparse_factor(s, g->value, &column);
    if (status == MORPH_OK) status = morph_sparse_solve(s, b, b, NULL);
    morph_sparse_destroy(s);
    return status;
}

static void survives_refused_memory(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    grid g;
    make(&g, 0.0);
    allocations = 0;
    assert_int_equal(whole(&g), MORPH_OK);
    const long count = allocations;
    assert_true(count > 10);
    for (long k = 1; k <= count; k++) {
        const long before = live;
        countdown = k - 1;
        const morph_status status = whole(&g);
        countdown = -1;
        assert_int_equal(status, MORPH_ERR_NOMEM);
        assert_int_equal(live, before);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(solves_modes), cmocka_unit_test(names_the_column),
                                       cmocka_unit_test(repeats_bit_for_bit),
                                       cmocka_unit_test(refuses_bad_input),
                                       cmocka_unit_test(survives_refused_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
