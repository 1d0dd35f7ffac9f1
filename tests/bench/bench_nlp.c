/* Cost of the NLP layer on a grid of points with quadratic length rows.
 *
 * For each size: nanoseconds per Jacobian and Hessian nonzero of the assembled callbacks, the same for a loop
 * that streams the same number of entries (read a value and a slot, add into the merged array), the number of
 * emitted entries per nonzero, and one solve with its iterations and the linear solver's share.
 *
 * The problem: n x n points in space, each linked to its right, lower and two diagonal neighbours; |d|^2 /
 * L^2 in [0.8^2, 1.25^2]; minimise the squared distance of the heights to a dome. */
#include "solvers/nlp_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct grid {
    int n, points, links;
    int (*link)[2];
    double *length2; /* squared rest lengths */
    double *x0, *lower, *upper, *target;
} grid;

static morph_status grid_length(void *data, const double *x, double *f) {
    const grid *g = data;
    for (int k = 0; k < g->links; k++) {
        const double *a = x + 3 * g->link[k][0], *b = x + 3 * g->link[k][1];
        double d[3];
        morph_sub(b, a, d);
        f[k] = morph_dot(d, d) / g->length2[k];
    }
    return MORPH_OK;
}

static morph_status grid_length_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    const grid *g = data;
    const bool first = morph_sink_wants_jacobian(s), second = morph_sink_wants_hessian(s);
    for (int k = 0; k < g->links; k++)
        for (int axis = 0; axis < 3; axis++) {
            const int a = 3 * g->link[k][0] + axis, b = 3 * g->link[k][1] + axis;
            const double c = 2 / g->length2[k];
            if (first) {
                morph_sink_jacobian(s, k, a, -c * (x[b] - x[a]));
                morph_sink_jacobian(s, k, b, c * (x[b] - x[a]));
            }
            if (second) {
                morph_sink_hessian(s, a, a, c * weight[k]);
                morph_sink_hessian(s, b, b, c * weight[k]);
                morph_sink_hessian(s, b, a, -c * weight[k]);
            }
        }
    return MORPH_OK;
}

static morph_status grid_height(void *data, const double *x, double *f) {
    const grid *g = data;
    f[0] = 0;
    for (int p = 0; p < g->points; p++)
        f[0] += 0.5 * (x[3 * p + 2] - g->target[p]) * (x[3 * p + 2] - g->target[p]);
    return MORPH_OK;
}

static morph_status grid_height_walk(void *data, const double *x, const double *weight, morph_sink *s) {
    const grid *g = data;
    for (int p = 0; p < g->points; p++) {
        morph_sink_jacobian(s, 0, 3 * p + 2, x[3 * p + 2] - g->target[p]);
        morph_sink_hessian(s, 3 * p + 2, 3 * p + 2, weight[0]);
    }
    return MORPH_OK;
}

static void grid_free(grid *g) {
    free(g->link);
    free(g->length2);
    free(g->x0);
    free(g->lower);
    free(g->upper);
    free(g->target);
}

static void link_up(grid *g, int a, int b, double length2) {
    g->link[g->links][0] = a;
    g->link[g->links][1] = b;
    g->length2[g->links] = length2;
    g->lower[g->links] = 0.8 * 0.8;
    g->upper[g->links] = 1.25 * 1.25;
    g->links++;
}

static bool grid_init(grid *g, int n) {
    *g = (grid){.n = n, .points = n * n};
    const size_t most = 4 * (size_t)g->points, size = sizeof(double);
    g->link = morph_alloc(most, sizeof *g->link);
    g->length2 = morph_alloc(most, size);
    g->lower = morph_alloc(most, size);
    g->upper = morph_alloc(most, size);
    g->x0 = morph_alloc(3 * (size_t)g->points, size);
    g->target = morph_alloc((size_t)g->points, size);
    if (!g->link || !g->length2 || !g->lower || !g->upper || !g->x0 || !g->target) return false;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int p = j * n + i;
            const double u = 2.0 * i / (n - 1) - 1, v = 2.0 * j / (n - 1) - 1;
            g->x0[3 * p] = i;
            g->x0[3 * p + 1] = j;
            g->target[p] = 0.3 * n * (1 - u * u) * (1 - v * v);
            if (i + 1 < n) link_up(g, p, p + 1, 1);
            if (j + 1 < n) link_up(g, p, p + n, 1);
            if (i + 1 < n && j + 1 < n) link_up(g, p, p + n + 1, 2);
            if (i > 0 && j + 1 < n) link_up(g, p, p + n - 1, 2);
        }
    return true;
}

static morph_nlp *assemble(grid *g) {
    const morph_block blocks[2] = {{.name = "height",
                                    .unknowns = 3 * g->points,
                                    .data = g,
                                    .value = grid_height,
                                    .walk = grid_height_walk},
                                   {.name = "length",
                                    .rows = g->links,
                                    .unknowns = 3 * g->points,
                                    .lower = g->lower,
                                    .upper = g->upper,
                                    .data = g,
                                    .value = grid_length,
                                    .walk = grid_length_walk}};
    char message[200];
    morph_nlp *nlp = NULL;
    if (morph_nlp_create(3 * g->points, g->x0, NULL, NULL, blocks, 2, message, sizeof message, &nlp) !=
        MORPH_OK)
        fprintf(stderr, "%s\n", message);
    return nlp;
}

/* Streams as many entries as a walk emits: adds value[k] into out[slot[k]]. */
static double stream(int entries, int nonzeros, int repeats) {
    double *value = morph_alloc((size_t)entries, sizeof *value),
           *out = morph_alloc((size_t)nonzeros, sizeof *out);
    int *slot = morph_alloc((size_t)entries, sizeof *slot);
    double seconds = NAN;
    if (value && out && slot && nonzeros > 0) {
        for (int k = 0; k < entries; k++) {
            value[k] = k;
            slot[k] = (int)((long)k * nonzeros / entries);
        }
        const double begin = morph_seconds();
        for (int r = 0; r < repeats; r++) {
            memset(out, 0, (size_t)nonzeros * sizeof *out);
            for (int k = 0; k < entries; k++)
                out[slot[k]] += value[k];
            value[r % entries] = out[r % nonzeros] + 1; /* keeps the loop */
        }
        seconds = (morph_seconds() - begin) / repeats;
    }
    free(value);
    free(out);
    free(slot);
    return seconds;
}

static void callbacks(morph_nlp *nlp, const double *x0) {
    const int repeats = 2000, n = nlp->unknowns;
    double *x = morph_alloc((size_t)n, sizeof *x), begin;
    if (!x) return;
    memcpy(x, x0, (size_t)n * sizeof *x);
    double jacobian = 0, hessian = 0, value = 0;
    for (int r = 0; r < repeats; r++) {
        x[r % n] += 1e-3; /* another point: nothing comes from the cache */
        begin = morph_seconds();
        morph_nlp_rows_at(nlp, x);
        value += morph_seconds() - begin;
        begin = morph_seconds();
        morph_nlp_jacobian_at(nlp, x);
        jacobian += morph_seconds() - begin;
        begin = morph_seconds();
        morph_nlp_hessian_at(nlp, x, 1, nlp->ones, nlp->hessian_value);
        hessian += morph_seconds() - begin;
    }
    int jacobian_entries = 0, hessian_entries = 0;
    for (int k = 0; k < nlp->block_count; k++) {
        if (nlp->blocks[k].first_row >= 0) jacobian_entries += nlp->blocks[k].jacobian_count;
        hessian_entries += nlp->blocks[k].hessian_count;
    }
    const double js = stream(jacobian_entries, nlp->jacobian.count, repeats),
                 hs = stream(hessian_entries, nlp->hessian.count, repeats);
    const double jn = 1e9 / nlp->jacobian.count, hn = 1e9 / nlp->hessian.count;
    printf("  rows      %7.2f ns each\n", 1e9 * value / repeats / nlp->rows);
    printf("  Jacobian  %7.2f ns per nonzero, streaming %.2f, ratio %.1f (%.2f entries per nonzero)\n",
           jn * jacobian / repeats, jn * js, jacobian / repeats / js,
           (double)jacobian_entries / nlp->jacobian.count);
    printf("  Hessian   %7.2f ns per nonzero, streaming %.2f, ratio %.1f (%.2f entries per nonzero)\n",
           hn * hessian / repeats, hn * hs, hessian / repeats / hs,
           (double)hessian_entries / nlp->hessian.count);
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
