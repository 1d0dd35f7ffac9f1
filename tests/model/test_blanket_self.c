/* The pairs of links and posts that contact of the blanket with itself lists, against all pairs one by one:
 * while a sheet crumples step by step, nothing that can meet is left out and nothing else is listed. */
#include "model/blanket_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

/* As in model/blanket_self.c, spacings: what is listed beyond a step's moves, and what is aimed at. */
#define LISTED 0.05
#define AIM 1e-3

static double next_random(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0 - 0.5;
}

static const int *bar_of(const morph_structure *s, int n) {
    return n < s->links ? s->link[n] : s->post[n - s->links];
}

/* Pairs that may meet in the step from b->before, each looked at. */
static int count_all(const morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const int bars = s->links + s->posts;
    int count = 0;
    for (int m = 0; m < bars; m++)
        for (int n = m + 1; n < bars; n++) {
            const int *p = bar_of(s, m), *q = bar_of(s, n);
            if (p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1]) continue;
            double u, v;
            const double apart = morph_segment_segment(&b->before[3 * p[0]], &b->before[3 * p[1]],
                                                       &b->before[3 * q[0]], &b->before[3 * q[1]], &u, &v);
            const double radii = (m < s->links ? s->link_radius[m] : s->def.radius) +
                                 (n < s->links ? s->link_radius[n] : s->def.radius);
            const double moves = fmax(b->move[p[0]], b->move[p[1]]) + fmax(b->move[q[0]], b->move[q[1]]);
            if (apart <= radii + moves + (AIM + LISTED) * s->spacing) count++;
        }
    return count;
}

/* Joints drift towards a crumpled pose with a jitter of their own; all fall besides. */
static void test_against_all(void **state) {
    (void)state;
    enum { STEPS = 60 };
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = 6;
    def.nodes[1] = 5;
    morph_structure *s;
    morph_blanket_state *b;
    const morph_blanket_def fall = {.gravity = 9.81, .time = 1.0, .frame = 0.02, .base = NAN};
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    assert_int_equal(morph_blanket_state_create(s, NULL, &fall, s->start, &b), MORPH_OK);
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    uint64_t seed = 7;
    int most = 0, steps_without = 0;
    for (int k = 0; k < STEPS; k++) {
        memcpy(b->before, b->x, bytes);
        for (int i = 0; i < 3 * b->joints; i++)
            b->x[i] += s->spacing * (0.04 * next_random(&seed) - (i % 3 == 2 ? 0.1 : 0.0)) -
                       (i % 3 < 2 ? 0.02 * b->x[i] : 0.0);
        morph_blanket_note_moves(b, b->x);
        assert_int_equal(morph_blanket_find_self(b), MORPH_OK);
        const int all = count_all(b);
        assert_int_equal(morph_blanket_self_count(b), all);
        most = all > most ? all : most;
        if (all == 0) steps_without++;
        morph_blanket_add_paths(b);
        if (k == STEPS / 2) morph_blanket_forget(b);
    }
    print_message("%d steps: none listed in %d of them, %d at most\n", STEPS, steps_without, most);
    assert_true(most > 50);
    assert_true(steps_without > 0);
    morph_blanket_state_destroy(b);
    morph_structure_destroy(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_against_all)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
