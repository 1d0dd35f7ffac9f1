#include "planner/replay.h"

#include "model/align.h"

#include <stdlib.h>
#include <string.h>

/* Between recorded frames, s. */
#define FRAME 0.01

typedef struct setting {
    double *start;
    int *fixed, fixed_count;
    morph_drive drive;
    morph_blanket_def def;
} setting;

static bool on_border(const morph_structure *s, int joint) {
    const int *at = s->joint_node[joint];
    int last[2] = {0, 0};
    for (int j = 0; j < s->joints; j++)
        for (int k = 0; k < 2 && s->joint_layer[j] == s->joint_layer[joint]; k++)
            if (s->joint_node[j][k] > last[k]) last[k] = s->joint_node[j][k];
    return at[0] == 0 || at[1] == 0 || at[0] == last[0] || at[1] == last[1];
}

/* Puts the start on the base plane: the lowest joint's radius above it. */
static void stand(const morph_structure *s, double base, double *x) {
    double lowest = INFINITY;
    for (int j = 0; j < s->joints; j++)
        lowest = fmin(lowest, x[3 * j + 2]);
    for (int j = 0; j < s->joints; j++)
        x[3 * j + 2] += base + s->def.radius - lowest;
}

static morph_status set_up(const morph_replay_input *in, setting *at, morph_replay_report *report) {
    const morph_structure *s = in->structure;
    const morph_motion_def *motion = &in->scene->motion;
    const bool frame = s->def.support == MORPH_SUPPORT_FRAME, base = !isnan(in->scene->base);
    const size_t width = 3 * (size_t)s->joints;
    at->start = morph_alloc(width, sizeof(double));
    at->fixed = morph_alloc((size_t)s->joints, sizeof(int));
    if (!at->start || !at->fixed) return MORPH_ERR_NOMEM;
    memcpy(at->start, in->joints, width * sizeof(double));
    for (int j = 0; j < s->joints && frame; j++)
        if (on_border(s, j)) at->fixed[at->fixed_count++] = j;
    if (!in->core && base && !frame) stand(s, in->scene->base, at->start);
    report->floating = !frame && !base && !in->core;
    at->drive = (morph_drive){in->samples, in->step, in->length};
    at->def = (morph_blanket_def){.gravity = report->floating ? 0.0 : motion->gravity,
                                  .drag = motion->drag,
                                  .friction = motion->friction,
                                  .time = in->step * (in->samples - 1) + motion->time,
                                  .frame = FRAME,
                                  .base = in->scene->base,
                                  .fixed = at->fixed,
                                  .fixed_count = at->fixed_count,
                                  .drive = &at->drive};
    return MORPH_OK;
}

static morph_status judge(const morph_replay_input *in, const morph_trajectory *t,
                          morph_replay_report *report) {
    const int joints = in->structure->joints;
    const size_t width = 3 * (size_t)joints;
    double *end = morph_alloc(width, sizeof(double));
    if (!end) return MORPH_ERR_NOMEM;
    memcpy(end, &t->x[(size_t)(t->frames - 1) * width], width * sizeof(double));
    morph_status status =
        morph_align(joints, end, &in->joints[(size_t)(in->samples - 1) * width], &report->rms, &report->most);
    if (status == MORPH_OK) status = morph_cavity_measure(in->cavity, end, &report->measure);
    free(end);
    return status;
}

morph_status morph_replay_run(const morph_replay_input *in, const morph_control *control,
                              morph_trajectory *out, morph_replay_report *report) {
    const double since = morph_seconds();
    setting at = {0};
    morph_blanket_report run = {0};
    *out = (morph_trajectory){0};
    *report = (morph_replay_report){0};
    morph_status status = set_up(in, &at, report);
    if (status == MORPH_OK) /* Frames are looked at, not certified: no exact distances. */
        status = morph_blanket_run(in->structure, in->core, NULL, &at.def, at.start, control, out, &run);
    if (status == MORPH_OK) status = judge(in, out, report);
    free(at.start);
    free(at.fixed);
    if (status != MORPH_OK) {
        morph_trajectory_free(out);
        return status;
    }
    report->done = true;
    report->at_rest = run.at_rest;
    report->seconds_of_run = out->time[out->frames - 1];
    report->length = run.worst_length;
    report->seconds = morph_seconds() - since;
    return MORPH_OK;
}
