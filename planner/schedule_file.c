/* Writes schedule.csv and schedule.json as text. */
#include "planner/schedule_file.h"

#include "model/structure.h"

#include <string.h>

morph_status morph_schedule_csv(const morph_record *record, morph_text *out) {
    *out = (morph_text){0};
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    bool finite = true;
    morph_text_put(out, "time_s", 6);
    for (int k = 0; k < record->links; k++)
        morph_text_add(out, ",link_%04d_m", k);
    morph_text_put(out, "\n", 1);
    for (int i = 0; i < record->samples && finite && !out->failed; i++) {
        finite = isfinite(record->time[i]);
        morph_text_number(out, record->time[i]);
        const double *length = record->length + (size_t)i * (size_t)record->links;
        for (int k = 0; k < record->links; k++) {
            finite = finite && isfinite(length[k]);
            morph_text_put(out, ",", 1);
            morph_text_number(out, length[k]);
        }
        morph_text_put(out, "\n", 1);
    }
    morph_locale_leave(&locale);
    if (finite && !out->failed) return MORPH_OK;
    morph_status status = finite ? MORPH_ERR_NOMEM : MORPH_ERR_NONFINITE;
    morph_text_free(out);
    return status;
}

static void key_text(morph_text *out, const char *indent, const char *key, const char *value) {
    morph_text_add(out, "%s\"%s\": ", indent, key);
    morph_text_json(out, value);
    morph_text_put(out, ",\n", 2);
}

static void key_number(morph_text *out, const char *lead, const char *key, double value) {
    morph_text_add(out, "%s\"%s\": ", lead, key);
    morph_text_number(out, value);
}

/* One link a line: a person can find link 17, a program reads the array. */
static void put_link(morph_text *out, const morph_record *r, int k) {
    static const char *const kinds[] = {"bottom", "top", "brace"};
    int kind = r->link_kind[k], a = r->link[k][0], b = r->link[k][1];
    morph_text_add(out, "    {\"number\": %d, \"column\": \"link_%04d_m\", \"kind\": \"%s\", ", k, k,
                   kind >= MORPH_LINK_BOTTOM && kind <= MORPH_LINK_BRACE ? kinds[kind] : "unknown");
    morph_text_add(out, "\"joints\": [%d, %d], \"nodes\": [[%d, %d], [%d, %d]], \"length\": [", a, b,
                   r->joint_node[a][0], r->joint_node[a][1], r->joint_node[b][0], r->joint_node[b][1]);
    morph_text_number(out, r->length_limit[k][0]);
    morph_text_put(out, ", ", 2);
    morph_text_number(out, r->length_limit[k][1]);
    key_number(out, "], ", "rate", r->rate_limit[k]);
    key_number(out, ", ", "acceleration", r->acceleration_limit[k]);
    key_number(out, ", ", "jerk", r->jerk_limit[k]);
    key_number(out, ", ", "radius", r->link_radius[k]);
    morph_text_put(out, "}", 1);
}

morph_status morph_schedule_json(const morph_record *record, const char *title, const char *csv_sha256,
                                 const char *plan_sha256, morph_text *out) {
    *out = (morph_text){0};
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    int last = record->samples - 1;
    morph_text_add(out, "{\n");
    key_text(out, "  ", "format", "morphplan-schedule");
    morph_text_add(out, "  \"version\": 1,\n");
    key_text(out, "  ", "title", title);
    key_text(out, "  ", "outcome", record->outcome);
    morph_text_add(out, "  \"plan\": {\n");
    key_text(out, "    ", "file", "plan.h5");
    key_text(out, "    ", "sha256", plan_sha256);
    key_text(out, "    ", "scene_sha256", record->scene_sha256);
    morph_text_add(out, "    \"program\": ");
    morph_text_json(out, record->program);
    morph_text_add(out, "\n  },\n  \"schedule\": {\"file\": \"schedule.csv\", \"sha256\": ");
    morph_text_json(out, csv_sha256);
    morph_text_add(out,
                   "},\n  \"units\": {\"time\": \"s\", \"length\": \"m\", \"rate\": \"m/s\", "
                   "\"acceleration\": \"m/s^2\", \"jerk\": \"m/s^3\"},\n");
    morph_text_add(out, "  \"samples\": %d,\n", record->samples);
    /* The samples are even: the mean step is the step, free of the rounding of one difference. */
    key_number(out, "  ", "sample_time",
               last > 0 ? (record->time[last] - record->time[0]) / (double)last : 0.0);
    key_number(out, ",\n  ", "duration", last >= 0 ? record->time[last] : 0.0);
    morph_text_add(out, ",\n  \"links\": [\n");
    for (int k = 0; k < record->links; k++) {
        put_link(out, record, k);
        morph_text_add(out, k + 1 < record->links ? ",\n" : "\n");
    }
    morph_text_add(out, "  ]\n}\n");
    morph_locale_leave(&locale);
    if (!out->failed) return MORPH_OK;
    morph_text_free(out);
    return MORPH_ERR_NOMEM;
}
