#!/usr/bin/env python3
"""Writes docs/results/synthesis.md: how fast and how well `bielle synthesize` finds linkages.

    docs/results/synthesis.py [--bielle build/bin/bielle] [--quick]

Takes about ten minutes on one core.
"""
import json
import os
import pathlib
import re

import common

IDEAL = "generator: leg_biped\nset: {knee: serial, ankle: rsu}\n"
ONE_START = """\
generator: leg_biped
set: {knee: drawn, ankle: rsu}
"""
MOTIONS = {"squat to 0.8": ["squat", "--depth", 0.8, "--set", "time_step=0.04"],
           "walk, 0.5 m/s": ["walk", "--speed", 0.5, "--set", "time_step=0.02"]}
# Evaluations of the searches from one start: a global one, then a local one, as `bielle design` does by default.
ONE_START_STAGES = "{searches: 1, stages: [{algorithm: crs, evaluations: %d}, {algorithm: sbplx, evaluations: %d}]}"


def get_processor_seconds():
    """Of all processes that have ended."""
    return os.times().children_user + os.times().children_system


def read_logs(directory, pattern):
    evaluations = []
    for path in sorted(directory.glob(pattern)):
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            entry = json.loads(line)
            evaluations.append(entry)
    return evaluations


def describe_best(evaluations, usual):
    """Evaluations, feasible ones, and of these the least energy, torque and sum of both over those of the usual part."""
    feasible = [entry["measures"] for entry in evaluations if entry["status"] == "feasible"]
    sums = [sum(m / u for m, u in zip(measures, usual)) for measures in feasible]
    return [str(len(evaluations)), str(len(feasible))] + [
        common.show(min(values, default=None), "{:.4g}") for values in ([m[0] for m in feasible], [m[1] for m in feasible], sums)]


def compare(runner, title, motion, quick):
    place = pathlib.Path(runner.place())
    place.mkdir()
    (place / "ideal.yaml").write_text(IDEAL)
    runner.solve(motion[0], place / "ideal.yaml", motion[1:], place / "motion")
    runner.run("synthesize", "--motion", place / "motion", "--joint", "knee_left", "--motor", "ak10-9", "--count",
               4 if quick else 20, "--samples", 20000 if quick else 1000000, "-o", place / "found")
    runner.run("design", place / "found/design.yaml", "-o", place / "refined", "--jobs", 1)
    # The same problem from the part as it comes, by the searches that take no gradients.
    text = (place / "found/design.yaml").read_text()
    text = ONE_START + text[text.index("variables:"):text.index("search:")]
    (place / "one.yaml").write_text(text + "search: " + ONE_START_STAGES % ((6, 3) if quick else (200, 100)) + "\n")
    runner.run("design", place / "one.yaml", "-o", place / "one", "--jobs", 1)
    usual = json.loads((place / "one/search1.jsonl").read_text().splitlines()[0])["measures"]
    return [[title, name] + describe_best(read_logs(place / directory, pattern), usual)
            for name, directory, pattern in (("synthesis and gradients", "refined", "front.jsonl"),
                                             ("one start, without gradients", "one", "search*.jsonl"))]


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "Synthesis", common.describe_run(arguments.commit))
    page.heading("Four-bars by the million")
    rows = []
    for title, options in (("a ratio of 0.9 from 0 to 1.6 rad", ["--range", "0:1.6", "--ratio", 0.9]),
                           ("the most constant ratio from 0 to 1.6 rad", ["--range", "0:1.6"]),
                           ("the ratios of Bipetto's knee from 0.1 to 1.1 rad",
                            ["--range", "0.1:1.1", "--like", "bipetto", "--joint", "knee_right"])):
        begin = get_processor_seconds()
        run = runner.run("synthesize", *options, "--count", 1, *(["--samples", 100000] if arguments.quick else []), "-o",
                         runner.place())
        deviation = re.search(r"leg_1 +(\S+)", run.stdout)[1]
        rows.append([title, deviation, f"{get_processor_seconds() - begin:.1f}"])
    page.table(["requested", "largest deviation of the best", "processor time [s]"], rows)
    page.add("""A million drawings each, the best fifty refined; the deviation is relative (of the second row, by how much the
largest ratio exceeds the least).""")
    page.heading("From what a motion needs, against a search from one start")
    page.add("""The knee of `leg_biped` with rods at the ankles, moved by an AK10-9 and a four-bar that is free: place of the motor,
crank, arm and their angles. *Synthesis* takes the torques and speeds of a knee with its motor on the joint, solves the motion
anew for the best twenty drawings and refines the front of energy and peak torque by gradients. The search *from one start* begins with
the part `drawn` as it comes; it is the one that `bielle design` makes by default, CRS and then Sbplx, for the sum of both measures.
Every evaluation solves the motion once. Energies and torques are those of the knee's motors; the sum is that of both over those
of the part as it comes.""")
    rows = []
    for title, motion in list(MOTIONS.items())[:1] if arguments.quick else MOTIONS.items():
        rows += compare(runner, title, motion, arguments.quick)
    page.table(["motion", "search", "solved motions", "feasible", "least energy [J]", "least peak torque [N m]",
                "least sum"], rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
