/* Smoothness of two plans of one scene at equal duration: bench_smooth PLAN BLANKET [PLAN BLANKET ...] reads
 * pairs of plan folders (the second made with --method blanket: the same spline and the same timing).
 *
 * Of a schedule of T seconds, the integral of sum_l L_l'''^2 over time goes with T^-5 when it is run slower
 * or faster, so
 *     I = T^5 * integral of sum over links of (jerk)^2 dt      [m^2]
 * belongs to the shape of the curve alone, and the ratio of two I is that of the jerk integrals at equal
 * duration. Divided by the sum of squared total changes it is a pure number,
 *     I / sum_l (L_l(T) - L_l(0))^2,
 * which also takes out that one of the two goes farther: 720 for the smoothest rest-to-rest motion of all
 * (the quintic polynomial of minimum jerk), more for each detour and each corner.
 */
#include "recorded.h"

#include "planner/timing_rows.h"

/* Steps of the trapezoidal rule: jerks are continuous, with a few hundred knots of path and timing. */
enum { STEPS = 20000 };

typedef struct smoothness {
    double duration, integral, change; /* s; m2 (times T^5); m2: sum of squared total changes */
} smoothness;

static bool measure(const recorded *r, smoothness *out) {
    const int links = r->structure->links;
    morph_path_table table;
    double *start = morph_alloc((size_t)links, sizeof *start);
    *out = (smoothness){.duration = r->timing.duration};
    if (!start || morph_path_table_create(r->curve, &table) != MORPH_OK) {
        free(start);
        return false;
    }
    const double T = r->timing.duration;
    for (int i = 0; i <= STEPS; i++) {
        double s[4], sum = 0.0;
        morph_timing_eval(&r->timing, T * i / STEPS, s);
        morph_path_table_exact(&table, s[0], 3);
        morph_timing_chain(links, table.exact, s, table.by_time);
        for (int l = 0; l < links; l++) {
            sum += table.by_time[3 * links + l] * table.by_time[3 * links + l];
            if (i == 0) start[l] = table.by_time[l];
            if (i == STEPS) out->change += (table.by_time[l] - start[l]) * (table.by_time[l] - start[l]);
        }
        out->integral += pow(T, 5) * sum * T / STEPS * (i == 0 || i == STEPS ? 0.5 : 1.0);
    }
    morph_path_table_free(&table);
    free(start);
    return true;
}

static bool folder(const char *path, smoothness *out) {
    recorded r;
    if (!recorded_read(path, &r)) return false;
    const bool ok = measure(&r, out);
    recorded_free(&r);
    return ok;
}

int main(int count, char **folders) {
    int failed = 0;
    if (count < 3 || count % 2 == 0) {
        printf("bench_smooth PLAN BLANKET ...: pairs of plan folders\n");
        return 2;
    }
    morph_blas_threads(1);
    printf("I = T^5 integral of sum of jerk^2 dt; of it without scale, I / sum of squared total changes\n");
    printf("%-28s %9s %9s %11s %11s %8s %10s %10s %8s\n", "plan", "T plan", "T blanket", "I plan, m2",
           "I bl., m2", "ratio", "free plan", "free bl.", "ratio");
    for (int k = 1; k + 1 < count; k += 2) {
        smoothness plan, blanket;
        if (!folder(folders[k], &plan) || !folder(folders[k + 1], &blanket)) {
            failed = 1;
            continue;
        }
        const double a = plan.integral / plan.change, b = blanket.integral / blanket.change;
        printf("%-28s %9.3f %9.3f %11.4g %11.4g %8.3g %10.4g %10.4g %8.3g\n", folders[k], plan.duration,
               blanket.duration, plan.integral, blanket.integral, plan.integral / blanket.integral, a, b,
               a / b);
    }
    return failed;
}
