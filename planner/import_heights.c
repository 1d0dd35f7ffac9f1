/* Height maps: a text table of numbers separated by commas, semicolons or blanks, perhaps with a header row.
 */
#include "planner/import_private.h"

#include <ctype.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>

typedef struct table {
    double *z;
    size_t used, room;
    int rows, columns;
    char separator; /* ',', ';' or ' '; 0: not known yet */
} table;

static char separator_of(const char *line, const char *end) {
    if (memchr(line, ';', (size_t)(end - line))) return ';';
    return memchr(line, ',', (size_t)(end - line)) ? ',' : ' ';
}

/* The next field of a line, blanks and quotation marks stripped: [*b, *e). False behind the last one. */
static bool field(const char **p, const char *end, char separator, const char **b, const char **e,
                  bool *quoted) {
    if (*p > end) return false;
    const char *q = *p;
    while (q < end && (*q == ' ' || *q == '\t'))
        q++;
    *b = q;
    while (q < end && (separator == ' ' ? !isspace((unsigned char)*q) : *q != separator))
        q++;
    *e = q;
    while (*e > *b && isspace((unsigned char)(*e)[-1]))
        (*e)--;
    *quoted = *e - *b >= 2 && **b == '"' && (*e)[-1] == '"';
    if (*quoted) {
        (*b)++;
        (*e)--;
    }
    /* Blanks between fields may repeat; behind the last one the line ends. */
    if (separator == ' ')
        while (q < end && (*q == ' ' || *q == '\t'))
            q++;
    *p = separator == ' ' && q < end ? q : q + 1;
    return true;
}

/* A finite decimal number that fills the field. */
static bool number(const char *b, const char *e, double *value) {
    if (b == e || isspace((unsigned char)*b)) return false;
    for (const char *c = b; c < e; c++)
        if (!isdigit((unsigned char)*c) && !strchr("+-.eE", *c)) return false;
    char *stop;
    *value = strtod(b, &stop);
    return stop == e && isfinite(*value);
}

static morph_status push(table *t, double value) {
    if (t->used == t->room) {
        const size_t room = 2 * t->room + 1024;
        double *z = realloc(t->z, room * sizeof *z);
        if (!z) return MORPH_ERR_NOMEM;
        t->z = z;
        t->room = room;
    }
    t->z[t->used++] = value;
    return MORPH_OK;
}

/* Names of columns: no field is a plain number (quoted ones count as names). */
static bool is_header(const char *line, const char *end, char separator) {
    const char *b, *e;
    double value;
    bool quoted;
    while (field(&line, end, separator, &b, &e, &quoted))
        if (!quoted && number(b, e, &value)) return false;
    return true;
}

static morph_status read_row(table *t, const char *line, const char *end, int at, const morph_sentence *to) {
    const char *b, *e;
    bool quoted;
    int n = 0;
    while (field(&line, end, t->separator, &b, &e, &quoted)) {
        double value;
        n++;
        if (!number(b, e, &value)) {
            const int shown = e - b > 24 ? 24 : (int)(e - b);
            return morph_refuse(to, "'%s' line %d, field %d: '%.*s' is no finite number", to->name, at, n,
                                shown, b);
        }
        /* A cell of the grid becomes two triangles. */
        if (2 * t->used > MORPH_IMPORT_TRIANGLES)
            return morph_refuse(to, "'%s' has more than the %d heights that are allowed", to->name,
                                MORPH_IMPORT_TRIANGLES / 2);
        if (push(t, value) != MORPH_OK) return MORPH_ERR_NOMEM;
    }
    if (t->rows == 0) t->columns = n;
    if (n != t->columns)
        return morph_refuse(to, "'%s' line %d has %d numbers where the rows before have %d", to->name, at, n,
                            t->columns);
    t->rows++;
    return MORPH_OK;
}

static morph_status read_table(const char *p, const char *stop, table *t, const morph_sentence *to) {
    bool first = true;
    /* Byte order mark of some spreadsheet programs. */
    if (stop - p >= 3 && memcmp(p, "\xef\xbb\xbf", 3) == 0) p += 3;
    for (int at = 1; p < stop; at++) {
        const char *end = memchr(p, '\n', (size_t)(stop - p)), *line = p;
        if (!end) end = stop;
        p = end + 1;
        while (end > line && isspace((unsigned char)end[-1]))
            end--;
        while (line < end && isspace((unsigned char)*line))
            line++;
        if (line == end || *line == '#') continue;
        if (memchr(line, '\0', (size_t)(end - line)))
            return morph_refuse(to, "'%s' line %d is no text; a height map is a table of numbers", to->name,
                                at);
        if (first) t->separator = separator_of(line, end);
        const bool header = first && is_header(line, end, t->separator);
        first = false;
        if (header) continue;
        const morph_status status = read_row(t, line, end, at, to);
        if (status != MORPH_OK) return status;
    }
    if (t->rows < 2 || t->columns < 2)
        return morph_refuse(to, "'%s' has %d rows of %d numbers; a height map needs at least 2 of 2",
                            to->name, t->rows, t->columns);
    return MORPH_OK;
}

morph_status morph_import_heights(const char *path, const morph_sentence *sentence, double **z, int *rows,
                                  int *columns) {
    *z = NULL;
    *rows = *columns = 0;
    char *data;
    size_t size;
    morph_status status = morph_import_load(path, sentence, &data, &size);
    if (status != MORPH_OK) return status;
    table t = {0};
    /* strtod takes the decimal sign of the thread's locale: it must be a point here. */
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain != (locale_t)0) {
        const locale_t before = uselocale(plain);
        status = read_table(data, data + size, &t, sentence);
        uselocale(before);
        freelocale(plain);
    } else
        status = MORPH_ERR_NOMEM;
    free(data);
    if (status != MORPH_OK) {
        free(t.z);
        return status;
    }
    *z = t.z;
    *rows = t.rows;
    *columns = t.columns;
    return MORPH_OK;
}
