#include "planner/timing_bound.h"

#include "planner/timing_rows.h"

#include <stdlib.h>
#include <string.h>

/* With V, A, J the limits: a symmetric profile speeds up to a peak p <= V and slows down again alike.
 * Speeding up takes r(p) = p/A + A/J where the acceleration gets to its limit (p >= A^2/J), else 2 sqrt(p/J),
 * and covers p r(p)/2. Three cases: V is reached, V r(V) <= d: two ramps and what is left of d at V, T = r(V)
 * + d/V; only A is reached, p r(p) = d, a quadratic in p:                         T = A/J + sqrt((A/J)^2 + 4
 * d/A); neither, 2 p sqrt(p/J) = d up to p = A^2/J (d = 2 A^3/J^2):              T = 4 cbrt(d/(2J)). */
double morph_timing_alone(double distance, double rate, double acceleration, double jerk) {
    const double d = fabs(distance), V = rate, A = acceleration, J = jerk;
    const double ramp = V >= A * A / J ? V / A + A / J : 2.0 * sqrt(V / J);
    if (!(d > 0.0)) return 0.0;
    if (V * ramp <= d) return ramp + d / V;
    if (d <= 2.0 * A * A * A / (J * J)) return 4.0 * cbrt(d / (2.0 * J));
    return A / J + sqrt(A / J * (A / J) + 4.0 * d / A);
}

morph_status morph_timing_single_link(const morph_curve *curve, double *seconds, int *link) {
    const morph_structure *s = curve->structure;
    *seconds = 0.0;
    *link = -1;
    double *from = morph_alloc((size_t)s->links, sizeof *from);
    if (!from) return MORPH_ERR_NOMEM;
    morph_path_table table;
    const morph_status status = morph_path_table_create(curve, &table);
    if (status == MORPH_OK) {
        morph_path_table_exact(&table, 0.0, 0);
        memcpy(from, table.exact, (size_t)s->links * sizeof *from);
        morph_path_table_exact(&table, 1.0, 0);
        for (int l = 0; l < s->links; l++) {
            const double alone = morph_timing_alone(table.exact[l] - from[l], s->rate_limit[l],
                                                    s->acceleration_limit[l], s->jerk_limit[l]);
            if (alone <= *seconds) continue;
            *seconds = alone;
            *link = l;
        }
        morph_path_table_free(&table);
    }
    free(from);
    return status;
}
