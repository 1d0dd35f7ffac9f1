/* Shares of the time by limits. With V, A, J all rates, accelerations and jerks times a factor each, a
 * profile run c times as fast needs c V, c^2 A, c^3 J, so the shortest time is homogeneous:
 *     T(c V, c^2 A, c^3 J) = T / c,   hence   t_V + 2 t_A + 3 t_J = T   with t_X = -dT / d ln X:
 * what a small relative change of each limit saves. At every instant of a fastest profile one limit is
 * reached: that one is taken to hold up its instant, so that dt is split as 1, 1/2, 1/3 of it. */
#include "planner/timing_against.h"

#include "planner/timing_rows.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KINDS = 3, INSTANTS = 1000 };
static const char *const kind_name[KINDS] = {"rate", "acceleration", "jerk"};
static const char *const kind_unit[KINDS] = {"m/s", "m/s2", "m/s3"};

/* Kinds with less than this of all are the ramps that every schedule has at its ends. */
#define LEAST_SHARE 0.1

typedef struct held_up {
    double seconds; /* t_X of one link */
    double ratio;   /* largest, to its limit, where it holds up the time */
    double time;    /* of that, s */
} held_up;

static double limit_of(const morph_structure *s, int kind, int link) {
    const double *all[KINDS] = {s->rate_limit, s->acceleration_limit, s->jerk_limit};
    return all[kind][link];
}

/* How much time must be stretched for a ratio to become 1. */
static double stretch_of(int kind, double ratio) {
    return kind == 0 ? ratio : kind == 1 ? sqrt(ratio) : cbrt(ratio);
}

/* One instant, of dt seconds, to the limit that comes nearest. */
static void credit(const morph_path_table *table, double t, double dt, held_up *list) {
    const morph_structure *s = table->curve->structure;
    int best = -1;
    double most = 0.0, ratio = 0.0;
    for (int n = 0; n < KINDS * s->links; n++) {
        const int kind = n / s->links, link = n % s->links;
        const double r = fabs(table->by_time[s->links + n]) / limit_of(s, kind, link);
        /* Mirrored links are equal but for rounding: the first of them stays. */
        if (stretch_of(kind, r) <= most * (1.0 + 1e-6)) continue;
        most = stretch_of(kind, r);
        ratio = r;
        best = n;
    }
    if (best < 0) return;
    list[best].seconds += dt / (1 + best / s->links);
    if (ratio > list[best].ratio) {
        list[best].ratio = ratio;
        list[best].time = t;
    }
}

static morph_status fill(const morph_curve *curve, const morph_timing *timing, held_up *list) {
    morph_path_table table;
    const morph_status status = morph_path_table_create(curve, &table);
    if (status != MORPH_OK) return status;
    const double dt = timing->duration / INSTANTS;
    for (int i = 0; i < INSTANTS; i++) {
        double s[4];
        const double t = (i + 0.5) * dt;
        morph_timing_eval(timing, t, s);
        morph_path_table_exact(&table, s[0], 3);
        morph_timing_chain(curve->structure->links, table.exact, s, table.by_time);
        credit(&table, t, dt, list);
    }
    morph_path_table_free(&table);
    return MORPH_OK;
}

/* How far the profile run `faster` times as fast passes the limit, in limits. */
static double beyond(const held_up *h, int kind, double faster) {
    return h->ratio * pow(faster, kind + 1) - 1.0;
}

static void describe(const morph_structure *s, int kind, int link, const held_up *h, double faster,
                     double asked, char *text, size_t size) {
    char element[96] = "";
    const double limit = limit_of(s, kind, link);
    morph_link_name(s, link, element, sizeof element);
    snprintf(text, size, "%s of %s at %.3f s (%.3g %s beyond %.3g %s in %.6g s)", kind_name[kind], element,
             h->time, limit * beyond(h, kind, faster), kind_unit[kind], limit, kind_unit[kind], asked);
}

static void name_them(const morph_structure *s, const held_up *list, double faster, double asked, char *text,
                      size_t size) {
    double sum[KINDS] = {0.0}, all = 0.0;
    for (int n = 0; n < KINDS * s->links; n++) {
        /* Where nothing moves but rounding, nothing is passed either. */
        if (beyond(&list[n], n / s->links, faster) <= 0.0) continue;
        sum[n / s->links] += list[n].seconds;
        all += list[n].seconds;
    }
    for (int count = 0; count < KINDS; count++) {
        int kind = 0, link = 0;
        for (int k = 1; k < KINDS; k++)
            if (sum[k] > sum[kind]) kind = k;
        if (!(sum[kind] > LEAST_SHARE * all)) return;
        sum[kind] = 0.0;
        const held_up *of = &list[kind * s->links];
        for (int l = 1; l < s->links; l++)
            if (of[l].seconds > of[link].seconds) link = l;
        const size_t used = strlen(text);
        char one[176];
        describe(s, kind, link, &of[link], faster, asked, one, sizeof one);
        snprintf(text + used, size - used, "%s%s", count > 0 ? ", " : "", one);
    }
}

morph_status morph_timing_against(const morph_curve *curve, const morph_timing *timing, double asked,
                                  char *text, size_t size) {
    const morph_structure *s = curve->structure;
    text[0] = '\0';
    held_up *list = morph_alloc(KINDS * (size_t)s->links, sizeof *list);
    if (!list) return MORPH_ERR_NOMEM;
    for (int n = 0; n < KINDS * s->links; n++)
        list[n] = (held_up){0};
    const morph_status status = fill(curve, timing, list);
    if (status == MORPH_OK) name_them(s, list, timing->duration / asked, asked, text, size);
    free(list);
    return status;
}
