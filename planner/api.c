/* The public calls: each reads, runs its stages and writes. */
#include "model/kinematics.h"
#include "planner/check.h"
#include "planner/folder.h"
#include "planner/morphplan.h"
#include "planner/picture.h"
#include "planner/plan.h"
#include "planner/reach_text.h"
#include "planner/start.h"
#include "planner/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

morph_job morph_job_defaults(void) {
    return (morph_job){.method = "ipopt"};
}

const char *morph_version(void) {
    return MORPH_VERSION;
}

static void say(const morph_job *job, const char *line) {
    if (job->message && line[0]) job->message(job->user, line);
}

typedef struct fault_context {
    const morph_job *job;
} fault_context;

static void pass_fault(void *user, const char *line) {
    say(((const fault_context *)user)->job, line);
}

static int exit_of(morph_status status) {
    switch (status) {
    case MORPH_OK:
        return MORPH_EXIT_DONE;
    case MORPH_ERR_INPUT:
        return MORPH_EXIT_INPUT;
    case MORPH_ERR_STOPPED:
        return MORPH_EXIT_STOPPED;
    case MORPH_ERR_MOTION:
        return MORPH_EXIT_INFEASIBLE;
    case MORPH_ERR_NOMEM:
    case MORPH_ERR_NONFINITE:
    case MORPH_ERR_BACKEND:
    case MORPH_ERR_IO:
    case MORPH_ERR_INTERNAL:
        break;
    }
    return MORPH_EXIT_INTERNAL;
}

static void say_of(const morph_job *job, const char *what, const char *text) {
    char line[768];
    snprintf(line, sizeof line, "morphplan: %.240s: %s", what, text);
    say(job, line);
}

static int fail(const morph_job *job, const char *what, morph_status status) {
    say_of(job, what, morph_status_text(status));
    return exit_of(status);
}

static int read_scene(const char *path, const morph_job *job, morph_scene **scene) {
    fault_context context = {job};
    const morph_status status = morph_scene_read(path, pass_fault, pass_fault, &context, scene);
    if (status == MORPH_OK) return MORPH_EXIT_DONE;
    return status == MORPH_ERR_INPUT ? MORPH_EXIT_INPUT : fail(job, path, status);
}

/* "dir/cube.yaml" -> "dir/cube.plan"; a dot in a folder's name is no ending. */
static char *default_folder(const char *scene) {
    const char *slash = strrchr(scene, '/'), *name = slash ? slash + 1 : scene, *dot = strrchr(name, '.');
    const size_t stem = dot && dot != name ? (size_t)(dot - scene) : strlen(scene);
    char *folder = malloc(stem + sizeof ".plan");
    if (folder) {
        memcpy(folder, scene, stem);
        memcpy(folder + stem, ".plan", sizeof ".plan");
    }
    return folder;
}

/* What the scene asks for and the method cannot do is refused before anything is written. */
static int refuse_unsupported(const morph_scene *scene, const morph_job *job) {
    char what[160];
    if (morph_scene_supported(scene, job->method ? job->method : "ipopt", what, sizeof what))
        return MORPH_EXIT_DONE;
    char line[600];
    snprintf(line, sizeof line, "%.400s: %s", scene->file, what);
    say(job, line);
    return MORPH_EXIT_INPUT;
}

/* Writes the plan and says what came of it. */
static int write_plan(const morph_scene *scene, const char *folder, bool overwrite, const morph_plan *plan,
                      const morph_job *job, char **text, char **json) {
    char message[512] = "";
    const morph_summary *summary = &plan->summary;
    const morph_status status =
        morph_folder_write(folder, overwrite, scene, &plan->record, summary, message, sizeof message);
    if (status != MORPH_OK) {
        say(job, message);
        return exit_of(status);
    }
    if (text) *text = morph_plan_text(summary, folder);
    if (json && morph_summary_to_json(summary, json) != MORPH_OK) *json = NULL;
    if (strcmp(summary->outcome, "stopped") == 0) return MORPH_EXIT_STOPPED;
    if (summary->feasible) return MORPH_EXIT_DONE;
    char line[600];
    snprintf(line, sizeof line, "morphplan: infeasible: %s", summary->reason);
    say(job, line);
    return MORPH_EXIT_INFEASIBLE;
}

/* "box.plan/" -> "box.plan.stopped"; a folder that is told as "." or ".." goes by its own name. */
static char *stopped_folder(const char *folder) {
    size_t n = strlen(folder);
    while (n > 1 && folder[n - 1] == '/')
        n--;
    const bool dots = folder[n - 1] == '.' && (n == 1 || folder[n - 2] == '/' ||
                                               (folder[n - 2] == '.' && (n == 2 || folder[n - 3] == '/')));
    char *real = dots ? realpath(folder, NULL) : NULL;
    if (dots && !real) return NULL;
    if (real) n = strlen(real);
    char *name = malloc(n + sizeof ".stopped");
    if (name) {
        memcpy(name, real ? real : folder, n);
        memcpy(name + n, ".stopped", sizeof ".stopped");
    }
    free(real);
    return name;
}

/* Nothing there, or a plan that was stopped: that may be replaced. */
static morph_status may_hold_stopped(const char *folder, char *message, size_t size) {
    struct stat info;
    if (lstat(folder, &info) != 0) return MORPH_OK;
    morph_record record;
    const morph_status status = morph_folder_read(folder, &record, NULL, 0);
    const bool stopped = status == MORPH_OK && strcmp(record.outcome, "stopped") == 0;
    if (status == MORPH_OK) morph_record_free(&record);
    if (stopped || status == MORPH_ERR_NOMEM) return status;
    snprintf(message, size, "%.400s: is there already and no stopped plan: the best so far is not written",
             folder);
    return MORPH_ERR_INPUT;
}

/* A stopped plan never takes the place of one that ran to its end: it goes beside. */
static int write_beside(const morph_scene *scene, const char *folder, const morph_plan *plan,
                        const morph_job *job, char **text, char **json) {
    char message[1200] = "", *beside = stopped_folder(folder);
    if (!beside) return fail(job, folder, MORPH_ERR_NOMEM);
    const morph_status status = may_hold_stopped(beside, message, sizeof message);
    int code = MORPH_EXIT_STOPPED;
    if (status == MORPH_OK) {
        code = write_plan(scene, beside, true, plan, job, text, json);
        if (code == MORPH_EXIT_STOPPED)
            snprintf(message, sizeof message,
                     "morphplan: stopped: %.500s stays as it was, the best so far is in %.500s", folder,
                     beside);
        say(job, message);
    } else if (message[0]) {
        say(job, message);
        code = exit_of(status);
    } else {
        code = fail(job, beside, status);
    }
    free(beside);
    return code;
}

static int plan_into(const morph_scene *scene, const char *folder, const morph_job *job, char **text,
                     char **json) {
    const morph_control control = {job->stop, job->progress, job->log, job->user};
    char message[512] = "";
    const morph_plan_options options = {
        job->method && strcmp(job->method, "blanket") == 0 ? MORPH_METHOD_BLANKET
        : job->method && strcmp(job->method, "nlopt") == 0 ? MORPH_METHOD_NLOPT
                                                           : MORPH_METHOD_IPOPT,
        &control,
        job->warning,
        NULL,
        job->budget,
        message,
        sizeof message};
    morph_status status = morph_folder_probe(folder, job->overwrite, message, sizeof message);
    if (status != MORPH_OK) {
        say(job, message);
        return exit_of(status);
    }
    morph_plan *plan = NULL;
    status = morph_plan_run(scene, &options, &plan);
    if (status != MORPH_OK && message[0]) {
        say_of(job, scene->file, message);
        return exit_of(status);
    }
    if (status != MORPH_OK) return fail(job, scene->file, status);
    struct stat info;
    const bool beside = strcmp(plan->summary.outcome, "stopped") == 0 && lstat(folder, &info) == 0;
    const int code = beside ? write_beside(scene, folder, plan, job, text, json)
                            : write_plan(scene, folder, job->overwrite, plan, job, text, json);
    morph_plan_destroy(plan);
    return code;
}

int morph_plan_scene(const char *path, const morph_job *job, char **text, char **json) {
    if (text) *text = NULL;
    if (json) *json = NULL;
    morph_scene *scene = NULL;
    int code = read_scene(path, job, &scene);
    if (code != MORPH_EXIT_DONE) return code;
    code = refuse_unsupported(scene, job);
    if (code != MORPH_EXIT_DONE) {
        morph_scene_destroy(scene);
        return code;
    }
    char *own = job->folder ? NULL : default_folder(path);
    const char *folder = job->folder ? job->folder : own;
    code = folder ? plan_into(scene, folder, job, text, json) : fail(job, path, MORPH_ERR_NOMEM);
    free(own);
    morph_scene_destroy(scene);
    return code;
}

static morph_status check_schedule_file(const morph_record *record, const char *file, char *message,
                                        size_t size, morph_check_report *report) {
    double *time = NULL, *length = NULL;
    int samples = 0;
    morph_status status = morph_schedule_read(file, record->links, &time, &length, &samples, message, size);
    if (status == MORPH_OK) status = morph_check_lengths(record, time, length, samples, report);
    free(time);
    free(length);
    return status;
}

int morph_check_folder(const char *folder, const char *schedule, const morph_job *job, char **text) {
    if (text) *text = NULL;
    char message[512] = "", *files = NULL;
    morph_record record = {0};
    morph_check_report report = {0};
    morph_blas_threads(1);
    if (access(folder, F_OK) != 0) {
        snprintf(message, sizeof message, "%s: no such plan folder", folder);
        say(job, message);
        return MORPH_EXIT_INPUT;
    }
    morph_status status = morph_folder_read(folder, &record, message, sizeof message);
    if (status == MORPH_OK && schedule)
        status = check_schedule_file(&record, schedule, message, sizeof message, &report);
    else if (status == MORPH_OK) {
        const morph_control control = {job->stop, job->progress, job->log, job->user};
        status = morph_folder_verify(folder, &record, &files, message, sizeof message);
        if (status == MORPH_OK) status = morph_check_record(&record, &control, &report);
    }
    morph_record_free(&record);
    if (status != MORPH_OK) {
        free(files);
        if (!message[0]) return fail(job, folder, status);
        say(job, message);
        return exit_of(status);
    }
    if (text) *text = morph_check_text(&report, !schedule, files);
    const bool good = report.feasible && !files;
    free(files);
    return good ? MORPH_EXIT_DONE : MORPH_EXIT_INFEASIBLE;
}

int morph_picture_folder(const char *folder, const char *file, const morph_job *job) {
    char message[512] = "";
    morph_record record = {0};
    if (access(folder, F_OK) != 0) {
        snprintf(message, sizeof message, "%s: no such plan folder", folder);
        say(job, message);
        return MORPH_EXIT_INPUT;
    }
    morph_status status = morph_folder_read(folder, &record, message, sizeof message);
    const bool cavity = job && job->motion && strcmp(job->motion, "cavity") == 0;
    if (status == MORPH_OK && job && job->motion && !cavity)
        status = morph_picture_select(&record, job->motion, message, sizeof message);
    if (status == MORPH_OK)
        status = cavity ? morph_picture_cavity(&record, file, message, sizeof message)
                        : morph_picture_write(&record, NULL, file, message, sizeof message);
    morph_record_free(&record);
    if (status == MORPH_OK) return MORPH_EXIT_DONE;
    if (!message[0]) return fail(job, folder, status);
    say(job, message);
    return exit_of(status);
}

int morph_info_scene(const char *path, const morph_job *job, char **text) {
    if (text) *text = NULL;
    morph_scene *scene = NULL;
    const int code = read_scene(path, job, &scene);
    if (code != MORPH_EXIT_DONE) return code;
    morph_structure *s = NULL;
    morph_distance *exact = NULL;
    morph_mobility mobility;
    morph_reach reach;
    morph_blas_threads(1);
    morph_status status = morph_structure_create(&scene->structure, &s);
    if (status == MORPH_OK) morph_start_hold(&scene->start, s);
    if (status == MORPH_OK) status = morph_mobility_at(s, s->start, &mobility);
    if (status == MORPH_OK)
        status = morph_distance_create(&scene->target, scene->target_report.closed, &exact);
    if (status == MORPH_OK) status = morph_scene_reach(scene, s, exact, &reach);
    if (status == MORPH_OK && text) *text = morph_info_text(scene, s, &mobility, &reach);
    morph_distance_destroy(exact);
    morph_structure_destroy(s);
    morph_scene_destroy(scene);
    return status == MORPH_OK ? MORPH_EXIT_DONE : fail(job, path, status);
}
