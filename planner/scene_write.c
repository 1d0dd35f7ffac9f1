/* A scene as YAML, every default written out; reading it gives the same numbers to the bit. */
#include "planner/scene_parts.h"

#include <locale.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct buffer {
    char *text;
    size_t used, size;
    bool nomem;
} buffer;

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
static void
put(buffer *b, const char *format, ...) {
    if (b->nomem) return;
    char piece[512];
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(piece, sizeof piece, format, args);
    va_end(args);
    if (n < 0 || (size_t)n >= sizeof piece) {
        b->nomem = true; /* no caller writes as much in one go */
        return;
    }
    if (b->used + (size_t)n + 1 > b->size) {
        const size_t size = 2 * b->size + (size_t)n + 1024;
        char *grown = realloc(b->text, size);
        if (!grown) {
            b->nomem = true;
            return;
        }
        b->text = grown;
        b->size = size;
    }
    memcpy(b->text + b->used, piece, (size_t)n + 1);
    b->used += (size_t)n;
}

static void put_number(buffer *b, const char *key, double x) {
    char text[MORPH_NUMBER_TEXT];
    morph_number_print(x, text);
    put(b, "%s: %s\n", key, text);
}

/* key: [x, y, ...], in degrees where the values are radians. */
static void put_numbers(buffer *b, const char *key, const double *x, int n, bool degrees) {
    put(b, "%s: [", key);
    for (int k = 0; k < n; k++) {
        char text[MORPH_NUMBER_TEXT];
        if (degrees)
            morph_degrees_print(x[k], text);
        else
            morph_number_print(x[k], text);
        put(b, "%s%s", k ? ", " : "", text);
    }
    put(b, "]\n");
}

/* Code point of the UTF-8 character at s and its length; 0 if it is none. */
static int decode(const unsigned char *s, unsigned *code) {
    const int n = s[0] < 0x80 ? 1 : s[0] >= 0xf0 ? 4 : s[0] >= 0xe0 ? 3 : s[0] >= 0xc2 ? 2 : 0;
    if (n == 0) return 0;
    *code = n == 1 ? s[0] : s[0] & (0x7fu >> n);
    for (int k = 1; k < n; k++) {
        if ((s[k] & 0xc0) != 0x80) return 0;
        *code = *code << 6 | (s[k] & 0x3fu);
    }
    return n;
}

/* Double-quoted, with everything escaped that YAML would not take or would fold. False if text is not UTF-8.
 */
static bool put_text(buffer *b, const char *key, const char *text) {
    put(b, "%s: \"", key);
    for (const unsigned char *s = (const unsigned char *)text; *s;) {
        unsigned code = 0;
        const int n = decode(s, &code);
        if (n == 0) return false;
        const bool line_end = code == 0x85 || code == 0x2028 || code == 0x2029;
        const bool odd = (code >= 0x7f && code < 0xa0) || code == 0xfeff || code == 0xfffe || code == 0xffff;
        if (code == '"' || code == '\\')
            put(b, "\\%c", (char)code);
        else if (code < 0x20 || odd || line_end)
            put(b, "\\u%04x", code);
        else
            put(b, "%.*s", n, (const char *)s);
        s += n;
    }
    put(b, "\"\n");
    return true;
}

static void put_fixed(buffer *b, const morph_structure_def *def) {
    if (def->fixed != MORPH_FIXED_LIST) {
        put(b, "  fixed: %s\n", morph_fixed_names[def->fixed]);
        return;
    }
    put(b, "  fixed: [");
    for (int k = 0; k < def->fixed_nodes; k++)
        put(b, "%s[%d, %d]", k ? ", " : "", def->fixed_node[k][0], def->fixed_node[k][1]);
    put(b, "]\n");
}

static void put_structure(buffer *b, const morph_structure_def *def) {
    put(b, "structure:\n");
    put(b, "  layout: %s\n", morph_layout_names[def->layout]);
    put(b, "  nodes: [%d, %d]\n", def->nodes[0], def->nodes[1]);
    put_number(b, "  spacing", def->spacing);
    put_number(b, "  thickness", def->thickness);
    put(b, "  joints: %s\n", morph_joint_type_names[def->joints]);
    put(b, "  bracing: %s\n", morph_bracing_names[def->bracing]);
    put_number(b, "  mass", def->mass);
    put_fixed(b, def);
    put(b, "  support: %s\n", morph_support_names[def->support]);
    put(b, "  link:\n    length:\n");
    put_numbers(b, "      bottom", def->length[MORPH_LINK_BOTTOM], 2, false);
    put_numbers(b, "      top", def->length[MORPH_LINK_TOP], 2, false);
    put_numbers(b, "      brace", def->length[MORPH_LINK_BRACE], 2, false);
    put_number(b, "    radius", def->radius);
    put_number(b, "    rate", def->rate);
    put_number(b, "    acceleration", def->acceleration);
    put_number(b, "    jerk", def->jerk);
    put_number(b, "    stiffness", def->stiffness);
    put_number(b, "    damping", def->damping);
    put(b, "    stuck: [");
    for (int k = 0; k < def->stuck_links; k++)
        put(b, "%s%d", k ? ", " : "", def->stuck_link[k]);
    put(b, "]\n");
    put(b, "  angle:\n");
    put_numbers(b, "    link_post", def->link_post, 2, true);
    put_numbers(b, "    link_link", def->link_link, 2, true);
    char soft[MORPH_NUMBER_TEXT];
    morph_degrees_print(def->angle_soft, soft);
    put_number(b, "    stiffness", def->angle_stiffness);
    put(b, "    soft: %s\n", soft);
    put_number(b, "    square", def->square);
}

static bool put_target(buffer *b, const morph_target_def *def, const char *file) {
    bool good = true;
    put(b, "target:\n  shape: %s\n", morph_shape_names[def->shape]);
    switch (def->shape) {
    case MORPH_SHAPE_BOX:
        put_numbers(b, "  size", def->size, 3, false);
        break;
    case MORPH_SHAPE_ELLIPSOID:
        put_numbers(b, "  radii", def->radii, 3, false);
        break;
    case MORPH_SHAPE_SPHERE:
        put_number(b, "  radius", def->radius);
        break;
    case MORPH_SHAPE_CYLINDER:
    case MORPH_SHAPE_CONE:
    case MORPH_SHAPE_CAPSULE:
        put_number(b, "  radius", def->radius);
        put_number(b, "  height", def->height);
        break;
    case MORPH_SHAPE_TORUS:
        put_number(b, "  radius", def->radius);
        put_number(b, "  tube", def->tube);
        break;
    case MORPH_SHAPE_MESH:
    case MORPH_SHAPE_HEIGHTMAP:
        good = put_text(b, "  file", file ? file : def->file_as_written ? def->file_as_written : "");
        if (def->shape == MORPH_SHAPE_HEIGHTMAP) put_number(b, "  cell", def->cell);
        break;
    }
    if (def->has_fit)
        put_numbers(b, "  fit", def->fit, 3, false);
    else
        put_number(b, "  scale", def->scale);
    put_numbers(b, "  rotate", def->rotate, 3, true);
    put_numbers(b, "  at", def->at, 3, false);
    if (def->has_deformable) {
        put(b, "  deformable:\n");
        put_number(b, "    young", def->young);
        put_number(b, "    density", def->density);
    }
    return good;
}

static void put_touch(buffer *b, const morph_scene *scene) {
    put(b, scene->touches > 0 ? "  touch:\n" : "  touch: []\n");
    for (int k = 0; k < scene->touches; k++) {
        const morph_hand *t = &scene->touch[k];
        int layer, node[2];
        morph_joint_place(&scene->structure, t->joint, &layer, node);
        put(b, "    - node: [%d, %d]\n", node[0], node[1]);
        put(b, "      layer: %s\n", layer ? "top" : "bottom");
        put_numbers(b, "      force", t->force, 3, false);
        put_number(b, "      from", t->from);
        put_number(b, "      to", t->to);
    }
}

static void put_attractors(buffer *b, const morph_scene *scene) {
    if (scene->attractors != MORPH_ATTRACT_LIST) {
        put(b, "attractors: %s\n", scene->attractors == MORPH_ATTRACT_NONE ? "none" : "auto");
        return;
    }
    put(b, "attractors:\n");
    for (int k = 0; k < scene->centres; k++) {
        put_numbers(b, "  - at", scene->centre[k].at, 3, false);
        put_number(b, "    strength", scene->centre[k].strength);
    }
}

static void put_motion(buffer *b, const morph_scene *scene) {
    const morph_motion_def *motion = &scene->motion;
    put(b, "motion:\n  mode: %s\n", morph_mode_names[motion->mode]);
    put_number(b, "  height", motion->height);
    put_number(b, "  gravity", motion->gravity);
    put_number(b, "  drag", motion->drag);
    put_number(b, "  friction", motion->friction);
    put_number(b, "  time", motion->time);
    put_touch(b, scene);
}

static void put_goal(buffer *b, const morph_goal *goal) {
    if (!morph_goal_any(goal)) return;
    put(b, "goal:\n");
    for (int k = 0; k < MORPH_GOAL_KINDS; k++) {
        char key[32];
        snprintf(key, sizeof key, "  %s", morph_goal_name((morph_goal_kind)k));
        if (goal->limit[k] > 0.0) put_number(b, key, goal->limit[k]);
    }
}

static bool put_scene(buffer *b, const morph_scene *scene, const char *mesh_file) {
    put(b, "morphplan: 1\n");
    if (!put_text(b, "title", scene->title ? scene->title : "morph")) return false;
    put_structure(b, &scene->structure);
    if (!put_target(b, &scene->target_def, mesh_file)) return false;
    if (isnan(scene->base))
        put(b, "base: none\n");
    else
        put_number(b, "base", scene->base);
    put_motion(b, scene);
    put_attractors(b, scene);
    if (!scene->start.file)
        put(b, "start: flat\n");
    else if (!put_text(b, "start", scene->start.as_written))
        return false;
    put_goal(b, &scene->goal);
    put(b, "schedule:\n");
    if (scene->duration > 0.0)
        put_number(b, "  duration", scene->duration);
    else
        put(b, "  duration: auto\n");
    put_number(b, "  sample", scene->sample);
    return true;
}

morph_status morph_scene_to_yaml(const morph_scene *scene, const char *mesh_file, char **text) {
    *text = NULL;
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!plain) return MORPH_ERR_NOMEM;
    const locale_t before = uselocale(plain);
    buffer b = {0};
    const bool good = put_scene(&b, scene, mesh_file);
    uselocale(before);
    freelocale(plain);
    if (!good || b.nomem) {
        free(b.text);
        return b.nomem ? MORPH_ERR_NOMEM : MORPH_ERR_INPUT;
    }
    *text = b.text;
    return MORPH_OK;
}
