#include "model/attraction.h"

#include <math.h>
#include <stddef.h>

/* With r = a - x and p^2 = r.r + e^2: U = -s/p, F = s r/p^3, d2U/dx2 = s (I/p^3 - 3 r r'/p^5). */
double morph_attraction(const morph_attractor *centre, double softening, const double x[3], double force[3],
                        double stiffness[3][3]) {
    double r[3], square = softening * softening;
    for (int k = 0; k < 3; k++) {
        r[k] = centre->at[k] - x[k];
        square += r[k] * r[k];
    }
    const double p = sqrt(square), pull = centre->strength / (square * p);
    for (int k = 0; k < 3; k++) {
        if (force) force[k] += pull * r[k];
        for (int m = 0; stiffness && m < 3; m++)
            stiffness[k][m] += pull * ((k == m ? 1.0 : 0.0) - 3.0 * r[k] * r[m] / square);
    }
    return -centre->strength / p;
}
