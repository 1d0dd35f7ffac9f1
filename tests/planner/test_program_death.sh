#!/bin/sh
# A solver that dies in mid-solve, or is refused memory: an outcome and not the end of the program; what is feasible is
# kept, and the folder is whole or not there.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: they map more memory than any limit, and take minutes"
    exit 77
fi
mkdir "$work/here" && cd "$work/here" || exit 1
touch "$work/out"
# OpenBLAS waits for ever, when a process forks, for threads that it had no memory to start.
export OPENBLAS_NUM_THREADS=1

# start: plans in the background ($pid).
start() {
    rm -rf box.plan
    "$program" plan "$scene" -o box.plan >"$work/out" 2>"$work/err" &
    pid=$!
}

# kill_solvers STAGE MOST: while the program runs, ends its solvers' processes, from the beginning of STAGE, MOST of them.
# $killed counts.
kill_solvers() {
    killed=0
    # A process that has ended and is not yet waited for has no program any more.
    while readlink "/proc/$pid/exe" >/dev/null 2>&1 && [ "$killed" -lt "$2" ]; do
        if ! grep -q " s  $1\$" "$work/err"; then
            sleep 0.01
            continue
        fi
        for child in $(cat "/proc/$pid/task/$pid/children" 2>/dev/null); do
            if kill -KILL "$child" 2>/dev/null; then killed=$((killed + 1)); fi
        done
    done
    code=0
    wait "$pid" || code=$?
}

# sound: exit code, outcome and check agree, and all six files are there.
sound() {
    holds "exit 0 or 3, not $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
    holds "six files" [ "$(ls -A box.plan | wc -l)" -eq 6 ]
    ended=$code
    case $(outcome box.plan) in
    optimal | feasible) holds "a feasible plan and exit 0, not $code" [ "$ended" -eq 0 ] ;;
    infeasible) holds "an infeasible plan and exit 3, not $code" [ "$ended" -eq 3 ] ;;
    *) fault "outcome $(outcome box.plan)" ;;
    esac
    run "$program" check box.plan --quiet
    holds "check agrees: $code as $ended" [ "$code" -eq "$ended" ]
    no_leftovers .
}

# One in each stage: the plan is feasible all the same.
for stage in refine path; do
    start
    kill_solvers $stage 1
    holds "a solver was killed in $stage" [ "$killed" -eq 1 ]
    says "$stage: a solver ended without a result"
    holds "feasible without it, not exit $code" [ "$code" -eq 0 ]
    sound
done

# Every one that appears: what holds without any is kept.
start
kill_solvers refine 100000
holds "solvers were killed" [ "$killed" -ge 3 ]
says 'a solver ended without a result'
sound

# Memory: from more than enough down to what the program itself cannot live with. Nothing else than these ends is allowed.
ends=""
for megabytes in 2000 320 290 260 220; do
    rm -rf box.plan
    code=0
    (ulimit -v $((megabytes * 1024)) && exec "$program" plan "$scene" -o box.plan --quiet) >"$work/out" 2>"$work/err" || code=$?
    ends="$ends $megabytes:$code"
    case $code in
    0 | 3) sound ;;
    1) absent . box.plan ;;
    127) absent . box.plan ;; # not even its libraries fit
    *) fault "exit $code within $megabytes MB" ;;
    esac
done
echo "MB and exit codes:$ends"
case $ends in
" 2000:0"*) ;;
*) fault "no plan with 2000 MB" ;;
esac
