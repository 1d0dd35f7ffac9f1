/* The picture of cavities before and after: what goes where. */
#include "planner/picture_cavity.h"

#include "model/cavity_parts.h"
#include "planner/folder_text.h"
#include "planner/picture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 1200, COLUMN = 562, MARGIN = 30, BETWEEN = 16, VIEW_TOP = 140, VIEW_HEIGHT = 350 };
enum { SCALE_TOP = VIEW_TOP + VIEW_HEIGHT + 44, CUTS_TOP = SCALE_TOP + 62, CUT_HEAD = 38, CUT_LEAST = 110 };
enum { CUT_MOST = 340 };

/* One end of the two. */
typedef struct side {
    double *x; /* 3*joints, as seen from the target */
    morph_measure measure;
    morph_cavity_section cut[2];
    morph_gap_skin skin;
} side;

typedef struct page {
    const morph_record *record; /* with its target as it is at the end */
    morph_structure structure;  /* what the cavity reads of one; borrows from the record */
    morph_distance *target;
    morph_cavity *cavity;
    side side[2]; /* blanket, plan */
    morph_gap_scale tones;
    double lo[3], hi[3];
    double scale; /* of the cuts, points per m */
    double cut_height[2];
} page;

static void page_free(page *p) {
    for (int k = 0; k < 2; k++) {
        free(p->side[k].x);
        morph_gap_skin_free(&p->side[k].skin);
        for (int axis = 0; axis < 2; axis++)
            morph_cavity_section_free(&p->side[k].cut[axis]);
    }
    morph_cavity_destroy(p->cavity);
    morph_distance_destroy(p->target);
}

static void grow_box(page *p, const double *points, int count) {
    for (int i = 0; i < 3 * count; i++) {
        p->lo[i % 3] = fmin(p->lo[i % 3], points[i]);
        p->hi[i % 3] = fmax(p->hi[i % 3], points[i]);
    }
}

/* Structure, target and the two poses, from the record alone. */
static morph_status read_record(page *p) {
    const morph_record *r = p->record;
    const size_t n = 3 * (size_t)r->joints;
    p->structure = (morph_structure){.joints = r->joints,
                                     .skin_triangles = r->skin_triangles,
                                     .skin = r->skin,
                                     .spacing = r->spacing,
                                     .start = r->nominal_joints};
    p->structure.def.spacing = r->spacing;
    for (int i = 0; i < r->links; i++) /* all links of a structure are equally thick */
        p->structure.def.radius = fmax(p->structure.def.radius, r->link_radius[i]);
    const morph_mesh mesh = {r->target_vertices, r->target_triangles, r->target_v, r->target_t};
    morph_mesh_report report;
    morph_status status = morph_mesh_examine(&mesh, &report);
    if (status == MORPH_OK) status = morph_distance_create(&mesh, report.closed, &p->target);
    if (status == MORPH_OK) status = morph_cavity_create(&p->structure, p->target, r->base, &p->cavity);
    const morph_motion motion[2] = {morph_motion_nominal(r), morph_motion_schedule(r)};
    for (int k = 0; k < 2; k++) {
        const morph_motion *m = &motion[k];
        const size_t last = (size_t)m->frames - 1;
        p->side[k].x = morph_alloc(n, sizeof(double));
        if (!p->side[k].x) return MORPH_ERR_NOMEM;
        for (size_t i = 0; i < n; i++)
            p->side[k].x[i] = m->joints[last * n + i] - (m->offset ? m->offset[3 * last + i % 3] : 0);
    }
    return status;
}

/* Where the cuts go: through the centroid of the blanket's largest cavity; of a ring that is its middle, and
 * both cuts meet it twice. Without a cavity: through the middle of the target. */
static morph_status find_place(page *p, double place[2]) {
    morph_cavity_parts parts;
    const morph_status status = morph_cavity_parts_find(p->cavity, p->side[0].x, p->record->spacing / 32,
                                                        morph_cavity_film(&p->structure), 0.0, &parts);
    if (status != MORPH_OK) return status;
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < 3 * p->record->target_vertices; i++) {
        lo[i % 3] = fmin(lo[i % 3], p->record->target_v[i]);
        hi[i % 3] = fmax(hi[i % 3], p->record->target_v[i]);
    }
    for (int d = 0; d < 2; d++)
        place[d] = parts.count > 0 ? parts.part[0].at[d] : 0.5 * (lo[d] + hi[d]);
    morph_cavity_parts_free(&parts);
    return MORPH_OK;
}

static morph_status measure_sides(page *p) {
    double place[2], most = 0;
    morph_status status = find_place(p, place);
    for (int k = 0; k < 2 && status == MORPH_OK; k++) {
        side *s = &p->side[k];
        status = morph_cavity_measure(p->cavity, s->x, &s->measure);
        if (status == MORPH_OK) status = morph_gap_skin_create(p->cavity, s->x, &s->skin);
        for (int axis = 0; axis < 2 && status == MORPH_OK; axis++)
            status = morph_cavity_section_cut(p->cavity, s->x, axis, place[1 - axis], &s->cut[axis]);
        if (status == MORPH_OK) most = fmax(most, s->skin.most);
    }
    /* A sheet without any gap still needs a scale. */
    p->tones = morph_gap_scale_to(most > 0 ? most : p->record->spacing);
    return status;
}

/* One scale for the four cuts, as large as fits into their columns. */
static void lay_out(page *p) {
    const double radius = p->structure.def.radius;
    for (int d = 0; d < 3; d++) {
        p->lo[d] = INFINITY;
        p->hi[d] = -INFINITY;
    }
    for (int k = 0; k < 2; k++)
        grow_box(p, p->side[k].x, p->record->joints);
    /* Joints of the upper layer are in that too: of z only what the cuts show counts. */
    p->lo[2] = isfinite(p->record->base) ? p->record->base : INFINITY;
    p->hi[2] = p->lo[2] < INFINITY ? p->lo[2] : -INFINITY;
    for (int k = 0; k < 4; k++) {
        const morph_cavity_section *cut = &p->side[k / 2].cut[k % 2];
        for (int l = 0; l < 2 * (cut->lines + cut->outlines); l++) {
            const double *q =
                l < 2 * cut->lines ? cut->line[l / 2][l % 2] : cut->outline[l / 2 - cut->lines][l % 2];
            p->lo[cut->axis] = fmin(p->lo[cut->axis], q[0]);
            p->hi[cut->axis] = fmax(p->hi[cut->axis], q[0]);
            p->lo[2] = fmin(p->lo[2], q[1]);
            p->hi[2] = fmax(p->hi[2], q[1]);
        }
    }
    if (!(p->lo[2] <= p->hi[2])) p->lo[2] = p->hi[2] = 0;
    const double wide = fmax(p->hi[0] - p->lo[0], p->hi[1] - p->lo[1]) + 2 * radius;
    const double tall = p->hi[2] - p->lo[2] + 2 * radius;
    p->scale = fmin((COLUMN - 40) / fmax(wide, 1e-9), (CUT_MOST - CUT_HEAD - 20) / fmax(tall, 1e-9));
    for (int k = 0; k < 2; k++)
        p->cut_height[k] = fmax(CUT_HEAD + 34 + ceil(p->scale * tall), CUT_LEAST);
}

static int page_height(const page *p) {
    return (int)(CUTS_TOP + p->cut_height[0] + BETWEEN + p->cut_height[1] + MARGIN);
}

/* ---- drawing ---- */

static double column_left(int k) {
    return MARGIN + k * (COLUMN + BETWEEN);
}

static void frame_box(cairo_t *c, const morph_box *box) {
    cairo_set_line_width(c, 1);
    cairo_set_source_rgb(c, 0.86, 0.88, 0.90);
    cairo_rectangle(c, box->x + 0.5, box->y + 0.5, box->width - 1, box->height - 1);
    cairo_stroke(c);
}

/* Key to the cuts, ending at the right edge. */
static void draw_key(cairo_t *c, double right, double y) {
    static const char *const names[] = {"base", "sheet", "target", "cavity"};
    for (int k = 0; k < 4; k++) {
        morph_put_text(c, names[k], right, y, 15, 1, false, morph_colour_text);
        right -= morph_text_width(c, names[k], 15, false) + 8;
        if (k >= 2) {
            if (k == 2)
                cairo_set_source_rgb(c, 0.74, 0.75, 0.77);
            else
                morph_set_colour(c, morph_colour_cavity, 1);
            cairo_rectangle(c, right - 22, y - 12, 22, 14);
            cairo_fill(c);
        } else {
            cairo_set_line_width(c, k == 0 ? 2 : 5);
            morph_set_colour(c, k == 0 ? morph_colour_joint : morph_colour_bottom, 1);
            cairo_move_to(c, right - 22, y - 5);
            cairo_line_to(c, right, y - 5);
            cairo_stroke(c);
        }
        right -= 42;
    }
}

static void litres(double volume, char text[32]) {
    if (volume < 1)
        snprintf(text, 32, "%.3g litres", 1e3 * volume);
    else
        snprintf(text, 32, "%.3g m\xC2\xB3", volume);
}

/* " (-76 %)"; nothing where there was nothing before. */
static int change(char *text, size_t size, double now, double before) {
    if (!(before > 0)) return 0;
    const double percent = 100 * (now / before - 1);
    if (fabs(percent) < 0.5) return snprintf(text, size, " (as before)");
    return snprintf(text, size, " (%s%.0f %%)", percent < 0 ? "\xE2\x88\x92" : "+", fmin(fabs(percent), 1e6));
}

static void heading(cairo_t *c, const page *p, int k) {
    static const char *const names[] = {"Pure blanket at rest", "End of the plan"};
    const morph_measure *m = &p->side[k].measure, *before = &p->side[0].measure;
    const double left = column_left(k);
    char text[160], volume[32], gap[32];
    morph_put_text(c, names[k], left, 98, 19, 0, true, morph_colour_text);
    litres(m->volume, volume);
    morph_length_text(m->gap_mean, gap);
    int used = snprintf(text, sizeof text, "cavity %s", volume);
    if (k == 1) used += change(text + used, sizeof text - (size_t)used, m->volume, before->volume);
    used += snprintf(text + used, sizeof text - (size_t)used, ", mean gap %s", gap);
    if (k == 1) change(text + used, sizeof text - (size_t)used, m->gap_mean, before->gap_mean);
    morph_put_text(c, text, left, 125, 19, 0, false, morph_colour_text);
}

/* The same view and scale for both. */
static morph_status draw_views(cairo_t *c, const page *p) {
    morph_view view = morph_view_from(-62 * M_PI / 180, 36 * M_PI / 180);
    morph_bounds bounds = morph_bounds_empty();
    const morph_record *r = p->record;
    for (int k = 0; k < 2; k++) {
        double lo[2], hi[2];
        for (int i = 0; i < r->skin_triangles; i++)
            for (int j = 0; j < 3; j++)
                morph_bounds_add(&bounds, &view, p->side[k].x + 3 * (size_t)r->skin[i][j], 1, NULL);
        if (!morph_ground(r, p->side[k].x, lo, hi)) continue;
        for (int i = 0; i < 4; i++) {
            const double corner[3] = {i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], r->base};
            morph_bounds_add(&bounds, &view, corner, 1, NULL);
        }
    }
    morph_bounds_add(&bounds, &view, r->target_v, r->target_vertices, NULL);
    const morph_box box = {0, VIEW_TOP, COLUMN, VIEW_HEIGHT},
                    room = {30, VIEW_TOP + 24, COLUMN - 60, VIEW_HEIGHT - 48};
    morph_view_fit(&view, &bounds, &room);
    morph_relief relief;
    morph_status status = morph_relief_create(r, &view, &relief);
    for (int k = 0; k < 2 && status == MORPH_OK; k++) {
        const side *s = &p->side[k];
        const morph_gap_view what = {r, s->x, &s->skin, s->cut, p->tones};
        cairo_save(c);
        cairo_translate(c, column_left(k), 0);
        frame_box(c, &box);
        cairo_rectangle(c, box.x, box.y, box.width, box.height);
        cairo_clip(c);
        status = morph_draw_gap(c, &what, &view, &relief, &box);
        cairo_restore(c);
    }
    morph_relief_free(&relief);
    return status;
}

/* The largest length of 1, 2 or 5 times a power of ten that takes at most 60 points. */
static void scale_bar(cairo_t *c, double scale, double right, double y) {
    char text[32];
    double step = pow(10, floor(log10(60 / scale)));
    step *= 5 * step * scale <= 60 ? 5 : 2 * step * scale <= 60 ? 2 : 1;
    morph_length_text(step, text);
    morph_put_text(c, text, right, y, 14, 1, false, morph_colour_text);
    right -= morph_text_width(c, text, 14, false) + 8;
    cairo_set_line_width(c, 1.5);
    morph_set_colour(c, morph_colour_text, 1);
    cairo_move_to(c, right, y - 9);
    cairo_line_to(c, right, y - 1);
    cairo_move_to(c, right, y - 5);
    cairo_line_to(c, right - step * scale, y - 5);
    cairo_move_to(c, right - step * scale, y - 9);
    cairo_line_to(c, right - step * scale, y - 1);
    cairo_stroke(c);
}

static void draw_cut(cairo_t *c, const page *p, int k, int axis, const morph_box *box) {
    const morph_cavity_section *cut = &p->side[k].cut[axis];
    char text[96], at[32];
    frame_box(c, box);
    /* Nearer to the origin than a hundredth of a spacing is there, for the eye. */
    const bool off = fabs(cut->at) > 0.01 * p->record->spacing;
    morph_length_text(off ? fabs(cut->at) : 0, at);
    snprintf(text, sizeof text, "Cut %c along %c, %c = %s%s:", axis ? 'B' : 'A', axis ? 'y' : 'x',
             axis ? 'x' : 'y', off && cut->at < 0 ? "\xE2\x88\x92" : "", at);
    morph_put_text(c, text, box->x + 14, box->y + 25, 15, 0, false, morph_colour_text);
    const double after = box->x + 20 + morph_text_width(c, text, 15, false);
    if (cut->area < 1)
        snprintf(text, sizeof text, "cavity %.3g cm\xC2\xB2", 1e4 * cut->area);
    else
        snprintf(text, sizeof text, "cavity %.3g m\xC2\xB2", cut->area);
    morph_put_text(c, text, after, box->y + 25, 15, 0, true, morph_colour_text);
    scale_bar(c, p->scale, box->x + box->width - 14, box->y + 25);
    const morph_cut_view what = {cut,
                                 p->record->base,
                                 p->structure.def.radius,
                                 {0.5 * (p->lo[axis] + p->hi[axis]), 0.5 * (p->lo[2] + p->hi[2])},
                                 p->scale};
    const morph_box room = {box->x + 2, box->y + CUT_HEAD, box->width - 4, box->height - CUT_HEAD - 4};
    morph_draw_cut(c, &what, &room);
}

static morph_status draw_page(cairo_t *c, const void *data) {
    const page *p = data;
    cairo_set_source_rgb(c, 1, 1, 1);
    cairo_paint(c);
    morph_put_text(c, "Cavities before and after", MARGIN, 50, 26, 0, true, morph_colour_text);
    draw_key(c, WIDTH - MARGIN, 48);
    for (int k = 0; k < 2; k++)
        heading(c, p, k);
    const morph_status status = draw_views(c, p);
    const morph_box bar = {WIDTH / 2.0 - 300, SCALE_TOP, 600, 16};
    morph_draw_gap_scale(c, &p->tones, &bar);
    double top = CUTS_TOP;
    for (int axis = 0; axis < 2; axis++) {
        for (int k = 0; k < 2; k++) {
            const morph_box box = {column_left(k), top, COLUMN, p->cut_height[axis]};
            draw_cut(c, p, k, axis, &box);
        }
        top += p->cut_height[axis] + BETWEEN;
    }
    return status;
}

morph_status morph_picture_cavity(const morph_record *record, const char *file, char *message, size_t size) {
    morph_status status = morph_picture_ending(file, message, size);
    if (status != MORPH_OK) return status;
    const char *lacks = record->nominal_frames < 1     ? "blanket"
                        : record->samples < 1          ? "schedule"
                        : record->skin_triangles < 1   ? "skin"
                        : record->target_triangles < 1 ? "target"
                                                       : NULL;
    if (lacks)
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: the plan holds no %s: no cavities to draw",
                          file, lacks);
    status = morph_picture_drawable(record, file, message, size);
    if (status != MORPH_OK) return status;
    const morph_record shown = morph_picture_pressed(record);
    page *p = morph_alloc(1, sizeof *p);
    status = p ? MORPH_OK : MORPH_ERR_NOMEM;
    if (p) {
        p->record = &shown;
        status = read_record(p);
        if (status == MORPH_OK) status = measure_sides(p);
    }
    if (status == MORPH_OK) {
        lay_out(p);
        status = morph_picture_file(file, WIDTH, page_height(p), draw_page, p, message, size);
    } else {
        morph_fail(status, message, size, "%s: cannot be drawn: %s", file, morph_status_text(status));
    }
    if (p) page_free(p);
    free(p);
    return status;
}
