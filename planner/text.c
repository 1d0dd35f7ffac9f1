#include "planner/text.h"

#include <stdio.h>
#include <stdlib.h>

static void outcome_line(FILE *out, const morph_summary *s) {
    if (s->feasible)
        fprintf(out, "outcome    %s: every limit holds\n", s->outcome);
    else
        fprintf(out, "outcome    %s%s%s\n", s->outcome, s->reason[0] ? ": " : "", s->reason);
}

static void cavity_line(FILE *out, const morph_summary *s) {
    const morph_measure *b = &s->blanket, *p = &s->plan;
    fprintf(out,
            "cavity     %.4g -> %.4g m3, mean gap %.4g -> %.4g m, target gap %.4g -> %.4g m, coverage %.0f "
            "-> %.0f %% "
            "(blanket -> plan)\n",
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
        fprintf(out, "margin     %s %.3g %s: %s at %.3f s\n", morph_margin_name(s->check.worst), m->worst,
                morph_margin_unit(s->check.worst), m->element, m->time);
    fprintf(out, "duration   %.3f s\n", s->duration);
    if (s->free_motions > 0)
        fprintf(out, "mobility   %d free motions: lengths alone do not fix this shape\n", s->free_motions);
    else
        fprintf(out, "mobility   no free motion: lengths fix this shape (least singular value %.3g)\n",
                s->sigma_min);
    fprintf(out, "folder     %s\n", folder);
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

char *morph_check_text(const morph_check_report *r) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    if (r->defect[0]) fprintf(out, "unusable: %s\n", r->defect);
    for (int k = 0; k < MORPH_MARGIN_KINDS && !r->defect[0]; k++) {
        const morph_margin *m = &r->margin[k];
        if (!m->tested) {
            fprintf(out, "%-15s not in this plan\n", morph_margin_name((morph_margin_kind)k));
            continue;
        }
        fprintf(out, "%-15s %-5s worst %12.5g %-8s at %8.4f s  %s\n", morph_margin_name((morph_margin_kind)k),
                m->worst >= -m->tolerance ? "holds" : "FAILS", m->worst,
                morph_margin_unit((morph_margin_kind)k), m->time, m->element);
    }
    fprintf(out, "%s\n", r->feasible ? "every limit holds" : "not every limit holds");
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
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

char *morph_info_text(const morph_scene *scene, const morph_structure *s, const morph_mobility *m) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) return NULL;
    fprintf(out, "scene      %s\n", scene->title && scene->title[0] ? scene->title : scene->file);
    fprintf(out, "structure  %d x %d nodes, spacing %.4g m: %d joints, %d links, %d posts\n", s->nx, s->ny,
            s->spacing, s->joints, s->links, s->posts);
    fprintf(out, "limits     %d lengths, %d link-post angles, %d link-link angles\n", s->links, s->link_posts,
            s->link_links);
    fprintf(out,
            "mobility   flat: rank %d of %d rows, %d free motions, %d redundant, least singular value %.4g\n",
            m->rank, m->rows, m->free, m->redundant, m->sigma_min);
    target_lines(out, &scene->target_report);
    fprintf(out, "size       %d unknowns for a pose\n", 3 * s->joints);
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
