/* Pairs of the spatial hash against all pairs. */
#include "model/spatial_hash.h"
#include "solids.h"

enum { MOST = 160 };

static int below(const void *a, const void *b) {
    const int *p = a, *q = b;
    return p[0] != q[0] ? (p[0] < q[0] ? -1 : 1) : (p[1] > q[1]) - (p[1] < q[1]);
}

/* The kinds of crowd: equal sizes, sizes over many octaves, clusters, points and slivers, far away, touching
 * on a lattice, all the same, one giant over many. */
static void random_boxes(int kind, int n, morph_box *box) {
    const double shift = kind == 4 ? 1e12 : kind == 8 ? 1e55 : 0.0;
    const double scale = kind == 8 ? 1e54 : kind == 9 ? 1e-200 : 1.0;
    double centre[3];
    for (int i = 0; i < n; i++) {
        double p[3];
        if (i % 20 == 0) random_point(-5.0, 5.0, centre);
        random_point(-2.0, 2.0, p);
        for (int k = 0; k < 3; k++) {
            double size = uniform(0.1, 1.0);
            if (kind == 1) size = exp2(uniform(-20.0, 4.0));
            if (kind == 2) p[k] = centre[k] + uniform(-0.3, 0.3);
            if (kind == 3) size = uniform(0, 1) < 0.5 ? 0.0 : size;
            if (kind == 5) {
                p[k] = floor(p[k] * 2.0);
                size = 1.0;
            }
            if (kind == 6) p[k] = 0.25, size = 0.5;
            if (kind == 7 && i == 0) size = 1e6;
            if (kind == 7 && i > 0) size *= 0.01;
            box[i].lo[k] = shift + scale * p[k];
            box[i].hi[k] = fmax(box[i].lo[k], shift + scale * (p[k] + size));
        }
    }
}

static void test_self(void **state) {
    (void)state;
    static morph_box box[MOST];
    static int want[MOST * MOST][2], got[MOST * MOST][2];
    morph_hash *hash;
    assert_int_equal(morph_hash_create(&hash), MORPH_OK);
    long found = 0;
    for (int round = 0; round < 1000; round++) {
        const int n = (int)uniform(0, MOST), kind = round % 10;
        random_boxes(kind, n, box);
        int wanted = 0, pairs;
        for (int i = 0; i < n; i++)
            for (int j = i + 1; j < n; j++)
                if (morph_box_overlap(&box[i], &box[j])) {
                    want[wanted][0] = i;
                    want[wanted++][1] = j;
                }
        const int(*pair)[2];
        assert_int_equal(morph_hash_self(hash, n, box, &pair, &pairs), MORPH_OK);
        if (pairs != wanted) print_error("round %d kind %d: %d pairs of %d\n", round, kind, pairs, wanted);
        assert_int_equal(pairs, wanted);
        if (pairs > 0) memcpy(got, pair, (size_t)pairs * sizeof *got);
        /* Said once each: the sorted lists are equal. */
        qsort(got, (size_t)pairs, sizeof *got, below);
        assert_memory_equal(got, want, (size_t)pairs * sizeof *got);
        found += pairs;
    }
    assert_true(found > 100000);
    morph_hash_destroy(hash);
}

static void test_between(void **state) {
    (void)state;
    static morph_box a[MOST], b[MOST];
    static int want[MOST * MOST][2], got[MOST * MOST][2];
    morph_hash *hash;
    assert_int_equal(morph_hash_create(&hash), MORPH_OK);
    long found = 0;
    for (int round = 0; round < 1000; round++) {
        const int n = (int)uniform(0, MOST), m = (int)uniform(0, MOST);
        /* The same kind of crowd, every other time with other sizes. */
        random_boxes(round % 10, n, a);
        random_boxes(round / 10 % 2 && round % 10 < 4 ? (round + 1) % 4 : round % 10, m, b);
        int wanted = 0, pairs;
        for (int i = 0; i < n; i++)
            for (int j = 0; j < m; j++)
                if (morph_box_overlap(&a[i], &b[j])) {
                    want[wanted][0] = i;
                    want[wanted++][1] = j;
                }
        const int(*pair)[2];
        assert_int_equal(morph_hash_between(hash, n, a, m, b, &pair, &pairs), MORPH_OK);
        assert_int_equal(pairs, wanted);
        if (pairs > 0) memcpy(got, pair, (size_t)pairs * sizeof *got);
        qsort(got, (size_t)pairs, sizeof *got, below);
        assert_memory_equal(got, want, (size_t)pairs * sizeof *got);
        found += pairs;
    }
    assert_true(found > 100000);
    morph_hash_destroy(hash);
}

/* The same boxes give the same order, whatever was asked before; a second time asks for no memory. */
static void test_repeats(void **state) {
    (void)state;
    static morph_box box[MOST], other[MOST];
    static int first[MOST * MOST][2];
    morph_hash *hash, *fresh;
    const int(*pair)[2];
    int pairs, again;
    assert_int_equal(morph_hash_create(&hash), MORPH_OK);
    assert_int_equal(morph_hash_create(&fresh), MORPH_OK);
    random_boxes(1, MOST, box);
    random_boxes(2, MOST, other);
    assert_int_equal(morph_hash_self(hash, MOST, other, &pair, &pairs), MORPH_OK);
    assert_int_equal(morph_hash_self(hash, MOST, box, &pair, &pairs), MORPH_OK);
    memcpy(first, pair, (size_t)pairs * sizeof *first);
    const size_t bytes = morph_hash_bytes(hash);
    for (int round = 0; round < 50; round++) {
        assert_int_equal(morph_hash_self(hash, MOST, round & 1 ? box : other, &pair, &again), MORPH_OK);
        assert_int_equal(morph_hash_bytes(hash), bytes);
    }
    assert_int_equal(again, pairs);
    assert_memory_equal(pair, first, (size_t)pairs * sizeof *first);
    assert_int_equal(morph_hash_self(fresh, MOST, box, &pair, &again), MORPH_OK);
    assert_memory_equal(pair, first, (size_t)pairs * sizeof *first);
    morph_hash_destroy(fresh);
    morph_hash_destroy(hash);
    morph_hash_destroy(NULL);
}

static void test_refused(void **state) {
    (void)state;
    morph_hash *hash;
    const int(*pair)[2];
    int pairs;
    assert_int_equal(morph_hash_create(&hash), MORPH_OK);
    morph_box box[2] = {{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, 1}}};
    assert_int_equal(morph_hash_self(hash, 2, box, &pair, &pairs), MORPH_OK);
    assert_int_equal(pairs, 1);
    assert_int_equal(morph_hash_self(hash, 0, NULL, &pair, &pairs), MORPH_OK);
    assert_int_equal(pairs, 0);
    assert_int_equal(morph_hash_self(hash, -1, box, &pair, &pairs), MORPH_ERR_INPUT);
    box[1].lo[1] = 2;
    assert_int_equal(morph_hash_self(hash, 2, box, &pair, &pairs), MORPH_ERR_INPUT);
    assert_int_equal(pairs, 0);
    box[1].lo[1] = NAN;
    assert_int_equal(morph_hash_self(hash, 2, box, &pair, &pairs), MORPH_ERR_NONFINITE);
    box[1].lo[1] = -INFINITY;
    assert_int_equal(morph_hash_between(hash, 1, box, 1, box + 1, &pair, &pairs), MORPH_ERR_NONFINITE);
    box[1].lo[1] = -1e61;
    assert_int_equal(morph_hash_self(hash, 2, box, &pair, &pairs), MORPH_ERR_NONFINITE);
    morph_hash_destroy(hash);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_self), cmocka_unit_test(test_between),
                                       cmocka_unit_test(test_repeats), cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
