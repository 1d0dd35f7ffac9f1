/* Springs at the angle limits: derivatives, energy, the step they allow, and what they do to a drop. */
#include "model/blanket_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/model/solids.h"

static morph_structure *grid(int n, double stiffness, double soft, double square) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = n;
    def.angle_stiffness = stiffness;
    def.angle_soft = soft * acos(-1.0) / 180.0;
    def.square = square;
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static double shake(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) * 0x1p-53 - 0.5;
}

/* Every joint shaken by up to `by` spacings each way. */
static double *shaken(const morph_structure *s, double by, uint64_t seed) {
    double *x = malloc(3 * (size_t)s->joints * sizeof *x);
    assert_non_null(x);
    for (int k = 0; k < 3 * s->joints; k++)
        x[k] = s->start[k] + 2.0 * by * s->spacing * shake(&seed);
    return x;
}

static morph_blanket_state *state_of(const morph_structure *s, const double *x) {
    const morph_blanket_def def = {.time = 1.0, .frame = 0.01, .base = NAN};
    morph_blanket_state *b;
    assert_int_equal(morph_blanket_state_create(s, NULL, &def, x, &b), MORPH_OK);
    memcpy(b->x, x, 3 * (size_t)s->joints * sizeof *x);
    return b;
}

/* Worst difference between m a and the central differences of the energy, relative to the largest force. */
static double worst_difference(morph_blanket_state *b) {
    double worst = 0.0, largest = 0.0;
    const double h = 1e-7;
    morph_blanket_accelerations(b);
    for (int k = 0; k < 3 * b->joints; k++) {
        const double x = b->x[k];
        b->x[k] = x + h;
        const double more = morph_blanket_energy(b);
        b->x[k] = x - h;
        const double less = morph_blanket_energy(b);
        b->x[k] = x;
        const double force = b->structure->def.mass * b->a[k];
        worst = fmax(worst, fabs(force + (more - less) / (2.0 * h)));
        largest = fmax(largest, fabs(force));
    }
    return worst / largest;
}

static void test_derivatives(void **state) {
    (void)state;
    for (int n = 0; n < 20; n++) {
        /* Beyond the limits and within; square springs alone and both. */
        morph_structure *s = grid(3, n % 3 == 2 ? 0.0 : 2.0, 5.0 * (n % 4), n % 3 == 0 ? 0.0 : 0.3);
        double *x = shaken(s, 0.25 + 0.01 * n, (uint64_t)n);
        morph_blanket_state *b = state_of(s, x);
        s->def.stiffness = 1e-6; /* what the links' springs do is tested elsewhere */
        assert_true(n % 3 == 2 || morph_blanket_angle_energy(b) > 0.0);
        assert_true(worst_difference(b) < 1e-6);
        /* The test sees a force that is off by a part in a thousand. */
        morph_blanket_accelerations(b);
        double size = 0.0;
        for (int k = 0; k < 3 * b->joints; k++)
            size = fmax(size, fabs(b->a[k]));
        if (n == 7) {
            s->def.angle_stiffness *= 1.001;
            morph_blanket_accelerations(b);
            const double energy_of_old = morph_blanket_angle_energy(b);
            s->def.angle_stiffness /= 1.001;
            assert_true(morph_blanket_angle_energy(b) < energy_of_old);
            double change = 0.0, total[3] = {0.0};
            for (int k = 0; k < 3 * b->joints; k++) {
                change = fmax(change, fabs(b->a[k]));
                total[k % 3] += b->a[k];
            }
            assert_true(fabs(change / size - 1.001) < 0.002 && change > size);
            for (int k = 0; k < 3; k++) /* inner forces add up to none */
                assert_true(fabs(total[k]) < 1e-9 * size);
        }
        morph_blanket_state_destroy(b);
        free(x);
        morph_structure_destroy(s);
    }
}

/* The flat sheet feels nothing, even of a zone that reaches further than from the limit to 90 degrees. */
static void test_flat(void **state) {
    (void)state;
    static const double soft[] = {0.0, 5.0, 60.0};
    for (int n = 0; n < 3; n++) {
        morph_structure *s = grid(3, 100.0, soft[n], 0.0);
        morph_blanket_state *b = state_of(s, s->start);
        morph_blanket_accelerations(b);
        for (int k = 0; k < 3 * b->joints; k++)
            assert_true(fabs(b->a[k]) < 1e-9);
        assert_true(morph_blanket_angle_energy(b) < 1e-20);
        morph_blanket_state_destroy(b);
        morph_structure_destroy(s);
    }
}

/* Largest eigenvalue of the angle springs' stiffness matrix by power iteration on differences of forces. */
static double stiffest(morph_blanket_state *b) {
    const int n = 3 * b->joints;
    double *v = malloc((size_t)n * sizeof *v), *x = malloc((size_t)n * sizeof *x);
    double *a = malloc((size_t)n * sizeof *a);
    assert_true(v && x && a);
    uint64_t seed = 5;
    double norm = 1.0;
    for (int k = 0; k < n; k++)
        v[k] = shake(&seed);
    memcpy(x, b->x, (size_t)n * sizeof *x);
    for (int round = 0; round < 200; round++) {
        double square = 0.0;
        for (int side = 0; side < 2; side++) {
            for (int k = 0; k < n; k++)
                b->x[k] = x[k] + (side ? -1e-7 : 1e-7) * v[k];
            morph_blanket_accelerations(b);
            if (!side) memcpy(a, b->a, (size_t)n * sizeof *a);
        }
        for (int k = 0; k < n; k++) {
            v[k] = b->structure->def.mass * (b->a[k] - a[k]) / 2e-7;
            square += v[k] * v[k];
        }
        norm = sqrt(square);
        for (int k = 0; k < n; k++)
            v[k] /= norm;
    }
    memcpy(b->x, x, (size_t)n * sizeof *x);
    free(v);
    free(x);
    free(a);
    return norm;
}

static void test_stiffest(void **state) {
    (void)state;
    for (int n = 0; n < 6; n++) {
        morph_structure *s = grid(4, 50.0, 34.9, 0.0);
        double *x = shaken(s, 0.06 + 0.01 * n, (uint64_t)n + 100);
        morph_blanket_state *b = state_of(s, x);
        s->def.stiffness = 1e-6;
        const double is = stiffest(b), bound = morph_blanket_angle_stiffness(s);
        if (n == 0 || n == 5) print_message("stiffest mode %.3g N/m, bound %.3g\n", is, bound);
        assert_true(is > 0.02 * bound && is <= bound);
        morph_blanket_state_destroy(b);
        free(x);
        morph_structure_destroy(s);
    }
}

/* An undamped sheet whose posts are thrown against the limits swings; no energy comes or goes but ripple that
 * falls with the square of the step. */
static double energy_ripple(double part, double *share) {
    morph_structure *s = grid(3, 3.0, 30.0, 0.02);
    s->def.damping = 0.0;
    morph_blanket_state *b = state_of(s, s->start);
    b->step = part * morph_blanket_stable_step(s, &b->def);
    for (int j = 0; j < s->joints; j++) {
        const double top = s->joint_layer[j] ? 1.0 : -1.0;
        b->v[3 * j] = 0.12 * top * (s->joint_node[j][0] - 1.0);
        b->v[3 * j + 1] = 0.4 * top;
    }
    morph_blanket_accelerations(b);
    const double energy = morph_blanket_energy(b);
    double worst = 0.0;
    *share = 0.0;
    const int steps = (int)(1.5 / b->step);
    for (int n = 0; n < steps; n++) {
        assert_true(morph_blanket_step(b));
        worst = fmax(worst, fabs(morph_blanket_energy(b) / energy - 1.0));
        *share = fmax(*share, morph_blanket_angle_energy(b) / energy);
    }
    morph_blanket_state_destroy(b);
    morph_structure_destroy(s);
    return worst;
}

static void test_energy(void **state) {
    (void)state;
    double share, unused;
    const double whole = energy_ripple(1.0, &share), quarter = energy_ripple(0.25, &unused);
    const double sixteenth = energy_ripple(0.0625, &unused);
    print_message(
        "angle springs hold up to %.2f of the energy; it departs by %.1e at the own step, %.1e at a quarter, "
        "%.1e at a sixteenth\n",
        share, whole, quarter, sixteenth);
    assert_true(share > 0.2);
    assert_true(whole < 0.02 && quarter < 1e-3);
    /* Second order, 16 a quarter, but for where the force has its kink. */
    assert_true(quarter / sixteenth > 8.0);
}

/* Mean and largest lean of posts from their links at the end of a drop over a box, degrees. */
typedef struct lean {
    double mean, most, depth;
    morph_blanket_report report;
} lean;

static lean drop(double stiffness, double soft, double square) {
    morph_structure *s = grid(5, stiffness, soft, square);
    make_box(0.09, 0.09, 0.06);
    morph_distance *exact = finish(true);
    morph_sdf *sdf;
    const double lo[3] = {-0.4, -0.4, -0.1}, hi[3] = {0.4, 0.4, 0.3};
    assert_int_equal(morph_sdf_create(exact, lo, hi, 0.01, NULL, &sdf), MORPH_OK);
    double *x = shaken(s, 0.0, 1);
    for (int j = 0; j < s->joints; j++)
        x[3 * j + 2] += 0.1;
    const morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.6, .time = 4.0, .frame = 0.01, .base = -0.06};
    morph_trajectory t;
    lean l = {0};
    assert_int_equal(morph_blanket_run(s, sdf, exact, &def, x, NULL, &t, &l.report), MORPH_OK);
    const double *end = &t.x[(size_t)(t.frames - 1) * 3 * (size_t)s->joints];
    for (int n = 0; n < s->link_posts; n++) {
        int uj[2], vj[2];
        double u[3], v[3];
        morph_link_post_joints(s, n, uj, vj);
        morph_sub(&end[3 * uj[1]], &end[3 * uj[0]], u);
        morph_sub(&end[3 * vj[1]], &end[3 * vj[0]], v);
        const double c = morph_dot(u, v) / (morph_norm(u) * morph_norm(v));
        const double off = fabs(90.0 - acos(c) * 180.0 / acos(-1.0));
        l.mean += off / s->link_posts;
        l.most = fmax(l.most, off);
    }
    morph_trajectory_free(&t);
    morph_sdf_destroy(sdf);
    morph_distance_destroy(exact);
    free(x);
    morph_structure_destroy(s);
    return l;
}

static void test_drop(void **state) {
    (void)state;
    const lean none = drop(0.0, 5.0, 0.0), little = drop(2.0, 5.0, 0.0), wide = drop(2.0, 30.0, 0.0);
    const lean square = drop(0.0, 5.0, 0.2);
    const lean *all[] = {&none, &little, &wide, &square};
    static const char *const name[] = {"none", "2 N m from 5 degrees", "2 N m from 30 degrees",
                                       "square 0.2 N m"};
    for (int k = 0; k < 4; k++)
        print_message("%-22s lean mean %.2f, most %.2f degrees; at rest %d, %d steps, length %.0e\n", name[k],
                      all[k]->mean, all[k]->most, all[k]->report.at_rest, all[k]->report.steps,
                      all[k]->report.worst_length);
    for (int k = 0; k < 4; k++)
        assert_true(all[k]->report.worst_length <= 1e-10 && all[k]->report.worst_clearance <= 1e-4);
    assert_true(little.most < none.most - 1.0);
    assert_true(wide.mean < 0.8 * none.mean);
    assert_true(square.mean < 0.8 * none.mean);
}

static void test_refused(void **state) {
    (void)state;
    static const double bad[] = {-1.0, NAN, INFINITY};
    for (int k = 0; k < 9; k++) {
        morph_structure_def def = morph_structure_defaults(0.1);
        def.nodes[0] = def.nodes[1] = 3;
        double *const field[] = {&def.angle_stiffness, &def.angle_soft, &def.square};
        *field[k / 3] = bad[k % 3];
        morph_structure *s;
        assert_int_equal(morph_structure_create(&def, &s), MORPH_ERR_INPUT);
        assert_null(s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_derivatives), cmocka_unit_test(test_flat), cmocka_unit_test(test_stiffest),
        cmocka_unit_test(test_energy),      cmocka_unit_test(test_drop), cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
