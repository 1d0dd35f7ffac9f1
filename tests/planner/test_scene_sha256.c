/* SHA-256 on published vectors (FIPS 180-2, appendix B, and NIST's long message) and against its own pieces.
 */
#include "planner/sha256.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void test_vectors(void **state) {
    (void)state;
    static const struct {
        const char *text, *hash;
    } cases[] = {
        {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
        {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
        {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
        {"abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmnopqklmnopqrlmnopqrsmno"
         "pqrst"
         "nopqrstu",
         "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[65];
        morph_sha256_text(cases[k].text, strlen(cases[k].text), text);
        assert_string_equal(text, cases[k].hash);
    }
}

static void test_million(void **state) {
    (void)state;
    char thousand[1000], text[65];
    memset(thousand, 'a', sizeof thousand);
    morph_sha256 hash;
    morph_sha256_begin(&hash);
    for (int k = 0; k < 1000; k++)
        morph_sha256_add(&hash, thousand, sizeof thousand);
    morph_sha256_end(&hash, text);
    assert_string_equal(text, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

/* Every length around the padding's corner cases, fed in pieces of 1, 7 and 64 bytes: the same hash, and no
 * two lengths alike. */
static void test_pieces(void **state) {
    (void)state;
    char data[200], last[65] = "";
    for (size_t k = 0; k < sizeof data; k++)
        data[k] = (char)(k * 37 + 11);
    for (size_t n = 0; n <= sizeof data; n++) {
        char whole[65];
        morph_sha256_text(data, n, whole);
        assert_string_not_equal(whole, last);
        memcpy(last, whole, sizeof last);
        static const size_t steps[3] = {1, 7, 64};
        for (int s = 0; s < 3; s++) {
            morph_sha256 hash;
            char text[65];
            morph_sha256_begin(&hash);
            for (size_t at = 0; at < n; at += steps[s])
                morph_sha256_add(&hash, data + at, n - at < steps[s] ? n - at : steps[s]);
            morph_sha256_end(&hash, text);
            assert_string_equal(text, whole);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_vectors),
        cmocka_unit_test(test_million),
        cmocka_unit_test(test_pieces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
