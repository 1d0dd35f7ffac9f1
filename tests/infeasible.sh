#!/bin/sh
# Ten scenes that one planted cause makes infeasible, each with its control, which is the same without that cause:
#     sh tests/infeasible.sh [PROGRAM [SCENE...]]         (default: build/morphplan, all of examples/infeasible)
# Fails unless every scene exits 3 and says constraint, element, time and amount, every control exits 0, and the planted cause
# is among the three named first in at least 8 of 10. Some ten minutes on two cores.
#
# In a scene the lines that end in "# planted" are the cause; the control is without them and with what "#control" hides. "# Must
# be named:" is the pattern of the cause among the names.
set -u
program=${1:-build/morphplan}
[ $# -eq 0 ] || shift
here=$(cd "$(dirname "$0")" && pwd)
scenes=$here/../examples/infeasible
case $program in
*/*) ;;
*) program=./$program ;;
esac
[ -x "$program" ] || { echo "$program is not there: build it first, or give its path"; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' INT TERM HUP

if [ $# -eq 0 ]; then
    set -- "$scenes"/*.yaml
fi
for scene in "$@"; do
    name=$(basename "$scene" .yaml)
    cp "$scene" "$work/$name.yaml"
    sed -e '/# planted$/d' -e 's/^#control//' "$scene" >"$work/$name.control.yaml"
    if cmp -s "$scene" "$work/$name.control.yaml"; then
        echo "$scene: nothing is planted in it"
        exit 1
    fi
    printf '%s\n%s\n' "$name" "$name.control" >>"$work/list"
done

# One BLAS thread each: two plans run side by side.
export OPENBLAS_NUM_THREADS=1
export program work
# shellcheck disable=SC2016
xargs -P 2 -I NAME sh -c '
    code=0
    "$program" plan "$work/NAME.yaml" -o "$work/NAME.plan" --quiet >"$work/NAME.out" 2>"$work/NAME.err" || code=$?
    echo "$code" >"$work/NAME.code"' <"$work/list"

planted=0 named=0 failures=0
for scene in "$@"; do
    name=$(basename "$scene" .yaml)
    cause=$(sed -n 's/^# Must be named: //p' "$scene")
    code=$(cat "$work/$name.code")
    control=$(cat "$work/$name.control.code")
    said=$(sed -n 's/^morphplan: infeasible: //p' "$work/$name.err")
    against=$(echo "$said" | sed -n 's/.*against it stood: //p')
    planted=$((planted + 1))
    is=no
    if [ -n "$cause" ] && echo "$against" | grep -q -e "$cause"; then
        is=yes
        named=$((named + 1))
    fi
    printf '%-14s exit %s, control %s, planted cause named: %s\n' "$name" "$code" "$control" "$is"
    echo "$said" | sed 's/: against it stood: /\n/; s/, \(length\|angle\|clearance\|self\|base\|rate\|acc\|jerk\)/\n\1/g' | sed 's/^/    /'
    if [ "$code" != 3 ]; then
        echo "    FAILED: exit $code instead of 3"
        failures=$((failures + 1))
    # What is missed, when, by how much; and by what limit of what element.
    elif ! echo "$said" | grep -Eq '( at [0-9.]+ s \(missed by [0-9]|is too short: this path needs [0-9.]+ s)' ||
        ! echo "$against" | grep -Eq '\([0-9]+,[0-9]+\)'; then
        echo "    FAILED: constraint, element, time or amount is missing"
        failures=$((failures + 1))
    fi
    if [ "$control" != 0 ]; then
        echo "    FAILED: the control's exit is $control instead of 0: $(tail -n 1 "$work/$name.control.err")"
        failures=$((failures + 1))
    fi
done
echo "$named of $planted planted causes are among those named"
# Eight in ten; of a part of the scenes as many in proportion.
[ "$failures" -eq 0 ] && [ $((10 * named)) -ge $((8 * planted)) ]
