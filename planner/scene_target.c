/* The target section: a shape with its own keys, where it goes, and building it. */
#include "planner/import.h"
#include "planner/scene_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const morph_shape_names[9] = {"box",   "sphere",  "ellipsoid", "cylinder", "cone",
                                          "torus", "capsule", "mesh",      "heightmap"};

/* A primitive larger than this, in grid spacings, is a slip of units: a grid is at most 63 wide, and the
 * number of triangles grows with the size. */
#define PRIMITIVE_SPACINGS 200.0
enum { FILE_BYTES = 4000 };

static const morph_range size_range = {0.0, MORPH_SCENE_LARGEST, true, ""};
static const morph_range scale_range = {0.0, MORPH_SCENE_LARGEST, true, ""};
static const morph_range place_range = {-MORPH_SCENE_LARGEST, MORPH_SCENE_LARGEST, false, "m"};
static const morph_range fit_range = {0.0, MORPH_SCENE_LARGEST, true, "m"};
static const morph_range turn_range = {-360.0, 360.0, false, "degrees"};
static const morph_range young_range = {0.0, 1e15, true, "Pa"};
static const morph_range density_range = {0.0, 1e15, true, "kg/m3"};

/* The keys that belong to some shapes only; bit s is set where shape s has it. */
#define BIT(s) (1u << (unsigned)(s))
typedef struct own_key {
    const char *name;
    unsigned shapes;
} own_key;
static const own_key own_keys[] = {
    {"size", BIT(MORPH_SHAPE_BOX)},
    {"radius", BIT(MORPH_SHAPE_SPHERE) | BIT(MORPH_SHAPE_CYLINDER) | BIT(MORPH_SHAPE_CONE) |
                   BIT(MORPH_SHAPE_TORUS) | BIT(MORPH_SHAPE_CAPSULE)},
    {"height", BIT(MORPH_SHAPE_CYLINDER) | BIT(MORPH_SHAPE_CONE) | BIT(MORPH_SHAPE_CAPSULE)},
    {"tube", BIT(MORPH_SHAPE_TORUS)},
    {"radii", BIT(MORPH_SHAPE_ELLIPSOID)},
    {"file", BIT(MORPH_SHAPE_MESH) | BIT(MORPH_SHAPE_HEIGHTMAP)},
    {"cell", BIT(MORPH_SHAPE_HEIGHTMAP)},
};
enum { OWN_KEYS = sizeof own_keys / sizeof *own_keys };

static int shapes_of(unsigned shapes, const char **names) {
    int count = 0;
    for (int s = 0; s < 9; s++)
        if (shapes & BIT(s)) names[count++] = morph_shape_names[s];
    return count;
}

/* Keys of another shape, and missing ones (all but cell are needed). */
static void check_own_keys(const morph_value *target, morph_shape shape) {
    const char *mine[OWN_KEYS];
    int count = 0;
    for (int k = 0; k < OWN_KEYS; k++)
        if (own_keys[k].shapes & BIT(shape)) mine[count++] = own_keys[k].name;
    char allowed[128];
    morph_join_names(mine, count, allowed, sizeof allowed);

    for (int k = 0; k < OWN_KEYS; k++) {
        const morph_value value = morph_value_get(target, own_keys[k].name);
        const bool belongs = (own_keys[k].shapes & BIT(shape)) != 0;
        if (value.node && !belongs) {
            const char *names[9];
            char others[128];
            morph_join_names(names, shapes_of(own_keys[k].shapes, names), others, sizeof others);
            morph_fault_add(target->yaml, value.line, value.path,
                            "is a key of %s, not of this shape, allowed for %s: %s", others,
                            morph_shape_names[shape], allowed);
        }
        if (!value.node && belongs && strcmp(own_keys[k].name, "cell") != 0)
            morph_value_fault(&value, "is missing, allowed for %s: %s", morph_shape_names[shape], allowed);
    }
}

static morph_found read_number(const morph_value *map, const char *key, const morph_range *range,
                               double *out) {
    const morph_value value = morph_value_get(map, key);
    return morph_value_number(&value, range, out);
}

static morph_found read_list(const morph_value *map, const char *key, const morph_range *range,
                             double out[3]) {
    const morph_value value = morph_value_get(map, key);
    return morph_value_numbers(&value, range, 3, out);
}

/* Relations between a shape's own sizes. */
static void check_relations(const morph_value *target, const morph_target_def *def) {
    char a[MORPH_NUMBER_TEXT], b[MORPH_NUMBER_TEXT];
    if (def->shape == MORPH_SHAPE_TORUS && def->tube > 0.0 && def->radius > 0.0 && def->tube >= def->radius) {
        const morph_value tube = morph_value_get(target, "tube");
        morph_number_print(def->tube, a);
        morph_number_print(def->radius, b);
        morph_value_fault(&tube, "%s closes the hole, allowed: less than the radius %s", a, b);
    }
    if (def->shape == MORPH_SHAPE_CAPSULE && def->height > 0.0 && def->radius > 0.0 &&
        def->height <= 2.0 * def->radius) {
        const morph_value height = morph_value_get(target, "height");
        morph_number_print(def->height, a);
        morph_number_print(2.0 * def->radius, b);
        morph_value_fault(&height,
                          "%s leaves no cylinder between the caps, allowed: more than twice the radius (%s)",
                          a, b);
    }
}

/* Units mistaken (0.15 m written as 150) would ask for millions of triangles. */
static void check_extent(const morph_scene_reader *r, const morph_value *target) {
    const morph_target_def *def = &r->scene->target_def;
    if (!r->spacing_known || def->has_fit || def->file) return;
    const double dims[8] = {
        def->size[0], def->size[1],        def->size[2],        2.0 * (def->radius + def->tube),
        def->height,  2.0 * def->radii[0], 2.0 * def->radii[1], 2.0 * def->radii[2]};
    double largest = 0.0;
    for (int k = 0; k < 8; k++)
        largest = fmax(largest, dims[k] * def->scale);
    const double most = PRIMITIVE_SPACINGS * r->scene->structure.spacing;
    if (largest <= most) return;
    char is[MORPH_NUMBER_TEXT], limit[MORPH_NUMBER_TEXT];
    morph_number_print(largest, is);
    morph_number_print(most, limit);
    const morph_value shape = morph_value_get(target, "shape");
    morph_value_fault(&shape, "the shape is %s m large, allowed: at most %s m (%g spacings)", is, limit,
                      PRIMITIVE_SPACINGS);
}

/* file, as found from the scene's folder. */
static void read_file(morph_scene_reader *r, const morph_value *target) {
    morph_target_def *def = &r->scene->target_def;
    const morph_value value = morph_value_get(target, "file");
    if (morph_value_text(&value, FILE_BYTES, &def->file_as_written) != MORPH_FOUND) return;
    const char *written = def->file_as_written, *scene = r->scene->file;
    const char *slash = strrchr(scene, '/');
    const size_t folder = written[0] != '/' && slash ? (size_t)(slash - scene) + 1 : 0;
    def->file = malloc(folder + strlen(written) + 1);
    if (!def->file) {
        r->yaml.faults.nomem = true;
        return;
    }
    memcpy(def->file, scene, folder);
    strcpy(def->file + folder, written);
}

/* scale or fit, rotate, at. */
static void read_placing(morph_scene_reader *r, const morph_value *target) {
    morph_target_def *def = &r->scene->target_def;
    const morph_value scale = morph_value_get(target, "scale"), fit = morph_value_get(target, "fit");
    morph_value_number(&scale, &scale_range, &def->scale);
    def->has_fit = morph_value_numbers(&fit, &fit_range, 3, def->fit) == MORPH_FOUND;
    if (scale.node && fit.node)
        morph_value_fault(&fit, "stands beside scale (line %d), allowed: one of the two", scale.line);
    double degrees[3] = {0.0, 0.0, 0.0};
    read_list(target, "rotate", &turn_range, degrees);
    for (int k = 0; k < 3; k++)
        def->rotate[k] = morph_radians(degrees[k]);
    r->at_known = read_list(target, "at", &place_range, def->at) == MORPH_FOUND;
}

/* Left out (or empty): rigid. */
static void read_deformable(const morph_value *target, morph_target_def *def) {
    static const char allowed[] = "is missing, allowed: a number above 0 and at most 1e+15 %s";
    const morph_value map = morph_scene_section(target, "deformable");
    if (!map.node) return;
    const morph_value young = morph_value_get(&map, "young"), density = morph_value_get(&map, "density");
    if (!young.node) morph_value_fault(&young, allowed, "Pa");
    if (!density.node) morph_value_fault(&density, allowed, "kg/m3");
    const bool stiff = morph_value_number(&young, &young_range, &def->young) == MORPH_FOUND;
    def->has_deformable = morph_value_number(&density, &density_range, &def->density) == MORPH_FOUND && stiff;
}

void morph_scene_read_target(morph_scene_reader *r, const morph_value *root) {
    const morph_value target = morph_value_get(root, "target");
    morph_target_def *def = &r->scene->target_def;
    def->scale = 1.0;
    def->cell = 1.0;
    if (!target.node || morph_value_is_empty(&target)) {
        morph_value_fault(&target, "is missing, allowed: a mapping with a shape and its keys");
        return;
    }
    const int before = r->yaml.faults.count;
    const morph_value map = morph_scene_section(root, "target");
    if (!map.node) return;

    const morph_value shape = morph_value_get(&map, "shape");
    char allowed[128];
    morph_join_names(morph_shape_names, 9, allowed, sizeof allowed);
    int chosen = 0;
    if (!shape.node) morph_value_fault(&shape, "is missing, allowed: %s", allowed);
    const bool shaped = morph_value_choice(&shape, morph_shape_names, 9, &chosen) == MORPH_FOUND;
    def->shape = (morph_shape)chosen;
    if (shaped) check_own_keys(&map, def->shape);

    read_list(&map, "size", &size_range, def->size);
    read_number(&map, "radius", &size_range, &def->radius);
    read_number(&map, "height", &size_range, &def->height);
    read_number(&map, "tube", &size_range, &def->tube);
    read_list(&map, "radii", &size_range, def->radii);
    read_number(&map, "cell", &size_range, &def->cell);
    read_file(r, &map);
    read_placing(r, &map);
    if (shaped) check_relations(&map, def);
    if (shaped) check_extent(r, &map);
    r->target_known = shaped && r->yaml.faults.count == before && !r->yaml.faults.nomem;
    read_deformable(&map, def);
}

/* Moves the mesh, built around the origin, to its place. Without `at` it stands on the base plane (on 0 where
 * there is none), centred. Both cases add the same numbers in the same order, so that a scene with the
 * default written out builds the same vertices. */
static void place(morph_scene_reader *r) {
    morph_scene *scene = r->scene;
    double *at = scene->target_def.at;
    morph_mesh_report *report = &scene->target_report;
    if (!r->at_known) {
        at[0] = at[1] = 0.0;
        at[2] = (isnan(scene->base) ? 0.0 : scene->base) - report->lo[2];
    }
    for (int i = 0; i < 3 * scene->target.vertices; i++)
        scene->target.v[i] += at[i % 3];
    for (int k = 0; k < 3; k++) {
        report->lo[k] += at[k];
        report->hi[k] += at[k];
    }
}

/* A target under the table or beside the grid gives a plan, but none that was meant. */
static void check_place(const morph_scene_reader *r, const morph_value *at) {
    const morph_scene *scene = r->scene;
    const morph_structure_def *def = &scene->structure;
    const morph_mesh_report *report = &scene->target_report;
    char top[MORPH_NUMBER_TEXT], base[MORPH_NUMBER_TEXT];
    if (report->hi[2] <= scene->base) {
        morph_number_print(report->hi[2], top);
        morph_number_print(scene->base, base);
        morph_value_fault(at, "the target ends at height %s, below the base, allowed: above %s", top, base);
    }
    /* The rising target starts below the blanket in its frame. */
    if (scene->motion.mode == MORPH_MODE_RISE && scene->motion.height > 0.0 && !isnan(scene->base) &&
        report->hi[2] - scene->motion.height > scene->base) {
        morph_number_print(scene->motion.height, top);
        morph_number_print(report->hi[2] - scene->base, base);
        morph_value_fault(
            at,
            "the target's top starts above the base when it rises by motion.height %s, allowed: "
            "a motion.height of at least %s",
            top, base);
    }
    if (!r->spacing_known || !r->nodes_known) return;
    for (int k = 0; k < 2; k++) {
        const double half = 0.5 * (def->nodes[k] - 1) * def->spacing;
        if (report->lo[k] >= half || report->hi[k] <= -half) {
            morph_value_warn(at, "the target lies beside the grid (in %c): nothing will cover it",
                             k ? 'y' : 'x');
            return;
        }
    }
}

morph_status morph_scene_build_target(morph_scene_reader *r, const morph_value *root) {
    morph_scene *scene = r->scene;
    const morph_value map = morph_value_get(root, "target");
    const morph_value file = morph_value_get(&map, "file"), shape = morph_value_get(&map, "shape");
    const morph_value *where = file.node ? &file : &shape;
    /* The spacing sets how finely primitives are tessellated; where it is not known only a file can still be
     * at fault, and a file's triangles do not depend on it. */
    if (!r->spacing_known && !file.node) return MORPH_OK;

    morph_target_def centred = scene->target_def;
    centred.at[0] = centred.at[1] = centred.at[2] = 0.0;
    char message[512] = "", warning[512] = "";
    const morph_status status =
        morph_target_build(&centred, scene->structure.spacing, &scene->target, &scene->target_report, message,
                           sizeof message, warning, sizeof warning);
    if (warning[0]) morph_value_warn(where, "%s", warning);
    if (status == MORPH_ERR_INPUT || status == MORPH_ERR_IO || status == MORPH_ERR_NONFINITE) {
        morph_value_fault(where, "%s", message[0] ? message : morph_status_text(status));
        return MORPH_ERR_INPUT;
    }
    if (status != MORPH_OK) return status;
    if (scene->target_def.has_deformable && !scene->target_report.closed) {
        const morph_value soft = morph_value_get(&map, "deformable");
        morph_value_fault(&soft,
                          "the target's surface is open (%d boundary edges) and has no inside to fill, "
                          "allowed: a closed one, or no deformable",
                          scene->target_report.boundary_edges);
        return MORPH_ERR_INPUT;
    }
    place(r);
    const morph_value at = morph_value_get(&map, "at");
    check_place(r, at.node ? &at : where);
    return MORPH_OK;
}
