/* A nonlinear program as a list of blocks, and its solution by an interior point method (Ipopt behind this
 * header).
 *
 *     minimise sum of objective blocks   subject to   lower <= row <= upper,   xlower <= x <= xupper
 *
 * Each block knows only its own local unknowns; the assembler maps them to the global ones, merges the
 * sparsity patterns and hands out row numbers, so that a new block never renumbers another. */
#ifndef MORPH_NLP_H
#define MORPH_NLP_H

#include "solvers/base.h"

/* Receives derivatives from a block's walk: the same traversal gives the pattern once and the values ever
 * after, so a walk must emit the same entries in the same order whatever x is, zeros included. */
typedef struct morph_sink morph_sink;
/* d row / d local unknown; row 0 for an objective block. Repeated entries add up. */
void morph_sink_jacobian(morph_sink *s, int row, int unknown, double value);
/* Second derivative of sum_r weight_r f_r by the local unknowns i and j, already weighted. Emit each
 * unordered pair once: (i, j) with i != j stands for both triangles. Repeated entries add up. */
void morph_sink_hessian(morph_sink *s, int i, int j, double value);
/* False when only first derivatives are asked: a walk may then skip the work of the second (and their
 * entries). */
bool morph_sink_wants_hessian(const morph_sink *s);
/* False when only the Hessian is asked. */
bool morph_sink_wants_jacobian(const morph_sink *s);

typedef struct morph_block {
    const char *name;            /* as in messages: "length", "post", "clearance" ... */
    int rows;                    /* constraint rows; 0: an objective term */
    int unknowns;                /* local unknowns */
    const int *unknown;          /* local -> global; NULL: local i is global i. Read only during create */
    const double *lower, *upper; /* rows; +-INFINITY for none. Copied at create */
    void *data;                  /* the block's own; owned by the caller, must outlive the problem */
    /* f[rows] (or f[0] of an objective) at the local x. Must not allocate. */
    morph_status (*value)(void *data, const double *x, double *f);
    /* Derivatives at the local x; weight[rows] (or weight[0]) for the Hessian. Must not allocate. */
    morph_status (*walk)(void *data, const double *x, const double *weight, morph_sink *sink);
    /* Names what a row is about ("link 17 (2,1)-(3,1) bottom"); may be NULL. */
    void (*describe)(void *data, int row, char *text, size_t size);
} morph_block;

typedef struct morph_nlp morph_nlp;

/* Copies the blocks' tables (not their data) and records the pattern at x0 by one walk of each block. xlower,
 * xupper (NULL: none) are copied. The message (may be NULL) says what is wrong on MORPH_ERR_INPUT: lower >
 * upper, NaN in a bound or in a first value, a bad index. */
morph_status morph_nlp_create(int unknowns, const double *x0, const double *xlower, const double *xupper,
                              const morph_block *blocks, int block_count, char *message, size_t message_size,
                              morph_nlp **out);
void morph_nlp_destroy(morph_nlp *nlp);

typedef struct morph_nlp_size {
    int unknowns, rows, jacobian_nonzeros, hessian_nonzeros;
} morph_nlp_size;
morph_nlp_size morph_nlp_sizes(const morph_nlp *nlp);

/* Evaluates everything once at x (unknowns): objective, rows (may be NULL), Jacobian values, Hessian values
 * for row multipliers of 1; for benchmarks and tests. */
morph_status morph_nlp_evaluate(morph_nlp *nlp, const double *x, double *objective, double *rows);

/* The objective blocks alone at x (unknowns): their sum, and its gradient (unknowns; may be NULL). */
morph_status morph_nlp_objective(morph_nlp *nlp, const double *x, double *objective, double *gradient);

/* First global row of a block, or -1 for an objective block. */
int morph_nlp_first_row(const morph_nlp *nlp, int block);
/* "clearance: link 17 (2,1)-(3,1) bottom" for a global row. */
void morph_nlp_row_name(const morph_nlp *nlp, int row, char *text, size_t size);

/* What the optimiser concluded. */
typedef enum morph_outcome {
    MORPH_OPTIMAL,  /* optimal within the tolerance, and the recomputed violation agrees */
    MORPH_FEASIBLE, /* not optimal, but the point returned violates no row or bound by more than the tolerance
                     */
    MORPH_INFEASIBLE, /* no feasible point found; the least violating one is returned */
    MORPH_STOPPED     /* stopped by the caller or a limit, with nothing feasible */
} morph_outcome;
const char *morph_outcome_text(morph_outcome outcome); /* "optimal", "feasible", "infeasible", "stopped" */

typedef struct morph_nlp_options {
    double tolerance;           /* of Ipopt's scaled optimality error */
    double violation_tolerance; /* absolute, in the rows' own units: blocks scale themselves to order 1 */
    int max_iterations;
    double max_seconds; /* wall; <= 0: none */
    bool warm;          /* start from result's x and multipliers of a previous solve with the same shape */
    double mu_init;     /* <= 0: the library's */
    double mu_target;   /* > 0: solve for this barrier parameter instead of 0: every active bound and row then
                           has multiplier times slack = mu_target, and the last iterate is returned */
    bool adaptive_mu;
    /* Run the solver in a child process: then running out of memory inside it (which may end a process by a
     * signal or by an exit with code 0) is MORPH_ERR_BACKEND and not the end of the caller, and stop and
     * max_seconds hold even within one long factorisation. Blocks then run in the child, on copies: what they
     * write to their data is lost; stop, progress and log still run in the caller. */
    bool isolated;
    /* Order by nested dissection: less fill in programs of many thousand unknowns that hang together in three
     * dimensions (a grid over the poses of a path). Isolated solves only: the ordering draws random numbers,
     * which begin anew in each child, and must not run in threads, which each child is told. */
    bool dissect;
    const morph_control *control; /* stop is asked once per iteration */
} morph_nlp_options;
morph_nlp_options morph_nlp_defaults(void);

/* Arrays are owned; free with morph_nlp_result_free. Zeroed is empty. */
typedef struct morph_nlp_result {
    morph_outcome outcome;
    int solver_code; /* Ipopt's own return code, for the log */
    char solver_text[64];
    int iterations, evaluations;
    double objective; /* recomputed from x */
    double violation; /* worst over rows and bounds, recomputed from x */
    int worst_row;    /* global row of it; -1: a bound or none */
    int unknowns, rows, jacobian_nonzeros, hessian_nonzeros;
    /* The best point: feasible with the least objective if any was seen, else the least violating. Ipopt's
     * last point goes before a kept one that is lower by no more than its violation within the tolerance can
     * buy. */
    double *x;
    double *row_multiplier, *lower_multiplier,
        *upper_multiplier; /* rows, unknowns, unknowns; of the last iterate */
    double seconds, linear_seconds, callback_seconds;
} morph_nlp_result;
/* A start for a warm solve: x (unknowns, copied), multipliers zero and for the caller to fill. */
morph_status morph_nlp_result_create(const double *x, int unknowns, int rows, morph_nlp_result *out);
void morph_nlp_result_free(morph_nlp_result *result);

/* Solves from x0 (unknowns; NULL if warm; may be result->x), or warm from *result, which must be zeroed or an
 * earlier result: that is released, also on failure. options NULL: the defaults. MORPH_ERR_INPUT: an option
 * or a start that is not finite, or a warm start of another shape; MORPH_ERR_NONFINITE: derivatives that are
 * not finite and nothing feasible seen. Each thread needs its own problem. Never prints, never reads an
 * option file, never exits. One solve at a time per process (a mutex: MUMPS is not re-entrant). A status
 * other than MORPH_OK means no result (all memory released); an infeasible problem is MORPH_OK with outcome
 * MORPH_INFEASIBLE. */
morph_status morph_nlp_solve(morph_nlp *nlp, const double *x0, const morph_nlp_options *options,
                             morph_nlp_result *result);

/* Central differences against every entry of Jacobian and Hessian of every block at x. The first entry whose
 * error exceeds tolerance * max(1, |entry|, largest entry of its row) is named in message: "length: row 3
 * (link 3 ...), unknown 17: analytic .., numeric ..". */
typedef struct morph_derivative_check {
    bool passed;
    double worst_jacobian, worst_hessian; /* relative errors */
    char message[256];
} morph_derivative_check;
morph_status morph_check_derivatives(const morph_block *blocks, int block_count, const double *x,
                                     int unknowns, double step, double tolerance,
                                     morph_derivative_check *out);

#endif
