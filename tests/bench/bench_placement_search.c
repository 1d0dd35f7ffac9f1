/* Algorithms for the search for centres, from one shape at rest: what each reaches, and what it takes.
 * bench_placement_search SCENE.yaml... [reach=0.3] [evaluations=60] [seconds=20] [centres=1] */
#include "planner/guide.h"
#include "planner/placement_search.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct start {
    morph_scene *scene;
    morph_workspace w;
    morph_balance *balance;
    morph_rest rest;
} start;

/* The blanket at rest under seeds beneath its largest cavities, adopted. */
static bool lay(const char *path, int centres, const morph_placement_options *o, start *s) {
    morph_trajectory pure, guided;
    morph_blanket_report report;
    morph_attractor seed[MORPH_MOST_CENTRES];
    int found;
    if (morph_scene_read(path, NULL, NULL, NULL, &s->scene) != MORPH_OK ||
        morph_workspace_create(s->scene, NULL, &s->w) != MORPH_OK)
        return false;
    const morph_structure *body = s->w.structure;
    const size_t n = 3 * (size_t)body->joints;
    const double unit = body->def.mass * s->scene->motion.gravity;
    const morph_blanket_def def = morph_scene_blanket(s->scene, body);
    const morph_balance_load load = {s->scene->motion.gravity, 0.0};
    if (morph_blanket_run(body, s->w.sdf, s->w.exact, &def, s->w.start, NULL, &pure, &report) != MORPH_OK ||
        morph_seed_centres(&s->w, &pure.x[(size_t)(pure.frames - 1) * n], unit, centres, seed, &found) !=
            MORPH_OK ||
        morph_guided_run(&s->w, s->scene, NULL, seed, found, NULL, &guided, NULL) != MORPH_OK ||
        morph_balance_create(&s->w.world, &load, found, &s->balance) != MORPH_OK)
        return false;
    double *x = &guided.x[(size_t)(guided.frames - 1) * n];
    for (size_t i = 0; i < n; i++)
        x[i] /= body->spacing;
    for (int m = 0; m < found; m++)
        seed[m] = morph_balance_scaled(s->balance, &seed[m]);
    s->balance->hold = o->hold;
    const bool ok =
        found > 0 && morph_rest_adopt(s->balance, seed, o->epsilon, x, NULL, &s->rest) == MORPH_OK;
    morph_trajectory_free(&pure);
    morph_trajectory_free(&guided);
    return ok;
}

static void log_line(void *user, const char *line) {
    (void)user;
    printf("  %s\n", line);
}

static void compare(start *s, const morph_placement_options *o, double reach, double seconds) {
    const double hold = s->balance->hold;
    for (int m = 0; m <= MORPH_SEARCH_LBFGS; m++) {
        double *z = NULL;
        morph_nlp_result r;
        morph_limits_free(&s->balance->limits);
        s->balance->hold = hold;
        if (morph_limits_copy(&s->balance->limits, &s->rest.limits) != MORPH_OK ||
            morph_placement_search(&s->w, s->balance, o, (morph_search_method)m, reach, seconds, &s->rest, &z,
                                   &r) != MORPH_OK)
            printf("  %s: failed\n", morph_search_name((morph_search_method)m));
        else
            printf("  %s: %d evaluations, %.2f s, objective %.6f\n", r.solver_text, r.evaluations, r.seconds,
                   r.objective);
        free(z);
    }
}

int main(int argc, char **argv) {
    double reach = 0.3, seconds = 20.0;
    int centres = 1;
    morph_placement_options o = morph_placement_defaults();
    const morph_control control = {.log = log_line};
    o.control = &control;
    for (int i = 1; i < argc; i++) {
        if (sscanf(argv[i], "reach=%lf", &reach) == 1 || sscanf(argv[i], "seconds=%lf", &seconds) == 1 ||
            sscanf(argv[i], "evaluations=%d", &o.evaluations) == 1 ||
            sscanf(argv[i], "centres=%d", &centres) == 1)
            continue;
    }
    for (int i = 1; i < argc; i++) {
        if (strchr(argv[i], '=')) continue;
        start s = {0};
        printf("%s\n", argv[i]);
        if (lay(argv[i], centres, &o, &s))
            compare(&s, &o, reach, seconds);
        else
            printf("  nothing to search from\n");
        morph_rest_free(&s.rest);
        morph_balance_destroy(s.balance);
        morph_workspace_free(&s.w);
        morph_scene_destroy(s.scene);
    }
    return 0;
}
