#include "planner/compare_method.h"

#include "planner/guide.h"
#include "planner/placement.h"
#include "planner/reference.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void morph_compare_shared_free(morph_compare_shared *shared) {
    morph_trajectory_free(&shared->nominal);
    if (shared->placement) morph_placement_free(shared->placement);
    free(shared->placement);
    for (int k = 0; k < MORPH_COMPARE_METHODS; k++)
        free(shared->end[k]);
    morph_workspace_free(&shared->work);
    *shared = (morph_compare_shared){0};
}

/* "clearance: skin triangle 4: beyond by 0.012 spacings". */
static void tell_violation(const morph_violation *v, const double tolerance[MORPH_LIMITS],
                           morph_compare_row *row) {
    static const char *const units[MORPH_LIMITS] = {
        [MORPH_LIMIT_POST] = "of its length", [MORPH_LIMIT_PANEL] = "(sine)",
        [MORPH_LIMIT_LENGTH] = "spacings",    [MORPH_LIMIT_ANGLE] = "rad",
        [MORPH_LIMIT_CLEARANCE] = "spacings", [MORPH_LIMIT_BASE] = "spacings",
        [MORPH_LIMIT_SELF] = "spacings"};
    morph_limit which = MORPH_LIMIT_POST;
    morph_violation_worst(v, tolerance, &which);
    snprintf(row->reason, sizeof row->reason, "%s: %s: beyond by %.3g %s", morph_limit_name(which),
             v->element[which], v->amount[which], units[which]);
}

morph_status morph_compare_take(morph_compare_shared *shared, morph_compare_method method, const double *x,
                                double lift, morph_compare_row *row) {
    const morph_structure *s = shared->work.structure;
    const size_t n = 3 * (size_t)s->joints;
    double tolerance[MORPH_LIMITS];
    morph_violation v;
    double *seen = morph_alloc(n, sizeof(double)), *scaled = morph_alloc(n, sizeof(double));
    morph_status status = seen && scaled ? MORPH_OK : MORPH_ERR_NOMEM;
    for (size_t i = 0; i < n && status == MORPH_OK; i++)
        seen[i] = x[i] - (i % 3 == 2 ? lift : 0.0);
    /* Limits are asked where the pose stands: a lift changes the height above the base plane only, and the
     * target with it is at its place once it has risen. */
    for (size_t i = 0; i < n && status == MORPH_OK; i++)
        scaled[i] = seen[i] / s->spacing;
    if (status == MORPH_OK) status = morph_cavity_measure(shared->work.cavity, seen, &row->measure);
    if (status == MORPH_OK)
        status = morph_pose_examine(&shared->work.world, scaled, NULL, NULL, NULL, NULL, &v);
    free(scaled);
    if (status != MORPH_OK) {
        free(seen);
        return status;
    }
    morph_reference_tolerance(s, tolerance);
    row->measured = true;
    row->feasible = morph_violation_worst(&v, tolerance, NULL) <= 1.0;
    if (!row->feasible) tell_violation(&v, tolerance, row);
    snprintf(row->outcome, sizeof row->outcome, "%s", row->feasible ? "feasible" : "infeasible");
    free(shared->end[method]);
    shared->end[method] = seen;
    return MORPH_OK;
}

/* A deformable target and what the blanket has made of it, put in the target's place for all that follow. */
static morph_status run_on_body(morph_compare_shared *sh, morph_blanket_def *def,
                                morph_blanket_report *report, morph_compare_row *row) {
    morph_deformable_report body_report = {0};
    morph_mesh surface;
    morph_status status = morph_target_body(sh->scene, sh->work.exact, &def->body, &body_report, row->reason,
                                            sizeof row->reason);
    if (status != MORPH_OK) return status;
    row->reason[0] = '\0'; /* a remark on the filling */
    const morph_status ran = morph_blanket_run(sh->work.structure, NULL, NULL, def, sh->work.start,
                                               sh->control, &sh->nominal, report);
    if ((ran == MORPH_OK || ran == MORPH_ERR_STOPPED) && sh->nominal.frames > 0) {
        const double lift = sh->nominal.lift[sh->nominal.frames - 1];
        status = morph_tetra_surface(&def->body->mesh, def->body->x, &surface);
        for (int i = 0; i < surface.vertices && status == MORPH_OK; i++)
            surface.v[3 * i + 2] -= lift;
        morph_control quiet = sh->control ? *sh->control : (morph_control){0};
        quiet.stop = NULL;
        if (status == MORPH_OK) {
            status = morph_workspace_press(&sh->work, sh->scene, &surface, &quiet);
            morph_mesh_free(&surface);
        }
    }
    morph_body_destroy(def->body);
    def->body = NULL;
    return status == MORPH_OK ? ran : status;
}

static morph_status run_blanket(morph_compare_shared *sh, morph_compare_row *row) {
    morph_blanket_def def = morph_scene_blanket(sh->scene, sh->work.structure);
    morph_blanket_report report = {0};
    morph_trajectory *t = &sh->nominal;
    const morph_status ran = sh->scene->target_def.has_deformable
                                 ? run_on_body(sh, &def, &report, row)
                                 : morph_blanket_run(sh->work.structure, sh->work.sdf, sh->work.exact, &def,
                                                     sh->work.start, sh->control, t, &report);
    if ((ran != MORPH_OK && ran != MORPH_ERR_STOPPED) || t->frames == 0) return ran;
    const size_t last = (size_t)t->frames - 1;
    const morph_status status = morph_compare_take(sh, MORPH_COMPARE_BLANKET,
                                                   &t->x[last * 3 * (size_t)t->joints], t->lift[last], row);
    if (status == MORPH_OK && !report.at_rest && row->feasible)
        snprintf(row->reason, sizeof row->reason, "not at rest after %.3g s", t->time[last]);
    return status == MORPH_OK ? ran : status;
}

static bool refuse(const morph_compare_shared *sh, morph_compare_row *row) {
    return !morph_scene_supported(sh->scene, "ipopt", row->reason, sizeof row->reason);
}

static bool refuse_centres(const morph_compare_shared *sh, morph_compare_row *row) {
    char feature[96];
    if (refuse(sh, row)) return true;
    if (!morph_scene_unplaceable(sh->scene, feature, sizeof feature)) return false;
    snprintf(row->reason, sizeof row->reason, "not available yet: %s with centres that are placed", feature);
    return true;
}

/* The blanket under seeds beneath its own cavities. */
static morph_status run_seeds(morph_compare_shared *sh, morph_compare_row *row) {
    const double *end = sh->end[MORPH_COMPARE_BLANKET];
    morph_attractor seed[1];
    morph_trajectory t = {0};
    int count = 0;
    if (refuse_centres(sh, row) || !end) return MORPH_ERR_INPUT;
    const morph_scene *s = sh->scene;
    const double unit = morph_balance_unit(&s->structure, s->motion.gravity);
    morph_status status = morph_seed_centres(&sh->work, end, unit, 1, seed, &count);
    if (status == MORPH_OK) status = morph_guided_run(&sh->work, s, NULL, seed, count, sh->control, &t, NULL);
    if (status == MORPH_OK && t.frames > 0)
        status = morph_compare_take(sh, MORPH_COMPARE_SEEDS,
                                    &t.x[(size_t)(t.frames - 1) * 3 * (size_t)t.joints], 0.0, row);
    morph_trajectory_free(&t);
    return status;
}

/* With and without gradients, each with the wall time and the number of centres that Ipopt took before it;
 * the better of the two. */
static morph_status run_nlopt(morph_compare_shared *sh, morph_compare_row *row) {
    static const morph_placement_method methods[2] = {MORPH_PLACE_NLOPT_GRADIENT, MORPH_PLACE_NLOPT_FREE};
    const double *end = sh->end[MORPH_COMPARE_BLANKET];
    double least = INFINITY;
    if (refuse_centres(sh, row) || !end) return MORPH_ERR_INPUT;
    morph_status status = MORPH_OK;
    for (int k = 0; k < 2 && status == MORPH_OK; k++) {
        morph_placement_options o = morph_placement_defaults();
        morph_placement p;
        o.control = sh->control;
        o.method = methods[k];
        if (sh->placement && sh->placement->centres > 0) {
            o.seconds = sh->placement->seconds;
            o.most_centres = sh->placement->centres;
        }
        status = morph_placement_run(&sh->work, sh->scene, end, &o, &p);
        const morph_trajectory *t = &p.guided;
        if ((status == MORPH_OK || status == MORPH_ERR_STOPPED) && t->frames > 0 &&
            p.reached.objective < least) {
            least = p.reached.objective;
            const morph_status taken = morph_compare_take(
                sh, MORPH_COMPARE_NLOPT, &t->x[(size_t)(t->frames - 1) * 3 * (size_t)t->joints], 0.0, row);
            if (taken != MORPH_OK) status = taken;
        } else if (status == MORPH_OK && t->frames == 0) {
            snprintf(row->reason, sizeof row->reason, "%s", p.reason);
            status = MORPH_ERR_INPUT;
        }
        morph_placement_free(&p);
    }
    return status;
}

/* Kept for the plan, which would place the same centres again. */
static morph_status run_guided(morph_compare_shared *sh, morph_compare_row *row) {
    const double *end = sh->end[MORPH_COMPARE_BLANKET];
    if (refuse_centres(sh, row) || !end) return MORPH_ERR_INPUT;
    morph_placement_options o = morph_placement_defaults();
    o.control = sh->control;
    morph_placement *p = calloc(1, sizeof *p);
    if (!p) return MORPH_ERR_NOMEM;
    const morph_status ran = morph_placement_run(&sh->work, sh->scene, end, &o, p);
    if (ran != MORPH_OK && ran != MORPH_ERR_STOPPED) {
        free(p);
        return ran;
    }
    sh->placement = p;
    const morph_trajectory *t = &p->guided;
    if (t->frames == 0) {
        snprintf(row->reason, sizeof row->reason, "%s", p->reason);
        return ran == MORPH_OK ? MORPH_ERR_INPUT : ran;
    }
    const morph_status status = morph_compare_take(
        sh, MORPH_COMPARE_GUIDED, &t->x[(size_t)(t->frames - 1) * 3 * (size_t)t->joints], 0.0, row);
    return status == MORPH_OK ? ran : status;
}

/* The whole command as `plan` has it, its own blanket included. */
static morph_status run_plan(morph_compare_shared *sh, morph_compare_row *row) {
    const morph_plan_options options = {
        .method = MORPH_METHOD_IPOPT, .control = sh->control, .placement = sh->placement};
    const size_t width = 3 * (size_t)sh->work.structure->joints;
    morph_plan *plan = NULL;
    if (refuse(sh, row)) return MORPH_ERR_INPUT;
    morph_status status = morph_plan_run(sh->scene, &options, &plan);
    if (status != MORPH_OK) return status;
    const morph_record *r = &plan->record;
    if (plan->summary.has_plan && r->samples > 0) {
        const size_t last = (size_t)r->samples - 1;
        status = morph_compare_take(sh, MORPH_COMPARE_PLAN, &r->schedule_joints[last * width],
                                    r->offset_schedule[3 * last + 2], row);
    }
    /* The plan's own words and verdict: of the whole schedule, not of its end alone. */
    if (status == MORPH_OK && !(row->summary = malloc(sizeof *row->summary))) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        *row->summary = plan->summary;
        row->feasible = plan->summary.feasible;
        memcpy(row->outcome, plan->summary.outcome, sizeof row->outcome);
        memcpy(row->reason, plan->summary.reason, sizeof row->reason);
        if (strcmp(row->outcome, "stopped") == 0) status = MORPH_ERR_STOPPED;
    }
    morph_plan_destroy(plan);
    return status;
}

/* From every end that the methods before have come to. */
static morph_status run_reference(morph_compare_shared *sh, morph_compare_row *row) {
    const double *start[MORPH_COMPARE_METHODS];
    int count = 0;
    if (refuse(sh, row)) return MORPH_ERR_INPUT;
    for (int k = 0; k < MORPH_COMPARE_REFERENCE; k++)
        if (sh->end[k]) start[count++] = sh->end[k];
    double *x = morph_alloc(3 * (size_t)sh->work.structure->joints, sizeof(double));
    if (!x) return MORPH_ERR_NOMEM;
    morph_reference_report report;
    const morph_status status =
        morph_reference_solve(&sh->work, start, count, sh->control, x, &row->measure, &report);
    sh->end[MORPH_COMPARE_REFERENCE] = x;
    if (report.best < 0 || (status != MORPH_OK && status != MORPH_ERR_STOPPED)) return status;
    double tolerance[MORPH_LIMITS];
    morph_reference_tolerance(sh->work.structure, tolerance);
    row->measured = true;
    row->feasible = report.feasible;
    if (!report.feasible) tell_violation(&report.violation, tolerance, row);
    snprintf(row->outcome, sizeof row->outcome, "%s",
             !report.feasible               ? "infeasible"
             : report.last == MORPH_OPTIMAL ? "optimal"
                                            : "feasible");
    return status;
}

#define TEXT_OF(x) TEXT_OF_VALUE(x)
#define TEXT_OF_VALUE(x) #x

const morph_compare_entry morph_compare_entries[MORPH_COMPARE_METHODS] = {
    [MORPH_COMPARE_BLANKET] = {"blanket", "pure blanket, at its end", "", run_blanket, false},
    [MORPH_COMPARE_SEEDS] = {"seeds", "blanket with seed centres only", "", run_seeds, true},
    [MORPH_COMPARE_NLOPT] = {"nlopt", "blanket under the centres that NLopt placed", "", run_nlopt, true},
    [MORPH_COMPARE_GUIDED] = {"guided", "blanket under the centres that Ipopt placed", "", run_guided, true},
    [MORPH_COMPARE_PLAN] = {"plan", "full plan, at its end", "\"method\": \"ipopt\"", run_plan, false},
    [MORPH_COMPARE_REFERENCE] = {"reference", "no limits of length and angle: local, not a proven bound",
                                 "\"length\": [" TEXT_OF(MORPH_REFERENCE_SHORTEST) ", " TEXT_OF(
                                     MORPH_REFERENCE_LONGEST) "], \"angle\": " TEXT_OF(MORPH_REFERENCE_ANGLE),
                                 run_reference, false}};

const char *morph_compare_name(morph_compare_method method) {
    return morph_compare_entries[method].name;
}

const char *morph_compare_meaning(morph_compare_method method) {
    return morph_compare_entries[method].meaning;
}
