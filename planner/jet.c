#include "planner/jet.h"

#include <math.h>

const double morph_factorial[MORPH_JET] = {1.0, 1.0, 2.0, 6.0, 24.0, 120.0};

void morph_jet_dot(const double (*u)[MORPH_JET], const double (*v)[MORPH_JET], int order, double *out) {
    for (int k = 0; k <= order; k++) {
        out[k] = 0.0;
        for (int c = 0; c < 3; c++)
            for (int i = 0; i <= k; i++)
                out[k] += u[c][i] * v[c][k - i];
    }
}

/* r r = a, solved coefficient by coefficient. */
void morph_jet_sqrt(const double *a, int order, double *r) {
    r[0] = sqrt(a[0]);
    for (int k = 1; k <= order; k++) {
        double sum = a[k];
        for (int i = 1; i < k; i++)
            sum -= r[i] * r[k - i];
        r[k] = sum / (2.0 * r[0]);
    }
}

/* q b = a. */
void morph_jet_divide(const double *a, const double *b, int order, double *q) {
    for (int k = 0; k <= order; k++) {
        double sum = a[k];
        for (int i = 0; i < k; i++)
            sum -= q[i] * b[k - i];
        q[k] = sum / b[0];
    }
}
