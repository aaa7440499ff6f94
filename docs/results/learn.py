#!/usr/bin/env python3
"""Writes docs/results/learn.md and docs/images/learn.svg from docs/results/data/learn.json: walks that were learned by
examples/learn/train.py, carried out.

    docs/results/learn.py                                   writes page and figure
    docs/results/learn.py --measure controllers             measures predictive control and gains first
    docs/results/learn.py --measure own CLOSED SERIAL       measures what was learned, in Bielle's world or in MuJoCo's;
    docs/results/learn.py --measure mujoco CLOSED SERIAL    directories of train.py, the second with --serial
    docs/results/learn.py --measure rotors SERIAL REFLECTED        measures what imitation on serial models does on the
                                                            closed robot; REFLECTED with --armature reflected as well

`--quick` learns for an iteration itself. The package `bielle` is that beside the command, with engines.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import common

DATA = common.HERE / "data/learn.json"
IMAGE = common.SOURCE / "docs/images/learn.svg"
LEARN = common.SOURCE / "examples/learn"
MASSES = (0.9, 1.0, 1.1)
WALKS = {"own": 48, "rotors": 24}
PUSHES = [(1.5, angle) for angle in (0, 90, 180, 270)]  # s, degrees
IMPULSE = 2.5  # N s
HARDEST = (0, 2, 4)  # N s, of imitated walks
WAYS = {"the serial model": None, "ratios of the present posture": False, "constant ratios": True}
WALK = {"robot": "bipetto", "speed": 0.4, "steps": 8}
MEASURED = ("controllers", "own", "mujoco", "rotors")
CONTROLLERS = {"predictive control, true state": ["--control", "mpc"], "gains, true state": ["--control", "gains"],
               "gains, real sensors": ["--control", "gains", "--sensors", "real"]}  # fmt: skip


def import_example(bielle):
    """Of the build that has the command; of the path, if it has no package."""
    command = shutil.which(bielle) or bielle
    package = pathlib.Path(command).resolve().parents[1] / "python"
    sys.path[:0] = [str(LEARN), *([str(package)] if package.is_dir() else [])]
    global bielle_, episodes, linkages, np, train, walk
    import bielle as bielle_
    import numpy as np

    import episodes
    import linkages
    import train
    import walk


class Learned:
    """What a directory of train.py has."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        self.settings = json.loads((self.directory / "settings.json").read_text(encoding="utf-8"))
        s = self.settings
        self.plan = walk.load_plan(self.directory, s["robot"], s["speed"], s["steps"], s["serial"], s.get("armature", ""))
        with np.load(self.directory / "policy.npz") as file:
            self.arrays = dict(file)
        self.rows = json.loads((self.directory / "progress.json").read_text(encoding="utf-8"))

    def policy(self):
        return walk.Policy(self.plan, self.arrays["gains"], self.arrays["observer"])

    def walk(self, walks, policy, learned=True, seed=1):
        """(mean rewards, whether they stood), of the policy or with Theta = 0."""
        thetas = np.repeat(self.arrays["theta"][None], walks.count, axis=0) * learned
        return train.walk(walks, policy, thetas, self.arrays["mean"], self.arrays["deviation"], seed)[:2]


def scale_masses(robot, factor, directory):
    """A robot with all masses and inertias times a factor."""
    source = pathlib.Path(robot.directory)
    shutil.copytree(source, directory)
    path = pathlib.Path(directory) / pathlib.Path(robot.file).name
    tree = xml.etree.ElementTree.parse(path)
    for inertial in tree.iter("inertial"):
        for name in ("mass", "inertia"):
            for element in inertial.iter(name):
                for key in element.attrib:
                    element.set(key, repr(factor * float(element.get(key))))
    tree.write(path)
    return bielle_.load_robot(str(directory))


def make_conditions(model, pushes):
    angle = np.radians([angle for _, angle in pushes])
    count = len(pushes)
    impulses = IMPULSE * np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, None]
    times = np.array([[time] for time, _ in pushes])
    return episodes.Conditions(np.ones((count, len(model.bodies))), np.ones(count), np.zeros(count), times, impulses)


def count_of_command(runner, plan, robot, pushes, *options):
    """Runs of `bielle simulate` in MuJoCo's world that stand."""
    stood = 0
    for time, angle in pushes:
        directory = runner.place()
        print("simulate", *options, time, angle, file=sys.stderr, flush=True)
        push = f"t={time},impulse={IMPULSE:g},direction={angle},duration={episodes.PUSH}"
        runner.run("simulate", plan, "--robot", robot, "-o", directory, "--world", "mujoco", "--summary-only",
                   "--threads", 1, *options, "--push", push)  # fmt: skip
        stood += json.loads((pathlib.Path(directory) / "summary.json").read_text(encoding="utf-8"))["outcome"] == "stood"
    return stood


def list_policies(closed, serial, model, count):
    """[(name, of which run, policy, learned)]; of the serial model's, with both ways from joints to motors."""
    rows = [("imitated gains", closed, closed.policy(), False), ("**learned**", closed, closed.policy(), True)]
    for title, constant in (("ratios of the present posture", False), ("constant ratios", True)):
        for name, learned in (("imitated", False), ("learned", True)):
            between = linkages.Linkages(model, serial.plan.model, count, constant)
            rows.append((f"{name} on the serial model, {title}", serial, linkages.SerialPolicy(serial.policy(), between), learned))
    return rows


def measure_controllers(runner, pushes, masses):
    """[[name, walks that stand by mass, ...], ...] in MuJoCo's world."""
    robot = bielle_.load_robot(WALK["robot"])
    plan = runner.place()
    bielle_.make_result(walk.solve_walk(**WALK), robot).write(plan)
    scaled = [scale_masses(robot, factor, runner.place()).directory for factor in masses]
    return [[name, *(count_of_command(runner, plan, directory, pushes, *options) for directory in scaled)]
            for name, options in CONTROLLERS.items()]  # fmt: skip


def carry_out_in_mujoco(runner, closed, serial, pushes, masses):
    """The same of policies; of the serial model's what was learned."""
    robot, rows = bielle_.load_robot(closed.settings["robot"]), {}
    for factor in masses:
        model = scale_masses(robot, factor, runner.place()).model
        for name, run, policy, learned in list_policies(closed, serial, robot.model, len(pushes)):
            if run is serial and not learned:
                continue
            walks = episodes.Walks(run.plan, len(pushes), engine="mujoco", model=model)
            walks.set(make_conditions(model, pushes))
            rows.setdefault(name, []).append(int(run.walk(walks, policy, learned)[1].sum()))
            print(name, factor, rows[name], file=sys.stderr, flush=True)
    return [[name, *counts] for name, counts in rows.items()]


def carry_out_in_own(closed, serial, count):
    """[[name, walks that stand, mean reward], ...] under the conditions of learning, others than those."""
    model = closed.plan.model
    rows = []
    for name, run, policy, learned in list_policies(closed, serial, model, count):
        walks = episodes.Walks(run.plan, count, model=model)
        walks.set(walks.draw(np.random.default_rng(1000), closed.settings["impulse"]))
        rewards, stood = run.walk(walks, policy, learned)
        rows.append([name, f"{stood.mean():.0%}", f"{rewards.mean():.3f}"])
        print(*rows[-1], file=sys.stderr, flush=True)
    walks = episodes.Walks(serial.plan, count)
    walks.set(walks.draw(np.random.default_rng(1000), closed.settings["impulse"]))
    for name, learned in (("imitated", False), ("learned", True)):
        rewards, stood = serial.walk(walks, serial.policy(), learned)
        rows.append([f"{name} on the serial model, and carried out there", f"{stood.mean():.0%}", f"{rewards.mean():.3f}"])
    return rows


def carry_out_imitated(serial, reflected, count):
    """[[rotors of the serial model, carried out by, walks that stand by impulse, ...], ...]"""
    closed, rows = bielle_.load_robot(serial.settings["robot"]).model, []
    for rotors, run in (("of 0.001 kg m² at the joints", serial), ("as they appear at the joints", reflected)):
        for name, constant in WAYS.items():
            row = [rotors, name]
            for impulse in HARDEST:
                walks = episodes.Walks(run.plan, count, model=None if constant is None else closed)
                walks.set(walks.draw(np.random.default_rng(1000), impulse))
                policy = run.policy()
                if constant is not None:
                    policy = linkages.SerialPolicy(policy, linkages.Linkages(closed, run.plan.model, count, constant))
                row.append(f"{run.walk(walks, policy, learned=False)[1].mean():.0%}")
            rows.append(row)
            print(*row, file=sys.stderr, flush=True)
    return rows


def draw_curves(curves):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "learn", "svg.fonttype": "none", "font.size": 9})
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3))
    for name, curve in curves.items():
        minutes, rewards, stood = zip(*curve)
        axes[0].plot(minutes, rewards, label=name)
        axes[1].plot(minutes, stood, label=name)
    axes[0].set(xlabel="processor time [min]", ylabel="mean reward")
    axes[1].set(xlabel="processor time [min]", ylabel="share that stands", ylim=(0, 1))
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(IMAGE, metadata={"Date": None})
    plt.close(figure)


def describe_learning(run):
    keys, minutes = ("measured return", "measured stood"), lambda row, digits: round(row["seconds"] / 60, digits)
    curve = [[minutes(row, 2), *(row[key] for key in keys)] for row in run.rows if keys[0] in row]
    last = run.rows[-1]
    return {"iterations": last["iteration"], "minutes": minutes(last, 1), "settings": run.settings, "curve": curve}


def measure(what, runner, runs, pushes, masses, count):
    if what == "controllers":
        return {"rows": measure_controllers(runner, pushes, masses)}
    if what == "mujoco":
        return {"rows": carry_out_in_mujoco(runner, *runs, pushes, masses)}
    if what == "rotors":
        return {"count": count, "rows": carry_out_imitated(*runs, count)}
    learning = dict(zip(("closed robot", "serial model"), map(describe_learning, runs)))
    return {"learning": learning, "count": count, "rows": carry_out_in_own(*runs, count)}


def learn_quickly(directory, *options):
    few = ["--iterations", "1", "--pairs", "2", "--best", "1", "--steps", "2", "--imitated", "4"]
    train.main([str(directory), *few, *options])
    return Learned(directory)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--measure", choices=MEASURED, help="first")
    parser.add_argument("directories", nargs="*", help="CLOSED SERIAL")
    arguments = parser.parse_args()
    import_example(arguments.bielle)
    runner, now = common.Runner(arguments.bielle), common.describe_run(arguments.commit)
    if (arguments.measure in MEASURED[1:]) * 2 != len(arguments.directories):
        parser.error("expected two directories of train.py with --measure own, mujoco and rotors, and only there")
    if arguments.quick:
        with tempfile.TemporaryDirectory() as place:
            kinds = ([], ["--serial"], ["--serial", "--armature", "reflected"])
            runs = [learn_quickly(pathlib.Path(place) / str(len(more)), *more) for more in kinds]
            of = {what: runs[1:] if what == "rotors" else runs[:2] for what in MEASURED}
            data = {what: {"run": now, **measure(what, runner, of[what], PUSHES[:1], MASSES[:1], 2)} for what in MEASURED}
    else:
        measured = {}
        if arguments.measure:
            runs = [Learned(directory) for directory in arguments.directories]
            measured = {"run": now, **measure(arguments.measure, runner, runs, PUSHES, MASSES, WALKS.get(arguments.measure))}
        data = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {}
        if measured:
            data[arguments.measure] = measured
        DATA.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
        if len(data) < len(MEASURED):
            return
        draw_curves({name: run["curve"] for name, run in data["own"]["learning"].items()})
    write_page(data, arguments.quick)


REFLECTED = " Its rotors weigh what they appear to at the joints where the robot stands (`--armature reflected`)."


def tell_learning(name, run):
    first, last = run["curve"][0], run["curve"][-1]
    return f"""On the {name}: {run['iterations']} iterations in {run['minutes']:g} min of processor time. Of the same
{2 * run['settings']['pairs']} walks {first[2]:.0%} stood in the beginning and {last[2]:.0%} in the last measurement, with
mean rewards of {first[1]:.3f} and {last[1]:.3f}.{tell_rest(run["curve"])}"""


def tell_rest(curve):
    """What becomes of the reward after the first ten minutes, if there are many more."""
    rewards = [row[1] for row in curve if row[0] >= 10]
    if len(rewards) < 100:
        return ""
    third = len(rewards) // 3
    return f""" After ten minutes the mean reward varied between {min(rewards):.3f} and {max(rewards):.3f}; its means over the
first and the last third of that time are {sum(rewards[:third]) / third:.3f} and {sum(rewards[-third:]) / third:.3f}."""


def write_page(data, quick):
    own, mujoco, controllers = data["own"], data["mujoco"], data["controllers"]
    s = own["learning"]["closed robot"]["settings"]
    page = common.Page(__file__, "A walk that was learned", own["run"])
    page.add(f"""[`examples/learn`](../../examples/learn/README.md) learns where Bipetto's feet should be, other than on
Bielle's own walk of {s['speed']:g} m/s in {s['steps']} steps, from what encoders and an IMU read, under pushes of up to
{s['impulse']:g} N s from all sides, one in each 1.5 s, with masses off by up to 10 %, friction of 0.6 to 1 and delays of
up to 4 ms. It begins with the solver's gains, imitated from sensors alone. The goal is two cores for one hour, 120 min of
processor time.""")
    page.heading("Learning")
    for name, run in own["learning"].items():
        page.add(tell_learning(name, run))
    short = [name for name, run in own["learning"].items() if run["minutes"] < 119]
    if short:
        page.add(f"""Other programs had the machine, so that learning was cut short on the {" and the ".join(short)}; the same command
goes on from there.""")
    page.lines += ["", "![mean rewards and shares that stand, by processor time](../images/learn.svg)"]
    page.heading("Carried out under the conditions of learning")
    armature = own["learning"]["serial model"]["settings"].get("armature", "")
    page.add(f"""Other robots and pushes than those of learning, in Bielle's world with steps of 1 ms: how many of
{own['count']} walks stand, and their mean reward. What was learned on the serial model goes to the closed robot's motors
by the ratios of its loops, or by constant ones.{REFLECTED if armature == "reflected" else ""}""")
    page.table(["policy", "stood", "mean reward"], own["rows"])
    page.heading("Where the serial model errs")
    rotors = data["rotors"]
    page.add(f"""Ratios of the present posture are what the loops do: torques of motors that they give for weights in random
postures agree with differences of the potential energy along the motors (virtual work) within 1e-6 N m, and a slow crouch
ends within 2 mrad, with constant ratios 54 off (`python/tests/test_learn.py`). That they stand less often below has another
reason. A serial model with rotors of 0.001 kg m² at knees and ankles, as in the paper, is wrong where those behind the loops
appear as 0.0018 to 0.0042 kg m²: ankles of swinging legs lag by 0.15 rad, and feet land turned, after a second without any push.
With constant ratios, which read these angles wrongly by up to 0.03 rad, ankles lag as much about one axis, half as much about the
other, and the same walk bears it. On a serial model with rotors as they appear where the robot stands, imitation learns to swing
them, and both ways carry it over alike. Of {rotors['count']} walks of imitated
gains each, under pushes of up to 0, 2 and 4 N s (*{rotors['run']}*), stood""")
    page.table(["rotors of the serial model", "carried out by", *(f"{impulse} N s" for impulse in HARDEST)], rotors["rows"])
    page.heading("Carried out in MuJoCo's world")
    page.add(f"""Walks of {len(PUSHES)} that stand, under a push of {IMPULSE:g} N s at {PUSHES[0][0]:g} s each, forward, to
both sides and backward, by masses over those that plan and controllers know. Predictive control and gains get the true
state, or that of the estimator, every millisecond, by `bielle simulate` (*{controllers["run"]}*); policies read encoders
and an IMU every 4 ms, and count as fallen sooner: a trunk that is turned by 0.6 rad or below 0.75 of its height, instead
of 0.8 rad and 0.6. With real sensors gains look 36 ms ahead, as the imitated ones do; with the true state they do not,
and grow before each landing. Four pushes are few, and each was learned once, from one seed. They are of {IMPULSE:g} N s
because under 4 N s imitated gains and what had been learned for a minute stood in one of 8 walks.""")
    rows = [[str(cell) for cell in row] for row in controllers["rows"] + mujoco["rows"]]
    page.table(["control", *(f"masses × {factor:g}" for factor in MASSES[: len(rows[0]) - 1])], rows)
    page.write(quick)


if __name__ == "__main__":
    main()
