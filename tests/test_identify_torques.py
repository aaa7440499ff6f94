"""test_identify_torques.py BIELLE SOURCE: masses, armature and friction found again from torques, by `bielle identify --dynamics`, and
play, of which they tell at which stop it is, by `--play`.

Torques of a four-bar come from a closed form, Lagrange's equation of its one freedom, read with noise, and from MuJoCo. Masses are
wrong by a tenth, friction by a fifth.
"""
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    print("numpy is not installed")
    sys.exit(77)

BIELLE, SOURCE = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
ONLY = sys.argv[3:]
GROUND, CRANK, COUPLER, ROCKER, GRAVITY = 0.4, 0.15, 0.35, 0.3, 9.81
SLOW = 0.01  # rad/s, below which friction is a damper
DRAWN = {"crank.mass": 0.3, "coupler.mass": 0.7, "rocker.mass": 0.6, "crank_joint.armature": 2e-3, "crank_joint.damping": 0.05,
         "crank_joint.friction": 0.2}
TRUTH = {"crank.mass": 0.33, "coupler.mass": 0.63, "rocker.mass": 0.66, "crank_joint.armature": 2.4e-3, "crank_joint.damping": 0.06,
         "crank_joint.friction": 0.16}
OFFSET, GEAR = math.radians(0.5), 4e-3
ALL = [word for name in ("masses", "armatures", "frictions") for word in ("--dynamics", name)]


def run(*arguments, status=0):
    done = subprocess.run([BIELLE, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == status, (arguments, done.returncode, done.stdout, done.stderr)
    return done


def place_fourbar(crank_angle):
    """Ends of crank and rocker, as complex numbers x + i z."""
    crank = CRANK * np.exp(1j * crank_angle)
    to = GROUND - crank
    distance = abs(to)
    along = (distance**2 + COUPLER**2 - ROCKER**2) / (2 * distance)
    return crank, crank + (along + 1j * np.sqrt(COUPLER**2 - along**2)) * to / distance


def differentiate(f, x, h=1e-3):
    """Of fourth order; h is large enough that two of them leave rounding below 1e-9."""
    return (8 * (f(x + h) - f(x - h)) - f(x + 2 * h) + f(x - 2 * h)) / (12 * h)


def calc_inertia(angle, numbers):
    """Of slender rods and the rotor, reduced to the crank: twice the kinetic energy at unit speed."""
    crank, end = differentiate(lambda a: np.array(place_fourbar(a)), angle)
    rods = ((numbers["crank.mass"], 0, crank), (numbers["coupler.mass"], crank, end), (numbers["rocker.mass"], 0, end))
    # A rod whose ends go at a and b has the kinetic energy m/6 (a.a + a.b + b.b).
    return sum(mass / 3 * (abs(a)**2 + (a * np.conj(b)).real + abs(b)**2) for mass, a, b in rods) + numbers["crank_joint.armature"]


def calc_potential(angle, numbers):
    crank, end = place_fourbar(angle)
    return GRAVITY / 2 * (numbers["crank.mass"] * crank + numbers["coupler.mass"] * (crank + end) + numbers["rocker.mass"] * end).imag


def calc_loss_torque(speed, numbers):
    return numbers["crank_joint.damping"] * speed + numbers["crank_joint.friction"] * speed / np.hypot(speed, SLOW)


def swing(time):
    """Angle, speed and acceleration of the crank."""
    parts = ((1.3, 3.0, 0.0), (0.7, 5.2, 1.0), (0.25, 8.1, 2.0))
    return (1.9 + sum(a * np.sin(w * time + p) for a, w, p in parts), sum(a * w * np.cos(w * time + p) for a, w, p in parts),
            sum(-a * w * w * np.sin(w * time + p) for a, w, p in parts))


def calc_torque(time, numbers, motion=swing):
    angle, speed, acceleration = motion(time)
    inertia = lambda a: calc_inertia(a, numbers)
    return (inertia(angle) * acceleration + 0.5 * differentiate(inertia, angle) * speed**2
            + differentiate(lambda a: calc_potential(a, numbers), angle) + calc_loss_torque(speed, numbers))


def measure(path, numbers, seed=1, rows=10000, noise=1e-4, torque_noise=0.01, speeds=False, wrong=lambda columns: None):
    random = np.random.default_rng(seed)
    time = np.arange(rows) * 1e-3
    angle, speed, _ = swing(time)
    _, end = place_fourbar(angle)
    columns = {"time": time, "crank_joint": angle + noise * random.standard_normal(rows),
               "rocker_joint": np.unwrap(np.angle(end - GROUND)) + noise * random.standard_normal(rows),
               "u.crank_joint": calc_torque(time, numbers) + torque_noise * random.standard_normal(rows)}
    if speeds:
        columns["v.crank_joint"] = speed
        columns["v.rocker_joint"] = speed * differentiate(lambda a: np.unwrap(np.angle(place_fourbar(a)[1] - GROUND)), angle)
    wrong(columns)
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9f")
    return columns


def draw(place, numbers=DRAWN):
    """The four-bar of this project with these numbers."""
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(SOURCE / "robots/fourbar", place)
    urdf = pathlib.Path(place, "fourbar.urdf")
    text = urdf.read_text()
    for body, bodies in (("crank", ["crank"]), ("coupler", ["coupler", "coupler_far"]), ("rocker", ["rocker"])):
        factor = numbers[body + ".mass"] / {"crank": 0.3, "coupler": 0.7, "rocker": 0.6}[body]
        for one in bodies:
            head, rest = text.split(f'<link name="{one}">', 1)
            inertial, tail = rest.split("</inertial>", 1)
            for key in ("mass value", "iyy", "izz"):
                before, after = inertial.split(f'{key}="', 1)
                value, after = after.split('"', 1)
                inertial = f'{before}{key}="{float(value) * factor!r}"{after}'
            text = head + f'<link name="{one}">' + inertial + "</inertial>" + tail
    urdf.write_text(text)
    yaml = pathlib.Path(place, "fourbar.yaml")
    text = yaml.read_text()
    assert text.count("{effort: 10, velocity: 20}") == 1
    yaml.write_text(text.replace("{effort: 10,", f"{{armature: {numbers['crank_joint.armature']}, effort: 10,") +
                    f"\njoint_forces:\n  crank_joint: {{stiffness: 0, damping: {numbers['crank_joint.damping']}, "
                    f"friction: {numbers['crank_joint.friction']}}}\n")
    return place


def identify(robot, log, *options, place="found"):
    shutil.rmtree(place, ignore_errors=True)
    done = run("identify", robot, log, "-o", place, *options)
    with open(os.path.join(place, "identified.json"), encoding="utf-8") as file:
        return json.load(file)["dynamics"], done


def take(dynamics):
    return {one["name"]: one for one in dynamics["unknowns"]}


class IdentifyTorques(unittest.TestCase):
    def check(self, dynamics, truth=TRUTH):
        found = take(dynamics)
        self.assertEqual(set(found), set(truth))
        self.assertTrue(dynamics["converged"])
        for name, true in truth.items():
            one = found[name]
            self.assertTrue(one["seen"], one)
            self.assertLess(abs(one["after"] - true), (0.01 if one["kind"] == "mass" else 0.02) * true, one)
        return found

    def test_closed_form(self):
        draw("drawn")
        columns = measure("log.csv", TRUTH)
        dynamics, done = identify("drawn", "log.csv", *ALL)
        found = self.check(dynamics)
        squares = [((found[name]["after"] - true) / found[name]["deviation"])**2 for name, true in TRUTH.items()]
        self.assertLess(max(squares), 4**2, squares)
        self.assertGreater(max(squares), 0.01, squares)  # deviations say something
        self.assertEqual(dynamics["not_seen"], [])
        self.assertGreater(dynamics["misfit_before"], 5 * dynamics["misfit_after"])
        self.assertIn("coupler.mass", done.stdout)
        self.assertIn("<td>coupler.mass</td>", pathlib.Path("found/report.html").read_text(encoding="utf-8"))
        # The power balance of the log: what the motor gives is in the robot that was found, or lost by its friction.
        angle, speed, _ = swing(columns["time"])
        numbers = {name: one["after"] for name, one in found.items()}
        integrate = lambda power: np.sum((power[1:] + power[:-1]) / 2) * 1e-3
        energy = 0.5 * calc_inertia(angle, numbers) * speed**2 + calc_potential(angle, numbers)
        given = integrate(columns["u.crank_joint"] * speed)
        lost = integrate(calc_loss_torque(speed, numbers) * speed)
        self.assertGreater(lost, 1)
        self.assertLess(abs(given - lost - energy[-1] + energy[0]), 0.01 * lost)
        # The robot that is written has the numbers.
        again, _ = identify("found", "log.csv", *ALL, place="again")
        for name, one in take(again).items():
            self.assertAlmostEqual(one["before"], found[name]["after"], delta=1e-12)
            self.assertAlmostEqual(one["after"], found[name]["after"], delta=0.05 * found[name]["deviation"])
        # With measured speeds, and exact: nothing is left but what polynomials do not follow.
        measure("exact.csv", TRUTH, noise=0, torque_noise=0, speeds=True)
        dynamics, _ = identify("drawn", "exact.csv", *ALL)
        self.check(dynamics)
        self.assertLess(dynamics["misfit_after"], 1e-3)

    def test_what_is_not_seen(self):
        """Of rods in a plane that is upright, no torque tells how far centres of mass are out of it."""
        draw("drawn")
        measure("log.csv", DRAWN, rows=4000)
        dynamics, _ = identify("drawn", "log.csv", *ALL, "--dynamics", "crank.com.*")
        found = take(dynamics)
        self.assertIn({"crank.com.y": 1.0}, dynamics["not_seen"])
        self.assertIsNone(found["crank.com.y"]["after"])
        # Nor, beside a rotor, its mass: gravity tells but mass times distance.
        self.assertTrue(any({"crank.mass", "crank.com.x"} <= set(one) for one in dynamics["not_seen"]), dynamics["not_seen"])
        self.assertFalse(found["crank.mass"]["seen"])
        self.assertTrue(found["coupler.mass"]["seen"] and found["rocker.mass"]["seen"])
        for one in found.values():
            if one["seen"]:
                self.assertLess(abs(one["after"] - one["before"]), 5 * one["deviation"], one)

    def test_worlds(self):
        """Torques that `bielle simulate` carries out; the robot that is found then moves as the one that was built."""
        draw("drawn")
        draw("built", TRUTH)
        torques = "torques:\n" + "".join(
            f"  - {{time: {0.002 * k:.3f}, crank_joint: {0.9 * math.sin(0.011 * k) + 0.5 * math.sin(0.029 * k + 1):.6f}}}\n"
            for k in range(1000))
        pathlib.Path("torques.yaml").write_text(torques)

        def simulate(robot, place, world):
            done = subprocess.run([BIELLE, "simulate", robot, "--world", world, "--duration", "2", "--torques", "torques.yaml",
                                   "--record-period", "0.001", "--no-report", "-o", place], capture_output=True, text=True)
            if "without MuJoCo" in done.stderr:
                self.skipTest("MuJoCo is not built in")
            self.assertEqual(done.returncode, 0, done.stderr)
            return np.genfromtxt(os.path.join(place, "trajectory.csv"), delimiter=",", names=True, deletechars="")["q.crank_joint"]

        real = simulate("built", "real", "mujoco")
        for name in ("trajectory.csv", "trajectory.npz"):
            dynamics, _ = identify("drawn", os.path.join("real", name), "--window", "0.03", *ALL)
            self.check(dynamics)
        wrong = np.max(abs(simulate("drawn", "before", "mujoco")[:500] - real[:500]))
        right = np.max(abs(simulate("found", "after", "mujoco")[:500] - real[:500]))
        self.assertGreater(wrong, 0.1)
        self.assertLess(right, 0.1 * wrong)

    def test_motion(self):
        """The motion that shows most: within limits, one that the robot carries out, and with more to tell than another."""
        draw("drawn")
        draw("built", TRUTH)
        run("identify", "drawn", *ALL, "--motion", "5", "--window", "0.05", "-o", "motion")
        read = lambda path: np.genfromtxt(path, delimiter=",", names=True, deletechars="")
        plan = read("motion/motion.csv")
        self.assertLess(np.max(abs(plan["v.crank_joint"])), 20)
        self.assertLess(np.max(abs(plan["u.crank_joint"])), 10)
        # It moves as the closed form says, and returns.
        _, end = place_fourbar(plan["crank_joint"])
        self.assertLess(np.max(abs(np.exp(1j * plan["rocker_joint"]) - (end - GROUND) / ROCKER)), 1e-6)
        self.assertAlmostEqual(plan["crank_joint"][0], plan["crank_joint"][-1], delta=1e-6)
        self.assertLess(np.max(abs(np.gradient(plan["crank_joint"], 1e-3)[1:-1] - plan["v.crank_joint"][1:-1])), 1e-3)
        power = np.sum(plan["u.crank_joint"] * plan["v.crank_joint"]) * 1e-3  # of a period: what friction takes
        lost = np.sum(calc_loss_torque(plan["v.crank_joint"], DRAWN) * plan["v.crank_joint"]) * 1e-3
        self.assertAlmostEqual(power, lost, delta=1e-3 * lost)
        run("simulate", "drawn", "--state", "motion/start.json", "--torques", "motion/torques.yaml", "--duration", "1",
            "--record-period", "0.001", "--no-report", "-o", "carried")
        carried = read("carried/trajectory.csv")["q.crank_joint"]
        self.assertLess(np.max(abs(carried - plan["crank_joint"][:len(carried)])), 0.02)
        # Of the robot that was built, with noise, beside a motion that somebody made up.
        run("simulate", "built", "--state", "motion/start.json", "--torques", "motion/torques.yaml", "--duration", "5",
            "--record-period", "0.001", "--no-report", "-o", "real")
        real, random = read("real/trajectory.csv")[:-1], np.random.default_rng(3)
        columns = {"time": real["time"], **{name: real["q." + name] + 1e-4 * random.standard_normal(len(real))
                                            for name in ("crank_joint", "rocker_joint")},
                   "u.crank_joint": real["u.crank_joint"] + 0.01 * random.standard_normal(len(real))}
        np.savetxt("log.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9f")
        most, _ = identify("drawn", "log.csv", "--window", "0.05", *ALL)
        measure("other.csv", TRUTH, rows=5000)
        other, _ = identify("drawn", "other.csv", "--window", "0.05", *ALL)
        ratios = [take(most)[name]["deviation"] / one["deviation"] for name, one in take(other).items()]
        self.assertLess(np.mean(np.log(ratios)), math.log(0.6), ratios)  # the determinant is what is looked for
        for name, true in TRUTH.items():
            one = take(most)[name]
            self.assertLess(abs(one["after"] - true), 4 * one["deviation"], one)
        done = run("identify", "drawn", "--motion", "5", "-o", "none", status=2)
        self.assertIn("--motion: it needs --dynamics and -o, and no LOG", done.stderr)

    def measure_play(self, motion, seed=1, rows=10000):
        """With play of the gear: the motor is ahead of the crank by half of it to the side of the torque that it passes on."""
        random = np.random.default_rng(seed)
        time = np.arange(rows) * 1e-3
        angle, speed, acceleration = motion(time)
        torque = calc_torque(time, TRUTH, motion)
        passed = torque - TRUTH["crank_joint.armature"] * acceleration - calc_loss_torque(speed, TRUTH)
        _, end = place_fourbar(angle)
        columns = {"time": time, "crank_joint": angle + OFFSET + GEAR / 2 * np.sign(passed),
                   "rocker_joint": np.unwrap(np.angle(end - GROUND)) - OFFSET}
        for name in ("crank_joint", "rocker_joint"):
            columns[name] = columns[name] + 1e-4 * random.standard_normal(rows)
        columns["u.crank_joint"] = torque + 0.01 * random.standard_normal(rows)
        np.savetxt("log.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9f")

    def take_linkage(self, robot, *options, log="log.csv"):
        shutil.rmtree("found", ignore_errors=True)
        done = run("identify", robot, log, "-o", "found", *options)
        linkage, = json.loads(pathlib.Path("found/identified.json").read_text())["linkages"]
        return linkage, {(one["name"], one["kind"]): one for one in linkage["unknowns"]}, done

    def test_play(self):
        draw("drawn")
        squares = []
        for seed in range(4):
            self.measure_play(swing, seed)
            linkage, found, _ = self.take_linkage("drawn", "--play", "crank_joint", "--window", "0.05")
            for key, truth in ((("crank_joint.play", "play"), GEAR), (("crank_joint", "offset"), OFFSET),
                               (("rocker_joint", "offset"), -OFFSET), (("coupler", "length"), 0.35)):
                squares.append(((found[key]["after"] - truth) / found[key]["deviation"])**2)
            self.assertLess(linkage["noise_over_assumed"], 1.1)
            self.assertGreater(linkage["unclear"], 500)
            self.assertGreater(linkage["rows"], 4000)
        # Of 16 numbers, of which those of a log depend on each other: bounds of chi-square with 4, at 0.1 %.
        self.assertTrue(0.09 / 4 < np.mean(squares) < 18.5 / 4, squares)
        # Who passes over it finds other offsets and lengths, or is told.
        linkage, found, done = self.take_linkage("drawn")
        self.assertIn("or it has play", done.stderr)
        self.assertGreater(abs(found["crank_joint", "offset"]["after"] - OFFSET), 1.5 * math.radians(0.02))
        # Where the load never changes sides, play is a part of the offset.
        self.measure_play(lambda t: (0.6 + 0.3 * np.sin(1.5 * t), 0.45 * np.cos(1.5 * t), -0.675 * np.sin(1.5 * t)))
        linkage, found, _ = self.take_linkage("drawn", "--play", "crank_joint", "--free", "none")
        unseen, = linkage["not_seen"]
        self.assertEqual(set(unseen), {"crank_joint", "crank_joint.play"})
        self.assertAlmostEqual(unseen["crank_joint"] / unseen["crank_joint.play"], -0.5, delta=1e-9)
        self.assertIsNone(found["crank_joint.play", "play"]["after"])
        self.assertTrue(found["rocker_joint", "offset"]["seen"])
        self.assertNotIn("play:", pathlib.Path("found/found.yaml").read_text())
        # Unless the offset is known.
        _, found, _ = self.take_linkage("drawn", "--play", "crank_joint", "--free", "none", "--no-offset", "crank_joint")
        self.assertLess(abs(found["crank_joint.play", "play"]["after"] - GEAR - 2 * OFFSET), 1e-4)
        for options, text in ((("--play", "elbow"), "--play elbow: no linkage has it; there are: crank_joint, coupler"),
                              (("--play", "crank_joint", "--noise", "0"), "--noise")):
            self.assertIn(text, run("identify", "drawn", "log.csv", "-o", "none", *options, status=2).stderr)
        # Nor where no load is clear, as here for want of two windows.
        _, found, _ = self.take_linkage("drawn", "--play", "crank_joint", "--free", "none", "--window", "9")
        self.assertIsNone(found["crank_joint.play", "play"]["after"])
        text = pathlib.Path("log.csv").read_text().replace("u.crank_joint", "effort")
        pathlib.Path("without.csv").write_text(text)
        self.assertIn("without.csv: columns: --play needs those that are missing: u.crank_joint",
                      run("identify", "drawn", "without.csv", "-o", "none", "--play", "*", status=2).stderr)

    def test_play_in_mujoco(self):
        """Play of gear and rod, a rod and encoders that are wrong, masses and friction too, read by encoders of 14 bits."""
        rod = 3e-4
        draw("drawn")
        draw("built", TRUTH)
        urdf = pathlib.Path("built/fourbar.urdf")
        text = urdf.read_text()
        self.assertEqual(text.count('"0.175 0 0"'), 2)
        urdf.write_text(text.replace('"0.175 0 0"', '"0.1755 0 0"'))
        run("convert", "built", "--play", f"crank_joint={GEAR}", "--play", f"coupler={rod}", "-o", "worn")
        pathlib.Path("torques.yaml").write_text("torques:\n" + "".join(
            f"  - {{time: {0.002 * k:.3f}, crank_joint: {1.2 * math.sin(0.004 * k) + 0.6 * math.sin(0.011 * k + 1):.6f}}}\n"
            for k in range(5000)))
        done = subprocess.run([BIELLE, "simulate", "worn", "--world", "mujoco", "--duration", "10", "--torques", "torques.yaml",
                               "--record-period", "0.001", "--no-report", "-o", "real"], capture_output=True, text=True)
        if "without MuJoCo" in done.stderr:
            self.skipTest("MuJoCo is not built in")
        self.assertEqual(done.returncode, 0, done.stderr)
        real = np.genfromtxt("real/trajectory.csv", delimiter=",", names=True, deletechars="")[:-1]
        step, random = 2 * math.pi / 2**14, np.random.default_rng(1)
        columns = {"time": real["time"], "u.crank_joint": real["u.crank_joint"] + 0.01 * random.standard_normal(len(real))}
        for name, offset in (("crank_joint", OFFSET), ("rocker_joint", -OFFSET)):
            columns[name] = np.round((real["q." + name] + offset) / step) * step
        np.savetxt("log.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.9f")
        linkage, found, _ = self.take_linkage("drawn", "--play", "*", "--window", "0.05")
        self.assertGreater(linkage["rows"], 3000)
        self.assertLess(abs(found["coupler", "length"]["after"] - 0.351), 5e-5)
        for name, offset in (("crank_joint", OFFSET), ("rocker_joint", -OFFSET)):
            self.assertLess(abs(found[name, "offset"]["after"] - offset), math.radians(0.02))
        # MuJoCo's stops give way, by 1.5 % in the mean.
        self.assertLess(abs(found["crank_joint.play", "play"]["after"] - GEAR), 0.04 * GEAR)
        self.assertLess(abs(found["coupler.play", "play"]["after"] - rod), 0.06 * rod)
        # The robot that is found has it, in the next identification and in worlds.
        info = run("info", "found").stdout
        self.assertIn("coupler", info[info.index("play"):])
        shutil.rmtree("first", ignore_errors=True)
        os.rename("found", "first")
        _, again, _ = self.take_linkage("first", "--play", "*", "--window", "0.05")
        for key in (("crank_joint.play", "play"), ("coupler.play", "play")):
            self.assertAlmostEqual(again[key]["before"], found[key]["after"], delta=1e-12)
            self.assertLess(abs(again[key]["after"] - found[key]["after"]), 5 * found[key]["deviation"])
        # Without play in the model, what is left is many times the noise.
        blind, _, done = self.take_linkage("drawn")
        self.assertGreater(blind["misfit_after"], 5 * linkage["misfit_after"])
        self.assertIn("or it has play", done.stderr)

    def test_arm(self):
        """Without loops; while it leans on a stop, its motors do not tell."""
        for name, factor in (("arm", 1), ("heavy", 1.1)):
            os.makedirs(name, exist_ok=True)
            links = "".join(
                f'<link name="{link}"><inertial><origin xyz="0 0 -0.2"/><mass value="{mass!r}"/><inertia ixx="{inertia!r}" ixy="0" '
                f'ixz="0" iyy="{inertia!r}" iyz="0" izz="0.001"/></inertial></link><joint name="{joint}" type="revolute"><origin '
                f'xyz="0 0 {place}"/><parent link="{parent}"/><child link="{link}"/><axis xyz="0 1 0"/><limit lower="-3" '
                f'upper="{upper}" effort="20" velocity="10"/></joint>'
                for link, mass, inertia, joint, place, parent, upper in (
                    ("upper", 1.0 * factor, 0.01 * factor, "shoulder", 0, "ground", 3),
                    ("lower", 0.5, 0.005, "elbow", -0.4, "upper", 0.2)))
            pathlib.Path(name, name + ".urdf").write_text(f'<robot name="{name}"><link name="ground"/>{links}</robot>')
            pathlib.Path(name, name + ".yaml").write_text(
                "base: fixed\nmotors: {shoulder: {effort: 20}, elbow: {effort: 20}}\nserial_joints: [shoulder, elbow]\n")
        pathlib.Path("torques.yaml").write_text("torques:\n" + "".join(
            f"  - {{time: {0.002 * k:.3f}, shoulder: {1.5 * math.sin(0.008 * k):.6f}, elbow: {0.4 * math.sin(0.013 * k + 1):.6f}}}\n"
            for k in range(1000)))
        run("simulate", "heavy", "--torques", "torques.yaml", "--duration", "2", "--record-period", "0.001", "--no-report", "-o", "swing")
        dynamics, done = identify("arm", "swing/trajectory.csv", "--dynamics", "masses", "--window", "0.02")
        self.assertIn("instants near which a joint is at its limit are left out", done.stderr)
        self.assertGreater(dynamics["at_stops"], 2)
        self.assertGreater(dynamics["instants"], 50)
        self.check(dynamics, {"upper.mass": 1.1, "lower.mass": 0.5})

    def test_spin(self):
        """A crank without friction whose torque does not turn with it: where it is too fast for the window, it does not tell."""
        run("generate", "fourbar_chain", "--set", "count=1", "-o", "spun")
        pathlib.Path("torques.yaml").write_text("torques:\n  - {time: 0, crank1: 0.5}\n")
        run("simulate", "spun", "--torques", "torques.yaml", "--duration", "4", "--record-period", "0.001", "--no-report", "-o", "spin")
        dynamics, done = identify("spun", "spin/trajectory.csv", "--dynamics", "masses", "--window", "0.05")
        self.assertIn("instants at which a joint turns by more than 1.2 rad within 0.05 s are left out", done.stderr)
        self.assertGreater(dynamics["too_fast"], 50)
        self.assertLess(dynamics["misfit_before"], 0.1)  # with all instants 1, though the robot is the one that was simulated

    def test_bad_input(self):
        draw("drawn")
        measure("log.csv", DRAWN, rows=300)

        def refuse(*expected, robot="drawn", log="log.csv", options=ALL):
            done = run("identify", robot, log, "-o", "none", *options, status=2)
            self.assertEqual(done.stderr.count("bielle: error: "), 1, done.stderr)
            for text in expected:
                self.assertIn(text, done.stderr)
            self.assertFalse(os.path.exists("none"))

        measure("without.csv", DRAWN, rows=300, wrong=lambda columns: columns.pop("u.crank_joint"))
        refuse("without.csv: columns", "--dynamics needs those that are missing: u.crank_joint", log="without.csv")
        lines = pathlib.Path("log.csv").read_text().splitlines()
        lines[3] = lines[3].rsplit(",", 1)[0] + ","
        pathlib.Path("empty.csv").write_text("\n".join(lines))
        refuse("empty.csv: line 4, column 'u.crank_joint': '' is no finite number", log="empty.csv")
        refuse("--dynamics elbow.mass: the robot has no such number", "there are: armatures, coms, frictions, masses, crank.mass",
               options=("--dynamics", "elbow.mass"))
        refuse("base: it moves, and the forces on it are not in the log", "--fixed-base", robot="bipetto")
        done = run("identify", "bipetto", "log.csv", "-o", "none", "--fixed-base", *ALL, status=2)  # the remedy
        self.assertIn("--dynamics needs those that are missing: u.", done.stderr)
        refuse("give a longer log", options=("--window", "5", *ALL))
        shown = run("identify", "drawn", *ALL).stdout
        self.assertIn("crank_joint.friction", shown)


with tempfile.TemporaryDirectory() as directory:
    os.chdir(directory)
    unittest.main(verbosity=1, argv=[sys.argv[0]] + ONLY)
