/* The goal: mean and largest gap and coverage at the end of the schedule, by their definitions (README, "What
 * the numbers mean"), from the record alone: its skin, its target where it stands, its base. Samples,
 * vertical lines and sums are our own; of the model only distances to meshes are used. */
#include "planner/check_parts.h"

#include "model/distance.h"

#include <stdio.h>
#include <stdlib.h>

/* Sides of a skin triangle are cut in this many parts: 9 pieces of equal area. */
enum { CUT = 3 };

typedef struct yardstick {
    const morph_record *r;
    morph_mesh target;
    morph_distance *exact, *skin;
    double *end; /* 3*joints: the last sample, seen from where the target stands */
    double radius;
    double value[MORPH_GOAL_KINDS];
    int widest; /* skin triangle of the largest gap */
} yardstick;

/* A skin triangle's area at the start, in cells: nodes stand on a square grid then. */
static double start_area(const morph_record *r, int triangle) {
    const int *a = r->joint_node[r->skin[triangle][0]], *b = r->joint_node[r->skin[triangle][1]],
              *c = r->joint_node[r->skin[triangle][2]];
    const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
    return 0.5 * fabs(ux * vy - uy * vx);
}

static double gap_at(const yardstick *y, const double p[3]) {
    morph_closest closest;
    morph_distance_point(y->exact, p, &closest);
    double distance = closest.distance;
    if (!isnan(y->r->base)) distance = fmin(distance, p[2] - y->r->base);
    return fmax(0, distance - y->radius);
}

/* Centroids of the pieces: with corners (i, j), (i+1, j), (i, j+1) in parts of the sides for the upright ones
 * and (i+1, j), (i, j+1), (i+1, j+1) for those between. */
static void measure_gaps(yardstick *y) {
    const morph_record *r = y->r;
    double whole = 0, sum = 0, most = -1;
    for (int t = 0; t < r->skin_triangles; t++) {
        const double piece = start_area(r, t) / (CUT * CUT);
        for (int i = 0; i < CUT; i++)
            for (int j = 0; i + j < CUT; j++)
                for (int between = 0; between < 2 && i + j + between < CUT; between++) {
                    const double u = (i + (1 + between) / 3.0) / CUT, v = (j + (1 + between) / 3.0) / CUT;
                    double p[3];
                    for (int k = 0; k < 3; k++)
                        p[k] = (1 - u - v) * y->end[3 * r->skin[t][0] + k] +
                               u * y->end[3 * r->skin[t][1] + k] + v * y->end[3 * r->skin[t][2] + k];
                    const double gap = gap_at(y, p);
                    whole += piece;
                    sum += piece * gap;
                    if (gap <= most) continue;
                    most = gap;
                    y->widest = t;
                }
    }
    y->value[MORPH_GOAL_MEAN_GAP] = whole > 0 ? sum / whole : 0;
    y->value[MORPH_GOAL_MAX_GAP] = fmax(0, most);
}

/* Highest crossing of a vertical line with the target; false if there is none. */
static morph_status first_hit(const yardstick *y, double at_x, double at_y, double **z, int **sign, int *room,
                              double *height, bool *hit) {
    const int count = morph_vertical_hits(y->exact, at_x, at_y, *z, *sign, *room);
    *hit = count > 0;
    if (count > *room) {
        free(*z);
        free(*sign);
        *z = morph_alloc((size_t)count, sizeof **z);
        *sign = morph_alloc((size_t)count, sizeof **sign);
        *room = *z && *sign ? count : 0;
        if (*room == 0) return MORPH_ERR_NOMEM;
        morph_vertical_hits(y->exact, at_x, at_y, *z, *sign, *room);
    }
    if (*hit) *height = (*z)[count - 1];
    return MORPH_OK;
}

/* Lines stand in the middle of cells of an eighth of the spacing (wider where a target is so large that there
 * would be more than 20,000), at least 8 along each side; all have the same projected area. */
static morph_status measure_coverage(yardstick *y) {
    const morph_record *r = y->r;
    double lo[2] = {INFINITY, INFINITY}, wide[2];
    int lines[2], room = 0, hits = 0, covered = 0;
    double *z = NULL;
    int *sign = NULL;
    for (int k = 0; k < 2; k++) {
        double hi = -INFINITY;
        for (int i = 0; i < 3 * y->target.triangles; i++) {
            const double v = y->target.v[3 * y->target.t[i] + k];
            lo[k] = fmin(lo[k], v);
            hi = fmax(hi, v);
        }
        wide[k] = hi - lo[k];
    }
    const double cell = fmax(r->spacing / 8, sqrt(wide[0] / 20000 * wide[1]));
    for (int k = 0; k < 2; k++)
        lines[k] = (int)fmin(fmax(8, ceil(wide[k] / cell)), 20000);
    morph_status status = MORPH_OK;
    for (int i = 0; i < lines[0] && status == MORPH_OK; i++)
        for (int j = 0; j < lines[1] && status == MORPH_OK; j++) {
            double p[3] = {lo[0] + (i + 0.5) * (wide[0] / lines[0]), lo[1] + (j + 0.5) * (wide[1] / lines[1]),
                           0};
            bool hit = false;
            status = first_hit(y, p[0], p[1], &z, &sign, &room, &p[2], &hit);
            if (status != MORPH_OK || !hit || p[2] < r->base) continue;
            morph_closest closest;
            morph_distance_point(y->skin, p, &closest);
            hits++;
            /* |distance|: an open surface has no inside. */
            covered += fabs(closest.distance) - y->radius <= r->spacing / 4;
        }
    free(z);
    free(sign);
    y->value[MORPH_GOAL_COVERAGE] = hits > 0 ? (double)covered / hits : 1;
    return status;
}

static morph_status yardstick_create(const morph_record *r, yardstick *y) {
    const size_t n = 3 * (size_t)r->joints, last = (size_t)r->samples - 1;
    *y = (yardstick){.r = r, .radius = morph_check_radius(r)};
    y->target = r->deformed_v
                    ? (morph_mesh){r->deformed_vertices, r->deformed_triangles, r->deformed_v, r->deformed_t}
                    : (morph_mesh){r->target_vertices, r->target_triangles, r->target_v, r->target_t};
    y->end = morph_alloc(n, sizeof(double));
    if (!y->end) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < n; i++)
        y->end[i] = r->schedule_joints[last * n + i] -
                    (r->offset_schedule ? r->offset_schedule[3 * last + i % 3] : 0);
    bool closed = false;
    morph_status status = morph_check_closed(&y->target, &closed);
    if (status == MORPH_OK) status = morph_distance_create(&y->target, closed, &y->exact);
    const morph_mesh skin = {r->joints, r->skin_triangles, y->end, r->skin[0]};
    if (status == MORPH_OK) status = morph_distance_create(&skin, false, &y->skin);
    return status;
}

/* "mean_gap 0.0123 m, wanted 0.01 m", of the largest gap with its place. */
static void say(const yardstick *y, morph_goal_kind kind, morph_finding *m) {
    char place[48] = "";
    const char *unit = kind == MORPH_GOAL_COVERAGE ? "" : " m";
    if (kind == MORPH_GOAL_MAX_GAP) {
        const int *node = y->r->joint_node[y->r->skin[y->widest][0]];
        snprintf(place, sizeof place, " at skin triangle %d at (%d,%d)", y->widest, node[0], node[1]);
    }
    snprintf(m->said, sizeof m->said, "%s %.4g%s%s, wanted %.4g%s", morph_goal_name(kind), y->value[kind],
             unit, place, y->r->goal.limit[kind], unit);
    m->unit = morph_goal_unit(kind);
}

/* The worst of those asked for: gaps in spacings, coverage as it is, so that a tenth is much of either. */
morph_status morph_check_goal(const morph_record *r, morph_findings *f) {
    if (!morph_goal_any(&r->goal)) return MORPH_OK;
    if (r->skin_triangles < 1) {
        morph_findings_defect(f, "a goal, but no skin");
        return MORPH_OK;
    }
    yardstick y;
    morph_status status = yardstick_create(r, &y);
    if (status == MORPH_OK) status = measure_coverage(&y);
    if (status == MORPH_OK) {
        measure_gaps(&y);
        double least = INFINITY;
        for (int k = 0; k < MORPH_GOAL_KINDS; k++) {
            if (!(r->goal.limit[k] > 0)) continue;
            const double limit = r->goal.limit[k], value = y.value[k],
                         scale = k == MORPH_GOAL_COVERAGE ? 1 : r->spacing,
                         margin = k == MORPH_GOAL_COVERAGE ? value - limit : limit - value;
            if (!(margin / scale < least)) continue;
            least = margin / scale;
            morph_finding *m = &f->kind[MORPH_MARGIN_GOAL];
            /* 1e-9 of the limit is the rounding of the sums; the goal itself is hard. */
            morph_finding_begin(m, 1e-9 * limit, scale);
            m->worst = margin;
            m->time = r->time[r->samples - 1];
            say(&y, (morph_goal_kind)k, m);
        }
    }
    morph_distance_destroy(y.exact);
    morph_distance_destroy(y.skin);
    free(y.end);
    return status;
}
