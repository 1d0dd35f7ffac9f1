/* Exports: the curve of a plan folder, rebuilt at any step; its text; what is refused. */
#include "planner/export.h"
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

static const char scene_text[] =
    "morphplan: 1\n"
    "structure: {nodes: [3, 2], spacing: 0.1, link: {stiffness: 20}}\n"
    "target: {shape: box, size: [0.1, 0.05, 0.06]}\n"
    "motion: {friction: 0.4, time: 0.5}\n"
    "schedule: {sample: 0.01}\n";

static char folder[64], plan_folder[80];
static morph_record record;

static void last_line(void *user, const char *line) {
    snprintf(user, 256, "%s", line);
}

static int set_up(void **state) {
    char scene[96];
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/test_export_XXXXXX");
    if (!mkdtemp(folder)) return -1;
    snprintf(scene, sizeof scene, "%s/small.yaml", folder);
    snprintf(plan_folder, sizeof plan_folder, "%s/small.plan", folder);
    FILE *f = fopen(scene, "w");
    if (!f || fputs(scene_text, f) < 0 || fclose(f) != 0) return -1;
    morph_job job = morph_job_defaults();
    job.method = "blanket";
    const int code = morph_plan_scene(scene, &job, NULL, NULL);
    if (code != MORPH_EXIT_DONE && code != MORPH_EXIT_INFEASIBLE) return -1;
    return morph_folder_read(plan_folder, &record, NULL, 0) == MORPH_OK ? 0 : -1;
}

static int tear_down(void **state) {
    char command[128];
    (void)state;
    morph_record_free(&record);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static morph_export_table evaluate(double sample) {
    morph_export_table t;
    char message[256] = "";
    if (morph_export_evaluate(&record, sample, &t, message, sizeof message) != MORPH_OK)
        fail_msg("%s", message);
    return t;
}

/* At the plan's own step: its samples, lengths within 1e-12 m, rates and accelerations likewise. */
static void own_step_is_the_schedule(void **state) {
    (void)state;
    morph_export_table t = evaluate(0.0);
    const size_t links = (size_t)record.links;
    assert_int_equal(t.samples, record.samples);
    assert_int_equal(t.links, record.links);
    for (size_t k = 0; k < (size_t)t.samples * links; k++) {
        if (!(fabs(t.length[k] - record.length[k]) <= 1e-12)) fail_msg("length %zu", k);
        if (!(fabs(t.rate[k] - record.rate[k]) <= 1e-10)) fail_msg("rate %zu", k);
        if (!(fabs(t.acceleration[k] - record.acceleration[k]) <= 1e-8)) fail_msg("acceleration %zu", k);
    }
    morph_export_table_free(&t);
}

/* A step of a third and one of 7: the same curve where times meet, and derivatives that are its own. */
static void any_step_is_the_same_curve(void **state) {
    (void)state;
    const size_t links = (size_t)record.links;
    morph_export_table fine = evaluate(0.01 / 3.0), coarse = evaluate(0.07);
    for (size_t i = 0; i < (size_t)record.samples; i++)
        for (size_t l = 0; l < links; l++)
            if (!(fabs(fine.length[3 * i * links + l] - record.length[i * links + l]) <= 1e-12))
                fail_msg("sample %zu, link %zu", i, l);
    for (size_t i = 0; i < (size_t)coarse.samples && 7 * i < (size_t)record.samples; i++)
        for (size_t l = 0; l < links; l++)
            if (!(fabs(coarse.length[i * links + l] - record.length[7 * i * links + l]) <= 1e-12))
                fail_msg("sample %zu, link %zu", i, l);
    const double last = coarse.time[coarse.samples - 1], duration = record.timing_duration[0];
    assert_true(last >= duration - 1e-9 && last < duration + 0.07);
    for (size_t l = 0; l < links; l++) {
        const size_t end = (size_t)(coarse.samples - 1) * links + l,
                     final = (size_t)(record.samples - 1) * links + l;
        assert_true(fabs(coarse.length[end] - record.length[final]) <= 1e-12);
        assert_true(coarse.rate[end] == 0.0 && coarse.acceleration[end] == 0.0);
    }
    /* Central differences of a fine table: error step^2 / 6 times a third derivative of 2 m/s3, over
     * rounding. */
    morph_export_table dense = evaluate(1e-3);
    double most = 0.0;
    for (size_t i = 1; i + 1 < (size_t)dense.samples; i++)
        for (size_t l = 0; l < links; l++) {
            const double *at = &dense.length[i * links + l], *rate = &dense.rate[i * links + l];
            if (!(fabs((at[links] - *(at - links)) / 2e-3 - *rate) < 1e-5)) fail_msg("rate at %zu", i);
            if (!(fabs((rate[links] - *(rate - links)) / 2e-3 - dense.acceleration[i * links + l]) < 1e-3))
                fail_msg("acceleration at %zu", i);
            most = fmax(most, fabs(*rate));
        }
    assert_true(most > 1e-3); /* it moves at all */
    morph_export_table_free(&dense);
    morph_export_table_free(&fine);
    morph_export_table_free(&coarse);
}

static void text_reads_back(void **state) {
    (void)state;
    morph_export_table t = evaluate(0.05);
    morph_text csv;
    char message[256] = "";
    assert_int_equal(morph_export_csv(&t, &csv), MORPH_OK);
    assert_int_equal(strncmp(csv.data, "time_s,link_0000_m,link_0001_m,", 31), 0);
    assert_non_null(strstr(csv.data, ",link_0000_m_per_s,"));
    assert_non_null(strstr(csv.data, ",link_0000_m_per_s2,"));
    assert_int_equal(morph_export_csv_verify(&t, csv.data, message, sizeof message), MORPH_OK);
    /* One digit, one row, one thing too much: each is seen. */
    char *number = strchr(strchr(csv.data, '\n') + 1, ',') + 4;
    const char kept = *number;
    *number = kept == '7' ? '8' : '7';
    assert_int_equal(morph_export_csv_verify(&t, csv.data, message, sizeof message), MORPH_ERR_INTERNAL);
    assert_non_null(strstr(message, "row 2, column 2 "));
    *number = kept;
    assert_int_equal(morph_export_csv_verify(&t, csv.data, NULL, 0), MORPH_OK);
    t.samples--;
    assert_int_equal(morph_export_csv_verify(&t, csv.data, NULL, 0), MORPH_ERR_INTERNAL);
    t.samples++;
    csv.data[csv.size - 1] = '\0';
    assert_int_equal(morph_export_csv_verify(&t, csv.data, NULL, 0), MORPH_ERR_INTERNAL);
    assert_int_equal(morph_export_csv_verify(&t, "", NULL, 0), MORPH_ERR_INTERNAL);
    morph_text_free(&csv);
    t.rate[1] = NAN;
    assert_int_equal(morph_export_csv(&t, &csv), MORPH_ERR_NONFINITE);
    morph_export_table_free(&t);
}

static void refused(double sample, const char *why) {
    morph_export_table t;
    char message[256] = "";
    assert_int_equal(morph_export_evaluate(&record, sample, &t, message, sizeof message), MORPH_ERR_INPUT);
    if (!strstr(message, why)) fail_msg("\"%s\" instead of \"%s\"", message, why);
    assert_null(t.length);
}

/* What is no curve, or not that of the schedule beside it, is refused and not exported. */
static void other_curves_are_refused(void **state) {
    (void)state;
    const struct {
        double *at, by;
        const char *why;
    } ways[] = {{&record.length[7], 1e-9, "link 7 at 0 s is off"},
                {&record.timing_control[record.timing_controls / 2], 1e-3, "do not give the schedule"},
                {&record.path_poses[record.pose_width * 3], 1e-6, "do not give the schedule"},
                {&record.timing_duration[0], 0.01, "do not give the schedule"},
                {&record.timing_duration[0], -1e3, "no curve"},
                {&record.timing_knot[8], 2.0, "no knots"},
                {&record.timing_knot[2], 1e-3, "no knots"},
                {&record.path_s[2], 2.0, "no curve"},
                {&record.path_poses[3], NAN, "no curve"}};
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        const double before = *ways[k].at;
        *ways[k].at += ways[k].by;
        refused(0.0, ways[k].why);
        *ways[k].at = before;
    }
    refused(-1.0, "a step of -1 s");
    refused(NAN, "a step of");
    refused(1e-7, "at most 200000");
    double *knot = record.timing_knot;
    record.timing_knot = NULL;
    refused(0.0, "holds no timing");
    record.timing_knot = knot;
    record.timing_controls--;
    refused(0.0, "no curve");
    record.timing_controls++;
    morph_export_table t = evaluate(0.0);
    morph_export_table_free(&t);
}

static void folder_to_file(void **state) {
    (void)state;
    char file[96], line[256] = "", *text = NULL;
    snprintf(file, sizeof file, "%s/out.csv", folder);
    morph_job job = morph_job_defaults();
    job.message = last_line;
    job.user = line;
    assert_int_equal(morph_export_folder(plan_folder, NULL, &job, &text), MORPH_EXIT_DONE);
    assert_non_null(text);
    assert_int_equal(morph_export_folder(plan_folder, file, &job, NULL), MORPH_EXIT_DONE);
    char *data;
    size_t size;
    assert_int_equal(morph_file_load(file, &data, &size, NULL, 0), MORPH_OK);
    assert_string_equal(data, text);
    free(data);
    free(text);
    assert_int_equal(morph_export_folder(plan_folder, file, &job, NULL), MORPH_EXIT_INPUT);
    assert_non_null(strstr(line, "is there already"));
    job.overwrite = true;
    job.sample = 0.02;
    assert_int_equal(morph_export_folder(plan_folder, file, &job, NULL), MORPH_EXIT_DONE);
    assert_int_equal(morph_export_folder(folder, file, &job, NULL), MORPH_EXIT_INPUT);
    assert_int_equal(morph_export_folder("/nowhere/at.plan", file, &job, NULL), MORPH_EXIT_INPUT);
    assert_int_equal(morph_export_folder(plan_folder, "/nowhere/out.csv", &job, NULL), MORPH_EXIT_INPUT);
    static const char *const later[] = {"jtc", "pvt", "csp", "mcap", "vtk"};
    for (size_t k = 0; k < sizeof later / sizeof *later; k++) {
        job.format = later[k];
        assert_int_equal(morph_export_folder(plan_folder, file, &job, NULL), MORPH_EXIT_INPUT);
        assert_non_null(strstr(line, "not available yet: --format"));
        assert_non_null(strstr(line, later[k]));
    }
    job.format = "xls";
    assert_int_equal(morph_export_folder(plan_folder, file, &job, NULL), MORPH_EXIT_INPUT);
    assert_non_null(strstr(line, "no such format: xls"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(own_step_is_the_schedule), cmocka_unit_test(any_step_is_the_same_curve),
        cmocka_unit_test(text_reads_back),          cmocka_unit_test(other_curves_are_refused),
        cmocka_unit_test(folder_to_file),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
