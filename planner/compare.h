/* The comparison: for each scene the methods side by side, from the pure blanket to the reference. */
#ifndef MORPH_COMPARE_H
#define MORPH_COMPARE_H

#include "planner/plan.h"

/* In the order of the rows. */
typedef enum morph_compare_method {
    MORPH_COMPARE_BLANKET,   /* the pure blanket's end */
    MORPH_COMPARE_SEEDS,     /* the blanket's end with seed centres only */
    MORPH_COMPARE_NLOPT,     /* with the centres that NLopt placed */
    MORPH_COMPARE_GUIDED,    /* with the centres that Ipopt placed */
    MORPH_COMPARE_PLAN,      /* the whole plan's end */
    MORPH_COMPARE_REFERENCE, /* without limits of length and angle: planner/reference.h */
    MORPH_COMPARE_METHODS
} morph_compare_method;
const char *morph_compare_name(morph_compare_method method);    /* "blanket", "seeds", ... */
const char *morph_compare_meaning(morph_compare_method method); /* a few words */

typedef struct morph_compare_row {
    bool listed;   /* the method is there; else the row is empty and not shown */
    bool measured; /* there is a shape, and `measure` is of it */
    bool feasible; /* that shape (plan: the whole schedule) holds every limit that its method knows */
    morph_measure measure;
    double seconds;         /* wall */
    char outcome[16];       /* "optimal", "feasible", "infeasible", "stopped", "failed" */
    char reason[512];       /* why not feasible, or what else there is to know; may be empty */
    morph_summary *summary; /* of a plan, owned; else NULL */
} morph_compare_row;

typedef struct morph_compare_result {
    const morph_scene *scene; /* borrowed */
    morph_compare_row row[MORPH_COMPARE_METHODS];
} morph_compare_result;

typedef struct morph_compare {
    int scenes;
    morph_compare_result *result;
    bool stopped; /* by the caller: what had not been done says "stopped" */
    bool failed;  /* a method failed outright */
} morph_compare;

/* Runs every method on every scene; scenes are borrowed and must outlive the result. A method that fails or
 * is not feasible keeps its row and says so. Progress is told as "2/12 plan refine". MORPH_OK also when
 * stopped; MORPH_ERR_INPUT without a scene, MORPH_ERR_NOMEM only for the rows themselves. */
morph_status morph_compare_run(const morph_scene *const *scene, int scenes, const morph_control *control,
                               morph_compare **out);
void morph_compare_destroy(morph_compare *compare); /* NULL allowed */

/* What is set against the pure blanket. */
typedef enum morph_compare_quantity {
    MORPH_COMPARE_OBJECTIVE,
    MORPH_COMPARE_VOLUME,
    MORPH_COMPARE_GAP,
    MORPH_COMPARE_TARGET_GAP,
    MORPH_COMPARE_QUANTITIES
} morph_compare_quantity;
const char *morph_compare_quantity_name(morph_compare_quantity quantity); /* "objective", ... */
/* In spacings^4, m3, spacings, spacings. */
double morph_compare_value(const morph_compare_result *result, morph_compare_method method,
                           morph_compare_quantity quantity);
/* Of a method's value to that of `base`: 1 where both are 0, infinite where only the base is; NaN where
 * either has no shape. */
double morph_compare_ratio(const morph_compare_result *result, morph_compare_method method,
                           morph_compare_method base, morph_compare_quantity quantity);

/* Over the scenes where both the method and the pure blanket have a shape, feasible or not. */
typedef struct morph_compare_median {
    int scenes, feasible;
    double ratio[MORPH_COMPARE_QUANTITIES]; /* medians to the pure blanket; of an even number the mean of the
                                               two in the middle; NaN without a scene */
    int coverage_lower;                     /* scenes where it covers less than the pure blanket */
} morph_compare_median;
morph_compare_median morph_compare_medians(const morph_compare *compare, morph_compare_method method);

/* The table that the program prints; "scenes" times a block, then the medians. ASCII but for file names. */
morph_status morph_compare_text(const morph_compare *compare, char **text); /* free() */
/* compare.json: a list of summaries, one for each scene and method. */
morph_status morph_compare_json(const morph_compare *compare, char **text); /* free() */
/* compare.html: one page without scripts or anything from elsewhere. */
morph_status morph_compare_html(const morph_compare *compare, char **text); /* free() */

/* Refuses early a folder that cannot take the comparison, and writes it: compare.json, compare.html; whole
 * or not at all, as plan folders are. message: one line. */
morph_status morph_compare_probe(const char *folder, bool overwrite, char *message, size_t size);
morph_status morph_compare_write(const char *folder, bool overwrite, const morph_compare *compare,
                                 char *message, size_t size);

#endif
