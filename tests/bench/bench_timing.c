/* The timing stage on recorded paths: bench_timing FOLDER ... reads scene.yaml and plan.h5 of each plan
 * folder, rebuilds the path and times it. */
#include "planner/folder.h"
#include "planner/plan.h"
#include "planner/timing_exact.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void say(void *user, const char *line) {
    (void)user;
    printf("    %s\n", line);
}

/* The curve through the recorded poses: joints are centre -+ half a post along its direction. */
static morph_curve *curve_of(const morph_record *r, const morph_structure *s) {
    const size_t width = 3 * (size_t)s->joints;
    double *joints = morph_alloc((size_t)r->poses * width, sizeof(double));
    morph_curve *curve = NULL;
    for (int k = 0; k < r->poses && joints; k++)
        for (int p = 0; p < s->posts; p++) {
            const double *y = &r->path_poses[((size_t)k * (size_t)s->posts + (size_t)p) * 6];
            for (int c = 0; c < 3; c++) {
                const double half = 0.5 * s->post_length[p] * y[3 + c];
                joints[(size_t)k * width + 3 * (size_t)s->post[p][0] + (size_t)c] = y[c] - half;
                joints[(size_t)k * width + 3 * (size_t)s->post[p][1] + (size_t)c] = y[c] + half;
            }
        }
    if (joints && morph_curve_create(s, r->path_s, joints, r->poses, &curve) != MORPH_OK) curve = NULL;
    free(joints);
    return curve;
}

/* Seconds of one evaluation of all lengths up to an order. */
static double evaluation(const morph_curve *curve, int order) {
    const morph_structure *s = curve->structure;
    double *scratch = morph_alloc(MORPH_JET * 6 * (size_t)s->posts, sizeof(double));
    double *joints = morph_alloc(MORPH_JET * 3 * (size_t)s->joints, sizeof(double));
    double *lengths = morph_alloc(MORPH_JET * (size_t)s->links, sizeof(double));
    double least = INFINITY;
    for (int batch = 0; batch < 10 && scratch && joints && lengths; batch++) {
        const double begin = morph_seconds();
        for (int k = 0; k < 100; k++) {
            morph_curve_joints(curve, k / 99.0, order, scratch, joints);
            morph_curve_lengths(s, joints, order, lengths);
        }
        least = fmin(least, (morph_seconds() - begin) / 100);
    }
    free(scratch);
    free(joints);
    free(lengths);
    return least;
}

/* The fine grid, screened and complete: the same ratios at different cost. */
static void fine_grid(const morph_curve *curve, const morph_timing *timing, double sample) {
    morph_path_table table;
    if (morph_path_table_create(curve, &table) != MORPH_OK) return;
    const int steps = MORPH_TIMING_FINE * (int)lround(timing->duration / sample);
    double screened[3] = {0}, complete[3];
    const double begin = morph_seconds();
    const morph_status status = morph_timing_fine(&table, timing, steps, screened);
    const double middle = morph_seconds();
    morph_timing_even(&table, timing, steps, complete);
    printf("  %d fine points: screened %.3f s, complete %.3f s, ratios %.9f and %.9f%s\n", steps + 1,
           middle - begin, morph_seconds() - middle, morph_timing_stretch(screened),
           morph_timing_stretch(complete), status == MORPH_OK ? "" : " (failed)");
    morph_path_table_free(&table);
}

static int run(const char *folder) {
    char file[4096], message[512] = "";
    snprintf(file, sizeof file, "%s/scene.yaml", folder);
    morph_scene *scene = NULL;
    morph_record record = {0};
    morph_structure *s = NULL;
    morph_curve *curve = NULL;
    if (morph_scene_read(file, NULL, NULL, NULL, &scene) == MORPH_OK &&
        morph_folder_read(folder, &record, message, sizeof message) == MORPH_OK &&
        morph_structure_create(&scene->structure, &s) == MORPH_OK)
        curve = curve_of(&record, s);
    if (curve) {
        const morph_control control = {.log = say};
        const morph_timing_options o = {0.0, scene->sample, &control};
        morph_timing timing;
        morph_timing_report r;
        printf("%s: %d links, %d poses, %.1f us an evaluation of order 3, %.1f of order 5\n", folder,
               s->links, record.poses, 1e6 * evaluation(curve, 3), 1e6 * evaluation(curve, 5));
        if (morph_timing_solve(curve, &o, &timing, &r) == MORPH_OK) {
            printf(
                "  %.4f s (smooth profile %.4f s, recorded %.4f s), %d iterations, %d unknowns, %d rows, "
                "final stretch %.6f, ratios %.4f %.4f %.4f, took %.3f s\n",
                timing.duration, r.smooth_duration, record.time[record.samples - 1], r.iterations, r.unknowns,
                r.rows_used, r.stretch, r.worst_rate, r.worst_acceleration, r.worst_jerk, r.seconds);
            fine_grid(curve, &timing, scene->sample);
            morph_timing_free(&timing);
        }
    } else {
        printf("%s: not a plan folder %s\n", folder, message);
    }
    const int failed = !curve;
    morph_curve_destroy(curve);
    morph_structure_destroy(s);
    morph_record_free(&record);
    morph_scene_destroy(scene);
    return failed;
}

int main(int count, char **folders) {
    morph_blas_threads(1);
    int failed = 0;
    if (count < 2) printf("bench_timing FOLDER ...: plan folders\n");
    for (int k = 1; k < count; k++)
        failed |= run(folders[k]);
    return failed;
}
