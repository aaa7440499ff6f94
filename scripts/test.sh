#!/bin/bash
# Builds everything and runs every test. Installs missing packages (Debian 12).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

install_missing "${bielle_packages[@]}" "${bielle_check_packages[@]}" "${bielle_python_packages[@]}" \
  "${bielle_worker_packages[@]}" "${bielle_front_packages[@]}" "${bielle_sdf_packages[@]}" "${bielle_mcap_packages[@]}" \
  "${bielle_step_packages[@]}" "${bielle_mesh_packages[@]}" "${bielle_dxf_packages[@]}" "${bielle_test_packages[@]}"
cd "$bielle_root"
build build/test --preset release
run_tests build/test
