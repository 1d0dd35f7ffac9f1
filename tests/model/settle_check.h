/* For tests of settle: what it calls rest, checked by the test's own arithmetic from the raw positions and
 * the multipliers: forces that balance, friction within its cones, lengths, exact clearance. */
#ifndef MORPH_TEST_SETTLE_CHECK_H
#define MORPH_TEST_SETTLE_CHECK_H

#include "settle_scene.h"

#include <stdio.h>

/* How far apart the places of differences are: the error of an axial force falls with its square. */
#define DIFFERENCE 1e-6

static inline void pull(double *force, int joint, double size, const double along[3]) {
    for (int k = 0; k < 3; k++)
        force[3 * joint + k] += size * along[k];
}

/* Tension on a link or post. */
static inline void axial(const double *x, const int ends[2], double tension, double *force) {
    double d[3];
    morph_sub(&x[3 * ends[1]], &x[3 * ends[0]], d);
    const double length = morph_norm(d);
    pull(force, ends[0], tension / length, d);
    pull(force, ends[1], -tension / length, d);
}

static inline double cosine(const morph_settle_angle *a, const double *x) {
    double u[3] = {0, 0, 0}, v[3] = {0, 0, 0};
    for (int j = 0; j < a->joints; j++)
        for (int k = 0; k < 3; k++) {
            u[k] += a->su[j] * x[3 * a->joint[j] + k];
            v[k] += a->sv[j] * x[3 * a->joint[j] + k];
        }
    return morph_dot(u, v) / (morph_norm(u) * morph_norm(v));
}

/* An angle's limit pushes along the slope of its cosine, by differences. */
static inline void angle(const morph_settle_angle *a, double *x, double *force) {
    const double push = a->push[0] - a->push[1];
    for (int j = 0; j < a->joints && push != 0.0; j++)
        for (int k = 0; k < 3; k++) {
            double *at = &x[3 * a->joint[j] + k];
            const double keep = *at;
            *at = keep + DIFFERENCE;
            const double up = cosine(a, x);
            *at = keep - DIFFERENCE;
            const double down = cosine(a, x);
            *at = keep;
            force[3 * a->joint[j] + k] += push * (up - down) / (2.0 * DIFFERENCE);
        }
}

/* Normal of the surface at a place, by exact distance for what seeks, else by the smooth one. */
static inline void normal_at(const scene *s, const morph_settle_place *p, const double q[3], double n[3]) {
    double at[3];
    morph_closest c;
    for (int k = 0; k < 3; k++)
        at[k] = q[k] * s->structure->spacing;
    if (p->plane)
        n[0] = n[1] = 0.0, n[2] = 1.0;
    else if (p->seeks) {
        morph_distance_point(s->exact, at, &c);
        memcpy(n, c.normal, sizeof c.normal);
    } else
        morph_sdf_eval(s->sdf, at, n, NULL);
}

/* A contact presses along the normal; its friction spring pulls towards its anchor, by no more than Coulomb
 * allows. Returns friction over mu times the normal force. */
static inline double contact(const scene *s, const morph_settle *t, const morph_settle_place *p,
                             const double *x, double *force) {
    double q[3] = {0, 0, 0}, n[3], u[3], f[3];
    for (int j = 0; j < p->corners; j++)
        for (int k = 0; k < 3; k++)
            q[k] += p->weight[j] * x[3 * p->joint[j] + k];
    normal_at(s, p, q, n);
    const double slope = morph_norm(n);
    for (int k = 0; k < 3; k++) {
        f[k] = p->push * n[k];
        u[k] = q[k] - p->anchor[k];
    }
    const double off = morph_dot(u, n) / (slope * slope);
    for (int k = 0; k < 3; k++)
        u[k] -= off * n[k];
    const double way = morph_norm(u), grip = fmin(t->grip * way, p->cone);
    for (int k = 0; k < 3 && way > 0.0; k++)
        f[k] -= grip * u[k] / way;
    for (int j = 0; j < p->corners; j++)
        pull(force, p->joint[j], p->weight[j], f);
    return grip > 0.0 ? grip / (t->friction * p->push * slope) : 0.0;
}

/* Largest force left over on a joint, in weights, from the raw positions and the multipliers alone. */
static inline double left_over(const scene *s, morph_settle *t, const double *raw, double *friction) {
    const morph_structure *st = s->structure;
    double *x = malloc(s->bytes), *force = calloc((size_t)s->n, sizeof *force), most = 0.0;
    assert_true(x && force);
    for (int i = 0; i < s->n; i++)
        x[i] = raw[i] / st->spacing;
    for (int j = 0; j < st->joints; j++) {
        force[3 * j + 2] -= t->weight;
        for (int m = 0; m < t->attractors; m++) {
            double f[3] = {0, 0, 0};
            morph_attraction(&t->attractor[m], t->softening, &x[3 * j], f, NULL);
            pull(force, j, 1.0, f);
        }
    }
    for (int l = 0; l < st->links; l++) {
        const double length = morph_dist(&x[3 * st->link[l][0]], &x[3 * st->link[l][1]]);
        const double stretch = length - st->start_length[l] / st->spacing;
        axial(x, st->link[l], t->spring * stretch + t->link_push[l][1] - t->link_push[l][0], force);
        assert_true(t->link_push[l][0] >= 0.0 && t->link_push[l][1] >= 0.0);
    }
    for (int p = 0; p < st->posts; p++)
        axial(x, st->post[p], t->post_push[p], force);
    for (int a = 0; a < t->angles; a++) {
        assert_true(t->angle[a].push[0] >= 0.0 && t->angle[a].push[1] >= 0.0);
        angle(&t->angle[a], x, force);
    }
    *friction = 0.0;
    for (int n = 0; n < t->places; n++) {
        const morph_settle_place *p = &t->place[n];
        assert_true(p->push >= 0.0);
        if (p->used && p->push > 0.0) *friction = fmax(*friction, contact(s, t, p, x, force));
    }
    for (int j = 0; j < st->joints; j++)
        most = fmax(most, morph_norm(&force[3 * j]) / t->weight);
    free(x);
    free(force);
    return most;
}

/* Clearance by exact distances of joints, links and skin, less the radius, spacings. */
static inline double clearance(const scene *s, const double *x) {
    const morph_structure *st = s->structure;
    double least = INFINITY, weight[3];
    morph_closest at;
    for (int j = 0; j < st->joints; j++) {
        morph_distance_point(s->exact, &x[3 * j], &at);
        least = fmin(least, at.distance - st->def.radius);
        least = fmin(least, x[3 * j + 2] - st->def.radius);
    }
    for (int l = 0; l < st->links; l++) {
        morph_distance_segment(s->exact, &x[3 * st->link[l][0]], &x[3 * st->link[l][1]], weight, &at);
        least = fmin(least, at.distance - st->link_radius[l]);
    }
    for (int t = 0; t < st->skin_triangles; t++) {
        morph_distance_triangle(s->exact, &x[3 * st->skin[t][0]], &x[3 * st->skin[t][1]],
                                &x[3 * st->skin[t][2]], weight, &at);
        least = fmin(least, at.distance - st->def.radius);
    }
    return least / st->spacing;
}

static inline void check_rest(const scene *s, morph_settle *t, const morph_settle_report *r,
                              const char *name) {
    const morph_structure *st = s->structure;
    double length = 0.0, friction;
    const double force = left_over(s, t, s->x, &friction), clear = clearance(s, s->x);
    for (int l = 0; l < st->links; l++) {
        const double here = morph_dist(&s->x[3 * st->link[l][0]], &s->x[3 * st->link[l][1]]);
        length = fmax(length, fmax(st->length_limit[l][0] - here, here - st->length_limit[l][1]));
    }
    print_message(
        "%s: %s%s, %d steps, %d iterations, %.2f s; forces left over %.1e weights, friction %.3f of "
        "its most, length %.1e, clearance %.1e spacings\n",
        name, morph_settle_outcome_text(r->outcome), r->stable ? ", stable" : "", r->steps, r->iterations,
        r->seconds, force, friction, length / st->spacing, clear);
    assert_true(r->converged && r->outcome == MORPH_SETTLE_RESTS);
    /* Differences of cosines keep 9 digits of pushes up to some tens of weights. */
    assert_true(force < 1e-6 + 1e-7);
    assert_true(friction <= 1.0 + 1e-9);
    assert_true(length <= 1e-9 * st->spacing);
    assert_true(clear >= -1e-3);
}

enum { BOX, SPHERE, SADDLE };
static const char *const targets[] = {"box", "sphere", "saddle"};

static inline void make(scene *s, int nodes, int target) {
    const morph_structure_def def = scene_structure(nodes, 20.0);
    if (target == SADDLE)
        scene_saddle(s, &def);
    else
        scene_make(s, &def, target == SPHERE);
}

static inline void rest(int nodes, int target, double friction, const morph_attractor *centre, int centres) {
    char name[64];
    scene s;
    make(&s, nodes, target);
    morph_settle_def def = morph_settle_defaults();
    def.friction = friction;
    def.base = 0.0;
    def.exact = s.exact;
    def.attractor = centre;
    def.attractors = centres;
    morph_settle *t = scene_settle(&s, &def);
    morph_settle_report r;
    assert_int_equal(morph_settle_run(t, s.x, false, NULL, &r), MORPH_OK);
    snprintf(name, sizeof name, "%s %d x %d, friction %g, %d centres", targets[target], nodes, nodes,
             friction, centres);
    check_rest(&s, t, &r, name);
    if (friction > 0.0) assert_true(r.stable);
    morph_settle_destroy(t);
    scene_free(&s);
}

#endif
