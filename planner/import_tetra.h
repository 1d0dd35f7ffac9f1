/* Tetrahedral meshes from files: Gmsh .msh (text, 2.0 to 2.2 and 4.1) and TetGen .node with .ele (numbered
 * from 0 or 1). */
#ifndef MORPH_IMPORT_TETRA_H
#define MORPH_IMPORT_TETRA_H

#include "model/tetra.h"

/* Whether a file name ends like one of these formats. */
bool morph_is_tetra_file(const char *path);

/* The other file of a TetGen pair (caller frees); NULL where the name is not of one. */
morph_status morph_tetra_sibling(const char *path, char **sibling);

/* Reads the file's tetrahedra (of second-order ones the corners); what else it holds is passed over, but
 * other solid elements are refused. Of a TetGen pair either file may be named. name: the file as the user
 * wrote it. Negative tetrahedra are turned, vertices of none are dropped: see *report. Coordinates stay the
 * file's. On MORPH_ERR_INPUT message is one sentence naming what is wrong and what is allowed. */
morph_status morph_import_tetra(const char *path, const char *name, morph_tetra *out,
                                morph_tetra_report *report, char *message, size_t message_size);

#endif
