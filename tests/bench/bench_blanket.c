/* What the blanket costs: bench_blanket [SECONDS].
 *
 * Sheets of 4 x 4, 16 x 16 and 64 x 64 fall over a ball of 0.3 of their width (springs of 20 N/m, friction
 * 0.4, spacing 0.1 m): nanoseconds per link and step, steps per second, growth with the links, the ratio to a
 * loop that only streams the arrays of a step, simulated seconds per second. Then, at 16 x 16, what each
 * feature of a scene adds: calls counted by the linker (--wrap), so that the library has no counters. */
#include "model/blanket_internal.h"

#include "solvers/sparse.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* --- counted calls; see tests/CMakeLists.txt --------------------------------------------------------------
 */

typedef struct counts {
    long field, attraction, exact, rows, factors;
} counts;
static counts count;

double __real_morph_sdf_eval(const morph_sdf *sdf, const double p[3], double *g, double *h);
double __wrap_morph_sdf_eval(const morph_sdf *sdf, const double p[3], double *g, double *h);
double __wrap_morph_sdf_eval(const morph_sdf *sdf, const double p[3], double *g, double *h) {
    count.field++;
    return __real_morph_sdf_eval(sdf, p, g, h);
}

double __real_morph_attraction(const morph_attractor *a, double soft, const double x[3], double f[3],
                               double h[3][3]);
double __wrap_morph_attraction(const morph_attractor *a, double soft, const double x[3], double f[3],
                               double h[3][3]);
double __wrap_morph_attraction(const morph_attractor *a, double soft, const double x[3], double f[3],
                               double h[3][3]) {
    count.attraction++;
    return __real_morph_attraction(a, soft, x, f, h);
}

void __real_morph_distance_element(const morph_distance *d, const double corner[][3], int corners,
                                   double enough, double weight[3], morph_closest *out);
void __wrap_morph_distance_element(const morph_distance *d, const double corner[][3], int corners,
                                   double enough, double weight[3], morph_closest *out);
void __wrap_morph_distance_element(const morph_distance *d, const double corner[][3], int corners,
                                   double enough, double weight[3], morph_closest *out) {
    count.exact++;
    __real_morph_distance_element(d, corner, corners, enough, weight, out);
}

double __real_morph_blanket_project_contact(morph_contact *c, double *x, double friction, double *gap);
double __wrap_morph_blanket_project_contact(morph_contact *c, double *x, double friction, double *gap);
double __wrap_morph_blanket_project_contact(morph_contact *c, double *x, double friction, double *gap) {
    count.rows++;
    return __real_morph_blanket_project_contact(c, x, friction, gap);
}

morph_status __real_morph_sparse_factor(morph_sparse *s, const double *value, int *column);
morph_status __wrap_morph_sparse_factor(morph_sparse *s, const double *value, int *column);
morph_status __wrap_morph_sparse_factor(morph_sparse *s, const double *value, int *column) {
    count.factors++;
    return __real_morph_sparse_factor(s, value, column);
}

/* Of this process: other work on the machine counts less. */
static double cpu_seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

/* --- scenes -----------------------------------------------------------------------------------------------
 */

typedef struct scene {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf;
    double *start;
} scene;

static bool make_target(scene *s, double radius) {
    const double radii[3] = {radius, radius, radius}, a = s->structure->spacing;
    const int n = 3 * s->structure->joints;
    double lo[3] = {0.0, 0.0, -0.5 * a}, hi[3] = {0.0, 0.0, 2.0 * radius + 2.5 * a};
    morph_mesh mesh = {0};
    if (morph_mesh_ellipsoid(radii, 2e-3 * radius, &mesh) != MORPH_OK) return false;
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += radius;
    const morph_status status = morph_distance_create(&mesh, true, &s->exact);
    morph_mesh_free(&mesh);
    if (status != MORPH_OK || !(s->start = morph_alloc((size_t)n, sizeof(double)))) return false;
    for (int i = 0; i < n; i++)
        s->start[i] = s->structure->start[i] + (i % 3 == 2 ? 2.0 * radius + a : 0.0);
    for (int i = 0; i < n; i++)
        if (i % 3 < 2) {
            lo[i % 3] = fmin(lo[i % 3], s->start[i] - a);
            hi[i % 3] = fmax(hi[i % 3], s->start[i] + a);
        }
    /* 1/8 of the spacing as in plans; larger sheets on larger balls need no such field, nor the memory for
     * it. */
    const double cell = radius > 5.0 * a ? a / 2.0 : a / 8.0;
    return morph_sdf_create(s->exact, lo, hi, cell, NULL, &s->sdf) == MORPH_OK;
}

static bool make(scene *s, int nodes, morph_joint_type joints) {
    *s = (scene){0};
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = nodes;
    def.stiffness = 20.0;
    def.joints = joints;
    def.fixed = MORPH_FIXED_BORDER; /* listed by the structure; held only where a def says so */
    return morph_structure_create(&def, &s->structure) == MORPH_OK && make_target(s, 0.03 * (nodes - 1));
}

static void discard(scene *s) {
    morph_sdf_destroy(s->sdf);
    morph_distance_destroy(s->exact);
    morph_structure_destroy(s->structure);
    free(s->start);
}

static morph_blanket_def fall(void) {
    return (morph_blanket_def){
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 2.0, .frame = 0.02, .base = NAN};
}

/* --- the arrays of a step, only read and written
 * ------------------------------------------------------------ */

static void touch_bytes(void *at, size_t bytes, double *sum) {
    double *value = at;
    for (size_t k = 0; k < bytes / sizeof(double); k++)
        value[k] = value[k] * 1.0000000001 + 1e-300;
    *sum += bytes > 0 ? value[0] : 0.0;
}

/* Seconds of one pass over copies of what a step may read or write, and the bytes. */
static double stream(const morph_blanket_state *b, size_t *bytes) {
    const size_t vector = 3 * (size_t)b->joints * sizeof(double), links = (size_t)b->links;
    const size_t size[] = {vector,
                           vector,
                           vector,
                           vector,
                           links * (sizeof(int[2]) + sizeof(double[2]) * 3 + 2 * sizeof(double)),
                           (size_t)b->angles * sizeof(morph_angle),
                           (size_t)b->touches * (sizeof(morph_touch) + sizeof(morph_hold)),
                           (size_t)b->posts * (sizeof(int[2]) + sizeof(double))};
    enum { ARRAYS = sizeof size / sizeof *size, PASSES = 200 };
    void *array[ARRAYS] = {0};
    double sum = 0.0, best = INFINITY;
    bool good = true;
    *bytes = 0;
    for (int k = 0; k < ARRAYS; k++) {
        array[k] = morph_alloc(size[k] + 8, 1);
        good = good && array[k];
        *bytes += size[k];
    }
    for (int batch = 0; batch < 5 && good; batch++) {
        const double begin = cpu_seconds();
        for (int pass = 0; pass < PASSES; pass++)
            for (int k = 0; k < ARRAYS; k++)
                touch_bytes(array[k], size[k], &sum);
        best = fmin(best, (cpu_seconds() - begin) / PASSES);
    }
    for (int k = 0; k < ARRAYS; k++)
        free(array[k]);
    return sum < 0.0 ? NAN : best;
}

/* --- tables
 * ------------------------------------------------------------------------------------------------- */

static void size_row(int nodes, double seconds, double *last) {
    scene s;
    if (!make(&s, nodes, MORPH_JOINTS_BALL)) {
        printf("  %d x %d cannot be made\n", nodes, nodes);
        discard(&s);
        return;
    }
    morph_blanket_def def = fall();
    def.time = seconds;
    def.base = 0.0;
    morph_blanket_state *b;
    morph_trajectory t = {0};
    morph_blanket_report r = {0};
    const int links = s.structure->links;
    size_t bytes;
    if (morph_blanket_state_create(s.structure, s.sdf, &def, s.start, &b) == MORPH_OK) {
        const double pass = stream(b, &bytes);
        morph_blanket_state_destroy(b);
        const double begin = cpu_seconds();
        if (morph_blanket_run(s.structure, s.sdf, s.exact, &def, s.start, NULL, &t, &r) == MORPH_OK) {
            const double took = cpu_seconds() - begin;
            const double simulated = t.time[t.frames - 1], step = took / r.steps;
            printf(
                "  %2d x %-2d %6d links %6.0f ns/link/step %9.0f steps/s %8.2f s/s  streaming %5.1f ns/link "
                "(%.0f kB), ratio %.0f",
                nodes, nodes, links, 1e9 * step / links, 1.0 / step, simulated / took, 1e9 * pass / links,
                1e-3 * (double)bytes, step / pass);
            if (last[1] > 0.0) printf("; grows as links^%.2f", log(step / last[0]) / log(links / last[1]));
            printf("\n");
            last[0] = step;
            last[1] = links;
        }
    }
    morph_trajectory_free(&t);
    discard(&s);
    fflush(stdout);
}

/* Steps alone, with what they list. */
static void feature_row(const char *name, const scene *s, bool target, const morph_blanket_def *def) {
    enum { STEPS = 600 };
    morph_blanket_state *b;
    double contacts = 0.0, links = 0.0, angles = 0.0;
    if (morph_blanket_state_create(s->structure, target ? s->sdf : NULL, def, s->start, &b) != MORPH_OK) {
        printf("  %s: cannot be made\n", name);
        return;
    }
    b->step = fmin(morph_blanket_stable_step(s->structure, def), 2e-3);
    count = (counts){0};
    const double begin = cpu_seconds();
    int steps = 0;
    while (steps < STEPS && morph_blanket_step(b)) {
        steps++;
        contacts += b->contacts;
        links += b->near_links;
        angles += b->near_angles;
    }
    const double seconds = cpu_seconds() - begin, n = steps;
    int pushing = 0;
    for (int k = 0; k < def->hand_count; k++)
        pushing += def->hands[k].from <= 0.5 && def->hands[k].to > 0.5;
    printf(
        "  %-24s %7.1f us  field %6.0f  contacts %5.0f (rows %6.0f)  links %5.0f  angles %5.0f  attraction "
        "%5.0f  hands %d  panel rows %5d  exact %.0f\n",
        name, 1e6 * seconds / n, (double)count.field / n, contacts / n, (double)count.rows / n, links / n,
        angles / n, (double)count.attraction / n, pushing, s->structure->panels * MORPH_BLANKET_SWEEPS,
        (double)count.exact / n);
    morph_blanket_state_destroy(b);
}

static void frame_row(const char *name, const scene *s, const morph_blanket_def *def, bool exact) {
    morph_trajectory t = {0};
    morph_blanket_report r = {0};
    count = (counts){0};
    const double begin = cpu_seconds();
    if (morph_blanket_run(s->structure, s->sdf, exact ? s->exact : NULL, def, s->start, NULL, &t, &r) ==
        MORPH_OK)
        printf(
            "  %-24s %7.1f us a step, %d steps, %d frames: a frame %5.0f exact queries, %4.1f "
            "factorisations\n",
            name, 1e6 * (cpu_seconds() - begin) / r.steps, r.steps, t.frames, (double)count.exact / t.frames,
            (double)count.factors / t.frames);
    morph_trajectory_free(&t);
}

static void features(void) {
    scene s, universal;
    const bool good = make(&s, 16, MORPH_JOINTS_BALL), both = make(&universal, 16, MORPH_JOINTS_UNIVERSAL);
    if (good && both) {
        const double height = s.start[2];
        const morph_attractor centre = {{0.0, 0.0, 0.4}, 0.02};
        const morph_hand hand = {5, {0.02, 0.0, 0.0}, 0.0, 9.0};
        morph_drive drive = {1, 1.0, s.structure->start_length};
        printf("16 x 16, a step (%d links, %d angles, %d places); rows: single corrections\n",
               s.structure->links, s.structure->link_posts + s.structure->link_links,
               2 * 256 + 4 * s.structure->links + 5 * s.structure->skin_triangles);
        morph_blanket_def def = fall();
        feature_row("free fall", &s, false, &def);
        def.base = height - 0.1;
        feature_row("on the base plane", &s, false, &def);
        def = fall();
        feature_row("over the ball", &s, true, &def);
        def.attractors = &centre;
        def.attractor_count = 1;
        feature_row("and attraction", &s, true, &def);
        def = fall();
        def.hands = &hand;
        def.hand_count = 1;
        feature_row("and a hand", &s, true, &def);
        def = fall();
        def.fixed = s.structure->fixed_joint;
        def.fixed_count = s.structure->fixed_joints;
        feature_row("border held, no target", &s, false, &def);
        def.rise = 0.3;
        def.rise_time = 1.0;
        feature_row("border held, ball rises", &s, true, &def);
        def = fall();
        feature_row("universal, no target", &universal, false, &def);
        feature_row("universal, over the ball", &universal, true, &def);
        def.drive = &drive;
        feature_row("lengths prescribed", &s, true, &def);
        def = fall();
        frame_row("frames by the field", &s, &def, false);
        frame_row("frames by exact distance", &s, &def, true);
    }
    discard(&universal);
    discard(&s);
}

int main(int arguments, char **argument) {
    const double seconds = arguments > 1 ? atof(argument[1]) : 2.0;
    double last[2] = {0.0};
    morph_blas_threads(1);
    setvbuf(stdout, NULL, _IOLBF, 0);
    printf("over a ball, %g s at most, frames of 0.02 s held to exact distances\n", seconds);
    size_row(4, seconds, last);
    size_row(16, seconds, last);
    size_row(64, 0.25 * seconds, last);
    features();
    return 0;
}
