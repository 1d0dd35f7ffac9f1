/* The blanket's bits: the same trajectory on repeats, after other runs, in another process whose memory comes
 * filled with other bytes, and from model/ compiled without optimisation.
 *
 * The program is built twice. Called with `hashes` it prints the hash of each run and ends; as a test it
 * compares its own with those of the other build (MORPH_BITS_OTHER, model/ at -O0). Elsewhere than in model/
 * (the sparse solver, its BLAS) both are the same. */
#include "model/blanket.h"
#include "tests/model/solids.h"

enum { RUNS = 6, OTHERS = 2 };

/* Knuth's step over the bits, in order. */
static uint64_t mix(uint64_t hash, const void *data, size_t bytes) {
    const unsigned char *at = data;
    for (size_t k = 0; k < bytes; k++)
        hash = (hash ^ at[k]) * 1099511628211u;
    return hash;
}

/* 0 box, 1 ball, 2 box braced with attraction and a hand, 3 ball rising into a held border, 4 universal over
 * the box, 5 prescribed lengths. */
static morph_structure *sheet(int run) {
    morph_structure_def def = morph_structure_defaults(0.1);
    def.nodes[0] = def.nodes[1] = 4;
    def.stiffness = run == 1 ? 20.0 : 200.0;
    if (run == 2) def.bracing = MORPH_BRACING_FULL;
    if (run == 3) def.fixed = MORPH_FIXED_BORDER;
    if (run == 4) def.joints = MORPH_JOINTS_UNIVERSAL;
    morph_structure *s;
    assert_int_equal(morph_structure_create(&def, &s), MORPH_OK);
    return s;
}

static void target(int run) {
    if (run == 1 || run == 3)
        make_sphere(3);
    else
        make_box(0.075, 0.075, 0.045);
    for (int i = 0; i < 3 * made.nv; i++)
        made.v[i] = (run == 1 || run == 3 ? 0.09 : 1.0) * made.v[i] + (i % 3 == 2 ? -0.05 : 0.0);
}

static uint64_t hash_run(int run, double time) {
    static const double lo[3] = {-0.25, -0.25, -0.3}, hi[3] = {0.25, 0.25, 0.3};
    const morph_hand hand = {5, {0.3, 0.1, -0.2}, 0.1, 0.3};
    const morph_attractor centre = {{0.01, 0.02, -0.05}, 0.01};
    morph_structure *s = sheet(run);
    target(run);
    morph_distance *exact = finish(true);
    morph_sdf *sdf;
    assert_int_equal(morph_sdf_create(exact, lo, hi, 0.01, NULL, &sdf), MORPH_OK);
    double *x0 = malloc(3 * (size_t)s->joints * sizeof *x0);
    double *length = malloc(2 * (size_t)s->links * sizeof *length);
    assert_true(x0 && length);
    for (int k = 0; k < 3 * s->joints; k++)
        x0[k] = s->start[k] + (k % 3 == 2 ? 0.06 : 0.0);
    for (int l = 0; l < 2 * s->links; l++)
        length[l] = s->start_length[l % s->links] * (l < s->links ? 1.0 : 1.0 + 0.02 * (l % 7));
    const morph_drive drive = {2, 0.3, length};
    morph_blanket_def def = {
        .gravity = 9.81, .drag = 0.2, .friction = 0.4, .time = time, .frame = 0.02, .base = -0.1};
    if (run == 2) {
        def.hands = &hand;
        def.attractors = &centre;
        def.hand_count = def.attractor_count = 1;
    }
    if (run == 3) {
        def.fixed = s->fixed_joint;
        def.fixed_count = s->fixed_joints;
        def.base = NAN;
        def.rise = 0.1;
        def.rise_time = 0.5;
    }
    if (run == 5) def.drive = &drive;
    morph_trajectory t;
    morph_blanket_report report;
    assert_int_equal(morph_blanket_run(s, sdf, exact, &def, x0, NULL, &t, &report), MORPH_OK);
    uint64_t hash = mix(14695981039346656037u, t.x, (size_t)t.frames * 3 * (size_t)t.joints * sizeof *t.x);
    hash = mix(hash, t.lift, (size_t)t.frames * sizeof *t.lift);
    hash = mix(hash, &report.worst_clearance, sizeof report.worst_clearance);
    hash = mix(hash, &report.steps, sizeof report.steps);
    morph_trajectory_free(&t);
    free(x0);
    free(length);
    morph_sdf_destroy(sdf);
    morph_distance_destroy(exact);
    morph_structure_destroy(s);
    return hash;
}

static const double duration = 0.6;
static const char *own_path;

static void test_repeats(void **state) {
    (void)state;
    uint64_t first[RUNS];
    for (int run = 0; run < RUNS; run++)
        first[run] = hash_run(run, duration);
    /* Backwards: every run comes after another one than before. */
    for (int run = RUNS - 1; run >= 0; run--)
        assert_true(hash_run(run, duration) == first[run]);
    for (int run = 1; run < RUNS; run++)
        assert_true(first[run] != first[run - 1]);
    /* A hash that does not feel the motion would prove nothing. */
    assert_true(hash_run(0, duration + 0.02) != first[0]);
}

/* Hashes that a program prints when it is called with `hashes`. */
static void hashes_of(const char *environment, const char *program, uint64_t hash[RUNS]) {
    char command[4096];
    snprintf(command, sizeof command, "%s '%s' hashes", environment, program);
    FILE *from = popen(command, "r");
    assert_non_null(from);
    for (int run = 0; run < RUNS; run++) {
        unsigned long long value;
        assert_int_equal(fscanf(from, "%llx", &value), 1);
        hash[run] = value;
    }
    assert_int_equal(pclose(from), 0);
}

static void test_other_processes(void **state) {
    (void)state;
    static const char *const environment[OTHERS] = {"MALLOC_PERTURB_=85", "MALLOC_PERTURB_=254"};
    for (int k = 0; k < OTHERS; k++) {
        uint64_t hash[RUNS];
        hashes_of(environment[k], own_path, hash);
        for (int run = 0; run < RUNS; run++)
            if (hash[run] != hash_run(run, duration)) fail_msg("run %d differs with %s", run, environment[k]);
    }
}

static void test_unoptimised(void **state) {
    (void)state;
    uint64_t hash[RUNS];
    hashes_of("", MORPH_BITS_OTHER, hash);
    for (int run = 0; run < RUNS; run++) {
        const uint64_t own = hash_run(run, duration);
        print_message("run %d: %016llx here, %016llx at -O0\n", run, (unsigned long long)own,
                      (unsigned long long)hash[run]);
        if (own != hash[run]) fail_msg("run %d differs", run);
    }
}

int main(int count, char **argument) {
    morph_blas_threads(1);
    own_path = argument[0];
    if (count == 2 && strcmp(argument[1], "hashes") == 0) {
        for (int run = 0; run < RUNS; run++)
            printf("%016llx\n", (unsigned long long)hash_run(run, duration));
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_repeats),
        cmocka_unit_test(test_other_processes),
        cmocka_unit_test(test_unoptimised),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
