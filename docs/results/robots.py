#!/usr/bin/env python3
"""Writes docs/results/robots.md: motions of the robots that come along, but for Bipetto, whose page is motions.md.

    docs/results/robots.py [--bielle build/bin/bielle] [--quick]

Takes a few minutes on one core. Robots whose files are published elsewhere are left out unless BIELLE_ROBOTS names them.
"""
import common
from common import show

SQUAT, WALK, FAST, JUMP = (("squat to 0.7 of the height", "squat", ["--depth", 0.7]),
                           ("walk, 0.5 m/s", "walk", ["--speed", 0.5]),
                           ("walk, 0.8 m/s", "walk", ["--speed", 0.8]),
                           ("jump, 0.3 s in the air", "jump", ["--flight", 0.3]))
ALL = (SQUAT, WALK, FAST, JUMP)
# Title, robot or the parameters of a generator, motions.
ROBOTS = [
    ("cleobot", "cleobot", ALL),
    ("rsu_biped", "rsu_biped", ALL),
    ("humanoid", "humanoid", ALL),
    ("leg_biped: serial hips, four-bars, differentials", "leg_biped", ALL),
    ("leg_biped: 3-RRS hips, four-bars, differentials",
     ("leg_biped", "hip=three_rrs", "knee=four_bar", "ankle=differential"), ALL),
    ("belt_biped", "belt_biped", ALL),
    ("belt_knee", "belt_knee", ALL),
    ("differential_ankle", "differential_ankle", ALL),
    ("kangaroo (forces of screws, N)", "kangaroo", (SQUAT, WALK, FAST)),
    ("spring_biped", "spring_biped", (SQUAT, WALK)),
    ("spring_biped, rigid leaves", ("spring_biped", "shin_stiffness=0", "heel_stiffness=0"), (SQUAT, WALK)),
    ("fivebar_leg", "fivebar_leg", (SQUAT,)),
    ("kangaroo_leg (forces of screws, N)", "kangaroo_leg", (SQUAT,)),
    ("digit", "digit", ALL),
]
COLUMNS = ["robot", "motion", "iterations", "largest torque [N m]", "of", "slip [mm]", "cone margin [mm]", "check"]


def generate(runner, robot):
    if isinstance(robot, str):
        return robot
    name, *settings = robot
    directory = runner.place(name + "-" + "-".join(settings))
    runner.run("generate", name, *(word for setting in settings for word in ("--set", setting)), "-o", directory)
    return directory


def describe(title, motion, result):
    name, torque = max(result.summary["peak_torques"].items(), key=lambda entry: entry[1])
    return [title, motion, f"{result.summary['iterations']}", f"{torque:.1f}", name,
            show(result.row("standing feet: slip"), "{:.3f}", 1e3),
            show(result.row("contact: wrench cone of the sole"), "{:.1f}", 1e3), result.outcome()]


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "Motions of the robots", common.describe_run(arguments.commit))
    page.add("""Every motion starts cold, on one thread, with the costs of Bipetto and the default options but for those in its
title. *Slip* and the margin of the wrench cone over the load are rows of [the check](../checks.md). *Passes* means that all
rows do.""")
    rows = []
    for title, robot, motions in ROBOTS[:1] if arguments.quick else ROBOTS:
        place = generate(runner, robot)
        if not runner.has_robot(place):
            continue
        for motion, name, options in motions[:1] if arguments.quick else motions:
            rows.append(describe(title, motion, runner.solve(name, place, options)))
    page.table(COLUMNS, rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
