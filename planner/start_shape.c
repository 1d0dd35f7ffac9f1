/* The pose of measured lengths: of the many that most lengths allow, one whose angles hold and whose links do
 * not cross. Lengths go from those of the flat shape to the measured ones in steps; at each the pose moves
 * the least that the lengths, as equalities, and the limits ask. */
#include "model/kinematics.h"
#include "planner/project.h"
#include "planner/start_parts.h"

#include <stdlib.h>
#include <string.h>

/* A step changes no length by more than this share of a spacing: solves of small moves are sure, and a pose
 * that follows in small steps stays on its side of a fold. */
static const double longest_step = 0.05;
enum { MOST_STEPS = 40 };

/* Poses are solved against a target, so there is one: a box far below, that no row ever sees. */
typedef struct nowhere {
    morph_mesh mesh;
    morph_distance *exact;
    morph_sdf *sdf;
} nowhere;

static void leave(nowhere *n) {
    morph_sdf_destroy(n->sdf);
    morph_distance_destroy(n->exact);
    morph_mesh_free(&n->mesh);
}

static morph_status make_nowhere(double spacing, nowhere *out) {
    const double size[3] = {spacing, spacing, spacing};
    double lo[3], hi[3];
    *out = (nowhere){0};
    morph_status status = morph_mesh_box(size, &out->mesh);
    for (int i = 0; i < out->mesh.vertices && status == MORPH_OK; i++)
        out->mesh.v[3 * i + 2] -= 1e4 * spacing;
    for (int k = 0; k < 3; k++) {
        lo[k] = -spacing - (k == 2 ? 1e4 * spacing : 0.0);
        hi[k] = lo[k] + 2.0 * spacing;
    }
    if (status == MORPH_OK) status = morph_distance_create(&out->mesh, true, &out->exact);
    if (status == MORPH_OK) status = morph_sdf_create(out->exact, lo, hi, 0.25 * spacing, NULL, &out->sdf);
    if (status != MORPH_OK) leave(out);
    return status;
}

static int steps_for(const morph_structure *s, const double *length) {
    double most = 0.0;
    for (int l = 0; l < s->links; l++)
        most = fmax(most, fabs(length[l] - s->start_length[l]));
    return (int)fmin(MOST_STEPS, 1.0 + floor(most / (longest_step * s->spacing)));
}

/* One solve at a share of the way. x: 3*joints, spacings; s's limits are overwritten. */
static morph_status solve_at(morph_structure *s, const morph_world *world, const double *length, double share,
                             morph_active *active, double *x, bool *holds) {
    /* Rounding, and what the last move to the very lengths takes. */
    const morph_inset inset = {.angle = 1e-4, .self = 1e-4};
    morph_effort effort = {0};
    morph_violation v;
    for (int l = 0; l < s->links; l++)
        s->length_limit[l][0] = s->length_limit[l][1] =
            s->start_length[l] + share * (length[l] - s->start_length[l]);
    const morph_status status = morph_project(world, &inset, 8, NULL, active, x, &v, &effort);
    *holds = status == MORPH_OK && morph_violation_worst(&v, morph_pose_tolerance, NULL) <= 1.0;
    return status;
}

/* A step that fails is halved, a few times. */
static morph_status follow(morph_structure *s, const morph_world *world, const double *length, double *x,
                           bool *holds) {
    const size_t bytes = 3 * (size_t)s->joints * sizeof *x;
    const double first = 1.0 / steps_for(s, length);
    double *before = morph_alloc(bytes, 1), share = 0.0, step = first;
    morph_active *active = NULL;
    morph_status status = before ? morph_active_create(s, &active) : MORPH_ERR_NOMEM;
    *holds = true;
    while (status == MORPH_OK && share < 1.0 && step > first / 20.0) {
        const double next = share + step > 1.0 - 1e-9 ? 1.0 : share + step;
        memcpy(before, x, bytes);
        status = solve_at(s, world, length, next, active, x, holds);
        if (*holds) {
            share = next;
        } else {
            memcpy(x, before, bytes);
            step *= 0.5;
        }
    }
    *holds = status == MORPH_OK && share == 1.0;
    morph_active_destroy(active);
    free(before);
    return status;
}

morph_status morph_start_shape(const morph_structure_def *def, const double *length, double *pose,
                               bool *holds) {
    morph_structure *s = NULL;
    nowhere target = {0};
    *holds = false;
    /* Poses are solved for these only. */
    if (def->layout != MORPH_LAYOUT_POSTS || def->joints != MORPH_JOINTS_BALL) return MORPH_OK;
    morph_status status = morph_structure_create(def, &s);
    if (status != MORPH_OK) return status;
    const size_t n = 3 * (size_t)s->joints;
    double *x = morph_alloc(n, sizeof *x);
    status = x ? make_nowhere(s->spacing, &target) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        const morph_world world = {.structure = s, .exact = target.exact, .sdf = target.sdf, .base = NAN};
        for (size_t i = 0; i < n; i++)
            x[i] = s->start[i] / s->spacing;
        status = follow(s, &world, length, x, holds);
        for (size_t i = 0; i < n && *holds; i++)
            pose[i] = x[i] * s->spacing;
        leave(&target);
    }
    free(x);
    morph_structure_destroy(s);
    return status == MORPH_ERR_NOMEM ? status : MORPH_OK;
}
