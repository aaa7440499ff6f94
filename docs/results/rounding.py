#!/usr/bin/env python3
"""Writes docs/results/rounding.md: linkages read from rounded numbers, beside the exact ones.

    docs/results/rounding.py [--tests build/tests/test_dynamics] [--count 1000] [--quick]

Runs a case of the tests with that many linkages of each family. Takes some minutes of processor time.
"""
import os
import subprocess
import sys

import common

CASE = "linkages of three to nine decimals beside the exact ones"
FAMILIES = ("plane four-bar", "six-bar", "spherical", "Bennett", "parallelogram", "plane in space")


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--tests", default=str(common.SOURCE / "build/tests/test_dynamics"), help="the program of the tests")
    parser.add_argument("--count", type=int, default=1000, help="linkages of each family")
    arguments = parser.parse_args()
    count = 14 if arguments.quick else arguments.count
    done = subprocess.run([os.path.abspath(arguments.tests), CASE], capture_output=True, text=True,
                          env=dict(os.environ, BIELLE_ROUNDED=str(count)))
    if done.returncode != 0:
        sys.exit(done.stdout[-2000:] + done.stderr)
    rows = [line.split(",") for line in done.stdout.splitlines() if line.startswith(FAMILIES)]
    page = common.Page(__file__, "Linkages read from rounded numbers", common.describe_run(arguments.commit))
    page.add(
        f"""{count} random linkages of each of six families that move only because their axes lie as they do, links
        of 5 cm to 1 m, each written with 3 to 9 decimals (roll, pitch and yaw, and places; frames stand askew in
        space) and [read again](../modelling.md#rounded-numbers). They are led through a turn of their first
        joint, either way, as far as the exact one goes, beside it (`tests/test_rounded_study.cpp`).""",
        """*Moves* is the share that is read as what was rounded, with its one freedom; the others are told as
        locked, with the `rounding` that would do. *Lost* are those that somewhere cannot follow the exact one.
        *Angles* and *ratios* are the largest differences of a linkage from the exact one, 0.1 rad away from
        where that ends, in units of the last decimal: of the linkage in the middle, and of nine in ten. *Moved*
        is the same difference of ratios of another exact linkage: the same one with its pivots moved in their
        planes by up to half a unit. A file tells no more than that.""",
        """The goal is that all move from five decimals on, which they do, and that their ratios and swings are
        within 50 units, which is beyond what the files of plane linkages tell: where links are short beside the
        lever that half a unit has, exact linkages with the same file differ by as much.""")
    columns = ["family", "decimals", "linkages", "moves", "lost", "angles", "of nine in ten", "ratios", "of nine in ten",
               "moved", "of nine in ten"]
    page.table(columns, [[row[0], row[1], row[2], f"{100 * int(row[3]) / int(row[2]):.0f} %", row[4], *row[5:9],
                          *(row[9:] if float(row[10]) > 0 else ("–", "–"))] for row in rows])
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
