/* The SmartMesh: joints, links, posts, angle tuples and skin of a double-layer grid.
 *
 * Layout `posts`: two equal grids, a rigid post at each node. Bracing `web` adds one diagonal link to each
 * side panel (two posts joined by a link of each layer), `full` also one to each cell of each layer. Joints
 * `universal` keep each side panel plane. Layout `offset`: the square-on-offset-square double layer: the
 * bottom grid is one node smaller each way and lies under the middles of the top cells; no posts, but four
 * links of equal length (of kind brace) from each bottom joint to the corners of the cell above it.
 *
 * Numbering (a contract with other programs): joints layer by layer, bottom first, j*n + i within a layer of
 * n nodes along x; links bottom layer, top layer, braces, within a layer joint by joint, the x link before
 * the y link. Braces: web by web in the order of the bottom links whose panel they cross, then the cells of
 * the bottom layer, then those of the top layer, i fastest; `offset`: bottom joint by bottom joint, to the
 * corners (i,j), (i+1,j), (i,j+1), (i+1,j+1) of its cell. */
#ifndef MORPH_STRUCTURE_H
#define MORPH_STRUCTURE_H

#include "solvers/base.h"

typedef enum morph_layout { MORPH_LAYOUT_POSTS, MORPH_LAYOUT_OFFSET } morph_layout;
typedef enum morph_joint_type { MORPH_JOINTS_BALL, MORPH_JOINTS_UNIVERSAL } morph_joint_type;
typedef enum morph_bracing { MORPH_BRACING_NONE, MORPH_BRACING_WEB, MORPH_BRACING_FULL } morph_bracing;
typedef enum morph_support { MORPH_SUPPORT_BASE, MORPH_SUPPORT_FRAME, MORPH_SUPPORT_TARGET } morph_support;
typedef enum morph_fixed {
    MORPH_FIXED_NONE,
    MORPH_FIXED_BORDER,
    MORPH_FIXED_CORNERS,
    MORPH_FIXED_LIST
} morph_fixed;
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
    /* The blanket's springs at them: energy angle_stiffness/2 (excess over the limit less angle_soft)^2 of
     * each angle, none on the far side, N m and radians; and `square`/2 cos^2 of each link-post angle, N m.
     * 0: none. */
    double angle_stiffness, angle_soft, square;
    morph_fixed fixed;          /* nodes held where they start */
    int fixed_nodes;            /* of MORPH_FIXED_LIST, else not looked at */
    const int (*fixed_node)[2]; /* (i, j), repeats allowed; borrowed (a structure's own def: its copy) */
    int stuck_links;            /* links that hold their start length: both limits are that */
    const int *stuck_link;      /* their numbers, repeats allowed; borrowed as fixed_node is */
} morph_structure_def;

/* Immutable after create. All arrays are owned by the structure. */
typedef struct morph_structure {
    morph_structure_def def;
    int nx, ny;
    int joints, links, posts;
    int link_posts, link_links; /* counts of angle tuples */
    int skin_triangles;
    int panels; /* universal only, else 0 */
    int fixed_count, fixed_joints;
    int layer_nodes[2][2]; /* nodes along x and y of the bottom and of the top layer */

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
    int (*skin)[3];  /* triangles of the layer facing the target (bottom layer), normals away from the target
                        (up at start) */
    int (*panel)[2]; /* two posts whose side panel must stay plane, in the order of the bottom links */
    int *fixed;      /* posts held where they start, ascending; in layout offset, which has none: joints held,
                        those of      the top layer (the grid that the scene's nodes count) */
    int *fixed_joint;     /* fixed_joints: all joints held, ascending */
    bool *joint_fixed;    /* joints */
    int (*fixed_node)[2]; /* behind def.fixed_node */
    int *stuck_link;      /* behind def.stuck_link */
    double *start;        /* 3*joints: flat, bottom layer at z = 0, centred in x and y */
    double spacing;       /* scale of everything */
} morph_structure;

/* Default def for a given spacing; nodes are 0 and must be set. */
morph_structure_def morph_structure_defaults(double spacing);

/* Nodes along x and y of a layer (0 bottom, 1 top). */
void morph_layer_nodes(const morph_structure_def *def, int layer, int nodes[2]);
/* Number of the joint at node (i, j) of a layer; -1 if the layer has no such node. */
int morph_node_joint(const morph_structure_def *def, int layer, int i, int j);
/* The inverse: layer and node of a joint of the structure. */
void morph_joint_place(const morph_structure_def *def, int joint, int *layer, int node[2]);
/* Links in all; def->nodes must be valid. */
int morph_link_count(const morph_structure_def *def);

/* `offset` takes joints ball, bracing none and at least 3 nodes each way (else its bottom layer has no cell).
 * MORPH_ERR_INPUT if a field is not usable (the scene reader has said why before), MORPH_ERR_NOMEM. */
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
