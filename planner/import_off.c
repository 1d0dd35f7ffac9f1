/* OFF: "OFF" with prefixes, three counts, then a line for each vertex and each face. */
#include "planner/import_private.h"

#include <ctype.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>

void morph_polygons_free(morph_polygons *polygons) {
    free(polygons->v);
    free(polygons->n);
    free(polygons->corner);
    *polygons = (morph_polygons){0};
}

/* Skips blanks and comments. */
static const char *skip(const char *p, const char *end) {
    while (p < end) {
        if (*p == '#')
            while (p < end && *p != '\n')
                p++;
        else if (isspace((unsigned char)*p))
            p++;
        else
            break;
    }
    return p;
}

static const char *next_line(const char *p, const char *end) {
    const char *stop = memchr(p, '\n', (size_t)(end - p));
    return stop ? stop + 1 : end;
}

/* A count before `end`, or false where none stands there. */
static bool count_at(const char **p, const char *end, unsigned long long *count) {
    *p = skip(*p, end);
    if (*p >= end || !isdigit((unsigned char)**p)) return false;
    char *stop;
    *count = strtoull(*p, &stop, 10);
    *p = stop;
    return true;
}

/* The two counts; *p moves to the first line behind. Bounded by the file's size: the shortest vertex line is
 * "0 0 0", the shortest face line "1 0". */
static morph_status read_head(const char **p, const char *end, size_t size, const morph_sentence *to,
                              unsigned long long *vertices, unsigned long long *faces) {
    const char *word = *p = skip(*p, end);
    unsigned long long edges;
    while (*p < end && isalnum((unsigned char)**p))
        (*p)++;
    if (*p - word < 3 || strncmp(*p - 3, "OFF", 3) != 0)
        return morph_refuse(to, "'%s' is no OFF file: that begins with 'OFF'", to->name);
    if (memchr(word, '4', (size_t)(*p - word)) || memchr(word, 'n', (size_t)(*p - word)))
        return morph_refuse(to, "'%s' is an OFF file of more than three dimensions", to->name);
    *p = skip(*p, end);
    if (end - *p >= 6 && strncmp(*p, "BINARY", 6) == 0)
        return morph_refuse(to, "'%s' is a binary OFF file; only text ones are read", to->name);
    if (!count_at(p, end, vertices) || !count_at(p, end, faces))
        return morph_refuse(to, "'%s' has no counts of vertices and faces after 'OFF'", to->name);
    if (*vertices > size / 5 || *faces > size / 3)
        return morph_refuse(to,
                            "'%s' is truncated: its header claims %llu vertices and %llu faces, the file has "
                            "%zu bytes",
                            to->name, *vertices, *faces, size);
    /* The count of edges may be missing; nobody uses it. */
    (void)count_at(p, next_line(*p, end), &edges);
    return MORPH_OK;
}

/* Normals, colours and texture coordinates may follow the position. */
static bool read_vertex(const char *p, const char *end, double v[3]) {
    for (int k = 0; k < 3; k++) {
        char *stop;
        while (p < end && (*p == ' ' || *p == '\t'))
            p++;
        if (p >= end || isspace((unsigned char)*p)) return false;
        v[k] = strtod(p, &stop);
        if (stop == p || stop > end) return false;
        p = stop;
    }
    return true;
}

/* The number of corners, and as many numbers of vertices; colours may follow. */
static bool read_face(const char *p, const char *end, int vertices, int *n, int *corner, size_t room) {
    unsigned long long corners, at;
    if (!count_at(&p, end, &corners) || corners > room) return false;
    *n = (int)corners;
    for (int i = 0; i < *n; i++) {
        if (!count_at(&p, end, &at) || at >= (unsigned long long)vertices) return false;
        corner[i] = (int)at;
    }
    return true;
}

static morph_status read_lines(const char *p, const char *end, size_t room, const morph_sentence *to,
                               morph_polygons *q) {
    size_t used = 0;
    for (int i = 0; i < q->vertices + q->polygons; i++) {
        const int face = i - q->vertices;
        p = skip(p, end);
        if (p >= end)
            return morph_refuse(
                to,
                "'%s' is truncated: its header claims %d vertices and %d faces, it ends after "
                "%d of these lines",
                to->name, q->vertices, q->polygons, i);
        const char *next = next_line(p, end);
        if (face < 0 && !read_vertex(p, next, q->v + 3 * i))
            return morph_refuse(to, "'%s' is damaged: vertex %d has no three numbers", to->name, i);
        if (face >= 0) {
            if (!read_face(p, next, q->vertices, q->n + face, q->corner + used, room - used))
                return morph_refuse(to,
                                    "'%s' is damaged: face %d is no count and numbers of vertices below %d",
                                    to->name, face, q->vertices);
            used += (size_t)q->n[face];
        }
        p = next;
    }
    return MORPH_OK;
}

morph_status morph_import_off(const char *data, size_t size, const morph_sentence *sentence,
                              morph_polygons *out) {
    *out = (morph_polygons){0};
    const char *p = data, *end = data + size;
    unsigned long long vertices, faces;
    morph_status status = read_head(&p, end, size, sentence, &vertices, &faces);
    if (status != MORPH_OK) return status;
    /* A corner is a digit and a blank at least. */
    const size_t room = (size_t)(end - p) / 2 + 1;
    morph_polygons q = {.vertices = (int)vertices, .polygons = (int)faces};
    q.v = morph_alloc(3 * (size_t)vertices, sizeof *q.v);
    q.n = morph_alloc((size_t)faces, sizeof *q.n);
    q.corner = morph_alloc(room, sizeof *q.corner);
    /* strtod takes the decimal sign of the thread's locale: it must be a point here. */
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (q.v && q.n && q.corner && plain != (locale_t)0) {
        const locale_t before = uselocale(plain);
        status = read_lines(p, end, room, sentence, &q);
        uselocale(before);
    } else
        status = MORPH_ERR_NOMEM;
    if (plain != (locale_t)0) freelocale(plain);
    if (status == MORPH_OK)
        *out = q;
    else
        morph_polygons_free(&q);
    return status;
}
