#!/usr/bin/env python3
"""Carries out what train.py has learned, and writes it as a result with a page to look at it.

    examples/learn/replay.py DIRECTORY -o OUTPUT [--world mujoco] [--impulse 2.5 --direction 90]

`bielle report OUTPUT` and `bielle export OUTPUT --format mjlab` read it as well.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

import bielle
import train
from episodes import PUSH, Conditions, Walks
from walk import Policy, load_plan


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, help="of train.py, without --serial")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--world", default="mujoco", choices=("bielle", "mujoco", "simbody"), help="%(default)s")
    parser.add_argument("--impulse", type=float, default=2.5, help="of the push, N s; %(default)g")
    parser.add_argument("--direction", type=float, default=90, help="0: forward, 90: to the left, degrees; %(default)g")
    parser.add_argument("--time", type=float, default=1.5, help="of the push, s; %(default)g")
    given = parser.parse_args(arguments)
    settings = json.loads((given.directory / "settings.json").read_text())
    if settings["serial"]:
        parser.error(f"{given.directory} is of the serial model, whose policy has no motors of the robot")
    plan = load_plan(given.directory, *(settings[name] for name in ("robot", "speed", "steps", "serial")))
    with np.load(given.directory / "policy.npz") as file:
        learned = dict(file)

    walks = Walks(plan, 1, engine=given.world)
    angle, bodies = np.radians(given.direction), len(plan.model.bodies)
    impulse = given.impulse * np.array([[[np.cos(angle), np.sin(angle)]]])
    walks.set(Conditions(np.ones((1, bodies)), np.ones(1), np.zeros(1), np.array([[given.time]]), impulse))
    recorder = bielle.Recorder(walks.env.worlds)

    def watch(k, alive, state):
        recorder.add(bielle.WorldState(**state), walks.env.readings.motor_torques)

    def begin(state):
        recorder.reset(bielle.WorldState(**state))

    policy = Policy(plan, learned["gains"], learned["observer"])
    rewards, stood, _ = train.walk(walks, policy, learned["theta"][None], learned["mean"], learned["deviation"], 1, watch, begin)
    push = {"time_s": given.time, "impulse_Ns": given.impulse, "direction_deg": given.direction, "duration_s": PUSH}
    outcome = "stood" if stood[0] else "fell"
    robot = bielle.load_robot(settings["robot"])
    for path in recorder.write(given.output, robot, "learned walk", outcome=outcome, control="policy", pushes=[push]):
        print(path)
    page = str(Path(given.output) / "report.html")
    bielle.write_report(page, [given.output])
    print(page)
    print(f"it {outcome}, mean reward {rewards[0]:.3f}")


if __name__ == "__main__":
    sys.exit(main())
