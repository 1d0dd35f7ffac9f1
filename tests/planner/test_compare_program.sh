#!/bin/sh
# Methods side by side, through the program: rows, files, exit codes; a method that fails, one that is not feasible, an
# interrupted run; the same bytes again.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: each of its methods has a test of its own there"
    exit 77
fi
mkdir "$work/here" && cd "$work/here" || exit 1
touch "$work/out" "$work/err"

cat >small.yaml <<'SCENE'
morphplan: 1
title: small
structure: {nodes: [3, 2], spacing: 0.1, link: {stiffness: 20}}
target: {shape: box, size: [0.1, 0.05, 0.06]}
motion: {friction: 0.4, time: 0.5}
schedule: {sample: 0.01}
attractors: none
SCENE
sed 's/title: small/title: other/' small.yaml >other.yaml
sed '/attractors/d' small.yaml >placed.yaml
sed 's/0.06\]}/0.06], deformable: {young: 2.0e4, density: 300}}/' small.yaml >soft.yaml
sed 's/sample: 0.01/sample: 0.01, duration: 0.05/' small.yaml >hasty.yaml

# rows FILE METHOD: how many rows of this method the JSON has; outcomes FILE OUTCOME likewise.
rows() { grep -c "^	\"method\":	\"$2\"" "$1"; }
outcomes() { grep -c "^	\"outcome\":	\"$2\"" "$1"; }
timeless() {
    sed '/"seconds"/,/}/d; /"peak_memory_bytes"/d; /_seconds"/d' "$1/compare.json"
    sed 's/<td class="n">[0-9.]*&nbsp;s</</' "$1/compare.html"
}

# A small scene twice: the same bytes; one method that fails and one that is not feasible keep their rows.
expect 3 "$program" compare small.yaml soft.yaml hasty.yaml --quiet
if [ -s "$work/err" ]; then fault "--quiet is not quiet"; fi
holds "two files" [ "$(ls -A compare | tr '\n' ' ')" = "compare.html compare.json " ]
for method in blanket plan reference; do
    holds "$method has a row in each scene" [ "$(rows compare/compare.json $method)" -eq 3 ]
    holds "$method has a row in each table" [ "$(grep -c "^$method " "$work/out")" -eq 4 ]
done
holds "what failed says why" [ "$(grep -c 'failed: not available yet: target.deformable' "$work/out")" -eq 2 ]
holds "two rows failed" [ "$(outcomes compare/compare.json failed)" -eq 2 ]
holds "a plan that is not feasible says why" grep -q '^plan .* infeasible: schedule.duration: ' "$work/out"
if LC_ALL=C grep -q '[^ -~]' "$work/out"; then fault "more than ASCII in the table"; fi
if grep -Eqi ':[[:space:]]*-?(nan|inf)' compare/compare.json; then fault "a number that JSON does not know"; fi
if grep -q '<script\|http:\|https:' compare/compare.html; then fault "a page that needs scripts or a network"; fi
no_leftovers .

# Neither this nor anything else is written over unasked.
fingerprint compare >"$work/before"
expect 2 "$program" compare small.yaml
one_line
says 'compare: is there already'
unchanged compare "$work/before"
expect 0 "$program" compare small.yaml other.yaml -o again
# The second scene is the first but for its title: that, file and checksum apart, the rows are the same.
expect 0 "$program" compare small.yaml other.yaml --overwrite
timeless again >"$work/a"
timeless compare >"$work/b"
holds "the same bytes but for times: $(diff "$work/a" "$work/b" | head -n 4)" cmp "$work/a" "$work/b"
if grep -q failed compare/compare.json; then fault "the old comparison is still there"; fi

# The plan's end is one of the reference's starts: never better than it.
grep '^plan ' "$work/out" | head -n 2 | while read -r line; do
    echo "$line" | awk '{ exit !($7 >= 1.0) }' || echo "$line"
done >"$work/below"
if [ -s "$work/below" ]; then fault "a plan below its reference: $(cat "$work/below")"; fi

# Bad input: every fault of every scene, and nothing is written.
sed 's/nodes/node/' small.yaml >bad.yaml
expect 2 "$program" compare small.yaml bad.yaml missing.yaml -o never
says '^bad.yaml:3: structure.node: '
says '^missing.yaml:1: '
if [ -s "$work/out" ]; then fault "something on stdout"; fi
absent . never
expect 2 "$program" compare
one_line
expect 2 "$program" compare small.yaml --method ipopt
one_line
says 'is no option of compare'
expect 2 "$program" compare small.yaml -o nowhere/deep
one_line

# start: compares in the background ($pid) and returns when the second scene's plan has begun.
start() {
    "$program" compare small.yaml "$scene" -o "$1" ${2:-} >"$work/out" 2>"$work/err" &
    pid=$!
    for wait in $(seq 1200); do
        if grep -q ' s  2/2 plan' "$work/err"; then return; fi
        if ! kill -0 "$pid" 2>/dev/null; then break; fi
        sleep 0.05
    done
    fault "the second plan was never told"
}
# stops FOLDER: interrupts, and looks for the rows so far.
stops() {
    sleep 0.3
    kill -INT "$pid"
    code=0
    wait "$pid" || code=$?
    if [ "$code" -ne 4 ]; then fault "exit $code instead of 4"; fi
    holds "six rows in $1" [ "$(grep -c '^	"method"' "$1/compare.json")" -eq 6 ]
    holds "the plan and the reference are marked" [ "$(outcomes "$1/compare.json" stopped)" -eq 2 ]
    holds "the table says so" grep -q '^reference .* stopped: ' "$work/out"
    holds "the page says so" grep -q 'Stopped before it was done' "$1/compare.html"
    says "the rows so far are in $1"
    no_leftovers .
}
start stopped
stops stopped
# What is there stays, and the stopped comparison goes beside it.
fingerprint again >"$work/before"
start again --overwrite
stops again.stopped
unchanged again "$work/before"

if [ -n "$slow" ]; then exit 0; fi

# Centres of attraction: three rows more, none of them where the scene wants no centres.
expect 0 "$program" compare placed.yaml -o placed --quiet
for method in blanket seeds nlopt guided plan reference; do
    holds "$method has a row" [ "$(rows placed/compare.json $method)" -eq 1 ]
done
holds "no row without centres" [ "$(rows compare/compare.json guided)" -eq 0 ]

# A ball in full, and its table in order.
{ cat "$source/examples/scenes/sphere_4.yaml" && echo 'attractors: none'; } >sphere_4.yaml
expect 0 "$program" compare sphere_4.yaml -o sphere
holds "the plan holds" [ "$(grep -c '^plan .* \(optimal\|feasible\)' "$work/out")" -eq 1 ]
holds "the reference holds" [ "$(grep -c '^reference .* \(optimal\|feasible\)' "$work/out")" -eq 1 ]
# Column by column: the plan lies better than the blanket, the reference at least as well as the plan.
awk '$1 == "blanket" && NF > 8 { b = $2; g = $4 } $1 == "plan" && NF > 8 { p = $2; if (!(p < b && $4 < g && $7 >= 1)) exit 1 }
     $1 == "reference" && NF > 8 { n++; if (!($2 <= p)) exit 1 } END { if (n != 1) exit 1 }' "$work/out" ||
    fault "blanket, plan and reference are not in order"
