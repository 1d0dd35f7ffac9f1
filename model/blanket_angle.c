/* Springs at the angle limits: the paper's rectangular angles, held softly before they are held hard. */
#include "model/blanket_internal.h"

/* Where the springs begin, radians: `soft` inside either limit, but never beyond the right angle that every
 * tuple starts with, so that the flat sheet is at rest whatever the zone. */
typedef struct range {
    double lo, hi;
} range;

static range range_of(const double limit[2], double soft) {
    const double right = 0.5 * acos(-1.0);
    const range r = {fmin(limit[0] + soft, right), fmax(limit[1] - soft, right)};
    return r;
}

/* Signed excess of the angle between u and v over the range: negative below lo, positive above hi. The
 * gradient by u is that of the angle, -(v/|v| - c u/|u|) / (|u| sin), whose norm is 1/|u|; atan2 keeps the
 * angle sharp near 0 and 180 degrees, where an arc cosine is not. grad may be NULL; 0 where the arms have no
 * plane or no length. */
static double excess(const double u[3], const double v[3], const range *r, double grad[2][3]) {
    double n[3];
    morph_cross(u, v, n);
    const double sine = morph_norm(n), cosine = morph_dot(u, v);
    const double uu = morph_dot(u, u), vv = morph_dot(v, v);
    if (!(sine > 1e-12 * sqrt(uu * vv)) || !(uu > 0.0 && vv > 0.0)) return 0.0;
    const double angle = atan2(sine, cosine);
    const double over = angle < r->lo ? angle - r->lo : angle > r->hi ? angle - r->hi : 0.0;
    for (int k = 0; k < 3 && grad; k++) {
        grad[0][k] = (cosine / uu * u[k] - v[k]) / sine;
        grad[1][k] = (cosine / vv * v[k] - u[k]) / sine;
    }
    return over;
}

static void arms_of(const morph_turn *a, const double *x, double u[3], double v[3]) {
    morph_sub(&x[3 * a->u[1]], &x[3 * a->u[0]], u);
    morph_sub(&x[3 * a->v[1]], &x[3 * a->v[0]], v);
}

/* Link-post tuples come first; all tuples of a kind have the limits of the structure's def. */
static range range_at(const morph_structure *s, int tuple) {
    return range_of(tuple < s->link_posts ? s->def.link_post : s->def.link_link, s->def.angle_soft);
}

/* Is a pair of arms within the range, by cosines alone? Most are, and need no square root. */
static bool within(const double u[3], const double v[3], double lowest, double highest) {
    const double dot = morph_dot(u, v), bound = dot >= 0.0 ? highest : lowest;
    return dot * dot <= bound * bound * morph_dot(u, u) * morph_dot(v, v);
}

/* Cosines of the range, lowest <= 0 <= highest since it holds the right angle. */
static void cosines(const range *r, double *lowest, double *highest) {
    *lowest = fmin(0.0, cos(r->hi));
    *highest = fmax(0.0, cos(r->lo));
}

void morph_blanket_add_angles(morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const double scale = s->def.angle_stiffness / s->def.mass;
    range r = {0.0, 0.0};
    double lowest = 0.0, highest = 0.0;
    for (int t = 0; t < b->angles; t++) {
        const morph_angle *a = &b->angle[t];
        double u[3], v[3], grad[2][3];
        if (t == 0 || t == s->link_posts) {
            r = range_at(s, t);
            cosines(&r, &lowest, &highest);
        }
        arms_of(&b->turn[t], b->x, u, v);
        if (within(u, v, lowest, highest)) continue;
        const double pull = scale * excess(u, v, &r, grad);
        if (pull == 0.0) continue; /* also where grad was not set */
        for (int j = 0; j < a->joints; j++)
            for (int k = 0; k < 3; k++)
                b->a[3 * a->joint[j] + k] -= pull * (a->su[j] * grad[0][k] + a->sv[j] * grad[1][k]);
    }
}

double morph_blanket_angle_energy(const morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    double energy = 0.0;
    for (int t = 0; t < b->angles && s->def.angle_stiffness > 0.0; t++) {
        const range r = range_at(s, t);
        double u[3], v[3];
        arms_of(&b->turn[t], b->x, u, v);
        const double over = excess(u, v, &r, NULL);
        energy += 0.5 * s->def.angle_stiffness * over * over;
    }
    return energy;
}

/* Shortest that a link may be; a post's own length. */
static double shortest(const morph_structure *s, int tuple, int arm) {
    if (tuple >= s->link_posts) return s->length_limit[s->link_link[tuple - s->link_posts][arm]][0];
    return arm == 0 ? s->length_limit[s->link_post[tuple][0]][0] : s->post_length[s->link_post[tuple][1]];
}

/* A spring's stiffness matrix is k (grad grad^T + e Hess) with the excess e. By a far end the gradient's norm
 * is 1/a, by the corner at most 1/a + 1/b, with the arms' lengths a and b. The angle's second derivatives by
 * u have the entries cot/a^2 (across the plane) and 1/a^2 (along u and across it), the mixed ones 1/(a b sin)
 * and none other: each block is at most (1 + |cot|) times the product of the two gradients' norms. The
 * projection holds e <= soft, and angles at their limits at the flattest. So a block of joints i, j is at
 * most k (1 + soft (1 + |cot|)) g_i g_j, and by Gershgorin in blocks no eigenvalue exceeds the largest sum
 * over a joint's tuples of that over all j. Written as g_i times the sum of g_j. */
double morph_blanket_angle_stiffness(const morph_structure *s) {
    const morph_structure_def *d = &s->def;
    if (!(d->angle_stiffness > 0.0)) return 0.0;
    double most = 0.0;
    for (int joint = 0; joint < s->joints; joint++) {
        double sum = 0.0;
        for (int t = 0; t < s->link_posts + s->link_links; t++) {
            int uj[2], vj[2];
            const bool post = t < s->link_posts;
            if (post)
                morph_link_post_joints(s, t, uj, vj);
            else
                morph_link_link_joints(s, t - s->link_posts, uj, vj);
            const bool in_u = uj[0] == joint || uj[1] == joint, in_v = vj[0] == joint || vj[1] == joint;
            if (!in_u && !in_v) continue;
            const double *limit = post ? d->link_post : d->link_link;
            const double flat = fmax(fabs(1.0 / tan(limit[0])), fabs(1.0 / tan(limit[1])));
            const double pa = 1.0 / shortest(s, t, 0), pb = 1.0 / shortest(s, t, 1);
            sum += (1.0 + d->angle_soft * (1.0 + flat)) * ((in_u ? pa : 0.0) + (in_v ? pb : 0.0)) * 2.0 *
                   (pa + pb);
        }
        most = fmax(most, sum);
    }
    return d->angle_stiffness * most;
}
