/* The goal's rows: derivatives against central differences, values against the definitions, what is planted
 * wrong is seen; and the choice of rows for a round. */
#include "planner/block_goal.h"
#include "planner/refine_goal.h"
#include "tests/support/shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/planted_sign.h" /* asserts */

enum { NX = 4, NY = 3, ROOM = 4000 };

typedef struct fixture {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf;
    morph_cavity *cavity;
    morph_world world;
    int n;
    double *x; /* scaled, with room for slacks */
} fixture;

static unsigned long long random_state;

static double uniform(void) {
    random_state = random_state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

/* A bent, shaken sheet at `height` spacings over the base, beside and above the box; slacks anywhere. */
static void shake(fixture *f, unsigned long long seed, double amount, double height) {
    random_state = seed;
    for (int i = 0; i < f->n; i++)
        f->x[i] = f->structure->start[i] / f->structure->spacing + amount * (uniform() - 0.5) +
                  (i % 3 == 2 ? height : 0.0);
    for (int i = f->n; i < ROOM; i++)
        f->x[i] = 0.1 * uniform();
}

static int setup(void **state) {
    fixture *f = calloc(1, sizeof *f);
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = NX;
    def.nodes[1] = NY;
    morph_mesh mesh = {0};
    if (!f || morph_structure_create(&def, &f->structure) != MORPH_OK ||
        !test_box(&mesh, 0.13, 0.11, 0.09, 0.045))
        return -1;
    const double lo[3] = {-0.3, -0.3, -0.05}, hi[3] = {0.3, 0.3, 0.3};
    f->n = 3 * f->structure->joints;
    f->x = calloc(ROOM, sizeof(double));
    const bool ok = f->x && morph_distance_create(&mesh, true, &f->exact) == MORPH_OK &&
                    morph_sdf_create(f->exact, lo, hi, 0.1 / 8.0, NULL, &f->sdf) == MORPH_OK &&
                    morph_cavity_create(f->structure, f->exact, 0.0, &f->cavity) == MORPH_OK;
    f->world = (morph_world){f->structure, f->exact, f->sdf, f->cavity, 0.0, 0.0};
    morph_mesh_free(&mesh);
    *state = f;
    return ok ? 0 : -1;
}

static int teardown(void **state) {
    fixture *f = *state;
    morph_cavity_destroy(f->cavity);
    morph_sdf_destroy(f->sdf);
    morph_distance_destroy(f->exact);
    morph_structure_destroy(f->structure);
    free(f->x);
    free(f);
    return 0;
}

static morph_derivative_check compare(const fixture *f, const morph_block *block) {
    morph_derivative_check check;
    assert_int_equal(morph_check_derivatives(block, 1, f->x, block->unknowns, 1e-5, 1e-6, &check), MORPH_OK);
    return check;
}

static const morph_goal all = {{0.01, 0.02, 0.8}};

/* Above the box, beside it near the crease of box and base, and with skin in contact where the positive part
 * bends. */
static void derivatives(void **state) {
    fixture *f = *state;
    const double height[3] = {1.0, 0.5, 0.05};
    for (unsigned seed = 0; seed < 3; seed++) {
        morph_aim *aim;
        morph_block block[MORPH_AIM_BLOCKS];
        int slacks;
        shake(f, seed + 1, 0.4, height[seed]);
        assert_int_equal(morph_aim_create(&f->world, &all, &aim), MORPH_OK);
        assert_int_equal(morph_aim_rows(aim, f->x, 0.5, 1.0, block, &slacks), MORPH_OK);
        assert_true(aim->rows.mean && aim->rows.samples > 3 && aim->rows.points > 3);
        assert_int_equal(slacks, 2 + aim->rows.points);
        assert_int_equal(block[0].rows, 1 + aim->rows.samples + aim->rows.points);
        aim->rows.gap.gauss_newton = false;
        for (int b = 0; b < MORPH_AIM_BLOCKS; b++) {
            const morph_derivative_check c = compare(f, &block[b]);
            if (!c.passed) fail_msg("seed %u: %s", seed, c.message);
            assert_true(planted_signs_seen(&block[b], f->x, block[b].unknowns) > 0);
        }
        morph_aim_destroy(aim);
    }
}

static morph_status (*right_walk)(void *, const double *, const double *, morph_sink *);

/* Weights turned round: every second derivative has the wrong sign. */
static morph_status wrong_second(void *data, const double *x, const double *weight, morph_sink *sink) {
    double turned[ROOM];
    const int rows = morph_goal_rows_count(data);
    for (int r = 0; r < rows; r++)
        turned[r] = -weight[r];
    return right_walk(data, x, turned, sink);
}

/* The slack of the first row a second time: the sum has the wrong size. */
static morph_status wrong_slack(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_goal_rows *d = data;
    const morph_status status = right_walk(data, x, weight, sink);
    if (morph_sink_wants_jacobian(sink))
        morph_sink_jacobian(sink, 0, 3 * d->gap.cavity->structure->joints, 2.0);
    return status;
}

static void planted_signs_are_seen(void **state) {
    fixture *f = *state;
    morph_aim *aim;
    morph_block block[MORPH_AIM_BLOCKS];
    int slacks;
    shake(f, 7, 0.4, 0.6);
    assert_int_equal(morph_aim_create(&f->world, &all, &aim), MORPH_OK);
    assert_int_equal(morph_aim_rows(aim, f->x, 0.5, 1.0, block, &slacks), MORPH_OK);
    right_walk = block[0].walk;
    block[0].walk = wrong_second;
    assert_false(compare(f, &block[0]).passed);
    block[0].walk = wrong_slack;
    assert_false(compare(f, &block[0]).passed);
    /* Gauss-Newton leaves second derivatives out: seen where all are asked for. */
    block[0].walk = right_walk;
    aim->rows.gap.gauss_newton = true;
    assert_false(compare(f, &block[0]).passed);
    morph_aim_destroy(aim);
}

/* At the pose where it was measured the first row is the exact mean gap, the largest of the samples' the
 * exact largest gap, and a point's the square of its distance. */
static void rows_are_the_measures(void **state) {
    fixture *f = *state;
    const double a = f->structure->spacing, r = f->structure->def.radius / a;
    morph_aim *aim;
    morph_block block[MORPH_AIM_BLOCKS];
    int slacks;
    double value[ROOM], metres[200];
    assert_true(f->n <= 200);
    for (unsigned seed = 0; seed < 3; seed++) {
        shake(f, seed + 11, 0.5, 0.3 + 0.3 * seed);
        assert_int_equal(morph_aim_create(&f->world, &all, &aim), MORPH_OK);
        assert_int_equal(morph_aim_rows(aim, f->x, 0.5, 1.0, block, &slacks), MORPH_OK);
        /* The start holds every row, by slacks that are not negative. */
        assert_int_equal(block[0].value(block[0].data, f->x, value), MORPH_OK);
        for (int k = 0; k < block[0].rows; k++)
            assert_true(value[k] <= block[0].upper[k] && block[0].lower[k] == -INFINITY);
        for (int k = 0; k < slacks; k++)
            assert_true(f->x[f->n + k] > 0.0);
        memset(&f->x[f->n], 0, (size_t)slacks * sizeof(double));
        assert_int_equal(block[0].value(block[0].data, f->x, value), MORPH_OK);
        morph_measure m;
        for (int i = 0; i < f->n; i++)
            metres[i] = a * f->x[i];
        assert_int_equal(morph_cavity_measure(f->cavity, metres, &m), MORPH_OK);
        assert_true(fabs(value[0] - m.gap_mean / a) < 1e-12);
        double most = -INFINITY;
        for (int k = 0; k < aim->rows.samples; k++)
            most = fmax(most, value[1 + k]);
        assert_true(fabs(most - m.gap_max / a) < 1e-12);
        for (int k = 0; k < aim->rows.points; k++) {
            const double d = aim->distance[aim->point[k]] / a, at = r + aim->rows.limit[MORPH_GOAL_COVERAGE];
            assert_true(fabs(value[1 + aim->rows.samples + k] - d * d / (2.0 * at)) < 1e-12);
        }
        morph_aim_destroy(aim);
    }
}

/* Coverage takes the nearest points and no more area than asked for; what is not asked for has no row. */
static void choice_of_points(void **state) {
    fixture *f = *state;
    morph_block block[MORPH_AIM_BLOCKS];
    int slacks;
    shake(f, 3, 0.3, 2.0); /* far above: no point is covered */
    double before = 0.0;
    for (int k = 1; k <= 4; k++) {
        const morph_goal goal = {{0.0, 0.0, 0.25 * k}};
        morph_aim *aim;
        assert_int_equal(morph_aim_create(&f->world, &goal, &aim), MORPH_OK);
        assert_int_equal(morph_aim_rows(aim, f->x, 0.3, 1.0, block, &slacks), MORPH_OK);
        assert_true(!aim->rows.mean && aim->rows.samples == 0 && slacks == aim->rows.points);
        assert_int_equal(aim->rows.points, (int)ceil(0.25 * k * f->cavity->exposed - 1e-9));
        double furthest = 0.0, nearest_left = INFINITY;
        bool *taken = calloc((size_t)f->cavity->exposed, sizeof *taken);
        assert_non_null(taken);
        for (int p = 0; p < aim->rows.points; p++) {
            taken[aim->point[p]] = true;
            furthest = fmax(furthest, aim->distance[aim->point[p]]);
        }
        for (int y = 0; y < f->cavity->exposed; y++)
            if (!taken[y]) nearest_left = fmin(nearest_left, aim->distance[y]);
        assert_true(furthest <= nearest_left && furthest >= before);
        before = furthest;
        free(taken);
        morph_aim_destroy(aim);
    }
}

static void misses(void **state) {
    (void)state;
    const morph_goal none = {{0.0, 0.0, 0.0}};
    const double value[MORPH_GOAL_KINDS] = {0.012, 0.02, 0.75};
    assert_false(morph_goal_any(&none));
    assert_true(morph_goal_miss(&none, value, 0.1) == 0.0);
    /* 0.002 m are 0.02 spacings; the largest gap is just met; a twentieth of coverage is missed. */
    assert_true(fabs(morph_goal_miss(&all, value, 0.1) - 0.07) < 1e-12);
    const double met[MORPH_GOAL_KINDS] = {0.01 * (1.0 + 1e-10), 0.02, 0.8 * (1.0 - 1e-10)};
    assert_true(morph_goal_miss(&all, met, 0.1) == 0.0);
    const double barely[MORPH_GOAL_KINDS] = {0.01 * (1.0 + 1e-8), 0.02, 0.8};
    assert_true(morph_goal_miss(&all, barely, 0.1) > 0.0);
    assert_string_equal(morph_goal_name(MORPH_GOAL_COVERAGE), "coverage");
    assert_string_equal(morph_goal_unit(MORPH_GOAL_MAX_GAP), "m");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(derivatives, setup, teardown),
        cmocka_unit_test_setup_teardown(planted_signs_are_seen, setup, teardown),
        cmocka_unit_test_setup_teardown(rows_are_the_measures, setup, teardown),
        cmocka_unit_test_setup_teardown(choice_of_points, setup, teardown),
        cmocka_unit_test(misses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
