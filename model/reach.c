#include "model/reach.h"

#include "model/reach_internal.h"

#include <stdlib.h>

/* What the structure can give; formulas in model_of. */
typedef struct ability {
    double shortest, longest; /* of a link of the bottom layer, m */
    double lambda, slope;
    double shear; /* m */
    double ball;  /* least radius of the sheet bent inwards, m */
    double bend;  /* largest angle from link to link, radians; NaN without posts */
    int links[2];
} ability;

typedef struct checker {
    const morph_structure *s;
    ability can;
    morph_heights relief;
    morph_reach *out;
    double *scratch; /* one value per cell */
} checker;

/* A ball of more than two spacings costs more than milliseconds; links whose lengths hardly change would ask
 * for one. */
#define LARGEST_BALL 2.0
/* Of the spacing: what is nearer counts as covered, as in the measure of coverage. */
#define COVERED 0.25
/* Of the spacing: a round top loses less to a disc of two spacings than this, a post loses its height. */
#define BUMP 0.5
/* Of the spacing: sums with the ball's radius round to less, and nothing so shallow is a hole. */
#define NOISE 1e-9
/* No target asks for slopes beyond this, links that may vanish or not: keeps lambda finite in use. */
#define STEEPEST 1e3

const char *morph_reach_name(morph_reach_kind kind) {
    static const char *const names[MORPH_REACH_KINDS] = {"length", "area", "stretch", "hole",
                                                         "bump",   "bend", "held",    "hidden"};
    const int k = (int)kind;
    return k >= 0 && k < MORPH_REACH_KINDS ? names[k] : "unknown";
}

/* Inward bend: on the floor of a hole lies at least one shortest link of the upper layer, and beside it
 * stand, off both walls, posts of length t: the hole is shortest + 2 t wide, a ball of half that radius fits.
 * The angle limits add: links of length l turn by at most b at each post, so l <= 2 R sin(b / 2). b: each of
 * two neighbouring links leaves at most 90 degrees less its limit. Shear: where one line climbs and its
 * neighbour does not, their nodes draw apart until the links between them, at their longest, reach the least
 * angle a to the lines: by longest cos a. So much a line has free on each side of what it climbs. */
static ability ability_of(const morph_structure *s) {
    const morph_structure_def *d = &s->def;
    ability a = {.shortest = d->length[MORPH_LINK_BOTTOM][0], .longest = d->length[MORPH_LINK_BOTTOM][1]};
    a.lambda = a.longest / a.shortest;
    a.slope = fmin(sqrt(a.lambda * a.lambda - 1.0), STEEPEST);
    a.shear = fmax(a.longest * cos(d->link_link[0]), 0.0);
    a.ball = 0.5 * d->length[MORPH_LINK_TOP][0] + d->thickness;
    a.bend = NAN;
    if (s->posts > 0) {
        const double pi = acos(-1.0);
        a.bend = fmin(fmax(fmin(pi - 2.0 * d->link_post[0], 2.0 * d->link_post[1] - pi), 0.0), pi);
        a.ball = fmax(a.ball, a.bend > 0.0 ? a.shortest / (2.0 * sin(0.5 * a.bend)) : INFINITY);
    }
    /* The links' axes lie a radius above the target. */
    a.ball = fmin(a.ball + d->radius, LARGEST_BALL * s->spacing);
    for (int k = 0; k < 2; k++)
        a.links[k] = s->layer_nodes[0][k] - 1;
    return a;
}

/* Line of the bottom layer next to a place: lines along axis k are counted across it. */
static int next_line(const checker *c, int axis, const double at[3]) {
    const int across = 1 - axis, n = c->s->layer_nodes[0][across];
    const double first = c->s->start[across], h = c->s->spacing;
    return (int)fmin(fmax(floor((at[across] - first) / h + 0.5), 0.0), n - 1.0);
}

static void place_worst(const checker *c, morph_reach_kind kind, int axis, int i, int j) {
    morph_reach_item *item = &c->out->item[kind];
    morph_heights_point(&c->relief, i, j, item->at);
    item->along_y = axis == 1;
    item->line = next_line(c, axis, item->at);
}

/* What is lost by less than the estimate knows is worth a note. */
static morph_reach_verdict verdict_of(bool beyond, double lost) {
    if (!beyond) return MORPH_REACH_WITHIN;
    return lost > MORPH_REACH_LOST ? MORPH_REACH_OUT : MORPH_REACH_NOTE;
}

/* A profile: the cells of one row of the grid along an axis. */
typedef struct profile {
    const morph_heights *r;
    int axis, across; /* number of the row */
} profile;

static size_t cell_of(const profile *p, int k) {
    return p->axis == 0 ? morph_heights_at(p->r, k, p->across) : morph_heights_at(p->r, p->across, k);
}
static double step_of(const profile *p, const double *z, int k) {
    return hypot(p->r->cell[p->axis], z[cell_of(p, k + 1)] - z[cell_of(p, k)]);
}
static void place_on(const checker *c, morph_reach_kind kind, const profile *p, int k) {
    place_worst(c, kind, p->axis, p->axis == 0 ? k : p->across, p->axis == 0 ? p->across : k);
}

/* First and last exposed cell; false if there is none. */
static bool ends_of(const profile *p, int *first, int *last) {
    *first = *last = -1;
    for (int k = 0; k < p->r->n[p->axis]; k++)
        if (p->r->seen[cell_of(p, k)]) {
            if (*first < 0) *first = k;
            *last = k;
        }
    return *first >= 0;
}

/* Largest number of exposed cells that a piece of the profile of this length holds. */
static int most_covered(const profile *p, int first, int last, double reach) {
    int best = 0, inside = 0, from = first;
    double arc = p->r->cell[p->axis]; /* half a cell at each end */
    for (int to = first; to <= last; to++) {
        inside += p->r->seen[cell_of(p, to)];
        if (to > first) arc += step_of(p, p->r->over, to - 1);
        while (arc > reach && from < to) {
            inside -= p->r->seen[cell_of(p, from)];
            arc -= step_of(p, p->r->over, from++);
        }
        if (inside > best) best = inside;
    }
    return best;
}

/* Way across the exposed target along every row. */
static void check_length(checker *c) {
    morph_reach_item *item = &c->out->item[MORPH_REACH_LENGTH];
    double worst = -1.0;
    for (int axis = 0; axis < 2; axis++) {
        const double reach = c->out->reach[axis] = c->can.links[axis] * c->can.longest;
        profile p = {&c->relief, axis, 0};
        int covered = 0, first, last;
        for (p.across = 0; p.across < c->relief.n[1 - axis]; p.across++) {
            if (!ends_of(&p, &first, &last)) continue;
            double arc = c->relief.cell[axis];
            for (int k = first; k < last; k++)
                arc += step_of(&p, c->relief.over, k);
            covered += most_covered(&p, first, last, reach);
            if (!(arc / reach > worst)) continue;
            worst = arc / reach;
            item->number = arc;
            item->limit = reach;
            place_on(c, MORPH_REACH_LENGTH, &p, (first + last) / 2);
        }
        item->lost = fmax(item->lost, 1.0 - (double)covered / c->relief.exposed);
    }
    item->verdict = verdict_of(worst > 1.0, item->lost);
}

static int compare_numbers(const void *pa, const void *pb) {
    const double a = *(const double *)pa, b = *(const double *)pb;
    return (a > b) - (a < b);
}

/* Area of what is exposed, on the sheet's surface: sqrt(1 + zx^2 + zy^2) per cell. The sheet is largest as
 * squares of the longest links, and covers most where the target is flattest. */
static void check_area(checker *c) {
    const morph_heights *r = &c->relief;
    morph_reach_item *item = &c->out->item[MORPH_REACH_AREA];
    const double cell = r->cell[0] * r->cell[1];
    int n = 0;
    for (int j = 1; j + 1 < r->n[1]; j++)
        for (int i = 1; i + 1 < r->n[0]; i++) {
            const size_t at = morph_heights_at(r, i, j);
            if (!r->seen[at]) continue;
            const double zx = (r->over[at + 1] - r->over[at - 1]) / (2.0 * r->cell[0]);
            const double zy =
                (r->over[at + (size_t)r->n[0]] - r->over[at - (size_t)r->n[0]]) / (2.0 * r->cell[1]);
            c->scratch[n++] = cell * sqrt(1.0 + zx * zx + zy * zy);
            item->number += c->scratch[n - 1];
        }
    item->limit = c->out->reach[0] * c->out->reach[1];
    qsort(c->scratch, (size_t)n, sizeof *c->scratch, compare_numbers);
    double used = 0.0;
    int covered = 0;
    while (covered < n && used + c->scratch[covered] <= item->limit)
        used += c->scratch[covered++];
    item->lost = 1.0 - (double)covered / n;
    for (int k = 0; k < 3; k++)
        item->at[k] = c->out->item[MORPH_REACH_LENGTH].at[k];
    item->verdict = verdict_of(item->number > item->limit, item->lost);
}

/* Height of one surface over another as a distance to the upper one: across its slope. */
static double distance_below(const morph_heights *r, const double *upper, int i, int j, double height) {
    const size_t at = morph_heights_at(r, i, j), row = (size_t)r->n[0];
    const double zx = (upper[at + 1] - upper[at - 1]) / (2.0 * r->cell[0]);
    const double zy = (upper[at + row] - upper[at - row]) / (2.0 * r->cell[1]);
    return height / sqrt(1.0 + zx * zx + zy * zy);
}

/* What stays uncovered below the ball, and below the sheet altogether: the rest of it is due to slopes. */
static void check_holes(checker *c, double *lost) {
    const morph_heights *r = &c->relief;
    morph_reach_item *hole = &c->out->item[MORPH_REACH_HOLE];
    const double near = COVERED * c->s->spacing;
    int below_ball = 0, below = 0;
    hole->limit = near;
    for (int j = r->pad[1]; j < r->n[1] - r->pad[1]; j++)
        for (int i = r->pad[0]; i < r->n[0] - r->pad[0]; i++) {
            const size_t at = morph_heights_at(r, i, j);
            if (!r->seen[at]) continue;
            const double deep = distance_below(r, r->closed, i, j, r->closed[at] - r->top[at]);
            below_ball += deep > near;
            below += fmax(deep, distance_below(r, r->over, i, j, r->over[at] - r->top[at])) > near;
            if (!(deep > hole->number) || deep < NOISE * c->s->spacing) continue;
            hole->number = deep;
            place_worst(c, MORPH_REACH_HOLE, 0, i, j);
        }
    hole->lost = (double)below_ball / r->exposed;
    hole->verdict = verdict_of(hole->number > near, hole->lost);
    *lost = (double)below / r->exposed;
    c->out->item[MORPH_REACH_STRETCH].lost = *lost - hole->lost;
}

/* Steepest piece of a profile, as long in plan as a shortest link, all of it exposed: arc over plan. */
static void check_stretch(checker *c) {
    morph_reach_item *item = &c->out->item[MORPH_REACH_STRETCH];
    item->limit = c->can.lambda;
    for (int axis = 0; axis < 2; axis++) {
        const double cell = c->relief.cell[axis];
        const int cells = (int)fmax(1.0, floor(c->can.shortest / cell + 0.5));
        profile p = {&c->relief, axis, 0};
        for (p.across = 0; p.across < c->relief.n[1 - axis]; p.across++) {
            double arc = 0.0;
            int seen = 0; /* exposed cells without a break up to this one */
            for (int k = 1; k < c->relief.n[axis]; k++) {
                const bool both = c->relief.seen[cell_of(&p, k - 1)] && c->relief.seen[cell_of(&p, k)];
                seen = both ? seen + 1 : 0;
                arc = both ? arc + step_of(&p, c->relief.top, k - 1) : 0.0;
                if (seen > cells) arc -= step_of(&p, c->relief.top, k - 1 - cells);
                const double ratio = arc / (cells * cell);
                if (seen < cells || !(ratio > item->number)) continue;
                item->number = ratio;
                place_on(c, MORPH_REACH_STRETCH, &p, k - cells / 2);
            }
        }
    }
    item->verdict = verdict_of(item->number > item->limit, item->lost);
}

/* Ridges of the sheet's surface: the angle between chords as long in plan as a shortest link, all of them on
 * the target: over its rim the sheet leaves as it likes. */
static void check_bend(checker *c) {
    morph_reach_item *item = &c->out->item[MORPH_REACH_BEND];
    item->limit = c->can.bend;
    if (isnan(c->can.bend)) return;
    for (int axis = 0; axis < 2; axis++) {
        const int n = c->relief.n[axis];
        const int cells = (int)fmax(1.0, floor(c->can.shortest / c->relief.cell[axis] + 0.5));
        const double plan = cells * c->relief.cell[axis], *z = c->relief.over;
        profile p = {&c->relief, axis, 0};
        for (p.across = 0; p.across < c->relief.n[1 - axis]; p.across++)
            for (int k = cells; k + cells < n; k++) {
                const size_t at = cell_of(&p, k);
                if (!c->relief.seen[at] || !c->relief.seen[cell_of(&p, k - cells)] ||
                    !c->relief.seen[cell_of(&p, k + cells)])
                    continue;
                const double bend = atan((z[at] - z[cell_of(&p, k - cells)]) / plan) +
                                    atan((z[at] - z[cell_of(&p, k + cells)]) / plan);
                if (!(bend > item->number)) continue;
                item->number = bend;
                place_on(c, MORPH_REACH_BEND, &p, k);
            }
    }
    item->verdict = item->number > item->limit ? MORPH_REACH_NOTE : MORPH_REACH_WITHIN;
}

/* Height of level parts in which no disc two spacings wide fits. */
static morph_status check_bumps(checker *c) {
    const morph_heights *r = &c->relief;
    morph_reach_item *item = &c->out->item[MORPH_REACH_BUMP];
    const morph_status status = morph_heights_open(r, c->s->spacing, c->scratch);
    if (status != MORPH_OK) return status;
    item->limit = BUMP * c->s->spacing;
    for (int j = 0; j < r->n[1]; j++)
        for (int i = 0; i < r->n[0]; i++) {
            const size_t at = morph_heights_at(r, i, j);
            const double height = r->top[at] - c->scratch[at];
            if (!r->seen[at] || !(height > item->number)) continue;
            item->number = height;
            place_worst(c, MORPH_REACH_BUMP, 0, i, j);
        }
    item->verdict = item->number > item->limit ? MORPH_REACH_NOTE : MORPH_REACH_WITHIN;
    return MORPH_OK;
}

/* From a held end straight to the target's rim, across it, and straight to the other end. */
static double way_of(const checker *c, const profile *p, int first, int last, const double end[2],
                     double frame) {
    const morph_heights *r = &c->relief;
    double way = 0.0;
    for (int k = first; k < last; k++)
        way += step_of(p, r->over, k);
    const double a = r->lo[p->axis] + first * r->cell[p->axis], b = r->lo[p->axis] + last * r->cell[p->axis];
    return way + hypot(a - end[0], r->over[cell_of(p, first)] - frame) +
           hypot(b - end[1], r->over[cell_of(p, last)] - frame);
}

/* Lines whose both ends are held cannot draw in. */
static void check_held(checker *c, double frame) {
    morph_reach_item *item = &c->out->item[MORPH_REACH_HELD];
    const morph_structure *s = c->s;
    const morph_heights *r = &c->relief;
    for (int axis = 0; axis < 2 && s->fixed_joints > 0; axis++)
        for (int line = 0; line < s->layer_nodes[0][1 - axis]; line++) {
            const int far = s->layer_nodes[0][axis] - 1;
            const int a =
                axis == 0 ? morph_node_joint(&s->def, 0, 0, line) : morph_node_joint(&s->def, 0, line, 0);
            const int b =
                axis == 0 ? morph_node_joint(&s->def, 0, far, line) : morph_node_joint(&s->def, 0, line, far);
            if (!s->joint_fixed[a] || !s->joint_fixed[b]) continue;
            const double place = s->start[3 * a + 1 - axis];
            const int across = (int)floor((place - r->lo[1 - axis]) / r->cell[1 - axis] + 0.5);
            if (!(across >= 0 && across < r->n[1 - axis])) continue;
            const profile p = {r, axis, across};
            int first, last;
            if (!ends_of(&p, &first, &last)) continue;
            const double end[2] = {s->start[3 * a + axis], s->start[3 * b + axis]};
            const double way = way_of(c, &p, first, last, end, frame);
            if (item->verdict == MORPH_REACH_UNTESTED) item->verdict = MORPH_REACH_WITHIN;
            item->limit = c->out->reach[axis];
            if (!(way > item->number)) continue;
            item->number = way;
            place_on(c, MORPH_REACH_HELD, &p, (first + last) / 2);
            item->line = line;
            if (way > item->limit) item->verdict = MORPH_REACH_OUT;
        }
}

static morph_status check_all(checker *c, double frame) {
    morph_reach *out = c->out;
    morph_reach_item *hidden = &out->item[MORPH_REACH_HIDDEN];
    double lost;
    check_length(c);
    check_area(c);
    check_holes(c, &lost);
    check_stretch(c);
    check_bend(c);
    check_held(c, frame);
    const morph_status status = check_bumps(c);
    *hidden = (morph_reach_item){.verdict = MORPH_REACH_WITHIN, .number = c->relief.hidden, .limit = NAN};
    out->coverage =
        1.0 - fmax(lost, fmax(out->item[MORPH_REACH_LENGTH].lost, out->item[MORPH_REACH_AREA].lost));
    /* Holes and slopes together may lose what neither does alone. */
    out->within = out->coverage >= 1.0 - MORPH_REACH_LOST;
    for (int k = 0; k < MORPH_REACH_KINDS; k++)
        out->within = out->within && out->item[k].verdict != MORPH_REACH_OUT;
    return status;
}

morph_status morph_reach_check(const morph_structure *structure, const morph_distance *target, double base,
                               double frame, morph_reach *out) {
    *out = (morph_reach){.within = true, .coverage = 1.0};
    checker c = {.s = structure, .can = ability_of(structure), .out = out};
    for (int k = 0; k < MORPH_REACH_KINDS; k++)
        out->item[k].limit = NAN;
    morph_status status =
        morph_heights_create(target, base, structure->spacing,
                             &(morph_heights_limits){c.can.ball, c.can.slope, c.can.shear}, &c.relief);
    if (status != MORPH_OK) return status;
    out->cell = fmax(c.relief.cell[0], c.relief.cell[1]);
    out->cells = c.relief.n[0] * c.relief.n[1];
    c.scratch = morph_alloc((size_t)out->cells, sizeof *c.scratch);
    if (!c.scratch) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK && c.relief.exposed > 0) status = check_all(&c, frame);
    free(c.scratch);
    morph_heights_free(&c.relief);
    return status;
}
