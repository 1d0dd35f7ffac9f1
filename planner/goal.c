#include "planner/goal.h"

static const char *const names[MORPH_GOAL_KINDS] = {"mean_gap", "max_gap", "coverage"};

const char *morph_goal_name(morph_goal_kind kind) {
    return (unsigned)kind < MORPH_GOAL_KINDS ? names[kind] : "unknown";
}

const char *morph_goal_unit(morph_goal_kind kind) {
    return kind == MORPH_GOAL_COVERAGE ? "share" : "m";
}

bool morph_goal_any(const morph_goal *goal) {
    for (int k = 0; k < MORPH_GOAL_KINDS; k++)
        if (goal->limit[k] > 0.0) return true;
    return false;
}

double morph_goal_margin(const morph_goal *goal, morph_goal_kind kind, double value) {
    return kind == MORPH_GOAL_COVERAGE ? value - goal->limit[kind] : goal->limit[kind] - value;
}

double morph_goal_tolerance(const morph_goal *goal, morph_goal_kind kind) {
    return 1e-9 * goal->limit[kind];
}

double morph_goal_miss(const morph_goal *goal, const double value[MORPH_GOAL_KINDS], double spacing) {
    double miss = 0.0;
    for (int k = 0; k < MORPH_GOAL_KINDS; k++) {
        if (!(goal->limit[k] > 0.0)) continue;
        const double margin = morph_goal_margin(goal, (morph_goal_kind)k, value[k]);
        if (margin >= -morph_goal_tolerance(goal, (morph_goal_kind)k)) continue;
        miss -= k == MORPH_GOAL_COVERAGE ? margin : margin / spacing;
    }
    return miss;
}
