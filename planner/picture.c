/* Still pictures: what goes where, and onto which surface. */
#include "planner/picture.h"

#include "planner/folder_text.h"
#include "planner/picture_parts.h"

#include <cairo-svg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { PAGE_WIDTH = 1400, PAGE_HEIGHT = 1410 };

morph_motion morph_motion_schedule(const morph_record *r) {
    return (morph_motion){r->samples, r->time, r->schedule_joints, r->length, r->offset_schedule};
}

morph_motion morph_motion_nominal(const morph_record *r) {
    return (morph_motion){r->nominal_frames, r->nominal_time, r->nominal_joints, r->nominal_lengths,
                          r->offset_nominal};
}

static bool all_finite(const double *v, size_t n) {
    for (size_t i = 0; v && i < n; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

static bool motion_finite(const morph_record *r, const morph_motion *m) {
    size_t n = (size_t)m->frames;
    return all_finite(m->time, n) && all_finite(m->joints, 3 * n * (size_t)r->joints) &&
           all_finite(m->lengths, n * (size_t)r->links) && all_finite(m->offset, 3 * n);
}

/* Everything that is turned into a place on paper. */
static bool drawable(const morph_record *r) {
    morph_motion schedule = morph_motion_schedule(r), nominal = morph_motion_nominal(r);
    return motion_finite(r, &schedule) && motion_finite(r, &nominal) &&
           all_finite(r->target_v, 3 * (size_t)r->target_vertices) &&
           all_finite(r->deformed_v, 3 * (size_t)r->deformed_vertices) &&
           all_finite(&r->length_limit[0][0], 2 * (size_t)r->links) &&
           all_finite(r->link_radius, (size_t)r->links) && isfinite(r->spacing) && r->spacing > 0;
}

/* Joints' mean squared distance of two frames. */
static double apart(const morph_record *r, const morph_motion *m, int a, int b) {
    const size_t n = 3 * (size_t)r->joints;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        const double d = m->joints[(size_t)a * n + i] - m->joints[(size_t)b * n + i];
        sum += d * d;
    }
    return sqrt(sum);
}

/* Start, a third, two thirds, end: of the time for a schedule; a blanket falls fast and settles slowly, so
 * there of the way to its end. */
static int moment(const morph_record *r, const morph_motion *m, int k) {
    const int last = m->frames - 1;
    if (r->samples > 0 || k == 0 || k == 3) return (int)((long long)last * k / 3);
    const double all = apart(r, m, 0, last);
    int f = 0;
    while (f < last && apart(r, m, f, last) > all * (3 - k) / 3.0)
        f++;
    return f;
}

static const double *joints_at(const morph_record *r, const morph_motion *m, int frame) {
    return m->joints + 3 * (size_t)frame * (size_t)r->joints;
}

static const double *offset_at(const morph_motion *m, int frame) {
    return m->offset ? m->offset + 3 * (size_t)frame : NULL;
}

/* From the front left, raised: the sheet's upper side and the target beneath are both seen. */
static morph_view oblique(void) {
    return morph_view_from(-62 * M_PI / 180, 27 * M_PI / 180);
}

/* Nearly level: gaps show. */
static morph_view level(void) {
    return morph_view_from(-90 * M_PI / 180, 7 * M_PI / 180);
}

/* The ground under a pose belongs to the picture too. */
static void add_ground(const morph_record *r, const double *joints, const morph_view *view,
                       morph_bounds *bounds) {
    double lo[2], hi[2];
    if (!morph_ground(r, joints, lo, hi)) return;
    const double corner[12] = {lo[0], lo[1], r->base, hi[0], lo[1], r->base,
                               lo[0], hi[1], r->base, hi[0], hi[1], r->base};
    morph_bounds_add(bounds, view, corner, 4, NULL);
}

/* The same scale for all four moments. */
static void fit_moments(const morph_record *r, const morph_motion *m, const morph_box *box,
                        morph_view *view) {
    morph_bounds bounds = morph_bounds_empty();
    for (int k = 0; k < 4; k++) {
        int frame = moment(r, m, k);
        morph_bounds_add(&bounds, view, joints_at(r, m, frame), r->joints, NULL);
        morph_bounds_add(&bounds, view, r->target_v, r->target_vertices, offset_at(m, frame));
        add_ground(r, joints_at(r, m, frame), view, &bounds);
    }
    morph_view_fit(view, &bounds, box);
}

/* Panels a to f, as figures are cited. */
static void letter(cairo_t *c, int panel, double x, double y) {
    const char text[3] = {(char)('a' + panel), ')', 0};
    morph_put_text(c, text, x, y, 17, 0, true, morph_colour_faint);
}

static void caption(cairo_t *c, const morph_record *r, const morph_motion *m, int k, const morph_box *box) {
    static const char *const names[] = {"start", "one third", "two thirds", "end"};
    char text[64];
    snprintf(text, sizeof text, "t = %.2f s", m->time[moment(r, m, k)]);
    letter(c, k, box->x + 14, box->y + 26);
    morph_put_text(c, text, box->x + 40, box->y + 26, 17, 0, true, morph_colour_text);
    double after = morph_text_width(c, text, 17, true);
    morph_put_text(c, names[k], box->x + 52 + after, box->y + 26, 15, 0, false, morph_colour_faint);
}

static void frame_box(cairo_t *c, const morph_box *box) {
    cairo_set_line_width(c, 1);
    cairo_set_source_rgb(c, 0.86, 0.88, 0.90);
    cairo_rectangle(c, box->x + 0.5, box->y + 0.5, box->width - 1, box->height - 1);
    cairo_stroke(c);
}

static morph_box inside(const morph_box *box) {
    return (morph_box){box->x + 18, box->y + 30, box->width - 36, box->height - 44};
}

static morph_status draw_moment(cairo_t *c, const morph_record *r, const morph_motion *m, int k,
                                const morph_box *box, const morph_view *view, const morph_relief *relief) {
    int frame = moment(r, m, k);
    frame_box(c, box);
    cairo_save(c);
    cairo_rectangle(c, box->x, box->y, box->width, box->height);
    cairo_clip(c);
    morph_status status = morph_draw_pose(c, r, joints_at(r, m, frame), offset_at(m, frame), view, relief);
    cairo_restore(c);
    caption(c, r, m, k, box);
    return status;
}

/* Key to the colours, ending at the right edge. */
static void draw_key(cairo_t *c, double right, double y) {
    static const char *const names[] = {"target", "post", "top layer", "bottom layer"};
    const morph_colour colours[] = {morph_colour_target, morph_colour_post, morph_colour_top,
                                    morph_colour_bottom};
    for (int k = 0; k < 4; k++) {
        double width = morph_text_width(c, names[k], 14, false);
        morph_put_text(c, names[k], right, y, 14, 1, false, morph_colour_text);
        right -= width + 9;
        morph_set_colour(c, colours[k], 1);
        if (k == 0) {
            cairo_rectangle(c, right - 18, y - 11, 18, 13);
            cairo_fill_preserve(c);
            morph_set_colour(c, morph_colour_faint, 1);
            cairo_set_line_width(c, 0.8);
            cairo_stroke(c);
        } else {
            cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
            cairo_set_line_width(c, k == 1 ? 2.5 : 5);
            cairo_move_to(c, right - 20, y - 5);
            cairo_line_to(c, right - 2, y - 5);
            cairo_stroke(c);
            cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
        }
        right -= 44;
    }
}

/* A title longer than its room is cut at a whole UTF-8 sequence. */
static void draw_title(cairo_t *c, const char *title, double x, double y, double room) {
    char text[200];
    snprintf(text, sizeof text - 4, "%s", title);
    size_t n = strlen(text);
    bool cut = strlen(title) > n;
    while (n > 0 && (cut || morph_text_width(c, text, 24, true) > room)) {
        cut = false;
        do
            n--;
        while (n > 0 && ((unsigned char)title[n] & 0xC0) == 0x80);
        memcpy(text + n, "\xE2\x80\xA6", 4); /* an ellipsis */
    }
    morph_put_text(c, text, x, y, 24, 0, true, morph_colour_text);
}

/* What a record says of itself: it holds no title. */
static void own_title(const morph_record *r, const morph_motion *m, char *text, size_t size) {
    int nodes[2] = {0, 0};
    for (int i = 0; i < r->joints; i++)
        for (int k = 0; k < 2; k++)
            if (r->joint_node[i][k] >= nodes[k]) nodes[k] = r->joint_node[i][k] + 1;
    snprintf(text, size, "%d x %d nodes, %d links, %.2f s", nodes[0], nodes[1], r->links,
             m->frames > 0 ? m->time[m->frames - 1] : 0.0);
}

static morph_status draw_page(cairo_t *c, const morph_record *r, const char *title) {
    morph_motion m = morph_motion_schedule(r);
    if (m.frames == 0) m = morph_motion_nominal(r); /* the best of a run that never got to a schedule */
    cairo_set_source_rgb(c, 1, 1, 1);
    cairo_paint(c);
    draw_key(c, PAGE_WIDTH - 36, 46);
    char own[96];
    own_title(r, &m, own, sizeof own);
    draw_title(c, title ? title : own, 36, 48, PAGE_WIDTH - 580);
    const morph_box first = {36, 70, 656, 452};
    morph_box room = inside(&first);
    morph_view base = oblique();
    fit_moments(r, &m, &room, &base);
    morph_relief relief;
    morph_status status = morph_relief_create(r, &base, &relief);
    for (int k = 0; k < 4 && status == MORPH_OK; k++) {
        /* One view and one image of the target, carried to each box. */
        double right = k % 2 * (first.width + 16), down = k / 2 * (first.height + 16);
        cairo_save(c);
        cairo_translate(c, right, down);
        status = draw_moment(c, r, &m, k, &first, &base, &relief);
        cairo_restore(c);
    }
    const morph_box left = {28, 1018, 664, 372}, right = {700, 1018, 672, 372};
    if (status == MORPH_OK) status = morph_draw_length(c, r, &m, &left);
    if (status == MORPH_OK) status = morph_draw_lengths(c, r, &m, &right);
    letter(c, 4, left.x + 22, left.y + 18);
    letter(c, 5, right.x + 22, right.y + 18);
    morph_relief_free(&relief);
    return status;
}

morph_record morph_picture_pressed(const morph_record *r) {
    morph_record end = *r;
    if (!r->deformed_v || !r->deformed_t) return end;
    end.target_vertices = r->deformed_vertices;
    end.target_triangles = r->deformed_triangles;
    end.target_v = r->deformed_v;
    end.target_t = r->deformed_t;
    return end;
}

/* One panel of the page, for embedding. */
static morph_status draw_panel(cairo_t *c, const morph_record *r, int panel, const morph_box *box) {
    morph_motion m = morph_motion_schedule(r), nominal = morph_motion_nominal(r);
    const morph_motion *which = panel == 6 || (panel < 6 && m.frames == 0) ? &nominal : &m;
    if (which->frames == 0 || !which->joints || !which->lengths || !which->time) return MORPH_ERR_INPUT;
    if (panel == 4) return morph_draw_length(c, r, which, box);
    if (panel == 5) return morph_draw_lengths(c, r, which, box);
    morph_relief relief;
    morph_box room = inside(box);
    morph_view view = panel < 4 ? oblique() : level();
    if (panel < 4) {
        fit_moments(r, which, &room, &view);
    } else { /* both ends in one scale */
        morph_bounds bounds = morph_bounds_empty();
        const morph_motion *ends[] = {&nominal, &m};
        for (int k = 0; k < 2; k++)
            if (ends[k]->frames > 0) {
                const double *joints = joints_at(r, ends[k], ends[k]->frames - 1);
                morph_bounds_add(&bounds, &view, joints, r->joints, NULL);
                add_ground(r, joints, &view, &bounds);
            }
        morph_bounds_add(&bounds, &view, r->target_v, r->target_vertices, NULL);
        room = (morph_box){box->x + 10, box->y + 10, box->width - 20, box->height - 20};
        morph_view_fit(&view, &bounds, &room);
    }
    const morph_record shown = panel >= 3 ? morph_picture_pressed(r) : *r;
    morph_status status = morph_relief_create(&shown, &view, &relief);
    if (status == MORPH_OK && panel < 4) {
        status = draw_moment(c, &shown, which, panel, box, &view, &relief);
    } else if (status == MORPH_OK) {
        int end = which->frames - 1;
        status = morph_draw_pose(c, &shown, joints_at(r, which, end), offset_at(which, end), &view, &relief);
    }
    morph_relief_free(&relief);
    return status;
}

static cairo_status_t collect(void *closure, const unsigned char *data, unsigned int length) {
    morph_text *text = closure;
    morph_text_put(text, (const char *)data, length);
    return text->failed ? CAIRO_STATUS_NO_MEMORY : CAIRO_STATUS_SUCCESS;
}

/* What is drawn: the whole page of a record, or one of its panels. */
typedef struct drawing {
    const morph_record *record;
    const char *title;
    int panel; /* -1: the page */
    const morph_box *box;
} drawing;

static morph_status draw_record(cairo_t *c, const void *data) {
    const drawing *d = data;
    return d->panel < 0 ? draw_page(c, d->record, d->title) : draw_panel(c, d->record, d->panel, d->box);
}

/* The surface is drawn, finished and destroyed. */
static morph_status render(cairo_surface_t *surface, morph_draw draw, const void *data, bool png,
                           morph_text *out) {
    cairo_t *c = cairo_create(surface);
    morph_status status = draw(c, data);
    cairo_status_t drawn = cairo_status(c);
    cairo_destroy(c);
    if (status == MORPH_OK && drawn == CAIRO_STATUS_SUCCESS && png)
        drawn = cairo_surface_write_to_png_stream(surface, collect, out);
    cairo_surface_finish(surface);
    if (drawn == CAIRO_STATUS_SUCCESS) drawn = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    if (status == MORPH_OK && (drawn == CAIRO_STATUS_NO_MEMORY || out->failed)) status = MORPH_ERR_NOMEM;
    if (status == MORPH_OK && drawn != CAIRO_STATUS_SUCCESS) status = MORPH_ERR_BACKEND;
    return status;
}

static bool ends_with(const char *file, const char *ending) {
    size_t n = strlen(file), m = strlen(ending);
    return n > m && strcasecmp(file + n - m, ending) == 0;
}

morph_status morph_picture_ending(const char *file, char *message, size_t size) {
    if (ends_with(file, ".png") || ends_with(file, ".svg")) return MORPH_OK;
    return morph_fail(MORPH_ERR_INPUT, message, size, "%s: the name must end in .svg or .png", file);
}

morph_status morph_picture_file(const char *file, int width, int height, morph_draw draw, const void *data,
                                char *message, size_t size) {
    const bool png = ends_with(file, ".png");
    morph_locale locale;
    if (!morph_locale_enter(&locale))
        return morph_fail(MORPH_ERR_NOMEM, message, size, "%s: out of memory", file);
    morph_text text = {0};
    cairo_surface_t *surface = png ? cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height)
                                   : cairo_svg_surface_create_for_stream(collect, &text, width, height);
    morph_status status = render(surface, draw, data, png, &text);
    morph_locale_leave(&locale);
    if (status == MORPH_OK)
        status = morph_file_replace(file, text.data, text.size, message, size);
    else
        morph_fail(status, message, size, "%s: cannot be drawn: %s", file, morph_status_text(status));
    morph_text_free(&text);
    return status;
}

morph_status morph_picture_drawable(const morph_record *record, const char *file, char *message,
                                    size_t size) {
    if (drawable(record)) return MORPH_OK;
    return morph_fail(MORPH_ERR_INPUT, message, size,
                      "%s: the plan holds a number that is not finite and cannot be drawn", file);
}

morph_status morph_picture_write(const morph_record *record, const char *title, const char *file,
                                 char *message, size_t size) {
    morph_status status = morph_picture_ending(file, message, size);
    if (status != MORPH_OK) return status;
    if (record->samples == 0 && record->nominal_frames == 0)
        return morph_fail(MORPH_ERR_INPUT, message, size, "%s: the plan holds no motion to draw", file);
    status = morph_picture_drawable(record, file, message, size);
    if (status != MORPH_OK) return status;
    const drawing page = {record, title, -1, NULL};
    return morph_picture_file(file, PAGE_WIDTH, PAGE_HEIGHT, draw_record, &page, message, size);
}

/* Cairo numbers its symbols alike in every picture; on one page they must differ. Every id and every
 * reference to one gets the panel in front; what stands before <svg is left out. */
static void embed(const morph_text *svg, int panel, morph_text *out) {
    static const char *const marks[] = {" id=\"", "href=\"#", "url(#"};
    const char *from = strstr(svg->data, "<svg");
    if (!from) return;
    const char *at = from;
    while (*at) {
        size_t length = 0;
        for (int k = 0; k < 3 && length == 0; k++)
            if (strncmp(at, marks[k], strlen(marks[k])) == 0) length = strlen(marks[k]);
        at += length > 0 ? length : 1;
        if (length == 0) continue;
        morph_text_put(out, from, (size_t)(at - from));
        morph_text_add(out, "p%d-", panel);
        from = at;
    }
    morph_text_put(out, from, (size_t)(at - from));
}

morph_status morph_picture_svg(const morph_record *record, int panel, double width, double height,
                               char **text) {
    *text = NULL;
    /* Less has no room for axes; more is no panel of a page. */
    if (panel < 0 || panel > 7 || !(width >= 200 && width <= 10000 && height >= 120 && height <= 10000) ||
        !drawable(record))
        return MORPH_ERR_INPUT;
    morph_locale locale;
    if (!morph_locale_enter(&locale)) return MORPH_ERR_NOMEM;
    morph_text svg = {0}, out = {0};
    const morph_box box = {0, 0, width, height};
    cairo_surface_t *surface = cairo_svg_surface_create_for_stream(collect, &svg, width, height);
    const drawing one = {record, NULL, panel, &box};
    morph_status status = render(surface, draw_record, &one, false, &svg);
    if (status == MORPH_OK && svg.data) embed(&svg, panel, &out);
    if (status == MORPH_OK && (out.failed || !out.data)) status = MORPH_ERR_NOMEM;
    morph_locale_leave(&locale);
    morph_text_free(&svg);
    if (status == MORPH_OK)
        *text = out.data;
    else
        morph_text_free(&out);
    return status;
}
