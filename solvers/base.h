/* What every layer shares: call status, control (stop, progress, log), small vector helpers.
 * Vectors are plain double[3]; packed arrays hold xyz per point. */
#ifndef MORPH_BASE_H
#define MORPH_BASE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Did the call work?  What an optimiser concluded is a different question (morph_outcome in nlp.h). */
typedef enum morph_status {
    MORPH_OK = 0,
    MORPH_ERR_NOMEM,     /* memory refused; nothing is left behind */
    MORPH_ERR_INPUT,     /* the caller's data cannot be used; a message says which */
    MORPH_ERR_NONFINITE, /* a NaN or an infinity where a number must stand */
    MORPH_ERR_MOTION,    /* a motion too fast to be followed, however short the steps */
    MORPH_ERR_BACKEND,   /* a library failed or threw */
    MORPH_ERR_IO,        /* a file cannot be read or written; errno is kept */
    MORPH_ERR_STOPPED,   /* the stop callback asked for it; results so far are kept where documented */
    MORPH_ERR_INTERNAL   /* our own bug */
} morph_status;

/* A short constant English text for a status. */
const char *morph_status_text(morph_status status);

/* How a long call talks to its caller.  Any pointer may be NULL; a NULL control is allowed everywhere.
 * Callbacks run on the caller's thread. */
typedef struct morph_control {
    int (*stop)(void *user);                                          /* nonzero: stop soon */
    void (*progress)(void *user, const char *stage, double fraction); /* fraction in [0,1] */
    void (*log)(void *user, const char *line);                        /* one line, no newline */
    void *user;
} morph_control;

bool morph_stopped(const morph_control *control);
void morph_progress(const morph_control *control, const char *stage, double fraction);
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void morph_log(const morph_control *control, const char *format, ...);

/* Seconds of a monotonic clock. */
double morph_seconds(void);

/* Pins OpenBLAS (where it is the BLAS) to n threads, so that sums repeat bit for bit. */
void morph_blas_threads(int n);

/* OpenBLAS maps its work space at its first large product, and where it cannot it waits for ever. This has it
 * mapped now, for this process and those that it forks. MORPH_ERR_NOMEM where there is no room. */
morph_status morph_blas_claim(void);

/* Name of OpenBLAS's kernel on this machine (results are the same bits per kernel only); "" with another
 * BLAS. */
const char *morph_blas_name(void);

/* calloc(n * m) that refuses overflow; n or m 0 gives a valid pointer to free. */
void *morph_alloc(size_t n, size_t m);

static inline double morph_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline void morph_sub(const double a[3], const double b[3], double out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = a[k] - b[k];
}
/* out may not alias a or b. */
static inline void morph_cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}
static inline double morph_norm(const double a[3]) {
    return sqrt(morph_dot(a, a));
}
static inline double morph_dist(const double a[3], const double b[3]) {
    double d[3];
    morph_sub(a, b, d);
    return morph_norm(d);
}

#endif
