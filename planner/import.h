/* Targets in: meshes through assimp, height maps from CSV, primitives; transformed into world coordinates. */
#ifndef MORPH_IMPORT_H
#define MORPH_IMPORT_H

#include "planner/scene.h"

/* Builds the target of a def: read or tessellate, weld, mend, examine, scale or fit, rotate, place. spacing
 * sets how finely primitives are tessellated (chords within 1e-4 spacing... 1e-3 spacing of the true
 * surface). On MORPH_ERR_INPUT message is one sentence naming what is wrong and what is allowed. warning (may
 * come back empty) says what was mended or is open. */
morph_status morph_target_build(const morph_target_def *def, double spacing, morph_mesh *mesh,
                                morph_mesh_report *report, char *message, size_t message_size, char *warning,
                                size_t warning_size);

#endif
