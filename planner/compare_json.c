/* compare.json: a list of summaries by the names of summary.json, each with scene, method and settings. A
 * plan's holds all that its summary.json would. */
#include "planner/compare_method.h"

#include "planner/folder.h"

#include <stdlib.h>
#include <string.h>

static void put_key(morph_text *text, const char *key) {
    morph_text_add(text, ",\n\t\"%s\":\t", key);
}

/* "cavity_volume": {"blanket": .., "METHOD": ..}: the pure blanket's beside the method's own. */
static void put_pair(morph_text *text, const char *key, const morph_compare_result *result,
                     morph_compare_method method, size_t field) {
    const morph_compare_method both[2] = {MORPH_COMPARE_BLANKET, method};
    put_key(text, key);
    for (int k = method == MORPH_COMPARE_BLANKET ? 1 : 0; k < 2; k++) {
        const morph_compare_row *row = &result->row[both[k]];
        double value = NAN;
        if (row->measured) memcpy(&value, (const char *)&row->measure + field, sizeof value);
        morph_text_add(text, "%s\"%s\": ", k == 0 || method == MORPH_COMPARE_BLANKET ? "{" : ", ",
                       morph_compare_name(both[k]));
        morph_text_number(text, value);
    }
    morph_text_add(text, "}");
}

static void put_gap(morph_text *text, const char *name, const morph_compare_row *row) {
    const morph_measure *m = &row->measure;
    const double value[4] = {m->gap_mean, m->gap_p95, m->gap_max, m->gap_target};
    static const char *const keys[4] = {"mean", "p95", "max", "target"};
    morph_text_add(text, "\"%s\": ", name);
    for (int k = 0; k < 4 && row->measured; k++) {
        morph_text_add(text, "%s\"%s\": ", k == 0 ? "{" : ", ", keys[k]);
        morph_text_number(text, value[k]);
    }
    morph_text_add(text, row->measured ? "}" : "null");
}

static void put_measures(morph_text *text, const morph_compare_result *r, morph_compare_method method) {
    put_pair(text, "cavity_volume", r, method, offsetof(morph_measure, volume));
    put_key(text, "target_volume");
    morph_text_number(text, r->scene->target_report.volume);
    put_pair(text, "objective", r, method, offsetof(morph_measure, objective));
    put_key(text, "gap");
    morph_text_add(text, "{");
    if (method != MORPH_COMPARE_BLANKET) {
        put_gap(text, "blanket", &r->row[MORPH_COMPARE_BLANKET]);
        morph_text_add(text, ", ");
    }
    put_gap(text, morph_compare_name(method), &r->row[method]);
    morph_text_add(text, "}");
    put_pair(text, "coverage", r, method, offsetof(morph_measure, coverage));
}

/* What a method was run with, and on what. */
static void put_settings(morph_text *text, const morph_scene *s, morph_compare_method method) {
    static const char *const attractors[] = {"auto", "none", "list"};
    const char *own = morph_compare_entries[method].settings;
    morph_text_add(
        text, "{\"program\": \"morphplan %s\", \"level\": \"standard\", \"scene_sha256\": ", MORPH_VERSION);
    morph_text_json(text, s->sha256);
    morph_text_add(text, ", \"attractors\": \"%s\"%s%s}", attractors[s->attractors], own[0] ? ", " : "", own);
}

/* Ratios to the pure blanket, and of the objective to the reference's. */
static void put_ratios(morph_text *text, const morph_compare_result *r, morph_compare_method method) {
    put_key(text, "ratio");
    for (int q = 0; q < MORPH_COMPARE_QUANTITIES; q++) {
        const morph_compare_quantity quantity = (morph_compare_quantity)q;
        morph_text_add(text, "%s\"%s\": ", q == 0 ? "{" : ", ", morph_compare_quantity_name(quantity));
        morph_text_number(text, morph_compare_ratio(r, method, MORPH_COMPARE_BLANKET, quantity));
    }
    morph_text_add(text, ", \"reference_objective\": ");
    morph_text_number(text, morph_compare_ratio(r, method, MORPH_COMPARE_REFERENCE, MORPH_COMPARE_OBJECTIVE));
    morph_text_add(text, "}");
}

/* The plan's own summary with the reference beside it; its members follow ours. */
static morph_status put_plan(morph_text *text, const morph_compare_result *r) {
    const morph_compare_row *row = &r->row[MORPH_COMPARE_PLAN];
    const morph_compare_row *reference = &r->row[MORPH_COMPARE_REFERENCE];
    morph_summary *s = malloc(sizeof *s);
    char *json = NULL;
    if (!s) return MORPH_ERR_NOMEM;
    *s = *row->summary;
    memcpy(s->method, "plan", sizeof "plan");
    s->has_reference = reference->measured;
    s->reference = reference->measure;
    const morph_status status = morph_summary_to_json(s, &json);
    if (status == MORPH_OK) {
        /* "{\n\t..members..\n}\n": between the braces. */
        const char *first = strchr(json, '{') + 1, *last = strrchr(json, '}');
        morph_text_add(text, ",");
        morph_text_put(text, first, (size_t)(last - first) - 1);
    }
    free(json);
    free(s);
    return status;
}

static void put_short(morph_text *text, const morph_compare_result *r, morph_compare_method method) {
    const morph_compare_row *row = &r->row[method];
    const morph_scene *s = r->scene;
    put_key(text, "title");
    morph_text_json(text, s->title ? s->title : "");
    put_key(text, "scene");
    morph_text_json(text, s->file);
    put_key(text, "method");
    morph_text_json(text, morph_compare_name(method));
    put_key(text, "outcome");
    morph_text_json(text, row->outcome);
    put_key(text, "feasible");
    morph_text_add(text, row->feasible ? "true" : "false");
    put_key(text, "reason");
    morph_text_json(text, row->reason);
    put_key(text, "spacing");
    morph_text_number(text, s->structure.spacing);
    put_measures(text, r, method);
    put_key(text, "seconds");
    morph_text_add(text, "{\"total\": ");
    morph_text_number(text, row->seconds);
    morph_text_add(text, "}");
}

static morph_status put_row(morph_text *text, const morph_compare_result *r, morph_compare_method method) {
    morph_status status = MORPH_OK;
    morph_text_add(text, "{\n\t\"settings\":\t");
    put_settings(text, r->scene, method);
    put_ratios(text, r, method);
    if (r->row[method].summary)
        status = put_plan(text, r);
    else
        put_short(text, r, method);
    morph_text_add(text, "\n}");
    return status;
}

morph_status morph_compare_json(const morph_compare *c, char **out) {
    *out = NULL;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    morph_text text = {0};
    morph_status status = MORPH_OK;
    for (int k = 0; k < c->scenes; k++)
        for (int m = 0; m < MORPH_COMPARE_METHODS && status == MORPH_OK; m++) {
            if (!c->result[k].row[m].listed) continue;
            morph_text_add(&text, text.size == 0 ? "[" : ",\n");
            status = put_row(&text, &c->result[k], (morph_compare_method)m);
        }
    morph_text_add(&text, "]\n");
    morph_locale_leave(&locale);
    if (status == MORPH_OK && text.failed) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK)
        *out = text.data;
    else
        morph_text_free(&text);
    return status;
}
