#!/bin/bash
# update_help.sh [BIN]: writes src/cli/help, the help of the companions' commands, from the programs in BIN (default: build/test/bin). The
# core prints these texts where a companion is not there; the test `help` compares them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bin=${1:-build/test/bin}

rm -f src/cli/help/*.txt
for command in check simulate validate; do "$bin/bielle-$command" --help >"src/cli/help/$command.txt"; done
while read -r program command; do "$bin/$program" "$command" --help >"src/cli/help/$command.txt"; done <<'END'
bielle-bench bench
bielle-complete adopt
bielle-complete convert
bielle-complete eval
bielle-complete export
bielle-complete generate
bielle-complete lift
bielle-complete modes
bielle-complete ratio
bielle-complete view
bielle-design design
bielle-design synthesize
bielle-tasks campaign
bielle-tasks compare
bielle-tasks dataset
END
# The robots that `bielle generate --help` lists, each with its parameters.
sed -n '/^Robots:/,/^Examples:/s/^  \([^ ]*\).*/\1/p' src/cli/help/generate.txt | while read -r robot; do
  "$bin/bielle-complete" generate "$robot" --help >"src/cli/help/generate-$robot.txt"
done
