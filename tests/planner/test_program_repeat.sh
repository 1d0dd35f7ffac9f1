#!/bin/sh
# The same scene gives the same bytes, whatever lies in the current folder; the scene in a plan folder repeats the plan;
# the pure blanket tells what it breaks.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: four plans for what they would not see"
    exit 77
fi
mkdir "$work/clean" "$work/hostile" && cd "$work/clean" || exit 1
touch "$work/out" "$work/err"

expect 0 "$program" plan "$placed" -o "$work/first.plan" --quiet
if [ -s "$work/err" ]; then fault "--quiet is not quiet"; fi

# Ipopt reads this file from the current folder, and it would win over values set in code.
cd "$work/hostile" || exit 1
cat >ipopt.opt <<'OPT'
max_iter 0
tol 1.0e2
constr_viol_tol 1.0e2
mu_strategy monotone
print_level 12
output_file stray.txt
OPT
expect 0 "$program" plan "$placed" -o "$work/second.plan" --json
for file in plan.h5 schedule.csv; do
    holds "$file is the same" cmp "$work/first.plan/$file" "$work/second.plan/$file"
done
holds "schedule.json is the same" cmp "$work/first.plan/schedule.json" "$work/second.plan/schedule.json"
timeless() {
    sed '/"seconds"/,/}/d; /"peak_memory_bytes"/d; /_seconds"/d; /_share"/d' "$1/summary.json"
}
timeless "$work/first.plan" >"$work/a"
timeless "$work/second.plan" >"$work/b"
holds "summary.json is the same but for times: $(diff "$work/a" "$work/b")" cmp "$work/a" "$work/b"
holds "ipopt.opt was left alone" [ "$(ls -A)" = ipopt.opt ]

# --json: the summary, whole: every brace closed, no value that JSON does not know.
holds "the summary on stdout" cmp "$work/out" "$work/second.plan/summary.json"
opened=$(tr -cd '{[' <"$work/out" | wc -c)
closed=$(tr -cd '}]' <"$work/out" | wc -c)
holds "$opened opened and $closed closed" [ "$opened" -gt 5 -a "$opened" -eq "$closed" ]
if grep -Eqi ':[[:space:]]*-?(nan|inf)' "$work/out"; then fault "a number that JSON does not know"; fi
for key in outcome feasible cavity_volume target_volume objective gap coverage margins mobility duration iterations rows \
    seconds peak_memory_bytes; do
    holds "$key is in the summary" grep -q "^	\"$key\":" "$work/out"
done

# plan DIR/scene.yaml repeats the plan.
expect 0 "$program" plan "$work/first.plan/scene.yaml" -o "$work/third.plan"
holds "the scene of the folder repeats the plan" cmp "$work/first.plan/schedule.csv" "$work/third.plan/schedule.csv"

# The pure blanket.
run "$program" plan "$placed" --method blanket -o "$work/blanket.plan"
case "$code" in
0) holds "an outcome" grep -q '^outcome    feasible' "$work/out" ;;
3)
    # constraint, element, time and by how much
    says '^morphplan: infeasible: [a-z_]*: .*\(link\|post\|joint\|skin\).* at [0-9.]* s: beyond by [0-9.e-]* [a-z]'
    holds "a folder that is marked infeasible" [ "$(outcome "$work/blanket.plan")" = infeasible ]
    expect 3 "$program" check "$work/blanket.plan"
    ;;
*) fault "--method blanket: exit $code instead of 0 or 3" ;;
esac
no_leftovers "$work"
