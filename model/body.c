/* The deformable target: masses, springs, memory. */
#include "model/body.h"

#include <stdlib.h>
#include <string.h>

/* Vertices this near the base plane (part of the body's size) stand on it. */
#define ON_BASE 1e-6
/* Of the leapfrog's bound: there, the stiffest mode swings 1 / (1 - 0.5^2) = 1.33 times its energy. */
#define STEP_SAFETY 0.5

static const int EDGE[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

typedef struct edge {
    int a, b, tet; /* a < b */
} edge;

morph_body_def morph_body_defaults(void) {
    return (morph_body_def){.young = 2e4,
                            .density = 300,
                            .damping = 0.1,
                            .gravity = 9.81,
                            .friction = 0.5,
                            .base = NAN,
                            .pin = 0.0};
}

static bool usable(const morph_body_def *d) {
    const double least[] = {d->damping, d->drag, d->gravity, d->friction};
    for (size_t k = 0; k < sizeof least / sizeof *least; k++)
        if (!(least[k] >= 0.0) || !isfinite(least[k])) return false;
    return d->young > 0.0 && isfinite(d->young) && d->density > 0.0 && isfinite(d->density) &&
           !isinf(d->base);
}

static int compare_edges(const void *p, const void *q) {
    const edge *a = p, *b = q;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    if (a->b != b->b) return a->b < b->b ? -1 : 1;
    return (a->tet > b->tet) - (a->tet < b->tet);
}

static morph_status copy_mesh(morph_tetra *to, const morph_tetra *from) {
    const size_t vertices = (size_t)from->vertices, tets = (size_t)from->tets;
    const size_t triangles = (size_t)from->triangles, surface = (size_t)from->surface_vertices;
    to->v = morph_alloc(vertices, 3 * sizeof *to->v);
    to->tet = morph_alloc(tets, sizeof *to->tet);
    to->triangle = morph_alloc(triangles, sizeof *to->triangle);
    to->behind = morph_alloc(triangles, sizeof *to->behind);
    to->surface = morph_alloc(surface, sizeof *to->surface);
    if (!to->v || !to->tet || !to->triangle || !to->behind || !to->surface) return MORPH_ERR_NOMEM;
    memcpy(to->v, from->v, vertices * 3 * sizeof *to->v);
    memcpy(to->tet, from->tet, tets * sizeof *to->tet);
    memcpy(to->triangle, from->triangle, triangles * sizeof *to->triangle);
    memcpy(to->behind, from->behind, triangles * sizeof *to->behind);
    memcpy(to->surface, from->surface, surface * sizeof *to->surface);
    to->vertices = from->vertices;
    to->tets = from->tets;
    to->triangles = from->triangles;
    to->surface_vertices = from->surface_vertices;
    return MORPH_OK;
}

static morph_status allocate(morph_body *b) {
    const size_t n = (size_t)b->mesh.vertices, width = 3 * sizeof(double);
    b->x = morph_alloc(n, width);
    b->v = morph_alloc(n, width);
    b->a = morph_alloc(n, width);
    b->before = morph_alloc(n, width);
    b->start = morph_alloc(n, width);
    b->predicted = morph_alloc(n, width);
    b->keep = morph_alloc(n, 2 * width);
    b->mass = morph_alloc(n, sizeof *b->mass);
    b->inverse = morph_alloc(n, sizeof *b->inverse);
    b->volume = morph_alloc((size_t)b->mesh.tets, sizeof *b->volume);
    const bool done = b->x && b->v && b->a && b->before && b->start && b->predicted && b->keep && b->mass &&
                      b->inverse && b->volume;
    return done ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* A quarter of each tetrahedron's mass at its corners. */
static morph_status set_masses(morph_body *b) {
    for (int t = 0; t < b->mesh.tets; t++) {
        b->volume[t] = morph_tetra_volume(b->mesh.v, b->mesh.tet[t]);
        if (!(b->volume[t] > 0.0)) return MORPH_ERR_INPUT;
        for (int k = 0; k < 4; k++)
            b->mass[b->mesh.tet[t][k]] += 0.25 * b->def.density * b->volume[t];
    }
    for (int i = 0; i < b->vertices; i++) {
        b->inverse[i] = 1.0 / b->mass[i];
        if (!isfinite(b->mass[i]) || !isfinite(b->inverse[i]) || b->inverse[i] == 0.0)
            return MORPH_ERR_NONFINITE;
    }
    return MORPH_OK;
}

static morph_status set_springs(morph_body *b) {
    const size_t most = 6 * (size_t)b->mesh.tets;
    edge *e = morph_alloc(most, sizeof *e);
    b->spring = morph_alloc(most, sizeof *b->spring);
    b->length = morph_alloc(most, sizeof *b->length);
    b->stiffness = morph_alloc(most, sizeof *b->stiffness);
    if (!e || !b->spring || !b->length || !b->stiffness) {
        free(e);
        return MORPH_ERR_NOMEM;
    }
    for (int t = 0; t < b->mesh.tets; t++)
        for (int k = 0; k < 6; k++) {
            const int i = b->mesh.tet[t][EDGE[k][0]], j = b->mesh.tet[t][EDGE[k][1]];
            e[6 * t + k] = (edge){i < j ? i : j, i < j ? j : i, t};
        }
    qsort(e, most, sizeof *e, compare_edges);
    for (size_t k = 0; k < most; k++) {
        if (k == 0 || e[k].a != e[k - 1].a || e[k].b != e[k - 1].b) {
            b->spring[b->springs][0] = e[k].a;
            b->spring[b->springs][1] = e[k].b;
            b->length[b->springs++] = morph_dist(&b->mesh.v[3 * e[k].a], &b->mesh.v[3 * e[k].b]);
        }
        const int s = b->springs - 1;
        b->stiffness[s] += b->def.young * b->volume[e[k].tet] / (b->length[s] * b->length[s]);
    }
    free(e);
    for (int s = 0; s < b->springs; s++)
        if (!isfinite(b->stiffness[s])) return MORPH_ERR_NONFINITE;
    return MORPH_OK;
}

/* Length of the volume's gradient by a corner: a third of the area of the face opposite. */
static double gradient_at(const double *x, const int t[4], int corner) {
    double a[3], b[3], n[3];
    const int i = t[(corner + 1) & 3], j = t[(corner + 2) & 3], k = t[(corner + 3) & 3];
    morph_sub(&x[3 * j], &x[3 * i], a);
    morph_sub(&x[3 * k], &x[3 * i], b);
    morph_cross(a, b, n);
    return morph_norm(n) / 6.0;
}

/* Gershgorin for M^-1 K: row i has the diagonal block sum_j k n n^T / m_i and off it one block of the same
 * size for every spring, so omega^2 <= 2 sum_j k / m_i; of a squeezed tetrahedron, blocks E g_i g_j^T / V0
 * with the volume's gradients g. A spring's own stiffness along it is k, across it k (1 - l0 / l), which is
 * below k where stretched and negative where pressed: it holds for every deformation. */
static void set_stable(morph_body *b) {
    double *sum = b->keep, most = 0.0;
    memset(sum, 0, (size_t)b->vertices * sizeof *sum);
    for (int s = 0; s < b->springs; s++)
        for (int k = 0; k < 2; k++)
            sum[b->spring[s][k]] += 2.0 * b->stiffness[s];
    for (int t = 0; t < b->mesh.tets; t++) {
        double g[4];
        for (int k = 0; k < 4; k++)
            g[k] = gradient_at(b->mesh.v, b->mesh.tet[t], k);
        for (int k = 0; k < 4; k++)
            sum[b->mesh.tet[t][k]] += b->def.young * g[k] * (g[0] + g[1] + g[2] + g[3]) / b->volume[t];
    }
    for (int i = 0; i < b->vertices; i++)
        most = fmax(most, sum[i] / b->mass[i]);
    b->stable = STEP_SAFETY * 2.0 / sqrt(most);
}

/* The slowest stretching mode of a bar as long as the body has omega = pi c / L with c^2 = E / rho; dampers
 * in proportion to stiffness give a mode the ratio retardation * omega / 2. */
static double set_size(morph_body *b, double *lowest) {
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < 3 * b->vertices; i++) {
        lo[i % 3] = fmin(lo[i % 3], b->mesh.v[i]);
        hi[i % 3] = fmax(hi[i % 3], b->mesh.v[i]);
    }
    *lowest = lo[2];
    const double size = fmax(hi[0] - lo[0], fmax(hi[1] - lo[1], hi[2] - lo[2]));
    b->retardation = 2.0 * b->def.damping * size / (M_PI * sqrt(b->def.young / b->def.density));
    return size;
}

static morph_status build(morph_body *b, const morph_tetra *mesh) {
    morph_status status = copy_mesh(&b->mesh, mesh);
    if (status == MORPH_OK) status = allocate(b);
    if (status != MORPH_OK) return status;
    b->vertices = b->mesh.vertices;
    if ((status = set_masses(b)) != MORPH_OK || (status = set_springs(b)) != MORPH_OK) return status;
    set_stable(b);
    if (!(b->stable > 0.0) || !isfinite(b->stable)) return MORPH_ERR_NONFINITE;
    const size_t bytes = 3 * (size_t)b->vertices * sizeof(double);
    memcpy(b->x, b->mesh.v, bytes);
    memcpy(b->start, b->x, bytes);
    memcpy(b->predicted, b->x, bytes);
    double lowest;
    const double size = set_size(b, &lowest);
    for (int i = 0; i < b->vertices && b->def.pin >= 0.0 && !isnan(b->def.base); i++)
        if (b->x[3 * i + 2] <= b->def.base + b->def.pin + ON_BASE * size) morph_body_pin(b, i);
    return MORPH_OK;
}

morph_status morph_body_create(const morph_tetra *mesh, const morph_body_def *def, morph_body **out) {
    *out = NULL;
    if (mesh->tets < 1 || !usable(def)) return MORPH_ERR_INPUT;
    morph_body *b = morph_alloc(1, sizeof *b);
    if (!b) return MORPH_ERR_NOMEM;
    b->def = *def;
    const morph_status status = build(b, mesh);
    if (status != MORPH_OK)
        morph_body_destroy(b);
    else
        *out = b;
    return status;
}

void morph_body_destroy(morph_body *b) {
    if (!b) return;
    morph_tetra_free(&b->mesh);
    free(b->x);
    free(b->v);
    free(b->a);
    free(b->before);
    free(b->start);
    free(b->predicted);
    free(b->keep);
    free(b->mass);
    free(b->inverse);
    free(b->volume);
    free(b->spring);
    free(b->length);
    free(b->stiffness);
    free(b);
}

void morph_body_pin(morph_body *b, int vertex) {
    b->inverse[vertex] = 0.0;
    for (int k = 0; k < 3; k++)
        b->v[3 * vertex + k] = 0.0;
}

double morph_body_stable_step(const morph_body *b) {
    return b->stable;
}

void morph_body_energies(const morph_body *b, double *kinetic, double *spring, double *height) {
    if (kinetic) {
        *kinetic = 0.0;
        for (int i = 0; i < b->vertices; i++)
            *kinetic += 0.5 * b->mass[i] * morph_dot(&b->v[3 * i], &b->v[3 * i]);
    }
    if (spring) {
        *spring = 0.0;
        for (int s = 0; s < b->springs; s++) {
            const double stretch =
                morph_dist(&b->x[3 * b->spring[s][0]], &b->x[3 * b->spring[s][1]]) - b->length[s];
            *spring += 0.5 * b->stiffness[s] * stretch * stretch;
        }
        for (int t = 0; t < b->mesh.tets; t++) {
            const double lack = MORPH_BODY_SQUEEZED * b->volume[t] - morph_tetra_volume(b->x, b->mesh.tet[t]);
            if (lack > 0.0) *spring += 0.5 * b->def.young * lack * lack / b->volume[t];
        }
    }
    if (height) {
        *height = 0.0;
        for (int i = 0; i < b->vertices; i++)
            *height += b->mass[i] * b->def.gravity * b->x[3 * i + 2];
    }
}

double morph_body_least_volume(const morph_body *b) {
    double least = INFINITY;
    for (int t = 0; t < b->mesh.tets; t++)
        least = fmin(least, morph_tetra_volume(b->x, b->mesh.tet[t]) / b->volume[t]);
    return least;
}

bool morph_body_finite(const morph_body *b) {
    for (int i = 0; i < 3 * b->vertices; i++)
        if (!isfinite(b->x[i]) || !isfinite(b->v[i])) return false;
    return true;
}
