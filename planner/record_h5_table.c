/* The contract of plan.h5: names, shapes, units, meanings. */
#include "planner/record_h5.h"

#include <stdio.h>
#include <string.h>

enum {
    JOINTS,
    LINKS,
    POSTS,
    LINK_POSTS,
    LINK_LINKS,
    SKIN,
    PANELS,
    FIXED,
    VERTICES,
    TRIANGLES,
    PRESSED,
    PRESSED_TRIANGLES,
    FRAMES,
    SEEDS,
    PLACED,
    GUIDED,
    POSES,
    WIDTH,
    TIMING_KNOTS,
    TIMING_CONTROLS,
    SAMPLES,
    REPLAYED,
    CORE,
    MOBILITY
};

const size_t morph_record_counts[] = {
    [JOINTS] = offsetof(morph_record, joints),
    [LINKS] = offsetof(morph_record, links),
    [POSTS] = offsetof(morph_record, posts),
    [LINK_POSTS] = offsetof(morph_record, link_posts),
    [LINK_LINKS] = offsetof(morph_record, link_links),
    [SKIN] = offsetof(morph_record, skin_triangles),
    [PANELS] = offsetof(morph_record, panels),
    [FIXED] = offsetof(morph_record, fixed_count),
    [VERTICES] = offsetof(morph_record, target_vertices),
    [TRIANGLES] = offsetof(morph_record, target_triangles),
    [PRESSED] = offsetof(morph_record, deformed_vertices),
    [PRESSED_TRIANGLES] = offsetof(morph_record, deformed_triangles),
    [FRAMES] = offsetof(morph_record, nominal_frames),
    [POSES] = offsetof(morph_record, poses),
    [WIDTH] = offsetof(morph_record, pose_width),
    [TIMING_KNOTS] = offsetof(morph_record, timing_knots),
    [TIMING_CONTROLS] = offsetof(morph_record, timing_controls),
    [SAMPLES] = offsetof(morph_record, samples),
    [SEEDS] = offsetof(morph_record, centres_before),
    [PLACED] = offsetof(morph_record, centres_after),
    [GUIDED] = offsetof(morph_record, guided_frames),
    [REPLAYED] = offsetof(morph_record, replay_frames),
    [CORE] = offsetof(morph_record, core_frames),
    [MOBILITY] = offsetof(morph_record, mobility_samples),
};
const int morph_record_count_total = (int)(sizeof morph_record_counts / sizeof morph_record_counts[0]);

#define AT(f) offsetof(morph_record, f)
#define INT1(path, f, n, below, unit, text)                                                                  \
    { path, AT(f), MORPH_CELL_INT, 1, {{n, 1}}, {below, below}, true, unit, text }
#define INTS(path, f, n, columns, below0, below1, unit, text)                                                \
    { path, AT(f), MORPH_CELL_INT, 2, {{n, 1}, {-1, columns}}, {below0, below1}, true, unit, text }
#define REAL1(path, f, n, needed, unit, text)                                                                \
    { path, AT(f), MORPH_CELL_REAL, 1, {{n, 1}}, {{-1, 0}, {-1, 0}}, needed, unit, text }
#define REAL2(path, f, n, m, times, needed, unit, text)                                                      \
    { path, AT(f), MORPH_CELL_REAL, 2, {{n, 1}, {m, times}}, {{-1, 0}, {-1, 0}}, needed, unit, text }
#define REAL3(path, f, n, m, unit, text)                                                                     \
    { path, AT(f), MORPH_CELL_REAL, 3, {{n, 1}, {m, 1}, {-1, 3}}, {{-1, 0}, {-1, 0}}, false, unit, text }
#define MOBILE(path, f, below, unit, text)                                                                   \
    { path, AT(f), MORPH_CELL_INT, 1, {{MOBILITY, 1}}, {below, below}, false, unit, text }
#define OF(n)                                                                                                \
    { n, 1 }
#define UPTO(k)                                                                                              \
    { -1, k }
#define ANY                                                                                                  \
    { -1, 0 }

const morph_dataset morph_record_datasets[] = {
    INT1("structure/joint_layer", joint_layer, JOINTS, UPTO(2), "1", "layer of each joint: 0 bottom, 1 top"),
    INTS("structure/joint_node", joint_node, JOINTS, 2, ANY, ANY, "1", "grid position (i, j) of each joint"),
    INTS("structure/links", link, LINKS, 2, OF(JOINTS), OF(JOINTS), "1", "the two joints of each link"),
    INT1("structure/link_kind", link_kind, LINKS, UPTO(3), "1",
         "kind of each link: 0 bottom, 1 top, 2 brace"),
    REAL2("structure/link_length_limits", length_limit, LINKS, -1, 2, true, "m",
          "least and greatest length of each link"),
    REAL1("structure/link_rate_limit", rate_limit, LINKS, true, "m/s",
          "greatest rate of each link's length, either way"),
    REAL1("structure/link_acceleration_limit", acceleration_limit, LINKS, true, "m/s^2",
          "greatest second derivative of each link's length, either way"),
    REAL1("structure/link_jerk_limit", jerk_limit, LINKS, true, "m/s^3",
          "greatest third derivative of each link's length, either way"),
    REAL1("structure/link_radius", link_radius, LINKS, true, "m", "radius of each link as a capsule"),
    INTS("structure/posts", post, POSTS, 2, OF(JOINTS), OF(JOINTS), "1",
         "bottom and top joint of each rigid post"),
    REAL1("structure/post_length", post_length, POSTS, true, "m", "length of each post"),
    INTS("structure/link_post_angles", link_post, LINK_POSTS, 2, OF(LINKS), OF(POSTS), "1",
         "link and post of each angle between a link's direction away from the post and the post, bottom to "
         "top"),
    REAL2("structure/link_post_angle_limits", link_post_limit, LINK_POSTS, -1, 2, true, "rad",
          "least and greatest angle of each link-post tuple"),
    INTS("structure/link_link_angles", link_link, LINK_LINKS, 2, OF(LINKS), OF(LINKS), "1",
         "two links that share a joint: the angle between their directions away from it"),
    REAL2("structure/link_link_angle_limits", link_link_limit, LINK_LINKS, -1, 2, true, "rad",
          "least and greatest angle of each link-link tuple"),
    INTS("structure/skin", skin, SKIN, 3, OF(JOINTS), OF(JOINTS), "1",
         "triangles of the layer facing the target, normals away from it"),
    INTS("structure/panels", panel, PANELS, 2, OF(POSTS), OF(POSTS), "1",
         "pairs of posts whose panel must stay plane; empty where joints are ball joints"),
    INT1("structure/fixed", fixed, FIXED, OF(JOINTS), "1",
         "posts held where they start; joints, where there are no posts"),
    REAL2("target/vertices", target_v, VERTICES, -1, 3, true, "m",
          "vertices of the target as used, in world coordinates at the end"),
    INTS("target/triangles", target_t, TRIANGLES, 3, OF(VERTICES), OF(VERTICES), "1",
         "triangles of the target, outward"),
    REAL2("deformed/vertices", deformed_v, PRESSED, -1, 3, false, "m",
          "vertices of a deformable target's surface as the pure blanket has pressed it at its end, the "
          "target in its place"),
    {"deformed/triangles",
     AT(deformed_t),
     MORPH_CELL_INT,
     2,
     {{PRESSED_TRIANGLES, 1}, {-1, 3}},
     {{PRESSED, 1}, {PRESSED, 1}},
     false,
     "1",
     "triangles of the pressed surface, outward"},
    REAL1("nominal/time", nominal_time, FRAMES, false, "s", "times of the pure blanket's frames"),
    REAL3("nominal/joints", nominal_joints, FRAMES, JOINTS, "m", "joint positions of the pure blanket"),
    REAL2("nominal/lengths", nominal_lengths, FRAMES, LINKS, 1, false, "m",
          "link lengths of the pure blanket"),
    REAL2("target/offset_nominal", offset_nominal, FRAMES, -1, 3, false, "m",
          "how far the target stands from its vertices at each nominal frame"),
    REAL2("placement/before", placement_before, SEEDS, -1, 4, false, "m, N m2",
          "centres of attraction that placement starts from: x, y, z, strength"),
    REAL2("placement/after", placement_after, PLACED, -1, 4, false, "m, N m2",
          "centres of attraction as placed: x, y, z, strength"),
    REAL1("guided/time", guided_time, GUIDED, false, "s",
          "times of the blanket under the centres, which move as they are placed"),
    REAL3("guided/joints", guided_joints, GUIDED, JOINTS, "m", "joint positions of the guided blanket"),
    REAL2("guided/lengths", guided_lengths, GUIDED, LINKS, 1, false, "m",
          "link lengths of the guided blanket"),
    REAL1("path/s", path_s, POSES, false, "1", "path parameter of each pose"),
    REAL2("path/poses", path_poses, POSES, WIDTH, 1, false, "m",
          "centre and direction (not of unit length) of each post; the joints where there are no posts"),
    REAL1("timing/knots", timing_knot, TIMING_KNOTS, false, "1",
          "knots of the quintic spline s(tau), tau = time / duration, six more than control points"),
    REAL1("timing/control", timing_control, TIMING_CONTROLS, false, "1",
          "control points of that spline: path parameters; the path is the quintic spline through path/poses "
          "at path/s"),
    {"timing/duration",
     AT(timing_duration),
     MORPH_CELL_REAL,
     1,
     {{-1, 1}},
     {{-1, 0}, {-1, 0}},
     false,
     "s",
     "duration of the motion"},
    REAL1("schedule/time", time, SAMPLES, false, "s", "times of the samples: uniform, from 0"),
    REAL3("schedule/joints", schedule_joints, SAMPLES, JOINTS, "m", "joint positions"),
    REAL2("schedule/length", length, SAMPLES, LINKS, 1, false, "m", "link lengths: what actuators follow"),
    REAL2("schedule/rate", rate, SAMPLES, LINKS, 1, false, "m/s",
          "exact first derivative of the lengths by time"),
    REAL2("schedule/acceleration", acceleration, SAMPLES, LINKS, 1, false, "m/s^2",
          "exact second derivative of the lengths by time"),
    REAL2("target/offset_schedule", offset_schedule, SAMPLES, -1, 3, false, "m",
          "how far the target stands from its vertices at each sample"),
    REAL1("replay/time", replay_time, REPLAYED, false, "s",
          "times of the replay: the schedule's lengths prescribed, no target"),
    REAL3("replay/joints", replay_joints, REPLAYED, JOINTS, "m", "joint positions of the replay"),
    REAL1("replay_core/time", core_time, CORE, false, "s",
          "times of the replay with the target as a solid core"),
    REAL3("replay_core/joints", core_joints, CORE, JOINTS, "m",
          "joint positions of the replay with the target as a solid core"),
    MOBILE("mobility/sample", mobility_sample, OF(SAMPLES), "1",
           "samples of the schedule that were examined"),
    MOBILE("mobility/rank", mobility_rank, ANY, "1", "rank of the rows of links (locked), posts and panels"),
    MOBILE("mobility/free", mobility_free, ANY, "1", "motions left free beyond the six rigid ones"),
    MOBILE("mobility/redundant", mobility_redundant, ANY, "1", "rows beyond the rank"),
    REAL1(
        "mobility/sigma_min", mobility_sigma_min, MOBILITY, false, "1",
        "least singular value of the rows of unit norm, rigid motions projected out; 0 if a motion is free"),
};
const int morph_record_dataset_total = (int)(sizeof morph_record_datasets / sizeof morph_record_datasets[0]);

int *morph_record_count(morph_record *record, int count) {
    return (int *)(void *)((char *)record + morph_record_counts[count]);
}

/* Arrays have several pointer types; their bytes are copied, not aliased. */
void *morph_record_array(const morph_record *record, const morph_dataset *set) {
    void *array;
    memcpy(&array, (const char *)record + set->field, sizeof array);
    return array;
}

void morph_record_set_array(morph_record *record, const morph_dataset *set, void *array) {
    memcpy((char *)record + set->field, &array, sizeof array);
}

static int count_of(const morph_record *record, int count) {
    int n;
    memcpy(&n, (const char *)record + morph_record_counts[count], sizeof n);
    return n;
}

/* Length of "structure" in "structure/links". */
static size_t group_length(const char *path) {
    return strcspn(path, "/");
}

const char *morph_record_incomplete(const morph_record *record) {
    for (int i = 0; i < morph_record_dataset_total; i++) {
        const morph_dataset *set = &morph_record_datasets[i];
        if (morph_record_array(record, set)) continue;
        if (set->required) {
            if (count_of(record, set->shape[0].count) > 0) return set->path;
            continue;
        }
        size_t group = group_length(set->path);
        if (strncmp(set->path, "target", group) == 0) continue; /* the two offsets stand alone */
        for (int k = 0; k < morph_record_dataset_total; k++) {
            const morph_dataset *other = &morph_record_datasets[k];
            if (group_length(other->path) == group && strncmp(other->path, set->path, group) == 0 &&
                morph_record_array(record, other))
                return set->path;
        }
    }
    return NULL;
}

static bool column_holds(const morph_record *record, const morph_dataset *set, const int *values,
                         size_t entries, size_t columns, char *message, size_t size) {
    for (size_t i = 0; i < entries; i++) {
        const morph_extent *below = &set->below[i % columns == 0 ? 0 : 1];
        int limit = below->count >= 0 ? count_of(record, below->count) : below->times;
        bool bounded = below->count >= 0 || below->times > 0;
        if (values[i] >= 0 && (!bounded || values[i] < limit)) continue;
        snprintf(message, size, "%s: entry %zu is %d, out of range", set->path, i / columns, values[i]);
        return false;
    }
    return true;
}

bool morph_record_indices_hold(const morph_record *record, char *message, size_t size) {
    for (int i = 0; i < morph_record_count_total; i++) {
        if (count_of(record, i) >= 0) continue;
        snprintf(message, size, "a count is negative");
        return false;
    }
    for (int i = 0; i < morph_record_dataset_total; i++) {
        const morph_dataset *set = &morph_record_datasets[i];
        const int *values = morph_record_array(record, set);
        if (set->cell != MORPH_CELL_INT || !values) continue;
        size_t columns = set->rank == 2 ? (size_t)set->shape[1].times : 1;
        size_t entries = (size_t)count_of(record, set->shape[0].count) * columns;
        if (!column_holds(record, set, values, entries, columns, message, size)) return false;
    }
    return true;
}
