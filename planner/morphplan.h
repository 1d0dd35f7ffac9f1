/* morphplan: from a scene to actuator length schedules that are checked against every limit.
 *
 * The public interface, one header. Every call does one whole job, keeps no global state, prints nothing and
 * returns an exit code as the program does. Calls may run in one process side by side; solver runs inside
 * them take turns. Texts handed out are freed by the caller with free(). */
#ifndef MORPHPLAN_H
#define MORPHPLAN_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define MORPH_API __attribute__((visibility("default")))
#else
#define MORPH_API
#endif

enum morph_exit {
    MORPH_EXIT_DONE = 0,       /* done, and every check holds */
    MORPH_EXIT_INTERNAL = 1,   /* internal error, or memory or disk refused: nothing half-written is left */
    MORPH_EXIT_INPUT = 2,      /* wrong usage or input: nothing written */
    MORPH_EXIT_INFEASIBLE = 3, /* no feasible plan; check: findings; compare: a method failed */
    MORPH_EXIT_STOPPED = 4     /* stopped by the caller: the folder holds the best so far, marked so */
};

/* How a job runs. Any pointer may be NULL. Callbacks come on the caller's thread. */
typedef struct morph_job {
    const char *folder; /* plan folder; NULL: the scene's path without ending, + ".plan" */
    const char *method; /* "ipopt" (default), "nlopt" or "blanket" */
    const char *motion; /* picture: "schedule" (default), "blanket", "replay", "core", or "cavity" */
    const char *format; /* export: "csv" (default) */
    double sample;      /* export: s between rows; 0: the plan's own */
    double budget;      /* plan: s until the best feasible plan so far is written; 0: none */
    bool overwrite;     /* exchange an existing plan folder; a stopped plan never does: it goes into
                           FOLDER.stopped. export: replace an existing file */
    void (*message)(void *user, const char *line);                    /* faults and warnings, one line each */
    void (*log)(void *user, const char *line);                        /* what the solvers do, one line each */
    void (*progress)(void *user, const char *stage, double fraction); /* fraction of that stage */
    void (*warning)(void *user, const char *line); /* what a target asks beyond reach, one line each */
    int (*stop)(void *user);                       /* nonzero: stop soon with the best so far */
    void *user;
} morph_job;

MORPH_API morph_job morph_job_defaults(void);
MORPH_API const char *morph_version(void);

/* Plans a scene file and writes the plan folder. text: the six lines of the outcome; json: summary.json's
 * content; either may be NULL. They come back NULL where there is no plan. */
MORPH_API int morph_plan_scene(const char *scene, const morph_job *job, char **text, char **json);

/* Runs every method on every scene file and writes compare.json and compare.html into job->folder (NULL:
 * "compare" in the current folder). text: the table. MORPH_EXIT_INFEASIBLE if a method failed outright;
 * what was stopped is written with its rows marked, beside an existing folder as FOLDER.stopped. */
MORPH_API int morph_compare_scenes(const char *const *scenes, int count, const morph_job *job, char **text);

/* Verifies a plan folder, or a schedule file (schedule: CSV, may be NULL) against its plan. text: a table of
 * the margins. */
MORPH_API int morph_check_folder(const char *folder, const char *schedule, const morph_job *job, char **text);

/* Draws a plan folder into file (.svg or .png). */
MORPH_API int morph_picture_folder(const char *folder, const char *file, const morph_job *job);

/* Exports a plan folder's schedule: the same curve at any step (job->sample), with rates and accelerations.
 * file: written whole or not at all, an existing one replaced with job->overwrite only; NULL: the text goes
 * to *text (may be NULL with a file). */
MORPH_API int morph_export_folder(const char *folder, const char *file, const morph_job *job, char **text);

/* Structure, numbering, mobility and target of a scene; solves nothing. */
MORPH_API int morph_info_scene(const char *scene, const morph_job *job, char **text);

#ifdef __cplusplus
}
#endif
#endif
