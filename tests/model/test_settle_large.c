/* Settle with friction on grids of 16 x 16. */
#include "settle_check.h"

static void sphere(void **state) {
    (void)state;
    rest(16, SPHERE, 0.4, NULL, 0);
}

static void box(void **state) {
    (void)state;
    rest(16, BOX, 0.4, NULL, 0);
}

static void saddle(void **state) {
    (void)state;
    rest(16, SADDLE, 0.4, NULL, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(sphere), cmocka_unit_test(box),
                                       cmocka_unit_test(saddle)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
