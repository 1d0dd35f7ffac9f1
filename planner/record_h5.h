/* plan.h5 as one table of datasets, walked by the writer and by the reader. Internal. */
#ifndef MORPH_RECORD_H5_H
#define MORPH_RECORD_H5_H

#include "planner/record.h"

#include <hdf5.h>

#define MORPH_RECORD_FORMAT "morphplan-plan"
#define MORPH_RECORD_VERSION 1

typedef enum morph_cell { MORPH_CELL_INT, MORPH_CELL_REAL } morph_cell;

/* A dimension (or an upper limit of an index): an int field of the record times a factor, or a constant. */
typedef struct morph_extent {
    int count; /* number of the field in morph_record_counts; -1: none */
    int times; /* factor, or the constant */
} morph_extent;

typedef struct morph_dataset {
    const char *path; /* "structure/links" */
    size_t field;     /* offset of the array's pointer in morph_record */
    morph_cell cell;
    int rank;
    morph_extent shape[2 + 1];
    /* Values of an integer dataset lie in [0, below), by column (the last column's holds for the rest); times
     * 0: only not negative. */
    morph_extent below[2];
    bool required; /* always there; the others come and go by group, offsets one by one */
    const char *unit, *description;
} morph_dataset;

/* Fields that count something, by offset in morph_record. */
extern const size_t morph_record_counts[];
extern const int morph_record_count_total;
extern const morph_dataset morph_record_datasets[];
extern const int morph_record_dataset_total;

/* The field as an int. */
int *morph_record_count(morph_record *record, int count);
/* The array of a dataset. */
void *morph_record_array(const morph_record *record, const morph_dataset *set);
void morph_record_set_array(morph_record *record, const morph_dataset *set, void *array);

/* A group is whole or absent: the name of the first dataset that is missing from a group of which another is
 * there, or of a required one; NULL when all is well. A required array may be NULL when it has no entries. */
const char *morph_record_incomplete(const morph_record *record);

/* Every index of the record in its range, every count not negative? What is wrong goes to message. */
bool morph_record_indices_hold(const morph_record *record, char *message, size_t size);

/* Is this file a plan.h5 (root attribute format)? False also when it cannot be read. */
bool morph_record_is_plan(const char *file);

/* One use of HDF5 at a time per process: the library is built without thread safety. Between begin and end
 * its error printing is off. */
typedef struct morph_h5_quiet {
    H5E_auto2_t function;
    void *data;
} morph_h5_quiet;
void morph_h5_begin(morph_h5_quiet *quiet);
void morph_h5_end(morph_h5_quiet *quiet, bool damaged);

#endif
