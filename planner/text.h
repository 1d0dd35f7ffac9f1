/* What the program prints of its results, as text. NULL where memory is refused; free with free(). */
#ifndef MORPH_TEXT_H
#define MORPH_TEXT_H

#include "model/kinematics.h"
#include "planner/scene.h"
#include "planner/summary.h"

/* Six lines: outcome; cavity and gap, blanket -> plan; worst margin; duration; free motions; folder. */
char *morph_plan_text(const morph_summary *summary, const char *folder);
/* One line per margin and a verdict. files: what morph_folder_verify found, lines, or NULL; whole: it was
 * asked. */
char *morph_check_text(const morph_check_report *report, bool whole, const char *files);
/* Structure with link numbers, mobility, target, what it asks of the structure. */
char *morph_info_text(const morph_scene *scene, const morph_structure *structure,
                      const morph_mobility *mobility, const morph_reach *reach);

#endif
