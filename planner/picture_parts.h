/* The parts that still pictures are made of. Internal. Lengths on paper are in points (pixels of a PNG), y
 * down; world coordinates in m, z up. */
#ifndef MORPH_PICTURE_PARTS_H
#define MORPH_PICTURE_PARTS_H

#include "planner/record.h"

#include <cairo.h>

typedef struct morph_colour {
    double r, g, b;
} morph_colour;

extern const morph_colour morph_colour_bottom, morph_colour_top, morph_colour_post, morph_colour_joint,
    morph_colour_target, morph_colour_text, morph_colour_faint, morph_colour_limit;
void morph_set_colour(cairo_t *c, morph_colour colour, double alpha);

/* Text with its anchor at (x, y): ax 0 left, 0.5 centre, 1 right; y is the base line. */
void morph_put_text(cairo_t *c, const char *text, double x, double y, double size, double ax, bool bold,
                    morph_colour colour);
double morph_text_width(cairo_t *c, const char *text, double size, bool bold);

/* A rectangle on paper. */
typedef struct morph_box {
    double x, y, width, height;
} morph_box;

/* A motion of the structure: the schedule, or the blanket where there is none. Points into the record. */
typedef struct morph_motion {
    int frames;
    const double *time, *joints, *lengths;
    const double *offset; /* of the target, 3 per frame; NULL: none */
} morph_motion;
morph_motion morph_motion_schedule(const morph_record *record);
morph_motion morph_motion_nominal(const morph_record *record);

/* Orthographic view: orthonormal axes; `toward` points at the eye. */
typedef struct morph_view {
    double right[3], up[3], toward[3];
    double scale;    /* points per m */
    double shift[2]; /* paper = shift + scale * (right.p, -up.p) */
} morph_view;

/* Azimuth from the x axis and elevation of the eye, radians; scale 1, no shift. */
morph_view morph_view_from(double azimuth, double elevation);
/* x, y on paper and depth (m, larger is nearer). */
void morph_view_point(const morph_view *view, const double p[3], double out[3]);

/* Bounds of projected points at scale 1; grown by morph_bounds_add. */
typedef struct morph_bounds {
    double lo[2], hi[2];
} morph_bounds;
morph_bounds morph_bounds_empty(void);
void morph_bounds_add(morph_bounds *bounds, const morph_view *view, const double *points, int count,
                      const double *offset);
/* Scales and shifts the view so that the bounds sit in the middle of the box. */
void morph_view_fit(morph_view *view, const morph_bounds *bounds, const morph_box *box);

/* The target as an image with depths; drawn once for a view and used at every offset (orthographic: an offset
 * only moves it). */
typedef struct morph_relief {
    int width, height;       /* of the depth samples */
    double left, top, fine;  /* paper position of the first sample at offset zero; samples per point */
    float *depth;            /* -INFINITY where nothing is */
    cairo_surface_t *shaded; /* half as many samples each way */
} morph_relief;
/* Zeroed is empty (no target). MORPH_ERR_NOMEM, MORPH_ERR_BACKEND. */
morph_status morph_relief_create(const morph_record *record, const morph_view *view, morph_relief *out);
void morph_relief_free(morph_relief *relief);
void morph_relief_paint(cairo_t *c, const morph_relief *relief, const morph_view *view, const double *offset);
/* Is a point at this paper position and depth in front of the target? `slack` in m. */
bool morph_relief_shows(const morph_relief *relief, const morph_view *view, const double *offset,
                        const double at[3], double slack);

/* The rectangle of the base plane under a pose, on whole spacings; false: no base plane to draw. */
bool morph_ground(const morph_record *record, const double *joints, double lo[2], double hi[2]);

/* One pose with target and ground; joints: 3*record->joints. */
morph_status morph_draw_pose(cairo_t *c, const morph_record *record, const double *joints,
                             const double *offset, const morph_view *view, const morph_relief *relief);

/* Charts: one link, all links. The one is that of the bottom layer's middle (no further from it than two
 * spacings) whose length changes most. */
int morph_middle_link(const morph_record *record, const morph_motion *motion);
morph_status morph_draw_length(cairo_t *c, const morph_record *record, const morph_motion *motion,
                               const morph_box *box);
morph_status morph_draw_lengths(cairo_t *c, const morph_record *record, const morph_motion *motion,
                                const morph_box *box);

/* The record with a deformable target as it is at the end. Borrows everything. */
morph_record morph_picture_pressed(const morph_record *record);

/* Files: an ending that is not taken and numbers that are not finite are refused with a message; then `draw`
 * fills a page of width x height points. */
typedef morph_status (*morph_draw)(cairo_t *c, const void *data);
morph_status morph_picture_ending(const char *file, char *message, size_t size);
morph_status morph_picture_drawable(const morph_record *record, const char *file, char *message, size_t size);
morph_status morph_picture_file(const char *file, int width, int height, morph_draw draw, const void *data,
                                char *message, size_t size);

/* About `wanted` ticks at 1, 2 or 5 times a power of ten within [lo, hi]; *first is the first, *count their
 * number, *digits after the decimal point. Returns the step. */
double morph_ticks(double lo, double hi, int wanted, double *first, int *count, int *digits);

#endif
