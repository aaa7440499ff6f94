#!/bin/bash
# keep.sh TARGET...: packs what the runs of these targets have found into tests/fuzz/corpora, as few inputs as reach the same
# code; run.sh begins with them. Take out of the archive what a library would not survive without our guards.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$root/build-fuzz
mkdir -p "$root/tests/fuzz/corpora"
for target in "$@"; do
  rm -rf "$build/kept"
  mkdir -p "$build/kept/$target"
  "$build/tests/fuzz/fuzz_$target" -merge=1 -max_len=65536 "$build/kept/$target" "$build/corpus/$target" >"$build/keep_$target.log" 2>&1
  tar --sort=name --owner=0 --group=0 --mtime=@0 -C "$build/kept" -c "$target" | xz -9 >"$root/tests/fuzz/corpora/$target.tar.xz"
  echo "$target: $(find "$build/kept/$target" -type f | wc -l) inputs, $(stat -c %s "$root/tests/fuzz/corpora/$target.tar.xz") bytes"
done
