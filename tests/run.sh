#!/bin/sh
# Installs what is missing, builds and runs every test: once as users run it, once under the address and undefined behaviour
# sanitizers. Safe to run again. Ends with the summary of the test runner.
set -eu
cd "$(dirname "$0")/.."
. examples/install.sh

# clang-format is left out on purpose: another version formats otherwise; style is checked where version 14 is there.
install_missing $morph_packages libcmocka-dev

# The sanitizers read their options and the threads to examine from /proc. A bare root that lacks it gets it for the time of
# the tests.
if [ ! -r /proc/self/environ ]; then
    if mount -t proc proc /proc; then
        trap 'umount /proc' EXIT
        trap 'exit 1' INT TERM HUP
        echo "Mounted /proc for the sanitizers, until the tests end"
    else
        echo "The sanitizers need /proc: mount it first (mount -t proc proc /proc)"
        exit 1
    fi
fi

# One thread each: two tests run side by side.
export OPENBLAS_NUM_THREADS=1

if command -v clang-format-14 >/dev/null 2>&1; then
    clang-format-14 --dry-run -Werror $(git ls-files '*.c' '*.h' '*.cpp' 2>/dev/null || true)
    echo "Style: clang-format 14 agrees"
fi

build_and_test() {
    mkdir -p "$1"
    cmake -S . -B "$1" -G Ninja -DCMAKE_BUILD_TYPE="$2" -DMORPH_WERROR=ON "-DMORPH_LONG=${MORPH_LONG:-OFF}" >"$1/build.log" 2>&1 || { cat "$1/build.log"; exit 1; }
    cmake --build "$1" >>"$1/build.log" 2>&1 || { cat "$1/build.log"; exit 1; }
    echo "Built $1 ($2)"
    ctest --test-dir "$1" --output-on-failure --no-tests=error -j 2
}

build_and_test build-sanitize Sanitize
build_and_test build Release
