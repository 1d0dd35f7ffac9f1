/* A path as one problem over all its poses: joints as unknowns, or joints and lengths, each with the timing
 * left for later or with durations in the same problem. Rows near their limits only, added where missed;
 * poses inserted where the curve between breaks a limit. For bench_formulations.c only. */
#ifndef MORPH_BENCH_FORMULATION_WHOLE_H
#define MORPH_BENCH_FORMULATION_WHOLE_H

#include "formulation_blocks.h"
#include "planner/path.h"

/* The solvers' private header has a type of the same name as the planner's record. */
#define morph_record morph_walk_record
#include "solvers/nlp_internal.h"
#undef morph_record

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { FORM_POSES = 64, FORM_ROUNDS = 5, FORM_INSERTIONS = 6, FORM_FINE = 12 };

typedef struct form_weights {
    double near;    /* of distance to the first poses, without durations */
    double smooth;  /* of second differences */
    double time;    /* of time over that at the start, with durations */
    double seconds; /* of this process, for all solves together */
} form_weights;

/* What the solves came to; sizes without fixed unknowns, of the largest problem. */
typedef struct form_effort {
    int solves, iterations, unknowns, rows, jacobian, hessian, poses;
    double linear, callbacks;
    morph_outcome outcome; /* of the last */
    char solver[64];
    double violation; /* of its own rows, the last solve */
    char row[160];    /* the worst of them */
} form_effort;

/* Seconds of this process: others on the machine do not count. */
static double form_cpu(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

typedef struct form_whole {
    const morph_world *world;
    form_layout layout;
    form_weights weights;
    double *x, *reference; /* FORM_POSES x width, spacings */
    double s[FORM_POSES], inset[FORM_POSES], duration[FORM_POSES];
    morph_active *active[FORM_POSES];
    form_effort effort;
    double until; /* form_cpu() */
    bool holds;   /* every pose inside its limits */
} form_whole;

static void form_free(form_whole *w) {
    free(w->x);
    free(w->reference);
    for (int k = 0; k < FORM_POSES; k++)
        morph_active_destroy(w->active[k]);
}

static double *form_pose(form_whole *w, int k) {
    return &w->x[(size_t)k * (size_t)form_width(&w->layout)];
}

/* By chord length, as the product's path. */
static void form_set_parameters(form_whole *w) {
    const int n = form_width(&w->layout), last = w->layout.intervals;
    w->s[0] = 0.0;
    for (int k = 1; k <= last; k++) {
        double sum = 0.0;
        for (int i = 0; i < n; i++)
            sum += pow(form_pose(w, k)[i] - form_pose(w, k - 1)[i], 2);
        w->s[k] = w->s[k - 1] + 1e-6 + sqrt(3.0 * sum / n);
    }
    for (int k = 1; k <= last; k++)
        w->s[k] /= w->s[last];
    w->s[last] = 1.0;
}

/* The same room for the spline as the product's path leaves. */
static morph_inset form_inset(const form_whole *w, int k) {
    const morph_path_options o = morph_path_defaults();
    const double f = w->inset[k] * fmin(1.0, (1.0 - w->s[k]) / 0.25);
    const morph_inset *e = &o.end, *i = &o.interior;
    return (morph_inset){e->length + f * (i->length - e->length), e->angle + f * (i->angle - e->angle),
                         e->clearance + f * (i->clearance - e->clearance), e->self + f * (i->self - e->self)};
}

/* The unit of time: what every interval of the poses at hand needs when all are alike. Rates fall with it,
 * accelerations with its square, jerks with its cube. */
static morph_status form_set_unit(form_whole *w) {
    form_layout l = w->layout;
    l.lengths = l.even = false;
    l.durations = true;
    l.unit = 1.0;
    const size_t n = (size_t)form_unknowns(&l);
    double *x = morph_alloc(n, sizeof *x);
    if (!x) return MORPH_ERR_NOMEM;
    memcpy(x, w->x, (size_t)form_duration_at(&l) * sizeof *x);
    for (int k = 0; k < l.intervals; k++)
        x[form_duration_of(&l, k)] = 1.0;
    w->layout.unit = 1e-3; /* where nothing moves */
    for (int row = 0; row < form_motion_rows(&l); row++) {
        const form_row r = form_row_of(&l, row);
        const double ratio = fabs(form_row_jet(&l, &r, x, false).v);
        w->layout.unit = fmax(w->layout.unit, pow(ratio, 1.0 / r.order));
    }
    free(x);
    return MORPH_OK;
}

/* Poses evenly between start and end, joint by joint, spacings. */
static void form_first_poses(form_whole *w, const double *start, const double *end) {
    form_layout *l = &w->layout;
    const int n = form_width(l);
    const double a = l->structure->spacing;
    for (int k = 0; k <= l->intervals; k++) {
        const double t = (double)k / l->intervals;
        for (int i = 0; i < n; i++)
            form_pose(w, k)[i] = ((1.0 - t) * start[i] + t * end[i]) / a;
        w->inset[k] = w->duration[k] = 1.0;
    }
    memcpy(w->reference, w->x, (size_t)(l->intervals + 1) * (size_t)n * sizeof *w->x);
    form_set_parameters(w);
}

static morph_status form_create(const morph_world *world, const form_layout *layout,
                                const form_weights *weights, const double *start, const double *end,
                                form_whole *w) {
    *w = (form_whole){
        .world = world, .layout = *layout, .weights = *weights, .until = form_cpu() + weights->seconds};
    w->layout.structure = world->structure;
    w->x = morph_alloc(FORM_POSES * (size_t)form_width(&w->layout), sizeof(double));
    w->reference = morph_alloc(FORM_POSES * (size_t)form_width(&w->layout), sizeof(double));
    morph_status status = w->x && w->reference ? MORPH_OK : MORPH_ERR_NOMEM;
    for (int k = 0; k < FORM_POSES && status == MORPH_OK; k++)
        status = morph_active_create(world->structure, &w->active[k]);
    if (status == MORPH_OK) form_first_poses(w, start, end);
    return status;
}

/* One problem in the making. */
typedef struct form_problem {
    double *x, *lower, *upper, *motion_lower, *motion_upper, *zeros;
    int *map;  /* poses x (width + links) */
    int *list; /* rows of motion */
    morph_block *block;
    morph_near_term near[FORM_POSES];
    form_smooth smooth;
    form_time time;
    form_motion motion;
    int blocks;
} form_problem;

static void form_problem_free(form_problem *p) {
    free(p->x);
    free(p->lower);
    free(p->upper);
    free(p->motion_lower);
    free(p->motion_upper);
    free(p->zeros);
    free(p->map);
    free(p->list);
    free(p->block);
}

static morph_status form_problem_allocate(const form_layout *l, form_problem *p) {
    *p = (form_problem){0};
    const size_t n = (size_t)form_unknowns(l), poses = (size_t)l->intervals + 1;
    const size_t each = (size_t)form_width(l) + (size_t)l->structure->links;
    p->x = morph_alloc(n, sizeof(double));
    p->lower = morph_alloc(n, sizeof(double));
    p->upper = morph_alloc(n, sizeof(double));
    p->motion_lower = morph_alloc((size_t)form_motion_rows(l), sizeof(double));
    p->motion_upper = morph_alloc((size_t)form_motion_rows(l), sizeof(double));
    p->zeros = morph_alloc((size_t)l->structure->links, sizeof(double));
    p->map = morph_alloc(poses * each, sizeof(int));
    p->list = morph_alloc((size_t)form_motion_rows(l), sizeof(int));
    p->block = morph_alloc(poses * (MORPH_POSE_BLOCKS + 2) + 3, sizeof(morph_block));
    return p->x && p->lower && p->upper && p->motion_lower && p->motion_upper && p->zeros && p->map &&
                   p->list && p->block
               ? MORPH_OK
               : MORPH_ERR_NOMEM;
}

/* Joints within 2 spacings of the first poses, so that a failing solve does not wander off. */
static void form_bound_pose(form_whole *w, form_problem *p, int k) {
    const form_layout *l = &w->layout;
    const int n = form_width(l), at = k * n;
    const double *x = form_pose(w, k), *y = &w->reference[(size_t)at], reach = 2.0;
    const bool fixed = k == 0 || k == l->intervals;
    memcpy(&p->x[at], x, (size_t)n * sizeof *x);
    morph_pose_bounds(w->world, form_inset(w, k).clearance, &p->lower[at]);
    for (int i = 0; i < n; i++) {
        const double base = p->lower[at + i];
        p->lower[at + i] = fixed ? x[i] : fmax(base, y[i] - reach);
        p->upper[at + i] = fixed ? x[i] : fmax(base, y[i]) + reach;
    }
    for (int m = 0; m < l->structure->links && l->lengths; m++) {
        const double *limit = l->structure->length_limit[m], margin = form_inset(w, k).length;
        const int *ends = l->structure->link[m], u = form_length_at(l, k) + m;
        double lo = limit[0] / l->structure->spacing + margin, hi = limit[1] / l->structure->spacing - margin;
        if (lo > hi) lo = hi = 0.5 * (lo + hi);
        p->x[u] = morph_dist(&x[3 * ends[0]], &x[3 * ends[1]]);
        p->lower[u] = fixed ? p->x[u] : lo;
        p->upper[u] = fixed ? p->x[u] : hi;
    }
}

/* Rows of an inner pose: the product's blocks; with lengths as unknowns, theirs in place of length rows. */
static morph_status form_pose_rows(form_whole *w, form_problem *p, int k) {
    const form_layout *l = &w->layout;
    const int n = form_width(l), links = l->structure->links;
    int *map = &p->map[k * (n + links)];
    for (int i = 0; i < n; i++)
        map[i] = k * n + i;
    for (int m = 0; m < links && l->lengths; m++)
        map[n + m] = form_length_at(l, k) + m;
    const morph_inset inset = form_inset(w, k);
    morph_block rows[MORPH_POSE_BLOCKS];
    const int count = morph_active_blocks(w->active[k], w->world, map, &inset, rows);
    if (count < 0) return MORPH_ERR_NOMEM;
    for (int b = 0; b < count; b++)
        if (!l->lengths || strcmp(rows[b].name, "length") != 0) p->block[p->blocks++] = rows[b];
    if (l->lengths) p->block[p->blocks++] = form_block_links(l->structure, map, p->zeros);
    if (!l->durations) {
        p->near[k] = (morph_near_term){n, &w->reference[(size_t)k * (size_t)n], w->weights.near};
        p->block[p->blocks++] = morph_block_near(&p->near[k], map);
    }
    return MORPH_OK;
}

static morph_status form_problem_fill(form_whole *w, form_problem *p) {
    form_layout *l = &w->layout;
    morph_status status = form_problem_allocate(l, p);
    for (int k = 0; k <= l->intervals && status == MORPH_OK; k++) {
        form_bound_pose(w, p, k);
        if (k > 0 && k < l->intervals) status = form_pose_rows(w, p, k);
    }
    if (status != MORPH_OK) return status;
    p->smooth = (form_smooth){l, w->weights.smooth};
    p->block[p->blocks++] = form_block_smooth(&p->smooth);
    if (!l->durations) return MORPH_OK;
    for (int k = 0; k < form_durations(l); k++) {
        const int u = form_duration_of(l, k);
        p->x[u] = w->duration[k];
        /* Where it starts is slow: neither end is of use. */
        p->lower[u] = 0.1;
        p->upper[u] = 2.0;
    }
    p->time = (form_time){l, w->weights.time};
    p->block[p->blocks++] = form_block_time(&p->time);
    /* All of them: with those near their limits alone a solve runs away through the others, whose least time
     * has no bound of its own. */
    for (int row = 0; row < form_motion_rows(l); row++)
        p->list[row] = row;
    p->motion = (form_motion){l, form_motion_rows(l), p->list};
    p->block[p->blocks++] = form_block_motion(&p->motion, p->motion_lower, p->motion_upper);
    return MORPH_OK;
}

/* Nonzeros in columns that are not fixed; of a Hessian, neither may be. */
static int form_count(const morph_nlp *nlp, const morph_pattern *pattern, bool hessian) {
    int count = 0;
    for (int k = 0; k < pattern->count; k++) {
        const int i = pattern->row[k], j = pattern->column[k];
        count += nlp->lower[j] < nlp->upper[j] && (!hessian || nlp->lower[i] < nlp->upper[i]);
    }
    return count;
}

static void form_note(form_whole *w, const morph_nlp *nlp, const morph_nlp_result *r) {
    form_effort *e = &w->effort;
    e->solves++;
    e->iterations += r->iterations;
    e->linear += r->linear_seconds;
    e->callbacks += r->callback_seconds;
    e->outcome = r->outcome;
    e->violation = r->violation;
    e->poses = w->layout.intervals + 1;
    snprintf(e->solver, sizeof e->solver, "%s", r->solver_text);
    snprintf(e->row, sizeof e->row, "none");
    if (r->worst_row >= 0) morph_nlp_row_name(nlp, r->worst_row, e->row, sizeof e->row);
    if (nlp->rows < e->rows) return;
    e->rows = nlp->rows;
    e->unknowns = 0;
    for (int i = 0; i < nlp->unknowns; i++)
        e->unknowns += nlp->lower[i] < nlp->upper[i];
    e->jacobian = form_count(nlp, &nlp->jacobian, false);
    e->hessian = form_count(nlp, &nlp->hessian, true);
}

/* The options of all formulations: those of the product's projections (planner/project.c), but for the
 * number of iterations, which one problem in place of many cannot do with. */
static morph_nlp_options form_options(const morph_control *control) {
    morph_nlp_options o = morph_nlp_defaults();
    o.tolerance = 1e-5;
    o.control = control;
    return o;
}

static int form_late(void *user) {
    return form_cpu() > ((const form_whole *)user)->until;
}

static morph_status form_solve(form_whole *w, bool *solved) {
    form_problem p;
    const form_layout *l = &w->layout;
    morph_nlp *nlp = NULL;
    char message[256] = "";
    morph_status status = form_problem_fill(w, &p);
    if (status == MORPH_OK)
        status = morph_nlp_create(form_unknowns(l), p.x, p.lower, p.upper, p.block, p.blocks, message,
                                  sizeof message, &nlp);
    if (status == MORPH_ERR_INPUT) fprintf(stderr, "%s\n", message);
    const morph_control control = {.stop = form_late, .user = w};
    const morph_nlp_options o = form_options(&control);
    morph_nlp_result r = {0};
    if (status == MORPH_OK) status = morph_nlp_solve(nlp, p.x, &o, &r);
    if (status == MORPH_OK) {
        form_note(w, nlp, &r);
        const size_t all = (size_t)(l->intervals + 1) * (size_t)form_width(l);
        memcpy(w->x, r.x, all * sizeof *w->x);
        for (int k = 0; k < form_durations(l); k++)
            w->duration[k] = r.x[form_duration_of(l, k)];
        *solved = r.outcome == MORPH_OPTIMAL || r.outcome == MORPH_FEASIBLE;
    }
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
    form_problem_free(&p);
    return status;
}

/* Examines every inner pose exactly and takes in the rows that it stands near or breaks. */
static morph_status form_examine(form_whole *w, bool *inside) {
    /* As the product's projections. */
    const morph_nearness near = {.length = 0.1, .angle = 0.15, .clearance = 0.15, .self = 0.1};
    morph_status status = MORPH_OK;
    *inside = true;
    for (int k = 1; k < w->layout.intervals && status == MORPH_OK; k++) {
        const morph_inset inset = form_inset(w, k);
        morph_violation v;
        status = morph_pose_examine(w->world, form_pose(w, k), &inset, &near, w->active[k], NULL, &v);
        *inside = *inside && morph_violation_worst(&v, morph_pose_tolerance, NULL) <= 1.0;
    }
    return status;
}

/* Solves, examines, adds what was missed. */
static morph_status form_settle(form_whole *w) {
    bool inside, solved = false;
    for (int k = 0; k <= w->layout.intervals; k++)
        morph_active_clear(w->active[k], w->world->structure);
    morph_status status = form_examine(w, &inside);
    w->holds = false;
    for (int round = 0; round < FORM_ROUNDS && status == MORPH_OK && !w->holds; round++) {
        if (form_late(w)) break;
        status = form_solve(w, &solved);
        if (status == MORPH_OK) status = form_examine(w, &inside);
        w->holds = inside && solved;
    }
    return status;
}

static morph_status form_draw(form_whole *w, morph_curve **curve) {
    const size_t all = (size_t)(w->layout.intervals + 1) * (size_t)form_width(&w->layout);
    double *metres = morph_alloc(all, sizeof *metres);
    if (!metres) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < all; i++)
        metres[i] = w->x[i] * w->world->structure->spacing;
    morph_curve_destroy(*curve);
    const morph_status status =
        morph_curve_create(w->world->structure, w->s, metres, w->layout.intervals + 1, curve);
    free(metres);
    return status;
}

/* Worst violation over FORM_FINE points of every interval of any curve; worst (may be NULL): of each
 * interval, over the tolerances. */
static morph_status form_between(const morph_world *world, const morph_curve *c, morph_violation *all,
                                 double *worst) {
    const int n = 3 * world->structure->joints;
    double *scratch = morph_alloc((size_t)morph_pose_width(world->structure), sizeof(double));
    double *x = morph_alloc((size_t)n, sizeof(double));
    morph_status status = scratch && x ? MORPH_OK : MORPH_ERR_NOMEM;
    for (int m = 0; m < MORPH_LIMITS; m++)
        all->amount[m] = -INFINITY;
    for (int k = 0; k + 1 < c->poses; k++) {
        if (worst) worst[k] = -INFINITY;
        for (int f = 0; f <= FORM_FINE && status == MORPH_OK; f++) {
            morph_violation v;
            morph_curve_joints(c, c->s[k] + (c->s[k + 1] - c->s[k]) * f / FORM_FINE, 0, scratch, x);
            for (int i = 0; i < n; i++)
                x[i] /= world->structure->spacing;
            status = morph_pose_examine(world, x, NULL, NULL, NULL, NULL, &v);
            if (worst) worst[k] = fmax(worst[k], morph_violation_worst(&v, morph_pose_tolerance, NULL));
            for (int m = 0; m < MORPH_LIMITS; m++)
                if (v.amount[m] > all->amount[m]) {
                    all->amount[m] = v.amount[m];
                    memcpy(all->element[m], v.element[m], sizeof v.element[m]);
                }
        }
    }
    free(scratch);
    free(x);
    return status;
}

static void form_insert(form_whole *w, const morph_curve *c, double *scratch, int k) {
    const size_t n = (size_t)form_width(&w->layout), after = (size_t)(w->layout.intervals - k);
    const size_t at = (size_t)(k + 1);
    memmove(&w->x[(at + 1) * n], &w->x[at * n], after * n * sizeof *w->x);
    memmove(&w->reference[(at + 1) * n], &w->reference[at * n], after * n * sizeof *w->x);
    memmove(&w->inset[at + 1], &w->inset[at], after * sizeof *w->inset);
    memmove(&w->duration[at + 1], &w->duration[at], after * sizeof *w->duration);
    memmove(&w->s[at + 1], &w->s[at], after * sizeof *w->s);
    w->layout.intervals++;
    w->s[at] = 0.5 * (w->s[k] + w->s[at + 1]);
    morph_curve_joints(c, w->s[at], 0, scratch, &w->x[at * n]);
    for (size_t i = 0; i < n; i++) {
        w->x[at * n + i] /= w->world->structure->spacing;
        w->reference[at * n + i] = 0.5 * (w->reference[(at - 1) * n + i] + w->reference[(at + 1) * n + i]);
    }
    w->inset[at] = 0.5 * (w->inset[k] + w->inset[at + 1]);
    if (!w->layout.even) w->duration[k] = w->duration[at] = 0.5 * w->duration[k];
}

/* Inserts a pose into every interval that breaks a limit, as the product's path does. */
static morph_status form_mend(form_whole *w, const morph_curve *c, const double *worst, bool *changed) {
    double *scratch = morph_alloc((size_t)morph_pose_width(w->world->structure), sizeof(double));
    if (!scratch) return MORPH_ERR_NOMEM;
    *changed = false;
    for (int k = w->layout.intervals - 1; k >= 0; k--)
        if (worst[k] > 1.0 && w->layout.intervals + 1 < FORM_POSES && w->s[k + 1] - w->s[k] > 4e-3) {
            form_insert(w, c, scratch, k);
            *changed = true;
        }
    free(scratch);
    return MORPH_OK;
}

/* With durations the start is the path of least smoothness at a pace that holds every limit: inside all rows.
 */
static morph_status form_start(form_whole *w) {
    if (!w->layout.durations) return MORPH_OK;
    w->layout.durations = false;
    morph_status status = form_settle(w);
    w->layout.durations = true;
    form_set_parameters(w);
    memcpy(w->reference, w->x,
           (size_t)(w->layout.intervals + 1) * (size_t)form_width(&w->layout) * sizeof *w->x);
    return status == MORPH_OK ? form_set_unit(w) : status;
}

/* The whole path: *curve is returned also where it does not hold. */
static morph_status form_run(form_whole *w, morph_curve **curve) {
    morph_status status = form_start(w);
    bool changed = true;
    for (int round = 0; round <= FORM_INSERTIONS && changed && status == MORPH_OK; round++) {
        double worst[FORM_POSES];
        morph_violation v;
        changed = false;
        status = form_settle(w);
        form_set_parameters(w);
        if (status == MORPH_OK) status = form_draw(w, curve);
        if (status == MORPH_OK) status = form_between(w->world, *curve, &v, worst);
        if (status == MORPH_OK && w->holds && round < FORM_INSERTIONS && !form_late(w))
            status = form_mend(w, *curve, worst, &changed);
    }
    return status;
}

#endif
