/* report.html: one self-contained page with still pictures and tables. */
#ifndef MORPH_REPORT_H
#define MORPH_REPORT_H

#include "planner/record.h"
#include "planner/summary.h"

morph_status morph_report_html(const morph_record *record, const morph_summary *summary,
                               char **text); /* free() */

#endif
