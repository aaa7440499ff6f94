#!/usr/bin/env python3
"""Writes docs/results/objectives.md: energies and torques of motions of least effort, energy and peak torque.

    docs/results/objectives.py [--bielle build/bin/bielle] [--quick]

Takes about five minutes on one core.
"""
import common
from common import show

MOTIONS = [
    ("squat to 0.7", "bipetto", "squat", ["--depth", 0.7]),
    ("walk, 0.5 m/s", "bipetto", "walk", ["--speed", 0.5]),
    ("walk, 0.8 m/s", "bipetto", "walk", ["--speed", 0.8]),
    ("stairs, 4 × 6 cm up", "bipetto", "stairs", ["--height", 0.06, "--stairs", 4]),
    ("jump, 0.3 s in the air", "bipetto", "jump", ["--flight", 0.3]),
    ("Cleobot, squat to 0.7", "cleobot", "squat", ["--depth", 0.7]),
    ("Cleobot, walk, 0.5 m/s", "cleobot", "walk", ["--speed", 0.5]),
]


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "Objectives", common.describe_run(arguments.commit))
    page.add("""Every motion of least energy or peak torque starts from the motion of least effort; its iterations are
those after that one. Energies assume a torque loss of 0.25 W/(N m)² for every motor. The cost of transport is energy
over weight and distance. The check is [that of every motion](../checks.md).""")
    rows = []
    for title, robot, motion, options in MOTIONS[-2:-1] if arguments.quick else MOTIONS:
        effort = runner.solve(motion, robot, options)
        for objective in ["effort", "energy"] if arguments.quick else ["effort", "energy", "peak-torque"]:
            result = effort if objective == "effort" else runner.solve(
                motion, robot, [*options, "--objective", objective])
            energy = result.summary["electrical_energy"]
            rows.append([title if objective == "effort" else "", objective, f"{energy['total_J']:.1f}",
                         show(energy["cost_of_transport"] or None, "{:.2f}"), f"{result.torque():.1f}",
                         f"{result.summary['iterations']}", result.outcome()])
    columns = ["", "objective", "energy [J]", "cost of transport", "largest torque [N m]", "iterations", "check"]
    page.table(columns, rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
