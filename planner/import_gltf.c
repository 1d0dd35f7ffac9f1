/* What a glTF file claims: views within buffers, accessors within views, nodes that form trees. assimp trusts
 * these: a false view makes it allocate what the view claims, and a node among its own descendants never
 * ends. */
#include "planner/import_private.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

/* Deeper trees would recurse too deep; real ones stay below a hundred. */
enum { MOST_DEPTH = 500 };

static uint32_t little32(const char *data) {
    const unsigned char *b = (const unsigned char *)data;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* A whole number in [0, 2^53], the default where the key is missing, -1 where it is anything else. */
static double whole(const cJSON *object, const char *key, double fallback) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    if (!item) return fallback;
    const double x = item->valuedouble;
    if (!cJSON_IsNumber(item) || !(x >= 0) || x > 9007199254740992.0 || x != floor(x)) return -1;
    return x;
}

static const cJSON *list(const cJSON *root, const char *key) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(root, key);
    return cJSON_IsArray(item) ? item : NULL;
}

/* The k-th child's pointer in constant time: cJSON's arrays are linked lists. Free the result. */
static const cJSON **index_of(const cJSON *array, int *count) {
    *count = array ? cJSON_GetArraySize(array) : 0;
    const cJSON **out = morph_alloc((size_t)*count, sizeof *out);
    int i = 0;
    const cJSON *item;
    if (out && array) cJSON_ArrayForEach(item, array) out[i++] = item;
    return out;
}

/* Lengths of the buffers, or false. Embedded data cannot exceed the file, other files the limit. */
static bool buffer_lengths(const cJSON *root, size_t size, double *length, double *total) {
    const cJSON *item;
    int i = 0;
    *total = (double)size;
    cJSON_ArrayForEach(item, list(root, "buffers")) {
        const cJSON *uri = cJSON_GetObjectItemCaseSensitive(item, "uri");
        const bool embedded = !cJSON_IsString(uri) || strncmp(uri->valuestring, "data:", 5) == 0;
        const double n = whole(item, "byteLength", -1);
        if (n < 0 || n > (embedded ? (double)size : (double)MORPH_IMPORT_BYTES)) return false;
        length[i++] = n;
        *total += n;
    }
    return true;
}

static bool views_fit(const cJSON *root, const double *buffer, int buffers, double *view) {
    const cJSON *item;
    int i = 0;
    cJSON_ArrayForEach(item, list(root, "bufferViews")) {
        const double b = whole(item, "buffer", -1), at = whole(item, "byteOffset", 0),
                     n = whole(item, "byteLength", -1);
        if (b < 0 || b >= buffers || at < 0 || n < 0 || at + n > buffer[(int)b]) return false;
        view[i++] = n;
    }
    return true;
}

/* Each element takes a byte at least; assimp itself compares the exact sizes with the view. Accessors
 * without a view (zeros, sparse) are bounded by all bytes there are. */
static bool accessors_fit(const cJSON *root, const double *view, int views, double total) {
    const cJSON *item;
    cJSON_ArrayForEach(item, list(root, "accessors")) {
        const double v = whole(item, "bufferView", views), n = whole(item, "count", -1),
                     at = whole(item, "byteOffset", 0);
        if (v < 0 || v > views || n < 0 || at < 0) return false;
        if (at + n > (v < views ? view[(int)v] : total)) return false;
    }
    return true;
}

static bool data_fits(const cJSON *root, size_t size, bool *memory) {
    const int buffers = cJSON_GetArraySize(list(root, "buffers")),
              views = cJSON_GetArraySize(list(root, "bufferViews"));
    double *buffer = morph_alloc((size_t)buffers, sizeof *buffer), total = 0;
    double *view = morph_alloc((size_t)views, sizeof *view);
    *memory = buffer && view;
    const bool fits = *memory && buffer_lengths(root, size, buffer, &total) &&
                      views_fit(root, buffer, buffers, view) && accessors_fit(root, view, views, total);
    free(buffer);
    free(view);
    return fits;
}

/* Every node has one parent at most, and the way up from each ends, soon. */
static bool nodes_form_trees(const cJSON *root, bool *memory) {
    int count;
    const cJSON **node = index_of(list(root, "nodes"), &count), *child;
    int *parent = morph_alloc((size_t)count, sizeof *parent);
    bool sound = *memory = node && parent;
    for (int i = 0; i < count && sound; i++)
        parent[i] = -1;
    for (int i = 0; i < count && sound; i++)
        cJSON_ArrayForEach(child, list(node[i], "children")) {
            const double c = child->valuedouble;
            if (!cJSON_IsNumber(child) || !(c >= 0) || c >= count || c != floor(c) || parent[(int)c] >= 0) {
                sound = false;
                break;
            }
            parent[(int)c] = i;
        }
    for (int i = 0; i < count && sound; i++) {
        int depth = 0;
        for (int up = parent[i]; up >= 0 && depth <= MOST_DEPTH; up = parent[up])
            depth++;
        sound = depth <= MOST_DEPTH;
    }
    free((void *)node);
    free(parent);
    return sound;
}

static morph_status json_claims(const char *json, size_t length, size_t size, const morph_sentence *to) {
    cJSON *root = cJSON_ParseWithLength(json, length);
    if (!root) return morph_refuse(to, "'%s' is no glTF file: its JSON cannot be read", to->name);
    const cJSON *asset = cJSON_GetObjectItemCaseSensitive(root, "asset");
    const cJSON *version = cJSON_GetObjectItemCaseSensitive(asset, "version");
    morph_status status = MORPH_OK;
    bool memory = true;
    if (!cJSON_IsString(version) || strncmp(version->valuestring, "2.", 2) != 0)
        status = morph_refuse(to, "'%s' is no glTF file of version 2", to->name);
    else if (!data_fits(root, size, &memory))
        status = !memory ? MORPH_ERR_NOMEM
                         : morph_refuse(to,
                                        "'%s' is damaged: its buffers, views or accessors claim more than "
                                        "there is",
                                        to->name);
    else if (!nodes_form_trees(root, &memory))
        status = !memory ? MORPH_ERR_NOMEM
                         : morph_refuse(to, "'%s' is damaged: its nodes form no trees", to->name);
    cJSON_Delete(root);
    return status;
}

/* Binary: magic, version, length; then chunks of length, type, bytes, the first of them the JSON. */
morph_status morph_import_gltf_claims(const char *data, size_t size, bool binary, const morph_sentence *to) {
    if (!binary) return json_claims(data, size, size, to);
    if (size < 20 || memcmp(data, "glTF", 4) != 0 || memcmp(data + 16, "JSON", 4) != 0)
        return morph_refuse(to, "'%s' is no binary glTF file", to->name);
    for (size_t at = 12; at < size;) {
        if (size - at < 8 || little32(data + at) > size - at - 8)
            return morph_refuse(to, "'%s' is truncated: its chunks claim more than its %zu bytes", to->name,
                                size);
        at += 8 + little32(data + at);
    }
    if (little32(data + 8) > size)
        return morph_refuse(to, "'%s' is truncated: its header claims %lu bytes, the file has %zu", to->name,
                            (unsigned long)little32(data + 8), size);
    return json_claims(data + 20, little32(data + 12), size, to);
}
