#include "planner/refine_goal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Rows aim a thousandth inside the goal: the path's spline meets the end to rounding only, and the solver
 * stops a little outside its rows. */
#define INSIDE 1e-3
/* The kink between target and base plane, and the positive part, are rounded over less than the gaps that
 * goals are about; the bias takes what is left. */
#define BLEND 0.05
#define ROUND 0.005

int morph_aim_slacks(const morph_world *world) {
    return 2 + world->cavity->exposed;
}

morph_status morph_aim_create(const morph_world *world, const morph_goal *goal, morph_aim **out) {
    *out = NULL;
    morph_aim *a = calloc(1, sizeof *a);
    if (!a) return MORPH_ERR_NOMEM;
    const size_t samples = (size_t)world->cavity->samples, points = (size_t)world->cavity->exposed;
    a->world = world;
    a->goal = *goal;
    a->sample = morph_alloc(samples, sizeof(int));
    a->bias = morph_alloc(samples, sizeof(double));
    a->point = morph_alloc(points, sizeof(int));
    a->distance = morph_alloc(points, sizeof(double));
    a->joint = morph_alloc(points, sizeof(int[3]));
    a->weight = morph_alloc(points, sizeof(double[3]));
    a->price = morph_alloc(points + 2, sizeof(double));
    a->lower = morph_alloc(1 + samples + points, sizeof(double));
    a->upper = morph_alloc(1 + samples + points, sizeof(double));
    if (!a->sample || !a->bias || !a->point || !a->distance || !a->joint || !a->weight || !a->price ||
        !a->lower || !a->upper) {
        morph_aim_destroy(a);
        return MORPH_ERR_NOMEM;
    }
    *out = a;
    return MORPH_OK;
}

void morph_aim_destroy(morph_aim *a) {
    if (!a) return;
    free(a->sample);
    free(a->bias);
    free(a->point);
    free(a->distance);
    free(a->joint);
    free(a->weight);
    free(a->price);
    free(a->lower);
    free(a->upper);
    free(a);
}

/* Exact gap of a skin sample, spacings; and the smooth one. */
static double sample_gaps(const morph_aim *a, int sample, const double *x, double *smooth) {
    const morph_cavity *c = a->world->cavity;
    const morph_skin_sample *q = &c->sample[sample];
    const double spacing = c->structure->spacing, radius = c->structure->def.radius;
    double at[3] = {0.0, 0.0, 0.0}, metres[3];
    for (int k = 0; k < 3; k++) {
        for (int j = 0; j < 3; j++)
            at[k] += q->weight[j] * x[3 * q->joint[j] + k];
        metres[k] = at[k] * spacing;
    }
    *smooth = morph_gap_at(&a->rows.gap, at, NULL, NULL);
    const double height = isnan(c->base) ? INFINITY : metres[2] - c->base;
    morph_closest closest;
    morph_distance_point_bounded(c->target, metres, fmax(height, radius), &closest);
    return (fmin(height, closest.distance) - radius) / spacing;
}

static void choose_samples(morph_aim *a, const double *x, double reach) {
    const morph_cavity *c = a->world->cavity;
    morph_goal_rows *r = &a->rows;
    const double limit = r->limit[MORPH_GOAL_MAX_GAP];
    double exact_mean = 0.0, smooth_mean = 0.0;
    r->samples = 0;
    for (int q = 0; q < c->samples; q++) {
        double smooth;
        const double gap = sample_gaps(a, q, x, &smooth), share = c->sample[q].area / c->start_area;
        a->bias[q] = gap - smooth;
        exact_mean += share * fmax(0.0, gap);
        smooth_mean += share * 0.5 * (gap + sqrt(gap * gap + r->round * r->round));
        /* Within a move of the reach a gap grows by no more than that, and mostly by far less. */
        if (!(limit > 0.0) || gap < limit - 0.5 * reach) continue;
        a->sample[r->samples++] = q;
    }
    r->mean = r->limit[MORPH_GOAL_MEAN_GAP] > 0.0;
    r->mean_bias = exact_mean - smooth_mean;
}

typedef struct ranked {
    double distance;
    int point;
} ranked;

static int by_distance(const void *a, const void *b) {
    const ranked *p = a, *q = b;
    return p->distance < q->distance ? -1 : p->distance > q->distance ? 1 : p->point - q->point;
}

/* The nearest points whose areas add up to the coverage; of them those that a move could uncover. */
static morph_status choose_points(morph_aim *a, double reach) {
    const morph_cavity *c = a->world->cavity;
    const double spacing = c->structure->spacing, wanted = a->goal.limit[MORPH_GOAL_COVERAGE];
    const double safe =
        (c->structure->def.radius / spacing + a->rows.limit[MORPH_GOAL_COVERAGE]) - 0.5 * reach;
    double whole = 0.0, taken = 0.0;
    a->rows.points = 0;
    if (!(wanted > 0.0) || c->exposed == 0) return MORPH_OK;
    ranked *list = morph_alloc((size_t)c->exposed, sizeof *list);
    if (!list) return MORPH_ERR_NOMEM;
    for (int y = 0; y < c->exposed; y++) {
        list[y] = (ranked){a->distance[y], y};
        whole += c->expose[y].area;
    }
    qsort(list, (size_t)c->exposed, sizeof *list, by_distance);
    /* Where rounding takes one point more than asked for it does no harm. */
    for (int k = 0; k < c->exposed && taken < wanted * whole; k++) {
        taken += c->expose[list[k].point].area;
        if (list[k].distance / spacing > safe) a->point[a->rows.points++] = list[k].point;
    }
    free(list);
    return MORPH_OK;
}

/* All prices in the objective's measure, area (spacings^2) times squared spacings: the whole skin a spacing
 * nearer is worth ten times its area, a few times what the objective's own terms ask for it, so that the goal
 * goes before them. Points of the target share the price of a quarter of a spacing. */
static void set_prices(morph_aim *a, int slacks) {
    const morph_cavity *c = a->world->cavity;
    const morph_goal_rows *r = &a->rows;
    const double spacing = c->structure->spacing, all = 10.0 * c->start_area / (spacing * spacing);
    double whole = 0.0;
    for (int y = 0; y < c->exposed; y++)
        whole += c->expose[y].area;
    int k = 0;
    if (r->mean) a->price[k++] = all;
    if (r->samples) a->price[k++] = all;
    for (int y = 0; y < r->points; y++)
        a->price[k++] = 4.0 * all * c->expose[r->point[y]].area / whole;
    a->prices =
        (morph_price_term){3 * c->structure->joints + slacks, 3 * c->structure->joints, slacks, a->price};
}

/* Each slack at what its rows ask for at x, and a little more: the solver starts inside. */
static morph_status set_slacks(morph_aim *a, const morph_block *rows, double *x, int slacks) {
    const int n = 3 * a->world->structure->joints, mean = a->rows.mean ? 1 : 0;
    double *value = morph_alloc((size_t)rows->rows, sizeof(double));
    if (!value) return MORPH_ERR_NOMEM;
    memset(&x[n], 0, (size_t)slacks * sizeof *x);
    const morph_status status = rows->value(rows->data, x, value);
    for (int r = 0; r < rows->rows && status == MORPH_OK; r++) {
        const int slack = r < mean                     ? 0
                          : r < mean + a->rows.samples ? mean
                                                       : r - a->rows.samples + (a->rows.samples ? 1 : 0);
        x[n + slack] = fmax(x[n + slack], value[r] - rows->upper[r]);
    }
    for (int k = 0; k < slacks; k++)
        x[n + k] += 1e-3;
    free(value);
    return status;
}

morph_status morph_aim_rows(morph_aim *a, double *x, double reach, double hard,
                            morph_block out[MORPH_AIM_BLOCKS], int *slacks) {
    const morph_world *w = a->world;
    const double spacing = w->structure->spacing, shy = 1.0 - INSIDE;
    morph_goal_rows *r = &a->rows;
    *r = (morph_goal_rows){.gap = {w->cavity, w->sdf, BLEND, 1.0, true},
                           .limit = {hard * shy * a->goal.limit[MORPH_GOAL_MEAN_GAP] / spacing,
                                     hard * shy * a->goal.limit[MORPH_GOAL_MAX_GAP] / spacing, shy * 0.25},
                           .round = ROUND,
                           .sample = a->sample,
                           .bias = a->bias,
                           .point = a->point,
                           .joint = (const int(*)[3])a->joint,
                           .weight = (const double(*)[3])a->weight};
    double *metres = morph_alloc(3 * (size_t)w->structure->joints, sizeof(double));
    if (!metres) return MORPH_ERR_NOMEM;
    for (int i = 0; i < 3 * w->structure->joints; i++)
        metres[i] = x[i] * spacing;
    morph_status status = morph_cavity_closest(w->cavity, metres, a->joint, a->weight, a->distance);
    free(metres);
    if (status != MORPH_OK) return status;
    choose_samples(a, x, reach);
    status = choose_points(a, reach);
    if (status != MORPH_OK) return status;
    *slacks = morph_goal_rows_slacks(r);
    out[0] = morph_block_goal(r, NULL, a->lower, a->upper);
    set_prices(a, *slacks);
    out[1] = morph_block_price(&a->prices, NULL);
    return set_slacks(a, &out[0], x, *slacks);
}
