#!/usr/bin/env python3
"""Writes docs/results/play.md: what play at the rods of Bipetto's ankles does to postures, walks and pushes.

    docs/results/play.py [--bielle build/bin/bielle] [--quick]

Carries out a squat, a walk and pushed walks, two at a time; takes some minutes of processor time.
"""
import concurrent.futures
import json
import pathlib

import numpy as np

import common

PLAYS = [0, 3e-4, 1e-3, 3e-3]  # m
DIRECTIONS = range(0, 360, 60)
IMPULSE = 16  # N s
RODS = "closure_ankle*"
STILL = 1.5  # s at the end


class Carried:
    """A motion carried out, beside its plan."""

    def __init__(self, directory):
        self.summary = json.loads((pathlib.Path(directory) / "summary.json").read_text(encoding="utf-8"))
        place = pathlib.Path(directory) / "trajectory.npz"
        if not place.exists():
            return
        happened, plan = np.load(place), np.load(place.with_name("plan.npz"))
        self.time, self.names = happened["time"], list(happened["q_names"])
        self.q, self.planned, self.gap = happened["q"], plan["q"], happened["gap"][:, 0]

    def tilt(self):
        """Of the trunk about y over the last seconds, rad: error and range."""
        last = self.time > self.time[-1] - STILL
        k = self.names.index("root_joint.qy")
        error = 2 * (self.q[last, k] - self.planned[last, k])
        return np.mean(error), np.ptp(error)

    def outcome(self):
        return self.summary["outcome"]

    def lost(self):
        return self.summary["books"]["stop_loss_J"]


def add_play(play):
    return ["--play", f"{RODS}={play}"] if play else []


def measure(runner, pool, plays, directions):
    """{(play, kind): Carried}, kind being squat, walk, sensed or a direction in degrees."""
    squat = runner.solve("squat", "bipetto").directory
    walk = runner.solve("walk", "bipetto", ["--speed", 0.5]).directory
    kinds = {"squat": [squat, "--hold", 3], "walk": [walk], "sensed": [walk, "--sensors", "real"]}
    for direction in directions:
        kinds[direction] = [walk, "--summary-only", "--push", f"t=1.5,impulse={IMPULSE},direction={direction}"]

    def carry_out(play, kind):
        place = runner.place(f"{kind}-{play}")
        runner.run("simulate", *kinds[kind], "--threads", 1, "--no-report", "-o", place, *add_play(play), allowed=(0, 1, 3))
        return Carried(place)

    runs = {(play, kind): pool.submit(carry_out, play, kind) for kind in kinds for play in plays}
    return {key: run.result() for key, run in runs.items()}


def describe(page, runs, plays, directions):
    page.add(f"""Both rods of each of Bipetto's ankles have play, the way from stop to stop (`bielle simulate --play '{RODS}=0.0003'`,
[how](../execution.md#play)), in world `bielle`. Neither plan nor controller know.""")
    page.heading("Standing")
    page.add(f"""After a squat under predictive control, over its last {STILL} s: the pitch of the trunk beside the plan, how far it
moves to and fro, and how far the loops are open.""")
    rows = []
    for play in plays:
        run = runs[play, "squat"]
        mean, swing = run.tilt()
        rows.append([f"{1e3 * play:g}", run.outcome(), f"{1e3 * mean:.2f}", f"{1e3 * swing:.2f}", f"{1e3 * run.gap[-1]:.3f}"])
    page.table(["play [mm]", "outcome", "pitch off plan [mrad]", "moves by [mrad]", "loops open [mm]"], rows)
    swings = [runs[play, "squat"].tilt()[1] for play in plays]
    if max(swings) < 1.1 * swings[0]:
        page.add("""There is no limit cycle: nothing moves to and fro more than without play, and the loop that is open farthest stays
at the end of its play, where the weight holds it.""")
    page.heading("Walking")
    page.add("""A walk at 0.5 m/s under predictive control, with the true state and with that of an estimator (`--sensors real`), which
closes the loops as if there were no play. Loops are open by half the play, and what its ends give way. What is lost, the ends of play took. Of the pushes,
to six sides at 1.5 s, those are counted that the walk with the true state survives.""")
    rows = []
    for play in plays:
        walk = runs[play, "walk"]
        caught = sum(runs[play, direction].outcome() == "stood" for direction in directions)
        rows.append([f"{1e3 * play:g}", walk.outcome(), runs[play, "sensed"].outcome(),
                     f"{1e3 * walk.summary['largest_deviation']:.0f}", f"{walk.summary['mean_speed']:.3f}",
                     f"{1e3 * walk.gap.max():.3f}", f"{walk.lost():.3f}", f"{runs[play, 'sensed'].lost():.3f}",
                     f"{caught} of {len(directions)}"])
    page.table(["play [mm]", "walk", "with sensors", "largest deviation [mm]", "mean speed [m/s]", "loops open [mm]",
                "lost [J]", "with sensors [J]", f"pushes of {IMPULSE} N s"], rows)


def main():
    arguments = common.make_parser(__doc__).parse_args()
    plays, directions = (PLAYS[:2], [90]) if arguments.quick else (PLAYS, DIRECTIONS)
    runner = common.Runner(arguments.bielle)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        runs = measure(runner, pool, plays, directions)
    page = common.Page(__file__, "What play at the ankles does", common.describe_run(arguments.commit))
    describe(page, runs, plays, directions)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
