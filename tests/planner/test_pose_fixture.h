/* A grid over a target, and every limit of a pose measured again in the plainest way: loops over all
 * elements, distances by formulas of the target's shape, no trees, no sweeps. */
#ifndef TEST_POSE_FIXTURE_H
#define TEST_POSE_FIXTURE_H

#include "../support/shapes.h"
#include "planner/project.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* cmocka's own comparison is in single precision. */
static inline void assert_near(double value, double expected, double allowed) {
    if (!(fabs(value - expected) <= allowed)) fail_msg("%.12g where %.12g is expected", value, expected);
}

/* Spacing of all these grids, m. */
#define STEP 0.1

/* A target whose signed distance is a formula: a ball of `radius` about `centre`, or a box of half sizes
 * `half` whose own axes are the rows of `turn`. */
typedef struct solid {
    bool ball;
    double centre[3], radius, half[3], turn[3][3];
} solid;

static inline double solid_distance(const solid *b, const double p[3]) {
    double d[3], out = 0.0, in = -INFINITY;
    morph_sub(p, b->centre, d);
    if (b->ball) return morph_norm(d) - b->radius;
    for (int k = 0; k < 3; k++) {
        const double q = fabs(morph_dot(b->turn[k], d)) - b->half[k];
        out += q > 0.0 ? q * q : 0.0;
        in = fmax(in, q);
    }
    return out > 0.0 ? sqrt(out) : in;
}

typedef struct fixture {
    morph_structure *s;
    morph_distance *exact;
    morph_sdf *sdf;
    morph_cavity *cavity;
    morph_world world;
    morph_active *active;
    solid solid;
    int n;              /* coordinates */
    double *x, *metres; /* a pose: scaled, and in metres */
} fixture;

static inline void ball_mesh(morph_mesh *m, double radius, const double centre[3]) {
    enum { ROUND = 40, UP = 20 };
    m->vertices = ROUND * (UP - 1) + 2;
    m->triangles = 2 * ROUND * (UP - 1);
    m->v = malloc((size_t)m->vertices * 3 * sizeof *m->v);
    m->t = malloc((size_t)m->triangles * 3 * sizeof *m->t);
    assert_true(m->v && m->t);
    const double pi = acos(-1.0);
    for (int k = 0; k < m->vertices; k++) {
        const int ring = k / ROUND + 1;
        const bool pole = k >= ROUND * (UP - 1);
        const double up = pole ? (k % 2 ? 0.0 : pi) : pi * ring / UP, turn = 2.0 * pi * (k % ROUND) / ROUND;
        m->v[3 * k] = centre[0] + radius * sin(up) * cos(turn);
        m->v[3 * k + 1] = centre[1] + radius * sin(up) * sin(turn);
        m->v[3 * k + 2] = centre[2] + radius * cos(up);
    }
    const int bottom = ROUND * (UP - 1), top = bottom + 1;
    int n = 0;
    for (int i = 0; i < ROUND; i++) {
        const int j = (i + 1) % ROUND, last = ROUND * (UP - 2);
        const int caps[2][3] = {{top, i, j}, {bottom, last + j, last + i}};
        for (int c = 0; c < 2; c++)
            for (int k = 0; k < 3; k++)
                m->t[n++] = caps[c][k];
        for (int ring = 0; ring + 2 < UP; ring++) {
            const int a = ROUND * ring;
            const int pair[6] = {a + i, a + ROUND + i, a + ROUND + j, a + i, a + ROUND + j, a + j};
            for (int k = 0; k < 6; k++)
                m->t[n++] = pair[k];
        }
    }
    assert_int_equal(n, 3 * m->triangles);
}

static inline solid solid_box(double x, double y, double z, double height) {
    return (solid){.centre = {0.0, 0.0, height},
                   .half = {0.5 * x, 0.5 * y, 0.5 * z},
                   .turn = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
}

static inline void solid_mesh(const solid *b, morph_mesh *m) {
    *m = (morph_mesh){0};
    if (b->ball) {
        ball_mesh(m, b->radius, b->centre);
        return;
    }
    assert_true(test_box(m, 2.0 * b->half[0], 2.0 * b->half[1], 2.0 * b->half[2], 0.0));
    for (int k = 0; k < m->vertices; k++) {
        const double own[3] = {m->v[3 * k], m->v[3 * k + 1], m->v[3 * k + 2]};
        for (int i = 0; i < 3; i++)
            m->v[3 * k + i] =
                b->centre[i] + own[0] * b->turn[0][i] + own[1] * b->turn[1][i] + own[2] * b->turn[2][i];
    }
}

static inline void fixture_flat(fixture *f, double height) {
    for (int i = 0; i < f->n; i++)
        f->x[i] = (f->s->start[i] + (i % 3 == 2 ? height : 0.0)) / f->s->spacing;
}

static inline void fixture_make_def(fixture *f, const morph_structure_def *def, const solid *b, double base) {
    *f = (fixture){.solid = *b};
    assert_int_equal(morph_structure_create(def, &f->s), MORPH_OK);
    f->n = 3 * f->s->joints;
    f->x = morph_alloc((size_t)f->n, sizeof(double));
    f->metres = morph_alloc((size_t)f->n, sizeof(double));
    assert_true(f->x && f->metres);
    morph_mesh m;
    solid_mesh(b, &m);
    assert_int_equal(morph_distance_create(&m, true, &f->exact), MORPH_OK);
    double lo[3], hi[3];
    for (int k = 0; k < 3; k++) {
        lo[k] = -0.5 * STEP * (k < 2 ? def->nodes[k] : 0) - STEP;
        hi[k] = 0.5 * STEP * (k < 2 ? def->nodes[k] : 8) + STEP;
        for (int v = 0; v < m.vertices; v++) {
            lo[k] = fmin(lo[k], m.v[3 * v + k] - STEP);
            hi[k] = fmax(hi[k], m.v[3 * v + k] + STEP);
        }
    }
    morph_mesh_free(&m);
    assert_int_equal(morph_sdf_create(f->exact, lo, hi, STEP / 10.0, NULL, &f->sdf), MORPH_OK);
    assert_int_equal(morph_cavity_create(f->s, f->exact, base, &f->cavity), MORPH_OK);
    assert_int_equal(morph_active_create(f->s, &f->active), MORPH_OK);
    f->world = (morph_world){f->s, f->exact, f->sdf, f->cavity, base, 0.0};
}

static inline void fixture_make(fixture *f, int nx, int ny, const solid *b, double base) {
    morph_structure_def def = morph_structure_defaults(STEP);
    def.nodes[0] = nx;
    def.nodes[1] = ny;
    fixture_make_def(f, &def, b, base);
}

static inline void fixture_free(fixture *f) {
    morph_active_destroy(f->active);
    morph_cavity_destroy(f->cavity);
    morph_sdf_destroy(f->sdf);
    morph_distance_destroy(f->exact);
    morph_structure_destroy(f->s);
    free(f->x);
    free(f->metres);
}

/* Uniform in [-1, 1]. */
static inline double noise(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int64_t)(*seed >> 11) / 4503599627370496.0 - 1.0;
}

/* Worst violations as morph_violation has them, and the elements they stand at. */
typedef struct brute {
    double amount[MORPH_LIMITS];
    char element[MORPH_LIMITS][112];
} brute;

static inline bool worse(brute *b, morph_limit limit, double amount) {
    if (amount <= b->amount[limit]) return false;
    b->amount[limit] = amount;
    return true;
}

static inline double angle_between(const double *x, int u0, int u1, int v0, int v1) {
    double u[3], v[3], w[3];
    morph_sub(&x[3 * u1], &x[3 * u0], u);
    morph_sub(&x[3 * v1], &x[3 * v0], v);
    morph_cross(u, v, w);
    return atan2(morph_norm(w), morph_dot(u, v));
}

static inline double beyond_range(double value, const double range[2]) {
    return fmax(range[0] - value, value - range[1]);
}

/* Angles are enumerated anew: each link's two ends with the post there, each cell's four corners. */
static inline void brute_angles(const fixture *f, const double *x, brute *b) {
    const morph_structure *s = f->s;
    const int below = s->nx * s->ny;
    for (int l = 0; l < s->links; l++)
        for (int end = 0; end < 2; end++) {
            const int at = s->link[l][end], to = s->link[l][1 - end], foot = at % below;
            const double angle = angle_between(x, at, to, foot, foot + below);
            if (!worse(b, MORPH_LIMIT_ANGLE, beyond_range(angle, s->def.link_post))) continue;
            char link[48], post[48];
            morph_link_name(s, l, link, sizeof link);
            morph_post_name(s, foot, post, sizeof post);
            snprintf(b->element[MORPH_LIMIT_ANGLE], 112, "%s|%s", link, post);
        }
    for (int j = 0; j < s->joints; j++)
        for (int q = 0; q < 4; q++) {
            const int i0 = j % s->nx, j0 = j / s->nx % s->ny, i1 = i0 + (q & 1 ? 1 : -1),
                      j1 = j0 + (q & 2 ? 1 : -1);
            if (i1 < 0 || i1 >= s->nx || j1 < 0 || j1 >= s->ny) continue;
            const int row = j + (q & 1 ? 1 : -1), column = j + (q & 2 ? s->nx : -s->nx);
            const double angle = angle_between(x, j, row, j, column);
            if (!worse(b, MORPH_LIMIT_ANGLE, beyond_range(angle, s->def.link_link))) continue;
            char links[2][48] = {"", ""};
            for (int l = 0; l < s->links; l++)
                for (int k = 0; k < 2; k++) {
                    const int other = k ? column : row;
                    if ((s->link[l][0] == j && s->link[l][1] == other) ||
                        (s->link[l][1] == j && s->link[l][0] == other))
                        morph_link_name(s, l, links[k], sizeof links[k]);
                }
            snprintf(b->element[MORPH_LIMIT_ANGLE], 112, "%s|%s", links[0], links[1]);
        }
}

/* Least distance of two segments: of the ends to the other segment, and of the lines' closest points where
 * both lie within. */
static inline double segment_distance(const double *a, const double *b, const double *c, const double *d) {
    double least = INFINITY;
    const double *const ends[4][3] = {{a, c, d}, {b, c, d}, {c, a, b}, {d, a, b}};
    for (int k = 0; k < 4; k++) {
        double u[3], w[3], at[3];
        morph_sub(ends[k][2], ends[k][1], u);
        morph_sub(ends[k][0], ends[k][1], w);
        const double t = fmin(1.0, fmax(0.0, morph_dot(u, w) / morph_dot(u, u)));
        for (int i = 0; i < 3; i++)
            at[i] = ends[k][1][i] + t * u[i];
        least = fmin(least, morph_dist(at, ends[k][0]));
    }
    double u[3], v[3], w[3], n[3], p[3];
    morph_sub(b, a, u);
    morph_sub(d, c, v);
    morph_sub(c, a, w);
    morph_cross(u, v, n);
    const double nn = morph_dot(n, n);
    if (nn < 1e-12 * morph_dot(u, u) * morph_dot(v, v)) return least;
    morph_cross(w, v, p);
    const double s = morph_dot(p, n) / nn;
    morph_cross(w, u, p);
    const double t = morph_dot(p, n) / nn;
    if (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) least = fmin(least, fabs(morph_dot(w, n)) / sqrt(nn));
    return least;
}

static inline const int *axis_joints(const morph_structure *s, int axis) {
    return axis < s->links ? s->link[axis] : s->post[axis - s->links];
}

static inline bool share_joint(const int *p, const int *q) {
    return p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1];
}

/* Least signed distance of the triangle abc (a segment where b is c) to the solid: samples, then finer ones
 * about the best, six times. Metres. Never below the true least by more than rounding. */
static inline double element_distance(const solid *body, const double *a, const double *b, const double *c) {
    enum { SIDE = 24 };
    double least = INFINITY, u0 = 0.5, v0 = 0.5, width = 0.5;
    for (int level = 0; level < 7; level++, width *= 0.25) {
        double best_u = u0, best_v = v0;
        for (int i = -SIDE; i <= SIDE; i++)
            for (int j = -SIDE; j <= SIDE; j++) {
                double u = fmin(1.0, fmax(0.0, u0 + width * i / SIDE)),
                       v = fmin(1.0, fmax(0.0, v0 + width * j / SIDE));
                if (b == c && j) continue;
                if (b == c) v = 0.0;
                if (u + v > 1.0 + 1e-12) { /* onto the slanted side */
                    const double over = 0.5 * (u + v - 1.0);
                    if (over > 2.0 * width / SIDE) continue;
                    u -= over;
                    v -= over;
                }
                double p[3];
                for (int k = 0; k < 3; k++)
                    p[k] = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
                const double d = solid_distance(body, p);
                if (d >= least) continue;
                least = d;
                best_u = u;
                best_v = v;
            }
        u0 = best_u;
        v0 = best_v;
    }
    return least;
}

static inline void brute_clearance(const fixture *f, const double *x, brute *b) {
    const morph_structure *s = f->s;
    const double r = s->def.radius / s->spacing;
    for (int i = 0; i < f->n; i++)
        f->metres[i] = x[i] * s->spacing;
    for (int t = 0; t < s->skin_triangles; t++) {
        const int *j = s->skin[t], *node = s->joint_node[j[0]];
        const double d =
            element_distance(&f->solid, &f->metres[3 * j[0]], &f->metres[3 * j[1]], &f->metres[3 * j[2]]);
        if (worse(b, MORPH_LIMIT_CLEARANCE, r - d / s->spacing))
            snprintf(b->element[MORPH_LIMIT_CLEARANCE], 112, "skin triangle %d at (%d,%d)", t, node[0],
                     node[1]);
    }
    for (int l = 0; l < s->links; l++) {
        const double *p = &f->metres[3 * s->link[l][0]], *q = &f->metres[3 * s->link[l][1]];
        const double d = element_distance(&f->solid, p, q, q);
        if (s->link_kind[l] != MORPH_LINK_BOTTOM && worse(b, MORPH_LIMIT_CLEARANCE, r - d / s->spacing))
            morph_link_name(s, l, b->element[MORPH_LIMIT_CLEARANCE], 112);
    }
}

/* Everything of a pose x (scaled). */
static inline void brute_examine(const fixture *f, const double *x, brute *b) {
    const morph_structure *s = f->s;
    for (int k = 0; k < MORPH_LIMITS; k++) {
        b->amount[k] = -INFINITY;
        b->element[k][0] = '\0';
    }
    const int below = s->nx * s->ny;
    for (int p = 0; p < below; p++) {
        const double h = morph_dist(&x[3 * p], &x[3 * (p + below)]) * s->spacing;
        if (worse(b, MORPH_LIMIT_POST, fabs(h - s->def.thickness) / s->def.thickness))
            morph_post_name(s, p, b->element[MORPH_LIMIT_POST], 112);
    }
    for (int l = 0; l < s->links; l++) {
        const double *p = &x[3 * s->link[l][0]], *q = &x[3 * s->link[l][1]];
        const double metres = s->spacing * morph_dist(p, q);
        if (worse(b, MORPH_LIMIT_LENGTH, beyond_range(metres, s->def.length[s->link_kind[l]]) / s->spacing))
            morph_link_name(s, l, b->element[MORPH_LIMIT_LENGTH], 112);
    }
    brute_angles(f, x, b);
    brute_clearance(f, x, b);
    for (int j = 0; j < s->joints && !isnan(f->world.base); j++)
        if (worse(b, MORPH_LIMIT_BASE, f->world.base / s->spacing - x[3 * j + 2]))
            morph_joint_name(s, j, b->element[MORPH_LIMIT_BASE], 112);
    const int axes = s->links + s->posts;
    for (int i = 0; i < axes; i++)
        for (int k = i + 1; k < axes; k++) {
            const int *p = axis_joints(s, i), *q = axis_joints(s, k);
            if (share_joint(p, q)) continue;
            const double d = segment_distance(&x[3 * p[0]], &x[3 * p[1]], &x[3 * q[0]], &x[3 * q[1]]);
            if (!worse(b, MORPH_LIMIT_SELF, 2.0 * s->def.radius / s->spacing - d)) continue;
            char first[48], second[48];
            morph_axis_name(s, i, first, sizeof first);
            morph_axis_name(s, k, second, sizeof second);
            snprintf(b->element[MORPH_LIMIT_SELF], 112, "%s / %s", first, second);
        }
}

/* Fails unless the pose holds every limit by the plain measure. `slack` times the tolerances. */
static inline void assert_within(const fixture *f, const double *x, double slack) {
    brute b;
    brute_examine(f, x, &b);
    for (int k = 0; k < MORPH_LIMITS; k++)
        if (b.amount[k] > slack * morph_pose_tolerance[k])
            fail_msg("%s beyond its limit by %.3g at %s", morph_limit_name((morph_limit)k), b.amount[k],
                     b.element[k]);
}

#endif
