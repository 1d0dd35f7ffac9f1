/* The swept guard: fast sheets against needles, wires and thin plates, with and without it. */
#include "model/swept.h"
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

/* Whether a skin triangle meets the wire's axis while it moves straight from one recorded frame to the next.
 * A sheet that slips off a wire with a border, or whips round it, does not: only what comes through. */
static bool cut_by(const morph_structure *s, const double *from, const double *to, const double wire[2][3]) {
    double toi;
    for (int t = 0; t < s->skin_triangles; t++) {
        double at[2][3][3];
        for (int k = 0; k < 3; k++) {
            memcpy(at[0][k], &from[3 * s->skin[t][k]], sizeof at[0][k]);
            memcpy(at[1][k], &to[3 * s->skin[t][k]], sizeof at[1][k]);
        }
        for (int k = 0; k < 3; k++) {
            double e[2][2][3];
            for (int end = 0; end < 2; end++) {
                memcpy(e[end][0], at[end][k], sizeof e[end][0]);
                memcpy(e[end][1], at[end][(k + 1) % 3], sizeof e[end][1]);
            }
            if (morph_swept_edge_edge(wire, (const double(*)[3])e[0], wire, (const double(*)[3])e[1], NULL,
                                      &toi))
                return true;
        }
        for (int end = 0; end < 2; end++)
            if (morph_swept_vertex_triangle(wire[end], (const double(*)[3])at[0], wire[end],
                                            (const double(*)[3])at[1], NULL, &toi))
                return true;
    }
    return false;
}

typedef enum ending { HELD, REFUSED, CUT } ending;

/* The impact and what follows, in frames of a tenth of a spacing at most. */
static ending throw_at_wire(double radius, double height, double speed, bool unguarded) {
    morph_structure_def def = morph_structure_defaults(0.1);
    world w;
    def.radius = radius * def.spacing;
    make_wire(0.017, 0.002, 0.25);
    make_world(&w, &def, true, height, 0.05);
    w.def.velocity[2] = -speed;
    w.def.time = 0.4 / speed;
    w.def.frame = 0.01 / speed;
    w.def.unguarded = unguarded;
    char name[64];
    snprintf(name, sizeof name, "wire, radius %g, %g m/s%s", radius, speed, unguarded ? ", unguarded" : "");
    morph_trajectory t;
    const figures f = run_kept(&w, name, &t);
    const double wire[2][3] = {{-0.25, 0.017, -0.002}, {0.25, 0.017, -0.002}};
    ending e = HELD;
    for (int k = 1; k < t.frames && e == HELD; k++) {
        const double *to = &t.x[(size_t)k * 3 * (size_t)t.joints];
        if (cut_by(w.s, to - 3 * t.joints, to, wire)) e = CUT;
    }
    if (f.report.came_through) {
        e = REFUSED;
        print_message("    refused at %.6f s for element %d\n", f.report.through_time,
                      f.report.through_element);
        assert_true(f.report.through_element >= 0 &&
                    f.report.through_element < w.s->links + w.s->skin_triangles);
    }
    assert_true(f.finite && f.length <= 1e-9 + 1e-12 && f.post <= 1e-9 + 1e-12);
    if (e == CUT) print_message("    CUT\n");
    morph_trajectory_free(&t);
    free_world(&w);
    return e;
}

/* Frames in which the sheet goes several spacings: no skin lies in the wire, or the run is refused by name.
 */
static void test_coarse(void **state) {
    (void)state;
    static const double speeds[] = {200.0, 500.0, 1000.0}, radius[] = {0.04, 0.004};
    for (int n = 0; n < 6; n++) {
        const outcome o = throw_at(WIRE, radius[n / 3], 0.5, speeds[n % 3], false);
        assert_true(o.f.finite && o.f.length <= 1e-9 + 1e-12 && o.f.post <= 1e-9 + 1e-12);
        if (o.f.report.came_through)
            print_message("    refused at %.6f s\n", o.f.report.through_time);
        else
            assert_true(o.f.depth <= 1e-3 + 1e-6);
    }
}

/* Wires from 20 m/s to a kilometre a second, from three heights: each is held or the run refused by name. */
static void test_wires(void **state) {
    (void)state;
    static const double speeds[] = {20.0, 80.0, 150.0, 200.0, 500.0, 1000.0}, heights[] = {0.5, 0.53, 0.56},
                        radius[] = {0.04, 0.004};
    int count[3] = {0}, unguarded[3] = {0};
    if (getenv("MORPH_SANITIZE")) skip(); /* a minute there, and the code of test_thin */
    for (int n = 0; n < 36; n++) {
        count[throw_at_wire(radius[n / 18], heights[n % 3], speeds[n / 3 % 6], false)]++;
        if (n >= 18) unguarded[throw_at_wire(radius[n / 18], heights[n % 3], speeds[n / 3 % 6], true)]++;
    }
    print_message("wires: %d held, %d refused, %d cut; without the guard %d cut\n", count[HELD],
                  count[REFUSED], count[CUT], unguarded[CUT]);
    assert_int_equal(count[CUT], 0);
    /* Most are held, and the guard has something to do. */
    assert_true(count[HELD] >= 30 && unguarded[CUT] > 0 && unguarded[REFUSED] == 0);
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_thin), cmocka_unit_test(test_coarse),
                                       cmocka_unit_test(test_wires), cmocka_unit_test(test_soft),
                                       cmocka_unit_test(test_ordinary)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
