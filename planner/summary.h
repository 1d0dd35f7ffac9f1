/* Numbers of one plan: summary.json and the six lines. */
#ifndef MORPH_SUMMARY_H
#define MORPH_SUMMARY_H

#include "model/blanket.h"
#include "model/cavity_parts.h"
#include "model/reach.h"
#include "planner/check.h"
#include "planner/replay.h"
#include "planner/target_body.h"

enum { MORPH_STAGES = 10 };
typedef enum morph_stage {
    MORPH_STAGE_TARGET,
    MORPH_STAGE_NOMINAL,
    MORPH_STAGE_PLACEMENT,
    MORPH_STAGE_REFINE,
    MORPH_STAGE_PATH,
    MORPH_STAGE_TIMING,
    MORPH_STAGE_MEASURE,
    MORPH_STAGE_REPLAY,
    MORPH_STAGE_CHECK,
    MORPH_STAGE_WRITE
} morph_stage;
const char *morph_stage_name(morph_stage stage); /* "target", "nominal", "refine", "path", ... */

/* How centres of attraction were placed (planner/placement.h). Forces in weights of a joint, lengths in
 * spacings. */
typedef struct morph_placement_summary {
    int seeds, centres, rounds, accepted, iterations, unknowns, rows;
    bool solved, stable;
    double residual, complementarity, difference, largest_force;
    char reason[160];
} morph_placement_summary;

/* The largest connected cavities of a pose, each with at least MORPH_CAVITY_SHARE of its cavity volume.
 * Columns are finer than the measure's (a sixteenth of the spacing): ways from one cavity to the next down a
 * steep wall are narrow. On plans of the suite 16 columns a spacing tore cavities apart that 32 and 64 show
 * as one. */
enum { MORPH_CAVITIES = 5, MORPH_CAVITY_COLUMNS = 32 };
#define MORPH_CAVITY_SHARE 0.01
typedef struct morph_cavity_list {
    int count;
    morph_cavity_part part[MORPH_CAVITIES];
    double volume,
        film; /* of everything by these columns, and of the film where the sheet lies on the target, m3 */
} morph_cavity_list;

typedef struct morph_summary {
    char title[128], scene[256], method[16], level[16];
    char outcome[16];
    struct {
        char kind[16]; /* "flat", "plan", "lengths", "pose" */
        double residual, doubt;
        int free_motions;
    } start; /* as morph_start; numbers only where it is not flat */
    bool feasible;
    char reason[512]; /* why not feasible: constraint, element, time, amount; else empty */
    bool has_plan, has_blanket;
    morph_measure blanket, plan;
    morph_cavity_list cavities_blanket, cavities_plan;
    bool has_guided;
    morph_measure seeded, guided; /* the blanket under the seeds, and under the centres placed */
    morph_placement_summary placement;
    bool has_reference;
    morph_measure reference; /* without limits of length and angle; planner/reference.h */
    double target_volume;
    morph_reach reach; /* what the target asks of the structure, before anything is solved */
    double spacing;
    morph_check_report check;
    int free_motions, redundant;
    double sigma_min; /* at the end of the schedule */
    double duration;
    /* What one link alone would need, rest to rest (planner/timing_bound.h), and which; -1: none moves. */
    double single_link_seconds;
    int single_link;
    int iterations_refine, iterations_path, iterations_timing;
    int unknowns_refine, rows_refine_used, rows_refine_possible;
    int unknowns_path, rows_path_used, rows_path_possible;
    double linear_seconds, callback_seconds;
    double seconds[MORPH_STAGES];
    double total_seconds;
    double budget;       /* s; 0: none */
    bool budget_ran_out; /* something was cut short by it */
    long peak_memory_bytes;
    morph_blanket_report blanket_report;
    /* Largest second difference of a link's length over the blanket's frames, m per frame^2: jumps show. */
    double largest_jump;
    int jump_link; /* its link */
    double jump_time;
    morph_replay_report replay, replay_core; /* without the target, and with it as a solid */
    morph_deformable_report deformable;
    double sdf_cell, sdf_rms, sdf_max;
    char blas[64]; /* BLAS kernel name, "" if unknown */
    char warning[512];
} morph_summary;

#endif
