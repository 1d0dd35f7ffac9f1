/* Primitive solids as closed, outward triangle meshes. All vertices lie on the true surface (caps have a
 * centre more, inside the flat). */
#include "model/mesh.h"

#include <stdlib.h>

/* Finer tessellations than this are refused: they would only fill the memory. */
#define MOST_TRIANGLES 4e6

/* A mesh being filled. */
typedef struct builder {
    morph_mesh mesh;
    int v, t; /* used so far */
} builder;

static morph_status begin(builder *b, double vertices, double triangles) {
    *b = (builder){0};
    if (!(triangles <= MOST_TRIANGLES)) return MORPH_ERR_INPUT;
    b->mesh.vertices = (int)vertices;
    b->mesh.triangles = (int)triangles;
    b->mesh.v = morph_alloc(3 * (size_t)b->mesh.vertices, sizeof *b->mesh.v);
    b->mesh.t = morph_alloc(3 * (size_t)b->mesh.triangles, sizeof *b->mesh.t);
    if (b->mesh.v && b->mesh.t) return MORPH_OK;
    morph_mesh_free(&b->mesh);
    return MORPH_ERR_NOMEM;
}

/* Counts that do not come out as announced are our own bug. */
static morph_status finish(builder *b, morph_mesh *out) {
    if (b->v != b->mesh.vertices || b->t != b->mesh.triangles) {
        morph_mesh_free(&b->mesh);
        return MORPH_ERR_INTERNAL;
    }
    *out = b->mesh;
    return MORPH_OK;
}

static int vertex(builder *b, double x, double y, double z) {
    double *p = b->mesh.v + 3 * b->v;
    p[0] = x;
    p[1] = y;
    p[2] = z;
    return b->v++;
}

static void triangle(builder *b, int i, int j, int k) {
    int *t = b->mesh.t + 3 * b->t++;
    t[0] = i;
    t[1] = j;
    t[2] = k;
}

static bool positive(double x) {
    return x > 0 && isfinite(x);
}

/* cos and sin of a full turn's k-th of n parts; exact at the quarters, and mirrored exactly, so that the
 * bounding box is exactly that of the true shape (n a multiple of 4). */
static void circle(int k, int n, double *c, double *s) {
    const int quarter = n / 4, q = k / quarter % 4, r = k % quarter;
    const double angle = 2 * M_PI * r / n;
    const double x = r == 0 ? 1 : cos(angle), y = r == 0 ? 0 : sin(angle);
    *c = q == 0 ? x : q == 1 ? -y : q == 2 ? -x : y;
    *s = q == 0 ? y : q == 1 ? x : q == 2 ? -y : -x;
}

/* Sides of a regular polygon in a circle of radius r whose sagitta r (1 - cos(pi / n)) is within error: a
 * multiple of 4, at least 8. 1 - cos x <= x^2 / 2 gives n = pi sqrt(r / (2 error)). */
static double sides(double r, double error) {
    return fmax(8, 4 * ceil(0.25 * M_PI * sqrt(r / (2 * error))));
}

morph_status morph_mesh_box(const double size[3], morph_mesh *out) {
    *out = (morph_mesh){0};
    if (!positive(size[0]) || !positive(size[1]) || !positive(size[2])) return MORPH_ERR_INPUT;
    builder b;
    const morph_status status = begin(&b, 8, 12);
    if (status != MORPH_OK) return status;
    for (int i = 0; i < 8; i++)
        vertex(&b, (i & 1 ? 0.5 : -0.5) * size[0], (i & 2 ? 0.5 : -0.5) * size[1],
               (i & 4 ? 0.5 : -0.5) * size[2]);
    static const int face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (int i = 0; i < 6; i++) {
        triangle(&b, face[i][0], face[i][1], face[i][2]);
        triangle(&b, face[i][0], face[i][2], face[i][3]);
    }
    return finish(&b, out);
}

/* ---- sphere-like: rings of 4 i points ---- */

/* Joins ring i (4 i points from `inner`) with ring i + 1 (4 (i + 1) points from `outer`): in each quadrant i
 * triangles with their base on the inner ring and i + 1 on the outer one. up: the inner ring is above. */
static void join_rings(builder *b, int inner, int outer, int i, bool up) {
    const int ni = 4 * i, no = 4 * (i + 1);
    for (int q = 0; q < 4; q++)
        for (int k = 0; k <= i; k++) {
            const int o0 = outer + (q * (i + 1) + k) % no, o1 = outer + (q * (i + 1) + k + 1) % no;
            const int i0 = i == 0 ? inner : inner + (q * i + k) % ni;
            if (up)
                triangle(b, o0, o1, i0);
            else
                triangle(b, o1, o0, i0);
            if (k == i) continue;
            const int i1 = inner + (q * i + k + 1) % ni;
            if (up)
                triangle(b, o1, i1, i0);
            else
                triangle(b, i1, o1, i0);
        }
}

/* Half of a sphere of n rings: pole, rings 1 .. last. Returns the first vertex of the last ring; *start that
 * of the pole. */
static int half_sphere(builder *b, int n, int last, const double r[3], double centre, bool up) {
    int inner = vertex(b, 0, 0, centre + (up ? r[2] : -r[2]));
    for (int i = 1; i <= last; i++) {
        const int outer = b->v;
        const double angle = 0.5 * M_PI * i / n, z = i == n ? 0 : cos(angle), s = i == n ? 1 : sin(angle);
        for (int k = 0; k < 4 * i; k++) {
            double x, y;
            circle(k, 4 * i, &x, &y);
            vertex(b, r[0] * s * x, r[1] * s * y, centre + (up ? r[2] * z : -r[2] * z));
        }
        join_rings(b, inner, outer, i - 1, up);
        inner = outer;
    }
    return inner;
}

/* Rings a quarter. On the unit sphere the distance of a chord triangle is 1 - sqrt(1 - c^2), c its
 * circumradius. The widest triangles stand at the pole: height pi / (2 n), base pi^2 / (4 n), so c = 1.271 /
 * n and the distance 0.808 / n^2 and a little (n >= 2: below 0.95 / n^2). A linear map of the sphere
 * stretches distances at most by the largest radius. */
static double rings(double radius, double error) {
    return fmax(2, ceil(sqrt(0.95 * radius / error)));
}

morph_status morph_mesh_ellipsoid(const double radii[3], double error, morph_mesh *out) {
    *out = (morph_mesh){0};
    if (!positive(radii[0]) || !positive(radii[1]) || !positive(radii[2]) || !positive(error))
        return MORPH_ERR_INPUT;
    const double n = rings(fmax(radii[0], fmax(radii[1], radii[2])), error);
    builder b;
    const morph_status status = begin(&b, 4 * n * n + 2, 8 * n * n);
    if (status != MORPH_OK) return status;
    const int m = (int)n;
    const int equator = half_sphere(&b, m, m, radii, 0, true);
    const int below = half_sphere(&b, m, m - 1, radii, 0, false);
    join_rings(&b, below, equator, m - 1, false);
    return finish(&b, out);
}

/* A belt of quadrilaterals, each two triangles, from a ring of n points to one above it. */
static void belt(builder *b, int lower, int upper, int n) {
    for (int k = 0; k < n; k++) {
        const int l = (k + 1) % n;
        triangle(b, lower + k, lower + l, upper + l);
        triangle(b, lower + k, upper + l, upper + k);
    }
}

morph_status morph_mesh_capsule(double radius, double height, double error, morph_mesh *out) {
    *out = (morph_mesh){0};
    if (!positive(radius) || !positive(height) || !positive(error) || height < 2 * radius)
        return MORPH_ERR_INPUT;
    const double r[3] = {radius, radius, radius}, centre = 0.5 * height - radius;
    if (centre == 0) return morph_mesh_ellipsoid(r, error, out);
    const double n = rings(radius, error);
    builder b;
    const morph_status status = begin(&b, 4 * n * (n + 1) + 2, 8 * n * n + 8 * n);
    if (status != MORPH_OK) return status;
    const int m = (int)n;
    const int upper = half_sphere(&b, m, m, r, centre, true);
    const int lower = half_sphere(&b, m, m, r, -centre, false);
    belt(&b, lower, upper, 4 * m);
    return finish(&b, out);
}

/* ---- round, with flat ends ---- */

static int ring_of(builder *b, double radius, double z, int n) {
    const int first = b->v;
    for (int k = 0; k < n; k++) {
        double x, y;
        circle(k, n, &x, &y);
        vertex(b, radius * x, radius * y, z);
    }
    return first;
}

/* Triangles from a ring to one point, facing up (or down). */
static void fan(builder *b, int ring, int n, int point, bool up) {
    for (int k = 0; k < n; k++) {
        const int l = (k + 1) % n;
        triangle(b, ring + (up ? k : l), ring + (up ? l : k), point);
    }
}

morph_status morph_mesh_cylinder(double radius, double height, double error, morph_mesh *out) {
    *out = (morph_mesh){0};
    if (!positive(radius) || !positive(height) || !positive(error)) return MORPH_ERR_INPUT;
    const double n = sides(radius, error);
    builder b;
    const morph_status status = begin(&b, 2 * n + 2, 4 * n);
    if (status != MORPH_OK) return status;
    const int m = (int)n;
    const int lower = ring_of(&b, radius, -0.5 * height, m), upper = ring_of(&b, radius, 0.5 * height, m);
    belt(&b, lower, upper, m);
    fan(&b, lower, m, vertex(&b, 0, 0, -0.5 * height), false);
    fan(&b, upper, m, vertex(&b, 0, 0, 0.5 * height), true);
    return finish(&b, out);
}

/* The sides' distance to the true cone is the base's sagitta times the cosine of the half opening. */
morph_status morph_mesh_cone(double radius, double height, double error, morph_mesh *out) {
    *out = (morph_mesh){0};
    if (!positive(radius) || !positive(height) || !positive(error)) return MORPH_ERR_INPUT;
    const double n = sides(radius, error);
    builder b;
    const morph_status status = begin(&b, n + 2, 2 * n);
    if (status != MORPH_OK) return status;
    const int m = (int)n, ring = ring_of(&b, radius, -0.5 * height, m);
    fan(&b, ring, m, vertex(&b, 0, 0, -0.5 * height), false);
    fan(&b, ring, m, vertex(&b, 0, 0, 0.5 * height), true);
    return finish(&b, out);
}

/* Radius of the circle, of the tube. The parameter lines are lines of curvature, so the mixed second
 * derivative has no part along the normal, and the distances along both add up: half of the error each. */
morph_status morph_mesh_torus(double radius, double tube, double error, morph_mesh *out) {
    *out = (morph_mesh){0};
    if (!positive(radius) || !positive(tube) || !positive(error) || tube >= radius) return MORPH_ERR_INPUT;
    const double n = sides(radius + tube, 0.5 * error), m = sides(tube, 0.5 * error);
    builder b;
    const morph_status status = begin(&b, n * m, 2 * n * m);
    if (status != MORPH_OK) return status;
    const int nn = (int)n, mm = (int)m;
    for (int j = 0; j < mm; j++) {
        double c, s;
        circle(j, mm, &c, &s);
        ring_of(&b, radius + tube * c, tube * s, nn);
    }
    for (int j = 0; j < mm; j++)
        belt(&b, j * nn, (j + 1) % mm * nn, nn);
    return finish(&b, out);
}

/* ---- height map ---- */

/* The rim's i-th vertex of the top grid, counter-clockwise seen from above, from the near left corner. */
static int rim_vertex(int i, int rows, int columns) {
    const int w = columns - 1, h = rows - 1;
    if (i < w) return h * columns + i;
    if (i < w + h) return (h - (i - w)) * columns + w;
    if (i < 2 * w + h) return w - (i - w - h);
    return (i - 2 * w - h) * columns;
}

/* Each cell of the top is split along the diagonal of less height difference: it follows ridges. */
static void height_top(builder *b, int rows, int columns) {
    for (int r = 0; r + 1 < rows; r++)
        for (int c = 0; c + 1 < columns; c++) {
            const int far_left = r * columns + c, far_right = far_left + 1;
            const int near_left = far_left + columns, near_right = near_left + 1;
            const double *v = b->mesh.v;
            if (fabs(v[3 * near_left + 2] - v[3 * far_right + 2]) <=
                fabs(v[3 * near_right + 2] - v[3 * far_left + 2])) {
                triangle(b, near_left, near_right, far_right);
                triangle(b, near_left, far_right, far_left);
            } else {
                triangle(b, near_left, near_right, far_left);
                triangle(b, near_right, far_right, far_left);
            }
        }
}

morph_status morph_mesh_heightmap(const double *z, int rows, int columns, double cell, double floor,
                                  morph_mesh *out) {
    *out = (morph_mesh){0};
    if (rows < 2 || columns < 2 || !positive(cell) || !isfinite(floor)) return MORPH_ERR_INPUT;
    const double cells = (double)(rows - 1) * (columns - 1), rim = 2.0 * (rows - 1) + 2.0 * (columns - 1);
    builder b;
    const morph_status status = begin(&b, (double)rows * columns + rim + 1, 2 * cells + 3 * rim);
    if (status != MORPH_OK) return status;
    bool finite = true, above = true;
    for (int r = 0; r < rows; r++)
        for (int c = 0; c < columns; c++) {
            const double h = z[(size_t)r * (size_t)columns + (size_t)c];
            finite = finite && isfinite(h);
            above = above && h > floor;
            vertex(&b, (c - 0.5 * (columns - 1)) * cell, (0.5 * (rows - 1) - r) * cell, h);
        }
    if (!finite || !above) {
        morph_mesh_free(&b.mesh);
        return finite ? MORPH_ERR_INPUT : MORPH_ERR_NONFINITE;
    }
    height_top(&b, rows, columns);
    const int n = (int)rim, under = b.v;
    for (int i = 0; i < n; i++) {
        const double *p = b.mesh.v + 3 * rim_vertex(i, rows, columns);
        vertex(&b, p[0], p[1], floor);
    }
    for (int i = 0; i < n; i++) {
        const int j = (i + 1) % n;
        triangle(&b, under + i, under + j, rim_vertex(j, rows, columns));
        triangle(&b, under + i, rim_vertex(j, rows, columns), rim_vertex(i, rows, columns));
    }
    fan(&b, under, n, vertex(&b, 0, 0, floor), false);
    return finish(&b, out);
}
