/* Contact between a deformable body and a sheet (the blanket: joints, and skin triangles on them), both ways.
 *
 * After Teschner et al. 2003: places of the sheet (joints, points of links and of the skin) are looked up
 * among the body's tetrahedra; one that is inside goes out by the shortest way to the surface, one outside
 * keeps its radius from it. And the other way round, the body's surface vertices keep away from the skin's
 * triangles, so that thin features of the body do not poke through. Pairs come from spatial hashes that are
 * built anew each step.
 *
 * A contact is an inequality between a place q = sum w_j x_j of the sheet and a place s = sum u_i y_i of the
 * body: normal . (q - s) >= level. It is corrected by dx_j = +w_j p / m_j, dy_i = -u_i p / m_i with the same
 * p on both sides, and both places are the same point in space up to the gap: linear momentum is kept
 * exactly, angular momentum but for the gap's tangential part under friction. */
#ifndef MORPH_BODY_CONTACT_H
#define MORPH_BODY_CONTACT_H

#include "model/body.h"

/* A place of the sheet that may touch. */
typedef struct morph_body_place {
    int joint[3], corners;
    double weight[3]; /* add up to 1 */
    double radius;    /* m */
} morph_body_place;

typedef struct morph_body_touch {
    int joint[3], vertex[3];          /* numbers of unused corners are 0, their weights too */
    double weight[3], body_weight[3]; /* barycentric */
    double normal[3], level;          /* from the body to the sheet; m */
    double before[3];                 /* q - s at the step's start: friction acts on the motion since */
    double inverse;                   /* 1 / (sum w^2 / m + sum u^2 / m), kg */
    double push;                      /* accumulated along the normal, kg m, >= 0 */
    double drag[3];                   /* accumulated friction, at most friction * push */
    int source;                       /* place, or places + number in mesh.surface; for warm starts */
} morph_body_touch;

typedef struct morph_body_contacts morph_body_contacts;

/* The sheet. Arrays are copied. */
typedef struct morph_body_sheet {
    int joints, places, triangles;
    const double *inverse; /* joints: 1/kg, 0 where held */
    const morph_body_place *place;
    const int (*triangle)[3]; /* the skin, normals away from the body */
    double radius;            /* the skin's half-thickness, m */
    double margin;            /* contacts aim this much further out, m */
} morph_body_sheet;

/* The body stays the caller's and must outlive the contacts. MORPH_ERR_INPUT for numbers out of range,
 * negative or non-finite radii, margins or inverse masses. */
morph_status morph_body_contacts_create(const morph_body *body, const morph_body_sheet *sheet,
                                        morph_body_contacts **out);
void morph_body_contacts_destroy(morph_body_contacts *contacts); /* NULL allowed */

/* Lists what is within `near` (m) of touching with the sheet's joints at x and the body at body->x, 3 per
 * joint; before: the joints at the step's start (the body's: body->start). Ordered by source. Memory grows to
 * what the densest step asked for and is kept. MORPH_ERR_NONFINITE if x or the body is not finite. */
morph_status morph_body_contacts_find(morph_body_contacts *contacts, const double *x, const double *before,
                                      double near);
int morph_body_contacts_count(const morph_body_contacts *contacts);
morph_body_touch *morph_body_contacts_list(morph_body_contacts *contacts); /* until the next find */

/* Starts contact k, just found, with the corrections push (kg m, >= 0) and drag (cut to the cone) that it had
 * in the step before. */
void morph_body_contact_start(morph_body_contacts *contacts, int k, double push, const double drag[3],
                              double *x, morph_body *body, double friction);
/* Corrects x (joints) and body->x by contact k: unilateral along the normal, Coulomb friction across it.
 * friction: the coefficient. */
void morph_body_contact_project(morph_body_contacts *contacts, int k, double *x, morph_body *body,
                                double friction);
/* Force of the body on the sheet by the corrections of a step of h, N. */
void morph_body_contacts_force(const morph_body_contacts *contacts, double h, double force[3]);
/* Deepest place or vertex of the last find beyond its radius, before corrections, m, >= 0. */
double morph_body_contacts_depth(const morph_body_contacts *contacts);
size_t morph_body_contacts_bytes(const morph_body_contacts *contacts);

#endif
