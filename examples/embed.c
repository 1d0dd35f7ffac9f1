/* Plans from a program of one's own: reads a scene, plans it, verifies the plan folder, draws it.
 *
 *     embed SCENE FOLDER [SECONDS]
 *
 * The exit code is that of the check, or of the job that failed. With SECONDS the planner is asked to stop
 * then and to keep the best so far. Only the public header is used; link with -lmorphplan. */
#include "planner/morphplan.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct watch {
    double until; /* 0: no end */
} watch;

static double now(void) {
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Faults of the scene, warnings, why a plan is infeasible: one line each. */
static void on_message(void *user, const char *line) {
    (void)user;
    fprintf(stderr, "%s\n", line);
}

/* The library asks often and from the calling thread: an answer costs no lock. */
static int on_stop(void *user) {
    const watch *w = user;
    return w->until > 0.0 && now() > w->until;
}

int main(int argc, char **argv) {
    if (argc < 3) {
        fprintf(stderr, "usage: embed SCENE FOLDER [SECONDS]\n");
        return MORPH_EXIT_INPUT;
    }
    watch w = {.until = argc > 3 ? now() + strtod(argv[3], NULL) : 0.0};
    morph_job job = morph_job_defaults();
    job.folder = argv[2];
    job.overwrite = true;
    job.message = on_message;
    job.stop = on_stop;
    job.user = &w;

    char *text = NULL;
    int code = morph_plan_scene(argv[1], &job, &text, NULL);
    if (text) printf("%s", text);
    free(text);
    /* Codes 0, 3 and 4 leave a folder: feasible, infeasible, stopped. */
    if (code == MORPH_EXIT_INTERNAL || code == MORPH_EXIT_INPUT) return code;

    w.until = 0.0;
    text = NULL;
    code = morph_check_folder(argv[2], NULL, &job, &text);
    if (text) printf("\n%s", text);
    free(text);
    if (code == MORPH_EXIT_INTERNAL || code == MORPH_EXIT_INPUT) return code;

    char picture[4096];
    const int length = snprintf(picture, sizeof picture, "%s.svg", argv[2]);
    if (length < 0 || (size_t)length >= sizeof picture) return MORPH_EXIT_INPUT;
    const int drawn = morph_picture_folder(argv[2], picture, &job);
    return drawn == MORPH_EXIT_DONE ? code : drawn;
}
