/* What is refused: one sentence each, within a second, without the memory that a false header claims. */
#include "planner/import.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64];

static char *path_of(const char *name) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static long peak_kib(void) {
    struct rusage use;
    getrusage(RUSAGE_SELF, &use);
    return use.ru_maxrss;
}

/* The file must be refused with a sentence that holds `because`. Removes it. */
static void refused(const char *name, morph_shape shape, const char *because) {
    char path[256], message[300], warning[300];
    snprintf(path, sizeof path, "%s", path_of(name));
    const morph_target_def def = {
        .shape = shape, .file = path, .file_as_written = (char *)name, .cell = 1, .scale = 1};
    morph_mesh mesh;
    morph_mesh_report report;
    const long before = peak_kib();
    const clock_t start = clock();
    const morph_status status =
        morph_target_build(&def, 0.1, &mesh, &report, message, sizeof message, warning, sizeof warning);
    remove(path);
    if (status != MORPH_ERR_INPUT || !strstr(message, because))
        print_error("%s: %s: \"%s\" instead of \"%s\"\n", name, morph_status_text(status), message, because);
    assert_int_equal(status, MORPH_ERR_INPUT);
    assert_non_null(strstr(message, because));
    assert_null(strchr(message, '\n'));
    assert_true(strlen(message) > 10);
    assert_string_equal(warning, "");
    assert_null(mesh.v);
    assert_null(mesh.t);
    /* Of processor time: other programs on the machine do not count. */
    assert_true((double)(clock() - start) / CLOCKS_PER_SEC < 1);
    assert_true(peak_kib() - before < 200000);
}

static void bytes_refused(const char *name, const void *bytes, size_t size, const char *because) {
    FILE *f = fopen(path_of(name), "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    refused(name, MORPH_SHAPE_MESH, because);
}

static void text_refused(const char *name, const char *text, const char *because) {
    bytes_refused(name, text, strlen(text), because);
}

static void table_refused(const char *text, const char *because) {
    FILE *f = fopen(path_of("table.csv"), "wb");
    assert_non_null(f);
    assert_true(fputs(text, f) >= 0);
    assert_int_equal(fclose(f), 0);
    refused("table.csv", MORPH_SHAPE_HEIGHTMAP, because);
}

static void not_a_file(void **state) {
    (void)state;
    refused("missing.obj", MORPH_SHAPE_MESH, "'missing.obj' does not exist");
    refused("missing.csv", MORPH_SHAPE_HEIGHTMAP, "'missing.csv' does not exist");
    assert_int_equal(mkdir(path_of("folder.obj"), 0700), 0);
    refused("folder.obj", MORPH_SHAPE_MESH, "is a directory");
    /* A pipe that nobody writes to must not hang the program. */
    assert_int_equal(mkfifo(path_of("pipe.stl"), 0600), 0);
    refused("pipe.stl", MORPH_SHAPE_MESH, "not a regular file");
    /* A sparse file beyond the limit. */
    const int f = open(path_of("huge.stl"), O_CREAT | O_WRONLY, 0600);
    assert_true(f >= 0);
    assert_int_equal(ftruncate(f, (off_t)600 << 20), 0);
    close(f);
    refused("huge.stl", MORPH_SHAPE_MESH, "at most 512 MiB");
}

static void empty_and_text_files(void **state) {
    (void)state;
    const char *endings[] = {"stl", "obj", "ply", "off", "gltf", "glb"};
    const char *prose =
        "This is a letter, not a mesh.\nIt has several lines of text, and some more, so that it "
        "is longer than the header of a binary file.\n";
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        char name[32];
        snprintf(name, sizeof name, "a.%s", endings[i]);
        bytes_refused(name, "", 0, "is empty");
        text_refused(name, prose, "'a.");
        text_refused(name, "x", "'a.");
        text_refused(name, "\n\n", "'a.");
    }
    text_refused("a.txt", prose, "no mesh file by its ending");
    text_refused("mesh", prose, "no mesh file by its ending");
    text_refused("torus.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "Gmsh");
    text_refused("facet.stl",
                 "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"
                 "endsolid s\n",
                 "has 2 vertices, not 3");
    text_refused("word.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 zero 0\n", "line 4");
    text_refused(
        "cut.stl",
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
        "endfacet\n",
        "'endsolid' is missing");
    text_refused("solid.stl", "solid but then nothing\n", "'solid.stl'");
}

static void false_stl_headers(void **state) {
    (void)state;
    unsigned char bytes[84 + 50 * 4] = {0};
    bytes[80] = 5; /* five claimed, four there */
    bytes_refused("cut.stl", bytes, sizeof bytes, "truncated");
    bytes_refused("short.stl", bytes, 60, "at least 84 bytes");
    /* 1e9 */
    bytes[80] = 0x00;
    bytes[81] = 0xca;
    bytes[82] = 0x9a;
    bytes[83] = 0x3b;
    bytes_refused("claims.stl", bytes, sizeof bytes, "claims 1000000000 triangles");
    memset(bytes, 0, 84);
    bytes_refused("none.stl", bytes, 84, "'none.stl'");
    /* Four triangles, all in one point. */
    bytes[80] = 4;
    bytes_refused("point.stl", bytes, sizeof bytes, "no area");
}

static void false_ply_headers(void **state) {
    (void)state;
    const char *xyz = "property float x\nproperty float y\nproperty float z\n";
    const char *kinds[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    char text[1024];
    for (int i = 0; i < 3; i++) {
        snprintf(text, sizeof text, "ply\nformat %s 1.0\nelement vertex 1000000000\n%send_header\n0 0 0\n",
                 kinds[i], xyz);
        text_refused("vertices.ply", text, "claims more");
        snprintf(text, sizeof text,
                 "ply\nformat %s 1.0\nelement vertex 0\n%selement face 1000000000\n"
                 "property list uchar int vertex_indices\nend_header\n",
                 kinds[i], xyz);
        text_refused("faces.ply", text, "claims more");
        snprintf(text, sizeof text,
                 "ply\nformat %s 1.0\nelement vertex 99999999999999999999999\n%send_header\n", kinds[i], xyz);
        text_refused("overflow.ply", text, "claims more");
    }
    /* A list that claims 4e9 entries, in binary and in text. */
    const char *face = "element face 1\nproperty list uint int vertex_indices\nend_header\n";
    snprintf(text, sizeof text, "ply\nformat binary_little_endian 1.0\n%s\xff\xff\xff\xee   ", face);
    text_refused("list.ply", text, "claims more");
    snprintf(text, sizeof text, "ply\nformat ascii 1.0\n%s4000000000 1 2 3\n", face);
    text_refused("list.ply", text, "claims more");
    text_refused("format.ply", "ply\nelement vertex 3\nend_header\n", "header is damaged");
    text_refused("type.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n1\n",
                 "damaged at line 4");
    text_refused("endless.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n", "damaged");
    text_refused(
        "index.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
        "'index.ply'");
}

static void false_off_headers(void **state) {
    (void)state;
    text_refused("a.off", "OFF\n1000000000 1 0\n0 0 0\n", "claims 1000000000 vertices");
    text_refused("b.off", "OFF\n3 1000000000 0\n0 0 0\n1 0 0\n0 1 0\n", "1000000000 faces");
    text_refused("c.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends after 4 of these lines");
    text_refused("d.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", "face 0 is no count");
    text_refused("g.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "face 0 is no count");
    text_refused("e.off", "OFF BINARY\n3 1 0\n", "binary OFF");
    text_refused("f.off", "OFF\nvertices\n", "no counts");
}

static void false_gltf(void **state) {
    (void)state;
    text_refused(
        "a.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"buffers\":[{\"uri\":\"data:application/octet-stream;base64,AAAA\",\"byteLength\":3}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":12000000000}],\"accessors\":[{\"bufferView\":0,"
        "\"componentType\":5126,\"count\":1000000000,\"type\":\"VEC3\"}]}",
        "'a.gltf'");
    text_refused(
        "b.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"uri\":\"missing.bin\",\"byteLength\":12}]}",
        "'b.gltf'");
    text_refused("cycle.gltf",
                 "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
                 "\"nodes\":[{\"children\":[1]},{\"children\":[0]}]}",
                 "form no trees");
    text_refused("one.gltf", "{\"asset\":{\"version\":\"1.0\"}}", "version 2");
    text_refused("sparse.gltf",
                 "{\"asset\":{\"version\":\"2.0\"},\"accessors\":[{\"componentType\":5126,"
                 "\"count\":1000000000,\"type\":\"VEC3\"}]}",
                 "claim more");
    bytes_refused("d.glb", "glTF\2\0\0\0\xff\xff\xff\x7f\2\0\0\0JSON{}", 22, "claims 2147483647 bytes");
    bytes_refused("c.glb", "glTF\2\0\0\0\xff\xff\xff\x7f\xff\xff\xff\x7fJSON{}", 22, "'c.glb'");
}

static void points_lines_and_nothing(void **state) {
    (void)state;
    text_refused("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "'points.obj'");
    text_refused("lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n", "nothing but points");
    text_refused("points.ply",
                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                 "property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n",
                 "nothing but points");
    text_refused("points.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "nothing but points");
    text_refused("needle.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no area");
    text_refused("fold.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", "encloses no volume");
}

static void numbers_that_are_none(void **state) {
    (void)state;
    text_refused("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
                 "'nan.obj'");
    text_refused("inf.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 inf 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n",
                 "no finite number");
    unsigned char bytes[84 + 50] = {0};
    const float nan = NAN;
    bytes[80] = 1;
    memcpy(bytes + 84 + 24, &nan, 4);
    bytes_refused("nan.stl", bytes, sizeof bytes, "no finite number");
}

static void surfaces_that_are_no_solid(void **state) {
    (void)state;
    text_refused("fin.obj",
                 "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\n"
                 "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 2 5\n",
                 "1 edge with more than two faces");
    /* A band of five squares with half a twist. */
    char text[2048];
    size_t n = 0;
    for (int i = 0; i < 10; i++)
        for (int s = -1; s < 2; s += 2) {
            const double a = 2 * M_PI * i / 10, w = 0.3 * s;
            n += (size_t)snprintf(text + n, sizeof text - n, "v %.9f %.9f %.9f\n",
                                  (1 + w * cos(a / 2)) * cos(a), (1 + w * cos(a / 2)) * sin(a),
                                  w * sin(a / 2));
        }
    for (int i = 0; i < 10; i++) {
        const int last = i == 9, a = 2 * i + 1, b = 2 * i + 2;
        n += (size_t)snprintf(text + n, sizeof text - n, "f %d %d %d\nf %d %d %d\n", a, last ? 2 : a + 2,
                              last ? 1 : b + 2, a, last ? 1 : b + 2, b);
    }
    text_refused("moebius.obj", text, "cannot be oriented");
}

static void tables_of_heights(void **state) {
    (void)state;
    table_refused("1,2,3\n4,5\n", "line 2 has 2 numbers where the rows before have 3");
    table_refused("a,b\n1,2\n3,4,5\n", "line 3 has 3 numbers");
    table_refused("1,2\n3,x\n", "line 2, field 2: 'x'");
    table_refused("1,2\n3,\n", "line 2, field 2: ''");
    table_refused("1,2\nnan,4\n", "line 2, field 1: 'nan'");
    table_refused("1,2\ninf,4\n", "line 2, field 1: 'inf'");
    table_refused("1,2\n3,1e999\n", "line 2, field 2: '1e999'");
    table_refused("1,2\n3,0x10\n", "line 2, field 2: '0x10'");
    table_refused("1,2\n3,4 5\n", "line 2, field 2: '4 5'");
    table_refused("a,b\n", "0 rows");
    table_refused("1,2,3\n", "at least 2 of 2");
    table_refused("1\n2\n3\n", "at least 2 of 2");
    table_refused("", "is empty");
    table_refused("A letter.\nIt has words.\n", "line 2, field 1");
}

static void bad_definitions(void **state) {
    (void)state;
    const morph_target_def fine = {.shape = MORPH_SHAPE_BOX, .size = {1, 1, 1}, .scale = 1};
    morph_target_def defs[9];
    for (int i = 0; i < 9; i++)
        defs[i] = fine;
    defs[0].size[1] = -1;
    defs[1].scale = 0;
    defs[2].scale = NAN;
    defs[3].has_fit = true;
    defs[4].at[0] = INFINITY;
    defs[5].rotate[2] = NAN;
    defs[6].shape = MORPH_SHAPE_TORUS;
    defs[6].radius = defs[6].tube = 1;
    defs[7].shape = MORPH_SHAPE_CAPSULE;
    defs[7].radius = defs[7].height = 1;
    defs[8].shape = MORPH_SHAPE_MESH;
    for (int i = 0; i < 9; i++) {
        char message[300];
        morph_mesh mesh;
        morph_mesh_report report;
        assert_int_equal(morph_target_build(defs + i, 0.1, &mesh, &report, message, sizeof message, NULL, 0),
                         MORPH_ERR_INPUT);
        assert_true(strlen(message) > 10);
        assert_null(mesh.v);
        /* Without anybody to tell. */
        assert_int_equal(morph_target_build(defs + i, 0.1, &mesh, &report, NULL, 0, NULL, 0),
                         MORPH_ERR_INPUT);
    }
}

/* Every cut of a sound file is refused or read; nothing else may happen (sanitizers watch). */
static void cut_files(void **state) {
    (void)state;
    const char *texts[][2] = {
        {"cut.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"},
        {"cut.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"},
        {"cut.stl",
         "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
         "endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\n"
         "endfacet\nendsolid s\n"},
        {"cut.ply",
         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
         "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"}};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        for (size_t n = strlen(texts[i][1]) - 1; n > 0; n--) {
            char path[256], message[300];
            snprintf(path, sizeof path, "%s", path_of(texts[i][0]));
            FILE *f = fopen(path, "wb");
            assert_non_null(f);
            assert_int_equal(fwrite(texts[i][1], 1, n, f), n);
            assert_int_equal(fclose(f), 0);
            const morph_target_def def = {.shape = MORPH_SHAPE_MESH, .file = path, .scale = 1};
            morph_mesh mesh;
            morph_mesh_report report;
            const morph_status status =
                morph_target_build(&def, 0.1, &mesh, &report, message, sizeof message, NULL, 0);
            assert_true(status == MORPH_OK || status == MORPH_ERR_INPUT);
            if (status == MORPH_ERR_INPUT) assert_true(strlen(message) > 10);
            morph_mesh_free(&mesh);
            remove(path);
        }
}

static int setup(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/morph_import_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int teardown(void **state) {
    (void)state;
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(not_a_file),
        cmocka_unit_test(empty_and_text_files),
        cmocka_unit_test(false_stl_headers),
        cmocka_unit_test(false_ply_headers),
        cmocka_unit_test(false_off_headers),
        cmocka_unit_test(false_gltf),
        cmocka_unit_test(points_lines_and_nothing),
        cmocka_unit_test(numbers_that_are_none),
        cmocka_unit_test(surfaces_that_are_no_solid),
        cmocka_unit_test(tables_of_heights),
        cmocka_unit_test(bad_definitions),
        cmocka_unit_test(cut_files),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
