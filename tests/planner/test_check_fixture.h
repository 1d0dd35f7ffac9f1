/* Records by hand for the tests of the check: a grid of vertical posts that bulges and stretches from rest to
 * rest, s(t) = 10 u^3 - 15 u^4 + 6 u^5, every joint moving along a straight line x + s d. */
#ifndef TEST_CHECK_FIXTURE_H
#define TEST_CHECK_FIXTURE_H

#include "model/structure.h"
#include "planner/check.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static inline void *fixture_copy(const void *from, size_t bytes) {
    void *to = malloc(bytes > 0 ? bytes : 1);
    assert_non_null(to);
    if (bytes > 0) memcpy(to, from, bytes);
    return to;
}

/* A box as target: lo, hi; replaces the one that is there. */
static inline void fixture_box(morph_record *r, const double lo[3], const double hi[3]) {
    static const int t[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                              1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    double v[24];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            v[3 * i + k] = corner[i][k] ? hi[k] : lo[k];
    free(r->target_v);
    free(r->target_t);
    r->target_vertices = 8;
    r->target_triangles = 12;
    r->target_v = fixture_copy(v, sizeof v);
    r->target_t = fixture_copy(t, sizeof t);
}

static inline void fixture_structure(const morph_structure *s, morph_record *r) {
    const size_t J = (size_t)s->joints, M = (size_t)s->links, P = (size_t)s->posts;
    const size_t A = (size_t)s->link_posts, B = (size_t)s->link_links, C = (size_t)s->skin_triangles;
    r->joints = s->joints;
    r->links = s->links;
    r->posts = s->posts;
    r->link_posts = s->link_posts;
    r->link_links = s->link_links;
    r->skin_triangles = s->skin_triangles;
    r->spacing = s->spacing;
    r->joint_layer = fixture_copy(s->joint_layer, J * sizeof(int));
    r->joint_node = fixture_copy(s->joint_node, 2 * J * sizeof(int));
    r->link = fixture_copy(s->link, 2 * M * sizeof(int));
    r->link_kind = fixture_copy(s->link_kind, M * sizeof(int));
    r->length_limit = fixture_copy(s->length_limit, 2 * M * sizeof(double));
    r->rate_limit = fixture_copy(s->rate_limit, M * sizeof(double));
    r->acceleration_limit = fixture_copy(s->acceleration_limit, M * sizeof(double));
    r->jerk_limit = fixture_copy(s->jerk_limit, M * sizeof(double));
    r->link_radius = fixture_copy(s->link_radius, M * sizeof(double));
    r->post = fixture_copy(s->post, 2 * P * sizeof(int));
    r->post_length = fixture_copy(s->post_length, P * sizeof(double));
    r->link_post = fixture_copy(s->link_post, 2 * A * sizeof(int));
    r->link_post_limit = fixture_copy(s->link_post_limit, 2 * A * sizeof(double));
    r->link_link = fixture_copy(s->link_link, 2 * B * sizeof(int));
    r->link_link_limit = fixture_copy(s->link_link_limit, 2 * B * sizeof(double));
    r->skin = fixture_copy(s->skin, 3 * C * sizeof(int));
}

/* Schedule of joints start + s(t) move (3*joints each), with lengths and their exact derivatives: for
 * e + s d between the ends, g = (e + s d).d / L is dL/ds and (d.d - g^2) / L its derivative. */
static inline void fixture_schedule(morph_record *r, const double *start, const double *move, int samples,
                                    double duration) {
    const size_t J = (size_t)r->joints, M = (size_t)r->links, S = (size_t)samples;
    r->samples = samples;
    r->time = malloc(S * sizeof(double));
    r->schedule_joints = malloc(S * 3 * J * sizeof(double));
    r->length = malloc(S * M * sizeof(double));
    r->rate = malloc(S * M * sizeof(double));
    r->acceleration = malloc(S * M * sizeof(double));
    r->offset_schedule = calloc(S * 3, sizeof(double));
    for (size_t k = 0; k < S; k++) {
        const double u = (double)k / (double)(S - 1);
        const double s = u * u * u * (10 + u * (-15 + 6 * u));
        const double s1 = 30 * u * u * (1 - u) * (1 - u) / duration;
        const double s2 = 60 * u * (1 - u) * (1 - 2 * u) / (duration * duration);
        r->time[k] = (double)k * (duration / (double)(S - 1));
        for (size_t i = 0; i < 3 * J; i++)
            r->schedule_joints[k * 3 * J + i] = start[i] + s * move[i];
        for (size_t l = 0; l < M; l++) {
            double e[3], d[3];
            for (int c = 0; c < 3; c++) {
                const size_t a = 3 * (size_t)r->link[l][0] + (size_t)c,
                             b = 3 * (size_t)r->link[l][1] + (size_t)c;
                d[c] = move[b] - move[a];
                e[c] = start[b] - start[a] + s * d[c];
            }
            const double length = morph_norm(e), g = morph_dot(e, d) / length;
            r->length[k * M + l] = length;
            r->rate[k * M + l] = g * s1;
            r->acceleration[k * M + l] = (morph_dot(d, d) - g * g) / length * s1 * s1 + g * s2;
        }
    }
}

/* n x n posts, spacing 0.1, bottom layer 0.05 above z = 0, bulging upwards and stretching by a few percent in
 * `duration`; target: a wide box below z = 0. Feasible with every default limit for 2 s or more. */
static inline void fixture_record(morph_record *r, int n, int samples, double duration) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = n;
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    memset(r, 0, sizeof *r);
    r->base = NAN;
    fixture_structure(s, r);
    double *start = malloc(3 * (size_t)s->joints * sizeof(double));
    double *move = malloc(3 * (size_t)s->joints * sizeof(double));
    const double half = 0.05 * (n - 1);
    for (int j = 0; j < s->joints; j++) {
        /* Both joints of a post move alike: posts stay rigid. The centre is off the middle, so that no two
         * links are alike. */
        const double *x = s->start + 3 * j;
        double *d = move + 3 * j;
        const double px = x[0] - 0.011, py = x[1] + 0.017, rr = (px * px + py * py) / (2 * half * half);
        memcpy(start + 3 * j, x, 3 * sizeof(double));
        start[3 * j + 2] += 0.05;
        d[0] = 0.06 * px;
        d[1] = 0.03 * py;
        d[2] = 0.03 * (1 - 0.8 * rr);
    }
    fixture_schedule(r, start, move, samples, duration);
    const double lo[3] = {-1, -1, -0.3}, hi[3] = {1, 1, 0};
    fixture_box(r, lo, hi);
    free(start);
    free(move);
    morph_structure_destroy(s);
}

static inline morph_check_report fixture_check(const morph_record *r) {
    morph_check_report report;
    assert_int_equal(morph_check_record(r, NULL, &report), MORPH_OK);
    return report;
}

/* Exactly this margin fails, by this amount to within `error`, at this element and between these times. */
static inline void fixture_expect(const morph_check_report *c, morph_margin_kind kind, double worst,
                                  double error, const char *element, double from, double to) {
    assert_string_equal(c->defect, "");
    for (int k = 0; k < MORPH_MARGIN_KINDS; k++) {
        const morph_margin *m = &c->margin[k];
        const bool holds = !m->tested || m->worst >= -m->tolerance;
        if (holds != (k != (int)kind))
            fail_msg("margin %s: %.9g at %s, %.9g s", morph_margin_name((morph_margin_kind)k), m->worst,
                     m->element, m->time);
    }
    const morph_margin *m = &c->margin[kind];
    if (fabs(m->worst - worst) > error)
        fail_msg("%s: %.12g, expected %.12g", morph_margin_name(kind), m->worst, worst);
    assert_string_equal(m->element, element);
    if (!(m->time >= from && m->time <= to)) fail_msg("%s: at %.9g s", morph_margin_name(kind), m->time);
    assert_int_equal(c->worst, kind);
    assert_false(c->feasible);
}

#endif
