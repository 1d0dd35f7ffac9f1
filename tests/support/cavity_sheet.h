/* A square sheet over cavities whose air is known in closed form: only what the cavity reads of a structure.
 * Include it after cmocka.h. */
#ifndef TESTS_SUPPORT_CAVITY_SHEET_H
#define TESTS_SUPPORT_CAVITY_SHEET_H

#include "model/cavity.h"

#include <stdlib.h>
#include <string.h>

#define assert_near(a, b, eps) near_or_fail((a), (b), (eps), __LINE__)
static void near_or_fail(double a, double b, double eps, int line) {
    if (fabs(a - b) <= eps) return;
    print_error("line %d: %.17g is not %.17g to %g\n", line, a, b, eps);
    fail();
}

/* A square sheet of SIDE x SIDE joints 0.1 m apart about the origin, at height `z`: only what the cavity
 * reads of a structure. */
enum { SIDE = 9, JOINTS = SIDE * SIDE };
static const double SPACING = 0.1, HALF = 0.4;
typedef struct sheet {
    morph_structure s;
    double start[3 * JOINTS], x[3 * JOINTS];
    int skin[2 * JOINTS][3];
} sheet;

static sheet *sheet_make(double z) {
    sheet *h = calloc(1, sizeof *h);
    assert_non_null(h);
    h->s.joints = JOINTS;
    h->s.spacing = h->s.def.spacing = SPACING;
    h->s.def.radius = 0.004;
    h->s.skin = h->skin;
    h->s.start = h->start;
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++) {
            double *p = h->start + 3 * (j * SIDE + i);
            p[0] = i * SPACING - HALF;
            p[1] = j * SPACING - HALF;
            if (i + 1 == SIDE || j + 1 == SIDE) continue;
            const int a = j * SIDE + i, b = a + 1, c = a + SIDE + 1, d = a + SIDE;
            memcpy(h->skin[h->s.skin_triangles++], (int[3]){a, b, c}, sizeof h->skin[0]);
            memcpy(h->skin[h->s.skin_triangles++], (int[3]){a, c, d}, sizeof h->skin[0]);
        }
    memcpy(h->x, h->start, sizeof h->x);
    for (int i = 0; i < JOINTS; i++)
        h->x[3 * i + 2] = z;
    return h;
}

#endif
