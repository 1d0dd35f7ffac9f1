/* For the blanket's extremes: a sheet over a target, run, and every recorded frame measured anew. */
#ifndef MORPH_TEST_EXTREME_SCENE_H
#define MORPH_TEST_EXTREME_SCENE_H

#include "model/blanket.h"
#include "tests/model/solids.h"

typedef struct world {
    morph_structure *s;
    morph_distance *exact;
    morph_sdf *sdf;
    double *start;
    morph_blanket_def def;
} world;

/* What the recorded frames come to: worst violations in spacings, relative, degrees, spacings. */
typedef struct figures {
    bool finite;
    double length, post, angle, depth, lowest, fastest;
    morph_blanket_report report;
    int frames;
} figures;

/* A 4 x 4 sheet; gap: its lowest joints stand so far above the mesh in `made`, spacings. The field's cells
 * are a tenth of the spacing, or `cell` of it. */
static inline void make_world(world *w, const morph_structure_def *def, bool closed, double gap,
                              double cell) {
    morph_structure_def d = *def;
    const double a = d.spacing;
    *w = (world){0};
    d.nodes[0] = d.nodes[1] = 4;
    assert_int_equal(morph_structure_create(&d, &w->s), MORPH_OK);
    const int n = 3 * w->s->joints;
    w->exact = finish(closed);
    double lo[3] = {-2.0 * a, -2.0 * a, INFINITY}, hi[3] = {2.0 * a, 2.0 * a, -INFINITY};
    for (int i = 0; i < 3 * made.nv; i++) {
        lo[i % 3] = fmin(lo[i % 3], made.v[i] - 0.5 * a);
        hi[i % 3] = fmax(hi[i % 3], made.v[i] + 0.5 * a);
    }
    assert_int_equal(morph_sdf_create(w->exact, lo, hi, (cell > 0.0 ? cell : 0.1) * a, NULL, &w->sdf),
                     MORPH_OK);
    w->start = malloc((size_t)n * sizeof(double));
    assert_non_null(w->start);
    for (int i = 0; i < n; i++)
        w->start[i] = w->s->start[i] + (i % 3 == 2 ? hi[2] - 0.5 * a + gap * a : 0.0);
    w->def = (morph_blanket_def){
        .gravity = 9.81, .drag = 0.2, .friction = 0.5, .time = 0.2, .frame = 0.02, .base = NAN};
}

static inline void free_world(world *w) {
    morph_sdf_destroy(w->sdf);
    morph_distance_destroy(w->exact);
    morph_structure_destroy(w->s);
    free(w->start);
}

/* made, a unit solid or any, scaled and moved up. */
static inline void scale_made(double scale, double up) {
    for (int i = 0; i < 3 * made.nv; i++)
        made.v[i] = scale * made.v[i] + (i % 3 == 2 ? up : 0.0);
}

static inline void measure_angles(const morph_structure *s, const double *x, figures *f) {
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        int uj[2], vj[2];
        double u[3], v[3];
        const bool post = t < s->link_posts;
        const double *limit = post ? s->link_post_limit[t] : s->link_link_limit[t - s->link_posts];
        if (post)
            morph_link_post_joints(s, t, uj, vj);
        else
            morph_link_link_joints(s, t - s->link_posts, uj, vj);
        morph_sub(&x[3 * uj[1]], &x[3 * uj[0]], u);
        morph_sub(&x[3 * vj[1]], &x[3 * vj[0]], v);
        const double a = acos(fmax(-1.0, fmin(1.0, morph_dot(u, v) / (morph_norm(u) * morph_norm(v)))));
        f->angle = fmax(f->angle, fmax(limit[0] - a, a - limit[1]) * 180.0 / acos(-1.0));
    }
}

static inline void measure_depth(const world *w, const double *x, double lift, figures *f) {
    const morph_structure *s = w->s;
    for (int n = 0; n < s->links + s->skin_triangles; n++) {
        const bool link = n < s->links;
        const int *joint = link ? s->link[n] : s->skin[n - s->links];
        double v[3][3], weight[3];
        morph_closest at;
        for (int k = 0; k < (link ? 2 : 3); k++)
            for (int m = 0; m < 3; m++)
                v[k][m] = x[3 * joint[k] + m] - (m == 2 ? lift : 0.0);
        if (link)
            morph_distance_segment(w->exact, v[0], v[1], weight, &at);
        else
            morph_distance_triangle(w->exact, v[0], v[1], v[2], weight, &at);
        const double radius = link ? s->link_radius[n] : s->def.radius;
        f->depth = fmax(f->depth, (radius - at.distance) / s->spacing);
    }
}

static inline void measure_frame(const world *w, const double *x, double lift, figures *f) {
    const morph_structure *s = w->s;
    for (int k = 0; k < 3 * s->joints; k++)
        f->finite = f->finite && isfinite(x[k]);
    if (!f->finite) return;
    for (int l = 0; l < s->links; l++) {
        const double size = morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]);
        f->length = fmax(f->length, (s->length_limit[l][0] - size) / s->spacing);
        f->length = fmax(f->length, (size - s->length_limit[l][1]) / s->spacing);
    }
    for (int p = 0; p < s->posts; p++)
        f->post =
            fmax(f->post,
                 fabs(morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]) / s->post_length[p] - 1.0));
    for (int j = 0; j < s->joints; j++)
        f->lowest = fmin(f->lowest, x[3 * j + 2]);
    measure_angles(s, x, f);
    measure_depth(w, x, lift, f);
}

/* Runs; MORPH_OK is asserted, or that the motion was refused by name (no frames then). The trajectory is the
 * caller's to free. */
static inline figures run_kept(const world *w, const char *name, morph_trajectory *kept) {
    morph_trajectory t;
    figures f = {.finite = true, .lowest = INFINITY};
    const double begin = cpu_seconds();
    const morph_status status =
        morph_blanket_run(w->s, w->sdf, w->exact, &w->def, w->start, NULL, &t, &f.report);
    const double seconds = cpu_seconds() - begin;
    if (status != MORPH_OK) print_error("%s: %s\n", name, morph_status_text(status));
    assert_int_equal(status, f.report.came_through ? MORPH_ERR_MOTION : MORPH_OK);
    f.frames = t.frames;
    for (int k = 0; k < t.frames; k++) {
        const double *x = &t.x[(size_t)k * 3 * (size_t)t.joints];
        measure_frame(w, x, t.lift[k], &f);
        for (int j = 0; j < t.joints && k > 0; j++)
            f.fastest = fmax(f.fastest, morph_dist(&x[3 * j], &x[3 * j - 3 * t.joints]) / w->def.frame);
    }
    *kept = t;
    print_message(
        "%-34s length %7.1e post %7.1e angle %5.2f depth %8.1e fastest %8.2e; %d steps, %d "
        "halvings, %.2f s\n",
        name, f.length, f.post, f.angle, f.depth, f.fastest, f.report.steps, f.report.step_halvings, seconds);
    return f;
}

static inline figures run_world(const world *w, const char *name) {
    morph_trajectory t;
    const figures f = run_kept(w, name, &t);
    morph_trajectory_free(&t);
    return f;
}

/* The bounds that every recorded frame keeps: lengths a billionth of the spacing, posts a billionth of
 * their own (rounding of coordinates adds a part in 1e13), clearance a thousandth of the spacing. */
static inline void expect_within(const figures *f) {
    /* A refused run has no frames: nothing would be shown. */
    assert_false(f->report.came_through);
    assert_true(f->frames > 1 && f->finite);
    assert_true(f->length <= 1e-9 + 1e-12);
    assert_true(f->post <= 1e-9 + 1e-12);
    assert_true(f->depth <= 1e-3 + 1e-6);
    /* Angles give way where all cannot hold at once: by half a degree, as in ordinary scenes. */
    assert_true(f->angle <= 0.5);
}

#endif
