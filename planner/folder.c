/* The plan folder: every file is written into a hidden folder beside it, which then takes its place. */
#include "planner/folder.h"

#include "planner/folder_place.h"
#include "planner/folder_text.h"
#include "planner/import_tetra.h"
#include "planner/report.h"
#include "planner/schedule_file.h"
#include "planner/sha256.h"
#include "planner/start.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* What a writer of one file needs to know. */
typedef struct job {
    const morph_place *place;
    const morph_scene *scene;
    const morph_record *record;
    const morph_summary *summary;
    char *mesh; /* name of the target's copy in the folder; NULL: none */
    char *message;
    size_t size;
} job;

static morph_status out_of_memory(const job *j) {
    return morph_fail(MORPH_ERR_NOMEM, j->message, j->size, "%s: out of memory", j->place->folder);
}

/* The hidden folder means nothing to the reader of a message: FOLDER/NAME: why. */
static morph_status say(const job *j, const char *name, morph_status status) {
    if (status == MORPH_ERR_IO)
        return morph_fail(status, j->message, j->size, "%s/%s: cannot be written: %s", j->place->folder, name,
                          strerror(errno));
    return morph_fail(status, j->message, j->size, "%s/%s: cannot be written: %s", j->place->folder, name,
                      morph_status_text(status));
}

static morph_status put(const job *j, const char *name, const char *data, size_t size) {
    char *path = morph_path_join(j->place->stage, name);
    if (!path) return out_of_memory(j);
    morph_status status = morph_file_put(path, data, size, NULL, 0);
    free(path);
    return status == MORPH_OK ? status : say(j, name, status);
}

/* Writes a text that `make` gave, and frees it. */
static morph_status put_text(const job *j, const char *name, morph_status made, char *text) {
    morph_status status = made == MORPH_OK ? put(j, name, text, strlen(text)) : say(j, name, made);
    free(text);
    return status;
}

/* plan.h5, and its checksum. */
static morph_status put_record(const job *j, char hash[65]) {
    char why[256], *data;
    size_t size;
    char *path = morph_path_join(j->place->stage, "plan.h5");
    if (!path) return out_of_memory(j);
    morph_status status = morph_record_write_h5(j->record, path, why, sizeof why);
    if (status == MORPH_ERR_IO) {
        say(j, "plan.h5", status);
    } else if (status != MORPH_OK) {
        /* Its reason follows the path of the hidden file. */
        const char *reason = strncmp(why, path, strlen(path)) == 0 ? why + strlen(path) : why;
        morph_fail(status, j->message, j->size, "%s/plan.h5%s", j->place->folder, reason);
    } else {
        status = morph_file_load(path, &data, &size, NULL, 0);
        if (status == MORPH_OK)
            morph_sha256_text(data, size, hash);
        else
            say(j, "plan.h5", status);
        free(data);
    }
    free(path);
    return status;
}

static morph_status put_schedule(const job *j, const char *plan_hash) {
    /* The best point of a run that never got that far has no schedule. */
    if (j->record->samples == 0) return MORPH_OK;
    morph_text csv, json = {0};
    char hash[65];
    morph_status status = morph_schedule_csv(j->record, &csv);
    if (status != MORPH_OK) return say(j, "schedule.csv", status);
    morph_sha256_text(csv.data, csv.size, hash);
    status = put(j, "schedule.csv", csv.data, csv.size);
    morph_text_free(&csv);
    if (status != MORPH_OK) return status;
    const char *title = j->scene->title ? j->scene->title : "";
    status = morph_schedule_json(j->record, title, hash, plan_hash, &json);
    return put_text(j, "schedule.json", status, json.data);
}

/* Name of the target's copy: its own, but never that of a file of ours. */
static morph_status name_mesh(job *j) {
    static const char *const taken[] = {"plan.h5",       "scene.yaml",  "summary.json", "schedule.csv",
                                        "schedule.json", "report.html", "start.csv"};
    const morph_target_def *def = &j->scene->target_def;
    if ((def->shape != MORPH_SHAPE_MESH && def->shape != MORPH_SHAPE_HEIGHTMAP) || !def->file)
        return MORPH_OK;
    const char *slash = strrchr(def->file, '/'), *name = slash ? slash + 1 : def->file, *lead = "";
    for (size_t k = 0; k < sizeof taken / sizeof taken[0]; k++)
        if (strcasecmp(name, taken[k]) == 0) lead = "target_";
    size_t room = strlen(lead) + strlen(name) + 1;
    j->mesh = malloc(room);
    if (!j->mesh) return out_of_memory(j);
    snprintf(j->mesh, room, "%s%s", lead, name);
    return MORPH_OK;
}

/* The other file of a TetGen pair, under its own name: its ending is that of none of ours. */
static morph_status put_sibling(const job *j) {
    const morph_target_def *def = &j->scene->target_def;
    char *path = NULL, *data;
    size_t size;
    if (!def->has_deformable) return MORPH_OK;
    morph_status status = morph_tetra_sibling(def->file, &path);
    if (status != MORPH_OK) return out_of_memory(j);
    if (!path) return MORPH_OK;
    const char *slash = strrchr(path, '/');
    status = morph_file_load(path, &data, &size, j->message, j->size);
    if (status == MORPH_OK) status = put(j, slash ? slash + 1 : path, data, size);
    free(data);
    free(path);
    return status;
}

static morph_status put_scene(job *j) {
    morph_status status = name_mesh(j);
    if (status != MORPH_OK) return status;
    if (j->mesh) {
        char *data;
        size_t size;
        status = morph_file_load(j->scene->target_def.file, &data, &size, j->message, j->size);
        if (status != MORPH_OK) return status;
        status = put(j, j->mesh, data, size);
        free(data);
        if (status == MORPH_OK) status = put_sibling(j);
        if (status != MORPH_OK) return status;
    }
    static char start_name[] = "start.csv";
    morph_scene scene = *j->scene; /* borrows; only its start's name differs */
    char *yaml = NULL;
    if (scene.start.file) {
        char *csv = NULL;
        status = morph_start_to_csv(&scene.start, &csv);
        status = put_text(j, start_name, status, csv);
        scene.start.as_written = start_name;
        if (status != MORPH_OK) return status;
    }
    status = morph_scene_to_yaml(&scene, j->mesh, &yaml);
    return put_text(j, "scene.yaml", status, yaml);
}

static morph_status put_all(job *j) {
    char hash[65] = "", *text = NULL;
    morph_status status = put_record(j, hash);
    if (status == MORPH_OK) status = put_scene(j);
    if (status == MORPH_OK) status = put_schedule(j, hash);
    if (status != MORPH_OK) return status;
    status = morph_summary_to_json(j->summary, &text);
    status = put_text(j, "summary.json", status, text);
    if (status != MORPH_OK) return status;
    text = NULL;
    status = morph_report_html(j->record, j->summary, &text);
    return put_text(j, "report.html", status, text);
}

morph_status morph_folder_probe(const char *folder, bool overwrite, char *message, size_t size) {
    morph_place place;
    morph_status status = morph_place_find(folder, overwrite, &place, message, size);
    if (status != MORPH_OK) return status;
    /* The surest question whether a folder can be made there is to make one. */
    status = morph_place_stage(&place, message, size);
    morph_place_close(&place);
    return status;
}

morph_status morph_folder_write(const char *folder, bool overwrite, const morph_scene *scene,
                                const morph_record *record, const morph_summary *summary, char *message,
                                size_t size) {
    morph_place place;
    morph_status status = morph_place_find(folder, overwrite, &place, message, size);
    if (status != MORPH_OK) return status;
    status = morph_place_stage(&place, message, size);
    job j = {.place = &place,
             .scene = scene,
             .record = record,
             .summary = summary,
             .message = message,
             .size = size};
    if (status == MORPH_OK) status = put_all(&j);
    if (status == MORPH_OK) status = morph_place_commit(&place, overwrite, message, size);
    free(j.mesh);
    morph_place_close(&place);
    return status;
}

morph_status morph_folder_read(const char *folder, morph_record *record, char *message, size_t size) {
    *record = (morph_record){0};
    struct stat info;
    if (stat(folder, &info) != 0)
        return morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be read: %s", folder, strerror(errno));
    if (!S_ISDIR(info.st_mode))
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: is no plan folder", folder);
    char *file = morph_path_join(folder, "plan.h5");
    if (!file) return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", folder);
    morph_status status;
    if (stat(file, &info) != 0 && errno == ENOENT)
        status =
            morph_fail(MORPH_ERR_INPUT, message, size, "%s: is no plan folder: it holds no plan.h5", folder);
    else
        status = morph_record_read_h5(file, record, message, size);
    free(file);
    return status;
}
