#include "planner/folder_text.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

morph_status morph_fail(morph_status status, char *message, size_t size, const char *format, ...) {
    if (!message || size == 0) return status;
    int kept = errno;
    va_list args;
    va_start(args, format);
    vsnprintf(message, size, format, args);
    va_end(args);
    /* A file name may hold a line break; a message is one line. */
    for (char *c = message; *c; c++)
        if ((unsigned char)*c < ' ') *c = '?';
    errno = kept;
    return status;
}

bool morph_locale_enter(morph_locale *locale) {
    locale->c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!locale->c) return false;
    locale->before = uselocale(locale->c);
    return true;
}

void morph_locale_leave(morph_locale *locale) {
    uselocale(locale->before);
    freelocale(locale->c);
}

int morph_number(double value, char text[32]) {
    if (!isfinite(value)) return snprintf(text, 32, "null");
    int length = snprintf(text, 32, "%.15g", value);
    /* 17 digits always read back to the same double, 15 often do and are what a person wrote. */
    if (strtod(text, NULL) != value) length = snprintf(text, 32, "%.17g", value);
    return length;
}

void morph_text_free(morph_text *text) {
    free(text->data);
    *text = (morph_text){0};
}

/* Room for `extra` bytes and the closing 0. */
static bool reserve(morph_text *text, size_t extra) {
    if (text->failed) return false;
    if (extra < text->capacity - text->size) return true;
    size_t capacity = text->capacity ? text->capacity : 4096;
    while (capacity - text->size <= extra) {
        if (capacity > (size_t)-1 / 2) {
            text->failed = true;
            return false;
        }
        capacity *= 2;
    }
    char *data = realloc(text->data, capacity);
    if (!data) {
        text->failed = true;
        return false;
    }
    text->data = data;
    text->capacity = capacity;
    return true;
}

void morph_text_put(morph_text *text, const char *data, size_t size) {
    if (!reserve(text, size)) return;
    if (size > 0) memcpy(text->data + text->size, data, size);
    text->size += size;
    text->data[text->size] = 0;
}

void morph_text_add(morph_text *text, const char *format, ...) {
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int length = vsnprintf(NULL, 0, format, args);
    va_end(args);
    if (length < 0) {
        text->failed = true;
    } else if (reserve(text, (size_t)length)) {
        vsnprintf(text->data + text->size, (size_t)length + 1, format, again);
        text->size += (size_t)length;
    }
    va_end(again);
}

void morph_text_number(morph_text *text, double value) {
    char number[32];
    int length = morph_number(value, number);
    morph_text_put(text, number, (size_t)length);
}

void morph_text_html(morph_text *text, const char *plain) {
    for (const char *c = plain; *c; c++) {
        switch (*c) {
        case '<':
            morph_text_put(text, "&lt;", 4);
            break;
        case '>':
            morph_text_put(text, "&gt;", 4);
            break;
        case '&':
            morph_text_put(text, "&amp;", 5);
            break;
        case '"':
            morph_text_put(text, "&quot;", 6);
            break;
        case '\'':
            morph_text_put(text, "&#39;", 5);
            break;
        default:
            if ((unsigned char)*c >= ' ') morph_text_put(text, c, 1);
        }
    }
}

/* Length of the UTF-8 sequence at c, 0 if it is none (overlong forms and surrogates included). */
static size_t utf8_length(const unsigned char *c) {
    if (c[0] < 0x80) return 1;
    size_t n = c[0] >= 0xF0 && c[0] <= 0xF4 ? 4 : c[0] >= 0xE0 && c[0] < 0xF0 ? 3 : c[0] >= 0xC2 ? 2 : 0;
    if (c[0] > 0xF4) return 0;
    for (size_t k = 1; k < n; k++)
        if ((c[k] & 0xC0) != 0x80) return 0; /* also stops at the closing 0 */
    if ((c[0] == 0xE0 && c[1] < 0xA0) || (c[0] == 0xED && c[1] > 0x9F) || (c[0] == 0xF0 && c[1] < 0x90) ||
        (c[0] == 0xF4 && c[1] > 0x8F))
        return 0;
    return n;
}

void morph_text_json(morph_text *text, const char *plain) {
    morph_text_put(text, "\"", 1);
    for (const unsigned char *c = (const unsigned char *)plain; *c;) {
        size_t n = utf8_length(c);
        if (n == 0) {
            morph_text_put(text, "\\ufffd", 6);
            n = 1;
        } else if (*c == '"' || *c == '\\') {
            morph_text_add(text, "\\%c", *c);
        } else if (*c < ' ') {
            morph_text_add(text, "\\u%04x", *c);
        } else {
            morph_text_put(text, (const char *)c, n);
        }
        c += n;
    }
    morph_text_put(text, "\"", 1);
}
