#!/bin/bash
# run.sh [SECONDS [TARGET...]]: runs the fuzz targets of build-fuzz one after the other (default: all, 600 s each) on the
# shipped files and what is in tests/fuzz/corpora, and tells what came out. Findings are kept in build-fuzz/findings, corpora in
# build-fuzz/corpus; keep.sh packs them.
set -euo pipefail
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
seconds=${1:-600}
shift || true
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(urdf drake yaml motors mjcf sdf usd loops mesh json npz)
build=$root/build-fuzz
bielle=${BIELLE:-$root/build/bin/bielle}
mkdir -p "$build/findings" "$build/seeds"

# Seeds: the robots of the source tree, a small robot's YAML with every key, and a result that the command makes.
if [ ! -e "$build/seeds/done" ]; then
  mkdir -p "$build"/seeds/{urdf,drake,yaml,motors,mjcf,sdf,usd,loops,mesh,json,npz}
  cp "$root"/robots/*/*.urdf "$build/seeds/urdf"
  cp "$root"/robots/*/*.yaml "$root"/tests/fuzz/toy.yaml "$build/seeds/yaml"
  for kind in usda sdf; do cp "$root/tests/fuzz/toy.$kind" "$build/seeds/${kind%a}"; done
  sed 's/^  ak80-9:/  m:/' "$root/robots/motors.yaml" >"$build/seeds/motors/all.yaml"
  printf 'motors: {m: {source: s, ratio: 9, rotor_inertia: 1e-5, torque_constant: 0.1, resistance: 0.2, voltage: 48, current: 20, continuous_current: 9, efficiency: 0.9, back_efficiency: 0.8, mass: 0.5, effort: 10, velocity: 40}}\n' >"$build/seeds/motors/one.yaml"
  # A triangle as STL, binary (a header of 80 bytes, the number of triangles) and text, and as OBJ.
  printf '%80s\1\0\0\0%48s\0\0' '' '' >"$build/seeds/mesh/binary.stl"
  printf 'solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0.5\n' >"$build/seeds/mesh/text.stl"
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0.5\nf 1 2 3\n' >"$build/seeds/mesh/t.obj"
  for robot in fourbar fivebar_leg spring_leg belt_biped; do
    "$bielle" convert "$root/robots/$robot" --to mjcf -o "$build/seeds/mjcf/$robot.xml" >/dev/null 2>&1
    "$bielle" convert "$root/robots/$robot" --to sdf -o "$build/seeds/sdf/$robot.sdf" >/dev/null 2>&1
    "$bielle" convert "$root/robots/$robot" --to usd -o "$build/seeds/usd/$robot.usda" >/dev/null 2>&1
    "$bielle" convert "$root/robots/$robot" --to drake -o "$build/seeds/drake/$robot.urdf" >/dev/null 2>&1
  done
  echo 'closures: [{link_a: hand, link_b: rod, point: [0, 0, 1], axis: [0, 1, 0]}]' >"$build/seeds/loops/hinge.yaml"
  printf 'joints: {shoulder: {passive: false}}\nclosing_joints: [{name: s, type: prismatic, parent: hand, child: rod, origin_xyz_m: [0, 0, 1], origin_rpy_rad: [0, 1, 0], axis: [0, 1, 0]}]\n' >"$build/seeds/loops/slide.yaml"
  printf 'pin_loops: [{name: p, parent: hand, child: rod, parent_xyz: [0, 0, 1], child_xyz: [0, 0, 0], axis: [0, 1, 0]}]\nindependent: [shoulder]\nball_upgrades: [rod_joint]\n' >"$build/seeds/loops/pin.yaml"
  "$bielle" convert "$root/validation/elements/point_spring.yaml" --to mjcf -o "$build/seeds/mjcf/springs.xml" >/dev/null 2>&1
  "$bielle" convert "$root/validation/elements/point_spring.yaml" --to drake -o "$build/seeds/drake/springs.urdf" >/dev/null 2>&1
  "$bielle" solve squat --robot bipetto --depth 0.95 --set duration=0.4 --set settle=0 \
    --set time_step=0.1 --max-iterations 1 --quiet --no-check --no-report -o "$build/seeds/result" >/dev/null || true
  cp "$build/seeds/result/trajectory.npz" "$build/seeds/npz"
  cp "$build/seeds/result/summary.json" "$build/seeds/json"
  echo '{"joints": {"crank1": {"q": 0.5, "v": [0.1]}}, "torques": {"crank1": 3.5}, "contacts": []}' >"$build/seeds/json/state.json"
  touch "$build/seeds/done"
fi

status=0
for target in "${targets[@]}"; do
  mkdir -p "$build/corpus/$target"
  kept=$root/tests/fuzz/corpora/$target.tar.xz
  [ ! -e "$kept" ] || tar -xf "$kept" -C "$build/corpus"
  log=$build/fuzz_$target.log
  dictionary=()
  case $target in
    urdf | drake | yaml | motors) dictionary=("-dict=$root/tests/fuzz/robot.dict") ;;
    mjcf | sdf | usd) dictionary=("-dict=$root/tests/fuzz/$target.dict") ;;
  esac
  if nice "$build/tests/fuzz/fuzz_$target" "$build/corpus/$target" "$build/seeds/$target" -max_total_time="$seconds" \
    -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 -max_len=65536 -print_final_stats=1 \
    -artifact_prefix="$build/findings/$target-" "${dictionary[@]}" >"$log" 2>&1; then
    outcome="nothing found"
  else
    outcome="FOUND, see $log"
    status=1
  fi
  runs=$(awk '/stat::number_of_executed_units/ { print $2 }' "$log")
  echo "$target: ${runs:-?} inputs in ${seconds} s, $(find "$build/corpus/$target" -type f | wc -l) kept: $outcome"
done
exit $status
