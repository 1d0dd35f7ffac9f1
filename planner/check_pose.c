/* What holds pose by pose: panels, angles and base plane on the grid 10 times finer than the samples; at the
 * samples posts, and that lengths and joints tell the same story. Between samples lengths alone are output,
 * and joints follow a cubic through the nearest four: what posts and links are off there is the error of that
 * cubic (of fourth order in the sample time, of third where the jerk jumps), not of the plan. It is measured,
 * so that a finding that it may have made can be told from one of the plan. */
#include "planner/check_parts.h"

#include <stdlib.h>

/* An angle tuple: two unit directions (links first, then posts), their mutual sign, and a gate: while the
 * cosine stays inside it, the margin cannot fall below the worst found, and no angle needs computing. */
typedef struct angle {
    int u, v;
    double sign;
    double least, most;
} angle;

typedef struct poses {
    const morph_record *r;
    morph_findings *f;
    double h;
    double *x;         /* 3*joints: the pose */
    double *direction; /* 3*(links + posts): unit vectors, 0 where the ends coincide */
    double *size;      /* links + posts: lengths from the joints */
    double *curve;     /* links: lengths from the schedule's curves */
    angle *link_post, *link_link;
} poses;

static double away_sign(const int link[2], int joint) {
    return link[0] == joint ? 1 : -1;
}

static int shared_joint(const int a[2], const int b[2]) {
    return a[0] == b[0] || a[0] == b[1] ? a[0] : a[1];
}

static morph_status poses_create(const morph_record *r, morph_findings *f, poses *p) {
    const size_t bars = (size_t)r->links + (size_t)r->posts;
    *p = (poses){.r = r, .f = f, .h = morph_check_step(r->time, r->samples)};
    p->x = morph_alloc((size_t)r->joints, 3 * sizeof(double));
    p->direction = morph_alloc(bars, 3 * sizeof(double));
    p->size = morph_alloc(bars, sizeof(double));
    p->curve = morph_alloc((size_t)r->links, sizeof(double));
    p->link_post = morph_alloc((size_t)r->link_posts, sizeof(angle));
    p->link_link = morph_alloc((size_t)r->link_links, sizeof(angle));
    if (!p->x || !p->direction || !p->size || !p->curve || !p->link_post || !p->link_link)
        return MORPH_ERR_NOMEM;
    /* Gates start closed: least > most. */
    for (int i = 0; i < r->link_posts; i++) {
        const int *t = r->link_post[i], joint = shared_joint(r->link[t[0]], r->post[t[1]]);
        p->link_post[i] = (angle){t[0], r->links + t[1], away_sign(r->link[t[0]], joint), 2, -2};
    }
    for (int i = 0; i < r->link_links; i++) {
        const int *t = r->link_link[i], joint = shared_joint(r->link[t[0]], r->link[t[1]]);
        p->link_link[i] =
            (angle){t[0], t[1], away_sign(r->link[t[0]], joint) * away_sign(r->link[t[1]], joint), 2, -2};
    }
    return MORPH_OK;
}

static void poses_free(poses *p) {
    free(p->x);
    free(p->direction);
    free(p->size);
    free(p->curve);
    free(p->link_post);
    free(p->link_link);
}

/* Tolerances: angles and base as the contract gives them, or where it gives none 1e-9 rad, the rounding of an
 * angle between directions known to about 1e-15 with room for the interpolation. Posts, panels and
 * compatibility are equalities: the contract's 1e-6. */
static void begin(const morph_record *r, morph_findings *f) {
    morph_finding *m = f->kind;
    if (r->posts > 0) morph_finding_begin(&m[MORPH_MARGIN_POST_LENGTH], 1e-6, 1);
    if (r->panels > 0) morph_finding_begin(&m[MORPH_MARGIN_PANEL], 1e-6, 1);
    if (r->link_posts > 0) morph_finding_begin(&m[MORPH_MARGIN_LINK_POST], 1e-9, 1);
    if (r->link_links > 0) morph_finding_begin(&m[MORPH_MARGIN_LINK_LINK], 1e-9, 1);
    if (!isnan(r->base)) morph_finding_begin(&m[MORPH_MARGIN_BASE], 1e-6, r->spacing);
    morph_finding_begin(&m[MORPH_MARGIN_COMPATIBILITY], 1e-6 * r->spacing, r->spacing);
}

static void place(poses *p, double tau) {
    const morph_record *r = p->r;
    const size_t n = 3 * (size_t)r->joints;
    double w[4];
    int count;
    const int first = morph_motion_weights(r->samples, tau, w, &count);
    for (size_t i = 0; i < n; i++)
        p->x[i] = 0;
    for (int s = 0; s < count; s++) {
        const double *x = r->schedule_joints + (size_t)(first + s) * n;
        for (size_t i = 0; i < n; i++)
            p->x[i] += w[s] * x[i];
    }
    for (int i = 0; i < r->links + r->posts; i++) {
        const int *ends = i < r->links ? r->link[i] : r->post[i - r->links];
        double *d = p->direction + 3 * (size_t)i;
        morph_sub(p->x + 3 * (size_t)ends[1], p->x + 3 * (size_t)ends[0], d);
        const double size = morph_norm(d), inverse = size > 0 ? 1 / size : 0;
        p->size[i] = size;
        for (int k = 0; k < 3; k++)
            d[k] *= inverse;
    }
}

static void test_angle(poses *p, angle *a, const double limit[2], morph_margin_kind kind,
                       morph_element_kind v_kind, int v_index, double t) {
    const double *u = p->direction + 3 * (size_t)a->u, *v = p->direction + 3 * (size_t)a->v;
    const double cosine = a->sign * morph_dot(u, v);
    if (cosine >= a->least && cosine <= a->most) return;
    double c[3];
    morph_cross(u, v, c);
    /* atan2 keeps its digits near 0 and pi, where acos loses half of them. */
    const double value = atan2(morph_norm(c), cosine);
    morph_finding *m = &p->f->kind[kind];
    morph_finding_note(m, fmin(value - limit[0], limit[1] - value), t,
                       morph_element_of(MORPH_ELEMENT_LINK, a->u), morph_element_of(v_kind, v_index));
    /* Margin below the worst needs an angle outside [lo + worst, hi - worst]; 1e-12 covers rounding. */
    const double lo = limit[0] + m->worst, hi = limit[1] - m->worst;
    a->most = lo > 0 ? cos(fmin(lo, M_PI)) - 1e-12 : 2;
    a->least = hi < M_PI ? cos(fmax(hi, 0)) + 1e-12 : -2;
}

static void test_angles(poses *p, double t) {
    const morph_record *r = p->r;
    for (int i = 0; i < r->link_posts; i++)
        test_angle(p, &p->link_post[i], r->link_post_limit[i], MORPH_MARGIN_LINK_POST, MORPH_ELEMENT_POST,
                   r->link_post[i][1], t);
    for (int i = 0; i < r->link_links; i++)
        test_angle(p, &p->link_link[i], r->link_link_limit[i], MORPH_MARGIN_LINK_LINK, MORPH_ELEMENT_LINK,
                   r->link_link[i][1], t);
}

/* Plane panels: the sine is the volume spanned by the unit vectors along both posts and from foot to foot. */
static void test_panels(poses *p, double t) {
    const morph_record *r = p->r;
    for (int i = 0; i < r->panels; i++) {
        const int a = r->panel[i][0], b = r->panel[i][1];
        double d[3], c[3];
        morph_sub(p->x + 3 * (size_t)r->post[b][0], p->x + 3 * (size_t)r->post[a][0], d);
        morph_cross(p->direction + 3 * (size_t)(r->links + a), p->direction + 3 * (size_t)(r->links + b), c);
        const double size = morph_norm(d), sine = size > 0 ? fabs(morph_dot(c, d)) / size : 0;
        morph_finding_note(&p->f->kind[MORPH_MARGIN_PANEL], -sine, t, morph_element_of(MORPH_ELEMENT_POST, a),
                           morph_element_of(MORPH_ELEMENT_POST, b));
    }
}

static void test_sample(poses *p, double t) {
    const morph_record *r = p->r;
    morph_finding *m = p->f->kind;
    const morph_element none = morph_no_element();
    for (int j = 0; j < r->posts; j++) {
        const double error = fabs(p->size[r->links + j] / r->post_length[j] - 1);
        morph_finding_note(&m[MORPH_MARGIN_POST_LENGTH], -error, t, morph_element_of(MORPH_ELEMENT_POST, j),
                           none);
    }
    for (int j = 0; j < r->links; j++) {
        const double error = fabs(p->curve[j] - p->size[j]);
        morph_finding_note(&m[MORPH_MARGIN_COMPATIBILITY], -error, t, morph_element_of(MORPH_ELEMENT_LINK, j),
                           none);
    }
}

static void measure_between(poses *p) {
    const morph_record *r = p->r;
    double most = p->f->interpolation;
    for (int j = 0; j < r->posts; j++)
        most = fmax(most, fabs(p->size[r->links + j] - r->post_length[j]));
    for (int j = 0; j < r->links; j++)
        most = fmax(most, fabs(p->curve[j] - p->size[j]));
    p->f->interpolation = most;
}

static void test_base(poses *p, double t) {
    const morph_record *r = p->r;
    morph_finding *m = p->f->kind;
    const morph_element none = morph_no_element();
    if (isnan(r->base)) return;
    for (int j = 0; j < r->joints; j++)
        morph_finding_note(&m[MORPH_MARGIN_BASE], p->x[3 * (size_t)j + 2] - r->base, t,
                           morph_element_of(MORPH_ELEMENT_JOINT, j), none);
}

/* Held posts (joints, where there are no posts) stay where they start; 1e-6 of the spacing as for every
 * equality. */
static void test_held(const morph_record *r, double h, morph_findings *f) {
    const int ends = r->posts > 0 ? 2 : 1;
    const morph_element_kind kind = r->posts > 0 ? MORPH_ELEMENT_POST : MORPH_ELEMENT_JOINT;
    for (int k = 1; k < r->samples; k++)
        for (int i = 0; i < r->fixed_count; i++)
            for (int e = 0; e < ends; e++) {
                const int joint = r->posts > 0 ? r->post[r->fixed[i]][e] : r->fixed[i];
                const size_t at = 3 * (size_t)joint;
                const double *now = r->schedule_joints + (size_t)k * 3 * (size_t)r->joints + at;
                const double moved = morph_dist(now, r->schedule_joints + at);
                if (moved <= 1e-6 * r->spacing) continue;
                char name[96];
                morph_element_name(r, morph_element_of(kind, r->fixed[i]), name, sizeof name);
                morph_findings_defect(f, "%s is held, but has moved %.3g m at %.9g s", name, moved, k * h);
                return;
            }
}

static void test_pose(poses *p, int k, int i) {
    const double tau = k + (double)i / MORPH_CHECK_FINE, t = p->h * tau;
    place(p, tau);
    test_angles(p, t);
    test_panels(p, t);
    test_base(p, t);
    morph_check_curve_lengths(p->r, k, (double)i / MORPH_CHECK_FINE, p->curve);
    if (i == 0 || i == MORPH_CHECK_FINE)
        test_sample(p, t);
    else
        measure_between(p);
}

morph_status morph_check_poses(const morph_record *r, const morph_control *control, morph_findings *f) {
    poses p;
    morph_status status = poses_create(r, f, &p);
    begin(r, f);
    for (int k = 0; k + 1 < r->samples && status == MORPH_OK; k++) {
        for (int i = 0; i < MORPH_CHECK_FINE; i++)
            test_pose(&p, k, i);
        if (k % 64 == 0 && morph_stopped(control)) status = MORPH_ERR_STOPPED;
    }
    if (status == MORPH_OK) {
        test_pose(&p, r->samples - 2, MORPH_CHECK_FINE);
        test_held(r, p.h, f);
    }
    poses_free(&p);
    return status;
}
