/* Cost of the NLP layer on a grid of points with quadratic length rows.
 *
 * For each size: nanoseconds per Jacobian and Hessian nonzero of the assembled callbacks, the same for a loop
 * that streams the same number of entries (read a value and a slot, add into the merged array), the number of
 * emitted entries per nonzero, and one solve with its iterations and the linear solver's share.
 */
#include "../solvers/test_nlp_grid.h"
#include "solvers/nlp_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static morph_nlp *assemble(grid *g) {
    morph_block blocks[2];
    char message[200];
    morph_nlp *nlp = NULL;
    grid_blocks(g, blocks);
    if (morph_nlp_create(3 * g->points, g->x0, NULL, NULL, blocks, 2, message, sizeof message, &nlp) !=
        MORPH_OK)
        fprintf(stderr, "%s\n", message);
    return nlp;
}

/* The least of several timings: what others do on the machine only ever adds. */
enum { BATCHES = 40, REPEATS = 20 };

/* Streams as many entries as a walk emits: adds value[k] into out[slot[k]]. Seconds a pass. */
static double stream(int entries, int nonzeros) {
    double *value = morph_alloc((size_t)entries, sizeof *value),
           *out = morph_alloc((size_t)nonzeros, sizeof *out);
    int *slot = morph_alloc((size_t)entries, sizeof *slot);
    double least = INFINITY;
    if (value && out && slot && nonzeros > 0) {
        for (int k = 0; k < entries; k++) {
            value[k] = k;
            slot[k] = (int)((long)k * nonzeros / entries);
        }
        for (int b = 0; b < BATCHES; b++) {
            const double begin = morph_seconds();
            for (int r = 0; r < REPEATS; r++) {
                memset(out, 0, (size_t)nonzeros * sizeof *out);
                for (int k = 0; k < entries; k++)
                    out[slot[k]] += value[k];
                value[r % entries] = out[r % nonzeros] + 1; /* keeps the loop */
            }
            least = fmin(least, (morph_seconds() - begin) / REPEATS);
        }
    }
    free(value);
    free(out);
    free(slot);
    return least;
}

typedef enum part { ROWS, JACOBIAN, HESSIAN } part;

/* Seconds of one evaluation, each at a new point so that nothing comes from the cache. */
static double evaluation(morph_nlp *nlp, double *x, part what) {
    double least = INFINITY;
    for (int b = 0; b < BATCHES; b++) {
        const double begin = morph_seconds();
        for (int r = 0; r < REPEATS; r++) {
            x[r % nlp->unknowns] += 1e-6;
            if (what == ROWS)
                morph_nlp_rows_at(nlp, x);
            else if (what == JACOBIAN)
                morph_nlp_jacobian_at(nlp, x);
            else
                morph_nlp_hessian_at(nlp, x, 1, nlp->ones, nlp->hessian_value);
        }
        least = fmin(least, (morph_seconds() - begin) / REPEATS);
    }
    return least;
}

static void line(const char *name, double seconds, int entries, int nonzeros) {
    const double base = stream(entries, nonzeros);
    printf("  %-9s %7.2f ns per nonzero, streaming %.2f, ratio %.1f (%.2f entries per nonzero)\n", name,
           1e9 * seconds / nonzeros, 1e9 * base / nonzeros, seconds / base, (double)entries / nonzeros);
}

static void callbacks(morph_nlp *nlp, const double *x0) {
    double *x = morph_alloc((size_t)nlp->unknowns, sizeof *x);
    if (!x) return;
    memcpy(x, x0, (size_t)nlp->unknowns * sizeof *x);
    int jacobian = 0, hessian = 0;
    for (int k = 0; k < nlp->block_count; k++) {
        if (nlp->blocks[k].first_row >= 0) jacobian += nlp->blocks[k].jacobian_count;
        hessian += nlp->blocks[k].hessian_count;
    }
    printf("  rows      %7.2f ns each\n", 1e9 * evaluation(nlp, x, ROWS) / nlp->rows);
    line("Jacobian", evaluation(nlp, x, JACOBIAN), jacobian, nlp->jacobian.count);
    line("Hessian", evaluation(nlp, x, HESSIAN), hessian, nlp->hessian.count);
    free(x);
}

static void solve(morph_nlp *nlp, const double *x0, bool isolated) {
    morph_nlp_options o = morph_nlp_defaults();
    o.isolated = isolated;
    morph_nlp_result r = {0};
    const morph_status status = morph_nlp_solve(nlp, x0, &o, &r);
    if (status != MORPH_OK) {
        printf("  solve     %s\n", morph_status_text(status));
        return;
    }
    printf("  solve     %s (%s)%s, %d iterations, %d evaluations, objective %.9g, violation %.1e\n",
           morph_outcome_text(r.outcome), r.solver_text, isolated ? " in a child process" : "", r.iterations,
           r.evaluations, r.objective, r.violation);
    printf("            %.3f s: linear solver %.1f %%, callbacks %.1f %%; %.1f ms an iteration\n", r.seconds,
           100 * r.linear_seconds / r.seconds, 100 * r.callback_seconds / r.seconds,
           1e3 * r.seconds / (r.iterations > 0 ? r.iterations : 1));
    morph_nlp_result_free(&r);
}

int main(void) {
    morph_blas_threads(1);
    static const int sizes[] = {8, 12, 20, 32};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        grid g;
        const double begin = morph_seconds();
        morph_nlp *nlp = grid_init(&g, sizes[k]) ? assemble(&g) : NULL;
        if (nlp) {
            const morph_nlp_size s = morph_nlp_sizes(nlp);
            printf(
                "%d x %d points: %d unknowns, %d rows, %d Jacobian and %d Hessian nonzeros, created in %.1f "
                "ms\n",
                g.n, g.n, s.unknowns, s.rows, s.jacobian_nonzeros, s.hessian_nonzeros,
                1e3 * (morph_seconds() - begin));
            callbacks(nlp, g.x0);
            solve(nlp, g.x0, false);
            if (k == 0) solve(nlp, g.x0, true);
        }
        morph_nlp_destroy(nlp);
        grid_free(&g);
    }
    return 0;
}
