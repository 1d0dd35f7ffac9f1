/* Where a plan folder goes, the hidden folder beside it in which it is built, and the change of places.
 * Internal. */
#ifndef MORPH_FOLDER_PLACE_H
#define MORPH_FOLDER_PLACE_H

#include "solvers/base.h"

/* What a folder is told by: only one that holds a file of this name, known by its content, is replaced. */
typedef struct morph_place_kind {
    const char *what, *sign; /* "plan", "plan.h5" */
    bool (*known)(const char *file);
} morph_place_kind;

/* Owned texts; zeroed is empty. */
typedef struct morph_place {
    morph_place_kind kind;
    char *folder; /* the plan folder, without a slash at its end; links resolved if it exists */
    char *parent; /* the folder that it stands in */
    char *name;   /* its name in there */
    bool exists;
    char *stage; /* the hidden folder, NULL before morph_place_stage */
    int lock;    /* descriptor that holds it, -1 */
} morph_place;

/* Finds the place and refuses what cannot work: no name, no parent, something there that may not be replaced.
 * A plan that a killed run left moved aside is put back, hidden folders of killed runs are removed. */
morph_status morph_place_find(const char *folder, bool overwrite, morph_place *place, char *message,
                              size_t size);
/* The same for folders of another kind. */
morph_status morph_place_find_kind(const char *folder, bool overwrite, morph_place_kind kind,
                                   morph_place *place, char *message, size_t size);

/* Creates the hidden folder. MORPH_ERR_IO. */
morph_status morph_place_stage(morph_place *place, char *message, size_t size);

/* Syncs the hidden folder and puts it in its place. On failure the old folder stands. */
morph_status morph_place_commit(morph_place *place, bool overwrite, char *message, size_t size);

/* Removes the hidden folder if it is still there, and frees. */
void morph_place_close(morph_place *place);

/* Removes a folder of plain files; 0 or -1 with errno. Folders inside are not entered and make it fail. */
int morph_place_remove(const char *folder);

/* The same as morph_place_commit without the system's atomic exchange: old aside, new in, old removed. */
morph_status morph_place_swap(morph_place *place, char *message, size_t size);

#endif
