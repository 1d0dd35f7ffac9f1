/* The structure section: the grid, its links and their limits. */
#include "planner/hold.h"
#include "planner/scene_parts.h"

#include <stdio.h>
#include <stdlib.h>

const char *const morph_layout_names[2] = {"posts", "offset"};
const char *const morph_joint_type_names[2] = {"ball", "universal"};
const char *const morph_bracing_names[3] = {"none", "web", "full"};
const char *const morph_support_names[3] = {"base", "frame", "target"};
const char *const morph_fixed_names[3] = {"none", "border", "corners"};

/* Two nodes make one cell; beyond 64 no plan would end in useful time. */
enum { NODES_LEAST = 2, NODES_MOST = 64 };

/* Spacings from micrometres to megametres: everything else scales with it. */
static const morph_range spacing_range = {1e-6, 1e6, false, "m"};
static const morph_range length_range = {0.0, MORPH_SCENE_LARGEST, true, "m"};
static const morph_range factor_range = {0.0, 1e3, true, "times the start length"};
static const morph_range mass_range = {0.0, MORPH_SCENE_LARGEST, true, "kg"};
static const morph_range rate_range = {0.0, MORPH_SCENE_LARGEST, true, "m/s"};
static const morph_range acceleration_range = {0.0, MORPH_SCENE_LARGEST, true, "m/s2"};
static const morph_range jerk_range = {0.0, MORPH_SCENE_LARGEST, true, "m/s3"};
static const morph_range stiffness_range = {0.0, MORPH_SCENE_LARGEST, true, "N/m"};
static const morph_range damping_range = {0.0, MORPH_SCENE_LARGEST, false, "N s/m"};
/* At 0 and at 180 degrees two members lie in one line: no limit, but an end of all angles. */
static const morph_range angle_range = {0.0, 180.0, 2, "degrees"};
static const morph_range soft_range = {0.0, 90.0, false, "degrees"};
static const morph_range spring_range = {0.0, MORPH_SCENE_LARGEST, false, "N m"};
static const morph_range force_range = {-MORPH_SCENE_LARGEST, MORPH_SCENE_LARGEST, false, "N"};

static morph_found read_number(const morph_value *map, const char *key, const morph_range *range,
                               double *out) {
    const morph_value value = morph_value_get(map, key);
    return morph_value_number(&value, range, out);
}

/* The index read, 0 if absent or faulty. */
static int read_choice(const morph_value *map, const char *key, const char *const *names, int count) {
    const morph_value value = morph_value_get(map, key);
    int chosen = 0;
    morph_value_choice(&value, names, count, &chosen);
    return chosen;
}

static void require(const morph_value *value, const char *allowed) {
    if (!value->node) morph_value_fault(value, "is missing, allowed: %s", allowed);
}

/* Default angles as their degrees read back: radians that were multiplied out another way may be off in the
 * last bit, or be reached by no degrees at all, and a written scene would not repeat. 15 digits round such an
 * error away and are more than any default has. */
static void settle_angles(double radians[2]) {
    for (int k = 0; k < 2; k++) {
        char text[MORPH_NUMBER_TEXT];
        snprintf(text, sizeof text, "%.15g", morph_degrees(radians[k]));
        radians[k] = morph_radians(strtod(text, NULL));
    }
}

/* A default length as its 15 digits: 0.75 times 0.1 is 0.075 and not 0.07500000000000001, which is another
 * double and no shorter to write. */
static void settle_length(double *length) {
    char text[MORPH_NUMBER_TEXT];
    snprintf(text, sizeof text, "%.15g", *length);
    *length = strtod(text, NULL);
}

static void set_defaults(morph_structure_def *def, double spacing) {
    *def = morph_structure_defaults(spacing);
    double *const lengths[] = {&def->thickness,    &def->length[0][0], &def->length[0][1],
                               &def->length[1][0], &def->length[1][1], &def->radius,
                               &def->rate,         &def->acceleration, &def->jerk};
    for (size_t k = 0; k < sizeof lengths / sizeof *lengths; k++)
        settle_length(lengths[k]);
    settle_angles(def->link_post);
    settle_angles(def->link_link);
    double soft[2] = {def->angle_soft, def->angle_soft};
    settle_angles(soft);
    def->angle_soft = soft[0];
}

/* nodes and spacing, which have no default. */
static void read_grid(morph_scene_reader *r, const morph_value *map) {
    const long least[2] = {NODES_LEAST, NODES_LEAST}, most[2] = {NODES_MOST, NODES_MOST};
    const morph_value nodes = morph_value_get(map, "nodes");
    const morph_value spacing = morph_value_get(map, "spacing");
    long n[2] = {NODES_LEAST, NODES_LEAST};
    double distance = 1.0;
    require(&nodes, "a list of 2, each a whole number from 2 to 64");
    r->nodes_known = morph_value_integers(&nodes, least, most, 2, n) == MORPH_FOUND;
    require(&spacing, "a number of at least 1e-06 and at most 1e+06 m");
    r->spacing_known = morph_value_number(&spacing, &spacing_range, &distance) == MORPH_FOUND;

    set_defaults(&r->scene->structure, distance);
    r->scene->structure.nodes[0] = (int)n[0];
    r->scene->structure.nodes[1] = (int)n[1];
}

/* A pair of length limits; the start length must lie within, or the flat start breaks them. */
static void read_limits(const morph_value *value, const morph_range *range, double start, const char *what,
                        double out[2]) {
    if (morph_value_pair(value, range, out) != MORPH_FOUND) return;
    if (isnan(start) || (start >= out[0] && start <= out[1])) return;
    char text[3][MORPH_NUMBER_TEXT];
    morph_number_print(out[0], text[0]);
    morph_number_print(out[1], text[1]);
    morph_number_print(start, text[2]);
    morph_value_fault(value, "[%s, %s] leaves out the start length %s, allowed: a range that holds %s",
                      text[0], text[1], text[2], what);
}

static void read_lengths(morph_scene_reader *r, const morph_value *link) {
    morph_structure_def *def = &r->scene->structure;
    const double start = r->spacing_known ? def->spacing : NAN;
    morph_value length = morph_value_get(link, "length");
    if (!length.node) return;
    if (morph_value_is_map(&length)) {
        morph_scene_check_keys(&length);
        const morph_value bottom = morph_value_get(&length, "bottom");
        const morph_value top = morph_value_get(&length, "top");
        const morph_value brace = morph_value_get(&length, "brace");
        read_limits(&bottom, &length_range, start, "structure.spacing", def->length[MORPH_LINK_BOTTOM]);
        read_limits(&top, &length_range, start, "structure.spacing", def->length[MORPH_LINK_TOP]);
        read_limits(&brace, &factor_range, 1.0, "1 (times the start length)", def->length[MORPH_LINK_BRACE]);
    } else if (morph_value_is_list(&length)) {
        read_limits(&length, &length_range, start, "structure.spacing", def->length[MORPH_LINK_BOTTOM]);
        for (int k = 0; k < 2; k++)
            def->length[MORPH_LINK_TOP][k] = def->length[MORPH_LINK_BOTTOM][k];
    } else {
        char is[80];
        morph_value_describe(&length, is, sizeof is);
        morph_value_fault(
            &length, "%s, allowed: a pair [shortest, longest] in m, or a mapping of bottom, top, brace", is);
    }
}

/* force: understood, not available yet. */
static void read_later_link_keys(const morph_value *link) {
    const morph_value force = morph_value_get(link, "force");
    double pair[2];
    if (morph_value_pair(&force, &force_range, pair) == MORPH_FOUND) {
        if (pair[0] > 0.0 || pair[1] < 0.0)
            morph_value_fault(&force,
                              "leaves out 0, allowed: push (at most 0) first, then pull (at least 0), in N");
        else
            morph_value_later(&force, "limits of push and pull");
    }
}

/* The list of links that hold their start length; each once, since a second time is a slip. */
static void read_stuck(morph_scene_reader *r, const morph_value *link) {
    morph_scene *scene = r->scene;
    const morph_value stuck = morph_value_get(link, "stuck");
    if (!stuck.node) return;
    if (!morph_value_is_list(&stuck)) {
        char is[80];
        morph_value_describe(&stuck, is, sizeof is);
        morph_value_fault(&stuck, "%s, allowed: a list of link numbers", is);
        return;
    }
    const long links = r->nodes_known && r->layout_known ? morph_link_count(&r->scene->structure) : 1000000L;
    const int count = morph_value_count(&stuck);
    if (count > MORPH_HOLD_MOST) {
        morph_value_fault(&stuck, "a list of %d, allowed: at most %d links", count, MORPH_HOLD_MOST);
        return;
    }
    int line[MORPH_HOLD_MOST], used = 0;
    scene->stuck_link = morph_alloc((size_t)count, sizeof *scene->stuck_link);
    if (!scene->stuck_link) {
        r->yaml.faults.nomem = true;
        return;
    }
    for (int i = 0; i < count; i++) {
        const morph_value item = morph_value_item(&stuck, i);
        long number;
        if (morph_value_integer(&item, 0, links - 1, &number) != MORPH_FOUND) continue;
        int before = 0;
        while (before < used && scene->stuck_link[before] != (int)number)
            before++;
        if (before < used) {
            morph_value_fault(&item, "%ld is given twice, first in line %d, allowed: once", number,
                              line[before]);
            continue;
        }
        line[used] = item.line;
        scene->stuck_link[used++] = (int)number;
    }
    scene->structure.stuck_links = used;
    scene->structure.stuck_link = used > 0 ? scene->stuck_link : NULL;
}

/* Least distance of two links' axes at the flat start, with s the spacing and h the thickness. Parallel links
 * of a layer s, of a panel h. Web: a brace and a link or post across its panel's corner, the legs s and h
 * apart: the altitude h s / sqrt(s^2 + h^2). Full: a web and a cell's diagonal, both from edges of a cell's
 * box: with the diagonal's s/sqrt 2 as the other leg h s / sqrt(s^2 + 2 h^2). Offset: links that cross h
 * apart, and the parallel webs of neighbouring joints, s/sqrt 2. */
static double start_room(const morph_structure_def *def) {
    const double s = def->spacing, h = def->thickness;
    if (def->layout == MORPH_LAYOUT_OFFSET) return fmin(h, s / sqrt(2.0));
    if (def->bracing == MORPH_BRACING_WEB) return h * s / hypot(s, h);
    if (def->bracing == MORPH_BRACING_FULL) return h * s / hypot(s, sqrt(2.0) * h);
    return fmin(h, s);
}

/* Links must not touch at the flat start. */
static void check_room(const morph_scene_reader *r, const morph_value *structure, const morph_value *link) {
    const morph_structure_def *def = &r->scene->structure;
    const double room = start_room(def);
    if (!r->spacing_known || 2.0 * def->radius < room) return;
    const char *what = room == def->thickness ? "thickness"
                       : room == def->spacing ? "spacing"
                                              : "distance of braces";
    morph_value at = morph_value_get(link, "radius");
    if (!at.node) at = morph_value_get(structure, def->thickness < def->spacing ? "thickness" : "spacing");
    char radius[MORPH_NUMBER_TEXT], half[MORPH_NUMBER_TEXT];
    morph_number_print(def->radius, radius);
    morph_number_print(0.5 * room, half);
    morph_value_fault(&at,
                      "links of radius %s touch at the start, allowed: a radius below half the %s (%s m)",
                      radius, what, half);
}

static void read_link(morph_scene_reader *r, const morph_value *structure) {
    const morph_value link = morph_scene_section(structure, "link");
    morph_structure_def *def = &r->scene->structure;
    read_lengths(r, &link);
    read_number(&link, "radius", &length_range, &def->radius);
    read_number(&link, "rate", &rate_range, &def->rate);
    read_number(&link, "acceleration", &acceleration_range, &def->acceleration);
    read_number(&link, "jerk", &jerk_range, &def->jerk);
    read_number(&link, "stiffness", &stiffness_range, &def->stiffness);
    read_number(&link, "damping", &damping_range, &def->damping);
    read_later_link_keys(&link);
    read_stuck(r, &link);

    check_room(r, structure, &link);
}

/* What is wrong with a pair of angle limits, and what is allowed; NULL if nothing is. */
static const char *angle_fault(const double degrees[2]) {
    if (degrees[0] == degrees[1]) return "is empty, allowed: the larger must be above the smaller";
    if (degrees[0] > 90.0 || degrees[1] < 90.0)
        return "leaves out 90, the angle at the start, allowed: a range that holds 90";
    return NULL;
}

/* Limits in degrees to radians; the flat start has 90 degrees everywhere. */
static void read_angle(const morph_value *angle, const char *key, double out[2]) {
    const morph_value value = morph_value_get(angle, key);
    double degrees[2];
    if (morph_value_pair(&value, &angle_range, degrees) != MORPH_FOUND) return;
    const char *wrong = angle_fault(degrees);
    if (wrong) {
        char lo[MORPH_NUMBER_TEXT], hi[MORPH_NUMBER_TEXT];
        morph_number_print(degrees[0], lo);
        morph_number_print(degrees[1], hi);
        morph_value_fault(&value, "[%s, %s] %s", lo, hi, wrong);
        return;
    }
    for (int k = 0; k < 2; k++)
        out[k] = morph_radians(degrees[k]);
}

/* Springs at the limits, and those that hold posts square to their links. */
static void read_springs(const morph_value *angle, morph_structure_def *def) {
    double degrees;
    read_number(angle, "stiffness", &spring_range, &def->angle_stiffness);
    if (read_number(angle, "soft", &soft_range, &degrees) == MORPH_FOUND)
        def->angle_soft = morph_radians(degrees);
    read_number(angle, "square", &spring_range, &def->square);
}

/* The list of nodes held; each once, since a second time is a slip. */
static void read_fixed_list(morph_scene_reader *r, const morph_value *fixed) {
    morph_scene *scene = r->scene;
    const int *n = scene->structure.nodes;
    const int count = morph_value_count(fixed);
    const long least[2] = {0, 0};
    const long most[2] = {r->nodes_known ? n[0] - 1 : NODES_MOST - 1,
                          r->nodes_known ? n[1] - 1 : NODES_MOST - 1};
    int line[NODES_MOST][NODES_MOST] = {{0}}, used = 0;
    scene->fixed_node = morph_alloc((size_t)count, sizeof *scene->fixed_node);
    if (!scene->fixed_node) {
        r->yaml.faults.nomem = true;
        return;
    }
    for (int i = 0; i < count; i++) {
        const morph_value item = morph_value_item(fixed, i);
        long node[2];
        if (morph_value_integers(&item, least, most, 2, node) != MORPH_FOUND) continue;
        int *first = &line[node[0]][node[1]];
        if (*first > 0) {
            morph_value_fault(&item, "[%ld, %ld] is given twice, first in line %d, allowed: once", node[0],
                              node[1], *first);
            continue;
        }
        *first = item.line;
        for (int k = 0; k < 2; k++)
            scene->fixed_node[used][k] = (int)node[k];
        used++;
    }
    scene->structure.fixed = used > 0 ? MORPH_FIXED_LIST : MORPH_FIXED_NONE;
    scene->structure.fixed_nodes = used;
    scene->structure.fixed_node = (const int(*)[2])scene->fixed_node;
}

/* none, border, corners, or a list of nodes. */
static void read_fixed(morph_scene_reader *r, const morph_value *structure) {
    const morph_value fixed = morph_value_get(structure, "fixed");
    int chosen = 0;
    if (morph_value_is_list(&fixed)) {
        read_fixed_list(r, &fixed);
        return;
    }
    morph_value_choice(&fixed, morph_fixed_names, 3, &chosen);
    r->scene->structure.fixed = (morph_fixed)chosen;
}

/* layout, joints, bracing, and what goes with an offset layout. */
static void read_layout(morph_scene_reader *r, const morph_value *map) {
    morph_structure_def *def = &r->scene->structure;
    const morph_value layout = morph_value_get(map, "layout"), nodes = morph_value_get(map, "nodes");
    const morph_value joints = morph_value_get(map, "joints"), bracing = morph_value_get(map, "bracing");
    int chosen = 0;
    r->layout_known = morph_value_choice(&layout, morph_layout_names, 2, &chosen) != MORPH_FAULTY;
    def->layout = (morph_layout)chosen;
    def->joints = (morph_joint_type)read_choice(map, "joints", morph_joint_type_names, 2);
    def->bracing = (morph_bracing)read_choice(map, "bracing", morph_bracing_names, 3);
    if (def->layout != MORPH_LAYOUT_OFFSET) return;
    if (def->joints != MORPH_JOINTS_BALL)
        morph_value_fault(&joints, "%s joints have their axes along posts, allowed with layout offset: ball",
                          morph_joint_type_names[def->joints]);
    if (def->bracing != MORPH_BRACING_NONE)
        morph_value_fault(
            &bracing, "%s braces panels between posts, allowed with layout offset (braced by itself): none",
            morph_bracing_names[def->bracing]);
    if (r->nodes_known && (def->nodes[0] < 3 || def->nodes[1] < 3))
        morph_value_fault(
            &nodes,
            "[%d, %d] leaves the bottom layer of layout offset, one node smaller each way, without "
            "a cell, allowed: at least 3",
            def->nodes[0], def->nodes[1]);
}

void morph_scene_read_structure(morph_scene_reader *r, const morph_value *root) {
    const morph_value map = morph_scene_section(root, "structure");
    const morph_value whole = morph_value_get(root, "structure");
    if (whole.node && !map.node && !morph_value_is_empty(&whole)) {
        set_defaults(&r->scene->structure, 1.0); /* said already: not its keys one by one */
        return;
    }
    morph_structure_def *def = &r->scene->structure;
    read_grid(r, &map);
    read_layout(r, &map);
    def->support = (morph_support)read_choice(&map, "support", morph_support_names, 3);
    read_number(&map, "thickness", &length_range, &def->thickness);
    read_number(&map, "mass", &mass_range, &def->mass);
    read_fixed(r, &map);
    read_link(r, &map);
    const morph_value angle = morph_scene_section(&map, "angle");
    read_angle(&angle, "link_post", def->link_post);
    read_angle(&angle, "link_link", def->link_link);
    read_springs(&angle, def);
}
