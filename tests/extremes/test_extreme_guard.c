/* The swept guard: fast sheets against needles, wires and thin plates, with and without it. */
#include "tests/extremes/extreme_scene.h"

/* Height above `z` of the skin at (x, y), the highest there, as a soft sheet may fold its border beneath the
 * target; or, of a needle, the highest between its tip and its foot `length` below. Infinite where there is
 * none. */
static double height_above(const morph_structure *s, const double *q, double x, double y, double z,
                           double length) {
    double most = -INFINITY;
    for (int t = 0; t < s->skin_triangles; t++) {
        const double *a = &q[3 * s->skin[t][0]], *b = &q[3 * s->skin[t][1]], *c = &q[3 * s->skin[t][2]];
        const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        const double u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area;
        const double v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area;
        const double height = u * a[2] + v * b[2] + (1.0 - u - v) * c[2] - z;
        if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0)) continue;
        if (length > 0.0 && (height > 0.0 || height < -0.98 * length)) continue;
        most = fmax(most, height);
    }
    return isfinite(most) ? most : INFINITY;
}

/* A needle of width w whose tip stands at (x, y, 0), `length` long. */
static void make_needle(double x, double y, double w, double length) {
    made.nv = made.nt = 0;
    vertex(x, y, 0.0);
    vertex(x - w, y - w, -length);
    vertex(x + w, y - w, -length);
    vertex(x, y + w, -length);
    triangle(0, 1, 2);
    triangle(0, 2, 3);
    triangle(0, 3, 1);
    triangle(1, 3, 2);
}

/* A wire of half width w along x at height 0. */
static void make_wire(double y, double w, double half) {
    make_box(half, w, w);
    for (int i = 0; i < made.nv; i++) {
        made.v[3 * i + 1] += y;
        made.v[3 * i + 2] -= w;
    }
}

typedef enum kind { NEEDLE, WIRE, PLATE } kind;

typedef struct outcome {
    double least; /* of the skin above the target's top, spacings */
    figures f;
} outcome;

static outcome throw_at(kind what, double radius, double height, double speed, bool unguarded) {
    static const char *const names[] = {"needle", "wire", "plate"};
    morph_structure_def def = morph_structure_defaults(0.1);
    const double x = 0.023, y = 0.017;
    world w;
    def.radius = radius * def.spacing;
    if (what == NEEDLE)
        make_needle(x, y, 0.002, 0.2);
    else if (what == WIRE)
        make_wire(y, 0.002, 0.25);
    else
        make_box(0.25, 0.25, 0.005);
    make_world(&w, &def, true, height, 0.05);
    w.def.velocity[2] = -speed;
    w.def.time = 0.1 / speed + 0.02;
    w.def.frame = w.def.time / 40.0;
    w.def.unguarded = unguarded;
    char name[64];
    snprintf(name, sizeof name, "%s, radius %g, %g m/s%s", names[what], radius, speed,
             unguarded ? ", unguarded" : "");
    morph_trajectory t;
    outcome o = {.least = INFINITY};
    o.f = run_kept(&w, name, &t);
    for (int f = 0; f < t.frames; f++) {
        const double *q = &t.x[(size_t)f * 3 * (size_t)t.joints];
        for (int n = 0; n < (what == NEEDLE ? 1 : 9); n++)
            o.least = fmin(o.least, height_above(w.s, q, what == NEEDLE ? x : 0.025 * (n - 4), y,
                                                 what == PLATE ? 0.005 : 0.0, what == NEEDLE ? 0.2 : 0.0) /
                                        w.s->spacing);
    }
    print_message("    least height %.4f; looked at %d steps, refused %d\n", o.least, o.f.report.guarded,
                  o.f.report.crossings);
    morph_trajectory_free(&t);
    free_world(&w);
    return o;
}

/* Needles and wires: those that only the guard keeps from coming through, and those that contact alone does
 * already. A skin of 0.004 spacings half-thickness feels neither by its field of 0.05 spacings' cells. */
static void test_thin(void **state) {
    (void)state;
    static const struct {
        kind what;
        double radius, speed;
        bool passes; /* without the guard */
    } cases[] = {{NEEDLE, 0.004, 2.0, true},   {NEEDLE, 0.004, 10.0, true},  {NEEDLE, 0.004, 100.0, true},
                 {WIRE, 0.004, 100.0, true},   {NEEDLE, 0.04, 2.0, false},   {NEEDLE, 0.04, 10.0, false},
                 {NEEDLE, 0.04, 100.0, false}, {WIRE, 0.04, 100.0, false},   {WIRE, 0.004, 2.0, false},
                 {WIRE, 0.004, 10.0, false},   {PLATE, 0.04, 100.0, false},  {PLATE, 0.04, 1000.0, false},
                 {PLATE, 0.004, 100.0, false}, {PLATE, 0.004, 1000.0, false}};
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        /* Whether an unguarded step happens to end where contact feels the wire is a matter of its phase: the
         * first height to fall from whose steps do not is the control. */
        double height = 0.5;
        outcome off = throw_at(cases[n].what, cases[n].radius, height, cases[n].speed, true);
        for (int k = 1; k < 8 && cases[n].passes && off.least > 0.0; k++) {
            height = 0.5 + 0.03 * k;
            off = throw_at(cases[n].what, cases[n].radius, height, cases[n].speed, true);
        }
        const outcome on = throw_at(cases[n].what, cases[n].radius, height, cases[n].speed, false);
        assert_int_equal(off.least <= 0.0, cases[n].passes);
        assert_int_equal(off.f.report.guarded, 0);
        assert_true(on.least > 0.0 && on.f.depth <= 1e-3 + 1e-6);
        if (cases[n].passes) assert_true(on.f.report.crossings > 0);
        expect_within(&on.f);
    }
}

/* Wires at a kilometre a second cut even so: nothing breaks. */
static void test_cut(void **state) {
    (void)state;
    const outcome on = throw_at(WIRE, 0.04, 0.5, 1000.0, false);
    assert_true(on.f.finite && on.f.length <= 1e-9 + 1e-12 && on.f.post <= 1e-9 + 1e-12);
}

/* A sheet thrown at a small soft ball that floats. Returns how far the ball's middle is below the highest
 * skin over it in the end; negative: it came through. */
static double throw_soft(double speed, double radius, double height, bool unguarded,
                         morph_blanket_report *report) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    def.radius = radius * def.spacing;
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    const double at[2] = {0.016, -0.012}, size = 0.02, radii[3] = {size, size, size};
    morph_mesh mesh;
    morph_tetra tetra;
    morph_tetra_report r;
    morph_distance *d;
    morph_body *body;
    assert_int_equal(morph_mesh_ellipsoid(radii, 0.02 * size, &mesh), MORPH_OK);
    for (int i = 0; i < 3 * mesh.vertices; i++)
        mesh.v[i] += i % 3 == 2 ? 0.0 : at[i % 3];
    assert_int_equal(morph_distance_create(&mesh, true, &d), MORPH_OK);
    assert_int_equal(morph_tetra_fill(d, 0.5 * size, &tetra, &r), MORPH_OK);
    morph_body_def soft = morph_body_defaults();
    soft.gravity = 0.0;
    soft.young = 2e5;
    assert_int_equal(morph_body_create(&tetra, &soft, &body), MORPH_OK);
    double *x = malloc(3 * (size_t)s->joints * sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < 3 * s->joints; i++)
        x[i] = s->start[i] + (i % 3 == 2 ? height : 0.0);
    const morph_blanket_def b = {.drag = 0.2,
                                 .friction = 0.5,
                                 .time = 0.15 / speed,
                                 .frame = 0.01 / speed,
                                 .base = NAN,
                                 .velocity = {0.0, 0.0, -speed},
                                 .body = body,
                                 .unguarded = unguarded};
    morph_trajectory t;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &b, x, NULL, &t, report), MORPH_OK);
    double middle[3] = {0.0};
    for (int i = 0; i < 3 * body->vertices; i++)
        middle[i % 3] += body->x[i] / body->vertices;
    const double *end = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)s->joints];
    const double below = height_above(s, end, middle[0], middle[1], middle[2], 0.0);
    print_message(
        "soft ball, radius %g, %g m/s%s: skin %.4f m above its middle; %d steps, looked at %d, refused "
        "%d\n",
        radius, speed, unguarded ? ", unguarded" : "", below, report->steps, report->guarded,
        report->crossings);
    morph_trajectory_free(&t);
    free(x);
    morph_body_destroy(body);
    morph_tetra_free(&tetra);
    morph_distance_destroy(d);
    morph_mesh_free(&mesh);
    morph_structure_destroy(s);
    return below;
}

static void test_soft(void **state) {
    (void)state;
    static const double speeds[] = {3.0, 30.0, 100.0}, radius[] = {0.04, 0.004};
    for (int n = 0; n < 6; n++) {
        morph_blanket_report off, on;
        /* Only the fastest come through, and not from every height. */
        const bool passes = speeds[n % 3] == 100.0;
        double height = 0.06, without = throw_soft(speeds[n % 3], radius[n / 3], height, true, &off);
        for (int k = 1; k < 8 && passes && without > 0.0; k++) {
            height = 0.06 + 0.002 * k;
            without = throw_soft(speeds[n % 3], radius[n / 3], height, true, &off);
        }
        assert_int_equal(without < 0.0, passes);
        assert_true(throw_soft(speeds[n % 3], radius[n / 3], height, false, &on) > 0.0);
        assert_int_equal(off.guarded, 0);
    }
}

/* A drop as scenes have it: no step is looked at closely, nothing is refused. */
static void test_ordinary(void **state) {
    (void)state;
    const morph_structure_def def = morph_structure_defaults(0.1);
    world w;
    make_box(0.1, 0.1, 0.06);
    make_world(&w, &def, true, 1.0, 0.1);
    w.def.time = 1.5;
    const figures f = run_world(&w, "ordinary drop");
    print_message("    looked at %d of %d steps\n", f.report.guarded, f.report.steps);
    assert_int_equal(f.report.crossings, 0);
    assert_true(f.report.guarded <= f.report.steps / 100);
    expect_within(&f);
    free_world(&w);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_thin), cmocka_unit_test(test_cut),
                                       cmocka_unit_test(test_soft), cmocka_unit_test(test_ordinary)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
