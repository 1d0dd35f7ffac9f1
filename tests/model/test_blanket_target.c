/* The blanket on targets: friction on a slope, drops over a box and a sphere with every limit measured anew.
 */
#include "model/blanket_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef struct scene {
    morph_mesh mesh;
    morph_distance *exact;
    morph_sdf *sdf;
    morph_structure *structure;
    double *start;
    morph_blanket_def def;
} scene;

static void mesh_alloc(morph_mesh *m, int vertices, int triangles) {
    m->vertices = vertices;
    m->triangles = 0;
    m->v = malloc(3 * (size_t)vertices * sizeof(double));
    m->t = malloc(3 * (size_t)triangles * sizeof(int));
    assert_true(m->v && m->t);
}

static void add_triangle(morph_mesh *m, int a, int b, int c) {
    int *t = &m->t[3 * m->triangles++];
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

/* Box on the plane z = 0, centred in x and y. */
static void make_box(morph_mesh *m, const double size[3]) {
    static const int face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    mesh_alloc(m, 8, 12);
    for (int i = 0; i < 8; i++) {
        m->v[3 * i] = ((i & 1) ? 0.5 : -0.5) * size[0];
        m->v[3 * i + 1] = ((i & 2) ? 0.5 : -0.5) * size[1];
        m->v[3 * i + 2] = (i & 4) ? size[2] : 0.0;
    }
    for (int f = 0; f < 6; f++) {
        add_triangle(m, face[f][0], face[f][1], face[f][2]);
        add_triangle(m, face[f][0], face[f][2], face[f][3]);
    }
}

/* Sphere standing on the plane z = 0. */
static void make_sphere(morph_mesh *m, double radius) {
    enum { AROUND = 32, DOWN = 16 };
    const double pi = acos(-1.0);
    mesh_alloc(m, 2 + AROUND * (DOWN - 1), 2 * AROUND * (DOWN - 1));
    int n = 0;
    for (int j = 1; j < DOWN; j++)
        for (int i = 0; i < AROUND; i++, n++) {
            const double a = 2.0 * pi * i / AROUND, b = pi * j / DOWN;
            m->v[3 * n] = radius * sin(b) * cos(a);
            m->v[3 * n + 1] = radius * sin(b) * sin(a);
            m->v[3 * n + 2] = radius * (1.0 + cos(b));
        }
    for (int k = 0; k < 6; k++)
        m->v[3 * n + k] = k == 2 ? 2.0 * radius : 0.0;
    for (int i = 0; i < AROUND; i++) {
        const int next = (i + 1) % AROUND, last = (DOWN - 2) * AROUND;
        add_triangle(m, n, i, next);
        add_triangle(m, last + i, n + 1, last + next);
        for (int j = 0; j < DOWN - 2; j++) {
            const int a = j * AROUND;
            add_triangle(m, a + i, a + AROUND + i, a + AROUND + next);
            add_triangle(m, a + i, a + AROUND + next, a + next);
        }
    }
}

/* nodes x nodes grid of spacing 0.1 over the mesh in s->mesh, one spacing above it. */
static void make_scene(scene *s, int nodes, double stiffness, int cells) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = nodes;
    def.stiffness = stiffness;
    assert_int_equal(morph_structure_create(&def, &s->structure), MORPH_OK);
    assert_int_equal(morph_distance_create(&s->mesh, true, &s->exact), MORPH_OK);
    double lo[3] = {-0.2, -0.2, -0.05}, hi[3] = {0.2, 0.2, 0.0};
    for (int i = 0; i < s->mesh.vertices; i++)
        for (int k = 0; k < 3; k++) {
            lo[k] = fmin(lo[k], s->mesh.v[3 * i + k] - 0.05);
            hi[k] = fmax(hi[k], s->mesh.v[3 * i + k] + 0.05);
        }
    assert_int_equal(morph_sdf_create(s->exact, lo, hi, 0.1 / cells, NULL, &s->sdf), MORPH_OK);
    s->start = malloc(3 * (size_t)s->structure->joints * sizeof(double));
    assert_non_null(s->start);
    for (int i = 0; i < 3 * s->structure->joints; i++)
        s->start[i] = s->structure->start[i] + (i % 3 == 2 ? hi[2] + 0.05 : 0.0);
    s->def = (morph_blanket_def){
        .gravity = 9.81, .drag = 0.2, .friction = 0.6, .time = 12.0, .frame = 0.02, .base = 0.0};
}

static void free_scene(scene *s) {
    free(s->mesh.v);
    free(s->mesh.t);
    morph_distance_destroy(s->exact);
    morph_sdf_destroy(s->sdf);
    morph_structure_destroy(s->structure);
    free(s->start);
}

static const double *frame_of(const morph_trajectory *t, int frame) {
    return &t->x[(size_t)frame * 3 * (size_t)t->joints];
}

typedef struct figures {
    double length, post, angle, depth; /* worst violations: spacings, relative, degrees, spacings */
} figures;

static void measure_angles(const morph_structure *s, const double *x, figures *f) {
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        int uj[2], vj[2];
        double u[3], v[3];
        const bool post = t < s->link_posts;
        const double *limit = post ? s->link_post_limit[t] : s->link_link_limit[t - s->link_posts];
        if (post)
            morph_link_post_joints(s, t, uj, vj);
        else
            morph_link_link_joints(s, t - s->link_posts, uj, vj);
        morph_sub(&x[3 * uj[1]], &x[3 * uj[0]], u);
        morph_sub(&x[3 * vj[1]], &x[3 * vj[0]], v);
        const double a = acos(morph_dot(u, v) / (morph_norm(u) * morph_norm(v)));
        f->angle = fmax(f->angle, fmax(limit[0] - a, a - limit[1]) * 180.0 / acos(-1.0));
    }
}

/* By the test's own arithmetic and the exact distance; tree searches only every fifth frame. */
static void measure_frame(const scene *sc, const double *x, bool searched, figures *f) {
    const morph_structure *s = sc->structure;
    double weight[3];
    morph_closest at;
    for (int l = 0; l < s->links; l++) {
        const double *a = &x[3 * s->link[l][0]], *b = &x[3 * s->link[l][1]], size = morph_dist(a, b);
        f->length = fmax(f->length, (s->length_limit[l][0] - size) / s->spacing);
        f->length = fmax(f->length, (size - s->length_limit[l][1]) / s->spacing);
        if (!searched) continue;
        morph_distance_segment(sc->exact, a, b, weight, &at);
        f->depth = fmax(f->depth, (s->link_radius[l] - at.distance) / s->spacing);
    }
    for (int t = 0; t < s->skin_triangles && searched; t++) {
        morph_distance_triangle(sc->exact, &x[3 * s->skin[t][0]], &x[3 * s->skin[t][1]],
                                &x[3 * s->skin[t][2]], weight, &at);
        f->depth = fmax(f->depth, (s->def.radius - at.distance) / s->spacing);
    }
    for (int p = 0; p < s->posts; p++)
        f->post =
            fmax(f->post,
                 fabs(morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]) / s->post_length[p] - 1.0));
    for (int j = 0; j < s->joints; j++)
        f->depth = fmax(f->depth, (s->def.radius - x[3 * j + 2]) / s->spacing);
    measure_angles(s, x, f);
}

/* Mean over the skin of the distance to target or base plane, less the radius, in spacings. */
static double mean_gap(const scene *sc, const double *x) {
    enum { CUTS = 4 };
    const morph_structure *s = sc->structure;
    double sum = 0.0;
    int count = 0;
    for (int t = 0; t < s->skin_triangles; t++)
        for (int i = 0; i < CUTS; i++)
            for (int j = 0; i + j < CUTS; j++, count++) {
                const double u = (i + 1.0 / 3.0) / CUTS, v = (j + 1.0 / 3.0) / CUTS;
                double q[3];
                for (int k = 0; k < 3; k++)
                    q[k] = u * x[3 * s->skin[t][0] + k] + v * x[3 * s->skin[t][1] + k] +
                           (1.0 - u - v) * x[3 * s->skin[t][2] + k];
                morph_closest at;
                morph_distance_point(sc->exact, q, &at);
                sum += fmin(at.distance, q[2]) - s->def.radius;
            }
    return sum / count / s->spacing;
}

static void run(const scene *s, morph_trajectory *t, morph_blanket_report *report) {
    assert_int_equal(morph_blanket_run(s->structure, s->sdf, s->exact, &s->def, s->start, NULL, t, report),
                     MORPH_OK);
}

/* Drops, measures everything anew, and holds it to `most` mean gap. */
static void drop(scene *s, const char *name, double most, bool rests) {
    morph_trajectory t;
    morph_blanket_report report;
    run(s, &t, &report);
    figures f = {0};
    for (int k = 0; k < t.frames; k++)
        measure_frame(s, frame_of(&t, k), k % 5 == 0 || k == t.frames - 1, &f);
    const double gap = mean_gap(s, frame_of(&t, t.frames - 1));
    print_message(
        "%s: gap %.3f, length %.1e, post %.1e, angle %.3f deg, depth %.1e, %d steps, ended %.2f s at "
        "%.1e m/s, took %.2f s\n",
        name, gap, f.length, f.post, f.angle, f.depth, report.steps, t.time[t.frames - 1], report.rest_speed,
        report.seconds);
    /* The last figure of each is rounding of coordinates. */
    assert_true(f.length <= 1e-9 + 1e-12 && f.post <= 1e-9 + 1e-12 && f.angle <= 0.5 &&
                f.depth <= 1e-3 + 1e-6);
    assert_true(report.worst_length <= 1e-10 && report.worst_post <= 1e-9);
    assert_true(report.worst_clearance <= 2e-4);
    assert_int_equal(report.step_halvings, 0);
    assert_true(gap > 0.0 && gap <= most);
    assert_true(report.rest_speed <= 0.05);
    if (rests) assert_true(report.at_rest && t.time[t.frames - 1] < 12.0);
    morph_trajectory_free(&t);
}

static void test_box(void **state) {
    (void)state;
    static const double small[3] = {0.15, 0.15, 0.09}, large[3] = {0.35, 0.35, 0.21};
    scene s = {0};
    make_box(&s.mesh, small);
    make_scene(&s, 4, 200.0, 16);
    drop(&s, "box 4 x 4", 0.35, true);
    free_scene(&s);
    /* The default springs carry the grid as a stiff plate; soft ones leave it to the length limits. */
    for (int soft = 0; soft < 2; soft++) {
        s = (scene){0};
        make_box(&s.mesh, large);
        make_scene(&s, 8, soft ? 10.0 : 200.0, 12);
        drop(&s, soft ? "box 8 x 8, soft" : "box 8 x 8", soft ? 0.2 : 0.45, false);
        free_scene(&s);
    }
}

static void test_sphere(void **state) {
    (void)state;
    scene s = {0};
    make_sphere(&s.mesh, 0.09);
    make_scene(&s, 4, 200.0, 12);
    drop(&s, "sphere 4 x 4", 0.28, true);
    free_scene(&s);
    for (int soft = 0; soft < 2; soft++) {
        s = (scene){0};
        make_sphere(&s.mesh, 0.21);
        make_scene(&s, 8, soft ? 50.0 : 200.0, 10);
        drop(&s, soft ? "sphere 8 x 8, soft" : "sphere 8 x 8", soft ? 0.2 : 0.28, !soft);
        free_scene(&s);
    }
}

/* Two joints and a link across the slope of a slab tilted by `angle` about y, its surface through the
 * origin. Returns twice the way slid over the time squared: the mean acceleration. */
static double slide(double angle, double friction) {
    static const double slab[3] = {4.0, 2.0, 1.0};
    int link[1][2] = {{0, 1}}, kind[1] = {MORPH_LINK_BOTTOM};
    double limit[1][2] = {{0.05, 0.2}}, length[1] = {0.1}, radius[1] = {0.004};
    morph_structure pair = {.def = morph_structure_defaults(0.1),
                            .joints = 2,
                            .links = 1,
                            .link = link,
                            .link_kind = kind,
                            .length_limit = limit,
                            .start_length = length,
                            .link_radius = radius,
                            .spacing = 0.1};
    scene s = {0};
    make_box(&s.mesh, slab);
    const double c = cos(angle), d = sin(angle), above = radius[0] + 1.2e-3 * pair.spacing;
    for (int i = 0; i < s.mesh.vertices; i++) {
        double *v = &s.mesh.v[3 * i];
        const double x = v[0], z = v[2] - slab[2];
        v[0] = c * x + d * z;
        v[2] = -d * x + c * z;
    }
    make_scene(&s, 2, 200.0, 2);
    s.def =
        (morph_blanket_def){.gravity = 9.81, .friction = friction, .time = 0.5, .frame = 0.01, .base = NAN};
    const double start[6] = {d * above, -0.05, c * above, d * above, 0.05, c * above};
    morph_trajectory t;
    assert_int_equal(morph_blanket_run(&pair, s.sdf, NULL, &s.def, start, NULL, &t, NULL), MORPH_OK);
    const double *end = frame_of(&t, t.frames - 1), time = t.time[t.frames - 1];
    const double way = c * (end[0] - start[0]) - d * (end[2] - start[2]);
    assert_true(fabs(d * end[0] + c * end[2] - above) < 1e-3 * pair.spacing);
    morph_trajectory_free(&t);
    free_scene(&s);
    return 2.0 * way / (time * time);
}

/* Sticks below atan(friction), slides above with g (sin - friction cos). */
static void test_friction(void **state) {
    (void)state;
    const double g = 9.81, critical = atan(0.5), above = critical + 0.05;
    const double stuck = slide(critical - 0.01, 0.5), sliding = slide(above, 0.5), bare = slide(0.3, 0.0);
    const double expected = g * (sin(above) - 0.5 * cos(above));
    print_message("slope: stuck %.1e, sliding %.4f (closed form %.4f), bare %.4f (%.4f) m/s2\n", stuck,
                  sliding, expected, bare, g * sin(0.3));
    assert_true(fabs(stuck) < 2e-3);
    assert_true(fabs(sliding / expected - 1.0) < 0.05);
    assert_true(fabs(bare / (g * sin(0.3)) - 1.0) < 0.01);
}

/* Same input, same bits; and the motion does not feel what is recorded of it. */
static void test_determinism(void **state) {
    (void)state;
    static const double size[3] = {0.15, 0.15, 0.09};
    scene s = {0};
    make_box(&s.mesh, size);
    make_scene(&s, 4, 200.0, 8);
    s.def.time = 1.0;
    s.def.step = 1.0 / 512.0;
    s.def.frame = 1.0 / 64.0;
    morph_trajectory a, b, c;
    run(&s, &a, NULL);
    run(&s, &b, NULL);
    const size_t width = 3 * (size_t)a.joints;
    assert_int_equal(a.frames, b.frames);
    assert_memory_equal(a.x, b.x, (size_t)a.frames * width * sizeof(double));
    /* Without exact distances, which are taken once a frame. */
    morph_distance *exact = s.exact;
    s.exact = NULL;
    morph_trajectory_free(&a);
    run(&s, &a, NULL);
    s.def.frame = 1.0 / 16.0;
    run(&s, &c, NULL);
    s.exact = exact;
    for (int f = 0; f < c.frames && 4 * f < a.frames; f++)
        assert_memory_equal(frame_of(&c, f), frame_of(&a, 4 * f), width * sizeof(double));
    assert_true(c.frames > 4);
    morph_trajectory_free(&a);
    morph_trajectory_free(&b);
    morph_trajectory_free(&c);
    free_scene(&s);
}

/* Skipping what is far must not miss a contact: no place within 0.003 spacings of its radius sleeps. */
static void test_nothing_is_missed(void **state) {
    (void)state;
    static const double size[3] = {0.15, 0.15, 0.09};
    scene s = {0};
    make_box(&s.mesh, size);
    make_scene(&s, 4, 200.0, 8);
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(s.structure, s.sdf, &s.def, s.start, &b), MORPH_OK);
    int touched = 0, asleep = 0;
    for (int step = 0; step < 600; step++) {
        assert_true(morph_blanket_step(b));
        for (int t = 0; t < b->touches; t++) {
            const morph_touch *touch = &b->touch[t];
            double q[3] = {0.0};
            for (int j = 0; j < touch->corners; j++)
                for (int k = 0; k < 3; k++)
                    q[k] += touch->weight[j] * b->x[3 * touch->joint[j] + k];
            const bool sleeps = morph_blanket_sleeps(b, t);
            asleep += sleeps;
            if (morph_sdf_eval(b->sdf, q, NULL, NULL) > touch->radius + 3e-4) continue;
            touched++;
            assert_false(sleeps);
        }
    }
    assert_true(touched > 0 && asleep > 1000);
    morph_blanket_state_destroy(b);
    free_scene(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_box), cmocka_unit_test(test_sphere),
                                       cmocka_unit_test(test_friction), cmocka_unit_test(test_determinism),
                                       cmocka_unit_test(test_nothing_is_missed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
