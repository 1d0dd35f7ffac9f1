/* Scene by scene, method by method; whatever happens to one, its row stays. */
#include "planner/compare.h"

#include "planner/compare_method.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Progress of a method's stages under the scene's number and the method's name. */
typedef struct teller {
    const morph_control *control;
    int scene, scenes;
    const char *method;
} teller;

static int pass_stop(void *user) {
    return morph_stopped(((const teller *)user)->control);
}

static void pass_log(void *user, const char *line) {
    morph_log(((const teller *)user)->control, "%s", line);
}

static void pass_progress(void *user, const char *stage, double fraction) {
    const teller *t = user;
    char text[64];
    const bool same = strcmp(stage, t->method) == 0;
    snprintf(text, sizeof text, "%d/%d %s%s%s", t->scene, t->scenes, t->method, same ? "" : " ",
             same ? "" : stage);
    morph_progress(t->control, text, fraction);
}

static void put_outcome(morph_compare_row *row, const char *outcome) {
    row->feasible = false;
    snprintf(row->outcome, sizeof row->outcome, "%s", outcome);
}

/* What a call that did not work leaves in the row. */
static void mark(morph_compare_row *row, morph_status status) {
    if (status == MORPH_ERR_STOPPED) {
        put_outcome(row, "stopped");
        snprintf(row->reason, sizeof row->reason, row->measured ? "the best so far" : "nothing found yet");
    } else if (status != MORPH_OK) {
        row->measured = false;
        put_outcome(row, "failed");
        if (!row->reason[0]) snprintf(row->reason, sizeof row->reason, "%s", morph_status_text(status));
    }
}

static void run_row(morph_compare_shared *shared, teller *t, morph_compare_method method) {
    const morph_compare_entry *entry = &morph_compare_entries[method];
    morph_compare_row *row = &shared->row[method];
    const double since = morph_seconds();
    t->method = entry->name;
    pass_progress(t, entry->name, 0.0);
    mark(row, entry->run(shared, row));
    row->seconds = morph_seconds() - since;
    morph_log(t->control, "compare: %s: %s: %s%s%s", shared->scene->file, entry->name, row->outcome,
              row->reason[0] ? ": " : "", row->reason);
}

static void run_scene(morph_compare_result *result, teller *t) {
    const morph_control control = {pass_stop, pass_progress, pass_log, t};
    morph_compare_shared shared = {.scene = result->scene, .control = &control, .row = result->row};
    t->method = "target";
    pass_progress(t, "target", 0.0);
    const morph_status ready = morph_workspace_create(result->scene, &control, &shared.work);
    /* NLopt after Ipopt, whose time and number of centres it gets. */
    static const morph_compare_method order[MORPH_COMPARE_METHODS] = {
        MORPH_COMPARE_BLANKET, MORPH_COMPARE_SEEDS, MORPH_COMPARE_GUIDED,
        MORPH_COMPARE_NLOPT,   MORPH_COMPARE_PLAN,  MORPH_COMPARE_REFERENCE};
    for (int k = 0; k < MORPH_COMPARE_METHODS; k++) {
        morph_compare_row *row = &result->row[order[k]];
        if (!row->listed) continue;
        if (ready != MORPH_OK)
            mark(row, ready);
        else if (morph_stopped(t->control))
            mark(row, MORPH_ERR_STOPPED);
        else
            run_row(&shared, t, order[k]);
    }
    morph_compare_shared_free(&shared);
}

morph_status morph_compare_run(const morph_scene *const *scene, int scenes, const morph_control *control,
                               morph_compare **out) {
    *out = NULL;
    if (scenes < 1) return MORPH_ERR_INPUT;
    /* One BLAS thread: sums then repeat bit for bit. */
    morph_blas_threads(1);
    morph_compare *c = calloc(1, sizeof *c);
    if (!c || !(c->result = morph_alloc((size_t)scenes, sizeof *c->result))) {
        free(c);
        return MORPH_ERR_NOMEM;
    }
    c->scenes = scenes;
    teller t = {.control = control, .scenes = scenes};
    for (int k = 0; k < scenes; k++) {
        morph_compare_result *result = &c->result[k];
        result->scene = scene[k];
        t.scene = k + 1;
        for (int m = 0; m < MORPH_COMPARE_METHODS; m++) {
            const morph_compare_entry *entry = &morph_compare_entries[m];
            result->row[m].listed =
                entry->run && !(entry->places && scene[k]->attractors == MORPH_ATTRACT_NONE);
            if (result->row[m].listed && morph_stopped(control)) mark(&result->row[m], MORPH_ERR_STOPPED);
        }
        if (!morph_stopped(control)) run_scene(result, &t);
        for (int m = 0; m < MORPH_COMPARE_METHODS; m++) {
            const morph_compare_row *row = &result->row[m];
            c->failed = c->failed || strcmp(row->outcome, "failed") == 0;
            c->stopped = c->stopped || strcmp(row->outcome, "stopped") == 0;
        }
    }
    *out = c;
    return MORPH_OK;
}

void morph_compare_destroy(morph_compare *c) {
    if (!c) return;
    for (int k = 0; k < c->scenes; k++)
        for (int m = 0; m < MORPH_COMPARE_METHODS; m++)
            free(c->result[k].row[m].summary);
    free(c->result);
    free(c);
}

const char *morph_compare_quantity_name(morph_compare_quantity quantity) {
    static const char *const names[MORPH_COMPARE_QUANTITIES] = {"objective", "cavity_volume", "gap_mean",
                                                                "gap_target"};
    return names[quantity];
}

double morph_compare_value(const morph_compare_result *result, morph_compare_method method,
                           morph_compare_quantity quantity) {
    const morph_compare_row *row = &result->row[method];
    const double h = result->scene->structure.spacing;
    const double value[MORPH_COMPARE_QUANTITIES] = {row->measure.objective / (h * h * h * h),
                                                    row->measure.volume, row->measure.gap_mean / h,
                                                    row->measure.gap_target / h};
    return row->measured ? value[quantity] : (double)NAN;
}

double morph_compare_ratio(const morph_compare_result *result, morph_compare_method method,
                           morph_compare_method base, morph_compare_quantity quantity) {
    const double value = morph_compare_value(result, method, quantity);
    const double of = morph_compare_value(result, base, quantity);
    return value == 0.0 && of == 0.0 ? 1.0 : value / of;
}

/* The k-th smallest by counting: no memory, and comparisons are of tens of scenes. */
static double ranked(const morph_compare *c, morph_compare_method method, morph_compare_quantity q, int k) {
    for (int i = 0; i < c->scenes; i++) {
        const double at = morph_compare_ratio(&c->result[i], method, MORPH_COMPARE_BLANKET, q);
        int below = 0, equal = 0;
        for (int j = 0; j < c->scenes; j++) {
            const double other = morph_compare_ratio(&c->result[j], method, MORPH_COMPARE_BLANKET, q);
            below += other < at;
            equal += other == at;
        }
        if (below <= k && k < below + equal) return at; /* never for NaN: nothing is equal to it */
    }
    return NAN;
}

morph_compare_median morph_compare_medians(const morph_compare *c, morph_compare_method method) {
    morph_compare_median m = {0};
    for (int i = 0; i < c->scenes; i++) {
        const morph_compare_row *row = &c->result[i].row[method];
        const morph_compare_row *blanket = &c->result[i].row[MORPH_COMPARE_BLANKET];
        if (!row->measured || !blanket->measured) continue;
        m.scenes++;
        m.feasible += row->feasible;
        /* Coverage is a share of some hundred points: a difference below 1e-9 is rounding in their areas. */
        m.coverage_lower += row->measure.coverage < blanket->measure.coverage - 1e-9;
    }
    for (int q = 0; q < MORPH_COMPARE_QUANTITIES; q++) {
        const morph_compare_quantity quantity = (morph_compare_quantity)q;
        const double high = ranked(c, method, quantity, m.scenes / 2);
        const double low = ranked(c, method, quantity, m.scenes > 0 ? (m.scenes - 1) / 2 : 0);
        m.ratio[q] = low == high ? low : 0.5 * (low + high);
    }
    return m;
}
