/* Placement of centres scene by scene: does the last program converge, and does the blanket end where it
 * says; then NLopt with Ipopt's wall time and number of centres, each judged by the blanket that runs again;
 * then what a scene costs. bench_placement SCENE.yaml... [once] [log]   (once: Ipopt alone, for the growth
 * with size; log: what each round does, on stderr) */
#include "planner/placement.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

typedef struct laid {
    morph_scene *scene;
    morph_workspace work;
    morph_trajectory pure;
} laid;

static bool lay(const char *path, laid *l) {
    *l = (laid){0};
    if (morph_scene_read(path, NULL, NULL, NULL, &l->scene) != MORPH_OK ||
        morph_workspace_create(l->scene, NULL, &l->work) != MORPH_OK)
        return false;
    const morph_blanket_def def = morph_scene_blanket(l->scene, l->work.structure);
    return morph_blanket_run(l->work.structure, l->work.sdf, l->work.exact, &def, l->work.start, NULL,
                             &l->pure, NULL) == MORPH_OK;
}

static void clear(laid *l) {
    morph_trajectory_free(&l->pure);
    morph_workspace_free(&l->work);
    morph_scene_destroy(l->scene);
}

static const double *end_of(const laid *l) {
    return &l->pure.x[(size_t)(l->pure.frames - 1) * 3 * (size_t)l->pure.joints];
}

/* Objective of the blanket under the centres found, spacings^4; NAN where it failed. */
static double place(const laid *l, const morph_placement_options *o, morph_placement *p) {
    const double a = l->work.structure->spacing;
    const morph_status status = morph_placement_run(&l->work, l->scene, end_of(l), o, p);
    if (status != MORPH_OK || p->guided.frames == 0) return NAN;
    return p->reached.objective / (a * a * a * a);
}

static double seeds_of(const laid *l, const morph_placement *p) {
    const double a = l->work.structure->spacing;
    return p->seeded.objective / (a * a * a * a);
}

static const char *name_of(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static void say_end(const char *name, const laid *l, const morph_placement *p, double reached) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    printf(
        "%-20s %7.4f %7.4f  %s  residual %.1e  lambda c %.1e  %s  apart %.3f  | %2d rounds %4d iterations "
        "%5d unknowns %5d rows %6d J %6d H  %5.1f s %4ld MiB  %s\n",
        name, seeds_of(l, p), reached, p->solved ? "solved " : "not yet", p->balance.residual,
        p->balance.complementarity, p->balance.stable ? "stable" : "saddle", p->difference, p->rounds,
        p->effort.iterations, p->effort.unknowns, p->effort.rows, p->effort.jacobian_nonzeros,
        p->effort.hessian_nonzeros, p->seconds, usage.ru_maxrss / 1024, p->reason);
    fflush(stdout);
}

static void say_line(void *user, const char *line) {
    (void)user;
    fprintf(stderr, "%s\n", line);
}

static const morph_control loud = {.log = say_line};

typedef struct tally {
    int scenes, converged, agree, better_than_seeds, better_than_search;
} tally;

/* Better by more than the blanket's own scatter when it is run on is not asked: the figures stand beside. */
static void run(const char *path, bool once, const morph_control *control, tally *t) {
    laid l;
    morph_placement ipopt, other;
    if (!lay(path, &l)) {
        printf("%s: cannot be laid\n", path);
        return;
    }
    morph_placement_options o = morph_placement_defaults();
    o.control = control;
    const double reached = place(&l, &o, &ipopt);
    say_end(name_of(path), &l, &ipopt, reached);
    const bool converged = ipopt.solved && ipopt.balance.stable && ipopt.balance.residual < 1e-6 &&
                           ipopt.balance.complementarity < 1e-6;
    t->scenes++;
    t->converged += converged;
    t->agree += converged && ipopt.difference <= 0.05;
    t->better_than_seeds += reached < seeds_of(&l, &ipopt);
    if (!once) {
        double least = INFINITY;
        static const morph_placement_method methods[2] = {MORPH_PLACE_NLOPT_FREE, MORPH_PLACE_NLOPT_GRADIENT};
        o.seconds = ipopt.seconds;
        o.most_centres = ipopt.centres;
        for (int k = 0; k < 2; k++) {
            o.method = methods[k];
            const double value = place(&l, &o, &other);
            printf("    %-24s %7.4f  %d centres of %d, %.1f s\n",
                   k ? "NLopt, with gradients" : "NLopt, without gradients", value, other.centres,
                   ipopt.centres, other.seconds);
            if (value < least) least = value;
            morph_placement_free(&other);
        }
        t->better_than_search += reached < least;
    }
    morph_placement_free(&ipopt);
    clear(&l);
}

int main(int argc, char **argv) {
    tally t = {0};
    bool once = false;
    const morph_control *control = NULL;
    for (int i = 1; i < argc; i++) {
        once |= strcmp(argv[i], "once") == 0;
        if (strcmp(argv[i], "log") == 0) control = &loud;
    }
    printf("%-20s %7s %7s\n", "scene", "seeds", "Ipopt");
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "once") != 0 && strcmp(argv[i], "log") != 0) run(argv[i], once, control, &t);
    printf("of %d: %d converged, of these %d with the blanket within 0.05 spacings; better than seeds %d",
           t.scenes, t.converged, t.agree, t.better_than_seeds);
    if (!once) printf(", than the better search in the same time %d", t.better_than_search);
    printf("\n");
    return t.scenes > 0 ? 0 : 2;
}
