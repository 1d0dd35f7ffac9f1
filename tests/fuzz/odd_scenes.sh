#!/bin/sh
# Odd but legal (or nearly legal) scenes through the whole program: odd_scenes.sh PROGRAM [NAME_PATTERN]
#
# Each must end within $MORPH_SECONDS of processor time (default 120) with 0, 2 or 3, say why on 2 and 3, leave a plan folder on
# 0 and 3 and none on 2, with no "nan" or "inf" in its summary; `check` must agree with the plan's own verdict. One line a
# scene, times in processor seconds; exit 1 if any fails. Folders stand in $MORPH_KEEP if that is set, else they are removed.
set -u
program=${1:?usage: odd_scenes.sh PROGRAM [NAME_PATTERN]}
pattern=${2:-*}
seconds=${MORPH_SECONDS:-120}
work=${MORPH_KEEP:-$(mktemp -d)}
mkdir -p "$work"
[ -n "${MORPH_KEEP:-}" ] || trap 'rm -rf "$work"' EXIT
failures=0
scenes=0

# run ARGUMENTS: the program within its time; processor seconds to the file "times".
run() {
    (
        ulimit -t "$seconds"
        timeout -k 10 $((4 * seconds)) "$program" "$@"
        code=$?
        times >"$work/times"
        exit $code
    )
}

# odd NAME TEXT: runs the scene TEXT and judges what comes out.
odd() {
    name=$1
    printf '%s\n' "$2" >"$work/$name.yaml"
    case $name in $pattern) ;; *) return ;; esac
    scenes=$((scenes + 1))
    folder=$work/$name.plan
    rm -rf "$folder"
    run plan "$work/$name.yaml" -o "$folder" --quiet >"$work/$name.out" 2>"$work/$name.err"
    code=$?
    took=$(awk -F'[ms ]+' 'NR == 2 {print 60 * $1 + $2 + 60 * $3 + $4}' "$work/times")
    fault=
    case $code in
    0) [ -d "$folder" ] || fault="no folder" ;;
    2) [ ! -e "$folder" ] || fault="a folder after wrong input" ;;
    3) [ -d "$folder" ] || fault="no folder" ;;
    4 | 124 | 137 | 152) fault="longer than $seconds s" ;;
    *) fault="exit code $code" ;;
    esac
    [ "$code" = 0 ] || [ -s "$work/$name.err" ] || fault="$fault, no message"
    if grep -q "runtime error\|Sanitizer" "$work/$name.err"; then fault="$fault, sanitizer report"; fi
    if grep -qi "[^a-z]nan[^a-z]\|[^a-z]inf[^a-z]" "$work/$name.out"; then fault="$fault, not a number in the outcome"; fi
    if [ -d "$folder" ]; then
        grep -qi "[^a-z]nan[^a-z]\|[^a-z]inf[^a-z]" "$folder/summary.json" && fault="$fault, not a number in summary.json"
        run check "$folder" >"$work/$name.check" 2>&1
        checked=$?
        # A duration that cannot be met, or that cannot be written at its sample time, is no finding of the check.
        if [ "$checked" != "$code" ] && ! { [ "$checked$code" = 03 ] && grep -q 'schedule\.duration\|schedule\.sample: ' "$work/$name.err"; }; then
            fault="$fault, check says $checked"
        fi
    fi
    verdict=ok
    [ -z "$fault" ] || { verdict="FAILED: $fault"; failures=$((failures + 1)); }
    said=$(sed -n '/./{p;q;}' "$work/$name.err" | cut -c1-150)
    printf '%-22s %6.2f s  exit %-3d %s  [%s]\n' "$name" "$took" "$code" "$verdict" "${said#"$work"/}"
}

# scene NODES EXTRA_STRUCTURE TARGET REST: a scene text with spacing 0.1.
scene() {
    printf 'morphplan: 1\nstructure:\n  nodes: %s\n  spacing: 0.1\n%s\ntarget:\n%s\n%s\n' "$1" "$2" "$3" "$4"
}
soft='  link: {stiffness: 20}'
box='  shape: box
  size: [0.15, 0.15, 0.09]'
calm='motion: {friction: 0.4}'

# Targets.
odd target_beside "$(scene '[4, 4]' "$soft" "$box
  at: [5, 0, 0.045]" "$calm")"
odd target_at_border "$(scene '[4, 4]' "$soft" "$box
  at: [0.3, 0, 0.045]" "$calm")"
odd target_high "$(scene '[4, 4]' "$soft" "$box
  at: [0, 0, 5]" "$calm")"
odd target_below_base "$(scene '[4, 4]' "$soft" "$box
  at: [0, 0, -5]" "$calm")"
odd target_partly_below "$(scene '[4, 4]' "$soft" "$box
  at: [0, 0, 0.02]" "$calm")"
odd target_larger "$(scene '[4, 4]' "$soft" '  shape: box
  size: [3, 3, 1]' "$calm")"
odd target_huge_sphere "$(scene '[4, 4]' "$soft" '  shape: sphere
  radius: 2' "$calm")"
odd target_speck "$(scene '[4, 4]' "$soft" '  shape: box
  size: [0.001, 0.001, 0.001]' "$calm")"
odd target_foil "$(scene '[4, 4]' "$soft" '  shape: box
  size: [0.2, 0.2, 0.0001]' "$calm")"
odd target_blade "$(scene '[4, 4]' "$soft" '  shape: box
  size: [0.001, 0.2, 0.15]' "$calm")"
odd target_needle "$(scene '[4, 4]' "$soft" '  shape: box
  size: [0.005, 0.005, 0.3]' "$calm")"
printf 'v 0 0 0\nv 0.2 0 0\nv 0 0.2 0.05\nf 1 2 3\n' >"$work/one.obj"
odd target_one_triangle "$(scene '[4, 4]' "$soft" '  shape: mesh
  file: one.obj' "$calm")"
printf 'v 0 0 0\nv 0.2 0 0\nv 0.1 0 0.1\nf 1 2 3\n' >"$work/upright.obj"
odd target_upright_triangle "$(scene '[4, 4]' "$soft" '  shape: mesh
  file: upright.obj' "$calm")"
printf 'v 0 0 0\nv 0.2 0 0\nv 0.2 0.2 0\nv 0 0.2 0\nf 1 2 3\nf 1 3 4\n' >"$work/plate.obj"
odd target_plate "$(scene '[4, 4]' "$soft" '  shape: mesh
  file: plate.obj
  at: [0, 0, 0.05]' "$calm")"
odd target_on_corner "$(scene '[4, 4]' "$soft" "$box
  rotate: [45, 35.26, 0]" "$calm")"

# Sizes.
odd nodes_2x2 "$(scene '[2, 2]' "$soft" '  shape: box
  size: [0.04, 0.04, 0.04]' "$calm")"
odd nodes_2x16 "$(scene '[2, 16]' "$soft" "$box" "$calm")"
odd nodes_16x2 "$(scene '[16, 2]' "$soft" "$box" "$calm")"
scaled() { # SPACING SIZE HEIGHT GRAVITY
    printf 'morphplan: 1\nstructure: {nodes: [4, 4], spacing: %s, link: {stiffness: 20}}\n' "$1"
    printf 'target: {shape: box, size: [%s, %s, %s]}\nmotion: {friction: 0.4, gravity: %s}\n' "$2" "$2" "$3" "$4"
}
odd spacing_tiny "$(scaled 1e-5 1.5e-5 0.9e-5 9.81e-4)"
odd spacing_huge "$(scaled 1e3 1.5e3 0.9e3 9.81e4)"
odd spacing_tiny_earth "$(scaled 1e-5 1.5e-5 0.9e-5 9.81)"
odd spacing_huge_earth "$(scaled 1e3 1.5e3 0.9e3 9.81)"
odd spacing_least "$(scaled 1e-6 1.5e-6 0.9e-6 9.81e-5)"
odd spacing_most "$(scaled 1e6 1.5e6 0.9e6 9.81e7)"

# Structures.
odd thickness_thin "$(scene '[4, 4]' '  thickness: 1e-4
  link: {stiffness: 20, radius: 2e-5}' "$box" "$calm")"
odd thickness_thick "$(scene '[4, 4]' '  thickness: 0.5
  link: {stiffness: 20}' "$box" "$calm")"
odd radius_0 "$(scene '[4, 4]' '  link: {stiffness: 20, radius: 1e-9}' "$box" "$calm")"
odd radius_most "$(scene '[4, 4]' '  link: {stiffness: 20, radius: 0.0249}' "$box" "$calm")"
odd length_fixed "$(scene '[4, 4]' '  link: {stiffness: 20, length: [0.1, 0.1]}' "$box" "$calm")"
odd length_from_start "$(scene '[4, 4]' '  link: {stiffness: 20, length: [0.1, 0.12]}' "$box" "$calm")"
odd length_bottom_fixed "$(scene '[4, 4]' '  link: {stiffness: 20, length: {bottom: [0.1, 0.1]}}' "$box" "$calm")"
odd length_wide "$(scene '[4, 4]' '  link: {stiffness: 20, length: [0.0001, 100]}' "$box" "$calm")"
odd angle_post_fixed "$(scene '[4, 4]' '  link: {stiffness: 20}
  angle: {link_post: [90, 90]}' "$box" "$calm")"
odd angle_narrow "$(scene '[4, 4]' '  link: {stiffness: 20}
  angle: {link_post: [89.9, 90.1], link_link: [89.9, 90.1]}' "$box" "$calm")"
odd angle_free "$(scene '[4, 4]' '  link: {stiffness: 20}
  angle: {link_post: [0, 180], link_link: [0, 180]}' "$box" "$calm")"
odd angle_from_start "$(scene '[4, 4]' '  link: {stiffness: 20}
  angle: {link_link: [90, 130]}' "$box" "$calm")"
odd stiffness_large "$(scene '[4, 4]' '  link: {stiffness: 1e6}' "$box" "$calm")"
odd stiffness_small "$(scene '[4, 4]' '  link: {stiffness: 1e-6}' "$box" "$calm")"
odd mass_small "$(scene '[4, 4]' '  mass: 1e-6
  link: {stiffness: 20}' "$box" "$calm")"
odd mass_large "$(scene '[4, 4]' '  mass: 1e6
  link: {stiffness: 20}' "$box" "$calm")"
odd damping_0 "$(scene '[4, 4]' '  link: {stiffness: 20, damping: 0}' "$box" "$calm")"
odd damping_large "$(scene '[4, 4]' '  link: {stiffness: 20, damping: 1000}' "$box" "$calm")"
odd rate_small "$(scene '[4, 4]' '  link: {stiffness: 20, rate: 1e-5}' "$box" 'schedule: {sample: 0.1}')"
odd rate_small_1ms "$(scene '[4, 4]' '  link: {stiffness: 20, rate: 1e-5}' "$box" "$calm")"
odd rate_large "$(scene '[4, 4]' '  link: {stiffness: 20, rate: 1e6, acceleration: 1e6, jerk: 1e6}' "$box" "$calm")"
odd jerk_small "$(scene '[4, 4]' '  link: {stiffness: 20, jerk: 1e-6}' "$box" "$calm")"

# Motion, base, schedule.
odd base_none "$(scene '[4, 4]' "$soft" "$box" 'base: none')"
odd base_in_target "$(scene '[4, 4]' "$soft" "$box" 'base: 0.05')"
odd base_below "$(scene '[4, 4]' "$soft" "$box" 'base: -1')"
odd gravity_0 "$(scene '[4, 4]' "$soft" "$box" 'motion: {gravity: 0}')"
odd gravity_large "$(scene '[4, 4]' "$soft" "$box" 'motion: {gravity: 1000}')"
odd height_0 "$(scene '[4, 4]' "$soft" "$box" 'motion: {height: 0}')"
odd height_radius "$(scene '[4, 4]' "$soft" "$box" 'motion: {height: 0.004}')"
odd height_large "$(scene '[4, 4]' "$soft" "$box" 'motion: {height: 10}')"
odd time_short "$(scene '[4, 4]' "$soft" "$box" 'motion: {time: 0.01}')"
odd friction_0 "$(scene '[4, 4]' "$soft" "$box" 'motion: {friction: 0}')"
odd friction_10 "$(scene '[4, 4]' "$soft" "$box" 'motion: {friction: 10}')"
odd drag_0 "$(scene '[4, 4]' "$soft" "$box" 'motion: {drag: 0, friction: 0}')"
odd drag_large "$(scene '[4, 4]' "$soft" "$box" 'motion: {drag: 1000}')"
odd sample_coarse "$(scene '[4, 4]' "$soft" "$box" 'schedule: {sample: 0.1}')"
odd sample_fine "$(scene '[4, 4]' "$soft" "$box" 'schedule: {sample: 1e-5}')"
odd duration_60 "$(scene '[4, 4]' "$soft" "$box" 'schedule: {duration: 60}')"
odd duration_short "$(scene '[4, 4]' "$soft" "$box" 'schedule: {duration: 0.01}')"
odd duration_one_sample "$(scene '[4, 4]' "$soft" "$box" 'schedule: {duration: 0.001}')"

echo "$scenes scenes, $failures failed"
[ "$failures" = 0 ]
