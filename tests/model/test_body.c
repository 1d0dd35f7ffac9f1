/* The deformable body: stiffness, energy, momentum, volumes. */
#include "model/body.h"
#include "solids.h"

static morph_body *box_body(const double size[3], double cell, const morph_body_def *def) {
    morph_mesh mesh;
    morph_distance *d;
    morph_tetra tetra;
    morph_tetra_report r;
    morph_body *b;
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, cell, &tetra, &r), MORPH_OK);
    assert_int_equal(morph_body_create(&tetra, def, &b), MORPH_OK);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    return b;
}

static morph_body_def plain(void) {
    morph_body_def def = morph_body_defaults();
    def.young = 1e4;
    def.density = 1000;
    def.gravity = def.damping = 0.0;
    return def;
}

static double *forces_of(const morph_body *b) {
    double *f = morph_alloc(3 * (size_t)b->vertices, sizeof *f);
    assert_non_null(f);
    return f;
}

/* Spring forces are the energy's negative gradient; the same accelerations as a tiny step shows. */
static void test_forces(void **state) {
    (void)state;
    const double size[3] = {0.3, 0.2, 0.1};
    morph_body_def def = plain();
    morph_body *b = box_body(size, 0.1, &def);
    for (int i = 0; i < 3 * b->vertices; i++)
        b->x[i] += uniform(-0.01, 0.01); /* some tetrahedra are squeezed, none is held */
    /* v after a step so short that x does not move is h a. */
    const double h = 1e-9, e = 1e-6;
    double *x = forces_of(b), worst = 0.0, largest = 0.0;
    memcpy(x, b->x, 3 * (size_t)b->vertices * sizeof *x);
    assert_true(morph_body_least_volume(b) < 0.8 && morph_body_least_volume(b) > 0.3);
    assert_true(morph_body_step(b, h, NULL));
    for (int i = 0; i < 3 * b->vertices; i++) {
        double up, down;
        memcpy(b->x, x, 3 * (size_t)b->vertices * sizeof *x);
        b->x[i] = x[i] + e;
        morph_body_energies(b, NULL, &up, NULL);
        b->x[i] = x[i] - e;
        morph_body_energies(b, NULL, &down, NULL);
        const double force = b->v[i] / h * b->mass[i / 3];
        worst = fmax(worst, fabs(force + (up - down) / (2 * e)));
        largest = fmax(largest, fabs(force));
    }
    assert_true(largest > 0.1);
    assert_true(worst < 1e-5 * largest);
    free(x);
    morph_body_destroy(b);
}

/* A bar pulled at its ends: the strain of its middle half against force / (area E). */
static double strain_ratio(double cell, double turn) {
    const double size[3] = {1.0, 0.25, 0.25}, strain = 0.02;
    morph_body_def def = plain();
    def.drag = 3.0;
    def.damping = 0.05;
    morph_mesh mesh;
    morph_distance *d;
    morph_tetra tetra;
    morph_tetra_report r;
    morph_body *b;
    const double c = cos(turn), s = sin(turn);
    assert_int_equal(morph_mesh_box(size, &mesh), MORPH_OK);
    for (int i = 0; i < mesh.vertices; i++) {
        double *p = &mesh.v[3 * i];
        const double x = c * p[0] - s * p[1];
        p[1] = s * p[0] + c * p[1];
        p[0] = x;
    }
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, cell, &tetra, &r), MORPH_OK);
    assert_int_equal(morph_body_create(&tetra, &def, &b), MORPH_OK);
    /* Half the force at each end, in proportion to mass; they balance, so nothing is pinned. */
    double *f = forces_of(b), end[2] = {0, 0};
    const double force = strain * def.young * size[1] * size[2];
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < b->vertices; i++) {
            const double along = c * b->x[3 * i] + s * b->x[3 * i + 1];
            if (fabs(along) < 0.4) continue;
            if (pass == 0) end[along > 0] += b->mass[i];
            if (pass == 1) {
                const double part = force * b->mass[i] / end[along > 0] * (along > 0 ? 1 : -1);
                f[3 * i] = part * c;
                f[3 * i + 1] = part * s;
            }
        }
    for (int step = 0; step < 300; step++)
        assert_true(morph_body_step(b, 0.02, f));
    /* Slope of displacement over place, least squares over |along| < 0.25. */
    double xx = 0, xu = 0, kinetic, spring;
    for (int i = 0; i < b->vertices; i++) {
        const double *p = &b->mesh.v[3 * i], *x = &b->x[3 * i];
        const double along = c * p[0] + s * p[1], moved = c * (x[0] - p[0]) + s * (x[1] - p[1]);
        if (fabs(along) > 0.25) continue;
        xx += along * along;
        xu += along * moved;
    }
    morph_body_energies(b, &kinetic, &spring, NULL);
    assert_true(kinetic < 1e-4 * spring);
    const double ratio = xu / xx / strain;
    print_message("bar, cell %.3f, turned %.1f: %d springs, strain %.3f of what E predicts\n", cell, turn,
                  b->springs, ratio);
    free(f);
    morph_body_destroy(b);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    return ratio;
}

static void test_young(void **state) {
    (void)state;
    assert_near(strain_ratio(0.125, 0.0), 1.0, 0.2);
    assert_near(strain_ratio(0.0625, 0.0), 1.0, 0.2);
    assert_near(strain_ratio(0.0625, 0.5), 1.0, 0.2);
}

/* An undamped free body, stretched 5 % at the start: energy over 10,000 substeps, and its order. */
static double energy_drift(double part, double *momentum) {
    const double size[3] = {0.4, 0.2, 0.2};
    morph_body_def def = plain();
    morph_body *b = box_body(size, 0.1, &def);
    for (int i = 0; i < b->vertices; i++)
        b->x[3 * i] *= 1.05;
    double kinetic, spring, first, worst = 0.0;
    morph_body_energies(b, &kinetic, &first, NULL);
    const double h = part * morph_body_stable_step(b), time = 2000 * morph_body_stable_step(b);
    const int steps = (int)lround(time / h);
    for (int n = 0; n < steps; n++) {
        assert_true(morph_body_step(b, h, NULL));
        morph_body_energies(b, &kinetic, &spring, NULL);
        worst = fmax(worst, fabs(kinetic + spring - first) / first);
    }
    assert_int_equal(b->counts.steps, steps);
    assert_int_equal(b->counts.projections + b->counts.redone + b->counts.held, 0);
    double p[3] = {0, 0, 0}, scale = 0.0;
    for (int i = 0; i < b->vertices; i++)
        for (int k = 0; k < 3; k++) {
            p[k] += b->mass[i] * b->v[3 * i + k];
            scale += b->mass[i] * fabs(b->v[3 * i + k]);
        }
    *momentum = morph_norm(p) / scale;
    morph_body_destroy(b);
    return worst;
}

static void test_energy(void **state) {
    (void)state;
    double p;
    const double half = energy_drift(0.4, &p), quarter = energy_drift(0.2, &p);
    print_message("energy: drift %.2e over 5,000 steps of 0.4, %.2e over 10,000 of 0.2 stable steps\n", half,
                  quarter);
    assert_true(quarter < 1e-2);
    assert_true(half / quarter > 3.0 && half / quarter < 5.5);
    assert_true(p < 1e-9);
}

static void test_free_fall(void **state) {
    (void)state;
    const double size[3] = {0.2, 0.2, 0.2};
    morph_body_def def = morph_body_defaults();
    morph_body *b = box_body(size, 0.1, &def);
    for (int n = 0; n < 100; n++)
        assert_true(morph_body_step(b, 0.003, NULL));
    for (int i = 0; i < b->vertices; i++) {
        assert_near(b->x[3 * i + 2] - b->mesh.v[3 * i + 2], -0.5 * 9.81 * 0.09, 1e-10);
        assert_near(b->v[3 * i + 2], -9.81 * 0.3, 1e-10);
        assert_near(b->x[3 * i], b->mesh.v[3 * i], 1e-12);
    }
    morph_body_destroy(b);
}

/* Crushed: by a fast throw at the base plane, by forces of 1000 times what halves it, by vertices that
 * contact throws about. No tetrahedron turns inside out at any step, and it comes back. */
static void test_crush(void **state) {
    (void)state;
    const double size[3] = {0.2, 0.2, 0.2};
    morph_body_def def = morph_body_defaults();
    def.base = -0.1;
    def.pin = -1.0;
    double least = INFINITY;
    morph_body *b = box_body(size, 0.07, &def);
    for (int i = 0; i < b->vertices; i++)
        b->v[3 * i + 2] = -200.0;
    for (int n = 0; n < 300; n++) {
        assert_true(morph_body_step(b, 1e-3, NULL));
        least = fmin(least, morph_body_least_volume(b));
        assert_true(least > 0.0);
        for (int i = 0; i < b->vertices; i++)
            assert_true(b->x[3 * i + 2] >= def.base - 0.02);
    }
    print_message("throw: least volume %.3f of that at rest, %ld projections, %ld held, %ld redone\n", least,
                  b->counts.projections, b->counts.held, b->counts.redone);
    assert_true(b->counts.projections > 0);
    morph_body_destroy(b);

    b = box_body(size, 0.07, &def);
    double *f = forces_of(b);
    for (int i = 0; i < b->vertices; i++)
        for (int k = 0; k < 3; k++)
            f[3 * i + k] = -1e3 * def.young * 0.04 * b->x[3 * i + k] / 0.1 / b->vertices;
    least = INFINITY;
    for (int n = 0; n < 200; n++) {
        assert_true(morph_body_step(b, 1e-3, n < 100 ? f : NULL));
        least = fmin(least, morph_body_least_volume(b));
        assert_true(least > 0.0);
    }
    print_message("press: least volume %.3f of that at rest, %ld projections, %ld held, %ld redone\n", least,
                  b->counts.projections, b->counts.held, b->counts.redone);
    free(f);
    morph_body_destroy(b);

    b = box_body(size, 0.07, &def);
    least = INFINITY;
    for (int n = 0; n < 200; n++) {
        assert_true(morph_body_step(b, 1e-3, NULL));
        for (int k = 0; k < 20 && n < 100; k++)
            b->x[(int)uniform(0, 3 * b->vertices)] += uniform(-0.1, 0.1);
        morph_body_moved(b, 1e-3);
        least = fmin(least, morph_body_least_volume(b));
        assert_true(least > 0.0);
        assert_true(morph_body_finite(b));
    }
    print_message("jolts: least volume %.3f of that at rest, %ld projections, %ld held, %ld redone\n", least,
                  b->counts.projections, b->counts.held, b->counts.redone);
    morph_body_destroy(b);
}

/* On its base: pinned it stands still but for its sag; the same bits every time. */
static void test_standing(void **state) {
    (void)state;
    const double size[3] = {0.2, 0.2, 0.2};
    morph_body_def def = morph_body_defaults();
    def.base = -0.1;
    def.drag = 40.0;
    morph_body *b = box_body(size, 0.07, &def), *again = box_body(size, 0.07, &def);
    int pinned = 0;
    for (int i = 0; i < b->vertices; i++)
        pinned += b->inverse[i] == 0.0;
    assert_true(pinned >= 9);
    for (int n = 0; n < 500; n++) {
        assert_true(morph_body_step(b, 2e-3, NULL));
        assert_true(morph_body_step(again, 2e-3, NULL));
    }
    assert_memory_equal(b->x, again->x, 3 * (size_t)b->vertices * sizeof *b->x);
    assert_memory_equal(b->v, again->v, 3 * (size_t)b->vertices * sizeof *b->v);
    double top = -INFINITY, fastest = 0.0;
    for (int i = 0; i < b->vertices; i++) {
        top = fmax(top, b->x[3 * i + 2]);
        fastest = fmax(fastest, morph_norm(&b->v[3 * i]));
        if (b->inverse[i] == 0.0) assert_near(morph_dist(&b->x[3 * i], &b->mesh.v[3 * i]), 0.0, 0.0);
    }
    /* A column under its own weight sags by rho g L^2 / (2 E); the pinned base makes it a little stiffer. */
    const double sag = def.density * def.gravity * 0.04 / (2 * def.young);
    assert_true(0.1 - top > 0.5 * sag && 0.1 - top < 1.3 * sag);
    assert_true(fastest < 1e-6);
    morph_body_destroy(again);
    morph_body_destroy(b);
}

static void test_refused(void **state) {
    (void)state;
    const double size[3] = {0.2, 0.2, 0.2};
    const morph_body_def good = morph_body_defaults();
    morph_body *b = box_body(size, 0.1, &good), *none;
    morph_body_def def;
    const double bad[] = {-1.0, NAN, INFINITY};
    for (int k = 0; k < 3; k++)
        for (int field = 0; field < 6; field++) {
            def = good;
            double *at[] = {&def.young, &def.density, &def.damping, &def.drag, &def.gravity, &def.friction};
            *at[field] = bad[k];
            assert_int_equal(morph_body_create(&b->mesh, &def, &none), MORPH_ERR_INPUT);
            assert_null(none);
        }
    def = good;
    def.young = 0.0;
    assert_int_equal(morph_body_create(&b->mesh, &def, &none), MORPH_ERR_INPUT);
    def.young = 1e308;
    def.density = 1e-300;
    assert_int_equal(morph_body_create(&b->mesh, &def, &none), MORPH_ERR_NONFINITE);
    const morph_tetra empty = {0};
    assert_int_equal(morph_body_create(&empty, &good, &none), MORPH_ERR_INPUT);
    assert_false(morph_body_step(b, NAN, NULL));
    assert_false(morph_body_step(b, -1.0, NULL));
    assert_false(morph_body_step(b, 1e300, NULL));
    b->v[4] = INFINITY;
    assert_false(morph_body_step(b, 1e-3, NULL));
    morph_body_destroy(b);
    morph_body_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_forces), cmocka_unit_test(test_young),
                                       cmocka_unit_test(test_energy), cmocka_unit_test(test_free_fall),
                                       cmocka_unit_test(test_crush),  cmocka_unit_test(test_standing),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
