/* Forces of the blanket and its leapfrog. */
#include "model/blanket_internal.h"

#include <string.h>

/* A link's spring has the stiffness block k d d^T between its joints and minus that across. By Gershgorin's
 * theorem in blocks no squared frequency of K/m exceeds max over joints of sum over its links (k + k) / m,
 * whatever the pose. The leapfrog is stable for omega step < 2; a quarter of that keeps the frequency error
 * (omega step)^2 / 24 of the stiffest mode at 1 %. */
double morph_blanket_stable_step(const morph_structure *s) {
    int most = 1;
    for (int j = 0; j < s->joints; j++) {
        int links = 0;
        for (int l = 0; l < s->links; l++)
            if (s->link[l][0] == j || s->link[l][1] == j) links++;
        if (links > most) most = links;
    }
    return 0.5 / sqrt(2.0 * most * s->def.stiffness / s->def.mass);
}

/* m a = -m g e_z + sum over links of k (L - L0) d/L. */
void morph_blanket_accelerations(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const double scale = s->def.stiffness / s->def.mass;
    for (int j = 0; j < b->joints; j++) {
        b->a[3 * j] = b->a[3 * j + 1] = 0.0;
        b->a[3 * j + 2] = -b->def.gravity;
    }
    for (int l = 0; l < b->links; l++) {
        double *ai = &b->a[3 * s->link[l][0]], *aj = &b->a[3 * s->link[l][1]], d[3];
        morph_sub(&b->x[3 * s->link[l][1]], &b->x[3 * s->link[l][0]], d);
        const double length = morph_norm(d);
        if (!(length > 0.0)) continue; /* no direction to pull along */
        const double pull = scale * (length - s->start_length[l]) / length;
        for (int k = 0; k < 3; k++) {
            ai[k] += pull * d[k];
            aj[k] -= pull * d[k];
        }
    }
}

void morph_blanket_energies(const morph_blanket_state *b, double *kinetic, double *spring) {
    const morph_structure *s = b->structure;
    *kinetic = *spring = 0.0;
    for (int k = 0; k < 3 * b->joints; k++)
        *kinetic += 0.5 * s->def.mass * b->v[k] * b->v[k];
    for (int l = 0; l < b->links; l++) {
        const double stretch =
            morph_dist(&b->x[3 * s->link[l][0]], &b->x[3 * s->link[l][1]]) - s->start_length[l];
        *spring += 0.5 * s->def.stiffness * stretch * stretch;
    }
}

double morph_blanket_energy(const morph_blanket_state *b) {
    double kinetic, spring, height = 0.0;
    morph_blanket_energies(b, &kinetic, &spring);
    for (int j = 0; j < b->joints; j++)
        height += b->x[3 * j + 2];
    return kinetic + spring + b->structure->def.mass * b->def.gravity * height;
}

/* exp(-2 beta) to second order, without ringing when beta is large. */
static double decay(double beta) {
    return beta < 1.0 ? (1.0 - beta) / (1.0 + beta) : 0.0;
}

/* One damper alone: the speed w at which its ends part obeys w' = -(2 c / m) w, their mean stays. */
static void damp_pair(morph_blanket_state *b, const int ends[2], double factor) {
    double *vi = &b->v[3 * ends[0]], *vj = &b->v[3 * ends[1]], d[3], w[3];
    morph_sub(&b->x[3 * ends[1]], &b->x[3 * ends[0]], d);
    morph_sub(vj, vi, w);
    const double square = morph_dot(d, d);
    if (!(square > 0.0)) return;
    const double change = 0.5 * (1.0 - factor) * morph_dot(w, d) / square;
    for (int k = 0; k < 3; k++) {
        vi[k] += change * d[k];
        vj[k] -= change * d[k];
    }
}

/* Strength of an angle's damper in parts of a link's. Enough to end the swinging of the free motions within 2
 * to 3 s (with 0.1 it goes on, and with 1 leaning posts take seconds to sink). */
#define ANGLE_DAMPING 0.3

/* Dampers over a time h, one after the other: each is exact to second order and takes energy away at any
 * step. The order is turned round in a step's second half, which makes the composition symmetric and so of
 * second order. Beside the links' dampers, every angle has one between the far ends of its arms: the free
 * motions, which change no length (all cells shear, posts lean), would swing on for many seconds otherwise.
 */
static void damp(morph_blanket_state *b, double h, bool backward) {
    const double beta = b->structure->def.damping / b->structure->def.mass * h;
    const double link = decay(beta), angle = decay(ANGLE_DAMPING * beta);
    if (beta == 0.0) return;
    const int all = b->links + b->angles;
    for (int n = 0; n < all; n++) {
        const int k = backward ? all - 1 - n : n;
        if (k < b->links)
            damp_pair(b, b->structure->link[k], link);
        else
            damp_pair(b, b->angle[k - b->links].far, angle);
    }
}

static void kick(morph_blanket_state *b, double h) {
    for (int k = 0; k < 3 * b->joints; k++)
        b->v[k] += h * b->a[k];
}

static void drag(morph_blanket_state *b, double h) {
    const double factor = decay(0.5 * b->def.drag * h);
    for (int k = 0; k < 3 * b->joints; k++)
        b->v[k] *= factor;
}

/* Part of the last step's corrections that a step starts from. With none, contacts at rest creep by some
 * 5e-3 sqrt(gravity spacing) unless sweeps are three times as many; with all, they tremble. */
#define WARM 0.7

/* Drift, then everything hard by projection; what the projection moved becomes velocity, so an impact is
 * plastic and a held constraint carries no speed. */
static bool drift(morph_blanket_state *b) {
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    memcpy(b->before, b->x, bytes);
    for (int k = 0; k < 3 * b->joints; k++)
        b->x[k] += b->step * b->v[k];
    if (!morph_blanket_finite(b)) return false;
    morph_blanket_project_posts_along(b);
    morph_blanket_find_contacts(b, b->x);
    morph_blanket_project_start(b, b->x, WARM);
    for (int sweep = 0; sweep < MORPH_BLANKET_SWEEPS; sweep++) {
        if (sweep == MORPH_BLANKET_SWEEPS / 2) morph_blanket_renew_contacts(b, b->x);
        morph_blanket_sweep(b, b->x, (sweep & 1) != 0, b->def.friction);
    }
    morph_blanket_keep_contacts(b);
    double fastest = 0.0;
    for (int j = 0; j < b->joints; j++) {
        double move[3];
        morph_sub(&b->x[3 * j], &b->before[3 * j], move);
        for (int k = 0; k < 3; k++)
            b->v[3 * j + k] = move[k] / b->step;
        fastest = fmax(fastest, morph_dot(move, move));
    }
    b->path += sqrt(fastest);
    return morph_blanket_finite(b);
}

/* Kick-drift-kick; drag and dampers wrap it symmetrically. */
bool morph_blanket_step(morph_blanket_state *b) {
    const double h = 0.5 * b->step;
    drag(b, h);
    damp(b, h, false);
    kick(b, h);
    if (!drift(b)) return false;
    morph_blanket_accelerations(b);
    kick(b, h);
    damp(b, h, true);
    drag(b, h);
    return morph_blanket_finite(b);
}
