#!/usr/bin/env python3
"""Writes docs/results/speed.md: the times of `bielle bench`.

    docs/results/speed.py [--bielle build/bin/bielle] [--shifts 10000] [--quick]

Takes some minutes of a machine with nothing else to do. A busy machine is refused: other programs lengthen all times.
"""
import json
import os
import sys

import common

TITLES = {
    "walk, per node": "The benchmark walk, per node",
    "walk, FDDP iteration per node": "An FDDP iteration, per node",
    "cold start to converged": "From a cold start to the optimum",
    "receding horizon": "A receding horizon of 100 nodes",
    "chains of four-bars, per node": "Chains of four-bars, per node",
    "horizons, per node": "Horizons, per node",
}
QUIET = 0.5  # load average of a machine with nothing else to do
HIDDEN = {"tangent size", "rate [Hz]", "violation", "least height", "largest tilt [rad]", "up"}


def format_cell(value):
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--shifts", type=int, default=10000, help="shifts of the receding horizon")
    arguments = parser.parse_args()
    load = os.getloadavg()[0]
    if load > QUIET and not arguments.quick:
        sys.exit(f"the load average is {load:.1f}, and other programs lengthen all times; try again below {QUIET}")
    runner = common.Runner(arguments.bielle)
    options = ["--quick"] if arguments.quick else ["--shifts", arguments.shifts]
    report = json.loads(runner.run("bench", "--json", *options).stdout)
    page = common.Page(__file__, "Speed", common.describe_run(arguments.commit))
    page.add(f"""{report['compiler']}, `{report['flags'].strip()}`. One unit is a product of two 108 × 108 matrices by
Eigen on one thread, {report['unit [us]']:.3g} µs in this run. The load average was {load:.1f} when the run began.""")
    for key, title in TITLES.items():
        rows = report.get(key)
        if not rows:
            continue
        columns = [column for column in rows[0] if column not in HIDDEN]
        page.heading(title)
        page.table([column.replace("[us]", "[µs]") for column in columns],
                   [[format_cell(row[column]) for column in columns] for row in rows])
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
