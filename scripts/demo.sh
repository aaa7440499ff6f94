#!/bin/bash
# Builds Bielle, makes Bipetto squat and checks the motion. Installs missing packages (Debian 12).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

install_missing "${bielle_packages[@]}" "${bielle_check_packages[@]}"
cd "$bielle_root"
bielle_targets=(bielle_command bielle-check)  # the command builds bielle-simulate when it is first asked for
build build/demo -DCMAKE_BUILD_TYPE=Release -DBIELLE_BUILD_TESTS=OFF -DBIELLE_BUILD_EXAMPLES=OFF
build/demo/bin/bielle solve squat --robot bipetto --depth 0.7 -o demo/squat
echo
echo "Open $bielle_root/demo/squat/report.html in a browser to see the motion."
echo "Beside it are trajectory.csv, trajectory.npz (NumPy), summary.json and check.json."
echo "The command is $bielle_root/build/demo/bin/bielle; try it with --help."
