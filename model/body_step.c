/* The deformable target in motion: leapfrog, dampers, volumes. */
#include "model/body.h"

#include <string.h>

/* Volume (part of that at rest) below which a tetrahedron is held by projection: an even squeeze to 58 % of
 * every length, far beyond what springs with E in mind describe. */
#define LEAST_VOLUME 0.2
/* What is left after the sweeps must be above this; if not, moves are taken back. */
#define FLOOR_VOLUME 0.02
/* Sweeps end when all holds; more than this is a crush that taking back must end. */
#define MOST_SWEEPS 40
/* Energy may swing by a third of the stiffest mode's (body.c); doubling has no honest cause. */
#define GROWTH 1.0
#define MOST_REFINES 4
#define MOST_SUBSTEPS 1e6

/* Six times the volume of a tetrahedron, and its gradients: they add up to 0 and carry no moment, so forces
 * and corrections along them keep both momenta. */
static double volume_gradients(const double *x, const int t[4], double g[4][3]) {
    double a[3], b[3], c[3];
    morph_sub(&x[3 * t[1]], &x[3 * t[0]], a);
    morph_sub(&x[3 * t[2]], &x[3 * t[0]], b);
    morph_sub(&x[3 * t[3]], &x[3 * t[0]], c);
    morph_cross(b, c, g[1]);
    morph_cross(c, a, g[2]);
    morph_cross(a, b, g[3]);
    for (int k = 0; k < 3; k++)
        g[0][k] = -(g[1][k] + g[2][k] + g[3][k]);
    return morph_dot(a, g[1]);
}

/* f_i = E (V1 - V) / V0 grad_i V where V < V1 (body.h). */
static void add_squeeze(morph_body *b, int tet) {
    const int *t = b->mesh.tet[tet];
    const double lack = MORPH_BODY_SQUEEZED * b->volume[tet] - morph_tetra_volume(b->x, t);
    if (!(lack > 0.0)) return;
    double g[4][3];
    volume_gradients(b->x, t, g);
    const double pressure = b->def.young * lack / b->volume[tet] / 6.0;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 3; i++)
            b->a[3 * t[k] + i] += pressure * g[k][i];
}

static void accelerations(morph_body *b, const double *external) {
    double *a = b->a;
    for (int i = 0; i < 3 * b->vertices; i++)
        a[i] = external ? external[i] : 0.0;
    for (int s = 0; s < b->springs; s++) {
        const int i = b->spring[s][0], j = b->spring[s][1];
        double d[3];
        morph_sub(&b->x[3 * j], &b->x[3 * i], d);
        const double length = morph_norm(d);
        if (!(length > 0.0)) continue; /* no direction */
        const double force = b->stiffness[s] * (length - b->length[s]) / length;
        for (int k = 0; k < 3; k++) {
            a[3 * i + k] += force * d[k];
            a[3 * j + k] -= force * d[k];
        }
    }
    for (int t = 0; t < b->mesh.tets; t++)
        add_squeeze(b, t);
    for (int i = 0; i < b->vertices; i++) {
        for (int k = 0; k < 3; k++)
            a[3 * i + k] *= b->inverse[i];
        if (b->inverse[i] > 0.0) a[3 * i + 2] -= b->def.gravity;
    }
}

/* exp(-2 beta) to second order, without ringing when beta is large. */
static double decay(double beta) {
    return beta < 1.0 ? (1.0 - beta) / (1.0 + beta) : 0.0;
}

/* One damper alone over h: the speed w at which its ends part obeys w' = -c (1/m_i + 1/m_j) w. */
static void damp_spring(morph_body *b, int s, double h) {
    const int i = b->spring[s][0], j = b->spring[s][1];
    const double inverse = b->inverse[i] + b->inverse[j];
    double d[3], w[3];
    if (inverse == 0.0) return;
    morph_sub(&b->x[3 * j], &b->x[3 * i], d);
    morph_sub(&b->v[3 * j], &b->v[3 * i], w);
    const double square = morph_dot(d, d);
    if (!(square > 0.0)) return;
    const double factor = decay(0.5 * b->retardation * b->stiffness[s] * inverse * h);
    const double impulse = (1.0 - factor) * morph_dot(w, d) / (square * inverse);
    for (int k = 0; k < 3; k++) {
        b->v[3 * i + k] += b->inverse[i] * impulse * d[k];
        b->v[3 * j + k] -= b->inverse[j] * impulse * d[k];
    }
}

/* One after the other, backward in a step's second half, which makes it symmetric; each takes energy away at
 * any h and keeps momentum. */
static void damp(morph_body *b, double h, bool backward) {
    const double factor = decay(0.5 * b->def.drag * h);
    for (int n = 0; n < b->springs && b->retardation > 0.0; n++)
        damp_spring(b, backward ? b->springs - 1 - n : n, h);
    for (int i = 0; i < 3 * b->vertices && b->def.drag > 0.0; i++)
        b->v[i] *= factor;
}

/* C = V - LEAST V0 >= 0: dx_i = -C w_i grad_i / sum w |grad|^2. Returns whether it was violated. */
static bool project_volume(morph_body *b, int tet) {
    const int *t = b->mesh.tet[tet];
    /* Met, for a constraint that is approached from below. */
    if (morph_tetra_volume(b->x, t) >= (LEAST_VOLUME - 1e-7) * b->volume[tet]) return false;
    double g[4][3], square = 0.0;
    const double c = volume_gradients(b->x, t, g) - 6.0 * LEAST_VOLUME * b->volume[tet];
    for (int k = 0; k < 4; k++)
        square += b->inverse[t[k]] * morph_dot(g[k], g[k]);
    if (!(square > 0.0)) return false; /* all pinned, or shrunk to a line: taking back must help */
    b->counts.projections++;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 3; i++)
            b->x[3 * t[k] + i] -= c / square * b->inverse[t[k]] * g[k][i];
    return true;
}

/* The base plane: out along z, friction against the motion since `from` by at most friction times that. */
static bool project_base(morph_body *b, const double *from) {
    bool any = false;
    for (int i = 0; i < b->vertices; i++) {
        double *x = &b->x[3 * i];
        const double push = b->def.base - x[2];
        if (!(push > 0.0) || b->inverse[i] == 0.0) continue;
        any = true;
        x[2] = b->def.base;
        const double dx = x[0] - from[3 * i], dy = x[1] - from[3 * i + 1], slip = hypot(dx, dy);
        const double part = slip > 0.0 ? fmin(1.0, b->def.friction * push / slip) : 0.0;
        x[0] -= part * dx;
        x[1] -= part * dy;
    }
    return any;
}

static bool sweep(morph_body *b, const double *from, bool backward) {
    bool any = false;
    for (int n = 0; n < b->mesh.tets; n++)
        any |= project_volume(b, backward ? b->mesh.tets - 1 - n : n);
    if (!isnan(b->def.base)) any |= project_base(b, from);
    return any;
}

void morph_body_sweep(morph_body *b) {
    sweep(b, b->start, false);
}

/* Halves the moves since `from` (where all volumes are positive) at the tetrahedra that are still too flat,
 * until none is; at worst everything is back there. */
static void take_back(morph_body *b, const double *from) {
    for (int round = 0; round < 200; round++) {
        bool any = false;
        for (int n = 0; n < b->mesh.tets; n++) {
            const int *t = b->mesh.tet[n];
            if (morph_tetra_volume(b->x, t) > FLOOR_VOLUME * b->volume[n]) continue;
            /* One that was that flat already must not move at all. */
            const double keep =
                morph_tetra_volume(from, t) > FLOOR_VOLUME * b->volume[n] && round < 60 ? 0.5 : 0.0;
            b->counts.held++;
            for (int k = 0; k < 4; k++)
                for (int i = 0; i < 3; i++) {
                    const int at = 3 * t[k] + i;
                    const double x = from[at] + keep * (b->x[at] - from[at]);
                    any |= x != b->x[at];
                    b->x[at] = x;
                }
        }
        if (!any) return;
    }
    memcpy(b->x, from, 3 * (size_t)b->vertices * sizeof *b->x);
}

/* Whether anything had to be corrected. */
static bool hold(morph_body *b, const double *from) {
    int n = 0;
    while (n < MOST_SWEEPS && sweep(b, from, (n & 1) != 0))
        n++;
    if (n == MOST_SWEEPS) take_back(b, from);
    return n > 0;
}

static bool substep(morph_body *b, double h, const double *external) {
    damp(b, 0.5 * h, false);
    for (int i = 0; i < 3 * b->vertices; i++)
        b->v[i] += 0.5 * h * b->a[i];
    memcpy(b->before, b->x, 3 * (size_t)b->vertices * sizeof *b->x);
    for (int i = 0; i < 3 * b->vertices; i++)
        b->x[i] += h * b->v[i];
    if (!morph_body_finite(b)) return false;
    /* What the projection moved becomes velocity: impacts are plastic. */
    if (hold(b, b->before))
        for (int i = 0; i < 3 * b->vertices; i++)
            b->v[i] = (b->x[i] - b->before[i]) / h;
    accelerations(b, external);
    for (int i = 0; i < 3 * b->vertices; i++)
        b->v[i] += 0.5 * h * b->a[i];
    damp(b, 0.5 * h, true);
    b->counts.steps++;
    return morph_body_finite(b);
}

static double total_energy(const morph_body *b, double *active) {
    double kinetic, spring, height;
    morph_body_energies(b, &kinetic, &spring, &height);
    *active = kinetic + spring;
    return *active + height;
}

/* Energy may come from the external forces' work only. */
static bool grown(const morph_body *b, const double *external, double energy, double active) {
    double work = 0.0, now, height_scale = 0.0;
    for (int i = 0; i < 3 * b->vertices && external; i++)
        work += external[i] * (b->x[i] - b->start[i]);
    for (int i = 0; i < b->vertices; i++)
        height_scale += b->mass[i] * b->def.gravity * fabs(b->x[3 * i + 2] - b->start[3 * i + 2]);
    const double change = total_energy(b, &now) - energy - work;
    /* The last part is rounding of heights far above 0. */
    return change > GROWTH * (active + fabs(work) + height_scale) + 1e-9 * fabs(energy);
}

bool morph_body_step(morph_body *b, double h, const double *external) {
    const size_t width = 3 * (size_t)b->vertices;
    double active;
    if (!(h >= 0.0) || !(h / b->stable < MOST_SUBSTEPS)) return false;
    memcpy(b->start, b->x, width * sizeof *b->x);
    memcpy(b->keep, b->x, width * sizeof *b->x);
    memcpy(b->keep + width, b->v, width * sizeof *b->v);
    const double energy = total_energy(b, &active);
    /* One part in a billion more than the bound is rounding of h. */
    double parts = fmax(1.0, ceil(h / b->stable - 1e-9));
    for (int attempt = 0; attempt <= MOST_REFINES; attempt++, parts *= 2.0) {
        bool finite = true;
        accelerations(b, external);
        for (double n = 0.0; n < parts && finite; n += 1.0)
            finite = substep(b, h / parts, external);
        if (finite && (attempt == MOST_REFINES || !grown(b, external, energy, active))) {
            memcpy(b->predicted, b->x, width * sizeof *b->x);
            return true;
        }
        if (attempt < MOST_REFINES) b->counts.redone++;
        memcpy(b->x, b->keep, width * sizeof *b->x);
        memcpy(b->v, b->keep + width, width * sizeof *b->v);
    }
    return false;
}

void morph_body_moved(morph_body *b, double h) {
    hold(b, b->start);
    for (int i = 0; i < 3 * b->vertices; i++) {
        if (b->x[i] != b->predicted[i]) b->v[i] += (b->x[i] - b->predicted[i]) / h;
        b->predicted[i] = b->x[i];
    }
}
