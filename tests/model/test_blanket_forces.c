/* What drives the blanket beside gravity: attraction, hands, held joints, a rising target, prescribed
 * lengths. */
#include "model/blanket_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/model/solids.h"

/* A chain of joints along -z from the origin, one link each, wide limits. */
enum { MOST = 3 };
typedef struct chain {
    morph_structure s;
    int link[MOST][2], kind[MOST];
    double limit[MOST][2], start_length[MOST], radius[MOST], start[3 * (MOST + 1)];
} chain;

static void make_chain(chain *c, int joints, double stiffness, double damping) {
    memset(c, 0, sizeof *c);
    c->s.def = morph_structure_defaults(0.1);
    c->s.def.stiffness = stiffness;
    c->s.def.damping = damping;
    c->s.joints = joints;
    c->s.links = joints - 1;
    for (int l = 0; l < c->s.links; l++) {
        c->link[l][0] = l;
        c->link[l][1] = l + 1;
        c->limit[l][0] = 0.01;
        c->limit[l][1] = 1.0;
        c->start_length[l] = 0.1;
        c->radius[l] = 0.004;
    }
    for (int j = 0; j < joints; j++)
        c->start[3 * j + 2] = -0.1 * j;
    c->s.link = c->link;
    c->s.link_kind = c->kind;
    c->s.length_limit = c->limit;
    c->s.start_length = c->start_length;
    c->s.link_radius = c->radius;
    c->s.spacing = 0.1;
}

static morph_blanket_def quiet(double time) {
    return (morph_blanket_def){.time = time, .frame = 0.01, .base = NAN};
}

static morph_structure *grid(int nx, int ny) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = nx;
    def.nodes[1] = ny;
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

/* Two masses hanging from a held joint rest at L0 + 2 m g / k and L0 + m g / k, and swing along the chain
 * with omega^2 = k/m (3 -+ sqrt 5)/2: the slow mode alone, started in its shape, has its period. */
static void test_hanging_chain(void **state) {
    (void)state;
    static const int top[] = {0};
    const double m = morph_structure_defaults(0.1).mass, k = 100.0;
    chain c;
    make_chain(&c, 3, k, 0.5);
    morph_blanket_def def = quiet(10.0);
    def.gravity = 9.81;
    def.fixed = top;
    def.fixed_count = 1;
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(&c.s, NULL, &def, c.start, &b), MORPH_OK);
    b->step = 1e-3;
    for (int n = 0; n < 10000; n++)
        assert_true(morph_blanket_step(b));
    assert_near(b->x[2], 0.0, 0.0);
    assert_near(b->x[5], -0.1 - 2.0 * m * 9.81 / k, 1e-9);
    assert_near(b->x[8], b->x[5] - 0.1 - m * 9.81 / k, 1e-9);
    morph_blanket_state_destroy(b);

    make_chain(&c, 3, k, 0.0);
    const double slow = sqrt(k / m * (3.0 - sqrt(5.0)) / 2.0), shape = (1.0 + sqrt(5.0)) / 2.0;
    c.start[5] -= 1e-4;
    c.start[8] -= 1e-4 * shape;
    def.gravity = 0.0;
    assert_int_equal(morph_blanket_state_create(&c.s, NULL, &def, c.start, &b), MORPH_OK);
    b->step = 1e-4;
    const int period = (int)(2.0 * acos(-1.0) / slow / b->step + 0.5);
    for (int n = 0; n < 3 * period; n++)
        assert_true(morph_blanket_step(b));
    const double phase = cos(slow * 3.0 * period * b->step);
    assert_near(b->x[5], -0.1 - 1e-4 * phase, 5e-8);
    assert_near(b->x[8], -0.2 - 1e-4 * shape * phase, 1e-7);
    morph_blanket_state_destroy(b);
}

/* Near a centre the softened pull is a spring of stiffness s / e^3; far out energy is kept. */
static void test_attraction(void **state) {
    (void)state;
    chain c;
    make_chain(&c, 2, 0.0, 0.0);
    c.limit[0][0] = 1e-9;
    const morph_attractor centre = {{0.0, 0.0, 0.0}, 0.004};
    morph_blanket_def def = quiet(1.0);
    def.attractors = &centre;
    def.attractor_count = 1;
    c.start[2] = 1e-4;
    c.start[5] = 0.3;
    c.start[3] = 0.2;
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(&c.s, NULL, &def, c.start, &b), MORPH_OK);
    b->step = 1e-4;
    const double omega = sqrt(centre.strength / (1e-3 * c.s.def.mass)), energy = morph_blanket_energy(b);
    const double kinetic = 0.004 / 0.1 - 0.004 / sqrt(0.04 + 0.09 + 0.01);
    double worst = 0.0;
    for (int n = 0; n < 4000; n++) {
        assert_true(morph_blanket_step(b));
        worst = fmax(worst, fabs(morph_blanket_energy(b) - energy));
        if (n % 1000 == 999) assert_near(b->x[2], 1e-4 * cos(omega * (n + 1) * b->step), 2e-8);
    }
    assert_true(worst < 1e-5 * kinetic);
    morph_blanket_state_destroy(b);
}

/* A force over a window leaves its impulse, on the joint that it was put on. */
static void test_hand(void **state) {
    (void)state;
    chain c;
    make_chain(&c, 2, 0.0, 0.0);
    const morph_hand hand = {1, {0.02, 0.0, -0.01}, 0.1, 0.35};
    morph_blanket_def def = quiet(0.5);
    def.hands = &hand;
    def.hand_count = 1;
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(&c.s, NULL, &def, c.start, &b), MORPH_OK);
    b->step = 1e-3;
    for (int n = 0; n < 500; n++)
        assert_true(morph_blanket_step(b));
    for (int k = 0; k < 3; k++) {
        assert_near(b->v[k], 0.0, 0.0);
        /* Half a step at each end of the window is open to the order of the kicks. */
        assert_near(b->v[3 + k], hand.force[k] * 0.25 / c.s.def.mass,
                    fabs(hand.force[k]) * 1e-3 / c.s.def.mass);
    }
    morph_blanket_state_destroy(b);
}

/* A free blanket at 5 % strain, undamped, with its own step: what the energy departs from its start in 10,000
 * steps (its ripple), how that falls with the step, and how far its mean drifts from first to last tenth. */
static double energy_drift(double part, double *drift) {
    morph_structure *s = grid(4, 4);
    s->def.damping = 0.0;
    const morph_blanket_def def = quiet(1.0);
    double *x0 = malloc(3 * (size_t)s->joints * sizeof *x0);
    assert_non_null(x0);
    for (int k = 0; k < 3 * s->joints; k++)
        x0[k] = s->start[k] * (k % 3 == 2 ? 1.0 : 1.05);
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(s, NULL, &def, x0, &b), MORPH_OK);
    b->step *= part;
    const double energy = morph_blanket_energy(b);
    double worst = 0.0, first = 0.0, last = 0.0;
    for (int n = 0; n < 10000; n++) {
        assert_true(morph_blanket_step(b));
        const double now = morph_blanket_energy(b) / energy - 1.0;
        worst = fmax(worst, fabs(now));
        first += n < 1000 ? now / 1000.0 : 0.0;
        last += n >= 9000 ? now / 1000.0 : 0.0;
    }
    *drift = fabs(last - first);
    morph_blanket_state_destroy(b);
    morph_structure_destroy(s);
    free(x0);
    return worst;
}

static void test_energy_drift(void **state) {
    (void)state;
    double drift, unused;
    const double whole = energy_drift(1.0, &drift), quarter = energy_drift(0.25, &unused);
    const double eighth = energy_drift(0.125, &unused);
    print_message(
        "energy over 10,000 steps departs by %.2e at the own step (drift of its mean %.1e), %.2e at a "
        "quarter, %.2e at an eighth\n",
        whole, drift, quarter, eighth);
    assert_true(drift < 1e-3 && whole < 0.02);
    assert_true(quarter < 1e-3);
    assert_true(quarter / eighth > 3.5 && quarter / eighth < 4.5);
}

/* Prescribed lengths are followed: a sheet is stretched by a tenth in x, evenly. */
static void test_drive(void **state) {
    (void)state;
    morph_structure *s = grid(4, 4);
    double *length = malloc(2 * (size_t)s->links * sizeof *length);
    assert_non_null(length);
    for (int l = 0; l < s->links; l++) {
        const int *a = s->joint_node[s->link[l][0]], *b = s->joint_node[s->link[l][1]];
        length[l] = s->start_length[l];
        length[s->links + l] = s->start_length[l] * (a[0] != b[0] ? 1.1 : 1.0);
    }
    const morph_drive drive = {2, 0.5, length};
    morph_blanket_def def = quiet(1.0);
    def.drive = &drive;
    morph_trajectory t;
    morph_blanket_report r;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, s->start, NULL, &t, &r), MORPH_OK);
    print_message("prescribed lengths: off by %.1e m\n", r.worst_length);
    assert_true(r.worst_length <= 1e-9 * s->spacing);
    const double *x = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)s->joints];
    assert_near(x[3 * 3] - x[0], 0.33, 1e-9);
    assert_near(x[3 * 12 + 1] - x[1], 0.3, 1e-9);
    morph_trajectory_free(&t);
    free(length);
    morph_structure_destroy(s);
}

typedef struct stage {
    morph_structure *s;
    morph_distance *exact;
    morph_sdf *sdf;
    int *fixed, fixed_count;
    double *start;
} stage;

/* A sheet, its border marked, with a solid about it: `made`, as it stands. cell: of the field, m. */
static void make_stage(stage *g, int nodes, double cell) {
    g->s = grid(nodes, nodes);
    g->exact = finish(true);
    double lo[3] = {-0.3, -0.3, -0.05}, hi[3] = {0.3, 0.3, 0.15};
    for (int i = 0; i < 3 * made.nv; i++) {
        lo[i % 3] = fmin(lo[i % 3], made.v[i] - 0.05);
        hi[i % 3] = fmax(hi[i % 3], made.v[i] + 0.05);
    }
    assert_int_equal(morph_sdf_create(g->exact, lo, hi, cell, NULL, &g->sdf), MORPH_OK);
    g->fixed = malloc((size_t)g->s->joints * sizeof(int));
    g->start = malloc(3 * (size_t)g->s->joints * sizeof(double));
    assert_true(g->fixed && g->start);
    g->fixed_count = 0;
    for (int j = 0; j < g->s->joints; j++) {
        const int *at = g->s->joint_node[j];
        if (at[0] == 0 || at[1] == 0 || at[0] == nodes - 1 || at[1] == nodes - 1)
            g->fixed[g->fixed_count++] = j;
    }
    memcpy(g->start, g->s->start, 3 * (size_t)g->s->joints * sizeof(double));
}

/* Ball of radius r whose top is at z. */
static void make_ball(double r, double z) {
    make_sphere(4);
    for (int i = 0; i < 3 * made.nv; i++)
        made.v[i] = r * made.v[i] + (i % 3 == 2 ? z - r : 0.0);
}

static void free_stage(stage *g) {
    morph_distance_destroy(g->exact);
    morph_sdf_destroy(g->sdf);
    morph_structure_destroy(g->s);
    free(g->fixed);
    free(g->start);
}

/* Least distance of joints, links and skin to the target where it stood, less their radius. */
static double clearance(const stage *g, const double *x, double lift) {
    double least = INFINITY, v[3][3], weight[3];
    morph_closest at;
    for (int n = 0; n < g->s->links + g->s->skin_triangles; n++) {
        const bool link = n < g->s->links;
        const int *joint = link ? g->s->link[n] : g->s->skin[n - g->s->links];
        for (int k = 0; k < (link ? 2 : 3); k++)
            for (int m = 0; m < 3; m++)
                v[k][m] = x[3 * joint[k] + m] - (m == 2 ? lift : 0.0);
        if (link)
            morph_distance_segment(g->exact, v[0], v[1], weight, &at);
        else
            morph_distance_triangle(g->exact, v[0], v[1], v[2], weight, &at);
        least = fmin(least, at.distance - g->s->def.radius);
    }
    return least;
}

typedef struct risen {
    morph_blanket_report report;
    double clearance, length, lift, border;
} risen;

static risen rise(int nodes, double radius, double top) {
    stage g;
    make_ball(radius, top);
    make_stage(&g, nodes, 0.1 / 12);
    const morph_blanket_def def = {.gravity = 9.81,
                                   .drag = 0.2,
                                   .friction = 0.6,
                                   .time = 5.0,
                                   .frame = 0.01,
                                   .base = NAN,
                                   .fixed = g.fixed,
                                   .fixed_count = g.fixed_count,
                                   .rise = top + 0.08,
                                   .rise_time = 1.0};
    morph_trajectory t;
    risen r = {.clearance = INFINITY};
    assert_int_equal(morph_blanket_run(g.s, g.sdf, g.exact, &def, g.start, NULL, &t, &r.report), MORPH_OK);
    for (int f = 0; f < t.frames; f++) {
        const double *x = &t.x[(size_t)f * 3 * (size_t)g.s->joints];
        r.clearance = fmin(r.clearance, clearance(&g, x, t.lift[f]));
        for (int l = 0; l < g.s->links; l++) {
            const double length = morph_dist(&x[3 * g.s->link[l][0]], &x[3 * g.s->link[l][1]]);
            r.length =
                fmax(r.length, fmax(g.s->length_limit[l][0] - length, length - g.s->length_limit[l][1]));
        }
        for (int k = 0; k < g.fixed_count; k++)
            r.border = fmax(r.border, morph_dist(&x[3 * g.fixed[k]], &g.start[3 * g.fixed[k]]));
    }
    r.lift = t.lift[t.frames - 1];
    assert_near(t.lift[0], -(top + 0.08), 0.0);
    print_message(
        "ball of %.2f m rising to %.2f m into %d x %d: rest %d after %.2f s, lift %.3f, clearance %.1e, "
        "length over by %.1e, border %.1e m; held up %d by %d of %d\n",
        radius, top, nodes, nodes, r.report.at_rest, t.time[t.frames - 1], r.lift, r.clearance, r.length,
        r.border, r.report.held_up, r.report.held_by, r.report.held_element);
    morph_trajectory_free(&t);
    free_stage(&g);
    return r;
}

static void test_rise(void **state) {
    (void)state;
    const risen fits = rise(6, 0.15, 0.06);
    assert_false(fits.report.held_up);
    assert_true(fits.report.at_rest);
    assert_near(fits.lift, 0.0, 0.0);
    assert_true(fits.clearance >= -1e-4 && fits.length <= 1e-10);
    assert_near(fits.border, 0.0, 0.0);
    /* Links of 0.135 m cannot reach a top 0.25 m above their frame from a border one spacing off. */
    const risen high = rise(4, 0.08, 0.25);
    assert_true(high.report.held_up && high.report.held_element >= 0);
    assert_near(high.lift, -high.report.short_of, 0.0);
    assert_true(high.report.short_of > 0.05 && high.report.short_of < 0.25);
    assert_true(high.clearance >= -1e-4 && high.length <= 1e-10);
    assert_near(high.border, 0.0, 0.0);
}

/* A blanket shot at a plate of a tenth of the spacing stays on its side. */
static void test_fast_and_thin(void **state) {
    (void)state;
    static const double speeds[] = {10.0, 1000.0};
    stage g;
    make_box(0.3, 0.3, 0.005);
    make_stage(&g, 4, 0.004);
    for (int k = 0; k < g.s->joints; k++)
        g.start[3 * k + 2] += 0.1;
    for (int n = 0; n < 2; n++) {
        const morph_blanket_def def = {.gravity = 9.81,
                                       .drag = 0.2,
                                       .friction = 0.6,
                                       .time = 0.1,
                                       .frame = 0.01,
                                       .base = NAN,
                                       .velocity = {0.0, 0.0, -speeds[n]}};
        morph_trajectory t;
        morph_blanket_report r;
        assert_int_equal(morph_blanket_run(g.s, g.sdf, g.exact, &def, g.start, NULL, &t, &r), MORPH_OK);
        double lowest = INFINITY;
        for (int f = 0; f < t.frames; f++)
            for (int j = 0; j < g.s->joints; j++) {
                const double *q = &t.x[((size_t)f * (size_t)g.s->joints + (size_t)j) * 3];
                if (fabs(q[0]) < 0.3 && fabs(q[1]) < 0.3) lowest = fmin(lowest, q[2]);
            }
        print_message("%g m/s: lowest joint above the plate's middle by %.4f m, %d steps\n", speeds[n],
                      lowest, r.steps);
        assert_true(lowest > 0.0 && lowest < 0.02);
        assert_true(r.worst_length <= 1e-10);
        morph_trajectory_free(&t);
    }
    free_stage(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hanging_chain), cmocka_unit_test(test_attraction), cmocka_unit_test(test_hand),
        cmocka_unit_test(test_energy_drift),  cmocka_unit_test(test_drive),      cmocka_unit_test(test_rise),
        cmocka_unit_test(test_fast_and_thin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
