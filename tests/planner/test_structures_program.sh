#!/bin/sh
# Every kind of structure is planned and checked; what holds it is held in what is exported too.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: rows, projections and paths of structures have tests of their own there"
    exit 77
fi

# A hundredth of a second between samples is enough to see, and quicker to write; centres are placed for one alone.
example() {
    { cat "$source/examples/scenes/$1.yaml" && echo && echo 'schedule: {sample: 0.01}'; } >"$work/$1.yaml"
    if [ "$1" != box_corners ]; then echo 'attractors: none' >>"$work/$1.yaml"; fi
}
plan() {
    expect 0 "$program" plan "$work/$1.yaml" -o "$work/$1.plan"
    holds "$1: outcome" grep -q '^outcome .*every limit holds' "$work/out"
    # Its shape is better than the blanket's.
    holds "$1: the objective" awk -F: '
        /"objective"/ { inside = 1 }
        inside && /"blanket"/ { blanket = $2 + 0 }
        inside && /"plan"/ { good = $2 + 0 > 0 && $2 + 0 < blanket; exit }
        END { exit !good }' "$work/$1.plan/summary.json"
    expect 0 "$program" check "$work/$1.plan"
}
for name in box_web box_full box_offset box_corners; do
    example "$name"
    plan "$name"
done

# Held nodes: links between them hold their length.
cat >"$work/edge.yaml" <<'SCENE'
morphplan: 1
structure: {nodes: [4, 4], spacing: 0.1, fixed: [[0, 0], [1, 0]], link: {stiffness: 20}}
target: {shape: sphere, radius: 0.1, at: [0.05, 0.05, -0.06]}
motion: {friction: 0.4, height: 0.02, time: 1.5}
base: none
schedule: {sample: 0.01}
attractors: none
SCENE
plan edge
expect 0 "$program" export "$work/edge.plan" --format csv --sample 0.0037 -o "$work/edge.csv"
holds 'a link between held nodes keeps its length' awk -F, '
    NR > 1 { d = $2 - 0.1; if (d < 0) d = -d; if (d > 1e-9) exit 1; n++ } END { if (n < 10) exit 1 }' \
    "$work/edge.csv"

# A ball that rises into a stiff blanket whose border is held.
cat >"$work/short.yaml" <<'SCENE'
morphplan: 1
structure: {nodes: [5, 5], spacing: 0.1, fixed: border, support: frame, link: {stiffness: 2000}}
target: {shape: sphere, radius: 0.15, at: [0, 0, -0.07]}
motion: {mode: rise, height: 0.12, friction: 0.4, time: 0.4}
base: 0.0
schedule: {sample: 0.01}
SCENE
plan short

# Limits per layer: the plan keeps each to its own.
sed 's/^    stiffness: 20.*/&\n    length: {bottom: [0.09, 0.12], top: [0.08, 0.125]}/' "$source/examples/scenes/box_4.yaml" >"$work/layers.yaml"
printf '\nattractors: none\nschedule: {sample: 0.01}\n' >>"$work/layers.yaml"
plan layers
holds 'bottom links stay within their own limits' awk -F, '
    NR > 1 { for (c = 2; c <= 25; c++) if ($c < 0.09 - 1e-9 || $c > 0.12 + 1e-9) exit 1; n++ } END { if (n < 10) exit 1 }' \
    "$work/layers.plan/schedule.csv"
holds 'top links stay within theirs' awk -F, '
    NR > 1 { for (c = 26; c <= 49; c++) if ($c < 0.08 - 1e-9 || $c > 0.125 + 1e-9) exit 1; n++ } END { if (n < 10) exit 1 }' \
    "$work/layers.plan/schedule.csv"
