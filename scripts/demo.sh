#!/bin/bash
# Builds the core of Bielle, makes Bipetto squat, then checks the motion against Simbody. Installs missing packages (Debian 12).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

install_missing "${bielle_packages[@]}" "${bielle_check_packages[@]}"
cd "$bielle_root"
bielle_targets=(bielle_command)  # which builds its companions when they are first asked for
build build/demo -DCMAKE_BUILD_TYPE=Release -DBIELLE_BUILD_TESTS=OFF -DBIELLE_BUILD_EXAMPLES=OFF
bielle=build/demo/bin/bielle
"$bielle" solve squat --robot bipetto --depth 0.7 --no-check -o demo/squat
echo
echo "Open $bielle_root/demo/squat/report.html in a browser to see the motion."
echo "Beside it are trajectory.csv, trajectory.npz (NumPy) and summary.json."
echo
echo "Now the program is built that checks the motion against Simbody."
"$bielle" check --brief demo/squat
"$bielle" report demo/squat >/dev/null  # with the rows of the check
echo "The page has the check now, too. The command is $bielle_root/$bielle; try it with --help."
