/* Shared by the tests of bad scenes: what a text's faults are, and that one of them says what it should. */
#ifndef TEST_SCENE_FAULT_FIXTURE_H
#define TEST_SCENE_FAULT_FIXTURE_H

#include "planner/scene_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

typedef struct log_lines {
    char text[200][1024];
    int count;
} log_lines;

static inline void keep(void *user, const char *line) {
    log_lines *log = user;
    if (log->count < 200) snprintf(log->text[log->count], sizeof log->text[0], "%s", line);
    log->count++;
}

static inline void ignore(void *user, const char *line) {
    (void)user;
    (void)line;
}

static log_lines faults;

/* Parses bad text; the lines are in faults. */
static inline void parse_bad(const char *text, size_t size) {
    morph_scene *scene = NULL;
    faults.count = 0;
    const morph_status status = morph_scene_parse("s.yaml", text, size, keep, ignore, &faults, &scene);
    if (status != MORPH_ERR_INPUT) fail_msg("status %d for:\n%.600s", (int)status, text);
    assert_null(scene);
    assert_true(faults.count > 0);
    for (int k = 0; k < faults.count && k < 200; k++)
        assert_null(strchr(faults.text[k], '\n'));
}

/* A fault "s.yaml:LINE: KEY: ...phrase...". */
static inline void expect(int line, const char *key, const char *phrase) {
    char start[256];
    snprintf(start, sizeof start, "s.yaml:%d: %s: ", line, key);
    for (int k = 0; k < faults.count && k < 200; k++)
        if (strncmp(faults.text[k], start, strlen(start)) == 0 && strstr(faults.text[k], phrase)) return;
    for (int k = 0; k < faults.count && k < 200; k++)
        print_message("  %s\n", faults.text[k]);
    fail_msg("no fault \"%s\" with \"%s\"", start, phrase);
}

#endif
