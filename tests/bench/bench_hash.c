/* Nanoseconds per box of the spatial hash against the number of boxes, at the same density; and against one
 * pass over all pairs where that is bearable. */
#include "model/spatial_hash.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* Of this process: other work on the machine counts less. */
static double now(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

static uint64_t seed = 1;
static double uniform(double lo, double hi) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(seed >> 11) / 9007199254740992.0;
}

/* Boxes of sides 0.5 to 1, one per unit of volume: about three overlaps each; mixed: one in a hundred is
 * 30 times as wide. */
static void fill(morph_box *box, int n, int mixed) {
    const double side = cbrt((double)n);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const double size = (mixed && i % 100 == 0 ? 30.0 : 1.0) * uniform(0.5, 1.0) * 0.9;
            box[i].lo[k] = uniform(0.0, side);
            box[i].hi[k] = box[i].lo[k] + size;
        }
}

static double all_pairs(const morph_box *box, int n) {
    const double begin = now();
    volatile int found = 0;
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++)
            if (morph_box_overlap(&box[i], &box[j])) found = found + 1;
    return now() - begin;
}

int main(void) {
    enum { MOST = 1 << 20 };
    morph_box *box = morph_alloc(MOST, sizeof *box);
    morph_hash *hash;
    if (!box || morph_hash_create(&hash) != MORPH_OK) return 1;
    printf("%8s %6s %10s %12s %14s %14s\n", "boxes", "mixed", "pairs", "ns per box", "ns per b+p",
           "all pairs, ns");
    for (int mixed = 0; mixed < 2; mixed++)
        for (int n = 1 << 10; n <= (mixed ? 1 << 16 : MOST); n *= 4) {
            const int(*pair)[2];
            int pairs;
            fill(box, n, mixed);
            double least = 1e30;
            /* The first call allocates. */
            for (int round = 0; round < 6; round++) {
                const double begin = now();
                if (morph_hash_self(hash, n, box, &pair, &pairs) != MORPH_OK) return 1;
                const double seconds = now() - begin;
                if (round > 0) least = fmin(least, seconds);
            }
            printf("%8d %6s %10d %12.0f %14.1f", n, mixed ? "yes" : "no", pairs, 1e9 * least / n,
                   1e9 * least / (n + pairs));
            if (n <= 1 << 14)
                printf(" %14.0f\n", 1e9 * all_pairs(box, n) / n);
            else
                printf(" %14s\n", "-");
        }
    morph_hash_destroy(hash);
    free(box);
    return 0;
}
