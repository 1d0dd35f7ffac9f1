/* The deformable target of a scene: its inside as tetrahedra, as a body that the blanket runs on, and what it
 * is pressed to. */
#ifndef MORPH_TARGET_BODY_H
#define MORPH_TARGET_BODY_H

#include "model/body.h"
#include "planner/scene.h"

typedef struct morph_deformable_report {
    bool used; /* the target is deformable */
    int vertices, tetrahedra;
    double volume;       /* of the tetrahedra at rest, m3 */
    double pressed;      /* largest displacement of a vertex of the surface at the end, m */
    double least_volume; /* of a tetrahedron at the end, part of that at rest */
    double worst_depth;  /* deepest that a recorded frame lies in the surface of its moment, m, >= 0 */
} morph_deformable_report;

/* Reads the tetrahedra of def's file and places them as morph_target_build places their surface. Message as
 * there. */
morph_status morph_target_tetra(const morph_target_def *def, morph_tetra *out, char *message,
                                size_t message_size);

/* The body of a scene with a deformable target, at rest in its place, held by its foot: vertices in the
 * lowest tenth of its height. From a file of tetrahedra these, otherwise the target's inside (exact: the
 * distance to its surface) is filled with ones of about half a spacing, finer where that loses a twentieth of
 * its volume. Fills the counts and the volume of *report. MORPH_ERR_INPUT, with one sentence in message,
 * where the target cannot be filled or is too stiff to be followed. */
morph_status morph_target_body(const morph_scene *scene, const morph_distance *exact, morph_body **out,
                               morph_deformable_report *report, char *message, size_t message_size);

/* Largest displacement of a vertex of the surface from the body's rest shape at this lift, m. */
double morph_target_pressed(const morph_body *body, double lift);

#endif
