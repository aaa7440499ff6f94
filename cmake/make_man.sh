#!/bin/sh
# make_man.sh BIELLE VERSION DIRECTORY: a manual page for the command and for each of its subcommands, from their --help.
set -eu
program=$1 version=$2 directory=$3
format=$(dirname "$0")/help_to_man.awk

# subcommands WORD...: those that its help lists
subcommands() {
  "$program" "$@" --help | awk '$0 == "Subcommands:" { inside = 1; next } /^[^ ]/ || /^$/ { inside = 0 }
                                inside && /^  [^ ]/ { print $1 }'
}

# page WORD...: its page and those below it, each call with variables of its own
page() (
  name=bielle
  for word in "$@"; do name=$name-$word; done
  parent=${name%-"${word:-}"}
  "$program" "$@" --help >/dev/null 2>&1 || return 0  # a program beside `bielle` that was not built
  below=$(subcommands "$@")
  related=
  if [ $# -gt 0 ]; then related=$parent; fi
  for command in $below; do related="$related $name-$command"; done
  "$program" "$@" --help | awk -v name="$name" -v version="$version" -v command="bielle${*:+ $*}" \
    -v related="$related" -f "$format" >"$directory/$name.1"
  for command in $below; do page "$@" "$command"; done
)

mkdir -p "$directory"
rm -f "$directory"/*.1
page
