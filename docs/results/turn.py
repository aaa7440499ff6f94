#!/usr/bin/env python3
"""Writes docs/results/turn.md: motions solved by this program and by another one, in turn.

    docs/results/turn.py --other PROGRAM [--other-commit HASH] [--bielle build/bin/bielle] [--repeat 3]

Iterations and costs tell whether a change of the code left the motions alone, ratios of times what it gained. `--quick` solves one
motion once and prints the page; without --other, this program takes both turns.
"""
import common

MOTIONS = [("bipetto", "squat"), ("bipetto", "walk"), ("bipetto", "walk", "--speed", 0.8), ("bipetto", "side-walk"),
           ("bipetto", "stairs"), ("bipetto", "jump"), ("bipetto", "run"), ("cleobot", "squat"), ("cleobot", "walk")]


def solve(runner, robot, motion, *options):
    """(iterations, cost, seconds) on two threads."""
    place = runner.place()
    runner.run("solve", motion, "--robot", robot, *options, "--threads", 2, "--quiet", "--no-report", "--no-check", "-o", place)
    summary = common.Result(place).summary
    return summary["iterations"], summary["cost"], summary["seconds"]


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--other", help="the other program's command")
    parser.add_argument("--other-commit", default="another program", metavar="HASH")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.repeat = 1
    runners = [common.Runner(arguments.other or arguments.bielle), common.Runner(arguments.bielle)]
    rows = []
    for motion in MOTIONS[:1] if arguments.quick else MOTIONS:
        turns = [[solve(runner, *motion) for runner in runners] for _ in range(arguments.repeat)]
        (_, before, _), (_, now, _) = turns[0]
        ratios = [ours[2] / other[2] for other, ours in turns]
        robot, name, *options = motion
        rows.append((f"{robot}: {name} {' '.join(map(str, options))}".strip(), *(str(run[0]) for run in turns[0]), f"{now:.6g}",
                     f"{abs(now - before) / abs(before):.0e}", f"{min(run[1][2] for run in turns):.2f}",
                     f"{min(ratios):.2f} to {max(ratios):.2f}"))
    page = common.Page(__file__, "Two programs in turn", common.describe_run(arguments.commit))
    page.add(f"Motions solved by this program and by that of {arguments.other_commit}, one after the other, {arguments.repeat} times, "
             "on two threads, from a cold start. Seconds are this program's least; ratios are of the pairs, least to largest.")
    page.table(["motion", "iterations, other", "iterations", "cost", "relative difference of costs", "seconds", "ratio of times"], rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
