/* Connected cavities and cuts when memory is refused: an error, an empty result, nothing left behind. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "model/cavity_parts.h"
#include "model/cavity_section.h"
#include "tests/support/refused_memory.h"

#if CAN_REFUSE
enum { SIDE = 5, JOINTS = SIDE * SIDE };
static morph_structure structure;
static double x[3 * JOINTS];
static int skin[2 * JOINTS][3];

static void make_sheet(void) {
    structure = (morph_structure){.joints = JOINTS, .spacing = 0.1, .skin = skin, .start = x};
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++) {
            double *p = x + 3 * (j * SIDE + i);
            p[0] = 0.1 * i - 0.2;
            p[1] = 0.1 * j - 0.2;
            p[2] = 0.2 + 0.05 * ((i + j) % 2);
            if (i + 1 == SIDE || j + 1 == SIDE) continue;
            const int a = j * SIDE + i;
            memcpy(skin[structure.skin_triangles++], (int[3]){a, a + 1, a + SIDE + 1}, sizeof skin[0]);
            memcpy(skin[structure.skin_triangles++], (int[3]){a, a + SIDE + 1, a + SIDE}, sizeof skin[0]);
        }
}

static void refused(void **state) {
    (void)state;
    make_sheet();
    morph_mesh mesh;
    morph_distance *target;
    morph_cavity *cavity;
    assert_int_equal(morph_mesh_torus(0.12, 0.05, 1e-3, &mesh), MORPH_OK);
    assert_int_equal(morph_distance_create(&mesh, true, &target), MORPH_OK);
    assert_int_equal(morph_cavity_create(&structure, target, -0.1, &cavity), MORPH_OK);
    const long before = live;
    for (int what = 0; what < 2; what++) {
        long refusals = 0, failures = 0;
        for (;; refusals++) {
            morph_cavity_parts parts;
            morph_cavity_section section;
            countdown = refusals;
            const morph_status status = what ? morph_cavity_section_cut(cavity, x, 0, 0.01, &section)
                                             : morph_cavity_parts_find(cavity, x, 0.01, 0, 0, &parts);
            const bool asked = was_refused();
            countdown = -1;
            if (status != MORPH_OK) {
                assert_true(asked);
                assert_int_equal(status, MORPH_ERR_NOMEM);
                failures++;
                assert_true(what ? !section.cavity && !section.line && section.area == 0 : !parts.part);
                assert_int_equal(live, before);
                continue;
            }
            assert_true(what ? section.area > 0.01 : parts.count > 0);
            if (what)
                morph_cavity_section_free(&section);
            else
                morph_cavity_parts_free(&parts);
            assert_int_equal(live, before);
            if (!asked) break; /* what was asked and is not missed is room that qsort can do without */
        }
        print_message("%s: %ld refusals, %ld of them an error\n", what ? "section" : "parts", refusals,
                      failures);
        assert_true(failures > 10);
    }
    morph_cavity_destroy(cavity);
    morph_distance_destroy(target);
    morph_mesh_free(&mesh);
}
#else
static void refused(void **state) {
    (void)state;
    print_message("the allocator cannot be replaced here\n");
    skip();
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
