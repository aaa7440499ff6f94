#!/usr/bin/env python3
"""The protocol of docs/suite.md: every problem of the suite from perturbed guesses, by Bielle with each ingredient on and off.

    suite/protocol.py DIR RUNS.jsonl [--count 100] [--seed 0] [--variants NAME ...] [--until HH:MM]

DIR is what `bielle dataset suite/suite.yaml -o DIR` wrote. A run is a line of RUNS.jsonl, appended when it is finished; those that
are there are not repeated. The Python package `bielle` has to be found. Runs go guess by guess, so that what is cut off has as many
guesses of every problem.
"""
import argparse
import datetime
import json
import pathlib
import sys

import numpy as np

import bielle
from guesses import make_guess
from problem import Problem

LONGEST = 120  # s, of a solve on one thread

NO_MARGIN = bielle.LimitOptions(dead_point_margin=0)
# Options of the problem, and of the solver. All but the first change one thing.
VARIANTS = {
    "exact loops": ({}, {}),
    "full formulation": ({"formulation": bielle.Formulation.FULL}, {}),
    "Euler steps": ({"step": bielle.StepRule.EULER}, {}),
    "no margin to dead points": ({"limits": NO_MARGIN}, {}),
    "stiff penalty": ({}, {"constraints": bielle.ConstraintOptions(initial_penalty=1e4)}),
    "no acceptable end": ({}, {"acceptable_decrease": 0}),
}


def make_motion(directory, entry, changes):
    robot = entry["robot"] if entry["robot"] in bielle.list_robots() else str(
        pathlib.Path(__file__).resolve().parent / entry["robot"])
    model = bielle.load_robot(robot).model
    request = bielle.Request(motion=entry["motion"], options=entry["set"])
    options = bielle.ProblemOptions(**{"formulation": bielle.Formulation.REDUCED, "step": bielle.StepRule.MIDPOINT, **changes})
    return bielle.Motion.make(model, request, options)


def make_start(motion, guess):
    """The guess as a trajectory; its first state is that of the problem."""
    xs = np.concatenate([guess["q"], guess["v"]], 1)
    xs[0] = motion.guess.xs[0]
    if len(xs) != motion.num_stages + 1:
        raise SystemExit(f"{motion.name}: the problem has {len(xs) - 1} stages, the motion {motion.num_stages}")
    return bielle.Trajectory(xs=list(xs), us=list(guess["u"]))


def run(motion, guess, changes):
    options = bielle.SolverOptions(**{"threads": 1, "acceptable_decrease": 1e-4, **changes})
    late = []

    def watch(iteration):
        late[:] = [iteration.seconds > LONGEST]
        return not late[0]

    solution = motion.solve(options, callback=watch, warm_start=make_start(motion, guess), refine=False)
    summary = solution.summary
    return {"converged": solution.converged, "end": "too late" if late == [True] else summary.termination.name.lower(),
            "acceptable": summary.acceptable, "cost": summary.cost, "violation": summary.violation,
            "iterations": summary.iterations, "seconds": round(summary.seconds, 4)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("runs", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=100, help="guesses of each problem")
    parser.add_argument("--seed", type=int, default=0, help="of the guesses")
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS, metavar="NAME",
                        help="some of: " + ", ".join(VARIANTS))
    parser.add_argument("--until", help="begin no run after this time of today, UTC")
    arguments = parser.parse_args()
    entries = [json.loads(line) for line in (arguments.directory / "index.jsonl").read_text(encoding="utf-8").splitlines()]
    entries = [entry for entry in entries if entry["good"] and "problem" in entry["files"]]
    done = set()
    if arguments.runs.exists():
        lines = arguments.runs.read_text(encoding="utf-8").splitlines()
        done = {tuple(json.loads(line)[key] for key in ("problem", "variant", "seed", "guess")) for line in lines}
    problems, motions = {}, {}
    with open(arguments.runs, "a", encoding="utf-8") as file:
        for trial in range(arguments.count):
            for entry in entries:
                name = entry["name"]
                missing = [variant for variant in arguments.variants if (name, variant, arguments.seed, trial) not in done]
                if not missing:
                    continue
                if name not in problems:
                    problems[name] = Problem(arguments.directory / entry["files"]["problem"])
                guess = make_guess(problems[name], trial, arguments.seed)
                for variant in missing:
                    if arguments.until and f"{datetime.datetime.utcnow():%H:%M}" >= arguments.until:
                        return 0
                    if (name, variant) not in motions:
                        motions[name, variant] = make_motion(arguments.directory, entry, VARIANTS[variant][0])
                    outcome = run(motions[name, variant], guess, VARIANTS[variant][1])
                    line = {"problem": name, "variant": variant, "seed": arguments.seed, "guess": trial, **outcome}
                    file.write(json.dumps(line) + "\n")
                    file.flush()
                    print(f"{trial:3} {name:40} {variant:25} {outcome['end']:12} {outcome['iterations']:4} "
                          f"{outcome['seconds']:8.2f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
