/* The public call for `export`. */
#include "planner/export.h"
#include "planner/folder.h"
#include "planner/morphplan.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int tell(const morph_job *job, morph_status status, const char *what, const char *why) {
    char line[1200];
    snprintf(line, sizeof line, "%.600s: %.500s", what, why[0] ? why : morph_status_text(status));
    if (status != MORPH_OK && job->message) job->message(job->user, line);
    return status == MORPH_OK          ? MORPH_EXIT_DONE
           : status == MORPH_ERR_INPUT ? MORPH_EXIT_INPUT
                                       : MORPH_EXIT_INTERNAL;
}

/* The formats that are to come are refused by name. */
static int refuse_format(const morph_job *job) {
    static const char *const later[] = {"jtc", "pvt", "csp", "mcap", "vtk"};
    char line[128];
    const char *format = job->format ? job->format : "csv";
    if (strcmp(format, "csv") == 0) return MORPH_EXIT_DONE;
    snprintf(line, sizeof line, "no such format: %.40s; allowed: csv", format);
    for (size_t k = 0; k < sizeof later / sizeof *later; k++)
        if (strcmp(format, later[k]) == 0)
            snprintf(line, sizeof line, "not available yet: --format %s", format);
    return tell(job, MORPH_ERR_INPUT, "morphplan", line);
}

/* A plan that is not fit for use is exported when asked for, but not without a word. */
static void warn_unfit(const char *folder, const morph_record *record, const morph_job *job) {
    char line[700];
    if (!job->warning || strcmp(record->outcome, "optimal") == 0 || strcmp(record->outcome, "feasible") == 0)
        return;
    snprintf(line, sizeof line, "%.500s: warning: the plan's outcome is %s: check it before use", folder,
             record->outcome);
    job->warning(job->user, line);
}

/* Table and text; the text is read back before anybody gets it. */
static morph_status make_csv(const morph_record *record, double sample, morph_text *csv, char *message,
                             size_t size) {
    morph_export_table table;
    morph_status status = morph_export_evaluate(record, sample, &table, message, size);
    if (status != MORPH_OK) return status;
    status = morph_export_csv(&table, csv);
    if (status == MORPH_OK) {
        status = morph_export_csv_verify(&table, csv->data, message, size);
        if (status != MORPH_OK) morph_text_free(csv);
    }
    morph_export_table_free(&table);
    return status;
}

int morph_export_folder(const char *folder, const char *file, const morph_job *job, char **text) {
    char message[512] = "";
    struct stat info;
    if (text) *text = NULL;
    const int format = refuse_format(job);
    if (format != MORPH_EXIT_DONE) return format;
    if (access(folder, F_OK) != 0) return tell(job, MORPH_ERR_INPUT, folder, "no such plan folder");
    if (file && !job->overwrite && lstat(file, &info) == 0)
        return tell(job, MORPH_ERR_INPUT, file,
                    "is there already: name another file, or replace it with --overwrite");
    morph_blas_threads(1);
    morph_record record = {0};
    morph_text csv = {0};
    morph_status status = morph_folder_read(folder, &record, message, sizeof message);
    if (status != MORPH_OK) { /* its message names the file */
        if (message[0] && job->message) job->message(job->user, message);
        return tell(message[0] ? &(morph_job){0} : job, status, folder, message);
    }
    warn_unfit(folder, &record, job);
    status = make_csv(&record, job->sample, &csv, message, sizeof message);
    morph_record_free(&record);
    if (status != MORPH_OK) return tell(job, status, folder, message);
    if (file) {
        status = morph_file_replace(file, csv.data, csv.size, message, sizeof message);
        if (status != MORPH_OK && message[0] && job->message) job->message(job->user, message);
        morph_text_free(&csv);
        return tell(message[0] ? &(morph_job){0} : job, status, file, message);
    }
    if (text)
        *text = csv.data; /* made by realloc: the caller's to free() */
    else
        morph_text_free(&csv);
    return MORPH_EXIT_DONE;
}
