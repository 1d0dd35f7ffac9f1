/* Forces of the blanket and its leapfrog. */
#include "model/blanket_internal.h"

#include <string.h>

double morph_blanket_softening(const morph_structure *s, const morph_blanket_def *def) {
    return def->softening > 0.0 ? def->softening : s->spacing;
}

/* Largest acceleration that attraction and hands give a joint: |F| = s r/p^3 has its maximum
 * 2/(3 sqrt 3) s/e^2. */
double morph_blanket_pull(const morph_structure *s, const morph_blanket_def *def) {
    const double soft = morph_blanket_softening(s, def);
    double pull = 0.0, push = 0.0;
    for (int k = 0; k < def->attractor_count; k++)
        pull += 2.0 / (3.0 * sqrt(3.0)) * fabs(def->attractors[k].strength) / (soft * soft);
    for (int k = 0; k < def->hand_count; k++)
        push = fmax(push, morph_norm(def->hands[k].force));
    return def->gravity + (pull + push) / s->def.mass;
}

/* The blanket's own and the scene's. */
static double square_of(const morph_structure *s, const morph_blanket_def *def) {
    return def->square + s->def.square;
}

/* A link's spring has the stiffness block k d d^T between its joints and minus that across. By Gershgorin's
 * theorem in blocks no squared frequency of K/m exceeds max over joints of sum over its links (k + k) / m,
 * whatever the pose; a centre of attraction adds at most s/e^3 / m. The leapfrog is stable for
 * omega step < 2; a quarter of that keeps the frequency error (omega step)^2 / 24 of the stiffest mode at
 * 1 %. */
double morph_blanket_stable_step(const morph_structure *s, const morph_blanket_def *def) {
    const double soft = morph_blanket_softening(s, def);
    int most = 1;
    for (int j = 0; j < s->joints; j++) {
        int links = 0;
        for (int l = 0; l < s->links; l++)
            if (s->link[l][0] == j || s->link[l][1] == j) links++;
        if (links > most) most = links;
    }
    double square = def->drive ? 0.0 : 2.0 * most * s->def.stiffness;
    for (int k = 0; k < def->attractor_count; k++)
        square += fabs(def->attractors[k].strength) / (soft * soft * soft);
    /* An angle's gradient by a joint is at most 1/h + 1/L, squared at most (1/h + 1/L)^2; a joint is in the
     * angles of its own links and post and of those of its post's other end, and in the far ends': 16 at
     * most, and Gershgorin's other columns add as much again, three times. */
    double arm = s->spacing;
    for (int l = 0; l < s->links; l++)
        arm = fmin(arm, s->length_limit[l][0]);
    for (int p = 0; p < s->posts; p++)
        arm = fmin(arm, s->post_length[p]);
    square += 4.0 * 16.0 * square_of(s, def) * 4.0 / (arm * arm) + morph_blanket_angle_stiffness(s);
    return 0.5 / sqrt(square / s->def.mass);
}

/* Adds the springs' k (L - L0) d/L over m. */
static void add_springs(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const double scale = s->def.stiffness / s->def.mass;
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

/* Adds the angle springs' -k c grad c over m. Link-post tuples come first. */
static void add_squares(morph_blanket_state *b) {
    const double scale = square_of(b->structure, &b->def) / b->structure->def.mass;
    for (int t = 0; t < b->structure->link_posts; t++) {
        const morph_angle *a = &b->angle[t];
        double c, grad[4][3];
        if (!morph_blanket_cosine_gradient(b, t, b->x, &c, grad)) continue;
        for (int j = 0; j < a->joints; j++)
            for (int k = 0; k < 3; k++)
                b->a[3 * a->joint[j] + k] -= scale * c * grad[j][k];
    }
}

static bool pushes(const morph_hand *hand, double time) {
    return time >= hand->from && time < hand->to;
}

/* m a = -m g e_z + springs + attraction + hands. */
void morph_blanket_accelerations(morph_blanket_state *b) {
    const double inverse = 1.0 / b->structure->def.mass;
    const double soft = morph_blanket_softening(b->structure, &b->def);
    for (int j = 0; j < b->joints; j++) {
        double force[3] = {0.0};
        for (int k = 0; k < b->def.attractor_count; k++)
            morph_attraction(&b->def.attractors[k], soft, &b->x[3 * j], force, NULL);
        for (int k = 0; k < 3; k++)
            b->a[3 * j + k] = inverse * force[k] - (k == 2 ? b->def.gravity : 0.0);
    }
    for (int h = 0; h < b->def.hand_count; h++) {
        const morph_hand *hand = &b->def.hands[h];
        for (int k = 0; k < 3 && pushes(hand, b->time); k++)
            b->a[3 * hand->joint + k] += inverse * hand->force[k];
    }
    if (!b->def.drive) add_springs(b);
    if (square_of(b->structure, &b->def) > 0.0) add_squares(b);
    if (b->structure->def.angle_stiffness > 0.0) morph_blanket_add_angles(b);
    for (int j = 0; j < b->joints && b->def.fixed_count > 0; j++)
        for (int k = 0; k < 3; k++)
            b->a[3 * j + k] *= b->weight[j];
}

void morph_blanket_energies(const morph_blanket_state *b, double *kinetic, double *spring) {
    const morph_structure *s = b->structure;
    *kinetic = *spring = 0.0;
    for (int k = 0; k < 3 * b->joints; k++)
        *kinetic += 0.5 * s->def.mass * b->v[k] * b->v[k];
    if (b->soft) morph_blanket_soft_energies(b, kinetic, spring, NULL);
    if (b->def.drive) return;
    for (int l = 0; l < b->links; l++) {
        const double stretch =
            morph_dist(&b->x[3 * s->link[l][0]], &b->x[3 * s->link[l][1]]) - s->start_length[l];
        *spring += 0.5 * s->def.stiffness * stretch * stretch;
    }
}

double morph_blanket_energy(const morph_blanket_state *b) {
    const double square = square_of(b->structure, &b->def);
    double kinetic, spring, height = 0.0, attraction = 0.0, angles = morph_blanket_angle_energy(b);
    for (int t = 0; t < b->structure->link_posts && square > 0.0; t++) {
        const double c = morph_blanket_cosine(b, t, b->x);
        angles += 0.5 * square * c * c;
    }
    morph_blanket_energies(b, &kinetic, &spring);
    const double soft = morph_blanket_softening(b->structure, &b->def);
    for (int j = 0; j < b->joints; j++) {
        height += b->x[3 * j + 2];
        for (int k = 0; k < b->def.attractor_count; k++)
            attraction += morph_attraction(&b->def.attractors[k], soft, &b->x[3 * j], NULL, NULL);
    }
    double body = 0.0;
    if (b->soft) morph_blanket_soft_energies(b, NULL, NULL, &body);
    return kinetic + spring + attraction + angles + body + b->structure->def.mass * b->def.gravity * height;
}

/* exp(-2 beta) to second order, without ringing when beta is large. */
double morph_blanket_decay(double beta) {
    return beta < 1.0 ? (1.0 - beta) / (1.0 + beta) : 0.0;
}

static void kick(morph_blanket_state *b, double h) {
    for (int k = 0; k < 3 * b->joints; k++)
        b->v[k] += h * b->a[k];
}

static void drag(morph_blanket_state *b, double h) {
    const double factor = morph_blanket_decay(0.5 * b->def.drag * h);
    for (int k = 0; k < 3 * b->joints; k++)
        b->v[k] *= factor;
}

/* Part of the last step's corrections that a step starts from. With none, contacts at rest creep by some
 * 5e-3 sqrt(gravity spacing) unless sweeps are three times as many; with all, they tremble. */
#define WARM 0.7

/* What the hands, the target on its way and the actuators did in this step: force times motion. A projection
 * that moves a joint of mass m by c in a step h has pushed with m c / h^2. */
static double step_work(const morph_blanket_state *b) {
    const double mass = b->structure->def.mass, force = mass / (b->step * b->step);
    double work = 0.0;
    for (int h = 0; h < b->def.hand_count; h++) {
        const morph_hand *hand = &b->def.hands[h];
        double move[3];
        morph_sub(&b->x[3 * hand->joint], &b->before[3 * hand->joint], move);
        if (pushes(hand, b->time) || pushes(hand, b->time + b->step)) work += morph_dot(hand->force, move);
    }
    for (int n = 0; n < b->contacts && b->lift_to != b->lift; n++) {
        const morph_contact *c = &b->contact[n];
        if (c->source < b->touches)
            work += force * (c->push * c->normal[2] + c->drag[2]) * (b->lift_to - b->lift);
    }
    for (int l = 0; l < b->links && b->def.drive; l++) {
        const int *ends = b->structure->link[l];
        const double change = morph_dist(&b->x[3 * ends[1]], &b->x[3 * ends[0]]) -
                              morph_dist(&b->before[3 * ends[1]], &b->before[3 * ends[0]]);
        work += 0.5 * force * (b->push[l][0] - b->push[l][1]) * change;
    }
    return work;
}

/* Steps that move further than this, radii, may be looked at by the guard. */
#define PLANES_MOVE 0.1

/* What the projection moved becomes velocity, so an impact is plastic and a held constraint carries no speed.
 */
static void take_velocity(morph_blanket_state *b) {
    for (int k = 0; k < 3 * b->joints; k++)
        b->v[k] = (b->x[k] - b->before[k]) / b->step;
}

/* Drift, then everything hard by projection. False when a joint moves further than contacts are safe for. */
static bool drift(morph_blanket_state *b) {
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    memcpy(b->before, b->x, bytes);
    if (b->soft) morph_blanket_soft_push(b, morph_blanket_most_carried(b) * b->structure->def.mass);
    double fastest = 0.0;
    for (int k = 0; k < 3 * b->joints; k++) {
        b->x[k] += b->step * b->v[k];
        fastest = fmax(fastest, fabs(b->step * b->v[k]));
    }
    if (!(fastest <= b->most_move) || !morph_blanket_finite(b)) return false;
    if (b->soft && !morph_blanket_soft_step(b)) return false;
    morph_blanket_project_posts_along(b);
    morph_blanket_note_moves(b, b->x);
    b->status = morph_blanket_find_self(b);
    if (b->status != MORPH_OK) return false;
    morph_blanket_list_limits(b, b->x, false);
    morph_blanket_find_contacts(b, b->x);
    if (b->guard.watched > 0) morph_blanket_guard_contacts(b);
    morph_blanket_project_start(b, b->x, WARM);
    for (int sweep = 0; sweep < MORPH_BLANKET_SWEEPS; sweep++) {
        if (sweep == MORPH_BLANKET_SWEEPS / 2) morph_blanket_renew_contacts(b, b->x);
        morph_blanket_sweep(b, b->x, sweep, b->def.friction);
        if (b->changed <= MORPH_BLANKET_SWEPT * b->structure->spacing) break;
    }
    morph_blanket_keep_contacts(b);
    if (morph_blanket_moved(b, b->x) > PLANES_MOVE * b->structure->def.radius) morph_blanket_renew_planes(b);
    if (!morph_blanket_guard(b)) return false;
    if (b->soft) morph_blanket_soft_moved(b);
    take_velocity(b);
    morph_blanket_add_paths(b);
    b->work += step_work(b);
    return morph_blanket_finite(b);
}

/* Kick-drift-kick; drag and dampers wrap it symmetrically. */
bool morph_blanket_step(morph_blanket_state *b) {
    const double h = 0.5 * b->step;
    morph_blanket_schedule(b);
    drag(b, h);
    morph_blanket_damp(b, h, false);
    kick(b, h);
    if (!drift(b)) return false;
    b->time += b->step;
    b->lift = b->lift_to;
    morph_blanket_accelerations(b);
    kick(b, h);
    morph_blanket_damp(b, h, true);
    drag(b, h);
    return morph_blanket_finite(b);
}
