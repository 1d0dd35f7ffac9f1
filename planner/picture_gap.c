/* The skin coloured by its gap, and cuts through what is beneath it. */
#include "planner/picture_cavity.h"

#include "model/structure.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const morph_colour morph_colour_cavity = {0.84, 0.37, 0.0};

morph_gap_scale morph_gap_scale_to(double most) {
    double first;
    int count, digits;
    const double step = morph_ticks(0, most, 14, &first, &count, &digits);
    /* A largest gap that is a limit itself but for its rounding needs no tone more. */
    return (morph_gap_scale){step, (int)fmin(fmax(ceil(most / step - 1e-9), 1), 1000)};
}

/* Relative luminance 0.83, 0.64, 0.21, 0.02: it falls all the way. */
morph_colour morph_gap_colour(const morph_gap_scale *scale, int tone) {
    static const morph_colour stop[4] = {
        {0.90, 0.93, 0.96}, {0.99, 0.80, 0.47}, {0.84, 0.37, 0.0}, {0.33, 0.06, 0.02}};
    const double s = scale->tones > 1 ? fmin(fmax(3.0 * tone / (scale->tones - 1), 0), 3) : 0;
    const int k = s >= 2 ? 2 : (int)s;
    const double f = s - k;
    return (morph_colour){stop[k].r + f * (stop[k + 1].r - stop[k].r),
                          stop[k].g + f * (stop[k + 1].g - stop[k].g),
                          stop[k].b + f * (stop[k + 1].b - stop[k].b)};
}

void morph_length_text(double length, char text[32]) {
    if (length < 1)
        snprintf(text, 32, "%.3g mm", 1e3 * length);
    else
        snprintf(text, 32, "%.3g m", length);
}

/* As the measures take it (model/cavity.c): to the target or the base plane, less half the thickness. */
static double gap_at(const morph_cavity *c, const double p[3]) {
    const double radius = c->structure->def.radius;
    const double height = isfinite(c->base) ? p[2] - c->base : INFINITY;
    if (height <= radius) return 0;
    morph_closest closest;
    morph_distance_point_bounded(c->target, p, height, &closest);
    return fmax(0, fmin(height, closest.distance) - radius);
}

/* More would not be seen. */
#define MOST_PATCHES 5000.0
enum { FINEST = 6 };

/* Corner (a, b) of a triangle cut n times each way: steps along its two sides. */
static void place(const double *const v[3], int n, int a, int b, double out[3]) {
    for (int d = 0; d < 3; d++)
        out[d] = v[0][d] + (double)a / n * (v[1][d] - v[0][d]) + (double)b / n * (v[2][d] - v[0][d]);
}

static void cut_triangle(const morph_cavity *c, const double *const v[3], int n, morph_gap_skin *out) {
    double gap[FINEST + 1][FINEST + 1];
    for (int a = 0; a <= n; a++)
        for (int b = 0; a + b <= n; b++) {
            double p[3];
            place(v, n, a, b, p);
            gap[a][b] = gap_at(c, p);
            out->most = fmax(out->most, gap[a][b]);
        }
    for (int a = 0; a < n; a++)
        for (int b = 0; a + b < n; b++)
            for (int down = 0; down < (a + b + 1 < n ? 2 : 1); down++) {
                const int i[3][2] = {{a + down, b + down}, {a + 1, b}, {a, b + 1}};
                morph_gap_patch *patch = &out->patch[out->patches++];
                for (int k = 0; k < 3; k++) {
                    place(v, n, i[k][0], i[k][1], patch->corner[k]);
                    patch->gap[k] = gap[i[k][0]][i[k][1]];
                }
            }
}

morph_status morph_gap_skin_create(const morph_cavity *cavity, const double *x, morph_gap_skin *out) {
    const morph_structure *s = cavity->structure;
    const int n = (int)fmin(fmax(floor(sqrt(MOST_PATCHES / s->skin_triangles)), 1), FINEST);
    *out = (morph_gap_skin){0};
    out->patch = morph_alloc((size_t)s->skin_triangles, (size_t)(n * n) * sizeof *out->patch);
    if (!out->patch) return MORPH_ERR_NOMEM;
    for (int t = 0; t < s->skin_triangles; t++) {
        const double *v[3];
        for (int k = 0; k < 3; k++)
            v[k] = x + 3 * (size_t)s->skin[t][k];
        cut_triangle(cavity, v, n, out);
    }
    return MORPH_OK;
}

void morph_gap_skin_free(morph_gap_skin *skin) {
    free(skin->patch);
    *skin = (morph_gap_skin){0};
}

/* What is drawn in order of depth. */
enum { PATCH, LINK, CUT, PARTS = 6 };
typedef struct piece {
    double depth;
    int kind, index, part;
} piece;

typedef struct gap_scene {
    cairo_t *c;
    const morph_gap_view *what;
    const morph_view *view;
    const morph_relief *relief;
} gap_scene;

static int by_depth(const void *a, const void *b) {
    const piece *p = a, *q = b;
    if (p->depth != q->depth) return p->depth < q->depth ? -1 : 1;
    if (p->kind != q->kind) return p->kind - q->kind;
    if (p->index != q->index) return p->index < q->index ? -1 : 1;
    return p->part - q->part;
}

/* Ends of a part of a link, or of a line of a cut (their index counts on from cut to cut), on paper. */
static void line_ends(const gap_scene *s, int kind, int index, int part, double a[3], double b[3]) {
    double end[2][3], at[2][3];
    if (kind == LINK) {
        const int *link = s->what->record->link[index];
        for (int e = 0; e < 2; e++)
            memcpy(end[e], s->what->x + 3 * (size_t)link[e], sizeof end[e]);
    } else {
        const morph_cavity_section *cut = s->what->cut;
        if (index >= cut->lines) index -= cut++->lines;
        for (int e = 0; e < 2; e++) {
            end[e][cut->axis] = cut->line[index][e][0];
            end[e][1 - cut->axis] = cut->at;
            end[e][2] = cut->line[index][e][1];
        }
    }
    for (int e = 0; e < 2; e++)
        for (int d = 0; d < 3; d++)
            at[e][d] = end[0][d] + (double)(part + e) / PARTS * (end[1][d] - end[0][d]);
    morph_view_point(s->view, at[0], a);
    morph_view_point(s->view, at[1], b);
}

static double patch_middle(const gap_scene *s, int index, double middle[3]) {
    double p[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            p[d] += s->what->skin->patch[index].corner[k][d] / 3;
    morph_view_point(s->view, p, middle);
    return middle[2];
}

/* Lines lie on the skin: nearer than the patches on both sides of them, by about a patch. */
static int list_pieces(const gap_scene *s, piece *list) {
    const morph_record *r = s->what->record;
    const morph_cavity_section *cut = s->what->cut;
    int n = 0;
    double a[3], b[3];
    for (int i = 0; i < s->what->skin->patches; i++)
        list[n++] = (piece){patch_middle(s, i, a), PATCH, i, 0};
    for (int i = 0; i < r->links; i++)
        for (int part = 0; part < PARTS && r->link_kind[i] == MORPH_LINK_BOTTOM; part++) {
            line_ends(s, LINK, i, part, a, b);
            list[n++] = (piece){0.5 * (a[2] + b[2]) + 0.17 * r->spacing, LINK, i, part};
        }
    for (int i = 0; i < cut[0].lines + cut[1].lines; i++)
        for (int part = 0; part < PARTS; part++) {
            line_ends(s, CUT, i, part, a, b);
            list[n++] = (piece){0.5 * (a[2] + b[2]) + 0.22 * r->spacing, CUT, i, part};
        }
    return n;
}

/* The part of a patch where its gap is at least `least`: a triangle cut once. */
static void path_above(cairo_t *c, double (*at)[3], const double gap[3], double least) {
    cairo_new_path(c);
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3;
        if (gap[k] >= least) cairo_line_to(c, at[k][0], at[k][1]);
        if ((gap[k] >= least) == (gap[l] >= least)) continue;
        const double f = (least - gap[k]) / (gap[l] - gap[k]);
        cairo_line_to(c, at[k][0] + f * (at[l][0] - at[k][0]), at[k][1] + f * (at[l][1] - at[k][1]));
    }
    cairo_close_path(c);
}

/* Tone upon tone, each with a rim, without antialiasing: else the seams would shine through. */
static void draw_patch(const gap_scene *s, int index) {
    const morph_gap_patch *patch = &s->what->skin->patch[index];
    const morph_gap_scale *scale = &s->what->scale;
    double at[3][3], middle[3];
    patch_middle(s, index, middle);
    /* Skin lies on the target, and its triangles may dip in: hidden is only what is well behind. */
    if (!morph_relief_shows(s->relief, s->view, NULL, middle, 0.3 * s->what->record->spacing)) return;
    double least = INFINITY, most = 0;
    for (int k = 0; k < 3; k++) {
        morph_view_point(s->view, patch->corner[k], at[k]);
        least = fmin(least, patch->gap[k]);
        most = fmax(most, patch->gap[k]);
    }
    const int from = (int)(least / scale->step), to = (int)(most / scale->step);
    cairo_set_antialias(s->c, CAIRO_ANTIALIAS_NONE);
    cairo_set_line_width(s->c, 0.6);
    for (int tone = from; tone <= to && tone <= scale->tones; tone++) {
        path_above(s->c, at, patch->gap, tone == from ? -1 : tone * scale->step);
        morph_set_colour(s->c, morph_gap_colour(scale, tone), 1);
        cairo_fill_preserve(s->c);
        cairo_stroke(s->c);
    }
    cairo_new_path(s->c);
    cairo_set_antialias(s->c, CAIRO_ANTIALIAS_DEFAULT);
}

static void draw_piece(const gap_scene *s, const piece *p) {
    double a[3], b[3], middle[3];
    if (p->kind == PATCH) {
        draw_patch(s, p->index);
        return;
    }
    line_ends(s, p->kind, p->index, p->part, a, b);
    for (int d = 0; d < 3; d++)
        middle[d] = 0.5 * (a[d] + b[d]);
    if (!morph_relief_shows(s->relief, s->view, NULL, middle, 0.3 * s->what->record->spacing)) return;
    cairo_move_to(s->c, a[0], a[1]);
    cairo_line_to(s->c, b[0], b[1]);
    if (p->kind == CUT) {
        cairo_set_line_width(s->c, 3);
        morph_set_colour(s->c, morph_colour_bottom, 1);
    } else {
        cairo_set_line_width(s->c, 0.9);
        cairo_set_source_rgb(s->c, 0.36, 0.38, 0.42);
    }
    cairo_stroke(s->c);
}

/* Is a point behind the target or behind the skin? */
static bool hidden(const gap_scene *s, const double at[3]) {
    if (!morph_relief_shows(s->relief, s->view, NULL, at, 0)) return true;
    for (int i = 0; i < s->what->skin->patches; i++) {
        double p[3][3], side[3];
        for (int k = 0; k < 3; k++)
            morph_view_point(s->view, s->what->skin->patch[i].corner[k], p[k]);
        if (fmin(p[0][2], fmin(p[1][2], p[2][2])) < at[2]) continue;
        for (int k = 0; k < 3; k++) {
            const double *a = p[k], *b = p[(k + 1) % 3];
            side[k] = (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]);
        }
        if ((side[0] >= 0 && side[1] >= 0 && side[2] >= 0) || (side[0] <= 0 && side[1] <= 0 && side[2] <= 0))
            return true;
    }
    return false;
}

/* The letter of a cut at both ends of its line, a little beyond, where that is seen. */
static void draw_letters(const gap_scene *s, int which) {
    const morph_cavity_section *cut = &s->what->cut[which];
    const double *end[2] = {NULL, NULL};
    for (int i = 0; i < 2 * cut->lines; i++) {
        const double *p = cut->line[i / 2][i % 2];
        if (!end[0] || p[0] < end[0][0]) end[0] = p;
        if (!end[1] || p[0] > end[1][0]) end[1] = p;
    }
    for (int e = 0; e < 2 && end[0]; e++) {
        double p[3], at[3];
        p[cut->axis] = end[e][0] + (e ? 1 : -1) * 16 / s->view->scale;
        p[1 - cut->axis] = cut->at;
        p[2] = end[e][1];
        morph_view_point(s->view, p, at);
        if (hidden(s, at)) continue;
        cairo_new_path(s->c);
        cairo_arc(s->c, at[0], at[1], 10, 0, 2 * M_PI);
        morph_set_colour(s->c, morph_colour_bottom, 1);
        cairo_fill(s->c);
        morph_put_text(s->c, which ? "B" : "A", at[0], at[1] + 5, 14, 0.5, true, (morph_colour){1, 1, 1});
    }
}

static void draw_ground(const gap_scene *s) {
    const morph_record *r = s->what->record;
    double lo[2], hi[2];
    if (!morph_ground(r, s->what->x, lo, hi)) return;
    cairo_set_line_width(s->c, 0.7);
    cairo_set_source_rgba(s->c, 0.55, 0.6, 0.66, 0.4);
    for (int k = 0; k < 2; k++)
        for (long g = lround(lo[k] / r->spacing); g <= lround(hi[k] / r->spacing); g++) {
            double p[3] = {0, 0, r->base}, at[3];
            p[k] = (double)g * r->spacing;
            for (int e = 0; e < 2; e++) {
                p[1 - k] = e ? hi[1 - k] : lo[1 - k];
                morph_view_point(s->view, p, at);
                (e ? cairo_line_to : cairo_move_to)(s->c, at[0], at[1]);
            }
        }
    cairo_stroke(s->c);
}

static morph_status draw_skin(const gap_scene *s) {
    const morph_gap_view *what = s->what;
    const size_t lines =
        (size_t)what->record->links + (size_t)what->cut[0].lines + (size_t)what->cut[1].lines;
    piece *list = morph_alloc((size_t)what->skin->patches + PARTS * lines, sizeof *list);
    if (!list) return MORPH_ERR_NOMEM;
    const int n = list_pieces(s, list);
    qsort(list, (size_t)n, sizeof *list, by_depth);
    cairo_set_line_cap(s->c, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(s->c, CAIRO_LINE_JOIN_ROUND);
    for (int i = 0; i < n; i++)
        draw_piece(s, &list[i]);
    free(list);
    return MORPH_OK;
}

/* On paper of lines and curves the skin would be thousands of them: there it is an image, FINE samples a
 * point. */
static morph_status draw_skin_image(const gap_scene *s, const morph_box *box) {
    enum { FINE = 2 };
    cairo_surface_t *image = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, (int)ceil(FINE * box->width),
                                                        (int)ceil(FINE * box->height));
    cairo_t *c = cairo_create(image);
    cairo_scale(c, FINE, FINE);
    cairo_translate(c, -box->x, -box->y);
    gap_scene inner = *s;
    inner.c = c;
    morph_status status = cairo_status(c) == CAIRO_STATUS_SUCCESS ? draw_skin(&inner) : MORPH_ERR_NOMEM;
    cairo_destroy(c);
    cairo_save(s->c);
    cairo_translate(s->c, box->x, box->y);
    cairo_scale(s->c, 1.0 / FINE, 1.0 / FINE);
    cairo_set_source_surface(s->c, image, 0, 0);
    cairo_paint(s->c);
    cairo_restore(s->c);
    cairo_surface_destroy(image);
    return status;
}

morph_status morph_draw_gap(cairo_t *c, const morph_gap_view *what, const morph_view *view,
                            const morph_relief *relief, const morph_box *box) {
    const gap_scene s = {c, what, view, relief};
    cairo_save(c);
    draw_ground(&s);
    morph_relief_paint(c, relief, view, NULL);
    const bool image = cairo_surface_get_type(cairo_get_target(c)) == CAIRO_SURFACE_TYPE_IMAGE;
    const morph_status status = image ? draw_skin(&s) : draw_skin_image(&s, box);
    for (int k = 0; k < 2; k++)
        draw_letters(&s, k);
    cairo_restore(c);
    return status;
}

void morph_draw_gap_scale(cairo_t *c, const morph_gap_scale *scale, const morph_box *bar) {
    const double most = scale->step * scale->tones, unit = most < 1 ? 1e3 : 1;
    const double wide = bar->width / scale->tones;
    const int digits = (int)fmin(fmax(ceil(-log10(scale->step * unit) - 1e-9), 0), 9);
    cairo_set_line_width(c, 0.8);
    for (int k = 0; k <= scale->tones; k++) {
        const double x = bar->x + k * wide;
        char text[48];
        if (k < scale->tones) {
            morph_set_colour(c, morph_gap_colour(scale, k), 1);
            cairo_rectangle(c, x, bar->y, wide, bar->height);
            cairo_fill(c);
        }
        if (k % 2 == 1 && scale->tones > 8) continue;
        morph_set_colour(c, morph_colour_faint, 1);
        cairo_move_to(c, x, bar->y + bar->height);
        cairo_line_to(c, x, bar->y + bar->height + 5);
        cairo_stroke(c);
        snprintf(text, sizeof text, "%.*f", digits, k * scale->step * unit);
        morph_put_text(c, text, x, bar->y + bar->height + 19, 13, 0.5, false, morph_colour_text);
    }
    morph_set_colour(c, morph_colour_faint, 1);
    cairo_rectangle(c, bar->x, bar->y, bar->width, bar->height);
    cairo_stroke(c);
    morph_put_text(c,
                   unit > 1 ? "gap between sheet and target or base [mm]"
                            : "gap between sheet and target or base [m]",
                   bar->x + bar->width / 2, bar->y - 9, 14, 0.5, false, morph_colour_text);
}

/* ---- cuts ---- */

static void to_paper(const morph_cut_view *w, const morph_box *box, double u, double z, double at[2]) {
    at[0] = box->x + box->width / 2 + w->scale * (u - w->middle[0]);
    at[1] = box->y + box->height / 2 - w->scale * (z - w->middle[1]);
}

/* All in one path: no seams where one ends and the next begins. */
static void fill_trapezoids(cairo_t *c, const morph_cut_view *w, const morph_box *box,
                            const morph_trapezoid *list, int count) {
    cairo_new_path(c);
    for (int k = 0; k < count; k++) {
        const morph_trapezoid *t = &list[k];
        const double corner[4][2] = {
            {t->u[0], t->lo[0]}, {t->u[1], t->lo[1]}, {t->u[1], t->hi[1]}, {t->u[0], t->hi[0]}};
        cairo_new_sub_path(c);
        for (int i = 0; i < 4; i++) {
            double at[2];
            to_paper(w, box, corner[i][0], corner[i][1], at);
            cairo_line_to(c, at[0], at[1]);
        }
        cairo_close_path(c);
    }
    cairo_fill(c);
}

static void stroke_lines(cairo_t *c, const morph_cut_view *w, const morph_box *box, double (*line)[2][2],
                         int count) {
    for (int k = 0; k < count; k++)
        for (int e = 0; e < 2; e++) {
            double at[2];
            to_paper(w, box, line[k][e][0], line[k][e][1], at);
            (e ? cairo_line_to : cairo_move_to)(c, at[0], at[1]);
        }
    cairo_stroke(c);
}

void morph_draw_cut(cairo_t *c, const morph_cut_view *w, const morph_box *box) {
    const morph_cavity_section *cut = w->cut;
    cairo_save(c);
    cairo_rectangle(c, box->x, box->y, box->width, box->height);
    cairo_clip(c);
    cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
    morph_set_colour(c, morph_colour_cavity, 1);
    fill_trapezoids(c, w, box, cut->cavity, cut->cavities);
    cairo_set_source_rgb(c, 0.74, 0.75, 0.77);
    fill_trapezoids(c, w, box, cut->solid, cut->solids);
    cairo_set_line_width(c, 1.2);
    morph_set_colour(c, morph_colour_faint, 1);
    stroke_lines(c, w, box, cut->outline, cut->outlines);
    if (isfinite(w->base)) {
        double at[2];
        to_paper(w, box, w->middle[0], w->base, at);
        cairo_set_line_width(c, 2);
        morph_set_colour(c, morph_colour_joint, 1);
        cairo_move_to(c, box->x, at[1]);
        cairo_line_to(c, box->x + box->width, at[1]);
        cairo_stroke(c);
    }
    /* True to scale, but never a hair nor a sausage. */
    cairo_set_line_width(c, fmin(fmax(2 * w->radius * w->scale, 2.5), 14));
    morph_set_colour(c, morph_colour_bottom, 1);
    stroke_lines(c, w, box, cut->line, cut->lines);
    cairo_restore(c);
}
