/* Verification: every margin recomputed from a record's raw positions and lengths, by code of its own. Trusts
 * nothing the planner computed. */
#ifndef MORPH_CHECK_H
#define MORPH_CHECK_H

#include "planner/record.h"

typedef enum morph_margin_kind {
    MORPH_MARGIN_LENGTH,
    MORPH_MARGIN_RATE,
    MORPH_MARGIN_ACCELERATION,
    MORPH_MARGIN_JERK,
    MORPH_MARGIN_POST_LENGTH,
    MORPH_MARGIN_PANEL,
    MORPH_MARGIN_LINK_POST,
    MORPH_MARGIN_LINK_LINK,
    MORPH_MARGIN_CLEARANCE,
    MORPH_MARGIN_BASE,
    MORPH_MARGIN_SELF_CLEARANCE,
    MORPH_MARGIN_COMPATIBILITY,
    MORPH_MARGIN_GOAL,
    MORPH_MARGIN_KINDS
} morph_margin_kind;
/* "length", "rate", ... as in summary.json */
const char *morph_margin_name(morph_margin_kind kind);
const char *morph_margin_unit(morph_margin_kind kind); /* "as given" for the goal */

/* Positive is inside. */
typedef struct morph_margin {
    bool tested;      /* false: the scene has no such limit (no panels, no base) */
    double worst;     /* in the margin's unit, tolerance not included */
    double tolerance; /* holds when worst >= -tolerance */
    char element[96]; /* "link 17 (2,1)-(3,1) bottom" */
    double time;      /* s */
    const char *unit; /* where it is not that of the kind; else NULL */
} morph_margin;
/* The unit of this very margin. */
const char *morph_margin_unit_of(const morph_margin *margin, morph_margin_kind kind);

typedef struct morph_check_report {
    bool feasible; /* every tested margin holds */
    morph_margin margin[MORPH_MARGIN_KINDS];
    morph_margin_kind worst; /* the margin furthest beyond (or nearest to) its limit, relative to its scale */
    bool clearance_at_end;   /* against a pressed target, at the end alone: it gives way on the way */
    double clearance_resolution; /* s: between-sample motion is bounded at this step */
    double interpolation; /* m: most that lengths of posts and links are off between samples, where joints are
                             interpolated */
    bool coarse;          /* the worst margin fails by no more than that error can explain */
    char defect[256];     /* not empty: the record itself is unusable (sizes, NaN, time not even, start not at
                             rest ...); feasible is false */
} morph_check_report;

/* What to say after a finding: "" or, of a coarse report, a clause that begins with "; ". */
const char *morph_check_hint(const morph_check_report *report);

/* Verifies a record. */
morph_status morph_check_record(const morph_record *record, const morph_control *control,
                                morph_check_report *out);

/* The same for lengths alone against the record's structure and limits (check --schedule): length, rate,
 * acceleration and jerk from the samples by finite differences, and compatibility with the record's own
 * schedule: its joints at its samples, its curves of length between them, its end after it. time: samples;
 * length: samples x links. */
morph_status morph_check_lengths(const morph_record *record, const double *time, const double *length,
                                 int samples, morph_check_report *out);

/* "link 17 (2,1)-(3,1) bottom" and so on, from a record. */
void morph_record_link_name(const morph_record *r, int link, char *text, size_t size);
void morph_record_joint_name(const morph_record *r, int joint, char *text, size_t size);

#endif
