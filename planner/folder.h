/* The plan folder: whole or not at all. */
#ifndef MORPH_FOLDER_H
#define MORPH_FOLDER_H

#include "planner/record.h"
#include "planner/scene.h"
#include "planner/summary.h"

/* Refuses early what cannot work at the end: the parent is missing or not writable, the folder exists and
 * overwrite is off (or it is not a plan folder: never replaced). message: one line. MORPH_ERR_INPUT or
 * MORPH_ERR_IO. */
morph_status morph_folder_probe(const char *folder, bool overwrite, char *message, size_t size);

/* Writes plan.h5, scene.yaml (+ mesh copy), summary.json, schedule.csv, schedule.json, report.html into a new
 * folder beside `folder`, syncs, then renames; with overwrite exchanges it with the old one (renameat2
 * RENAME_EXCHANGE where it works) and removes that. On failure nothing is left and the old folder stands.
 * message: one line. */
morph_status morph_folder_write(const char *folder, bool overwrite, const morph_scene *scene,
                                const morph_record *record, const morph_summary *summary, char *message,
                                size_t size);

/* Reads plan.h5 (path of a folder). MORPH_ERR_INPUT / MORPH_ERR_IO with message. */
morph_status morph_folder_read(const char *folder, morph_record *record, char *message, size_t size);

/* Are schedule.csv and schedule.json beside plan.h5 the ones written with it? Both checksums, every number of
 * schedule.csv against the record, and what schedule.json says of samples and links. *findings: NULL if all
 * is as it was, else one line for each thing that is not, free(). MORPH_ERR_INPUT where a file is missing,
 * MORPH_ERR_IO, MORPH_ERR_NOMEM, with message. A record without a schedule has no such files: MORPH_OK. */
morph_status morph_folder_verify(const char *folder, const morph_record *record, char **findings,
                                 char *message, size_t size);

/* schedule.csv: allocates time (samples) and length (samples x links). Faults as "FILE:LINE: ..."; a missing
 * file is MORPH_ERR_INPUT too. */
morph_status morph_schedule_read(const char *file, int links, double **time, double **length, int *samples,
                                 char *message, size_t size);

/* The same with at least `least` rows instead of two. */
morph_status morph_schedule_read_rows(const char *file, int links, int least, double **time, double **length,
                                      int *samples, char *message, size_t size);

/* Pieces, for tests. */
morph_status morph_record_write_h5(const morph_record *record, const char *file, char *message, size_t size);
morph_status morph_record_read_h5(const char *file, morph_record *record, char *message, size_t size);
morph_status morph_summary_to_json(const morph_summary *summary, char **text); /* free() */

#endif
