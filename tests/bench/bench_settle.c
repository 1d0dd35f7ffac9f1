/* Settle against the blanket's dynamics on the same scenes: bench_settle [NODES...].
 *
 * For a box and a sphere under grids of 4 x 4, 8 x 8, 12 x 12 and 16 x 16 (springs of 20 N/m, the target
 * scaled with the grid as in examples/scenes): with friction 0.4, seconds of both, their ratio, the mean gap
 * and the potential energy of both ends, Newton iterations, factorisations, analyses, the linear solver's
 * share; then settle from the dynamics' end, and warm from its own. Without friction and with two centres, as
 * placement uses it: cold, then warm after one centre has moved by a twentieth of the spacing, back again,
 * after its strength has grown by a tenth, and cold with the same centres. "line NODES" prints the energy
 * along a line of 41 places of a centre instead, each from the rest before it.
 */
#include "model/blanket.h"
#include "model/cavity.h"
#include "model/settle.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct scene {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf;
    morph_cavity *cavity;
    double *start, *x;
    size_t bytes;
} scene;

/* Stands the mesh on the plane z = 0 and the grid a spacing above it. */
static bool place(scene *s, morph_mesh *mesh, double height) {
    for (int i = 0; i < mesh->vertices; i++)
        mesh->v[3 * i + 2] += 0.5 * height;
    if (morph_distance_create(mesh, true, &s->exact) != MORPH_OK) return false;
    const int n = 3 * s->structure->joints;
    const double a = s->structure->spacing;
    double lo[3] = {0, 0, -0.5 * a}, hi[3] = {0, 0, height + 2.5 * a};
    s->bytes = (size_t)n * sizeof(double);
    s->start = morph_alloc(1, s->bytes);
    s->x = morph_alloc(1, s->bytes);
    if (!s->start || !s->x) return false;
    for (int i = 0; i < n; i++)
        s->start[i] = s->structure->start[i] + (i % 3 == 2 ? height + a : 0.0);
    for (int i = 0; i < n; i++)
        if (i % 3 < 2) {
            lo[i % 3] = fmin(lo[i % 3], s->start[i] - a);
            hi[i % 3] = fmax(hi[i % 3], s->start[i] + a);
        }
    return morph_sdf_create(s->exact, lo, hi, a / 16.0, NULL, &s->sdf) == MORPH_OK &&
           morph_cavity_create(s->structure, s->exact, 0.0, &s->cavity) == MORPH_OK;
}

static bool make(scene *s, int nodes, bool sphere) {
    *s = (scene){0};
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = nodes;
    def.stiffness = 20.0;
    if (morph_structure_create(&def, &s->structure) != MORPH_OK) return false;
    const double width = 0.1 * (nodes - 1);
    const double size[3] = {0.5 * width, 0.5 * width, 0.3 * width}, r = 0.3 * width;
    const double radii[3] = {r, r, r};
    morph_mesh mesh = {0};
    const morph_status status =
        sphere ? morph_mesh_ellipsoid(radii, 1e-3, &mesh) : morph_mesh_box(size, &mesh);
    const bool good = status == MORPH_OK && place(s, &mesh, sphere ? 2.0 * r : size[2]);
    morph_mesh_free(&mesh);
    return good;
}

static void discard(scene *s) {
    morph_cavity_destroy(s->cavity);
    morph_sdf_destroy(s->sdf);
    morph_distance_destroy(s->exact);
    morph_structure_destroy(s->structure);
    free(s->start);
    free(s->x);
}

static void line(const char *name, const scene *s, const morph_settle *settle, double seconds) {
    morph_measure m = {0};
    morph_cavity_measure(s->cavity, s->x, &m);
    printf("  %-14s %8.3f s  gap %.4f  energy %.5f J  ", name, seconds, m.gap_mean / s->structure->spacing,
           morph_settle_energy(settle, s->x));
}

static void settle_line(const char *name, scene *s, morph_settle *settle, bool warm, double dynamics) {
    morph_settle_report r = {0};
    const morph_status status = morph_settle_run(settle, s->x, warm, NULL, &r);
    line(name, s, settle, r.seconds);
    printf(
        "%s%s%s: %.2f of the dynamics; %d steps, %d iterations, %d factorisations so far, %d analysis, "
        "linear solver %.0f %%, %d contacts, %d saddles\n",
        status == MORPH_OK ? "" : morph_status_text(status),
        r.converged ? "converged" : morph_settle_outcome_text(r.outcome), r.stable ? ", stable" : "",
        r.seconds / dynamics, r.steps, r.iterations, r.factorisations, r.analyses,
        100.0 * r.linear_seconds / r.seconds, r.contacts, r.saddles);
    printf("                 residual %.1e weights, length %.1e m, post %.1e, angle %.1e, clearance %.1e m\n",
           r.residual, r.worst_length, r.worst_post, r.worst_angle, r.worst_clearance);
}

static void compare(scene *s) {
    const morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 3.0, .frame = 0.01, .base = 0.0};
    morph_settle_def sd = morph_settle_defaults();
    sd.friction = def.friction;
    sd.base = 0.0;
    sd.exact = s->exact;
    morph_trajectory t = {0};
    morph_blanket_report report = {0};
    morph_settle *settle = NULL;
    if (morph_settle_create(s->structure, s->sdf, &sd, &settle) == MORPH_OK &&
        morph_blanket_run(s->structure, s->sdf, s->exact, &def, s->start, NULL, &t, &report) == MORPH_OK) {
        const double *end = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)t.joints];
        memcpy(s->x, end, s->bytes);
        line("dynamics", s, settle, report.seconds);
        printf("%d steps, %s\n", report.steps, report.at_rest ? "at rest" : "not at rest");
        memcpy(s->x, s->start, s->bytes);
        settle_line("from flat", s, settle, false, report.seconds);
        settle_line("warm", s, settle, true, report.seconds);
        memcpy(s->x, end, s->bytes);
        settle_line("from its end", s, settle, false, report.seconds);
    }
    morph_trajectory_free(&t);
    morph_settle_destroy(settle);
}

/* Two centres a little inside the target, off its middle, each pulling a joint by its weight at most. */
static void centres(int nodes, morph_attractor c[2]) {
    const double width = 0.1 * (nodes - 1), weight = 0.02 * 9.81;
    const double strength = weight * 0.1 * 0.1 * 1.5 * sqrt(3.0);
    c[0] = (morph_attractor){{-0.15 * width, 0.02, 0.05 * width}, strength};
    c[1] = (morph_attractor){{0.2 * width, -0.1 * width, 0.05 * width}, strength};
}

static morph_settle *without_friction(const scene *s, const morph_attractor c[2]) {
    morph_settle_def sd = morph_settle_defaults();
    morph_settle *settle = NULL;
    sd.base = 0.0;
    sd.exact = s->exact;
    sd.attractor = c;
    sd.attractors = 2;
    return morph_settle_create(s->structure, s->sdf, &sd, &settle) == MORPH_OK ? settle : NULL;
}

static void placement_line(const char *name, scene *s, morph_settle *settle, bool warm) {
    morph_settle_report r = {0};
    const morph_status status = morph_settle_run(settle, s->x, warm, NULL, &r);
    printf("  %-14s %8.3f s  energy %.6f J  %s%s%s: %d steps, %d iterations, residual %.1e weights\n", name,
           r.seconds, r.energy, status == MORPH_OK ? "" : morph_status_text(status),
           r.converged ? "converged" : "NOT converged", r.stable ? ", stable" : "", r.steps, r.iterations,
           r.residual);
}

static void placement(scene *s, int nodes) {
    morph_attractor c[2];
    centres(nodes, c);
    morph_settle *settle = without_friction(s, c);
    if (!settle) return;
    printf(" no friction, two centres\n");
    memcpy(s->x, s->start, s->bytes);
    placement_line("cold", s, settle, false);
    c[0].at[0] += 0.05 * s->structure->spacing;
    if (morph_settle_attract(settle, c) == MORPH_OK) placement_line("warm, moved", s, settle, true);
    c[0].at[0] -= 0.05 * s->structure->spacing;
    if (morph_settle_attract(settle, c) == MORPH_OK) placement_line("warm, back", s, settle, true);
    c[0].strength *= 1.1;
    if (morph_settle_attract(settle, c) == MORPH_OK) placement_line("warm, stronger", s, settle, true);
    memcpy(s->x, s->start, s->bytes);
    placement_line("cold, stronger", s, settle, false);
    morph_settle_destroy(settle);
}

/* The energy along a line, and how far each value is from the straight one between its neighbours. */
static void curve(int nodes, bool sphere) {
    enum { POINTS = 41 };
    double energy[POINTS];
    scene s;
    morph_attractor c[2];
    centres(nodes, c);
    printf("%s, %d x %d: energy along a line of a centre, J\n", sphere ? "sphere" : "box", nodes, nodes);
    morph_settle *settle = make(&s, nodes, sphere) ? without_friction(&s, c) : NULL;
    if (settle) memcpy(s.x, s.start, s.bytes);
    for (int k = 0; settle && k < POINTS; k++) {
        morph_settle_report r = {0};
        if (morph_settle_attract(settle, c) != MORPH_OK ||
            morph_settle_run(settle, s.x, k > 0, NULL, &r) != MORPH_OK)
            break;
        energy[k] = r.energy;
        printf("  %.4f m  %.6f J  %s, %.3f s", c[0].at[0], r.energy,
               r.converged ? "converged" : "NOT converged", r.seconds);
        if (k > 1) printf(", bend %.1e", energy[k] - 2.0 * energy[k - 1] + energy[k - 2]);
        printf("\n");
        c[0].at[0] += 0.05 * s.structure->spacing;
    }
    morph_settle_destroy(settle);
    discard(&s);
}

int main(int argc, char **argv) {
    static const int sizes[] = {4, 8, 12, 16};
    const int count = argc > 1 ? argc - 1 : 4;
    setvbuf(stdout, NULL, _IOLBF, 0);
    morph_blas_threads(1);
    if (argc == 3 && strcmp(argv[1], "line") == 0) {
        const int nodes = atoi(argv[2]);
        if (nodes < 2) return 2;
        for (int sphere = 0; sphere < 2; sphere++)
            curve(nodes, sphere != 0);
        return 0;
    }
    for (int k = 0; k < count; k++)
        for (int sphere = 0; sphere < 2; sphere++) {
            const int nodes = argc > 1 ? atoi(argv[k + 1]) : sizes[k];
            scene s;
            printf("%s, %d x %d\n", sphere ? "sphere" : "box", nodes, nodes);
            if (nodes >= 2 && make(&s, nodes, sphere != 0)) {

                compare(&s);
                placement(&s, nodes);
            } else
                printf("  cannot be made\n");
            discard(&s);
            fflush(stdout);
        }
    return 0;
}
