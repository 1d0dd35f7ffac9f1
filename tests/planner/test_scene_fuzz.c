/* Mutated scenes: each gives a scene or at least one fault line, and never anything else. Run it with the
 * sanitizers. */
#include "planner/scene_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char seed_text[] =
    "morphplan: 1\n"
    "title: \"Cube \\u00e9\"\n"
    "structure:\n"
    "  layout: posts\n"
    "  nodes: [4, 4]\n"
    "  spacing: 0.10\n"
    "  thickness: 0.05\n"
    "  fixed: [[0, 0]]\n"
    "  link:\n"
    "    length: {bottom: [0.075, 0.135], top: [0.08, 0.13], brace: [0.75, 1.35]}\n"
    "    radius: 0.004\n"
    "    force: [-50, 50]\n"
    "    stuck: [1, 2]\n"
    "  angle: {link_post: [55, 125], link_link: [50, 130]}\n"
    "target:\n"
    "  shape: box\n"
    "  size: [0.15, 0.15, 0.10]\n"
    "  rotate: [0, 10, 0]\n"
    "  deformable: {young: 2.0e4, density: 300}\n"
    "base: 0.0\n"
    "motion:\n"
    "  height: 0.10\n"
    "  touch:\n"
    "    - {node: [1, 2], layer: top, force: [0, 0, -2], from: 1.0, to: 1.5}\n"
    "attractors:\n"
    "  - {at: [0, 0, 0], strength: 1}\n"
    "goal: {mean_gap: 0.01, coverage: 0.9}\n"
    "schedule: {duration: 2.5, sample: 0.001}\n";

static const char good_text[] =
    "# A scene with much that may change without harm: comments, blanks, a title,\n"
    "# and numbers whose digits may be others.\n"
    "morphplan: 1\n"
    "title: 'Every letter of this may be another one'\n"
    "structure: {nodes: [4, 4], spacing: 0.1, bracing: web, fixed: [[0, 0], [3, 3], [1, 2]],\n"
    "  link: {stuck: [1, 2]}}\n"
    "target: {shape: box, size: [0.15, 0.15, 0.1]}\n"
    "motion:\n"
    "  touch: [{node: [1, 2], layer: top, force: [0, 0, -2], from: 1.0, to: 1.5}]\n"
    "attractors: [{at: [0, 0, 0.25], strength: 1.5}, {at: [0, 1, 0], strength: 2}]\n"
    "schedule: {duration: auto}\n";

static uint64_t seed = 20240229;

static unsigned below(unsigned n) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (unsigned)(seed >> 33) % n;
}

/* One change in place; returns the new size. size is at most room - 32. */
static size_t mutate(char *text, size_t size) {
    static const char *const pieces[] = {"nan", "-1",   "1e999", "[",   "]",        "{",   "}",
                                         ": ",  "\n",   "- ",    "&a ", "*a",       "!t ", "\"",
                                         "'",   "\xff", "\xe2",  "\\0", "99999999", "\t",  "---\n",
                                         "#",   "none", "auto",  "0",   ",",        "box", "|\n"};
    if (size == 0) return 0;
    const size_t at = below((unsigned)size);
    const char *piece = pieces[below(sizeof pieces / sizeof *pieces)];
    const size_t n = strlen(piece), cut = below(12);
    switch (below(6)) {
    case 0: /* a bit */
        text[at] = (char)(text[at] ^ (1 << below(8)));
        return size;
    case 1: /* a byte */
        text[at] = (char)below(256);
        return size;
    case 2: /* the end */
        return at;
    case 3: /* a hole */
        if (at + cut > size) return at;
        memmove(text + at, text + at + cut, size - at - cut);
        return size - cut;
    case 4: /* a word put in */
        memmove(text + at + n, text + at, size - at);
        memcpy(text + at, piece, n);
        return size + n;
    default: /* a word put over */
        if (at + n > size) return size;
        memcpy(text + at, piece, n);
        return size;
    }
}

static void count_line(void *user, const char *line) {
    int *count = user;
    ++*count;
    assert_null(strchr(line, '\n'));
    assert_true(strncmp(line, "fuzz.yaml:", 10) == 0);
}

static void ignore(void *user, const char *line) {
    (void)user;
    (void)line;
}

/* A scene also survives being written and read. */
static void try_text(const char *text, size_t size, int *scenes) {
    morph_scene *scene;
    int lines = 0;
    const morph_status status =
        morph_scene_parse("fuzz.yaml", text, size, count_line, ignore, &lines, &scene);
    if (status == MORPH_ERR_INPUT) {
        assert_true(lines > 0);
        assert_null(scene);
        return;
    }
    assert_int_equal(status, MORPH_OK);
    assert_int_equal(lines, 0);
    ++*scenes;
    char *written;
    morph_scene *copy;
    assert_int_equal(morph_scene_to_yaml(scene, NULL, &written), MORPH_OK);
    assert_int_equal(
        morph_scene_parse("fuzz.yaml", written, strlen(written), count_line, ignore, &lines, &copy),
        MORPH_OK);
    const int fixed = scene->structure.fixed_nodes;
    assert_int_equal(copy->structure.fixed_nodes, fixed);
    if (fixed > 0) assert_memory_equal(scene->fixed_node, copy->fixed_node, (size_t)fixed * sizeof(int[2]));
    const int stuck = scene->structure.stuck_links;
    assert_int_equal(copy->structure.stuck_links, stuck);
    if (stuck > 0) assert_memory_equal(scene->stuck_link, copy->stuck_link, (size_t)stuck * sizeof(int));
    /* All but where the lists of nodes and links stand. */
    scene->structure.fixed_node = copy->structure.fixed_node = NULL;
    scene->structure.stuck_link = copy->structure.stuck_link = NULL;
    assert_memory_equal(&scene->structure, &copy->structure, sizeof scene->structure);
    morph_scene_destroy(copy);
    morph_scene_destroy(scene);
    free(written);
}

static void fuzz(const char *start, int rounds, int *scenes) {
    enum { ROOM = 4096 };
    const size_t length = strlen(start);
    assert_true(length < ROOM - 256);
    for (int k = 0; k < rounds; k++) {
        /* An exact allocation, so that reading beyond the end is seen. */
        char work[ROOM];
        memcpy(work, start, length);
        size_t size = length;
        for (unsigned m = below(4) + 1; m > 0; m--)
            size = mutate(work, size);
        char *text = malloc(size > 0 ? size : 1);
        assert_non_null(text);
        memcpy(text, work, size);
        try_text(text, size, scenes);
        free(text);
    }
}

static void test_mutations(void **state) {
    (void)state;
    int scenes = 0;
    fuzz(seed_text, 4000, &scenes);
    fuzz(good_text, 4000, &scenes);
    print_message("8000 mutated scenes, %d still good\n", scenes);
    assert_true(scenes > 100); /* both ends of the reader were reached */
}

/* Every truncation of both texts. */
static void test_truncations(void **state) {
    (void)state;
    int scenes = 0;
    for (size_t n = 0; n <= strlen(seed_text); n++)
        try_text(seed_text, n, &scenes);
    for (size_t n = 0; n <= strlen(good_text); n++)
        try_text(good_text, n, &scenes);
    assert_true(scenes > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mutations),
        cmocka_unit_test(test_truncations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
