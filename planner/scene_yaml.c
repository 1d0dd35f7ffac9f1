/* Loading one YAML document: what is refused before its values are looked at. */
#include "planner/yaml.h"

#include <stdio.h>
#include <string.h>

/* Length of the UTF-8 sequence at s (1 to 4), 0 if it is none: overlong forms, surrogates and code points
 * beyond 0x10ffff are refused (Unicode 15, table 3-7). */
static size_t utf8_length(const unsigned char *s, size_t left) {
    if (s[0] < 0x80) return 1;
    size_t n;
    unsigned char lo = 0x80, hi = 0xbf; /* of the second byte */
    if (s[0] >= 0xc2 && s[0] <= 0xdf) {
        n = 2;
    } else if (s[0] >= 0xe0 && s[0] <= 0xef) {
        n = 3;
        if (s[0] == 0xe0) lo = 0xa0;
        if (s[0] == 0xed) hi = 0x9f;
    } else if (s[0] >= 0xf0 && s[0] <= 0xf4) {
        n = 4;
        if (s[0] == 0xf0) lo = 0x90;
        if (s[0] == 0xf4) hi = 0x8f;
    } else {
        return 0;
    }
    if (left < n || s[1] < lo || s[1] > hi) return 0;
    for (size_t k = 2; k < n; k++)
        if (s[k] < 0x80 || s[k] > 0xbf) return 0;
    return n;
}

/* Line of a byte, counting as libyaml does: LF, CR and CR LF each end a line. */
static int line_at(const char *bytes, size_t at) {
    int line = 1;
    for (size_t k = 0; k < at; k++)
        if (bytes[k] == '\n' || (bytes[k] == '\r' && (k + 1 >= at || bytes[k + 1] != '\n'))) line++;
    return line;
}

/* Size, encoding and control characters. */
static bool check_bytes(morph_yaml *yaml, const char *bytes, size_t size) {
    if (size > MORPH_YAML_BYTES) {
        morph_fault_add(yaml, 1, "scene", "the file is larger than 1 MiB, allowed: at most %d bytes",
                        MORPH_YAML_BYTES);
        return false;
    }
    for (size_t k = 0; k < size;) {
        const unsigned char *s = (const unsigned char *)bytes + k;
        const size_t n = utf8_length(s, size - k);
        if (n == 0) {
            morph_fault_add(yaml, line_at(bytes, k), "scene",
                            "byte 0x%02x is not UTF-8, allowed: text in UTF-8", s[0]);
            return false;
        }
        if ((s[0] < 0x20 && s[0] != '\t' && s[0] != '\n' && s[0] != '\r') || s[0] == 0x7f) {
            morph_fault_add(yaml, line_at(bytes, k), "scene",
                            "control character 0x%02x, allowed: printable text in UTF-8", s[0]);
            return false;
        }
        k += n;
    }
    return true;
}

/* libyaml's own complaint in one line. MORPH_ERR_NOMEM if it ran out of memory. */
static morph_status parser_fault(morph_yaml *yaml, const yaml_parser_t *parser, const char *bytes,
                                 size_t size) {
    /* The loader (0.2.5) may also fail without an error set: only where it could not allocate. */
    if (parser->error == YAML_MEMORY_ERROR || parser->error == YAML_NO_ERROR) return MORPH_ERR_NOMEM;
    const char *problem = parser->problem ? parser->problem : "cannot be read";
    if (parser->error == YAML_READER_ERROR) {
        const size_t at = parser->problem_offset < size ? parser->problem_offset : size;
        morph_fault_add(yaml, line_at(bytes, at), "scene", "not YAML: %s, allowed: printable text in UTF-8",
                        problem);
    } else if (parser->context) {
        morph_fault_add(yaml, (int)parser->problem_mark.line + 1, "scene",
                        "not YAML: %s %s that began in line %d, column %d, allowed: one YAML document",
                        problem, parser->context, (int)parser->context_mark.line + 1,
                        (int)parser->problem_mark.column + 1);
    } else {
        morph_fault_add(yaml, (int)parser->problem_mark.line + 1, "scene",
                        "not YAML: %s (column %d), allowed: one YAML document", problem,
                        (int)parser->problem_mark.column + 1);
    }
    return MORPH_ERR_INPUT;
}

static bool has_tag(const yaml_event_t *event) {
    const yaml_char_t *tag = NULL;
    if (event->type == YAML_SCALAR_EVENT) tag = event->data.scalar.tag;
    if (event->type == YAML_SEQUENCE_START_EVENT) tag = event->data.sequence_start.tag;
    if (event->type == YAML_MAPPING_START_EVENT) tag = event->data.mapping_start.tag;
    return tag != NULL;
}

static const char *event_anchor(const yaml_event_t *event) {
    const yaml_char_t *anchor = NULL;
    if (event->type == YAML_SCALAR_EVENT) anchor = event->data.scalar.anchor;
    if (event->type == YAML_SEQUENCE_START_EVENT) anchor = event->data.sequence_start.anchor;
    if (event->type == YAML_MAPPING_START_EVENT) anchor = event->data.mapping_start.anchor;
    if (event->type == YAML_ALIAS_EVENT) anchor = event->data.alias.anchor;
    return (const char *)anchor;
}

typedef struct event_counts {
    int depth, documents, nodes;
} event_counts;

/* What the document interface would hide or pay for: anchors, aliases, tags, further documents, depth. False
 * if the rest need not be looked at. */
static bool check_event(morph_yaml *yaml, const yaml_event_t *event, event_counts *seen) {
    const int line = (int)event->start_mark.line + 1;
    const bool opens = event->type == YAML_SEQUENCE_START_EVENT || event->type == YAML_MAPPING_START_EVENT;
    const bool closes = event->type == YAML_SEQUENCE_END_EVENT || event->type == YAML_MAPPING_END_EVENT;
    seen->depth += opens ? 1 : closes ? -1 : 0;
    seen->nodes += opens || event->type == YAML_SCALAR_EVENT ? 1 : 0;
    if (event->type == YAML_DOCUMENT_START_EVENT && ++seen->documents > 1) {
        morph_fault_add(yaml, line, "scene", "a second document begins here, allowed: one");
        return false;
    }
    if (seen->depth > MORPH_YAML_DEPTH) {
        morph_fault_add(yaml, line, "scene", "nested deeper than %d, allowed: the keys of a scene",
                        MORPH_YAML_DEPTH);
        return false;
    }
    if (seen->nodes > MORPH_YAML_NODES) {
        morph_fault_add(yaml, line, "scene", "more than %d values, allowed: the keys of a scene",
                        MORPH_YAML_NODES);
        return false;
    }
    const char *anchor = event_anchor(event);
    if (anchor)
        morph_fault_add(yaml, line, "scene",
                        "%s%.40s: anchors and aliases are not used, allowed: plain values",
                        event->type == YAML_ALIAS_EVENT ? "*" : "&", anchor);
    if (has_tag(event))
        morph_fault_add(yaml, line, "scene", "a tag: tags are not used, allowed: plain values");
    if (event->type == YAML_SCALAR_EVENT &&
        memchr(event->data.scalar.value, '\0', event->data.scalar.length) != NULL)
        morph_fault_add(yaml, line, "scene", "a text with a zero byte, allowed: printable text");
    return true;
}

static void set_input(yaml_parser_t *parser, const char *bytes, size_t size) {
    yaml_parser_set_input_string(parser, (const unsigned char *)bytes, size);
}

static morph_status check_events(morph_yaml *yaml, const char *bytes, size_t size) {
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) return MORPH_ERR_NOMEM;
    set_input(&parser, bytes, size);

    morph_status status = MORPH_OK;
    event_counts seen = {0};
    for (bool more = true; more;) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            status = parser_fault(yaml, &parser, bytes, size);
            break;
        }
        more = event.type != YAML_STREAM_END_EVENT && check_event(yaml, &event, &seen);
        yaml_event_delete(&event);
    }
    if (status == MORPH_OK && seen.documents == 0)
        morph_fault_add(yaml, 1, "scene", "the file is empty, allowed: a scene");
    yaml_parser_delete(&parser);
    return status;
}

morph_status morph_yaml_open(morph_yaml *yaml, const char *path, const char *bytes, size_t size) {
    *yaml = (morph_yaml){.path = path};
    if (!check_bytes(yaml, bytes, size)) return MORPH_ERR_INPUT;
    morph_status status = check_events(yaml, bytes, size);
    if (status != MORPH_OK) return status;
    if (yaml->faults.count > 0) return MORPH_ERR_INPUT;

    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) return MORPH_ERR_NOMEM;
    set_input(&parser, bytes, size);
    if (yaml_parser_load(&parser, &yaml->document))
        yaml->loaded = true;
    else
        status = parser_fault(yaml, &parser, bytes, size);
    yaml_parser_delete(&parser);
    return status;
}

void morph_yaml_close(morph_yaml *yaml) {
    if (yaml->loaded) yaml_document_delete(&yaml->document);
    morph_faults_free(&yaml->faults);
    morph_faults_free(&yaml->warnings);
    *yaml = (morph_yaml){0};
}
