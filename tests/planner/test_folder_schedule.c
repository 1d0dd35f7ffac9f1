/* schedule.csv, schedule.json, summary.json as text. */
#include "folder_fixture.h"

#include "planner/folder.h"
#include "planner/schedule_file.h"

#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

static char file[64];

static int setup(void **state) {
    (void)state;
    snprintf(file, sizeof file, "/tmp/morph-schedule-XXXXXX");
    int fd = mkstemp(file);
    return fd < 0 ? -1 : close(fd);
}

static int teardown(void **state) {
    (void)state;
    return unlink(file);
}

static void save(const char *data, size_t size) {
    FILE *f = fopen(file, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    fclose(f);
}

static void csv_round_trip(void **state) {
    (void)state;
    morph_record r = fixture_record(4, 3, 60);
    morph_text csv;
    assert_int_equal(morph_schedule_csv(&r, &csv), MORPH_OK);
    assert_memory_equal(csv.data, "time_s,link_0000_m,link_0001_m,", 31);
    save(csv.data, csv.size);
    double *time, *length;
    int samples;
    char message[256] = "";
    if (morph_schedule_read(file, r.links, &time, &length, &samples, message, sizeof message) != MORPH_OK)
        fail_msg("%s", message);
    assert_int_equal(samples, r.samples);
    assert_memory_equal(time, r.time, (size_t)samples * sizeof *time);
    assert_memory_equal(length, r.length, (size_t)samples * (size_t)r.links * sizeof *length);
    free(time);
    free(length);
    r.length[7] = NAN;
    morph_text_free(&csv);
    assert_int_equal(morph_schedule_csv(&r, &csv), MORPH_ERR_NONFINITE);
    assert_null(csv.data);
    morph_record_free(&r);
}

static void csv_variants(void **state) {
    (void)state;
    static const char text[] =
        "\xEF\xBB\xBF"
        "time_s,link_0000_m\r\n0, 0.1\r\n0.5,1.25e-1\r\n\r\n";
    double *time, *length;
    int samples;
    char message[256] = "";
    save(text, sizeof text - 1);
    assert_int_equal(morph_schedule_read(file, 1, &time, &length, &samples, message, sizeof message),
                     MORPH_OK);
    assert_int_equal(samples, 2);
    assert_true(length[0] == 0.1 && length[1] == 0.125 && time[1] == 0.5);
    free(time);
    free(length);
}

static void csv_faults(void **state) {
    (void)state;
    static const struct {
        const char *text;
        int line;
        const char *word;
    } cases[] = {
        {"", 1, "empty"},
        {"time,link_0000_m,link_0001_m\n", 1, "expected \"time_s\""},
        {"time_s,link_0001_m,link_0000_m\n", 1, "expected \"link_0000_m\""},
        {"time_s,link_0000_m\n", 1, "2 columns, expected 3"},
        {"time_s,link_0000_m,link_0001_m,link_0002_m\n", 1, "4 columns"},
        {"time_s,link_0000_m,link_0001_m\n0,0.1,0.1\n", 2, "two samples"},
        {"time_s,link_0000_m,link_0001_m\n0,0.1,0.1\n1,0.1\n", 3, "2 columns"},
        {"time_s,link_0000_m,link_0001_m\n0,0.1,0.1\n1,0.1,0.1x\n", 3, "\"0.1x\" is not a number"},
        {"time_s,link_0000_m,link_0001_m\n0,0.1,nan\n", 2, "\"nan\""},
        {"time_s,link_0000_m,link_0001_m\n0,inf,0.1\n", 2, "\"inf\""},
        {"time_s,link_0000_m,link_0001_m\n0,0x1p-3,0.1\n", 2, "is not a number"},
        {"time_s,link_0000_m,link_0001_m\n0,1e999,0.1\n", 2, "is not a number"},
        {"time_s,link_0000_m,link_0001_m\n0,,0.1\n", 2, "\"\" is not a number"},
        {"time_s,link_0000_m,link_0001_m\n0,-0.1,0.1\n", 2, "not a length"},
        {"time_s,link_0000_m,link_0001_m\n0,0.1,0.1\n0,0.1,0.1\n", 3, "does not increase"},
        {"time_s,link_0000_m,link_0001_m\n0,0.1,0.1\n\n1,0.1,0.1\n", 3, "blank"},
        {"time_s,link_0000_m,link_0001_m\n0;0,1;0,1\n", 2, "\"0;0\" is not a number"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        double *time, *length;
        int samples;
        char message[256] = "", lead[96];
        save(cases[k].text, strlen(cases[k].text));
        assert_int_equal(morph_schedule_read(file, 2, &time, &length, &samples, message, sizeof message),
                         MORPH_ERR_INPUT);
        snprintf(lead, sizeof lead, "%s:%d: ", file, cases[k].line);
        if (strncmp(message, lead, strlen(lead)) != 0 || !strstr(message, cases[k].word))
            fail_msg("\"%s\" is not %s ... %s", message, lead, cases[k].word);
        assert_null(time);
        assert_null(length);
    }
    static const char binary[] = "time_s,link_0000_m,link_0001_m\n0,0.1,\0\n";
    double *time, *length;
    int samples;
    char message[256] = "";
    save(binary, sizeof binary - 1);
    assert_int_equal(morph_schedule_read(file, 2, &time, &length, &samples, message, sizeof message),
                     MORPH_ERR_INPUT);
    assert_non_null(strstr(message, ":2: holds a zero byte"));
    assert_int_equal(
        morph_schedule_read("/no/such.csv", 2, &time, &length, &samples, message, sizeof message),
        MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "No such file"));
    assert_int_equal(morph_schedule_read("/dev/null", 2, &time, &length, &samples, message, sizeof message),
                     MORPH_ERR_INPUT);
}

static void numbers_read_back(void **state) {
    (void)state;
    static const double values[] = {
        0, 0.1, 1.0 / 3, 1e-300, 123456789.123456789, 5e-324, 1.7976931348623157e308};
    char text[32];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        morph_number(values[k], text);
        assert_true(strtod(text, NULL) == values[k]);
    }
    morph_number(0.1, text);
    assert_string_equal(text, "0.1");
    morph_number(NAN, text);
    assert_string_equal(text, "null");
    morph_number(-INFINITY, text);
    assert_string_equal(text, "null");
}

static void schedule_json(void **state) {
    (void)state;
    morph_record r = fixture_record(4, 4, 11);
    morph_text json;
    assert_int_equal(morph_schedule_json(&r, "a \"b\"\n\xFF\xC3\xA9", "c5", "aa", &json), MORPH_OK);
    cJSON *root = cJSON_Parse(json.data);
    assert_non_null(root);
    assert_string_equal(cJSON_GetObjectItem(root, "title")->valuestring, "a \"b\"\n\xEF\xBF\xBD\xC3\xA9");
    assert_string_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(root, "schedule"), "sha256")->valuestring,
                        "c5");
    assert_string_equal(cJSON_GetObjectItem(cJSON_GetObjectItem(root, "plan"), "sha256")->valuestring, "aa");
    assert_float_equal(cJSON_GetObjectItem(root, "sample_time")->valuedouble, 0.01, 1e-12);
    cJSON *links = cJSON_GetObjectItem(root, "links"), *link = cJSON_GetArrayItem(links, 5);
    assert_int_equal(cJSON_GetArraySize(links), 48);
    assert_string_equal(cJSON_GetObjectItem(link, "column")->valuestring, "link_0005_m");
    cJSON *joints = cJSON_GetObjectItem(link, "joints");
    assert_int_equal(cJSON_GetArrayItem(joints, 1)->valueint, r.link[5][1]);
    assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(link, "length"), 1)->valuedouble == 1.35 * 0.1);
    cJSON_Delete(root);
    morph_text_free(&json);
    morph_record_free(&r);
}

static double at(const cJSON *root, const char *a, const char *b, const char *c) {
    const cJSON *item = cJSON_GetObjectItem(root, a);
    if (b) item = cJSON_GetObjectItem(item, b);
    if (c) item = cJSON_GetObjectItem(item, c);
    assert_non_null(item);
    assert_true(cJSON_IsNumber(item));
    return item->valuedouble;
}

static morph_summary make_summary(void) {
    morph_summary s = {.feasible = true, .has_plan = true, .has_blanket = true, .spacing = 0.1};
    snprintf(s.title, sizeof s.title, "Ball <1> & \"more\"");
    snprintf(s.outcome, sizeof s.outcome, "optimal");
    s.plan.volume = 1.0 / 3;
    s.plan.gap_mean = 0.001;
    s.blanket.gap_mean = 0.02;
    s.blanket.gap_max = NAN;
    s.cavities_blanket = (morph_cavity_list){
        1, {{.volume = 0.5, .at = {0.25, -1.0 / 3, 2}, .height = 0.125, .area = 4}}, 2, 0.5};
    s.duration = 3.25;
    s.rows_refine_used = 17;
    s.rows_path_possible = 900;
    s.seconds[MORPH_STAGE_PATH] = 1.5;
    s.peak_memory_bytes = 123456789012L;
    s.check.margin[MORPH_MARGIN_CLEARANCE] =
        (morph_margin){true, -2e-5, 1e-4, "joint 7 (3,1) bottom", 1.25, NULL};
    return s;
}

static void summary_json(void **state) {
    (void)state;
    morph_summary s = make_summary();
    char *text;
    assert_int_equal(morph_summary_to_json(&s, &text), MORPH_OK);
    assert_null(strstr(text, "nan"));
    cJSON *root = cJSON_Parse(text);
    assert_non_null(root);
    assert_string_equal(cJSON_GetObjectItem(root, "outcome")->valuestring, "optimal");
    assert_string_equal(cJSON_GetObjectItem(root, "title")->valuestring, s.title);
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(root, "feasible")));
    assert_true(at(root, "cavity_volume", "plan", NULL) == 1.0 / 3);
    assert_true(at(root, "gap", "blanket", "mean") == 0.02);
    assert_true(cJSON_IsNull(
        cJSON_GetObjectItem(cJSON_GetObjectItem(cJSON_GetObjectItem(root, "gap"), "blanket"), "max")));
    assert_true(at(root, "rows", "refine", "used") == 17);
    assert_true(at(root, "rows", "path", "possible") == 900);
    assert_true(at(root, "seconds", "path", NULL) == 1.5);
    assert_true(at(root, "peak_memory_bytes", NULL, NULL) == 123456789012.0);
    assert_true(at(root, "margins", "clearance", "worst") == -2e-5);
    assert_true(at(root, "margins", "clearance", "time") == 1.25);
    assert_null(cJSON_GetObjectItem(cJSON_GetObjectItem(root, "margins"), "panel"));
    assert_null(cJSON_GetObjectItem(cJSON_GetObjectItem(root, "cavity_volume"), "guided"));
    const cJSON *cavities = cJSON_GetObjectItem(root, "cavities");
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(cavities, "blanket")), 1);
    assert_true(cJSON_IsArray(cJSON_GetObjectItem(cavities, "plan")));
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(cavities, "plan")), 0);
    const cJSON *cavity = cJSON_GetArrayItem(cJSON_GetObjectItem(cavities, "blanket"), 0);
    assert_true(at(cavity, "volume", NULL, NULL) == 0.5);
    assert_true(at(cavity, "share", NULL, NULL) == 0.25);
    assert_true(at(cavity, "height", NULL, NULL) == 0.125);
    assert_true(at(cavity, "area", NULL, NULL) == 4);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(cavity, "at")), 3);
    assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(cavity, "at"), 1)->valuedouble == -1.0 / 3);
    at(root, "mobility", "free", NULL);
    at(root, "iterations", "timing", NULL);
    at(root, "target_volume", NULL, NULL);
    cJSON_Delete(root);
    free(text);
    s.has_plan = false;
    assert_int_equal(morph_summary_to_json(&s, &text), MORPH_OK);
    root = cJSON_Parse(text);
    assert_true(cJSON_IsNull(cJSON_GetObjectItem(cJSON_GetObjectItem(root, "gap"), "plan")));
    cJSON_Delete(root);
    free(text);
}

/* A caller's locale with a decimal comma changes nothing. */
static void decimal_comma(void **state) {
    (void)state;
    if (!setlocale(LC_ALL, "de_DE.UTF-8") && !setlocale(LC_ALL, "fr_FR.UTF-8")) {
        print_message("no locale with a decimal comma is installed: skipped\n");
        skip();
    }
    csv_round_trip(NULL);
    summary_json(NULL);
    setlocale(LC_ALL, "C");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(csv_round_trip), cmocka_unit_test(csv_variants),      cmocka_unit_test(csv_faults),
        cmocka_unit_test(schedule_json),  cmocka_unit_test(numbers_read_back), cmocka_unit_test(summary_json),
        cmocka_unit_test(decimal_comma),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
