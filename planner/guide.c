#include "planner/guide.h"

#include <stdlib.h>
#include <string.h>

/* Gaps below a twentieth of the spacing are no cavity: flat triangles leave as much on a round target. */
#define LEAST_GAP 0.05

morph_status morph_seed_centres(const morph_workspace *w, const double *x, double unit, int most,
                                morph_attractor *centre, int *count) {
    const morph_structure *s = w->structure;
    const double a = s->spacing, base = w->cavity->base;
    int found = 0;
    double whole = 0.0;
    *count = 0;
    morph_cavity_region *region = morph_alloc((size_t)s->skin_triangles, sizeof *region);
    if (!region) return MORPH_ERR_NOMEM;
    const morph_status status =
        morph_cavity_regions(w->cavity, x, LEAST_GAP * a, s->skin_triangles, region, &found);
    for (int r = 0; r < found; r++)
        whole += region[r].volume;
    for (int r = 0; r < found && r < most && region[r].volume > 0.1 * whole; r++) {
        morph_attractor *c = &centre[(*count)++];
        memcpy(c->at, region[r].at, sizeof c->at);
        /* Beneath: halfway down to the base plane, or a spacing down where there is none. */
        c->at[2] -= isnan(base) ? a : 0.5 * fmax(0.0, c->at[2] - base);
        c->strength = MORPH_SEED_STRENGTH * unit * a * a;
    }
    free(region);
    return status;
}

morph_status morph_trajectory_append(morph_trajectory *out, const morph_trajectory *t) {
    if (t->frames < 2) return MORPH_OK;
    const size_t width = 3 * (size_t)t->joints, before = (size_t)out->frames, more = (size_t)t->frames - 1;
    double *time = realloc(out->time, (before + more) * sizeof *time);
    if (time) out->time = time;
    double *x = realloc(out->x, (before + more) * width * sizeof *x);
    if (x) out->x = x;
    double *lift = realloc(out->lift, (before + more) * sizeof *lift);
    if (lift) out->lift = lift;
    if (!time || !x || !lift) return MORPH_ERR_NOMEM;
    const double since = out->time[before - 1];
    for (size_t f = 0; f < more; f++) {
        out->time[before + f] = since + t->time[f + 1];
        out->lift[before + f] = out->lift[before - 1];
    }
    memcpy(&out->x[before * width], &t->x[width], more * width * sizeof *x);
    out->frames += (int)more;
    return MORPH_OK;
}

morph_status morph_guided_run(const morph_workspace *w, const morph_scene *scene, const double *from,
                              const morph_attractor *centre, int count, const morph_control *control,
                              morph_trajectory *out, morph_blanket_report *report) {
    morph_blanket_def def = morph_scene_blanket(scene, w->structure);
    def.attractors = centre;
    def.attractor_count = count;
    if (from) {
        def.hand_count = 0;
        def.rise = 0.0;
    }
    return morph_blanket_run(w->structure, w->sdf, w->exact, &def, from ? from : w->start, control, out,
                             report);
}
