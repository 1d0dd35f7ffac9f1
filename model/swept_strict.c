/* The strict mode of the swept test. */
#include "model/swept_internal.h"

bool morph_swept_strict(const morph_swept_polygon *p, double *t) {
    (void)p;
    (void)t;
    return true;
}
