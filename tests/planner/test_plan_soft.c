/* Plans of scenes with a deformable target: filled, or read as tetrahedra; what is recorded, checked,
 * measured and refused. */
#include "planner/check.h"
#include "planner/folder.h"
#include "planner/import_tetra.h"
#include "planner/plan.h"
#include "planner/target_body.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define SHEET "morphplan: 1\nstructure: {nodes: [3, 3], spacing: 0.1, link: {stiffness: 20}}\n"
#define REST "motion: {friction: 0.4, time: 0.6}\nschedule: {sample: 0.01}\nattractors: none\n"

static char folder[64];

static int set_up(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/test_plan_soft_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state) {
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static void write_text(const char *name, const char *text, char path[128]) {
    snprintf(path, 128, "%s/%s", folder, name);
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    assert_true(fputs(text, f) >= 0);
    assert_int_equal(fclose(f), 0);
}

static void first_line(void *user, const char *line) {
    char *kept = user;
    if (kept[0] == '\0') snprintf(kept, 512, "%s", line);
}

/* NULL, with the first fault in line, where it is refused. */
static morph_scene *read_text(const char *text, char line[512]) {
    char path[128];
    morph_scene *scene = NULL;
    line[0] = '\0';
    write_text("scene.yaml", text, path);
    const morph_status status = morph_scene_read(path, first_line, NULL, line, &scene);
    assert_true(status == MORPH_OK || status == MORPH_ERR_INPUT);
    return scene;
}

static morph_scene *scene_of(const char *text) {
    char line[512];
    morph_scene *scene = read_text(text, line);
    if (!scene) fail_msg("%s", line);
    return scene;
}

static morph_plan *run(const morph_scene *scene) {
    const morph_plan_options o = {.method = MORPH_METHOD_BLANKET};
    morph_plan *plan = NULL;
    assert_int_equal(morph_plan_run(scene, &o, &plan), MORPH_OK);
    assert_non_null(plan);
    return plan;
}

static double highest(const double *v, int n) {
    double top = -INFINITY;
    for (int i = 0; i < n; i++)
        top = fmax(top, v[3 * i + 2]);
    return top;
}

static double signed_volume(const double *v, const int *t, int n) {
    double volume = 0.0, normal[3];
    for (int i = 0; i < n; i++) {
        morph_cross(&v[3 * t[3 * i]], &v[3 * t[3 * i + 1]], normal);
        volume += morph_dot(normal, &v[3 * t[3 * i + 2]]) / 6.0;
    }
    return volume;
}

/* What every plan with a deformable target holds. */
static void assert_pressed(const morph_plan *plan) {
    const morph_record *r = &plan->record;
    const morph_deformable_report *d = &plan->summary.deformable;
    assert_true(d->used && d->tetrahedra > 50 && d->vertices > 30);
    assert_true(d->pressed > 0.0 && d->least_volume > 0.0);
    assert_true(d->worst_depth <= 1e-3 * r->spacing);
    assert_true(r->deformed_vertices > 3 && r->deformed_vertices <= d->vertices);
    /* Closed, outward, a little smaller than at rest. */
    const double volume = signed_volume(r->deformed_v, r->deformed_t, r->deformed_triangles);
    assert_true(volume > 0.7 * d->volume && volume < 1.02 * d->volume);
    assert_true(highest(r->deformed_v, r->deformed_vertices) < highest(r->target_v, r->target_vertices));
    /* Clearance is judged at the end. */
    const morph_margin *m = &plan->summary.check.margin[MORPH_MARGIN_CLEARANCE];
    assert_true(m->tested && m->worst >= -m->tolerance);
    assert_true(m->time == r->time[r->samples - 1]);
    assert_non_null(strstr(plan->summary.warning, "deformable"));
}

/* Through the folder and back: the same check, and tampering shows. */
static void assert_folder(const morph_scene *scene, morph_plan *plan) {
    char path[128], message[256] = "", *json = NULL;
    morph_record r;
    morph_check_report before, after;
    snprintf(path, sizeof path, "%s/plan", folder);
    if (morph_folder_write(path, true, scene, &plan->record, &plan->summary, message, sizeof message) !=
        MORPH_OK)
        fail_msg("%s", message);
    assert_int_equal(morph_folder_read(path, &r, message, sizeof message), MORPH_OK);
    const size_t n = 3 * (size_t)plan->record.deformed_vertices;
    assert_int_equal(r.deformed_vertices, plan->record.deformed_vertices);
    assert_memory_equal(r.deformed_v, plan->record.deformed_v, n * sizeof(double));
    assert_int_equal(morph_check_record(&plan->record, NULL, &before), MORPH_OK);
    assert_int_equal(morph_check_record(&r, NULL, &after), MORPH_OK);
    assert_true(before.margin[MORPH_MARGIN_CLEARANCE].worst == after.margin[MORPH_MARGIN_CLEARANCE].worst);
    /* A surface that reaches higher, a corner that does not exist, a number that is none. */
    for (int i = 0; i < r.deformed_vertices; i++)
        r.deformed_v[3 * i + 2] += 0.01;
    assert_int_equal(morph_check_record(&r, NULL, &after), MORPH_OK);
    assert_true(after.margin[MORPH_MARGIN_CLEARANCE].worst < -0.005);
    assert_false(after.feasible);
    r.deformed_t[4] = r.deformed_vertices;
    assert_int_equal(morph_check_record(&r, NULL, &after), MORPH_OK);
    assert_non_null(strstr(after.defect, "deformed/triangles"));
    r.deformed_t[4] = 0;
    r.deformed_v[5] = NAN;
    assert_int_equal(morph_check_record(&r, NULL, &after), MORPH_OK);
    assert_non_null(strstr(after.defect, "deformed/vertices"));
    morph_record_free(&r);
    assert_int_equal(morph_summary_to_json(&plan->summary, &json), MORPH_OK);
    assert_non_null(strstr(json, "\"tetrahedra\""));
    assert_non_null(strstr(json, "\"pressed\""));
    free(json);
}

static void test_ball(void **state) {
    (void)state;
    morph_scene *scene = scene_of(
        SHEET "target: {shape: sphere, radius: 0.08, deformable: {young: 2.0e4, density: 300}}\n" REST);
    morph_plan *plan = run(scene);
    assert_pressed(plan);
    assert_true(plan->summary.blanket.coverage > 0.5);
    assert_folder(scene, plan);
    morph_plan_destroy(plan);
    morph_scene_destroy(scene);
    /* The rigid one has none of it. */
    scene = scene_of(
        "morphplan: 1\nstructure: {nodes: [2, 2], spacing: 0.1, link: {stiffness: 20}}\n"
        "target: {shape: box, size: [0.05, 0.05, 0.04]}\n"
        "motion: {time: 0.3}\nschedule: {sample: 0.01}\nattractors: none\n");
    plan = run(scene);
    assert_false(plan->summary.deformable.used);
    assert_null(plan->record.deformed_v);
    assert_true(plan->summary.warning[0] == '\0');
    morph_plan_destroy(plan);
    morph_scene_destroy(scene);
}

/* Rising: the pressed surface is recorded in the target's place. */
static void test_rise(void **state) {
    (void)state;
    morph_scene *scene = scene_of(
        "morphplan: 1\n"
        "structure: {nodes: [4, 4], spacing: 0.1, fixed: corners, support: frame, link: {stiffness: 20}}\n"
        "target: {shape: sphere, radius: 0.09, at: [0, 0, -0.05], deformable: {young: 2.0e4, density: 300}}\n"
        "motion: {mode: rise, height: 0.06, friction: 0.4, time: 1.0}\nschedule: {sample: 0.01}\nattractors: "
        "none\n");
    morph_plan *plan = run(scene);
    assert_pressed(plan);
    assert_true(plan->record.offset_nominal[2] == -0.06);
    assert_true(plan->summary.deformable.pressed < 0.04);
    morph_plan_destroy(plan);
    morph_scene_destroy(scene);
}

/* Gmsh's own torus, turned and scaled: the tetrahedra lie where the surface does. */
static void test_torus(void **state) {
    (void)state;
    if (access(MORPH_SHARED_DIR "/models/ipc_torus_tet.msh", R_OK) != 0) {
        print_message("skipped: no shared models beside the project\n");
        skip();
    }
    char text[1024], message[256];
    snprintf(text, sizeof text,
             SHEET
             "target: {shape: mesh, file: %s/models/ipc_torus_tet.msh, fit: [0.25, 0.25, 0.2], "
             "rotate: [20, 0, 30], deformable: {young: 5.0e4, density: 300}}\n" REST,
             MORPH_SHARED_DIR);
    morph_scene *scene = scene_of(text);
    assert_true(scene->target_report.closed);
    morph_tetra tetra;
    assert_int_equal(morph_target_tetra(&scene->target_def, &tetra, message, sizeof message), MORPH_OK);
    assert_int_equal(tetra.tets, 491);
    for (int i = 0; i < tetra.surface_vertices; i++)
        assert_true(morph_dist(&tetra.v[3 * tetra.surface[i]], &scene->target.v[3 * i]) < 1e-12);
    morph_tetra_free(&tetra);
    morph_plan *plan = run(scene);
    assert_pressed(plan);
    assert_int_equal(plan->summary.deformable.tetrahedra, 491);
    assert_folder(scene, plan);
    morph_plan_destroy(plan);
    morph_scene_destroy(scene);
}

/* A TetGen pair goes into the folder as a pair, and its scene is read again from there. */
static void test_pair(void **state) {
    (void)state;
    char path[128], line[512];
    write_text("block.node",
               "8 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 1 1 0\n4 0 0 1\n5 1 0 1\n6 0 1 1\n7 1 1 1\n", path);
    write_text("block.ele", "5 4 0\n0 0 1 2 4\n1 3 2 1 7\n2 5 4 7 1\n3 6 7 4 2\n4 1 2 4 7\n", path);
    const char *text =
        "morphplan: 1\nstructure: {nodes: [2, 2], spacing: 0.1, link: {stiffness: 20}}\n"
        "target: {shape: mesh, file: block.ele, scale: 0.08, deformable: {young: 2.0e4, density: 300}}\n"
        "motion: {friction: 0.4, time: 0.3}\nschedule: {sample: 0.01}\nattractors: none\n";
    morph_scene *scene = scene_of(text), *again = NULL;
    morph_plan *plan = run(scene);
    char message[256] = "";
    assert_int_equal(plan->summary.deformable.tetrahedra, 5);
    assert_true(fabs(plan->summary.deformable.volume - 0.08 * 0.08 * 0.08) < 1e-12);
    snprintf(path, sizeof path, "%s/pair", folder);
    assert_int_equal(
        morph_folder_write(path, true, scene, &plan->record, &plan->summary, message, sizeof message),
        MORPH_OK);
    snprintf(path, sizeof path, "%s/pair/scene.yaml", folder);
    line[0] = '\0';
    if (morph_scene_read(path, first_line, NULL, line, &again) != MORPH_OK) fail_msg("%s", line);
    assert_int_equal(again->target.vertices, scene->target.vertices);
    assert_memory_equal(again->target.v, scene->target.v, 24 * sizeof(double));
    morph_scene_destroy(again);
    morph_plan_destroy(plan);
    morph_scene_destroy(scene);
}

static void assert_refused(const char *target, const char *because) {
    char text[1024], line[512];
    snprintf(text, sizeof text, SHEET "target: {%s}\n" REST, target);
    morph_scene *scene = read_text(text, line);
    if (scene) fail_msg("accepted: %s", target);
    if (!strstr(line, because)) fail_msg("no '%s' in: %s", because, line);
}

static void keep_log(void *user, const char *line) {
    first_line(user, line);
}

static void test_refused(void **state) {
    (void)state;
    char path[128];
    write_text("one.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n", path);
    write_text("one.node", "1 3 0 0\n0 0 0 0\n", path);
    write_text("open.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0.5\n3 0 1 2\n3 1 3 2\n", path);
    assert_refused("shape: mesh, file: one.msh", "deformable target only");
    assert_refused("shape: mesh, file: one.node", "deformable target only");
    assert_refused("shape: mesh, file: one.msh, deformable: {young: 1, density: 1}", "one.msh");
    assert_refused("shape: mesh, file: one.node, deformable: {young: 1, density: 1}", "one.ele");
    assert_refused("shape: mesh, file: open.off, deformable: {young: 1, density: 1}", "open");
    /* Too stiff to be followed: found when the body is made. */
    char line[512] = "";
    const morph_control control = {.log = keep_log, .user = line};
    const morph_plan_options o = {.method = MORPH_METHOD_BLANKET, .control = &control};
    morph_plan *plan;
    morph_scene *scene = scene_of(
        SHEET "target: {shape: sphere, radius: 0.08, deformable: {young: 1e15, density: 1e-6}}\n" REST);
    assert_int_equal(morph_plan_run(scene, &o, &plan), MORPH_ERR_INPUT);
    assert_null(plan);
    if (!strstr(line, "young")) fail_msg("%s", line);
    morph_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ball), cmocka_unit_test(test_rise),
                                       cmocka_unit_test(test_torus), cmocka_unit_test(test_pair),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
