#include "model/structure.h"

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
        .link_link = {50.0 * deg, 130.0 * deg}};
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
    for (int k = 0; k < 3; k++)
        if (!pair_ok(d->length[k])) return false;
    if (d->nodes[0] < 2 || d->nodes[1] < 2 || d->nodes[0] > 1024 || d->nodes[1] > 1024) return false;
    /* Layouts, joints and braces beyond the plain post grid have no builder here. */
    return d->layout == MORPH_LAYOUT_POSTS && d->joints == MORPH_JOINTS_BALL &&
           d->bracing == MORPH_BRACING_NONE && pair_ok(d->link_post) && pair_ok(d->link_link);
}

static void count(morph_structure *s) {
    const int nx = s->nx, ny = s->ny;
    s->joints = 2 * nx * ny;
    s->posts = nx * ny;
    s->links = 2 * (2 * nx * ny - nx - ny);
    s->link_posts = 2 * s->links;
    s->link_links = 2 * 4 * (nx - 1) * (ny - 1);
    s->skin_triangles = 2 * (nx - 1) * (ny - 1);
    s->panels = 0;
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
           (s->start = morph_alloc(3 * j, sizeof(double)));
}

static int joint_at(const morph_structure *s, int layer, int i, int j) {
    return (layer * s->ny + j) * s->nx + i;
}

static void place_joints(morph_structure *s) {
    for (int layer = 0; layer < 2; layer++)
        for (int j = 0; j < s->ny; j++)
            for (int i = 0; i < s->nx; i++) {
                const int n = joint_at(s, layer, i, j);
                s->joint_layer[n] = layer;
                s->joint_node[n][0] = i;
                s->joint_node[n][1] = j;
                s->start[3 * n] = (i - 0.5 * (s->nx - 1)) * s->spacing;
                s->start[3 * n + 1] = (j - 0.5 * (s->ny - 1)) * s->spacing;
                s->start[3 * n + 2] = layer * s->def.thickness;
            }
    for (int p = 0; p < s->posts; p++) {
        s->post[p][0] = p;
        s->post[p][1] = p + s->posts;
        s->post_length[p] = s->def.thickness;
    }
}

static void add_link(morph_structure *s, int *n, int a, int b, int kind) {
    const morph_structure_def *d = &s->def;
    const int l = (*n)++;
    s->link[l][0] = a;
    s->link[l][1] = b;
    s->link_kind[l] = kind;
    s->start_length[l] = morph_dist(&s->start[3 * a], &s->start[3 * b]);
    s->length_limit[l][0] = d->length[kind][0];
    s->length_limit[l][1] = d->length[kind][1];
    s->rate_limit[l] = d->rate;
    s->acceleration_limit[l] = d->acceleration;
    s->jerk_limit[l] = d->jerk;
    s->link_radius[l] = d->radius;
}

/* x_link[n], y_link[n]: the link that leaves joint n towards larger x or y, -1 at the border. */
static void place_links(morph_structure *s, int *x_link, int *y_link) {
    int n = 0;
    for (int layer = 0; layer < 2; layer++)
        for (int j = 0; j < s->ny; j++)
            for (int i = 0; i < s->nx; i++) {
                const int a = joint_at(s, layer, i, j);
                x_link[a] = y_link[a] = -1;
                if (i + 1 < s->nx) {
                    x_link[a] = n;
                    add_link(s, &n, a, joint_at(s, layer, i + 1, j), layer);
                }
                if (j + 1 < s->ny) {
                    y_link[a] = n;
                    add_link(s, &n, a, joint_at(s, layer, i, j + 1), layer);
                }
            }
}

static void add_corner(morph_structure *s, int *n, int joint, int link_a, int link_b) {
    const int t = (*n)++;
    s->link_link[t][0] = link_a;
    s->link_link[t][1] = link_b;
    s->link_link_joint[t] = joint;
    s->link_link_limit[t][0] = s->def.link_link[0];
    s->link_link_limit[t][1] = s->def.link_link[1];
}

static void place_angles(morph_structure *s, const int *x_link, const int *y_link) {
    for (int l = 0, t = 0; l < s->links; l++)
        for (int end = 0; end < 2; end++, t++) {
            s->link_post[t][0] = l;
            s->link_post[t][1] = s->link[l][end] % s->posts;
            s->link_post_limit[t][0] = s->def.link_post[0];
            s->link_post_limit[t][1] = s->def.link_post[1];
        }
    int t = 0;
    for (int layer = 0; layer < 2; layer++)
        for (int j = 0; j + 1 < s->ny; j++)
            for (int i = 0; i + 1 < s->nx; i++) {
                /* The cell's four links: near x, far x (y + 1), left y, right y (x + 1). */
                const int a = joint_at(s, layer, i, j), b = joint_at(s, layer, i + 1, j);
                const int c = joint_at(s, layer, i, j + 1), d = joint_at(s, layer, i + 1, j + 1);
                add_corner(s, &t, a, x_link[a], y_link[a]);
                add_corner(s, &t, b, x_link[a], y_link[b]);
                add_corner(s, &t, c, x_link[c], y_link[a]);
                add_corner(s, &t, d, x_link[c], y_link[b]);
            }
}

static void place_skin(morph_structure *s) {
    int t = 0;
    for (int j = 0; j + 1 < s->ny; j++)
        for (int i = 0; i + 1 < s->nx; i++) {
            const int a = joint_at(s, 0, i, j), b = joint_at(s, 0, i + 1, j);
            const int c = joint_at(s, 0, i, j + 1), d = joint_at(s, 0, i + 1, j + 1);
            /* Diagonals run around the middle of the grid. A sheet that drapes over a bump shears its cells
             * so that they grow long towards the middle: the diagonal across that is the short one, and
             * triangles on it lie closer to what is beneath. */
            const bool falling = (2 * i + 2 - s->nx) * (2 * j + 2 - s->ny) > 0;
            const int even[2][3] = {{a, b, d}, {a, d, c}}, odd[2][3] = {{a, b, c}, {b, d, c}};
            for (int k = 0; k < 2; k++, t++)
                for (int m = 0; m < 3; m++)
                    s->skin[t][m] = falling ? odd[k][m] : even[k][m];
        }
}

morph_status morph_structure_create(const morph_structure_def *def, morph_structure **out) {
    *out = NULL;
    if (!def_ok(def)) return MORPH_ERR_INPUT;
    morph_structure *s = calloc(1, sizeof *s);
    if (!s) return MORPH_ERR_NOMEM;
    s->def = *def;
    s->nx = def->nodes[0];
    s->ny = def->nodes[1];
    s->spacing = def->spacing;
    count(s);
    int *x_link = morph_alloc((size_t)s->joints, sizeof(int));
    int *y_link = morph_alloc((size_t)s->joints, sizeof(int));
    const bool ok = allocate(s) && x_link && y_link;
    if (ok) {
        place_joints(s);
        place_links(s, x_link, y_link);
        place_angles(s, x_link, y_link);
        place_skin(s);
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
