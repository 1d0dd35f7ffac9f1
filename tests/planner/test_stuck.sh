#!/bin/sh
# Links that hold their length: the plan goes around them; a goal that one of them forbids names it; its control.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: the held lengths have tests of their own there"
    exit 77
fi

# scene NAME STUCK [GOAL [TARGET]]
scene() {
    {
        echo 'morphplan: 1'
        echo "structure: {nodes: [3, 3], spacing: 0.10, link: {stiffness: 20, stuck: $2}}"
        echo "target: ${4:-{shape: box, size: [0.10, 0.10, 0.06]\}}"
        echo 'motion: {friction: 0.4, time: 1}'
        echo 'schedule: {sample: 0.01}'
        echo 'attractors: none'
        if [ -n "${3:-}" ]; then echo "goal: $3"; fi
    } >"$work/$1.yaml"
}
# constant NAME LINK...: the length in schedule.csv stays at 0.1 m to 1e-9 of the spacing
constant() {
    name=$1
    shift
    for link in "$@"; do
        holds "link $link of $name stays as it is" awk -F, -v c=$((link + 2)) '
            NR > 1 { d = $c - 0.1; if (d < 0) d = -d; if (d > 1e-10) exit 1; n++ } END { if (n < 10) exit 1 }' \
            "$work/$name.plan/schedule.csv"
    done
}
plan() {
    expect "$1" "$program" plan "$work/$2.yaml" -o "$work/$2.plan" --quiet
}

scene one '[3]'
expect 0 "$program" info "$work/one.yaml"
holds 'info lists it' grep -q '^stuck .*link 3 (1,0)-(1,1) bottom holds 0.1 m' "$work/out"
plan 0 one
constant one 3
expect 0 "$program" check "$work/one.plan"
holds 'the scene keeps it' grep -q 'stuck: \[3\]' "$work/one.plan/scene.yaml"
expect 0 "$program" export "$work/one.plan" --format csv --sample 0.0037 -o "$work/fine.csv"
holds 'and it is as long between the samples' awk -F, 'NR > 1 && ($5 < 0.1 - 1e-10 || $5 > 0.1 + 1e-10) { exit 1 }' "$work/fine.csv"

# Above each other, at one joint, one after the other.
scene four '[3, 15, 0, 8]'
plan 0 four
constant four 3 15 0 8
expect 0 "$program" check "$work/four.plan"

# A gap that one stuck link forbids, named; and without it.
ball='{shape: sphere, radius: 0.06}'
scene forbidden '[3]' '{mean_gap: 0.0047}' "$ball"
plan 3 forbidden
says 'against it stood: .*length of link 3 (1,0)-(1,1) bottom (stuck, too long)'
constant forbidden 3
scene control '[]' '{mean_gap: 0.0047}' "$ball"
plan 0 control
expect 0 "$program" check "$work/control.plan"

# Numbers that are none.
scene wrong '[3, 24, 3]'
expect 2 "$program" plan "$work/wrong.yaml"
says 'wrong.yaml:2: structure.link.stuck\[1\]: 24 is too large, allowed: a whole number from 0 to 23'
says 'wrong.yaml:2: structure.link.stuck\[2\]: 3 is given twice'
absent "$work" wrong.plan
