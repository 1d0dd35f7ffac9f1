/* Are the files of a plan folder the ones that were written together? plan.h5 has been read into a record;
 * schedule.json holds the checksums of plan.h5 and schedule.csv and repeats some of the record, schedule.csv
 * holds its lengths. Any two of them tell on the third. */
#include "planner/folder.h"
#include "planner/folder_text.h"
#include "planner/sha256.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct verifier {
    const char *folder;
    const morph_record *r;
    morph_text found;
    char *message;
    size_t size;
} verifier;

/* A line of the report, as wide as those of the margins. */
#define FOUND "%-15s FAILS "

/* Loads a file of the folder; a missing one is said here. path: free(), also after a failure. */
static morph_status load(const verifier *v, const char *name, char **path, char **data, size_t *size) {
    *data = NULL;
    *path = morph_path_join(v->folder, name);
    if (!*path) return morph_fail(MORPH_ERR_NOMEM, v->message, v->size, "%s: out of memory", v->folder);
    const morph_status status = morph_file_load(*path, data, size, v->message, v->size);
    if (status != MORPH_ERR_IO || morph_name_fault() != MORPH_ERR_INPUT) return status;
    return morph_fail(MORPH_ERR_INPUT, v->message, v->size,
                      "%s: is missing: a plan folder holds plan.h5, schedule.csv and schedule.json", *path);
}

static const char *text_of(const cJSON *root, const char *group, const char *key) {
    const cJSON *object = cJSON_GetObjectItemCaseSensitive(root, group);
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, key));
}

/* Numbers were written to read back bit for bit. */
static bool equals(const cJSON *object, const char *key, double value) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsNumber(item) && item->valuedouble == value;
}

static bool pair_equals(const cJSON *object, const char *key, double a, double b) {
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(object, key), *item = list ? list->child : NULL;
    return cJSON_IsArray(list) && cJSON_IsNumber(item) && item->valuedouble == a &&
           cJSON_IsNumber(item->next) && item->next->valuedouble == b && !item->next->next;
}

/* What is different in the entry of link k; NULL if nothing is. */
static const char *link_fault(const morph_record *r, int k, const cJSON *entry) {
    if (!equals(entry, "number", k)) return "number";
    if (!pair_equals(entry, "joints", r->link[k][0], r->link[k][1])) return "joints";
    if (!pair_equals(entry, "length", r->length_limit[k][0], r->length_limit[k][1])) return "length";
    if (!equals(entry, "rate", r->rate_limit[k])) return "rate";
    if (!equals(entry, "acceleration", r->acceleration_limit[k])) return "acceleration";
    if (!equals(entry, "jerk", r->jerk_limit[k])) return "jerk";
    return equals(entry, "radius", r->link_radius[k]) ? NULL : "radius";
}

static void verify_links(verifier *v, const cJSON *root) {
    const morph_record *r = v->r;
    const cJSON *links = cJSON_GetObjectItemCaseSensitive(root, "links"),
                *entry = links ? links->child : NULL;
    int k = 0;
    for (; k < r->links && entry; k++, entry = entry->next) {
        const char *wrong = link_fault(r, k, entry);
        if (!wrong) continue;
        char name[96];
        morph_record_link_name(r, k, name, sizeof name);
        morph_text_add(&v->found, FOUND "\"%s\" of %s is not that of plan.h5\n", "schedule.json", wrong,
                       name);
        return;
    }
    if (k < r->links || entry)
        morph_text_add(&v->found, FOUND "its list of links is not that of plan.h5, which has %d\n",
                       "schedule.json", r->links);
}

static void verify_head(verifier *v, const cJSON *root) {
    const morph_record *r = v->r;
    const int last = r->samples - 1;
    const char *outcome = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(root, "outcome"));
    const char *wrong = NULL;
    if (!equals(root, "samples", r->samples))
        wrong = "samples";
    else if (!equals(root, "sample_time", last > 0 ? (r->time[last] - r->time[0]) / (double)last : 0.0))
        wrong = "sample_time";
    else if (!equals(root, "duration", r->time[last]))
        wrong = "duration";
    else if (!outcome || strcmp(outcome, r->outcome) != 0)
        wrong = "outcome";
    if (wrong) morph_text_add(&v->found, FOUND "\"%s\" is not that of plan.h5\n", "schedule.json", wrong);
}

static void verify_sum(verifier *v, const char *name, const char *data, size_t size, const char *expected) {
    char hash[65];
    morph_sha256_text(data, size, hash);
    if (strcmp(hash, expected) != 0)
        morph_text_add(&v->found, FOUND "was changed: its checksum is not the one in schedule.json\n", name);
}

/* The largest difference, with link and time. */
static void compare_lengths(verifier *v, const double *time, const double *length, int samples) {
    const morph_record *r = v->r;
    if (samples != r->samples) {
        morph_text_add(&v->found, FOUND "has %d rows, plan.h5 %d samples\n", "schedule.csv", samples,
                       r->samples);
        return;
    }
    const size_t links = (size_t)r->links;
    size_t at = 0;
    double most = 0;
    for (size_t i = 0; i < (size_t)samples * links; i++) {
        const double off = fabs(length[i] - r->length[i]);
        if (off <= most) continue;
        most = off;
        at = i;
    }
    for (int k = 0; k < samples; k++) {
        if (time[k] == r->time[k]) continue;
        morph_text_add(&v->found, FOUND "row %d is at %.9g s, in plan.h5 at %.9g s\n", "schedule.csv", k + 1,
                       time[k], r->time[k]);
        break;
    }
    if (most == 0) return;
    char name[96];
    morph_record_link_name(r, (int)(at % links), name, sizeof name);
    morph_text_add(&v->found, FOUND "%s at %.9g s is %.9g m, in plan.h5 %.9g m (off by %.3g m)\n",
                   "schedule.csv", name, r->time[at / links], length[at], r->length[at], most);
}

static morph_status verify_csv(verifier *v, const char *expected) {
    char *path, *data, why[400] = "";
    size_t size;
    morph_status status = load(v, "schedule.csv", &path, &data, &size);
    if (status == MORPH_OK && expected) verify_sum(v, "schedule.csv", data, size, expected);
    free(data);
    double *time = NULL, *length = NULL;
    int samples = 0;
    if (status == MORPH_OK) {
        status = morph_schedule_read(path, v->r->links, &time, &length, &samples, why, sizeof why);
        if (status == MORPH_OK) {
            compare_lengths(v, time, length, samples);
        } else if (status == MORPH_ERR_INPUT) {
            morph_text_add(&v->found, FOUND "%s\n", "schedule.csv", why);
            status = MORPH_OK;
        } else {
            morph_fail(status, v->message, v->size, "%s", why);
        }
    }
    free(time);
    free(length);
    free(path);
    return status;
}

static morph_status verify_h5(verifier *v, const char *expected) {
    char *path, *data;
    size_t size;
    const morph_status status = load(v, "plan.h5", &path, &data, &size);
    if (status == MORPH_OK) verify_sum(v, "plan.h5", data, size, expected);
    free(data);
    free(path);
    return status;
}

/* schedule.json first: it has the checksums. Without them the lengths are still compared. */
static morph_status verify(verifier *v) {
    char *path, *data;
    size_t size = 0;
    morph_status status = load(v, "schedule.json", &path, &data, &size);
    free(path);
    if (status != MORPH_OK) {
        free(data);
        return status;
    }
    cJSON *root = cJSON_ParseWithLength(data, size);
    free(data);
    const char *csv = text_of(root, "schedule", "sha256"), *plan = text_of(root, "plan", "sha256");
    if (!root)
        morph_text_add(&v->found, FOUND "is no JSON\n", "schedule.json");
    else if (!csv || !plan)
        morph_text_add(&v->found, FOUND "holds no checksums of schedule.csv and plan.h5\n", "schedule.json");
    if (root) {
        verify_head(v, root);
        verify_links(v, root);
    }
    if (plan) status = verify_h5(v, plan);
    if (status == MORPH_OK) status = verify_csv(v, csv);
    cJSON_Delete(root);
    return status;
}

morph_status morph_folder_verify(const char *folder, const morph_record *record, char **findings,
                                 char *message, size_t size) {
    *findings = NULL;
    if (record->samples == 0) return MORPH_OK;
    verifier v = {.folder = folder, .r = record, .message = message, .size = size};
    morph_status status = verify(&v);
    if (status == MORPH_OK && v.found.failed)
        status = morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", folder);
    if (status == MORPH_OK)
        *findings = v.found.data;
    else
        morph_text_free(&v.found);
    return status;
}
