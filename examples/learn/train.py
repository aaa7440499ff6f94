#!/usr/bin/env python3
"""Learns to walk under pushes, on NumPy and Bielle's batch of worlds alone.

    examples/learn/train.py DIRECTORY [--minutes 120] [--serial]

Processor time counts, as of two cores for an hour. The same command goes on where one ended, or was ended: a checkpoint
is written every minute. policy.npz in the directory is what was learned; progress.json the curve. README.md tells the rest.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

import ars
from episodes import Walks
from imitate import imitate
from walk import FEATURES, SHAPE, Policy, load_plan, save

MEASURE = 10  # iterations from one measurement of what is learned to the next
RESUMED = ("directory", "minutes", "iterations", "threads", "checkpoint")  # may change when it goes on


def make_parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path)
    parser.add_argument("--minutes", type=float, default=120, help="of processor time, %(default)g")
    parser.add_argument("--iterations", type=int, default=10**9, help="at most, in all")
    parser.add_argument("--robot", default="bipetto", help="%(default)s")
    parser.add_argument("--speed", type=float, default=0.4, help="of the walk, m/s; %(default)g")
    parser.add_argument("--steps", type=int, default=8, help="%(default)d")
    parser.add_argument("--serial", action="store_true", help="learn on the robot's Approximate Serial model")
    parser.add_argument("--armature", default="", help="of the motors that it has at joints, kg m^2, or reflected: the "
                        "rotors as they appear there; default: 0.001, as in the paper")  # fmt: skip
    parser.add_argument("--impulse", type=float, default=4, help="of the hardest pushes, N s; %(default)g")
    parser.add_argument("--imitated", type=int, default=48, help="walks of a round of imitation; %(default)d")
    parser.add_argument("--pairs", type=int, default=24, help="directions tried forth and back; %(default)d")
    parser.add_argument("--best", type=int, default=16, help="of them, which move the parameters; %(default)d")
    parser.add_argument("--noise", type=float, default=0.05, help="size of the directions; %(default)g")
    parser.add_argument("--rate", type=float, default=0.03, help="step along them; %(default)g")
    parser.add_argument("--seed", type=int, default=1, help="%(default)d")
    parser.add_argument("--checkpoint", type=float, default=60, help="processor seconds from one to the next; %(default)g")
    parser.add_argument("--threads", type=int, default=0, help="0: all; results do not depend on it")
    return parser


def read_arguments(arguments=None):
    parser = make_parser()
    given = parser.parse_args(arguments)
    for name in ("minutes", "speed", "noise", "rate"):
        if not (np.isfinite(getattr(given, name)) and getattr(given, name) > 0):
            parser.error(f"--{name}: expected a positive number")
    for name, least in (("iterations", 1), ("steps", 2), ("imitated", 1), ("pairs", 1), ("best", 1), ("threads", 0), ("seed", 0)):
        if getattr(given, name) < least:
            parser.error(f"--{name}: expected {least} or more")
    if given.best > given.pairs:
        parser.error(f"--best: expected {given.pairs} or less, the number of --pairs")
    for name in ("impulse", "checkpoint"):
        if not 0 <= getattr(given, name) < np.inf:
            parser.error(f"--{name}: expected 0 or a positive number")
    settings = {name: value for name, value in vars(given).items() if name not in RESUMED}
    path = given.directory / "settings.json"
    if path.exists():
        before = json.loads(path.read_text())
        for name in settings:
            was = before.get(name, parser.get_default(name))
            if was != settings[name]:
                parser.error(f"--{name}: {given.directory} was begun with {was}; go on with that, or elsewhere")
    else:
        given.directory.mkdir(parents=True, exist_ok=True)
        save(path, lambda file: file.write(json.dumps(settings, indent=1).encode()))
    return given


def load_policy(given, plan, tell=print):
    """The imitated feedback, fitted first if that was not done."""
    path = given.directory / "imitation.npz"
    if not path.exists():
        gains, observer = imitate(plan, given.imitated, given.seed, given.threads, tell=tell)
        save(path, lambda file: np.savez(file, gains=gains, observer=observer))
    with np.load(path) as file:
        return Policy(plan, file["gains"], file["observer"])


def walk(walks, policy, thetas, mean, deviation, seed, watch=None, begin=None):
    """Walks of robots with a theta each (N, ..): mean rewards, whether they stood; number, sum and sum of squares of z."""
    policy.begin(walks.count)
    moments, fallen = np.zeros(1 + 2 * len(mean)), np.zeros(walks.count, dtype=bool)

    def control(k, observations, _):
        e = policy.observe(k, observations)
        z = policy.features(k, e)
        seen = z[~fallen]
        moments[:] += np.concatenate([[len(seen)], seen.sum(axis=0), (seen**2).sum(axis=0)])
        return policy.torques(k, e, policy.act(k, (z - mean) / deviation, thetas))

    def look(k, alive, state):
        fallen[:] = ~alive
        if watch is not None:
            watch(k, alive, state)

    returns, stood = walks.run(control, seed, look, begin)
    return returns, stood, moments


def main(arguments=None):
    given = read_arguments(arguments)
    tell = lambda line: print(line, flush=True)
    plan = load_plan(given.directory, given.robot, given.speed, given.steps, given.serial, given.armature)
    policy = load_policy(given, plan, tell)
    walks = Walks(plan, 2 * given.pairs, given.threads)
    exam = walks.draw(np.random.default_rng(given.seed + 1), given.impulse)
    stood = []

    def evaluate(thetas, mean, deviation, random):
        walks.set(walks.draw(random, given.impulse, given.pairs).repeated(2))
        returns, stands, moments = walk(walks, policy, thetas, mean, deviation, int(random.integers(2**31)))
        stood[:] = [stands.mean()]
        return returns, moments[0], moments[1 : 1 + FEATURES], moments[1 + FEATURES :]

    def measure(search):
        walks.set(exam)
        thetas = np.repeat(search.theta[None], walks.count, axis=0)
        returns, stands, _ = walk(walks, policy, thetas, *search.scales(), given.seed)
        return {"measured return": returns.mean(), "measured stood": stands.mean()}

    def iterate(search):
        row = measure(search) if search.iteration % MEASURE == 0 else {}
        returns = ars.step(search, evaluate, given.pairs, given.best, given.noise, given.rate)
        return {"return": returns.mean(), "stood": stood[0], **row}

    start = ars.Search(np.zeros(SHAPE), np.random.default_rng(given.seed), FEATURES)
    search, _ = ars.learn(given.directory, start, iterate, given.minutes, given.iterations, given.checkpoint, tell)
    mean, deviation = search.scales()
    learned = {"theta": search.theta, "mean": mean, "deviation": deviation}
    save(given.directory / "policy.npz", lambda file: np.savez(file, **learned, gains=policy.gains, observer=policy.observer))


if __name__ == "__main__":
    sys.exit(main())
