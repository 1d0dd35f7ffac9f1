/* The schedule's curve, rebuilt from what the plan folder holds: the spline through path/poses at path/s, and
 * s(t) of timing/. Both are the planner's own, so the lengths are too, at any time. */
#include "planner/export.h"

#include "planner/scene.h"
#include "planner/timing.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A rebuilt length is off by rounding alone: some 1e-16 of a metre. What is off by more is another curve. */
static const double same_length = 1e-12;

/* A curve with its timing and the scratch to evaluate it; structure points into the record. */
typedef struct rebuilt {
    morph_structure structure;
    morph_curve *curve;
    morph_timing timing; /* points into the record */
    double *scratch, *joints, *by_s, *by_t;
} rebuilt;

void morph_export_table_free(morph_export_table *table) {
    free(table->time);
    free(table->length);
    free(table->rate);
    free(table->acceleration);
    *table = (morph_export_table){0};
}

static void release(rebuilt *b) {
    morph_curve_destroy(b->curve);
    free(b->scratch);
    free(b->joints);
    free(b->by_s);
    free(b->by_t);
}

static bool all_finite(const double *v, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

/* Why the record holds no curve; NULL where it does. */
static const char *curve_fault(const morph_record *r) {
    const int order = MORPH_SPLINE_ORDER, n = r->timing_controls;
    if (!r->time || r->samples < 2) return "holds no schedule";
    if (!r->timing_knot || !r->path_s) return "holds no timing: it is of an earlier program, plan it anew";
    if (r->poses < order || n < order || r->timing_knots != n + order ||
        r->pose_width != (r->posts > 0 ? 6 * r->posts : 3 * r->joints))
        return "path and timing are no curve";
    if (!all_finite(r->path_s, (size_t)r->poses) ||
        !all_finite(r->path_poses, (size_t)r->poses * (size_t)r->pose_width) ||
        !all_finite(r->timing_knot, (size_t)r->timing_knots) || !all_finite(r->timing_control, (size_t)n) ||
        !isfinite(r->timing_duration[0]) || r->timing_duration[0] <= 0.0)
        return "path and timing are no curve";
    for (int i = 0; i < r->timing_knots; i++) {
        const bool end = (i > 0 && i < order) || i > n;
        if (i > 0 &&
            !(end ? r->timing_knot[i] == r->timing_knot[i - 1] : r->timing_knot[i] > r->timing_knot[i - 1]))
            return "timing/knots are no knots";
    }
    return NULL;
}

/* Posts of a pose need a direction, or the joints would be no numbers. */
static morph_status rebuild(const morph_record *r, rebuilt *b) {
    b->structure = (morph_structure){.joints = r->joints,
                                     .links = r->links,
                                     .posts = r->posts,
                                     .link = r->link,
                                     .length_limit = r->length_limit,
                                     .fixed_count = r->fixed_count,
                                     .fixed = r->fixed,
                                     .post = r->post,
                                     .post_length = r->post_length,
                                     .panels = r->panel ? r->panels : 0,
                                     .panel = r->panel,
                                     .spacing = r->spacing};
    b->timing =
        (morph_timing){{r->timing_controls, r->timing_knot}, r->timing_control, r->timing_duration[0]};
    const size_t poses = (size_t)r->poses, width = (size_t)r->pose_width, links = (size_t)r->links;
    b->curve = calloc(1, sizeof *b->curve);
    b->scratch = morph_alloc(4 * width, sizeof(double));
    b->joints = morph_alloc(12 * (size_t)r->joints, sizeof(double));
    b->by_s = morph_alloc(4 * links, sizeof(double));
    b->by_t = morph_alloc(4 * links, sizeof(double));
    if (!b->curve || !b->scratch || !b->joints || !b->by_s || !b->by_t) return MORPH_ERR_NOMEM;
    b->curve->structure = &b->structure;
    b->curve->poses = r->poses;
    b->curve->s = morph_alloc(poses, sizeof(double));
    b->curve->pose = morph_alloc(poses * width, sizeof(double));
    if (!b->curve->s || !b->curve->pose) return MORPH_ERR_NOMEM;
    memcpy(b->curve->s, r->path_s, poses * sizeof(double));
    memcpy(b->curve->pose, r->path_poses, poses * width * sizeof(double));
    const morph_status held = morph_hold_create(&b->structure, &b->curve->hold);
    if (held != MORPH_OK) return held;
    return morph_spline_fit(b->curve->s, b->curve->pose, r->poses, r->pose_width, &b->curve->spline);
}

/* Lengths, rates, accelerations, jerks (4 x links) into by_t; after the end the pose of the end at rest. */
static void evaluate(rebuilt *b, double t) {
    double at[4];
    morph_timing_eval(&b->timing, fmin(t, b->timing.duration), at);
    if (t >= b->timing.duration) at[1] = at[2] = at[3] = 0.0;
    morph_curve_joints(b->curve, at[0], 3, b->scratch, b->joints);
    morph_curve_lengths(&b->structure, b->joints, 3, b->by_s);
    morph_timing_chain(b->structure.links, b->by_s, at, b->by_t);
}

/* The curve against every sample that was written with it. */
static morph_status compare(const morph_record *r, rebuilt *b, char *message, size_t size) {
    for (int i = 0; i < r->samples; i++) {
        evaluate(b, r->time[i]);
        for (int l = 0; l < r->links; l++) {
            const double off = fabs(b->by_t[l] - r->length[(size_t)i * (size_t)r->links + (size_t)l]);
            if (!(off <= same_length))
                return morph_fail(
                    MORPH_ERR_INPUT, message, size,
                    "path and timing do not give the schedule: link %d at %.6g s is off by %.3g m", l,
                    r->time[i], off);
        }
    }
    return MORPH_OK;
}

/* Rows up to the first time at or after the end; a step that divides the duration but for rounding ends on
 * it.
 */
static morph_status count_rows(double duration, double sample, int *rows, char *message, size_t size) {
    if (!isfinite(sample) || sample <= 0.0)
        return morph_fail(MORPH_ERR_INPUT, message, size, "a step of %g s is none", sample);
    const double steps = ceil(duration / sample - 1e-9);
    if (steps > MORPH_SCENE_SAMPLES)
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "a step of %g s makes %.0f rows of a schedule of %.6g s, at most %d are written",
                          sample, steps, duration, MORPH_SCENE_SAMPLES);
    *rows = (int)fmax(1.0, steps) + 1;
    return MORPH_OK;
}

static morph_status fill(rebuilt *b, double sample, morph_export_table *out) {
    const size_t links = (size_t)out->links, rows = (size_t)out->samples;
    out->time = morph_alloc(rows, sizeof(double));
    out->length = morph_alloc(rows, links * sizeof(double));
    out->rate = morph_alloc(rows, links * sizeof(double));
    out->acceleration = morph_alloc(rows, links * sizeof(double));
    if (!out->time || !out->length || !out->rate || !out->acceleration) return MORPH_ERR_NOMEM;
    for (size_t i = 0; i < rows; i++) {
        /* Even times as products: a running sum would drift. */
        out->time[i] = (double)i * sample;
        evaluate(b, out->time[i]);
        memcpy(&out->length[i * links], b->by_t, links * sizeof(double));
        memcpy(&out->rate[i * links], b->by_t + links, links * sizeof(double));
        memcpy(&out->acceleration[i * links], b->by_t + 2 * links, links * sizeof(double));
    }
    return MORPH_OK;
}

morph_status morph_export_evaluate(const morph_record *r, double sample, morph_export_table *out,
                                   char *message, size_t size) {
    *out = (morph_export_table){.links = r->links};
    const char *fault = curve_fault(r);
    if (fault) return morph_fail(MORPH_ERR_INPUT, message, size, "%s", fault);
    if (sample == 0.0) sample = r->time[1] - r->time[0];
    morph_status status = count_rows(r->timing_duration[0], sample, &out->samples, message, size);
    if (status != MORPH_OK) return status;
    rebuilt b = {0};
    status = rebuild(r, &b);
    if (status == MORPH_OK)
        status = compare(r, &b, message, size);
    else if (status != MORPH_ERR_NOMEM)
        status = morph_fail(MORPH_ERR_INPUT, message, size, "path/s and path/poses are no curve");
    if (status == MORPH_OK) status = fill(&b, sample, out);
    release(&b);
    if (status == MORPH_ERR_NOMEM) morph_fail(status, message, size, "out of memory");
    if (status != MORPH_OK) morph_export_table_free(out);
    return status;
}

/* The three blocks of columns of a table, in their order. */
enum { BLOCKS = 3 };
static void blocks_of(const morph_export_table *t, const double *block[BLOCKS]) {
    block[0] = t->length;
    block[1] = t->rate;
    block[2] = t->acceleration;
}

morph_status morph_export_csv(const morph_export_table *t, morph_text *out) {
    static const char *const units[BLOCKS] = {"m", "m_per_s", "m_per_s2"};
    const double *block[BLOCKS];
    const size_t links = (size_t)t->links;
    *out = (morph_text){0};
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    blocks_of(t, block);
    bool finite = true;
    morph_text_put(out, "time_s", 6);
    for (int k = 0; k < BLOCKS; k++)
        for (int l = 0; l < t->links; l++)
            morph_text_add(out, ",link_%04d_%s", l, units[k]);
    morph_text_put(out, "\n", 1);
    for (size_t i = 0; i < (size_t)t->samples && finite && !out->failed; i++) {
        morph_text_number(out, t->time[i]);
        for (int k = 0; k < BLOCKS; k++)
            for (size_t l = 0; l < links; l++) {
                finite = finite && isfinite(block[k][i * links + l]);
                morph_text_put(out, ",", 1);
                morph_text_number(out, block[k][i * links + l]);
            }
        morph_text_put(out, "\n", 1);
    }
    morph_locale_leave(&locale);
    if (finite && !out->failed) return MORPH_OK;
    morph_text_free(out);
    return finite ? MORPH_ERR_NOMEM : MORPH_ERR_NONFINITE;
}

/* The number at *at, and past the separator that must follow it. */
static bool take(const char **at, double wanted, char separator) {
    char *stop;
    const double value = strtod(*at, &stop);
    if (stop == *at || value != wanted || *stop != separator) return false;
    *at = stop + 1;
    return true;
}

morph_status morph_export_csv_verify(const morph_export_table *t, const char *text, char *message,
                                     size_t size) {
    const double *block[BLOCKS];
    const size_t links = (size_t)t->links, columns = BLOCKS * links;
    const char *at = strchr(text, '\n');
    size_t bad_row = 0, bad_column = 0;
    bool same = at != NULL;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    blocks_of(t, block);
    if (same) at++;
    for (size_t i = 0; same && i < (size_t)t->samples; i++) {
        bad_row = i;
        bad_column = 0;
        same = take(&at, t->time[i], columns > 0 ? ',' : '\n');
        for (size_t c = 0; same && c < columns; c++) {
            bad_column = c + 1;
            same = take(&at, block[c / links][i * links + c % links], c + 1 < columns ? ',' : '\n');
        }
    }
    morph_locale_leave(&locale);
    if (same && *at == '\0') return MORPH_OK;
    return morph_fail(MORPH_ERR_INTERNAL, message, size,
                      "row %zu, column %zu do not read back as they were written", bad_row + 2,
                      bad_column + 1);
}
