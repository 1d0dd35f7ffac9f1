/* The SmartMesh: joints, links, posts, angle tuples and skin of a double-layer grid.
 *
 * Numbering (a contract with other programs): joints layer by layer, bottom first, j*nx + i within a layer;
 * links bottom layer, top layer, braces, within a layer joint by joint, the x link before the y link. */
#ifndef MORPH_STRUCTURE_H
#define MORPH_STRUCTURE_H

#include "solvers/base.h"

typedef enum morph_layout { MORPH_LAYOUT_POSTS, MORPH_LAYOUT_OFFSET } morph_layout;
typedef enum morph_joint_type { MORPH_JOINTS_BALL, MORPH_JOINTS_UNIVERSAL } morph_joint_type;
typedef enum morph_bracing { MORPH_BRACING_NONE, MORPH_BRACING_WEB, MORPH_BRACING_FULL } morph_bracing;
typedef enum morph_support { MORPH_SUPPORT_BASE, MORPH_SUPPORT_FRAME, MORPH_SUPPORT_TARGET } morph_support;
enum { MORPH_LINK_BOTTOM = 0, MORPH_LINK_TOP = 1, MORPH_LINK_BRACE = 2 };

/* What the scene says of the structure. SI units, radians. */
typedef struct morph_structure_def {
    morph_layout layout;
    morph_joint_type joints;
    morph_bracing bracing;
    morph_support support;
    int nodes[2];
    double spacing, thickness;
    double mass;         /* per joint, kg */
    double length[3][2]; /* [bottom, top, brace][min, max], m; for braces times their start length */
    double radius;       /* of links; half-thickness of the skin, m */
    double rate, acceleration, jerk;
    double stiffness, damping;         /* blanket springs: N/m, N s/m */
    double link_post[2], link_link[2]; /* angle limits */
} morph_structure_def;

/* Immutable after create. All arrays are owned by the structure. */
typedef struct morph_structure {
    morph_structure_def def;
    int nx, ny;
    int joints, links, posts;
    int link_posts, link_links; /* counts of angle tuples */
    int skin_triangles;
    int panels; /* universal only, else 0 */

    int *joint_layer;          /* joints: 0 bottom, 1 top */
    int (*joint_node)[2];      /* joints: (i, j) */
    int (*link)[2];            /* links: joint numbers */
    int *link_kind;            /* links */
    double (*length_limit)[2]; /* links, m */
    double *start_length, *rate_limit, *acceleration_limit, *jerk_limit, *link_radius; /* links */
    int (*post)[2];      /* posts: bottom joint, top joint; post number = bottom joint number */
    double *post_length; /* posts */
    int (*link_post)[2]; /* link, post: angle between the link's direction away from that post and p = x_top -
                            x_bottom */
    double (*link_post_limit)[2]; /* radians */
    int (*link_link)[2];          /* two links sharing a joint: angle between their directions away from it */
    int *link_link_joint;         /* that joint */
    double (*link_link_limit)[2];
    int (*skin)[3]; /* triangles of the layer facing the target (bottom layer), normals away from the target
                       (up at start) */
    int (*panel)[2];
    double *start;  /* 3*joints: flat, bottom layer at z = 0, centred in x and y */
    double spacing; /* scale of everything */
} morph_structure;

/* Default def for a given spacing; nodes are 0 and must be set. */
morph_structure_def morph_structure_defaults(double spacing);

/* MORPH_ERR_INPUT if a field is not usable (the scene reader has said why before), MORPH_ERR_NOMEM. */
morph_status morph_structure_create(const morph_structure_def *def, morph_structure **out);
void morph_structure_destroy(morph_structure *structure); /* NULL allowed */

/* "link 17 (2,1)-(3,1) bottom"; text always ends in 0. */
void morph_link_name(const morph_structure *s, int link, char *text, size_t size);
void morph_joint_name(const morph_structure *s, int joint, char *text, size_t size);
void morph_post_name(const morph_structure *s, int post, char *text, size_t size);

/* lengths (links) from x (3*joints). */
void morph_link_lengths(const morph_structure *s, const double *x, double *lengths);

/* Direction vectors of an angle tuple: u and v such that the angle is acos(u.v/(|u||v|)), each as a signed
 * difference of two joints: u = x[uj[1]] - x[uj[0]], v likewise. */
void morph_link_post_joints(const morph_structure *s, int tuple, int uj[2], int vj[2]);
void morph_link_link_joints(const morph_structure *s, int tuple, int uj[2], int vj[2]);

#endif
