/* Inside the examination of a pose: what pose.c and pose_contact.c share. Not for others. */
#ifndef MORPH_POSE_PARTS_H
#define MORPH_POSE_PARTS_H

#include "planner/pose.h"

/* What one examination carries along. */
typedef struct morph_examiner {
    const morph_world *world;
    const double *x;
    double *metres; /* x in metres as seen from the target where it stands: for the exact distances */
    const morph_inset *inset;
    const morph_nearness *near;
    morph_active *active;
    morph_violation *violation;
    int added;
    morph_status status;
} morph_examiner;

/* Notes an element beyond its limit by `amount` (negative: inside), named by `name` if it is the worst. */
void morph_examine_note(morph_examiner *e, morph_limit limit, double amount,
                        void (*name)(const morph_structure *, int, char *, size_t), int element);

/* Whether all of n joints are held: what hangs on them alone cannot be moved and gets no row. */
bool morph_all_fixed(const morph_structure *s, const int *joint, int n);

/* Skin and links against the target, joints against the base plane. */
void morph_examine_clearance(morph_examiner *e);
/* Links and posts against each other. */
void morph_examine_self(morph_examiner *e);

#endif
