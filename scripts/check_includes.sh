#!/bin/bash
# check_includes.sh [--all]: compiles sources without precompiled headers, each by itself, so that a file that forgets an include
# is noticed. Without --all it takes those that the last 40 commits touched, and of the others every twelfth, other ones for each
# state of the tree.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
cd "$bielle_root"
turn=0 turns=12
if [ "${1:-}" = --all ]; then turns=1; else turn=$((16#$(git rev-parse "HEAD^{tree}" | head -c 6) % turns)); fi
cmake -S . -B build/includes -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-fsyntax-only -DBIELLE_PRECOMPILE=OFF \
  -DCMAKE_UNITY_BUILD=OFF >/dev/null
# Headers that are generated come first.
if ninja -C build/includes -t query bielle_messages >/dev/null 2>&1; then ninja -C build/includes bielle_messages >/dev/null; fi
git log -40 --name-only --format= -- '*.cpp' >build/includes/touched
ninja -C build/includes -t targets all | awk -F: '/\.cpp\.o:/ {print $1}' | sort |
  awk -v turn="$turn" -v turns="$turns" 'NR == FNR {touched[$0]; next} {file = $0; sub(/CMakeFiles\/[^\/]*\.dir\//, "", file);
    sub(/\.o$/, "", file)} FNR % turns == turn || file in touched' build/includes/touched - >build/includes/objects
echo "includes: $(wc -l <build/includes/objects) files by themselves"
python3 - <<'PROGRAM'
import json, os, subprocess, sys
from concurrent.futures import ThreadPoolExecutor

objects = open("build/includes/objects").read().split()
commands = subprocess.run(["ninja", "-C", "build/includes", "-t", "compdb"], stdout=subprocess.PIPE, text=True, check=True).stdout
commands = {entry["output"]: entry["command"] for entry in json.loads(commands) if entry["output"] in objects}
os.chdir("build/includes")
with ThreadPoolExecutor(os.cpu_count()) as pool:
    statuses = pool.map(lambda name: subprocess.run(commands[name], shell=True).returncode, objects)
sys.exit(any(list(statuses)))
PROGRAM
