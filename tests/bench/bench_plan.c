/* Cost of a plan, stage by stage, and of the refinement's problem at its first round: bench_plan [SCENE].
 *
 * Prints nanoseconds per Jacobian and Hessian nonzero of the assembled callbacks beside a loop that streams
 * as many entries, rows used of those possible, the linear solver's share, seconds per stage, peak memory.
 */
#include "planner/plan.h"

/* The solvers' private header has a type of the same name as the planner's record. */
#define morph_record morph_walk_record
#include "solvers/nlp_internal.h"
#undef morph_record

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The least of several timings: what others do on the machine only ever adds. */
enum { BATCHES = 20, REPEATS = 10 };

/* Streams as many entries as a walk emits: adds value[k] into out[slot[k]]. Seconds a pass. */
static double stream(int entries, int nonzeros) {
    double *value = morph_alloc((size_t)entries, sizeof *value),
           *out = morph_alloc((size_t)nonzeros, sizeof *out);
    int *slot = morph_alloc((size_t)entries, sizeof *slot);
    double least = INFINITY;
    if (value && out && slot && entries > 0 && nonzeros > 0) {
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
            x[r % nlp->unknowns] += 1e-9;
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
    if (nonzeros < 1) return;
    const double base = stream(entries, nonzeros);
    printf("  %-9s %8.1f ns per nonzero, streaming %.2f, ratio %.0f (%.1f entries per nonzero)\n", name,
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
    printf("  rows      %8.1f ns each\n", 1e9 * evaluation(nlp, x, ROWS) / nlp->rows);
    line("Jacobian", evaluation(nlp, x, JACOBIAN), jacobian, nlp->jacobian.count);
    line("Hessian", evaluation(nlp, x, HESSIAN), hessian, nlp->hessian.count);
    free(x);
}

static void solve(morph_nlp *nlp, const double *x0) {
    morph_nlp_options o = morph_nlp_defaults();
    o.tolerance = 1e-4;
    o.max_iterations = 60;
    o.adaptive_mu = false;
    o.mu_init = 1e-3;
    morph_nlp_result r = {0};
    if (morph_nlp_solve(nlp, x0, &o, &r) != MORPH_OK) return;
    printf(
        "  solve     %s, %d iterations, %.3f s: linear solver %.1f %%, callbacks %.1f %%; %.1f ms an "
        "iteration\n",
        morph_outcome_text(r.outcome), r.iterations, r.seconds, 100.0 * r.linear_seconds / r.seconds,
        100.0 * r.callback_seconds / r.seconds, 1e3 * r.seconds / (r.iterations > 0 ? r.iterations : 1));
    morph_nlp_result_free(&r);
}

/* What the first round of the refinement is made of. */
typedef struct round_one {
    const morph_world *world;
    morph_active *active;
    double *x, *metres, *lower, *upper, *anchor;
    int (*joint)[3];
    double (*weight)[3];
} round_one;

static void round_free(round_one *r) {
    morph_active_destroy(r->active);
    free(r->x);
    free(r->metres);
    free(r->lower);
    free(r->upper);
    free(r->anchor);
    free(r->joint);
    free(r->weight);
}

static bool round_allocate(round_one *r, const morph_world *world) {
    const size_t n = 3 * (size_t)world->structure->joints, y = (size_t)world->cavity->exposed;
    *r = (round_one){.world = world};
    r->x = morph_alloc(n, sizeof(double));
    r->metres = morph_alloc(n, sizeof(double));
    r->lower = morph_alloc(n, sizeof(double));
    r->upper = morph_alloc(n, sizeof(double));
    r->anchor = morph_alloc(n, sizeof(double));
    r->joint = morph_alloc(y, sizeof(int[3]));
    r->weight = morph_alloc(y, sizeof(double[3]));
    return r->x && r->metres && r->lower && r->upper && r->anchor && r->joint && r->weight &&
           morph_active_create(world->structure, &r->active) == MORPH_OK;
}

/* The start moved inside the limits, then rows, bounds and terms as the refinement chooses them. */
static void measure_round(round_one *r, const double *start) {
    const morph_structure *s = r->world->structure;
    const morph_refine_options o = morph_refine_defaults();
    const int n = 3 * s->joints;
    const double m = o.reach;
    const morph_nearness near = {.length = 2.0 * m, .angle = 2.5 * m, .clearance = 1.2 * m, .self = 0.6 * m};
    morph_violation v;
    morph_effort effort = {0};
    for (int i = 0; i < n; i++)
        r->x[i] = start[i] / s->spacing;
    morph_pose_bounds(r->world, o.inset.clearance, r->lower);
    if (morph_project(r->world, &o.inset, 8, NULL, r->active, r->x, &v, &effort) != MORPH_OK) return;
    for (int i = 0; i < n; i++) {
        r->metres[i] = r->x[i] * s->spacing;
        r->anchor[i] = r->x[i];
        r->lower[i] = fmax(r->lower[i], r->x[i] - m);
        r->upper[i] = fmax(r->lower[i], r->x[i]) + m;
    }
    morph_active_clear(r->active, s);
    if (morph_pose_examine(r->world, r->x, &o.inset, &near, r->active, NULL, &v) != MORPH_OK ||
        morph_cavity_closest(r->world->cavity, r->metres, r->joint, r->weight, NULL) != MORPH_OK)
        return;
    morph_block blocks[MORPH_POSE_BLOCKS + 3];
    int count = morph_active_blocks(r->active, r->world, NULL, &o.inset, blocks);
    if (count < 0) return;
    morph_near_term hold = {n, r->anchor, o.hold};
    morph_gap_term gap = {r->world->cavity, r->world->sdf, 0.1, 1.0, true};
    morph_cover_term cover = {
        r->world->cavity, (const int(*)[3])r->joint, (const double(*)[3])r->weight, o.slide, o.press,
        o.cover_weight};
    blocks[count++] = morph_block_near(&hold, NULL);
    blocks[count++] = morph_block_gap(&gap, NULL);
    blocks[count++] = morph_block_cover(&cover, NULL);
    morph_nlp *nlp = NULL;
    char message[256] = "";
    if (morph_nlp_create(n, r->x, r->lower, r->upper, blocks, count, message, sizeof message, &nlp) !=
        MORPH_OK) {
        fprintf(stderr, "%s\n", message);
        return;
    }
    const morph_nlp_size size = morph_nlp_sizes(nlp);
    const int possible = morph_possible_rows(s);
    printf(
        "refinement, first round: %d unknowns, %d rows of %d possible (%.1f %%), %d Jacobian and %d Hessian "
        "nonzeros\n",
        size.unknowns, size.rows, possible, 100.0 * size.rows / possible, size.jacobian_nonzeros,
        size.hessian_nonzeros);
    callbacks(nlp, r->x);
    solve(nlp, r->x);
    morph_nlp_destroy(nlp);
}

static void first_round(const morph_scene *scene) {
    morph_workspace w;
    if (morph_workspace_create(scene, NULL, &w) != MORPH_OK) return;
    const morph_blanket_def def = morph_scene_blanket(scene, w.structure);
    morph_trajectory t = {0};
    round_one r = {0};
    if (morph_blanket_run(w.structure, w.sdf, w.exact, &def, w.start, NULL, &t, NULL) == MORPH_OK &&
        round_allocate(&r, &w.world))
        measure_round(&r, &t.x[(size_t)(t.frames - 1) * 3 * (size_t)w.structure->joints]);
    round_free(&r);
    morph_trajectory_free(&t);
    morph_workspace_free(&w);
}

static void whole_plan(const morph_scene *scene) {
    const morph_plan_options o = {.method = MORPH_METHOD_IPOPT};
    morph_plan *plan = NULL;
    const morph_status status = morph_plan_run(scene, &o, &plan);
    if (status != MORPH_OK) {
        fprintf(stderr, "plan: %s\n", morph_status_text(status));
        return;
    }
    const morph_summary *s = &plan->summary;
    printf("plan: %s, %.2f s, peak memory %.0f MB\n", s->outcome, s->total_seconds,
           (double)s->peak_memory_bytes / 1048576.0);
    for (int k = 0; k < MORPH_STAGES; k++)
        if (s->seconds[k] > 0.0)
            printf("  %-9s %8.3f s  %5.1f %%\n", morph_stage_name((morph_stage)k), s->seconds[k],
                   100.0 * s->seconds[k] / s->total_seconds);
    const double solving =
        s->seconds[MORPH_STAGE_REFINE] + s->seconds[MORPH_STAGE_PATH] + s->seconds[MORPH_STAGE_TIMING];
    printf("  of refine, path and timing: linear solver %.1f %%, callbacks of refine and path %.1f %%\n",
           100.0 * s->linear_seconds / solving, 100.0 * s->callback_seconds / solving);
    printf("  iterations: refine %d, path %d, timing %d\n", s->iterations_refine, s->iterations_path,
           s->iterations_timing);
    printf("  rows used of possible: refine %d of %d, a path's pose %d of %d\n", s->rows_refine_used,
           s->rows_refine_possible, s->rows_path_used, s->rows_path_possible);
    morph_plan_destroy(plan);
}

static void say(void *user, const char *text) {
    (void)user;
    fprintf(stderr, "%s\n", text);
}

int main(int argc, char **argv) {
    const char *path = argc > 1 ? argv[1] : "examples/scenes/box_8.yaml";
    morph_scene *scene = NULL;
    morph_blas_threads(1);
    if (morph_scene_read(path, say, say, NULL, &scene) != MORPH_OK) return 2;
    printf("%s: %d x %d nodes\n", path, scene->structure.nodes[0], scene->structure.nodes[1]);
    first_round(scene);
    whole_plan(scene);
    morph_scene_destroy(scene);
    return 0;
}
