/* Good scenes: every key, every default, the round trip through a written scene. */
#include "planner/scene_parts.h"

#include <fcntl.h>
#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void print_fault(void *user, const char *line) {
    int *count = user;
    if (count) ++*count;
    print_message("%s\n", line);
}

static void ignore(void *user, const char *line) {
    (void)user;
    (void)line;
}

static morph_scene *parse(const char *path, const char *text) {
    morph_scene *scene;
    assert_int_equal(morph_scene_parse(path, text, strlen(text), print_fault, ignore, NULL, &scene),
                     MORPH_OK);
    assert_non_null(scene);
    return scene;
}

static void assert_near(double a, double b) {
    if (!(fabs(a - b) <= 1e-14 * fmax(fabs(a), fabs(b)))) fail_msg("%.17g is not %.17g", a, b);
}

#define MINIMAL                                                                                              \
    "morphplan: 1\n"                                                                                         \
    "structure: {nodes: [4, 6], spacing: 0.2}\n"                                                             \
    "target: {shape: box, size: [0.2, 0.3, 0.1]}\n"

static void test_defaults(void **state) {
    (void)state;
    morph_scene *s = parse("dir/cube.v2.yaml", MINIMAL);
    const morph_structure_def *d = &s->structure;
    assert_string_equal(s->file, "dir/cube.v2.yaml");
    assert_string_equal(s->title, "cube.v2");
    assert_int_equal(d->nodes[0], 4);
    assert_int_equal(d->nodes[1], 6);
    assert_int_equal(d->layout, MORPH_LAYOUT_POSTS);
    assert_int_equal(d->joints, MORPH_JOINTS_BALL);
    assert_int_equal(d->bracing, MORPH_BRACING_NONE);
    assert_int_equal(d->support, MORPH_SUPPORT_BASE);
    /* The ratios of the documented example, at twice its spacing. */
    assert_near(d->thickness, 0.10);
    for (int k = 0; k < 2; k++) {
        assert_near(d->length[k][0], 0.15);
        assert_near(d->length[k][1], 0.27);
    }
    assert_near(d->length[MORPH_LINK_BRACE][0], 0.75);
    assert_near(d->length[MORPH_LINK_BRACE][1], 1.35);
    assert_near(d->radius, 0.008);
    assert_near(d->rate, 0.10);
    assert_near(d->acceleration, 0.40);
    assert_near(d->jerk, 4.0);
    assert_near(d->link_post[0], morph_radians(55));
    assert_near(d->link_post[1], morph_radians(125));
    assert_near(d->link_link[0], morph_radians(50));
    assert_near(d->link_link[1], morph_radians(130));
    assert_true(d->mass > 0 && d->stiffness > 0 && d->damping >= 0);
    assert_true(s->base == 0.0);
    assert_int_equal(s->motion.mode, MORPH_MODE_DROP);
    assert_near(s->motion.height, 0.2);
    assert_true(s->motion.gravity == 9.81 && s->motion.drag == 0.2 && s->motion.friction == 0.6);
    assert_true(s->motion.time == 3.0);
    assert_int_equal(s->attractors, MORPH_ATTRACT_AUTO);
    assert_true(s->duration == 0.0 && s->sample == 0.001);
    /* The target stands on the base, centred. */
    assert_true(s->target_def.scale == 1.0 && !s->target_def.has_fit);
    assert_true(s->target_def.at[0] == 0.0 && s->target_def.at[1] == 0.0);
    assert_near(s->target_def.at[2], 0.05);
    assert_true(s->target.vertices > 0);
    assert_true(fabs(s->target_report.lo[2]) < 1e-15);
    assert_near(s->target_report.hi[2], 0.1);
    morph_scene_destroy(s);
    morph_scene_destroy(NULL);
}

static const char full[] =
    "morphplan: 1\n"
    "title: \"Cube: \\\"A\\\" \\u00e9\"\n"
    "structure:\n"
    "  layout: posts\n"
    "  nodes: [5, 3]\n"
    "  spacing: 0.1\n"
    "  thickness: 0.06\n"
    "  joints: ball\n"
    "  bracing: none\n"
    "  mass: 0.03\n"
    "  fixed: none\n"
    "  support: base\n"
    "  link:\n"
    "    length: {bottom: [0.08, 0.13], top: [0.07, 0.14], brace: [0.8, 1.3]}\n"
    "    radius: 3e-3\n"
    "    rate: 0.04\n"
    "    acceleration: 0.3\n"
    "    jerk: 2.5\n"
    "    stiffness: 150\n"
    "    damping: 0\n"
    "    stuck: []\n"
    "  angle:\n"
    "    link_post: [60.1, 119.7]\n"
    "    link_link: [51, 131.3]\n"
    "    stiffness: 0.7\n"
    "    soft: 7.3\n"
    "    square: 0.05\n"
    "target:\n"
    "  shape: box\n"
    "  size: [0.15, 0.15, 0.10]\n"
    "  scale: 1.25\n"
    "  rotate: [10, -20.3, 30]\n"
    "  at: [0.01, -0.02, .07]\n"
    "base: -0.01\n"
    "motion:\n"
    "  mode: drop\n"
    "  height: 0.12\n"
    "  gravity: 1.62\n"
    "  drag: 0.1\n"
    "  friction: 0\n"
    "  time: 2.5\n"
    "  touch: []\n"
    "attractors: none\n"
    "start: flat\n"
    "goal: {mean_gap: 0.0123, coverage: 1}\n"
    "schedule:\n"
    "  duration: 4.2\n"
    "  sample: 0.002\n";

static void test_every_key(void **state) {
    (void)state;
    morph_scene *s = parse("full.yaml", full);
    const morph_structure_def *d = &s->structure;
    assert_string_equal(s->title, "Cube: \"A\" \xc3\xa9");
    assert_true(d->nodes[0] == 5 && d->nodes[1] == 3);
    assert_true(d->spacing == 0.1 && d->thickness == 0.06 && d->mass == 0.03 && d->radius == 3e-3);
    assert_true(d->length[0][0] == 0.08 && d->length[0][1] == 0.13);
    assert_true(d->length[1][0] == 0.07 && d->length[1][1] == 0.14);
    assert_true(d->length[2][0] == 0.8 && d->length[2][1] == 1.3);
    assert_true(d->rate == 0.04 && d->acceleration == 0.3 && d->jerk == 2.5);
    assert_true(d->stiffness == 150 && d->damping == 0);
    assert_near(d->link_post[0], morph_radians(60.1));
    assert_near(d->link_post[1], morph_radians(119.7));
    assert_near(d->link_link[0], morph_radians(51));
    assert_near(d->link_link[1], morph_radians(131.3));
    assert_int_equal(s->target_def.shape, MORPH_SHAPE_BOX);
    assert_true(s->target_def.size[0] == 0.15 && s->target_def.size[2] == 0.10 &&
                s->target_def.scale == 1.25);
    assert_near(s->target_def.rotate[1], morph_radians(-20.3));
    assert_true(s->target_def.at[0] == 0.01 && s->target_def.at[1] == -0.02 && s->target_def.at[2] == 0.07);
    assert_true(s->base == -0.01);
    assert_true(s->motion.height == 0.12 && s->motion.gravity == 1.62 && s->motion.drag == 0.1);
    assert_true(s->motion.friction == 0 && s->motion.time == 2.5);
    assert_int_equal(s->attractors, MORPH_ATTRACT_NONE);
    assert_true(s->duration == 4.2 && s->sample == 0.002);
    assert_true(s->goal.limit[MORPH_GOAL_MEAN_GAP] == 0.0123 && s->goal.limit[MORPH_GOAL_MAX_GAP] == 0.0 &&
                s->goal.limit[MORPH_GOAL_COVERAGE] == 1.0);
    for (int k = 0; k < 3; k++) /* at is the centre of the bounding box */
        assert_true(fabs(0.5 * (s->target_report.lo[k] + s->target_report.hi[k]) - s->target_def.at[k]) <
                    1e-14);
    char hash[65];
    snprintf(hash, sizeof hash, "%s", s->sha256);
    assert_int_equal(strlen(hash), 64);
    morph_scene_destroy(s);

    s = parse("one_pair.yaml",
              "morphplan: 1\nstructure: {nodes: [2, 2], spacing: 1, link: {length: [0.9, 1]}}\n"
              "target: {shape: box, size: [1, 1, 0.5]}\nbase: none\nmotion:\ngoal:\n");
    for (int k = 0; k < 2; k++)
        assert_true(s->structure.length[k][0] == 0.9 && s->structure.length[k][1] == 1.0);
    assert_true(isnan(s->base) && !morph_goal_any(&s->goal));
    assert_true(strcmp(s->sha256, hash) != 0);
    assert_true(fabs(s->target_report.lo[2]) < 1e-15); /* without a base it stands on 0 */
    morph_scene_destroy(s);
}

static bool same(double a, double b) {
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static bool same_array(const double *a, const double *b, int n) {
    for (int k = 0; k < n; k++)
        if (!same(a[k], b[k])) return false;
    return true;
}

/* Equal to the bit, but for file names and the hash. */
static void assert_same_scene(const morph_scene *a, const morph_scene *b) {
    const morph_structure_def *d = &a->structure, *e = &b->structure;
    assert_string_equal(a->title, b->title);
    assert_true(d->layout == e->layout && d->joints == e->joints && d->bracing == e->bracing);
    assert_true(d->support == e->support && d->nodes[0] == e->nodes[0] && d->nodes[1] == e->nodes[1]);
    assert_true(same(d->spacing, e->spacing) && same(d->thickness, e->thickness) && same(d->mass, e->mass));
    assert_true(same_array(&d->length[0][0], &e->length[0][0], 6));
    assert_true(same(d->radius, e->radius) && same(d->rate, e->rate) && same(d->jerk, e->jerk));
    assert_true(same(d->acceleration, e->acceleration) && same(d->stiffness, e->stiffness));
    assert_true(same(d->damping, e->damping));
    assert_true(same_array(d->link_post, e->link_post, 2) && same_array(d->link_link, e->link_link, 2));
    assert_true(same(d->angle_stiffness, e->angle_stiffness) && same(d->square, e->square));
    assert_true(same(d->angle_soft, e->angle_soft));
    const morph_target_def *t = &a->target_def, *u = &b->target_def;
    assert_true(t->shape == u->shape && t->has_fit == u->has_fit);
    assert_true(same_array(t->size, u->size, 3) && same_array(t->radii, u->radii, 3));
    assert_true(same(t->radius, u->radius) && same(t->height, u->height) && same(t->tube, u->tube));
    assert_true(same(t->cell, u->cell) && same(t->scale, u->scale) && same_array(t->fit, u->fit, 3));
    assert_true(same_array(t->rotate, u->rotate, 3) && same_array(t->at, u->at, 3));
    assert_true(same(a->base, b->base) && same(a->duration, b->duration) && same(a->sample, b->sample));
    assert_true(same_array(a->goal.limit, b->goal.limit, MORPH_GOAL_KINDS));
    assert_int_equal(a->attractors, b->attractors);
    assert_int_equal(a->motion.mode, b->motion.mode);
    assert_true(same_array(&a->motion.height, &b->motion.height, 5));
    assert_int_equal(a->target.vertices, b->target.vertices);
    assert_int_equal(a->target.triangles, b->target.triangles);
    assert_true(same_array(a->target.v, b->target.v, 3 * a->target.vertices));
    assert_memory_equal(a->target.t, b->target.t, (size_t)a->target.triangles * 3 * sizeof(int));
    assert_true(same_array(a->target_report.lo, b->target_report.lo, 3));
    assert_true(same_array(a->target_report.hi, b->target_report.hi, 3));
}

static void assert_round_trip(const morph_scene *scene, const char *path, const char *mesh_file) {
    char *text, *again;
    assert_int_equal(morph_scene_to_yaml(scene, mesh_file, &text), MORPH_OK);
    morph_scene *copy = parse(path, text);
    assert_same_scene(scene, copy);
    /* Writing what was read of it gives the same bytes. */
    assert_int_equal(morph_scene_to_yaml(copy, mesh_file, &again), MORPH_OK);
    assert_string_equal(text, again);
    morph_scene_destroy(copy);
    free(text);
    free(again);
}

/* A written scene says every key but those that have no default value. */
static void test_written(void **state) {
    (void)state;
    static const char *const keys[] = {"morphplan: 1\n",
                                       "title: \"a\"\n",
                                       "structure:\n",
                                       "  layout: posts\n",
                                       "  nodes: [4, 6]\n",
                                       "  spacing: 0.2\n",
                                       "  thickness: 0.1\n",
                                       "  joints: ball\n",
                                       "  bracing: none\n",
                                       "  mass: ",
                                       "  fixed: none\n",
                                       "  support: base\n",
                                       "  link:\n",
                                       "    length:\n",
                                       "      bottom: [",
                                       "      top: [",
                                       "      brace: [0.75, 1.35]\n",
                                       "    radius: 0.008\n",
                                       "    rate: 0.1\n",
                                       "    acceleration: 0.4\n",
                                       "    jerk: 4\n",
                                       "    stiffness: ",
                                       "    damping: ",
                                       "    stuck: []\n",
                                       "    link_post: [55, 125]\n",
                                       "    link_link: [50, 130]\n",
                                       "    stiffness: 0\n",
                                       "    soft: 5\n",
                                       "    square: 0\n",
                                       "target:\n",
                                       "  shape: box\n",
                                       "  size: [0.2, 0.3, 0.1]\n",
                                       "  scale: 1\n",
                                       "  rotate: [0, 0, 0]\n",
                                       "  at: [0, 0, 0.05]\n",
                                       "base: 0\n",
                                       "motion:\n",
                                       "  mode: drop\n",
                                       "  height: 0.2\n",
                                       "  gravity: 9.81\n",
                                       "  drag: 0.2\n",
                                       "  friction: 0.6\n",
                                       "  time: 3\n",
                                       "  touch: []\n",
                                       "attractors: auto\n",
                                       "start: flat\n",
                                       "schedule:\n",
                                       "  duration: auto\n",
                                       "  sample: 0.001\n"};
    morph_scene *s = parse("a.yaml", MINIMAL);
    char *text;
    assert_int_equal(morph_scene_to_yaml(s, NULL, &text), MORPH_OK);
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++)
        if (!strstr(text, keys[k])) fail_msg("no \"%s\" in:\n%s", keys[k], text);
    free(text);
    morph_scene_destroy(s);
}

static const char *const shape_lines[] = {
    "{shape: box, size: [0.2, 0.3, 0.1], rotate: [12.3, 45, -7.7]}",
    "{shape: sphere, radius: 0.11}",
    "{shape: ellipsoid, radii: [0.1, 0.2, 0.07], fit: [0.3, 0.2, 1000]}",
    "{shape: cylinder, radius: 0.1, height: 0.2, scale: 0.7}",
    "{shape: cone, radius: 0.1, height: 0.2, at: [0.05, 0, 0.3]}",
    "{shape: torus, radius: 0.1, tube: 0.03, rotate: [90, 0, 0]}",
    "{shape: capsule, radius: 0.05, height: 0.25, rotate: [0, 90, 0]}",
};

static void test_round_trip(void **state) {
    (void)state;
    morph_scene *s = parse("full.yaml", full);
    assert_round_trip(s, "copy/scene.yaml", NULL);
    morph_scene_destroy(s);
    /* Spacings whose multiples are no short decimals; every shape; with and without base. */
    for (size_t k = 0; k < sizeof shape_lines / sizeof *shape_lines; k++)
        for (int j = 0; j < 6; j += k == 0 ? 1 : 4) {
            static const char *const spacing[3] = {"0.1", "0.3333333333333333", "0.07123"};
            static const char *const base[2] = {"none", "0.013"};
            char text[400];
            snprintf(
                text, sizeof text,
                "morphplan: 1\ntitle: 'x # y: [z]'\nstructure: {nodes: [4, 4], spacing: %s}\ntarget: %s\n"
                "base: %s\n",
                spacing[j % 3], shape_lines[k], base[j / 3]);
            s = parse("a.yaml", text);
            if (j / 3 == 1 && k != 4) assert_near(s->target_report.lo[2], 0.013);
            assert_round_trip(s, "b.yaml", NULL);
            morph_scene_destroy(s);
        }
}

/* Small deterministic generator; 53 random bits as a number in [0, 1). */
static double uniform(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) * 0x1p-53;
}

static void test_numbers(void **state) {
    (void)state;
    uint64_t seed = 7;
    char text[MORPH_NUMBER_TEXT];
    for (int k = 0; k < 20000; k++) {
        /* Any double: the bits of one. */
        const double x = (uniform(&seed) - 0.5) * pow(10.0, 600.0 * uniform(&seed) - 300.0);
        double y;
        morph_number_print(x, text);
        assert_int_equal(morph_number_parse(text, &y), MORPH_NUMBER_GOOD);
        assert_true(same(x, y));
    }
    morph_number_print(0.1, text);
    assert_string_equal(text, "0.1");
    morph_number_print(-0.0, text);
    assert_string_equal(text, "-0");

    /* Angles read from degrees come back to the bit, and short ones stay short. */
    for (int k = 0; k < 20000; k++) {
        const double degrees = k < 3601 ? 0.1 * k - 180.0 : 720.0 * uniform(&seed) - 360.0;
        const double radians = morph_radians(degrees);
        double back;
        const double said = morph_degrees_print(radians, text);
        assert_int_equal(morph_number_parse(text, &back), MORPH_NUMBER_GOOD);
        assert_true(same(said, back));
        assert_true(same(morph_radians(back), radians));
    }
    for (int degrees = 0; degrees <= 180; degrees++) {
        morph_degrees_print(morph_radians(degrees), text);
        char expected[16];
        snprintf(expected, sizeof expected, "%d", degrees);
        assert_string_equal(text, expected);
    }
    /* Radians that no degrees give are met as closely as can be: to one unit in the last place. */
    int missed = 0;
    for (int k = 0; k < 20000; k++) {
        const double radians = 7.0 * uniform(&seed);
        const double back = morph_radians(morph_degrees_print(radians, text));
        missed += back != radians;
        assert_true(fabs(back - radians) <= 2.3e-16 * radians);
    }
    print_message("radians that no degrees give: %d of 20000\n", missed);
}

static void test_number_grammar(void **state) {
    (void)state;
    static const char *const good[] = {"0",   "-1",   "+2.5",  ".5",  "5.",
                                       "1e3", "1E-3", "1.e+2", "007", "1e-400"};
    static const char *const none[] = {"",    ".",     "-",    "e5", "1e",   "1e+",   "0x10", "1_000",
                                       "1,5", "1 ",    " 1",   "1m", "--1",  "1.2.3", "0b1",  "1e5.0",
                                       "one", "1e5e5", "nano", "~",  "null", "true",  "1:30"};
    static const char *const nonfinite[] = {"nan",   "NaN",      ".nan",  "inf",   "-inf",
                                            "+.INF", "infinity", "1e999", "-1e400"};
    double x;
    for (size_t k = 0; k < sizeof good / sizeof *good; k++)
        assert_int_equal(morph_number_parse(good[k], &x), MORPH_NUMBER_GOOD);
    for (size_t k = 0; k < sizeof none / sizeof *none; k++)
        assert_int_equal(morph_number_parse(none[k], &x), MORPH_NUMBER_NONE);
    for (size_t k = 0; k < sizeof nonfinite / sizeof *nonfinite; k++)
        assert_int_equal(morph_number_parse(nonfinite[k], &x), MORPH_NUMBER_NONFINITE);
    assert_int_equal(morph_number_parse("-.5e1", &x), MORPH_NUMBER_GOOD);
    assert_true(x == -5.0);
}

/* A locale with a decimal comma changes neither reading nor writing. Skipped where none is installed. */
static void test_locale(void **state) {
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8",  "de_DE",
                                        "fr_FR.UTF-8", "nl_NL.UTF-8", "it_IT.UTF-8"};
    const char *set = NULL;
    for (size_t k = 0; k < sizeof names / sizeof *names && !set; k++)
        set = setlocale(LC_ALL, names[k]);
    if (!set || localeconv()->decimal_point[0] != ',') {
        print_message("no locale with a decimal comma is installed: skipped\n");
        setlocale(LC_ALL, "C");
        skip();
    }
    morph_scene *s = parse("full.yaml", full);
    assert_true(s->structure.spacing == 0.1);
    assert_round_trip(s, "b.yaml", NULL);
    char *text;
    assert_int_equal(morph_scene_to_yaml(s, NULL, &text), MORPH_OK);
    assert_non_null(strstr(text, "spacing: 0.1\n"));
    assert_string_equal(localeconv()->decimal_point, ",");
    free(text);
    morph_scene_destroy(s);
    setlocale(LC_ALL, "C");
}

static void write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static const char tetrahedron[] =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/* Files are found from the scene's folder, and a copy beside the written scene serves as well. */
static void test_files(void **state) {
    (void)state;
    char folder[] = "/tmp/morph_scene_XXXXXX", mesh[64], path[64], copy[64];
    assert_non_null(mkdtemp(folder));
    snprintf(mesh, sizeof mesh, "%s/tetra.obj", folder);
    snprintf(copy, sizeof copy, "%s/copy \"\\.obj", folder);
    snprintf(path, sizeof path, "%s/a.yaml", folder);
    write_file(mesh, tetrahedron);
    write_file(copy, tetrahedron);
    write_file(path,
               "morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1}\n"
               "target: {shape: mesh, file: ./tetra.obj, fit: [0.2, 0.2, 0.2]}\n");
    morph_scene *s;
    assert_int_equal(morph_scene_read(path, print_fault, ignore, NULL, &s), MORPH_OK);
    assert_string_equal(s->title, "a");
    assert_string_equal(s->target_def.file_as_written, "./tetra.obj");
    char expected[96];
    snprintf(expected, sizeof expected, "%s/./tetra.obj", folder);
    assert_string_equal(s->target_def.file, expected);
    assert_round_trip(s, path, NULL);
    assert_round_trip(s, path, "copy \"\\.obj");
    assert_round_trip(s, "elsewhere/b.yaml", mesh); /* an absolute path stands for itself */
    char *text;
    assert_int_equal(morph_scene_to_yaml(s, "\xff.obj", &text), MORPH_ERR_INPUT);
    assert_null(text);
    morph_scene_destroy(s);
    unlink(mesh);
    unlink(copy);
    unlink(path);
    rmdir(folder);
}

static void read_scene(const char *folder, const char *name) {
    char path[512];
    morph_scene *s;
    int faults = 0;
    snprintf(path, sizeof path, "%s/%s.yaml", folder, name);
    if (morph_scene_read(path, print_fault, ignore, &faults, &s) != MORPH_OK) fail_msg("%s", path);
    assert_int_equal(faults, 0);
    assert_true(fabs(s->target_report.lo[2]) < 1e-12);
    const double width = (s->structure.nodes[0] - 1) * s->structure.spacing;
    for (int k = 0; k < 3; k++)
        assert_true(s->target_report.hi[k] - s->target_report.lo[k] <= 0.81 * width);
    assert_round_trip(s, path, NULL);
    morph_scene_destroy(s);
}

static void test_examples(void **state) {
    (void)state;
    static const char *const names[] = {"box_4",    "box_6", "box_8", "sphere_4", "sphere_6", "sphere_8",
                                        "cylinder", "cone",  "torus", "capsule",  "ellipsoid"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        read_scene(MORPH_SOURCE_DIR "/examples/scenes", names[k]);
}

static void test_shared_models(void **state) {
    (void)state;
    if (access(MORPH_SHARED_DIR "/models/wallhole.obj", R_OK) != 0) {
        print_message("%s/models is missing: skipped\n", MORPH_SHARED_DIR);
        skip();
    }
    static const char *const names[] = {"spot_8", "volcano_8", "wallhole_8"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        read_scene(MORPH_SOURCE_DIR "/tests/scenes", names[k]);
}

/* A link may be rigid: least and most the same, of all kinds or of one. */
static void test_rigid_links(void **state) {
    (void)state;
    static const char *const lengths[] = {"[0.1, 0.1]", "{bottom: [0.1, 0.1]}", "{top: [0.1, 0.1]}",
                                          "{brace: [1, 1]}"};
    for (int k = 0; k < 4; k++) {
        char text[256];
        snprintf(text, sizeof text,
                 "morphplan: 1\nstructure: {nodes: [3, 3], spacing: 0.1, bracing: web, link: {length: %s}}\n"
                 "target: {shape: sphere, radius: 0.1}\n",
                 lengths[k]);
        morph_scene *scene = parse("rigid.yaml", text);
        morph_structure *s = NULL;
        assert_int_equal(morph_structure_create(&scene->structure, &s), MORPH_OK);
        for (int l = 0; l < s->links; l++) {
            const bool rigid = k == 0 ? s->link_kind[l] != MORPH_LINK_BRACE : s->link_kind[l] == k - 1;
            assert_int_equal(s->length_limit[l][0] == s->length_limit[l][1], rigid);
            if (rigid) assert_true(s->length_limit[l][0] == s->start_length[l]);
        }
        assert_round_trip(scene, "rigid.yaml", NULL);
        morph_structure_destroy(s);
        morph_scene_destroy(scene);
    }
}

/* As many samples as a plan can hold, rounding of their quotient included, and no more. */
static void test_longest_duration(void **state) {
    (void)state;
    static const struct {
        const char *schedule;
        bool good;
    } cases[] = {{"{duration: 200, sample: 0.001}", true},
                 {"{duration: 60, sample: 0.0003}", true},
                 {"{duration: 100000, sample: 0.5}", true},
                 {"{duration: 60.0003, sample: 0.0003}", false},
                 {"{duration: 0.200001, sample: 0.000001}", false}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[256];
        snprintf(text, sizeof text, MINIMAL "schedule: %s\n", cases[k].schedule);
        morph_scene *scene;
        int faults = 0;
        assert_int_equal(
            morph_scene_parse("long.yaml", text, strlen(text), print_fault, ignore, &faults, &scene),
            cases[k].good ? MORPH_OK : MORPH_ERR_INPUT);
        assert_int_equal(faults, cases[k].good ? 0 : 1);
        morph_scene_destroy(scene);
    }
}

static void count_warning(void *user, const char *line) {
    ++*(int *)user;
    assert_non_null(strstr(line, "s.yaml:3: target.at: the target lies beside the grid (in y)"));
}

static void test_warning(void **state) {
    (void)state;
    static const char text[] =
        "morphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1}\n"
        "target: {shape: box, size: [0.1, 0.1, 0.1], at: [0, -1, 0.05]}\n";
    morph_scene *scene;
    int warnings = 0;
    assert_int_equal(morph_scene_parse("s.yaml", text, strlen(text), NULL, count_warning, &warnings, &scene),
                     MORPH_OK);
    assert_int_equal(warnings, 1);
    morph_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),         cmocka_unit_test(test_every_key),
        cmocka_unit_test(test_written),          cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_numbers),          cmocka_unit_test(test_number_grammar),
        cmocka_unit_test(test_locale),           cmocka_unit_test(test_files),
        cmocka_unit_test(test_examples),         cmocka_unit_test(test_shared_models),
        cmocka_unit_test(test_warning),          cmocka_unit_test(test_rigid_links),
        cmocka_unit_test(test_longest_duration),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
