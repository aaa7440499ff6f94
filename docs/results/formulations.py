#!/usr/bin/env python3
"""Writes docs/results/formulations.md: both formulations as the step shrinks, and Euler and midpoint steps.

    docs/results/formulations.py [--bielle build/bin/bielle] [--quick]

Takes about four minutes on one core.
"""
import common
from common import show

GAINS = ["--set", "contact_kp=400", "--set", "contact_kd=40"]
# Phases of multiples of 24 ms, so that every step divides them.
WALK = ["--steps", 4, "--set", "start_support=0.288", "--set", "double_support=0.048", "--set", "end_support=0.456"]
CASES = [("squat to 0.9", "squat", ["--depth", 0.9], (20, 10, 5, 2.5)),
         ("squat to 0.7", "squat", ["--depth", 0.7], (20, 10, 5, 2.5)),
         ("walk, four steps at 0.5 m/s", "walk", WALK, (24, 12, 6, 3))]
RULES = [("squat to 0.7", "squat", ["--depth", 0.7]), ("walk, 0.5 m/s", "walk", ["--speed", 0.5]),
         ("walk, 0.8 m/s", "walk", ["--speed", 0.8]),
         ("stairs, 4 × 6 cm up", "stairs", ["--height", 0.06, "--stairs", 4])]


def find_difference(full, reduced):
    """The largest difference of a motor torque at the same stage, N m."""
    first, second = full.columns("u."), reduced.columns("u.")
    return max(abs(a - b) for name in first for a, b in zip(first[name], second[name], strict=True))


def find_drift(result):
    gap = result.summary["closure_gap"]
    return max(gap["position_m"], gap["angle_rad"])


def compare(runner, title, motion, options, step):
    options = [*options, *GAINS, "--set", f"time_step={step / 1000}", "--step", "euler"]
    full, reduced = (runner.solve(motion, "bipetto", [*options, "--formulation", name]) for name in ("full", "reduced"))
    return [title, f"{step}", f"{full.summary['cost']:.6f}", f"{reduced.summary['cost']:.6f}",
            f"{full.summary['iterations']}, {reduced.summary['iterations']}", f"{reduced.torque():.2f}",
            f"{find_difference(full, reduced):.3f}", f"{find_drift(full):.1e}", f"{find_drift(reduced):.0e}"]


def describe_rule(runner, title, motion, options, rule):
    stage = [] if motion == "squat" else ["--set", "time_step=0.012"]
    gains = ["--set", "contact_kp=1e4"] if rule == "euler" and motion != "squat" else []
    result = runner.solve(motion, "bipetto", [*options, *stage, *gains, "--step", rule])
    return [title if rule == "euler" else "", rule, f"{result.summary['iterations']}",
            show(result.row("finite differences of the velocity"), "{:.1e}"),
            show(result.row("standing feet: slip"), "{:.3f}", 1e3),
            show(result.row("standing feet: off the ground"), "{:.3f}", 1e3), result.outcome()]


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "Formulations and steps", common.describe_run(arguments.commit))
    page.heading("Full and reduced")
    page.add("""Bipetto, Euler steps, contacts stabilized by 400 1/s² and 40 1/s, all else by default. *Largest
torque*: that of any motor at any time, reduced. *Largest difference*: that of any motor torque between the
formulations, at the same stage. *Drift*: the largest closing error of any closure at any node.""")
    page.table(["", "step [ms]", "cost, full", "cost, reduced", "iterations", "largest torque [N m]",
                "largest difference [N m]", "drift, full [m, rad]", "drift, reduced"],
               [compare(runner, title, motion, options, step)
                for title, motion, options, steps in (CASES[:1] if arguments.quick else CASES)
                for step in (steps[:1] if arguments.quick else steps)])
    if not arguments.quick:
        page.heading("Euler and midpoint steps")
        page.add("""Bipetto, reduced formulation; walks and stairs in stages of 12 ms, with Euler steps stabilized by
10⁴ 1/s². The last columns are rows of [the check](../checks.md), whose bounds are ten times wider for Euler steps.""")
        page.table(["", "steps", "iterations", "differences of the velocity", "slip [mm]", "sole off the ground [mm]",
                    "check"],
                   [describe_rule(runner, *case, rule) for case in RULES for rule in ("euler", "midpoint")])
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
