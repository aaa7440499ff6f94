#!/bin/bash
# update_help.sh [BIELLE]: writes what the programs say of themselves: src/cli/help, the help of the companions' commands, which the
# core prints where a companion is not there, and the table of docs/keys.md. BIELLE (default: build/test/bin/bielle) has all of them
# beside it. The tests `companions` and `keys` compare.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bielle=${1:-build/test/bin/bielle}

rm -f src/cli/help/*.txt
"$bielle" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p' | grep -vxE 'solve|report|info|robots' | while read -r command; do
  "$bielle" "$command" --help >"src/cli/help/$command.txt"
done
# The robots that `bielle generate --help` lists, each with its parameters.
sed -n '/^Robots:/,/^Examples:/s/^  \([^ ]*\).*/\1/p' src/cli/help/generate.txt | while read -r robot; do
  "$bielle" generate "$robot" --help >"src/cli/help/generate-$robot.txt"
done

sed -i '/^| .*`/d' docs/keys.md  # its rows
for part in "" -complete -design -tasks -simulate; do "$bielle$part" --yaml-keys; done | LC_ALL=C sort -u >>docs/keys.md
