/* compare.html: the same numbers as the table, with bars. No scripts, no fonts and no files from elsewhere:
 * the policy makes the browser hold the page to that. */
#include "planner/compare.h"

#include "planner/folder_text.h"

#include <string.h>

static const char page_head[] =
    "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
    "'unsafe-inline'\">\n"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Comparison</title>\n"
    "<style>\n"
    "body{font:16px/1.5 system-ui,-apple-system,\"Segoe UI\",\"DejaVu Sans\",sans-serif;color:#21262e;"
    "background:#fff;max-width:1240px;margin:0 auto;padding:24px 28px 60px}\n"
    "h1{font-size:28px;margin:0 0 4px}h2{font-size:19px;margin:36px 0 2px}\n"
    ".soft{color:#626a75;font-size:14px;margin:2px 0 10px}\n"
    ".warning{background:#fff6e0;border-left:6px solid #c98a06;padding:8px 18px;border-radius:4px}\n"
    "table{border-collapse:collapse;width:100%}th,td{padding:6px 10px;border-bottom:1px solid #e3e6ea;"
    "text-align:left;vertical-align:top}th{font-size:13px;color:#626a75;font-weight:600}\n"
    ".n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap;min-width:84px}\n"
    ".note{display:block;font-size:13px;color:#626a75}.no{color:#9a1f18;font-weight:700}.yes{color:#166540}\n"
    ".bar{display:block;height:6px;border-radius:3px;background:#0d5e9e;margin:4px 0 0 auto}\n"
    ".blanket .bar{background:#8a919b}.reference .bar{background:#e67d21}\n"
    "@media print{body{max-width:none;padding:0}h2{break-after:avoid}tr{break-inside:avoid}}\n"
    "</style>\n</head>\n<body>\n";

static void number(morph_text *page, const char *before, double value, const char *after) {
    if (isnan(value))
        morph_text_add(page, "&ndash;");
    else
        morph_text_add(page, "%s%.4g%s", before, value, after);
}

/* A number over a bar that is as long as its part of the largest in the column. */
static void bar_cell(morph_text *page, const morph_compare_result *r, morph_compare_method method,
                     morph_compare_quantity q) {
    double most = 0.0;
    for (int m = 0; m < MORPH_COMPARE_METHODS; m++)
        most = fmax(most, morph_compare_value(r, (morph_compare_method)m, q)); /* NaN counts as missing */
    const double value = morph_compare_value(r, method, q);
    morph_text_add(page, "<td class=\"n\">");
    number(page, "", value, "");
    if (most > 0.0 && value >= 0.0)
        morph_text_add(page, "<span class=\"bar\" style=\"width:%.1f%%\"></span>", 100.0 * value / most);
    morph_text_add(page, "</td>");
}

static void put_row(morph_text *page, const morph_compare_result *r, morph_compare_method method) {
    const morph_compare_row *row = &r->row[method];
    morph_text_add(page, "<tr class=\"%s\"><td>%s<span class=\"note\">", morph_compare_name(method),
                   morph_compare_name(method));
    morph_text_html(page, morph_compare_meaning(method));
    morph_text_add(page, "</span></td>");
    for (int q = 0; q < MORPH_COMPARE_QUANTITIES; q++)
        bar_cell(page, r, method, (morph_compare_quantity)q);
    morph_text_add(page, "<td class=\"n\">");
    number(page, "", row->measured ? 100.0 * row->measure.coverage : (double)NAN, "&nbsp;%");
    morph_text_add(page, "</td><td class=\"n\">");
    number(page, "", morph_compare_ratio(r, method, MORPH_COMPARE_REFERENCE, MORPH_COMPARE_OBJECTIVE), "");
    morph_text_add(page, "</td><td class=\"n\">%.1f&nbsp;s</td><td class=\"%s\">", row->seconds,
                   row->feasible ? "yes" : "no");
    morph_text_html(page, row->outcome);
    morph_text_add(page, "<span class=\"note\">");
    morph_text_html(page, row->reason);
    morph_text_add(page, "</span></td></tr>\n");
}

static void put_scene(morph_text *page, const morph_compare_result *r) {
    const morph_scene *s = r->scene;
    morph_text_add(page, "<h2>");
    morph_text_html(page, s->title && s->title[0] ? s->title : s->file);
    morph_text_add(page, "</h2>\n<p class=\"soft\">");
    morph_text_html(page, s->file);
    morph_text_add(page, "; %d x %d nodes, spacing h = %.4g m</p>\n", s->structure.nodes[0],
                   s->structure.nodes[1], s->structure.spacing);
    morph_text_add(
        page,
        "<table>\n<tr><th>Method</th><th class=\"n\">Objective, h&#8308;</th><th class=\"n\">Cavity, "
        "m&sup3;</th><th class=\"n\">Mean gap, h</th><th class=\"n\">Target gap, h</th><th "
        "class=\"n\">Coverage</th><th class=\"n\">Objective / reference</th><th "
        "class=\"n\">Time</th><th>Outcome</th></tr>\n");
    for (int m = 0; m < MORPH_COMPARE_METHODS; m++)
        if (r->row[m].listed) put_row(page, r, (morph_compare_method)m);
    morph_text_add(page, "</table>\n");
}

static void put_medians(morph_text *page, const morph_compare *c) {
    morph_text_add(
        page,
        "<h2>Medians of the ratios to the pure blanket</h2>\n<p class=\"soft\">Over the scenes where "
        "the method has a shape, feasible or not.</p>\n<table>\n<tr><th>Method</th><th "
        "class=\"n\">Objective</th><th class=\"n\">Cavity</th><th class=\"n\">Mean gap</th><th "
        "class=\"n\">Target gap</th><th class=\"n\">Scenes covered less</th><th "
        "class=\"n\">Feasible</th><th class=\"n\">Scenes</th></tr>\n");
    for (int m = 0; m < MORPH_COMPARE_METHODS; m++) {
        if (!c->result[0].row[m].listed) continue;
        const morph_compare_median median = morph_compare_medians(c, (morph_compare_method)m);
        morph_text_add(page, "<tr><td>%s</td>", morph_compare_name((morph_compare_method)m));
        for (int q = 0; q < MORPH_COMPARE_QUANTITIES; q++) {
            morph_text_add(page, "<td class=\"n\">");
            number(page, "", median.ratio[q], "");
            morph_text_add(page, "</td>");
        }
        morph_text_add(page,
                       "<td class=\"n\">%d</td><td class=\"n\">%d</td><td class=\"n\">%d of %d</td></tr>\n",
                       median.coverage_lower, median.feasible, median.scenes, c->scenes);
    }
    morph_text_add(page, "</table>\n");
}

morph_status morph_compare_html(const morph_compare *c, char **text) {
    *text = NULL;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    morph_text page = {0};
    morph_text_put(&page, page_head, sizeof page_head - 1);
    morph_text_add(
        &page,
        "<h1>Methods side by side</h1>\n<p class=\"soft\">morphplan %s. The objective sums squared "
        "gaps over the skin and over the target; h is the spacing of the nodes. The reference "
        "solves for the same objective without limits of length and angle: a local optimum, not a "
        "proven bound. Bars compare the methods of one scene.</p>\n",
        MORPH_VERSION);
    if (c->stopped)
        morph_text_add(&page,
                       "<p class=\"warning\">Stopped before it was done: rows so marked, and medians "
                       "without them, are not the whole.</p>\n");
    put_medians(&page, c);
    for (int k = 0; k < c->scenes; k++)
        put_scene(&page, &c->result[k]);
    morph_text_add(&page, "</body>\n</html>\n");
    morph_locale_leave(&locale);
    if (page.failed) {
        morph_text_free(&page);
        return MORPH_ERR_NOMEM;
    }
    *text = page.data;
    return MORPH_OK;
}
