/* The blanket on a deformable target: it comes to rest on it, both give way, nothing inverts, the body
 * carries its weight, momentum is kept. */
#include "model/blanket_internal.h"
#include "model/body_contact.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define RADIUS 0.12

static morph_body *ball(double radius, double height, double cell, const morph_body_def *def) {
    morph_mesh mesh;
    morph_tetra tetra;
    morph_tetra_report r;
    morph_distance *d;
    morph_body *b;
    const double radii[3] = {radius, radius, radius};
    assert_int_equal(morph_mesh_ellipsoid(radii, 2e-3 * radius, &mesh), MORPH_OK);
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += height;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, cell, &tetra, &r), MORPH_OK);
    assert_int_equal(morph_body_create(&tetra, def, &b), MORPH_OK);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    return b;
}

/* As a scene's: held by the lowest tenth of its height. */
static morph_body_def standing(void) {
    morph_body_def def = morph_body_defaults();
    def.base = 0.0;
    def.pin = 0.1 * 2.0 * RADIUS;
    def.drag = 0.2;
    return def;
}

typedef struct scene {
    morph_structure *s;
    morph_body *body;
    morph_blanket_def def;
    double *x0;
} scene;

static scene scene_create(int nodes, double height, const morph_body_def *body) {
    scene c = {0};
    morph_structure_def sd = morph_structure_defaults(0.1);
    sd.nodes[0] = sd.nodes[1] = nodes;
    sd.stiffness = 20.0;
    assert_int_equal(morph_structure_create(&sd, &c.s), MORPH_OK);
    c.body = ball(RADIUS, RADIUS, 0.05, body);
    c.x0 = malloc(3 * (size_t)c.s->joints * sizeof(double));
    assert_non_null(c.x0);
    for (int i = 0; i < 3 * c.s->joints; i++)
        c.x0[i] = c.s->start[i] + (i % 3 == 2 ? height : 0.0);
    c.def = (morph_blanket_def){.gravity = 9.81,
                                .drag = 0.2,
                                .friction = 0.4,
                                .time = 4.0,
                                .frame = 0.01,
                                .base = NAN,
                                .body = c.body};
    return c;
}

static void scene_free(scene *c) {
    morph_body_destroy(c->body);
    morph_structure_destroy(c->s);
    free(c->x0);
}

/* Least distance of links, and of the skin, to the body's surface beyond their radius: by tree searches of
 * its own on the surface as the body has it. */
static double clearance(const scene *c, const double *x) {
    morph_mesh surface;
    morph_distance *d;
    morph_closest at;
    double weight[3], least = INFINITY;
    assert_int_equal(morph_tetra_surface(&c->body->mesh, c->body->x, &surface), MORPH_OK);
    assert_int_equal(morph_distance_create(&surface, true, &d), MORPH_OK);
    for (int l = 0; l < c->s->links; l++) {
        morph_distance_segment(d, &x[3 * c->s->link[l][0]], &x[3 * c->s->link[l][1]], weight, &at);
        least = fmin(least, at.distance - c->s->link_radius[l]);
    }
    for (int t = 0; t < c->s->skin_triangles; t++) {
        const int *k = c->s->skin[t];
        morph_distance_triangle(d, &x[3 * k[0]], &x[3 * k[1]], &x[3 * k[2]], weight, &at);
        least = fmin(least, at.distance - c->s->def.radius);
    }
    morph_distance_destroy(d);
    morph_mesh_free(&surface);
    return least;
}

/* Mean force of the body on a blanket at rest, over the last half of n steps that go on from there. */
static void mean_force(const scene *c, const double *x, int n, double mean[3]) {
    morph_blanket_state *b;
    morph_blanket_def def = c->def;
    def.step = 0.002;
    assert_int_equal(morph_blanket_state_create(c->s, NULL, &def, x, &b), MORPH_OK);
    mean[0] = mean[1] = mean[2] = 0.0;
    for (int k = 0; k < n; k++) {
        double force[3];
        assert_true(morph_blanket_step(b));
        morph_blanket_soft_force(b, force);
        for (int i = 0; i < 3 && k >= n / 2; i++)
            mean[i] += force[i] / (n - n / 2);
    }
    morph_blanket_state_destroy(b);
}

static double highest(const double *x, int vertices) {
    double top = -INFINITY;
    for (int i = 0; i < vertices; i++)
        top = fmax(top, x[3 * i + 2]);
    return top;
}

/* Falls on a soft ball and rests there. */
static void test_rest(void **state) {
    (void)state;
    const morph_body_def def = standing();
    scene c = scene_create(4, 0.30, &def);
    morph_trajectory t;
    morph_blanket_report r;
    double force[3];
    assert_int_equal(morph_blanket_run(c.s, NULL, NULL, &c.def, c.x0, NULL, &t, &r), MORPH_OK);
    const double *end = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)t.joints];
    const double weight = c.s->joints * c.s->def.mass * 9.81, spacing = c.s->spacing;
    const double pressed = 2.0 * RADIUS - highest(c.body->x, c.body->vertices);
    const double sunk = highest(c.s->start, c.s->joints) + 2.0 * RADIUS - highest(end, t.joints);
    const double least = morph_body_least_volume(c.body), gap = clearance(&c, end);
    mean_force(&c, end, 200, force);
    print_message(
        "at rest after %.2f s: ball pressed by %.4f m, blanket's top %.4f m lower than on a rigid "
        "one, least volume %.2f, clearance %.1e m, worst of all frames %.1e, force %.4f of the "
        "weight (sideways %.1e); %d frames redone, %ld substeps of %d tetrahedra, %.2f s\n",
        t.time[t.frames - 1], pressed, sunk, least, gap, -r.worst_clearance, force[2] / weight,
        hypot(force[0], force[1]) / weight, r.step_halvings, c.body->counts.steps, c.body->mesh.tets,
        r.seconds);
    assert_true(r.at_rest);
    assert_int_equal(r.step_halvings, 0);
    /* Both gave way: the ball is lower, the blanket draped around it. */
    assert_true(pressed > 0.004);
    assert_true(highest(end, t.joints) - end[2] > 0.5 * spacing);
    assert_true(least > 0.5);
    assert_true(r.worst_length <= 1e-9 * spacing);
    assert_true(gap >= -1e-3 * spacing);
    assert_true(gap < 5e-3 * spacing);
    assert_true(r.worst_clearance <= 1e-3 * spacing);
    assert_true(fabs(force[2] / weight - 1.0) < 0.02);
    assert_true(hypot(force[0], force[1]) < 0.02 * weight);
    morph_trajectory_free(&t);
    scene_free(&c);
}

/* A box's corners are light and sharp: the sheet that hangs over them comes to rest, and what is left of
 * their trembling is slow beside a fall of a spacing, 1.4 m/s. */
static void test_corners(void **state) {
    (void)state;
    static const double size[3] = {0.2, 0.2, 0.1};
    morph_structure_def sd = morph_structure_defaults(0.1);
    morph_body_def def = morph_body_defaults();
    morph_mesh mesh;
    morph_tetra tetra;
    morph_tetra_report made;
    morph_distance *d;
    scene c = {0};
    sd.nodes[0] = sd.nodes[1] = 5;
    sd.stiffness = 20.0;
    def.base = 0.0;
    def.pin = 0.01;
    def.drag = 0.2;
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += 0.05;
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, 0.04, &tetra, &made), MORPH_OK);
    assert_int_equal(morph_body_create(&tetra, &def, &c.body), MORPH_OK);
    assert_int_equal(morph_structure_create(&sd, &c.s), MORPH_OK);
    c.x0 = malloc(3 * (size_t)c.s->joints * sizeof(double));
    assert_non_null(c.x0);
    for (int i = 0; i < 3 * c.s->joints; i++)
        c.x0[i] = c.s->start[i] + (i % 3 == 2 ? 0.2 : 0.0);
    c.def = (morph_blanket_def){.gravity = 9.81,
                                .drag = 0.2,
                                .friction = 0.4,
                                .time = 6.0,
                                .frame = 0.01,
                                .base = 0.0,
                                .body = c.body};
    morph_trajectory t;
    morph_blanket_report r;
    assert_int_equal(morph_blanket_run(c.s, NULL, NULL, &c.def, c.x0, NULL, &t, &r), MORPH_OK);
    const double *end = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)t.joints], gap = clearance(&c, end);
    print_message(
        "box: at rest %d after %.2f s at %.1e m/s, clearance %.1e m, worst of all frames %.1e, %d frames "
        "redone, %.2f s\n",
        r.at_rest, t.time[t.frames - 1], r.rest_speed, gap, -r.worst_clearance, r.step_halvings, r.seconds);
    assert_true(r.at_rest && r.rest_speed < 0.03);
    assert_true(highest(end, t.joints) - end[2] > 0.5 * c.s->spacing);
    assert_true(gap >= -1e-3 * c.s->spacing && r.worst_clearance <= 1e-3 * c.s->spacing);
    assert_true(r.worst_length <= 1e-9 * c.s->spacing);
    morph_trajectory_free(&t);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    scene_free(&c);
}

/* Blanket and body together. */
static void momentum(const morph_blanket_state *b, double p[3]) {
    for (int k = 0; k < 3; k++)
        p[k] = 0.0;
    for (int i = 0; i < 3 * b->joints; i++)
        p[i % 3] += b->structure->def.mass * b->v[i];
    for (int i = 0; i < 3 * b->def.body->vertices; i++)
        p[i % 3] += b->def.body->mass[i / 3] * b->def.body->v[i];
}

/* Thrown at a free ball, with friction: what the blanket loses the ball gets. */
static void test_momentum(void **state) {
    (void)state;
    morph_body_def def = morph_body_defaults();
    def.gravity = 0.0;
    scene c = scene_create(4, 0.26, &def);
    const double thrown[3] = {0.3, 0.0, -1.0};
    c.def.gravity = c.def.drag = 0.0;
    memcpy(c.def.velocity, thrown, sizeof thrown);
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(c.s, NULL, &c.def, c.x0, &b), MORPH_OK);
    double before[3], after[3], blanket = 0.0, least = INFINITY;
    momentum(b, before);
    for (int k = 0; k < 200; k++) {
        assert_true(morph_blanket_step(b));
        least = fmin(least, morph_body_least_volume(c.body));
    }
    momentum(b, after);
    for (int j = 0; j < b->joints; j++)
        blanket += c.s->def.mass * b->v[3 * j + 2];
    const double lost = morph_dist(before, after) / morph_norm(before);
    print_message("thrown: momentum changes by %.1e, the blanket keeps %.2f of its own, least volume %.2f\n",
                  lost, blanket / before[2], least);
    assert_true(lost < 1e-10);
    assert_true(blanket / before[2] < 0.8);
    assert_true(least > 0.0);
    morph_blanket_state_destroy(b);
    scene_free(&c);
}

/* Twice the same bits; and a step that is far too long for the blanket's springs is redone, body and all. */
static void test_repeats(void **state) {
    (void)state;
    const morph_body_def def = standing();
    double *first = NULL;
    size_t n = 0;
    for (int run = 0; run < 3; run++) {
        scene c = scene_create(3, 0.27, &def);
        morph_trajectory t;
        morph_blanket_report r;
        c.def.time = 0.4;
        if (run == 2) {
            c.def.frame = 0.05;
            c.def.step = 0.05;
        }
        assert_int_equal(morph_blanket_run(c.s, NULL, NULL, &c.def, c.x0, NULL, &t, &r), MORPH_OK);
        n = 3 * (size_t)c.body->vertices;
        if (run == 0) {
            first = malloc(n * sizeof *first);
            assert_non_null(first);
            memcpy(first, c.body->x, n * sizeof *first);
        }
        if (run == 1) assert_memory_equal(first, c.body->x, n * sizeof *first);
        if (run == 2) {
            assert_true(r.step_halvings > 0);
            assert_true(morph_body_least_volume(c.body) > 0.0);
            assert_true(r.worst_clearance <= 1e-3 * c.s->spacing);
        }
        morph_trajectory_free(&t);
        scene_free(&c);
    }
    free(first);
}

/* A ball on a rising table presses into a blanket held at its border. */
static void test_rise(void **state) {
    (void)state;
    morph_structure_def sd = morph_structure_defaults(0.1);
    sd.nodes[0] = sd.nodes[1] = 5;
    sd.stiffness = 20.0;
    sd.fixed = MORPH_FIXED_BORDER;
    const morph_body_def def = standing();
    scene c = {.body = ball(RADIUS, RADIUS, 0.05, &def)};
    assert_int_equal(morph_structure_create(&sd, &c.s), MORPH_OK);
    c.x0 = malloc(3 * (size_t)c.s->joints * sizeof(double));
    assert_non_null(c.x0);
    for (int i = 0; i < 3 * c.s->joints; i++)
        c.x0[i] = c.s->start[i] + (i % 3 == 2 ? 2.0 * RADIUS - 0.04 : 0.0);
    c.def = (morph_blanket_def){.gravity = 9.81,
                                .drag = 0.2,
                                .friction = 0.4,
                                .time = 3.0,
                                .frame = 0.01,
                                .base = NAN,
                                .fixed = c.s->fixed_joint,
                                .fixed_count = c.s->fixed_joints,
                                .rise = 0.06,
                                .rise_time = 1.0,
                                .body = c.body};
    morph_trajectory t;
    morph_blanket_report r;
    assert_int_equal(morph_blanket_run(c.s, NULL, NULL, &c.def, c.x0, NULL, &t, &r), MORPH_OK);
    const double *end = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)t.joints];
    double foot = 0.0; /* off its place */
    for (int i = 0; i < c.body->vertices; i++)
        if (c.body->inverse[i] == 0.0)
            foot = fmax(foot, morph_dist(&c.body->x[3 * i], &c.body->mesh.v[3 * i]));
    print_message(
        "rise: held up %d, short of %.4f m, foot off its place by %.1e m, top of the ball %.4f m, of the "
        "blanket "
        "%.4f m, clearance %.1e m, at rest %d, least volume %.2f, %d redone\n",
        r.held_up, r.short_of, foot, highest(c.body->x, c.body->vertices), highest(end, t.joints),
        clearance(&c, end), r.at_rest, morph_body_least_volume(c.body), r.step_halvings);
    assert_false(r.held_up);
    assert_true(r.at_rest);
    assert_true(foot < 1e-9);
    assert_true(clearance(&c, end) >= -1e-3 * c.s->spacing);
    assert_true(highest(c.body->x, c.body->vertices) < 2.0 * RADIUS - 0.004);
    assert_true(morph_body_least_volume(c.body) > 0.0);
    morph_trajectory_free(&t);
    scene_free(&c);
}

static morph_status refused(const scene *c, const morph_sdf *sdf) {
    morph_trajectory t;
    const morph_status status = morph_blanket_run(c->s, sdf, NULL, &c->def, c->x0, NULL, &t, NULL);
    morph_trajectory_free(&t);
    return status;
}

static void test_refused(void **state) {
    (void)state;
    morph_body_def def = standing();
    scene c = scene_create(3, 0.3, &def);
    morph_mesh mesh;
    morph_distance *d;
    morph_sdf *sdf;
    const double size[3] = {0.1, 0.1, 0.1}, lo[3] = {-0.2, -0.2, -0.2}, hi[3] = {0.2, 0.2, 0.2};
    c.def.time = 0.02;
    assert_int_equal(refused(&c, NULL), MORPH_OK);
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_sdf_create(d, lo, hi, 0.05, NULL, &sdf), MORPH_OK);
    assert_int_equal(refused(&c, sdf), MORPH_ERR_INPUT); /* two targets */
    morph_sdf_destroy(sdf);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    c.body->x[7] = NAN;
    assert_int_equal(refused(&c, NULL), MORPH_ERR_INPUT);
    scene_free(&c);
    def.young = 1e15; /* 1e6 and more steps of the body in a frame */
    c = scene_create(3, 0.3, &def);
    c.def.frame = 1.0;
    assert_int_equal(refused(&c, NULL), MORPH_ERR_INPUT);
    scene_free(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_rest),     cmocka_unit_test(test_corners),
                                       cmocka_unit_test(test_momentum), cmocka_unit_test(test_repeats),
                                       cmocka_unit_test(test_rise),     cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
