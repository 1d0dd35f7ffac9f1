/* Writes plan.h5. The file is built in memory and then written by our own code: HDF5 reports a full disk as
 * late as at close, and after a failed close it keeps the file open and tries again when the program ends. */
#include "planner/folder.h"
#include "planner/folder_text.h"
#include "planner/record_h5.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

static pthread_mutex_t h5_lock = PTHREAD_MUTEX_INITIALIZER;

void morph_h5_begin(morph_h5_quiet *quiet) {
    pthread_mutex_lock(&h5_lock);
    *quiet = (morph_h5_quiet){0};
    H5Eget_auto2(H5E_DEFAULT, &quiet->function, &quiet->data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

void morph_h5_end(morph_h5_quiet *quiet, bool damaged) {
    H5Eclear2(H5E_DEFAULT);
    if (!damaged) H5Eset_auto2(H5E_DEFAULT, quiet->function, quiet->data);
    pthread_mutex_unlock(&h5_lock);
}

/* Texts have variable length: h5py and MATLAB hand those out as plain strings. */
static bool put_text(hid_t at, const char *name, const char *text) {
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR), attribute = H5I_INVALID_HID;
    bool ok = type >= 0 && space >= 0 && H5Tset_size(type, H5T_VARIABLE) >= 0 &&
              H5Tset_cset(type, H5T_CSET_UTF8) >= 0;
    if (ok) attribute = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    ok = ok && attribute >= 0 && H5Awrite(attribute, type, &text) >= 0;
    if (attribute >= 0) ok = H5Aclose(attribute) >= 0 && ok;
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    return ok;
}

/* Stored types are fixed, little-endian, whatever the machine. */
static bool put_number(hid_t at, const char *name, hid_t stored, hid_t memory, const void *value) {
    hid_t space = H5Screate(H5S_SCALAR);
    if (space < 0) return false;
    hid_t attribute = H5Acreate2(at, name, stored, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, memory, value) >= 0;
    if (attribute >= 0) ok = H5Aclose(attribute) >= 0 && ok;
    H5Sclose(space);
    return ok;
}

/* NaN where the scene asks for nothing. */
static bool put_goal(hid_t file, const morph_goal *goal) {
    bool ok = true;
    for (int k = 0; k < MORPH_GOAL_KINDS && ok; k++) {
        char name[32];
        const double limit = goal->limit[k] > 0.0 ? goal->limit[k] : (double)NAN;
        snprintf(name, sizeof name, "goal_%s", morph_goal_name((morph_goal_kind)k));
        ok = put_number(file, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &limit);
    }
    return ok;
}

static bool put_root(hid_t file, const morph_record *record) {
    int version = MORPH_RECORD_VERSION;
    return put_text(file, "format", MORPH_RECORD_FORMAT) &&
           put_number(file, "version", H5T_STD_I32LE, H5T_NATIVE_INT, &version) &&
           put_text(file, "program", record->program) &&
           put_text(file, "scene_sha256", record->scene_sha256) &&
           put_text(file, "outcome", record->outcome) &&
           put_number(file, "base", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &record->base) &&
           put_goal(file, &record->goal);
}

static bool put_group(hid_t file, const char *name, const morph_record *record) {
    hid_t plain = H5Pcreate(H5P_GROUP_CREATE);
    if (plain < 0) return false;
    bool ok = H5Pset_obj_track_times(plain, false) >= 0;
    hid_t group = ok ? H5Gcreate2(file, name, H5P_DEFAULT, plain, H5P_DEFAULT) : H5I_INVALID_HID;
    ok = group >= 0;
    if (ok && strcmp(name, "structure") == 0)
        ok = put_number(group, "spacing", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &record->spacing);
    if (group >= 0) ok = H5Gclose(group) >= 0 && ok;
    H5Pclose(plain);
    return ok;
}

static bool put_dataset(hid_t file, const morph_dataset *set, const morph_record *record) {
    morph_record copy = *record; /* for the counts; its arrays are not touched */
    hsize_t shape[3] = {0}, entries = 1;
    for (int d = 0; d < set->rank; d++) {
        const morph_extent *e = &set->shape[d];
        shape[d] = (hsize_t)(e->count >= 0 ? *morph_record_count(&copy, e->count) : 1) * (hsize_t)e->times;
        entries *= shape[d];
    }
    bool whole = set->cell == MORPH_CELL_INT;
    hid_t space = H5Screate_simple(set->rank, shape, NULL), plain = H5Pcreate(H5P_DATASET_CREATE);
    hid_t data = H5I_INVALID_HID;
    bool ok = space >= 0 && plain >= 0 && H5Pset_obj_track_times(plain, false) >= 0;
    if (ok)
        data = H5Dcreate2(file, set->path, whole ? H5T_STD_I32LE : H5T_IEEE_F64LE, space, H5P_DEFAULT, plain,
                          H5P_DEFAULT);
    ok = ok && data >= 0 && put_text(data, "unit", set->unit) &&
         put_text(data, "description", set->description);
    if (ok && entries > 0)
        ok = H5Dwrite(data, whole ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                      morph_record_array(record, set)) >= 0;
    if (data >= 0) ok = H5Dclose(data) >= 0 && ok;
    if (plain >= 0) H5Pclose(plain);
    if (space >= 0) H5Sclose(space);
    return ok;
}

static bool put_all(hid_t file, const morph_record *record) {
    char group[32] = "";
    if (!put_root(file, record)) return false;
    for (int i = 0; i < morph_record_dataset_total; i++) {
        const morph_dataset *set = &morph_record_datasets[i];
        if (!set->required && !morph_record_array(record, set)) continue;
        char own[32];
        snprintf(own, sizeof own, "%.*s", (int)strcspn(set->path, "/"), set->path);
        /* The offsets belong to the group "target", which is there by then. */
        if (strcmp(own, group) != 0 && H5Lexists(file, own, H5P_DEFAULT) <= 0 &&
            !put_group(file, own, record))
            return false;
        memcpy(group, own, sizeof group);
        if (!put_dataset(file, set, record)) return false;
    }
    return H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
}

/* An empty file in memory. Superblock and object headers of version 2 and later carry checksums, so that a
 * damaged file is recognised; every HDF5 since 1.8 reads them. */
static hid_t create_image(hid_t access, hid_t plain) {
    const size_t growth = (size_t)1 << 20;
    if (access < 0 || plain < 0 || H5Pset_fapl_core(access, growth, false) < 0 ||
        H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18) < 0 ||
        H5Pset_obj_track_times(plain, false) < 0)
        return H5I_INVALID_HID;
    return H5Fcreate("plan.h5", H5F_ACC_TRUNC, plain, access);
}

static morph_status write_image(hid_t image, hid_t access, const morph_record *record, const char *file,
                                char *message, size_t size) {
    void **bytes = NULL;
    ssize_t total = -1;
    /* The core driver's handle is the address of its buffer: no second copy of a large plan. */
    if (image < 0 || !put_all(image, record) || H5Fget_vfd_handle(image, access, (void **)&bytes) < 0 ||
        !bytes || !*bytes || (total = H5Fget_file_image(image, NULL, 0)) <= 0)
        return morph_fail(MORPH_ERR_BACKEND, message, size, "%s: HDF5 failed (memory?)", file);
    return morph_file_put(file, *bytes, (size_t)total, message, size);
}

morph_status morph_record_write_h5(const morph_record *record, const char *file, char *message, size_t size) {
    char fault[160];
    const char *missing = morph_record_incomplete(record);
    if (missing)
        return morph_fail(MORPH_ERR_INTERNAL, message, size, "%s: the record lacks %s", file, missing);
    if (!morph_record_indices_hold(record, fault, sizeof fault))
        return morph_fail(MORPH_ERR_INTERNAL, message, size, "%s: the record is not sound: %s", file, fault);
    morph_h5_quiet quiet;
    morph_h5_begin(&quiet);
    hid_t access = H5Pcreate(H5P_FILE_ACCESS), plain = H5Pcreate(H5P_FILE_CREATE);
    hid_t image = create_image(access, plain);
    morph_status status = write_image(image, access, record, file, message, size);
    if (image >= 0) H5Fclose(image);
    if (plain >= 0) H5Pclose(plain);
    if (access >= 0) H5Pclose(access);
    morph_h5_end(&quiet, false);
    return status;
}
