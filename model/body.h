/* A deformable target: a tetrahedral mesh as masses and springs; a penalty resists squeezed tetrahedra, and a
 * unilateral constraint on the volume of each keeps it from inverting. Kick-drift-kick leapfrog with a step
 * of its own. Deterministic; nothing allocates after create.
 *
 * Stiffness. Every edge of every tetrahedron carries k = E V / l^2 (van Gelder 1998), summed over the
 * tetrahedra at the edge. With strain e a spring along the unit vector n holds k l^2 (n.e n)^2 / 2, so a
 * tetrahedron's six hold E V / 2 times the sum of (n.e n)^2. Over directions evenly spread the mean of
 * (n.e n)^2 is (2 e:e + tr(e)^2) / 15: an energy density of E (0.4 e:e + 0.2 tr(e)^2), which is that of an
 * isotropic solid with both Lame constants 0.4 E: Young's modulus (5/2) 0.4 E = E, Poisson's ratio 1/4.
 * Central springs know no other ratio. They also give way sideways when pressed hard; so a tetrahedron whose
 * volume V is below V1 = MORPH_BODY_SQUEEZED V0 holds E (V - V1)^2 / (2 V0) more, a bulk modulus of E there.
 * (A bar pressed by 20 % keeps 0.9 of its volume: up to there E is what springs make it.) Real meshes come
 * within some per cent of E (see the test). */
#ifndef MORPH_BODY_H
#define MORPH_BODY_H

#include "model/tetra.h"

#define MORPH_BODY_SQUEEZED 0.9

typedef struct morph_body_def {
    double young;   /* Pa */
    double density; /* kg/m3 */
    double damping; /* damping ratio of the slowest stretching mode; stiffness-proportional: higher modes have
                       more */
    double drag;    /* 1/s: force = -drag * mass * velocity */
    double gravity; /* m/s2, downward */
    double friction; /* Coulomb coefficient at the base plane */
    double base;     /* height of the base plane, NaN for none */
    double pin; /* m; vertices that start no higher than this above the base plane are held; negative: none */
} morph_body_def;

/* young 2e4, density 300, damping 0.1, gravity 9.81, friction 0.5, no base, pin 0. */
morph_body_def morph_body_defaults(void);

typedef struct morph_body_counts {
    long steps;       /* substeps taken */
    long projections; /* corrections of a tetrahedron's volume */
    long redone;      /* steps done again with shorter substeps because energy grew without cause */
    long held;        /* halved moves of tetrahedra that projection alone did not keep from inverting */
} morph_body_counts;

/* Fields may be read; x and v may be set from outside where morph_body_moved is called after. */
typedef struct morph_body {
    morph_body_def def;
    morph_tetra mesh; /* a copy; mesh.v is the shape at rest */
    int vertices, springs;
    double *x, *v;              /* 3 * vertices, m and m/s */
    double *mass, *inverse;     /* vertices, kg and 1/kg; inverse is 0 where pinned */
    double *volume;             /* tets: at rest, m3 */
    int (*spring)[2];           /* springs: vertices */
    double *length, *stiffness; /* springs: at rest, m; N/m */
    double *start;              /* x at the start of the last morph_body_step or move */
    double retardation;         /* s: damper of a spring = retardation * stiffness */
    double stable;              /* s */
    morph_body_counts counts;
    double *a, *before, *keep; /* scratch: 3, 3 and 6 times vertices */
    double *predicted;         /* 3 * vertices: x after the last step, before contact moved it */
} morph_body;

/* mesh is copied. MORPH_ERR_INPUT for an empty mesh, or a def with a negative or non-finite number, young or
 * density not positive; MORPH_ERR_NONFINITE where masses or stiffnesses are beyond double. */
morph_status morph_body_create(const morph_tetra *mesh, const morph_body_def *def, morph_body **out);
void morph_body_destroy(morph_body *body); /* NULL allowed */

/* Holds a vertex where it is. */
void morph_body_pin(morph_body *body, int vertex);

/* Largest substep, s: half the leapfrog's bound 2 / omega, omega by Gershgorin's theorem from masses and
 * stiffnesses as they are. */
double morph_body_stable_step(const morph_body *body);

/* Moves on by h (s) in as many equal substeps as the stable step asks. external: 3 * vertices, N, held
 * constant; NULL for none. False (state as before) when the motion cannot be kept finite. Every tetrahedron
 * keeps a positive volume. */
bool morph_body_step(morph_body *body, double h, const double *external);

/* One pass that corrects volumes and the base plane at x, for the sweeps of a contact solver. */
void morph_body_sweep(morph_body *body);
/* After x was changed from outside (by contact) since morph_body_step: keeps tetrahedra from inverting and
 * turns what was moved into velocity, v += (x - x after the step) / h. */
void morph_body_moved(morph_body *body, double h);

/* Kinetic energy, energy of springs and squeezed volumes, and weight times height, J. Any may be NULL. */
void morph_body_energies(const morph_body *body, double *kinetic, double *spring, double *height);
/* Least volume of a tetrahedron relative to its volume at rest. */
double morph_body_least_volume(const morph_body *body);
bool morph_body_finite(const morph_body *body);

#endif
