#!/bin/sh
# Interrupted: the best so far is kept and marked, a second signal ends at once, nothing is half-written.
. "$(dirname "$0")/program.sh"
mkdir "$work/here" && cd "$work/here" || exit 1
touch "$work/out"

# start STAGE: plans in the background ($pid) and returns when STAGE has begun.
start() {
    "$program" plan "$scene" -o box.plan --overwrite >"$work/out" 2>"$work/err" &
    pid=$!
    for wait in $(seq 1200); do
        if grep -q " s  $1\$" "$work/err"; then return; fi
        if ! kill -0 "$pid" 2>/dev/null; then break; fi
        sleep 0.05
    done
    fault "stage $1 was never told"
}

# ends CODE: waits for the program.
ends() {
    code=0
    wait "$pid" || code=$?
    if [ "$code" -ne "$1" ]; then fault "exit $code instead of $1"; fi
}

marked_stopped() {
    holds "a folder that is marked stopped" [ "$(outcome box.plan)" = stopped ]
    holds "the outcome line says so" grep -q '^outcome    stopped' "$work/out"
    holds "six lines" [ "$(wc -l <"$work/out")" -eq 6 ]
    no_leftovers .
    holds "six files" [ "$(ls -A box.plan | wc -l)" -eq 6 ]
    # What it holds can be read and judged: fit for use or not, but whole.
    run "$program" check box.plan
    holds "check says holds or findings, not exit $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
}

# During a solve.
start refine
sleep 0.3
kill -INT "$pid"
ends 4
marked_stopped
rm -r box.plan

# As another program would ask.
start path
kill -TERM "$pid"
ends 4
marked_stopped

# The second signal does not wait; the plan of before is as it was.
fingerprint box.plan >"$work/before"
start refine
kill -INT "$pid"
sleep 0.2
kill -INT "$pid"
ends 130
unchanged box.plan "$work/before"
no_leftovers .

# Killed without a word, and by a power cut's measure nothing is lost either; the solver's process goes too.
start refine
kill -KILL "$pid"
ends 137
unchanged box.plan "$work/before"
no_leftovers .

# At the very start there may be nothing to keep yet.
rm -r box.plan
start target
kill -INT "$pid"
ends 4
if [ -e box.plan ]; then marked_stopped; fi
no_leftovers .
