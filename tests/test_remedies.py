"""test_remedies.py BIELLE SOURCE: remedies are of use.

What a message names exists: each option in a text of the sources is one that a help lists. And where a remedy gives a value or an
option, it is followed: what was refused is then planned.
"""
import os
import pathlib
import re
import subprocess
import sys

BIELLE, SOURCE = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
SOLVE, SIMULATE = "solve {} --robot bipetto --dry-run ", "simulate {} --robot bipetto -o nowhere --dry-run "
FOLLOWED = [  # command, what it refuses, the remedy, and what follows it: {} is what the remedy gives
    (SOLVE.format("stairs"), "--set depth=0.1", r"give ([\d.]+) ", "--set depth={}"),
    (SOLVE.format("stairs"), "--set depth=0.1", r"better ([\d.]+)", "--set depth={}"),
    (SOLVE.format("stairs"), "--set width=0.1", r"give ([\d.]+) ", "--set width={}"),
    (SOLVE.format("box"), "--set length=0.1", r"give ([\d.]+) ", "--set length={}"),
    (SOLVE.format("gap"), "--set width=1.5", r"e\.g\. ([\d.]+)", "--set width={}"),
    (SOLVE.format("walk"), "--set speed=3", r"e\.g\. ([\d.]+) m/s", "--set speed={}"),
    (SOLVE.format("walk"), "--set speed=500", r"e\.g\. ([\d.]+) m/s", "--set speed={}"),
    (SOLVE.format("side-walk"), "--set speed=2", r"e\.g\. ([\d.]+) m/s", "--set speed={}"),
    (SOLVE.format("side-walk").replace("bipetto", "rsu_biped"), "--set speed=-2", r"e\.g\. (-[\d.]+) m/s", "--set speed={}"),
    (SOLVE.format("run"), "--set speed=-6", r"e\.g\. (-[\d.]+) m/s", "--set speed={}"),
    (SOLVE.format("walk"), "--dead-point-margin-of knee_left=1.2", r"e\.g\. ([\d.]+)", "--dead-point-margin-of knee_left={}"),
    (SOLVE.format("walk"), "--set swing_height=2", r"e\.g\. ([\d.]+)", "--set swing_height={}"),
    (SOLVE.format("walk"), "--set time_step=0.2", r"e\.g\. ([\d.]+)", "--set time_step={}"),
    (SOLVE.format("walk") + "--set time_step=0.02 ", "--set single_support=0.03", r"e\.g\. ([\d.]+)", "--set single_support={}"),
    (SOLVE.format("walk"), "--set landing_speed=0.05", r"add (\S+),", "--set landing_speed=0.05 --set {}"),
    (SOLVE.format("walk") + "--set rigid_landing=true ", "--set landing_speed=0.3", r"e\.g\. ([\d.]+)", "--set landing_speed={}"),
    (SOLVE.format("run"), "--set stance=0.01", r"e\.g\. ([\d.]+)", "--set stance={}"),
    (SOLVE.format("stairs"), "--set stairs=1000", r"a whole number, (\d+)", "--set stairs={}"),
    (SOLVE.format("squat"), "--set depth=1.3", r"at most ([\d.]+)", "--set depth={}"),
    (SOLVE.format("squat"), "--set depth=0.05", r"at least ([\d.]+)", "--set depth={}"),
    (SOLVE.format("squat"), "--set duration=0.001", r"e\.g\. ([\d.]+)", "--set duration={}"),
    (SOLVE.format("squat") + "--set duration=0.15 ", "--set time_step=0.1", r"e\.g\. ([\d.]+)", "--set time_step={}"),
    (SOLVE.format("walk"), "--set single_support=0", r"e\.g\. ([\d.]+)", "--set single_support={}"),
    (SOLVE.format("walk"), "--set end_support=70", r"e\.g\. ([\d.]+)", "--set end_support={}"),
    (SOLVE.format("jump"), "--set length=2", r"e\.g\. ([\d.]+)", "--set length={}"),
    (SOLVE.format("jump"), "--set length=-2", r"e\.g\. (-[\d.]+)", "--set length={}"),
    (SOLVE.format("squat"), "--dead-point-margin 1.2", r"e\.g\. ([\d.]+)", "--dead-point-margin {}"),
    (SOLVE.format("walk"), "--time-weight 0.5", r"give (--free-timings)", "--time-weight 0.5 {}"),
    (SOLVE.format("walk"), "--set swing_apex=1", r"e\.g\. ([\d.]+)", "--set swing_apex={}"),
    (SOLVE.format("run"), "--set flight=0.001", r"e\.g\. ([\d.]+)", "--set flight={}"),
    (SOLVE.format("jump"), "--set flight=0.001", r"e\.g\. ([\d.]+)", "--set flight={}"),
    (SOLVE.format("squat"), "--set foo", r"e\.g\. (--set \S+)", "{}"),
    (SIMULATE.format("squat"), "--set foo", r"e\.g\. (--set \S+)", "{}"),
    (SIMULATE.format("walk"), "--real-time --control gains", r"give (--control mpc)", "--real-time {}"),
    (SIMULATE.format("walk"), "--time-step 0.01", r"longer (--control-period)", "--time-step 0.01 {} 0.01"),
    (SIMULATE.format("walk"), "--jitter 0.01", r"at most (--delay)", "--jitter 0.01 {} 0.01"),
    (SIMULATE.format("walk"), "--push t=1", r"e\.g\. (--push \S+)", "{}"),
    (SIMULATE.format("walk"), "--terrain tiles", r"e\.g\. (--terrain \S+)", "{}"),
    (SIMULATE.format("walk"), "--terrain ramp=nan", r"e\.g\. (--terrain \S+)", "{}"),
    (SIMULATE.format("walk"), "--seed -1", r"a whole number from (\d)", "--seed {}"),
    (SIMULATE.format("walk"), "--payload 1 --payload-at trunk", r"e\.g\. (--payload-at \S+)", "--payload 1 {}"),
]
DOUBTED = [  # likewise, what is a warning, and is none then
    (SOLVE.format("walk"), "--power-limit motor_knee_left=1e-9", "may have too little power", r"(--power-limit [^\s)]+)", "{}"),
]
# Options of other programs in texts of ours.
FOREIGN = {"--check", "--print", "--expand-auto-inertials", "--dropdtd", "--noent", "--build", "--parallel", "--target",
           "--flatten"}


def run(arguments):
    return subprocess.run([BIELLE] + arguments.split(), capture_output=True, text=True)


def test_following():
    for command, refused, told, followed in FOLLOWED:
        first = run(command + refused)
        assert first.returncode == 2, f"{command + refused}: status {first.returncode}\n{first.stderr}"
        remedy = re.search(told, first.stderr.rstrip())
        assert remedy, f"{command + refused}: no {told} in\n{first.stderr}"
        second = run(command + followed.format(remedy[1]))
        assert second.returncode == 0, f"{command + refused}: {remedy[0]!r} leads to\n{second.stderr}"
        assert "no posture was found" not in second.stdout, f"{command + refused}: {remedy[0]!r} leads to\n{second.stdout}"
    assert not os.path.exists("nowhere"), "a dry run wrote something"


def test_doubts():
    for command, doubtful, doubt, told, followed in DOUBTED:
        first = run(command + doubtful)
        text = first.stdout + first.stderr
        remedy = re.search(told, text)
        assert first.returncode == 0 and doubt in text and remedy, f"{command + doubtful}: no {told} in\n{text}"
        second = run(command + followed.format(remedy[1]))
        text = second.stdout + second.stderr
        assert second.returncode == 0 and doubt not in text, f"{command + doubtful}: {remedy[0]!r} leads to\n{text}"


def test_layers():
    """Those of the page are those that the command knows, and tells."""
    scene = (SOURCE / "src/report/scene.js").read_text()
    layers = re.findall(r"\['(\w+)', '[^']*', (?:true|false)\]", scene[scene.index("const LAYERS"):scene.index("class Scene")])
    told = run("report nowhere --hide com,foo").stderr
    assert "--hide 'foo'" in told and f"choose some of: {', '.join(layers)};" in told, (layers, told)
    assert "no such layer" not in run("report nowhere --show " + ",".join(layers)).stderr


def list_options(text):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text))


def test_options():
    known = set(FOREIGN)
    for page in (SOURCE / "src/cli/help").glob("*.txt"):
        known |= list_options(page.read_text())
    motions = re.findall(r"^  ([a-z-]+) ", run("solve --help").stdout, re.M)
    for command in ["", "report", "info", "robots"] + ["solve " + motion for motion in motions]:
        known |= list_options(run(command + " --help").stdout)
    assert {"--payload-at", "--free-timings", "--footholds", "--evaluate"} <= known
    for path in sorted((SOURCE / "src").rglob("*.cpp")):
        if path.name == "film.cpp":  # runs a browser
            continue
        text = re.sub(r'"\s*\n\s*"', "", re.sub(r"^\s*//.*$", "", path.read_text(), flags=re.M))
        for literal in re.findall(r'"((?:[^"\\\n]|\\.)*)"', text):
            if " " in literal:
                unknown = list_options(literal) - known
                assert not unknown, f"{path}: there is no {', '.join(unknown)}: {literal!r}"


test_following()
test_doubts()
test_layers()
test_options()
