/* schedule.csv and schedule.json: what an actuator controller reads. Internal. */
#ifndef MORPH_SCHEDULE_FILE_H
#define MORPH_SCHEDULE_FILE_H

#include "planner/folder_text.h"
#include "planner/record.h"

/* The text of schedule.csv: "time_s,link_0000_m,..." and one row per sample; every number reads back bit for
 * bit. MORPH_ERR_NONFINITE when a time or a length is not finite. The caller frees *out. */
morph_status morph_schedule_csv(const morph_record *record, morph_text *out);

/* The text of schedule.json; csv_sha256 and plan_sha256 are the checksums of the files beside it. */
morph_status morph_schedule_json(const morph_record *record, const char *title, const char *csv_sha256,
                                 const char *plan_sha256, morph_text *out);

#endif
