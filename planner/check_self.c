/* Distances of links and posts among themselves, over the whole motion. The schedule is cut into stretches;
 * in each, boxes around what every bar sweeps give the pairs that can come near, and those are searched. */
#include "planner/check_parts.h"

#include "model/swept.h"
#include "solvers/collision.h"

#include <stdlib.h>

enum { STRETCHES = 64 };
/* The swept test costs about as much as three distances. */
#define WORTH 2.0

typedef struct bars {
    const morph_record *r;
    double *centred;     /* samples x 3*joints: the joints less their mean, for distances do not see it */
    morph_motion motion; /* of those */
    int count;           /* links, then posts */
    double post_radius;
    double *lo, *hi; /* 3*count */
    int (*pair)[2];  /* capacity */
    int capacity;
    int a, b; /* the pair at hand */
} bars;

static const int *ends_of(const bars *s, int bar) {
    return bar < s->r->links ? s->r->link[bar] : s->r->post[bar - s->r->links];
}

static double radius_of(const bars *s, int bar) {
    return bar < s->r->links ? s->r->link_radius[bar] : s->post_radius;
}

static morph_element element_of(const bars *s, int bar) {
    return bar < s->r->links ? morph_element_of(MORPH_ELEMENT_LINK, bar)
                             : morph_element_of(MORPH_ELEMENT_POST, bar - s->r->links);
}

static bool share_joint(const bars *s, int a, int b) {
    const int *p = ends_of(s, a), *q = ends_of(s, b);
    return p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1];
}

static double point_segment(const double p[3], const double a[3], const double b[3]) {
    double d[3], r[3], x[3];
    morph_sub(b, a, d);
    morph_sub(p, a, r);
    const double dd = morph_dot(d, d), t = dd > 0 ? fmin(1, fmax(0, morph_dot(d, r) / dd)) : 0;
    for (int k = 0; k < 3; k++)
        x[k] = a[k] + t * d[k];
    return morph_dist(p, x);
}

/* Distance of segments ab and cd. The closest points of the two lines count where both lie within; else (and
 * for parallel lines) an end of one is involved. */
static double segment_segment(const double a[3], const double b[3], const double c[3], const double d[3]) {
    double u[3], v[3], r[3];
    morph_sub(b, a, u);
    morph_sub(d, c, v);
    morph_sub(c, a, r);
    const double uu = morph_dot(u, u), vv = morph_dot(v, v), uv = morph_dot(u, v);
    const double det = uu * vv - uv * uv;
    /* Below 1e-14 (sine 1e-7) det is rounding; the ends then err by that sine times the length, squared. */
    if (det > 1e-14 * uu * vv) {
        const double ru = morph_dot(u, r), rv = morph_dot(v, r);
        const double s = (ru * vv - rv * uv) / det, t = (ru * uv - rv * uu) / det;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) {
            double gap[3];
            for (int k = 0; k < 3; k++)
                gap[k] = r[k] + t * v[k] - s * u[k];
            return morph_norm(gap);
        }
    }
    return fmin(fmin(point_segment(a, c, d), point_segment(b, c, d)),
                fmin(point_segment(c, a, b), point_segment(d, a, b)));
}

static double pair_value(void *data, double tau) {
    const bars *s = data;
    const int *p = ends_of(s, s->a), *q = ends_of(s, s->b);
    double x[4][3];
    morph_motion_point(&s->motion, p[0], tau, x[0]);
    morph_motion_point(&s->motion, p[1], tau, x[1]);
    morph_motion_point(&s->motion, q[0], tau, x[2]);
    morph_motion_point(&s->motion, q[1], tau, x[3]);
    return segment_segment(x[0], x[1], x[2], x[3]) - radius_of(s, s->a) - radius_of(s, s->b);
}

static double bar_travel(const bars *s, int bar, double from, double to) {
    const int *p = ends_of(s, bar);
    return fmax(morph_motion_travel(&s->motion, p[0], from, to),
                morph_motion_travel(&s->motion, p[1], from, to));
}

static double pair_travel(void *data, double from, double to) {
    const bars *s = data;
    return bar_travel(s, s->a, from, to) + bar_travel(s, s->b, from, to);
}

/* The swept test of the two axes, straight from end to end of the span, with what they may bend on the way
 * added to the distance. Strict costs no more where the pair is well apart, as most are. */
static bool pair_apart(void *data, double from, double to, double least, double spare) {
    const bars *s = data;
    const double distance = least + radius_of(s, s->a) + radius_of(s, s->b);
    if (distance <= 0) return true; /* no two axes are nearer than that */
    const int *ends[2] = {ends_of(s, s->a), ends_of(s, s->b)};
    double x[2][2][2][3], bend[2] = {0, 0}; /* time, bar, end */
    for (int bar = 0; bar < 2; bar++)
        for (int e = 0; e < 2; e++) {
            morph_motion_point(&s->motion, ends[bar][e], from, x[0][bar][e]);
            morph_motion_point(&s->motion, ends[bar][e], to, x[1][bar][e]);
            bend[bar] = fmax(bend[bar], morph_motion_bend(&s->motion, ends[bar][e], from, to));
        }
    if (bend[0] + bend[1] > spare) return false;
    const morph_swept_options options = {distance + bend[0] + bend[1], true};
    return !morph_swept_edge_edge((const double(*)[3])x[0][0], (const double(*)[3])x[0][1],
                                  (const double(*)[3])x[1][0], (const double(*)[3])x[1][1], &options, NULL);
}

static morph_status bars_create(const morph_record *r, bars *s) {
    const size_t n = 3 * (size_t)r->joints;
    *s = (bars){.r = r, .count = r->links + r->posts, .post_radius = morph_check_radius(r)};
    s->centred = morph_alloc((size_t)r->samples, n * sizeof(double));
    s->lo = morph_alloc((size_t)s->count, 3 * sizeof(double));
    s->hi = morph_alloc((size_t)s->count, 3 * sizeof(double));
    if (!s->centred || !s->lo || !s->hi) return MORPH_ERR_NOMEM;
    for (int k = 0; k < r->samples; k++) {
        const double *x = r->schedule_joints + (size_t)k * n;
        double *y = s->centred + (size_t)k * n, mean[3] = {0, 0, 0};
        for (size_t i = 0; i < n; i++)
            mean[i % 3] += x[i] / r->joints;
        for (size_t i = 0; i < n; i++)
            y[i] = x[i] - mean[i % 3];
    }
    return morph_motion_create(s->centred, r->samples, r->joints, &s->motion);
}

static void bars_free(bars *s) {
    morph_motion_free(&s->motion);
    free(s->centred);
    free(s->lo);
    free(s->hi);
    free(s->pair);
}

/* Boxes hold all that a bar sweeps between the two times, its radius, and half of the least clearance found
 * so far: pairs whose boxes stay apart cannot have less. */
static void sweep_boxes(bars *s, double from, double to, double least) {
    for (int i = 0; i < s->count; i++) {
        const int *p = ends_of(s, i);
        double a[3], b[3];
        morph_motion_point(&s->motion, p[0], from, a);
        morph_motion_point(&s->motion, p[1], from, b);
        const double grow = bar_travel(s, i, from, to) + radius_of(s, i) + 0.5 * fmax(least, 0);
        for (int k = 0; k < 3; k++) {
            s->lo[3 * i + k] = fmin(a[k], b[k]) - grow;
            s->hi[3 * i + k] = fmax(a[k], b[k]) + grow;
        }
    }
}

static morph_status near_pairs(bars *s, int *found) {
    morph_status status = morph_box_pairs(s->lo, s->hi, s->count, s->pair, s->capacity, found);
    if (status != MORPH_OK || *found <= s->capacity) return status;
    free(s->pair);
    s->capacity = 0;
    s->pair = morph_alloc((size_t)*found, 2 * sizeof(int));
    if (!s->pair) return MORPH_ERR_NOMEM;
    s->capacity = *found;
    return morph_box_pairs(s->lo, s->hi, s->count, s->pair, s->capacity, found);
}

static bool select_pair(bars *s, int a, int b, morph_finding *m) {
    if (share_joint(s, a, b)) return false;
    s->a = a;
    s->b = b;
    m->tested = true;
    return true;
}

/* All pairs at the start: the value that broad phase and search begin with. */
static void start_values(bars *s, morph_sweep *w, morph_finding *m) {
    for (int a = 0; a < s->count; a++)
        for (int b = a + 1; b < s->count; b++) {
            if (!select_pair(s, a, b, m)) continue;
            const double value = pair_value(s, 0);
            if (!(value < w->least - w->tie)) continue;
            w->least = value;
            m->a = element_of(s, a);
            m->b = element_of(s, b);
        }
}

static morph_status search_stretch(bars *s, morph_sweep *w, double from, double to, morph_finding *m) {
    int found = 0;
    sweep_boxes(s, from, to, w->least);
    const morph_status status = near_pairs(s, &found);
    for (int i = 0; i < found && status == MORPH_OK && !w->failed && !w->exhausted; i++) {
        if (!select_pair(s, s->pair[i][0], s->pair[i][1], m)) continue;
        if (!morph_sweep_run(w, from, pair_value(s, from), to, pair_value(s, to))) continue;
        m->a = element_of(s, s->a);
        m->b = element_of(s, s->b);
    }
    return status;
}

static morph_status search(bars *s, const morph_control *control, double h, morph_findings *f) {
    morph_finding *m = &f->kind[MORPH_MARGIN_SELF_CLEARANCE];
    const morph_record *r = s->r;
    /* Slack 1e-4 spacings as for the target; the budget too is out of any plan's reach. */
    morph_sweep w = {.value = pair_value,
                     .travel = pair_travel,
                     .apart = f->plain ? NULL : pair_apart,
                     .worth = WORTH,
                     .data = s,
                     .slack = 1e-4 * r->spacing,
                     .tie = 1e-9 * r->spacing,
                     .least = INFINITY,
                     .finest = r->samples,
                     .budget = 3000000 + 50000L * s->count};
    start_values(s, &w, m);
    if (!m->tested) return MORPH_OK;
    const double last = r->samples - 1;
    const int stretches = r->samples - 1 < STRETCHES ? r->samples - 1 : STRETCHES;
    for (int i = 0; i < stretches; i++) {
        const morph_status status =
            search_stretch(s, &w, floor(last * i / stretches), floor(last * (i + 1) / stretches), m);
        if (status != MORPH_OK) return status;
        if (w.failed) return MORPH_ERR_NONFINITE;
        if (w.exhausted) {
            morph_findings_defect(f,
                                  "self-clearance cannot be verified: joints move too fast between samples");
            break;
        }
        if (morph_stopped(control)) return MORPH_ERR_STOPPED;
        morph_progress(control, "check", 0.7 + 0.3 * (i + 1) / stretches);
    }
    f->evaluations += w.evaluations;
    f->proofs += w.proofs;
    m->worst = w.least;
    m->time = w.at * h;
    return MORPH_OK;
}

morph_status morph_check_self(const morph_record *r, const morph_control *control, morph_findings *f) {
    morph_finding *m = &f->kind[MORPH_MARGIN_SELF_CLEARANCE];
    /* The contract says at least 0; 1e-9 spacings is rounding. */
    morph_finding_begin(m, 1e-9 * r->spacing, r->spacing);
    m->tested = false; /* until a pair is found that shares no joint */
    bars s;
    morph_status status = bars_create(r, &s);
    if (status == MORPH_OK) status = search(&s, control, morph_check_step(r->time, r->samples), f);
    bars_free(&s);
    return status;
}
