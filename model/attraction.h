/* Centres of attraction: F(x) = s (a - x) / (|a - x|^2 + e^2)^(3/2), softened by e, the gradient of
 * -U(x) with U = -s / sqrt(|a - x|^2 + e^2). */
#ifndef MORPH_ATTRACTION_H
#define MORPH_ATTRACTION_H

/* Pulls every joint. */
typedef struct morph_attractor {
    double at[3];    /* m */
    double strength; /* N m2; negative pushes away */
} morph_attractor;

/* U at x in J (0 far away). force: adds F, N; stiffness: adds the symmetric d2U/dx2, N/m; either may be
 * NULL. softening > 0, m. */
double morph_attraction(const morph_attractor *centre, double softening, const double x[3], double force[3],
                        double stiffness[3][3]);

#endif
