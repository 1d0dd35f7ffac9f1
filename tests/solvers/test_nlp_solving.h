/* What the tests of whole solves share: creating, comparing, watching. */
#ifndef TEST_NLP_SOLVING_H
#define TEST_NLP_SOLVING_H

#include "test_nlp_problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static inline morph_nlp *create(int unknowns, const double *x0, const double *lower, const double *upper,
                                const morph_block *blocks, int count) {
    char message[256];
    morph_nlp *nlp = NULL;
    if (morph_nlp_create(unknowns, x0, lower, upper, blocks, count, message, sizeof message, &nlp) !=
        MORPH_OK)
        fail_msg("create: %s", message);
    return nlp;
}

/* The same bits in everything that does not measure time. */
static inline void assert_same(const morph_nlp_result *a, const morph_nlp_result *b) {
    assert_int_equal(a->outcome, b->outcome);
    assert_int_equal(a->iterations, b->iterations);
    assert_int_equal(a->evaluations, b->evaluations);
    const size_t n = (size_t)a->unknowns * sizeof(double), m = (size_t)a->rows * sizeof(double);
    assert_memory_equal(a->x, b->x, n);
    assert_memory_equal(a->row_multiplier, b->row_multiplier, m);
    assert_memory_equal(a->lower_multiplier, b->lower_multiplier, n);
    assert_memory_equal(a->upper_multiplier, b->upper_multiplier, n);
    assert_memory_equal(&a->objective, &b->objective, sizeof a->objective);
}

static inline morph_nlp_result solve_chain(chain *c, int links, bool isolated) {
    morph_block blocks[2];
    chain_init(c, links, blocks);
    morph_nlp *nlp = create(2 * links + 2, c->x0, c->lower, c->upper, blocks, 2);
    morph_nlp_options o = morph_nlp_defaults();
    o.isolated = isolated;
    morph_nlp_result r = {0};
    const morph_status status = morph_nlp_solve(nlp, c->x0, &o, &r);
    morph_nlp_destroy(nlp);
    assert_int_equal(status, MORPH_OK);
    assert_int_equal(r.outcome, MORPH_OPTIMAL);
    return r;
}

typedef struct watch {
    int asked, stop_at;
    int progress, lines;
    double last_fraction;
} watch;

static inline int watch_stop(void *user) {
    watch *w = user;
    return ++w->asked >= w->stop_at && w->stop_at > 0;
}

static inline void watch_progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    w->progress += strcmp(stage, "solve") == 0;
    w->last_fraction = fraction;
}

static inline void watch_log(void *user, const char *line) {
    ((watch *)user)->lines += strchr(line, '\n') == NULL;
}

#endif
