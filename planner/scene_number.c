/* Numbers in and out: strict decimal reading, shortest printing that reads back to the same double. */
#include "planner/yaml.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/* [+-] digits [. digits] [e [+-] digits], with a digit before or behind the point. */
static bool is_decimal(const char *s) {
    int digits = 0;
    if (*s == '+' || *s == '-') s++;
    for (; is_digit(*s); s++)
        digits++;
    if (*s == '.') s++;
    for (; is_digit(*s); s++)
        digits++;
    if (digits == 0) return false;
    if (*s == 'e' || *s == 'E') {
        s++;
        if (*s == '+' || *s == '-') s++;
        if (!is_digit(*s)) return false;
        while (is_digit(*s))
            s++;
    }
    return *s == '\0';
}

/* The spellings of nan and infinity in C and in YAML. */
static bool is_nonfinite(const char *s) {
    static const char *const names[] = {"nan", "inf", "infinity"};
    char word[16];
    if (*s == '+' || *s == '-') s++;
    if (*s == '.') s++;
    const size_t n = strlen(s);
    if (n >= sizeof word) return false;
    for (size_t k = 0; k <= n; k++)
        word[k] = s[k] >= 'A' && s[k] <= 'Z' ? (char)(s[k] - 'A' + 'a') : s[k];
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (strcmp(word, names[k]) == 0) return true;
    return false;
}

morph_number_kind morph_number_parse(const char *text, double *out) {
    if (is_nonfinite(text)) return MORPH_NUMBER_NONFINITE;
    if (!is_decimal(text)) return MORPH_NUMBER_NONE;
    char *end;
    const double x = strtod(text, &end);
    if (*end != '\0') return MORPH_NUMBER_NONE;
    if (!isfinite(x)) return MORPH_NUMBER_NONFINITE;
    *out = x;
    return MORPH_NUMBER_GOOD;
}

/* Digits to begin with, so that 100 is not printed as 1e+02: those before the point, up to 1e9. */
static int integer_digits(double x) {
    int digits = 1;
    for (double size = fabs(x); size >= 10.0 && size < 1e9; size /= 10.0)
        digits++;
    return fabs(x) < 1e9 ? digits : 1;
}

void morph_number_print(double x, char *text) {
    /* 17 significant digits always suffice for a double. */
    for (int digits = integer_digits(x); digits <= 17; digits++) {
        snprintf(text, MORPH_NUMBER_TEXT, "%.*g", digits, x);
        if (strtod(text, NULL) == x) return;
    }
}

double morph_radians(double degrees) {
    return degrees * PI / 180.0;
}

double morph_degrees(double radians) {
    return radians * 180.0 / PI;
}

double morph_degrees_print(double radians, char *text) {
    /* Degrees to radians rounds twice, so the inverse is off by a few units in the last place at most: the
     * double meant is among the neighbours of the computed one, nearest first. */
    const double middle = morph_degrees(radians);
    for (int digits = integer_digits(middle); digits <= 17; digits++) {
        snprintf(text, MORPH_NUMBER_TEXT, "%.*g", digits, middle);
        const double degrees = strtod(text, NULL);
        if (morph_radians(degrees) == radians) return degrees;
    }
    double below = middle, above = middle;
    for (int step = 0; step < 4; step++) {
        below = nextafter(below, -INFINITY);
        above = nextafter(above, INFINITY);
        const double degrees = morph_radians(below) == radians ? below : above;
        if (morph_radians(degrees) == radians) {
            morph_number_print(degrees, text);
            return degrees;
        }
    }
    morph_number_print(middle, text);
    return middle;
}
