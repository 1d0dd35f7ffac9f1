/* The program: arguments in, one public call, text out. */
#include "planner/morphplan.h"

#include <getopt.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const char usage_text[] =
    "usage: morphplan COMMAND ...\n"
    "\n"
    "  plan SCENE [-o DIR]                plan a morph and write the plan folder (default: SCENE without "
    "ending + .plan)\n"
    "  check DIR [--schedule FILE]        verify a plan folder and its files, or a schedule file against its "
    "plan\n"
    "  picture DIR -o FILE.svg|png        still pictures: four moments, lengths over time\n"
    "          [--of MOTION]              of the schedule (default), the blanket, the replay of its "
    "lengths,\n"
    "                                     core: the replay with the target as a solid core; or cavity: "
    "the\n"
    "                                     cavities under the blanket and under the plan\n"
    "  export DIR --format csv [-o FILE]  lengths, rates and accelerations over time (default: on stdout)\n"
    "          [--sample S] [--overwrite] the same curve every S seconds (default: as planned); replace "
    "FILE\n"
    "  compare SCENE... [-o DIR]          blanket, plan and reference side by side: a table, and DIR "
    "(default: compare)\n"
    "                                     with compare.json and compare.html\n"
    "  info SCENE                         structure with link numbers, mobility, target; solves nothing\n"
    "\n"
    "options of plan:\n"
    "  --method ipopt|nlopt|blanket       refined plan (default); the blanket under the centres that NLopt\n"
    "                                     places, as it fell; the pure blanket, as it fell\n"
    "  --budget SECONDS                   the best feasible plan that this time allows\n"
    "  --overwrite                        exchange an existing plan folder (interrupted: that stays, the "
    "best "
    "so far\n"
    "                                     goes into DIR.stopped)\n"
    "  --json                             print the summary as JSON instead of six lines\n"
    "\n"
    "options of all:\n"
    "  --quiet                            no progress\n"
    "  --verbose                          what the solvers do, on stderr\n"
    "  --help, --version\n"
    "\n"
    "exit codes: 0 done, every check holds; 1 internal error or machine refused; 2 wrong usage or input;\n"
    "3 no feasible plan, findings, or a method of compare failed; 4 interrupted, best so far kept\n";

/* The linear solver asks for its work space anew in every factorisation: given back to the system each time,
 * it would be mapped and cleared each time, a tenth of all time at 4 x 4 nodes. */
static void keep_memory(void) {
#if defined(__GLIBC__)
    mallopt(M_MMAP_THRESHOLD, 32 << 20); /* the most that every version takes */
    mallopt(M_TRIM_THRESHOLD, 256 << 20);
    mallopt(M_TOP_PAD, 16 << 20);
#endif
}

static volatile sig_atomic_t interrupted;

/* The first signal asks for the best so far; the second ends the program at once (nothing half-written is
 * under a plan's name). */
static void on_signal(int number) {
    interrupted = 1;
    signal(number, SIG_DFL);
}

typedef struct screen {
    bool terminal, quiet, verbose;
    double started;
    char stage[32];
    int percent;
    bool bar;  /* a bar stands on the line */
    bool told; /* that it is stopping */
} screen;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void clear_bar(screen *s) {
    if (s->bar) fprintf(stderr, "\r\033[K");
    s->bar = false;
}

static void on_message(void *user, const char *line) {
    clear_bar(user);
    fprintf(stderr, "%s\n", line);
}

/* What a second signal would do is said once, when the first is heard. */
static int ask_stop(void *user) {
    screen *s = user;
    if (!interrupted) return 0;
    if (!s->told && !s->quiet) on_message(s, "stopping with the best so far; a second time ends at once");
    s->told = true;
    return 1;
}

static void on_log(void *user, const char *line) {
    screen *s = user;
    if (!s->verbose) return;
    clear_bar(s);
    fprintf(stderr, "  %s\n", line);
}

/* A bar with stage, elapsed and remaining time on a terminal; a plain line per stage when piped. */
static void on_progress(void *user, const char *stage, double fraction) {
    screen *s = user;
    if (s->quiet) return;
    const int percent = (int)(100.0 * fraction);
    const bool fresh = strcmp(stage, s->stage) != 0;
    if (!fresh && percent == s->percent) return;
    const double elapsed = now() - s->started;
    static double stage_started;
    if (fresh) stage_started = elapsed;
    snprintf(s->stage, sizeof s->stage, "%s", stage);
    s->percent = percent;
    if (!s->terminal) {
        if (fresh) fprintf(stderr, "%7.1f s  %s\n", elapsed, stage);
        return;
    }
    char bar[31];
    for (int i = 0; i < 30; i++)
        bar[i] = i * 100 < percent * 30 ? '#' : '.';
    bar[30] = '\0';
    fprintf(stderr, "\r\033[K%-8s [%s] %5.1f s", stage, bar, elapsed);
    if (fraction > 0.05)
        fprintf(stderr, ", about %.0f s left in this stage",
                (elapsed - stage_started) * (1.0 - fraction) / fraction);
    fflush(stderr);
    s->bar = true;
}

static int usage_fault(const char *what, const char *value, const char *allowed) {
    fprintf(stderr, "morphplan: %s%s%s; allowed: %s\n", what, value[0] ? ": " : "", value, allowed);
    return MORPH_EXIT_INPUT;
}

static int not_yet(const char *what) {
    fprintf(stderr, "morphplan: not available yet: %s\n", what);
    return MORPH_EXIT_INPUT;
}

/* The number above 0 that a text is, else 0. */
static double positive_number(const char *text) {
    char *end;
    const double v = strtod(text, &end);
    return end != text && *end == '\0' && v > 0.0 && v < 1e300 ? v : 0.0;
}

/* Results are worth nothing if they did not arrive: a full disk behind a redirected stdout is an error. */
static int print_result(const char *text, int code) {
    if (!text) return code;
    if (fputs(text, stdout) == EOF || fflush(stdout) == EOF) {
        fprintf(stderr, "morphplan: standard output: cannot write\n");
        return MORPH_EXIT_INTERNAL;
    }
    return code;
}

enum {
    O_METHOD = 256,
    O_LEVEL,
    O_BUDGET,
    O_OVERWRITE,
    O_JSON,
    O_QUIET,
    O_VERBOSE,
    O_THREADS,
    O_SCHEDULE,
    O_OF,
    O_FORMAT,
    O_SAMPLE,
    O_AXES,
    O_HELP,
    O_VERSION
};

typedef struct arguments {
    const char *output, *method, *schedule, *motion, *format, *subject;
    const char *const *subjects; /* of compare; subject is the first */
    int subject_count;
    double budget, sample; /* s; 0: not given */
    bool overwrite, json, quiet, verbose;
} arguments;

/* Validates an option's value and refuses what belongs to a later version by name. 0: go on. */
static int take_option(int option, const char *value, arguments *a) {
    switch (option) {
    case 'o':
        a->output = value;
        return value[0] ? 0 : usage_fault("-o", "empty", "a path");
    case O_METHOD:
        a->method = value;
        if (strcmp(value, "ipopt") != 0 && strcmp(value, "nlopt") != 0 && strcmp(value, "blanket") != 0)
            return usage_fault("--method", value, "ipopt, nlopt, blanket");
        return 0;
    case O_LEVEL:
        if (strcmp(value, "standard") == 0) return 0;
        if (strcmp(value, "draft") == 0 || strcmp(value, "fine") == 0)
            return not_yet(value[0] == 'd' ? "--level draft" : "--level fine");
        return usage_fault("--level", value, "draft, standard, fine");
    case O_BUDGET:
        a->budget = positive_number(value);
        return a->budget > 0.0 ? 0 : usage_fault("--budget", value, "seconds above 0");
    case O_SAMPLE:
        a->sample = positive_number(value);
        return a->sample > 0.0 ? 0 : usage_fault("--sample", value, "seconds above 0");
    case O_FORMAT:
        a->format = value;
        return 0; /* the library knows which there are */
    case O_AXES:
        return not_yet("--axes");
    case O_THREADS:
        if (strcmp(value, "1") == 0) return 0;
        return positive_number(value) > 0.0 ? not_yet("--threads above 1")
                                            : usage_fault("--threads", value, "1");
    case O_OVERWRITE:
        a->overwrite = true;
        return 0;
    case O_JSON:
        a->json = true;
        return 0;
    case O_QUIET:
        a->quiet = true;
        return 0;
    case O_VERBOSE:
        a->verbose = true;
        return 0;
    case O_OF:
        a->motion = value;
        if (strcmp(value, "schedule") == 0 || strcmp(value, "blanket") == 0 || strcmp(value, "replay") == 0 ||
            strcmp(value, "core") == 0 || strcmp(value, "cavity") == 0)
            return 0;
        return usage_fault("--of", value, "schedule, blanket, replay, core, cavity");
    case O_SCHEDULE:
        a->schedule = value;
        return 0;
    case O_HELP:
        fputs(usage_text, stdout);
        exit(MORPH_EXIT_DONE);
    case O_VERSION:
        printf("morphplan %s\n", morph_version());
        exit(MORPH_EXIT_DONE);
    default:
        return MORPH_EXIT_INPUT; /* said where the option was read */
    }
}

/* Who takes an option. */
enum { PLAN = 1, CHECK = 2, PICTURE = 4, INFO = 8, COMPARE = 16, EXPORT = 32, ALL = 63 };

static const struct option options[] = {{"method", required_argument, NULL, O_METHOD},
                                        {"level", required_argument, NULL, O_LEVEL},
                                        {"budget", required_argument, NULL, O_BUDGET},
                                        {"overwrite", no_argument, NULL, O_OVERWRITE},
                                        {"json", no_argument, NULL, O_JSON},
                                        {"quiet", no_argument, NULL, O_QUIET},
                                        {"verbose", no_argument, NULL, O_VERBOSE},
                                        {"threads", required_argument, NULL, O_THREADS},
                                        {"schedule", required_argument, NULL, O_SCHEDULE},
                                        {"of", required_argument, NULL, O_OF},
                                        {"format", required_argument, NULL, O_FORMAT},
                                        {"sample", required_argument, NULL, O_SAMPLE},
                                        {"axes", required_argument, NULL, O_AXES},
                                        {"help", no_argument, NULL, O_HELP},
                                        {"version", no_argument, NULL, O_VERSION},
                                        {NULL, 0, NULL, 0}};

static int takers(int option) {
    switch (option) {
    case 'o':
        return PLAN | PICTURE | COMPARE | EXPORT;
    case O_OVERWRITE:
        return PLAN | COMPARE | EXPORT;
    case O_FORMAT:
    case O_SAMPLE:
    case O_AXES:
        return EXPORT;
    case O_SCHEDULE:
        return CHECK;
    case O_OF:
        return PICTURE;
    case O_QUIET:
    case O_VERBOSE:
    case O_HELP:
    case O_VERSION:
        return ALL;
    default:
        return PLAN;
    }
}

/* An option of another command would be left out silently: refused, with those that there are. */
static int foreign_option(int option, int command, const char *name) {
    const char *is = "o";
    char allowed[200], what[64];
    size_t used = (size_t)snprintf(allowed, sizeof allowed, "%s", takers('o') & command ? "-o, " : "");
    for (const struct option *o = options; o->name; o++) {
        if (o->val == option) is = o->name;
        if (takers(o->val) & command)
            used += (size_t)snprintf(allowed + used, sizeof allowed - used, "--%s, ", o->name);
    }
    allowed[used - 2] = '\0'; /* the last comma; --help is always there */
    snprintf(what, sizeof what, "%s%s is no option of %s", option == 'o' ? "-" : "--", is, name);
    return usage_fault(what, "", allowed);
}

/* command: one of the above, 0 before there is one; name: as it is called. */
static int read_arguments(int argc, char **argv, int command, const char *name, arguments *a) {
    int option;
    opterr = 0; /* getopt's own lines would make two of one fault */
    while ((option = getopt_long(argc, argv, "o:", options, NULL)) != -1) {
        if (option == '?') {
            fprintf(stderr,
                    "morphplan: unknown option, or one without its value: %s; try: morphplan --help\n",
                    argv[optind - 1]);
            return MORPH_EXIT_INPUT;
        }
        if (command && !(takers(option) & command)) return foreign_option(option, command, name);
        const int code = take_option(option, optarg, a);
        if (code != 0) return code;
    }
    if (argc - optind != 1 && !(command == COMPARE && argc > optind))
        return usage_fault(
            argc - optind < 1 ? "nothing to work on" : "too many arguments",
            argc - optind < 1 ? "" : argv[optind + 1],
            "one scene (plan, info), scenes (compare) or one plan folder (check, picture, export)");
    a->subject = argv[optind];
    a->subjects = (const char *const *)&argv[optind];
    a->subject_count = argc - optind;
    return 0;
}

static morph_job make_job(const arguments *a, screen *s) {
    *s = (screen){
        .terminal = isatty(STDERR_FILENO) != 0, .quiet = a->quiet, .verbose = a->verbose, .started = now()};
    morph_job job = morph_job_defaults();
    job.folder = a->output;
    if (a->method) job.method = a->method;
    job.overwrite = a->overwrite;
    job.format = a->format;
    job.sample = a->sample;
    job.budget = a->budget;
    job.motion = a->motion;
    job.message = on_message;
    if (!a->quiet) job.warning = on_message;
    job.log = on_log;
    job.progress = on_progress;
    job.stop = ask_stop;
    job.user = s;
    return job;
}

/* What a command does; *text is its result for stdout, or stays NULL. */
typedef int command_call(const arguments *a, const morph_job *job, char **text);

static int call_plan(const arguments *a, const morph_job *job, char **text) {
    return morph_plan_scene(a->subject, job, a->json ? NULL : text, a->json ? text : NULL);
}

static int call_check(const arguments *a, const morph_job *job, char **text) {
    return morph_check_folder(a->subject, a->schedule, job, text);
}

static int call_picture(const arguments *a, const morph_job *job, char **text) {
    (void)text;
    if (!a->output) return usage_fault("picture", "no -o", "-o FILE.svg or -o FILE.png");
    return morph_picture_folder(a->subject, a->output, job);
}

static int call_export(const arguments *a, const morph_job *job, char **text) {
    if (!a->format) return usage_fault("export", "no --format", "--format csv");
    return morph_export_folder(a->subject, a->output, job, text);
}

static int call_info(const arguments *a, const morph_job *job, char **text) {
    return morph_info_scene(a->subject, job, text);
}

static int call_compare(const arguments *a, const morph_job *job, char **text) {
    return morph_compare_scenes(a->subjects, a->subject_count, job, text);
}

static int run(command_call *call, const arguments *a) {
    screen s;
    const morph_job job = make_job(a, &s);
    char *text = NULL;
    const int code = call(a, &job, &text);
    clear_bar(&s);
    const int printed = print_result(text, code);
    free(text);
    return printed;
}

int main(int argc, char **argv) {
    static const struct {
        const char *name;
        command_call *call;
        int takes;
    } commands[] = {
        {"plan", call_plan, PLAN}, {"check", call_check, CHECK},       {"picture", call_picture, PICTURE},
        {"info", call_info, INFO}, {"compare", call_compare, COMPARE}, {"export", call_export, EXPORT},
        {"trade", NULL, 0}};
    keep_memory();
    arguments a = {0};
    if (argc < 2) {
        fputs(usage_text, stderr);
        return MORPH_EXIT_INPUT;
    }
    if (argv[1][0] == '-') {
        const int code = read_arguments(argc, argv, 0, "", &a);
        return code ? code : usage_fault("no command", "", "plan, compare, check, picture, export, info");
    }
    for (size_t k = 0; k < sizeof commands / sizeof *commands; k++) {
        if (strcmp(argv[1], commands[k].name) != 0) continue;
        if (!commands[k].call) return not_yet(commands[k].name);
        const int code = read_arguments(argc - 1, argv + 1, commands[k].takes, commands[k].name, &a);
        if (code) return code;
        struct sigaction action = {.sa_handler = on_signal};
        sigaction(SIGINT, &action, NULL);
        sigaction(SIGTERM, &action, NULL);
        return run(commands[k].call, &a);
    }
    return usage_fault("unknown command", argv[1], "plan, compare, check, picture, export, info");
}
