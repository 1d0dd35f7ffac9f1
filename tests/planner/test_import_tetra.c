/* Tetrahedral meshes from files: what is read, and what is refused by one sentence. */
#include "planner/import_tetra.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64];

static const char *write_file(const char *name, const char *text, size_t size) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(text, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    return path;
}

static morph_status read_text(const char *name, const char *text, size_t size, morph_tetra *m,
                              morph_tetra_report *r, char message[300]) {
    return morph_import_tetra(write_file(name, text, size), name, m, r, message, 300);
}

/* Two tetrahedra on the triangle 10 20 30; the second is given inside out, vertex 7 is of none. */
#define FORMAT_2 "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
#define NODES_2 "$Nodes\n6\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n7 9 9 9\n50 0.2 0.2 -1.5e0\n$EndNodes\n"
#define ELEMENTS_2                                                                                           \
    "$Elements\n4\n1 15 2 0 1 10\n2 2 2 0 1 10 20 30\n3 4 2 0 1 10 20 30 40\n4 4 0 10 20 30 "                \
    "50\n$EndElements\n"
#define FORMAT_4 "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
#define NODES_4                                                                                              \
    "$Nodes\n2 6 7 50\n2 1 1 3\n10\n20\n30\n0 0 0 0.5 0.5\n1 0 0 1 1\n0 1 0 2 2\n"                           \
    "3 1 0 3\n40\n7\n50\n0 0 1\n9 9 9\n0.2 0.2 -1.5\n$EndNodes\n"
#define ELEMENTS_4                                                                                           \
    "$Elements\n3 4 1 4\n0 1 15 1\n1 10\n2 1 2 1\n2 10 20 30\n3 1 4 2\n3 10 20 30 40\n4 10 20 30 "           \
    "50\n$EndElements\n"
#define NODE                                                                                                 \
    "# made by hand\n5 3 1 0\n\n  1 0 0 0 5\n2 1 0 0 5 # here\n3 0 1 0 5\n4 0 0 1 5\n5 0.2 0.2 -1.5 5\n# "   \
    "end\n"
#define ELE "2 4 1\n1 1 2 3 4 77\n2 1 2 3 5 78\n"

static void assert_two(const morph_tetra *m, const morph_tetra_report *r, int unused) {
    assert_int_equal(m->vertices, 5);
    assert_int_equal(m->tets, 2);
    assert_int_equal(m->triangles, 6);
    assert_int_equal(r->flipped, 1);
    assert_int_equal(r->unused, unused);
    assert_true(fabs(r->volume - 1.0 / 6 - 0.25) < 1e-15);
    assert_true(m->v[3 * 4 + 2] == -1.5);
}

static void test_read(void **state) {
    (void)state;
    static const char *const msh[] = {
        FORMAT_2 NODES_2 ELEMENTS_2, FORMAT_4 NODES_4 ELEMENTS_4,
        /* The order of sections is free, unknown ones are passed over, lines may end as on Windows. */
        FORMAT_4 "$Surface\n2 1 11\n$ 5\n$EndSurfaces\n$EndSurface\n" ELEMENTS_4 "\n\n" NODES_4,
        "$MeshFormat\r\n2.1 0 8\r\n$EndMeshFormat\r\n$Comments\r\nx\r\n$EndComments\r\n" NODES_2 ELEMENTS_2};
    morph_tetra m;
    morph_tetra_report r;
    char message[300];
    for (size_t k = 0; k < sizeof msh / sizeof *msh; k++) {
        if (read_text("two.msh", msh[k], strlen(msh[k]), &m, &r, message) != MORPH_OK)
            print_error("%zu: %s\n", k, message);
        assert_string_equal(message, "");
        assert_two(&m, &r, 1);
        morph_tetra_free(&m);
    }
    /* TetGen: either file may be named; numbers from 1 and from 0. */
    write_file("two.node", NODE, strlen(NODE));
    assert_int_equal(read_text("two.ele", ELE, strlen(ELE), &m, &r, message), MORPH_OK);
    assert_two(&m, &r, 0);
    morph_tetra_free(&m);
    const char *zero_ele = "2 10\n0 0 1 2 3 9 9 9 9 9 9\n1 0 1 2 4 9 9 9 9 9 9";
    const char *zero_node = "5\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 0.2 0.2 -1.5";
    write_file("ZERO.ELE", zero_ele, strlen(zero_ele));
    assert_int_equal(read_text("ZERO.NODE", zero_node, strlen(zero_node), &m, &r, message), MORPH_OK);
    assert_two(&m, &r, 0);
    morph_tetra_free(&m);
}

static void refused(const char *name, const char *text, size_t size, const char *because) {
    morph_tetra m;
    morph_tetra_report r;
    char message[300];
    const morph_status status = read_text(name, text, size, &m, &r, message);
    if (status != MORPH_ERR_INPUT || !strstr(message, because))
        print_error("%s: %s: \"%s\" instead of \"%s\"\n", name, morph_status_text(status), message, because);
    assert_int_equal(status, MORPH_ERR_INPUT);
    assert_non_null(strstr(message, because));
    assert_null(strchr(message, '\n'));
    assert_null(m.v);
    assert_null(m.tet);
}

static void msh_refused(const char *text, const char *because) {
    refused("bad.msh", text, strlen(text), because);
}

static void test_msh_refused(void **state) {
    (void)state;
    msh_refused("", "empty");
    msh_refused("solid thing\n", "begins with $MeshFormat");
    msh_refused("$NOD\n3\n1 0 0 0\n$ENDNOD\n", "begins with $MeshFormat");
    msh_refused("$MeshFormat\n2.2 1 8\n\1\0\0\0", "binary");
    msh_refused("$MeshFormat\n4.1 1 8\n\1\0\0\0\n$EndMeshFormat\n", "binary");
    msh_refused("$MeshFormat\n4 0 8\n$EndMeshFormat\n" NODES_4, "version 4; versions 2.0 to 2.2 and 4.1");
    msh_refused("$MeshFormat\n1e9 0 8\n$EndMeshFormat\n", "versions 2.0 to 2.2");
    msh_refused("$MeshFormat\nnan 0 8\n$EndMeshFormat\n", "versions 2.0 to 2.2");
    msh_refused("$MeshFormat\n2.2 0\n$EndMeshFormat\n", "must say version");
    msh_refused(FORMAT_2 NODES_2, "no section $Elements");
    msh_refused(FORMAT_4 ELEMENTS_4, "no section $Nodes");
    msh_refused(FORMAT_2 NODES_2 NODES_2 ELEMENTS_2, "two sections $Nodes");
    msh_refused(FORMAT_2 NODES_2 ELEMENTS_2 "$Extra\n1 2 3\n", "$Extra has no end");
    msh_refused(FORMAT_2 "rubbish\n" NODES_2 ELEMENTS_2, "'$' begins");
    msh_refused(FORMAT_2 "$Nodes\n1000000000\n1 0 0 0\n$EndNodes\n", "claims 1000000000 vertices");
    msh_refused(FORMAT_2 "$Nodes\n99999999999999999999\n$EndNodes\n", "whole number");
    msh_refused(FORMAT_2 "$Nodes\n-1\n$EndNodes\n", "whole number from 0");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1000000000\n1 4 0 10 20 30 40\n", "claims 1000000000 elements");
    msh_refused(FORMAT_4 "$Nodes\n1 1000000000 1 1000000000\n", "claims 1000000000 vertices");
    msh_refused(FORMAT_4 "$Nodes\n1 3 1 3\n3 1 0 9\n1\n2\n3\n0 0 0\n0 0 0\n0 0 0\n", "more vertices than");
    msh_refused(FORMAT_4 "$Nodes\n1 3 1 3\n3 1 0 1\n1\n0 0 0\n$EndNodes\n", "fewer vertices than");
    msh_refused(FORMAT_2 "$Nodes\n2\n1 0 0 nan\n2 0 0 0\n$EndNodes\n", "vertex 1 must have three finite");
    msh_refused(FORMAT_2 "$Nodes\n2\n1 0 0 0\n2 0 inf 0\n$EndNodes\n", "vertex 2 must have three finite");
    msh_refused(FORMAT_2 "$Nodes\n2\n1 0 0 0\n2 0 x 0\n$EndNodes\n", "vertex 2 must have three finite");
    msh_refused(FORMAT_2 "$Nodes\n2\n1 0 0 0\n1 1 0 0\n$EndNodes\n" ELEMENTS_2,
                "two vertices have the number 1");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1\n1 4 0 10 20 30 41\n$EndElements\n", "names vertex 41");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1\n1 4 0 10 20 30 30\n$EndElements\n", "four different");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1\n1 4 0 10 20 30\n$EndElements\n", "element 1");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1\n1 5 0 10 20 30 40 7 50 10 20\n$EndElements\n",
                "has hexahedra");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1\n1 2 0 10 20 30\n$EndElements\n", "no tetrahedra");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n1\n1 4 5000000 10 20 30 40\n$EndElements\n", "element 1");
    msh_refused(FORMAT_2
                "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n$EndNodes\n"
                "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n",
                "tetrahedron 1 has no volume");
    msh_refused(FORMAT_2 NODES_2 "$Elements\n2\n1 4 0 10 20 30 40\n2 4 0 10 20 40 30\n$EndElements\n",
                "overlap");
    msh_refused(FORMAT_2 NODES_2
                "$Elements\n3\n1 4 0 10 20 30 40\n2 4 0 10 20 30 50\n3 4 0 10 20 30 7\n"
                "$EndElements\n",
                "share a face with a third");
    refused("bad.obj", "v 0 0 0\n", 8, ".msh, .node and .ele are read");
    morph_tetra m;
    morph_tetra_report r;
    char message[300];
    assert_int_equal(morph_import_tetra("/nowhere/x.msh", "x.msh", &m, &r, message, sizeof message),
                     MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "does not exist"));
}

static void pair_refused(const char *node, const char *ele, const char *because) {
    write_file("bad.node", node, strlen(node));
    refused("bad.ele", ele, strlen(ele), because);
}

static void test_tetgen_refused(void **state) {
    (void)state;
    pair_refused("", ELE, "empty");
    pair_refused("x\n", ELE, "number of vertices");
    pair_refused("2 2 0 0\n1 0 0 0\n2 0 0 0\n", ELE, "three dimensions");
    pair_refused("1000000000 3 0 0\n1 0 0 0\n", ELE, "'bad.node' is truncated: it claims 1000000000");
    pair_refused("0 3 0 0\n", ELE, "no vertices");
    pair_refused("2 3\n1 0 0 0\n", ELE, "truncated");
    pair_refused("2 3\n1 0 0 0\n3 0 0 0\n", ELE, "2 is missing");
    pair_refused("2 3\n2 0 0 0\n3 0 0 0\n", ELE, "from 0 or from 1");
    pair_refused("2 3\n1 0 0 0\n2 0 nan 0\n", ELE, "vertex 2 must have");
    pair_refused(NODE, "", "empty");
    pair_refused(NODE, "1000000000 4 0\n1 1 2 3 4\n", "'bad.ele' is truncated");
    pair_refused(NODE, "2 5 0\n1 1 2 3 4 5\n", "4 or 10");
    pair_refused(NODE, "2 4 0\n1 1 2 3 4\n", "ends after 1");
    pair_refused(NODE, "1 4 0\n1 1 2 3 6\n", "from 1 to 5");
    pair_refused(NODE, "1 4 0\n1 0 1 2 3\n", "from 1 to 5");
    pair_refused(NODE, "1 4 0\n1 1 2 3\n", "four vertices");
    pair_refused(NODE, "0 4 0\n  \n", "no tetrahedra");
    pair_refused(NODE, "1 4 0\n1 1 2 3 3\n", "four different");
    write_file("bad.node", NODE, strlen(NODE));
    refused("bad.ele", "1 4 0\n\0 1 2 3 4\n", 15, "zero bytes");
    char path[256];
    snprintf(path, sizeof path, "%s/bad.node", folder);
    assert_int_equal(remove(path), 0);
    refused("bad.ele", ELE, strlen(ELE), "'bad.node' does not exist");
}

/* Every cut and many a changed byte of good files: read or refused by a sentence, never anything else. */
static void test_damaged(void **state) {
    (void)state;
    static const char *const good[] = {FORMAT_2 NODES_2 ELEMENTS_2, FORMAT_4 NODES_4 ELEMENTS_4, ELE};
    static const char *const name[] = {"cut.msh", "cut.msh", "cut.ele"};
    write_file("cut.node", NODE, strlen(NODE));
    uint64_t seed = 7;
    int refusals = 0;
    for (int k = 0; k < 3; k++)
        for (size_t round = 0; round < 3 * strlen(good[k]); round++) {
            char text[1024], message[300];
            size_t size = strlen(good[k]);
            morph_tetra m;
            morph_tetra_report r;
            memcpy(text, good[k], size);
            if (round < size)
                size = round;
            else {
                seed = seed * 6364136223846793005u + 1442695040888963407u;
                text[(seed >> 33) % size] = "0123456789-.e \n$#\0x"[(seed >> 20) % 19];
            }
            const morph_status status = read_text(name[k], text, size, &m, &r, message);
            assert_true(status == MORPH_OK || status == MORPH_ERR_INPUT);
            assert_true((status == MORPH_OK) == (message[0] == '\0'));
            assert_true((status == MORPH_OK) == (m.tets > 0));
            refusals += status != MORPH_OK;
            morph_tetra_free(&m);
        }
    assert_true(refusals > 500);
}

static void test_torus(void **state) {
    (void)state;
    const char *path = MORPH_SHARED_DIR "/models/ipc_torus_tet.msh";
    morph_tetra m;
    morph_tetra_report r;
    char message[300];
    if (access(path, R_OK) != 0) {
        print_message("%s is not here: skipped\n", path);
        skip();
    }
    assert_int_equal(morph_import_tetra(path, "torus", &m, &r, message, sizeof message), MORPH_OK);
    assert_int_equal(m.vertices, 200);
    assert_int_equal(m.tets, 491);
    assert_int_equal(m.triangles, 400);
    assert_int_equal(r.unused, 0);
    print_message("torus: %d turned, volume %g, quality %.3f least %.3f mean\n", r.flipped, r.volume,
                  r.least_quality, r.mean_quality);
    assert_int_equal(r.flipped, 0);
    /* Genus 1: vertices - edges + triangles = 0. */
    assert_int_equal(m.surface_vertices - m.triangles / 2, 0);
    morph_tetra_free(&m);
}

static int make_folder(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/morph_tetra_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    static const char *const names[] = {"two.msh",  "two.node", "two.ele",  "ZERO.NODE",
                                        "ZERO.ELE", "bad.msh",  "bad.node", "bad.ele",
                                        "bad.obj",  "cut.msh",  "cut.node", "cut.ele"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, names[k]);
        (void)remove(path);
    }
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_read), cmocka_unit_test(test_msh_refused),
                                       cmocka_unit_test(test_tetgen_refused), cmocka_unit_test(test_damaged),
                                       cmocka_unit_test(test_torus)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
