/* Fault lines: kept, sorted by line, and worded so that the fix is in the line. */
#include "planner/yaml.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A fault must stay one line whatever stood in the file or its name. */
static void make_one_line(char *text) {
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || *text == 0x7f) *text = '?';
}

static void keep(morph_faults *faults, int line, const char *text) {
    if (faults->count >= MORPH_YAML_FAULTS) {
        faults->dropped++;
        return;
    }
    if (faults->count == faults->capacity) {
        const int capacity = faults->capacity > 0 ? 2 * faults->capacity : 16;
        morph_fault *grown = realloc(faults->fault, (size_t)capacity * sizeof *grown);
        if (!grown) {
            faults->nomem = true;
            return;
        }
        faults->fault = grown;
        faults->capacity = capacity;
    }
    char *copy = strdup(text);
    if (!copy) {
        faults->nomem = true;
        return;
    }
    faults->fault[faults->count] = (morph_fault){.line = line, .order = faults->count, .text = copy};
    faults->count++;
}

/* "PATH:LINE: key: text" into faults. The path is never shortened: it is what an editor jumps to. */
static void add(morph_yaml *yaml, morph_faults *faults, int line, const char *key, const char *format,
                va_list args) {
    char text[1600];
    vsnprintf(text, sizeof text, format, args);
    const size_t size = strlen(yaml->path) + strlen(key) + strlen(text) + 32;
    char *all = malloc(size);
    if (!all) {
        faults->nomem = true;
        return;
    }
    snprintf(all, size, "%s:%d: %s: %s", yaml->path, line, key, text);
    make_one_line(all);
    keep(faults, line, all);
    free(all);
}

void morph_fault_add(morph_yaml *yaml, int line, const char *key, const char *format, ...) {
    va_list args;
    va_start(args, format);
    add(yaml, &yaml->faults, line, key, format, args);
    va_end(args);
}

static int value_line(const morph_value *value) {
    if (value->node && value->node->type == YAML_SCALAR_NODE && !morph_value_is_empty(value))
        return (int)value->node->start_mark.line + 1;
    return value->line;
}

void morph_value_fault(const morph_value *value, const char *format, ...) {
    va_list args;
    va_start(args, format);
    add(value->yaml, &value->yaml->faults, value_line(value), value->path, format, args);
    va_end(args);
}

void morph_value_warn(const morph_value *value, const char *format, ...) {
    va_list args;
    va_start(args, format);
    add(value->yaml, &value->yaml->warnings, value_line(value), value->path, format, args);
    va_end(args);
}

void morph_value_later(const morph_value *value, const char *what) {
    morph_value_fault(value, "not available yet: %s: %s", value->path, what);
}

static int by_line(const void *a, const void *b) {
    const morph_fault *p = a, *q = b;
    if (p->line != q->line) return p->line < q->line ? -1 : 1;
    return p->order < q->order ? -1 : p->order > q->order;
}

void morph_faults_sort(morph_faults *faults) {
    if (faults->count == 0) return;
    qsort(faults->fault, (size_t)faults->count, sizeof *faults->fault, by_line);
    if (faults->dropped > 0) {
        /* Takes the place of the last line, which counts among those left out. */
        morph_fault *last = &faults->fault[faults->count - 1];
        const char *end = strstr(last->text, ": ");
        const int head = end ? (int)(end - last->text) : 0;
        char *text = malloc((size_t)head + 64);
        if (!text) {
            faults->nomem = true;
            return;
        }
        snprintf(text, (size_t)head + 64, "%.*s: scene: %d more faults are not shown", head, last->text,
                 faults->dropped + 1);
        free(last->text);
        last->text = text;
        faults->dropped = 0;
    }
}

void morph_faults_free(morph_faults *faults) {
    for (int k = 0; k < faults->count; k++)
        free(faults->fault[k].text);
    free(faults->fault);
    *faults = (morph_faults){0};
}

enum { WORD = 40 };

static int lower(char c) {
    return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c;
}

/* Edits (insert, drop, replace, swap neighbours) between two words shorter than WORD: optimal string
 * alignment, D[i][j] from the three rows before. */
static int edits(const char *a, const char *b) {
    int row[3][WORD + 1];
    const int n = (int)strlen(a), m = (int)strlen(b);
    for (int j = 0; j <= m; j++)
        row[0][j] = j;
    for (int i = 1; i <= n; i++) {
        int *now = row[i % 3], *last = row[(i + 2) % 3], *before = row[(i + 1) % 3];
        now[0] = i;
        for (int j = 1; j <= m; j++) {
            const int differs = lower(a[i - 1]) != lower(b[j - 1]);
            int best = last[j - 1] + differs;
            if (last[j] + 1 < best) best = last[j] + 1;
            if (now[j - 1] + 1 < best) best = now[j - 1] + 1;
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]) &&
                before[j - 2] + 1 < best)
                best = before[j - 2] + 1;
            now[j] = best;
        }
    }
    return row[n % 3][m];
}

static bool starts_with(const char *word, const char *start) {
    for (; *start; word++, start++)
        if (lower(*word) != lower(*start)) return false;
    return true;
}

const char *morph_closest_name(const char *word, const char *const *names, int count) {
    const size_t length = strlen(word);
    if (length < 2 || length >= WORD) return NULL;
    /* One edit in three letters: "hight" and "thicknes" are caught, "mode" is not taken for "node s". */
    int best = (int)length / 3 + 1;
    if (best > 3) best = 3;
    const char *found = NULL;
    for (int k = 0; k < count; k++) {
        if (strlen(names[k]) >= WORD) continue;
        const int d = edits(word, names[k]);
        if (d < best) {
            best = d;
            found = names[k];
        }
    }
    /* A clear abbreviation or its opposite: "accel", "damping_factor". */
    for (int k = 0; k < count && !found && length >= 3; k++)
        if (starts_with(names[k], word) || (strlen(names[k]) >= 4 && starts_with(word, names[k])))
            found = names[k];
    return found;
}

void morph_join_names(const char *const *names, int count, char *text, size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int k = 0; k < count && used < size; k++) {
        const int n = snprintf(text + used, size - used, "%s%s", k ? ", " : "", names[k]);
        used += n > 0 ? (size_t)n : 0;
    }
}
