/* summary.json: the numbers of one plan, by the names that other programs rely on. */
#include "planner/summary.h"

#include "planner/folder.h"
#include "planner/folder_text.h"
#include "planner/reach_text.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

const char *morph_stage_name(morph_stage stage) {
    static const char *const names[MORPH_STAGES] = {"target", "nominal", "placement", "refine", "path",
                                                    "timing", "measure", "replay",    "check",  "write"};
    int k = (int)stage;
    return k >= 0 && k < MORPH_STAGES ? names[k] : "unknown";
}

/* cJSON's helpers add nothing and return NULL when memory is refused; a NULL parent is allowed. Every result
 * goes through `keep`, so that one flag tells at the end. */
typedef struct builder {
    bool failed;
} builder;

static cJSON *keep(builder *b, cJSON *item) {
    if (!item) b->failed = true;
    return item;
}

/* The library's own number format depends on its version; ours reads back bit for bit, and what is not finite
 * becomes null. */
static void put_number(builder *b, cJSON *at, const char *key, double value) {
    char text[32];
    morph_number(value, text);
    keep(b, cJSON_AddRawToObject(at, key, text));
}

/* The library writes bytes as they are: text that is no UTF-8 would make the file unreadable. */
static void put_text(builder *b, cJSON *at, const char *key, const char *value) {
    morph_text text = {0};
    morph_text_json(&text, value);
    if (text.failed)
        b->failed = true;
    else
        keep(b, cJSON_AddRawToObject(at, key, text.data));
    morph_text_free(&text);
}

static void put_bool(builder *b, cJSON *at, const char *key, bool value) {
    keep(b, cJSON_AddBoolToObject(at, key, value));
}

static cJSON *put_object(builder *b, cJSON *at, const char *key) {
    return keep(b, cJSON_AddObjectToObject(at, key));
}

/* What is measured alike: blanket, plan, and where the lengths alone lead. NULL: it gave no result. */
typedef struct measured {
    const char *name;
    const morph_measure *measure;
} measured;
enum { MEASURED = 7 };

/* The reference is not there unless somebody has asked for it. */
static int list_measured(const morph_summary *s, measured list[MEASURED]) {
    int n = 0;
    list[n++] = (measured){"blanket", s->has_blanket ? &s->blanket : NULL};
    if (s->has_guided) list[n++] = (measured){"seeds", &s->seeded};
    if (s->has_guided) list[n++] = (measured){"guided", &s->guided};
    list[n++] = (measured){"plan", s->has_plan ? &s->plan : NULL};
    list[n++] = (measured){"replay", s->replay.done ? &s->replay.measure : NULL};
    list[n++] = (measured){"replay_core", s->replay_core.done ? &s->replay_core.measure : NULL};
    if (s->has_reference) list[n++] = (measured){"reference", &s->reference};
    return n;
}

/* One number of each, by its place in the measure. */
static void put_each(builder *b, cJSON *at, const char *key, const morph_summary *s, size_t field) {
    measured list[MEASURED];
    const int count = list_measured(s, list);
    cJSON *object = put_object(b, at, key);
    for (int k = 0; k < count; k++) {
        double value = NAN;
        if (list[k].measure) memcpy(&value, (const char *)list[k].measure + field, sizeof value);
        put_number(b, object, list[k].name, value);
    }
}

static void put_gap(builder *b, cJSON *at, const char *key, const morph_measure *m) {
    if (!m) {
        keep(b, cJSON_AddNullToObject(at, key));
        return;
    }
    cJSON *gap = put_object(b, at, key);
    put_number(b, gap, "mean", m->gap_mean);
    put_number(b, gap, "p95", m->gap_p95);
    put_number(b, gap, "max", m->gap_max);
    put_number(b, gap, "target", m->gap_target);
}

static void put_measures(builder *b, cJSON *root, const morph_summary *s) {
    measured list[MEASURED];
    const int count = list_measured(s, list);
    put_each(b, root, "cavity_volume", s, offsetof(morph_measure, volume));
    put_number(b, root, "target_volume", s->target_volume);
    put_each(b, root, "objective", s, offsetof(morph_measure, objective));
    cJSON *gap = put_object(b, root, "gap");
    for (int k = 0; k < count; k++)
        put_gap(b, gap, list[k].name, list[k].measure);
    put_each(b, root, "coverage", s, offsetof(morph_measure, coverage));
}

static void put_place(builder *b, cJSON *at, const char *key, const double place[3]) {
    cJSON *array = keep(b, cJSON_AddArrayToObject(at, key));
    for (int d = 0; array && d < 3; d++) {
        char text[32];
        morph_number(place[d], text);
        cJSON *item = keep(b, cJSON_CreateRaw(text));
        if (item) cJSON_AddItemToArray(array, item);
    }
}

static void put_cavity_list(builder *b, cJSON *at, const char *key, const morph_cavity_list *list) {
    cJSON *array = keep(b, cJSON_AddArrayToObject(at, key));
    for (int k = 0; array && k < list->count; k++) {
        const morph_cavity_part *part = &list->part[k];
        cJSON *item = keep(b, cJSON_CreateObject());
        if (!item) return;
        cJSON_AddItemToArray(array, item);
        put_number(b, item, "volume", part->volume);
        put_place(b, item, "at", part->at);
        put_number(b, item, "share", part->volume / list->volume);
        put_number(b, item, "height", part->height);
        put_number(b, item, "area", part->area);
    }
}

/* The largest connected cavities before and after. */
static void put_cavities(builder *b, cJSON *root, const morph_summary *s) {
    cJSON *cavities = put_object(b, root, "cavities");
    put_cavity_list(b, cavities, "blanket", &s->cavities_blanket);
    put_cavity_list(b, cavities, "plan", &s->cavities_plan);
}

/* What the lengths alone do to the structure: distances to the plan's end with rigid motion removed. */
static void put_replay(builder *b, cJSON *root, const char *key, const morph_replay_report *r) {
    if (!r->done) {
        keep(b, cJSON_AddNullToObject(root, key));
        return;
    }
    cJSON *replay = put_object(b, root, key);
    put_number(b, replay, "distance_rms", r->rms);
    put_number(b, replay, "distance_max", r->most);
    put_number(b, replay, "worst_length", r->length);
    put_number(b, replay, "time", r->seconds_of_run);
    put_bool(b, replay, "at_rest", r->at_rest);
    put_bool(b, replay, "gravity", !r->floating);
}

static void put_margins(builder *b, cJSON *root, const morph_summary *s) {
    cJSON *margins = put_object(b, root, "margins");
    for (int k = 0; s->has_plan && k < MORPH_MARGIN_KINDS; k++) {
        const morph_margin *m = &s->check.margin[k];
        if (!m->tested) continue;
        cJSON *margin = put_object(b, margins, morph_margin_name((morph_margin_kind)k));
        put_number(b, margin, "worst", m->worst);
        put_text(b, margin, "element", m->element);
        put_number(b, margin, "time", m->time);
        put_text(b, margin, "unit", morph_margin_unit_of(m, (morph_margin_kind)k));
        put_number(b, margin, "tolerance", m->tolerance);
        put_bool(b, margin, "holds", m->worst >= -m->tolerance);
    }
}

static void put_solver(builder *b, cJSON *root, const morph_summary *s) {
    cJSON *iterations = put_object(b, root, "iterations");
    put_number(b, iterations, "refine", s->iterations_refine);
    put_number(b, iterations, "path", s->iterations_path);
    put_number(b, iterations, "timing", s->iterations_timing);
    cJSON *unknowns = put_object(b, root, "unknowns");
    put_number(b, unknowns, "refine", s->unknowns_refine);
    put_number(b, unknowns, "path", s->unknowns_path);
    cJSON *rows = put_object(b, root, "rows"), *stage = put_object(b, rows, "refine");
    put_number(b, stage, "used", s->rows_refine_used);
    put_number(b, stage, "possible", s->rows_refine_possible);
    stage = put_object(b, rows, "path");
    put_number(b, stage, "used", s->rows_path_used);
    put_number(b, stage, "possible", s->rows_path_possible);
}

static void put_placement(builder *b, cJSON *root, const morph_summary *s) {
    const morph_placement_summary *p = &s->placement;
    cJSON *o = put_object(b, root, "placement");
    put_number(b, o, "seeds", p->seeds);
    put_number(b, o, "centres", p->centres);
    put_number(b, o, "rounds", p->rounds);
    put_number(b, o, "accepted", p->accepted);
    put_number(b, o, "iterations", p->iterations);
    put_number(b, o, "unknowns", p->unknowns);
    put_number(b, o, "rows", p->rows);
    put_bool(b, o, "solved", p->solved);
    put_bool(b, o, "stable", p->stable);
    put_number(b, o, "residual", p->residual);
    put_number(b, o, "complementarity", p->complementarity);
    put_number(b, o, "difference", p->difference);
    put_number(b, o, "largest_force", p->largest_force);
    keep(b, cJSON_AddStringToObject(o, "reason", p->reason));
}

/* What differs from run to run stands here and in peak_memory_bytes alone. */
static void put_seconds(builder *b, cJSON *root, const morph_summary *s) {
    if (s->budget > 0.0) {
        cJSON *budget = put_object(b, root, "budget");
        put_number(b, budget, "seconds", s->budget);
        put_bool(b, budget, "ran_out", s->budget_ran_out);
    }
    cJSON *seconds = put_object(b, root, "seconds");
    for (int k = 0; k < MORPH_STAGES; k++)
        put_number(b, seconds, morph_stage_name((morph_stage)k), s->seconds[k]);
    put_number(b, seconds, "linear_solver", s->linear_seconds);
    put_number(b, seconds, "callbacks", s->callback_seconds);
    put_number(b, seconds, "blanket_run", s->blanket_report.seconds);
    put_number(b, seconds, "total", s->total_seconds);
    put_number(b, root, "peak_memory_bytes", (double)s->peak_memory_bytes);
}

/* What the target asks against what the structure can give. */
static void put_reach(builder *b, cJSON *root, const morph_reach *reach) {
    cJSON *object = put_object(b, root, "reach");
    put_bool(b, object, "within", reach->within);
    put_number(b, object, "coverage", reach->coverage);
    for (int k = 0; k < MORPH_REACH_KINDS; k++) {
        const morph_reach_item *item = &reach->item[k];
        if (item->verdict == MORPH_REACH_UNTESTED) continue;
        cJSON *at = put_object(b, object, morph_reach_name((morph_reach_kind)k));
        put_text(b, at, "verdict", morph_reach_verdict_name(item->verdict));
        put_number(b, at, "number", item->number);
        put_number(b, at, "limit", item->limit);
        put_text(b, at, "unit", morph_reach_unit((morph_reach_kind)k));
        put_number(b, at, "lost", item->lost);
        put_text(b, at, "along", item->along_y ? "y" : "x");
        put_number(b, at, "line", item->line);
        put_number(b, at, "x", item->at[0]);
        put_number(b, at, "y", item->at[1]);
        put_number(b, at, "z", item->at[2]);
    }
}

static void put_deformable(builder *b, cJSON *root, const morph_deformable_report *r) {
    if (!r->used) {
        keep(b, cJSON_AddNullToObject(root, "deformable"));
        return;
    }
    cJSON *body = put_object(b, root, "deformable");
    put_number(b, body, "vertices", r->vertices);
    put_number(b, body, "tetrahedra", r->tetrahedra);
    put_number(b, body, "volume", r->volume);
    put_number(b, body, "pressed", r->pressed);
    put_number(b, body, "least_volume", r->least_volume);
    put_number(b, body, "worst_depth", r->worst_depth);
}

static void put_details(builder *b, cJSON *root, const morph_summary *s) {
    const morph_blanket_report *r = &s->blanket_report;
    cJSON *run = put_object(b, root, "blanket_run");
    put_number(b, run, "steps", r->steps);
    put_number(b, run, "step", r->step);
    put_number(b, run, "step_halvings", r->step_halvings);
    put_bool(b, run, "at_rest", r->at_rest);
    put_number(b, run, "rest_speed", r->rest_speed);
    cJSON *jump = put_object(b, run, "largest_second_difference");
    put_number(b, jump, "length", s->largest_jump);
    put_number(b, jump, "link", s->jump_link);
    put_number(b, jump, "time", s->jump_time);
    put_number(b, run, "worst_length", r->worst_length);
    put_number(b, run, "worst_post", r->worst_post);
    put_number(b, run, "worst_clearance", r->worst_clearance);
    cJSON *distance = put_object(b, root, "distance_grid");
    put_number(b, distance, "cell", s->sdf_cell);
    put_number(b, distance, "rms", s->sdf_rms);
    put_number(b, distance, "max", s->sdf_max);
    put_text(b, root, "blas", s->blas);
    put_text(b, root, "warning", s->warning);
}

static void put_start(builder *b, cJSON *root, const morph_summary *s) {
    cJSON *start = put_object(b, root, "start");
    const bool flat = strcmp(s->start.kind, "flat") == 0 || !s->start.kind[0];
    put_text(b, start, "kind", flat ? "flat" : s->start.kind);
    if (flat) return;
    put_number(b, start, "residual", s->start.residual);
    put_number(b, start, "free_motions", s->start.free_motions);
    put_number(b, start, "doubt_m", s->start.doubt);
}

static void put_all(builder *b, cJSON *root, const morph_summary *s) {
    put_text(b, root, "title", s->title);
    put_text(b, root, "scene", s->scene);
    put_text(b, root, "method", s->method);
    put_text(b, root, "level", s->level);
    put_text(b, root, "outcome", s->outcome);
    put_bool(b, root, "feasible", s->feasible);
    put_text(b, root, "reason", s->reason);
    put_number(b, root, "spacing", s->spacing);
    put_start(b, root, s);
    put_measures(b, root, s);
    put_cavities(b, root, s);
    put_reach(b, root, &s->reach);
    put_deformable(b, root, &s->deformable);
    put_margins(b, root, s);
    put_replay(b, root, "replay", &s->replay);
    put_replay(b, root, "replay_core", &s->replay_core);
    cJSON *mobility = put_object(b, root, "mobility");
    put_number(b, mobility, "free", s->free_motions);
    put_number(b, mobility, "redundant", s->redundant);
    put_number(b, mobility, "sigma_min", s->sigma_min);
    put_number(b, root, "duration", s->has_plan ? s->duration : (double)NAN);
    /* What one link alone would need, rest to rest; null where there is no plan, or no link that moves. */
    cJSON *bounds = put_object(b, root, "duration_bounds");
    put_number(b, bounds, "single_link", s->has_plan ? s->single_link_seconds : (double)NAN);
    put_number(b, bounds, "link", s->has_plan && s->single_link >= 0 ? s->single_link : (double)NAN);
    put_solver(b, root, s);
    if (s->has_guided) put_placement(b, root, s);
    put_seconds(b, root, s);
    put_details(b, root, s);
}

morph_status morph_summary_to_json(const morph_summary *summary, char **text) {
    *text = NULL;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    builder b = {false};
    cJSON *root = keep(&b, cJSON_CreateObject());
    if (root) put_all(&b, root, summary);
    char *json = b.failed ? NULL : cJSON_Print(root);
    cJSON_Delete(root);
    morph_locale_leave(&locale);
    if (!json) return MORPH_ERR_NOMEM;
    /* The text is the caller's to free(): the library's own allocator may have been replaced by hooks. */
    size_t size = strlen(json);
    *text = malloc(size + 2);
    if (*text) {
        memcpy(*text, json, size);
        memcpy(*text + size, "\n", 2);
    }
    cJSON_free(json);
    return *text ? MORPH_OK : MORPH_ERR_NOMEM;
}
