/* Settle with friction on a grid of 16 x 16 over a sphere, and of 12 x 12 over a saddle, where contacts and
 * the friction they allow drive each other; with an argument 16 x 16 over a box or a saddle instead (the
 * saddle takes minutes): test_settle_large [box|saddle]. */
#include "settle_check.h"

static void sphere(void **state) {
    (void)state;
    /* Minutes under sanitizers, for what smaller grids show. */
    if (getenv("MORPH_SANITIZE")) skip();
    rest(16, SPHERE, 0.4, NULL, 0);
}

static void small_saddle(void **state) {
    (void)state;
    if (getenv("MORPH_SANITIZE")) skip();
    rest(12, SADDLE, 0.4, NULL, 0);
}

static void box(void **state) {
    (void)state;
    rest(16, BOX, 0.4, NULL, 0);
}

static void saddle(void **state) {
    (void)state;
    rest(16, SADDLE, 0.4, NULL, 0);
}

int main(int argc, char **argv) {
    const char *name = argc > 1 ? argv[1] : "sphere";
    const struct CMUnitTest over_sphere[] = {cmocka_unit_test(sphere), cmocka_unit_test(small_saddle)},
                            over_box[] = {cmocka_unit_test(box)}, over_saddle[] = {cmocka_unit_test(saddle)};
    if (strcmp(name, "box") == 0) return cmocka_run_group_tests(over_box, NULL, NULL);
    if (strcmp(name, "saddle") == 0) return cmocka_run_group_tests(over_saddle, NULL, NULL);
    return cmocka_run_group_tests(over_sphere, NULL, NULL);
}
