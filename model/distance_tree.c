/* Building the bounding volume tree of a mesh: binned surface area heuristic, flat arrays. */
#include "model/distance_internal.h"

#include <stdlib.h>

enum {
    BINS = 16,
    LEAF = 3, /* slots per leaf at most */
    SAH_DEPTH =
        56, /* deeper nodes split at the median: 56 + 31 levels < MORPH_TREE_STACK for any int count */
};

typedef struct box {
    double lo[3], hi[3];
} box;

typedef struct item {
    box box;
    double centre[3];
    int triangle;
} item;

typedef struct builder {
    morph_distance *d;
    item *item;
} builder;

static box box_empty(void) {
    return (box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static void box_add(box *a, const box *b) {
    for (int k = 0; k < 3; k++) {
        if (b->lo[k] < a->lo[k]) a->lo[k] = b->lo[k];
        if (b->hi[k] > a->hi[k]) a->hi[k] = b->hi[k];
    }
}

/* Half the surface; 0 for an empty box. */
static double box_area(const box *b) {
    const double x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
    return x >= 0 ? x * y + y * z + z * x : 0;
}

static int bin_of(double centre, double lo, double scale) {
    const int bin = (int)((centre - lo) * scale);
    return bin < BINS ? bin : BINS - 1;
}

/* Cost of the best split of items [first, last) along axis: sum of area times count; *split is the last bin
 * of the left side. INFINITY if all centres fall into one bin. */
static double split_cost(const builder *b, int first, int last, int axis, double lo, double scale,
                         int *split) {
    box bins[BINS];
    int count[BINS] = {0};
    for (int k = 0; k < BINS; k++)
        bins[k] = box_empty();
    for (int i = first; i < last; i++) {
        const int bin = bin_of(b->item[i].centre[axis], lo, scale);
        box_add(&bins[bin], &b->item[i].box);
        count[bin]++;
    }
    double right_cost[BINS];
    int right_count[BINS];
    box right = box_empty();
    for (int k = BINS - 1, n = 0; k > 0; k--) {
        box_add(&right, &bins[k]);
        n += count[k];
        right_cost[k] = box_area(&right) * n;
        right_count[k] = n;
    }
    double best = INFINITY;
    box left = box_empty();
    for (int k = 0, n = 0; k < BINS - 1; k++) {
        box_add(&left, &bins[k]);
        n += count[k];
        if (n == 0 || right_count[k + 1] == 0) continue;
        const double cost = box_area(&left) * n + right_cost[k + 1];
        if (cost < best) {
            best = cost;
            *split = k;
        }
    }
    return best;
}

static int compare_axis(const item *a, const item *b, int axis) {
    if (a->centre[axis] != b->centre[axis]) return a->centre[axis] < b->centre[axis] ? -1 : 1;
    return (a->triangle > b->triangle) - (a->triangle < b->triangle);
}
static int compare_x(const void *a, const void *b) {
    return compare_axis(a, b, 0);
}
static int compare_y(const void *a, const void *b) {
    return compare_axis(a, b, 1);
}
static int compare_z(const void *a, const void *b) {
    return compare_axis(a, b, 2);
}

/* Halves [first, last) by order along the axis of largest extent of the centres. */
static int split_median(builder *b, int first, int last, const box *centres) {
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (centres->hi[k] - centres->lo[k] > centres->hi[axis] - centres->lo[axis]) axis = k;
    int (*const compare[3])(const void *, const void *) = {compare_x, compare_y, compare_z};
    qsort(b->item + first, (size_t)(last - first), sizeof *b->item, compare[axis]);
    return first + (last - first) / 2;
}

/* Splits [first, last), at least two items, and returns the first of the right side: both are non-empty. */
static int split(builder *b, int first, int last, int depth) {
    box centres = box_empty();
    for (int i = first; i < last; i++) {
        box at;
        for (int k = 0; k < 3; k++)
            at.lo[k] = at.hi[k] = b->item[i].centre[k];
        box_add(&centres, &at);
    }
    int best_axis = -1, best_bin = 0;
    double best = INFINITY, best_scale = 0;
    for (int axis = 0; depth < SAH_DEPTH && axis < 3; axis++) {
        const double scale = BINS / (centres.hi[axis] - centres.lo[axis]);
        if (!isfinite(scale)) continue;
        int bin = 0;
        const double cost = split_cost(b, first, last, axis, centres.lo[axis], scale, &bin);
        if (cost < best) {
            best = cost;
            best_axis = axis;
            best_bin = bin;
            best_scale = scale;
        }
    }
    if (best_axis < 0) return split_median(b, first, last, &centres);
    int mid = first;
    for (int i = first; i < last; i++) {
        if (bin_of(b->item[i].centre[best_axis], centres.lo[best_axis], best_scale) > best_bin) continue;
        const item swap = b->item[i];
        b->item[i] = b->item[mid];
        b->item[mid++] = swap;
    }
    return mid;
}

/* Area-weighted centre and total area vector of the slots, and the radius that holds them all. */
static void dipole_of(const builder *b, int first, int last, morph_dipole *out) {
    const morph_mesh *mesh = &b->d->mesh;
    double area_sum = 0, mean[3] = {0};
    *out = (morph_dipole){0};
    for (int i = first; i < last; i++) {
        const int *t = mesh->t + 3 * (size_t)b->item[i].triangle;
        const double *p = mesh->v + 3 * (size_t)t[0], *q = mesh->v + 3 * (size_t)t[1],
                     *r = mesh->v + 3 * (size_t)t[2];
        double u[3], v[3], n[3];
        morph_sub(q, p, u);
        morph_sub(r, p, v);
        morph_cross(u, v, n);
        const double area = morph_norm(n) / 2;
        area_sum += area;
        for (int k = 0; k < 3; k++) {
            out->area[k] += n[k] / 2;
            out->centre[k] += area * ((p[k] + q[k] + r[k]) / 3);
            mean[k] += (p[k] + q[k] + r[k]) / 3;
        }
    }
    for (int k = 0; k < 3; k++)
        out->centre[k] = area_sum > 0 ? out->centre[k] / area_sum : mean[k] / (last - first);
    for (int i = first; i < last; i++)
        for (int k = 0; k < 3; k++) {
            const int vertex = mesh->t[3 * (size_t)b->item[i].triangle + (size_t)k];
            out->radius = fmax(out->radius, morph_dist(mesh->v + 3 * (size_t)vertex, out->centre));
        }
}

static int build_node(builder *b, int first, int last, int depth);

static void build_child(builder *b, int node, int side, int first, int last, int depth) {
    box bounds = box_empty();
    for (int i = first; i < last; i++)
        box_add(&bounds, &b->item[i].box);
    morph_tree_node *n = &b->d->node[node];
    for (int k = 0; k < 3; k++) {
        n->lo[side][k] = bounds.lo[k];
        n->hi[side][k] = bounds.hi[k];
    }
    dipole_of(b, first, last, &b->d->dipole[node][side]);
    if (last - first <= LEAF) {
        n->child[side] = first;
        n->count[side] = last - first;
    } else {
        n->child[side] = build_node(b, first, last, depth + 1);
        n->count[side] = 0;
    }
}

static int build_node(builder *b, int first, int last, int depth) {
    const int node = b->d->nodes++;
    const int mid = split(b, first, last, depth);
    build_child(b, node, 0, first, mid, depth);
    build_child(b, node, 1, mid, last, depth);
    return node;
}

/* A mesh of one triangle: a root with one leaf and one absent child. */
static void build_single(builder *b) {
    morph_tree_node *n = &b->d->node[b->d->nodes++];
    build_child(b, 0, 0, 0, 1, 0);
    for (int k = 0; k < 3; k++) {
        n->lo[1][k] = INFINITY;
        n->hi[1][k] = -INFINITY;
    }
}

static void fill_items(builder *b) {
    morph_distance *d = b->d;
    box whole = box_empty();
    for (int i = 0; i < d->mesh.triangles; i++) {
        item *it = &b->item[i];
        it->triangle = i;
        it->box = box_empty();
        for (int j = 0; j < 3; j++) {
            const double *v = d->mesh.v + 3 * (size_t)d->mesh.t[3 * (size_t)i + (size_t)j];
            box at;
            for (int k = 0; k < 3; k++)
                at.lo[k] = at.hi[k] = v[k];
            box_add(&it->box, &at);
        }
        for (int k = 0; k < 3; k++)
            it->centre[k] = it->box.lo[k] / 2 + it->box.hi[k] / 2;
        box_add(&whole, &it->box);
    }
    for (int k = 0; k < 3; k++) {
        d->lo[k] = whole.lo[k];
        d->hi[k] = whole.hi[k];
        d->reach = fmax(d->reach, fmax(fabs(whole.lo[k]), fabs(whole.hi[k])));
    }
}

static void fill_facet(const morph_mesh *mesh, int triangle, morph_facet *f) {
    f->triangle = triangle;
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++)
            f->corner[j][k] = mesh->v[3 * (size_t)mesh->t[3 * (size_t)triangle + (size_t)j] + (size_t)k];
    double u[3], v[3];
    morph_sub(f->corner[1], f->corner[0], u);
    morph_sub(f->corner[2], f->corner[0], v);
    morph_cross(u, v, f->normal);
    const double squared = morph_dot(f->normal, f->normal);
    /* Below the rounding of the cross product a normal points anywhere: the edges say all there is. */
    const double floor = 1e-28 * morph_dot(u, u) * morph_dot(v, v);
    f->inverse = squared > floor && isfinite(1 / squared) ? 1 / squared : 0;
}

morph_status morph_tree_build(morph_distance *d) {
    const size_t n = (size_t)d->mesh.triangles;
    builder b = {d, morph_alloc(n, sizeof *b.item)};
    d->node = morph_alloc(n, sizeof *d->node); /* n leaves at most: n - 1 nodes, 1 for a single leaf */
    d->dipole = morph_alloc(n, sizeof *d->dipole);
    d->facet = morph_alloc(n, sizeof *d->facet);
    if (!b.item || !d->node || !d->dipole || !d->facet) {
        free(b.item);
        return MORPH_ERR_NOMEM;
    }
    fill_items(&b);
    if (n == 1)
        build_single(&b);
    else
        build_node(&b, 0, (int)n, 0);
    for (size_t i = 0; i < n; i++)
        fill_facet(&d->mesh, b.item[i].triangle, &d->facet[i]);
    free(b.item);
    return MORPH_OK;
}
