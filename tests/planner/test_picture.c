/* Still pictures: whole files of the right kind, with something in them. */
#include "folder_fixture.h"

#include "planner/picture.h"
#include "planner/picture_cavity.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char scratch[64];

static int setup(void **state) {
    (void)state;
    snprintf(scratch, sizeof scratch, "/tmp/morph-picture-XXXXXX");
    return mkdtemp(scratch) ? 0 : -1;
}

static int teardown(void **state) {
    (void)state;
    return rmdir(scratch); /* fails when a test left anything */
}

static void path_to(const char *name, char path[128]) {
    snprintf(path, 128, "%s/%s", scratch, name);
}

static void png(void **state) {
    (void)state;
    morph_record r = fixture_record(6, 6, 101);
    char path[128], message[256] = "";
    path_to("a.png", path);
    for (int k = 0; k < 2; k++) /* the second replaces the first */
        if (morph_picture_write(&r, "Title", path, message, sizeof message) != MORPH_OK)
            fail_msg("%s", message);
    cairo_surface_t *image = cairo_image_surface_create_from_png(path);
    assert_int_equal(cairo_surface_status(image), CAIRO_STATUS_SUCCESS);
    int width = cairo_image_surface_get_width(image), height = cairo_image_surface_get_height(image);
    assert_int_equal(width, 1400);
    assert_in_range(height, 1000, 2000);
    /* White paper; blue, orange and sand on it. */
    int white = 0, blue = 0, orange = 0, sand = 0;
    const unsigned char *data = cairo_image_surface_get_data(image);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const unsigned char *p = data + y * cairo_image_surface_get_stride(image) + 4 * x;
            int b = p[0], g = p[1], red = p[2];
            white += b == 255 && g == 255 && red == 255;
            blue += b > red + 80 && b > g + 20;
            orange += red > b + 90 && g > b && red > g + 40;
            sand += red > b + 20 && red < b + 70 && g > b;
        }
    assert_true(white > width * height / 2);
    assert_true(blue > 3000);
    assert_true(orange > 3000);
    assert_true(sand > 10000);
    cairo_surface_destroy(image);
    unlink(path);
    morph_record_free(&r);
}

static char *load(const char *path) {
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    struct stat info;
    assert_int_equal(fstat(fileno(f), &info), 0);
    char *text = calloc((size_t)info.st_size + 1, 1);
    assert_non_null(text);
    assert_int_equal(fread(text, 1, (size_t)info.st_size, f), info.st_size);
    fclose(f);
    return text;
}

/* Every tag closed in order, every quote too: enough to tell a whole document from a torn one. */
static void assert_balanced(const char *text) {
    int depth = 0, tags = 0;
    for (const char *c = strchr(text, '<'); c; c = strchr(c, '<')) {
        const char *end = strchr(c, '>');
        assert_non_null(end);
        if (c[1] == '/')
            depth--;
        else if (c[1] != '?' && c[1] != '!' && end[-1] != '/')
            depth++;
        assert_true(depth >= 0);
        tags++;
        c = end;
    }
    assert_int_equal(depth, 0);
    assert_true(tags > 50);
}

static void svg(void **state) {
    (void)state;
    morph_record r = fixture_record(6, 6, 101);
    char path[128], message[256] = "";
    path_to("a.SVG", path);
    if (morph_picture_write(&r, "Title", path, message, sizeof message) != MORPH_OK) fail_msg("%s", message);
    char *text = load(path);
    assert_non_null(strstr(text, "<svg"));
    assert_balanced(text);
    free(text);
    unlink(path);
    morph_record_free(&r);
}

static void panels(void **state) {
    (void)state;
    morph_record r = fixture_record(5, 5, 51);
    for (int panel = 0; panel < 8; panel++) {
        char *text, mark[24];
        assert_int_equal(morph_picture_svg(&r, panel, 600, 400, &text), MORPH_OK);
        assert_memory_equal(text, "<svg", 4);
        assert_balanced(text);
        /* Ids of panels on one page must differ. */
        snprintf(mark, sizeof mark, "id=\"p%d-", panel);
        for (const char *c = strstr(text, " id=\""); c; c = strstr(c + 1, " id=\""))
            assert_memory_equal(c + 1, mark, strlen(mark));
        snprintf(mark, sizeof mark, "href=\"#p%d-", panel);
        for (const char *c = strstr(text, "href=\"#"); c; c = strstr(c + 1, "href=\"#"))
            assert_memory_equal(c, mark, strlen(mark));
        free(text);
    }
    char *text;
    assert_int_equal(morph_picture_svg(&r, 8, 600, 400, &text), MORPH_ERR_INPUT);
    assert_int_equal(morph_picture_svg(&r, 0, NAN, 400, &text), MORPH_ERR_INPUT);
    assert_null(text);
    morph_record_free(&r);
}

static void refusals(void **state) {
    (void)state;
    morph_record r = fixture_record(4, 4, 21), none = {0};
    char path[128], message[256] = "";
    path_to("a.jpg", path);
    assert_int_equal(morph_picture_write(&r, "", path, message, sizeof message), MORPH_ERR_INPUT);
    path_to("a.png", path);
    assert_int_equal(morph_picture_write(&none, "", path, message, sizeof message), MORPH_ERR_INPUT);
    r.schedule_joints[5] = NAN;
    assert_int_equal(morph_picture_write(&r, "", path, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "not finite"));
    r.schedule_joints[5] = 1e300; /* finite, and nothing must overflow into undefined behaviour */
    morph_picture_write(&r, "", path, message, sizeof message);
    unlink(path);
    r.schedule_joints[5] = 0;
    assert_int_equal(morph_picture_write(&r, "", "/no/such/folder/a.png", message, sizeof message),
                     MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "No such file"));
    /* A folder in the file's place is left alone. */
    assert_int_equal(mkdir(path, 0777), 0);
    assert_int_equal(morph_picture_write(&r, "", path, message, sizeof message), MORPH_ERR_INPUT);
    assert_int_equal(rmdir(path), 0);
    morph_record_free(&r);
}

/* A pixel of one colour, to rounding. */
static bool near(const unsigned char *p, int red, int green, int blue) {
    return abs(p[2] - red) <= 1 && abs(p[1] - green) <= 1 && abs(p[0] - blue) <= 1;
}

/* The file of cavities: a whole picture with the colours of sheet, target and cavity in its cuts. */
static void cavity_png(void **state) {
    (void)state;
    morph_record r = fixture_record(7, 6, 11);
    char path[128], message[256] = "";
    path_to("c.png", path);
    if (morph_picture_cavity(&r, path, message, sizeof message) != MORPH_OK) fail_msg("%s", message);
    cairo_surface_t *image = cairo_image_surface_create_from_png(path);
    assert_int_equal(cairo_surface_status(image), CAIRO_STATUS_SUCCESS);
    const int width = cairo_image_surface_get_width(image), height = cairo_image_surface_get_height(image);
    int white = 0, blue = 0, cavity[2] = {0, 0}, grey[2] = {0, 0};
    const unsigned char *data = cairo_image_surface_get_data(image);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const unsigned char *p = data + y * cairo_image_surface_get_stride(image) + 4 * x;
            white += p[0] == 255 && p[1] == 255 && p[2] == 255;
            blue += near(p, 13, 94, 158);
            if (y < height - 400) continue; /* the cuts, blanket to the left, plan to the right */
            cavity[x > width / 2] += near(p, 214, 94, 0);
            grey[x > width / 2] += near(p, 189, 191, 196);
        }
    print_message("white %d of %d, blue %d, cavity %d and %d, grey %d and %d\n", white, width * height, blue,
                  cavity[0], cavity[1], grey[0], grey[1]);
    assert_true(white > width * height / 2);
    assert_true(blue > 2000);
    for (int k = 0; k < 2; k++) {
        assert_true(cavity[k] > 1000);
        assert_true(grey[k] > 5000);
    }
    assert_true(cavity[0] > cavity[1]); /* the fixture's blanket hangs higher than its plan */
    cairo_surface_destroy(image);
    unlink(path);
    morph_record_free(&r);
}

static void cavity_svg(void **state) {
    (void)state;
    char path[128], message[256] = "";
    path_to("c.svg", path);
    for (int variant = 0; variant < 3; variant++) {
        morph_record r = fixture_record(5, 5, 11);
        if (variant == 1) r.base = NAN;
        for (int i = 2; variant == 2 && i < 3 * r.target_vertices; i += 3)
            r.target_v[i] += 50; /* nothing near: a cut through the middle of the target still */
        if (morph_picture_cavity(&r, path, message, sizeof message) != MORPH_OK)
            fail_msg("%d: %s", variant, message);
        char *text = load(path);
        assert_balanced(text);
        free(text);
        unlink(path);
        morph_record_free(&r);
    }
}

static void cavity_refusals(void **state) {
    (void)state;
    char path[128], message[256] = "";
    morph_record r = fixture_record(4, 4, 11);
    path_to("c.gif", path);
    assert_int_equal(morph_picture_cavity(&r, path, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, ".svg or .png"));
    path_to("c.png", path);
    int *const counts[] = {&r.nominal_frames, &r.samples, &r.skin_triangles, &r.target_triangles};
    static const char *const names[] = {"no blanket", "no schedule", "no skin", "no target"};
    for (int k = 0; k < 4; k++) {
        const int count = *counts[k];
        *counts[k] = 0;
        assert_int_equal(morph_picture_cavity(&r, path, message, sizeof message), MORPH_ERR_INPUT);
        assert_non_null(strstr(message, names[k]));
        *counts[k] = count;
    }
    r.target_v[4] = INFINITY;
    assert_int_equal(morph_picture_cavity(&r, path, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "not finite"));
    r.target_v[4] = 0;
    assert_int_equal(morph_picture_cavity(&r, "/no/such/folder/c.png", message, sizeof message),
                     MORPH_ERR_INPUT);
    assert_int_not_equal(access(path, F_OK), 0);
    morph_record_free(&r);
}

/* From pale to dark without a turn in brightness, whatever the number of tones. */
static void gap_tones(void **state) {
    (void)state;
    static const double most[] = {0.07, 1e-9, 3, 0.0999999, 1234};
    for (size_t k = 0; k < sizeof most / sizeof *most; k++) {
        const morph_gap_scale scale = morph_gap_scale_to(most[k]);
        assert_in_range(scale.tones, 5, 15);
        assert_true(scale.step * scale.tones >= most[k] * (1 - 1e-9));
        assert_true(scale.step * (scale.tones - 1) < most[k]);
        double before = INFINITY;
        for (int tone = 0; tone < scale.tones; tone++) {
            const morph_colour c = morph_gap_colour(&scale, tone);
            const double bright = 0.2126 * pow(c.r, 2.2) + 0.7152 * pow(c.g, 2.2) + 0.0722 * pow(c.b, 2.2);
            assert_true(bright < before);
            before = bright;
        }
        assert_true(before < 0.03);
    }
}

/* No base, no target, no schedule, one sample: still a picture. */
static void sparse_records(void **state) {
    (void)state;
    char path[128], message[256] = "";
    path_to("a.svg", path);
    for (int variant = 0; variant < 4; variant++) {
        morph_record r = fixture_record(3, 3, variant == 3 ? 1 : 11);
        int samples = r.samples;
        if (variant == 0) r.base = NAN;
        if (variant == 1) r.target_triangles = 0;
        if (variant == 2) r.samples = 0;
        if (morph_picture_write(&r, NULL, path, message, sizeof message) != MORPH_OK)
            fail_msg("%d: %s", variant, message);
        unlink(path);
        r.samples = samples;
        morph_record_free(&r);
    }
}

static void hidden_parts(void **state) {
    (void)state;
    morph_record r = fixture_record(3, 3, 3);
    morph_view view = morph_view_from(-M_PI / 2, 0);
    view.scale = 1000;
    morph_relief relief;
    assert_int_equal(morph_relief_create(&r, &view, &relief), MORPH_OK);
    double radius = 0.3 * 0.1 * 2, ahead[3] = {0, -radius - 0.001, radius}, behind[3] = {0, 0, radius},
           beside[3] = {radius + 0.001, 0.5, radius}, at[3], lift[3] = {0, 0, 3 * radius};
    morph_view_point(&view, ahead, at);
    assert_true(morph_relief_shows(&relief, &view, NULL, at, 0));
    morph_view_point(&view, behind, at);
    assert_false(morph_relief_shows(&relief, &view, NULL, at, 0));
    assert_true(morph_relief_shows(&relief, &view, lift, at, 0)); /* the target stands higher then */
    morph_view_point(&view, beside, at);
    assert_true(morph_relief_shows(&relief, &view, NULL, at, 0));
    morph_relief_free(&relief);
    morph_record_free(&r);
}

static void ticks(void **state) {
    (void)state;
    static const double ranges[][2] = {{0, 4}, {0.0675, 0.1425}, {-3e-7, 9e-7}, {0, 12345}, {0.1, 0.10001}};
    for (size_t k = 0; k < sizeof ranges / sizeof ranges[0]; k++) {
        double first, step;
        int count, digits;
        step = morph_ticks(ranges[k][0], ranges[k][1], 6, &first, &count, &digits);
        assert_in_range(count, 3, 8);
        assert_true(first >= ranges[k][0] - 1e-6 * step);
        assert_true(first + (count - 1) * step <= ranges[k][1] + 1e-6 * step);
        double mantissa = step / pow(10, floor(log10(step) + 1e-9));
        assert_true(fabs(mantissa - 1) < 1e-6 || fabs(mantissa - 2) < 1e-6 || fabs(mantissa - 5) < 1e-6);
    }
    double first;
    int count, digits;
    morph_ticks(1, 1, 6, &first, &count, &digits);
    assert_int_equal(count, 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png),
        cmocka_unit_test(svg),
        cmocka_unit_test(panels),
        cmocka_unit_test(refusals),
        cmocka_unit_test(sparse_records),
        cmocka_unit_test(cavity_png),
        cmocka_unit_test(cavity_svg),
        cmocka_unit_test(cavity_refusals),
        cmocka_unit_test(gap_tones),
        cmocka_unit_test(hidden_parts),
        cmocka_unit_test(ticks),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
