#!/usr/bin/env python3
"""Writes docs/results/rooms.md: lines of the product by room, today and at earlier commits.

    docs/results/rooms.py [REVISION ...]

Needs the history. `--quick` prints the page.
"""
import collections
import io
import re
import subprocess
import tarfile

import common

FOLDERS = ("include", "src", "python", "workers", "engines", "simulation")
KINDS = (".h", ".cpp", ".js", ".css", ".html", ".in", ".proto", ".py", ".pyi")
ROBOTS = (".urdf", ".yaml", ".xml")
REVISIONS = ["fba40b6", "8efbeb57"]
TODAY = "HEAD"


def find_room(path):
    """`include/bielle/ocp/cost.h` and `src/ocp/cost.cpp` are in the room `ocp`; None for what is no product."""
    if path.startswith("robots/") and path.endswith(ROBOTS):
        return "files of robots"
    if not path.endswith(KINDS) or not path.startswith(tuple(folder + "/" for folder in FOLDERS)):
        return None
    room = re.match(r"(?:include/bielle|src)/(\w+)/", path)
    return room[1] if room else path.split("/")[0]


def count_lines(revision):
    archive = subprocess.run(["git", "archive", revision], cwd=common.SOURCE, capture_output=True, check=True).stdout
    lines = collections.Counter()
    with tarfile.open(fileobj=io.BytesIO(archive)) as tree:
        for member in tree:
            room = member.isfile() and find_room(member.name)
            if room:
                lines[room] += tree.extractfile(member).read().count(b"\n")
    return lines


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("revisions", nargs="*", default=REVISIONS, metavar="REVISION", help="default: " + " ".join(REVISIONS))
    arguments = parser.parse_args()
    revisions = [*arguments.revisions, TODAY]
    counts = [count_lines(revision) for revision in revisions]
    page = common.Page(__file__, "Lines by room", common.describe_run(arguments.commit))
    page.add("Lines of sources, headers, scripts of pages and the Python package, comments included, and of the robots' files; "
             "without tests, examples and documents. `fba40b6` is the program before the rooms were redesigned, `8efbeb57` the one "
             "after it, with the same features. The goal of the redesign was 8,000 lines fewer. It was met with the files of robots, "
             "many of which now only name their generator; the sources alone lost 2,400. What came later is new: free motions, "
             "other people's files, parts, synthesis, data sets.")
    rows = [[room, *(str(count[room] or "") for count in counts)] for room in sorted(set().union(*counts))]
    rows.append(["all", *(str(sum(count.values())) for count in counts)])
    page.table(["room", *(f"`{revision}`" if revision != TODAY else "today" for revision in revisions)], rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
