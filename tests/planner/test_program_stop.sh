#!/bin/sh
# Interrupted: the best so far is kept and marked, a second signal ends at once, nothing is half-written.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: test_plan stops there, in each stage"
    exit 77
fi
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

# marked_stopped FOLDER
marked_stopped() {
    holds "a folder that is marked stopped" [ "$(outcome "$1")" = stopped ]
    holds "the outcome line says so" grep -q '^outcome    stopped' "$work/out"
    holds "six lines" [ "$(wc -l <"$work/out")" -eq 6 ]
    no_leftovers .
    holds "six files" [ "$(ls -A "$1" | wc -l)" -eq 6 ]
    holds "its place is told" grep -qx "folder     $1" "$work/out"
    # What it holds can be read and judged: fit for use or not, but whole.
    run "$program" check "$1"
    holds "check says holds or findings, not exit $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
}

# During a solve.
start refine
sleep 0.3
kill -INT "$pid"
ends 4
marked_stopped box.plan
rm -r box.plan

# As another program would ask.
start path
kill -TERM "$pid"
ends 4
marked_stopped box.plan

# What is there already stays, and the stopped plan goes beside it, over an older stopped one; but over nothing else.
fingerprint box.plan >"$work/before"
for round in 1 2; do
    start path
    kill -INT "$pid"
    ends 4
    unchanged box.plan "$work/before"
    says 'box.plan stays as it was, the best so far is in box.plan.stopped'
    marked_stopped box.plan.stopped
done
rm -r box.plan.stopped
mkdir box.plan.stopped && echo mine >box.plan.stopped/notes.txt
fingerprint box.plan.stopped >"$work/notes"
start path
kill -INT "$pid"
ends 2
says 'box.plan.stopped: is there already and no stopped plan'
unchanged box.plan "$work/before"
unchanged box.plan.stopped "$work/notes"
no_leftovers .
rm -r box.plan.stopped

# The second signal does not wait; the plan of before is as it was.
fingerprint box.plan >"$work/before"
start refine
kill -INT "$pid"
# Soon after the first has been taken: the program could end by itself before a later one.
k=0
while [ "$k" -lt 100 ] && sleep 0.01 && kill -INT "$pid" 2>/dev/null; do k=$((k + 1)); done
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
if [ -e box.plan ]; then marked_stopped box.plan; fi
no_leftovers .
