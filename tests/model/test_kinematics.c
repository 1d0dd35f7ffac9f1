/* Rank, free motions and redundancy of the member matrix: known structures, and motions that change no
 * length. */
#include "model/kinematics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static morph_structure *grid(int nx, int ny) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = nx;
    def.nodes[1] = ny;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static double noise(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int64_t)(*seed >> 11) / 4503599627370496.0 - 1.0;
}

/* Rank of the member rows by elimination with full pivoting: another way than singular values. */
static int rank_by_elimination(const morph_structure *s, const double *x) {
    const int rows = s->links + s->posts, columns = 3 * s->joints;
    double *m = calloc((size_t)rows * (size_t)columns, sizeof *m);
    assert_non_null(m);
    for (int r = 0; r < rows; r++) {
        const int *pair = r < s->links ? s->link[r] : s->post[r - s->links];
        const double length = morph_dist(&x[3 * pair[0]], &x[3 * pair[1]]);
        for (int k = 0; k < 3; k++) {
            m[r * columns + 3 * pair[1] + k] = (x[3 * pair[1] + k] - x[3 * pair[0] + k]) / length;
            m[r * columns + 3 * pair[0] + k] = -m[r * columns + 3 * pair[1] + k];
        }
    }
    int rank = 0;
    while (rank < rows) {
        int pr = rank, pc = 0;
        for (int r = rank; r < rows; r++)
            for (int c = 0; c < columns; c++)
                if (fabs(m[r * columns + c]) > fabs(m[pr * columns + pc])) pr = r, pc = c;
        if (fabs(m[pr * columns + pc]) < 1e-9) break;
        for (int c = 0; c < columns; c++) {
            const double t = m[pr * columns + c];
            m[pr * columns + c] = m[rank * columns + c];
            m[rank * columns + c] = t;
        }
        for (int r = rank + 1; r < rows; r++) {
            const double f = m[r * columns + pc] / m[rank * columns + pc];
            for (int c = 0; c < columns && f != 0.0; c++)
                m[r * columns + c] -= f * m[rank * columns + c];
        }
        rank++;
    }
    free(m);
    return rank;
}

static void assert_consistent(const morph_structure *s, const double *x) {
    morph_mobility m;
    assert_int_equal(morph_mobility_at(s, x, &m), MORPH_OK);
    assert_int_equal(m.rows, s->links + s->posts);
    assert_int_equal(m.rank, rank_by_elimination(s, x));
    assert_int_equal(m.redundant, m.rows - m.rank);
    assert_int_equal(m.free, 3 * s->joints - 6 - m.rank);
    assert_true(m.free >= 0 && m.redundant >= 0);
    assert_true(m.free > 0 ? m.sigma_min == 0.0 : m.sigma_min > 0.0);
}

/* A cube of 8 joints and 12 members: all independent, 24 - 6 - 12 free motions. */
static void test_cube(void **state) {
    (void)state;
    morph_structure *s = grid(2, 2);
    morph_mobility m;
    assert_int_equal(morph_mobility_at(s, s->start, &m), MORPH_OK);
    assert_int_equal(m.rows, 12);
    assert_int_equal(m.rank, 12);
    assert_int_equal(m.free, 6);
    assert_int_equal(m.redundant, 0);
    assert_true(m.sigma_min == 0.0);
    morph_structure_destroy(s);
}

static void test_flat_and_bent(void **state) {
    (void)state;
    const int sizes[4][2] = {{2, 2}, {3, 3}, {4, 3}, {2, 5}};
    for (int k = 0; k < 4; k++) {
        morph_structure *s = grid(sizes[k][0], sizes[k][1]);
        uint64_t seed = 17;
        assert_consistent(s, s->start);
        for (int i = 0; i < 3 * s->joints; i++)
            s->start[i] += 0.01 * noise(&seed);
        assert_consistent(s, s->start);
        morph_structure_destroy(s);
    }
}

/* The figures belong to the shape: not to its place, turn or size. */
static void test_invariant(void **state) {
    (void)state;
    morph_structure *s = grid(3, 3);
    uint64_t seed = 19;
    double *y = malloc((size_t)(3 * s->joints) * sizeof *y);
    assert_non_null(y);
    for (int i = 0; i < 3 * s->joints; i++)
        s->start[i] += 0.02 * noise(&seed);
    const double c = cos(1.1), d = sin(1.1);
    for (int j = 0; j < s->joints; j++) {
        const double *x = &s->start[3 * j];
        y[3 * j] = 1e3 * (c * x[0] - d * x[2]) + 5.0;
        y[3 * j + 1] = 1e3 * x[1] - 70.0;
        y[3 * j + 2] = 1e3 * (d * x[0] + c * x[2]);
    }
    morph_mobility a, b;
    assert_int_equal(morph_mobility_at(s, s->start, &a), MORPH_OK);
    assert_int_equal(morph_mobility_at(s, y, &b), MORPH_OK);
    assert_int_equal(a.rank, b.rank);
    assert_int_equal(a.free, b.free);
    assert_true(fabs(a.sigma_min - b.sigma_min) < 1e-10);
    free(y);
    morph_structure_destroy(s);
}

/* A structure made rigid by hand: a tetrahedron of six members has no free motion, and the least singular
 * value of its unit rows is that of a matrix worked out: for the regular one the member matrix R R^T has the
 * rows' cosines. */
static void test_rigid(void **state) {
    (void)state;
    int pairs[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    morph_structure s = {.joints = 4, .links = 6, .posts = 0, .link = pairs};
    const double x[12] = {1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1};
    morph_mobility m;
    assert_int_equal(morph_mobility_at(&s, x, &m), MORPH_OK);
    assert_int_equal(m.rank, 6);
    assert_int_equal(m.free, 0);
    assert_int_equal(m.redundant, 0);
    /* Gram matrix of the rows: 1 on the diagonal, 1/4 (cos 60 / 2) for members that meet, 0 for opposite
     * ones: the octahedron graph's eigenvalues 4, 0, -2 give 2, 1, 1/2. */
    assert_true(fabs(m.sigma_min - sqrt(0.5)) < 1e-12);
    /* Flattened: one length is redundant and one motion free. */
    const double flat[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    assert_int_equal(morph_mobility_at(&s, flat, &m), MORPH_OK);
    assert_int_equal(m.rank, 5);
    assert_int_equal(m.free, 1);
    assert_int_equal(m.redundant, 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cube),
        cmocka_unit_test(test_flat_and_bent),
        cmocka_unit_test(test_invariant),
        cmocka_unit_test(test_rigid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
