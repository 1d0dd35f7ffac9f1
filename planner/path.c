/* Poses are taken from the guide at even progress and bent towards the end pose; each is moved the least that
 * its limits (with an inset) ask; a spline goes through them; where it breaks a limit between poses, a pose
 * is inserted and the spline drawn anew. */
#include "planner/path_parts.h"
#include "planner/path_whole.h"
#include "solvers/dense.h"

#include <stdlib.h>
#include <string.h>

morph_path_options morph_path_defaults(void) {
    return (morph_path_options){.end = {.length = 1e-3, .angle = 2e-3, .clearance = 0.0, .self = 1e-3},
                                .interior = {.length = 0.02, .angle = 0.03, .clearance = 0.06, .self = 0.02},
                                .intervals = 12,
                                .poses = 96,
                                .fine = 12,
                                .sweeps = 1,
                                .smoothness = 30.0,
                                .refine = true,
                                .whole = true};
}

static double *pose(morph_pather *p, int k) {
    return &p->x[(size_t)k * (size_t)p->coordinates];
}

static double rms(const double *a, const double *b, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(3.0 * sum / n);
}

static double smooth_step(double t) {
    t = fmin(1.0, fmax(0.0, t));
    return t * t * (3.0 - 2.0 * t);
}

/* First frame at which the guide has come a fraction of the way from its start to its end. */
static int frame_at(const morph_trajectory *guide, int n, double fraction) {
    const double *end = &guide->x[(size_t)(guide->frames - 1) * (size_t)n];
    const double all = rms(guide->x, end, n);
    for (int f = 0; f < guide->frames; f++)
        if (rms(&guide->x[(size_t)f * (size_t)n], end, n) <= (1.0 - fraction) * all) return f;
    return guide->frames - 1;
}

static void set_guided_poses(morph_pather *p, const morph_trajectory *guide, const double *start,
                             const double *end) {
    const int n = p->coordinates;
    const double a = p->world->structure->spacing;
    const double *last = &guide->x[(size_t)(guide->frames - 1) * (size_t)n];
    const double short_of = guide->lift && p->options->in_place ? -guide->lift[guide->frames - 1] : 0.0;
    p->count = p->options->intervals + 1;
    int at_frame = -1;

    for (int k = 0; k < p->count; k++) {
        const double progress = (double)k / (p->count - 1), bend = smooth_step(progress);
        /* Never the same frame twice: two poses alike would make the spline swing. */
        const int first = frame_at(guide, n, progress);
        at_frame = first > at_frame ? first : at_frame + 1 < guide->frames ? at_frame + 1 : at_frame;
        const double *frame = &guide->x[(size_t)at_frame * (size_t)n];
        for (int i = 0; i < n; i++) {
            double at = frame[i] + bend * (end[i] - last[i]);
            if (p->options->bent) at += (1.0 - bend) * (start[i] - guide->x[i]);
            if (k == 0) at = start[i];
            if (k == p->count - 1) at = end[i];
            pose(p, k)[i] = at / a;
        }
        p->inset[k] = 1.0;
        p->lift[k] = guide->lift ? guide->lift[at_frame] + bend * short_of : 0.0;
        p->rises = p->rises || p->lift[k] != 0.0;
    }
}

/* The guide's poses bent to the first station, then the stations themselves: each within reach of the one
 * before and inside its limits. */
static void set_stations(morph_pather *p, const morph_trajectory *guide, const double *start) {
    const double a = p->world->structure->spacing;
    const size_t width = (size_t)p->coordinates;
    const int stations = p->options->stations;
    set_guided_poses(p, guide, start, p->options->station);
    for (int m = 1; m < stations; m++) {
        for (size_t i = 0; i < width; i++)
            pose(p, p->count)[i] = p->options->station[(size_t)m * width + i] / a;
        p->lift[p->count] = p->lift[p->count - 1];
        p->inset[p->count++] = 1.0;
    }
}

/* Full inset away from the end, down to the end's own over the last quarter of the way; and from a bent
 * start, which stands as near to its limits as the end that it was. */
morph_inset morph_path_inset(const morph_pather *p, double s, double factor) {
    const double near = p->options->bent ? fmin(s, 1.0 - s) : 1.0 - s;
    const double f = factor * fmin(1.0, near / 0.25);
    const morph_inset *e = &p->options->end, *i = &p->options->interior;
    return (morph_inset){e->length + f * (i->length - e->length), e->angle + f * (i->angle - e->angle),
                         e->clearance + f * (i->clearance - e->clearance), e->self + f * (i->self - e->self)};
}

/* Solves that may die (each in a process of its own) before the path is given up: whatever killed one has
 * killed the next by then too. */
enum { MOST_DEATHS = 3 };

static void stand_target(morph_pather *p, double lift) {
    p->here.lift = lift;
}

/* Moves pose k the least from where it stands so that it holds its limits with its inset. A solver that dies
 * leaves the pose as it was: the curve's examination decides whether that matters. */
static morph_status solve_pose(morph_pather *p, int k) {
    const morph_inset inset = morph_path_inset(p, p->s[k], p->inset[k]);
    const size_t width = (size_t)p->coordinates;
    morph_violation v;
    double *before = morph_alloc(width, sizeof *before);
    if (!before) return MORPH_ERR_NOMEM;
    memcpy(before, pose(p, k), width * sizeof *before);
    stand_target(p, p->lift[k]);
    morph_status status = morph_project(p->world, &inset, 5, p->options->control, p->active, pose(p, k), &v,
                                        &p->report->effort);
    if ((status == MORPH_ERR_BACKEND || status == MORPH_ERR_NOMEM) && ++p->report->deaths <= MOST_DEATHS) {
        memcpy(pose(p, k), before, width * sizeof *before);
        status = MORPH_OK;
    }
    free(before);
    return status;
}

/* Parameter by chord length, so that the spline sees even speed. */
static void set_parameters(morph_pather *p) {
    p->s[0] = 0.0;
    for (int k = 1; k < p->count; k++)
        p->s[k] = p->s[k - 1] + 1e-6 + rms(pose(p, k), pose(p, k - 1), p->coordinates);
    for (int k = 1; k < p->count; k++)
        p->s[k] /= p->s[p->count - 1];
    p->s[p->count - 1] = 1.0;
}

static morph_status draw_curve(morph_pather *p, morph_curve **out) {
    const double a = p->world->structure->spacing;
    const size_t all = (size_t)p->count * (size_t)p->coordinates;
    for (size_t i = 0; i < all; i++)
        p->metres[i] = p->x[i] * a;
    morph_curve_destroy(*out);
    const morph_status status = morph_curve_create(p->world->structure, p->s, p->metres, p->count, out);
    if (status != MORPH_OK || !p->rises) return status;
    (*out)->lift = morph_alloc((size_t)p->count, sizeof(double));
    if (!(*out)->lift) return MORPH_ERR_NOMEM;
    memcpy((*out)->lift, p->lift, (size_t)p->count * sizeof(double));
    return MORPH_OK;
}

typedef struct breach {
    double worst, s;
    morph_limit limit;
} breach;

/* Whether the end itself breaks a limit, where the target stands then. */
static morph_status examine_end(morph_pather *p) {
    morph_violation v;
    stand_target(p, p->lift[p->count - 1]);
    const morph_status status =
        morph_pose_examine(p->world, pose(p, p->count - 1), NULL, NULL, NULL, NULL, &v);
    p->end_breaks = status == MORPH_OK && morph_violation_worst(&v, morph_pose_tolerance, NULL) > 1.0;
    return status;
}

/* Examines the curve between poses: the worst breach of every interval, and the worst violation of all. */
static morph_status examine_curve(morph_pather *p, const morph_curve *curve, breach *breaches) {
    const morph_structure *st = p->world->structure;
    double *scratch = morph_alloc((size_t)morph_pose_width(st), sizeof(double));
    double *x = morph_alloc((size_t)p->coordinates, sizeof(double));
    morph_status status = scratch && x ? MORPH_OK : MORPH_ERR_NOMEM;
    morph_path_report *r = p->report;
    for (int l = 0; l < MORPH_LIMITS; l++)
        r->violation.amount[l] = -INFINITY;
    for (int k = 0; k + 1 < p->count && status == MORPH_OK; k++) {
        breaches[k] = (breach){.worst = -INFINITY, .s = p->s[k]};
        for (int f = 0; f <= p->options->fine && status == MORPH_OK; f++) {
            const double s = p->s[k] + (p->s[k + 1] - p->s[k]) * f / p->options->fine;
            morph_violation v;
            stand_target(p, morph_curve_lift(curve, s));
            morph_curve_joints(curve, s, 0, scratch, x);
            for (int i = 0; i < p->coordinates; i++)
                x[i] /= st->spacing;
            status = morph_pose_examine(p->world, x, NULL, NULL, NULL, NULL, &v);
            morph_limit which = MORPH_LIMIT_POST;
            const double worst = morph_violation_worst(&v, morph_pose_tolerance, &which);
            if (worst > breaches[k].worst) breaches[k] = (breach){worst, s, which};
            for (int l = 0; l < MORPH_LIMITS; l++)
                if (v.amount[l] > r->violation.amount[l]) {
                    r->violation.amount[l] = v.amount[l];
                    memcpy(r->violation.element[l], v.element[l], sizeof v.element[l]);
                    r->where[l] = s;
                }
        }
    }
    free(scratch);
    free(x);
    return status;
}

static bool make_room(morph_pather *p) {
    if (p->count < p->capacity) return true;
    const int next = 2 * p->capacity;
    const size_t rows = (size_t)next, width = (size_t)p->coordinates;
    double *s = realloc(p->s, rows * sizeof *s);
    if (s) p->s = s;
    double *x = realloc(p->x, rows * width * sizeof *x);
    if (x) p->x = x;
    double *inset = realloc(p->inset, rows * sizeof *inset);
    if (inset) p->inset = inset;
    double *metres = realloc(p->metres, rows * width * sizeof *metres);
    if (metres) p->metres = metres;
    double *lift = realloc(p->lift, rows * sizeof *lift);
    if (lift) p->lift = lift;
    if (!s || !x || !inset || !metres || !lift) return false;
    p->capacity = next;
    return true;
}

/* A pose between k and k + 1, taken from the curve at s; moved inside its limits if so wanted. */
static morph_status insert_pose(morph_pather *p, const morph_curve *curve, int k, double s, bool solve) {
    if (!make_room(p)) return MORPH_ERR_NOMEM;
    const size_t width = (size_t)p->coordinates, after = (size_t)(p->count - k - 1);
    memmove(&p->s[k + 2], &p->s[k + 1], after * sizeof *p->s);
    memmove(&p->inset[k + 2], &p->inset[k + 1], after * sizeof *p->inset);
    memmove(&p->lift[k + 2], &p->lift[k + 1], after * sizeof *p->lift);
    memmove(pose(p, k + 2), pose(p, k + 1), after * width * sizeof *p->x);
    p->count++;
    p->s[k + 1] = s;
    p->lift[k + 1] = morph_curve_lift(curve, s);
    p->inset[k + 1] = 0.5 * (p->inset[k] + p->inset[k + 2]);
    double *scratch = morph_alloc((size_t)morph_pose_width(p->world->structure), sizeof(double));
    if (!scratch) return MORPH_ERR_NOMEM;
    morph_curve_joints(curve, s, 0, scratch, pose(p, k + 1));
    free(scratch);
    for (int i = 0; i < p->coordinates; i++)
        pose(p, k + 1)[i] /= p->world->structure->spacing;
    p->report->inserted++;
    return solve ? solve_pose(p, k + 1) : MORPH_OK;
}

/* Inserts a pose into every interval that breaks a limit; false in *changed when nothing could be inserted.
 */
static morph_status insert_poses(morph_pather *p, const morph_curve *curve, const breach *breaches,
                                 bool solve, bool *changed) {
    *changed = false;
    const int before = p->count;
    for (int k = before - 2; k >= 0; k--) {
        if (breaches[k].worst <= 1.0 || p->count >= p->options->poses) continue;
        /* Poses closer than this make the spline stiff rather than right. */
        const double gap = p->s[k + 1] - p->s[k];
        if (gap < 2e-3) continue;
        /* Halves keep neighbouring intervals alike, without which a quintic swings. */
        const double s = p->s[k] + 0.5 * gap;
        const morph_status status = insert_pose(p, curve, k, s, solve);
        if (status != MORPH_OK) return status;
        *changed = true;
    }
    return MORPH_OK;
}

bool morph_path_out_of_time(const morph_pather *p) {
    return morph_stopped(p->options->control) ||
           (p->options->seconds > 0.0 && morph_seconds() - p->started > p->options->seconds);
}

/* Held joints stand where they start: exactly, not as the sums and solves that moved them leave them. */
static void hold_fixed(morph_pather *p) {
    const morph_structure *st = p->world->structure;
    for (int k = 1; k < p->count; k++)
        for (int f = 0; f < st->fixed_joints; f++) {
            const size_t at = 3 * (size_t)st->fixed_joint[f];
            memcpy(&pose(p, k)[at], &pose(p, 0)[at], 3 * sizeof *p->x);
        }
}

/* Smooths the poses between the ends: min sum |y - x|^2 + weight sum |second differences|^2, coordinate by
 * coordinate one banded system; poses keep their places in the row, so even progress stays even. */
static morph_status smooth_poses(morph_pather *p, double weight) {
    const int n = p->count - 2, width = p->coordinates;
    double *matrix = morph_alloc((size_t)n, (size_t)n * sizeof(double));
    double *right = morph_alloc((size_t)n, (size_t)width * sizeof(double));
    morph_status status = matrix && right ? MORPH_OK : MORPH_ERR_NOMEM;
    for (int k = 0; k < n && status == MORPH_OK; k++) {
        matrix[(size_t)k * (size_t)n + (size_t)k] += 1.0;
        memcpy(&right[(size_t)k * (size_t)width], pose(p, k + 1), (size_t)width * sizeof *right);
    }
    /* The second difference at pose m has weights 1, -2, 1 on its neighbours; the ends are known and go to
     * the right side. */
    for (int m = 1; m <= n && status == MORPH_OK; m++)
        for (int a = -1; a <= 1; a++) {
            const double wa = a == 0 ? -2.0 : 1.0;
            const int row = m + a - 1;
            if (row < 0 || row >= n) continue;
            for (int b = -1; b <= 1; b++) {
                const double w = weight * wa * (b == 0 ? -2.0 : 1.0);
                const int column = m + b - 1;
                if (column >= 0 && column < n)
                    matrix[(size_t)row * (size_t)n + (size_t)column] += w;
                else
                    for (int i = 0; i < width; i++)
                        right[(size_t)row * (size_t)width + (size_t)i] -= w * pose(p, m + b)[i];
            }
        }
    if (status == MORPH_OK) status = morph_dense_solve(matrix, n, right, width);
    if (status == MORPH_OK) memcpy(pose(p, 1), right, (size_t)n * (size_t)width * sizeof *right);
    hold_fixed(p);
    free(matrix);
    free(right);
    return status;
}

/* Poses from the end back to the start: each a step along the straight way from the pose after it to the
 * start, moved inside its limits. Every step begins at a pose that holds, so this finds a way where the
 * guide's poses, bent to the end, are too far from one. */
static morph_status unfold_poses(morph_pather *p) {
    morph_status status = MORPH_OK;
    for (int k = p->count - 2; k > 0 && status == MORPH_OK; k--) {
        const double *from = pose(p, k + 1), *start = pose(p, 0);
        for (int i = 0; i < p->coordinates; i++)
            pose(p, k)[i] = from[i] + (start[i] - from[i]) / (k + 1);
        p->lift[k] = p->lift[k + 1] + (p->lift[0] - p->lift[k + 1]) / (k + 1);
        p->s[k] = (double)k / (p->count - 1);
        status = solve_pose(p, k);
        morph_progress(p->options->control, "path", 0.7 * (1.0 - (double)k / p->count));
        if (status == MORPH_OK && morph_stopped(p->options->control)) status = MORPH_ERR_STOPPED;
    }
    return status;
}

/* Poses by turns smoothed and moved inside their limits: both hold nearly at the end, the limits exactly. */
static morph_status settle_poses(morph_pather *p) {
    morph_status status = MORPH_OK;
    for (int sweep = 0; sweep < p->options->sweeps && status == MORPH_OK; sweep++) {
        status = smooth_poses(p, p->options->smoothness);
        if (status == MORPH_OK) set_parameters(p);
        for (int k = 1; k + 1 < p->count && status == MORPH_OK; k++) {
            status = solve_pose(p, k);
            morph_progress(p->options->control, "path",
                           0.7 * (sweep + (double)k / p->count) / p->options->sweeps);
            if (status == MORPH_OK && morph_stopped(p->options->control)) status = MORPH_ERR_STOPPED;
        }
    }
    return status;
}

/* Draws the curve and examines it: breaches (count of poses) and what the report says of it. */
static morph_status look(morph_pather *p, morph_curve **curve, breach *breaches, double *worst,
                         morph_limit *which) {
    morph_path_report *r = p->report;
    morph_status status = draw_curve(p, curve);
    if (status == MORPH_OK) status = examine_curve(p, *curve, breaches);
    *which = MORPH_LIMIT_POST;
    *worst = morph_violation_worst(&r->violation, morph_pose_tolerance, which);
    r->feasible = status == MORPH_OK && *worst <= 1.0;
    morph_log(p->options->control, "path: %d poses: worst %s %.3g at %.3f (%s)", p->count,
              morph_limit_name(*which), r->violation.amount[*which], r->where[*which],
              r->violation.element[*which]);
    return status;
}

/* How far poses keep from a limit between the ends: more than that a curve between them gains by little. */
static double room_for(const morph_inset *i, morph_limit limit) {
    switch (limit) {
    case MORPH_LIMIT_LENGTH:
        return i->length;
    case MORPH_LIMIT_ANGLE:
        return i->angle;
    case MORPH_LIMIT_SELF:
        return i->self;
    default:
        return i->clearance;
    }
}

/* Twice the inset of the poses about every interval that breaks a limit by no more than that can help: it is
 * then taken for mended. */
static bool step_back(morph_pather *p, breach *breaches) {
    bool any = false;
    for (int k = 0; k + 1 < p->count; k++) {
        const double amount = breaches[k].worst * morph_pose_tolerance[breaches[k].limit];
        if (breaches[k].worst <= 1.0 || amount > room_for(&p->options->interior, breaches[k].limit)) continue;
        for (int m = k; m <= k + 1; m++)
            if (m > 0 && m + 1 < p->count && p->inset[m] < 2.0) {
                p->inset[m] = 2.0;
                breaches[k].worst = 0.0;
                any = true;
            }
    }
    return any;
}

morph_status morph_path_give_room(morph_pather *p, morph_curve **curve, bool poses, bool *more) {
    double worst;
    morph_limit which;
    *more = false;
    breach *breaches = morph_alloc((size_t)p->count, sizeof *breaches);
    if (!breaches) return MORPH_ERR_NOMEM;
    morph_status status = look(p, curve, breaches, &worst, &which);
    if (status == MORPH_OK && !p->report->feasible) {
        const bool stepped = !poses && step_back(p, breaches);
        status = insert_poses(p, *curve, breaches, false, more);
        *more = *more || stepped;
    }
    free(breaches);
    return status;
}

/* A breach (spacings, rad) of a curve that is no longer one between its poses. */
static const double swings = 0.5;

/* One round of mending: false in *more when the curve holds, or no more poses would help. */
static morph_status mend_once(morph_pather *p, morph_curve **curve, morph_kept *best, double *least,
                              double *before, bool *more) {
    *more = false;
    breach *breaches = morph_alloc((size_t)p->count, sizeof *breaches);
    if (!breaches) return MORPH_ERR_NOMEM;
    morph_path_report *r = p->report;
    double worst;
    morph_limit which;
    morph_status status = look(p, curve, breaches, &worst, &which);
    /* More poses that do not bring it closer are no use; nor are they where poses that follow each other from
     * the end turn so far that the curve swings between them. */
    const bool hopeless = (worst > 0.9 * *before && r->violation.amount[which] > 0.05) ||
                          (p->options->unfold && r->violation.amount[which] > swings);
    *before = worst;
    if (status == MORPH_OK && !r->feasible && worst < *least) {
        status = morph_keep(p, curve, INFINITY, best);
        *least = worst;
    }
    if (status == MORPH_OK && !r->feasible && p->options->refine && !hopeless && !p->end_breaks &&
        !morph_path_out_of_time(p))
        status = insert_poses(p, *curve ? *curve : best->curve, breaches, true, more);
    free(breaches);
    return status;
}

morph_status morph_path_mend(morph_pather *p, morph_curve **curve) {
    morph_status status = MORPH_OK;
    morph_kept best = {0};
    double least = INFINITY, before = INFINITY;
    bool more = true;
    for (int round = 0; round < 12 && status == MORPH_OK && more; round++)
        status = mend_once(p, curve, &best, &least, &before, &more);
    if (best.curve && !p->report->feasible) morph_put_back(&best, p, curve);
    morph_kept_free(&best);
    return status;
}

/* Poses that hold, with a curve between them that breaks limits by less than this (spacings, rad), may be
 * near a path that holds: moved as a whole it loses what folds it has. A curve further off swings. */
static const double near_enough = 0.3;

static bool holds_nearly(const morph_pather *p) {
    if (p->end_breaks || p->report->feasible || !morph_path_whole_fits(p)) return false;
    for (int l = 0; l < MORPH_LIMITS; l++)
        if (p->report->violation.amount[l] > near_enough) return false;
    return true;
}

static morph_status run(morph_pather *p, morph_curve **curve) {
    morph_status status = MORPH_OK;
    hold_fixed(p);
    set_parameters(p);
    if (p->options->refine) status = p->options->unfold ? unfold_poses(p) : settle_poses(p);
    if (!p->options->refine && p->options->smooth) status = smooth_poses(p, p->options->smoothness);
    if (status == MORPH_OK) set_parameters(p);
    if (status == MORPH_OK) status = examine_end(p);
    if (status == MORPH_OK) status = morph_path_mend(p, curve);
    const morph_path_options *o = p->options;
    const bool worth = p->report->feasible || (o->nearly && holds_nearly(p));
    if (status == MORPH_OK && o->refine && o->whole && worth) status = morph_path_whole(p, curve);
    return status;
}

morph_status morph_path_plan(const morph_world *world, const morph_trajectory *guide, const double *start,
                             const double *end, const morph_path_options *options, morph_curve **out,
                             morph_path_report *report) {
    *out = NULL;
    *report = (morph_path_report){.rows_possible = morph_possible_rows(world->structure)};
    morph_pather p = {.here = *world,
                      .options = options,
                      .report = report,
                      .coordinates = 3 * world->structure->joints,
                      .capacity = options->intervals + options->stations + 8,
                      .started = morph_seconds()};
    p.world = &p.here;
    const size_t rows = (size_t)p.capacity, width = (size_t)p.coordinates;
    p.s = morph_alloc(rows, sizeof(double));
    p.x = morph_alloc(rows * width, sizeof(double));
    p.inset = morph_alloc(rows, sizeof(double));
    p.metres = morph_alloc(rows * width, sizeof(double));
    p.lift = morph_alloc(rows, sizeof(double));
    morph_status status = p.lift && p.s && p.x && p.inset && p.metres ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = morph_active_create(world->structure, &p.active);
    if (status == MORPH_OK) {
        if (options->stations > 0)
            set_stations(&p, guide, start);
        else
            set_guided_poses(&p, guide, start, end);
        status = run(&p, out);
    }
    report->poses = p.count;
    report->seconds = morph_seconds() - p.started;
    free(p.s);
    free(p.x);
    free(p.inset);
    free(p.metres);
    free(p.lift);
    morph_active_destroy(p.active);
    return status;
}
