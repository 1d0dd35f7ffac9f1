#!/bin/sh
# Killed (SIGKILL) at random moments, with and without a plan that may be overwritten: the folder is the old one or the
# new one, absent only where there was none, never half; and the next run leaves nothing behind.
#   sh tests/kills.sh [PROGRAM] [SOURCE_FOLDER] [KILLS]      (build/morphplan, this folder's parent, 50)
here=$(cd "$(dirname "$0")/.." && pwd)
set -- "${1:-$here/build/morphplan}" "${2:-$here}" "${3:-50}"
. "$here/tests/planner/program.sh"
kills=$3
mkdir "$work/here" && cd "$work/here" || exit 1
# Small, and as much of its time as possible goes into writing. The blanket is at the disk sooner still.
cat >"$work/small.yaml" <<END
morphplan: 1
title: new
structure: {nodes: [3, 3], spacing: 0.1}
target: {shape: box, size: [0.12, 0.12, 0.06]}
attractors: none
schedule: {sample: 0.0005}
END
sed 's/^title: new/title: old/' "$work/small.yaml" >"$work/older.yaml"
run "$program" plan "$work/older.yaml" -o old.plan --quiet
holds "an old plan, not exit $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
(cd old.plan && sha256sum ./*) >"$work/old"

# seconds METHOD: what a whole run takes.
seconds() {
    since=$(date +%s%N)
    "$program" plan "$work/small.yaml" -o timed.plan --method "$1" --quiet >/dev/null 2>&1
    rm -rf timed.plan
    echo $((($(date +%s%N) - since) / 1000000))
}
ipopt=$(seconds ipopt)
blanket=$(seconds blanket)

# whole FOLDER: all six files, those with checksums as they were written, the others to their last line, and check can
# judge it.
whole() {
    [ "$(ls -A "$1" | wc -l)" -eq 6 ] || return 1
    for file in plan.h5 schedule.csv; do
        grep -q "$(sha256sum <"$1/$file" | cut -c 1-64)" "$1/schedule.json" || return 1
    done
    tail -n 1 "$1/report.html" | grep -q '</html>' || return 1
    [ "$(tail -n 1 "$1/summary.json")" = '}' ] && [ "$(tail -n 1 "$1/schedule.json")" = '}' ] || return 1
    "$program" check "$1" --quiet >"$work/out" 2>"$work/err"
    code=$?
    [ "$code" -eq 0 ] || [ "$code" -eq 3 ]
}

news=0
olds=0
nones=0
k=0
: >"$work/out"
: >"$work/err"
while [ "$k" -lt "$kills" ]; do
    if [ $((k % 4 / 2)) -eq 0 ]; then method=blanket all=$blanket; else method=ipopt all=$ipopt; fi
    rm -rf box.plan
    if [ $((k % 2)) -eq 1 ]; then cp -r old.plan box.plan; fi
    # Golden steps between 0 and 1; half of them from the start to a little after the end, half about the writing.
    after=$(awk -v k="$k" -v all="$all" 'BEGIN { u = (k + 1) * 0.6180339887; u -= int(u);
        print (int(k / 4) % 2 ? 0.7 + 0.9 * u : 1.2 * u) * all / 1000 }')
    "$program" plan "$work/small.yaml" -o box.plan --overwrite --method "$method" --quiet >/dev/null 2>&1 &
    pid=$!
    sleep "$after"
    kill -KILL "$pid" 2>/dev/null
    wait "$pid" 2>/dev/null
    if [ ! -e box.plan ]; then
        nones=$((nones + 1))
        if [ $((k % 2)) -eq 1 ]; then fault "kill $k after $after s: the old plan is gone"; fi
    elif [ $((k % 2)) -eq 1 ] && (cd box.plan && sha256sum ./*) | cmp -s - "$work/old"; then
        olds=$((olds + 1))
    else
        news=$((news + 1))
        whole box.plan || fault "kill $k after $after s: half a plan"
        grep -q '^title: *"\{0,1\}new' box.plan/scene.yaml || fault "kill $k after $after s: neither old nor new"
    fi
    k=$((k + 1))
done
echo "$kills kills: $nones times no plan yet, $olds times the old one, $news times the new one"

# The solver's processes went with the program.
sleep 0.2
for process in /proc/[0-9]*; do
    if [ "$(readlink "$process/cwd" 2>/dev/null)" = "$work/here" ] && [ "$(readlink "$process/exe")" = "$(readlink -f "$program")" ]; then
        fault "process ${process#/proc/} goes on"
    fi
done

# What the killed left hidden is removed by the next run.
run "$program" plan "$work/small.yaml" -o box.plan --overwrite --quiet
holds "a whole run afterwards, not exit $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
no_leftovers .
