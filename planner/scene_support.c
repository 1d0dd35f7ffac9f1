/* Which scenes a method can plan. */
#include "planner/scene_parts.h"
#include "planner/start.h"

#include <stdio.h>
#include <string.h>

/* What only the blanket knows. */
static bool beyond_refinement(const morph_scene *scene, char *text, size_t size) {
    if (!scene->target_def.has_deformable) return false;
    snprintf(text, size, "target.deformable");
    return true;
}

bool morph_scene_unplaceable(const morph_scene *scene, char *text, size_t size) {
    if (size > 0) text[0] = '\0';
    if (scene->motion.mode == MORPH_MODE_DROP) return false;
    snprintf(text, size, "motion.mode: %s", morph_mode_names[scene->motion.mode]);
    return true;
}

bool morph_scene_supported(const morph_scene *scene, const char *method, char *text, size_t size) {
    char feature[96];
    if (size > 0) text[0] = '\0';
    if (strcmp(method, "ipopt") != 0 && scene->start.file) {
        snprintf(text, size, "not available yet: start: %s with --method %s",
                 morph_start_name(scene->start.kind), method);
        return false;
    }
    if (strcmp(method, "blanket") == 0) return true;
    const bool beyond =
        beyond_refinement(scene, feature, sizeof feature) ||
        (strcmp(method, "ipopt") != 0 && morph_scene_unplaceable(scene, feature, sizeof feature));
    if (beyond) snprintf(text, size, "not available yet: %s with --method %s", feature, method);
    return !beyond;
}
