#!/bin/sh
# A disk that is full or may not be written: a clear message, exit 1, nothing half-written, the old plan as it was.
. "$(dirname "$0")/program.sh"
if [ -n "$slow" ]; then
    echo "Left out under sanitizers: writing that fails has tests of its own there"
    exit 77
fi
mkdir "$work/disk" && cd "$work" || exit 1

# The pure blanket: as large in the end, and sooner there. Its exit code is 0 or 3 where it can be written.
plan() {
    expect 1 "$program" plan "$scene" --method blanket "$@"
}

# Results on stdout that did not arrive are an error too.
run "$program" info "$scene"
code=0
"$program" info "$scene" >/dev/full 2>"$work/err" || code=$?
holds "a full disk behind stdout: exit 1, not $code" [ "$code" -eq 1 ]
says 'standard output'

if ! mount -t tmpfs -o size=4m tmpfs "$work/disk" 2>/dev/null; then
    echo "No small disk can be mounted here: the cases that need one are left out"
    if [ "$failures" -ne 0 ]; then exit 1; fi
    exit 77
fi
mounted=$work/disk

# Too small for plan.h5, then for schedule.csv, which comes later (8 and 4 MB).
plan -o disk/box.plan
says 'plan.h5: cannot be written: No space left on device'
absent disk box.plan
mount -o remount,size=10m "$mounted"
plan -o disk/box.plan
says 'cannot be written: No space left on device'
absent disk box.plan

# An old plan survives a new one that has no room: the disk holds one plan and a third.
run "$program" plan "$scene" --method blanket -o measured.plan
one=$(du -sk measured.plan | cut -f1)
rm -r measured.plan
mount -o remount,size=$((one * 4 / 3))k "$mounted"
run "$program" plan "$scene" --method blanket -o disk/box.plan
holds "room for one plan" [ -e disk/box.plan/report.html ]
fingerprint disk/box.plan >"$work/before"
plan -o disk/box.plan --overwrite
says 'No space left on device'
unchanged disk/box.plan "$work/before"
no_leftovers disk

# Pictures: whole or not at all.
head -c ${one}000 /dev/zero >disk/ballast 2>/dev/null
expect 1 "$program" picture disk/box.plan -o disk/box.svg
says 'box.svg: cannot be written: No space left on device'
absent disk box.svg
expect 1 "$program" picture disk/box.plan -o disk/box.png
absent disk box.png
rm disk/ballast

# Read-only: said before anything is computed.
mount -o remount,ro "$mounted"
plan -o disk/new.plan
says 'Read-only file system'
if grep -q 'nominal' "$work/err"; then fault "it was said only after the work"; fi
absent disk new.plan
plan -o disk/box.plan --overwrite
says 'Read-only file system'
unchanged disk/box.plan "$work/before"
expect 1 "$program" picture disk/box.plan -o disk/box.png
says 'Read-only file system'
run "$program" check disk/box.plan
holds "a plan is checked where nothing can be written, not exit $code" [ "$code" -eq 0 -o "$code" -eq 3 ]
exit 0
