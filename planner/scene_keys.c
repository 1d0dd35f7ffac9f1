/* Every key of a scene, and what to say of keys that are none. */
#include "planner/scene_parts.h"

#include <stdio.h>
#include <string.h>

/* List entries stand under their list's name. */
static const char *const known[] = {
    "morphplan",
    "title",
    "structure",
    "target",
    "base",
    "motion",
    "attractors",
    "start",
    "goal",
    "schedule",
    "structure.layout",
    "structure.nodes",
    "structure.spacing",
    "structure.thickness",
    "structure.joints",
    "structure.bracing",
    "structure.mass",
    "structure.fixed",
    "structure.support",
    "structure.link",
    "structure.angle",
    "structure.link.length",
    "structure.link.radius",
    "structure.link.rate",
    "structure.link.acceleration",
    "structure.link.jerk",
    "structure.link.stiffness",
    "structure.link.damping",
    "structure.link.force",
    "structure.link.stuck",
    "structure.link.length.bottom",
    "structure.link.length.top",
    "structure.link.length.brace",
    "structure.angle.link_post",
    "structure.angle.link_link",
    "structure.angle.stiffness",
    "structure.angle.soft",
    "structure.angle.square",
    "target.shape",
    "target.size",
    "target.radius",
    "target.height",
    "target.radii",
    "target.tube",
    "target.file",
    "target.cell",
    "target.scale",
    "target.fit",
    "target.rotate",
    "target.at",
    "target.deformable",
    "target.deformable.young",
    "target.deformable.density",
    "motion.mode",
    "motion.height",
    "motion.gravity",
    "motion.drag",
    "motion.friction",
    "motion.time",
    "motion.touch",
    "motion.touch.node",
    "motion.touch.layer",
    "motion.touch.force",
    "motion.touch.from",
    "motion.touch.to",
    "attractors.at",
    "attractors.strength",
    "goal.mean_gap",
    "goal.max_gap",
    "goal.coverage",
    "schedule.duration",
    "schedule.sample",
};
enum { KNOWN = sizeof known / sizeof *known };

/* The path without list indices. */
static void schema_path(const char *path, char *text, size_t size) {
    size_t n = 0;
    bool inside = false;
    for (; *path && n + 1 < size; path++) {
        if (*path == '[') inside = true;
        if (!inside) text[n++] = *path;
        if (*path == ']') inside = false;
    }
    text[n] = '\0';
}

/* Names directly under a section; returns how many. */
static int names_under(const char *section, const char **names) {
    const size_t length = strlen(section);
    int count = 0;
    for (int k = 0; k < KNOWN; k++) {
        const char *name = known[k];
        if (length > 0) {
            if (strncmp(name, section, length) != 0 || name[length] != '.') continue;
            name += length + 1;
        }
        if (!strchr(name, '.')) names[count++] = name;
    }
    return count;
}

/* The one path elsewhere that ends in this key, or the two; false if there is none or more. */
static bool elsewhere(const char *key, char *text, size_t size) {
    int found = 0;
    text[0] = '\0';
    for (int k = 0; k < KNOWN; k++) {
        const char *dot = strrchr(known[k], '.');
        if (strcmp(dot ? dot + 1 : known[k], key) != 0) continue;
        const size_t used = strlen(text);
        snprintf(text + used, size - used, "%s%s", found > 0 ? " or " : "", known[k]);
        found++;
    }
    return found == 1 || found == 2;
}

static void report_unknown(const morph_value *map, const morph_value *key, const char *const *names,
                           int count) {
    char is[80], full[224], allowed[512];
    morph_value_describe(key, is, sizeof is);
    snprintf(full, sizeof full, "%s%s%s", map->path, map->path[0] ? "." : "", is);
    morph_join_names(names, count, allowed, sizeof allowed);
    const char *word =
        key->node && key->node->type == YAML_SCALAR_NODE ? (const char *)key->node->data.scalar.value : "";
    const char *meant = morph_closest_name(word, names, count);
    char there[512];
    const bool known_elsewhere = !meant && elsewhere(word, there, sizeof there);
    if (meant)
        morph_fault_add(map->yaml, key->line, full, "unknown key, did you mean %s? allowed: %s", meant,
                        allowed);
    else if (known_elsewhere)
        morph_fault_add(map->yaml, key->line, full, "unknown key here, did you mean %s? allowed: %s", there,
                        allowed);
    else
        morph_fault_add(map->yaml, key->line, full, "unknown key, allowed: %s", allowed);
}

static morph_value key_at(const morph_value *map, int i) {
    morph_value key = {.yaml = map->yaml, .line = map->line};
    const yaml_node_pair_t *pair = map->node->data.mapping.pairs.start + i;
    key.node = yaml_document_get_node(&map->yaml->document, pair->key);
    if (key.node) key.line = (int)key.node->start_mark.line + 1;
    return key;
}

static const char *key_text(const morph_value *key) {
    return key->node && key->node->type == YAML_SCALAR_NODE ? (const char *)key->node->data.scalar.value
                                                            : NULL;
}

void morph_scene_check_keys(const morph_value *map) {
    const char *names[KNOWN];
    char section[112];
    schema_path(map->path, section, sizeof section);
    const int count = names_under(section, names);

    int pairs = (int)(map->node->data.mapping.pairs.top - map->node->data.mapping.pairs.start);
    if (pairs > MORPH_YAML_KEYS) {
        morph_fault_add(map->yaml, map->line, map->path[0] ? map->path : "scene",
                        "%d keys, allowed: %d known ones", pairs, count);
        pairs = MORPH_YAML_KEYS; /* the rest would only lengthen the list */
    }
    for (int i = 0; i < pairs; i++) {
        const morph_value key = key_at(map, i);
        const char *text = key_text(&key);
        bool good = false;
        for (int k = 0; k < count && text && !good; k++)
            good = strcmp(names[k], text) == 0;
        if (!good) {
            report_unknown(map, &key, names, count);
            continue;
        }
        for (int j = 0; j < i; j++) {
            const morph_value first = key_at(map, j);
            if (!key_text(&first) || strcmp(key_text(&first), text) != 0) continue;
            const morph_value again = morph_value_get(map, text);
            morph_fault_add(map->yaml, key.line, again.path, "given twice, first in line %d, allowed: once",
                            first.line);
            break;
        }
    }
}

morph_value morph_scene_section(const morph_value *parent, const char *key) {
    morph_value section = morph_value_get(parent, key);
    if (section.node && !morph_value_is_map(&section)) {
        if (!morph_value_is_empty(&section)) {
            char is[80], path[112], allowed[512];
            const char *names[KNOWN];
            morph_value_describe(&section, is, sizeof is);
            schema_path(section.path, path, sizeof path);
            morph_join_names(names, names_under(path, names), allowed, sizeof allowed);
            morph_value_fault(&section, "%s is no mapping, allowed: the keys %s", is, allowed);
        }
        section.node = NULL;
    }
    if (section.node) morph_scene_check_keys(&section);
    return section;
}
