#include "planner/record.h"

#include "planner/check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void morph_record_free(morph_record *r) {
    if (!r) return;
    void *const arrays[] = {r->joint_layer,
                            r->joint_node,
                            r->link,
                            r->link_kind,
                            r->length_limit,
                            r->rate_limit,
                            r->acceleration_limit,
                            r->jerk_limit,
                            r->link_radius,
                            r->post,
                            r->post_length,
                            r->link_post,
                            r->link_post_limit,
                            r->link_link,
                            r->link_link_limit,
                            r->skin,
                            r->panel,
                            r->fixed,
                            r->target_v,
                            r->target_t,
                            r->deformed_v,
                            r->deformed_t,
                            r->offset_nominal,
                            r->offset_schedule,
                            r->nominal_time,
                            r->nominal_joints,
                            r->nominal_lengths,
                            r->placement_before,
                            r->placement_after,
                            r->guided_time,
                            r->guided_joints,
                            r->guided_lengths,
                            r->path_s,
                            r->path_poses,
                            r->timing_knot,
                            r->timing_control,
                            r->timing_duration,
                            r->time,
                            r->schedule_joints,
                            r->length,
                            r->rate,
                            r->acceleration,
                            r->replay_time,
                            r->replay_joints,
                            r->core_time,
                            r->core_joints,
                            r->mobility_sample,
                            r->mobility_rank,
                            r->mobility_free,
                            r->mobility_redundant,
                            r->mobility_sigma_min};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free(arrays[i]);
    memset(r, 0, sizeof *r);
}

static const char *layer_text(int kind) {
    return kind == 0 ? "bottom" : kind == 1 ? "top" : "brace";
}

void morph_record_link_name(const morph_record *r, int link, char *text, size_t size) {
    const int *a = r->joint_node[r->link[link][0]], *b = r->joint_node[r->link[link][1]];
    snprintf(text, size, "link %d (%d,%d)-(%d,%d) %s", link, a[0], a[1], b[0], b[1],
             layer_text(r->link_kind[link]));
}

void morph_record_joint_name(const morph_record *r, int joint, char *text, size_t size) {
    const int *a = r->joint_node[joint];
    snprintf(text, size, "joint (%d,%d) %s", a[0], a[1], layer_text(r->joint_layer[joint]));
}
