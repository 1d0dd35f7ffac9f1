/* Sections of report.html. Internal. Each appends to the page; texts are escaped there. */
#ifndef MORPH_REPORT_PARTS_H
#define MORPH_REPORT_PARTS_H

#include "planner/folder_text.h"
#include "planner/record.h"
#include "planner/summary.h"

/* "12.3 mm" and the like, as HTML: three significant digits with a prefix that fits; an en dash when not
 * finite. unit "m", "m3" (cubic metres) or any other, which is put after the plain number. */
void morph_report_quantity(morph_text *page, double value, const char *unit);

void morph_report_outcome(morph_text *page, const morph_summary *summary);
void morph_report_measures(morph_text *page, const morph_summary *summary);
void morph_report_cavities(morph_text *page, const morph_summary *summary);
void morph_report_margins(morph_text *page, const morph_summary *summary);
void morph_report_structure(morph_text *page, const morph_record *record, const morph_summary *summary);
void morph_report_solver(morph_text *page, const morph_summary *summary);

#endif
