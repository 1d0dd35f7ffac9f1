/** The feasible beginning of a path that breaks a limit further on: better than none where there is no time,
 * or no solver, for more. */
#include "planner/plan_internal.h"

#include <stdlib.h>

/* The piece is drawn anew through so many of its poses, and examined at so many points. */
enum { POSES = 24, POINTS = 6 * POSES };

/* A beginning as short as this is no motion. */
static const double least_piece = 0.01;

/* The largest even parameter before which every point of the curve holds its limits; 1 where all do, 0 where
 * not even the start does. x: 3*joints, scratch: a pose. */
static morph_status holds_until(const morph_world *world, const morph_curve *curve, double *scratch,
                                double *x, double *until) {
    const morph_structure *st = world->structure;
    morph_world here = *world;
    morph_status status = MORPH_OK;
    *until = 0.0;
    for (int k = 0; k <= POINTS && status == MORPH_OK; k++) {
        morph_violation v;
        const double s = (double)k / POINTS;
        morph_curve_joints(curve, s, 0, scratch, x);
        for (int i = 0; i < 3 * st->joints; i++)
            x[i] /= st->spacing;
        here.lift = morph_curve_lift(curve, s);
        status = morph_pose_examine(&here, x, NULL, NULL, NULL, NULL, &v);
        if (status != MORPH_OK || morph_violation_worst(&v, morph_pose_tolerance, NULL) > 1.0) break;
        *until = s;
    }
    return status;
}

/* The curve up to `end`, through POSES of its poses. */
static morph_status cut(const morph_curve *curve, double end, double *scratch, morph_curve **out) {
    const size_t width = 3 * (size_t)curve->structure->joints;
    double *x = morph_alloc(POSES, width * sizeof *x), s[POSES];
    if (!x) return MORPH_ERR_NOMEM;
    for (int k = 0; k < POSES; k++) {
        s[k] = (double)k / (POSES - 1);
        morph_curve_joints(curve, end * s[k], 0, scratch, &x[(size_t)k * width]);
    }
    morph_status status = morph_curve_create(curve->structure, s, x, POSES, out);
    free(x);
    if (status == MORPH_OK && curve->lift && !((*out)->lift = morph_alloc(POSES, sizeof(double))))
        status = MORPH_ERR_NOMEM;
    for (int k = 0; k < POSES && status == MORPH_OK && curve->lift; k++)
        (*out)->lift[k] = morph_curve_lift(curve, end * s[k]);
    return status;
}

morph_status morph_planner_trim(const morph_planner *p, const morph_curve *curve, morph_curve **out,
                                double *kept) {
    const morph_world *world = &p->work.world;
    double *scratch = morph_alloc((size_t)morph_pose_width(world->structure), sizeof *scratch);
    double *x = morph_alloc(3 * (size_t)world->structure->joints, sizeof *x);
    morph_status status = scratch && x ? MORPH_OK : MORPH_ERR_NOMEM;
    double end = 1.0, until = 0.0;
    *out = NULL;
    *kept = 0.0;
    if (status == MORPH_OK) status = holds_until(world, curve, scratch, x, &end);
    /* The new spline differs a little between its poses, and ends closer to the limit than it was seen: what
     * breaks is cut off again. */
    while (status == MORPH_OK && !*out && end > least_piece) {
        morph_curve *piece = NULL;
        status = cut(curve, end, scratch, &piece);
        if (status == MORPH_OK) status = holds_until(world, piece, scratch, x, &until);
        if (status == MORPH_OK && until >= 1.0) {
            *out = piece;
            *kept = end;
        } else {
            morph_curve_destroy(piece);
            end *= fmin(until, 0.98);
        }
    }
    free(scratch);
    free(x);
    return status;
}
