#include "planner/text.h"

#include "planner/reach_text.h"
#include "planner/start.h"

#include <stdio.h>
#include <stdlib.h>

/* -0 is printed as 0. */
static double without_sign_of_zero(double x) {
    return x + 0.0;
}

static void outcome_line(FILE *out, const morph_summary *s) {
    if (s->feasible)
        fprintf(out, "outcome    %s: every limit holds\n", s->outcome);
    else
        fprintf(out, "outcome    %s%s%s\n", s->outcome, s->reason[0] ? ": " : "", s->reason);
}

static void cavity_line(FILE *out, const morph_summary *s) {
    const morph_measure *b = &s->blanket, *p = &s->plan;
    fprintf(out,
            "cavity     blanket -> plan: volume %.4g -> %.4g m3, mean gap %.4g -> %.4g m, target gap %.4g -> "
            "%.4g m, coverage %.0f -> %.0f %%\n",
            b->volume, p->volume, b->gap_mean, p->gap_mean, b->gap_target, p->gap_target, 100.0 * b->coverage,
            100.0 * p->coverage);
}

char *morph_plan_text(const morph_summary *s, const char *folder) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    const morph_margin *m = &s->check.margin[s->check.worst];
    outcome_line(out, s);
    cavity_line(out, s);
    if (s->check.defect[0])
        fprintf(out, "margin     none: %s\n", s->check.defect);
    else
        fprintf(out, "margin     %s %.3g %s: %s at %.3f s (the tightest; positive is inside)\n",
                morph_margin_name(s->check.worst), without_sign_of_zero(m->worst),
                morph_margin_unit_of(m, s->check.worst), m->element, m->time);
    fprintf(out, "duration   %.3f s\n", s->duration);
    if (s->free_motions > 0)
        fprintf(out, "mobility   %d free motions: lengths alone do not fix this shape", s->free_motions);
    else
        fprintf(out, "mobility   no free motion: lengths fix this shape (least singular value %.3g)",
                s->sigma_min);
    if (s->replay.done) fprintf(out, ", replayed they end %.2g spacings off", s->replay.most / s->spacing);
    fprintf(out, "\n");
    fprintf(out, "folder     %s\n", folder);
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

static void margin_line(FILE *out, morph_margin_kind kind, const morph_margin *m, const char *untested) {
    if (!m->tested) {
        fprintf(out, "%-15s %s\n", morph_margin_name(kind), untested);
        return;
    }
    fprintf(out, "%-15s %-5s worst %12.5g %-8s (allowed from %6.0e) at %8.4f s  %s\n",
            morph_margin_name(kind), m->worst >= -m->tolerance ? "holds" : "FAILS",
            without_sign_of_zero(m->worst), morph_margin_unit_of(m, kind), -m->tolerance, m->time,
            m->element);
}

char *morph_check_text(const morph_check_report *r, bool whole, const char *files) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    if (r->defect[0]) fprintf(out, "unusable: %s\n", r->defect);
    /* Every plan has a target: a check without clearance was one of lengths alone. */
    const bool lengths_only = !r->margin[MORPH_MARGIN_CLEARANCE].tested;
    for (int k = 0; k < MORPH_MARGIN_KINDS && !r->defect[0]; k++)
        margin_line(out, (morph_margin_kind)k, &r->margin[k],
                    lengths_only ? "not tested: a schedule file holds lengths only" : "not in this plan");
    if (!lengths_only && r->clearance_at_end)
        fprintf(out, "clearance is to the pressed target at the end: a deformable one gives way before\n");
    if (files)
        fputs(files, out);
    else if (whole)
        fprintf(out, "%-15s holds schedule.csv and schedule.json are those of plan.h5\n", "files");
    if (!r->feasible)
        fprintf(out, "not every limit holds%s\n", morph_check_hint(r));
    else if (files)
        fprintf(out, "every limit holds in plan.h5, but the folder is not as it was written\n");
    else
        fprintf(out, "every limit%s holds (margins: positive is inside)\n",
                lengths_only ? " on lengths" : "");
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

static double in_degrees(double radians) {
    return radians * 180.0 / M_PI;
}

/* Layout, joints, bracing, and what is held. */
static void structure_lines(FILE *out, const morph_structure *s) {
    const morph_structure_def *d = &s->def;
    static const char *const bracing[3] = {"no bracing", "web bracing", "full bracing"};
    int kind[3] = {0, 0, 0};
    for (int l = 0; l < s->links; l++)
        kind[s->link_kind[l]]++;
    fprintf(out, "structure  %d x %d nodes, spacing %.4g m: %d joints, %d links, %d posts\n", s->nx, s->ny,
            s->spacing, s->joints, s->links, s->posts);
    if (d->layout == MORPH_LAYOUT_OFFSET)
        fprintf(out, "           offset double layer (bottom %d x %d), %.4g m high", s->layer_nodes[0][0],
                s->layer_nodes[0][1], d->thickness);
    else
        fprintf(out, "           posts %.4g m long, %s joints, %s", d->thickness,
                d->joints == MORPH_JOINTS_UNIVERSAL ? "universal" : "ball", bracing[d->bracing]);
    fprintf(out, "; links: %d bottom, %d top, %d braces\n", kind[MORPH_LINK_BOTTOM], kind[MORPH_LINK_TOP],
            kind[MORPH_LINK_BRACE]);
    if (s->panels > 0) fprintf(out, "           %d side panels stay plane\n", s->panels);
    if (s->fixed_count > 0)
        fprintf(out, "           %d %s held where they start\n", s->fixed_count,
                s->posts > 0 ? "posts" : "joints of the top layer");
}

static void limit_lines(FILE *out, const morph_structure *s) {
    const morph_structure_def *d = &s->def;
    fprintf(out, "limits     %d lengths from %.4g to %.4g m (bottom), %.4g to %.4g m (top)", s->links,
            d->length[MORPH_LINK_BOTTOM][0], d->length[MORPH_LINK_BOTTOM][1], d->length[MORPH_LINK_TOP][0],
            d->length[MORPH_LINK_TOP][1]);
    if (d->layout == MORPH_LAYOUT_OFFSET || d->bracing != MORPH_BRACING_NONE)
        fprintf(out, ", %.4g to %.4g times their start (braces)", d->length[MORPH_LINK_BRACE][0],
                d->length[MORPH_LINK_BRACE][1]);
    fprintf(out, "\n           rate %.4g m/s, acceleration %.4g m/s2, jerk %.4g m/s3 of every length\n",
            d->rate, d->acceleration, d->jerk);
    if (s->link_posts > 0)
        fprintf(out, "           %d angles of link and post from %.4g to %.4g degrees\n", s->link_posts,
                in_degrees(d->link_post[0]), in_degrees(d->link_post[1]));
    fprintf(out, "           %d angles of neighbouring links from %.4g to %.4g degrees\n", s->link_links,
            in_degrees(d->link_link[0]), in_degrees(d->link_link[1]));
}

static void stuck_lines(FILE *out, const morph_structure *s) {
    for (int k = 0; k < s->def.stuck_links; k++) {
        char name[64];
        const int l = s->def.stuck_link[k];
        morph_link_name(s, l, name, sizeof name);
        fprintf(out, "stuck      %s holds %.9g m\n", name, s->length_limit[l][0]);
    }
}

static void start_lines(FILE *out, const morph_start *start) {
    if (start->kind == MORPH_START_FLAT) return;
    fprintf(out, "start      %s (%s): %d free motions there", start->as_written,
            morph_start_name(start->kind), start->free_motions);
    if (start->kind == MORPH_START_LENGTHS)
        fprintf(out, "; lengths met to %.3g m, another shape of them found %.3g m away", start->residual,
                start->doubt);
    fprintf(out, "\n");
}

static void mobility_lines(FILE *out, const morph_structure *s, const morph_mobility *m) {
    fprintf(out,
            "mobility   flat: %d free motions, %d redundant rows (rank %d of %d rows: links%s%s), least "
            "singular value %.4g\n",
            m->free, m->redundant, m->rank, m->rows, s->posts > 0 ? ", posts" : "",
            s->panels > 0 ? ", panels" : "", m->sigma_min);
    if (m->rigid < 6)
        fprintf(out, "           %d of the 6 rigid motions are left by what is held\n", m->rigid);
}

static void target_lines(FILE *out, const morph_mesh_report *t) {
    fprintf(out, "target     %d vertices, %d triangles, %s, volume %.6g m3, area %.6g m2\n", t->vertices,
            t->triangles, t->closed ? "closed" : "open", t->volume, t->area);
    fprintf(out, "           box (%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g) m\n", t->lo[0], t->lo[1], t->lo[2],
            t->hi[0], t->hi[1], t->hi[2]);
    fprintf(out,
            "           %d vertices welded, %d degenerate faces dropped, %d faces turned, %d boundary edges, "
            "%d self-intersections, %d parts\n",
            t->welded, t->degenerate, t->flipped, t->boundary_edges, t->self_intersections, t->components);
}

char *morph_info_text(const morph_scene *scene, const morph_structure *s, const morph_mobility *m,
                      const morph_reach *reach) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    fprintf(out, "scene      %s\n", scene->title && scene->title[0] ? scene->title : scene->file);
    structure_lines(out, s);
    limit_lines(out, s);
    stuck_lines(out, s);
    start_lines(out, &scene->start);
    mobility_lines(out, s, m);
    target_lines(out, &scene->target_report);
    morph_reach_lines(out, reach);
    fprintf(out, "size       %d unknowns for a pose\nlinks      number, nodes (i,j) at both ends, layer\n",
            3 * s->joints);
    for (int l = 0; l < s->links; l++) {
        char name[64];
        morph_link_name(s, l, name, sizeof name);
        fprintf(out, "%s\n", name);
    }
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}
