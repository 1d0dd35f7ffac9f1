/* What a PLY header claims, walked through to the end, list by list. */
#include "planner/import_private.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PROPERTIES = 64, MOST_ELEMENTS = 32 };

typedef struct property {
    int size;  /* bytes of a value (of a list: of its entries) */
    int count; /* bytes of a list's count; 0: a scalar */
} property;

typedef struct element {
    unsigned long long count;
    int properties;
    property property[MOST_PROPERTIES];
} element;

typedef enum format { FORMAT_NONE, FORMAT_TEXT, FORMAT_LITTLE, FORMAT_BIG } format;

typedef struct header {
    format format;
    int elements;
    element element[MOST_ELEMENTS];
} header;

/* The next word of a line, copied; false at the line's end. */
static bool word(const char **p, const char *end, char out[32]) {
    while (*p < end && **p != '\n' && isspace((unsigned char)**p))
        (*p)++;
    int n = 0;
    while (*p < end && !isspace((unsigned char)**p)) {
        if (n < 31) out[n++] = **p;
        (*p)++;
    }
    out[n] = '\0';
    return n > 0;
}

static int type_size(const char *type) {
    static const struct {
        const char *name;
        int size;
    } types[] = {{"char", 1},  {"uchar", 1},  {"int8", 1},    {"uint8", 1},  {"short", 2}, {"ushort", 2},
                 {"int16", 2}, {"uint16", 2}, {"int", 4},     {"uint", 4},   {"int32", 4}, {"uint32", 4},
                 {"float", 4}, {"double", 8}, {"float32", 4}, {"float64", 8}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (strcmp(type, types[i].name) == 0) return types[i].size;
    return 0;
}

static bool read_property(const char **p, const char *end, header *h) {
    char w[32];
    if (h->elements == 0 || !word(p, end, w)) return false;
    element *e = h->element + h->elements - 1;
    if (e->properties == MOST_PROPERTIES) return false;
    property q = {0, 0};
    if (strcmp(w, "list") == 0) {
        /* Counts are whole numbers. */
        if (!word(p, end, w) || (q.count = type_size(w)) == 0 || w[0] == 'f' || w[0] == 'd') return false;
        if (!word(p, end, w)) return false;
    }
    if ((q.size = type_size(w)) == 0) return false;
    e->property[e->properties++] = q;
    return true;
}

static bool read_element(const char **p, const char *end, header *h) {
    char w[32], *stop;
    if (h->elements == MOST_ELEMENTS || !word(p, end, w) || !word(p, end, w)) return false;
    if (!isdigit((unsigned char)w[0])) return false;
    h->element[h->elements] = (element){.count = strtoull(w, &stop, 10)};
    h->elements++;
    return *stop == '\0';
}

/* Returns the first byte behind the header, or NULL. *line: where it went wrong. */
static const char *read_header(const char *data, const char *end, header *h, int *line) {
    const char *p = data;
    char w[32];
    *line = 1;
    if (!word(&p, end, w) || strcmp(w, "ply") != 0) return NULL;
    while (p < end) {
        const char *next = memchr(p, '\n', (size_t)(end - p));
        if (!next) return NULL;
        p = next + 1;
        ++*line;
        if (!word(&p, end, w)) continue;
        if (strcmp(w, "end_header") == 0) {
            next = memchr(p, '\n', (size_t)(end - p));
            return h->format == FORMAT_NONE ? NULL : next ? next + 1 : end;
        }
        bool ok = true;
        if (strcmp(w, "format") == 0) {
            ok = word(&p, end, w);
            h->format = strcmp(w, "ascii") == 0                  ? FORMAT_TEXT
                        : strcmp(w, "binary_little_endian") == 0 ? FORMAT_LITTLE
                        : strcmp(w, "binary_big_endian") == 0    ? FORMAT_BIG
                                                                 : FORMAT_NONE;
            ok = ok && h->format != FORMAT_NONE;
        } else if (strcmp(w, "element") == 0)
            ok = read_element(&p, end, h);
        else if (strcmp(w, "property") == 0)
            ok = read_property(&p, end, h);
        if (!ok) return NULL;
    }
    return NULL;
}

/* A list's count of 1, 2 or 4 bytes; a negative one comes out huge. */
static unsigned long long binary_count(const char *p, int bytes, format f) {
    unsigned long long n = 0;
    for (int i = 0; i < bytes; i++)
        n |= (unsigned long long)(unsigned char)p[f == FORMAT_LITTLE ? i : bytes - 1 - i] << (8 * i);
    return n;
}

/* Walks one binary element instance; NULL where the file ends before. */
static const char *walk_binary(const char *p, const char *end, const element *e, format f) {
    for (int i = 0; i < e->properties; i++) {
        const property q = e->property[i];
        unsigned long long n = 1;
        if (q.count > 0) {
            if (end - p < q.count) return NULL;
            n = binary_count(p, q.count, f);
            p += q.count;
        }
        if (n > (unsigned long long)(end - p) / (unsigned)q.size) return NULL;
        p += n * (unsigned)q.size;
    }
    return p;
}

static const char *skip_token(const char *p, const char *end) {
    while (p < end && isspace((unsigned char)*p))
        p++;
    if (p == end) return NULL;
    while (p < end && !isspace((unsigned char)*p))
        p++;
    return p;
}

static const char *walk_text(const char *p, const char *end, const element *e) {
    for (int i = 0; i < e->properties && p; i++) {
        unsigned long long n = 1;
        if (e->property[i].count > 0) {
            while (p < end && isspace((unsigned char)*p))
                p++;
            if (p == end || !isdigit((unsigned char)*p)) return NULL;
            n = strtoull(p, NULL, 10);
            p = skip_token(p, end);
            /* Each entry is a digit and a blank at least. */
            if (!p || n > (unsigned long long)(end - p) / 2 + 1) return NULL;
        }
        for (; n > 0 && p; n--)
            p = skip_token(p, end);
    }
    return p;
}

morph_status morph_import_ply_claims(const char *data, size_t size, const morph_sentence *to) {
    header *h = calloc(1, sizeof *h);
    if (!h) return MORPH_ERR_NOMEM;
    int line = 0;
    const char *end = data + size, *p = read_header(data, end, h, &line);
    morph_status status = MORPH_OK;
    if (!p)
        status = morph_refuse(to, "'%s' is no PLY file, or its header is damaged at line %d", to->name, line);
    for (int i = 0; i < h->elements && status == MORPH_OK; i++) {
        const element *e = h->element + i;
        /* Any instance takes a byte at least, so this bounds the walk as well. */
        if (e->count > (size_t)(end - p) || (e->properties == 0 && e->count > 0)) p = NULL;
        for (unsigned long long k = 0; k < e->count && p; k++)
            p = h->format == FORMAT_TEXT ? walk_text(p, end, e) : walk_binary(p, end, e, h->format);
        if (!p)
            status =
                morph_refuse(to,
                             "'%s' is truncated or damaged: its header claims more (%llu elements of the "
                             "kind numbered %d) than its %zu bytes hold",
                             to->name, e->count, i + 1, size);
    }
    free(h);
    return status;
}
