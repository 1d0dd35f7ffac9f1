#!/bin/sh
# Shape to shape: sphere, saddle, flat, each plan from the end of the one before; measured lengths; and what is refused.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: starts have tests of their own there"
    exit 77
fi

# scene NAME START TARGET [NODES [LINK]]
scene() {
    {
        echo 'morphplan: 1'
        echo "structure: {nodes: ${4:-[4, 4]}, spacing: 0.10, link: {stiffness: 20${5:+, $5}}}"
        echo "target: $3"
        echo 'motion: {friction: 0.4, time: 1.5}'
        echo 'schedule: {sample: 0.01}'
        echo 'attractors: none'
        echo "start: $2"
    } >"$work/$1.yaml"
}
plan() {
    expect "$1" "$program" plan "$work/$2.yaml" -o "$work/$2.plan" --quiet
}
# joined BEFORE AFTER: the one schedule ends at the lengths at which the other begins, to 1e-9 m
joined() {
    tail -n 1 "$1" >"$work/last"
    sed -n 2p "$2" >"$work/first"
    holds "$2 begins where $1 ends" awk -F, '
        FNR == NR { n = NF; for (i = 2; i <= NF; i++) l[i] = $i; next }
        { if (NF != n || n < 3) exit 1; for (i = 2; i <= n; i++) if ($i - l[i] > 1e-9 || l[i] - $i > 1e-9) exit 1; ok = 1 }
        END { exit !ok }' "$work/last" "$work/first"
}
awk 'BEGIN { for (i = -6; i <= 6; i++) { for (j = -6; j <= 6; j++) printf "%s%.4f", (j > -6 ? "," : ""), 0.05 + (j * j - i * i) / 1200; print "" } }' \
    >"$work/saddle.csv"
sphere='{shape: sphere, radius: 0.09}'
saddle='{shape: heightmap, file: saddle.csv, cell: 0.03}'
# As large as the sheet: where it lies flat nothing is left uncovered.
plate='{shape: box, size: [0.30, 0.30, 0.02]}'

scene sphere flat "$sphere"
scene saddle sphere.plan "$saddle"
scene back saddle.plan "$plate"
for name in sphere saddle back; do
    plan 0 $name
    expect 0 "$program" check "$work/$name.plan"
done
joined "$work/sphere.plan/schedule.csv" "$work/saddle.plan/schedule.csv"
joined "$work/saddle.plan/schedule.csv" "$work/back.plan/schedule.csv"
holds 'the summary says where it started' grep -q '"kind":.*"plan"' "$work/saddle.plan/summary.json"
expect 0 "$program" plan "$work/saddle.plan/scene.yaml" -o "$work/again.plan" --quiet
holds 'the folder repeats the plan without the one before' cmp "$work/saddle.plan/schedule.csv" "$work/again.plan/schedule.csv"

# Measured lengths: the last row counts; the doubt is told.
cp "$work/sphere.plan/schedule.csv" "$work/now.csv"
scene measured now.csv "$saddle"
plan 0 measured
says 'measured.yaml:7: start: these lengths leave 26 free motions'
joined "$work/now.csv" "$work/measured.plan/schedule.csv"
expect 0 "$program" check "$work/measured.plan"
holds 'with its doubt' grep -q '"doubt_m":.*0\.' "$work/measured.plan/summary.json"
{ sed -n 1p "$work/now.csv" && tail -n 1 "$work/now.csv"; } >"$work/row.csv"
scene row row.csv "$saddle"
plan 0 row
holds 'one row is enough' cmp "$work/measured.plan/schedule.csv" "$work/row.plan/schedule.csv"

# A link that is stuck in the shape where it starts.
scene held sphere.plan "$saddle" '[4, 4]' 'stuck: [9]'
plan 0 held
joined "$work/sphere.plan/schedule.csv" "$work/held.plan/schedule.csv"
holds 'it stays as long as it was' awk -F, 'NR == 2 { l = $11 } NR > 1 && ($11 - l > 1e-10 || l - $11 > 1e-10) { exit 1 }' \
    "$work/held.plan/schedule.csv"

# refused PATTERN: exit 2 at the start's line, nothing written
refused() {
    expect 2 "$program" plan "$work/bad.yaml" -o "$work/bad.plan"
    says "bad.yaml:7: start: .*$1"
    absent "$work" bad.plan
}
scene bad sphere.plan "$sphere" '[3, 3]'
refused 'sphere.plan: its structure.nodes, layout, joints or bracing is another, allowed: a plan of the same structure'
scene bad sphere.plan "$sphere" '[4, 4]' 'length: [0.08, 0.13]'
refused 'sphere.plan: its structure.link.length is another'
scene bad none.plan "$sphere"
refused 'none.plan is not there, allowed: flat, a plan folder'
mkdir "$work/empty"
scene bad empty "$sphere"
refused 'empty: is no plan folder'
scene bad cut.csv "$sphere"
# cut PROGRAM PATTERN: lengths changed by awk
cut() {
    awk -F, -v OFS=, "$1" "$work/now.csv" >"$work/cut.csv"
    refused "$2"
}
cut 'NR == 5 { NF = NF - 1 } 1' 'cut.csv:5: 48 columns, expected 49'
cut '{ NF = NF - 1 } 1' 'cut.csv:1: 48 columns, expected 49'
cut 'NR == 4 { $3 = "nan" } 1' 'cut.csv:4: column 3: "nan" is not a number'
cut 'NR == 4 { $1 = 0 } 1' 'cut.csv:4: column 1: time does not increase'
cut 'NR == 1' 'at least one row is needed'
cut 'NR > 1 { $7 = 0.05 } 1' 'link 5 .* starts at 0.05 m, allowed: 0.075 to 0.135'
sed '3s/,[^,]*$/,x/' "$work/saddle.plan/start.csv" >"$work/cut.csv"
refused 'cut.csv:3: column 4: "x" is not a number'
scene bad sphere.plan "$sphere"
expect 2 "$program" plan "$work/bad.yaml" -o "$work/bad.plan" --method blanket
says 'not available yet: start: plan with --method blanket'
