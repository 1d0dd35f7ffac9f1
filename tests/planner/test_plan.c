/* The whole job: the record passes the check and a spoilt one does not; two runs give the same bytes; the
 * public calls, their exit codes and what they leave behind. */
#include "planner/check.h"
#include "planner/folder.h"
#include "planner/morphplan.h"
#include "planner/plan.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const char small[] =
    "morphplan: 1\n"
    "title: small\n"
    "structure: {nodes: [3, 2], spacing: 0.1, link: {stiffness: 20}}\n"
    "target: {shape: box, size: [0.1, 0.05, 0.06]}\n"
    "motion: {friction: 0.4, time: 0.5}\n"
    "schedule: {sample: 0.01}\n"
    "attractors: none\n";

static const char smaller[] =
    "morphplan: 1\n"
    "structure: {nodes: [2, 2], spacing: 0.1, link: {stiffness: 20}}\n"
    "target: {shape: box, size: [0.05, 0.05, 0.04]}\n"
    "motion: {friction: 0.4, time: 0.5}\n"
    "schedule: {sample: 0.01}\n";

static char folder[64];

static void in_folder(const char *name, char path[128]) {
    snprintf(path, 128, "%s/%s", folder, name);
}

static void write_text(const char *name, const char *text, char path[128]) {
    in_folder(name, path);
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    assert_true(fputs(text, f) >= 0);
    assert_int_equal(fclose(f), 0);
}

static int set_up(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/test_plan_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state) {
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static morph_plan *plan_text(const char *text, morph_method method) {
    char path[128];
    write_text("small.yaml", text, path);
    morph_scene *scene = NULL;
    assert_int_equal(morph_scene_read(path, NULL, NULL, NULL, &scene), MORPH_OK);
    const morph_plan_options o = {.method = method};
    morph_plan *plan = NULL;
    assert_int_equal(morph_plan_run(scene, &o, &plan), MORPH_OK);
    assert_non_null(plan);
    morph_scene_destroy(scene);
    return plan;
}

static bool holds(const morph_record *r) {
    morph_check_report report;
    assert_int_equal(morph_check_record(r, NULL, &report), MORPH_OK);
    return report.feasible;
}

/* Lengths of the record against the distances of its joints. */
static void assert_lengths_fit(const morph_record *r) {
    for (int k = 0; k < r->samples; k++)
        for (int l = 0; l < r->links; l++) {
            const double *x = &r->schedule_joints[(size_t)k * 3 * (size_t)r->joints];
            const double d = morph_dist(&x[3 * r->link[l][0]], &x[3 * r->link[l][1]]);
            const double length = r->length[(size_t)k * (size_t)r->links + (size_t)l];
            if (!(fabs(d - length) < 1e-12)) fail_msg("sample %d, link %d: %.12g and %.12g", k, l, length, d);
        }
}

/* Each way to spoil a record, and that it is seen. */
static void assert_tampering_shows(morph_record *r) {
    const size_t width = 3 * (size_t)r->joints, links = (size_t)r->links;
    const size_t middle = (size_t)(r->samples / 2);
    const struct {
        const char *what;
        double *at, by;
    } ways[] = {{"a length", &r->length[middle * links + 3], 1e-3},
                {"a length by little", &r->length[middle * links + 3], 1e-5},
                {"a joint", &r->schedule_joints[middle * width + 5], 1e-3},
                {"a joint at the end", &r->schedule_joints[(size_t)(r->samples - 1) * width + 2], -0.01},
                {"a rate", &r->rate[middle * links], 10.0},
                {"a NaN", &r->acceleration[middle * links], NAN},
                {"a moment", &r->time[middle], 4e-3},
                {"a limit of length", &r->length_limit[0][0], 0.05},
                {"a limit of rate", &r->rate_limit[0], -0.05 + 1e-9},
                {"a post's length", &r->post_length[2], 1e-4},
                {"the base", &r->base, 0.2},
                {"the target", &r->target_v[2], 1.0}};
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        const double before = *ways[k].at;
        *ways[k].at += ways[k].by;
        if (holds(r)) fail_msg("%s changed by %g: the check holds", ways[k].what, ways[k].by);
        *ways[k].at = before;
    }
    assert_true(holds(r));
}

static void test_record(void **state) {
    (void)state;
    morph_plan *p = plan_text(small, MORPH_METHOD_IPOPT);
    morph_record *r = &p->record;
    const morph_summary *s = &p->summary;
    assert_true(s->feasible && s->has_plan && s->has_blanket && s->reason[0] == '\0');
    assert_true(strcmp(s->outcome, "feasible") == 0 || strcmp(s->outcome, "optimal") == 0);
    assert_true(s->plan.objective < s->blanket.objective);
    assert_true(s->iterations_refine > 0 && s->iterations_path > 0 && s->peak_memory_bytes > 0);
    assert_true(s->rows_refine_used > 0 && s->rows_refine_used < s->rows_refine_possible);
    assert_true(fabs(s->duration - r->time[r->samples - 1]) < 1e-9);
    assert_int_equal(r->joints, 12);
    assert_int_equal(r->posts, 6);
    assert_string_equal(r->outcome, s->outcome);
    assert_int_equal(strlen(r->scene_sha256), 64);
    assert_true(r->path_s[0] == 0.0 && r->path_s[r->poses - 1] == 1.0);
    assert_true(r->mobility_samples > 1 && r->mobility_sample[r->mobility_samples - 1] == r->samples - 1);
    assert_lengths_fit(r);
    assert_true(holds(r));
    assert_tampering_shows(r);

    /* Again through the public call and its folder: the same bytes. */
    char scene[128], out[128], message[512];
    in_folder("small.yaml", scene);
    in_folder("again.plan", out);
    morph_job job = morph_job_defaults();
    job.folder = out;
    char *text = NULL, *json = NULL;
    assert_int_equal(morph_plan_scene(scene, &job, &text, &json), MORPH_EXIT_DONE);
    assert_non_null(text);
    assert_non_null(json);
    assert_non_null(strstr(json, "\"feasible\""));
    int lines = 0;
    for (const char *c = text; *c; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 6);
    free(text);
    free(json);
    morph_record again = {0};
    assert_int_equal(morph_folder_read(out, &again, message, sizeof message), MORPH_OK);
    const size_t samples = (size_t)r->samples, width = 3 * (size_t)r->joints, links = (size_t)r->links;
    assert_int_equal(again.samples, r->samples);
    assert_int_equal(again.poses, r->poses);
    assert_int_equal(again.nominal_frames, r->nominal_frames);
    assert_memory_equal(again.schedule_joints, r->schedule_joints, samples * width * sizeof(double));
    assert_memory_equal(again.length, r->length, samples * links * sizeof(double));
    assert_memory_equal(again.rate, r->rate, samples * links * sizeof(double));
    assert_memory_equal(again.acceleration, r->acceleration, samples * links * sizeof(double));
    assert_memory_equal(again.path_poses, r->path_poses,
                        (size_t)r->poses * 6 * (size_t)r->posts * sizeof(double));
    assert_memory_equal(again.nominal_joints, r->nominal_joints,
                        (size_t)r->nominal_frames * width * sizeof(double));
    morph_record_free(&again);
    morph_plan_destroy(p);

    /* What else can be done with the folder. */
    char picture[128], schedule[160];
    in_folder("again.svg", picture);
    assert_int_equal(morph_check_folder(out, NULL, &job, &text), MORPH_EXIT_DONE);
    assert_non_null(text);
    free(text);
    snprintf(schedule, sizeof schedule, "%s/schedule.csv", out);
    assert_int_equal(morph_check_folder(out, schedule, &job, &text), MORPH_EXIT_DONE);
    free(text);
    assert_int_equal(morph_picture_folder(out, picture, &job), MORPH_EXIT_DONE);
    assert_int_equal(access(picture, R_OK), 0);
    /* It is there: refused without overwrite, untouched. */
    assert_int_equal(morph_plan_scene(scene, &job, NULL, NULL), MORPH_EXIT_INPUT);
    assert_int_equal(morph_check_folder(out, NULL, &job, NULL), MORPH_EXIT_DONE);
}

typedef struct listener {
    int messages, progress;
    const char *until; /* stop in this stage; NULL: at once */
    bool reached;
} listener;

static void on_message(void *user, const char *line) {
    assert_true(line[0] != '\0' && !strchr(line, '\n'));
    ((listener *)user)->messages++;
}

static void on_progress(void *user, const char *stage, double fraction) {
    listener *l = user;
    if (!(fraction >= 0.0 && fraction <= 1.0)) fail_msg("progress %s %g", stage, fraction);
    l->progress++;
    l->reached |= l->until && strcmp(stage, l->until) == 0;
}

static int on_stop(void *user) {
    const listener *l = user;
    return !l->until || l->reached;
}

/* Stopped at several moments: a folder with the best so far, marked so, which reads back. */
static void test_stopped(void **state) {
    (void)state;
    char scene[128], out[128], message[512];
    write_text("stop.yaml", smaller, scene);
    in_folder("stop.plan", out);
    const morph_job plain = morph_job_defaults();
    const char *const stages[] = {NULL, "nominal", "placement", "path", "timing"};
    for (size_t k = 0; k < sizeof stages / sizeof *stages; k++) {
        listener l = {.until = stages[k]};
        morph_job job = morph_job_defaults();
        job.folder = out;
        job.overwrite = true;
        job.message = on_message;
        job.progress = on_progress;
        job.stop = on_stop;
        job.user = &l;
        char *text = NULL;
        const int code = morph_plan_scene(scene, &job, &text, NULL);
        assert_int_equal(code, MORPH_EXIT_STOPPED);
        if (!text) {
            /* Before there was anything to keep: while the target was prepared. */
            assert_true(k <= 1);
            assert_true(access(out, F_OK) != 0);
            continue;
        }
        free(text);
        morph_record r = {0};
        assert_int_equal(morph_folder_read(out, &r, message, sizeof message), MORPH_OK);
        assert_string_equal(r.outcome, "stopped");
        assert_lengths_fit(&r);
        morph_record_free(&r);
        const int checked = morph_check_folder(out, NULL, &plain, NULL);
        assert_true(checked == MORPH_EXIT_DONE || checked == MORPH_EXIT_INFEASIBLE);
        assert_true(l.progress > 0 && l.reached);
    }
}

/* The pure blanket: a record, judged by the check like any other. */
static void test_blanket(void **state) {
    (void)state;
    morph_plan *p = plan_text(smaller, MORPH_METHOD_BLANKET);
    assert_int_equal(p->summary.iterations_refine, 0);
    assert_string_equal(p->summary.method, "blanket");
    assert_int_equal(holds(&p->record), p->summary.feasible);
    assert_true(p->summary.feasible == (p->summary.reason[0] == '\0'));
    assert_lengths_fit(&p->record);
    morph_plan_destroy(p);
}

static void test_wrong_input(void **state) {
    (void)state;
    char path[128], out[128];
    listener l = {0};
    morph_job job = morph_job_defaults();
    job.message = on_message;
    job.user = &l;
    in_folder("none.plan", out);
    job.folder = out;
    assert_int_equal(morph_plan_scene("/nowhere/none.yaml", &job, NULL, NULL), MORPH_EXIT_INPUT);
    assert_int_equal(l.messages, 1);
    write_text("bad.yaml", "morphplan: 1\nstructure: {nodes: [3, 3], spacing: -1}\n", path);
    char *text = (char *)path, *json = (char *)path;
    assert_int_equal(morph_plan_scene(path, &job, &text, &json), MORPH_EXIT_INPUT);
    assert_true(l.messages >= 3 && !text && !json);
    assert_true(access(out, F_OK) != 0);
    assert_int_equal(morph_info_scene(path, &job, &text), MORPH_EXIT_INPUT);
    assert_null(text);
    assert_int_not_equal(morph_check_folder(out, NULL, &job, &text), MORPH_EXIT_DONE);
    assert_null(text);
    in_folder("none.svg", path);
    assert_int_not_equal(morph_picture_folder(out, path, &job), MORPH_EXIT_DONE);
    assert_true(access(path, F_OK) != 0);

    write_text("good.yaml", small, path);
    assert_int_equal(morph_info_scene(path, &job, &text), MORPH_EXIT_DONE);
    assert_non_null(text);
    assert_non_null(strstr(text, "(0,0)-(1,0)"));
    free(text);
}

static void test_workspace(void **state) {
    (void)state;
    char path[128];
    write_text("work.yaml", small, path);
    morph_scene *scene = NULL;
    assert_int_equal(morph_scene_read(path, NULL, NULL, NULL, &scene), MORPH_OK);
    morph_workspace w;
    assert_int_equal(morph_workspace_create(scene, NULL, &w), MORPH_OK);
    /* Lowest joints stand the drop height (a spacing) above the top of the target, at 0.06. */
    double lowest = INFINITY;
    for (int j = 0; j < w.structure->joints; j++)
        lowest = fmin(lowest, w.start[3 * j + 2]);
    assert_true(fabs(lowest - 0.16) < 1e-12);
    assert_true(w.accuracy.max < 0.1 * scene->structure.spacing && w.accuracy.rms <= w.accuracy.max);
    assert_ptr_equal(w.world.structure, w.structure);
    const morph_blanket_def def = morph_scene_blanket(scene, w.structure);
    assert_true(def.time == 0.5 && def.friction == 0.4 && def.base == scene->base);
    morph_workspace_free(&w);
    assert_null(w.structure);
    listener l = {0};
    const morph_control control = {.stop = on_stop, .user = &l};
    const morph_status status = morph_workspace_create(scene, &control, &w);
    assert_true(status == MORPH_ERR_STOPPED || status == MORPH_OK);
    morph_workspace_free(&w);
    morph_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_record),      cmocka_unit_test(test_stopped),   cmocka_unit_test(test_blanket),
        cmocka_unit_test(test_wrong_input), cmocka_unit_test(test_workspace),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
