/* An allocator that refuses on demand: wraps the C library's, for this program and the libraries that it
 * uses. Include it in one file of a test program. Where a sanitizer has its own allocator, or the C library
 * is another, CAN_REFUSE is 0: skip. */
#ifndef TESTS_SUPPORT_REFUSED_MEMORY_H
#define TESTS_SUPPORT_REFUSED_MEMORY_H

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>

/* countdown < 0: allocations succeed; at 0 the next one fails, and so do all after it if `dry`. Volatile,
 * since compilers take it that an allocator touches no variable of the program. */
static volatile long countdown = -1;
static volatile long live __attribute__((unused)), allocations __attribute__((unused));
static volatile bool dry;

/* Whether the allocation that was to fail has been asked for. */
static inline bool was_refused(void) {
    return dry ? countdown == 0 : countdown < 0;
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define CAN_REFUSE 1
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void __libc_free(void *memory);

/* Visible to the libraries as well, whatever the build's default. */
#define SHOWN __attribute__((visibility("default")))

static bool refuse(void) {
    allocations++;
    if (countdown < 0) return false;
    if (countdown > 0) {
        countdown--;
        return false;
    }
    if (!dry) countdown = -1;
    errno = ENOMEM;
    return true;
}

SHOWN void *malloc(size_t size) {
    void *memory = refuse() ? NULL : __libc_malloc(size);
    live += memory != NULL;
    return memory;
}

SHOWN void *calloc(size_t count, size_t size) {
    void *memory = refuse() ? NULL : __libc_calloc(count, size);
    live += memory != NULL;
    return memory;
}

SHOWN void *realloc(void *old, size_t size) {
    void *memory = refuse() ? NULL : __libc_realloc(old, size);
    live += old == NULL && memory != NULL;
    return memory;
}

SHOWN void free(void *memory) {
    live -= memory != NULL;
    __libc_free(memory);
}
#else
#define CAN_REFUSE 0
#endif

#endif
