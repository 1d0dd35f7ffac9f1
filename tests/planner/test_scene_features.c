/* Layouts, fixed nodes, touch, centres, rise, deformable targets: read, built, written and read again; and
 * which of them a method supports. */
#include "planner/scene_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void print_line(void *user, const char *line) {
    (void)user;
    print_message("%s\n", line);
}

static morph_scene *parse(const char *text) {
    morph_scene *scene;
    assert_int_equal(morph_scene_parse("s.yaml", text, strlen(text), print_line, print_line, NULL, &scene),
                     MORPH_OK);
    return scene;
}

/* A scene with these keys of the structure and these further sections. */
static morph_scene *scene_with(const char *structure, const char *sections) {
    char text[2048];
    snprintf(text, sizeof text,
             "morphplan: 1\nstructure: {nodes: [4, 5], spacing: 0.1%s}\n"
             "target: {shape: box, size: [0.15, 0.15, 0.1]%s\n",
             structure, sections);
    return parse(text);
}

static morph_structure *build(const morph_scene *scene) {
    morph_structure *s = NULL;
    assert_int_equal(morph_structure_create(&scene->structure, &s), MORPH_OK);
    return s;
}

/* The features of two scenes are the same to the bit. */
static void assert_same_features(const morph_scene *a, const morph_scene *b) {
    const morph_structure_def *d = &a->structure, *e = &b->structure;
    assert_true(d->layout == e->layout && d->joints == e->joints && d->bracing == e->bracing);
    assert_true(d->support == e->support && d->fixed == e->fixed && d->fixed_nodes == e->fixed_nodes);
    if (d->fixed_nodes > 0)
        assert_memory_equal(d->fixed_node, e->fixed_node, (size_t)d->fixed_nodes * sizeof(int[2]));
    assert_memory_equal(&a->motion, &b->motion, sizeof a->motion);
    assert_int_equal(a->touches, b->touches);
    for (int k = 0; k < a->touches; k++) {
        const morph_hand *t = &a->touch[k], *u = &b->touch[k];
        assert_int_equal(t->joint, u->joint);
        assert_memory_equal(t->force, u->force, sizeof t->force);
        assert_true(t->from == u->from && t->to == u->to);
    }
    assert_int_equal(a->attractors, b->attractors);
    assert_int_equal(a->centres, b->centres);
    if (a->centres > 0) assert_memory_equal(a->centre, b->centre, (size_t)a->centres * sizeof *a->centre);
    const morph_target_def *t = &a->target_def, *u = &b->target_def;
    assert_true(t->has_deformable == u->has_deformable && t->young == u->young && t->density == u->density);
}

/* Takes the scene. */
static void assert_round_trip(morph_scene *scene) {
    char *text, *again;
    assert_int_equal(morph_scene_to_yaml(scene, NULL, &text), MORPH_OK);
    morph_scene *copy = parse(text);
    assert_same_features(scene, copy);
    assert_int_equal(morph_scene_to_yaml(copy, NULL, &again), MORPH_OK);
    assert_string_equal(text, again);
    free(text);
    free(again);
    morph_scene_destroy(copy);
    morph_scene_destroy(scene);
}

static void test_structures(void **state) {
    (void)state;
    static const struct {
        const char *keys;
        morph_layout layout;
        morph_joint_type joints;
        morph_bracing bracing;
        morph_support support;
        int joints_, links, panels;
    } cases[] = {
        {"", MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_SUPPORT_BASE, 40, 62, 0},
        {", joints: universal, support: frame", MORPH_LAYOUT_POSTS, MORPH_JOINTS_UNIVERSAL,
         MORPH_BRACING_NONE, MORPH_SUPPORT_FRAME, 40, 62, 31},
        {", bracing: web, support: target", MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_WEB,
         MORPH_SUPPORT_TARGET, 40, 93, 0},
        {", bracing: full", MORPH_LAYOUT_POSTS, MORPH_JOINTS_BALL, MORPH_BRACING_FULL, MORPH_SUPPORT_BASE, 40,
         117, 0},
        {", layout: offset", MORPH_LAYOUT_OFFSET, MORPH_JOINTS_BALL, MORPH_BRACING_NONE, MORPH_SUPPORT_BASE,
         32, 17 + 31 + 48, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        morph_scene *scene = scene_with(cases[k].keys, "}");
        const morph_structure_def *d = &scene->structure;
        assert_true(d->layout == cases[k].layout && d->joints == cases[k].joints);
        assert_true(d->bracing == cases[k].bracing && d->support == cases[k].support);
        morph_structure *s = build(scene);
        assert_int_equal(s->joints, cases[k].joints_);
        assert_int_equal(s->links, cases[k].links);
        assert_int_equal(s->panels, cases[k].panels);
        morph_structure_destroy(s);
        assert_round_trip(scene);
    }
}

static void test_fixed(void **state) {
    (void)state;
    static const struct {
        const char *keys;
        morph_fixed fixed;
        int count;
    } cases[] = {{", fixed: none", MORPH_FIXED_NONE, 0},
                 {", fixed: []", MORPH_FIXED_NONE, 0},
                 {", fixed: border", MORPH_FIXED_BORDER, 14},
                 {", fixed: corners", MORPH_FIXED_CORNERS, 4},
                 {", fixed: [[3, 4], [0, 2]]", MORPH_FIXED_LIST, 2},
                 {", fixed: border, layout: offset", MORPH_FIXED_BORDER, 14},
                 {", fixed: [[3, 4]], layout: offset", MORPH_FIXED_LIST, 1}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        morph_scene *scene = scene_with(cases[k].keys, "}");
        assert_int_equal(scene->structure.fixed, cases[k].fixed);
        morph_structure *s = build(scene);
        assert_int_equal(s->fixed_count, cases[k].count);
        if (cases[k].fixed == MORPH_FIXED_LIST && cases[k].count == 2) {
            assert_int_equal(s->fixed[0], 8);
            assert_int_equal(s->fixed[1], 19);
        }
        morph_structure_destroy(s);
        assert_round_trip(scene);
    }
}

/* A list of every node of the largest grid is read and written. */
static void test_long_list(void **state) {
    (void)state;
    const size_t room = 80000;
    char *text = malloc(room);
    assert_non_null(text);
    size_t used = (size_t)snprintf(text, room,
                                   "morphplan: 1\ntarget: {shape: box, size: [1, 1, 1]}\n"
                                   "structure:\n  nodes: [64, 64]\n  spacing: 0.1\n  fixed:\n");
    for (int n = 0; n < 4096; n++)
        used += (size_t)snprintf(text + used, room - used, "    - [%d, %d]\n", n % 64, n / 64);
    morph_scene *scene = parse(text);
    assert_int_equal(scene->structure.fixed_nodes, 4096);
    free(text);
    assert_round_trip(scene);
}

static void test_touch(void **state) {
    (void)state;
    static const char hands[] =
        "}\nmotion:\n  touch:\n"
        "    - {node: [1, 2], layer: top, force: [0, 0.1, -2], from: 1.0, to: 1.5}\n"
        "    - {node: [2, 3], layer: bottom, force: [1e-3, 0, 0], from: 0, to: 0.001}\n";
    for (int layout = 0; layout < 2; layout++) {
        morph_scene *scene = scene_with(layout ? ", layout: offset" : "", hands);
        assert_int_equal(scene->touches, 2);
        const morph_hand *t = scene->touch;
        morph_structure *s = build(scene);
        assert_int_equal(s->joint_layer[t[0].joint], 1);
        assert_int_equal(s->joint_node[t[0].joint][0], 1);
        assert_int_equal(s->joint_node[t[0].joint][1], 2);
        assert_int_equal(s->joint_layer[t[1].joint], 0);
        assert_int_equal(s->joint_node[t[1].joint][0], 2);
        assert_int_equal(s->joint_node[t[1].joint][1], 3);
        assert_true(t[0].force[1] == 0.1 && t[0].force[2] == -2.0 && t[0].from == 1.0 && t[0].to == 1.5);
        assert_true(t[1].force[0] == 1e-3 && t[1].from == 0.0 && t[1].to == 0.001);
        morph_structure_destroy(s);
        assert_round_trip(scene);
    }
    assert_round_trip(scene_with("", "}\nmotion: {touch: []}"));
}

static void test_attractors(void **state) {
    (void)state;
    morph_scene *scene = scene_with("",
                                    "}\nattractors:\n  - {at: [0, -0.1, 0.25], strength: 0.3}\n"
                                    "  - {strength: 0, at: [1, 2, 3]}\n");
    assert_int_equal(scene->attractors, MORPH_ATTRACT_LIST);
    assert_int_equal(scene->centres, 2);
    assert_true(scene->centre[0].at[1] == -0.1 && scene->centre[0].at[2] == 0.25);
    assert_true(scene->centre[0].strength == 0.3 && scene->centre[1].strength == 0.0);
    assert_true(scene->centre[1].at[0] == 1.0);
    assert_round_trip(scene);
    scene = scene_with("", "}\nattractors: []");
    assert_int_equal(scene->attractors, MORPH_ATTRACT_NONE);
    assert_int_equal(scene->centres, 0);
    assert_round_trip(scene);
}

static void test_rise_and_deformable(void **state) {
    (void)state;
    /* In rise the height is a travel: it may be less than a link's radius. */
    morph_scene *scene = scene_with(
        ", fixed: border", ", deformable: {young: 2.0e4, density: 300}}\nmotion: {mode: rise, height: 0.11}");
    assert_int_equal(scene->motion.mode, MORPH_MODE_RISE);
    assert_true(scene->motion.height == 0.11);
    assert_true(scene->target_def.has_deformable);
    assert_true(scene->target_def.young == 2e4 && scene->target_def.density == 300.0);
    assert_round_trip(scene);
    scene = scene_with("", ", deformable: }");
    assert_false(scene->target_def.has_deformable);
    assert_true(scene->target_def.young == 0.0 && scene->target_def.density == 0.0);
    assert_round_trip(scene);
}

/* Defaults are written as short as they are meant. */
static void test_short_numbers(void **state) {
    (void)state;
    static const struct {
        const char *spacing, *bottom, *radius;
    } cases[] = {{"0.1", "[0.075, 0.135]", "0.004"},
                 {"0.3", "[0.225, 0.405]", "0.012"},
                 {"0.07", "[0.0525, 0.0945]", "0.0028"},
                 {"0.6", "[0.45, 0.81]", "0.024"},
                 {"1.1", "[0.825, 1.485]", "0.044"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[256], line[64], *written;
        snprintf(text, sizeof text,
                 "morphplan: 1\nstructure: {nodes: [4, 4], spacing: %s}\n"
                 "target: {shape: box, size: [0.1, 0.1, 0.1]}\n",
                 cases[k].spacing);
        morph_scene *scene = parse(text);
        assert_int_equal(morph_scene_to_yaml(scene, NULL, &written), MORPH_OK);
        snprintf(line, sizeof line, "bottom: %s\n", cases[k].bottom);
        if (!strstr(written, line)) fail_msg("no %s in:\n%s", line, written);
        snprintf(line, sizeof line, "radius: %s\n", cases[k].radius);
        if (!strstr(written, line)) fail_msg("no %s in:\n%s", line, written);
        assert_null(strstr(written, "00000"));
        free(written);
        assert_round_trip(scene);
    }
}

/* Distance of two segments: bisected search on a grid that shrinks around its best point (the function is
 * convex, so the best cell is next to it). */
static double segments_apart(const double *x, const int a[2], const int b[2]) {
    double best = INFINITY, at[2] = {0.5, 0.5};
    for (double width = 0.5; width > 1e-9; width *= 0.6) {
        const double middle[2] = {at[0], at[1]};
        for (int n = 0; n < 81; n++) {
            const double s = fmin(fmax(middle[0] + width * (n % 9 - 4) / 4.0, 0.0), 1.0);
            const double t = fmin(fmax(middle[1] + width * (n / 9 - 4) / 4.0, 0.0), 1.0);
            double p[3], q[3];
            for (int k = 0; k < 3; k++) {
                p[k] = (1.0 - s) * x[3 * a[0] + k] + s * x[3 * a[1] + k];
                q[k] = (1.0 - t) * x[3 * b[0] + k] + t * x[3 * b[1] + k];
            }
            if (morph_dist(p, q) >= best) continue;
            best = morph_dist(p, q);
            at[0] = s, at[1] = t;
        }
    }
    return best;
}

/* The largest radius that the reader takes is half of what the axes measure apart. */
static void test_room(void **state) {
    (void)state;
    static const char *const layouts[] = {"layout: posts", "bracing: web", "bracing: full", "layout: offset"};
    static const double thickness[] = {0.02, 0.05, 0.1, 0.2};
    for (int k = 0; k < 16; k++) {
        morph_structure_def def = morph_structure_defaults(0.1);
        def.nodes[0] = def.nodes[1] = 3;
        def.thickness = thickness[k / 4];
        def.layout = k % 4 == 3 ? MORPH_LAYOUT_OFFSET : MORPH_LAYOUT_POSTS;
        def.bracing = k % 4 == 1 ? MORPH_BRACING_WEB : k % 4 == 2 ? MORPH_BRACING_FULL : MORPH_BRACING_NONE;
        morph_structure *s;
        assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
        double least = INFINITY;
        for (int a = 0; a < s->links; a++)
            for (int b = 0; b < a; b++) {
                const int *p = s->link[a], *q = s->link[b];
                if (p[0] != q[0] && p[0] != q[1] && p[1] != q[0] && p[1] != q[1])
                    least = fmin(least, segments_apart(s->start, p, q));
            }
        morph_structure_destroy(s);
        for (int above = 0; above < 2; above++) {
            char text[400];
            morph_scene *scene;
            snprintf(
                text, sizeof text,
                "morphplan: 1\nstructure: {nodes: [3, 3], spacing: 0.1, thickness: %g, %s, link: {radius: "
                "%.9g}}\nmotion: {height: 1}\ntarget: {shape: box, size: [0.1, 0.1, 0.1]}\n",
                def.thickness, layouts[k % 4], 0.5 * least * (above ? 1.00001 : 0.99999));
            assert_int_equal(morph_scene_parse("s.yaml", text, strlen(text), NULL, NULL, NULL, &scene),
                             above ? MORPH_ERR_INPUT : MORPH_OK);
            morph_scene_destroy(scene);
        }
    }
}

static void test_supported(void **state) {
    (void)state;
    /* NULL: that is planned, centres are placed. */
    static const struct {
        const char *structure, *sections, *unplanned, *unplaced;
    } cases[] = {
        {"", "}", NULL, NULL},
        {"", "}\nattractors: [{at: [0, 0, 0], strength: 1}]", NULL, NULL},
        {", support: frame", "}", NULL, NULL},
        {", fixed: []", "}", NULL, NULL},
        {", layout: offset", "}", NULL, NULL},
        {", joints: universal", "}", NULL, NULL},
        {", bracing: web", "}", NULL, NULL},
        {", bracing: full, fixed: border", "}", NULL, NULL},
        {", fixed: corners", "}", NULL, NULL},
        {", fixed: [[1, 1]]", "}", NULL, NULL},
        {"", "}\nmotion: {mode: rise}", NULL, "motion.mode: rise"},
        {"", ", deformable: {young: 1e4, density: 300}}", "target.deformable", NULL},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        morph_scene *scene = scene_with(cases[k].structure, cases[k].sections);
        static const char *const methods[] = {"blanket", "ipopt", "nlopt"};
        char text[160] = "x", expected[160];
        for (int m = 0; m < 3; m++) {
            const char *feature = m == 0 ? NULL : cases[k].unplanned;
            if (m == 2 && !feature) feature = cases[k].unplaced;
            assert_int_equal(morph_scene_supported(scene, methods[m], text, sizeof text), feature == NULL);
            snprintf(expected, sizeof expected, "not available yet: %s with --method %s",
                     feature ? feature : "", methods[m]);
            assert_string_equal(text, feature ? expected : "");
        }
        assert_int_equal(morph_scene_unplaceable(scene, text, sizeof text), cases[k].unplaced != NULL);
        assert_string_equal(text, cases[k].unplaced ? cases[k].unplaced : "");
        morph_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_structures),    cmocka_unit_test(test_fixed),
        cmocka_unit_test(test_long_list),     cmocka_unit_test(test_touch),
        cmocka_unit_test(test_attractors),    cmocka_unit_test(test_rise_and_deformable),
        cmocka_unit_test(test_short_numbers), cmocka_unit_test(test_supported),
        cmocka_unit_test(test_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
