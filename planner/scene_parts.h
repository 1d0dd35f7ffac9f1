/* The scene reader's sections. Internal to planner/scene*.c. */
#ifndef MORPH_SCENE_PARTS_H
#define MORPH_SCENE_PARTS_H

#include "planner/scene.h"
#include "planner/yaml.h"

typedef struct morph_scene_reader {
    morph_yaml yaml;
    morph_scene *scene; /* being filled; defaults stand where a key was faulty */
    bool spacing_known; /* structure.spacing was read: lengths may be compared with it */
    bool nodes_known;   /* structure.nodes was read: node numbers may be checked */
    bool target_known;  /* the target's keys had no fault: it may be built */
    bool at_known;      /* target.at was read; else it follows from base and the shape's extent */
    bool layout_known;  /* structure.layout was read or left out: which nodes a layer has may be checked */
} morph_scene_reader;

/* No length, mass, force ... of a scene is larger: squares and products of a few stay finite. */
#define MORPH_SCENE_LARGEST 1e9

/* The names of each enum, in its order. */
extern const char *const morph_layout_names[2],
    *const morph_fixed_names[3], *const morph_joint_type_names[2], *const morph_bracing_names[3],
                                                                       *const morph_support_names[3],
                                                                           *const morph_shape_names[9],
                                                                               *const morph_mode_names[2];

/* A section: the mapping under key, its keys checked (unknown ones and duplicates are faults). node is NULL
 * if it is absent, empty or no mapping (a fault). */
morph_value morph_scene_section(const morph_value *parent, const char *key);
/* The same check for a mapping that is already at hand. */
void morph_scene_check_keys(const morph_value *map);

/* Each reads one section of root into r->scene, after its defaults. */
void morph_scene_read_structure(morph_scene_reader *r, const morph_value *root);
void morph_scene_read_target(morph_scene_reader *r, const morph_value *root);
void morph_scene_read_motion(morph_scene_reader *r, const morph_value *root);
/* motion.touch, of the motion section. */
void morph_scene_read_touch(morph_scene_reader *r, const morph_value *motion);
/* attractors, start, goal. */
void morph_scene_read_extras(morph_scene_reader *r, const morph_value *root);

/* Builds and places the target; its faults stand at target.file or target.shape. MORPH_ERR_INPUT leaves a
 * fault; other failures are handed on. */
morph_status morph_scene_build_target(morph_scene_reader *r, const morph_value *root);

/* Reads what the start names, once the structure is known to be good; faults stand at start. Failures as
 * above. */
morph_status morph_scene_build_start(morph_scene_reader *r, const morph_value *root);

/* The whole reading but for the file: bytes[size] are the file's. As morph_scene_read. */
morph_status morph_scene_parse(const char *path, const char *bytes, size_t size, morph_fault_sink fault,
                               morph_fault_sink warn, void *user, morph_scene **out);

#endif
