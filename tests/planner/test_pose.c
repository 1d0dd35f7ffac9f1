/* The examination of a pose against plain loops and formulas; the rows it adds; the blocks made of them. */
#include "test_pose_fixture.h"

#include <string.h>

static const morph_inset inset = {.length = 0.01, .angle = 0.02, .clearance = 0.03, .self = 0.01};
static const morph_nearness nearness = {.length = 0.05, .angle = 0.1, .clearance = 0.1, .self = 0.1};

static void disturb(fixture *f, double height, double amount, uint64_t *seed) {
    fixture_flat(f, height);
    for (int i = 0; i < f->n; i++)
        f->x[i] += amount * noise(seed);
}

/* "link 3 ..|post (0,1)": both parts must stand in the name, in either order. */
static void assert_named(const char *expected, const char *name) {
    char parts[112];
    snprintf(parts, sizeof parts, "%s", expected);
    char *second = strchr(parts, '|');
    if (second) *second++ = '\0';
    if (!strstr(name, parts) || (second && !strstr(name, second)))
        fail_msg("\"%s\" is named where \"%s\" is worst", name, expected);
}

static void compare(fixture *f) {
    brute b;
    morph_violation v;
    brute_examine(f, f->x, &b);
    assert_int_equal(morph_pose_examine(&f->world, f->x, NULL, NULL, NULL, NULL, &v), MORPH_OK);
    for (int k = 0; k < MORPH_LIMITS; k++) {
        if (k == MORPH_LIMIT_BASE && isnan(f->world.base)) {
            assert_true(v.amount[k] == -INFINITY);
            continue;
        }
        /* Elements far from the target or from each other need not be measured. */
        if ((k == MORPH_LIMIT_CLEARANCE && b.amount[k] < -0.3) ||
            (k == MORPH_LIMIT_SELF && b.amount[k] < 0.0)) {
            assert_true(v.amount[k] <= b.amount[k] + 1e-9);
            continue;
        }
        /* Clearance: the deepest point is found to 1e-4, and our own search to as much. */
        const double allowed = k == MORPH_LIMIT_CLEARANCE ? 3e-4 : 1e-12;
        if (fabs(v.amount[k] - b.amount[k]) > allowed)
            fail_msg("%s: examined %.9g (%s), is %.9g (%s)", morph_limit_name((morph_limit)k), v.amount[k],
                     v.element[k], b.amount[k], b.element[k]);
        /* Two elements may be equally close to the target: a corner belongs to many. */
        if (k != MORPH_LIMIT_CLEARANCE) assert_named(b.element[k], v.element[k]);
    }
}

static void test_agrees(void **state) {
    (void)state;
    uint64_t seed = 1;
    fixture f;
    const solid box = solid_box(0.12, 0.1, 0.08, 0.04);
    fixture_make(&f, 4, 3, &box, 0.0);
    for (int k = 0; k < 16; k++) {
        disturb(&f, 0.01 * k, 0.02 + 0.03 * k, &seed);
        compare(&f);
    }
    fixture_free(&f);
    fixture_make(&f, 3, 3, &box, NAN);
    disturb(&f, 0.09, 0.2, &seed);
    compare(&f);
    fixture_free(&f);
}

/* Joint j moved by d from a flat pose that holds everything. */
static void plant(fixture *f, int j, double dx, double dy, double dz, morph_violation *v) {
    fixture_flat(f, 0.14);
    f->x[3 * j] += dx;
    f->x[3 * j + 1] += dy;
    f->x[3 * j + 2] += dz;
    assert_int_equal(morph_pose_examine(&f->world, f->x, NULL, NULL, NULL, NULL, v), MORPH_OK);
}

static void test_planted(void **state) {
    (void)state;
    fixture f;
    const solid box = solid_box(0.04, 0.04, 0.1, 0.05);
    fixture_make(&f, 4, 4, &box, 0.0);
    morph_violation v;
    plant(&f, 0, 0.0, 0.0, 0.0, &v);
    for (int k = 0; k < MORPH_LIMITS; k++)
        assert_true(v.amount[k] <= 0.0 || (k == MORPH_LIMIT_POST && v.amount[k] < 1e-12));

    plant(&f, 16 + 5, 0.0, 0.0, 0.01, &v); /* top of post (1,1) up by a hundredth of the spacing */
    assert_near(v.amount[MORPH_LIMIT_POST], 0.02, 1e-12);
    assert_string_equal(v.element[MORPH_LIMIT_POST], "post (1,1)");

    plant(&f, 3, 0.5, 0.0, 0.0, &v); /* the corner (3,0) of the bottom outwards */
    assert_near(v.amount[MORPH_LIMIT_LENGTH], 0.15, 1e-12);
    assert_non_null(strstr(v.element[MORPH_LIMIT_LENGTH], "(2,0)-(3,0) bottom"));
    plant(&f, 16 + 3, -0.3, 0.0, 0.0, &v); /* that of the top inwards */
    assert_near(v.amount[MORPH_LIMIT_LENGTH], 0.05, 1e-12);
    assert_non_null(strstr(v.element[MORPH_LIMIT_LENGTH], "(2,0)-(3,0) top"));

    plant(&f, 16 + 3, 0.5, 0.0, 0.0, &v); /* its post leans by 45 degrees: 135 against the limit 125, or 45 */
    assert_near(v.amount[MORPH_LIMIT_ANGLE], acos(-1.0) / 18.0, 1e-12);
    assert_non_null(strstr(v.element[MORPH_LIMIT_ANGLE], "(3,0)"));

    plant(&f, 12, 0.0, 0.0, -1.5, &v); /* below the base */
    assert_near(v.amount[MORPH_LIMIT_BASE], 0.1, 1e-12);
    assert_string_equal(v.element[MORPH_LIMIT_BASE], "joint (0,3) bottom");

    /* The box's top face at 1.0 pierces the middle cell's triangles when all is lowered to 0.9. */
    plant(&f, 0, 0.0, 0.0, 0.0, &v);
    for (int i = 2; i < f.n; i += 3)
        f.x[i] -= 0.5;
    assert_int_equal(morph_pose_examine(&f.world, f.x, NULL, NULL, NULL, NULL, &v), MORPH_OK);
    assert_near(v.amount[MORPH_LIMIT_CLEARANCE], 0.14, 1e-3);
    assert_non_null(strstr(v.element[MORPH_LIMIT_CLEARANCE], "at (1,1)"));

    /* The bottom joint (1,1) into the top layer's middle of the link (1,0)-(1,1), say: two axes touch. */
    plant(&f, 5, 0.0, -0.5, 0.5, &v);
    assert_true(v.amount[MORPH_LIMIT_SELF] > 0.0);
    assert_non_null(strstr(v.element[MORPH_LIMIT_SELF], " / "));
    assert_non_null(strstr(v.element[MORPH_LIMIT_SELF], "top"));

    f.x[7] = NAN;
    assert_int_equal(morph_pose_examine(&f.world, f.x, NULL, NULL, NULL, NULL, &v), MORPH_ERR_NONFINITE);
    fixture_free(&f);
}

static bool of_element(const int joint[3], const int *element, int n) {
    for (int k = 0; k < 3; k++) {
        bool found = false;
        for (int i = 0; i < n; i++)
            found |= joint[k] == element[i];
        if (!found) return false;
    }
    return true;
}

static bool has_contact_row(const morph_active *a, const int *element, int n) {
    for (int k = 0; k < a->points; k++)
        if (of_element(a->point[k].joint, element, n)) return true;
    for (int k = 0; k < a->features; k++)
        if (of_element(a->feature[k].joint, element, n)) return true;
    return false;
}

/* Everything violated or near its limit by plain measure has its row. */
static void assert_rows(fixture *f) {
    const morph_structure *s = f->s;
    const morph_active *a = f->active;
    const double apart = 2.0 * s->def.radius / s->spacing,
                 reach = 0.5 * apart + inset.clearance + nearness.clearance;
    for (int l = 0; l < s->links; l++) {
        const double length = s->spacing * morph_dist(&f->x[3 * s->link[l][0]], &f->x[3 * s->link[l][1]]);
        const double beyond = beyond_range(length, s->length_limit[l]) / s->spacing;
        assert_true(a->has_link[l] || beyond < -inset.length - nearness.length + 1e-12);
    }
    for (int t = 0; t < s->link_posts + s->link_links; t++) {
        const double beyond = beyond_range(morph_angle_at(s, t, f->x), morph_angle_limit(s, t));
        assert_true(a->has_tuple[t] || beyond < -inset.angle - nearness.angle + 1e-12);
    }
    for (int i = 0; i < f->n; i++)
        f->metres[i] = f->x[i] * s->spacing;
    for (int t = 0; t < s->skin_triangles; t++) {
        const int *j = s->skin[t];
        const double *p = f->metres;
        if (element_distance(&f->solid, &p[3 * j[0]], &p[3 * j[1]], &p[3 * j[2]]) <
            (reach - 1e-3) * s->spacing)
            assert_true(has_contact_row(a, j, 3));
    }
    for (int l = 0; l < s->links; l++) {
        const double *p = &f->metres[3 * s->link[l][0]], *q = &f->metres[3 * s->link[l][1]];
        if (element_distance(&f->solid, p, q, q) < (reach - 1e-3) * s->spacing &&
            s->link_kind[l] != MORPH_LINK_BOTTOM)
            assert_true(has_contact_row(a, s->link[l], 2));
    }
    const int axes = s->links + s->posts;
    for (int i = 0; i < axes; i++)
        for (int k = i + 1; k < axes; k++) {
            const int *p = axis_joints(s, i), *q = axis_joints(s, k);
            if (share_joint(p, q)) continue;
            const double d =
                segment_distance(&f->x[3 * p[0]], &f->x[3 * p[1]], &f->x[3 * q[0]], &f->x[3 * q[1]]);
            if (d > apart + inset.self + nearness.self - 1e-9) continue;
            int rows = 0;
            for (int r = 0; r < a->pairs; r++)
                rows += a->pair[r].axis[0] == i && a->pair[r].axis[1] == k;
            assert_int_equal(rows, 4);
        }
}

static void test_rows(void **state) {
    (void)state;
    uint64_t seed = 3;
    fixture f;
    const solid box = solid_box(0.12, 0.1, 0.08, 0.04);
    fixture_make(&f, 4, 3, &box, 0.0);
    for (int k = 0; k < 12; k++) {
        int added = -1, again = -1;
        disturb(&f, 0.01 * k, 0.02 + 0.03 * k, &seed);
        morph_active_clear(f.active, f.s);
        assert_int_equal(morph_pose_examine(&f.world, f.x, &inset, &nearness, f.active, &added, NULL),
                         MORPH_OK);
        assert_int_equal(added + f.s->posts, morph_active_rows(f.active, f.s));
        assert_rows(&f);
        /* The same pose again: nothing new but the pairs, which are measured anew. */
        const int rows = morph_active_rows(f.active, f.s);
        assert_int_equal(morph_pose_examine(&f.world, f.x, &inset, &nearness, f.active, &again, NULL),
                         MORPH_OK);
        assert_int_equal(again, f.active->pairs);
        assert_int_equal(morph_active_rows(f.active, f.s), rows);
        /* Another pose: rows stay. */
        const int points = f.active->points, links = f.active->links;
        disturb(&f, 0.01 * k, 0.02 + 0.03 * k, &seed);
        assert_int_equal(morph_pose_examine(&f.world, f.x, &inset, &nearness, f.active, NULL, NULL),
                         MORPH_OK);
        assert_true(f.active->points >= points && f.active->links >= links);
        assert_rows(&f);
    }
    /* High above everything and flat: only the posts. */
    const morph_nearness none = {0};
    fixture_flat(&f, 0.3);
    morph_active_clear(f.active, f.s);
    assert_int_equal(morph_pose_examine(&f.world, f.x, &inset, &none, f.active, NULL, NULL), MORPH_OK);
    assert_int_equal(morph_active_rows(f.active, f.s), f.s->posts);
    fixture_free(&f);
}

/* Worst violation of the rows of one limit in a problem made of the active blocks. */
static void row_violations(fixture *f, const morph_inset *in, double worst[MORPH_LIMITS]) {
    static const struct {
        const char *name;
        morph_limit limit;
    } kinds[] = {{"post", MORPH_LIMIT_POST},         {"length", MORPH_LIMIT_LENGTH},
                 {"angle", MORPH_LIMIT_ANGLE},       {"clearance", MORPH_LIMIT_CLEARANCE},
                 {"feature", MORPH_LIMIT_CLEARANCE}, {"self", MORPH_LIMIT_SELF}};
    morph_block blocks[MORPH_POSE_BLOCKS];
    const int count = morph_active_blocks(f->active, &f->world, NULL, in, blocks);
    assert_in_range(count, 1, MORPH_POSE_BLOCKS);
    for (int k = 0; k < MORPH_LIMITS; k++)
        worst[k] = -INFINITY;
    int rows = 0;
    for (int b = 0; b < count; b++) {
        double *value = morph_alloc((size_t)blocks[b].rows, sizeof *value);
        assert_non_null(value);
        assert_int_equal(blocks[b].value(blocks[b].data, f->x, value), MORPH_OK);
        int kind = -1;
        for (int k = 0; k < (int)(sizeof kinds / sizeof *kinds); k++)
            if (strncmp(blocks[b].name, kinds[k].name, strlen(kinds[k].name)) == 0)
                kind = (int)kinds[k].limit;
        if (kind < 0) fail_msg("block \"%s\" is of no known limit", blocks[b].name);
        for (int r = 0; r < blocks[b].rows; r++)
            worst[kind] =
                fmax(worst[kind], fmax(blocks[b].lower[r] - value[r], value[r] - blocks[b].upper[r]));
        rows += blocks[b].rows;
        free(value);
    }
    assert_int_equal(rows, morph_active_rows(f->active, f->s));
}

/* A pose breaks a row exactly where it breaks the limit. */
static void test_rows_tell_the_truth(void **state) {
    (void)state;
    static const morph_inset none;
    uint64_t seed = 5;
    fixture f;
    const solid box = solid_box(0.12, 0.1, 0.08, 0.04);
    fixture_make(&f, 3, 3, &box, NAN);
    int broken[MORPH_LIMITS] = {0}, kept[MORPH_LIMITS] = {0};
    for (int k = 0; k < 60; k++) {
        morph_violation v;
        double rows[MORPH_LIMITS];
        disturb(&f, 0.004 * (k % 30), 0.01 + 0.01 * (k % 37), &seed);
        morph_active_clear(f.active, f.s);
        assert_int_equal(morph_pose_examine(&f.world, f.x, &none, &nearness, f.active, NULL, &v), MORPH_OK);
        row_violations(&f, &none, rows);
        for (int m = 0; m < MORPH_LIMITS; m++) {
            if (m == MORPH_LIMIT_BASE) continue;
            if (v.amount[m] > 2e-3) {
                broken[m]++;
                if (rows[m] <= 0.0)
                    fail_msg("pose %d: %s broken by %.3g at %s, no row tells", k,
                             morph_limit_name((morph_limit)m), v.amount[m], v.element[m]);
            } else if (v.amount[m] < -2e-3) {
                kept[m]++;
                if (rows[m] > 0.0)
                    fail_msg("pose %d: %s kept by %.3g, a row is broken by %.3g", k,
                             morph_limit_name((morph_limit)m), -v.amount[m], rows[m]);
            }
        }
    }
    assert_true(broken[MORPH_LIMIT_LENGTH] > 3 && kept[MORPH_LIMIT_LENGTH] > 3);
    assert_true(broken[MORPH_LIMIT_ANGLE] > 3 && kept[MORPH_LIMIT_ANGLE] > 3);
    assert_true(broken[MORPH_LIMIT_CLEARANCE] > 3 && kept[MORPH_LIMIT_CLEARANCE] > 3);
    fixture_free(&f);
}

static void test_counts_and_bounds(void **state) {
    (void)state;
    fixture f;
    const solid box = solid_box(0.1, 0.1, 0.1, 0.05);
    fixture_make(&f, 3, 4, &box, 0.02);
    const morph_structure *s = f.s;
    /* 12 posts, 2 (2*3*4 - 3 - 4) = 34 links, two link-post angles each, 4 * 6 cells * 2 layers corners, 12
     * skin triangles, each link and joint once more, and every two of 46 axes. */
    assert_int_equal(morph_possible_rows(s), 12 + 34 + 68 + 48 + 12 + 34 + 24 + 46 * 45 / 2);
    morph_pose_bounds(&f.world, 0.5, f.metres);
    for (int i = 0; i < f.n; i++)
        if (i % 3 == 2)
            assert_near(f.metres[i], 0.2 + 0.04 + 0.5, 1e-12);
        else
            assert_true(f.metres[i] == -INFINITY);
    f.world.base = NAN;
    morph_pose_bounds(&f.world, 0.5, f.metres);
    for (int i = 0; i < f.n; i++)
        assert_true(f.metres[i] == -INFINITY);

    morph_violation v = {.amount = {1e-7, 2e-7, -1.0, 2e-9, 1e-4, -INFINITY, 0.0}};
    morph_limit which = MORPH_LIMIT_POST;
    assert_near(morph_violation_worst(&v, morph_pose_tolerance, &which), 2.0, 1e-9);
    assert_int_equal(which, MORPH_LIMIT_ANGLE);
    for (int k = 0; k < MORPH_LIMITS; k++)
        for (int m = 0; m < k; m++)
            assert_string_not_equal(morph_limit_name((morph_limit)k), morph_limit_name((morph_limit)m));
    fixture_free(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agrees),
        cmocka_unit_test(test_planted),
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_rows_tell_the_truth),
        cmocka_unit_test(test_counts_and_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
