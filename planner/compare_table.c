/* The comparison as an aligned table. */
#include "planner/compare.h"

#include "planner/folder_text.h"

#include <stdio.h>
#include <string.h>

enum { COLUMNS = 9, CELL = 24 };

/* One line of a table; the last text is free and stands to the left. */
typedef struct line {
    char cell[COLUMNS][CELL];
    const char *state, *more;
} line;

static const char *const heads[COLUMNS] = {"method",     "objective",   "cavity m3", "mean gap", "target gap",
                                           "coverage %", "x reference", "seconds",   ""};

static void number(char cell[CELL], const char *format, double value) {
    if (isnan(value))
        snprintf(cell, CELL, "-");
    else {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        snprintf(cell, CELL, format, value);
#pragma GCC diagnostic pop
    }
}

static void fill_row(const morph_compare_result *result, morph_compare_method method, line *l) {
    const morph_compare_row *row = &result->row[method];
    *l = (line){.state = row->outcome, .more = row->reason};
    snprintf(l->cell[0], CELL, "%s", morph_compare_name(method));
    for (int q = 0; q < MORPH_COMPARE_QUANTITIES; q++)
        number(l->cell[1 + q], "%.4g", morph_compare_value(result, method, (morph_compare_quantity)q));
    number(l->cell[5], "%.1f", row->measured ? 100.0 * row->measure.coverage : (double)NAN);
    number(l->cell[6], "%.4g",
           morph_compare_ratio(result, method, MORPH_COMPARE_REFERENCE, MORPH_COMPARE_OBJECTIVE));
    number(l->cell[7], "%.1f", row->seconds);
}

/* Widths from heads and cells; the first column to the left, numbers to the right. */
static void put_lines(morph_text *text, const line *lines, int count, const char *const head[COLUMNS],
                      int columns) {
    int width[COLUMNS] = {0};
    for (int c = 0; c < columns; c++) {
        width[c] = (int)strlen(head[c]);
        for (int k = 0; k < count; k++)
            if ((int)strlen(lines[k].cell[c]) > width[c]) width[c] = (int)strlen(lines[k].cell[c]);
    }
    for (int k = -1; k < count; k++) {
        for (int c = 0; c < columns; c++) {
            const char *cell = k < 0 ? head[c] : lines[k].cell[c];
            if (c == 0)
                morph_text_add(text, "%-*s", width[c], cell);
            else
                morph_text_add(text, "  %*s", width[c], cell);
        }
        if (k < 0 && lines[0].state) morph_text_add(text, "  outcome");
        if (k >= 0 && lines[k].state)
            morph_text_add(text, "  %s%s%s", lines[k].state, lines[k].more[0] ? ": " : "", lines[k].more);
        morph_text_add(text, "\n");
    }
}

static void put_scene(morph_text *text, const morph_compare_result *result) {
    line lines[MORPH_COMPARE_METHODS];
    const morph_scene *s = result->scene;
    int count = 0;
    for (int m = 0; m < MORPH_COMPARE_METHODS; m++)
        if (result->row[m].listed) fill_row(result, (morph_compare_method)m, &lines[count++]);
    morph_text_add(text, "%s: %d x %d nodes, spacing h = %.4g m\n", s->file, s->structure.nodes[0],
                   s->structure.nodes[1], s->structure.spacing);
    put_lines(text, lines, count, heads, 8);
    morph_text_add(text, "\n");
}

static void put_medians(morph_text *text, const morph_compare *c) {
    static const char *const head[COLUMNS] = {"median ratio", "objective", "cavity", "mean gap", "target gap",
                                              "less covered", "feasible",  "scenes", ""};
    line lines[MORPH_COMPARE_METHODS];
    int count = 0;
    for (int m = 0; m < MORPH_COMPARE_METHODS; m++) {
        if (!c->result[0].row[m].listed) continue;
        const morph_compare_median median = morph_compare_medians(c, (morph_compare_method)m);
        line *l = &lines[count++];
        *l = (line){0};
        snprintf(l->cell[0], CELL, "%s", morph_compare_name((morph_compare_method)m));
        for (int q = 0; q < MORPH_COMPARE_QUANTITIES; q++)
            number(l->cell[1 + q], "%.3g", median.ratio[q]);
        snprintf(l->cell[5], CELL, "%d", median.coverage_lower);
        snprintf(l->cell[6], CELL, "%d", median.feasible);
        snprintf(l->cell[7], CELL, "%d", median.scenes);
    }
    put_lines(text, lines, count, head, 8);
}

morph_status morph_compare_text(const morph_compare *c, char **out) {
    *out = NULL;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    morph_text text = {0};
    for (int k = 0; k < c->scenes; k++)
        put_scene(&text, &c->result[k]);
    put_medians(&text, c);
    morph_text_add(&text,
                   "\nobjective in h^4, gaps in h; x reference: objective over the reference's, which is a "
                   "local optimum, not a proven bound\n"
                   "medians: of the ratios to the pure blanket, over the scenes where there is a shape, "
                   "feasible or not; less covered: scenes\n");
    if (c->stopped)
        morph_text_add(&text, "stopped: rows so marked, and medians without them, are not the whole\n");
    morph_locale_leave(&locale);
    if (text.failed) {
        morph_text_free(&text);
        return MORPH_ERR_NOMEM;
    }
    *out = text.data;
    return MORPH_OK;
}
