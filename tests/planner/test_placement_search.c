/* The search for centres: the adjoint's gradient against differences of whole shapes at rest, and proposals.
 */
#include "planner/guide.h"
#include "planner/placement_search.h"
#include "planner/stiffness.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 2 };

/* Laid over a sphere once: where a blanket rests under one centre, and under two. */
static struct {
    morph_scene *scene;
    morph_workspace w;
    morph_attractor centre[MOST]; /* metres, newtons */
    double *x[MOST];              /* scaled */
} laid;

static int lay(void **state) {
    (void)state;
    if (morph_scene_read(MORPH_SOURCE_DIR "/examples/suite/sphere.yaml", NULL, NULL, NULL, &laid.scene))
        return -1;
    laid.scene->structure.nodes[0] = 5;
    laid.scene->structure.nodes[1] = 4;
    laid.scene->motion.time = 4.0;
    if (morph_workspace_create(laid.scene, NULL, &laid.w) != MORPH_OK) return -1;
    const size_t n = 3 * (size_t)laid.w.structure->joints;
    const double a = laid.w.structure->spacing,
                 unit = laid.scene->structure.mass * laid.scene->motion.gravity * a * a;
    laid.centre[0] = (morph_attractor){{0.01, -0.02, -0.02}, 5.0 * unit};
    laid.centre[1] = (morph_attractor){{0.15, 0.1, 0.0}, 2.0 * unit};
    for (int k = 0; k < MOST; k++) {
        morph_trajectory t;
        laid.x[k] = calloc(n, sizeof(double));
        if (!laid.x[k] || morph_guided_run(&laid.w, laid.scene, NULL, laid.centre, k + 1, NULL, &t, NULL))
            return -1;
        for (size_t i = 0; i < n; i++)
            laid.x[k][i] = t.x[(size_t)(t.frames - 1) * n + i] / a;
        morph_trajectory_free(&t);
    }
    return 0;
}

static int clear_away(void **state) {
    (void)state;
    morph_workspace_free(&laid.w);
    morph_scene_destroy(laid.scene);
    for (int k = 0; k < MOST; k++)
        free(laid.x[k]);
    return 0;
}

/* A balance in which it rests there. */
typedef struct fixture {
    morph_placement_options options;
    morph_balance *balance;
    morph_rest rest;
    double p[4 * MOST]; /* its centres */
    int centres;
} fixture;

static int setup_with(void **state, int centres) {
    fixture *f = calloc(1, sizeof *f);
    *state = f;
    const morph_balance_load load = {laid.scene->motion.gravity, 0.0};
    if (!f || morph_balance_create(&laid.w.world, &load, centres, &f->balance) != MORPH_OK) return -1;
    f->options = morph_placement_defaults();
    f->balance->hold = f->options.hold;
    f->centres = centres;
    morph_attractor scaled[MOST];
    for (int m = 0; m < centres; m++) {
        scaled[m] = morph_balance_scaled(f->balance, &laid.centre[m]);
        memcpy(&f->p[4 * m], scaled[m].at, sizeof scaled[m].at);
        f->p[4 * m + 3] = scaled[m].strength;
    }
    return morph_rest_adopt(f->balance, scaled, f->options.epsilon, laid.x[centres - 1], NULL, &f->rest) ==
                   MORPH_OK
               ? 0
               : -1;
}

static int setup_one(void **state) {
    return setup_with(state, 1);
}

static int setup_two(void **state) {
    return setup_with(state, 2);
}

static int teardown(void **state) {
    fixture *f = *state;
    morph_rest_free(&f->rest);
    morph_balance_destroy(f->balance);
    free(f);
    return 0;
}

/* Central differences of complete rests against a gradient: the largest error relative to its largest entry.
 * Step 1e-5: the rests are exact to 1e-9. No limit may enter. */
static double worst_error(fixture *f, morph_rest_cavity *c, const double *p, const double *gradient) {
    double worst = 0.0, largest = 0.0;
    const int limits = f->balance->limits.count;
    for (int i = 0; i < 4 * f->centres; i++) {
        double at[4 * MOST], value[2];
        for (int side = 0; side < 2; side++) {
            memcpy(at, p, sizeof at);
            at[i] += side ? 1e-5 : -1e-5;
            assert_int_equal(morph_rest_cavity_value(c, at, &value[side], NULL), MORPH_OK);
        }
        worst = fmax(worst, fabs((value[1] - value[0]) / 2e-5 - gradient[i]));
        largest = fmax(largest, fabs(gradient[i]));
    }
    assert_int_equal(f->balance->limits.count, limits);
    assert_true(largest > 1e-3);
    return worst / largest;
}

static void gradient_is_the_adjoints(void **state) {
    fixture *f = *state;
    morph_rest_cavity *c;
    assert_int_equal(morph_rest_cavity_create(&laid.w, f->balance, &f->options, &f->rest, NULL, 0.0, &c),
                     MORPH_OK);
    for (int point = 0; point < 3; point++) {
        double p[4 * MOST], gradient[4 * MOST], value;
        for (int i = 0; i < 4 * f->centres; i++)
            p[i] = f->p[i] + 0.07 * point * (i % 3 - 1.2);
        assert_int_equal(morph_rest_cavity_value(c, p, &value, gradient), MORPH_OK);
        const double error = worst_error(f, c, p, gradient);
        if (error > 1e-5) print_error("point %d: %.2e\n", point, error);
        assert_true(error <= 1e-5);
        /* Each entry with its sign turned is caught, unless it is next to nothing. */
        for (int i = 0; i < 4 * f->centres; i++) {
            double wrong[4 * MOST];
            memcpy(wrong, gradient, sizeof wrong);
            wrong[i] = -wrong[i];
            if (fabs(gradient[i]) > 1e-3) assert_true(worst_error(f, c, p, wrong) > 1e-4);
        }
    }
    assert_true(morph_rest_cavity_adjoint_residual(c) > 0.0);
    assert_true(morph_rest_cavity_adjoint_residual(c) <= 1e-10);
    assert_int_equal(morph_rest_cavity_effort(c).failures, 0);
    morph_rest_cavity_destroy(c);
}

/* The springs that hold the sheet halved where only the stiffness sees it: with their anchor at the shape
 * itself they have no force. */
static void wrong_stiffness_is_caught(void **state) {
    fixture *f = *state;
    morph_balance *b = f->balance;
    morph_rest_cavity *c;
    double gradient[4 * MOST], wrong[4 * MOST], value;
    assert_int_equal(morph_rest_cavity_create(&laid.w, b, &f->options, &f->rest, NULL, 0.0, &c), MORPH_OK);
    const double *x = morph_rest_cavity_best(c)->z, hold = b->hold;
    for (int i = 0; i < b->coordinates; i++) {
        b->force[i] -= hold * (x[i] - b->anchor[i]);
        b->anchor[i] = x[i];
    }
    assert_int_equal(morph_rest_cavity_value(c, f->p, &value, gradient), MORPH_OK);
    const int steps = morph_rest_cavity_effort(c).steps;
    b->hold = 0.5 * hold;
    assert_int_equal(morph_rest_cavity_value(c, f->p, &value, wrong), MORPH_OK);
    b->hold = hold;
    assert_int_equal(morph_rest_cavity_effort(c).steps, steps); /* the shape did not see it */
    assert_true(worst_error(f, c, f->p, gradient) <= 1e-5);
    assert_true(worst_error(f, c, f->p, wrong) > 1e-3);
    morph_rest_cavity_destroy(c);
}

/* How the shape answers a load, equalities given another value as well, against two rests. */
static void solve_leaves_nothing(void **state) {
    fixture *f = *state;
    morph_balance *b = f->balance;
    morph_stiffness *k;
    bool definite;
    const size_t rows = (size_t)b->rows, equal = (size_t)b->equalities;
    double *right = calloc(rows, sizeof *right), *aim = calloc(equal, sizeof *aim),
           *u = calloc(rows, sizeof *u), *sigma = calloc(equal, sizeof *sigma), residual = 1.0;
    b->hold = 100.0;
    assert_int_equal(morph_stiffness_create(b, f->rest.z, &k, &definite), MORPH_OK);
    assert_true(definite);
    for (size_t i = 0; i < rows; i++)
        right[i] = sin((double)i);
    for (size_t e = 0; e < equal; e++)
        aim[e] = cos((double)e);
    assert_int_equal(morph_stiffness_solve(k, right, aim, u, sigma, &residual), MORPH_OK);
    assert_true(residual <= 1e-10);
    for (size_t e = 0; e < equal; e++) { /* A u = g by the posts' own ends */
        const int *j = b->equality[e].joint;
        double moved = 0.0;
        for (int i = 0; i < 3; i++) {
            const int p = b->row[3 * j[0] + i], q = b->row[3 * j[1] + i];
            const double d = f->rest.z[3 * j[1] + i] - f->rest.z[3 * j[0] + i];
            moved += 2.0 * d * ((q >= 0 ? u[q] : 0.0) - (p >= 0 ? u[p] : 0.0));
        }
        if (b->equality[e].kind == MORPH_ELEMENT_DISTANCE) assert_true(fabs(moved - aim[e]) < 1e-8);
    }
    morph_stiffness_destroy(k);
    free(right);
    free(aim);
    free(u);
    free(sigma);
}

static void proposals_are_in_balance(void **state) {
    fixture *f = *state;
    const morph_proposal by[2] = {morph_propose_free, morph_propose_gradient};
    morph_limits limits = {0};
    double reached[2];
    assert_int_equal(morph_limits_copy(&limits, &f->balance->limits), MORPH_OK);
    for (int k = 0; k < 2; k++) {
        double *z;
        morph_nlp_result r;
        morph_balance_report report;
        assert_int_equal(morph_limits_copy(&f->balance->limits, &limits), MORPH_OK);
        assert_int_equal(by[k](&laid.w, f->balance, &f->options, 0.2, 0.0, &f->rest, &z, &r), MORPH_OK);
        assert_true(r.evaluations > 3 && r.evaluations <= f->options.evaluations);
        if (k == 1) assert_int_equal(r.outcome, MORPH_OPTIMAL);
        reached[k] = r.objective;
        assert_int_equal(morph_balance_examine(f->balance, z, &report), MORPH_OK);
        assert_true(report.residual <= 1e-8 && report.equality <= 1e-8 && report.stable);
        assert_true(report.complementarity <= 1.001e-3 && report.penetration <= 0.0);
        double moved = 0.0;
        for (int m = 0; m < f->centres; m++) {
            for (int i = 0; i < 3; i++) {
                const double by_centre = z[morph_balance_centre(f->balance) + 3 * m + i] - f->p[4 * m + i];
                moved = fmax(moved, fabs(by_centre));
            }
            const double s = z[morph_balance_strength(f->balance) + m];
            assert_true(s >= 0.5 * f->p[4 * m + 3] - 1e-12 && s <= 2.0 * f->p[4 * m + 3] + 1.0 + 1e-12);
        }
        assert_true(moved > 1e-3 && moved <= 0.4 + 1e-12);
        free(z);
        morph_nlp_result_free(&r);
    }
    /* In 60 evaluations a simplex of nine corners comes as near as that. */
    assert_true(fabs(reached[0] - reached[1]) <= 0.01 * reached[1]);
    morph_limits_free(&limits);
}

static int stop_now(void *user) {
    int *calls = user;
    return ++*calls > 4;
}

static void stop_is_heard(void **state) {
    fixture *f = *state;
    int calls = 0;
    double *z;
    morph_nlp_result r;
    const morph_control control = {.stop = stop_now, .user = &calls};
    f->options.control = &control;
    assert_int_equal(morph_propose_gradient(&laid.w, f->balance, &f->options, 0.2, 0.0, &f->rest, &z, &r),
                     MORPH_ERR_STOPPED);
    assert_null(z);
}

/* A shape that is no minimum with weak springs: these are stiffened. */
static void weak_shapes_are_held(void **state) {
    fixture *f = *state;
    morph_rest_cavity *c;
    f->balance->energy[0].stiffness = -30.0; /* alone this would buckle */
    f->balance->hold = 0.5;
    const morph_status status =
        morph_rest_cavity_create(&laid.w, f->balance, &f->options, &f->rest, NULL, 0.0, &c);
    assert_true(f->balance->hold > 10.0);
    assert_true(status == MORPH_OK ? c != NULL : c == NULL && status == MORPH_ERR_BACKEND);
    morph_rest_cavity_destroy(c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(gradient_is_the_adjoints, setup_one, teardown),
        cmocka_unit_test_setup_teardown(gradient_is_the_adjoints, setup_two, teardown),
        cmocka_unit_test_setup_teardown(wrong_stiffness_is_caught, setup_one, teardown),
        cmocka_unit_test_setup_teardown(solve_leaves_nothing, setup_one, teardown),
        cmocka_unit_test_setup_teardown(proposals_are_in_balance, setup_two, teardown),
        cmocka_unit_test_setup_teardown(stop_is_heard, setup_one, teardown),
        cmocka_unit_test_setup_teardown(weak_shapes_are_held, setup_one, teardown),
    };
    return cmocka_run_group_tests(tests, lay, clear_away);
}
