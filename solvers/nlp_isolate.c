/* The solver in a child process. Out of memory inside Ipopt or MUMPS can end a process in any way: a signal,
 * an uncaught exception, a Fortran exit, once even exit code 0. The child's record lies in shared memory; if
 * it is not complete when the child has ended, the run failed, however the child ended. */
#include "solvers/nlp_internal.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* How long a child may go on after a stop or the wall limit before it is ended. Its best point lies in shared
 * memory, so only the multipliers are lost. */
static const double grace_seconds = 1.0;

/* One progress report or log line. Smaller than PIPE_BUF, so written whole or not at all. */
typedef struct message {
    bool is_log;
    double fraction;
    char text[240];
} message;

typedef struct child_link {
    morph_run *run;
    int pipe;
} child_link;

static void send(const child_link *link, const message *m) {
    ssize_t sent;
    do
        sent = write(link->pipe, m, sizeof *m);
    while (sent < 0 && errno == EINTR);
}

static int child_stop(void *user) {
    return ((child_link *)user)->run->stop_request;
}

static void child_progress(void *user, const char *stage, double fraction) {
    message m = {.fraction = fraction};
    snprintf(m.text, sizeof m.text, "%s", stage);
    send(user, &m);
}

static void child_log(void *user, const char *line) {
    message m = {.is_log = true};
    snprintf(m.text, sizeof m.text, "%s", line);
    send(user, &m);
}

static _Noreturn void child(morph_nlp *nlp, const morph_nlp_options *options, morph_run *run, int pipe,
                            pid_t parent) {
    /* Never outlives the parent, not even one that died before it could be said; an interrupt from the
     * terminal is the parent's to decide. */
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    signal(SIGINT, SIG_IGN);
    /* The Fortran runtime prints where it likes. */
    const int null = open("/dev/null", O_WRONLY);
    if (null >= 0) {
        dup2(null, STDOUT_FILENO);
        dup2(null, STDERR_FILENO);
    }
    /* Several threads of the nested dissection race for their parts, and the ordering is another each time.
     */
    setenv("SCOTCH_PTHREAD_NUMBER", "1", 1);
    child_link link = {run, pipe};
    const morph_control control = {child_stop, child_progress, child_log, &link};
    morph_nlp_options o = *options;
    o.control = options->control ? &control : NULL;
    morph_run_ipopt(nlp, &o, run);
    _exit(0);
}

/* Hands on what has arrived. False at the end of the stream. */
static bool drain(int pipe, const morph_control *control) {
    for (;;) {
        message m;
        const ssize_t got = read(pipe, &m, sizeof m);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return true;
        if (got != (ssize_t)sizeof m) return false;
        m.text[sizeof m.text - 1] = '\0';
        if (m.is_log)
            morph_log(control, "%s", m.text);
        else
            morph_progress(control, m.text, m.fraction);
    }
}

/* Waits for the child, passing messages on and stop and the wall limit in. Tells whether it had to be ended.
 */
static bool attend(pid_t pid, int pipe, const morph_nlp_options *o, morph_run *run) {
    const double start = morph_seconds();
    double deadline = o->max_seconds > 0 ? start + o->max_seconds + grace_seconds : INFINITY;
    bool killed = false, open = true;
    for (;;) {
        /* 20 ms: the most by which a stop is late. The end of the stream wakes at once. */
        struct pollfd wait = {.fd = pipe, .events = POLLIN};
        poll(&wait, open ? 1 : 0, 20);
        if (open) open = drain(pipe, o->control);
        const pid_t ended = waitpid(pid, NULL, open ? WNOHANG : 0);
        if (ended == pid || (ended < 0 && errno == ECHILD)) break;
        if (!run->stop_request && morph_stopped(o->control)) {
            run->stop_request = 1;
            deadline = fmin(deadline, morph_seconds() + grace_seconds);
        }
        if (!killed && morph_seconds() > deadline) {
            kill(pid, SIGKILL);
            killed = true;
        }
    }
    if (open) drain(pipe, o->control);
    return killed;
}

void morph_run_isolated(morph_nlp *nlp, const morph_nlp_options *options, morph_run *shared) {
    int ends[2];
    shared->status = MORPH_ERR_NOMEM;
    if (morph_blas_claim() != MORPH_OK || pipe(ends) != 0) return;
    if (fcntl(ends[0], F_SETFL, O_NONBLOCK) != 0) goto closed;
    const pid_t parent = getpid(), pid = fork();
    if (pid < 0) goto closed;
    if (pid == 0) {
        close(ends[0]);
        child(nlp, options, shared, ends[1], parent);
    }
    close(ends[1]);
    const bool killed = attend(pid, ends[0], options, shared);
    close(ends[0]);
    if (shared->finished) return;
    if (killed) {
        shared->status = MORPH_OK;
        shared->code = 5; /* as if the iteration callback had ended it */
        shared->stopped = shared->stop_request != 0;
        shared->limit = !shared->stopped;
        return;
    }
    morph_log(options->control, "the solver's process ended without a result");
    shared->status = MORPH_ERR_BACKEND;
    return;
closed:
    close(ends[0]);
    close(ends[1]);
}
