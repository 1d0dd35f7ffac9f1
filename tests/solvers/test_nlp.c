/* The block assembler: patterns, numbering, values, refusals. */
#include "solvers/nlp_internal.h"
#include "test_nlp_problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static morph_nlp *create(int unknowns, const double *x0, const double *lower, const double *upper,
                         const morph_block *blocks, int count) {
    char message[256];
    morph_nlp *nlp = NULL;
    const morph_status status =
        morph_nlp_create(unknowns, x0, lower, upper, blocks, count, message, sizeof message, &nlp);
    if (status != MORPH_OK) fail_msg("create: %s", message);
    return nlp;
}

/* Two blocks that share unknowns through maps, with repeated entries and a pair that falls on one global
 * unknown. */
typedef struct pair {
    double scale;
    int emitted; /* entries left out of the Jacobian on purpose */
} pair;

/* f = scale * u0 * u1 */
static morph_status pair_value(void *data, const double *x, double *f) {
    f[0] = ((pair *)data)->scale * x[0] * x[1];
    return MORPH_OK;
}

static morph_status pair_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    const pair *p = data;
    morph_sink_jacobian(s, 0, 0, p->scale * x[1]);
    if (p->emitted == 0) morph_sink_jacobian(s, 0, 1, p->scale * x[0]);
    if (p->emitted == 2) morph_sink_jacobian(s, 0, 0, p->scale * x[0]); /* wrong unknown */
    if (p->emitted == 3) {                                              /* one too many */
        morph_sink_jacobian(s, 0, 1, p->scale * x[0]);
        morph_sink_jacobian(s, 0, 1, 0);
    }
    if (morph_sink_wants_hessian(s)) morph_sink_hessian(s, 0, 1, p->scale * weight[0]);
    return MORPH_OK;
}

static const double free_row[2] = {-INFINITY, INFINITY};

static morph_block pair_block(pair *p, const int *unknown, int rows) {
    return (morph_block){.name = rows > 0 ? "pair row" : "pair",
                         .rows = rows,
                         .unknowns = 2,
                         .unknown = unknown,
                         .lower = &free_row[0],
                         .upper = &free_row[1],
                         .data = p,
                         .value = pair_value,
                         .walk = pair_walk};
}

static void merges_blocks(void **state) {
    (void)state;
    /* f = 2 x2 x0 + 3 x1 x1; rows 5 x0 x2, 7 x2 x2 */
    pair p[4] = {{.scale = 2}, {.scale = 3}, {.scale = 5}, {.scale = 7}};
    int map[4][2] = {{2, 0}, {1, 1}, {0, 2}, {2, 2}};
    morph_block blocks[4] = {pair_block(&p[0], map[0], 0), pair_block(&p[2], map[2], 1),
                             pair_block(&p[1], map[1], 0), pair_block(&p[3], map[3], 1)};
    const double x[3] = {1.5, -2, 0.5};
    morph_nlp *nlp = create(3, x, NULL, NULL, blocks, 4);
    memset(map, -1, sizeof map); /* copied at create */
    const morph_nlp_size size = morph_nlp_sizes(nlp);
    assert_int_equal(size.rows, 2);
    assert_int_equal(size.jacobian_nonzeros, 3); /* (0,0) (0,2) (1,2) */
    assert_int_equal(size.hessian_nonzeros, 3);  /* (1,1) (2,0) (2,2) */
    assert_int_equal(morph_nlp_first_row(nlp, 0), -1);
    assert_int_equal(morph_nlp_first_row(nlp, 1), 0);
    assert_int_equal(morph_nlp_first_row(nlp, 3), 1);
    double f, rows[2];
    assert_int_equal(morph_nlp_evaluate(nlp, x, &f, rows), MORPH_OK);
    assert_near(f, 2 * 0.5 * 1.5 + 3 * 4, 1e-15);
    assert_near(rows[0], 5 * 1.5 * 0.5, 1e-15);
    assert_near(rows[1], 7 * 0.25, 1e-15);
    /* Gradient 2 x2, 6 x1, 2 x0; Jacobian 5 x2, 5 x0; 14 x2. */
    const double gradient[3] = {1, -12, 3}, jacobian[3] = {2.5, 7.5, 7};
    const int row[3] = {0, 0, 1}, column[3] = {0, 2, 2};
    for (int k = 0; k < 3; k++) {
        assert_near(nlp->gradient[k], gradient[k], 1e-15);
        assert_near(nlp->jacobian_value[k], jacobian[k], 1e-15);
        assert_int_equal(nlp->jacobian.row[k], row[k]);
        assert_int_equal(nlp->jacobian.column[k], column[k]);
    }
    /* Weighted Hessian with factor 1, multipliers (10, 100): (1,1) 6; (2,0) 2 + 50; (2,2) 2 * 7 * 100. */
    const double multiplier[2] = {10, 100}, hessian[3] = {6, 52, 1400};
    const int hrow[3] = {1, 2, 2}, hcolumn[3] = {1, 0, 2};
    double values[3];
    assert_int_equal(morph_nlp_hessian_at(nlp, x, 1, multiplier, values), MORPH_OK);
    for (int k = 0; k < 3; k++) {
        assert_near(values[k], hessian[k], 1e-12);
        assert_int_equal(nlp->hessian.row[k], hrow[k]);
        assert_int_equal(nlp->hessian.column[k], hcolumn[k]);
    }
    char name[64];
    morph_nlp_row_name(nlp, 1, name, sizeof name);
    assert_string_equal(name, "pair row: row 0");
    morph_nlp_destroy(nlp);
}

/* Patterns come out sorted and without repetition, and slots point back to the right place. */
static void merge_sorts(void **state) {
    (void)state;
    enum { N = 5000, ROWS = 60, COLUMNS = 45 };
    static int row[N], column[N], slot[N];
    unsigned lcg = 7;
    for (int k = 0; k < N; k++) {
        lcg = 1664525u * lcg + 1013904223u;
        row[k] = (int)((lcg >> 8) % ROWS);
        column[k] = (int)((lcg >> 16) % COLUMNS);
    }
    morph_pattern p;
    assert_int_equal(morph_pattern_merge(N, row, column, ROWS, COLUMNS, slot, &p), MORPH_OK);
    for (int k = 0; k < N; k++) {
        assert_int_equal(p.row[slot[k]], row[k]);
        assert_int_equal(p.column[slot[k]], column[k]);
    }
    for (int k = 1; k < p.count; k++)
        assert_true(p.row[k - 1] < p.row[k] || (p.row[k - 1] == p.row[k] && p.column[k - 1] < p.column[k]));
    free(p.row);
    free(p.column);
    assert_int_equal(morph_pattern_merge(0, row, column, ROWS, COLUMNS, slot, &p), MORPH_OK);
    assert_int_equal(p.count, 0);
    free(p.row);
    free(p.column);
}

/* A walk that changes what it emits is our own bug, whichever way it changes. */
static void changed_walk_is_an_error(void **state) {
    (void)state;
    const double x[2] = {1, 2};
    for (int wrong = 1; wrong <= 3; wrong++) {
        pair p = {.scale = 1};
        const morph_block block = pair_block(&p, NULL, 1);
        morph_nlp *nlp = create(2, x, NULL, NULL, &block, 1);
        assert_int_equal(morph_nlp_evaluate(nlp, x, NULL, NULL), MORPH_OK);
        p.emitted = wrong;
        assert_int_equal(morph_nlp_evaluate(nlp, x, NULL, NULL), MORPH_ERR_INTERNAL);
        morph_nlp_result result = {0};
        assert_int_equal(morph_nlp_solve(nlp, x, NULL, &result), MORPH_ERR_INTERNAL);
        assert_null(result.x);
        morph_nlp_destroy(nlp);
    }
}

static void caches_by_point(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 10, blocks);
    morph_nlp *nlp = create(22, c.x0, c.lower, c.upper, blocks, 2);
    double x[22];
    memcpy(x, c.x0, sizeof x);
    x[5] += 0.25;
    const int values = c.values, walks = c.walks;
    for (int k = 0; k < 3; k++) {
        double copy[22]; /* another address, the same point */
        memcpy(copy, x, sizeof x);
        assert_int_equal(morph_nlp_rows_at(nlp, copy), MORPH_OK);
        assert_int_equal(morph_nlp_jacobian_at(nlp, copy), MORPH_OK);
    }
    assert_int_equal(c.values, values + 1);
    assert_int_equal(c.walks, walks + 1);
    x[5] += 1e-16 + 1e-15;
    assert_int_equal(morph_nlp_rows_at(nlp, x), MORPH_OK);
    assert_int_equal(c.values, values + 2);
    morph_nlp_destroy(nlp);
}

/* Creates with one thing wrong and expects the words in the message. */
static void refused(const double *x0, const double *lower, const double *upper, const morph_block *blocks,
                    int count, const char *words) {
    char message[256] = "";
    morph_nlp *nlp = (morph_nlp *)1;
    assert_int_equal(morph_nlp_create(4, x0, lower, upper, blocks, count, message, sizeof message, &nlp),
                     MORPH_ERR_INPUT);
    assert_null(nlp);
    if (!strstr(message, words)) fail_msg("\"%s\" does not say \"%s\"", message, words);
    assert_int_equal(morph_nlp_create(4, x0, lower, upper, blocks, count, NULL, 0, &nlp), MORPH_ERR_INPUT);
}

static void refuses_bad_input(void **state) {
    (void)state;
    morph_block b[2];
    hs71_blocks(b);
    double lower[4], upper[4], x0[4];
#define RESET (memcpy(lower, hs71_xlower, 32), memcpy(upper, hs71_xupper, 32), memcpy(x0, hs71_x0, 32))
    RESET, lower[2] = NAN, refused(x0, lower, upper, b, 2, "unknown 2");
    RESET, upper[1] = NAN, refused(x0, lower, upper, b, 2, "unknown 1");
    RESET, lower[3] = 6, refused(x0, lower, upper, b, 2, "unknown 3: bounds [6, 5]");
    RESET, lower[0] = INFINITY, upper[0] = INFINITY, refused(x0, lower, upper, b, 2, "unknown 0");
    RESET, x0[1] = NAN, refused(x0, lower, upper, b, 2, "unknown 1: the start value");
    RESET, x0[1] = -INFINITY, refused(x0, lower, upper, b, 2, "unknown 1");
    double rows[2] = {25, NAN};
    b[1].lower = rows;
    RESET, refused(x0, lower, upper, b, 2, "product: row 1");
    rows[1] = 41;
    refused(x0, lower, upper, b, 2, "product: row 1: bounds [41, 40]");
    b[1].lower = NULL;
    refused(x0, lower, upper, b, 2, "product");
    hs71_blocks(b);
    const int map[4] = {0, 1, 2, 4};
    b[0].unknown = map;
    refused(x0, lower, upper, b, 2, "cost: local unknown 3 is global 4");
    hs71_blocks(b);
    b[1].unknowns = 5;
    refused(x0, lower, upper, b, 2, "product");
    hs71_blocks(b);
    b[1].unknowns = 3; /* its walk emits unknown 3 */
    refused(x0, lower, upper, b, 2, "product: derivative entry (0, 3)");
    hs71_blocks(b);
    b[1].rows = 1;
    refused(x0, lower, upper, b, 2, "product: derivative entry (1, 0)");
    b[1].walk = NULL;
    refused(x0, lower, upper, b, 2, "block 1");
    refused(NULL, lower, upper, b, 2, "start point");
#undef RESET
}

static void refuses_first_values_that_are_not_finite(void **state) {
    (void)state;
    const double zero[3] = {0};
    quadratic q = {.rows = 2, .unknowns = 4, .nan_value = 1};
    morph_block b = quadratic_block(&q, zero, zero);
    refused(hs71_x0, NULL, NULL, &b, 1, "rows: row 0: the value is nan");
    q = (quadratic){.unknowns = 4, .nan_value = 1};
    b = quadratic_block(&q, NULL, NULL);
    refused(hs71_x0, NULL, NULL, &b, 1, "the objective");
    q = (quadratic){.rows = 1, .unknowns = 4, .nan_walk = 1};
    b = quadratic_block(&q, zero, zero);
    refused(hs71_x0, NULL, NULL, &b, 1, "rows: derivative entry (0, 0)");
}

static void names_and_nothing(void **state) {
    (void)state;
    static chain c;
    morph_block blocks[2];
    chain_init(&c, 3, blocks);
    morph_nlp *nlp = create(8, c.x0, c.lower, c.upper, blocks, 2);
    char text[64];
    morph_nlp_row_name(nlp, 2, text, sizeof text);
    assert_string_equal(text, "length: link 2-3");
    morph_nlp_row_name(nlp, -1, text, sizeof text);
    assert_string_equal(text, "a bound");
    char tiny[5];
    morph_nlp_row_name(nlp, 2, tiny, sizeof tiny);
    assert_string_equal(tiny, "leng");
    morph_nlp_destroy(nlp);
    morph_nlp_destroy(NULL);
    assert_string_equal(morph_outcome_text(MORPH_OPTIMAL), "optimal");
    assert_string_equal(morph_outcome_text(MORPH_STOPPED), "stopped");
    morph_nlp_result_free(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(merges_blocks),
        cmocka_unit_test(merge_sorts),
        cmocka_unit_test(changed_walk_is_an_error),
        cmocka_unit_test(caches_by_point),
        cmocka_unit_test(refuses_bad_input),
        cmocka_unit_test(refuses_first_values_that_are_not_finite),
        cmocka_unit_test(names_and_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
