/* One pose and its limits: which rows stand near their limits, how far a pose is beyond them (from raw
 * positions). */
#ifndef MORPH_POSE_H
#define MORPH_POSE_H

#include "planner/blocks.h"

/* What every pose of a plan shares. Pointers only; owned elsewhere. */
typedef struct morph_world {
    const morph_structure *structure;
    const morph_distance *exact; /* the target */
    const morph_sdf *sdf;        /* the same, smooth */
    const morph_cavity *cavity;
    double base; /* NaN: none */
    double lift; /* the target stands so far above its place, m; the base plane stays */
} morph_world;

/* How far inside its limits a pose is to stay. Spacings and radians. */
typedef struct morph_inset {
    double length, angle, clearance, self;
} morph_inset;

typedef enum morph_limit {
    MORPH_LIMIT_POST,
    MORPH_LIMIT_PANEL,
    MORPH_LIMIT_LENGTH,
    MORPH_LIMIT_ANGLE,
    MORPH_LIMIT_CLEARANCE,
    MORPH_LIMIT_BASE,
    MORPH_LIMIT_SELF,
    MORPH_LIMITS
} morph_limit;
const char *morph_limit_name(morph_limit limit);

/* How far a pose is beyond its limits (without inset): spacings, radians, relative for posts, or the
 * sine of a panel; 0 or less: inside. */
typedef struct morph_violation {
    double amount[MORPH_LIMITS];
    char element[MORPH_LIMITS][112];
} morph_violation;

/* Rows of one pose. Examinations add to them; pairs are measured anew each time. */
typedef struct morph_active {
    int links, tuples, points, features, pairs;
    int *link, *tuple; /* capacity: all of them */
    bool *has_link, *has_tuple;
    morph_point *point;
    morph_feature *feature;
    morph_pair *pair;
    int point_capacity, feature_capacity, pair_capacity;
    /* Storage of the blocks: data and bounds, rebuilt by morph_active_blocks. */
    morph_post_rows post_rows;
    morph_panel_rows panel_rows;
    morph_length_rows length_rows;
    morph_angle_rows angle_rows;
    morph_clearance_rows clearance_rows;
    morph_feature_rows feature_rows;
    morph_separation_rows separation_rows;
    double *lower, *upper;
    int bound_capacity;
} morph_active;

morph_status morph_active_create(const morph_structure *structure, morph_active **out);
void morph_active_destroy(morph_active *active);
/* Forgets all rows, keeps the memory. */
void morph_active_clear(morph_active *active, const morph_structure *structure);

/* How near to its limit a row must stand to enter. Spacings, radians. */
typedef struct morph_nearness {
    double length, angle, clearance, self;
} morph_nearness;

/* Measures pose x (scaled) exactly and, where active is not NULL, adds the rows within `near` of their limits
 * (inset included) and those violated, and renews the bias of all its contact points. added may be NULL. */
morph_status morph_pose_examine(const morph_world *world, const double *x, const morph_inset *inset,
                                const morph_nearness *near, morph_active *active, int *added,
                                morph_violation *violation);

/* Fills out with the constraint blocks that have rows (of posts, panels, lengths, angles, clearance,
 * features, separation) and returns their number. `unknown` as in blocks.h. The blocks refer to storage in
 * *active and stand until the next call. -1 if memory is refused. */
enum { MORPH_POSE_BLOCKS = 7 };
int morph_active_blocks(morph_active *active, const morph_world *world, const int *unknown,
                        const morph_inset *inset, morph_block out[MORPH_POSE_BLOCKS]);

/* Rows now in use, and all that there could be (every link, angle, skin and link element, axis pair). */
int morph_active_rows(const morph_active *active, const morph_structure *structure);
int morph_possible_rows(const morph_structure *structure);

/* Lower bounds of a pose's coordinates from the base plane (scaled); -INFINITY where there is none. */
void morph_pose_bounds(const morph_world *world, double margin, double *lower);

/* Box of a pose's coordinates about `reference` (scaled): as far as `reach`, no lower than `base` (what
 * morph_pose_bounds gave), and joints that are held where the reference has them. lower may be base. */
void morph_pose_box(const morph_world *world, const double *base, const double *reference, double reach,
                    double *lower, double *upper);

/* Worst of a violation in common terms: each amount divided by its tolerance. */
double morph_violation_worst(const morph_violation *v, const double tolerance[MORPH_LIMITS],
                             morph_limit *which);

#endif
