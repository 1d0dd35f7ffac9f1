/* Values of a YAML document: found by key or index, read as numbers, names, lists; faults worded here. */
#include "planner/yaml.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const yaml_node_t *node_of(const morph_yaml *yaml, int index) {
    return yaml_document_get_node((yaml_document_t *)&yaml->document, index);
}

static const char *scalar(const morph_value *value) {
    return (const char *)value->node->data.scalar.value;
}

static bool is_scalar(const morph_value *value) {
    return value->node && value->node->type == YAML_SCALAR_NODE;
}

static bool is_plain(const morph_value *value) {
    return is_scalar(value) && value->node->data.scalar.style == YAML_PLAIN_SCALAR_STYLE;
}

bool morph_value_is_list(const morph_value *value) {
    return value->node && value->node->type == YAML_SEQUENCE_NODE;
}

bool morph_value_is_map(const morph_value *value) {
    return value->node && value->node->type == YAML_MAPPING_NODE;
}

bool morph_value_is_empty(const morph_value *value) {
    return is_plain(value) && value->node->data.scalar.length == 0;
}

bool morph_value_is(const morph_value *value, const char *word) {
    return is_scalar(value) && strcmp(scalar(value), word) == 0;
}

morph_value morph_yaml_root(morph_yaml *yaml) {
    morph_value root = {.yaml = yaml, .line = 1};
    root.node = yaml_document_get_root_node(&yaml->document);
    if (root.node) root.line = (int)root.node->start_mark.line + 1;
    return root;
}

morph_value morph_value_get(const morph_value *map, const char *key) {
    morph_value value = {.yaml = map->yaml, .line = map->line};
    snprintf(value.path, sizeof value.path, "%.90s%s%.20s", map->path, map->path[0] ? "." : "", key);
    if (!morph_value_is_map(map)) return value;
    const yaml_node_pair_t *pair = map->node->data.mapping.pairs.start;
    for (; pair < map->node->data.mapping.pairs.top; pair++) {
        const yaml_node_t *name = node_of(map->yaml, pair->key);
        if (!name || name->type != YAML_SCALAR_NODE ||
            strcmp((const char *)name->data.scalar.value, key) != 0)
            continue;
        value.node = node_of(map->yaml, pair->value);
        value.line = (int)name->start_mark.line + 1;
        break;
    }
    return value;
}

int morph_value_count(const morph_value *list) {
    if (!morph_value_is_list(list)) return 0;
    return (int)(list->node->data.sequence.items.top - list->node->data.sequence.items.start);
}

morph_value morph_value_item(const morph_value *list, int i) {
    morph_value value = {.yaml = list->yaml, .line = list->line};
    snprintf(value.path, sizeof value.path, "%.90s[%d]", list->path, i);
    value.node = node_of(list->yaml, list->node->data.sequence.items.start[i]);
    if (value.node) value.line = (int)value.node->start_mark.line + 1;
    return value;
}

/* Copies at most `most` bytes of text, never half a character, with "..." where it was cut. */
static void shorten(const char *from, size_t most, char *text, size_t size) {
    size_t n = strlen(from);
    const char *tail = "";
    if (n > most) {
        n = most;
        while (n > 0 && ((unsigned char)from[n] & 0xc0) == 0x80)
            n--;
        tail = "...";
    }
    snprintf(text, size, "%.*s%s", (int)n, from, tail);
}

void morph_value_describe(const morph_value *value, char *text, size_t size) {
    if (!value->node || morph_value_is_empty(value)) {
        snprintf(text, size, "nothing");
    } else if (is_scalar(value)) {
        char word[64];
        shorten(scalar(value), 48, word, sizeof word);
        snprintf(text, size, is_plain(value) ? "%s" : "\"%s\"", word);
    } else if (morph_value_is_list(value)) {
        snprintf(text, size, "a list of %d", morph_value_count(value));
    } else {
        snprintf(text, size, "a mapping");
    }
}

enum { ALLOWED = 160, DESCRIBED = 80 };

static void describe_range(const morph_range *range, char *text) {
    char lo[MORPH_NUMBER_TEXT], hi[MORPH_NUMBER_TEXT];
    morph_number_print(range->lo, lo);
    morph_number_print(range->hi, hi);
    snprintf(text, ALLOWED, "a number %s %s and %s %s%s%s", range->above ? "above" : "of at least", lo,
             range->above > 1 ? "below" : "at most", hi, range->unit[0] ? " " : "", range->unit);
}

/* What is wrong with a value that should be a number; NULL if nothing is. */
static const char *number_fault(const morph_value *value, double *x) {
    if (!is_scalar(value) || morph_value_is_empty(value)) return "is no number";
    if (!is_plain(value)) return "is text in quotes, no number";
    switch (morph_number_parse(scalar(value), x)) {
    case MORPH_NUMBER_GOOD:
        return NULL;
    case MORPH_NUMBER_NONFINITE:
        return "is not finite";
    case MORPH_NUMBER_NONE:
        break;
    }
    return "is no number";
}

morph_found morph_value_number(const morph_value *value, const morph_range *range, double *out) {
    if (!value->node) return MORPH_ABSENT;
    double x = 0.0;
    const char *wrong = number_fault(value, &x);
    if (!wrong && range->above && x <= range->lo)
        wrong = x < 0.0 && range->lo == 0.0 ? "is negative" : "is too small";
    if (!wrong && x < range->lo) wrong = range->lo == 0.0 ? "is negative" : "is too small";
    if (!wrong && (x > range->hi || (range->above > 1 && x >= range->hi))) wrong = "is too large";
    if (!wrong) {
        *out = x;
        return MORPH_FOUND;
    }
    char is[DESCRIBED], allowed[ALLOWED];
    morph_value_describe(value, is, sizeof is);
    describe_range(range, allowed);
    morph_value_fault(value, "%s %s, allowed: %s", is, wrong, allowed);
    return MORPH_FAULTY;
}

/* [+-] digits, no more. */
static bool is_whole(const char *s) {
    if (*s == '+' || *s == '-') s++;
    if (*s == '\0') return false;
    for (; *s; s++)
        if (*s < '0' || *s > '9') return false;
    return true;
}

morph_found morph_value_integer(const morph_value *value, long lo, long hi, long *out) {
    if (!value->node) return MORPH_ABSENT;
    const char *wrong = NULL;
    double x;
    if (!is_plain(value) || !is_whole(scalar(value))) {
        wrong = number_fault(value, &x);
        if (!wrong) wrong = "is no whole number";
    } else {
        errno = 0;
        const long n = strtol(scalar(value), NULL, 10);
        if (errno == 0 && n >= lo && n <= hi) {
            *out = n;
            return MORPH_FOUND;
        }
        wrong = n < lo ? "is too small" : "is too large";
    }
    char is[DESCRIBED];
    morph_value_describe(value, is, sizeof is);
    if (lo == hi)
        morph_value_fault(value, "%s %s, allowed: %ld", is, wrong, lo);
    else
        morph_value_fault(value, "%s %s, allowed: a whole number from %ld to %ld", is, wrong, lo, hi);
    return MORPH_FAULTY;
}

/* A list of n, or a fault that says what each entry may be. */
static bool expect_list(const morph_value *value, int n, const char *each) {
    if (morph_value_count(value) == n) return true;
    char is[DESCRIBED];
    morph_value_describe(value, is, sizeof is);
    morph_value_fault(value, "%s, allowed: a list of %d, each %s", is, n, each);
    return false;
}

morph_found morph_value_numbers(const morph_value *value, const morph_range *range, int n, double *out) {
    if (!value->node) return MORPH_ABSENT;
    char allowed[ALLOWED];
    describe_range(range, allowed);
    if (!expect_list(value, n, allowed)) return MORPH_FAULTY;
    double x[8];
    bool good = true;
    for (int i = 0; i < n && i < 8; i++) {
        const morph_value item = morph_value_item(value, i);
        if (morph_value_number(&item, range, &x[i]) != MORPH_FOUND) good = false;
    }
    if (!good) return MORPH_FAULTY;
    memcpy(out, x, (size_t)n * sizeof *x);
    return MORPH_FOUND;
}

morph_found morph_value_integers(const morph_value *value, const long *lo, const long *hi, int n, long *out) {
    if (!value->node) return MORPH_ABSENT;
    if (!expect_list(value, n, "a whole number")) return MORPH_FAULTY;
    long x[8];
    bool good = true;
    for (int i = 0; i < n && i < 8; i++) {
        const morph_value item = morph_value_item(value, i);
        if (morph_value_integer(&item, lo[i], hi[i], &x[i]) != MORPH_FOUND) good = false;
    }
    if (!good) return MORPH_FAULTY;
    memcpy(out, x, (size_t)n * sizeof *x);
    return MORPH_FOUND;
}

morph_found morph_value_pair(const morph_value *value, const morph_range *range, double out[2]) {
    double x[2];
    const morph_found found = morph_value_numbers(value, range, 2, x);
    if (found != MORPH_FOUND) return found;
    if (x[0] > x[1]) {
        char lo[MORPH_NUMBER_TEXT], hi[MORPH_NUMBER_TEXT];
        morph_number_print(x[0], lo);
        morph_number_print(x[1], hi);
        morph_value_fault(value, "[%s, %s] is inverted, allowed: the smaller number first", lo, hi);
        return MORPH_FAULTY;
    }
    memcpy(out, x, sizeof x);
    return MORPH_FOUND;
}

morph_found morph_value_choice(const morph_value *value, const char *const *names, int count, int *out) {
    if (!value->node) return MORPH_ABSENT;
    for (int k = 0; k < count; k++)
        if (morph_value_is(value, names[k])) {
            *out = k;
            return MORPH_FOUND;
        }
    char is[DESCRIBED], allowed[ALLOWED];
    morph_value_describe(value, is, sizeof is);
    morph_join_names(names, count, allowed, sizeof allowed);
    const char *meant = is_scalar(value) ? morph_closest_name(scalar(value), names, count) : NULL;
    if (meant)
        morph_value_fault(value, "%s is not known, did you mean %s? allowed: %s", is, meant, allowed);
    else
        morph_value_fault(value, "%s is not known, allowed: %s", is, allowed);
    return MORPH_FAULTY;
}

morph_found morph_value_text(const morph_value *value, size_t most, char **out) {
    if (!value->node) return MORPH_ABSENT;
    char is[DESCRIBED];
    morph_value_describe(value, is, sizeof is);
    if (!is_scalar(value) || value->node->data.scalar.length == 0) {
        morph_value_fault(value, "%s is no text, allowed: one line of text", is);
        return MORPH_FAULTY;
    }
    if (value->node->data.scalar.length > most) {
        morph_value_fault(value, "%s is too long, allowed: at most %zu bytes", is, most);
        return MORPH_FAULTY;
    }
    for (const char *s = scalar(value); *s; s++)
        if ((unsigned char)*s < 0x20 || *s == 0x7f) {
            morph_value_fault(value, "%s has a control character, allowed: one line of text", is);
            return MORPH_FAULTY;
        }
    char *copy = strdup(scalar(value));
    if (!copy) {
        value->yaml->faults.nomem = true;
        return MORPH_FAULTY;
    }
    *out = copy;
    return MORPH_FOUND;
}
