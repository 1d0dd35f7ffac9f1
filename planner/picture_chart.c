/* Lengths over time: axes with round ticks, limits dashed. */
#include "planner/picture_parts.h"

#include "model/structure.h"

#include <stdio.h>
#include <stdlib.h>

enum { LABEL = 13, TITLE = 15 };

double morph_text_width(cairo_t *c, const char *text, double size, bool bold) {
    cairo_text_extents_t extents;
    cairo_select_font_face(c, "sans", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c, size);
    cairo_text_extents(c, text, &extents);
    return extents.x_advance;
}

void morph_put_text(cairo_t *c, const char *text, double x, double y, double size, double ax, bool bold,
                    morph_colour colour) {
    double width = morph_text_width(c, text, size, bold);
    cairo_new_path(c);
    cairo_move_to(c, x - ax * width, y);
    morph_set_colour(c, colour, 1);
    cairo_show_text(c, text);
    cairo_new_path(c);
}

double morph_ticks(double lo, double hi, int wanted, double *first, int *count, int *digits) {
    double range = hi - lo;
    *first = lo;
    *count = 1;
    *digits = 0;
    if (!(range > 0) || !isfinite(range) || wanted < 1) return 1;
    double power = pow(10, floor(log10(range / wanted))), step = 10 * power;
    if (range / power <= 2 * wanted)
        step = 2 * power;
    else if (range / power <= 5 * wanted)
        step = 5 * power;
    if (range / power <= wanted) step = power;
    /* Ticks within a rounding error of the ends belong to the axis. */
    double from = ceil(lo / step - 1e-9), to = floor(hi / step + 1e-9);
    *first = from * step;
    *count = (int)(to - from) + 1;
    *digits = (int)fmin(fmax(ceil(-log10(step) - 1e-9), 0), 9);
    return step;
}

typedef struct chart {
    cairo_t *c;
    morph_box area; /* inside the axes */
    double lo[2], hi[2];
} chart;

static double paper_x(const chart *k, double t) {
    return k->area.x + k->area.width * (t - k->lo[0]) / (k->hi[0] - k->lo[0]);
}

static double paper_y(const chart *k, double v) {
    return k->area.y + k->area.height * (1 - (v - k->lo[1]) / (k->hi[1] - k->lo[1]));
}

static void draw_axes(const chart *k, const char *title, const char *left) {
    cairo_t *c = k->c;
    const morph_box *a = &k->area;
    double first;
    int count, digits;
    char text[48];
    cairo_set_line_width(c, 0.8);
    double step = morph_ticks(k->lo[0], k->hi[0], 8, &first, &count, &digits);
    for (int i = 0; i < count; i++) {
        double x = paper_x(k, first + i * step);
        cairo_set_source_rgb(c, 0.91, 0.92, 0.93);
        cairo_move_to(c, x, a->y);
        cairo_line_to(c, x, a->y + a->height);
        cairo_stroke(c);
        snprintf(text, sizeof text, "%.*f", digits, first + i * step);
        morph_put_text(c, text, x, a->y + a->height + 18, LABEL, 0.5, false, morph_colour_text);
    }
    step = morph_ticks(k->lo[1], k->hi[1], 6, &first, &count, &digits);
    for (int i = 0; i < count; i++) {
        double y = paper_y(k, first + i * step);
        cairo_set_source_rgb(c, 0.91, 0.92, 0.93);
        cairo_move_to(c, a->x, y);
        cairo_line_to(c, a->x + a->width, y);
        cairo_stroke(c);
        snprintf(text, sizeof text, "%.*f", digits, first + i * step);
        morph_put_text(c, text, a->x - 8, y + 0.36 * LABEL, LABEL, 1, false, morph_colour_text);
    }
    cairo_set_line_width(c, 1);
    morph_set_colour(c, morph_colour_faint, 1);
    cairo_rectangle(c, a->x, a->y, a->width, a->height);
    cairo_stroke(c);
    morph_put_text(c, "time [s]", a->x + a->width / 2, a->y + a->height + 38, LABEL, 0.5, false,
                   morph_colour_text);
    morph_put_text(c, title, a->x, a->y - 12, TITLE, 0, true, morph_colour_text);
    cairo_save(c);
    cairo_translate(c, a->x - 60, a->y + a->height / 2);
    cairo_rotate(c, -M_PI / 2);
    morph_put_text(c, left, 0, 0, LABEL, 0.5, false, morph_colour_text);
    cairo_restore(c);
}

/* Dashed, with its name inside the axes, above the line or below it. */
static void draw_limit(const chart *k, double value, const char *name, bool above) {
    cairo_t *c = k->c;
    const double dash[2] = {7, 5};
    char text[80];
    double y = paper_y(k, value);
    cairo_save(c);
    cairo_set_dash(c, dash, 2, 0);
    cairo_set_line_width(c, 1.5);
    morph_set_colour(c, morph_colour_limit, 1);
    cairo_move_to(c, k->area.x, y);
    cairo_line_to(c, k->area.x + k->area.width, y);
    cairo_stroke(c);
    cairo_restore(c);
    snprintf(text, sizeof text, "%s %.6g m", name, value);
    morph_put_text(c, text, k->area.x + k->area.width - 8, above ? y - 6 : y + LABEL + 3, LABEL - 1, 1, false,
                   morph_colour_limit);
}

/* One link's curve by at most `points` of its samples, the last one always among them. */
static void trace(const chart *k, const morph_motion *m, int links, int link, int points) {
    int last = m->frames - 1, n = last < points ? last : points;
    for (int i = 0; i <= n; i++) {
        size_t f = n > 0 ? (size_t)((long long)last * i / n) : 0;
        cairo_line_to(k->c, paper_x(k, m->time[f]), paper_y(k, m->lengths[f * (size_t)links + (size_t)link]));
    }
}

static chart open_chart(cairo_t *c, const morph_motion *m, const morph_box *box, double lo, double hi) {
    double pad = 0.10 * (hi - lo);
    if (!(pad > 0)) pad = fmax(fabs(hi), 1e-3) * 0.1;
    double from = m->frames > 0 ? m->time[0] : 0, to = m->frames > 0 ? m->time[m->frames - 1] : 1;
    if (!(to > from)) to = from + 1;
    return (chart){.c = c,
                   .area = {box->x + 78, box->y + 30, box->width - 96, box->height - 78},
                   .lo = {from, lo - pad},
                   .hi = {to, hi + pad}};
}

static double travel(const morph_motion *m, int links, int link) {
    double lo = INFINITY, hi = -INFINITY;
    for (size_t f = 0; f < (size_t)m->frames; f++) {
        double value = m->lengths[f * (size_t)links + (size_t)link];
        lo = fmin(lo, value);
        hi = fmax(hi, value);
    }
    return hi - lo;
}

int morph_middle_link(const morph_record *record, const morph_motion *motion) {
    double centre[2] = {0, 0}, best = -INFINITY;
    int link = 0;
    if (motion->frames == 0) return 0;
    for (size_t i = 0; i < (size_t)record->joints; i++)
        for (size_t k = 0; k < 2; k++)
            centre[k] += motion->joints[3 * i + k] / record->joints;
    for (int l = 0; l < record->links; l++) {
        const double *a = motion->joints + 3 * (size_t)record->link[l][0];
        const double *b = motion->joints + 3 * (size_t)record->link[l][1];
        double d = hypot((a[0] + b[0]) / 2 - centre[0], (a[1] + b[1]) / 2 - centre[1]);
        if (record->link_kind[l] != MORPH_LINK_BOTTOM || d > 2 * record->spacing) continue;
        double t = travel(motion, record->links, l);
        /* A micrometre per metre in hand: the first of symmetric links, whatever the rounding. */
        if (t <= best + 1e-6 * record->spacing) continue;
        best = t;
        link = l;
    }
    return link;
}

morph_status morph_draw_length(cairo_t *c, const morph_record *record, const morph_motion *motion,
                               const morph_box *box) {
    if (record->links == 0 || motion->frames == 0) return MORPH_OK;
    int link = morph_middle_link(record, motion);
    const double *limit = record->length_limit[link];
    double lo = limit[0], hi = limit[1];
    for (size_t f = 0; f < (size_t)motion->frames; f++) { /* the best of a failed run may pass a limit */
        double value = motion->lengths[f * (size_t)record->links + (size_t)link];
        lo = fmin(lo, value);
        hi = fmax(hi, value);
    }
    const int *a = record->joint_node[record->link[link][0]], *b = record->joint_node[record->link[link][1]];
    char title[128];
    snprintf(title, sizeof title, "Length of link %d, (%d,%d) to (%d,%d), bottom layer", link, a[0], a[1],
             b[0], b[1]);
    chart k = open_chart(c, motion, box, lo, hi);
    draw_axes(&k, title, "length [m]");
    draw_limit(&k, limit[0], "shortest", false);
    draw_limit(&k, limit[1], "longest", true);
    cairo_set_line_width(c, 2.4);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    morph_set_colour(c, morph_colour_bottom, 1);
    trace(&k, motion, record->links, link, 600);
    cairo_stroke(c);
    return MORPH_OK;
}

/* Dark violet over green to yellow, evenly in lightness; f in [0, 1]. */
static morph_colour ramp(double f) {
    static const double stop[5][3] = {
        {0.27, 0.05, 0.38}, {0.22, 0.32, 0.55}, {0.13, 0.56, 0.55}, {0.38, 0.76, 0.35}, {0.88, 0.77, 0.11}};
    double at = 4 * fmin(fmax(f, 0), 1);
    int k = at >= 4 ? 3 : (int)at;
    double g = at - k;
    return (morph_colour){stop[k][0] + g * (stop[k + 1][0] - stop[k][0]),
                          stop[k][1] + g * (stop[k + 1][1] - stop[k][1]),
                          stop[k][2] + g * (stop[k + 1][2] - stop[k][2])};
}

typedef struct ranked {
    double end;
    int link;
} ranked;

static int by_end(const void *a, const void *b) {
    const ranked *p = a, *q = b;
    if (p->end != q->end) return p->end < q->end ? -1 : 1;
    return (p->link > q->link) - (p->link < q->link);
}

morph_status morph_draw_lengths(cairo_t *c, const morph_record *record, const morph_motion *motion,
                                const morph_box *box) {
    int links = record->links, frames = motion->frames;
    if (links == 0 || frames == 0) return MORPH_OK;
    ranked *order = morph_alloc((size_t)links, sizeof *order);
    if (!order) return MORPH_ERR_NOMEM;
    double lo = INFINITY, hi = -INFINITY, least = INFINITY, most = -INFINITY;
    for (int l = 0; l < links; l++) {
        order[l] = (ranked){motion->lengths[(size_t)(frames - 1) * (size_t)links + (size_t)l], l};
        least = fmin(least, record->length_limit[l][0]);
        most = fmax(most, record->length_limit[l][1]);
    }
    for (size_t i = 0; i < (size_t)frames * (size_t)links; i++) {
        lo = fmin(lo, motion->lengths[i]);
        hi = fmax(hi, motion->lengths[i]);
    }
    qsort(order, (size_t)links, sizeof *order, by_end);
    char title[96];
    snprintf(title, sizeof title, "All %d links, coloured by their final length", links);
    chart k = open_chart(c, motion, box, fmin(lo, least), fmax(hi, most));
    draw_axes(&k, title, "length [m]");
    /* Enough points for a smooth line, few enough that a page stays small. */
    int points = links > 600 ? 24 : links < 90 ? 160 : 14400 / links;
    double from = order[0].end, range = order[links - 1].end - from;
    cairo_set_line_width(c, links > 200 ? 0.8 : 1.1);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    for (int l = 0; l < links; l++) {
        morph_set_colour(c, ramp(range > 0 ? (order[l].end - from) / range : 0.5), 0.8);
        trace(&k, motion, links, order[l].link, points);
        cairo_stroke(c);
    }
    draw_limit(&k, least, "shortest", false);
    draw_limit(&k, most, "longest", true);
    free(order);
    return MORPH_OK;
}
