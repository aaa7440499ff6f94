"""Pages of designs in a browser: a front and found four-bars, their drawings, links and numbers.

usage: test_design_page.py BIELLE. Ends with status 77 where there is no Chromium.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from browser import Browser

BIELLE = sys.argv.pop(1)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

# Two knees, of which the one at the start is too heavy; the gear starts at a bound.
SPEC = """generator: leg_biped
architecture: [belt_knee, four_bar_knee]
set: {knee: four_bar}
variables:
  - {name: crank, parameter: knee_crank, bounds: [0.045, 0.055]}
  - {name: motor, motor: "*knee*", choices: [ak80-9, ak10-9], mass: knee_motor_mass, start: ak10-9}
  - {name: gear, ratio: "*knee*", bounds: [6, 12], start: 6}
motions: [{motion: squat, set: {depth: 0.85, time_step: 0.05}}]
objective: [{measure: electrical_energy, motors: ["*knee*"]}]
constraints: [{measure: mass, at_most: 26}]
search: {searches: 1, stages: [{algorithm: sbplx, evaluations: 3}]}
"""

FRONT = """generator: fivebar_leg
variables:
  - {name: upper, parameter: upper_length, bounds: [0.08, 0.12]}
  - {name: lower, parameter: lower_length, bounds: [0.18, 0.22]}
motions: [{motion: squat, set: {depth: 0.9}}]
objective: [{measure: peak_torque}, {measure: cost}]
search: {pareto: {population: 8, generations: 1}}
"""

# Texts of every drawing that overlap each other or leave it; how many there are.
TEXTS = """(() => {
  let count = 0;
  const bad = [];
  for (const svg of document.querySelectorAll('#designs svg, .motion svg, #front svg')) {
    const frame = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll('text')].map(t => [t.textContent, t.getBoundingClientRect()]);
    texts.forEach(([text, a], i) => {
      ++count;
      if (a.left < frame.left - 1 || a.right > frame.right + 1 || a.top < frame.top - 1 || a.bottom > frame.bottom + 1)
        bad.push(text + ' leaves its drawing');
      for (const [other, b] of texts.slice(i + 1))
        if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 2 && b.top < a.bottom - 2)
          bad.push(text + ' lies on ' + other);
    });
  }
  return {count, bad};
})()"""


def run(*arguments, status=0):
    result = subprocess.run([BIELLE, *map(str, arguments)], capture_output=True, text=True)
    assert status in (None, result.returncode), result.stdout + result.stderr
    return result


class DesignPages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.place.cleanup)
        cls.root = pathlib.Path(cls.place.name)
        cls.browser = Browser(CHROMIUM, 1400, 1000)
        cls.addClassCleanup(cls.browser.close)

    def open(self, page):
        self.browser.open(page)
        self.assertEqual(self.browser.complaints, [])

    def check_texts(self):
        found = self.browser.evaluate(TEXTS)
        self.assertGreater(found["count"], 20)
        self.assertEqual(found["bad"], [])
        self.browser.evaluate("document.querySelectorAll('#designs svg text')[1].setAttribute('x', "
                              "document.querySelectorAll('#designs svg text')[0].getAttribute('x'));"
                              "document.querySelectorAll('#designs svg text')[1].setAttribute('y', "
                              "document.querySelectorAll('#designs svg text')[0].getAttribute('y'));")
        self.assertNotEqual(self.browser.evaluate(TEXTS)["bad"], [])  # what it must catch, it catches

    def read_values(self):
        return self.browser.evaluate("[...document.querySelectorAll('#values tbody tr')]"
                                     ".map(row => [...row.cells].map(cell => cell.textContent))")

    def test_ranking(self):
        spec, out = self.root / "spec.yaml", self.root / "ranked"
        spec.write_text(SPEC)
        shown = run("design", spec, "-o", out).stdout
        self.assertIn("design.html", shown)
        self.open(out / "design.html")
        rows = self.read_values()
        self.assertEqual([row[0].split()[0] for row in rows][:2], ["start", "01"])
        self.assertIn("violated", rows[0][2])
        self.assertNotIn("violated", rows[1][2])
        self.assertGreater(float(rows[1][3]), 0.1)  # the margin
        self.assertTrue(any("bound" in cell for row in rows for cell in row), rows)
        self.assertTrue(any(" violated" in row or " bound" in row for row in shown.splitlines()), shown)
        page = (out / "design.md").read_text()
        self.assertIn("**violated**", page)
        logged = [json.loads(line) for line in (out / "search1.jsonl").read_text().splitlines()[1:]]
        self.assertTrue(all("margin" in line for line in logged if line["status"] != "motion failed"))
        self.assertIn("gear at its lower bound", logged[0]["marks"])
        self.assertTrue(any(mark.startswith("mass ") for mark in logged[0]["marks"]))
        # Every design has a drawing; a click shows its robot, a motion and clouds within envelopes.
        cards = self.browser.evaluate("document.querySelectorAll('#designs .design svg').length")
        self.assertEqual(cards, len(rows))
        self.browser.evaluate("document.querySelectorAll('#designs .design')[1].click()")
        links = self.browser.evaluate("[...document.querySelectorAll('#chosen a')].map(a => a.getAttribute('href'))")
        self.assertIn("ranked/01/01.yaml", links)
        self.assertIn("ranked/01/squat/report.html", links)
        for link in links:
            self.assertTrue((out / link).is_file(), link)
        text = self.browser.evaluate("document.querySelector('#chosen pre').textContent")
        self.assertIn("motors:", text)
        table = self.browser.evaluate("document.querySelectorAll('#chosen .card')[1].innerText")
        self.assertRegex(table, r"electrical_energy of \*knee\* \[J\]\s+[\d.]+\s+[\d.]+\s+[−+][\d.]+ %")
        clouds = self.browser.evaluate("[...document.querySelectorAll('.clouds figure')].map(f => "
                                       "[f.querySelectorAll('circle').length, f.querySelectorAll('.envelope').length])")
        self.assertEqual(len(clouds), 12)
        self.assertTrue(all(points > 10 for points, _ in clouds))
        self.assertEqual(sum(envelopes for _, envelopes in clouds), 2)  # of the knees, whose motors are of a catalogue
        self.check_texts()
        # The mechanism before and after, as a file.
        mechanism = (out / "design_mechanism.svg").read_text()
        self.assertIn("knee_left", mechanism)
        self.assertRegex(mechanism, r">\d+(\.\d)?</text>")

    def test_front(self):
        if "pareto" in run("design", self.write_front(), "-o", self.root / "front", status=None).stderr:
            self.skipTest("built without pagmo")
        self.open(self.root / "front/design.html")
        rows = self.read_values()
        points = self.browser.evaluate("document.querySelectorAll('#front .point').length")
        self.assertEqual(points, len(rows))
        self.assertGreater(points, 1)
        for index in (0, points - 1):
            self.browser.evaluate("document.querySelectorAll('#front .point')[%d].dispatchEvent(new Event('click'))" % index)
            name = self.browser.evaluate("document.querySelector('#chosen h2').textContent")
            self.assertEqual(name.split(",")[0], rows[index][0].split()[0])
            drawn = self.browser.evaluate("document.querySelector('#chosen .drawing').textContent")
            self.assertIn("motor_front", drawn)
        self.check_texts()

    def write_front(self):
        path = self.root / "front.yaml"
        path.write_text(FRONT)
        return path

    def test_found_four_bars(self):
        out = self.root / "knees"
        shown = run("synthesize", "--range", "0:1.6", "--ratio", "0.9", "--samples", "30000", "--count", "3", "-o", out)
        self.assertIn("synthesis.html", shown.stdout)
        self.open(out / "synthesis.html")
        rows = self.read_values()
        self.assertEqual([row[0].split()[0] for row in rows], ["leg_1", "leg_2", "leg_3"])
        printed = [line.split() for line in shown.stdout.splitlines() if line.split()[:1] == ["leg_1"]][0]
        self.assertAlmostEqual(float(rows[0][1]), float(printed[1]), delta=2e-4 * float(printed[1]))
        # The crank that is drawn is that of the table.
        crank = float(re.match(r"[\d.]+", rows[0][7])[0])
        svg = self.browser.evaluate("designPage.designs[0].distances.filter(d => d[0].startsWith('crank_'))[0][3]")
        self.assertAlmostEqual(svg, 1000 * crank, delta=0.05)
        self.check_texts()


if __name__ == "__main__":
    if not CHROMIUM:
        print("skipped: there is no chromium on the PATH")
        sys.exit(77)
    unittest.main(verbosity=2)
