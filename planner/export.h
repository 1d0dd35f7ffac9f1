/* Exports of a plan: its schedule in the formats of actuators and viewers, at any step. */
#ifndef MORPH_EXPORT_H
#define MORPH_EXPORT_H

#include "planner/folder_text.h"
#include "planner/record.h"

/** A table of the schedule's curve: time, and every link's length, rate and acceleration. Zeroed is empty;
 * free with morph_export_table_free. */
typedef struct morph_export_table {
    int samples, links;
    double *time;                         /**< samples; even steps from 0, s */
    double *length, *rate, *acceleration; /**< samples x links; m, m/s, m/s2 */
} morph_export_table;
void morph_export_table_free(morph_export_table *table);

/** Evaluates the curve of a record (path/ and timing/) anew at step `sample` (s; 0: that of schedule/). The
 * last time is the first one at or after the end of the motion; what lies after the end is at rest there.
 * Before that the curve is held against schedule/: where it does not give those lengths within 1e-12 m, the
 * record is refused. MORPH_ERR_INPUT with one line in message: no schedule or no timing in the record, a
 * curve that is none, a step that is not positive or makes more than MORPH_SCENE_SAMPLES rows;
 * MORPH_ERR_NOMEM. */
morph_status morph_export_evaluate(const morph_record *record, double sample, morph_export_table *out,
                                   char *message, size_t size);

/** The text of a table as CSV: "time_s,link_0000_m,...,link_0000_m_per_s,...,link_0000_m_per_s2,...", one row
 * a sample; every number reads back bit for bit. The caller frees *out. MORPH_ERR_NOMEM, MORPH_ERR_NONFINITE.
 */
morph_status morph_export_csv(const morph_export_table *table, morph_text *out);

/** Reads such a text back and compares every number with the table's, bit for bit. MORPH_ERR_INTERNAL with
 * the row and column of the first that differs in message; MORPH_ERR_NOMEM. */
morph_status morph_export_csv_verify(const morph_export_table *table, const char *text, char *message,
                                     size_t size);

#endif
