#!/bin/sh
# Goals: met, and not met because of one planted limit, whose kind is among those named; controls without it; what `check`
# says of the folder, as written and tampered with.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: rows and check of a goal have tests of their own there"
    exit 77
fi

# scene NAME TARGET GOAL [LINK [ANGLE [ATTRACTORS]]]
scene() {
    {
        echo 'morphplan: 1'
        echo "structure: {nodes: [3, 3], spacing: 0.10, link: {stiffness: 20${4:+, $4}}, angle: {${5:-}}}"
        echo "target: $2"
        echo 'motion: {friction: 0.4, time: 1}'
        echo 'schedule: {sample: 0.01}'
        if [ -n "$3" ]; then echo "goal: $3"; fi
        echo "attractors: ${6:-none}"
    } >"$work/$1.yaml"
}
box='{shape: box, size: [0.10, 0.10, 0.06]}'
sphere='{shape: sphere, radius: 0.06}'
# plan CODE NAME
plan() {
    expect "$1" "$program" plan "$work/$2.yaml" -o "$work/$2.plan" --quiet
}
# named WHAT: among the limits that stood against the goal, on stderr and in the summary
named() {
    holds "'$1' is among: $(sed -n 's/.*against it stood: //p' "$work/err")" \
        sh -c 'sed -n "s/.*against it stood: //p" "$1" | grep -q "$2"' sh "$work/err" "$1"
}

# A goal that the plan without it meets: the same schedule; its margin is inside.
scene free "$box" ''
scene met "$box" '{mean_gap: 0.004, max_gap: 0.03, coverage: 0.9}'
plan 0 free
plan 0 met
holds 'a goal that is met changes nothing' cmp "$work/free.plan/schedule.csv" "$work/met.plan/schedule.csv"
holds 'the summary has the margin' grep -q '"goal":' "$work/met.plan/summary.json"
holds 'the scene keeps it' grep -q 'mean_gap: 0.004' "$work/met.plan/scene.yaml"
expect 0 "$program" check "$work/met.plan"
holds 'check lists it' grep -Eq '^goal +holds ' "$work/out"
expect 0 "$program" check "$work/free.plan"
holds 'and not where there is none' grep -Eq '^goal +not in this plan' "$work/out"

# With centres, what can be met from where the pure blanket lay is met too, wherever attraction leads.
gap() { sed -n 's/^cavity .*mean gap [0-9.e-]* -> \([0-9.e-]*\) m, .*/\1/p' "$work/out"; }
expect 0 "$program" plan "$work/free.yaml" -o "$work/free.plan" --overwrite --quiet
from_blanket=$(gap)
scene drawn "$box" '' '' '' auto
plan 0 drawn
from_guided=$(gap)
wanted=$(awk -v a="$from_blanket" -v b="$from_guided" 'BEGIN { printf "%.6f", 1.02 * (a < b ? a : b) }')
scene asked "$box" "{mean_gap: $wanted}" '' '' auto
plan 0 asked

# Lengths nearly fixed; the control is the scene above.
scene short "$box" '{mean_gap: 0.004}' 'length: [0.095, 0.105]'
plan 3 short
says 'infeasible: goal: mean_gap 0\.[0-9]* m, wanted 0.004 m, at [0-9.]* s (missed by 0\.[0-9]* m): against it stood: '
named 'length of link [0-9]* .* (at its '
holds 'the reason is in the summary' grep -q '"reason":.*"goal: mean_gap .*against it stood: ' "$work/short.plan/summary.json"
expect 3 "$program" check "$work/short.plan"
holds 'check says so' grep -Eq '^goal +FAILS .* m .*mean_gap 0\.[0-9]* m, wanted 0.004 m' "$work/out"
holds 'and of nothing else' [ "$(grep -c FAILS "$work/out")" -eq 1 ]

# Links nearly square to their posts over a ball, with its control.
scene square "$sphere" '{mean_gap: 0.006}' '' 'link_post: [80, 100]'
plan 3 square
named 'angle of link [0-9]* .* / post '
scene loose "$sphere" '{mean_gap: 0.006}'
plan 0 loose

# Coverage of a ball, with links too short for it; and its control.
scene bare "$sphere" '{coverage: 0.995, mean_gap: 0.005}' 'length: [0.098, 0.102]'
plan 3 bare
named 'length of link '
scene covered "$sphere" '{coverage: 0.995, mean_gap: 0.005}'
plan 0 covered
expect 0 "$program" check "$work/covered.plan"

# The pure blanket is measured against the goal too; nothing was solved that could say what stood against it.
expect 3 "$program" plan "$work/met.yaml" -o "$work/blanket.plan" --quiet --method blanket
says 'infeasible: '

# A goal written into plan.h5 afterwards, its eight bytes found by their value: 0.004 becomes 0.0005.
cp -r "$work/met.plan" "$work/changed.plan"
perl -0777 -pe 's/\Q${\pack("d<", 0.004)}\E/pack("d<", 0.0005)/ge' "$work/met.plan/plan.h5" >"$work/changed.plan/plan.h5"
if cmp -s "$work/met.plan/plan.h5" "$work/changed.plan/plan.h5"; then fault 'the goal is not found in plan.h5'; fi
if "$program" check "$work/changed.plan" >"$work/out" 2>"$work/err"; then fault 'a changed goal passes the check'; fi
