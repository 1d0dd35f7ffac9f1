#include "solvers/base.h"

#include <dlfcn.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

const char *morph_status_text(morph_status status) {
    switch (status) {
    case MORPH_OK:
        return "ok";
    case MORPH_ERR_NOMEM:
        return "out of memory";
    case MORPH_ERR_INPUT:
        return "unusable input";
    case MORPH_ERR_NONFINITE:
        return "a number is not finite";
    case MORPH_ERR_MOTION:
        return "a motion too fast to be followed";
    case MORPH_ERR_BACKEND:
        return "a library failed";
    case MORPH_ERR_IO:
        return "input or output failed";
    case MORPH_ERR_STOPPED:
        return "stopped";
    case MORPH_ERR_INTERNAL:
        return "internal error";
    }
    return "unknown status";
}

bool morph_stopped(const morph_control *control) {
    return control && control->stop && control->stop(control->user) != 0;
}

void morph_progress(const morph_control *control, const char *stage, double fraction) {
    if (control && control->progress) control->progress(control->user, stage, fraction);
}

void morph_log(const morph_control *control, const char *format, ...) {
    if (!control || !control->log) return;
    char line[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    control->log(control->user, line);
}

double morph_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void morph_blas_threads(int n) {
    /* Looked up at run time: with another BLAS there is nothing to pin. */
    union {
        void *object;
        void (*call)(int);
    } set = {dlsym(RTLD_DEFAULT, "openblas_set_num_threads")};
    if (set.object) set.call(n);
}

/* What OpenBLAS maps, and a little more. */
#define BLAS_ROOM ((size_t)144 << 20)

morph_status morph_blas_claim(void) {
    enum { N = 64 }; /* products of small matrices take no work space */
    static bool claimed;
    union {
        void *object;
        void (*call)(const char *, const char *, const int *, const int *, const int *, const double *,
                     const double *, const int *, const double *, const int *, const double *, double *,
                     const int *);
    } product = {dlsym(RTLD_DEFAULT, "dgemm_")};
    if (claimed || !morph_blas_name()[0] || !product.object) return MORPH_OK;
    void *room =
        mmap(NULL, BLAS_ROOM, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (room == MAP_FAILED || munmap(room, BLAS_ROOM) != 0) return MORPH_ERR_NOMEM;
    double *a = morph_alloc(3 * N * N, sizeof *a);
    if (!a) return MORPH_ERR_NOMEM;
    const int n = N;
    const double one = 1.0, zero = 0.0;
    product.call("N", "N", &n, &n, &n, &one, a, &n, a + N * N, &n, &zero, a + 2 * N * N, &n);
    free(a);
    claimed = true;
    return MORPH_OK;
}

const char *morph_blas_name(void) {
    union {
        void *object;
        char *(*call)(void);
    } name = {dlsym(RTLD_DEFAULT, "openblas_get_corename")};
    const char *text = name.object ? name.call() : NULL;
    return text ? text : "";
}

void *morph_alloc(size_t n, size_t m) {
    if (m != 0 && n > SIZE_MAX / m) return NULL;
    const size_t bytes = n * m;
    return calloc(bytes > 0 ? bytes : 1, 1);
}
