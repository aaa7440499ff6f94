"""Reports in a browser: they open without complaint, the robot moves, the plots follow, names stay text.

usage: test_report_page.py BIELLE. Ends with status 77 where there is no Chromium.
"""
import csv
import json
import math
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

from browser import Browser

BIELLE = sys.argv.pop(1)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
HOSTILE = "<script>window.hacked=1</script><img src=x onerror=window.hacked=2>\"'&amp;</style>"

# The canvas of the replay as a list of grey levels on a grid.
PICTURE = """(() => {
  const small = document.createElement('canvas');
  small.width = small.height = 256;
  const pen = small.getContext('2d');
  report.draw();
  pen.drawImage(document.getElementById('canvas'), 0, 0, 256, 256);
  return Array.from(pen.getImageData(0, 0, 256, 256).data).filter((x, i) => i % 4 === 0);
})()"""

# Number of pixels that each plot has drawn.
INK = """Array.from(document.querySelectorAll('.plot')).map(plot => {
  const canvas = plot.querySelector('canvas');
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  return data.filter((x, i) => i % 4 === 3 && x > 0).length;
})"""


def run(*arguments, status=0):
    result = subprocess.run([BIELLE, *map(str, arguments)], capture_output=True, text=True)
    assert result.returncode == status, result.stdout + result.stderr
    return result


def escape(text):
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")


def write_hostile_result(directory):
    """A pendulum of one swing, every name of which wants to be markup."""
    directory.mkdir()
    name = escape(HOSTILE)
    (directory / "robot.urdf").write_text(f"""<robot name="{name}"><link name="world"/>
      <link name="bob"><inertial><mass value="1"/><origin xyz="0 0 -1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><geometry><mesh filename="part.stl" scale="2 2 2"/></geometry></visual>
        <visual><geometry><mesh filename="torn.stl"/></geometry></visual></link>
      <joint name="{name}" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/></joint>
      </robot>""")
    corners = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    (directory / "part.stl").write_bytes(bytes(80) + struct.pack("<I", 2) + corners + corners)
    (directory / "torn.stl").write_bytes(bytes(80) + struct.pack("<I", 2000) + corners)
    archive = directory / "trajectory.npz"
    for kind in ("q", "v"):
        add_names(archive, kind + "_names", [HOSTILE])
    for kind in ("u", "closure", "contact"):
        add_names(archive, kind + "_names", [])
    add_array(archive, "time", (11,), [k / 10 for k in range(11)])
    add_array(archive, "q", (11, 1), [k / 20 for k in range(11)])
    add_array(archive, "v", (11, 1), 11 * [0.5])
    add_array(archive, "a", (10, 1), 10 * [0])
    add_array(archive, "u", (10, 0), [])
    for kind in ("closure", "contact"):
        add_array(archive, kind + "_wrenches", (10, 0, 6), [])
    add_array(archive, "com", (11, 3), 11 * [0, 0, -1])
    add_array(archive, "gap", (11, 2), 22 * [0])
    summary = {"robot": str(directory / "robot.urdf"), "motion": HOSTILE, "termination": HOSTILE,
               "message": "</script>" + HOSTILE, "options": {HOSTILE: 1}, "command": [HOSTILE],
               "goals": [None, {"name": HOSTILE, "kind": HOSTILE, "unit": HOSTILE, "requested": 1, "achieved": None}],
               "log_columns": ["iteration", "cost", HOSTILE], "log": [[0, 1, 2], [1, 0.5, 3]],
               "phases": [{"name": HOSTILE, "start_node": 0, "nodes": 10}],
               "ground": {"height": -1.2, "friction": 0.6, "steps": [
                   {"top": [0.5, 0, -1.1], "length": 0.3, "width": 0.6, "yaw": 0.1}]}}
    (directory / "summary.json").write_text(json.dumps(summary))
    check = {"pass": False, "rows": [{"name": HOSTILE, "value": 1, "bound": 2, "unit": HOSTILE, "pass": False,
                                      "note": HOSTILE}]}
    (directory / "check.json").write_text(json.dumps(check))


def differ(a, b):
    """How many of the points changed visibly."""
    return sum(abs(x - y) > 5 for x, y in zip(a, b))


def add_npy(archive, name, kind, shape, body):
    """To a NumPy archive."""
    header = str({"descr": kind, "fortran_order": False, "shape": shape}).encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    with zipfile.ZipFile(archive, "a") as file:
        file.writestr(name + ".npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + body)


def add_array(archive, name, shape, numbers):
    add_npy(archive, name, "<f8", shape, struct.pack(f"<{len(numbers)}d", *numbers))


def add_names(archive, name, texts):
    width = max([1, *map(len, texts)])
    add_npy(archive, name, f"<U{width}", (len(texts),), b"".join(t.ljust(width, "\0").encode("utf-32-le") for t in texts))


class ReportPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.place.name)
        cls.addClassCleanup(cls.place.cleanup)
        cls.squat = cls.root / "squat"
        run("solve", "squat", "--robot", "bipetto", "--no-check", "--set", "duration=0.6", "--set", "settle=0", "--set",
            "time_step=0.02", "--depth", "0.8", "--quiet", "-o", cls.squat)
        write_hostile_result(cls.root / "hostile")
        cls.browser = Browser(CHROMIUM)
        cls.addClassCleanup(cls.browser.close)

    def setUp(self):
        self.browser.complaints.clear()

    def tearDown(self):
        self.assertEqual(self.browser.complaints, [])

    def picture(self, t):
        self.browser.evaluate(f"report.transport.setTime({t})")
        return self.browser.evaluate(PICTURE)

    def test_goals_are_side_by_side(self):
        self.browser.open(self.squat / "report.html")
        cells = self.browser.evaluate(
            "Array.from(document.querySelectorAll('#goals td')).map(cell => cell.textContent)")
        summary = json.loads((self.squat / "summary.json").read_text())
        self.assertEqual(cells[:2], ["depth", "0.8"])
        self.assertAlmostEqual(float(cells[2]), summary["goals"][0]["achieved"], places=3)
        self.assertEqual(cells[3], "met")
        summary["goals"][0].update(achieved=0.9, met=False)
        missed = self.root / "missed"
        shutil.copytree(self.squat, missed, dirs_exist_ok=True)
        (missed / "summary.json").write_text(json.dumps(summary))
        run("report", missed)
        self.browser.open(missed / "report.html")
        badges = self.browser.evaluate("Array.from(document.querySelectorAll('.badge.bad')).map(b => b.textContent)")
        self.assertEqual(badges, ["missed: depth"])
        self.assertEqual(self.browser.evaluate("document.querySelector('#goals td.fail').textContent"), "MISSED")

    def test_replay_moves(self):
        self.browser.open(self.squat / "report.html")
        start, lowest = self.picture(0), self.picture(0.3)
        self.assertEqual(differ(start, self.picture(0)), 0)
        self.assertGreater(differ(start, lowest), 600)
        self.assertGreater(len(set(start)), 20)  # more than a ground
        self.picture(0)
        self.browser.evaluate("report.transport.setPlaying(true)")
        deadline = time.monotonic() + 60
        while self.browser.evaluate("report.transport.time") < 0.2 and time.monotonic() < deadline:
            time.sleep(0.05)
        self.assertGreaterEqual(self.browser.evaluate("report.transport.time"), 0.2)
        self.browser.evaluate("report.transport.setPlaying(false)")
        self.assertGreater(differ(start, self.browser.evaluate(PICTURE)), 600)

    def test_layers_show_and_hide(self):
        self.browser.open(self.squat / "report.html", "#hide=locks,contactForces,com,traces,footprints")
        bare = self.browser.evaluate(PICTURE)
        for layer in ("locks", "contactForces", "closureForces", "com", "traces"):
            self.browser.evaluate(f"report.scene.setLayer('{layer}', true)")
            self.assertGreater(differ(bare, self.browser.evaluate(PICTURE)), 0, layer)
            self.browser.evaluate(f"report.scene.setLayer('{layer}', false)")
            self.assertEqual(differ(bare, self.browser.evaluate(PICTURE)), 0, layer)

    def test_plots_follow(self):
        self.browser.open(self.squat / "report.html", "#t=0.2")
        self.assertAlmostEqual(self.browser.evaluate("report.transport.time"), 0.2)
        ink = self.browser.evaluate(INK)
        self.assertGreaterEqual(len(ink), 14)
        for count in ink:
            self.assertGreater(count, 300)
        titles = self.browser.evaluate("Array.from(document.querySelectorAll('.plot h2')).map(h => h.textContent)")
        for title in ("Centre of mass", "Motor torques", "Distances from dead points", "Closure gaps", "Contact forces",
                      "Centres of pressure"):
            self.assertIn(title, titles)
        # A click at the middle of a plot goes to that time, and the cursors of all plots go with it.
        box = self.browser.evaluate("""(() => { const area = document.querySelector('.plot .area');
          area.scrollIntoView({block: 'center', behavior: 'instant'});
          const r = area.getBoundingClientRect(), g = report.plots.plots[0].graph;
          return [r.left + g.toDomXCoord(0.4), r.top + 60]; })()""")
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.browser.call("Input.dispatchMouseEvent", type=kind, x=box[0], y=box[1], button="left", clickCount=1)
        self.assertAlmostEqual(self.browser.evaluate("report.transport.time"), 0.4, delta=0.02)
        for shift in self.browser.evaluate("""report.plots.plots.map(
            plot => plot.graph.toDataXCoord(parseFloat(plot.cursor.style.left)) - report.transport.time)"""):
            self.assertAlmostEqual(shift, 0, delta=1e-4)

    def test_numbers_are_those_of_the_files(self):
        self.browser.open(self.squat / "report.html")
        with open(self.squat / "trajectory.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        motor = self.browser.evaluate("report.plots.plots.find(p => p.definition.title === 'Motor torques')"
                                      ".definition.series.map(s => [s.name, Array.from(s.lines[0])])")
        self.assertEqual(len(motor), 12)
        for name, values in motor:
            for row, value in zip(rows, values):
                self.assertAlmostEqual(float(row["u." + name]), value, delta=1e-5)

    def test_numbers_of_the_size_of_rounding_are_zero(self):
        self.browser.open(self.squat / "report.html")
        for value, text in ((0, "0"), (-6.3e-33, "0"), (7.97e-18, "0"), (2.7e-13, "2.70e-13"), (0.00441, "0.00441"), (float("nan"), "–")):
            self.assertEqual(self.browser.evaluate(f"formatNumber({value!r})".replace("nan", "NaN")), text)

    def test_two_runs(self):
        page = self.root / "both.html"
        run("report", self.squat, self.root / "hostile", "-o", page)
        self.browser.open(page)
        self.assertEqual(self.browser.evaluate("report.scene.robots.length"), 2)
        apart = self.browser.evaluate(PICTURE)
        self.browser.evaluate("report.scene.setSideBySide(false)")
        self.assertGreater(differ(apart, self.browser.evaluate(PICTURE)), 600)

    def test_a_motion_carried_out_is_shown_with_its_plan(self):
        """Its plan is another squat here, so that ghost and plots differ from what happened."""
        other, happened = self.root / "other", self.root / "happened"
        run("solve", "squat", "--robot", "bipetto", "--no-check", "--set", "duration=0.6", "--set", "settle=0", "--set",
            "time_step=0.02", "--depth", "0.7", "--quiet", "--no-report", "-o", other)
        shutil.copytree(self.squat, happened, dirs_exist_ok=True)
        shutil.copy(other / "trajectory.npz", happened / "plan.npz")
        with open(self.squat / "trajectory.csv", newline="") as file:
            nodes = len(list(csv.DictReader(file)))
        add_array(happened / "trajectory.npz", "footholds", (nodes, 2, 8),
                  nodes * [0.4, 0.2, 0.1, 0, 0, 0, 0, 1, *8 * [math.nan]])  # of one foot, which is to land at 0.4 s
        summary = json.loads((self.squat / "summary.json").read_text())
        summary.update(outcome="fell", fall_time=0.5, converged=False, world="bielle", control="gains", pushes=[
            {"time_s": 0.2, "impulse_Ns": 2, "direction_deg": 90, "duration_s": 0.1}])
        (happened / "summary.json").write_text(json.dumps(summary))
        run("report", happened)
        self.browser.open(happened / "report.html")
        badges = self.browser.evaluate("Array.from(document.querySelectorAll('.badge')).map(b => b.textContent)")
        self.assertEqual(badges[:2], ["fell at 0.500 s", "world bielle, control gains"])
        for layer, time in (("plan", 0.3), ("push", 0.25), ("footholds", 0.3)):
            shown = self.picture(time)
            self.browser.evaluate(f"report.scene.setLayer('{layer}', false)")
            self.assertGreater(differ(shown, self.browser.evaluate(PICTURE)), 50, layer)
            self.browser.evaluate(f"report.scene.setLayer('{layer}', true)")
        self.assertEqual([(self.picture(t), self.browser.evaluate(
            "report.scene.robots[0].footholds.map(outline => outline.visible)"))[1] for t in (0.3, 0.45)],
                         [[True, False], [False, False]])
        pushes = [self.browser.evaluate(f"report.runs[0].calcPush({t})") for t in (0.19, 0.25, 0.31)]
        self.assertEqual([pushes[0], pushes[2]], [[0, 0], [0, 0]])
        self.assertAlmostEqual(pushes[1][1], 20)
        torques = "report.plots.plots.find(p => p.definition.title === 'Motor torques')"
        self.assertEqual(self.browser.evaluate(torques + ".lines.filter(line => line.isPlan).length"), 12)
        with open(other / "trajectory.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        plan = self.browser.evaluate(torques + ".definition.series.map(s => [s.name, Array.from(s.plans[0])])")
        for name, values in plan:
            for row, value in zip(rows, values):
                self.assertAlmostEqual(float(row["u." + name]), value, delta=1e-5)

    def test_a_motion_under_way_is_followed(self):
        """The page is loaded again by itself, and goes on with the view and at the time where it was."""
        running = self.root / "running"
        shutil.copytree(self.squat, running, dirs_exist_ok=True)
        summary = json.loads((self.squat / "summary.json").read_text())
        summary.update(outcome="running", converged=False, world="bielle", control="gains")
        (running / "summary.json").write_text(json.dumps(summary))
        run("report", running)
        self.browser.open(running / "report.html")

        def ask(expression):
            """Of whichever page is there; while one is left for the next there is none."""
            deadline = time.monotonic() + 60
            while True:
                self.assertLess(time.monotonic(), deadline)
                try:
                    answer = self.browser.evaluate(
                        f"typeof report === 'object' && report.live ? [{expression}] : null")
                except RuntimeError:  # it was left meanwhile
                    continue
                if answer is not None:
                    return answer[0]
                time.sleep(0.05)

        self.assertEqual(ask("[document.querySelectorAll('.badge.bad').length, report.transport.playing]"), [0, True])
        touch = ("(window.touched = true, report.transport.setTime(0.25), report.transport.setPlaying(false),"
                 " report.camera.following = false, report.camera.three.position.set(3, 2, 1), true)")
        ask(touch)
        deadline = time.monotonic() + 60
        while ask("(window.touched || report.transport.time !== 0.25)"):
            self.assertLess(time.monotonic(), deadline)
            if not ask("window.touched"):  # a page that was being left when it was touched
                ask(touch)
            time.sleep(0.1)
        summary.update(outcome="stood", converged=True)
        (running / "summary.json").write_text(json.dumps(summary))
        run("report", running)
        deadline = time.monotonic() + 60
        while not ask("report.runs[0].summary.outcome === 'stood'"):
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)
        self.assertAlmostEqual(self.browser.evaluate("report.transport.time"), 0.25)
        self.assertFalse(self.browser.evaluate("report.transport.playing"))
        position = self.browser.evaluate("report.camera.three.position.toArray()")
        for value, expected in zip(position, (3, 2, 1)):
            self.assertAlmostEqual(value, expected, places=3)
        self.browser.open(running / "report.html")  # what was kept was for once
        self.assertEqual(self.browser.evaluate("report.transport.time"), 0)

    def test_the_check_is_readable_at_every_width(self):
        """First what failed, or that nothing did; the whole table is last, with every word of every column whole."""
        place = self.root / "checked"
        shutil.copytree(self.squat, place)
        row = {"name": "least distance of soles to their edges of the ground", "value": 1.234567e-5, "bound": 1.23e-4,
               "unit": "m or rad", "pass": True, "note": "foot_right at node 123, 1.845 s"}
        for failing in (0, 1):
            rows = [dict(row) for _ in range(40)]
            rows[7].update({"pass": not failing})
            (place / "check.json").write_text(json.dumps({"pass": not failing, "rows": rows}))
            run("report", place)
            self.browser.open(place / "report.html")
            self.assertIn("1 of 40 rows failed" if failing else "All 40 rows passed",
                          self.browser.evaluate("document.getElementById('check').innerText"))
            self.assertEqual(self.browser.evaluate("document.querySelectorAll('#check tbody tr').length"), failing)
            self.assertEqual(self.browser.evaluate("document.querySelectorAll('#checks tbody tr').length"), 40)
            top = "(id => document.getElementById(id).getBoundingClientRect().top)"
            order = [self.browser.evaluate(f"{top}('{name}')") for name in ("check", "plots", "iterations", "options", "checks")]
            self.assertEqual(order, sorted(order))
            for width in (500, 1300, 2500):
                self.browser.resize(width, 900)
                self.assertLessEqual(self.browser.evaluate("document.documentElement.scrollWidth"), width)
                # Cells that are narrower than their longest word, and names or notes of more than a few lines.
                cut, lines = self.browser.evaluate("""(() => {
                  const cells = Array.from(document.querySelectorAll('#check td, #checks td, #checks th, #check th'));
                  return [cells.filter(cell => cell.scrollWidth > cell.clientWidth + 1).length,
                          Math.max(...cells.map(cell => cell.getBoundingClientRect().height)) / 20];
                })()""")
                self.assertEqual(cut, 0, width)
                self.assertLess(lines, 6, width)
                table = self.browser.evaluate("Array.from(document.querySelectorAll('#checks .scroll')).map("
                                              "box => box.scrollWidth - box.clientWidth)")
                self.assertLessEqual(max(table), 0, width)  # no column is out of sight
        self.browser.resize(1000, 700)

    def test_hostile_names_are_text(self):
        run("report", self.root / "hostile")
        self.browser.open(self.root / "hostile/report.html")
        self.assertIsNone(self.browser.evaluate("window.hacked"))
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('img').length"), 0)
        self.assertIn(HOSTILE, self.browser.evaluate("document.title"))
        text = self.browser.evaluate("document.body.innerText")
        self.assertGreater(text.count(HOSTILE), 8)
        meshes = self.browser.evaluate("report.scene.robots[0].bodies[1].children.filter(c => c.isMesh)"
                                       ".map(c => Array.from(c.geometry.getAttribute('position').array))")
        self.assertEqual(meshes[0][:9], [0, 0, 0, 2, 0, 0, 0, 2, 0])
        self.assertEqual([len(mesh) for mesh in meshes], [18])
        self.assertIn("FAIL", text)

    def test_sliders_keep_loops_closed_or_say_so(self):
        page = self.root / "view.html"
        run("view", "bipetto", "-o", page)
        self.browser.open(page)
        start = self.browser.evaluate(PICTURE)
        move = """((index, share) => {
          const slider = document.querySelectorAll('.motor input')[index], low = Number(slider.min);
          slider.value = low + share * (slider.max - low);
          slider.dispatchEvent(new Event('input'));
          return [report.viewer.getLargestGap(), slider.closest('.card').querySelector('.status').textContent];
        })"""
        count = self.browser.evaluate("document.querySelectorAll('.motor input').length")
        self.assertEqual(count, 12)
        closed = refused = 0
        before = start
        for index in range(count):
            for share in (0.45, 0.55, 0.3, 0.7, 0, 1):
                gap, status = self.browser.evaluate(f"{move}({index}, {share})")
                self.assertLess(gap, 2e-3)  # of the interpolation
                closed, refused = closed + (status == ""), refused + (status != "")
            after = self.browser.evaluate(PICTURE)
            self.assertGreater(differ(before, after), 100, index)
            before = after
        self.assertGreater(closed, 48)
        self.assertGreater(refused, 0)  # the knee's linkage has a dead point
        self.browser.evaluate("document.querySelector('#sliders button').click()")
        self.assertLess(differ(start, self.browser.evaluate(PICTURE)), 200)

    def test_readouts_follow_the_sliders(self):
        """Angles, ratio and distance from dead points beside the sliders against `bielle ratio`, which follows the linkage by itself."""
        page = self.root / "readouts.html"
        run("view", "bipetto", "-o", page)
        run("ratio", "bipetto", "--joint", "knee_left", "-o", self.root / "ratio")
        with open(self.root / "ratio/ratio.csv") as file:
            curve = [row for row in csv.DictReader(file) if not row["dead"]]
        names = ["q.knee_left", "R.motor_knee_left/knee_left", "distance"]
        self.browser.open(page)
        read = """(place => {
          const grid = report.viewer.grids.findIndex(g => g.motors.some(
              m => report.viewer.run.robot.motors[m.motor].name === 'motor_knee_left'));
          const slider = report.viewer.sliders[grid].sliders[0], low = Number(slider.min);
          slider.value = low + place / (report.viewer.grids[grid].count - 1) * (slider.max - low);
          slider.dispatchEvent(new Event('input'));
          const card = slider.closest('.card');
          return [report.viewer.grids[grid].values[0], card.querySelector('.status').textContent, Object.fromEntries(
              [...card.querySelectorAll('.readouts div')].map(row => [...row.children].map(child => child.textContent)))];
        })"""
        compared, seen = 0, set()
        for place in range(0, 41, 2):
            motor, status, values = self.browser.evaluate(f"{read}({place})")
            distance = values["distance from dead points"]
            self.assertRegex(distance, r"^(over 0.5|[\d.]+) rad$")
            angle = "q.motor_knee_left"
            near = [pair for pair in zip(curve, curve[1:])
                    if pair[0]["branch"] == pair[1]["branch"] and float(pair[0][angle]) <= motor <= float(pair[1][angle])]
            if status or not near:
                continue
            a, b = near[0]
            share = (motor - float(a[angle])) / (float(b[angle]) - float(a[angle]))
            shown = [float(values["knee_left"].split()[0]), float(values["ratio motor_knee_left : knee_left"]),
                     None if "over" in distance else float(distance.split()[0])]
            for name, value in zip(names, shown):
                if value is None or not a[name] or not b[name]:
                    self.assertTrue(name == "distance")
                    continue
                expected = (1 - share) * float(a[name]) + share * float(b[name])
                self.assertAlmostEqual(value, expected, delta=2e-3 * max(1, abs(expected)), msg=f"{name} at {place}")
                self.assertNotAlmostEqual(value + 0.01 * max(1, abs(expected)), expected, delta=2e-3 * max(1, abs(expected)))
            compared += 1
            seen.add(values["ratio motor_knee_left : knee_left"])
        self.assertGreater(compared, 5)
        self.assertEqual(len(seen), compared)  # they move with the slider

    def test_parameters_have_sliders_whose_robots_close(self):
        page = self.root / "parameters.html"
        run("view", "leg_biped", "--parameter", "knee_crank", "--parameter", "thigh_length=0.1:0.3", "-o", page)
        self.browser.open(page)
        start = self.browser.evaluate(PICTURE)
        move = """((index, place) => {
          const slider = document.querySelectorAll('.parameters input')[index];
          slider.value = place;
          slider.dispatchEvent(new Event('input'));
          return [slider.parentElement.querySelector('output').textContent, report.viewer.getLargestGap(),
                  report.scene.robots.filter(robot => robot.root.visible).length,
                  report.viewer.run.robot.closures[0].pose[2]];
        })"""
        names = self.browser.evaluate("[...document.querySelectorAll('.parameters .name')].map(e => e.textContent)")
        self.assertEqual(names, ["knee_crank", "thigh_length"])
        self.assertGreater(self.browser.evaluate("document.querySelector('.parameters').clientHeight"), 20)
        motor = self.browser.evaluate("""(() => {
          const slider = document.querySelectorAll('.motors input')[0];
          slider.value = Number(slider.value) + 0.3;
          slider.dispatchEvent(new Event('input'));
          return Number(slider.value);
        })()""")
        before = self.browser.evaluate(PICTURE)
        for index, place, shown in ((0, 6, "0.065 m"), (1, 6, "0.3 m"), (0, 0, "0.035 m")):
            value, gap, visible, _ = self.browser.evaluate(f"{move}({index}, {place})")
            self.assertEqual(value, shown)
            self.assertLess(gap, 2e-3)
            self.assertEqual(visible, 1)
            after = self.browser.evaluate(PICTURE)
            self.assertGreater(differ(before, after), 100)
            before = after
            kept = self.browser.evaluate("Number(document.querySelectorAll('.motors input')[0].value)")
            self.assertAlmostEqual(kept, motor, 6)
        self.browser.evaluate(f"{move}(1, 0)")  # a thigh of 0.1 m does not reach the ground
        self.assertIn("no such robot", self.browser.evaluate("document.querySelector('.parameters .status').textContent"))
        self.browser.evaluate(f"{move}(0, 0)")
        # One parameter at a time; in its middle it is the robot again.
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('.parameters output')[1].textContent"), "0.22 m")
        self.browser.evaluate(f"{move}(0, 3)")
        self.browser.evaluate("document.querySelector('#sliders button').click()")
        self.assertLess(differ(start, self.browser.evaluate(PICTURE)), 200)

    def test_modes_swing_as_their_shapes(self):
        """Angles of hinges on the page against the shapes that the command prints."""
        page = self.root / "modes.html"
        answer = json.loads(run("modes", "spring_biped", "--lock-motors", "--json", "-o", page).stdout)
        self.browser.open(page)
        self.browser.evaluate("document.querySelector('#sliders button').click()")  # stands still
        self.assertEqual(self.browser.evaluate("report.viewer.list.length"), len(answer["modes"]))
        angles = """((mode, amplitude) => {
          const viewer = report.viewer;
          const show = size => {
            viewer.list.value = mode;
            viewer.list.onchange();
            viewer.amplitude.value = size;
            viewer.amplitude.dispatchEvent(new Event('input'));
            return viewer.run.robot.joints.map((joint, j) => viewer.local[j + 1].clone());
          };
          const before = show(0), after = show(amplitude);
          return viewer.run.robot.joints.filter(joint => joint.kind === 'revolute').map(joint => {
            const j = viewer.run.robot.joints.indexOf(joint);
            const turn = new THREE.Matrix4().getInverse(before[j]).multiply(after[j]);
            const quaternion = new THREE.Quaternion().setFromRotationMatrix(turn).normalize();
            return [joint.name, 2 * Math.asin(Math.min(1, Math.hypot(quaternion.x, quaternion.y, quaternion.z)))];
          });
        })"""
        amplitude, pictures = 0.02, []
        for number, mode in enumerate(answer["modes"]):
            shape = dict(zip(answer["order"], mode["shape"]))
            shown = self.browser.evaluate(f"{angles}({number}, {amplitude})")
            self.assertGreater(len(shown), 10)
            errors = [abs(angle - abs(amplitude * shape[name])) for name, angle in shown]
            self.assertLess(max(errors), 5e-4)  # of second order: less than amplitude^2
            poisoned = [abs(angle - abs(amplitude * (shape[name] + 0.1))) for name, angle in shown]
            self.assertGreater(min(poisoned), 5e-4)
            self.assertLess(self.browser.evaluate("report.viewer.getLargestGap()"), 1e-4)
        for number in (0, len(answer["modes"]) - 1):
            self.browser.evaluate(f"{angles}({number}, 0.2)")
            pictures.append(self.browser.evaluate(PICTURE))
        self.assertGreater(differ(*pictures), 100)
        self.browser.evaluate("document.querySelector('#sliders button').click()")
        phase = self.browser.evaluate("report.viewer.phase")
        time.sleep(0.5)
        self.assertNotEqual(phase, self.browser.evaluate("report.viewer.phase"))

    def test_springs_between_points_follow_the_bodies(self):
        robot = self.root / "sprung"
        robot.mkdir()
        source = pathlib.Path(__file__).parent.parent / "robots/fivebar_leg"
        (robot / "sprung.yaml").write_text(f"""model: {source}
point_springs:
  coil: {{frames: [world, upper_front], points: [[0.3, 0, 0.2], [0.05, 0, 0]], stiffness: 9, rest: 0.2, damping: 1}}
  dashpot: {{frames: [lower_front, upper_back], damping: 1}}
""")
        page = self.root / "sprung.html"
        run("view", robot, "-o", page)
        self.browser.open(page)
        ends = """report.scene.robots[0].springs.map(s => {
          const root = report.scene.robots[0].root;
          root.updateMatrixWorld(true);
          const far = new THREE.Vector3(0, 0, 1).applyMatrix4(s.object.matrixWorld);
          return [s.object.position.toArray(), root.worldToLocal(far).toArray(), s.object.children.length];
        })"""
        bodies = """['upper_front', 'upper_back', 'lower_front'].map(name => {
          const joints = {upper_front: 'motor_front', upper_back: 'motor_back', lower_front: 'knee_front'};
          const body = report.scene.robots[0].bodies[1 + report.runs[0].robot.joints.findIndex(j => j.name === joints[name])];
          return [body.position.toArray(), body.localToWorld(new THREE.Vector3(0.05, 0, 0)).toArray()];
        })"""
        seen = []
        for share in (0.5, 0.6):
            self.browser.evaluate(f"""(() => {{ const slider = document.querySelectorAll('.motor input')[0];
              slider.value = Number(slider.min) + {share} * (slider.max - slider.min);
              slider.dispatchEvent(new Event('input')); }})()""")
            coil, dashpot = self.browser.evaluate(ends)
            front, back, lower = self.browser.evaluate(bodies)
            for found, expected in zip(coil[0] + coil[1] + dashpot[0] + dashpot[1],
                                       [0.3, 0, 0.2] + front[1] + lower[0] + back[0]):
                self.assertAlmostEqual(found, expected, delta=1e-6)
            self.assertEqual([coil[2], dashpot[2]], [3, 2])
            seen.append(coil[1])
        self.assertGreater(max(abs(a - b) for a, b in zip(*seen)), 1e-3)
        shown = self.browser.evaluate(PICTURE)
        self.browser.evaluate("report.scene.robots[0].springs.forEach(s => { s.object.visible = false; })")
        self.assertGreater(differ(shown, self.browser.evaluate(PICTURE)), 20)

    def test_stills_have_the_size_asked_for(self):
        picture = self.root / "stills.png"
        run("report", self.squat, "--png", picture, "--times", "0,0.3,0.6", "--size", "96x80", "--columns", "2")
        data = picture.read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", data[16:24]), (192, 160))
        self.assertGreater(len(data), 8000)

    def test_a_robot_has_a_picture_of_its_page(self):
        page, sizes = self.root / "shown.html", []
        for robot in ("bipetto", "fourbar"):
            picture = self.root / f"{robot}.png"
            run("view", robot, "-o", page, "--png", picture)
            data = picture.read_bytes()
            self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual(struct.unpack(">II", data[16:24]), (1280, 1000))
            sizes.append(len(data))
        self.assertGreater(sizes[1], 20000)        # not blank
        self.assertGreater(sizes[0], 1.3 * sizes[1])  # more bodies, sliders and readouts

    def test_stills_need_a_browser(self):
        result = subprocess.run([BIELLE, "report", str(self.squat), "--png", str(self.root / "none.png")],
                                capture_output=True, text=True, env={**os.environ, "PATH": "/nonexistent"})
        self.assertEqual(result.returncode, 2)
        self.assertIn("is not on the PATH", result.stderr)
        self.assertFalse((self.root / "none.png").exists())

    def test_complaints_are_heard(self):
        """The instrument itself: what it must catch, it catches."""
        page = self.root / "bad.html"
        page.write_text("<script>console.error('a'); throw new Error('b')</script><img src='http://127.0.0.1:9/x'>")
        self.browser.open(page)
        self.assertGreaterEqual(len(self.browser.complaints), 3)
        self.browser.complaints.clear()


if __name__ == "__main__":
    if not CHROMIUM:
        print("skipped: there is no chromium on the PATH")
        sys.exit(77)
    unittest.main(verbosity=2)
