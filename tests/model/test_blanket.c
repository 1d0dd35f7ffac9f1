/* The blanket's motion without a target: closed forms, conservation, limits, friction on the base plane. */
#include "model/blanket_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static morph_structure *grid(int n) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = n;
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static morph_blanket_def free_def(void) {
    return (morph_blanket_def){.gravity = 9.81, .time = 1.0, .frame = 0.01, .base = NAN};
}

/* Start pose lifted by z. */
static double *lifted(const morph_structure *s, double z) {
    double *x = malloc(3 * (size_t)s->joints * sizeof *x);
    assert_non_null(x);
    memcpy(x, s->start, 3 * (size_t)s->joints * sizeof *x);
    for (int j = 0; j < s->joints; j++)
        x[3 * j + 2] += z;
    return x;
}

static const double *frame_of(const morph_trajectory *t, int frame) {
    return &t->x[(size_t)frame * 3 * (size_t)t->joints];
}

/* Two joints and one link along x, wide limits: the arrays live in the caller's frame. */
typedef struct pair {
    morph_structure s;
    int link[1][2], kind[1];
    double limit[1][2], start_length[1], radius[1];
} pair;

static void make_pair(pair *p, double stiffness, double damping) {
    memset(p, 0, sizeof *p);
    p->s.def = morph_structure_defaults(0.1);
    p->s.def.stiffness = stiffness;
    p->s.def.damping = damping;
    p->s.joints = 2;
    p->s.links = 1;
    p->link[0][1] = 1;
    p->limit[0][0] = 0.01;
    p->limit[0][1] = 1.0;
    p->start_length[0] = 0.1;
    p->radius[0] = 0.004;
    p->s.link = p->link;
    p->s.link_kind = p->kind;
    p->s.length_limit = p->limit;
    p->s.start_length = p->start_length;
    p->s.link_radius = p->radius;
    p->s.spacing = 0.1;
}

/* z = z0 - g t^2 / 2; with drag b, z0 - g/b (t - (1 - e^-bt) / b). */
static void test_free_fall(void **state) {
    (void)state;
    morph_structure *s = grid(3);
    for (int dragged = 0; dragged < 2; dragged++) {
        morph_blanket_def def = free_def();
        def.drag = dragged ? 2.0 : 0.0;
        morph_trajectory t;
        morph_blanket_report report;
        double *x0 = lifted(s, 1.0);
        assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, x0, NULL, &t, &report), MORPH_OK);
        assert_int_equal(t.frames, 101);
        assert_false(report.at_rest);
        for (int f = 0; f < t.frames; f += 10) {
            const double time = t.time[f], b = def.drag, g = def.gravity;
            const double fall = dragged ? g / b * (time - (1.0 - exp(-b * time)) / b) : 0.5 * g * time * time;
            for (int j = 0; j < s->joints; j++) {
                /* Leapfrog is exact for constant force; the drag's factor is of second order in the step:
                 * b^2 step^2 / 12 = 1e-6 of 5 m. */
                assert_near(frame_of(&t, f)[3 * j + 2], x0[3 * j + 2] - fall, dragged ? 1e-5 : 1e-11);
                assert_near(frame_of(&t, f)[3 * j], x0[3 * j], 1e-11);
            }
        }
        free(x0);
        morph_trajectory_free(&t);
    }
    morph_structure_destroy(s);
}

/* Two masses on one spring: L = L0 + A e^(-lambda t) (cos(w t) + lambda / w sin(w t)), lambda = c / m, w^2 =
 * 2 k / m - lambda^2. Errors must fall with the square of the step. */
static double oscillator_error(double damping, double step) {
    pair p;
    make_pair(&p, 50.0, damping);
    morph_blanket_def def = free_def();
    def.gravity = 0.0;
    def.frame = 0.02;
    def.step = step;
    const double x0[6] = {-0.06, 0, 0, 0.06, 0, 0};
    morph_trajectory t;
    assert_int_equal(morph_blanket_run(&p.s, NULL, NULL, &def, x0, NULL, &t, NULL), MORPH_OK);
    const double lambda = damping / p.s.def.mass, w = sqrt(2.0 * 50.0 / p.s.def.mass - lambda * lambda);
    double worst = 0.0;
    for (int f = 0; f < t.frames; f++) {
        const double time = t.time[f], *x = frame_of(&t, f);
        const double exact = 0.1 + 0.02 * exp(-lambda * time) * (cos(w * time) + lambda / w * sin(w * time));
        worst = fmax(worst, fabs(x[3] - x[0] - exact));
        assert_near(x[3] + x[0], 0.0, 1e-14);
    }
    morph_trajectory_free(&t);
    return worst;
}

static void test_oscillator(void **state) {
    (void)state;
    for (int damped = 0; damped < 2; damped++) {
        const double damping = damped ? 0.1 : 0.0;
        const double coarse = oscillator_error(damping, 1e-3), fine = oscillator_error(damping, 5e-4);
        assert_true(fine < 5e-4);
        assert_true(fine > 1e-9);
        assert_true(coarse / fine > 3.7 && coarse / fine < 4.3);
    }
}

/* Largest departure of the energy from its start over half a second of a stretched, bent, undamped free
 * grid, posts and all. */
static double energy_ripple(double step) {
    morph_structure *s = grid(4);
    s->def.damping = 0.0;
    morph_blanket_def def = free_def();
    def.gravity = 0.0;
    double *x0 = lifted(s, 0.0);
    for (int p = 0; p < s->posts; p++)
        for (int layer = 0; layer < 2; layer++) {
            double *x = &x0[3 * s->post[p][layer]];
            const double bump = 0.01 * (x[0] * x[0] - 0.5 * x[1]) / 0.0225;
            x[0] *= 1.02;
            x[2] += bump;
        }
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(s, NULL, &def, x0, &b), MORPH_OK);
    b->step = step;
    const double start = morph_blanket_energy(b);
    assert_true(start > 1e-4);
    double worst = 0.0;
    const int steps = (int)(0.5 / step + 0.5);
    for (int k = 0; k < steps; k++) {
        assert_true(morph_blanket_step(b));
        worst = fmax(worst, fabs(morph_blanket_energy(b) / start - 1.0));
    }
    morph_blanket_state_destroy(b);
    free(x0);
    morph_structure_destroy(s);
    return worst;
}

static void test_energy(void **state) {
    (void)state;
    const double coarse = energy_ripple(1e-3), fine = energy_ripple(5e-4);
    print_message("energy ripple %.2e at 1 ms, %.2e at 0.5 ms\n", coarse, fine);
    assert_true(coarse < 0.02);
    assert_true(coarse / fine > 3.4 && coarse / fine < 4.6);
}

/* Dampers, springs, posts and limits act between joints: momentum, and about the centre angular momentum of
 * a free grid at rest, stay 0, though the grid starts beyond its limits. */
static void test_momentum(void **state) {
    (void)state;
    morph_structure *s = grid(4);
    morph_blanket_def def = free_def();
    def.gravity = 0.0;
    double *x0 = lifted(s, 0.0);
    for (int j = 0; j < s->joints; j++)
        for (int k = 0; k < 3; k++)
            x0[3 * j + k] += 0.035 * sin(7.0 * j + 11.0 * k);
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(s, NULL, &def, x0, &b), MORPH_OK);
    b->step = 1e-3;
    double fastest = 0.0;
    for (int step = 0; step < 200; step++) {
        assert_true(morph_blanket_step(b));
        double p[3] = {0, 0, 0};
        for (int j = 0; j < s->joints; j++)
            for (int k = 0; k < 3; k++) {
                p[k] += b->v[3 * j + k];
                fastest = fmax(fastest, fabs(b->v[3 * j + k]));
            }
        assert_true(morph_norm(p) < 1e-10);
    }
    assert_true(fastest > 0.1);
    morph_blanket_state_destroy(b);
    free(x0);
    morph_structure_destroy(s);
}

/* Worst violations of one frame against the structure's own limits, by the test's own arithmetic. */
static void check_frame(const morph_structure *s, const double *x, double length, double post, double angle) {
    for (int l = 0; l < s->links; l++) {
        const double size = morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]);
        assert_true(size >= s->length_limit[l][0] - length && size <= s->length_limit[l][1] + length);
    }
    for (int p = 0; p < s->posts; p++)
        assert_near(morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]), s->post_length[p],
                    post * s->post_length[p]);
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        int uj[2], vj[2];
        double u[3], v[3];
        const bool post_tuple = t < s->link_posts;
        if (post_tuple)
            morph_link_post_joints(s, t, uj, vj);
        else
            morph_link_link_joints(s, t - s->link_posts, uj, vj);
        const double *limit = post_tuple ? s->link_post_limit[t] : s->link_link_limit[t - s->link_posts];
        morph_sub(&x[3 * uj[1]], &x[3 * uj[0]], u);
        morph_sub(&x[3 * vj[1]], &x[3 * vj[0]], v);
        const double a = acos(morph_dot(u, v) / (morph_norm(u) * morph_norm(v)));
        assert_true(a >= limit[0] - angle && a <= limit[1] + angle);
    }
}

/* A tilted grid falls on the bare base plane and comes to rest there, flat or nearly so. */
static void test_base(void **state) {
    (void)state;
    morph_structure *s = grid(4);
    morph_blanket_def def = free_def();
    def.base = 0.0;
    def.friction = 0.6;
    def.drag = 0.2;
    def.time = 3.0;
    double *x0 = lifted(s, 0.0);
    for (int j = 0; j < s->joints; j++) {
        const double x = x0[3 * j], z = x0[3 * j + 2];
        x0[3 * j] = 0.8 * x - 0.6 * z;
        x0[3 * j + 2] = 0.6 * x + 0.8 * z + 0.2;
    }
    morph_trajectory t;
    morph_blanket_report report;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, x0, NULL, &t, &report), MORPH_OK);
    assert_true(report.at_rest);
    assert_int_equal(report.step_halvings, 0);
    for (int f = 0; f < t.frames; f++) {
        check_frame(s, frame_of(&t, f), 1e-7, 1e-9, 0.01);
        for (int j = 0; j < s->joints; j++)
            assert_true(frame_of(&t, f)[3 * j + 2] >= 0.004 - 1e-4);
    }
    for (int j = 0; j < s->posts; j++)
        assert_true(frame_of(&t, t.frames - 1)[3 * j + 2] < 0.03);
    free(x0);
    morph_trajectory_free(&t);
    morph_structure_destroy(s);
}

static int stop_at_ten(void *user) {
    return ++*(int *)user > 10;
}

static void test_stop_keeps_frames(void **state) {
    (void)state;
    morph_structure *s = grid(3);
    const morph_blanket_def def = free_def();
    int asked = 0;
    const morph_control control = {.stop = stop_at_ten, .user = &asked};
    morph_trajectory t;
    morph_blanket_report report;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, s->start, &control, &t, &report),
                     MORPH_ERR_STOPPED);
    assert_int_equal(t.frames, 11);
    assert_near(t.time[10], 0.1, 1e-12);
    assert_true(frame_of(&t, 10)[2] < -0.04);
    morph_trajectory_free(&t);
    assert_null(t.x);
    morph_structure_destroy(s);
}

/* Much too long a step is found out by the energy and halved until the motion is sound. */
static void test_step_is_halved(void **state) {
    (void)state;
    pair p;
    make_pair(&p, 200.0, 0.0);
    morph_blanket_def def = free_def();
    def.gravity = 0.0;
    def.step = 0.05; /* stable below 2 / sqrt(2 k / m) = 0.014 */
    def.frame = 0.05;
    const double x0[6] = {-0.06, 0, 0, 0.06, 0, 0};
    morph_trajectory t;
    morph_blanket_report report;
    assert_int_equal(morph_blanket_run(&p.s, NULL, NULL, &def, x0, NULL, &t, &report), MORPH_OK);
    assert_true(report.step_halvings >= 2);
    assert_true(report.step < 0.014);
    for (int f = 0; f < t.frames; f++)
        assert_true(fabs(frame_of(&t, f)[3] - frame_of(&t, f)[0] - 0.1) < 0.03);
    morph_trajectory_free(&t);
}

/* Whatever the start, the run ends with sound numbers. */
static void test_wild_starts(void **state) {
    (void)state;
    morph_structure *s = grid(4);
    morph_blanket_def def = free_def();
    def.base = 0.0;
    def.friction = 0.6;
    def.time = 0.3;
    unsigned random = 2;
    for (int run = 0; run < 12; run++) {
        double *x0 = lifted(s, 0.5);
        const double size = run % 3 == 0 ? 0.03 : run % 3 == 1 ? 0.2 : 2.0;
        for (int k = 0; k < 3 * s->joints; k++) {
            random = random * 1664525u + 1013904223u;
            x0[k] += size * ((double)(random >> 8) / 16777216.0 - 0.5);
        }
        morph_trajectory t;
        morph_blanket_report report;
        const morph_status status = morph_blanket_run(s, NULL, NULL, &def, x0, NULL, &t, &report);
        assert_int_equal(status, MORPH_OK);
        for (int k = 0; k < 3 * s->joints * t.frames; k++)
            assert_true(fabs(t.x[k]) < 100.0);
        free(x0);
        morph_trajectory_free(&t);
    }
    morph_structure_destroy(s);
}

static void test_refusals(void **state) {
    (void)state;
    morph_structure *s = grid(2);
    morph_trajectory t;
    morph_blanket_def def = free_def();
    def.gravity = NAN;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, s->start, NULL, &t, NULL), MORPH_ERR_INPUT);
    def = free_def();
    def.frame = 0.0;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, s->start, NULL, &t, NULL), MORPH_ERR_INPUT);
    def = free_def();
    def.frame = 1e-9;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, s->start, NULL, &t, NULL), MORPH_ERR_INPUT);
    def = free_def();
    double *x0 = lifted(s, 0.0);
    x0[5] = NAN;
    assert_int_equal(morph_blanket_run(s, NULL, NULL, &def, x0, NULL, &t, NULL), MORPH_ERR_NONFINITE);
    assert_null(t.x);
    free(x0);
    morph_structure_destroy(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_fall),      cmocka_unit_test(test_oscillator),
        cmocka_unit_test(test_energy),         cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_base),           cmocka_unit_test(test_stop_keeps_frames),
        cmocka_unit_test(test_step_is_halved), cmocka_unit_test(test_wild_starts),
        cmocka_unit_test(test_refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
