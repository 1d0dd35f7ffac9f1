/* The main job: every stage from a scene to a checked record and its summary. Each stage reads what stands
 * before it and writes only its own. */
#ifndef MORPH_PLAN_H
#define MORPH_PLAN_H

#include "planner/path.h"
#include "planner/refine.h"
#include "planner/scene.h"
#include "planner/summary.h"
#include "planner/timing.h"

struct morph_placement;

typedef enum morph_method { MORPH_METHOD_IPOPT, MORPH_METHOD_BLANKET, MORPH_METHOD_NLOPT } morph_method;

typedef struct morph_plan_options {
    morph_method method;
    const morph_control *control;
    void (*warn)(void *user,
                 const char *line); /* the reach check's findings, with the control's user; NULL */
    /* Centres that were placed for this scene already, with their run; NULL: the plan places its own. */
    const struct morph_placement *placement;
    double budget; /* s for the plan and its writing; 0: none. A feasible plan is sought first, then better */
    char *message; /* why there is no plan, where more can be said than the status does; NULL */
    size_t message_size;
} morph_plan_options;

typedef struct morph_plan {
    morph_record record;
    morph_summary summary;
} morph_plan;

/* MORPH_OK whenever there is a record to write: summary.outcome says what it is worth ("stopped" after the
 * control's stop). */
morph_status morph_plan_run(const morph_scene *scene, const morph_plan_options *options, morph_plan **out);
void morph_plan_destroy(morph_plan *plan);

/* What the stages after the scene share; used by the benchmarks too. */
typedef struct morph_workspace {
    morph_structure *structure;
    morph_distance *exact;
    morph_sdf *sdf; /* NULL for a deformable target, until it is pressed */
    morph_cavity *cavity;
    morph_world world;
    double *start; /* 3*joints: flat, at the drop height above the target or in its frame */
    double *begin; /* 3*joints: where the refined path starts: as start, or the scene's own start put there */
    morph_sdf_accuracy accuracy;
} morph_workspace;
morph_status morph_workspace_create(const morph_scene *scene, const morph_control *control,
                                    morph_workspace *out);
/* Puts the surface that a deformable target was pressed to in the target's place, as a rigid one: distances,
 * their grid and the cavity from here on are to it. The start stays where it is. */
morph_status morph_workspace_press(morph_workspace *w, const morph_scene *scene, const morph_mesh *surface,
                                   const morph_control *control);
void morph_workspace_free(morph_workspace *w);
/* Height of the bottom layer at the start, m. */
double morph_scene_start_height(const morph_scene *scene);
/* What drives the pure blanket; points into scene and structure. */
morph_blanket_def morph_scene_blanket(const morph_scene *scene, const morph_structure *structure);

/* Copies the structure and target into the record, and a curve with its timing as samples. */
morph_status morph_record_structure(morph_record *r, const morph_structure *s, const morph_mesh *target,
                                    double base);
/* The surface of a deformable target at the end of the nominal run. */
morph_status morph_record_deformed(morph_record *r, const morph_mesh *surface);
morph_status morph_record_nominal(morph_record *r, const morph_structure *s, const morph_trajectory *t);
morph_status morph_record_schedule(morph_record *r, const morph_curve *curve, const morph_timing *timing,
                                   double sample);
morph_status morph_record_guided(morph_record *r, const morph_structure *s, const struct morph_placement *p);
/* Frames of a replay, moved into *time and *joints; t keeps nothing of them. */
void morph_record_replay(morph_trajectory *t, int *frames, double **time, double **joints);
morph_status morph_record_mobility(morph_record *r, const morph_structure *s);

#endif
