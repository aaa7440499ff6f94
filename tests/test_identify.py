"""test_identify.py BIELLE SOURCE: lengths and offsets found again from logs of robots that have errors, by `bielle identify`.

Logs come from closed forms of a four-bar and of an ankle on two rods, and from MuJoCo. Rods are wrong by 1 mm, encoders by half a
degree, and read with noise.
"""
import json
import math
import os
import pathlib
import shutil
import signal
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
GROUND, CRANK, COUPLER, ROCKER = 0.4, 0.15, 0.35, 0.3
NOISE, OFFSET = 1e-4, math.radians(0.5)
LENGTH_GOAL, OFFSET_GOAL = 5e-5, math.radians(0.02)


def run(*arguments, status=0):
    done = subprocess.run([BIELLE, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == status, (arguments, done.returncode, done.stdout, done.stderr)
    return done


def close_fourbar(crank_angle, crank=CRANK, coupler=COUPLER, rocker=ROCKER):
    """The angle of the rocker, by the circles about the ends of its neighbours."""
    x, z = crank * np.cos(crank_angle), crank * np.sin(crank_angle)
    dx, dz = GROUND - x, -z
    distance = np.hypot(dx, dz)
    along = (distance**2 + coupler**2 - rocker**2) / (2 * distance)
    across = np.sqrt(coupler**2 - along**2)
    end_x, end_z = x + (along * dx - across * dz) / distance, z + (along * dz + across * dx) / distance
    return np.unwrap(np.arctan2(end_z, end_x - GROUND))


def close_ankle(pitch, roll, aside, rod, crank=0.05, height=0.17, angle=0.6):
    """The angle of a motor beside the ankle of rsu_biped: its crank's end is as far from the heel as the rod is long
    (robots/parts/ankle/rsu.yaml)."""
    u = np.array([-math.cos(angle), 0, math.sin(angle)])  # of crank and heel at zero; across both is the motor's axis y
    heel = crank * u + [0, aside, 0]
    y, z = np.cos(roll) * heel[1] - np.sin(roll) * heel[2], np.sin(roll) * heel[1] + np.cos(roll) * heel[2]
    p = np.stack([np.cos(pitch) * heel[0] + np.sin(pitch) * z, y - aside, np.cos(pitch) * z - np.sin(pitch) * heel[0] - height])
    across = np.array([u[2], 0, -u[0]])
    a, b, c = u @ p, across @ p, ((p * p).sum(0) + crank**2 - rod**2) / (2 * crank)
    start, more = np.arctan2(b, a), np.arccos(c / np.hypot(a, b))
    ends = [(angle + math.pi) % (2 * math.pi) - math.pi for angle in (start + more, start - more)]
    return np.where(abs(ends[0] - pitch) < abs(ends[1] - pitch), *ends)


def write_log(path, columns):
    names = list(columns)
    np.savetxt(path, np.column_stack([columns[name] for name in names]), delimiter=",", header=",".join(names), comments="",
               fmt="%.9f")


def measure_fourbar(path, seed=1, rows=2000, sweep=(0.3, 6.0), noise=NOISE, kept=1, **lengths):
    """\param kept  rows for which noise stays as it is"""
    random = np.random.default_rng(seed)
    crank = 0.5 * (sweep[0] + sweep[1]) - 0.5 * (sweep[1] - sweep[0]) * np.cos(np.linspace(0, 4 * math.pi, rows))
    readings = {"time": np.arange(rows) * 1e-3, "crank_joint": crank + OFFSET,
                "rocker_joint": close_fourbar(crank, **lengths) - OFFSET}
    for name in ("crank_joint", "rocker_joint"):
        readings[name] = readings[name] + noise * np.repeat(random.standard_normal(-(-rows // kept)), kept)[:rows]
    write_log(path, readings)


def identify(robot, log, *options, status=0, place="found"):
    shutil.rmtree(place, ignore_errors=True)
    done = run("identify", robot, log, "-o", place, *options, status=status)
    with open(os.path.join(place, "identified.json"), encoding="utf-8") as file:
        return json.load(file), done


def get(linkage, name, kind=None):
    found = [one for one in linkage["unknowns"] if one["name"] == name and kind in (None, one["kind"])]
    assert len(found) == 1, (name, linkage)
    return found[0]


class Identify(unittest.TestCase):
    def test_fourbar(self):
        measure_fourbar("log.csv", coupler=COUPLER + 1e-3)
        result, done = identify("fourbar", "log.csv")
        linkage, = result["linkages"]
        self.assertEqual(linkage["rows"], 2000)
        self.assertTrue(linkage["converged"] and not result["interrupted"])
        self.assertLess(abs(get(linkage, "coupler")["after"] - COUPLER - 1e-3), LENGTH_GOAL)
        self.assertLess(abs(get(linkage, "crank_joint")["after"] - OFFSET), OFFSET_GOAL)
        self.assertLess(abs(get(linkage, "rocker_joint")["after"] + OFFSET), OFFSET_GOAL)
        self.assertEqual(linkage["not_seen"], [])
        self.assertLess(abs(linkage["noise_over_assumed"] - 1), 0.05)
        self.assertGreater(linkage["misfit_before"], 20 * linkage["misfit_after"])
        self.assertIn("coupler", done.stdout)
        page = pathlib.Path("found/report.html").read_text(encoding="utf-8")
        self.assertIn("<td>coupler</td>", page)
        self.assertEqual(page.count("<svg"), 1 if shutil.which("gnuplot") else 0)
        # The robot that is written has the length, for every other command.
        shown = run("info", "found").stdout
        self.assertIn("mobility", shown)
        again, _ = identify("found", "log.csv", place="again")
        self.assertLess(abs(get(again["linkages"][0], "coupler")["before"] - get(linkage, "coupler")["after"]), 1e-12)
        self.assertLess(abs(get(again["linkages"][0], "coupler")["after"] - get(linkage, "coupler")["after"]), 1e-8)
        # All three lengths, on the ground's; the table in print is that of JSON.
        measure_fourbar("log.csv", coupler=COUPLER + 1e-3, crank=CRANK - 1e-3, rocker=ROCKER + 1e-3)
        result, done = identify("fourbar", "log.csv", "--free", "coupler", "--free", "crank", "--free", "rocker", "--json")
        self.assertEqual(json.loads(done.stdout), result)
        linkage, = result["linkages"]
        for name, length in (("coupler", COUPLER + 1e-3), ("crank", CRANK - 1e-3), ("rocker", ROCKER + 1e-3)):
            self.assertLess(abs(get(linkage, name)["after"] - length), LENGTH_GOAL, name)

    def test_deviations(self):
        """Errors are as large as standard deviations say: their squares over 8 logs are chi-square distributed."""
        for kept, rows in ((1, 600), (20, 8000)):  # also where readings depend on those before, as rounded ones do
            squares = []
            for seed in range(8):
                measure_fourbar("log.csv", seed=100 + seed, rows=rows, kept=kept, coupler=COUPLER + 1e-3)
                linkage, = identify("fourbar", "log.csv")[0]["linkages"]
                for name, truth in (("coupler", COUPLER + 1e-3), ("crank_joint", OFFSET), ("rocker_joint", -OFFSET)):
                    one = get(linkage, name)
                    squares.append(((one["after"] - truth) / one["deviation"])**2)
            # Of 24 numbers; those of a log depend on each other, as if there were fewer: bounds of 8, at 0.1 %.
            self.assertTrue(0.86 / 8 < np.mean(squares) < 26.1 / 8, (kept, squares))

    def test_what_is_not_seen(self):
        measure_fourbar("log.csv")
        free = [word for name in ("coupler", "crank", "rocker", "rocker_joint.x") for word in ("--free", name)]
        linkage, = identify("fourbar", "log.csv", *free)[0]["linkages"]
        for name in ("coupler", "crank", "rocker", "rocker_joint.x"):
            one = get(linkage, name)
            self.assertEqual((one["after"], one["deviation"], one["seen"]), (None, None, False), name)
        for name in ("crank_joint", "rocker_joint"):
            self.assertLess(abs(abs(get(linkage, name, "offset")["after"]) - OFFSET), 10 * OFFSET_GOAL)
        combination, = linkage["not_seen"]
        self.assertEqual(set(combination), {"coupler", "crank", "rocker", "rocker_joint.x"})
        for name, length in (("coupler", COUPLER), ("crank", CRANK), ("rocker", ROCKER)):
            self.assertAlmostEqual(combination[name] / combination["rocker_joint.x"], length / GROUND, delta=0.01)
        # All joints of the linkage, of which the log has two.
        linkage, = identify("fourbar", "log.csv", "--sensor", "*")[0]["linkages"]
        self.assertEqual(linkage["columns"], ["crank_joint", "rocker_joint"])
        # A crank that hardly moves does not tell a length from offsets.
        measure_fourbar("log.csv", sweep=(1.0, 1.002))
        linkage, = identify("fourbar", "log.csv")[0]["linkages"]
        self.assertTrue(linkage["not_seen"])
        unseen = {name for combination in linkage["not_seen"] for name in combination}
        self.assertIn("coupler", unseen)
        for name in unseen:
            self.assertIsNone(get(linkage, name)["after"], name)
        # Unless offsets are known.
        linkage, = identify("fourbar", "log.csv", "--no-offset", "*")[0]["linkages"]
        self.assertTrue(get(linkage, "coupler")["seen"])

    def test_ankle(self):
        """An ankle on two rods, one too long and one too short, beside one that stands still."""
        rows, errors = 3000, {"rod_ankle1_left": 1e-3, "rod_ankle2_left": -1e-3}
        phase = np.linspace(0, 2 * math.pi, rows)
        pitch, roll = -0.3 + 0.3 * np.sin(3 * phase), 0.2 * np.sin(4 * phase)
        random = np.random.default_rng(5)
        columns, truth = {"time": np.arange(rows) * 1e-3}, {}
        for name, values in (("ankley_left", pitch), ("anklex_left", roll),
                             ("motor_ankle1_left", close_ankle(pitch, roll, 0.06, 0.17 + errors["rod_ankle1_left"])),
                             ("motor_ankle2_left", close_ankle(pitch, roll, -0.06, 0.17 + errors["rod_ankle2_left"]))):
            truth[name] = OFFSET * (-1 if len(truth) % 2 else 1)
            columns[name] = values + truth[name] + NOISE * random.standard_normal(rows)
        for name in ("ankley_right", "anklex_right"):
            columns[name] = np.zeros(rows)
        write_log("log.csv", columns)
        np.savez("log.npz", **columns)
        result, done = identify("rsu_biped", "log.csv")
        self.assertIn("it stands still in the log", done.stderr)
        linkage, = result["linkages"]
        for rod, error in errors.items():
            one = get(linkage, rod)
            self.assertLess(abs(one["after"] - 0.17 - error), min(LENGTH_GOAL, 5 * one["deviation"]), one)
        for name, offset in truth.items():
            self.assertLess(abs(get(linkage, name)["after"] - offset), OFFSET_GOAL, name)
        linkage, = identify("rsu_biped", "log.npz")[0]["linkages"]
        self.assertLess(abs(get(linkage, "rod_ankle1_left")["after"] - 0.17 - 1e-3), LENGTH_GOAL)

    def test_trajectories(self):
        """What `bielle simulate` writes is a log as it is."""
        run("simulate", "fourbar", "--duration", "1", "--no-report", "-o", "swing")
        for name in ("trajectory.csv", "trajectory.npz"):
            linkage, = identify("fourbar", os.path.join("swing", name))[0]["linkages"]
            self.assertLess(abs(get(linkage, "coupler")["after"] - COUPLER), 1e-7)
        # A robot with a longer coupler, in MuJoCo's world, where loops give way.
        shutil.copytree(SOURCE / "robots/fourbar", "longer")
        urdf = pathlib.Path("longer/fourbar.urdf")
        text = urdf.read_text()
        self.assertEqual(text.count('"0.175 0 0"'), 2)
        urdf.write_text(text.replace('"0.175 0 0"', '"0.1755 0 0"'))
        done = subprocess.run([BIELLE, "simulate", "longer", "--world", "mujoco", "--duration", "2", "--no-report", "-o", "soft"],
                              capture_output=True, text=True)
        if "without MuJoCo" in done.stderr:
            self.skipTest("MuJoCo is not built in")
        self.assertEqual(done.returncode, 0, done.stderr)
        linkage, = identify("fourbar", "soft/trajectory.npz")[0]["linkages"]
        self.assertLess(abs(get(linkage, "coupler")["after"] - COUPLER - 1e-3), LENGTH_GOAL)
        for name in ("crank_joint", "rocker_joint"):
            self.assertLess(abs(get(linkage, name)["after"]), OFFSET_GOAL)

    def test_bad_input(self):
        measure_fourbar("log.csv", rows=50)
        lines = pathlib.Path("log.csv").read_text().splitlines()

        def refuse(changed, *expected, options=()):
            pathlib.Path("bad.csv").write_text("\n".join(changed) + "\n")
            done = run("identify", "fourbar", "bad.csv", "-o", "none", *options, status=2)
            self.assertEqual(done.stderr.count("bielle: error: "), 1, done.stderr)
            for text in expected:
                self.assertIn(text, done.stderr)
            self.assertFalse(os.path.exists("none"))

        cells = [line.split(",") for line in lines]
        refuse(lines[:3] + ["0.1,nan,1"] + lines[4:], "bad.csv: line 4, column 'crank_joint': 'nan' is no finite number")
        refuse(lines[:3] + ["0.1,1"], "bad.csv: line 4: it has 2 cells, and the header 3")
        refuse([",".join(row[:2]) for row in cells], "its 1 column(s) in the log tell no more than where it is, with 1 freedom(s)",
               "log more of its joints: rocker_joint, crank_coupler, rocker_coupler")
        refuse(["time,a,b"] + lines[1:], "the log has none of its columns: crank_joint, rocker_joint")
        refuse([",".join([row[0], row[1], "1.5" if i else row[2]]) for i, row in enumerate(cells)],
               "column 'rocker_joint': it is the same in all rows, while others of its linkage change")
        refuse([",".join([row[0], "1", "1.5"]) if i else lines[0] for i, row in enumerate(cells)], "it stands still in the log")
        # An angle in degrees.
        refuse([lines[0]] + [f"{row[0]},{row[1]},{float(row[2]) * 180 / math.pi}" for row in cells[1:]],
               "the linkage of rocker_joint has no configuration near these positions", "check units (rad, m)")
        refuse(lines, "--free elbow: no linkage has it; there are: rods, none, crank, coupler, rocker", options=("--free", "elbow"))
        refuse(lines, "--noise", options=("--noise", "crank_joint=0"))
        refuse(lines, "--joint elbow", options=("--joint", "elbow"))
        pathlib.Path("bad.npz").write_text("time,crank_joint\n")
        self.assertIn("numpy.savez(", run("identify", "fourbar", "bad.npz", "-o", "none", status=2).stderr)
        done = run("identify", "fourbar", "log.csv", status=2)
        self.assertIn("--output", done.stderr)

    def test_interruption(self):
        """After Ctrl-C the best estimate so far is written, and told as such."""
        measure_fourbar("long.csv", rows=60000, coupler=COUPLER + 1e-3)
        call = subprocess.Popen([BIELLE, "identify", "fourbar", "long.csv", "-o", "ended"], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)
        for line in call.stderr:
            if "iteration" in line:
                call.send_signal(signal.SIGINT)
                break
        out, error = call.communicate()
        self.assertEqual(call.returncode, 1, (out, error))
        self.assertIn("interrupted; what is written is the best estimate so far", error)
        with open("ended/identified.json", encoding="utf-8") as file:
            self.assertTrue(json.load(file)["interrupted"])
        run("info", "ended")

    def test_symbols(self):
        """Ceres must not call kernels of Eigen that were compiled for another alignment."""
        if not shutil.which("nm"):
            self.skipTest("nm is not there")
        program = os.path.join(os.path.dirname(BIELLE), "bielle-identify")
        names = subprocess.run(["nm", "-D", "-C", "--defined-only", program], capture_output=True, text=True, check=True).stdout
        self.assertNotIn("Eigen::", names)


with tempfile.TemporaryDirectory() as directory:
    os.chdir(directory)
    unittest.main(verbosity=1, argv=[sys.argv[0]] + ONLY)
