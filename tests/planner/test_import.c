/* Targets in: formats, polygons, transforms, real meshes. */
#include "planner/import.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#define assert_near(a, b, margin) assert_true(fabs((a) - (b)) <= (margin))

static char folder[64];

static char *path_of(const char *name) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static char *write_file(const char *name, const void *bytes, size_t size) {
    char *path = path_of(name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    return path;
}

static char *write_text(const char *name, const char *text) {
    return write_file(name, text, strlen(text));
}

static morph_target_def mesh_def(char *path) {
    return (morph_target_def){.shape = MORPH_SHAPE_MESH, .file = path, .cell = 1, .scale = 1};
}

typedef struct built {
    morph_mesh mesh;
    morph_mesh_report report;
    char message[300], warning[300];
} built;

static morph_status build(const morph_target_def *def, built *b) {
    return morph_target_build(def, 0.1, &b->mesh, &b->report, b->message, sizeof b->message, b->warning,
                              sizeof b->warning);
}

/* Builds what must succeed. */
static built good(const morph_target_def *def) {
    built b;
    const morph_status status = build(def, &b);
    if (status != MORPH_OK) print_error("%s\n", b.message);
    assert_int_equal(status, MORPH_OK);
    assert_string_equal(b.message, "");
    /* The report is that of the mesh handed out. */
    morph_mesh_report r;
    assert_int_equal(morph_mesh_examine(&b.mesh, &r), MORPH_OK);
    assert_int_equal(r.vertices, b.report.vertices);
    assert_int_equal(r.triangles, b.report.triangles);
    assert_int_equal(r.closed, b.report.closed);
    assert_int_equal(r.self_intersections, b.report.self_intersections);
    assert_near(r.area, b.report.area, 1e-9 * r.area);
    if (r.closed) assert_near(r.volume, b.report.volume, 1e-9 * fabs(r.volume));
    for (int k = 0; k < 3; k++) {
        assert_near(r.lo[k], b.report.lo[k], 0);
        assert_near(r.hi[k], b.report.hi[k], 0);
    }
    return b;
}

/* ---- one cube, many formats ---- */

/* A cube of side 2 around (1, 1, 1), quadrilaterals, outward. */
static const int CUBE[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                               {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};

static float corner(int i, int k) {
    return (i >> k) % 2 ? 2.0F : 0.0F;
}

static void assert_cube(char *path, double scale) {
    const morph_target_def def = mesh_def(path);
    built b = good(&def);
    assert_true(b.report.closed);
    assert_int_equal(b.report.vertices, 8);
    assert_int_equal(b.report.triangles, 12);
    assert_near(b.report.volume, 8 * scale * scale * scale, 1e-6);
    assert_near(b.report.area, 24 * scale * scale, 1e-6);
    assert_string_equal(b.warning, "");
    for (int k = 0; k < 3; k++)
        assert_near(b.report.hi[k], scale, 1e-6);
    morph_mesh_free(&b.mesh);
}

static size_t cube_text(char *text, size_t size, const char *kind) {
    size_t n = 0;
    const bool stl = strcmp(kind, "stl") == 0, obj = strcmp(kind, "obj") == 0;
    if (stl) n += (size_t)snprintf(text + n, size - n, "solid cube\n");
    if (strcmp(kind, "off") == 0) n += (size_t)snprintf(text + n, size - n, "OFF\n# a cube\n8 6 12\n");
    if (strcmp(kind, "ply") == 0)
        n += (size_t)snprintf(text + n, size - n,
                              "ply\nformat ascii 1.0\ncomment a cube\nelement vertex 8\nproperty float x\n"
                              "property float y\nproperty float z\nelement face 6\n"
                              "property list uchar int vertex_indices\nend_header\n");
    for (int i = 0; i < 8 && !stl; i++)
        n += (size_t)snprintf(text + n, size - n, "%s%g %g %g\n", obj ? "v " : "", (double)corner(i, 0),
                              (double)corner(i, 1), (double)corner(i, 2));
    for (int f = 0; f < 6; f++) {
        const int *c = CUBE[f], o = obj ? 1 : 0;
        if (!stl)
            n += (size_t)snprintf(text + n, size - n, "%s %d %d %d %d\n", obj ? "f" : "4", c[0] + o, c[1] + o,
                                  c[2] + o, c[3] + o);
        for (int h = 0; h < 2 && stl; h++) {
            n += (size_t)snprintf(text + n, size - n, "facet normal 0 0 0\nouter loop\n");
            for (int k = 0; k < 3; k++) {
                const int i = c[k == 0 ? 0 : h + k];
                n += (size_t)snprintf(text + n, size - n, "vertex %g %g %g\n", (double)corner(i, 0),
                                      (double)corner(i, 1), (double)corner(i, 2));
            }
            n += (size_t)snprintf(text + n, size - n, "endloop\nendfacet\n");
        }
    }
    if (stl) n += (size_t)snprintf(text + n, size - n, "endsolid cube\n");
    assert_true(n < size);
    return n;
}

static size_t cube_stl(unsigned char *bytes) {
    memset(bytes, 0, 84 + 600);
    memcpy(bytes, "solid in name only", 18); /* as some programs write it */
    bytes[80] = 12;
    size_t n = 84;
    for (int f = 0; f < 6; f++)
        for (int h = 0; h < 2; h++, n += 50)
            for (int k = 0; k < 3; k++)
                for (int x = 0; x < 3; x++) {
                    const float value = corner(CUBE[f][k == 0 ? 0 : h + k], x);
                    memcpy(bytes + n + 12 + 12 * k + 4 * x, &value, 4); /* little-endian machine */
                }
    return n;
}

static void text_formats(void **state) {
    (void)state;
    const char *kinds[] = {"stl", "obj", "ply", "off"};
    for (int i = 0; i < 4; i++) {
        char text[8192], name[32];
        cube_text(text, sizeof text, kinds[i]);
        snprintf(name, sizeof name, "cube.%s", kinds[i]);
        assert_cube(write_text(name, text), 1);
    }
    /* Endings in capitals; a comment line longer than a buffer might be. */
    char text[16384];
    cube_text(text, sizeof text, "obj");
    assert_cube(write_text("CUBE.OBJ", text), 1);
}

static void binary_formats(void **state) {
    (void)state;
    unsigned char bytes[1024];
    size_t n = cube_stl(bytes);
    assert_cube(write_file("binary.stl", bytes, n), 1);
    /* Something behind the last triangle does not matter. */
    assert_cube(write_file("tail.stl", bytes, n + 17), 1);
    const char *head =
        "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\n"
        "property float y\nproperty float z\nelement face 6\n"
        "property list uchar int vertex_indices\nend_header\n";
    n = strlen(head);
    memcpy(bytes, head, n);
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++, n += 4) {
            const float value = corner(i, k);
            memcpy(bytes + n, &value, 4);
        }
    for (int f = 0; f < 6; f++) {
        bytes[n++] = 4;
        memcpy(bytes + n, CUBE[f], 16);
        n += 16;
    }
    assert_cube(write_file("binary.ply", bytes, n), 1);
}

/* glTF with its buffer in a file beside it, and a node tree that scales by 2, then mirrors. */
static void gltf_nodes_are_applied(void **state) {
    (void)state;
    unsigned char buffer[36 * 2 + 8 * 12];
    size_t n = 0;
    for (int f = 0; f < 6; f++)
        for (int h = 0; h < 2; h++)
            for (int k = 0; k < 3; k++, n += 2) {
                const uint16_t at = (uint16_t)CUBE[f][k == 0 ? 0 : h + k];
                memcpy(buffer + n, &at, 2);
            }
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++, n += 4) {
            const float value = corner(i, k);
            memcpy(buffer + n, &value, 4);
        }
    write_file("cube.bin", buffer, n);
    assert_cube(write_text("cube.gltf",
                           "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
                           "\"nodes\":[{\"children\":[1],\"scale\":[2,2,2]},{\"mesh\":0,\"scale\":[-1,1,1]}],"
                           "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":1},\"indices\":0}]}],"
                           "\"buffers\":[{\"uri\":\"cube.bin\",\"byteLength\":168}],"
                           "\"bufferViews\":[{\"buffer\":0,\"byteLength\":72},"
                           "{\"buffer\":0,\"byteOffset\":72,\"byteLength\":96}],"
                           "\"accessors\":[{\"bufferView\":0,\"componentType\":5123,\"count\":36,"
                           "\"type\":\"SCALAR\"},{\"bufferView\":1,\"componentType\":5126,\"count\":8,"
                           "\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[2,2,2]}]}"),
                2);
}

/* ---- polygons, mending ---- */

static void concave_polygons(void **state) {
    (void)state;
    /* An L-shaped prism: two concave hexagons; the first corner is not the one a fan may start from. */
    const double ell[6][2] = {{2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 0}};
    char text[4096];
    size_t n = 0;
    for (int z = 0; z < 2; z++)
        for (int i = 0; i < 6; i++)
            n += (size_t)snprintf(text + n, sizeof text - n, "v %g %g %d\n", ell[i][0], ell[i][1], z);
    n += (size_t)snprintf(text + n, sizeof text - n, "f 6 5 4 3 2 1\nf 7 8 9 \\\n10 11 12\n");
    for (int i = 0; i < 6; i++)
        n += (size_t)snprintf(text + n, sizeof text - n, "f %d %d %d %d\n", i + 1, (i + 1) % 6 + 1,
                              (i + 1) % 6 + 7, i + 7);
    const morph_target_def def = mesh_def(write_text("ell.obj", text));
    built b = good(&def);
    assert_true(b.report.closed);
    assert_int_equal(b.report.vertices, 12);
    assert_int_equal(b.report.triangles, 20);
    assert_near(b.report.volume, 3, 1e-6);
    assert_near(b.report.area, 2 * 3 + 8, 1e-6);
    assert_int_equal(b.report.self_intersections, 0);
    assert_string_equal(b.warning, "");
    morph_mesh_free(&b.mesh);
}

/* A prism over a polygon of many corners, in each text format: none may be left out. */
static void many_corners(void **state) {
    (void)state;
    enum { N = 40 };
    const char *kinds[] = {"off", "ply", "obj"};
    for (int kind = 0; kind < 3; kind++) {
        char text[16384], name[32];
        size_t n = 0;
        const int o = kind == 2 ? 1 : 0;
        if (kind == 0) n += (size_t)snprintf(text, sizeof text, "OFF %d %d\n", 2 * N, N + 2);
        if (kind == 1)
            n += (size_t)snprintf(text, sizeof text,
                                  "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\n"
                                  "property double y\nproperty double z\nelement face %d\n"
                                  "property list uchar uint vertex_index\nend_header\n",
                                  2 * N, N + 2);
        for (int i = 0; i < 2 * N; i++)
            n += (size_t)snprintf(text + n, sizeof text - n, "%s%.9f %.9f %d\n", o ? "v " : "",
                                  cos(2 * M_PI * i / N), sin(2 * M_PI * i / N), i / N);
        for (int end = 0; end < 2; end++) {
            n += (size_t)snprintf(text + n, sizeof text - n, o ? "f" : "%d", N);
            for (int i = 0; i < N; i++)
                n += (size_t)snprintf(text + n, sizeof text - n, " %d", (end ? N + i : N - 1 - i) + o);
            n += (size_t)snprintf(text + n, sizeof text - n, "\n");
        }
        for (int i = 0; i < N; i++)
            n += (size_t)snprintf(text + n, sizeof text - n, "%s %d %d %d %d\n", o ? "f" : "4", i + o,
                                  (i + 1) % N + o, (i + 1) % N + N + o, i + N + o);
        assert_true(n < sizeof text);
        snprintf(name, sizeof name, "prism.%s", kinds[kind]);
        const morph_target_def def = mesh_def(write_text(name, text));
        built b = good(&def);
        assert_true(b.report.closed);
        assert_int_equal(b.report.vertices, 2 * N);
        assert_int_equal(b.report.triangles, 4 * N - 4);
        assert_near(b.report.volume, 0.5 * N * sin(2 * M_PI / N), 1e-6);
        remove(path_of(name));
        morph_mesh_free(&b.mesh);
    }
}

static void inside_out_is_turned(void **state) {
    (void)state;
    char text[4096];
    size_t n = 0;
    for (int i = 0; i < 8; i++)
        n += (size_t)snprintf(text + n, sizeof text - n, "v %g %g %g\n", (double)corner(i, 0),
                              (double)corner(i, 1), (double)corner(i, 2));
    for (int f = 0; f < 6; f++)
        n += (size_t)snprintf(text + n, sizeof text - n, "f %d %d %d %d\n", CUBE[f][3] + 1, CUBE[f][2] + 1,
                              CUBE[f][1] + 1, CUBE[f][0] + 1);
    /* A point that no face uses counts neither for the box nor for the report. */
    snprintf(text + n, sizeof text - n, "v 50 0 0\n");
    const morph_target_def def = mesh_def(write_text("inward.obj", text));
    built b = good(&def);
    assert_near(b.report.volume, 8, 1e-6);
    assert_int_equal(b.report.flipped, 12);
    assert_near(b.report.hi[0], 1, 1e-6);
    assert_non_null(strstr(b.warning, "inside out"));
    morph_mesh_free(&b.mesh);
}

static void a_quad_with_two_equal_corners(void **state) {
    (void)state;
    const char *text =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 1\n"
        "f 1 3 2\nf 1 2 4 5\nf 2 3 4 4\nf 3 1 5\n";
    const morph_target_def def = mesh_def(write_text("tetra.obj", text));
    built b = good(&def);
    assert_true(b.report.closed);
    assert_int_equal(b.report.triangles, 4);
    assert_near(b.report.volume, 1.0 / 6, 1e-9);
    morph_mesh_free(&b.mesh);
}

/* ---- transforms ---- */

static void rotate_fit_place(void **state) {
    (void)state;
    morph_target_def def = {.shape = MORPH_SHAPE_BOX, .size = {1, 2, 4}, .scale = 0.5, .at = {3, 4, 5}};
    built b = good(&def);
    const double half[3] = {0.25, 0.5, 1};
    for (int k = 0; k < 3; k++) {
        assert_near(b.report.lo[k], def.at[k] - half[k], 1e-12);
        assert_near(b.report.hi[k], def.at[k] + half[k], 1e-12);
    }
    assert_near(b.report.volume, 1, 1e-12);
    morph_mesh_free(&b.mesh);
    /* x first, then y: (1, 2, 4) -> about x (1, 4, 2) -> about y (2, 4, 1). In the other order it would be
     * (4, 1, 2). */
    def.rotate[0] = def.rotate[1] = 0.5 * M_PI;
    def.scale = 1;
    b = good(&def);
    const double turned[3] = {1, 2, 0.5};
    for (int k = 0; k < 3; k++)
        assert_near(b.report.hi[k] - def.at[k], turned[k], 0);
    morph_mesh_free(&b.mesh);
    /* Fit comes after the rotation: the largest scale of (2, 4, 1) inside (1, 1, 1) is a quarter. */
    def.has_fit = true;
    def.fit[0] = def.fit[1] = def.fit[2] = 1;
    b = good(&def);
    assert_near(b.report.hi[1] - b.report.lo[1], 1, 1e-12);
    assert_near(b.report.volume, 8.0 / 64, 1e-12);
    morph_mesh_free(&b.mesh);
}

/* A corner followed through: right-handed turns about fixed axes. */
static void rotation_is_right_handed(void **state) {
    (void)state;
    const char *text = "v 0 0 0\nv 3 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    for (int axis = 0; axis < 3; axis++) {
        morph_target_def def = mesh_def(write_text("corner.obj", text));
        const double angle = 0.4, c = cos(angle), s = sin(angle),
                     p[4][3] = {{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 1}};
        def.rotate[axis] = angle;
        built b = good(&def);
        const int u = (axis + 1) % 3, w = (axis + 2) % 3;
        for (int i = 1; i < 4; i++) {
            double d[3], e[3] = {0, 0, 0};
            for (int k = 0; k < 3; k++)
                d[k] = b.mesh.v[3 * i + k] - b.mesh.v[k];
            /* The file's order of vertices may have changed: find it by length. */
            for (int j = 1; j < 4; j++)
                if (fabs(morph_norm(p[j]) - morph_norm(d)) < 1e-5) memcpy(e, p[j], sizeof e);
            assert_near(d[axis], e[axis], 1e-6);
            assert_near(d[u], c * e[u] - s * e[w], 1e-6);
            assert_near(d[w], s * e[u] + c * e[w], 1e-6);
        }
        morph_mesh_free(&b.mesh);
    }
}

static void shapes_are_fine_enough(void **state) {
    (void)state;
    morph_target_def def = {.shape = MORPH_SHAPE_SPHERE, .radius = 0.2, .scale = 1};
    for (int fit = 0; fit < 2; fit++) {
        /* Fitted: a sphere of radius 5 down to 0.2. */
        if (fit) {
            def.radius = 5;
            def.has_fit = true;
            def.fit[0] = def.fit[1] = def.fit[2] = 0.4;
            def.rotate[0] = 0.3;
        }
        built b = good(&def);
        double worst = 0;
        for (int f = 0; f < b.mesh.triangles; f++) {
            double p[3] = {0, 0, 0};
            for (int i = 0; i < 9; i++)
                p[i % 3] += b.mesh.v[3 * b.mesh.t[3 * f + i / 3] + i % 3] / 3;
            worst = fmax(worst, 0.2 - morph_norm(p));
        }
        /* Chords of 2e-3 spacing (0.1): the middle of a facet lies about that deep. */
        assert_true(worst > 4e-5 && worst < 4e-4);
        morph_mesh_free(&b.mesh);
    }
    const morph_shape shapes[] = {MORPH_SHAPE_ELLIPSOID, MORPH_SHAPE_CYLINDER, MORPH_SHAPE_CONE,
                                  MORPH_SHAPE_TORUS, MORPH_SHAPE_CAPSULE};
    const double volumes[] = {4 * M_PI / 3 * 0.1 * 0.2 * 0.3, M_PI * 0.04 * 0.5, M_PI * 0.04 * 0.5 / 3,
                              2 * M_PI * M_PI * 0.2 * 0.01, M_PI * 0.04 * 0.1 + 4 * M_PI / 3 * 0.008};
    for (int i = 0; i < 5; i++) {
        morph_target_def d = {.shape = shapes[i], .radius = 0.2, .height = 0.5, .tube = 0.1, .scale = 1};
        d.radii[0] = 0.1;
        d.radii[1] = 0.2;
        d.radii[2] = 0.3;
        built b = good(&d);
        assert_true(b.report.closed);
        /* The surface lies within a chord (2e-3 of the spacing 0.1) of the true one. */
        assert_near(b.report.volume, volumes[i], 2e-4 * b.report.area);
        morph_mesh_free(&b.mesh);
    }
}

/* ---- height maps ---- */

static void height_tables(void **state) {
    (void)state;
    const char *tables[] = {"1,2,3\n4,5,6\n", "a;b;c\n1;2;3\n4;5;6\n", "  1 2\t3\r\n4   5 6 \r\n\r\n",
                            "# heights\n\"V1\",\"V2\",\"V3\"\n1,2.0,3e0\n+4, 5 ,6",
                            "\xef\xbb\xbfx,y,z\n1,2,3\n4,5,6\n"};
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
        morph_target_def def = mesh_def(write_text("table.csv", tables[i]));
        def.shape = MORPH_SHAPE_HEIGHTMAP;
        def.cell = 2;
        built b = good(&def);
        assert_true(b.report.closed);
        /* Heights 1..6 over 4 x 2, floor a twentieth of the range lower. */
        assert_near(b.report.hi[0], 2, 1e-12);
        assert_near(b.report.hi[1], 1, 1e-12);
        assert_near(b.report.hi[2] - b.report.lo[2], 5.25, 1e-12);
        assert_near(b.report.volume, 4 * 2 * (3.5 - 0.75), 1e-9);
        morph_mesh_free(&b.mesh);
    }
    morph_target_def def = mesh_def(write_text("flat.csv", "7,7\n7,7\n"));
    def.shape = MORPH_SHAPE_HEIGHTMAP;
    built b = good(&def);
    assert_near(b.report.volume, 1, 1e-12);
    morph_mesh_free(&b.mesh);
}

/* ---- real meshes ---- */

static char *shared(const char *name) {
    static char path[512];
    snprintf(path, sizeof path, "%s/models/%s", MORPH_SHARED_DIR, name);
    if (access(path, R_OK) != 0) {
        print_message("skipped: %s is missing\n", path);
        skip();
    }
    return path;
}

static void spot_is_watertight(void **state) {
    (void)state;
    morph_target_def def = mesh_def(shared("spot_low_resolution.obj"));
    built b = good(&def);
    assert_int_equal(b.report.vertices, 829);
    assert_int_equal(b.report.triangles, 1654);
    assert_true(b.report.closed);
    assert_int_equal(b.report.components, 1);
    assert_int_equal(b.report.flipped, 0);
    assert_int_equal(b.report.degenerate, 0);
    assert_int_equal(b.report.vertices - b.report.triangles / 2, 2);
    assert_string_equal(b.warning, "");
    assert_near(b.report.hi[0] - b.report.lo[0], 0.920, 2e-3);
    assert_near(b.report.hi[1] - b.report.lo[1], 1.756, 2e-3);
    assert_near(b.report.hi[2] - b.report.lo[2], 1.774, 2e-3);
    morph_mesh_free(&b.mesh);
    /* y up to z up, fitted. */
    def.rotate[0] = 0.5 * M_PI;
    def.has_fit = true;
    def.fit[0] = def.fit[1] = def.fit[2] = 0.42;
    def.at[2] = 0.21;
    b = good(&def);
    assert_near(b.report.hi[1] - b.report.lo[1], 0.42, 1e-12);
    assert_near(0.5 * (b.report.hi[2] + b.report.lo[2]), 0.21, 1e-12);
    morph_mesh_free(&b.mesh);
}

static void hand_is_open(void **state) {
    (void)state;
    const morph_target_def def = mesh_def(shared("hand_lowres.obj"));
    built b = good(&def);
    assert_int_equal(b.report.vertices, 810);
    assert_int_equal(b.report.triangles, 1602);
    assert_int_equal(b.report.boundary_edges, 16);
    assert_false(b.report.closed);
    assert_int_equal(b.report.nonmanifold_edges, 0);
    assert_int_equal(b.report.orientation_conflicts, 0);
    assert_true(b.report.volume > 0);
    assert_non_null(strstr(b.warning, "16 boundary edges"));
    assert_non_null(strstr(b.warning, "winding number"));
    morph_mesh_free(&b.mesh);
}

static void wallhole_is_accepted(void **state) {
    (void)state;
    const morph_target_def def = mesh_def(shared("wallhole.obj"));
    built b = good(&def);
    assert_true(b.report.closed);
    assert_int_equal(b.report.vertices, 35);
    assert_int_equal(b.report.welded, 57);
    assert_int_equal(b.report.degenerate, 0);
    assert_int_equal(b.report.self_intersections, 0);
    assert_near(b.report.volume, 1066.7, 0.05);
    assert_string_equal(b.warning, "");
    morph_mesh_free(&b.mesh);
}

static void volcano_is_a_solid(void **state) {
    (void)state;
    morph_target_def def = mesh_def(shared("volcano_maunga_whau_87x61.csv"));
    def.shape = MORPH_SHAPE_HEIGHTMAP;
    def.cell = 10;
    built b = good(&def);
    assert_true(b.report.closed);
    assert_int_equal(b.report.components, 1);
    assert_near(b.report.hi[0] - b.report.lo[0], 600, 1e-9);
    assert_near(b.report.hi[1] - b.report.lo[1], 860, 1e-9);
    assert_near(b.report.hi[2] - b.report.lo[2], 101 * 1.05, 1e-9);
    assert_int_equal(b.report.self_intersections, 0);
    morph_mesh_free(&b.mesh);
}

static void joined_tetrahedra_are_refused(void **state) {
    (void)state;
    const morph_target_def def = mesh_def(shared("joined_tetrahedra.obj"));
    built b;
    assert_int_equal(build(&def, &b), MORPH_ERR_INPUT);
    assert_non_null(strstr(b.message, "3 edges with more than two faces"));
    assert_null(b.mesh.v);
}

static int setup(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/morph_import_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int teardown(void **state) {
    (void)state;
    const char *names[] = {"cube.stl",  "cube.obj",   "cube.ply",   "cube.off",  "CUBE.OBJ", "binary.stl",
                           "tail.stl",  "cube.bin",   "binary.ply", "cube.gltf", "ell.obj",  "inward.obj",
                           "tetra.obj", "corner.obj", "table.csv",  "flat.csv"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        remove(path_of(names[i]));
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_formats),
        cmocka_unit_test(binary_formats),
        cmocka_unit_test(gltf_nodes_are_applied),
        cmocka_unit_test(concave_polygons),
        cmocka_unit_test(many_corners),
        cmocka_unit_test(inside_out_is_turned),
        cmocka_unit_test(a_quad_with_two_equal_corners),
        cmocka_unit_test(rotate_fit_place),
        cmocka_unit_test(rotation_is_right_handed),
        cmocka_unit_test(shapes_are_fine_enough),
        cmocka_unit_test(height_tables),
        cmocka_unit_test(spot_is_watertight),
        cmocka_unit_test(hand_is_open),
        cmocka_unit_test(wallhole_is_accepted),
        cmocka_unit_test(volcano_is_a_solid),
        cmocka_unit_test(joined_tetrahedra_are_refused),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
