/* From the stages' results to the record. */
#include "model/kinematics.h"
#include "planner/placement.h"

#include <stdlib.h>
#include <string.h>

static void *duplicate(const void *from, size_t count, size_t size) {
    void *p = morph_alloc(count, size);
    if (p && count) memcpy(p, from, count * size);
    return p;
}

#define COPY(to, from, count) (((to) = duplicate((from), (size_t)(count), sizeof *(from))) != NULL)

morph_status morph_record_structure(morph_record *r, const morph_structure *s, const morph_mesh *target,
                                    double base) {
    r->base = base;
    r->spacing = s->spacing;
    r->joints = s->joints;
    r->links = s->links;
    r->posts = s->posts;
    r->link_posts = s->link_posts;
    r->link_links = s->link_links;
    r->skin_triangles = s->skin_triangles;
    r->panels = s->panels;
    r->fixed_count = s->fixed_count;
    r->target_vertices = target->vertices;
    r->target_triangles = target->triangles;
    const bool ok =
        COPY(r->joint_layer, s->joint_layer, s->joints) && COPY(r->joint_node, s->joint_node, s->joints) &&
        COPY(r->link, s->link, s->links) && COPY(r->link_kind, s->link_kind, s->links) &&
        COPY(r->length_limit, s->length_limit, s->links) && COPY(r->rate_limit, s->rate_limit, s->links) &&
        COPY(r->acceleration_limit, s->acceleration_limit, s->links) &&
        COPY(r->jerk_limit, s->jerk_limit, s->links) && COPY(r->link_radius, s->link_radius, s->links) &&
        COPY(r->post, s->post, s->posts) && COPY(r->post_length, s->post_length, s->posts) &&
        COPY(r->link_post, s->link_post, s->link_posts) &&
        COPY(r->link_post_limit, s->link_post_limit, s->link_posts) &&
        COPY(r->link_link, s->link_link, s->link_links) &&
        COPY(r->link_link_limit, s->link_link_limit, s->link_links) &&
        COPY(r->skin, s->skin, s->skin_triangles) && COPY(r->panel, s->panel, s->panels) &&
        COPY(r->fixed, s->fixed, s->fixed_count) && COPY(r->target_v, target->v, 3 * target->vertices) &&
        COPY(r->target_t, target->t, 3 * target->triangles);
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

morph_status morph_record_deformed(morph_record *r, const morph_mesh *surface) {
    r->deformed_vertices = surface->vertices;
    r->deformed_triangles = surface->triangles;
    const bool ok = COPY(r->deformed_v, surface->v, 3 * surface->vertices) &&
                    COPY(r->deformed_t, surface->t, 3 * surface->triangles);
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

morph_status morph_record_nominal(morph_record *r, const morph_structure *s, const morph_trajectory *t) {
    const size_t width = 3 * (size_t)s->joints;
    r->nominal_frames = t->frames;
    r->nominal_lengths = morph_alloc((size_t)t->frames, (size_t)s->links * sizeof(double));
    r->offset_nominal = morph_alloc((size_t)t->frames, 3 * sizeof(double));
    if (!COPY(r->nominal_time, t->time, t->frames) ||
        !COPY(r->nominal_joints, t->x, (size_t)t->frames * width) || !r->nominal_lengths ||
        !r->offset_nominal)
        return MORPH_ERR_NOMEM;
    for (int f = 0; f < t->frames; f++)
        r->offset_nominal[3 * f + 2] = t->lift[f];
    for (int f = 0; f < t->frames; f++)
        morph_link_lengths(s, &t->x[(size_t)f * width], &r->nominal_lengths[(size_t)f * (size_t)s->links]);
    return MORPH_OK;
}

static void put_centres(double (*to)[4], const morph_attractor *from, int count) {
    for (int m = 0; m < count; m++) {
        memcpy(to[m], from[m].at, sizeof from[m].at);
        to[m][3] = from[m].strength;
    }
}

morph_status morph_record_guided(morph_record *r, const morph_structure *s, const morph_placement *p) {
    const morph_trajectory *t = &p->guided;
    const size_t width = 3 * (size_t)s->joints, links = (size_t)s->links;
    r->placement_before = morph_alloc((size_t)p->seeds, sizeof *r->placement_before);
    r->placement_after = morph_alloc((size_t)p->centres, sizeof *r->placement_after);
    r->guided_lengths = morph_alloc((size_t)t->frames, links * sizeof(double));
    if (!r->placement_before || !r->placement_after || !r->guided_lengths ||
        !COPY(r->guided_time, t->time, t->frames) || !COPY(r->guided_joints, t->x, (size_t)t->frames * width))
        return MORPH_ERR_NOMEM;
    r->centres_before = p->seeds;
    r->centres_after = p->centres;
    r->guided_frames = t->frames;
    put_centres(r->placement_before, p->seed, p->seeds);
    put_centres(r->placement_after, p->centre, p->centres);
    for (int f = 0; f < t->frames; f++)
        morph_link_lengths(s, &t->x[(size_t)f * width], &r->guided_lengths[(size_t)f * links]);
    return MORPH_OK;
}

morph_status morph_record_schedule(morph_record *r, const morph_curve *curve, const morph_timing *timing,
                                   double sample) {
    const morph_structure *s = curve->structure;
    const int controls = timing->basis.count;
    const size_t width = 3 * (size_t)s->joints, links = (size_t)s->links;
    const int samples = (int)lround(timing->duration / sample) + 1;
    r->poses = curve->poses;
    r->pose_width = morph_pose_width(s);
    r->samples = samples;
    r->timing_controls = controls;
    r->timing_knots = controls + MORPH_SPLINE_ORDER;
    r->time = morph_alloc((size_t)samples, sizeof(double));
    r->schedule_joints = morph_alloc((size_t)samples, width * sizeof(double));
    r->length = morph_alloc((size_t)samples, links * sizeof(double));
    r->rate = morph_alloc((size_t)samples, links * sizeof(double));
    r->acceleration = morph_alloc((size_t)samples, links * sizeof(double));
    r->offset_schedule = morph_alloc((size_t)samples, 3 * sizeof(double));
    double *scratch = morph_alloc(4 * (size_t)r->pose_width, sizeof(double));
    double *joints = morph_alloc(4 * width, sizeof(double));
    double *by_s = morph_alloc(4 * links, sizeof(double)), *by_t = morph_alloc(4 * links, sizeof(double));
    const bool ok = COPY(r->path_s, curve->s, curve->poses) &&
                    COPY(r->path_poses, curve->pose, (size_t)curve->poses * (size_t)r->pose_width) &&
                    COPY(r->timing_knot, timing->basis.knot, r->timing_knots) &&
                    COPY(r->timing_control, timing->control, controls) &&
                    COPY(r->timing_duration, &timing->duration, 1) && r->time && r->schedule_joints &&
                    r->length && r->rate && r->acceleration && r->offset_schedule && scratch && joints &&
                    by_s && by_t;
    for (int i = 0; i < samples && ok; i++) {
        double at[4];
        /* Even times as products: a running sum would drift. */
        r->time[i] = i * sample;
        morph_timing_eval(timing, fmin(r->time[i], timing->duration), at);
        r->offset_schedule[3 * (size_t)i + 2] = morph_curve_lift(curve, at[0]);
        morph_curve_joints(curve, at[0], 3, scratch, joints);
        morph_curve_lengths(s, joints, 3, by_s);
        morph_timing_chain(s->links, by_s, at, by_t);
        memcpy(&r->schedule_joints[(size_t)i * width], joints, width * sizeof *joints);
        memcpy(&r->length[(size_t)i * links], by_t, links * sizeof *by_t);
        memcpy(&r->rate[(size_t)i * links], by_t + links, links * sizeof *by_t);
        memcpy(&r->acceleration[(size_t)i * links], by_t + 2 * links, links * sizeof *by_t);
    }
    free(scratch);
    free(joints);
    free(by_s);
    free(by_t);
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

void morph_record_replay(morph_trajectory *t, int *frames, double **time, double **joints) {
    *frames = t->frames;
    *time = t->time;
    *joints = t->x;
    t->time = t->x = NULL;
    morph_trajectory_free(t);
}

morph_status morph_record_mobility(morph_record *r, const morph_structure *s) {
    /* A dense decomposition each: five where they are cheap, start and end where they are not. */
    const int n = s->joints <= 200 ? 5 : 2;
    r->mobility_sample = morph_alloc((size_t)n, sizeof(int));
    r->mobility_rank = morph_alloc((size_t)n, sizeof(int));
    r->mobility_free = morph_alloc((size_t)n, sizeof(int));
    r->mobility_redundant = morph_alloc((size_t)n, sizeof(int));
    r->mobility_sigma_min = morph_alloc((size_t)n, sizeof(double));
    if (!r->mobility_sample || !r->mobility_rank || !r->mobility_free || !r->mobility_redundant ||
        !r->mobility_sigma_min)
        return MORPH_ERR_NOMEM;
    r->mobility_samples = n;
    for (int k = 0; k < n; k++) {
        morph_mobility m;
        const int sample = (int)((long)(r->samples - 1) * k / (n - 1));
        const morph_status status =
            morph_mobility_at(s, &r->schedule_joints[(size_t)sample * 3 * (size_t)s->joints], &m);
        if (status != MORPH_OK) return status;
        r->mobility_sample[k] = sample;
        r->mobility_rank[k] = m.rank;
        r->mobility_free[k] = m.free;
        r->mobility_redundant[k] = m.redundant;
        r->mobility_sigma_min[k] = m.sigma_min;
    }
    return MORPH_OK;
}
