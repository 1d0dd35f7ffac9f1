/* The comparison's numbers by hand: medians, ratios, texts that hold what was measured; rows that failed or
 * were stopped; the folder that holds them. */
#include "planner/compare.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

enum { SCENES = 4 };

typedef struct made {
    morph_scene scene[SCENES];
    char file[SCENES][32], title[SCENES][48];
    morph_compare_result result[SCENES];
    morph_compare compare;
} made;

static void put(morph_compare_row *row, double objective, double volume, double mean, double target,
                double coverage) {
    *row = (morph_compare_row){.listed = true, .measured = true, .feasible = true, .seconds = 1.25};
    row->measure = (morph_measure){.objective = objective,
                                   .volume = volume,
                                   .gap_mean = mean,
                                   .gap_p95 = 2 * mean,
                                   .gap_max = 3 * mean,
                                   .gap_target = target,
                                   .coverage = coverage};
    snprintf(row->outcome, sizeof row->outcome, "feasible");
}

/* Scenes of spacing 0.5 m: m^4 are a sixteenth of spacings^4. */
static void make(made *m, int scenes) {
    memset(m, 0, sizeof *m);
    m->compare = (morph_compare){.scenes = scenes, .result = m->result};
    for (int k = 0; k < scenes; k++) {
        snprintf(m->file[k], sizeof m->file[k], "dir/s%d.yaml", k);
        snprintf(m->title[k], sizeof m->title[k], "A <b>\"bold\"</b> & %d", k);
        m->scene[k].file = m->file[k];
        m->scene[k].title = m->title[k];
        m->scene[k].structure = morph_structure_defaults(0.5);
        m->scene[k].structure.nodes[0] = 4;
        m->scene[k].structure.nodes[1] = 5;
        m->scene[k].target_report.volume = 0.125;
        m->result[k].scene = &m->scene[k];
        put(&m->result[k].row[MORPH_COMPARE_BLANKET], 1.0, 2.0, 0.5, 0.25, 0.5);
    }
}

static void near(double value, double expected) {
    if (!(fabs(value - expected) <= 1e-12)) fail_msg("%.15g where %.15g is expected", value, expected);
}

static void test_medians(void **state) {
    (void)state;
    made m;
    make(&m, SCENES);
    /* Objectives 0.5, 0.1, 0.3, 0.2: the mean of 0.2 and 0.3. Volumes 0.4 1.6 0.8 0.2 of 2. */
    const double objective[SCENES] = {0.5, 0.1, 0.3, 0.2}, volume[SCENES] = {0.8, 3.2, 1.6, 0.4};
    const double coverage[SCENES] = {0.5, 0.4, 0.9, 0.5 - 1e-12};
    for (int k = 0; k < SCENES; k++)
        put(&m.result[k].row[MORPH_COMPARE_PLAN], objective[k], volume[k], 0.1 * (k + 1), 0.0, coverage[k]);
    m.result[2].row[MORPH_COMPARE_PLAN].feasible = false;
    morph_compare_median median = morph_compare_medians(&m.compare, MORPH_COMPARE_PLAN);
    near(median.ratio[MORPH_COMPARE_OBJECTIVE], 0.25);
    near(median.ratio[MORPH_COMPARE_VOLUME], 0.6);
    near(median.ratio[MORPH_COMPARE_GAP], 0.5);
    near(median.ratio[MORPH_COMPARE_TARGET_GAP], 0.0);
    assert_int_equal(median.scenes, SCENES);
    assert_int_equal(median.feasible, SCENES - 1);
    assert_int_equal(median.coverage_lower, 1); /* the last is rounding */

    /* An odd number: the one in the middle; what has no shape is not counted. */
    m.result[0].row[MORPH_COMPARE_PLAN].measured = false;
    median = morph_compare_medians(&m.compare, MORPH_COMPARE_PLAN);
    near(median.ratio[MORPH_COMPARE_OBJECTIVE], 0.2);
    near(median.ratio[MORPH_COMPARE_VOLUME], 0.8);
    assert_int_equal(median.scenes, 3);
    m.result[1].row[MORPH_COMPARE_BLANKET].measured = false;
    assert_int_equal(morph_compare_medians(&m.compare, MORPH_COMPARE_PLAN).scenes, 2);

    /* Equal values, the blanket against itself, and nothing at all. */
    median = morph_compare_medians(&m.compare, MORPH_COMPARE_BLANKET);
    near(median.ratio[MORPH_COMPARE_OBJECTIVE], 1.0);
    median = morph_compare_medians(&m.compare, MORPH_COMPARE_SEEDS);
    assert_true(median.scenes == 0 && isnan(median.ratio[MORPH_COMPARE_GAP]));
}

static void test_ratios(void **state) {
    (void)state;
    made m;
    make(&m, 1);
    morph_compare_result *r = &m.result[0];
    put(&r->row[MORPH_COMPARE_PLAN], 0.25, 0.0, 0.1, 0.0, 1.0);
    put(&r->row[MORPH_COMPARE_REFERENCE], 0.125, 0.0, 0.1, 0.0, 1.0);
    near(morph_compare_value(r, MORPH_COMPARE_PLAN, MORPH_COMPARE_OBJECTIVE), 4.0);
    near(morph_compare_value(r, MORPH_COMPARE_PLAN, MORPH_COMPARE_GAP), 0.2);
    near(morph_compare_ratio(r, MORPH_COMPARE_PLAN, MORPH_COMPARE_REFERENCE, MORPH_COMPARE_OBJECTIVE), 2.0);
    /* Nothing against nothing is as good; something against nothing is infinitely worse. */
    near(morph_compare_ratio(r, MORPH_COMPARE_PLAN, MORPH_COMPARE_REFERENCE, MORPH_COMPARE_VOLUME), 1.0);
    assert_true(
        isinf(morph_compare_ratio(r, MORPH_COMPARE_BLANKET, MORPH_COMPARE_PLAN, MORPH_COMPARE_VOLUME)));
    assert_true(isnan(morph_compare_ratio(r, MORPH_COMPARE_PLAN, MORPH_COMPARE_NLOPT, MORPH_COMPARE_VOLUME)));
}

/* One scene with a plan, one where it failed, one that was stopped. */
static void make_mixed(made *m) {
    make(m, 3);
    put(&m->result[0].row[MORPH_COMPARE_PLAN], 0.25, 1.0, 0.1, 0.05, 1.0);
    put(&m->result[0].row[MORPH_COMPARE_REFERENCE], 0.125, 0.5, 0.1, 0.05, 1.0);
    for (int k = 1; k < 3; k++)
        for (int method = MORPH_COMPARE_PLAN; method <= MORPH_COMPARE_REFERENCE; method++) {
            morph_compare_row *row = &m->result[k].row[method];
            *row = (morph_compare_row){.listed = true};
            snprintf(row->outcome, sizeof row->outcome, "%s", k == 1 ? "failed" : "stopped");
            snprintf(row->reason, sizeof row->reason, "%s", k == 1 ? "a <reason> \"quoted\"" : "nothing yet");
        }
    m->compare.stopped = m->compare.failed = true;
}

static void test_text(void **state) {
    (void)state;
    made m;
    char *text;
    make_mixed(&m);
    assert_int_equal(morph_compare_text(&m.compare, &text), MORPH_OK);
    assert_non_null(strstr(text, "dir/s0.yaml: 4 x 5 nodes"));
    assert_non_null(strstr(text, "failed: a <reason>"));
    assert_non_null(strstr(text, "stopped: nothing yet"));
    assert_non_null(strstr(text, "not a proven bound"));
    for (const char *c = text; *c; c++)
        assert_true(*c == '\n' || (*c >= ' ' && *c <= '~'));
    /* Numbers end where their heads end. */
    const char *head = strstr(text, "method "), *plan = strstr(text, "\nplan ");
    assert_true(head && plan);
    plan++;
    const char *const words[] = {"objective",  "cavity m3",   "mean gap",
                                 "target gap", "x reference", "seconds"};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++) {
        const char *word = strstr(head, words[k]);
        assert_non_null(word);
        const size_t end = (size_t)(word - head) + strlen(words[k]);
        assert_true(plan[end - 1] >= '0' && plan[end - 1] <= '9');
        assert_int_equal(plan[end], ' ');
    }
    /* Methods that are not there have no row. */
    assert_null(strstr(text, "nlopt"));
    free(text);
}

static const cJSON *at(const cJSON *object, const char *a, const char *b) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, a);
    if (b) item = cJSON_GetObjectItemCaseSensitive(item, b);
    if (!item) fail_msg("%s.%s is missing", a, b ? b : "");
    return item;
}

static void test_json(void **state) {
    (void)state;
    made m;
    char *text;
    make_mixed(&m);
    /* A plan's own summary, of which all is written. */
    morph_summary *summary = calloc(1, sizeof *summary);
    assert_non_null(summary);
    snprintf(summary->scene, sizeof summary->scene, "dir/s0.yaml");
    snprintf(summary->outcome, sizeof summary->outcome, "optimal");
    summary->has_blanket = summary->has_plan = true;
    summary->blanket = m.result[0].row[MORPH_COMPARE_BLANKET].measure;
    summary->plan = m.result[0].row[MORPH_COMPARE_PLAN].measure;
    m.result[0].row[MORPH_COMPARE_PLAN].summary = summary;
    assert_int_equal(morph_compare_json(&m.compare, &text), MORPH_OK);
    cJSON *list = cJSON_Parse(text);
    assert_true(cJSON_IsArray(list));
    assert_int_equal(cJSON_GetArraySize(list), 9);
    static const char *const methods[] = {"blanket", "plan", "reference"};
    for (int k = 0; k < 9; k++) {
        const cJSON *item = cJSON_GetArrayItem(list, k);
        assert_string_equal(at(item, "scene", NULL)->valuestring, m.file[k / 3]);
        assert_string_equal(at(item, "method", NULL)->valuestring, methods[k % 3]);
        at(item, "settings", "program");
        at(item, "seconds", "total");
        at(item, "target_volume", NULL);
        assert_true(cJSON_IsBool(at(item, "feasible", NULL)));
        const bool measured = k < 3 || k % 3 == 0;
        assert_int_equal(cJSON_IsNumber(at(item, "objective", methods[k % 3])), measured);
        assert_int_equal(cJSON_IsObject(at(item, "gap", methods[k % 3])), measured);
        near(at(item, "cavity_volume", "blanket")->valuedouble, 2.0);
    }
    const cJSON *plan = cJSON_GetArrayItem(list, 1);
    near(at(plan, "ratio", "objective")->valuedouble, 0.25);
    near(at(plan, "ratio", "reference_objective")->valuedouble, 2.0);
    near(at(plan, "objective", "reference")->valuedouble, 0.125);
    near(at(at(plan, "gap", "reference"), "max", NULL)->valuedouble, 0.3);
    at(plan, "margins", NULL);
    at(plan, "iterations", "path");
    near(at(cJSON_GetArrayItem(list, 2), "coverage", "reference")->valuedouble, 1.0);
    assert_string_equal(at(cJSON_GetArrayItem(list, 4), "reason", NULL)->valuestring,
                        "a <reason> \"quoted\"");
    assert_string_equal(at(cJSON_GetArrayItem(list, 0), "title", NULL)->valuestring, m.title[0]);
    assert_true(cJSON_IsNull(at(cJSON_GetArrayItem(list, 7), "ratio", "gap_mean")));
    cJSON_Delete(list);
    free(text);
    free(summary);
}

static void test_html(void **state) {
    (void)state;
    made m;
    char *text;
    make_mixed(&m);
    assert_int_equal(morph_compare_html(&m.compare, &text), MORPH_OK);
    assert_null(strstr(text, "<script"));
    assert_null(strstr(text, "http://"));
    assert_null(strstr(text, "https://"));
    assert_null(strstr(text, "<b>"));
    assert_non_null(strstr(text, "A &lt;b&gt;"));
    assert_non_null(strstr(text, "a &lt;reason&gt;"));
    assert_non_null(strstr(text, "Stopped before it was done"));
    assert_non_null(strstr(text, "width:100.0%"));
    assert_non_null(strstr(text, "width:25.0%")); /* the plan's objective of the blanket's */
    assert_non_null(strstr(text, "width:12.5%")); /* the reference's */
    int tables = 0;
    for (const char *c = text; (c = strstr(c, "<table>")); c++)
        tables++;
    assert_int_equal(tables, 4);
    free(text);
}

/* Whole or not at all; nothing but a comparison is replaced. */
static void test_folder(void **state) {
    (void)state;
    made m;
    char base[] = "/tmp/morph_compare_XXXXXX", folder[64], file[96], message[512] = "";
    struct stat info;
    make_mixed(&m);
    assert_non_null(mkdtemp(base));
    snprintf(folder, sizeof folder, "%s/compare", base);
    snprintf(file, sizeof file, "%s/compare.json", folder);
    assert_int_equal(morph_compare_probe(folder, false, message, sizeof message), MORPH_OK);
    assert_int_not_equal(stat(folder, &info), 0);
    assert_int_equal(morph_compare_write(folder, false, &m.compare, message, sizeof message), MORPH_OK);
    assert_int_equal(stat(file, &info), 0);
    assert_int_equal(morph_compare_probe(folder, false, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "is there already"));
    assert_int_equal(morph_compare_write(folder, false, &m.compare, message, sizeof message),
                     MORPH_ERR_INPUT);
    assert_int_equal(morph_compare_write(folder, true, &m.compare, message, sizeof message), MORPH_OK);
    FILE *other = fopen(file, "w");
    assert_non_null(other);
    fputs("[{\"mine\": 1}]\n", other);
    fclose(other);
    assert_int_equal(morph_compare_probe(folder, true, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "no comparison folder"));
    unlink(file);
    snprintf(file, sizeof file, "%s/compare.html", folder);
    unlink(file);
    assert_int_equal(rmdir(folder), 0);
    assert_int_equal(rmdir(base), 0); /* nothing hidden is left */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_medians), cmocka_unit_test(test_ratios), cmocka_unit_test(test_text),
        cmocka_unit_test(test_json),    cmocka_unit_test(test_html),   cmocka_unit_test(test_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
