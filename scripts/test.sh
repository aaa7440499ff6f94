#!/bin/bash
# test.sh [--all]: builds the program and runs the tests that tell whether it is right on this machine: every unit and command, one
# solve of each motion, pages that take seconds. With --all it builds everything and runs the long tests too (tests/tiers.cmake). Installs
# missing packages (Debian 12).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

install_missing "${bielle_packages[@]}" "${bielle_check_packages[@]}" "${bielle_python_packages[@]}" \
  "${bielle_worker_packages[@]}" "${bielle_front_packages[@]}" "${bielle_sdf_packages[@]}" "${bielle_mcap_packages[@]}" \
  "${bielle_step_packages[@]}" "${bielle_mesh_packages[@]}" "${bielle_identify_packages[@]}" "${bielle_dxf_packages[@]}" \
  "${bielle_test_packages[@]}"
cd "$bielle_root"
tier=(--label-exclude '^long$')
bielle_targets=(short_tests)
if [ "${1:-}" = --all ]; then tier=() bielle_targets=(all); fi
build build/test --preset release
run_tests build/test "${tier[@]}"
