/* What the clearances of finished plans cost: the search by motion bounds alone, and with the swept test as
 * the prover of spans. bench_check DIR... reads plan folders. */
#include "planner/check_parts.h"
#include "planner/folder.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

enum { REPEATS = 5 };

typedef morph_status (*part)(const morph_record *, const morph_control *, morph_findings *);

static double cpu_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The least of some runs' CPU seconds. */
static bool run(const morph_record *r, part test, morph_margin_kind kind, const char *name, bool plain) {
    double least = INFINITY;
    morph_findings f;
    for (int k = 0; k < REPEATS; k++) {
        memset(&f, 0, sizeof f);
        f.plain = plain;
        const double begin = cpu_now();
        if (test(r, NULL, &f) != MORPH_OK) return false;
        least = fmin(least, cpu_now() - begin);
    }
    printf("  %-15s %-14s %9ld distances %7ld proofs %8.2f ms  margin %.9g at %.6g s\n", name,
           plain ? "motion bounds" : "swept too", f.evaluations, f.proofs, 1e3 * least, f.kind[kind].worst,
           f.kind[kind].time);
    return true;
}

int main(int count, char **folder) {
    for (int i = 1; i < count; i++) {
        morph_record r;
        char message[256];
        if (morph_folder_read(folder[i], &r, message, sizeof message) != MORPH_OK) {
            fprintf(stderr, "%s: %s\n", folder[i], message);
            return 1;
        }
        printf("%s: %d samples, %d bars, %d skin triangles, %d of the target\n", folder[i], r.samples,
               r.links + r.posts, r.skin_triangles, r.target_triangles);
        bool good = true;
        for (int plain = 1; plain >= 0 && good; plain--)
            good = run(&r, morph_check_self, MORPH_MARGIN_SELF_CLEARANCE, "self-clearance", plain) &&
                   run(&r, morph_check_clearance, MORPH_MARGIN_CLEARANCE, "clearance", plain);
        morph_record_free(&r);
        if (!good) return 1;
    }
    return 0;
}
