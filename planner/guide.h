/* Centres of attraction that guide the blanket: where they start, and the blanket run under them. */
#ifndef MORPH_GUIDE_H
#define MORPH_GUIDE_H

#include "planner/plan.h"

/* Strength of a seed in units of a joint's weight times the spacing squared: at a spacing's distance a pull
 * of some weights, which draws a sheet of the default springs into a cavity and is held within its limits. */
#define MORPH_SEED_STRENGTH 5.0

/* Seeds beneath the largest cavities at x (3*joints, m): at most `most` of them, the largest first; regions
 * that hold less than a tenth of the gap's volume get none. unit: newtons, see balance.h. */
morph_status morph_seed_centres(const morph_workspace *w, const double *x, double unit, int most,
                                morph_attractor *centre, int *count);

/* The blanket of the scene under these centres instead of its own, from the pose `from` (3*joints, m; NULL:
 * from the start, with everything that the scene does to it; else at rest there, with nothing but gravity,
 * friction and the centres), until it rests or the scene's time is over. */
morph_status morph_guided_run(const morph_workspace *w, const morph_scene *scene, const double *from,
                              const morph_attractor *centre, int count, const morph_control *control,
                              morph_trajectory *out, morph_blanket_report *report);

/* Appends `more` to *out, whose last frame is more's first; more is unchanged. */
morph_status morph_trajectory_append(morph_trajectory *out, const morph_trajectory *more);

#endif
