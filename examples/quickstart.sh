#!/bin/sh
# Installs what is missing, builds morphplan, plans a morph over a shape and says where its report is. Safe to run again.
set -eu
cd "$(dirname "$0")/.."
. examples/install.sh

install_missing $morph_packages

mkdir -p build
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release >build/build.log 2>&1 || { cat build/build.log; exit 1; }
cmake --build build --target morphplan >>build/build.log 2>&1 || { cat build/build.log; exit 1; }
echo "Built build/morphplan"

build/morphplan plan examples/scenes/sphere_8.yaml -o build/quickstart.plan --overwrite
build/morphplan picture build/quickstart.plan -o build/quickstart.png
echo
echo "Report:  build/quickstart.plan/report.html (open it in a browser)"
echo "Picture: build/quickstart.png"
echo "Lengths: build/quickstart.plan/schedule.csv"
