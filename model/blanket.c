/* The blanket's run: steps, rest, frames. */
#include "model/blanket_internal.h"

#include <stdlib.h>
#include <string.h>

/* At rest: for REST_WINDOW sqrt(spacing / gravity), the time a joint takes to fall half a spacing four times
 * over, no joint and no vertex of a deformable target leaves a ball of REST_SPEED sqrt(gravity spacing) times
 * that, 2e-2 spacings: far below the gaps (0.1 spacings and more) that the end pose is judged by. A contact's
 * trembling in place is no motion.
 */
#define REST_SPEED 5e-3
#define REST_WINDOW 4.0
/* Longest step in sqrt(spacing / gravity): at speeds of 2.5 sqrt(gravity spacing), a fall of 3 spacings, a
 * joint moves 0.1 spacings per step, what a step is planned for; with 0.05 sheets come through thin wires.
 */
#define LONGEST_STEP 0.04
/* A frame whose energy rose without cause is redone with half the step, down to this part of the step that
 * should be stable: what still rises then is no matter of the step. */
#define LEAST_STEP (1.0 / 16.0)
/* Motion in a step that is planned for and that is refused, in spacings: between them a frame may speed up.
 * What moves further is not safely followed along its way. */
#define PLANNED_MOVE 0.1
#define MOST_MOVE 0.25
/* What would move further than FAST spacings in the step that forces ask for is planned for FAST_MOVE: half a
 * link's usual radius, with which even an edge without thickness does not cut the skin. */
#define FAST 0.175
#define FAST_MOVE 0.02
/* A rising target is held up where a frame breaks an angle limit by more, radians (as cosine, near a right
 * angle): half a degree, what the falling blanket's own frames keep. */
#define ANGLE_GIVES 0.01
/* A rising target is held up where the unpolished frame is deeper in it than this, spacings, or a panel is
 * bent by this sine: half a link's usual radius. Sweeps that end when they move little leave a few 1e-3 of
 * what the target pushes in a step, with no limit near. */
#define RAW_DEPTH 0.02
/* What a target that was held up draws back by in a frame that still breaks a limit, spacings. */
#define RETREAT 0.02
/* Then a little more each time the frame is done again, at most this often. */
#define MOST_RETREATS 12
/* Times that a frame is run again because exact distances found the target inside. */
#define MOST_REVIEWS 4

/* Beyond these a run is not meant: 1e7 steps a frame would take hours. */
#define MOST_STEPS 1e6
#define MOST_FRAMES 1e6

void morph_trajectory_free(morph_trajectory *t) {
    if (!t) return;
    free(t->time);
    free(t->x);
    free(t->lift);
    *t = (morph_trajectory){0};
}

static morph_status trajectory_create(morph_trajectory *t, int capacity, int joints) {
    *t = (morph_trajectory){.joints = joints};
    t->time = morph_alloc((size_t)capacity, sizeof(double));
    t->x = morph_alloc((size_t)capacity * 3, (size_t)joints * sizeof(double));
    t->lift = morph_alloc((size_t)capacity, sizeof(double));
    if (t->time && t->x && t->lift) return MORPH_OK;
    morph_trajectory_free(t);
    return MORPH_ERR_NOMEM;
}

static double farthest(const morph_blanket_state *b, const double *from) {
    double most = 0.0;
    for (int j = 0; j < b->joints; j++)
        most = fmax(most, morph_dist(&b->x[3 * j], &from[3 * j]));
    return most;
}

/* A frame is the state with its limits polished; the motion itself goes on unpolished, unless the frame had
 * to be brought out of the target. */
static morph_violation record(morph_blanket_state *b, double time, morph_trajectory *t) {
    double *x = &t->x[(size_t)t->frames * 3 * (size_t)b->joints];
    memcpy(x, b->x, 3 * (size_t)b->joints * sizeof(double));
    const morph_violation worst = morph_blanket_polish(b, x);
    /* What was in the target by exact distances would be so again: the motion goes on from outside. */
    if (b->entered) {
        b->lift_path += farthest(b, x); /* nothing sleeps past this jump */
        memcpy(b->x, x, 3 * (size_t)b->joints * sizeof(double));
    }
    t->lift[t->frames] = b->lift;
    t->time[t->frames++] = time;
    return worst;
}

static void note_worst(morph_blanket_report *report, const morph_violation *v) {
    report->worst_length = fmax(report->worst_length, v->length);
    report->worst_post = fmax(report->worst_post, v->post);
    report->worst_panel = fmax(report->worst_panel, v->panel);
    report->worst_clearance = fmax(report->worst_clearance, v->clearance);
}

/* Steps through one frame. What gravity, springs and attraction give is within the energy, what hands, a
 * rising target and actuators give within the work: if the energy rises beyond `allowed` and that, the step
 * is too long. False then, or if the state is not finite or moves too far. */
static bool advance(morph_blanket_state *b, int steps, double allowed) {
    b->step = b->def.frame / steps;
    b->work = 0.0;
    for (int k = 0; k < steps; k++) {
        if (!morph_blanket_step(b)) return false;
        /* Prescribed lengths leave nothing elastic that a step could be too long for. */
        if (b->def.drive) continue;
        if (!(morph_blanket_energy(b) <= allowed + fmax(0.0, b->work))) return false;
    }
    return true;
}

/* The integrator's own ripple and what projections shift between links: small against the energy in motion
 * and against one spacing's fall. Instability passes any such bound within a few steps. */
static double allowed_energy(const morph_blanket_state *b) {
    const morph_structure *s = b->structure;
    const double weight = s->def.mass * b->joints * b->pull;
    double kinetic = 0.0, spring = 0.0;
    morph_blanket_energies(b, &kinetic, &spring);
    return morph_blanket_energy(b) + 0.05 * (weight * s->spacing + kinetic + spring);
}

/* What a frame starts from, to come back to. */
typedef struct frame_start {
    double time, lift, rise_clock, allowed;
} frame_start;

static frame_start keep_frame(morph_blanket_state *b) {
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    memcpy(b->keep_x, b->x, bytes);
    memcpy(b->keep_v, b->v, bytes);
    if (b->soft) morph_blanket_soft_keep_frame(b);
    return (frame_start){b->time, b->lift, b->rise_clock, allowed_energy(b)};
}

static void rewind_frame(morph_blanket_state *b, const frame_start *at) {
    const size_t bytes = 3 * (size_t)b->joints * sizeof(double);
    memcpy(b->x, b->keep_x, bytes);
    memcpy(b->v, b->keep_v, bytes);
    b->time = at->time;
    b->lift = b->lift_to = at->lift;
    b->rise_clock = at->rise_clock;
    if (b->soft) morph_blanket_soft_rewind_frame(b);
    morph_blanket_accelerations(b);
    morph_blanket_forget(b);
}

/* The step that should be stable and resolves the motion that forces make. */
static double good_step(const morph_structure *s, const morph_blanket_def *def) {
    const double pull = morph_blanket_pull(s, def);
    const double step = morph_blanket_stable_step(s, def);
    return pull > 0.0 ? fmin(step, LONGEST_STEP * sqrt(s->spacing / pull)) : step;
}

/* Steps that make a frame: of the length asked for, or what the springs and forces allow; 0: too many. */
static int steps_per_frame(const morph_structure *s, const morph_blanket_def *def) {
    const double step = def->step > 0.0 ? def->step : good_step(s, def);
    const double steps = ceil(def->frame / step * (1.0 - 1e-12));
    return steps <= MOST_STEPS ? (int)fmax(steps, 1.0) : 0;
}

/* Prescribed lengths that contradict limits throw joints about the faster the shorter the step is: there a
 * frame takes no more steps than halving would come to. */
static double most_steps(const morph_blanket_state *b) {
    return b->def.drive ? fmin(ceil(b->def.frame / (LEAST_STEP * b->good_step)), MOST_STEPS) : MOST_STEPS;
}

/* More of them while the blanket is fast. */
static int steps_for_speed(const morph_blanket_state *b, int steps) {
    double fastest = 0.0;
    for (int k = 0; k < 3 * b->joints; k++)
        fastest = fmax(fastest, fabs(b->v[k]));
    const double spacing = b->structure->spacing;
    const bool fast = b->sdf && fastest * b->good_step > FAST * spacing;
    const double most = b->def.frame * fastest / ((fast ? FAST_MOVE : PLANNED_MOVE) * spacing);
    return (int)fmax(steps, fmin(ceil(most), most_steps(b)));
}

/* One frame, redone with half the step while it fails. A pose that projection is still sorting out (a start
 * far outside its limits) gains speed at any step: then the frame stands as it is, but its speed does not. */
static morph_status next_frame(morph_blanket_state *b, const frame_start *at, int *steps,
                               morph_blanket_report *report) {
    if (b->guard.watched == 0 && b->guard.usual > 0) {
        *steps = b->guard.usual;
        b->guard.usual = 0;
    }
    const int first = steps_for_speed(b, *steps);
    const double least = LEAST_STEP * fmin(b->good_step, b->def.frame / first);
    int now = first;
    b->most_move = MOST_MOVE * b->structure->spacing;
    b->guard.refused = 0;
    bool good = advance(b, now, at->allowed);
    while (!good && b->status == MORPH_OK && b->def.frame / now > least && now < most_steps(b) / 2) {
        now *= 2;
        report->step_halvings++;
        rewind_frame(b, at);
        good = advance(b, now, at->allowed);
    }
    /* What the guard refused is kept while it watches, and no longer. */
    if (good && now > first) {
        if (b->guard.refused > 0 && b->guard.usual == 0) b->guard.usual = *steps;
        *steps = now;
    }
    if (b->status != MORPH_OK) return b->status;
    if (!good) {
        now = first;
        rewind_frame(b, at);
        b->most_move = INFINITY;
        if (!advance(b, now, INFINITY)) return b->status != MORPH_OK ? b->status : MORPH_ERR_NONFINITE;
        memset(b->v, 0, 3 * (size_t)b->joints * sizeof(double));
        if (b->soft) morph_blanket_soft_stop(b);
    }
    report->steps += now;
    report->step = b->step;
    return MORPH_OK;
}

/* Mean over the frame of what moved fastest. */
static double frame_speed(const morph_blanket_state *b) {
    const double soft = b->soft ? morph_blanket_soft_frame_move(b) : 0.0;
    return fmax(soft, farthest(b, b->keep_x)) / b->def.frame;
}

/* The target is in the blanket because something holds that against it: the limit that is pushed hardest. */
static void resisting(const morph_blanket_state *b, morph_blanket_report *report) {
    double most = 0.0;
    report->held_by = MORPH_BLANKET_CLEARANCE;
    for (int l = 0; l < b->links; l++) {
        const double push = fmax(b->push[l][0], b->push[l][1]);
        if (push <= most) continue;
        most = push;
        report->held_by = MORPH_BLANKET_LENGTH;
        report->held_element = l;
    }
    for (int t = 0; t < b->angles && most == 0.0; t++)
        if (fmax(b->turn[t].push[0], b->turn[t].push[1]) > 0.0) {
            report->held_by = MORPH_BLANKET_ANGLE;
            report->held_element = t;
        }
}

/* The limit that a pose breaks while the target rises, deeper than `depth` spacings in the target or a
 * panel's sine beyond `bent`; false if all hold. */
static bool gives_way(const morph_blanket_state *b, const morph_violation *v, double depth, double bent,
                      morph_blanket_report *report) {
    const double spacing = b->structure->spacing;
    report->held_element = -1;
    if (v->length > MORPH_BLANKET_LENGTH_HELD * spacing) {
        report->held_by = MORPH_BLANKET_LENGTH;
        report->held_element = v->link;
    } else if (v->angle > ANGLE_GIVES) {
        report->held_by = MORPH_BLANKET_ANGLE;
        report->held_element = v->tuple;
    } else if (v->clearance > depth * spacing)
        resisting(b, report);
    else if (v->panel > bent)
        report->held_by = MORPH_BLANKET_PANEL;
    else
        return false;
    return true;
}

static bool rising(const morph_blanket_state *b) {
    return b->def.rise > 0.0 && !b->held_up && b->rise_clock < b->def.rise_time;
}

/* Whether the frame just run must not stand while the target rises. The motion aims inside its limits: where
 * the unpolished state is beyond them, sweeps no longer hold what the target asks for. */
static bool refused(const morph_blanket_state *b, const morph_violation *polished,
                    morph_blanket_report *report) {
    const morph_violation raw = morph_blanket_violation(b, b->x);
    return gives_way(b, polished, MORPH_BLANKET_CLEARANCE_HELD, MORPH_BLANKET_PANEL_HELD, report) ||
           (!b->held_up && gives_way(b, &raw, RAW_DEPTH, RAW_DEPTH, report));
}

/* The target stands from now on; where it stands already, it draws back a little in this frame. */
static void hold_up(morph_blanket_state *b, const frame_start *at, const morph_blanket_report *cause,
                    morph_blanket_report *report) {
    if (b->held_up)
        b->retreat += RETREAT * b->structure->spacing / b->def.frame;
    else {
        report->held_time = at->time;
        report->held_by = cause->held_by;
        report->held_element = cause->held_element;
    }
    b->held_up = report->held_up = true;
}

/* A frame; where no step is short enough to keep the rising target from coming through, the target stops as
 * for a limit. */
static morph_status next_or_hold(morph_blanket_state *b, const frame_start *at, int *steps,
                                 morph_blanket_report *report) {
    const int before = *steps;
    morph_status status = next_frame(b, at, steps, report);
    for (int tries = 0; tries < MOST_RETREATS && status == MORPH_ERR_MOTION; tries++) {
        if (!(b->def.rise > 0.0)) return status;
        rewind_frame(b, at);
        if (!rising(b) && !b->held_up) return status;
        morph_blanket_report cause = {.held_element = -1};
        resisting(b, &cause);
        hold_up(b, at, &cause, report);
        b->status = MORPH_OK;
        b->guard.through = 0;
        *steps = before;
        status = next_frame(b, at, steps, report);
    }
    return status;
}

/* The frame done again from its start, and its record. */
static morph_status repeat_frame(morph_blanket_state *b, const frame_start *at, int *steps,
                                 morph_trajectory *t, morph_blanket_report *report, morph_violation *v) {
    const double time = --t->frames * b->def.frame;
    rewind_frame(b, at);
    const morph_status status = next_or_hold(b, at, steps, report);
    if (status == MORPH_OK) *v = record(b, time, t);
    return status;
}

/* A part of the target that came between the places: now that exact distances have put places there, the
 * frame is run again. */
static morph_status review(morph_blanket_state *b, const frame_start *at, int *steps, morph_trajectory *t,
                           morph_blanket_report *report, morph_violation *v) {
    morph_status status = MORPH_OK;
    for (int tries = 0; tries < MOST_REVIEWS && status == MORPH_OK && !b->soft && !b->def.drive &&
                        v->clearance > MORPH_BLANKET_CLEARANCE_HELD * b->structure->spacing;
         tries++)
        status = repeat_frame(b, at, steps, t, report, v);
    return status;
}

/* A frame and its record. Where the rising target would break a limit, the frame is done again with the
 * target standing where it was, and if limits give way later, drawing back. */
static morph_status record_next(morph_blanket_state *b, int *steps, morph_trajectory *t,
                                morph_blanket_report *report) {
    const double time = t->frames * b->def.frame;
    const bool rose = rising(b);
    const frame_start at = keep_frame(b);
    b->retreat = 0.0;
    morph_status status = next_or_hold(b, &at, steps, report);
    if (status != MORPH_OK) return status;
    morph_violation v = record(b, time, t);
    status = review(b, &at, steps, t, report, &v);
    if (status != MORPH_OK) return status;
    morph_blanket_report cause;
    for (int tries = 0; tries < MOST_RETREATS && (rose || b->held_up) && refused(b, &v, &cause); tries++) {
        hold_up(b, &at, &cause, report);
        status = repeat_frame(b, &at, steps, t, report, &v);
        if (status != MORPH_OK) return status;
    }
    report->short_of = -b->lift;
    note_worst(report, &v);
    report->rest_speed = frame_speed(b);
    report->guarded = b->guard.steps;
    report->crossings = b->guard.crossings;
    return MORPH_OK;
}

/* Whether anything still drives the motion. */
static bool driven(const morph_blanket_state *b) {
    if (rising(b)) return true;
    if (b->def.drive && b->time < b->def.drive->step * (b->def.drive->samples - 1)) return true;
    for (int k = 0; k < b->def.hand_count; k++)
        if (b->time < b->def.hands[k].to) return true;
    return false;
}

static void rest_here(morph_blanket_state *b) {
    memcpy(b->rest_x, b->x, 3 * (size_t)b->joints * sizeof(double));
    if (b->soft) morph_blanket_soft_rest_here(b);
}

static double from_rest(const morph_blanket_state *b) {
    return fmax(farthest(b, b->rest_x), b->soft ? morph_blanket_soft_from_rest(b) : 0.0);
}

static morph_status run(morph_blanket_state *b, int frames, const morph_control *control, morph_trajectory *t,
                        morph_blanket_report *report) {
    const morph_structure *s = b->structure;
    const double scale = b->def.gravity > 0.0 ? b->def.gravity : b->pull;
    const double speed = REST_SPEED * sqrt(scale * s->spacing);
    const double window = scale > 0.0 ? REST_WINDOW * sqrt(s->spacing / scale) : 0.0;
    int steps = steps_per_frame(s, &b->def);
    b->good_step = good_step(s, &b->def);
    double calm = 0.0;
    rest_here(b);
    if (b->def.drive) morph_blanket_schedule(b);
    morph_blanket_polish(b, b->x);
    morph_blanket_accelerations(b);
    const morph_violation v = record(b, 0.0, t);
    note_worst(report, &v);
    while (t->frames < frames) {
        if (morph_stopped(control)) return MORPH_ERR_STOPPED;
        morph_status status = record_next(b, &steps, t, report);
        if (status == MORPH_OK && b->soft) status = morph_blanket_soft_status(b);
        if (status != MORPH_OK) return status;
        morph_progress(control, b->def.drive ? "replay" : "nominal", (double)t->frames / frames);
        calm += b->def.frame;
        if (driven(b) || from_rest(b) > speed * window) {
            rest_here(b);
            calm = 0.0;
        }
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
    if (!def->body) b->exact = exact;
    b->convex = b->exact && morph_distance_convex(b->exact);
    /* A frame more where the time is no whole number of them: the last then lies beyond it. */
    const double frames = ceil(def->time / def->frame * (1.0 - 1e-12)) + 1.0;
    if (!(frames <= MOST_FRAMES) || steps_per_frame(structure, def) == 0)
        status = MORPH_ERR_INPUT;
    else
        status = trajectory_create(out, (int)frames, structure->joints);
    if (status == MORPH_OK && b->convex)
        status = morph_blanket_hull_create(morph_distance_mesh(b->exact), &b->hull);
    if (status == MORPH_OK) status = run(b, (int)frames, control, out, &local);
    local.came_through = b->guard.through > 0;
    local.through_element = b->guard.through - 1;
    local.through_time = b->time;
    morph_blanket_state_destroy(b);
    if (status != MORPH_OK && status != MORPH_ERR_STOPPED) morph_trajectory_free(out);
    local.seconds = morph_seconds() - begin;
    if (report) *report = local;
    return status;
}
