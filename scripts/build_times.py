#!/usr/bin/env python3
"""build_times.py [BUILD] [--files N]: where the time of a build went, from its .ninja_log: seconds by room, and the slowest steps.

A step counts from its start to its end by the clock; with as many jobs as cores that is about processor time.
"""
import argparse
import collections
import pathlib
import re


def read_steps(log):
    """{output: seconds}, the last time each was made; outputs of one step share its time."""
    steps = {}
    for line in log.read_text().splitlines()[1:]:
        start, end, _, output, key = line.split("\t")
        steps[output] = ((int(end) - int(start)) / 1000, (start, end, key))
    unique = {}
    for output, (seconds, step) in steps.items():
        unique.setdefault(step, (output, seconds))
    return list(unique.values())


def find_room(output):
    objects = re.match(r"(.*)/CMakeFiles/[^/]*\.dir/", output)
    if objects:
        parts = objects.group(1).split("/")
        return "/".join(parts[:2]) if parts[0] == "src" else parts[0]
    return "linking" if output.startswith("bin/") or re.search(r"\.(a|so)[.0-9]*$|/[^./]+$", output) else "other"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs="?", default="build", help="directory of the build (default: build)")
    parser.add_argument("--files", type=int, default=15, help="how many of the slowest steps to list (default: 15)")
    arguments = parser.parse_args()
    steps = read_steps(pathlib.Path(arguments.build) / ".ninja_log")
    rooms = collections.defaultdict(lambda: [0.0, 0])
    for output, seconds in steps:
        room = rooms[find_room(output)]
        room[0] += seconds
        room[1] += 1
    print(f"{'room':24} {'seconds':>8} {'steps':>6} {'each':>6}")
    for name, (seconds, count) in sorted(rooms.items(), key=lambda item: -item[1][0]):
        print(f"{name:24} {seconds:8.1f} {count:6d} {seconds / count:6.1f}")
    print(f"{'all':24} {sum(seconds for _, seconds in steps):8.1f} {len(steps):6d}\n")
    for output, seconds in sorted(steps, key=lambda step: -step[1])[:arguments.files]:
        print(f"{seconds:8.1f}  {output}")


if __name__ == "__main__":
    main()
