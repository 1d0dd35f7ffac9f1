/* Files into memory, and whether their headers claim more than there is. */
#include "planner/import_private.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

morph_status morph_refuse(const morph_sentence *to, const char *format, ...) {
    if (to->text && to->size > 0) {
        va_list args;
        va_start(args, format);
        vsnprintf(to->text, to->size, format, args);
        va_end(args);
    }
    return MORPH_ERR_INPUT;
}

static morph_status refuse_errno(const morph_sentence *to, int error) {
    char why[128] = "unknown error";
    if (error == ENOENT || error == ENOTDIR)
        return morph_refuse(to, "'%s' does not exist (files are found relative to the scene)", to->name);
    if (strerror_r(error, why, sizeof why) != 0) snprintf(why, sizeof why, "error %d", error);
    return morph_refuse(to, "'%s' cannot be read: %s", to->name, why);
}

static morph_status read_all(int file, size_t size, const morph_sentence *sentence, char *data) {
    size_t done = 0;
    while (done < size) {
        const ssize_t n = read(file, data + done, size - done);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return refuse_errno(sentence, errno);
        if (n == 0) return morph_refuse(sentence, "'%s' became shorter while it was read", sentence->name);
        done += (size_t)n;
    }
    return MORPH_OK;
}

/* Opened without blocking: a pipe without a writer must not hang the program. */
morph_status morph_import_load(const char *path, const morph_sentence *sentence, char **data, size_t *size) {
    *data = NULL;
    *size = 0;
    struct stat info;
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) return refuse_errno(sentence, errno);
    morph_status status = MORPH_OK;
    if (fstat(file, &info) != 0)
        status = refuse_errno(sentence, errno);
    else if (S_ISDIR(info.st_mode))
        status = morph_refuse(sentence, "'%s' is a directory, not a file", sentence->name);
    else if (!S_ISREG(info.st_mode))
        status = morph_refuse(sentence, "'%s' is not a regular file", sentence->name);
    else if (info.st_size == 0)
        status = morph_refuse(sentence, "'%s' is empty", sentence->name);
    else if ((unsigned long long)info.st_size > MORPH_IMPORT_BYTES)
        status = morph_refuse(sentence, "'%s' has %.0f MiB; at most %llu MiB are read", sentence->name,
                              (double)info.st_size / 1048576, MORPH_IMPORT_BYTES >> 20);
    char *bytes = NULL;
    if (status == MORPH_OK) {
        bytes = malloc((size_t)info.st_size + 1);
        status = bytes ? read_all(file, (size_t)info.st_size, sentence, bytes) : MORPH_ERR_NOMEM;
    }
    close(file);
    if (status != MORPH_OK) {
        free(bytes);
        return status;
    }
    bytes[info.st_size] = '\0';
    *data = bytes;
    *size = (size_t)info.st_size;
    return MORPH_OK;
}

/* ---- STL ---- */

/* Only what a text file holds, in its first bytes. */
static bool textual(const char *data, size_t size) {
    const size_t n = size < 512 ? size : 512;
    for (size_t i = 0; i < n; i++) {
        const unsigned char c = (unsigned char)data[i];
        if (c < 0x20 && !isspace(c)) return false;
        if (c >= 0x7f && c < 0xa0) return false;
    }
    return true;
}

static const char *next_line(const char *p, const char *end) {
    const char *stop = memchr(p, '\n', (size_t)(end - p));
    return stop ? stop + 1 : end;
}

static uint32_t little32(const char *data) {
    const unsigned char *b = (const unsigned char *)data;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* The first word of a line is `word`. *p moves behind it. */
static bool starts(const char **p, const char *word) {
    const char *q = *p;
    while (*q == ' ' || *q == '\t')
        q++;
    const size_t n = strlen(word);
    if (strncmp(q, word, n) != 0 || (q[n] && !isspace((unsigned char)q[n]))) return false;
    *p = q + n;
    return true;
}

/* Three words that look like numbers, on one line. */
static bool three_numbers(const char *p) {
    for (int k = 0; k < 3; k++) {
        while (*p == ' ' || *p == '\t')
            p++;
        const char *q = p + (*p == '-' || *p == '+');
        if (!isdigit((unsigned char)*q) && !(*q == '.' && isdigit((unsigned char)q[1]))) return false;
        while (*p && !isspace((unsigned char)*p))
            p++;
    }
    return true;
}

/* Text: solids of facets of three vertices. A file that stops in the middle would be read up to there. */
static morph_status stl_text(const char *data, size_t size, const morph_sentence *to) {
    const char *end = data + size;
    bool inside = false;
    int vertices = 0, line = 1;
    for (const char *p = data; p < end; p = next_line(p, end), line++) {
        const char *q = p;
        if (starts(&q, "solid"))
            inside = true;
        else if (starts(&q, "endsolid"))
            inside = false;
        else if (starts(&q, "facet"))
            vertices = 0;
        else if (starts(&q, "vertex")) {
            vertices++;
            if (!three_numbers(q))
                return morph_refuse(to, "'%s' is damaged: line %d has no three numbers", to->name, line);
        } else if (starts(&q, "endfacet") && vertices != 3)
            return morph_refuse(to, "'%s' is damaged: the facet that ends in line %d has %d vertices, not 3",
                                to->name, line, vertices);
    }
    if (inside) return morph_refuse(to, "'%s' is truncated: its last 'endsolid' is missing", to->name);
    return MORPH_OK;
}

/* Binary: 80 bytes of anything, the number of triangles, 50 bytes each. */
static morph_status stl_claims(const char *data, size_t *size, const morph_sentence *to) {
    if (textual(data, *size)) {
        const char *p = data;
        while (isspace((unsigned char)*p))
            p++;
        if (strncmp(p, "solid", 5) == 0) return stl_text(data, *size, to);
        return morph_refuse(to, "'%s' is text but no STL file: that begins with 'solid'", to->name);
    }
    if (*size < 84)
        return morph_refuse(to, "'%s' is no STL file: a binary one has at least 84 bytes, this has %zu",
                            to->name, *size);
    const uint32_t claimed = little32(data + 80);
    const unsigned long long need = 84 + 50ull * claimed;
    if (need > *size)
        return morph_refuse(to,
                            "'%s' is truncated or no STL file: its header claims %lu triangles (%llu bytes), "
                            "the file has %zu bytes",
                            to->name, (unsigned long)claimed, need, *size);
    if (claimed > MORPH_IMPORT_TRIANGLES)
        return morph_refuse(to, "'%s' has %lu triangles; at most %d are allowed", to->name,
                            (unsigned long)claimed, MORPH_IMPORT_TRIANGLES);
    *size = (size_t)need;
    return MORPH_OK;
}

morph_status morph_import_claims(const char *ending, const char *data, size_t *size,
                                 const morph_sentence *sentence) {
    if (strcmp(ending, "stl") == 0) return stl_claims(data, size, sentence);
    if (strcmp(ending, "ply") == 0) return morph_import_ply_claims(data, *size, sentence);
    if (strcmp(ending, "gltf") == 0) return morph_import_gltf_claims(data, *size, false, sentence);
    if (strcmp(ending, "glb") == 0) return morph_import_gltf_claims(data, *size, true, sentence);
    return MORPH_OK;
}
