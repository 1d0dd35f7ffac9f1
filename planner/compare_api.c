/* The public call for `compare`. */
#include "planner/compare.h"
#include "planner/folder_text.h"
#include "planner/morphplan.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void say(void *user, const char *line) {
    const morph_job *job = user;
    if (job->message && line[0]) job->message(job->user, line);
}

static int fail(const morph_job *job, const char *what, morph_status status) {
    char line[256];
    snprintf(line, sizeof line, "morphplan: %s: %s", what, morph_status_text(status));
    say((void *)job, line);
    return status == MORPH_ERR_INPUT ? MORPH_EXIT_INPUT : MORPH_EXIT_INTERNAL;
}

/* All of them, so that the faults of all are told at once. */
static int read_scenes(const char *const *path, int count, const morph_job *job, morph_scene **scene) {
    int code = MORPH_EXIT_DONE;
    for (int k = 0; k < count && code != MORPH_EXIT_INTERNAL; k++) {
        const morph_status status = morph_scene_read(path[k], say, say, (void *)job, &scene[k]);
        if (status == MORPH_ERR_INPUT)
            code = MORPH_EXIT_INPUT;
        else if (status != MORPH_OK)
            code = fail(job, path[k], status);
    }
    return code;
}

/* A comparison that was stopped never takes the place of one that ran to its end, but that of a stopped one.
 */
static bool is_stopped(const char *folder) {
    char *path = morph_path_join(folder, "compare.json"), *data = NULL;
    size_t size;
    const bool found = path && morph_file_load(path, &data, &size, NULL, 0) == MORPH_OK &&
                       strstr(data, "\"outcome\":\t\"stopped\"");
    free(data);
    free(path);
    return found;
}

static int write_stopped(const char *folder, const morph_compare *compare, const morph_job *job) {
    char message[1200] = "";
    struct stat info;
    size_t n = strlen(folder);
    while (n > 1 && folder[n - 1] == '/')
        n--;
    char *beside = malloc(n + sizeof ".stopped");
    if (!beside) return fail(job, folder, MORPH_ERR_NOMEM);
    snprintf(beside, n + sizeof ".stopped", "%.*s%s", (int)n, folder,
             lstat(folder, &info) == 0 ? ".stopped" : "");
    morph_status status = MORPH_OK;
    if (lstat(beside, &info) == 0 && !is_stopped(beside))
        status = morph_fail(MORPH_ERR_INPUT, message, sizeof message,
                            "%.400s: is there already and no stopped comparison: the rows so far are not "
                            "written",
                            beside);
    if (status == MORPH_OK) status = morph_compare_write(beside, true, compare, message, sizeof message);
    if (status == MORPH_OK)
        snprintf(message, sizeof message, "morphplan: stopped: the rows so far are in %.500s", beside);
    say((void *)job, message);
    free(beside);
    return status == MORPH_OK          ? MORPH_EXIT_STOPPED
           : status == MORPH_ERR_INPUT ? MORPH_EXIT_INPUT
                                       : MORPH_EXIT_INTERNAL;
}

static int compare_into(const morph_scene *const *scene, int count, const char *folder, const morph_job *job,
                        char **text) {
    const morph_control control = {job->stop, job->progress, job->log, job->user};
    char message[512] = "";
    morph_compare *compare = NULL;
    morph_status status = morph_compare_probe(folder, job->overwrite, message, sizeof message);
    if (status != MORPH_OK) {
        say((void *)job, message);
        return status == MORPH_ERR_INPUT ? MORPH_EXIT_INPUT : MORPH_EXIT_INTERNAL;
    }
    status = morph_compare_run(scene, count, &control, &compare);
    if (status == MORPH_OK && text) status = morph_compare_text(compare, text);
    int code = status == MORPH_OK ? MORPH_EXIT_DONE : fail(job, folder, status);
    if (code == MORPH_EXIT_DONE && compare->stopped) {
        code = write_stopped(folder, compare, job);
    } else if (code == MORPH_EXIT_DONE) {
        status = morph_compare_write(folder, job->overwrite, compare, message, sizeof message);
        say((void *)job, message);
        if (status != MORPH_OK)
            code = status == MORPH_ERR_INPUT ? MORPH_EXIT_INPUT : MORPH_EXIT_INTERNAL;
        else if (compare->failed)
            code = MORPH_EXIT_INFEASIBLE;
    }
    morph_compare_destroy(compare);
    return code;
}

int morph_compare_scenes(const char *const *path, int count, const morph_job *job, char **text) {
    if (text) *text = NULL;
    if (count < 1) return fail(job, "compare", MORPH_ERR_INPUT);
    morph_scene **scene = morph_alloc((size_t)count, sizeof *scene);
    if (!scene) return fail(job, path[0], MORPH_ERR_NOMEM);
    int code = read_scenes(path, count, job, scene);
    if (code == MORPH_EXIT_DONE)
        code = compare_into((const morph_scene *const *)scene, count, job->folder ? job->folder : "compare",
                            job, text);
    for (int k = 0; k < count; k++)
        morph_scene_destroy(scene[k]);
    free(scene);
    return code;
}
