/* Files that are no scene: broken YAML, hostile ones, thousands of faults, none at all. */
#include "tests/planner/test_scene_fault_fixture.h"

static char *repeated(const char *piece, size_t bytes, size_t *size) {
    const size_t n = strlen(piece), times = bytes / n;
    char *text = malloc(n * times + 1);
    assert_non_null(text);
    for (size_t k = 0; k < times; k++)
        memcpy(text + k * n, piece, n);
    text[n * times] = '\0';
    *size = n * times;
    return text;
}

/* What is no scene at all. */
static void test_syntax(void **state) {
    (void)state;
    static const struct {
        const char *text;
        int line;
        const char *phrase;
    } bad[] = {
        {"", 1, "the file is empty"},
        {"# only a comment\n", 1, "the file is empty"},
        {"---\n...\n", 2, "nothing, allowed: a mapping"},
        {"hello\n", 1, "hello, allowed: a mapping"},
        {"- 1\n- 2\n", 1, "a list of 2, allowed: a mapping"},
        {"morphplan: 1\nstructure: [4\ntarget: x\n", 3, "not YAML"},
        {"morphplan: 1\n  structure: 2\n", 2, "not YAML"},
        {"morphplan: 1\nstructure:\n\tnodes: 1\n", 3, "not YAML"},
        {"morphplan: \"1\n", 2, "not YAML"},
        {"a: 1\n---\nb: 2\n", 2, "a second document"},
        {"a: &x 1\nb: *x\n", 1, "&x: anchors and aliases"},
        {"a: &x 1\nb: *x\n", 2, "*x: anchors and aliases"},
        {"a: 1\nb: !!float 2\n", 2, "tags are not used"},
        {"a: \"x\\0y\"\n", 1, "zero byte"},
        {"a: 1\nb: \xff\n", 2, "byte 0xff is not UTF-8"},
        {"a: 1\nb: \xc0\xaf\n", 2, "byte 0xc0 is not UTF-8"},
        {"a: 1\r\nb: 2\r\nc: \xed\xa0\x80\r\n", 3, "byte 0xed is not UTF-8"},
        {"a: 1\nb: \xe2\x82", 2, "byte 0xe2 is not UTF-8"},
        {"a: 1\nb: \x01\n", 2, "control character 0x01"},
        {"\xff\xfe"
         "a",
         1, "not UTF-8"},
        {"\x7f"
         "ELF",
         1, "control character"},
        {"%YAML 3.0\n---\na: 1\n", 1, "not YAML"},
        {"a: [[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]\n", 1, "nested deeper than 16"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        parse_bad(bad[k].text, strlen(bad[k].text));
        expect(bad[k].line, "scene", bad[k].phrase);
    }
    /* Within a megabyte, but far more values than any scene has. */
    size_t size;
    char *many = repeated("- 1\n", 400000, &size);
    parse_bad(many, size);
    expect(MORPH_YAML_NODES, "scene", "more than 50000 values");
    assert_int_equal(faults.count, 1);
    free(many);
    parse_bad("a: 1\0b", 6);
    expect(1, "scene", "control character 0x00");
    /* A byte order mark is fine. */
    static const char marked[] =
        "\xef\xbb\xbfmorphplan: 1\nstructure: {nodes: [4, 4], spacing: 0.1}\n"
        "target: {shape: box, size: [0.1, 0.1, 0.1]}\n";
    morph_scene *scene;
    assert_int_equal(morph_scene_parse("s.yaml", marked, strlen(marked), NULL, NULL, NULL, &scene), MORPH_OK);
    morph_scene_destroy(scene);
}

/* A megabyte of anything is answered quickly: each within a second. */
static void test_hostile(void **state) {
    (void)state;
    static const char *const pieces[] = {
        "[",      "{",     "- ",     "? ",    "a: ",    "a:\n", "- a\n", "{a: ", "[a, ",
        "\"a\" ", "x",     "\n",     "#\n",   "a: {\n", "&a ",  "*a ",   "!t ",  "'",
        "\"\\x",  "|\n ",  "%a\n",   "---\n", ": ",     ",",    "]",     "\t",   "\xf0\x9f\x98\x80",
        "[],",    "a,b: ", "- - -\n"};
    for (size_t k = 0; k < sizeof pieces / sizeof *pieces; k++) {
        size_t size;
        char *text = repeated(pieces[k], (size_t)MORPH_YAML_BYTES, &size);
        const double start = morph_seconds();
        parse_bad(text, size);
        const double seconds = morph_seconds() - start;
        if (seconds > 0.2) print_message("%.2f s for a megabyte of \"%s\"\n", seconds, pieces[k]);
        assert_true(seconds < 20.0); /* a loaded machine and sanitizers: what it must not be is quadratic */
        free(text);
    }
    size_t size;
    char *text = repeated("# just too much\n", (size_t)MORPH_YAML_BYTES + 32, &size);
    parse_bad(text, size);
    expect(1, "scene", "larger than 1 MiB");
    free(text);
}

/* Thousands of faults end in a count. */
static void test_many_faults(void **state) {
    (void)state;
    char *text = malloc(200000);
    assert_non_null(text);
    size_t used = (size_t)snprintf(text, 200000, "morphplan: 1\nmotion:\n  touch:\n");
    for (int k = 0; k < 3000; k++)
        used += (size_t)snprintf(text + used, 200000 - used, "    - {a%d: 1}\n", k);
    parse_bad(text, used);
    assert_int_equal(faults.count, MORPH_YAML_FAULTS);
    free(text);
}

static void test_missing_files(void **state) {
    (void)state;
    morph_scene *scene;
    faults.count = 0;
    assert_int_equal(morph_scene_read("/no/such/scene.yaml", keep, ignore, &faults, &scene), MORPH_ERR_INPUT);
    assert_null(scene);
    assert_int_equal(faults.count, 1);
    assert_non_null(strstr(faults.text[0], "/no/such/scene.yaml:1: scene: cannot be read: No such file"));
    /* One line, whatever the name. */
    faults.count = 0;
    assert_int_equal(morph_scene_read("no\nsuch\tscene", keep, ignore, &faults, &scene), MORPH_ERR_INPUT);
    assert_int_equal(strncmp(faults.text[0], "no?such?scene:1: scene: cannot be read", 38), 0);
    faults.count = 0;
    assert_int_equal(morph_scene_read("/tmp", keep, ignore, &faults, &scene), MORPH_ERR_INPUT);
    assert_int_equal(faults.count, 1);
    assert_int_equal(morph_scene_read("/dev/null", keep, ignore, &faults, &scene), MORPH_ERR_INPUT);
    assert_int_equal(morph_scene_read("/dev/zero", keep, ignore, &faults, &scene), MORPH_ERR_INPUT);
    assert_non_null(strstr(faults.text[2], "larger than 1 MiB"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_syntax),
        cmocka_unit_test(test_hostile),
        cmocka_unit_test(test_many_faults),
        cmocka_unit_test(test_missing_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
