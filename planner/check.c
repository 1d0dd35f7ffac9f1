#include "planner/check_parts.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name, *unit;
} margins[MORPH_MARGIN_KINDS] = {
    [MORPH_MARGIN_LENGTH] = {"length", "m"},
    [MORPH_MARGIN_RATE] = {"rate", "m/s"},
    [MORPH_MARGIN_ACCELERATION] = {"acceleration", "m/s2"},
    [MORPH_MARGIN_JERK] = {"jerk", "m/s3"},
    [MORPH_MARGIN_POST_LENGTH] = {"post_length", "relative"},
    [MORPH_MARGIN_PANEL] = {"panel", "sine"},
    [MORPH_MARGIN_LINK_POST] = {"link_post", "rad"},
    [MORPH_MARGIN_LINK_LINK] = {"link_link", "rad"},
    [MORPH_MARGIN_CLEARANCE] = {"clearance", "m"},
    [MORPH_MARGIN_BASE] = {"base", "m"},
    [MORPH_MARGIN_SELF_CLEARANCE] = {"self_clearance", "m"},
    [MORPH_MARGIN_COMPATIBILITY] = {"compatibility", "m"},
    [MORPH_MARGIN_GOAL] = {"goal", "as given"},
};

const char *morph_margin_name(morph_margin_kind kind) {
    return (unsigned)kind < MORPH_MARGIN_KINDS ? margins[kind].name : "unknown";
}

const char *morph_margin_unit(morph_margin_kind kind) {
    return (unsigned)kind < MORPH_MARGIN_KINDS ? margins[kind].unit : "";
}

const char *morph_margin_unit_of(const morph_margin *margin, morph_margin_kind kind) {
    return margin->unit ? margin->unit : morph_margin_unit(kind);
}

void morph_finding_begin(morph_finding *f, double tolerance, double scale) {
    *f = (morph_finding){.tested = true, .worst = INFINITY, .tolerance = tolerance, .scale = scale};
}

void morph_findings_defect(morph_findings *f, const char *format, ...) {
    if (f->defect[0]) return;
    va_list args;
    va_start(args, format);
    vsnprintf(f->defect, sizeof f->defect, format, args);
    va_end(args);
}

void morph_element_name(const morph_record *r, morph_element e, char *text, size_t size) {
    if (size == 0) return;
    text[0] = 0;
    if (e.kind == MORPH_ELEMENT_LINK) morph_record_link_name(r, e.index, text, size);
    if (e.kind == MORPH_ELEMENT_JOINT) morph_record_joint_name(r, e.index, text, size);
    if (e.kind == MORPH_ELEMENT_POST) {
        const int *node = r->joint_node[r->post[e.index][0]];
        snprintf(text, size, "post (%d,%d)", node[0], node[1]);
    }
    if (e.kind == MORPH_ELEMENT_SKIN) {
        const int *node = r->joint_node[r->skin[e.index][0]];
        snprintf(text, size, "skin triangle %d at (%d,%d)", e.index, node[0], node[1]);
    }
}

static void pair_name(const morph_record *r, const morph_finding *f, char *text, size_t size) {
    morph_element_name(r, f->a, text, size);
    if (f->b.kind == MORPH_ELEMENT_NONE) return;
    const size_t used = strlen(text);
    char other[96];
    morph_element_name(r, f->b, other, sizeof other);
    snprintf(text + used, size - used, " / %s", other);
}

static bool equality(morph_margin_kind kind) {
    return kind == MORPH_MARGIN_POST_LENGTH || kind == MORPH_MARGIN_PANEL ||
           kind == MORPH_MARGIN_COMPATIBILITY;
}

/* How far inside (or, negative, outside) its limit a margin is, in natural units: lengths by the spacing,
 * rates by their limit, angles in radians. An equality that holds uses a part of its tolerance and is never
 * "inside" otherwise, so the tolerance is its unit while it holds. */
static double ranking(morph_margin_kind kind, const morph_finding *f) {
    const double inside = f->worst + f->tolerance;
    return inside >= 0 && equality(kind) ? inside / f->tolerance : inside / f->scale;
}

/* Can the interpolation of joints between samples have made the finding? Its error is known as that of
 * lengths, so a joint's place is off by about as much; ten times that allows for several joints in one margin
 * and for looking at some poses only. An error below the tolerance of lengths at the samples is none. */
static bool made_by_interpolation(const morph_record *r, const morph_findings *f, morph_margin_kind kind) {
    const morph_margin_kind pose[] = {MORPH_MARGIN_PANEL,     MORPH_MARGIN_LINK_POST,
                                      MORPH_MARGIN_LINK_LINK, MORPH_MARGIN_CLEARANCE,
                                      MORPH_MARGIN_BASE,      MORPH_MARGIN_SELF_CLEARANCE};
    bool moved = false;
    for (size_t k = 0; k < sizeof pose / sizeof *pose; k++)
        moved |= kind == pose[k];
    if (!moved || f->interpolation <= 1e-6 * r->spacing) return false;
    /* An angle's or a sine's amount in metres: by the shortest member that can span it. */
    double across = 1;
    if (kind == MORPH_MARGIN_PANEL || kind == MORPH_MARGIN_LINK_POST || kind == MORPH_MARGIN_LINK_LINK) {
        across = r->spacing;
        for (int i = 0; i < r->links; i++)
            across = fmin(across, r->length_limit[i][0]);
        for (int i = 0; i < r->posts; i++)
            across = fmin(across, r->post_length[i]);
    }
    return -f->kind[kind].worst * across <= 10 * f->interpolation;
}

const char *morph_check_hint(const morph_check_report *report) {
    return report->coarse
               ? "; joints between samples are interpolated: a finer schedule.sample may show that "
                 "it holds"
               : "";
}

/* Turns findings into the report. */
static void conclude(const morph_record *r, const morph_findings *f, morph_check_report *out) {
    double nearest = INFINITY;
    out->feasible = f->defect[0] == 0;
    memcpy(out->defect, f->defect, sizeof out->defect);
    out->clearance_at_end = r->deformed_v != NULL;
    out->clearance_resolution = f->clearance_resolution;
    out->interpolation = f->interpolation;
    for (int k = 0; k < MORPH_MARGIN_KINDS; k++) {
        const morph_finding *from = &f->kind[k];
        morph_margin *to = &out->margin[k];
        if (!from->tested || from->worst == INFINITY) continue;
        *to = (morph_margin){
            .tested = true, .worst = from->worst, .tolerance = from->tolerance, .time = from->time};
        to->unit = from->unit;
        if (from->said[0])
            snprintf(to->element, sizeof to->element, "%s", from->said);
        else
            pair_name(r, from, to->element, sizeof to->element);
        if (!(to->worst >= -to->tolerance)) out->feasible = false;
        const double rank = ranking((morph_margin_kind)k, from);
        if (rank < nearest) {
            nearest = rank;
            out->worst = (morph_margin_kind)k;
        }
    }
    const morph_margin *worst = &out->margin[out->worst];
    out->coarse = nearest < INFINITY && !out->defect[0] && !(worst->worst >= -worst->tolerance) &&
                  made_by_interpolation(r, f, out->worst);
}

morph_status morph_check_record(const morph_record *record, const morph_control *control,
                                morph_check_report *out) {
    memset(out, 0, sizeof *out);
    morph_findings f;
    memset(&f, 0, sizeof f);
    if (!morph_check_structure(record, &f) || !morph_check_schedule(record, &f)) {
        conclude(record, &f, out);
        return MORPH_OK;
    }
    morph_progress(control, "check", 0);
    morph_check_curves(record, &f);
    morph_status status = morph_check_poses(record, control, &f);
    morph_progress(control, "check", 0.3);
    if (status == MORPH_OK) status = morph_check_clearance(record, control, &f);
    if (status == MORPH_OK) status = morph_check_self(record, control, &f);
    if (status == MORPH_OK) status = morph_check_goal(record, &f);
    if (status == MORPH_OK) conclude(record, &f, out);
    return status;
}

morph_status morph_check_lengths(const morph_record *record, const double *time, const double *length,
                                 int samples, morph_check_report *out) {
    memset(out, 0, sizeof *out);
    morph_findings f;
    memset(&f, 0, sizeof f);
    morph_status status = MORPH_OK;
    if (morph_check_structure(record, &f)) status = morph_check_table(record, time, length, samples, &f);
    if (status == MORPH_OK) conclude(record, &f, out);
    return status;
}
