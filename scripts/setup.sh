# Functions of the other scripts: packages and builds. To be sourced, after `set -euo pipefail`.
export DEBIAN_FRONTEND=noninteractive
bielle_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# What Bielle is built with, on Debian 12 without anything else; gnuplot draws its figures.
bielle_packages=(g++ cmake ninja-build libeigen3-dev liburdfdom-dev liburdfdom-headers-dev libconsole-bridge-dev
  libtinyxml-dev libyaml-cpp-dev nlohmann-json3-dev libcli11-dev libzip-dev libnlopt-dev
  libnlopt-cxx-dev gnuplot-nox libjs-three libjs-dygraphs)
# What its tests need besides: Catch2, Simbody to compare with, Google Benchmark, Python to read NumPy archives, a browser
# to look at reports.
bielle_test_packages=(catch2 libsimbody-dev libbenchmark-dev python3 chromium pkg-config)

# install_missing PACKAGE...: installs those that dpkg does not know as installed.
install_missing() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "missing packages: ${missing[*]}; install them as root, or install sudo" >&2
      return 1
    fi
    sudo=(sudo DEBIAN_FRONTEND=noninteractive)
  fi
  echo "installing ${missing[*]}"
  if ! apt-cache show "${missing[@]}" >/dev/null 2>&1; then "${sudo[@]}" apt-get update; fi
  # Package lists may be older than the archive.
  "${sudo[@]}" apt-get install -y --no-install-recommends "${missing[@]}" ||
    { "${sudo[@]}" apt-get update && "${sudo[@]}" apt-get install -y --no-install-recommends "${missing[@]}"; }
}

# build DIRECTORY CMAKE_OPTION...: configures and builds with all cores, as far as memory goes (1.5 GB per compiler).
build() {
  local directory=$1 cores memory jobs
  shift
  cmake -S "$bielle_root" -B "$directory" -G Ninja "$@"
  cores=$(nproc)
  memory=$(awk '/^MemAvailable:/ {print int($2 / 1500000)}' /proc/meminfo)
  jobs=$((memory < 1 ? 1 : memory < cores ? memory : cores))
  cmake --build "$directory" --parallel "$jobs"
}
