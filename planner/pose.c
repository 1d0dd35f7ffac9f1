#include "planner/pose_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *morph_limit_name(morph_limit limit) {
    switch (limit) {
    case MORPH_LIMIT_POST:
        return "post length";
    case MORPH_LIMIT_PANEL:
        return "panel";
    case MORPH_LIMIT_LENGTH:
        return "length";
    case MORPH_LIMIT_ANGLE:
        return "angle";
    case MORPH_LIMIT_CLEARANCE:
        return "clearance";
    case MORPH_LIMIT_BASE:
        return "base";
    case MORPH_LIMIT_SELF:
        return "self clearance";
    case MORPH_LIMITS:
        break;
    }
    return "unknown";
}

morph_status morph_active_create(const morph_structure *s, morph_active **out) {
    *out = NULL;
    morph_active *a = calloc(1, sizeof *a);
    if (!a) return MORPH_ERR_NOMEM;
    const size_t tuples = (size_t)(s->link_posts + s->link_links);
    a->link = morph_alloc((size_t)s->links, sizeof(int));
    a->has_link = morph_alloc((size_t)s->links, sizeof(bool));
    a->tuple = morph_alloc(tuples, sizeof(int));
    a->has_tuple = morph_alloc(tuples, sizeof(bool));
    if (!a->link || !a->has_link || !a->tuple || !a->has_tuple) {
        morph_active_destroy(a);
        return MORPH_ERR_NOMEM;
    }
    *out = a;
    return MORPH_OK;
}

void morph_active_destroy(morph_active *a) {
    if (!a) return;
    free(a->link);
    free(a->has_link);
    free(a->tuple);
    free(a->has_tuple);
    free(a->point);
    free(a->feature);
    free(a->pair);
    free(a->lower);
    free(a->upper);
    free(a);
}

void morph_active_clear(morph_active *a, const morph_structure *s) {
    a->links = a->tuples = a->points = a->features = a->pairs = 0;
    memset(a->has_link, 0, (size_t)s->links * sizeof *a->has_link);
    memset(a->has_tuple, 0, (size_t)(s->link_posts + s->link_links) * sizeof *a->has_tuple);
}

int morph_active_rows(const morph_active *a, const morph_structure *s) {
    return morph_post_row_count(s) + morph_panel_row_count(s) + a->links + a->tuples + a->points +
           a->features + a->pairs;
}

int morph_possible_rows(const morph_structure *s) {
    const long axes = s->links + s->posts;
    /* Clearance: each skin triangle, each link, each joint once; pairs: every two axes. */
    const long all = s->posts + s->panels + s->links + s->link_posts + s->link_links + s->skin_triangles +
                     s->links + s->joints + axes * (axes - 1) / 2;
    return (int)all;
}

void morph_examine_note(morph_examiner *e, morph_limit limit, double amount,
                        void (*name)(const morph_structure *, int, char *, size_t), int element) {
    morph_violation *v = e->violation;
    if (amount <= v->amount[limit]) return;
    v->amount[limit] = amount;
    name(e->world->structure, element, v->element[limit], sizeof v->element[limit]);
}

bool morph_all_fixed(const morph_structure *s, const int *joint, int n) {
    bool all = s->fixed_joints > 0;
    for (int k = 0; k < n && all; k++)
        all = s->joint_fixed[joint[k]];
    return all;
}

/* A solve meets an equality to its tolerance, not to rounding, as it does for posts; the curve through the
 * poses holds such a link exactly (planner/hold.h) and moves nothing by more than this. Spacings. */
static const double HELD_SLACK = 5e-7;

static void examine_members(morph_examiner *e) {
    const morph_structure *s = e->world->structure;
    for (int p = 0; p < s->posts; p++) {
        const double h = morph_dist(&e->metres[3 * s->post[p][1]], &e->metres[3 * s->post[p][0]]);
        morph_examine_note(e, MORPH_LIMIT_POST, fabs(h / s->post_length[p] - 1.0), morph_post_name, p);
    }
    for (int q = 0; q < s->panels; q++)
        morph_examine_note(e, MORPH_LIMIT_PANEL, fabs(morph_panel_sine(s, q, e->x)), morph_panel_name, q);
    for (int l = 0; l < s->links; l++) {
        const double length = morph_dist(&e->x[3 * s->link[l][1]], &e->x[3 * s->link[l][0]]);
        const double lo = s->length_limit[l][0] / s->spacing - length,
                     hi = length - s->length_limit[l][1] / s->spacing;
        const double beyond = lo > hi ? lo : hi;
        const bool held = s->length_limit[l][0] == s->length_limit[l][1];
        morph_examine_note(e, MORPH_LIMIT_LENGTH, held ? beyond - HELD_SLACK : beyond, morph_link_name, l);
        if (e->active && !e->active->has_link[l] && !morph_all_fixed(s, s->link[l], 2) &&
            beyond > -e->inset->length - e->near->length) {
            e->active->has_link[l] = true;
            e->active->link[e->active->links++] = l;
            e->added++;
        }
    }
}

static bool tuple_fixed(const morph_structure *s, int tuple) {
    int joint[4];
    morph_angle_joints(s, tuple, joint, joint + 2);
    return morph_all_fixed(s, joint, 4);
}

static void examine_angles(morph_examiner *e) {
    const morph_structure *s = e->world->structure;
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        const double angle = morph_angle_at(s, t, e->x), *limit = morph_angle_limit(s, t);
        const double lo = limit[0] - angle, hi = angle - limit[1], beyond = lo > hi ? lo : hi;
        morph_examine_note(e, MORPH_LIMIT_ANGLE, beyond, morph_angle_name, t);
        if (e->active && !e->active->has_tuple[t] && beyond > -e->inset->angle - e->near->angle &&
            !tuple_fixed(s, t)) {
            e->active->has_tuple[t] = true;
            e->active->tuple[e->active->tuples++] = t;
            e->added++;
        }
    }
}

morph_status morph_pose_examine(const morph_world *world, const double *x, const morph_inset *inset,
                                const morph_nearness *near, morph_active *active, int *added,
                                morph_violation *violation) {
    const morph_structure *s = world->structure;
    static const morph_inset no_inset;
    morph_violation scratch;
    morph_examiner e = {.world = world,
                        .x = x,
                        .inset = inset ? inset : &no_inset,
                        .near = near,
                        .active = active,
                        .violation = violation ? violation : &scratch};
    memset(e.violation, 0, sizeof *e.violation);
    for (int k = 0; k < MORPH_LIMITS; k++)
        e.violation->amount[k] = -INFINITY;
    e.metres = morph_alloc(3 * (size_t)s->joints, sizeof(double));
    if (!e.metres) return MORPH_ERR_NOMEM;
    for (int i = 0; i < 3 * s->joints; i++) {
        e.metres[i] = x[i] * s->spacing - (i % 3 == 2 ? world->lift : 0.0);
        if (!isfinite(x[i])) e.status = MORPH_ERR_NONFINITE;
    }
    if (active) active->pairs = 0;
    if (e.status == MORPH_OK) {
        examine_members(&e);
        examine_angles(&e);
        morph_examine_clearance(&e);
        morph_examine_self(&e);
    }
    free(e.metres);
    if (added) *added = e.added;
    return e.status;
}

int morph_active_blocks(morph_active *a, const morph_world *world, const int *unknown,
                        const morph_inset *inset, morph_block out[MORPH_POSE_BLOCKS]) {
    const morph_structure *s = world->structure;
    const int rows = morph_active_rows(a, s);
    if (rows > a->bound_capacity) {
        double *lower = realloc(a->lower, (size_t)rows * sizeof *lower);
        if (lower) a->lower = lower;
        double *upper = realloc(a->upper, (size_t)rows * sizeof *upper);
        if (upper) a->upper = upper;
        if (!lower || !upper) return -1;
        a->bound_capacity = rows;
    }
    a->post_rows = (morph_post_rows){s};
    a->length_rows = (morph_length_rows){s, a->links, a->link, inset->length};
    a->angle_rows = (morph_angle_rows){s, a->tuples, a->tuple, inset->angle};
    a->panel_rows = (morph_panel_rows){s};
    a->clearance_rows = (morph_clearance_rows){s,        world->sdf,       a->points,
                                               a->point, inset->clearance, world->lift / s->spacing};
    a->feature_rows = (morph_feature_rows){s, a->features, a->feature, inset->clearance};
    a->separation_rows = (morph_separation_rows){s, a->pairs, a->pair, inset->self};
    double *lo = a->lower, *hi = a->upper;
    int n = 0;
    const int posts = morph_post_row_count(s), panels = morph_panel_row_count(s);
    if (posts) out[n++] = morph_block_posts(&a->post_rows, unknown, lo, hi);
    lo += posts, hi += posts;
    if (panels) out[n++] = morph_block_panels(&a->panel_rows, unknown, lo, hi);
    lo += panels, hi += panels;
    if (a->links) out[n++] = morph_block_lengths(&a->length_rows, unknown, lo, hi);
    lo += a->links, hi += a->links;
    if (a->tuples) out[n++] = morph_block_angles(&a->angle_rows, unknown, lo, hi);
    lo += a->tuples, hi += a->tuples;
    if (a->points) out[n++] = morph_block_clearance(&a->clearance_rows, unknown, lo, hi);
    lo += a->points, hi += a->points;
    if (a->features) out[n++] = morph_block_features(&a->feature_rows, unknown, lo, hi);
    lo += a->features, hi += a->features;
    if (a->pairs) out[n++] = morph_block_separation(&a->separation_rows, unknown, lo, hi);
    return n;
}

void morph_pose_bounds(const morph_world *world, double margin, double *lower) {
    const morph_structure *s = world->structure;
    for (int i = 0; i < 3 * s->joints; i++)
        lower[i] = i % 3 == 2 && !isnan(world->base) ? (world->base + s->def.radius) / s->spacing + margin
                                                     : -INFINITY;
}

void morph_pose_box(const morph_world *world, const double *base, const double *reference, double reach,
                    double *lower, double *upper) {
    const morph_structure *s = world->structure;
    for (int i = 0; i < 3 * s->joints; i++) {
        lower[i] = fmax(base[i], reference[i] - reach);
        upper[i] = fmax(base[i], reference[i]) + reach;
        if (s->fixed_joints > 0 && s->joint_fixed[i / 3]) lower[i] = upper[i] = reference[i];
    }
}

double morph_violation_worst(const morph_violation *v, const double tolerance[MORPH_LIMITS],
                             morph_limit *which) {
    double worst = -INFINITY;
    for (int k = 0; k < MORPH_LIMITS; k++)
        if (v->amount[k] / tolerance[k] > worst) {
            worst = v->amount[k] / tolerance[k];
            if (which) *which = (morph_limit)k;
        }
    return worst;
}
