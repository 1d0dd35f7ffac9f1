/* Formulations of the path beside each other: bench_formulations [-n NODES] [-t SECONDS]
 * [-f NAME,...] [SCENE ...].
 *
 * From the same flat start to the same refined end, with the same limits, room and solver options:
 *   A   the product: pose by pose (joints as unknowns), then timing of the fixed path
 *   A1  the same unknowns, all poses in one problem (smoothness and distance to the first poses), then timing
 *   B   as A1 with the lengths as unknowns too, tied to the joints by quadratic rows, then timing
 *   C   path and timing in one problem: joints and a duration per interval, least time plus smoothness;
 *       motion limits by finite differences
 *   C1  as C with one duration for all intervals: the poses are samples at even times
 *   D   as C with the lengths as unknowns too
 *   D1  as C1 with the lengths as unknowns too
 * T disc: the end time as C and D have it; T own: the same stretched until a smooth curve through their poses
 * at their times holds its limits; T: the product's timing of the path. SECONDS: of the process, for each.
 * Without a scene: box, sphere and ellipsoid at 4 x 4 nodes.
 * Each block that is new here is first checked against central differences. What comes out is examined by the
 * same code for all: between poses on a fine grid from raw positions, and by the checker on a schedule. */
#include "formulation_whole.h"

#include "planner/check.h"
#include "planner/plan_internal.h"
#include "planner/timing_exact.h"
#include "solvers/dense.h"

#include <sys/resource.h>

static double cpu_seconds(void) {
    double sum = 0.0;
    const int who[] = {RUSAGE_SELF, RUSAGE_CHILDREN}; /* the product's solves run in children */
    for (int k = 0; k < 2; k++) {
        struct rusage u;
        if (getrusage(who[k], &u) != 0) continue;
        sum += (double)u.ru_utime.tv_sec + (double)u.ru_stime.tv_sec;
        sum += 1e-6 * ((double)u.ru_utime.tv_usec + (double)u.ru_stime.tv_usec);
    }
    return sum;
}

/* A fixed sequence in -1 .. 1 (Knuth's multiplier). */
static double wiggle(unsigned long long *state) {
    *state = *state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(*state >> 33) / 1073741824.0 - 1.0;
}

/* One block at x; false and a line where a derivative is wrong. */
static bool check_block(const morph_block *block, const double *x, int unknowns) {
    morph_derivative_check c;
    /* Steps of 1e-6 of values of order 1 leave about 1e-9 of the second differences: 1e-5 is far above that
     * and far beneath a wrong term. */
    const morph_status status = morph_check_derivatives(block, 1, x, unknowns, 1e-6, 1e-5, &c);
    const bool good = status == MORPH_OK && c.passed;
    printf("  %-11s %s, worst error Jacobian %.1e, Hessian %.1e%s%s\n", block->name, good ? "right" : "WRONG",
           c.worst_jacobian, c.worst_hessian, good ? "" : ": ",
           good                 ? ""
           : status == MORPH_OK ? c.message
                                : morph_status_text(status));
    return good;
}

/* On a small sheet of crooked poses and uneven durations. */
static bool check_layout(const morph_structure *s, bool lengths, bool even) {
    form_layout l = {
        .structure = s, .intervals = 4, .lengths = lengths, .durations = true, .even = even, .unit = 0.7};
    const int n = form_unknowns(&l), rows = form_motion_rows(&l), width = form_width(&l);
    double *x = morph_alloc((size_t)n, sizeof *x), *bounds = morph_alloc(2 * (size_t)rows, sizeof *bounds);
    int *map = morph_alloc((size_t)(width + s->links), sizeof *map),
        *list = morph_alloc((size_t)rows, sizeof *list);
    bool good = x && bounds && map && list;
    for (int row = 0; row < rows && good; row++)
        list[row] = row;
    unsigned long long state = 7;
    for (int u = 0; u < n && good; u++) {
        const double flat = u < form_length_at(&l, 0) ? s->start[u % width] / s->spacing : 1.0;
        x[u] = flat + 0.2 * wiggle(&state);
    }
    if (good) {
        form_smooth smooth = {&l, 30.0};
        form_time time = {&l, 1.0};
        form_motion motion = {&l, rows, list};
        const morph_block block[] = {form_block_motion(&motion, bounds, bounds + rows),
                                     form_block_smooth(&smooth), form_block_time(&time)};
        for (int b = 0; b < 3; b++)
            good = check_block(&block[b], x, n) && good;
        memset(bounds, 0, (size_t)rows * sizeof *bounds);
        for (int i = 0; i < width + s->links; i++)
            map[i] = i < width ? width + i : lengths ? form_length_at(&l, 1) + i - width : 0;
        const morph_block links = form_block_links(s, map, bounds);
        if (lengths) good = check_block(&links, x, n) && good;
    }
    free(x);
    free(bounds);
    free(map);
    free(list);
    return good;
}

static bool check_derivatives(void) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = 3;
    def.nodes[1] = 2;
    morph_structure *s = NULL;
    if (morph_structure_create(&def, &s) != MORPH_OK) return false;
    bool good = true;
    printf("derivatives of the new blocks:\n");
    for (int k = 0; k < 4; k++) {
        printf(" lengths %s, %s\n", k % 2 ? "as unknowns" : "from joints",
               k / 2 ? "one duration" : "a duration per interval");
        good = check_layout(s, k % 2, k / 2) && good;
    }
    morph_structure_destroy(s);
    return good;
}

/* What a formulation came to. */
typedef struct outcome {
    const char *name;
    form_effort effort;
    double path_cpu, timing_cpu, planned, own, time;
    bool holds; /* the curve, on the fine grid */
    morph_violation violation;
    morph_check_report check;
} outcome;

/* Timing of the fixed path as the product does it, and the checker's word on the schedule. */
static morph_status finish(const morph_planner *p, const morph_curve *curve, outcome *o) {
    morph_timing timing;
    morph_timing_report report;
    morph_record record = {0};
    const morph_timing_options t = {0.0, p->scene->sample, NULL};
    morph_status status = form_between(&p->work.world, curve, &o->violation, NULL);
    o->holds = morph_violation_worst(&o->violation, morph_pose_tolerance, NULL) <= 1.0;
    const double since = cpu_seconds();
    if (status == MORPH_OK) status = morph_timing_solve(curve, &t, &timing, &report);
    if (status != MORPH_OK) return status;
    o->timing_cpu = cpu_seconds() - since;
    o->time = timing.duration;
    status = morph_record_structure(&record, p->work.structure, &p->scene->target, p->scene->base);
    if (status == MORPH_OK) status = morph_record_schedule(&record, curve, &timing, p->scene->sample);
    if (status == MORPH_OK) status = morph_check_record(&record, NULL, &o->check);
    morph_record_free(&record);
    morph_timing_free(&timing);
    return status;
}

/* The product's ways in its own order, until one holds. */
static morph_status product(const morph_planner *p, outcome *o) {
    static const struct {
        bool unfold, stations;
        int intervals;
    } ways[] = {{true, false, 12}, {true, false, 24}, {false, true, 24}};
    morph_status status = MORPH_OK;
    morph_curve *curve = NULL;
    const double since = cpu_seconds();
    for (size_t k = 0; k < sizeof ways / sizeof *ways && status == MORPH_OK; k++) {
        morph_path_options path = morph_path_defaults();
        morph_path_report r;
        path.whole = false; /* that is what it is compared with */
        path.unfold = ways[k].unfold;
        path.intervals = ways[k].intervals;
        if (ways[k].stations && p->refined.stations > 0) {
            path.stations = p->refined.stations;
            path.station = p->refined.station;
            path.smoothness = 1.0;
        }
        morph_curve_destroy(curve);
        status = morph_path_plan(&p->work.world, p->way, p->work.start, p->end, &path, &curve, &r);
        form_effort *e = &o->effort;
        e->solves += r.effort.solves;
        e->iterations += r.effort.iterations;
        e->linear += r.effort.linear_seconds;
        e->callbacks += r.effort.callback_seconds;
        e->unknowns = r.effort.unknowns;
        e->rows = r.effort.rows;
        e->jacobian = r.effort.jacobian_nonzeros;
        e->hessian = r.effort.hessian_nonzeros;
        e->poses = r.poses;
        e->outcome = r.feasible ? MORPH_FEASIBLE : MORPH_INFEASIBLE;
        snprintf(e->solver, sizeof e->solver, "way %d of 3", (int)k + 1);
        if (r.feasible) break;
    }
    o->path_cpu = cpu_seconds() - since;
    if (status == MORPH_OK) status = finish(p, curve, o);
    morph_curve_destroy(curve);
    return status;
}

/* s(tau) through the poses' parameters at their times, at rest at both ends: three equal control points
 * there, knots by de Boor's averages of the sites with each end counted three times. */
static morph_status timing_through(const double *tau, const double *s, int count, morph_timing *out) {
    const int inner = count - 2, n = inner + MORPH_SPLINE_ORDER;
    morph_status status = morph_basis_uniform(n, &out->basis);
    out->control = status == MORPH_OK ? morph_alloc((size_t)n, sizeof(double)) : NULL;
    double *matrix = morph_alloc((size_t)inner * (size_t)inner, sizeof(double));
    if (status == MORPH_OK && (!out->control || !matrix)) status = MORPH_ERR_NOMEM;
    for (int j = 1; j <= inner && status == MORPH_OK; j++) {
        double sum = 0.0;
        for (int i = j; i < j + MORPH_SPLINE_DEGREE; i++)
            sum += i < 3 ? 0.0 : i - 2 >= count - 1 ? 1.0 : tau[i - 2];
        out->basis.knot[MORPH_SPLINE_DEGREE + j] = sum / MORPH_SPLINE_DEGREE;
    }
    for (int k = 0; k < inner && status == MORPH_OK; k++) {
        double value[1][MORPH_SPLINE_ORDER];
        const int first = morph_basis_eval(&out->basis, tau[k + 1], 0, value);
        out->control[k + 3] = s[k + 1];
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++) {
            const int unknown = first + i - 3;
            if (unknown >= inner) out->control[k + 3] -= value[0][i];
            if (unknown >= 0 && unknown < inner) matrix[k * inner + unknown] = value[0][i];
        }
    }
    if (status == MORPH_OK) status = morph_dense_solve(matrix, inner, out->control + 3, 1);
    for (int i = n - 3; i < n && status == MORPH_OK; i++)
        out->control[i] = 1.0;
    free(matrix);
    if (status != MORPH_OK) morph_timing_free(out);
    return status;
}

/* Durations as the problem has them, and stretched until the true derivatives of a smooth curve through the
 * same poses at the same times hold their limits. */
static morph_status own_time(const form_whole *w, const morph_curve *curve, outcome *o) {
    double tau[FORM_POSES] = {0.0};
    const int last = w->layout.intervals;
    for (int k = 0; k < last; k++)
        tau[k + 1] = tau[k] + w->duration[w->layout.even ? 0 : k] * w->layout.unit;
    o->planned = tau[last];
    for (int k = 0; k <= last; k++)
        tau[k] /= o->planned;
    morph_timing timing = {.duration = o->planned};
    morph_path_table table;
    morph_status status = morph_path_table_create(curve, &table);
    if (status == MORPH_OK) status = timing_through(tau, w->s, last + 1, &timing);
    if (status == MORPH_OK) {
        double worst[3] = {0.0, 0.0, 0.0};
        morph_timing_even(&table, &timing, 4000, worst);
        o->own = o->planned * morph_timing_stretch(worst);
    }
    morph_timing_free(&timing);
    morph_path_table_free(&table);
    return status;
}

typedef struct formulation {
    const char *name;
    bool lengths, durations, even;
} formulation;

static morph_status whole(const morph_planner *p, const formulation *f, double seconds, outcome *o) {
    const morph_path_options d = morph_path_defaults();
    const form_layout layout = {
        .intervals = d.intervals, .lengths = f->lengths, .durations = f->durations, .even = f->even};
    /* The product's smoothness. With durations, time over its start's counts a thousand: some thirty times as
     * much as the smoothness then comes to. */
    const form_weights weights = {1.0, d.smoothness, 1000.0, seconds};
    form_whole w;
    morph_curve *curve = NULL;
    const double since = cpu_seconds();
    morph_status status = form_create(&p->work.world, &layout, &weights, p->work.start, p->end, &w);
    if (status == MORPH_OK) status = form_run(&w, &curve);
    o->path_cpu = cpu_seconds() - since;
    o->effort = w.effort;
    if (status == MORPH_OK && f->durations) status = own_time(&w, curve, o);
    if (status == MORPH_OK) status = finish(p, curve, o);
    morph_curve_destroy(curve);
    form_free(&w);
    return status;
}

static void print_outcome(const outcome *o) {
    const form_effort *e = &o->effort;
    morph_limit which = MORPH_LIMIT_POST;
    morph_violation_worst(&o->violation, morph_pose_tolerance, &which);
    printf("%-3s %5d %8d %7d %8d %8d %6d %6d %8.2f %8.2f  %-10s %9.1e  %-10s", o->name, e->poses, e->unknowns,
           e->rows, e->jacobian, e->hessian, e->solves, e->iterations, o->path_cpu, o->timing_cpu,
           morph_outcome_text(e->outcome), o->violation.amount[which],
           o->check.feasible ? "feasible" : "infeasible");
    if (o->own > 0.0)
        printf(" %7.3f %7.3f", o->planned, o->own);
    else
        printf(" %7s %7s", "-", "-");
    printf(" %7.3f\n", o->time);
    printf("      %s; linear solver %.2f s, callbacks %.2f s; worst between poses: %s %s\n", e->solver,
           e->linear, e->callbacks, morph_limit_name(which), o->violation.element[which]);
    if (e->outcome != MORPH_OPTIMAL && e->row[0])
        printf("      last solve: its rows broken by %.1e at most: %s\n", e->violation, e->row);
    if (!o->check.feasible) {
        const morph_margin *m = &o->check.margin[o->check.worst];
        printf("      check: %s %s by %.2e %s at %.3f s\n", morph_margin_name(o->check.worst), m->element,
               -m->worst, morph_margin_unit_of(m, o->check.worst), m->time);
    }
    fflush(stdout);
}

/* Is the name in a list with commas? NULL lists all. */
static bool listed(const char *list, const char *name) {
    const size_t size = strlen(name);
    for (const char *at = list; at; at = strchr(at, ',')) {
        if (*at == ',') at++;
        if (strncmp(at, name, size) == 0 && (at[size] == ',' || at[size] == '\0')) return true;
    }
    return !list;
}

/* What the command line says. */
typedef struct settings {
    int nodes;          /* a side; 0: the scene's */
    double seconds;     /* of the process, for each formulation */
    const char *wanted; /* names with commas; NULL: all */
} settings;

static void compare(const morph_planner *p, const settings *set) {
    static const formulation all[] = {{"A", false, false, false}, {"A1", false, false, false},
                                      {"B", true, false, false},  {"C", false, true, false},
                                      {"C1", false, true, true},  {"D", true, true, false},
                                      {"D1", true, true, true}};
    printf("%-3s %5s %8s %7s %8s %8s %6s %6s %8s %8s  %-10s %9s  %-10s %7s %7s %7s\n", "", "poses",
           "unknowns", "rows", "nnz J", "nnz H", "solves", "iter", "CPU s", "timing", "outcome", "worst",
           "check", "T disc", "T own", "T");
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        outcome o = {.name = all[k].name};
        if (!listed(set->wanted, o.name)) continue;
        const morph_status status = k == 0 ? product(p, &o) : whole(p, &all[k], set->seconds, &o);
        if (status == MORPH_OK)
            print_outcome(&o);
        else
            printf("%-3s %s\n", all[k].name, morph_status_text(status));
    }
}

static void say(void *user, const char *text) {
    (void)user;
    fprintf(stderr, "%s\n", text);
}

/* The planner's stages up to the refined end, then every formulation. */
static bool run_scene(const char *path, const settings *set) {
    morph_scene *scene = NULL;
    if (morph_scene_read(path, say, say, NULL, &scene) != MORPH_OK) return false;
    if (set->nodes > 0) scene->structure.nodes[0] = scene->structure.nodes[1] = set->nodes;
    const morph_plan_options options = {.method = MORPH_METHOD_IPOPT};
    morph_planner p = {.scene = scene, .options = &options, .started = morph_seconds(), .deadline = INFINITY};
    p.way = &p.nominal;
    morph_planner_listen(&p);
    p.plan = calloc(1, sizeof *p.plan);
    morph_status status = p.plan ? morph_workspace_create(scene, NULL, &p.work) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK)
        status = morph_record_structure(&p.plan->record, p.work.structure, &scene->target, scene->base);
    if (status == MORPH_OK) status = morph_stage_nominal(&p);
    if (status == MORPH_OK) status = morph_stage_placement(&p);
    if (status == MORPH_OK) status = morph_stage_refine(&p);
    if (status == MORPH_OK) {
        printf("\n%s at %d x %d: refined in %.1f s (%s)\n", path, scene->structure.nodes[0],
               scene->structure.nodes[1], morph_seconds() - p.started,
               p.refined.feasible ? "feasible" : "infeasible");
        compare(&p, set);
    } else {
        fprintf(stderr, "%s: %s\n", path, morph_status_text(status));
    }
    morph_refine_report_free(&p.refined);
    morph_trajectory_free(&p.nominal);
    morph_trajectory_free(&p.attracted);
    morph_workspace_free(&p.work);
    free(p.end);
    morph_plan_destroy(p.plan);
    morph_scene_destroy(scene);
    return status == MORPH_OK;
}

int main(int argc, char **argv) {
    static const char *const scenes[] = {"examples/scenes/box_4.yaml", "examples/scenes/sphere_4.yaml",
                                         "examples/scenes/ellipsoid.yaml"};
    settings set = {.seconds = 60.0};
    int given = 0;
    bool good = true;
    morph_blas_threads(1);
    if (!check_derivatives()) return 1;
    for (int k = 1; k < argc; k++)
        if (strcmp(argv[k], "-n") == 0 && k + 1 < argc)
            set.nodes = atoi(argv[++k]);
        else if (strcmp(argv[k], "-t") == 0 && k + 1 < argc)
            set.seconds = atof(argv[++k]);
        else if (strcmp(argv[k], "-f") == 0 && k + 1 < argc)
            set.wanted = argv[++k];
        else
            given++, good = run_scene(argv[k], &set) && good;
    if (!given && set.nodes == 0) set.nodes = 4;
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes && !given; k++)
        good = run_scene(scenes[k], &set) && good;
    return good ? 0 : 2;
}
