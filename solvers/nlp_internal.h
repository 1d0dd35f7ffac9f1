/* What the files of the NLP layer share; nobody else includes it.
 *
 *   nlp.c           create, destroy, names            nlp_pattern.c   the sink, recording, merging
 *   nlp_evaluate.c  cached values, walks, violation   nlp_check.c     derivative checker
 *   nlp_ipopt.c     one run of Ipopt                  nlp_isolate.c   the same in a child process
 *   nlp_solve.c     options, outcome, result
 */
#ifndef MORPH_NLP_INTERNAL_H
#define MORPH_NLP_INTERNAL_H

#include "solvers/nlp.h"

/* One emitted derivative with its value, in local indices; Jacobian: (row, unknown), Hessian: (i, j). */
typedef struct morph_record_entry {
    int row, unknown;
    double value;
} morph_record_entry;

/* Grows while a walk is recorded; zeroed is empty, freed with free(entries). */
typedef struct morph_record {
    morph_record_entry *entries;
    size_t count, capacity;
} morph_record;

/* One emitted entry of a recorded walk: what the walk must say again, and where its value is added.
 * A Hessian slot may be ~slot: i != j name the same global unknown, so both triangles fall on the diagonal
 * and the value counts twice. */
typedef struct morph_entry {
    int row, unknown, slot;
} morph_entry;

struct morph_sink {
    bool wants_jacobian, wants_hessian;
    int rows, unknowns; /* of the block, rows 1 for an objective */
    /* Recording. */
    morph_record *jacobian_record, *hessian_record; /* both NULL when filling */
    morph_status status;                            /* NOMEM or INPUT (bad index) while recording */
    int bad_row, bad_unknown;
    /* Filling. */
    const morph_entry *jacobian, *hessian;
    int jacobian_count, hessian_count, jacobian_next, hessian_next;
    double *jacobian_value, *hessian_value;
    bool mismatch; /* another entry than the recorded one, or too many */
};

/* A merged sparse pattern: nonzero k is at (row[k], column[k]), sorted by row, then column. */
typedef struct morph_pattern {
    int count;
    int *row, *column;
} morph_pattern;

enum { MORPH_BLOCK_NAME = 64 };

typedef struct morph_nlp_block {
    morph_block def; /* name and unknown point to copies, lower and upper are NULL */
    char name[MORPH_BLOCK_NAME];
    int *unknown;  /* copy; NULL: identity */
    int first_row; /* -1: objective */
    morph_entry *jacobian, *hessian;
    int jacobian_count, hessian_count;
} morph_nlp_block;

struct morph_nlp {
    int unknowns, rows, block_count;
    morph_nlp_block *blocks;
    double *lower, *upper; /* unknowns */
    double *row_lower, *row_upper;
    morph_pattern jacobian, hessian; /* Hessian: lower triangle, row >= column */

    /* Scratch of the callbacks, sized at create: nothing is allocated later. */
    double *local; /* a block's unknowns */
    double *ones;  /* max(rows, 1) */

    /* Cache of everything known at x. */
    double *x;
    bool at_x; /* x holds a point */
    bool has_objective, has_rows, has_gradient, has_jacobian;
    double objective;
    double *row_value, *gradient, *jacobian_value;
    double *hessian_value; /* of morph_nlp_evaluate only */
    int points;            /* distinct points evaluated so far */
};

/* Recording walk of one block at its local x (both derivatives asked). Records are cleared, not freed, first.
 */
morph_status morph_block_record(const morph_block *block, const double *x, const double *weight,
                                morph_record *jacobian, morph_record *hessian, morph_sink *sink);
/* Merges entries (row[k], column[k]), k < count, into a sorted pattern and gives each its slot. */
morph_status morph_pattern_merge(size_t count, const int *row, const int *column, int rows, int columns,
                                 int *slot, morph_pattern *out);

/* The evaluations below return MORPH_ERR_NONFINITE for a value that is not finite, a block's own status, or
 * MORPH_ERR_INTERNAL for a walk that differs from the recorded one. Results stay in the cache of nlp. */
morph_status morph_nlp_objective_at(morph_nlp *nlp, const double *x);
morph_status morph_nlp_rows_at(morph_nlp *nlp, const double *x);
morph_status morph_nlp_gradient_at(morph_nlp *nlp, const double *x);
morph_status morph_nlp_jacobian_at(morph_nlp *nlp, const double *x);
/* values[hessian.count]; not cached, since it depends on the multipliers. */
morph_status morph_nlp_hessian_at(morph_nlp *nlp, const double *x, double factor, const double *multiplier,
                                  double *values);
/* Worst violation of rows (values at x) and bounds; a NaN counts as infinite. worst_row (may be NULL): -1 for
 * a bound or none. */
double morph_nlp_violation(const morph_nlp *nlp, const double *x, const double *rows, int *worst_row);

/* One run of the solver as plain data, so that it can lie in memory shared with a child process. The arrays
 * follow it in one piece of memory (morph_run_bytes). */
typedef struct morph_run {
    int unknowns, rows;
    morph_status status; /* of the run: NOMEM, BACKEND, INTERNAL (refused option), a block's fatal status */
    bool finished;       /* the record is complete */
    bool fixed;          /* nothing to solve: every unknown is fixed */
    bool stopped, limit; /* our callback ended it: asked by the caller, wall limit */
    bool nonfinite;      /* some callback met a number that is not finite */
    volatile int stop_request; /* set by the parent of an isolated run */
    int code, iterations, evaluations;
    double linear_seconds, callback_seconds;
    /* The best point seen, twice: the one not current is written, then made current, so that a process killed
     * in between leaves a whole one. */
    volatile int best_current; /* 0 or 1; -1: none */
    bool best_feasible[2];
    double best_objective[2], best_violation[2];
    size_t best_x[2], x, row_multiplier, lower_multiplier, upper_multiplier; /* offsets into values */
    double values[];
} morph_run;

size_t morph_run_bytes(int unknowns, int rows);
void morph_run_layout(morph_run *run, int unknowns, int rows);
static inline double *morph_run_array(morph_run *run, size_t offset) {
    return run->values + offset;
}
/* The x and multipliers of run are the start; everything else is filled. Callers hold the mutex. */
void morph_run_ipopt(morph_nlp *nlp, const morph_nlp_options *options, morph_run *run);
/* The same in a child process: *shared lies in shared memory. MORPH_ERR_BACKEND when the child ended without
 * its record; a child that we had to end ourselves after a stop or the wall limit leaves its best point. */
void morph_run_isolated(morph_nlp *nlp, const morph_nlp_options *options, morph_run *shared);

/* How a return code ends a solve. */
typedef enum morph_code_kind {
    MORPH_CODE_SOLVED,
    MORPH_CODE_CONCLUDED, /* acceptable level, infeasible, diverging ...: the recomputed point decides */
    MORPH_CODE_LIMIT,     /* ended by the caller or a limit */
    MORPH_CODE_NUMBER,    /* a number that is not finite */
    MORPH_CODE_NOMEM,
    MORPH_CODE_FAILED
} morph_code_kind;
morph_code_kind morph_ipopt_code(int code, const char **text);

#endif
