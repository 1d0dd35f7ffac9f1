/* Tetrahedral meshes from files: which reader, and what is wrong with what it read. */
#include "planner/import_tetra.h"
#include "planner/import_tetra_private.h"

#include <ctype.h>
#include <errno.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void morph_raw_tetra_free(morph_raw_tetra *raw) {
    free(raw->v);
    free(raw->tet);
    *raw = (morph_raw_tetra){0};
}

/* ---- words and numbers ---- */

void morph_scan_blank(morph_scan *s) {
    while (s->p < s->end) {
        if (s->comments && *s->p == '#')
            while (s->p < s->end && *s->p != '\n')
                s->p++;
        else if (isspace((unsigned char)*s->p))
            s->p++;
        else
            return;
    }
}

void morph_scan_next_line(morph_scan *s) {
    const char *stop = memchr(s->p, '\n', (size_t)(s->end - s->p));
    s->p = stop ? stop + 1 : s->end;
}

bool morph_scan_line_ends(morph_scan *s) {
    while (s->p < s->end && *s->p != '\n' && isspace((unsigned char)*s->p))
        s->p++;
    return s->p == s->end || *s->p == '\n' || (s->comments && *s->p == '#');
}

/* A number ends where a word ends. */
static bool ends_here(const morph_scan *s, const char *stop) {
    return stop > s->p && stop <= s->end &&
           (stop == s->end || isspace((unsigned char)*stop) || (s->comments && *stop == '#'));
}

bool morph_scan_whole(morph_scan *s, long long *value) {
    char *stop;
    morph_scan_blank(s);
    if (s->p == s->end) return false;
    errno = 0;
    *value = strtoll(s->p, &stop, 10);
    if (errno != 0 || !ends_here(s, stop)) return false;
    s->p = stop;
    return true;
}

bool morph_scan_number(morph_scan *s, double *value) {
    char *stop;
    morph_scan_blank(s);
    if (s->p == s->end) return false;
    *value = strtod(s->p, &stop);
    if (!ends_here(s, stop)) return false;
    s->p = stop;
    return true;
}

morph_status morph_scan_count(morph_scan *s, const char *what, long long *count) {
    const morph_sentence *to = s->sentence;
    if (!morph_scan_whole(s, count) || *count < 0)
        return morph_refuse(to, "'%s' is damaged: the number of %s must be a whole number from 0 on",
                            to->name, what);
    if (*count > (s->end - s->p) / 2)
        return morph_refuse(to, "'%s' is truncated: it claims %lld %s, and %zu bytes follow", to->name,
                            *count, what, (size_t)(s->end - s->p));
    if (*count > MORPH_IMPORT_TRIANGLES)
        return morph_refuse(to, "'%s' has %lld %s; at most %d are allowed", to->name, *count, what,
                            MORPH_IMPORT_TRIANGLES);
    return MORPH_OK;
}

morph_status morph_scan_place(morph_scan *s, long long number, double v[3]) {
    const morph_sentence *to = s->sentence;
    for (int k = 0; k < 3; k++) {
        morph_scan_blank(s);
        if (s->p == s->end)
            return morph_refuse(to, "'%s' is truncated: it ends within vertex %lld", to->name, number);
        if (!morph_scan_number(s, &v[k]) || !(fabs(v[k]) <= 1e60))
            return morph_refuse(to,
                                "'%s' is damaged: vertex %lld must have three finite coordinates of at most "
                                "1e60",
                                to->name, number);
    }
    return MORPH_OK;
}

/* ---- files ---- */

static const char *ending_of(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot && !strchr(dot, '/') ? dot + 1 : "";
}

bool morph_is_tetra_file(const char *path) {
    const char *e = ending_of(path);
    return strcasecmp(e, "msh") == 0 || strcasecmp(e, "node") == 0 || strcasecmp(e, "ele") == 0;
}

/* The same name with another ending, as upper or lower case as the first letter of the old one. */
static char *with_ending(const char *name, const char *ending) {
    const size_t stem = (size_t)(ending_of(name) - name), size = stem + strlen(ending) + 1;
    char *out = morph_alloc(size, 1);
    if (!out) return NULL;
    const bool upper = isupper((unsigned char)name[stem]) != 0;
    memcpy(out, name, stem);
    for (size_t i = stem; i + 1 < size; i++)
        out[i] = (char)(upper ? toupper((unsigned char)ending[i - stem]) : ending[i - stem]);
    return out;
}

morph_status morph_tetra_sibling(const char *path, char **sibling) {
    *sibling = NULL;
    const bool node = strcasecmp(ending_of(path), "node") == 0, ele = strcasecmp(ending_of(path), "ele") == 0;
    if (!node && !ele) return MORPH_OK;
    *sibling = with_ending(path, node ? "ele" : "node");
    return *sibling ? MORPH_OK : MORPH_ERR_NOMEM;
}

typedef enum part { PART_MSH, PART_NODE, PART_ELE } part;

static morph_status read_part(const char *path, const morph_sentence *sentence, part which, int *base,
                              morph_raw_tetra *raw) {
    char *data;
    size_t size;
    morph_status status = morph_import_load(path, sentence, &data, &size);
    if (status != MORPH_OK) return status;
    morph_scan s = {data, data + size, which != PART_MSH, sentence};
    if (which == PART_MSH)
        status = morph_read_msh(&s, raw);
    else if (memchr(data, '\0', size))
        status = morph_refuse(sentence, "'%s' is no TetGen file: those are text, this has zero bytes",
                              sentence->name);
    else
        status = which == PART_NODE ? morph_read_node(&s, base, raw) : morph_read_ele(&s, *base, raw);
    free(data);
    return status;
}

static morph_status read_pair(const char *path, const morph_sentence *sentence, morph_raw_tetra *raw) {
    morph_status status = MORPH_OK;
    int base = 0;
    for (int k = 0; k < 2 && status == MORPH_OK; k++) {
        const char *ending = k == 0 ? "node" : "ele";
        char *file = with_ending(path, ending), *name = NULL;
        /* What the user wrote may have no ending of its own. */
        if (file) name = with_ending(*ending_of(sentence->name) ? sentence->name : path, ending);
        const morph_sentence to = {sentence->text, sentence->size, name};
        status =
            file && name ? read_part(file, &to, k == 0 ? PART_NODE : PART_ELE, &base, raw) : MORPH_ERR_NOMEM;
        free(file);
        free(name);
    }
    return status;
}

/* Tetrahedra are counted from 1 here, in the order of the file. */
static morph_status explain(const morph_tetra_report *r, const morph_sentence *to) {
    const int t = r->where + 1, u = r->other + 1;
    switch (r->fault) {
    case MORPH_TETRA_EMPTY:
        return morph_refuse(to, "'%s' has no tetrahedra; a deformable target needs at least one", to->name);
    case MORPH_TETRA_RANGE:
        return morph_refuse(to, "'%s' is damaged: tetrahedron %d must have four different vertices", to->name,
                            t);
    case MORPH_TETRA_FLAT:
        return morph_refuse(to, "'%s' cannot be used: tetrahedron %d has no volume; all must have some",
                            to->name, t);
    case MORPH_TETRA_CROWDED:
        return morph_refuse(to,
                            "'%s' cannot be used: tetrahedra %d and %d share a face with a third; a face has "
                            "one or two",
                            to->name, t, u);
    case MORPH_TETRA_OVERLAP:
        return morph_refuse(to,
                            "'%s' cannot be used: tetrahedra %d and %d overlap; they must lie on different "
                            "sides of their common face",
                            to->name, t, u);
    default:
        return morph_refuse(to, "'%s' has coordinates that are not finite", to->name);
    }
}

static morph_status read_file(const char *path, const morph_sentence *sentence, morph_raw_tetra *raw) {
    if (!morph_is_tetra_file(path))
        return morph_refuse(sentence, "'%s' is no tetrahedral mesh: .msh, .node and .ele are read",
                            sentence->name);
    if (strcasecmp(ending_of(path), "msh") == 0) return read_part(path, sentence, PART_MSH, NULL, raw);
    return read_pair(path, sentence, raw);
}

morph_status morph_import_tetra(const char *path, const char *name, morph_tetra *out,
                                morph_tetra_report *report, char *message, size_t message_size) {
    const morph_sentence sentence = {message, message_size, name};
    morph_raw_tetra raw = {0};
    *out = (morph_tetra){0};
    *report = (morph_tetra_report){0};
    if (message && message_size > 0) message[0] = '\0';
    /* strtod takes the decimal sign of the thread's locale: it must be a point here. */
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0) return MORPH_ERR_NOMEM;
    const locale_t before = uselocale(plain);
    morph_status status = read_file(path, &sentence, &raw);
    uselocale(before);
    freelocale(plain);
    if (status == MORPH_OK) {
        status = morph_tetra_create(raw.vertices, raw.v, raw.tets, (const int(*)[4])raw.tet, out, report);
        if (status == MORPH_ERR_INPUT) explain(report, &sentence);
    }
    morph_raw_tetra_free(&raw);
    return status;
}
