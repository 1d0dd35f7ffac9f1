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

/* NAMED: limits in a message. PARTS: at most so many causes of one kind, the kinds of links. */
enum { NAMED = 3, PARTS = 3, CAUSES = PARTS * AGAINST_KINDS };

/* What is compared is how much less would be missed, to first order, if a limit gave way: a length or a
 * distance by a tenth of a spacing, an angle by as much at a link's end; a stuck link as far as the limits
 * of its layer let it go, for it has no limit that one could move. */
#define GIVE_LENGTH 0.1
#define GIVE_ANGLE 0.1

typedef struct candidate {
    against_kind kind;
    double strength; /* multiplier times slope times what gives way */
    int cause;       /* see cause_of */
    int block, row;  /* block -1: coordinate `row` at the base plane */
    bool least;      /* at its least, not at its most */
    bool taken;
} candidate;

typedef struct weigher {
    const morph_structure *s;
    const morph_block *blocks;
    candidate *list;
    int count;
    double sum[CAUSES];
} weigher;

/* Elements at one number of the scene are one cause: a layer's shortest or longest length, an angle's least
 * or most, a stuck link; giving way it gives way for all of them. Target and base plane are one too, what
 * lies beneath: the skin rests on them, so they stand against nearly every goal, and named once they leave
 * room for the limits of the structure. */
static int cause_of(const weigher *w, const candidate *c) {
    int part = 0;
    against_kind kind = c->kind;
    if (kind == AGAINST_BASE) kind = AGAINST_CLEARANCE;
    if (kind == AGAINST_LINK_POST || kind == AGAINST_LINK_LINK) part = c->least ? 1 : 0;
    if (kind == AGAINST_LONGEST || kind == AGAINST_SHORTEST) {
        const morph_length_rows *rows = w->blocks[c->block].data;
        part = w->s->link_kind[rows->link[c->row]];
    }
    return PARTS * (int)kind + part;
}

static void add(weigher *w, candidate c) {
    if (!(c.strength > 0.0) || !isfinite(c.strength)) return;
    c.cause = cause_of(w, &c);
    w->sum[c.cause] += c.strength;
    w->list[w->count++] = c;
}

/* How far a stuck link of this length (spacings) could go if it were not. */
static double stuck_room(const weigher *w, int link, double length, bool shorter) {
    const morph_structure *s = w->s;
    const double *layer = s->def.length[s->link_kind[link]];
    /* Limits of braces are shares of their start length, which they hold. */
    const double unit = (s->link_kind[link] == MORPH_LINK_BRACE ? s->start_length[link] : 1.0) / s->spacing;
    return fmax(0.0, shorter ? length - layer[0] * unit : layer[1] * unit - length);
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
        const morph_length_rows *rows = b->data;
        const double length = sqrt(fmax(0.0, bound));
        c.strength *=
            2.0 * length *
            (c.kind == AGAINST_STUCK ? stuck_room(w, rows->link[row], length, c.least) : GIVE_LENGTH);
    } else if (strcmp(b->name, "angle") == 0) {
        const morph_angle_rows *rows = b->data;
        c.kind = rows->tuple[row] < w->s->link_posts ? AGAINST_LINK_POST : AGAINST_LINK_LINK;
        c.least = !c.least; /* the cosine falls where the angle grows */
        c.strength *= GIVE_ANGLE * sqrt(fmax(0.0, 1.0 - bound * bound));
    } else if (strcmp(b->name, "clearance") == 0 || strcmp(b->name, "clearance of features") == 0) {
        c.kind = AGAINST_CLEARANCE;
        c.strength *= GIVE_LENGTH;
    } else if (strcmp(b->name, "self clearance") == 0) {
        c.kind = AGAINST_SELF;
        c.strength *= GIVE_LENGTH;
    } else {
        return;
    }
    add(w, c);
}

/* cause: -1 for any. */
static int strongest(const weigher *w, int cause) {
    int best = -1;
    for (int k = 0; k < w->count; k++)
        if (!w->list[k].taken && (cause < 0 || w->list[k].cause == cause) &&
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
    for (int k = 0; k < CAUSES; k++)
        all += w->sum[k];
    for (int n = 0; n < NAMED; n++) {
        int cause = -1;
        for (int k = 0; k < CAUSES; k++)
            if (w->sum[k] > 0.0 && (cause < 0 || w->sum[k] > w->sum[cause])) cause = k;
        /* Less than a hundredth of all is the solver's tolerance, not a reason. */
        if (cause >= 0 && w->sum[cause] < 0.01 * all) cause = -1;
        if (cause >= 0) w->sum[cause] = 0.0;
        const int best = strongest(w, cause);
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
                                .strength = GIVE_LENGTH * result->lower_multiplier[i],
                                .block = -1,
                                .row = i,
                                .least = true});
    name_them(&w, text, size);
    free(w.list);
    return MORPH_OK;
}
