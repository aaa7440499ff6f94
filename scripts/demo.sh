#!/bin/bash
# Builds Bielle and makes Bipetto squat. Installs what is missing (Debian 12).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

install_missing "${bielle_packages[@]}"
cd "$bielle_root"
build build/demo -DCMAKE_BUILD_TYPE=Release -DBIELLE_BUILD_TESTS=OFF -DBIELLE_BUILD_EXAMPLES=OFF \
  -DBIELLE_BUILD_VALIDATION=OFF -DBIELLE_BUILD_BENCHMARKS=OFF
build/demo/bin/bielle solve squat --robot bipetto --depth 0.7 -o demo/squat
echo
echo "Look at it: open $bielle_root/demo/squat/report.html with a browser."
echo "Beside it: trajectory.csv, trajectory.npz (NumPy) and summary.json."
echo "The command is $bielle_root/build/demo/bin/bielle; try it with --help."
