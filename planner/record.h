/* The record: an in-memory mirror of plan.h5. Planner fills it; writer, reader, check, picture, report and
 * export read it. Self-contained: nothing in it points elsewhere. Arrays are owned; a NULL array is a dataset
 * that is absent. */
#ifndef MORPH_RECORD_H
#define MORPH_RECORD_H

#include "planner/goal.h"

typedef struct morph_record {
    /* root attributes */
    double base;      /* NaN: none */
    morph_goal goal;  /* 0 where the scene asks for nothing */
    char program[64]; /* "morphplan 0.1.0" */
    char scene_sha256[65];
    char outcome[16]; /* optimal, feasible, infeasible, stopped */
    /* structure/ */
    int joints, links, posts, link_posts, link_links, skin_triangles, panels, fixed_count;
    int *joint_layer;
    int (*joint_node)[2];
    int (*link)[2];
    int *link_kind;
    double (*length_limit)[2];
    double *rate_limit, *acceleration_limit, *jerk_limit, *link_radius;
    int (*post)[2];
    double *post_length;
    int (*link_post)[2];
    double (*link_post_limit)[2];
    int (*link_link)[2];
    double (*link_link_limit)[2];
    int (*skin)[3];
    int (*panel)[2];
    int *fixed;
    double spacing; /* structure@spacing, an attribute of the group */
    /* target/ */
    int target_vertices, target_triangles;
    double *target_v;
    int *target_t;
    double *offset_nominal;  /* nominal_frames x 3 */
    double *offset_schedule; /* samples x 3 */
    /* deformed/: the surface of a deformable target at the end of nominal/ */
    int deformed_vertices, deformed_triangles;
    double *deformed_v;
    int *deformed_t;
    /* nominal/ */
    int nominal_frames;
    double *nominal_time, *nominal_joints, *nominal_lengths;
    /* placement/: centres of attraction before and after, x, y, z [m], strength [N m2]; guided/: the blanket
     * under them */
    int centres_before, centres_after;
    double (*placement_before)[4], (*placement_after)[4];
    int guided_frames;
    double *guided_time, *guided_joints, *guided_lengths;
    /* path/ */
    int poses, pose_width;       /* 6*posts, or 3*joints without posts */
    double *path_s, *path_poses; /* poses; poses x pose_width (centre and direction per post) */
    /* timing/: s(tau), tau = time / duration, as a quintic spline; with path/ it gives the schedule exactly
     */
    int timing_knots, timing_controls;
    double *timing_knot, *timing_control, *timing_duration; /* the last is one number, s */
    /* schedule/ */
    int samples;
    double *time, *schedule_joints, *length, *rate, *acceleration;
    /* replay/: by lengths alone, without the target and with it as a solid core */
    int replay_frames, core_frames;
    double *replay_time, *replay_joints, *core_time, *core_joints;
    /* mobility/ */
    int mobility_samples;
    int *mobility_sample, *mobility_rank, *mobility_free, *mobility_redundant;
    double *mobility_sigma_min;
} morph_record;

void morph_record_free(morph_record *record); /* frees the arrays and zeroes *record */

#endif
