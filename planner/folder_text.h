/* Text and files for everything that goes to disk: numbers that read back bit for bit whatever the locale,
 * text that grows, files that are written whole or not at all, one-line messages. */
#ifndef MORPH_FOLDER_TEXT_H
#define MORPH_FOLDER_TEXT_H

#include "solvers/base.h"

#include <locale.h>

#if defined(__GNUC__)
#define MORPH_PRINTF(a, b) __attribute__((format(printf, a, b)))
#else
#define MORPH_PRINTF(a, b)
#endif

/* One line into message (may be NULL); always ends in 0. Returns `status`, so that a caller can write
 * `return morph_fail(MORPH_ERR_INPUT, message, size, "...", ...)`. Keeps errno. */
morph_status morph_fail(morph_status status, char *message, size_t size, const char *format, ...)
    MORPH_PRINTF(4, 5);

/* The calling thread's locale is "C" between enter and leave: '.' is the decimal point of printf and strtod.
 * False when memory is refused (nothing to leave then). */
typedef struct morph_locale {
    locale_t c, before;
} morph_locale;
bool morph_locale_enter(morph_locale *locale);
void morph_locale_leave(morph_locale *locale);

/* Shortest of 15 and 17 significant digits that reads back to the same double; "null" when not finite. Wants
 * the "C" locale. text receives at most 32 bytes. Returns the length. */
int morph_number(double value, char text[32]);

/* Text that grows. Zeroed is empty. After a refused allocation `failed` is set and further calls do nothing:
 * ask once, at the end. */
typedef struct morph_text {
    char *data; /* ends in 0 once something was added */
    size_t size, capacity;
    bool failed;
} morph_text;
void morph_text_free(morph_text *text);
void morph_text_put(morph_text *text, const char *data, size_t size);
void morph_text_add(morph_text *text, const char *format, ...) MORPH_PRINTF(2, 3);
void morph_text_number(morph_text *text, double value);
/* With < > & " ' escaped for HTML and control characters left out. */
void morph_text_html(morph_text *text, const char *plain);
/* As a JSON string, quotes included; bytes that are no UTF-8 become U+FFFD. */
void morph_text_json(morph_text *text, const char *plain);

/* Of a file or folder that could not be opened: MORPH_ERR_INPUT where errno says that the name is at fault
 * (it or a folder on its way is not there), else MORPH_ERR_IO. */
morph_status morph_name_fault(void);

/* Creates `file` (must not exist), writes, syncs and closes it. On failure the file is removed and the
 * message says what failed; MORPH_ERR_IO with errno kept. */
morph_status morph_file_put(const char *file, const void *data, size_t size, char *message,
                            size_t message_size);
/* The same into a hidden file beside, which then takes the place of `file` (a regular file or none).
 * MORPH_ERR_INPUT where the folder for it is not there. */
morph_status morph_file_replace(const char *file, const void *data, size_t size, char *message,
                                size_t message_size);
/* Whole file into memory, a 0 after it; free(*data). MORPH_ERR_IO, MORPH_ERR_INPUT when it is no regular
 * file, MORPH_ERR_NOMEM. */
morph_status morph_file_load(const char *file, char **data, size_t *size, char *message, size_t message_size);
/* "a/b" of a and b; NULL when memory is refused. free(). */
char *morph_path_join(const char *folder, const char *name);
/* Syncs a directory; file systems that cannot are no failure. 0 or -1 with errno. */
int morph_folder_sync(const char *folder);

#endif
