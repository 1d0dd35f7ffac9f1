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
holds "free motions are told" grep -Eq '^mobility   26 free motions: lengths alone do not fix this shape, replayed they end [0-9.]+ spacings off$' "$work/out"
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
holds "the files hold" grep -Eq '^files +holds ' "$work/out"
expect 0 "$program" check "$plan" --schedule "$plan/schedule.csv"
awk -F , -v OFS=, 'NR == 1000 { $9 = $9 + 0.05 } { print }' "$plan/schedule.csv" >"$work/bad.csv"
expect 3 "$program" check "$plan" --schedule "$work/bad.csv"
holds "the spoilt link is named" grep -q 'link 7 ' "$work/out"
# Every second sample; where that leaves out the last one, the plan's end a sample later.
awk -F , -v OFS=, 'NR == 3 { h = $1 } NR == 1 || NR % 2 == 0 { print } { t = $1; row = $0 }
    END { if (NR % 2) { $0 = row; $1 = t + h; print } }' "$plan/schedule.csv" >"$work/half.csv"
expect 0 "$program" check "$plan" --schedule "$work/half.csv"
holds "a table of half the rate is compared" grep -q '^compatibility   holds' "$work/out"
awk -F , -v OFS=, 'NR > 1 { $1 = $1 * 1.5 } { print }' "$plan/schedule.csv" >"$work/slow.csv"
expect 3 "$program" check "$plan" --schedule "$work/slow.csv"
holds "a slower table is not the plan's" grep -q '^compatibility   FAILS' "$work/out"
expect 2 "$program" check "$plan" --schedule "$work/missing.csv"
says missing.csv

# Check: every file of the folder that a machine reads.
# altered FILE COMMAND...: check after COMMAND has been run in a copy of the plan.
altered() {
    rm -rf "$work/altered.plan"
    cp -r "$plan" "$work/altered.plan"
    file=$1
    shift
    (cd "$work/altered.plan" && "$@")
    expect 3 "$program" check "$work/altered.plan" --quiet
    holds "$file is named" grep -q "^$file  *FAILS" "$work/out"
}
altered schedule.csv cp "$work/bad.csv" schedule.csv
holds "the spoilt link and its time are told" grep -q '^schedule.csv .*link 7 .* at 0.998 s is .* (off by 0.05 m)' "$work/out"
altered schedule.csv sed -i '$ d' schedule.csv
altered schedule.csv sed -i '50 s/0/x/' schedule.csv
altered schedule.json sed -i 's/], "rate": 0.05/], "rate": 0.5/' schedule.json
altered schedule.json sed -i '1 d' schedule.json
altered plan.h5 sh -c 'echo >>plan.h5'
for file in schedule.csv schedule.json plan.h5; do
    cp "$plan"/* "$work/altered.plan"
    rm "$work/altered.plan/$file"
    expect 2 "$program" check "$work/altered.plan" --quiet
    one_line
    says "$file"
done
rm -r "$work/altered.plan"
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
expect 2 "$program" picture "$plan" -o "$work/none/box.svg"
says "$work/none/box.svg"
absent "$work" box.jpeg
expect 0 "$program" picture "$plan" --of cavity -o "$work/cavity.svg"
holds "a whole SVG file of cavities" grep -q '</svg>' "$work/cavity.svg"
expect 0 "$program" picture "$plan" --of cavity -o "$work/cavity.png"
holds "a whole PNG file of cavities" [ "$(tail -c 8 "$work/cavity.png" | head -c 4)" = IEND ]
expect 2 "$program" picture "$plan" --of cavity -o "$work/cavity.gif"
says 'svg'
absent "$work" cavity.gif
expect 2 "$program" picture "$plan" --of cavities -o "$work/cavities.svg"
one_line
says 'allowed: schedule, blanket, replay, core, cavity'
absent "$work" cavities.svg

# The cavities of summary.json and of the report.
holds "a list of cavities" grep -q '"cavities":' "$plan/summary.json"
holds "shares of the cavity volume" grep -q '"share":' "$plan/summary.json"
holds "the report's cavities" grep -q 'Connected cavities, before and after' "$plan/report.html"

expect 0 "$program" info "$scene"
holds "the structure is told" grep -q '32 joints, 48 links, 16 posts' "$work/out"
expect 0 "$program" --version
expect 0 "$program" --help
holds "exit codes in the help" grep -q 'exit codes' "$work/out"

# A folder that is there stays as it is, unless it may be overwritten and is a plan.
fingerprint "$plan" >"$work/before"
expect 2 "$program" plan "$scene" -o "$plan"
one_line
says 'is there already: .*--overwrite'
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
refused plan "$scene" --budget 0
refused plan "$scene" --budget soon
refused plan "$scene" --level best
refused plan "$scene" -o "$work/none/box.plan"
says "$work/none"
refused plan "$scene" -o "$scene/box.plan"

# An option of another command is not left out silently.
refused plan "$scene" -o "$work/none.plan" --schedule "$work/bad.csv"
says 'schedule is no option of plan'
absent "$work" none.plan
refused check "$plan" --method blanket
says 'method is no option of check'
refused check "$plan" -o "$work/none.plan"
refused check "$plan" --overwrite
refused info "$scene" -o "$work/none"
says 'o is no option of info'
refused info "$scene" --json
refused picture "$plan" -o "$work/none.svg" --schedule "$work/bad.csv"
absent "$work" none.svg
refused plan "$scene" -o "$work/none.plan" --of blanket
says 'of is no option of plan'

# Limits of a scene are told where they stand.
printf 'morphplan: 1\nstructure:\n  nodes: [4, 4]\n  spacing: 0.1\n  angle: {link_post: [0, 180]}\ntarget: {shape: sphere, radius: 0.1}\n' >"$work/angle.yaml"
expect 2 "$program" info "$work/angle.yaml"
says 'angle.yaml:5: structure.angle.link_post\[0\]: 0 is too small, allowed: a number above 0 and below 180 degrees'
sed 's/link_post: .*}/link_post: [90, 90]}/' "$work/angle.yaml" >"$work/angle_90.yaml"
refused info "$work/angle_90.yaml"
says 'angle_90.yaml:5: .*the larger must be above the smaller'
sed 's/  angle: .*/  link: {length: {bottom: [0.1, 0.1]}}/' "$work/angle.yaml" >"$work/rigid.yaml"
expect 0 "$program" info "$work/rigid.yaml"
{ cat "$scene" && echo 'schedule: {duration: 300}'; } >"$work/long.yaml"
refused plan "$work/long.yaml" -o "$work/long.plan"
says 'long.yaml:[0-9]*: schedule.duration: 300 s at a schedule.sample of 0.001 s is too many samples, allowed: at most 200000'
absent "$work" long.plan

# Coarse samples: what posts and lengths do between samples is not held against a plan.
{ cat "$scene" && echo 'schedule: {sample: 0.02}'; } >"$work/coarse.yaml"
expect 0 "$program" plan "$work/coarse.yaml" -o "$work/coarse.plan" --quiet
expect 0 "$program" check "$work/coarse.plan" --quiet
rm -r "$work/coarse.plan"

# Exports: as schedule.csv at the plan's own step, at any other, never over a file unasked.
expect 0 "$program" export "$plan" --format csv -o "$work/export.csv"
holds "nothing on stdout" [ ! -s "$work/out" ]
links=$(head -n 1 "$plan/schedule.csv" | tr ',' '\n' | grep -c link)
holds "three columns a link" [ "$(head -n 1 "$work/export.csv" | tr ',' '\n' | grep -c link)" -eq $((3 * links)) ]
cut -d, -f "1-$((links + 1))" "$work/export.csv" >"$work/lengths.csv"
holds "the lengths of schedule.csv" cmp "$work/lengths.csv" "$plan/schedule.csv"
expect 0 "$program" check "$plan" --schedule "$work/lengths.csv" --quiet
expect 0 "$program" export "$plan" --format csv --sample 0.01
holds "on stdout" [ "$(wc -l <"$work/out")" -gt 10 ]
cut -d, -f "1-$((links + 1))" "$work/out" >"$work/lengths.csv"
cp "$work/out" "$work/coarse.csv"
expect 0 "$program" check "$plan" --schedule "$work/lengths.csv" --quiet
cp "$work/export.csv" "$work/before.csv"
refused export "$plan" --format csv -o "$work/export.csv" --sample 0.01
says 'export.csv: is there already: .*--overwrite'
holds "the file stays" cmp "$work/export.csv" "$work/before.csv"
expect 0 "$program" export "$plan" --format csv -o "$work/export.csv" --sample 0.01 --overwrite
holds "replaced" cmp "$work/export.csv" "$work/coarse.csv"
refused export "$plan"
says '\--format'
refused export "$plan" --format csv --sample 0
refused export "$plan" --format csv --sample 1e-9
refused export "$plan" --format csv --axes axes.yaml
says 'not available yet: --axes'
for format in jtc pvt csp mcap vtk; do
    refused export "$plan" --format $format
    says "not available yet: --format $format"
done
refused export "$plan" --format xls
refused export "$work" --format csv
refused plan "$scene" --sample 0.1

# A budget: a feasible plan, soon; that it ran out is told.
expect 0 "$program" plan "$placed" --budget 0.5 -o "$work/budget.plan"
says 'the budget of 0.5 s'
holds "it is feasible" [ "$(outcome "$work/budget.plan")" = feasible ]
holds "the summary tells" grep -q '"ran_out":[[:space:]]*true' "$work/budget.plan/summary.json"
expect 0 "$program" check "$work/budget.plan" --quiet
rm -r "$work/budget.plan"

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
later trade trade "$scene"
# The blanket under the centres that NLopt places, exported as it is: feasible or not, never a failure.
if [ -z "$slow" ]; then
    run "$program" plan "$placed" --method nlopt -o "$work/nlopt.plan" --quiet
    holds "--method nlopt ends with 0 or 3, not $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
    holds 'it says what guided it' grep -q '"guided"' "$work/nlopt.plan/summary.json"
fi
later '--level draft' plan "$scene" --level draft
later '--level fine' plan "$scene" --level fine
later '--threads' plan "$scene" --threads 2

# with SECTION KEY VALUE: the scene with a key more; SECTION "" is the top.
with_key() {
    if [ -n "$1" ]; then
        sed "s|^\( *\)$1:\$|&\n\1  $2: $3|" "$source/examples/scenes/box_4.yaml" >"$work/later.yaml"
    else
        { cat "$source/examples/scenes/box_4.yaml" && echo && echo "$2: $3"; } >"$work/later.yaml"
    fi
}
later_key() {
    with_key "$@"
    later "$2" plan "$work/later.yaml"
    says "later.yaml:[0-9]*: "
}
# Read, shown and planned, but no centres are placed for them yet.
beyond_key() {
    with_key "$@"
    expect 0 "$program" info "$work/later.yaml"
    later "$1.$2" plan "$work/later.yaml" --method nlopt
    says 'later.yaml: .* with --method nlopt'
}
read_key() {
    with_key "$@"
    expect 0 "$program" info "$work/later.yaml"
}
read_key structure layout offset
read_key structure joints universal
read_key structure bracing web
read_key structure fixed border
read_key structure fixed '[[0, 0], [3, 3]]'
beyond_key motion mode rise
with_key target deformable '{young: 2.0e4, density: 300}'
later target.deformable plan "$work/later.yaml"
read_key structure support frame
read_key link stuck '[3, 4]'
read_key motion touch '[{node: [1, 2], layer: top, force: [0, 0, -2], from: 1.0, to: 1.5}]'
read_key '' attractors '[{at: [0, 0, 0], strength: 1.0}]'
later_key link force '[-50, 50]'
read_key '' goal '{mean_gap: 0.01}'

# --- a motion that no step is short enough for is refused by name, also when nothing else is to be said
cat >"$work/wire.yaml" <<'SCENE'
morphplan: 1
structure: {nodes: [4, 4], spacing: 0.1, link: {stiffness: 20, radius: 0.0005}}
target: {shape: capsule, radius: 0.0005, height: 0.5, rotate: [0, 90, 0], at: [0, 0, 0.2]}
motion: {height: 1.0, gravity: 10000, time: 0.2, friction: 0.4}
attractors: none
SCENE
expect 3 "$program" plan "$work/wire.yaml" --method blanket -o "$work/wire.plan" --quiet
one_line
says 'wire.yaml: clearance: .* would come through the target at 0\.0[0-9]* s'
absent "$work" wire.plan
