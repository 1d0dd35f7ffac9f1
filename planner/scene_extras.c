/* Lists of hands and centres, the start, the goal. */
#include "planner/scene_parts.h"
#include "planner/start.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const morph_range force_range = {-MORPH_SCENE_LARGEST, MORPH_SCENE_LARGEST, false, "N"};
static const morph_range moment_range = {0.0, 3600.0, false, "s"};
static const morph_range place_range = {-MORPH_SCENE_LARGEST, MORPH_SCENE_LARGEST, false, "m"};
static const morph_range strength_range = {0.0, MORPH_SCENE_LARGEST, false, "N m2"};
static const morph_range gap_range = {0.0, MORPH_SCENE_LARGEST, true, "m"};
static const morph_range share_range = {0.0, 1.0, true, ""};

/* A key that an entry must have. */
static morph_value required(const morph_value *map, const char *key, const char *allowed) {
    const morph_value value = morph_value_get(map, key);
    if (!value.node) morph_value_fault(&value, "is missing, allowed: %s", allowed);
    return value;
}

/* Entry i of a list of mappings; node NULL (and a fault) if it is none. */
static morph_value entry(const morph_value *list, int i, const char *allowed) {
    morph_value item = morph_value_item(list, i);
    if (morph_value_is_map(&item)) {
        morph_scene_check_keys(&item);
    } else {
        char is[80];
        morph_value_describe(&item, is, sizeof is);
        morph_value_fault(&item, "%s, allowed: a mapping of %s", is, allowed);
        item.node = NULL;
    }
    return item;
}

/* A time window that is one. */
static void read_window(const morph_value *touch, morph_hand *out) {
    const morph_value begin = required(touch, "from", "a time in s"),
                      end = required(touch, "to", "a time in s");
    const bool timed = morph_value_number(&begin, &moment_range, &out->from) == MORPH_FOUND;
    if (morph_value_number(&end, &moment_range, &out->to) != MORPH_FOUND || !timed || out->to > out->from)
        return;
    char a[MORPH_NUMBER_TEXT], b[MORPH_NUMBER_TEXT];
    morph_number_print(out->to, a);
    morph_number_print(out->from, b);
    morph_value_fault(&end, "%s is not after from, allowed: more than %s s", a, b);
}

static void read_touch_entry(const morph_scene_reader *r, const morph_value *touch, morph_hand *out) {
    static const char *const layers[2] = {"bottom", "top"};
    const morph_structure_def *def = &r->scene->structure;
    long node[2];
    int layer = 1, n[2] = {64, 64};
    const morph_value side = required(touch, "layer", "bottom, top");
    const bool sided = morph_value_choice(&side, layers, 2, &layer) == MORPH_FOUND;
    /* Without a known layer the larger one bounds the node. */
    if (r->nodes_known && r->layout_known) morph_layer_nodes(def, layer, n);
    const long least[2] = {0, 0}, most[2] = {n[0] - 1, n[1] - 1};
    const morph_value where = required(touch, "node", "a list of 2 node numbers");
    if (morph_value_integers(&where, least, most, 2, node) == MORPH_FOUND && sided)
        out->joint = morph_node_joint(def, layer, (int)node[0], (int)node[1]);
    const morph_value push = required(touch, "force", "a list of 3 numbers, N");
    morph_value_numbers(&push, &force_range, 3, out->force);
    read_window(touch, out);
}

void morph_scene_read_touch(morph_scene_reader *r, const morph_value *motion) {
    const morph_value touch = morph_value_get(motion, "touch");
    if (!touch.node || morph_value_is_empty(&touch)) return;
    if (!morph_value_is_list(&touch)) {
        char is[80];
        morph_value_describe(&touch, is, sizeof is);
        morph_value_fault(&touch, "%s, allowed: a list of mappings of node, layer, force, from, to", is);
        return;
    }
    morph_scene *scene = r->scene;
    const int count = morph_value_count(&touch);
    scene->touch = morph_alloc((size_t)count, sizeof *scene->touch);
    if (!scene->touch) {
        r->yaml.faults.nomem = true;
        return;
    }
    scene->touches = count;
    for (int i = 0; i < count; i++) {
        const morph_value item = entry(&touch, i, "node, layer, force, from, to");
        if (item.node) read_touch_entry(r, &item, &scene->touch[i]);
    }
}

/* auto, none, or a list of centres. */
static void read_attractors(morph_scene_reader *r, const morph_value *root) {
    static const char *const names[2] = {"auto", "none"};
    const morph_value attractors = morph_value_get(root, "attractors");
    morph_scene *scene = r->scene;
    int chosen = 0;
    if (!morph_value_is_list(&attractors)) {
        morph_value_choice(&attractors, names, 2, &chosen);
        scene->attractors = chosen ? MORPH_ATTRACT_NONE : MORPH_ATTRACT_AUTO;
        return;
    }
    const int count = morph_value_count(&attractors);
    scene->attractors = count > 0 ? MORPH_ATTRACT_LIST : MORPH_ATTRACT_NONE;
    scene->centre = morph_alloc((size_t)count, sizeof *scene->centre);
    if (!scene->centre) {
        r->yaml.faults.nomem = true;
        return;
    }
    scene->centres = count;
    for (int i = 0; i < count; i++) {
        const morph_value item = entry(&attractors, i, "at, strength");
        if (!item.node) continue;
        const morph_value place = required(&item, "at", "a list of 3 numbers, m");
        morph_value_numbers(&place, &place_range, 3, scene->centre[i].at);
        const morph_value pull = required(&item, "strength", "a number, N m2");
        morph_value_number(&pull, &strength_range, &scene->centre[i].strength);
    }
}

/* flat, or a folder or file, found from the scene's folder. */
static void read_start(morph_scene_reader *r, const morph_value *root) {
    const morph_value value = morph_value_get(root, "start");
    morph_start *start = &r->scene->start;
    if (morph_value_text(&value, 4000, &start->as_written) != MORPH_FOUND) return;
    if (morph_value_is(&value, "flat")) return;
    const char *written = start->as_written, *scene = r->scene->file, *slash = strrchr(scene, '/');
    const size_t folder = written[0] != '/' && slash ? (size_t)(slash - scene) + 1 : 0;
    start->file = malloc(folder + strlen(written) + 1);
    if (!start->file) {
        r->yaml.faults.nomem = true;
        return;
    }
    memcpy(start->file, scene, folder);
    strcpy(start->file + folder, written);
    if (access(start->file, F_OK) != 0)
        morph_value_fault(&value, "%s is not there, allowed: flat, a plan folder, a CSV of lengths",
                          start->file);
}

morph_status morph_scene_build_start(morph_scene_reader *r, const morph_value *root) {
    const morph_value value = morph_value_get(root, "start");
    morph_start *start = &r->scene->start;
    char message[1200];
    if (!start->file) return MORPH_OK;
    const morph_status status = morph_start_read(&r->scene->structure, start, message, sizeof message);
    if (status == MORPH_ERR_INPUT && message[0]) morph_value_fault(&value, "%s", message);
    if (status == MORPH_OK && start->kind == MORPH_START_LENGTHS && start->free_motions > 0)
        morph_value_warn(&value,
                         "these lengths leave %d free motions: the shape is one of many (another was found "
                         "%.3g m away), and the structure may stand in one that is not planned from",
                         start->free_motions, start->doubt);
    return status;
}

static void read_goal(morph_scene_reader *r, const morph_value *root) {
    const morph_value goal = morph_scene_section(root, "goal");
    bool any = false;
    for (int k = 0; k < MORPH_GOAL_KINDS && goal.node; k++) {
        const morph_value value = morph_value_get(&goal, morph_goal_name((morph_goal_kind)k));
        const morph_range *range = k == MORPH_GOAL_COVERAGE ? &share_range : &gap_range;
        any |= morph_value_number(&value, range, &r->scene->goal.limit[k]) != MORPH_ABSENT;
    }
    /* An unknown key has its own fault. */
    if (goal.node && !any && goal.node->data.mapping.pairs.start == goal.node->data.mapping.pairs.top)
        morph_value_fault(&goal, "asks for nothing, allowed: at least one of mean_gap, max_gap, coverage");
}

void morph_scene_read_extras(morph_scene_reader *r, const morph_value *root) {
    read_attractors(r, root);
    read_start(r, root);
    read_goal(r, root);
}
