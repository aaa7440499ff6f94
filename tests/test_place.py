"""test_place.py BIELLE [rest]: motions do not depend on where on the ground a robot stands, nor on which way it faces: moved
and turned, it has the same cost, the same torques and the moved trajectory, and is carried out likewise. However its stance is
given: by the places of its feet, with or without their yaws or the place of its base, by a keyframe of MuJoCo's format, by angles alone, or
by the origin of a floating joint of a URDF; nor on where the frame of its base is. A walk, and every way to give its stance to a squat; with
`rest`, all other motions, other places, two levels, toes that are turned out, and terrain."""
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

program = os.path.abspath(sys.argv[1])
REST = "rest" in sys.argv
ROBOTS = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "robots")
BRIEFLY = ("--control", "open", "--duration", 0.1, "--no-report")  # what is told comes at once
OFFSET = 0.125  # of the feet of rsu_biped from its middle, m
PLACE = (2.0, -3.0, 0.4, 0.7)  # x, y, z, heading
# On level ground, shifted alone, turned alone, and all at once.
OTHERS = [(0.5, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, math.pi / 2), (-1.0, 4.0, 0.3, -2.8)]
MOTIONS = {
    "squat": ["squat", "--depth", "0.85"],
    "walk": ["walk", "--speed", "0.4"],
    "jump": ["jump", "--flight", "0.2"],
}
REST_OF_MOTIONS = {
    "back": ["walk", "--speed", "-0.2", "--set", "com_velocity_weight=1"],
    "side-walk": ["side-walk", "--speed", "0.15"],
    "turn": ["turn", "--angle", "1", "--radius", "0.4"],
    "stairs": ["stairs", "--height", "0.05", "--stairs", "2"],
    "box": ["box", "--height", "0.05", "--down"],
    "gap": ["gap", "--width", "0.1"],
    "jump forward": ["jump", "--flight", "0.2", "--length", "0.1"],
    "impact": ["walk", "--speed", "0.3", "--set", "rigid_landing=true", "--set", "landing_speed=0.05"],
    "run": ["run", "--speed", "0.6"],
    "hop": ["hop", "--flight", "0.1"],
    "footholds": ["footholds"],
    "sequence": ["sequence", "--motions", "squat,walk,stairs"],
}


def run(*arguments, status=(0,)):
    done = subprocess.run([program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode in status, f"{arguments}\n{done.stdout}"
    return done.stdout


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(text)
    return path


def move(place, point):
    x, y, z, heading = place
    c, s = math.cos(heading), math.sin(heading)
    return [x + c * point[0] - s * point[1], y + s * point[0] + c * point[1], z + point[2]]


def turn(heading, w, x, y, z):
    """The quaternion turned about the vertical."""
    c, s = math.cos(heading / 2), math.sin(heading / 2)
    return [c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w]


def make_feet(directory, place, yaws=False, base=False, toes=0.0):
    feet = ""
    for side, y in (("left", OFFSET), ("right", -OFFSET)):
        at = move(place, [0, y, 0])
        yaw = place[3] + (toes if y > 0 else -toes)
        feet += f"foot_{side}: {{place: {at}, yaw: {yaw!r}}}, " if yaws else f"foot_{side}: {at}, "
    joints = f"hipz_left: {toes}, hipz_right: {-toes}, "
    if base:
        w, x, y, z = turn(place[3], 1, 0, 0, 0)
        joints += f"root_joint: {move(place, [0, 0, 0.575]) + [x, y, z, w]}"
    return write(f"{directory}/robot.yaml", "help: rsu_biped, moved\ntree:\n  biped: {part: rsu_biped}\nreferences:\n"
                 f"  half_sitting: {{joints: {{{joints}}}, feet: {{{feet}}}}}\n")


def make_keyframe(directory, place):
    path = f"{directory}/robot.xml"
    os.makedirs(directory, exist_ok=True)
    run("convert", "rsu_biped", "--to", "mjcf", "-o", path)
    with open(path) as file:
        text = file.read()
    qpos = [float(q) for q in re.search(r'qpos="([^"]*)"', text).group(1).split()]
    qpos[:7] = move(place, qpos[:3]) + turn(place[3], *qpos[3:7])
    return write(path, re.sub(r'qpos="[^"]*"', f'qpos="{" ".join(map(repr, qpos))}"', text))


def make_angles(directory, place, floating=False):
    """Bipetto with a reference of angles alone: those of its half_sitting, closed."""
    name, squat = f"{directory}/bipetto", f"{directory}/squat-of-bipetto"
    run("solve", "squat", "--robot", f"{ROBOTS}/bipetto", "--max-iterations", 1, "--no-check", "--no-report", "-o", squat, status=(0, 1))
    with np.load(f"{squat}/trajectory.npz") as record:
        q = dict(zip(record["q_names"].tolist(), record["q"][0]))
        base = record["q"][0, :7].tolist()
    shutil.copytree(f"{ROBOTS}/bipetto", name, dirs_exist_ok=True)
    with open(f"{name}/bipetto.yaml") as file:
        text, references = file.read().split("references:\n")
    joints = re.findall(r"^ +((?:hip|knee|ankle)\w+):", references, re.MULTILINE)
    after = re.search(r"^\w", references, re.MULTILINE)
    at_home = base if floating else move(place, base[:3]) + [turn(place[3], base[6], *base[3:6])[i] for i in (1, 2, 3, 0)]
    angles = "".join(f"      {joint}: {q[joint]!r}\n" for joint in joints)
    write(f"{name}/bipetto.yaml", f"{text}references:\n  half_sitting:\n    joints:\n{angles}      root_joint: {at_home}\n"
          + (references[after.start():] if after else ""))
    if not floating:
        return name
    with open(f"{name}/bipetto.urdf") as file:
        urdf = file.read()
    links = set(re.findall(r'<link\s+name="([^"]*)"', urdf))
    root = (links - set(re.findall(r'<child\s+link="([^"]*)"', urdf))).pop()
    joint = (f'<link name="world"/><joint name="root_joint" type="floating"><parent link="world"/><child link="{root}"/>'
             f'<origin xyz="{place[0]} {place[1]} {place[2]}" rpy="0 0 {place[3]}"/></joint></robot>')
    write(f"{name}/bipetto.urdf", urdf.replace("</robot>", joint))
    return name


WAYS = {
    "feet": make_feet,
    "feet with yaws": lambda directory, place: make_feet(directory, place, yaws=True),
    "feet and base": lambda directory, place: make_feet(directory, place, base=True),
    "toes out": lambda directory, place: make_feet(directory, place, toes=0.2),
    "toes out by yaws": lambda directory, place: make_feet(directory, place, yaws=True, toes=0.2),
    "keyframe": make_keyframe,
    "angles": make_angles,
    "floating joint": lambda directory, place: make_angles(directory, place, floating=True),
}


def read(directory):
    with open(f"{directory}/summary.json") as file:
        return json.load(file), np.load(f"{directory}/trajectory.npz")


def compare(name, place, was, now):
    """Of the trajectories, once the second is moved back: largest differences of places and angles, and of torques, relative."""
    a, b = was["q"], now["q"]
    assert a.shape == b.shape, f"{name}: {a.shape[0]} nodes, {b.shape[0]} where it is moved"
    moved = np.array([move(place, q) for q in a[:, :3]])
    turned = np.array([turn(place[3], q[6], q[3], q[4], q[5]) for q in a])[:, [1, 2, 3, 0]]
    turned *= np.sign(np.sum(turned * b[:, 3:7], axis=1))[:, None]
    places = max(np.abs(moved - b[:, :3]).max(), np.abs(turned - b[:, 3:7]).max(), np.abs(a[:, 7:] - b[:, 7:]).max())
    return places, np.abs(was["u"] - now["u"]).max() / (np.abs(was["u"]).max() or 1)


def solve(directory, robot, motion, arguments, *options):
    if motion == "footholds":
        stones = "".join(f"  - {{foot: {'right' if i % 2 == 0 else 'left'}, x: {0.15 * (i + 1)}, "
                         f"y: {-OFFSET if i % 2 == 0 else OFFSET}, z: {0.02 * (i % 3)}}}\n" for i in range(3))
        arguments = arguments + ["--footholds", write(f"{directory}/stones.yaml", f"footholds:\n{stones}")]
    result = f"{directory}/{motion.replace(' ', '-')}"
    if not os.path.exists(result):
        run("solve", *arguments, "--robot", robot, "--threads", 1, "--no-report", *options, "-o", result)
    return result


def check_motion(where, way, make, motion, arguments, places, *options):
    """What is the same elsewhere is not checked at home."""
    home = f"{where}/{way.replace(' ', '-')}"
    at_home = solve(home, make(home, (0, 0, 0, 0)), motion, arguments, "--no-check")
    was, trajectory = read(at_home)
    for place in places:
        there = f"{home}-{(OTHERS + [PLACE]).index(place)}"
        name = f"{motion}, {way}, at {place}"
        result = solve(there, make(there, place), motion, arguments, *options)
        now, moved = read(result)
        cost = abs(now["cost"] / was["cost"] - 1)
        off, torques = compare(name, place, trajectory, moved)
        print(f"{name}: {now['iterations']} iterations, cost {now['cost']:.7g}, off by {cost:.1e}; places {off:.1e}, torques {torques:.1e}")
        # Rounding may decide whether a last iteration, which changes nothing any more, is still made.
        assert abs(now["iterations"] - was["iterations"]) <= 1, f"{name}: {was['iterations']} iterations at the origin"
        assert cost < 1e-10 and off < 1e-6 and torques < 1e-6, name
    return at_home, result


def carry_out(motion, place, at_home, there, worlds):
    """By predictive control in Bielle's world, by gains in MuJoCo's, until the first foot is in the air."""
    for world in worlds:
        control = {"bielle": "mpc", "mujoco": "gains"}[world]
        carried = []
        for directory in (at_home, there):
            out = f"{directory}-{world}"
            run("simulate", directory, "--world", world, "--control", control, "--duration", 0.8, "--threads", 1, "--no-report", "-o", out,
                status=(0, 1, 3))
            carried.append(read(out))
        off, torques = compare(motion, place, carried[0][1], carried[1][1])
        print(f"{motion}, in world {world}: places {off:.1e}, torques {torques:.1e}")
        # MuJoCo's contacts are not quite the same in all directions: a walk that is turned ends up to 1.6e-3 elsewhere, one that is
        # only moved 1.5e-13.
        assert off < {"bielle": 1e-8, "mujoco": 5e-3}[world], f"{motion}, in world {world}"


def make_two_levels(directory, place, step=0.04, toes=0.0):
    """The left foot stands higher."""
    left, right = move(place, [0, OFFSET, step]), move(place, [0, -OFFSET, 0])
    return write(f"{directory}/robot.yaml", "help: rsu_biped with a foot on a box\ntree:\n  biped: {part: rsu_biped}\n"
                 f"references:\n  half_sitting: {{joints: {{hipz_left: {toes}, hipz_right: {-toes}}}, "
                 f"feet: {{foot_left: {left}, foot_right: {right}}}}}\n")


def walk_down(where, worlds):
    """From two levels, the right foot on the higher one. Under gains, which have no reserve, soles must bear what the plan asks of
    them, as on level ground."""
    robot, result = make_two_levels(f"{where}/levels-right", PLACE, step=-0.05), f"{where}/levels-right-walk"
    run("solve", "walk", "--speed", "0.35", "--robot", robot, "--threads", 1, "--no-report", "-o", result)
    for world in worlds:
        told = run("simulate", result, "--world", world, "--control", "gains", "--no-report", "-o", f"{result}-{world}", status=(0, 1, 3))
        assert "it stood" in told and "turned from the ground" not in told, told
    return result


def check_levels(where, worlds):
    """Motions that can stand on two levels pass the check, whose ground has a box, and are carried out; others are refused."""
    for name, arguments in [("squat", ["squat", "--depth", "0.9"]), ("walk", ["walk", "--speed", "0.2"]),
                            ("jump", ["jump", "--flight", "0.2"])]:
        result = f"{where}/levels-{name}"
        robot = make_two_levels(f"{where}/levels", PLACE, toes=0.1)
        told = run("solve", *arguments, "--robot", robot, "--threads", 1, "--no-report", "-o", result)
        assert "passed" in told, told
        ground = read(result)[0]["ground"]
        assert len(ground["steps"]) == 1 and abs(ground["height"] - PLACE[2]) < 1e-9, ground
        box = ground["steps"][0]["top"]
        assert np.abs(np.array(box) - move(PLACE, [0, OFFSET, 0.04])).max() < 1e-9, box
        print(f"on two levels: {name}, {read(result)[0]['iterations']} iterations")
        if name in ("squat", "walk"):
            assert "it stood" in run("simulate", result, "--no-report", "-o", f"{result}-done")
    for arguments in (["run"], ["hop"], ["stairs"], ["box"], ["gap"], ["jump", "--length", "0.1"], ["sequence", "--motions", "squat,run"],
                      ["turn", "--angle", "0.5"], ["walk", "--speed", "0.05"]):
        told = run("solve", *arguments, "--robot", robot, "-o", f"{where}/refused", status=(2,))
        assert "'foot_left' at 0.44 m" in told and "'foot_right' at 0.4 m" in told, told
    # A tenth of a millimetre is no step.
    robot = make_two_levels(f"{where}/level", (0, 0, 0, 0), step=9e-5)
    run("solve", "squat", "--robot", robot, "--threads", 1, "--no-report", "-o", f"{where}/level/squat")
    assert read(f"{where}/level/squat")[0]["ground"]["steps"] == []
    # The other foot is higher: the first step goes down, and not onto the edge.
    robot = make_two_levels(f"{where}/levels-right", PLACE, step=-0.05)
    told = run("solve", "walk", "--speed", "0.3", "--robot", robot, "-o", f"{where}/refused", status=(2,))
    assert "within 0.01 m of it" in told and "longer steps" in told, told
    result = walk_down(where, worlds)
    told = run("simulate", result, "--no-report", "-o", f"{result}-done")
    assert "it stood" in told and "turned from the ground" not in told, told


def check_free(where):
    """Without a plan, too, a robot has its ground where it stands."""
    done = []
    for name, robot in (("home", make_feet(f"{where}/free", (0, 0, 0, 0))), ("there", make_feet(f"{where}/free-there", PLACE)),
                        ("levels", make_two_levels(f"{where}/free-levels", PLACE))):
        told = run("simulate", robot, "--duration", 0.1, "--no-report", "-o", f"{where}/free-{name}")
        assert "starts" not in told, told
        done.append(read(f"{where}/free-{name}"))
    (home, at_home), (there, moved), (levels, _) = done
    off, _ = compare("free motion", PLACE, at_home, moved)
    assert off < 1e-7, off  # its error of 1e-9 a step adds up to a hundred times as much
    assert home["ground"]["height"] == 0 and abs(there["ground"]["height"] - PLACE[2]) < 1e-9
    assert len(levels["ground"]["steps"]) == 1 and home["books"]["contact_loss_J"] > 0
    told = run("simulate", robot, "--duration", 0.01, "--terrain", "flat", "--no-report", "-o", f"{where}/free-flat")
    assert "'foot_left' starts 0.04 m over the ground" in told and "'foot_right' starts" not in told, told


def check_yaws(where):
    """Toes stay out as they are given, and written robots are the same."""
    for way in ("toes out", "toes out by yaws"):
        robot = WAYS[way](f"{where}/{way.replace(' ', '-')}-yaws", PLACE)
        told = run("info", robot)
        assert "is assembled with" not in told, told
        walk = f"{where}/{way.replace(' ', '-')}-walk"
        assert "passed" in run("solve", "walk", "--speed", "0.3", "--robot", robot, "--no-report", "-o", walk)
        summary, trajectory = read(walk)
        names = list(trajectory["q_names"])
        for joint, angle in (("hipz_left", 0.2), ("hipz_right", -0.2)):
            ends = trajectory["q"][[0, -1], names.index(joint)]
            assert np.abs(ends[0] - angle) < 2e-3 and np.abs(ends[1] - angle) < 0.02, (joint, ends)
        way_walked = trajectory["com"][-1] - trajectory["com"][0]
        # With toes ahead, too, the centre of mass ends 7 mm beside its way.
        assert abs(math.atan2(way_walked[1], way_walked[0]) - PLACE[3]) < 0.02, way_walked


def check_terrain(where):
    """Terrain lies ahead of the robot, wherever that is; what is out of its way, or not under its feet, is told."""
    for terrain, duration in (("ramp=0.03", 0), ("uneven=0.005", 0.5)):
        walks = []
        for walk in (f"{where}/feet/walk", f"{where}/feet-3/walk"):
            out = f"{walk}-{terrain[:4]}"
            told = run("simulate", walk, "--control", "gains", "--terrain", terrain, "--duration", duration, "--threads", 1, "--no-report",
                       "-o", out, status=(0, 1, 3))
            assert "starts" not in told and "begins" not in told, told
            walks.append(read(out))
        (home, at_home), (there, moved) = walks
        assert len(home["ground"]["steps"]) == len(there["ground"]["steps"]) > 0
        for a, b in zip(home["ground"]["steps"], there["ground"]["steps"]):
            assert np.abs(np.array(move(PLACE, a["top"])) - b["top"]).max() < 1e-9
        off, _ = compare("terrain", PLACE, at_home, moved)
        print(f"on the same terrain elsewhere: places {off:.1e}")
        assert off < 2e-3
    told = run("simulate", f"{where}/feet-3/squat", "--terrain", "ramp=0.05", *BRIEFLY, "-o", f"{where}/ramp", status=(0, 1, 3))
    assert "--terrain begins 0.3 m ahead" in told and "starts" not in told, told
    levels = f"{where}/levels-squat"
    told = run("simulate", levels, "--terrain", "flat", *BRIEFLY, "-o", f"{where}/flat", status=(0, 1, 3))
    assert "'foot_left' starts 0.04 m over the ground" in told and "'foot_right' starts" not in told, told


def make_base(directory, rpy, at):
    """rsu_biped with another base, on which its trunk is fixed."""
    name = f"{directory}/biped"
    run("convert", "rsu_biped", "-o", name)
    with open(f"{name}/biped.urdf") as file:
        urdf = file.read()
    joint = (f'<link name="base"/><joint name="base_trunk" type="fixed"><parent link="base"/><child link="trunk"/>'
             f'<origin xyz="{at[0]} {at[1]} {at[2]}" rpy="{rpy[0]!r} {rpy[1]!r} {rpy[2]!r}"/></joint></robot>')
    write(f"{name}/biped.urdf", urdf.replace("</robot>", joint))
    return name


def check_bases(where, motion, arguments):
    """Nothing depends on how the axes of the base are called, which way they face and how they are inclined, and hardly anything on
    where its frame is."""
    quarter, results = math.pi / 2, []
    here, beside, above = (0, 0, 0), (0.3, 0.5, -0.2), (0, 0, 0.575)  # the last one is on the ground
    # rad, N m: planned, and carried out under predictive control
    exact, moved = ((1e-6, 1e-5),) * 2, ((0.01, 2),) * 2
    for i, (rpy, at, bounds) in enumerate([
            ((0, 0, 0), here, exact), ((0, 0, quarter), here, exact), ((quarter, 0, 0), here, exact), ((0, quarter, 0), here, exact),
            ((math.pi, 0, 0), here, exact), ((-quarter, 0, quarter), beside, moved), ((0, 0, 0), above, moved),
            ((0, 0, 0.65), here, exact), ((quarter, 0.65, 0), here, exact), ((0.21, 0, 0), here, exact),
            ((1.75, 0.87, -2.27), here, exact)]):
        robot = make_base(f"{where}/base-{i}", rpy, at)
        assert "is assembled with" not in run("info", robot), rpy
        result = solve(f"{where}/base-{i}", robot, motion, arguments)
        run("simulate", result, "--duration", 0.8, "--threads", 1, "--no-report", "-o", f"{result}-done", status=(0, 3))
        results.append((read(result), read(f"{result}-done")))
        assert all(goal["met"] for goal in results[-1][0][0]["goals"]), results[-1][0][0]["goals"]
        for (_, at_home), (_, there), (off, torque) in zip(results[0], results[-1], bounds):
            joints, torques = np.abs(at_home["q"][:, 7:] - there["q"][:, 7:]).max(), np.abs(at_home["u"] - there["u"]).max()
            print(f"{motion}, base turned by {rpy}, at {at}: joints {joints:.1e}, torques {torques:.1e}")
            assert joints < off and torques < torque, (joints, torques)


def give_posture(robot, start, at):
    """The reference becomes a posture as a whole: of the joints that it gives, and of a base at a point of the trunk."""
    x, y, z, w = (start[f"root_joint.q{axis}"] for axis in "xyzw")
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                  [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                  [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    base = (np.array([start[f"root_joint.{axis}"] for axis in "xyz"]) - R @ np.array(at)).tolist() + [x, y, z, w]
    with open(f"{robot}/biped.yaml") as file:
        text = file.read()
    text, count = re.subn(r"    joints:\n(?: {6}.*\n)+", "".join(
        ["    joints:\n", f"      root_joint: {base}\n"] + [f"      {name}: {q!r}\n" for name, q in start.items() if name in text]), text)
    assert count == 1, text
    write(f"{robot}/biped.yaml", text)


def check_origins(where, motion, arguments):
    """Of one posture, no plan depends on where on the trunk the origin of the base's frame is."""
    results, start = [], None
    for i, at in enumerate([(0, 0, 0), (0.03, 0.02, 0.05), (0.3, 0.5, -0.2)]):
        robot = make_base(f"{where}/origin-{i}", (0, 0, 0), at)
        if start is None:
            run("solve", "squat", "--robot", robot, "--max-iterations", 1, "--no-check", "--no-report", "-o", f"{robot}/squat", status=(0, 1))
            record = read(f"{robot}/squat")[1]
            start = dict(zip(record["q_names"].tolist(), record["q"][0].tolist()))
        give_posture(robot, start, at)
        results.append(read(solve(f"{where}/origin-{i}", robot, motion, arguments)))
        (home, at_home), (there, moved) = results[0], results[-1]
        joints, torques = np.abs(at_home["q"][:, 7:] - moved["q"][:, 7:]).max(), np.abs(at_home["u"] - moved["u"]).max()
        print(f"{motion}, origin of the base at {at}: joints {joints:.1e}, torques {torques:.1e}")
        assert joints < 2e-6 and torques < 1e-4 and abs(home["cost"] / there["cost"] - 1) < 1e-6, (joints, torques)


def check_without_height(where):
    """The legs decide how high the base is, by the angles that are given."""
    robot = make_base(f"{where}/without-height", (0, 0, 0), (0, 0, 0))
    with open(f"{robot}/biped.yaml") as file:
        text = file.read()
    text, count = re.subn(r"    joints:\n(?: {6}.*\n)+    height: .*\n", "    joints: {knee_left: 0.8, knee_right: 0.8}\n", text)
    assert count == 1, text
    write(f"{robot}/biped.yaml", text)
    assert "is assembled with" not in run("info", robot)
    run("solve", "squat", "--robot", robot, "--max-iterations", 1, "--no-check", "--no-report", "-o", f"{robot}/squat", status=(0, 1))
    start = dict(zip(read(f"{robot}/squat")[1]["q_names"].tolist(), read(f"{robot}/squat")[1]["q"][0]))
    assert abs(start["knee_left"] - 0.8) < 0.01 and start["root_joint.z"] > 0.55 and start["root_joint.qw"] > 0.999, start


def main():
    known = run("simulate", "squat", "--world", "none", "-o", "none", status=(106, 105, 2))
    worlds = ["bielle"] + (["mujoco"] if "mujoco" in known else [])
    with tempfile.TemporaryDirectory() as where:
        for motion, arguments in {**MOTIONS, **REST_OF_MOTIONS}.items():
            if (motion == "walk") == REST:
                continue
            place = PLACE if motion in MOTIONS else OTHERS[-1]
            at_home, there = check_motion(where, "feet", make_feet, motion, arguments, [place])
            carry_out(motion, place, at_home, there, worlds if motion in ("squat", "walk") else ["bielle"])
        for way, make in WAYS.items():
            motion = "walk" if REST else "squat"
            check_motion(where, way, make, motion, MOTIONS[motion], [OTHERS[-1] if REST else PLACE], "--no-check")
        motion = ("turn", REST_OF_MOTIONS["turn"]) if REST else ("squat", MOTIONS["squat"])
        check_bases(where, *motion)
        check_origins(where, *motion)
        if REST:
            check_motion(where, "feet", make_feet, "walk", MOTIONS["walk"], OTHERS + [PLACE], "--no-check")
            check_yaws(where)
            check_levels(where, worlds + ["simbody"])
            check_terrain(where)
        else:
            check_without_height(where)
            check_free(where)


main()
