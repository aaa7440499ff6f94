"""test_results_alone.py BIELLE [rest]: whatever `bielle solve` writes is read again from its files alone, elsewhere, when all that the
request named (robot, footholds, warm start) is gone. A case an option, or the rest of them and a case a motion."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

BIELLE, REST = os.path.abspath(sys.argv[1]), "rest" in sys.argv
ROBOT = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "robots", "bipetto")
SQUAT = ["squat", "--depth", "0.9", "--set", "duration=0.6", "--set", "settle=0", "--set", "time_step=0.02"]
STONES = """footholds:
  - {foot: right, x: 0.150, y: -0.10, z: 0.01, yaw: 0.05, pitch: 0.03}  # as it is written
  - {foot: left, x: 3e-1, y: .1, z: 0.02}
"""
FOOTHOLDS = ["footholds", "--footholds", "inputs/stones.yaml", "--set", "time_step=0.03", "--set", "single_support=0.6"]
KNEE = "motor_knee_right"
# What no problem can be exported of, and what the message says to do.
REFUSED = {
    "formulation full": "without --formulation", "step euler": "without --formulation and --step",
    "serial": "without --model serial", "free timings": "without --free-timings",
    "peak torque": "for effort or energy", "serial midpoint": "without --model serial",
    "cycle": "without --periodic", "cycle of a run": "without --periodic"}

OPTIONS = {
    "footholds": FOOTHOLDS,
    "limits": [*SQUAT, "--limit", KNEE + "=60", "--velocity-limit", KNEE + "=9", "--power-limit", KNEE + "=150"],
    "warm start": [*SQUAT, "--warm-start", "inputs/limits"],
}
MORE_OPTIONS = {
    "no limits": [*SQUAT, "--no-limits"],
    "step euler": [*SQUAT, "--step", "euler"],
    "formulation full": [*SQUAT, "--formulation", "full"],
    "serial": [*SQUAT, "--model", "serial"],
    "serial midpoint": [*SQUAT, "--model", "serial", "--serial-armature", "reflected", "--step", "midpoint"],
    "margin": [*SQUAT, "--dead-point-margin", "0.05"],
    "no margin": [*SQUAT, "--dead-point-margin", "0"],
    "energy": [*SQUAT, "--objective", "energy", "--regeneration", "0.5", "--regularization", "0.5"],
    "peak torque": [*SQUAT, "--objective", "peak-torque"],
    "free timings": ["walk", "--steps", "2", "--set", "time_step=0.03", "--free-timings", "all=0.8:1.3", "--time-weight", "1"],
    "no multipliers": [*SQUAT, "--no-multipliers"],
    "limited sequence": ["sequence", "--motions", "squat,walk,squat", "--set", "walk.steps=2", "--set", "walk.time_step=0.03",
                         "--set", "squat.time_step=0.03", "--set", "squat2.time_step=0.03", "--set", "squat2.depth=0.9",
                         "--set", "squat.duration=1", "--set", "squat2.duration=1",
                         "--limit", KNEE + "=60"],
}
COARSE = ["--set", "time_step=0.03"]
MOTIONS = {
    "walk": ["walk", "--speed", "0.3", "--steps", "3", *COARSE],
    "rigid walk": ["walk", "--speed", "0.3", "--steps", "2", "--set", "rigid_landing=true", *COARSE],
    "side-walk": ["side-walk", "--speed", "0.1", "--steps", "2", *COARSE],
    "turn": ["turn", "--angle", "0.4", "--steps", "2", *COARSE],
    "stairs": ["stairs", "--height", "0.04", "--stairs", "1", *COARSE],
    "box": ["box", "--height", "0.06", "--down", *COARSE],
    "gap": ["gap", "--width", "0.1", *COARSE],
    "cycle": ["walk", "--speed", "0.3", "--periodic", *COARSE],
    "cycle of a run": ["run", "--speed", "0.5", "--periodic", "--set", "cycles=2", "--set", "time_step=0.02"],
    "jump": ["jump", "--flight", "0.15", "--length", "0.05"],
    "run": ["run", "--speed", "0.5", "--steps", "3", "--set", "time_step=0.02"],
    "hop": ["hop", "--foot", "left", "--flight", "0.1"],
    "stones": ["footholds", "--footholds", "inputs/stones.yaml"],
}


def run(*arguments, where, statuses=(0,)):
    result = subprocess.run([BIELLE, *arguments], cwd=where, capture_output=True, text=True,
                            env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert result.returncode in statuses, (arguments, result.returncode, result.stdout[-500:], result.stderr)
    return result


def solve(place, name, arguments):
    run("solve", *arguments, "--robot", "inputs/bipetto", "--quiet", "--no-check", "--no-report", "-o", "results/" + name, where=place)


def read_summary(path):
    with open(os.path.join(path, "summary.json"), encoding="utf-8") as file:
        return json.load(file)


def check_exports(result, where, name):
    for form in ("sto", "mot", "amp", "mjlab", "mcap", "problem"):
        if form == "problem" and (name in REFUSED or name.startswith("carried")):
            continue
        path = f"{name} as {form}.{'json' if form == 'problem' else form}"
        told = run("export", result, "--format", form, "-o", path, where=where)
        assert "has changed since" not in told.stderr, told.stderr
        assert ("give '--isaac-lab 3'" in told.stderr) == (form == "amp"), told.stderr
        assert os.path.getsize(os.path.join(where, path)) > 1000, path


def check_refusal(result, where, name):
    """A remedy names options of `bielle solve` alone."""
    told = run("export", result, "--format", "problem", "-o", "refused.json", where=where, statuses=(2,)).stderr
    assert REFUSED[name] in told, told
    known = run("solve", "walk", "--help", where=where).stdout
    assert all(option in known for option in re.findall(r"--[a-z-]+", told)), told


def check_result(place, name):
    """From another directory, with nothing but the result."""
    where, result = os.path.join(place, "elsewhere"), os.path.join(place, "results", name)
    assert not os.path.exists(os.path.join(place, "inputs"))
    run("check", result, where=where)
    run("report", result, "-o", "page.html", where=where)
    check_exports(result, where, name)
    if name in REFUSED:
        check_refusal(result, where, name)
    summary = read_summary(result)
    # The motion is planned again for either. Predictive control rehearses steps first; the first tier lets it.
    mpc = summary["formulation"] == "reduced" and name != "peak torque" and name not in MOTIONS
    for control in (["mpc"] if mpc else []) + (["gains"] if name != "peak torque" else []) + ["open"]:
        carried = f"{name} {control}"
        told = run("simulate", result, "-o", carried, "--control", control, "--duration", "0.06", where=where, statuses=(0, 1))
        assert "has changed since" not in told.stderr, told.stderr
        happened = read_summary(os.path.join(where, carried))
        assert happened["robot_fingerprint"], happened
    # What happened is a result of its own, for which the plan is not needed.
    run("report", carried, "-o", "page.html", where=where)
    if not REST:
        check_exports(carried, where, "carried " + name)
    if name == "footholds":
        assert summary["options"]["footholds"] == ("[{foot: right, x: 0.150, y: -0.10, z: 0.01, yaw: 0.05, pitch: 0.03}, "
                                                   "{foot: left, x: 3e-1, y: .1, z: 0.02}]"), summary["options"]
        # Given as an option, the list is the same motion.
        again = run("simulate", "footholds", "--robot", os.path.join(result, "mechanism.urdf"), "--set",
                    "footholds=" + summary["options"]["footholds"], "--set", "time_step=0.03", "--duration", "0.02",
                    "--control", "open", "-o", "again", where=where, statuses=(0, 1))
        assert "footholds of" in again.stdout, again.stdout
        missing = run("simulate", "footholds", "--robot", os.path.join(result, "mechanism.urdf"), "-o", "none", where=where,
                      statuses=(2,)).stderr
        assert "bielle solve footholds --footholds FILE.yaml" in missing, missing
    print(f"{name}: read again from its files alone")


def check_campaign(place, names):
    """One of all results."""
    where = os.path.join(place, "elsewhere")
    motions = json.dumps([os.path.join("..", "results", name) for name in names])
    with open(os.path.join(where, "campaign.yaml"), "w", encoding="utf-8") as file:
        file.write(f"motions: {motions}\noptions: {{control: open, duration: 0.02}}\n")
    run("campaign", "campaign.yaml", "-o", "campaign", where=where)
    with open(os.path.join(where, "campaign", "runs.csv"), encoding="utf-8") as file:
        rows = file.read().splitlines()
    assert len(rows) == 1 + len(names) and all(re.search("ended|stood|fell", row) for row in rows[1:]), rows


def main():
    with tempfile.TemporaryDirectory() as place:
        os.mkdir(os.path.join(place, "elsewhere"))
        os.mkdir(os.path.join(place, "inputs"))
        shutil.copytree(ROBOT, os.path.join(place, "inputs", "bipetto"))
        with open(os.path.join(place, "inputs", "stones.yaml"), "w", encoding="utf-8") as file:
            file.write(STONES)
        cases = {**MORE_OPTIONS, **MOTIONS} if REST else OPTIONS
        for name, arguments in cases.items():
            solve(place, name, arguments)
            if name == "limits":
                shutil.copytree(os.path.join(place, "results", name), os.path.join(place, "inputs", name))
        shutil.rmtree(os.path.join(place, "inputs"))
        for name in cases:
            check_result(place, name)
        check_campaign(place, cases)


main()
