/* report.html: whole, self-contained, escaped, and saying what happened. */
#include "folder_fixture.h"

#include "planner/report.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static morph_summary make_summary(void) {
    morph_summary s = {.feasible = true, .has_plan = true, .has_blanket = true, .spacing = 0.1};
    snprintf(s.title, sizeof s.title, "<script>alert(1)</script> & co");
    snprintf(s.outcome, sizeof s.outcome, "optimal");
    snprintf(s.scene, sizeof s.scene, "scenes/<ball>.yaml");
    s.blanket = (morph_measure){0.012, 0.018, 0.04, 0.06, 0.02, 0.81, 1e-4};
    s.plan = (morph_measure){0.003, 0.004, 0.01, 0.02, 0.005, 0.97, 1e-5};
    s.cavities_blanket = (morph_cavity_list){
        2,
        {{.volume = 0.008, .at = {0.2, -0.125, 0.05}}, {.volume = 0.001, .at = {0, 0.1, 0.05}}},
        0.012,
        0.002};
    s.cavities_plan = (morph_cavity_list){1, {{.volume = 0.0012, .at = {0.25, -0.1, 0.04}}}, 0.003, 0.001};
    s.duration = 4;
    s.free_motions = 26;
    s.check.margin[MORPH_MARGIN_LENGTH] =
        (morph_margin){true, 1.25e-3, 1e-9, "link 17 (2,1)-(3,1) bottom", 1.5, NULL};
    s.check.margin[MORPH_MARGIN_CLEARANCE] = (morph_margin){true, -5e-3, 1e-4, "joint 3 <x>", 2.5, NULL};
    return s;
}

static void assert_has(const char *page, const char *part) {
    if (!strstr(page, part)) fail_msg("the page lacks \"%s\"", part);
}

static int occurrences(const char *page, const char *part) {
    int n = 0;
    for (const char *c = strstr(page, part); c; c = strstr(c + 1, part))
        n++;
    return n;
}

static void whole_page(void **state) {
    (void)state;
    morph_record r = fixture_record(5, 5, 51);
    morph_summary s = make_summary();
    char *page;
    assert_int_equal(morph_report_html(&r, &s, &page), MORPH_OK);
    assert_has(page, "<!DOCTYPE html>");
    assert_has(page, "</html>");
    assert_has(page, "holds every limit");
    assert_has(page, "18&nbsp;mm");
    assert_has(page, "0.180&nbsp;h");
    assert_has(page, "97.0&nbsp;%");
    assert_has(page, "link 17 (2,1)-(3,1) bottom");
    assert_has(page, "26 motions stay free");
    assert_has(page,
               "<td>1</td><td class=\"n\">8&nbsp;litres</td><td class=\"n\">66.7&nbsp;%</td><td class=\"n "
               "soft\">0.200, -0.125, 0.050</td>");
    assert_has(page, "40.0&nbsp;%</td><td class=\"n soft\">0.250, -0.100, 0.040</td>");
    assert_has(page, "8.3&nbsp;%</td><td class=\"n soft\">0.000, 0.100, 0.050</td><td></td>");
    assert_has(page, "2&nbsp;litres under the blanket, 1&nbsp;litres under the plan");
    assert_has(page, "&lt;script&gt;alert(1)");
    assert_has(page, "joint 3 &lt;x&gt;");
    assert_null(strstr(page, "<script"));
    assert_int_equal(occurrences(page, "class=\"no\""), 1);
    assert_int_equal(occurrences(page, "class=\"yes\""), 1);
    assert_int_equal(occurrences(page, "<svg "), 8);
    /* Nothing is fetched: the only addresses are names of XML vocabularies. */
    assert_int_equal(occurrences(page, "http"),
                     occurrences(page, "http://www.w3.org/") + occurrences(page, "http-equiv"));
    assert_null(strstr(page, "src="));
    free(page);
    morph_record_free(&r);
}

static void infeasible_page(void **state) {
    (void)state;
    morph_record r = fixture_record(4, 4, 21);
    morph_summary s = make_summary();
    s.feasible = false;
    snprintf(s.outcome, sizeof s.outcome, "infeasible");
    snprintf(s.reason, sizeof s.reason, "clearance of joint 3 at 2.5 s: 5 mm too little");
    char *page;
    assert_int_equal(morph_report_html(&r, &s, &page), MORPH_OK);
    assert_has(page, "must not be driven");
    assert_has(page, "5 mm too little");
    assert_null(strstr(page, "holds every limit"));
    free(page);
    /* With nothing but the blanket, or with numbers that cannot be drawn, there is still a page. */
    int samples = r.samples;
    r.samples = 0;
    s.has_plan = false;
    s.plan.gap_mean = NAN;
    assert_int_equal(morph_report_html(&r, &s, &page), MORPH_OK);
    assert_has(page, "There is no plan to check");
    assert_int_equal(occurrences(page, "<svg "), 6);
    free(page);
    r.samples = samples;
    r.schedule_joints[0] = NAN;
    assert_int_equal(morph_report_html(&r, &s, &page), MORPH_OK);
    assert_int_equal(occurrences(page, "<svg "), 0);
    assert_has(page, "</html>");
    free(page);
    morph_record_free(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(whole_page), cmocka_unit_test(infeasible_page)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
