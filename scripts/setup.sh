# Shared functions of the scripts: installing packages and building. Source this file after `set -euo pipefail`.
export DEBIAN_FRONTEND=noninteractive
bielle_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# Build dependencies on a bare Debian 12; gnuplot draws the figures.
bielle_packages=(g++ cmake ninja-build libeigen3-dev liburdfdom-dev liburdfdom-headers-dev libconsole-bridge-dev
  libtinyxml2-dev libyaml-cpp-dev libmuparser-dev nlohmann-json3-dev libcli11-dev libzip-dev libnlopt-dev
  libnlopt-cxx-dev gnuplot-nox libjs-three libjs-dygraphs)
# Simbody and MuJoCo, against which motions and dynamics are checked.
bielle_check_packages=(libsimbody-dev libmujoco-dev)
# The Python package.
bielle_python_packages=(pybind11-dev python3-dev python3-numpy)
# Work Queue, for tasks on other machines (bielle-workers). Without it everything else is built.
bielle_worker_packages=(coop-computing-tools coop-computing-tools-dev)
# pagmo, for fronts of several objectives (bielle design). Without it everything else is built.
bielle_front_packages=(libpagmo-dev)
# libsdformat, which reads SDF files. Without it everything else is built.
bielle_sdf_packages=(libsdformat-dev)
# Protobuf, which writes MCAP files (bielle export). Without it everything else is built.
bielle_mcap_packages=(libprotobuf-dev protobuf-compiler)
# OpenCASCADE, which writes STEP files (bielle convert). Without it everything else is built.
bielle_step_packages=(libocct-data-exchange-dev libocct-modeling-algorithms-dev libocct-ocaf-dev)
# Ceres, for least squares (bielle identify). Without it everything else is built.
bielle_identify_packages=(libceres-dev)
# assimp, which reads meshes of further kinds. Without it everything else is built.
bielle_mesh_packages=(libassimp-dev)
# ezdxf, which writes DXF files (bielle convert) when it is there. Without it everything else works.
bielle_dxf_packages=(python3-ezdxf)
# DART and ODE, which `bielle-loops` compares with where they are installed; not by the tests: with what DART needs they are
# 120 packages.
bielle_engine_packages=(libdart-dev libode-dev)
# IPOPT, which solves the problems of the suite where it is installed (bielle-ipopt); not by the tests, which skip it then.
bielle_ipopt_packages=(coinor-libipopt-dev)
# Further dependencies of the tests: Catch2, Python to read NumPy archives, a browser for the reports, a locale with a decimal
# comma, what tests the Python package.
bielle_test_packages=(catch2 python3 locales chromium pkg-config python3-pytest
  python3-mypy python3-nbconvert python3-ipykernel python3-matplotlib)

# Another compiler, by which .ci/run compiles a part.
bielle_clang_packages=(clang)

# install_missing PACKAGE...: installs the packages that dpkg does not list as installed.
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
  # The package lists may be out of date.
  "${sudo[@]}" apt-get install -y --no-install-recommends "${missing[@]}" ||
    { "${sudo[@]}" apt-get update && "${sudo[@]}" apt-get install -y --no-install-recommends "${missing[@]}"; }
}

# Objects come out of ccache where somebody has installed it, unless another launcher is asked for. It takes precompiled headers
# into account under these conditions alone, and finds objects of another clone by paths relative to this one.
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER-ccache}
  export CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_BASEDIR=$bielle_root CCACHE_NOHASHDIR=1
fi

# run_tests DIRECTORY CTEST_OPTION...: one test more at once than there are cores, with one thread each: those of signals, workers
# and browsers sleep most of their time.
run_tests() {
  local directory=$1
  shift
  OMP_NUM_THREADS=1 ctest --test-dir "$directory" --parallel "$(($(nproc) + 1))" --output-on-failure "$@"
}

# build DIRECTORY CMAKE_OPTION...: configures, then builds `bielle_targets` (default: everything) on as many cores as memory
# allows, at 1.5 GB per compiler. Several files are compiled at once, which takes half the time; while working on one file, a build
# without it (cmake --preset release) is the quicker one.
bielle_targets=(all)
build() {
  local directory=$1 cores memory jobs
  shift
  cmake -S "$bielle_root" -B "$directory" -G Ninja -DCMAKE_UNITY_BUILD=ON "$@"
  cores=$(nproc)
  memory=$(awk '/^MemAvailable:/ {print int($2 / 1500000)}' /proc/meminfo)
  jobs=$((memory < 1 ? 1 : memory < cores ? memory : cores))
  cmake --build "$directory" --parallel "$jobs" --target "${bielle_targets[@]}"
}
