#!/bin/bash
# Makes the Debian packages `bielle`, `libbielle0.1`, `libbielle-dev`, `python3-bielle` and `bielle-workers` in
# build-package. Installs what is missing (Debian 12).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

install_missing "${bielle_packages[@]}" "${bielle_check_packages[@]}" "${bielle_python_packages[@]}" \
  "${bielle_worker_packages[@]}" "${bielle_front_packages[@]}" "${bielle_sdf_packages[@]}" "${bielle_mcap_packages[@]}" \
  "${bielle_step_packages[@]}" "${bielle_mesh_packages[@]}" dpkg-dev file
cd "$bielle_root"
build build-package --preset package
cd build-package
cpack -G DEB
ls -l "$PWD"/*.deb
