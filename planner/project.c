#include "planner/project.h"

#include <stdlib.h>
#include <string.h>

/* Posts and panels: the check allows 1e-6. Length, angle, base, self: the check allows rounding only, and the
 * insets pay for the solver's convergence (1e-8 in scaled rows). Clearance: the check allows 1e-3 spacing. */
const double morph_pose_tolerance[MORPH_LIMITS] = {
    [MORPH_LIMIT_POST] = 5e-7,  [MORPH_LIMIT_PANEL] = 5e-7,     [MORPH_LIMIT_LENGTH] = 1e-9,
    [MORPH_LIMIT_ANGLE] = 1e-9, [MORPH_LIMIT_CLEARANCE] = 5e-4, [MORPH_LIMIT_BASE] = 1e-9,
    [MORPH_LIMIT_SELF] = 1e-9};

void morph_effort_add(morph_effort *e, const morph_nlp_result *result) {
    e->solves++;
    e->iterations += result->iterations;
    e->linear_seconds += result->linear_seconds;
    e->callback_seconds += result->callback_seconds;
    if (result->rows > e->rows) {
        e->rows = result->rows;
        e->unknowns = result->unknowns;
        e->jacobian_nonzeros = result->jacobian_nonzeros;
        e->hessian_nonzeros = result->hessian_nonzeros;
    }
}

typedef struct projector {
    const morph_world *world;
    const morph_inset *inset;
    morph_active *active;
    morph_effort *effort;
    double *reference, *base, *lower, *upper;
    int n;
    morph_control quiet; /* the caller's control without its log */
    bool solved;
} projector;

static morph_status solve(projector *p, double *x) {
    morph_block blocks[MORPH_POSE_BLOCKS + 1];
    int count = morph_active_blocks(p->active, p->world, NULL, p->inset, blocks);
    if (count < 0) return MORPH_ERR_NOMEM;
    morph_near_term near = {p->n, p->reference, 1.0};
    blocks[count++] = morph_block_near(&near, NULL);
    morph_nlp *nlp = NULL;
    /* A projection that would have to go further than this is not one; the bounds keep a failing solve from
     * wandering off. */
    const double reach = 1.0;
    morph_pose_box(p->world, p->base, p->reference, reach, p->lower, p->upper);
    morph_status status = morph_nlp_create(p->n, x, p->lower, p->upper, blocks, count, NULL, 0, &nlp);
    if (status != MORPH_OK) return status;
    morph_nlp_result result = {0};
    morph_nlp_options o = morph_nlp_defaults();
    o.tolerance = 1e-5; /* of an objective in spacings^2: moves no joint by a hundredth of a link's radius */
    o.max_iterations = 80;
    o.isolated = true;
    o.control = &p->quiet;
    status = morph_nlp_solve(nlp, x, &o, &result);
    morph_nlp_destroy(nlp);
    if (status == MORPH_OK) {
        morph_effort_add(p->effort, &result);
        memcpy(x, result.x, (size_t)p->n * sizeof *x);
        p->solved = result.outcome == MORPH_OPTIMAL || result.outcome == MORPH_FEASIBLE;
    }
    morph_nlp_result_free(&result);
    return status;
}

morph_status morph_project(const morph_world *world, const morph_inset *inset, int rounds,
                           const morph_control *control, morph_active *active, double *x,
                           morph_violation *violation, morph_effort *effort) {
    projector p = {.world = world,
                   .inset = inset,
                   .active = active,
                   .effort = effort,
                   .n = 3 * world->structure->joints};
    /* Rows enter well before their limits: a projection moves little. */
    const morph_nearness near = {.length = 0.1, .angle = 0.15, .clearance = 0.15, .self = 0.1};
    if (control) p.quiet = *control;
    p.quiet.log = NULL;
    p.quiet.progress = NULL;
    p.reference = morph_alloc((size_t)p.n, sizeof(double));
    p.base = morph_alloc((size_t)p.n, sizeof(double));
    p.lower = morph_alloc((size_t)p.n, sizeof(double));
    p.upper = morph_alloc((size_t)p.n, sizeof(double));
    morph_status status = p.reference && p.base && p.lower && p.upper ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        memcpy(p.reference, x, (size_t)p.n * sizeof *x); /* held joints stay where it has them */
        morph_pose_bounds(world, inset->clearance, p.base);
        morph_active_clear(active, world->structure);
        status = morph_pose_examine(world, x, inset, &near, active, NULL, violation);
    }
    for (int round = 0; round < rounds && status == MORPH_OK; round++) {
        status = solve(&p, x);
        if (status == MORPH_OK) status = morph_pose_examine(world, x, inset, &near, active, NULL, violation);
        if (morph_violation_worst(violation, morph_pose_tolerance, NULL) <= 1.0 && (p.solved || round > 0))
            break;
        if (morph_stopped(control)) break;
    }
    free(p.reference);
    free(p.base);
    free(p.lower);
    free(p.upper);
    return status;
}
