/* The swept test's invariances, and what lies at the edge of its domain. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "solvers/base.h"
#include "tests/support/swept_queries.h"

static const morph_swept_options modes[2] = {{.separation = 0, .strict = false},
                                             {.separation = 0, .strict = true}};

static swept_query scaled(const swept_query *q, int exponent) {
    swept_query r = *q;
    for (int i = 0; i < 24; i++)
        (&r.x[0][0][0])[i] = ldexp((&q->x[0][0][0])[i], exponent);
    return r;
}

static void powers_of_two(void **state) {
    (void)state;
    static const int exponent[] = {-900, -301, -40, 1, 77, 400, 990};
    uint64_t seed = 11;
    int hits = 0;
    for (int i = 0; i < 400; i++) {
        const swept_query q = swept_random(&seed, i % 2);
        for (size_t e = 0; e < sizeof exponent / sizeof *exponent; e++)
            for (int mode = 0; mode < 2; mode++) {
                const swept_query r = scaled(&q, exponent[e]);
                const double separation = i % 4 < 2 ? 0 : 0.05;
                const morph_swept_options here = {separation, mode == 1};
                const morph_swept_options there = {ldexp(separation, exponent[e]), mode == 1};
                double toi, other;
                const bool hit = swept_run(&q, &here, &toi);
                assert_int_equal(swept_run(&r, &there, &other), hit);
                assert_true(toi == other);
                hits += hit;
            }
    }
    assert_true(hits > 100);
}

/* The same pair, its points named in another order; 12 orders of each kind. */
static swept_query reordered(const swept_query *q, int order) {
    static const int corner[6][3] = {{1, 2, 3}, {2, 3, 1}, {3, 1, 2}, {1, 3, 2}, {3, 2, 1}, {2, 1, 3}};
    static const int end[8][4] = {{0, 1, 2, 3}, {1, 0, 2, 3}, {0, 1, 3, 2}, {1, 0, 3, 2},
                                  {2, 3, 0, 1}, {3, 2, 0, 1}, {2, 3, 1, 0}, {3, 2, 1, 0}};
    swept_query r = *q;
    for (int e = 0; e < 2; e++)
        for (int i = 0; i < 4; i++) {
            const int from = q->edges ? end[order % 8][i] : i ? corner[order % 6][i - 1] : 0;
            memcpy(r.x[e][i], q->x[e][from], sizeof r.x[e][i]);
        }
    return r;
}

static void any_order(void **state) {
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 600; i++) {
        const swept_query q = swept_random(&seed, i % 2);
        for (int mode = 0; mode < 2; mode++) {
            double toi, other;
            const bool hit = swept_run(&q, &modes[mode], &toi);
            for (int order = 1; order < 8; order++) {
                const swept_query r = reordered(&q, order);
                assert_int_equal(swept_run(&r, &modes[mode], &other), hit);
                /* Both times are before the contact, by the last step at most: no step on random pairs is
                 * followed by contacts beyond ten of the shortest. */
                if (hit) assert_true(fabs(toi - other) < (mode ? 1e-9 : 1e-5));
            }
        }
    }
}

/* Nothing is missed in any order, played backwards, or with the axes exchanged and mirrored. */
static void known_truth_reordered(void **state) {
    (void)state;
    static swept_query q[SWEPT_QUERIES];
    const int n = swept_read(MORPH_SHARED_DIR "/models/ccd_queries_ground_truth.csv", q, SWEPT_QUERIES);
    if (n < 0) {
        print_message("skipped: %s/models/ccd_queries_ground_truth.csv is missing\n", MORPH_SHARED_DIR);
        skip();
    }
    for (int mode = 0; mode < 2; mode++)
        for (int order = 1; order < 8; order++) {
            int misses = 0, alarms = 0;
            for (int i = 0; i < n; i++) {
                swept_query r = reordered(&q[i], order), back = r;
                for (int e = 0; e < 2 && order > 3; e++)
                    memcpy(r.x[e], back.x[1 - e], sizeof r.x[e]);
                for (int k = 0; k < 8 && order > 5; k++) {
                    double *x = r.x[k / 4][k % 4];
                    const double swap = x[0];
                    x[0] = -x[1];
                    x[1] = x[2];
                    x[2] = swap;
                }
                const bool hit = swept_run(&r, &modes[mode], NULL);
                misses += q[i].truth && !hit;
                alarms += !q[i].truth && hit;
            }
            assert_int_equal(misses, 0);
            assert_in_range(alarms, 0, mode ? 10 : 100);
        }
}

static void unusable_numbers(void **state) {
    (void)state;
    static const double bad[] = {NAN, INFINITY, -INFINITY, 0x1.1p1000, -1.7e308};
    uint64_t seed = 9;
    for (int edges = 0; edges < 2; edges++)
        for (int i = 0; i < 24; i++)
            for (size_t b = 0; b < sizeof bad / sizeof *bad; b++) {
                swept_query q = swept_random(&seed, edges);
                /* Far apart, but for the one number. */
                for (int e = 0; e < 2; e++)
                    q.x[e][0][0] += 100, q.x[e][1][0] += edges ? 100 : 0;
                assert_false(swept_run(&q, NULL, NULL));
                (&q.x[0][0][0])[i] = bad[b];
                for (int mode = 0; mode < 2; mode++) {
                    double toi = 7;
                    assert_true(swept_run(&q, &modes[mode], &toi));
                    assert_true(toi == 0);
                }
            }
    swept_query q = swept_random(&seed, false);
    q.x[0][0][0] = q.x[1][0][0] = 100;
    for (int i = 0; i < 4; i++) {
        const morph_swept_options o = {(const double[]){NAN, INFINITY, 1.7e308, -1}[i], i % 2};
        double toi = 7;
        assert_int_equal(swept_run(&q, &o, &toi), i < 3);
        assert_true(toi == (i < 3 ? 0 : INFINITY));
    }
}

/* Tables of pairs: vertex above a triangle (or edge above an edge) that stays, and when they meet. */
typedef struct pair {
    bool edges;
    double fixed[3][3];          /* triangle; for edges, b0 and b1 in the first two */
    double from[2][3], to[2][3]; /* vertex; for edges a0, a1 */
    double separation, when;     /* INFINITY: never */
} pair;

static void check_pairs(const pair *p, size_t n) {
    for (size_t i = 0; i < n; i++)
        for (int mode = 0; mode < 2; mode++) {
            const morph_swept_options o = {p[i].separation, mode == 1};
            const double(*fixed)[3] = (const double(*)[3])p[i].fixed;
            double toi;
            const bool hit =
                p[i].edges ? morph_swept_edge_edge(p[i].from, fixed, p[i].to, fixed, &o, &toi)
                           : morph_swept_vertex_triangle(p[i].from[0], fixed, p[i].to[0], fixed, &o, &toi);
            if (hit != (p[i].when <= 1) || toi > p[i].when || (hit && toi < p[i].when - 1e-6))
                print_error("pair %zu, mode %d: %g, not %g\n", i, mode, toi, p[i].when);
            assert_int_equal(hit, p[i].when <= 1);
            assert_true(toi <= p[i].when && (!hit || toi >= p[i].when - 1e-6));
        }
}

#define FLOOR                                                                                                \
    {                                                                                                        \
        {0, 0, 0}, {1, 0, 0}, {                                                                              \
            0, 1, 0                                                                                          \
        }                                                                                                    \
    }

static void degenerate_shapes(void **state) {
    (void)state;
    static const pair p[] = {
        /* A triangle that is a point, and one that is a segment, hit and passed by. */
        {false, {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{0, 0, 1}}, {{0, 0, -1}}, 0, 0.5},
        {false, {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{1e-9, 0, 1}}, {{1e-9, 0, -1}}, 0, INFINITY},
        {false, {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}, {{1.5, 1.5, 1}}, {{1.5, 1.5, -3}}, 0, 0.25},
        {false, {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}, {{1.5, 1.25, 1}}, {{1.5, 1.25, -3}}, 0, INFINITY},
        /* Edges without length; parallel edges; edges on one line. */
        {true, {{0, 0, 0}, {0, 0, 0}}, {{0, 0, 1}, {0, 0, 1}}, {{0, 0, -1}, {0, 0, -1}}, 0, 0.5},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{2.2, 0, 1}, {2.2, 0, 1}}, {{0, 0, -1}, {0, 0, -1}}, 0, INFINITY},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{0.5, 0, 1}, {1.5, 0, 1}}, {{0.5, 0, -1}, {1.5, 0, -1}}, 0, 0.5},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{0.5, 0, 1}, {1.5, 0, 1}}, {{1.5, 0, -1}, {2.5, 0, -1}}, 0, 0.5},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{3, 0, 0}, {4, 0, 0}}, {{-1, 0, 0}, {0, 0, 0}}, 0, 0.5},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{3, 0, 0}, {4, 0, 0}}, {{1.5, 0, 0}, {2.5, 0, 0}}, 0, INFINITY},
        /* Within the triangle's plane: into its side, and past it. */
        {false, FLOOR, {{-1, 0.25, 0}}, {{1, 0.25, 0}}, 0, 0.5},
        {false, FLOOR, {{-1, 0.25, 0}}, {{-1, 5, 0}}, 0, INFINITY},
    };
    check_pairs(p, sizeof p / sizeof *p);
}

static void standing_still(void **state) {
    (void)state;
    static const pair p[] = {
        {false, FLOOR, {{0.25, 0.25, 0}}, {{0.25, 0.25, 0}}, 0, 0},
        {false, FLOOR, {{0, 0, 0}}, {{0, 0, 0}}, 0, 0},
        {false, FLOOR, {{0.25, 0.25, 1e-30}}, {{0.25, 0.25, 1e-30}}, 0, INFINITY},
        {false, FLOOR, {{0.25, 0.25, 0.5}}, {{0.25, 0.25, 0.5}}, 0.5, 0},
        {false, FLOOR, {{0.25, 0.25, 0.5}}, {{0.25, 0.25, 0.5}}, 0.4999999, INFINITY},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{0.5, -1, 0}, {0.5, 1, 0}}, {{0.5, -1, 0}, {0.5, 1, 0}}, 0, 0},
        {true,
         {{0, 0, 0}, {1, 0, 0}},
         {{0.5, 1e-20, 0}, {0.5, 1, 0}},
         {{0.5, 1e-20, 0}, {0.5, 1, 0}},
         0,
         INFINITY},
    };
    check_pairs(p, sizeof p / sizeof *p);
}

/* Euclidean, at faces, edges and corners alike, and the bound itself counts. */
static void minimum_separation(void **state) {
    (void)state;
    static const pair p[] = {
        {false, FLOOR, {{0.25, 0.25, 1}}, {{0.25, 0.25, 0}}, 0.25, 0.75},
        {false, FLOOR, {{0.25, 0.25, 1}}, {{0.25, 0.25, 0.25}}, 0.25, 1},
        {false, FLOOR, {{0.25, 0.25, 1}}, {{0.25, 0.25, 0.2501}}, 0.25, INFINITY},
        {false, FLOOR, {{0.5, -0.3, 1}}, {{0.5, -0.3, -1}}, 0.5, 0.3},
        {false, FLOOR, {{0.5, -0.3, 1}}, {{0.5, -0.3, -1}}, 0.2999, INFINITY},
        /* 0.08 in both directions from the corner: 0.1131 away. */
        {false, FLOOR, {{-0.08, -0.08, 1}}, {{-0.08, -0.08, -1}}, 0.1, INFINITY},
        {false, FLOOR, {{-0.06, -0.08, 1}}, {{-0.06, -0.08, -1}}, 0.11, 0.5 * (1 - 0.04582575694955840)},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{0.5, -1, 1}, {0.5, 1, 1}}, {{0.5, -1, -1}, {0.5, 1, -1}}, 0.5, 0.25},
        {true, {{0, 0, 0}, {1, 0, 0}}, {{2, -1, 1}, {2, 1, 1}}, {{2, -1, -1}, {2, 1, -1}}, 0.999, INFINITY},
    };
    check_pairs(p, sizeof p / sizeof *p);
}

/* A point of the triangle (or a crossing of the edges) is chosen, and a relative motion through it a million
 * times the size at a chosen time; then one as much beside the triangle. Nothing else can meet. */
static void very_fast(void **state) {
    (void)state;
    uint64_t seed = 21;
    for (int i = 0; i < 2000; i++) {
        swept_query q = swept_random(&seed, false);
        double at[3], side[3], turn[3], n[3];
        const double a = swept_uniform(&seed, 0, 0.5), b = swept_uniform(&seed, 0, 0.5);
        const double when = swept_uniform(&seed, 0, 1);
        double *x[4] = {q.x[0][0], q.x[0][1], q.x[0][2], q.x[0][3]};
        morph_sub(x[2], x[1], side);
        morph_sub(x[3], x[1], turn);
        morph_cross(side, turn, n);
        /* Flat ones and grazing motions say nothing sharp. */
        if (morph_norm(n) < 0.05) continue;
        const bool miss = i % 2;
        for (int k = 0; k < 3; k++) {
            at[k] = x[1][k] + (miss ? -0.01 : a) * side[k] + b * turn[k];
            const double v = 1e6 * (n[k] / morph_norm(n) + swept_uniform(&seed, -0.3, 0.3));
            const double drift = swept_uniform(&seed, -1e6, 1e6);
            for (int j = 0; j < 4; j++)
                for (int e = 1; e >= 0; e--)
                    q.x[e][j][k] = j ? x[j][k] + drift * (e - when) : at[k] + (v + drift) * (e - when);
        }
        for (int mode = 0; mode < 2; mode++) {
            double toi;
            const bool hit = swept_run(&q, &modes[mode], &toi);
            assert_int_equal(hit, !miss);
            /* Late by the rounding of the coordinates only, a part in 1e16 of the motion. */
            if (hit) assert_true(toi <= when + 1e-14 && toi >= when - 1e-12);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(powers_of_two),         cmocka_unit_test(any_order),
        cmocka_unit_test(known_truth_reordered), cmocka_unit_test(unusable_numbers),
        cmocka_unit_test(degenerate_shapes),     cmocka_unit_test(standing_still),
        cmocka_unit_test(minimum_separation),    cmocka_unit_test(very_fast)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
