/* The plan folder appears whole or not at all, and never costs anyone the old one. */
#define _GNU_SOURCE /* unshare */
#include "folder_fixture.h"

#include "planner/folder.h"
#include "planner/folder_place.h"
#include "planner/sha256.h"

#include <dirent.h>
#include <errno.h>
#include <sched.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static char scratch[64];  /* the parent of every plan folder here */
static char folder[96];   /* scratch/a.plan */
static char message[512]; /* of the last call */

static morph_scene scene_of(morph_shape shape, char *file) {
    morph_scene s = {.title = "Ball", .base = 0, .sample = 0.01};
    s.structure = (morph_structure_def){.nodes = {3, 3}, .spacing = 0.1, .thickness = 0.05};
    s.target_def = (morph_target_def){
        .shape = shape, .radius = 0.06, .scale = 1, .cell = 1, .file = file, .file_as_written = file};
    return s;
}

static morph_status write_plan(int samples, bool overwrite) {
    morph_record r = fixture_record(3, 3, samples);
    morph_scene scene = scene_of(MORPH_SHAPE_SPHERE, NULL);
    morph_summary summary = {.feasible = true, .has_plan = true, .outcome = "optimal"};
    message[0] = 0;
    morph_status status =
        morph_folder_write(folder, overwrite, &scene, &r, &summary, message, sizeof message);
    morph_record_free(&r);
    return status;
}

/* Samples of the plan that stands in the folder; -1 when there is none that reads. */
static int plan_samples(void) {
    morph_record r;
    int samples = morph_folder_read(folder, &r, message, sizeof message) == MORPH_OK ? r.samples : -1;
    morph_record_free(&r);
    return samples;
}

/* Entries of a folder without . and .. */
static int entries(const char *path) {
    DIR *open = opendir(path);
    if (!open) return -1;
    int n = -2;
    while (readdir(open))
        n++;
    closedir(open);
    return n;
}

static bool has(const char *name) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, R_OK) == 0;
}

static int setup(void **state) {
    (void)state;
    snprintf(scratch, sizeof scratch, "/tmp/morph-folder-XXXXXX");
    if (!mkdtemp(scratch)) return -1;
    snprintf(folder, sizeof folder, "%s/a.plan", scratch);
    return 0;
}

/* A test that leaves anything but its plan has failed. */
static int teardown(void **state) {
    (void)state;
    morph_place_remove(folder);
    return rmdir(scratch);
}

static char *load(const char *name, size_t *size) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    fseek(f, 0, SEEK_END);
    *size = (size_t)ftell(f);
    rewind(f);
    char *data = calloc(*size + 1, 1);
    assert_non_null(data);
    assert_int_equal(fread(data, 1, *size, f), *size);
    fclose(f);
    return data;
}

static void whole_folder(void **state) {
    (void)state;
    static const char *const names[] = {"plan.h5",      "scene.yaml",    "summary.json",
                                        "schedule.csv", "schedule.json", "report.html"};
    assert_int_equal(morph_folder_probe(folder, false, message, sizeof message), MORPH_OK);
    assert_int_equal(entries(scratch), 0);
    if (write_plan(20, false) != MORPH_OK) fail_msg("%s", message);
    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++)
        assert_true(has(names[k]));
    assert_int_equal(entries(folder), 6);
    assert_int_equal(entries(scratch), 1);
    assert_int_equal(plan_samples(), 20);
    size_t n, m;
    char *json = load("schedule.json", &n), hash[65];
    for (int k = 0; k < 2; k++) {
        char *data = load(k == 0 ? "schedule.csv" : "plan.h5", &m);
        morph_sha256_text(data, m, hash);
        assert_non_null(strstr(json, hash));
        free(data);
    }
    free(json);
}

static void same_bytes(void **state) {
    (void)state;
    static const char *const names[] = {"plan.h5", "schedule.csv", "schedule.json", "scene.yaml",
                                        "summary.json"};
    char *data[5];
    size_t n[5], m;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    for (int k = 0; k < 5; k++)
        data[k] = load(names[k], &n[k]);
    assert_int_equal(write_plan(20, true), MORPH_OK);
    for (int k = 0; k < 5; k++) {
        char *again = load(names[k], &m);
        assert_int_equal(m, n[k]);
        assert_memory_equal(again, data[k], m);
        free(again);
        free(data[k]);
    }
}

static void overwriting(void **state) {
    (void)state;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    assert_int_equal(morph_folder_probe(folder, false, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "is there already"));
    assert_non_null(strstr(message, "--overwrite"));
    assert_int_equal(write_plan(30, false), MORPH_ERR_INPUT);
    assert_int_equal(plan_samples(), 20);
    assert_int_equal(morph_folder_probe(folder, true, message, sizeof message), MORPH_OK);
    if (write_plan(30, true) != MORPH_OK) fail_msg("%s", message);
    assert_int_equal(plan_samples(), 30);
    assert_int_equal(entries(scratch), 1);
    /* By a link to it, and with a slash at the end. */
    char link[128], kept[96];
    snprintf(link, sizeof link, "%s/link", scratch);
    memcpy(kept, folder, sizeof kept);
    assert_int_equal(symlink("a.plan", link), 0);
    snprintf(folder, sizeof folder, "%s/link//", scratch);
    morph_status status = write_plan(40, true);
    memcpy(folder, kept, sizeof kept);
    if (status != MORPH_OK) fail_msg("%s", message);
    assert_int_equal(plan_samples(), 40);
    struct stat info;
    assert_int_equal(lstat(link, &info), 0);
    assert_true(S_ISLNK(info.st_mode));
    unlink(link);
}

static void never_replaced(void **state) {
    (void)state;
    char path[128];
    assert_int_equal(mkdir(folder, 0777), 0);
    assert_int_equal(morph_folder_probe(folder, true, message, sizeof message), MORPH_ERR_INPUT);
    assert_int_equal(write_plan(20, true), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "no plan folder"));
    snprintf(path, sizeof path, "%s/plan.h5", folder); /* the name alone is not enough */
    FILE *f = fopen(path, "w");
    fputs("mine", f);
    fclose(f);
    assert_int_equal(write_plan(20, true), MORPH_ERR_INPUT);
    assert_true(has("plan.h5"));
    unlink(path);
    rmdir(folder);
    /* A plan that has grown into more. */
    assert_int_equal(write_plan(20, false), MORPH_OK);
    snprintf(path, sizeof path, "%s/notes", folder);
    assert_int_equal(mkdir(path, 0777), 0);
    assert_int_equal(write_plan(30, true), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "more than the files"));
    assert_int_equal(plan_samples(), 20);
    rmdir(path);
    /* A file, and names that are none. */
    static const char *const bad[] = {"", "/", "/no/such/parent/a.plan", "/dev/null", "/dev/null/a.plan"};
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        assert_int_not_equal(morph_folder_probe(bad[k], true, message, sizeof message), MORPH_OK);
        assert_int_not_equal(strlen(message), 0);
        assert_null(strchr(message, '\n'));
    }
}

/* Runs the body in a child and returns its exit status. */
static int in_child(int (*body)(long), long value) {
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) _exit(body(value));
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 99;
}

static int write_limited(long bytes) {
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit limit = {(rlim_t)bytes, (rlim_t)bytes};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) return 90;
    morph_status status = write_plan(30, true);
    if (status == MORPH_OK) return 0;
    return status == MORPH_ERR_IO && strstr(message, "File too large") && strstr(message, folder) ? 1 : 91;
}

/* Every file in turn meets a limit; the old plan stands and nothing lies beside it. */
static void write_fails(void **state) {
    (void)state;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    int failures = 0;
    for (long limit = 0; limit < (16L << 20); limit = limit < 512 ? limit + 512 : limit * 3) {
        int code = in_child(write_limited, limit);
        assert_in_range(code, 0, 1);
        assert_int_equal(plan_samples(), code == 0 ? 30 : 20);
        assert_int_equal(entries(scratch), 1);
        assert_int_equal(entries(folder), 6);
        failures += code;
        if (code == 0) break;
    }
    assert_true(failures > 4);
}

static int write_full_disk(long kilobytes) {
    char options[32];
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) != 0) return 77;
    if (mount("tmpfs", scratch, "tmpfs", 0, "size=16m") != 0) return 77;
    if (write_plan(20, false) != MORPH_OK) return 90;
    struct stat info;
    long used = 0;
    static const char *const names[] = {"plan.h5",      "scene.yaml",    "summary.json",
                                        "schedule.csv", "schedule.json", "report.html"};
    for (int k = 0; k < 6; k++) {
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, names[k]);
        if (stat(path, &info) != 0) return 91;
        used += (info.st_size + 4095) / 4096 * 4;
    }
    snprintf(options, sizeof options, "size=%ldk", used + kilobytes);
    if (mount("tmpfs", scratch, "tmpfs", MS_REMOUNT, options) != 0) return 77;
    morph_status status = write_plan(30, true);
    if (entries(scratch) != 1 || entries(folder) != 6) return 92;
    char said[sizeof message];
    memcpy(said, message, sizeof said);
    if (plan_samples() != (status == MORPH_OK ? 30 : 20)) return 93;
    if (status == MORPH_OK) return 0;
    return status == MORPH_ERR_IO && strstr(said, "No space left") ? 1 : 94;
}

static void full_disk(void **state) {
    (void)state;
    int failures = 0, code = 1;
    for (long room = 0; room < 16384 && code == 1; room = room < 32 ? room + 16 : room * 2) {
        code = in_child(write_full_disk, room);
        if (code == 77) {
            print_message("a small disk cannot be mounted here: skipped\n");
            skip();
        }
        assert_in_range(code, 0, 1);
        failures += code;
    }
    assert_int_equal(code, 0);
    assert_true(failures > 5);
}

static int write_for_ever(long unused) {
    (void)unused;
    for (int k = 0;; k++)
        if (write_plan(20 + 10 * (k % 2), true) != MORPH_OK) return 90;
}

/* Killed at any moment: a whole plan stands, and the next run clears up. */
static void killed(void **state) {
    (void)state;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    for (int k = 0; k < 6; k++) {
        fflush(NULL);
        pid_t child = fork();
        if (child == 0) _exit(write_for_ever(0));
        struct timespec wait = {0, 20000000L + 43000000L * k};
        nanosleep(&wait, NULL);
        kill(child, SIGKILL);
        int status;
        waitpid(child, &status, 0);
        assert_true(WIFSIGNALED(status));
        assert_int_equal(morph_folder_probe(folder, true, message, sizeof message), MORPH_OK);
        assert_int_equal(entries(scratch), 1);
        assert_in_range(plan_samples(), 20, 30);
    }
}

/* A process number that is free: that of a child that has ended. */
static long dead_process(void) {
    pid_t child = fork();
    if (child == 0) _exit(0);
    waitpid(child, NULL, 0);
    return (long)child;
}

static void stale_folders(void **state) {
    (void)state;
    char stale[160], alive[160], other[160], aside[160];
    long dead = dead_process();
    snprintf(stale, sizeof stale, "%s/.a.plan.tmp-%ld-12ab", scratch, dead);
    snprintf(alive, sizeof alive, "%s/.a.plan.tmp-%ld-12ab", scratch, (long)getppid());
    snprintf(other, sizeof other, "%s/.b.plan.tmp-%ld-12ab", scratch, dead);
    snprintf(aside, sizeof aside, "%s/.a.plan.old-%ld-12ab", scratch, dead);
    mkdir(stale, 0777);
    mkdir(alive, 0777);
    mkdir(other, 0777);
    assert_int_equal(write_plan(20, false), MORPH_OK);
    assert_int_not_equal(access(stale, F_OK), 0);
    assert_int_equal(access(alive, F_OK), 0);
    assert_int_equal(access(other, F_OK), 0);
    /* Killed between the two renames of a swap: the old plan comes back. */
    assert_int_equal(rename(folder, aside), 0);
    assert_int_equal(morph_folder_probe(folder, true, message, sizeof message), MORPH_OK);
    assert_int_equal(plan_samples(), 20);
    assert_int_not_equal(access(aside, F_OK), 0);
    rmdir(alive);
    rmdir(other);
}

/* The way of systems without an atomic exchange. */
static void swap(void **state) {
    (void)state;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    char kept[96];
    memcpy(kept, folder, sizeof kept);
    snprintf(folder, sizeof folder, "%s/b.plan", scratch);
    assert_int_equal(write_plan(30, false), MORPH_OK);
    morph_place place = {
        .folder = strdup(kept), .parent = strdup(scratch), .name = strdup("a.plan"), .lock = -1};
    place.stage = strdup(folder);
    memcpy(folder, kept, sizeof kept);
    assert_int_equal(morph_place_swap(&place, message, sizeof message), MORPH_OK);
    assert_int_equal(plan_samples(), 30);
    assert_int_equal(entries(scratch), 1);
    /* With nothing to put in its place the old one comes back. */
    place.stage = strdup("/no/such/folder");
    assert_int_equal(morph_place_swap(&place, message, sizeof message), MORPH_ERR_IO);
    assert_non_null(strstr(message, "No such file"));
    assert_int_equal(plan_samples(), 30);
    morph_place_close(&place);
    assert_int_equal(entries(scratch), 1);
}

static void target_copied(void **state) {
    (void)state;
    char source[128];
    size_t n;
    static const char *const names[] = {"ball.obj", "schedule.csv"};
    static const char *const copies[] = {"ball.obj", "target_schedule.csv"};
    for (int k = 0; k < 2; k++) {
        snprintf(source, sizeof source, "%s/%s", scratch, names[k]);
        FILE *f = fopen(source, "w");
        fputs("v 1 2 3\n", f);
        fclose(f);
        morph_record r = fixture_record(3, 3, 20);
        morph_scene scene = scene_of(k == 0 ? MORPH_SHAPE_MESH : MORPH_SHAPE_HEIGHTMAP, source);
        morph_summary summary = {0};
        if (morph_folder_write(folder, true, &scene, &r, &summary, message, sizeof message) != MORPH_OK)
            fail_msg("%s", message);
        char *copy = load(copies[k], &n);
        assert_string_equal(copy, "v 1 2 3\n");
        free(copy);
        char *yaml = load("scene.yaml", &n);
        assert_non_null(strstr(yaml, copies[k]));
        assert_null(strstr(yaml, scratch));
        free(yaml);
        assert_int_equal(entries(folder), 7);
        /* The source has gone meanwhile: no plan, the old one stands. */
        unlink(source);
        assert_int_equal(morph_folder_write(folder, true, &scene, &r, &summary, message, sizeof message),
                         MORPH_ERR_IO);
        assert_non_null(strstr(message, source));
        assert_int_equal(plan_samples(), 20);
        assert_int_equal(entries(scratch), 1);
        morph_record_free(&r);
    }
}

static void reading_folders(void **state) {
    (void)state;
    morph_record r;
    assert_int_equal(morph_folder_read(folder, &r, message, sizeof message), MORPH_ERR_IO);
    assert_int_equal(mkdir(folder, 0777), 0);
    assert_int_equal(morph_folder_read(folder, &r, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "no plan.h5"));
    assert_int_equal(morph_folder_read("/dev/null", &r, message, sizeof message), MORPH_ERR_INPUT);
}

static void missing_parents(void **state) {
    (void)state;
    assert_int_equal(morph_folder_probe("/no/such/a.plan", false, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "/no/such"));
    assert_int_equal(morph_folder_probe("/dev/null/a.plan", false, message, sizeof message), MORPH_ERR_INPUT);
    assert_non_null(strstr(message, "/dev/null"));
}

static void save(const char *name, const char *data, size_t size) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
}

/* A file with `from` turned into `to`, of the same length, is found out by a line that starts with its name
 * and says `what`. */
static void expect_found(const morph_record *r, const char *name, const char *from, const char *to,
                         const char *what) {
    size_t n;
    char *data = load(name, &n), *found = NULL, *at = strstr(data, from);
    assert_non_null(at);
    assert_int_equal(strlen(from), strlen(to));
    memcpy(at, to, strlen(to));
    save(name, data, n);
    assert_int_equal(morph_folder_verify(folder, r, &found, message, sizeof message), MORPH_OK);
    if (!found || !strstr(found, name) || !strstr(found, what))
        fail_msg("%s: %s -> %s: %s", name, from, to, found ? found : "not found out");
    free(found);
    memcpy(at, from, strlen(from));
    save(name, data, n);
    free(data);
    assert_int_equal(morph_folder_verify(folder, r, &found, message, sizeof message), MORPH_OK);
    assert_null(found);
}

static void verifying(void **state) {
    (void)state;
    morph_record r;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    assert_int_equal(morph_folder_read(folder, &r, message, sizeof message), MORPH_OK);
    char *found, name[96], when[64];
    assert_int_equal(morph_folder_verify(folder, &r, &found, message, sizeof message), MORPH_OK);
    assert_null(found);
    /* One digit of one length, in the eighth row: link and time. */
    size_t n;
    char *csv = load("schedule.csv", &n), number[128], wrong[128], *row = csv;
    for (int k = 0; k < 8; k++)
        row = strchr(row, '\n') + 1;
    const size_t start = strcspn(row, ",");
    snprintf(number, sizeof number, "%.*s", (int)(start + 1 + strcspn(row + start + 1, ",")), row);
    memcpy(wrong, number, sizeof wrong);
    char *digit = strrchr(wrong, '.') + 2;
    *digit = *digit == '9' ? '1' : (char)(*digit + 1);
    morph_record_link_name(&r, 0, name, sizeof name);
    snprintf(when, sizeof when, "at %.9g s is", r.time[7]);
    expect_found(&r, "schedule.csv", number, wrong, name);
    expect_found(&r, "schedule.csv", number, wrong, when);
    expect_found(&r, "schedule.csv", number, wrong, "checksum");
    expect_found(&r, "schedule.csv", "time_s", "time_x", "time_x");
    free(csv);
    expect_found(&r, "schedule.json", "\"samples\": 20", "\"samples\": 21", "\"samples\"");
    expect_found(&r, "schedule.json", "], \"rate\": ", "], \"raze\": ", "\"rate\" of link 0 ");
    expect_found(&r, "schedule.json", "\"joints\": [0", "\"joints\": [9", "\"joints\" of link 0 ");
    expect_found(&r, "schedule.json", "{", "[", "is no JSON");
    expect_found(&r, "schedule.json", "\"schedule\": {", "\"schedula\": {", "holds no checksums");
    expect_found(&r, "schedule.json", "\"links\"", "\"linkz\"", "list of links");
    morph_record_free(&r);
}

/* Of two plans each file is sound, but not together; and nothing can be said of files that are not there. */
static void verifying_mixed(void **state) {
    (void)state;
    morph_record r;
    size_t n;
    char *found;
    assert_int_equal(write_plan(20, false), MORPH_OK);
    char *json = load("schedule.json", &n);
    assert_int_equal(write_plan(30, true), MORPH_OK);
    save("schedule.json", json, n);
    free(json);
    assert_int_equal(morph_folder_read(folder, &r, message, sizeof message), MORPH_OK);
    assert_int_equal(morph_folder_verify(folder, &r, &found, message, sizeof message), MORPH_OK);
    assert_non_null(found);
    assert_non_null(strstr(found, "plan.h5 "));
    assert_non_null(strstr(found, "schedule.csv "));
    free(found);
    static const char *const files[] = {"schedule.csv", "schedule.json"};
    for (int k = 0; k < 2; k++) {
        char path[256];
        assert_int_equal(write_plan(20, true), MORPH_OK);
        snprintf(path, sizeof path, "%s/%s", folder, files[k]);
        assert_int_equal(unlink(path), 0);
        assert_int_equal(morph_folder_verify(folder, &r, &found, message, sizeof message), MORPH_ERR_INPUT);
        assert_null(found);
        assert_non_null(strstr(message, path));
        assert_non_null(strstr(message, "is missing"));
    }
    /* Without a schedule there are none. */
    const int samples = r.samples;
    r.samples = 0;
    assert_int_equal(morph_folder_verify(folder, &r, &found, message, sizeof message), MORPH_OK);
    assert_null(found);
    r.samples = samples;
    morph_record_free(&r);
}

int main(void) {
#define EACH(f) cmocka_unit_test_setup_teardown(f, setup, teardown)
    const struct CMUnitTest tests[] = {
        EACH(whole_folder), EACH(same_bytes),      EACH(overwriting),     EACH(never_replaced),
        EACH(write_fails),  EACH(full_disk),       EACH(killed),          EACH(stale_folders),
        EACH(swap),         EACH(target_copied),   EACH(reading_folders), EACH(missing_parents),
        EACH(verifying),    EACH(verifying_mixed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
