/* The CSV files of a start: lengths as a controller logs them, or the joints of a pose as a plan keeps it. */
#include "planner/folder.h"
#include "planner/folder_text.h"
#include "planner/start.h"
#include "planner/start_parts.h"

#include <stdlib.h>
#include <string.h>

static const char header[] = "joint,x_m,y_m,z_m";

static morph_status load(const char *file, char **text, size_t *total, char *message, size_t size) {
    const morph_status status = morph_file_load(file, text, total, message, size);
    return status == MORPH_ERR_IO ? morph_name_fault() : status;
}

morph_status morph_start_is_pose(const char *file, bool *pose, char *message, size_t size) {
    char *text;
    size_t total;
    *pose = false;
    const morph_status status = load(file, &text, &total, message, size);
    if (status != MORPH_OK) return status;
    *pose = total >= 5 && memcmp(text, header, 5) == 0;
    free(text);
    return MORPH_OK;
}

/* Cuts the next line off *at, its end too; NULL at the end. */
static char *next_line(char **at) {
    char *line = *at, *stop = strchr(line, '\n');
    if (!*line) return NULL;
    *at = stop ? stop + 1 : line + strlen(line);
    if (stop) *stop = '\0';
    const size_t n = strlen(line);
    if (n > 0 && line[n - 1] == '\r') line[n - 1] = '\0';
    return line;
}

/* One row: the joint's number and its place. Plain decimal numbers, finite. */
static morph_status read_row(const char *file, int joint, char *row, double *x, char *message, size_t size) {
    const int line = joint + 2;
    for (int column = 1; column <= 4; column++) {
        char *comma = strchr(row, ','), *stop;
        if ((column < 4) != (comma != NULL))
            return morph_fail(MORPH_ERR_INPUT, message, size, "%s:%d: %s columns, expected 4", file, line,
                              comma ? "more" : "fewer");
        if (comma) *comma = '\0';
        const double value = strtod(row, &stop);
        if (!*row || *stop || strspn(row, "0123456789+-.eE") != strlen(row) || !isfinite(value))
            return morph_fail(MORPH_ERR_INPUT, message, size,
                              "%s:%d: column %d: \"%.40s\" is not a number (decimal point '.', finite)", file,
                              line, column, row);
        if (column == 1 && value != joint)
            return morph_fail(MORPH_ERR_INPUT, message, size, "%s:%d: column 1: joint %.40s, expected %d",
                              file, line, row, joint);
        if (column > 1) x[column - 2] = value;
        if (comma) row = comma + 1;
    }
    return MORPH_OK;
}

static morph_status read_rows(const char *file, char *text, int joints, double *x, char *message,
                              size_t size) {
    char *at = text, *row = next_line(&at);
    if (!row || strcmp(row, header) != 0)
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s:1: the header is another, expected \"%s\"",
                          file, header);
    for (int j = 0; j < joints; j++) {
        row = next_line(&at);
        if (!row)
            return morph_fail(MORPH_ERR_INPUT, message, size, "%s:%d: ends after %d joints, expected %d",
                              file, j + 1, j, joints);
        const morph_status status = read_row(file, j, row, &x[3 * j], message, size);
        if (status != MORPH_OK) return status;
    }
    if (next_line(&at))
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s:%d: more rows than the %d joints", file,
                          joints + 2, joints);
    return MORPH_OK;
}

morph_status morph_start_read_pose(const char *file, int joints, double *x, char *message, size_t size) {
    char *text;
    size_t total;
    morph_locale locale;
    morph_status status = load(file, &text, &total, message, size);
    if (status != MORPH_OK) return status;
    if (strlen(text) != total)
        status = morph_fail(MORPH_ERR_INPUT, message, size, "%s:1: holds a zero byte: this is no text", file);
    else if (!morph_locale_enter(&locale))
        status = MORPH_ERR_NOMEM;
    else {
        status = read_rows(file, text, joints, x, message, size);
        morph_locale_leave(&locale);
    }
    free(text);
    return status;
}

morph_status morph_start_read_lengths(const char *file, int links, double **length, char *message,
                                      size_t size) {
    double *time, *all;
    int samples;
    *length = NULL;
    const morph_status status =
        morph_schedule_read_rows(file, links, 1, &time, &all, &samples, message, size);
    if (status != MORPH_OK) return status;
    *length = morph_alloc((size_t)links, sizeof(double));
    if (*length) memcpy(*length, &all[(size_t)(samples - 1) * (size_t)links], (size_t)links * sizeof *all);
    free(time);
    free(all);
    return *length ? MORPH_OK : MORPH_ERR_NOMEM;
}

static void put_lengths(morph_text *t, const morph_start *start) {
    morph_text_add(t, "time_s");
    for (int l = 0; l < start->links; l++)
        morph_text_add(t, ",link_%04d_m", l);
    morph_text_add(t, "\n0");
    for (int l = 0; l < start->links; l++) {
        morph_text_add(t, ",");
        morph_text_number(t, start->length[l]);
    }
    morph_text_add(t, "\n");
}

static void put_pose(morph_text *t, const morph_start *start) {
    morph_text_add(t, "%s\n", header);
    for (int j = 0; j < start->joints; j++) {
        morph_text_add(t, "%d", j);
        for (int c = 0; c < 3; c++) {
            morph_text_add(t, ",");
            morph_text_number(t, start->pose[3 * j + c]);
        }
        morph_text_add(t, "\n");
    }
}

morph_status morph_start_to_csv(const morph_start *start, char **text) {
    morph_text t = {0};
    morph_locale locale;
    *text = NULL;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    if (start->length)
        put_lengths(&t, start);
    else
        put_pose(&t, start);
    morph_locale_leave(&locale);
    if (t.failed) {
        morph_text_free(&t);
        return MORPH_ERR_NOMEM;
    }
    *text = t.data;
    return MORPH_OK;
}
