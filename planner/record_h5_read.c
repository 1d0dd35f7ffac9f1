/* Reads plan.h5 from anywhere: nothing in the file is believed before it is checked. */
#include "planner/folder.h"
#include "planner/folder_text.h"
#include "planner/record_h5.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A dataset that is not stored plainly (compressed by a later program) may claim any size: this much is taken
 * at most. A plain one is bounded by the file itself. */
#define LARGEST_PACKED ((hsize_t)1 << 30)

typedef struct reader {
    hid_t file;
    const char *name;
    hsize_t bytes; /* of the file */
    int known[32]; /* counts, -1 before the first dataset that tells */
    char *message;
    size_t size;
} reader;

static morph_status refuse(const reader *r, const char *what, const char *why) {
    return morph_fail(MORPH_ERR_INPUT, r->message, r->size, "%s: %s: %s", r->name, what, why);
}

/* A text attribute of fixed or variable length; cut to fit. */
static bool get_text(hid_t at, const char *name, char *text, size_t size) {
    if (H5Aexists(at, name) <= 0) return false;
    hid_t attribute = H5Aopen(at, name, H5P_DEFAULT);
    if (attribute < 0) return false;
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute), memory = H5I_INVALID_HID;
    bool ok = type >= 0 && space >= 0 && H5Tget_class(type) == H5T_STRING &&
              H5Sget_simple_extent_npoints(space) == 1;
    text[0] = 0;
    if (ok && H5Tis_variable_str(type) > 0) {
        char *value = NULL;
        memory = H5Tget_native_type(type, H5T_DIR_ASCEND);
        ok = memory >= 0 && H5Aread(attribute, memory, &value) >= 0 && value;
        if (ok) snprintf(text, size, "%s", value);
        if (value) H5free_memory(value);
    } else if (ok) {
        size_t length = H5Tget_size(type);
        char *value = length > 0 && length <= 65536 ? calloc(length + 1, 1) : NULL;
        ok = value && H5Aread(attribute, type, value) >= 0;
        if (ok) snprintf(text, size, "%s", value);
        free(value);
    }
    if (memory >= 0) H5Tclose(memory);
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    H5Aclose(attribute);
    return ok;
}

static bool get_number(hid_t at, const char *name, H5T_class_t class, hid_t memory, void *value) {
    if (H5Aexists(at, name) <= 0) return false;
    hid_t attribute = H5Aopen(at, name, H5P_DEFAULT);
    if (attribute < 0) return false;
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    bool ok = type >= 0 && space >= 0 && H5Tget_class(type) == class && H5Tget_size(type) <= 8 &&
              H5Sget_simple_extent_npoints(space) == 1 && H5Aread(attribute, memory, value) >= 0;
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    H5Aclose(attribute);
    return ok;
}

typedef enum presence { ABSENT, PRESENT, UNUSABLE } presence;

/* Only plain links inside this file are followed: a soft or external one may lead anywhere. */
static presence look(hid_t file, const char *path) {
    H5L_info_t info;
    htri_t there = H5Lexists(file, path, H5P_DEFAULT);
    if (there == 0) return ABSENT;
    if (there < 0 || H5Lget_info(file, path, &info, H5P_DEFAULT) < 0 || info.type != H5L_TYPE_HARD)
        return UNUSABLE;
    return PRESENT;
}

/* "group/dataset"; a group that is missing has no datasets. */
static presence look_up(hid_t file, const char *path) {
    char group[64];
    snprintf(group, sizeof group, "%.*s", (int)strcspn(path, "/"), path);
    presence p = look(file, group);
    return p == PRESENT ? look(file, path) : p;
}

/* Plans of earlier programs had no goals and say nothing of them. */
static morph_status read_goal(const reader *r, morph_goal *goal) {
    for (int k = 0; k < MORPH_GOAL_KINDS; k++) {
        char name[32], what[48];
        double limit = NAN;
        snprintf(name, sizeof name, "goal_%s", morph_goal_name((morph_goal_kind)k));
        snprintf(what, sizeof what, "attribute %s", name);
        if (H5Aexists(r->file, name) == 0) continue;
        if (!get_number(r->file, name, H5T_FLOAT, H5T_NATIVE_DOUBLE, &limit) || limit <= 0.0 ||
            isinf(limit) || (k == MORPH_GOAL_COVERAGE && limit > 1.0))
            return refuse(r, what, "must be a positive number (a coverage at most 1), or NaN for none");
        goal->limit[k] = isnan(limit) ? 0.0 : limit;
    }
    return MORPH_OK;
}

static morph_status read_root(const reader *r, morph_record *record) {
    char format[64];
    int version = 0;
    if (!get_text(r->file, "format", format, sizeof format) || strcmp(format, MORPH_RECORD_FORMAT) != 0)
        return refuse(r, "attribute format", "is not \"" MORPH_RECORD_FORMAT "\": this is no plan");
    if (!get_number(r->file, "version", H5T_INTEGER, H5T_NATIVE_INT, &version))
        return refuse(r, "attribute version", "is missing");
    if (version != MORPH_RECORD_VERSION)
        return refuse(r, "attribute version", "is not 1: written by another version of the program");
    if (!get_text(r->file, "program", record->program, sizeof record->program) ||
        !get_text(r->file, "scene_sha256", record->scene_sha256, sizeof record->scene_sha256))
        return refuse(r, "attributes program and scene_sha256", "must both be texts");
    if (!get_text(r->file, "outcome", record->outcome, sizeof record->outcome) ||
        (strcmp(record->outcome, "optimal") != 0 && strcmp(record->outcome, "feasible") != 0 &&
         strcmp(record->outcome, "infeasible") != 0 && strcmp(record->outcome, "stopped") != 0))
        return refuse(r, "attribute outcome", "is none of optimal, feasible, infeasible, stopped");
    if (!get_number(r->file, "base", H5T_FLOAT, H5T_NATIVE_DOUBLE, &record->base) || isinf(record->base))
        return refuse(r, "attribute base", "must be a number, or NaN for none");
    return read_goal(r, &record->goal);
}

static morph_status read_spacing(const reader *r, morph_record *record) {
    if (look(r->file, "structure") != PRESENT) return refuse(r, "structure", "is missing or damaged");
    hid_t group = H5Gopen2(r->file, "structure", H5P_DEFAULT);
    if (group < 0) return refuse(r, "structure", "cannot be read (damaged file?)");
    bool ok = get_number(group, "spacing", H5T_FLOAT, H5T_NATIVE_DOUBLE, &record->spacing);
    H5Gclose(group);
    if (!ok || !isfinite(record->spacing) || record->spacing <= 0)
        return refuse(r, "structure: attribute spacing", "must be a positive number");
    return MORPH_OK;
}

/* Every dimension is a count times a factor; the first dataset with a count says how much it is. */
static morph_status check_shape(reader *r, const morph_dataset *set, hid_t space, hsize_t *entries) {
    hsize_t shape[3] = {0};
    if (H5Sget_simple_extent_type(space) != H5S_SIMPLE || H5Sget_simple_extent_ndims(space) != set->rank ||
        H5Sget_simple_extent_dims(space, shape, NULL) < 0)
        return refuse(r, set->path, "has another number of dimensions");
    *entries = 1;
    for (int d = 0; d < set->rank; d++) {
        const morph_extent *e = &set->shape[d];
        if (shape[d] > INT_MAX) return refuse(r, set->path, "is too large");
        int n = (int)shape[d];
        if (e->count < 0) {
            if (n != e->times) return refuse(r, set->path, "has another number of columns");
        } else {
            if (n % e->times != 0) return refuse(r, set->path, "has another number of columns");
            if (r->known[e->count] < 0) r->known[e->count] = n / e->times;
            if (r->known[e->count] != n / e->times)
                return refuse(r, set->path, "does not fit the sizes of the other datasets");
        }
        if (n > 0 && *entries > ((hsize_t)1 << 40) / (hsize_t)n) return refuse(r, set->path, "is too large");
        *entries *= (hsize_t)n;
    }
    return MORPH_OK;
}

static morph_status check_type(const reader *r, const morph_dataset *set, hid_t data) {
    hid_t type = H5Dget_type(data);
    if (type < 0) return refuse(r, set->path, "cannot be read (damaged file?)");
    bool whole = set->cell == MORPH_CELL_INT;
    bool ok =
        whole ? H5Tget_class(type) == H5T_INTEGER && H5Tget_size(type) == 4 && H5Tget_sign(type) == H5T_SGN_2
              : H5Tget_class(type) == H5T_FLOAT && H5Tget_size(type) == 8;
    H5Tclose(type);
    return ok ? MORPH_OK : refuse(r, set->path, whole ? "is not i32" : "is not f64");
}

/* Where the values are: inside this file, and as many as claimed. */
static morph_status check_storage(const reader *r, const morph_dataset *set, hid_t data, hsize_t bytes) {
    hid_t plain = H5Dget_create_plist(data);
    if (plain < 0) return refuse(r, set->path, "cannot be read (damaged file?)");
    H5D_layout_t layout = H5Pget_layout(plain);
    int external = H5Pget_external_count(plain);
    H5Pclose(plain);
    hsize_t stored = H5Dget_storage_size(data);
    if ((layout != H5D_COMPACT && layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED) || external != 0)
        return refuse(r, set->path, "keeps its values in another file");
    if (stored > r->bytes || (bytes > 0 && stored == 0) ||
        (layout == H5D_CHUNKED ? bytes > LARGEST_PACKED : stored != bytes))
        return refuse(r, set->path, "holds less than it claims (cut off?)");
    return MORPH_OK;
}

static morph_status read_values(const reader *r, const morph_dataset *set, hid_t data, hsize_t entries,
                                morph_record *record) {
    bool whole = set->cell == MORPH_CELL_INT;
    void *array = morph_alloc((size_t)entries, whole ? sizeof(int) : sizeof(double));
    if (!array)
        return morph_fail(MORPH_ERR_NOMEM, r->message, r->size, "%s: %s: out of memory", r->name, set->path);
    if (entries > 0 &&
        H5Dread(data, whole ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, array) < 0) {
        free(array);
        return refuse(r, set->path, "cannot be read (damaged file?)");
    }
    morph_record_set_array(record, set, array);
    return MORPH_OK;
}

static morph_status read_dataset(reader *r, const morph_dataset *set, morph_record *record) {
    presence there = look_up(r->file, set->path);
    if (there == UNUSABLE) return refuse(r, set->path, "cannot be read (damaged file, or a link elsewhere?)");
    if (there == ABSENT) return set->required ? refuse(r, set->path, "is missing") : MORPH_OK;
    hid_t data = H5Dopen2(r->file, set->path, H5P_DEFAULT);
    if (data < 0) return refuse(r, set->path, "is no dataset that can be read");
    hid_t space = H5Dget_space(data);
    hsize_t entries = 0;
    morph_status status = space < 0 ? refuse(r, set->path, "cannot be read (damaged file?)")
                                    : check_shape(r, set, space, &entries);
    if (status == MORPH_OK) status = check_type(r, set, data);
    if (status == MORPH_OK)
        status = check_storage(r, set, data, entries * (set->cell == MORPH_CELL_INT ? 4 : 8));
    if (status == MORPH_OK) status = read_values(r, set, data, entries, record);
    if (space >= 0) H5Sclose(space);
    H5Dclose(data);
    return status;
}

static morph_status read_all(reader *r, morph_record *record) {
    morph_status status = read_root(r, record);
    if (status == MORPH_OK) status = read_spacing(r, record);
    for (int i = 0; i < morph_record_count_total; i++)
        r->known[i] = -1;
    for (int i = 0; status == MORPH_OK && i < morph_record_dataset_total; i++)
        status = read_dataset(r, &morph_record_datasets[i], record);
    if (status != MORPH_OK) return status;
    for (int i = 0; i < morph_record_count_total; i++)
        *morph_record_count(record, i) = r->known[i] < 0 ? 0 : r->known[i];
    if (record->pose_width == 0) /* no path: what one would have */
        record->pose_width = record->posts > 0 ? 6 * record->posts : 3 * record->joints;
    const char *missing = morph_record_incomplete(record);
    if (missing) return refuse(r, missing, "is missing");
    char fault[160];
    if (!morph_record_indices_hold(record, fault, sizeof fault))
        return morph_fail(MORPH_ERR_INPUT, r->message, r->size, "%s: %s", r->name, fault);
    return MORPH_OK;
}

/* Without locks: a plan on a read-only disk must open too. */
static hid_t open_file(const char *file) {
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (access < 0) return H5I_INVALID_HID;
#if H5_VERSION_GE(1, 12, 1) || (H5_VERSION_GE(1, 10, 7) && !H5_VERSION_GE(1, 12, 0))
    H5Pset_file_locking(access, false, true);
#endif
    /* Of a damaged file objects may stay open inside the library: closing the file closes them all. */
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    hid_t h5 = H5Fopen(file, H5F_ACC_RDONLY, access);
    H5Pclose(access);
    return h5;
}

morph_status morph_record_read_h5(const char *file, morph_record *record, char *message, size_t size) {
    *record = (morph_record){0};
    struct stat info;
    if (stat(file, &info) != 0)
        return morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be read: %s", file, strerror(errno));
    if (!S_ISREG(info.st_mode))
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: is not a regular file", file);
    if (access(file, R_OK) != 0)
        return morph_fail(MORPH_ERR_IO, message, size, "%s: cannot be read: %s", file, strerror(errno));
    reader r = {.name = file, .bytes = (hsize_t)info.st_size, .message = message, .size = size};
    morph_h5_quiet quiet;
    morph_h5_begin(&quiet);
    r.file = open_file(file);
    morph_status status = r.file < 0 ? morph_fail(MORPH_ERR_INPUT, message, size,
                                                  "%s: is no HDF5 file, or is cut off or damaged", file)
                                     : read_all(&r, record);
    if (r.file >= 0) H5Fclose(r.file);
    morph_h5_end(&quiet, status == MORPH_ERR_INPUT);
    if (status != MORPH_OK) morph_record_free(record);
    return status;
}

bool morph_record_is_plan(const char *file) {
    struct stat info;
    if (stat(file, &info) != 0 || !S_ISREG(info.st_mode)) return false;
    char format[64] = "";
    morph_h5_quiet quiet;
    morph_h5_begin(&quiet);
    hid_t h5 = open_file(file);
    bool plan =
        h5 >= 0 && get_text(h5, "format", format, sizeof format) && strcmp(format, MORPH_RECORD_FORMAT) == 0;
    if (h5 >= 0) H5Fclose(h5);
    morph_h5_end(&quiet, !plan);
    return plan;
}
