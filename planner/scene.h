/* A scene: everything a user says of a morph, with every default filled in. */
#ifndef MORPH_SCENE_H
#define MORPH_SCENE_H

#include "model/attraction.h"
#include "model/blanket.h"
#include "model/mesh.h"
#include "model/structure.h"
#include "planner/goal.h"

typedef enum morph_shape {
    MORPH_SHAPE_BOX,
    MORPH_SHAPE_SPHERE,
    MORPH_SHAPE_ELLIPSOID,
    MORPH_SHAPE_CYLINDER,
    MORPH_SHAPE_CONE,
    MORPH_SHAPE_TORUS,
    MORPH_SHAPE_CAPSULE,
    MORPH_SHAPE_MESH,
    MORPH_SHAPE_HEIGHTMAP
} morph_shape;

typedef struct morph_target_def {
    morph_shape shape;
    double size[3]; /* box */
    double radius,
        height;      /* sphere, cylinder, cone, capsule (height: whole length); torus: radius of its circle */
    double tube;     /* torus: radius of the tube */
    double radii[3]; /* ellipsoid */
    char
        *file; /* mesh, heightmap: as found (relative to the scene's folder already joined); NULL otherwise */
    char *file_as_written; /* as the scene says it */
    double cell;           /* heightmap: distance of samples, in the file's unit of height */
    double scale;          /* 1 */
    bool has_fit;
    double fit[3];
    double
        rotate[3]; /* radians about the fixed x, then y, then z axis, about the centre of the bounding box */
    double at[3];  /* where the centre of the bounding box goes, last */
    bool has_deformable;
    double young, density; /* Pa, kg/m3; 0 where the target is rigid */
} morph_target_def;

/* Samples of a schedule at most: hours at a millisecond, and what a plan's file can reasonably hold. */
enum { MORPH_SCENE_SAMPLES = 200000 };

typedef enum morph_mode { MORPH_MODE_DROP, MORPH_MODE_RISE } morph_mode;

typedef struct morph_motion_def {
    morph_mode mode;
    double height, gravity, drag, friction, time;
} morph_motion_def;

/* auto: centres are placed by a later version, so auto and none plan alike for now. list: morph_scene.centre.
 */
typedef enum morph_attractors { MORPH_ATTRACT_AUTO, MORPH_ATTRACT_NONE, MORPH_ATTRACT_LIST } morph_attractors;

typedef enum morph_start_kind {
    MORPH_START_FLAT,
    MORPH_START_PLAN,    /* end pose of a plan folder */
    MORPH_START_LENGTHS, /* shape from measured lengths */
    MORPH_START_POSE     /* joints from a file */
} morph_start_kind;

/* Where the plan starts; see planner/start.h. Zeroed is flat. */
typedef struct morph_start {
    morph_start_kind kind;
    char *file, *as_written; /* as found; as the scene says it */
    int joints, links;
    double *pose;     /* 3*joints, m, wherever the file has it; NULL: flat */
    double *length;   /* links: as measured; NULL but for lengths */
    double residual;  /* largest |length of the pose - as measured|, m */
    double doubt;     /* how far another shape of these lengths was found to lie, m; NaN: none looked for */
    int free_motions; /* that lengths leave in this pose */
} morph_start;

typedef struct morph_scene {
    char *file; /* path of the scene */
    char *title;
    char sha256[65];               /* of the scene file's bytes, hexadecimal */
    morph_structure_def structure; /* its fixed_node points to fixed_node below */
    morph_target_def target_def;
    double base; /* NaN: none */
    morph_motion_def motion;
    morph_attractors attractors;
    morph_start start;
    morph_goal goal;   /* 0 where not asked for */
    double duration;   /* s; 0: auto */
    double sample;     /* s */
    morph_mesh target; /* built, in world coordinates, mended */
    morph_mesh_report target_report;
    int touches, centres;    /* as the scene lists them; 0 else */
    morph_hand *touch;       /* touches */
    morph_attractor *centre; /* centres, of MORPH_ATTRACT_LIST */
    int (*fixed_node)[2];    /* structure.fixed_nodes: structure.fixed as a list of nodes (i, j), each once */
    int *stuck_link;         /* structure.stuck_links: structure.link.stuck, each once */
} morph_scene;

/* Where faults go: one line each, "FILE:LINE: key: what is wrong, what is allowed". */
typedef void (*morph_fault_sink)(void *user, const char *line);

/* Reads and validates; *out is NULL unless MORPH_OK. All faults of the file, also those of the target's mesh,
 * are reported in the order of their lines before MORPH_ERR_INPUT is returned; a file that cannot be read is
 * a fault in line 1. What is understood but comes with a later version is the fault "FILE:LINE: KEY: not
 * available yet: KEY: VALUE". Warnings (an open mesh, a target beside the grid) go to `warn`, before the
 * faults. Either sink may be NULL. The target is imported, transformed and placed; target_def.at holds where,
 * also if the scene does not say. Angles are radians whose written degrees read back to the same bits. Other
 * errors: MORPH_ERR_NOMEM, MORPH_ERR_BACKEND and MORPH_ERR_INTERNAL from the mesh library's side, without a
 * line. The caller's locale does not matter and is not changed. */
morph_status morph_scene_read(const char *path, morph_fault_sink fault, morph_fault_sink warn, void *user,
                              morph_scene **out);
void morph_scene_destroy(morph_scene *scene); /* NULL allowed */

/* Can `method` ("ipopt", "nlopt", "blanket") plan this scene? If not, text names the first feature that it
 * does not support, "not available yet: motion.mode: rise with --method nlopt"; else text is "". The blanket
 * runs every scene that can be read. */
bool morph_scene_supported(const morph_scene *scene, const char *method, char *text, size_t size);
/* "KEY: VALUE" of the feature with which no centres of attraction are placed; false, and "", if there is
 * none. */
bool morph_scene_unplaceable(const morph_scene *scene, char *text, size_t size);

/* The scene with every default written out, as YAML text (free with free()). mesh_file: what to write as
 * target.file (the copy beside it, relative to where the text will stand), NULL for shapes without one or to
 * keep the scene's own words. Reading it again gives the same scene to the bit, but for file names and
 * sha256. MORPH_ERR_INPUT if mesh_file is not UTF-8, MORPH_ERR_NOMEM. */
morph_status morph_scene_to_yaml(const morph_scene *scene, const char *mesh_file, char **text);

#endif
