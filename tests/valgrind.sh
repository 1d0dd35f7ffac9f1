#!/bin/sh
# Memcheck on one whole plan: sh tests/valgrind.sh [SCENE]. Not part of run.sh: it takes some minutes, and the sanitizers
# there see nearly the same; what they cannot see is a value that was never set. Ends with 0 if nothing is left but what
# tests/valgrind.supp lists. Only what is definitely or indirectly lost counts as a leak: libraries keep tables to the end.
set -eu
cd "$(dirname "$0")/.."
. examples/install.sh
install_missing $morph_packages valgrind

scene=${1:-examples/scenes/box_4.yaml}
build=build-valgrind
mkdir -p "$build"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_FLAGS=-g -DCMAKE_CXX_FLAGS=-g -DMORPH_TESTS=OFF \
    >"$build/build.log" 2>&1 || { cat "$build/build.log"; exit 1; }
cmake --build "$build" --target morphplan >>"$build/build.log" 2>&1 || { cat "$build/build.log"; exit 1; }

# Solver runs are child processes: each writes a log of its own and ends with 99 on errors, which the planner sees as a
# failed run; so all logs are read, not the exit code alone.
rm -f "$build"/memcheck.*.log
code=0
OPENBLAS_NUM_THREADS=1 valgrind --tool=memcheck --leak-check=full --errors-for-leak-kinds=definite,indirect \
    --show-leak-kinds=definite,indirect --track-origins=yes --num-callers=30 --error-exitcode=99 \
    --suppressions=tests/valgrind.supp --gen-suppressions=all --log-file="$build/memcheck.%p.log" \
    "$build/morphplan" plan "$scene" -o "$build/memcheck.plan" --overwrite || code=$?

logs=$(ls "$build"/memcheck.*.log | wc -l)
bad=$(grep -L 'ERROR SUMMARY: 0 errors' "$build"/memcheck.*.log || true)
if [ -n "$bad" ]; then
    for log in $bad; do cat "$log"; done
    echo "Memcheck: errors in $(echo "$bad" | wc -l) of $logs processes (exit code $code)"
    exit 1
fi
# 3: no feasible plan, which is no fault of memory.
if [ "$code" -ne 0 ] && [ "$code" -ne 3 ]; then
    echo "Memcheck: the program ended with $code"
    exit 1
fi
echo "Memcheck: no errors in $logs processes"
