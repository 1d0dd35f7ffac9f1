/* The target by depth samples: hidden parts come out right whatever the triangles, and a picture does not
 * grow with their number. */
#include "planner/picture_parts.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Samples of one image at most: 50 MB while it is made. */
#define MOST_SAMPLES 6e6
#define SAMPLES_PER_POINT 4.0

typedef struct canvas {
    morph_relief *relief;
    const morph_record *record;
    const morph_view *view;
    int *owner;    /* triangle seen at a sample, -1 */
    float *normal; /* 3 per triangle: along right, up, toward of the view, turned to the eye */
} canvas;

static const double *vertex(const canvas *k, int triangle, int corner) {
    return k->record->target_v + 3 * (size_t)k->record->target_t[3 * (size_t)triangle + (size_t)corner];
}

static void set_normal(canvas *k, int t) {
    double e[3], f[3], n[3];
    morph_sub(vertex(k, t, 1), vertex(k, t, 0), e);
    morph_sub(vertex(k, t, 2), vertex(k, t, 0), f);
    morph_cross(e, f, n);
    double size = morph_norm(n), turn = morph_dot(n, k->view->toward) < 0 ? -1 : 1;
    float *out = k->normal + 3 * (size_t)t;
    out[0] = (float)(size > 0 ? turn * morph_dot(n, k->view->right) / size : 0);
    out[1] = (float)(size > 0 ? turn * morph_dot(n, k->view->up) / size : 0);
    out[2] = (float)(size > 0 ? turn * morph_dot(n, k->view->toward) / size : 1);
}

static int clamp_index(double x, int below) {
    return x < 0 ? 0 : x > below - 1 ? below - 1 : (int)x;
}

/* A function that is linear over the picture: c[0] + c[1] u + c[2] v. */
typedef struct linear {
    double c[3];
} linear;

/* Barycentric weight of corner i of the triangle p: twice the area of (a, b, sample) over twice its own. */
static linear weight_of(double (*p)[3], int i, double area) {
    const double *a = p[(i + 1) % 3], *b = p[(i + 2) % 3];
    linear w = {{0, -(b[1] - a[1]) / area, (b[0] - a[0]) / area}};
    w.c[0] = -w.c[1] * a[0] - w.c[2] * a[1];
    return w;
}

/* The nearest triangle wins at every sample. */
static void raster(canvas *k, int t) {
    morph_relief *r = k->relief;
    double p[3][3], lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        morph_view_point(k->view, vertex(k, t, i), p[i]);
        p[i][0] = (p[i][0] - r->left) * r->fine;
        p[i][1] = (p[i][1] - r->top) * r->fine;
        for (int d = 0; d < 2; d++) {
            lo[d] = fmin(lo[d], p[i][d]);
            hi[d] = fmax(hi[d], p[i][d]);
        }
    }
    double area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    if (!(fabs(area) > 1e-12)) return; /* seen edge on */
    const linear w0 = weight_of(p, 0, area), w1 = weight_of(p, 1, area);
    int x0 = clamp_index(floor(lo[0]), r->width), x1 = clamp_index(ceil(hi[0]), r->width);
    int y0 = clamp_index(floor(lo[1]), r->height), y1 = clamp_index(ceil(hi[1]), r->height);
    for (int y = y0; y <= y1; y++) {
        double a0 = w0.c[0] + w0.c[2] * (y + 0.5), a1 = w1.c[0] + w1.c[2] * (y + 0.5);
        for (int x = x0; x <= x1; x++) {
            double f0 = a0 + w0.c[1] * (x + 0.5), f1 = a1 + w1.c[1] * (x + 0.5), f2 = 1 - f0 - f1;
            if (f0 < 0 || f1 < 0 || f2 < 0) continue;
            float depth = (float)(f0 * p[0][2] + f1 * p[1][2] + f2 * p[2][2]);
            size_t at = (size_t)y * (size_t)r->width + (size_t)x;
            if (depth <= r->depth[at]) continue;
            r->depth[at] = depth;
            k->owner[at] = t;
        }
    }
}

/* Outlines and creases are drawn dark: faces that meet at more than about 35 degrees, and steps in depth that
 * the slope of the face does not explain. */
static bool is_edge(const canvas *k, int x, int y) {
    const morph_relief *r = k->relief;
    size_t at = (size_t)y * (size_t)r->width + (size_t)x;
    const float *n = k->normal + 3 * (size_t)k->owner[at];
    const int step[2][2] = {{1, 0}, {0, 1}};
    for (int i = 0; i < 2; i++) {
        int u = x + step[i][0], v = y + step[i][1];
        if (u >= r->width || v >= r->height) return true;
        size_t beside = (size_t)v * (size_t)r->width + (size_t)u;
        if (k->owner[beside] < 0) return true;
        const float *m = k->normal + 3 * (size_t)k->owner[beside];
        float along = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
        if (along < 0.82F) return true;
        double sample = 1 / (r->fine * k->view->scale), slope = fmax(fmin(n[2], m[2]), 0.08);
        if (fabs((double)r->depth[at] - (double)r->depth[beside]) > 6 * sample / slope) return true;
    }
    return false;
}

/* Lambert's law, light from the upper left over the viewer's shoulder, and enough of it from all sides that
 * no face is black. */
static double brightness(const float n[3]) {
    const double light[3] = {-0.42, 0.62, 0.66};
    double lambert = n[0] * light[0] + n[1] * light[1] + n[2] * light[2];
    return 0.50 + 0.52 * fmax(lambert, 0);
}

static void add_sample(const canvas *k, int x, int y, double sum[4]) {
    size_t at = (size_t)y * (size_t)k->relief->width + (size_t)x;
    if (k->owner[at] < 0) return;
    double f = brightness(k->normal + 3 * (size_t)k->owner[at]);
    if (is_edge(k, x, y)) f *= 0.55;
    sum[0] += fmin(f * morph_colour_target.r, 1);
    sum[1] += fmin(f * morph_colour_target.g, 1);
    sum[2] += fmin(f * morph_colour_target.b, 1);
    sum[3] += 1;
}

/* Four samples make a pixel: smooth outlines. Alpha is premultiplied, as cairo wants it. */
static morph_status shade(canvas *k) {
    morph_relief *r = k->relief;
    int width = r->width / 2, height = r->height / 2;
    r->shaded = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height);
    if (cairo_surface_status(r->shaded) != CAIRO_STATUS_SUCCESS) return MORPH_ERR_NOMEM;
    cairo_surface_flush(r->shaded);
    unsigned char *data = cairo_image_surface_get_data(r->shaded);
    size_t stride = (size_t)cairo_image_surface_get_stride(r->shaded);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double sum[4] = {0, 0, 0, 0};
            for (int i = 0; i < 4; i++)
                add_sample(k, 2 * x + i % 2, 2 * y + i / 2, sum);
            uint32_t byte[4];
            for (int i = 0; i < 4; i++)
                byte[i] = (uint32_t)lround(255 * sum[i] / 4);
            uint32_t pixel = byte[3] << 24 | byte[0] << 16 | byte[1] << 8 | byte[2];
            memcpy(data + (size_t)y * stride + 4 * (size_t)x, &pixel, sizeof pixel);
        }
    cairo_surface_mark_dirty(r->shaded);
    return MORPH_OK;
}

/* Sizes the canvas to the target's own outline, two points of room around. */
static void place(const morph_record *record, const morph_view *view, morph_relief *out) {
    morph_view plain = *view;
    morph_bounds b = morph_bounds_empty();
    morph_bounds_add(&b, &plain, record->target_v, record->target_vertices, NULL);
    out->left = view->shift[0] + view->scale * b.lo[0] - 2;
    out->top = view->shift[1] + view->scale * b.lo[1] - 2;
    double w = view->scale * (b.hi[0] - b.lo[0]) + 4, h = view->scale * (b.hi[1] - b.lo[1]) + 4;
    out->fine = fmin(SAMPLES_PER_POINT, sqrt(MOST_SAMPLES / (w * h)));
    out->width = 2 * (int)fmin(fmax(ceil(w * out->fine / 2), 1), 16000);
    out->height = 2 * (int)fmin(fmax(ceil(h * out->fine / 2), 1), 16000);
}

morph_status morph_relief_create(const morph_record *record, const morph_view *view, morph_relief *out) {
    *out = (morph_relief){0};
    if (record->target_triangles == 0 || record->target_vertices == 0) return MORPH_OK;
    place(record, view, out);
    size_t samples = (size_t)out->width * (size_t)out->height;
    canvas k = {.relief = out, .record = record, .view = view};
    out->depth = morph_alloc(samples, sizeof *out->depth);
    k.owner = morph_alloc(samples, sizeof *k.owner);
    k.normal = morph_alloc((size_t)record->target_triangles, 3 * sizeof *k.normal);
    morph_status status = out->depth && k.owner && k.normal ? MORPH_OK : MORPH_ERR_NOMEM;
    if (status == MORPH_OK) {
        for (size_t i = 0; i < samples; i++) {
            out->depth[i] = -INFINITY;
            k.owner[i] = -1;
        }
        for (int t = 0; t < record->target_triangles; t++) {
            set_normal(&k, t);
            raster(&k, t);
        }
        status = shade(&k);
    }
    free(k.owner);
    free(k.normal);
    if (status != MORPH_OK) morph_relief_free(out);
    return status;
}

void morph_relief_free(morph_relief *relief) {
    free(relief->depth);
    if (relief->shaded) cairo_surface_destroy(relief->shaded);
    *relief = (morph_relief){0};
}

/* How far an offset of the target moves it on paper (0, 1) and in depth (2). */
static void moved(const morph_view *view, const double *offset, double out[3]) {
    out[0] = offset ? view->scale * morph_dot(view->right, offset) : 0;
    out[1] = offset ? -view->scale * morph_dot(view->up, offset) : 0;
    out[2] = offset ? morph_dot(view->toward, offset) : 0;
}

void morph_relief_paint(cairo_t *c, const morph_relief *relief, const morph_view *view,
                        const double *offset) {
    if (!relief->shaded) return;
    double by[3];
    moved(view, offset, by);
    cairo_save(c);
    cairo_translate(c, relief->left + by[0], relief->top + by[1]);
    cairo_scale(c, 2 / relief->fine, 2 / relief->fine);
    cairo_set_source_surface(c, relief->shaded, 0, 0);
    cairo_paint(c);
    cairo_restore(c);
}

bool morph_relief_shows(const morph_relief *relief, const morph_view *view, const double *offset,
                        const double at[3], double slack) {
    if (!relief->depth) return true;
    double by[3];
    moved(view, offset, by);
    double x = (at[0] - by[0] - relief->left) * relief->fine;
    double y = (at[1] - by[1] - relief->top) * relief->fine;
    if (!(x >= 0 && y >= 0 && x < relief->width && y < relief->height)) return true;
    double depth = (double)relief->depth[(size_t)y * (size_t)relief->width + (size_t)x] + by[2];
    return at[2] + slack >= depth;
}
