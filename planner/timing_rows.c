#include "planner/timing_rows.h"

#include <stdlib.h>
#include <string.h>

morph_status morph_path_table_create(const morph_curve *curve, morph_path_table *out) {
    const morph_structure *s = curve->structure;
    *out = (morph_path_table){.curve = curve};
    out->scratch = morph_alloc(MORPH_JET * (size_t)morph_pose_width(s), sizeof(double));
    out->joints = morph_alloc(MORPH_JET * 3 * (size_t)s->joints, sizeof(double));
    out->exact = morph_alloc(MORPH_JET * (size_t)s->links, sizeof(double));
    out->by_time = morph_alloc(4 * (size_t)s->links, sizeof(double));
    if (out->scratch && out->joints && out->exact && out->by_time) return MORPH_OK;
    morph_path_table_free(out);
    return MORPH_ERR_NOMEM;
}

void morph_path_table_free(morph_path_table *t) {
    free(t->scratch);
    free(t->joints);
    free(t->exact);
    free(t->by_time);
    *t = (morph_path_table){0};
}

void morph_path_table_exact(morph_path_table *t, double s, int order) {
    morph_curve_joints(t->curve, s, order, t->scratch, t->joints);
    morph_curve_lengths(t->curve->structure, t->joints, order, t->exact);
}

static morph_status allocate(morph_timing_rows *r) {
    const size_t points = (size_t)r->points;
    r->theta = morph_alloc(points, sizeof(double));
    r->share = morph_alloc(points, sizeof(double));
    r->first = morph_alloc(points, sizeof *r->first);
    r->value = morph_alloc(points, sizeof *r->value);
    r->rate = morph_alloc(points, sizeof(double));
    r->begin = morph_alloc(points + 1, sizeof *r->begin);
    r->kept = morph_alloc(points * (size_t)r->links, sizeof *r->kept);
    r->all = morph_alloc((size_t)r->links, sizeof *r->all);
    const bool ok = r->theta && r->share && r->first && r->value && r->rate && r->begin && r->kept && r->all;
    return ok ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* Directions over half a circle and half a sphere, a dozen degrees and some forty degrees apart. */
enum { FLAT = 16, TURNS = 8, RINGS = 3, SOLID = TURNS * RINGS + 1 };

static void directions(double flat[FLAT][2], double solid[SOLID][3]) {
    const double pi = acos(-1.0);
    for (int i = 0; i < FLAT; i++) {
        flat[i][0] = cos(pi * i / FLAT);
        flat[i][1] = sin(pi * i / FLAT);
    }
    for (int ring = 0; ring < RINGS; ring++)
        for (int i = 0; i < TURNS; i++) {
            const double up = 0.5 * pi * ring / RINGS, turn = 2.0 * pi * (i + 0.5 * ring) / TURNS;
            double *d = solid[ring * TURNS + i];
            d[1] = cos(up) * cos(turn);
            d[2] = cos(up) * sin(turn);
            d[0] = sin(up);
        }
    solid[SOLID - 1][0] = 1.0;
    solid[SOLID - 1][1] = solid[SOLID - 1][2] = 0.0;
}

/* The link that reaches farthest in a direction over components from..from+n-1, each in units of the largest
 * of its kind here. */
static int support(const double (*row)[5], int links, int from, int n, const double *direction,
                   const double largest[5]) {
    int best = 0;
    double most = -1.0, scaled[3] = {0.0};
    for (int c = 0; c < n; c++)
        scaled[c] = largest[from + c] > 0.0 ? direction[c] / largest[from + c] : 0.0;
    for (int l = 0; l < links; l++) {
        double sum = 0.0;
        for (int c = 0; c < n; c++)
            sum += scaled[c] * row[l][from + c];
        if (fabs(sum) > most) {
            most = fabs(sum);
            best = l;
        }
    }
    return best;
}

/* A row binds only where it is a corner of the convex hull of all links' rows and their negatives. Most are
 * not: to begin with those are kept that reach farthest in one of a set of directions. */
static void keep_corners(const double (*row)[5], int links, bool *kept) {
    double flat[FLAT][2], solid[SOLID][3], largest[5] = {0.0};
    directions(flat, solid);
    for (int l = 0; l < links; l++)
        for (int c = 0; c < 5; c++)
            largest[c] = fmax(largest[c], fabs(row[l][c]));
    for (int i = 0; i < FLAT; i++)
        kept[support(row, links, 0, 2, flat[i], largest)] = true;
    for (int i = 0; i < SOLID; i++)
        kept[support(row, links, 2, 3, solid[i], largest)] = true;
}

/* Ratios to the limits of one link at (w, w', w''): acceleration and jerk. */
static void ratios(const double k[5], const double w[3], double out[2]) {
    out[0] = fabs(k[0] * w[0] + k[1] * w[1]);
    out[1] = fabs(k[2] * w[0] + k[3] * w[1] + k[4] * w[2]) * sqrt(fmax(0.0, w[0]));
}

/* Those that break their limits at x, by more than the stretch would notice. Returns how many are new. */
static int keep_violated(const morph_timing_rows *r, int g, const double *x, bool *kept) {
    int added = 0;
    double w[3], now[2];
    morph_timing_rows_at(r, g, x, w);
    for (int l = 0; l < r->links; l++) {
        ratios(r->all[l], w, now);
        if (kept[l] || fmax(now[0], now[1]) < 1.0 + 1e-3) continue;
        kept[l] = true;
        added++;
    }
    return added;
}

/* All links' rows at one grid point. The reference is evaluated with its own duration D: m1 = M'/D, m2 =
 * M''/D^2 and m3 = M'''/D^3 are rate, acceleration and jerk of w = 1; w' brings a factor 1/D with it, since
 * the coefficient of w' in the acceleration is M'/2 over D^2, and so on. */
static void fill_point(morph_path_table *table, const morph_timing *reference, morph_timing_rows *r, int g) {
    const morph_structure *st = table->curve->structure;
    double s[4];
    morph_timing_eval(reference, r->theta[g] * reference->duration, s);
    morph_path_table_exact(table, s[0], 3);
    morph_timing_chain(st->links, table->exact, s, table->by_time);
    const double *m1 = table->by_time + st->links, *m2 = m1 + st->links, *m3 = m2 + st->links;
    const double d = reference->duration;
    double worst = 0.0;
    for (int l = 0; l < st->links; l++) {
        double *row = r->all[l];
        worst = fmax(worst, fabs(m1[l]) / st->rate_limit[l]);
        const double a = 1.0 / st->acceleration_limit[l], j = 1.0 / st->jerk_limit[l];
        row[0] = a * m2[l];
        row[1] = a * 0.5 * m1[l] / d;
        row[2] = j * m3[l];
        row[3] = j * 1.5 * m2[l] / d;
        row[4] = j * 0.5 * m1[l] / (d * d);
    }
    r->rate[g] = worst * worst;
}

/* Takes the kept links' rows of a point over. */
static morph_status append_point(morph_timing_rows *r, int g, const bool *kept) {
    int count = r->begin[g];
    if (count + r->links > r->capacity) {
        const int capacity = 2 * r->capacity + r->links;
        double(*larger)[5] = realloc(r->link, (size_t)capacity * sizeof *larger);
        if (!larger) return MORPH_ERR_NOMEM;
        r->link = larger;
        r->capacity = capacity;
    }
    for (int l = 0; l < r->links; l++)
        if (kept[l]) memcpy(r->link[count++], r->all[l], sizeof *r->all);
    r->begin[g + 1] = count;
    return MORPH_OK;
}

morph_status morph_timing_rows_extend(morph_path_table *table, const morph_timing *reference,
                                      morph_timing_rows *r, const double *x, int *added) {
    *added = 0;
    morph_status status = MORPH_OK;
    for (int g = 0; g < r->points && status == MORPH_OK; g++) {
        bool *kept = &r->kept[(size_t)g * (size_t)r->links];
        fill_point(table, reference, r, g);
        if (x)
            *added += keep_violated(r, g, x, kept);
        else
            keep_corners((const double(*)[5])r->all, r->links, kept);
        status = append_point(r, g, kept);
    }
    return status;
}

morph_status morph_timing_rows_create(morph_path_table *table, const morph_timing *reference, int controls,
                                      int density, morph_timing_rows *out) {
    const int intervals = (controls - MORPH_SPLINE_DEGREE) * density;
    /* One profile may run ten times faster or a hundred times slower than its reference somewhere: beyond
     * that the next round, with this one as reference, resolves it better. */
    *out = (morph_timing_rows){
        .points = intervals + 1, .links = table->curve->structure->links, .lower = 1e-4, .upper = 1e2};
    morph_status status = morph_basis_uniform(controls, &out->basis);
    if (status == MORPH_OK) status = allocate(out);
    if (status != MORPH_OK) {
        morph_timing_rows_free(out);
        return status;
    }
    for (int g = 0; g <= intervals; g++) {
        out->theta[g] = (double)g / intervals;
        out->share[g] = (g == 0 || g == intervals ? 0.5 : 1.0) / intervals;
        out->first[g] = morph_basis_eval(&out->basis, out->theta[g], 2, out->value[g]);
    }
    int added;
    status = morph_timing_rows_extend(table, reference, out, NULL, &added);
    if (status != MORPH_OK) morph_timing_rows_free(out);
    return status;
}

void morph_timing_rows_free(morph_timing_rows *r) {
    morph_basis_free(&r->basis);
    free(r->theta);
    free(r->share);
    free(r->first);
    free(r->value);
    free(r->rate);
    free(r->begin);
    free(r->link);
    free(r->kept);
    free(r->all);
    *r = (morph_timing_rows){0};
}

void morph_timing_rows_at(const morph_timing_rows *r, int point, const double *x, double w[3]) {
    for (int d = 0; d < 3; d++) {
        w[d] = 0.0;
        for (int i = 0; i < MORPH_SPLINE_ORDER; i++)
            w[d] += r->value[point][d][i] * x[r->first[point] + i];
    }
}

double morph_timing_rows_room(const morph_timing_rows *r, const double *x) {
    double first = 0.0, second = 0.0;
    for (int g = 0; g < r->points; g++) {
        double w[3];
        morph_timing_rows_at(r, g, x, w);
        first = fmax(first, r->rate[g] * w[0]);
        for (int n = r->begin[g]; n < r->begin[g + 1]; n++) {
            double now[2];
            ratios(r->link[n], w, now);
            first = fmax(first, now[0]);
            second = fmax(second, now[1]);
        }
    }
    const double most = fmax(first, cbrt(second * second));
    return most > 0.0 ? 1.0 / most : INFINITY;
}
