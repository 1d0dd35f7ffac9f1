#include "planner/reference.h"

#include <stdlib.h>
#include <string.h>

/* Refinements in a row from one start. */
enum { PASSES = 3 };

/* The check's tolerances in the scaled terms of a violation (its own for the base is in metres). */
void morph_reference_tolerance(const morph_structure *s, double tolerance[MORPH_LIMITS]) {
    tolerance[MORPH_LIMIT_POST] = tolerance[MORPH_LIMIT_PANEL] = 1e-6;
    tolerance[MORPH_LIMIT_LENGTH] = tolerance[MORPH_LIMIT_ANGLE] = tolerance[MORPH_LIMIT_SELF] = 1e-9;
    tolerance[MORPH_LIMIT_CLEARANCE] = 1e-3;
    tolerance[MORPH_LIMIT_BASE] = 1e-6 / s->spacing;
}

morph_status morph_reference_structure(const morph_structure *s, morph_structure **out) {
    morph_structure_def def = s->def;
    const double straight = acos(-1.0);
    for (int kind = 0; kind < 3; kind++) {
        const double unit = kind == MORPH_LINK_BRACE ? 1.0 : def.spacing;
        def.length[kind][0] = fmin(def.length[kind][0], MORPH_REFERENCE_SHORTEST * unit);
        def.length[kind][1] = fmax(def.length[kind][1], MORPH_REFERENCE_LONGEST * unit);
    }
    def.stuck_links = 0;
    double *const angle[2] = {def.link_post, def.link_link};
    for (int k = 0; k < 2; k++) {
        angle[k][0] = fmin(angle[k][0], MORPH_REFERENCE_ANGLE);
        angle[k][1] = fmax(angle[k][1], straight - MORPH_REFERENCE_ANGLE);
    }
    return morph_structure_create(&def, out);
}

typedef struct solver {
    const morph_workspace *w;
    const morph_control *control;
    morph_control quiet; /* without progress: the refinement tells its own */
    morph_structure *wide;
    morph_cavity *cavity;
    morph_world world;
    double *trial, *scaled; /* 3*joints: m, spacings */
    double *x;              /* the caller's: the best */
    morph_measure best;
    double worst;                  /* of the best's violation, in tolerances */
    double accepted[MORPH_LIMITS]; /* as a start that the check would accept must count */
    morph_reference_report *report;
} solver;

static morph_status create(solver *s) {
    const size_t n = 3 * (size_t)s->w->structure->joints;
    if (!s->w->sdf) return MORPH_ERR_INPUT;
    s->trial = morph_alloc(n, sizeof(double));
    s->scaled = morph_alloc(n, sizeof(double));
    if (!s->trial || !s->scaled) return MORPH_ERR_NOMEM;
    morph_reference_tolerance(s->w->structure, s->accepted);
    morph_status status = morph_reference_structure(s->w->structure, &s->wide);
    if (status == MORPH_OK) status = morph_cavity_create(s->wide, s->w->exact, s->w->world.base, &s->cavity);
    s->world = (morph_world){s->wide, s->w->exact, s->w->sdf, s->cavity, s->w->world.base, 0.0};
    return status;
}

/* Keeps the trial if it is the best so far: feasible before infeasible, then the lower objective, else the
 * lesser violation. */
static morph_status consider(solver *s, int start, morph_outcome last) {
    const size_t n = 3 * (size_t)s->wide->joints;
    morph_measure m;
    morph_violation v;
    morph_status status = morph_cavity_measure(s->cavity, s->trial, &m);
    for (size_t i = 0; i < n; i++)
        s->scaled[i] = s->trial[i] / s->wide->spacing;
    if (status == MORPH_OK) status = morph_pose_examine(&s->world, s->scaled, NULL, NULL, NULL, NULL, &v);
    if (status != MORPH_OK) return status;
    const double worst = morph_violation_worst(&v, s->accepted, NULL);
    const bool feasible = worst <= 1.0;
    morph_reference_report *r = s->report;
    if (r->best >= 0 && (feasible != r->feasible ? r->feasible
                         : feasible              ? m.objective >= s->best.objective
                                                 : worst >= s->worst))
        return MORPH_OK;
    memcpy(s->x, s->trial, n * sizeof *s->x);
    s->best = m;
    s->worst = worst;
    r->feasible = feasible;
    r->violation = v;
    r->best = start;
    r->last = last;
    return MORPH_OK;
}

static void add_effort(morph_effort *sum, const morph_effort *part) {
    sum->solves += part->solves;
    sum->iterations += part->iterations;
    sum->linear_seconds += part->linear_seconds;
    sum->callback_seconds += part->callback_seconds;
    if (part->rows > sum->rows) {
        sum->rows = part->rows;
        sum->unknowns = part->unknowns;
    }
}

/* First as a plan is refined. Then, twice, what the rounds minimise is brought close to the measured
 * objective itself: without the terms that give a plan its looks and its contact everywhere; distances to the
 * closest points in full, as far as they stay the closest, instead of along the normal alone (slide), which
 * holds for short moves only (reach); the kink at the base sharper. On a sphere under 4 x 4 nodes three
 * starts then agree within a fifth, where they differed by a factor of three. */
static void aim(int pass, morph_refine_options *o) {
    static const double slide[PASSES] = {0.0, 0.5, 1.0}, reach[PASSES] = {0.0, 0.2, 0.1},
                        blend[PASSES] = {0.0, 0.05, 0.02};
    if (pass == 0) return;
    o->press = 0.0;
    o->upright *= 0.1; /* enough for the Hessian where a post's top is in no other term */
    o->least_reach = 0.01;
    o->slide = slide[pass];
    o->reach = reach[pass];
    o->blend = blend[pass];
}

/* From the pose in s->trial: as it is, then refined. */
static morph_status solve_from(solver *s, int start) {
    morph_status status = consider(s, start, MORPH_FEASIBLE);
    s->report->starts++;
    for (int k = 0; k < PASSES && status == MORPH_OK; k++) {
        morph_refine_options o = morph_refine_defaults();
        morph_refine_report r;
        morph_measure m;
        o.control = &s->quiet;
        aim(k, &o);
        status = morph_refine(&s->world, &o, s->trial, &r);
        morph_refine_report_free(&r);
        add_effort(&s->report->effort, &r.effort);
        if (status != MORPH_OK && status != MORPH_ERR_STOPPED) break;
        morph_status kept = consider(s, start, r.last);
        if (kept == MORPH_OK) kept = morph_cavity_measure(s->cavity, s->trial, &m);
        if (kept != MORPH_OK) return kept;
        morph_log(s->control, "reference: start %d, pass %d: objective %.5g spacings^4%s", start + 1, k + 1,
                  m.objective / pow(s->wide->spacing, 4.0), r.feasible ? "" : ", infeasible");
    }
    return status;
}

/* A flat sheet just above the target's highest exposed point: inside every limit, and above all of it. Held
 * nodes leave it no choice of where: then as it starts. */
static void lay_flat(const solver *s) {
    const morph_structure *st = s->wide;
    if (st->fixed_joints > 0) {
        memcpy(s->trial, s->w->start, 3 * (size_t)st->joints * sizeof *s->trial);
        return;
    }
    double top = isnan(s->world.base) ? -INFINITY : s->world.base;
    for (int k = 0; k < s->cavity->exposed; k++)
        top = fmax(top, s->cavity->expose[k].point[2]);
    /* Exposed points are a raster: a spike between them may stand a little higher. The radius and a tenth of
     * a spacing keep clear of most; where not, the refinement first moves the sheet out. */
    const double height = top + st->def.radius + 0.1 * st->spacing;
    for (int i = 0; i < 3 * st->joints; i++)
        s->trial[i] = st->start[i] + (i % 3 == 2 ? height : 0.0);
}

morph_status morph_reference_solve(const morph_workspace *w, const double *const *start, int count,
                                   const morph_control *control, double *x, morph_measure *measure,
                                   morph_reference_report *report) {
    const double since = morph_seconds();
    const size_t bytes = 3 * (size_t)w->structure->joints * sizeof *x;
    solver s = {.w = w, .control = control, .x = x, .report = report};
    morph_status failed = MORPH_ERR_INTERNAL;
    *report = (morph_reference_report){.best = -1};
    *measure = (morph_measure){0};
    if (control) s.quiet = *control;
    s.quiet.progress = NULL;
    morph_status status = create(&s);
    for (int k = 0; k <= count && status == MORPH_OK; k++) {
        morph_progress(control, "reference", k / (count + 1.0));
        if (k == count && s.cavity->exposed == 0) break; /* nothing to lie on */
        if (k < count)
            memcpy(s.trial, start[k], bytes);
        else
            lay_flat(&s);
        status = solve_from(&s, k);
        if (status == MORPH_OK || status == MORPH_ERR_STOPPED || status == MORPH_ERR_NOMEM) continue;
        /* Another start may do. What was kept of this one counts. */
        morph_log(control, "reference: start %d: %s", k + 1, morph_status_text(status));
        failed = status;
        status = MORPH_OK;
    }
    if (status == MORPH_OK && report->best < 0) status = failed;
    if (report->best >= 0) *measure = s.best;
    morph_cavity_destroy(s.cavity);
    morph_structure_destroy(s.wide);
    free(s.trial);
    free(s.scaled);
    report->seconds = morph_seconds() - since;
    return status;
}
