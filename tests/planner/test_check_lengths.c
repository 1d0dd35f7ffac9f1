/* Tables of lengths alone, as read from a CSV. */
#include "tests/planner/test_check_fixture.h"

/* As printed with so many decimal places. */
static double *rounded(const morph_record *r, int places) {
    const size_t n = (size_t)r->samples * (size_t)r->links;
    double *length = fixture_copy(r->length, n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        char text[64];
        snprintf(text, sizeof text, "%.*f", places, length[i]);
        length[i] = strtod(text, NULL);
    }
    return length;
}

static morph_check_report check_table(const morph_record *r, const double *length) {
    morph_check_report report;
    assert_int_equal(morph_check_lengths(r, r->time, length, r->samples, &report), MORPH_OK);
    return report;
}

/* Nine decimals and 1 ms: third differences of neighbours are rounding noise twice the jerk limit. */
static void rounded_tables_pass(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 4001, 4);
    for (int places = 9; places <= 17; places += 2) {
        double *length = rounded(&r, places);
        const morph_check_report c = check_table(&r, length);
        assert_string_equal(c.defect, "");
        for (int k = 0; k < MORPH_MARGIN_KINDS; k++) {
            const bool tested = k <= MORPH_MARGIN_JERK || k == MORPH_MARGIN_COMPATIBILITY;
            assert_int_equal(c.margin[k].tested, tested);
        }
        assert_true(c.feasible);
        free(length);
    }
    morph_record_free(&r);
}

/* The means must still say how much room there is: near the true maxima of the smooth motion. */
static void figures_are_those_of_the_motion(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 4001, 4);
    double *length = rounded(&r, 12);
    const morph_check_report c = check_table(&r, length);
    double rate = 0, acceleration = 0;
    for (int i = 0; i < r.samples * r.links; i++) {
        rate = fmax(rate, fabs(r.rate[i]));
        acceleration = fmax(acceleration, fabs(r.acceleration[i]));
    }
    assert_true(fabs(c.margin[MORPH_MARGIN_RATE].worst - (r.rate_limit[0] - rate)) < 1e-3 * rate);
    assert_true(fabs(c.margin[MORPH_MARGIN_ACCELERATION].worst - (r.acceleration_limit[0] - acceleration)) <
                1e-2 * acceleration);
    free(length);
    morph_record_free(&r);
}

static void planted_faults_are_named(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 4001, 4);
    const int link = 6;
    const double top[4] = {r.length_limit[link][1], r.rate_limit[link], r.acceleration_limit[link],
                           r.jerk_limit[link]};
    double *length = rounded(&r, 12), most[3] = {0}, at = 0;
    for (int k = 0; k < r.samples; k++) {
        most[0] = fmax(most[0], length[k * r.links + link]);
        if (fabs(r.rate[k * r.links + link]) > most[1]) at = r.time[k];
        most[1] = fmax(most[1], fabs(r.rate[k * r.links + link]));
        most[2] = fmax(most[2], fabs(r.acceleration[k * r.links + link]));
    }
    char name[96];
    morph_record_link_name(&r, link, name, sizeof name);
    r.length_limit[link][1] = most[0] - 1e-6;
    morph_check_report c = check_table(&r, length);
    fixture_expect(&c, MORPH_MARGIN_LENGTH, -1e-6, 2e-12, name, 0, 4);
    r.length_limit[link][1] = top[0];
    r.rate_limit[link] = 0.99 * most[1];
    c = check_table(&r, length);
    fixture_expect(&c, MORPH_MARGIN_RATE, -0.01 * most[1], 1e-3 * most[1], name, at - 0.05, at + 0.05);
    r.rate_limit[link] = top[1];
    r.acceleration_limit[link] = 0.98 * most[2];
    c = check_table(&r, length);
    fixture_expect(&c, MORPH_MARGIN_ACCELERATION, -0.02 * most[2], 1e-2 * most[2], name, 0.5, 3.5);
    r.acceleration_limit[link] = top[2];
    length[2000 * r.links + link] += 2e-9; /* third difference 3 d / h^3 = 6 m/s3 */
    c = check_table(&r, length);
    fixture_expect(&c, MORPH_MARGIN_JERK, top[3] - 6, 0.5, name, 1.99, 2.01);
    free(length);
    morph_record_free(&r);
}

/* The same spike drowns in the rounding of nine decimals, a larger one does not. */
static void noise_is_not_a_fault(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 4001, 4);
    const int link = 6;
    double *length = rounded(&r, 9);
    length[2000 * r.links + link] += 2e-8;
    const morph_check_report c = check_table(&r, length);
    assert_false(c.feasible);
    char name[96];
    morph_record_link_name(&r, link, name, sizeof name);
    assert_string_equal(c.margin[MORPH_MARGIN_JERK].element, name);
    assert_true(fabs(c.margin[MORPH_MARGIN_JERK].time - 2) < 0.01);
    free(length);
    /* Three decimals are not nine significant digits: steps of a millimetre break every limit. */
    length = rounded(&r, 3);
    assert_false(check_table(&r, length).feasible);
    free(length);
    morph_record_free(&r);
}

static void lengths_of_another_shape(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    double *length = rounded(&r, 12);
    for (int k = 0; k < r.samples; k++)
        length[k * r.links + 9] -= 2e-6;
    morph_check_report c = check_table(&r, length);
    char name[96];
    morph_record_link_name(&r, 9, name, sizeof name);
    fixture_expect(&c, MORPH_MARGIN_COMPATIBILITY, -2e-6, 1e-11, name, 0, 4);
    /* Every second sample. */
    double *fewer = malloc(201 * (size_t)r.links * sizeof(double)), time[201];
    for (int k = 0; k < 201; k++) {
        memcpy(fewer + k * r.links, r.length + 2 * k * r.links, (size_t)r.links * sizeof(double));
        time[k] = 0.02 * k;
    }
    assert_int_equal(morph_check_lengths(&r, time, fewer, 201, &c), MORPH_OK);
    assert_true(c.feasible);
    assert_true(c.margin[MORPH_MARGIN_COMPATIBILITY].tested);
    assert_true(c.margin[MORPH_MARGIN_COMPATIBILITY].worst > -1e-12);
    for (int k = 0; k < 201; k++)
        fewer[k * r.links + 9] -= 2e-6;
    assert_int_equal(morph_check_lengths(&r, time, fewer, 201, &c), MORPH_OK);
    fixture_expect(&c, MORPH_MARGIN_COMPATIBILITY, -2e-6, 1e-11, name, 0, 4);
    free(fewer);
    free(length);
    morph_record_free(&r);
}

/* The same motion at another rate is the record's, whatever the steps; at another pace it is not, nor is one
 * that never moves or that stops early. */
static void tables_of_another_rate(void **state) {
    (void)state;
    morph_record r, other;
    fixture_record(&r, 3, 401, 4);
    static const struct {
        int samples;
        double duration;
        bool same;
    } cases[] = {{321, 4, true}, {1238, 4, true}, {401, 5, false}, {501, 5, false}, {1201, 3.99, false}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        fixture_record(&other, 3, cases[k].samples, cases[k].duration);
        morph_check_report c;
        assert_int_equal(morph_check_lengths(&r, other.time, other.length, other.samples, &c), MORPH_OK);
        const morph_margin *m = &c.margin[MORPH_MARGIN_COMPATIBILITY];
        assert_string_equal(c.defect, "");
        assert_true(m->tested);
        assert_int_equal(c.feasible, cases[k].same);
        assert_int_equal(m->worst >= -m->tolerance, cases[k].same);
        /* Between samples the quintic is the motion's to far below the tolerance. */
        if (cases[k].same) assert_true(m->worst > -1e-9);
        morph_record_free(&other);
    }
    double *still = malloc(5 * (size_t)r.links * sizeof(double)), time[5];
    for (int k = 0; k < 5; k++) {
        memcpy(still + k * r.links, r.length, (size_t)r.links * sizeof(double));
        time[k] = 1e-4 * k;
    }
    morph_check_report c;
    assert_int_equal(morph_check_lengths(&r, time, still, 5, &c), MORPH_OK);
    assert_false(c.feasible);
    assert_int_equal(c.worst, MORPH_MARGIN_COMPATIBILITY);
    assert_true(fabs(c.margin[MORPH_MARGIN_COMPATIBILITY].time - 4e-4) < 1e-12);
    free(still);
    morph_record_free(&r);
}

static void unusable_tables(void **state) {
    (void)state;
    morph_record r;
    fixture_record(&r, 3, 401, 4);
    morph_check_report c;
    double *length = rounded(&r, 12);
    length[77 * r.links + 4] = NAN;
    c = check_table(&r, length);
    assert_false(c.feasible);
    assert_non_null(strstr(c.defect, "link 4 "));
    length[77 * r.links + 4] = r.length[77 * r.links + 4];
    r.time[7] = NAN;
    assert_true(check_table(&r, length).defect[0] != 0);
    r.time[7] = 0.071;
    assert_non_null(strstr(check_table(&r, length).defect, "not even"));
    r.time[7] = 0.07;
    /* Without its first second: starts in mid motion. */
    assert_int_equal(morph_check_lengths(&r, r.time, length + 100 * r.links, 301, &c), MORPH_OK);
    assert_non_null(strstr(c.defect, "not at rest at the start"));
    assert_int_equal(morph_check_lengths(&r, r.time, length, 301, &c), MORPH_OK);
    assert_non_null(strstr(c.defect, "not at rest at the end"));
    assert_int_equal(morph_check_lengths(&r, r.time, length, 1, &c), MORPH_OK);
    assert_true(c.defect[0] != 0);
    assert_int_equal(morph_check_lengths(&r, NULL, NULL, 0, &c), MORPH_OK);
    assert_false(c.feasible);
    for (int i = 0; i < r.samples * r.links; i++) /* all zero: no length at all */
        length[i] = 0;
    assert_false(check_table(&r, length).feasible);
    free(length);
    morph_record_free(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rounded_tables_pass),      cmocka_unit_test(figures_are_those_of_the_motion),
        cmocka_unit_test(planted_faults_are_named), cmocka_unit_test(noise_is_not_a_fault),
        cmocka_unit_test(lengths_of_another_shape), cmocka_unit_test(unusable_tables),
        cmocka_unit_test(tables_of_another_rate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
