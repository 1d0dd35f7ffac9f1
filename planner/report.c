/* report.html: one page that opens anywhere, without a network. */
#include "planner/report.h"

#include "planner/picture.h"
#include "planner/report_parts.h"

#include <stdlib.h>
#include <string.h>

/* No scripts, no fonts and no files from elsewhere: the policy makes the browser hold the page to that. */
static const char page_head[] =
    "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
    "img-src data:\">\n"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";

static const char page_style[] =
    "<style>\n"
    "body{font:16px/1.5 system-ui,-apple-system,\"Segoe UI\",\"DejaVu Sans\",sans-serif;color:#21262e;"
    "background:#fff;max-width:1240px;margin:0 auto;padding:24px 28px 60px}\n"
    "h1{font-size:28px;margin:0 0 4px}h2{font-size:19px;margin:36px 0 10px}\n"
    ".soft{color:#626a75;font-size:14px}\n"
    ".outcome{border-left:6px solid;border-radius:4px;padding:12px 18px;margin:18px 0}\n"
    ".outcome strong{font-size:20px}.outcome p{margin:4px 0}\n"
    ".good{border-color:#1d7d4f;background:#edf7f1}.good strong{color:#166540}\n"
    ".bad{border-color:#b3261e;background:#fcefee}.bad>strong{color:#9a1f18}\n"
    ".warning{background:#fff6e0;border-left:6px solid #c98a06;padding:8px 18px;border-radius:4px}\n"
    "table{border-collapse:collapse;width:100%}th,td{padding:6px 10px;border-bottom:1px solid #e3e6ea;"
    "text-align:left;vertical-align:top}th{font-size:13px;color:#626a75;font-weight:600}\n"
    ".n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}\n"
    ".note{display:block;font-size:13px;color:#626a75}\n"
    ".yes{color:#166540}.no{color:#9a1f18;font-weight:700}\n"
    ".grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(430px,1fr));gap:14px}\n"
    "figure{margin:0}figure svg{width:100%;height:auto;display:block}\n"
    "figcaption{font-size:14px;color:#626a75;padding:4px 2px}\n"
    ".key span{margin-right:22px;white-space:nowrap}.key i{display:inline-block;width:22px;height:6px;"
    "border-radius:3px;margin-right:7px;vertical-align:middle}\n"
    "@media print{body{max-width:none;padding:0}h2{break-after:avoid}figure,tr{break-inside:avoid}}\n"
    "</style>\n";

/* A panel that cannot be drawn (no such motion, a number that is not finite) is left out; only refused memory
 * ends the report. */
static morph_status figure(morph_text *page, const morph_record *r, int panel, double width, double height,
                           const char *caption) {
    char *svg;
    morph_status status = morph_picture_svg(r, panel, width, height, &svg);
    if (status == MORPH_ERR_NOMEM) return status;
    if (status != MORPH_OK) return MORPH_OK;
    morph_text_add(page, "<figure>\n");
    morph_text_put(page, svg, strlen(svg));
    if (caption) {
        morph_text_add(page, "<figcaption>");
        morph_text_html(page, caption);
        morph_text_add(page, "</figcaption>");
    }
    morph_text_add(page, "</figure>\n");
    free(svg);
    return MORPH_OK;
}

static morph_status figures(morph_text *page, const morph_record *r, const char *title, int first, int last,
                            double height, const char *const *captions) {
    morph_text_add(page, "<h2>%s</h2>\n<div class=\"grid\">\n", title);
    morph_status status = MORPH_OK;
    for (int k = first; k <= last && status == MORPH_OK; k++)
        status = figure(page, r, k, 600, height, captions ? captions[k - first] : NULL);
    morph_text_add(page, "</div>\n");
    return status;
}

static void head(morph_text *page, const morph_record *r, const morph_summary *s) {
    const char *title = s->title[0] ? s->title : "Morph plan";
    morph_text_add(page, "%s<title>", page_head);
    morph_text_html(page, title);
    morph_text_add(page, "</title>\n%s</head>\n<body>\n<h1>", page_style);
    morph_text_html(page, title);
    morph_text_add(page, "</h1>\n<p class=\"soft\">Scene ");
    morph_text_html(page, s->scene);
    morph_text_add(page, "; method ");
    morph_text_html(page, s->method);
    morph_text_add(page, ", level ");
    morph_text_html(page, s->level);
    morph_text_add(page, "; ");
    morph_text_html(page, r->program);
    morph_text_add(page, "</p>\n");
}

static morph_status body(morph_text *page, const morph_record *r, const morph_summary *s) {
    static const char *const ends[] = {"The pure blanket at rest, seen from the side",
                                       "The plan's end, in the same scale"};
    morph_report_outcome(page, s);
    morph_status status = MORPH_OK;
    bool moves = r->samples > 0 || r->nominal_frames > 0;
    if (moves) {
        status = figures(page, r, r->samples > 0 ? "The morph" : "The pure blanket (there is no schedule)", 0,
                         3, 400, NULL);
        morph_text_add(page,
                       "<p class=\"key soft\"><span><i style=\"background:#0d5e9e\"></i>bottom layer, "
                       "facing the target</span><span><i style=\"background:#e67d21\"></i>top "
                       "layer</span><span><i style=\"background:#6b7078\"></i>posts</span><span><i "
                       "style=\"background:#e6d9bf\"></i>target</span></p>\n");
    }
    if (status == MORPH_OK && r->nominal_frames > 0 && r->samples > 0)
        status = figures(page, r, "Blanket and plan", 6, 7, 360, ends);
    if (status != MORPH_OK) return status;
    morph_report_measures(page, s);
    morph_report_cavities(page, s);
    morph_report_margins(page, s);
    if (moves) status = figures(page, r, "Lengths over time", 4, 5, 380, NULL);
    morph_report_structure(page, r, s);
    morph_report_solver(page, s);
    return status;
}

morph_status morph_report_html(const morph_record *record, const morph_summary *summary, char **text) {
    *text = NULL;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    morph_text page = {0};
    head(&page, record, summary);
    morph_status status = body(&page, record, summary);
    morph_text_add(&page, "</body>\n</html>\n");
    morph_locale_leave(&locale);
    if (status == MORPH_OK && page.failed) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK)
        *text = page.data;
    else
        morph_text_free(&page);
    return status;
}
