/* Reading YAML with every fault kept. Internal to the scene reader; nothing outside planner/scene*.c needs
 * it.
 *
 * A document is opened once; its values are then asked for by key, and whatever does not fit is kept as one
 * line "FILE:LINE: key: what is wrong, what is allowed". Nothing is printed. Anchors, aliases and tags are
 * refused, so every node is reached by one path only. */
#ifndef MORPH_YAML_H
#define MORPH_YAML_H

#include "solvers/base.h"

#include <yaml.h>

/* A file larger, nested deeper or with more values than this is no scene: a scene nests 4 deep and holds
 * about 60 keys, and 64 x 64 nodes listed one by one are 12288 values. The limits bound what hostile input
 * can cost. */
enum {
    MORPH_YAML_BYTES = 1 << 20,
    MORPH_YAML_DEPTH = 16,
    MORPH_YAML_NODES = 50000,
    MORPH_YAML_KEYS = 256,
    MORPH_YAML_FAULTS = 1000
};

typedef struct morph_fault {
    int line, order;
    char *text;
} morph_fault;

/* order numbers the faults as found, so that sorting by line is stable. */
typedef struct morph_faults {
    morph_fault *fault;
    int count, capacity;
    int dropped; /* beyond MORPH_YAML_FAULTS */
    bool nomem;  /* a fault could not be kept: the status must be MORPH_ERR_NOMEM */
} morph_faults;

typedef struct morph_yaml {
    const char *path; /* for the lines of faults; borrowed */
    morph_faults faults, warnings;
    yaml_document_t document;
    bool loaded;
} morph_yaml;

/* A value and where it stands. node NULL: the key is absent. */
typedef struct morph_value {
    morph_yaml *yaml;
    const yaml_node_t *node;
    int line;       /* of the key or list entry; of the section if absent */
    char path[112]; /* "structure.link.length", "motion.touch[2].node" */
} morph_value;

/* What came of asking for a value: MORPH_FAULTY has left a fault line, and the output as it was. */
typedef enum morph_found { MORPH_ABSENT, MORPH_FOUND, MORPH_FAULTY } morph_found;

/* lo..hi; unit for messages, may be "". */
typedef struct morph_range {
    double lo, hi;
    int above; /* 0: with both ends, 1: without lo, 2: without either */
    const char *unit;
} morph_range;

/* --- faults (scene_fault.c) --- */

/* Keeps "PATH:LINE: key: TEXT"; characters that would break the line are replaced. */
#if defined(__GNUC__)
__attribute__((format(printf, 4, 5)))
#endif
void morph_fault_add(morph_yaml *yaml, int line, const char *key, const char *format, ...);
/* A fault at a value: at the scalar's own line, else at its key's. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void morph_value_fault(const morph_value *value, const char *format, ...);
/* Same, as a warning. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void morph_value_warn(const morph_value *value, const char *format, ...);
/* "not available yet: KEY: what": the value is understood and its feature comes later. */
void morph_value_later(const morph_value *value, const char *what);
/* Sorts by line; ends with a line that counts dropped faults, if any. */
void morph_faults_sort(morph_faults *faults);
void morph_faults_free(morph_faults *faults);
/* The name closest to word, or NULL if none is close enough to be meant. */
const char *morph_closest_name(const char *word, const char *const *names, int count);
/* Joins names by ", " into text. */
void morph_join_names(const char *const *names, int count, char *text, size_t size);

/* --- documents and values (scene_yaml.c) --- */

/* Loads the one document of bytes[size]. MORPH_ERR_INPUT with at least one fault, MORPH_ERR_NOMEM. The caller
 * closes in either case. */
morph_status morph_yaml_open(morph_yaml *yaml, const char *path, const char *bytes, size_t size);
void morph_yaml_close(morph_yaml *yaml);

/* The document's root, path "". */
morph_value morph_yaml_root(morph_yaml *yaml);
/* The value under key of a mapping (absent as well if `map` is none). */
morph_value morph_value_get(const morph_value *map, const char *key);
/* Entry i of a list, 0 <= i < morph_value_count. */
morph_value morph_value_item(const morph_value *list, int i);
int morph_value_count(const morph_value *list); /* 0 if it is no list */
bool morph_value_is_list(const morph_value *value);
bool morph_value_is_map(const morph_value *value);
bool morph_value_is_empty(const morph_value *value); /* "key:" with nothing behind it */
bool morph_value_is(const morph_value *value, const char *word);
/* The value in a few words for a message: `12`, `"12"`, `a list of 3`, `a mapping`, `nothing`. */
void morph_value_describe(const morph_value *value, char *text, size_t size);

/* A finite number within range, the whole token, '.' as decimal point (the C locale must be set). */
morph_found morph_value_number(const morph_value *value, const morph_range *range, double *out);
morph_found morph_value_integer(const morph_value *value, long lo, long hi, long *out);
/* A list of exactly n numbers (whole numbers). */
morph_found morph_value_numbers(const morph_value *value, const morph_range *range, int n, double *out);
morph_found morph_value_integers(const morph_value *value, const long *lo, const long *hi, int n, long *out);
/* A list of two numbers, the first not above the second. */
morph_found morph_value_pair(const morph_value *value, const morph_range *range, double out[2]);
/* One of count names; *out is its index. */
morph_found morph_value_choice(const morph_value *value, const char *const *names, int count, int *out);
/* One line of text of at most `most` bytes, as a copy to free(). */
morph_found morph_value_text(const morph_value *value, size_t most, char **out);

/* --- numbers (scene_number.c); all need a locale whose decimal point is '.' --- */

typedef enum morph_number_kind {
    MORPH_NUMBER_GOOD,
    MORPH_NUMBER_NONE,
    MORPH_NUMBER_NONFINITE
} morph_number_kind;
/* Decimal numbers only: no hexadecimal, no blanks, no suffix. Too large, nan and inf are NONFINITE. */
morph_number_kind morph_number_parse(const char *text, double *out);
/* The shortest decimal that reads back to the same double. text has MORPH_NUMBER_TEXT bytes. */
enum { MORPH_NUMBER_TEXT = 32 };
void morph_number_print(double x, char *text);
double morph_radians(double degrees);
double morph_degrees(double radians);
/* The shortest decimal of degrees that morph_radians turns into the same radians; the closest one if there is
 * none (radians that did not come from degrees). Returns the degrees that text says. */
double morph_degrees_print(double radians, char *text);

#endif
