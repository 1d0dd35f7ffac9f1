/* Mesh files through assimp's C interface. Nothing is post-processed there: polygons, vertices and nodes
 * arrive as the file has them. */
#include "planner/import_private.h"

#include <assimp/cfileio.h>
#include <assimp/cimport.h>
#include <assimp/scene.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- files for assimp ---- */

/* The main file is served from the memory that was checked. Others are opened only for glTF (its buffers),
 * never for material libraries: a name in a mesh file must not make the program read a device. */
typedef struct served {
    const char *path, *data;
    size_t size;
    bool others;
} served;

typedef struct opened {
    struct aiFile file;
    const char *data;
    char *own; /* to free; NULL for the main file */
    size_t size, at;
} opened;

static size_t file_read(struct aiFile *f, char *to, size_t size, size_t count) {
    opened *o = (opened *)(void *)f->UserData;
    if (size == 0) return 0;
    const size_t left = (o->size - o->at) / size, n = count < left ? count : left;
    memcpy(to, o->data + o->at, n * size);
    o->at += n * size;
    return n;
}

static size_t file_write(struct aiFile *f, const char *from, size_t size, size_t count) {
    (void)f;
    (void)from;
    (void)size;
    (void)count;
    return 0;
}

static size_t file_tell(struct aiFile *f) {
    return ((opened *)(void *)f->UserData)->at;
}

static size_t file_size(struct aiFile *f) {
    return ((opened *)(void *)f->UserData)->size;
}

static enum aiReturn file_seek(struct aiFile *f, size_t offset, enum aiOrigin origin) {
    opened *o = (opened *)(void *)f->UserData;
    const size_t from = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? o->at : o->size;
    /* Backward steps arrive as huge offsets that wrap round. */
    const size_t to = from + offset;
    if (to > o->size) return aiReturn_FAILURE;
    o->at = to;
    return aiReturn_SUCCESS;
}

static void file_flush(struct aiFile *f) {
    (void)f;
}

static struct aiFile *file_open(struct aiFileIO *io, const char *path, const char *mode) {
    const served *s = (const served *)(void *)io->UserData;
    if (!path || !mode || mode[0] != 'r') return NULL;
    const bool main_file = strcmp(path, s->path) == 0;
    if (!main_file && !s->others) return NULL;
    opened *o = calloc(1, sizeof *o);
    if (!o) return NULL;
    if (main_file) {
        o->data = s->data;
        o->size = s->size;
    } else {
        const morph_sentence nowhere = {NULL, 0, path};
        if (morph_import_load(path, &nowhere, &o->own, &o->size) != MORPH_OK) {
            free(o);
            return NULL;
        }
        o->data = o->own;
    }
    o->file = (struct aiFile){file_read, file_write, file_tell, file_size, file_seek, file_flush, (char *)o};
    return &o->file;
}

static void file_close(struct aiFileIO *io, struct aiFile *f) {
    (void)io;
    if (!f) return;
    opened *o = (opened *)(void *)f->UserData;
    free(o->own);
    free(o);
}

/* ---- node transforms ---- */

/* Row-major 3 x 4. */
typedef struct placed {
    const struct aiNode *node;
    double m[12];
} placed;

static void compose(const double a[12], const struct aiMatrix4x4 *b, double out[12]) {
    const double m[16] = {b->a1, b->a2, b->a3, b->a4, b->b1, b->b2, b->b3, b->b4,
                          b->c1, b->c2, b->c3, b->c4, 0,     0,     0,     1};
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 4; c++) {
            double sum = c == 3 ? a[4 * r + 3] : 0;
            for (int k = 0; k < 3; k++)
                sum += a[4 * r + k] * m[4 * k + c];
            out[4 * r + c] = sum;
        }
}

/* All nodes with their transforms, parents first. The tree is as large as the file makes it: a queue that
 * grows. */
static morph_status place_nodes(const struct aiNode *root, placed **out, size_t *count) {
    size_t capacity = 64, n = 0;
    placed *list = morph_alloc(capacity, sizeof *list);
    if (!list) return MORPH_ERR_NOMEM;
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    list[n].node = root;
    compose(identity, &root->mTransformation, list[n++].m);
    for (size_t i = 0; i < n; i++)
        for (unsigned c = 0; c < list[i].node->mNumChildren; c++) {
            if (n == capacity) {
                placed *more = realloc(list, 2 * capacity * sizeof *list);
                if (!more) {
                    free(list);
                    return MORPH_ERR_NOMEM;
                }
                list = more;
                capacity *= 2;
            }
            list[n].node = list[i].node->mChildren[c];
            compose(list[i].m, &list[n].node->mTransformation, list[n].m);
            n++;
        }
    *out = list;
    *count = n;
    return MORPH_OK;
}

/* ---- polygons ---- */

/* Triangles and vertices being gathered; both grow. */
typedef struct gather {
    const morph_sentence *sentence;
    double *v;
    int *t;
    int vertices, triangles, crossing;
    size_t room_v, room_t; /* in vertices, triangles */
    int *to;               /* of the mesh at hand: its vertices here, -1 */
    int *polygon, *cut;    /* scratch: corners; triangles of one polygon */
} gather;

static morph_status make_room(gather *g, size_t vertices, size_t triangles) {
    if (vertices > g->room_v) {
        const size_t room = vertices + vertices / 2 + 1024;
        double *v = realloc(g->v, 3 * room * sizeof *v);
        if (!v) return MORPH_ERR_NOMEM;
        g->v = v;
        g->room_v = room;
    }
    if (triangles > g->room_t) {
        const size_t room = triangles + triangles / 2 + 1024;
        int *t = realloc(g->t, 3 * room * sizeof *t);
        if (!t) return MORPH_ERR_NOMEM;
        g->t = t;
        g->room_t = room;
    }
    return MORPH_OK;
}

/* The vertex's number here; placed on its first use. */
static int take_vertex(gather *g, const struct aiVector3D *from, unsigned i, const double m[12]) {
    if (g->to[i] >= 0) return g->to[i];
    double *p = g->v + 3 * (size_t)g->vertices;
    for (int k = 0; k < 3; k++)
        p[k] = m[4 * k] * (double)from[i].x + m[4 * k + 1] * (double)from[i].y +
               m[4 * k + 2] * (double)from[i].z + m[4 * k + 3];
    return g->to[i] = g->vertices++;
}

/* No wider than single precision tells, or nothing at all: doubled area (Newell) against squared length. */
static bool needle(const double *v, const int *polygon, int n) {
    double sum[3] = {0, 0, 0}, far = 0;
    for (int i = 1; i + 1 < n; i++) {
        double a[3], b[3], c[3];
        morph_sub(v + 3 * polygon[i], v + 3 * polygon[0], a);
        morph_sub(v + 3 * polygon[i + 1], v + 3 * polygon[0], b);
        morph_cross(a, b, c);
        for (int k = 0; k < 3; k++)
            sum[k] += c[k];
        far = fmax(far, fmax(morph_norm(a), morph_norm(b)));
    }
    return morph_norm(sum) <= 4e-6 * far * far;
}

/* One polygon into triangles. A fan where ear clipping has nothing to clip (mending takes triangles without
 * area away) or cannot (a polygon that crosses itself). */
static void add_polygon(gather *g, int n, bool mirrored) {
    bool fan = n == 3;
    if (!fan && !morph_triangulate(g->v, g->polygon, n, g->cut)) {
        fan = true;
        g->crossing += !needle(g->v, g->polygon, n);
    }
    for (int i = 0; i < n - 2; i++) {
        int *t = g->t + 3 * (size_t)g->triangles++;
        for (int k = 0; k < 3; k++)
            t[k] = fan ? g->polygon[k == 0 ? 0 : i + k] : g->cut[3 * i + k];
        if (mirrored) {
            const int swap = t[1];
            t[1] = t[2];
            t[2] = swap;
        }
    }
}

/* Room for a polygon of n corners, within the limits. */
static morph_status admit(gather *g, unsigned n) {
    if (n > MORPH_IMPORT_CORNERS)
        return morph_refuse(g->sentence, "'%s' has a polygon of %u corners; at most %d are allowed",
                            g->sentence->name, n, MORPH_IMPORT_CORNERS);
    if (n - 2 > (unsigned)(MORPH_IMPORT_TRIANGLES - g->triangles))
        return morph_refuse(g->sentence, "'%s' has more than the %d triangles that are allowed",
                            g->sentence->name, MORPH_IMPORT_TRIANGLES);
    return make_room(g, (size_t)g->vertices + n, (size_t)g->triangles + n - 2);
}

static morph_status add_face(gather *g, const struct aiMesh *from, unsigned f, const double m[12],
                             bool mirrored) {
    const struct aiFace *face = from->mFaces + f;
    const unsigned n = face->mNumIndices;
    if (n < 3) return MORPH_OK; /* points and lines */
    const morph_status status = admit(g, n);
    if (status != MORPH_OK) return status;
    for (unsigned i = 0; i < n; i++) {
        const unsigned at = face->mIndices[i];
        if (at >= from->mNumVertices)
            return morph_refuse(g->sentence, "'%s' is damaged: face %u names vertex %u, and there are %u",
                                g->sentence->name, f, at, from->mNumVertices);
        g->polygon[i] = take_vertex(g, from->mVertices, at, m);
    }
    add_polygon(g, (int)n, mirrored);
    return MORPH_OK;
}

static morph_status add_mesh(gather *g, const struct aiMesh *from, const double m[12]) {
    /* Instances of meshes without faces cost nothing. */
    if (from->mNumFaces == 0 || !from->mVertices || from->mNumVertices == 0) return MORPH_OK;
    g->to = morph_alloc(from->mNumVertices, sizeof *g->to);
    if (!g->to) return MORPH_ERR_NOMEM;
    for (unsigned i = 0; i < from->mNumVertices; i++)
        g->to[i] = -1;
    /* A mirroring transform turns the faces inside out. */
    const bool mirrored = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                              m[2] * (m[4] * m[9] - m[5] * m[8]) <
                          0;
    morph_status status = MORPH_OK;
    for (unsigned f = 0; f < from->mNumFaces && status == MORPH_OK; f++)
        status = add_face(g, from, f, m, mirrored);
    free(g->to);
    g->to = NULL;
    return status;
}

static morph_status gather_scene(const struct aiScene *scene, gather *g) {
    placed *list = NULL;
    size_t nodes = 0;
    morph_status status = MORPH_OK;
    if (scene->mRootNode) status = place_nodes(scene->mRootNode, &list, &nodes);
    for (size_t i = 0; i < nodes && status == MORPH_OK; i++)
        for (unsigned k = 0; k < list[i].node->mNumMeshes && status == MORPH_OK; k++) {
            const unsigned which = list[i].node->mMeshes[k];
            if (which < scene->mNumMeshes) status = add_mesh(g, scene->mMeshes[which], list[i].m);
        }
    free(list);
    return status;
}

static morph_status gather_polygons(const morph_polygons *from, gather *g) {
    morph_status status = make_room(g, (size_t)from->vertices, 1);
    const int *corner = from->corner;
    if (status != MORPH_OK) return status;
    if (from->vertices > 0) memcpy(g->v, from->v, 3 * (size_t)from->vertices * sizeof *g->v);
    g->vertices = from->vertices;
    for (int f = 0; f < from->polygons && status == MORPH_OK; corner += from->n[f++]) {
        const int n = from->n[f];
        if (n < 3) continue;
        status = admit(g, (unsigned)n);
        if (status != MORPH_OK) break;
        memcpy(g->polygon, corner, (size_t)n * sizeof *corner);
        add_polygon(g, n, false);
    }
    return status;
}

/* ---- the whole ---- */

static const char *const ENDINGS[] = {"stl", "obj", "ply", "off", "gltf", "glb"};

/* The path's ending in lower case, or "". */
static void ending_of(const char *path, char out[8]) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    size_t n = 0;
    if (dot && strlen(dot + 1) < 8)
        for (; dot[1 + n]; n++)
            out[n] = (char)tolower((unsigned char)dot[1 + n]);
    out[n] = '\0';
}

static morph_status check_ending(const char *ending, const morph_sentence *to) {
    for (size_t i = 0; i < sizeof ENDINGS / sizeof *ENDINGS; i++)
        if (strcmp(ending, ENDINGS[i]) == 0) return MORPH_OK;
    if (strcmp(ending, "msh") == 0 || strcmp(ending, "node") == 0 || strcmp(ending, "ele") == 0)
        return morph_refuse(to,
                            "'%s' is a mesh of tetrahedra (Gmsh or TetGen), which is read for a deformable "
                            "target only; rigid targets are surface meshes: STL, OBJ, PLY, OFF or glTF",
                            to->name);
    return morph_refuse(to,
                        "'%s' is no mesh file by its ending; .stl, .obj, .ply, .off, .gltf and .glb "
                        "are read",
                        to->name);
}

/* assimp's words on one line, without its own prefixes' line breaks. */
static morph_status refuse_assimp(const morph_sentence *to) {
    char why[161];
    const char *said = aiGetErrorString();
    size_t n = 0;
    for (; said && *said && n < sizeof why - 1; said++) {
        const bool blank = isspace((unsigned char)*said) || iscntrl((unsigned char)*said);
        if (blank && (n == 0 || why[n - 1] == ' ')) continue;
        why[n++] = blank ? ' ' : *said;
    }
    why[n] = '\0';
    return morph_refuse(to, "'%s' is damaged or no mesh (%s)", to->name, n > 0 ? why : "no reason given");
}

static morph_status begin(gather *g, const morph_sentence *sentence) {
    *g = (gather){.sentence = sentence};
    g->polygon = morph_alloc(MORPH_IMPORT_CORNERS, sizeof *g->polygon);
    g->cut = morph_alloc(3 * MORPH_IMPORT_CORNERS, sizeof *g->cut);
    return g->polygon && g->cut ? MORPH_OK : MORPH_ERR_NOMEM;
}

/* Hands the triangles over, or drops them. points: the vertices that the file has, used or not. */
static morph_status finish(gather *g, morph_status status, unsigned long long points, morph_mesh *mesh,
                           int *crossing) {
    const morph_sentence *to = g->sentence;
    free(g->polygon);
    free(g->cut);
    if (status == MORPH_OK && g->triangles == 0)
        status = points > 0 ? morph_refuse(to, "'%s' holds nothing but points or lines; a target needs faces",
                                           to->name)
                            : morph_refuse(to, "'%s' is no mesh: it holds no faces", to->name);
    if (status != MORPH_OK) {
        free(g->v);
        free(g->t);
        return status;
    }
    *mesh = (morph_mesh){g->vertices, g->triangles, g->v, g->t};
    *crossing = g->crossing;
    return MORPH_OK;
}

static morph_status import_off(const char *data, size_t size, const morph_sentence *sentence,
                               morph_mesh *mesh, int *crossing) {
    morph_polygons polygons;
    gather g;
    morph_status status = morph_import_off(data, size, sentence, &polygons);
    if (status != MORPH_OK) return status;
    status = begin(&g, sentence);
    if (status == MORPH_OK) status = gather_polygons(&polygons, &g);
    const int points = polygons.vertices;
    morph_polygons_free(&polygons);
    return finish(&g, status, (unsigned long long)points, mesh, crossing);
}

static morph_status import_scene(const struct aiScene *scene, const morph_sentence *sentence,
                                 morph_mesh *mesh, int *crossing) {
    gather g;
    unsigned long long points = 0;
    morph_status status = begin(&g, sentence);
    if (status == MORPH_OK) status = gather_scene(scene, &g);
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        points += scene->mMeshes[i]->mNumVertices;
    return finish(&g, status, points, mesh, crossing);
}

static morph_status import_assimp(const char *path, const char *data, size_t size, bool others,
                                  const morph_sentence *sentence, morph_mesh *mesh, int *crossing) {
    served files = {path, data, size, others};
    struct aiFileIO io = {file_open, file_close, (char *)&files};
    const struct aiScene *scene = aiImportFileEx(path, 0, &io);
    if (!scene) return refuse_assimp(sentence);
    const morph_status status = import_scene(scene, sentence, mesh, crossing);
    aiReleaseImport(scene);
    return status;
}

morph_status morph_import_mesh(const char *path, const morph_sentence *sentence, morph_mesh *mesh,
                               int *crossing) {
    *mesh = (morph_mesh){0};
    *crossing = 0;
    char ending[8], *data = NULL;
    size_t size = 0;
    ending_of(path, ending);
    /* A missing file is named as missing, whatever its ending. */
    morph_status status = morph_import_load(path, sentence, &data, &size);
    if (status == MORPH_OK) status = check_ending(ending, sentence);
    if (status == MORPH_OK) status = morph_import_claims(ending, data, &size, sentence);
    if (status == MORPH_OK) {
        if (strcmp(ending, "off") == 0)
            status = import_off(data, size, sentence, mesh, crossing);
        else
            status = import_assimp(path, data, size, strcmp(ending, "gltf") == 0, sentence, mesh, crossing);
    }
    free(data);
    return status;
}
