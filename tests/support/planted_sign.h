/* A sign turned in one entry of a block's derivatives, which the comparison with central differences must
 * see. The test is linked with --wrap of both sinks, so that every entry that any block hands over passes
 * here. */
#ifndef MORPH_TEST_PLANTED_SIGN_H
#define MORPH_TEST_PLANTED_SIGN_H

#include "solvers/nlp.h"

#include <math.h>

void __real_morph_sink_jacobian(morph_sink *s, int row, int unknown, double value);
void __real_morph_sink_hessian(morph_sink *s, int i, int j, double value);
void __wrap_morph_sink_jacobian(morph_sink *s, int row, int unknown, double value);
void __wrap_morph_sink_hessian(morph_sink *s, int i, int j, double value);

/* Entries of one kind in the order of the walk. */
typedef struct planted_entries {
    int next, largest; /* -1: all that came were zero */
    int turned;        /* -1: none */
    double size;       /* of the largest */
} planted_entries;

static planted_entries planted_first = {.turned = -1}, planted_second = {.turned = -1};
static morph_status (*planted_walk)(void *, const double *, const double *, morph_sink *);

static double planted_pass(planted_entries *e, double value) {
    if (fabs(value) > e->size) {
        e->size = fabs(value);
        e->largest = e->next;
    }
    return e->next++ == e->turned ? -value : value;
}

/* Only what is asked for counts: a walk may emit both kinds whatever is wanted. */
void __wrap_morph_sink_jacobian(morph_sink *s, int row, int unknown, double value) {
    const double passed = morph_sink_wants_jacobian(s) ? planted_pass(&planted_first, value) : value;
    __real_morph_sink_jacobian(s, row, unknown, passed);
}

void __wrap_morph_sink_hessian(morph_sink *s, int i, int j, double value) {
    const double passed = morph_sink_wants_hessian(s) ? planted_pass(&planted_second, value) : value;
    __real_morph_sink_hessian(s, i, j, passed);
}

static void planted_begin(planted_entries *e) {
    *e = (planted_entries){.largest = -1, .turned = e->turned};
}

static morph_status planted_count(void *data, const double *x, const double *weight, morph_sink *sink) {
    if (morph_sink_wants_jacobian(sink)) planted_begin(&planted_first);
    if (morph_sink_wants_hessian(sink)) planted_begin(&planted_second);
    return planted_walk(data, x, weight, sink);
}

/* The largest entry of each kind at x, turned: the comparison fails both times. Returns how many kinds had an
 * entry to turn. n: unknowns of x. The block passes as it is. */
static int planted_signs_seen(const morph_block *block, const double *x, int n) {
    planted_entries *const kind[] = {&planted_first, &planted_second};
    morph_block turned = *block;
    morph_derivative_check check;
    int turns = 0;
    planted_walk = block->walk;
    turned.walk = planted_count;
    assert_int_equal(morph_check_derivatives(&turned, 1, x, n, 1e-5, 1e-6, &check), MORPH_OK);
    assert_true(check.passed);
    for (int k = 0; k < 2; k++) {
        if (kind[k]->largest < 0) continue;
        kind[k]->turned = kind[k]->largest;
        assert_int_equal(morph_check_derivatives(&turned, 1, x, n, 1e-5, 1e-6, &check), MORPH_OK);
        kind[k]->turned = -1;
        if (check.passed)
            fail_msg("%s: a sign turned in a derivative of order %d is not seen", block->name, k + 1);
        turns++;
    }
    return turns;
}

#endif
