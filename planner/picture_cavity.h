/* The parts of the picture of cavities before and after. Internal. */
#ifndef MORPH_PICTURE_CAVITY_H
#define MORPH_PICTURE_CAVITY_H

#include "model/cavity_section.h"
#include "planner/picture_parts.h"

/* From pale to dark without a turn in brightness: read alike by every kind of colour vision, and in grey. The
 * fill of cavities in the cuts is a tone of the same scale: more colour is more air. */
typedef struct morph_gap_scale {
    double step; /* width of a tone: 1, 2 or 5 times a power of ten, m */
    int tones;
} morph_gap_scale;
morph_gap_scale morph_gap_scale_to(double most); /* from 0 to at least `most` (m, above 0) */
morph_colour morph_gap_colour(const morph_gap_scale *scale, int tone);
extern const morph_colour morph_colour_cavity;

/* The skin in small triangles with the gap of each. Owned. */
typedef struct morph_gap_patch {
    double corner[3][3], gap[3]; /* of each corner, m; linear in between */
} morph_gap_patch;
typedef struct morph_gap_skin {
    int patches;
    morph_gap_patch *patch;
    double most; /* largest gap of a corner, m */
} morph_gap_skin;

/* x: 3*joints. MORPH_ERR_NOMEM. */
morph_status morph_gap_skin_create(const morph_cavity *cavity, const double *x, morph_gap_skin *out);
void morph_gap_skin_free(morph_gap_skin *skin);

/* What is seen of one end from obliquely above, all of it inside the box. */
typedef struct morph_gap_view {
    const morph_record *record;
    const double *x; /* 3*joints, as seen from the target */
    const morph_gap_skin *skin;
    const morph_cavity_section *cut; /* two: their lines are drawn on the skin, lettered A and B */
    morph_gap_scale scale;
} morph_gap_view;
morph_status morph_draw_gap(cairo_t *c, const morph_gap_view *what, const morph_view *view,
                            const morph_relief *relief, const morph_box *box);

/* The tones with their limits below and their meaning above; the box is the bar's. */
void morph_draw_gap_scale(cairo_t *c, const morph_gap_scale *scale, const morph_box *bar);

/* One cut in a box: `scale` points per m, (u, z) at the box's middle. Clipped to the box. */
typedef struct morph_cut_view {
    const morph_cavity_section *cut;
    double base, radius; /* of the base plane, NaN: none; half the sheet's thickness, m */
    double middle[2], scale;
} morph_cut_view;
void morph_draw_cut(cairo_t *c, const morph_cut_view *what, const morph_box *box);

/* "12.3 mm" and the like, three digits. */
void morph_length_text(double length, char text[32]);

#endif
