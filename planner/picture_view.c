/* Views, and the structure drawn in one. */
#include "planner/picture_parts.h"

#include "model/structure.h"

#include <stdlib.h>
#include <string.h>

/* Blue and orange are told apart by every kind of colour vision, and in grey. */
const morph_colour morph_colour_bottom = {0.05, 0.37, 0.62}, morph_colour_top = {0.90, 0.49, 0.13},
                   morph_colour_post = {0.42, 0.44, 0.47}, morph_colour_joint = {0.16, 0.18, 0.21},
                   morph_colour_target = {0.90, 0.85, 0.75}, morph_colour_text = {0.13, 0.15, 0.18},
                   morph_colour_faint = {0.45, 0.48, 0.52}, morph_colour_limit = {0.72, 0.16, 0.16};

void morph_set_colour(cairo_t *c, morph_colour colour, double alpha) {
    cairo_set_source_rgba(c, colour.r, colour.g, colour.b, alpha);
}

morph_view morph_view_from(double azimuth, double elevation) {
    double ca = cos(azimuth), sa = sin(azimuth), ce = cos(elevation), se = sin(elevation);
    morph_view view = {.right = {-sa, ca, 0},
                       .up = {-se * ca, -se * sa, ce},
                       .toward = {ce * ca, ce * sa, se},
                       .scale = 1,
                       .shift = {0, 0}};
    return view;
}

void morph_view_point(const morph_view *view, const double p[3], double out[3]) {
    out[0] = view->shift[0] + view->scale * morph_dot(view->right, p);
    out[1] = view->shift[1] - view->scale * morph_dot(view->up, p);
    out[2] = morph_dot(view->toward, p);
}

morph_bounds morph_bounds_empty(void) {
    return (morph_bounds){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
}

void morph_bounds_add(morph_bounds *bounds, const morph_view *view, const double *points, int count,
                      const double *offset) {
    for (int i = 0; i < count; i++) {
        double p[3], at[2];
        for (int k = 0; k < 3; k++)
            p[k] = points[3 * (size_t)i + (size_t)k] + (offset ? offset[k] : 0);
        at[0] = morph_dot(view->right, p);
        at[1] = -morph_dot(view->up, p);
        for (int k = 0; k < 2; k++) {
            bounds->lo[k] = fmin(bounds->lo[k], at[k]);
            bounds->hi[k] = fmax(bounds->hi[k], at[k]);
        }
    }
}

void morph_view_fit(morph_view *view, const morph_bounds *bounds, const morph_box *box) {
    double w = bounds->hi[0] - bounds->lo[0], h = bounds->hi[1] - bounds->lo[1];
    if (!(w >= 0) || !(h >= 0) || !isfinite(w + h)) return; /* nothing to show */
    /* A single point still needs a finite scale. */
    double scale = fmin(box->width / fmax(w, 1e-9), box->height / fmax(h, 1e-9));
    view->scale = scale;
    view->shift[0] = box->x + box->width / 2 - scale * (bounds->lo[0] + bounds->hi[0]) / 2;
    view->shift[1] = box->y + box->height / 2 - scale * (bounds->lo[1] + bounds->hi[1]) / 2;
}

/* What is drawn in order of depth, far ones first. */
typedef enum piece_kind { PIECE_SKIN, PIECE_POST, PIECE_LINK, PIECE_JOINT } piece_kind;
typedef struct piece {
    double depth;
    piece_kind kind;
    int index;
} piece;

typedef struct scene_view {
    cairo_t *c;
    const morph_record *record;
    const double *offset;
    const morph_view *view;
    const morph_relief *relief;
    double *at; /* 3 per joint: paper and depth */
    double near, far;
} scene_view;

static int by_depth(const void *a, const void *b) {
    const piece *p = a, *q = b;
    if (p->depth != q->depth) return p->depth < q->depth ? -1 : 1;
    if (p->kind != q->kind) return p->kind < q->kind ? -1 : 1;
    return (p->index > q->index) - (p->index < q->index); /* equal depths must not depend on qsort */
}

/* Far parts are paler: depth is read at a glance. */
static morph_colour hazy(const scene_view *s, morph_colour colour, double depth) {
    double range = s->near - s->far, f = range > 0 ? 0.38 * (s->near - depth) / range : 0;
    return (morph_colour){colour.r + f * (1 - colour.r), colour.g + f * (1 - colour.g),
                          colour.b + f * (1 - colour.b)};
}

static morph_colour darker(morph_colour colour, double f) {
    return (morph_colour){colour.r * f, colour.g * f, colour.b * f};
}

static double median_radius(const morph_record *r) {
    return r->links > 0 ? r->link_radius[r->links / 2] : 0.04 * r->spacing;
}

/* Width on paper of a capsule: true to scale, but never a hair nor a sausage. */
static double stroke_width(const scene_view *s, double radius) {
    return fmin(fmax(2 * radius * s->view->scale, 2.0), 9.0);
}

static bool shows(const scene_view *s, const double at[3]) {
    /* Axes keep a radius away from the target; half of it forgives the grain of the depth samples. */
    return morph_relief_shows(s->relief, s->view, s->offset, at, 0.5 * median_radius(s->record));
}

static void stroke_part(const scene_view *s, const double a[3], const double b[3], double from, double to,
                        double width, morph_colour colour, bool visible) {
    cairo_t *c = s->c;
    cairo_move_to(c, a[0] + from * (b[0] - a[0]), a[1] + from * (b[1] - a[1]));
    cairo_line_to(c, a[0] + to * (b[0] - a[0]), a[1] + to * (b[1] - a[1]));
    if (!visible) { /* behind the target: a trace of it, so that the sheet stays a whole */
        cairo_set_line_width(c, fmax(0.35 * width, 0.8));
        morph_set_colour(c, colour, 0.22);
        cairo_stroke(c);
        return;
    }
    cairo_set_line_width(c, width + 1.4);
    cairo_set_source_rgba(c, 1, 1, 1, 0.85); /* a light rim sets crossing links apart */
    cairo_stroke_preserve(c);
    cairo_set_line_width(c, width);
    morph_set_colour(c, darker(colour, 0.82), 1);
    cairo_stroke_preserve(c);
    cairo_set_line_width(c, 0.55 * width);
    morph_set_colour(c, colour, 1);
    cairo_stroke(c);
}

/* A line between two joints, cut where it goes behind the target. */
static void draw_line(const scene_view *s, int ja, int jb, double width, morph_colour colour) {
    enum { PARTS = 12 };
    const double *a = s->at + 3 * (size_t)ja, *b = s->at + 3 * (size_t)jb;
    bool state = false;
    int from = 0;
    morph_colour shade = hazy(s, colour, 0.5 * (a[2] + b[2]));
    for (int k = 0; k <= PARTS; k++) {
        double f = (k + 0.5) / PARTS, at[3];
        for (int d = 0; d < 3; d++)
            at[d] = a[d] + f * (b[d] - a[d]);
        bool now = k < PARTS ? shows(s, at) : !state;
        if (k > 0 && now != state) {
            stroke_part(s, a, b, (double)from / PARTS, (double)k / PARTS, width, shade, state);
            from = k;
        }
        state = now;
    }
}

static void draw_skin(const scene_view *s, int index) {
    const int *t = s->record->skin[index];
    double middle[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            middle[d] += s->at[3 * (size_t)t[k] + (size_t)d] / 3;
    /* Skin lies on the target, and its triangles may dip in: hidden is only what is well behind. */
    if (!morph_relief_shows(s->relief, s->view, s->offset, middle, 0.3 * s->record->spacing)) return;
    for (int k = 0; k < 3; k++)
        cairo_line_to(s->c, s->at[3 * (size_t)t[k]], s->at[3 * (size_t)t[k] + 1]);
    cairo_close_path(s->c);
    morph_set_colour(s->c, hazy(s, (morph_colour){0.42, 0.66, 0.86}, middle[2]), 0.42);
    cairo_fill(s->c);
}

static void draw_joint(const scene_view *s, int joint) {
    const double *at = s->at + 3 * (size_t)joint;
    if (!shows(s, at)) return;
    bool top = s->record->joint_layer[joint] == 1;
    double radius = 0.72 * stroke_width(s, median_radius(s->record));
    cairo_arc(s->c, at[0], at[1], radius, 0, 2 * M_PI);
    morph_set_colour(s->c, hazy(s, darker(top ? morph_colour_top : morph_colour_bottom, 0.55), at[2]), 1);
    cairo_fill(s->c);
}

static void draw_piece(const scene_view *s, const piece *p) {
    const morph_record *r = s->record;
    double width;
    switch (p->kind) {
    case PIECE_SKIN:
        draw_skin(s, p->index);
        break;
    case PIECE_POST:
        width = fmax(0.5 * stroke_width(s, median_radius(r)), 1.2);
        draw_line(s, r->post[p->index][0], r->post[p->index][1], width, morph_colour_post);
        break;
    case PIECE_LINK:
        width = stroke_width(s, r->link_radius[p->index]);
        draw_line(s, r->link[p->index][0], r->link[p->index][1],
                  r->link_kind[p->index] == MORPH_LINK_BRACE ? 0.6 * width : width,
                  r->link_kind[p->index] == MORPH_LINK_TOP      ? morph_colour_top
                  : r->link_kind[p->index] == MORPH_LINK_BOTTOM ? morph_colour_bottom
                                                                : morph_colour_post);
        break;
    case PIECE_JOINT:
        draw_joint(s, p->index);
        break;
    }
}

static double mean_depth(const scene_view *s, const int *joint, int n) {
    double sum = 0;
    for (int k = 0; k < n; k++)
        sum += s->at[3 * (size_t)joint[k] + 2];
    return sum / n;
}

/* Joints are set a little nearer than the links that end in them. */
static int list_pieces(const scene_view *s, piece *list) {
    const morph_record *r = s->record;
    int n = 0;
    for (int i = 0; i < r->skin_triangles; i++)
        list[n++] = (piece){mean_depth(s, r->skin[i], 3) - 0.05 * r->spacing, PIECE_SKIN, i};
    for (int i = 0; i < r->posts; i++)
        list[n++] = (piece){mean_depth(s, r->post[i], 2), PIECE_POST, i};
    for (int i = 0; i < r->links; i++)
        list[n++] = (piece){mean_depth(s, r->link[i], 2), PIECE_LINK, i};
    for (int i = 0; i < r->joints; i++)
        list[n++] = (piece){s->at[3 * (size_t)i + 2] + 0.5 * r->spacing, PIECE_JOINT, i};
    return n;
}

bool morph_ground(const morph_record *record, const double *joints, double lo[2], double hi[2]) {
    if (!isfinite(record->base) || record->joints == 0) return false;
    for (size_t k = 0; k < 2; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
        for (size_t i = 0; i < (size_t)record->joints; i++) {
            lo[k] = fmin(lo[k], joints[3 * i + k]);
            hi[k] = fmax(hi[k], joints[3 * i + k]);
        }
        lo[k] = record->spacing * floor(lo[k] / record->spacing + 1e-6);
        hi[k] = record->spacing * ceil(hi[k] / record->spacing - 1e-6);
        if (!(hi[k] - lo[k] < 400 * record->spacing)) return false; /* no grid that anyone could see */
    }
    return true;
}

/* Base plane: a faint grid, a spacing apart, and the shadow that the structure casts straight down. */
static void draw_ground(const scene_view *s, const double *joints) {
    const morph_record *r = s->record;
    double lo[2], hi[2];
    if (!morph_ground(r, joints, lo, hi)) return;
    cairo_t *c = s->c;
    cairo_set_line_width(c, 0.7);
    cairo_set_source_rgba(c, 0.55, 0.6, 0.66, 0.35);
    for (int k = 0; k < 2; k++)
        for (long g = lround(lo[k] / r->spacing); g <= lround(hi[k] / r->spacing); g++) {
            double p[3] = {0, 0, r->base}, a[3], b[3];
            p[k] = (double)g * r->spacing;
            p[1 - k] = lo[1 - k];
            morph_view_point(s->view, p, a);
            p[1 - k] = hi[1 - k];
            morph_view_point(s->view, p, b);
            cairo_move_to(c, a[0], a[1]);
            cairo_line_to(c, b[0], b[1]);
        }
    cairo_stroke(c);
    for (int i = 0; i < r->skin_triangles; i++) {
        cairo_new_sub_path(c);
        for (int k = 0; k < 3; k++) {
            const double *x = joints + 3 * (size_t)r->skin[i][k];
            double p[3] = {x[0], x[1], r->base}, at[3];
            morph_view_point(s->view, p, at);
            cairo_line_to(c, at[0], at[1]);
        }
        cairo_close_path(c);
    }
    cairo_set_source_rgba(c, 0.2, 0.25, 0.32, 0.11);
    cairo_fill(c); /* all triangles at once: one even tone */
}

morph_status morph_draw_pose(cairo_t *c, const morph_record *record, const double *joints,
                             const double *offset, const morph_view *view, const morph_relief *relief) {
    size_t most = (size_t)record->skin_triangles + (size_t)record->posts + (size_t)record->links +
                  (size_t)record->joints;
    piece *list = morph_alloc(most, sizeof *list);
    double *at = morph_alloc((size_t)record->joints, 3 * sizeof *at);
    if (!list || !at) {
        free(list);
        free(at);
        return MORPH_ERR_NOMEM;
    }
    scene_view s = {c, record, offset, view, relief, at, -INFINITY, INFINITY};
    for (size_t i = 0; i < (size_t)record->joints; i++) {
        morph_view_point(view, joints + 3 * i, at + 3 * i);
        s.near = fmax(s.near, at[3 * i + 2]);
        s.far = fmin(s.far, at[3 * i + 2]);
    }
    cairo_save(c);
    cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    draw_ground(&s, joints);
    morph_relief_paint(c, relief, view, offset);
    int n = list_pieces(&s, list);
    qsort(list, (size_t)n, sizeof *list, by_depth);
    for (int i = 0; i < n; i++)
        draw_piece(&s, &list[i]);
    cairo_restore(c);
    free(list);
    free(at);
    return MORPH_OK;
}
