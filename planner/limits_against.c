/* Which limits stood against a goal, by the multipliers of a solve that minimised the miss alone. */
#include "planner/refine_goal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum against_kind {
    AGAINST_LONGEST,
    AGAINST_SHORTEST,
    AGAINST_STUCK,
    AGAINST_LINK_POST,
    AGAINST_LINK_LINK,
    AGAINST_CLEARANCE,
    AGAINST_SELF,
    AGAINST_BASE,
    AGAINST_KINDS
} against_kind;

enum { NAMED = 3 };

typedef struct candidate {
    against_kind kind;
    double strength; /* multiplier times scale */
    int block, row;  /* block -1: coordinate `row` at the base plane */
    bool least;      /* at its least, not at its most */
    bool taken;
} candidate;

typedef struct weigher {
    const morph_structure *s;
    const morph_block *blocks;
    candidate *list;
    int count;
    double sum[AGAINST_KINDS];
} weigher;

static void add(weigher *w, candidate c) {
    if (!(c.strength > 0.0) || !isfinite(c.strength)) return;
    w->sum[c.kind] += c.strength;
    w->list[w->count++] = c;
}

/* A length's row is its square: 2 L per spacing. An angle's is the cosine: sin per radian. Distances have
 * slope 1. Rows that are no limits (posts, the goal's own) are left out. A positive multiplier stands at the
 * upper bound. */
static void weigh_row(weigher *w, int block, int row, double multiplier) {
    const morph_block *b = &w->blocks[block];
    candidate c = {.strength = fabs(multiplier), .block = block, .row = row, .least = multiplier < 0.0};
    const double bound = multiplier < 0.0 ? b->lower[row] : b->upper[row];
    if (strcmp(b->name, "length") == 0) {
        c.kind = b->lower[row] == b->upper[row] ? AGAINST_STUCK
                 : c.least                      ? AGAINST_SHORTEST
                                                : AGAINST_LONGEST;
        c.strength *= 2.0 * sqrt(fmax(0.0, bound));
    } else if (strcmp(b->name, "angle") == 0) {
        const morph_angle_rows *rows = b->data;
        c.kind = rows->tuple[row] < w->s->link_posts ? AGAINST_LINK_POST : AGAINST_LINK_LINK;
        c.least = !c.least; /* the cosine falls where the angle grows */
        c.strength *= sqrt(fmax(0.0, 1.0 - bound * bound));
    } else if (strcmp(b->name, "clearance") == 0 || strcmp(b->name, "clearance of features") == 0) {
        c.kind = AGAINST_CLEARANCE;
    } else if (strcmp(b->name, "self clearance") == 0) {
        c.kind = AGAINST_SELF;
    } else {
        return;
    }
    add(w, c);
}

static int strongest(const weigher *w, int kind) {
    int best = -1;
    for (int k = 0; k < w->count; k++)
        if (!w->list[k].taken && (kind < 0 || (int)w->list[k].kind == kind) &&
            (best < 0 || w->list[k].strength > w->list[best].strength))
            best = k;
    return best;
}

/* "length of link 17 (2,1)-(3,1) bottom (at its longest)" */
static void describe(const weigher *w, const candidate *c, char *text, size_t size) {
    char element[112] = "";
    if (c->block >= 0)
        w->blocks[c->block].describe(w->blocks[c->block].data, c->row, element, sizeof element);
    else
        morph_joint_name(w->s, c->row / 3, element, sizeof element);
    switch (c->kind) {
    case AGAINST_LONGEST:
    case AGAINST_SHORTEST:
        snprintf(text, size, "length of %s (at its %s)", element, c->least ? "shortest" : "longest");
        return;
    case AGAINST_STUCK: /* which way it would have to go */
        snprintf(text, size, "length of %s (stuck, too %s)", element, c->least ? "long" : "short");
        return;
    case AGAINST_LINK_POST:
    case AGAINST_LINK_LINK:
        snprintf(text, size, "angle of %s (at its %s)", element, c->least ? "least" : "most");
        return;
    case AGAINST_CLEARANCE:
        snprintf(text, size, "clearance of %s", element);
        return;
    case AGAINST_SELF:
        snprintf(text, size, "self clearance of %s", element);
        return;
    case AGAINST_BASE:
        snprintf(text, size, "base under %s", element);
        return;
    case AGAINST_KINDS:
        break;
    }
    text[0] = '\0';
}

static void name_them(weigher *w, char *text, size_t size) {
    double all = 0.0;
    for (int k = 0; k < AGAINST_KINDS; k++)
        all += w->sum[k];
    for (int n = 0; n < NAMED; n++) {
        int kind = -1;
        for (int k = 0; k < AGAINST_KINDS; k++)
            if (w->sum[k] > 0.0 && (kind < 0 || w->sum[k] > w->sum[kind])) kind = k;
        /* Less than a hundredth of all is the solver's tolerance, not a reason. */
        if (kind >= 0 && w->sum[kind] < 0.01 * all) kind = -1;
        if (kind >= 0) w->sum[kind] = 0.0;
        const int best = strongest(w, kind);
        if (best < 0 || w->list[best].strength < 1e-3 * all) return;
        w->list[best].taken = true;
        const size_t used = strlen(text);
        char one[176];
        describe(w, &w->list[best], one, sizeof one);
        snprintf(text + used, size - used, "%s%s", n > 0 ? ", " : "", one);
    }
}

morph_status morph_limits_against(const morph_structure *s, const morph_nlp *nlp, const morph_block *blocks,
                                  int count, const morph_nlp_result *result, const double *base, char *text,
                                  size_t size) {
    const int n = 3 * s->joints;
    text[0] = '\0';
    weigher w = {.s = s, .blocks = blocks};
    w.list = morph_alloc((size_t)result->rows + (size_t)n, sizeof *w.list);
    if (!w.list) return MORPH_ERR_NOMEM;
    for (int b = 0; b < count && result->row_multiplier; b++) {
        const int first = morph_nlp_first_row(nlp, b);
        for (int r = 0; first >= 0 && r < blocks[b].rows; r++)
            weigh_row(&w, b, r, result->row_multiplier[first + r]);
    }
    /* A joint on the base plane; other lower bounds are the round's reach. */
    for (int i = 2; i < n && result->lower_multiplier; i += 3)
        if (result->x[i] - base[i] < 1e-4 && !(s->fixed_joints > 0 && s->joint_fixed[i / 3]))
            add(&w, (candidate){.kind = AGAINST_BASE,
                                .strength = result->lower_multiplier[i],
                                .block = -1,
                                .row = i,
                                .least = true});
    name_them(&w, text, size);
    free(w.list);
    return MORPH_OK;
}
