"""test_dataset.py BIELLE: data sets of motions: the index says what is there, good motions alone are exported, and finished ones kept.

Ends with status 77 where there is no `bielle-check`.
"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

from browser import Browser

BIELLE = os.path.abspath(sys.argv[1])
SHORT = "duration: 0.6, settle: 0, time_step: 0.02"
SPEC = """licence: CC0-1.0
formats: [mjlab, amp]
fps: 30
isaac_lab: 3
motions:
  - {solve: squat, robot: bipetto, payload: [0, 3], set: {depth: 0.9, """ + SHORT + """}}
  - {solve: squat, robot: bipetto, set: {depth: 0.85, com_weight: 1, """ + SHORT + """}}
"""
PUSHED = """formats: [mjlab, mcap]
motions:
  solve: squat
  robot: bipetto
  set: {depth: 0.9, """ + SHORT + """}
  simulate: {hold: 0.1, push: ["t=0.2,impulse=2,direction=90", "t=0.2,impulse=60"]}
"""


def run(place, text, status=0):
    with open(os.path.join(place, "squats.yaml"), "w", encoding="utf-8") as file:
        file.write(text)
    result = subprocess.run([BIELLE, "dataset", "squats.yaml", "-o", "squats"], cwd=place, capture_output=True, text=True)
    assert result.returncode == status, result.stdout + result.stderr
    return result


def read(place, *path):
    with open(os.path.join(place, "squats", *path), encoding="utf-8") as file:
        return file.read()


def read_index(place):
    return [json.loads(line) for line in read(place, "index.jsonl").splitlines()]


def read_shape(path, array):
    with zipfile.ZipFile(path) as archive:
        header = archive.read(array + ".npy")[:300].decode("latin-1")
    return [int(n) for n in re.search(r"'shape': \(([\d,]*)\)", header)[1].split(",") if n]


def check_entries(place):
    entries = read_index(place)
    assert [entry["payload_kg"] for entry in entries] == [0, 3, 0]
    assert [entry["good"] for entry in entries] == [True, True, False], entries
    for entry in entries:
        summary = json.loads(read(place, "motions", entry["name"], "motion", "summary.json"))
        assert entry["converged"] == summary["converged"]
        assert [(g["requested"], g["achieved"]) for g in entry["goals"]] == [
            (g["requested"], g["achieved"]) for g in summary["goals"]]
        assert entry["set"] and all(summary["options"][option] == value for option, value in entry["set"].items())
        assert entry["check_passed"] == json.loads(read(place, "motions", entry["name"], "motion", "check.json"))["pass"]
        assert sorted(entry["files"]) == (["amp", "mjlab"] if entry["good"] else [])
        for path in entry["files"].values():
            path = os.path.join(place, "squats", path)
            frames = read_shape(path, "joint_pos" if "mjlab" in path else "dof_positions")[0]
            assert frames == round(entry["duration_s"] * 30) + 1
            with zipfile.ZipFile(path) as archive:
                assert ("isaac_lab.npy" in archive.namelist()) == ("amp" in path), path
    assert entries[2]["converged"] and not entries[2]["goals_met"]
    # The robot carries what it was asked to carry.
    masses = []
    for name in ("bipetto", "bipetto_payload_3"):
        info = subprocess.run([BIELLE, "info", os.path.join(place, "squats", "mjlab", name + ".xml"), "--json"],
                              capture_output=True, text=True, check=True)
        masses.append(json.loads(info.stdout)["mass"])
    assert abs(masses[1] - masses[0] - 3) < 1e-9, masses
    card = read(place, "README.md")
    assert "3 motions were asked for, 2 are good" in card and "CC0-1.0" in card and SPEC in card


def check_page(place):
    """A card per motion, with its picture, its values and files that exist; lists of the header leave some of them."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if not chromium:
        print("no Chromium: the page was not opened")
        return
    browser = Browser(chromium, 1200, 800)
    browser.open(os.path.join(place, "squats", "index.html"))
    assert browser.complaints == [], browser.complaints
    entries = read_index(place)
    cards = browser.evaluate("[...document.querySelectorAll('.motion')].map(c => [c.id, c.innerText, c.querySelectorAll('svg svg').length,"
                             " [...c.querySelectorAll('a')].map(a => a.getAttribute('href'))])")
    assert [card[0] for card in cards] == [entry["name"] for entry in entries]
    for (_, text, pictures, links), entry in zip(cards, entries):
        assert pictures == 6 and links == list(entry["files"].values()), (pictures, links)
        assert all(os.path.exists(os.path.join(place, "squats", link)) for link in links)
        assert f"depth {entry['set']['depth']}" in text and f"depth {entry['goals'][0]['achieved']:.4g}" in text, text
        assert ("a goal was missed" in text) == (not entry["good"])
    heights = browser.evaluate("[...document.querySelectorAll('.motion')].map(c => [...c.querySelectorAll('circle')].map(e => e.getAttribute('cy')))")
    assert all(int(row[0]) + 10 < int(row[3]) for row in heights[:2]), heights  # squats, downwards
    count = "[document.getElementById('title').textContent, document.querySelectorAll('.motion:not([hidden])').length]"
    choose = "const list = document.querySelector('[title=%s]'); list.value = '%s'; list.onchange(); "
    assert browser.evaluate(count) == ["squats: 2 of 3 motions are good", 3]
    assert browser.evaluate("(() => {" + choose % ("payload", "3 kg") + "return " + count + "})()") == ["squats: 1 of 1 motions are good", 1]
    browser.close()


def check_pushes(place):
    """What was carried out is exported as it happened, and good only if the robot stood."""
    result = run(place, PUSHED)
    assert "1 of 2 motions are good" in result.stdout and "impulse_60: it fell" in result.stderr, result.stdout + result.stderr
    stood, fell = read_index(place)
    assert (stood["outcome"], fell["outcome"]) == ("stood", "fell") and fell["converged"] and fell["check_passed"]
    assert stood["simulate"] == {"hold": 0.1, "push": "t=0.2,impulse=2,direction=90"} and not fell["files"]
    summary = json.loads(read(place, "motions", stood["name"], "carried_out", "summary.json"))
    # To the end of the hold, 0.7 s, and then until it is decided that it stands.
    assert stood["duration_s"] == summary["duration"] and abs(stood["duration_s"] - summary["extension"] - 0.7) < 1e-6, (stood, summary)
    assert 0 < summary["extension"] < 5, summary["extension"]
    frames = read_shape(os.path.join(place, "squats", stood["files"]["mjlab"]), "joint_pos")[0]
    assert abs(frames - 1 - 50 * stood["duration_s"]) < 1, frames
    assert os.path.exists(os.path.join(place, "squats", stood["files"]["mcap"]))
    for change, problem in ((("[mjlab, mcap]", "[problem]"), "is no problem"), (("mcap]", "amp]\nisaac_lab: 4"), "no version of Isaac Lab"),
                            (("hold: 0.1", "live: true"), "cannot be set"), (("hold: 0.1", "play: foo=1"), "key 'play'"),
                            (("t=0.2,impulse=2", "t=0.7,impulse=2"), "is over at 0.8 s, but the simulation ends at 0.7 s")):
        refused = run(place, PUSHED.replace(*change), status=2)
        assert problem in refused.stderr, (change, refused.stderr)


def main():
    if not os.path.exists(os.path.join(os.path.dirname(BIELLE), "bielle-check")):
        print("skipped: no bielle-check")
        return 77
    with tempfile.TemporaryDirectory() as place:
        first = run(place, SPEC)
        assert "2 of 3 motions are good" in first.stdout and "a goal was missed" in first.stderr
        check_entries(place)
        check_page(place)
        index = read(place, "index.jsonl")
        assert run(place, SPEC).stdout.count("kept") == 3 and read(place, "index.jsonl") == index
        # Another value is another motion; the others stay.
        more = run(place, SPEC.replace("depth: 0.9,", "depth: [0.9, 0.95],"))
        assert more.stdout.count("kept") == 3 and more.stdout.count("done") == 2, more.stdout
        assert set(index.splitlines()) < set(read(place, "index.jsonl").splitlines())
        # A motion whose check fails is not good.
        name = read_index(place)[0]["name"]
        check = os.path.join(place, "squats", "motions", name, "motion", "check.json")
        with open(check, encoding="utf-8") as file:
            text = file.read()
        with open(check, "w", encoding="utf-8") as file:
            file.write(re.sub(r'"pass": true\n}\s*$', '"pass": false\n}\n', text))
        assert "the check did not pass" in run(place, SPEC).stderr
        entry = read_index(place)[0]
        assert not entry["good"] and entry["converged"] and not entry["files"]
        for change, problem in ((("solve: squat", "solve: sqat"), "sqat"), (("amp]", "bvh]"), "no format 'bvh'"),
                                (("payload: [0, 3]", "payload: [0, -3]"), "'-3' is no mass"),
                                (("depth: 0.9,", "deepness: 0.9,"), "deepness"), (("fps: 30", "fps: 0"), "no rate"),
                                (("amp]", "mcap]"), "key 'isaac_lab' (line 4): none of the formats depends on it"),
                                (("[mjlab, amp]\nfps: 30\nisaac_lab: 3", "[mcap]\nfps: 30"), "key 'fps' (line 3): none"),
                                (("payload: [0, 3]", "payload: [3, 3]"), "again"), (("licence", "license"), "license"),
                                (("set: {depth: 0.85, com_weight: 1, " + SHORT + "}", "options: {max-iteratoins: 1}"),
                                 "key 'max-iteratoins' (line 7): `bielle solve squat` rejects it"),
                                (("robot: bipetto, payload", "robot: no_such_robot, payload"), "no_such_robot")):
            refused = run(place, SPEC.replace(*change), status=2)
            assert problem in refused.stderr, (change, refused.stderr)
    with tempfile.TemporaryDirectory() as place:
        check_pushes(place)
    print("data sets are what their index says")
    return 0


sys.exit(main())
