# Sourced by the script tests of the program: sh test_NAME.sh PROGRAM SOURCE_FOLDER. Gives a folder of its own to work in
# (removed at the end), runs commands and keeps what they say.
#   $program $source  the two arguments    $work  the folder    $scene  the 4 x 4 box, without centres of attraction
#   $placed  a 3 x 3 one with them
#   $work/out $work/err  what the last command printed    $slow  not empty where sanitizers make everything slower
set -u
program=$1
source=$2
work=$(mktemp -d)
placed=$work/placed.yaml
slow=${MORPH_SANITIZE:-}
failures=0
mounted=""

finish() {
    status=$?
    if [ -n "$mounted" ]; then umount "$mounted"; fi
    rm -rf "$work"
    if [ "$failures" -ne 0 ]; then
        echo "$failures failures"
        exit 1
    fi
    exit "$status"
}
trap finish EXIT
# Placing centres takes longer than all the rest of so small a plan.
scene=$work/box_4.yaml
{ cat "$source/examples/scenes/box_4.yaml" && echo && echo 'attractors: none'; } >"$scene"
cat >"$placed" <<'SCENE'
morphplan: 1
structure: {nodes: [3, 3], spacing: 0.1, link: {stiffness: 20}}
target: {shape: box, size: [0.10, 0.10, 0.06]}
motion: {friction: 0.4, time: 1}
schedule: {sample: 0.01}
SCENE
trap 'exit 1' INT TERM HUP

# fault WHAT: counts a failure and shows the last command's output.
fault() {
    failures=$((failures + 1))
    echo "FAILED: $1"
    sed 's/^/    stdout: /' "$work/out" | head -n 12
    grep -v ' s  ' "$work/err" | sed 's/^/    stderr: /' | head -n 12
}

# run COMMAND...: keeps exit code ($code) and output. Never ends the test.
run() {
    code=0
    "$@" >"$work/out" 2>"$work/err" </dev/null || code=$?
}

# expect CODE COMMAND...
expect() {
    wanted=$1
    shift
    run "$@"
    if [ "$code" -ne "$wanted" ]; then fault "exit $code instead of $wanted: $*"; fi
}

# holds WHAT COMMAND...: a condition that must be true.
holds() {
    what=$1
    shift
    "$@" >/dev/null 2>&1 || fault "$what"
}

# says PATTERN: stderr of the last command has it.
says() {
    grep -q -e "$1" "$work/err" || fault "stderr does not say \"$1\""
}

# one_line: stderr of the last command is one line, and stdout is empty.
one_line() {
    lines=$(wc -l <"$work/err")
    if [ "$lines" -ne 1 ]; then fault "$lines lines on stderr instead of one"; fi
    if [ -s "$work/out" ]; then fault "something on stdout"; fi
}

# absent FOLDER NAME: neither NAME nor a hidden folder of a plan being built is in FOLDER.
absent() {
    if [ -e "$1/$2" ]; then fault "$2 was written"; fi
    no_leftovers "$1"
}

# no_leftovers FOLDER: nothing hidden stays.
no_leftovers() {
    if ls -A "$1" | grep -q '^\.'; then fault "left over: $(ls -A "$1" | grep '^\.')"; fi
}

# fingerprint FOLDER: names, contents and times of everything in it.
fingerprint() {
    (cd "$1" && ls -lA --time-style=full-iso && sha256sum ./*)
}

# unchanged FOLDER BEFORE: BEFORE is a file that holds its fingerprint.
unchanged() {
    fingerprint "$1" >"$work/now"
    cmp -s "$work/now" "$2" || fault "$1 has changed"
}

# outcome FOLDER: the outcome that summary.json holds.
outcome() {
    sed -n 's/^.*"outcome":[[:space:]]*"\([a-z]*\)".*$/\1/p' "$1/summary.json" | head -n 1
}
