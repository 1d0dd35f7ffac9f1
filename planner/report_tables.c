/* The numbers of the report, in words and tables. */
#include "planner/report_parts.h"

#include <stdio.h>
#include <string.h>

void morph_report_quantity(morph_text *page, double value, const char *unit) {
    if (!isfinite(value)) {
        morph_text_add(page, "&ndash;");
        return;
    }
    double size = fabs(value), factor = 1;
    const char *shown = unit;
    if (strcmp(unit, "m") == 0 && size < 1 && size > 0) {
        factor = size < 1e-3 ? 1e6 : 1e3;
        shown = size < 1e-3 ? "&micro;m" : "mm";
    } else if (strcmp(unit, "m3") == 0) {
        factor = size < 1 && size > 0 ? 1e3 : 1;
        shown = factor > 1 ? "litres" : "m&sup3;";
    }
    char number[32];
    snprintf(number, sizeof number, "%.3g", factor * value);
    morph_text_add(page, "%s%s%s", number, *shown ? "&nbsp;" : "", shown);
}

static void sentence(morph_text *page, const char *tag, const char *plain) {
    morph_text_add(page, "<%s>", tag);
    morph_text_html(page, plain);
    morph_text_add(page, "</%s>\n", tag);
}

void morph_report_outcome(morph_text *page, const morph_summary *s) {
    const char *what = "The run was stopped before a plan was found that holds every limit.";
    const bool refined = strcmp(s->method, "ipopt") == 0;
    if (s->feasible && !refined)
        what = "The blanket's own motion holds every limit. Nothing was refined.";
    else if (s->feasible && strcmp(s->outcome, "optimal") == 0)
        what =
            "The plan holds every limit, and the last solve for its final shape converged: a local optimum.";
    else if (s->feasible)
        what = "The plan holds every limit. The last solve for its final shape ended before it converged.";
    else if (s->check.feasible && strcmp(s->outcome, "stopped") != 0)
        what = "The schedule holds every limit of the structure, but not all that the scene asks for.";
    else if (strcmp(s->outcome, "stopped") != 0 && !refined)
        what = "The blanket's own motion breaks a limit and must not be driven. Nothing was refined.";
    else if (strcmp(s->outcome, "stopped") != 0)
        what = "This plan breaks a limit and must not be driven. It is the best that was found.";
    morph_text_add(page, "<div class=\"outcome %s\">\n", s->feasible ? "good" : "bad");
    morph_text_add(page, "<strong>%s</strong> ", s->feasible ? "Feasible" : "Not feasible");
    sentence(page, "p", what);
    if (s->reason[0]) sentence(page, "p", s->reason);
    if (s->has_plan) {
        morph_text_add(page, "<p>Duration ");
        morph_report_quantity(page, s->duration, "s");
        if (s->has_blanket && s->blanket.gap_mean > 0) {
            morph_text_add(page, "; mean gap ");
            morph_report_quantity(page, s->blanket.gap_mean, "m");
            morph_text_add(page, " for the pure blanket, ");
            morph_report_quantity(page, s->plan.gap_mean, "m");
            morph_text_add(page, " for the plan");
        }
        morph_text_add(page, ".</p>\n");
    }
    morph_text_add(page, "</div>\n");
    if (s->warning[0]) {
        morph_text_add(page, "<p class=\"warning\">");
        morph_text_html(page, s->warning);
        morph_text_add(page, "</p>\n");
    }
}

typedef struct measure_row {
    const char *name, *meaning;
    double blanket, plan;
    const char *unit; /* "m", "m3", "%" */
} measure_row;

static void measure_cell(morph_text *page, const measure_row *row, double value, double spacing) {
    morph_text_add(page, "<td class=\"n\">");
    if (strcmp(row->unit, "%") == 0) {
        if (isfinite(value))
            morph_text_add(page, "%.1f&nbsp;%%", 100 * value);
        else
            morph_text_add(page, "&ndash;");
    } else {
        morph_report_quantity(page, value, row->unit);
    }
    morph_text_add(page, "</td>");
    if (strcmp(row->unit, "m") == 0 && spacing > 0 && isfinite(value))
        morph_text_add(page, "<td class=\"n soft\">%.3f&nbsp;h</td>", value / spacing);
    else
        morph_text_add(page, "<td></td>");
}

void morph_report_measures(morph_text *page, const morph_summary *s) {
    const morph_measure *b = &s->blanket, *p = &s->plan;
    const measure_row rows[] = {
        {"Cavity volume", "space between sheet, target and base", b->volume, p->volume, "m3"},
        {"Mean gap", "sheet to target or base, over the sheet's area", b->gap_mean, p->gap_mean, "m"},
        {"95&nbsp;% gap", "what 95&nbsp;% of the sheet stays below", b->gap_p95, p->gap_p95, "m"},
        {"Largest gap", "of all points of the sheet that are measured", b->gap_max, p->gap_max, "m"},
        {"Target gap", "target's exposed points to the sheet, mean", b->gap_target, p->gap_target, "m"},
        {"Coverage", "exposed points within a quarter spacing of the sheet", b->coverage, p->coverage, "%"},
    };
    morph_text_add(page,
                   "<h2>How well the sheet lies on the target</h2>\n<table>\n<tr><th>Measure</th>"
                   "<th class=\"n\" colspan=\"2\">Pure blanket</th><th class=\"n\" "
                   "colspan=\"2\">Plan</th><th class=\"n\">Plan / blanket</th></tr>\n");
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        const measure_row *row = &rows[k];
        double blanket = s->has_blanket ? row->blanket : (double)NAN;
        double plan = s->has_plan ? row->plan : (double)NAN, ratio = plan / blanket;
        morph_text_add(page, "<tr><td>%s<span class=\"note\">%s</span></td>", row->name, row->meaning);
        measure_cell(page, row, blanket, s->spacing);
        measure_cell(page, row, plan, s->spacing);
        if (isfinite(ratio))
            morph_text_add(page, "<td class=\"n\">%.2f</td></tr>\n", ratio);
        else
            morph_text_add(page, "<td class=\"n\">&ndash;</td></tr>\n");
    }
    morph_text_add(page, "</table>\n<p class=\"soft\">h is the spacing of the nodes, ");
    morph_report_quantity(page, s->spacing, "m");
    morph_text_add(page, ". The target's own volume is ");
    morph_report_quantity(page, s->target_volume, "m3");
    morph_text_add(page, ".</p>\n");
}

/* Volume, share and place of a cavity; empty cells where there is no such one. */
static void cavity_cells(morph_text *page, const morph_cavity_list *list, int k) {
    if (k >= list->count) {
        morph_text_add(page, "<td></td><td></td><td></td>");
        return;
    }
    const morph_cavity_part *part = &list->part[k];
    morph_text_add(page, "<td class=\"n\">");
    morph_report_quantity(page, part->volume, "m3");
    morph_text_add(page, "</td><td class=\"n\">%.1f&nbsp;%%</td><td class=\"n soft\">%.3f, %.3f, %.3f</td>",
                   100 * part->volume / list->volume, part->at[0], part->at[1], part->at[2]);
}

void morph_report_cavities(morph_text *page, const morph_summary *s) {
    const morph_cavity_list *b = &s->cavities_blanket, *p = &s->cavities_plan;
    const int rows = b->count > p->count ? b->count : p->count;
    if (rows == 0) return;
    morph_text_add(page,
                   "<h2>Connected cavities, before and after</h2>\n<table>\n<tr><th></th>"
                   "<th class=\"n\" colspan=\"3\">Pure blanket: volume, share, centroid [m]</th>"
                   "<th class=\"n\" colspan=\"3\">Plan</th></tr>\n");
    for (int k = 0; k < rows; k++) {
        morph_text_add(page, "<tr><td>%d</td>", k + 1);
        cavity_cells(page, b, k);
        cavity_cells(page, p, k);
        morph_text_add(page, "</tr>\n");
    }
    morph_text_add(page,
                   "</table>\n<p class=\"soft\">The largest, of at least %.0f&nbsp;%% of the cavity "
                   "volume each. The film where the sheet lies on the target joins none of them: ",
                   100 * MORPH_CAVITY_SHARE);
    if (s->has_blanket) {
        morph_report_quantity(page, b->film, "m3");
        morph_text_add(page, " under the blanket");
    }
    if (s->has_plan) {
        morph_text_add(page, "%s", s->has_blanket ? ", " : "");
        morph_report_quantity(page, p->film, "m3");
        morph_text_add(page, " under the plan");
    }
    morph_text_add(page, ".</p>\n");
}

static const char *margin_words(morph_margin_kind kind) {
    switch (kind) {
    case MORPH_MARGIN_LENGTH:
        return "Link length";
    case MORPH_MARGIN_RATE:
        return "Rate of length";
    case MORPH_MARGIN_ACCELERATION:
        return "Acceleration of length";
    case MORPH_MARGIN_JERK:
        return "Jerk of length";
    case MORPH_MARGIN_POST_LENGTH:
        return "Post length";
    case MORPH_MARGIN_PANEL:
        return "Panel planeness";
    case MORPH_MARGIN_LINK_POST:
        return "Angle between link and post";
    case MORPH_MARGIN_LINK_LINK:
        return "Angle between neighbouring links";
    case MORPH_MARGIN_CLEARANCE:
        return "Clearance to the target";
    case MORPH_MARGIN_BASE:
        return "Height above the base";
    case MORPH_MARGIN_SELF_CLEARANCE:
        return "Clearance among links and posts";
    case MORPH_MARGIN_COMPATIBILITY:
        return "Lengths fit joint positions";
    case MORPH_MARGIN_GOAL:
        return "Goal: gap and coverage at the end";
    case MORPH_MARGIN_KINDS:
        break;
    }
    return "Margin";
}

/* Margins may be a rounding error from their limit: plain numbers, no prefixes, so that signs and tolerances
 * compare at a glance. */
static void margin_row(morph_text *page, morph_margin_kind kind, const morph_margin *m) {
    bool holds = m->worst >= -m->tolerance;
    const char *unit = morph_margin_unit_of(m, kind);
    morph_text_add(page, "<tr><td>%s</td>", margin_words(kind));
    if (isfinite(m->worst))
        morph_text_add(page, "<td class=\"n\">%+.3e ", m->worst);
    else
        morph_text_add(page, "<td class=\"n\">&ndash; ");
    morph_text_html(page, unit);
    morph_text_add(page, "</td><td class=\"n\">%.1e</td><td>", m->tolerance);
    morph_text_html(page, m->element);
    if (isfinite(m->time))
        morph_text_add(page, "</td><td class=\"n\">%.3f&nbsp;s</td>", m->time);
    else
        morph_text_add(page, "</td><td class=\"n\">&ndash;</td>");
    morph_text_add(page, "<td class=\"%s\">%s</td></tr>\n", holds ? "yes" : "no", holds ? "holds" : "broken");
}

void morph_report_margins(morph_text *page, const morph_summary *s) {
    morph_text_add(page, "<h2>Limits</h2>\n");
    if (!s->has_plan) {
        sentence(page, "p", "There is no plan to check.");
        return;
    }
    if (s->check.defect[0]) {
        sentence(page, "p", s->check.defect);
        return;
    }
    morph_text_add(page,
                   "<p>Recomputed from positions and lengths, with exact distances to the target, "
                   "between samples too. Positive is inside the limit.</p>\n<table>\n<tr><th>Limit</th>"
                   "<th class=\"n\">Worst margin</th><th class=\"n\">Tolerance</th><th>Where</th>"
                   "<th class=\"n\">When</th><th>Verdict</th></tr>\n");
    for (int k = 0; k < MORPH_MARGIN_KINDS; k++)
        if (s->check.margin[k].tested) margin_row(page, (morph_margin_kind)k, &s->check.margin[k]);
    morph_text_add(page, "</table>\n");
}

void morph_report_structure(morph_text *page, const morph_record *r, const morph_summary *s) {
    morph_text_add(page,
                   "<h2>Structure</h2>\n<p>%d joints, %d links that change length, %d rigid posts; nodes ",
                   r->joints, r->links, r->posts);
    morph_report_quantity(page, r->spacing, "m");
    morph_text_add(page,
                   " apart. %d angles between links and posts and %d between neighbouring links are limited. "
                   "The target has %d triangles.</p>\n<p>",
                   r->link_posts, r->link_links, r->target_triangles);
    if (s->free_motions > 0)
        morph_text_add(page,
                       "<strong>%d motions stay free: lengths alone do not fix this shape.</strong> The "
                       "planned shape is one of many that these lengths allow; gravity, friction and the "
                       "support decide between them.",
                       s->free_motions);
    else
        morph_text_add(page,
                       "Lengths alone fix the shape: no motion stays free. The least singular value is %.3g; "
                       "the smaller, the softer.",
                       s->sigma_min);
    if (s->replay.done)
        morph_text_add(
            page,
            " Replayed%s, the lengths alone end with a joint %.2g spacings from the plan (mean square %.2g), "
            "rigid motion removed.",
            s->replay.floating ? " without gravity" : " under gravity", s->replay.most / s->spacing,
            s->replay.rms / s->spacing);
    if (s->replay_core.done)
        morph_text_add(page, " With the target as a solid core: %.2g (%.2g).",
                       s->replay_core.most / s->spacing, s->replay_core.rms / s->spacing);
    if (s->redundant > 0)
        morph_text_add(page,
                       " %d links are redundant: their lengths must fit the others', or actuators fight.",
                       s->redundant);
    morph_text_add(page, "</p>\n");
}

static void solve_row(morph_text *page, const char *name, int iterations, int unknowns, int used,
                      int possible) {
    morph_text_add(page, "<tr><td>%s</td><td class=\"n\">%d</td><td class=\"n\">", name, iterations);
    if (unknowns > 0)
        morph_text_add(page, "%d</td><td class=\"n\">%d</td><td class=\"n\">%d</td></tr>\n", unknowns, used,
                       possible);
    else
        morph_text_add(page, "&ndash;</td><td class=\"n\">&ndash;</td><td class=\"n\">&ndash;</td></tr>\n");
}

void morph_report_solver(morph_text *page, const morph_summary *s) {
    morph_text_add(page,
                   "<h2>Optimisation</h2>\n<table>\n<tr><th>Problem</th><th class=\"n\">Iterations</th>"
                   "<th class=\"n\">Unknowns</th><th class=\"n\">Rows used</th>"
                   "<th class=\"n\">Rows possible</th></tr>\n");
    solve_row(page, "Final shape", s->iterations_refine, s->unknowns_refine, s->rows_refine_used,
              s->rows_refine_possible);
    solve_row(page, "Path", s->iterations_path, s->unknowns_path, s->rows_path_used, s->rows_path_possible);
    solve_row(page, "Timing", s->iterations_timing, 0, 0, 0);
    morph_text_add(
        page,
        "</table>\n<p class=\"soft\">Iterations are those of all solves together, unknowns and rows "
        "those of the largest. Possible are all rows of a pose: every link, angle and skin "
        "triangle, and every pair of links and posts.</p>\n<h2>Where the time went</h2>\n<table>\n"
        "<tr>");
    /* Writing is not over when this is written. */
    for (int k = 0; k < MORPH_STAGE_WRITE; k++)
        morph_text_add(page, "<th class=\"n\">%s</th>", morph_stage_name((morph_stage)k));
    morph_text_add(page, "<th class=\"n\">total</th></tr>\n<tr>");
    for (int k = 0; k < MORPH_STAGE_WRITE; k++)
        morph_text_add(page, "<td class=\"n\">%.2f&nbsp;s</td>", s->seconds[k]);
    morph_text_add(page, "<td class=\"n\">%.2f&nbsp;s</td></tr>\n</table>\n", s->total_seconds);
    morph_text_add(page, "<p class=\"soft\">Linear solver %.2f s, derivatives %.2f s; peak memory %.0f MiB.",
                   s->linear_seconds, s->callback_seconds, (double)s->peak_memory_bytes / 1048576.0);
    if (s->sdf_cell > 0) {
        morph_text_add(page, " Distances to the target during optimisation: grid of ");
        morph_report_quantity(page, s->sdf_cell, "m");
        morph_text_add(page, ", error ");
        morph_report_quantity(page, s->sdf_rms, "m");
        morph_text_add(page, " (root mean square) and ");
        morph_report_quantity(page, s->sdf_max, "m");
        morph_text_add(page, " at most.");
    }
    if (s->blas[0]) {
        morph_text_add(page, " BLAS: ");
        morph_text_html(page, s->blas);
        morph_text_add(page, ".");
    }
    morph_text_add(page, "</p>\n");
}
