#!/usr/bin/env python3
"""build_times.py [BUILD] [-n FILES]: where the time of a build goes, from its .ninja_log: seconds of each room, and the slowest files.

Seconds are those between start and end of a compiler beside the others: compare them within one build only.
"""
import argparse
import collections
import os
import re


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs="?", default="build/test", help="directory of the build; default: %(default)s")
    parser.add_argument("-n", type=int, default=15, metavar="FILES", help="number of slowest files; default: %(default)s")
    arguments = parser.parse_args()
    seconds = {}  # the last time that each output was made
    with open(os.path.join(arguments.build, ".ninja_log"), encoding="utf-8") as log:
        for line in log:
            fields = line.rstrip("\n").split("\t")
            if len(fields) == 5:
                seconds[fields[3]] = (int(fields[1]) - int(fields[0])) / 1000
    rooms = collections.defaultdict(lambda: [0, 0.0])
    for output, time in seconds.items():
        compiled = re.match(r"(.*?)/?CMakeFiles/.*\.(o|gch)$", output)
        room = rooms[compiled.group(1) if compiled else "linking, tools"]
        room[0] += 1
        room[1] += time
    print("| room | outputs | seconds |\n|---|---|---|")
    for name, (count, time) in sorted(rooms.items(), key=lambda item: -item[1][1]):
        print(f"| {name} | {count} | {time:.1f} |")
    print(f"| all | {len(seconds)} | {sum(seconds.values()):.1f} |\n")
    for output in sorted(seconds, key=seconds.get, reverse=True)[:arguments.n]:
        print(f"{seconds[output]:8.1f} s  {output}")


main()
