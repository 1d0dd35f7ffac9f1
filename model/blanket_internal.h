/* Inside the blanket: its mutable state and the pieces that move it. For model/blanket*.c and their tests.
 *
 * Every free joint has the same mass, so the mass-weighted corrections of the projections weigh them alike:
 * a constraint c(x) is corrected by dx_j = -c w_j grad_j / sum_k w_k |grad_k|^2 with w = 1 for a free joint
 * and 0 for one that is held, which keeps linear momentum wherever no joint is held and the gradients of one
 * constraint add up to zero. */
#ifndef MORPH_BLANKET_INTERNAL_H
#define MORPH_BLANKET_INTERNAL_H

#include "model/blanket.h"

/* A place on a joint (1 corner), a link (2) or a skin triangle (3) that may touch the target. */
typedef struct morph_touch {
    int joint[3], corners;
    int span;
    double weight[3];        /* barycentric */
    double radius;           /* m */
    double stride;           /* of the search for the deepest place on the element; 0: the place is fixed */
    double at[3];            /* where the target's distance was last taken, seen from the target */
    double phi, gradient[3]; /* that distance and its gradient */
    bool known;
} morph_touch;

/* What a contact's corrections came to in the last step. */
typedef struct morph_hold {
    double push, drag[3];
} morph_hold;

/* One contact of one step: the half space normal.q >= level for the place's centre q. */
typedef struct morph_contact {
    int joint[3], corners;
    double weight[3];
    double normal[3], level;
    double before[3]; /* q at the step's start: friction acts on the motion since */
    double share[3];  /* weight times the joint's own */
    double inverse;   /* 1 / sum weight share */
    double radius;    /* of the place; -1: the plane stays as it is in this step */
    double spare;     /* to the half space where the limits were listed */
    int source;       /* number of the touch; touches + joint for the base plane */
    double push;      /* accumulated along the normal, >= 0 (m per unit weight) */
    double drag[3];   /* accumulated friction, at most friction * push */
} morph_contact;

/* What every complete sweep asks of an angle between u and v, floor <= cos <= ceiling: apart from the rest,
 * so that the many that are in no need of correction stay in the cache. */
typedef struct morph_turn {
    int u[2], v[2];        /* an arm leads from its first joint to its second */
    double floor, ceiling; /* aimed at, a little inside */
    double push[2];        /* accumulated corrections of this step: at floor, at ceiling */
} morph_turn;

/* The rest of it; joint[k] enters u with su[k] and v with sv[k]. */
typedef struct morph_angle {
    int joint[4], joints;
    double su[4], sv[4];
    double weight[4];       /* of its joints */
    double lowest, highest; /* the structure's limits */
    /* As the last complete sweep found it: cos = level + sum grad.x, and 1 / sum |grad|^2. */
    double grad[4][3], level, inverse, size, most;
    bool linear; /* these are known */
} morph_angle;

/* A damper between two joints: of a link, or of so many angles at once. */
typedef struct morph_damper {
    int joint[2], angles; /* 0: of a link */
    int number;           /* in the structure's order */
} morph_damper;

/* Sweeps of a step; the limits' margins absorb what is left. */
#define MORPH_BLANKET_SWEEPS 12
/* What sweeps may add to a step's motion, spacings: as much again as the longest, of what they have to take
 * back, and a few times the limits' margins; no more than the most. */
#define MORPH_BLANKET_ADD 3e-3
#define MORPH_BLANKET_ADD_MOST 0.02

/* Sweeps end when none of their corrections moves a joint further, spacings: a fiftieth of those margins. */
#define MORPH_BLANKET_SWEPT 2e-6

/* Least stride of the search for the deepest place on an element, in barycentric weight. */
#define MORPH_BLANKET_SHORTEST_STRIDE 0.01

/* What counts as held: lengths a tenth of a millionth part of what a link moves through, clearance what a
 * plan's clearance is checked to (spacings); panels what a plan's are checked to (sine), posts
 * a thousandth of what a plan's are (relative). */
#define MORPH_BLANKET_LENGTH_HELD 1e-9
#define MORPH_BLANKET_CLEARANCE_HELD 1e-3
#define MORPH_BLANKET_PANEL_HELD 1e-6
#define MORPH_BLANKET_POST_HELD 1e-9

/* Where an element was when its exact distance was taken, and what that left over beyond its radius. */
typedef struct morph_memo {
    double corner[3][3], gap;
    double been;                /* path of its span and the target by then; -INFINITY: unknown */
    double weight[3];           /* of the deepest place */
    double normal[3], point[3]; /* there: gradient of the distance, closest point of the target */
    bool bounded;      /* gap is only a lower bound, the others are of some other place of the element */
    int touch;         /* the place that seeks on it */
    int vertex;        /* of a convex target, where the last climb ended, from 1; 0: nowhere */
    bool planar;       /* by a plane that has all of the target behind it */
    bool known, fresh; /* fresh: taken since the last morph_blanket_seek_deepest */
} morph_memo;

/* How far the state is from its limits; violations are >= 0. */
typedef struct morph_violation {
    double length;    /* m */
    double post;      /* relative */
    double clearance; /* m, at the places known */
    double angle;     /* in cosine */
    double panel;     /* sine */
    int link, tuple;  /* where length and angle are worst */
} morph_violation;

/* The swept guard (blanket_swept.c). */
enum { MORPH_BLANKET_WATCHED = 64 };
typedef struct morph_guard {
    int steps, crossings;             /* looked at; refused, in all */
    int refused;                      /* in this frame */
    int through;                      /* 1 + the element that no step keeps outside; 0: none */
    int watch[MORPH_BLANKET_WATCHED]; /* elements that were crossed: links, then skin triangles */
    int watched;
    int usual;         /* steps of a frame before it refused some; 0: none kept */
    bool known, blind; /* the field does not feel parts of the target */
} morph_guard;

typedef struct morph_blanket_hull morph_blanket_hull;
typedef struct morph_blanket_fix morph_blanket_fix;
typedef struct morph_blanket_self morph_blanket_self;
typedef struct morph_blanket_soft morph_blanket_soft;

typedef struct morph_blanket_state {
    const morph_structure *structure;
    const morph_sdf *sdf;        /* NULL: no target */
    const morph_distance *exact; /* may be NULL */
    bool convex;                 /* so is the target of `exact` */
    morph_blanket_hull *hull;    /* of that; may be NULL */
    morph_blanket_def def;
    int joints, links, posts, angles, touches, contacts;
    double step;          /* s */
    double time;          /* s, at the step's start */
    double pull;          /* largest acceleration by gravity, attraction and hands, m/s2 */
    double *weight;       /* joints: 1 free, 0 held */
    double lift, lift_to; /* target above its place at the step's start and end, m */
    double rise_clock;    /* s the target has risen for; stands when it is held up */
    bool held_up;
    double retreat;          /* of a target that was held up, m/s */
    double good_step;        /* that should be stable and resolves what forces do, s */
    double moved;            /* longest motion of a joint in this step, before it is corrected, m */
    double changed;          /* largest motion by a correction in this sweep, m */
    double most_move;        /* m in a step */
    double work;             /* done on the blanket since the frame's start by what it does not store, J */
    double *x, *v;           /* 3*joints */
    double *a;               /* acceleration at x by springs and gravity */
    double *before;          /* x at the step's start */
    double *keep_x, *keep_v; /* for a second try with a smaller step */
    double *rest_x;          /* where the ball of rest has its middle */
    double (*bound)[2];      /* links: the limits that hold: the structure's, or the prescribed lengths */
    double (*limit)[2];      /* links: what the projection aims at, a little inside */
    double (*push)[2];       /* links: accumulated corrections of this step at the two limits */
    /* Spans are joints, links, skin triangles and posts. Each one's path is the sum over the steps of how far
     * the fastest of its corners moved, its move how far in this step, m; lift_path the same of the target.
     */
    double *path, *move, lift_path;
    int (*angle_far)[2]; /* where both arms end, apart from the corner */
    double *come;        /* joints: path and move of this step */
    /* Path lengths, of links by the sum of their ends', of angles by that of all ends of both arms, before
     * which a link or an angle cannot reach a limit; of places by their span's and the target's, before which
     * they cannot touch; of spans, the least of their places'. */
    double *link_wake, *angle_wake, *touch_wake, *span_wake;
    int *first_touch;            /* spans but posts, and one more */
    int *near_link, *near_angle; /* those that can reach a limit in this step, ascending */
    int near_links, near_angles;
    /* Of the angles listed: how far their four ends may move in all before a sweep must look at them, m. By
     * joint: where it was when they were listed, and how far it is from there as a complete sweep starts. */
    double *calm, *listed_x, *strayed;
    /* Of them and of the contacts those that the last complete sweep found at work or nearly so. */
    int *hot_link, *hot_angle, *hot_contact;
    int hot_links, hot_angles, hot_contacts;
    bool hot_backward; /* listed in a backward sweep */
    double added;   /* what sweeps may add to the motion of a step or a frame, m: what is nearer is listed */
    double stirred; /* largest motion by a correction in the last sweep, m */
    morph_turn *turn; /* angles */
    morph_damper *damper;
    int dampers;
    morph_angle *angle;
    morph_blanket_fix *fix; /* equalities solved together */
    morph_blanket_self *self;
    morph_blanket_soft *soft; /* the deformable target; NULL: none */
    morph_status status;      /* why a step failed, where not for its size */
    double *spare_x;          /* 3*joints */
    morph_guard guard;
    bool entered;     /* the last frame had to be brought out of the target by exact distances */
    morph_memo *memo; /* links, then skin triangles */
    morph_touch *touch;
    morph_contact *contact; /* capacity: touches + joints */
    morph_hold *hold;       /* touches + joints */
    int *held, holds;       /* sources whose hold is not 0 */
    /* Polishing a frame works on these copies' originals and puts them back. */
    double (*spare_push)[2];
    double (*spare_angle)[2]; /* pushes */
    morph_touch *spare_touch;
    double *spare_wake; /* touch_wake, span_wake */
} morph_blanket_state;

/* sdf may be NULL (no target). Validates def; x0 is copied. */
morph_status morph_blanket_state_create(const morph_structure *s, const morph_sdf *sdf,
                                        const morph_blanket_def *def, const double *x0,
                                        morph_blanket_state **out);
void morph_blanket_state_destroy(morph_blanket_state *b); /* NULL allowed */
bool morph_blanket_finite(const morph_blanket_state *b);  /* x and v */

/* blanket_force.c. None of these allocates. */
double morph_blanket_softening(const morph_structure *s, const morph_blanket_def *def); /* m */
/* Largest acceleration of a joint by gravity, attraction and hands, m/s2. */
double morph_blanket_pull(const morph_structure *s, const morph_blanket_def *def);
/* Largest step to use, s; infinite where nothing is elastic. */
double morph_blanket_stable_step(const morph_structure *s, const morph_blanket_def *def);
void morph_blanket_accelerations(morph_blanket_state *b); /* a from x and time */
/* Kinetic, springs, gravity, attraction, J. */
double morph_blanket_energy(const morph_blanket_state *b);
void morph_blanket_energies(const morph_blanket_state *b, double *kinetic, double *spring); /* J */
/* One step of b->step. False when the state is not finite any more or moves further than most_move. */
bool morph_blanket_step(morph_blanket_state *b);

/* exp(-2 beta) to second order, without ringing when beta is large. */
double morph_blanket_decay(double beta);

/* blanket_damp.c */
morph_status morph_blanket_dampers_create(morph_blanket_state *b); /* after the limits */
/* Velocities after a time h, s. */
void morph_blanket_damp(morph_blanket_state *b, double h, bool backward);

/* blanket_angle.c: the springs at the angle limits (structure.def.angle_stiffness). */
void morph_blanket_add_angles(morph_blanket_state *b);           /* to a */
double morph_blanket_angle_energy(const morph_blanket_state *b); /* J */
/* Bound on the stiffness matrix's eigenvalues while angles and lengths are within limits, N/m. */
double morph_blanket_angle_stiffness(const morph_structure *s);

/* blanket_schedule.c: where the target and the prescribed lengths are at the end of the coming step. */
void morph_blanket_schedule(morph_blanket_state *b);
/* Lift of the target after it has risen for `clock` seconds, m. */
double morph_blanket_lift(const morph_blanket_def *def, double clock);

/* blanket_path.c */
morph_status morph_blanket_paths_create(morph_blanket_state *b);
/* How far every span moved from `before` to x, and from that what sweeps may add; returns the longest, m. */
double morph_blanket_note_moves(morph_blanket_state *b, const double *x);
/* Adds the step from `before` to b->x to the paths. */
void morph_blanket_add_paths(morph_blanket_state *b);

/* blanket_project.c */
morph_status morph_blanket_limits_create(morph_blanket_state *b);
/* Lists the lengths and angles that can reach a limit while sweeps take back a step's moves (as last noted)
 * and add what they may. What is far is not looked at again before its joints have moved enough; `all`: look
 * at every one, whatever was noted, as if nothing had moved, and note nothing. */
void morph_blanket_list_limits(morph_blanket_state *b, const double *x, bool all);
/* Applies `warm` times the corrections of the last step to x (0: forgets them): at rest every step needs the
 * same ones, so that a few sweeps a step converge over many steps. */
void morph_blanket_project_start(morph_blanket_state *b, double *x, double warm);
/* Largest correction that a step starts from, m. */
double morph_blanket_most_carried(const morph_blanket_state *b);
/* Sweep number `sweep` over angles, lengths, contacts and posts of x, odd ones in reversed order. The first
 * and every sixth after it are complete, and those after a sweep that moved more than what counts as nearly;
 * the others look only at what the last complete one found at work or nearly so: four of five listed rows
 * never are. */
void morph_blanket_sweep(morph_blanket_state *b, double *x, int sweep, double friction);
/* Sweeps over lengths and posts alone until all lengths are within their bounds: they aim inside, so that a
 * few are enough where few lengths are beyond. Forgets the links' corrections. False where some still are,
 * and at once where panels or prescribed lengths hang all together. */
bool morph_blanket_sweep_lengths(morph_blanket_state *b, double *x);
/* The cosine with its gradient by the angle's joints, those held 0; false where it has none. */
bool morph_blanket_cosine_gradient(const morph_blanket_state *b, int angle, const double *x, double *c,
                                   double grad[4][3]);
double morph_blanket_cosine(const morph_blanket_state *b, int angle, const double *x);
/* Posts by corrections along their direction in `before`, as the leapfrog's symmetry asks. */
void morph_blanket_project_posts_along(morph_blanket_state *b);
/* blanket_panel.c */
/* The panel's volume over the size of its gradient, a length, and the gradient of norm 1 by bottom and top of
 * either post. False where it has no direction. */
bool morph_blanket_panel_row(const morph_structure *s, int panel, const double *x, double *residual,
                             double grad[4][3]);
double morph_blanket_panel_sine(const morph_structure *s, int panel, const double *x);
void morph_blanket_project_panel(const morph_blanket_state *b, int panel, double *x); /* into its plane */

/* blanket_polish.c: what the unpolished state breaks. */
morph_violation morph_blanket_violation(const morph_blanket_state *b, const double *x);
/* blanket_polish.c: sweeps until x holds the structure's own limits or stops improving; contact by the exact
 * distance where there is one. Velocities are not touched. Returns what is left. */
morph_violation morph_blanket_polish(morph_blanket_state *b, double *x);

/* blanket_fix.c: moves x by the least that makes posts rigid, panels plane, prescribed lengths right and
 * lengths beyond a limit lie inside; what cannot be met is left. */
morph_status morph_blanket_fix_create(const morph_structure *s, morph_blanket_fix **out);
void morph_blanket_fix_destroy(morph_blanket_fix *f); /* NULL allowed */
void morph_blanket_fix_apply(morph_blanket_state *b, double *x);

/* blanket_self.c */
morph_status morph_blanket_self_create(const morph_structure *s, morph_blanket_self **out);
void morph_blanket_self_destroy(morph_blanket_self *self); /* NULL allowed */
void morph_blanket_self_forget(morph_blanket_self *self);
/* Lists the pairs of links and posts that can meet in a step with the moves last noted. */
morph_status morph_blanket_find_self(morph_blanket_state *b);
/* Returns the longest motion that a correction gives a joint, m. */
double morph_blanket_project_self(morph_blanket_state *b, double *x, bool backward);
int morph_blanket_self_count(const morph_blanket_state *b); /* contacts listed in the last step */

/* blanket_contact.c */
morph_status morph_blanket_touches_create(morph_blanket_state *b);
/* After x was set from outside: forgets what is far, and the last step's corrections. */
void morph_blanket_forget(morph_blanket_state *b);
/* Whether a place is known to be too far to touch. */
bool morph_blanket_sleeps(const morph_blanket_state *b, int touch);
/* Longest motion of a joint from `before` to x, m. */
double morph_blanket_moved(const morph_blanket_state *b, const double *x);
/* Lists the contacts near x; `before` in the state is where friction counts from. */
void morph_blanket_find_contacts(morph_blanket_state *b, const double *x);
/* Planes of the listed contacts anew at x, corrections kept. */
void morph_blanket_renew_contacts(morph_blanket_state *b, const double *x);
/* Deepest violation of a place's radius or the base plane at x, m, >= 0. */
double morph_blanket_depth(const morph_blanket_state *b, const double *x);
double morph_blanket_base_depth(const morph_blanket_state *b, const double *x); /* the plane's part of it */
/* The smooth distance at q, the target's lift taken off; g may be NULL. */
double morph_blanket_distance_at(const morph_blanket_state *b, const double q[3], double *g);
/* The next contact of the list, with its place but no plane yet; not counted. */
morph_contact *morph_blanket_add_contact(morph_blanket_state *b, const int *joint, int corners,
                                         const double *weight, int source);
void morph_blanket_find_base(morph_blanket_state *b, const double *x, double move);
static inline void morph_blanket_place(const double *x, const int *joint, int corners, const double *weight,
                                       double q[3]) {
    const double *a = &x[3 * joint[0]], wa = weight[0];
    for (int k = 0; k < 3; k++)
        q[k] = wa * a[k];
    for (int j = 1; j < corners; j++) {
        const double *c = &x[3 * joint[j]], wc = weight[j];
        for (int k = 0; k < 3; k++)
            q[k] += wc * c[k];
    }
}

/* blanket_exact.c */
/* Neighbours of the vertices of a convex mesh, which is borrowed; *out is NULL where edges do not fit
 * together.
 */
morph_status morph_blanket_hull_create(const morph_mesh *mesh, morph_blanket_hull **out);
void morph_blanket_hull_destroy(morph_blanket_hull *h); /* NULL allowed */
/* Deepest violation by exact distances over whole links and triangles. An element that has moved less than
 * its last distance left over and half of what counts as held is not measured again: its bound counts. */
double morph_blanket_depth_exact(morph_blanket_state *b, const double *x);
/* At least how far an element is from the target beyond its radius, by its last exact distance: corners as
 * the target sees them. Negative infinity where nothing is known. */
double morph_blanket_gap_bound(const morph_blanket_state *b, int element, const double v[3][3]);
/* Whether an element's axis or middle is further than `reach` from the target at `before`, by its last exact
 * distance and how far it has come since: cheaper than the bound above, and seldom as good. */
bool morph_blanket_is_far(const morph_blanket_state *b, int element, double reach);
/* Planes anew between a convex target and what those known no longer keep from it at x: for the guard. */
void morph_blanket_renew_planes(morph_blanket_state *b);
/* Puts the seeking places where exact distances have found elements deepest: a thin part of the target
 * between the fixed places is then felt by the steps that follow. */
void morph_blanket_seek_deepest(morph_blanket_state *b);
/* Lists the contacts near x by exact distances. */
void morph_blanket_find_exact(morph_blanket_state *b, const double *x);

/* blanket_contact.c again */
/* Part of project_start; most: largest push to start with, m. */
void morph_blanket_start_contacts(morph_blanket_state *b, double *x, double warm, double most);
void morph_blanket_keep_contacts(morph_blanket_state *b); /* for the next step's start */
/* Returns the longest motion that the correction gives a joint, m; *gap (may be NULL): to the half space
 * before it, m. */
double morph_blanket_project_contact(morph_contact *c, double *x, double friction, double *gap);

/* blanket_swept.c: false if axes of links or the skin passed through the target in the step from `before` to
 * x: it is to be done again shorter, and those elements are watched from then on. Costs a look at how far
 * joints moved, unless that is further than a radius. */
bool morph_blanket_guard(morph_blanket_state *b);
/* After find_contacts: adds contacts by exact distances at `before` for the elements watched. */
void morph_blanket_guard_contacts(morph_blanket_state *b);

/* blanket_body.c: the deformable target. All but create and destroy need b->soft. */
morph_status morph_blanket_soft_create(morph_blanket_state *b); /* does nothing without def.body */
void morph_blanket_soft_destroy(morph_blanket_soft *soft);      /* NULL allowed; the body stays */
/* Before a step: what held in the last goes on pushing, joints at once, the body through its step. most: kg
 * m.
 */
void morph_blanket_soft_push(morph_blanket_state *b, double most);
/* Moves the body on by a step, its foot with the target's lift. False where it cannot be kept finite. */
bool morph_blanket_soft_step(morph_blanket_state *b);
/* After the sweeps: what contact moved becomes the body's velocity. */
void morph_blanket_soft_moved(morph_blanket_state *b);
/* Parts of the functions for rigid contact of the same names. near: how far contacts are listed, m. */
void morph_blanket_soft_find(morph_blanket_state *b, const double *x, double near);
void morph_blanket_soft_start(morph_blanket_state *b);
void morph_blanket_soft_renew(morph_blanket_state *b);
void morph_blanket_soft_sweep(morph_blanket_state *b, double *x, bool backward, double friction);
void morph_blanket_soft_keep(morph_blanket_state *b);
void morph_blanket_soft_forget(morph_blanket_state *b);
/* From hold to release a frame is polished: the body stands as a rigid solid, b->exact is the exact distance
 * to its surface, and the contacts of the motion rest. */
void morph_blanket_soft_hold(morph_blanket_state *b);
void morph_blanket_soft_release(morph_blanket_state *b);
/* The body as a frame starts, to come back to. */
void morph_blanket_soft_keep_frame(morph_blanket_state *b);
void morph_blanket_soft_rewind_frame(morph_blanket_state *b);
void morph_blanket_soft_stop(morph_blanket_state *b); /* takes its speed away */
/* Longest motion of a vertex since the frame's start, m. */
double morph_blanket_soft_frame_move(const morph_blanket_state *b);
void morph_blanket_soft_rest_here(morph_blanket_state *b);
/* Longest way of a vertex from where it was when that was last called, m. */
double morph_blanket_soft_from_rest(const morph_blanket_state *b);
/* Added to what is there, J; any may be NULL. */
void morph_blanket_soft_energies(const morph_blanket_state *b, double *kinetic, double *spring,
                                 double *height);
int morph_blanket_soft_contacts(const morph_blanket_state *b); /* listed in the last step */
/* Force of the body on the blanket in the last step, N. */
void morph_blanket_soft_force(const morph_blanket_state *b, double force[3]);
/* What failed in a step or a frame that cannot say so itself; MORPH_OK otherwise. */
morph_status morph_blanket_soft_status(const morph_blanket_state *b);

#endif
