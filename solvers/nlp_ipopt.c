/* One run of Ipopt on the assembled problem: options, callbacks, return codes, its timing print. */
#include "solvers/ipopt_shim.h"
#include "solvers/nlp_internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* MUMPS orderings: 0 AMD, 2 AMF, 3 SCOTCH, 4 PORD, 5 METIS, 6 QAMD, 7 automatic. SCOTCH and METIS draw random
 * numbers (a MUMPS without METIS falls back to the others), so that a second solve in one process differs
 * from the first on grids of 3000 unknowns; PORD ends the process on some small problems. AMD and QAMD repeat
 * and are as fast there as the others within 15 %; QAMD copes with dense rows, as of an unknown that every
 * row shares. */
enum { MORPH_PIVOT_ORDER = 6, MORPH_PIVOT_DISSECT = 3 };

/* Ipopt takes bounds beyond 1e19 for none. */
static const double no_bound = 2e19;

typedef struct session {
    morph_nlp *nlp;
    const morph_nlp_options *options;
    morph_run *run;
    double start, callback_seconds;
    int first_points;
    morph_status fatal; /* a block's own failure: every later callback refuses, so that Ipopt ends soon */
} session;

/* ------------------------------------------------------------------ the best point, kept by ourselves */

/* Called when the rows at x are in the cache. The intermediate callback of 3.11 cannot give the iterate, and
 * the last point evaluated may be a rejected trial, so every evaluated point is a candidate. */
static void note_point(session *s, const double *x) {
    morph_nlp *nlp = s->nlp;
    morph_run *run = s->run;
    const double violation = morph_nlp_violation(nlp, x, nlp->row_value, NULL);
    const bool feasible = violation <= s->options->violation_tolerance;
    const int now = run->best_current;
    if (now >= 0 && run->best_feasible[now] && !feasible) return;
    if (now >= 0 && !run->best_feasible[now] && !feasible && violation >= run->best_violation[now]) return;
    double objective = INFINITY;
    if (morph_nlp_objective_at(nlp, x) == MORPH_OK)
        objective = nlp->objective;
    else if (feasible)
        return;
    if (now >= 0 && run->best_feasible[now] && objective >= run->best_objective[now]) return;
    const int next = now == 0 ? 1 : 0;
    run->best_feasible[next] = feasible;
    run->best_objective[next] = objective;
    run->best_violation[next] = violation;
    memcpy(morph_run_array(run, run->best_x[next]), x, (size_t)nlp->unknowns * sizeof *x);
    run->best_current = next;
}

/* ------------------------------------------------------------------ callbacks */

/* Books the status of an evaluation; what Ipopt hears is only good or bad. */
static morph_ip_bool ended(session *s, double begin, morph_status status) {
    s->callback_seconds += morph_seconds() - begin;
    if (status == MORPH_ERR_NONFINITE)
        s->run->nonfinite = true;
    else if (status == MORPH_ERR_STOPPED)
        s->run->stopped = true;
    else if (status != MORPH_OK && s->fatal == MORPH_OK)
        s->fatal = status;
    return status == MORPH_OK;
}

static bool given_up(const session *s) {
    return s->fatal != MORPH_OK || s->run->stopped;
}

static morph_ip_bool eval_f(int n, double *x, morph_ip_bool new_x, double *value, void *user) {
    (void)n;
    (void)new_x;
    session *s = user;
    if (given_up(s)) return false;
    const double begin = morph_seconds();
    const morph_status status = morph_nlp_objective_at(s->nlp, x);
    if (status == MORPH_OK) {
        *value = s->nlp->objective;
        /* Without rows eval_g is not called. */
        if (s->nlp->rows == 0) note_point(s, x);
    }
    return ended(s, begin, status);
}

static morph_ip_bool eval_grad_f(int n, double *x, morph_ip_bool new_x, double *gradient, void *user) {
    (void)new_x;
    session *s = user;
    if (given_up(s)) return false;
    const double begin = morph_seconds();
    const morph_status status = morph_nlp_gradient_at(s->nlp, x);
    if (status == MORPH_OK) memcpy(gradient, s->nlp->gradient, (size_t)n * sizeof *gradient);
    return ended(s, begin, status);
}

static morph_ip_bool eval_g(int n, double *x, morph_ip_bool new_x, int m, double *rows, void *user) {
    (void)n;
    (void)new_x;
    session *s = user;
    if (given_up(s)) return false;
    const double begin = morph_seconds();
    const morph_status status = morph_nlp_rows_at(s->nlp, x);
    if (status == MORPH_OK) {
        if (m > 0) memcpy(rows, s->nlp->row_value, (size_t)m * sizeof *rows);
        note_point(s, x);
    }
    return ended(s, begin, status);
}

/* Ipopt refuses rows without a single entry, so a problem whose rows depend on nothing gets a zero at (0, 0).
 */
static int jacobian_entries(const morph_nlp *nlp) {
    return nlp->rows > 0 && nlp->jacobian.count == 0 ? 1 : nlp->jacobian.count;
}

/* The arrays may be NULL when there is nothing to copy. */
static void copy_pattern(const morph_pattern *p, int *row, int *column) {
    for (int k = 0; k < p->count; k++) {
        row[k] = p->row[k];
        column[k] = p->column[k];
    }
}

static morph_ip_bool eval_jac_g(int n, double *x, morph_ip_bool new_x, int m, int count, int *row,
                                int *column, double *values, void *user) {
    (void)n;
    (void)new_x;
    (void)m;
    session *s = user;
    const morph_pattern *p = &s->nlp->jacobian;
    if (!values) {
        if (count != jacobian_entries(s->nlp)) return false;
        if (count > p->count) row[0] = column[0] = 0;
        copy_pattern(p, row, column);
        return true;
    }
    if (given_up(s)) return false;
    const double begin = morph_seconds();
    const morph_status status = morph_nlp_jacobian_at(s->nlp, x);
    if (status == MORPH_OK) {
        if (count > p->count) values[0] = 0;
        for (int k = 0; k < p->count; k++)
            values[k] = s->nlp->jacobian_value[k];
    }
    return ended(s, begin, status);
}

static morph_ip_bool eval_h(int n, double *x, morph_ip_bool new_x, double factor, int m, double *multiplier,
                            morph_ip_bool new_multiplier, int count, int *row, int *column, double *values,
                            void *user) {
    (void)n;
    (void)new_x;
    (void)m;
    (void)new_multiplier;
    session *s = user;
    const morph_pattern *p = &s->nlp->hessian;
    if (!values) {
        if (count != p->count) return false;
        copy_pattern(p, row, column);
        return true;
    }
    if (given_up(s)) return false;
    const double begin = morph_seconds();
    return ended(s, begin, morph_nlp_hessian_at(s->nlp, x, factor, multiplier, values));
}

/* Once per iteration: stop, wall limit (3.11 has only a processor-time limit), progress. */
static morph_ip_bool iteration(int mode, int count, double objective, double primal, double dual, double mu,
                               double step, double regularisation, double alpha_dual, double alpha_primal,
                               int trials, void *user) {
    (void)step;
    (void)regularisation;
    (void)alpha_dual;
    (void)trials;
    session *s = user;
    const morph_nlp_options *o = s->options;
    if (count > s->run->iterations) s->run->iterations = count;
    if (morph_stopped(o->control)) s->run->stopped = true;
    if (o->max_seconds > 0 && morph_seconds() - s->start >= o->max_seconds) s->run->limit = true;
    morph_progress(o->control, "solve", fmin(1.0, (double)count / fmax(1.0, o->max_iterations)));
    /* A line every ten iterations shows whether it is getting somewhere without filling a log. */
    if (count % 10 == 0)
        morph_log(o->control, "iteration %d%s: objective %.6g, violation %.2e, dual %.2e, mu %.1e, step %.1e",
                  count, mode ? " (restoration)" : "", objective, primal, dual, mu, alpha_primal);
    return !given_up(s) && !s->run->limit;
}

/* ------------------------------------------------------------------ options */

/* Every setter tells whether it was understood; one refusal is our own mistake and ends the run. The C
 * interface takes char *, but only reads. */
static bool set_text(IpoptProblem p, const char *key, const char *value) {
    return AddIpoptStrOption(p, (char *)(size_t)key, (char *)(size_t)value);
}

static bool set_number(IpoptProblem p, const char *key, double value) {
    return AddIpoptNumOption(p, (char *)(size_t)key, value);
}

static bool set_int(IpoptProblem p, const char *key, int value) {
    return AddIpoptIntOption(p, (char *)(size_t)key, value);
}

/* What never changes. Only options that both 3.11 and 3.14 know. */
static bool set_fixed_options(IpoptProblem p) {
    /* Work space beside the estimate, percent: more is asked for where it does not suffice. The library's
     * 1000 are mapped and cleared in every factorisation, a twentieth of all time at 4 x 4 nodes. */
    const int spare = 100;
    /* A file below /dev/null cannot exist; an empty name still reads ipopt.opt in 3.11. */
    return set_text(p, "option_file_name", "/dev/null/none") && set_text(p, "sb", "yes") &&
           /* 3 is the summary with the timing table: it goes to our own stream, see open_console. */
           set_int(p, "print_level", 3) && set_text(p, "print_timing_statistics", "yes") &&
           set_text(p, "hessian_approximation", "exact") &&
           /* Blocks scale themselves; gradient-based scaling would hide violations. */
           set_text(p, "nlp_scaling_method", "none") && set_text(p, "check_derivatives_for_naninf", "yes") &&
           /* Bounds are bounds: not widened by 1e-8. */
           set_number(p, "bound_relax_factor", 0.0) &&
           set_text(p, "fixed_variable_treatment", "make_parameter") &&
           set_text(p, "linear_solver", "mumps") && set_int(p, "mumps_mem_percent", spare);
}

/* One ordering, always: the automatic choice may depend on more than the matrix. */
static bool set_ordering(IpoptProblem p, const morph_nlp_options *o) {
    return set_int(p, "mumps_pivot_order",
                   o->dissect && o->isolated ? MORPH_PIVOT_DISSECT : MORPH_PIVOT_ORDER);
}

static bool set_options(IpoptProblem p, const morph_nlp_options *o) {
    bool ok = set_fixed_options(p) && set_ordering(p, o) && set_number(p, "tol", o->tolerance) &&
              set_number(p, "constr_viol_tol", o->violation_tolerance) &&
              /* Ten times looser counts as acceptable, but never in violation (default 0.01). */
              set_number(p, "acceptable_tol", 10 * o->tolerance) &&
              set_number(p, "acceptable_constr_viol_tol", o->violation_tolerance) &&
              set_int(p, "max_iter", o->max_iterations) &&
              set_text(p, "mu_strategy", o->adaptive_mu ? "adaptive" : "monotone");
    if (o->mu_init > 0) ok = ok && set_number(p, "mu_init", o->mu_init);
    /* The damping of one-sided bounds would leave kappa_d mu_target (1e-5) in the gradient. */
    if (o->mu_target > 0)
        ok = ok && set_number(p, "mu_target", o->mu_target) && set_number(p, "kappa_d", 0.0);
    if (!o->warm) return ok;
    /* Without the five pushes Ipopt moves a converged point 1e-3 inwards and loses most of its worth. */
    static const char *const push[] = {"warm_start_bound_push", "warm_start_bound_frac",
                                       "warm_start_slack_bound_push", "warm_start_slack_bound_frac",
                                       "warm_start_mult_bound_push"};
    ok = ok && set_text(p, "warm_start_init_point", "yes");
    for (size_t k = 0; k < sizeof push / sizeof *push; k++)
        ok = ok && set_number(p, push[k], 1e-9);
    /* The barrier continues where a converged solve ended: complementarity is of the order of the tolerance.
     */
    if (o->mu_init <= 0) ok = ok && set_number(p, "mu_init", fmax(1e-11, 0.1 * o->tolerance));
    return ok;
}

/* ------------------------------------------------------------------ return codes */

morph_code_kind morph_ipopt_code(int code, const char **text) {
    switch (code) {
    case 0:
        return *text = "solved", MORPH_CODE_SOLVED;
    case 1:
        return *text = "solved to acceptable level", MORPH_CODE_CONCLUDED;
    case 2:
        return *text = "infeasible problem detected", MORPH_CODE_CONCLUDED;
    case 3:
        return *text = "search direction becomes too small", MORPH_CODE_CONCLUDED;
    case 4:
        return *text = "diverging iterates", MORPH_CODE_CONCLUDED;
    case 5:
        return *text = "stopped by the caller", MORPH_CODE_LIMIT;
    case 6:
        return *text = "feasible point found", MORPH_CODE_CONCLUDED;
    case -1:
        return *text = "iteration limit", MORPH_CODE_LIMIT;
    case -2:
        return *text = "restoration failed", MORPH_CODE_CONCLUDED;
    case -3:
        return *text = "error in step computation", MORPH_CODE_CONCLUDED;
    case -4:
        return *text = "processor time limit", MORPH_CODE_LIMIT;
    case -5:
        return *text = "wall limit", MORPH_CODE_LIMIT;
    case -10:
        return *text = "more equalities than free unknowns", MORPH_CODE_CONCLUDED;
    case -11:
        return *text = "invalid problem definition", MORPH_CODE_FAILED;
    case -12:
        return *text = "invalid option", MORPH_CODE_FAILED;
    case -13:
        return *text = "a number is not finite", MORPH_CODE_NUMBER;
    case -100:
        return *text = "exception in Ipopt", MORPH_CODE_FAILED;
    case -101:
        return *text = "foreign exception in Ipopt", MORPH_CODE_FAILED;
    case -102:
        return *text = "out of memory in Ipopt", MORPH_CODE_NOMEM;
    case -199:
        return *text = "internal error in Ipopt", MORPH_CODE_FAILED;
    default:
        return *text = "unknown return code", MORPH_CODE_FAILED;
    }
}

/* ------------------------------------------------------------------ console and timing */

/* Ipopt's console. 3.11 prints the name of the option file before it has read print_level, and complains
 * about refused options, on the stdout of the moment when the problem is created. So a stream of our own
 * stands in for stdout just then; the problem keeps it, and nothing reaches the real one. (glibc documents
 * stdout as a variable that may be set.) The same when the problem is freed: Ipopt closes its console unless
 * that is stdout. */
typedef struct console {
    FILE *stream;
    char *text;
    size_t size;
} console;

static IpoptProblem create_problem(console *c, session *s, double *bounds) {
    const morph_nlp *nlp = s->nlp;
    const int n = nlp->unknowns, m = nlp->rows;
    double *lower = bounds, *upper = lower + n, *row_lower = upper + n, *row_upper = row_lower + m;
    for (int i = 0; i < n; i++) {
        lower[i] = fmax(nlp->lower[i], -no_bound);
        upper[i] = fmin(nlp->upper[i], no_bound);
    }
    for (int r = 0; r < m; r++) {
        row_lower[r] = fmax(nlp->row_lower[r], -no_bound);
        row_upper[r] = fmin(nlp->row_upper[r], no_bound);
    }
    FILE *real = stdout;
    stdout = c->stream;
    IpoptProblem p =
        CreateIpoptProblem(n, lower, upper, m, row_lower, row_upper, jacobian_entries(nlp),
                           nlp->hessian.count, 0, eval_f, eval_g, eval_grad_f, eval_jac_g, eval_h);
    stdout = real;
    return p;
}

/* Wall seconds of "StdAugSystemSolverMultiSolve...:  cpu (sys: s wall: w)" in the timing table:
 * factorisations and back solves (the factorisation's own line reads 0.000 with MUMPS). Negative if there is
 * none. */
static double linear_seconds(const char *text) {
    const char *line = text ? strstr(text, "StdAugSystemSolverMultiSolve") : NULL;
    if (!line) return -1;
    const char *end = strchr(line, '\n'), *wall = strstr(line, "wall:");
    if (!wall || (end && wall > end)) return -1;
    return strtod(wall + 5, NULL);
}

/* ------------------------------------------------------------------ the run */

static void solve(session *s, console *c, double *bounds) {
    morph_run *run = s->run;
    IpoptProblem p = create_problem(c, s, bounds);
    if (!p) {
        run->status = MORPH_ERR_INTERNAL;
        return;
    }
    if (set_options(p, s->options) && SetIntermediateCallback(p, iteration)) {
        run->code = (int)IpoptSolve(
            p, morph_run_array(run, run->x), NULL, NULL, morph_run_array(run, run->row_multiplier),
            morph_run_array(run, run->lower_multiplier), morph_run_array(run, run->upper_multiplier), s);
        run->status = s->fatal;
    } else {
        morph_log(s->options->control, "Ipopt refused an option");
        run->status = MORPH_ERR_INTERNAL;
    }
    FILE *real = stdout;
    stdout = c->stream;
    FreeIpoptProblem(p);
    stdout = real;
}

/* The start, moved into its bounds, is the first candidate: something is then known even if Ipopt evaluates
 * nothing, as with more equalities than unknowns. */
static void note_start(session *s) {
    double *x = morph_run_array(s->run, s->run->x);
    for (int i = 0; i < s->nlp->unknowns; i++)
        x[i] = fmin(fmax(x[i], s->nlp->lower[i]), s->nlp->upper[i]);
    const morph_status status = morph_nlp_rows_at(s->nlp, x);
    if (status == MORPH_OK)
        note_point(s, x);
    else if (status != MORPH_ERR_NONFINITE)
        s->fatal = status;
}

void morph_run_ipopt(morph_nlp *nlp, const morph_nlp_options *options, morph_run *run) {
    session s = {.nlp = nlp, .options = options, .run = run, .start = morph_seconds()};
    console c = {0};
    const size_t bounds_count = 2 * ((size_t)nlp->unknowns + (size_t)nlp->rows);
    double *bounds = morph_alloc(bounds_count, sizeof *bounds);
    c.stream = open_memstream(&c.text, &c.size);
    s.first_points = nlp->points;
    run->status = MORPH_ERR_NOMEM;
    if (bounds && c.stream) {
        note_start(&s);
        if (s.fatal == MORPH_OK)
            solve(&s, &c, bounds);
        else
            run->status = s.fatal;
    }
    if (c.stream) fclose(c.stream);
    run->evaluations = nlp->points - s.first_points;
    run->callback_seconds = s.callback_seconds;
    const double linear = linear_seconds(c.text);
    run->linear_seconds = linear >= 0 ? linear : fmax(0.0, morph_seconds() - s.start - s.callback_seconds);
    free(c.text);
    free(bounds);
    run->finished = true;
}
