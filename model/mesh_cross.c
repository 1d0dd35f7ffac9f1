/* A bounding volume tree over the triangles; which of them cross; what a ray meets. */
#include "model/mesh_private.h"

#include <stdint.h>
#include <stdlib.h>

enum { LEAF = 4 };

/* ---- tree ---- */

typedef struct keyed {
    uint64_t key;
    int triangle;
} keyed;

static int by_key(const void *a, const void *b) {
    const keyed *p = a, *q = b;
    if (p->key != q->key) return p->key < q->key ? -1 : 1;
    return (p->triangle > q->triangle) - (p->triangle < q->triangle);
}

/* Spreads the low 21 bits of x to every third bit. */
static uint64_t spread(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

static uint64_t morton(const morph_mesh *mesh, int f, const double lo[3], double scale) {
    uint64_t key = 0;
    for (int k = 0; k < 3; k++) {
        double c = 0;
        for (int i = 0; i < 3; i++)
            c += mesh->v[3 * mesh->t[3 * f + i] + k] - lo[k];
        key |= spread((uint64_t)(c * scale)) << k;
    }
    return key;
}

static void triangle_box(const morph_mesh *mesh, int f, double box[6]) {
    for (int k = 0; k < 3; k++) {
        const double a = mesh->v[3 * mesh->t[3 * f] + k], b = mesh->v[3 * mesh->t[3 * f + 1] + k],
                     c = mesh->v[3 * mesh->t[3 * f + 2] + k];
        box[k] = fmin(a, fmin(b, c));
        box[3 + k] = fmax(a, fmax(b, c));
    }
}

static void grow(double box[6], const double by[6]) {
    for (int k = 0; k < 3; k++) {
        box[k] = fmin(box[k], by[k]);
        box[3 + k] = fmax(box[3 + k], by[3 + k]);
    }
}

/* Halves ranges top down (children stand after their parent), then boxes bottom up. */
static void fill_nodes(const morph_mesh *mesh, morph_mesh_tree *tree) {
    tree->span[0][0] = 0;
    tree->span[0][1] = mesh->triangles;
    tree->nodes = 1;
    for (int n = 0; n < tree->nodes; n++) {
        const int b = tree->span[n][0], e = tree->span[n][1];
        tree->child[n][0] = tree->child[n][1] = -1;
        if (e - b <= LEAF) continue;
        const int ends[3] = {b, b + (e - b) / 2, e};
        for (int side = 0; side < 2; side++) {
            const int c = tree->nodes++;
            tree->child[n][side] = c;
            tree->span[c][0] = ends[side];
            tree->span[c][1] = ends[side + 1];
        }
    }
    for (int n = tree->nodes - 1; n >= 0; n--) {
        for (int k = 0; k < 3; k++) {
            tree->box[n][k] = INFINITY;
            tree->box[n][3 + k] = -INFINITY;
        }
        if (tree->child[n][0] >= 0) {
            grow(tree->box[n], tree->box[tree->child[n][0]]);
            grow(tree->box[n], tree->box[tree->child[n][1]]);
            continue;
        }
        for (int i = tree->span[n][0]; i < tree->span[n][1]; i++) {
            double box[6];
            triangle_box(mesh, tree->order[i], box);
            grow(tree->box[n], box);
        }
    }
}

morph_status morph_mesh_tree_build(const morph_mesh *mesh, morph_mesh_tree *out) {
    *out = (morph_mesh_tree){0};
    const size_t n = (size_t)mesh->triangles;
    /* Halving ranges of more than LEAF = 4 leaves at least two triangles in each leaf: below n + 1 nodes. */
    const size_t most = n + 1;
    morph_mesh_tree tree = {0};
    keyed *keys = morph_alloc(n, sizeof *keys);
    tree.box = morph_alloc(most, sizeof *tree.box);
    tree.span = morph_alloc(most, sizeof *tree.span);
    tree.child = morph_alloc(most, sizeof *tree.child);
    tree.order = morph_alloc(n, sizeof *tree.order);
    if (!keys || !tree.box || !tree.span || !tree.child || !tree.order) {
        free(keys);
        morph_mesh_tree_free(&tree);
        return MORPH_ERR_NOMEM;
    }
    double lo[3], hi[3], extent = 0;
    morph_mesh_bounds(mesh, lo, hi);
    for (int k = 0; k < 3; k++)
        extent = fmax(extent, hi[k] - lo[k]);
    const double scale = extent > 0 ? 2097151.0 / (3 * extent) : 0;
    for (size_t f = 0; f < n; f++)
        keys[f] = (keyed){morton(mesh, (int)f, lo, scale), (int)f};
    if (n > 1) qsort(keys, n, sizeof *keys, by_key);
    for (size_t f = 0; f < n; f++)
        tree.order[f] = keys[f].triangle;
    free(keys);
    fill_nodes(mesh, &tree);
    *out = tree;
    return MORPH_OK;
}

void morph_mesh_tree_free(morph_mesh_tree *tree) {
    free(tree->box);
    free(tree->span);
    free(tree->child);
    free(tree->order);
    *tree = (morph_mesh_tree){0};
}

/* ---- crossings ---- */

/* Distances of triangle g's corners to the plane of f; those within eps count as on it. True if corners lie
 * on both sides. */
static bool straddles(const morph_mesh *mesh, const double n[3], const double *on, const int *g, double eps,
                      double d[3]) {
    bool above = false, below = false;
    for (int i = 0; i < 3; i++) {
        double r[3];
        morph_sub(mesh->v + 3 * g[i], on, r);
        d[i] = morph_dot(n, r);
        if (fabs(d[i]) <= eps) d[i] = 0;
        above = above || d[i] > 0;
        below = below || d[i] < 0;
    }
    return above && below;
}

/* Where the other's plane cuts triangle g, along the line `dir`: an interval. d as from straddles. */
static void cut(const morph_mesh *mesh, const int *g, const double d[3], const double dir[3],
                const double origin[3], double range[2]) {
    double s[3];
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (int i = 0; i < 3; i++) {
        double r[3];
        morph_sub(mesh->v + 3 * g[i], origin, r);
        s[i] = morph_dot(dir, r);
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        double at = s[i];
        if (d[i] * d[j] < 0)
            at = s[i] + (s[j] - s[i]) * (d[i] / (d[i] - d[j]));
        else if (d[i] != 0)
            continue;
        range[0] = fmin(range[0], at);
        range[1] = fmax(range[1], at);
    }
}

/* The interval test of Moeller (1997): two triangles cross where each has corners on both sides of the
 * other's plane and their cuts on the common line overlap. Touching and lying in one plane do not count. */
static bool cross(const morph_mesh *mesh, int f, int g, double eps) {
    const int *a = mesh->t + 3 * f, *b = mesh->t + 3 * g;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (a[i] == b[j]) return false;
    double na[3], nb[3], da[3], db[3], dir[3], ra[2], rb[2];
    morph_mesh_normal(mesh, f, na);
    morph_mesh_normal(mesh, g, nb);
    const double la = morph_norm(na), lb = morph_norm(nb);
    if (!(la > 0) || !(lb > 0)) return false;
    for (int k = 0; k < 3; k++) {
        na[k] /= la;
        nb[k] /= lb;
    }
    const double *origin = mesh->v + 3 * a[0];
    if (!straddles(mesh, na, origin, b, eps, db)) return false;
    if (!straddles(mesh, nb, mesh->v + 3 * b[0], a, eps, da)) return false;
    morph_cross(na, nb, dir);
    const double length = morph_norm(dir);
    if (!(length > 0)) return false;
    for (int k = 0; k < 3; k++)
        dir[k] /= length;
    cut(mesh, a, da, dir, origin, ra);
    cut(mesh, b, db, dir, origin, rb);
    return fmin(ra[1], rb[1]) - fmax(ra[0], rb[0]) > eps;
}

static bool overlap(const double a[6], const double b[6]) {
    return a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] && b[2] <= a[5];
}

/* Pairs of two leaves, or within one. */
static int cross_leaves(const morph_mesh *mesh, const morph_mesh_tree *tree, int m, int n, double eps,
                        const int *label, bool *crossed) {
    int count = 0;
    for (int i = tree->span[m][0]; i < tree->span[m][1]; i++) {
        double box[6], other[6];
        triangle_box(mesh, tree->order[i], box);
        for (int j = m == n ? i + 1 : tree->span[n][0]; j < tree->span[n][1]; j++) {
            const int f = tree->order[i], g = tree->order[j];
            triangle_box(mesh, g, other);
            if (!overlap(box, other) || !cross(mesh, f, g, eps)) continue;
            count++;
            if (label && crossed && label[f] >= 0 && label[g] >= 0 && label[f] != label[g])
                crossed[label[f]] = crossed[label[g]] = true;
        }
    }
    return count;
}

int morph_mesh_crossings(const morph_mesh *mesh, const morph_mesh_tree *tree, const int *label,
                         bool *crossed) {
    if (mesh->triangles < 2) return 0;
    double lo[3], hi[3];
    morph_mesh_bounds(mesh, lo, hi);
    const double eps = 1e-6 * morph_dist(lo, hi);
    /* Depth below 32; each level leaves at most three open pairs. */
    int stack[128][2], top = 0, count = 0;
    long work = 0;
    stack[top][0] = stack[top][1] = 0;
    top++;
    while (top > 0 && count < 1000000 && work < 400000000) {
        top--;
        const int m = stack[top][0], n = stack[top][1];
        work++;
        if (m != n && !overlap(tree->box[m], tree->box[n])) continue;
        const bool leaf_m = tree->child[m][0] < 0, leaf_n = tree->child[n][0] < 0;
        if (leaf_m && leaf_n) {
            work += (tree->span[m][1] - tree->span[m][0]) * (tree->span[n][1] - tree->span[n][0]);
            count += cross_leaves(mesh, tree, m, n, eps, label, crossed);
        } else if (m == n) {
            const int a = tree->child[m][0], b = tree->child[m][1];
            const int pairs[3][2] = {{a, a}, {b, b}, {a, b}};
            for (int i = 0; i < 3; i++, top++) {
                stack[top][0] = pairs[i][0];
                stack[top][1] = pairs[i][1];
            }
        } else {
            /* Descend the wider range. */
            const bool first =
                tree->span[m][1] - tree->span[m][0] >= tree->span[n][1] - tree->span[n][0] && !leaf_m;
            for (int side = 0; side < 2; side++, top++) {
                stack[top][0] = first ? tree->child[m][side] : m;
                stack[top][1] = first ? n : tree->child[n][side];
            }
        }
    }
    return count;
}

/* ---- rays ---- */

static bool ray_box(const double p[3], const double d[3], const double box[6]) {
    double from = 0, to = INFINITY;
    for (int k = 0; k < 3; k++) {
        const double a = (box[k] - p[k]) / d[k], b = (box[3 + k] - p[k]) / d[k];
        from = fmax(from, fmin(a, b));
        to = fmin(to, fmax(a, b));
    }
    return from <= to;
}

/* Solves p + t d = a + u (b - a) + v (c - a) by Cramer's rule (Moeller and Trumbore 1997). */
static bool ray_triangle(const morph_mesh *mesh, int f, const double p[3], const double d[3]) {
    const int *t = mesh->t + 3 * f;
    double e1[3], e2[3], s[3], q[3], r[3];
    morph_sub(mesh->v + 3 * t[1], mesh->v + 3 * t[0], e1);
    morph_sub(mesh->v + 3 * t[2], mesh->v + 3 * t[0], e2);
    morph_sub(p, mesh->v + 3 * t[0], s);
    morph_cross(d, e2, q);
    morph_cross(s, e1, r);
    const double det = morph_dot(e1, q);
    if (det == 0) return false;
    const double u = morph_dot(s, q) / det, v = morph_dot(d, r) / det;
    return u >= 0 && v >= 0 && u + v <= 1 && morph_dot(e2, r) / det > 0;
}

int morph_mesh_ray(const morph_mesh *mesh, const morph_mesh_tree *tree, const double p[3], const double d[3],
                   const int *label, const bool *wanted, int skip) {
    int stack[64], top = 0, count = 0;
    stack[top++] = 0;
    while (top > 0) {
        const int n = stack[--top];
        if (!ray_box(p, d, tree->box[n])) continue;
        if (tree->child[n][0] >= 0) {
            stack[top++] = tree->child[n][0];
            stack[top++] = tree->child[n][1];
            continue;
        }
        for (int i = tree->span[n][0]; i < tree->span[n][1]; i++) {
            const int f = tree->order[i], part = label[f];
            if (part >= 0 && part != skip && wanted[part] && ray_triangle(mesh, f, p, d)) count++;
        }
    }
    return count;
}
