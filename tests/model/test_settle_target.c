/* Settle on targets: its rest beside the end of the blanket's own dynamics from the same scene; how the rest
 * follows the centres, against settling again. */
#include "model/blanket.h"
#include "model/cavity.h"
#include "settle_scene.h"

/* By the test's own arithmetic. */
static void check_pose(const scene *s, const double *x) {
    const morph_structure *st = s->structure;
    for (int l = 0; l < st->links; l++) {
        const double length = morph_dist(&x[3 * st->link[l][0]], &x[3 * st->link[l][1]]);
        assert_true(length >= st->length_limit[l][0] - 1e-6 * st->spacing);
        assert_true(length <= st->length_limit[l][1] + 1e-6 * st->spacing);
    }
    for (int p = 0; p < st->posts; p++)
        assert_true(fabs(morph_dist(&x[3 * st->post[p][0]], &x[3 * st->post[p][1]]) / st->post_length[p] -
                         1.0) < 1e-6);
    for (int j = 0; j < st->joints; j++)
        assert_true(x[3 * j + 2] >= st->def.radius - 1e-6 * st->spacing);
    for (int t = 0; t < st->skin_triangles; t++) {
        double weight[3];
        morph_closest at;
        morph_distance_triangle(s->exact, &x[3 * st->skin[t][0]], &x[3 * st->skin[t][1]],
                                &x[3 * st->skin[t][2]], weight, &at);
        /* The smooth distance rounds a box's edges by some 0.3 of its cell, a sixteenth of the spacing. */
        assert_true(at.distance >= st->def.radius - 0.02 * st->spacing);
    }
}

static void beside_the_dynamics(void **state) {
    (void)state;
    const morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = 3.0, .frame = 0.01, .base = 0.0};
    for (int k = 0; k < 4; k++) {
        const morph_structure_def sd = scene_structure(k < 2 ? 4 : 8, 20.0);
        scene s;
        scene_make(&s, &sd, k % 2 == 1);
        morph_settle_def settle_def = morph_settle_defaults();
        settle_def.friction = def.friction;
        settle_def.base = def.base;
        morph_settle *t = scene_settle(&s, &settle_def);
        morph_settle_report r;
        morph_trajectory motion;
        morph_blanket_report report;
        morph_cavity *cavity;
        morph_measure m[2];
        assert_int_equal(morph_cavity_create(s.structure, s.exact, 0.0, &cavity), MORPH_OK);
        assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
        assert_int_equal(
            morph_blanket_run(s.structure, s.sdf, s.exact, &def, s.start, NULL, &motion, &report), MORPH_OK);
        const double *end = &motion.x[(size_t)(motion.frames - 1) * (size_t)s.n];
        assert_int_equal(morph_cavity_measure(cavity, s.x, &m[0]), MORPH_OK);
        assert_int_equal(morph_cavity_measure(cavity, end, &m[1]), MORPH_OK);
        const double dynamic = morph_settle_energy(t, end);
        print_message("%s %d: gap %.3f, dynamics %.3f spacings; energy %.4f, %.4f J; %s, %.2f of %.2f s\n",
                      k % 2 ? "sphere" : "box", sd.nodes[0], m[0].gap_mean / 0.1, m[1].gap_mean / 0.1,
                      r.energy, dynamic, r.converged ? "converged" : "not converged", r.seconds,
                      report.seconds);
        assert_true(r.converged && r.stable);
        check_pose(&s, s.x);
        /* Friction leaves many resting shapes; these two came down different ways. */
        assert_true(r.energy < 1.02 * dynamic && r.energy > 0.9 * dynamic);
        assert_true(fabs(m[0].gap_mean - m[1].gap_mean) < 0.03 * 0.1);
        morph_cavity_destroy(cavity);
        morph_trajectory_free(&motion);
        morph_settle_destroy(t);
        scene_free(&s);
    }
}

/* f = sum of fixed weights times the joints' places. */
static double probe(const scene *s, double *slope) {
    double f = 0.0;
    for (int i = 0; i < s->n; i++) {
        const double w = sin(1.7 * i + 0.4);
        if (slope) slope[i] = w;
        f += w * s->x[i];
    }
    return f;
}

static double settled(scene *s, morph_settle *t, const double *rest, const morph_attractor *centre) {
    morph_settle_report r;
    memcpy(s->x, rest, s->bytes);
    assert_int_equal(morph_settle_attract(t, centre), MORPH_OK);
    assert_int_equal(morph_settle_run(t, s->x, true, NULL, &r), MORPH_OK);
    assert_true(r.converged && r.stable);
    return probe(s, NULL);
}

/* On the base plane alone, drawn together by two centres without friction, three joints held: posts, angle
 * and length limits and contacts carry forces. */
static void adjoint(void **state) {
    (void)state;
    const morph_structure_def sd = scene_structure(3, 20.0);
    scene s;
    scene_make(&s, &sd, true);
    const morph_attractor centre[2] = {{{0.03, 0.02, 0.02}, 0.008}, {{-0.05, 0.01, 0.1}, 0.004}};
    morph_settle_def def = morph_settle_defaults();
    def.base = 0.0;
    def.attractor = centre;
    def.attractors = 2;
    def.tolerance = 1e-10;
    def.fixed = (const int[]){0, 2, 6};
    def.fixed_joints = 3;
    for (int i = 0; i < s.n; i++)
        s.x[i] = s.structure->start[i] + (i % 3 == 2 ? 0.004 : 0.0);
    morph_settle_report r;
    morph_settle *t;
    assert_int_equal(morph_settle_create(s.structure, NULL, &def, &t), MORPH_OK);
    assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
    print_message("adjoint: %s, %s, %d contacts, %d steps, %d saddles\n",
                  r.converged ? "converged" : "not converged", r.stable ? "stable" : "not stable", r.contacts,
                  r.steps, r.saddles);
    assert_true(r.converged && r.stable && r.contacts > 2);
    double at[2][3], strength[2];
    double *slope = malloc(s.bytes), *rest = malloc(s.bytes);
    assert_true(slope && rest);
    memcpy(rest, s.x, s.bytes);
    probe(&s, slope);
    assert_int_equal(morph_settle_adjoint(t, slope, at, strength), MORPH_OK);
    double most = 0.0, worst = 0.0;
    for (int m = 0; m < 2; m++)
        for (int k = 0; k < 4; k++) {
            morph_attractor moved[2] = {centre[0], centre[1]};
            double *p = k < 3 ? &moved[m].at[k] : &moved[m].strength;
            const double keep = *p, h = k < 3 ? 1e-5 : 1e-5 * keep;
            *p = keep + h;
            const double up = settled(&s, t, rest, moved);
            *p = keep - h;
            const double down = settled(&s, t, rest, moved);
            /* Strengths in hundredths of a N m2, so that they count like metres. */
            const double unit = k < 3 ? 1.0 : 0.01, by = k < 3 ? at[m][k] : strength[m];
            const double error = fabs((up - down) / (2.0 * h) - by) * unit;
            print_message("  centre %d, %d: %.6g, differences %.6g\n", m, k, by, (up - down) / (2.0 * h));
            worst = fmax(worst, error);
            most = fmax(most, fabs(by) * unit);
        }
    print_message("adjoint: largest %.3g, error %.1e\n", most, worst);
    /* Rests to 1e-9 of the load over differences of 1e-5. */
    assert_true(worst < 1e-3 * most);
    free(slope);
    free(rest);
    morph_settle_destroy(t);
    scene_free(&s);
}

static void repeats(void **state) {
    (void)state;
    const morph_structure_def sd = scene_structure(4, 20.0);
    scene s;
    scene_make(&s, &sd, true);
    morph_settle_def def = morph_settle_defaults();
    def.friction = 0.4;
    def.base = 0.0;
    double *first = malloc(s.bytes);
    assert_non_null(first);
    morph_settle *t = scene_settle(&s, &def), *u = scene_settle(&s, &def);
    morph_settle_report r;
    assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
    memcpy(first, s.x, s.bytes);
    for (int k = 0; k < 2; k++) {
        memcpy(s.x, s.start, s.bytes);
        assert_int_equal(morph_settle_run(k ? u : t, s.x, false, NULL, &r), MORPH_OK);
        assert_memory_equal(first, s.x, s.bytes);
        assert_int_equal(r.analyses, 1);
    }
    /* Warm from its own end there is nothing left to do. */
    assert_int_equal(morph_settle_run(t, s.x, true, NULL, &r), MORPH_OK);
    assert_true(r.converged && r.stable && r.iterations < 10);
    free(first);
    morph_settle_destroy(t);
    morph_settle_destroy(u);
    scene_free(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(beside_the_dynamics), cmocka_unit_test(adjoint),
                                       cmocka_unit_test(repeats)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
