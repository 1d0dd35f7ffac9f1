/* The blanket's run: steps, rest, frames. */
#include "model/blanket_internal.h"

#include <stdlib.h>
#include <string.h>

/* At rest: for REST_WINDOW sqrt(spacing / gravity), the time a joint takes to fall half a spacing four times
 * over, no joint is faster than REST_SPEED sqrt(gravity spacing): it would then creep less than 1e-2 spacings
 * in that window, far below the gaps (0.1 spacings and more) that the end pose is judged by. */
#define REST_SPEED 5e-3
#define REST_WINDOW 4.0
/* Longest step in sqrt(spacing / gravity): at speeds of 3 sqrt(gravity spacing), a fall of 4.5 spacings, a
 * joint moves 0.06 spacings per step; contacts are listed to that distance. */
#define LONGEST_STEP 0.02
/* A frame whose energy rose is redone with half the step, at most this often: 16 times shorter than a step
 * asked for; the step of our own choice is stable from the start. */
#define MOST_HALVINGS 4

/* Beyond these a run is not meant: 1e7 steps a frame would take hours. */
#define MOST_STEPS 1e6
#define MOST_FRAMES 1e6

void morph_trajectory_free(morph_trajectory *t) {
    if (!t) return;
    free(t->time);
    free(t->x);
    *t = (morph_trajectory){0};
}

static morph_status trajectory_create(morph_trajectory *t, int capacity, int joints) {
    *t = (morph_trajectory){.joints = joints};
    t->time = morph_alloc((size_t)capacity, sizeof(double));
    t->x = morph_alloc((size_t)capacity * 3, (size_t)joints * sizeof(double));
    if (t->time && t->x) return MORPH_OK;
    morph_trajectory_free(t);
    return MORPH_ERR_NOMEM;
}

/* A frame is the state with its limits polished; the motion itself goes on unpolished. */
static void record(morph_blanket_state *b, double time, morph_trajectory *t, morph_blanket_report *report) {
    double *x = &t->x[(size_t)t->frames * 3 * (size_t)b->joints];
    memcpy(x, b->x, 3 * (size_t)b->joints * sizeof(double));
    const morph_violation worst = morph_blanket_polish(b, x);
    report->worst_length = fmax(report->worst_length, worst.length);
    report->worst_post = fmax(report->worst_post, worst.post);
    report->worst_clearance = fmax(report->worst_clearance, worst.clearance);
    t->time[t->frames++] = time;
}

/* Steps through one frame. Nothing but gravity feeds the motion and gravity's work is within the energy: if
 * that rises beyond `allowed`, the step is too long. False then, or if the state is not finite. */
static bool advance(morph_blanket_state *b, int steps, double allowed) {
    b->step = b->def.frame / steps;
    for (int k = 0; k < steps; k++)
        if (!morph_blanket_step(b) || !(morph_blanket_energy(b) <= allowed)) return false;
    return true;
}

/* The integrator's own ripple and what projections shift between links: small against the energy in motion
 * and against one spacing's fall. Instability passes any such bound within a few steps. */
static double allowed_energy(const morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const double weight = s->def.mass * b->joints * b->def.gravity;
    double kinetic = 0.0, spring = 0.0;
    morph_blanket_energies(b, &kinetic, &spring);
    return morph_blanket_energy(b) + 0.05 * (weight * s->spacing + kinetic + spring);
}

/* Back to the frame's start. */
static void rewind_frame(morph_blanket_state *b) {
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    memcpy(b->x, b->keep_x, bytes);
    memcpy(b->v, b->keep_v, bytes);
    morph_blanket_accelerations(b);
    morph_blanket_forget(b);
}

/* One frame, redone with half the step while it fails. A pose that projection is still sorting out (a start
 * far outside its limits) gains speed at any step: then the frame stands as it is, but its speed does not. */
static morph_status next_frame(morph_blanket_state *b, int *steps, morph_blanket_report *report) {
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    const double allowed = allowed_energy(b);
    const int first = *steps;
    memcpy(b->keep_x, b->x, bytes);
    memcpy(b->keep_v, b->v, bytes);
    bool good = advance(b, *steps, allowed);
    for (int tries = 0; !good && tries < MOST_HALVINGS; tries++) {
        *steps *= 2;
        report->step_halvings++;
        rewind_frame(b);
        good = advance(b, *steps, allowed);
    }
    if (!good) {
        *steps = first;
        rewind_frame(b);
        if (!advance(b, *steps, INFINITY)) return MORPH_ERR_NONFINITE;
        memset(b->v, 0, bytes);
    }
    report->steps += *steps;
    report->step = b->step;
    return MORPH_OK;
}

/* Steps that make a frame: of the length asked for, or what the springs and the motion allow; 0: too many. */
static int steps_per_frame(const morph_structure *s, const morph_blanket_def *def) {
    double step = def->step;
    if (!(step > 0.0)) {
        step = morph_blanket_stable_step(s);
        if (def->gravity > 0.0) step = fmin(step, LONGEST_STEP * sqrt(s->spacing / def->gravity));
    }
    const double steps = ceil(def->frame / step * (1.0 - 1e-12));
    return steps <= MOST_STEPS ? (int)fmax(steps, 1.0) : 0;
}

/* Mean over the frame of the fastest joint: a contact's trembling within it is no motion. */
static double frame_speed(const morph_blanket_state *b) {
    double most = 0.0;
    for (int j = 0; j < b->joints; j++)
        most = fmax(most, morph_dist(&b->x[3 * j], &b->keep_x[3 * j]));
    return most / b->def.frame;
}

static morph_status run(morph_blanket_state *b, int frames, const morph_control *control, morph_trajectory *t,
                        morph_blanket_report *report) {
    const morph_structure *s = b->structure;
    const double speed = REST_SPEED * sqrt(b->def.gravity * s->spacing);
    const double window = b->def.gravity > 0.0 ? REST_WINDOW * sqrt(s->spacing / b->def.gravity) : 0.0;
    int steps = steps_per_frame(s, &b->def);
    double calm = 0.0;
    morph_blanket_polish(b, b->x);
    morph_blanket_accelerations(b);
    record(b, 0.0, t, report);
    while (t->frames < frames) {
        if (morph_stopped(control)) return MORPH_ERR_STOPPED;
        const morph_status status = next_frame(b, &steps, report);
        if (status != MORPH_OK) return status;
        report->rest_speed = frame_speed(b);
        record(b, t->frames * b->def.frame, t, report);
        morph_progress(control, "nominal", (double)t->frames / frames);
        calm = report->rest_speed <= speed ? calm + b->def.frame : 0.0;
        report->at_rest = calm > 0.0 && calm >= window;
        if (report->at_rest) break;
    }
    return MORPH_OK;
}

morph_status morph_blanket_run(const morph_structure *structure, const morph_sdf *sdf,
                               const morph_distance *exact, const morph_blanket_def *def, const double *x0,
                               const morph_control *control, morph_trajectory *out,
                               morph_blanket_report *report) {
    const double begin = morph_seconds();
    *out = (morph_trajectory){0};
    morph_blanket_report local = {0};
    morph_blanket_state *b;
    morph_status status = morph_blanket_state_create(structure, sdf, def, x0, &b);
    if (status != MORPH_OK) return status;
    b->exact = exact;
    /* A frame more where the time is no whole number of them: the last then lies beyond it. */
    const double frames = ceil(def->time / def->frame * (1.0 - 1e-12)) + 1.0;
    if (!(frames <= MOST_FRAMES) || steps_per_frame(structure, def) == 0)
        status = MORPH_ERR_INPUT;
    else
        status = trajectory_create(out, (int)frames, structure->joints);
    if (status == MORPH_OK) status = run(b, (int)frames, control, out, &local);
    morph_blanket_state_destroy(b);
    if (status != MORPH_OK && status != MORPH_ERR_STOPPED) morph_trajectory_free(out);
    local.seconds = morph_seconds() - begin;
    if (report) *report = local;
    return status;
}
