#!/usr/bin/env python3
"""Writes docs/results/rooms.md: lines of the product by room, today and at an earlier commit.

    docs/results/rooms.py [REVISION]

Needs the history. `--quick` prints the page.
"""
import collections
import re
import subprocess

import common

FOLDERS = ("include", "src", "validation", "workers", "python/src")
# Every language: what moves from one into another is not saved.
KINDS = (".h", ".cpp", ".py", ".js", ".html", ".proto", ".in")
REVISION = "3bf0e583"
TODAY = "HEAD"
GOAL = 0.9


def call(*command):
    return subprocess.run(["git", *command], cwd=common.SOURCE, capture_output=True, check=True, text=True).stdout.splitlines()


def find_room(path):
    """`include/bielle/ocp/cost.h` and `src/ocp/cost.cpp` are in the room `ocp`; None for what is no product."""
    if not path.endswith(KINDS) or not path.startswith(tuple(folder + "/" for folder in FOLDERS)):
        return None
    room = re.match(r"(?:include/bielle|src)/(\w+)/", path)
    return room[1] if room else path.split("/")[0]


def count_lines(revision):
    """{path: lines} of the product."""
    rows = (row.rsplit(":", 2)[1:] for row in call("grep", "-c", "", revision, "--", *FOLDERS))
    return {path: int(lines) for path, lines in rows if find_room(path)}


def add_up(lines, paths):
    rooms = collections.Counter()
    for path in paths:
        rooms[find_room(path)] += lines[path]
    return rooms


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("revision", nargs="?", default=REVISION, metavar="REVISION", help="default: %(default)s")
    arguments = parser.parse_args()
    before, today = count_lines(arguments.revision), count_lines(TODAY)
    added = [row.split("\t")[1] for row in call("diff", "-M", "--diff-filter=A", "--name-status", arguments.revision, TODAY)]
    new = [path for path in added if path in today]
    then, now, apart = add_up(before, before), add_up(today, today), add_up(today, new)
    page = common.Page(__file__, "Lines by room", common.describe_run(arguments.commit))
    page.add(f"Lines of {', '.join(FOLDERS)}, comments included, of the kinds {' '.join(KINDS)}. New are files that "
             f"`{arguments.revision}` does not have under any name.")
    rows = [(room, then[room], now[room], apart[room]) for room in sorted(set(then) | set(now))]
    rows.append(("all", sum(then.values()), sum(now.values()), sum(apart.values())))
    page.table(["room", f"`{arguments.revision}`", "today", "in new files"], [list(map(str, row)) for row in rows])
    _, lines_then, lines_now, lines_new = rows[-1]
    page.add(f"The goal is {GOAL} of the lines: all of today are {lines_now / lines_then:.3f} of them, those of files that existed "
             f"{(lines_now - lines_new) / lines_then:.3f}.")
    page.add("New files: " + (", ".join(f"`{path}` {today[path]}" for path in sorted(new)) or "none") + ".")
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
