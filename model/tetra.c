/* Tetrahedral meshes: orientation, surface, quality. */
#include "model/tetra.h"

#include <stdlib.h>
#include <string.h>

#define MOST_COORDINATE 1e60
/* Flat: a volume this small against the longest edge cubed is what rounding of the coordinates leaves
 * (files with 7 digits give 1e-7 of the size for each of three heights' products at most; real slivers in
 * meshes are above 1e-4). */
#define FLAT 1e-9

/* The face of a tetrahedron opposite corner k, counter-clockwise seen from outside where the volume is
 * positive. */
static const int FACE[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

typedef struct face {
    int key[3]; /* ascending vertex numbers */
    int tet, corner;
} face;

void morph_tetra_free(morph_tetra *mesh) {
    free(mesh->v);
    free(mesh->tet);
    free(mesh->triangle);
    free(mesh->behind);
    free(mesh->surface);
    *mesh = (morph_tetra){0};
}

double morph_tetra_quality(const double *x, const int t[4]) {
    double sum = 0.0;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < i; j++) {
            double d[3];
            morph_sub(&x[3 * t[i]], &x[3 * t[j]], d);
            sum += morph_dot(d, d);
        }
    const double volume = morph_tetra_volume(x, t), root = cbrt(3.0 * fabs(volume));
    return sum > 0.0 ? copysign(12.0 * root * root / sum, volume) : 0.0;
}

static double longest_edge(const double *x, const int t[4]) {
    double longest = 0.0;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < i; j++)
            longest = fmax(longest, morph_dist(&x[3 * t[i]], &x[3 * t[j]]));
    return longest;
}

/* Dihedral angles: pi less the angle of the outward normals of two faces. */
static void measure_angles(const double *x, const int t[4], morph_tetra_report *r) {
    double n[4][3];
    for (int k = 0; k < 4; k++) {
        double a[3], b[3];
        morph_sub(&x[3 * t[FACE[k][1]]], &x[3 * t[FACE[k][0]]], a);
        morph_sub(&x[3 * t[FACE[k][2]]], &x[3 * t[FACE[k][0]]], b);
        morph_cross(a, b, n[k]);
    }
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < i; j++) {
            const double cosine = -morph_dot(n[i], n[j]) / (morph_norm(n[i]) * morph_norm(n[j]));
            const double angle = acos(fmax(-1.0, fmin(1.0, cosine)));
            r->least_angle = fmin(r->least_angle, angle);
            r->most_angle = fmax(r->most_angle, angle);
        }
}

static morph_status fault(morph_tetra_report *r, morph_tetra_fault what, int where, int other) {
    r->fault = what;
    r->where = where;
    r->other = other;
    return MORPH_ERR_INPUT;
}

static morph_status check_input(int n, const double *v, int m, const int (*tet)[4], morph_tetra_report *r) {
    if (n < 4 || m < 1) return fault(r, MORPH_TETRA_EMPTY, 0, 0);
    for (int i = 0; i < 3 * n; i++)
        if (!(fabs(v[i]) <= MOST_COORDINATE)) return fault(r, MORPH_TETRA_NONFINITE, i / 3, 0);
    for (int t = 0; t < m; t++)
        for (int i = 0; i < 4; i++) {
            if (tet[t][i] < 0 || tet[t][i] >= n) return fault(r, MORPH_TETRA_RANGE, t, 0);
            for (int j = 0; j < i; j++)
                if (tet[t][i] == tet[t][j]) return fault(r, MORPH_TETRA_RANGE, t, 0);
        }
    return MORPH_OK;
}

/* Copies what is used. */
static morph_status compact(int n, const double *v, int m, const int (*tet)[4], morph_tetra *out,
                            morph_tetra_report *r) {
    int *number = morph_alloc((size_t)n, sizeof *number), used = 0;
    if (!number) return MORPH_ERR_NOMEM;
    for (int t = 0; t < m; t++)
        for (int k = 0; k < 4; k++)
            number[tet[t][k]] = 1;
    for (int i = 0; i < n; i++)
        number[i] = number[i] ? used++ : -1;
    r->unused = n - used;
    out->vertices = used;
    out->tets = m;
    out->v = morph_alloc((size_t)used, 3 * sizeof *out->v);
    out->tet = morph_alloc((size_t)m, sizeof *out->tet);
    if (out->v && out->tet) {
        for (int i = 0; i < n; i++)
            if (number[i] >= 0) memcpy(&out->v[3 * number[i]], &v[3 * i], 3 * sizeof *v);
        for (int t = 0; t < m; t++)
            for (int k = 0; k < 4; k++)
                out->tet[t][k] = number[tet[t][k]];
    }
    free(number);
    return out->v && out->tet ? MORPH_OK : MORPH_ERR_NOMEM;
}

static morph_status orient(morph_tetra *mesh, morph_tetra_report *r) {
    r->least_quality = r->least_angle = INFINITY;
    for (int t = 0; t < mesh->tets; t++) {
        int *tet = mesh->tet[t];
        double volume = morph_tetra_volume(mesh->v, tet);
        const double edge = longest_edge(mesh->v, tet);
        if (!(fabs(volume) > FLAT * edge * edge * edge)) return fault(r, MORPH_TETRA_FLAT, t, 0);
        if (volume < 0.0) {
            const int swap = tet[2];
            tet[2] = tet[3];
            tet[3] = swap;
            volume = -volume;
            r->flipped++;
        }
        const double quality = morph_tetra_quality(mesh->v, tet);
        r->volume += volume;
        r->least_quality = fmin(r->least_quality, quality);
        r->mean_quality += quality / mesh->tets;
        measure_angles(mesh->v, tet, r);
    }
    return MORPH_OK;
}

/* By key, then by tetrahedron: a total order, so that sorting repeats. */
static int compare_faces(const void *p, const void *q) {
    const face *a = p, *b = q;
    for (int k = 0; k < 3; k++)
        if (a->key[k] != b->key[k]) return a->key[k] < b->key[k] ? -1 : 1;
    return (a->tet > b->tet) - (a->tet < b->tet);
}

static int compare_owners(const void *p, const void *q) {
    const face *a = p, *b = q;
    if (a->tet != b->tet) return a->tet < b->tet ? -1 : 1;
    return (a->corner > b->corner) - (a->corner < b->corner);
}

static void set_face(face *f, const int tet[4], int number, int corner) {
    f->tet = number;
    f->corner = corner;
    for (int k = 0; k < 3; k++) {
        int at = k;
        const int i = tet[FACE[corner][k]];
        for (; at > 0 && f->key[at - 1] > i; at--)
            f->key[at] = f->key[at - 1];
        f->key[at] = i;
    }
}

/* Whether the face's vertices run in an even permutation of its ascending key. */
static bool even(const morph_tetra *mesh, const face *f) {
    const int *tet = mesh->tet[f->tet], *c = FACE[f->corner];
    const int a = tet[c[0]], b = tet[c[1]], d = tet[c[2]];
    return (a < b) == ((b < d) == (a < d));
}

static bool same_key(const face *a, const face *b) {
    return a->key[0] == b->key[0] && a->key[1] == b->key[1] && a->key[2] == b->key[2];
}

/* Keeps the faces of one tetrahedron only, at the front. Two that share a face see it in opposite senses. */
static morph_status pair_faces(const morph_tetra *mesh, face *f, int faces, int *single,
                               morph_tetra_report *r) {
    int kept = 0;
    for (int i = 0, next; i < faces; i = next) {
        next = i + 1;
        while (next < faces && same_key(&f[i], &f[next]))
            next++;
        if (next - i > 2) return fault(r, MORPH_TETRA_CROWDED, f[i].tet, f[i + 1].tet);
        if (next - i == 2 && even(mesh, &f[i]) == even(mesh, &f[i + 1]))
            return fault(r, MORPH_TETRA_OVERLAP, f[i].tet, f[i + 1].tet);
        if (next - i == 1) f[kept++] = f[i];
    }
    *single = kept;
    return MORPH_OK;
}

static morph_status list_surface(morph_tetra *mesh, const face *f, int faces) {
    mesh->triangle = morph_alloc((size_t)faces, sizeof *mesh->triangle);
    mesh->behind = morph_alloc((size_t)faces, sizeof *mesh->behind);
    int *on = morph_alloc((size_t)mesh->vertices, sizeof *on);
    mesh->surface = morph_alloc((size_t)mesh->vertices, sizeof *mesh->surface);
    if (mesh->triangle && mesh->behind && on && mesh->surface) {
        mesh->triangles = faces;
        for (int i = 0; i < faces; i++) {
            mesh->behind[i] = f[i].tet;
            for (int k = 0; k < 3; k++) {
                mesh->triangle[i][k] = mesh->tet[f[i].tet][FACE[f[i].corner][k]];
                on[mesh->triangle[i][k]] = 1;
            }
        }
        for (int i = 0; i < mesh->vertices; i++)
            if (on[i]) mesh->surface[mesh->surface_vertices++] = i;
    }
    const bool done = mesh->triangle && mesh->behind && on && mesh->surface;
    free(on);
    return done ? MORPH_OK : MORPH_ERR_NOMEM;
}

static morph_status find_surface(morph_tetra *mesh, morph_tetra_report *r) {
    const int faces = 4 * mesh->tets;
    int single = 0;
    face *f = morph_alloc((size_t)faces, sizeof *f);
    if (!f) return MORPH_ERR_NOMEM;
    for (int t = 0; t < mesh->tets; t++)
        for (int k = 0; k < 4; k++)
            set_face(&f[4 * t + k], mesh->tet[t], t, k);
    qsort(f, (size_t)faces, sizeof *f, compare_faces);
    morph_status status = pair_faces(mesh, f, faces, &single, r);
    if (status == MORPH_OK) {
        qsort(f, (size_t)single, sizeof *f, compare_owners);
        status = list_surface(mesh, f, single);
    }
    free(f);
    return status;
}

morph_status morph_tetra_create(int n, const double *v, int m, const int (*tet)[4], morph_tetra *out,
                                morph_tetra_report *report) {
    morph_tetra mesh = {0};
    *out = mesh;
    *report = (morph_tetra_report){0};
    /* 4 m faces are counted in an int. */
    if (m > (1 << 28) || n > (1 << 28)) return MORPH_ERR_NOMEM;
    morph_status status = check_input(n, v, m, tet, report);
    if (status == MORPH_OK) status = compact(n, v, m, tet, &mesh, report);
    if (status == MORPH_OK) status = orient(&mesh, report);
    if (status == MORPH_OK) status = find_surface(&mesh, report);
    if (status == MORPH_OK)
        *out = mesh;
    else
        morph_tetra_free(&mesh);
    return status;
}

morph_status morph_tetra_around(int vertices, int tets, const int (*tet)[4], int **first, int **list) {
    *first = morph_alloc((size_t)vertices + 1, sizeof **first);
    *list = morph_alloc((size_t)tets, 4 * sizeof **list);
    if (!*first || !*list) {
        free(*first);
        free(*list);
        *first = *list = NULL;
        return MORPH_ERR_NOMEM;
    }
    int *end = *first;
    for (int t = 0; t < tets; t++)
        for (int k = 0; k < 4; k++)
            end[tet[t][k]]++;
    for (int i = 1; i <= vertices; i++)
        end[i] += end[i - 1];
    for (int t = tets - 1; t >= 0; t--)
        for (int k = 3; k >= 0; k--)
            (*list)[--end[tet[t][k]]] = t;
    return MORPH_OK;
}
