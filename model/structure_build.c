#include "model/structure_build.h"

void morph_layer_nodes(const morph_structure_def *def, int layer, int nodes[2]) {
    const int less = def->layout == MORPH_LAYOUT_OFFSET && layer == 0 ? 1 : 0;
    nodes[0] = def->nodes[0] - less;
    nodes[1] = def->nodes[1] - less;
}

int morph_node_joint(const morph_structure_def *def, int layer, int i, int j) {
    int n[2], below[2];
    morph_layer_nodes(def, layer, n);
    morph_layer_nodes(def, 0, below);
    if (i < 0 || j < 0 || i >= n[0] || j >= n[1]) return -1;
    return layer * below[0] * below[1] + j * n[0] + i;
}

void morph_joint_place(const morph_structure_def *def, int joint, int *layer, int node[2]) {
    int n[2];
    morph_layer_nodes(def, 0, n);
    *layer = joint >= n[0] * n[1] ? 1 : 0;
    if (*layer) joint -= n[0] * n[1];
    morph_layer_nodes(def, *layer, n);
    node[0] = joint % n[0];
    node[1] = joint / n[0];
}

static int grid_links(const int n[2]) {
    return 2 * n[0] * n[1] - n[0] - n[1];
}

static int cells(const int n[2]) {
    return (n[0] - 1) * (n[1] - 1);
}

static int braces(const morph_structure_def *def) {
    int n[2];
    morph_layer_nodes(def, 0, n);
    if (def->layout == MORPH_LAYOUT_OFFSET) return 4 * n[0] * n[1];
    if (def->bracing == MORPH_BRACING_NONE) return 0;
    return grid_links(n) + (def->bracing == MORPH_BRACING_FULL ? 2 * cells(n) : 0);
}

int morph_link_count(const morph_structure_def *def) {
    int bottom[2], top[2];
    morph_layer_nodes(def, 0, bottom);
    morph_layer_nodes(def, 1, top);
    return grid_links(bottom) + grid_links(top) + braces(def);
}

void morph_structure_count(morph_structure *s) {
    const morph_structure_def *def = &s->def;
    for (int layer = 0; layer < 2; layer++)
        morph_layer_nodes(def, layer, s->layer_nodes[layer]);
    const int *bottom = s->layer_nodes[0], *top = s->layer_nodes[1];
    const bool posts = def->layout == MORPH_LAYOUT_POSTS;
    s->joints = bottom[0] * bottom[1] + top[0] * top[1];
    s->posts = posts ? bottom[0] * bottom[1] : 0;
    s->links = morph_link_count(def);
    s->link_posts = posts ? 2 * (grid_links(bottom) + grid_links(top)) : 0;
    s->link_links = 4 * (cells(bottom) + cells(top));
    s->skin_triangles = 2 * cells(bottom);
    s->panels = def->joints == MORPH_JOINTS_UNIVERSAL ? grid_links(bottom) : 0;
}

static void place_joints(morph_structure *s) {
    for (int layer = 0; layer < 2; layer++) {
        const int *n = s->layer_nodes[layer];
        for (int j = 0; j < n[1]; j++)
            for (int i = 0; i < n[0]; i++) {
                const int a = morph_node_joint(&s->def, layer, i, j);
                s->joint_layer[a] = layer;
                s->joint_node[a][0] = i;
                s->joint_node[a][1] = j;
                /* Each layer is centred: the smaller grid then lies under the middles of the larger's cells.
                 */
                s->start[3 * a] = (i - 0.5 * (n[0] - 1)) * s->spacing;
                s->start[3 * a + 1] = (j - 0.5 * (n[1] - 1)) * s->spacing;
                s->start[3 * a + 2] = layer * s->def.thickness;
            }
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
    /* Braces start at several lengths: their limits are factors. */
    const double unit = kind == MORPH_LINK_BRACE ? s->start_length[l] : 1.0;
    s->length_limit[l][0] = d->length[kind][0] * unit;
    s->length_limit[l][1] = d->length[kind][1] * unit;
    s->rate_limit[l] = d->rate;
    s->acceleration_limit[l] = d->acceleration;
    s->jerk_limit[l] = d->jerk;
    s->link_radius[l] = d->radius;
}

static void place_grid_links(morph_structure *s, int *n, int *x_link, int *y_link) {
    for (int a = 0; a < s->joints; a++) {
        const int layer = s->joint_layer[a], i = s->joint_node[a][0], j = s->joint_node[a][1];
        const int x = morph_node_joint(&s->def, layer, i + 1, j);
        const int y = morph_node_joint(&s->def, layer, i, j + 1);
        x_link[a] = x < 0 ? -1 : *n;
        if (x >= 0) add_link(s, n, a, x, layer);
        y_link[a] = y < 0 ? -1 : *n;
        if (y >= 0) add_link(s, n, a, y, layer);
    }
}

/* One diagonal per side panel, from the bottom of one post to the top of the other, the other way round from
 * panel to panel along a grid line. */
static void place_webs(morph_structure *s, int *n) {
    const int panels = grid_links(s->layer_nodes[0]);
    for (int l = 0; l < panels; l++) {
        const int a = s->link[l][0], b = s->link[l][1];
        const bool rising = (s->joint_node[a][0] + s->joint_node[a][1]) % 2 == 0;
        add_link(s, n, rising ? a : b, (rising ? b : a) + s->posts, MORPH_LINK_BRACE);
    }
}

/* Diagonals run around the middle of the grid. A sheet that drapes over a bump shears its cells so that they
 * grow long towards the middle: the diagonal across that is the short one, and triangles on it lie closer to
 * what is beneath. True: from (i+1,j) to (i,j+1); false: from (i,j) to (i+1,j+1). */
static bool falling(const int n[2], int i, int j) {
    return (2 * i + 2 - n[0]) * (2 * j + 2 - n[1]) > 0;
}

/* The same diagonals in both layers: those of the skin, so that its edges are links. */
static void place_cell_braces(morph_structure *s, int *n) {
    for (int layer = 0; layer < 2; layer++) {
        const int *nodes = s->layer_nodes[layer];
        for (int j = 0; j + 1 < nodes[1]; j++)
            for (int i = 0; i + 1 < nodes[0]; i++) {
                const int f = falling(nodes, i, j) ? 1 : 0;
                add_link(s, n, morph_node_joint(&s->def, layer, i + f, j),
                         morph_node_joint(&s->def, layer, i + 1 - f, j + 1), MORPH_LINK_BRACE);
            }
    }
}

static void place_offset_webs(morph_structure *s, int *n) {
    const int bottom = s->layer_nodes[0][0] * s->layer_nodes[0][1];
    for (int a = 0; a < bottom; a++)
        for (int corner = 0; corner < 4; corner++)
            add_link(s, n, a,
                     morph_node_joint(&s->def, 1, s->joint_node[a][0] + corner % 2,
                                      s->joint_node[a][1] + corner / 2),
                     MORPH_LINK_BRACE);
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
    for (int t = 0; t < s->link_posts; t++) {
        s->link_post[t][0] = t / 2;
        s->link_post[t][1] = s->link[t / 2][t % 2] % s->posts;
        s->link_post_limit[t][0] = s->def.link_post[0];
        s->link_post_limit[t][1] = s->def.link_post[1];
    }
    int t = 0;
    for (int layer = 0; layer < 2; layer++)
        for (int j = 0; j + 1 < s->layer_nodes[layer][1]; j++)
            for (int i = 0; i + 1 < s->layer_nodes[layer][0]; i++) {
                /* The cell's four links: near x, far x (y + 1), left y, right y (x + 1). */
                const int a = morph_node_joint(&s->def, layer, i, j);
                const int b = morph_node_joint(&s->def, layer, i + 1, j);
                const int c = morph_node_joint(&s->def, layer, i, j + 1);
                const int d = morph_node_joint(&s->def, layer, i + 1, j + 1);
                add_corner(s, &t, a, x_link[a], y_link[a]);
                add_corner(s, &t, b, x_link[a], y_link[b]);
                add_corner(s, &t, c, x_link[c], y_link[a]);
                add_corner(s, &t, d, x_link[c], y_link[b]);
            }
}

static void place_skin(morph_structure *s) {
    const int *n = s->layer_nodes[0];
    int t = 0;
    for (int j = 0; j + 1 < n[1]; j++)
        for (int i = 0; i + 1 < n[0]; i++) {
            const int a = j * n[0] + i, b = a + 1, c = a + n[0], d = c + 1;
            const int even[2][3] = {{a, b, d}, {a, d, c}}, odd[2][3] = {{a, b, c}, {b, d, c}};
            for (int k = 0; k < 2; k++, t++)
                for (int m = 0; m < 3; m++)
                    s->skin[t][m] = falling(n, i, j) ? odd[k][m] : even[k][m];
        }
}

void morph_structure_place(morph_structure *s, int *x_link, int *y_link) {
    int n = 0;
    place_joints(s);
    place_grid_links(s, &n, x_link, y_link);
    if (s->def.layout == MORPH_LAYOUT_OFFSET) place_offset_webs(s, &n);
    if (s->def.bracing != MORPH_BRACING_NONE) place_webs(s, &n);
    if (s->def.bracing == MORPH_BRACING_FULL) place_cell_braces(s, &n);
    place_angles(s, x_link, y_link);
    place_skin(s);
    for (int q = 0; q < s->panels; q++)
        for (int k = 0; k < 2; k++)
            s->panel[q][k] = s->link[q][k];
}
