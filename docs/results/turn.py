#!/usr/bin/env python3
"""Writes docs/results/turn.md: motions solved by this program and by others, in turn.

    docs/results/turn.py --other PROGRAM=NAME [--other ...] [--bielle build/bin/bielle] [--repeat 3]

Iterations and costs tell whether a change of the code left the motions alone, ratios of times what it gained. NAME is what the page
calls the other program, such as its commit. A motion that it refuses is left out. `--quick` solves one motion once and prints
the page; without --other, this program takes both turns.
"""
import statistics
import sys

import common

MOTIONS = [("bipetto", motion) for motion in (
               ("squat", "--depth", 0.7), ("walk", "--speed", 0.3), ("walk", "--speed", 0.5), ("walk", "--speed", 0.8),
               ("walk", "--speed", 1), ("side-walk", "--speed", -0.2), ("turn", "--angle", 1.57),
               ("stairs", "--height", 0.06, "--stairs", 4), ("stairs", "--height", -0.06, "--stairs", 4),
               ("stairs", "--height", 0.1, "--stairs", 4), ("jump", "--flight", 0.3),
               ("jump", "--flight", 0.3, "--length", 0.2), ("run", "--speed", 1))]
MOTIONS += [("cleobot", motion) for motion in (
                ("squat", "--depth", 0.7), ("walk", "--speed", 0.5), ("walk", "--speed", 0.9),
                ("stairs", "--height", 0.06, "--stairs", 4), ("jump", "--flight", 0.3))]


def solve(runner, robot, motion, *options):
    """The summary of a solve on two threads; None where the program refuses it."""
    place = runner.place()
    run = runner.run("solve", motion, "--robot", robot, *options, "--threads", 2, "--quiet", "--no-report", "--no-check", "-o", place,
                     allowed=(0, 1, 2))
    if run.returncode == 2:
        print(runner.bielle, motion, run.stderr, file=sys.stderr, flush=True)
        return None
    return common.Result(place).summary


def compare(page, ours, program, name, motions, repeat):
    """One table: this program and another."""
    runners = [common.Runner(program), ours]
    rows, middles = [], []
    for robot, (motion, *options) in motions:
        turns = [[solve(runner, robot, motion, *options) for runner in runners] for _ in range(repeat)]
        other, now = turns[0]
        if other is None or now is None:
            continue
        ratios = [turn[1]["seconds"] / turn[0]["seconds"] for turn in turns]
        middles.append(statistics.median(ratios))
        rows.append((f"{robot}: {motion} {' '.join(map(str, options))}",
                     *(str(run["iterations"]) + ("" if run["converged"] else ", not converged") for run in turns[0]),
                     f"{now['cost']:.6g}", f"{abs(now['cost'] - other['cost']) / abs(other['cost']):.0e}",
                     f"{min(turn[1]['seconds'] for turn in turns):.2f}", f"{min(ratios):.2f} to {max(ratios):.2f}"))
        print(*rows[-1], file=sys.stderr, flush=True)
    page.heading(f"Against {name}")
    page.table(["motion", "iterations, other", "iterations", "cost", "relative difference of costs", "seconds", "ratio of times"], rows)
    page.add(f"The median of the ratios is {statistics.median(middles):.2f}; they go from {min(middles):.2f} to {max(middles):.2f}.")


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--other", action="append", metavar="PROGRAM=NAME", help="another program's command and its name")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.repeat = 1
    page = common.Page(__file__, "Programs in turn", common.describe_run(arguments.commit))
    page.add(f"Motions solved by this program and by another one, one after the other, {arguments.repeat} times, on two threads, from "
             "a cold start. Seconds are this program's least; ratios are of the pairs, least to largest. Costs of programs whose "
             "motions have other steps or constraints differ.")
    for other in arguments.other or [f"{arguments.bielle}=itself"]:
        program, _, name = other.rpartition("=")
        compare(page, common.Runner(arguments.bielle), program, name, MOTIONS[:1] if arguments.quick else MOTIONS, arguments.repeat)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
