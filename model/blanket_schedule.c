/* What moves by itself: the rising target and the prescribed lengths. */
#include "model/blanket_internal.h"

/* Smooth from 0 to 1 with no speed and no acceleration at both ends. */
static double smooth_step(double t) {
    const double u = fmax(0.0, fmin(1.0, t));
    return u * u * u * (10.0 + u * (6.0 * u - 15.0));
}

double morph_blanket_lift(const morph_blanket_def *def, double clock) {
    if (!(def->rise > 0.0)) return 0.0;
    return def->rise * (smooth_step(clock / def->rise_time) - 1.0);
}

static void prescribe(morph_blanket_state *b, double time) {
    const morph_drive *drive = b->def.drive;
    const double at = fmin(time / drive->step, (double)(drive->samples - 1));
    const int before = (int)at, after = before + 1 < drive->samples ? before + 1 : before;
    const double part = at - before;
    for (int l = 0; l < b->links; l++) {
        const double from = drive->length[(size_t)before * (size_t)b->links + (size_t)l];
        const double to = drive->length[(size_t)after * (size_t)b->links + (size_t)l];
        const double length = from + part * (to - from);
        for (int k = 0; k < 2; k++)
            b->bound[l][k] = b->limit[l][k] = length;
    }
}

void morph_blanket_schedule(morph_blanket_state *b) {
    if (b->def.drive) prescribe(b, b->time + b->step);
    if (b->held_up) b->lift_to = fmax(-b->def.rise, b->lift - b->retreat * b->step);
    if (!(b->def.rise > 0.0) || b->held_up) return;
    b->rise_clock += b->step;
    b->lift_to = morph_blanket_lift(&b->def, b->rise_clock);
}
