#include "planner/record_h5.h"

#include <stdlib.h>

void morph_record_free(morph_record *record) {
    if (!record) return;
    /* The table of datasets knows every array: one added there is freed here. */
    for (int i = 0; i < morph_record_dataset_total; i++)
        free(morph_record_array(record, &morph_record_datasets[i]));
    *record = (morph_record){0};
}
