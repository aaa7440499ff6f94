#!/bin/bash
# try_package.sh [DIRECTORY]: installs the packages of scripts/package.sh on a bare Debian 12, made by debootstrap in the
# directory (default: a temporary one, removed at the end), and runs what they bring. As root.
set -euo pipefail
packages=$(cd "$(dirname "${BASH_SOURCE[0]}")/../build-package" && pwd)
mirror=${MIRROR:-http://deb.debian.org/debian}

bare=${1:-}
if [ -z "$bare" ]; then
  bare=$(mktemp -d)
  trap 'umount "$bare/proc" 2>/dev/null || true; rm -rf --one-file-system "$bare"' EXIT
fi
[ -e "$bare/bin/bash" ] || debootstrap --variant=minbase bookworm "$bare" "$mirror"
mountpoint -q "$bare/proc" || mount -t proc proc "$bare/proc"
cp "$packages"/*.deb "$bare/tmp"
cp /etc/resolv.conf "$bare/etc"

inside() { chroot "$bare" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive "$@"; }
inside apt-get update -qq
inside sh -ec 'apt-get install -qq -y --no-install-recommends /tmp/bielle_*.deb /tmp/libbielle0.1_*.deb'
inside sh -ec '
  cd /tmp
  bielle --version
  bielle robots
  bielle info fourbar
  bielle solve squat --robot bipetto --depth 0.7 --quiet -o squat
  bielle check --brief squat
  bielle bench --quick
  bielle validate fourbar
  test -s squat/report.html
  test -e /usr/share/bash-completion/completions/bielle'
# The library, used by a program that knows pkg-config alone.
inside sh -ec 'apt-get install -qq -y --no-install-recommends /tmp/libbielle-dev_*.deb g++ pkg-config'
cat > "$bare/tmp/main.cpp" <<'PROGRAM'
#include <bielle/formats/reader.h>
#include <cstdio>
int main() { std::printf("%d motors\n", bielle::loadRobot("bipetto").model.nu()); }
PROGRAM
inside sh -ec 'cd /tmp; g++ -O1 main.cpp $(pkg-config --cflags --libs bielle) -o main; ./main | grep "12 motors"'
# The Python package: worlds of three engines, a cost written in Python, the programs.
inside sh -ec 'apt-get install -qq -y --no-install-recommends /tmp/python3-bielle_*.deb'
cat > "$bare/tmp/page.py" <<'PROGRAM'
import bielle, numpy as np, pickle
squat = bielle.solve_squat("bipetto", depth=0.7)
assert squat.converged and bielle.check(squat)["pass"]
assert pickle.loads(pickle.dumps(squat)) == squat
model = bielle.load_robot("bipetto").model
for engine in ("bielle", "simbody", "mujoco"):
    world = bielle.World(model, engine=engine)
    world.reset(model.standing(), np.zeros(model.nv))
    assert world.step(np.zeros(model.nu), 0.01).ok
assert "<iframe" in squat._repr_html_()
assert not bielle.simulate(squat, world="bielle", control="gains")["fell"]
print("python3-bielle", *squat.goals)
PROGRAM
inside sh -ec 'cd /tmp; python3 page.py'
# Workers, which are a package of their own.
inside sh -ec 'apt-get install -qq -y --no-install-recommends /tmp/bielle-workers_*.deb coop-computing-tools'
cat > "$bare/tmp/grid.yaml" <<'GRID'
motions: squat
options:
  seed: [1, 2]
GRID
inside sh -ec '
  cd /tmp
  echo secret > password
  bielle campaign grid.yaml -o grid --workers 9123 --password password &
  work_queue_worker --password password --connect-timeout 60 --single-shot 127.0.0.1 9123
  wait $!
  grep "2 runs: 2 stood" grid/campaign.md
  grep "GNU General Public" /usr/share/doc/bielle-workers/copyright'
umount "$bare/proc"
echo "the packages install and run on a bare machine"
