/* The whole path as one program. With the ends fixed and the parameter s of every pose kept,
 *
 *     minimise  sum over intervals h sum over links (L' / rate)^2
 *             + sum over inner poses h (SECOND sum over links (L'' / acceleration)^2 + BEND |x''|^2)
 *
 * with L', L'', x'' divided differences, L lengths, x scaled joints, h the span of s that a difference stands
 * for, subject to the limits of every pose. The least of the first sum is the path on which every length runs
 * evenly from its start to its end: a schedule needs no longer for it than the link with the furthest to go.
 * The second keeps accelerations from what the limits of poses bend; the third what lengths leave free
 * (where the structure falls, which way it turns) smooth. */
#include "planner/path_whole.h"

#include "planner/timing.h"
#include "planner/timing_bound.h"

#include <stdlib.h>
#include <string.h>

static double pose_length(const morph_structure *s, const double *x, int pose, int link, double unit[3]) {
    const double *at = &x[3 * (size_t)s->joints * (size_t)pose];
    morph_sub(&at[3 * s->link[link][1]], &at[3 * s->link[link][0]], unit);
    const double length = morph_norm(unit);
    for (int k = 0; k < 3; k++)
        unit[k] /= length;
    return length;
}

static double sway_of(const morph_sway_term *d, const double *x, int link, double unit[][3],
                      double length[]) {
    double sum = 0.0;
    for (int k = 0; k < d->poses; k++) {
        length[k] = pose_length(d->structure, x, k, link, unit[k]);
        sum += d->coefficient[k] * length[k];
    }
    return sum * d->structure->spacing / d->limit[link];
}

static morph_status sway_value(void *data, const double *x, double *f) {
    const morph_sway_term *d = data;
    double unit[MORPH_SWAY][3], length[MORPH_SWAY];
    f[0] = 0.0;
    for (int l = 0; l < d->structure->links; l++)
        f[0] += d->scale * pow(sway_of(d, x, l, unit, length), 2.0);
    return MORPH_OK;
}

/* With g_k = c_k / limit * u_k, the gradient of r by the end joint's place in pose k (by the other joint the
 * opposite):  f' = 2 r g,  f'' = 2 g g^T + 2 r c_k / limit (I - u u^T) / length. */
static void sway_hessian(const morph_sway_term *d, int link, double r, double unit[][3],
                         const double length[], double weight, morph_sink *sink) {
    const morph_structure *s = d->structure;
    const double scale = s->spacing / d->limit[link], outer = 2.0 * weight, own = 2.0 * weight * r;
    for (int k = 0; k < d->poses; k++)
        for (int m = 0; m <= k; m++)
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) {
                    const double ck = d->coefficient[k] * scale, cm = d->coefficient[m] * scale;
                    double h = outer * ck * cm * unit[k][i] * unit[m][j];
                    if (k == m) h += own * ck * ((i == j) - unit[k][i] * unit[k][j]) / length[k];
                    for (int a = 0; a < 2; a++)
                        for (int b = 0; b < 2; b++) {
                            const int u = 3 * (k * s->joints + s->link[link][a]) + i,
                                      v = 3 * (m * s->joints + s->link[link][b]) + j;
                            if (k == m && u < v) continue;
                            morph_sink_hessian(sink, u, v, a == b ? h : -h);
                        }
                }
}

static morph_status sway_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_sway_term *d = data;
    const morph_structure *s = d->structure;
    double unit[MORPH_SWAY][3], length[MORPH_SWAY];
    for (int l = 0; l < s->links; l++) {
        const double r = sway_of(d, x, l, unit, length), scale = s->spacing / d->limit[l];
        for (int k = 0; k < d->poses && morph_sink_wants_jacobian(sink); k++)
            for (int i = 0; i < 3; i++) {
                const double g = 2.0 * d->scale * r * d->coefficient[k] * scale * unit[k][i];
                morph_sink_jacobian(sink, 0, 3 * (k * s->joints + s->link[l][1]) + i, g);
                morph_sink_jacobian(sink, 0, 3 * (k * s->joints + s->link[l][0]) + i, -g);
            }
        if (morph_sink_wants_hessian(sink)) sway_hessian(d, l, r, unit, length, weight[0] * d->scale, sink);
    }
    return MORPH_OK;
}

morph_block morph_block_sway(morph_sway_term *data, const int *unknown) {
    return (morph_block){.name = "sway",
                         .unknowns = 3 * data->structure->joints * data->poses,
                         .unknown = unknown,
                         .data = data,
                         .value = sway_value,
                         .walk = sway_walk};
}

static double bend_of(const morph_bend_term *d, const double *x, int i) {
    double sum = 0.0;
    for (int k = 0; k < d->poses; k++)
        sum += d->coefficient[k] * x[k * d->coordinates + i];
    return sum;
}

static morph_status bend_value(void *data, const double *x, double *f) {
    const morph_bend_term *d = data;
    f[0] = 0.0;
    for (int i = 0; i < d->coordinates; i++)
        f[0] += d->scale * pow(bend_of(d, x, i), 2.0);
    return MORPH_OK;
}

static morph_status bend_walk(void *data, const double *x, const double *weight, morph_sink *sink) {
    const morph_bend_term *d = data;
    for (int i = 0; i < d->coordinates; i++) {
        const double r = bend_of(d, x, i);
        for (int k = 0; k < d->poses; k++) {
            const double g = 2.0 * d->scale * d->coefficient[k];
            if (morph_sink_wants_jacobian(sink)) morph_sink_jacobian(sink, 0, k * d->coordinates + i, g * r);
            for (int m = 0; m <= k && morph_sink_wants_hessian(sink); m++)
                morph_sink_hessian(sink, k * d->coordinates + i, m * d->coordinates + i,
                                   weight[0] * g * d->coefficient[m]);
        }
    }
    return MORPH_OK;
}

morph_block morph_block_bend(morph_bend_term *data, const int *unknown) {
    return (morph_block){.name = "bend",
                         .unknowns = data->coordinates * data->poses,
                         .unknown = unknown,
                         .data = data,
                         .value = bend_value,
                         .walk = bend_walk};
}

/* Intervals to begin with: few make the program small, and a path this smooth needs no more. With 6 the curve
 * broke limits between its poses on two of five scenes of 8 x 8 nodes, and the poses that mend it made the
 * schedule longer; with 10 schedules are at most 3 % shorter, for twice the time. */
enum { INTERVALS = 8 };

/* Poses stand so much closer than evenly at an end that touches its limits (there by 1 - CLOSER, away from it
 * by 1 + CLOSER): the room that poses leave for the curve between them goes to nothing there. With 0.5
 * the curve over a box of 8 x 8 nodes broke a limit there, with 0.65 that of 4 x 4, with 0.6 none of nine
 * scenes. */
static const double CLOSER = 0.6;

/* Weights beside (L' / rate)^2, 1/s^2 and s^2. SECOND: without it schedules are up to 5 % longer (a step of
 * 8 x 8 nodes), with 0.5 and 1.5 up to 3 % shorter, but over a box then a limit breaks between poses. BEND: a
 * third of it leaves folds between poses there, three times as much costs 5 %. */
static const double SECOND = 0.2, BEND = 0.01;

/* Free unknowns that it is tried with: 24 x 24 nodes. An iteration takes 0.02 s at 4 x 4 nodes, 0.15 s at
 * 8 x 8, 0.6 s at 12 x 12 and 1.4 s at 16 x 16. */
enum { MOST_UNKNOWNS = 26000 };

/* Iterations of all solves of a path together; of one at most three quarters of them. The first converges in
 * 25 at 8 x 8 nodes and in 60 at 16 x 16, a second, with the rows that it broke, in 40, a third in 20. Below
 * 8 x 8 more in proportion, for they are cheap: paths of small structures around large targets take a hundred
 * and more. */
enum { ITERATIONS = 130, ITERATIONS_UNKNOWNS = 2688, MOST_ITERATIONS = 200 };

static int all_iterations(const morph_pather *p) {
    const int all = ITERATIONS * ITERATIONS_UNKNOWNS / ((INTERVALS - 1) * p->coordinates);
    return all < ITERATIONS ? ITERATIONS : all < MOST_ITERATIONS ? all : MOST_ITERATIONS;
}

/* Solves in a row that take in rows which the one before broke, and passes that give the curve room. */
enum { ROUNDS = 4, PASSES = 3 };

/* Schedules are compared at this sample, s: they agree with those at 1 ms to a thousandth. */
static const double sample = 0.01;

/* A path within a fiftieth of what its slowest link alone needs is not worth the time. */
static const double near_bound = 1.02;

typedef struct mover {
    morph_pather *p;
    morph_control quiet;
    int poses;             /* that there were at create */
    int *left, most;       /* iterations: of all solves, of one */
    double *reference;     /* the poses as they were: the box stands about them */
    double *lower, *upper; /* of all coordinates of all poses */
    int *index;            /* of all coordinates: a block's own begin where its first pose does */
    morph_active **active; /* poses */
    morph_sway_term *sway; /* 2 x poses */
    morph_bend_term *bend; /* poses */
    morph_block *block;
    int blocks, sways;
} mover;

static void mover_free(mover *m) {
    for (int k = 0; m->active && k < m->poses; k++)
        morph_active_destroy(m->active[k]);
    free(m->active);
    free(m->reference);
    free(m->lower);
    free(m->upper);
    free(m->index);
    free(m->sway);
    free(m->bend);
    free(m->block);
}

static morph_status mover_create(morph_pather *p, int *left, mover *m) {
    const size_t count = (size_t)p->count, all = count * (size_t)p->coordinates;
    *m = (mover){.p = p, .poses = p->count, .left = left, .most = all_iterations(p) * 3 / 4};
    if (p->options->control) m->quiet = *p->options->control;
    m->quiet.log = NULL;
    m->quiet.progress = NULL;
    m->reference = morph_alloc(all, sizeof(double));
    m->lower = morph_alloc(all, sizeof(double));
    m->upper = morph_alloc(all, sizeof(double));
    m->index = morph_alloc(all, sizeof(int));
    m->active = morph_alloc(count, sizeof *m->active);
    m->sway = morph_alloc(2 * count, sizeof *m->sway);
    m->bend = morph_alloc(count, sizeof *m->bend);
    m->block = morph_alloc(count * (MORPH_POSE_BLOCKS + 3), sizeof *m->block);
    morph_status status =
        m->reference && m->lower && m->upper && m->index && m->active && m->sway && m->bend && m->block
            ? MORPH_OK
            : MORPH_ERR_NOMEM;
    for (int k = 0; k < p->count && status == MORPH_OK; k++)
        status = morph_active_create(p->world->structure, &m->active[k]);
    if (status != MORPH_OK) return status;
    memcpy(m->reference, p->x, all * sizeof *p->x);
    for (size_t i = 0; i < all; i++)
        m->index[i] = (int)i;
    return MORPH_OK;
}

static double *pose(const morph_pather *p, int k) {
    return &p->x[(size_t)k * (size_t)p->coordinates];
}

/* The n values at s[0..n-1] as a divided difference times (n - 1)!: the derivative of that order. */
static void difference(const double *s, int n, double *out) {
    double factorial = 1.0;
    for (int k = 2; k < n; k++)
        factorial *= k;
    for (int k = 0; k < n; k++) {
        out[k] = factorial;
        for (int m = 0; m < n; m++)
            if (m != k) out[k] /= s[k] - s[m];
    }
}

static void add_sway(mover *m, int k, int poses, const double *limit, double scale) {
    morph_sway_term *t = &m->sway[m->sways++];
    *t = (morph_sway_term){
        .structure = m->p->world->structure, .poses = poses, .limit = limit, .scale = scale};
    difference(&m->p->s[k], poses, t->coefficient);
    m->block[m->blocks++] = morph_block_sway(t, &m->index[k * m->p->coordinates]);
}

static void add_terms(mover *m) {
    const morph_pather *p = m->p;
    const morph_structure *s = p->world->structure;
    m->sways = 0;
    for (int k = 0; k + 1 < p->count; k++) {
        add_sway(m, k, 2, s->rate_limit, p->s[k + 1] - p->s[k]);
        if (k + 2 >= p->count) break;
        const double span = 0.5 * (p->s[k + 2] - p->s[k]);
        add_sway(m, k, 3, s->acceleration_limit, SECOND * span);
        m->bend[k] = (morph_bend_term){.coordinates = p->coordinates, .poses = 3, .scale = BEND * span};
        difference(&p->s[k], 3, m->bend[k].coefficient);
        m->block[m->blocks++] = morph_block_bend(&m->bend[k], &m->index[k * p->coordinates]);
    }
}

/* Bounds, rows and terms of the program as the poses stand. The ends are fixed by their bounds. */
static morph_status build(mover *m) {
    morph_pather *p = m->p;
    const double reach = 1.0; /* as of a projection: keeps a failing solve from wandering off */
    m->blocks = 0;
    for (int k = 0; k < p->count; k++) {
        const size_t at = (size_t)k * (size_t)p->coordinates;
        if (k == 0 || k == p->count - 1) {
            memcpy(&m->lower[at], pose(p, k), (size_t)p->coordinates * sizeof *p->x);
            memcpy(&m->upper[at], pose(p, k), (size_t)p->coordinates * sizeof *p->x);
            continue;
        }
        const morph_inset inset = morph_path_inset(p, p->s[k], p->inset[k]);
        morph_pose_bounds(p->world, inset.clearance, &m->lower[at]);
        morph_pose_box(p->world, &m->lower[at], &m->reference[at], reach, &m->lower[at], &m->upper[at]);
        p->here.lift = p->lift[k];
        const int count =
            morph_active_blocks(m->active[k], p->world, &m->index[at], &inset, &m->block[m->blocks]);
        if (count < 0) return MORPH_ERR_NOMEM;
        m->blocks += count;
    }
    add_terms(m);
    return MORPH_OK;
}

/* Examines the poses between the ends exactly and takes in the rows that they stand near or break. */
static morph_status examine(mover *m, bool *hold) {
    /* As of a projection (planner/project.c), but for angles: those turn the most, and with 0.15 one in two
     * first solves breaks an angle that it had no row for. */
    const morph_nearness near = {.length = 0.1, .angle = 0.3, .clearance = 0.15, .self = 0.1};
    morph_pather *p = m->p;
    morph_status status = MORPH_OK;
    *hold = true;
    for (int k = 1; k + 1 < p->count && status == MORPH_OK; k++) {
        const morph_inset inset = morph_path_inset(p, p->s[k], p->inset[k]);
        morph_violation v;
        p->here.lift = p->lift[k];
        status = morph_pose_examine(p->world, pose(p, k), &inset, &near, m->active[k], NULL, &v);
        *hold = *hold && morph_violation_worst(&v, morph_pose_tolerance, NULL) <= 1.0;
    }
    return status;
}

static void note(const mover *m, const morph_nlp_result *r) {
    morph_path_report *report = m->p->report;
    morph_effort_add(&report->effort, r);
    if (r->rows == report->effort.rows) /* the largest: rows of all its poses are possible */
        report->rows_possible = (m->p->count - 2) * morph_possible_rows(m->p->world->structure);
    morph_log(m->p->options->control,
              "path: whole: %d poses, %s, %d iterations, %d unknowns, %d rows, %.2f s; objective %.5g",
              m->p->count, morph_outcome_text(r->outcome), r->iterations, r->unknowns, r->rows, r->seconds,
              r->objective);
}

static morph_status solve(mover *m, bool *solved) {
    morph_pather *p = m->p;
    morph_nlp *nlp = NULL;
    const int n = p->count * p->coordinates;
    morph_status status = build(m);
    if (status == MORPH_OK)
        status = morph_nlp_create(n, p->x, m->lower, m->upper, m->block, m->blocks, NULL, 0, &nlp);
    if (status != MORPH_OK) return status;
    morph_nlp_result r = {0};
    morph_nlp_options o = morph_nlp_defaults();
    o.tolerance = 1e-3; /* the objective is some tenths per link: durations then repeat to a thousandth */
    o.max_iterations = *m->left < m->most ? *m->left : m->most;
    o.isolated = true;
    o.dissect = true;
    o.adaptive_mu = false;
    o.mu_init = 1e-3; /* it starts inside its limits, or near them */
    o.control = &m->quiet;
    if (p->options->seconds > 0.0)
        o.max_seconds = fmax(1e-3, p->options->seconds - (morph_seconds() - p->started));
    status = morph_nlp_solve(nlp, p->x, &o, &r);
    if (status == MORPH_OK) {
        note(m, &r);
        *m->left -= r.iterations;
        memcpy(p->x, r.x, (size_t)n * sizeof *p->x);
        *solved = r.outcome == MORPH_OPTIMAL || r.outcome == MORPH_FEASIBLE;
    }
    morph_nlp_result_free(&r);
    morph_nlp_destroy(nlp);
    return status;
}

/* Solves, examines, adds what was missed, until every pose holds its limits. */
static morph_status move(morph_pather *p, int *left) {
    mover m;
    bool hold, solved = false;
    morph_status status = mover_create(p, left, &m);
    if (status == MORPH_OK) status = examine(&m, &hold);
    for (int round = 0; round < ROUNDS && status == MORPH_OK && *left > 0; round++) {
        status = solve(&m, &solved);
        if (status == MORPH_OK) status = examine(&m, &hold);
        if ((hold && solved) || morph_path_out_of_time(p)) break;
    }
    mover_free(&m);
    return status;
}

static morph_status duration_of(const morph_pather *p, const morph_curve *curve, double *out) {
    morph_control quiet = {0};
    if (p->options->control) quiet = *p->options->control;
    quiet.log = NULL;
    quiet.progress = NULL;
    const morph_timing_options o = {0.0, sample, &quiet};
    morph_timing timing;
    morph_timing_report r;
    const morph_status status = morph_timing_solve(curve, &o, &timing, &r);
    morph_timing_free(&timing);
    *out = r.needed;
    return status;
}

/* Parameter of pose k: closer at the end, and at a start that touches its limits as well. With t = k / K,
 * t + c t (1 - t) has the slope 1 + c at 0 and 1 - c at 1; t - c sin(2 pi t) / (2 pi) has 1 - c at both. */
static double parameter(const morph_pather *p, int k) {
    const double t = (double)k / INTERVALS, turn = 2.0 * acos(-1.0);
    return p->options->bent ? t - CLOSER * sin(turn * t) / turn : t + CLOSER * t * (1.0 - t);
}

/* INTERVALS + 1 poses of the curve: they hold their limits as it does. The ends stay to the bit, and what is
 * held stays as the start has it. */
static morph_status draw_poses(morph_pather *p, const morph_curve *curve) {
    const morph_structure *st = p->world->structure;
    const size_t width = (size_t)p->coordinates;
    double *scratch = morph_alloc((size_t)morph_pose_width(st), sizeof *scratch);
    if (!scratch) return MORPH_ERR_NOMEM;
    memmove(pose(p, INTERVALS), pose(p, p->count - 1), width * sizeof *p->x);
    p->count = INTERVALS + 1;
    for (int k = 0; k < p->count; k++) {
        p->s[k] = k == 0 ? 0.0 : k == INTERVALS ? 1.0 : parameter(p, k);
        p->lift[k] = morph_curve_lift(curve, p->s[k]);
        p->inset[k] = 1.0;
        if (k == 0 || k == INTERVALS) continue;
        morph_curve_joints(curve, p->s[k], 0, scratch, pose(p, k));
        for (size_t i = 0; i < width; i++)
            pose(p, k)[i] /= st->spacing;
        for (int f = 0; f < st->fixed_joints; f++) {
            const size_t at = 3 * (size_t)st->fixed_joint[f];
            memcpy(&pose(p, k)[at], &pose(p, 0)[at], 3 * sizeof *p->x);
        }
    }
    free(scratch);
    return MORPH_OK;
}

/* The curve is the best if it holds and its schedule is the shortest; it is taken over or destroyed. */
static morph_status consider(morph_pather *p, morph_curve *curve, morph_kept *best) {
    morph_status status = MORPH_OK;
    double duration = INFINITY;
    if (p->report->feasible) status = duration_of(p, curve, &duration);
    if (status == MORPH_OK && duration < best->duration) {
        status = morph_keep(p, &curve, duration, best);
        if (status == MORPH_OK) p->report->moved = true;
    }
    morph_curve_destroy(curve);
    return status;
}

/* Moves the path, and again where the curve between its poses breaks a limit: with more distance from limits
 * there, then with more poses; the last time it is mended, pose by pose. Where there was no room for more
 * distance, the poses as they were before are mended. The best is in *best. */
static morph_status improve(morph_pather *p, morph_kept *best) {
    morph_kept first = {0};
    morph_status status = draw_poses(p, best->curve);
    int left = all_iterations(p);
    bool more = true;
    for (int pass = 0; pass < PASSES && status == MORPH_OK && more && left > 0; pass++) {
        morph_curve *curve = NULL;
        more = false;
        morph_progress(p->options->control, "path", 0.8 + 0.2 * pass / PASSES);
        status = move(p, &left);
        if (status != MORPH_OK || morph_path_out_of_time(p)) break;
        if (pass == 0) status = morph_keep(p, &curve, INFINITY, &first); /* without a curve */
        if (status == MORPH_OK)
            status = left > 0 && pass + 1 < PASSES ? morph_path_give_room(p, &curve, pass > 0, &more)
                                                   : morph_path_mend(p, &curve);
        if (status == MORPH_OK)
            status = consider(p, curve, best);
        else
            morph_curve_destroy(curve);
        if (morph_path_out_of_time(p)) break;
    }
    if (status == MORPH_OK && first.count > 0 && !p->report->feasible && !morph_path_out_of_time(p)) {
        morph_curve *curve = NULL;
        morph_put_back(&first, p, &curve);
        status = morph_path_mend(p, &curve);
        if (status == MORPH_OK)
            status = consider(p, curve, best);
        else
            morph_curve_destroy(curve);
    }
    morph_kept_free(&first);
    return status;
}

bool morph_path_whole_fits(const morph_pather *p) {
    return (INTERVALS - 1) * p->coordinates <= MOST_UNKNOWNS;
}

static void say(const morph_pather *p) {
    const morph_path_report *r = p->report;
    if (r->before > 0.0)
        morph_log(p->options->control, "path: whole: %.3f s before, %.3f s after", r->before, r->after);
    else
        morph_log(p->options->control, "path: whole: now it %s",
                  r->after > 0.0 ? "holds" : "does not hold either");
}

morph_status morph_path_whole(morph_pather *p, morph_curve **curve) {
    morph_path_report *report = p->report;
    morph_kept best = {0};
    double before = INFINITY, alone = 0.0;
    int link;
    if (!morph_path_whole_fits(p) || morph_path_out_of_time(p)) return MORPH_OK;
    morph_status status = report->feasible ? duration_of(p, *curve, &before) : MORPH_OK;
    if (status == MORPH_OK) status = morph_timing_single_link(*curve, &alone, &link);
    if (status == MORPH_OK && before > near_bound * alone) status = morph_keep(p, curve, before, &best);
    if (status == MORPH_OK && best.curve) {
        report->before = isfinite(before) ? before : 0.0;
        /* What has no result leaves the best before it. */
        status = improve(p, &best);
        if (status == MORPH_ERR_BACKEND || status == MORPH_ERR_NOMEM) report->deaths++;
        report->after = isfinite(best.duration) ? best.duration : 0.0;
        say(p);
        morph_put_back(&best, p, curve);
    }
    morph_kept_free(&best);
    /* The path that there was is whole without this step. */
    return MORPH_OK;
}
