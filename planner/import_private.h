/* What the import files share. */
#ifndef MORPH_IMPORT_PRIVATE_H
#define MORPH_IMPORT_PRIVATE_H

#include "planner/import.h"

#include <stdint.h>

/* Limits: what an import may need of memory and time on a small machine. */
#define MORPH_IMPORT_BYTES (512ull << 20)
#define MORPH_IMPORT_TRIANGLES 2000000
#define MORPH_IMPORT_CORNERS 10000 /* of one polygon */

/* Where the one sentence of a refusal goes. name: the file as the user wrote it. */
typedef struct morph_sentence {
    char *text;
    size_t size;
    const char *name;
} morph_sentence;

/* Writes the sentence (nothing without a buffer) and returns MORPH_ERR_INPUT. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
morph_status
morph_refuse(const morph_sentence *to, const char *format, ...);

/* A whole regular file in memory, a zero byte behind it; free with free(). MORPH_ERR_INPUT with a sentence
 * where it is missing, no regular file, empty, unreadable or beyond the limit. */
morph_status morph_import_load(const char *path, const morph_sentence *sentence, char **data, size_t *size);

/* Compares what the headers of STL, PLY and glTF claim, lists included, with the bytes that are there,
 * before anything is allocated by such a claim. ending: lower case, no dot; others pass. *size may shrink to
 * the bytes that belong to the mesh (a binary STL with something behind it). */
morph_status morph_import_claims(const char *ending, const char *data, size_t *size,
                                 const morph_sentence *sentence);
morph_status morph_import_ply_claims(const char *data, size_t size, const morph_sentence *sentence);
morph_status morph_import_gltf_claims(const char *data, size_t size, bool binary,
                                      const morph_sentence *sentence);

/* Polygons as a file lists them: n[i] corners each, one after the other in `corner`. Zeroed is empty. */
typedef struct morph_polygons {
    int vertices, polygons;
    double *v;   /* 3 * vertices */
    int *n;      /* polygons */
    int *corner; /* sum of n, each below vertices */
} morph_polygons;

void morph_polygons_free(morph_polygons *polygons);

/* OFF is read here: assimp 5.2 leaves out polygons of more than nine corners without a word. */
morph_status morph_import_off(const char *data, size_t size, const morph_sentence *sentence,
                              morph_polygons *out);

/* The file's polygons as triangles, node transforms applied; vertices as the file has them (not welded).
 * *crossing: polygons that cross themselves, cut into a fan for want of anything better. */
morph_status morph_import_mesh(const char *path, const morph_sentence *sentence, morph_mesh *mesh,
                               int *crossing);

/* Heights from a text table, first row far; *z has rows * columns entries, free with free(). */
morph_status morph_import_heights(const char *path, const morph_sentence *sentence, double **z, int *rows,
                                  int *columns);

#endif
