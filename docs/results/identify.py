#!/usr/bin/env python3
"""Writes docs/results/identify.md: a robot with errors, what logs tell of them, and what a controller does before and after.

    PYTHONPATH=build/python docs/results/identify.py [--bielle build/bin/bielle] [--quick]

Makes a Bipetto with errors, logs it on a stand in MuJoCo's world, identifies it, and lets both models walk with it. Takes some
minutes of processor time.
"""
import json
import math
import pathlib
import re
import shutil
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np

import bielle
import common

PERIOD, DURATION = 1e-3, 10  # s, of each log
ENCODER = 2 * math.pi / 2**14
TORQUE_NOISE = 0.02  # N m
GAINS = {"hip": (100.0, 3.0), "knee": (40.0, 1.0), "ankle": (20.0, 0.4)}  # N m/rad, N m s/rad
AMPLITUDES = {"hipy": 0.6, "hip": 0.2, "knee": 0.5, "ankle": 0.25}  # rad
WEIGHT, AHEAD = 2.0, 0.12  # kg, m
ARMATURE = 0.02  # kg m^2, of rotors behind their gears
FILTER = 0.2  # of speeds, per reading
FRICTION, DAMPING = 0.4, 0.05  # as drawn, N m, N m s/rad
SLOW = 0.8  # rad/s, friction_speed with which walks can be planned
SIDES = ("left", "right")
# Errors. Encoders of motors outside linkages have none: nothing is there to compare them with.
OFFSETS = {"knee": 0.5, "motor_knee": -0.5, "ankley": 0.5, "anklex": -0.5, "motor_ankle1": 0.5, "motor_ankle2": -0.5}  # deg
RODS = {"closure_knee": 1e-3, "closure_ankle1": -1e-3, "closure_ankle2": 1e-3}  # m
MASSES = {"thigh": 1.1, "shin": 0.9, "foot_plate": 1.1}
FRICTIONS = 0.8
# rad, m. MuJoCo's stops of rods give way by half a millimetre under these loads, which is play as well.
PLAYS = {"mujoco": {"motor_knee": 2e-3}, "bielle": {"motor_knee": 2e-3, "closure_ankle1": 3e-4, "closure_ankle2": 3e-4}}
CONTROLS = {"gains": ("--control", "gains", "--look-ahead", 36), "predictive": ("--control", "mpc")}
LINKS = {"closure_knee": "knee_rod_lower", "closure_ankle1": "ankle1_rod_lower", "closure_ankle2": "ankle2_rod_lower"}


def rotate(rpy):
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]])


def read_rpy(R):
    return np.array([math.atan2(R[2, 1], R[2, 2]), math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0])), math.atan2(R[1, 0], R[0, 0])])


def turn_about(axis, angle):
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


class Robot:
    """The files of a robot, to be changed."""

    def __init__(self, source, place):
        shutil.copytree(source, place)
        self.urdf, = pathlib.Path(place).glob("*.urdf")
        self.yaml, = pathlib.Path(place).glob("*.yaml")
        self.tree = ElementTree.parse(self.urdf)

    def joint(self, name):
        return self.tree.find(f"joint[@name='{name}']")

    def turn(self, name, angle):
        """Puts the zero of a joint elsewhere, as an encoder does that reads `angle` too much."""
        joint = self.joint(name)
        origin, axis = joint.find("origin"), np.array([float(x) for x in joint.find("axis").get("xyz").split()])
        R = rotate(np.array([float(x) for x in origin.get("rpy", "0 0 0").split()])) @ turn_about(axis, -angle)
        origin.set("rpy", " ".join(repr(float(x)) for x in read_rpy(R)))

    def lengthen(self, closure, length):
        """The half of a rod that ends at the first frame of a closure."""
        origin = self.joint(closure + "_A_frame").find("origin")
        xyz = np.array([float(x) for x in origin.get("xyz").split()])
        along = np.zeros(3)
        along[np.argmax(abs(xyz))] = np.sign(xyz[np.argmax(abs(xyz))])  # the halves run along x
        origin.set("xyz", " ".join(repr(float(x)) for x in xyz + length * along))

    def scale(self, link, factor):
        inertial = self.tree.find(f"link[@name='{link}']/inertial")
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        mass.set("value", repr(float(mass.get("value")) * factor))
        for key in list(inertia.attrib):
            inertia.set(key, repr(float(inertia.get(key)) * factor))

    def add_weight(self, link, mass, ahead):
        """A point of a mass ahead of the trunk, at the height of the link's frame."""
        inertial = self.tree.find(f"link[@name='{link}']/inertial")
        origin, own, inertia = inertial.find("origin"), inertial.find("mass"), inertial.find("inertia")
        com, before = np.array([float(x) for x in origin.get("xyz").split()]), float(own.get("value"))
        place = np.array(ahead)
        joint = (before * com + mass * place) / (before + mass)
        I = np.array([[float(inertia.get("i" + min(a, b) + max(a, b))) for b in "xyz"] for a in "xyz"])
        for weight, at in ((before, com), (mass, place)):
            d = at - joint
            I += weight * (d @ d * np.eye(3) - np.outer(d, d))
        origin.set("xyz", " ".join(repr(float(x)) for x in joint))
        own.set("value", repr(before + mass))
        for i, a in enumerate("xyz"):
            for j, b in enumerate("xyz"):
                if j >= i:
                    inertia.set("i" + a + b, repr(float(I[i, j])))

    def write(self, addition=""):
        self.tree.write(self.urdf)
        self.yaml.write_text(self.yaml.read_text() + addition)


def draw(place, source):
    """The robot as its makers believe it to be: Bipetto with friction and larger rotors."""
    robot = Robot(source, place)
    text = robot.yaml.read_text()
    assert text.count("armature: 1.0e-3") == 1
    robot.yaml.write_text(text.replace("armature: 1.0e-3", f"armature: {ARMATURE}"))
    robot.write(list_frictions(bielle.load_robot(place).model.u_names))


def list_frictions(motors, factor=1.0):
    return "\njoint_forces:\n" + "".join(
        f"  {motor}: {{stiffness: 0, damping: {DAMPING * factor}, friction: {FRICTION * factor}}}\n" for motor in motors)


def build(place, drawn):
    """The robot as it was built."""
    robot = Robot(drawn, place)
    for side in SIDES:
        for name, degrees in OFFSETS.items():
            robot.turn(f"{name}_{side}", math.radians(degrees))
        for name, length in RODS.items():
            robot.lengthen(f"{name}_{side}", length)
        for name, factor in MASSES.items():
            robot.scale(f"{name}_{side}", factor)
    text = robot.yaml.read_text()
    head, tail = text.split("\njoint_forces:\n")
    motors = [line.split(":")[0].strip() for line in tail.splitlines()]
    robot.yaml.write_text(head)
    robot.write(list_frictions(motors, FRICTIONS))


def load_feet(place, built, ahead):
    """The robot with a weight on each foot, so far ahead of the middle of its ankle: nobody tells the model of it."""
    robot = Robot(built, place)
    for side in SIDES:
        robot.add_weight(f"foot_plate_{side}", WEIGHT, ahead)
    robot.write()


def log(place, duration, seed, engine="mujoco"):
    """Sines of all motors on a stand: {column: values}."""
    stand = Robot(place, place + "_stand")
    stand.yaml.write_text(re.sub(r"(?ms)^references:.*?(?=^\w|\Z)", "", stand.yaml.read_text()))  # they stand on feet
    model = bielle.load_robot(place + "_stand", base="fixed").model
    motors = list(model.u_names)
    play = {f"{name}_{side}": size for name, size in PLAYS[engine].items() for side in SIDES}
    world = bielle.World(model, engine=engine, ground=bielle.Ground(height=-2.0), play=play)
    sensors = bielle.Sensors(world, noise=1.0, seed=seed)
    standing = bielle.load_robot(place).model  # its legs' posture
    q = standing.standing()
    q = model.close([q[list(standing.q_names).index(name)] for name in model.q_names], hold=motors)
    state = world.reset(q, np.zeros(model.nv))
    sensors.reset(-PERIOD)
    random = np.random.default_rng(seed)
    joints = [name + "_" + side for name in ("knee", "ankley", "anklex") for side in SIDES]
    positions = {name: list(model.q_names).index(name) for name in joints}
    start = sensors.read().motor_positions
    amplitudes = np.array([next(size for part, size in AMPLITUDES.items() if part in name) for name in motors])
    rates = 2 * math.pi * (0.15 + 0.05 * np.arange(len(motors)))
    columns = {name: [] for name in ["time"] + motors + joints + ["u." + name for name in motors]}
    kp, kd = (np.array([next(gains[i] for part, gains in GAINS.items() if part in name) for name in motors]) for i in (0, 1))
    before, speed = start, np.zeros(len(motors))
    for k in range(round(duration / PERIOD)):
        time = k * PERIOD
        readings = start if k == 0 else sensors.read().motor_positions
        wanted = start + amplitudes * np.sin(rates * time) * min(1, time)
        speed += FILTER * ((readings - before) / PERIOD - speed)
        u = kp * (wanted - readings) - kd * speed
        before = readings
        columns["time"].append(time)
        for name, reading, torque in zip(motors, readings, u):
            columns[name].append(reading)
            columns["u." + name].append(torque + TORQUE_NOISE * random.standard_normal())
        for name in joints:
            columns[name].append(round(state.q[positions[name]] / ENCODER) * ENCODER)
        state = world.step(u, PERIOD)
        if not state.ok:
            sys.exit(world.message)
    return {name: np.array(values) for name, values in columns.items()}


def identify(runner, robot, path, place, *options):
    runner.run("identify", robot, path, "--fixed-base", "--window", 0.05, *options, "-o", place)
    return json.loads((pathlib.Path(place) / "identified.json").read_text(encoding="utf-8"))


def apply(drawn, place, unknowns):
    """The drawn robot with what was found, its encoders set right. What is not seen stays."""
    robot, frictions = Robot(drawn, place), {}
    for (kind, name), one in unknowns.items():
        value = one["after"] if one["seen"] else one["before"]
        link = name.split(".")[0]
        if kind == "length":
            robot.lengthen(next(rod for rod, of in LINKS.items() if name.startswith(of)) + "_" + name.split("_")[-1], value - one["before"])
        elif kind == "offset":
            robot.turn(name, value)
        elif kind == "mass":
            robot.scale(link, value / one["before"])
        elif kind in ("friction", "damping"):
            frictions.setdefault(link, {})[kind] = max(0.0, value)
    head = robot.yaml.read_text().split("\njoint_forces:\n")[0]
    robot.yaml.write_text(head)
    robot.write("\njoint_forces:\n" + "".join(
        f"  {motor}: {{stiffness: 0, damping: {one['damping']}, friction: {one['friction']}}}\n"
        for motor, one in frictions.items()))


def soften(place):
    """A copy whose friction grows over a wider range of speeds, beside the robot."""
    robot = Robot(place, str(place) + "_to_walk")
    robot.yaml.write_text(re.sub(r"(friction: [^}]*)}", rf"\1, friction_speed: {SLOW}}}", robot.yaml.read_text()))
    return str(place) + "_to_walk"


def find(runner, work, engine):
    """Logs of one world and what they tell: {(kind, name): unknown}, and the directory of the robot that is found."""
    at = work / engine
    at.mkdir()
    for name, ahead in (("ahead", -AHEAD), ("behind", AHEAD)):  # x of a foot's plate is down, z behind
        load_feet(str(at / name), work / "built", (0.0115, 0, ahead))
    first, second = log(str(at / "ahead"), DURATION, 1, engine), log(str(at / "behind"), DURATION, 2, engine)
    np.savez(at / "loaded.npz", **{name: np.concatenate([first[name], second[name] + (DURATION if name == "time" else 0)])
                                   for name in first})
    shutil.copytree(work / "built", at / "bare")
    np.savez(at / "bare.npz", **log(str(at / "bare"), DURATION, 3, engine))
    found = identify(runner, work / "drawn", at / "loaded.npz", at / "lengths", "--play", "motor_knee*", "--play", "closure_ankle*")
    unknowns = {(one["kind"], one["name"]): one for linkage in found["linkages"] for one in linkage["unknowns"]}
    zeroed = Robot(at / "lengths", at / "zeroed")
    for (kind, name), one in unknowns.items():
        if kind == "offset" and one["seen"]:
            zeroed.turn(name, one["after"])
    zeroed.write()
    masses = [word for name in MASSES for word in ("--dynamics", name + "_*.mass")]
    dynamics = identify(runner, at / "zeroed", at / "bare.npz", at / "found", "--free", "none", "--no-offset", "*", *masses,
                        "--dynamics", "frictions")["dynamics"]
    unknowns.update({(one["kind"], one["name"]): one for one in dynamics["unknowns"]})
    apply(work / "drawn", at / "corrected", unknowns)
    return unknowns, at / "corrected"


def list_truth(engine):
    """{(kind, name): (as drawn, as built)}"""
    truth = {}
    for side in SIDES:
        for name, degrees in OFFSETS.items():
            truth["offset", f"{name}_{side}"] = 0, math.radians(degrees)
        for name, size in PLAYS[engine].items():
            truth["play", f"{name}_{side}.play"] = 0, size
    return truth


def show_rows(engine, unknowns):
    """Rows of the table: largest errors of each kind."""
    truth, rows = list_truth(engine), []
    groups = {"rods, mm": ("length", 1e3), "offsets, °": ("offset", 180 / math.pi), "play of gears, mrad": ("play", 1e3),
              "play of rods, mm": ("play", 1e3), "masses, %": ("mass", 100), "friction, %": ("friction", 100)}
    for title, (kind, unit) in groups.items():
        before, after, deviations, unseen, count = [], [], [], 0, 0
        for (of, name), one in unknowns.items():
            is_rod = one["unit"] == "m"
            if of != kind or (kind == "play" and is_rod != ("rods" in title)):
                continue
            drawn = one["before"]
            if kind == "length":
                built = drawn + next(RODS[rod] for rod, link in LINKS.items() if name.startswith(link))
            elif kind in ("offset", "play"):
                built = truth.get((kind, name), (0, 0))[1]
            else:
                built = drawn * (FRICTIONS if kind == "friction" else next(f for link, f in MASSES.items() if name.startswith(link)))
            share = unit / drawn if kind in ("mass", "friction") else unit
            count += 1
            before.append(abs(built - drawn) * share)
            if not one["seen"]:
                unseen += 1
                continue
            after.append(abs(one["after"] - built) * share)
            deviations.append(one["deviation"] * share)
        form = "{:.2g}"
        rows.append([title, str(count), form.format(max(before)), form.format(max(after)) if after else "–",
                     form.format(max(deviations)) if deviations else "–", str(unseen)])
    return rows


def carry_out(runner, plans, built, world):
    rows = []
    for title, options in CONTROLS.items():
        row = [world, title]
        for plan in plans:
            place = pathlib.Path(runner.place())
            runner.run("simulate", plan, "--robot", built, "--world", world, *options, "--no-report", "--summary-only", "-o", place)
            summary = json.loads((place / "summary.json").read_text(encoding="utf-8"))
            row.append("stands" if summary["outcome"] == "stood" else "falls")
        rows.append(row)
    return rows


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    work = pathlib.Path(runner.directory.name) / "work"
    work.mkdir()
    draw(str(work / "drawn"), common.SOURCE / "robots/bipetto")
    build(str(work / "built"), work / "drawn")
    page = common.Page(__file__, "A robot with errors, before and after", common.describe_run(arguments.commit))
    page.add(f"""Bipetto with friction ({FRICTION} N m, {DAMPING} N m s/rad) and rotors of {ARMATURE} kg m² at every motor is built with
        errors that its model does not know: rods 1 mm too long or too short, encoders of both motors and joints of all four linkages 0.5°
        off, thighs and feet 10 % too heavy and shins 10 % too light, friction 20 % less, 2 mrad of play behind the gears of the knees, and
        in Bielle's world 0.3 mm in the rods of the ankles. [How](../identify.md).""",
        f"""It hangs on a stand, its feet in the air, and every motor swings to and fro at its own rate: {DURATION} s with 2 kg ahead of
        each ankle and {DURATION} s with 2 kg behind it, of which the model knows nothing, so that the loads of play change sides; and
        {DURATION} s without. Encoders have 14 bits, torques noise of {TORQUE_NOISE} N m, rows come at 1 kHz. Lengths, offsets and play are
        found from the first two, masses and friction from the last.""",
        f"""Motors of the knees swing by {AMPLITUDES['knee']} rad. By 0.3 rad, everything else alike, one of the twelve offsets is 0.032° off,
        with a standard deviation of 0.017°: along so little of the linkage's curve an offset is nearly a length, and readings of 14 bits
        repeat while a joint turns slowly; if rows counted as independent, the deviation would be 0.0075°. Encoders that do not round
        leave 0.0007° even then.""")
    worlds = ["bielle"] if arguments.quick else ["mujoco", "bielle"]
    found = {}
    for world in worlds:
        unknowns, found[world] = find(runner, work, world)
        page.heading({"mujoco": "In MuJoCo's world", "bielle": "In Bielle's world"}[world])
        page.table(["largest error of", "numbers", "before", "after", "standard deviation", "not seen"], show_rows(world, unknowns))
    page.add("""MuJoCo's stops of the play of rods give way by about as much as the play itself under these loads, which is measured as play;
        they are therefore left out in its world, where none is found.""")
    page.heading("The controller")
    page.add(f"""A walk at 0.4 m/s, planned with the robot as drawn and with the robot as found in the same world, encoders set right by what
        was found, carried out by the robot as built; friction has its full size above {SLOW} rad/s, else it is too steep to
        plan with. Gains of the solver about the plan, those of at least 36 ms before the end of each
        contact phase, and predictive control:""")
    built, drawn, rows = soften(work / "built"), soften(work / "drawn"), []
    for world in worlds:
        plans = [runner.solve("walk", robot, ["--speed", 0.4, "--set", "steps=6", "--no-check"]).directory
                 for robot in (drawn, soften(found[world]))]
        rows += carry_out(runner, plans, built, world)
    page.table(["world", "control", "as drawn", "as found"], rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
