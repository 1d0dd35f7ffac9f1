/* Which motion of a record a picture shows. */
#include "planner/picture.h"

#include "planner/folder_text.h"

#include <stdlib.h>
#include <string.h>

const char *const morph_picture_motions[MORPH_PICTURE_MOTIONS] = {"schedule", "blanket", "replay", "core"};

static void drop_schedule(morph_record *r) {
    double **const arrays[] = {&r->time, &r->schedule_joints, &r->length,
                               &r->rate, &r->acceleration,    &r->offset_schedule};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) {
        free(*arrays[k]);
        *arrays[k] = NULL;
    }
    r->samples = 0;
}

/* A replay takes the blanket's place; its lengths are those of its joints. */
static morph_status take_replay(morph_record *r, int frames, double **time, double **joints, bool core) {
    const size_t links = (size_t)r->links, width = 3 * (size_t)r->joints;
    double *lengths = morph_alloc((size_t)frames, links * sizeof(double));
    if (!lengths) return MORPH_ERR_NOMEM;
    for (int f = 0; f < frames; f++)
        for (size_t l = 0; l < links; l++) {
            const double *x = &(*joints)[(size_t)f * width];
            lengths[(size_t)f * links + l] = morph_dist(&x[3 * r->link[l][0]], &x[3 * r->link[l][1]]);
        }
    free(r->nominal_time);
    free(r->nominal_joints);
    free(r->nominal_lengths);
    free(r->offset_nominal);
    r->nominal_frames = frames;
    r->nominal_time = *time;
    r->nominal_joints = *joints;
    r->nominal_lengths = lengths;
    r->offset_nominal = NULL;
    if (!core) r->target_vertices = r->target_triangles = 0; /* it is not there */
    *time = *joints = NULL;
    return MORPH_OK;
}

morph_status morph_picture_select(morph_record *r, const char *motion, char *message, size_t size) {
    int which = 0;
    while (which < MORPH_PICTURE_MOTIONS && strcmp(motion, morph_picture_motions[which]) != 0)
        which++;
    const int frames[] = {r->samples, r->nominal_frames, r->replay_frames, r->core_frames};
    if (which == MORPH_PICTURE_MOTIONS)
        return morph_fail(MORPH_ERR_INPUT, message, size,
                          "'%s' is nothing to draw, allowed: schedule, blanket, replay, core, cavity",
                          motion);
    if (frames[which] < 1)
        return morph_fail(MORPH_ERR_INPUT, message, size, "this plan holds no %s to draw", motion);
    if (which == 0) return MORPH_OK;
    drop_schedule(r);
    if (which == 1) return MORPH_OK;
    return which == 2 ? take_replay(r, r->replay_frames, &r->replay_time, &r->replay_joints, false)
                      : take_replay(r, r->core_frames, &r->core_time, &r->core_joints, true);
}
