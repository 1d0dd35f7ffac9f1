/* The parts of the check; for planner/check*.c only. Times inside are in samples ("tau", 0 .. samples-1). */
#ifndef MORPH_CHECK_PARTS_H
#define MORPH_CHECK_PARTS_H

#include "model/mesh.h"
#include "planner/check.h"

/* Grid of the tests between samples: 10 times finer than the samples (the contract's number). */
enum { MORPH_CHECK_FINE = 10 };

typedef enum morph_element_kind {
    MORPH_ELEMENT_NONE,
    MORPH_ELEMENT_LINK,
    MORPH_ELEMENT_JOINT,
    MORPH_ELEMENT_POST,
    MORPH_ELEMENT_SKIN
} morph_element_kind;

typedef struct morph_element {
    morph_element_kind kind;
    int index;
} morph_element;

/* The least value of one margin so far and where it is. */
typedef struct morph_finding {
    bool tested;
    double worst, tolerance;
    double scale; /* what one unit of violation is compared with, in the margin's unit */
    double time;  /* s */
    morph_element a, b;
    const char *unit; /* NULL: the kind's */
    char said[96];    /* not empty: what to say instead of a and b */
} morph_finding;

typedef struct morph_findings {
    morph_finding kind[MORPH_MARGIN_KINDS];
    double clearance_resolution; /* s */
    bool plain;                  /* search by motion bounds alone, to compare with */
    long evaluations, proofs;    /* of both clearances: distances taken; spans that the swept test settled */
    double interpolation;        /* m */
    char defect[256];            /* the first one found */
} morph_findings;

/* Starts a margin: tested, nothing found yet (worst = +INFINITY). */
void morph_finding_begin(morph_finding *f, double tolerance, double scale);

/* Keeps the first of equal values: only a smaller one replaces. */
static inline bool morph_finding_note(morph_finding *f, double value, double time, morph_element a,
                                      morph_element b) {
    if (!(value < f->worst)) return false;
    f->worst = value;
    f->time = time;
    f->a = a;
    f->b = b;
    return true;
}

static inline morph_element morph_element_of(morph_element_kind kind, int index) {
    const morph_element e = {kind, index};
    return e;
}
static inline morph_element morph_no_element(void) {
    return morph_element_of(MORPH_ELEMENT_NONE, 0);
}

/* Writes the defect unless one stands there already. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void morph_findings_defect(morph_findings *f, const char *format, ...);
void morph_element_name(const morph_record *r, morph_element e, char *text, size_t size);

/* False, and a defect, unless structure, target and limits (and the schedule, where asked) can be used
 * without reading outside any array and without overflow. */
bool morph_check_structure(const morph_record *r, morph_findings *f);
bool morph_check_schedule(const morph_record *r, morph_findings *f);
/* Largest link radius: the radius of posts and of the skin, which have none of their own in a record. */
double morph_check_radius(const morph_record *r);
/* Sample time; samples >= 2. */
double morph_check_step(const double *time, int samples);
/* Evenly spaced from 0 to within tolerance (s); else the index of the first bad sample, else -1. */
int morph_check_even(const double *time, int samples, double tolerance);

/* Length, rate, acceleration and jerk between samples (quintic Hermite), rest and consistency. */
void morph_check_curves(const morph_record *r, morph_findings *f);
/* Lengths (links) of the curves at u (0 .. 1) of sample interval k. */
void morph_check_curve_lengths(const morph_record *r, int k, double u, double *length);

/* Panels, angles and base on the fine grid; posts and compatibility at the samples; held posts. */
morph_status morph_check_poses(const morph_record *r, const morph_control *control, morph_findings *f);
/* Swept distance to the target. */
morph_status morph_check_clearance(const morph_record *r, const morph_control *control, morph_findings *f);
/* Is the mesh closed? MORPH_ERR_NOMEM. */
morph_status morph_check_closed(const morph_mesh *m, bool *closed);
/* Swept distances of links and posts among themselves. */
morph_status morph_check_self(const morph_record *r, const morph_control *control, morph_findings *f);

/* Gaps and coverage at the end of the schedule, where the record has a goal. */
morph_status morph_check_goal(const morph_record *r, morph_findings *f);

/* A table of lengths alone (samples x links): differences against the limits, and the record's joints.
 * MORPH_ERR_NOMEM. */
morph_status morph_check_table(const morph_record *r, const double *time, const double *length, int samples,
                               morph_findings *f);

/* Points moving along piecewise cubics through their samples. */
typedef struct morph_motion {
    int samples, points;
    const double *x; /* samples x 3*points; not owned */
    double *travel;  /* samples x points: upper bound of the path length since sample 0 */
    double *bend;    /* samples x points: how far the interval from there on departs from its chord at most */
} morph_motion;

/* samples >= 2. */
morph_status morph_motion_create(const double *x, int samples, int points, morph_motion *out);
void morph_motion_free(morph_motion *m);
/* Weights of samples first .. first+count-1 at tau; returns first. Exactly 0 and 1 at a sample. */
int morph_motion_weights(int samples, double tau, double weight[4], int *count);
void morph_motion_point(const morph_motion *m, int point, double tau, double out[3]);
/* No point is further from where it was than this: the path length between two times is not larger. */
double morph_motion_travel(const morph_motion *m, int point, double from, double to);

/* No point is further from where uniform motion along the chord of the two times has it. */
double morph_motion_bend(const morph_motion *m, int point, double from, double to);

/* Least value over time of a function that changes no faster than its travel. */
typedef struct morph_sweep {
    double (*value)(void *data, double tau);              /* NaN: failed */
    double (*travel)(void *data, double from, double to); /* bound on the change of value */
    /* True only if the value is at least `least` at all times of the span, at whose ends it is that and
     * `spare` (>= 0) more; NULL: none. */
    bool (*apart)(void *data, double from, double to, double least, double spare);
    double worth; /* asked where motion bounds would need about so many times more spans, >= 1 */
    void *data;
    double slack; /* nothing below least - slack stays undiscovered (plus a hundredth of |least|) */
    double tie;   /* a value replaces the least only if lower by more than this */
    double least, at;
    double finest; /* shortest step between two evaluations that was needed, in samples */
    long evaluations, budget, proofs;
    bool failed, exhausted;
} morph_sweep;

/* Searches [from, to]; *from_value and *to_value as known at the ends. True if `least` was lowered (then
 * refined locally). Stops with failed (a value was NaN) or exhausted (budget spent, or motion too fast to
 * resolve). */
bool morph_sweep_run(morph_sweep *s, double from, double from_value, double to, double to_value);

/* Triangles of a mesh by boxes. */
typedef struct morph_boxes morph_boxes;
/* v, t (3 per triangle) are borrowed. MORPH_ERR_NOMEM. */
morph_status morph_boxes_create(const double *v, const int *t, int triangles, morph_boxes **out);
void morph_boxes_destroy(morph_boxes *b); /* NULL allowed */

/* A joint (1 corner), link axis (2) or skin triangle (3) at two times, straight between them. */
typedef struct morph_swept_element {
    int corners;
    double at[2][3][3];
} morph_swept_element;
/* Does the element keep more than `distance` (m, >= 0) from every triangle? False: no, or not proven. */
bool morph_boxes_apart(const morph_boxes *b, const morph_swept_element *e, double distance);

#endif
