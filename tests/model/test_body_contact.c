/* Contact of a sheet with a deformable body: places, momentum, a sheet that comes to rest on a soft ball. */
#include "model/body_contact.h"
#include "solids.h"

enum { SIDE = 4, JOINTS = SIDE * SIDE, CELLS = (SIDE - 1) * (SIDE - 1), LINKS = 2 * SIDE * (SIDE - 1) };

static morph_body *body_of(morph_mesh *mesh, double cell, const morph_body_def *def) {
    morph_distance *d;
    morph_tetra tetra;
    morph_tetra_report r;
    morph_body *b;
    assert_int_equal(morph_distance_create(mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, cell, &tetra, &r), MORPH_OK);
    assert_int_equal(morph_body_create(&tetra, def, &b), MORPH_OK);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(mesh);
    return b;
}

static morph_body *ball_body(double radius, double height, double cell, const morph_body_def *def) {
    morph_mesh mesh;
    const double radii[3] = {radius, radius, radius};
    assert_int_equal(morph_mesh_ellipsoid(radii, 1e-4 * radius, &mesh), MORPH_OK);
    for (int i = 0; i < mesh.vertices; i++)
        mesh.v[3 * i + 2] += height;
    return body_of(&mesh, cell, def);
}

/* A square sheet with places at joints, in the middles of links and of triangles. */
typedef struct square {
    double x[3 * JOINTS], v[3 * JOINTS], before[3 * JOINTS], inverse[JOINTS];
    int link[LINKS + 2 * CELLS][2], links;
    int triangle[2 * CELLS][3];
    morph_body_place place[JOINTS + LINKS + 2 * CELLS];
    int places;
    double spacing, mass;
    morph_body_contacts *contacts;
} square;

static void add_place(square *s, const int *joint, int corners, double radius) {
    morph_body_place *p = &s->place[s->places++];
    *p = (morph_body_place){.corners = corners, .radius = radius};
    for (int k = 0; k < corners; k++) {
        p->joint[k] = joint[k];
        p->weight[k] = 1.0 / corners;
    }
}

static void add_link(square *s, int a, int b) {
    s->link[s->links][0] = a;
    s->link[s->links++][1] = b;
}

static void square_create(square *s, const morph_body *b, double spacing, double height, double mass) {
    const double radius = 0.05 * spacing;
    memset(s, 0, sizeof *s);
    s->spacing = spacing;
    s->mass = mass;
    for (int j = 0; j < JOINTS; j++) {
        const double at[3] = {(j % SIDE - 1.5) * spacing, (j / SIDE - 1.5) * spacing, height};
        memcpy(&s->x[3 * j], at, sizeof at);
        s->inverse[j] = 1.0 / mass;
        if (j % SIDE < SIDE - 1) add_link(s, j, j + 1);
        if (j / SIDE < SIDE - 1) add_link(s, j, j + SIDE);
    }
    for (int i = 0, t = 0; i < JOINTS - SIDE; i++)
        if (i % SIDE < SIDE - 1) {
            const int two[2][3] = {{i, i + 1, i + SIDE + 1}, {i, i + SIDE + 1, i + SIDE}};
            memcpy(s->triangle[t], two, sizeof two);
            t += 2;
        }
    for (int j = 0; j < JOINTS; j++)
        add_place(s, &j, 1, radius);
    for (int l = 0; l < LINKS; l++)
        add_place(s, s->link[l], 2, radius);
    for (int t = 0; t < 2 * CELLS; t++)
        add_place(s, s->triangle[t], 3, radius);
    const morph_body_sheet sheet = {.joints = JOINTS,
                                    .places = s->places,
                                    .triangles = 2 * CELLS,
                                    .inverse = s->inverse,
                                    .place = s->place,
                                    .triangle = (const int(*)[3])s->triangle,
                                    .radius = radius,
                                    .margin = 1e-3 * spacing};
    assert_int_equal(morph_body_contacts_create(b, &sheet, &s->contacts), MORPH_OK);
}

/* Springs, gravity, drag; then the body; then contact by sweeps. */
static void couple(square *s, morph_body *b, double h, double gravity, double drag, double stiffness,
                   double friction) {
    for (int l = 0; l < s->links; l++) {
        const int i = s->link[l][0], j = s->link[l][1];
        double d[3];
        morph_sub(&s->x[3 * j], &s->x[3 * i], d);
        const double length = morph_norm(d), force = stiffness * (length - s->spacing) / length;
        for (int k = 0; k < 3; k++) {
            s->v[3 * i + k] += h * force * d[k] / s->mass;
            s->v[3 * j + k] -= h * force * d[k] / s->mass;
        }
    }
    memcpy(s->before, s->x, sizeof s->x);
    for (int k = 0; k < 3 * JOINTS; k++) {
        s->v[k] -= h * ((k % 3 == 2) * gravity + drag * s->v[k]);
        s->x[k] += h * s->v[k];
    }
    assert_true(morph_body_step(b, h, NULL));
    assert_int_equal(morph_body_contacts_find(s->contacts, s->x, s->before, 0.05 * s->spacing), MORPH_OK);
    const int n = morph_body_contacts_count(s->contacts);
    for (int sweep = 0; sweep < 12; sweep++)
        for (int k = 0; k < n; k++)
            morph_body_contact_project(s->contacts, sweep & 1 ? n - 1 - k : k, s->x, b, friction);
    morph_body_moved(b, h);
    for (int k = 0; k < 3 * JOINTS; k++)
        s->v[k] = (s->x[k] - s->before[k]) / h;
}

static void momenta(const square *s, const morph_body *b, double p[3], double l[3]) {
    double c[3];
    for (int k = 0; k < 3; k++)
        p[k] = l[k] = 0.0;
    for (int n = 0; n < JOINTS + b->vertices; n++) {
        const bool sheet = n < JOINTS;
        const int i = sheet ? n : n - JOINTS;
        const double *x = sheet ? &s->x[3 * i] : &b->x[3 * i], *v = sheet ? &s->v[3 * i] : &b->v[3 * i];
        const double m = sheet ? s->mass : b->mass[i];
        morph_cross(x, v, c);
        for (int k = 0; k < 3; k++) {
            p[k] += m * v[k];
            l[k] += m * c[k];
        }
    }
}

/* Single places around and inside a ball: depth and direction are those of the radius. */
static void test_places(void **state) {
    (void)state;
    const morph_body_def def = morph_body_defaults();
    morph_body *b = ball_body(1.0, 0.0, 0.2, &def);
    const double inverse[1] = {1.0};
    double x[3];
    morph_body_contacts *c;
    const morph_body_place place = {.corners = 1, .weight = {1.0}, .radius = 0.1};
    const morph_body_sheet sheet = {.joints = 1, .places = 1, .inverse = inverse, .place = &place};
    assert_int_equal(morph_body_contacts_create(b, &sheet, &c), MORPH_OK);
    for (int round = 0; round < 500; round++) {
        random_point(-1.4, 1.4, x);
        const double r = morph_norm(x);
        assert_int_equal(morph_body_contacts_find(c, x, x, 0.05), MORPH_OK);
        const int n = morph_body_contacts_count(c);
        /* Facets lie within a hundredth of the ball. */
        if (r > 1.15) assert_int_equal(n, 0);
        if (r < 1.13) assert_int_equal(n, 1);
        if (n == 0 || r < 0.95) continue;
        const morph_body_touch *t = morph_body_contacts_list(c);
        double s[3] = {0, 0, 0}, sum = 0.0;
        for (int k = 0; k < 3; k++) {
            sum += t->body_weight[k];
            for (int i = 0; i < 3; i++)
                s[i] += t->body_weight[k] * b->x[3 * t->vertex[k] + i];
        }
        assert_near(sum, 1.0, 1e-12);
        assert_near(morph_norm(t->normal), 1.0, 1e-9);
        assert_true(morph_dot(t->normal, x) / r > 0.9);
        assert_near(morph_body_contacts_depth(c), fmax(0.0, 0.1 + 1.0 - r), 0.02);
        /* The level asks for the radius from the surface: corrected, the place is there. */
        double moved[3] = {x[0], x[1], x[2]};
        double *keep = morph_alloc(3 * (size_t)b->vertices, sizeof *keep);
        assert_non_null(keep);
        memcpy(keep, b->x, 3 * (size_t)b->vertices * sizeof *keep);
        morph_body_contact_project(c, 0, moved, b, 0.0);
        assert_int_equal(morph_body_contacts_find(c, moved, moved, 0.05), MORPH_OK);
        assert_true(morph_body_contacts_depth(c) < 0.05);
        memcpy(b->x, keep, 3 * (size_t)b->vertices * sizeof *keep);
        free(keep);
    }
    x[0] = NAN;
    assert_int_equal(morph_body_contacts_find(c, x, x, 0.05), MORPH_ERR_NONFINITE);
    assert_int_equal(morph_body_contacts_count(c), 0);
    morph_body_contacts_destroy(c);
    morph_body_destroy(b);
}

/* The point of a cone under the middle of a triangle whose corners are beside it, first below the skin, then
 * through it: only the vertex tells. */
static void test_spike(void **state) {
    (void)state;
    const morph_body_def def = morph_body_defaults();
    morph_mesh mesh;
    assert_int_equal(morph_mesh_cone(0.3, 1.0, 1e-2, &mesh), MORPH_OK);
    double top = -INFINITY;
    morph_body *b = body_of(&mesh, 0.12, &def);
    for (int i = 0; i < b->vertices; i++)
        top = fmax(top, b->x[3 * i + 2]);
    const double inverse[3] = {1.0, 1.0, 1.0};
    const int triangle[1][3] = {{0, 1, 2}};
    const morph_body_sheet sheet = {
        .joints = 3, .triangles = 1, .inverse = inverse, .triangle = triangle, .radius = 0.01};
    morph_body_contacts *c;
    assert_int_equal(morph_body_contacts_create(b, &sheet, &c), MORPH_OK);
    const double lift[] = {0.1, 0.02, 0.005, -0.02};
    const int contacts[] = {0, 0, 1, 1};
    for (int k = 0; k < 4; k++) {
        const double z = top + lift[k], x[9] = {2, 0, z, -1, 2, z, -1, -2, z};
        assert_int_equal(morph_body_contacts_find(c, x, x, 0.005), MORPH_OK);
        assert_int_equal(morph_body_contacts_count(c) > 0, contacts[k]);
        assert_near(morph_body_contacts_depth(c), fmax(0.0, 0.01 - lift[k]), 1e-9);
        if (!contacts[k]) continue;
        /* Back to the upper side, also from beneath. */
        const morph_body_touch *t = morph_body_contacts_list(c);
        assert_near(t->normal[2], 1.0, 1e-9);
        double moved[9];
        memcpy(moved, x, sizeof moved);
        morph_body_contact_project(c, 0, moved, b, 0.0);
        assert_true(moved[2] > x[2] && moved[5] > x[5] && moved[8] > x[8]);
        memcpy(b->x, b->mesh.v, 3 * (size_t)b->vertices * sizeof *b->x);
    }
    morph_body_contacts_destroy(c);
    morph_body_destroy(b);
}

/* A sheet thrown at a free ball, with friction, masses very different: momentum is kept. */
static void thrown(double mass, double speed) {
    morph_body_def def = morph_body_defaults();
    def.gravity = 0.0;
    morph_body *b = ball_body(0.15, 0.0, 0.06, &def);
    static square s;
    double p0[3], l0[3], p[3], l[3], least = INFINITY, scale = JOINTS * mass * speed;
    square_create(&s, b, 0.1, 0.17, mass);
    for (int j = 0; j < JOINTS; j++) {
        s.v[3 * j + 2] = -speed;
        s.v[3 * j] = 0.3 * speed;
    }
    momenta(&s, b, p0, l0);
    long contacts = 0;
    for (int n = 0; n < 250; n++) {
        couple(&s, b, 5e-4, 0.0, 0.0, 1e3 * mass, 0.4);
        contacts += morph_body_contacts_count(s.contacts);
        least = fmin(least, morph_body_least_volume(b));
        assert_true(least > 0.0);
    }
    momenta(&s, b, p, l);
    const double dp = morph_dist(p, p0) / scale, dl = morph_dist(l, l0) / (0.15 * scale);
    print_message("thrown at %g m/s, joints of %g kg: momentum %.1e, angular %.1e, least volume %.2f\n",
                  speed, mass, dp, dl, least);
    assert_true(contacts > 1000);
    assert_true(dp < 1e-10);
    assert_true(dl < 2e-2);
    morph_body_contacts_destroy(s.contacts);
    morph_body_destroy(b);
}

static void test_momentum(void **state) {
    (void)state;
    thrown(0.01, 1.0);
    thrown(1e-4, 3.0);
    thrown(1.0, 1.0);
}

/* A sheet falls on a soft ball that stands on the base plane, and rests: the ball carries its weight and is
 * pressed flat under it. */
static void test_rest(void **state) {
    (void)state;
    morph_body_def def = morph_body_defaults();
    def.base = 0.0;
    def.pin = 0.02;
    def.drag = 3.0;
    const double h = 5e-4, mass = 0.03;
    morph_body *b = ball_body(0.15, 0.15, 0.05, &def);
    static square s;
    square_create(&s, b, 0.07, 0.33, mass);
    double force[3], mean[3] = {0, 0, 0}, deepest = 0.0, least = INFINITY;
    size_t bytes = 0;
    const int steps = 5000, last = 1000;
    const double begin = cpu_seconds();
    for (int n = 0; n < steps; n++) {
        couple(&s, b, h, 9.81, 2.0, 300.0, 0.5);
        least = fmin(least, morph_body_least_volume(b));
        if (n < steps - last) continue;
        if (n == steps - last) bytes = morph_body_contacts_bytes(s.contacts);
        morph_body_contacts_force(s.contacts, h, force);
        for (int k = 0; k < 3; k++)
            mean[k] += force[k] / last;
        deepest = fmax(deepest, morph_body_contacts_depth(s.contacts));
    }
    const double seconds = (cpu_seconds() - begin) / steps, weight = JOINTS * mass * 9.81;
    double fastest = 0.0, top = -INFINITY;
    for (int j = 0; j < JOINTS; j++)
        fastest = fmax(fastest, morph_norm(&s.v[3 * j]));
    for (int i = 0; i < b->vertices; i++)
        top = fmax(top, b->x[3 * i + 2]);
    print_message(
        "at rest: force %.4f of the weight (sideways %.1e), top pressed by %.4f m, depth %.1e m, "
        "fastest %.1e m/s, least volume %.2f; %d contacts, %d tets, %.0f us per step\n",
        mean[2] / weight, hypot(mean[0], mean[1]) / weight, 0.3 - top, deepest, fastest, least,
        morph_body_contacts_count(s.contacts), b->mesh.tets, 1e6 * seconds);
    assert_near(mean[2] / weight, 1.0, 0.005);
    assert_true(hypot(mean[0], mean[1]) < 0.02 * weight);
    assert_true(0.3 - top > 0.004);
    assert_true(fastest < 5e-3);
    assert_true(deepest < 1e-3);
    assert_true(least > 0.0);
    /* It rests on the ball, not on the ground. */
    for (int j = 0; j < JOINTS; j++)
        assert_true(s.x[3 * j + 2] > 0.02);
    /* The hash asked for no memory in the last thousand steps. */
    assert_int_equal(morph_body_contacts_bytes(s.contacts), bytes);
    morph_body_contacts_destroy(s.contacts);
    morph_body_destroy(b);
}

static void test_refused(void **state) {
    (void)state;
    const morph_body_def def = morph_body_defaults();
    morph_body *b = ball_body(1.0, 0.0, 0.5, &def);
    const double inverse[2] = {1.0, 0.0}, negative[2] = {-1.0, 0.0};
    const int triangle[1][3] = {{0, 1, 2}};
    morph_body_place place = {.corners = 1, .weight = {1.0}, .radius = 0.1};
    morph_body_contacts *c;
    const morph_body_sheet good = {.joints = 2, .places = 1, .inverse = inverse, .place = &place};
    morph_body_sheet s = good;
    s.inverse = negative;
    assert_int_equal(morph_body_contacts_create(b, &s, &c), MORPH_ERR_INPUT);
    s = good;
    s.triangles = 1;
    s.triangle = triangle;
    assert_int_equal(morph_body_contacts_create(b, &s, &c), MORPH_ERR_INPUT);
    s = good;
    s.margin = NAN;
    assert_int_equal(morph_body_contacts_create(b, &s, &c), MORPH_ERR_INPUT);
    place.joint[0] = 2;
    assert_int_equal(morph_body_contacts_create(b, &good, &c), MORPH_ERR_INPUT);
    assert_null(c);
    /* Held on both sides: nothing to correct, nothing listed. */
    place.joint[0] = 1;
    assert_int_equal(morph_body_contacts_create(b, &good, &c), MORPH_OK);
    for (int i = 0; i < b->vertices; i++)
        morph_body_pin(b, i);
    const double x[6] = {5, 5, 5, 0.9, 0, 0};
    assert_int_equal(morph_body_contacts_find(c, x, x, 0.1), MORPH_OK);
    assert_int_equal(morph_body_contacts_count(c), 0);
    assert_true(morph_body_contacts_depth(c) > 0.1);
    morph_body_contacts_destroy(c);
    morph_body_contacts_destroy(NULL);
    morph_body_destroy(b);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_places), cmocka_unit_test(test_spike),
                                       cmocka_unit_test(test_momentum), cmocka_unit_test(test_rest),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
