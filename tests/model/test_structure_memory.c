/* Every allocation of building a structure, its mobility and a shape from lengths fails in turn:
 * MORPH_ERR_NOMEM, nothing left. The C library's allocator is wrapped, so this is skipped where a sanitizer
 * has its own. */
#include "model/kinematics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void __libc_free(void *memory);

/* countdown < 0: allocations succeed; at 0 the next one fails. Volatile, since compilers take it that an
 * allocator touches no variable of the program. */
static volatile long countdown = -1, live;

static bool refuse(void) {
    return countdown >= 0 && countdown-- == 0;
}

/* Visible to the libraries as well, whatever the build's default. */
#define SHOWN __attribute__((visibility("default")))

SHOWN void *malloc(size_t size) {
    if (refuse()) return NULL;
    void *memory = __libc_malloc(size);
    live += memory != NULL;
    return memory;
}

SHOWN void *calloc(size_t count, size_t size) {
    if (refuse()) return NULL;
    void *memory = __libc_calloc(count, size);
    live += memory != NULL;
    return memory;
}

SHOWN void free(void *memory) {
    live -= memory != NULL;
    __libc_free(memory);
}

static const int held[2][2] = {{0, 0}, {1, 2}};

static morph_structure_def def_of(void) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    def.joints = MORPH_JOINTS_UNIVERSAL;
    def.bracing = MORPH_BRACING_FULL;
    def.fixed = MORPH_FIXED_LIST;
    def.fixed_nodes = 2;
    def.fixed_node = held;
    return def;
}

static void test_create(void **state) {
    (void)state;
    const morph_structure_def def = def_of();
    int refused = 0;
    for (long n = 0;; n++) {
        morph_structure *s;
        const long before = live;
        countdown = n;
        const morph_status status = morph_structure_create(&def, &s);
        const bool reached = countdown < 0;
        countdown = -1;
        if (!reached) assert_int_equal(status, MORPH_OK);
        if (reached) assert_int_equal(status, MORPH_ERR_NOMEM);
        morph_structure_destroy(s);
        assert_int_equal(live, before);
        if (!reached) break;
        refused++;
    }
    assert_true(refused > 20);
}

static void test_shape(void **state) {
    (void)state;
    const morph_structure_def def = def_of();
    morph_structure *s;
    double lengths[100], x[54];
    morph_shape_report report;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    morph_link_lengths(s, s->start, lengths);
    morph_blas_threads(1);
    /* One use first: what the libraries keep for themselves is then there. */
    assert_int_equal(morph_shape_from_lengths(s, lengths, s->start, x, &report), MORPH_OK);
    for (int l = 0; l < s->links; l++)
        lengths[l] *= 1.02;
    int refused = 0;
    for (long n = 0;; n++) {
        const long before = live;
        countdown = n;
        const morph_status status = morph_shape_from_lengths(s, lengths, s->start, x, &report);
        const bool reached = countdown < 0;
        countdown = -1;
        assert_int_equal(live, before);
        assert_int_equal(status, reached ? MORPH_ERR_NOMEM : MORPH_OK);
        if (!reached) break;
        refused++;
    }
    assert_true(refused > 12);
    morph_structure_destroy(s);
}
#else
static void test_create(void **state) {
    (void)state;
    print_message("the sanitizer has an allocator of its own: skipped\n");
    skip();
}
static void test_shape(void **state) {
    (void)state;
    skip();
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create),
        cmocka_unit_test(test_shape),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
