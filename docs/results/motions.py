#!/usr/bin/env python3
"""Writes docs/results/motions.md: iterations, goals, torques and rows of the check of every documented motion.

    docs/results/motions.py [--bielle build/bin/bielle] [--quick]

Takes about seven minutes on one core.
"""
import common
from common import show

STAIRS = ["--stairs", 4]
STONES = common.SOURCE / "examples/stones.yaml"
RIGID = ["--set", "rigid_landing=true"]
SOFT = [*RIGID, "--set", "landing_speed=0.05"]
# Title, robot, motion, options.
SQUATS = [(f"{depth}", "bipetto", "squat", ["--depth", depth]) for depth in (0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.15, 1.16)]
BIPETTO = [
    ("squat to 0.7", "bipetto", "squat", ["--depth", 0.7]),
    *((f"walk, {speed} m/s", "bipetto", "walk", ["--speed", speed]) for speed in (0.3, 0.5, 0.8, 1.0, 1.2)),
    ("side walk, −0.2 m/s", "bipetto", "side-walk", ["--speed", -0.2]),
    ("side walk, −0.4 m/s", "bipetto", "side-walk", ["--speed", -0.4]),
    ("turn by 1.57 rad on the spot", "bipetto", "turn", ["--angle", 1.57]),
    *((f"stairs, 4 × {abs(height) * 100:.0f} cm {'up' if height > 0 else 'down'}", "bipetto", "stairs",
       ["--height", height, *STAIRS]) for height in (0.06, -0.06, 0.1, 0.12, -0.12)),
    ("jump, 0.3 s in the air", "bipetto", "jump", ["--flight", 0.3]),
    ("jump, 0.3 s, 0.2 m ahead", "bipetto", "jump", ["--flight", 0.3, "--length", 0.2]),
    ("jump, 0.39 s", "bipetto", "jump", ["--flight", 0.39]),
    ("walk, 0.5 m/s, rigid landings", "bipetto", "walk", ["--speed", 0.5, *RIGID]),
    ("the same, feet land at 0.05 m/s", "bipetto", "walk", ["--speed", 0.5, *SOFT]),
    ("the same, friction 0.35", "bipetto", "walk", ["--speed", 0.5, *SOFT, "--set", "friction=0.35"]),
    ("walk, 0.5 m/s, full formulation", "bipetto", "walk", ["--speed", 0.5, "--formulation", "full"]),
    ("squat, walk, stairs, jump in sequence", "bipetto", "sequence", ["--motions", "squat,walk,stairs,jump"]),
]
OTHERS = [
    ("Cleobot, squat", "cleobot", "squat", []),
    ("Cleobot, walk, 0.5 m/s", "cleobot", "walk", ["--speed", 0.5]),
    ("Cleobot, walk, 0.9 m/s", "cleobot", "walk", ["--speed", 0.9]),
    ("Cleobot, stairs", "cleobot", "stairs", []),
    ("Cleobot, jump", "cleobot", "jump", []),
    ("RSU biped, walk, 0.5 m/s", "rsu_biped", "walk", ["--speed", 0.5]),
    ("RSU biped, walk, 0.9 m/s", "rsu_biped", "walk", ["--speed", 0.9]),
    ("RSU biped, stairs", "rsu_biped", "stairs", []),
    ("Digit, squat", "digit", "squat", []),
    ("Digit, walk", "digit", "walk", []),
]
RUNS = [
    *((f"run, {speed} m/s", "bipetto", "run", ["--speed", speed]) for speed in (0.8, 1.0, 1.2, 1.5)),
    *((f"Cleobot, run, {speed} m/s", "cleobot", "run", ["--speed", speed]) for speed in (1.0, 1.5)),
    *((f"RSU biped, run, {speed} m/s", "rsu_biped", "run", ["--speed", speed]) for speed in (1.0, 1.5)),
    ("hop on the left foot", "bipetto", "hop", ["--foot", "left"]),
    ("two hops of 0.1 m on the right foot", "bipetto", "hop", ["--foot", "right", "--hops", 2, "--length", 0.1]),
    ("Cleobot, hop", "cleobot", "hop", []),
    ("RSU biped, hop", "rsu_biped", "hop", []),
]
UNEVEN = [(title if robot == "bipetto" else "Cleobot, " + title, robot, motion, options)
          for robot in ("bipetto", "cleobot")
          for title, motion, options in [
              ("stones of `examples/stones.yaml`", "footholds", ["--footholds", STONES]),
              ("box of 10 cm, up and down", "box", ["--height", 0.1, "--down"]),
              ("box of 15 cm", "box", ["--height", 0.15]),
              ("gap of 30 cm", "gap", ["--width", 0.3])]]
FREE = [
    ("walk, 0.5 m/s", "walk", ["--speed", 0.5], []),
    ("walk, 0.5 m/s, 2.5 per second", "walk", ["--speed", 0.5], ["--time-weight", 2.5]),
    ("walk, 0.8 m/s", "walk", ["--speed", 0.8], []),
    ("stairs, 4 × 6 cm up", "stairs", ["--height", 0.06, *STAIRS], []),
    ("jump, 0.3 s, 0.2 m ahead", "jump", ["--flight", 0.3, "--length", 0.2], []),
]
COLUMNS = ["", "goals: requested → achieved", "iterations", "cost", "violation", "largest torque [N m]", "slip [mm]",
           "clearance [mm]", "between soles [mm]", "cone margin [mm]", "check"]


def describe_goals(result):
    return ", ".join(f"{name} {requested:.4g} → {round(achieved, 6):.4g} {unit}".removesuffix(" 1").replace("-0 ", "0 ")
                     for name, requested, achieved, unit in result.goals() if not name.endswith("footholds")) or "–"


def describe(title, result):
    summary = result.summary
    return [title, describe_goals(result), f"{summary['iterations']}", f"{summary['cost']:.4f}",
            f"{summary['constraints']['largest_violation']:.0e}", f"{result.torque():.1f}",
            show(result.row("standing feet: slip"), "{:.3f}", 1e3),
            show(result.row("swinging feet: clearance"), "{:.1f}", 1e3),
            show(result.row("distance of the soles"), "{:.1f}", 1e3),
            show(result.row("contact: wrench cone of the sole"), "{:.1f}", 1e3), result.outcome()]


def add_motions(page, runner, motions):
    page.table(COLUMNS, [describe(title, runner.solve(motion, robot, options))
                         for title, robot, motion, options in motions if runner.has_robot(robot)])


def add_squats(page, runner, squats):
    rows = []
    for title, robot, motion, options in squats:
        result = runner.solve(motion, robot, options)
        (_, _, achieved, _), = result.goals()
        rows.append([title, f"{achieved:.3f}", f"{result.summary['iterations']}", f"{result.torque('knee'):.1f}",
                     result.outcome()])
    page.table(["`--depth`", "achieved", "iterations", "largest torque of a knee motor [N m]", "check"], rows)


def find_goal(result, name):
    return next((achieved for goal, _, achieved, _ in result.goals() if goal == name), None)


def list_durations(result, word, key):
    return [timing[key] for timing in result.summary["free_timings"] if word in timing["phase"]]


def describe_durations(result, word):
    chosen, nominal = list_durations(result, word, "chosen_s"), list_durations(result, word, "nominal_s")
    return f"{min(nominal):.3f} → {min(chosen):.3f} .. {max(chosen):.3f}" if chosen else "–"


def add_free(page, runner):
    rows = []
    for title, motion, options, weights in FREE:
        fixed = runner.solve(motion, "bipetto", options)
        free = runner.solve(motion, "bipetto", [*options, "--free-timings", *weights])
        pair = [f"{result.summary['iterations']}" for result in (fixed, free)]
        speeds = [show(find_goal(result, "speed"), "{:.3f}") for result in (fixed, free)]
        rows.append([title, " → ".join(pair), f"{fixed.summary['duration_s']:.3f} → {free.summary['duration_s']:.3f}",
                     " → ".join(speeds), describe_durations(free, "left foot"), free.outcome()])
    page.table(["planned durations → free durations", "iterations", "whole motion [s]", "speed [m/s]",
                "on the left foot [s]", "check"], rows)


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "Motions", common.describe_run(arguments.commit))
    page.add("""Every motion starts cold, on one thread, with the default options but for those in its title.
*Violation* is the largest of a constraint, over its scale. *Slip*, *clearance* (of a swinging foot in the middle half
of a step), the distance between the soles and the margin of the wrench cone over the load are rows of [the
check](../checks.md), and so are the goals achieved: the check measures them again. *Passes* means that all rows do.""")
    if arguments.quick:
        add_motions(page, runner, BIPETTO[:1])
        page.write(True)
        return
    page.heading("Squats of Bipetto")
    add_squats(page, runner, SQUATS)
    page.heading("Steps and jumps of Bipetto")
    add_motions(page, runner, BIPETTO)
    page.heading("Other robots")
    add_motions(page, runner, OTHERS)
    page.heading("Runs and hops")
    page.add("Runs are 0.08 s in the air and 0.24 s on the ground for each step.")
    add_motions(page, runner, RUNS)
    page.heading("Uneven ground")
    add_motions(page, runner, UNEVEN)
    page.heading("Free durations")
    page.add("The durations of all phases with feet on the ground are free between 0.6 and 1.6 of those planned.")
    add_free(page, runner)
    page.write(False)


if __name__ == "__main__":
    main()
