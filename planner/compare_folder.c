/* The folder of a comparison: compare.json and compare.html, built beside and renamed. */
#include "planner/compare.h"

#include "planner/folder_place.h"
#include "planner/folder_text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How every compare.json of ours begins. */
static bool is_comparison(const char *file) {
    static const char begin[] = "[{\n\t\"settings\":\t{\"program\": \"morphplan ";
    char read[sizeof begin] = "";
    FILE *f = fopen(file, "rb");
    if (!f) return false;
    const size_t n = fread(read, 1, sizeof begin - 1, f);
    fclose(f);
    return n == sizeof begin - 1 && memcmp(read, begin, n) == 0;
}

static const morph_place_kind comparison = {"comparison", "compare.json", is_comparison};

morph_status morph_compare_probe(const char *folder, bool overwrite, char *message, size_t size) {
    morph_place place;
    morph_status status = morph_place_find_kind(folder, overwrite, comparison, &place, message, size);
    if (status != MORPH_OK) return status;
    /* The surest question whether a folder can be made there is to make one. */
    status = morph_place_stage(&place, message, size);
    morph_place_close(&place);
    return status;
}

/* Writes what `make` gives of the comparison. */
static morph_status put(const morph_place *place, const char *name, const morph_compare *compare,
                        morph_status (*make)(const morph_compare *, char **), char *message, size_t size) {
    char *text = NULL, *path = morph_path_join(place->stage, name);
    morph_status status = path ? make(compare, &text) : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) status = morph_file_put(path, text, strlen(text), NULL, 0);
    if (status != MORPH_OK)
        morph_fail(status, message, size, "%s/%s: cannot be written: %s", place->folder, name,
                   status == MORPH_ERR_IO ? strerror(errno) : morph_status_text(status));
    free(path);
    free(text);
    return status;
}

morph_status morph_compare_write(const char *folder, bool overwrite, const morph_compare *compare,
                                 char *message, size_t size) {
    morph_place place;
    morph_status status = morph_place_find_kind(folder, overwrite, comparison, &place, message, size);
    if (status != MORPH_OK) return status;
    status = morph_place_stage(&place, message, size);
    if (status == MORPH_OK) status = put(&place, "compare.json", compare, morph_compare_json, message, size);
    if (status == MORPH_OK) status = put(&place, "compare.html", compare, morph_compare_html, message, size);
    if (status == MORPH_OK) status = morph_place_commit(&place, overwrite, message, size);
    morph_place_close(&place);
    return status;
}
