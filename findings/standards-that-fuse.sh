#!/bin/bash
# `-std=c99` keeps GCC from fusing multiplications with additions in C. It does not keep Clang from it, nor does any standard keep
# GCC in C++: the same source gives other bits on a Cortex-M and on an aarch64 than where nothing can be fused.
#
# Seen with GCC 12.2 (Debian 12, gcc-arm-none-eabi 15:12.2.rel1-1) for a Cortex-M4F and Clang 14.0.6 (Debian 12, 1:14.0.6-12) for a
# Cortex-M7 and for aarch64, both with -O2, on `a * b + c` in float:
# - C: GCC fuses with gnu99, not with c99; Clang fuses with both;
# - C++: both fuse with c++11 as with gnu++11;
# - `#pragma STDC FP_CONTRACT OFF`, the way of the standards, keeps Clang from it, and GCC ignores it (-Wall says so), also in C;
#   `#pragma GCC optimize("fp-contract=off")` keeps GCC from it;
# - the option -ffp-contract=off keeps both; but -ffp-contract=fast overrules Clang's pragma, not GCC's.
# Clang does not fuse for a Cortex-M4F, where that takes longer: a test on this processor alone does not notice.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq gcc-arm-none-eabi=15:12.2.rel1-1 clang-14=1:14.0.6-12 libclang-cpp14=1:14.0.6-12 libllvm14=1:14.0.6-12
for package in *.deb; do dpkg -x "$package" root; done
export LD_LIBRARY_PATH=$PWD/root/usr/lib/x86_64-linux-gnu:$PWD/root/usr/lib/llvm-14/lib
gcc=(root/usr/bin/arm-none-eabi-gcc -mthumb -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard)
clang=(root/usr/lib/llvm-14/bin/clang --target=arm-none-eabi -mfloat-abi=hard)

# Words for the line; pragma; then the compiler and its options.
tell() {
  local words=$1 pragma=$2
  shift 2
  printf '%s\nfloat calc(float a, float b, float c) { return a * b + c; }\n' "$pragma" | "$@" -O2 -w -S - -o code.s
  echo "$words: $(grep -qE 'vfma|fmadd' code.s && echo fused || echo apart)"
}
standard_pragma='#pragma STDC FP_CONTRACT OFF' gcc_pragma='#pragma GCC optimize("fp-contract=off")'
for way in "c c99" "c gnu99" "c++ c++11" "c++ gnu++11"; do
  read -r language standard <<< "$way"
  as=(-x "$language" "-std=$standard")
  tell "$standard, GCC, Cortex-M4F" "" "${gcc[@]}" "${as[@]}"
  tell "$standard, Clang, Cortex-M7" "" "${clang[@]}" -mcpu=cortex-m7 "${as[@]}"
  tell "$standard, Clang, aarch64" "" "${clang[0]}" --target=aarch64-linux-gnu "${as[@]}"
done | tee seen
{
  tell "c99, Clang, Cortex-M4F" "" "${clang[@]}" -mcpu=cortex-m4 -x c -std=c99
  for language in c c++; do
    tell "$language, GCC, standard pragma" "$standard_pragma" "${gcc[@]}" -x $language
    tell "$language, GCC, its pragma" "$gcc_pragma" "${gcc[@]}" -x $language -ffp-contract=fast
    tell "$language, GCC, option" "" "${gcc[@]}" -x $language -ffp-contract=off
    tell "$language, Clang, standard pragma" "$standard_pragma" "${clang[@]}" -mcpu=cortex-m7 -x $language
    tell "$language, Clang, the same and fast" "$standard_pragma" "${clang[@]}" -mcpu=cortex-m7 -x $language -ffp-contract=fast
    tell "$language, Clang, option" "" "${clang[@]}" -mcpu=cortex-m7 -x $language -ffp-contract=off
  done
} | tee -a seen
cat > expected <<'TEXT'
c99, GCC, Cortex-M4F: apart
c99, Clang, Cortex-M7: fused
c99, Clang, aarch64: fused
gnu99, GCC, Cortex-M4F: fused
gnu99, Clang, Cortex-M7: fused
gnu99, Clang, aarch64: fused
c++11, GCC, Cortex-M4F: fused
c++11, Clang, Cortex-M7: fused
c++11, Clang, aarch64: fused
gnu++11, GCC, Cortex-M4F: fused
gnu++11, Clang, Cortex-M7: fused
gnu++11, Clang, aarch64: fused
c99, Clang, Cortex-M4F: apart
c, GCC, standard pragma: fused
c, GCC, its pragma: apart
c, GCC, option: apart
c, Clang, standard pragma: apart
c, Clang, the same and fast: fused
c, Clang, option: apart
c++, GCC, standard pragma: fused
c++, GCC, its pragma: apart
c++, GCC, option: apart
c++, Clang, standard pragma: apart
c++, Clang, the same and fast: fused
c++, Clang, option: apart
TEXT
diff expected seen && echo "as described"
