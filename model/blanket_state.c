/* The blanket's state: made once, then only moved. */
#include "model/blanket_internal.h"

#include <stdlib.h>
#include <string.h>

static bool finite3(const double v[3]) {
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static bool arrays_ok(const morph_structure *s, const morph_blanket_def *d) {
    for (int k = 0; k < d->attractor_count; k++)
        if (!finite3(d->attractors[k].at) || !isfinite(d->attractors[k].strength)) return false;
    for (int k = 0; k < d->hand_count; k++) {
        const morph_hand *h = &d->hands[k];
        if (!finite3(h->force) || h->joint < 0 || h->joint >= s->joints || !(h->from <= h->to)) return false;
    }
    for (int k = 0; k < d->fixed_count; k++)
        if (d->fixed[k] < 0 || d->fixed[k] >= s->joints) return false;
    if (!d->drive) return true;
    if (d->drive->samples < 1 || !(d->drive->step > 0.0) || !isfinite(d->drive->step)) return false;
    for (size_t k = 0; k < (size_t)d->drive->samples * (size_t)s->links; k++)
        if (!(isfinite(d->drive->length[k]) && d->drive->length[k] > 0.0)) return false;
    return true;
}

static bool def_ok(const morph_structure *s, const morph_blanket_def *d) {
    const double least_zero[] = {d->gravity, d->drag,      d->friction,  d->time,  d->step,
                                 d->rise,    d->rise_time, d->softening, d->square};
    for (size_t k = 0; k < sizeof least_zero / sizeof *least_zero; k++)
        if (!(isfinite(least_zero[k]) && least_zero[k] >= 0.0)) return false;
    if (d->body && !morph_body_finite(d->body)) return false;
    if (!finite3(d->velocity) || (d->rise > 0.0 && !(d->rise_time > 0.0)) || !arrays_ok(s, d)) return false;
    return isfinite(d->frame) && d->frame > 0.0 && (isnan(d->base) || isfinite(d->base));
}

static morph_status allocate(morph_blanket_state *b) {
    const size_t n = 3 * (size_t)b->joints;
    double **const arrays[] = {&b->x,      &b->v,      &b->a,       &b->before,
                               &b->keep_x, &b->keep_v, &b->spare_x, &b->rest_x};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        if (!(*arrays[k] = morph_alloc(n, sizeof(double)))) return MORPH_ERR_NOMEM;
    if (!(b->weight = morph_alloc((size_t)b->joints, sizeof(double)))) return MORPH_ERR_NOMEM;
    for (int j = 0; j < b->joints; j++)
        b->weight[j] = 1.0;
    for (int k = 0; k < b->def.fixed_count; k++)
        b->weight[b->def.fixed[k]] = 0.0;
    morph_status status = morph_blanket_fix_create(b->structure, &b->fix);
    if (status == MORPH_OK) status = morph_blanket_self_create(b->structure, &b->self);
    if (status == MORPH_OK) status = morph_blanket_paths_create(b);
    if (status == MORPH_OK) status = morph_blanket_limits_create(b);
    if (status == MORPH_OK) status = morph_blanket_dampers_create(b);
    if (status == MORPH_OK) status = morph_blanket_touches_create(b);
    return status == MORPH_OK ? morph_blanket_soft_create(b) : status;
}

morph_status morph_blanket_state_create(const morph_structure *s, const morph_sdf *sdf,
                                        const morph_blanket_def *def, const double *x0,
                                        morph_blanket_state **out) {
    *out = NULL;
    if (!def_ok(s, def) || (def->body && sdf)) return MORPH_ERR_INPUT;
    for (int k = 0; k < 3 * s->joints; k++)
        if (!isfinite(x0[k])) return MORPH_ERR_NONFINITE;
    morph_blanket_state *b = morph_alloc(1, sizeof *b);
    if (!b) return MORPH_ERR_NOMEM;
    b->structure = s;
    b->sdf = sdf;
    b->def = *def;
    b->joints = s->joints;
    b->links = s->links;
    b->posts = s->posts;
    b->angles = s->link_posts + s->link_links;
    const morph_status status = allocate(b);
    if (status != MORPH_OK) {
        morph_blanket_state_destroy(b);
        return status;
    }
    memcpy(b->x, x0, 3 * (size_t)b->joints * sizeof(double));
    memcpy(b->before, x0, 3 * (size_t)b->joints * sizeof(double));
    for (int k = 0; k < 3 * b->joints; k++)
        b->v[k] = b->weight[k / 3] * def->velocity[k % 3];
    b->step = def->step > 0.0 ? def->step : fmin(morph_blanket_stable_step(s, def), def->frame);
    b->most_move = INFINITY;
    b->pull = morph_blanket_pull(s, def);
    b->lift = b->lift_to = morph_blanket_lift(def, 0.0);
    morph_blanket_accelerations(b);
    *out = b;
    return MORPH_OK;
}

void morph_blanket_state_destroy(morph_blanket_state *b) {
    if (!b) return;
    double *const arrays[] = {b->x, b->v, b->a, b->before, b->keep_x, b->keep_v, b->spare_x, b->rest_x};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        free(arrays[k]);
    free(b->weight);
    free(b->bound);
    free(b->limit);
    free(b->link_wake);
    free(b->angle_wake);
    free(b->touch_wake);
    free(b->span_wake);
    free(b->first_touch);
    free(b->angle_far);
    free(b->turn);
    free(b->damper);
    free(b->come);
    free(b->path);
    free(b->move);
    free(b->hot_link);
    free(b->hot_angle);
    free(b->hot_contact);
    free(b->held);
    free(b->near_link);
    free(b->calm);
    free(b->listed_x);
    free(b->strayed);
    free(b->near_angle);
    free(b->push);
    free(b->angle);
    morph_blanket_hull_destroy(b->hull);
    morph_blanket_fix_destroy(b->fix);
    morph_blanket_self_destroy(b->self);
    morph_blanket_soft_destroy(b->soft);
    free(b->memo);
    free(b->touch);
    free(b->contact);
    free(b->hold);
    free(b->spare_push);
    free(b->spare_angle);
    free(b->spare_touch);
    free(b->spare_wake);
    free(b);
}

bool morph_blanket_finite(const morph_blanket_state *b) {
    for (int k = 0; k < 3 * b->joints; k++)
        if (!isfinite(b->x[k]) || !isfinite(b->v[k])) return false;
    return true;
}
