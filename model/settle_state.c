/* Settle's state: made once, then only moved. */
#include "model/settle_internal.h"

#include <stdlib.h>
#include <string.h>

/* Penalty of a limit in loads per spacing: a limit loaded by one joint gives 3e-3 spacings before its first
 * multiplier, and Newton's steps along curved limits (a turning post) stay long. */
#define PENALTY 300.0
/* Of cosines, whose gradient is one over an arm of half a spacing or one. */
#define ANGLE_PENALTY 100.0

/* Of friction springs: a joint's load held by friction moves it by 1e-4 spacings. */
#define GRIP 1e4

morph_settle_def morph_settle_defaults(void) {
    return (morph_settle_def){.gravity = 9.81, .base = NAN, .tolerance = 1e-6, .most_steps = 1000};
}

static bool def_ok(const morph_structure *s, const morph_settle_def *d) {
    const double least_zero[] = {d->gravity, d->friction, d->softening};
    for (size_t k = 0; k < sizeof least_zero / sizeof *least_zero; k++)
        if (!(isfinite(least_zero[k]) && least_zero[k] >= 0.0)) return false;
    if (!(isfinite(d->tolerance) && d->tolerance > 0.0) || d->most_steps < 1) return false;
    if (!isnan(d->base) && !isfinite(d->base)) return false;
    if (d->attractors < 0 || d->fixed_joints < 0) return false;
    for (int k = 0; k < d->fixed_joints; k++)
        if (d->fixed[k] < 0 || d->fixed[k] >= s->joints) return false;
    return true;
}

static bool centres_finite(const morph_attractor *a, int n) {
    for (int m = 0; m < n; m++)
        if (!isfinite(morph_dot(a[m].at, a[m].at)) || !isfinite(a[m].strength)) return false;
    return true;
}

void morph_settle_penalties(morph_settle *s) {
    s->stiff = PENALTY;
    s->grip = GRIP;
    s->stiff_angle = ANGLE_PENALTY;
    s->stiff_length = fmax(s->stiff, s->spring);
}

/* A centre pulls hardest at e / sqrt 2: with s * 2 / (3 sqrt 3 e^2). */
void morph_settle_scale(morph_settle *s, const morph_attractor *attractor) {
    const morph_structure *st = s->structure;
    const double unit = s->length_unit, e = s->softening * unit, before = s->load;
    double load = s->weight * before;
    for (int m = 0; m < s->attractors; m++)
        load += 2.0 / (3.0 * sqrt(3.0)) * fabs(attractor[m].strength) / (e * e);
    const double weight = s->weight * before;
    if (!(load > 0.0)) load = st->def.stiffness * unit;
    const double change = before / load;
    s->load = load;
    s->weight = weight / load;
    s->spring = st->def.stiffness * unit / load;
    for (int m = 0; m < s->attractors; m++) {
        for (int k = 0; k < 3; k++)
            s->attractor[m].at[k] = attractor[m].at[k] / unit;
        s->attractor[m].strength = attractor[m].strength / (load * unit * unit);
    }
    for (int l = 0; l < st->links; l++)
        for (int k = 0; k < 2; k++)
            s->link_push[l][k] *= change;
    for (int p = 0; p < st->posts; p++)
        s->post_push[p] *= change;
    for (int t = 0; t < s->angles; t++)
        for (int k = 0; k < 2; k++)
            s->angle[t].push[k] *= change;
    for (int n = 0; n < s->places; n++) {
        s->place[n].push *= change;
        for (int k = 0; k < 3; k++)
            s->place[n].slip[k] *= change;
    }
    morph_settle_penalties(s);
}

/* Joints of a tuple with their parts in u and v. */
static void set_angle(morph_settle_angle *a, const int uj[2], const int vj[2], const double limit[2]) {
    for (int k = 0; k < 4; k++) {
        const int joint = k < 2 ? uj[k] : vj[k - 2];
        int at = 0;
        while (at < a->joints && a->joint[at] != joint)
            at++;
        if (at == a->joints) a->joint[a->joints++] = joint;
        *(k < 2 ? &a->su[at] : &a->sv[at]) += (k & 1) ? 1.0 : -1.0;
    }
    a->ceiling = cos(limit[0]);
    a->floor = cos(limit[1]);
}

static void set_angles(morph_settle *s) {
    const morph_structure *st = s->structure;
    int n = 0, uj[2], vj[2];
    for (int t = 0; t < st->link_posts; t++) {
        morph_link_post_joints(st, t, uj, vj);
        set_angle(&s->angle[n++], uj, vj, st->link_post_limit[t]);
    }
    for (int t = 0; t < st->link_links; t++) {
        morph_link_link_joints(st, t, uj, vj);
        set_angle(&s->angle[n++], uj, vj, st->link_link_limit[t]);
    }
}

static morph_status build(morph_settle *s, const morph_settle_def *def) {
    const morph_structure *st = s->structure;
    const size_t n = 3 * (size_t)s->joints;
    double **const arrays[] = {&s->before, &s->x, &s->trial, &s->g, &s->d};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        if (!(*arrays[k] = morph_alloc(n, sizeof(double)))) return MORPH_ERR_NOMEM;
    s->attractor = morph_alloc((size_t)def->attractors, sizeof *s->attractor);
    s->fixed = morph_alloc((size_t)s->joints, sizeof *s->fixed);
    s->post_push = morph_alloc((size_t)st->posts, sizeof *s->post_push);
    s->link_push = morph_alloc((size_t)st->links, sizeof *s->link_push);
    s->angle = morph_alloc((size_t)s->angles, sizeof *s->angle);
    if (!s->attractor || !s->fixed || !s->post_push || !s->link_push || !s->angle) return MORPH_ERR_NOMEM;
    for (int k = 0; k < def->fixed_joints; k++)
        s->fixed[def->fixed[k]] = true;
    set_angles(s);
    const morph_status status = morph_settle_places_create(s);
    if (status != MORPH_OK) return status;
    morph_settle_scale(s, def->attractor);
    return morph_settle_pattern_create(s);
}

morph_status morph_settle_create(const morph_structure *structure, const morph_sdf *sdf,
                                 const morph_settle_def *def, morph_settle **out) {
    *out = NULL;
    if (!def_ok(structure, def) || !centres_finite(def->attractor, def->attractors)) return MORPH_ERR_INPUT;
    morph_settle *s = morph_alloc(1, sizeof *s);
    if (!s) return MORPH_ERR_NOMEM;
    s->structure = structure;
    s->sdf = sdf;
    s->exact = sdf ? def->exact : NULL;
    s->joints = structure->joints;
    s->angles = structure->link_posts + structure->link_links;
    s->attractors = def->attractors;
    s->length_unit = structure->spacing;
    s->load = 1.0; /* the first scaling finds newtons */
    s->weight = structure->def.mass * def->gravity;
    s->friction = def->friction;
    s->base = def->base / s->length_unit;
    s->softening = def->softening > 0.0 ? def->softening / s->length_unit : 1.0;
    s->tolerance = def->tolerance;
    s->most_steps = def->most_steps;
    const morph_status status = build(s, def);
    if (status != MORPH_OK) {
        morph_settle_destroy(s);
        return status;
    }
    *out = s;
    return MORPH_OK;
}

void morph_settle_destroy(morph_settle *s) {
    if (!s) return;
    void *const arrays[] = {s->before, s->x,     s->trial,     s->g,         s->d,     s->attractor,
                            s->fixed,  s->angle, s->post_push, s->link_push, s->place, s->element,
                            s->start,  s->row,   s->value,     s->spare};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        free(arrays[k]);
    morph_sparse_destroy(s->sparse);
    free(s);
}

morph_status morph_settle_attract(morph_settle *s, const morph_attractor *attractor) {
    if (!centres_finite(attractor, s->attractors)) return MORPH_ERR_NONFINITE;
    morph_settle_scale(s, attractor);
    s->factored = false;
    return MORPH_OK;
}
