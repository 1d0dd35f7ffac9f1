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
    const morph_structure_def *def = &scene->structure;
    if (size > 0) text[0] = '\0';
    if (def->layout != MORPH_LAYOUT_POSTS)
        snprintf(text, size, "structure.layout: %s", morph_layout_names[def->layout]);
    else if (def->joints != MORPH_JOINTS_BALL)
        snprintf(text, size, "structure.joints: %s", morph_joint_type_names[def->joints]);
    else if (def->bracing != MORPH_BRACING_NONE)
        snprintf(text, size, "structure.bracing: %s", morph_bracing_names[def->bracing]);
    else if (def->fixed == MORPH_FIXED_LIST)
        snprintf(text, size, "structure.fixed: a list of nodes");
    else if (def->fixed != MORPH_FIXED_NONE)
        snprintf(text, size, "structure.fixed: %s", morph_fixed_names[def->fixed]);
    else if (scene->motion.mode != MORPH_MODE_DROP)
        snprintf(text, size, "motion.mode: %s", morph_mode_names[scene->motion.mode]);
    else
        return false;
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
