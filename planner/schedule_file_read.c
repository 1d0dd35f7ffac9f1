/* Reads a schedule.csv, ours or what a controller logged. The first fault ends it, with file and line. */
#include "planner/folder.h"
#include "planner/folder_text.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct csv {
    const char *file;
    char *at, *end; /* what is left */
    int least;      /* rows wanted */
    int line;       /* of the row in hand, from 1 */
    char *row;      /* the row in hand, ends in 0 */
    char *message;
    size_t size;
} csv;

/* Takes the next line, without its end ("\n" or "\r\n"); false at the end of the file. */
static bool next_row(csv *c) {
    if (c->at >= c->end) return false;
    c->row = c->at;
    char *stop = memchr(c->at, '\n', (size_t)(c->end - c->at));
    c->at = stop ? stop + 1 : c->end;
    if (!stop) stop = c->end;
    *stop = 0; /* the loaded text has a byte for this at its end */
    if (stop > c->row && stop[-1] == '\r') stop[-1] = 0;
    c->line++;
    return true;
}

static morph_status fault(const csv *c, const char *what, const char *field) {
    return morph_fail(MORPH_ERR_INPUT, c->message, c->size, "%s:%d: %s%s%.40s%s", c->file, c->line, what,
                      field ? ": \"" : "", field ? field : "", field ? "\"" : "");
}

static int count_fields(const char *row) {
    int n = 1;
    for (; *row; row++)
        n += *row == ',';
    return n;
}

/* Cuts the next field off *rest. */
static char *next_field(char **rest) {
    char *field = *rest, *comma = strchr(field, ',');
    if (comma) *comma = 0;
    *rest = comma ? comma + 1 : field + strlen(field);
    while (*field == ' ' || *field == '\t')
        field++;
    size_t n = strlen(field);
    while (n > 0 && (field[n - 1] == ' ' || field[n - 1] == '\t'))
        field[--n] = 0;
    return field;
}

static morph_status read_header(csv *c, int links) {
    if (!next_row(c)) {
        c->line = 1;
        return fault(c, "is empty; a header row \"time_s,link_0000_m,...\" is expected", NULL);
    }
    int columns = count_fields(c->row);
    char *rest = c->row, expected[32];
    for (int k = -1; k < links && k < columns - 1; k++) {
        char *field = next_field(&rest);
        if (k < 0)
            snprintf(expected, sizeof expected, "time_s");
        else
            snprintf(expected, sizeof expected, "link_%04d_m", k);
        if (strcmp(field, expected) != 0)
            return morph_fail(MORPH_ERR_INPUT, c->message, c->size,
                              "%s:%d: column %d is \"%.40s\", expected \"%s\"", c->file, c->line, k + 2,
                              field, expected);
    }
    if (columns != links + 1)
        return morph_fail(MORPH_ERR_INPUT, c->message, c->size,
                          "%s:%d: %d columns, expected %d (time and %d links)", c->file, c->line, columns,
                          links + 1, links);
    return MORPH_OK;
}

/* Plain decimal numbers only: strtod alone would take "nan", "inf" and hexadecimal. */
static bool read_number(const char *field, double *value) {
    if (!*field || strspn(field, "0123456789+-.eE") != strlen(field)) return false;
    char *stop;
    *value = strtod(field, &stop);
    return *stop == 0 && isfinite(*value);
}

static morph_status read_row(csv *c, int links, double *time, double *length) {
    int columns = count_fields(c->row);
    if (columns != links + 1)
        return morph_fail(MORPH_ERR_INPUT, c->message, c->size, "%s:%d: %d columns, expected %d", c->file,
                          c->line, columns, links + 1);
    char *rest = c->row;
    for (int k = -1; k < links; k++) {
        char *field = next_field(&rest);
        if (!read_number(field, k < 0 ? time : &length[k]))
            return morph_fail(MORPH_ERR_INPUT, c->message, c->size,
                              "%s:%d: column %d: \"%.40s\" is not a number (decimal point '.', finite)",
                              c->file, c->line, k + 2, field);
        if (k >= 0 && length[k] <= 0)
            return morph_fail(MORPH_ERR_INPUT, c->message, c->size,
                              "%s:%d: column %d: %s is not a length (must be above 0)", c->file, c->line,
                              k + 2, field);
    }
    return MORPH_OK;
}

static morph_status read_rows(csv *c, int links, double *time, double *length, int *samples) {
    int n = 0;
    while (next_row(c)) {
        if (c->row[0] == 0) { /* blank lines are allowed at the end only */
            int line = c->line;
            while (next_row(c))
                if (c->row[0] != 0) {
                    c->line = line;
                    return fault(c, "blank line between samples", NULL);
                }
            break;
        }
        morph_status status = read_row(c, links, &time[n], length + (size_t)n * (size_t)links);
        if (status != MORPH_OK) return status;
        if (n > 0 && time[n] <= time[n - 1]) return fault(c, "column 1: time does not increase", NULL);
        n++;
    }
    if (n < c->least)
        return fault(c, c->least > 1 ? "at least two samples are needed" : "at least one row is needed",
                     NULL);
    *samples = n;
    return MORPH_OK;
}

static morph_status parse(csv *c, int links, double **time, double **length, int *samples) {
    size_t rows = 1;
    for (const char *p = c->at; p < c->end; p++) {
        rows += *p == '\n';
        if (*p == 0) {
            c->line = (int)(rows < INT_MAX ? rows : INT_MAX);
            return fault(c, "holds a zero byte: this is no text", NULL);
        }
    }
    if (rows >= INT_MAX) return fault(c, "has too many lines", NULL);
    morph_status status = read_header(c, links);
    if (status != MORPH_OK) return status;
    /* A row of fewer than two bytes per column is refused when it is reached, so the file's own size bounds
     * the memory that lines without content could claim. */
    size_t most = (size_t)(c->end - c->at) / (2 * (size_t)links + 1) + 2;
    if (rows > most) rows = most;
    *time = morph_alloc(rows, sizeof **time);
    *length = morph_alloc(rows, (size_t)(links > 0 ? links : 1) * sizeof **length);
    if (!*time || !*length)
        return morph_fail(MORPH_ERR_NOMEM, c->message, c->size, "%s: out of memory", c->file);
    return read_rows(c, links, *time, *length, samples);
}

morph_status morph_schedule_read(const char *file, int links, double **time, double **length, int *samples,
                                 char *message, size_t size) {
    return morph_schedule_read_rows(file, links, 2, time, length, samples, message, size);
}

morph_status morph_schedule_read_rows(const char *file, int links, int least, double **time, double **length,
                                      int *samples, char *message, size_t size) {
    *time = NULL;
    *length = NULL;
    *samples = 0;
    if (links < 0) return morph_fail(MORPH_ERR_INTERNAL, message, size, "%s: no links", file);
    char *text;
    size_t total;
    morph_status status = morph_file_load(file, &text, &total, message, size);
    if (status == MORPH_ERR_IO) status = morph_name_fault();
    if (status != MORPH_OK) return status;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) {
        free(text);
        return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", file);
    }
    /* Spreadsheets put a byte order mark first. */
    size_t mark = total >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    csv c = {.file = file,
             .least = least,
             .at = text + mark,
             .end = text + total,
             .message = message,
             .size = size};
    status = parse(&c, links, time, length, samples);
    morph_locale_leave(&locale);
    free(text);
    if (status != MORPH_OK) {
        free(*time);
        free(*length);
        *time = *length = NULL;
        *samples = 0;
    }
    return status;
}
