#include "planner/reach_text.h"

#include "planner/plan.h"

morph_status morph_scene_reach(const morph_scene *scene, const morph_structure *structure,
                               const morph_distance *exact, morph_reach *out) {
    return morph_reach_check(structure, exact, scene->base, morph_scene_start_height(scene), out);
}

const char *morph_reach_verdict_name(morph_reach_verdict verdict) {
    static const char *const names[] = {"untested", "within", "note", "out"};
    return names[(int)verdict];
}

const char *morph_reach_unit(morph_reach_kind kind) {
    static const char *const units[MORPH_REACH_KINDS] = {"m", "m2", "1", "m", "m", "rad", "m", "1"};
    return units[(int)kind];
}

static double degrees(double radians) {
    return radians * 180.0 / acos(-1.0);
}

/* What is asked and what can be given, without place or verdict. */
static void say_numbers(FILE *out, const morph_reach_item *item, morph_reach_kind kind) {
    const double a = item->number, b = item->limit;
    switch (kind) {
    case MORPH_REACH_LENGTH:
        fprintf(out, "the way across the target is %.3g m, the links of a line reach %.3g m", a, b);
        break;
    case MORPH_REACH_AREA:
        fprintf(out, "the target seen from above asks for %.3g m2, the sheet stretches to %.3g m2", a, b);
        break;
    case MORPH_REACH_STRETCH:
        fprintf(
            out,
            "the steepest piece asks for %.3g times its plan length, links reach %.3g times their shortest",
            a, b);
        break;
    case MORPH_REACH_HOLE:
        fprintf(
            out,
            "holes and grooves lie up to %.3g m below what the sheet can bend into, covered counts to %.3g m",
            a, b);
        break;
    case MORPH_REACH_BUMP:
        fprintf(out, "bumps narrower than two spacings are %.3g m high, sheets blur those above %.3g m", a,
                b);
        break;
    case MORPH_REACH_BEND:
        fprintf(out,
                "the sharpest ridge bends by %.3g degrees from link to link, the angle limits leave %.3g",
                degrees(a), degrees(b));
        break;
    case MORPH_REACH_HELD:
        fprintf(out, "the way from held end to held end over the target is %.3g m, the links reach %.3g m", a,
                b);
        break;
    case MORPH_REACH_HIDDEN:
        fprintf(out, "%.3g %% of the surface lies under other parts of it, where no sheet from above gets",
                100.0 * a);
        break;
    case MORPH_REACH_KINDS:
        break;
    }
}

static void say_place(FILE *out, const morph_reach_item *item, morph_reach_kind kind) {
    if (kind == MORPH_REACH_HIDDEN || kind == MORPH_REACH_AREA) return;
    const bool line = kind == MORPH_REACH_LENGTH || kind == MORPH_REACH_STRETCH || kind == MORPH_REACH_BEND ||
                      kind == MORPH_REACH_HELD;
    if (!(item->number > 0.0)) return;
    fprintf(out, " (at (%.3g, %.3g, %.3g) m", item->at[0] + 0.0, item->at[1] + 0.0, item->at[2] + 0.0);
    if (line) fprintf(out, ", next to grid line %s = %d", item->along_y ? "i" : "j", item->line);
    fprintf(out, ")");
}

static void say_lost(FILE *out, const morph_reach_item *item) {
    if (item->lost >= 5e-4)
        fprintf(out, ": %.3g %% of what is seen from above stays uncovered", 100.0 * item->lost);
}

void morph_reach_lines(FILE *out, const morph_reach *reach) {
    static const char *const verdicts[] = {"", "within", "note  ", "OUT   "};
    const char *head = "reach     ";
    for (int k = 0; k < MORPH_REACH_KINDS; k++) {
        const morph_reach_item *item = &reach->item[k];
        if (item->verdict == MORPH_REACH_UNTESTED) continue;
        fprintf(out, "%s %-7s  %s  ", head, morph_reach_name((morph_reach_kind)k),
                verdicts[(int)item->verdict]);
        say_numbers(out, item, (morph_reach_kind)k);
        say_place(out, item, (morph_reach_kind)k);
        say_lost(out, item);
        fprintf(out, "\n");
        head = "          ";
    }
    fprintf(out, "%s %s: a sheet can cover at most %.3g %% of what is seen from above\n", head,
            reach->within ? "within reach" : "out of reach", 100.0 * reach->coverage);
}

void morph_reach_sentence(const morph_reach *reach, morph_reach_kind kind, char *text, size_t size) {
    const morph_reach_item *item = &reach->item[(int)kind];
    if (size > 0) text[0] = '\0';
    if (item->verdict != MORPH_REACH_NOTE && item->verdict != MORPH_REACH_OUT) return;
    FILE *out = fmemopen(text, size, "w");
    if (!out) return;
    fprintf(out, "%s: %s: ", item->verdict == MORPH_REACH_OUT ? "out of reach" : "reach",
            morph_reach_name(kind));
    say_numbers(out, item, kind);
    say_place(out, item, kind);
    say_lost(out, item);
    fclose(out);
    if (size > 0) text[size - 1] = '\0';
}
