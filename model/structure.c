#include "model/structure_build.h"

#include <stdio.h>
#include <stdlib.h>

morph_structure_def morph_structure_defaults(double spacing) {
    const double deg = acos(-1.0) / 180.0;
    morph_structure_def def = {
        .layout = MORPH_LAYOUT_POSTS,
        .joints = MORPH_JOINTS_BALL,
        .bracing = MORPH_BRACING_NONE,
        .support = MORPH_SUPPORT_BASE,
        .spacing = spacing,
        .thickness = 0.5 * spacing,
        .mass = 0.02,
        .length = {{0.75 * spacing, 1.35 * spacing}, {0.75 * spacing, 1.35 * spacing}, {0.75, 1.35}},
        .radius = 0.04 * spacing,
        .rate = 0.5 * spacing,
        .acceleration = 2.0 * spacing,
        .jerk = 20.0 * spacing,
        .stiffness = 200.0,
        .damping = 0.5,
        .link_post = {55.0 * deg, 125.0 * deg},
        .link_link = {50.0 * deg, 130.0 * deg},
        .angle_soft = 5.0 * deg};
    return def;
}

static bool pair_ok(const double pair[2]) {
    return isfinite(pair[0]) && isfinite(pair[1]) && pair[0] > 0.0 && pair[0] <= pair[1];
}

static bool def_ok(const morph_structure_def *d) {
    const double positive[] = {d->spacing,      d->thickness, d->mass,     d->rate,
                               d->acceleration, d->jerk,      d->stiffness};
    for (size_t k = 0; k < sizeof positive / sizeof *positive; k++)
        if (!(isfinite(positive[k]) && positive[k] > 0.0)) return false;
    if (!(isfinite(d->radius) && d->radius >= 0.0) || !(isfinite(d->damping) && d->damping >= 0.0))
        return false;
    const double least_zero[] = {d->angle_stiffness, d->angle_soft, d->square};
    for (size_t k = 0; k < sizeof least_zero / sizeof *least_zero; k++)
        if (!(isfinite(least_zero[k]) && least_zero[k] >= 0.0)) return false;
    for (int k = 0; k < 3; k++)
        if (!pair_ok(d->length[k])) return false;
    if (d->nodes[0] < 2 || d->nodes[1] < 2 || d->nodes[0] > 1024 || d->nodes[1] > 1024) return false;
    if (!pair_ok(d->link_post) || !pair_ok(d->link_link)) return false;
    if (d->layout != MORPH_LAYOUT_OFFSET) return true;
    return d->nodes[0] > 2 && d->nodes[1] > 2 && d->joints == MORPH_JOINTS_BALL &&
           d->bracing == MORPH_BRACING_NONE;
}

static bool fixed_ok(const morph_structure_def *d) {
    if (d->fixed != MORPH_FIXED_LIST) return true;
    if (d->fixed_nodes < 0 || (d->fixed_nodes > 0 && !d->fixed_node)) return false;
    for (int k = 0; k < d->fixed_nodes; k++)
        if (morph_node_joint(d, 1, d->fixed_node[k][0], d->fixed_node[k][1]) < 0) return false;
    return true;
}

static bool stuck_ok(const morph_structure_def *d) {
    if (d->stuck_links < 0 || (d->stuck_links > 0 && !d->stuck_link)) return false;
    const int links = d->stuck_links > 0 ? morph_link_count(d) : 0;
    for (int k = 0; k < d->stuck_links; k++)
        if (d->stuck_link[k] < 0 || d->stuck_link[k] >= links) return false;
    return true;
}

static bool allocate(morph_structure *s) {
    const size_t j = (size_t)s->joints, l = (size_t)s->links, p = (size_t)s->posts;
    const size_t lp = (size_t)s->link_posts, ll = (size_t)s->link_links;
    return (s->joint_layer = morph_alloc(j, sizeof(int))) &&
           (s->joint_node = morph_alloc(j, sizeof(int[2]))) && (s->link = morph_alloc(l, sizeof(int[2]))) &&
           (s->link_kind = morph_alloc(l, sizeof(int))) &&
           (s->length_limit = morph_alloc(l, sizeof(double[2]))) &&
           (s->start_length = morph_alloc(l, sizeof(double))) &&
           (s->rate_limit = morph_alloc(l, sizeof(double))) &&
           (s->acceleration_limit = morph_alloc(l, sizeof(double))) &&
           (s->jerk_limit = morph_alloc(l, sizeof(double))) &&
           (s->link_radius = morph_alloc(l, sizeof(double))) && (s->post = morph_alloc(p, sizeof(int[2]))) &&
           (s->post_length = morph_alloc(p, sizeof(double))) &&
           (s->link_post = morph_alloc(lp, sizeof(int[2]))) &&
           (s->link_post_limit = morph_alloc(lp, sizeof(double[2]))) &&
           (s->link_link = morph_alloc(ll, sizeof(int[2]))) &&
           (s->link_link_joint = morph_alloc(ll, sizeof(int))) &&
           (s->link_link_limit = morph_alloc(ll, sizeof(double[2]))) &&
           (s->skin = morph_alloc((size_t)s->skin_triangles, sizeof(int[3]))) &&
           (s->panel = morph_alloc((size_t)s->panels, sizeof(int[2]))) &&
           (s->start = morph_alloc(3 * j, sizeof(double))) &&
           (s->fixed = morph_alloc((size_t)s->fixed_count, sizeof(int))) &&
           (s->fixed_joint = morph_alloc((size_t)s->fixed_joints, sizeof(int))) &&
           (s->fixed_node = morph_alloc((size_t)s->def.fixed_nodes, sizeof(int[2]))) &&
           (s->stuck_link = morph_alloc((size_t)s->def.stuck_links, sizeof(int)));
}

/* Marks the joints of the nodes held (the top layer has them all) and counts what is held. */
static void mark_fixed(morph_structure *s) {
    const morph_structure_def *d = &s->def;
    const int last[2] = {s->nx - 1, s->ny - 1};
    const int top = s->joints - s->nx * s->ny;
    for (int j = 0; j <= last[1]; j++)
        for (int i = 0; i <= last[0]; i++) {
            const bool x_end = i == 0 || i == last[0], y_end = j == 0 || j == last[1];
            if ((d->fixed == MORPH_FIXED_BORDER && (x_end || y_end)) ||
                (d->fixed == MORPH_FIXED_CORNERS && x_end && y_end))
                s->joint_fixed[top + j * s->nx + i] = true;
        }
    for (int k = 0; k < d->fixed_nodes; k++)
        s->joint_fixed[top + d->fixed_node[k][1] * s->nx + d->fixed_node[k][0]] = true;
    for (int n = 0; n < s->nx * s->ny; n++)
        s->fixed_count += s->joint_fixed[top + n];
    for (int p = 0; p < s->posts; p++)
        s->joint_fixed[p] = s->joint_fixed[top + p];
    s->fixed_joints = s->posts > 0 ? 2 * s->fixed_count : s->fixed_count;
}

static void list_fixed(morph_structure *s) {
    int n = 0;
    for (int j = 0; j < s->joints; j++)
        if (s->joint_fixed[j]) s->fixed_joint[n++] = j;
    /* Posts carry the numbers of their bottom joints, which come first. */
    for (int k = 0; k < s->fixed_count; k++)
        s->fixed[k] = s->fixed_joint[k];
    for (int k = 0; k < s->def.fixed_nodes; k++)
        for (int c = 0; c < 2; c++)
            s->fixed_node[k][c] = s->def.fixed_node[k][c];
    s->def.fixed_node = (const int(*)[2])s->fixed_node;
}

/* A link that cannot move has one length: that of the start. */
static void hold_stuck(morph_structure *s) {
    for (int k = 0; k < s->def.stuck_links; k++) {
        const int l = s->stuck_link[k] = s->def.stuck_link[k];
        s->length_limit[l][0] = s->length_limit[l][1] = s->start_length[l];
    }
    s->def.stuck_link = s->stuck_link;
}

morph_status morph_structure_create(const morph_structure_def *def, morph_structure **out) {
    *out = NULL;
    if (!def_ok(def) || !fixed_ok(def) || !stuck_ok(def)) return MORPH_ERR_INPUT;
    morph_structure *s = calloc(1, sizeof *s);
    if (!s) return MORPH_ERR_NOMEM;
    s->def = *def;
    if (def->fixed != MORPH_FIXED_LIST) s->def.fixed_nodes = 0;
    s->nx = def->nodes[0];
    s->ny = def->nodes[1];
    s->spacing = def->spacing;
    morph_structure_count(s);
    int *x_link = morph_alloc((size_t)s->joints, sizeof(int));
    int *y_link = morph_alloc((size_t)s->joints, sizeof(int));
    bool ok = (s->joint_fixed = morph_alloc((size_t)s->joints, sizeof(bool))) && x_link && y_link;
    if (ok) mark_fixed(s);
    ok = ok && allocate(s);
    if (ok) {
        morph_structure_place(s, x_link, y_link);
        list_fixed(s);
        hold_stuck(s);
    }
    free(x_link);
    free(y_link);
    if (!ok) {
        morph_structure_destroy(s);
        return MORPH_ERR_NOMEM;
    }
    *out = s;
    return MORPH_OK;
}

void morph_structure_destroy(morph_structure *s) {
    if (!s) return;
    free(s->joint_layer);
    free(s->joint_node);
    free(s->link);
    free(s->link_kind);
    free(s->length_limit);
    free(s->start_length);
    free(s->rate_limit);
    free(s->acceleration_limit);
    free(s->jerk_limit);
    free(s->link_radius);
    free(s->post);
    free(s->post_length);
    free(s->link_post);
    free(s->link_post_limit);
    free(s->link_link);
    free(s->link_link_joint);
    free(s->link_link_limit);
    free(s->skin);
    free(s->panel);
    free(s->fixed);
    free(s->fixed_joint);
    free(s->joint_fixed);
    free(s->fixed_node);
    free(s->stuck_link);
    free(s->start);
    free(s);
}

static const char *layer_text(int kind) {
    return kind == MORPH_LINK_BOTTOM ? "bottom" : kind == MORPH_LINK_TOP ? "top" : "brace";
}

void morph_link_name(const morph_structure *s, int link, char *text, size_t size) {
    const int *a = s->joint_node[s->link[link][0]], *b = s->joint_node[s->link[link][1]];
    snprintf(text, size, "link %d (%d,%d)-(%d,%d) %s", link, a[0], a[1], b[0], b[1],
             layer_text(s->link_kind[link]));
}

void morph_joint_name(const morph_structure *s, int joint, char *text, size_t size) {
    const int *a = s->joint_node[joint];
    snprintf(text, size, "joint (%d,%d) %s", a[0], a[1], layer_text(s->joint_layer[joint]));
}

void morph_post_name(const morph_structure *s, int post, char *text, size_t size) {
    const int *a = s->joint_node[s->post[post][0]];
    snprintf(text, size, "post (%d,%d)", a[0], a[1]);
}

void morph_link_lengths(const morph_structure *s, const double *x, double *lengths) {
    for (int l = 0; l < s->links; l++)
        lengths[l] = morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]);
}

static void away_from(const morph_structure *s, int link, int joint, int out[2]) {
    const int *ends = s->link[link];
    out[0] = joint;
    out[1] = ends[0] == joint ? ends[1] : ends[0];
}

void morph_link_post_joints(const morph_structure *s, int tuple, int uj[2], int vj[2]) {
    const int link = s->link_post[tuple][0], post = s->link_post[tuple][1];
    /* The end of the post that the link sits on: its layer's. */
    const int joint = s->post[post][s->joint_layer[s->link[link][0]]];
    away_from(s, link, joint, uj);
    vj[0] = s->post[post][0];
    vj[1] = s->post[post][1];
}

void morph_link_link_joints(const morph_structure *s, int tuple, int uj[2], int vj[2]) {
    away_from(s, s->link_link[tuple][0], s->link_link_joint[tuple], uj);
    away_from(s, s->link_link[tuple][1], s->link_link_joint[tuple], vj);
}
