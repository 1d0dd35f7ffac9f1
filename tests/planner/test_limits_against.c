/* Which limits are named against a goal, by multipliers made for it: what is compared, and in what order. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "planner/refine_goal.h"

#include <stdlib.h>
#include <string.h>

enum { NODES = 3, LINKS = 6, TUPLES = 4, STUCK = 4 };

/* A flat 3 x 3 grid with rows for some links (one of them stuck) and angles, and multipliers for all. */
typedef struct fixture {
    morph_structure *s;
    morph_length_rows lengths;
    morph_angle_rows angles;
    int link[LINKS], tuple[TUPLES], stuck[1];
    double lower[LINKS + TUPLES], upper[LINKS + TUPLES], *x, *base;
    morph_block block[2];
    morph_nlp *nlp;
    morph_nlp_result result;
    char text[400];
} fixture;

/* shortest, longest: of the bottom layer, spacings. */
static void setup(fixture *f, double shortest, double longest) {
    memset(f, 0, sizeof *f);
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = NODES;
    def.length[MORPH_LINK_BOTTOM][0] = shortest * def.spacing;
    def.length[MORPH_LINK_BOTTOM][1] = longest * def.spacing;
    f->stuck[0] = STUCK;
    def.stuck_link = f->stuck;
    def.stuck_links = 1;
    assert_int_equal(morph_structure_create(&def, &f->s), MORPH_OK);
    const int n = 3 * f->s->joints;
    for (int k = 0; k < LINKS; k++)
        f->link[k] = k < LINKS - 1 ? k : f->s->links - 1; /* the last one of the top layer */
    for (int k = 0; k < TUPLES; k++)
        f->tuple[k] = k < 2 ? k : f->s->link_posts + k;
    f->lengths = (morph_length_rows){f->s, LINKS, f->link, 0.0};
    f->angles = (morph_angle_rows){f->s, TUPLES, f->tuple, 0.0};
    f->block[0] = morph_block_lengths(&f->lengths, NULL, f->lower, f->upper);
    f->block[1] = morph_block_angles(&f->angles, NULL, f->lower + LINKS, f->upper + LINKS);
    f->x = calloc((size_t)n, sizeof(double));
    f->base = calloc((size_t)n, sizeof(double));
    assert_true(f->x && f->base);
    for (int i = 0; i < n; i++) {
        f->x[i] = f->s->start[i] / f->s->spacing + (i % 3 == 2 ? 1.0 : 0.0);
        f->base[i] = i % 3 == 2 ? f->x[i] : -1e6; /* every joint stands on the base plane */
    }
    char message[256];
    assert_int_equal(morph_nlp_create(n, f->x, NULL, NULL, f->block, 2, message, sizeof message, &f->nlp),
                     MORPH_OK);
    assert_int_equal(morph_nlp_result_create(f->x, n, LINKS + TUPLES, &f->result), MORPH_OK);
}

static void teardown(fixture *f) {
    morph_nlp_result_free(&f->result);
    morph_nlp_destroy(f->nlp);
    morph_structure_destroy(f->s);
    free(f->x);
    free(f->base);
}

static void name(fixture *f) {
    assert_int_equal(
        morph_limits_against(f->s, f->nlp, f->block, 2, &f->result, f->base, f->text, sizeof f->text),
        MORPH_OK);
}

/* 0 where it is not named. */
static int place(const fixture *f, const char *what) {
    const char *at = strstr(f->text, what);
    if (!at) return 0;
    int before = 1;
    for (const char *c = f->text; c < at; c++)
        before += strncmp(c, ", ", 2) == 0; /* nodes are written without the space */
    return before;
}

/* A row's multiplier that is worth `gain` to each spacing of the length: the row is its square. */
static double worth(double gain, double length) {
    return gain / (2.0 * length);
}

static void test_signs(void **state) {
    (void)state;
    fixture f;
    setup(&f, 0.75, 1.35);
    double *y = f.result.row_multiplier;
    name(&f);
    assert_string_equal(f.text, "");
    y[0] = worth(1.0, 1.35);
    name(&f);
    assert_string_equal(f.text, "length of link 0 (0,0)-(1,0) bottom (at its longest)");
    y[0] = -worth(1.0, 0.75);
    name(&f);
    assert_string_equal(f.text, "length of link 0 (0,0)-(1,0) bottom (at its shortest)");
    y[0] = 0.0;
    y[STUCK] = worth(1.0, 1.0);
    name(&f);
    assert_int_equal(place(&f, "(stuck, too short)"), 1);
    y[STUCK] = -worth(1.0, 1.0);
    name(&f);
    assert_int_equal(place(&f, "(stuck, too long)"), 1);
    /* The cosine is largest where the angle is least. */
    y[STUCK] = 0.0;
    y[LINKS] = 1.0;
    name(&f);
    assert_int_equal(place(&f, "/ post (0,0) (at its least)"), 1);
    y[LINKS] = -1.0;
    name(&f);
    assert_int_equal(place(&f, "/ post (0,0) (at its most)"), 1);
    teardown(&f);
}

/* A stuck link counts with what its layer would leave it: 0.35 of a spacing to longer, 0.25 to shorter, where
 * limits count with a tenth. */
static void test_stuck_counts_with_its_room(void **state) {
    (void)state;
    fixture f;
    setup(&f, 0.75, 1.35);
    double *y = f.result.row_multiplier;
    y[STUCK] = worth(1.0, 1.0);
    y[0] = worth(3.3, 1.35);
    name(&f);
    assert_int_equal(place(&f, "(stuck"), 1);
    y[0] = worth(3.7, 1.35);
    name(&f);
    assert_int_equal(place(&f, "(stuck"), 2);
    y[STUCK] = -worth(1.0, 1.0);
    y[0] = worth(2.3, 1.35);
    name(&f);
    assert_int_equal(place(&f, "(stuck"), 1);
    y[0] = worth(2.7, 1.35);
    name(&f);
    assert_int_equal(place(&f, "(stuck"), 2);
    teardown(&f);
    /* In a layer that may not lengthen anyway it is not the stuck link that stands against it. */
    setup(&f, 0.75, 1.0);
    f.result.row_multiplier[STUCK] = worth(1.0, 1.0);
    name(&f);
    assert_int_equal(place(&f, "(stuck"), 0);
    teardown(&f);
}

/* All links at one number of the scene together: two at 1 go before one at 1.9 of another number, though that
 * one is the strongest by itself; the strongest of each is the one named. */
static void test_causes_add_up(void **state) {
    (void)state;
    fixture f;
    setup(&f, 0.75, 1.35);
    double *y = f.result.row_multiplier;
    y[0] = worth(0.9, 1.35);
    y[1] = worth(1.1, 1.35);
    y[LINKS - 1] = worth(1.9, 1.35); /* top layer: a number of its own */
    y[2] = -worth(1.8, 0.75);
    name(&f);
    assert_int_equal(place(&f, "length of link 1 (0,0)-(0,1) bottom (at its longest)"), 1);
    assert_int_equal(place(&f, " top (at its longest)"), 2);
    assert_int_equal(place(&f, "length of link 2 (1,0)-(2,0) bottom (at its shortest)"), 3);
    assert_int_equal(place(&f, "link 0 "), 0);
    teardown(&f);
}

/* Joints on the base plane take one place of the three, however many and strong they are; solver's dust takes
 * none. */
static void test_base_once(void **state) {
    (void)state;
    fixture f;
    setup(&f, 0.75, 1.35);
    double *y = f.result.row_multiplier;
    for (int j = 0; j < f.s->joints; j++)
        f.result.lower_multiplier[3 * j + 2] = 10.0 + j;
    y[0] = worth(20.0, 1.35);
    y[2] = -worth(10.0, 0.75);
    y[3] = -worth(1e-9, 0.75);
    y[LINKS] = 1e-9;
    name(&f);
    assert_int_equal(place(&f, "base under joint "), 1);
    assert_int_equal(place(&f, "length of link 0 "), 2);
    assert_int_equal(place(&f, "length of link 2 "), 3);
    /* Above the plane its bound is the reach of a round and no limit. */
    for (int i = 2; i < 3 * f.s->joints; i += 3)
        f.base[i] -= 0.5;
    name(&f);
    assert_int_equal(place(&f, "base under joint "), 0);
    assert_int_equal(place(&f, "length of link 0 "), 1);
    teardown(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_signs), cmocka_unit_test(test_stuck_counts_with_its_room),
        cmocka_unit_test(test_causes_add_up), cmocka_unit_test(test_base_once)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
