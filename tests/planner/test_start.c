/* Starts: files and their faults, the shape from lengths within its angles, where it is put, what is held. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "model/align.h"
#include "planner/blocks.h"
#include "planner/start.h"
#include "planner/start_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char file[64], message[1200];

static int make_file(void **state) {
    (void)state;
    strcpy(file, "/tmp/test_start_XXXXXX");
    const int fd = mkstemp(file);
    return fd < 0 || close(fd) != 0;
}

static int remove_file(void **state) {
    (void)state;
    return unlink(file);
}

static void write_text(const char *text) {
    FILE *out = fopen(file, "w");
    assert_non_null(out);
    assert_true(fputs(text, out) >= 0);
    assert_int_equal(fclose(out), 0);
}

static morph_structure_def small(void) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 3;
    return def;
}

static morph_structure *make(const morph_structure_def *def) {
    morph_structure *s;
    assert_int_equal(morph_structure_create(def, &s), MORPH_OK);
    return s;
}

/* A dome: posts square to it, bottom nodes on a sphere of radius 0.3 m. */
static void dome(const morph_structure *s, double *x) {
    for (int p = 0; p < s->posts; p++) {
        const double u = s->start[3 * p], v = s->start[3 * p + 1], r = 0.3;
        const double q[3] = {u / r, v / r, sqrt(1.0 - (u * u + v * v) / (r * r))};
        for (int c = 0; c < 3; c++) {
            x[3 * s->post[p][0] + c] = r * q[c];
            x[3 * s->post[p][1] + c] = (r + s->post_length[p]) * q[c];
        }
    }
}

static void write_row(const morph_structure *s, double *length) {
    morph_start start = {.links = s->links, .length = length};
    char *text;
    assert_int_equal(morph_start_to_csv(&start, &text), MORPH_OK);
    write_text(text);
    free(text);
}

static void write_lengths(const morph_structure *s, const double *x) {
    double length[64];
    assert_true(s->links <= 64);
    morph_link_lengths(s, x, length);
    write_row(s, length);
}

static morph_status read_start(const morph_structure_def *def, morph_start *start) {
    *start = (morph_start){.file = strdup(file)};
    assert_non_null(start->file);
    return morph_start_read(def, start, message, sizeof message);
}

/* Lengths of a dome: met to rounding, angles within their limits, and a doubt that is there. */
static void test_lengths(void **state) {
    (void)state;
    const morph_structure_def def = small();
    morph_structure *s = make(&def);
    double x[54], length[24];
    dome(s, x);
    write_lengths(s, x);
    morph_start start;
    assert_int_equal(read_start(&def, &start), MORPH_OK);
    assert_int_equal(start.kind, MORPH_START_LENGTHS);
    assert_string_equal(morph_start_name(start.kind), "lengths");
    assert_true(start.joints == 18 && start.links == 24 && start.free_motions == 15);
    morph_link_lengths(s, start.pose, length);
    double off = 0.0, most = 0.0;
    for (int l = 0; l < s->links; l++)
        off = fmax(off, fabs(length[l] - start.length[l]));
    assert_true(off <= start.residual + 1e-15 && start.residual < 1e-10);
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        const double angle = morph_angle_at(s, t, start.pose), *limit = morph_angle_limit(s, t);
        assert_true(angle >= limit[0] && angle <= limit[1]);
    }
    assert_true(start.doubt > 0.0 && isfinite(start.doubt));
    assert_int_equal(morph_align(s->joints, x, start.pose, NULL, &most), MORPH_OK);
    print_message("dome: residual %.1e m, true shape %.4f m away, doubt %.4f m\n", start.residual, most,
                  start.doubt);
    morph_start_free(&start);
    assert_null(start.file);
    morph_structure_destroy(s);
}

/* What is written reads back to the bit; rows and columns that are wrong are named. */
static void test_pose(void **state) {
    (void)state;
    const morph_structure_def def = small();
    morph_structure *s = make(&def);
    double x[54];
    dome(s, x);
    morph_start out = {.joints = s->joints, .pose = x}, start;
    char *text, copy[4096];
    assert_int_equal(morph_start_to_csv(&out, &text), MORPH_OK);
    write_text(text);
    assert_int_equal(read_start(&def, &start), MORPH_OK);
    assert_int_equal(start.kind, MORPH_START_POSE);
    assert_memory_equal(start.pose, x, sizeof x);
    assert_true(isnan(start.doubt) && start.residual == 0.0 && start.free_motions == 15);
    morph_start_free(&start);
    static const struct {
        const char *from, *to, *says;
    } bad[] = {{"joint,x_m", "joint,y_m", ":1: the header is another"},
               {"\n3,", "\n3,nan,", ":5: column 2: \"nan\" is not a number"},
               {"\n3,", "\n4,", ":5: column 1: joint 4, expected 3"},
               {"\n2,", "\n2,1,", ":4: more columns, expected 4"},
               {"\n17,", "\n17\n", ":19: fewer columns, expected 4"},
               {"\n17,", "\n17,0,0,0\n18,", ":20: more rows than the 18 joints"},
               {"\n17,", "\n#17,", ":19: column 1: \"#17\" is not a number"},
               {"\n9,-0.", "\n9,-9.", "post (0,0) is "}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const char *at = strstr(text, bad[k].from);
        assert_non_null(at);
        snprintf(copy, sizeof copy, "%.*s%s%s", (int)(at - text), text, bad[k].to, at + strlen(bad[k].from));
        write_text(copy);
        assert_int_equal(read_start(&def, &start), MORPH_ERR_INPUT);
        if (!strstr(message, bad[k].says)) fail_msg("\"%s\" does not say \"%s\"", message, bad[k].says);
        assert_null(start.pose);
        morph_start_free(&start);
    }
    text[strlen(text) / 2] = '\0';
    write_text(text);
    assert_int_equal(read_start(&def, &start), MORPH_ERR_INPUT);
    morph_start_free(&start);
    free(text);
    morph_structure_destroy(s);
}

/* Lengths that no shape of these limits has. */
static void test_bad_lengths(void **state) {
    (void)state;
    morph_structure_def def = small();
    morph_structure *s = make(&def);
    double x[54];
    morph_start start;
    dome(s, x);
    write_lengths(s, x);
    def.length[MORPH_LINK_TOP][1] = 0.101;
    assert_int_equal(read_start(&def, &start), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "top starts at 0.1"));
    assert_non_null(strstr(message, "allowed: 0.075 to 0.101"));
    assert_true(!start.pose && !start.length);
    morph_start_free(&start);
    /* A full bracing leaves no freedom: links by turns too short and too long fit nothing. */
    def = small();
    def.bracing = MORPH_BRACING_FULL;
    morph_structure_destroy(s);
    s = make(&def);
    double length[64];
    assert_true(s->links <= 64);
    for (int l = 0; l < s->links; l++)
        length[l] = (l % 2 ? 1.2 : 0.85) * s->start_length[l];
    write_row(s, length);
    assert_int_equal(read_start(&def, &start), MORPH_ERR_INPUT);
    if (!strstr(message, "no shape has these lengths")) fail_msg("%s", message);
    morph_start_free(&start);
    morph_structure_destroy(s);
}

/* A stuck link holds what it has in the pose; without a pose nothing changes. */
static void test_hold(void **state) {
    (void)state;
    const int stuck[] = {0, 12};
    morph_structure_def def = small();
    def.stuck_links = 2;
    def.stuck_link = stuck;
    morph_structure *s = make(&def);
    double x[54];
    morph_start start = {0};
    morph_start_hold(&start, s);
    assert_true(s->length_limit[12][0] == s->start_length[12]);
    dome(s, x);
    start.pose = x;
    morph_start_hold(&start, s);
    for (int k = 0; k < 2; k++) {
        const int *end = s->link[stuck[k]];
        assert_true(s->length_limit[stuck[k]][0] == morph_dist(&x[3 * end[0]], &x[3 * end[1]]));
        assert_true(s->length_limit[stuck[k]][0] == s->length_limit[stuck[k]][1]);
    }
    assert_true(s->length_limit[1][0] < s->length_limit[1][1]);
    morph_structure_destroy(s);
}

/* Turned and far away it comes to the same place, with the same lengths, no joint below the flat start's. */
static void test_place(void **state) {
    (void)state;
    const morph_structure_def def = small();
    morph_structure *s = make(&def);
    double x[54], turned[54], flat[54], a[54], b[54], before[24], after[24], lowest = INFINITY;
    dome(s, x);
    for (int j = 0; j < 18; j++) {
        turned[3 * j] = 5.0 - x[3 * j + 2];
        turned[3 * j + 1] = x[3 * j + 1] - 7.0;
        turned[3 * j + 2] = x[3 * j];
        for (int c = 0; c < 3; c++)
            flat[3 * j + c] = s->start[3 * j + c] + (c == 2 ? 0.4 : 0.0);
    }
    morph_start start = {.kind = MORPH_START_POSE, .joints = 18, .pose = x};
    assert_int_equal(morph_start_place(&start, flat, a), MORPH_OK);
    start.pose = turned;
    assert_int_equal(morph_start_place(&start, flat, b), MORPH_OK);
    morph_link_lengths(s, x, before);
    morph_link_lengths(s, b, after);
    for (int l = 0; l < 24; l++)
        assert_true(fabs(before[l] - after[l]) < 1e-13);
    for (int i = 0; i < 54; i++)
        assert_true(fabs(a[i] - b[i]) < 1e-9);
    for (int j = 0; j < 18; j++)
        lowest = fmin(lowest, b[3 * j + 2]);
    assert_true(fabs(lowest - 0.4) < 1e-12);
    turned[4] = NAN;
    assert_int_equal(morph_start_place(&start, flat, b), MORPH_ERR_NONFINITE);
    morph_structure_destroy(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lengths), cmocka_unit_test(test_pose),
                                       cmocka_unit_test(test_bad_lengths), cmocka_unit_test(test_hold),
                                       cmocka_unit_test(test_place)};
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
