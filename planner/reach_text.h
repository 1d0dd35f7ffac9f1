/* The reach check of a scene, and what is said of it. */
#ifndef MORPH_REACH_TEXT_H
#define MORPH_REACH_TEXT_H

#include "model/reach.h"
#include "planner/scene.h"

#include <stdio.h>

/* exact: distance to the scene's target. Errors as morph_reach_check. */
morph_status morph_scene_reach(const morph_scene *scene, const morph_structure *structure,
                               const morph_distance *exact, morph_reach *out);

/* One line per kind that was tested, and a verdict; every line begins as those of `info`. */
void morph_reach_lines(FILE *out, const morph_reach *reach);

/* "out of reach: ..." or "doubtful: ...": one sentence on a finding, with number, limit and place; "" for an
 * item that is within or was not tested. */
void morph_reach_sentence(const morph_reach *reach, morph_reach_kind kind, char *text, size_t size);

/* "within", "note", "out", "untested". */
const char *morph_reach_verdict_name(morph_reach_verdict verdict);
const char *morph_reach_unit(morph_reach_kind kind);

#endif
