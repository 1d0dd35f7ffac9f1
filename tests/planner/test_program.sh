#!/bin/sh
# The program from outside: plan, check, picture, info, and what it refuses.
. "$(dirname "$0")/program.sh"
cd "$work" || exit 1
plan=$work/box.plan

# A plan: six lines in their order, a folder of six files, nothing else.
expect 0 "$program" plan "$scene" -o "$plan"
words=$(cut -d ' ' -f 1 "$work/out" | tr '\n' ' ')
holds "six lines in their order, not: $words" [ "$words" = "outcome cavity margin duration mobility folder " ]
holds "the outcome is told" grep -Eq '^outcome    (optimal|feasible): every limit holds$' "$work/out"
holds "free motions are told" grep -q '^mobility   26 free motions: lengths alone do not fix this shape$' "$work/out"
holds "the folder is told" grep -qx "folder     $plan" "$work/out"
holds "progress is plain lines where there is no terminal" grep -q ' s  refine$' "$work/err"
if grep -q "$(printf '\033')" "$work/err"; then fault "escape codes without a terminal"; fi
files=$(ls -A "$plan" | tr '\n' ' ')
holds "the files of a plan, not: $files" \
    [ "$files" = "plan.h5 report.html scene.yaml schedule.csv schedule.json summary.json " ]
no_leftovers "$work"
head -n 1 "$plan/schedule.csv" | tr ',' '\n' >"$work/columns"
holds "a time and 48 lengths" [ "$(wc -l <"$work/columns")" -eq 49 ]
holds "the first column" [ "$(head -n 1 "$work/columns")" = time_s ]
holds "the last column" [ "$(tail -n 1 "$work/columns")" = link_0047_m ]
holds "the checksum of the schedule" grep -q "$(sha256sum "$plan/schedule.csv" | cut -d ' ' -f 1)" "$plan/schedule.json"
holds "the checksum of the plan" grep -q "$(sha256sum "$plan/plan.h5" | cut -d ' ' -f 1)" "$plan/schedule.json"

# Check: the plan holds; a schedule with one wrong length does not, and the finding is named.
expect 0 "$program" check "$plan"
for margin in length rate acceleration jerk post_length link_post link_link clearance base self_clearance compatibility; do
    holds "$margin holds" grep -Eq "^$margin +holds " "$work/out"
done
expect 0 "$program" check "$plan" --schedule "$plan/schedule.csv"
awk -F , -v OFS=, 'NR == 1000 { $9 = $9 + 0.05 } { print }' "$plan/schedule.csv" >"$work/bad.csv"
expect 3 "$program" check "$plan" --schedule "$work/bad.csv"
holds "the spoilt link is named" grep -q 'link 7 ' "$work/out"
head -c 3000 "$plan/plan.h5" >"$work/short.h5"
mkdir "$work/short.plan" && mv "$work/short.h5" "$work/short.plan/plan.h5"
run "$program" check "$work/short.plan"
holds "a truncated plan.h5 is refused, not exit $code" [ "$code" -eq 1 -o "$code" -eq 2 ]
says plan.h5

# Pictures.
expect 0 "$program" picture "$plan" -o "$work/box.svg"
holds "an SVG file" grep -q '<svg' "$work/box.svg"
holds "a whole SVG file" grep -q '</svg>' "$work/box.svg"
expect 0 "$program" picture "$plan" -o "$work/box.png"
holds "a PNG file" [ "$(head -c 4 "$work/box.png" | tail -c 3)" = PNG ]
holds "a whole PNG file" [ "$(tail -c 8 "$work/box.png" | head -c 4)" = IEND ]
expect 2 "$program" picture "$plan" -o "$work/box.jpeg"
says 'svg'
expect 2 "$program" picture "$plan"
one_line
absent "$work" box.jpeg

expect 0 "$program" info "$scene"
holds "the structure is told" grep -q '32 joints, 48 links, 16 posts' "$work/out"
expect 0 "$program" --version
expect 0 "$program" --help
holds "exit codes in the help" grep -q 'exit codes' "$work/out"

# A folder that is there stays as it is, unless it may be overwritten and is a plan.
fingerprint "$plan" >"$work/before"
expect 2 "$program" plan "$scene" -o "$plan"
one_line
says 'is there already'
unchanged "$plan" "$work/before"
mkdir "$work/photos" && echo mine >"$work/photos/holiday.txt"
fingerprint "$work/photos" >"$work/before"
expect 2 "$program" plan "$scene" -o "$work/photos" --overwrite
one_line
unchanged "$work/photos" "$work/before"

# Wrong usage: one line, exit 2.
refused() {
    expect 2 "$program" "$@"
    one_line
}
refused fly "$scene"
says 'unknown command: fly'
refused plan "$scene" --sideways
says sideways
refused plan "$scene" --method
refused plan "$scene" --method magic
says magic
refused plan
refused plan "$scene" "$scene"
refused plan "$work/missing.yaml"
says missing.yaml
refused plan "$scene" --budget -5
refused plan "$scene" --level best

# What comes later is refused by name.
later() {
    name=$1
    shift
    expect 2 "$program" "$@" -o "$work/later.plan"
    one_line
    says 'not available yet'
    says "$name"
    absent "$work" later.plan
}
later compare compare "$scene"
later trade trade "$scene"
later export export "$plan" --format csv
later '--method nlopt' plan "$scene" --method nlopt
later '--budget' plan "$scene" --budget 5
later '--level draft' plan "$scene" --level draft
later '--level fine' plan "$scene" --level fine
later '--threads' plan "$scene" --threads 2

# with SECTION KEY VALUE: the scene with a key more; SECTION "" is the top.
with_key() {
    if [ -n "$1" ]; then
        sed "s|^\( *\)$1:\$|&\n\1  $2: $3|" "$scene" >"$work/later.yaml"
    else
        { cat "$scene" && echo && echo "$2: $3"; } >"$work/later.yaml"
    fi
}
later_key() {
    with_key "$@"
    later "$2" plan "$work/later.yaml"
    says "later.yaml:[0-9]*: "
}
# Read and shown, but not planned by the refining method yet.
beyond_key() {
    with_key "$@"
    expect 0 "$program" info "$work/later.yaml"
    later "$1.$2" plan "$work/later.yaml"
    says 'later.yaml: .* with --method ipopt'
}
read_key() {
    with_key "$@"
    expect 0 "$program" info "$work/later.yaml"
}
beyond_key structure layout offset
beyond_key structure joints universal
beyond_key structure bracing web
beyond_key structure fixed border
beyond_key structure fixed '[[0, 0], [3, 3]]'
beyond_key motion mode rise
with_key target deformable '{young: 2.0e4, density: 300}'
later target.deformable plan "$work/later.yaml"
read_key structure support frame
read_key motion touch '[{node: [1, 2], layer: top, force: [0, 0, -2], from: 1.0, to: 1.5}]'
read_key '' attractors '[{at: [0, 0, 0], strength: 1.0}]'
later_key link force '[-50, 50]'
later_key link stuck '[3, 4]'
later_key '' start other.plan
later_key '' goal '{mean_gap: 0.01}'
