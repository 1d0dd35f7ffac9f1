/* The swept test as the prover of the clearances' search: the same margins as the search by motion bounds
 * alone, which is kept for that, and as a dense scan; nothing that crosses between two samples is missed. */
#include "planner/check_parts.h"

#include "model/distance.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { BARS = 5, SAMPLES = 14, JOINTS = 2 * BARS, SCAN = 64 };

static uint64_t seed;

static double random_in(double lo, double hi) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(seed >> 11) * 0x1p-53;
}

/* Bars that wander about as rigid as they please; arrays are static, nothing to free. */
typedef struct scene {
    morph_record r;
    int link[BARS][2], skin[2][3], t[12];
    double radius[BARS], x[SAMPLES][JOINTS][3], v[12], time[SAMPLES], offset[SAMPLES][3];
} scene;

static void random_motion(scene *s, double jump) {
    memset(s, 0, sizeof *s);
    for (int j = 0; j < JOINTS; j++) {
        double at[3], speed[3];
        for (int k = 0; k < 3; k++) {
            at[k] = random_in(-0.15, 0.15);
            speed[k] = random_in(-jump, jump);
        }
        for (int i = 0; i < SAMPLES; i++)
            for (int k = 0; k < 3; k++) {
                s->x[i][j][k] = at[k];
                at[k] += speed[k];
                speed[k] += 0.3 * random_in(-jump, jump);
            }
    }
    for (int b = 0; b < BARS; b++) {
        s->link[b][0] = 2 * b;
        s->link[b][1] = 2 * b + 1;
        s->radius[b] = random_in(1e-4, 4e-3);
    }
    for (int i = 0; i < SAMPLES; i++)
        s->time[i] = 0.01 * i;
    s->r.spacing = 0.1;
    s->r.joints = JOINTS;
    s->r.links = BARS;
    s->r.link = s->link;
    s->r.link_radius = s->radius;
    s->r.samples = SAMPLES;
    s->r.time = s->time;
    s->r.schedule_joints = &s->x[0][0][0];
}

typedef morph_status (*part)(const morph_record *, const morph_control *, morph_findings *);

static morph_findings search(const scene *s, part test, bool plain) {
    morph_findings f;
    memset(&f, 0, sizeof f);
    f.plain = plain;
    assert_int_equal(test(&s->r, NULL, &f), MORPH_OK);
    assert_string_equal(f.defect, "");
    return f;
}

/* What the search promises: nothing below the margin by more than this stays undiscovered. */
static double allowed(double margin) {
    return 1e-5 + 0.01 * fabs(margin) + 1e-9;
}

static double scan_bars(const scene *s) {
    morph_motion m;
    double least = INFINITY;
    assert_int_equal(morph_motion_create(&s->x[0][0][0], SAMPLES, JOINTS, &m), MORPH_OK);
    for (int n = 0; n <= (SAMPLES - 1) * SCAN; n++) {
        double x[JOINTS][3], u, w;
        for (int j = 0; j < JOINTS; j++)
            morph_motion_point(&m, j, (double)n / SCAN, x[j]);
        for (int a = 0; a < BARS; a++)
            for (int b = a + 1; b < BARS; b++)
                least = fmin(least,
                             morph_segment_segment(x[2 * a], x[2 * a + 1], x[2 * b], x[2 * b + 1], &u, &w) -
                                 s->radius[a] - s->radius[b]);
    }
    morph_motion_free(&m);
    return least;
}

static void bars_as_by_motion_bounds(void **state) {
    (void)state;
    long plain = 0, swept = 0, proofs = 0;
    double worst = 0;
    seed = 1;
    for (int n = 0; n < 200; n++) {
        scene s;
        random_motion(&s, n % 2 ? 0.004 : 0.04);
        const morph_findings a = search(&s, morph_check_self, true), b = search(&s, morph_check_self, false);
        const morph_finding *p = &a.kind[MORPH_MARGIN_SELF_CLEARANCE],
                            *q = &b.kind[MORPH_MARGIN_SELF_CLEARANCE];
        assert_true(q->tested && fabs(p->worst - q->worst) <= allowed(p->worst));
        const double least = scan_bars(&s);
        assert_true(q->worst <= least + allowed(least));
        assert_int_equal(a.proofs, 0);
        worst = fmax(worst, fabs(p->worst - q->worst));
        plain += a.evaluations;
        swept += b.evaluations;
        proofs += b.proofs;
    }
    print_message(
        "bars: %ld distances by motion bounds, %ld and %ld proofs with the swept test; margins differ by "
        "%.1e m at most\n",
        plain, swept, proofs, worst);
    assert_true(proofs > 0 && swept < plain);
}

/* Thin bars that fly through one another between two samples, half way or elsewhere: axes meet. */
static void planted_crossings_of_bars(void **state) {
    (void)state;
    seed = 2;
    for (int n = 0; n < 200; n++) {
        scene s;
        random_motion(&s, 0);
        const double when = random_in(3.05, SAMPLES - 4.05), speed = random_in(0.02, 0.5);
        double meet[3], along[3] = {0, 0.07, 0};
        for (int k = 0; k < 3; k++)
            meet[k] = random_in(0.3, 0.7);
        meet[2] += 1; /* away from the others */
        for (int i = 0; i < SAMPLES; i++)
            for (int k = 0; k < 3; k++) {
                s.x[i][0][k] = meet[k] + (k == 0 ? -0.06 : 0);
                s.x[i][1][k] = meet[k] + (k == 0 ? 0.04 : 0);
                const double fly = (k == 2 ? speed : k == 0 ? 0.01 : 0) * (i - when);
                s.x[i][2][k] = meet[k] + fly - along[k];
                s.x[i][3][k] = meet[k] + fly + 0.6 * along[k];
            }
        for (int b = 0; b < 2; b++)
            s.radius[b] = 1e-5;
        /* The others, apart from one another. */
        for (int j = 4; j < JOINTS; j++)
            for (int i = 0; i < SAMPLES; i++) {
                s.x[i][j][0] = 0.1 * (j / 2);
                s.x[i][j][1] = 0.1 * (j % 2);
                s.x[i][j][2] = -1;
            }
        const morph_findings f = search(&s, morph_check_self, false);
        const morph_finding *m = &f.kind[MORPH_MARGIN_SELF_CLEARANCE];
        assert_true(fabs(m->worst + 2e-5) < 1e-7);
        assert_true(fabs(m->time - 0.01 * when) < 1e-5);
        assert_true(m->a.kind == MORPH_ELEMENT_LINK && m->a.index == 0 && m->b.index == 1);
    }
}

/* A tetrahedron as target, perhaps a flat one, that moves too; bars and two skin triangles. */
static void random_target(scene *s, double thick) {
    static const int t[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    static const double v[12] = {-0.09, -0.05, 0, 0.09, -0.05, 0, 0, 0.1, 0, 0, 0, 1};
    memcpy(s->t, t, sizeof t);
    for (int k = 0; k < 12; k++)
        s->v[k] = v[k] * (k == 11 ? thick : 1) + (k % 3 == 2 ? 0 : random_in(-0.02, 0.02));
    for (int c = 0; c < 3; c++) {
        s->skin[0][c] = c;
        s->skin[1][c] = c + 4;
    }
    for (int i = 0; i < SAMPLES; i++)
        s->offset[i][2] = 0.0005 * i * i;
    s->r.skin = s->skin;
    s->r.skin_triangles = 2;
    s->r.target_vertices = 4;
    s->r.target_triangles = 4;
    s->r.target_v = s->v;
    s->r.target_t = s->t;
    s->r.offset_schedule = &s->offset[0][0];
}

static void target_as_by_motion_bounds(void **state) {
    (void)state;
    long plain = 0, swept = 0, proofs = 0;
    int clear = 0;
    seed = 3;
    for (int n = 0; n < 200; n++) {
        scene s;
        random_motion(&s, n % 2 ? 0.002 : 0.01);
        random_target(&s, n % 4 < 2 ? 0.05 : 1e-4);
        /* Few enter it, which is what takes long; the others pass above or beside. */
        for (int k = 0; k < SAMPLES * JOINTS && n % 20; k++)
            (&s.x[0][0][0])[3 * k + 2] = 0.11 + fabs((&s.x[0][0][0])[3 * k + 2]);
        const morph_findings a = search(&s, morph_check_clearance, true),
                             b = search(&s, morph_check_clearance, false);
        const double p = a.kind[MORPH_MARGIN_CLEARANCE].worst, q = b.kind[MORPH_MARGIN_CLEARANCE].worst;
        assert_true(fabs(p - q) <= allowed(p));
        clear += p > 0;
        plain += a.evaluations;
        swept += b.evaluations;
        proofs += b.proofs;
    }
    print_message(
        "target: %d of 200 clear of it; %ld distances by motion bounds, %ld and %ld proofs with the "
        "swept test\n",
        clear, plain, swept, proofs);
    assert_true(clear > 50 && clear < 200 && proofs > 0 && swept <= plain);
}

/* A thin triangle of skin, or a bar, that flies through a flat target between two samples. */
static void planted_crossings_of_the_target(void **state) {
    (void)state;
    seed = 4;
    for (int n = 0; n < 100; n++) {
        scene s;
        random_motion(&s, 0);
        random_target(&s, 1e-5);
        memset(s.offset, 0, sizeof s.offset);
        const double when = random_in(3.05, SAMPLES - 4.05), speed = random_in(0.02, 0.3);
        for (int j = 0; j < JOINTS; j++)
            for (int i = 0; i < SAMPLES; i++) {
                /* All far off; the second triangle of skin (4, 5, 6) and two bars, or the fifth bar (8, 9)
                 * crosses. */
                const bool crosses = n % 2 ? j >= 4 && j <= 7 : j >= 8;
                s.x[i][j][0] = crosses ? random_in(-0.03, 0.03) : 3 + 0.1 * j;
                s.x[i][j][1] = crosses ? random_in(-0.03, 0.03) : 0.1 * (j % 3);
                s.x[i][j][2] = crosses ? speed * (i - when) : 1;
                for (int k = 0; k < 2 && i > 0; k++)
                    s.x[i][j][k] = s.x[0][j][k];
            }
        for (int b = 0; b < BARS; b++)
            s.radius[b] = 1e-5;
        const morph_findings f = search(&s, morph_check_clearance, false);
        const morph_finding *m = &f.kind[MORPH_MARGIN_CLEARANCE];
        assert_true(m->worst <= -0.9e-5 && m->worst > -5e-5);
        assert_true(fabs(m->time - 0.01 * when) < 1e-4);
    }
}

/* Skin and bars that slide over the target's flat top, all in contact: a motion bound sees each in danger all
 * the time, the swept test sees that they keep their height. */
static void sliding(void **state) {
    (void)state;
    seed = 6;
    scene s;
    random_motion(&s, 0);
    random_target(&s, -0.5); /* the flat side up */
    memset(s.offset, 0, sizeof s.offset);
    for (int k = 0; k < 4; k++) { /* turned over with its apex: outward again */
        const int other = s.t[3 * k];
        s.t[3 * k] = s.t[3 * k + 1];
        s.t[3 * k + 1] = other;
    }
    for (int b = 0; b < BARS; b++)
        s.radius[b] = 0.004;
    for (int i = 0; i < SAMPLES; i++)
        for (int j = 0; j < JOINTS; j++) {
            s.x[i][j][0] = s.x[0][j][0] * (i ? 1 : 0.3) + (i ? 0.005 * i : 0);
            s.x[i][j][1] = s.x[0][j][1] * (i ? 1 : 0.3);
            s.x[i][j][2] = 0.004;
        }
    const morph_findings a = search(&s, morph_check_clearance, true),
                         b = search(&s, morph_check_clearance, false);
    assert_true(fabs(a.kind[MORPH_MARGIN_CLEARANCE].worst) < 1e-12);
    assert_true(fabs(b.kind[MORPH_MARGIN_CLEARANCE].worst) < 1e-12);
    print_message("sliding: %ld distances by motion bounds, %ld and %ld proofs with the swept test\n",
                  a.evaluations, b.evaluations, b.proofs);
    assert_true(10 * b.evaluations < a.evaluations);
}

/* The bound on the departure from the chord holds, and falls with the square of a short span. */
static void bend_bounds_the_departure(void **state) {
    (void)state;
    seed = 5;
    scene s;
    morph_motion m;
    random_motion(&s, 0.05);
    assert_int_equal(morph_motion_create(&s.x[0][0][0], SAMPLES, JOINTS, &m), MORPH_OK);
    double tightest = 0;
    for (int n = 0; n < 2000; n++) {
        const double from = random_in(0, SAMPLES - 1), width = random_in(0, n % 2 ? 0.3 : SAMPLES - 1 - from);
        const double to = fmin(from + width, SAMPLES - 1);
        const int j = n % JOINTS;
        double a[3], b[3], most = 0;
        const double bend = morph_motion_bend(&m, j, from, to);
        morph_motion_point(&m, j, from, a);
        morph_motion_point(&m, j, to, b);
        for (int i = 0; i <= 200; i++) {
            const double u = i / 200.0;
            double p[3], q[3];
            morph_motion_point(&m, j, fmin(from + u * (to - from), to), p);
            for (int k = 0; k < 3; k++)
                q[k] = (1 - u) * a[k] + u * b[k];
            most = fmax(most, morph_dist(p, q));
        }
        assert_true(most <= bend + 1e-15);
        if (bend > 0) tightest = fmax(tightest, most / bend);
    }
    assert_true(tightest > 0.9);
    assert_true(morph_motion_bend(&m, 0, 3.2, 3.2 + 1e-3) < 1.01e-4 * morph_motion_bend(&m, 0, 3.2, 3.3));
    morph_motion_free(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bars_as_by_motion_bounds),
        cmocka_unit_test(planted_crossings_of_bars),
        cmocka_unit_test(target_as_by_motion_bounds),
        cmocka_unit_test(planted_crossings_of_the_target),
        cmocka_unit_test(sliding),
        cmocka_unit_test(bend_bounds_the_departure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
