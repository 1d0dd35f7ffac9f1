/* The rows of balance against central differences: every element kind, random poses and such that stand at
 * contacts and limits; a planted wrong sign is caught. */
#include "planner/balance.h"
#include "tests/support/shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/planted_sign.h" /* asserts */

enum { NX = 4, NY = 3, CENTRES = 2 };

typedef struct fixture {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf;
    morph_world world;
    morph_balance *balance;
    double *z, *lower, *upper;
} fixture;

static unsigned long long random_state = 1;

static double uniform(void) {
    random_state = random_state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

/* A bent, shaken sheet over a box, with limits near and far; all unknowns of order 1. */
static void shake(fixture *f, double amount, const morph_nearness *near) {
    const morph_structure *s = f->structure;
    morph_balance *b = f->balance;
    for (int j = 0; j < s->joints; j++)
        for (int k = 0; k < 3; k++)
            f->z[3 * j + k] =
                s->start[3 * j + k] / s->spacing + amount * (uniform() - 0.5) + (k == 2 ? 1.0 : 0.0);
    assert_int_equal(morph_balance_limits(b, f->z, near), MORPH_OK);
    assert_true(morph_balance_unknowns(b) <= 4000);
    for (int i = b->coordinates; i < morph_balance_unknowns(b); i++)
        f->z[i] = 0.2 + uniform();
    for (int m = 0; m < 3 * CENTRES; m++)
        f->z[morph_balance_centre(b) + m] -= 0.8;
}

static int setup(void **state) {
    fixture *f = calloc(1, sizeof *f);
    morph_structure_def def = morph_structure_defaults(0.1);
    const int held[1][2] = {{0, 0}};
    def.nodes[0] = NX;
    def.nodes[1] = NY;
    def.stiffness = 20.0;
    def.square = 0.005;
    def.angle_stiffness = 0.01;
    def.angle_soft = 0.3;
    def.joints = MORPH_JOINTS_UNIVERSAL;
    def.fixed = MORPH_FIXED_LIST;
    def.fixed_nodes = 1;
    def.fixed_node = held;
    morph_mesh mesh = {0};
    if (!f || morph_structure_create(&def, &f->structure) != MORPH_OK ||
        !test_box(&mesh, 0.13, 0.11, 0.09, 0.045))
        return -1;
    const double lo[3] = {-0.3, -0.3, -0.05}, hi[3] = {0.3, 0.3, 0.3};
    const morph_balance_load load = {9.81, 0.0};
    bool ok = morph_distance_create(&mesh, true, &f->exact) == MORPH_OK &&
              morph_sdf_create(f->exact, lo, hi, 0.1 / 8.0, NULL, &f->sdf) == MORPH_OK;
    f->world = (morph_world){f->structure, f->exact, f->sdf, NULL, 0.0, 0.0};
    ok = ok && morph_balance_create(&f->world, &load, CENTRES, &f->balance) == MORPH_OK;
    f->balance->epsilon = 0.01;
    f->balance->hold = 0.3;
    f->balance->force[4] = 0.7;
    f->z = calloc(4000, sizeof(double));
    f->lower = calloc(4000, sizeof(double));
    f->upper = calloc(4000, sizeof(double));
    morph_mesh_free(&mesh);
    *state = f;
    return ok && f->z && f->lower && f->upper ? 0 : -1;
}

static int teardown(void **state) {
    fixture *f = *state;
    morph_balance_destroy(f->balance);
    morph_sdf_destroy(f->sdf);
    morph_distance_destroy(f->exact);
    morph_structure_destroy(f->structure);
    free(f->z);
    free(f->lower);
    free(f->upper);
    free(f);
    return 0;
}

/* Step 1e-5: truncation is about its square, rounding 1e-16 over it. */
static morph_derivative_check check(const fixture *f, const morph_block *block) {
    morph_derivative_check c;
    assert_int_equal(morph_check_derivatives(block, 1, f->z, block->unknowns, 1e-5, 1e-6, &c), MORPH_OK);
    return c;
}

static void expect_right(const fixture *f, const morph_block *block) {
    const morph_derivative_check c = check(f, block);
    if (!c.passed) print_error("%s\n", c.message);
    assert_true(c.passed);
    assert_true(planted_signs_seen(block, f->z, block->unknowns) > 0);
}

/* Everything but contact: exact to the Hessian of the Lagrangian. */
static void without_contact(void **state) {
    fixture *f = *state;
    const morph_nearness near = {0.2, 0.4, -1e9, 0.0};
    for (int pose = 0; pose < 3; pose++) {
        shake(f, 0.5, &near);
        assert_true(f->balance->limits.count > 20);
        const morph_block balance = morph_block_balance(f->balance, f->lower, f->upper);
        const morph_block complementarity = morph_block_complementarity(f->balance, f->lower, f->upper);
        const morph_block equalities = morph_block_equalities(f->balance, f->lower, f->upper);
        const morph_block limits = morph_block_limits(f->balance, f->lower, f->upper);
        morph_attractor centre[CENTRES] = {{{0.1, 0.2, 0.3}, 1.5}, {{-1.0, 0.0, 0.5}, 0.7}};
        morph_rest_energy e = {f->balance, centre};
        const morph_block energy = morph_block_rest_energy(&e);
        expect_right(f, &balance);
        expect_right(f, &complementarity);
        expect_right(f, &equalities);
        expect_right(f, &limits);
        expect_right(f, &energy);
    }
}

/* With contacts first derivatives are exact; so are second ones of the rows that hold no contact force. */
static void at_contacts(void **state) {
    fixture *f = *state;
    const morph_nearness near = {0.1, 0.2, 0.4, 0.0};
    for (int pose = 0; pose < 3; pose++) {
        shake(f, 0.3, &near);
        int contacts = 0;
        for (int q = 0; q < f->balance->limits.count; q++)
            contacts += f->balance->limits.element[q].kind == MORPH_ELEMENT_CONTACT;
        assert_true(contacts > 5);
        const morph_block balance = morph_block_balance(f->balance, f->lower, f->upper);
        const morph_block complementarity = morph_block_complementarity(f->balance, f->lower, f->upper);
        const morph_block limits = morph_block_limits(f->balance, f->lower, f->upper);
        const morph_derivative_check c = check(f, &balance);
        if (c.worst_jacobian > 1e-6) print_error("%s\n", c.message);
        assert_true(c.worst_jacobian <= 1e-6);
        expect_right(f, &complementarity);
        expect_right(f, &limits);
    }
}

/* One-sided angle springs, and each kind alone, as energies with a force of their own. */
static void every_kind(void **state) {
    fixture *f = *state;
    const morph_nearness near = {-1e9, -1e9, -1e9, 0.0};
    const morph_element kinds[] = {
        {.kind = MORPH_ELEMENT_SPRING, .joint = {0, 5}, .stiffness = 2.0, .rest = 0.7},
        {.kind = MORPH_ELEMENT_SLACK, .joint = {1, 2, 1, 5}, .stiffness = 1.5, .lower = 2.5, .upper = 3.0},
        {.kind = MORPH_ELEMENT_SLACK, .joint = {1, 2, 1, 5}, .stiffness = 1.5, .lower = 0.1, .upper = 0.2},
        {.kind = MORPH_ELEMENT_SQUARE, .joint = {3, 2, 3, 7}, .stiffness = 1.5},
        {.kind = MORPH_ELEMENT_COSINE, .joint = {4, 8, 9, 8}},
        {.kind = MORPH_ELEMENT_PANEL, .joint = {0, 12, 1, 13}}};
    const int energies = f->balance->energies;
    morph_element *energy = f->balance->energy, one;
    f->balance->energy = &one;
    f->balance->energies = 1;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        one = kinds[k];
        shake(f, 0.5, &near);
        const morph_block balance = morph_block_balance(f->balance, f->lower, f->upper);
        expect_right(f, &balance);
    }
    f->balance->energy = energy;
    f->balance->energies = energies;
}

static morph_status (*right_walk)(void *, const double *, const double *, morph_sink *);

/* The same walk with one limit's side turned. */
static morph_status wrong_walk(void *data, const double *z, const double *weight, morph_sink *sink) {
    morph_balance *b = data;
    b->limits.sign[0] = -b->limits.sign[0];
    const morph_status status = right_walk(data, z, weight, sink);
    b->limits.sign[0] = -b->limits.sign[0];
    return status;
}

static void planted_sign_is_caught(void **state) {
    fixture *f = *state;
    const morph_nearness near = {0.2, 0.4, -1e9, 0.0};
    shake(f, 0.5, &near);
    morph_block blocks[2] = {morph_block_balance(f->balance, f->lower, f->upper),
                             morph_block_complementarity(f->balance, f->lower, f->upper)};
    for (int k = 0; k < 2; k++) {
        right_walk = blocks[k].walk;
        blocks[k].walk = wrong_walk;
        assert_false(check(f, &blocks[k]).passed);
    }
}

static int limits_of_pair(const morph_balance *b, const int joint[4]) {
    int count = 0;
    for (int q = 0; q < b->limits.count; q++)
        count += memcmp(b->limits.element[q].joint, joint, 4 * sizeof *joint) == 0;
    return count;
}

/* The closest points of two axes slide where one is turned: the pair is known, unless the axes have come
 * deeper into one another than what sliding may hide. */
static void slid_pairs(void **state) {
    fixture *f = *state;
    const morph_structure *s = f->structure;
    const morph_nearness self = {-1e9, -1e9, -1e9, 0.05};
    const double apart = 2.0 * s->def.radius / s->spacing;
    const int *p = s->link[0];
    int other = 1;
    while (s->link[other][0] == p[0] || s->link[other][0] == p[1] || s->link[other][1] == p[0] ||
           s->link[other][1] == p[1])
        other++;
    const int *q = s->link[other];
    for (int j = 0; j < s->joints; j++)
        for (int k = 0; k < 3; k++)
            f->z[3 * j + k] = 10.0 * pow(j + 1.0, k + 1.0);
    const double near = apart - 1e-3, deep = apart - 0.03;
    const double first[4][3] = {{-1, 0, 0}, {1, 0, 0}, {0.2, -1, near}, {0.2, 1, near}};
    const double turned[4][3] = {{-1, 0, 0}, {1, 0, 0}, {0.3, -1, near}, {0.5, 1, near}};
    const double deeper[4][3] = {{-1, 0, 0}, {1, 0, 0}, {0.3, -1, deep}, {0.5, 1, deep}};
    const double(*const pose[3])[3] = {first, turned, deeper};
    const int joint[4] = {p[0], p[1], q[0], q[1]}, wanted[3][2] = {{0, 0}, {1, 0}, {1, 1}};
    for (int m = 0; m < 3; m++)
        for (int hides = 0; hides < 2; hides++) {
            for (int i = 0; i < 4; i++)
                memcpy(&f->z[3 * joint[i]], first[i], sizeof first[i]);
            assert_int_equal(morph_balance_limits(f->balance, f->z, &self), MORPH_OK);
            assert_int_equal(limits_of_pair(f->balance, joint), 1);
            for (int i = 0; i < 4; i++)
                memcpy(&f->z[3 * joint[i]], pose[m][i], sizeof first[i]);
            assert_int_equal(morph_balance_more_limits(f->balance, f->z, &self, hides ? -0.01 : 0.0, NULL),
                             MORPH_OK);
            assert_int_equal(limits_of_pair(f->balance, joint), 1 + wanted[m][hides]);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(slid_pairs, setup, teardown),
        cmocka_unit_test_setup_teardown(without_contact, setup, teardown),
        cmocka_unit_test_setup_teardown(at_contacts, setup, teardown),
        cmocka_unit_test_setup_teardown(every_kind, setup, teardown),
        cmocka_unit_test_setup_teardown(planted_sign_is_caught, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
