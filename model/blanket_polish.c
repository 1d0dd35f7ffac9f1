/* What a recorded frame is held to: the violations left, and the sweeps that remove them. */
#include "model/blanket_internal.h"

#include <string.h>

/* Rounds of SWEEPS sweeps with contacts found anew for each. A frame of the moving blanket is nearly inside
 * its limits (the sweeps aim inside), so most need no round or one. */
#define ROUNDS 24
#define SWEEPS 8
/* From then on a round must take this part off what is left, or the polishing ends. */
#define LEAST_ROUNDS 4
#define BETTER 0.9
/* Deeper than this, in spacings, a part of the target has come between the places that the steps look at;
 * shallower, polishing the frame alone is enough and the motion is left in peace. */
#define ENTERED 0.1
/* Rounds with contact by exact distances, which cost a tree search per element. */
#define EXACT_ROUNDS 12
/* Rounds that try equalities alone where no contact is broken. */
#define ALONE 2
/* Of lengths, posts, panels and, if asked for, angles at x. */
static morph_violation member_violation(const morph_blanket_state *b, const double *x, bool angles) {
    const morph_structure *s = b->structure;
    morph_violation worst = {.link = -1, .tuple = -1};
    for (int l = 0; l < b->links; l++) {
        const double length = morph_dist(&x[3 * s->link[l][0]], &x[3 * s->link[l][1]]);
        const double over = fmax(b->bound[l][0] - length, length - b->bound[l][1]);
        if (over <= worst.length) continue;
        worst.length = over;
        worst.link = l;
    }
    for (int p = 0; p < b->posts; p++) {
        const double length = morph_dist(&x[3 * s->post[p][0]], &x[3 * s->post[p][1]]);
        worst.post = fmax(worst.post, fabs(length / s->post_length[p] - 1.0));
    }
    for (int p = 0; p < s->panels; p++)
        worst.panel = fmax(worst.panel, fabs(morph_blanket_panel_sine(s, p, x)));
    for (int t = 0; t < b->angles && angles; t++) {
        const double c = morph_blanket_cosine(b, t, x);
        const double over = fmax(b->angle[t].lowest - c, c - b->angle[t].highest);
        if (over <= worst.angle) continue;
        worst.angle = over;
        worst.tuple = t;
    }
    return worst;
}

static bool held(const morph_blanket_state *b, const morph_violation *v) {
    const double spacing = b->structure->spacing;
    return v->length <= MORPH_BLANKET_LENGTH_HELD * spacing &&
           v->clearance <= MORPH_BLANKET_CLEARANCE_HELD * spacing && v->post <= MORPH_BLANKET_POST_HELD &&
           v->panel <= MORPH_BLANKET_PANEL_HELD;
}

morph_violation morph_blanket_violation(const morph_blanket_state *b, const double *x) {
    morph_violation v = member_violation(b, x, true);
    v.clearance = morph_blanket_depth(b, x);
    return v;
}

static morph_violation polish(morph_blanket_state *b, double *x, bool exact, int rounds) {
    double before = INFINITY;
    for (int round = 0;; round++) {
        /* Angles are asked for only where a target rises. */
        morph_violation v = member_violation(b, x, b->def.rise > 0.0);
        if (!exact) v.clearance = morph_blanket_depth(b, x);
        if (exact) v.clearance = morph_blanket_depth_exact(b, x);
        if (exact && round == 0) b->entered = v.clearance > ENTERED * b->structure->spacing;
        if (held(b, &v) || round == rounds) return v;
        /* What does not get better cannot be met: contradicting lengths, a target in the way of a limit. */
        const double spacing = b->structure->spacing;
        const double worst = (v.length + v.clearance) / spacing + v.post + v.panel;
        if (round >= LEAST_ROUNDS && worst > BETTER * before) return v;
        before = worst;
        /* Lengths alone, as after most frames: the least motion that mends them. */
        if (round < ALONE && v.clearance <= MORPH_BLANKET_CLEARANCE_HELD * spacing) {
            if (!morph_blanket_sweep_lengths(b, x)) morph_blanket_fix_apply(b, x);
            continue;
        }
        if (exact)
            morph_blanket_find_exact(b, x);
        else
            morph_blanket_find_contacts(b, x);
        b->added =
            fmin(v.length + v.clearance + MORPH_BLANKET_ADD * spacing, MORPH_BLANKET_ADD_MOST * spacing);
        morph_blanket_list_limits(b, x, true);
        morph_blanket_project_start(b, x, 0.0);
        for (int sweep = 0; sweep < SWEEPS; sweep++)
            morph_blanket_sweep(b, x, sweep, 0.0);
        if (!morph_blanket_sweep_lengths(b, x)) morph_blanket_fix_apply(b, x);
    }
}

morph_violation morph_blanket_polish(morph_blanket_state *b, double *x) {
    const size_t push = (size_t)b->links * sizeof *b->push, touch = (size_t)b->touches * sizeof *b->touch,
                 wake = (size_t)b->touches * sizeof *b->touch_wake,
                 spans = (size_t)(b->joints + b->links + b->structure->skin_triangles) * sizeof *b->span_wake;
    memcpy(b->spare_push, b->push, push);
    for (int t = 0; t < b->angles; t++)
        memcpy(b->spare_angle[t], b->turn[t].push, sizeof *b->spare_angle);
    const bool exact = b->exact && (b->sdf || b->soft);
    /* By exact distances no place moves and none falls asleep. */
    if (!exact) {
        memcpy(b->spare_touch, b->touch, touch);
        memcpy(b->spare_wake, b->touch_wake, wake);
        memcpy(b->spare_wake + b->touches, b->span_wake, spans);
    }
    memcpy(b->before, x, 3 * (size_t)b->joints * sizeof(double));
    if (b->soft) morph_blanket_soft_hold(b);
    const morph_violation v = polish(b, x, exact, exact ? EXACT_ROUNDS : ROUNDS);
    if (b->soft) morph_blanket_soft_release(b);
    memcpy(b->push, b->spare_push, push);
    for (int t = 0; t < b->angles; t++)
        memcpy(b->turn[t].push, b->spare_angle[t], sizeof *b->spare_angle);
    if (!exact) {
        memcpy(b->touch, b->spare_touch, touch);
        memcpy(b->touch_wake, b->spare_wake, wake);
        memcpy(b->span_wake, b->spare_wake + b->touches, spans);
    }
    /* Moved in place, elements have come further than their paths tell. */
    for (int n = 0; n < b->links + b->structure->skin_triangles && x == b->x; n++)
        b->memo[n].been = -INFINITY;
    if (b->exact && b->sdf) morph_blanket_seek_deepest(b);
    return v;
}
